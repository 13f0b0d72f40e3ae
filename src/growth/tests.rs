//! Growth against a brute-force reference, its end, and its frozen patterns.

use super::{CrackGrowth, GrowthParams, HitOutcome, MAX_ENERGY, MarkerLayout, Rejected, StartLayout, Venation};
use crate::{
    CrackPreset, Grid,
    math::{Rng, hash_unit, mix},
    pattern::{CrackMask, LinkKind, Moment, NO_IMPACT, NO_PARENT, SegmentId, SurfaceFrame},
    raster::{DepthField, Profile, stamp_path},
    voronoi::{VoronoiBake, VoronoiParams},
};
use glam::{UVec2, Vec2};
use std::sync::Arc;

/// Random parameters that validate; `small` keeps the numbers of markers and nodes low.
fn random_params(rng: &mut Rng, small: bool) -> GrowthParams {
    let log = |rng: &mut Rng, low: f32, high: f32| low * crate::math::ops::powf(high / low, rng.unit());
    let step_length = if small { log(rng, 0.01, 0.6) } else { log(rng, 0.001, 4.0) };
    let crack_radius =
        log(rng, 0.3 * step_length, if small { 2.0 } else { 32.0 }).clamp(0.001, (256.0 * step_length).min(32.0));
    let grid = if small { 12.0 } else { 24.0 };
    let line_width = log(rng, 0.0005, 0.02);
    let count = 1 + (rng.unit() * 9.0) as u32;
    let radius = 0.3 * rng.unit();
    let params = GrowthParams {
        kill_distance: if small { log(rng, 0.003, 0.3) } else { log(rng, 0.0005, 4.0) }.min(crack_radius),
        step_length,
        crack_radius,
        num_iterations: 100_000,
        num_lines_grid: 1 + (rng.unit() * grid) as u32,
        num_columns_grid: 1 + (rng.unit() * grid) as u32,
        markers: match rng.next_u32() % 4 {
            0 | 1 => MarkerLayout::PseudoGrid { occupancy: rng.unit(), jitter: rng.unit() },
            2 => MarkerLayout::DartThrowing { spacing: 0.04 + 0.3 * rng.unit() },
            _ => MarkerLayout::Polar {
                sectors: 1 + rng.next_u32() % 20,
                rings: 1 + rng.next_u32() % 14,
                ring_growth: rng.range(0.5, 2.0),
                jitter: rng.unit(),
                occupancy: rng.unit(),
            },
        },
        focus: if rng.unit() < 0.5 { 0.0 } else { 4.0 * rng.unit() },
        reach: log(rng, 0.1, 4.0),
        starts: match rng.next_u32() % 4 {
            0 => StartLayout::Point,
            1 => StartLayout::Points { count },
            2 => StartLayout::Ring { count, radius },
            _ => StartLayout::Disc { count, radius },
        },
        line_width,
        line_growth: 2.0 * rng.unit(),
        murray: rng.range(1.0, 8.0),
        max_width: line_width + 0.2 * rng.unit(),
        wander: if rng.unit() < 0.5 { 0.0 } else { rng.unit() },
        roughness: 0.5 * rng.unit(),
        draw_connections: rng.unit() < 0.5,
        connection_gaps: rng.unit(),
        chips: 0.3 * rng.unit(),
        connection_every: 1 + rng.next_u32() % 4,
        draw_islands: rng.unit() < 0.5,
        island_distance: 0.2 * rng.unit(),
        open_ends: 0.5 * rng.unit(),
        arrest: 0.0,
        venation: Venation::Open,
        nucleation: 0.0,
        tip_taper: 0.0,
        unevenness: 0.0,
        inertia: 0.0,
        axis: 0.0,
        directed: 0.0,
        variety: 0.0,
        width_variety: 0.0,
        draw_markers: rng.unit() < 0.2,
        max_nodes: 1_000_000,
    };
    params.validate().expect("random parameters are valid");
    params
}

fn random_extent(rng: &mut Rng) -> Vec2 {
    match rng.next_u32() % 3 {
        0 => Vec2::ONE,
        1 => Vec2::new(1.0 + rng.unit(), 1.0),
        _ => Vec2::new(1.0, 1.0 + 3.0 * rng.unit()),
    }
}

