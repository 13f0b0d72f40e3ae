//! Surfaces that are made beside the frames: large ones, and those whose hits a frame has no time for. They crack as they would have
//! in the frame of the hit, only later.

use crate::support::*;
use bevy::{prelude::*, render::render_resource::TextureFormat, tasks::AsyncComputeTaskPool};
use bevy_crack::prelude::*;
use std::sync::{Arc, Mutex, PoisonError, mpsc};

/// Too large for the frame of the hit.
const LARGE: UVec2 = UVec2::new(700, 500);

/// An app whose frames have no time to lose.
fn hasty() -> App {
    let mut app = app();
    app.insert_resource(CrackBudget::default());
    app
}

fn surface() -> CrackSurface {
    CrackSurface::new(small_preset()).with_seed(5)
}

fn count_images(app: &App) -> usize {
    app.world().resource::<Assets<Image>>().len()
}

fn textures(app: &App, entity: Entity) -> Vec<Vec<u8>> {
    get::<CrackTextures>(app, entity).handles().map(|texture| texels(app, texture)).collect()
}

/// Hits a surface that is too large for a frame: nothing of it is there at once, and its hit waits.
fn hit_large(app: &mut App, entity: Entity) {
    hit(app, center(entity).with_energy(0.5));
    step(app);
    assert_eq!(state(app, entity).status, CrackStatus::Waiting);
    assert!(app.world().get::<CrackTextures>(entity).is_none(), "nothing is shown yet");
    assert_eq!(counts(app).queued, 1);
}

/// A picture with a hole, and lines that a mask can follow.
fn tiles() -> Image {
    let mut image = picture(LARGE);
    for (i, texel) in image.data.iter_mut().flat_map(|data| data.as_chunks_mut::<4>().0).enumerate() {
        let (x, y) = (i % LARGE.x as usize, i / LARGE.x as usize);
        if x % 100 < 6 || y % 100 < 6 {
            *texel = [40, 40, 40, 255];
        }
        if (500..620).contains(&x) && y > 300 {
            texel[3] = 0;
        }
    }
    image
}

/// White at the left, where no crack may go.
fn half() -> Image {
    let mut image = solid(UVec2::new(30, 20), [0, 0, 0, 255]);
    for (i, texel) in image.data.iter_mut().flat_map(|data| data.as_chunks_mut::<4>().0).enumerate() {
        *texel = if i % 30 < 10 { [255; 4] } else { *texel };
    }
    image
}

type Spawn = fn(&mut App) -> Entity;

const CASES: &[(&str, Spawn)] = &[
    ("a sprite", |app| {
        let image = add(app, tiles());
        app.world_mut().spawn((Sprite::from_image(image), surface())).id()
    }),
    ("a mask from the picture", |app| {
        let image = add(app, tiles());
        let surface = surface().with_mask(CrackMaskSource::FromPicture);
        app.world_mut().spawn((Sprite::from_image(image), surface)).id()
    }),
    ("brick", |app| {
        let image = add(app, tiles());
        let brick = CrackPreset { follows_lines: true, ..CrackPreset::CONCRETE };
        app.world_mut().spawn((Sprite::from_image(image), CrackSurface { preset: brick.into(), ..surface() })).id()
    }),
    ("masks of their own", |app| {
        let mut lines = tiles();
        // Red lines on black.
        for texel in lines.data.iter_mut().flat_map(|data| data.as_chunks_mut::<4>().0) {
            *texel = [if texel[0] == 40 { 255 } else { 0 }, 0, 0, 255];
        }
        let [image, weak, forbidden] = [tiles(), lines, half()].map(|image| add(app, image));
        let mask = CrackMaskSource::Images { weak: Some(weak), strong: None, forbidden: Some(forbidden) };
        app.world_mut().spawn((Sprite::from_image(image), surface().with_mask(mask))).id()
    }),
    ("a picture of another kind and size", |app| {
        let image = add(app, picture_of(UVec2::new(90, 70), TextureFormat::Rgba16Float));
        let surface = CrackSurface { resolution: CrackResolution::Fixed(LARGE), alpha_mask: false, ..surface() };
        app.world_mut().spawn((Sprite::from_image(image), surface)).id()
    }),
    ("no picture", |app| {
        let surface = CrackSurface { resolution: CrackResolution::Fixed(LARGE), ..surface() };
        app.world_mut().spawn((Sprite::from_color(Color::WHITE, Vec2::new(70.0, 50.0)), surface)).id()
    }),
    ("a frame of a sheet", |app| {
        let image = add(app, tiles());
        let rect = Some(Rect::new(100.0, 50.0, 400.0, 350.0));
        app.world_mut().spawn((Sprite { image, rect, ..default() }, surface())).id()
    }),
    ("a wall", |app| {
        let mut normal = solid(LARGE, [100, 128, 250, 255]);
        normal.texture_descriptor.format = TextureFormat::Rgba8Unorm;
        let [color, normal, depth] = [tiles(), normal, tiles()].map(|image| add(app, image));
        let material = add(
            app,
            StandardMaterial {
                base_color_texture: Some(color),
                normal_map_texture: Some(normal),
                depth_map: Some(depth),
                ..default()
            },
        );
        let mesh = add(app, Mesh::from(Rectangle::new(1.4, 1.0)));
        app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), surface())).id()
    }),
];

