//! Distances of the texels of a tile to a set of line segments, exact and fast.
//!
//! A tile looks only at the segments that can be nearest to one of its texels. They are found from those of the tile
//! around it: a segment is left out if a known point is nearer to all four corners of the tile than the segment is. The
//! places that are nearer to a point than to a segment form a convex set, so then the point is nearer to all of the tile.

/// Segments computed at once.
const LANES: usize = 8;

/// Side of the smallest tile, texels.
pub(super) const TILE: usize = 8;

/// The square of a distance to nothing, square texels.
pub(super) const FAR: f32 = 1e18;

/// Line segments in texel space, in blocks; the last block is filled up with segments that are far away.
#[derive(Clone, Debug, Default)]
pub(super) struct Segments {
    blocks: Vec<Block>,
    len: usize,
}

/// For each segment of a block: x and y of the start, x and y from start to end, and 1 / the square of the length, or
/// 0 for points.
type Block = [[f32; LANES]; 5];

/// A block of segments far away.
const NOTHING: Block = [[1e9; LANES], [1e9; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]];

/// Tiles of one size side by side and one below another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tiles {
    /// The top left corner of the first one, texels.
    pub(super) min: [f32; 2],
    /// Side of a tile, texels.
    pub(super) side: f32,
    /// Number of tiles across and down.
    pub(super) count: [usize; 2],
}

/// The distances of all segments to the corners of tiles.
#[derive(Debug, Default)]
pub(super) struct Corners {
    /// For each corner, row by row, the squares of the distances of all blocks of segments.
    squares: Vec<[f32; LANES]>,
    /// For each corner the square of the distance of the nearest segment, and which one that is.
    nearest: Vec<(f32, usize)>,
    /// Corners in a row.
    across: usize,
}

#[inline(always)]
fn square(at: [f32; 2], start: [f32; 2], along: [f32; 2], inverse: f32) -> f32 {
    let [x, y] = [at[0] - start[0], at[1] - start[1]];
    let share = ((x * along[0] + y * along[1]) * inverse).clamp(0.0, 1.0);
    let [x, y] = [x - share * along[0], y - share * along[1]];
    x * x + y * y
}

impl Tiles {
    /// The place of a corner.
    #[inline(always)]
    fn corner(&self, [x, y]: [usize; 2]) -> [f32; 2] {
        [self.min[0] + x as f32 * self.side, self.min[1] + y as f32 * self.side]
    }
}

/// The four corners of a tile, by column and row: top left, top right, bottom left, bottom right.
#[inline(always)]
fn around([x, y]: [usize; 2]) -> [[usize; 2]; 4] {
    [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]
}

impl Corners {
    /// Squares of the distances of the four corners of a tile to the nearest segment.
    #[inline(always)]
    pub(super) fn of(&self, tile: [usize; 2]) -> [f32; 4] {
        around(tile).map(|[x, y]| self.nearest[y * self.across + x].0)
    }
}

impl Segments {
    fn clear(&mut self) {
        self.blocks.clear();
        self.len = 0;
    }

    /// Adds the segment between two points.
    pub(super) fn push(&mut self, a: [f32; 2], b: [f32; 2]) {
        let [along_x, along_y] = [b[0] - a[0], b[1] - a[1]];
        let square = along_x * along_x + along_y * along_y;
        self.add([a[0], a[1], along_x, along_y, if square > 1e-12 { 1.0 / square } else { 0.0 }]);
    }

    fn add(&mut self, segment: [f32; 5]) {
        if self.len == self.blocks.len() * LANES {
            self.blocks.push(NOTHING);
        }
        if let Some(block) = self.blocks.last_mut() {
            for (values, value) in block.iter_mut().zip(segment) {
                values[self.len % LANES] = value;
            }
        }
        self.len += 1;
    }

    fn get(&self, i: usize) -> [f32; 5] {
        let ([x, y, along_x, along_y, inverse], i) = (&self.blocks[i / LANES], i % LANES);
        [x[i], y[i], along_x[i], along_y[i], inverse[i]]
    }

    /// The point of segment `i` that is nearest to `at`.
    fn nearest_point(&self, i: usize, at: [f32; 2]) -> [f32; 2] {
        let [x, y, along_x, along_y, inverse] = self.get(i);
        let share = (((at[0] - x) * along_x + (at[1] - y) * along_y) * inverse).clamp(0.0, 1.0);
        [x + share * along_x, y + share * along_y]
    }

    /// Measures the distances of all segments to the corners of `tiles`.
    #[inline(always)]
    pub(super) fn measure(&self, tiles: &Tiles, out: &mut Corners) {
        let [across, down] = tiles.count.map(|count| count + 1);
        out.across = across;
        out.nearest.clear();
        out.squares.resize(across * down * self.blocks.len(), [0.0; LANES]);
        for corner in 0..across * down {
            let squares = &mut out.squares[corner * self.blocks.len()..][..self.blocks.len()];
            out.nearest.push(self.squares_at(tiles.corner([corner % across, corner / across]), squares));
        }
    }

