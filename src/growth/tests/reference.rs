//! Growth against brute force: all markers against all nodes, every step.

use super::{random_extent, random_params};
use crate::{
    growth::{CrackGrowth, GrowthParams, MarkerLayout, StartLayout, Venation},
    math::{Rng, hash_unit},
};
use glam::Vec2;

/// Where the child of a node lies that `set` pulls: squared distance and number of each marker; eq. 2 and what keeps it on its way.
fn child_of(
    p: &GrowthParams,
    extent: Vec2,
    (from, heading): (Vec2, Vec2),
    set: &[(f32, usize)],
    marker: impl Fn(usize) -> Vec2,
    stray: f32,
) -> Vec2 {
    let mut sum = [0i64; 2];
    for &(distance_sq, id) in set {
        let towards = (marker(id) - from) * (16_777_216.0 / distance_sq.sqrt());
        sum[0] += i64::from(towards.x as i32);
        sum[1] += i64::from(towards.y as i32);
    }
    let mut direction = Vec2::new(sum[0] as f32, sum[1] as f32).normalize_or_zero();
    if p.inertia > 0.0 && heading.dot(direction) > 0.0 {
        direction = (direction + heading * p.inertia).normalize_or_zero();
    }
    if p.directed > 0.0 {
        let axis = Vec2::new(crate::math::ops::cos(p.axis), crate::math::ops::sin(p.axis));
        let along = axis * axis.dot(direction);
        direction = (along + (direction - along) * (1.0 - p.directed)).normalize_or(direction);
    }
    if p.wander > 0.0 {
        direction = (direction + direction.perp() * stray).normalize_or_zero();
    }
    let mut to = from + direction * p.step_length;
    let far = from + direction * (p.step_length + p.kill_distance);
    let mut share = 1.0f32;
    for axis in 0..2 {
        if far[axis] < 0.0 {
            share = share.min(-from[axis] / (far[axis] - from[axis]));
        } else if far[axis] > extent[axis] {
            share = share.min((extent[axis] - from[axis]) / (far[axis] - from[axis]));
        }
    }
    if share < 1.0 {
        to = (from + (far - from) * share).clamp(Vec2::ZERO, extent);
    }
    let serves = set.iter().any(|&(distance_sq, id)| {
        let after = marker(id).distance_squared(to);
        after <= p.kill_distance * p.kill_distance || after <= distance_sq - 0.25 * p.step_length * p.step_length
    });
    if serves {
        return to;
    }
    let (closest_sq, id) = set.iter().copied().min_by(|a, b| a.partial_cmp(b).unwrap()).unwrap();
    let distance = closest_sq.sqrt();
    if distance <= p.step_length { marker(id) } else { from + (marker(id) - from) * (p.step_length / distance) }
}

/// Where a node is, and the direction in which its crack has come there.
/// How far the next node of `node` strays.
fn stray_of(p: &GrowthParams, seed: u64, nodes: &[(Vec2, u32)], node: usize) -> f32 {
    let mut stray = 2.0 * hash_unit(seed ^ 0x57A6, nodes.len() as u64) - 1.0;
    if p.zigzag > 0.0 {
        let ancestors = std::iter::successors(nodes.get(node), |(_, parent)| nodes.get(*parent as usize));
        let side = if ancestors.count() % 2 == 1 { 1.0 } else { -1.0 };
        stray += p.zigzag * (side * (0.45 + 0.55 * stray.abs()) - stray);
    }
    p.wander * stray
}

fn on_its_way(nodes: &[(Vec2, u32)], node: usize) -> (Vec2, Vec2) {
    let (pos, parent) = nodes[node];
    (pos, nodes.get(parent as usize).map_or(Vec2::ZERO, |before| (pos - before.0).normalize_or_zero()))
}

/// All markers against all nodes, every step.
struct Reference {
    params: GrowthParams,
    extent: Vec2,
    seed: u64,
    nodes: Vec<(Vec2, u32)>,
    /// Per node: the impact it belongs to.
    impacts: Vec<u32>,
    markers: Vec<(Vec2, u32, bool)>,
}

impl Reference {
    fn step(&mut self) -> usize {
        let p = &self.params;
        let mut attracted: Vec<Vec<(f32, usize)>> = vec![Vec::new(); self.nodes.len()];
        for (id, (marker, owner, alive)) in self.markers.iter_mut().enumerate() {
            if !*alive {
                continue;
            }
            let (mut best, mut best_sq) = (usize::MAX, p.crack_radius * p.crack_radius);
            for (node, (pos, _)) in self.nodes.iter().enumerate() {
                let distance_sq = marker.distance_squared(*pos);
                if distance_sq < best_sq && (*owner == u32::MAX || *owner == self.impacts[node]) {
                    (best, best_sq) = (node, distance_sq);
                }
                *alive &=
                    distance_sq > p.kill_distance * p.kill_distance || distance_sq >= p.crack_radius * p.crack_radius;
            }
            if *alive && best != usize::MAX {
                attracted[best].push((best_sq, id));
            }
        }
        let before = self.nodes.len();
        for (node, set) in attracted.iter().enumerate().filter(|(_, set)| !set.is_empty()) {
            let stray = stray_of(p, self.seed, &self.nodes, node);
            let to = child_of(p, self.extent, on_its_way(&self.nodes, node), set, |id| self.markers[id].0, stray);
            self.nodes.push((to, node as u32));
            self.impacts.push(self.impacts[node]);
        }
        self.nodes.len() - before
    }
}

