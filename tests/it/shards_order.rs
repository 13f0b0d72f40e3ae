//! From a request to its shards: when they come, and what may happen in between.

use crate::{
    shards::{crack, cracked, loose, shards, shatter},
    support::*,
};
use bevy::prelude::*;
use bevy_crack::{prelude::*, shatter::Shards};
use std::{collections::BTreeSet, sync::Arc, thread, time::Duration};

fn ask(app: &mut App, entity: Entity, request: ShatterRequest) {
    app.world_mut().commands().entity(entity).shatter_cracks(request);
}

/// Area and centre of every piece that has left a surface: both tell it from all others.
fn gone(app: &mut App, surface: Entity) -> BTreeSet<[u32; 3]> {
    let all: Vec<Shard> = shards(app).iter().map(|shard| get::<Shard>(app, *shard)).collect();
    let key = |shard: &Shard| {
        let piece = shard.pieces.get(shard.number).expect("the piece");
        [piece.area, piece.centroid.x, piece.centroid.y].map(f32::to_bits)
    };
    all.iter().filter(|shard| shard.surface == surface).map(key).collect()
}

/// The holes are where the pieces were that are gone, and nowhere else.
fn assert_holes(app: &mut App, surface: Entity, size: UVec2) {
    let mut cuts: Vec<(Arc<Shards>, BTreeSet<u32>)> = Vec::new();
    for shard in shards(app) {
        let shard: Shard = get(app, shard);
        match cuts.iter_mut().find(|(cut, _)| Arc::ptr_eq(cut, &shard.pieces)) {
            Some((_, numbers)) => _ = numbers.insert(shard.number),
            None => cuts.push((shard.pieces, [shard.number].into())),
        }
    }
    let picture = shown(app, surface);
    for (i, texel) in picture.as_chunks::<4>().0.iter().enumerate() {
        let at = (Vec2::new((i as u32 % size.x) as f32, (i as u32 / size.x) as f32) + 0.5) / size.min_element() as f32;
        let is_gone = cuts.iter().any(|(cut, numbers)| cut.at(at).is_some_and(|number| numbers.contains(&number)));
        assert_eq!(texel[3] == 0, is_gone, "{at}");
    }
}

#[test]
fn shards_come_two_frames_later_whoever_makes_them() {
    let size = UVec2::splat(64);
    let run = |pause: Duration| {
        let mut app = app();
        let entity = cracked(&mut app, size, loose());
        for at in [0.0, 0.6] {
            ask(&mut app, entity, ShatterRequest::around(Vec2::splat(at), 0.1));
            let before = gone(&mut app, entity);
            for _ in 0..2 {
                step(&mut app);
                thread::sleep(pause);
                assert_eq!(gone(&mut app, entity), before);
            }
            step(&mut app);
            assert!(gone(&mut app, entity).len() > before.len());
            assert_holes(&mut app, entity, size);
        }
        let at: BTreeSet<String> =
            shards(&mut app).iter().map(|shard| format!("{:?}", get::<Transform>(&app, *shard))).collect();
        (gone(&mut app, entity), at, shown(&app, entity))
    };
    // A task that has all the time in the world, and one that has none.
    assert!(run(Duration::from_millis(60)) == run(Duration::ZERO), "the same shards");
}

#[test]
fn what_is_healed_meanwhile_stays_whole() {
    let mut app = app();
    let entity = cracked(&mut app, UVec2::splat(64), loose());
    for frames in 0..3 {
        ask(&mut app, entity, ShatterRequest::ALL);
        steps(&mut app, frames);
        app.world_mut().commands().entity(entity).heal_cracks();
        steps(&mut app, 1);
        crack(&mut app, entity);
        steps(&mut app, 4);
        assert!(shards(&mut app).is_empty(), "healed after {frames}");
    }
    ask(&mut app, entity, ShatterRequest::ALL);
    steps(&mut app, 1);
    app.world_mut().despawn(entity);
    steps(&mut app, 4);
    assert!(shards(&mut app).is_empty());
}

