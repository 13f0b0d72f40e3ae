//! Pictures of all sizes and formats, broken ones, late ones and changing ones: the faults T1 to T14 of the reliability list,
//! through real apps, some with a renderer.

use crate::support::*;
use bevy::{
    asset::{
        AssetApp, AssetLoader, LoadContext, RenderAssetUsages,
        io::{
            AssetSourceBuilder, Reader,
            memory::{Dir, MemoryAssetReader},
        },
    },
    image::{ImageAddressMode, ImageSampler, ImageSamplerDescriptor, TextureAtlas, TextureAtlasLayout},
    prelude::*,
    reflect::TypePath,
    render::{
        render_asset::RenderAssetBytesPerFrame,
        render_resource::{AstcBlock, AstcChannel, Extent3d, TextureDimension, TextureFormat},
    },
    sprite::{Anchor, BorderRect, SliceScaleMode},
};
use bevy_crack::{math::Rng, plugin::CrackUploadStats, prelude::*};
use std::{
    future::poll_fn,
    path::Path,
    sync::{Arc, Mutex},
    task::{Poll, Waker},
};

fn surface_of(resolution: CrackResolution) -> CrackSurface {
    CrackSurface::default().with_resolution(resolution)
}

fn spawn_with(app: &mut App, image: &Handle<Image>, resolution: CrackResolution) -> Entity {
    app.world_mut().spawn((Sprite::from_image(image.clone()), surface_of(resolution))).id()
}

fn size_of(app: &App, image: &Handle<Image>) -> UVec2 {
    app.world().resource::<Assets<Image>>().get(image).expect("the image").size()
}

fn replace(app: &mut App, handle: &Handle<Image>, image: Image) {
    *app.world_mut().resource_mut::<Assets<Image>>().get_mut(handle).expect("the image") = image;
}

/// Hits the surface, which fails, once, and shows what it showed; returns why. A neighbour is not concerned.
fn assert_fails(app: &mut App, entity: Entity) -> CrackError {
    let before = image_of(app, entity);
    let n_images = app.world().resource::<Assets<Image>>().len();
    hit(app, center(entity));
    hit(app, center(entity));
    let rejected = counts(app).rejected + 2;
    steps(app, 3);
    assert_eq!((counts(app).rejected, counts(app).queued), (rejected, 0));
    assert_eq!(image_of(app, entity), before, "the picture stands");
    assert_eq!(app.world().resource::<Assets<Image>>().len(), n_images, "nothing was made");
    let CrackStatus::Failed(error) = state(app, entity).status else { panic!("{:?}", state(app, entity)) };
    error
}

#[test]
fn t1_pictures_without_texels_are_refused_before_anything_is_made() {
    let mut app = app();
    single_threaded(&mut app);
    let other = spawn_picture(&mut app, UVec2::splat(48));
    let image = add(&mut app, picture(UVec2::splat(48)));
    for size in [UVec2::ZERO, UVec2::new(0, 8), UVec2::new(8, 0)] {
        let heard = warnings(|| {
            let empty = add(&mut app, picture(size));
            let entity = spawn_sprite(&mut app, &empty);
            assert_eq!(assert_fails(&mut app, entity), CrackError::Size { width: size.x, height: size.y });
            assert_eq!(assert_fails(&mut app, entity), CrackError::Size { width: size.x, height: size.y });
        });
        assert_eq!(heard.len(), 1, "one warning: {heard:?}");
        let entity = spawn_with(&mut app, &image, CrackResolution::Fixed(size));
        assert_eq!(assert_fails(&mut app, entity), CrackError::Size { width: size.x, height: size.y });
    }
    assert_cracks(&mut app, other);
}

#[test]
fn t1_no_picture_without_texels_reaches_the_gpu() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let image = add(&mut app, picture(UVec2::splat(16)));
    let empty = spawn_with(&mut app, &image, CrackResolution::Fixed(UVec2::new(0, 4)));
    let other = spawn_sprite(&mut app, &image);
    assert_fails(&mut app, empty);
    assert_cracks(&mut app, other);
    assert_on_gpu(&mut app, &[other]);
    assert_eq!(app.should_exit(), None);
}

const ODD_SIZES: [UVec2; 7] = [
    UVec2::ONE,
    UVec2::new(1, 4096),
    UVec2::new(4096, 1),
    UVec2::new(3, 5),
    UVec2::new(97, 61),
    UVec2::new(2, 7),
    UVec2::new(257, 13),
];

/// The cracks of a hit near a corner lie around it and nowhere else: columns and rows are not mixed up, and none is turned round.
fn assert_lies_around(app: &App, entity: Entity, before: &[u8], size: UVec2, uv: Vec2) {
    // Texels of a unit of patterns; cracks of one hit are shorter.
    let unit = size.min_element().max(size.max_element() / 64) as f32;
    let aim = uv * size.as_vec2();
    let now = shown(app, entity);
    let texels = now.chunks(4).zip(before.chunks(4)).zip(0u32..).filter(|((now, before), _)| now != before);
    let places: Vec<Vec2> = texels.map(|(_, i)| UVec2::new(i % size.x, i / size.x).as_vec2() + 0.5).collect();
    if places.is_empty() {
        assert!(unit < 8.0, "{size}: no crack shows: {:?}", state(app, entity));
        return;
    }
    let farthest = places.iter().map(|place| place.distance(aim)).fold(0.0, f32::max);
    assert!(farthest < 1.5 * unit + 3.0, "{size}: {farthest} texels from {aim}");
    let middle = places.iter().sum::<Vec2>() / places.len() as f32;
    assert!(middle.distance(aim) < 0.5 * unit + 2.0, "{size}: around {middle} instead of {aim}");
}

#[test]
fn t2_odd_sizes() {
    let mut app = app();
    for size in ODD_SIZES {
        let entity = spawn_picture(&mut app, size);
        let before = shown(&app, entity);
        let corner = Vec2::new(0.2, 0.1);
        hit(&mut app, CrackHit::uv(entity, corner));
        settle(&mut app, entity);
        assert_lies_around(&app, entity, &before, size, corner);
        for at in [0.0, 0.2, 0.5, 1.0] {
            hit(&mut app, CrackHit::uv(entity, Vec2::splat(at)).with_energy(2.0));
        }
        hit(&mut app, CrackHit::world(entity, Vec3::ZERO));
        settle(&mut app, entity);
        assert!(shown(&app, entity) != before, "{size}: no crack shows: {:?}", state(&app, entity));
        assert_eq!(size_of(&app, &image_of(&app, entity)), size);
        assert_eq!(counts(&app).rejected, 0, "{size}");
    }
}

#[test]
fn t2_odd_sizes_on_the_gpu() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let surfaces = ODD_SIZES.map(|size| spawn_picture(&mut app, size));
    for round in 0..3 {
        for entity in surfaces {
            hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.2 + 0.3 * round as f32)));
        }
        // In the middle of growth, rectangles of all sizes are on their way.
        steps(&mut app, 3);
        assert_on_gpu(&mut app, &surfaces);
    }
    assert_eq!(app.should_exit(), None);
}

#[test]
fn t3_sizes_beyond_all_limits_are_clamped_before_anything_is_allocated() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::new(64, 32)));
    let other = spawn_sprite(&mut app, &image);
    app.world_mut().resource_mut::<CrackBudget>().max_side = 256;
    for (asked, expected) in [
        (UVec2::splat(16_384), UVec2::splat(256)),
        (UVec2::splat(u32::MAX), UVec2::splat(256)),
        (UVec2::new(u32::MAX, u32::MAX / 2), UVec2::new(256, 127)),
        (UVec2::new(u32::MAX, 1), UVec2::new(256, 1)),
        (UVec2::new(1, 300), UVec2::new(1, 256)),
    ] {
        let entity = spawn_with(&mut app, &image, CrackResolution::Fixed(asked));
        hit(&mut app, center(entity));
        settle(&mut app, entity);
        assert_eq!(size_of(&app, &image_of(&app, entity)), expected, "{asked} asked for");
        assert_eq!(get::<Sprite>(&app, entity).custom_size, Some(Vec2::new(64.0, 32.0)), "as large on the screen");
        app.world_mut().despawn(entity);
        step(&mut app);
    }
    // A picture that is larger than a texture may be.
    let long = add(&mut app, picture(UVec2::new(20_000, 4)));
    let entity = spawn_sprite(&mut app, &long);
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    assert_eq!(size_of(&app, &image_of(&app, entity)), UVec2::new(256, 1));
    // The news of the picture that was added reach everybody.
    steps(&mut app, 2);

    // No memory for textures: coarser ones, then none, in words; given back when others go.
    *app.world_mut().resource_mut::<CrackBudget>() =
        CrackBudget { milliseconds: 1e6, max_texture_bytes: 200_000, ..CrackBudget::default() };
    let fixed = CrackResolution::Fixed(UVec2::splat(4096));
    let first = spawn_with(&mut app, &image, fixed);
    hit(&mut app, center(first));
    settle(&mut app, first);
    assert_eq!(size_of(&app, &image_of(&app, first)), UVec2::splat(64));
    let mut surfaces = vec![first];
    loop {
        let entity = spawn_with(&mut app, &image, fixed);
        hit(&mut app, center(entity));
        step(&mut app);
        surfaces.push(entity);
        assert!(surfaces.len() < 10, "the budget is never reached");
        if let CrackStatus::Failed(error) = state(&app, entity).status {
            assert!(matches!(error, CrackError::TextureBudget { needed, left } if needed > left), "{error:?}");
            break;
        }
    }
    let last = surfaces.pop().unwrap();
    app.world_mut().despawn(first);
    hit(&mut app, center(last));
    settle(&mut app, last);
    let budget = CrackBudget { milliseconds: 1e6, ..CrackBudget::default() };
    app.insert_resource(budget);
    assert_cracks(&mut app, other);
}

#[test]
fn t3_the_limit_of_the_device_holds() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let limit = app.world().resource::<bevy::render::renderer::RenderDevice>().limits().max_texture_dimension_2d;
    app.world_mut().resource_mut::<CrackBudget>().max_side = u32::MAX;
    // Only in main memory: the renderer would quit over it.
    let mut long = picture(UVec2::new(20_000, 2));
    long.asset_usage = RenderAssetUsages::MAIN_WORLD;
    let long = add(&mut app, long);
    let entity = spawn_sprite(&mut app, &long);
    let image = add(&mut app, picture(UVec2::splat(8)));
    let wide = spawn_with(&mut app, &image, CrackResolution::Fixed(UVec2::new(u32::MAX, 1)));
    for entity in [entity, wide] {
        hit(&mut app, center(entity));
        settle(&mut app, entity);
        assert!(size_of(&app, &image_of(&app, entity)).x <= limit.min(16_384));
    }
    assert_on_gpu(&mut app, &[entity, wide]);
    assert_eq!(app.should_exit(), None);
}

