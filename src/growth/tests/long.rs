//! Growths that have gone on for very long.

use crate::{
    CrackPreset,
    growth::{CrackGrowth, GrowthParams},
    math::Rng,
    pattern::{Moment, Node, SurfaceFrame},
    raster::{DepthField, Profile, Replay, ReplayChanges},
};
use glam::{UVec2, Vec2};

/// Ten million steps of a surface that is hit again and again: what it holds stays bounded, and steps that grow nothing cost and count nothing.
#[test]
fn b6_ten_million_steps() {
    let params = GrowthParams { max_nodes: 600, ..CrackPreset::CONCRETE.growth };
    let mut growth = CrackGrowth::new(params, Vec2::ONE, 7).unwrap();
    let mut rng = Rng::new(6);
    let (mut grown, mut calls, mut idle) = (0u32, 0u32, 0u32);
    let mut changed = Vec::new();
    while calls < 10_000_000 {
        if calls.is_multiple_of(20_000) {
            if growth.nodes_left() < 300 {
                growth.remove_oldest(300);
            }
            growth.hit(Vec2::new(rng.unit(), rng.unit()), 0.3);
        }
        grown += u32::from(growth.is_growing());
        idle += u32::from(!growth.step().grew());
        calls += 1;
        if calls.is_multiple_of(1000) {
            growth.take_changed(&mut changed);
            changed.clear();
        }
    }
    assert_eq!(growth.steps_made(), grown);
    assert!(grown > 3000 && idle > 9_000_000, "{grown} steps of growth, {idle} idle");
    assert!(growth.network().nodes().len() <= 600 && growth.steps() <= grown + 500);
    let counts = growth.marker_counts();
    assert_eq!(counts.total, counts.killed + counts.attracting + counts.waiting);
    assert!(counts.waiting < 20_000, "{counts:?}");
}

fn places(nodes: &[Node]) -> Vec<(Vec2, f32, u32)> {
    nodes.iter().map(|node| (node.pos, node.width, node.parent)).collect()
}

/// After ten million steps a hit grows what it grows on a fresh surface, and every moment of it can be shown.
#[test]
fn b6_cracks_are_shown_after_ten_million_steps() {
    for name in ["glass", "concrete", "toon"] {
        let begin = || CrackGrowth::new(CrackPreset::named(name).unwrap().growth, Vec2::ONE, 7).unwrap();
        let (mut fresh, mut old) = (begin(), begin());
        old.steps = 10_000_000;
        let frame = SurfaceFrame::new(UVec2::splat(96)).unwrap();
        for growth in [&mut fresh, &mut old] {
            growth.hit(Vec2::splat(0.5), 1.0);
            while growth.step().grew() {}
        }
        assert_eq!(places(fresh.network().nodes()), places(old.network().nodes()), "{name}");
        assert_eq!(old.steps() - fresh.steps(), 10_000_000);
        let shown = |growth: &CrackGrowth, moment: Moment| {
            let (mut field, mut replay) = (DepthField::new(frame), Replay::new(frame.size(), Profile::DEFAULT));
            let mut changes = ReplayChanges::default();
            replay.show(&mut field, growth.network(), growth.timeline(), moment, &mut changes);
            field.depth.as_slice().to_vec()
        };
        let mut last = 0;
        for step in [0, 1, fresh.steps().div_ceil(2), fresh.steps()] {
            let [one, other] =
                [(&fresh, 0), (&old, 10_000_000)].map(|(growth, before)| shown(growth, Moment::after(before + step)));
            assert_eq!(one, other, "{name}: after {step} steps");
            let drawn = one.iter().filter(|&&depth| depth > 0).count();
            assert_eq!(drawn > last, step > 0, "{name}: {drawn} texels after {step} steps");
            last = drawn;
        }
    }
}

/// Counters that have reached their end stay there: the surface goes on cracking.
#[test]
fn b6_counters_at_their_end_stay_there() {
    let mut cracked = 0;
    for name in CrackPreset::NAMES {
        for before_end in [0, 3, 40] {
            let params = GrowthParams { max_nodes: 2000, ..CrackPreset::named(name).unwrap().growth };
            let mut growth = CrackGrowth::new(params, Vec2::new(1.0, 1.5), 3).unwrap();
            let near = u32::MAX - before_end;
            (growth.steps, growth.record.steps, growth.nucleated, growth.tried) = (near, near, near, near);
            (growth.field.made, growth.field.killed) = (near, near);
            for at in [0.3, 0.7, 0.71] {
                growth.hit(Vec2::splat(at), 1.0);
                for _ in 0..60 {
                    growth.step();
                }
            }
            assert!(growth.steps() >= near && growth.steps_made() >= near);
            let counts = growth.marker_counts();
            assert!(counts.total >= near && counts.killed >= near, "{counts:?}");
            assert!((near..=growth.steps()).contains(&growth.timeline().end()), "{name} {before_end}");
            let network = growth.network();
            assert!(network.nodes().iter().all(|node| node.pos.is_finite() && node.width.is_finite()));
            for segment in network.segments() {
                let path = growth.timeline().path_at(network, segment, Moment::after(growth.steps()));
                assert!(path.is_none_or(|path| path.points().iter().all(|point| point.width.is_finite())));
            }
            cracked += network.nodes().len();
            let keep = network.nodes().len() as u32 / 2;
            growth.remove_oldest(keep);
            while growth.step().grew() {}
        }
    }
    assert!(cracked > 20_000, "{cracked}");
}
