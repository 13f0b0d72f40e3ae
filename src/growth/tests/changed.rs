//! Growths that go on with other parameters.

use super::*;

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
