//! Meshes that crack as one surface.

use crate::{
    shards::{stock, vertices},
    support::*,
};
use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::RenderLayers,
    light::{NotShadowCaster, NotShadowReceiver},
    math::Affine2,
    mesh::{PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use bevy_crack::{math::Rng, prelude::*};
use core::f32::consts::{FRAC_PI_2, PI};

fn preset() -> CrackPreset {
    CrackPreset::CONCRETE
}

/// A picture of greys of which hardly two are alike.
fn speckled(size: UVec2, seed: u64) -> Image {
    let mut image = picture(size);
    let mut rng = Rng::new(seed);
    for texel in image.data.as_mut().expect("data").as_chunks_mut::<4>().0 {
        *texel = {
            let [red, green, blue] = [0; 3].map(|_: u8| 90 + (rng.next_u32() % 60) as u8);
            [red, green, blue, 255]
        };
    }
    image
}

/// Where the six walls of a room are whose inside is 2 x 2 x 2 and which are seen from inside.
fn walls() -> [Transform; 6] {
    let turns = [
        Quat::IDENTITY,
        Quat::from_rotation_y(FRAC_PI_2),
        Quat::from_rotation_y(PI),
        Quat::from_rotation_y(-FRAC_PI_2),
        Quat::from_rotation_x(FRAC_PI_2),
        Quat::from_rotation_x(-FRAC_PI_2),
    ];
    // A rectangle faces its own z.
    turns.map(|turn| Transform::from_rotation(turn).with_translation(turn * Vec3::NEG_Z))
}

fn spawn_room(app: &mut App, material: &Handle<StandardMaterial>, place: Transform) -> (Entity, Vec<Entity>) {
    let group = app.world_mut().spawn((CrackSurface::new(preset()).with_seed(5), place)).id();
    let mesh = add(app, Mesh::from(Rectangle::new(2.0, 2.0)));
    let spawn = |transform: Transform| {
        let shown = (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()));
        app.world_mut().spawn((shown, transform, CrackMemberOf(group), ChildOf(group))).id()
    };
    (group, walls().map(spawn).to_vec())
}

/// The same room as one mesh.
fn one_mesh() -> Mesh {
    let wall = Mesh::from(Rectangle::new(2.0, 2.0));
    let (mut places, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    let read = |attribute| wall.attribute(attribute).expect("it");
    let (Some(VertexAttributeValues::Float32x3(at)), VertexAttributeValues::Float32x2(uv)) =
        (wall.attribute(Mesh::ATTRIBUTE_POSITION), read(Mesh::ATTRIBUTE_UV_0))
    else {
        panic!()
    };
    for transform in walls() {
        let place = GlobalTransform::from(transform).affine();
        for index in wall.indices().expect("indices").iter() {
            places.push(place.transform_point3(Vec3::from(at[index])).to_array());
            normals.push((transform.rotation * Vec3::Z).to_array());
            uvs.push(uv[index]);
        }
    }
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, places)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
}

fn is_hidden(app: &App, member: Entity) -> bool {
    app.world().get::<RenderLayers>(member) == Some(&RenderLayers::none())
}

/// Sums of the areas of the triangles that an entity shows on each of the walls of the room.
fn areas(app: &App, entity: Entity) -> [f32; 6] {
    let all = vertices(app, &get::<Mesh3d>(app, entity).0);
    walls().map(|wall| {
        let inward = wall.rotation * Vec3::Z;
        let area = |corners: &[(Vec3, Vec2); 3]| {
            let across = (corners[1].0 - corners[0].0).cross(corners[2].0 - corners[0].0);
            if across.normalize_or_zero().dot(inward) > 0.99 { 0.5 * across.length() } else { 0.0 }
        };
        all.as_chunks::<3>().0.iter().map(area).sum()
    })
}

