//! Surfaces, apps and clocks that come, go and stand still: the faults E1 to E7 of the reliability list, through real apps.

use crate::support::*;
use bevy::{
    app::TaskPoolPlugin,
    asset::AssetMetaCheck,
    ecs::entity_disabling::Disabled,
    prelude::*,
    render::settings::WgpuSettings,
    time::{TimePlugin, TimeUpdateStrategy},
};
use bevy_crack::{math::Rng, plugin::CrackUploadStats, prelude::*};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    time::{Duration, Instant},
};

#[test]
fn e1_a_storm_of_despawns_leaves_nothing_behind() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.2;
    let image = add(&mut app, picture(UVec2::splat(24)));
    let bystander = spawn_sprite(&mut app, &image);
    hit(&mut app, center(bystander));
    settle(&mut app, bystander);
    let cracked = shown(&app, bystander);
    step(&mut app);
    let (n_entities, n_images) =
        (app.world().entities().count_spawned(), app.world().resource::<Assets<Image>>().len());
    let mut rng = Rng::new(1);
    let mut alive = Vec::new();
    for _ in 0..10_000 {
        match rng.next_u32() % 8 {
            0 | 1 => {
                let surface = CrackSurface::new(small_preset());
                alive.push(app.world_mut().spawn((Sprite::from_image(image.clone()), surface)).id());
            }
            2..=4 if !alive.is_empty() => {
                let entity = alive[rng.next_u32() as usize % alive.len()];
                let at = Vec2::new(rng.unit(), rng.unit());
                hit(&mut app, CrackHit::uv(entity, at).with_energy(0.5));
            }
            5 if !alive.is_empty() => {
                // In the same frame as a hit.
                let entity = alive.swap_remove(rng.next_u32() as usize % alive.len());
                app.world_mut().write_message(center(entity));
                app.world_mut().despawn(entity);
            }
            6 if !alive.is_empty() => {
                let entity = alive[rng.next_u32() as usize % alive.len()];
                app.world_mut().commands().entity(entity).heal_cracks();
            }
            7 if !alive.is_empty() => {
                let entity = alive[rng.next_u32() as usize % alive.len()];
                app.world_mut().entity_mut(entity).remove::<CrackSurface>();
                app.world_mut().entity_mut(entity).insert(CrackSurface::new(small_preset()));
            }
            _ => _ = step(&mut app),
        }
    }
    for entity in alive {
        app.world_mut().despawn(entity);
    }
    steps(&mut app, 3);
    assert_eq!(counts(&app).queued, 0);
    assert_eq!(app.world().entities().count_spawned(), n_entities);
    assert_eq!(app.world().resource::<Assets<Image>>().len(), n_images);
    assert!(shown(&app, bystander) == cracked, "the bystander is untouched");
    // Nothing is left of the budget for memory either: as much fits as before.
    *app.world_mut().resource_mut::<CrackBudget>() =
        CrackBudget { milliseconds: 1e6, max_texture_bytes: 2 * 24 * 24 * 22, ..default() };
    let entity = spawn_sprite(&mut app, &image);
    assert_cracks(&mut app, entity);
}

/// The frames that a surface, hit in the middle, needs to be done.
fn frames_to_end(app: &mut App, entity: Entity) -> usize {
    hit(app, center(entity));
    let mut n = 0;
    while state(app, entity).status != CrackStatus::Done {
        step(app);
        n += 1;
        assert!(n < 2000, "it never ends");
    }
    n
}

#[test]
fn e2_removed_and_inserted_again() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(48)));
    let entity = spawn_sprite(&mut app, &image);
    let n_frames = frames_to_end(&mut app, entity);
    let cracked = shown(&app, entity);
    // While it grows; before the next frame, and after some.
    for pause in [0, 5] {
        app.world_mut().commands().entity(entity).heal_cracks();
        app.world_mut().flush();
        hit(&mut app, center(entity));
        steps(&mut app, 3);
        assert_eq!(state(&app, entity).status, CrackStatus::Growing);
        app.world_mut().entity_mut(entity).remove::<CrackSurface>();
        assert_eq!(image_of(&app, entity), image, "the picture is back at once");
        assert!(app.world().get::<CrackTextures>(entity).is_none());
        steps(&mut app, pause);
        app.world_mut().entity_mut(entity).insert((CrackSurface::default(), CrackState::default()));
        assert_eq!(frames_to_end(&mut app, entity), n_frames, "it starts anew, as fast as before");
        assert!(shown(&app, entity) == cracked, "and cracks the same way");
    }
    // Healed and hit between two frames.
    app.world_mut().commands().entity(entity).heal_cracks();
    app.world_mut().flush();
    hit(&mut app, center(entity));
    steps(&mut app, 3);
    app.world_mut().commands().entity(entity).heal_cracks();
    app.world_mut().flush();
    assert_eq!(frames_to_end(&mut app, entity), n_frames, "healing does not make it faster");
    assert!(shown(&app, entity) == cracked);
    // Replaced in place: nothing is lost.
    app.world_mut().entity_mut(entity).insert(CrackSurface::default());
    steps(&mut app, 3);
    assert!(shown(&app, entity) == cracked);
}

