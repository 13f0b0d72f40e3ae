//! Adds nodes, and widens the nodes behind them.

use super::{
    division::{Division, towards_rim},
    draws,
    pull::NO_PULL,
    rays::NO_RAY,
    state::CrackGrowth,
    width::Widths,
};
use crate::{
    math::hash_unit,
    pattern::{NO_PARENT, Node},
};
use glam::Vec2;

/// The width that is left at the rim at least, as a share.
const THINNEST: f32 = 0.02;

impl CrackGrowth {
    /// Adds a node and widens the nodes behind it; the caller shows it to the markers.
    pub(super) fn add_node(&mut self, pos: Vec2, parent: u32, generation: u32, impact: u32, bend: f32) {
        let first = self.network.nodes.len() as u32;
        self.add_thin_node(pos, parent, generation, impact, bend);
        self.widen_with(|widths, nodes, widened| widths.push(nodes, first, widened));
    }

    /// Adds a node without widening the nodes behind it.
    pub(super) fn add_thin_node(&mut self, pos: Vec2, parent: u32, generation: u32, impact: u32, bend: f32) {
        let node = self.network.nodes.len() as u64;
        let wider = self.impacts.get(impact as usize).map_or(1.0, |impact| impact.widening);
        let (mixed, draw) = (self.params.width_variation, hash_unit(self.seed ^ draws::MIXED_WIDTH, node));
        let share = |division: &mut Division| division.add_node(node as u32, parent, 1.0 - mixed * draw);
        let wider = self.division.as_mut().map_or(1.0, share) * wider * self.thinned(pos, impact);
        let is_own = self.network.nodes.get(parent as usize).is_some_and(|parent| parent.impact == impact);
        let width = self.widths.tip((parent, is_own), || hash_unit(self.seed ^ draws::UNEVEN_WIDTH, node), wider);
        if let Some(arrest) = &mut self.arrest {
            arrest.push_node(false);
        }
        self.network.nodes.push(Node { pos, width, parent, generation, birth: self.steps, impact, bend });
        self.nodes.push(pos);
        let from = self.network.nodes.get(parent as usize).map_or(pos, |parent| parent.pos);
        self.courses.push((pos - from).normalize_or_zero());
        self.pull_of.push(NO_PULL);
        self.changes.push_node(parent);
        self.timeline.add_node(width);
        self.inherit_ray(node as u32, parent);
    }

    /// Widens a tip that has met a crack to the width of the crack further back.
    pub(super) fn widen_end(&mut self, tip: u32) {
        if self.params.tip_taper > 0.0 {
            self.widen_with(|widths, nodes, widened| widths.join(nodes, tip, widened));
        }
    }

    /// Narrows a tip that has met a crack at the rim of the area that its hit has loaded, but not to zero.
    pub(super) fn thin_end(&mut self, tip: u32) {
        if self.params.tip_taper > 0.0 {
            self.widen_with(|widths, nodes, widened| widths.join_thinly(nodes, tip, widened));
        }
    }

    /// Lets `act` widen nodes, and records which nodes became wider.
    pub(super) fn widen_with(&mut self, act: impl FnOnce(&mut Widths, &mut [Node], &mut dyn FnMut(u32))) {
        let mut widened = std::mem::take(&mut self.widened);
        act(&mut self.widths, &mut self.network.nodes, &mut |node| widened.push(node));
        for node in widened.drain(..) {
            let wider = self.network.nodes[node as usize];
            self.changes.widened(node, wider.parent != NO_PARENT);
            self.timeline.widen(node, wider.width);
        }
        self.widened = widened;
    }

    /// The relative width of a crack of an impact at a place: smaller towards the rim.
    pub(super) fn thinned(&self, pos: Vec2, impact: u32) -> f32 {
        if self.params.thinning <= 0.0 {
            return 1.0;
        }
        let (Some(_), Some(hit)) = (&self.division, self.impacts.get(impact as usize)) else { return 1.0 };
        let way = pos - hit.pos;
        (1.0 - self.params.thinning * towards_rim(way.length(), self.rim_of(impact, way))).max(THINNEST)
    }

    /// Puts a node on the ray of its parent.
    pub(super) fn inherit_ray(&mut self, node: u32, parent: u32) {
        if let Some(&ray) = self.field.ray_of.get(parent as usize)
            && ray != NO_RAY
        {
            self.put_on_ray(node, ray);
        }
    }

    /// Records the ray of a node.
    pub(super) fn put_on_ray(&mut self, node: u32, ray: u32) {
        let ray_of = &mut self.field.ray_of;
        if ray_of.len() <= node as usize {
            ray_of.resize(node as usize + 1, NO_RAY);
        }
        ray_of[node as usize] = ray;
        let last = self.rays.last_of(ray);
        if ray != NO_RAY && self.network.nodes[node as usize].generation >= last {
            self.seal(node);
        }
    }

    pub(super) fn seal(&mut self, node: u32) {
        if let Some(arrest) = &mut self.arrest {
            arrest.seal(node);
        }
    }
}
