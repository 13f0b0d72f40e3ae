//! How many shards there may be, what is kept for later ones, and that nothing is left of any.

use crate::{
    shards::{crack, cracked, loose, shards, shatter, stock, surface},
    support::*,
};
use bevy::prelude::*;
use bevy_crack::{
    prelude::*,
    shatter::{Anchor, BreakAgain, BurstParams, ShatterParams, SizeClasses},
};
use std::{
    collections::BTreeSet,
    time::{Duration, Instant},
};

/// Area and centre of every piece that is shown: both tell it from all others.
fn pieces(app: &mut App) -> BTreeSet<[u32; 3]> {
    let key = |shard: Shard| {
        let piece = shard.pieces.get(shard.number).expect("the piece");
        [piece.area, piece.centroid.x, piece.centroid.y].map(f32::to_bits)
    };
    shards(app).into_iter().map(|shard| key(get::<Shard>(app, shard))).collect()
}

/// A pane with more than 500 pieces.
fn many(app: &mut App, settings: ShatterCracks) -> Entity {
    let image = add(app, picture(UVec2::splat(256)));
    let entity = app.world_mut().spawn((Sprite::from_image(image), surface(), settings)).id();
    for i in 0..64 {
        let at = Vec2::new(0.06 + 0.125 * (i % 8) as f32, 0.07 + 0.123 * (i / 8) as f32);
        hit(app, CrackHit::uv(entity, at).with_energy(2.0));
    }
    settle(app, entity);
    step(app);
    entity
}

fn set(app: &mut App, entity: Entity, change: impl FnOnce(&mut ShatterCracks)) {
    change(&mut app.world_mut().get_mut::<ShatterCracks>(entity).expect("the settings"));
}

/// Number of shards in this frame, which adds up with what surfaces say.
fn count(app: &mut App) -> usize {
    let told: u32 = app.world_mut().query::<&CrackShards>().iter(app.world()).map(|told| told.shown).sum();
    let n = shards(app).len();
    assert_eq!(n, told as usize);
    n
}

#[test]
fn s1_shards_that_crack_leave_nothing() {
    let mut app = app();
    app.add_observer(|done: On<Shattered>, mut commands: Commands| {
        for shard in &done.shards {
            commands.entity(*shard).insert(CrackSurface::new(CrackPreset::GLASS));
            commands.trigger(CrackHit::uv(*shard, Vec2::splat(0.5)));
        }
    });
    let before = stock(&app);
    let speeds = [Some(-2.0), None, Some(1.0)];
    for speed in speeds {
        let entity = cracked(&mut app, UVec2::splat(64), ShatterCracks { speed: 1.0, ..loose() });
        shatter(&mut app, entity, ShatterRequest::ALL);
        steps(&mut app, 30);
        let textures = app.world_mut().query::<(&Shard, &CrackTextures)>().iter(app.world()).count();
        assert!(textures > 5, "{textures} shards have cracked");
        match speed {
            // They return, or fade, or go with their surface.
            Some(speed) => {
                set(&mut app, entity, |settings| settings.speed = speed);
                steps(&mut app, 250);
                assert!(shards(&mut app).is_empty());
                app.world_mut().commands().entity(entity).heal_cracks();
            }
            None => _ = app.world_mut().despawn(entity),
        }
        steps(&mut app, 2);
        if speed.is_some() {
            assert!(stock(&app)[0] <= before[0] + 1, "only the surface is left: {:?} {before:?}", stock(&app));
            app.world_mut().despawn(entity);
            steps(&mut app, 2);
        }
        assert_eq!(stock(&app), before, "{speed:?}");
    }
}

