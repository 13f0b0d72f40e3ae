//! Hits that are broken, and hits that are many: the faults I1 to I10 of the reliability list, through real apps.

use crate::support::*;
use bevy::prelude::*;
use bevy_crack::{growth::StartLayout, math::Rng, prelude::*};

const MIDDLE: Vec2 = Vec2::splat(0.5);

/// A surface of small cracks on a picture that all of them share.
fn spawn_small(app: &mut App, image: &Handle<Image>, seed: u64) -> Entity {
    let surface = CrackSurface::new(small_preset()).with_seed(seed);
    app.world_mut().spawn((Sprite::from_image(image.clone()), surface)).id()
}

#[test]
fn i1_numbers_that_are_not_finite_are_refused() {
    let mut app = app();
    single_threaded(&mut app);
    let [entity, other] = [(); 2].map(|()| spawn_picture(&mut app, UVec2::splat(48)));
    let (before, untouched) = (shown(&app, entity), shown(&app, other));
    let mut sent = 0;
    let heard = warnings(|| {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let hits = [
                CrackHit::uv(entity, Vec2::new(bad, 0.5)),
                CrackHit::uv(entity, Vec2::new(0.5, bad)),
                CrackHit::local(entity, Vec3::new(0.0, bad, 0.0)),
                CrackHit::world(entity, Vec3::new(0.0, 0.0, bad)),
                center(entity).with_energy(bad),
                center(entity).with_direction(Vec3::new(bad, 0.0, 0.0)),
            ];
            for (i, bad_hit) in hits.into_iter().enumerate() {
                if i % 2 == 0 {
                    hit(&mut app, bad_hit);
                } else {
                    app.world_mut().write_message(bad_hit);
                }
                sent += 1;
            }
            let stats = step(&mut app);
            assert_eq!((stats.sent, stats.rejected), (sent, sent));
        }
    });
    assert_eq!(heard.len(), 1, "one warning for the surface: {heard:?}");
    assert_eq!(shown(&app, entity), before, "the picture stands");
    assert_eq!(state(&app, entity).status, CrackStatus::Untouched);
    assert_cracks(&mut app, entity);
    assert_eq!((shown(&app, other), state(&app, other)), (untouched, CrackState::default()));
}

#[test]
fn i1_any_bits_at_all() {
    let mut app = app();
    // None is merged with another before it is looked at.
    app.world_mut().resource_mut::<CrackBudget>().max_queued_per_surface = 10_000;
    let entity = spawn_picture(&mut app, UVec2::splat(32));
    let mut rng = Rng::new(1);
    let mut any = || f32::from_bits(rng.next_u32());
    // What is no number, below zero, off the surface; what does nothing; what lands.
    let (mut refused, mut ignored, mut landing) = ([0u64; 3], 0, 0);
    for _ in 0..100 {
        for _ in 0..100 {
            let point = Vec3::new(any(), any(), any());
            // The sprite stands at the origin, a texel for each unit. Its picture has no depth.
            let on_sprite = point.truncate().abs().max_element() <= 16.0;
            let (any_hit, is_number, is_on) = match any().to_bits() % 3 {
                0 => {
                    let (uv, on) = (point.truncate(), 0.0..=1.0);
                    (CrackHit::uv(entity, uv), uv.is_finite(), on.contains(&uv.x) && on.contains(&uv.y))
                }
                1 => (CrackHit::local(entity, point), point.is_finite(), on_sprite),
                _ => (CrackHit::world(entity, point), point.is_finite(), on_sprite),
            };
            let (energy, direction) = (any(), Vec3::new(any(), any(), any()));
            match (is_number && energy.is_finite() && direction.is_finite(), energy) {
                (false, _) => refused[0] += 1,
                (true, energy) if energy < 0.0 => refused[1] += 1,
                (true, 0.0) => ignored += 1,
                (true, _) if !is_on => refused[2] += 1,
                (true, _) => landing += 1,
            }
            hit(&mut app, any_hit.with_energy(energy).with_direction(direction));
        }
        step(&mut app);
    }
    wait_for(&mut app, "all hits", |app| counts(app).queued == 0);
    let stats = counts(&app);
    println!("{refused:?} refused, {landing} land");
    assert!(landing > 100 && refused.iter().all(|n| *n > 100), "{landing} {refused:?}");
    let seen = (stats.sent, stats.rejected, stats.ignored, stats.applied + stats.merged);
    assert_eq!(seen, (10_000, refused.iter().sum::<u64>(), ignored, landing), "{refused:?}");
    hit(&mut app, center(entity));
    settle(&mut app, entity);
}

