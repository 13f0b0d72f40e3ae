//! Clocks: the time of a surface's cracks, in whatever order it is shown; faults E7 and what comes of them.

use crate::support::*;
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_crack::{math::Rng, prelude::*};
use std::time::Duration;

/// So large that even the tips of cracks are seen.
const SIZE: UVec2 = UVec2::new(144, 120);

#[derive(Resource, Default)]
struct Finished(Vec<Entity>);

fn clock_app() -> App {
    let mut app = app();
    app.init_resource::<Finished>()
        .add_observer(|event: On<CrackFinished>, mut finished: ResMut<Finished>| finished.0.push(event.entity));
    app
}

fn n_finished(app: &App, entity: Entity) -> usize {
    app.world().resource::<Finished>().0.iter().filter(|e| **e == entity).count()
}

/// A surface with a clock, hit twice.
fn spawn_hit(app: &mut App, clock: CrackClock) -> Entity {
    let entity = spawn_picture(app, SIZE);
    app.world_mut().entity_mut(entity).insert(clock);
    hit_twice(app, entity);
    entity
}

fn hit_twice(app: &mut App, entity: Entity) {
    hit(app, CrackHit::uv(entity, Vec2::new(0.4, 0.5)));
    hit(app, CrackHit::uv(entity, Vec2::new(0.8, 0.3)).with_energy(0.5));
}

/// What the same hits leave on a surface without a clock.
fn finished_texels() -> (Vec<u8>, CrackState) {
    let mut app = app();
    let entity = spawn_picture(&mut app, SIZE);
    hit_twice(&mut app, entity);
    settle(&mut app, entity);
    (shown(&app, entity), state(&app, entity))
}

fn set(app: &mut App, entity: Entity, clock: CrackClock) {
    app.world_mut().entity_mut(entity).insert(clock);
}

fn seek(app: &mut App, entity: Entity, steps: f32) {
    app.world_mut().get_mut::<CrackClock>(entity).expect("a clock").seek = Some(steps);
}

/// Frames until growth has made its last step.
fn grow_out(app: &mut App, entity: Entity) {
    steps(app, 3);
    let (mut end, mut frames) = (-1.0, 0);
    wait_for(app, "the end of growth", |app| {
        let now = state(app, entity).end;
        frames = if now == end { frames + 1 } else { 0 };
        end = now;
        frames > 20
    });
}

/// Frames until the time shown stands still.
fn rest(app: &mut App, entity: Entity) {
    let (mut time, mut frames) = (-1.0, 0);
    wait_for(app, "the time to stand still", |app| {
        let now = state(app, entity).time;
        frames = if now == time { frames + 1 } else { 0 };
        time = now;
        frames > 5
    });
}

#[test]
fn a_value_shows_its_share_in_any_order() {
    let mut app = clock_app();
    let untouched = shown_picture();
    let entity = spawn_hit(&mut app, CrackClock::value(0.0));
    grow_out(&mut app, entity);
    let now = state(&app, entity);
    assert!(now.end > 10.0 && now.time == 0.0 && now.damage == 0.0, "{now:?}");
    assert_eq!(shown(&app, entity), untouched, "at zero nothing shows");
    assert_eq!(n_finished(&app, entity), 0, "the end was not shown");

    let values: Vec<f32> = (0..=40).map(|i| i as f32 / 40.0).collect();
    let mut pictures = Vec::new();
    let mut damage = 0.0;
    for value in &values {
        set(&mut app, entity, CrackClock::value(*value));
        step(&mut app);
        let now = state(&app, entity);
        assert!((now.time - value * now.end).abs() <= 1.0 / 256.0, "{value}: {now:?}");
        assert!(now.damage >= damage, "more time, more damage");
        damage = now.damage;
        pictures.push(shown(&app, entity));
    }
    let same: Vec<usize> = (1..pictures.len()).filter(|&i| pictures[i] == pictures[i - 1]).collect();
    assert!(same.is_empty(), "each value has its own picture, not so {same:?}");
    let (finished, at_end) = finished_texels();
    assert_eq!(pictures.last(), Some(&finished), "the end is that of a surface without a clock");
    assert_eq!(state(&app, entity).damage, at_end.damage);
    assert_eq!((at_end.time, state(&app, entity).end), (at_end.end, at_end.end));
    assert_eq!((n_finished(&app, entity), state(&app, entity).status), (1, CrackStatus::Done));

    let mut rng = Rng::new(4);
    for _ in 0..150 {
        let i = rng.next_u32() as usize % values.len();
        set(&mut app, entity, CrackClock::value(values[i]));
        for _ in 0..rng.next_u32() % 3 {
            step(&mut app);
        }
        step(&mut app);
        assert!(shown(&app, entity) == pictures[i], "value {}", values[i]);
    }
    assert_eq!(n_finished(&app, entity), 1, "the end is told once");
    assert_sound(&app, entity);
}

