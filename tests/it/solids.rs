//! Boxes and other meshes whose faces share texture coordinates.

use crate::{
    shards::{loose, shards, shatter, stock, surface, vertices},
    support::*,
};
use bevy::{ecs::system::SystemState, mesh::VertexAttributeValues, prelude::*};
use bevy_crack::{plugin::ShardsError, prelude::*};

#[derive(Resource, Default)]
struct Failed(Vec<ShardsError>);

/// An app, and what its surfaces look like.
fn solids() -> (App, Handle<StandardMaterial>) {
    let mut app = app();
    app.init_resource::<Failed>();
    app.add_observer(|event: On<ShatterFailed>, mut failed: ResMut<Failed>| failed.0.push(event.error.clone()));
    let image = add(&mut app, solid(UVec2::new(64, 48), [180, 170, 160, 255]));
    let material = add(&mut app, StandardMaterial { base_color_texture: Some(image), ..default() });
    (app, material)
}

fn failed(app: &mut App) -> Vec<ShardsError> {
    core::mem::take(&mut app.world_mut().resource_mut::<Failed>().0)
}

fn spawn(app: &mut App, mesh: &Handle<Mesh>, material: &Handle<StandardMaterial>, place: Transform) -> Entity {
    let mesh = (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()));
    // Others are laid out: see `unfolded`.
    let surface = surface().with_unwrap(CrackUnwrap::Never);
    app.world_mut().spawn((mesh, place, surface, loose())).id()
}

/// What the texture of a surface has at each vertex of its mesh, 0..=1 along the picture that its material shows.
fn on_texture(app: &App, entity: Entity) -> Vec<(Vec3, Vec2)> {
    let material = get::<MeshMaterial3d<StandardMaterial>>(app, entity).0;
    let transform = app.world().resource::<Assets<StandardMaterial>>().get(&material).expect("it").uv_transform;
    let all = vertices(app, &get::<Mesh3d>(app, entity).0);
    all.into_iter().map(|(at, uv)| (at, transform.transform_point2(uv))).collect()
}

/// Texels that are not those of the picture, in the upper and in the lower half of the texture.
fn cracked_texels(app: &App, entity: Entity) -> [usize; 2] {
    let texture = get::<CrackTextures>(app, entity).diffuse.expect("a texture");
    let texels = texels(app, &texture);
    let is_cracked = |texel: &&[u8; 4]| texel[..3] != [180, 170, 160];
    let (upper, lower) = texels.as_chunks::<4>().0.split_at(texels.len() / 8);
    [upper, lower].map(|half| half.iter().filter(is_cracked).count())
}

