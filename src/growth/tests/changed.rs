//! Growths that go on with other parameters.

use super::*;
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
        assert_eq!([0, 1, 2].map(|impact| division.reach_of(impact)), [f32::INFINITY, f32::INFINITY, growth.reach_of(2)]);
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
    let mut growth = CrackGrowth::new(CrackPreset::TEMPERED_GLASS.growth, Vec2::ONE, 3).unwrap();
    assert!(growth.add_cracks(added.network(), 90) > 90);
    growth.hit(Vec2::splat(0.5), 1.0);
    grown_out(&mut growth);
    let most = most_begun_at_once(&growth, 0);
    assert!((5..=33).contains(&most), "{most} in a step");
}
