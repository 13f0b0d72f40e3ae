//! Surfaces that are saved and loaded: the same bits, whatever they were at.

use crate::support::*;
use bevy::{ecs::system::RunSystemOnce, prelude::*};
use bevy_crack::{
    CrackPreset,
    growth::{CrackGrowth, Past, PastEvent},
    math::Rng,
    paint::Shades,
    prelude::*,
};
use std::time::Instant;

const SIZE: UVec2 = UVec2::new(160, 120);

fn record(app: &mut App, entity: Entity) -> Option<CrackRecord> {
    app.world_mut().run_system_once(move |records: CrackRecords| records.get(entity)).expect("it runs")
}

/// The record as a file has it.
fn saved(app: &mut App, entity: Entity) -> CrackRecord {
    let record = record(app, entity).expect("it has cracks");
    let json = serde_json::to_string(&record).expect("it can be written");
    let read: CrackRecord = serde_json::from_str(&json).expect("it can be read");
    // The last digit of a time in JSON is not exact.
    assert!((read.time - record.time).abs() < 1e-9, "{json}");
    assert_eq!(CrackRecord { time: record.time, ..read.clone() }, record, "{json}");
    read
}

fn spawn(app: &mut App, preset: &CrackPreset, seed: u64) -> Entity {
    let image = add(app, picture(SIZE));
    let surface = CrackSurface::new(preset.clone()).with_seed(seed);
    app.world_mut().spawn((Sprite::from_image(image), surface)).id()
}

/// Steps until the record has been taken up.
fn take_up(app: &mut App, entity: Entity, record: CrackRecord) {
    app.world_mut().entity_mut(entity).insert(record);
    let start = Instant::now();
    while app.world().get::<CrackRecord>(entity).is_some() {
        step(app);
        assert!(start.elapsed().as_secs() < 60, "it is never taken up");
    }
    assert_eq!(app.world().get::<BakeProgress>(entity), Some(&BakeProgress(1.0)));
}

fn assert_alike(a: (&App, Entity), b: (&App, Entity), what: &str) {
    assert!(shown(a.0, a.1) == shown(b.0, b.1), "{what}: other pictures");
    let (a, b) = (state(a.0, a.1), state(b.0, b.1));
    let of = |state: &CrackState| (state.status.clone(), state.nodes, state.hits, state.cells, state.frozen, state.end);
    assert_eq!(of(&a), of(&b), "{what}");
    assert_eq!(a.damage, b.damage, "{what}");
}

/// Every preset is hit, saved while it grows, and loaded into another app. What is hit afterwards cracks alike.
#[test]
fn a_record_brings_back_the_same_bits_in_mid_growth() {
    let mut rng = Rng::new(17);
    for name in CrackPreset::NAMES {
        let preset = CrackPreset::named(name).unwrap();
        let (mut first, mut second) = (app(), app());
        let entity = spawn(&mut first, &preset, 5);
        for _ in 0..3 {
            hit(&mut first, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())).with_energy(0.3 + rng.unit()));
            steps(&mut first, 1 + (rng.next_u32() % 8) as usize);
        }
        let record = saved(&mut first, entity);
        // The seed comes with the record.
        let other = spawn(&mut second, &preset, 0);
        take_up(&mut second, other, record);
        assert_alike((&first, entity), (&second, other), name);
        let is_growing = state(&first, entity).status == CrackStatus::Growing;
        for (app, entity) in [(&mut first, entity), (&mut second, other)] {
            steps(app, 7);
            hit(app, CrackHit::uv(entity, Vec2::new(0.8, 0.3)));
        }
        settle(&mut first, entity);
        settle(&mut second, other);
        assert_alike((&first, entity), (&second, other), name);
        assert_eq!(self::record(&mut first, entity), self::record(&mut second, other), "{name}, growing: {is_growing}");
    }
}

