//! Growth that avoids crossings: a tip near an older crack turns to meet it at a steep angle and stops there.

use super::{
    arrest::{AHEAD, Advance, Arrest, Goal, Runner, steps_for},
    division::{Division, MUCH_WIDER},
    params::StartLayout,
    state::CrackGrowth,
    steer::turned_at_most,
    walls::crosses_itself,
};
use crate::pattern::{Link, LinkKind, NO_PARENT, Node, PathPoint, SegmentId, SegmentPath};
use glam::Vec2;

/// Shares of the roughness that are tried for a line, until it touches no other.
const BENDS: [f32; 3] = [1.0, 0.4, 0.0];

/// Cosine and sine of the largest turn of a dividing crack from its direction to meet another crack: 50 degrees. It
/// does not hook.
const STEADY: (f32, f32) = (0.642_787_6, 0.766_044_4);

/// A crack this many segment lengths away is met by the next segment.
const LAST: f32 = 1.35;

/// How much more a dividing crack avoids turns than slanted meetings, per one minus the cosine.
const HOOK: f32 = 4.0;

/// How much a straight crack avoids a place where a third crack meets another, segment lengths.
const TAKEN: f32 = 2.0;

/// Cosine of the angle to the direction from its hit beyond which an arm does not turn to meet a crack: 75 degrees.
const TURNS_BACK: f32 = 0.26;

/// Segment lengths that a tip needs to turn.
const TURN: f32 = 2.5;

/// The node of the crack that is met is at most this many segment lengths away.
const LAST_REACH: f32 = 1.5;

/// A ray that would meet a crack within this many segment lengths ends at it at once.
const SOON: f32 = 1.6;

/// A node this many segment lengths from another crack beside it would run along it.
const BESIDE: f32 = 0.7;

impl CrackGrowth {
    /// Grows a segment from a node towards `to`, as far as older cracks allow.
    pub(super) fn advance(&mut self, from: u32, to: Vec2) -> Advance {
        let pos = self.network.nodes[from as usize].pos;
        let heading = (to - pos).normalize_or_zero();
        let length = self.params.step_length;
        if !self.params.keeps_apart() {
            return match self.extend(from, to, false) {
                Some(_) => Advance::Grown,
                None => Advance::Stopped(heading),
            };
        }
        let reach = self.params.arrest.max(TURN * length);
        if self.has_rays() && self.params.arrest > 0.0 && self.ends_soon(from, heading) {
            self.seal(from);
            return Advance::Stopped(heading);
        }
        // A ray does not turn: it runs straight until it touches what is in its way.
        let goal =
            if self.are_rays() || self.masonry.is_some() { None } else { self.goal_ahead(from, heading, reach, AHEAD) };
        // A crack that has turned already does not turn further.
        let last = self.heading_of(from);
        let is_ahead = |goal: Goal| {
            let way = self.place_of(goal) - pos;
            let is_along = |kept: Vec2, least: f32| kept == Vec2::ZERO || way.dot(kept) >= least * way.length();
            is_along(last, AHEAD) && is_along(self.away_from_hit(from), TURNS_BACK)
        };
        match goal.filter(|&(_, goal)| is_ahead(goal)) {
            None => {}
            Some((_, Goal::Node(_))) if self.stays_open(from) => {
                self.seal(from);
                return Advance::Stopped(heading);
            }
            Some((distance, goal)) if distance <= LAST * length => {
                self.meet(from, goal);
                return Advance::Stopped(heading);
            }
            Some((_, goal)) => {
                let course = if last == Vec2::ZERO { heading } else { last };
                let way = self.kept_to(course, turned_at_most(last, self.turned(pos, heading, goal)));
                let to = pos + way * length;
                let Some(tip) = self.extend(from, to, true) else { return Advance::Stopped(heading) };
                self.run(Runner { tip, goal, steps_left: steps_for(reach, length), course });
                return Advance::Grown;
            }
        }
        let Some(node) = self.extend(from, to, false) else { return Advance::Stopped(heading) };
        // It may be close beside a crack that was not ahead of it.
        if !self.are_rays()
            && self.masonry.is_none()
            && let Some((_, beside)) = self.foreign(node, None, BESIDE * length, AHEAD)
        {
            let way = self.network.nodes[beside as usize].pos - self.network.nodes[node as usize].pos;
            self.join_near(node, way, LAST_REACH);
            self.seal(node);
        }
        Advance::Grown
    }

    /// The direction from its hit to a node of an arm; zero for other cracks.
    fn away_from_hit(&self, node: u32) -> Vec2 {
        let are_arms = self.breaks_through() && matches!(self.params.starts, StartLayout::Arms { .. });
        let Node { pos, impact, .. } = self.network.nodes[node as usize];
        let hit = self.impacts.get(impact as usize).filter(|_| are_arms);
        hit.map_or(Vec2::ZERO, |hit| (pos - hit.pos).normalize_or_zero())
    }

