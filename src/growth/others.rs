//! A tip and the other cracks around it: which cracks are others, and what happens to those that it meets.

use super::{division::MUCH_WIDER, draws, params::StartLayout, rays::NO_RAY, state::CrackGrowth};
use crate::{
    math::hash_unit,
    pattern::{NO_PARENT, Node},
};
use glam::Vec2;

/// Cosine of the angle between the directions of two tips below which they move towards each other.
const HEAD_ON: f32 = 0.2;

/// Cosine above which a straight crack does not move to a waiting tip: they run side by side.
const ALONG: f32 = 0.6;

/// A tip that has left the region of its hit is met from this many times the distance of other cracks.
const INVITES: f32 = 1.4;

impl CrackGrowth {
    /// The nearest node of another crack within `reach` of a node, ahead of it if it has a heading.
    pub(super) fn foreign(&self, from: u32, heading: Option<Vec2>, reach: f32, ahead: f32) -> Option<(f32, u32)> {
        let mut best = (f32::INFINITY, u32::MAX, f32::INFINITY);
        let divides = self.divides();
        self.each_foreign(from, reach, |node, distance_sq, way| {
            let mut rank = distance_sq;
            if let Some(heading) = heading {
                let along = way.dot(heading);
                let distance = distance_sq.sqrt();
                if along < ahead * distance {
                    return;
                }
                // A crack that divides a domain keeps to its way.
                if divides {
                    rank = distance_sq * distance / along.max(0.1 * distance);
                }
            }
            if (rank, node) < (best.0, best.1) {
                best = (rank, node, distance_sq);
            }
        });
        (best.1 != u32::MAX).then(|| (best.2.sqrt(), best.1))
    }

    /// Calls `visit` with each node of another crack within `reach`, its squared distance and the way to it.
    pub(super) fn each_foreign(&self, from: u32, reach: f32, mut visit: impl FnMut(u32, f32, Vec2)) {
        let pos = self.network.nodes[from as usize].pos;
        self.nodes.within(pos, reach, |node, distance_sq| {
            if distance_sq > 0.0 && !self.is_same_crack(from, node) {
                visit(node, distance_sq, self.network.nodes[node as usize].pos - pos);
            }
        });
    }

    /// Whether two nodes belong to the same crack: they are so few generations apart that no cell could lie between
    /// them.
    pub(super) fn is_same_crack(&self, one: u32, other: u32) -> bool {
        let (a, b) = (&self.network.nodes[one as usize], &self.network.nodes[other as usize]);
        let are_of_one = a.impact == b.impact;
        // One that has gone on beyond another does not turn back to it.
        if !are_of_one && !self.breaks_through() {
            return false;
        }
        if self.has_rays() {
            let ray_of = |node: u32| self.field.ray_of.get(node as usize).copied().unwrap_or(NO_RAY);
            return a.parent == NO_PARENT && b.parent == NO_PARENT
                || ray_of(one) != NO_RAY && ray_of(one) == ray_of(other);
        }
        let apart = (3.0 * self.params.arrest.max(self.params.island_distance) / self.params.step_length) as u32 + 2;
        // Up from both to their common ancestor; a parent is always older than its child.
        let (mut a, mut b, mut steps) = (one, other, 0);
        while a != b {
            let later = if a > b { &mut a } else { &mut b };
            let parent = self.network.nodes[*later as usize].parent;
            if parent == NO_PARENT {
                // The starts of a compact hit belong to one crack.
                let to_start = |node: u32| self.network.nodes[node as usize].generation;
                return are_of_one
                    && !self.divides()
                    && !matches!(self.params.starts, StartLayout::Points { .. })
                    && to_start(one).saturating_add(to_start(other)) <= apart;
            }
            *later = parent;
            steps += 1;
            if steps > apart {
                return false;
            }
        }
        true
    }

    /// Whether a tip is one of those that stop before other cracks.
    pub(super) fn stays_open(&self, tip: u32) -> bool {
        self.params.open_ends > 0.0
            && self.network.nodes[tip as usize].parent != NO_PARENT
            && hash_unit(self.seed ^ draws::OPEN_END, u64::from(tip)) < self.params.open_ends
    }

