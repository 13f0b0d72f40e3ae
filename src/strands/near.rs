//! [`Near`]: points by place, so that a tip finds what is close to it.

use glam::{IVec2, UVec2, Vec2};

const NONE: u32 = u32::MAX;

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
    cells: UVec2,
    heads: Vec<u32>,
    marks: Vec<(Mark, u32)>,
}

impl Near {
    /// An empty index for queries of up to `reach` over `extent`.
    pub(super) fn new(extent: Vec2, reach: f32) -> Self {
        let cell = reach.max(extent.max_element() / MOST_CELLS);
        let cells = (extent / cell).floor().as_uvec2() + 1;
        Self { cell, cells, heads: vec![NONE; (cells.x * cells.y) as usize], marks: Vec::new() }
    }

    fn cell_of(&self, pos: Vec2) -> IVec2 {
        (pos / self.cell).floor().as_ivec2().clamp(IVec2::ZERO, self.cells.as_ivec2() - 1)
    }

    pub(super) fn add(&mut self, mark: Mark) {
        let cell = self.cell_of(mark.pos).as_uvec2();
        let head = &mut self.heads[(cell.y * self.cells.x + cell.x) as usize];
        self.marks.push((mark, *head));
        *head = self.marks.len() as u32 - 1;
    }

    /// Calls `visit` with all points within `reach` of `pos` and their squared distances, and with no others.
    pub(super) fn within(&self, pos: Vec2, reach: f32, mut visit: impl FnMut(Mark, f32)) {
        let (low, high) = (self.cell_of(pos - reach), self.cell_of(pos + reach));
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let mut next = self.heads[(y as u32 * self.cells.x + x as u32) as usize];
                while let Some((mark, after)) = self.marks.get(next as usize) {
                    let distance_sq = mark.pos.distance_squared(pos);
                    if distance_sq <= reach * reach {
                        visit(*mark, distance_sq);
                    }
                    next = *after;
                }
            }
        }
    }
}
