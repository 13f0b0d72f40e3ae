//! The plan of the rays of a hit: the markers of each ray, where it forks, and the rings between rays.

use super::{
    draws,
    params::{GrowthParams, MarkerLayout, StartLayout},
    ray_lines::RayLines,
};
use crate::math::{Rng, hash_unit, mix, ops};
use glam::Vec2;
use std::f32::consts::TAU;

/// The number of rays is proportional to this power of the energy: four times as many at 22 times the energy.
const BY_ENERGY: f32 = 0.45;

/// The same for the forks of each ray.
const FORKS_BY_ENERGY: f32 = 0.6;

/// The largest number of rays of one hit, forks included, if their runs are not very short.
const MOST_RAYS: usize = 400;

/// About the largest number of points of all rays of one hit: rays of very short runs are fewer.
const MOST_POINTS: f32 = 131_072.0;

/// How often one ray tries to fork, at the most.
const MOST_TRIES: u32 = 256;

/// The largest number of rings of one hit.
pub(super) const MOST_RINGS: u32 = 24;

/// The longest line of a ring between two rays, pattern units.
pub(super) const LONGEST_CHORD: f32 = 1.0;

/// The widest angle between two rays that a ring bridges, radians: a line across a wider angle would come too near to
/// the hit.
const WIDEST: f32 = 1.4;

/// Largest length of a line of a ring, in units of the distance to the next ring.
const WIDER: f32 = 2.5;

/// A border nearer than this (pattern units) gets fewer rays.
const NEAR: f32 = 0.3;

/// A hit with less room has fewer rays in total, by this power of the room. A linear reduction would leave too few in
/// a corner.
const FEWER: f32 = 0.35;

/// Length of the first straight run of a ray, pattern units; the following ones are longer and longer.
const FIRST_RUN: f32 = 0.03;
const RUN_GROWTH: f32 = 1.5;

/// Largest turn of a ray between two runs, radians.
const KINK: f32 = 0.07;

/// The share of a ray along which it can fork.
const FORKING: f32 = 0.6;

/// The smallest angle of a fork, radians: at a smaller one both branches would merge.
const LEAST_FORK: f32 = 0.42;

/// A ray forks only where no other ray is this near to the first part of the fork; pattern units.
const ROOMY: f32 = 0.045;

/// One ray.
#[derive(Clone, Debug)]
pub(super) struct Ray {
    /// The ray from which it forks and the generation at the fork; `None` for rays that start at the hit.
    pub(super) from: Option<(usize, u32)>,
    /// Its planned line, with start and kinks; there are markers at all points except the first.
    pub(super) line: Vec<Vec2>,
    /// The generation of its last node, if it ends on the surface.
    pub(super) last: u32,
}

/// A place on the rim of the crushed zone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rim {
    pub(super) pos: Vec2,
    /// The ray that starts there.
    pub(super) ray: Option<usize>,
    /// Whether the rim continues to the next place, and not along the border.
    pub(super) goes_on: bool,
}

/// A line of a ring, from a generation of one ray to one of another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    pub(super) from: (usize, u32),
    pub(super) to: (usize, u32),
}

/// The complete plan of one hit.
#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    pub(super) rim: Vec<Rim>,
    pub(super) rays: Vec<Ray>,
    pub(super) chords: Vec<Chord>,
}

/// The hit for which rays are planned.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlannedHit {
    pub(super) pos: Vec2,
    pub(super) energy: f32,
    /// Its reach, pattern units.
    pub(super) reach: f32,
    pub(super) seed: u64,
}

/// Distance from `pos` to the border in this direction.
fn to_border(pos: Vec2, way: Vec2, extent: Vec2) -> f32 {
    let along = |pos: f32, way: f32, extent: f32| {
        if way > 1e-6 {
            (extent - pos) / way
        } else if way < -1e-6 {
            -pos / way
        } else {
            f32::INFINITY
        }
    };
    along(pos.x, way.x, extent.x).min(along(pos.y, way.y, extent.y)).max(0.0)
}

fn is_inside(pos: Vec2, extent: Vec2) -> bool {
    pos.cmpge(Vec2::ZERO).all() && pos.cmple(extent).all()
}

/// Radius of the rim at which the rays of a hit start.
fn rim_radius(params: &GrowthParams, energy: f32) -> f32 {
    match params.starts {
        StartLayout::Crushed { radius, .. } => radius * energy.sqrt().sqrt(),
        StartLayout::Ring { radius, .. } | StartLayout::Disc { radius, .. } => radius,
        StartLayout::Point | StartLayout::Points { .. } | StartLayout::Arms { .. } => 0.5 * params.step_length,
    }
}

