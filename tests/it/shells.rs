//! Boxes, curved meshes and rooms in pieces: hollow shells.

use crate::{
    shards::{loose, shards, shatter, stock, surface, vertices},
    support::*,
};
use bevy::{mesh::Indices, prelude::*};
use bevy_crack::{
    plugin::ShardsError,
    prelude::*,
    shatter::{Anchor, BurstParams},
};

#[derive(Resource, Default)]
struct Failed(Vec<ShardsError>);

#[derive(Resource, Default)]
struct Whole(usize);

fn bodies() -> (App, Handle<StandardMaterial>) {
    let mut app = app();
    app.init_resource::<Failed>().init_resource::<Whole>();
    app.add_observer(|event: On<ShatterFailed>, mut failed: ResMut<Failed>| failed.0.push(event.error.clone()));
    app.add_observer(|_: On<Reassembled>, mut whole: ResMut<Whole>| whole.0 += 1);
    let image = add(&mut app, picture(UVec2::new(64, 48)));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() });
    (app, material)
}

fn spawn(app: &mut App, mesh: &Handle<Mesh>, material: &Handle<StandardMaterial>, settings: ShatterCracks) -> Entity {
    let place = Transform::from_xyz(3.0, 1.0, -2.0).with_rotation(Quat::from_rotation_y(0.5));
    let mesh = (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()));
    app.world_mut().spawn((mesh, place, surface().with_unwrap(CrackUnwrap::Always), settings)).id()
}

/// The triangles of a mesh.
fn triangles(app: &App, mesh: &Handle<Mesh>) -> Vec<[Vec3; 3]> {
    let at: Vec<Vec3> = vertices(app, mesh).into_iter().map(|(at, _)| at).collect();
    match app.world().resource::<Assets<Mesh>>().get(mesh).expect("the mesh").indices() {
        Some(Indices::U32(indices)) => indices.as_chunks::<3>().0.iter().map(|t| t.map(|i| at[i as usize])).collect(),
        Some(Indices::U16(indices)) => {
            indices.as_chunks::<3>().0.iter().map(|t| t.map(|i| at[usize::from(i)])).collect()
        }
        None => at.as_chunks::<3>().0.to_vec(),
    }
}

fn area(triangles: &[[Vec3; 3]]) -> f32 {
    triangles.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum()
}

/// The outside of all shards, where they are now, in the space of their surface.
fn outside(app: &mut App) -> Vec<[Vec3; 3]> {
    let mut all = Vec::new();
    for shard in shards(app) {
        let place = get::<Transform>(app, shard);
        let mesh = get::<Mesh3d>(app, shard).0;
        all.extend(triangles(app, &mesh).into_iter().map(|corners| corners.map(|at| place.transform_point(at))));
    }
    all
}

/// How many texels of the triangles that an entity shows are gone, and of how many.
fn gone(app: &App, entity: Entity, is_counted: impl Fn([Vec3; 3]) -> bool) -> (usize, usize) {
    let texture = get::<CrackTextures>(app, entity).diffuse.expect("a texture");
    let size = app.world().resource::<Assets<Image>>().get(&texture).expect("it").size();
    let texels = texels(app, &texture);
    let (mut gone, mut all) = (0, 0);
    let shown = vertices(app, &get::<Mesh3d>(app, entity).0);
    for corners in shown.as_chunks::<3>().0 {
        if !is_counted(corners.each_ref().map(|corner| corner.0)) {
            continue;
        }
        let [a, b, c] = corners.each_ref().map(|corner| corner.1 * size.as_vec2());
        let turn = (b - a).perp_dot(c - a).signum();
        let (min, max) = (a.min(b).min(c).as_usizevec2(), a.max(b).max(c).ceil().as_usizevec2());
        for (x, y) in (min.y..max.y).flat_map(|y| (min.x..max.x).map(move |x| (x, y))) {
            let at = Vec2::new(x as f32, y as f32) + 0.5;
            if [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).perp_dot(at - *p) * turn >= 0.0) {
                all += 1;
                gone += usize::from(texels[4 * (y * size.x as usize + x) + 3] == 0);
            }
        }
    }
    (gone, all)
}