#[test]
fn i2_huge_numbers_are_capped_or_off_the_surface() {
    let run = |energy: f32| {
        let mut app = app();
        let entity = spawn_picture(&mut app, UVec2::splat(48));
        hit(&mut app, center(entity).with_energy(energy));
        settle(&mut app, entity);
        assert_eq!(counts(&app).applied, 1);
        shown(&app, entity)
    };
    let capped = run(16.0);
    assert_eq!(run(1e30), capped);
    assert_eq!(run(f32::MAX), capped);

    // Where floats of the world lie a unit apart, a hit still lands on the texel it was aimed at.
    let mut app = app();
    let at = Vec3::new(1e7, -1e7, 0.0);
    let entity = spawn_picture(&mut app, UVec2::splat(48));
    app.world_mut().entity_mut(entity).insert(Transform::from_translation(at));
    hit(&mut app, CrackHit::world(entity, at));
    for far in [1e30, f32::MAX, -1e30, 1e7] {
        hit(&mut app, CrackHit::world(entity, Vec3::splat(far)));
        hit(&mut app, CrackHit::local(entity, Vec3::splat(far)));
        hit(&mut app, CrackHit::uv(entity, Vec2::splat(far)));
    }
    settle(&mut app, entity);
    let stats = counts(&app);
    assert_eq!((stats.applied, stats.rejected), (1, 12));
}

#[test]
fn i3_edges_belong_to_the_surface_holes_and_what_lies_beyond_do_not() {
    let mut app = app();
    let size = UVec2::new(64, 48);
    let entity = spawn_picture(&mut app, size);
    let half = size.as_vec2() / 2.0;
    let corners = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];
    for corner in corners {
        hit(&mut app, CrackHit::uv(entity, corner));
    }
    hit(&mut app, CrackHit::world(entity, half.extend(0.0)));
    settle(&mut app, entity);
    let stats = counts(&app);
    assert_eq!((stats.applied, stats.merged, stats.rejected), (4, 1, 0), "corners are on the surface: {stats:?}");
    for off in [Vec2::new(-0.001, 0.5), Vec2::new(1.001, 0.5), Vec2::new(0.5, -0.001), Vec2::new(0.5, 1.001)] {
        hit(&mut app, CrackHit::uv(entity, off));
    }
    hit(&mut app, CrackHit::world(entity, Vec3::new(half.x + 0.1, 0.0, 0.0)));
    assert_eq!(step(&mut app).rejected, 5);

    // A hole in the middle, and the same picture where holes do not count.
    let mut holed = picture(size);
    for (i, texel) in holed.data.as_mut().unwrap().chunks_mut(4).enumerate() {
        let at = UVec2::new(i as u32 % size.x, i as u32 / size.x).as_ivec2() - size.as_ivec2() / 2;
        texel[3] = if at.length_squared() < 100 { 0 } else { 255 };
    }
    let alpha = |data: &[u8]| data.iter().skip(3).step_by(4).copied().collect::<Vec<_>>();
    let before = alpha(holed.data.as_ref().unwrap());
    let holed = add(&mut app, holed);
    let masked = spawn_sprite(&mut app, &holed);
    let plain = spawn_sprite(&mut app, &holed);
    app.world_mut().get_mut::<CrackSurface>(plain).unwrap().alpha_mask = false;
    hit(&mut app, center(masked));
    hit(&mut app, center(plain));
    let stats = step(&mut app);
    assert_eq!((stats.applied, stats.rejected), (5, 6), "only the mask refuses");
    hit(&mut app, CrackHit::uv(masked, Vec2::splat(0.1)));
    settle(&mut app, masked);
    settle(&mut app, plain);
    assert_eq!(alpha(&shown(&app, masked)), before, "holes stay holes");
}

