//! An index of the lines of planned rays, so that forks find out quickly whether they have room.

use glam::{UVec2, Vec2};

const NONE: u32 = u32::MAX;

/// The most cells along a side.
const MOST_CELLS: f32 = 512.0;

/// A straight piece of a ray.
#[derive(Clone, Copy, Debug)]
struct Piece {
    ray: usize,
    ends: (Vec2, Vec2),
}

/// The pieces of all rays, by the cells that they reach.
#[derive(Clone, Debug)]
pub(super) struct RayLines {
    /// What is asked for: pieces this near.
    within: f32,
    cells: UVec2,
    /// Cells per pattern unit.
    per_unit: Vec2,
    head: Vec<u32>,
    /// Piece and next entry.
    entries: Vec<(u32, u32)>,
    pieces: Vec<Piece>,
}

impl RayLines {
    /// An index over `extent` that is asked for pieces no further away than `within`.
    pub(super) fn new(extent: Vec2, within: f32) -> Self {
        let side = within.max(extent.max_element() / MOST_CELLS);
        let cells = (extent / side).ceil().as_uvec2().max(UVec2::ONE);
        Self {
            within,
            cells,
            per_unit: cells.as_vec2() / extent,
            head: vec![NONE; cells.x as usize * cells.y as usize],
            entries: Vec::new(),
            pieces: Vec::new(),
        }
    }

    fn slots(&self, low: Vec2, high: Vec2) -> impl Iterator<Item = usize> + use<> {
        let cell = |pos: Vec2| (pos * self.per_unit).max(Vec2::ZERO).as_uvec2().min(self.cells - UVec2::ONE);
        let (low, high, width) = (cell(low), cell(high), self.cells.x);
        (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| y as usize * width as usize + x as usize))
    }

    /// Adds the line of a ray.
    pub(super) fn add(&mut self, ray: usize, line: &[Vec2]) {
        for pair in line.windows(2) {
            let (piece, ends) = (self.pieces.len() as u32, (pair[0], pair[1]));
            self.pieces.push(Piece { ray, ends });
            for slot in self.slots(ends.0.min(ends.1), ends.0.max(ends.1)) {
                self.entries.push((piece, self.head[slot]));
                self.head[slot] = self.entries.len() as u32 - 1;
            }
        }
    }

    /// Whether no ray but `except` passes as near to `pos` as this index was made for.
    pub(super) fn is_clear(&self, pos: Vec2, except: usize) -> bool {
        // A little further, for rounding.
        let reach = Vec2::splat(1.01 * self.within);
        self.slots(pos - reach, pos + reach).all(|slot| {
            let mut entry = self.head[slot];
            while entry != NONE {
                let (piece, next) = self.entries[entry as usize];
                let Piece { ray, ends } = self.pieces[piece as usize];
                if ray != except && gap(pos, ends) <= self.within {
                    return false;
                }
                entry = next;
            }
            true
        })
    }
}

/// Distance from a place to a segment.
fn gap(pos: Vec2, (a, b): (Vec2, Vec2)) -> f32 {
    let way = b - a;
    let share = ((pos - a).dot(way) / way.length_squared().max(1e-12)).clamp(0.0, 1.0);
    pos.distance(a + way * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// Equal to asking every piece, also beyond the border.
    #[test]
    fn what_is_clear_equals_a_search_of_all_pieces() {
        let mut rng = Rng::new(41);
        for case in 0..60 {
            let extent = Vec2::new(rng.range(0.2, 3.0), rng.range(0.2, 3.0));
            let (within, count) = (rng.range(0.004, 0.3), 1 + case % 17);
            let mut place = |beyond: f32| Vec2::new(rng.range(-beyond, 1.0 + beyond), rng.range(-beyond, 1.0 + beyond));
            let rays: Vec<Vec<Vec2>> =
                (0..count).map(|ray| (0..2 + ray % 5).map(|_| place(0.1) * extent).collect()).collect();
            let mut lines = RayLines::new(extent, within);
            rays.iter().enumerate().for_each(|(ray, line)| lines.add(ray, line));
            let mut clear = 0;
            for i in 0..200 {
                let (pos, except) = (place(0.05) * extent, i % count);
                let others = rays.iter().enumerate().filter(|(ray, _)| *ray != except);
                let expected = others.flat_map(|(_, line)| line.windows(2)).all(|p| gap(pos, (p[0], p[1])) > within);
                assert_eq!(lines.is_clear(pos, except), expected, "case {case}, {pos} of {extent}, but {except}");
                clear += u32::from(expected);
            }
            assert!(count > 1 || clear == 200);
        }
    }
}