impl Plan {
    /// The rays of a hit, `None` if the layout has none.
    pub(super) fn new(params: &GrowthParams, hit: PlannedHit, extent: Vec2) -> Option<Self> {
        let MarkerLayout::Rays { sectors, jitter, through } = params.markers else { return None };
        let mut rng = Rng::new(hit.seed).stream("rays");
        let PlannedHit { pos, energy, reach, .. } = hit;
        let radius = rim_radius(params, energy);
        let count = (sectors as f32 * ops::powf(energy, BY_ENERGY), most_rays(params, extent));
        let angles = directions(hit, extent, count, jitter, &mut rng);
        let mut plan = Self::default();
        let (n, phase) = (angles.len(), rng.unit());
        let runs_through =
            |i: usize| ((i + 1) as f32 + phase) * through >= ((i as f32 + phase) * through).floor() + 1.0;
        for (i, &angle) in angles.iter().enumerate() {
            let angle = ops::atan2(params.direct(ops::unit(angle)).y, params.direct(ops::unit(angle)).x);
            let way = ops::unit(angle);
            let room = to_border(pos, way, extent);
            // Few of the rays are long.
            let draw = rng.unit();
            let length = reach * (0.16 + 0.84 * draw * draw * draw.sqrt());
            let ends = !runs_through(i) && length + 0.1 < room;
            let start = pos + way * radius;
            plan.rim.push(Rim { pos: start, ray: Some(i), goes_on: true });
            let mut last = u32::MAX;
            if ends {
                last = ((length - radius) / params.step_length).round().max(2.0) as u32;
                let is_free = rng.unit() < params.open_ends;
                if !is_free && params.draw_connections {
                    // It ends at a ring.
                    let ring = (1..=MOST_RINGS)
                        .take_while(|&ring| radius + ring_generation(params, ring) as f32 * params.step_length <= reach)
                        .min_by_key(|&ring| ring_generation(params, ring).abs_diff(last));
                    last = ring.map_or(u32::MAX, |ring| corner(params, hit.seed, i, ring, jitter));
                }
            }
            let line = line(params, (start, angle), last, extent, jitter, &mut rng);
            plan.rays.push(Ray { from: None, line, last });
        }
        plan.fork(params.forks * ops::powf(energy, FORKS_BY_ENERGY), params, extent, jitter, &mut rng);
        plan.clip_rim(pos, radius, extent);
        if params.draw_connections && n > 1 {
            plan.add_rings(params, hit, radius, extent, jitter);
        }
        Some(plan)
    }

    /// Adds forks to the rays that run through.
    fn fork(&mut self, forks: f32, params: &GrowthParams, extent: Vec2, jitter: f32, rng: &mut Rng) {
        let most = most_rays(params, extent);
        let mut lines = RayLines::new(extent, ROOMY);
        self.rays.iter().enumerate().for_each(|(i, ray)| lines.add(i, &ray.line));
        let mut next = 0;
        let mut share = forks;
        let angle = params.fork_angle.max(LEAST_FORK);
        let mut end = self.rays.len();
        // Forks can fork again, half as often.
        for _ in 0..3 {
            while next < end && self.rays.len() < most {
                let Ray { line: main, last, from } = &self.rays[next];
                let arc: f32 = main.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
                let base = from.map_or(0, |(_, generation)| generation);
                let (main, last) = (main.clone(), *last);
                let first_side = if rng.unit() < 0.5 { 1.0 } else { -1.0 };
                let count = ((share * FORKING * arc / params.step_length + rng.unit()) as u32).min(MOST_TRIES);
                for i in 0..count {
                    let from = (0.16 + FORKING * (i as f32 + rng.unit()) / count as f32) * arc;
                    let nodes = (from / params.step_length).round();
                    let generation = base + nodes as u32;
                    let bend = angle * rng.range(0.86, 1.14);
                    let side = if i % 2 == 0 { first_side } else { -first_side };
                    if last < u32::MAX || nodes < 4.0 {
                        continue;
                    }
                    let (at, way) = along(&main, nodes * params.step_length);
                    // Not so near to the border that it would cut off a splinter.
                    let room = to_border(at, way, extent);
                    if !is_inside(at, extent) || room < 0.12 {
                        continue;
                    }
                    // To the side with more room.
                    let heading = ops::atan2(way.y, way.x);
                    let is_roomy = |heading: &f32| {
                        [1.5, 3.0].into_iter().all(|far| {
                            let ahead = at + ops::unit(*heading) * (far * ROOMY / ops::sin(bend)).min(0.7 * room);
                            lines.is_clear(ahead, next)
                        })
                    };
                    let Some(heading) = [heading + side * bend, heading - side * bend].into_iter().find(is_roomy)
                    else {
                        continue;
                    };
                    let line = line(params, (at, heading), u32::MAX, extent, jitter, rng);
                    lines.add(self.rays.len(), &line);
                    self.rays.push(Ray { from: Some((next, generation)), line, last: u32::MAX });
                }
                next += 1;
            }
            end = self.rays.len();
            share *= 0.5;
        }
    }