#[test]
fn i4_no_energy_does_nothing_and_less_is_refused() {
    let mut app = app();
    let entity = spawn_picture(&mut app, UVec2::splat(48));
    let before = shown(&app, entity);
    for energy in [0.0, -0.0] {
        hit(&mut app, center(entity).with_energy(energy));
    }
    for energy in [-1.0, -f32::MIN_POSITIVE, -1e30] {
        hit(&mut app, center(entity).with_energy(energy));
    }
    let stats = step(&mut app);
    assert_eq!((stats.ignored, stats.rejected), (2, 3));
    assert_eq!((shown(&app, entity), state(&app, entity).status), (before, CrackStatus::Untouched));

    // The least that is more than nothing.
    hit(&mut app, center(entity).with_energy(1e-40));
    settle(&mut app, entity);
    assert_eq!(counts(&app).applied, 1);

    // Radii and counts of zero and below: the preset is refused, in words.
    let image = image_of(&app, entity);
    for break_it in [
        (|p: &mut CrackPreset| p.growth.reach = -1.0) as fn(&mut CrackPreset),
        |p| p.growth.num_lines_grid = 0,
        |p| p.growth.starts = StartLayout::Ring { count: 0, radius: 0.1 },
        |p| p.growth.line_width = 0.0,
    ] {
        let mut preset = CrackPreset::CONCRETE;
        break_it(&mut preset);
        let entity = app.world_mut().spawn((Sprite::from_image(image.clone()), CrackSurface::new(preset))).id();
        hit(&mut app, center(entity));
        step(&mut app);
        let status = state(&app, entity).status;
        assert!(matches!(status, CrackStatus::Failed(CrackError::Preset { .. })), "{status:?}");
    }
}

#[test]
fn i5_ten_thousand_hits_on_one_point_cost_no_more_than_the_first() {
    let mut app = app();
    let entity = spawn_picture(&mut app, UVec2::splat(96));
    let thousand = |app: &mut App| {
        for _ in 0..1000 {
            hit(app, center(entity));
        }
        step(app)
    };
    // All are worked off in the frame they come in: what merges lays out no markers and starts no crack.
    assert_eq!(thousand(&mut app).queued, 0);
    for _ in 0..8 {
        thousand(&mut app);
    }
    settle(&mut app, entity);
    let (before, seen) = (state(&app, entity), shown(&app, entity));
    thousand(&mut app);
    settle(&mut app, entity);
    let stats = counts(&app);
    assert_eq!((stats.sent, stats.applied, stats.merged, stats.queued), (10_000, 1, 9999, 0));
    let after = state(&app, entity);
    assert!(after.hits == 10_000 && after.nodes <= CrackPreset::CONCRETE.growth.max_nodes, "{after:?}");
    println!("{} nodes after 9,000 hits, {} after 10,000", before.nodes, after.nodes);
    assert!(after.nodes >= before.nodes && (after.nodes > before.nodes || seen == shown(&app, entity)));
}

/// Frames have no time at all here, so that each does the least it may, which the clock of this machine has no part in: a hit that
/// starts a crack and one slice of markers, a step of growth, a surface.
#[test]
fn i6_ten_thousand_hits_in_one_frame_stay_in_the_budget() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
    let entity = spawn_picture(&mut app, UVec2::splat(128));
    steps(&mut app, 3);
    let mut rng = Rng::new(6);
    for _ in 0..10_000 {
        hit(&mut app, CrackHit::uv(entity, Vec2::new(rng.unit(), rng.unit())));
    }
    let (mut before, mut most, mut n_frames) = (counts(&app), [0; 3], 0);
    let mut nodes = 0;
    while before.queued > 0 || n_frames == 0 {
        let after = step(&mut app);
        if n_frames == 0 {
            assert_eq!((after.sent, after.rejected), (10_000, 0));
        }
        let now = state(&app, entity).nodes + state(&app, entity).frozen;
        let done = [after.applied - before.applied, after.merged - before.merged, u64::from(now.saturating_sub(nodes))];
        for (most, done) in most.iter_mut().zip(done) {
            *most = done.max(*most);
        }
        (before, nodes) = (after, now);
        n_frames += 1;
        assert!(n_frames <= 80_000, "the queue does not drain: {after:?}");
    }
    let [applied, merged, born] = most;
    println!("{n_frames} frames; at most {applied} hits applied, {merged} merged, {born} nodes in one of them");
    // Hits that are merged are no more than a sum.
    assert!(applied <= 1 && born <= 400, "{applied} applied, {merged} merged, {born} nodes");
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 1000.0;
    settle(&mut app, entity);
}

