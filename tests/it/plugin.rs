//! The plugin without a renderer: what games do, and the faults of `I`, `T` and `E` that need no GPU.

use crate::support::*;
use bevy::{
    asset::AssetPlugin,
    image::{ImagePlugin, TextureAtlas, TextureAtlasLayout},
    prelude::*,
    render::render_resource::TextureFormat,
    sprite::Anchor,
    time::TimeUpdateStrategy,
};
use bevy_crack::{math::Rng, prelude::*};
use std::time::Duration;

fn surface() -> CrackSurface {
    CrackSurface::new(CrackPreset::CONCRETE)
}

#[derive(Resource, Default)]
struct Seen {
    finished: Vec<Entity>,
    failed: Vec<(Entity, CrackError)>,
}

fn listen(app: &mut App) {
    app.init_resource::<Seen>()
        .add_observer(|event: On<CrackFinished>, mut seen: ResMut<Seen>| seen.finished.push(event.entity))
        .add_observer(|event: On<CrackFailed>, mut seen: ResMut<Seen>| {
            seen.failed.push((event.entity, event.error.clone()));
        });
}

#[test]
fn sprite_cracks_and_heals() {
    let mut app = app();
    listen(&mut app);
    let image = add(&mut app, picture(UVec2::new(96, 64)));
    let before = texels(&app, &image);
    let images = app.world().resource::<Assets<Image>>().len();
    let [cracked, other] = [0, 1].map(|_| app.world_mut().spawn((Sprite::from_image(image.clone()), surface())).id());
    app.update();
    assert_eq!(app.world().resource::<Assets<Image>>().len(), images, "nothing is made before a hit");
    hit(&mut app, CrackHit::uv(cracked, Vec2::splat(0.5)));
    settle(&mut app, cracked);

    let textures = app.world().get::<CrackTextures>(cracked).unwrap().clone();
    let own = app.world().get::<Sprite>(cracked).unwrap().image.clone();
    assert_eq!(textures.diffuse, Some(own.clone()));
    assert_ne!(texels(&app, &own), before, "cracks show");
    assert!(texels(&app, textures.normal.as_ref().unwrap()).chunks(4).any(|n| n != [128, 128, 255, 255]), "in normals");
    assert_eq!(texels(&app, &image), before, "the picture itself is untouched");
    assert_eq!(app.world().get::<Sprite>(other).unwrap().image, image, "and so is its other user");
    assert_eq!(state(&app, other), CrackState::default());
    let now = state(&app, cracked);
    assert!(now.damage > 0.0 && now.damage <= 1.0 && now.nodes > 1 && now.hits == 1, "{now:?}");
    assert_eq!(app.world().resource::<Seen>().finished, [cracked]);

    app.world_mut().commands().entity(cracked).heal_cracks();
    app.update();
    assert_eq!(app.world().get::<Sprite>(cracked).unwrap().image, image);
    assert!(app.world().get::<CrackTextures>(cracked).is_none());
    assert_eq!(state(&app, cracked), CrackState::default());
    drop((own, textures));
    app.update();
    app.update();
    // It cracks again, the same way.
    hit(&mut app, CrackHit::uv(cracked, Vec2::splat(0.5)));
    settle(&mut app, cracked);
    assert!(counts(&app).applied == 2);
}

