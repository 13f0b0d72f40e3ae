//! Shards: where they are, what they show, and that nothing is left of them.

use crate::support::*;
use bevy::{
    ecs::system::SystemState,
    mesh::{Indices, VertexAttributeValues},
    prelude::*,
    sprite::Anchor as SpriteAnchor,
};
use bevy_crack::{
    plugin::ShardsError,
    prelude::*,
    shatter::{Anchor, BreakAgain, BurstParams, RimLook, ShatterError, ShatterParams},
};
use std::collections::HashMap;

/// Events of one kind, as they came.
#[derive(Resource)]
struct Heard<E>(Vec<E>);

fn listen<E: Event + Clone>(app: &mut App) {
    app.insert_resource(Heard::<E>(Vec::new()));
    app.add_observer(|event: On<E>, mut heard: ResMut<Heard<E>>| heard.0.push(event.event().clone()));
}

fn heard<E: Event + Clone>(app: &mut App) -> Vec<E> {
    core::mem::take(&mut app.world_mut().resource_mut::<Heard<E>>().0)
}

/// Everything may fall, lines go on to the next one, nothing moves.
pub(crate) fn loose() -> ShatterCracks {
    ShatterCracks {
        cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
        anchor: Anchor::Nothing,
        rim: Some(RimLook::PLAIN),
        speed: 0.0,
        ..default()
    }
}

/// A sprite with a cracked picture, ready to shatter.
pub(crate) fn cracked(app: &mut App, size: UVec2, settings: ShatterCracks) -> Entity {
    let image = add(app, picture(size));
    let entity = app.world_mut().spawn((Sprite::from_image(image), surface(), settings)).id();
    crack(app, entity);
    entity
}

pub(crate) fn surface() -> CrackSurface {
    CrackSurface::new(CrackPreset::GLASS).with_seed(4)
}

pub(crate) fn crack(app: &mut App, entity: Entity) {
    hit(app, CrackHit::uv(entity, Vec2::new(0.4, 0.6)).with_energy(3.0));
    settle(app, entity);
}

pub(crate) fn shatter(app: &mut App, entity: Entity, request: ShatterRequest) {
    app.world_mut().commands().entity(entity).shatter_cracks(request);
    // They are there two frames later.
    steps(app, 3);
}

pub(crate) fn shards(app: &mut App) -> Vec<Entity> {
    app.world_mut().query_filtered::<Entity, With<Shard>>().iter(app.world()).collect()
}

/// Entities, meshes, images, 2D and 3D materials.
pub(crate) fn stock(app: &App) -> [usize; 5] {
    let world = app.world();
    [
        world.entities().count_spawned() as usize,
        world.resource::<Assets<Mesh>>().len(),
        world.resource::<Assets<Image>>().len(),
        world.resource::<Assets<ColorMaterial>>().len(),
        world.resource::<Assets<StandardMaterial>>().len(),
    ]
}

/// Places of a mesh's vertices and their texture coordinates.
pub(crate) fn vertices(app: &App, mesh: &Handle<Mesh>) -> Vec<(Vec3, Vec2)> {
    let mesh = app.world().resource::<Assets<Mesh>>().get(mesh).expect("the mesh");
    let Some(VertexAttributeValues::Float32x3(places)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION) else { panic!() };
    let Some(VertexAttributeValues::Float32x2(uvs)) = mesh.attribute(Mesh::ATTRIBUTE_UV_0) else { panic!() };
    places.iter().zip(uvs).map(|(place, uv)| (Vec3::from(*place), Vec2::from(*uv))).collect()
}

fn place(app: &mut App, entity: Entity, uv: Vec2) -> Vec3 {
    let mut state = SystemState::<CrackPlaces>::new(app.world_mut());
    state.get(app.world()).expect("the places").at(entity, uv).expect("a place").position
}