#[test]
fn b4_cracks_are_those_of_a_surface_made_in_the_frame_of_the_hit() {
    for (name, spawn) in CASES {
        let cracked = [app(), hasty()].map(|mut app| {
            let entity = spawn(&mut app);
            let has_time = app.world().resource::<CrackBudget>().milliseconds > 1000.0;
            if has_time {
                hit(&mut app, center(entity).with_energy(0.5));
            } else {
                hit_large(&mut app, entity);
            }
            settle(&mut app, entity);
            assert_eq!(counts(&app).applied, 1, "{name}");
            (textures(&app, entity), state(&app, entity).nodes)
        });
        let [now, later] = cracked;
        assert!(now == later && now.1 > 5, "{name}: {} and {} nodes", now.1, later.1);
    }
}

fn spawn_plain(app: &mut App) -> Entity {
    let image = add(app, picture(LARGE));
    app.world_mut().spawn((Sprite::from_image(image), surface())).id()
}

/// What a game does while a surface is on its way.
type Change = fn(&mut App, Entity, &Handle<Image>);

#[test]
fn t11_what_changes_meanwhile_is_what_cracks() {
    let changes: &[(&str, Change)] = &[
        ("another picture in the sprite", |app, entity, _| {
            let image = add(app, solid(LARGE + 10, [90, 120, 200, 255]));
            app.world_mut().get_mut::<Sprite>(entity).unwrap().image = image;
        }),
        ("another picture in the handle", |app, _, image| {
            let other = solid(LARGE, [90, 120, 200, 255]);
            assert!(app.world_mut().resource_mut::<Assets<Image>>().insert(image, other).is_ok());
        }),
        ("a picture of another size in the handle", |app, _, image| {
            let other = solid(LARGE - 20, [90, 120, 200, 255]);
            assert!(app.world_mut().resource_mut::<Assets<Image>>().insert(image, other).is_ok());
        }),
        ("another seed", |app, entity, _| {
            app.world_mut().get_mut::<CrackSurface>(entity).unwrap().seed = 77;
        }),
        ("a small picture", |app, entity, _| {
            let image = add(app, picture(UVec2::splat(40)));
            app.world_mut().get_mut::<Sprite>(entity).unwrap().image = image;
        }),
    ];
    // At every stage: so many frames later, each of them long enough for a task to get on.
    for (name, change) in changes {
        let expected = {
            let mut app = app();
            let entity = spawn_plain(&mut app);
            let image = image_of(&app, entity);
            change(&mut app, entity, &image);
            step(&mut app);
            hit(&mut app, center(entity).with_energy(0.5));
            settle(&mut app, entity);
            textures(&app, entity)
        };
        for frames in 0..5 {
            let mut app = hasty();
            let entity = spawn_plain(&mut app);
            let image = image_of(&app, entity);
            hit_large(&mut app, entity);
            for _ in 0..frames {
                std::thread::sleep(FRAME);
                step(&mut app);
            }
            change(&mut app, entity, &image);
            settle(&mut app, entity);
            // Its last change is applied some frames later: a large picture is read by a task.
            let is_same = (0..300).any(|_| {
                std::thread::sleep(FRAME / 8);
                step(&mut app);
                textures(&app, entity) == expected
            });
            // A seed that changes when it has begun to crack has to wait for healing.
            assert!(is_same || (*name == "another seed" && frames > 1), "{name}, {frames} frames");
        }
    }
}

