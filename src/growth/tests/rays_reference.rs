//! Rays, arrest, inertia and rings against brute force: all markers against all nodes, every line against every other, at every step.

use super::{random_extent, rays::random_rays};
use crate::{
    CrackPreset,
    growth::{
        CrackGrowth, GrowthParams,
        rays::{NO_RAY, RAY},
    },
    math::{Rng, hash_unit},
    pattern::{LinkKind, NO_PARENT, Network, SegmentId},
};
use glam::{DVec2, Vec2};

#[derive(Clone, Copy)]
struct Node {
    pos: Vec2,
    parent: u32,
    generation: u32,
    impact: u32,
    ray: u32,
    sealed: bool,
}

struct Marker {
    pos: Vec2,
    ray: u32,
    alive: bool,
    given_up: u32,
    /// The node that it was taken from.
    from: Option<usize>,
}

/// A line of a ring: its corners, by ray and generation, and the nodes that have come to be there.
struct Chord {
    corners: [(u32, u32); 2],
    ends: [Option<u32>; 2],
}

/// A tip on its way along a ring: it waits, and has so many steps.
#[derive(Clone, Copy)]
struct Walker {
    tip: u32,
    to: u32,
    wait: u32,
    steps_left: u32,
}

struct Reference {
    params: GrowthParams,
    extent: Vec2,
    seed: u64,
    /// Only for the rough lines.
    drafts: Network,
    nodes: Vec<Node>,
    links: Vec<(u32, u32, LinkKind)>,
    lines: Vec<((u32, u32), Vec<Vec2>)>,
    markers: Vec<Marker>,
    /// The last generation of each ray.
    last: Vec<u32>,
    forks: Vec<((u32, u32), u32, Vec2)>,
    chords: Vec<Chord>,
    walkers: Vec<Walker>,
}

fn distance_to_piece(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let share = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a + (b - a) * share)
}

fn distance((a, b): (DVec2, DVec2), (c, d): (DVec2, DVec2)) -> f64 {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p) > 0.0;
    if side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b) {
        return 0.0;
    }
    let ends = [(a, c, d), (b, c, d), (c, a, b), (d, a, b)];
    ends.into_iter().map(|(p, q, r)| distance_to_piece(p, q, r)).fold(f64::INFINITY, f64::min)
}

impl Reference {
    /// What a hit has laid out: starts, rim, markers, and the plan of its rays.
    fn take_hit(&mut self, growth: &CrackGrowth, is_over: bool) {
        let network = growth.network();
        if is_over {
            self.forks.clear();
            self.chords.clear();
        }
        for (i, node) in network.nodes().iter().enumerate().skip(self.nodes.len()) {
            let ray = growth.field.ray_of.get(i).copied().unwrap_or(NO_RAY);
            let sealed = growth.arrest.as_ref().is_some_and(|arrest| arrest.is_sealed(i as u32));
            let (pos, parent, generation, impact) = (node.pos, node.parent, node.generation, node.impact);
            self.nodes.push(Node { pos, parent, generation, impact, ray, sealed });
            self.draw(network, SegmentId::Branch(i as u32));
        }
        for (i, link) in network.links().iter().enumerate().skip(self.links.len()) {
            self.links.push((link.a, link.b, link.kind));
            self.draw(network, SegmentId::Link(i as u32));
        }
        let impact = growth.impacts().len() as u32 - 1;
        let Some(plan) = growth.plan_rays(impact, growth.reach_of(impact)) else { return };
        let first = self.last.len() as u32 | RAY;
        for (i, ray) in plan.rays.iter().enumerate() {
            self.last.push(ray.last);
            let name = first + i as u32;
            if let Some((from, generation)) = ray.from {
                let way = (ray.line[1] - ray.line[0]).normalize_or_zero();
                self.forks.push(((first + from as u32, generation), name, way));
            }
        }
        for chord in &plan.chords {
            let corners = [chord.from, chord.to].map(|(ray, generation)| (first + ray as u32, generation));
            self.chords.push(Chord { corners, ends: [None; 2] });
        }
        for marker in &mut self.markers {
            marker.from = None;
        }
        let new = growth.field.unsettled().filter(|(_, ray)| *ray >= first);
        self.markers.extend(new.map(|(pos, ray)| Marker { pos, ray, alive: true, given_up: 0, from: None }));
    }

    fn draw(&mut self, network: &Network, segment: SegmentId) {
        if let (Some(ends), Some(path)) = (network.ends(segment), network.path(segment)) {
            self.lines.push((ends, path.points().iter().map(|point| point.pos).collect()));
        }
    }