/// The pattern does not depend on the frame rate (E7), on the budget or on other surfaces, however many threads paint them.
#[test]
fn same_hits_same_texels() {
    let run = |milliseconds: u64, budget: f32, others: usize| {
        let mut app = app();
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(milliseconds)));
        app.world_mut().resource_mut::<CrackBudget>().milliseconds = budget;
        let image = add(&mut app, picture(UVec2::splat(128)));
        for _ in 0..others {
            let other = app.world_mut().spawn((Sprite::from_image(image.clone()), surface().with_seed(9))).id();
            hit(&mut app, CrackHit::uv(other, Vec2::splat(0.3)));
        }
        let entity = app.world_mut().spawn((Sprite::from_image(image), surface())).id();
        hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
        settle(&mut app, entity);
        texels(&app, &app.world().get::<Sprite>(entity).unwrap().image.clone())
    };
    let reference = run(20, 1e6, 0);
    assert_eq!(run(3, 1e6, 0), reference, "another frame rate");
    assert_eq!(run(200, 1e6, 0), reference, "slow frames");
    assert_eq!(run(20, 0.0, 3), reference, "no budget and other surfaces");
    assert_eq!(run(20, 1e6, 100), reference, "side by side with many");
    assert_eq!(run(20, 0.5, 100), reference, "side by side with as many as there is time for");
}

/// Where frames have no time to paint a surface, it waits and makes up for four frames at most: no crack jumps.
#[test]
fn what_waits_to_be_painted_grows_on_where_it_was() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let surfaces: Vec<Entity> = (0..60)
        .map(|seed| {
            let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface().with_seed(seed))).id();
            hit(&mut app, center(entity));
            entity
        })
        .collect();
    (0..4).for_each(|_| app.update());
    let times = |app: &App| surfaces.iter().map(|entity| state(app, *entity).time).collect::<Vec<f32>>();
    let before = times(&app);
    // All are to be painted, and each frame paints one.
    for entity in &surfaces {
        let mut surface = app.world_mut().get_mut::<CrackSurface>(*entity).unwrap();
        surface.preset.as_mut().unwrap().look.glint = 0.9;
    }
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
    (0..20).for_each(|_| app.update());
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 1e6;
    let gained = |app: &App| times(app).iter().zip(&before).map(|(now, before)| now - before).collect::<Vec<f32>>();
    // One frame paints them, the next one lets them grow on.
    app.update();
    let waiting = gained(&app).iter().filter(|gain| **gain <= 1.0).count();
    assert!(waiting >= 36, "{:?}", gained(&app));
    app.update();
    let gained = gained(&app);
    // The steps of four frames, and those of this one and of two in which they were on time.
    assert!(gained.iter().all(|gain| *gain <= 7.0), "{gained:?}");
    let is_done = |entity| state(&app, entity).status == CrackStatus::Done;
    assert!(surfaces.iter().zip(&gained).all(|(entity, gain)| *gain >= 4.0 || is_done(*entity)), "{gained:?}");
    // Without a hurry they come to the same end.
    surfaces.iter().for_each(|entity| settle(&mut app, *entity));
}

/// I9, I1, I4, I10: hits on nothing, with broken numbers, with broken transforms: refused, counted, no panic.
#[test]
fn broken_hits_are_counted() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(32)));
    let good = app.world_mut().spawn((Sprite::from_image(image.clone()), surface())).id();
    let flat = app.world_mut().spawn((Sprite::from_image(image.clone()), surface(), Transform::from_scale(Vec3::ZERO)));
    let flat = flat.id();
    let plain = app.world_mut().spawn(Sprite::from_image(image)).id();
    let gone = app.world_mut().spawn(surface()).id();
    app.world_mut().despawn(gone);
    let hits = [
        CrackHit::uv(gone, Vec2::ZERO),
        CrackHit::uv(plain, Vec2::ZERO),
        CrackHit::uv(good, Vec2::new(f32::NAN, 0.0)),
        CrackHit::world(good, Vec3::splat(f32::INFINITY)),
        CrackHit::uv(good, Vec2::splat(0.5)).with_energy(f32::NAN),
        CrackHit::uv(good, Vec2::splat(0.5)).with_energy(-1.0),
        CrackHit::uv(good, Vec2::splat(1.5)),
        CrackHit::world(good, Vec3::splat(1e30)),
        CrackHit::world(flat, Vec3::ZERO),
    ];
    for (i, hit) in hits.into_iter().enumerate() {
        if i % 2 == 0 {
            app.world_mut().trigger(hit);
        } else {
            app.world_mut().write_message(hit);
        }
    }
    app.world_mut().trigger(CrackHit::uv(good, Vec2::splat(0.5)).with_energy(0.0));
    app.update();
    app.update();
    let stats = counts(&app);
    assert_eq!((stats.rejected, stats.ignored, stats.queued), (hits.len() as u64, 1, 0), "{stats:?}");
}