/// Whoever is told of what happens may ask for anything.
#[test]
fn s2_what_is_asked_for_meanwhile_is_done() {
    #[derive(Resource)]
    struct Victims([Entity; 3]);

    fn strike(world: &mut World, what: u32) {
        let Some(Victims([first, second, third])) = world.get_resource() else { return };
        let (first, second, third) = (*first, *second, *third);
        let mut commands = world.commands();
        match what {
            0 => _ = commands.get_entity(first).map(|mut entity| _ = entity.heal_cracks()),
            1 => _ = commands.get_entity(second).map(|mut entity| entity.try_despawn()),
            2 => _ = commands.get_entity(second).map(|mut entity| _ = entity.close_cracks(0.0)),
            3 => _ = commands.get_entity(first).map(|mut entity| _ = entity.try_remove::<CrackSurface>()),
            _ => _ = commands.get_entity(third).map(|mut entity| _ = entity.shatter_cracks(ShatterRequest::ALL)),
        }
    }

    for what in 0..5 {
        for moment in 0..4 {
            let mut app = app();
            let before = stock(&app);
            let hear = move |now: u32| {
                move |world: &mut World| {
                    if now == moment {
                        strike(world, what);
                    }
                }
            };
            app.add_observer(move |_: On<Add, Shard>, mut commands: Commands| commands.queue(hear(0)));
            app.add_observer(move |_: On<Remove, Shard>, mut commands: Commands| commands.queue(hear(1)));
            app.add_observer(move |_: On<Insert, CrackShards>, mut commands: Commands| {
                commands.queue(hear(2));
            });
            app.add_observer(move |_: On<Shattered>, mut commands: Commands| commands.queue(hear(3)));
            let burst = BurstParams { hold: 0.0, fade_after: 0.1, fade: 0.1, ..BurstParams::DEFAULT };
            let settings = ShatterCracks { speed: 1.0, burst, ..loose() };
            let all = [0; 3].map(|_| cracked(&mut app, UVec2::splat(48), settings.clone()));
            app.insert_resource(Victims(all));
            let [first, second, third] = all;
            shatter(&mut app, second, ShatterRequest::around(Vec2::splat(0.5), 0.2));
            shatter(&mut app, first, ShatterRequest::ALL);
            steps(&mut app, 30);
            let is_whole = |app: &App, entity: Entity| app.world().get::<CrackTextures>(entity).is_none();
            match what {
                0 | 3 => assert!(is_whole(&app, first), "{what} at {moment}"),
                1 => assert!(app.world().get_entity(second).is_err()),
                2 => assert!(is_whole(&app, second), "{what} at {moment}"),
                _ => assert!(app.world().get::<CrackShards>(third).is_some(), "{what} at {moment}"),
            }
            app.world_mut().remove_resource::<Victims>();
            for entity in all {
                app.world_mut().try_despawn(entity).ok();
            }
            steps(&mut app, 3);
            assert_eq!(stock(&app)[1..], before[1..], "{what} at {moment}");
            counts(&app);
        }
    }
}

#[test]
fn s4_few_are_kept_while_none_is_shown() {
    let mut app = app();
    let burst = BurstParams { hold: 0.0, fade_after: 0.1, fade: 0.1, ..BurstParams::DEFAULT };
    let settings = ShatterCracks { speed: 1.0, burst, ..loose() };
    let broken = cracked(&mut app, UVec2::splat(64), settings.clone());
    shatter(&mut app, broken, ShatterRequest::around(Vec2::splat(0.5), 0.05));
    steps(&mut app, 40);
    let entity = many(&mut app, settings);
    let before = stock(&app);
    for _ in 0..3 {
        shatter(&mut app, entity, ShatterRequest::ALL);
        let n = count(&mut app);
        assert!(n > 500, "{n}");
        assert!(stock(&app)[0] - before[0] <= n);
        steps(&mut app, 60);
        assert_eq!(count(&mut app), 0);
        let now = stock(&app);
        assert!(now[0] <= before[0] + 256 && now[1] <= before[1] + 256, "{before:?} {now:?}");
        set(&mut app, entity, |settings| (settings.seek, settings.speed) = (Some(0.0), -1.0));
        steps(&mut app, 3);
        set(&mut app, entity, |settings| settings.speed = 1.0);
    }
    // Some in each frame where frames are short.
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 2.0;
    for entity in [broken, entity] {
        app.world_mut().commands().entity(entity).heal_cracks();
    }
    let mut last = stock(&app);
    for _ in 0..20 {
        step(&mut app);
        let now = stock(&app);
        assert!(now[0] <= last[0] && now[0] + 64 >= last[0], "{last:?} {now:?}");
        last = now;
    }
    assert_eq!(last[1], 0, "all meshes are gone");
}