/// The picture of an untouched surface.
fn shown_picture() -> Vec<u8> {
    picture(SIZE).data.expect("data")
}

#[test]
fn time_runs_forwards_and_backwards() {
    let mut app = clock_app();
    let entity = spawn_hit(&mut app, CrackClock::default());
    let mut passed = Vec::new();
    for _ in 0..10 {
        step(&mut app);
        passed.push((state(&app, entity).time, shown(&app, entity)));
    }
    let times: Vec<_> = passed.iter().map(|(time, _)| *time).collect();
    assert!(times.is_sorted_by(|a, b| a < b), "time passes in each frame: {times:?}");
    assert!(passed.iter().any(|(time, _)| time.fract() != 0.0), "with fractions of a step");
    assert!(!state(&app, entity).tips.is_empty());
    settle(&mut app, entity);
    let (finished, _) = finished_texels();
    assert!(shown(&app, entity) == finished);
    let end = state(&app, entity).end;

    set(&mut app, entity, CrackClock::speed(-2.0));
    step(&mut app);
    let there = state(&app, entity);
    assert!((end - there.time - 2.4).abs() < 0.01, "2.4 steps a frame: {there:?}");
    assert!(there.tips.is_empty(), "nothing grows");
    rest(&mut app, entity);
    assert_eq!(state(&app, entity).time, 0.0);
    assert!(shown(&app, entity) == shown_picture());

    // Every picture on the way is that of a jump.
    for (time, texels) in passed.iter().rev() {
        seek(&mut app, entity, *time);
        app.world_mut().get_mut::<CrackClock>(entity).unwrap().paused = true;
        step(&mut app);
        assert_eq!(state(&app, entity).time, *time);
        assert!(shown(&app, entity) == *texels, "at {time}");
    }
    let paused = state(&app, entity);
    steps(&mut app, 5);
    assert_eq!(state(&app, entity), paused, "time stands still");
    seek(&mut app, entity, f32::INFINITY);
    step(&mut app);
    assert!(shown(&app, entity) == finished && state(&app, entity).time == end);
    assert_eq!(n_finished(&app, entity), 1);
}

/// A jump beyond what has grown grows it, whatever the frames and the budget.
#[test]
fn a_jump_ahead_grows_what_is_missing() {
    let run = |milliseconds: u64, budget: f32| {
        let mut app = clock_app();
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(milliseconds)));
        app.world_mut().resource_mut::<CrackBudget>().milliseconds = budget;
        let clock = CrackClock { paused: true, seek: Some(13.25), ..default() };
        let entity = spawn_hit(&mut app, clock);
        wait_for(&mut app, "the moment", |app| state(app, entity).time == 13.25 && state(app, entity).hits == 2);
        shown(&app, entity)
    };
    let reference = run(20, 1e6);
    assert_ne!(reference, shown_picture());
    assert!(run(3, 1e6) == reference, "short frames");
    assert!(run(3_600_000, 1e6) == reference, "long frames");
}