/// I6: more hits than a surface may queue: merged, never lost, drained within the budget.
#[test]
fn ten_thousand_hits_in_a_frame() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 2.0;
    let image = add(&mut app, picture(UVec2::splat(128)));
    let entity = app.world_mut().spawn((Sprite::from_image(image), surface())).id();
    let mut rng = Rng::new(1);
    for _ in 0..10_000 {
        app.world_mut().write_message(CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())));
    }
    app.update();
    let first = counts(&app);
    assert_eq!(first.sent, 10_000);
    assert!(first.merged >= 10_000 - 4096, "{first:?}");
    let mut frames = 1;
    while counts(&app).queued > 0 {
        app.update();
        frames += 1;
        assert!(frames < 20_000, "the queue drains");
    }
    println!("10,000 hits: {frames} frames, {:?}", counts(&app));
}

/// I7: hits on many surfaces: each shows something soon.
#[test]
fn turns_are_fair() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
    let image = add(&mut app, picture(UVec2::splat(32)));
    let surfaces: Vec<_> =
        (0..20).map(|_| app.world_mut().spawn((Sprite::from_image(image.clone()), surface())).id()).collect();
    // The first surface is sent most of the hits.
    for entity in std::iter::repeat_n(surfaces[0], 380).chain(surfaces.clone()) {
        app.world_mut().write_message(CrackHit::uv(entity, Vec2::splat(0.5)));
    }
    for _ in 0..25 {
        app.update();
    }
    for entity in surfaces {
        assert_ne!(state(&app, entity).status, CrackStatus::Untouched, "one hit a frame, in turns");
    }
    counts(&app);
}

