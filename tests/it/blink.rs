//! No frame without the surface, although pipelines are made beside the frames as in a game. Needs an adapter, as `gpu.rs` does.

use crate::support::*;
use bevy::{
    camera::{ClearColorConfig, RenderTarget, visibility::RenderLayers},
    core_pipeline::tonemapping::Tonemapping,
    image::TextureAtlasLayout,
    light::LightPlugin,
    pbr::PbrPlugin,
    prelude::*,
    render::{
        RenderPlugin,
        render_resource::TextureFormat,
        settings::RenderCreation,
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    sprite_render::AlphaMode2d,
};
use bevy_crack::prelude::*;
use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

const SIZE: UVec2 = UVec2::new(96, 64);

/// What shows the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Sprite,
    Color,
    Lit,
    Standard,
    /// A box, which is laid out.
    Body,
}

const STAGES: [Stage; 5] = [Stage::Sprite, Stage::Color, Stage::Lit, Stage::Standard, Stage::Body];

/// An app that makes pipelines beside the frames, and whose frames may not take any time.
fn app() -> Option<(MutexGuard<'static, ()>, App)> {
    let (guard, renderer) = gpu()?;
    let mut app = App::new();
    let renderer = RenderPlugin {
        render_creation: RenderCreation::Manual(renderer),
        synchronous_pipeline_compilation: false,
        ..default()
    };
    let plugins = render_plugins(RenderCreation::default())
        .set(renderer)
        .add(LightPlugin)
        .add(PbrPlugin { gltf_enable_standard_materials: false, ..default() });
    // Some plugins of a build with more features miss what others of it bring.
    app.set_error_handler(bevy::ecs::error::ignore);
    app.add_plugins((plugins, CrackPlugins)).init_asset::<TextureAtlasLayout>();
    finish(&mut app);
    app.insert_resource(CrackBudget { milliseconds: 200.0, ..default() });
    app.update();
    Some((guard, app))
}

/// A camera before a black background, and a light surface that fills its picture.
fn set_up(app: &mut App, stage: Stage) -> (Handle<Image>, Entity) {
    let target = add(app, Image::new_target_texture(SIZE.x, SIZE.y, TextureFormat::Rgba8UnormSrgb, None));
    let camera = (
        Msaa::Off,
        Tonemapping::None,
        Camera { clear_color: ClearColorConfig::Custom(Color::BLACK), ..default() },
        RenderTarget::Image(target.clone().into()),
    );
    if matches!(stage, Stage::Standard | Stage::Body) {
        app.world_mut().spawn((Camera3d::default(), camera, Transform::from_xyz(0.0, 0.0, 1.0)));
    } else {
        app.world_mut().spawn((Camera2d, camera));
    }
    let size = Vec2::splat(2.0 * SIZE.x as f32);
    let picture = add(app, solid(UVec2::splat(64), [230, 220, 210, 255]));
    let quad = add(app, Mesh::from(Rectangle::from_size(size)));
    let wall = add(app, Mesh::from(Rectangle::new(4.0, 4.0)));
    let entity = match stage {
        Stage::Sprite => app.world_mut().spawn(Sprite { image: picture, custom_size: Some(size), ..default() }).id(),
        Stage::Color => {
            let material = ColorMaterial { texture: Some(picture), alpha_mode: AlphaMode2d::Opaque, ..default() };
            let material = add(app, material);
            app.world_mut().spawn((Mesh2d(quad), MeshMaterial2d(material))).id()
        }
        Stage::Lit => {
            let material = add(app, CrackLitMaterial::new(picture).with_ambient(LinearRgba::WHITE));
            app.world_mut().spawn((Mesh2d(quad), MeshMaterial2d(material))).id()
        }
        Stage::Standard | Stage::Body => {
            let material = StandardMaterial { base_color_texture: Some(picture), unlit: true, ..default() };
            let material = MeshMaterial3d(add(app, material));
            if stage == Stage::Standard {
                app.world_mut().spawn((Mesh3d(wall), material)).id()
            } else {
                let body = add(app, Mesh::from(Cuboid::from_length(4.0)));
                app.world_mut().spawn((Mesh3d(body), material, Transform::from_xyz(0.0, 0.0, -2.0))).id()
            }
        }
    };
    (target, entity)
}

/// Share of the picture that is not background.
fn share(picture: &[u8]) -> f32 {
    let lit = picture.chunks(4).filter(|texel| texel[..3].iter().any(|&value| value > 40)).count();
    lit as f32 / (picture.len() / 4) as f32
}

