//! Cracks that divide domains: the cells of mud, clay, glaze and tempered glass.
//!
//! What dries or cools cracks where it is stressed most, farthest from all older cracks; a crack runs both ways until it meets older ones,
//! and so divides a domain in two, until all domains are small. Here the markers are the stress: each knows how far the nearest crack,
//! the border or the rim of what its hit has loaded is. One that is within the kill distance of a crack dies. Where one is further
//! away than its generation allows a crack begins, across the shorter way of the domain; its two tips follow their markers by
//! eq. 2 of Couto et al., with inertia, and never branch; arrest lets them meet what is ahead steeply.

use super::{
    CrackGrowth, GrowthParams, StartLayout,
    arrest::{Advance, Arrest},
    params::{PROGRESS, Venation},
    pull::steer,
};
use crate::{
    math::{hash_unit, ops},
    pattern::{LinkKind, NO_PARENT, Node},
};
use glam::Vec2;
use std::{f32::consts::PI, ops::Range};

/// How many times further apart the cracks of a generation are than those of the next.
const COARSER: f32 = 1.6;

/// How many times narrower the cracks of a generation are than those of the one before.
const NARROWER: f32 = 0.5;

/// Axes along which the width of a domain is measured.
pub(super) const AXES: usize = 8;

/// How far the width of a domain is measured, in distances to its nearest crack.
const FAR: f32 = 2.5;

/// Steps that a tip runs straight on at most where nothing draws it any more.
pub(super) const STRAIGHT: u16 = 400;

/// Cosine of the angle to its way beyond which a marker does not draw a tip: 20 degrees. Cracks run straight across their domains.
const AHEAD: f32 = 0.94;

/// A side on which a domain is open counts as so many times as far as is looked.
const OPEN: f32 = 2.0;

/// No crack begins within so many of its distances to other cracks from a tip that runs.
const QUIET: f32 = 2.0;

/// A domain whose middle is this share of what its generation allows away from cracks is divided if it is as much longer.
const NARROW: f32 = 0.6;

/// How much larger than its generation allows a long domain must be, by the root of its halves' product.
const LONG: f32 = 1.05;

/// Beyond the rim within so many times as far as is looked, a domain is open.
const BEYOND: f32 = 1.5;

/// Radians of the shortest wave in which the size of domains changes from place to place, a kill distance.
const PATCHES: f32 = 0.95;

/// How much less far than its reach a hit loads the surface in some directions, as a share.
const UNEVEN: f32 = 0.3;

/// Kill distances within which a tip that has left the region of its hit closes a cell with what is there.
const CLOSE: f32 = 2.5;

/// Segment lengths within which an end that something was in the way of is joined to what is there.
const STRANDED: f32 = 3.0;

/// Cosine of the angle to its way up to which it looks for that.
const ASIDE: f32 = 0.25;

/// How much larger that is for a steady crack.
const STEADY_ASIDE: f32 = 0.35;

/// How much less a crack likes to begin where it would meet others aslant.
const SLANT: f32 = 0.25;

/// The same of a steady crack, besides.
const STEEP: f32 = 0.75;

/// Cosine of the angle between the ways of two tips below which they come towards each other.
const HEAD_ON: f32 = 0.2;

/// The same above which a steady crack does not make for a tip that waits: they run side by side.
const ALONG: f32 = 0.6;

/// A steady crack narrows where it meets one that is so many times narrower.
pub(super) const MUCH_WIDER: f32 = 1.7;

/// From which share of the way to the rim on cracks thin out.
const THINS: f32 = 0.4;

/// How many times larger domains are at the rim than nearer to the hit, less one.
const SPARSER: f32 = 0.8;

/// A tip that has left the region of its hit is met from so many times as far as other cracks.
const INVITES: f32 = 1.4;

/// A crack begins in this step if its marker is still so much of its distance away from those that have begun in it.
const STILL: f32 = 0.8;

/// A domain that is no more than so many times as long as wide may be divided in three.
const ROUND: f32 = 1.7;

/// Within a grain a crack strays by this much of what it strays from grain to grain.
const WITHIN_GRAIN: f32 = 0.3;

/// Kill distances around a hit within which domains are finer and drawn out away from it.
const AROUND: f32 = 14.0;