#[test]
fn t4_frames_flips_and_sizes_of_sprites() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let target = spawn_camera(&mut app, UVec2::splat(64));
    let sheet = add(&mut app, solid(UVec2::new(64, 64), [90, 120, 150, 255]));
    let layout = TextureAtlasLayout::from_grid(UVec2::splat(32), 2, 2, None, None);
    let layout = add(&mut app, layout);
    let plain = Sprite::from_image(sheet.clone());
    let atlas = Sprite::from_atlas_image(sheet.clone(), TextureAtlas { layout, index: 3 });
    let sprites = [
        plain.clone(),
        Sprite { flip_x: true, ..plain.clone() },
        Sprite { flip_y: true, ..plain.clone() },
        // Texels that are not square.
        Sprite { custom_size: Some(Vec2::new(60.0, 30.0)), ..plain.clone() },
        Sprite { rect: Some(Rect::new(32.0, 0.0, 64.0, 64.0)), ..plain },
        Sprite { flip_x: true, ..atlas },
    ];
    for sprite in sprites {
        let size = match (&sprite.texture_atlas, sprite.rect, sprite.custom_size) {
            (_, _, Some(size)) => size,
            (Some(_), ..) => Vec2::splat(32.0),
            (_, Some(rect), _) => rect.size(),
            _ => Vec2::splat(64.0),
        };
        let mut preset = small_preset();
        preset.growth.reach = 0.01;
        let entity = app.world_mut().spawn((sprite.clone(), CrackSurface::new(preset))).id();
        app.update();
        let before = drawn(&mut app, &target);
        // A dot where it is aimed at, in the world, as a player would.
        let aim = size * Vec2::new(0.2, 0.3);
        hit(&mut app, CrackHit::world(entity, aim.extend(0.0)));
        settle(&mut app, entity);
        let after = drawn(&mut app, &target);
        let (mut sum, mut n) = (Vec2::ZERO, 0.0);
        for (i, _) in after.chunks(4).zip(before.chunks(4)).enumerate().filter(|(_, (a, b))| a != b) {
            sum += Vec2::new((i % 64) as f32 - 31.5, 31.5 - (i / 64) as f32);
            n += 1.0;
        }
        assert!(n > 0.0, "no crack shows: {sprite:?}");
        assert!((sum / n).distance(aim) < 2.5, "aimed at {aim}, drawn at {}: {sprite:?}", sum / n);
        app.world_mut().despawn(entity);
    }
}

#[test]
fn t4_what_sprites_cannot_do_is_named() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(48)));
    let part = Some(Rect::new(0.0, 0.0, 20.0, 20.0));
    let modes = [
        (SpriteImageMode::Sliced(TextureSlicer::default()), part, "Sliced"),
        (SpriteImageMode::Tiled { tile_x: true, tile_y: true, stretch_value: 1.0 }, part, "Tiled"),
        (SpriteImageMode::Scale(SpriteScalingMode::FillCenter), None, "Scale"),
    ];
    for (image_mode, rect, name) in modes {
        let sprite = Sprite { image_mode, rect, ..Sprite::from_image(image.clone()) };
        let entity = app.world_mut().spawn((sprite, CrackSurface::default())).id();
        assert_eq!(assert_fails(&mut app, entity), CrackError::SpriteMode { mode: name.to_owned() });
    }
    // Frames that show nothing of the picture, or cannot be.
    let bad = f32::NAN;
    for rect in [
        Rect::new(100.0, 100.0, 200.0, 200.0),
        Rect { min: Vec2::splat(30.0), max: Vec2::splat(10.0) },
        Rect { min: Vec2::splat(bad), max: Vec2::splat(bad) },
        Rect { min: Vec2::splat(-50.0), max: Vec2::splat(-10.0) },
        Rect { min: Vec2::splat(5.0), max: Vec2::splat(5.0) },
    ] {
        let sprite = Sprite { rect: Some(rect), ..Sprite::from_image(image.clone()) };
        let entity = app.world_mut().spawn((sprite, CrackSurface::default())).id();
        let error = assert_fails(&mut app, entity);
        assert!(matches!(error, CrackError::Part { size, .. } if size == UVec2::splat(48)), "{rect:?}: {error:?}");
    }
    // One that is partly there cracks there.
    let rect = Some(Rect::new(24.0, 24.0, 100.0, 100.0));
    let sprite = Sprite { rect, ..Sprite::from_image(image.clone()) };
    let entity = app.world_mut().spawn((sprite, CrackSurface::default())).id();
    assert_cracks(&mut app, entity);
    // Sizes that no point can be found in: refused, and the texture coordinates still work.
    for size in [Vec2::ZERO, Vec2::splat(bad), Vec2::splat(f32::INFINITY), Vec2::splat(-20.0)] {
        let sprite = Sprite { custom_size: Some(size), ..Sprite::from_image(image.clone()) };
        let entity = app.world_mut().spawn((sprite, CrackSurface::default())).id();
        hit(&mut app, CrackHit::world(entity, Vec3::new(1.0, 1.0, 0.0)));
        step(&mut app);
        assert_cracks(&mut app, entity);
    }
}

/// Sprites that repeat their picture, or show it in nine parts.
fn laid_out(image: &Handle<Image>, size: Vec2) -> Vec<Sprite> {
    let nine = |center_scale_mode, sides_scale_mode| {
        let border = BorderRect { min_inset: Vec2::new(3.0, 4.0), max_inset: Vec2::new(5.0, 2.0) };
        SpriteImageMode::Sliced(TextureSlicer { border, center_scale_mode, sides_scale_mode, max_corner_scale: 2.0 })
    };
    let tiled = |tile_x, tile_y, stretch_value| SpriteImageMode::Tiled { tile_x, tile_y, stretch_value };
    let tile = SliceScaleMode::Tile { stretch_value: 1.0 };
    let modes = [
        tiled(true, true, 1.0),
        // Not such that the middle of a pixel lies where two texels meet.
        tiled(true, false, 0.8),
        tiled(false, true, 2.0),
        nine(SliceScaleMode::Stretch, SliceScaleMode::Stretch),
        nine(tile, SliceScaleMode::Stretch),
        nine(SliceScaleMode::Stretch, tile),
        tiled(false, false, 0.3),
    ];
    let sprite = |image_mode| Sprite { image_mode, custom_size: Some(size), ..Sprite::from_image(image.clone()) };
    modes.into_iter().map(sprite).collect()
}

/// The whole picture in one part.
const WHOLE: SpriteImageMode = SpriteImageMode::Tiled { tile_x: false, tile_y: false, stretch_value: 1.0 };

/// What the crate changes of a sprite.
fn seen(sprite: &Sprite) -> (Handle<Image>, SpriteImageMode, Option<Vec2>) {
    (sprite.image.clone(), sprite.image_mode.clone(), sprite.custom_size)
}

#[test]
fn t4_repeated_and_sliced_sprites_crack_and_heal() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::new(24, 16)));
    let size = Vec2::new(96.0, 64.0);
    for sprite in laid_out(&image, size) {
        let entity = app.world_mut().spawn((sprite.clone(), CrackSurface::default())).id();
        step(&mut app);
        hit(&mut app, CrackHit::world(entity, Vec3::new(-24.0, 16.0, 0.0)));
        settle(&mut app, entity);
        let textures = size_of(&app, &image_of(&app, entity)).as_vec2();
        let is_laid_out =
            sprite.image_mode != SpriteImageMode::Tiled { tile_x: false, tile_y: false, stretch_value: 0.3 };
        assert_eq!(textures == Vec2::new(24.0, 16.0), !is_laid_out, "{:?}: {textures}", sprite.image_mode);
        assert_eq!(get::<Sprite>(&app, entity).custom_size, Some(size));

        // A clone shows the picture as the first one did; another picture is laid out as it was.
        let clone = app.world_mut().entity_mut(entity).clone_and_spawn();
        step(&mut app);
        assert_eq!(seen(&get(&app, clone)), seen(&sprite));
        let other = add(&mut app, solid(UVec2::new(24, 16), [90, 60, 30, 255]));
        app.world_mut().get_mut::<Sprite>(entity).expect("the sprite").image = other.clone();
        steps(&mut app, 2);
        settle(&mut app, entity);
        assert!(image_of(&app, entity) != other, "it is cracked as well");
        assert_eq!(size_of(&app, &image_of(&app, entity)).as_vec2(), textures);
        // So is one that comes later, and one that is loaded anew.
        let late = app.world().resource::<Assets<Image>>().reserve_handle();
        app.world_mut().get_mut::<Sprite>(entity).expect("the sprite").image = late.clone();
        steps(&mut app, 2);
        let new = solid(UVec2::new(24, 16), [30, 90, 60, 255]);
        app.world_mut().resource_mut::<Assets<Image>>().insert(&late, new.clone()).expect("a handle that is held");
        steps(&mut app, 2);
        settle(&mut app, entity);
        let has_own = |app: &App, size: Vec2| {
            let (image, mode, _) = seen(&get(app, entity));
            assert!(image != late && size_of(app, &image).as_vec2() == size, "{:?}", sprite.image_mode);
            assert_eq!(mode, if is_laid_out { WHOLE } else { sprite.image_mode.clone() });
        };
        has_own(&app, textures);
        replace(&mut app, &late, new);
        steps(&mut app, 2);
        has_own(&app, textures);
        let mut sprite = Sprite { image: late.clone(), ..sprite.clone() };
        if is_laid_out {
            // Somebody has it laid out in another way.
            sprite.image_mode = SpriteImageMode::Tiled { tile_x: true, tile_y: true, stretch_value: 0.25 };
            app.world_mut().get_mut::<Sprite>(entity).expect("the sprite").image_mode = sprite.image_mode.clone();
            steps(&mut app, 2);
            has_own(&app, 4.0 * size);
        }
        app.world_mut().commands().entity(entity).heal_cracks();
        step(&mut app);
        assert_eq!(seen(&get(&app, entity)), seen(&sprite));
    }
}

#[test]
fn t4_repeated_and_sliced_sprites_look_as_before() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let side = UVec2::new(128, 96);
    let target = spawn_camera(&mut app, side);
    let image = add(&mut app, picture(UVec2::new(24, 16)));
    for sprite in laid_out(&image, Vec2::new(96.0, 64.0)) {
        let entity = app.world_mut().spawn((sprite.clone(), CrackSurface::default())).id();
        steps(&mut app, 3);
        let before = drawn(&mut app, &target);
        assert!(
            before.as_chunks::<4>().0.iter().filter(|texel| texel[0] > 100).count() == 96 * 64,
            "the sprite is there"
        );
        // In no frame is it drawn in other parts than before.
        let film = film(&mut app, &target, 30, |app, i| {
            if i == 5 {
                hit(app, CrackHit::uv(entity, Vec2::new(0.7, 0.5)).with_energy(0.02));
            }
        });
        let changed = |after: &[u8]| {
            let pairs = after.as_chunks::<4>().0.iter().zip(before.as_chunks::<4>().0);
            pairs.filter(|(a, b)| difference(&a[..], &b[..]) > 2).count()
        };
        let most = film.iter().map(|frame| changed(frame)).max();
        assert!((1..1500).contains(&changed(&film[29])), "{:?}: {}", sprite.image_mode, changed(&film[29]));
        assert!(most < Some(1500), "{:?}: {most:?} texels", sprite.image_mode);
        let film = self::film(&mut app, &target, 20, |app, i| {
            if i == 2 {
                app.world_mut().commands().entity(entity).close_cracks(0.1);
            }
        });
        let most = film.iter().map(|frame| changed(frame)).max();
        assert!(most < Some(1500), "{:?}, as its cracks close: {most:?} texels", sprite.image_mode);
        assert_eq!(changed(&film[19]), 0, "{:?}", sprite.image_mode);
        app.world_mut().despawn(entity);
        step(&mut app);
    }
}