/// The documented limits themselves are allowed, though 0.01 and 0.4 are not what they seem in single precision.
#[test]
fn limits_of_ranges_are_allowed() {
    let least = GrowthParams { reach: 0.01, step_length: 0.001, ..GrowthParams::DEFAULT };
    assert_eq!(least.validate(), Ok(()));
    let most = GrowthParams { line_width: 0.2, max_width: 0.4, reach: 64.0, ..GrowthParams::DEFAULT };
    assert_eq!(most.validate(), Ok(()));
    assert!(GrowthParams { reach: 0.00999, ..GrowthParams::DEFAULT }.validate().is_err());
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
        for (id, (marker, loyal, alive)) in self.markers.iter_mut().enumerate() {
            if !*alive {
                continue;
            }
            let (mut best, mut best_sq) = (usize::MAX, p.crack_radius * p.crack_radius);
            for (node, (pos, _)) in self.nodes.iter().enumerate() {
                let distance_sq = marker.distance_squared(*pos);
                if distance_sq < best_sq && (*loyal == u32::MAX || *loyal == self.impacts[node]) {
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
            let from = self.nodes[node].0;
            let mut sum = [0i64; 2];
            for &(distance_sq, id) in set {
                let towards = (self.markers[id].0 - from) * (16_777_216.0 / distance_sq.sqrt());
                sum[0] += i64::from(towards.x as i32);
                sum[1] += i64::from(towards.y as i32);
            }
            let mut direction = Vec2::new(sum[0] as f32, sum[1] as f32).normalize_or_zero();
            if p.wander > 0.0 {
                let stray = p.wander * (2.0 * hash_unit(self.seed ^ 0x57A6, self.nodes.len() as u64) - 1.0);
                direction = (direction + direction.perp() * stray).normalize_or_zero();
            }
            let mut to = from + direction * p.step_length;
            let far = from + direction * (p.step_length + p.kill_distance);
            let mut share = 1.0f32;
            for axis in 0..2 {
                if far[axis] < 0.0 {
                    share = share.min(-from[axis] / (far[axis] - from[axis]));
                } else if far[axis] > self.extent[axis] {
                    share = share.min((self.extent[axis] - from[axis]) / (far[axis] - from[axis]));
                }
            }
            if share < 1.0 {
                to = (from + (far - from) * share).clamp(Vec2::ZERO, self.extent);
            }
            let serves = set.iter().any(|&(distance_sq, id)| {
                let after = self.markers[id].0.distance_squared(to);
                after <= p.kill_distance * p.kill_distance
                    || after <= distance_sq - 0.25 * p.step_length * p.step_length
            });
            if !serves {
                let (closest_sq, id) = set.iter().copied().min_by(|a, b| a.partial_cmp(b).unwrap()).unwrap();
                let (marker, distance) = (self.markers[id].0, closest_sq.sqrt());
                to = if distance <= p.step_length {
                    marker
                } else {
                    from + (marker - from) * (p.step_length / distance)
                };
            }
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
        let params = random_params(&mut rng, true);
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        let mut reference =
            Reference { params, extent, seed: case, nodes: Vec::new(), impacts: Vec::new(), markers: Vec::new() };
        for hit in 0..3 {
            let pos = Vec2::new(rng.unit(), rng.unit()) * extent;
            growth.hit(pos, 0.2 + 2.0 * rng.unit());
            reference.markers.extend(growth.field.unsettled().map(|(pos, loyal)| (pos, loyal, true)));
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
                let census = growth.census();
                assert_eq!((census.attracting, census.waiting), (0, alive), "case {case}: a marker is lost");
                ended += 1;
            }
        }
    }
    assert!(ended > 300, "only {ended} growths were followed to their end");
}

#[test]
fn always_ends() {
    let mut most = 0.0f64;
    for case in 0..10_000u64 {
        let mut rng = Rng::new(case).stream("ends");
        let params = random_params(&mut rng, false);
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, 16.0 * rng.unit());
        let starts = growth.network().nodes().len() as u64;
        let bound = params.most_nodes(u64::from(growth.census().total), starts);
        let mut steps = 0u64;
        while growth.step().grew() {
            steps += 1;
            assert!(steps <= bound, "case {case}: {steps} steps, bound {bound}: {params:?}");
        }
        let census = growth.census();
        assert!(steps < u64::from(params.num_iterations), "case {case} was cut off: {params:?}");
        assert_eq!(census.attracting, 0, "case {case}: a marker is neither reached nor out of reach");
        assert_eq!(census.killed + census.waiting, census.total, "case {case}: {census:?}");
        let nodes = growth.network().nodes().len() as u64;
        assert!(nodes <= bound, "case {case}: {nodes} nodes, bound {bound}");
        most = most.max(nodes as f64 / bound as f64);
    }
    println!("the bound was met to {most:.3} at most");
}

/// The numbers that Couto et al. give for their figures, taken as pattern units.
#[test]
fn ends_on_the_numbers_of_the_paper() {
    // kill_distance, D, crack_radius, num_iterations, grid
    let figures = [
        (0.01, 0.2, 0.9, 100, 7),
        (0.1, 0.2, 0.9, 100, 7),
        (0.08, 0.1, 0.9, 100, 20),
        (0.08, 0.04, 0.9, 100, 20),
        (0.1, 0.2, 0.5, 100, 20),
        (0.1, 0.2, 20.0, 100, 20),
        (0.02, 0.2, 0.9, 80, 20),
        (0.08, 1.0, 0.9, 100, 7),
        (0.02, 0.8, 1.0, 80, 20),
        (0.08, 1.0, 0.4, 100, 7),
        (0.08, 0.8, 0.4, 100, 20),
        (0.01, 0.1, 0.9, 100, 100),
    ];
    for (figure, (kill_distance, step_length, crack_radius, _, grid)) in figures.into_iter().enumerate() {
        for scale in [1.0, 0.1, 0.02] {
            let params = GrowthParams {
                kill_distance: f32::max(kill_distance * scale, 0.0005),
                step_length: f32::max(step_length * scale, 0.001),
                crack_radius: crack_radius * scale,
                num_iterations: 100_000,
                num_lines_grid: grid,
                num_columns_grid: grid,
                reach: 2.0,
                max_nodes: 1_000_000,
                ..GrowthParams::DEFAULT
            };
            let mut growth = CrackGrowth::new(params.clone(), Vec2::ONE, 1).unwrap();
            growth.hit(Vec2::splat(0.5), 1.0);
            while growth.step().grew() {}
            assert!(growth.steps() < 100_000, "figure {figure} at scale {scale} was cut off");
            assert_eq!(growth.census().attracting, 0, "figure {figure} at scale {scale}");
        }
    }
}