    /// Whether a node is outside the area that its hit has loaded.
    pub(super) fn has_left(&self, node: u32) -> bool {
        let Node { pos, impact, .. } = self.network.nodes[node as usize];
        self.impacts.get(impact as usize).is_some_and(|hit| self.is_beyond_rim(impact, pos - hit.pos))
    }

    /// The nearest waiting tip within reach and ahead of a node.
    pub(super) fn resting_ahead(&self, from: u32, heading: Vec2, reach: f32, ahead: f32) -> Option<(f32, u32)> {
        let (nodes, division) = (&self.network.nodes, self.division.as_ref()?);
        let pos = nodes[from as usize].pos;
        let near = division.resting.iter().filter_map(|tip| {
            let way = nodes[tip.node as usize].pos - pos;
            let distance = way.length();
            let is_near = distance <= INVITES * reach && distance > 0.0 && way.dot(heading) >= ahead * distance;
            let is_aside = self.params.straightness > 0.0 && self.heading_of(tip.node).dot(heading) > ALONG;
            (is_near && !is_aside && !self.is_same_crack(from, tip.node)).then_some((distance, tip.node))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    }

    /// Whether a tip waits for a crack that meets it.
    pub(super) fn is_resting(&self, node: u32) -> bool {
        self.division.as_ref().is_some_and(|division| division.resting.iter().any(|tip| tip.node == node))
    }

    /// Marks a tip as met: it no longer waits.
    pub(super) fn is_met(&mut self, node: u32) {
        if let Some(division) = &mut self.division {
            division.resting.retain(|tip| tip.node != node);
        }
    }

    /// Whether the crack of a tip is so much wider than that of a node that it must narrow where it meets it, if it
    /// is straight.
    pub(super) fn is_much_wider(&self, tip: u32, node: u32) -> bool {
        let width = |node: u32| {
            let Node { pos, impact, .. } = self.network.nodes[node as usize];
            let energy = self.impacts.get(impact as usize).map_or(1.0, |impact| impact.widening);
            self.division.as_ref().map_or(1.0, |division| division.share(node)) * self.thinned(pos, impact) * energy
        };
        self.params.straightness > 0.0 && width(tip) > MUCH_WIDER * width(node)
    }

    /// Whether another crack meets the crack of a node there, if that matters.
    pub(super) fn is_met_already(&self, node: u32) -> bool {
        self.params.straightness > 0.0 && self.division.as_ref().is_some_and(|division| division.kind(node).is_met)
    }

    /// The free end of the crack of a node, a segment or two further on. A straight tip meets it instead of the node:
    /// no cell lies between the two ends.
    pub(super) fn end_beside(&self, node: u32, tip: u32) -> Option<u32> {
        if self.params.straightness <= 0.0 || !self.divides() {
            return None;
        }
        let child = |node: u32| Some(self.child_of(node)).filter(|&child| child != NO_PARENT);
        let first = child(node)?;
        let end = child(first).unwrap_or(first);
        let (pos, extent) = (self.network.nodes[end as usize].pos, self.network.extent());
        let is_free = child(end).is_none()
            && !self.is_over(end)
            && self.are_head_on(end, tip)
            && !(pos.cmpeq(Vec2::ZERO) | pos.cmpeq(extent)).any()
            && !self.is_same_crack(end, tip);
        let near = 2.0 * self.params.step_length;
        (is_free && pos.distance_squared(self.network.nodes[tip as usize].pos) <= near * near).then_some(end)
    }

    /// Whether a straight crack ends at a node.
    pub(super) fn is_over(&self, node: u32) -> bool {
        self.params.straightness > 0.0 && self.division.as_ref().is_some_and(|division| division.kind(node).is_over)
    }

    /// Whether two ends move towards each other.
    fn are_head_on(&self, one: u32, other: u32) -> bool {
        self.heading_of(one).dot(self.heading_of(other)) < HEAD_ON
    }

    /// Records that a tip has met another crack at a node.
    pub(super) fn note_meeting(&mut self, node: u32, tip: u32) {
        let ends_both = self.child_of(node) == NO_PARENT && self.are_head_on(node, tip);
        let Some(division) = &mut self.division else { return };
        if let Some(kind) = division.kinds.get_mut(node as usize) {
            (kind.is_met, kind.is_over) = (true, kind.is_over || ends_both);
        }
        if let Some(kind) = division.kinds.get_mut(tip as usize) {
            kind.is_over = true;
        }
    }
}
