//! Chips: what hits knock out of a surface flies off, and nothing is left of it.

use crate::shards::{stock, vertices};
use crate::support::*;
use bevy::prelude::*;
use bevy_crack::{prelude::*, shatter::BurstParams};

const SIZE: UVec2 = UVec2::new(160, 128);

fn chips(app: &mut App) -> Vec<Entity> {
    app.world_mut().query_filtered::<Entity, With<CrackChip>>().iter(app.world()).collect()
}

fn surface(preset: CrackPreset) -> (CrackSurface, CrackChips) {
    (CrackSurface::new(preset), CrackChips::default())
}

fn wall(app: &mut App) -> (Entity, Handle<Image>) {
    let image = add(app, picture(SIZE));
    (app.world_mut().spawn((Sprite::from_image(image.clone()), surface(CrackPreset::CONCRETE))).id(), image)
}

/// The lowest and the highest, and how many there are.
fn heights(app: &mut App) -> (f32, f32, usize) {
    let all = chips(app).into_iter().map(|chip| get::<Transform>(app, chip).translation.y);
    let all: Vec<f32> = all.collect();
    (all.iter().copied().fold(f32::MAX, f32::min), all.iter().copied().fold(f32::MIN, f32::max), all.len())
}

/// Off a box, a ball and a room, from the place that is hit, outward.
#[test]
fn chips_fly_off_bodies() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(96)));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() });
    let meshes = [Mesh::from(Cuboid::new(2.0, 2.0, 2.0)), Sphere::new(1.0).mesh().uv(48, 32)];
    let meshes = meshes.map(|mesh| add(&mut app, mesh));
    let shown = |mesh: &Handle<Mesh>| (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()));
    let spot = Vec3::new(0.2, 0.1, 1.0);
    for kind in 0..3 {
        let place = Transform::from_xyz(3.0, -1.0, 2.0).with_rotation(Quat::from_rotation_y(0.7));
        let body = app.world_mut().spawn((surface(CrackPreset::CONCRETE), place)).id();
        let at = if kind == 1 { spot.normalize() } else { spot };
        if kind < 2 {
            app.world_mut().entity_mut(body).insert(shown(&meshes[kind]));
        } else {
            // Two boxes beside each other.
            for x in [-1.0, 1.0] {
                let part = Transform::from_xyz(x, 0.0, 0.0);
                app.world_mut().spawn((shown(&meshes[0]), part, CrackMemberOf(body), ChildOf(body)));
            }
        }
        step(&mut app);
        hit(&mut app, CrackHit::world(body, place.transform_point(at)).with_energy(4.0));
        let mut frames = 0;
        while chips(&mut app).is_empty() {
            step(&mut app);
            frames += 1;
            assert!(frames < 3000, "{kind}: nothing comes off");
        }
        let all = chips(&mut app);
        assert!(all.len() >= 4, "{kind}: {}", all.len());
        for chip in all {
            let place = get::<Transform>(&app, chip);
            assert!(place.translation.distance(at) < 0.5, "{kind}: {place:?}");
            let out = if kind == 1 { at } else { Vec3::Z };
            assert!(
                place.translation.dot(out) > 0.85 && (place.rotation * Vec3::Z).dot(out) > 0.9,
                "{kind}: {place:?}"
            );
        }
        app.world_mut().despawn(body);
        step(&mut app);
    }
}

#[test]
fn chips_fly_off_and_nothing_is_left_of_them() {
    let mut app = app();
    let (wall, image) = wall(&mut app);
    hit(&mut app, center(wall).with_energy(4.0));
    settle(&mut app, wall);
    // The first hit has made what stays for the surface.
    for _ in 0..120 {
        step(&mut app);
    }
    assert_eq!(chips(&mut app), []);
    let before = stock(&app);
    hit(&mut app, CrackHit::uv(wall, Vec2::new(0.3, 0.6)).with_energy(4.0));
    steps(&mut app, 2);
    let all = chips(&mut app);
    assert!((8..=24).contains(&all.len()), "{}", all.len());
    // They begin where the crater is, and show what was there.
    let middle = Vec2::new(0.3 - 0.5, 0.5 - 0.6) * SIZE.as_vec2();
    for chip in &all {
        let (place, mesh) = (get::<Transform>(&app, *chip), get::<Mesh2d>(&app, *chip).0);
        assert_eq!(get::<CrackChip>(&app, *chip).surface, wall);
        assert_eq!(get::<ChildOf>(&app, *chip).parent(), wall);
        assert!(place.translation.truncate().distance(middle) < 0.12 * 128.0, "{place:?}");
        for (vertex, uv) in vertices(&app, &mesh) {
            let at = place.transform_point(vertex).truncate() / SIZE.as_vec2();
            assert!((at - Vec2::new(uv.x - 0.5, 0.5 - uv.y)).abs().max_element() < 1e-3, "{at} shows {uv}");
        }
        let material = get::<MeshMaterial2d<ColorMaterial>>(&app, *chip).0;
        let shown = app.world().resource::<Assets<ColorMaterial>>().get(&material).unwrap().texture.clone();
        assert_eq!(shown, Some(image.clone()));
    }
    let start = heights(&mut app);
    steps(&mut app, 30);
    let later = heights(&mut app);
    assert!(later.0 < start.0 - 20.0 && later.2 == start.2, "they fall: {start:?} {later:?}");
    steps(&mut app, 60);
    assert_eq!(heights(&mut app).2, 0);
    settle(&mut app, wall);
    assert_eq!(stock(&app), before);
}