/// The share in every single frame, until `more` frames after it `is_done`.
fn shares(app: &mut App, target: &Handle<Image>, more: usize, mut is_done: impl FnMut(&App) -> bool) -> Vec<f32> {
    let film = Arc::new(Mutex::new(Vec::new()));
    let (start, mut frames, mut left) = (Instant::now(), 0, None);
    while left != Some(0) {
        assert!(start.elapsed() < Duration::from_secs(60), "it never is");
        let (film, frame) = (film.clone(), frames);
        app.world_mut().spawn(Screenshot::image(target.clone())).observe(move |done: On<ScreenshotCaptured>| {
            let share = share(done.image.data.as_deref().unwrap_or_default());
            film.lock().unwrap_or_else(PoisonError::into_inner).push((frame, share));
        });
        app.update();
        frames += 1;
        left = left.map(|left: usize| left - 1).or_else(|| is_done(app).then_some(more));
    }
    while film.lock().unwrap_or_else(PoisonError::into_inner).len() < frames {
        assert!(start.elapsed() < Duration::from_secs(120), "no screenshot");
        app.update();
    }
    let mut film = core::mem::take(&mut *film.lock().unwrap_or_else(PoisonError::into_inner));
    film.sort_unstable_by_key(|(frame, _)| *frame);
    film.into_iter().map(|(_, share)| share).collect()
}

/// Frames until the surface is seen as it was before it cracked.
fn wait_until_seen(app: &mut App, target: &Handle<Image>) {
    let start = Instant::now();
    while share(&drawn(app, target)) < 0.99 {
        assert!(start.elapsed() < Duration::from_secs(120), "it is never seen");
    }
}

fn cracks() -> CrackSurface {
    let mut preset = small_preset();
    preset.steps_per_second = 1000.0;
    CrackSurface::new(preset)
}

/// The first hit and the first shatter, with everything known from the start, or nothing before it is needed.
fn first_hit_and_shatter(stage: Stage, is_early: bool) {
    let Some((_one, mut app)) = app() else { return };
    let (target, entity) = set_up(&mut app, stage);
    // Shards stand still in their places.
    let settings = ShatterCracks { speed: 0.0, ..default() };
    if is_early {
        app.world_mut().entity_mut(entity).insert((cracks(), settings.clone()));
    }
    wait_until_seen(&mut app, &target);

    app.world_mut().entity_mut(entity).insert_if_new(cracks());
    let middle = if stage == Stage::Body { CrackHit::local(entity, Vec3::new(0.0, 0.0, 2.0)) } else { center(entity) };
    hit(&mut app, middle);
    let is_cracked = |app: &App| app.world().get::<CrackState>(entity).is_some_and(|s| s.status == CrackStatus::Done);
    let first = shares(&mut app, &target, 12, is_cracked);
    let least = first.iter().copied().fold(1.0, f32::min);
    assert!(least > 0.7, "{stage:?}: a first hit, and the surface is gone: {first:?}");

    app.world_mut().entity_mut(entity).insert_if_new(settings);
    app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest { reach: 1.0, ..ShatterRequest::ALL });
    let is_shattered = |app: &App| app.world().get::<CrackShards>(entity).is_some_and(|shards| shards.shown > 0);
    let first = shares(&mut app, &target, 30, is_shattered);
    let least = first.iter().copied().fold(1.0, f32::min);
    assert!(least > 0.7, "{stage:?}: a first shatter, and the surface is gone: {first:?}");
}

/// Fault E13: a group of meshes takes the place of its members, and gives it back.
#[test]
fn e13_no_frame_without_the_room() {
    let Some((_one, mut app)) = app() else { return };
    let (target, wall) = set_up(&mut app, Stage::Standard);
    // The same in four parts.
    let material = get::<MeshMaterial3d<StandardMaterial>>(&app, wall);
    app.world_mut().despawn(wall);
    let part = add(&mut app, Mesh::from(Rectangle::new(2.0, 2.0)));
    let group = app.world_mut().spawn(cracks()).id();
    let places = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
    let members = places.map(|(x, y)| {
        let shown = (Mesh3d(part.clone()), material.clone(), Transform::from_xyz(x, y, 0.0));
        app.world_mut().spawn((shown, CrackMemberOf(group))).id()
    });
    wait_until_seen(&mut app, &target);
    hit(&mut app, CrackHit::world(members[3], Vec3::new(0.1, 0.1, 0.0)));
    let is_hidden = |app: &App| {
        members.iter().all(|member| app.world().get::<RenderLayers>(*member) == Some(&RenderLayers::none()))
    };
    let first = shares(&mut app, &target, 12, |app| state(app, group).status == CrackStatus::Done && is_hidden(app));
    let least = first.iter().copied().fold(1.0, f32::min);
    assert!(least > 0.7, "a first hit, and the room is gone: {first:?}");
    app.world_mut().commands().entity(group).heal_cracks();
    let healed = shares(&mut app, &target, 12, |app| app.world().get::<Mesh3d>(group).is_none());
    let least = healed.iter().copied().fold(1.0, f32::min);
    assert!(least > 0.7 && !is_hidden(&app), "it is healed, and the room is gone: {healed:?}");
}