#[test]
fn a_hole_is_where_a_shard_was_and_the_shards_show_what_was_there() {
    let mut app = app();
    listen::<Shattered>(&mut app);
    let size = UVec2::new(96, 64);
    let entity = cracked(&mut app, size, ShatterCracks { anchor: Anchor::Border, ..loose() });
    let before = shown(&app, entity);
    shatter(&mut app, entity, ShatterRequest::ALL);
    let drawn = get::<CrackShards>(&app, entity).pieces.extended_lines().to_vec();
    let told = heard::<Shattered>(&mut app);
    assert_eq!(told.len(), 1);
    assert_eq!(told[0].shards.len(), shards(&mut app).len());
    let report: CrackShards = get(&app, entity);
    assert!(report.shown > 5 && report.gone == report.shown && (report.gone as usize) < report.pieces.len());
    // By another way: which piece lies under the centre of each texel.
    let gone: Vec<u32> = told[0].shards.iter().map(|shard| get::<Shard>(&app, *shard).number).collect();
    let after = shown(&app, entity);
    let mut n_holes = 0;
    for y in 0..size.y {
        for x in 0..size.x {
            let at = (Vec2::new(x as f32, y as f32) + 0.5) / 64.0;
            let is_gone = report.pieces.at(at).is_some_and(|piece| gone.contains(&piece));
            let i = 4 * (y * size.x + x) as usize;
            let is_drawn = drawn.iter().flat_map(|line| line.windows(2)).any(|pair| is_near(at, [pair[0], pair[1]]));
            assert!(is_drawn || after[i..i + 3] == before[i..i + 3], "colours stay, for those who blend: {x} {y}");
            assert_eq!(after[i + 3], if is_gone { 0 } else { 255 }, "{x} {y}");
            n_holes += u32::from(is_gone);
        }
    }
    assert!(n_holes > 500, "{n_holes}");
    let material = get::<MeshMaterial2d<ColorMaterial>>(&app, told[0].shards[0]).0;
    let texture = app.world().resource::<Assets<ColorMaterial>>().get(&material).unwrap().texture.clone().unwrap();
    let opaque: Vec<u8> =
        after.as_chunks::<4>().0.iter().flat_map(|texel| [texel[0], texel[1], texel[2], 255]).collect();
    assert!(texels(&app, &texture) == opaque, "the shards show the picture without holes");
}

/// Whether a place lies within some texels of a picture of 64 (pattern units) of a line.
fn is_near(at: Vec2, [from, to]: [Vec2; 2]) -> bool {
    let share = (at - from).dot(to - from) / (to - from).length_squared().max(1e-12);
    at.distance(from + (to - from) * share.clamp(0.0, 1.0)) < 4.0 / 64.0
}

#[test]
fn every_corner_of_every_shard_stands_where_the_surface_shows_it() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::new(128, 96)));
    let quad = add(&mut app, Mesh::from(Rectangle::new(3.0, 2.0)));
    let texture = Some(image.clone());
    let flat = add(&mut app, ColorMaterial { texture: texture.clone(), ..default() });
    let solid = add(&mut app, StandardMaterial { base_color_texture: texture, ..default() });
    let turned = Transform::from_xyz(3.0, -7.0, 2.0)
        .with_rotation(Quat::from_euler(EulerRot::XYZ, 0.3, -0.4, 2.0))
        .with_scale(Vec3::new(2.0, 1.5, 1.0));
    let sprite = Sprite::from_image(image.clone());
    let sprites = [
        (sprite.clone(), SpriteAnchor::CENTER),
        (Sprite { flip_x: true, custom_size: Some(Vec2::new(30.0, 50.0)), ..sprite.clone() }, SpriteAnchor::TOP_LEFT),
        (Sprite { flip_y: true, rect: Some(Rect::new(16.0, 8.0, 112.0, 72.0)), ..sprite }, SpriteAnchor::BOTTOM_RIGHT),
    ];
    let mut surfaces = Vec::new();
    for (sprite, anchor) in sprites {
        let rect = sprite
            .rect
            .map_or([Vec2::ZERO, Vec2::ONE], |rect| [rect.min, rect.max].map(|p| p / Vec2::new(128.0, 96.0)));
        surfaces.push((app.world_mut().spawn((sprite, anchor, turned, surface(), loose())).id(), rect));
    }
    let whole = [Vec2::ZERO, Vec2::ONE];
    let mesh = (Mesh2d(quad.clone()), MeshMaterial2d(flat));
    surfaces.push((app.world_mut().spawn((mesh, turned, surface(), loose())).id(), whole));
    let mesh = (Mesh3d(quad), MeshMaterial3d(solid));
    surfaces.push((app.world_mut().spawn((mesh, turned, surface(), loose())).id(), whole));
    for (entity, [uv_min, uv_max]) in surfaces {
        crack(&mut app, entity);
        shatter(&mut app, entity, ShatterRequest::ALL);
        let all = shards(&mut app);
        assert!(all.len() > 5, "{}", all.len());
        let mut area = 0.0;
        for shard in all {
            let at = get::<GlobalTransform>(&app, shard);
            let world = app.world();
            let (flat, solid) = (world.get::<Mesh2d>(shard), world.get::<Mesh3d>(shard));
            let is_solid = solid.is_some();
            let mesh = flat.map(|mesh| mesh.0.clone()).or(solid.map(|mesh| mesh.0.clone())).expect("a mesh");
            for (corner, uv) in vertices(&app, &mesh) {
                if is_solid && corner.z < 0.0 {
                    continue;
                }
                let expected = place(&mut app, entity, (uv - uv_min) / (uv_max - uv_min));
                let distance = at.transform_point(corner).distance(expected);
                assert!(distance < 5e-3, "{uv} {distance}");
            }
            let shard = get::<Shard>(&app, shard);
            area += shard.area();
            let convex: f32 = shard
                .convex_pieces(0.0)
                .iter()
                .map(|piece| {
                    (0..piece.len()).map(|i| piece[i].perp_dot(piece[(i + 1) % piece.len()])).sum::<f32>() / 2.0
                })
                .sum();
            assert!((convex.abs() - shard.area()).abs() < 1e-3 * shard.area().max(1e-3), "{convex}");
        }
        let corner = place(&mut app, entity, Vec2::ZERO);
        let to_local = get::<GlobalTransform>(&app, entity).affine().inverse();
        let local = |p: Vec3| to_local.transform_point3(p);
        let (x, y) = (place(&mut app, entity, Vec2::X), place(&mut app, entity, Vec2::Y));
        let whole = local(corner).distance(local(x)) * local(corner).distance(local(y));
        assert!((area - whole).abs() < 1e-3 * whole, "they tile it: {area} of {whole}");
        app.world_mut().despawn(entity);
        step(&mut app);
        assert!(shards(&mut app).is_empty(), "shards go with their surface");
    }
}