/// World points reach the texel that Bevy says, whatever flip, anchor, rect, size and transform.
#[test]
fn sprites_are_hit_where_they_are_seen() {
    let mut rng = Rng::new(7);
    for round in 0..60 {
        let mut app = app();
        let image = add(&mut app, picture(UVec2::new(64, 48)));
        let layout = TextureAtlasLayout::from_grid(UVec2::new(32, 24), 2, 2, None, None);
        let layout = app.world_mut().resource_mut::<Assets<TextureAtlasLayout>>().add(layout);
        let mut sprite = Sprite { flip_x: rng.unit() < 0.5, flip_y: rng.unit() < 0.5, ..Sprite::from_image(image) };
        if rng.unit() < 0.5 {
            sprite.custom_size = Some(Vec2::new(rng.range(10.0, 200.0), rng.range(10.0, 200.0)));
        }
        match round % 3 {
            0 => sprite.texture_atlas = Some(TextureAtlas { layout, index: (round / 3) % 4 }),
            1 => sprite.rect = Some(Rect::new(8.0, 4.0, 56.0, 44.0)),
            _ => {}
        }
        let anchor = Anchor(Vec2::new(rng.range(-0.5, 0.5), rng.range(-0.5, 0.5)));
        let scale = |rng: &mut Rng| rng.range(0.3, 3.0) * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
        let transform = |rng: &mut Rng| Transform {
            translation: Vec3::new(rng.range(-300.0, 300.0), rng.range(-300.0, 300.0), 1.0),
            rotation: Quat::from_rotation_z(rng.range(-3.0, 3.0)),
            scale: Vec3::new(scale(rng), scale(rng), 1.0),
        };
        let parent = app.world_mut().spawn((transform(&mut rng), Visibility::default())).id();
        // Bold enough to be seen on so few texels; the crack alone.
        let mut preset = CrackPreset::TOON;
        preset.steps_per_second = 0.0;
        preset.look.crushed = None;
        let entity = app
            .world_mut()
            .spawn((sprite.clone(), anchor, transform(&mut rng), CrackSurface::new(preset), ChildOf(parent)))
            .id();
        app.update();

        // A texel of the frame, through Bevy's eyes: search the local plane for the point that maps to it.
        let size = sprite.custom_size.unwrap_or(match round % 3 {
            0 => Vec2::new(32.0, 24.0),
            1 => Vec2::new(48.0, 40.0),
            _ => Vec2::new(64.0, 48.0),
        });
        let local = (Vec2::new(rng.range(-0.49, 0.49), rng.range(-0.49, 0.49)) - anchor.0) * size;
        let world = app.world().get::<GlobalTransform>(entity).unwrap().transform_point(local.extend(0.0));
        let images = app.world().resource::<Assets<Image>>();
        let layouts = app.world().resource::<Assets<TextureAtlasLayout>>();
        let texel = sprite.compute_pixel_space_point(local, anchor, images, layouts).unwrap();

        hit(&mut app, CrackHit::world(entity, world));
        app.update();
        assert_eq!(counts(&app).applied, 1, "round {round}");
        // One node, drawn nowhere yet: let it grow a little and look where the texels change.
        app.world_mut().get_mut::<CrackSurface>(entity).unwrap().preset.as_mut().unwrap().steps_per_second = 50.0;
        let before = texels(&app, &app.world().get::<Sprite>(entity).unwrap().image.clone());
        for _ in 0..6 {
            app.update();
        }
        let after = texels(&app, &app.world().get::<Sprite>(entity).unwrap().image.clone());
        let nearest = (0..64 * 48)
            .filter(|i| before[i * 4..i * 4 + 4] != after[i * 4..i * 4 + 4])
            .map(|i| texel.distance(Vec2::new((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5)))
            .min_by(f32::total_cmp);
        assert!(nearest.is_some_and(|distance| distance < 2.5), "round {round}: {nearest:?}");
    }
}

/// Cracks stay in the frame of an atlas, and follow to another frame.
#[test]
fn atlas_frames_are_painted_one_by_one() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::new(64, 32)));
    let base = texels(&app, &image);
    let layout = TextureAtlasLayout::from_grid(UVec2::splat(32), 2, 1, None, None);
    let layout = app.world_mut().resource_mut::<Assets<TextureAtlasLayout>>().add(layout);
    let sprite = Sprite::from_atlas_image(image, TextureAtlas { layout, index: 0 });
    let entity = app.world_mut().spawn((sprite, surface())).id();
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
    settle(&mut app, entity);
    let changed = |app: &App, right: bool| {
        let now = texels(app, &app.world().get::<Sprite>(entity).unwrap().image.clone());
        (0..64 * 32).filter(|i| (i % 64 >= 32) == right && now[i * 4..i * 4 + 4] != base[i * 4..i * 4 + 4]).count()
    };
    assert!(changed(&app, false) > 0);
    assert_eq!(changed(&app, true), 0, "the other frame is untouched");
    app.world_mut().get_mut::<Sprite>(entity).unwrap().texture_atlas.as_mut().unwrap().index = 1;
    app.update();
    app.update();
    assert!(changed(&app, true) > 0, "until it is shown");
}

