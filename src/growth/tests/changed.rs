//! Growths that go on with other parameters.

use super::*;
use crate::{growth::field::ANY_IMPACT, pattern::Node};
use std::collections::BTreeMap;

fn grown_out(growth: &mut CrackGrowth) {
    while growth.step().grew() {}
}

/// Cracks that divide domains know how far each hit has loaded the surface, also after hits of other cracks, which have loaded all of it.
#[test]
fn hits_before_cracks_divided_have_loaded_all() {
    for before in [CrackPreset::GLASS, CrackPreset::CONCRETE] {
        let mut growth = CrackGrowth::new(before.growth, Vec2::new(1.5, 1.0), 3).unwrap();
        growth.hit(Vec2::new(0.3, 0.3), 1.0);
        growth.hit(Vec2::new(0.5, 0.8), 1.0);
        grown_out(&mut growth);
        growth.set_params(CrackPreset::CLAY.growth).unwrap();
        assert_eq!(growth.hit(Vec2::new(1.1, 0.6), 2.0), HitOutcome::Started(2));
        let division = growth.division.as_ref().unwrap();
        assert_eq!(
            [0, 1, 2].map(|impact| division.reach_of(impact)),
            [f32::INFINITY, f32::INFINITY, growth.reach_of(2)]
        );
        assert!(growth.is_beyond_rim(2, Vec2::X * growth.reach_of(2)) && !growth.is_beyond_rim(0, Vec2::X * 1e6));
    }
}

/// Cracks of an impact that began by themselves, in the step in which most of them did.
fn most_begun_at_once(growth: &CrackGrowth, impact: u32) -> u32 {
    let mut count = BTreeMap::<u32, u32>::new();
    for node in growth.network().nodes().iter().filter(|node| node.parent == NO_PARENT && node.impact == impact) {
        *count.entry(node.birth).or_default() += 1;
    }
    count.into_values().max().unwrap_or_default()
}

/// As many cracks begin by themselves in a step as the parameters say, whatever has begun before they were set.
#[test]
fn other_parameters_begin_their_own_cracks() {
    let local = |preset: CrackPreset| GrowthParams { reach: 0.3, ..preset.growth };
    let (glass, clay) = (local(CrackPreset::TEMPERED_GLASS), local(CrackPreset::CLAY));
    let extent = Vec2::new(2.0, 1.0);
    let grown = |first: &GrowthParams, second: &GrowthParams| {
        let mut growth = CrackGrowth::new(first.clone(), extent, 3).unwrap();
        for at in [Vec2::new(0.4, 0.5), Vec2::new(1.5, 0.5)] {
            growth.hit(at, 1.0);
            grown_out(&mut growth);
            growth.set_params(second.clone()).unwrap();
        }
        growth
    };
    let begun = |growth: &CrackGrowth| {
        growth.network().nodes().iter().filter(|node| node.parent == NO_PARENT && node.impact == 1).count()
    };
    let (usual, later) = (begun(&grown(&clay, &clay)), begun(&grown(&glass, &clay)));
    assert!(usual > 5 && 2 * later > usual, "{later} after tempered glass, {usual} otherwise");
    let most = most_begun_at_once(&grown(&clay, &glass), 1);
    assert!((5..=33).contains(&most), "{most} in a step");
    // One that does not divide before: what it did not begin is not begun later.
    let open = GrowthParams { nucleation: glass.nucleation, ..local(CrackPreset::CONCRETE) };
    let most = most_begun_at_once(&grown(&open, &glass), 1);
    assert!((5..=33).contains(&most), "{most} in a step");
}