#[test]
fn s5_there_are_no_more_shards_than_the_budget_says() {
    let most = 60;
    let again =
        BreakAgain { classes: SizeClasses { largest: [0.0005, 0.003, 0.02] }, after: 0.1, ..BreakAgain::DEFAULT };
    let settings = ShatterCracks { speed: 1.0, again: Some(again), ..loose() };
    let run = |budget: f32| {
        let mut app = app();
        let panes = [0; 3].map(|_| cracked(&mut app, UVec2::splat(96), settings.clone()));
        let before = stock(&app);
        *app.world_mut().resource_mut::<CrackBudget>() =
            CrackBudget { max_shards: most, milliseconds: budget, ..default() };
        let mut seen = Vec::new();
        let mut check = |app: &mut App, n: usize| {
            for _ in 0..n {
                step(app);
                let shown = count(app);
                assert!(shown <= most, "{shown} shards");
                // And those that are kept.
                let entities = stock(app)[0] - before[0];
                assert!(entities <= most, "{entities} entities");
                seen.push(pieces(app));
            }
        };
        for (i, pane) in panes.into_iter().enumerate() {
            app.world_mut().commands().entity(pane).shatter_cracks(ShatterRequest::ALL);
            check(&mut app, 5 + 10 * i);
            // In short frames they come when they are made.
            let start = Instant::now();
            while budget < 1000.0 && app.world().get::<CrackShards>(pane).is_none() {
                assert!(start.elapsed() < Duration::from_secs(30), "they never come");
                check(&mut app, 1);
            }
            assert!(get::<CrackShards>(&app, pane).pieces.len() <= most, "fewer and larger ones");
        }
        // One that has room breaks again.
        check(&mut app, 60);
        for time in [0.0, 0.5, 1e6, 0.3, 0.7] {
            for pane in panes {
                set(&mut app, pane, |settings| settings.seek = Some(time));
            }
            check(&mut app, 4);
        }
        for pane in panes {
            app.world_mut().despawn(pane);
        }
        steps(&mut app, 3);
        assert_eq!(stock(&app)[1], 0);
        seen
    };
    assert!(run(1e6) == run(1e6), "the same whenever the same happens");
    run(2.0);
}

/// With room for some of them some break again, and time shows the same pieces whichever way it has come.
#[test]
fn s5_pieces_without_room_stay_whole() {
    let mut app = app();
    let again = BreakAgain { after: 0.1, ..BreakAgain::DEFAULT };
    let burst = BurstParams { fade_after: 60.0, ..BurstParams::DEFAULT };
    let entity =
        cracked(&mut app, UVec2::splat(64), ShatterCracks { speed: 1.0, again: Some(again), burst, ..loose() });
    shatter(&mut app, entity, ShatterRequest::ALL);
    let whole = count(&mut app);
    let area = |app: &mut App| shards(app).iter().map(|shard| get::<Shard>(app, *shard).area()).sum::<f32>();
    let first = area(&mut app);
    let most = whole + 30;
    app.world_mut().resource_mut::<CrackBudget>().max_shards = most;
    let mut now = 0;
    for _ in 0..100 {
        step(&mut app);
        now = count(&mut app);
        assert!(now <= most);
        assert!((area(&mut app) - first).abs() < 1e-3 * first, "nothing is lost");
    }
    assert!(now > whole, "some have broken again");
}

