//! Strands that run out from a hit ([`MarkerLayout::Strands`]): their paths are laid out at the hit, in slices, and
//! grow step by step.

use super::{
    draws,
    params::{GrowthParams, MarkerLayout},
    starts,
    state::CrackGrowth,
    strand_paths::{Order, StrandPaths},
};
use crate::{
    math::{mix, ops},
    pattern::{NO_PARENT, Node, SegmentId},
    strands::{StrandParams, StrandStart},
};
use glam::Vec2;

/// A point of a strand that is laid out costs as much as this many places for markers.
const POINT: u32 = 4;

/// Points of a path closer than this to the last node are left out, segment lengths.
const CLOSE: f32 = 0.4;

/// Points this near to the last node, or to the start of a strand, are left out where other lines are in the way, segment lengths.
const PATIENT: f32 = 2.0;
const CROWDED: f32 = 4.0;

/// A hit on an older crack starts from its nearest node within this distance, pattern units.
const BESIDE: f32 = 0.1;

/// Strands should be this many times as long together as if none was blocked, by the number of their children: none, one, two.
const ENOUGH: [f32; 3] = [0.7, 1.35, 2.4];

/// How often more strands are laid out for a hit whose strands have been blocked.
const ROUNDS: u32 = 8;

/// Strands start from at most this many ends.
const ENDS: usize = 6;

/// Strands start this far from the border at least, pattern units: they are not straight.
const INSIDE: f32 = 0.03;

/// Cosine of the least angle between two strands of a hit, 40 degrees: closer ones would stop each other.
const APART: f32 = 0.766;

/// Ends at this share of the reach of a hit run on when it is hit again.
const FAR: f32 = 0.6;

impl GrowthParams {
    /// The number of strands of a hit of energy 1, and their settings; `None` if cracks follow markers.
    pub(super) const fn strands(&self) -> Option<(u32, &StrandParams)> {
        match &self.markers {
            MarkerLayout::Strands { count, strands } => Some((*count, strands)),
            _ => None,
        }
    }
}

/// Those directions that have room beside each other and beside the old ones.
fn apart(old: &[Vec2], all: Vec<Vec2>) -> Vec<Vec2> {
    let mut kept = old.to_vec();
    for way in all {
        if kept.iter().all(|other| other.dot(way) < APART) {
            kept.push(way);
        }
    }
    kept.split_off(old.len())
}

impl CrackGrowth {
    /// Lays out the strands by which the energy of an impact rises from `before` to `energy`: new ones from the hit, and more of
    /// those that have ended.
    pub(super) fn lay_out_strands(&mut self, impact: u32, before: f32, energy: f32) {
        let Some((count, params)) = self.params.strands() else { return };
        let extent = self.network.extent();
        let Some(root) = self.node_beside(self.impacts[impact as usize].pos) else { return };
        let center = self.inside(root);
        let reaches = [before, energy].map(|energy| self.reach(center, energy));
        let seed = mix(self.seed ^ draws::STRANDS ^ u64::from(impact) << 16);
        let ways = |energy: f32| starts::arms(count, (center, energy), reaches[1], extent, seed);
        let old = if before > 0.0 { apart(&[], ways(before)) } else { Vec::new() };
        // Strands of a later hit on the same place run otherwise.
        let seed = mix(seed ^ u64::from(before.to_bits()));
        let new = apart(&old, ways(energy));
        let least = ENOUGH[if params.depth > 0 { params.children as usize } else { 0 }]
            * count as f32
            * ops::powf(energy, 5.0 / 6.0)
            * params.length;
        let order = Order { least, rounds: ROUNDS, ..Order::new(impact, center, reaches[1], *params, seed) };
        self.lay_out(Order { roots: vec![(center, root)], ..order.clone() }, new);
        if before > 0.0 {
            let (reach, seed) = (reaches[1] - reaches[0], seed ^ 1);
            self.run_on_from_ends(Order { reach, seed, ..order }, FAR * reaches[0]);
        }
    }