    /// Whether a line comes nearer than 0.0002 to another, or leaves a node that they share within 20 degrees of it.
    fn touches(&self, ends: (u32, u32), line: &[Vec2]) -> bool {
        let pieces = |ends: (u32, u32), line: &[Vec2]| -> Vec<_> {
            let last = line.len() - 2;
            let ends = move |i: usize| [(i == 0).then_some(ends.0), (i == last).then_some(ends.1)];
            line.windows(2).enumerate().map(|(i, p)| (p[0].as_dvec2(), p[1].as_dvec2(), ends(i))).collect()
        };
        let mine = pieces(ends, line);
        self.lines.iter().any(|(others, other)| {
            *others == ends || *others == (ends.1, ends.0) || {
                let theirs = pieces(*others, other);
                mine.iter().any(|&(a, b, ab)| {
                    theirs.iter().any(|&(c, d, cd)| {
                        let away = |i: usize, p: DVec2, q: DVec2| if i == 0 { q - p } else { p - q };
                        let shared = (0..2).flat_map(|i| (0..2).map(move |j| (i, j)));
                        let mut shared = shared.filter(|&(i, j)| ab[i].is_some() && ab[i] == cd[j]);
                        match shared.next() {
                            Some((i, j)) => {
                                let (u, v) = (away(i, a, b), away(j, c, d));
                                u.dot(v) > 0.94 * (u.length_squared() * v.length_squared()).sqrt()
                            }
                            None => distance((a, b), (c, d)) < 2e-4,
                        }
                    })
                })
            }
        })
    }

