//! [`DirtyTiles`]: which parts of a surface changed.

use super::TexelRect;
use glam::UVec2;

/// Bits of a word of the tile set.
const WORD: usize = u64::BITS as usize;

/// Cost of one rectangle in addition to its texels, in tiles: a copy in a batch costs about as much as 256 texels.
const CALL: u64 = 4;

/// Up to this depth of the splitting tree the best line is cut, below it the middle one, so that no set of tiles
/// makes the tree deep.
const MAX_BEST_SPLITS: u32 = 16;

/// With more marks than this they are no longer kept one by one: rectangles consist of whole tiles then.
const MAX_MARKS: usize = 256;

/// Initial capacity for marks and tiles, so that most surfaces allocate once.
const FEW: usize = 64;

/// The changed parts of a surface, in tiles of [`DirtyTiles::TILE`] texels.
///
/// Querying an empty set costs nothing, and the set allocates no memory before the first mark. Everything else costs
/// in proportion to the marked tiles. The first few hundred marks are kept exactly, so that rectangles are no larger
/// than what was marked.
///
/// ```
/// use bevy_crack::raster::{DirtyTiles, TexelRect};
///
/// let mut dirty = DirtyTiles::new([100, 50].into());
/// dirty.mark(TexelRect { min: [90, 40].into(), max: [91, 41].into() });
/// let mut rects = Vec::new();
/// dirty.take_rects(&mut rects);
/// assert_eq!(rects, [TexelRect { min: [90, 40].into(), max: [91, 41].into() }]);
/// assert!(dirty.is_empty());
/// ```
#[derive(Clone, Debug, Default)]
pub struct DirtyTiles {
    size: UVec2,
    /// One bit per tile; a row of tiles is `words_per_row` words. Empty before the first mark.
    tiles: Vec<u64>,
    /// One bit per row of tiles: whether it has a marked tile.
    rows: Vec<u64>,
    /// The marked rectangles, up to one more than [`MAX_MARKS`].
    marks: Vec<TexelRect>,
    marked: bool,
}

/// Columns and rows of tiles, `min` included, `max` excluded.
type TileRect = TexelRect;

impl DirtyTiles {
    /// Side of a tile, texels.
    pub const TILE: u32 = 8;

    /// An empty set for a surface of `size` texels.
    #[must_use]
    pub fn new(size: UVec2) -> Self {
        Self { size, ..Self::default() }
    }

    fn words_per_row(&self) -> usize {
        (self.size.x.div_ceil(Self::TILE) as usize).div_ceil(WORD)
    }

    /// Marks every tile that `rect` touches (clipped to the surface).
    pub fn mark(&mut self, rect: TexelRect) {
        let rect = rect.intersect(TexelRect::whole(self.size));
        if rect.is_empty() {
            return;
        }
        let words = self.words_per_row();
        if self.tiles.is_empty() {
            let rows = self.size.y.div_ceil(Self::TILE) as usize;
            self.tiles = vec![0; rows * words];
            self.rows = vec![0; rows.div_ceil(WORD)];
            self.marks.reserve(FEW);
        }
        self.marked = true;
        if self.marks.len() <= MAX_MARKS {
            self.marks.push(rect);
        }
        let tile = |texel: u32| (texel / Self::TILE) as usize;
        let (left, right) = (tile(rect.min.x), tile(rect.max.x - 1));
        for row in tile(rect.min.y)..=tile(rect.max.y - 1) {
            self.rows[row / WORD] |= 1 << (row % WORD);
            for word in left / WORD..=right / WORD {
                let first = left.max(word * WORD) - word * WORD;
                let last = right.min(word * WORD + WORD - 1) - word * WORD;
                self.tiles[row * words + word] |= (!0 >> (WORD - 1 - (last - first))) << first;
            }
        }
    }