/// The engine shows such a sprite as if its anchor was its centre, until it has a size of its own: it must not jump when it cracks.
#[test]
fn t4_a_repeated_sprite_with_an_anchor_stays_where_it_is() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let target = spawn_camera(&mut app, UVec2::new(128, 96));
    let image = add(&mut app, picture(UVec2::new(48, 32)));
    for resolution in [CrackResolution::Picture, CrackResolution::Fixed(UVec2::new(100, 90))] {
        let image_mode = SpriteImageMode::Tiled { tile_x: true, tile_y: true, stretch_value: 0.5 };
        let sprite = Sprite { image: image.clone(), image_mode, ..default() };
        let entity = app.world_mut().spawn((sprite, Anchor::BOTTOM_LEFT, surface_of(resolution))).id();
        steps(&mut app, 3);
        let before = drawn(&mut app, &target);
        // Where it is seen: a corner of it, and not where its anchor would have it.
        let rejected = counts(&app).rejected;
        hit(&mut app, CrackHit::world(entity, Vec3::new(40.0, 25.0, 0.0)).with_energy(0.02));
        hit(&mut app, CrackHit::world(entity, Vec3::new(-20.0, -12.0, 0.0)).with_energy(0.02));
        steps(&mut app, 10);
        assert_eq!((counts(&app).rejected, counts(&app).queued), (rejected + 1, 0));
        let after = drawn(&mut app, &target);
        let pairs = after.as_chunks::<4>().0.iter().zip(before.as_chunks::<4>().0);
        let edge = pairs.filter(|(a, b)| (a[0] > 50) != (b[0] > 50)).count();
        assert!(after != before && edge < 200, "{edge} texels are elsewhere");
        app.world_mut().despawn(entity);
        step(&mut app);
    }
}

#[test]
fn t4_a_stretched_picture_looks_as_before() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let target = spawn_camera(&mut app, UVec2::new(80, 32));
    let mut rng = Rng::new(3);
    for mode in [ImageAddressMode::ClampToEdge, ImageAddressMode::Repeat] {
        let mut image = picture(UVec2::splat(16));
        let level = |rng: &mut Rng| if rng.unit() < 0.5 { 20 } else { 240 };
        image.data =
            Some((0..16 * 16).flat_map(|_| [level(&mut rng), level(&mut rng), level(&mut rng), 255]).collect());
        let sampler =
            ImageSamplerDescriptor { address_mode_u: mode, address_mode_v: mode, ..ImageSamplerDescriptor::linear() };
        image.sampler = ImageSampler::Descriptor(sampler);
        let image = add(&mut app, image);
        let sprite = Sprite { custom_size: Some(Vec2::new(64.0, 16.0)), ..Sprite::from_image(image) };
        let entity = app.world_mut().spawn((sprite, CrackSurface::default())).id();
        steps(&mut app, 3);
        let before = drawn(&mut app, &target);
        hit(&mut app, CrackHit::uv(entity, Vec2::new(0.9, 0.5)).with_energy(0.05));
        settle(&mut app, entity);
        let after = drawn(&mut app, &target);
        let changed = |x: usize, y: usize| {
            let i = 4 * (y * 80 + x);
            difference(&before[i..i + 4], &after[i..i + 4])
        };
        let untouched = (0..32).flat_map(|y| (0..50).map(move |x| (x, y)));
        let most = untouched.map(|(x, y)| changed(x, y)).max();
        assert!(most <= Some(2), "{mode:?}: a texel far from the crack has changed by {most:?}");
        assert!((50..80).any(|x| changed(x, 16) > 20), "it has cracked");
        app.world_mut().despawn(entity);
        step(&mut app);
    }
}

#[test]
fn t4_repeated_and_sliced_sprites_of_wild_numbers_are_harmless() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::new(9, 7)));
    let wild = [0.0, -3.0, 1e-30, 0.7, 40.0, 1e30, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut rng = Rng::new(17);
    let mut any = || wild[rng.next_u32() as usize % wild.len()];
    for round in 0..120 {
        let image_mode = if round % 2 == 0 {
            SpriteImageMode::Tiled { tile_x: true, tile_y: round % 4 == 0, stretch_value: any() }
        } else {
            SpriteImageMode::Sliced(TextureSlicer {
                border: BorderRect { min_inset: Vec2::new(any(), any()), max_inset: Vec2::new(any(), any()) },
                center_scale_mode: SliceScaleMode::Tile { stretch_value: any() },
                sides_scale_mode: SliceScaleMode::Tile { stretch_value: any() },
                max_corner_scale: any(),
            })
        };
        let custom_size = (round % 3 > 0).then(|| Vec2::new(any(), any()));
        let sprite = Sprite { image_mode, custom_size, ..Sprite::from_image(image.clone()) };
        let surface = CrackSurface::new(small_preset());
        app.world_mut().resource_mut::<CrackBudget>().max_side = 64;
        let entity = app.world_mut().spawn((sprite, surface)).id();
        hit(&mut app, center(entity));
        steps(&mut app, 2);
        assert!(state(&app, entity).hits == 1, "{:?}: {:?}", get::<Sprite>(&app, entity), state(&app, entity).status);
        app.world_mut().despawn(entity);
    }
}

#[test]
fn t4_a_frame_that_wanders_over_the_picture() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let entity = app
        .world_mut()
        .spawn((
            Sprite { rect: Some(Rect::new(0.0, 0.0, 32.0, 32.0)), ..Sprite::from_image(image) },
            CrackSurface::default(),
        ))
        .id();
    let mut rng = Rng::new(4);
    for _ in 0..500 {
        hit(&mut app, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())));
        step(&mut app);
        let min = Vec2::new(rng.range(-10.0, 60.0), rng.range(-10.0, 60.0));
        let rect = Rect { min, max: min + Vec2::new(rng.range(0.0, 40.0), rng.range(0.0, 40.0)) };
        app.world_mut().get_mut::<Sprite>(entity).unwrap().rect = Some(rect);
    }
    steps(&mut app, 50);
    assert_sound(&app, entity);
}

/// Every format there is.
fn formats() -> Vec<TextureFormat> {
    use TextureFormat::*;
    let mut formats = vec![
        R8Unorm,
        R8Snorm,
        R8Uint,
        R8Sint,
        R16Uint,
        R16Sint,
        R16Unorm,
        R16Snorm,
        R16Float,
        Rg8Unorm,
        Rg8Snorm,
        Rg8Uint,
        Rg8Sint,
        R32Uint,
        R32Sint,
        R32Float,
        Rg16Uint,
        Rg16Sint,
        Rg16Unorm,
        Rg16Snorm,
        Rg16Float,
        Rgba8Unorm,
        Rgba8UnormSrgb,
        Rgba8Snorm,
        Rgba8Uint,
        Rgba8Sint,
        Bgra8Unorm,
        Bgra8UnormSrgb,
        Rgb9e5Ufloat,
        Rgb10a2Uint,
        Rgb10a2Unorm,
        Rg11b10Ufloat,
        R64Uint,
        Rg32Uint,
        Rg32Sint,
        Rg32Float,
        Rgba16Uint,
        Rgba16Sint,
        Rgba16Unorm,
        Rgba16Snorm,
        Rgba16Float,
        Rgba32Uint,
        Rgba32Sint,
        Rgba32Float,
        Stencil8,
        Depth16Unorm,
        Depth24Plus,
        Depth24PlusStencil8,
        Depth32Float,
        Depth32FloatStencil8,
        NV12,
        P010,
        Bc1RgbaUnorm,
        Bc1RgbaUnormSrgb,
        Bc2RgbaUnorm,
        Bc2RgbaUnormSrgb,
        Bc3RgbaUnorm,
        Bc3RgbaUnormSrgb,
        Bc4RUnorm,
        Bc4RSnorm,
        Bc5RgUnorm,
        Bc5RgSnorm,
        Bc6hRgbUfloat,
        Bc6hRgbFloat,
        Bc7RgbaUnorm,
        Bc7RgbaUnormSrgb,
        Etc2Rgb8Unorm,
        Etc2Rgb8UnormSrgb,
        Etc2Rgb8A1Unorm,
        Etc2Rgb8A1UnormSrgb,
        Etc2Rgba8Unorm,
        Etc2Rgba8UnormSrgb,
        EacR11Unorm,
        EacR11Snorm,
        EacRg11Unorm,
        EacRg11Snorm,
    ];
    use AstcBlock::*;
    for block in [B4x4, B5x4, B5x5, B6x5, B6x6, B8x5, B8x6, B8x8, B10x5, B10x6, B10x8, B10x10, B12x10, B12x12] {
        for channel in [AstcChannel::Unorm, AstcChannel::UnormSrgb, AstcChannel::Hdr] {
            formats.push(Astc { block, channel });
        }
    }
    formats
}

#[test]
fn t5_every_format_is_read_or_refused_by_name() {
    let mut app = app();
    let other = spawn_picture(&mut app, UVec2::splat(24));
    let (mut read, mut refused) = (0, 0);
    for format in formats() {
        // Texels of all bits set: NaN in floats. And of none, and of different ones.
        for fill in [Some(0xFF), Some(0), None] {
            let mut image = picture_of(UVec2::splat(24), format);
            if let (Some(fill), Some(data)) = (fill, &mut image.data) {
                data.fill(fill);
            }
            let image = add(&mut app, image);
            let entity = spawn_sprite(&mut app, &image);
            app.world_mut().get_mut::<CrackSurface>(entity).unwrap().alpha_mask = false;
            hit(&mut app, center(entity));
            step(&mut app);
            match state(&app, entity).status {
                CrackStatus::Failed(CrackError::UnsupportedFormat { format: name }) => {
                    assert_eq!(name, format!("{format:?}"));
                    assert_eq!(image_of(&app, entity), image, "the picture stands");
                    refused += 1;
                }
                CrackStatus::Failed(error) => panic!("{format:?}: {error:?}"),
                _ => {
                    settle(&mut app, entity);
                    read += 1;
                }
            }
            app.world_mut().despawn(entity);
        }
    }
    step(&mut app);
    println!("{} formats, {} read, {} refused", formats().len(), read / 3, refused / 3);
    assert!(read >= 3 * 12, "{read}");

    // An array, a volume, and a picture that is on the GPU only.
    let mut array = picture(UVec2::splat(24));
    array.texture_descriptor.size.depth_or_array_layers = 2;
    let mut volume = picture(UVec2::splat(24));
    volume.texture_descriptor.dimension = TextureDimension::D3;
    let mut line = picture(UVec2::new(24, 1));
    line.texture_descriptor.dimension = TextureDimension::D1;
    for image in [array, volume, line] {
        let image = add(&mut app, image);
        let entity = spawn_sprite(&mut app, &image);
        let error = assert_fails(&mut app, entity);
        assert!(matches!(error, CrackError::UnsupportedFormat { .. }), "{error:?}");
    }
    let mut gone = picture(UVec2::splat(24));
    gone.data = None;
    let gone = add(&mut app, gone);
    let entity = spawn_sprite(&mut app, &gone);
    let error = assert_fails(&mut app, entity);
    assert_eq!(error, CrackError::NoCpuData);
    assert!(error.to_string().contains("MAIN_WORLD"), "advice: {error}");
    assert_cracks(&mut app, other);
}

#[test]
fn t6_data_of_the_wrong_length_is_refused() {
    let mut app = app();
    single_threaded(&mut app);
    let heard = warnings(|| {
        for n in [0, 1, 24 * 24 * 4 - 1, 24 * 24 * 4 + 1] {
            let mut broken = picture(UVec2::splat(24));
            broken.data = Some(vec![200; n]);
            let broken = add(&mut app, broken);
            let entity = spawn_sprite(&mut app, &broken);
            let error = assert_fails(&mut app, entity);
            assert_eq!(error, CrackError::DataLength { expected: 24 * 24 * 4, actual: n as u64 });
            // Repaired, it cracks.
            replace(&mut app, &broken, picture(UVec2::splat(24)));
            assert_cracks(&mut app, entity);
        }
    });
    assert_eq!(heard.len(), 4, "{heard:?}");
}

