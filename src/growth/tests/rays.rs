//! Rays: glass, laminated glass, ice.

use super::{arrest::assert_planar, random_extent, random_params};
use crate::{
    CrackPreset, Grid,
    growth::{
        CrackGrowth, GrowthParams, MarkerLayout, StartLayout,
        plan::{MOST_RINGS, Plan, PlannedHit},
        rays::{NO_RAY, RAY},
    },
    math::Rng,
    pattern::{CellTracker, CrackMask, LinkKind, NO_PARENT, SurfaceFrame},
    raster::{DepthField, stamp_path},
};
use glam::{UVec2, Vec2};
use std::collections::{BTreeMap, BTreeSet};

const PRESETS: [(&str, CrackPreset); 3] =
    [("glass", CrackPreset::GLASS), ("laminated_glass", CrackPreset::LAMINATED_GLASS), ("ice", CrackPreset::ICE)];

fn grown(preset: &CrackPreset, extent: Vec2, hits: &[(Vec2, f32)], seed: u64) -> CrackGrowth {
    let mut growth = CrackGrowth::new(preset.growth.clone(), extent, seed).unwrap();
    for &(pos, energy) in hits {
        growth.hit(pos, energy);
        while growth.step().grew() {}
    }
    growth
}

/// What comes of one hit in the middle.
fn hit(preset: &CrackPreset, energy: f32, seed: u64) -> CrackGrowth {
    grown(preset, Vec2::ONE, &[(Vec2::splat(0.5), energy)], seed)
}

/// The nodes of each ray, in order of birth.
fn rays(growth: &CrackGrowth) -> BTreeMap<u32, Vec<usize>> {
    let mut rays = BTreeMap::<_, Vec<_>>::new();
    for (node, &ray) in growth.field.ray_of.iter().enumerate() {
        if ray != NO_RAY {
            rays.entry(ray & !RAY).or_default().push(node);
        }
    }
    rays
}

fn on_border(growth: &CrackGrowth, node: usize) -> bool {
    let (pos, extent) = (growth.network().nodes()[node].pos, growth.network().extent());
    (pos.cmpeq(Vec2::ZERO) | pos.cmpeq(extent)).any()
}

/// Number of segments at each node.
fn degrees(growth: &CrackGrowth) -> Vec<u32> {
    let network = growth.network();
    let mut degrees = vec![0; network.nodes().len()];
    for (a, b) in network.segments().filter_map(|segment| network.ends(segment)) {
        degrees[a as usize] += 1;
        degrees[b as usize] += 1;
    }
    degrees
}

fn length(growth: &CrackGrowth) -> f32 {
    let (network, nodes) = (growth.network(), growth.network().nodes());
    let ends = network.segments().filter_map(|segment| network.ends(segment));
    ends.map(|(a, b)| nodes[a as usize].pos.distance(nodes[b as usize].pos)).sum()
}

fn median(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    values[values.len() / 2]
}

/// How many rays of glass and ice end at the border or at another crack, and how many there are.
fn reaching(growth: &CrackGrowth) -> (u32, u32) {
    let degrees = degrees(growth);
    let rays = rays(growth);
    let ends = rays.values().filter_map(|nodes| nodes.last());
    let reaching = ends.filter(|&&end| on_border(growth, end) || degrees[end] > 1).count();
    (reaching as u32, rays.len() as u32)
}