#[test]
fn e2_cloned_reparented_disabled() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(48)));
    let entity = spawn_sprite(&mut app, &image);
    hit(&mut app, center(entity));
    steps(&mut app, 3);
    // A clone of a growing surface is whole, and its own.
    let clone = app.world_mut().entity_mut(entity).clone_and_spawn();
    steps(&mut app, 2);
    assert_eq!((image_of(&app, clone), state(&app, clone)), (image.clone(), CrackState::default()));
    hit(&mut app, CrackHit::uv(clone, Vec2::splat(0.2)));
    settle(&mut app, clone);
    settle(&mut app, entity);
    assert_ne!(image_of(&app, clone), image_of(&app, entity));
    let (first, second) = (shown(&app, entity), shown(&app, clone));
    assert!(first != second);
    // The original goes: the clone keeps its cracks.
    app.world_mut().despawn(entity);
    steps(&mut app, 2);
    assert!(shown(&app, clone) == second);
    // A clone whose original goes in the same breath.
    let twin = app.world_mut().entity_mut(clone).clone_and_spawn();
    app.world_mut().despawn(clone);
    steps(&mut app, 2);
    assert_eq!(image_of(&app, twin), image);

    // Another parent moves it, while it grows.
    let parent = app.world_mut().spawn((Transform::from_xyz(1000.0, 0.0, 0.0), Visibility::default())).id();
    hit(&mut app, center(twin));
    step(&mut app);
    app.world_mut().entity_mut(twin).insert(ChildOf(parent));
    hit(&mut app, CrackHit::world(twin, Vec3::new(1015.0, 0.0, 0.0)));
    settle(&mut app, twin);
    assert_eq!(counts(&app).rejected, 0);
    // Disabled: no hit lands and nothing panics; enabled again it goes on.
    hit(&mut app, CrackHit::uv(twin, Vec2::splat(0.9)));
    step(&mut app);
    app.world_mut().entity_mut(twin).insert(Disabled);
    hit(&mut app, CrackHit::uv(twin, Vec2::splat(0.1)));
    steps(&mut app, 50);
    assert_eq!(counts(&app).rejected, 1, "nobody is there to be hit");
    app.world_mut().entity_mut(twin).remove::<Disabled>();
    assert_cracks(&mut app, twin);
    // A parent takes its children along.
    app.world_mut().despawn(parent);
    steps(&mut app, 2);
    assert_eq!(app.world().resource::<Assets<Image>>().iter().filter(|(_, i)| i.size() == UVec2::splat(48)).count(), 1);
}

/// The plugins of [`app`], in the order of `places`.
fn add_in_order(app: &mut App, places: [usize; 4]) {
    for place in places {
        match place {
            0 => app.add_plugins(MinimalPlugins),
            1 => app.add_plugins(TransformPlugin),
            // `ImagePlugin` itself asks for `AssetPlugin` to be there.
            2 => app.add_plugins((AssetPlugin::default(), ImagePlugin::default())),
            _ => app.add_plugins(CrackPlugins),
        };
    }
}

#[test]
fn e3_any_order_of_plugins() {
    let mut reference = None;
    let mut n_orders = 0;
    for code in 0..256 {
        let places = [code / 64, code / 16 % 4, code / 4 % 4, code % 4];
        let is_permutation = (0..4).all(|place| places.contains(&place));
        // `AssetPlugin` itself asks for the task pools to be there.
        let position = |plugin| places.iter().position(|place| *place == plugin);
        if !is_permutation || position(0) > position(2) {
            continue;
        }
        n_orders += 1;
        let mut app = App::new();
        add_in_order(&mut app, places);
        start(&mut app);
        let entity = spawn_picture(&mut app, UVec2::splat(32));
        hit(&mut app, CrackHit::world(entity, Vec3::ZERO));
        settle(&mut app, entity);
        let now = shown(&app, entity);
        assert!(*reference.get_or_insert_with(|| now.clone()) == now, "{places:?}");
    }
    assert_eq!(n_orders, 12);
}