/// Every surface is hit ten times in one frame; returns the frames until each shows a crack.
fn hit_many(app: &mut App, surfaces: &[Entity]) -> usize {
    let mut rng = Rng::new(7);
    // As a game would send them: all over the place.
    for _ in 0..10 {
        for entity in surfaces {
            app.world_mut().write_message(CrackHit::uv(*entity, Vec2::new(rng.unit(), rng.unit())));
        }
    }
    let mut n_frames = 0;
    while surfaces.iter().any(|entity| state(app, *entity).nodes == 0) {
        step(app);
        n_frames += 1;
        assert!(n_frames <= 4 * surfaces.len(), "some surface starves");
    }
    n_frames
}

/// Frames have no time at all here, so that each applies one hit and paints one surface, however fast the machine is.
#[test]
fn i7_hits_on_a_thousand_surfaces_take_turns() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
    let image = add(&mut app, picture(UVec2::splat(32)));
    let surfaces: Vec<_> = (0..1000).map(|seed| spawn_small(&mut app, &image, seed)).collect();
    let n_frames = hit_many(&mut app, &surfaces);
    let stats = counts(&app);
    assert_eq!((stats.sent, stats.rejected), (10_000, 0));
    println!("each of 1000 surfaces shows a crack after {n_frames} frames, {} hits wait", stats.queued);
    // In turns: none has had two hits more than another.
    let hits: Vec<u32> = surfaces.iter().map(|entity| state(&app, *entity).hits).collect();
    let (least, most) = (hits.iter().min(), hits.iter().max());
    assert!(most.zip(least).is_some_and(|(most, least)| most - least <= 1), "{least:?} to {most:?} hits");
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 1000.0;
    wait_for(&mut app, "all hits", |app| counts(app).queued == 0);
    for entity in surfaces {
        settle(&mut app, entity);
    }
}

#[test]
fn i7_a_surface_is_not_kept_waiting_by_one_with_many_hits() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
    let image = add(&mut app, picture(UVec2::splat(32)));
    let [busy, other] = [1, 2].map(|seed| spawn_small(&mut app, &image, seed));
    for _ in 0..4000 {
        hit(&mut app, center(busy));
    }
    hit(&mut app, center(other));
    // One hit and one painted surface a frame.
    steps(&mut app, 6);
    assert!(state(&app, other).nodes > 0 && counts(&app).queued > 3000);
}

#[test]
fn i7_a_hundred_surfaces_show_it_on_the_gpu() {
    let Some((_one, mut app)) = gpu_app() else { return };
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 2.0;
    let image = add(&mut app, picture(UVec2::splat(32)));
    let surfaces: Vec<_> = (0..100).map(|seed| spawn_small(&mut app, &image, seed)).collect();
    hit_many(&mut app, &surfaces);
    // Reading back takes frames, in which nothing must change.
    for entity in &surfaces {
        settle(&mut app, *entity);
    }
    steps(&mut app, 10);
    assert_on_gpu(&mut app, &surfaces);
    let before = texels(&app, &image);
    assert!(surfaces.iter().all(|entity| shown(&app, *entity) != before), "each shows a crack");
}