    /// Joins the tip of a ray to a crack that it would meet within the next two segments; returns whether there is
    /// one.
    pub(super) fn ends_soon(&mut self, from: u32, heading: Vec2) -> bool {
        let pos = self.network.nodes[from as usize].pos;
        let far = (pos + heading * (SOON * self.params.step_length)).clamp(Vec2::ZERO, self.network.extent());
        let ahead = SegmentPath::straight(PathPoint { pos, width: 0.0 }, PathPoint { pos: far, width: 0.0 });
        let is_in_the_way = |arrest: &Arrest| arrest.walls.touches_any((from, u32::MAX), &ahead);
        far.distance(pos) > 1e-4
            && self.arrest.as_ref().is_some_and(is_in_the_way)
            && self.join_near(from, heading, SOON + 0.5)
    }

    /// Sends a resting tip to the nearest crack ahead of it within `distance`; returns whether there is one.
    pub(super) fn run_on(&mut self, tip: u32, heading: Vec2, distance: f32, ahead: f32) -> bool {
        if self.is_sealed(tip) {
            return false;
        }
        let goal = self.goal_ahead(tip, heading, distance, ahead);
        if let Some((_, goal)) = goal {
            self.seal(tip);
            let steps_left = steps_for(distance, self.params.step_length);
            self.run(Runner { tip, goal, steps_left, course: heading });
        }
        goal.is_some()
    }

    fn run(&mut self, runner: Runner) {
        if let Some(arrest) = &mut self.arrest {
            arrest.runners.push(runner);
        }
    }

    fn is_sealed(&self, node: u32) -> bool {
        self.arrest.as_ref().is_some_and(|arrest| arrest.is_sealed(node))
    }

    /// One step of every moving tip.
    pub(super) fn advance_runners(&mut self) {
        let Some(arrest) = &mut self.arrest else { return };
        let runners = std::mem::take(&mut arrest.runners);
        for runner in runners {
            if self.room() == 0 {
                return;
            }
            if let Some(on) = self.advance_runner(runner) {
                self.run(on);
            }
        }
    }

    fn advance_runner(&mut self, mut runner: Runner) -> Option<Runner> {
        if self.is_over(runner.tip) {
            return None;
        }
        let node = self.network.nodes[runner.tip as usize];
        let heading = self.heading_of(runner.tip);
        let length = self.params.step_length;
        let mut distance = self.place_of(runner.goal).distance(node.pos);
        // A crack that is nearer now is met first.
        if let Some((nearer, goal)) = self.goal_ahead(runner.tip, heading, distance, AHEAD) {
            (distance, runner.goal) = (nearer, goal);
        }
        if distance <= LAST * length {
            self.meet(runner.tip, runner.goal);
            return None;
        }
        runner.steps_left = runner.steps_left.checked_sub(1)?;
        let way = turned_at_most(heading, self.turned(node.pos, heading, runner.goal));
        let to = node.pos + self.kept_to(runner.course, way) * length;
        runner.tip = self.extend(runner.tip, to, true)?;
        Some(runner)
    }

    fn place_of(&self, goal: Goal) -> Vec2 {
        match goal {
            Goal::Node(node) => self.network.nodes[node as usize].pos,
            Goal::Border(place) => place,
        }
    }

    /// The direction from `pos` that turns from `heading` towards the goal.
    fn turned(&self, pos: Vec2, heading: Vec2, goal: Goal) -> Vec2 {
        let way = self.place_of(goal) - pos;
        // A dividing crack keeps its direction until it is near.
        let keep = if self.divides() { (0.4 * way.length() / self.params.step_length).clamp(0.5, 2.0) } else { 0.5 };
        let way = way.normalize_or_zero();
        (keep * heading + way).normalize_or(way)
    }

    /// `way`, limited to the turn that a dividing crack may make from its course: it does not hook.
    fn kept_to(&self, course: Vec2, way: Vec2) -> Vec2 {
        if !self.divides() || course == Vec2::ZERO || course.dot(way) >= STEADY.0 {
            return way;
        }
        let across = if course.perp_dot(way) < 0.0 { -course.perp() } else { course.perp() };
        course * STEADY.0 + across * STEADY.1
    }

    /// The last segment: onto the crack or the border.
    fn meet(&mut self, tip: u32, goal: Goal) {
        match goal {
            Goal::Node(node) => {
                if self.is_resting(node) && self.join(node, tip, LinkKind::Junction) {
                    return;
                }
                let way = self.place_of(goal) - self.network.nodes[tip as usize].pos;
                self.join_near(tip, way, LAST_REACH);
            }
            Goal::Border(place) => {
                self.extend(tip, place, true);
            }
        }
    }