/// A group is drawn where its members are, with the shadows that they have, and has nothing of them once it is healed.
#[test]
fn a_healed_group_has_nothing_of_its_members() {
    let mut app = app();
    let picture = add(&mut app, speckled(UVec2::splat(32), 1));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(picture), ..default() });
    let (group, members) = spawn_room(&mut app, &material, Transform::default());
    let layers = [RenderLayers::layer(2), RenderLayers::layer(3)];
    for (layers, has_shadows) in layers.iter().zip([false, true]) {
        for member in &members {
            let mut member = app.world_mut().entity_mut(*member);
            member.insert(layers.clone());
            if has_shadows {
                member.remove::<(NotShadowCaster, NotShadowReceiver)>();
            } else {
                member.insert((NotShadowCaster, NotShadowReceiver));
            }
        }
        step(&mut app);
        hit(&mut app, CrackHit::world(members[0], Vec3::new(0.3, -0.9, -1.0)));
        settle(&mut app, group);
        steps(&mut app, 8);
        let given = app.world().entity(group);
        assert_eq!(given.get::<RenderLayers>(), Some(layers));
        assert_eq!(
            (given.contains::<NotShadowCaster>(), given.contains::<NotShadowReceiver>()),
            (!has_shadows, !has_shadows)
        );
        app.world_mut().commands().entity(group).heal_cracks();
        steps(&mut app, 8);
        let healed = app.world().entity(group);
        assert!(!healed.contains::<Mesh3d>() && !healed.contains::<RenderLayers>());
        assert!(!healed.contains::<NotShadowCaster>() && !healed.contains::<NotShadowReceiver>());
        assert!(members.iter().all(|member| app.world().get::<RenderLayers>(*member) == Some(layers)));
    }
}

/// Six rectangles show in every frame what one mesh of them shows, bit for bit, with the same cracks; what goes leaves the others as they are.
#[test]
fn t4_a_room_of_members_is_one_mesh() {
    let mut app = app();
    let picture = add(&mut app, speckled(UVec2::new(96, 96), 1));
    let normals = add(&mut app, solid(UVec2::splat(8), [150, 110, 240, 255]));
    let material =
        StandardMaterial { base_color_texture: Some(picture), normal_map_texture: Some(normals), ..default() };
    let material = add(&mut app, material);
    let before = stock(&app);
    // Bit for bit only where rounding is the same.
    let place = Transform::default();
    let (group, members) = spawn_room(&mut app, &material, place);
    let mesh = add(&mut app, one_mesh());
    let plain = (Mesh3d(mesh), MeshMaterial3d(material.clone()), CrackSurface::new(preset()).with_seed(5));
    let plain = app.world_mut().spawn((plain, place)).id();
    step(&mut app);
    assert!(app.world().get::<Mesh3d>(group).is_none(), "nothing is made before a hit");
    let first = place.transform_point(Vec3::new(0.3, -0.9, -1.0));
    // Both at once: which frame they begin in says when they grow.
    for entity in [group, plain] {
        app.world_mut().commands().entity(entity).prepare_cracks();
    }
    wait_for(&mut app, "both", |app| [group, plain].iter().all(|of| app.world().get::<CrackTextures>(*of).is_some()));
    steps(&mut app, 2);
    hit(&mut app, CrackHit::world(plain, first).with_energy(2.0));
    // A hit on a member is one on the group.
    hit(&mut app, CrackHit::world(members[0], first).with_energy(2.0));
    settle(&mut app, group);
    let pictures = [group, plain].map(|of| get::<CrackTextures>(&app, of).diffuse.expect("it"));
    assert_eq!(image_size(&app, &pictures[0]), image_size(&app, &pictures[1]));
    drop(pictures);
    let meshes = [group, plain].map(|of| vertices(&app, &get::<Mesh3d>(&app, of).0));
    assert_eq!(meshes[0], meshes[1]);
    for at in [Vec3::new(1.0, 0.2, 0.3), Vec3::new(-0.4, 1.0, -0.8), Vec3::new(0.0, 0.9, 1.0)] {
        hit(&mut app, CrackHit::world(plain, place.transform_point(at)));
        hit(&mut app, CrackHit::world(group, place.transform_point(at)));
        for frame in 0..40 {
            step(&mut app);
            let textures = [group, plain].map(|of| get::<CrackTextures>(&app, of));
            let diffuse = texels(&app, textures[0].diffuse.as_ref().expect("it"));
            let gaps = diffuse.as_chunks::<4>().0.iter().filter(|texel| texel[3] == 0).count();
            assert!(diffuse.len() / 4 - gaps >= 6 * 96 * 96, "all of the walls are compared");
            for pick in [|of: &CrackTextures| of.diffuse.clone(), |of: &CrackTextures| of.normal.clone()] {
                let [ours, theirs] = [&textures[0], &textures[1]].map(|of| texels(&app, &pick(of).expect("it")));
                let count = differing(&ours, &theirs, &diffuse);
                assert_eq!(count, 0, "frame {frame} after {at}");
            }
        }
        settle(&mut app, group);
        settle(&mut app, plain);
    }
    assert_eq!(state(&app, group).nodes, state(&app, plain).nodes);
    assert!(members.iter().all(|member| is_hidden(&app, *member)));
    assert_sound(&app, group);
    // Two go, and one moves.
    let cracked = texels(&app, &get::<CrackTextures>(&app, group).diffuse.expect("it"));
    app.world_mut().despawn(members[1]);
    app.world_mut().entity_mut(members[4]).remove::<CrackMemberOf>();
    app.world_mut().get_mut::<Transform>(members[5]).expect("it").translation.y += 3.0;
    steps(&mut app, 3);
    let left = areas(&app, group);
    for (wall, area) in left.into_iter().enumerate() {
        let expected = if [1, 4, 5].contains(&wall) { 0.0 } else { 4.0 };
        assert!((area - expected).abs() < 1e-3, "{wall}: {area}");
    }
    for wall in [0, 2, 3] {
        assert!(is_hidden(&app, members[wall]));
    }
    assert!(!is_hidden(&app, members[4]) && !is_hidden(&app, members[5]));
    assert!(texels(&app, &get::<CrackTextures>(&app, group).diffuse.expect("it")) == cracked);
    // What is left can be hit.
    let nodes = state(&app, group).nodes;
    hit(&mut app, CrackHit::world(group, place.transform_point(Vec3::new(-1.0, -0.5, 0.5))));
    settle(&mut app, group);
    assert!(state(&app, group).nodes > nodes);
    // Healed, all are shown as before.
    app.world_mut().commands().entity(group).heal_cracks();
    steps(&mut app, 3);
    assert!(app.world().get::<Mesh3d>(group).is_none());
    assert!(members.iter().filter(|member| **member != members[1]).all(|member| !is_hidden(&app, *member)));
    for entity in [group, plain] {
        app.world_mut().despawn(entity);
    }
    wait_for(&mut app, "an empty world", |app| stock(app)[2] == before[2]);
}