    /// The roughest line that touches no other.
    fn free_line(&self, segment: SegmentId, ends: (u32, u32), places: (Vec2, Vec2)) -> Option<Vec<Vec2>> {
        [1.0, 0.4, 0.0].into_iter().find_map(|bend| {
            let path = self.drafts.draft(segment, places, (0.0, 0.0), bend);
            let line: Vec<Vec2> = path.points().iter().map(|point| point.pos).collect();
            let pieces: Vec<_> = line.windows(2).map(|p| (p[0].as_dvec2(), p[1].as_dvec2())).collect();
            let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p) > 0.0;
            let cross = |(a, b): (DVec2, DVec2), (c, d): (DVec2, DVec2)| {
                side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b)
            };
            let twisted = (2..pieces.len()).any(|i| pieces[..i - 1].iter().any(|&earlier| cross(earlier, pieces[i])));
            (!twisted && !self.touches(ends, &line)).then_some(line)
        })
    }

    fn heading(&self, node: u32) -> Vec2 {
        let Node { pos, parent, .. } = self.nodes[node as usize];
        self.nodes.get(parent as usize).map_or(Vec2::ZERO, |before| (pos - before.pos).normalize_or_zero())
    }

    fn is_same_crack(&self, a: u32, b: u32) -> bool {
        let (a, b) = (self.nodes[a as usize], self.nodes[b as usize]);
        let are_starts = a.parent == NO_PARENT && b.parent == NO_PARENT;
        a.impact == b.impact && (are_starts || (a.ray != NO_RAY && a.ray == b.ray))
    }

    fn join(&mut self, node: u32, tip: u32, kind: LinkKind) -> bool {
        let segment = SegmentId::Link(self.links.len() as u32);
        let places = (self.nodes[node as usize].pos, self.nodes[tip as usize].pos);
        let line = if node == tip { None } else { self.free_line(segment, (node, tip), places) };
        if let Some(line) = line {
            self.lines.push(((node, tip), line));
            self.links.push((node, tip, kind));
            return true;
        }
        false
    }

    /// Joins a tip to one of the five nodes that lie best: near, and straight ahead.
    fn join_near(&mut self, tip: u32, heading: Vec2, reach: f32) -> bool {
        let (pos, length) = (self.nodes[tip as usize].pos, self.params.step_length);
        let mut near = Vec::new();
        for node in 0..self.nodes.len() as u32 {
            let place = self.nodes[node as usize].pos;
            let distance_sq = place.distance_squared(pos);
            let (way, distance) = (place - pos, distance_sq.sqrt());
            if distance_sq > 0.0
                && distance_sq <= (reach * length) * (reach * length)
                && !self.is_same_crack(tip, node)
                && way.dot(heading) > 0.5 * heading.length() * distance
            {
                let slant = 1.0 - way.dot(heading) / (distance * heading.length());
                near.push((distance / length + 3.0 * slant, node));
            }
        }
        near.sort_by(|a, b| a.partial_cmp(b).unwrap());
        near.into_iter().take(5).any(|(_, node)| self.join(node, tip, LinkKind::Junction))
    }

    /// Joins a tip to the crack that is within 1.6 segments ahead of it, if there is one.
    fn ends_soon(&mut self, from: u32, heading: Vec2) -> bool {
        let pos = self.nodes[from as usize].pos;
        let far = (pos + heading * (1.6 * self.params.step_length)).clamp(Vec2::ZERO, self.extent);
        far.distance(pos) > 1e-4
            && self.touches((from, u32::MAX), &[pos, far])
            && self.join_near(from, heading, 1.6 + 0.5)
    }

    fn extend(&mut self, from: u32, to: Vec2, sealed: bool) -> Option<u32> {
        let (node, child, length) = (self.nodes[from as usize], self.nodes.len() as u32, self.params.step_length);
        let mut to = to.clamp(Vec2::ZERO, self.extent);
        for axis in 0..2 {
            let inward = (0.3 * length).min(0.5 * self.extent[axis]);
            for (border, inside) in [(0.0, inward), (self.extent[axis], self.extent[axis] - inward)] {
                if node.pos[axis] == border && to[axis] == border {
                    to[axis] = inside;
                }
            }
            if to[axis] < 1e-5 {
                to[axis] = 0.0;
            } else if to[axis] > self.extent[axis] - 1e-5 {
                to[axis] = self.extent[axis];
            }
        }
        if let Some(line) = self.free_line(SegmentId::Branch(child), (from, u32::MAX), (node.pos, to)) {
            self.lines.push(((from, child), line));
            let on_border = (0..2).any(|axis| to[axis] == 0.0 || to[axis] == self.extent[axis]);
            let Node { generation, impact, ray, .. } = node;
            let generation = generation + 1;
            let is_last = ray != NO_RAY && generation >= self.last[(ray & !RAY) as usize];
            let sealed = sealed || on_border || is_last;
            self.nodes.push(Node { pos: to, parent: from, generation, impact, ray, sealed });
            return Some(child);
        }
        let nearer = 0.5 * (node.pos + to);
        let tip = if to.distance(node.pos) > 0.6 * length { self.extend(from, nearer, true) } else { None };
        if let Some(tip) = tip {
            self.join_near(tip, to - nearer, 1.5);
        } else if self.nodes.len() == child as usize {
            self.join_near(from, to - node.pos, 1.5);
        }
        None
    }

    fn put_on(&mut self, node: u32, ray: u32) {
        let node = &mut self.nodes[node as usize];
        node.ray = ray;
        node.sealed |= ray != NO_RAY && node.generation >= self.last[(ray & !RAY) as usize];
    }

    /// Where the child of a node lies that `set` pulls, and whether that serves a marker; the way to the closest of them.
    fn aim(&self, node: u32, set: &[usize], child: u64) -> (Vec2, bool, usize) {
        let (p, from) = (&self.params, self.nodes[node as usize]);
        let (length, kill) = (p.step_length, p.kill_distance);
        let is_start = from.parent == NO_PARENT;
        let before = self.heading(node);
        let (mut sum, mut seen) = ([0i64; 2], false);
        let distance_sq = |id: usize| self.markers[id].pos.distance_squared(from.pos);
        for &id in set {
            let (way, distance) = (self.markers[id].pos - from.pos, distance_sq(id).sqrt());
            if before == Vec2::ZERO || before.dot(way) >= 0.94 * distance {
                let towards = way * (16_777_216.0 / distance);
                sum[0] += i64::from(towards.x as i32);
                sum[1] += i64::from(towards.y as i32);
                seen = true;
            }
        }
        let closest =
            set.iter().copied().min_by(|&a, &b| (distance_sq(a), a).partial_cmp(&(distance_sq(b), b)).unwrap());
        let closest = closest.unwrap();
        let mut way = Vec2::new(sum[0] as f32, sum[1] as f32).normalize_or_zero();
        if p.inertia > 0.0 && before.dot(way) > 0.0 {
            way = (way + before * p.inertia).normalize_or_zero();
        }
        if p.wander > 0.0 {
            let stray = 2.0 * hash_unit(self.seed ^ 0x57A6, child) - 1.0;
            way = (way + way.perp() * (p.wander * stray)).normalize_or_zero();
        }
        if before != Vec2::ZERO && before.dot(way) < 0.5 {
            let across = if before.perp_dot(way) < 0.0 { -before.perp() } else { before.perp() };
            way = before * 0.5 + across * 0.866_025_4;
        }
        let mut to = from.pos + way * length;
        let far = from.pos + way * (length + kill);
        let mut share = 1.0f32;
        for axis in 0..2 {
            if far[axis] < 0.0 {
                share = share.min(-from.pos[axis] / (far[axis] - from.pos[axis]));
            } else if far[axis] > self.extent[axis] {
                share = share.min((self.extent[axis] - from.pos[axis]) / (far[axis] - from.pos[axis]));
            }
        }
        if share < 1.0 {
            to = (from.pos + (far - from.pos) * share).clamp(Vec2::ZERO, self.extent);
        }
        let serves = set.iter().any(|&id| {
            let after = self.markers[id].pos.distance_squared(to);
            after <= kill * kill || after <= distance_sq(id) - 0.25 * length * length
        });
        if !is_start && (!seen || sum == [0, 0]) {
            return (to, false, closest);
        }
        if !serves && is_start {
            let (goal, distance) = (self.markers[closest].pos, distance_sq(closest).sqrt());
            let to = if distance <= length { goal } else { from.pos + (goal - from.pos) * (length / distance) };
            return (to, true, closest);
        }
        (to, serves, closest)
    }

    fn step(&mut self) {
        let (radius, kill) = (self.params.crack_radius, self.params.kill_distance);
        let mut pulled: Vec<Vec<usize>> = vec![Vec::new(); self.nodes.len()];
        for (id, marker) in self.markers.iter_mut().enumerate().filter(|(_, marker)| marker.alive) {
            let own = self.nodes.iter().enumerate().filter(|(_, node)| node.ray == marker.ray);
            let near = own.map(|(i, node)| (node.pos.distance_squared(marker.pos), i));
            let near = near.filter(|(distance_sq, _)| *distance_sq < radius * radius);
            let Some((distance_sq, node)) = near.min_by(|a, b| a.partial_cmp(b).unwrap()) else { continue };
            if distance_sq <= kill * kill {
                marker.alive = false;
            } else if marker.from != Some(node) {
                pulled[node].push(id);
            }
        }
        let first = self.nodes.len();
        let order = (0..first as u32).filter(|&node| !pulled[node as usize].is_empty());
        let aims: Vec<_> = order
            .zip(first as u64..)
            .map(|(node, child)| (node, self.aim(node, &pulled[node as usize], child)))
            .collect();
        for (node, (to, serves, closest)) in aims {
            let Node { pos, sealed, .. } = self.nodes[node as usize];
            let heading = (to - pos).normalize_or_zero();
            let stopped = if sealed {
                Some(Vec2::ZERO)
            } else if !serves {
                Some((self.markers[closest].pos - pos).normalize_or_zero())
            } else if self.ends_soon(node, heading) {
                self.nodes[node as usize].sealed = true;
                Some(heading)
            } else if self.extend(node, to, false).is_some() {
                None
            } else {
                Some(heading)
            };
            let Some(stopped) = stopped else { continue };
            for &id in &pulled[node as usize] {
                let marker = &mut self.markers[id];
                if id == closest || (marker.pos - pos).dot(stopped) >= 0.0 {
                    marker.from = Some(node as usize);
                    marker.given_up += 1;
                    marker.alive &= marker.given_up < 4;
                }
            }
        }
        let mut node = first;
        while node < self.nodes.len() {
            self.branch_off(node as u32);
            node += 1;
        }
        for walker in std::mem::take(&mut self.walkers) {
            let on = self.walk(walker);
            self.walkers.extend(on);
        }
    }

    fn branch_off(&mut self, node: u32) {
        let Node { pos, ray, generation, .. } = self.nodes[node as usize];
        if ray == NO_RAY {
            return;
        }
        for (_, ray, way) in self.forks.clone().into_iter().filter(|fork| fork.0 == (ray, generation)) {
            if let Some(child) = self.extend(node, pos + way * self.params.step_length, false) {
                self.put_on(child, ray);
            }
        }
        for chord in &mut self.chords {
            let Some(end) = chord.corners.iter().position(|corner| *corner == (ray, generation)) else { continue };
            chord.ends[end] = Some(node);
            if let [Some(tip), Some(to)] = chord.ends {
                let apart = self.nodes[tip as usize].pos.distance(self.nodes[to as usize].pos);
                let steps_left = (1.5 * apart / self.params.step_length) as u32 + 2;
                self.walkers.push(Walker { tip, to, wait: 2, steps_left });
            }
        }
    }

    fn walk(&mut self, mut walker: Walker) -> Option<Walker> {
        if walker.wait > 0 {
            return Some(Walker { wait: walker.wait - 1, ..walker });
        }
        let (from, to) = (self.nodes[walker.tip as usize].pos, self.nodes[walker.to as usize].pos);
        let segments = (from.distance(to) / self.params.step_length - 0.01).ceil().max(1.0);
        if segments == 1.0 {
            if !self.join(walker.to, walker.tip, LinkKind::Connection) {
                self.join_near(walker.tip, to - from, 1.5);
            }
            return None;
        }
        walker.steps_left = walker.steps_left.checked_sub(1)?;
        if segments > 2.0 && self.ends_soon(walker.tip, (to - from).normalize_or_zero()) {
            return None;
        }
        let stray = self.params.wander * (2.0 * hash_unit(self.seed ^ 0xC1, self.nodes.len() as u64) - 1.0);
        let way = (to - from) / segments;
        walker.tip = self.extend(walker.tip, from + way + way.perp() * stray, true)?;
        self.put_on(walker.tip, NO_RAY);
        Some(walker)
    }
}

