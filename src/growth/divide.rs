//! Cracks that divide domains: the cells of mud, clay, glaze and tempered glass.
//!
//! Drying or cooling material cracks where the stress is largest, farthest from all older cracks. A crack runs both
//! ways until it meets older cracks and so divides a domain in two, until all domains are small. Here the markers
//! represent the stress: each knows its distance to the nearest crack, to the border and to the rim of the area that
//! its hit has loaded. A marker within the kill distance of a crack is removed. Where a marker is further away than
//! its generation allows, a crack starts across the shorter direction of the domain. Its two tips follow their
//! markers by eq. 2 of Couto et al., with inertia, and never branch. Arrest lets them meet what is ahead at a steep
//! angle.

use super::{
    arrest::{Advance, Arrest},
    division::Tip,
    domain::Across,
    draws,
    params::{PROGRESS, StartLayout},
    state::CrackGrowth,
    steer::steer,
};
use crate::{
    math::hash_unit,
    pattern::{LinkKind, NO_PARENT, Node},
};
use glam::Vec2;
use std::{cmp::Ordering, collections::BinaryHeap};

/// Largest number of steps that a tip runs straight without markers.
pub(super) const STRAIGHT: u16 = 400;

/// Cosine of the largest angle between a tip and a marker that attracts it: 20 degrees. Cracks run straight across
/// their domains.
const AHEAD: f32 = 0.94;

/// No crack starts within this many times its distance to other cracks from a moving tip.
const QUIET: f32 = 2.0;

/// A domain whose middle is only this share of the allowed distance away from cracks is divided if it is
/// correspondingly longer.
const NARROW: f32 = 0.6;

/// How much larger than its generation allows a long domain must be, as the root of the product of its half lengths.
const LONG: f32 = 1.05;

/// Distance, in kill distances, within which a tip that has left the region of its hit closes a cell with an existing
/// crack.
const CLOSE: f32 = 2.5;

/// Distance, in segment lengths, within which a blocked end is joined to an existing crack.
const STRANDED: f32 = 3.0;

/// Cosine of the largest angle to its direction in which it searches for that crack.
const ASIDE: f32 = 0.25;

/// The same for a straight crack.
const STRAIGHT_ASIDE: f32 = 0.35;

/// A crack starts in a step only if its marker is still at least this share of its distance away from those that have
/// started in it.
const STILL: f32 = 0.8;

/// Nodes for which there must be room where a crack starts.
const ROOM: usize = 3;

/// A little more than 1, for rounding.
const NO_CLOSER: f32 = 1.001;

/// A domain may be divided in three if its length is at most this many times its width.
const ROUND: f32 = 1.7;

/// Deviation of a crack within a grain, as a share of its deviation from grain to grain.
const WITHIN_GRAIN: f32 = 0.3;

/// A marker at which a crack may start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) marker: u32,
    pub(super) id: u32,
    pub(super) impact: u32,
    pub(super) pos: Vec2,
    /// Distance to the nearest crack, squared.
    pub(super) near_sq: f32,
    /// Distance to the hit.
    from_hit: f32,
}

/// The farthest from all cracks is the greatest; ties go to the one nearest to the hit.
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        let nearer = other.from_hit.total_cmp(&self.from_hit).then(other.id.cmp(&self.id));
        self.near_sq.total_cmp(&other.near_sq).then(nearer)
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}

impl CrackGrowth {
    /// One step of a growth that divides domains. `found` is for the next steps in which nothing happens either.
    pub(super) fn divide(&mut self, found: &mut Vec<Candidate>) {
        let first = self.network.nodes.len() as u32;
        let Some(division) = &mut self.division else { return };
        division.seen = first;
        let tips = std::mem::take(&mut division.tips);
        let fresh = std::mem::take(&mut division.fresh);
        let is_running = self.arrest.as_ref().is_some_and(Arrest::is_running);
        let is_idle = tips.is_empty() && fresh.is_empty() && !is_running;
        let due = self.params.nucleation * self.steps.saturating_add(1) as f32;
        let is_due = (self.nucleated as f32) < due;
        // Else what is left comes to rest.
        let may_begin = self.params.nucleation > 0.0 && self.room() >= ROOM;
        let candidates = if !may_begin {
            Vec::new()
        } else if is_idle {
            self.idle_candidates(found)
        } else if is_due {
            self.candidates(false)
        } else {
            Vec::new()
        };
        self.timeline.begin(self.steps.saturating_add(1));
        self.new_nodes = first..first;
        if is_idle && candidates.is_empty() && self.room() > 0 {
            self.run_out();
        }
        let is_running = self.arrest.as_ref().is_some_and(Arrest::is_running);
        let is_over = !is_running && self.division.as_ref().is_none_or(|division| division.tips.is_empty());
        if is_idle && candidates.is_empty() && is_over || self.room() == 0 {
            self.steps_left = 0;
            self.join_newborn();
            return;
        }
        self.steps = self.steps.saturating_add(1);
        for node in fresh {
            if self.network.nodes[node as usize].parent != NO_PARENT {
                self.keep_tip(Tip { node, course: self.heading_of(node), straight: 0, runs_out: false });
            } else if !matches!(self.params.starts, StartLayout::Crushed { .. }) && self.child_of(node) == NO_PARENT {
                let Node { pos, impact, .. } = self.network.nodes[node as usize];
                if let Some(across) = self.across(pos, impact, node, self.params.crack_radius) {
                    self.run_out_of(node, across);
                }
            }
        }
        for tip in tips {
            self.advance_tip(tip);
        }
        self.advance_runners();
        self.show_markers();
        // Few of them are needed, so they are not sorted.
        let mut candidates = BinaryHeap::from(candidates);
        while (self.nucleated as f32) < due
            && let Some(candidate) = candidates.pop()
        {
            self.begin_crack(candidate);
        }
        self.nucleated = self.nucleated.max(due as u32);
        self.new_nodes = first..self.network.nodes.len() as u32;
        self.join_newborn();
    }