/// How many texels differ, between charts left out: there `shown` is transparent.
fn differing(a: &[u8], b: &[u8], shown: &[u8]) -> usize {
    let texels = a.as_chunks::<4>().0.iter().zip(b.as_chunks::<4>().0).zip(shown.as_chunks::<4>().0);
    texels.filter(|((a, b), shown)| a != b && shown[3] != 0).count()
}

/// A crack runs from a wall over the floor, each with its own picture, part of it, and tint; normals turn with them.
#[test]
fn walls_and_floors_keep_their_pictures() {
    let mut app = app();
    // Red on the left, green on the right.
    let mut halves = solid(UVec2::new(512, 256), [200, 40, 30, 255]);
    for (i, texel) in halves.data.as_mut().expect("data").as_chunks_mut::<4>().0.iter_mut().enumerate() {
        if i % 512 >= 256 {
            *texel = [40, 180, 50, 255];
        }
    }
    let halves = add(&mut app, halves);
    let wall = StandardMaterial {
        base_color_texture: Some(halves),
        // The right half.
        uv_transform: Affine2::from_scale_angle_translation(Vec2::new(0.5, 1.0), 0.0, Vec2::new(0.5, 0.0)),
        ..default()
    };
    let floor = StandardMaterial { base_color: Color::srgb_u8(30, 60, 220), ..default() };
    let (wall, floor) = (add(&mut app, wall), add(&mut app, floor));
    let square = add(&mut app, Mesh::from(Rectangle::new(2.0, 2.0)));
    let group = app.world_mut().spawn(CrackSurface::new(preset()).with_seed(3)).id();
    let upright = Transform::from_xyz(0.0, 1.0, -1.0);
    let level = Transform::from_rotation(Quat::from_rotation_x(-FRAC_PI_2));
    for (material, place) in [(&wall, upright), (&floor, level)] {
        app.world_mut().spawn((Mesh3d(square.clone()), MeshMaterial3d(material.clone()), place, CrackMemberOf(group)));
    }
    hit(&mut app, CrackHit::world(group, Vec3::new(0.1, 0.2, -1.0)).with_energy(3.0));
    settle(&mut app, group);
    assert_sound(&app, group);
    let texture = get::<CrackTextures>(&app, group).diffuse.expect("it");
    let (size, all) = (image_size(&app, &texture), texels(&app, &texture));
    let mesh = vertices(&app, &get::<Mesh3d>(&app, group).0);
    let (mut plain, mut cracked) = ([0; 2], [0; 2]);
    for corners in mesh.as_chunks::<3>().0 {
        let normal = (corners[1].0 - corners[0].0).cross(corners[2].0 - corners[0].0);
        let (number, expected) = if normal.z > normal.y { (0, [40, 180, 50]) } else { (1, [30, 60, 220]) };
        // Over the triangle.
        for (i, j) in (1..100).flat_map(|i| (1..100 - i).map(move |j| (i, j))) {
            let (u, v) = (i as f32 / 100.0, j as f32 / 100.0);
            let at = corners[0].1 * (1.0 - u - v) + corners[1].1 * u + corners[2].1 * v;
            let texel = (at * size.as_vec2()).as_uvec2();
            let start = 4 * (texel.y * size.x + texel.x) as usize;
            let near = expected.iter().zip(&all[start..start + 3]).all(|(a, b): (&u8, &u8)| a.abs_diff(*b) <= 1);
            if near { plain[number] += 1 } else { cracked[number] += 1 }
        }
    }
    assert!(
        plain.iter().all(|count| *count > 1000) && cracked.iter().all(|count| *count > 10),
        "{plain:?} {cracked:?}"
    );
}