#[test]
fn a_clock_goes_on_where_it_was() {
    let preset = CrackPreset::GLASS;
    for clock in [CrackClock { paused: true, ..default() }, CrackClock::speed(-0.3), CrackClock::value(0.4)] {
        let (mut first, mut second) = (app(), app());
        let entity = spawn(&mut first, &preset, 2);
        hit(&mut first, center(entity));
        steps(&mut first, 12);
        app_clock(&mut first, entity, clock);
        steps(&mut first, 4);
        let record = saved(&mut first, entity);
        let other = spawn(&mut second, &preset, 2);
        app_clock(&mut second, other, clock);
        take_up(&mut second, other, record);
        assert_eq!(state(&first, entity).time, state(&second, other).time, "{clock:?}");
        assert!(shown(&first, entity) == shown(&second, other), "{clock:?}");
        for (app, entity) in [(&mut first, entity), (&mut second, other)] {
            app_clock(app, entity, CrackClock { seek: Some(f32::INFINITY), ..default() });
            settle(app, entity);
        }
        assert_alike((&first, entity), (&second, other), "at the end");
    }
}

fn app_clock(app: &mut App, entity: Entity, clock: CrackClock) {
    app.world_mut().entity_mut(entity).insert(clock);
}

/// What is baked is made first, and hits of the record grow around it.
#[test]
fn a_record_waits_for_the_cracks_of_a_picture() {
    let mut preset = CrackPreset::CLAY;
    preset.growth.arrest = 0.05;
    let guide = || {
        let middle = |x: u32, y: u32| if (40..60).contains(&x) && y > 20 { 1.0 } else { 0.0 };
        let texels = (0..100 * 75).map(|i| middle(i % 100, i / 100)).collect();
        let grid = bevy_crack::Grid::from_vec(UVec2::new(100, 75), texels).expect("it is full");
        GuidedCracks { max_side: 120, ..GuidedCracks::new(CrackGuide::new(grid)) }
    };
    let (mut first, mut second) = (app(), app());
    let entity = spawn(&mut first, &preset, 3);
    first.world_mut().entity_mut(entity).insert(guide());
    wait_for(&mut first, "the bake", |app| app.world().get(entity) == Some(&BakeProgress(1.0)));
    settle(&mut first, entity);
    hit(&mut first, CrackHit::uv(entity, Vec2::new(0.2, 0.3)));
    steps(&mut first, 5);
    hit(&mut first, CrackHit::uv(entity, Vec2::new(0.7, 0.8)));
    steps(&mut first, 5);
    let record = saved(&mut first, entity);
    let other = spawn(&mut second, &preset, 3);
    second.world_mut().entity_mut(other).insert((guide(), record));
    wait_for(&mut second, "the record", |app| app.world().get::<CrackRecord>(other).is_none());
    assert_alike((&first, entity), (&second, other), "in mid-growth");
    settle(&mut first, entity);
    settle(&mut second, other);
    assert_alike((&first, entity), (&second, other), "at the end");
}

/// Cracks that were removed to make room for others are in the picture again.
#[test]
fn frozen_cracks_come_back() {
    let mut preset = small_preset();
    preset.growth.max_nodes = 200;
    preset.look.shades = Shades::Smooth;
    let (mut first, mut second) = (app(), app());
    let entity = spawn(&mut first, &preset, 4);
    let mut rng = Rng::new(3);
    for _ in 0..60 {
        hit(&mut first, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())).with_energy(0.6));
        steps(&mut first, 6);
    }
    settle(&mut first, entity);
    assert!(state(&first, entity).frozen > 200);
    let record = saved(&mut first, entity);
    let other = spawn(&mut second, &preset, 4);
    take_up(&mut second, other, record);
    settle(&mut second, other);
    let (a, b) = (state(&first, entity), state(&second, other));
    assert_eq!((a.nodes, a.frozen, a.cells, a.hits), (b.nodes, b.frozen, b.cells, b.hits));
    let (a, b) = (shown(&first, entity), shown(&second, other));
    let others = a.chunks(4).zip(b.chunks(4)).filter(|(a, b)| a != b).count();
    assert!(others == 0, "{others} texels differ");
}

