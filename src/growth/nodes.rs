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

    /// One entry per cell.
    pub(super) fn unmarked(&self) -> Vec<bool> {
        vec![false; self.head.len()]
    }

    /// Marks the cell of `pos`; `marked` has one entry per cell.
    pub(super) fn mark_cell(&self, pos: Vec2, marked: &mut [bool]) {
        let cell = self.cell_at(pos);
        marked[(cell.y * self.cells.x + cell.x) as usize] = true;
    }

    /// The nodes within `radius` of places in marked cells, and others near them, by index; and the share of the cells that they lie in.
    /// `None` if that is more than `most`.
    pub(super) fn near_cells(&self, mut marked: Vec<bool>, radius: f32, most: f32) -> Option<(Vec<u32>, f32)> {
        // A little more, for rounding.
        let (width, reach) = (self.cells.x as usize, (radius * self.per_unit + 0.01).ceil().as_uvec2());
        let mut line = Vec::new();
        for row in marked.chunks_exact_mut(width) {
            line.clear();
            line.extend_from_slice(row);
            widen(&line, reach.x as usize, |x| row[x] = true);
        }
        for x in 0..width {
            line.clear();
            line.extend(marked.iter().skip(x).step_by(width));
            widen(&line, reach.y as usize, |y| marked[y * width + x] = true);
        }
        let share = marked.iter().filter(|is_marked| **is_marked).count() as f32 / marked.len() as f32;
        if share > most {
            return None;
        }
        let mut nodes = Vec::new();
        for (&head, _) in self.head.iter().zip(marked).filter(|(_, is_marked)| *is_marked) {
            let mut node = head;
            while node != NONE {
                nodes.push(node);
                node = self.next[node as usize];
            }
        }
        nodes.sort_unstable();
        Some((nodes, share))
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

/// Calls `mark` with each place of a line that is not marked, but less than `reach` + 1 from one that is.
fn widen(line: &[bool], reach: usize, mut mark: impl FnMut(usize)) {
    let mut end = 0;
    for at in (0..line.len()).filter(|at| line[*at]) {
        let until = line.len().min(at + reach + 1);
        (end.max(at.saturating_sub(reach))..until).filter(|near| !line[*near]).for_each(&mut mark);
        end = until;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// The nodes near marked cells are all those within the radius of a place there, in order, each once; where they are everywhere, there are none.
    #[test]
    fn nodes_near_cells_are_all_that_are_near_places() {
        let mut rng = Rng::new(12);
        let (mut picked, mut refused) = (0, 0);
        for round in 0..300 {
            let extent = Vec2::new(rng.range(0.2, 3.0), rng.range(0.2, 3.0));
            let mut draw = |extent: Vec2| Vec2::new(rng.unit(), rng.unit()) * extent;
            let at: Vec<Vec2> = (0..400).map(|_| draw(extent)).collect();
            let corner = draw(0.8 * extent);
            let places: Vec<Vec2> = (0..12).map(|_| corner + draw(0.2 * extent)).collect();
            let mut grid = NodeGrid::new(extent, rng.range(0.005, 0.4));
            at.iter().for_each(|pos| grid.push(*pos));
            let (radius, mut marked) = (rng.range(0.001, 0.3), grid.unmarked());
            places.iter().for_each(|pos| grid.mark_cell(*pos, &mut marked));
            let Some((near, share)) = grid.near_cells(marked, radius, 0.5) else {
                refused += 1;
                continue;
            };
            picked += 1;
            assert!(share > 0.0 && share <= 0.5 && near.is_sorted_by(|a, b| a < b), "round {round}");
            for (node, pos) in (0..).zip(&at) {
                let is_near = places.iter().any(|place| place.distance(*pos) <= radius);
                assert!(!is_near || near.binary_search(&node).is_ok(), "round {round}: node {node} is left out");
            }
        }
        assert!(picked > 60 && refused > 20, "{picked} {refused}");
    }
}