/// A material that shows no holes does so while there are some, whatever other material it is given, and not a frame longer.
#[test]
fn materials_are_open_as_long_as_there_are_holes() {
    let mut app = app();
    let mut material = |size| {
        let image = add(&mut app, picture(UVec2::splat(size)));
        add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() })
    };
    let [before, other] = [96, 64].map(&mut material);
    let unread = add(&mut app, StandardMaterial { base_color_texture: Some(Handle::default()), ..default() });
    let quad = add(&mut app, Mesh::from(Rectangle::new(2.0, 2.0)));
    let entity = app.world_mut().spawn((Mesh3d(quad), MeshMaterial3d(before), surface(), loose())).id();
    let mode = |app: &App| {
        let own = get::<MeshMaterial3d<StandardMaterial>>(app, entity).0;
        app.world().resource::<Assets<StandardMaterial>>().get(&own).expect("a material").alpha_mode
    };
    crack(&mut app, entity);
    assert_eq!(mode(&app), AlphaMode::Opaque);
    shatter(&mut app, entity, ShatterRequest::ALL);
    assert_eq!(mode(&app), AlphaMode::Mask(0.5));
    // Its picture is not there yet: the surface goes on showing its holes.
    app.world_mut().get_mut::<MeshMaterial3d<StandardMaterial>>(entity).unwrap().0 = unread;
    for _ in 0..5 {
        step(&mut app);
        let is_open = mode(&app) == AlphaMode::Mask(0.5);
        assert_eq!(is_open, app.world().get::<CrackShards>(entity).is_some());
    }
    // Whole again on another picture, it is as that one is.
    app.world_mut().get_mut::<MeshMaterial3d<StandardMaterial>>(entity).unwrap().0 = other;
    steps(&mut app, 20);
    assert!(app.world().get::<CrackShards>(entity).is_none());
    assert_eq!(mode(&app), AlphaMode::Opaque);
    // All shards come back.
    shatter(&mut app, entity, ShatterRequest::ALL);
    assert_eq!(mode(&app), AlphaMode::Mask(0.5));
    app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = -1.0;
    steps(&mut app, 10);
    assert!(app.world().get::<CrackShards>(entity).is_none(), "it is whole");
    assert_eq!(mode(&app), AlphaMode::Opaque);
}