/// E1: surfaces come, are hit, healed, stripped and despawned at random; nothing is left over.
#[test]
fn despawn_storm() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(32)));
    app.update();
    let images = app.world().resource::<Assets<Image>>().len();
    let mut rng = Rng::new(3);
    let mut alive: Vec<Entity> = Vec::new();
    for _ in 0..2000 {
        match rng.next_u32() % 8 {
            0 | 1 => {
                let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface())).id();
                alive.push(entity);
            }
            2 if !alive.is_empty() => {
                let entity = alive.swap_remove(rng.next_u32() as usize % alive.len());
                app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.4)));
                app.world_mut().despawn(entity);
            }
            3 if !alive.is_empty() => {
                let entity = alive[rng.next_u32() as usize % alive.len()];
                app.world_mut().commands().entity(entity).heal_cracks();
            }
            4 if !alive.is_empty() => {
                let entity = alive[rng.next_u32() as usize % alive.len()];
                app.world_mut().entity_mut(entity).remove::<CrackSurface>();
                assert_eq!(app.world().get::<Sprite>(entity).unwrap().image, image, "its own picture is back");
                app.world_mut().entity_mut(entity).insert(surface());
            }
            _ if !alive.is_empty() => {
                let entity = alive[rng.next_u32() as usize % alive.len()];
                app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())));
            }
            _ => {}
        }
        if rng.unit() < 0.3 {
            app.update();
            counts(&app);
        }
    }
    for entity in alive {
        app.world_mut().despawn(entity);
    }
    for _ in 0..5 {
        app.update();
    }
    assert_eq!(app.world().resource::<Assets<Image>>().len(), images, "no texture is left");
    assert_eq!(counts(&app).queued, 0);
}

/// E2: a clone of a cracked sprite owns its textures.
#[test]
fn clones_crack_on_their_own() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface())).id();
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
    settle(&mut app, entity);
    let clone = app.world_mut().entity_mut(entity).clone_and_spawn();
    app.update();
    assert_eq!(app.world().get::<Sprite>(clone).unwrap().image, image, "a clone begins whole");
    assert_ne!(app.world().get::<Sprite>(entity).unwrap().image, image, "its original stays cracked");
    assert_eq!(state(&app, clone).status, CrackStatus::Untouched);
    hit(&mut app, CrackHit::uv(clone, Vec2::splat(0.2)));
    settle(&mut app, clone);
    let [a, b] = [entity, clone].map(|e| app.world().get::<Sprite>(e).unwrap().image.clone());
    assert_ne!(a, b);
}

/// T1, T5, T6: pictures that cannot be cracked fail their surface, once, and no image is made.
#[test]
fn unreadable_pictures_fail() {
    let mut app = app();
    listen(&mut app);
    let mut short = picture_of(UVec2::splat(8), TextureFormat::Rgba8UnormSrgb);
    short.data.as_mut().unwrap().pop();
    let mut gpu_only = picture_of(UVec2::splat(8), TextureFormat::Rgba8UnormSrgb);
    gpu_only.data = None;
    let mut compressed = picture_of(UVec2::splat(8), TextureFormat::Rgba8UnormSrgb);
    compressed.texture_descriptor.format = TextureFormat::Bc7RgbaUnormSrgb;
    let empty = picture_of(UVec2::new(0, 4), TextureFormat::Rgba8UnormSrgb);
    for image in [short, gpu_only, compressed, empty] {
        let handle = app.world_mut().resource_mut::<Assets<Image>>().add(image);
        let entity = app.world_mut().spawn((Sprite::from_image(handle), surface())).id();
        let images = app.world().resource::<Assets<Image>>().len();
        for _ in 0..3 {
            hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
            app.update();
        }
        assert!(matches!(state(&app, entity).status, CrackStatus::Failed(_)));
        assert_eq!(app.world().resource::<Assets<Image>>().len(), images);
    }
    assert_eq!(app.world().resource::<Seen>().failed.len(), 4, "{:?}", app.world().resource::<Seen>().failed);
    assert_eq!(counts(&app).rejected, 12);
}

