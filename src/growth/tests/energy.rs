//! What energy does, and what the seed: the presets as they ship, hit once.

use super::arrest::assert_planar;
use crate::{
    CrackPreset,
    growth::{CrackGrowth, GrowthParams, HitOutcome},
    math::Rng,
    pattern::{Moment, NO_PARENT, Network, Node, SegmentId, SurfaceFrame},
    raster::{DepthField, Spot},
};
use glam::{UVec2, Vec2};

/// The presets for which this is promised: those whose cracks run from the hit. Not tempered glass, of which the whole pane goes at once.
const PRESETS: [&str; 4] = ["concrete", "plaster", "brick", "toon"];

/// Seeds of which a median is taken.
const SEEDS: u64 = 24;

fn grown(name: &str, seed: u64, pos: Vec2, energy: f32) -> CrackGrowth {
    let preset = CrackPreset::named(name).unwrap();
    let mut growth = CrackGrowth::new(preset.growth, Vec2::ONE, seed).unwrap();
    growth.hit(pos, energy);
    while growth.step().grew() {}
    growth
}

/// Length of all lines, and the area that they cover.
fn extent_of(growth: &CrackGrowth) -> (f32, f32) {
    let network = growth.network();
    let segments: Vec<SegmentId> = network.segments().collect();
    segments.into_iter().fold((0.0, 0.0), |(length, area), segment| {
        let path = network.path(segment).unwrap();
        let pieces = path.points().windows(2).map(|pair| {
            let long = pair[0].pos.distance(pair[1].pos);
            (long, long * 0.5 * (pair[0].width + pair[1].width))
        });
        pieces.fold((length, area), |(length, area), (long, covered)| (length + long, area + covered))
    })
}

fn median(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    values[values.len() / 2]
}

/// Lengths and areas of many seeds at one energy, hit anywhere but near the border.
fn of_seeds(name: &str, energy: f32) -> (Vec<f32>, Vec<f32>) {
    (0..SEEDS)
        .map(|seed| {
            let mut rng = Rng::new(seed).stream("where");
            let pos = Vec2::new(rng.range(0.3, 0.7), rng.range(0.3, 0.7));
            extent_of(&grown(name, seed, pos, energy))
        })
        .unzip()
}

#[test]
fn the_seed_does_not_outweigh_the_energy() {
    for name in PRESETS {
        for energy in [0.5, 1.0, 4.0] {
            let (lengths, _) = of_seeds(name, energy);
            let mean = lengths.iter().sum::<f32>() / lengths.len() as f32;
            let variance = lengths.iter().map(|length| (length - mean).powi(2)).sum::<f32>() / lengths.len() as f32;
            let variation = variance.sqrt() / mean;
            println!("{name} at {energy}: {mean:.2} long, varying by {variation:.2}");
            assert!(variation <= 0.25, "{name} at {energy}: {lengths:?}");
        }
    }
}

#[test]
fn more_energy_is_more_of_everything() {
    for name in PRESETS {
        let mut before = (0.0, 0.0);
        let mut at_one = (0.0, 0.0);
        for energy in [0.5, 1.0, 2.0, 4.0, 8.0] {
            let (lengths, areas) = of_seeds(name, energy);
            let now = (median(lengths), median(areas));
            println!("{name} at {energy}: {:.2} long, {:.2} % covered", now.0, 100.0 * now.1);
            assert!(now.0 > before.0 && now.1 > before.1, "{name} at {energy}: {now:?} after {before:?}");
            before = now;
            if energy == 1.0 {
                at_one = now;
            }
        }
        assert!(before.0 >= 2.5 * at_one.0 && before.1 >= 2.5 * at_one.1, "{name}: {before:?} from {at_one:?}");
    }
}

/// Area of what a hit crushes: holes, drawn pits, and texels that are clearly deeper or paler than before. Of tempered
/// glass only the hole counts.
fn crushed(name: &str, seed: u64, energy: f32) -> f32 {
    let preset = CrackPreset::named(name).unwrap();
    let mut rng = Rng::new(seed).stream("where");
    let pos = Vec2::new(rng.range(0.3, 0.7), rng.range(0.3, 0.7));
    let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).unwrap();
    growth.hit(pos, energy);
    let mut field = DepthField::new(SurfaceFrame::new(UVec2::splat(512)).unwrap());
    field.set_layers(preset.look.layer(seed));
    field.show_layers(growth.network(), growth.timeline(), Moment::after(1), &mut Vec::new());
    let zone = field.layer().crushed().unwrap();
    let counts = |spot: &&Spot| {
        let is_hole = spot.dark > 127 || spot.pit[0] > 0;
        is_hole || (name != "tempered_glass" && (spot.pale > 60 || spot.deep > 60))
    };
    let mut row = [Spot::default(); 512];
    let in_row = |y: u32| {
        zone.read(0, y, &mut row);
        row.iter().filter(counts).count()
    };
    (0..512).map(in_row).sum::<usize>() as f32
}