#[test]
fn equals_brute_force_node_for_node() {
    let mut ended = 0;
    for case in 0..300u64 {
        let mut rng = Rng::new(case).stream("brute force");
        let mut params = random_params(&mut rng, true);
        if case % 2 == 0 {
            params.inertia = rng.range(0.0, 6.0);
            (params.axis, params.directed) = (3.0 * rng.signed(), if case % 4 == 0 { 0.0 } else { rng.unit() });
        }
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        let mut reference =
            Reference { params, extent, seed: case, nodes: Vec::new(), impacts: Vec::new(), markers: Vec::new() };
        for hit in 0..3 {
            let pos = Vec2::new(rng.unit(), rng.unit()) * extent;
            growth.hit(pos, 0.2 + 2.0 * rng.unit());
            reference.markers.extend(growth.field.unsettled().map(|(pos, owner)| (pos, owner, true)));
            let known = reference.nodes.len();
            reference.nodes.extend(growth.network().nodes()[known..].iter().map(|node| (node.pos, node.parent)));
            reference.impacts.extend(growth.network().nodes()[known..].iter().map(|node| node.impact));
            let steps = if hit == 2 { 400 } else { 1 + rng.next_u32() % 30 };
            for step in 0..steps {
                let born = growth.step().born as usize;
                assert_eq!(born, reference.step(), "case {case}, hit {hit}, step {step}");
                let mine: Vec<_> = growth.network().nodes().iter().map(|node| (node.pos, node.parent)).collect();
                assert_eq!(mine, reference.nodes, "case {case}, hit {hit}, step {step}");
                if born == 0 || mine.len() > 1500 {
                    break;
                }
            }
            if !growth.is_growing() {
                let alive = reference.markers.iter().filter(|(.., alive)| *alive).count() as u32;
                let census = growth.marker_counts();
                assert_eq!((census.attracting, census.waiting), (0, alive), "case {case}: a marker is lost");
                ended += 1;
            }
        }
    }
    assert!(ended > 300, "only {ended} growths were followed to their end");
}

/// Closed venation, all nodes against all markers, every step: relative neighbours straight from their definition.
struct ClosedReference {
    params: GrowthParams,
    extent: Vec2,
    nodes: Vec<(Vec2, u32)>,
    markers: Vec<ClosedMarker>,
    links: Vec<(u32, u32)>,
}

struct ClosedMarker {
    pos: Vec2,
    alive: bool,
    /// The node that reached it, and what it attracts since then.
    reached: Option<(usize, Vec<usize>)>,
    seen: usize,
}

impl ClosedReference {
    fn is_on(&self, marker: Vec2, node: usize, child: usize) -> bool {
        let (before, after) =
            (self.nodes[node].0.distance_squared(marker), self.nodes[child].0.distance_squared(marker));
        let p = &self.params;
        after <= p.kill_distance * p.kill_distance || after <= before - 0.25 * p.step_length * p.step_length
    }

    /// Relative neighbours of a marker among the first `n` nodes.
    fn neighbours(&self, marker: Vec2, n: usize) -> Vec<usize> {
        let p = &self.params;
        let to = |node: usize| self.nodes[node].0.distance_squared(marker);
        let near: Vec<usize> = (0..n).filter(|&node| to(node) < p.crack_radius * p.crack_radius).collect();
        let is_neighbour = |&v: &usize| {
            let blocked = near
                .iter()
                .any(|&u| u != v && to(u) < to(v) && self.nodes[u].0.distance_squared(self.nodes[v].0) < to(v));
            let carried_on = near.iter().any(|&c| self.nodes[c].1 == v as u32 && self.is_on(marker, v, c));
            to(v) > p.kill_distance * p.kill_distance && !blocked && !carried_on
        };
        near.iter().copied().filter(is_neighbour).collect()
    }