/// Fault E13: what a surface is to look like is asked of the renderer as soon as there is a surface.
#[test]
fn e13_no_frame_without_the_surface() {
    for stage in STAGES {
        first_hit_and_shatter(stage, true);
    }
}

/// Fault E13: what was not asked for in time waits.
#[test]
fn e13_no_frame_without_a_surface_that_comes_with_its_hit() {
    for stage in STAGES {
        first_hit_and_shatter(stage, false);
    }
}

/// That such films show what they are to show: without the crate's help a surface is gone when it comes to look otherwise.
#[test]
fn e13_what_is_exchanged_by_hand_is_gone_for_a_frame() {
    for stage in [Stage::Sprite, Stage::Standard] {
        let Some((_one, mut app)) = app() else { return };
        let (target, entity) = set_up(&mut app, stage);
        wait_until_seen(&mut app, &target);
        let picture = add(&mut app, solid(UVec2::splat(64), [230, 220, 210, 255]));
        if stage == Stage::Sprite {
            let quad = add(&mut app, Mesh::from(Rectangle::from_size(Vec2::splat(200.0))));
            let material = add(&mut app, ColorMaterial::from(picture));
            app.world_mut().entity_mut(entity).remove::<Sprite>().insert((Mesh2d(quad), MeshMaterial2d(material)));
        } else {
            let mesh =
                Mesh::from(Rectangle::new(4.0, 4.0)).with_generated_tangents().expect("it has all that it takes");
            let (mesh, flat) = (add(&mut app, mesh), add(&mut app, solid(UVec2::ONE, [128, 128, 255, 255])));
            let material = StandardMaterial {
                base_color_texture: Some(picture),
                normal_map_texture: Some(flat),
                unlit: true,
                ..default()
            };
            let material = add(&mut app, material);
            app.world_mut().entity_mut(entity).insert((Mesh3d(mesh), MeshMaterial3d(material)));
        }
        let film = shares(&mut app, &target, 3, |_| true);
        assert!(film.iter().any(|share| *share < 0.01), "{stage:?}: {film:?}");
    }
}

/// What is drawn so that pipelines are made goes again, and nothing of it is left.
#[test]
fn e13_nothing_is_left_of_what_was_asked_for() {
    let Some((_one, mut app)) = app() else { return };
    let (target, entity) = set_up(&mut app, Stage::Standard);
    wait_until_seen(&mut app, &target);
    let count = |app: &mut App| {
        let meshes = app.world_mut().query::<&Mesh3d>().iter(app.world()).count();
        let assets =
            app.world().resource::<Assets<Mesh>>().len() + app.world().resource::<Assets<StandardMaterial>>().len();
        (meshes, assets)
    };
    let before = count(&mut app);
    app.world_mut().entity_mut(entity).insert((cracks(), ShatterCracks::default()));
    app.update();
    assert!(count(&mut app) > before, "something is drawn");
    wait_for(&mut app, "pipelines", |app| app.world().resource::<Assets<Mesh>>().len() <= before.1);
    steps(&mut app, 3);
    assert_eq!(count(&mut app), before);
    // Another camera sees with other pipelines.
    let second = add(&mut app, Image::new_target_texture(SIZE.x, SIZE.y, TextureFormat::Rgba8UnormSrgb, None));
    let sees = (RenderTarget::Image(second.into()), Msaa::Sample4, Tonemapping::None);
    app.world_mut().spawn((Camera3d::default(), sees, Transform::from_xyz(0.0, 0.0, 1.0)));
    steps(&mut app, 2);
    assert!(count(&mut app) > before, "it is asked for anew");
    let start = Instant::now();
    while count(&mut app) != before {
        assert!(start.elapsed() < Duration::from_secs(60), "it stays");
        step(&mut app);
    }
}