/// Rays of glass and ice do not end in the open: with one hit anywhere, and with three.
#[test]
fn rays_reach_the_border_or_another_crack() {
    for (name, preset) in [&PRESETS[0], &PRESETS[2]] {
        for energy in [0.5, 1.0, 2.0, 4.0, 8.0] {
            let (mut reached, mut all) = ([0, 0], [0, 0]);
            for seed in 0..24 {
                let mut rng = Rng::new(seed).stream("reach");
                let extent = if seed % 4 == 0 { Vec2::new(3.0, 1.0) } else { Vec2::ONE };
                let mut place = || Vec2::new(rng.unit(), rng.unit()) * extent;
                let hits = [(place(), energy), (place(), energy), (place(), energy)];
                for (i, hits) in [&hits[..1], &hits[..]].into_iter().enumerate() {
                    let (some, of) = reaching(&grown(preset, extent, hits, seed));
                    (reached[i], all[i]) = (reached[i] + some, all[i] + of);
                }
            }
            let share = [0, 1].map(|i| f64::from(reached[i]) / f64::from(all[i]));
            println!("{name} {energy}: {:.3} of {} rays reach, {:.3} of {}", share[0], all[0], share[1], all[1]);
            assert!(share[0] >= 0.97 && share[1] >= 0.9, "{name} {energy}: {share:?}");
        }
    }
}

/// Straight, with slight kinks: a ray is hardly longer than the way from its start to its end, turns little at a node, and never
/// far from where it set out to.
#[test]
fn rays_are_straight() {
    for (name, preset) in &PRESETS {
        for seed in 0..24 {
            let growth = hit(preset, 1.0, seed);
            let nodes = growth.network().nodes();
            for ray in rays(&growth).values().filter(|ray| ray.len() > 8) {
                let places: Vec<Vec2> = ray.iter().map(|&node| nodes[node].pos).collect();
                let arc: f32 = places.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
                let chord = places[0].distance(places[places.len() - 1]);
                assert!(chord > 0.985 * arc, "{name} {seed}: {chord} of {arc}");
                for turn in places.windows(3) {
                    let angle = (turn[1] - turn[0]).angle_to(turn[2] - turn[1]).to_degrees().abs();
                    assert!(angle < 12.0, "{name} {seed}: turns by {angle} degrees at {}", turn[1]);
                }
            }
        }
    }
}

/// Every ray of a hit on glass starts on the rim, or on another ray; and the angles are all around.
#[test]
fn rays_start_all_around() {
    for seed in 0..24 {
        let growth = hit(&CrackPreset::GLASS, 1.0, seed);
        let nodes = growth.network().nodes();
        let mut angles = Vec::new();
        for ray in rays(&growth).values() {
            let start = nodes[ray[0]];
            let arm = start.pos - Vec2::splat(0.5);
            if start.parent == NO_PARENT {
                assert!((arm.length() - 0.016).abs() < 1e-4, "{}", arm.length());
                angles.push(arm.to_angle());
            } else {
                assert!(growth.field.ray_of[start.parent as usize] != NO_RAY);
            }
        }
        angles.sort_by(f32::total_cmp);
        let around = angles
            .iter()
            .cycle()
            .skip(1)
            .zip(&angles)
            .map(|(next, angle)| (next - angle).rem_euclid(std::f32::consts::TAU));
        let gaps: Vec<f32> = around.map(f32::to_degrees).collect();
        assert!((10..=16).contains(&gaps.len()), "{} rays start at the hit", gaps.len());
        let (least, most) =
            gaps.iter().fold((360.0f32, 0.0f32), |(least, most), gap| (least.min(*gap), most.max(*gap)));
        assert!(most < 65.0 && most > 1.4 * least, "{gaps:?}");
    }
}

/// The cells are those that Euler's formula tells of: edges less places and one for each connected part, the border's among them.
#[test]
fn cells_close_between_rays_and_rings() {
    for (name, preset) in &PRESETS {
        for (energy, least) in [(0.5, [14, 4, 4]), (1.0, [24, 8, 6]), (4.0, [60, 40, 16])] {
            let mut found = Vec::new();
            for seed in 0..24 {
                let growth = hit(preset, energy, seed);
                let (network, mut cells) = (growth.network(), CellTracker::new(Vec2::ONE));
                cells.update(network);
                // Union of all that is joined; one more node stands for the border.
                let n = network.nodes().len();
                let mut root: Vec<usize> = (0..=n).collect();
                fn top(root: &[usize], mut node: usize) -> usize {
                    while root[node] != node {
                        node = root[node];
                    }
                    node
                }
                let mut closing = 0;
                let segments = network.segments().filter_map(|segment| network.ends(segment));
                let at_border = (0..n).filter(|&node| on_border(&growth, node)).map(|node| (node as u32, n as u32));
                for (a, b) in at_border.chain(segments) {
                    let (a, b) = (top(&root, a as usize), top(&root, b as usize));
                    closing += u32::from(a == b);
                    root[a] = b;
                }
                assert_eq!(cells.closed(), closing, "{name} {energy} {seed}");
                found.push(cells.closed() as f32);
            }
            let at = PRESETS.iter().position(|(other, _)| other == name).unwrap();
            println!("{name} {energy}: {} cells", median(found.clone()));
            assert!(median(found) >= least[at] as f32, "{name} {energy}");
        }
    }
}