    /// Clips the rim at the border if the hit is near to it.
    fn clip_rim(&mut self, center: Vec2, radius: f32, extent: Vec2) {
        let on_circle = |angle: f32| center + ops::unit(angle) * radius;
        if is_inside(center - radius, extent) && is_inside(center + radius, extent) {
            return;
        }
        let angle = |rim: &Rim| ops::atan2(rim.pos.y - center.y, rim.pos.x - center.x);
        let all: Vec<(f32, Rim)> = self.rim.iter().map(|rim| (angle(rim), *rim)).collect();
        self.rim.clear();
        let n = all.len();
        // The intersection of the circle and the border, between an angle inside and one outside.
        let cut = |mut inside: f32, mut outside: f32| {
            for _ in 0..24 {
                let middle = 0.5 * (inside + outside);
                if is_inside(on_circle(middle), extent) { inside = middle } else { outside = middle }
            }
            let pos = on_circle(outside);
            pos.clamp(Vec2::ZERO, extent)
        };
        for (i, &(from, rim)) in all.iter().enumerate() {
            let is_in = is_inside(rim.pos, extent);
            if is_in {
                self.rim.push(rim);
            }
            // In short steps, because the circle may leave and re-enter the surface between two rays.
            let turn = (all[(i + 1) % n].0 - from).rem_euclid(TAU);
            let turn = if turn == 0.0 { TAU } else { turn };
            let steps = (turn / 0.1).ceil() as u32;
            let (mut before, mut was_in) = (from, is_in);
            for step in 1..=steps {
                let here = from + turn * step as f32 / steps as f32;
                let is_in = is_inside(on_circle(here), extent);
                if was_in && !is_in {
                    self.rim.push(Rim { pos: cut(before, here), ray: None, goes_on: false });
                } else if !was_in && is_in {
                    self.rim.push(Rim { pos: cut(here, before), ray: None, goes_on: true });
                }
                (before, was_in) = (here, is_in);
            }
        }
    }

    /// Adds rings: broken polygons whose corners lie on rays.
    fn add_rings(&mut self, params: &GrowthParams, hit: PlannedHit, radius: f32, extent: Vec2, jitter: f32) {
        let length = params.step_length;
        let mut corners: Vec<(f32, usize, u32, Vec2)> = Vec::new();
        for ring in 1..=MOST_RINGS {
            let generation = ring_generation(params, ring);
            let out = (radius + generation as f32 * length) / hit.reach;
            if out > 1.0 {
                break;
            }
            let gap = params.connection_every as f32 * ring as f32;
            corners.clear();
            for (i, ray) in self.rays.iter().enumerate() {
                let begins = ray.from.map_or(0, |(_, generation)| generation + 1);
                let generation = corner(params, hit.seed, i, ring, jitter);
                if generation <= begins + 1 || generation > ray.last {
                    continue;
                }
                let (at, _) = along(&ray.line, (generation - begins.saturating_sub(1)) as f32 * length);
                if is_inside(at - length, extent) && is_inside(at + length, extent) {
                    corners.push((ops::atan2(at.y - hit.pos.y, at.x - hit.pos.x), i, generation, at));
                }
            }
            corners.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let n = corners.len();
            for i in 0..if n == 2 { 1 } else { n } {
                let (one, other) = (corners[i], corners[(i + 1) % n]);
                let turn = (other.0 - one.0).rem_euclid(TAU);
                let apart = one.3.distance(other.3);
                if one.1 == other.1 || turn > WIDEST || apart > LONGEST_CHORD.min(WIDER * gap * length) {
                    continue;
                }
                let draw = |what: u64| hash_unit(mix(hit.seed ^ what << 32 ^ u64::from(ring) << 16), one.1 as u64);
                // A ray that ends on the surface ends at a ring.
                let (ends, other_ends) = (self.rays[one.1].last == one.2, self.rays[other.1].last == other.2);
                // Fewer lines further out, and across wide gaps.
                let wide = turn / WIDEST;
                let thin = 1.0 - (1.0 - out * out) * (1.0 - 0.8 * wide * wide);
                let missing = params.connection_gaps + (1.0 - params.connection_gaps) * thin;
                if (draw(1) < missing || apart < 2.0 * length) && !ends && !other_ends {
                    continue;
                }
                // Some rings have a step at a ray instead of continuing from the same place.
                let step = |is_end: bool, what: u64| {
                    let stray = if draw(what) < 0.45 * jitter { 0.5 * gap * (2.0 * draw(what + 1) - 1.0) } else { 0.0 };
                    if is_end { 0 } else { stray as i32 }
                };
                let from = (one.1, one.2.saturating_add_signed(step(ends, 2)).max(1));
                let to = (other.1, other.2.saturating_add_signed(step(other_ends, 4)).max(1));
                self.chords.push(if draw(6) < 0.5 { Chord { from, to } } else { Chord { from: to, to: from } });
            }
        }
    }
}

