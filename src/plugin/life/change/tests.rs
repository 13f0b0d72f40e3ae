//! Other settings and pictures, applied by frames and beside them.

use super::*;
use crate::plugin::{
    headless::{app, blank, shown},
    jobs::threads::Threads,
    prelude::*,
};
use crate::shatter::{Anchor, ShatterParams};
use bevy::time::TimeUpdateStrategy;
use core::time::Duration;

/// Fault B5: a frame without time draws one surface anew when the preset of many changes, each has its turn, and a hit that comes
/// after the change grows by the new preset.
#[test]
fn b5_the_preset_of_many_surfaces_changes_within_the_budget() {
    const SURFACES: usize = 12;
    let mut app = app(CrackBudget { milliseconds: 1000.0, ..default() });
    let preset = CrackPreset::CONCRETE.scaled(0.3);
    let entities: Vec<Entity> = (0..SURFACES as u64)
        .map(|seed| {
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(32)));
            let surface = CrackSurface::new(preset.clone()).with_seed(seed);
            app.world_mut().spawn((Sprite::from_image(image), surface)).id()
        })
        .collect();
    let hit_all = |app: &mut App| {
        for entity in &entities {
            app.world_mut().trigger(CrackHit::uv(*entity, Vec2::splat(0.5)));
        }
    };
    let hits = |app: &App, entity: &Entity| active(app.world(), *entity).map_or(0, |active| active.cracks.hits);
    let settled = |app: &App| {
        let is_settled = |active: &Active| active.cracks.hits > 0 && !active.cracks.growth.is_growing();
        entities.iter().all(|entity| active(app.world(), *entity).is_some_and(is_settled))
    };
    hit_all(&mut app);
    // By the clock: frames take next to no time where nothing else runs.
    for _ in 0..10_000 {
        app.update();
        if settled(&app) {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(settled(&app), "they do not crack");

    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
    let other = CrackPreset::ICE.scaled(0.3);
    for entity in &entities {
        app.world_mut().get_mut::<CrackSurface>(*entity).expect("it is there").preset = other.clone().into();
    }
    hit_all(&mut app);
    let mut frames = 0;
    let changed = |app: &App, entity: &Entity| active(app.world(), *entity).is_some_and(|a| a.preset == other);
    loop {
        let before = entities.iter().filter(|entity| changed(&app, entity)).count();
        app.update();
        frames += 1;
        let after = entities.iter().filter(|entity| changed(&app, entity)).count();
        assert!(after - before <= 1, "{} surfaces in a frame without time", after - before);
        for entity in &entities {
            assert!(changed(&app, entity) || hits(&app, entity) == 1, "a hit came before the change");
        }
        if entities.iter().all(|entity| hits(&app, entity) == 2) {
            break;
        }
        assert!(frames < 400, "some surface starves");
    }
    assert!(frames >= SURFACES, "{frames} frames");
    assert!(app.world().resource::<Queues>().late.is_empty());
}

/// Fault B5: cracks on a picture of other proportions are grown again by a task, as a frame would have grown them; hits come after that.
#[test]
fn b5_cracks_on_another_picture_are_grown_beside_the_frames() {
    let grown = |budget: CrackBudget| {
        let mut app = app(CrackBudget { milliseconds: 1e6, ..default() });
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
        let [first, other] = [UVec2::new(96, 96), UVec2::new(160, 80)]
            .map(|size| app.world_mut().resource_mut::<Assets<Image>>().add(blank(size)));
        let surface = CrackSurface::new(CrackPreset::CLAY.scaled(0.5)).with_seed(4);
        let entity = app.world_mut().spawn((Sprite::from_image(first), surface)).id();
        app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(0.3, 0.6)).with_energy(4.0));
        // They are still growing.
        (0..60).for_each(|_| app.update());
        let extent = |app: &App| active(app.world(), entity).map(|a| a.cracks.growth.network().extent());
        let before = extent(&app);
        assert!(active(app.world(), entity).is_some_and(|a| a.cracks.growth.network().nodes().len() > 1024));
        app.insert_resource(budget);
        // Their time stands still, so that the hit comes after the same step.
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
        if let Some(mut sprite) = app.world_mut().get_mut::<Sprite>(entity) {
            sprite.image = other;
        }
        app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(0.7, 0.4)));
        let is_limited = !app.world().resource::<CrackBudget>().is_unlimited();
        app.update();
        assert_eq!(extent(&app) == before, is_limited, "the frame of the change");
        for _ in 0..10_000 {
            if extent(&app) != before {
                break;
            }
            let hits = active(app.world(), entity).map(|active| active.cracks.hits);
            assert_eq!(hits, Some(1), "a hit comes after the change");
            std::thread::sleep(Duration::from_millis(1));
            app.update();
        }
        assert_ne!(extent(&app), before);
        app.insert_resource(CrackBudget { milliseconds: 1e6, ..default() });
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
        (0..600).for_each(|_| app.update());
        assert!(app.world().resource::<Queues>().late.is_empty());
        let grown = active(app.world(), entity);
        let grown = grown.map(|active| (active.cracks.hits, active.cracks.growth.steps_made()));
        (grown, shown(&app, entity))
    };
    let at_once = grown(CrackBudget { milliseconds: 1e6, ..default() });
    assert_eq!(at_once.0.map(|grown| grown.0), Some(2));
    let beside = grown(CrackBudget { milliseconds: 500.0, ..default() });
    assert_eq!(at_once.0, beside.0);
    assert!(at_once.1 == beside.1, "other cracks");
}