/// A mask that changes while it is read is the old one or the new one, and no mixture.
#[test]
fn t9_masks_that_change_meanwhile_are_not_torn() {
    // Stripes that forbid a half, in two ways. The last part of the reading is the lower half of it.
    let size = UVec2::new(700, 154);
    let stripes = |phase: u32| {
        let mut image = solid(size, [0, 0, 0, 255]);
        for (i, texel) in (0..).zip(image.data.iter_mut().flat_map(|data| data.as_chunks_mut::<4>().0)) {
            let (x, y) = (i % size.x, i / size.x);
            let is_middle = x.abs_diff(size.x / 2) < 12 && y.abs_diff(size.y / 2) < 4;
            *texel = [if (x / 40 + phase).is_multiple_of(2) && !is_middle { 255 } else { 0 }; 4];
        }
        image
    };
    let spawn = |app: &mut App| {
        let [image, forbidden] = [tiles(), stripes(0)].map(|image| add(app, image));
        let mask = CrackMaskSource::Images { weak: None, strong: None, forbidden: Some(forbidden.clone()) };
        (app.world_mut().spawn((Sprite::from_image(image), surface().with_mask(mask))).id(), forbidden)
    };
    let change = |app: &mut App, mask: &Handle<Image>| {
        assert!(app.world_mut().resource_mut::<Assets<Image>>().insert(mask, stripes(1)).is_ok());
    };
    let expected = [false, true].map(|is_new| {
        let mut app = app();
        let (entity, mask) = spawn(&mut app);
        if is_new {
            change(&mut app, &mask);
        }
        hit(&mut app, center(entity).with_energy(0.5));
        settle(&mut app, entity);
        textures(&app, entity)
    });
    assert!(expected[0] != expected[1], "the masks make a difference");
    let mut found = [0, 0];
    for frames in 0..10 {
        let mut app = hasty();
        // So that each copies as little as it may.
        app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
        let (entity, mask) = spawn(&mut app);
        hit_large(&mut app, entity);
        for _ in 0..frames {
            std::thread::sleep(FRAME / 4);
            step(&mut app);
        }
        change(&mut app, &mask);
        settle(&mut app, entity);
        let cracked = textures(&app, entity);
        let which = expected.iter().position(|expected| *expected == cracked);
        found[which.unwrap_or_else(|| panic!("after {frames} frames the mask is torn"))] += 1;
    }
    assert!(found[0] > 0 && found[1] > 0, "{found:?}");
}

#[test]
fn e1_healing_and_despawning_leave_nothing_behind() {
    let ends: &[(&str, fn(&mut App, Entity))] = &[
        ("healed", |app, entity| _ = app.world_mut().commands().entity(entity).heal_cracks()),
        ("closed", |app, entity| _ = app.world_mut().commands().entity(entity).close_cracks(1.0)),
        ("despawned", |app, entity| _ = app.world_mut().despawn(entity)),
        ("no surface any more", |app, entity| {
            app.world_mut().entity_mut(entity).remove::<CrackSurface>();
        }),
    ];
    for (name, end) in ends {
        for frames in 1..5 {
            let mut app = hasty();
            let entity = CASES[0].1(&mut app);
            step(&mut app);
            let (images, before) = (count_images(&app), app.world().get::<Sprite>(entity).cloned());
            hit(&mut app, center(entity).with_energy(0.5));
            hit(&mut app, center(entity).with_energy(0.5));
            for _ in 0..frames {
                step(&mut app);
                std::thread::sleep(FRAME);
            }
            let is_waiting = state(&app, entity).status == CrackStatus::Waiting;
            assert!(is_waiting || frames != 1, "{name}");
            end(&mut app, entity);
            for _ in 0..6 {
                std::thread::sleep(FRAME / 4);
                step(&mut app);
            }
            let stats = counts(&app);
            assert_eq!(stats.queued, 0, "{name}: {stats:?}");
            if let (Some(before), Some(sprite)) = (before, app.world().get::<Sprite>(entity))
                && (is_waiting || *name != "closed")
            {
                assert_eq!(sprite.image, before.image, "{name}");
                assert_eq!(state(&app, entity), CrackState::default(), "{name}");
                assert_eq!(count_images(&app), images, "{name}: a texture is left");
            }
        }
    }
}