/// FNV-1a over the bits of all nodes and links.
fn fingerprint(growth: &CrackGrowth) -> u64 {
    let network = growth.network();
    let nodes =
        network.nodes().iter().flat_map(|n| [n.pos.x.to_bits(), n.pos.y.to_bits(), n.width.to_bits(), n.parent]);
    let links = network.links().iter().flat_map(|link| [link.a, link.b, link.width.to_bits(), link.birth]);
    nodes.chain(links).fold(0xCBF2_9CE4_8422_2325, |hash, word| (hash ^ u64::from(word)).wrapping_mul(0x100_0000_01B3))
}

fn preset_run(preset: &CrackPreset, seed: u64) -> CrackGrowth {
    let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::new(1.5, 1.0), seed).unwrap();
    growth.hit(Vec2::new(0.6, 0.5), 1.0);
    for _ in 0..20 {
        growth.step();
    }
    growth.hit(Vec2::new(1.1, 0.3), 2.0);
    while growth.step().grew() {}
    growth
}

#[test]
fn same_bits_on_every_thread() {
    for preset in CrackPreset::NAMES.map(|name| CrackPreset::named(name).unwrap()) {
        let alone = fingerprint(&preset_run(&preset, 3));
        let handles: Vec<_> = (0..4)
            .map(|_| {
                let preset = preset.clone();
                std::thread::spawn(move || fingerprint(&preset_run(&preset, 3)))
            })
            .collect();
        for handle in handles {
            assert_eq!(handle.join().unwrap(), alone);
        }
    }
}

#[test]
fn invariants_of_the_network() {
    for case in 0..200u64 {
        let mut rng = Rng::new(case).stream("invariants");
        let params = random_params(&mut rng, true);
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        let (mut changed, mut painted) = (Vec::new(), std::collections::BTreeSet::new());
        for _ in 0..3 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, 1.0);
            while growth.step().grew() && growth.network().nodes().len() < 2000 {
                let before: Vec<f32> = growth.network().nodes().iter().map(|node| node.width).collect();
                growth.take_changed(&mut changed);
                painted.extend(changed.drain(..));
                assert!(before.iter().zip(growth.network().nodes()).all(|(width, node)| node.width >= *width));
            }
        }
        growth.take_changed(&mut changed);
        painted.extend(changed.drain(..));
        let all: std::collections::BTreeSet<SegmentId> = growth.network().segments().collect();
        assert_eq!(painted, all, "case {case}: every segment is told of, and no other");
        for (index, node) in growth.network().nodes().iter().enumerate() {
            assert!(node.parent == NO_PARENT || (node.parent as usize) < index, "case {case}: no cycles");
            assert!(node.pos.cmpge(Vec2::ZERO).all() && node.pos.cmple(extent).all(), "case {case}: {node:?}");
            assert!(node.width >= params.line_width && node.width <= params.max_width.max(params.line_width));
            if node.parent != NO_PARENT {
                let parent = growth.network().nodes()[node.parent as usize];
                assert_eq!(node.generation, parent.generation + 1);
                assert!(
                    node.pos.distance(parent.pos) <= (params.step_length + params.kill_distance) * 1.001,
                    "case {case}: a long segment"
                );
                assert!(parent.width >= node.width, "case {case}: no branch is wider than its trunk");
            }
        }
        for link in growth.network().links() {
            assert!(link.a != link.b);
            if link.kind == LinkKind::Island {
                let [a, b] = [link.a, link.b].map(|i| growth.network().nodes()[i as usize].pos);
                assert!(a.distance(b) <= params.island_distance * 1.001);
            }
        }
    }
}

#[test]
fn widening_a_branch_lists_its_children() {
    let mut growth = CrackGrowth::new(GrowthParams { line_growth: 2.0, ..Default::default() }, Vec2::ONE, 5).unwrap();
    growth.hit(Vec2::splat(0.5), 1.0);
    let mut changed = Vec::new();
    let mut widths: std::collections::BTreeMap<SegmentId, (u32, u32)> = Default::default();
    while growth.step().grew() {
        changed.clear();
        growth.take_changed(&mut changed);
        for segment in growth.network().segments() {
            let (a, b) = growth.network().ends(segment).unwrap();
            let now = [a, b].map(|i| growth.network().nodes()[i as usize].width.to_bits());
            let before = widths.insert(segment, (now[0], now[1]));
            if before != Some((now[0], now[1])) && matches!(segment, SegmentId::Branch(_)) {
                assert!(changed.contains(&segment), "{segment:?} changed from {before:?} and was not listed");
            }
        }
    }
}

