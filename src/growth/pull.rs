//! Where growth is pulled to: eq. 2 of Couto et al.

use super::{CrackGrowth, Impact, MarkerLayout, params::PROGRESS};
use crate::{
    math::hash_unit,
    pattern::{CrackMask, NO_PARENT, Node},
};
use glam::Vec2;

/// The markers that attract one node: `S(c)` of Couto et al.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pull {
    pub(super) node: u32,
    /// Sum of the unit vectors to the markers, in units of 2⁻²⁴: whole numbers, so that the order does not matter.
    sum: [i64; 2],
    pub(super) closest: u32,
    closest_sq: f32,
    closest_id: u32,
    pub(super) child: Vec2,
    pub(super) serves: bool,
    /// Where nothing grows from the node any more: its markers on that side are given up.
    pub(super) stopped: Option<Vec2>,
}

/// Cosine of the angle to its way and to the hit's direction beyond which a marker does not draw a ray with inertia: 20 degrees.
const ASIDE: f32 = 0.94;

const FIXED: f32 = 16_777_216.0;
pub(super) const NO_PULL: u32 = u32::MAX;

impl CrackGrowth {
    /// Whether cracks are rays that keep to their way.
    pub(super) fn are_rays(&self) -> bool {
        self.arrest.is_some() && self.params.inertia > 0.0 && matches!(self.params.markers, MarkerLayout::Polar { .. })
    }

    /// Collects `S(c)` of every node, and the order of the nodes.
    pub(super) fn gather_pulls(&mut self) {
        self.field.grow_older();
        self.field.sweep();
        let are_rays = self.are_rays();
        let Self { field, network, impacts, pulls, ways, pull_of, .. } = self;
        ways.clear();
        field.each_pull(&network.nodes, |index, node, distance_sq| {
            let slot = &mut pull_of[node as usize];
            if *slot == NO_PULL {
                *slot = pulls.len() as u32;
                if are_rays {
                    ways.push(kept(&network.nodes, node, impacts));
                }
                pulls.push(Pull {
                    node,
                    sum: [0, 0],
                    closest: index,
                    closest_sq: f32::INFINITY,
                    closest_id: u32::MAX,
                    child: Vec2::ZERO,
                    serves: false,
                    stopped: None,
                });
            }
            let (pull, ways) = (&mut pulls[*slot as usize], ways.get(*slot as usize));
            let marker = field.marker(index);
            let way = marker.pos - network.nodes[node as usize].pos;
            // What lies aside of a ray is left to others.
            let distance = distance_sq.sqrt();
            if ways.is_none_or(|ways| ways.iter().all(|&kept| kept == Vec2::ZERO || kept.dot(way) >= ASIDE * distance))
            {
                let towards = way * (FIXED / distance);
                pull.sum[0] += i64::from(towards.x as i32);
                pull.sum[1] += i64::from(towards.y as i32);
            }
            if (distance_sq, marker.id) < (pull.closest_sq, pull.closest_id) {
                (pull.closest, pull.closest_sq, pull.closest_id) = (index, distance_sq, marker.id);
            }
        });
        self.order.clear();
        self.order.extend((0u32..).zip(&self.pulls).map(|(slot, pull)| (pull.node, slot)));
        self.order.sort_unstable();
    }