/// E7: numbers that are none, speeds beyond all bounds, frames of an hour.
#[test]
fn e7_wild_clocks_do_no_harm() {
    let mut app = clock_app();
    let entity = spawn_hit(&mut app, CrackClock::default());
    let (finished, _) = finished_texels();
    let mut rng = Rng::new(9);
    let wild = [f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX, -f32::MAX, 1e9, -1.0, -0.0, 0.5, 1.0, 1e-30, 7.0];
    let pick = |rng: &mut Rng| wild[rng.next_u32() as usize % wild.len()];
    for frame in 0..600 {
        // The engine makes up for an hour with 230,000 fixed steps: once is enough.
        let length = if frame == 300 { 3_600_000 } else { [0, 1, 20, 3000][rng.next_u32() as usize % 4] };
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(length)));
        app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
        let number = pick(&mut rng);
        let mut clock = if rng.unit() < 0.5 { CrackClock::value(number) } else { CrackClock::speed(number) };
        clock.paused = rng.unit() < 0.2;
        if rng.unit() < 0.2 {
            clock.seek = Some(pick(&mut rng));
        }
        set(&mut app, entity, clock);
        if frame % 150 == 149 {
            // Not a hit that leaves another pattern: it falls on the first.
            hit(&mut app, CrackHit::uv(entity, Vec2::new(0.4, 0.5)).with_energy(0.0));
        }
        step(&mut app);
        let now = state(&app, entity);
        assert!((0.0..=now.end).contains(&now.time), "{now:?} under {clock:?}");
        assert_sound(&app, entity);
    }
    app.insert_resource(TimeUpdateStrategy::ManualDuration(FRAME));
    set(&mut app, entity, CrackClock::value(0.5));
    grow_out(&mut app, entity);
    let halfway = shown(&app, entity);
    set(&mut app, entity, CrackClock::value(f32::NAN));
    steps(&mut app, 3);
    assert!(shown(&app, entity) == halfway, "no value, no change");
    set(&mut app, entity, CrackClock::speed(f32::MAX));
    settle(&mut app, entity);
    assert!(shown(&app, entity) == finished);
}

/// A hit makes time run forwards from where it is; nothing jumps, and both hits are there at the end.
#[test]
fn a_hit_turns_time_forwards() {
    let late = CrackHit::uv;
    let mut app = clock_app();
    let [entity, plain] = [0, 1].map(|_| spawn_picture(&mut app, SIZE));
    set(&mut app, entity, CrackClock::default());
    for entity in [entity, plain] {
        hit(&mut app, center(entity));
        settle(&mut app, entity);
    }
    set(&mut app, entity, CrackClock::speed(-0.5));
    steps(&mut app, 20);
    let before = state(&app, entity);
    assert!(before.time > 1.0 && before.time < before.end - 5.0, "{before:?}");
    for entity in [entity, plain] {
        hit(&mut app, late(entity, Vec2::new(0.2, 0.2)));
    }
    step(&mut app);
    let after = state(&app, entity);
    assert!((after.time - before.time - 0.6).abs() < 0.01, "{before:?} {after:?}");
    assert_eq!(get::<CrackClock>(&app, entity), CrackClock::speed(0.5));
    for entity in [entity, plain] {
        wait_for(&mut app, "the end", |app| state(app, entity).status == CrackStatus::Done);
    }
    assert!(shown(&app, entity) == shown(&app, plain), "as if there had been no clock");
    assert_eq!(n_finished(&app, entity), 2);
}

/// Cracks that close end as healed ones; a hit opens them again.
#[test]
fn cracks_close_in_time() {
    for clock in [None, Some(CrackClock::default()), Some(CrackClock::value(1.0))] {
        let mut app = clock_app();
        let entity = spawn_picture(&mut app, SIZE);
        let original = image_of(&app, entity);
        if let Some(clock) = clock {
            set(&mut app, entity, clock);
        }
        hit_twice(&mut app, entity);
        settle(&mut app, entity);
        let finished = shown(&app, entity);
        // Half closed, then hit: on to the end again.
        app.world_mut().commands().entity(entity).close_cracks(1.0);
        let mut damage = state(&app, entity).damage;
        for _ in 0..25 {
            step(&mut app);
            assert!(state(&app, entity).damage <= damage, "it closes");
            damage = state(&app, entity).damage;
        }
        let half = state(&app, entity);
        assert!((half.time / half.end - 0.5).abs() < 0.01, "{half:?}");
        hit(&mut app, CrackHit::uv(entity, Vec2::new(0.4, 0.5)).with_energy(1e-6));
        wait_for(&mut app, "the end", |app| n_finished(app, entity) == 2);
        assert!(state(&app, entity).time == state(&app, entity).end && shown(&app, entity) == finished);
        // To the end.
        app.world_mut().commands().entity(entity).close_cracks(0.5);
        steps(&mut app, 24);
        assert!(app.world().get::<CrackTextures>(entity).is_some(), "a little is left");
        steps(&mut app, 2);
        assert_eq!(image_of(&app, entity), original);
        assert!(app.world().get::<CrackTextures>(entity).is_none());
        assert_eq!(state(&app, entity), CrackState::default());
        // It cracks again, the same way.
        hit_twice(&mut app, entity);
        settle(&mut app, entity);
        assert!(shown(&app, entity) == finished);
        // At once.
        app.world_mut().commands().entity(entity).close_cracks(f32::NAN);
        step(&mut app);
        assert_eq!(image_of(&app, entity), original);
    }
}