/// What a growth that divides domains knows besides its network.
#[derive(Clone, Debug, Default)]
pub(super) struct Division {
    /// Ends of cracks that grow.
    tips: Vec<Tip>,
    /// Nodes that hits have made since the last step.
    fresh: Range<u32>,
    /// The generation that begins now.
    generation: u8,
    /// Of each node's crack; none = the first generation, as wide as it may be.
    kinds: Vec<Kind>,
    /// Steps at which the impacts came, and radii of what they have loaded.
    begun: Vec<(u32, f32)>,
    /// Tips that have left what their hit has loaded, and wait for a crack that meets them.
    resting: Vec<Tip>,
    /// Nodes that the markers have seen.
    seen: u32,
}

/// What the nodes of a crack have in common.
#[derive(Clone, Copy, Debug)]
struct Kind {
    generation: u8,
    /// Whether another crack has met this one here.
    is_met: bool,
    /// Whether it ends here, as it has met another, or that one has met it head on.
    is_over: bool,
    /// How much narrower it is than others of its generation.
    narrower: f32,
}

impl Kind {
    const FIRST: Self = Self { generation: 0, is_met: false, is_over: false, narrower: 1.0 };
}

#[derive(Clone, Copy, Debug)]
struct Tip {
    node: u32,
    /// The way in which its crack began.
    course: Vec2,
    /// Steps that it has run straight on.
    straight: u16,
    /// Whether it has waited at the rim for long enough.
    runs_out: bool,
}

/// A marker at which a crack may begin.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// Per axis: how far the nearest crack is one way, and how far from a right angle the axis meets it, 0..=1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    pub(super) distance: [f32; AXES],
    slant: [f32; AXES],
}

/// How a crack would divide a domain.
#[derive(Clone, Copy, Debug)]
struct Across {
    /// Along the shorter way.
    way: Vec2,
    /// Where it would begin, in the middle of the longer way.
    middle: Vec2,
    /// The longer way, and how many times as long it is.
    length: f32,
    longer: f32,
}

impl Division {
    pub(super) fn new(params: &GrowthParams) -> Option<Self> {
        (params.venation == Venation::Dividing).then(Self::default)
    }

    fn kind(&self, node: u32) -> Kind {
        self.kinds.get(node as usize).copied().unwrap_or(Kind::FIRST)
    }

    /// How much narrower than others the crack of a node is.
    pub(super) fn share(&self, node: u32) -> f32 {
        let Kind { generation, narrower, .. } = self.kind(node);
        (0..generation).fold(narrower, |share, _| share * NARROWER)
    }

    /// Notes the crack of a newborn node, which is so much narrower than others if it begins here; returns how many times as wide as others it is.
    pub(super) fn bear(&mut self, node: u32, parent: u32, narrower: f32) -> f32 {
        let kind = match self.kinds.get(parent as usize) {
            Some(&kind) => Kind { is_met: false, is_over: false, ..kind },
            None if parent == NO_PARENT => Kind { generation: self.generation, narrower, ..Kind::FIRST },
            None => Kind::FIRST,
        };
        self.kinds.resize(node as usize, Kind::FIRST);
        self.kinds.push(kind);
        self.share(node)
    }

    /// The generation of a node's crack.
    #[cfg(test)]
    pub(super) fn generation_of(&self, node: u32) -> u8 {
        self.kind(node).generation
    }

    /// How far an impact has loaded the surface.
    #[cfg(test)]
    pub(super) fn reach_of(&self, impact: u32) -> Option<f32> {
        self.begun.get(impact as usize).map(|begun| begun.1)
    }

    /// Takes up the nodes of a hit.
    pub(super) fn begin(&mut self, born: Range<u32>, step: u32, reach: f32) {
        self.begun.push((step, reach));
        let first = if self.fresh.is_empty() { born.start } else { self.fresh.start };
        self.fresh = first..born.end;
        self.generation = 0;
    }

    /// An impact has gathered more energy.
    pub(super) fn go_on(&mut self, impact: u32, reach: f32) {
        if let Some((_, rim)) = self.begun.get_mut(impact as usize) {
            *rim = reach;
        }
        self.tips.append(&mut self.resting);
        self.generation = 0;
    }