#[test]
fn i8_a_thousand_surfaces_grow_at_once_and_in_turns() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(32)));
    let surfaces: Vec<_> = (0..1000)
        .map(|seed| {
            let surface = CrackSurface::default().with_seed(seed);
            app.world_mut().spawn((Sprite::from_image(image.clone()), surface)).id()
        })
        .collect();
    for entity in &surfaces {
        hit(&mut app, center(*entity));
    }
    step(&mut app);
    let all_grow = surfaces.iter().all(|entity| state(&app, *entity).status == CrackStatus::Growing);
    let first = state(&app, surfaces[0]);
    assert!(all_grow, "all of them start at once: {first:?}");
    // Now with little time, and with room for fewer than there are.
    *app.world_mut().resource_mut::<CrackBudget>() =
        CrackBudget { milliseconds: 1.0, max_growing: 100, ..CrackBudget::default() };
    let nodes = |app: &App| surfaces.iter().map(|entity| state(app, *entity).nodes).collect::<Vec<_>>();
    let before = nodes(&app);
    wait_for(&mut app, "growth everywhere", |app| {
        nodes(app)
            .iter()
            .zip(&before)
            .zip(&surfaces)
            .all(|((now, before), entity)| now > before || state(app, *entity).status == CrackStatus::Done)
    });
    for entity in surfaces {
        settle(&mut app, entity);
    }
}

/// How many cracks get longer in one frame: never more than may, and others begin when some have ended.
#[test]
fn i8_no_more_grow_at_once_than_may() {
    const MOST: usize = 10;
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().max_growing = MOST;
    let image = add(&mut app, picture(UVec2::splat(32)));
    let surfaces: Vec<_> = (0..100).map(|seed| spawn_small(&mut app, &image, seed)).collect();
    for entity in &surfaces {
        hit(&mut app, center(*entity));
    }
    let nodes = |app: &App| surfaces.iter().map(|entity| state(app, *entity).nodes).collect::<Vec<_>>();
    // All show where they begin in the frame of the hit, also those that wait.
    step(&mut app);
    let first = nodes(&app);
    assert!(first.iter().all(|nodes| *nodes > 0), "{first:?}");
    let (mut before, mut most, mut n_frames) = (first.clone(), 0, 0);
    while surfaces.iter().any(|entity| state(&app, *entity).status != CrackStatus::Done) {
        step(&mut app);
        let now = nodes(&app);
        most = most.max(now.iter().zip(&before).filter(|(now, before)| now != before).count());
        before = now;
        n_frames += 1;
        assert!(n_frames < 10_000, "they do not all end");
    }
    assert!((2..=MOST).contains(&most), "{most} grow in one frame, {MOST} may");
    let grown = before.iter().zip(&first).filter(|(now, first)| now > first).count();
    assert!(grown > surfaces.len() / 2, "{grown} have grown");
    // With that of the hits.
    assert!(n_frames + 1 >= surfaces.len() / MOST, "{n_frames} frames for all of them");
}

/// Counted, not timed: a surface that is not hit is a sprite with one component more, which no system writes to, and has no texture.
/// What a frame with ten thousand of them takes is measured in `benches/frame.rs`.
#[test]
fn i8_idle_surfaces_cost_nothing() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(16)));
    let plain = app.world_mut().spawn(Sprite::from_image(image.clone())).id();
    let idle: Vec<_> = (0..10_000)
        .map(|_| app.world_mut().spawn((Sprite::from_image(image.clone()), CrackSurface::default())).id())
        .collect();
    // A busy one, so that the systems have something to do.
    let busy = spawn_sprite(&mut app, &image);
    steps(&mut app, 2);
    let images = app.world().resource::<Assets<Image>>().len();
    let (entities, since) = (app.world().entities().count_spawned(), app.world_mut().change_tick());
    hit(&mut app, center(busy));
    settle(&mut app, busy);
    assert!(state(&app, busy).nodes > 0);
    let components = |entity: Entity| app.world().entity(entity).archetype().components().to_vec();
    let names = |entity: Entity| {
        let all = components(entity).into_iter().filter(|id| !components(plain).contains(id));
        all.map(|id| app.world().components().get_name(id).unwrap().to_string()).collect::<Vec<_>>()
    };
    println!("an idle surface has {:?} beside a sprite's", names(idle[0]));
    assert!(names(idle[0]).iter().all(|name| name.starts_with("bevy_crack::")));
    let now = app.world().read_change_tick();
    for entity in idle {
        assert_eq!(names(entity).len(), names(busy).len().min(2), "{:?} {:?}", names(entity), names(busy));
        for id in components(entity) {
            let ticks = app.world().entity(entity).get_change_ticks_by_id(id).unwrap();
            let name = app.world().components().get_name(id).unwrap();
            assert!(!ticks.is_changed(since, now), "{name} of an idle surface is written");
        }
    }
    let made = app.world().resource::<Assets<Image>>().len() - images;
    println!(
        "{made} images and {} entities for one cracked surface",
        app.world().entities().count_spawned() - entities
    );
    assert!(made <= 4, "images are made for the one that was hit alone");
}