#[test]
fn s6_no_frame_makes_thousands() {
    let mut app = app();
    #[derive(Resource, Default)]
    struct Told(Vec<(usize, u32)>);
    app.init_resource::<Told>();
    app.add_observer(|done: On<Shattered>, mut told: ResMut<Told>| told.0.push((done.shards.len(), done.rest)));
    let entity = many(&mut app, ShatterCracks { anchor: Anchor::Border, ..loose() });
    shatter(&mut app, entity, ShatterRequest::EVERYTHING);
    let (at_once, picture) = (pieces(&mut app), shown(&app, entity));
    let told = core::mem::take(&mut app.world_mut().resource_mut::<Told>().0);
    assert_eq!(told, [(at_once.len(), 0)]);
    assert!(at_once.len() > 600, "{}", at_once.len());
    set(&mut app, entity, |settings| (settings.seek, settings.speed) = (Some(0.0), -1.0));
    steps(&mut app, 3);
    let whole = shown(&app, entity);
    assert!(shards(&mut app).is_empty());

    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 2.0;
    set(&mut app, entity, |settings| settings.speed = 1.0);
    let ask = |app: &mut App| {
        app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::EVERYTHING);
        // So many cracks take more than two frames, and as many as it takes to make their shards.
        let mut frames = 0;
        while shards(app).is_empty() {
            step(app);
            frames += 1;
        }
        assert!(frames >= 4, "{frames}");
    };
    // Time runs back before all have left.
    ask(&mut app);
    assert_eq!(count(&mut app), 256);
    set(&mut app, entity, |settings| settings.speed = -1.0);
    steps(&mut app, 30);
    assert!(shards(&mut app).is_empty() && app.world().get::<CrackShards>(entity).is_none());
    assert!(shown(&app, entity) == whole, "whole, bit for bit");
    // It is healed before.
    ask(&mut app);
    assert_eq!(count(&mut app), 256);
    app.world_mut().commands().entity(entity).heal_cracks();
    steps(&mut app, 3);
    assert!(shards(&mut app).is_empty());

    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 1e6;
    app.world_mut().despawn(entity);
    let entity = many(&mut app, ShatterCracks { anchor: Anchor::Border, ..loose() });
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 2.0;
    app.world_mut().resource_mut::<Told>().0.clear();
    let mut before = pieces(&mut app);
    app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::EVERYTHING);
    let (mut frames, start) = (0, Instant::now());
    while pieces(&mut app).len() < at_once.len() {
        step(&mut app);
        let now = pieces(&mut app);
        assert!(before.is_subset(&now) && now.len() - before.len() <= 256, "{} {}", before.len(), now.len());
        // The holes are where the shards were, no further.
        let gone = shown(&app, entity).as_chunks::<4>().0.iter().filter(|texel| texel[3] == 0).count() as f32;
        let area: f32 = shards(&mut app).iter().map(|shard| get::<Shard>(&app, *shard).area()).sum();
        assert!((gone - area).abs() < 0.02 * area.max(50.0), "{gone} {area}");
        // The first come when they are made.
        frames += u32::from(!now.is_empty());
        before = now;
        assert!(frames < 20 && start.elapsed() < Duration::from_secs(30), "it never ends");
    }
    assert!(before == at_once && shown(&app, entity) == picture, "the same in the end");
    let told = core::mem::take(&mut app.world_mut().resource_mut::<Told>().0);
    let sum: usize = told.iter().map(|(n, _)| n).sum();
    assert_eq!(sum, at_once.len());
    for (i, (_, rest)) in told.iter().enumerate() {
        let later: usize = told[i + 1..].iter().map(|(n, _)| n).sum();
        assert_eq!(*rest as usize, later);
    }
    // Time jumps to where all are: some more in each frame as well.
    set(&mut app, entity, |settings| settings.seek = Some(1e5));
    step(&mut app);
    assert!(shards(&mut app).is_empty());
    set(&mut app, entity, |settings| settings.seek = Some(0.2));
    let mut last = 0;
    while last < at_once.len() {
        step(&mut app);
        let now = count(&mut app);
        assert!(now - last <= 256 && now > last, "{last} {now}");
        last = now;
    }
}