    /// Shows every marker the nodes that it has not seen.
    fn look(&mut self) {
        let p = self.params.clone();
        let mut met = Vec::new();
        for node in 0..self.nodes.len() {
            for i in 0..self.markers.len() {
                let (pos, place, parent) = (self.markers[i].pos, self.nodes[node].0, self.nodes[node].1 as usize);
                let distance_sq = place.distance_squared(pos);
                if !self.markers[i].alive
                    || node < self.markers[i].seen
                    || distance_sq >= p.crack_radius * p.crack_radius
                {
                    continue;
                }
                let reaches = distance_sq <= p.kill_distance * p.kill_distance;
                if let Some((first, mut rest)) = self.markers[i].reached.take() {
                    if let Some(k) = rest.iter().position(|&v| v == parent && self.is_on(pos, v, node)) {
                        if reaches {
                            rest.remove(k);
                            met.push((node, i, (first as u32, node as u32)));
                        } else {
                            rest[k] = node;
                        }
                    }
                    self.markers[i].alive = !rest.is_empty();
                    self.markers[i].reached = Some((first, rest));
                } else if reaches {
                    let rest = self.neighbours(pos, node + 1);
                    self.markers[i].alive = !rest.is_empty();
                    self.markers[i].reached = Some((node, rest));
                }
            }
        }
        let n = self.nodes.len();
        self.markers.iter_mut().for_each(|marker| marker.seen = n);
        for (.., (a, b)) in met {
            if a != b && self.nodes[a as usize].1 != b && self.nodes[b as usize].1 != a {
                self.links.push((a, b));
            }
        }
    }

    fn step(&mut self) -> usize {
        let p = self.params.clone();
        let mut attracted: Vec<Vec<(f32, usize)>> = vec![Vec::new(); self.nodes.len()];
        for (id, marker) in self.markers.iter().enumerate().filter(|(_, marker)| marker.alive) {
            let all = match &marker.reached {
                Some((_, rest)) => rest.clone(),
                None => self.neighbours(marker.pos, self.nodes.len()),
            };
            for node in all {
                attracted[node].push((self.nodes[node].0.distance_squared(marker.pos), id));
            }
        }
        let before = self.nodes.len();
        for (node, set) in attracted.iter().enumerate().filter(|(_, set)| !set.is_empty()) {
            let to = child_of(&p, self.extent, on_its_way(&self.nodes, node), set, |id| self.markers[id].pos, 0.0);
            self.nodes.push((to, node as u32));
        }
        self.look();
        self.nodes.len() - before
    }
}

#[test]
fn closed_venation_equals_brute_force() {
    let (mut ended, mut met) = (0, 0);
    for case in 0..200u64 {
        let mut rng = Rng::new(case).stream("closed");
        let step_length = rng.range(0.02, 0.1);
        let params = GrowthParams {
            venation: Venation::Closed,
            step_length,
            kill_distance: rng.range(0.01, 0.08),
            crack_radius: rng.range(0.1, 0.5),
            markers: MarkerLayout::DartThrowing { spacing: rng.range(0.12, 0.3) },
            starts: if rng.unit() < 0.5 { StartLayout::Point } else { StartLayout::Points { count: 5 } },
            reach: 1.0,
            wander: 0.0,
            inertia: if case % 2 == 0 { 0.0 } else { rng.range(0.0, 6.0) },
            directed: if case % 3 == 0 { 0.0 } else { rng.unit() },
            num_iterations: 100_000,
            ..GrowthParams::DEFAULT
        };
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        let mut reference =
            ClosedReference { params, extent, nodes: Vec::new(), markers: Vec::new(), links: Vec::new() };
        for hit in 0..2 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, 1.0);
            let known = reference.nodes.len();
            reference.nodes.extend(growth.network().nodes()[known..].iter().map(|node| (node.pos, node.parent)));
            // The markers that are there already see the start at once, the new ones with the first step.
            reference.look();
            let new =
                growth.field.unsettled().map(|(pos, _)| ClosedMarker { pos, alive: true, reached: None, seen: 0 });
            reference.markers.extend(new);
            reference.look();
            let steps = if hit == 1 { 400 } else { 1 + rng.next_u32() % 12 };
            for step in 0..steps {
                let born = growth.step().born as usize;
                assert_eq!(born, reference.step(), "case {case}, hit {hit}, step {step}");
                let mine: Vec<_> = growth.network().nodes().iter().map(|node| (node.pos, node.parent)).collect();
                assert_eq!(mine, reference.nodes, "case {case}, hit {hit}, step {step}");
                if born == 0 || mine.len() > 600 {
                    break;
                }
            }
        }
        let (mut mine, mut theirs): (Vec<_>, Vec<_>) =
            (growth.network().links().iter().map(|link| (link.a, link.b)).collect(), reference.links.clone());
        mine.sort_unstable();
        theirs.sort_unstable();
        assert_eq!(mine, theirs, "case {case}: what came together");
        met += mine.len();
        ended += u32::from(!growth.is_growing());
    }
    assert!(ended > 150 && met > 1000, "{ended} growths ended, {met} pairs met");
}
