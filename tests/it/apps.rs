//! Apps that end, begin again, and stand side by side; settings that change in every frame; hits and files from strangers:
//! the faults E8, E13, E14, E15, F5 and F6 of the reliability list.

use crate::support::*;
use bevy::{asset::UnapprovedPathMode, prelude::*};
use bevy_crack::{CrackPreset, growth::GrowthParams, math::Rng, prelude::*};
use std::{collections::HashSet, time::Duration, time::Instant};

/// One edit of a preset, as a slider of an inspector makes it: often out of range.
fn edit(preset: &mut CrackPreset, rng: &mut Rng) {
    let wild = [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e30][rng.next_u32() as usize % 5];
    let value = if rng.unit() < 0.2 { wild } else { rng.unit() };
    let growth = &mut preset.growth;
    match rng.next_u32() % 10 {
        0 => growth.reach = value,
        1 => growth.step_length = 0.1 * value,
        2 => growth.kill_distance = 0.1 * value,
        3 => growth.max_nodes = [0, 1, 50, 5000, u32::MAX][rng.next_u32() as usize % 5],
        4 => growth.num_iterations = [0, 1, 30, u32::MAX][rng.next_u32() as usize % 4],
        5 => growth.line_width = 0.05 * value,
        6 => growth.arrest = 0.1 * value,
        7 => preset.profile.depth = value,
        8 => preset.steps_per_second = 100.0 * value,
        _ => {
            *preset = CrackPreset::named(CrackPreset::NAMES[rng.next_u32() as usize % CrackPreset::NAMES.len()])
                .unwrap_or_default();
        }
    }
}

/// What is there stays, whatever is edited: refused settings change nothing, and the surface goes on cracking.
#[test]
fn e8_settings_that_change_in_every_frame() {
    let mut app = app();
    let entity = spawn_picture(&mut app, UVec2::new(70, 50));
    let mut rng = Rng::new(8);
    let mut preset = CrackPreset::CONCRETE;
    let mut nodes = 0;
    for frame in 0..1500u32 {
        edit(&mut preset, &mut rng);
        app.world_mut().get_mut::<CrackSurface>(entity).unwrap().preset = preset.clone().into();
        if preset.validate().is_err() {
            // The next edit begins with what is in range.
            preset = CrackPreset { growth: GrowthParams { max_nodes: 400, ..GrowthParams::DEFAULT }, ..default() };
        }
        if frame % 5 == 0 {
            hit(&mut app, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())).with_energy(0.3));
        }
        step(&mut app);
        let state = state(&app, entity);
        assert!(state.nodes + state.frozen >= nodes, "frame {frame}: cracks are gone");
        assert!((0.0..=1.0).contains(&state.damage), "{state:?}");
        nodes = state.nodes + state.frozen;
    }
    app.world_mut().get_mut::<CrackSurface>(entity).unwrap().preset = small_preset().into();
    settle(&mut app, entity);
    assert_sound(&app, entity);
    assert!(nodes > 500, "{nodes}");
}

/// Apps that end while tasks are at work return at once, and leave nothing for the next one.
#[test]
fn e13_a_hundred_apps_one_after_another() {
    let mut first: Option<Vec<u8>> = None;
    for round in 0..100 {
        let mut app = app();
        let image = add(&mut app, picture(UVec2::splat(64)));
        let entity = spawn_sprite(&mut app, &image);
        hit(&mut app, center(entity));
        // A bake and a large surface are on their way when it ends.
        let guide = CrackGuide::text("END");
        app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), GuidedCracks::new(guide)));
        let large = spawn_picture(&mut app, UVec2::splat(700));
        hit(&mut app, center(large));
        if round % 10 == 0 {
            settle(&mut app, entity);
            let now = shown(&app, entity);
            assert!(first.get_or_insert(now.clone()) == &now, "app {round} cracks in another way");
        } else {
            steps(&mut app, round % 4);
        }
        let start = Instant::now();
        drop(app);
        // It waits for no bake: that would be many seconds, one after another.
        assert!(start.elapsed() < Duration::from_secs(10), "app {round} took {:?} to end", start.elapsed());
    }
}

