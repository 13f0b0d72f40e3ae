//! One step of the growth.

use super::{
    arrest::{Advance, Arrest},
    divide::Candidate,
    draws,
    params::StartLayout,
    pull::{NO_PULL, Part, Pull, Stage},
    state::CrackGrowth,
};
use crate::{math::mix, pattern::NO_PARENT};
use core::ops::Range;
use glam::Vec2;

/// Markers of a part of a step that count as one node.
const MARKERS: usize = 8;

/// The result of one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepReport {
    /// Number of nodes that were added.
    pub born: u32,
    /// Whether more strands are to be laid out, because all of a hit have been blocked.
    lays_out_more: bool,
}

impl StepReport {
    /// Whether anything grew, or may grow in the next step; if not, the growth has ended until the next hit.
    #[must_use]
    pub const fn grew(&self) -> bool {
        self.born > 0 || self.lays_out_more
    }
}

impl CrackGrowth {
    /// One step of growth (Couto et al., eq. 2): every node that attracts markers grows one node at `c' = c + D n̂`,
    /// `n = Σ (m - c) / ‖m - c‖`. Then markers within the kill distance of a node are removed.
    ///
    /// Differs from the paper where the paper would never end: a node at `c + D n̂` that neither reaches a marker nor
    /// brings one closer (by `D²/4` of squared distance) is not added. Instead the new node lies straight towards the
    /// closest marker, on it if that is nearer than `D`. So every new node serves a marker, and growth ends within
    /// [`GrowthParams::most_nodes`](super::GrowthParams::most_nodes). A node beyond the border, or closer to it than
    /// the kill distance in its direction, is placed on it.
    ///
    /// Completes a step that was [begun](Self::continue_step) and makes no other.
    pub fn step(&mut self) -> StepReport {
        loop {
            if let Some(report) = self.continue_step(u32::MAX) {
                return report;
            }
        }
    }

    /// Makes a part of a [`step`](Self::step), with up to about `nodes` nodes or 8 times as many markers, so that the step of a surface with
    /// many cracks can be spread over several frames. Returns the report once all of the step is made. 0 counts as 1.
    ///
    /// The cracks do not depend on the parts. In between, none or some of the nodes of the step are in the network, their widths are not final,
    /// and [`steps`](Self::steps) and the end of the timeline may not count it yet; [`steps_made`](Self::steps_made) does. All other methods
    /// that change the growth complete the step first.
    ///
    /// Steps of cracks that divide domains, and of strands, are made in one part.
    ///
    /// ```
    /// use bevy_crack::growth::{CrackGrowth, GrowthParams};
    ///
    /// let mut growth = CrackGrowth::new(GrowthParams::DEFAULT, [1.0, 1.0].into(), 7)?;
    /// (0..9).for_each(|i| _ = growth.hit([0.1 * i as f32 + 0.1, 0.5].into(), 1.0));
    /// let mut parts = 1;
    /// while growth.continue_step(4).is_none() {
    ///     parts += 1;
    /// }
    /// assert!(parts > 3);
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    pub fn continue_step(&mut self, nodes: u32) -> Option<StepReport> {
        if self.part.is_none() {
            self.finish();
            self.new_nodes = 0..0;
            if self.is_growing() {
                self.record.step();
            }
        }
        let mut left = nodes.max(1);
        // A tip that has just turned to meet a crack may be all that moves, and it has no new node yet.
        let mut found = Vec::new();
        while self.part.is_some() || (self.steps_left > 0 && self.new_nodes.is_empty() && self.orders.is_empty()) {
            if !self.make_step(&mut found, &mut left) {
                return None;
            }
        }
        if self.steps_left == 0 && self.arrest.is_some() {
            self.show_hits();
        }
        Some(StepReport { born: self.new_nodes.len() as u32, lays_out_more: !self.orders.is_empty() })
    }

    /// Whether a step was [begun](Self::continue_step) and is not complete.
    #[must_use]
    pub const fn is_in_step(&self) -> bool {
        self.part.is_some()
    }

    /// Completes a step that was begun.
    pub(crate) fn finish_step(&mut self) {
        if self.is_in_step() {
            self.step();
        }
    }