/// Faults I1 and I4: all bit patterns of position and energy.
#[test]
fn i1_i4_any_bits_as_a_hit() {
    let mut rng = Rng::new(11);
    let mut growth = CrackGrowth::new(GrowthParams::default(), Vec2::ONE, 1).unwrap();
    let special = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 0.0, 1e-40, f32::MAX, f32::MIN, 1.0, 0.5, -1e-30];
    let draw = |rng: &mut Rng| match rng.next_u32() % 3 {
        0 => special[rng.next_u32() as usize % special.len()],
        1 => f32::from_bits(rng.next_u32()),
        _ => rng.unit(),
    };
    for _ in 0..20_000 {
        let (x, y, energy) = (draw(&mut rng), draw(&mut rng), draw(&mut rng));
        let outcome = growth.hit(Vec2::new(x, y), energy);
        let on = (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y);
        match outcome {
            HitOutcome::Rejected(Rejected::NotFinite) => assert!(![x, y, energy].iter().all(|v| v.is_finite())),
            HitOutcome::Rejected(Rejected::NegativeEnergy) => assert!(energy < 0.0),
            HitOutcome::Rejected(Rejected::OffSurface) => assert!(!on),
            HitOutcome::Rejected(Rejected::Forbidden) => panic!("nothing is forbidden"),
            HitOutcome::Rejected(Rejected::Full) => assert!(growth.network().nodes().len() >= 20_000),
            HitOutcome::Nothing => assert_eq!(energy, 0.0),
            HitOutcome::Started(_) | HitOutcome::Merged(_) => assert!(on && energy > 0.0),
        }
        growth.step();
    }
    assert!(growth.network().nodes().iter().all(|node| node.pos.is_finite()));
    assert!(growth.impacts().iter().all(|impact| impact.energy <= MAX_ENERGY));
}

/// Fault I5: 10,000 hits on one point cost no more at the end than at the beginning.
#[test]
fn i5_same_point_hit_ten_thousand_times() {
    let mut growth = CrackGrowth::new(GrowthParams::default(), Vec2::ONE, 1).unwrap();
    let outcomes: Vec<_> = (0..10_000).map(|_| growth.hit(Vec2::splat(0.4), 0.5)).collect();
    assert_eq!(outcomes[0], HitOutcome::Started(0));
    assert!(outcomes[1..].iter().all(|outcome| *outcome == HitOutcome::Merged(0)));
    assert_eq!(growth.impacts().len(), 1);
    assert_eq!(growth.impacts()[0].energy, MAX_ENERGY);
    let markers = growth.census().total;
    assert!(markers <= 400, "{markers} markers on a grid of 400");
    // All energy at once lays out the same markers as many hits.
    let mut once = CrackGrowth::new(GrowthParams::default(), Vec2::ONE, 1).unwrap();
    once.hit(Vec2::splat(0.4), MAX_ENERGY);
    assert_eq!(once.census().total, markers);
}

#[test]
fn more_energy_cracks_further() {
    let reach = |energy| {
        let mut growth = CrackGrowth::new(GrowthParams { reach: 0.2, ..Default::default() }, Vec2::ONE, 9).unwrap();
        growth.hit(Vec2::splat(0.5), energy);
        while growth.step().grew() {}
        let far = growth.network().nodes().iter().map(|node| node.pos.distance(Vec2::splat(0.5)));
        far.fold(0.0, f32::max)
    };
    assert!(reach(0.25) < reach(1.0) && reach(1.0) < reach(4.0));
}

#[test]
fn every_hit_shows() {
    let extents = [Vec2::ONE, Vec2::new(64.0, 1.0 / 64.0), Vec2::new(1.0 / 64.0, 64.0)];
    for (preset, extent) in CrackPreset::NAMES
        .map(|name| CrackPreset::named(name).unwrap())
        .into_iter()
        .flat_map(|preset| extents.map(|extent| (preset.clone(), extent)))
    {
        for seed in 0..200 {
            let mut growth = CrackGrowth::new(preset.growth.clone(), extent, seed).unwrap();
            growth.hit(Vec2::new(0.3, 0.6) * extent, 0.02);
            while growth.step().grew() {}
            assert!(growth.network().segments().count() > 0, "seed {seed} shows nothing on {extent}");
        }
    }
}

