//! A spatial index of nodes.

use glam::{UVec2, Vec2};

const NONE: u32 = u32::MAX;

/// A uniform grid of linked lists; nodes are only ever added.
#[derive(Clone, Debug)]
pub(super) struct NodeGrid {
    cells: UVec2,
    /// Cells per pattern unit.
    per_unit: Vec2,
    head: Vec<u32>,
    next: Vec<u32>,
    places: Vec<Vec2>,
}

impl NodeGrid {
    /// An index over `extent` with cells of about `side`.
    pub(super) fn new(extent: Vec2, side: f32) -> Self {
        let side = side.max(extent.max_element() / 128.0);
        let cells = (extent / side).ceil().as_uvec2().max(UVec2::ONE);
        Self {
            cells,
            per_unit: cells.as_vec2() / extent,
            head: vec![NONE; cells.x as usize * cells.y as usize],
            next: Vec::new(),
            places: Vec::new(),
        }
    }

    fn cell_at(&self, pos: Vec2) -> UVec2 {
        (pos * self.per_unit).max(Vec2::ZERO).as_uvec2().min(self.cells - UVec2::ONE)
    }

    pub(super) fn reserve(&mut self, nodes: usize) {
        self.next.reserve(nodes);
        self.places.reserve(nodes);
    }

    /// Adds the node with the next index.
    pub(super) fn push(&mut self, pos: Vec2) {
        let cell = self.cell_at(pos);
        let slot = cell.y as usize * self.cells.x as usize + cell.x as usize;
        self.next.push(std::mem::replace(&mut self.head[slot], self.places.len() as u32));
        self.places.push(pos);
    }

    /// Calls `visit` with each node of the cell and its squared distance.
    fn for_cell(&self, x: u32, y: u32, pos: Vec2, mut visit: impl FnMut(u32, f32)) {
        let mut node = self.head[y as usize * self.cells.x as usize + x as usize];
        while node != NONE {
            visit(node, self.places[node as usize].distance_squared(pos));
            node = self.next[node as usize];
        }
    }

    /// Calls `visit` with each node within `radius` of `pos` and its squared distance, in a fixed order.
    pub(super) fn within(&self, pos: Vec2, radius: f32, mut visit: impl FnMut(u32, f32)) {
        let (low, high) = (self.cell_at(pos - radius), self.cell_at(pos + radius));
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                self.for_cell(x, y, pos, |node, distance_sq| {
                    if distance_sq <= radius * radius {
                        visit(node, distance_sq);
                    }
                });
            }
        }
    }

    /// Whether the predicate holds for a node within `radius` of `pos`, given its index and squared distance.
    pub(super) fn any(&self, pos: Vec2, radius: f32, mut is_so: impl FnMut(u32, f32) -> bool) -> bool {
        let (low, high) = (self.cell_at(pos - radius), self.cell_at(pos + radius));
        (low.y..=high.y).any(|y| {
            (low.x..=high.x).any(|x| {
                let mut node = self.head[y as usize * self.cells.x as usize + x as usize];
                while node != NONE {
                    let distance_sq = self.places[node as usize].distance_squared(pos);
                    if distance_sq <= radius * radius && is_so(node, distance_sq) {
                        return true;
                    }
                    node = self.next[node as usize];
                }
                false
            })
        })
    }

    /// Whether a node lies within `distance` of `pos`.
    pub(super) fn any_within(&self, pos: Vec2, distance: f32) -> bool {
        self.any(pos, distance, |_, _| true)
    }
}