#[test]
fn s8_a_box_cracks_where_it_is_hit() {
    let (mut app, material) = solids();
    let cube = add(&mut app, Mesh::from(Cuboid::new(2.0, 2.0, 2.0)));
    let place = Transform::from_xyz(3.0, 1.0, -2.0).with_rotation(Quat::from_rotation_y(0.5));
    let before = stock(&app);
    for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        for is_prepared in [false, true] {
            let entity = spawn(&mut app, &cube, &material, place);
            if is_prepared {
                app.world_mut().commands().entity(entity).prepare_cracks();
                steps(&mut app, 2);
            }
            let local = normal + 0.3 * normal.any_orthonormal_vector();
            hit(&mut app, CrackHit::world(entity, place.transform_point(local)).with_energy(2.0));
            settle(&mut app, entity);
            let [upper, lower] = cracked_texels(&app, entity);
            assert!(upper > 20 && lower == 0, "{upper} {lower}");
            // The face that was hit shows the half with the crack, the others the one without.
            let all = on_texture(&app, entity);
            assert!(all.iter().all(|(_, uv)| (0.0..=1.0).contains(&uv.x) && (0.0..=1.001).contains(&uv.y)));
            let on_hit: Vec<Vec3> = all.iter().filter(|(_, uv)| uv.y < 0.5 + 1e-6).map(|(at, _)| *at).collect();
            assert!(
                on_hit.len() == 4 && on_hit.iter().all(|at| (at.dot(normal) - 1.0).abs() < 1e-5),
                "{normal}: {on_hit:?}"
            );
            assert_eq!(on_hit.iter().sum::<Vec3>(), 4.0 * normal, "its four corners");
            // Its tangents are kept, so normals show.
            let mesh = get::<Mesh3d>(&app, entity).0;
            let own = app.world().resource::<Assets<Mesh>>().get(&mesh).expect("the mesh");
            assert!(own.contains_attribute(Mesh::ATTRIBUTE_TANGENT) && mesh != cube);
            drop(mesh);
            // Places are on the face, too.
            let mut places = SystemState::<CrackPlaces>::new(app.world_mut());
            for uv in [Vec2::ZERO, Vec2::splat(0.4), Vec2::ONE] {
                let at = places.get(app.world()).expect("the places").at(entity, uv).expect("a place");
                let back = place.to_matrix().inverse();
                assert!((back.transform_point3(at.position).dot(normal) - 1.0).abs() < 1e-4, "{normal} {uv}");
                assert!(back.transform_vector3(at.normal).dot(normal) > 0.999);
            }
            // More on this face, none on another.
            let (stats, nodes) = (counts(&app), state(&app, entity).nodes);
            hit(&mut app, CrackHit::world(entity, place.transform_point(2.0 * normal - local)).with_energy(2.0));
            hit(&mut app, CrackHit::world(entity, place.transform_point(-local)).with_energy(2.0));
            hit(&mut app, CrackHit::local(entity, normal.any_orthonormal_vector()).with_energy(2.0));
            settle(&mut app, entity);
            let now = counts(&app);
            assert_eq!(now.rejected - stats.rejected, 2);
            assert_eq!(now.applied + now.merged - stats.applied - stats.merged, 1);
            assert!(state(&app, entity).nodes > nodes && cracked_texels(&app, entity)[1] == 0);
            // It is no plate.
            shatter(&mut app, entity, ShatterRequest::ALL);
            assert!(matches!(failed(&mut app)[..], [ShardsError::NotFlat { .. }]) && shards(&mut app).is_empty());
            app.world_mut().commands().entity(entity).heal_cracks();
            step(&mut app);
            assert_eq!(get::<Mesh3d>(&app, entity).0, cube);
            assert_eq!(get::<MeshMaterial3d<StandardMaterial>>(&app, entity).0, material);
            // Healed, another face may be the one.
            hit(&mut app, CrackHit::local(entity, -normal).with_energy(2.0));
            settle(&mut app, entity);
            assert!(cracked_texels(&app, entity)[0] > 20);
            app.world_mut().despawn(entity);
            steps(&mut app, 2);
            assert_eq!(stock(&app), before);
        }
    }
}

#[test]
fn s8_slabs_crack_through_and_shatter() {
    let (mut app, material) = solids();
    // In its own size, scaled, thin along another axis, and lying down.
    let cases = [
        (Vec3::new(4.0, 3.0, 0.2), Vec3::ONE, Quat::IDENTITY),
        (Vec3::ONE, Vec3::new(4.0, 3.0, 0.2), Quat::IDENTITY),
        (Vec3::new(0.3, 3.0, 4.0), Vec3::ONE, Quat::from_rotation_y(1.0)),
        (Vec3::new(4.0, 0.1, 3.0), Vec3::ONE, Quat::from_rotation_x(0.2)),
    ];
    let stock_before = stock(&app);
    for (size, scale, rotation) in cases {
        let slab = add(&mut app, Mesh::from(Cuboid::from_size(size)));
        let place = Transform { rotation, scale, translation: Vec3::new(1.0, 2.0, 3.0) };
        let axis = (0..3).min_by(|a, b| (size * scale)[*a].total_cmp(&(size * scale)[*b])).expect("an axis");
        let entity = spawn(&mut app, &slab, &material, place);
        // From both sides, and on the rim.
        for share in [0.5, -0.5] {
            let mut local = 0.2 * size;
            local[axis] = share * size[axis];
            hit(&mut app, CrackHit::world(entity, place.transform_point(local)).with_energy(3.0));
            settle(&mut app, entity);
        }
        assert_eq!(counts(&app).rejected, 0);
        let broad: Vec<(Vec3, Vec2)> =
            on_texture(&app, entity).into_iter().filter(|(_, uv)| uv.y < 0.5 + 1e-6).collect();
        assert_eq!(broad.len(), 8, "front and back");
        for (at, uv) in &broad {
            let mut other = *at;
            other[axis] = -at[axis];
            let through = broad.iter().find(|(at, _)| at.distance(other) < 1e-5).expect("the other side");
            assert!(through.1.distance(*uv) < 1e-5, "what cracks goes through");
        }
        shatter(&mut app, entity, ShatterRequest::ALL);
        assert!(failed(&mut app).is_empty());
        let all = shards(&mut app);
        assert!(all.len() > 3, "{}", all.len());
        assert!(on_texture(&app, entity).iter().all(|(_, uv)| uv.y < 0.5 + 1e-6), "its rim goes with it");
        // All of them together fill the slab, and nothing else.
        let mut volume = 0.0;
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for shard in all {
            let at = get::<Transform>(&app, shard);
            for (corner, _) in vertices(&app, &get::<Mesh3d>(&app, shard).0) {
                let corner = at.transform_point(corner);
                (min, max) = (min.min(corner), max.max(corner));
            }
            volume += get::<Shard>(&app, shard).area() * size[axis];
        }
        assert!(min.distance(-0.5 * size) < 1e-4 && max.distance(0.5 * size) < 1e-4, "{min} {max}");
        let whole = size.element_product();
        assert!((volume - whole).abs() < 1e-3 * whole, "{volume} {whole}");
        // Whole again, then as it was.
        app.world_mut().get_mut::<ShatterCracks>(entity).expect("it").speed = -1.0;
        steps(&mut app, 5);
        assert!(shards(&mut app).is_empty());
        assert_eq!(on_texture(&app, entity).iter().filter(|(_, uv)| uv.y < 0.5 + 1e-6).count(), 8, "its rim is back");
        app.world_mut().commands().entity(entity).heal_cracks();
        step(&mut app);
        assert_eq!(get::<Mesh3d>(&app, entity).0, slab);
        app.world_mut().despawn(entity);
        drop(slab);
        steps(&mut app, 2);
        assert_eq!(stock(&app), stock_before);
    }
}