#[test]
fn b4_a_prepared_surface_cracks_in_the_frame_of_its_first_hit() {
    for (name, spawn) in CASES {
        let mut app = hasty();
        let entity = spawn(&mut app);
        step(&mut app);
        let expected = {
            let mut app = hasty();
            let entity = spawn(&mut app);
            hit(&mut app, center(entity).with_energy(0.5));
            settle(&mut app, entity);
            textures(&app, entity)
        };
        app.world_mut().commands().entity(entity).prepare_cracks();
        app.world_mut().commands().entity(entity).prepare_cracks();
        wait_for(&mut app, name, |app| app.world().get::<CrackTextures>(entity).is_some());
        steps(&mut app, 3);
        assert_eq!(state(&app, entity), CrackState::default(), "{name}: nothing has happened to it");
        assert_eq!(counts(&app).sent, 0);
        hit(&mut app, center(entity).with_energy(0.5));
        step(&mut app);
        assert!(state(&app, entity).nodes > 0, "{name}: {:?}", state(&app, entity));
        settle(&mut app, entity);
        assert!(textures(&app, entity) == expected, "{name}");
        app.world_mut().commands().entity(entity).heal_cracks();
        steps(&mut app, 3);
        assert!(app.world().get::<CrackTextures>(entity).is_none(), "{name}: healing takes it back");
    }
}

#[test]
fn t8_preparing_what_cannot_crack_says_so() {
    let mut app = hasty();
    let failed = Arc::new(Mutex::new(Vec::new()));
    let told = failed.clone();
    app.add_observer(move |failed: On<CrackFailed>| {
        told.lock().unwrap_or_else(PoisonError::into_inner).push(failed.entity);
    });
    let mut broken = picture(LARGE);
    broken.data = None;
    let broken = add(&mut app, broken);
    let [broken, nothing] = [spawn_sprite(&mut app, &broken), app.world_mut().spawn_empty().id()];
    let small = spawn_picture(&mut app, UVec2::splat(30));
    let late = app.world().resource::<Assets<Image>>().reserve_handle();
    let waiting = spawn_sprite(&mut app, &late);
    for entity in [broken, nothing, waiting, small] {
        app.world_mut().commands().entity(entity).prepare_cracks();
    }
    steps(&mut app, 10);
    assert_eq!(*failed.lock().unwrap_or_else(PoisonError::into_inner), [broken]);
    assert!(matches!(state(&app, broken).status, CrackStatus::Failed(_)));
    let is_ready = |app: &App, entity| app.world().get::<CrackTextures>(entity).is_some();
    assert!(is_ready(&app, small) && !is_ready(&app, waiting), "it waits for its picture");
    assert!(app.world_mut().resource_mut::<Assets<Image>>().insert(&late, picture(LARGE)).is_ok());
    wait_for(&mut app, "the picture", |app| is_ready(app, waiting));
}

/// No thread has time: a frame does the work, instead of letting the hit wait for ever.
#[test]
fn e12_a_hit_does_not_wait_for_a_busy_pool() {
    let mut app = hasty();
    let pool = AsyncComputeTaskPool::get();
    let blocked: Vec<_> = (0..pool.thread_num())
        .map(|_| {
            let (free, wait) = mpsc::channel::<()>();
            pool.spawn(async move { wait.recv().is_err() }).detach();
            free
        })
        .collect();
    let entity = CASES[1].1(&mut app);
    hit_large(&mut app, entity);
    wait_for(&mut app, "a thread", |app| state(app, entity).nodes > 0);
    drop(blocked);
    settle(&mut app, entity);
}