/// Fault B5: a large surface with other settings is drawn again by a task, or in slices of frames. It shows what it showed until then, and
/// what it would show if a frame had drawn it.
#[test]
fn b5_a_large_surface_is_drawn_again_beside_the_frames() {
    preset_changes_beside_the_frames(cracked);
}

/// Fault B5: so is one that has forgotten its oldest cracks.
#[test]
fn b5_a_large_surface_that_has_forgotten_is_drawn_again_beside_the_frames() {
    preset_changes_beside_the_frames(forgetful);
}

/// Fault B5: so is one that shards have left.
#[test]
fn b5_a_large_surface_without_its_shards_is_drawn_again_beside_the_frames() {
    preset_changes_beside_the_frames(broken);
}

/// Fault B5: so is one that shows frames of an atlas.
#[test]
fn b5_a_large_surface_with_frames_is_drawn_again_beside_the_frames() {
    preset_changes_beside_the_frames(animated);
}

/// Fault B5: so is one whose picture has changed.
#[test]
fn b5_a_large_surface_on_a_changed_picture_is_drawn_beside_the_frames() {
    let same = |app: &mut App, entity| change_picture(app, entity, UVec2::new(600, 500));
    let larger = |app: &mut App, entity| change_picture(app, entity, UVec2::new(720, 600));
    let wider = |app: &mut App, entity| change_picture(app, entity, UVec2::new(800, 400));
    let another = |app: &mut App, entity| give_picture(app, entity, UVec2::new(600, 500));
    let another_wider = |app: &mut App, entity| give_picture(app, entity, UVec2::new(800, 400));
    let cases: [(Crack, Change); 7] = [
        (cracked, larger),
        (cracked, wider),
        (forgetful, same),
        (broken, larger),
        (cracked, another),
        (cracked, another_wider),
        (broken, another),
    ];
    for (crack, change) in cases {
        changes_beside_the_frames(crack, change);
    }
}

type Crack = fn(&mut App) -> Entity;
type Change = fn(&mut App, Entity);

fn preset_changes_beside_the_frames(crack: Crack) {
    let redraw = |app: &mut App, entity| {
        change_preset(app, entity, |preset| {
            (preset.profile, preset.look) = (CrackPreset::MUD.profile, CrackPreset::MUD.look);
        });
    };
    let repaint = |app: &mut App, entity| {
        change_preset(app, entity, |preset| (preset.look.tint, preset.look.shadow) = (0.2, 0.2));
    };
    for change in [redraw, repaint] {
        changes_beside_the_frames(crack, change);
    }
}

fn change_preset(app: &mut App, entity: Entity, change: fn(&mut CrackPreset)) {
    let preset = active(app.world(), entity).map(|active| active.preset.clone());
    if let (Some(mut preset), Some(mut surface)) = (preset, app.world_mut().get_mut::<CrackSurface>(entity)) {
        change(&mut preset);
        surface.preset = preset.into();
    }
}