    /// Makes a step, or the rest of one, with up to `left` nodes. Returns whether it is complete.
    fn make_step(&mut self, found: &mut Vec<Candidate>, left: &mut u32) -> bool {
        let mut part = match self.part.take() {
            Some(part) => part,
            None => {
                self.steps_left -= 1;
                self.field.settle(&self.network.nodes, &self.nodes);
                if self.divides() {
                    self.divide(found);
                    return true;
                }
                if self.params.strands().is_some() {
                    self.advance_strands();
                    return true;
                }
                self.begin_step()
            }
        };
        loop {
            if !self.make_some(&mut part, left) {
                self.part = Some(part);
                return false;
            }
            let Some(next) = self.end_stage(&part) else { break };
            (part.stage, part.at) = next;
        }
        self.new_nodes = part.first..self.network.nodes.len() as u32;
        self.join_newborn();
        if self.new_nodes.is_empty() && !part.any_stopped && !self.is_running() {
            self.steps_left = 0;
        }
        if self.steps_left == 0 {
            self.widen_with(|widths, nodes, widened| widths.settle(nodes, widened));
        }
        true
    }

    /// Makes some of a stage of a step, with up to `left` nodes. Returns whether it is complete.
    fn make_some(&mut self, part: &mut Part, left: &mut u32) -> bool {
        let (last, each) = match part.stage {
            Stage::Gathering | Stage::Serving => (self.field.pulls(), MARKERS),
            Stage::Aiming | Stage::Growing => (self.order.len(), 1),
            Stage::Visiting => (self.network.nodes.len(), 1),
        };
        let end = last.min(part.at.saturating_add((*left as usize).saturating_mul(each)));
        let some = part.at..end;
        *left -= some.len().div_ceil(each) as u32;
        part.at = end;
        match part.stage {
            Stage::Gathering => self.gather_pulls(some),
            Stage::Aiming => self.aim(some),
            Stage::Serving => self.serve(some),
            Stage::Growing => self.grow_some(part, some),
            Stage::Visiting => some.for_each(|node| self.field.visit(node as u32, &self.network.nodes, &self.nodes)),
        }
        end == last
    }

    /// Ends a stage that is complete; returns the next one, and where it begins.
    fn end_stage(&mut self, part: &Part) -> Option<(Stage, usize)> {
        Some(match part.stage {
            Stage::Gathering => {
                self.order_pulls();
                (Stage::Aiming, 0)
            }
            Stage::Aiming => (Stage::Serving, 0),
            Stage::Serving => {
                self.end_aiming();
                self.count_step();
                (Stage::Growing, 0)
            }
            Stage::Growing => {
                self.end_growing(part);
                (Stage::Visiting, part.first as usize)
            }
            Stage::Visiting => return None,
        })
    }

    fn begin_step(&mut self) -> Part {
        self.begin_pulls();
        let first = self.network.nodes.len() as u32;
        Part { stage: Stage::Gathering, at: 0, first, room: self.room(), any_stopped: false }
    }

    /// Counts the step, before its first node.
    fn count_step(&mut self) {
        // Nodes that are added when growth has ended get their own step of the timeline.
        self.timeline.begin(self.steps.saturating_add(1));
        if !self.pulls.is_empty() || self.is_running() {
            self.steps = self.steps.saturating_add(1);
        }
    }

    /// Grows from some of the nodes that are pulled.
    fn grow_some(&mut self, part: &mut Part, some: Range<usize>) {
        for i in some {
            let (node, slot) = self.order[i];
            let stopped = if self.arrest.is_some() {
                self.grow_apart(node, slot)
            } else {
                self.grow_freely(node, slot, i < part.room)
            };
            self.pulls[slot as usize].stopped = stopped;
            part.any_stopped |= stopped.is_some();
        }
    }

    /// After all nodes have grown: markers that were given up, and what grows without markers.
    fn end_growing(&mut self, part: &Part) {
        self.end_pulls(part.any_stopped);
        if self.arrest.is_some() {
            self.advance_runners();
        } else {
            self.widen_with(|widths, nodes, widened| widths.push(nodes, part.first, widened));
        }
        self.pulls.clear();
        if self.params.nucleation > 0.0 {
            self.nucleate();
        }
        self.advance_rays(part.first);
    }

    /// Whether a tip is moving to a goal.
    fn is_running(&self) -> bool {
        self.rays.is_running() || self.arrest.as_ref().is_some_and(Arrest::is_running)
    }

    /// Grows from a node, whatever cracks are in the way. Returns the direction in which it gives up markers: the others may pull in another direction
    /// then.
    fn grow_freely(&mut self, node: u32, slot: u32, has_room: bool) -> Option<Vec2> {
        let Pull { serves, child, .. } = self.pulls[slot as usize];
        if !serves {
            return Some(self.to_closest(node, slot));
        }
        if has_room {
            let parent = self.network.nodes[node as usize];
            self.add_thin_node(child, node, parent.generation.saturating_add(1), parent.impact, 1.0);
        }
        None
    }