/// A server and a client in one process: each has its own hits, budget and cracks.
#[test]
fn e14_two_apps_frame_by_frame() {
    let alone = |seed| {
        let mut app = app();
        let entity = spawn_picture(&mut app, UVec2::splat(80));
        app.world_mut().get_mut::<CrackSurface>(entity).unwrap().seed = seed;
        (app, entity)
    };
    let run = |app: &mut App, entity: Entity, at: f32| {
        hit(app, CrackHit::uv(entity, Vec2::new(at, 0.4)));
        step(app);
    };
    let expected = [1, 2].map(|seed| {
        let (mut app, entity) = alone(seed);
        (0..5u8).for_each(|i| run(&mut app, entity, 0.1 + 0.2 * f32::from(i)));
        settle(&mut app, entity);
        (shown(&app, entity), counts(&app).applied)
    });
    let mut both = [1, 2].map(alone);
    for i in 0..5u8 {
        both.iter_mut().for_each(|(app, entity)| run(app, *entity, 0.1 + 0.2 * f32::from(i)));
    }
    for ((mut app, entity), (picture, applied)) in both.into_iter().zip(expected) {
        settle(&mut app, entity);
        assert!(shown(&app, entity) == picture);
        assert_eq!(counts(&app).applied, applied);
    }
}

/// What comes first is said wherever it matters.
#[test]
fn e15_no_two_systems_of_the_crate_are_without_order() {
    let mut app = app();
    app.update();
    let schedules = app.world().resource::<Schedules>();
    let graph = schedules.get(PostUpdate).expect("the schedule").graph();
    let sets =
        [CrackSystems::Shatter, CrackSystems::Hit, CrackSystems::Grow, CrackSystems::Paint, CrackSystems::Upload];
    let ours: HashSet<_> =
        sets.iter().flat_map(|set| graph.systems_in_set(set.intern()).expect("the set").iter().copied()).collect();
    assert!(ours.len() > 15, "{}", ours.len());
    let both = |(a, b, _): &&(_, _, _)| ours.contains(a) && ours.contains(b);
    let pairs: Vec<_> = graph.conflicting_systems().0.iter().filter(both).collect();
    let name = |component: &bevy::ecs::component::ComponentId| {
        app.world().components().get_info(*component).map(|info| info.name().to_string())
    };
    let told: Vec<_> = pairs.iter().map(|(a, b, on)| (a, b, on.iter().filter_map(name).collect::<Vec<_>>())).collect();
    assert!(told.is_empty(), "{told:#?}");
}

/// Files are opened by the asset server alone, which refuses to leave its folder.
#[test]
fn f5_paths_out_of_the_folder_of_assets() {
    let mut app = app();
    let mode = AssetPlugin::default().unapproved_path_mode;
    assert!(matches!(mode, UnapprovedPathMode::Forbid));
    let image = add(&mut app, picture(UVec2::splat(32)));
    for path in ["../../../etc/passwd.crack.ron", "/etc/passwd.crack.ron", "http://127.0.0.1:1/x.crack.ron"] {
        let preset: Handle<CrackPreset> = app.world().resource::<AssetServer>().load(path);
        let surface = CrackSurface::new(preset);
        let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), surface)).id();
        hit(&mut app, center(entity));
        steps(&mut app, 30);
        let status = state(&app, entity).status;
        assert!(matches!(status, CrackStatus::Waiting | CrackStatus::Failed(_)), "{path}: {status:?}");
        assert_eq!(counts(&app).applied, 0, "{path}");
    }
}

/// Hits as they may come over a network: anything, at any rate. What one surface gets is limited, and others are served.
#[test]
fn f6_hits_from_strangers() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 1.0;
    let (flooded, other) = (spawn_picture(&mut app, UVec2::splat(48)), spawn_picture(&mut app, UVec2::splat(48)));
    let most = app.world().resource::<CrackBudget>().max_queued_per_surface as u64;
    let mut rng = Rng::new(6);
    let mut number = || f32::from_bits(rng.next_u32());
    for frame in 0..60 {
        for _ in 0..500 {
            let entity =
                if number() > 0.0 { flooded } else { Entity::from_bits(u64::from(number().to_bits()) | 1 << 33) };
            let at = Vec3::new(number(), number(), number());
            let sent = if number() > 0.0 { CrackHit::world(entity, at) } else { CrackHit::uv(entity, at.truncate()) };
            hit(&mut app, sent.with_energy(number()).with_direction(Vec3::new(number(), number(), number())));
        }
        for _ in 0..500 {
            hit(&mut app, CrackHit::uv(flooded, Vec2::new(0.3, 0.6)));
        }
        if frame == 30 {
            hit(&mut app, center(other));
        }
        let stats = step(&mut app);
        assert!(stats.queued <= 2 * most, "{stats:?}");
    }
    assert!(state(&app, other).hits == 1, "it is served among the others");
    settle(&mut app, flooded);
    let stats = counts(&app);
    assert!(stats.rejected > 5000 && stats.applied > 0, "{stats:?}");
    assert_sound(&app, flooded);
}