/// E1: surfaces that go, are stripped, healed or closed while time runs on them; nothing is left over.
#[test]
fn e1_surfaces_go_while_time_runs() {
    let mut app = clock_app();
    let image = add(&mut app, picture(SIZE));
    app.update();
    let images = app.world().resource::<Assets<Image>>().len();
    let mut rng = Rng::new(5);
    let mut alive: Vec<Entity> = Vec::new();
    for _ in 0..1500 {
        if alive.len() < 6 {
            let entity = spawn_sprite(&mut app, &image);
            set(&mut app, entity, CrackClock::value(0.5));
            hit(&mut app, center(entity));
            alive.push(entity);
        }
        let i = rng.next_u32() as usize % alive.len();
        let entity = alive[i];
        match rng.next_u32() % 12 {
            0 => {
                app.world_mut().despawn(entity);
                alive.swap_remove(i);
            }
            1 => {
                app.world_mut().entity_mut(entity).remove::<CrackSurface>();
                assert_eq!(image_of(&app, entity), image, "its own picture is back");
                app.world_mut().entity_mut(entity).insert(CrackSurface::default());
            }
            2 => _ = app.world_mut().commands().entity(entity).heal_cracks(),
            3 => _ = app.world_mut().commands().entity(entity).close_cracks(0.1 * rng.unit()),
            4 => _ = app.world_mut().entity_mut(entity).remove::<CrackClock>(),
            5 => set(&mut app, entity, CrackClock::speed(rng.range(-3.0, 3.0))),
            6 | 7 => set(&mut app, entity, CrackClock::value(rng.unit())),
            8 => hit(&mut app, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit()))),
            _ => _ = step(&mut app),
        }
    }
    for entity in &alive {
        app.world_mut().entity_mut(*entity).remove::<CrackClock>();
        hit(&mut app, center(*entity));
    }
    for entity in &alive {
        settle(&mut app, *entity);
        assert_eq!(state(&app, *entity).time, state(&app, *entity).end, "without a clock the end is shown");
    }
    for entity in alive {
        app.world_mut().despawn(entity);
    }
    steps(&mut app, 5);
    assert_eq!(app.world().resource::<Assets<Image>>().len(), images, "no texture is left");
}

/// A clock that comes late, and one that goes early, leave the cracks as they would have been.
#[test]
fn clocks_come_and_go() {
    let (finished, _) = finished_texels();
    let mut app = clock_app();
    let entity = spawn_picture(&mut app, SIZE);
    hit_twice(&mut app, entity);
    steps(&mut app, 8);
    set(&mut app, entity, CrackClock::speed(-1.0));
    steps(&mut app, 4);
    let back = state(&app, entity);
    assert!(back.time < back.end, "{back:?}");
    app.world_mut().entity_mut(entity).remove::<CrackClock>();
    step(&mut app);
    let on = state(&app, entity);
    assert!(on.time > back.time && on.time < back.time + 2.0, "on from where it was: {back:?} {on:?}");
    settle(&mut app, entity);
    assert!(shown(&app, entity) == finished);
    set(&mut app, entity, CrackClock::default());
    steps(&mut app, 2);
    assert!(shown(&app, entity) == finished && n_finished(&app, entity) == 1);
}