#[test]
fn more_energy_crushes_more() {
    for name in CrackPreset::NAMES {
        let areas = [0.5, 1.0, 2.0, 4.0, 8.0]
            .map(|energy| median((0..SEEDS).map(|seed| crushed(name, seed, energy)).collect()));
        println!("{name}: {areas:?} texels crushed");
        assert!(areas.windows(2).all(|pair| pair[1] > pair[0]), "{name}: {areas:?}");
        assert!(areas[4] >= 2.5 * areas[1], "{name}: {areas:?}");
    }
}

/// From root to tip the width of an arm of concrete falls to a third at least.
#[test]
fn arms_of_concrete_are_three_times_as_wide_at_the_root() {
    for seed in 0..SEEDS {
        let growth = grown("concrete", seed, Vec2::new(0.45, 0.55), 1.0);
        let nodes = growth.network().nodes();
        // For each arm its root and the node furthest along it.
        let mut arms = Vec::<(usize, usize)>::new();
        for (node, root) in (0..nodes.len()).filter_map(|node| {
            let mut root = node;
            while nodes[root].parent != 0 {
                root = nodes.get(nodes[root].parent as usize).map(|_| nodes[root].parent as usize)?;
            }
            Some((node, root))
        }) {
            match arms.iter_mut().find(|arm| arm.0 == root) {
                Some(arm) if nodes[arm.1].generation < nodes[node].generation => arm.1 = node,
                Some(_) => {}
                None => arms.push((root, node)),
            }
        }
        arms.retain(|(root, tip)| nodes[*tip].generation > nodes[*root].generation + 8);
        let ratios: Vec<f32> = arms.iter().map(|(root, tip)| nodes[*root].width / nodes[*tip].width).collect();
        assert!(ratios.len() >= 3 && median(ratios.clone()) >= 3.0, "{seed}: {ratios:?}");
    }
}

/// 400 hits, most of them near a border or in a corner: each leaves at least half of what is usual. Fewer on tempered glass, all of which cracks
/// wherever it is hit.
#[test]
fn no_hit_is_a_dud() {
    for name in CrackPreset::NAMES {
        let hits = if name == "tempered_glass" { 40 } else { 400 };
        let usual = median(of_seeds(name, 1.0).0);
        let mut duds = Vec::new();
        for seed in 0..hits {
            let mut rng = Rng::new(seed).stream("border");
            let near = |rng: &mut Rng| if rng.unit() < 0.5 { 0.06 * rng.unit() } else { 1.0 - 0.06 * rng.unit() };
            let pos = match seed % 4 {
                0 => Vec2::new(rng.unit(), rng.unit()),
                1 => Vec2::new(near(&mut rng), rng.unit()),
                2 => Vec2::new(rng.unit(), near(&mut rng)),
                _ => Vec2::new(near(&mut rng), near(&mut rng)),
            };
            let pos = if seed % 40 == 3 { pos.round() } else { pos };
            let (length, _) = extent_of(&grown(name, seed, pos, 1.0));
            if length < 0.5 * usual {
                duds.push((pos, length));
            }
        }
        assert!(duds.is_empty(), "{name}: usual {usual}, but {duds:?}");
    }
}

/// Length of the branches of an impact.
fn length_of(growth: &CrackGrowth, impact: u32) -> f32 {
    let network = growth.network();
    let is_of = |node: &u32| {
        let node = network.nodes()[*node as usize];
        node.impact == impact && node.parent != NO_PARENT
    };
    let length = |node: u32| {
        let node = network.nodes()[node as usize];
        node.pos.distance(network.nodes()[node.parent as usize].pos)
    };
    (0..network.nodes().len() as u32).filter(is_of).map(length).sum()
}

/// Hit after hit on one wall: those on cracked ground have arms too.
#[test]
fn later_hits_break_through_older_cracks() {
    for name in ["concrete", "brick", "toon"] {
        let usual = median(of_seeds(name, 1.0).0);
        let preset = CrackPreset::named(name).unwrap();
        let (mut lengths, mut duds) = (Vec::new(), 0);
        for seed in 0..24 {
            let mut rng = Rng::new(seed).stream("later");
            let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).unwrap();
            for _ in 0..8 {
                let outcome = growth.hit(Vec2::new(rng.range(0.1, 0.9), rng.range(0.1, 0.9)), 1.0);
                while growth.step().grew() {}
                if let HitOutcome::Started(impact @ 1..) = outcome {
                    let length = length_of(&growth, impact);
                    duds += u32::from(length < 0.1 * usual);
                    lengths.push(length);
                }
            }
            assert_planar(&growth, seed);
        }
        println!("{name}: {duds} of {} later hits have hardly a crack", lengths.len());
        assert!(lengths.len() > 100 && 20 * duds <= lengths.len() as u32, "{name}: {duds} of {}", lengths.len());
        assert!(median(lengths) > 0.3 * usual, "{name}");
    }
}