#[test]
fn i9_hits_before_the_surface_exists_and_after_it_is_gone() {
    let mut app = app();
    single_threaded(&mut app);
    let image = add(&mut app, picture(UVec2::splat(48)));
    let heard = warnings(|| {
        hit(&mut app, center(Entity::PLACEHOLDER));
        // Not spawned yet.
        let later = app.world().entities().len();
        let later = Entity::from_raw_u32(later + 1000).unwrap();
        app.world_mut().write_message(center(later));
        // A sprite, but no surface.
        let plain = app.world_mut().spawn(Sprite::from_image(image.clone())).id();
        hit(&mut app, center(plain));
        // Gone when its turn comes.
        let gone = spawn_sprite(&mut app, &image);
        hit(&mut app, center(gone));
        app.world_mut().despawn(gone);
        let stats = step(&mut app);
        assert_eq!((stats.sent, stats.rejected), (4, 4));
        // Long gone.
        for _ in 0..100 {
            hit(&mut app, center(gone));
        }
        assert_eq!(step(&mut app).rejected, 104);
    });
    assert_eq!(heard.len(), 2, "one for all that are gone, one for what is no surface: {heard:?}");
    assert!(heard[0].contains("gone") && heard[1].contains("no `CrackSurface`"), "{heard:?}");

    // Gone with hits that wait: none is left over.
    app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
    let waiting = spawn_sprite(&mut app, &image);
    for i in 0..50 {
        hit(&mut app, CrackHit::uv(waiting, Vec2::splat(i as f32 / 50.0)));
    }
    assert!(step(&mut app).queued > 0);
    app.world_mut().despawn(waiting);
    assert_eq!(step(&mut app).queued, 0);

    // Spawned and hit by the same commands.
    let mut commands = app.world_mut().commands();
    let new = commands.spawn((Sprite::from_image(image.clone()), CrackSurface::default())).id();
    commands.trigger(center(new));
    let mut commands = app.world_mut().commands();
    let short = commands.spawn((Sprite::from_image(image), CrackSurface::default())).id();
    commands.trigger(center(short));
    commands.entity(short).despawn();
    app.world_mut().flush();
    settle(&mut app, new);
}