/// Hits that come while a record is on its way come after those of the record, and earlier ones of the surface as well.
#[test]
fn hits_of_the_surface_come_after_those_of_its_record() {
    let (mut first, mut second) = (app(), app());
    let entity = spawn(&mut first, &CrackPreset::CONCRETE, 6);
    hit(&mut first, center(entity));
    settle(&mut first, entity);
    let record = saved(&mut first, entity);
    let late = |entity| CrackHit::uv(entity, Vec2::new(0.2, 0.8)).with_energy(0.5);
    hit(&mut first, late(entity));
    settle(&mut first, entity);
    for is_before in [true, false] {
        let other = spawn(&mut second, &CrackPreset::CONCRETE, 6);
        if is_before {
            hit(&mut second, late(other));
            settle(&mut second, other);
        }
        second.world_mut().entity_mut(other).insert(record.clone());
        if !is_before {
            hit(&mut second, late(other));
        }
        take_up(&mut second, other, record.clone());
        settle(&mut second, other);
        assert_alike((&first, entity), (&second, other), if is_before { "before" } else { "meanwhile" });
    }
}

#[derive(Resource, Default)]
struct Told {
    baked: u32,
    failed: Vec<CrackError>,
}

/// What cannot be the past of a surface is refused once, and the surface is as it was.
#[test]
fn f4_records_that_cannot_be_are_refused() {
    let mut app = app();
    app.init_resource::<Told>();
    app.add_observer(|_: On<CrackBaked>, mut told: ResMut<Told>| told.baked += 1);
    app.add_observer(|failed: On<CrackFailed>, mut told: ResMut<Told>| told.failed.push(failed.error.clone()));
    let entity = spawn(&mut app, &CrackPreset::GLASS, 1);
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    let (good, before) = (saved(&mut app, entity), shown(&app, entity));
    let event = |after, x, energy| PastEvent::Hit { after, pos: Vec2::new(x, 0.5), energy };
    let with = |events| CrackRecord { past: Past { events, ..good.past.clone() }, ..good.clone() };
    let bad = [
        CrackRecord { version: CrackRecord::VERSION + 1, ..good.clone() },
        CrackRecord { time: f64::NAN, ..good.clone() },
        CrackRecord { time: -1.0, ..good.clone() },
        with(vec![event(0, f32::NAN, 1.0)]),
        with(vec![event(0, 7.0, 1.0)]),
        with(vec![event(0, 0.5, -1.0)]),
        with(vec![event(9, 0.5, 1.0), event(8, 0.5, 1.0)]),
        with(vec![event(u32::MAX, 0.5, 1.0)]),
        with(vec![event(0, 0.5, 1.0); Past::MAX_EVENTS + 1]),
        CrackRecord { past: Past { extent: Vec2::ZERO, ..good.past.clone() }, ..good.clone() },
    ];
    for (n, record) in (1..).zip(bad) {
        let heard = warnings(|| {
            app.world_mut().entity_mut(entity).insert(record.clone());
            steps(&mut app, 4);
        });
        assert_eq!(heard.len(), 1, "{heard:?}");
        assert!(app.world().get::<CrackRecord>(entity).is_none());
        let told = app.world().resource::<Told>();
        assert_eq!((told.baked, told.failed.len()), (0, n));
        assert!(matches!(told.failed.last(), Some(CrackError::Record { .. })), "{:?}", told.failed.last());
        assert!(shown(&app, entity) == before, "{record:?}");
    }
    // A file of nonsense is not a record at all.
    for text in
        ["{}", "[]", r#"{"version":1,"seed":1,"past":{"extent":[1,1],"events":[{"Jump":{}}],"steps":1},"time":0}"#]
    {
        assert!(serde_json::from_str::<CrackRecord>(text).is_err(), "{text}");
    }
    // It may claim any number of steps.
    let other = spawn(&mut app, &CrackPreset::GLASS, 1);
    let endless = Past { steps: u32::MAX, events: vec![event(u32::MAX, 0.5, 1.0)], ..good.past.clone() };
    take_up(&mut app, other, CrackRecord { past: endless, time: f64::MAX, ..good });
    settle(&mut app, other);
    assert_sound(&app, other);
    assert_eq!(state(&app, other).hits, 1);
}

/// Moves the fourth hit.
fn hit_at(record: &mut CrackRecord, at: Vec2) {
    if let PastEvent::Hit { pos, .. } = &mut record.past.events[3] {
        *pos = at;
    }
}

/// Has the fourth hit come after this many steps.
fn hit_after(record: &mut CrackRecord, steps: u32) {
    if let PastEvent::Hit { after, .. } = &mut record.past.events[3] {
        *after = steps;
    }
}

/// Files that were cut off or edited are refused, or are the past of some surface: none ends the game.
#[test]
fn f4_files_that_were_edited() {
    let mut app = app();
    let entity = spawn(&mut app, &small_preset(), 1);
    let mut rng = Rng::new(44);
    for _ in 0..6 {
        hit(&mut app, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())));
        steps(&mut app, 3);
    }
    let good = saved(&mut app, entity);
    assert!(good.validate().is_ok() && good.past.events.len() == 6, "{good:?}");
    // One number is wrong, the rest is as it was: each is refused before anything is made of it.
    let ([wide, high], last) = (good.past.extent.to_array(), good.past.events[5].after());
    let hit_with = |change: fn(&mut Vec2, &mut f32)| {
        move |record: &mut CrackRecord| match &mut record.past.events[3] {
            PastEvent::Hit { pos, energy, .. } => change(pos, energy),
            PastEvent::Removal { .. } => panic!("it is a hit"),
        }
    };
    let edits: [(&str, Box<dyn Fn(&mut CrackRecord)>); 29] = [
        ("version", Box::new(|record| record.version += 1)),
        ("version", Box::new(|record| record.version = 0)),
        ("time", Box::new(|record| record.time = f64::NAN)),
        ("time", Box::new(|record| record.time = f64::INFINITY)),
        ("time", Box::new(|record| record.time = -1e-9)),
        ("finite", Box::new(|record| record.around = Some(Vec3::new(0.0, f32::NAN, 0.0)))),
        ("finite", Box::new(|record| record.around = Some(Vec3::new(0.0, 0.0, f32::NEG_INFINITY)))),
        ("extent", Box::new(|record| record.past.extent.x = 0.0)),
        ("extent", Box::new(|record| record.past.extent.y = -1.0)),
        ("extent", Box::new(|record| record.past.extent.x = f32::NAN)),
        ("extent", Box::new(|record| record.past.extent.y = 65.0)),
        ("event 3 is", Box::new(hit_with(|pos, _| pos.x = f32::NAN))),
        ("event 3 is", Box::new(hit_with(|pos, _| pos.y = f32::NAN))),
        ("event 3 is", Box::new(hit_with(|pos, _| pos.x = -1e-6))),
        ("event 3 is", Box::new(hit_with(|pos, _| pos.y = -1e-6))),
        ("event 3 is", Box::new(move |record| hit_at(record, Vec2::new(1.001 * wide, 0.5)))),
        ("event 3 is", Box::new(move |record| hit_at(record, Vec2::new(0.5, 1.001 * high)))),
        ("event 3 is", Box::new(hit_with(|_, energy| *energy = 0.0))),
        ("event 3 is", Box::new(hit_with(|_, energy| *energy = -1.0))),
        ("event 3 is", Box::new(hit_with(|_, energy| *energy = f32::NAN))),
        ("event 3 is", Box::new(hit_with(|_, energy| *energy = f32::INFINITY))),
        ("event 4 comes", Box::new(|record| record.past.events.swap(3, 4))),
        ("event 4 comes", Box::new(move |record| hit_after(record, last))),
        ("event 3 comes", Box::new(|record| hit_after(record, 0))),
        ("event 3 comes", Box::new(|record| hit_after(record, u32::MAX))),
        ("event 5 comes", Box::new(|record| record.past.steps = record.past.events[5].after() - 1)),
        ("event 1 comes", Box::new(|record| record.past.steps = 0)),
        ("event 6 comes", Box::new(|record| record.past.events.push(PastEvent::Removal { after: 0, keep: 5 }))),
        (
            "more than 16384",
            Box::new(|record| {
                let last = record.past.events[5];
                record.past.events.resize(Past::MAX_EVENTS + 1, last);
            }),
        ),
    ];
    for (i, (named, edit)) in edits.iter().enumerate() {
        let mut record = good.clone();
        edit(&mut record);
        let refused = record.validate().expect_err("it is wrong").to_string();
        assert!(refused.contains(named), "edit {i}: {refused}");
    }
    // As many events as there may be, and a hit on the very corner, are no fault.
    let mut most = good.clone();
    hit_at(&mut most, good.past.extent);
    most.past.events.resize(Past::MAX_EVENTS, good.past.events[5]);
    assert_eq!(most.validate(), Ok(()));

    let text = serde_json::to_string(&good).expect("it can be written");
    let (mut n_read, mut n_valid) = (0, 0);
    for _ in 0..20_000 {
        let mut bytes = text.clone().into_bytes();
        for _ in 0..=rng.next_u32() % 3 {
            let at = rng.next_u32() as usize % bytes.len();
            match rng.next_u32() % 4 {
                0 => bytes.truncate(at.max(1)),
                1 => bytes[at] = b"0123456789-.e,[]{}\""[rng.next_u32() as usize % 19],
                2 => bytes.insert(at, b"0123456789-.eNa"[rng.next_u32() as usize % 15]),
                _ => _ = bytes.remove(at),
            }
            bytes.push(b' ');
        }
        let Ok(record) = serde_json::from_slice::<CrackRecord>(&bytes) else { continue };
        n_read += 1;
        if record.validate().is_err() {
            continue;
        }
        n_valid += 1;
        let mut growth = CrackGrowth::new(small_preset().growth, Vec2::new(1.0, 0.7), record.seed).unwrap();
        growth.replay(&record.past);
        (0..100).for_each(|_| _ = growth.step());
        assert!(growth.network().nodes().iter().all(|node| node.pos.is_finite()));
    }
    assert!(n_read > 500 && n_valid > 100 && n_valid < n_read, "{n_valid} of {n_read} are valid");
}

