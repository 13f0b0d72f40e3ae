//! [`Near`]: points by place, so that a tip finds what is close to it.

use glam::{IVec2, UVec2, Vec2};

/// Most cells along a side.
const MOST_CELLS: f32 = 512.0;

/// A point of a strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mark {
    pub(super) pos: Vec2,
    pub(super) strand: u32,
    /// Number of the point in its strand.
    pub(super) number: u32,
}

/// Points in the cells of a grid.
#[derive(Clone, Debug)]
pub(super) struct Near {
    cell: f32,
    count: UVec2,
    cells: Vec<Vec<Mark>>,
}

impl Near {
    /// An empty index for queries of up to `reach` over `extent`.
    pub(super) fn new(extent: Vec2, reach: f32) -> Self {
        // Small cells, so that few points outside the circle are looked at.
        let cell = (0.5 * reach).max(extent.max_element() / MOST_CELLS);
        let count = (extent / cell).floor().as_uvec2() + 1;
        Self { cell, count, cells: vec![Vec::new(); (count.x * count.y) as usize] }
    }

    fn cell_of(&self, pos: Vec2) -> UVec2 {
        (pos / self.cell).floor().as_ivec2().clamp(IVec2::ZERO, self.count.as_ivec2() - 1).as_uvec2()
    }

    pub(super) fn add(&mut self, mark: Mark) {
        let cell = self.cell_of(mark.pos);
        self.cells[(cell.y * self.count.x + cell.x) as usize].push(mark);
    }

    /// Calls `visit` with all points within `reach` of `pos` and their squared distances, and with no others.
    pub(super) fn within(&self, pos: Vec2, reach: f32, mut visit: impl FnMut(Mark, f32)) {
        let (low, high) = (self.cell_of(pos - reach), self.cell_of(pos + reach));
        for y in low.y..=high.y {
            let row = (y * self.count.x) as usize;
            for marks in &self.cells[row + low.x as usize..=row + high.x as usize] {
                for mark in marks {
                    let distance_sq = mark.pos.distance_squared(pos);
                    if distance_sq <= reach * reach {
                        visit(*mark, distance_sq);
                    }
                }
            }
        }
    }
}