#[test]
fn e3_the_renderer_may_come_before_or_after() {
    // `gpu_app` adds the renderer first.
    let Some((_one, mut app)) = gpu_app() else { return };
    let entity = spawn_picture(&mut app, UVec2::splat(32));
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    assert_on_gpu(&mut app, &[entity]);
    let first = shown(&app, entity);
    drop(app);

    let mut app = App::new();
    app.add_plugins((CrackPlugins, render_plugins(default())));
    start(&mut app);
    let entity = spawn_picture(&mut app, UVec2::splat(32));
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    assert_on_gpu(&mut app, &[entity]);
    assert!(shown(&app, entity) == first);
}

#[test]
fn e3_added_twice_gives_the_message_of_the_engine() {
    let panic = catch_unwind(AssertUnwindSafe(|| {
        App::new().add_plugins(CrackPlugins).add_plugins(CrackPlugins);
    }));
    let message = *panic.expect_err("the engine refuses it").downcast::<String>().expect("a message");
    assert!(message.contains("CrackPlugin") && message.contains("already added"), "{message}");
}

#[test]
fn e4_any_subset_of_plugins() {
    for mask in 0..32 {
        let has = |bit: u32| mask >> bit & 1 == 1;
        let [has_time, has_transforms, has_assets, has_images, has_window] = [0, 1, 2, 3, 4].map(has);
        if has_images && !has_assets {
            // The engine's own rule, with its own message.
            continue;
        }
        let mut app = App::new();
        app.add_plugins((TaskPoolPlugin::default(), CrackPlugins));
        if has_time {
            app.add_plugins(TimePlugin);
        }
        if has_transforms {
            app.add_plugins(TransformPlugin);
        }
        if has_assets {
            app.add_plugins(AssetPlugin { meta_check: AssetMetaCheck::Never, ..default() });
        }
        if has_images {
            app.add_plugins(ImagePlugin::default());
        }
        if has_window {
            app.add_plugins(WindowPlugin::default());
        }
        finish(&mut app);
        single_threaded(&mut app);
        let heard = warnings(|| {
            let what =
                format!("time {has_time}, transforms {has_transforms}, assets {has_assets}, images {has_images}");
            step(&mut app);
            if has_images {
                let entity = spawn_picture(&mut app, UVec2::splat(32));
                hit(&mut app, CrackHit::world(entity, Vec3::new(1.0, 2.0, 0.0)));
                settle(&mut app, entity);
                assert_eq!(counts(&app).applied, 1, "{what}");
                return;
            }
            let entity = app.world_mut().spawn((Sprite::default(), CrackSurface::default())).id();
            let quad = (Mesh2d::default(), MeshMaterial2d::<ColorMaterial>::default());
            let quad = app.world_mut().spawn((quad, CrackSurface::default())).id();
            for entity in [entity, quad] {
                hit(&mut app, center(entity));
                step(&mut app);
                let status = state(&app, entity).status;
                assert_eq!(status, CrackStatus::Failed(CrackError::NoImages), "{what}");
                hit(&mut app, center(entity));
            }
            steps(&mut app, 3);
            assert_eq!(counts(&app).rejected, 4, "{what}");
        });
        let expected = if has_images { 0 } else { 2 };
        assert_eq!(heard.len(), expected, "one for each surface: {heard:?}");
        let names_plugin = |text: &String| text.contains("AssetPlugin") && text.contains("ImagePlugin");
        assert!(heard.iter().all(names_plugin), "they say what is missing: {heard:?}");
    }
}

#[test]
fn e4_materials_that_nobody_keeps_are_named() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), ImagePlugin::default(), CrackPlugins));
    finish(&mut app);
    let quad = (Mesh2d::default(), MeshMaterial2d::<ColorMaterial>::default());
    let entity = app.world_mut().spawn((quad, CrackSurface::default())).id();
    hit(&mut app, center(entity));
    steps(&mut app, 3);
    let status = state(&app, entity).status;
    assert!(matches!(status, CrackStatus::Failed(CrackError::NoMaterials { .. })), "{status:?}");
    assert_eq!((counts(&app).queued, counts(&app).rejected), (0, 1));
}

#[test]
fn e5_a_renderer_without_an_adapter() {
    let mut app = App::new();
    app.add_plugins((render_plugins(WgpuSettings { backends: None, ..default() }.into()), CrackPlugins));
    start(&mut app);
    let entity = spawn_picture(&mut app, UVec2::splat(32));
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    // That nothing waits for a renderer is seen from inside: `src/plugin/gpu/uploads.rs`.

    let mut plain = crate::support::app();
    let other = spawn_picture(&mut plain, UVec2::splat(32));
    hit(&mut plain, center(other));
    settle(&mut plain, other);
    assert!(shown(&app, entity) == shown(&plain, other), "the same as on a server");
}