/// More first hits than a frame has time for: the others are made beside it, small ones too, and none is lost.
#[test]
fn i7_first_hits_on_many_surfaces_are_all_applied() {
    let mut app = app();
    app.insert_resource(CrackBudget { milliseconds: 0.0, ..default() });
    let shared = add(&mut app, picture(UVec2::splat(160)));
    let tiny = add(&mut app, picture(UVec2::splat(60)));
    let surfaces: Vec<Entity> = (0..60)
        .map(|i| {
            let image = if i % 6 == 0 {
                tiny.clone()
            } else if i % 2 == 0 {
                shared.clone()
            } else {
                add(&mut app, picture(UVec2::new(150, 140)))
            };
            app.world_mut().spawn((Sprite::from_image(image), surface())).id()
        })
        .collect();
    for entity in &surfaces {
        hit(&mut app, center(*entity));
        hit(&mut app, CrackHit::uv(*entity, Vec2::splat(2.0)));
    }
    step(&mut app);
    wait_for(&mut app, "the last hit", |app| counts(app).queued == 0);
    let stats = counts(&app);
    assert_eq!((stats.applied, stats.rejected), (60, 60), "{stats:?}");
    for entity in surfaces {
        settle(&mut app, entity);
    }
}

/// In no frame is there a hole where a surface was, and what the GPU holds in the end is what was painted.
#[test]
fn t13_a_large_surface_never_vanishes_while_it_is_made() {
    let Some((_one, mut app)) = gpu_app() else { return };
    app.insert_resource(CrackBudget::default());
    let target = spawn_camera(&mut app, UVec2::splat(64));
    let image = add(&mut app, solid(UVec2::splat(600), [90, 160, 220, 255]));
    let entity = app.world_mut().spawn((Sprite::from_image(image), surface())).id();
    steps(&mut app, 3);
    let before = drawn(&mut app, &target);
    // Off the middle, which the camera sees.
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.05)).with_energy(0.1));
    let film = film(&mut app, &target, 40, |app, _| {
        std::thread::sleep(FRAME / 4);
        counts(app);
    });
    wait_for(&mut app, "its cracks", |app| state(app, entity).nodes > 0);
    for (i, frame) in film.iter().enumerate() {
        let dark = frame.as_chunks::<4>().0.iter().filter(|texel| texel[2] < 100).count();
        assert!(dark * 2 < 64 * 64, "frame {i}: {dark} dark texels of what was {:?}", &before[..4]);
    }
    settle(&mut app, entity);
    assert_on_gpu(&mut app, &[entity]);
}

/// An observer of the textures may heal the surface in the middle of being made: that hit is refused, others are not.
#[test]
fn e1_an_observer_may_heal_what_has_just_been_made() {
    for size in [UVec2::splat(40), LARGE] {
        let mut app = hasty();
        let [healed, other] = [(); 2].map(|()| spawn_picture(&mut app, size));
        app.world_mut().entity_mut(healed).observe(|made: On<Insert, CrackTextures>, mut commands: Commands| {
            commands.entity(made.entity).heal_cracks();
        });
        let before = image_of(&app, healed);
        for entity in [healed, other] {
            hit(&mut app, center(entity));
        }
        settle(&mut app, other);
        wait_for(&mut app, "both", |app| counts(app).queued == 0);
        assert_eq!((counts(&app).applied, counts(&app).rejected), (1, 1), "{size}");
        assert_eq!(image_of(&app, healed), before);
        assert_eq!(state(&app, healed), CrackState::default());
    }
}