#[test]
fn shards_of_3d_surfaces_are_closed() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(96)));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() });
    for mirror in [1.0, -1.0] {
        let mut quad = Mesh::from(Rectangle::new(2.0, 2.0));
        if let Some(VertexAttributeValues::Float32x2(uvs)) = quad.attribute_mut(Mesh::ATTRIBUTE_UV_0)
            && mirror < 0.0
        {
            uvs.iter_mut().for_each(|uv| uv[0] = 1.0 - uv[0]);
        }
        let quad = add(&mut app, quad);
        let settings = ShatterCracks { thickness: 0.1, ..loose() };
        let entity = app.world_mut().spawn((Mesh3d(quad), MeshMaterial3d(material.clone()), surface(), settings)).id();
        crack(&mut app, entity);
        let own = get::<MeshMaterial3d<StandardMaterial>>(&app, entity).0;
        shatter(&mut app, entity, ShatterRequest::ALL);
        let own = app.world().resource::<Assets<StandardMaterial>>().get(&own).unwrap();
        assert_eq!(own.alpha_mode, AlphaMode::Mask(0.5), "holes can be seen through");
        for shard in shards(&mut app) {
            let sides = app.world().get::<Children>(shard).expect("its sides")[0];
            let parts = [get::<Mesh3d>(&app, shard).0, get::<Mesh3d>(&app, sides).0];
            // Volume by the divergence theorem: only right if all faces look outward and none is missing.
            let (mut volume, mut edges) = (0.0, HashMap::<[[i32; 3]; 2], i32>::new());
            for part in &parts {
                let places: Vec<Vec3> = vertices(&app, part).into_iter().map(|(place, _)| place).collect();
                let mesh = app.world().resource::<Assets<Mesh>>().get(part).unwrap();
                let Some(VertexAttributeValues::Float32x3(normals)) = mesh.attribute(Mesh::ATTRIBUTE_NORMAL) else {
                    panic!()
                };
                let Some(VertexAttributeValues::Float32x4(tangents)) = mesh.attribute(Mesh::ATTRIBUTE_TANGENT) else {
                    panic!()
                };
                let Some(Indices::U32(indices)) = mesh.indices() else { panic!() };
                for corner in indices.as_chunks::<3>().0 {
                    let [a, b, c] = corner.map(|i| places[i as usize]);
                    volume += a.dot(b.cross(c)) / 6.0;
                    let normal = Vec3::from(normals[corner[0] as usize]);
                    assert!((b - a).cross(c - a).dot(normal) >= -1e-6, "a face looks inward");
                    let [x, y, z, w] = tangents[corner[0] as usize];
                    assert!(Vec3::new(x, y, z).dot(normal).abs() < 1e-5 && w.abs() == 1.0);
                    for (a, b) in [(a, b), (b, c), (c, a)] {
                        let key = |p: Vec3| (p * 1e6).round().as_ivec3().to_array();
                        *edges.entry([key(a), key(b)]).or_default() += 1;
                        *edges.entry([key(b), key(a)]).or_default() -= 1;
                    }
                }
            }
            let expected = get::<Shard>(&app, shard).area() * 0.2;
            assert!((volume - expected).abs() < 1e-3 * expected.max(1e-3), "{volume} {expected}");
            assert!(edges.values().all(|n| *n == 0), "an open edge");
        }
        app.world_mut().despawn(entity);
        step(&mut app);
    }
}

#[test]
fn where_a_shard_is_depends_on_the_time_alone() {
    let mut app = app();
    listen::<Shattered>(&mut app);
    listen::<Reassembled>(&mut app);
    let before_all = stock(&app);
    let entity = cracked(&mut app, UVec2::splat(64), ShatterCracks { speed: 1.0, ..loose() });
    step(&mut app);
    let (before, whole) = (stock(&app), shown(&app, entity));
    shatter(&mut app, entity, ShatterRequest::ALL);
    let places = |app: &mut App| -> Vec<(u32, Transform)> {
        let mut places: Vec<_> =
            shards(app).iter().map(|shard| (get::<Shard>(app, *shard).number, get(app, *shard))).collect();
        places.sort_by_key(|(number, _)| *number);
        places
    };
    let at_rest = places(&mut app);
    let set = |app: &mut App, change: fn(&mut ShatterCracks)| {
        change(&mut app.world_mut().get_mut::<ShatterCracks>(entity).unwrap());
    };
    steps(&mut app, 40);
    let moved = places(&mut app);
    assert!(at_rest.iter().zip(&moved).all(|(a, b)| a.1.translation.distance(b.1.translation) > 0.1), "all fly");
    assert!(moved.iter().all(|(_, place)| place.translation.z == at_rest[0].1.translation.z), "none behind the scene");
    assert!((get::<CrackShards>(&app, entity).time - 0.8).abs() < 1e-4);
    // All fade, and are gone.
    steps(&mut app, 200);
    assert!(shards(&mut app).is_empty());
    assert_eq!(get::<CrackShards>(&app, entity).shown, 0);
    // Back again.
    set(&mut app, |settings| (settings.seek, settings.speed) = (Some(0.8), 0.0));
    step(&mut app);
    for (a, b) in moved.iter().zip(&places(&mut app)) {
        assert!(a.0 == b.0 && a.1.translation.distance(b.1.translation) < 1e-3, "{a:?} {b:?}");
    }
    set(&mut app, |settings| settings.seek = Some(f32::NAN));
    step(&mut app);
    assert_eq!(places(&mut app), at_rest);
    set(&mut app, |settings| (settings.seek, settings.speed) = (Some(0.5), -1.0));
    steps(&mut app, 24);
    assert_eq!(heard::<Reassembled>(&mut app), []);
    steps(&mut app, 3);
    assert_eq!(heard::<Reassembled>(&mut app), [Reassembled { entity }]);
    steps(&mut app, 2);
    assert!(shown(&app, entity) == whole, "the surface is whole, bit for bit");
    assert!(app.world().get::<CrackShards>(entity).is_none());
    assert_eq!(stock(&app), before);
    // And once more.
    set(&mut app, |settings| settings.speed = 1.0);
    shatter(&mut app, entity, ShatterRequest::ALL);
    assert_eq!(places(&mut app), at_rest);
    app.world_mut().despawn(entity);
    steps(&mut app, 2);
    assert_eq!(stock(&app), before_all);
}