/// Grows three hits both ways, some steps after each and in the end all, and compares every node and link after every step.
fn compare(params: GrowthParams, extent: Vec2, case: u64, name: &str) -> (usize, usize) {
    let mut rng = Rng::new(case).stream("rays against brute force");
    let mut growth = CrackGrowth::new(params, extent, case).unwrap();
    // As varied by the seed.
    let params = growth.params().clone();
    let mut slow = Reference {
        drafts: Network::new(extent, params.roughness, case).with_distortion(params.distortion),
        params,
        extent,
        seed: case,
        nodes: Vec::new(),
        links: Vec::new(),
        lines: Vec::new(),
        markers: Vec::new(),
        last: Vec::new(),
        forks: Vec::new(),
        chords: Vec::new(),
        walkers: Vec::new(),
    };
    for hit in 0..3 {
        let is_over = !growth.is_growing();
        growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, rng.range(0.3, 1.2));
        if growth.impacts().len() <= hit {
            break;
        }
        slow.take_hit(&growth, is_over);
        let steps = if hit == 2 { u32::MAX } else { rng.next_u32() % 90 };
        for step in 0..steps {
            let before = growth.network().nodes().len();
            let born = growth.step().born as usize;
            // What is only on its way, or given up, takes steps that are not seen from outside.
            for _ in 0..200 {
                slow.step();
                if slow.nodes.len() > before || born == 0 && slow.walkers.is_empty() {
                    break;
                }
            }
            let mine: Vec<_> = growth.network().nodes().iter().map(|node| (node.pos, node.parent)).collect();
            let theirs: Vec<_> = slow.nodes.iter().map(|node| (node.pos, node.parent)).collect();
            // After the last step a hit from which nothing grew shows all the same.
            if growth.is_growing() || mine.len() == theirs.len() {
                assert_eq!(mine, theirs, "{name}, case {case}, hit {hit}, step {step}");
                let mine: Vec<_> = growth.network().links().iter().map(|link| (link.a, link.b, link.kind)).collect();
                assert_eq!(mine, slow.links, "{name}, case {case}, hit {hit}, step {step}");
            }
            if born == 0 || !growth.is_growing() {
                break;
            }
        }
        if !growth.is_growing() && growth.network().nodes().len() != slow.nodes.len() {
            break;
        }
    }
    (slow.nodes.len(), slow.links.len())
}