    /// Whether nothing is marked.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        !self.marked
    }

    /// Unmarks everything.
    pub fn clear(&mut self) {
        self.drain(usize::MAX, |_, _| {});
        self.marks.clear();
    }

    /// Unmarks everything and appends rectangles that cover everything that was marked. They are few, disjoint and
    /// not empty, and their order depends only on the marked tiles. Each is the smallest rectangle around the marks
    /// within some tiles; after more than 256 marks it consists of whole tiles.
    ///
    /// An unmarked tile is covered only where an additional rectangle would cost more than the tile.
    pub fn take_rects(&mut self, rects: &mut Vec<TexelRect>) {
        self.take_some_rects(usize::MAX, rects);
    }

    /// The same for the first rows of tiles in which `least` tiles are marked: they are found sooner than all.
    pub(crate) fn take_some_rects(&mut self, least: usize, rects: &mut Vec<TexelRect>) {
        if self.is_empty() {
            return;
        }
        let mut tiles = Vec::with_capacity(FEW);
        self.drain(least, |x, y| tiles.push(UVec2::new(x, y)));
        let first = rects.len();
        cover(&mut tiles, 0, rects);
        for rect in &mut rects[first..] {
            rect.min *= Self::TILE;
            rect.max = (rect.max * Self::TILE).min(self.size);
            if self.marks.len() <= MAX_MARKS {
                let tiles = *rect;
                let marked = self.marks.iter().map(|mark| mark.intersect(tiles));
                *rect = marked.fold(TexelRect::default(), TexelRect::union);
            }
        }
        if self.is_empty() {
            self.marks.clear();
        }
    }

    /// Calls `visit` with column and row of every marked tile, row by row, and unmarks it, until that were `least` at the end of a row.
    fn drain(&mut self, least: usize, mut visit: impl FnMut(u32, u32)) {
        let (words, mut count) = (self.words_per_row(), 0);
        for (i, row_bits) in self.rows.iter_mut().enumerate() {
            while *row_bits != 0 {
                if count >= least {
                    return;
                }
                let row = i * WORD + row_bits.trailing_zeros() as usize;
                *row_bits &= *row_bits - 1;
                for (word, tiles) in self.tiles[row * words..(row + 1) * words].iter_mut().enumerate() {
                    count += tiles.count_ones() as usize;
                    for_each_bit(std::mem::take(tiles), |bit| visit((word * WORD + bit) as u32, row as u32));
                }
            }
        }
        self.marked = false;
    }
}

fn for_each_bit(mut bits: u64, mut visit: impl FnMut(usize)) {
    while bits != 0 {
        visit(bits.trailing_zeros() as usize);
        bits &= bits - 1;
    }
}

fn cost(rect: &TileRect) -> u64 {
    rect.area() + CALL
}

fn bounds(tiles: &[UVec2]) -> TileRect {
    let mut rect = TileRect { min: UVec2::MAX, max: UVec2::ZERO };
    for &tile in tiles {
        rect.min = rect.min.min(tile);
        rect.max = rect.max.max(tile + 1);
    }
    rect
}

/// Appends disjoint rectangles that cover `tiles`: cuts their bounds in two, covers both sides, and uses one
/// rectangle for both where that is not more expensive. The sides of a cut never overlap, so the rectangles do not
/// either.
fn cover(tiles: &mut [UVec2], level: u32, out: &mut Vec<TileRect>) {
    let whole = bounds(tiles);
    // A second rectangle can save at most the unmarked tiles.
    if whole.area() - tiles.len() as u64 <= CALL {
        out.push(whole);
        return;
    }
    let (axis, line) = if level < MAX_BEST_SPLITS { best_cut(tiles, whole) } else { middle_cut(whole) };
    let mut n_low = 0;
    for i in 0..tiles.len() {
        if tiles[i][axis] < line {
            tiles.swap(i, n_low);
            n_low += 1;
        }
    }
    let (low, high) = tiles.split_at_mut(n_low);
    if low.is_empty() || high.is_empty() {
        out.push(whole);
        return;
    }
    let first = out.len();
    cover(low, level + 1, out);
    cover(high, level + 1, out);
    if out[first..].iter().map(cost).sum::<u64>() >= cost(&whole) {
        out.truncate(first);
        out.push(whole);
    }
}

/// Cuts the longer side in the middle.
fn middle_cut(whole: TileRect) -> (usize, u32) {
    let size = whole.size();
    let axis = usize::from(size.y > size.x);
    (axis, whole.min[axis] + size[axis] / 2)
}

/// The axis and line that leave the smallest bounds on both sides. Ties go to a cut across the longer side, then to
/// the one nearest the middle, then to the first.
fn best_cut(tiles: &[UVec2], whole: TileRect) -> (usize, u32) {
    let size = whole.size();
    let mut best = ((u64::MAX, true, u32::MAX), middle_cut(whole));
    let (mut few, mut many) = ([Bounds::EMPTY; 2 * FEW], Vec::new());
    for axis in 0..2 {
        let n = size[axis];
        let both = if n as usize <= FEW {
            &mut few[..2 * n as usize]
        } else {
            many.resize(2 * n as usize, Bounds::EMPTY);
            &mut many[..2 * n as usize]
        };
        both.fill(Bounds::EMPTY);
        // The bounds of each line of tiles across the axis, then of all from that line on.
        let (lines, onward) = both.split_at_mut(n as usize);
        for tile in tiles {
            let line = tile[axis] - whole.min[axis];
            lines[line as usize].add(Bounds { first: line, last: line, low: tile[1 - axis], high: tile[1 - axis] });
        }
        onward.copy_from_slice(lines);
        for i in (1..onward.len()).rev() {
            let next = onward[i];
            onward[i - 1].add(next);
        }
        let mut before = Bounds::EMPTY;
        for line in 1..n {
            before.add(lines[line as usize - 1]);
            let area = before.area() + onward[line as usize].area();
            let key = (area, n < size[1 - axis], (2 * line).abs_diff(n));
            if key < best.0 {
                best = (key, (axis, whole.min[axis] + line));
            }
        }
    }
    best.1
}

