//! An index of the nodes by place.

use glam::{UVec2, Vec2};

const NONE: u32 = u32::MAX;

/// A uniform grid of linked lists; nodes are only ever added.
#[derive(Clone, Debug)]
pub(super) struct NodeGrid {
    cells: UVec2,
    cell: Vec2,
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
            cell: extent / cells.as_vec2(),
            head: vec![NONE; cells.x as usize * cells.y as usize],
            next: Vec::new(),
            places: Vec::new(),
        }
    }

    fn cell_at(&self, pos: Vec2) -> UVec2 {
        (pos / self.cell).max(Vec2::ZERO).as_uvec2().min(self.cells - UVec2::ONE)
    }

    /// Adds the node with the next index.
    pub(super) fn push(&mut self, pos: Vec2) {
        let cell = self.cell_at(pos);
        let slot = cell.y as usize * self.cells.x as usize + cell.x as usize;
        self.next.push(std::mem::replace(&mut self.head[slot], self.places.len() as u32));
        self.places.push(pos);
    }

    /// Calls `visit` with each node of the cell and its squared distance.
    fn for_cell(&self, x: u32, y: u32, pos: Vec2, visit: &mut impl FnMut(u32, f32)) {
        let mut node = self.head[y as usize * self.cells.x as usize + x as usize];
        while node != NONE {
            visit(node, self.places[node as usize].distance_squared(pos));
            node = self.next[node as usize];
        }
    }

    /// The nearest node closer than `radius`, and its squared distance; at equal distance the lower index.
    pub(super) fn nearest(&self, pos: Vec2, radius: f32) -> Option<(u32, f32)> {
        if self.places.is_empty() {
            return None;
        }
        let (mut best, mut best_sq) = (NONE, radius * radius);
        let home = self.cell_at(pos);
        let side = self.cell.min_element();
        let rings = self.cells.max_element();
        for ring in 0..=rings {
            // Everything further out is at least `ring - 1` cells away.
            let gap = (ring as f32 - 1.0).max(0.0) * side;
            if gap * gap > best_sq {
                break;
            }
            self.for_ring(home, ring, pos, &mut |node, distance_sq| {
                if distance_sq < best_sq || (distance_sq == best_sq && node < best) {
                    (best, best_sq) = (node, distance_sq);
                }
            });
        }
        (best != NONE && best_sq < radius * radius).then_some((best, best_sq))
    }

    /// Visits the cells whose larger offset from `home` is exactly `ring`.
    fn for_ring(&self, home: UVec2, ring: u32, pos: Vec2, visit: &mut impl FnMut(u32, f32)) {
        let (x0, x1) = (home.x.saturating_sub(ring), (home.x + ring).min(self.cells.x - 1));
        let (y0, y1) = (home.y.saturating_sub(ring), (home.y + ring).min(self.cells.y - 1));
        for y in y0..=y1 {
            if y.abs_diff(home.y) == ring {
                (x0..=x1).for_each(|x| self.for_cell(x, y, pos, visit));
            } else {
                for x in [home.x.wrapping_sub(ring), home.x + ring] {
                    if (x0..=x1).contains(&x) {
                        self.for_cell(x, y, pos, visit);
                    }
                }
            }
        }
    }

    /// Calls `visit` with each node within `radius` of `pos` and its squared distance, in a fixed order.
    pub(super) fn within(&self, pos: Vec2, radius: f32, mut visit: impl FnMut(u32, f32)) {
        let (low, high) = (self.cell_at(pos - radius), self.cell_at(pos + radius));
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                self.for_cell(x, y, pos, &mut |node, distance_sq| {
                    if distance_sq <= radius * radius {
                        visit(node, distance_sq);
                    }
                });
            }
        }
    }

    /// Whether a node lies within `distance` of `pos`.
    pub(super) fn any_within(&self, pos: Vec2, distance: f32) -> bool {
        let mut any = false;
        self.within(pos, distance, |_, _| any = true);
        any
    }
}