    /// Squares of the distances of all segments to one place; returns the least, and the first segment that has it.
    #[inline(always)]
    fn squares_at(&self, at: [f32; 2], out: &mut [[f32; LANES]]) -> (f32, usize) {
        let (mut least, mut places) = ([f32::MAX; LANES], [0u32; LANES]);
        for (place, ([x, y, along_x, along_y, inverse], out)) in (0..).zip(self.blocks.iter().zip(out)) {
            let mut squares = [0.0; LANES];
            for i in 0..LANES {
                squares[i] = square(at, [x[i], y[i]], [along_x[i], along_y[i]], inverse[i]);
            }
            for i in 0..LANES {
                let is_less = squares[i] < least[i];
                least[i] = if is_less { squares[i] } else { least[i] };
                places[i] = if is_less { place } else { places[i] };
            }
            *out = squares;
        }
        let square = least.into_iter().fold(f32::MAX, f32::min);
        let segment = |i: usize| if least[i] == square { places[i] as usize * LANES + i } else { usize::MAX };
        let segment = (0..LANES).map(segment).fold(usize::MAX, usize::min);
        if square <= FAR { (square, segment) } else { (FAR, 0) }
    }

    /// Replaces `out` by those segments of which one is nearest to each place of a tile among those whose corners are
    /// measured.
    #[inline(always)]
    pub(super) fn nearest_in(&self, tiles: &Tiles, tile: [usize; 2], measured: &Corners, out: &mut Self) {
        out.clear();
        if self.len <= 2 {
            (0..self.len).for_each(|i| out.add(self.get(i)));
            return;
        }
        let around = around(tile);
        let index = around.map(|[x, y]| y * measured.across + x);
        let nearest = index.map(|corner| measured.nearest[corner].1);
        let corners = around.map(|corner| tiles.corner(corner));
        let points: [_; 4] = std::array::from_fn(|i| self.nearest_point(nearest[i], corners[i]));
        let bounds = points.map(|point| corners.map(|corner| square(corner, point, [0.0; 2], 0.0)));
        let squares = index.map(|corner| &measured.squares[corner * self.blocks.len()..][..self.blocks.len()]);
        for block in 0..self.blocks.len() {
            let mut kept = nearer(&bounds, squares.map(|squares| &squares[block]));
            for i in nearest {
                kept |= u32::from(i / LANES == block) << (i % LANES);
            }
            if block + 1 == self.blocks.len() {
                // What the last block is filled up with is left out.
                kept &= u32::MAX >> (u32::BITS as usize - (self.len - block * LANES));
            }
            while kept != 0 {
                out.add(self.get(block * LANES + kept.trailing_zeros() as usize));
                kept &= kept - 1;
            }
        }
    }

    /// Squares of the distances of the texels of a tile, whose first center is at `at`, to the nearest segment.
    #[inline(always)]
    pub(super) fn tile(&self, at: [f32; 2]) -> [[f32; TILE]; TILE] {
        let mut least = [[FAR; TILE]; TILE];
        let columns: [f32; TILE] = std::array::from_fn(|x| at[0] + x as f32);
        for i in 0..self.len {
            let [x, y, along_x, along_y, inverse] = self.get(i);
            let mut down = at[1] - y;
            for row in &mut least {
                for (least, column) in row.iter_mut().zip(columns) {
                    let found = square([column, down], [x, 0.0], [along_x, along_y], inverse);
                    *least = if found < *least { found } else { *least };
                }
                down += 1.0;
            }
        }
        least
    }
}

/// The segments of a block, one for each bit, that are nearer to one corner at least than each of four points, given the
/// squares of the distances of the points to the corners.
#[inline(always)]
fn nearer(bounds: &[[f32; 4]; 4], [first, second, third, fourth]: [&[f32; LANES]; 4]) -> u32 {
    let mut kept = [u32::MAX; LANES];
    for bound in bounds {
        for i in 0..LANES {
            let is_farther =
                (bound[0] <= first[i]) & (bound[1] <= second[i]) & (bound[2] <= third[i]) & (bound[3] <= fourth[i]);
            kept[i] = if is_farther { 0 } else { kept[i] };
        }
    }
    (0..LANES).map(|i| kept[i] & 1 << i).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// A tile's distances from the segments that are left equal those from all, bit for bit or by rounding.
    #[test]
    fn segments_that_are_left_out_are_never_nearest() {
        for seed in 0..300 {
            let mut rng = Rng::new(seed);
            let scale = rng.range(1.0, 200.0);
            let mut all = Segments::default();
            let mut last = [rng.range(-20.0, 60.0), rng.range(-20.0, 60.0)];
            for _ in 0..1 + rng.next_u32() % 60 {
                let next = [last[0] + scale * 0.1 * rng.signed(), last[1] + scale * 0.1 * rng.signed()];
                all.push(last, next);
                last = next;
            }
            let (mut large, mut small, mut corners) = (Segments::default(), Segments::default(), Corners::default());
            let tiles = Tiles { min: [0.0; 2], side: 32.0, count: [1, 1] };
            all.measure(&tiles, &mut corners);
            all.nearest_in(&tiles, [0, 0], &corners, &mut large);
            let tiles = Tiles { side: 8.0, count: [4, 4], ..tiles };
            large.measure(&tiles, &mut corners);
            for tile in [[0, 0], [1, 2], [3, 3]] {
                large.nearest_in(&tiles, tile, &corners, &mut small);
                let at = tile.map(|at| 8.0 * at as f32 + 0.5);
                let (exact, found) = (all.tile(at), small.tile(at));
                for (exact, found) in exact.as_flattened().iter().zip(found.as_flattened()) {
                    assert!((exact.sqrt() - found.sqrt()).abs() <= 1e-3, "seed {seed}: {exact} {found}");
                }
            }
        }
    }
}
