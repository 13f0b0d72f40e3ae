//! Hits: where cracks start, and what a hit on older cracks does.

use super::{
    field::ANY_IMPACT,
    impact::{HitOutcome, Impact, MAX_ENERGY, Rejected, widening},
    params::StartLayout,
    region::Region,
    starts,
    state::CrackGrowth,
};
use crate::{
    math::mix,
    pattern::{Bricks, Link, LinkKind, NO_BRICKS, NO_PARENT, Node},
};
use glam::Vec2;

/// Half the width of the widest crack that is searched for under a hit, pattern units.
const WIDE: f32 = 0.1;

/// How much larger the reach of a hit becomes, as a share, where it has next to no room.
const MORE_REACH: f32 = 1.6;

impl CrackGrowth {
    /// Hits the surface at `pos` (pattern units) with `energy` (1 = an ordinary hit; 4 reaches twice as far).
    ///
    /// Creates starts and markers; cracks grow in [`step`](Self::step). A hit near an earlier one adds its energy to
    /// that impact, so many hits on one spot cost no more than one hard hit. Near means: closer than `step_length` or
    /// `kill_distance`, whichever is longer, but at most 0.05 pattern units. A hit that cannot be used is reported as
    /// [`HitOutcome::Rejected`].
    pub fn hit(&mut self, pos: Vec2, energy: f32) -> HitOutcome {
        let outcome = self.begin_hit(pos, energy);
        self.finish();
        outcome
    }

    /// Like [`hit`](Self::hit), but leaves the markers to [`continue_hit`](Self::continue_hit), so that a hit with many markers
    /// can be spread over several frames. The resulting cracks are the same.
    ///
    /// ```
    /// use bevy_crack::{CrackPreset, growth::CrackGrowth};
    ///
    /// let fine = CrackPreset::TEMPERED_GLASS.scaled(0.1).growth;
    /// let mut growth = CrackGrowth::new(fine, [1.0, 1.0].into(), 7)?;
    /// growth.begin_hit([0.5, 0.5].into(), 1.0);
    /// let mut slices = 1;
    /// while growth.continue_hit(4096) {
    ///     slices += 1;
    /// }
    /// assert!(slices > 4);
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    pub fn begin_hit(&mut self, pos: Vec2, energy: f32) -> HitOutcome {
        self.finish();
        let outcome = self.apply_hit(pos, energy);
        self.record.hit(pos, energy, &outcome);
        outcome
    }

    fn apply_hit(&mut self, pos: Vec2, energy: f32) -> HitOutcome {
        if !pos.is_finite() || !energy.is_finite() {
            return HitOutcome::Rejected(Rejected::NotFinite);
        }
        if energy < 0.0 {
            return HitOutcome::Rejected(Rejected::NegativeEnergy);
        }
        let extent = self.network.extent();
        if pos.cmplt(Vec2::ZERO).any() || pos.cmpgt(extent).any() {
            return HitOutcome::Rejected(Rejected::OffSurface);
        }
        if energy == 0.0 {
            return HitOutcome::Nothing;
        }
        if self.mask.is_forbidden(pos / extent) {
            return HitOutcome::Rejected(Rejected::Forbidden);
        }
        if self.room() == 0 {
            return HitOutcome::Rejected(Rejected::Full);
        }
        self.timeline.begin(self.steps.saturating_add(1));
        let merge = self.params.step_length.max(self.params.kill_distance).min(0.05);
        let nearest = (0u32..)
            .zip(&self.impacts)
            .map(|(i, impact)| (impact.pos.distance_squared(pos), i))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((distance_sq, index)) = nearest
            && distance_sq <= merge * merge
        {
            let impact = &mut self.impacts[index as usize];
            let before = impact.energy;
            impact.energy = (before + energy).min(MAX_ENERGY);
            let (center, after) = (impact.pos, impact.energy);
            if after > before {
                let crushes = self.crushes(center);
                self.timeline.strike(index, crushes, before, after);
                self.widen(index);
                self.lay_out_strands(index, before, after);
                let reach = self.reach(center, after);
                self.populate(index, center, self.reach(center, before), reach);
                if let Some(division) = &mut self.division {
                    division.extend_reach(index, reach);
                    self.field.seek_again();
                }
                self.steps_left = self.params.num_iterations;
            }
            return HitOutcome::Merged(index);
        }
        let index = self.impacts.len() as u32;
        let energy = energy.min(MAX_ENERGY);
        let crushes = self.crushes(pos);
        self.impacts.push(Impact { pos, energy, first_energy: energy, widening: widening(energy) });
        self.timeline.strike(index, crushes, 0.0, energy);
        let reach = self.reach(pos, energy);
        let first = self.network.nodes.len() as u32;
        let seed = mix(self.seed ^ mix(u64::from(index)));
        let plan = self.plan_rays(index, reach);
        let places = match &plan {
            Some(plan) => plan.rim.iter().map(|rim| rim.pos.clamp(Vec2::ZERO, extent)).collect(),
            None => starts::starts(self.params.starts, (pos, energy), reach, extent, seed),
        };
        let mut born = Vec::new();
        for (i, place) in places.into_iter().enumerate() {
            let place = self.masonry.as_ref().and_then(|masonry| masonry.nearest(place)).unwrap_or(place);
            let is_free = !self.nodes.any_within(place, 1e-4) && !self.is_on_crack(place, index);
            if is_free && self.room() > 0 && !self.mask.is_forbidden(place / extent) {
                born.push((i, self.network.nodes.len() as u32));
                self.add_node(place, NO_PARENT, 0, index, 1.0);
            }
        }
        if self.params.strands().is_some() {
            self.new_nodes = first..self.network.nodes.len() as u32;
            self.lay_out_strands(index, 0.0, energy);
        } else if first == self.network.nodes.len() as u32 {
            self.sprout((pos, energy), index, seed);
        } else if plan.is_some() {
            // The rim is joined below.
        } else if matches!(self.params.starts, StartLayout::Crushed { .. }) {
            self.crush(first);
        } else if let StartLayout::Arms { count } = self.params.starts {
            self.branch_out(first, starts::arms(count, (pos, energy), self.params.reach, extent, seed));
        }
        self.new_nodes = first..self.network.nodes.len() as u32;
        let named = plan.map(|plan| (self.begin_rays(&plan, index, &born), plan));
        for node in first..self.network.nodes.len() as u32 {
            self.field.visit(node, &self.network.nodes, &self.nodes);
        }
        if self.arrest.is_some() {
            self.unshown.push(first);
        }
        self.join_newborn();
        if let Some((name, plan)) = named {
            self.lay_out_rays(&plan, name);
        }
        self.populate(index, pos, 0.0, reach);
        if let Some(division) = &mut self.division {
            division.begin(index, self.new_nodes.clone(), self.steps, reach);
            self.field.seek_again();
        }
        self.steps_left = self.params.num_iterations;
        HitOutcome::Started(index)
    }