#[test]
fn i10_transforms_that_cannot_be_inverted_are_refused() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(48)));
    let mut rejected = 0;
    for transform in [
        Transform::from_scale(Vec3::ZERO),
        Transform::from_scale(Vec3::new(1.0, 0.0, 1.0)),
        Transform::from_scale(Vec3::splat(1e-30)),
        Transform::from_scale(Vec3::splat(f32::NAN)),
        Transform::from_scale(Vec3::splat(f32::INFINITY)),
        Transform::from_xyz(f32::NAN, 0.0, 0.0),
        Transform::from_xyz(f32::INFINITY, 0.0, 0.0),
        Transform::from_rotation(Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0)),
    ] {
        let entity = spawn_sprite(&mut app, &image);
        app.world_mut().entity_mut(entity).insert(transform);
        hit(&mut app, CrackHit::world(entity, Vec3::ZERO));
        rejected += 1;
        assert_eq!(step(&mut app).rejected, rejected, "{transform:?}");
        // A place in the picture needs no transform.
        hit(&mut app, center(entity));
        assert_eq!(step(&mut app).applied, rejected, "{transform:?}");
    }
    let bare = spawn_sprite(&mut app, &image);
    app.world_mut().entity_mut(bare).remove::<GlobalTransform>();
    hit(&mut app, CrackHit::world(bare, Vec3::ZERO));
    assert_eq!(step(&mut app).rejected, rejected + 1);
    // What is flat along z alone looks as ever, and can be hit.
    let flat = spawn_sprite(&mut app, &image);
    let transform = Transform::from_xyz(100.0, 0.0, 5.0).with_scale(Vec3::new(2.0, 1.0, 0.0));
    app.world_mut().entity_mut(flat).insert(transform);
    hit(&mut app, CrackHit::world(flat, Vec3::new(146.0, 20.0, 5.0)));
    hit(&mut app, CrackHit::world(flat, Vec3::new(150.0, 0.0, 5.0)));
    let after = step(&mut app);
    assert_eq!((after.applied, after.rejected), (rejected + 1, rejected + 2));
}

/// Where a surface of the size of its picture is cracked, in texels from the top left.
fn cracked_at(app: &App, entity: Entity, before: &[u8], size: UVec2) -> Vec2 {
    let now = shown(app, entity);
    let (mut sum, mut n) = (Vec2::ZERO, 0.0);
    for (i, (now, before)) in now.chunks(4).zip(before.chunks(4)).enumerate() {
        if now != before {
            sum += Vec2::new(i as f32 % size.x as f32, (i as u32 / size.x) as f32) + 0.5;
            n += 1.0;
        }
    }
    assert!(n > 0.0, "no crack shows");
    sum / n
}

#[test]
fn i10_hits_land_where_a_mirrored_turned_or_sheared_sprite_shows_them() {
    let mut rng = Rng::new(10);
    let size = UVec2::new(96, 64);
    // A dot: starts without markers.
    let mut preset = small_preset();
    preset.growth.reach = 0.01;
    preset.growth.num_iterations = 1;
    preset.growth.starts = StartLayout::Ring { count: 12, radius: 0.02 };
    let mut app = app();
    for i in 0..60 {
        let image = add(&mut app, picture(size));
        let before = texels(&app, &image);
        let mut any = |low: f32, high: f32| rng.range(low, high);
        let transform = Transform {
            translation: Vec3::new(any(-500.0, 500.0), any(-500.0, 500.0), any(-5.0, 5.0)),
            rotation: Quat::from_rotation_z(any(-3.0, 3.0)),
            scale: Vec3::new(any(0.05, 20.0), any(0.05, 20.0), 1.0),
        };
        // A mirrored child of a stretched, turned parent is sheared.
        let mirror = Vec3::new(if i % 2 == 0 { -1.0 } else { 1.0 }, if i % 3 == 0 { -2.0 } else { 1.0 }, 1.0);
        let child = Transform::from_rotation(Quat::from_rotation_z(any(-1.0, 1.0))).with_scale(mirror);
        let sprite = Sprite { flip_x: i % 5 == 0, flip_y: i % 7 == 0, ..Sprite::from_image(image) };
        let flip = Vec2::new(if sprite.flip_x { -1.0 } else { 1.0 }, if sprite.flip_y { -1.0 } else { 1.0 });
        let parent = app.world_mut().spawn((transform, Visibility::default())).id();
        let bundle = (sprite, CrackSurface::new(preset.clone()), child, ChildOf(parent));
        let entity = app.world_mut().spawn(bundle).id();
        step(&mut app);

        let uv = Vec2::new(any(0.2, 0.8), any(0.2, 0.8));
        let local = (uv - MIDDLE) * Vec2::new(1.0, -1.0) * size.as_vec2() * flip;
        let world = get::<GlobalTransform>(&app, entity).transform_point(local.extend(0.0));
        hit(&mut app, CrackHit::world(entity, world));
        settle(&mut app, entity);
        let at = cracked_at(&app, entity, &before, size);
        let aim = uv * size.as_vec2();
        assert!(at.distance(aim) < 2.0, "aimed at {aim}, cracked at {at}: {transform:?} {child:?}");
        app.world_mut().despawn(parent);
    }
}

