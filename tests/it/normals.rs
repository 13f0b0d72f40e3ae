//! Surfaces with a normal map of their own, and how looks blend cracks into it.

use crate::support::*;
use bevy::{math::ops, prelude::*};
use bevy_crack::{blend::NormalBlending, paint::Look, prelude::*};
use std::{thread::sleep, time::Duration};

const SIZE: UVec2 = UVec2::new(160, 128);

fn preset(normals: NormalBlending) -> CrackPreset {
    CrackPreset { look: Look { normals, ..Look::GROOVE }, ..small_preset() }
}

/// A map of waves.
fn waves() -> Image {
    let mut image = solid(SIZE, [0; 4]);
    image.texture_descriptor.format = bevy::render::render_resource::TextureFormat::Rgba8Unorm;
    let texel = |i: u32| {
        let (x, y) = ((i % SIZE.x) as f32, (i / SIZE.x) as f32);
        let normal = Vec3::new(0.5 * ops::sin(0.2 * x + 0.1 * y), 0.4 * ops::cos(0.3 * y), 1.0).normalize();
        let [x, y, z] = (127.5 * normal + 128.0).to_array();
        [x as u8, y as u8, z as u8, 255]
    };
    image.data = Some((0..SIZE.element_product()).flat_map(texel).collect());
    image
}

/// A wall, or a picture in 2D, with waves of its own.
fn spawn(app: &mut App, preset: CrackPreset, is_3d: bool) -> Entity {
    let (picture, waves) = (add(app, picture(SIZE)), add(app, waves()));
    let mesh = add(app, Mesh::from(Rectangle::new(1.25, 1.0)));
    let surface = CrackSurface::new(preset).with_seed(3);
    if is_3d {
        let own = StandardMaterial { base_color_texture: Some(picture), normal_map_texture: Some(waves), ..default() };
        let material = add(app, own);
        app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), surface)).id()
    } else {
        let own = CrackLitMaterial { diffuse: Some(picture), normal: Some(waves), ..default() };
        let material = add(app, own);
        app.world_mut().spawn((Mesh2d(mesh), MeshMaterial2d(material), surface)).id()
    }
}

fn normals(app: &App, entity: Entity) -> Vec<u8> {
    texels(app, &get::<CrackTextures>(app, entity).normal.expect("a normal map"))
}

/// The normals once nothing changes any more: tasks have had their time.
fn at_rest(app: &mut App, entity: Entity) -> Vec<u8> {
    settle(app, entity);
    let (mut before, mut same) = (normals(app, entity), 0);
    while same < 40 {
        sleep(Duration::from_millis(2));
        step(app);
        let now = normals(app, entity);
        same = if now == before { same + 1 } else { 0 };
        before = now;
    }
    assert_sound(app, entity);
    before
}

fn hit_twice(app: &mut App, entity: Entity) {
    hit(app, CrackHit::uv(entity, Vec2::new(0.4, 0.5)).with_energy(2.0));
    settle(app, entity);
    hit(app, CrackHit::uv(entity, Vec2::new(0.7, 0.3)));
}

#[test]
fn normals_at_rest_are_the_same_however_they_came_about() {
    for is_3d in [true, false] {
        let all = [NormalBlending::Plain, NormalBlending::Whiteout, NormalBlending::Poisson].map(|blending| {
            let ends = [1e6, 0.0].map(|milliseconds| {
                let mut app = app();
                app.insert_resource(CrackBudget { milliseconds, ..default() });
                let entity = spawn(&mut app, preset(blending), is_3d);
                hit_twice(&mut app, entity);
                let end = at_rest(&mut app, entity);
                // Back in time, and to the end again.
                app.world_mut().entity_mut(entity).insert(CrackClock::value(0.4));
                steps(&mut app, 20);
                assert!(normals(&app, entity) != end, "the time is another");
                app.world_mut().entity_mut(entity).insert(CrackClock::value(1.0));
                steps(&mut app, 3);
                assert!(at_rest(&mut app, entity) == end, "{blending:?}: the end is another one");
                end
            });
            assert!(ends[0] == ends[1], "{blending:?}: the budget matters");
            ends.into_iter().next().expect("an end")
        });
        assert!(all[0] != all[1] && all[1] != all[2] && all[0] != all[2], "they differ");
    }
}

#[test]
fn a_look_that_changes_blends_as_one_that_was_there_from_the_start() {
    let end = |looks: &[NormalBlending]| {
        let mut app = app();
        let entity = spawn(&mut app, preset(looks[0]), true);
        hit_twice(&mut app, entity);
        let mut end = at_rest(&mut app, entity);
        for look in &looks[1..] {
            app.world_mut().entity_mut(entity).insert(CrackSurface::new(preset(*look)).with_seed(3));
            steps(&mut app, 2);
            end = at_rest(&mut app, entity);
        }
        app.world_mut().commands().entity(entity).heal_cracks();
        steps(&mut app, 3);
        end
    };
    use NormalBlending::{Plain, Poisson, Whiteout};
    let [plain, poisson] = [Plain, Poisson].map(|look| end(&[look]));
    assert!(end(&[Plain, Poisson]) == poisson && end(&[Poisson, Plain]) == plain);
    assert!(end(&[Poisson, Whiteout, Poisson]) == poisson);
}

#[test]
fn without_normals_of_its_own_a_surface_looks_the_same() {
    let mut app = app();
    let [plain, poisson] = [NormalBlending::Plain, NormalBlending::Poisson].map(|blending| {
        let own = StandardMaterial { base_color_texture: Some(add(&mut app, picture(SIZE))), ..default() };
        let (mesh, material) = (add(&mut app, Mesh::from(Rectangle::default())), add(&mut app, own));
        let wall = (Mesh3d(mesh), MeshMaterial3d(material), CrackSurface::new(preset(blending)));
        let entity = app.world_mut().spawn(wall).id();
        hit(&mut app, center(entity));
        at_rest(&mut app, entity)
    });
    assert!(plain == poisson);
}

#[test]
fn files_of_presets_choose_how_normals_blend() {
    for (text, expected) in [
        ("()", NormalBlending::Plain),
        ("(look: (normals: Plain))", NormalBlending::Plain),
        ("(look: (normals: Whiteout))", NormalBlending::Whiteout),
        ("(look: (normals: Poisson))", NormalBlending::Poisson),
    ] {
        let preset = CrackPreset::from_ron(text).expect("a preset");
        assert_eq!(preset.look.normals, expected, "{text}");
        let again = CrackPreset::from_ron(&preset.to_ron().expect("a file")).expect("a preset");
        assert_eq!(again, preset);
    }
    assert!(CrackPreset::from_ron("(look: (normals: Poison))").is_err());
}