/// A surface under parents that turn, scale and mirror it, whose pieces merely fall.
#[test]
fn s7_shards_fall_down_in_the_world() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::new(96, 64)));
    let quad = add(&mut app, Mesh::from(Rectangle::new(3.0, 2.0)));
    let floor = add(&mut app, Mesh::from(Plane3d::new(Vec3::Y, Vec2::new(3.0, 2.0))));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image.clone()), ..default() });
    let burst =
        BurstParams { hold: 0.0, speed: 0.0, scatter: 0.0, spin: 0.0, fade_after: 60.0, ..BurstParams::DEFAULT };
    let places = [
        Transform::default(),
        Transform::from_rotation(Quat::from_rotation_z(2.0)),
        Transform::from_rotation(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2))
            .with_scale(Vec3::new(-2.0, 1.5, 1.0)),
        Transform::from_scale(Vec3::new(1.0, -1.0, 1.0)),
        Transform::from_scale(Vec3::new(2.0, 2.0, 0.0)),
    ];
    let parents = [
        Transform::default(),
        Transform::from_rotation(Quat::from_rotation_z(-1.0)).with_scale(Vec3::new(-1.5, 2.0, 1.0)),
    ];
    for gravity in [GravitySpace::World, GravitySpace::Surface] {
        for (place, parent) in places.iter().flat_map(|place| parents.iter().map(move |parent| (*place, *parent))) {
            for kind in 0..3 {
                let settings = ShatterCracks { speed: 1.0, burst, gravity, ..loose() };
                let is_floor = kind == 2;
                if is_floor && place.scale.z == 0.0 {
                    continue;
                }
                let parent = app.world_mut().spawn((parent, Visibility::default())).id();
                let surface = (place, surface(), settings, ChildOf(parent));
                let entity = match kind {
                    0 => app
                        .world_mut()
                        .spawn((Sprite { flip_x: true, ..Sprite::from_image(image.clone()) }, surface))
                        .id(),
                    _ => {
                        let mesh = if is_floor { floor.clone() } else { quad.clone() };
                        app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material.clone()), surface)).id()
                    }
                };
                crack(&mut app, entity);
                shatter(&mut app, entity, ShatterRequest::ALL);
                let all = shards(&mut app);
                assert!(all.len() > 3);
                let at = |app: &App| -> Vec<Vec3> {
                    all.iter().map(|shard| get::<GlobalTransform>(app, *shard).translation()).collect()
                };
                let before = at(&app);
                // The last of them starts after 18, or a frame later if a background task took long.
                steps(&mut app, 30);
                let turned = !is_floor && (place.rotation != Quat::IDENTITY || place.scale.y < 0.0);
                for (before, now) in before.into_iter().zip(at(&app)) {
                    let way = now - before;
                    assert!(way.length() > 1e-2, "it falls: {way}");
                    let straight = way.normalize().distance(Vec3::NEG_Y) < 1e-3;
                    match gravity {
                        GravitySpace::World => assert!(straight, "{place:?} {kind}: {way}"),
                        GravitySpace::Surface if turned || is_floor => assert!(!straight, "{place:?} {kind}: {way}"),
                        GravitySpace::Surface => {}
                    }
                    if is_floor && gravity == GravitySpace::Surface {
                        assert!(way.normalize().y.abs() < 1e-3, "along the floor");
                    }
                }
                app.world_mut().despawn(parent);
                step(&mut app);
            }
        }
    }
}

/// Pieces that are turned with their surface after it has shattered go along; time runs back all the same.
#[test]
fn s7_shards_come_to_rest_on_the_floor() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::new(96, 64)));
    let quad = add(&mut app, Mesh::from(Rectangle::new(3.0, 2.0)));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image.clone()), ..default() });
    let burst = BurstParams { fade_after: 60.0, drag: 0.5, ..BurstParams::DEFAULT };
    let turned = Transform::from_xyz(1.0, 4.0, 2.0).with_rotation(Quat::from_euler(EulerRot::XYZ, 0.7, 1.0, 0.3));
    for (place, parent) in [
        (Transform::default(), Transform::default()),
        (turned.with_scale(Vec3::new(-1.5, 2.0, 1.2)), Transform::from_scale(Vec3::splat(0.7))),
    ] {
        for is_wall in [false, true] {
            let height = if is_wall { -3.0 } else { -80.0 };
            let thickness = 0.05;
            let settings =
                ShatterCracks { speed: 1.0, burst, floor: Some(height), thickness, again: Some(default()), ..loose() };
            let parent = app.world_mut().spawn((parent, Visibility::default())).id();
            let surface = (place, surface(), settings, ChildOf(parent));
            let entity = if is_wall {
                app.world_mut().spawn((Mesh3d(quad.clone()), MeshMaterial3d(material.clone()), surface)).id()
            } else {
                app.world_mut().spawn((Sprite::from_image(image.clone()), surface)).id()
            };
            crack(&mut app, entity);
            shatter(&mut app, entity, ShatterRequest::ALL);
            // They stay where they are from now on, as long as they are shown.
            steps(&mut app, 600);
            let all = shards(&mut app);
            let at = |app: &App| -> Vec<GlobalTransform> { all.iter().map(|shard| get(app, *shard)).collect() };
            let before = at(&app);
            steps(&mut app, 10);
            let now = at(&app);
            let moved = before.iter().zip(&now).map(|(a, b)| a.translation().distance(b.translation()));
            let moved = moved.fold(0.0, f32::max);
            assert!(all.len() > 3 && moved < 1e-2, "{} shards, {moved}", all.len());
            for place in now {
                let up = place.translation().y - height;
                let most = if is_wall { 2.0 * thickness * 2.0 * 2.0 } else { 64.0 };
                assert!((-1e-2..most).contains(&up), "{up} above the floor, {is_wall} {place:?}");
            }
            set(&mut app, entity, |settings| settings.speed = -8.0);
            steps(&mut app, 200);
            assert!(shards(&mut app).is_empty(), "they fly back");
            app.world_mut().despawn(parent);
        }
    }
}