/// T5: every uncompressed format that has colours can be cracked, or fails cleanly.
#[test]
fn formats() {
    use TextureFormat::{
        Bgra8Unorm, Bgra8UnormSrgb, R8Unorm, R32Float, Rg8Unorm, Rgba8Snorm, Rgba8Uint, Rgba8Unorm, Rgba8UnormSrgb,
        Rgba16Float, Rgba16Unorm, Rgba32Float,
    };
    let mut app = app();
    let formats = [
        Bgra8Unorm,
        Bgra8UnormSrgb,
        R8Unorm,
        R32Float,
        Rg8Unorm,
        Rgba8Snorm,
        Rgba8Uint,
        Rgba8Unorm,
        Rgba8UnormSrgb,
        Rgba16Float,
        Rgba16Unorm,
        Rgba32Float,
    ];
    for format in formats {
        let handle = app.world_mut().resource_mut::<Assets<Image>>().add(picture_of(UVec2::new(17, 9), format));
        let entity =
            app.world_mut().spawn((Sprite::from_image(handle), CrackSurface { alpha_mask: false, ..surface() })).id();
        hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
        app.update();
        println!("{format:?}: {:?}", state(&app, entity).status);
    }
    counts(&app);
}

/// T7: hits wait until the picture is there.
#[test]
fn hits_wait_for_the_picture() {
    let mut app = app();
    let handle = app.world().resource::<Assets<Image>>().reserve_handle();
    let entity = app.world_mut().spawn((Sprite::from_image(handle.clone()), surface())).id();
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
    for _ in 0..3 {
        app.update();
    }
    assert_eq!(state(&app, entity).status, CrackStatus::Waiting);
    assert_eq!(counts(&app).queued, 1);
    let image = picture_of(UVec2::splat(32), TextureFormat::Rgba8UnormSrgb);
    app.world_mut().resource_mut::<Assets<Image>>().insert(&handle, image).unwrap();
    settle(&mut app, entity);
    assert_eq!(counts(&app).applied, 1);
}

/// T8: a picture that cannot be loaded fails its surface with the reason.
#[test]
fn pictures_that_do_not_load() {
    let mut app = app();
    let handle = app.world().resource::<AssetServer>().load::<Image>("no/such/file.png");
    let entity = app.world_mut().spawn((Sprite::from_image(handle), surface())).id();
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
    let start = std::time::Instant::now();
    while !matches!(state(&app, entity).status, CrackStatus::Failed(_)) {
        app.update();
        assert!(start.elapsed() < Duration::from_secs(20), "{:?}", state(&app, entity).status);
    }
    assert_eq!(counts(&app).rejected, 1);
}

/// T9, T10, T11: the picture changes under the cracks.
#[test]
fn pictures_change() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface())).id();
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
    settle(&mut app, entity);
    let nodes = state(&app, entity).nodes;
    let own = app.world().get::<Sprite>(entity).unwrap().image.clone();
    let share = |app: &App, base: u8| {
        let now = texels(app, &own);
        now.chunks(4).filter(|texel| texel[0] != base).count() as f32 / (now.len() / 4) as f32
    };
    for (value, side) in [(200u8, 64), (180, 128), (90, 40)] {
        let mut even = picture_of(UVec2::splat(side), TextureFormat::Rgba8UnormSrgb);
        even.data.as_mut().unwrap().chunks_mut(4).for_each(|texel| texel.copy_from_slice(&[value, value, value, 255]));
        app.world_mut().resource_mut::<Assets<Image>>().insert(&image, even).unwrap();
        for _ in 0..4 {
            app.update();
        }
        assert_eq!(texels(&app, &own).len() as u32, side * side * 4, "the size follows");
        let share = share(&app, value);
        assert!(share > 0.01 && share < 0.6, "cracks over the new picture: {share}");
        assert_eq!(state(&app, entity).nodes, nodes);
    }
    // Another picture altogether.
    let other = add(&mut app, picture(UVec2::splat(32)));
    app.world_mut().get_mut::<Sprite>(entity).unwrap().image = other.clone();
    app.update();
    app.update();
    assert_eq!(app.world().get::<Sprite>(entity).unwrap().image, own);
    assert_eq!(texels(&app, &own).len(), 32 * 32 * 4);
    app.world_mut().commands().entity(entity).heal_cracks();
    app.update();
    assert_eq!(app.world().get::<Sprite>(entity).unwrap().image, other, "healing gives the new picture");
}