    /// Forgets the first nodes.
    pub(super) fn forget(&mut self, first: u32) {
        self.kinds.drain(..self.kinds.len().min(first as usize));
        self.fresh = self.fresh.start.saturating_sub(first)..self.fresh.end.saturating_sub(first);
        self.seen = self.seen.saturating_sub(first);
        for tips in [&mut self.tips, &mut self.resting] {
            tips.retain_mut(|tip| {
                let left = tip.node.checked_sub(first);
                tip.node = left.unwrap_or(0);
                left.is_some()
            });
        }
    }
}

impl GrowthParams {
    /// How far from all cracks a marker must be for one of this generation to begin at it.
    fn loaded(&self, generation: u8, from_hit: f32, reach: f32) -> f32 {
        let coarser = (u32::from(generation) + 1..self.generations).fold(1.0, |by, _| by * COARSER);
        let further = 1.0 + SPARSER * self.thinning * towards_rim(from_hit, reach);
        self.kill_distance * coarser * further / (1.0 + self.focus * self.near_hit(from_hit))
    }

    /// How many times further it must be from them at a place, 1 at least.
    fn patch(&self, pos: Vec2, seed: u64) -> f32 {
        if self.patches <= 0.0 {
            return 1.0;
        }
        // Waves of a few kill distances, in all directions.
        let wave = |k: u64| {
            let way = ops::unit(2.0 * PI * hash_unit(seed ^ 0xA6, k)) * (PATCHES / (1.0 + 0.35 * k as f32));
            ops::unit(way.dot(pos) / self.kill_distance + 2.0 * PI * hash_unit(seed ^ 0xA7, k)).x
        };
        let sum: f32 = (0..5).map(wave).sum();
        let share = (0.5 + 0.33 * sum).clamp(0.0, 1.0);
        1.0 + self.patches * share * share
    }

    /// 1 at the hit, 0 where domains know nothing of it any more.
    fn near_hit(&self, from_hit: f32) -> f32 {
        if self.focus <= 0.0 {
            return 0.0;
        }
        let away = (from_hit / (AROUND * self.kill_distance)).min(1.0);
        (1.0 - away) * (1.0 - away)
    }
}

impl CrackGrowth {
    /// Whether cracks divide domains.
    pub(super) const fn divides(&self) -> bool {
        self.division.is_some()
    }

    /// One step of a growth that divides domains.
    pub(super) fn divide(&mut self) {
        let first = self.network.nodes.len() as u32;
        let Some(division) = &mut self.division else { return };
        division.seen = first;
        let tips = std::mem::take(&mut division.tips);
        let fresh = std::mem::take(&mut division.fresh);
        let is_running = self.arrest.as_ref().is_some_and(Arrest::is_running);
        let is_idle = tips.is_empty() && fresh.is_empty() && !is_running;
        let mut candidates = self.candidates(is_idle);
        self.timeline.begin(self.steps.saturating_add(1));
        self.newborn = first..first;
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
        // The farthest from all cracks first, of those the nearest to the hit.
        candidates.sort_unstable_by(|a, b| {
            b.near_sq.total_cmp(&a.near_sq).then(a.from_hit.total_cmp(&b.from_hit)).then(a.id.cmp(&b.id))
        });
        let due = self.params.nucleation * self.steps as f32;
        for candidate in candidates {
            if self.nucleated as f32 >= due {
                break;
            }
            self.begin_crack(candidate);
        }
        self.nucleated = self.nucleated.max(due as u32);
        self.newborn = first..self.network.nodes.len() as u32;
        self.join_newborn();
    }