#[test]
fn e6_uploads_that_nobody_fetches_do_not_pile_up() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let image = add(&mut app, picture(UVec2::splat(128)));
    let surfaces = [(); 4].map(|()| spawn_sprite(&mut app, &image));
    for entity in surfaces {
        hit(&mut app, center(entity));
    }
    steps(&mut app, 3);
    // A minimised window: the main world goes on, nothing is extracted or drawn.
    let mut rng = Rng::new(6);
    // All of it is fetched in the frame in which the renderer looks again. The list may be this long (`MAX_UNFETCHED`): some frames ask for as
    // much, 200 for several times as much. None is lost.
    const LONGEST: u32 = 1024;
    for i in 0..200 {
        if i % 20 == 0 {
            for entity in surfaces {
                hit(&mut app, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())));
            }
        }
        app.main_mut().update();
        counts(&app);
    }
    app.update();
    let stats = *app.world().resource::<CrackUploadStats>();
    assert!((1..=LONGEST).contains(&stats.rects), "{stats:?}");
    assert_on_gpu(&mut app, &surfaces);

    let mut halves = [Duration::ZERO; 2];
    for i in 0..10_000 {
        if i % 20 == 0 {
            for entity in surfaces {
                hit(&mut app, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())).with_energy(0.02));
            }
        }
        if i % 1000 == 999 {
            // Else a surface is full after a while.
            for entity in surfaces {
                app.world_mut().commands().entity(entity).heal_cracks();
            }
        }
        let start = Instant::now();
        app.main_mut().update();
        halves[i / 5000] += start.elapsed();
        counts(&app);
    }
    println!("5000 frames: {:?}, 5000 more: {:?}", halves[0], halves[1]);
    for entity in surfaces {
        hit(&mut app, center(entity));
    }
    app.main_mut().update();
    // The window is back: all of it in one frame, and not much. What was healed is not brought there any more.
    for _ in 0..2 {
        app.update();
        let stats = *app.world().resource::<CrackUploadStats>();
        assert!(stats.rects <= LONGEST, "{stats:?}");
    }
    for entity in surfaces {
        settle(&mut app, entity);
    }
    assert_on_gpu(&mut app, &surfaces);
    assert_eq!(app.should_exit(), None);
}

#[test]
fn e6_no_camera_no_window_and_windows_of_no_size() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let entity = spawn_picture(&mut app, UVec2::splat(64));
    // No window and no camera: growth goes on, uploads are fetched.
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    assert_on_gpu(&mut app, &[entity]);
    // Windows that nobody has made, one of them of no size.
    for size in [(0, 0), (320, 200)] {
        app.world_mut().spawn(Window { resolution: size.into(), visible: false, ..default() });
    }
    assert_cracks(&mut app, entity);
    assert_on_gpu(&mut app, &[entity]);
}

fn set_frame(app: &mut App, frame: Duration) {
    app.insert_resource(TimeUpdateStrategy::ManualDuration(frame));
}

/// Lets frames be of any length: neither clamped nor filled with fixed steps.
fn allow_long_frames(app: &mut App) {
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.insert_resource(Time::<Fixed>::from_duration(Duration::from_secs(1 << 40)));
}

/// The same time in all, cut into frames by `cut`: what the surface shows then.
fn cut_time(total: Duration, mut cut: impl FnMut() -> Duration) -> (Vec<u8>, u32) {
    let mut app = app();
    allow_long_frames(&mut app);
    let entity = spawn_picture(&mut app, UVec2::splat(64));
    set_frame(&mut app, Duration::ZERO);
    hit(&mut app, center(entity));
    step(&mut app);
    let mut left = total;
    while !left.is_zero() {
        let frame = cut().min(left);
        left -= frame;
        set_frame(&mut app, frame);
        step(&mut app);
    }
    (shown(&app, entity), state(&app, entity).nodes)
}

#[test]
fn e7_the_same_time_in_any_splitting() {
    let mut rng = Rng::new(7);
    // 60 steps a second: in the middle of growth, in the middle between two steps, and when all is done.
    for total in [Duration::from_micros(341_666), Duration::from_micros(741_666), Duration::from_secs(20)] {
        let reference = cut_time(total, || Duration::from_millis(20));
        assert!(reference.1 > 3, "it has grown");
        for micros in [1_000, 6_944, 8_333, 16_667, 33_333, 100_000, 1_000_000] {
            let now = cut_time(total, || Duration::from_micros(micros));
            assert!(now == reference, "{total:?} in frames of {micros} us: {} nodes, not {}", now.1, reference.1);
        }
        for _ in 0..5 {
            let now = cut_time(total, || Duration::from_micros(u64::from(rng.next_u32() % 50_000)));
            assert!(now == reference, "{total:?} at random: {} nodes, not {}", now.1, reference.1);
        }
    }
}