    /// The markers at which cracks may start when nothing else happens: there are some as long as domains are too large.
    /// `found` has them from the step before if nothing has grown since; only those that were taken are missing now.
    fn idle_candidates(&mut self, found: &mut Vec<Candidate>) -> Vec<Candidate> {
        found.retain(|candidate| self.field.near_sq(candidate.marker) == candidate.near_sq);
        while found.is_empty() {
            *found = self.candidates(true);
            let Some(division) = &mut self.division else { break };
            if u32::from(division.generation) + 1 >= self.params.generations {
                break;
            }
            // The next generation starts when this one no longer grows.
            if found.is_empty() {
                division.generation += 1;
                self.field.seek_again();
            }
        }
        let ahead = |candidate: &Candidate| candidate.from_hit - self.front(candidate.impact);
        let nearest = found.iter().map(ahead).fold(f32::INFINITY, f32::min);
        // If nothing is left behind the front it jumps ahead.
        let leap = if nearest > 0.0 { nearest + self.params.front } else { f32::INFINITY };
        found.iter().filter(|candidate| ahead(candidate) <= leap).copied().collect()
    }

    /// The markers at which cracks may start, as far from all cracks as the generation allows; those beyond the front only
    /// if nothing else happens.
    ///
    /// No crack ever starts at the others in this generation, because distances to cracks only become smaller.
    pub(super) fn candidates(&mut self, is_idle: bool) -> Vec<Candidate> {
        let mut found = Vec::new();
        let fronts: Vec<f32> = (0..self.impacts.len() as u32).map(|impact| self.front(impact)).collect();
        let Self { division: Some(division), field, params, impacts, seed, .. } = self else { return found };
        let generation = division.generation;
        let is_last = u32::from(generation) + 1 >= params.generations;
        let narrow = if is_last { NARROW } else { 1.0 };
        let finest = narrow * params.loaded(generation, 0.0, f32::INFINITY);
        let patches = params.patches(*seed);
        field.retain_beyond(finest * finest, |marker, id, pos, near_sq, impact| {
            let (Some(hit), Some(&front)) = (impacts.get(impact as usize), fronts.get(impact as usize)) else {
                return false;
            };
            let from_hit_sq = hit.pos.distance_squared(pos);
            if !is_idle && from_hit_sq > front * front {
                return true;
            }
            let from_hit = from_hit_sq.sqrt();
            let reach = division.reach_of(impact);
            // A patch is a factor of 1 or more: most markers are too near even without it.
            let least = params.loaded(generation, from_hit, reach);
            if near_sq <= (narrow * least) * (narrow * least) {
                return false;
            }
            // Far from all cracks it is far enough whatever the patch; cosines take most of the time of this search.
            let most = NO_CLOSER * narrow * least * patches.most();
            // As where a crack begins, or there would be markers at which none ever does.
            let is_far = near_sq > most * most || near_sq.sqrt() > narrow * (least * patches.at(pos));
            if is_far {
                found.push(Candidate { marker, id, impact, pos, near_sq, from_hit });
            }
            is_far
        });
        found
    }

    /// Largest distance from its hit at which cracks of an impact may start.
    fn front(&self, impact: u32) -> f32 {
        let begun = self.division.as_ref().and_then(|division| division.step_of(impact));
        match begun {
            Some(step) if self.params.front > 0.0 => {
                self.params.front * self.steps.saturating_sub(step).saturating_add(1) as f32
            }
            _ => f32::INFINITY,
        }
    }

