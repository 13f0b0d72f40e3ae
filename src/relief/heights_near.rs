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

/// Line segments in texel space, in arrays padded to whole blocks by segments that are far away.
#[derive(Clone, Debug, Default)]
pub(super) struct Segments {
    /// Starts.
    x: Vec<f32>,
    y: Vec<f32>,
    /// From start to end.
    along_x: Vec<f32>,
    along_y: Vec<f32>,
    /// 1 / the square of the length; 0 for points.
    inverse: Vec<f32>,
    len: usize,
}

/// Memory for [`Segments::nearest_in`].
#[derive(Debug, Default)]
pub(super) struct Room {
    /// Squares of the distances to the four corners.
    squares: [Vec<f32>; 4],
    keep: Vec<f32>,
}

/// The least and the greatest position of a tile's texel centers.
pub(super) type Bounds = [[f32; 2]; 2];

#[inline(always)]
fn square(at: [f32; 2], start: [f32; 2], along: [f32; 2], inverse: f32) -> f32 {
    let [x, y] = [at[0] - start[0], at[1] - start[1]];
    let share = ((x * along[0] + y * along[1]) * inverse).clamp(0.0, 1.0);
    let [x, y] = [x - share * along[0], y - share * along[1]];
    x * x + y * y
}

impl Segments {
    fn clear(&mut self) {
        for list in [&mut self.x, &mut self.y, &mut self.along_x, &mut self.along_y, &mut self.inverse] {
            list.clear();
        }
        self.len = 0;
    }

    /// Adds the segment between two points.
    pub(super) fn push(&mut self, a: [f32; 2], b: [f32; 2]) {
        let [along_x, along_y] = [b[0] - a[0], b[1] - a[1]];
        let square = along_x * along_x + along_y * along_y;
        self.add([a[0], a[1], along_x, along_y, if square > 1e-12 { 1.0 / square } else { 0.0 }]);
    }

    fn add(&mut self, [x, y, along_x, along_y, inverse]: [f32; 5]) {
        if self.len == self.x.len() {
            let padded = self.len + LANES;
            self.x.resize(padded, FAR.sqrt());
            self.y.resize(padded, FAR.sqrt());
            for list in [&mut self.along_x, &mut self.along_y, &mut self.inverse] {
                list.resize(padded, 0.0);
            }
        }
        let i = self.len;
        (self.x[i], self.y[i], self.along_x[i], self.along_y[i], self.inverse[i]) = (x, y, along_x, along_y, inverse);
        self.len += 1;
    }

    fn get(&self, i: usize) -> [f32; 5] {
        [self.x[i], self.y[i], self.along_x[i], self.along_y[i], self.inverse[i]]
    }

    /// The point of segment `i` that is nearest to `at`.
    fn nearest_point(&self, i: usize, at: [f32; 2]) -> [f32; 2] {
        let [x, y, along_x, along_y, inverse] = self.get(i);
        let share = (((at[0] - x) * along_x + (at[1] - y) * along_y) * inverse).clamp(0.0, 1.0);
        [x + share * along_x, y + share * along_y]
    }

    /// Replaces `out` by those segments of which one is nearest to each place of a tile.
    pub(super) fn nearest_in(&self, [min, max]: Bounds, room: &mut Room, out: &mut Self) {
        out.clear();
        if self.len <= 2 {
            (0..self.len).for_each(|i| out.add(self.get(i)));
            return;
        }
        let corners = [min, [max[0], min[1]], [min[0], max[1]], max];
        let mut nearest = [0; 4];
        for ((squares, corner), nearest) in room.squares.iter_mut().zip(corners).zip(&mut nearest) {
            squares.resize(self.x.len(), 0.0);
            let least = self.squares_at(corner, squares);
            *nearest = squares.iter().position(|&square| square == least).unwrap_or(0);
        }
        let points: [_; 4] = std::array::from_fn(|i| self.nearest_point(nearest[i], corners[i]));
        let bounds = points.map(|point| corners.map(|corner| square(corner, point, [0.0; 2], 0.0)));
        room.mark(&bounds);
        for i in nearest {
            room.keep[i] = 1.0;
        }
        for (i, &keep) in room.keep[..self.len].iter().enumerate() {
            if keep > 0.0 {
                out.add(self.get(i));
            }
        }
    }

    /// Squares of the distances of all segments to one place; returns the least.
    fn squares_at(&self, at: [f32; 2], out: &mut [f32]) -> f32 {
        vectorized(
            #[inline(always)]
            || {
                let mut least = [f32::MAX; LANES];
                let n = out.len();
                let lists = [&self.x[..n], &self.y[..n], &self.along_x[..n], &self.along_y[..n], &self.inverse[..n]];
                for (block, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
                    let [x, y, along_x, along_y, inverse] = lists.map(|list| &list[block * LANES..(block + 1) * LANES]);
                    for i in 0..LANES {
                        out[i] = square(at, [x[i], y[i]], [along_x[i], along_y[i]], inverse[i]);
                        least[i] = if out[i] < least[i] { out[i] } else { least[i] };
                    }
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
        self.keep.resize(n, 0.0);
        let keep = &mut self.keep[..n];
        let squares = self.squares.each_ref().map(|list| &list[..n]);
        vectorized(
            #[inline(always)]
            || {
                for (block, keep) in keep.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
                    let squares = squares.map(|list| &list[block * LANES..(block + 1) * LANES]);
                    for (i, keep) in keep.iter_mut().enumerate() {
                        let is_farther = |bound: &[f32; 4]| {
                            (bound[0] <= squares[0][i])
                                & (bound[1] <= squares[1][i])
                                & (bound[2] <= squares[2][i])
                                & (bound[3] <= squares[3][i])
                        };
                        let out = is_farther(&bounds[0])
                            | is_farther(&bounds[1])
                            | is_farther(&bounds[2])
                            | is_farther(&bounds[3]);
                        *keep = if out { 0.0 } else { 1.0 };
                    }
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