    /// Finds the place of every child.
    pub(super) fn aim(&mut self) {
        let extent = self.network.extent();
        let (length, kill) = (self.params.step_length, self.params.kill_distance);
        let next = self.network.nodes.len() as u64;
        // A crack does not turn on its heel: what it cannot serve on its way is left to others.
        let keeps_on = self.arrest.is_some() && (self.params.inertia > 0.0 || !self.mask.is_empty());
        for (child, &(_, slot)) in (next..).zip(&self.order) {
            let pull = &mut self.pulls[slot as usize];
            let from = self.network.nodes[pull.node as usize].pos;
            let mut direction = Vec2::new(pull.sum[0] as f32, pull.sum[1] as f32).normalize_or_zero();
            if self.params.inertia > 0.0
                && let Some(before) = self.network.nodes.get(self.network.nodes[pull.node as usize].parent as usize)
            {
                let heading = (from - before.pos).normalize_or_zero();
                // A side branch has left that heading already, and in a joint the joint leads.
                if heading.dot(direction) > 0.0 {
                    let inertia = self.params.inertia * (1.0 - self.mask.weak_at(from / extent));
                    direction = (direction + heading * inertia).normalize_or_zero();
                }
            }
            direction = self.params.direct(direction);
            if self.params.wander > 0.0 {
                // A draw per child, frozen by its index.
                let stray = self.params.wander * (2.0 * hash_unit(self.seed ^ 0x57A6, child) - 1.0);
                direction = (direction + direction.perp() * stray).normalize_or_zero();
            }
            if !self.mask.is_empty() {
                direction = steer(from, direction, length, &self.mask, extent);
            }
            pull.child = up_to_border(from, direction, length, kill, extent);
        }
        let Self { field, network, pulls, pull_of, .. } = self;
        field.each_pull(&network.nodes, |index, node, distance_sq| {
            let pull = &mut pulls[pull_of[node as usize] as usize];
            if !pull.serves {
                let left_sq = field.marker(index).pos.distance_squared(pull.child);
                pull.serves = left_sq <= kill * kill || left_sq <= distance_sq - PROGRESS * length * length;
            }
        });
        for (slot, pull) in self.pulls.iter_mut().enumerate() {
            if pull.sum == [0, 0] && self.ways.get(slot).is_some_and(|ways| *ways != [Vec2::ZERO; 2]) {
                pull.serves = false;
                continue;
            }
            let is_start = self.network.nodes[pull.node as usize].parent == NO_PARENT;
            if !pull.serves && (is_start || !keeps_on) {
                let (from, to) = (self.network.nodes[pull.node as usize].pos, self.field.marker(pull.closest).pos);
                let distance = pull.closest_sq.sqrt();
                pull.child = if distance <= length { to } else { from + (to - from) * (length / distance) };
                pull.serves = true;
            }
        }
    }
}

/// What a ray must keep to: its heading, and the way from the hit; zero for a start, which may turn anywhere.
fn kept(nodes: &[Node], node: u32, impacts: &[Impact]) -> [Vec2; 2] {
    let Node { pos, parent, impact, .. } = nodes[node as usize];
    let Some(before) = nodes.get(parent as usize) else { return [Vec2::ZERO; 2] };
    let heading = (pos - before.pos).normalize_or_zero();
    let hit = impacts.get(impact as usize).map_or(before.pos, |impact| impact.pos);
    [heading, (pos - hit).normalize_or(heading)]
}

/// Turns `direction` by up to 80 degrees towards what is weak and away from what is strong or forbidden.
fn steer(from: Vec2, direction: Vec2, length: f32, mask: &CrackMask, extent: Vec2) -> Vec2 {
    // Cosine and sine of 0, 10, ... 80 degrees.
    const TURNS: [(f32, f32); 9] = [
        (1.0, 0.0),
        (0.984_807_8, 0.173_648_18),
        (0.939_692_6, 0.342_020_15),
        (0.866_025_4, 0.5),
        (0.766_044_4, 0.642_787_6),
        (0.642_787_6, 0.766_044_4),
        (0.5, 0.866_025_4),
        (0.342_020_15, 0.939_692_6),
        (0.173_648_18, 0.984_807_8),
    ];
    let mut best = (f32::NEG_INFINITY, direction);
    for (cos, sin) in TURNS.into_iter().flat_map(|(cos, sin)| [(cos, sin), (cos, -sin)]) {
        let way = direction * cos + direction.perp() * sin;
        let mut liking = 0.35 * cos;
        for share in [0.5, 1.0, 1.5] {
            let uv = (from + way * (share * length)) / extent;
            liking += mask.weak_at(uv) - mask.strong_at(uv);
        }
        if mask.blocks(from / extent, (from + way * length) / extent) {
            liking -= 100.0;
        }
        if liking > best.0 {
            best = (liking, way);
        }
    }
    best.1
}

/// The end of a segment of `length`; where the border of the surface is no further than `margin` beyond, the border.
///
/// So cracks run into the border instead of ending just before it, and never leave the surface.
fn up_to_border(from: Vec2, direction: Vec2, length: f32, margin: f32, extent: Vec2) -> Vec2 {
    let far = from + direction * (length + margin);
    let mut share = 1.0f32;
    for axis in 0..2 {
        let way = far[axis] - from[axis];
        if far[axis] < 0.0 {
            share = share.min(-from[axis] / way);
        } else if far[axis] > extent[axis] {
            share = share.min((extent[axis] - from[axis]) / way);
        }
    }
    if share < 1.0 { (from + (far - from) * share).clamp(Vec2::ZERO, extent) } else { from + direction * length }
}