#[test]
fn s7_what_turns_later_takes_its_shards_along() {
    let mut app = app();
    let entity = cracked(&mut app, UVec2::splat(64), ShatterCracks { speed: 1.0, ..loose() });
    let whole = shown(&app, entity);
    shatter(&mut app, entity, ShatterRequest::ALL);
    let locals = |app: &mut App| -> Vec<Transform> {
        shards(app).into_iter().map(|shard| get::<Transform>(app, shard)).collect()
    };
    steps(&mut app, 10);
    let before = locals(&mut app);
    set(&mut app, entity, |settings| settings.speed = 0.0);
    app.world_mut().get_mut::<Transform>(entity).expect("its place").rotation = Quat::from_rotation_z(1.0);
    steps(&mut app, 3);
    assert_eq!(locals(&mut app), before);
    set(&mut app, entity, |settings| settings.speed = -2.0);
    steps(&mut app, 20);
    assert!(shards(&mut app).is_empty() && shown(&app, entity) == whole);
}

#[test]
fn s9_everything_goes() {
    let mut app = app();
    // Held on all sides; a few cracks cut nothing out, or pieces in the middle, unless they are carried on.
    let cases = [
        (CrackPreset::GLASS, true, 1.0),
        (CrackPreset::GLASS, false, 1.0),
        (CrackPreset::GLASS, false, 4.0),
        (CrackPreset::BRICK, true, 1.0),
    ];
    for (preset, extend_cracks, energy) in cases {
        let cut = ShatterParams { extend_cracks, ..ShatterParams::DEFAULT };
        let settings = ShatterCracks { cut, anchor: Anchor::Border, ..loose() };
        let image = add(&mut app, picture(UVec2::new(96, 64)));
        let surface = CrackSurface::new(preset).with_seed(4);
        let entity = app.world_mut().spawn((Sprite::from_image(image), surface, settings)).id();
        hit(&mut app, CrackHit::uv(entity, Vec2::new(0.3, 0.4)).with_energy(energy));
        settle(&mut app, entity);
        let left = |app: &App| shown(app, entity).as_chunks::<4>().0.iter().filter(|texel| texel[3] != 0).count();
        if extend_cracks || energy > 1.0 {
            shatter(&mut app, entity, ShatterRequest::ALL);
            assert!(left(&app) > 0, "something is held");
        }
        shatter(&mut app, entity, ShatterRequest::EVERYTHING);
        assert_eq!(left(&app), 0, "nothing stays");
        let all: f32 = shards(&mut app).iter().map(|shard| get::<Shard>(&app, *shard).area()).sum();
        assert!((all - 96.0 * 64.0).abs() < 1.0, "{all}");
        assert!(shards(&mut app).len() > 1, "in pieces");
        app.world_mut().despawn(entity);
        step(&mut app);
    }
}
