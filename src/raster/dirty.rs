//! [`DirtyTiles`]: which parts of a surface changed.

use super::TexelRect;
use glam::UVec2;

/// Bits of a word of the tile set.
const WORD: usize = u64::BITS as usize;

/// What one rectangle costs beside its texels, in tiles: an upload call is about as dear as 1,024 texels.
const CALL: u64 = 4;

/// Below this depth of the splitting tree the best line is cut, further down the one in the middle, so that no set of
/// tiles makes the tree deep.
const MAX_BEST_SPLITS: u32 = 16;

/// The changed parts of a surface, in tiles of [`DirtyTiles::TILE`] texels.
///
/// Asking an empty set costs nothing, and it owns no memory before the first mark; all else costs in proportion to the marked tiles.
///
/// ```
/// use bevy_crack::raster::{DirtyTiles, TexelRect};
///
/// let mut dirty = DirtyTiles::new([100, 50].into());
/// dirty.mark(TexelRect { min: [90, 40].into(), max: [91, 41].into() });
/// let mut rects = Vec::new();
/// dirty.take_rects(&mut rects);
/// assert_eq!(rects, [TexelRect { min: [80, 32].into(), max: [96, 48].into() }]);
/// assert!(dirty.is_empty());
/// ```
#[derive(Clone, Debug, Default)]
pub struct DirtyTiles {
    size: UVec2,
    /// One bit per tile; a row of tiles is `words_per_row` words. Empty before the first mark.
    tiles: Vec<u64>,
    /// One bit per row of tiles that has a marked one.
    rows: Vec<u64>,
    marked: bool,
}

/// Columns and rows of tiles, `min` included, `max` excluded.
type TileRect = TexelRect;

impl DirtyTiles {
    /// Side of a tile, texels.
    pub const TILE: u32 = 16;

    /// Nothing changed on a surface of `size` texels.
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
        }
        self.marked = true;
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
        self.drain(|_, _| {});
    }

    /// Unmarks everything and appends rectangles that cover all marked tiles: disjoint, of whole tiles (clipped to the
    /// surface), few, in an order that depends on the marked tiles alone.
    ///
    /// An unmarked tile is covered only where a rectangle more would cost more than the tile.
    pub fn take_rects(&mut self, rects: &mut Vec<TexelRect>) {
        if self.is_empty() {
            return;
        }
        let mut tiles = Vec::new();
        self.drain(|x, y| tiles.push(UVec2::new(x, y)));
        let first = rects.len();
        cover(&mut tiles, 0, &mut Vec::new(), rects);
        for rect in &mut rects[first..] {
            rect.min *= Self::TILE;
            rect.max = (rect.max * Self::TILE).min(self.size);
        }
    }

    /// Unmarks everything and calls `visit` with column and row of every marked tile, row by row.
    fn drain(&mut self, mut visit: impl FnMut(u32, u32)) {
        if !self.marked {
            return;
        }
        self.marked = false;
        let words = self.words_per_row();
        for (i, row_bits) in self.rows.iter_mut().enumerate() {
            for_each_bit(std::mem::take(row_bits), |bit| {
                let row = i * WORD + bit;
                for (word, tiles) in self.tiles[row * words..(row + 1) * words].iter_mut().enumerate() {
                    for_each_bit(std::mem::take(tiles), |bit| visit((word * WORD + bit) as u32, row as u32));
                }
            });
        }
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

/// Appends disjoint rectangles that cover `tiles`: cuts their bounds in two, covers both sides, and takes one
/// rectangle for both where that is not dearer. Sides of a cut never overlap, so neither do the rectangles.
fn cover(tiles: &mut [UVec2], level: u32, spans: &mut Vec<(u32, u32)>, out: &mut Vec<TileRect>) {
    let whole = bounds(tiles);
    // A second rectangle can save at most the unmarked tiles.
    if whole.area() - tiles.len() as u64 <= CALL {
        out.push(whole);
        return;
    }
    let (axis, line) = if level < MAX_BEST_SPLITS { best_cut(tiles, whole, spans) } else { middle_cut(whole) };
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
    cover(low, level + 1, spans, out);
    cover(high, level + 1, spans, out);
    if out[first..].iter().map(cost).sum::<u64>() >= cost(&whole) {
        out.truncate(first);
        out.push(whole);
    }
}

/// Halves the longer side.
fn middle_cut(whole: TileRect) -> (usize, u32) {
    let size = whole.size();
    let axis = usize::from(size.y > size.x);
    (axis, whole.min[axis] + size[axis] / 2)
}

/// The axis and line that leave the smallest bounds on both sides; of equals the one nearest the middle, then the first.
fn best_cut(tiles: &[UVec2], whole: TileRect, spans: &mut Vec<(u32, u32)>) -> (usize, u32) {
    let mut best = ((u64::MAX, u32::MAX), middle_cut(whole));
    for axis in 0..2 {
        let (start, n) = (whole.min[axis], whole.size()[axis] as usize);
        // For each line of tiles across the axis: the first and one past the last marked tile in it.
        spans.clear();
        spans.resize(n, (u32::MAX, 0));
        for tile in tiles {
            let span = &mut spans[(tile[axis] - start) as usize];
            *span = (span.0.min(tile[1 - axis]), span.1.max(tile[1 - axis] + 1));
        }
        let join = |a: (u32, u32), b: (u32, u32)| (a.0.min(b.0), a.1.max(b.1));
        // The bounds of the high side shrink to the first marked line; those of the low side end at the last one.
        let area = |lines: usize, span: (u32, u32)| lines as u64 * u64::from(span.1 - span.0);
        // spans[i] becomes the span of all lines from i on, high_start the first marked of them.
        let lines: Vec<(u32, u32)> = spans.clone();
        for i in (0..n - 1).rev() {
            spans[i] = join(spans[i], spans[i + 1]);
        }
        let mut high_start = vec![0; n];
        for i in (0..n).rev() {
            high_start[i] = if lines[i].1 > 0 { i } else { high_start[i + 1] };
        }
        let (mut low, mut low_end) = ((u32::MAX, 0), 0);
        for i in 1..n {
            if lines[i - 1].1 > 0 {
                low = join(low, lines[i - 1]);
                low_end = i;
            }
            let sum = area(low_end, low) + area(n - high_start[i], spans[i]);
            let off_middle = (2 * i as u32).abs_diff(n as u32);
            if (sum, off_middle) < best.0 {
                best = ((sum, off_middle), (axis, start + i as u32));
            }
        }
    }
    best.1
}