/// The generation of a ring: 1, 3, 6, 10 ... times `connection_every`, so rings are wider apart further out.
const fn ring_generation(params: &GrowthParams, ring: u32) -> u32 {
    params.connection_every.saturating_mul(ring * (ring + 1) / 2)
}

/// The generation at which a ring meets a ray: with a small random offset from that of the ring.
fn corner(params: &GrowthParams, seed: u64, ray: usize, ring: u32, jitter: f32) -> u32 {
    let gap = params.connection_every as f32 * ring as f32;
    let stray =
        0.45 * jitter * gap * (2.0 * hash_unit(mix(seed ^ draws::CORNER), (ray as u64) << 8 | u64::from(ring)) - 1.0);
    ring_generation(params, ring).saturating_add_signed(stray.round() as i32).max(1)
}

/// The directions of the rays of a hit: irregular, but all around; fewer where the border is near.
fn directions(hit: PlannedHit, extent: Vec2, (count, most): (f32, usize), jitter: f32, rng: &mut Rng) -> Vec<f32> {
    const BINS: usize = 96;
    let mut sums = [0.0; BINS + 1];
    for bin in 0..BINS {
        let room = to_border(hit.pos, ops::unit(TAU * (bin as f32 + 0.5) / BINS as f32), extent);
        let weight = if room < 1e-3 { 0.0 } else { (room / NEAR).clamp(0.12, 1.0) };
        sums[bin + 1] = sums[bin] + weight;
    }
    let all = sums[BINS];
    if all <= 0.0 {
        return Vec::new();
    }
    let count = (count * ops::powf(all / BINS as f32, FEWER)).round().clamp(2.0, most.min(360) as f32) as usize;
    let turn = rng.unit();
    let mut angles: Vec<f32> = (0..count)
        .map(|i| {
            let share = (i as f32 + turn + 0.8 * jitter * (rng.unit() - 0.5)) / count as f32;
            let sum = all * share.rem_euclid(1.0);
            let bin = sums.partition_point(|&below| below <= sum).clamp(1, BINS) - 1;
            let within = (sum - sums[bin]) / (sums[bin + 1] - sums[bin]).max(1e-6);
            TAU * (bin as f32 + within.clamp(0.0, 1.0)) / BINS as f32
        })
        .collect();
    angles.sort_unstable_by(f32::total_cmp);
    angles
}

/// The longest straight run of a ray: no marker may be out of reach of the one before.
const fn longest_run(params: &GrowthParams) -> f32 {
    0.6 * params.crack_radius
}

/// The largest number of rays of one hit, forks included.
fn most_rays(params: &GrowthParams, extent: Vec2) -> usize {
    let points = extent.length() / longest_run(params);
    MOST_RAYS.min((MOST_POINTS / points.max(1.0)) as usize).max(2)
}

/// A line of straight runs with slight kinks, up to a generation or to the border.
fn line(
    params: &GrowthParams,
    (start, angle): (Vec2, f32),
    last: u32,
    extent: Vec2,
    jitter: f32,
    rng: &mut Rng,
) -> Vec<Vec2> {
    let longest = longest_run(params);
    let mut line = vec![start];
    let (mut pos, mut run, mut stray) = (start, FIRST_RUN.min(longest), 0.0);
    // Beyond the last node, which is sealed (nothing grows from it).
    let mut left = if last == u32::MAX { f32::INFINITY } else { (last as f32 + 1.5) * params.step_length };
    for _ in 0..4096 {
        let way = ops::unit(angle + stray);
        let (room, length) = (to_border(pos, way, extent), run * rng.range(0.7, 1.3));
        if !is_inside(pos, extent) {
            break;
        }
        if room <= length.min(left) {
            // Beyond the border, else the marker would be reached before the border.
            line.push(pos + way * (room + 2.0 * params.kill_distance));
            break;
        }
        pos += way * length.min(left);
        line.push(pos);
        left -= length;
        if left <= 0.0 {
            break;
        }
        run = (run * RUN_GROWTH).min(longest);
        stray = 0.6 * stray + KINK * jitter * rng.signed();
    }
    line
}

/// The point at arc length `arc` of a line, and the direction there; extrapolated beyond its end.
fn along(line: &[Vec2], mut arc: f32) -> (Vec2, Vec2) {
    let mut way = Vec2::X;
    for (i, pair) in line.windows(2).enumerate() {
        let length = pair[0].distance(pair[1]);
        way = (pair[1] - pair[0]).normalize_or(way);
        if arc <= length || i + 2 == line.len() {
            return (pair[0] + way * arc, way);
        }
        arc -= length;
    }
    (line.first().copied().unwrap_or_default(), way)
}