/// E8: settings edited while cracks grow; invalid ones are refused.
#[test]
fn settings_change() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let entity = app.world_mut().spawn((Sprite::from_image(image), surface())).id();
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
    let mut rng = Rng::new(5);
    for i in 0..100 {
        app.update();
        let mut surface = app.world_mut().get_mut::<CrackSurface>(entity).unwrap();
        let preset = surface.preset.as_mut().unwrap();
        let growth = &mut preset.growth;
        match i % 4 {
            0 => growth.step_length = rng.range(-0.01, 0.1),
            1 => growth.crack_radius = if i % 8 == 1 { f32::NAN } else { rng.range(0.05, 0.5) },
            2 => preset.look.glint = rng.range(-1.0, 3.0),
            _ => preset.steps_per_second = [f32::NAN, -5.0, 1e9, 60.0][i / 4 % 4],
        }
    }
    counts(&app);
    app.world_mut().get_mut::<CrackSurface>(entity).unwrap().preset = CrackPreset::GLASS.into();
    settle(&mut app, entity);
}

/// `Mesh2d` and 3D meshes: private material, tangents, uv from the closest triangle; healing gives all of it back.
#[test]
fn meshes_crack_and_heal() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(Mesh::from(Rectangle::new(2.0, 2.0)));
    let flat = app.world_mut().resource_mut::<Assets<ColorMaterial>>().add(ColorMaterial::from(image.clone()));
    let solid = StandardMaterial { base_color_texture: Some(image), ..default() };
    let solid = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(solid);
    let shown_2d = (Mesh2d(mesh.clone()), MeshMaterial2d(flat.clone()));
    let shown_3d = (Mesh3d(mesh.clone()), MeshMaterial3d(solid.clone()));
    let turned = Transform::from_xyz(5.0, 0.0, 0.0).with_rotation(Quat::from_rotation_y(1.0));
    let a = app.world_mut().spawn((shown_2d, surface())).id();
    let b = app.world_mut().spawn((shown_3d, turned, surface())).id();
    hit(&mut app, CrackHit::world(a, Vec3::new(0.2, 0.2, 0.0)));
    hit(&mut app, CrackHit::world(b, turned.transform_point(Vec3::new(-0.3, 0.1, 0.01))));
    settle(&mut app, b);
    settle(&mut app, a);
    assert_eq!(counts(&app).applied, 2);
    let material = &app.world().get::<MeshMaterial3d<StandardMaterial>>(b).unwrap().0;
    assert_ne!(*material, solid);
    let material = app.world().resource::<Assets<StandardMaterial>>().get(material).unwrap();
    let textures = app.world().get::<CrackTextures>(b).unwrap();
    assert_eq!(material.normal_map_texture, textures.normal);
    assert_eq!(material.depth_map, textures.depth);
    assert!(material.depth_map.is_some() && material.parallax_depth_scale > 0.0);
    let own = &app.world().get::<Mesh3d>(b).unwrap().0;
    assert!(app.world().resource::<Assets<Mesh>>().get(own).unwrap().contains_attribute(Mesh::ATTRIBUTE_TANGENT));
    for entity in [a, b] {
        app.world_mut().commands().entity(entity).heal_cracks();
    }
    app.update();
    assert_eq!(app.world().get::<MeshMaterial2d<ColorMaterial>>(a).unwrap().0, flat);
    assert_eq!(app.world().get::<MeshMaterial3d<StandardMaterial>>(b).unwrap().0, solid);
    assert_eq!(app.world().get::<Mesh3d>(b).unwrap().0, mesh);
}