#[test]
fn what_was_released_later_returns_earlier() {
    let mut app = app();
    let entity = cracked(&mut app, UVec2::splat(96), ShatterCracks { speed: 1.0, ..loose() });
    let whole = shown(&app, entity);
    shatter(&mut app, entity, ShatterRequest::around(Vec2::splat(0.25), 0.05));
    let first = get::<CrackShards>(&app, entity).gone;
    let with_first = shown(&app, entity);
    steps(&mut app, 20);
    shatter(&mut app, entity, ShatterRequest::around(Vec2::splat(0.75), 0.05));
    assert!(get::<CrackShards>(&app, entity).gone > first && first > 0);
    assert!(shown(&app, entity) != with_first);
    app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = -1.0;
    steps(&mut app, 5);
    assert_eq!(get::<CrackShards>(&app, entity).gone, first);
    assert!(shown(&app, entity) == with_first);
    steps(&mut app, 30);
    assert!(shown(&app, entity) == whole);
}

#[test]
fn a_surface_with_a_hole_goes_on_being_hit_and_shattered() {
    let mut app = app();
    listen::<Shattered>(&mut app);
    let entity = cracked(&mut app, UVec2::splat(128), ShatterCracks { anchor: Anchor::Border, ..loose() });
    shatter(&mut app, entity, ShatterRequest::around(Vec2::new(0.4, 0.6), 0.02));
    let first = heard::<Shattered>(&mut app).remove(0).shards;
    let hole = get::<Shard>(&app, first[0]);
    let at = hole.pieces.inner_point(hole.number).unwrap();
    let rejected = counts(&app).rejected;
    hit(&mut app, CrackHit::uv(entity, at));
    step(&mut app);
    assert_eq!(counts(&app).rejected, rejected + 1, "there is nothing to hit");
    let nodes = state(&app, entity).nodes;
    hit(&mut app, CrackHit::uv(entity, Vec2::new(0.85, 0.15)).with_energy(2.0));
    settle(&mut app, entity);
    assert!(state(&app, entity).nodes > nodes, "but elsewhere");
    let before = shown(&app, entity);
    shatter(&mut app, entity, ShatterRequest::ALL);
    let second = heard::<Shattered>(&mut app).remove(0).shards;
    assert!(second.len() > 2 && second.iter().all(|shard| !first.contains(shard)));
    // No texel falls twice, and the new shards show the new cracks.
    let material = get::<MeshMaterial2d<ColorMaterial>>(&app, second[0]).0;
    let texture = app.world().resource::<Assets<ColorMaterial>>().get(&material).unwrap().texture.clone().unwrap();
    let (after, copy) = (shown(&app, entity), texels(&app, &texture));
    let mut n_new = 0;
    for (i, texel) in after.as_chunks::<4>().0.iter().enumerate() {
        if texel[3] == 0 && before[4 * i + 3] != 0 {
            assert_eq!(copy[4 * i..4 * i + 3], texel[..3]);
            n_new += 1;
        }
        assert_ne!(copy[4 * i + 3], 0, "a shard with a hole");
    }
    let area: f32 = second.iter().map(|shard| get::<Shard>(&app, *shard).area()).sum();
    assert!((area - n_new as f32).abs() < 0.03 * area, "{area} {n_new}");
    // What is gone is gone.
    shatter(&mut app, entity, ShatterRequest::ALL);
    assert!(heard::<Shattered>(&mut app).is_empty());
}