    /// Where cracks may begin in this step. If nothing else happens there are some as long as domains are too large.
    fn candidates(&mut self, is_idle: bool) -> Vec<Candidate> {
        let mut found = Vec::new();
        loop {
            let Some(division) = &self.division else { return found };
            let (params, impacts, generation) = (&self.params, &self.impacts, division.generation);
            let is_last = u32::from(generation) + 1 >= params.generations;
            let narrow = if is_last { NARROW } else { 1.0 };
            let finest = narrow * params.loaded(generation, 0.0, f32::INFINITY);
            let fronts: Vec<f32> = (0..impacts.len() as u32).map(|impact| self.front(impact)).collect();
            let mut nearest = f32::INFINITY;
            self.field.each_beyond(finest * finest, |marker, id, pos, near_sq, impact| {
                let (Some(hit), Some(&front)) = (impacts.get(impact as usize), fronts.get(impact as usize)) else {
                    return;
                };
                let from_hit_sq = hit.pos.distance_squared(pos);
                if !is_idle && from_hit_sq > front * front {
                    return;
                }
                let from_hit = from_hit_sq.sqrt();
                let reach = division.begun.get(impact as usize).map_or(f32::INFINITY, |begun| begun.1);
                let patch = params.patch(pos, self.seed);
                let loaded = narrow * (params.loaded(generation, from_hit, reach) * patch);
                if near_sq > loaded * loaded {
                    nearest = nearest.min(from_hit - front);
                    found.push(Candidate { marker, id, impact, pos, near_sq, from_hit });
                }
            });
            if is_idle && nearest > 0.0 {
                // Nothing is left behind the front: it leaps.
                let leap = nearest + self.params.front;
                found.retain(|candidate: &Candidate| candidate.from_hit - self.front(candidate.impact) <= leap);
            }
            // The next generation waits until this one has come to rest.
            if !is_idle || !found.is_empty() || is_last {
                return found;
            }
            if let Some(division) = &mut self.division {
                division.generation += 1;
            }
        }
    }

    /// How far from its hit cracks of an impact may begin.
    fn front(&self, impact: u32) -> f32 {
        let begun = self.division.as_ref().and_then(|division| division.begun.get(impact as usize));
        match begun {
            Some((step, _)) if self.params.front > 0.0 => {
                self.params.front * (self.steps.saturating_sub(*step) + 1) as f32
            }
            _ => f32::INFINITY,
        }
    }