    /// Starts a crack at a marker if it is still far enough from all others.
    fn begin_crack(&mut self, candidate: Candidate) {
        let near_sq = self.field.near_sq(candidate.marker);
        let Some(division) = &self.division else { return };
        let reach = division.reach_of(candidate.impact);
        let patch = self.params.patches(self.seed).at(candidate.pos);
        let loaded = self.params.loaded(division.generation, candidate.from_hit, reach) * patch;
        if near_sq < STILL * STILL * candidate.near_sq || self.room() < ROOM {
            return;
        }
        let (near, is_last) = (near_sq.sqrt(), u32::from(division.generation) + 1 >= self.params.generations);
        if near <= if is_last { NARROW * loaded } else { loaded } {
            return;
        }
        let is_quiet = |tip: u32| {
            let place = self.network.nodes[tip as usize].pos;
            place.distance_squared(candidate.pos) > QUIET * QUIET * near_sq
        };
        let runners = self.arrest.as_ref().map(Arrest::running).into_iter().flatten();
        if !division.tips.iter().map(|tip| tip.node).chain(runners).all(is_quiet) {
            return;
        }
        let Some(across @ Across { middle, length, .. }) =
            self.across(candidate.pos, candidate.impact, candidate.marker, near.max(loaded))
        else {
            self.field.take(candidate.marker);
            return;
        };
        if near <= loaded {
            let is_long = near * 0.5 * length > (LONG * loaded) * (LONG * loaded);
            if !is_long {
                // It never will be.
                self.field.take(candidate.marker);
                return;
            }
        }
        self.field.take(candidate.marker);
        if self.mask.is_forbidden(middle / self.network.extent()) {
            return;
        }
        self.nucleated = self.nucleated.saturating_add(1);
        let node = self.network.nodes.len() as u32;
        self.add_node(middle, NO_PARENT, 0, candidate.impact, 1.0);
        self.run_out_of(node, across);
        self.show_markers();
    }

    /// The first segments of a crack: in both directions across its domain, or in three directions.
    fn run_out_of(&mut self, node: u32, Across { way, longer, .. }: Across) {
        let pos = self.network.nodes[node as usize].pos;
        let draw = hash_unit(self.seed ^ draws::STAR, u64::from(node));
        let is_star = self.params.three_arm_share > 0.0 && longer < ROUND && draw < self.params.three_arm_share;
        let third = Vec2::new(-0.5, 0.866_025_4);
        let ways = [way, if is_star { third.rotate(way) } else { -way }, Vec2::new(-0.5, -0.866_025_4).rotate(way)];
        for way in ways.into_iter().take(if is_star { 3 } else { 2 }) {
            let born = self.network.nodes.len() as u32;
            if self.advance(node, pos + way * self.params.step_length) == Advance::Grown {
                self.keep_tip(Tip { node: born, course: way, straight: 0, runs_out: false });
            }
        }
        if let Some(arrest) = &mut self.arrest {
            arrest.seal(node);
        }
    }

    /// Records a growing tip, if the crack may continue there.
    fn keep_tip(&mut self, tip: Tip) {
        if (tip.node as usize) < self.network.nodes.len()
            && !self.arrest.as_ref().is_some_and(|arrest| arrest.is_sealed(tip.node))
            && let Some(division) = &mut self.division
        {
            division.tips.push(tip);
        }
    }

    /// Grows a tip by a segment: towards its markers, or straight if it has none.
    fn advance_tip(&mut self, tip: Tip) {
        let Tip { node, course, straight, runs_out } = tip;
        if self.is_over(node) {
            return;
        }
        let this = self.network.nodes[node as usize];
        let Some(before) = self.network.nodes.get(this.parent as usize) else { return };
        let last = (this.pos - before.pos).normalize_or_zero();
        let heading = (last + (course - last) * self.params.straightness).normalize_or(last);
        let (length, child) = (self.params.step_length, self.network.nodes.len() as u32);
        let stray = self.params.wander * self.stray(before.pos, this.pos, child);
        let drawn = self.drawn(this.pos, heading).map(|pull| {
            let direction = self.params.direct((pull + heading * self.params.inertia).normalize_or(heading));
            let mut direction = (direction + direction.perp() * stray).normalize_or_zero();
            if !self.mask.is_empty() {
                direction = steer(this.pos, direction, length, &self.mask, self.network.extent());
            }
            this.pos + direction * length
        });
        let to = drawn.filter(|&to| self.serves(this.pos, heading, to));
        if to.is_none() && !runs_out && self.has_left(node) {
            self.rest(tip);
            return;
        }
        let runs_straight = to.is_none();
        if runs_straight && straight >= STRAIGHT {
            return;
        }
        let to = to.unwrap_or(this.pos + (heading + heading.perp() * stray).normalize_or_zero() * length);
        if self.advance(node, to) == Advance::Grown {
            self.keep_tip(Tip { node: child, course, straight: straight + u16::from(runs_straight), runs_out });
        }
        if let Some(arrest) = &mut self.arrest {
            arrest.seal(node);
        }
    }

