//! Distances of the texels of a tile to a set of line segments, exact and fast.
//!
//! A tile looks only at the segments that can be nearest to one of its texels. They are found from those of the tile
//! around it: a segment is left out if a known point is nearer to all four corners of the tile than the segment is. The
//! places that are nearer to a point than to a segment form a convex set, so then the point is nearer to all of the tile.

use crate::math::vectorized;

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

/// Memory for [`Segments::nearest_in`].
#[derive(Debug, Default)]
pub(super) struct Room {
    /// Squares of the distances to the four corners.
    squares: [Vec<[f32; LANES]>; 4],
    keep: Vec<[f32; LANES]>,
}

/// The top left and the bottom right of a tile, texels.
pub(super) type Bounds = [[f32; 2]; 2];

#[inline(always)]
fn square(at: [f32; 2], start: [f32; 2], along: [f32; 2], inverse: f32) -> f32 {
    let [x, y] = [at[0] - start[0], at[1] - start[1]];
    let share = ((x * along[0] + y * along[1]) * inverse).clamp(0.0, 1.0);
    let [x, y] = [x - share * along[0], y - share * along[1]];
    x * x + y * y
}

fn corners([min, max]: Bounds) -> [[f32; 2]; 4] {
    [min, [max[0], min[1]], [min[0], max[1]], max]
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

    /// Replaces `out` by those segments of which one is nearest to each place of a tile; returns the squares of the
    /// distances of its corners.
    pub(super) fn nearest_in(&self, bounds: Bounds, room: &mut Room, out: &mut Self) -> [f32; 4] {
        out.clear();
        let least = self.corners(bounds, room);
        if self.len <= 2 {
            (0..self.len).for_each(|i| out.add(self.get(i)));
            return least;
        }
        let corners = corners(bounds);
        let mut nearest = [0; 4];
        for ((squares, least), nearest) in room.squares.iter().zip(least).zip(&mut nearest) {
            *nearest = squares.as_flattened().iter().position(|&square| square == least).unwrap_or(0);
        }
        let points: [_; 4] = std::array::from_fn(|i| self.nearest_point(nearest[i], corners[i]));
        let bounds = points.map(|point| corners.map(|corner| square(corner, point, [0.0; 2], 0.0)));
        room.mark(&bounds);
        for i in nearest {
            room.keep[i / LANES][i % LANES] = 1.0;
        }
        for (i, keep) in room.keep.iter().enumerate() {
            for (lane, &keep) in keep.iter().enumerate() {
                if keep > 0.0 && i * LANES + lane < self.len {
                    out.add(self.get(i * LANES + lane));
                }
            }
        }
        least
    }

    /// Squares of the distances of a tile's corners to the nearest segment; `room` has those to all.
    pub(super) fn corners(&self, bounds: Bounds, room: &mut Room) -> [f32; 4] {
        let mut least = [FAR; 4];
        for ((squares, corner), least) in room.squares.iter_mut().zip(corners(bounds)).zip(&mut least) {
            squares.resize(self.blocks.len(), [0.0; LANES]);
            *least = self.squares_at(corner, squares).min(FAR);
        }
        least
    }

    /// Squares of the distances of all segments to one place; returns the least.
    fn squares_at(&self, at: [f32; 2], out: &mut [[f32; LANES]]) -> f32 {
        vectorized(
            #[inline(always)]
            || {
                let mut least = [f32::MAX; LANES];
                for ([x, y, along_x, along_y, inverse], out) in self.blocks.iter().zip(out) {
                    let mut squares = [0.0; LANES];
                    for i in 0..LANES {
                        squares[i] = square(at, [x[i], y[i]], [along_x[i], along_y[i]], inverse[i]);
                    }
                    for i in 0..LANES {
                        least[i] = if squares[i] < least[i] { squares[i] } else { least[i] };
                    }
                    *out = squares;
                }
                least.into_iter().fold(f32::MAX, f32::min)
            },
        )
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

impl Room {
    /// Marks the segments that are nearer to one corner at least than each of four points, given the squares of the
    /// distances of the points to the corners.
    fn mark(&mut self, bounds: &[[f32; 4]; 4]) {
        let n = self.squares[0].len();
        self.keep.clear();
        self.keep.resize(n, [0.0; LANES]);
        let [first, second, third, fourth] = &self.squares;
        vectorized(
            #[inline(always)]
            || {
                let squares = first.iter().zip(second).zip(third.iter().zip(fourth));
                for (keep, ((first, second), (third, fourth))) in self.keep.iter_mut().zip(squares) {
                    let mut kept = [1.0; LANES];
                    for bound in bounds {
                        for i in 0..LANES {
                            let is_farther = (bound[0] <= first[i])
                                & (bound[1] <= second[i])
                                & (bound[2] <= third[i])
                                & (bound[3] <= fourth[i]);
                            kept[i] = if is_farther { 0.0 } else { kept[i] };
                        }
                    }
                    *keep = kept;
                }
            },
        );
    }
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
            let (mut large, mut small, mut room) = (Segments::default(), Segments::default(), Room::default());
            all.nearest_in([[0.5; 2], [31.5; 2]], &mut room, &mut large);
            for at in [[0.5, 0.5], [8.5, 16.5], [24.5, 24.5]] {
                large.nearest_in([at, [at[0] + 7.0, at[1] + 7.0]], &mut room, &mut small);
                let (exact, found) = (all.tile(at), small.tile(at));
                for (exact, found) in exact.as_flattened().iter().zip(found.as_flattened()) {
                    assert!((exact.sqrt() - found.sqrt()).abs() <= 1e-3, "seed {seed}: {exact} {found}");
                }
            }
        }
    }
}