#[test]
fn a_hit_meanwhile_cuts_nothing_yet() {
    let mut app = app();
    let size = UVec2::splat(96);
    let [first, second] = [1, 2].map(|_| cracked(&mut app, size, loose()));
    shatter(&mut app, first, ShatterRequest::ALL);
    let expected = gone(&mut app, first);
    let request = ShatterRequest::around(Vec2::new(0.4, 0.6), 64.0);
    for frames in 1..3 {
        ask(&mut app, second, request);
        steps(&mut app, frames);
        hit(&mut app, CrackHit::uv(second, Vec2::new(0.8, 0.2)).with_energy(2.0));
        steps(&mut app, 5);
        assert_eq!(gone(&mut app, second), expected, "hit after {frames}");
        app.world_mut().commands().entity(second).heal_cracks();
        steps(&mut app, 2);
        crack(&mut app, second);
    }
    // A part leaves while more grows; then the rest, along the new cracks as well.
    ask(&mut app, second, ShatterRequest::around(Vec2::new(0.4, 0.6), 0.05));
    step(&mut app);
    hit(&mut app, CrackHit::uv(second, Vec2::new(0.8, 0.2)).with_energy(2.0));
    settle(&mut app, second);
    steps(&mut app, 3);
    let part = gone(&mut app, second);
    assert!(part.len() < expected.len() && part.is_subset(&expected));
    shatter(&mut app, second, ShatterRequest::ALL);
    let all = gone(&mut app, second);
    assert!(all.is_superset(&part) && all.len() > expected.len(), "{} {}", all.len(), expected.len());
    app.world_mut().despawn(first);
    step(&mut app);
    assert_holes(&mut app, second, size);
}

#[test]
fn what_returns_meanwhile_leaves_again() {
    let mut app = app();
    let size = UVec2::splat(96);
    let entity = cracked(&mut app, size, ShatterCracks { speed: 1.0, ..loose() });
    shatter(&mut app, entity, ShatterRequest::around(Vec2::splat(0.25), 0.05));
    steps(&mut app, 10);
    shatter(&mut app, entity, ShatterRequest::around(Vec2::splat(0.75), 0.05));
    let both = gone(&mut app, entity);
    steps(&mut app, 2);
    // The second part is back before the third leaves, which takes it along.
    app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = -1.0;
    ask(&mut app, entity, ShatterRequest::around(Vec2::splat(0.75), 0.05));
    steps(&mut app, 2);
    app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = -2.0;
    steps(&mut app, 1);
    assert!(gone(&mut app, entity).len() < both.len());
    app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = 0.0;
    // The holes that have closed are painted first.
    steps(&mut app, 1);
    assert_eq!(gone(&mut app, entity), both);
    assert_holes(&mut app, entity, size);
}

#[test]
fn requests_follow_one_another() {
    let mut app = app();
    let size = UVec2::splat(96);
    let entity = cracked(&mut app, size, loose());
    let corners = [0.1, 0.5, 0.9].map(|at| ShatterRequest::around(Vec2::splat(at), 0.05));
    corners.iter().for_each(|request| ask(&mut app, entity, *request));
    let mut counts = Vec::new();
    for _ in 0..8 {
        step(&mut app);
        counts.push(gone(&mut app, entity).len());
    }
    let mut different = counts.clone();
    different.dedup();
    assert!(counts[..2] == [0, 0] && counts[6] == counts[7] && different.len() == 4, "{counts:?}");
    assert_holes(&mut app, entity, size);
    let one_by_one = gone(&mut app, entity);
    let twin = cracked(&mut app, size, loose());
    for request in corners {
        shatter(&mut app, twin, request);
    }
    assert_eq!(gone(&mut app, twin), one_by_one);
}

#[test]
fn another_picture_meanwhile_is_shattered_all_the_same() {
    let mut app = app();
    let entity = cracked(&mut app, UVec2::splat(64), loose());
    let size = UVec2::new(80, 60);
    let other = add(&mut app, solid(size, [90, 120, 150, 255]));
    steps(&mut app, 2);
    ask(&mut app, entity, ShatterRequest::ALL);
    step(&mut app);
    app.world_mut().get_mut::<Sprite>(entity).unwrap().image = other;
    steps(&mut app, 6);
    assert!(!shards(&mut app).is_empty());
    assert_holes(&mut app, entity, size);
}