#[test]
fn i3_hits_that_miss_make_nothing() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(64)));
    let sprite = spawn_small(&mut app, &image, 1);
    let late = app.world().resource::<Assets<Image>>().reserve_handle();
    let loading = spawn_small(&mut app, &late, 2);
    let material = add(&mut app, ColorMaterial { texture: Some(image), ..default() });
    let mesh = add(&mut app, Mesh::from(Rectangle::new(64.0, 64.0)));
    let surface = CrackSurface::new(small_preset());
    let flat = app.world_mut().spawn((Mesh2d(mesh), MeshMaterial2d(material), Transform::default(), surface)).id();
    step(&mut app);
    for entity in [sprite, flat] {
        hit(&mut app, CrackHit::world(entity, Vec3::new(500.0, 0.0, 0.0)));
        hit(&mut app, CrackHit::uv(entity, Vec2::new(1.5, 0.5)));
    }
    hit(&mut app, CrackHit::local(loading, Vec3::new(500.0, 0.0, 0.0)));
    steps(&mut app, 2);
    assert_eq!(counts(&app).rejected, 4);
    assert_eq!(state(&app, loading).status, CrackStatus::Waiting);
    app.world_mut()
        .resource_mut::<Assets<Image>>()
        .insert(&late, picture(UVec2::splat(32)))
        .expect("a handle that is kept");
    steps(&mut app, 2);
    assert_eq!(counts(&app).rejected, 5);
    for entity in [sprite, flat, loading] {
        assert!(app.world().get::<CrackTextures>(entity).is_none(), "no memory for what is not cracked");
        assert_eq!(state(&app, entity), CrackState::default());
        hit(&mut app, center(entity));
        settle(&mut app, entity);
    }
}

#[test]
fn warnings_call_a_surface_by_its_name() {
    let mut app = app();
    single_threaded(&mut app);
    let image = add(&mut app, picture(UVec2::splat(32)));
    let [named, nameless, empty] = [(); 3].map(|()| spawn_sprite(&mut app, &image));
    app.world_mut().entity_mut(named).insert(Name::new("the old wall"));
    app.world_mut().entity_mut(empty).remove::<Sprite>().insert(Name::new("nothing"));
    let heard = warnings(|| {
        hit(&mut app, center(named).with_energy(-1.0));
        hit(&mut app, center(nameless).with_energy(-1.0));
        hit(&mut app, center(empty));
        step(&mut app);
    });
    let expected = [
        format!("a hit on the old wall ({named}) is refused"),
        format!("a hit on {nameless} is refused"),
        format!("nothing ({empty}) cannot crack"),
    ];
    assert_eq!(heard.len(), expected.len(), "{heard:?}");
    for expected in expected {
        assert!(heard.iter().any(|warning| warning.contains(&expected)), "{expected}: {heard:?}");
    }
}

#[test]
fn i12_healing_takes_back_the_hits_of_its_frame_that_came_before_it() {
    let mut app = app();
    let entity = spawn_picture(&mut app, UVec2::splat(48));
    let before = shown(&app, entity);
    for close in [false, true] {
        for _ in 0..3 {
            hit(&mut app, center(entity));
        }
        let mut commands = app.world_mut().commands();
        let mut commands = commands.entity(entity);
        if close {
            commands.close_cracks(0.5)
        } else {
            commands.heal_cracks()
        };
        app.world_mut().flush();
        let stats = step(&mut app);
        assert_eq!((stats.sent, stats.rejected, stats.queued), if close { (6, 6, 0) } else { (3, 3, 0) });
        assert_eq!((shown(&app, entity), state(&app, entity)), (before.clone(), CrackState::default()));
    }
    // A hit that comes after it lands.
    app.world_mut().commands().entity(entity).heal_cracks();
    app.world_mut().flush();
    assert_cracks(&mut app, entity);
}