/// T3: sizes beyond all limits are made smaller, before anything is allocated; a sprite keeps its size on screen.
#[test]
fn sizes_are_clamped() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().max_texture_bytes = 16 << 20;
    let image = add(&mut app, picture(UVec2::new(40, 20)));
    let resolution = CrackResolution::Fixed(UVec2::new(4_000_000_000, 2_000_000_000));
    let sprite = Sprite::from_image(image);
    let entity = app.world_mut().spawn((sprite, CrackSurface { resolution, ..surface() })).id();
    hit(&mut app, CrackHit::world(entity, Vec3::ZERO));
    app.update();
    let sprite = app.world().get::<Sprite>(entity).unwrap().clone();
    assert_eq!(sprite.custom_size, Some(Vec2::new(40.0, 20.0)));
    let size = app.world().resource::<Assets<Image>>().get(&sprite.image).unwrap().size();
    assert_eq!(size.x, size.y * 2, "{size}");
    assert!(size.x >= 512 && size.x <= 1024, "{size}");
    app.world_mut().commands().entity(entity).heal_cracks();
    app.update();
    assert_eq!(app.world().get::<Sprite>(entity).unwrap().custom_size, None);
}

/// I3: holes of the picture refuse hits, and no crack goes there.
#[test]
fn holes_stay_holes() {
    let mut app = app();
    let mut image = picture_of(UVec2::splat(64), TextureFormat::Rgba8UnormSrgb);
    // The right half is transparent.
    for (i, texel) in image.data.as_mut().unwrap().chunks_mut(4).enumerate() {
        texel[3] = if i % 64 < 32 { 255 } else { 0 };
    }
    let base = image.data.clone().unwrap();
    let handle = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    let entity = app.world_mut().spawn((Sprite::from_image(handle), surface())).id();
    hit(&mut app, CrackHit::uv(entity, Vec2::new(0.8, 0.5)));
    hit(&mut app, CrackHit::uv(entity, Vec2::new(0.2, 0.5)));
    settle(&mut app, entity);
    let stats = counts(&app);
    assert_eq!((stats.rejected, stats.applied), (1, 1));
    let now = texels(&app, &app.world().get::<Sprite>(entity).unwrap().image.clone());
    for i in (0..64 * 64).filter(|i| i % 64 >= 32) {
        assert_eq!(now[i * 4 + 3], base[i * 4 + 3], "alpha stays");
    }
}

/// E4: the plugin in apps that lack this and that; E3: before and after the others.
#[test]
fn any_subset_of_plugins() {
    for mask in 0..32u32 {
        let mut app = App::new();
        let has = |bit: u32| mask >> bit & 1 == 1;
        if has(4) {
            app.add_plugins(CrackPlugins);
        }
        if has(0) {
            app.add_plugins(MinimalPlugins);
        }
        if has(1) {
            app.add_plugins(TransformPlugin);
        }
        if has(2) {
            if !has(0) {
                app.add_plugins(TaskPoolPlugin::default());
            }
            app.add_plugins(AssetPlugin::default());
        }
        if has(3) && has(2) {
            app.add_plugins(ImagePlugin::default());
        }
        if !has(4) {
            app.add_plugins(CrackPlugins);
        }
        app.finish();
        app.cleanup();
        let image = if has(3) && has(2) { add(&mut app, picture(UVec2::splat(32))) } else { Handle::default() };
        let entity = app.world_mut().spawn((Sprite::from_image(image), surface())).id();
        for _ in 0..5 {
            hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
            app.update();
        }
        let stats = counts(&app);
        assert_eq!(stats.sent, 5);
        let works = has(2) && has(3);
        assert_eq!(stats.applied > 0, works, "plugins {mask:05b}: {stats:?} {:?}", state(&app, entity));
    }
}

/// E7: no step while time stands still, a bounded number after a long pause.
#[test]
fn time_stands_still_and_jumps() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let entity = app.world_mut().spawn((Sprite::from_image(image), surface())).id();
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
    app.update();
    let nodes = state(&app, entity).nodes;
    for _ in 0..10 {
        app.update();
    }
    assert_eq!(state(&app, entity).nodes, nodes, "paused");
    let mut time = app.world_mut().resource_mut::<Time<Virtual>>();
    time.set_max_delta(Duration::MAX);
    time.unpause();
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(3600)));
    app.update();
    settle(&mut app, entity);
}
