//! Sorts new markers into the field, in slices if needed.

use super::{
    ANY_IMPACT, DEAD, LANES, MarkerField, NO_NODE, get_ready,
    newborn::{Newborn, Phase, Picked, Settling},
};
use crate::{
    growth::{cursor::Cursor, nodes::NodeGrid},
    pattern::Node,
};
use glam::UVec2;

/// Cost of a node that visits the markers within its reach, in moved markers; visiting this many markers costs as
/// much as moving one.
const VISIT: u32 = 8;
const LOOKS: f32 = 8.0;

/// With fewer nodes, or more than this share of the field near markers, it is not worth picking those that visit.
const FEWEST: usize = 512;
const MOST_NEAR: f32 = 0.25;

impl MarkerField {
    /// Settles the new markers: removes the dead, sorts all into cells, and lets every node take those to which it is
    /// the nearest.
    pub(in crate::growth) fn settle(&mut self, nodes: &[Node], grid: &NodeGrid) {
        while !self.settle_some(nodes, grid, u32::MAX) {}
    }

    /// Continues settling, by up to about `markers` markers. Returns whether it is done.
    pub(in crate::growth) fn settle_some(&mut self, nodes: &[Node], grid: &NodeGrid, markers: u32) -> bool {
        if self.newborn.is_empty() && self.settling.is_none() {
            return true;
        }
        let mut settling = self.settling.take().unwrap_or_default();
        let mut cursor = Cursor::of(markers);
        cursor.go_on(&settling.cursor);
        while self.pass(&mut settling, &mut cursor, nodes, grid) {
            settling.phase = match settling.phase {
                Phase::Gather => Phase::Count,
                Phase::Count => Phase::Place,
                Phase::Place => Phase::Recall,
                Phase::Recall => Phase::Visit,
                Phase::Visit => return true,
            };
            cursor.rewind();
            if cursor.is_spent() {
                break;
            }
        }
        settling.cursor = cursor;
        self.settling = Some(settling);
        false
    }

    /// Works on a phase up to the limit of the slice. Returns whether it is complete.
    fn pass(&mut self, settling: &mut Settling, cursor: &mut Cursor, nodes: &[Node], grid: &NodeGrid) -> bool {
        let count = match settling.phase {
            Phase::Gather => self.x.len(),
            Phase::Count | Phase::Place => settling.all.len(),
            Phase::Recall => self.relations.as_ref().map_or(0, |_| self.x.len() - LANES),
            Phase::Visit => settling.visits(nodes.len()),
        } as u64;
        let share = settling.picked.as_ref().map_or(1.0, |picked| picked.share);
        let cost = if settling.phase == Phase::Visit { self.visit_cost(share) } else { 1 };
        let slice = cursor.slice(count, cost);
        let slice = slice.start as usize..slice.end as usize;
        let is_over = cursor.is_at(count);
        let Settling { all, homes, next, marked, picked, .. } = settling;
        match settling.phase {
            Phase::Gather => {
                all.extend(slice.filter(|&i| self.near_sq[i] > DEAD).map(|i| self.kept_marker_at(i)));
                if is_over {
                    self.clear();
                    if all.is_empty() {
                        // Not copied: a first hit makes thousands.
                        *all = std::mem::take(&mut self.newborn);
                    } else {
                        all.append(&mut self.newborn);
                    }
                    self.choose_cells(all.len());
                    homes.reserve(all.len());
                }
            }
            Phase::Count => {
                for marker in &all[slice] {
                    let home = self.cell_of(marker.pos) as u32;
                    self.first[home as usize + 1] += 1;
                    homes.push(home);
                }
                if is_over {
                    for cell in 1..self.first.len() {
                        self.first[cell] += self.first[cell - 1];
                    }
                    next.clone_from(&self.first);
                    self.make_places(all.len());
                    if nodes.len() >= FEWEST {
                        *marked = grid.unmarked();
                    }
                }
            }
            // The markers of a cell stay in order.
            Phase::Place => {
                for i in slice {
                    let Newborn { pos, id, owner, given_up, near_sq, node, is_known } = all[i];
                    let slot = &mut next[homes[i] as usize];
                    let i = *slot as usize;
                    *slot += 1;
                    (self.x[i], self.y[i], self.id[i], self.owner[i]) = (pos.x, pos.y, id, owner);
                    self.given_up[i] = given_up;
                    self.near_sq[i] = self.near_sq[i].min(near_sq);
                    if node != NO_NODE {
                        self.node[i] = node;
                        self.active.push(i as u32);
                    }
                    if !is_known && !marked.is_empty() {
                        grid.mark_cell(pos, marked);
                    }
                }
                if is_over && !marked.is_empty() {
                    let near = grid.near_cells(std::mem::take(marked), self.radius, MOST_NEAR);
                    let end = self.shown;
                    *picked = near.map(|(mut nodes, share)| {
                        nodes.truncate(nodes.partition_point(|node| *node < end));
                        Picked { nodes, end, share }
                    });
                }
            }
            Phase::Recall => {
                for i in slice {
                    let known = self.relations.as_ref().and_then(|of| of.neighbours(self.id[i]).first().copied());
                    if let Some(node) = known {
                        self.node[i] = node;
                        self.active.push(i as u32);
                    }
                }
            }
            Phase::Visit => slice.for_each(|k| self.visit(settling.visitor(k), nodes, grid)),
        }
        is_over
    }

    /// Average cost of a node that visits the markers around it, which lie in this share of the field: many hits put their markers on top of
    /// each other.
    fn visit_cost(&self, share_of_field: f32) -> u32 {
        let around = (2.0 * self.radius * self.per_unit + 1.0).min(self.cells.as_vec2());
        let share = around.element_product() / (share_of_field * self.cells.as_vec2().element_product());
        VISIT + (share.min(1.0) * self.x.len() as f32 / LOOKS) as u32
    }

    /// Chooses cells of half the radius, with a few markers each.
    fn choose_cells(&mut self, markers: usize) {
        let per_cell = (self.extent.x * self.extent.y * 3.0 / markers as f32).sqrt();
        let side = (0.5 * self.radius).max(per_cell).max(self.extent.max_element() / 1024.0);
        self.cells = (self.extent / side).ceil().as_uvec2().max(UVec2::ONE);
        self.per_unit = self.cells.as_vec2() / self.extent;
        self.first.clear();
        self.first.resize(self.cells.x as usize * self.cells.y as usize + 1, 0);
    }

    /// Allocates entries for the markers, and as many dead ones as there are lanes.
    fn make_places(&mut self, markers: usize) {
        let padded = markers + LANES;
        self.x.resize(padded, 0.0);
        self.y.resize(padded, 0.0);
        self.id.resize(padded, 0);
        self.owner.resize(padded, ANY_IMPACT);
        self.given_up.resize(padded, 0);
        self.node.resize(padded, NO_NODE);
        self.near_sq.resize(markers, self.radius * self.radius);
        self.near_sq.resize(padded, DEAD);
    }

    /// Prepares memory for the added markers, so that no step pauses to do it.
    pub(in crate::growth) fn reserve(&mut self) {
        let n = self.x.len() + self.newborn.len() + LANES;
        for plane in [&mut self.x, &mut self.y, &mut self.near_sq] {
            get_ready(plane, n);
        }
        for plane in [&mut self.node, &mut self.id, &mut self.owner] {
            get_ready(plane, n);
        }
        get_ready(&mut self.given_up, n);
    }
}
