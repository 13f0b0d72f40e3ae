//! Crumbs: they come off the edges of shards, rest as these do, and nothing is left of them.

use crate::{
    shards::{loose, shards, shatter, stock, surface, vertices},
    support::*,
};
use bevy::prelude::*;
use bevy_crack::{
    prelude::*,
    shatter::{BreakAgain, BurstParams, RimLook, SizeClasses},
};
use std::collections::HashSet;

/// The most of one frame.
const FRAME: usize = 512;

#[derive(Resource, Default)]
struct Whole(usize);

fn crumbs(app: &mut App) -> Vec<Entity> {
    app.world_mut().query_filtered::<Entity, With<CrackChip>>().iter(app.world()).collect()
}

fn places(app: &mut App) -> Vec<Transform> {
    crumbs(app).into_iter().map(|crumb| get::<Transform>(app, crumb)).collect()
}

/// Pieces that fly at once, and stay.
fn flying() -> ShatterCracks {
    let burst = BurstParams { hold: 0.0, front: 100.0, fade_after: 60.0, ..BurstParams::DEFAULT };
    ShatterCracks { burst, speed: 1.0, thickness: 0.1, ..loose() }
}

/// What shatters, in 2D and in 3D: a sprite, a wall and a ball.
struct Bodies {
    image: Handle<Image>,
    material: Handle<StandardMaterial>,
    meshes: [Handle<Mesh>; 2],
}

impl Bodies {
    const KINDS: usize = 3;

    fn new(app: &mut App) -> Self {
        app.init_resource::<Whole>();
        app.add_observer(|_: On<Reassembled>, mut whole: ResMut<Whole>| whole.0 += 1);
        let image = add(app, picture(UVec2::new(96, 80)));
        let material = add(app, StandardMaterial { base_color_texture: Some(image.clone()), ..default() });
        let meshes = [Mesh::from(Rectangle::new(1.2, 1.0)), Sphere::new(1.0).mesh().uv(32, 24)];
        Self { image, material, meshes: meshes.map(|mesh| add(app, mesh)) }
    }

    /// One that has cracked, three units above the floor.
    fn cracked(&self, app: &mut App, kind: usize, settings: (ShatterCracks, CrackChips), seed: u64) -> Entity {
        let (place, surface) = (Transform::from_xyz(1.0, 3.0, 0.0), surface().with_seed(seed));
        let body = app.world_mut().spawn((place, surface, settings)).id();
        let mut of = app.world_mut().entity_mut(body);
        if kind == 0 {
            of.insert(Sprite { custom_size: Some(Vec2::new(1.2, 1.0)), ..Sprite::from_image(self.image.clone()) });
        } else {
            of.insert((Mesh3d(self.meshes[kind - 1].clone()), MeshMaterial3d(self.material.clone())));
        }
        let at = if kind == 2 { CrackHit::local(body, Vec3::Z) } else { center(body) };
        hit(app, at.with_energy(3.0));
        settle(app, body);
        body
    }
}

#[test]
fn crumbs_come_off_edges_and_nothing_is_left_of_them() {
    let mut app = app();
    let bodies = Bodies::new(&mut app);
    for kind in 0..Bodies::KINDS {
        steps(&mut app, 2);
        let before = stock(&app);
        let settings = (ShatterCracks { floor: Some(0.0), ..flying() }, CrackChips::default());
        let body = bodies.cracked(&mut app, kind, settings, 4);
        assert_eq!(crumbs(&mut app), [], "{kind}: before it shatters");
        shatter(&mut app, body, ShatterRequest::EVERYTHING);
        let all = crumbs(&mut app);
        let pieces = shards(&mut app).len();
        assert!((pieces.min(40)..=FRAME).contains(&all.len()), "{kind}: {} of {pieces} pieces", all.len());
        let mut meshes = HashSet::new();
        for crumb in &all {
            let place = get::<Transform>(&app, *crumb);
            assert_eq!(get::<ChildOf>(&app, *crumb).parent(), body);
            assert_eq!(get::<CrackChip>(&app, *crumb).surface, body);
            let away = match kind {
                2 => (place.translation.length() - 0.95).abs(),
                _ => (place.translation.truncate().abs() - Vec2::new(0.6, 0.5)).max_element(),
            };
            // Those that come off on the way are not seen before.
            assert!(away < 0.25 || place.scale.max_element() < 1e-3, "{kind}: {place:?}");
            meshes.insert(match kind {
                0 => get::<Mesh2d>(&app, *crumb).0.id(),
                _ => get::<Mesh3d>(&app, *crumb).0.id(),
            });
        }
        assert!((2..=6).contains(&meshes.len()), "{kind}: they share few meshes");
        steps(&mut app, 40);
        let mut sizes: Vec<f32> = places(&mut app).iter().map(|place| place.scale.max_element()).collect();
        sizes.sort_by(f32::total_cmp);
        let (median, largest) = (sizes[sizes.len() / 2], sizes[sizes.len() - 1]);
        assert!(median < 0.5 * largest && largest < 0.1, "{kind}: few are large: {median} {largest}");
        // They come to rest on the floor, and stay as the shards do.
        steps(&mut app, 300);
        let lowest = places(&mut app).iter().map(|place| place.translation.y + 3.0).fold(f32::MAX, f32::min);
        let highest = places(&mut app).iter().map(|place| place.translation.y + 3.0).fold(f32::MIN, f32::max);
        assert!(lowest > -0.01 && highest < 0.15, "{kind}: {lowest} {highest}");
        if kind == 1 {
            // None hangs in the air: its lowest corner is at the floor.
            for crumb in &all {
                let (place, mesh) = (get::<Transform>(&app, *crumb), get::<Mesh3d>(&app, *crumb).0);
                let corners = vertices(&app, &mesh).into_iter().map(|(at, _)| place.transform_point(at).y + 3.0);
                let (low, size) = (corners.fold(f32::MAX, f32::min), place.scale.max_element());
                assert!((-0.6 * size..0.25 * size).contains(&low), "{kind}: {low} of {size}");
            }
        }
        assert_eq!(crumbs(&mut app).len(), all.len());
        match kind {
            0 => _ = app.world_mut().commands().entity(body).heal_cracks(),
            1 => _ = app.world_mut().entity_mut(body).remove::<CrackSurface>(),
            _ => app.world_mut().entity_mut(body).despawn(),
        }
        steps(&mut app, 3);
        assert_eq!(crumbs(&mut app), [], "{kind}");
        app.world_mut().try_despawn(body).ok();
        steps(&mut app, 4);
        assert_eq!(stock(&app), before, "{kind}");
    }
}