#[test]
fn many_shards_share_what_they_can_and_the_oldest_make_room() {
    let mut app = app();
    let image = add(&mut app, picture(UVec2::splat(256)));
    let burst = BurstParams { hold: 0.0, fade_after: 0.1, fade: 0.2, ..BurstParams::DEFAULT };
    let settings = ShatterCracks { speed: 1.0, burst, ..loose() };
    let entity = app.world_mut().spawn((Sprite::from_image(image), surface(), settings)).id();
    for i in 0..64 {
        let at = Vec2::new(0.06 + 0.125 * (i % 8) as f32, 0.07 + 0.123 * (i / 8) as f32);
        hit(&mut app, CrackHit::uv(entity, at).with_energy(2.0));
    }
    settle(&mut app, entity);
    step(&mut app);
    let before = stock(&app);
    shatter(&mut app, entity, ShatterRequest::ALL);
    let (n, after) = (shards(&mut app).len(), stock(&app));
    assert!(n >= 500, "{n}");
    let [entities, meshes, images, materials, _] = [0, 1, 2, 3, 4].map(|i| after[i] - before[i]);
    assert_eq!([entities, meshes, images, materials], [n, n, 1, 1]);
    let mut most = 0;
    while !shards(&mut app).is_empty() {
        step(&mut app);
        most = most.max(stock(&app)[3] - before[3]);
    }
    assert!((2..=8).contains(&most), "shards that fade share their materials: {most}");
    app.world_mut().commands().entity(entity).heal_cracks();
    steps(&mut app, 2);

    app.world_mut().resource_mut::<CrackBudget>().max_shards = 20;
    let [first, second] = [1, 2].map(|_| cracked(&mut app, UVec2::splat(64), loose()));
    shatter(&mut app, first, ShatterRequest::ALL);
    let of_first = shards(&mut app);
    assert_eq!((of_first.len(), get::<CrackShards>(&app, first).shown), (20, 20));
    shatter(&mut app, second, ShatterRequest::around(Vec2::splat(0.5), 0.0));
    let all = shards(&mut app);
    // The entity of the oldest serves for it.
    let n_new = all.iter().filter(|shard| get::<Shard>(&app, **shard).surface == second).count();
    assert_eq!((all.len(), n_new), (20, 1));
    assert_eq!(get::<CrackShards>(&app, first).shown, 19);
}

#[test]
fn shards_fall_by_themselves() {
    let mut app = app();
    listen::<Shattered>(&mut app);
    for when in [ShatterWhen::AtDamage(0.05), ShatterWhen::CellsAsTheyClose, ShatterWhen::AtDamage(1.1)] {
        let settings = ShatterCracks { when, anchor: Anchor::Border, speed: 1.0, ..loose() };
        let entity = cracked(&mut app, UVec2::splat(96), settings);
        steps(&mut app, 6);
        let told = heard::<Shattered>(&mut app);
        match when {
            ShatterWhen::AtDamage(damage) if damage > 1.0 => assert!(told.is_empty()),
            ShatterWhen::AtDamage(_) => assert_eq!(told.len(), 1),
            _ => assert!(told.len() > 1, "one after the other: {}", told.len()),
        }
        if when == ShatterWhen::AtDamage(0.05) {
            // Whole again, it does not fall for the same cracks.
            app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = -1.0;
            steps(&mut app, 10);
            app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = 1.0;
            steps(&mut app, 10);
            assert!(heard::<Shattered>(&mut app).is_empty() && shards(&mut app).is_empty());
        }
        app.world_mut().despawn(entity);
    }
}

#[test]
fn without_flight_shards_stay_for_others_to_move() {
    let mut app = app();
    listen::<Shattered>(&mut app);
    let entity = cracked(&mut app, UVec2::splat(64), ShatterCracks { fly: false, speed: 1.0, ..loose() });
    shatter(&mut app, entity, ShatterRequest::ALL);
    let shard = heard::<Shattered>(&mut app).remove(0).shards[0];
    let at: Transform = get(&app, shard);
    assert!(get::<Shard>(&app, shard).velocity.length() > 1.0);
    app.world_mut().get_mut::<Transform>(shard).unwrap().translation.x += 5.0;
    steps(&mut app, 300);
    assert_eq!(get::<Transform>(&app, shard).translation, at.translation + 5.0 * Vec3::X);
    // A game may take a shard away.
    app.world_mut().despawn(shard);
    steps(&mut app, 2);
    app.world_mut().commands().entity(entity).heal_cracks();
    steps(&mut app, 2);
    assert!(shards(&mut app).is_empty());
}