#[test]
fn t6_a_picture_that_breaks_under_its_cracks_and_is_repaired() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(48)));
    let entity = spawn_sprite(&mut app, &image);
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    let cracked = shown(&app, entity);
    let mut broken = picture(UVec2::splat(48));
    broken.data = Some(vec![0; 7]);
    replace(&mut app, &image, broken);
    steps(&mut app, 3);
    assert!(matches!(state(&app, entity).status, CrackStatus::Failed(CrackError::DataLength { .. })));
    assert_eq!(shown(&app, entity), cracked, "the cracks stand");
    replace(&mut app, &image, picture(UVec2::splat(48)));
    steps(&mut app, 3);
    assert_eq!(state(&app, entity).status, CrackStatus::Done);
    assert_eq!(shown(&app, entity), cracked);
}

#[test]
fn t6_textures_that_others_have_broken_never_reach_the_gpu() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let image = add(&mut app, picture(UVec2::splat(48)));
    let surfaces: [_; 4] = [(); 4].map(|()| spawn_sprite(&mut app, &image));
    for entity in surfaces {
        hit(&mut app, center(entity));
    }
    steps(&mut app, 2);
    // A game that writes into what is ours, without an event.
    for (i, entity) in surfaces.into_iter().enumerate().take(3) {
        let texture = image_of(&app, entity);
        let mut images = app.world_mut().resource_mut::<Assets<Image>>();
        let image = images.get_mut_untracked(&texture).unwrap();
        match i {
            0 => image.data = None,
            1 => image.data = Some(vec![0; 5]),
            _ => image.texture_descriptor.size = Extent3d { width: 96, height: 96, depth_or_array_layers: 1 },
        }
    }
    // Or takes it away.
    let texture = image_of(&app, surfaces[3]);
    app.world_mut().resource_mut::<Assets<Image>>().remove(&texture);
    for _ in 0..20 {
        for entity in surfaces {
            hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.3)));
        }
        step(&mut app);
        assert_eq!(app.should_exit(), None);
    }
}

/// Holds back the files of an app until it is opened.
#[derive(Clone, Default)]
struct Gate(Arc<Mutex<(bool, Vec<Waker>)>>);

impl Gate {
    fn open(&self) {
        let mut gate = self.0.lock().unwrap();
        gate.0 = true;
        gate.1.drain(..).for_each(Waker::wake);
    }

    async fn pass(&self) {
        poll_fn(|context| {
            let mut gate = self.0.lock().unwrap();
            if gate.0 {
                return Poll::Ready(());
            }
            gate.1.push(context.waker().clone());
            Poll::Pending
        })
        .await;
    }
}

/// Makes assets of files, when the gate is open.
#[derive(TypePath)]
struct GatedLoader<A: Asset> {
    gate: Gate,
    extension: [&'static str; 1],
    make: fn(&[u8]) -> Option<A>,
}

impl<A: Asset> AssetLoader for GatedLoader<A> {
    type Asset = A;
    type Settings = ();
    type Error = std::io::Error;

    async fn load(&self, reader: &mut dyn Reader, (): &(), _: &mut LoadContext<'_>) -> Result<A, std::io::Error> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        self.gate.pass().await;
        (self.make)(&bytes).ok_or_else(|| std::io::Error::other("no such file"))
    }

    fn extensions(&self) -> &[&str] {
        &self.extension
    }
}

/// A picture in a file: width, height, then one byte for all texels.
fn flat_picture(bytes: &[u8]) -> Option<Image> {
    let &[width, height, shade] = bytes else { return None };
    Some(solid(UVec2::new(u32::from(width), u32::from(height)), [shade, shade, shade, 255]))
}

/// An app whose files lie in memory, and come when the gate is opened.
fn gated_app() -> (App, Dir, Gate) {
    let (dir, gate) = (Dir::default(), Gate::default());
    let reader = MemoryAssetReader { root: dir.clone() };
    let mut app = App::new();
    app.register_asset_source("gated", AssetSourceBuilder::new(move || Box::new(reader.clone())));
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), ImagePlugin::default(), CrackPlugins));
    app.register_asset_loader(GatedLoader { gate: gate.clone(), extension: ["flat"], make: flat_picture });
    start(&mut app);
    single_threaded(&mut app);
    (app, dir, gate)
}

fn load(app: &App, path: &str) -> Handle<Image> {
    app.world().resource::<AssetServer>().load(path.to_owned())
}

#[test]
fn t7_hits_wait_until_the_picture_is_there() {
    let (mut app, dir, gate) = gated_app();
    dir.insert_asset(Path::new("wall.flat"), vec![40, 30, 200]);
    let image = load(&app, "gated://wall.flat");
    let entity = spawn_sprite(&mut app, &image);
    let other = spawn_picture(&mut app, UVec2::splat(24));
    app.world_mut().resource_mut::<CrackBudget>().max_queued_per_surface = 10;
    let heard = warnings(|| {
        for i in 0..30 {
            hit(&mut app, CrackHit::uv(entity, Vec2::splat(i as f32 / 30.0)));
            let stats = step(&mut app);
            assert_eq!((stats.queued + stats.merged, stats.rejected), (i + 1, 0), "{stats:?}");
            assert!(stats.queued <= 10, "no more than allowed: {stats:?}");
            assert_eq!(state(&app, entity).status, CrackStatus::Waiting);
        }
    });
    assert!(heard.is_empty(), "nothing is wrong: {heard:?}");
    // It keeps nobody else waiting.
    assert_cracks(&mut app, other);
    gate.open();
    wait_for(&mut app, "the picture", |app| counts(app).queued == 0);
    settle(&mut app, entity);
    assert_eq!(size_of(&app, &image_of(&app, entity)), UVec2::new(40, 30));
    assert_eq!(counts(&app).rejected, 0);
}

#[test]
fn t7_hits_wait_until_the_mesh_is_there() {
    let (mut app, dir, gate) = gated_app();
    let make = |_: &[u8]| Some(Mesh::from(Rectangle::new(2.0, 1.0)));
    app.init_asset::<Mesh>().init_asset::<ColorMaterial>();
    app.register_asset_loader(GatedLoader { gate: gate.clone(), extension: ["quad"], make });
    dir.insert_asset(Path::new("wall.quad"), vec![0]);
    let image = add(&mut app, picture(UVec2::splat(24)));
    let material = add(&mut app, ColorMaterial::from(image));
    let mesh = app.world().resource::<AssetServer>().load("gated://wall.quad");
    let shown = (Mesh2d(mesh), MeshMaterial2d(material), Transform::default());
    let entity = app.world_mut().spawn((shown, CrackSurface::default())).id();
    step(&mut app);
    let heard = warnings(|| {
        for i in 1..=5 {
            hit(&mut app, CrackHit::world(entity, Vec3::new(0.1 * i as f32, 0.0, 0.0)));
            let stats = step(&mut app);
            assert_eq!((stats.queued, stats.rejected), (i, 0), "{stats:?}");
            assert_eq!(state(&app, entity).status, CrackStatus::Waiting);
        }
    });
    assert!(heard.is_empty(), "nothing is wrong: {heard:?}");
    gate.open();
    wait_for(&mut app, "the mesh", |app| counts(app).queued == 0);
    settle(&mut app, entity);
    assert_eq!(counts(&app).rejected, 0);
}

#[test]
fn t8_a_picture_that_does_not_load_fails_with_its_path_and_again_has_its_chance() {
    let (mut app, dir, gate) = gated_app();
    let image = load(&app, "gated://missing.flat");
    let entity = spawn_sprite(&mut app, &image);
    let heard = warnings(|| {
        hit(&mut app, center(entity));
        step(&mut app);
        assert_eq!(counts(&app).applied, 0);
        wait_for(&mut app, "the failure", |app| matches!(state(app, entity).status, CrackStatus::Failed(_)));
        for _ in 0..10 {
            hit(&mut app, center(entity));
            step(&mut app);
        }
    });
    assert_eq!(heard.len(), 1, "one warning: {heard:?}");
    assert!(heard[0].contains("missing.flat"), "it names the file: {heard:?}");
    let stats = counts(&app);
    assert_eq!((stats.rejected, stats.queued), (11, 0), "the queue is dropped and counted");

    // The file is there after all.
    dir.insert_asset(Path::new("missing.flat"), vec![32, 32, 180]);
    gate.open();
    app.world().resource::<AssetServer>().reload("gated://missing.flat");
    wait_for(&mut app, "the picture", |app| app.world().resource::<Assets<Image>>().contains(&image));
    assert_cracks(&mut app, entity);

    // Another picture instead of one that does not load.
    let image = load(&app, "gated://other.flat");
    let entity = spawn_sprite(&mut app, &image);
    hit(&mut app, center(entity));
    wait_for(&mut app, "the failure", |app| matches!(state(app, entity).status, CrackStatus::Failed(_)));
    let image = add(&mut app, picture(UVec2::splat(24)));
    app.world_mut().get_mut::<Sprite>(entity).unwrap().image = image;
    assert_cracks(&mut app, entity);
}

/// Share of texels that are as in `base`.
fn share_untouched(now: &[u8], base: &[u8]) -> f32 {
    let same = now.chunks(4).zip(base.chunks(4)).filter(|(a, b)| a == b).count();
    same as f32 / (now.len() / 4) as f32
}

#[test]
fn t9_a_changed_picture_of_the_same_size_keeps_its_cracks() {
    let mut app = app();
    let image = add(&mut app, solid(UVec2::splat(64), [90, 90, 90, 255]));
    let entity = spawn_sprite(&mut app, &image);
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    let (damage, nodes) = (state(&app, entity).damage, state(&app, entity).nodes);
    let new = solid(UVec2::splat(64), [20, 160, 40, 255]);
    let base = new.data.clone().unwrap();
    let late = spawn_sprite(&mut app, &image);
    replace(&mut app, &image, new);
    // Before anybody is told of it.
    hit(&mut app, center(late));
    steps(&mut app, 3);
    let now = shown(&app, entity);
    settle(&mut app, late);
    assert!(shown(&app, late) == now, "what was read before is read again");
    let share = share_untouched(&now, &base);
    assert!(share > 0.5 && share < 1.0, "cracks on the new picture: {share}");
    assert_eq!((state(&app, entity).damage, state(&app, entity).nodes), (damage, nodes));
    // The same as if it had been so from the beginning.
    let image = add(&mut app, solid(UVec2::splat(64), [20, 160, 40, 255]));
    let fresh = spawn_sprite(&mut app, &image);
    hit(&mut app, center(fresh));
    settle(&mut app, fresh);
    assert!(shown(&app, fresh) == now);
}

#[test]
fn t10_a_changed_picture_of_another_size_is_cracked_anew_in_the_same_places() {
    let mut app = app();
    let samplers = [ImageSampler::nearest(), ImageSampler::linear()];
    let sizes = [UVec2::splat(128), UVec2::splat(31), UVec2::new(128, 64), UVec2::new(40, 90)];
    for (sampler, new_size) in samplers.into_iter().flat_map(|sampler| sizes.map(|size| (sampler.clone(), size))) {
        let solid = |size, texel| Image { sampler: sampler.clone(), ..solid(size, texel) };
        let image = add(&mut app, solid(UVec2::splat(64), [90, 90, 90, 255]));
        let entity = spawn_sprite(&mut app, &image);
        hit(&mut app, CrackHit::uv(entity, Vec2::new(0.75, 0.25)).with_energy(0.04));
        settle(&mut app, entity);
        let new = solid(new_size, [90, 90, 90, 255]);
        let base = new.data.clone().unwrap();
        replace(&mut app, &image, new);
        steps(&mut app, 200);
        settle(&mut app, entity);
        assert_eq!(size_of(&app, &image_of(&app, entity)), new_size);
        assert_eq!(get::<Sprite>(&app, entity).custom_size, None, "as large as its picture");
        let place = |now: &[u8]| {
            let (mut sum, mut n) = (Vec2::ZERO, 0.0);
            for (i, _) in now.chunks(4).zip(base.chunks(4)).enumerate().filter(|(_, (a, b))| a != b) {
                sum += Vec2::new(i as f32 % new_size.x as f32, (i as u32 / new_size.x) as f32) + 0.5;
                n += 1.0;
            }
            sum / n / new_size.as_vec2()
        };
        let at = place(&shown(&app, entity));
        assert!(at.distance(Vec2::new(0.75, 0.25)) < 0.15, "{new_size}: hit at 0.75, 0.25, cracked at {at}");
        // A further hit lands where it is aimed at.
        let before = shown(&app, entity);
        hit(&mut app, CrackHit::uv(entity, Vec2::new(0.2, 0.8)).with_energy(0.03));
        settle(&mut app, entity);
        let changed = shown(&app, entity).chunks(4).zip(before.chunks(4)).position(|(a, b)| a != b).map(|i| i as u32);
        let row = changed.expect("a crack") / new_size.x;
        assert!(row > new_size.y / 2, "{new_size}: aimed low, but row {row} has changed");
    }
}

