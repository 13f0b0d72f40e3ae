//! Hits whose markers are laid out in slices.

use super::{fingerprint, random_extent, random_params};
use crate::{
    CrackPreset, Grid,
    growth::{CrackGrowth, GrowthParams, MarkerCounts, MarkerLayout, StepReport},
    math::{Rng, hash_unit, mix},
    pattern::{CrackMask, SegmentId},
};
use glam::Vec2;
use std::collections::HashMap;

/// Places, then numbers of markers.
fn markers(growth: &CrackGrowth) -> (Vec<[u32; 2]>, [u32; 4]) {
    let census = growth.marker_counts();
    let places = growth.field.unsettled().map(|(pos, _)| pos.to_array().map(f32::to_bits)).collect();
    (places, [census.total, census.killed, census.attracting, census.waiting])
}

/// A step whose markers settle in slices; not all of them, at times. Returns the slices.
fn step_in_slices(growth: &mut CrackGrowth, rng: &mut Rng) -> (StepReport, u32) {
    let most = rng.next_u32() % 40;
    let slices = (0..most).take_while(|_| {
        let is_left = !growth.prepare_step(1 + rng.next_u32() % 60);
        let MarkerCounts { total, killed, attracting, waiting } = growth.marker_counts();
        assert_eq!(total, killed + attracting + waiting);
        is_left
    });
    let slices = slices.count() as u32;
    (growth.step(), slices)
}

/// Fault B5: however a hit is sliced, markers and cracks are the same to the last bit; also if something else is asked of the growth
/// before all are laid out.
#[test]
fn b5_slices_of_any_size_lay_out_the_same() {
    let (mut sliced, mut interrupted, mut settled) = (0, 0, 0);
    for case in 0..400u64 {
        let mut rng = Rng::new(case).stream("slices");
        let params = random_params(&mut rng, true);
        let extent = random_extent(&mut rng);
        let mut at_once = CrackGrowth::new(params, extent, case).unwrap();
        if rng.unit() < 0.3 {
            let values = (0..64).map(|_| rng.unit()).collect();
            let layer = Grid::from_vec([8, 8].into(), values).unwrap();
            at_once.set_mask(CrackMask { weak: Some(layer), ..CrackMask::default() });
        }
        if rng.unit() < 0.3 {
            at_once.set_density(Grid::from_vec([4, 4].into(), (0..16).map(|_| rng.unit()).collect()));
        }
        let mut in_slices = at_once.clone();
        for _ in 0..3 {
            let (pos, energy) = (Vec2::new(rng.unit(), rng.unit()) * extent, 2.0 * rng.unit());
            assert_eq!(at_once.hit(pos, energy), in_slices.begin_hit(pos, energy), "case {case}");
            while in_slices.continue_hit(1 + rng.next_u32() % 40) {
                sliced += 1;
                if rng.unit() < 0.02 {
                    interrupted += 1;
                    break;
                }
            }
            // The next hit comes at once, or growth does what is left.
            let steps = rng.next_u32() % 12;
            if steps > 0 || !in_slices.is_laying_out() {
                for _ in 0..steps {
                    let (report, slices) = step_in_slices(&mut in_slices, &mut rng);
                    assert_eq!(at_once.step(), report, "case {case}");
                    settled += slices;
                }
                assert_eq!(markers(&at_once), markers(&in_slices), "case {case}");
            }
        }
        while at_once.step().grew() {}
        while in_slices.step().grew() {}
        assert_eq!(fingerprint(&at_once), fingerprint(&in_slices), "case {case}");
        assert_eq!(at_once.timeline().end(), in_slices.timeline().end(), "case {case}");
    }
    assert!(sliced > 5_000 && interrupted > 100, "{sliced} slices, {interrupted} interrupted");
    assert!(settled > 5_000, "{settled}");
}

