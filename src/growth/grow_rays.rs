//! Rays as they grow: which node is on which ray, where they fork, and the rings between them.
//!
//! Each ray follows its own markers (a marker attracts only the nodes of its ray, by eq. 2 of Couto et al.). At a
//! node where the plan has a fork, the first node of another ray is added beside it. When both corners of a line of a
//! ring exist, a tip runs from one to the other, one segment a step, and is linked to it (`draw_connections`).

use super::{
    draws,
    params::MAX_MARKERS,
    plan::{Plan, PlannedHit},
    rays::{Corner, Fork, NO_NODE, NO_RAY, Walker, chord_steps},
    region::density_at,
    state::CrackGrowth,
};
use crate::{
    math::{hash_unit, mix},
    pattern::{Dot, Link, LinkKind},
};
use glam::Vec2;

impl CrackGrowth {
    /// The rays of an impact, if the layout has any.
    pub(super) fn plan_rays(&self, impact: u32, reach: f32) -> Option<Plan> {
        let hit = self.impacts.get(impact as usize)?;
        let seed = mix(self.seed ^ mix(u64::from(impact)));
        let planned = PlannedHit { pos: hit.pos, energy: hit.first_energy, reach, seed };
        Plan::new(&self.params, planned, self.network.extent())
    }

    /// Starts the rays of a plan: the rim from `first` on, of which `born` has the places that exist, and the
    /// markers.
    pub(super) fn begin_rays(&mut self, plan: &Plan, impact: u32, born: &[(usize, u32)]) -> u32 {
        let is_over = !self.is_growing();
        let first = self.rays.add_plan(plan, impact, is_over);
        if born.is_empty() {
            // The hit is on a crack and has new branches there: each branch is on the ray with the nearest direction.
            let center = self.impacts[impact as usize].pos;
            for node in self.new_nodes.clone() {
                let way = (self.network.nodes[node as usize].pos - center).normalize_or_zero();
                let nearest = (0..plan.rays.len()).filter(|&i| plan.rays[i].from.is_none()).max_by(|&a, &b| {
                    let towards = |i: usize| (plan.rays[i].line[0] - center).normalize_or_zero().dot(way);
                    towards(a).total_cmp(&towards(b))
                });
                if let Some(ray) = nearest {
                    self.put_on_ray(node, first + ray as u32);
                }
            }
        }
        for (i, &(place, node)) in born.iter().enumerate() {
            if let Some(ray) = plan.rim[place].ray {
                self.put_on_ray(node, first + ray as u32);
            }
            // The rim, where it continues to the next place.
            let (next, to) = born[(i + 1) % born.len()];
            let follows = next == (place + 1) % plan.rim.len();
            let is_twice = born.len() == 2 && i == 1;
            if follows && plan.rim[place].goes_on && node != to && !is_twice {
                let width = self.params.line_width * self.impacts[impact as usize].widening;
                let birth = self.steps;
                self.link(Link { a: node, b: to, width, birth, kind: LinkKind::Connection, bend: 0.0 });
            }
        }
        first
    }

    /// Lays out the markers of the rays of a plan, the first of which has the number `name`.
    pub(super) fn lay_out_rays(&mut self, plan: &Plan, name: u32) {
        let extent = self.network.extent();
        for (i, ray) in (0u32..).zip(&plan.rays) {
            for &pos in ray.line.iter().skip(1) {
                if self.field.living_at_most() >= MAX_MARKERS || self.is_barren(pos) {
                    continue;
                }
                self.field.add(pos, name + i, f32::INFINITY);
                let is_inside = pos.cmpge(Vec2::ZERO).all() && pos.cmple(extent).all();
                if self.params.draw_markers && is_inside {
                    self.shown_markers.push(pos);
                    self.timeline.add_dot(Dot { pos, radius: self.params.line_width });
                }
            }
        }
    }

    /// Whether markers are not allowed here.
    fn is_barren(&self, pos: Vec2) -> bool {
        let extent = self.network.extent();
        let density = density_at(self.density.as_ref(), pos, extent) * self.mask.density_at(pos / extent);
        density <= 0.0 || self.mask.is_forbidden(pos / extent)
    }

    /// Handles the nodes from `first` on: starts forks and lines of rings, and advances the lines that are growing.
    pub(super) fn advance_rays(&mut self, first: u32) {
        let mut node = first;
        while (node as usize) < self.network.nodes.len() {
            let ray = self.field.ray_of.get(node as usize).copied().unwrap_or(NO_RAY);
            if ray != NO_RAY {
                self.branch_off(node, (ray, self.network.nodes[node as usize].generation));
            }
            node += 1;
        }
        for walker in std::mem::take(&mut self.rays.walkers) {
            if let Some(on) = self.walk(walker) {
                self.rays.walkers.push(on);
            }
        }
    }

    fn branch_off(&mut self, node: u32, at: (u32, u32)) {
        let pos = self.network.nodes[node as usize].pos;
        let length = self.params.step_length;
        let from = self.rays.forks.partition_point(|fork| fork.at < at);
        for i in from..self.rays.forks.len() {
            let Fork { at: here, ray, way } = self.rays.forks[i];
            if here != at {
                break;
            }
            if let Some(child) = self.extend(node, pos + way * length, false) {
                self.put_on_ray(child, ray);
            }
        }
        let from = self.rays.corners.partition_point(|corner| corner.at < at);
        for i in from..self.rays.corners.len() {
            let Corner { at: here, chord, end } = self.rays.corners[i];
            if here != at {
                break;
            }
            let ends = &mut self.rays.chords[chord as usize];
            ends[end] = node;
            if let [from, to] = *ends
                && from != NO_NODE
                && to != NO_NODE
            {
                let apart = self.network.nodes[from as usize].pos.distance(self.network.nodes[to as usize].pos);
                self.rays.walkers.push(Walker { tip: from, to, wait: 2, steps_left: chord_steps(apart, length) });
            }
        }
    }

    /// Adds one segment to a line of a ring; `None` when it has reached its end.
    fn walk(&mut self, mut walker: Walker) -> Option<Walker> {
        if walker.wait > 0 {
            walker.wait -= 1;
            return Some(walker);
        }
        let (from, to) = (self.network.nodes[walker.tip as usize].pos, self.network.nodes[walker.to as usize].pos);
        let segments = (from.distance(to) / self.params.step_length - 0.01).ceil().max(1.0);
        if segments < 1.5 {
            if !self.join(walker.to, walker.tip, LinkKind::Connection) {
                self.join_near(walker.tip, to - from, 1.5);
            }
            return None;
        }
        walker.steps_left = walker.steps_left.checked_sub(1)?;
        // Another crack may be in the way now.
        if self.params.arrest > 0.0 && segments > 2.5 && self.ends_soon(walker.tip, (to - from).normalize_or_zero()) {
            return None;
        }
        // Equal segments, each with a small random deviation.
        let stray =
            self.params.wander * (2.0 * hash_unit(self.seed ^ draws::CHORD, self.network.nodes.len() as u64) - 1.0);
        let way = (to - from) / segments;
        let child = self.extend(walker.tip, from + way + way.perp() * stray, true)?;
        self.put_on_ray(child, NO_RAY);
        walker.tip = child;
        Some(walker)
    }
}