#[test]
fn what_cannot_shatter_says_so_and_stays_whole() {
    let mut app = app();
    listen::<Shattered>(&mut app);
    listen::<ShatterFailed>(&mut app);
    let entity = cracked(&mut app, UVec2::splat(64), loose());
    let whole = shown(&app, entity);
    let all = ShatterRequest::ALL;
    let fails = |app: &mut App, entity: Entity, request: ShatterRequest| -> ShardsError {
        shatter(app, entity, request);
        assert!(heard::<Shattered>(app).is_empty() && shards(app).is_empty());
        heard::<ShatterFailed>(app).remove(0).error
    };
    let name = |error: ShardsError| match error {
        ShardsError::Parameter(ShatterError::OutOfRange { name, .. }) => name,
        _ => panic!("{error}"),
    };
    assert_eq!(name(fails(&mut app, entity, ShatterRequest { reach: f32::NAN, ..all })), "reach");
    assert_eq!(name(fails(&mut app, entity, ShatterRequest { reach: -1.0, ..all })), "reach");
    assert_eq!(name(fails(&mut app, entity, all.with_energy(f32::INFINITY))), "energy");
    assert_eq!(name(fails(&mut app, entity, ShatterRequest::around(Vec2::NAN, 1.0))), "uv");
    assert_eq!(name(fails(&mut app, entity, ShatterRequest::around(Vec2::splat(1e30), 1.0))), "uv");
    assert_eq!(name(fails(&mut app, entity, ShatterRequest { direction: Some(Vec3::NAN), ..all })), "direction");
    let broken: [(&str, fn(&mut ShatterCracks)); 6] = [
        ("thickness", |settings| settings.thickness = f32::NAN),
        ("min_area", |settings| settings.cut.min_area = -1.0),
        ("max_shards", |settings| settings.cut.max_shards = 0),
        ("drag", |settings| settings.burst.drag = f32::NAN),
        ("bright", |settings| settings.rim = Some(RimLook { bright: f32::NAN, ..RimLook::GLASS })),
        ("after", |settings| settings.again = Some(BreakAgain { after: 0.0, ..BreakAgain::DEFAULT })),
    ];
    for (expected, change) in broken {
        change(&mut app.world_mut().get_mut::<ShatterCracks>(entity).unwrap());
        assert_eq!(name(fails(&mut app, entity, all)), expected);
        app.world_mut().entity_mut(entity).insert(loose());
    }
    app.world_mut().resource_mut::<CrackBudget>().max_texture_bytes = 0;
    assert!(matches!(fails(&mut app, entity, all), ShardsError::TextureBudget { .. }));
    app.world_mut().resource_mut::<CrackBudget>().max_texture_bytes = 1 << 30;
    assert!(shown(&app, entity) == whole);

    let (image, ball) = (add(&mut app, picture(UVec2::splat(64))), add(&mut app, Mesh::from(Sphere::new(1.0))));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image.clone()), ..default() });
    // As it is: laid out, it shatters.
    let round = surface().with_unwrap(CrackUnwrap::Never);
    let ball = app.world_mut().spawn((Mesh3d(ball), MeshMaterial3d(material), round, loose())).id();
    hit(&mut app, center(ball));
    settle(&mut app, ball);
    assert!(matches!(fails(&mut app, ball, all), ShardsError::NotFlat { .. }));
    let dark = CrackSurface { write: CrackMaps { diffuse: false, ..default() }, ..surface() };
    let dark = app.world_mut().spawn((Sprite::from_image(image), dark, loose())).id();
    hit(&mut app, center(dark));
    settle(&mut app, dark);
    assert_eq!(fails(&mut app, dark, all), ShardsError::NoDiffuse);

    // Nothing to shatter is no failure.
    let untouched = spawn_picture(&mut app, UVec2::splat(8));
    shatter(&mut app, untouched, all);
    app.world_mut().commands().entity(untouched).shatter_cracks(all).despawn();
    steps(&mut app, 3);
    assert!(heard::<ShatterFailed>(&mut app).is_empty() && heard::<Shattered>(&mut app).is_empty());
    // Odd speeds do no harm.
    shatter(&mut app, entity, all);
    for speed in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, 0.0] {
        app.world_mut().get_mut::<ShatterCracks>(entity).unwrap().speed = speed;
        steps(&mut app, 3);
        assert!(shards(&mut app).iter().all(|shard| get::<Transform>(&app, *shard).is_finite()));
    }
}

#[test]
fn what_is_flat_along_z_shatters() {
    let mut app = app();
    listen::<ShatterFailed>(&mut app);
    for scale in [Vec3::new(2.0, 2.0, 0.0), Vec3::ZERO] {
        let entity = cracked(&mut app, UVec2::splat(64), loose());
        app.world_mut().entity_mut(entity).insert(Transform::from_scale(scale));
        steps(&mut app, 1);
        let direction = Some(Vec3::new(1.0, 0.5, -1.0));
        shatter(&mut app, entity, ShatterRequest { direction, ..ShatterRequest::ALL });
        steps(&mut app, 3);
        assert!(heard::<ShatterFailed>(&mut app).is_empty(), "{scale}");
        let shards = shards(&mut app);
        assert!(!shards.is_empty(), "{scale}");
        assert!(shards.iter().all(|shard| get::<Transform>(&app, *shard).is_finite()), "{scale}");
        app.world_mut().despawn(entity);
    }
}