/// A hit beside a long crack: its arms go on beyond that, but not far from the hit.
#[test]
fn cracks_go_on_beyond_older_ones_near_the_hit_only() {
    let params = GrowthParams { wander: 0.0, roughness: 0.0, ..CrackPreset::CONCRETE.growth };
    let (mut through, mut stopped) = (0, 0);
    for seed in 0..40 {
        for (distance, is_near) in [(0.2, true), (0.73, false)] {
            let x = 0.5 + distance * params.reach;
            let mut older = Network::new(Vec2::ONE, 0.0, 0);
            for k in 0..=60u32 {
                let (pos, parent) = (Vec2::new(x, k as f32 / 60.0), k.checked_sub(1).unwrap_or(NO_PARENT));
                older.nodes.push(Node { pos, width: 0.002, parent, generation: k, birth: 0, impact: 0, bend: 0.0 });
            }
            let mut growth = CrackGrowth::new(params.clone(), Vec2::ONE, seed).unwrap();
            growth.add_cracks(&older, 0);
            growth.hit(Vec2::splat(0.5), 1.0);
            while growth.step().grew() {}
            let is_beyond = |node: &&Node| node.impact == 0 && node.pos.x > x + 0.02;
            let beyond = growth.network().nodes().iter().filter(is_beyond).count();
            if is_near {
                through += u32::from(beyond > 5);
            } else {
                stopped += u32::from(beyond == 0);
            }
        }
    }
    assert!(through >= 36 && stopped == 40, "{through} went on, {stopped} stopped");
}

/// Arms from the hit, and how sharply cracks turn.
#[test]
fn arms_go_with_the_energy_and_no_tip_turns_sharply() {
    for (name, at_one, at_four) in [("concrete", 4..=6, 6..=9), ("toon", 4..=7, 5..=10), ("plaster", 3..=6, 5..=9)] {
        for (energy, arms) in [(1.0, at_one), (4.0, at_four)] {
            for seed in 0..SEEDS {
                let growth = grown(name, seed, Vec2::new(0.45, 0.55), energy);
                let nodes = growth.network().nodes();
                let from_hit = nodes.iter().filter(|node| node.parent == 0).count();
                assert!(arms.contains(&from_hit), "{name} {seed} at {energy}: {from_hit} arms");
                for node in nodes.iter().filter(|node| node.parent != NO_PARENT) {
                    let parent = nodes[node.parent as usize];
                    let Some(before) = nodes.get(parent.parent as usize) else { continue };
                    let turn = (parent.pos - before.pos).angle_to(node.pos - parent.pos).to_degrees().abs();
                    let most = growth.params().fork_angle.to_degrees() * 1.25 + 0.5;
                    assert!(turn <= most.max(60.5), "{name} {seed}: {turn} degrees at {}", parent.pos);
                }
            }
        }
    }
}

/// The rules of every preset, with its numbers anything up to twice as much or half: growth ends by itself, within its bound.
#[test]
fn always_ends_with_the_rules_of_the_presets() {
    let names = CrackPreset::NAMES;
    for case in 0..10_000u64 {
        let mut rng = Rng::new(case).stream("rules");
        let mut params = CrackPreset::named(names[case as usize % names.len()]).unwrap().growth;
        let mut by = || crate::math::ops::exp(0.7 * rng.signed());
        for number in [
            &mut params.step_length,
            &mut params.kill_distance,
            &mut params.crack_radius,
            &mut params.inertia,
            &mut params.arrest,
            &mut params.nucleation,
            &mut params.grain,
            &mut params.courses,
        ] {
            *number *= by();
        }
        params.wander = (params.wander * by()).min(1.0);
        params.inertia = params.inertia.min(8.0);
        params.nucleation = params.nucleation.min(64.0);
        params.forks = (params.forks * by()).min(1.0);
        params.fork_angle = (params.fork_angle * by()).clamp(0.2, 1.6);
        params.crack_radius = params.crack_radius.max(params.kill_distance);
        // Coarse, so that there is time for many.
        params.step_length = params.step_length.max(0.015);
        params.reach = params.reach.min(0.35);
        params.num_iterations = 100_000;
        params.max_nodes = 1_000_000;
        params.validate().unwrap();
        let mut growth = CrackGrowth::new(params, Vec2::new(1.0, 0.7), case).unwrap();
        for _ in 0..1 + case % 2 {
            growth.hit(Vec2::new(rng.unit(), 0.7 * rng.unit()), rng.range(0.1, 3.0));
            for _ in 0..rng.next_u32() % 30 {
                growth.step();
            }
        }
        let starts = growth.network().nodes().iter().filter(|node| node.parent == NO_PARENT).count() as u64;
        let bound = growth.params().most_nodes(u64::from(growth.marker_counts().total), starts);
        while growth.step().grew() {
            assert!((growth.network().nodes().len() as u64) < bound, "case {case}");
        }
        let census = growth.marker_counts();
        assert!(!growth.is_growing() && growth.steps() < 100_000, "case {case}");
        assert_eq!(census.attracting, 0, "case {case}");
        assert_eq!(census.killed + census.waiting, census.total, "case {case}");
    }
}