fn image_size(app: &App, image: &Handle<Image>) -> UVec2 {
    app.world().resource::<Assets<Image>>().get(image).expect("the image").size()
}

/// Members that cannot be put together are left out, with one warning; a group of nothing else fails.
#[test]
fn e9_meshes_that_fit_no_group() {
    let mut app = app();
    let good = add(&mut app, Mesh::from(Rectangle::new(1.0, 1.0)));
    let material = add(&mut app, StandardMaterial::default());
    let no_uv = Mesh::from(Rectangle::new(1.0, 1.0)).with_removed_attribute(Mesh::ATTRIBUTE_UV_0);
    let lines = Mesh::new(PrimitiveTopology::LineList, RenderAssetUsages::default());
    let mut far = Mesh::from(Rectangle::new(1.0, 1.0));
    far.insert_attribute(Mesh::ATTRIBUTE_POSITION, vec![[f32::NAN; 3]; 4]);
    let bad = [no_uv, lines, far].map(|mesh| add(&mut app, mesh));
    let heard = warnings(|| {
        let group = app.world_mut().spawn(CrackSurface::new(preset())).id();
        let shown = |mesh: &Handle<Mesh>| (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()));
        let kept = app.world_mut().spawn((shown(&good), CrackMemberOf(group))).id();
        for mesh in &bad {
            app.world_mut().spawn((shown(mesh), CrackMemberOf(group)));
        }
        let flat = Transform::from_scale(Vec3::new(1.0, 0.0, 1.0));
        app.world_mut().spawn((shown(&good), flat, CrackMemberOf(group)));
        app.world_mut().spawn((Sprite::default(), CrackMemberOf(group)));
        app.world_mut().spawn((Mesh3d(good.clone()), CrackMemberOf(group)));
        hit(&mut app, CrackHit::world(group, Vec3::ZERO));
        settle(&mut app, group);
        steps(&mut app, 5);
        assert_sound(&app, group);
        assert!(is_hidden(&app, kept) && state(&app, group).nodes > 0);
    });
    assert_eq!(heard.len(), 1, "{heard:?}");
    assert!(heard[0].contains("is left out"), "{heard:?}");
    for mesh in &bad {
        let group = app.world_mut().spawn(CrackSurface::new(preset())).id();
        app.world_mut().spawn((Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()), CrackMemberOf(group)));
        hit(&mut app, CrackHit::world(group, Vec3::ZERO));
        steps(&mut app, 3);
        assert!(matches!(state(&app, group).status, CrackStatus::Failed(CrackError::Group { .. })));
    }
    // A mesh of its own.
    let own = app.world_mut().spawn((CrackSurface::new(preset()), Mesh3d(good.clone()))).id();
    app.world_mut().spawn((Mesh3d(good.clone()), MeshMaterial3d(material.clone()), CrackMemberOf(own)));
    hit(&mut app, CrackHit::world(own, Vec3::ZERO));
    steps(&mut app, 3);
    assert!(matches!(state(&app, own).status, CrackStatus::Failed(_)));
    // A preset that is invalid.
    let mut invalid = preset();
    invalid.growth.reach = f32::NAN;
    let group = app.world_mut().spawn(CrackSurface::new(invalid)).id();
    app.world_mut().spawn((Mesh3d(good.clone()), MeshMaterial3d(material.clone()), CrackMemberOf(group)));
    hit(&mut app, CrackHit::world(group, Vec3::ZERO));
    steps(&mut app, 5);
    assert!(matches!(state(&app, group).status, CrackStatus::Failed(CrackError::Preset { .. })));
    // A sprite of its own.
    let own = app.world_mut().spawn((CrackSurface::new(preset()), Sprite::default())).id();
    app.world_mut().spawn((Mesh3d(good.clone()), MeshMaterial3d(material.clone()), CrackMemberOf(own)));
    hit(&mut app, CrackHit::world(own, Vec3::ZERO));
    steps(&mut app, 3);
    assert!(matches!(state(&app, own).status, CrackStatus::Failed(CrackError::Group { .. })));
    // A picture whose texels the CPU does not have.
    let mut image = solid(UVec2::splat(4), [9; 4]);
    image.data = None;
    let image = add(&mut app, image);
    let blind = add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() });
    let group = app.world_mut().spawn(CrackSurface::new(preset())).id();
    app.world_mut().spawn((Mesh3d(good), MeshMaterial3d(blind), CrackMemberOf(group)));
    hit(&mut app, CrackHit::world(group, Vec3::ZERO));
    steps(&mut app, 3);
    assert_eq!(state(&app, group).status, CrackStatus::Failed(CrackError::NoCpuData));
}