/// Energy counts, and more than the seed: over 24 seeds length varies by at most a quarter, and length and covered share rise with every
/// doubling, by at least 2.5 times from 1 to 8.
#[test]
fn energy_counts_more_than_the_seed() {
    for (name, preset) in &PRESETS {
        let mut medians = Vec::new();
        for energy in [0.5, 1.0, 2.0, 4.0, 8.0] {
            let (mut lengths, mut covered) = (Vec::new(), Vec::new());
            for seed in 0..24 {
                let growth = hit(preset, energy, seed);
                lengths.push(length(&growth));
                let mut field = DepthField::new(SurfaceFrame::new(UVec2::splat(512)).unwrap());
                for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
                    stamp_path(&mut field, &preset.profile, &path);
                }
                let depths = field.depth.as_slice();
                covered.push(depths.iter().filter(|depth| **depth > u16::MAX / 2).count() as f32 / depths.len() as f32);
            }
            let mean = lengths.iter().sum::<f32>() / 24.0;
            let cv = (lengths.iter().map(|length| (length - mean).powi(2)).sum::<f32>() / 24.0).sqrt() / mean;
            assert!(cv <= 0.25, "{name} {energy}: varies by {cv}");
            medians.push((median(lengths), median(covered)));
            println!("{name} {energy}: {:?}, varies by {cv:.3}", medians[medians.len() - 1]);
        }
        for pair in medians.windows(2) {
            assert!(pair[1].0 > pair[0].0 && pair[1].1 > pair[0].1, "{name}: {medians:?}");
        }
        assert!(medians[4].0 >= 2.5 * medians[1].0 && medians[4].1 >= 2.5 * medians[1].1, "{name}: {medians:?}");
    }
}

/// From root to tip the width of a radial of glass falls to a third at least.
#[test]
fn radials_are_three_times_as_wide_at_the_root() {
    for seed in 0..24 {
        let growth = hit(&CrackPreset::GLASS, 1.0, seed);
        let nodes = growth.network().nodes();
        let long = rays(&growth);
        let long = long.values().filter(|ray| ray.len() > 30 && nodes[ray[0]].parent == NO_PARENT);
        let ratios: Vec<f32> = long.map(|ray| nodes[ray[0]].width / nodes[ray[ray.len() - 1]].width).collect();
        assert!(ratios.len() >= 6 && median(ratios.clone()) >= 3.0, "{seed}: {ratios:?}");
    }
}

/// A later hit on the same surface ends at the cracks of the first and closes cells with them, and crosses none.
#[test]
fn later_hits_end_at_older_cracks() {
    for (name, preset) in &PRESETS {
        let (mut met, mut crossed) = (0, 0);
        for seed in 0..24 {
            let hits = [(Vec2::new(0.35, 0.45), 1.0), (Vec2::new(0.65, 0.55), 1.0), (Vec2::new(0.4, 0.52), 2.0)];
            let growth = grown(preset, Vec2::ONE, &hits, seed);
            crossed += assert_planar(&growth, seed);
            let nodes = growth.network().nodes();
            let of = |node: u32| nodes[node as usize].impact;
            let junctions = growth.network().links().iter().filter(|link| link.kind == LinkKind::Junction);
            met += junctions.filter(|link| of(link.a) != of(link.b)).count();
        }
        println!("{name}: {met} ends at another hit's cracks, {crossed} pairs of pieces");
        assert!(met > 24 * 4, "{name}: only {met} ends met");
    }
}