    /// Where a hit crushes the surface. In masonry that is where the cracks begin, in the nearest joint, and the bricks
    /// around it.
    fn crushes(&self, pos: Vec2) -> (Vec2, Bricks) {
        let found = self.masonry.as_ref().and_then(|masonry| Some((masonry, masonry.nearest(pos)?)));
        found.map_or((pos, NO_BRICKS), |(masonry, joint)| (joint, masonry.bricks(joint)))
    }

    /// The reach of the first hit of an impact.
    #[cfg(test)]
    pub(super) fn reach_of(&self, impact: u32) -> f32 {
        let Impact { pos, first_energy, .. } = self.impacts[impact as usize];
        self.reach(pos, first_energy)
    }

    /// The reach of a hit. It is larger where the border leaves less room.
    pub(super) fn reach(&self, pos: Vec2, energy: f32) -> f32 {
        let room = starts::room(pos, self.params.reach, self.network.extent());
        self.params.reach * energy.sqrt() * (1.0 + MORE_REACH * (1.0 - room))
    }

    /// Grows the first segment of each arm of a hit. The markers around the hit are left to the arms.
    fn branch_out(&mut self, start: u32, directions: Vec<Vec2>) {
        let pos = self.network.nodes[start as usize].pos;
        let born = self.network.nodes.len();
        if let Some(masonry) = self.masonry.clone() {
            let ways = masonry.ways(pos);
            // The sum is up, down or zero; the arms to the left and the right go around the bricks the other way.
            let upright: Vec2 = ways.iter().map(|(way, _)| *way * Vec2::Y).sum();
            for way in ways {
                let child = self.extend(start, masonry.end(pos, way, self.params.step_length), false);
                if let Some(child) = child.filter(|_| way.0.x != 0.0) {
                    self.courses[child as usize] = (way.0 - 0.7 * upright).normalize_or(way.0);
                }
            }
            return;
        }
        for direction in directions {
            // If another crack is too near, try directions next to it.
            for turn in [0.0f32, 0.15, -0.15, 0.3, -0.3, 0.5, -0.5, 0.8, -0.8] {
                let direction = direction + direction.perp() * turn;
                let to = pos + self.params.direct(direction).normalize_or(direction) * self.params.step_length;
                let is_inside = to.cmpgt(Vec2::ZERO).all() && to.cmplt(self.network.extent()).all();
                if !is_inside || self.room() == 0 {
                    continue;
                }
                if self.arrest.is_none() {
                    self.add_node(to, start, 1, self.network.nodes[start as usize].impact, 1.0);
                    break;
                }
                if self.extend(start, to, false).is_some() {
                    break;
                }
            }
        }
        if self.network.nodes.len() > born + 1
            && let Some(arrest) = &mut self.arrest
        {
            arrest.seal(start);
        }
    }

    fn populate(&mut self, impact: u32, center: Vec2, inner: f32, outer: f32) {
        if self.params.strands().is_some() {
            return;
        }
        let extent = self.network.extent();
        // In masonry the centre is in the nearest joint.
        let center = self.masonry.as_ref().and_then(|masonry| masonry.nearest(center)).unwrap_or(center);
        let region = Region { center, inner, outer, extent };
        let seed = mix(self.seed ^ mix(u64::from(impact) | 1 << 40));
        // The rays of a hit have their own markers: older cracks do not grow towards them.
        let owner = if self.params.keeps_apart() { impact } else { ANY_IMPACT };
        self.begin_layout(region, (impact, owner), seed);
    }