#[test]
fn e7_clocks_that_stand_still_race_and_jump() {
    let mut app = app();
    let entity = spawn_picture(&mut app, UVec2::splat(64));
    let nodes = |app: &App| state(app, entity).nodes;
    hit(&mut app, center(entity));
    step(&mut app);
    // Paused, speed 0, frames of no length: nothing grows, and hits still begin.
    let before = nodes(&app);
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    steps(&mut app, 10);
    app.world_mut().resource_mut::<Time<Virtual>>().unpause();
    app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed(0.0);
    steps(&mut app, 10);
    app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed(1.0);
    set_frame(&mut app, Duration::ZERO);
    steps(&mut app, 10);
    // A clock that is set back: the engine takes it for no time at all.
    let now = Instant::now();
    app.insert_resource(TimeUpdateStrategy::ManualInstant(now + Duration::from_secs(5)));
    step(&mut app);
    let after_jump = nodes(&app);
    for back in [4, 3, 0] {
        app.insert_resource(TimeUpdateStrategy::ManualInstant(now + Duration::from_secs(back)));
        step(&mut app);
    }
    assert_eq!(nodes(&app), after_jump, "backwards is no time");
    assert!(after_jump >= before);
    // Hardly any time.
    set_frame(&mut app, Duration::from_millis(20));
    app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed(0.001);
    steps(&mut app, 10);
    assert_eq!(nodes(&app), after_jump);
    // An hour in a frame, a hundred times as fast: bounded, and the end of it is the same.
    app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed(100.0);
    allow_long_frames(&mut app);
    set_frame(&mut app, Duration::from_secs(3600));
    step(&mut app);
    settle(&mut app, entity);
    let reference = cut_time(Duration::from_secs(20), || FRAME);
    assert!(shown(&app, entity) == reference.0, "the same crack in the end");
}

#[test]
fn e7_a_long_frame_makes_a_bounded_number_of_steps() {
    let mut app = app();
    single_threaded(&mut app);
    allow_long_frames(&mut app);
    // A crack that goes on for hundreds of steps.
    let mut preset = CrackPreset::CONCRETE;
    preset.growth.step_length = 0.004;
    preset.growth.reach = 2.0;
    preset.growth.num_iterations = 100_000;
    let image = add(&mut app, picture(UVec2::splat(64)));
    let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset))).id();
    hit(&mut app, center(entity));
    step(&mut app);
    let mut last = 0;
    for frame in [Duration::from_secs(3600), Duration::from_secs(1 << 40)] {
        set_frame(&mut app, frame);
        let start = Instant::now();
        step(&mut app);
        assert!(start.elapsed() < Duration::from_secs(2), "no frame takes for ever");
        assert_eq!(state(&app, entity).status, CrackStatus::Growing, "it has not been done in one frame");
        assert!(state(&app, entity).nodes > last);
        last = state(&app, entity).nodes;
    }
    // Rates that are none are refused, and the pace stays; a rate of zero is one.
    set_frame(&mut app, FRAME);
    for (rate, is_refused) in [(0.0, false), (f32::NAN, true), (f32::INFINITY, true), (-5.0, true)] {
        app.world_mut().get_mut::<CrackSurface>(entity).unwrap().preset.as_mut().unwrap().steps_per_second = rate;
        let heard = warnings(|| steps(&mut app, 5));
        assert_eq!(heard.len(), usize::from(is_refused), "{rate} steps a second: {heard:?}");
        // What was due before.
        let before = state(&app, entity).nodes;
        steps(&mut app, 5);
        assert_eq!(state(&app, entity).nodes, before, "{rate} steps a second");
    }
}

#[test]
fn e2_a_surface_that_is_none_any_more_is_untouched() {
    let mut app = app();
    let entity = spawn_picture(&mut app, UVec2::splat(48));
    let n_frames = frames_to_end(&mut app, entity);
    app.world_mut().entity_mut(entity).remove::<CrackSurface>();
    assert_eq!(state(&app, entity), CrackState::default(), "nothing is left of the cracks");
    app.world_mut().entity_mut(entity).insert(CrackSurface::default());
    step(&mut app);
    assert_eq!(state(&app, entity), CrackState::default(), "it has not been hit yet");
    assert_eq!(frames_to_end(&mut app, entity), n_frames, "it starts anew");
}