    /// The random deviation of a crack at a node, -1..=1; with grains it changes from one to the next.
    fn stray(&self, before: Vec2, pos: Vec2, child: u32) -> f32 {
        let stray = 2.0 * hash_unit(self.seed ^ draws::STRAY, u64::from(child)) - 1.0;
        if self.params.grain <= 0.0 {
            return stray;
        }
        let cell = |pos: Vec2| (pos / self.params.grain).as_uvec2();
        if cell(before) == cell(pos) { WITHIN_GRAIN * stray } else { 2.0 * stray }
    }

    /// The direction in which the markers ahead attract a tip: eq. 2.
    fn drawn(&self, pos: Vec2, heading: Vec2) -> Option<Vec2> {
        let mut sum = [0i64; 2];
        self.field.each_own(pos, |marker, distance_sq| {
            let (way, distance) = (marker - pos, distance_sq.sqrt());
            if way.dot(heading) >= AHEAD * distance {
                let towards = way * (16_777_216.0 / distance);
                sum[0] += i64::from(towards.x as i32);
                sum[1] += i64::from(towards.y as i32);
            }
        });
        (sum != [0, 0]).then(|| Vec2::new(sum[0] as f32, sum[1] as f32).normalize_or(heading))
    }

    /// Whether a segment from `pos` to `to` serves one of those markers.
    fn serves(&self, pos: Vec2, heading: Vec2, to: Vec2) -> bool {
        let (kill, progress) =
            (self.params.kill_distance, PROGRESS * self.params.step_length * self.params.step_length);
        let mut serves = false;
        self.field.each_own(pos, |marker, distance_sq| {
            let left_sq = marker.distance_squared(to);
            let is_nearer = left_sq <= kill * kill || left_sq <= distance_sq - progress;
            serves |= is_nearer && (marker - pos).dot(heading) >= AHEAD * distance_sq.sqrt();
        });
        serves
    }

    /// Lets the waiting tips continue that were not met, except those that stay open.
    fn run_out(&mut self) {
        let Some(division) = &mut self.division else { return };
        let resting = std::mem::take(&mut division.resting);
        if resting.is_empty() && self.params.open_ends <= 0.0 {
            self.join_stranded();
        }
        for tip in resting {
            if !self.closes(tip.node) && self.params.open_ends <= 0.0 {
                self.keep_tip(Tip { runs_out: true, ..tip });
            }
        }
    }

    /// Joins blocked tips to a near crack, if the geometry allows it.
    fn join_stranded(&mut self) {
        let mut is_joined = vec![false; self.network.nodes.len()];
        for link in &self.network.links {
            is_joined[link.a as usize] = true;
            is_joined[link.b as usize] = true;
        }
        let extent = self.network.extent();
        for tip in 0..self.network.nodes.len() as u32 {
            let Node { pos, parent, .. } = self.network.nodes[tip as usize];
            let is_end = parent != NO_PARENT && self.child_of(tip) == NO_PARENT && !is_joined[tip as usize];
            if !is_end || (pos.cmpeq(Vec2::ZERO) | pos.cmpeq(extent)).any() {
                continue;
            }
            let mut near = Vec::new();
            self.nodes.within(pos, STRANDED * self.params.step_length, |node, distance_sq| {
                if distance_sq > 0.0 && !self.is_same_crack(tip, node) {
                    near.push((distance_sq, node));
                }
            });
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            near.into_iter().any(|(_, node)| self.join(node, tip, LinkKind::Junction));
        }
    }

    /// Sends a tip to a crack with which it can close a cell, to the side or ahead.
    fn closes(&mut self, tip: u32) -> bool {
        let Node { pos, parent, .. } = self.network.nodes[tip as usize];
        let heading = self.network.nodes.get(parent as usize).map_or(Vec2::ZERO, |before| pos - before.pos);
        let aside = ASIDE + STRAIGHT_ASIDE * self.params.straightness;
        !self.stays_open(tip) && self.run_on(tip, heading.normalize_or_zero(), CLOSE * self.params.kill_distance, aside)
    }

    /// Lets a tip wait for a crack that meets it.
    fn rest(&mut self, tip: Tip) {
        if let Some(division) = &mut self.division {
            division.resting.push(tip);
        }
    }

    /// Shows new nodes to the markers.
    fn show_markers(&mut self) {
        let last = self.network.nodes.len() as u32;
        let Some(division) = &mut self.division else { return };
        for node in std::mem::replace(&mut division.seen, last)..last {
            self.field.visit(node, &self.network.nodes, &self.nodes);
        }
    }
}