/// Another picture, another size and another preset while a moment is shown: that moment, as if it had been so from the start.
#[test]
fn pictures_and_presets_change_under_a_clock() {
    let mut preset = CrackPreset::CONCRETE;
    preset.profile.rim_width = 0.02;
    preset.profile.rim_depth = 0.4;
    let large = UVec2::new(2 * SIZE.x, 2 * SIZE.y);
    let run = |changes_late: bool| {
        let mut app = clock_app();
        let image = add(&mut app, picture(if changes_late { SIZE } else { large }));
        let entity = spawn_sprite(&mut app, &image);
        set(&mut app, entity, CrackClock::value(0.6));
        let change = |app: &mut App| {
            app.world_mut().get_mut::<CrackSurface>(entity).unwrap().preset = preset.clone().into();
        };
        if !changes_late {
            change(&mut app);
        }
        hit_twice(&mut app, entity);
        grow_out(&mut app, entity);
        if changes_late {
            change(&mut app);
            step(&mut app);
            *app.world_mut().resource_mut::<Assets<Image>>().get_mut(&image).unwrap() = picture(large);
            steps(&mut app, 3);
            set(&mut app, entity, CrackClock::value(0.2));
            step(&mut app);
            set(&mut app, entity, CrackClock::value(0.6));
            step(&mut app);
        }
        assert_sound(&app, entity);
        shown(&app, entity)
    };
    let (late, early) = (run(true), run(false));
    assert_eq!(late.len(), early.len());
    assert!(late == early);
}

/// I8: a hundred surfaces are scrubbed at once and there is no time for any: one a frame, in turns, none starves.
#[test]
fn i8_scrubbing_keeps_to_the_budget() {
    let mut app = clock_app();
    let image = add(&mut app, picture(UVec2::splat(32)));
    let surfaces: Vec<_> = (0..100)
        .map(|_| {
            let entity = spawn_sprite(&mut app, &image);
            set(&mut app, entity, CrackClock::value(0.0));
            hit(&mut app, center(entity));
            entity
        })
        .collect();
    for entity in &surfaces[98..] {
        grow_out(&mut app, *entity);
    }
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
    let times = |app: &App| surfaces.iter().map(|entity| state(app, *entity).time).collect::<Vec<_>>();
    let mut last_shown = vec![0; surfaces.len()];
    let mut rng = Rng::new(2);
    for frame in 1..=450 {
        for entity in &surfaces {
            set(&mut app, *entity, CrackClock::value(0.1 + 0.9 * rng.unit()));
        }
        let before = times(&app);
        step(&mut app);
        let moved = before.iter().zip(times(&app)).enumerate().filter(|(_, (a, b))| **a != *b).map(|(i, _)| i);
        let moved: Vec<_> = moved.collect();
        assert!(moved.len() <= 1, "frame {frame}: {} surfaces", moved.len());
        for surface in moved {
            last_shown[surface] = frame;
        }
    }
    assert!(last_shown.iter().all(|frame| *frame > 240), "each has its turn: {last_shown:?}");
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 1e6;
    for entity in &surfaces {
        set(&mut app, *entity, CrackClock::value(0.5));
    }
    step(&mut app);
    let first = state(&app, surfaces[0]);
    for entity in &surfaces {
        let now = state(&app, *entity);
        assert_eq!((now.time, now.end, now.nodes), (first.time, first.end, first.nodes));
    }
    let pictures: Vec<_> = surfaces.iter().map(|entity| shown(&app, *entity)).collect();
    assert!(pictures.iter().all(|picture| *picture == pictures[0]), "all show the same moment");
}

/// Nothing looks at surfaces whose time stands still: their state is not written.
#[test]
fn resting_clocks_cost_nothing() {
    let mut app = clock_app();
    let entity = spawn_hit(&mut app, CrackClock::speed(1.0));
    settle(&mut app, entity);
    step(&mut app);
    let tick = app.world().entity(entity).get_ref::<CrackState>().unwrap().last_changed();
    steps(&mut app, 10);
    set(&mut app, entity, CrackClock::speed(2.0));
    steps(&mut app, 10);
    let last = app.world().entity(entity).get_ref::<CrackState>().unwrap().last_changed();
    assert_eq!(tick, last, "nothing is written");
}

/// What is taken back on the CPU is taken back on the GPU.
#[test]
fn scrubbed_textures_reach_the_gpu() {
    let Some((_guard, mut app)) = gpu_app() else { return };
    let entity = spawn_hit(&mut app, CrackClock::value(0.0));
    grow_out(&mut app, entity);
    let mut rng = Rng::new(8);
    for _ in 0..4 {
        for _ in 0..10 {
            set(&mut app, entity, CrackClock::value(rng.unit()));
            step(&mut app);
        }
        assert_on_gpu(&mut app, &[entity]);
    }
    set(&mut app, entity, CrackClock::value(0.0));
    step(&mut app);
    assert!(shown(&app, entity) == shown_picture());
    assert_on_gpu(&mut app, &[entity]);
}