    /// Links a tip to the best node of another crack: near, and so that the two meet at a steep angle. Returns
    /// whether there was one.
    pub(super) fn join_near(&mut self, tip: u32, heading: Vec2, reach: f32) -> bool {
        let (length, has_rays) = (self.params.step_length, self.has_rays());
        let mut nearby = Vec::new();
        // In masonry only nodes along the joint; a ray hardly turns.
        let least = match has_rays {
            true => 0.5,
            false if self.masonry.is_some() => 0.97,
            false => 0.0,
        };
        let least = least * heading.length();
        let course = if self.divides() { self.heading_of(tip) } else { Vec2::ZERO };
        self.each_foreign(tip, reach * length, |node, distance_sq, way| {
            if way.dot(heading) > least * distance_sq.sqrt() {
                let end = self.network.nodes[node as usize];
                let place = |node: u32| self.network.nodes.get(node as usize).map_or(end.pos, |node| node.pos);
                let along = (place(self.child_of(node)) - place(end.parent)).normalize_or_zero();
                let distance = distance_sq.sqrt();
                // A ray runs straight up to the crack that it meets; other cracks turn to meet it at a steep angle.
                let slant = if has_rays {
                    1.0 - way.dot(heading) / (distance * heading.length())
                } else {
                    along.dot(way / distance).abs()
                };
                let turn = if course == Vec2::ZERO { 0.0 } else { 1.0 - way.dot(course) / distance };
                let taken = if self.is_met_already(node) { TAKEN } else { 0.0 };
                nearby.push((distance / length + 3.0 * slant + HOOK * turn + taken, node));
            }
        });
        nearby.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearby.into_iter().take(5).any(|(_, node)| {
            self.end_beside(node, tip).is_some_and(|end| self.join(end, tip, LinkKind::Junction))
                || self.join(node, tip, LinkKind::Junction)
        })
    }

    /// Adds a node at `to` if its line touches no other; else joins the crack that is in the way.
    pub(super) fn extend(&mut self, from: u32, to: Vec2, is_sealed: bool) -> Option<u32> {
        self.extend_of(self.network.nodes[from as usize].impact, from, to, is_sealed)
    }

    /// The same for a node of `impact`, which may differ from the impact of the node from which it grows.
    pub(super) fn extend_of(&mut self, impact: u32, from: u32, to: Vec2, is_sealed: bool) -> Option<u32> {
        let node = self.network.nodes[from as usize];
        let child = self.network.nodes.len() as u32;
        if self.room() == 0 {
            return None;
        }
        let extent = self.network.extent();
        let to = to.clamp(Vec2::ZERO, extent);
        // The border is a crack too: none runs along it.
        let inward = Vec2::splat(0.3 * self.params.step_length).min(0.5 * extent);
        let (low, high) =
            (node.pos.cmpeq(Vec2::ZERO) & to.cmpeq(Vec2::ZERO), node.pos.cmpeq(extent) & to.cmpeq(extent));
        let to = Vec2::select(low, inward, Vec2::select(high, extent - inward, to));
        // Very close to the border counts as on it.
        let to = Vec2::select(to.cmplt(Vec2::splat(1e-5)), Vec2::ZERO, to);
        let to = Vec2::select(to.cmpgt(extent - 1e-5), extent, to);
        match self.free_line(SegmentId::Branch(child), (from, u32::MAX), (node.pos, to)) {
            Ok((bend, path)) => {
                let on_border = (to.cmpeq(Vec2::ZERO) | to.cmpeq(extent)).any();
                self.add_node(to, from, node.generation.saturating_add(1), impact, bend);
                if let Some(arrest) = &mut self.arrest {
                    arrest.walls.add((from, child), &path);
                    arrest.sealed[child as usize] |= is_sealed || on_border;
                }
                if on_border {
                    self.widen_end(child);
                }
                Some(child)
            }
            Err(()) if !self.params.keeps_apart() => None,
            Err(()) => {
                // A ray first comes nearer, so that it need not turn to the node to which it is joined.
                let nearer = 0.5 * (node.pos + to);
                let tip = if self.has_rays() && to.distance(node.pos) > 0.6 * self.params.step_length {
                    self.extend(from, nearer, true)
                } else {
                    None
                };
                if let Some(tip) = tip {
                    self.join_near(tip, to - nearer, LAST_REACH);
                } else if self.network.nodes.len() == child as usize {
                    self.join_near(from, to - node.pos, LAST_REACH);
                }
                None
            }
        }
    }