#[test]
fn s8_what_is_neither_flat_nor_a_slab_does_not_shatter() {
    let (mut app, material) = solids();
    let mut bent = Mesh::from(Plane3d::default().mesh().size(2.0, 2.0).subdivisions(4));
    if let Some(VertexAttributeValues::Float32x3(positions)) = bent.attribute_mut(Mesh::ATTRIBUTE_POSITION) {
        positions.iter_mut().for_each(|[x, y, z]| *y = 0.2 * (1.0 - *x * *x) * (1.0 - *z * *z));
    }
    let bodies = [
        Mesh::from(Cuboid::new(1.0, 1.0, 0.4)),
        Mesh::from(Cylinder::new(1.0, 2.0)),
        Mesh::from(Torus::default()),
        Mesh::from(Capsule3d::default()),
        bent,
    ];
    for mesh in bodies {
        let mesh = add(&mut app, mesh);
        let entity = spawn(&mut app, &mesh, &material, Transform::default());
        hit(&mut app, center(entity).with_energy(2.0));
        settle(&mut app, entity);
        shatter(&mut app, entity, ShatterRequest::EVERYTHING);
        assert!(matches!(failed(&mut app)[..], [ShardsError::NotFlat { .. }]) && shards(&mut app).is_empty());
        app.world_mut().despawn(entity);
    }
    // A flat one with many triangles does.
    let flat = add(&mut app, Mesh::from(Plane3d::default().mesh().size(2.0, 2.0).subdivisions(4)));
    let entity = spawn(&mut app, &flat, &material, Transform::default());
    hit(&mut app, center(entity).with_energy(2.0));
    settle(&mut app, entity);
    shatter(&mut app, entity, ShatterRequest::EVERYTHING);
    assert!(failed(&mut app).is_empty() && !shards(&mut app).is_empty());
}

