//! What the GPU holds equals the CPU copy. Needs an adapter (Mesa's software Vulkan will do); without one these tests say so
//! and pass, unless `CRACK_REQUIRE_ALL=1` is set.

use crate::support::*;
use bevy::{
    prelude::*,
    render::{RenderApp, RenderStartup, render_resource::TextureFormat},
};
use bevy_crack::{math::Rng, plugin::CrackUploadStats, prelude::*};

/// The acceptance test: after each of 200 frames of hits the textures on the GPU equal the CPU copy.
#[test]
fn textures_on_the_gpu_equal_the_cpu_copy() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let sizes = [UVec2::new(97, 61), UVec2::new(128, 64), UVec2::new(100, 100)];
    let [a, b, c] = sizes.map(|size| add(&mut app, picture(size)));
    let quad = add(&mut app, Mesh::from(Rectangle::new(1.0, 1.0)));
    let flat = add(&mut app, CrackLitMaterial::new(b));
    let wall = add(&mut app, StandardMaterial { base_color_texture: Some(c), ..default() });
    let mut preset = CrackPreset::CONCRETE;
    preset.growth.max_nodes = 100_000;
    let surface = CrackSurface::new(preset);
    let surfaces = [
        app.world_mut().spawn((Sprite::from_image(a), surface.clone())).id(),
        app.world_mut().spawn((Mesh2d(quad.clone()), MeshMaterial2d(flat), surface.clone())).id(),
        app.world_mut().spawn((Mesh3d(quad), MeshMaterial3d(wall), surface)).id(),
    ];
    steps(&mut app, 2);

    let mut rng = Rng::new(11);
    let mut bytes = 0;
    for _ in 0..200 {
        for _ in 0..rng.next_u32() % 3 {
            let entity = surfaces[rng.next_u32() as usize % 3];
            let at = Vec2::new(rng.unit(), rng.unit());
            hit(&mut app, CrackHit::uv(entity, at).with_energy(rng.unit()));
        }
        step(&mut app);
        bytes += app.world().resource::<CrackUploadStats>().bytes;
        let is_cracked = |entity: &Entity| app.world().get::<CrackTextures>(*entity).is_some();
        let cracked: Vec<_> = surfaces.into_iter().filter(is_cracked).collect();
        assert_on_gpu(&mut app, &cracked);
    }
    assert!(surfaces.into_iter().all(|entity| state(&app, entity).nodes > 100));
    assert!(bytes > 0, "rectangles were uploaded");
}

/// What the renderer does once more when it gets another device: cracks grow on, and what was under way arrives.
#[test]
fn e10_a_renderer_that_starts_again_shows_the_same() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let surfaces: Vec<_> = (0..8).map(|_| spawn_picture(&mut app, UVec2::splat(128))).collect();
    steps(&mut app, 2);
    // When the memory was made or used last from which textures are filled.
    let used = |app: &App| {
        let world = app.get_sub_app(RenderApp).expect("there is a renderer").world();
        let mut all = world.components().iter_registered();
        let id = all.find(|info| info.name().to_string().ends_with("gpu::fetch::Staging")).expect("the resource").id();
        world.get_resource_change_ticks_by_id(id).expect("it is there").changed
    };
    let mut rng = Rng::new(4);
    let mut most = 0;
    for round in 0..40 {
        for entity in &surfaces {
            let at = Vec2::new(rng.unit(), rng.unit());
            hit(&mut app, CrackHit::uv(*entity, at).with_energy(rng.unit()));
        }
        if round % 4 == 3 {
            // In the middle of a frame of the main world, too: what it has packed is of the device before.
            let start_again = |app: &mut App| {
                let render_app = app.get_sub_app_mut(RenderApp).expect("there is a renderer");
                render_app.world_mut().run_schedule(RenderStartup);
            };
            if round % 8 == 3 {
                app.world_mut().run_schedule(Main);
            }
            let before = used(&app);
            start_again(&mut app);
            assert_ne!(used(&app), before, "its buffers are of the device before");
        }
        step(&mut app);
        most = most.max(app.world().resource::<CrackUploadStats>().rects);
        assert_on_gpu(&mut app, &surfaces);
    }
    assert!(most > 20, "{most} at once");
}

/// A picture of one or two channels is shown red, or red and green, and so is its cracked copy where no crack is.
#[test]
fn channels_that_are_missing_stay_dark() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let size = UVec2::splat(64);
    let target = spawn_camera(&mut app, size);
    for format in [TextureFormat::R8Unorm, TextureFormat::Rg8Unorm] {
        let image = add(&mut app, picture_of(size, format));
        let entity = spawn_sprite(&mut app, &image);
        steps(&mut app, 3);
        let before = drawn(&mut app, &target);
        hit(&mut app, center(entity).with_energy(0.05));
        settle(&mut app, entity);
        let after = drawn(&mut app, &target);
        let corner = |film: &[u8]| film[..4 * 64 * 4].to_vec();
        assert!(corner(&before).iter().step_by(4).all(|&red| red > 40), "{format:?} is shown");
        assert!(difference(&corner(&before), &corner(&after)) <= 1, "{format:?}");
        assert!(before != after, "it has cracked");
        app.world_mut().despawn(entity);
    }
}

/// A sprite that is drawn at a quarter of its size shows the third of its mip levels, as the CPU has it, while cracks grow; so does one whose
/// textures are made by tasks, and one that gets another picture.
#[test]
fn mip_levels_on_the_gpu_equal_the_cpu_copy() {
    for side in [64, 1024] {
        let Some((_one, mut app)) = gpu_app() else { return };
        app.insert_resource(CrackBudget::default());
        let size = UVec2::new(side, side / 2);
        let target = spawn_camera(&mut app, size / 4);
        let image = add(&mut app, picture(size));
        let mut sprite = Sprite::from_image(image);
        sprite.custom_size = Some(size.as_vec2() / 4.0);
        let surface = CrackSurface::new(CrackPreset::CONCRETE).with_mips(CrackMips::Always);
        let entity = app.world_mut().spawn((sprite, surface)).id();
        let mut checked = 0;
        let mut rng = Rng::new(3);
        for frame in 0..60 {
            if frame % 6 == 0 {
                let at = Vec2::new(rng.unit(), rng.unit());
                hit(&mut app, CrackHit::uv(entity, at).with_energy(2.0));
            }
            if frame == 40 {
                let other = add(&mut app, solid(size, [90, 160, 220, 255]));
                app.world_mut().get_mut::<Sprite>(entity).expect("a sprite").image = other;
            }
            app.world_mut().resource_mut::<Time<Virtual>>().unpause();
            steps(&mut app, 2);
            app.world_mut().resource_mut::<Time<Virtual>>().pause();
            // What is being made arrives.
            steps(&mut app, 3);
            if app.world().get::<CrackTextures>(entity).is_none() {
                continue;
            }
            // What there was no time for is painted meanwhile.
            let (before, drawn, after) = (shown(&app, entity), drawn(&mut app, &target), shown(&app, entity));
            let area = size.element_product() as usize * 4;
            if before == after && before.len() > area {
                let worst = difference(&drawn, &before[area * 5 / 4..][..area / 16]);
                assert!(worst <= 1, "frame {frame} of {side}: {worst}");
                checked += 1;
            }
        }
        assert!(checked > 20, "{checked}");
    }
}
