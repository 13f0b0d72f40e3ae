//! Hits whose cracks are strands.

use crate::{
    CrackPreset,
    growth::{CrackGrowth, GrowthParams, HitOutcome, MarkerLayout, ParamError},
    math::Rng,
    pattern::PathPoint,
    strands::StrandParams,
};
use glam::Vec2;

const PRESETS: [CrackPreset; 3] = [CrackPreset::ASPHALT, CrackPreset::MARBLE, CrackPreset::SAND];

fn length(growth: &CrackGrowth) -> f32 {
    let network = growth.network();
    let ends = network.segments().filter_map(|segment| network.ends(segment));
    ends.map(|(a, b)| network.nodes()[a as usize].pos.distance(network.nodes()[b as usize].pos)).sum()
}

fn strands(params: &mut GrowthParams) -> (&mut u32, &mut StrandParams) {
    match &mut params.markers {
        MarkerLayout::Strands { count, strands } => (count, strands),
        _ => panic!("not strands"),
    }
}

/// Without branches, noise and neighbours every strand ends where its length does, all around the hit.
#[test]
fn strands_are_as_long_as_they_are_to_be() {
    let mut params = GrowthParams { variety: 0.0, roughness: 0.0, ..CrackPreset::ASPHALT.growth };
    let (_, settings) = strands(&mut params);
    *settings = StrandParams { depth: 0, rotation: 0.0, sideways: 0.0, repulsion: 0.0, ..*settings };
    for (energy, share) in [(0.25, 0.5), (1.0, 1.0), (1.5f32, 1.5f32.sqrt())] {
        let mut growth = CrackGrowth::new(params.clone(), Vec2::splat(2.0), 3).unwrap();
        growth.hit(Vec2::ONE, energy);
        while growth.step().grew() {}
        let nodes = growth.network().nodes();
        let has_child = |node: usize| nodes.iter().any(|child| child.parent as usize == node);
        let tips: Vec<Vec2> = (0..nodes.len()).filter(|&node| !has_child(node)).map(|node| nodes[node].pos).collect();
        // Side lines of primitives have tips too.
        let ends: Vec<Vec2> = tips.into_iter().filter(|tip| tip.distance(Vec2::ONE) > 0.348 * share).collect();
        assert!(ends.len() >= 2, "energy {energy}: {ends:?}");
        for end in ends {
            let distance = end.distance(Vec2::ONE);
            assert!((distance - 0.36 * share).abs() < 0.013, "energy {energy}: {distance}");
        }
    }
}

/// Whether the drawn lines of two pieces cross.
fn crosses(one: &[PathPoint], other: &[PathPoint]) -> bool {
    let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).as_dvec2().perp_dot((r - p).as_dvec2());
    let (a, b, c, d) = (one[0].pos, one[1].pos, other[0].pos, other[1].pos);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

#[test]
fn strands_of_several_hits_never_cross() {
    for (preset, seed) in PRESETS.iter().flat_map(|preset| (0..4).map(move |seed| (preset, seed))) {
        let mut rng = Rng::new(seed).stream("hits");
        let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).unwrap();
        for _ in 0..5 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()), 0.5 + rng.unit());
            for _ in 0..rng.next_u32() % 60 {
                growth.step();
            }
        }
        while growth.step().grew() {}
        let network = growth.network();
        let paths: Vec<_> = network.segments().filter_map(|segment| network.path(segment)).collect();
        for (i, one) in paths.iter().enumerate() {
            for other in &paths[..i] {
                let pairs = one.points().windows(2).flat_map(|a| other.points().windows(2).map(move |b| (a, b)));
                for (a, b) in pairs {
                    assert!(!crosses(a, b), "seed {seed}: {a:?} {b:?}");
                }
            }
        }
    }
}

/// A hit on a place that was hit before adds strands; none of the old ones moves.
#[test]
fn more_energy_adds_strands() {
    for preset in PRESETS {
        let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::splat(3.0), 1).unwrap();
        assert_eq!(growth.hit(Vec2::splat(1.5), 1.0), HitOutcome::Started(0));
        while growth.step().grew() {}
        let before: Vec<Vec2> = growth.network().nodes().iter().map(|node| node.pos).collect();
        let drawn = length(&growth);
        assert_eq!(growth.hit(Vec2::splat(1.5), 7.0), HitOutcome::Merged(0));
        while growth.step().grew() {}
        let after = growth.network().nodes();
        assert!(after.iter().zip(&before).all(|(node, pos)| node.pos == *pos));
        assert!(length(&growth) > 1.3 * drawn, "{} {drawn}", length(&growth));
    }
}

/// A hit on a strand starts strands from it.
#[test]
fn a_hit_on_a_strand_starts_from_it() {
    for preset in PRESETS {
        let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, 2).unwrap();
        growth.hit(Vec2::splat(0.5), 1.0);
        while growth.step().grew() {}
        let nodes = growth.network().nodes();
        let on = nodes.iter().max_by(|a, b| a.generation.cmp(&b.generation).then(a.birth.cmp(&b.birth))).unwrap().pos;
        let count = nodes.len();
        growth.hit(on, 1.0);
        while growth.step().grew() {}
        let new = &growth.network().nodes()[count..];
        assert!(new.len() > 10 && new.iter().any(|node| (node.parent as usize) < count), "{on} {}", new.len());
    }
}