fn meshes() -> [(&'static str, Mesh, Vec3); 4] {
    [
        ("a box", Cuboid::new(2.0, 2.0, 2.0).into(), Vec3::new(0.3, 0.2, 1.0)),
        ("a long box", Cuboid::new(2.0, 1.0, 3.0).into(), Vec3::new(1.0, 0.1, 0.4)),
        ("a ball", Sphere::new(1.0).mesh().uv(32, 24), Vec3::new(0.6, 0.0, 0.8)),
        ("a cylinder", Cylinder::new(0.7, 2.0).into(), Vec3::new(0.0, 0.1, 0.7)),
    ]
}

#[test]
fn s8_bodies_fall_as_pieces_of_a_shell() {
    let (mut app, material) = bodies();
    for (name, mesh, at) in meshes() {
        let mesh = add(&mut app, mesh);
        let whole = area(&triangles(&app, &mesh));
        steps(&mut app, 2);
        let before = stock(&app);
        let entity = spawn(&mut app, &mesh, &material, ShatterCracks { thickness: 0.1, ..loose() });
        hit(&mut app, CrackHit::local(entity, at).with_energy(3.0));
        settle(&mut app, entity);
        assert!(get::<Mesh3d>(&app, entity).0 != mesh, "{name} is laid out");
        let texture = get::<CrackTextures>(&app, entity).diffuse.expect("a texture");
        let cracked = texels(&app, &texture);
        shatter(&mut app, entity, ShatterRequest::EVERYTHING);
        settle_shards(&mut app, entity);
        assert!(app.world().resource::<Failed>().0.is_empty(), "{name}: {:?}", app.world().resource::<Failed>().0);
        let pieces = shards(&mut app).len();
        assert!(pieces > 8, "{name}: {pieces}");
        // All of it, in its place: it stands still.
        let outside = outside(&mut app);
        let covered = area(&outside);
        assert!((covered / whole - 1.0).abs() < 0.01, "{name}: {covered} of {whole}");
        for at in outside.iter().flatten() {
            let away = match name {
                "a box" => at.abs().max_element() - 1.0,
                "a long box" => (at.abs() - Vec3::new(1.0, 0.5, 1.5)).max_element(),
                "a ball" => (at.length() - 1.0).min(0.0) + 0.01,
                _ => (Vec2::new(at.x, at.z).length() - 0.7).max(at.y.abs() - 1.0).min(0.0) + 0.005,
            };
            assert!(away.abs() < 0.011, "{name}: {at} is {away} away from its surface");
        }
        // Each has an inside and sides, of another material.
        for shard in shards(&mut app) {
            let sides = app.world().get::<Children>(shard).expect("its sides")[0];
            assert!(!triangles(&app, &get::<Mesh3d>(&app, sides).0).is_empty());
            let materials = [shard, sides].map(|of| get::<MeshMaterial3d<StandardMaterial>>(&app, of).0);
            assert!(materials[0] != materials[1]);
        }
        let (holes, of) = gone(&app, entity, |_| true);
        assert_eq!(holes, of, "{name}: nothing of it stays");
        assert!(of > 1000, "{of} texels");
        {
            let own = get::<MeshMaterial3d<StandardMaterial>>(&app, entity).0;
            let own = app.world().resource::<Assets<StandardMaterial>>().get(&own).expect("it");
            assert!(own.alpha_mode == AlphaMode::Mask(0.5) && own.cull_mode.is_none() && own.double_sided);
        }
        // Time runs on, and back again.
        let speed = |app: &mut App, speed| app.world_mut().get_mut::<ShatterCracks>(entity).expect("it").speed = speed;
        speed(&mut app, 1.0);
        steps(&mut app, 40);
        let flown = outside_center(&mut app);
        assert!(flown.is_none_or(|center| center.y < -0.1), "{name} falls: {flown:?}");
        speed(&mut app, -2.0);
        steps(&mut app, 40);
        assert_eq!(core::mem::take(&mut app.world_mut().resource_mut::<Whole>().0), 1, "{name} is whole");
        assert!(shards(&mut app).is_empty());
        steps(&mut app, 2);
        assert!(texels(&app, &texture) == cracked, "{name}: every texel is as it was");
        app.world_mut().commands().entity(entity).heal_cracks();
        step(&mut app);
        assert_eq!(get::<Mesh3d>(&app, entity).0, mesh);
        app.world_mut().despawn(entity);
        drop(texture);
        steps(&mut app, 3);
        assert_eq!(stock(&app), before, "{name}");
    }
}

/// Lets frames pass until no more shards come.
fn settle_shards(app: &mut App, entity: Entity) {
    for _ in 0..200 {
        let gone = app.world().get::<CrackShards>(entity).map(|shards| shards.gone);
        steps(app, 8);
        if gone.is_some() && gone == app.world().get::<CrackShards>(entity).map(|shards| shards.gone) {
            return;
        }
    }
    panic!("it goes on shattering");
}

/// The middle of all shards in the space of their surface.
fn outside_center(app: &mut App) -> Option<Vec3> {
    let all = outside(app);
    let n = 3 * all.len();
    (n > 0).then(|| all.iter().flatten().sum::<Vec3>() / n as f32)
}

/// What is side by side in the layout is not near in space.
#[test]
fn s8_a_blow_reaches_through_space() {
    let (mut app, material) = bodies();
    let mesh = add(&mut app, Mesh::from(Cuboid::new(2.0, 2.0, 2.0)));
    let entity = spawn(&mut app, &mesh, &material, loose());
    // Cracks on all sides.
    for normal in [Vec3::Z, Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::NEG_Z] {
        hit(&mut app, CrackHit::local(entity, normal).with_energy(2.0));
        settle(&mut app, entity);
    }
    hit(&mut app, CrackHit::local(entity, Vec3::new(0.1, 0.1, 1.0)).with_energy(1.0));
    settle(&mut app, entity);
    let near = ShatterRequest { reach: 0.3, ..ShatterRequest::ALL };
    shatter(&mut app, entity, near);
    settle_shards(&mut app, entity);
    let outside = outside(&mut app);
    assert!(!outside.is_empty());
    // A piece may be large, but each has a point within reach.
    for shard in shards(&mut app) {
        let place = get::<Transform>(&app, shard);
        let mesh = get::<Mesh3d>(&app, shard).0;
        let all = triangles(&app, &mesh);
        let points = all.iter().flatten().map(|at| place.transform_point(*at));
        let least = points.map(|at| at.distance(Vec3::new(0.1, 0.1, 1.0))).fold(f32::INFINITY, f32::min);
        assert!(least < 0.3 * 2.0 + 0.5, "{least}");
    }
    // Nothing of the far side.
    let (holes, of) = gone(&app, entity, |corners| corners.iter().all(|at| at.z < -0.99));
    assert!(holes == 0 && of > 100, "{holes} of {of}");
}

/// By default what reaches to the cuts of the layout stays, unless it is hit itself.
#[test]
fn s8_a_hit_without_a_direction_comes_from_its_side() {
    let (mut app, material) = bodies();
    // A layout of a curved mesh is stretched, so that a piece is thrown a little to the side.
    let blows = [(Vec3::Z, 0.999), (Vec3::X, 0.999), (Vec3::new(0.6, 0.0, 0.8), 0.9), (Vec3::Z, 0.9)];
    for ((name, mesh, at), (normal, least)) in meshes().into_iter().zip(blows) {
        let mesh = add(&mut app, mesh);
        // No piece is thrown but by the blow itself.
        let burst = BurstParams { along: 1.0, scatter: 0.0, ..loose().burst };
        let entity = spawn(&mut app, &mesh, &material, ShatterCracks { burst, ..loose() });
        hit(&mut app, CrackHit::local(entity, at).with_energy(3.0));
        settle(&mut app, entity);
        shatter(&mut app, entity, ShatterRequest::EVERYTHING);
        settle_shards(&mut app, entity);
        let pieces = shards(&mut app);
        assert!(pieces.len() > 4, "{name}");
        for shard in pieces {
            let velocity = get::<Shard>(&app, shard).velocity;
            assert!(velocity.normalize_or_zero().dot(-normal) > least, "{name}: {velocity}");
        }
        app.world_mut().despawn(entity);
        steps(&mut app, 2);
    }
}

#[test]
fn s8_bodies_are_held_where_their_layout_ends() {
    let (mut app, material) = bodies();
    let mesh = add(&mut app, Mesh::from(Cuboid::new(2.0, 2.0, 2.0)));
    let counts = [Anchor::Border, Anchor::Sides([true, false, false, false]), Anchor::Nothing].map(|anchor| {
        let entity = spawn(&mut app, &mesh, &material, ShatterCracks { anchor, ..loose() });
        hit(&mut app, CrackHit::local(entity, Vec3::new(0.0, 0.0, 1.0)).with_energy(3.0));
        settle(&mut app, entity);
        shatter(&mut app, entity, ShatterRequest::ALL);
        settle_shards(&mut app, entity);
        let count = shards(&mut app).len();
        app.world_mut().despawn(entity);
        steps(&mut app, 3);
        count
    });
    assert!(counts[0] > 0 && counts[0] == counts[1] && counts[0] < counts[2], "{counts:?}");
    assert!(app.world().resource::<Failed>().0.is_empty());
}

/// Hit by hit, bodies lose more and more; fragments break again; all that was made goes.
#[test]
fn s8_bodies_shatter_again_and_again() {
    let (mut app, material) = bodies();
    for (name, mesh, at) in meshes() {
        let mesh = add(&mut app, mesh);
        steps(&mut app, 2);
        let before = stock(&app);
        let again = Some(bevy_crack::shatter::BreakAgain { after: 0.05, ..bevy_crack::shatter::BreakAgain::DEFAULT });
        let entity = spawn(&mut app, &mesh, &material, ShatterCracks { again, speed: 1.0, ..loose() });
        let mut all = 0;
        for round in 0..4 {
            let at = Quat::from_rotation_y(0.2 * round as f32) * at;
            hit(&mut app, CrackHit::local(entity, at).with_energy(2.0));
            settle(&mut app, entity);
            shatter(&mut app, entity, ShatterRequest { reach: 0.4, ..ShatterRequest::ALL });
            steps(&mut app, 12);
            let now = app.world().get::<CrackShards>(entity).map_or(0, |shards| shards.gone);
            assert!(now >= all, "{name}: {now} after {all}");
            all = now;
        }
        assert!(all > 3, "{name}: {all}");
        assert!(app.world().resource::<Failed>().0.is_empty(), "{name}");
        app.world_mut().commands().entity(entity).heal_cracks();
        steps(&mut app, 2);
        assert!(shards(&mut app).is_empty() && get::<Mesh3d>(&app, entity).0 == mesh);
        app.world_mut().despawn(entity);
        steps(&mut app, 3);
        assert_eq!(stock(&app), before, "{name}");
    }
}

/// A room of two members falls as one, and they are back when it is healed.
#[test]
fn s10_rooms_fall_as_one() {
    let (mut app, material) = bodies();
    let room = app.world_mut().spawn((surface(), ShatterCracks { thickness: 0.1, ..loose() })).id();
    let square = add(&mut app, Mesh::from(Rectangle::new(2.0, 2.0)));
    let places =
        [Transform::from_xyz(0.0, 1.0, -1.0), Transform::from_rotation(Quat::from_rotation_x(-90f32.to_radians()))];
    let members = places.map(|place| {
        let mesh = (Mesh3d(square.clone()), MeshMaterial3d(material.clone()));
        app.world_mut().spawn((mesh, place, CrackMemberOf(room))).id()
    });
    steps(&mut app, 2);
    hit(&mut app, CrackHit::local(members[0], Vec3::new(0.0, -0.6, 0.0)).with_energy(3.0));
    settle(&mut app, room);
    shatter(&mut app, room, ShatterRequest::EVERYTHING);
    settle_shards(&mut app, room);
    assert!(app.world().resource::<Failed>().0.is_empty(), "{:?}", app.world().resource::<Failed>().0);
    let covered = area(&outside(&mut app));
    assert!((covered / 8.0 - 1.0).abs() < 0.01, "{covered} of 8");
    let (holes, of) = gone(&app, room, |_| true);
    assert!(holes == of && of > 1000, "{holes} of {of}");
    app.world_mut().commands().entity(room).heal_cracks();
    steps(&mut app, 5);
    assert!(shards(&mut app).is_empty() && app.world().get::<Mesh3d>(room).is_none());
    for member in members {
        assert!(app.world().get::<bevy::camera::visibility::RenderLayers>(member).is_none());
    }
}