/// Cracks that are added take steps in which none begins by itself: the next hit does not begin all of them at once.
#[test]
fn added_cracks_leave_no_cracks_due() {
    let mut added = CrackGrowth::new(GrowthParams { reach: 0.1, ..GrowthParams::DEFAULT }, Vec2::ONE, 3).unwrap();
    added.hit(Vec2::splat(0.1), 1.0);
    grown_out(&mut added);
    let glass = GrowthParams { front: 0.0, ..CrackPreset::TEMPERED_GLASS.growth };
    let open = GrowthParams { crack_radius: 0.1, nucleation: 2.0, ..CrackPreset::CONCRETE.growth };
    for params in [glass, open] {
        // The first step may begin what is due in two, beside what the hit itself has begun.
        let due = 2 * params.nucleation as u32 + 2;
        let mut growth = CrackGrowth::new(params, Vec2::ONE, 3).unwrap();
        assert!(growth.add_cracks(added.network(), 90) > 90);
        growth.hit(Vec2::splat(0.6), 1.0);
        grown_out(&mut growth);
        let most = most_begun_at_once(&growth, 0);
        assert!((1..=due).contains(&most), "{most} in a step");
    }
}

/// The living markers know their squared distances to all cracks, as far as a crack reaches. Returns how many are farther than `far`.
fn assert_known(growth: &mut CrackGrowth, far: f32) -> usize {
    growth.field.settle(&growth.network.nodes, &growth.nodes);
    let living = (0..growth.field.made_settled() as u32).filter(|&marker| growth.field.near_sq(marker) >= 0.0);
    let expected = living.map(|marker| {
        let pos = growth.field.marker(marker).pos;
        let nearest = growth.network().nodes().iter().map(|node| node.pos.distance_squared(pos));
        let expected = nearest.fold(growth.params.crack_radius.powi(2), f32::min);
        assert_eq!(growth.field.near_sq(marker), expected, "{pos}");
        expected
    });
    expected.filter(|&expected| expected > far * far).count()
}

/// Markers do not keep what they knew for other cracks: cracks that divide know how far each is from all cracks, and others take those near the
/// border.
#[test]
fn markers_look_again_for_other_cracks() {
    let extent = Vec2::new(1.5, 1.0);
    for (seed, venation) in [(1, Venation::Open), (2, Venation::Closed), (3, Venation::Open)] {
        let near = GrowthParams {
            crack_radius: 0.05,
            reach: 0.9,
            draw_islands: false,
            venation,
            ..CrackPreset::CONCRETE.growth
        };
        let mut growth = CrackGrowth::new(near, extent, seed).unwrap();
        growth.hit(Vec2::new(0.7, 0.5), 1.0);
        for _ in 0..6 {
            growth.step();
        }
        growth.set_params(CrackPreset::CLAY.growth).unwrap();
        assert!(assert_known(&mut growth, 0.051) > 50, "seed {seed}");
        for steps in [0, 6] {
            let mut growth = CrackGrowth::new(CrackPreset::CLAY.growth, extent, seed).unwrap();
            growth.hit(Vec2::new(0.7, 0.5), 2.0);
            for _ in 0..steps {
                growth.step();
            }
            growth.set_params(CrackPreset::CONCRETE.growth).unwrap();
            assert!(assert_known(&mut growth, 0.1) > 20, "seed {seed}, {steps} steps");
        }
    }
}

/// After each of many hits on a large surface every marker knows the nearest of the nodes that may take it, whether it looked for it again or not.
#[test]
fn markers_know_the_nearest_node_after_each_hit() {
    let extent = Vec2::new(2.0, 1.5);
    let mut growth = CrackGrowth::new(CrackPreset::CONCRETE.scaled(0.12).growth, extent, 5).unwrap();
    let (mut rng, mut known, mut waiting) = (Rng::new(9), 0, 0);
    for _ in 0..60 {
        growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, 0.5);
        growth.field.settle(&growth.network.nodes, &growth.nodes);
        let limit = growth.params.crack_radius.powi(2);
        growth.field.each_living(|pos, near_sq, owner| {
            let takes = |node: &&Node| owner == ANY_IMPACT || owner == node.impact;
            let own = growth.network.nodes.iter().filter(takes).map(|node| node.pos.distance_squared(pos));
            assert_eq!(near_sq, own.fold(limit, f32::min), "{pos}");
            *if near_sq < limit { &mut known } else { &mut waiting } += 1;
        });
        (0..1 + rng.next_u32() % 8).for_each(|_| _ = growth.step());
    }
    assert!(growth.network.nodes.len() > 3000 && known > 5000 && waiting > 1000, "{known} {waiting}");
}