/// A picture that goes and comes back as another one shows as that, however soon after it was read.
#[test]
fn t11_a_picture_that_comes_back_is_another_one() {
    for size in [UVec2::splat(40), LARGE] {
        for frames in 0..3 {
            let mut app = hasty();
            let image = add(&mut app, picture(size));
            let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface())).id();
            hit(&mut app, center(entity).with_energy(0.1));
            step(&mut app);
            steps(&mut app, frames);
            let mut images = app.world_mut().resource_mut::<Assets<Image>>();
            images.remove(&image);
            images.insert(&image, solid(size, [10, 20, 250, 255])).expect("the handle is good");
            settle(&mut app, entity);
            wait_for(&mut app, "the other picture", |app| shown(app, entity)[..4] == [10, 20, 250, 255]);
            // It goes, and comes back in the frame in which another one is hit that shows it.
            app.world_mut().resource_mut::<Assets<Image>>().remove(&image);
            steps(&mut app, 3);
            let mut images = app.world_mut().resource_mut::<Assets<Image>>();
            images.insert(&image, solid(size, [80, 20, 30, 255])).expect("the handle is good");
            let other = app.world_mut().spawn((Sprite::from_image(image.clone()), surface())).id();
            hit(&mut app, center(other).with_energy(0.1));
            settle(&mut app, other);
            for entity in [entity, other] {
                wait_for(&mut app, "the third picture", |app| shown(app, entity)[..4] == [80, 20, 30, 255]);
            }
        }
    }
}

/// What is another one in every frame is made all the same: another frame of an animation, another size, other settings.
#[test]
fn t11_what_changes_in_every_frame_cracks_as_well() {
    let changes: &[(&str, fn(&mut App, Entity, u32))] = &[
        ("a frame of a sheet", |app, entity, frame| {
            let min = Vec2::new((frame % 3) as f32 * 100.0, 40.0);
            let rect = Some(Rect { min, max: min + 200.0 });
            app.world_mut().get_mut::<Sprite>(entity).unwrap().rect = rect;
        }),
        ("its size", |app, entity, frame| {
            app.world_mut().get_mut::<Sprite>(entity).unwrap().custom_size = Some(Vec2::splat(50.0 + frame as f32));
        }),
        ("a slider", |app, entity, frame| {
            app.world_mut().get_mut::<CrackSurface>(entity).unwrap().seed = u64::from(frame);
        }),
        ("a flipbook", |app, entity, frame| {
            let image = add(app, solid(LARGE, [90, 120, (100 + frame % 100) as u8, 255]));
            if app.world().get::<CrackTextures>(entity).is_none() {
                app.world_mut().get_mut::<Sprite>(entity).unwrap().image = image;
            }
        }),
    ];
    for (name, change) in changes {
        let mut app = hasty();
        let entity = spawn_plain(&mut app);
        change(&mut app, entity, 0);
        hit_large(&mut app, entity);
        for frame in 1.. {
            change(&mut app, entity, frame);
            std::thread::sleep(FRAME / 4);
            step(&mut app);
            if state(&app, entity).nodes > 0 {
                break;
            }
            assert!(frame < 1000, "{name}: it never cracks");
        }
        settle(&mut app, entity);
        // A part that is shown now has all cracks.
        let cracked = shown(&app, entity);
        change(&mut app, entity, 1000);
        steps(&mut app, 3);
        assert!(*name != "a frame of a sheet" || shown(&app, entity) != cracked, "{name}");
    }
}

/// What cannot be read is said, whichever picture it is.
#[test]
fn t5_maps_and_masks_without_data_fail_the_surface() {
    for which in 0..3 {
        let mut app = hasty();
        let mut images = [(); 3].map(|()| solid(LARGE, [128, 128, 255, 255]));
        images[which].data = None;
        let [normal, depth, weak] = images.map(|image| add(&mut app, image));
        let color = add(&mut app, picture(LARGE));
        let material = StandardMaterial {
            base_color_texture: Some(color),
            normal_map_texture: Some(normal),
            depth_map: Some(depth),
            ..default()
        };
        let (material, mesh) = (add(&mut app, material), add(&mut app, Mesh::from(Rectangle::new(1.4, 1.0))));
        let mask = CrackMaskSource::Images { weak: Some(weak), strong: None, forbidden: None };
        let surface = surface().with_mask(mask);
        let entity = app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), surface)).id();
        hit(&mut app, center(entity));
        steps(&mut app, 3);
        assert_eq!(state(&app, entity).status, CrackStatus::Failed(CrackError::NoCpuData), "picture {which}");
        assert_eq!(counts(&app).rejected, 1);
    }
}