    /// Has strands laid out that start from the roots in these directions, in turns.
    fn lay_out(&mut self, mut order: Order, ways: Vec<Vec2>) {
        order.params.length = (order.params.length * order.reach / self.params.reach).clamp(0.001, 64.0);
        let starts = ways.into_iter().zip(order.roots.iter().cycle());
        order.starts = starts.map(|(way, (pos, _))| StrandStart { pos: *pos, direction: Some(way) }).collect();
        if !order.starts.is_empty() {
            self.orders.push_back(order);
        }
    }

    /// Goes on to lay out strands; a point of a strand costs as much as some places for markers. Returns whether any are left.
    pub(super) fn try_strands(&mut self, places: u32) -> bool {
        if let Some(order) = self.orders.front_mut()
            && order.go_on(self.network.extent(), (places / POINT).max(1))
        {
            self.strands.extend(self.orders.pop_front().and_then(Order::finish));
        }
        !self.orders.is_empty()
    }

    /// Has strands laid out from the free ends of an impact that are this far from it; returns whether there are any.
    fn run_on_from_ends(&mut self, mut order: Order, distance: f32) -> bool {
        order.roots = self.far_ends(order.impact, order.center, distance);
        let (any, ways) =
            (!order.roots.is_empty(), order.roots.iter().map(|(_, node)| self.heading_of(*node)).collect());
        self.lay_out(order, ways);
        any
    }

    /// Lays out more strands for an impact whose strands have all been blocked or have run off the surface.
    fn lay_out_more(&mut self, paths: &StrandPaths) {
        let impact = paths.impact;
        let Some(hit) = self.impacts.get(impact as usize).filter(|_| paths.rounds > 0) else { return };
        let of_impact = self.network.nodes.iter().filter(|node| node.impact == impact);
        let parts = of_impact.filter_map(|node| Some((node, self.network.nodes.get(node.parent as usize)?)));
        let length: f32 = parts.map(|(node, parent)| node.pos.distance(parent.pos)).sum();
        if length >= paths.least {
            return;
        }
        let rounds = paths.rounds - 1;
        let seed = mix(self.seed ^ draws::STRANDS ^ u64::from(impact) << 16 ^ u64::from(1 + rounds) << 48);
        let (center, least) = (hit.pos, paths.least);
        let reach = self.reach(center, hit.energy);
        let Some((_, params)) = self.params.strands() else { return };
        let order = Order { least, rounds, ..Order::new(impact, center, reach, *params, seed) };
        // Ends may be walled in, and so may the hit be, between its own cracks and the border.
        let is_from_ends = rounds % 2 == 1 && self.run_on_from_ends(order.clone(), 0.0);
        let root = if rounds < ROUNDS / 2 { self.start_beside(impact, center) } else { self.node_beside(center) };
        if let Some(root) = root.filter(|_| !is_from_ends) {
            let ways = starts::arms(1, (center, 1.0), reach, self.network.extent(), seed);
            self.lay_out(Order { roots: vec![(self.inside(root), root)], ..order }, ways);
        }
    }

    /// Starts a crack beside a hit, towards the middle of the surface, where no other is.
    fn start_beside(&mut self, impact: u32, center: Vec2) -> Option<u32> {
        let extent = self.network.extent();
        let way = (0.5 * extent - center).normalize_or(Vec2::X);
        let places = (2..8).map(|far| center + way * (far as f32 * INSIDE));
        let is_free = |place: &Vec2| {
            let is_on = place.cmpgt(Vec2::ZERO).all() && place.cmplt(extent).all();
            is_on && !self.nodes.any_within(*place, INSIDE) && !self.mask.is_forbidden(*place / extent)
        };
        let place = places.into_iter().find(is_free)?;
        let node = self.network.nodes.len() as u32;
        self.add_node(place, NO_PARENT, 0, impact, 1.0);
        Some(node)
    }

    /// Where strands start from a node: not too near to the border.
    fn inside(&self, node: u32) -> Vec2 {
        let extent = self.network.extent();
        let margin = Vec2::splat(INSIDE).min(0.5 * extent);
        self.network.nodes[node as usize].pos.clamp(margin, extent - margin)
    }

