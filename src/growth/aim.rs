//! The direction of growth: eq. 2 of Couto et al.

use super::{
    changes::TreeLinks,
    draws,
    impact::Impact,
    masonry::{Masonry, Way},
    params::{PROGRESS, StartLayout},
    pull::{NO_PULL, Pull},
    state::CrackGrowth,
    steer::{steer, turned_at_most, up_to_border},
};
use crate::{
    math::{hash_unit, mix, ops},
    pattern::{NO_PARENT, Node},
};
use core::ops::Range;
use glam::Vec2;

/// Cosine of the largest angle between a ray and a marker that attracts it: 20 degrees.
const ASIDE: f32 = 0.94;

/// The same for the arms of a hit and their side branches: cosine of 60 degrees to their direction, and to their
/// direction some segments before.
const IN_SIGHT: f32 = 0.5;

/// Number of those segments.
const BEFORE: u32 = 8;

/// Arms may deviate from the direction away from the hit by the fork angle plus the first value, and at least by the
/// second; radians.
const OFF_HIT: (f32, f32) = (0.4, 1.3);

/// Largest angle between a fork and a marker for it, radians.
const FOR_FORK: f32 = 0.45;

/// Deviation of a crack within a grain, as a share of its deviation from grain to grain.
const WITHIN_GRAIN: f32 = 0.3;

/// A crack in masonry runs along a bed joint for this many bricks, and then takes the next head joint.
const LONGEST_RUN: f32 = 0.9;

/// How strongly a crack in masonry prefers to go up or down as it last did.
const STAIRS: f32 = 0.4;

/// How strongly it prefers to leave at a nearby side of the wall.
const OUT: f32 = 5.0;

/// Distance that counts as near to a hit of energy 1, bricks; proportional to the fourth root of the energy.
const NEAR_HIT: f32 = 0.7;

/// Share of the nodes along a brick at which a hairline splits it.
const SPLIT: f32 = 0.06;

/// A crack that could only go this far to the border is on it, pattern units.
const ON_BORDER: f32 = 1e-5;

const FIXED: f32 = 16_777_216.0;

impl CrackGrowth {
    /// How far to the side a marker that attracts a crack may lie, as cosines: of the angle to its direction, to the
    /// direction from the hit, and to its direction some segments before.
    fn sight(&self) -> Option<[f32; 3]> {
        let are_arms = self.arrest.is_some()
            && self.params.inertia > 0.0
            && matches!(self.params.starts, StartLayout::Arms { .. })
            && (self.mask.is_empty() || self.masonry.is_some());
        if self.are_rays() {
            return Some([ASIDE, -1.0, -1.0]);
        }
        let off_hit = (self.params.fork_angle + OFF_HIT.0).max(OFF_HIT.1);
        are_arms.then(|| [IN_SIGHT, ops::cos(off_hit), IN_SIGHT])
    }

    /// The direction of a crack with the course `course` at `pos`, with its random deviation: straight within a
    /// grain, another one in the next.
    fn strayed(&self, course: Vec2, pos: Vec2, child: u64, generation: u32) -> Vec2 {
        // One draw per child, which depends only on its index.
        let mut stray = 2.0 * hash_unit(self.seed ^ draws::STRAY, child) - 1.0;
        if self.params.grain > 0.0 {
            let cell = (pos / self.params.grain).as_uvec2();
            let draw = hash_unit(self.seed ^ draws::GRAIN, u64::from(cell.y) << 32 | u64::from(cell.x));
            stray = WITHIN_GRAIN * stray + 2.0 * draw - 1.0;
            // Cracks along the border kink away from it.
            let (extent, near) = (self.network.extent(), 2.0 * self.params.arrest);
            let sides =
                [(pos.x, Vec2::NEG_X), (extent.x - pos.x, Vec2::X), (pos.y, Vec2::NEG_Y), (extent.y - pos.y, Vec2::Y)];
            for (distance, out) in sides {
                if distance < near && course.dot(out).abs() < 0.5 && course.perp().dot(out) * stray > 0.0 {
                    stray *= -0.5;
                }
            }
        }
        if self.params.zigzag > 0.0 {
            let side = if generation.is_multiple_of(2) { 1.0 } else { -1.0 };
            stray += self.params.zigzag * (side * (0.45 + 0.55 * stray.abs()) - stray);
        }
        (course + course.perp() * (self.params.wander * stray)).normalize_or_zero()
    }

    /// Before pulls are collected.
    pub(super) fn begin_pulls(&mut self) {
        self.field.grow_older();
        self.field.sweep();
        self.ways.clear();
    }