#[test]
fn layouts_do_what_they_say() {
    let count = |params: GrowthParams, density| {
        let mut growth = CrackGrowth::new(params, Vec2::ONE, 2).unwrap();
        growth.set_density(density);
        growth.hit(Vec2::splat(0.5), 4.0);
        growth.field.unsettled().map(|(pos, _)| pos).collect::<Vec<_>>()
    };
    let grid = GrowthParams {
        reach: 4.0,
        num_lines_grid: 50,
        num_columns_grid: 50,
        markers: MarkerLayout::PseudoGrid { occupancy: 0.6, jitter: 0.5 },
        ..Default::default()
    };
    let n = count(grid.clone(), None).len() as f32 / 2500.0;
    assert!((n - 0.6).abs() < 0.03, "occupancy {n}");
    let half = Grid::from_vec([2, 1].into(), vec![1.0, 0.0]).unwrap();
    assert!(count(grid.clone(), Some(half)).iter().all(|pos| pos.x < 0.5), "a density of 0 holds no marker");
    let focused = count(GrowthParams { focus: 2.0, reach: 0.5, ..grid.clone() }, None);
    let inner = focused.iter().filter(|pos| pos.distance(Vec2::splat(0.5)) < 0.35).count();
    assert!(inner * 2 > focused.len(), "denser near the hit: {inner} of {}", focused.len());
    let darts = count(GrowthParams { markers: MarkerLayout::DartThrowing { spacing: 0.05 }, ..grid }, None);
    let close = |a: &Vec2| darts.iter().filter(|b| a.distance(**b) < 0.05).count() > 1;
    assert!(darts.len() > 200 && !darts.iter().any(close), "{} darts keep their distance", darts.len());
}

#[test]
fn parameters_out_of_range_are_named() {
    let broken = GrowthParams { kill_distance: f32::NAN, ..Default::default() };
    let text = CrackGrowth::new(broken, Vec2::ONE, 0).unwrap_err().to_string();
    assert!(text.contains("kill_distance"), "{text}");
    let mut rng = Rng::new(4);
    for _ in 0..5000 {
        let params = random_params(&mut rng, false);
        assert_eq!(params.validate(), Ok(()));
        let bits = f32::from_bits(rng.next_u32());
        let broken = GrowthParams { crack_radius: bits, ..params };
        assert_eq!(
            broken.validate().is_ok(),
            (0.001f32.max(broken.kill_distance)..=(256.0 * broken.step_length).min(32.0)).contains(&bits)
        );
    }
}

/// The patterns of a seed are part of the contract: a change here changes every user's cracks and goes into the changelog.
#[test]
fn patterns_are_frozen() {
    let print =
        |name: &&str| format!("{name} {:016x}", fingerprint(&preset_run(&CrackPreset::named(name).unwrap(), 1)));
    let found: Vec<String> = CrackPreset::NAMES.iter().map(print).collect();
    let stored = include_str!("../../tests/golden/growth_fingerprints.txt");
    assert_eq!(found, stored.lines().collect::<Vec<_>>(), "the pattern of a seed has changed");
    assert_ne!(mix(1), 1);
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
            let from = self.nodes[node].0;
            let mut sum = [0i64; 2];
            for &(distance_sq, id) in set {
                let towards = (self.markers[id].pos - from) * (16_777_216.0 / distance_sq.sqrt());
                sum[0] += i64::from(towards.x as i32);
                sum[1] += i64::from(towards.y as i32);
            }
            let direction = Vec2::new(sum[0] as f32, sum[1] as f32).normalize_or_zero();
            let mut to = from + direction * p.step_length;
            let far = from + direction * (p.step_length + p.kill_distance);
            let mut share = 1.0f32;
            for axis in 0..2 {
                if far[axis] < 0.0 {
                    share = share.min(-from[axis] / (far[axis] - from[axis]));
                } else if far[axis] > self.extent[axis] {
                    share = share.min((self.extent[axis] - from[axis]) / (far[axis] - from[axis]));
                }
            }
            if share < 1.0 {
                to = (from + (far - from) * share).clamp(Vec2::ZERO, self.extent);
            }
            let serves = set.iter().any(|&(distance_sq, id)| {
                let after = self.markers[id].pos.distance_squared(to);
                after <= p.kill_distance * p.kill_distance
                    || after <= distance_sq - 0.25 * p.step_length * p.step_length
            });
            if !serves {
                let (closest_sq, id) = set.iter().copied().min_by(|a, b| a.partial_cmp(b).unwrap()).unwrap();
                let (marker, distance) = (self.markers[id].pos, closest_sq.sqrt());
                to = if distance <= p.step_length {
                    marker
                } else {
                    from + (marker - from) * (p.step_length / distance)
                };
            }
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

/// Random parameters with arrest.
fn random_arrest(rng: &mut Rng) -> GrowthParams {
    let params = random_params(rng, true);
    let step_length = rng.range(0.012, 0.05);
    let crack_radius = rng.range(0.08, 0.6).max(2.0 * step_length);
    GrowthParams {
        step_length,
        crack_radius,
        kill_distance: rng.range(0.01, 0.07).min(crack_radius),
        venation: if rng.unit() < 0.3 { Venation::Closed } else { Venation::Open },
        arrest: rng.range(0.01, 0.12),
        inertia: if rng.unit() < 0.3 { 0.0 } else { rng.range(0.0, 6.0) },
        nucleation: if rng.unit() < 0.5 { 0.0 } else { rng.range(0.0, 3.0) },
        open_ends: if rng.unit() < 0.5 { 0.0 } else { rng.unit() },
        // A crack that strays by more at every node has no direction that another could meet steeply.
        wander: params.wander.min(0.5),
        tip_taper: 0.9 * rng.unit(),
        unevenness: 0.9 * rng.unit(),
        axis: 3.0 * rng.signed(),
        directed: if rng.unit() < 0.5 { 0.0 } else { rng.unit() },
        reach: rng.range(0.3, 1.5),
        max_nodes: 3000,
        ..params
    }
}

/// All pieces of all drawn lines, with the nodes that the first and the last of a line lie at.
fn pieces(growth: &CrackGrowth) -> Vec<(Vec2, Vec2, [Option<u32>; 2])> {
    let mut pieces = Vec::new();
    for segment in growth.network().segments() {
        let (a, b) = growth.network().ends(segment).unwrap();
        let path = growth.network().path(segment).unwrap();
        let last = path.points().len() - 2;
        for (i, pair) in path.points().windows(2).enumerate() {
            pieces.push((pair[0].pos, pair[1].pos, [(i == 0).then_some(a), (i == last).then_some(b)]));
        }
    }
    pieces
}

fn cross(one: (Vec2, Vec2), other: (Vec2, Vec2)) -> bool {
    let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).as_dvec2().perp_dot((r - p).as_dvec2());
    let (a, b, c, d) = (one.0, one.1, other.0, other.1);
    let apart = |k: usize| a[k].max(b[k]) < c[k].min(d[k]) || c[k].max(d[k]) < a[k].min(b[k]);
    if apart(0) || apart(1) {
        return false;
    }
    side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
}