    /// Grows from a node unless older cracks are in the way; returns the same.
    fn grow_apart(&mut self, node: u32, slot: u32) -> Option<Vec2> {
        if self.arrest.as_ref().is_some_and(|arrest| arrest.is_sealed(node)) {
            return Some(Vec2::ZERO);
        }
        let Pull { child, course, side, serves, .. } = self.pulls[slot as usize];
        if !serves {
            return Some(self.to_closest(node, slot));
        }
        let born = self.network.nodes.len();
        let advanced = self.advance(node, child);
        if (self.params.grain > 0.0 || self.params.zigzag > 0.0 || self.masonry.is_some())
            && self.network.nodes.get(born).is_some_and(|born| born.pos == child)
        {
            self.courses[born] = course;
        }
        if let Advance::Stopped(direction) = advanced {
            return Some(direction);
        }
        if let Some(side) = side {
            let from = self.network.nodes[node as usize].pos;
            let branch = self.extend(node, side, false);
            // Its course combines the branch and the previous course, so that it goes around the bricks.
            if let Some(branch) = branch.filter(|_| self.masonry.is_some()) {
                let way = (side - from).normalize_or_zero();
                self.courses[branch as usize] = (way + course).normalize_or(way);
            }
        }
        None
    }

    /// The direction from a node to the closest marker that pulls it.
    fn to_closest(&self, node: u32, slot: u32) -> Vec2 {
        let closest = self.field.marker(self.pulls[slot as usize].closest).pos;
        (closest - self.network.nodes[node as usize].pos).normalize_or_zero()
    }

    /// Gives up the markers of nodes that have stopped, and ends all pulls.
    fn end_pulls(&mut self, any_stopped: bool) {
        if any_stopped {
            let Self { field, network, pulls, pull_of, .. } = self;
            let mut given_up = Vec::new();
            field.each_pull(0..field.pulls(), &network.nodes, |index, node, _| {
                let pull = &pulls[pull_of[node as usize] as usize];
                if let Some(direction) = pull.stopped {
                    let way = field.marker(index).pos - network.nodes[node as usize].pos;
                    if index == pull.closest || way.dot(direction) >= 0.0 {
                        given_up.push((index, node));
                    }
                }
            });
            for (index, node) in given_up {
                field.give_up(index, node);
            }
            field.sweep();
        }
        for &(node, _) in &self.order {
            self.pull_of[node as usize] = NO_PULL;
        }
    }

    /// Starts new cracks where markers are out of reach of all others.
    fn nucleate(&mut self) {
        let due = self.params.nucleation * self.steps.saturating_add(1) as f32;
        // After an impact new cracks start ahead of the existing ones; in drying material they start anywhere.
        let center = self.impacts.last().map_or(Vec2::ZERO, |impact| impact.pos);
        let is_impact = matches!(self.params.starts, StartLayout::Crushed { .. });
        for _ in 0..self.room() {
            if self.nucleated as f32 >= due {
                break;
            }
            let of_try = self.seed ^ draws::NUCLEATION ^ u64::from(self.tried) << 8;
            let drawn = [0, 1, 2, 3, 4, 5].map(|i| mix(of_try ^ i << 48));
            let drawn = if is_impact { &drawn[..] } else { &drawn[..1] };
            let Some((place, owner)) = self.field.take_waiting(drawn, center) else { break };
            self.tried = self.tried.wrapping_add(1);
            let latest = self.impacts.len().saturating_sub(1) as u32;
            // Markers of rays belong to these.
            let owner = self.rays.impact_of(owner).unwrap_or(owner);
            let impact = if (owner as usize) < self.impacts.len() { owner } else { latest };
            // Markers of rays may lie off the surface.
            let extent = self.network.extent();
            let is_within = place.cmpge(Vec2::ZERO).all() && place.cmple(extent).all();
            let is_free = is_within
                && !self.nodes.any_within(place, 2.0 * self.params.step_length)
                && !self.mask.is_forbidden(place / extent);
            if is_free {
                self.nucleated = self.nucleated.saturating_add(1);
                // A step in which nothing else grows counts as well.
                self.steps = self.steps.max(self.timeline.now());
                self.add_node(place, NO_PARENT, 0, impact, 1.0);
            }
        }
    }
}