/// Pictures, materials, meshes and sizes of a cracked box may change.
#[test]
fn s8_boxes_change_and_are_cloned() {
    let (mut app, material) = solids();
    let cube = add(&mut app, Mesh::from(Cuboid::default()));
    let entity = spawn(&mut app, &cube, &material, Transform::default());
    hit(&mut app, CrackHit::local(entity, 0.5 * Vec3::X).with_energy(2.0));
    settle(&mut app, entity);
    let face = |app: &App| -> Vec<Vec3> {
        let all = on_texture(app, entity).into_iter().filter(|(_, uv)| uv.y < 0.5 + 1e-6);
        all.map(|(at, _)| at).collect()
    };
    let is_right = |app: &App| face(app).len() == 4 && face(app).iter().all(|at| at.x == 0.5);
    assert!(is_right(&app));
    // A clone has the original mesh and material.
    let clone = app.world_mut().entity_mut(entity).clone_and_spawn();
    steps(&mut app, 2);
    assert_eq!(get::<Mesh3d>(&app, clone).0, cube);
    assert_eq!(get::<MeshMaterial3d<StandardMaterial>>(&app, clone).0, material);
    hit(&mut app, CrackHit::local(clone, 0.5 * Vec3::Y).with_energy(2.0));
    settle(&mut app, clone);
    assert!(is_right(&app), "each has faces of its own");
    // Another picture, in the same material and in another one.
    let picture = app.world().resource::<Assets<StandardMaterial>>().get(&material).expect("it");
    let picture = picture.base_color_texture.clone().expect("a picture");
    let other = solid(UVec2::new(32, 32), [180, 170, 160, 255]);
    app.world_mut().resource_mut::<Assets<Image>>().insert(&picture, other).expect("its place");
    steps(&mut app, 3);
    assert!(is_right(&app) && cracked_texels(&app, entity)[0] > 10 && cracked_texels(&app, entity)[1] == 0);
    let own = add(&mut app, solid(UVec2::new(48, 64), [180, 170, 160, 255]));
    let other = add(&mut app, StandardMaterial { base_color_texture: Some(own), ..default() });
    app.world_mut().get_mut::<MeshMaterial3d<StandardMaterial>>(entity).expect("it").0 = other.clone();
    steps(&mut app, 3);
    assert!(is_right(&app) && cracked_texels(&app, entity)[0] > 10 && cracked_texels(&app, entity)[1] == 0);
    // Hits go on where they went.
    let stats = counts(&app);
    hit(&mut app, CrackHit::local(entity, Vec3::new(0.5, 0.2, 0.2)));
    hit(&mut app, CrackHit::local(entity, 0.5 * Vec3::Y));
    settle(&mut app, entity);
    assert_eq!(counts(&app).rejected - stats.rejected, 1);
    // A game that gives it another mesh has it, and keeps it.
    let ball = add(&mut app, Mesh::from(Sphere::new(1.0)));
    app.world_mut().get_mut::<Mesh3d>(entity).expect("it").0 = ball.clone();
    hit(&mut app, CrackHit::local(entity, Vec3::X));
    settle(&mut app, entity);
    app.world_mut().commands().entity(entity).heal_cracks();
    steps(&mut app, 2);
    assert_eq!(get::<Mesh3d>(&app, entity).0, ball);
    assert_eq!(get::<MeshMaterial3d<StandardMaterial>>(&app, entity).0, other);
}

/// Baked cracks, sizes that were asked for, and budgets.
#[test]
fn s8_boxes_with_guides_and_sizes() {
    let (mut app, material) = solids();
    let cube = add(&mut app, Mesh::from(Cuboid::default()));
    let entity = spawn(&mut app, &cube, &material, Transform::default());
    let guided = GuidedCracks::default().with_appearance(GuidedAppearance::Widen { seconds: 0.5 });
    app.world_mut().entity_mut(entity).insert(guided);
    wait_for(&mut app, "the bake", |app| get::<BakeProgress>(app, entity).0 == 1.0);
    settle(&mut app, entity);
    let [upper, lower] = cracked_texels(&app, entity);
    assert!(upper > 20 && lower == 0, "{upper} {lower}");
    let on_face = on_texture(&app, entity).into_iter().filter(|(_, uv)| uv.y < 0.5 + 1e-6).count();
    assert_eq!(on_face, 4);
    let size = |app: &App, entity: Entity| {
        let texture = get::<CrackTextures>(app, entity).diffuse.expect("a texture");
        app.world().resource::<Assets<Image>>().get(&texture).expect("it").size()
    };
    assert_eq!(size(&app, entity), UVec2::new(64, 96));
    let fixed = spawn(&mut app, &cube, &material, Transform::default());
    app.world_mut().get_mut::<CrackSurface>(fixed).expect("it").resolution = CrackResolution::Fixed(UVec2::splat(40));
    hit(&mut app, center(fixed).with_energy(2.0));
    settle(&mut app, fixed);
    assert_eq!(size(&app, fixed), UVec2::new(40, 80));
    app.world_mut().resource_mut::<CrackBudget>().max_side = 64;
    let small = spawn(&mut app, &cube, &material, Transform::default());
    hit(&mut app, center(small).with_energy(2.0));
    settle(&mut app, small);
    assert!(size(&app, small).max_element() <= 64);
}