fn change_picture(app: &mut App, entity: Entity, size: UVec2) {
    let picture = active(app.world(), entity).and_then(|active| active.carrier.shown.diffuse.clone());
    let mut images = app.world_mut().resource_mut::<Assets<Image>>();
    if let Some(mut image) = picture.and_then(|picture| images.get_mut(&picture)) {
        *image = blank(size);
        image.data.iter_mut().flatten().for_each(|value| *value = value.saturating_add(20));
    }
    // The engine tells of it at the end of the frame.
    app.update();
}

/// Somebody gives it another picture.
fn give_picture(app: &mut App, entity: Entity, size: UVec2) {
    let mut image = blank(size);
    image.data.iter_mut().flatten().for_each(|value| *value = value.saturating_add(20));
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    if let Some(mut sprite) = app.world_mut().get_mut::<Sprite>(entity) {
        sprite.image = image;
    }
}

fn settle(app: &mut App, entity: Entity) {
    let is_done = |app: &App| {
        let state = app.world().get::<CrackState>(entity);
        state.is_some_and(|state| state.hits > 0 && state.status == CrackStatus::Done)
    };
    for _ in 0..2000 {
        app.update();
        if is_done(app) {
            break;
        }
    }
    assert!(is_done(app), "it does not crack");
}

fn hit_and_settle(app: &mut App, entity: Entity) {
    for i in 0..4 {
        let at = Vec2::new(0.2 + 0.2 * i as f32, 0.5);
        app.world_mut().trigger(CrackHit::uv(entity, at).with_energy(3.0));
    }
    settle(app, entity);
}

fn spawn(app: &mut App, preset: CrackPreset, size: UVec2) -> Entity {
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(size));
    // With this seed no cracks go on growing on a wider picture.
    app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset).with_seed(5))).id()
}

fn cracked(app: &mut App) -> Entity {
    let entity = spawn(app, CrackPreset::CONCRETE, UVec2::new(600, 500));
    hit_and_settle(app, entity);
    entity
}

fn forgetful(app: &mut App) -> Entity {
    let mut preset = CrackPreset::CONCRETE;
    preset.growth.max_nodes = 400;
    let entity = spawn(app, preset, UVec2::new(600, 500));
    for _ in 0..20 {
        hit_and_settle(app, entity);
    }
    assert!(active(app.world(), entity).is_some_and(|active| active.drawing.frozen.is_some()));
    entity
}