/// Random parameters with rays.
pub(super) fn random_rays(rng: &mut Rng) -> GrowthParams {
    let params = random_params(rng, true);
    let step_length = rng.range(0.01, 0.05);
    let crack_radius = rng.range(0.08, 0.6).max(2.0 * step_length);
    let (count, radius) = (1 + rng.next_u32() % 30, 0.08 * rng.unit());
    GrowthParams {
        step_length,
        crack_radius,
        kill_distance: rng.range(0.004, 0.05).min(crack_radius),
        markers: MarkerLayout::Rays { sectors: 1 + rng.next_u32() % 40, jitter: rng.unit(), through: rng.unit() },
        starts: match rng.next_u32() % 5 {
            0 => StartLayout::Point,
            1 => StartLayout::Ring { count, radius },
            _ => StartLayout::Crushed { count, radius },
        },
        forks: if rng.unit() < 0.4 { 0.0 } else { 0.1 * rng.unit() },
        fork_angle: rng.range(0.2, 1.5),
        reach: rng.range(0.1, 2.0),
        wander: 0.2 * rng.unit(),
        zigzag: 0.0,
        roughness: 0.1 * rng.unit(),
        draw_connections: rng.unit() < 0.7,
        draw_islands: false,
        connection_every: 1 + rng.next_u32() % 5,
        arrest: rng.range(0.005, 0.1),
        inertia: if rng.unit() < 0.3 { 0.0 } else { 3.0 * rng.unit() },
        open_ends: rng.unit(),
        variety: rng.unit(),
        tip_taper: 12.0 * rng.unit(),
        unevenness: 0.9 * rng.unit(),
        max_nodes: 100_000,
        draw_markers: false,
        ..params
    }
}

/// Growth with rays ends by itself, within the bound, with every marker accounted for and no line across another.
#[test]
fn always_ends_with_rays() {
    let mut kinds = BTreeSet::new();
    for case in 0..800u64 {
        let mut rng = Rng::new(case).stream("ends with rays");
        let mut params = random_rays(&mut rng);
        let crosses = rng.unit() < 0.15;
        if crosses {
            params.arrest = 0.0;
        }
        params.validate().unwrap();
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        for _ in 0..3 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, 6.0 * rng.unit());
            for _ in 0..rng.next_u32() % 40 {
                growth.step();
            }
        }
        let starts = growth.network().nodes().iter().filter(|node| node.parent == NO_PARENT).count() as u64;
        let bound = params.most_nodes(u64::from(growth.marker_counts().total), starts);
        while growth.step().grew() {
            assert!((growth.network().nodes().len() as u64) < bound, "case {case}: {params:?}");
        }
        let census = growth.marker_counts();
        assert!(!growth.is_growing(), "case {case}");
        assert_eq!(census.attracting, 0, "case {case}: {params:?}");
        assert_eq!(census.killed + census.waiting, census.total, "case {case}: {census:?}");
        if !crosses && case % 5 == 0 {
            assert_planar(&growth, case);
        }
        kinds.extend(growth.network().links().iter().map(|link| link.kind as u32));
    }
    assert!(kinds.len() >= 2, "rings and junctions came");
}

/// Cracks that start where no ray has come yet lie on the surface, and belong to a hit.
#[test]
fn cracks_that_start_among_rays_belong_to_a_hit() {
    let mut started = 0;
    for seed in 0..20 {
        let params = GrowthParams { nucleation: 4.0, ..CrackPreset::GLASS.growth };
        let mut growth = CrackGrowth::new(params, Vec2::new(1.5, 1.0), seed).unwrap();
        for (hits, at) in (1..).zip([Vec2::new(0.02, 0.03), Vec2::new(1.2, 0.99)]) {
            growth.hit(at, 2.0);
            while growth.step().grew() {}
            for node in growth.network().nodes() {
                let is_within = node.pos.cmpge(Vec2::ZERO).all() && node.pos.cmple(Vec2::new(1.5, 1.0)).all();
                assert!(is_within && node.impact < hits, "seed {seed}: {node:?}");
            }
        }
        started += growth.nucleated;
    }
    assert!(started > 20, "{started}");
}