#[test]
fn settings_of_strands_are_checked_and_set_by_name() {
    let mut params = CrackPreset::SAND.growth;
    params.set("strands.rotation", "0.75").unwrap();
    params.set("strand_count", "9").unwrap();
    assert_eq!(*strands(&mut params).0, 9);
    assert_eq!(strands(&mut params).1.rotation, 0.75);
    assert!(
        matches!(params.set("strands.rotation", "x"), Err(ParamError::Unreadable { name, .. }) if name == "strands.rotation")
    );
    assert!(matches!(params.set("strands.colour", "1"), Err(ParamError::Unknown { .. })));
    strands(&mut params).1.inertia = f32::NAN;
    assert!(matches!(params.validate(), Err(ParamError::OutOfRange { name: "strands.inertia", .. })));
    strands(&mut params).1.inertia = 0.5;
    *strands(&mut params).0 = 0;
    assert!(matches!(params.validate(), Err(ParamError::OutOfRange { name: "strand_count", .. })));
    for by in [0.0, 0.01, 0.3, 7.0, 100.0, f32::INFINITY] {
        for preset in PRESETS {
            assert_eq!(preset.growth.scaled(by).validate(), Ok(()), "{by}");
        }
    }
}

/// Whatever the settings, a hit makes no more than so many points, and its growth ends.
#[test]
fn wild_settings_of_strands_are_bounded() {
    for case in 0..12u64 {
        let mut rng = Rng::new(case).stream("wild");
        let mut params = PRESETS[case as usize % 3].growth.clone();
        let (count, settings) = strands(&mut params);
        *count = 1 + rng.next_u32() % 1024;
        *settings = StrandParams {
            length: [64.0, 4.0, 0.001][case as usize % 3],
            step: [0.0001, 0.001, 0.05][rng.next_u32() as usize % 3],
            tile: [0.01, 0.1, 1.0][rng.next_u32() as usize % 3],
            branch_cost: [0.005, 0.2][rng.next_u32() as usize % 2],
            depth: rng.next_u32() % 4,
            child_length: rng.unit(),
            repulsion: 0.1 * rng.unit() * rng.unit(),
            lanes: 1 + rng.next_u32() % 3,
            pace: [0.0005, 0.02, 1.0][rng.next_u32() as usize % 3],
            ..*settings
        };
        params.step_length = 0.03;
        params.num_iterations = 100_000;
        params.max_nodes = 1500;
        params.validate().unwrap();
        let mut growth = CrackGrowth::new(params, Vec2::new(1.0, 1.0 + rng.unit()), case).unwrap();
        for _ in 0..2 {
            growth.begin_hit(Vec2::new(rng.unit(), rng.unit()), 16.0 * rng.unit());
            // Each has room for a whole try.
            let mut tries = 0;
            while growth.continue_hit(u32::MAX) {
                tries += 1;
            }
            assert!(tries < 40, "case {case}: {tries} tries");
            assert!(
                growth.strands.iter().map(|paths| paths.network.nodes.len()).sum::<usize>() < 1 << 20,
                "case {case}"
            );
            while growth.step().grew() {}
        }
        assert!(!growth.is_growing() && growth.network().nodes().len() <= 1500, "case {case}");
    }
}

/// A hit is laid out in slices, and the cracks are those of a hit at once.
#[test]
fn slices_do_not_change_the_strands() {
    for (preset, seed) in PRESETS.iter().flat_map(|preset| (0..3).map(move |seed| (preset, seed))) {
        let grow = |in_slices: bool| {
            let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).unwrap();
            let mut slices = 0;
            for (at, energy) in [(Vec2::new(0.02, 0.9), 4.0), (Vec2::new(0.5, 0.4), 1.0), (Vec2::new(0.5, 0.4), 3.0)] {
                growth.begin_hit(at, energy);
                while in_slices && growth.continue_hit(64) {
                    assert!(growth.is_laying_out());
                    slices += 1;
                }
                for _ in 0..30 {
                    while in_slices && !growth.prepare_step(64) {
                        slices += 1;
                    }
                    growth.step();
                }
            }
            while growth.step().grew() {}
            (growth.network().nodes().to_vec(), slices)
        };
        let ((sliced, slices), (at_once, _)) = (grow(true), grow(false));
        assert_eq!(sliced, at_once, "seed {seed}");
        assert!(slices > 100, "{slices} slices");
    }
}

/// Strands are laid out before a step, in slices, and never in it: a step after which more are to be laid out adds no node and says
/// that growth goes on.
#[test]
fn steps_do_not_lay_out_strands() {
    let mut without_nodes = 0;
    for (preset, seed) in PRESETS.iter().flat_map(|preset| (0..3).map(move |seed| (preset, seed))) {
        let mut rng = Rng::new(seed).stream("steps");
        let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).unwrap();
        for _ in 0..8 {
            growth.begin_hit(Vec2::new(rng.unit(), rng.unit()), rng.range(0.5, 3.0));
            loop {
                while !growth.prepare_step(256) {}
                assert!(!growth.is_laying_out());
                let report = growth.step();
                if !report.grew() {
                    break;
                }
                if report.born == 0 {
                    assert!(growth.is_growing() && growth.is_laying_out(), "seed {seed}");
                    without_nodes += 1;
                }
            }
            assert!(!growth.is_growing() && !growth.is_laying_out(), "seed {seed}");
        }
    }
    assert!(without_nodes > 0);
}