/// No two lines touch but at a shared node, and no two nodes are joined twice; returns how many pairs were compared.
fn assert_planar(growth: &CrackGrowth, case: u64) -> u64 {
    let mut pairs = 0;
    let pieces = pieces(growth);
    let mut ends = std::collections::BTreeSet::new();
    for (a, b) in growth.network().segments().filter_map(|segment| growth.network().ends(segment)) {
        assert!(ends.insert((a.min(b), a.max(b))), "case {case}: {a} and {b} are joined twice");
    }
    for (from, to, _) in &pieces {
        assert!(from != to, "case {case}: a piece without length at {from}");
    }
    // By the left end, so that only what overlaps is compared.
    let mut order: Vec<usize> = (0..pieces.len()).collect();
    order.sort_by(|&a, &b| pieces[a].0.x.min(pieces[a].1.x).total_cmp(&pieces[b].0.x.min(pieces[b].1.x)));
    for (k, &i) in order.iter().enumerate() {
        let right = pieces[i].0.x.max(pieces[i].1.x);
        for &j in order[k + 1..].iter().take_while(|&&j| pieces[j].0.x.min(pieces[j].1.x) <= right) {
            let shares = |end: Option<u32>| end.is_some() && pieces[j].2.contains(&end);
            // Pieces next to each other come one after the other; no two other pieces share a point.
            let follow = i.abs_diff(j) == 1 && (pieces[i].0 == pieces[j].1 || pieces[i].1 == pieces[j].0);
            if pieces[i].2.into_iter().any(shares) || follow {
                continue;
            }
            pairs += 1;
            let (one, other) = ((pieces[i].0, pieces[i].1), (pieces[j].0, pieces[j].1));
            assert!(!cross(one, other), "case {case}: {one:?} crosses {other:?}");
        }
    }
    pairs
}

#[test]
fn no_two_cracks_cross_and_junctions_are_steep() {
    let mut angles = Vec::new();
    let mut pairs = 0u64;
    for case in 0..1000u64 {
        let mut rng = Rng::new(case).stream("arrest");
        let params = random_arrest(&mut rng);
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params, extent, case).unwrap();
        for _ in 0..3 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, rng.range(0.3, 2.0));
            for _ in 0..rng.next_u32() % 200 {
                growth.step();
            }
        }
        while growth.step().grew() {}
        pairs += assert_planar(&growth, case);
        // T-junctions: a crack that ends at a node in the middle of another.
        let (nodes, mut around) = (growth.network().nodes(), vec![Vec::new(); growth.network().nodes().len()]);
        for (a, b) in growth.network().segments().filter_map(|segment| growth.network().ends(segment)) {
            around[a as usize].push(b);
            around[b as usize].push(a);
        }
        for link in growth.network().links().iter().filter(|link| link.kind == LinkKind::Junction) {
            let (end, tip) = (nodes[link.a as usize].pos, nodes[link.b as usize].pos);
            let through: Vec<_> = around[link.a as usize].iter().filter(|&&node| node != link.b).collect();
            if let [one, other] = through[..] {
                let (one, other) = (nodes[*one as usize].pos, nodes[*other as usize].pos);
                let (along, coming) = ((other - one).normalize(), (tip - end).normalize());
                angles.push(along.dot(coming).abs().clamp(0.0, 1.0).acos().to_degrees());
            }
        }
    }
    angles.sort_by(f32::total_cmp);
    let median = angles[angles.len() / 2];
    println!("{pairs} pairs of pieces, {} T-junctions, median angle {median:.1} degrees", angles.len());
    // The smaller of the two angles, so at most 90.
    assert!(median > 70.0, "median angle {median}");
    assert!(angles.len() > 800, "only {} T-junctions", angles.len());
}

