//! The markers, each with its nearest node.
//!
//! The usual way is to index the nodes and ask that index for every marker at every step. Here it is turned round: the
//! markers lie still in a uniform grid and remember their nearest node, and a newborn node visits only the markers that
//! it may win. A cell remembers how far its markers are from their nodes at most, so cells that are already served well
//! are passed over.

use super::nodes::NodeGrid;
use glam::{UVec2, Vec2};

/// [`Marker::near_sq`] of a dead marker: no distance is below it.
const DEAD: f32 = -1.0;

/// No node attracts the marker.
pub(super) const NO_NODE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
pub(super) struct Marker {
    pub(super) pos: Vec2,
    /// Squared distance to the nearest node; the squared crack radius while there is none within it.
    pub(super) near_sq: f32,
    pub(super) node: u32,
    /// Order of birth, for ties.
    pub(super) id: u32,
}

#[derive(Clone, Debug)]
pub(super) struct MarkerField {
    extent: Vec2,
    radius: f32,
    kill_sq: f32,
    /// Sorted by cell.
    markers: Vec<Marker>,
    /// Markers that lie in no cell yet.
    newborn: Vec<Marker>,
    cells: UVec2,
    cell: Vec2,
    /// First marker of each cell, and the end.
    first: Vec<u32>,
    /// An upper bound of `near_sq` over each cell.
    farthest_sq: Vec<f32>,
    /// Markers that attract a node; may hold dead ones until the next step.
    pub(super) active: Vec<u32>,
    pub(super) made: u32,
    pub(super) killed: u32,
}

impl MarkerField {
    pub(super) fn new(extent: Vec2, radius: f32, kill_distance: f32) -> Self {
        Self {
            extent,
            radius,
            kill_sq: kill_distance * kill_distance,
            markers: Vec::new(),
            newborn: Vec::new(),
            cells: UVec2::ONE,
            cell: extent,
            first: vec![0, 0],
            farthest_sq: vec![DEAD],
            active: Vec::new(),
            made: 0,
            killed: 0,
        }
    }

    /// Changes the distances; every marker looks for its node anew.
    pub(super) fn set_distances(&mut self, radius: f32, kill_distance: f32) {
        self.radius = radius;
        self.kill_sq = kill_distance * kill_distance;
        self.newborn.extend(self.markers.drain(..).filter(|marker| marker.near_sq > DEAD));
        self.active.clear();
    }

    pub(super) fn add(&mut self, pos: Vec2) {
        self.newborn.push(Marker { pos, near_sq: 0.0, node: NO_NODE, id: self.made });
        self.made += 1;
    }

    pub(super) fn marker(&self, index: u32) -> Marker {
        self.markers[index as usize]
    }

    /// Takes up the newborn markers: gives them their nearest nodes, forgets the dead, sorts all into cells.
    pub(super) fn settle(&mut self, nodes: &NodeGrid) {
        if self.newborn.is_empty() {
            return;
        }
        let mut all: Vec<Marker> = self.markers.drain(..).filter(|marker| marker.near_sq > DEAD).collect();
        for mut marker in self.newborn.drain(..) {
            (marker.near_sq, marker.node) = match nodes.nearest(marker.pos, self.radius) {
                Some((node, distance_sq)) => (distance_sq, node),
                None => (self.radius * self.radius, NO_NODE),
            };
            if marker.node != NO_NODE && marker.near_sq <= self.kill_sq {
                self.killed += 1;
            } else {
                all.push(marker);
            }
        }
        // Cells of half the radius, but not much smaller than what holds two markers.
        let share = (2.0 * self.extent.x * self.extent.y / all.len().max(1) as f32).sqrt();
        let side = (0.5 * self.radius).min(2.0 * share).max(0.7 * share).max(self.extent.max_element() / 1024.0);
        self.cells = (self.extent / side).ceil().as_uvec2().max(UVec2::ONE);
        self.cell = self.extent / self.cells.as_vec2();
        let n_cells = self.cells.x as usize * self.cells.y as usize;
        // Counting sort; stable, so markers of a cell stay in order.
        self.first.clear();
        self.first.resize(n_cells + 1, 0);
        for marker in &all {
            let cell = self.cell_of(marker.pos);
            self.first[cell + 1] += 1;
        }
        for cell in 0..n_cells {
            self.first[cell + 1] += self.first[cell];
        }
        let mut next = self.first.clone();
        self.markers = all.clone();
        self.farthest_sq.clear();
        self.farthest_sq.resize(n_cells, DEAD);
        for marker in all {
            let cell = self.cell_of(marker.pos);
            self.markers[next[cell] as usize] = marker;
            next[cell] += 1;
            self.farthest_sq[cell] = self.farthest_sq[cell].max(marker.near_sq);
        }
        self.active.clear();
        self.active.extend((0u32..).zip(&self.markers).filter(|(_, marker)| marker.node != NO_NODE).map(|(i, _)| i));
    }