    /// Gives each hit from which nothing could grow, because the place is too narrow, a short crack.
    pub(super) fn show_hits(&mut self) {
        while let Some(start) = self.unshown.pop() {
            let born = self.network.nodes.len();
            let Some(&node) = self.network.nodes.get(start as usize) else { continue };
            let of_hit = |other: &Node| other.impact == node.impact && other.parent != NO_PARENT;
            if self.network.nodes[start as usize..].iter().any(of_hit) {
                continue;
            }
            // The crack gets its own step.
            self.steps = self.steps.saturating_add(1);
            self.timeline.begin(self.steps);
            let length = self.params.step_length;
            for way in [Vec2::X, Vec2::NEG_X, Vec2::Y, Vec2::NEG_Y] {
                let to = (node.pos + way * length).clamp(Vec2::ZERO, self.network.extent());
                if to.distance(node.pos) > 0.25 * length && self.extend(start, to, true).is_some() {
                    break;
                }
            }
            // Where there is no room even for that it is joined to what is in the way.
            self.report_links();
            self.new_nodes = born as u32..self.network.nodes.len() as u32;
        }
    }

    /// Whether a place lies on a crack: near its line, or within the width of a crack of another impact.
    fn is_on_crack(&self, place: Vec2, impact: u32) -> bool {
        let Some(arrest) = self.arrest.as_ref().filter(|_| self.params.keeps_apart()) else { return false };
        arrest.walls.any_within(place, 0.3 * self.params.step_length) || self.is_in_wide_crack(place, impact)
    }

    fn is_in_wide_crack(&self, place: Vec2, impact: u32) -> bool {
        let mut is_in = false;
        self.nodes.within(place, WIDE, |node, distance_sq| {
            let node = self.network.nodes[node as usize];
            is_in |= node.impact != impact && distance_sq <= 0.25 * node.width * node.width;
        });
        is_in
    }

    /// Joins the nodes of a rim, from `first` on, to a ring.
    fn crush(&mut self, first: u32) {
        let last = self.network.nodes.len() as u32;
        let extent = self.network.extent();
        for node in first..last {
            let next = if node + 1 == last { first } else { node + 1 };
            let at = |node: u32| self.network.nodes[node as usize].pos;
            // No links along the border, and only one link between two nodes.
            let is_along = |border: Vec2| (at(node).cmpeq(border) & at(next).cmpeq(border)).any();
            let is_joined = next == node || (next == first && last - first == 2);
            if !(is_joined || is_along(Vec2::ZERO) || is_along(extent)) {
                let width = self.params.line_width;
                let (birth, kind) = (self.steps, LinkKind::Connection);
                self.link(Link { a: next, b: node, width, birth, kind, bend: 0.0 });
            }
        }
    }

    /// Widens the cracks of an impact that was hit again, to the width of one hit with the total energy.
    fn widen(&mut self, impact: u32) {
        let Impact { energy, widening, .. } = self.impacts[impact as usize];
        let wider = self::widening(energy);
        // Only by visible amounts, so that a thousand small hits do not repaint all cracks a thousand times.
        if wider < 1.05 * widening {
            return;
        }
        self.impacts[impact as usize].widening = wider;
        for node in 0..self.network.nodes.len() as u32 {
            let this = &mut self.network.nodes[node as usize];
            if this.impact == impact {
                this.width = self.widths.at_most(this.width * (wider / widening)).min(0.4).max(this.width);
                self.widths.scale(node, wider / widening);
                let (width, parent) = (this.width, this.parent);
                self.changes.widened(node, parent != NO_PARENT);
                self.timeline.widen(node, width);
            }
        }
    }

    /// Handles a hit on a crack: new cracks start from it to both sides, or from the nearest place where there is
    /// room.
    fn sprout(&mut self, (pos, energy): (Vec2, f32), impact: u32, seed: u64) {
        if self.sprout_in_joints((pos, energy), impact) {
            return;
        }
        let length = self.params.step_length;
        let arms = match self.params.starts {
            StartLayout::Arms { count } if self.breaks_through() => {
                starts::arms(count, (pos, energy), self.params.reach, self.network.extent(), seed)
            }
            _ => Vec::new(),
        };
        let mut near = Vec::new();
        self.nodes.within(pos, WIDE.max(3.0 * length), |node, distance_sq| near.push((distance_sq, node)));
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let first = self.network.nodes.len();
        for (_, index) in near.into_iter().take(12) {
            for arm in &arms {
                self.grow_beyond(impact, index, *arm);
            }
            if self.network.nodes.len() > first + 1 {
                break;
            }
            let pos = self.network.nodes[index as usize].pos;
            let across = self.across_crack(index).unwrap_or(Vec2::X) * self.way_out(index);
            for way in [across, -across] {
                self.extend_of(impact, index, pos + way, false);
            }
            if self.network.nodes.len() > first {
                break;
            }
        }
    }
}