    /// Collects `S(c)` of every node that some markers pull.
    pub(super) fn gather_pulls(&mut self, markers: Range<usize>) {
        let sight = self.sight();
        let Self { field, network, impacts, pulls, ways, courses, pull_of, changes, .. } = self;
        field.each_pull(markers, &network.nodes, |index, node, distance_sq| {
            let slot = &mut pull_of[node as usize];
            if *slot == NO_PULL {
                *slot = pulls.len() as u32;
                if sight.is_some() {
                    ways.push(kept(&network.nodes, node, courses, &changes.tree, impacts));
                }
                pulls.push(Pull {
                    node,
                    sum: [0, 0],
                    closest: index,
                    closest_sq: f32::INFINITY,
                    closest_id: u32::MAX,
                    child: Vec2::ZERO,
                    course: Vec2::ZERO,
                    heading: Vec2::ZERO,
                    fork: 0.0,
                    has_markers: [false; 2],
                    side: None,
                    serves: false,
                    stopped: None,
                });
            }
            let (pull, ways) = (&mut pulls[*slot as usize], ways.get(*slot as usize));
            let marker = field.marker(index);
            let way = marker.pos - network.nodes[node as usize].pos;
            // Markers to the side of a ray are left to other rays.
            let distance = distance_sq.sqrt();
            let is_seen = |ways: &[Vec2; 3]| {
                let sight = sight.unwrap_or([-1.0; 3]);
                ways.iter().zip(sight).all(|(&kept, cos)| kept == Vec2::ZERO || kept.dot(way) >= cos * distance)
            };
            if ways.is_none_or(is_seen) {
                let towards = way * (FIXED / distance);
                pull.sum[0] += i64::from(towards.x as i32);
                pull.sum[1] += i64::from(towards.y as i32);
            }
            if (distance_sq, marker.id) < (pull.closest_sq, pull.closest_id) {
                (pull.closest, pull.closest_sq, pull.closest_id) = (index, distance_sq, marker.id);
            }
        });
    }

    /// Once all pulls are collected: the order of the nodes.
    pub(super) fn order_pulls(&mut self) {
        self.order.clear();
        self.order.extend((0u32..).zip(&self.pulls).map(|(slot, pull)| (pull.node, slot)));
        self.order.sort_unstable();
    }

    /// Computes the positions of some children.
    pub(super) fn aim(&mut self, some: Range<usize>) {
        let extent = self.network.extent();
        let (length, kill) = (self.params.step_length, self.params.kill_distance);
        let next = (self.network.nodes.len() + some.start) as u64;
        for (child, &(_, slot)) in (next..).zip(self.order.get(some).unwrap_or_default()) {
            let pull = self.pulls[slot as usize];
            let from = self.network.nodes[pull.node as usize].pos;
            let before = self.courses[pull.node as usize];
            let mut course = Vec2::new(pull.sum[0] as f32, pull.sum[1] as f32).normalize_or_zero();
            // A side branch has another heading already, and in a joint the crack follows the joint.
            if self.params.inertia > 0.0 && before.dot(course) > 0.0 {
                let inertia = self.params.inertia * (1.0 - self.mask.weak_at(from / extent));
                course = (course + before * inertia).normalize_or_zero();
            }
            course = self.params.direct(course);
            let mut direction = course;
            if self.params.wander > 0.0 {
                let generation = self.network.nodes[pull.node as usize].generation;
                direction = self.strayed(course, from, child, generation);
            }
            let heading = self.heading_of(pull.node);
            if let Some(masonry) = &self.masonry {
                let (child, side) = self.way_in_joints(masonry, pull.node, course);
                let pull = &mut self.pulls[slot as usize];
                (pull.course, pull.child, pull.side) = (course, child, side);
                // Joints lead around bricks; each is used once, so this ends too.
                pull.serves = (child - from).dot(course) > -0.3 * from.distance(child);
                continue;
            }
            if !self.mask.is_empty() {
                direction = steer(from, direction, length, &self.mask, extent);
            } else if self.arrest.is_some() {
                direction = turned_at_most(heading, direction);
            }
            let fork = if self.is_fork(pull.node) {
                let draw = hash_unit(self.seed ^ draws::FORK_ANGLE, u64::from(pull.node));
                self.params.fork_angle * (0.75 + 0.5 * draw)
            } else {
                0.0
            };
            let pull = &mut self.pulls[slot as usize];
            (pull.course, pull.heading, pull.fork) = (course, heading, fork);
            pull.child = up_to_border(from, direction, length, kill, extent);
        }
    }