    fn cell_of(&self, pos: Vec2) -> usize {
        let cell = (pos / self.cell).as_uvec2().min(self.cells - UVec2::ONE);
        cell.y as usize * self.cells.x as usize + cell.x as usize
    }

    /// Lets a newborn node win the markers that it is nearest to, and kills those that it reaches.
    ///
    /// Must be called in order of the nodes' indices: at equal distance the lower index keeps the marker.
    pub(super) fn visit(&mut self, node: u32, pos: Vec2) {
        let reach = Vec2::splat(self.radius);
        let low = ((pos - reach) / self.cell).max(Vec2::ZERO).as_uvec2();
        let high = ((pos + reach) / self.cell).max(Vec2::ZERO).as_uvec2().min(self.cells - UVec2::ONE);
        for y in low.y..=high.y {
            let beside_y = outside(pos.y, y, self.cell.y);
            for x in low.x..=high.x {
                let beside = Vec2::new(outside(pos.x, x, self.cell.x), beside_y);
                let cell = y as usize * self.cells.x as usize + x as usize;
                if beside.length_squared() < self.farthest_sq[cell] {
                    self.visit_cell(cell, node, pos);
                }
            }
        }
    }

    fn visit_cell(&mut self, cell: usize, node: u32, pos: Vec2) {
        let (from, to) = (self.first[cell], self.first[cell + 1]);
        let mut farthest_sq = DEAD;
        for (i, marker) in (from..to).zip(&mut self.markers[from as usize..to as usize]) {
            let distance_sq = marker.pos.distance_squared(pos);
            if distance_sq < marker.near_sq {
                if distance_sq <= self.kill_sq {
                    marker.near_sq = DEAD;
                    self.killed += 1;
                    continue;
                }
                if marker.node == NO_NODE {
                    self.active.push(i);
                }
                marker.near_sq = distance_sq;
                marker.node = node;
            }
            farthest_sq = farthest_sq.max(marker.near_sq);
        }
        self.farthest_sq[cell] = farthest_sq;
    }

    /// Drops the dead from the active markers.
    pub(super) fn sweep(&mut self) {
        let markers = &self.markers;
        self.active.retain(|&i| markers[i as usize].near_sq > DEAD);
    }

    /// Markers that are alive, and how many of them attract a node.
    pub(super) fn living(&self) -> (u32, u32) {
        let count = |attracting: bool| {
            let alive = |marker: &&Marker| marker.near_sq > DEAD && (marker.node != NO_NODE) == attracting;
            self.markers.iter().filter(alive).count()
        };
        let (attracting, waiting) = (count(true), count(false) + self.newborn.len());
        ((attracting + waiting) as u32, attracting as u32)
    }

    /// Places of the markers that no step has taken up yet.
    #[cfg(test)]
    pub(super) fn unsettled(&self) -> impl Iterator<Item = Vec2> {
        self.newborn.iter().map(|marker| marker.pos)
    }

    /// Markers alive, counting those that died since the last [`settle`](Self::settle).
    pub(super) fn living_at_most(&self) -> usize {
        self.markers.len() + self.newborn.len()
    }

    /// Whether a marker, alive or dead since the last [`settle`](Self::settle), lies within `distance` of `pos`.
    pub(super) fn any_within(&self, pos: Vec2, distance: f32) -> bool {
        let reach = Vec2::splat(distance);
        let low = ((pos - reach) / self.cell).max(Vec2::ZERO).as_uvec2();
        let high = ((pos + reach) / self.cell).max(Vec2::ZERO).as_uvec2().min(self.cells - UVec2::ONE);
        let near = |marker: &Marker| marker.pos.distance_squared(pos) < distance * distance;
        (low.y..=high.y).any(|y| {
            let row = y as usize * self.cells.x as usize;
            let (from, to) = (self.first[row + low.x as usize], self.first[row + high.x as usize + 1]);
            self.markers[from as usize..to as usize].iter().any(near)
        })
    }
}

/// How far `x` lies outside of cell `index`, a little less to be safe from rounding.
fn outside(x: f32, index: u32, cell: f32) -> f32 {
    let low = index as f32 * cell;
    ((low - x).max(x - low - cell) - 1e-3 * cell).max(0.0)
}