#[test]
fn the_presets_with_rays_equal_brute_force() {
    let (mut nodes, mut links) = (0, 0);
    for (name, preset) in
        [("glass", CrackPreset::GLASS), ("laminated_glass", CrackPreset::LAMINATED_GLASS), ("ice", CrackPreset::ICE)]
    {
        for case in 0..4 {
            let extent = if case == 1 { Vec2::new(3.0, 1.0) } else { Vec2::ONE };
            let (some, joined) = compare(preset.growth.clone(), extent, case, name);
            (nodes, links) = (nodes + some, links + joined);
        }
    }
    assert!(nodes > 12_000 && links > 500, "{nodes} nodes, {links} links");
}

#[test]
fn rays_equal_brute_force() {
    let (mut nodes, mut links) = (0, 0);
    for case in 0..60 {
        let mut rng = Rng::new(case).stream("random rays");
        let mut params = random_rays(&mut rng);
        params.step_length = params.step_length.max(0.02);
        params.crack_radius = params.crack_radius.max(0.05);
        let (some, joined) = compare(params, random_extent(&mut rng), case, "random");
        (nodes, links) = (nodes + some, links + joined);
    }
    println!("{nodes} nodes, {links} links");
    assert!(nodes > 20_000 && links > 2_500, "{nodes} nodes, {links} links");
}