/// Whatever happens to groups of meshes and their members, nothing is left of it.
#[test]
fn s10_whatever_happens_to_rooms() {
    let mut app = app();
    let image = add(&mut app, speckled(UVec2::splat(24), 3));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() });
    let meshes = [Mesh::from(Rectangle::new(1.0, 1.0)), Mesh::from(Cuboid::new(1.0, 1.0, 1.0))];
    let meshes = meshes.map(|mesh| add(&mut app, mesh));
    let before = stock(&app);
    let mut rng = Rng::new(78);
    let (mut groups, mut members): (Vec<Entity>, Vec<Entity>) = default();
    let mut cracked = 0;
    for frame in 0..1000 {
        let pick = |rng: &mut Rng, list: &[Entity]| list.get(rng.next_u32() as usize % list.len().max(1)).copied();
        let (group, member) = (pick(&mut rng, &groups), pick(&mut rng, &members));
        let turn = Quat::from_rotation_y(FRAC_PI_2 * (rng.next_u32() % 4) as f32);
        let at = Vec3::new((rng.next_u32() % 3) as f32, (rng.next_u32() % 2) as f32, (rng.next_u32() % 3) as f32);
        let place = Transform::from_translation(at).with_rotation(turn);
        match (rng.next_u32() % 14, group, member) {
            (0, ..) if groups.len() < 3 => {
                groups.push(app.world_mut().spawn((CrackSurface::new(small_preset()), ShatterCracks::default())).id());
            }
            (1..=4, Some(group), _) if members.len() < 30 => {
                let mesh = meshes[rng.next_u32() as usize % 2].clone();
                let shown = (Mesh3d(mesh), MeshMaterial3d(material.clone()));
                members.push(app.world_mut().spawn((shown, place, CrackMemberOf(group))).id());
            }
            (5, _, Some(member)) => {
                app.world_mut().despawn(member);
                members.retain(|other| *other != member);
            }
            (6, _, Some(member)) => *app.world_mut().get_mut::<Transform>(member).expect("it") = place,
            (7, Some(group), Some(member)) => {
                app.world_mut().entity_mut(member).insert(CrackMemberOf(group));
            }
            (8, _, Some(member)) => hit(&mut app, CrackHit::world(member, at).with_energy(2.0)),
            (9, _, Some(member)) => hit(&mut app, CrackHit::uv(member, Vec2::new(rng.unit(), rng.unit()))),
            (10, Some(group), _) => hit(&mut app, CrackHit::world(group, at)),
            (11, Some(group), _) if rng.unit() < 0.3 => {
                app.world_mut().commands().entity(group).heal_cracks();
            }
            (12, Some(group), _) if rng.unit() < 0.3 => {
                app.world_mut().commands().entity(group).shatter_cracks(ShatterRequest::default());
            }
            (13, Some(group), _) if rng.unit() < 0.1 => {
                app.world_mut().despawn(group);
                groups.retain(|other| *other != group);
            }
            _ => {}
        }
        step(&mut app);
        cracked += groups.iter().filter(|group| state(&app, **group).nodes > 0).count();
        for member in &members {
            let is_alone = app.world().get::<CrackMemberOf>(*member).is_none();
            assert!(!(is_alone && is_hidden(&app, *member)), "frame {frame}: nobody shows {member}");
        }
    }
    assert!(cracked > 300, "{cracked}");
    for entity in members.into_iter().chain(groups) {
        app.world_mut().despawn(entity);
    }
    wait_for(&mut app, "an empty world", |app| stock(app) == before);
}