/// A picture whose right half is transparent, 100 texels high.
fn half_transparent(width: u32) -> Image {
    let mut image = solid(UVec2::new(width, 100), [120, 110, 100, 255]);
    let row = 4 * width as usize;
    image.data.as_mut().unwrap().iter_mut().enumerate().for_each(|(i, byte)| {
        if i % 4 == 3 && i % row >= row / 2 {
            *byte = 0;
        }
    });
    image
}

/// Cracks that are grown again on a picture of other proportions avoid what is transparent there, as if they had been hit on it at once; what
/// is asked for is so from the next picture on.
#[test]
fn t10_cracks_on_another_picture_avoid_what_is_transparent() {
    let mut app = app();
    for alpha_mask in [true, false] {
        let surface = CrackSurface { alpha_mask, ..CrackSurface::new(CrackPreset::CONCRETE).with_seed(3) };
        let first = if alpha_mask { solid(UVec2::splat(100), [120, 110, 100, 255]) } else { half_transparent(100) };
        let image = add(&mut app, first);
        let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface.clone())).id();
        // What was avoided on the first picture is not any more.
        app.world_mut().get_mut::<CrackSurface>(entity).unwrap().alpha_mask = true;
        let at = Vec2::new(0.3, 0.5);
        hit(&mut app, CrackHit::uv(entity, at).with_energy(2.0));
        settle(&mut app, entity);
        app.world_mut().get_mut::<CrackSurface>(entity).unwrap().alpha_mask = alpha_mask;
        replace(&mut app, &image, half_transparent(140));
        steps(&mut app, 60);
        settle(&mut app, entity);
        let direct = add(&mut app, half_transparent(140));
        let direct = app.world_mut().spawn((Sprite::from_image(direct), surface)).id();
        hit(&mut app, CrackHit::uv(direct, at).with_energy(2.0));
        settle(&mut app, direct);
        assert_eq!(state(&app, entity).nodes, state(&app, direct).nodes, "{alpha_mask}");
        assert!(shown(&app, entity) == shown(&app, direct), "{alpha_mask}");
        for entity in [entity, direct] {
            hit(&mut app, CrackHit::uv(entity, Vec2::new(0.2, 0.8)).with_energy(2.0));
            settle(&mut app, entity);
        }
        assert!(shown(&app, entity) == shown(&app, direct), "{alpha_mask}, hit again");
    }
}

#[test]
fn t9_t10_reloaded_pictures_are_drawn() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let target = spawn_camera(&mut app, UVec2::splat(64));
    let image = add(&mut app, solid(UVec2::splat(64), [90, 90, 90, 255]));
    let entity = spawn_sprite(&mut app, &image);
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    let check = |app: &mut App, what: &str| {
        assert_on_gpu(app, &[entity]);
        assert_eq!(app.should_exit(), None, "{what}");
        let (now, on_screen) = (shown(app, entity), drawn(app, &target));
        assert!(difference(&now, &on_screen) <= 1, "{what}: drawn is not what is shown");
    };
    check(&mut app, "before");
    let same = solid(UVec2::splat(64), [20, 160, 40, 255]);
    replace(&mut app, &image, same);
    steps(&mut app, 3);
    check(&mut app, "same size");
    // A larger one, then the size of the camera again, with cracks growing.
    let larger = solid(UVec2::splat(100), [60, 60, 200, 255]);
    replace(&mut app, &image, larger);
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.2)));
    steps(&mut app, 3);
    assert_on_gpu(&mut app, &[entity]);
    let again = solid(UVec2::splat(64), [200, 60, 60, 255]);
    replace(&mut app, &image, again);
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.8)));
    settle(&mut app, entity);
    check(&mut app, "other sizes");
}

#[test]
fn t11_pictures_removed_and_swapped_while_cracks_grow() {
    let mut app = app();
    let image = add(&mut app, solid(UVec2::splat(64), [90, 90, 90, 255]));
    let [entity, later] = [(); 2].map(|()| spawn_sprite(&mut app, &image));
    hit(&mut app, center(entity));
    steps(&mut app, 3);
    assert_eq!(state(&app, entity).status, CrackStatus::Growing);
    let n_nodes = state(&app, entity).nodes;
    // The picture goes: the surface has its own copy and goes on.
    app.world_mut().resource_mut::<Assets<Image>>().remove(&image);
    settle(&mut app, entity);
    assert!(state(&app, entity).nodes > n_nodes);
    // One that has not been cracked yet waits for it to come back.
    hit(&mut app, center(later));
    steps(&mut app, 3);
    assert_eq!((state(&app, later).status, counts(&app).queued), (CrackStatus::Waiting, 1));
    let again = solid(UVec2::splat(64), [90, 90, 90, 255]);
    assert!(app.world_mut().resource_mut::<Assets<Image>>().insert(&image, again).is_ok());
    settle(&mut app, later);
    assert_eq!(shown(&app, later), shown(&app, entity), "the same crack");

    // Swapped while growing, for one of another size, that is loaded only then.
    let other = app.world().resource::<Assets<Image>>().reserve_handle();
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.2)));
    step(&mut app);
    app.world_mut().get_mut::<Sprite>(entity).unwrap().image = other.clone();
    steps(&mut app, 3);
    let new = solid(UVec2::splat(96), [20, 160, 40, 255]);
    let base = new.data.clone().unwrap();
    assert!(app.world_mut().resource_mut::<Assets<Image>>().insert(&other, new).is_ok());
    steps(&mut app, 3);
    settle(&mut app, entity);
    let own = image_of(&app, entity);
    assert_ne!(own, other, "its own copy");
    assert_eq!(size_of(&app, &own), UVec2::splat(96));
    assert!(share_untouched(&texels(&app, &own), &base) < 1.0, "the cracks are there");
    assert_eq!(texels(&app, &other), base, "the picture itself is untouched");
    // And given back.
    app.world_mut().commands().entity(entity).heal_cracks();
    step(&mut app);
    assert_eq!(image_of(&app, entity), other);
}

#[test]
fn t12_surfaces_that_share_a_picture_or_a_material() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let image = add(&mut app, picture(UVec2::splat(48)));
    let before = texels(&app, &image);
    let [a, b, c] = [(); 3].map(|()| spawn_sprite(&mut app, &image));
    hit(&mut app, CrackHit::uv(a, Vec2::splat(0.2)));
    hit(&mut app, CrackHit::uv(b, Vec2::splat(0.8)));
    settle(&mut app, a);
    settle(&mut app, b);
    let all = [a, b, c].map(|entity| shown(&app, entity));
    assert!(all[0] != all[1] && all[0] != before && all[1] != before && all[2] == before);
    assert_eq!(image_of(&app, c), image);
    assert_on_gpu(&mut app, &[a, b]);
    assert_eq!(gpu_texels(&mut app, std::slice::from_ref(&image))[0], before, "the original on the GPU, too");

    let mesh = add(&mut app, Mesh::from(Rectangle::new(1.0, 1.0)));
    let material = add(&mut app, ColorMaterial::from(image.clone()));
    let [a, b] = [(); 2].map(|()| {
        let shown = (Mesh2d(mesh.clone()), MeshMaterial2d(material.clone()));
        app.world_mut().spawn((shown, CrackSurface::default())).id()
    });
    hit(&mut app, center(a));
    settle(&mut app, a);
    let own = get::<MeshMaterial2d<ColorMaterial>>(&app, a).0;
    assert_ne!(own, material);
    assert_eq!(get::<MeshMaterial2d<ColorMaterial>>(&app, b).0, material);
    let texture = |handle: &Handle<ColorMaterial>| {
        app.world().resource::<Assets<ColorMaterial>>().get(handle).unwrap().texture.clone()
    };
    assert_eq!((texture(&own), texture(&material)), (get::<CrackTextures>(&app, a).diffuse, Some(image)));
}

#[test]
fn t13_surfaces_stay_visible_when_few_bytes_may_be_uploaded() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let target = spawn_camera(&mut app, UVec2::splat(64));
    let image = add(&mut app, solid(UVec2::splat(64), [90, 90, 90, 255]));
    let entity = spawn_sprite(&mut app, &image);
    steps(&mut app, 3);
    app.insert_resource(RenderAssetBytesPerFrame::new(1));
    // From the first crack on, while it grows, and when the picture is loaded anew.
    let mut uploaded = 0;
    let film = film(&mut app, &target, 40, |app, i| {
        if i % 8 == 0 {
            hit(app, CrackHit::uv(entity, Vec2::splat(0.2 + 0.02 * i as f32)));
        }
        match i {
            12 => replace(app, &image, solid(UVec2::splat(64), [20, 160, 40, 255])),
            24 => replace(app, &image, solid(UVec2::splat(80), [160, 20, 40, 255])),
            _ => {}
        }
        uploaded += app.world().resource::<CrackUploadStats>().bytes;
    });
    for (i, picture) in film.iter().enumerate() {
        let n_black = picture.chunks(4).filter(|texel| texel[..3] == [0, 0, 0]).count();
        assert!(n_black < 64 * 64 / 2, "frame {i}: the sprite is gone");
    }
    settle(&mut app, entity);
    assert!(uploaded > 0, "rectangles were uploaded");
    assert_on_gpu(&mut app, &[entity]);
}