/// Healing, despawning and removing the component take a record back that is on its way; one waits for a picture that still loads.
#[test]
fn a_record_that_is_taken_back_leaves_nothing() {
    let mut app = app();
    let entity = spawn(&mut app, &CrackPreset::MUD, 1);
    assert_eq!(record(&mut app, entity), None);
    hit(&mut app, center(entity));
    settle(&mut app, entity);
    let record = saved(&mut app, entity);
    for way in 0..4 {
        let other = spawn(&mut app, &CrackPreset::MUD, 1);
        let whole = shown(&app, other);
        app.world_mut().entity_mut(other).insert(record.clone());
        let is_hidden = way == 3;
        if is_hidden {
            // It has nothing to show yet.
            app.world_mut().entity_mut(other).insert(Sprite::from_image(Handle::default()));
        }
        step(&mut app);
        match way {
            0 => _ = app.world_mut().commands().entity(other).heal_cracks(),
            1 => _ = app.world_mut().entity_mut(other).remove::<CrackRecord>(),
            2 => _ = app.world_mut().despawn(other),
            _ => _ = app.world_mut().entity_mut(other).remove::<Sprite>(),
        }
        steps(&mut app, 30);
        if way < 2 && state(&app, other) == CrackState::default() {
            assert!(shown(&app, other) == whole);
            assert_eq!(app.world().get::<BakeProgress>(other), Some(&BakeProgress(0.0)));
        }
    }
    let restored = spawn(&mut app, &CrackPreset::MUD, 1);
    app.world_mut().commands().entity(restored).heal_cracks().insert(record.clone());
    step(&mut app);
    wait_for(&mut app, "the record", |app| app.world().get::<CrackRecord>(restored).is_none());
    assert!(shown(&app, restored) == shown(&app, entity), "healed and loaded at once");
}