    /// Begins a crack at a marker that is still far enough from all others.
    fn begin_crack(&mut self, candidate: Candidate) {
        let near_sq = self.field.near_sq(candidate.marker);
        let Some(division) = &self.division else { return };
        let reach = division.begun.get(candidate.impact as usize).map_or(f32::INFINITY, |begun| begun.1);
        let patch = self.params.patch(candidate.pos, self.seed);
        let loaded = self.params.loaded(division.generation, candidate.from_hit, reach) * patch;
        if near_sq < STILL * STILL * candidate.near_sq || self.room() < 3 {
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
                // Nor will it ever be.
                self.field.take(candidate.marker);
                return;
            }
        }
        self.field.take(candidate.marker);
        if self.mask.is_forbidden(middle / self.network.extent()) {
            return;
        }
        self.nucleated += 1;
        let node = self.network.nodes.len() as u32;
        self.bear(middle, NO_PARENT, 0, candidate.impact, 1.0);
        self.run_out_of(node, across);
        self.show_markers();
    }

    /// The first segments of a crack, either way across its domain, or three ways.
    fn run_out_of(&mut self, node: u32, Across { way, longer, .. }: Across) {
        let pos = self.network.nodes[node as usize].pos;
        let draw = hash_unit(self.seed ^ 0xA4, u64::from(node));
        let is_star = self.params.stars > 0.0 && longer < ROUND && draw < self.params.stars;
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

    /// The nearest cracks within `far` of a place, ahead and back along each axis.
    pub(super) fn look_around(&self, pos: Vec2, axes: &[Vec2; AXES], far: f32) -> [Sight; 2] {
        let mut sight = [Sight { distance: [f32::INFINITY; AXES], slant: [0.0; AXES] }; 2];
        let Some(arrest) = &self.arrest else { return sight };
        arrest.walls.each_near(pos, far, |from, to| {
            let (from, way) = (from - pos, to - from);
            let length_sq = way.length_squared();
            // For all axes alike, without a branch, so that they are taken at once.
            for (i, axis) in axes.iter().enumerate() {
                let (slope, across) = (axis.perp_dot(way), axis.perp_dot(from));
                let share = -across / slope;
                let distance = axis.dot(from) + share * axis.dot(way);
                let slant = 1.0 - slope * slope / length_sq;
                let is_on = (0.0..=1.0).contains(&share);
                for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                    let sight = &mut sight[side];
                    let ahead = sign * distance;
                    let is_nearer = is_on & (ahead >= 0.0) & (ahead < sight.distance[i]);
                    sight.distance[i] = if is_nearer { ahead } else { sight.distance[i] };
                    sight.slant[i] = if is_nearer { slant } else { sight.slant[i] };
                }
            }
        });
        sight
    }

    /// How a crack would divide the domain around a place; none where it could not end at others.
    fn across(&self, pos: Vec2, impact: u32, draws: u32, clearance: f32) -> Option<Across> {
        let across = self.across_from(pos, impact, draws, clearance)?;
        if self.params.steady <= 0.0 {
            return Some(across);
        }
        // From its middle the domain is seen better.
        let again = self.across_from(across.middle, impact, draws, clearance);
        Some(again.map_or(across, |again| Across { middle: across.middle, ..again }))
    }

    /// The same as far as can be seen from that place.
    fn across_from(&self, pos: Vec2, impact: u32, draws: u32, clearance: f32) -> Option<Across> {
        let draw = |what: u64| hash_unit(self.seed ^ what, u64::from(draws));
        let turn = PI * draw(0xA1);
        let axes: [Vec2; AXES] = std::array::from_fn(|i| ops::unit(turn + PI * i as f32 / AXES as f32));
        let far = FAR * clearance;
        let sight = self.look_around(pos, &axes, far);
        let (extent, hit) = (self.network.extent(), self.impacts.get(impact as usize).map_or(pos, |impact| impact.pos));
        let begun = self.division.as_ref().and_then(|division| division.begun.get(impact as usize));
        let reach = begun.map_or(f32::INFINITY, |begun| begun.1);
        let mut is_closed = [true; AXES];
        let mut seen = [[(0.0, 0.0); 2]; AXES];
        for (i, seen) in seen.iter_mut().enumerate() {
            for (side, way) in [axes[i], -axes[i]].into_iter().enumerate() {
                let (border, slant) = to_border(pos, way, extent);
                let crack = sight[side].distance[i];
                seen[side] = if border < crack { (border, slant) } else { (crack, sight[side].slant[i]) };
                let distance = seen[side].0;
                if distance > far {
                    let there = pos + way * distance.min(BEYOND * far) - hit;
                    let leaves = there.length() > rim_towards(there, reach, self.seed ^ u64::from(impact));
                    is_closed[i] &= !leaves;
                    seen[side] = (if leaves { OPEN * far } else { far }, 0.5);
                }
            }
        }
        let (out, near_hit) = ((pos - hit).normalize_or_zero(), self.params.near_hit(pos.distance(hit)));
        let sum = |i: usize| seen[i % AXES][0].0 + seen[i % AXES][1].0;
        let around = |i: usize| 0.5 * sum(i) + 0.25 * (sum(i + 1) + sum(i + AXES - 1));
        let score = |i: usize| {
            let slant = 1.0 + (SLANT + STEEP * self.params.steady) * (seen[i][0].1 + seen[i][1].1);
            around(i) * slant * (1.0 + 1.2 * near_hit * (1.0 - axes[i].dot(out).abs()))
        };
        let may_leave = self.division.as_ref().is_none_or(|division| division.generation == 0);
        let best = (0..AXES).filter(|&i| may_leave || is_closed[i]).min_by(|&a, &b| score(a).total_cmp(&score(b)))?;
        // In the middle of its length.
        let long = (best + AXES / 2) % AXES;
        let middle = pos + axes[long] * (0.4 * (seen[long][0].0 - seen[long][1].0));
        let is_out =
            |there: Vec2| (there - hit).length() > rim_towards(there - hit, reach, self.seed ^ u64::from(impact));
        let middle = if is_out(middle) { pos } else { middle };
        let stray = 2.0 * self.params.wander * (1.0 - 0.7 * self.params.steady) * (2.0 * draw(0xA2) - 1.0);
        let way = (axes[best] + axes[best].perp() * stray).normalize_or(Vec2::X);
        let length = around(long);
        Some(Across { way, middle: middle.clamp(Vec2::ZERO, extent), length, longer: length / around(best).max(1e-6) })
    }

    /// Remembers that a crack grows on from a node, if it may.
    fn keep_tip(&mut self, tip: Tip) {
        if (tip.node as usize) < self.network.nodes.len()
            && !self.arrest.as_ref().is_some_and(|arrest| arrest.is_sealed(tip.node))
            && let Some(division) = &mut self.division
        {
            division.tips.push(tip);
        }
    }

    /// Grows a tip by a segment: after its markers, straight on where it has none.
    fn advance_tip(&mut self, tip: Tip) {
        let Tip { node, course, straight, runs_out } = tip;
        if self.is_over(node) {
            return;
        }
        let this = self.network.nodes[node as usize];
        let Some(before) = self.network.nodes.get(this.parent as usize) else { return };
        let last = (this.pos - before.pos).normalize_or_zero();
        let heading = (last + (course - last) * self.params.steady).normalize_or(last);
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

    /// How much a crack strays at a node, -1..=1: where there are grains, from one to the next.
    fn stray(&self, before: Vec2, pos: Vec2, child: u32) -> f32 {
        let stray = 2.0 * hash_unit(self.seed ^ 0x57A6, u64::from(child)) - 1.0;
        if self.params.grain <= 0.0 {
            return stray;
        }
        let cell = |pos: Vec2| (pos / self.params.grain).as_uvec2();
        if cell(before) == cell(pos) { WITHIN_GRAIN * stray } else { 2.0 * stray }
    }

    /// Where the markers of a tip that lie ahead draw it: eq. 2.
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

    /// Whether one of those markers is served by a segment from `pos` to `to`.
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

    /// Nothing has met the tips that wait: but for those that stay open they run on.
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

    /// Joins the tips that something was in the way of to what is near, if it lies well.
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
                if distance_sq > 0.0 && !self.is_kin(tip, node) {
                    near.push((distance_sq, node));
                }
            });
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            near.into_iter().any(|(_, node)| self.join(node, tip, LinkKind::Junction));
        }
    }

    /// Sends a tip to what it may close a cell with, aside or ahead.
    fn closes(&mut self, tip: u32) -> bool {
        let Node { pos, parent, .. } = self.network.nodes[tip as usize];
        let heading = self.network.nodes.get(parent as usize).map_or(Vec2::ZERO, |before| pos - before.pos);
        let aside = ASIDE + STEADY_ASIDE * self.params.steady;
        !self.stays_open(tip) && self.run_on(tip, heading.normalize_or_zero(), CLOSE * self.params.kill_distance, aside)
    }

    /// Whether a node has left what its hit has loaded.
    pub(super) fn has_left(&self, node: u32) -> bool {
        let Node { pos, impact, .. } = self.network.nodes[node as usize];
        let rim = self.division.as_ref().and_then(|division| division.begun.get(impact as usize));
        match (rim, self.impacts.get(impact as usize)) {
            (Some((_, reach)), Some(hit)) => {
                let way = pos - hit.pos;
                way.length() > rim_towards(way, *reach, self.seed ^ u64::from(impact))
            }
            _ => false,
        }
    }

    /// Lets a tip wait for a crack that meets it.
    fn rest(&mut self, tip: Tip) {
        if let Some(division) = &mut self.division {
            division.resting.push(tip);
        }
    }

    /// Of the tips that wait, the nearest within reach and ahead of a node.
    pub(super) fn resting_ahead(&self, from: u32, heading: Vec2, reach: f32, ahead: f32) -> Option<(f32, u32)> {
        let (nodes, division) = (&self.network.nodes, self.division.as_ref()?);
        let pos = nodes[from as usize].pos;
        let near = division.resting.iter().filter_map(|tip| {
            let way = nodes[tip.node as usize].pos - pos;
            let distance = way.length();
            let is_near = distance <= INVITES * reach && distance > 0.0 && way.dot(heading) >= ahead * distance;
            let is_aside = self.params.steady > 0.0 && self.heading_of(tip.node).dot(heading) > ALONG;
            (is_near && !is_aside && !self.is_kin(from, tip.node)).then_some((distance, tip.node))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    }

    /// Whether a tip waits for a crack that meets it.
    pub(super) fn is_resting(&self, node: u32) -> bool {
        self.division.as_ref().is_some_and(|division| division.resting.iter().any(|tip| tip.node == node))
    }

    /// What waits no longer: it has been met.
    pub(super) fn is_met(&mut self, node: u32) {
        if let Some(division) = &mut self.division {
            division.resting.retain(|tip| tip.node != node);
        }
    }

    /// Whether the crack of a tip is so much wider than that of a node that it narrows where it meets it, if it is steady.
    pub(super) fn is_much_wider(&self, tip: u32, node: u32) -> bool {
        let width = |node: u32| {
            let Node { pos, impact, .. } = self.network.nodes[node as usize];
            let energy = self.impacts.get(impact as usize).map_or(1.0, |impact| impact.widening);
            self.division.as_ref().map_or(1.0, |division| division.share(node)) * self.thinned(pos, impact) * energy
        };
        self.params.steady > 0.0 && width(tip) > MUCH_WIDER * width(node)
    }

    /// Whether another crack meets that of a node there, if that makes a difference.
    pub(super) fn is_met_already(&self, node: u32) -> bool {
        self.params.steady > 0.0 && self.division.as_ref().is_some_and(|division| division.kind(node).is_met)
    }

    /// The free end of the crack of a node, a segment or two further on, which a steady tip meets in its place: no cell lies between the two ends.
    pub(super) fn end_beside(&self, node: u32, tip: u32) -> Option<u32> {
        if self.params.steady <= 0.0 || !self.divides() {
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
            && !self.is_kin(end, tip);
        let near = 2.0 * self.params.step_length;
        (is_free && pos.distance_squared(self.network.nodes[tip as usize].pos) <= near * near).then_some(end)
    }

    /// Whether a steady crack ends at a node.
    pub(super) fn is_over(&self, node: u32) -> bool {
        self.params.steady > 0.0 && self.division.as_ref().is_some_and(|division| division.kind(node).is_over)
    }

    /// Whether two ends come towards each other.
    fn are_head_on(&self, one: u32, other: u32) -> bool {
        self.heading_of(one).dot(self.heading_of(other)) < HEAD_ON
    }

    /// Notes that a tip has met another crack at a node.
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

    /// How many times as wide as others a crack of an impact is at a place: less towards the rim.
    pub(super) fn thinned(&self, pos: Vec2, impact: u32) -> f32 {
        if self.params.thinning <= 0.0 {
            return 1.0;
        }
        let begun = self.division.as_ref().and_then(|division| division.begun.get(impact as usize));
        let (Some((_, reach)), Some(hit)) = (begun, self.impacts.get(impact as usize)) else { return 1.0 };
        let way = pos - hit.pos;
        let rim = rim_towards(way, *reach, self.seed ^ u64::from(impact));
        1.0 - self.params.thinning * towards_rim(way.length(), rim)
    }

    /// Shows the markers what has been born.
    fn show_markers(&mut self) {
        let last = self.network.nodes.len() as u32;
        let Some(division) = &mut self.division else { return };
        for node in std::mem::replace(&mut division.seen, last)..last {
            self.field.visit(node, &self.network.nodes, &self.nodes);
        }
    }
}

/// 0 as far from a hit as all is loaded alike, 1 a little beyond the rim.
fn towards_rim(from_hit: f32, rim: f32) -> f32 {
    let share = ((from_hit / rim.max(1e-6) - THINS) / (1.1 - THINS)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// How far a hit loads the surface in a direction, at most `reach`: no two alike, and none round.
pub(super) fn rim_towards(way: Vec2, reach: f32, seed: u64) -> f32 {
    let way = way.normalize_or(Vec2::X);
    // Cosines of multiples of the angle, each turned by a draw.
    let (mut power, mut sum) = (way, 0.0);
    for wave in 2..=5u64 {
        power = power.rotate(way);
        sum += power.dot(ops::unit(2.0 * PI * hash_unit(seed ^ 0xA3, wave)));
    }
    reach * (1.0 - UNEVEN * (0.5 + 0.25 * sum).clamp(0.0, 1.0))
}

/// How far the border is from `pos` in a direction, and how far from a right angle it would be met.
fn to_border(pos: Vec2, way: Vec2, extent: Vec2) -> (f32, f32) {
    let along = |pos: f32, way: f32, extent: f32| match () {
        () if way > 0.0 => (extent - pos) / way,
        () if way < 0.0 => -pos / way,
        () => f32::INFINITY,
    };
    let (x, y) = (along(pos.x, way.x, extent.x), along(pos.y, way.y, extent.y));
    if x < y { (x, way.y * way.y) } else { (y, way.x * way.x) }
}