#[test]
fn t14_a_cracked_picture_is_as_bright_as_before() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let target = spawn_camera(&mut app, UVec2::splat(64));
    let size = UVec2::splat(64);
    // sRGB, linear, of the other byte order, in floats with half brightness and beyond, half transparent.
    let half = |x: f32| (half_bits(x)).to_le_bytes();
    let float = [half(0.5), half(4.0), half(0.1), half(1.0)].concat();
    for (format, texel) in [
        (TextureFormat::Rgba8UnormSrgb, vec![128, 60, 200, 255]),
        (TextureFormat::Rgba8Unorm, vec![128, 60, 200, 255]),
        (TextureFormat::Bgra8UnormSrgb, vec![128, 60, 200, 255]),
        (TextureFormat::Bgra8Unorm, vec![128, 60, 200, 255]),
        (TextureFormat::Rgba16Float, float),
        (TextureFormat::Rgba8UnormSrgb, vec![128, 60, 200, 120]),
    ] {
        let mut image = picture_of(size, format);
        image.data = Some(texel.repeat(64 * 64));
        let image = add(&mut app, image);
        let entity = spawn_sprite(&mut app, &image);
        steps(&mut app, 2);
        let before = drawn(&mut app, &target);
        // A dot in a corner.
        app.world_mut().get_mut::<CrackSurface>(entity).unwrap().preset.as_mut().unwrap().growth.reach = 0.01;
        hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.1)));
        settle(&mut app, entity);
        let after = drawn(&mut app, &target);
        // Rows far from it.
        let far = 64 * 4 * 32;
        let worst = difference(&before[far..], &after[far..]);
        assert!(worst <= 2, "{format:?}: differs by {worst}: {:?} {:?}", &before[far..far + 4], &after[far..far + 4]);
        assert!(before[..far] != after[..far], "{format:?}: no crack is drawn");
        let textures: CrackTextures = get(&app, entity);
        let images = app.world().resource::<Assets<Image>>();
        let formats = [&textures.diffuse, &textures.normal].map(|handle| {
            let descriptor = &images.get(handle.as_ref().unwrap()).unwrap().texture_descriptor;
            assert_eq!(descriptor.mip_level_count, 1, "no mip levels, as the picture");
            descriptor.format
        });
        assert_eq!(formats, [TextureFormat::Rgba8UnormSrgb, TextureFormat::Rgba8Unorm], "normals are linear");
        app.world_mut().despawn(entity);
    }
    // A picture with mip levels is read at its largest, and the cracked one has all of them.
    let mut mipped = picture(size);
    let data = mipped.data.as_mut().unwrap();
    data.extend(vec![7; 32 * 32 * 4]);
    mipped.texture_descriptor.mip_level_count = 2;
    let mipped = add(&mut app, mipped);
    let entity = spawn_sprite(&mut app, &mipped);
    assert_cracks_alone(&mut app, entity);
    assert_on_gpu(&mut app, &[entity]);
    assert_eq!(app.should_exit(), None);
}

/// A hit after which the texture is as long as its own size says, with all levels, however many the picture had.
fn assert_cracks_alone(app: &mut App, entity: Entity) {
    hit(app, center(entity));
    settle(app, entity);
    let texels: usize = (0..=6).map(|level| (64 >> level) * (64 >> level)).sum();
    assert_eq!(shown(app, entity).len(), texels * 4);
}

/// The bits of a half-precision float: normal numbers that fit only.
fn half_bits(x: f32) -> u16 {
    let bits = x.to_bits();
    let exponent = ((bits >> 23) & 0xFF) as i32 - 127 + 15;
    ((exponent as u16) << 10) | ((bits >> 13) & 0x3FF) as u16
}

#[test]
fn t4_a_sprite_of_one_colour_without_a_size() {
    let mut app = app();
    // As many games make their bricks: the scale is the size.
    let scale = Transform::from_scale(Vec3::new(90.0, 60.0, 1.0));
    let sprite = Sprite { color: Color::srgb(0.2, 0.4, 0.9), ..default() };
    let entity = app.world_mut().spawn((sprite.clone(), scale, CrackSurface::default())).id();
    hit(&mut app, CrackHit::world(entity, Vec3::new(20.0, 10.0, 0.0)));
    settle(&mut app, entity);
    assert_eq!(size_of(&app, &image_of(&app, entity)), UVec2::new(512, 341), "cracks have room and are not stretched");
    assert!(share_untouched(&shown(&app, entity), &[255; 512 * 341 * 4]) > 0.5, "most of it is as it was");
    assert_eq!(get::<Sprite>(&app, entity).custom_size, Some(Vec2::ONE), "it is as large as before");
    app.world_mut().commands().entity(entity).heal_cracks();
    step(&mut app);
    let healed = get::<Sprite>(&app, entity);
    assert_eq!((healed.image, healed.custom_size), (sprite.image, None));
}

#[test]
fn t4_cracks_are_not_stretched_with_their_picture() {
    let mut app = app();
    let squares = add(&mut app, picture(UVec2::splat(64)));
    let image = add(&mut app, Image { sampler: ImageSampler::Default, ..picture(UVec2::splat(64)) });
    let [long, square] = [4.0, 1.0].map(|width| add(&mut app, Mesh::from(Rectangle::new(width, 1.0))));
    let flat = add(&mut app, ColorMaterial::from(image.clone()));
    let thick = add(&mut app, StandardMaterial { base_color_texture: Some(image.clone()), ..default() });
    let plain = add(&mut app, StandardMaterial::default());
    let sprite = |image: &Handle<Image>, size| Sprite { custom_size: size, ..Sprite::from_image(image.clone()) };
    let size = |width, height| Some(Vec2::new(width, height));
    let wide = Transform::from_scale(Vec3::new(-3.0, 1.0, 1.0));
    let all = [
        (app.world_mut().spawn(sprite(&image, size(400.0, 100.0))).id(), [256, 64]),
        (app.world_mut().spawn(sprite(&image, size(50.0, 150.0))).id(), [64, 192]),
        (app.world_mut().spawn(sprite(&image, size(130.0, 100.0))).id(), [64, 64]),
        (app.world_mut().spawn((sprite(&image, None), wide)).id(), [192, 64]),
        (app.world_mut().spawn(sprite(&squares, size(400.0, 100.0))).id(), [64, 64]),
        (app.world_mut().spawn((Mesh2d(long.clone()), MeshMaterial2d(flat))).id(), [256, 64]),
        (app.world_mut().spawn((Mesh3d(square), MeshMaterial3d(thick), wide)).id(), [192, 64]),
        (app.world_mut().spawn((Mesh3d(long), MeshMaterial3d(plain))).id(), [1024, 256]),
    ];
    for (entity, expected) in all {
        app.world_mut().entity_mut(entity).insert(CrackSurface::default());
        step(&mut app);
        let before = get_size(&app, entity);
        hit(&mut app, center(entity));
        settle(&mut app, entity);
        let diffuse = get::<CrackTextures>(&app, entity).diffuse.expect("a picture");
        assert_eq!(size_of(&app, &diffuse).to_array(), expected, "{entity}");
        assert_eq!(get_size(&app, entity), before, "as large on the screen");
        let painted = texels(&app, &diffuse);
        // What is shown in other proportions later stays as it is.
        let mut transform = app.world_mut().get_mut::<Transform>(entity).expect("a place");
        transform.scale.y *= 7.0;
        steps(&mut app, 3);
        assert_eq!(get::<CrackTextures>(&app, entity).diffuse.as_ref(), Some(&diffuse));
        assert!(texels(&app, &diffuse) == painted);
    }
    // Nor does a picture that is loaded anew change that, or what the crate or a game has given the sprite since.
    let [long, pulled] = [all[0].0, all[3].0];
    for entity in [long, pulled] {
        let (own, network) = (image_of(&app, entity), state(&app, entity).nodes);
        replace(
            &mut app,
            &image,
            Image { sampler: ImageSampler::Default, ..solid(UVec2::splat(64), [99, 99, 99, 255]) },
        );
        steps(&mut app, 3);
        assert_eq!(state(&app, entity).nodes, network);
        assert_eq!(size_of(&app, &image_of(&app, entity)), size_of(&app, &own));
    }
    // A picture of another size is shown in proportions of its own where nobody has given the sprite others.
    let own = add(&mut app, Image { sampler: ImageSampler::Default, ..picture(UVec2::splat(64)) });
    let plain = app.world_mut().spawn((sprite(&own, None), CrackSurface::default())).id();
    let wide = app.world_mut().spawn((sprite(&own, None), wide, CrackSurface::default())).id();
    for entity in [plain, wide] {
        hit(&mut app, center(entity));
        settle(&mut app, entity);
    }
    replace(&mut app, &own, Image { sampler: ImageSampler::Default, ..picture(UVec2::new(128, 64)) });
    steps(&mut app, 3);
    for (entity, expected) in [(plain, [128, 64]), (wide, [384, 64])] {
        assert_eq!(size_of(&app, &image_of(&app, entity)).to_array(), expected);
        assert_eq!(get_size(&app, entity), Some(Vec2::new(128.0, 64.0)));
    }
    // A part of the picture is not one of the textures that have more columns.
    app.world_mut().get_mut::<Sprite>(long).expect("the sprite").rect = Some(Rect::new(0.0, 0.0, 32.0, 64.0));
    steps(&mut app, 2);
    assert_eq!(size_of(&app, &image_of(&app, long)), UVec2::splat(64));
    // Where there is no room for it, they are stretched rather than refused.
    app.world_mut().resource_mut::<CrackBudget>().max_texture_bytes = 9_000_000;
    let left = app.world_mut().spawn((sprite(&image, size(900.0, 1.0)), CrackSurface::default())).id();
    hit(&mut app, center(left));
    settle(&mut app, left);
    assert_eq!(size_of(&app, &image_of(&app, left)), UVec2::splat(64));

    // Where all pictures show their texels as squares.
    let mut app = App::new();
    let pictures = ImagePlugin::default_nearest();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), pictures, CrackPlugins));
    start(&mut app);
    let image = add(&mut app, Image { sampler: ImageSampler::Default, ..picture(UVec2::splat(64)) });
    let entity = app.world_mut().spawn((sprite(&image, size(400.0, 100.0)), CrackSurface::default())).id();
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    assert_eq!(size_of(&app, &image_of(&app, entity)), UVec2::splat(64));
}

/// The size on the screen that a sprite is given, or has by its picture.
fn get_size(app: &App, entity: Entity) -> Option<Vec2> {
    let sprite = app.world().get::<Sprite>(entity)?;
    sprite.custom_size.or_else(|| Some(size_of(app, &sprite.image).as_vec2()))
}

#[test]
fn t4_a_size_that_a_game_gives_a_cracked_sprite_is_kept() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let entity = spawn_with(&mut app, &image, CrackResolution::Fixed(UVec2::splat(32)));
    let set_size = |app: &mut App, size: Option<Vec2>| {
        app.world_mut().get_mut::<Sprite>(entity).expect("the sprite").custom_size = size;
    };
    let heal = |app: &mut App| {
        app.world_mut().commands().entity(entity).heal_cracks();
        step(app);
    };
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    heal(&mut app);
    assert_eq!(get::<Sprite>(&app, entity).custom_size, None, "the size that the crate gave it is taken back");
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    let size = Some(Vec2::new(77.0, 33.0));
    set_size(&mut app, size);
    // Another picture, then none of ours.
    let other = add(&mut app, picture(UVec2::splat(16)));
    app.world_mut().get_mut::<Sprite>(entity).expect("the sprite").image = other;
    steps(&mut app, 2);
    assert_eq!(get::<Sprite>(&app, entity).custom_size, size);
    heal(&mut app);
    assert_eq!(get::<Sprite>(&app, entity).custom_size, size);
}

/// Rectangles that have no texel of a picture of 48 x 48.
fn beyond() -> Vec<Rect> {
    let bad = f32::NAN;
    let at = |min: Vec2, max: Vec2| Rect { min, max };
    vec![
        at(Vec2::new(48.0, 0.0), Vec2::new(64.0, 16.0)),
        at(Vec2::new(0.0, 48.0), Vec2::new(48.0, 49.0)),
        at(Vec2::splat(1e30), Vec2::splat(f32::MAX)),
        at(Vec2::splat(f32::NEG_INFINITY), Vec2::splat(-1.0)),
        at(Vec2::splat(30.0), Vec2::splat(10.0)),
        at(Vec2::new(10.0, 30.0), Vec2::new(30.0, 10.0)),
        at(Vec2::splat(5.0), Vec2::splat(5.0)),
        at(Vec2::splat(bad), Vec2::splat(bad)),
        at(Vec2::new(bad, 0.0), Vec2::new(bad, 48.0)),
    ]
}