/// A second hit on the same place knocks out what is new; more energy, more chips.
#[test]
fn craters_that_grow_lose_what_is_new() {
    let mut app = app();
    let (wall, _) = wall(&mut app);
    let mut counts = Vec::new();
    for energy in [0.25, 1.0, 4.0] {
        app.world_mut().commands().entity(wall).heal_cracks();
        step(&mut app);
        hit(&mut app, center(wall).with_energy(energy));
        steps(&mut app, 2);
        counts.push(chips(&mut app).len());
    }
    assert!(counts.is_sorted_by(|a, b| a < b), "{counts:?}");
    let middle = |app: &mut App| {
        let far = |chip: &Entity| get::<Transform>(app, *chip).translation.truncate().length();
        chips_of(app).iter().map(far).fold(f32::MAX, f32::min)
    };
    fn chips_of(app: &App) -> Vec<Entity> {
        app.world().try_query_filtered::<Entity, With<CrackChip>>().expect("known").iter(app.world()).collect()
    }
    let nearest = middle(&mut app);
    steps(&mut app, 120);
    assert_eq!(chips(&mut app), []);
    hit(&mut app, center(wall).with_energy(6.0));
    steps(&mut app, 2);
    assert!(!chips(&mut app).is_empty() && middle(&mut app) > nearest + 3.0, "around the crater that was there");
}

/// Healing and despawning take them along; hits that make no crater, and surfaces without the component, have none.
#[test]
fn s12_chips_go_with_their_surface() {
    let mut app = app();
    let image = add(&mut app, picture(SIZE));
    for preset in [CrackPreset::GLASS, CrackPreset::GLAZE] {
        let wall = app.world_mut().spawn((Sprite::from_image(image.clone()), surface(preset))).id();
        hit(&mut app, center(wall).with_energy(4.0));
        steps(&mut app, 3);
    }
    let plain = (Sprite::from_image(image.clone()), CrackSurface::new(CrackPreset::CONCRETE));
    let plain = app.world_mut().spawn(plain).id();
    hit(&mut app, center(plain));
    steps(&mut app, 3);
    // What was hit before has none when it gets the component.
    app.world_mut().entity_mut(plain).insert(CrackChips::default());
    steps(&mut app, 3);
    assert_eq!(chips(&mut app), []);
    let before = stock(&app);
    for round in 0..4 {
        let wall = app.world_mut().spawn((Sprite::from_image(image.clone()), surface(CrackPreset::BRICK))).id();
        hit(&mut app, center(wall).with_energy(2.0));
        steps(&mut app, 2);
        assert!(!chips(&mut app).is_empty(), "round {round}");
        match round {
            0 => _ = app.world_mut().commands().entity(wall).heal_cracks(),
            1 => _ = app.world_mut().entity_mut(wall).remove::<CrackSurface>(),
            2 => app.world_mut().entity_mut(wall).despawn(),
            _ => {
                let all = chips(&mut app);
                all.iter().for_each(|chip| app.world_mut().entity_mut(*chip).despawn());
            }
        }
        steps(&mut app, 3);
        assert_eq!(chips(&mut app), [], "round {round}");
        app.world_mut().try_despawn(wall).ok();
        steps(&mut app, 3);
        assert_eq!(stock(&app), before, "round {round}");
    }
}

/// Numbers out of range, and hits in any number, at the border, on a mesh in 3D: no panic, no more than there may be.
#[test]
fn s12_chips_of_any_kind() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().max_shards = 40;
    let image = add(&mut app, picture(SIZE));
    let bad = BurstParams { speed: f32::NAN, ..BurstParams::DEFAULT };
    let settings = [
        CrackChips { burst: bad, ..default() },
        CrackChips { count: u32::MAX, floor: Some(f32::NAN), ..default() },
        CrackChips { count: 0, ..default() },
        CrackChips { floor: Some(-100.0), gravity: GravitySpace::Surface, ..default() },
    ];
    for (i, chips_of) in settings.into_iter().enumerate() {
        let sprite = Sprite { flip_x: i % 2 == 0, ..Sprite::from_image(image.clone()) };
        let wall = app.world_mut().spawn((sprite, surface(CrackPreset::ASPHALT))).insert(chips_of).id();
        for k in 0..20u8 {
            let uv = Vec2::new(f32::from(k % 5) / 4.0, f32::from(k / 5) / 3.0);
            hit(&mut app, CrackHit::uv(wall, uv).with_energy(f32::from(k)));
        }
        steps(&mut app, 2);
        assert_eq!(chips(&mut app).is_empty(), i % 2 == 0, "settings {i}");
        step(&mut app);
        assert!(chips(&mut app).len() <= 40 + 4 * 64, "settings {i}");
        steps(&mut app, 1);
        assert!(chips(&mut app).len() <= 40, "settings {i}");
        app.world_mut().entity_mut(wall).despawn();
        step(&mut app);
        assert_eq!(chips(&mut app), []);
    }
    let mesh = add(&mut app, Mesh::from(Rectangle::new(1.25, 1.0)));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() });
    let wall = (Mesh3d(mesh), MeshMaterial3d(material), surface(CrackPreset::CONCRETE));
    let wall = app.world_mut().spawn(wall).id();
    let into = CrackHit { direction: Vec3::NEG_Z, ..center(wall).with_energy(3.0) };
    hit(&mut app, into);
    steps(&mut app, 8);
    let all = chips(&mut app);
    assert!(!all.is_empty());
    for chip in all {
        assert!(get::<Transform>(&app, chip).translation.z > 0.0, "thrown back");
        let sides = app.world().get::<Children>(chip).expect("it has thickness");
        assert_eq!(sides.len(), 1);
    }
}