/// In time that runs backwards they return to their edges, and none is left when all is whole. They stand still with the shards.
#[test]
fn crumbs_go_where_time_runs_backwards() {
    let mut app = app();
    let bodies = Bodies::new(&mut app);
    for kind in 0..Bodies::KINDS {
        let again = BreakAgain { classes: SizeClasses { largest: [0.05, 0.2, 0.6] }, after: 0.1, apart: 0.1 };
        let settings = (ShatterCracks { again: Some(again), ..flying() }, CrackChips::default());
        let body = bodies.cracked(&mut app, kind, settings, 4);
        let speed = |app: &mut App, speed| app.world_mut().get_mut::<ShatterCracks>(body).expect("it").speed = speed;
        for _ in 0..2 {
            shatter(&mut app, body, ShatterRequest::EVERYTHING);
            let first = crumbs(&mut app).len();
            steps(&mut app, 30);
            let all = crumbs(&mut app).len();
            assert!(first > 0 && all > first, "{kind}: {first}, and {all} when pieces have broken again");
            speed(&mut app, 0.0);
            let still = places(&mut app);
            steps(&mut app, 3);
            assert_eq!(places(&mut app), still, "{kind}");
            speed(&mut app, -1.0);
            let mut left = all;
            for _ in 0..60 {
                step(&mut app);
                let now = crumbs(&mut app).len();
                assert!(now <= left, "{kind}: {now} of {left}");
                left = now;
            }
            assert_eq!(core::mem::take(&mut app.world_mut().resource_mut::<Whole>().0), 1, "{kind} is whole");
            assert_eq!(left, 0, "{kind}");
            speed(&mut app, 1.0);
        }
        app.world_mut().entity_mut(body).despawn();
        step(&mut app);
    }
}

/// The same seed has the same crumbs, another one others.
#[test]
fn crumbs_are_the_same_every_time() {
    for kind in 0..Bodies::KINDS {
        let made = |seed| {
            let mut app = app();
            let bodies = Bodies::new(&mut app);
            let body = bodies.cracked(&mut app, kind, (flying(), CrackChips::default()), seed);
            shatter(&mut app, body, ShatterRequest::EVERYTHING);
            steps(&mut app, 10);
            places(&mut app)
        };
        let first = made(4);
        assert!(!first.is_empty());
        assert_eq!(first, made(4), "{kind}");
        assert!(first != made(5), "{kind}");
    }
}

/// Numbers out of range are none or the most; there are never more than there may be.
#[test]
fn s12_crumbs_of_any_kind() {
    let mut app = app();
    app.world_mut().resource_mut::<CrackBudget>().max_shards = 60;
    let bodies = Bodies::new(&mut app);
    let settings = [(u32::MAX, f32::INFINITY), (1000, 0.1), (0, 0.02), (24, f32::NAN), (24, -1.0), (24, 0.0)];
    for (i, (crumbs_of, crumb_size)) in settings.into_iter().enumerate() {
        for kind in 0..Bodies::KINDS {
            let chips = CrackChips { crumbs: crumbs_of, crumb_size, ..default() };
            let rim = Some([RimLook::PLAIN, RimLook::GLASS, RimLook::STONE][(i + kind) % 3]);
            let body = bodies.cracked(&mut app, kind, (ShatterCracks { rim, ..flying() }, chips), 4);
            shatter(&mut app, body, ShatterRequest::EVERYTHING);
            let all = crumbs(&mut app).len();
            assert_eq!(all > 0, i < 2, "{kind}, {crumbs_of} of {crumb_size}: {all}");
            assert!(all <= FRAME, "{kind}: {all}");
            for _ in 0..20 {
                step(&mut app);
                let all = places(&mut app);
                assert!(all.len() <= 60 + FRAME && all.iter().all(|place| place.is_finite()), "{kind}: {}", all.len());
            }
            assert!(crumbs(&mut app).len() <= 60, "{kind}");
            // What is taken away from outside is not missed.
            crumbs(&mut app).iter().for_each(|crumb| app.world_mut().entity_mut(*crumb).despawn());
            steps(&mut app, 2);
            app.world_mut().entity_mut(body).despawn();
            step(&mut app);
        }
    }
}