    /// Finds out for some markers whether the children serve them.
    pub(super) fn serve(&mut self, markers: Range<usize>) {
        let (length, kill) = (self.params.step_length, self.params.kill_distance);
        let Self { field, network, pulls, pull_of, .. } = self;
        field.each_pull(markers, &network.nodes, |index, node, distance_sq| {
            let pull = &mut pulls[pull_of[node as usize] as usize];
            if !pull.serves {
                let left_sq = field.marker(index).pos.distance_squared(pull.child);
                pull.serves = left_sq <= kill * kill || left_sq <= distance_sq - PROGRESS * length * length;
            }
            if pull.fork > 0.0 {
                let way = field.marker(index).pos - network.nodes[node as usize].pos;
                let (along, across) = (pull.heading.dot(way), pull.heading.perp_dot(way));
                let angle = ops::atan2(across.abs(), along);
                pull.has_markers[usize::from(across < 0.0)] |=
                    (angle - pull.fork).abs() <= FOR_FORK && distance_sq > 4.0 * length * length;
            }
        });
    }

    /// Once all children and whom they serve are known: side branches, and children that serve nobody.
    pub(super) fn end_aiming(&mut self) {
        let (extent, length) = (self.network.extent(), self.params.step_length);
        // A crack does not turn back: markers that it cannot serve in its direction are left to others.
        let keeps_on = self.arrest.is_some() && (self.params.inertia > 0.0 || self.has_rays() || !self.mask.is_empty());
        for pull in &mut self.pulls {
            let side = match pull.has_markers {
                [true, true] => hash_unit(self.seed ^ draws::FORK_SIDE, u64::from(pull.node)) < 0.5,
                [left, _] => left,
            };
            if pull.has_markers != [false; 2] {
                let (cos, sin) = (ops::cos(pull.fork), ops::sin(pull.fork));
                let across = if side { pull.heading.perp() } else { -pull.heading.perp() };
                let to = self.network.nodes[pull.node as usize].pos + (pull.heading * cos + across * sin) * length;
                let is_inside = to.cmpgt(Vec2::ZERO).all() && to.cmplt(extent).all();
                pull.side = is_inside.then_some(to);
            }
        }
        for (slot, pull) in self.pulls.iter_mut().enumerate() {
            if pull.sum == [0, 0] && self.ways.get(slot).is_some_and(|ways| *ways != [Vec2::ZERO; 3]) {
                pull.serves = false;
                continue;
            }
            let is_start = self.network.nodes[pull.node as usize].parent == NO_PARENT;
            if !pull.serves && (is_start || !keeps_on) && self.masonry.is_none() {
                let (from, to) = (self.network.nodes[pull.node as usize].pos, self.field.marker(pull.closest).pos);
                let distance = pull.closest_sq.sqrt();
                pull.child = if distance <= length { to } else { from + (to - from) * (length / distance) };
                pull.serves = true;
                // Markers of rays may lie beyond the border: the ray ends on it.
                let is_on = pull.child.cmpge(Vec2::ZERO).all() && pull.child.cmple(extent).all();
                if !is_on && self.arrest.is_none() {
                    pull.child = up_to_border(from, pull.child - from, 1.0, 0.0, extent);
                    pull.serves = from.distance(pull.child) > ON_BORDER;
                }
            }
        }
    }
}