    /// The roughest line between two places that touches no other; an error if even the straight one does.
    pub(super) fn free_line(
        &self,
        segment: SegmentId,
        ends: (u32, u32),
        (from, to): (Vec2, Vec2),
    ) -> Result<(f32, SegmentPath), ()> {
        for bend in BENDS {
            let path = self.network.draft(segment, (from, to), (0.0, 0.0), bend);
            let touches = self.params.keeps_apart()
                && self.arrest.as_ref().is_some_and(|arrest| arrest.walls.touches_any(ends, &path));
            let extent = self.network.extent();
            let touches = touches || crosses_itself(&path);
            let is_forbidden = |pair: &[PathPoint]| self.mask.blocks(pair[0].pos / extent, pair[1].pos / extent);
            if !touches && !path.points().windows(2).any(is_forbidden) {
                return Ok((bend, path));
            }
        }
        Err(())
    }

    /// Links a tip to a node of another crack, unless a third crack is in the way; returns whether it did.
    pub(super) fn join(&mut self, node: u32, tip: u32, kind: LinkKind) -> bool {
        let link = Link { a: node, b: tip, width: 0.0, birth: self.steps, kind, bend: 1.0 };
        let joined = self.link(link);
        if joined {
            self.is_met(node);
            self.note_meeting(node, tip);
            // A crack that closes a cell at the rim becomes thin.
            if self.divides() && (self.has_left(tip) || self.has_left(node) || self.is_much_wider(tip, node)) {
                self.thin_end(tip);
            } else {
                self.widen_end(tip);
                // If two ends meet, neither is a free end any more.
                let like = if self.params.straightness > 0.0 { MUCH_WIDER } else { 1.0 };
                let is_thinner = |division: &Division| division.share(node) <= like * division.share(tip);
                let is_end = self.network.nodes[node as usize].parent != NO_PARENT && self.child_of(node) == NO_PARENT;
                if is_end && self.division.as_ref().is_some_and(is_thinner) {
                    self.widen_end(node);
                }
            }
            let width = self.network.nodes[tip as usize].width;
            if let Some(link) = self.network.links.last_mut() {
                link.width = width;
            }
            self.go_on_beyond(node, tip);
        }
        joined
    }

    /// Adds a link, unless cracks must not cross and it would cross one; returns whether it did.
    pub(super) fn link(&mut self, mut link: Link) -> bool {
        let index = self.network.links.len() as u32;
        if self.arrest.is_some() {
            if link.a == link.b {
                return false;
            }
            let ends = (link.a, link.b);
            let places = (self.network.nodes[link.a as usize].pos, self.network.nodes[link.b as usize].pos);
            let Ok((bend, path)) = self.free_line(SegmentId::Link(index), ends, places) else { return false };
            link.bend = bend;
            if let Some(arrest) = &mut self.arrest {
                arrest.walls.add(ends, &path);
            }
        }
        self.network.links.push(link);
        true
    }

    /// The nearest crack or border within `reach` and ahead of a node, and its distance.
    fn goal_ahead(&self, from: u32, heading: Vec2, reach: f32, ahead: f32) -> Option<(f32, Goal)> {
        let crack =
            self.foreign(from, Some(heading), reach, ahead).map(|(distance, node)| (distance, Goal::Node(node)));
        if let Some((distance, tip)) = self.resting_ahead(from, heading, reach, ahead) {
            return Some((distance, Goal::Node(tip)));
        }
        let border = self.border_ahead(self.network.nodes[from as usize].pos, heading, reach, ahead);
        match (crack, border) {
            (Some(crack), Some(border)) => Some(if border.0 < crack.0 { border } else { crack }),
            (crack, border) => crack.or(border),
        }
    }

    fn border_ahead(&self, pos: Vec2, heading: Vec2, reach: f32, ahead: f32) -> Option<(f32, Goal)> {
        let extent = self.network.extent();
        let sides = [
            (pos.x, Vec2::NEG_X, Vec2::new(0.0, pos.y)),
            (extent.x - pos.x, Vec2::X, Vec2::new(extent.x, pos.y)),
            (pos.y, Vec2::NEG_Y, Vec2::new(pos.x, 0.0)),
            (extent.y - pos.y, Vec2::Y, Vec2::new(pos.x, extent.y)),
        ];
        sides
            .into_iter()
            .filter(|&(distance, out, _)| distance > 0.0 && distance <= reach && heading.dot(out) >= ahead)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(distance, out, foot)| {
                // Half way between the point straight ahead and the nearest one: a crack does not hook.
                let straight = pos + heading * (distance / heading.dot(out));
                let place = (0.5 * (foot + straight)).clamp(Vec2::ZERO, extent);
                // Exactly on the border, without rounding errors.
                let place = Vec2::select(out.abs().cmpgt(Vec2::splat(0.5)), foot, place);
                (distance, Goal::Border(place))
            })
    }
}
