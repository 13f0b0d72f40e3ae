//! Strands on surfaces: made by a task, shown, struck, shattered into cells, healed, refused.

use crate::{
    guided::{bake, guided, guided_app, progress, told},
    support::*,
};
use bevy::prelude::*;
use bevy_crack::{prelude::*, strands::StrandParams};

/// One straight strand without branches.
fn straight() -> StrandParams {
    StrandParams { rotation: 0.0, depth: 0, width: 0.02, ..StrandParams::ASPHALT }
}

fn spawn(app: &mut App, strands: CrackStrands) -> Entity {
    let image = add(app, solid(UVec2::splat(128), [180, 180, 180, 255]));
    app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(CrackPreset::CONCRETE), strands)).id()
}

/// From the left to the right at half the height.
fn across() -> CrackStrands {
    CrackStrands::new([HitPoint::Uv(Vec2::new(0.0, 0.5))], StrandField::Linear(Vec2::X)).with_params(straight())
}

/// The dark texels.
fn dark(app: &App, entity: Entity) -> Vec<Vec2> {
    darker_than(120, app, entity)
}

fn darker_than(level: u8, app: &App, entity: Entity) -> Vec<Vec2> {
    let texels = shown(app, entity);
    let side = 128;
    let all = (0..side * side).filter(|i| texels[4 * i] < level);
    all.map(|i| Vec2::new((i % side) as f32, (i / side) as f32)).collect()
}

fn settled(app: &mut App, strands: CrackStrands) -> Entity {
    let entity = spawn(app, strands);
    bake(app, entity);
    settle(app, entity);
    entity
}

#[test]
fn a_strand_is_made_and_shown() {
    let mut app = guided_app();
    let entity = settled(&mut app, across());
    assert_eq!((told(&app).baked.len(), told(&app).failed.len(), told(&app).finished), (1, 0, 1));
    let cracked = dark(&app, entity);
    let columns = (0..128).filter(|x| cracked.iter().any(|at| at.x as i32 == *x)).count();
    assert!(columns > 115, "it reaches across {columns} of 128 columns");
    assert!(cracked.iter().all(|at| (at.y - 64.0).abs() < 24.0), "it keeps to its way");
    assert_sound(&app, entity);
    // The same cracks in another app, whatever its frames were.
    let texels = shown(&app, entity);
    let mut other = guided_app();
    let twin = settled(&mut other, across());
    assert!(shown(&other, twin) == texels, "the same cracks");
}

/// A line in the world is enough, wherever the surface is and however it is turned.
#[test]
fn strands_follow_a_line_in_the_world() {
    let mut app = guided_app();
    let place =
        Transform::from_xyz(30.0, -20.0, 3.0).with_rotation(Quat::from_rotation_z(0.7)).with_scale(Vec3::splat(2.0));
    let points = [[-50.0, 40.0], [0.0, 40.0], [40.0, -30.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
    let line = points.map(|point| HitPoint::World(place.transform_point(point)));
    let strands = CrackStrands::along(line).with_params(straight());
    let entity = spawn(&mut app, strands);
    app.world_mut().entity_mut(entity).insert(place);
    bake(&mut app, entity);
    settle(&mut app, entity);
    assert_eq!(told(&app).failed, []);
    // The ends run out as hairlines, which are not dark.
    let cracked = darker_than(175, &app, entity);
    for point in points {
        let texel = Vec2::new(64.0 + point.x, 64.0 - point.y);
        let nearest = cracked.iter().map(|at| at.distance(texel)).fold(f32::INFINITY, f32::min);
        assert!(nearest < 12.0, "the nearest crack to {texel} is {nearest} away");
    }
}

/// Hits grow beside them, nets close cells, healing takes all of it back, and a change makes them anew.
#[test]
fn strands_are_cracks_like_others() {
    let mut app = guided_app();
    let net = StrandParams { lanes: 4, tile: 0.12, ..straight() };
    let entity = settled(&mut app, across().with_params(net));
    let cells = state(&app, entity).cells;
    assert!(cells > 8, "{cells} cells");
    let before = state(&app, entity).nodes;
    hit(&mut app, CrackHit::uv(entity, Vec2::new(0.5, 0.2)));
    settle(&mut app, entity);
    assert_eq!(state(&app, entity).hits, 1);
    assert!(state(&app, entity).nodes > before);
    app.world_mut().get_mut::<CrackStrands>(entity).unwrap().params.lanes = 1;
    bake(&mut app, entity);
    settle(&mut app, entity);
    assert_eq!(state(&app, entity).hits, 1, "hits stay");
    // Guided cracks take their place.
    app.world_mut().entity_mut(entity).insert(guided());
    bake(&mut app, entity);
    settle(&mut app, entity);
    assert!(state(&app, entity).cells > 20);
    app.world_mut().commands().entity(entity).heal_cracks();
    steps(&mut app, 3);
    assert_eq!(progress(&app, entity), 0.0);
    assert_eq!(told(&app).failed, []);
    assert!(dark(&app, entity).is_empty());
}

/// The error that strands give.
fn refused(app: &mut App, strands: CrackStrands) -> String {
    let entity = spawn(app, strands);
    let n = told(app).failed.len();
    wait_for(app, "the error", |app| told(app).failed.len() > n);
    let (of, error) = told(app).failed[n].clone();
    assert_eq!(of, entity);
    error.to_string()
}

#[test]
fn what_cannot_be_made_is_told() {
    let mut app = guided_app();
    let start = |x: f32| CrackStrands::new([HitPoint::Uv(Vec2::new(x, 0.5))], StrandField::Linear(Vec2::X));
    let inert = StrandParams { inertia: 2.0, ..straight() };
    let swirl = StrandField::Swirl { center: HitPoint::Uv(Vec2::splat(0.5)), turn: 9.0 };
    let blank = add(&mut app, solid(UVec2::splat(32), [255; 4]));
    for (strands, part) in [
        (start(1.5), "start 0 at 1.5, 0.5 is not on the surface"),
        (start(f32::NAN), "start 0 at NaN"),
        (across().with_params(inert), "`params.inertia` is 2, must lie in 0..=1"),
        (across().with_seconds(1e9), "`seconds` is 1000000000"),
        (CrackStrands::along([]), "`directions.line` has 0 points"),
        (CrackStrands::new([], swirl), "`field.turn` is 9"),
        (CrackStrands { primitives: vec![blank], ..across() }, "primitive 0: the primitive is empty"),
    ] {
        let error = refused(&mut app, strands);
        assert!(error.contains(part), "{error}");
    }
}