/// The bounds of some tiles: along an axis `first..=last`, across it `low..=high`.
#[derive(Clone, Copy)]
struct Bounds {
    first: u32,
    last: u32,
    low: u32,
    high: u32,
}

impl Bounds {
    const EMPTY: Self = Self { first: u32::MAX, last: 0, low: u32::MAX, high: 0 };

    fn add(&mut self, other: Self) {
        self.first = self.first.min(other.first);
        self.last = self.last.max(other.last);
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    /// Zero if empty.
    fn area(&self) -> u64 {
        let side = |from: u32, to: u32| u64::from((to + 1).saturating_sub(from));
        side(self.first, self.last) * side(self.low, self.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Grid, math::Rng};
    use std::ops::Range;

    fn below(rng: &mut Rng, n: u32) -> u32 {
        rng.next_u32() % n
    }

    /// A rectangle of up to `most` texels a side, anywhere, also outside.
    fn random_rect(rng: &mut Rng, size: UVec2, most: u32) -> TexelRect {
        let min = UVec2::new(below(rng, size.x + 20), below(rng, size.y + 20));
        TexelRect { min, max: min + UVec2::new(below(rng, most), below(rng, most)) }
    }

    #[test]
    fn rectangles_cover_what_was_marked_without_overlap() {
        let mut rng = Rng::new(5);
        for round in 0..400 {
            let size = UVec2::new(1 + below(&mut rng, 700), 1 + below(&mut rng, if round % 3 == 0 { 40 } else { 900 }));
            let mut dirty = DirtyTiles::new(size);
            let mut marked = Grid::new(size, 0u8);
            let n = if round % 10 == 0 { 2 * MAX_MARKS as u32 } else { 60 };
            let n = below(&mut rng, n) as usize;
            let mut n_marks = 0;
            for _ in 0..n {
                let rect = random_rect(&mut rng, size, if round % 2 == 0 { 30 } else { 200 });
                dirty.mark(rect);
                let rect = rect.intersect(TexelRect::whole(size));
                n_marks += usize::from(!rect.is_empty());
                for y in rect.min.y..rect.max.y {
                    for x in rect.min.x..rect.max.x {
                        marked.row_mut(y as usize)[x as usize] = 1;
                    }
                }
            }
            let empty = marked.as_slice().iter().all(|&texel| texel == 0);
            assert_eq!(dirty.is_empty(), empty);
            let mut again = dirty.clone();
            let (mut rects, mut repeated) = (Vec::new(), Vec::new());
            // Every third time in parts, which are found in the order of their rows.
            while round % 3 == 1 && !again.is_empty() {
                let first = repeated.len();
                again.take_some_rects(1 + below(&mut rng, 50) as usize, &mut repeated);
                assert!(repeated.len() > first, "nothing in a part");
                let highest = |rects: &[TexelRect]| rects.iter().map(|rect| rect.min.y / DirtyTiles::TILE).min();
                let lowest = |rects: &[TexelRect]| rects.iter().map(|rect| (rect.max.y - 1) / DirtyTiles::TILE).max();
                assert!(lowest(&repeated[..first]) < highest(&repeated[first..]) || first == 0);
            }
            if round % 3 == 1 {
                (rects, repeated) = (repeated.clone(), repeated);
                dirty.clear();
            }
            dirty.take_rects(&mut rects);
            again.take_rects(&mut repeated);
            assert_eq!(rects, repeated);
            assert!(dirty.is_empty() && dirty.tiles.iter().all(|&word| word == 0), "tiles left");
            for rect in &rects {
                assert!(!rect.is_empty() && rect.max.cmple(size).all(), "{rect:?} of {size}");
                if n_marks > MAX_MARKS {
                    assert_eq!(rect.min % DirtyTiles::TILE, UVec2::ZERO, "{rect:?}");
                    let whole = |max: u32, size: u32| max == size || max.is_multiple_of(DirtyTiles::TILE);
                    assert!(whole(rect.max.x, size.x) && whole(rect.max.y, size.y), "{rect:?}");
                } else {
                    let TexelRect { min, max } = *rect;
                    let holds = |x: Range<u32>, y: Range<u32>| {
                        y.flat_map(|y| x.clone().map(move |x| (x, y))).any(|(x, y)| marked.get(x, y) != Some(0))
                    };
                    let sides = [
                        (min.x..max.x, min.y..min.y + 1),
                        (min.x..max.x, max.y - 1..max.y),
                        (min.x..min.x + 1, min.y..max.y),
                        (max.x - 1..max.x, min.y..max.y),
                    ];
                    assert!(sides.into_iter().all(|(x, y)| holds(x, y)), "{rect:?} is not the least");
                }
                for y in rect.min.y..rect.max.y {
                    for texel in &mut marked.row_mut(y as usize)[rect.min.x as usize..rect.max.x as usize] {
                        assert!(*texel < 2, "two rectangles overlap");
                        *texel = 2;
                    }
                }
            }
            assert!(!marked.as_slice().contains(&1), "a marked texel is not covered");
        }
    }

    #[test]
    fn simple_shapes_take_few_rectangles() {
        let take = |marks: &[[u32; 4]]| {
            let mut dirty = DirtyTiles::new(UVec2::splat(1024));
            for &[x0, y0, x1, y1] in marks {
                dirty.mark(TexelRect { min: UVec2::new(x0, y0), max: UVec2::new(x1, y1) });
            }
            let mut rects = Vec::new();
            dirty.take_rects(&mut rects);
            rects
        };
        assert_eq!(take(&[]).len(), 0);
        assert_eq!(take(&[[0, 0, 1024, 1024]]), [TexelRect::whole(UVec2::splat(1024))]);
        assert_eq!(take(&[[100, 100, 200, 200]]).len(), 1);
        assert_eq!(take(&[[0, 0, 1, 1], [1023, 1023, 1024, 1024]]).len(), 2);
        // Two tiles with one between them: a call costs more than the tile.
        assert_eq!(take(&[[0, 0, 1, 1], [40, 0, 41, 1]]).len(), 1);
        // The arms of an L, and a frame around a hole.
        assert_eq!(take(&[[0, 0, 16, 1024], [0, 1008, 1024, 1024]]).len(), 2);
        assert!(take(&[[0, 0, 1024, 16], [0, 1008, 1024, 1024], [0, 0, 16, 1024], [1008, 0, 1024, 1024]]).len() <= 8);
    }

    #[test]
    fn a_fresh_set_owns_nothing_and_clear_empties() {
        let mut dirty = DirtyTiles::new(UVec2::splat(16_384));
        assert_eq!(dirty.tiles.capacity(), 0);
        dirty.mark(TexelRect { min: UVec2::splat(20_000), max: UVec2::splat(30_000) });
        dirty.mark(TexelRect { min: UVec2::splat(5), max: UVec2::splat(5) });
        assert!(dirty.is_empty(), "nothing was marked");
        dirty.mark(TexelRect { min: UVec2::splat(16_383), max: UVec2::splat(u32::MAX) });
        assert!(!dirty.is_empty(), "the last tile was marked");
        dirty.clear();
        let mut rects = Vec::new();
        dirty.take_rects(&mut rects);
        assert!(dirty.is_empty() && rects.is_empty(), "{rects:?}");
        let mut none = DirtyTiles::default();
        none.mark(TexelRect::whole(UVec2::splat(10)));
        assert!(none.is_empty(), "a surface without texels has no tiles");
    }

    /// Takes seconds if a set of tiles can make the tree deep.
    #[test]
    fn a_chequered_giant_and_a_staircase_end_soon() {
        let size = UVec2::splat(4096);
        for kind in 0..3 {
            let mut dirty = DirtyTiles::new(size);
            for y in 0..256 {
                for x in 0..256 {
                    let mark = match kind {
                        0 => (x + y) % 2 == 0,
                        1 => x == y,
                        _ => x % 9 == 0 && y % 9 == 0,
                    };
                    if mark {
                        let min = UVec2::new(x, y) * DirtyTiles::TILE;
                        dirty.mark(TexelRect { min, max: min + 1 });
                    }
                }
            }
            let mut rects = Vec::new();
            dirty.take_rects(&mut rects);
            assert!(!rects.is_empty(), "kind {kind}");
        }
    }
}