/// The presets as they are shipped, fine as for a large wall.
#[test]
fn b5_fine_presets_in_slices() {
    for name in CrackPreset::NAMES {
        let growth = CrackPreset::named(name).unwrap().scaled(0.2).growth;
        let mut at_once = CrackGrowth::new(growth, Vec2::new(1.5, 1.0), 4).unwrap();
        let mut in_slices = at_once.clone();
        for pos in [Vec2::new(0.4, 0.5), Vec2::new(1.2, 0.3)] {
            assert_eq!(at_once.hit(pos, 1.0), in_slices.begin_hit(pos, 1.0));
            let most = 2048;
            let mut rng = Rng::new(4);
            let mut before = in_slices.marker_counts().total;
            let mut is_going_on = true;
            while is_going_on {
                is_going_on = in_slices.continue_hit(most);
                let now = in_slices.marker_counts().total;
                assert!(now - before <= most, "{name}: {} markers in a slice", now - before);
                before = now;
            }
            assert_eq!(markers(&at_once), markers(&in_slices), "{name}");
            for _ in 0..20 {
                at_once.step();
                step_in_slices(&mut in_slices, &mut rng);
            }
            assert_eq!(fingerprint(&at_once), fingerprint(&in_slices), "{name}");
        }
    }
}

/// Darts, beside those of a simple program that compares each with all others.
#[test]
fn darts_are_those_of_all_pairs() {
    let mut kept = 0;
    for case in 0..60u64 {
        let mut rng = Rng::new(case).stream("darts");
        let spacing = rng.range(0.02, 0.2);
        let params = GrowthParams {
            markers: MarkerLayout::DartThrowing { spacing },
            reach: rng.range(0.2, 1.5),
            arrest: 0.02,
            ..GrowthParams::DEFAULT
        };
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        for index in 0..3 {
            let pos = Vec2::new(rng.unit(), rng.unit()) * extent;
            assert_eq!(growth.field.unsettled().count(), 0);
            let settled = 0..growth.field.made_settled() as u32;
            let mut others: Vec<(Vec2, bool)> = settled.map(|i| (growth.field.marker(i).pos, true)).collect();
            // Hits near each other are one.
            if growth.impacts().iter().any(|impact| impact.pos.distance(pos) < 0.06) {
                continue;
            }
            let seed = mix(case ^ mix(growth.impacts().len() as u64 | 1 << 40));
            growth.hit(pos, 1.0);
            let reach = growth.reach_of(growth.impacts().len() as u32 - 1);
            others.extend(growth.network().nodes().iter().map(|node| (node.pos, false)));
            let side = spacing * std::f32::consts::FRAC_1_SQRT_2;
            let [columns, rows] = (extent / side).ceil().as_uvec2().to_array();
            let mut expected = Vec::new();
            for (round, y, x) in
                (0..6u64).flat_map(|round| (0..rows).flat_map(move |y| (0..columns).map(move |x| (round, y, x))))
            {
                let dart = mix(seed ^ (u64::from(y) << 32 | u64::from(x))).wrapping_add(round);
                let place = (Vec2::new(x as f32, y as f32) + Vec2::new(hash_unit(dart, 1), hash_unit(dart, 2))) * side;
                let is_on = place.cmple(extent).all() && place.distance(pos) < reach;
                let limit = spacing * spacing;
                let is_near = |&(other, is_marker): &(Vec2, bool)| {
                    let distance_sq = other.distance_squared(place);
                    if is_marker { distance_sq < limit } else { distance_sq <= limit }
                };
                if is_on && !others.iter().any(is_near) {
                    expected.push(place);
                    others.push((place, false));
                }
            }
            let found: Vec<Vec2> = growth.field.unsettled().map(|(pos, _)| pos).collect();
            assert!(found.len() >= expected.len() && found[..expected.len()] == expected, "case {case}, hit {index}");
            assert!(found.len() == expected.len() || found.len() == expected.len() + 3, "or those that any hit has");
            kept += expected.len();
            // One at least: it takes the markers up.
            for _ in 0..1 + rng.next_u32() % 10 {
                growth.step();
            }
        }
    }
    assert!(kept > 5_000, "{kept}");
}

