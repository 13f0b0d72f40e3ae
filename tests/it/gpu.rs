//! What the GPU holds equals the CPU copy. Needs an adapter (Mesa's software Vulkan will do); without one these tests say so
//! and pass, unless `CRACK_REQUIRE_ALL=1` is set.

use crate::support;
use bevy::{
    asset::{AssetPlugin, RenderAssetUsages},
    camera::CameraPlugin,
    image::ImagePlugin,
    mesh::MeshPlugin,
    prelude::*,
    render::{
        RenderPlugin,
        gpu_readback::{Readback, ReadbackComplete},
        render_resource::{Extent3d, TextureDimension, TextureFormat},
        settings::RenderCreation,
    },
    time::TimeUpdateStrategy,
    window::{ExitCondition, WindowPlugin},
};
use bevy_crack::{math::Rng, plugin::CrackUploadStats, prelude::*};
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard},
    time::Duration,
};

/// An app that renders without a window; one at a time.
fn app() -> Option<(MutexGuard<'static, ()>, App)> {
    let (guard, renderer) = support::gpu()?;
    let mut app = App::new();
    app.add_plugins((
        // First, to show that the order does not matter.
        CrackPlugins,
        MinimalPlugins,
        TransformPlugin,
        WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() },
        AssetPlugin::default(),
        RenderPlugin {
            render_creation: RenderCreation::Manual(renderer),
            synchronous_pipeline_compilation: true,
            ..default()
        },
        ImagePlugin::default(),
        MeshPlugin,
        CameraPlugin,
    ))
    .init_asset::<TextureAtlasLayout>()
    .init_asset::<StandardMaterial>()
    .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)))
    .insert_resource(CrackBudget { milliseconds: 50.0, ..default() });
    while app.plugins_state() == bevy::app::PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    Some((guard, app))
}

fn picture(size: UVec2) -> Image {
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let data = (0..size.x * size.y * 4).map(|i| if i % 4 == 3 { 255 } else { (100 + i * 7 % 100) as u8 }).collect();
    Image::new(extent, TextureDimension::D2, data, TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::default())
}

/// What the GPU held and what the CPU held in the frame the copy was made, for one image.
type Copies = Arc<Mutex<HashMap<AssetId<Image>, Vec<u8>>>>;

/// Texels of an image, rows padded as read-backs are.
fn padded(image: &Image) -> Vec<u8> {
    let texel = image.texture_descriptor.format.block_copy_size(None).unwrap();
    let row = (image.width() * texel) as usize;
    let mut rows = Vec::new();
    for data in image.data.as_ref().unwrap().chunks(row) {
        rows.extend_from_slice(data);
        rows.resize(rows.len().next_multiple_of(256), 0);
    }
    rows
}

/// T13, and the acceptance test: after each of 200 frames of hits the textures on the GPU equal the CPU copy.
#[test]
fn textures_on_the_gpu_equal_the_cpu_copy() {
    let Some((_one, mut app)) = app() else { return };
    let sizes = [UVec2::new(97, 61), UVec2::new(128, 64), UVec2::new(100, 100)];
    let [a, b, c] = sizes.map(|size| app.world_mut().resource_mut::<Assets<Image>>().add(picture(size)));
    let quad = app.world_mut().resource_mut::<Assets<Mesh>>().add(Mesh::from(Rectangle::new(1.0, 1.0)));
    let flat = app.world_mut().resource_mut::<Assets<CrackLitMaterial>>().add(CrackLitMaterial::new(b));
    let wall = StandardMaterial { base_color_texture: Some(c), ..default() };
    let wall = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(wall);
    let mut preset = CrackPreset::CONCRETE;
    preset.growth.max_nodes = 100_000;
    let surface = CrackSurface::new(preset);
    let surfaces = [
        app.world_mut().spawn((Sprite::from_image(a), surface.clone())).id(),
        app.world_mut().spawn((Mesh2d(quad.clone()), MeshMaterial2d(flat), surface.clone())).id(),
        app.world_mut().spawn((Mesh3d(quad), MeshMaterial3d(wall), surface)).id(),
    ];
    app.update();
    app.update();

    let copies = Copies::default();
    let mut rng = Rng::new(11);
    let mut frames = 0;
    let (mut bytes, mut whole) = (0, 0);
    while frames < 200 {
        for _ in 0..rng.next_u32() % 3 {
            let entity = surfaces[rng.next_u32() as usize % 3];
            let at = Vec2::new(rng.unit(), rng.unit());
            app.world_mut().trigger(CrackHit::uv(entity, at).with_energy(rng.unit()));
        }
        app.update();
        frames += 1;
        let stats = *app.world().resource::<CrackUploadStats>();
        bytes += stats.bytes;
        // Ask for every texture as it is after this frame: growth stands still until the answers are there.
        let images: Vec<_> = surfaces
            .iter()
            .filter_map(|entity| app.world().get::<CrackTextures>(*entity))
            .flat_map(|textures| textures.handles().cloned().collect::<Vec<_>>())
            .collect();
        app.world_mut().resource_mut::<Time<Virtual>>().pause();
        copies.lock().unwrap().clear();
        let readers: Vec<_> = images
            .iter()
            .map(|image| {
                let (copies, id) = (copies.clone(), image.id());
                app.world_mut()
                    .spawn(Readback::texture(image.clone()))
                    .observe(move |done: On<ReadbackComplete>| {
                        copies.lock().unwrap().insert(id, done.data.clone());
                    })
                    .id()
            })
            .collect();
        for _ in 0..50 {
            if copies.lock().unwrap().len() == images.len() {
                break;
            }
            app.update();
        }
        for reader in readers {
            app.world_mut().despawn(reader);
        }
        for image in &images {
            let cpu = app.world().resource::<Assets<Image>>().get(image).unwrap();
            whole += cpu.data.as_ref().unwrap().len() as u64;
            let copies = copies.lock().unwrap();
            let gpu = copies.get(&image.id()).expect("a read-back");
            assert!(padded(cpu) == *gpu, "frame {frames}: {:?} differs", cpu.texture_descriptor);
        }
        app.world_mut().resource_mut::<Time<Virtual>>().unpause();
    }
    for entity in surfaces {
        assert!(app.world().get::<CrackState>(entity).is_some_and(|state| state.nodes > 100));
    }
    println!("200 frames: {bytes} bytes uploaded, whole images would be {whole}");
    assert!(bytes > 0, "rectangles were uploaded");
}