impl CrackGrowth {
    /// The direction in which a crack in masonry continues from a node, and that of a side branch.
    fn way_in_joints(&self, masonry: &Masonry, node: u32, course: Vec2) -> (Vec2, Option<Vec2>) {
        let Node { pos, parent, impact, .. } = self.network.nodes[node as usize];
        let (heading, length) = (self.heading_of(node), self.params.step_length);
        // A crack that has split a brick ends at the next joint.
        let is_split = |node: &Node| !masonry.is_in_joint(0.5 * (node.pos + pos));
        if self.network.nodes.get(parent as usize).is_some_and(is_split) {
            return (pos, None);
        }
        let draw = |what: u64| hash_unit(self.seed ^ what, u64::from(node));
        // Its length along the bed joint so far.
        let (mut run, mut at, mut rise) = (0.0, node, 0.0);
        while let Some(before) = self.network.nodes.get(self.network.nodes[at as usize].parent as usize) {
            let way = self.network.nodes[at as usize].pos - before.pos;
            if way.y.abs() > way.x.abs() || run > 2.0 * masonry.brick() {
                rise = if way.y.abs() > way.x.abs() { way.y.signum() } else { 0.0 };
                break;
            }
            run += way.x.abs();
            at = self.network.nodes[at as usize].parent;
        }
        // From a hit cracks run in both directions.
        if self.network.nodes[at as usize].parent == NO_PARENT {
            run *= 2.0;
        }
        let mut ways: Vec<(f32, Way)> = masonry
            .ways(pos)
            .into_iter()
            .filter(|(way, _)| way.dot(heading) > -0.5)
            .map(|(way, far)| {
                let is_level = way.x != 0.0;
                let too_far = is_level && run > LONGEST_RUN * masonry.brick();
                let liking =
                    way.dot(course) + 0.55 * draw(if is_level { draws::LEVEL_JOINT } else { draws::HEAD_JOINT });
                // A staircase continues up or down as before.
                let stairs = STAIRS * rise * way.y;
                // It prefers to leave to the side instead of running up and down beside the border.
                let to = pos.x + way.x * far;
                let out = if is_level && (to <= 0.0 || to >= self.network.extent().x) { OUT } else { 0.0 };
                (liking + stairs + out - if too_far { 4.0 } else { 0.0 }, (way, far))
            })
            .collect();
        ways.sort_by(|a, b| b.0.total_cmp(&a.0));
        let Some(&(_, best)) = ways.first() else { return (pos, None) };
        // The other directions are for the sides of its forks.
        if self.child_of(node) != NO_PARENT {
            return (pos, None);
        }
        // Near the hit a crack takes both directions at the end of a head joint.
        let is_near_hit = self.impacts.get(impact as usize).is_some_and(|impact| {
            let near = NEAR_HIT * masonry.brick() * impact.energy.sqrt().sqrt();
            masonry.nearest(impact.pos).unwrap_or(impact.pos).distance(pos) < near
        });
        let is_level = best.0.x != 0.0 && heading.x != 0.0;
        let side = if ways.len() > 1 && ways[1].0 > -0.3 && (is_near_hit && heading.y != 0.0 || self.is_fork(node)) {
            Some(masonry.end(pos, ways[1].1, length))
        } else if ways.len() == 1 && is_level && self.child_of(parent) == node && draw(draws::SPLIT) < SPLIT {
            // Through the brick above or below.
            let up = if course.y.abs() > 0.3 { course.y.signum() } else { (draw(draws::SPLIT_SIDE) - 0.5).signum() };
            masonry.across(pos, up)
        } else {
            None
        };
        (masonry.end(pos, best, length), side)
    }

    /// Whether a side branch may start at a tip: at some distance from the last one, and less often further from the
    /// hit.
    fn is_fork(&self, node: u32) -> bool {
        let Node { parent, generation, pos, impact, .. } = self.network.nodes[node as usize];
        let mut chance = self.params.forks;
        if self.params.focus > 0.0
            && let Some(impact) = self.impacts.get(impact as usize)
        {
            let share = pos.distance(impact.pos) / (self.params.reach * impact.energy.sqrt());
            chance *= ops::powf((1.0 - share).max(0.0), self.params.focus);
        }
        self.params.forks > 0.0
            && !self.has_rays()
            && self.arrest.is_some()
            && generation > 1
            && self.child_of(node) == NO_PARENT
            && parent != NO_PARENT
            && self.child_of(parent) == node
            && self.changes.tree[node as usize].sibling == NO_PARENT
            && hash_unit(mix(self.seed ^ draws::FORK), u64::from(node)) < chance
    }
}

/// The directions to which a crack is bound: its own, that from the hit, and its direction some segments before, or
/// where its branch started. Zero for a start, which may turn anywhere.
fn kept(nodes: &[Node], node: u32, courses: &[Vec2], tree: &[TreeLinks], impacts: &[Impact]) -> [Vec2; 3] {
    let Node { pos, parent, impact, .. } = nodes[node as usize];
    let Some(before) = nodes.get(parent as usize) else { return [Vec2::ZERO; 3] };
    let heading = courses[node as usize];
    let hit = impacts.get(impact as usize).map_or(before.pos, |impact| impact.pos);
    let mut earlier = node;
    for _ in 0..BEFORE {
        let Node { parent, .. } = nodes[earlier as usize];
        let is_first_child = tree[earlier as usize].sibling == NO_PARENT;
        if !is_first_child || nodes.get(parent as usize).is_none_or(|before| before.parent == NO_PARENT) {
            break;
        }
        earlier = parent;
    }
    [heading, (pos - hit).normalize_or(heading), courses[earlier as usize]]
}
