//! Growth: its end, its hits, and its frozen patterns.

mod arrest;
mod changed;
mod divide;
mod energy;
mod long;
mod masonry;
mod rays;
mod rays_reference;
mod reference;
mod slices;
mod strands;
mod widths;

use super::{CrackGrowth, GrowthParams, HitOutcome, MAX_ENERGY, MarkerLayout, Rejected, StartLayout, Venation};
use crate::{
    CrackPreset, Grid,
    math::{Rng, pools::check_in_pools},
    pattern::{LinkKind, NO_PARENT, SegmentId},
};
use glam::Vec2;

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
            _ => MarkerLayout::DartThrowing { spacing: 0.04 + 0.3 * rng.unit() },
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
        grain: 0.0,
        forks: 0.0,
        fork_angle: 0.7,
        roughness: 0.5 * rng.unit(),
        draw_connections: rng.unit() < 0.5,
        connection_gaps: rng.unit(),
        connection_every: 1 + rng.next_u32() % 4,
        draw_islands: rng.unit() < 0.5,
        island_distance: 0.2 * rng.unit(),
        open_ends: 0.5 * rng.unit(),
        arrest: 0.0,
        venation: Venation::Open,
        nucleation: 0.0,
        generations: 1 + rng.next_u32() % 3,
        three_arm_share: 0.0,
        straightness: 0.0,
        thinning: 0.0,
        width_variation: 0.0,
        front: 0.0,
        tip_taper: if rng.unit() < 0.3 { 0.0 } else { 12.0 * rng.unit() },
        unevenness: 0.0,
        inertia: 0.0,
        axis: 0.0,
        directed: 0.0,
        variety: 0.0,
        courses: 0.0,
        distortion: 0.01,
        draw_markers: rng.unit() < 0.2,
        max_nodes: 1_000_000,
        zigzag: if rng.unit() < 0.5 { 0.0 } else { rng.unit() },
        reach_variation: 0.0,
        patchiness: 0.0,
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
        let bound = params.most_nodes(u64::from(growth.marker_counts().total), starts);
        let mut steps = 0u64;
        while growth.step().grew() {
            steps += 1;
            assert!(steps <= bound, "case {case}: {steps} steps, bound {bound}: {params:?}");
        }
        let census = growth.marker_counts();
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
            assert_eq!(growth.marker_counts().attracting, 0, "figure {figure} at scale {scale}");
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

/// Several growths on each thread, one after another and at the same time.
#[test]
fn same_bits_on_every_thread() {
    check_in_pools(2 * CrackPreset::NAMES.len(), |job| {
        let name = CrackPreset::NAMES[job % CrackPreset::NAMES.len()];
        fingerprint(&preset_run(&CrackPreset::named(name).unwrap(), 3 + job as u64))
    });
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
            assert!(node.width > 0.0 && node.width <= params.max_width.max(params.line_width));
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
    let all = CrackPreset::NAMES.into_iter().filter_map(CrackPreset::named).map(|preset| preset.growth);
    for params in all.chain([GrowthParams { line_growth: 2.0, ..Default::default() }]) {
        let mut growth = CrackGrowth::new(params, Vec2::ONE, 5).unwrap();
        growth.hit(Vec2::splat(0.5), 1.0);
        let mut changed = Vec::new();
        let mut widths: std::collections::BTreeMap<SegmentId, (u32, u32)> = Default::default();
        while growth.step().grew() {
            changed.clear();
            growth.take_changed(&mut changed);
            let changed: std::collections::BTreeSet<_> = changed.iter().copied().collect();
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
    let markers = growth.marker_counts().total;
    assert!(markers <= 400, "{markers} markers on a grid of 400");
    // All energy at once lays out the same markers as many hits.
    let mut once = CrackGrowth::new(GrowthParams::default(), Vec2::ONE, 1).unwrap();
    once.hit(Vec2::splat(0.4), MAX_ENERGY);
    assert_eq!(once.marker_counts().total, markers);
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

/// However far away a preset is seen from, it stays one.
#[test]
fn scaled_presets_are_in_order() {
    let mut rng = Rng::new(12);
    let wild = [0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30, f32::MIN_POSITIVE, 1e-9, 0.1, 3.0];
    for name in CrackPreset::NAMES {
        let preset = CrackPreset::named(name).unwrap();
        let some = (0..50).map(|_| crate::math::ops::exp(8.0 * rng.signed())).collect::<Vec<f32>>();
        for by in wild.into_iter().chain(some) {
            let scaled = preset.scaled(by);
            assert_eq!(scaled.validate(), Ok(()), "{name} by {by}");
            assert_eq!(scaled.scaled(1.0 / by).scaled(0.3).validate(), Ok(()), "{name} by {by} and back");
        }
    }
}