fn broken(app: &mut App) -> Entity {
    let entity = spawn(app, CrackPreset::GLASS, UVec2::new(600, 500));
    let cut = ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT };
    let settings = ShatterCracks { cut, anchor: Anchor::Nothing, ..default() };
    app.world_mut().entity_mut(entity).insert(settings);
    hit_and_settle(app, entity);
    app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::around(Vec2::splat(0.2), 0.1));
    let is_whole = |app: &App| active(app.world(), entity).is_none_or(|active| active.drawing.cutouts.is_none());
    for _ in 0..10_000 {
        app.update();
        if !is_whole(app) {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    (0..50).for_each(|_| app.update());
    let is_broken = |active: &Active| {
        active.drawing.cutouts.as_ref().is_some_and(|holes| holes.is_any()) && !active.drawing.carried.is_empty()
    };
    assert!(active(app.world(), entity).is_some_and(is_broken));
    entity
}

fn animated(app: &mut App) -> Entity {
    let entity = spawn(app, CrackPreset::CONCRETE, UVec2::new(1200, 500));
    let frames = TextureAtlasLayout::from_grid(UVec2::new(600, 500), 2, 1, None, None);
    let layout = app.world_mut().resource_mut::<Assets<TextureAtlasLayout>>().add(frames);
    if let Some(mut sprite) = app.world_mut().get_mut::<Sprite>(entity) {
        sprite.texture_atlas = Some(TextureAtlas { layout, index: 0 });
    }
    hit_and_settle(app, entity);
    for index in [1, 0] {
        show_frame(app, entity, index);
    }
    assert!(active(app.world(), entity).is_some_and(|active| active.canvas.views.len() == 2));
    entity
}

fn show_frame(app: &mut App, entity: Entity, index: usize) {
    if let Some(atlas) = app.world_mut().get_mut::<Sprite>(entity).as_mut().and_then(|s| s.texture_atlas.as_mut()) {
        atlas.index = index;
    }
    (0..5).for_each(|_| app.update());
}

/// The texels that the sprite shows.
fn seen(app: &App, entity: Entity) -> Vec<u8> {
    let texels = shown(app, entity);
    let canvas = active(app.world(), entity).map(|active| (active.canvas.seen(), active.canvas.base.size.x));
    let Some((Some(rect), width)) = canvas else { return texels };
    let row = |y: u32| 4 * (y * width + rect.min.x) as usize..4 * (y * width + rect.max.x) as usize;
    (rect.min.y..rect.max.y).map(|y| &texels[row(y)]).collect::<Vec<_>>().concat()
}

/// All that is shown while a surface changes, and what it shows after another hit, of all frames.
fn pictures_of(crack: Crack, change: Change, budget: CrackBudget, no_threads: bool) -> (Vec<Vec<u8>>, [Vec<u8>; 2]) {
    let mut app = app(CrackBudget { milliseconds: 1e6, ..default() });
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
    let entity = crack(&mut app);
    let is_limited = !budget.is_unlimited();
    app.insert_resource(budget);
    app.world_mut().resource_mut::<Threads>().are_missing = no_threads;
    let mut pictures = vec![seen(&app, entity)];
    change(&mut app, entity);
    let mut last = 0;
    for frame in 0..2000 {
        app.update();
        let now = seen(&app, entity);
        if pictures.last() != Some(&now) {
            pictures.push(now);
            last = frame;
        }
        assert!(frame > 0 || (pictures.len() == 1) == is_limited, "the frame of the change");
        if pictures.len() > 1 && frame - last > 50 {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let state = app.world().get::<CrackState>(entity);
    assert!(state.is_some_and(|state| state.status == CrackStatus::Done));
    let playback = app.world().get::<async_playback::AsyncPlayback>(entity);
    assert!(playback.is_some_and(|playback| !playback.is_on()));
    assert!(active(app.world(), entity).is_some_and(|active| active.playhead.playback.is_none()));
    // It cracks on as all others.
    app.insert_resource(CrackBudget { milliseconds: 1e6, ..default() });
    app.world_mut().trigger(CrackHit::uv(entity, Vec2::new(0.5, 0.2)));
    (0..300).for_each(|_| app.update());
    let after = [0, 1].map(|index| {
        show_frame(&mut app, entity, index);
        seen(&app, entity)
    });
    (pictures, after)
}

/// Fault B5: a picture that somebody has given a large surface is shown when its cracks are, and not without them; a surface that is
/// healed before shows it whole.
#[test]
fn b5_another_picture_comes_with_its_cracks() {
    let image = |app: &App, entity| app.world().get::<Sprite>(entity).map(|sprite| sprite.image.clone());
    let original = |app: &App, entity| active(app.world(), entity).and_then(|a| a.carrier.shown.diffuse.clone());
    let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
    let entity = cracked(&mut app);
    let own = image(&app, entity);
    for size in [UVec2::new(600, 500), UVec2::new(500, 800)] {
        give_picture(&mut app, entity, size);
        let given = image(&app, entity);
        let mut frames = 0;
        while original(&app, entity) != given {
            app.update();
            frames += 1;
            assert_eq!(image(&app, entity), own, "frame {frames}");
            assert!(frames < 10_000, "it never comes");
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(frames > 1);
    }
    let [first, second] = [0, 1].map(|_| {
        give_picture(&mut app, entity, UVec2::new(600, 500));
        let given = image(&app, entity);
        app.update();
        assert_eq!(image(&app, entity), own);
        given
    });
    assert_ne!(first, second);
    app.world_mut().commands().entity(entity).heal_cracks();
    app.update();
    assert_eq!(image(&app, entity), second);
}

/// Fault B5: nor is a frame of a film drawn within a frame of the game: each is drawn beside the frames and shown before the next one, be it
/// another picture or the same one with other texels. The last stays.
#[test]
fn b5_films_on_large_surfaces_are_drawn_beside_the_frames() {
    let grey = |level: u8| {
        let mut image = blank(UVec2::new(800, 400));
        image
            .data
            .iter_mut()
            .flat_map(|data| data.as_chunks_mut().0)
            .for_each(|texel| *texel = [level, level, level, 255]);
        image
    };
    let give = |app: &mut App, entity: Entity, level: u8, in_place: bool| {
        let original = active(app.world(), entity).and_then(|active| active.carrier.shown.diffuse.clone());
        let mut images = app.world_mut().resource_mut::<Assets<Image>>();
        if in_place {
            if let Some(mut image) = original.and_then(|original| images.get_mut(&original)) {
                *image = grey(level);
            }
            return;
        }
        let image = images.add(grey(level));
        if let Some(mut sprite) = app.world_mut().get_mut::<Sprite>(entity) {
            sprite.image = image;
        }
    };
    let level = |app: &App, entity| {
        active(app.world(), entity).and_then(|active| active.canvas.base.diffuse.first().copied()).unwrap_or_default()
    };
    const FIRST: u8 = 60;
    const LAST: u8 = 180;
    for in_place in [false, true] {
        let played = |film: core::ops::RangeInclusive<u8>, budget: CrackBudget| {
            let mut app = app(CrackBudget { milliseconds: 1e6, ..default() });
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
            let entity = cracked(&mut app);
            app.insert_resource(budget);
            let mut levels = Vec::new();
            for given in film {
                give(&mut app, entity, given, in_place);
                app.update();
                let now = level(&app, entity);
                if (FIRST..=LAST).contains(&now) {
                    assert!(now < given, "{given} was drawn in a frame: {levels:?}");
                    if levels.last() != Some(&now) {
                        levels.push(now);
                    }
                }
                std::thread::sleep(Duration::from_millis(10));
            }
            for _ in 0..10_000 {
                app.update();
                let is_waiting = !app.world().resource::<Queues>().changed.is_empty();
                if level(&app, entity) == LAST && !is_waiting {
                    break;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
            assert_eq!(level(&app, entity), LAST, "the last one never comes");
            (0..5).for_each(|_| app.update());
            assert!(app.world().resource::<Queues>().changed.is_empty());
            (levels, seen(&app, entity))
        };
        let (levels, last) = played(FIRST..=LAST, CrackBudget { milliseconds: 0.0, ..default() });
        assert!(levels.len() >= 3 && levels.is_sorted(), "{in_place}: {levels:?}");
        let (_, alone) = played(LAST..=LAST, CrackBudget { milliseconds: 500.0, ..default() });
        assert!(last == alone, "{in_place}: another picture");
    }
}

/// A picture that is read for a surface that goes meanwhile is not kept.
#[test]
fn pictures_that_nobody_waits_for_are_dropped() {
    let mut app = app(CrackBudget { milliseconds: 1e6, ..default() });
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
    let entity = cracked(&mut app);
    app.insert_resource(CrackBudget { milliseconds: 0.0, ..default() });
    give_picture(&mut app, entity, UVec2::new(800, 400));
    let picture = app.world().get::<Sprite>(entity).map(|sprite| sprite.image.id()).unwrap_or_default();
    app.update();
    let is_there = |app: &App| app.world().resource::<Assets<Image>>().contains(picture);
    let is_read = |app: &App| active(app.world(), entity).is_none_or(|active| active.carrier.next.is_none());
    assert!(is_there(&app) && !is_read(&app));
    app.world_mut().despawn(entity);
    for _ in 0..1000 {
        app.update();
        if !is_there(&app) {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(!is_there(&app));
}

fn changes_beside_the_frames(crack: Crack, change: Change) {
    let (in_a_frame, after) = pictures_of(crack, change, CrackBudget { milliseconds: 1e6, ..default() }, false);
    assert_eq!(in_a_frame.len(), 2);
    for no_threads in [false, true] {
        let budget = CrackBudget { milliseconds: 0.0, ..default() };
        let (beside, after_beside) = pictures_of(crack, change, budget, no_threads);
        assert!(beside == in_a_frame, "{} pictures", beside.len());
        assert!(after_beside == after);
    }
}