#[test]
fn t15_a_part_of_the_picture_that_is_not_there() {
    let image = picture(UVec2::splat(48));
    // In the frame of the hit, beside the frames, by a bake that reads the picture, and made ready without a hit.
    for (case, preset) in
        [CrackPreset::BRICK, CrackPreset::CONCRETE, CrackPreset::BRICK, CrackPreset::BRICK].iter().enumerate()
    {
        let mut app = app();
        app.init_resource::<crate::guided::Told>();
        let mut app = crate::guided::listening(app);
        if case > 0 {
            app.world_mut().resource_mut::<CrackBudget>().milliseconds = 2.0;
        }
        let image = add(&mut app, image.clone());
        for (i, rect) in beyond().into_iter().enumerate() {
            let sprite = Sprite { rect: Some(rect), ..Sprite::from_image(image.clone()) };
            let surface = CrackSurface::new(preset.clone()).with_mask(CrackMaskSource::FromPicture);
            let entity = app.world_mut().spawn((sprite, surface)).id();
            match case {
                0 | 1 => hit(&mut app, center(entity)),
                2 => _ = app.world_mut().entity_mut(entity).insert(GuidedCracks::new(CrackGuide::own_edges())),
                _ => _ = app.world_mut().commands().entity(entity).prepare_cracks(),
            }
            wait_for(&mut app, "the failure", |app| crate::guided::told(app).failed.len() > i);
            steps(&mut app, 3);
            let failed = &crate::guided::told(&app).failed;
            assert_eq!((failed.len(), failed[i].0), (i + 1, entity), "once");
            let error = &failed[i].1;
            assert!(matches!(error, CrackError::Part { size, .. } if *size == UVec2::splat(48)), "{rect:?}: {error:?}");
            assert!(error.to_string().contains("Sprite::rect"), "{error}");
        }
    }
}

/// What there is of a frame that the sheet's edge cuts off cracks where it is hit, and its shards are where it is seen.
#[test]
fn t15_frames_that_are_cut_off_by_the_edge_of_the_sheet() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::new(40, 32)));
    let grid = add(&mut app, TextureAtlasLayout::from_grid(UVec2::splat(32), 2, 1, None, None));
    let rects = [
        (Sprite { texture_atlas: Some(TextureAtlas { layout: grid, index: 1 }), ..default() }, [32, 0, 40, 32]),
        (Sprite { rect: Some(Rect::new(-8.0, -16.0, 24.0, 16.0)), ..default() }, [0, 0, 24, 16]),
        (Sprite { rect: Some(Rect::new(30.0, 20.0, 60.0, 50.0)), flip_x: true, ..default() }, [30, 20, 40, 32]),
        (Sprite { rect: Some(Rect::new(8.0, 4.0, 40.0, 32.0)), flip_y: true, ..default() }, [8, 4, 40, 32]),
        (
            Sprite {
                rect: Some(Rect::new(20.0, 0.0, 60.0, 40.0)),
                custom_size: Some(Vec2::new(80.0, 20.0)),
                ..default()
            },
            [20, 0, 40, 32],
        ),
    ];
    let mut rng = Rng::new(2);
    for (sprite, [left, top, right, bottom]) in rects {
        let what = format!("{:?} {:?} {:?}", sprite.rect, sprite.custom_size, sprite.texture_atlas);
        let (min, max) = (Vec2::new(left as f32, top as f32), Vec2::new(right as f32, bottom as f32));
        let sprite = Sprite { image: image.clone(), ..sprite };
        let (flip, whole) =
            (BVec2::new(sprite.flip_x, sprite.flip_y), sprite.rect.unwrap_or(Rect::new(32.0, 0.0, 64.0, 32.0)));
        let size = sprite.custom_size.unwrap_or(whole.size());
        let shatter = ShatterCracks {
            cut: bevy_crack::shatter::ShatterParams { extend_cracks: true, ..default() },
            anchor: bevy_crack::shatter::Anchor::Nothing,
            rim: Some(bevy_crack::shatter::RimLook::PLAIN),
            speed: 0.0,
            ..default()
        };
        let place = Transform::from_xyz(7.0, -3.0, 0.0);
        let entity = app.world_mut().spawn((sprite, place, CrackSurface::new(CrackPreset::GLASS), shatter)).id();
        // Where the engine draws a texel of the picture.
        let drawn = |texel: Vec2| {
            let share = (texel - whole.center()) / whole.size();
            (Vec2::select(flip, -share, share) * Vec2::new(1.0, -1.0) * size + Vec2::new(7.0, -3.0)).extend(0.0)
        };
        step(&mut app);
        let before = counts(&app);
        for _ in 0..20 {
            let texel = min - 6.0 + Vec2::new(rng.unit(), rng.unit()) * (max - min + 12.0);
            let (is_seen, is_shown) = (texel.cmpge(min).all() && texel.cmple(max).all(), whole.contains(texel));
            let near = (texel - min).abs().min_element().min((texel - max).abs().min_element()) < 0.01;
            if near || (!is_seen && !is_shown) {
                continue;
            }
            let rejected = counts(&app).rejected;
            hit(&mut app, CrackHit::world(entity, drawn(texel)));
            step(&mut app);
            assert_eq!(counts(&app).rejected - rejected, u64::from(!is_seen), "{what}: {texel}");
            if is_seen {
                let mut places = bevy::ecs::system::SystemState::<CrackPlaces>::new(app.world_mut());
                let uv = (texel - min) / (max - min);
                let place = places.get(app.world()).expect("the places").at(entity, uv).expect("a place").position;
                assert!(place.distance(drawn(texel)) < 1e-3, "{what}: {place} of {texel}");
            }
        }
        assert!(counts(&app).applied + counts(&app).merged > before.applied + before.merged, "{what}");
        settle(&mut app, entity);
        app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::ALL);
        steps(&mut app, 4);
        let mut query = app.world_mut().query::<(&Shard, &GlobalTransform, &Mesh2d)>();
        let meshes = app.world().resource::<Assets<Mesh>>();
        let mut corners = 0;
        for (_, place, mesh) in query.iter(app.world()) {
            let mesh = meshes.get(&mesh.0).expect("its mesh");
            let Some(bevy::mesh::VertexAttributeValues::Float32x3(at)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION)
            else {
                panic!()
            };
            let Some(bevy::mesh::VertexAttributeValues::Float32x2(uvs)) = mesh.attribute(Mesh::ATTRIBUTE_UV_0) else {
                panic!()
            };
            for (at, uv) in at.iter().zip(uvs) {
                let found = place.transform_point(Vec3::from(*at)).truncate();
                let expected = drawn(Vec2::from(*uv) * Vec2::new(40.0, 32.0)).truncate();
                assert!(found.distance(expected) < 2e-3, "{what}: {found}, not {expected}");
                corners += 1;
            }
        }
        assert!(corners > 10, "{what}: {corners}");
        app.world_mut().despawn(entity);
        step(&mut app);
    }
}

/// A surface that has shattered shows other parts of its sheet, as they come: of other sizes, cut off, beyond it.
#[test]
fn t15_a_broken_sprite_shows_other_parts_of_its_sheet() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::new(40, 32)));
    let grid = add(&mut app, TextureAtlasLayout::from_grid(UVec2::splat(32), 3, 1, None, None));
    let mut frames = TextureAtlasLayout::new_empty(UVec2::splat(64));
    let mut rng = Rng::new(8);
    for _ in 0..12 {
        let min = UVec2::new(rng.next_u32() % 44, rng.next_u32() % 36);
        frames.add_texture(URect { min, max: min + UVec2::new(rng.next_u32() % 30, rng.next_u32() % 30) });
    }
    let frames = add(&mut app, frames);
    for (layout, count) in [(grid, 4), (frames, 13)] {
        let sprite =
            Sprite { texture_atlas: Some(TextureAtlas { layout, index: 0 }), ..Sprite::from_image(image.clone()) };
        let shatter = ShatterCracks { anchor: bevy_crack::shatter::Anchor::Nothing, ..default() };
        let entity = app.world_mut().spawn((sprite, CrackSurface::new(CrackPreset::MUD), shatter)).id();
        let mut gone = 0;
        for frame in 0..400 {
            if frame % 7 == 0 {
                hit(&mut app, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())).with_energy(4.0));
            }
            if frame > 60 && frame % 20 == 0 {
                let around = ShatterRequest::around(Vec2::new(rng.unit(), rng.unit()), 0.2);
                app.world_mut().commands().entity(entity).shatter_cracks(around);
            }
            if frame > 60 && frame % 5 == 0 {
                let mut sprite = app.world_mut().get_mut::<Sprite>(entity).unwrap();
                sprite.texture_atlas.as_mut().unwrap().index = rng.next_u32() as usize % count;
            }
            if frame % 130 == 129 {
                app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = -1.0;
            } else if frame % 130 == 30 {
                app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = 1.0;
            }
            step(&mut app);
            gone += app.world().get::<CrackShards>(entity).map_or(0, |shards| shards.gone);
        }
        assert!(gone > 0, "it has shattered");
        assert_sound(&app, entity);
        app.world_mut().commands().entity(entity).heal_cracks();
        step(&mut app);
        assert_eq!(image_of(&app, entity), image);
        app.world_mut().despawn(entity);
    }
}

/// A mesh that has shattered is given a material of another kind, or a sprite, whose picture cannot be read, and shatters again.
#[test]
fn t11_what_has_shattered_is_shown_by_something_of_another_kind() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let mesh = add(&mut app, Mesh::from(Rectangle::new(64.0, 64.0)));
    let lit = add(&mut app, CrackLitMaterial::new(image.clone()));
    let plain = add(&mut app, ColorMaterial::from(image.clone()));
    for case in 0..4 {
        let unreadable = add(&mut app, Image { data: None, ..picture(UVec2::splat(48)) });
        let plain_after = add(&mut app, ColorMaterial::from(unreadable.clone()));
        let lit_after = add(&mut app, CrackLitMaterial::new(unreadable.clone()));
        let shatter = ShatterCracks { anchor: bevy_crack::shatter::Anchor::Nothing, ..default() };
        let mut entity = app.world_mut().spawn((CrackSurface::new(CrackPreset::MUD), shatter));
        match case {
            0 | 2 => entity.insert((Mesh2d(mesh.clone()), MeshMaterial2d(lit.clone()))),
            1 => entity.insert((Mesh2d(mesh.clone()), MeshMaterial2d(plain.clone()))),
            _ => entity.insert(Sprite::from_image(image.clone())),
        };
        let entity = entity.id();
        hit(&mut app, center(entity));
        settle_any(&mut app, entity);
        let shatter = |app: &mut App, at: f32| {
            app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::around(Vec2::splat(at), 0.1));
            steps(app, 4);
            app.world().get::<CrackShards>(entity).map_or(0, |shards| shards.gone)
        };
        let gone = shatter(&mut app, 0.3);
        assert!(gone > 0);
        // It stays what it is until what it was given is accepted.
        let mut it = app.world_mut().entity_mut(entity);
        match case {
            0 => it.remove::<MeshMaterial2d<CrackLitMaterial>>().insert(MeshMaterial2d(plain_after.clone())),
            1 => it.remove::<MeshMaterial2d<ColorMaterial>>().insert(MeshMaterial2d(lit_after.clone())),
            2 => it.insert(Sprite::from_image(unreadable.clone())),
            _ => it.remove::<Sprite>().insert((Mesh2d(mesh.clone()), MeshMaterial2d(plain_after.clone()))),
        };
        steps(&mut app, 3);
        assert_eq!(state(&app, entity).status, CrackStatus::Failed(CrackError::NoCpuData), "case {case}");
        assert_eq!(app.world().get::<CrackShards>(entity).map(|shards| shards.gone), Some(gone));
        shatter(&mut app, 0.7);
        // What its shards wear is there.
        let shards: Vec<Entity> = app.world_mut().query_filtered::<Entity, With<Shard>>().iter(app.world()).collect();
        assert!(!shards.is_empty());
        for shard in shards {
            let [plain, lit] = [
                app.world()
                    .get::<MeshMaterial2d<ColorMaterial>>(shard)
                    .is_some_and(|material| app.world().resource::<Assets<ColorMaterial>>().contains(&material.0)),
                app.world()
                    .get::<MeshMaterial2d<CrackLitMaterial>>(shard)
                    .is_some_and(|material| app.world().resource::<Assets<CrackLitMaterial>>().contains(&material.0)),
            ];
            assert!(plain != lit, "case {case}: one material that is there");
            assert_eq!(lit, case == 0 || case == 2, "case {case}: of the kind that it was");
        }
        // Its picture comes after all: it is whole, on that one.
        replace(&mut app, &unreadable, picture(UVec2::splat(48)));
        steps(&mut app, 5);
        assert!(
            !matches!(state(&app, entity).status, CrackStatus::Failed(_)),
            "case {case}: {:?}",
            state(&app, entity)
        );
        assert!(app.world().get::<CrackShards>(entity).is_none());
        assert_eq!(app.world_mut().query::<&Shard>().iter(app.world()).count(), 0);
        let textures: CrackTextures = get(&app, entity);
        assert_eq!(size_of(&app, textures.diffuse.as_ref().expect("a diffuse texture")), UVec2::splat(48));
        assert_eq!(shows(&app, entity).as_ref(), textures.diffuse.as_ref(), "case {case}");
        assert!(shatter(&mut app, 0.5) > 0);
        // And given back.
        app.world_mut().commands().entity(entity).heal_cracks();
        step(&mut app);
        assert_eq!(shows(&app, entity), Some(unreadable), "case {case}");
        if case == 2 {
            assert_eq!(get::<MeshMaterial2d<CrackLitMaterial>>(&app, entity).0, lit, "what it showed before");
        }
        app.world_mut().despawn(entity);
        steps(&mut app, 2);
    }
}