    /// The node of a hit, or one of an older crack beside it.
    fn node_beside(&self, center: Vec2) -> Option<u32> {
        let mut nearest: Option<(f32, u32)> = None;
        self.nodes.within(center, BESIDE, |node, distance_sq| {
            if nearest.is_none_or(|(least, first)| (distance_sq, node) < (least, first)) {
                nearest = Some((distance_sq, node));
            }
        });
        nearest.map(|(_, node)| node)
    }

    /// The free ends of an impact that are furthest from it, and at least this far.
    fn far_ends(&self, impact: u32, center: Vec2, distance: f32) -> Vec<(Vec2, u32)> {
        let nodes = (0u32..).zip(&self.network.nodes);
        let mut joined: Vec<u32> = self.network.links.iter().flat_map(|link| [link.a, link.b]).collect();
        joined.sort_unstable();
        let extent = self.network.extent();
        let mut ends: Vec<_> = nodes
            .filter(|(_, node)| node.impact == impact && node.pos.distance(center) >= distance)
            .filter(|(_, node)| !(node.pos.cmpeq(Vec2::ZERO) | node.pos.cmpeq(extent)).any())
            .filter(|(index, _)| self.child_of(*index) == NO_PARENT && joined.binary_search(index).is_err())
            .map(|(index, node)| (node.pos, index))
            .collect();
        let far = |(pos, _): &(Vec2, u32)| pos.distance_squared(center);
        ends.sort_by(|a, b| far(b).total_cmp(&far(a)).then(a.1.cmp(&b.1)));
        ends.truncate(ENDS);
        ends
    }

    /// One step of a growth whose hits lay out strands.
    pub(super) fn advance_strands(&mut self) {
        let (first, links) = (self.network.nodes.len() as u32, self.network.links.len());
        self.timeline.begin(self.steps.saturating_add(1));
        self.steps = self.steps.saturating_add(1);
        for mut paths in std::mem::take(&mut self.strands) {
            paths.steps = paths.steps.saturating_add(1);
            while self.room() > 0
                && let Some(point) = paths.next()
            {
                let node = self.follow(&paths, point);
                paths.nodes[point as usize] = node;
            }
            if self.room() == 0 {
                continue;
            }
            if paths.is_over() {
                self.lay_out_more(&paths);
            } else {
                self.strands.push(paths);
            }
        }
        self.new_nodes = first..self.network.nodes.len() as u32;
        self.join_newborn();
        if self.strands.is_empty() && self.orders.is_empty() {
            self.steps_left = 0;
        }
        if self.steps_left == 0 {
            self.strands.clear();
            self.orders.clear();
            self.widen_with(|widths, nodes, widened| widths.settle(nodes, widened));
        } else if self.new_nodes.is_empty() && self.network.links.len() == links {
            // Nothing has changed: the next step takes its place.
            self.steps -= 1;
        }
    }

    /// The node of the next point of a path.
    fn follow(&mut self, paths: &StrandPaths, point: u32) -> u32 {
        let Node { pos, parent, .. } = paths.network.nodes[point as usize];
        if parent == NO_PARENT {
            return paths.root(pos);
        }
        let (from, length) = (paths.nodes[parent as usize], self.params.step_length);
        let Some(last) = self.network.nodes.get(from as usize).map(|node| node.pos) else { return NO_PARENT };
        let begin = paths.roots.iter().map(|(root, _)| root.distance(pos)).fold(f32::INFINITY, f32::min);
        let is_passed = |growth: &Self| {
            let child = SegmentId::Branch(growth.network.nodes.len() as u32);
            let is_near = begin < CROWDED * length || last.distance(pos) < PATIENT * length;
            is_near && growth.free_line(child, (from, u32::MAX), (last, pos)).is_err()
        };
        if last.distance(pos) < CLOSE * length || is_passed(self) {
            return from;
        }
        self.extend_of(paths.impact, from, pos, false).unwrap_or(NO_PARENT)
    }
}