#[test]
fn always_ends_with_arrest_and_closed_venation() {
    for case in 0..2_000u64 {
        let mut rng = Rng::new(case).stream("ends with arrest");
        let mut params = GrowthParams { max_nodes: 1_000_000, ..random_arrest(&mut rng) };
        if rng.unit() < 0.4 {
            params.arrest = 0.0;
        }
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        for _ in 0..2 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, 4.0 * rng.unit());
            for _ in 0..rng.next_u32() % 30 {
                growth.step();
            }
        }
        let starts = growth.network().nodes().iter().filter(|node| node.parent == NO_PARENT).count() as u64;
        let bound = params.most_nodes(u64::from(growth.census().total), starts);
        while growth.step().grew() {
            assert!((growth.network().nodes().len() as u64) < bound, "case {case}: {params:?}");
        }
        let census = growth.census();
        assert!(!growth.is_growing(), "case {case}");
        assert_eq!(census.attracting, 0, "case {case}: {params:?}");
        assert_eq!(census.killed + census.waiting, census.total, "case {case}: {census:?}");
    }
}

/// Seams of a random map, as a network.
fn random_seams(rng: &mut Rng, extent: Vec2, seed: u64) -> crate::pattern::Network {
    let params = VoronoiParams { sites: 3 + rng.next_u32() % 30, ..VoronoiParams::DEFAULT };
    let size = (extent * rng.range(40.0, 120.0)).as_uvec2();
    let (_, seams) = VoronoiBake::new(params, Vec::new(), size, seed).unwrap().finish();
    seams.network(Vec2::new(rng.unit(), rng.unit()) * extent)
}

#[test]
fn added_cracks_are_walls() {
    let (mut met, mut sprouted) = (0, 0);
    for case in 0..150u64 {
        let mut rng = Rng::new(case).stream("added");
        let extent = Vec2::new(rng.range(1.0, 1.6), 1.0);
        let mut growth = CrackGrowth::new(random_arrest(&mut rng), extent, case).unwrap();
        let seams = random_seams(&mut rng, extent, case);
        growth.add_cracks(&seams, rng.next_u32() % 4);
        let n = growth.network().nodes().len();
        assert_eq!(n, seams.nodes().len());
        // Everywhere, and on a seam.
        growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, rng.range(0.3, 2.0));
        growth.hit(growth.network().nodes()[rng.next_u32() as usize % n].pos, 1.0);
        while growth.step().grew() {}
        assert_planar(&growth, case);
        let nodes = growth.network().nodes();
        let is_seam = |node: u32| (node as usize) < n;
        met += growth.network().links().iter().filter(|link| is_seam(link.a) != is_seam(link.b)).count();
        sprouted += nodes[n..].iter().filter(|node| node.parent != NO_PARENT && is_seam(node.parent)).count();
        assert!(
            nodes[n..].iter().all(|node| node.impact < 2) && nodes[..n].iter().all(|node| node.impact == NO_IMPACT)
        );
    }
    assert!(met > 150 && sprouted > 50, "{met} cracks ended at seams, {sprouted} began there");
}

#[test]
fn added_cracks_come_as_their_network_says() {
    for case in 0..20u64 {
        let mut rng = Rng::new(case).stream("added");
        let extent = Vec2::new(rng.range(1.0, 1.6), 1.0);
        let opening = rng.next_u32() % 20;
        let mut growth =
            CrackGrowth::new(GrowthParams { max_nodes: 50, ..GrowthParams::DEFAULT }, extent, case).unwrap();
        let seams = random_seams(&mut rng, extent, case);
        let steps = growth.add_cracks(&seams, opening);
        let last = seams.nodes().iter().map(|node| node.birth).max().unwrap();
        assert_eq!(steps, last + opening + 1);
        let (network, timeline) = (growth.network(), growth.timeline());
        assert_eq!((timeline.end(), growth.steps()), (steps, steps));
        for (i, (node, seam)) in (0u32..).zip(network.nodes().iter().zip(seams.nodes())) {
            let place = seam.pos / seams.extent() * extent;
            assert!(node.pos.distance(place) < 1e-5 && node.width == seam.width && node.parent == seam.parent);
            let on_border = |pos: Vec2, extent: Vec2| (pos.cmpeq(Vec2::ZERO) | pos.cmpeq(extent)).any();
            assert_eq!(on_border(node.pos, extent), on_border(seam.pos, seams.extent()), "{node:?}");
            let width = |step: u32| timeline.width_at(i, Moment::after(step)).unwrap();
            assert_eq!(width(seam.birth + 1 + opening), seam.width);
            for age in 0..opening {
                let expected = seam.width * (age + 1) as f32 / (opening + 1) as f32;
                assert!((width(seam.birth + 1 + age) - expected).abs() < 1e-6);
            }
            let segment = SegmentId::Branch(i);
            if seam.parent != NO_PARENT {
                assert!(timeline.path_at(network, segment, Moment::after(seam.birth)).is_none());
                assert_eq!(timeline.path_at(network, segment, Moment::after(steps)), network.path(segment));
            }
        }
        let mut changed = Vec::new();
        growth.take_changed(&mut changed);
        changed.sort_unstable();
        assert_eq!(changed, growth.network().segments().collect::<Vec<_>>(), "each segment once");
        // They leave room for as many nodes as before.
        let n = growth.network().nodes().len();
        assert!(matches!(growth.hit(0.5 * extent, 4.0), HitOutcome::Started(_)));
        while growth.step().grew() {}
        assert_eq!(growth.network().nodes().len(), n + 50);
    }
}