/// Frames until its cracks have ended, whatever shows them.
fn settle_any(app: &mut App, entity: Entity) {
    step(app);
    wait_for(app, "the end of the cracks", |app| state(app, entity).status == CrackStatus::Done);
}

/// The picture that an entity shows.
fn shows(app: &App, entity: Entity) -> Option<Handle<Image>> {
    let world = app.world();
    if let Some(sprite) = world.get::<Sprite>(entity) {
        return Some(sprite.image.clone());
    }
    if let Some(material) = world.get::<MeshMaterial2d<ColorMaterial>>(entity) {
        return world.resource::<Assets<ColorMaterial>>().get(&material.0)?.texture.clone();
    }
    let material = world.get::<MeshMaterial2d<CrackLitMaterial>>(entity)?;
    world.resource::<Assets<CrackLitMaterial>>().get(&material.0)?.diffuse.clone()
}

/// Meshes that tangents cannot be made for, and what is said of them.
fn broken_meshes() -> Vec<(Mesh, &'static str)> {
    use bevy::mesh::Indices;
    let quad = || Mesh::from(Rectangle::new(2.0, 1.0));
    let mut meshes = Vec::new();
    for index in [4, 900, u32::MAX] {
        meshes.push((quad().with_inserted_indices(Indices::U32(vec![0, 1, 2, 0, 2, index])), "names vertex"));
    }
    meshes.push((quad().with_inserted_indices(Indices::U16(vec![0, 1, u16::MAX])), "names vertex 65535 of 4"));
    meshes.push((quad().with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; 3]), "3 normals"));
    meshes.push((quad().with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, vec![[0.0, 0.5]; 2]), "2 texture coordinates"));
    for bad in [f32::NAN, f32::INFINITY] {
        let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [bad, 1.0, 0.0], [0.0, 1.0, 0.0]];
        meshes.push((quad().with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions), "vertex 2 are not finite"));
        let uvs = vec![[0.0, 0.0], [1.0, bad], [1.0, 1.0], [0.0, 1.0]];
        meshes.push((quad().with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs), "vertex 1 are not finite"));
    }
    let fan = (0..5000u32).flat_map(|i| [0, 1 + i % 3, 1 + (i + 1) % 3]).collect();
    meshes.push((quad().with_inserted_indices(Indices::U32(fan)), "5000 of its triangles meet in one vertex"));
    let flat = (0..40_000u32).flat_map(|i| if i % 2 == 0 { [0, 1, 2] } else { [0, 0, 1] }).collect();
    meshes.push((quad().with_inserted_indices(Indices::U32(flat)), "20000 of its 40000 triangles have no area"));
    meshes
}

#[test]
fn t16_broken_3d_meshes_are_refused_by_name() {
    let mut app = app();
    single_threaded(&mut app);
    let image = add(&mut app, picture(UVec2::splat(48)));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() });
    let spawn = |app: &mut App, mesh: Mesh, surface: CrackSurface| {
        let mesh = add(app, mesh);
        app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material.clone()), surface)).id()
    };
    for (mesh, said) in broken_meshes() {
        let entity = spawn(&mut app, mesh.clone(), CrackSurface::default());
        let heard = warnings(|| {
            for _ in 0..3 {
                hit(&mut app, center(entity));
                steps(&mut app, 2);
            }
        });
        let CrackStatus::Failed(CrackError::Mesh { reason }) = state(&app, entity).status else {
            panic!("{said}: {:?}", state(&app, entity))
        };
        assert!(reason.contains(said), "{reason}, not {said}");
        assert_eq!(heard.len(), 1, "one warning: {heard:?}");
        assert!(app.world().get::<CrackTextures>(entity).is_none());
        // The other ways to a surface.
        let prepared = spawn(&mut app, mesh.clone(), CrackSurface::default());
        app.world_mut().commands().entity(prepared).prepare_cracks();
        let baked = spawn(&mut app, mesh.clone(), CrackSurface::default());
        app.world_mut().entity_mut(baked).insert(GuidedCracks::default());
        steps(&mut app, 5);
        assert!(matches!(state(&app, prepared).status, CrackStatus::Failed(CrackError::Mesh { .. })), "{said}");
        assert!(app.world().get::<CrackTextures>(baked).is_none(), "{said}");
        // Without maps that need tangents it cracks.
        let flat = CrackSurface::default().with_maps(CrackMaps { normal: false, depth: false, ..default() });
        let flat = spawn(&mut app, mesh, flat);
        hit(&mut app, center(flat));
        settle_any(&mut app, flat);
        for entity in [entity, prepared, baked, flat] {
            app.world_mut().despawn(entity);
        }
    }
    // One that breaks when its surface is there already is left as it is.
    let whole = spawn(&mut app, Mesh::from(Rectangle::new(2.0, 1.0)), CrackSurface::default());
    hit(&mut app, center(whole));
    settle_any(&mut app, whole);
    let own: Mesh3d = get(&app, whole);
    let tangents = |app: &App, mesh: &Handle<Mesh>| {
        let mesh = app.world().resource::<Assets<Mesh>>().get(mesh).expect("the mesh");
        mesh.attribute(Mesh::ATTRIBUTE_TANGENT).is_some()
    };
    assert!(tangents(&app, &own.0), "its own mesh has tangents");
}

/// What is let through the engine makes tangents for, whatever it is: thousands of meshes of random numbers, of which many are broken.
#[test]
fn t16_what_is_let_through_gets_tangents() {
    use bevy::mesh::{Indices, PrimitiveTopology};
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(8)));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() });
    let mut rng = Rng::new(16);
    let (mut made, mut refused) = (0, 0);
    for _ in 0..600 {
        let n = 1 + rng.next_u32() % 9;
        let is_odd = rng.unit() < 0.3;
        let mut number = |rng: &mut Rng| match rng.next_u32() % 40 {
            0 if is_odd => f32::NAN,
            1 if is_odd => f32::INFINITY,
            2 => 1e38,
            3 => 1e-40,
            4 => -0.0,
            5 | 6 => 0.0,
            _ => rng.signed(),
        };
        let vertex = |rng: &mut Rng, number: &mut dyn FnMut(&mut Rng) -> f32| [number(rng), number(rng), number(rng)];
        let short = |rng: &mut Rng| if is_odd && rng.unit() < 0.3 { n - 1 } else { n };
        let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        let count = short(&mut rng);
        let positions: Vec<[f32; 3]> = (0..count).map(|_| vertex(&mut rng, &mut number)).collect();
        let normals: Vec<[f32; 3]> = (0..short(&mut rng)).map(|_| vertex(&mut rng, &mut number)).collect();
        let uvs: Vec<[f32; 2]> = (0..short(&mut rng)).map(|_| [number(&mut rng), number(&mut rng)]).collect();
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, normals);
        mesh.insert_attribute(Mesh::ATTRIBUTE_UV_0, uvs);
        let beyond = u32::from(is_odd && rng.unit() < 0.3);
        let indices = (0..rng.next_u32() % 40).map(|_| rng.next_u32() % (n + beyond)).collect();
        if rng.unit() < 0.8 {
            mesh.insert_indices(Indices::U32(indices));
        }
        let mesh = add(&mut app, mesh);
        let surface = CrackSurface::new(small_preset());
        let entity = app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material.clone()), surface)).id();
        hit(&mut app, center(entity));
        steps(&mut app, 2);
        match state(&app, entity).status {
            CrackStatus::Failed(CrackError::Mesh { .. }) => refused += 1,
            CrackStatus::Failed(error) => panic!("{error}"),
            _ => {
                let own: Mesh3d = get(&app, entity);
                let mesh = app.world().resource::<Assets<Mesh>>().get(&own.0).expect("the mesh");
                made += usize::from(mesh.attribute(Mesh::ATTRIBUTE_TANGENT).is_some());
            }
        }
        app.world_mut().despawn(entity);
    }
    assert!(made > 200 && refused > 50, "{made} made, {refused} refused");
}

/// A picture of more texels than numbers can say.
#[test]
fn t6_a_picture_that_says_it_is_huge() {
    let mut app = app();
    let mut huge = picture(UVec2::splat(4));
    huge.texture_descriptor.size = Extent3d { width: u32::MAX, height: u32::MAX, depth_or_array_layers: 1 };
    let huge = add(&mut app, huge);
    let entity = spawn_sprite(&mut app, &huge);
    let error = assert_fails(&mut app, entity);
    assert!(matches!(error, CrackError::DataLength { expected: u64::MAX, actual: 64 }), "{error:?}");
}

#[test]
fn t4_a_chunk_of_a_tilemap_says_what_to_do() {
    use bevy::sprite_render::{
        TileData, TilemapChunk, TilemapChunkMaterial, TilemapChunkMeshCache, TilemapChunkTileData,
    };
    let mut app = app();
    app.init_resource::<TilemapChunkMeshCache>().init_asset::<TilemapChunkMaterial>();
    let tileset = add(&mut app, picture(UVec2::splat(16)));
    let chunk = TilemapChunk { chunk_size: UVec2::splat(2), tile_display_size: UVec2::splat(8), tileset, ..default() };
    let tiles = TilemapChunkTileData(vec![Some(TileData::from_tileset_index(0)); 4]);
    let entity = app.world_mut().spawn((chunk, tiles, CrackSurface::default())).id();
    step(&mut app);
    hit(&mut app, center(entity));
    step(&mut app);
    assert_eq!(state(&app, entity).status, CrackStatus::Failed(CrackError::Tilemap));
    let said = CrackError::Tilemap.to_string();
    for word in ["TilemapChunkTileData", "`Sprite`", "`Mesh2d`", "calculate_tile_transform"] {
        assert!(said.contains(word), "{said}");
    }
}