/// Slices of nothing do a little: who waits for the last one does not wait for ever.
#[test]
fn slices_of_nothing_end() {
    for markers in [GrowthParams::DEFAULT.markers, MarkerLayout::DartThrowing { spacing: 0.04 }] {
        let mut at_once = CrackGrowth::new(GrowthParams { markers, ..GrowthParams::DEFAULT }, Vec2::ONE, 2).unwrap();
        let mut in_slices = at_once.clone();
        for pos in [Vec2::splat(0.4), Vec2::splat(0.7)] {
            at_once.hit(pos, 1.0);
            in_slices.begin_hit(pos, 1.0);
            assert!((0..100_000).any(|_| !in_slices.continue_hit(0)));
            assert!((0..100_000).any(|_| in_slices.prepare_step(0)));
            at_once.step();
            in_slices.step();
            assert_eq!(fingerprint(&at_once), fingerprint(&in_slices));
        }
    }
}

/// Widths of the points of each segment.
fn widths_of(growth: &CrackGrowth, segment: SegmentId) -> Option<Vec<u32>> {
    let path = growth.network().path(segment)?;
    Some(path.points().iter().map(|point| point.width.to_bits()).collect())
}

/// Steps made in parts of any size are steps, and whatever else is asked of the growth completes them first. What is drawn between two parts is
/// drawn again if it changes after that.
#[test]
fn steps_in_parts_are_the_same() {
    let (mut parts, mut stepped, mut interrupted) = (0, 0, 0);
    for case in 0..300u64 {
        let mut rng = Rng::new(case).stream("parts");
        let mut at_once = CrackGrowth::new(random_params(&mut rng, true), random_extent(&mut rng), case).unwrap();
        let mut in_parts = at_once.clone();
        let (mut drawn, mut changed) = (HashMap::new(), Vec::new());
        for _ in 0..4 {
            let pos = Vec2::new(rng.unit(), rng.unit()) * at_once.network().extent();
            let energy = 2.0 * rng.unit();
            assert_eq!(at_once.hit(pos, energy), in_parts.hit(pos, energy), "case {case}");
            for _ in 0..rng.next_u32() % 30 {
                let report = at_once.step();
                let most = rng.next_u32() % if rng.unit() < 0.5 { 3 } else { 20 };
                let made = (0..most).find_map(|_| {
                    parts += 1;
                    let made = in_parts.continue_step(rng.next_u32() % 12);
                    in_parts.take_changed(&mut changed);
                    drawn.extend(changed.drain(..).map(|segment| (segment, widths_of(&in_parts, segment))));
                    made
                });
                let is_in_step = in_parts.is_in_step();
                assert!(!is_in_step || (made.is_none() && in_parts.is_growing()), "case {case}");
                if is_in_step && rng.unit() < 0.5 {
                    interrupted += 1;
                    in_parts.set_density(None);
                    at_once.set_density(None);
                } else {
                    stepped += u32::from(is_in_step);
                    assert_eq!(made.unwrap_or_else(|| in_parts.step()), report, "case {case}");
                }
                assert!(!in_parts.is_in_step());
                assert_eq!(at_once.new_nodes(), in_parts.new_nodes(), "case {case}");
            }
            assert_eq!(fingerprint(&at_once), fingerprint(&in_parts), "case {case}");
        }
        assert_eq!(at_once.timeline().end(), in_parts.timeline().end(), "case {case}");
        in_parts.take_changed(&mut changed);
        drawn.extend(changed.drain(..).map(|segment| (segment, widths_of(&in_parts, segment))));
        for node in 0..in_parts.network().nodes().len() as u32 {
            let widths = widths_of(&in_parts, SegmentId::Branch(node));
            assert_eq!(drawn.get(&SegmentId::Branch(node)).cloned().flatten(), widths, "case {case}, node {node}");
        }
    }
    assert!(parts > 10_000 && stepped > 250 && interrupted > 250, "{parts} parts, {stepped} and {interrupted} steps");
}