#[test]
fn another_picture_makes_the_surface_whole() {
    let mut app = app();
    let entity = cracked(&mut app, UVec2::splat(64), loose());
    shatter(&mut app, entity, ShatterRequest::ALL);
    assert!(!shards(&mut app).is_empty());
    let other = add(&mut app, solid(UVec2::new(80, 60), [90, 120, 150, 255]));
    app.world_mut().get_mut::<Sprite>(entity).unwrap().image = other;
    steps(&mut app, 3);
    assert!(shards(&mut app).is_empty());
    assert!(shown(&app, entity).as_chunks::<4>().0.iter().all(|texel| texel[3] == 255));
    shatter(&mut app, entity, ShatterRequest::ALL);
    assert!(!shards(&mut app).is_empty());
}

#[test]
fn shards_in_their_places_look_as_the_surface_did() {
    let Some((_one, mut app)) = gpu_app() else { return };
    let size = UVec2::new(120, 90);
    let target = spawn_camera(&mut app, size);
    let image = add(&mut app, picture(size));
    let sprite = Sprite { flip_x: true, ..Sprite::from_image(image) };
    let entity = app.world_mut().spawn((sprite, surface(), loose())).id();
    crack(&mut app, entity);
    // What is carried on is drawn with the first shard.
    shatter(&mut app, entity, ShatterRequest::around(Vec2::new(0.98, 0.02), 0.0));
    let before = drawn(&mut app, &target);
    shatter(&mut app, entity, ShatterRequest::around(Vec2::new(0.4, 0.6), 0.3));
    let after = drawn(&mut app, &target);
    let n = shards(&mut app).len();
    assert!(n > 5);
    // A texel of the target is one of the surface: only where an edge runs may another be hit.
    let differing = before.as_chunks::<4>().0.iter().zip(after.as_chunks::<4>().0);
    let differing = differing.filter(|(a, b)| difference(&a[..], &b[..]) > 1).count();
    assert!(differing < before.len() / 4 / 200, "{differing} texels of {} differ", before.len() / 4);
    for shard in shards(&mut app) {
        app.world_mut().entity_mut(shard).insert(Visibility::Hidden);
    }
    let without = drawn(&mut app, &target);
    let dark = without.as_chunks::<4>().0.iter().filter(|texel| texel[..3] == [0, 0, 0]).count();
    assert!(dark > 300, "one sees through the holes: {dark}");
}

/// What an image holds stays, and what it no longer holds falls.
#[test]
fn an_anchor_mask_holds_a_side() {
    let mut app = app();
    listen::<ShatterFailed>(&mut app);
    let mut mask = solid(UVec2::new(10, 1), [0, 0, 0, 255]);
    mask.data.iter_mut().flatten().take(4).for_each(|byte| *byte = 255);
    let mask = add(&mut app, mask);
    let mut fallen = |anchor_mask: Option<Handle<Image>>| {
        let entity = cracked(&mut app, UVec2::splat(96), ShatterCracks { anchor_mask, ..loose() });
        // A gap from the top to the bottom: the right half hangs on nothing but the left one.
        for row in 0..12 {
            let at = Vec2::new(0.5, (row as f32 + 0.5) / 12.0);
            shatter(&mut app, entity, ShatterRequest::around(at, 0.12));
        }
        let report: CrackShards = get(&app, entity);
        let gone: Vec<u32> = shards(&mut app).into_iter().map(|shard| get::<Shard>(&app, shard).number).collect();
        let at = |x: f32| report.pieces.iter().enumerate().filter(move |(_, shard)| (shard.centroid.x - x).abs() < 0.1);
        let is_gone = |x: f32| at(x).filter(|(number, _)| gone.contains(&(*number as u32))).count();
        let counts = (is_gone(0.1), is_gone(0.9), at(0.1).count(), at(0.9).count());
        app.world_mut().despawn(entity);
        steps(&mut app, 2);
        counts
    };
    let (left, right, all_left, all_right) = fallen(None);
    assert!(left == 0 && right == 0 && all_left > 0 && all_right > 0, "nothing holds it, nothing falls by itself");
    let (left, right, _, all_right) = fallen(Some(mask));
    assert_eq!((left, right), (0, all_right), "what is held at the left");
    let never = app.world().resource::<Assets<Image>>().reserve_handle();
    let entity = cracked(&mut app, UVec2::splat(32), ShatterCracks { anchor_mask: Some(never), ..loose() });
    shatter(&mut app, entity, ShatterRequest::ALL);
    let failed = heard::<ShatterFailed>(&mut app);
    assert!(matches!(&failed[..], [ShatterFailed { error: ShardsError::AnchorMask { .. }, .. }]), "{failed:?}");
}