/// A large surface on its way, hit or only wanted, does not keep a small one from cracking in the frame of its hit.
#[test]
fn b4_small_surfaces_do_not_wait_for_large_ones() {
    let mut app = hasty();
    let wanted: Vec<Entity> = (0..10).map(|_| spawn_plain(&mut app)).collect();
    for entity in &wanted {
        app.world_mut().commands().entity(*entity).prepare_cracks();
    }
    let large = spawn_plain(&mut app);
    let small = spawn_picture(&mut app, UVec2::splat(40));
    hit_large(&mut app, large);
    hit(&mut app, center(small));
    step(&mut app);
    assert!(state(&app, small).nodes > 0, "{:?}", state(&app, small));
    settle(&mut app, large);
    for entity in wanted {
        wait_for(&mut app, "those that are wanted", |app| app.world().get::<CrackTextures>(entity).is_some());
    }
}

/// A large picture that changes under its cracks is read by a background task. What was there is shown until then.
#[test]
fn a_large_picture_that_changes_is_not_read_in_a_frame() {
    let size = UVec2::new(1024, 700);
    let end = |milliseconds: f32| {
        let mut app = hasty();
        let image = add(&mut app, picture(size));
        let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface())).id();
        hit(&mut app, center(entity).with_energy(0.5));
        wait_for(&mut app, "the cracks", |app| state(app, entity).status == CrackStatus::Done);
        app.world_mut().resource_mut::<CrackBudget>().milliseconds = milliseconds;
        steps(&mut app, 2);
        let before = shown(&app, entity);
        *app.world_mut().resource_mut::<Assets<Image>>().get_mut(&image).expect("it is there") =
            solid(size, [90, 140, 40, 255]);
        let mut frames = 0;
        while shown(&app, entity) == before {
            step(&mut app);
            frames += 1;
            assert!(frames < 100_000, "it never comes");
        }
        wait_for(&mut app, "the end", |app| state(app, entity).status == CrackStatus::Done);
        steps(&mut app, 5);
        (frames, shown(&app, entity))
    };
    let (at_once, same) = end(1e6);
    let (later, read) = end(2.0);
    // It is copied half a MiB a frame, and read in the ones after that.
    assert!(at_once <= 2 && later > 5, "{at_once} and {later} frames");
    assert!(read == same && read.as_chunks::<4>().0.iter().filter(|texel| texel[1] == 140).count() > 100_000);
}

/// Where the image of densities is black there are no markers, in the frame of the hit and by a task.
#[test]
fn an_image_says_how_densely_cracks_grow() {
    for size in [UVec2::new(200, 200), UVec2::new(700, 700)] {
        let nodes = |density: Option<Image>| {
            let mut app = hasty();
            let mut surface = CrackSurface::new(CrackPreset::MUD).with_seed(2);
            surface.density = density.map(|image| add(&mut app, image));
            let image = add(&mut app, solid(size, [180, 170, 160, 255]));
            let entity = app.world_mut().spawn((Sprite::from_image(image), surface)).id();
            hit(&mut app, center(entity).with_energy(2.0));
            wait_for(&mut app, "the cracks", |app| state(app, entity).status == CrackStatus::Done);
            let (shown, mut halves) = (shown(&app, entity), [0, 0]);
            for (i, texel) in shown.as_chunks::<4>().0.iter().enumerate() {
                let half = usize::from(i as u32 % size.x > size.x * 6 / 10);
                halves[half] += u32::from(texel[0] < 120);
            }
            halves
        };
        let mut half = solid(UVec2::new(2, 1), [255; 4]);
        half.data.iter_mut().flatten().skip(4).take(3).for_each(|byte| *byte = 0);
        let [left, right] = nodes(None);
        assert!(left > 200 && right > 200, "{size}: {left} {right}");
        let [left, right] = nodes(Some(half));
        assert!(left > 200 && right < left / 10, "{size}: {left} {right}");
    }
}
