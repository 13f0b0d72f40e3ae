//! Strands that run out from a hit ([`MarkerLayout::Strands`]): their paths are laid out at the hit and grow step by step.

use super::{
    draws,
    params::{GrowthParams, MarkerLayout},
    starts,
    state::CrackGrowth,
    strand_paths::{Order, StrandPaths},
};
use crate::{
    math::{mix, ops},
    pattern::{NO_PARENT, Network, Node, SegmentId},
    strands::{Directions, Material, Primitive, StrandParams, StrandStart, Strands},
};
use glam::Vec2;
use std::sync::LazyLock;

/// The primitives of each material, for single strands and for nets. They are made once: their images are traced.
static LIBRARIES: LazyLock<[[Vec<Primitive>; 2]; Material::ALL.len()]> =
    LazyLock::new(|| Material::ALL.map(|material| [material.primitives(), material.nets()]));

/// Points of a path closer than this to the last node are left out, segment lengths.
const CLOSE: f32 = 0.4;

/// Points this near to the last node, or to the start of a strand, are left out where other lines are in the way, segment lengths.
const PATIENT: f32 = 2.0;
const CROWDED: f32 = 4.0;

/// A hit on an older crack starts from its nearest node within this distance, pattern units.
const BESIDE: f32 = 0.1;

/// Most tries to find strands that have room.
const TRIES: u32 = 12;

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

/// Strands away from `center`; `None` if there are no starts. With
/// their branches they should be `usual` long, pattern units. Near
/// the border they may run off the surface at once: then others are tried that noise turns less, which are longer, and the best are taken.
fn run_out(
    params: &StrandParams,
    (center, starts): (Vec2, &[StrandStart]),
    usual: f32,
    extent: Vec2,
    seed: u64,
) -> Option<Network> {
    let library = &LIBRARIES[params.material as usize][usize::from(params.lanes > 1)];
    let mut best: Option<(f32, Network)> = None;
    for number in 0..if starts.is_empty() { 0 } else { TRIES } {
        let less = number as f32 / TRIES as f32;
        let length = (params.length * (1.0 + 1.5 * less)).min(64.0);
        let params = StrandParams { rotation: params.rotation * (1.0 - less), length, ..*params };
        let field = Directions::Radial { center };
        let strands = Strands::new(&params, field, starts, extent, mix(seed ^ u64::from(number) << 32));
        // There is no error: the parameters have been checked, and the starts are on the surface.
        let paths = strands.and_then(|strands| strands.network(library)).ok()?;
        let room = length_inside(&paths);
        if best.as_ref().is_none_or(|(most, _)| room > *most) {
            best = Some((room, paths));
        }
        if room >= usual {
            break;
        }
    }
    best.map(|(_, paths)| paths)
}

/// The length of paths up to where they meet the border.
fn length_inside(paths: &Network) -> f32 {
    let mut is_in = Vec::with_capacity(paths.nodes.len());
    let mut length = 0.0;
    for node in &paths.nodes {
        let on_border = (node.pos.cmpeq(Vec2::ZERO) | node.pos.cmpeq(paths.extent())).any();
        let from = paths.nodes.get(node.parent as usize).filter(|_| is_in[node.parent as usize]);
        length += from.map_or(0.0, |from| from.pos.distance(node.pos));
        is_in.push(node.parent == NO_PARENT || from.is_some() && !on_border);
    }
    length
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
        let order =
            Order { impact, center, reach: reaches[1], roots: vec![(center, root)], least, rounds: ROUNDS, seed };
        self.lay_out(&order, new);
        if before > 0.0 {
            let (reach, seed) = (reaches[1] - reaches[0], seed ^ 1);
            self.run_on_from_ends(Order { reach, roots: Vec::new(), seed, ..order }, FAR * reaches[0]);
        }
    }

    /// Lays out strands from the roots, the first in these directions.
    fn lay_out(&mut self, order: &Order, ways: Vec<Vec2>) {
        let Some((_, params)) = self.params.strands() else { return };
        let length = (params.length * order.reach / self.params.reach).clamp(0.001, 64.0);
        let params = StrandParams { length, ..*params };
        let roots = order.roots.iter().cycle();
        let starts: Vec<_> = ways
            .into_iter()
            .zip(roots)
            .map(|(way, (pos, _))| StrandStart { pos: *pos, direction: Some(way) })
            .collect();
        if let Some(paths) = run_out(&params, (order.center, &starts), order.least, self.network.extent(), order.seed) {
            self.strands.push(StrandPaths::new(order, paths));
        }
    }

    /// Lays out strands from the free ends of an impact that are this far from it; returns whether there are any.
    fn run_on_from_ends(&mut self, mut order: Order, distance: f32) -> bool {
        order.roots = self.far_ends(order.impact, order.center, distance);
        let ways: Vec<_> = order.roots.iter().map(|(_, node)| self.heading_of(*node)).collect();
        self.lay_out(&order, ways);
        !order.roots.is_empty()
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
        let order = Order { impact, center, reach, roots: Vec::new(), least, rounds, seed };
        // Ends may be walled in, and so may the hit be, between its own cracks and the border.
        let is_from_ends = rounds % 2 == 1 && self.run_on_from_ends(Order { roots: Vec::new(), ..order }, 0.0);
        let root = if rounds < ROUNDS / 2 { self.start_beside(impact, center) } else { self.node_beside(center) };
        if let Some(root) = root.filter(|_| !is_from_ends) {
            let ways = starts::arms(1, (center, 1.0), reach, self.network.extent(), seed);
            self.lay_out(&Order { roots: vec![(self.inside(root), root)], ..order }, ways);
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
        let is_joined = |node: u32| self.network.links.iter().any(|link| link.a == node || link.b == node);
        let extent = self.network.extent();
        let mut ends: Vec<_> = nodes
            .filter(|(_, node)| node.impact == impact && node.pos.distance(center) >= distance)
            .filter(|(_, node)| !(node.pos.cmpeq(Vec2::ZERO) | node.pos.cmpeq(extent)).any())
            .filter(|(index, _)| self.child_of(*index) == NO_PARENT && !is_joined(*index))
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
        if self.strands.is_empty() {
            self.steps_left = 0;
        }
        if self.steps_left == 0 {
            self.strands.clear();
            self.widen_with(|widths, nodes, widened| widths.settle(nodes, widened));
        } else if self.new_nodes.is_empty() && self.network.links.len() == links {
            // Nothing has changed: the next step takes its place.
            self.steps -= 1;
        }
    }

    /// The node of the next point of a path.
    fn follow(&mut self, paths: &StrandPaths, point: u32) -> u32 {
        let Node { pos, parent, .. } = paths.paths.nodes[point as usize];
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