/// Forbidden texels hold no line, and, with the field that keeps them, no depth.
#[test]
fn forbidden_texels_hold_no_crack() {
    let mut drawn = 0;
    for case in 0..120u64 {
        let mut rng = Rng::new(case).stream("forbidden");
        let mut params = random_arrest(&mut rng);
        if rng.unit() < 0.5 {
            params.arrest = 0.0;
        }
        let side = 8 + rng.next_u32() % 40;
        let mut forbidden = Grid::new(UVec2::splat(side), 0.0);
        for texel in forbidden.as_mut_slice() {
            *texel = if rng.unit() < 0.15 { 1.0 } else { 0.0 };
        }
        let mask = Arc::new(CrackMask { forbidden: Some(forbidden), ..CrackMask::default() });
        let mut growth = CrackGrowth::new(params, Vec2::ONE, case).unwrap();
        growth.set_mask(mask.clone());
        for _ in 0..3 {
            let at = Vec2::new(rng.unit(), rng.unit());
            let outcome = growth.hit(at, 1.0);
            assert_eq!(outcome == HitOutcome::Rejected(Rejected::Forbidden), mask.is_forbidden(at), "case {case}");
            while growth.step().grew() {}
        }
        let mut field = DepthField::new(SurfaceFrame::new(UVec2::splat(160)).unwrap());
        field.forbid(&mask);
        for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
            for pair in path.points().windows(2) {
                // Far finer than a texel of the mask.
                for i in 0..=50 {
                    let at = pair[0].pos.lerp(pair[1].pos, i as f32 / 50.0);
                    let inner = [Vec2::new(1e-5, 1e-5), Vec2::new(-1e-5, -1e-5)];
                    let is_inside = inner.iter().all(|&nudge| mask.is_forbidden(at + nudge));
                    assert!(!is_inside, "case {case}: a line enters a forbidden texel at {at}");
                }
            }
            stamp_path(&mut field, &Profile::default(), &path);
            drawn += 1;
        }
        for y in 0..160 {
            for x in 0..160 {
                let uv = (Vec2::new(x as f32, y as f32) + 0.5) / 160.0;
                assert!(!mask.is_forbidden(uv) || field.depth.get(x, y) == Some(0), "case {case}: {x} {y} is cracked");
            }
        }
    }
    assert!(drawn > 3000, "only {drawn} segments");
}

/// Hammering on one spot widens what is there, by no more than twice, and makes no second crack beside it.
#[test]
fn later_hits_on_a_spot_widen() {
    for preset in [CrackPreset::CONCRETE, CrackPreset::GLASS, CrackPreset::MUD] {
        let mut growth = CrackGrowth::new(preset.growth, Vec2::ONE, 5).unwrap();
        growth.hit(Vec2::splat(0.5), 1.0);
        while growth.step().grew() {}
        let (first, mut changed) = (growth.network().nodes().to_vec(), Vec::new());
        growth.take_changed(&mut changed);
        changed.clear();
        for _ in 0..40 {
            assert_eq!(growth.hit(Vec2::new(0.501, 0.5), 1.0), HitOutcome::Merged(0));
            while growth.step().grew() {}
        }
        assert_eq!(growth.impacts().len(), 1);
        let widened = growth.network().nodes();
        let by: Vec<f32> = first.iter().zip(widened).map(|(before, after)| after.width / before.width).collect();
        assert!(by.iter().all(|by| *by >= 1.0), "a crack has become narrower");
        // Sixteen times the energy is as much as a spot takes: twice as wide.
        assert!(by.iter().filter(|by| **by > 1.9).count() * 10 > 9 * by.len(), "{by:?}");
        growth.take_changed(&mut changed);
        let told: std::collections::BTreeSet<_> = changed.drain(..).collect();
        for node in (0..first.len() as u32).filter(|&node| first[node as usize].parent != NO_PARENT) {
            assert!(told.contains(&SegmentId::Branch(node)), "segment {node} is wider and not told of");
        }
        // No more than that: nothing changes any more.
        let before = growth.network().clone();
        for _ in 0..100 {
            growth.hit(Vec2::new(0.5, 0.501), 16.0);
            while growth.step().grew() {}
        }
        assert_eq!(growth.network(), &before);
    }
}
