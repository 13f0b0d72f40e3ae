//! Cracks that go on beyond older ones: what a hit does where the surface is cracked already.

use super::state::CrackGrowth;
use crate::pattern::{NO_PARENT, Node, SegmentId};
use glam::Vec2;

/// Share of its reach within which a hit breaks through older cracks.
const STRONG: f32 = 0.6;

/// How wide a crack is beyond an older one, as a share: less is left of its energy.
pub(super) const THINNER: f32 = 0.5;

/// Cosine of the least angle, seen from the hit, between two new cracks in joints: 45 degrees.
const APART: f32 = 0.707;

impl CrackGrowth {
    /// Lets a crack that has met one of another hit go on beyond it, if it is still close to its own hit. It goes on from
    /// a place beside the one where it ends, as cracks do that step over a joint.
    pub(super) fn go_on_beyond(&mut self, node: u32, tip: u32) {
        let nodes = &self.network.nodes;
        let (met, end) = (nodes[node as usize], nodes[tip as usize]);
        if met.impact == end.impact || !self.breaks_through() {
            return;
        }
        let Some(hit) = self.impacts.get(end.impact as usize) else { return };
        let far = STRONG * self.reach(hit.pos, hit.energy);
        if met.pos.distance_squared(hit.pos) > far * far {
            return;
        }
        let heading = match self.heading_of(tip) {
            Vec2::ZERO => (met.pos - end.pos).normalize_or(Vec2::X),
            heading => heading,
        };
        for from in [self.child_of(node), met.parent, node] {
            if from != NO_PARENT
                && let Some(child) = self.grow_beyond(end.impact, from, heading)
            {
                self.widths.thin_beyond(tip, child, THINNER);
                return;
            }
        }
    }

    /// Whether hits break through older cracks.
    pub(super) fn breaks_through(&self) -> bool {
        self.params.keeps_apart()
            && self.masonry.is_none()
            && !self.divides()
            && !self.has_rays()
            && self.params.strands().is_none()
    }

    /// Handles a hit in masonry whose joint is cracked: new cracks begin in the nearest joints that are not, one to each
    /// side. Returns whether there are any.
    pub(super) fn sprout_in_joints(&mut self, (pos, energy): (Vec2, f32), impact: u32) -> bool {
        let Some(masonry) = self.masonry.clone() else { return false };
        let center = masonry.nearest(pos).unwrap_or(pos);
        let mut near = Vec::new();
        self.nodes.within(center, STRONG * self.reach(pos, energy), |node, distance_sq| near.push((distance_sq, node)));
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut begun: Vec<Vec2> = Vec::new();
        for (_, from) in near {
            let place = self.network.nodes[from as usize].pos;
            for way in masonry.ways(place) {
                let to = masonry.end(place, way, self.params.step_length);
                let side = (to - center).normalize_or_zero();
                let segment = SegmentId::Branch(self.network.nodes.len() as u32);
                if masonry.is_in_joint(0.5 * (place + to))
                    && begun.iter().all(|other| other.dot(side) < APART)
                    && self.free_line(segment, (from, u32::MAX), (place, to)).is_ok()
                    && let Some(child) = self.extend_of(impact, from, to, false)
                {
                    self.courses[child as usize] = way.0;
                    begun.push(side);
                }
            }
        }
        !begun.is_empty()
    }

    /// Grows a segment of a hit from a node of an older crack, away from it; `None` if there is no room.
    pub(super) fn grow_beyond(&mut self, impact: u32, from: u32, heading: Vec2) -> Option<u32> {
        let pos = self.network.nodes[from as usize].pos;
        let across = self.across_crack(from).unwrap_or(heading);
        let across = if across.dot(heading) < 0.0 { -across } else { across };
        let to = pos + (heading + across).normalize_or(across) * self.way_out(from);
        let is_inside = to.cmpgt(Vec2::ZERO).all() && to.cmplt(self.network.extent()).all();
        let segment = SegmentId::Branch(self.network.nodes.len() as u32);
        let is_free = is_inside && self.free_line(segment, (from, u32::MAX), (pos, to)).is_ok();
        is_free.then(|| self.extend_of(impact, from, to, false)).flatten()
    }

    /// A direction across the crack of a node; `None` if that is a single node.
    pub(super) fn across_crack(&self, node: u32) -> Option<Vec2> {
        let nodes = &self.network.nodes;
        let Node { pos, parent, .. } = nodes[node as usize];
        let beside = nodes.get(parent as usize).or_else(|| nodes.get(self.child_of(node) as usize))?;
        (pos - beside.pos).perp().try_normalize()
    }

    /// Length of a segment that leaves the crack of a node, however wide that is.
    pub(super) fn way_out(&self, node: u32) -> f32 {
        let length = self.params.step_length;
        length.max(0.5 * (self.network.nodes[node as usize].width + length))
    }
}