/// There is no room for all nodes with which a hit would begin.
#[test]
fn a_hit_begins_with_no_more_nodes_than_there_may_be() {
    for name in CrackPreset::NAMES {
        for max_nodes in [1, 2, 5, 30] {
            let params = GrowthParams { max_nodes, ..CrackPreset::named(name).unwrap().growth };
            let mut growth = CrackGrowth::new(params, Vec2::ONE, 3).unwrap();
            for at in [0.5, 0.2] {
                growth.hit(Vec2::splat(at), 4.0);
                while growth.step().grew() {}
            }
            let count = growth.network().nodes().len();
            assert!((1..=max_nodes as usize).contains(&count), "{name}: {count} nodes of {max_nodes}");
        }
    }
}

/// Their markers may lie beyond the border, also where nothing stops them.
#[test]
fn rays_stay_on_the_surface() {
    let mut rng = Rng::new(8);
    let mut ends = 0;
    for seed in 0..60 {
        let params = GrowthParams {
            markers: MarkerLayout::Rays { sectors: 3 + rng.next_u32() % 14, jitter: rng.unit(), through: rng.unit() },
            wander: 0.3 * rng.unit(),
            arrest: 0.0,
            ..GrowthParams::DEFAULT
        };
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params, extent, seed).unwrap();
        for _ in 0..2 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, rng.range(0.05, 3.0));
            while growth.step().grew() {}
        }
        for (index, node) in growth.network().nodes().iter().enumerate() {
            assert!(
                node.pos.cmpge(Vec2::ZERO).all() && node.pos.cmple(extent).all(),
                "{seed}: {node:?} is off {extent}"
            );
            ends += u32::from(on_border(&growth, index));
        }
        // No node lies on the one that it has grown from.
        let nodes = growth.network().nodes();
        let lengths = nodes.iter().filter_map(|node| Some(nodes.get(node.parent as usize)?.pos.distance(node.pos)));
        assert!(lengths.fold(f32::INFINITY, f32::min) > 0.0, "{seed}");
    }
    assert!(ends > 60, "{ends} ends on the border");
}

/// However short the runs and however many the forks, the plan of a hit stays of a size that a frame has time for.
#[test]
fn b5_the_plan_of_a_hit_is_bounded() {
    let params = GrowthParams {
        markers: MarkerLayout::Rays { sectors: 360, jitter: 1.0, through: 1.0 },
        step_length: 0.001,
        crack_radius: 0.001,
        kill_distance: 0.0005,
        forks: 1.0,
        ..CrackPreset::GLASS.growth
    };
    for extent in [Vec2::ONE, Vec2::new(4.0, 0.5)] {
        let hit = PlannedHit { pos: 0.5 * extent, energy: 20.0, reach: 4.0, seed: 5 };
        let plan = Plan::new(&params, hit, extent).expect("rays");
        let points: usize = plan.rays.iter().map(|ray| ray.line.len()).sum();
        assert!((15_000..200_000).contains(&points), "{points} points of {} rays", plan.rays.len());
        assert!(plan.chords.len() <= plan.rays.len() * MOST_RINGS as usize);
    }
}

/// A density that is no number counts as 0, for rays as for other layouts.
#[test]
fn there_are_no_rays_where_density_is_no_number() {
    for preset in [CrackPreset::GLASS, CrackPreset::CONCRETE] {
        let mut growth = CrackGrowth::new(preset.growth, Vec2::ONE, 1).unwrap();
        let density = Some(Grid::new(UVec2::ONE, f32::NAN));
        growth.set_mask(CrackMask { density, ..CrackMask::default() });
        growth.hit(Vec2::splat(0.5), 1.0);
        assert_eq!(growth.marker_counts().total, 0);
    }
}
