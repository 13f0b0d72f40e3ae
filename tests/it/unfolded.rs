//! 3D meshes that are laid out around their first hit.

use crate::{
    shards::{loose, stock, vertices},
    support::*,
};
use bevy::{
    asset::RenderAssetUsages,
    ecs::system::RunSystemOnce,
    math::ops,
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use bevy_crack::{math::Rng, plugin::ShardsError, prelude::*, voronoi::VoronoiParams};

const PLAIN: [u8; 4] = [180, 170, 160, 255];

#[derive(Resource, Default)]
struct Failed(Vec<ShardsError>);

#[derive(Resource, Default)]
struct Unbaked(Vec<CrackError>);

fn bodies(picture: Option<Image>) -> (App, Handle<StandardMaterial>) {
    let mut app = app();
    app.init_resource::<Failed>().init_resource::<Unbaked>();
    app.add_observer(|event: On<CrackFailed>, mut failed: ResMut<Unbaked>| failed.0.push(event.error.clone()));
    app.add_observer(|event: On<ShatterFailed>, mut failed: ResMut<Failed>| failed.0.push(event.error.clone()));
    let image = picture.map(|picture| add(&mut app, picture));
    let material = add(&mut app, StandardMaterial { base_color_texture: image, ..default() });
    (app, material)
}

fn spawn(app: &mut App, mesh: &Handle<Mesh>, material: &Handle<StandardMaterial>, place: Transform) -> Entity {
    let surface = CrackSurface::new(CrackPreset::CONCRETE);
    let mesh = (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()));
    app.world_mut().spawn((mesh, place, surface, loose())).id()
}

/// The triangles of the mesh that an entity shows: corners in its space, and in its texture, texels.
fn triangles(app: &App, entity: Entity) -> Vec<([Vec3; 3], [Vec2; 3])> {
    let texture = get::<CrackTextures>(app, entity).diffuse.expect("a texture");
    let size = app.world().resource::<Assets<Image>>().get(&texture).expect("it").size_f32();
    let all = vertices(app, &get::<Mesh3d>(app, entity).0);
    let corner = |(at, uv): &(Vec3, Vec2)| (*at, *uv * size);
    let three = all.as_chunks::<3>().0.iter().map(|corners| corners.each_ref().map(corner));
    three.map(|corners| (corners.map(|corner| corner.0), corners.map(|corner| corner.1))).collect()
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// How many texels of each triangle's part of the texture are not plain.
fn cracked_texels(app: &App, entity: Entity) -> Vec<(Vec3, usize)> {
    let texture = get::<CrackTextures>(app, entity).diffuse.expect("a texture");
    let size = app.world().resource::<Assets<Image>>().get(&texture).expect("it").size();
    let texels = texels(app, &texture);
    let rows = texels.as_chunks::<4>().0;
    let count = |[a, b, c]: [Vec2; 3]| {
        let turn = (b - a).perp_dot(c - a);
        let (min, max) = (a.min(b).min(c).as_uvec2(), a.max(b).max(c).ceil().as_uvec2().min(size));
        let all = (min.y..max.y).flat_map(|y| (min.x..max.x).map(move |x| UVec2::new(x, y)));
        let is_inside = |texel: &UVec2| {
            let at = texel.as_vec2() + 0.5;
            [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).perp_dot(at - *p) * turn > 0.0)
        };
        let is_cracked = |texel: &UVec2| rows[(texel.y * size.x + texel.x) as usize] != PLAIN;
        all.filter(is_inside).filter(is_cracked).count()
    };
    triangles(app, entity).into_iter().map(|(corners, laid)| (normal(corners), count(laid))).collect()
}

/// Cracked texels on the side of a box that faces this way.
fn on_side(all: &[(Vec3, usize)], side: Vec3) -> usize {
    all.iter().filter(|(normal, _)| normal.dot(side) > 0.99).map(|(_, count)| count).sum()
}

#[test]
fn s11_a_box_cracks_over_its_edges() {
    let (mut app, material) = bodies(Some(solid(UVec2::new(96, 96), PLAIN)));
    let cube = add(&mut app, Mesh::from(Cuboid::new(2.0, 2.0, 2.0)));
    let place = Transform::from_xyz(3.0, 1.0, -2.0).with_rotation(Quat::from_rotation_y(0.5));
    let before = stock(&app);
    for (out, beside) in [(Vec3::X, Vec3::Y), (Vec3::NEG_Y, Vec3::Z), (Vec3::NEG_Z, Vec3::X)] {
        for is_prepared in [false, true] {
            let entity = spawn(&mut app, &cube, &material, place);
            if is_prepared {
                app.world_mut().commands().entity(entity).prepare_cracks();
                steps(&mut app, 2);
            }
            // Close to an edge.
            hit(&mut app, CrackHit::world(entity, place.transform_point(out + 0.9 * beside)).with_energy(4.0));
            settle(&mut app, entity);
            assert_sound(&app, entity);
            let all = cracked_texels(&app, entity);
            let (front, side) = (on_side(&all, out), on_side(&all, beside));
            // Where it was prepared before the hit, this edge may not be one of those that were kept.
            assert!(front > 50 && (side > 20 || is_prepared), "{out} {beside}: {front} {side}");
            let mesh = get::<Mesh3d>(&app, entity).0;
            assert!(mesh != cube);
            let own = app.world().resource::<Assets<Mesh>>().get(&mesh).expect("the mesh");
            assert!(own.contains_attribute(Mesh::ATTRIBUTE_TANGENT));
            drop(mesh);
            // All sides can be hit, at any of their points, and so can its own coordinates.
            let (stats, nodes) = (counts(&app), state(&app, entity).nodes);
            for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
                let at = normal + 0.4 * normal.any_orthonormal_vector();
                hit(&mut app, CrackHit::world(entity, place.transform_point(at)).with_energy(2.0));
            }
            hit(&mut app, CrackHit::uv(entity, Vec2::new(0.3, 0.6)));
            settle(&mut app, entity);
            let now = counts(&app);
            assert_eq!((now.rejected - stats.rejected, now.ignored - stats.ignored), (0, 0));
            assert!(state(&app, entity).nodes > nodes);
            let all = cracked_texels(&app, entity);
            for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
                assert!(on_side(&all, normal) > 50, "{normal}");
            }
            // It shatters, see `shells`.
            app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::ALL);
            steps(&mut app, 3);
            let failed = core::mem::take(&mut app.world_mut().resource_mut::<Failed>().0);
            assert!(failed.is_empty() && app.world().get::<CrackShards>(entity).is_some(), "{failed:?}");
            app.world_mut().commands().entity(entity).heal_cracks();
            step(&mut app);
            assert_eq!(get::<Mesh3d>(&app, entity).0, cube);
            assert_eq!(get::<MeshMaterial3d<StandardMaterial>>(&app, entity).0, material);
            // Healed, it is laid out around another place.
            hit(&mut app, CrackHit::local(entity, -out).with_energy(2.0));
            settle(&mut app, entity);
            assert!(on_side(&cracked_texels(&app, entity), -out) > 50);
            app.world_mut().despawn(entity);
            steps(&mut app, 2);
            assert_eq!(stock(&app), before);
        }
    }
}

/// A box is laid out around the hit that cracks it, not around one before that was healed away, and as it is asked for by then.
#[test]
fn a_hit_that_is_healed_away_lays_out_nothing() {
    for unwrap in [CrackUnwrap::Auto, CrackUnwrap::Never] {
        let (mut app, material) = bodies(Some(solid(UVec2::new(64, 64), PLAIN)));
        app.insert_resource(CrackBudget::default());
        let cube = add(&mut app, Mesh::from(Cuboid::new(2.0, 2.0, 2.0)));
        let [entity, fresh] = [(); 2].map(|()| spawn(&mut app, &cube, &material, Transform::IDENTITY));
        let (first, second) = (Vec3::new(0.95, 0.9, 1.0), Vec3::new(-0.2, -0.9, -1.0));
        hit(&mut app, CrackHit::local(entity, first).with_energy(2.0));
        step(&mut app);
        assert!(app.world().get::<CrackTextures>(entity).is_none(), "it is on its way");
        app.world_mut().commands().entity(entity).heal_cracks();
        step(&mut app);
        for entity in [entity, fresh] {
            app.world_mut().get_mut::<CrackSurface>(entity).expect("it").unwrap = unwrap;
            hit(&mut app, CrackHit::local(entity, second).with_energy(2.0));
            settle(&mut app, entity);
        }
        assert_eq!(triangles(&app, entity), triangles(&app, fresh));
    }
}

/// Where transparent texels do not matter, bodies crack there too, and can be hit there.
#[test]
fn transparent_bodies_crack_if_they_are_to() {
    let (mut app, material) = bodies(Some(solid(UVec2::new(64, 64), [180, 170, 160, 0])));
    let cube = add(&mut app, Mesh::from(Cuboid::new(2.0, 2.0, 2.0)));
    for alpha_mask in [false, true] {
        let entity = spawn(&mut app, &cube, &material, Transform::IDENTITY);
        app.world_mut().get_mut::<CrackSurface>(entity).expect("it").alpha_mask = alpha_mask;
        let before = counts(&app);
        hit(&mut app, CrackHit::local(entity, Vec3::new(0.1, 0.2, 1.0)).with_energy(2.0));
        steps(&mut app, 200);
        let nodes = state(&app, entity).nodes;
        assert_eq!(
            (counts(&app).rejected - before.rejected, nodes > 0),
            if alpha_mask { (1, false) } else { (0, true) }
        );
    }
}

/// What a picture shows is where it was before, on all sides, at the same size, and texels on both sides of an edge are neighbours.
#[test]
fn s11_a_box_that_is_laid_out_shows_its_picture_as_before() {
    let size = UVec2::splat(64);
    let mut image = picture(size);
    let color = |x: u32, y: u32| [(4 * x) as u8, (4 * y) as u8, (2 * (x + y)) as u8, 255];
    image.data = Some((0..size.y).flat_map(|y| (0..size.x).flat_map(move |x| color(x, y))).collect());
    let (mut app, material) = bodies(Some(image));
    let mesh = Mesh::from(Cuboid::new(1.0, 1.0, 1.0));
    let before = vertices_of(&mesh);
    let cube = add(&mut app, mesh);
    let entity = spawn(&mut app, &cube, &material, Transform::IDENTITY);
    // Laid out, but not cracked.
    app.world_mut().commands().entity(entity).prepare_cracks();
    steps(&mut app, 3);
    let texture = get::<CrackTextures>(&app, entity).diffuse.expect("a texture");
    let width = app.world().resource::<Assets<Image>>().get(&texture).expect("it").width();
    let shown = texels(&app, &texture);
    let own = triangles(&app, entity);
    assert_eq!(own.len(), 12);
    let mut compared = 0;
    for (i, (_, laid)) in own.iter().enumerate() {
        let uvs = [0, 1, 2].map(|k| before[3 * i + k].1 * size.as_vec2());
        for (a, b) in (1..63).flat_map(|a| (1..63).map(move |b| (a as f32 / 64.0, b as f32 / 64.0))) {
            if a + b > 0.98 {
                continue;
            }
            let mix = |[p, q, r]: [Vec2; 3]| p + (q - p) * a + (r - p) * b;
            let (at, from) = (mix(*laid).as_uvec2(), mix(uvs));
            let i = 4 * (at.y * width + at.x) as usize;
            // Within a texel: the place lies somewhere in one.
            let expected = [4.0 * (from.x - 0.5), 4.0 * (from.y - 0.5)];
            let error = (0..2).map(|c| (f32::from(shown[i + c]) - expected[c]).abs()).fold(0.0, f32::max);
            assert!(error <= 6.5, "{error} at {at}");
            compared += 1;
        }
    }
    assert!(compared > 10_000);
}

fn vertices_of(mesh: &Mesh) -> Vec<(Vec3, Vec2)> {
    let (Some(VertexAttributeValues::Float32x3(positions)), Some(VertexAttributeValues::Float32x2(uvs))) =
        (mesh.attribute(Mesh::ATTRIBUTE_POSITION), mesh.attribute(Mesh::ATTRIBUTE_UV_0))
    else {
        panic!("a mesh without vertices")
    };
    let at = |i: usize| (Vec3::from(positions[i]), Vec2::from(uvs[i]));
    mesh.indices().expect("indices").iter().map(at).collect()
}

/// Curved and other meshes crack where they are hit; with little time in a frame and without threads the same comes out.
#[test]
fn s11_curved_meshes_crack_and_every_way_to_lay_them_out_makes_the_same() {
    let meshes: [Mesh; 6] = [
        Sphere::new(0.5).mesh().uv(48, 32),
        Sphere::new(0.5).mesh().ico(6).expect("few enough"),
        Torus::new(0.2, 0.5).into(),
        Cylinder::new(0.4, 1.0).into(),
        Capsule3d::new(0.3, 0.6).into(),
        without_area_at_first(Sphere::new(0.5).mesh().uv(48, 32)),
    ];
    for (i, mesh) in meshes.into_iter().enumerate() {
        let crack = |milliseconds: f32| {
            let (mut app, material) = bodies(Some(solid(UVec2::new(512, 256), PLAIN)));
            app.insert_resource(CrackBudget { milliseconds, ..default() });
            let mesh = add(&mut app, mesh.clone());
            let entity = spawn(&mut app, &mesh, &material, Transform::from_scale(Vec3::splat(2.0)));
            let out = Vec3::new(0.3, 0.2, 0.9).normalize();
            hit(&mut app, CrackHit::local(entity, 0.55 * out).with_energy(3.0));
            settle(&mut app, entity);
            assert_sound(&app, entity);
            assert_eq!(counts(&app).rejected, 0);
            let all = cracked_texels(&app, entity);
            let near: usize = all.iter().filter(|(normal, _)| normal.dot(out) > 0.3).map(|(_, count)| count).sum();
            let far: usize = all.iter().filter(|(normal, _)| normal.dot(out) < -0.9).map(|(_, count)| count).sum();
            assert!(get::<Mesh3d>(&app, entity).0 != mesh, "mesh {i} is not laid out");
            assert!(near > 50 && far <= near / 8, "mesh {i}: {near} {far}");
            shown_3d(&app, entity)
        };
        let at_once = crack(1e6);
        assert!(crack(1.0) == at_once, "mesh {i}");
    }
}

/// The mesh with one triangle more, which comes first and has no area.
fn without_area_at_first(mut mesh: Mesh) -> Mesh {
    let indices: Vec<u32> = mesh.indices().expect("indices").iter().map(|index| index as u32).collect();
    mesh.insert_indices(Indices::U32([&[7, 7, 7], &indices[..]].concat()));
    mesh
}

fn shown_3d(app: &App, entity: Entity) -> Vec<u8> {
    texels(app, &get::<CrackTextures>(app, entity).diffuse.expect("a texture"))
}

/// A saved box has its cracks where they were, also if it is loaded before anything hits it.
#[test]
fn f4_a_record_of_a_box_brings_back_the_same_bits() {
    let (mut app, material) = bodies(Some(solid(UVec2::new(64, 64), PLAIN)));
    let cube = add(&mut app, Mesh::from(Cuboid::new(1.0, 2.0, 1.0)));
    let entity = spawn(&mut app, &cube, &material, Transform::IDENTITY);
    hit(&mut app, CrackHit::local(entity, Vec3::new(0.1, 0.7, -0.5)).with_energy(2.0));
    hit(&mut app, CrackHit::local(entity, Vec3::new(0.5, -0.7, 0.1)).with_energy(2.0));
    settle(&mut app, entity);
    let record = app.world_mut().run_system_once(move |records: CrackRecords| records.get(entity));
    let record = record.expect("it runs").expect("it has cracks");
    assert!(record.around.is_some_and(|around| around.distance(Vec3::new(0.1, 0.7, -0.5)) < 1e-5));
    let json = serde_json::to_string(&record).expect("it can be written");
    let read: CrackRecord = serde_json::from_str(&json).expect("it can be read");
    let other = spawn(&mut app, &cube, &material, Transform::from_xyz(5.0, 0.0, 0.0));
    app.world_mut().entity_mut(other).insert(read.clone());
    wait_for(&mut app, "the record", |app| app.world().get::<CrackRecord>(other).is_none());
    settle(&mut app, other);
    assert!(shown_3d(&app, entity) == shown_3d(&app, other));
    assert_eq!(state(&app, entity).nodes, state(&app, other).nodes);
    // Those of flat surfaces have no such point, and those of before had none.
    let old: CrackRecord =
        serde_json::from_str(&json.replace(&json[json.find(",\"around\"").expect("it")..], "}")).expect("it");
    assert_eq!(old.around, None);
    assert!(CrackRecord { around: Some(Vec3::NAN), ..read }.validate().is_err());
}

/// What has its place in the picture, what is asked to stay, what is flat, a slab or too much stays as it is.
#[test]
fn s11_some_meshes_stay_as_they_are() {
    let (mut app, material) = bodies(Some(solid(UVec2::new(512, 512), PLAIN)));
    let [cube, slab, flat] = [
        Mesh::from(Cuboid::new(1.0, 1.0, 1.0)),
        Mesh::from(Cuboid::new(2.0, 2.0, 0.1)),
        Mesh::from(Rectangle::new(1.0, 1.0)),
    ]
    .map(|mesh| add(&mut app, mesh));
    let image = add(&mut app, solid(UVec2::splat(8), [255; 4]));
    let surface = || CrackSurface::new(CrackPreset::CONCRETE);
    let all = [
        // Too many texels for nobody having asked.
        (&cube, 0.5, surface(), [512, 1024]),
        (&cube, 0.5, surface().with_unwrap(CrackUnwrap::Never), [512, 1024]),
        (&cube, 0.5, surface().with_unwrap(CrackUnwrap::Always).with_density(image.clone()), [512, 1024]),
        (
            &cube,
            0.5,
            surface().with_unwrap(CrackUnwrap::Always).with_resolution(CrackResolution::Fixed(UVec2::splat(64))),
            [64, 128],
        ),
        (&slab, 0.05, surface().with_unwrap(CrackUnwrap::Always), [512, 1024]),
        (&flat, 0.0, surface().with_unwrap(CrackUnwrap::Always), [512, 512]),
    ];
    for (i, (mesh, out, surface, size)) in all.into_iter().enumerate() {
        let entity = app.world_mut().spawn((Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()), surface)).id();
        hit(&mut app, CrackHit::local(entity, Vec3::new(0.1, 0.1, out)));
        settle(&mut app, entity);
        let texture = get::<CrackTextures>(&app, entity).diffuse.expect("a texture");
        assert_eq!(app.world().resource::<Assets<Image>>().get(&texture).expect("it").size().to_array(), size, "{i}");
    }
    // Asked for, it is.
    let surface = surface().with_unwrap(CrackUnwrap::Always);
    let entity = app.world_mut().spawn((Mesh3d(cube.clone()), MeshMaterial3d(material.clone()), surface)).id();
    hit(&mut app, CrackHit::local(entity, Vec3::new(0.5, 0.1, 0.1)));
    settle(&mut app, entity);
    let texture = get::<CrackTextures>(&app, entity).diffuse.expect("a texture");
    let size = app.world().resource::<Assets<Image>>().get(&texture).expect("it").size();
    assert!(size.min_element() >= 3 * 512 && size.max_element() < 2200, "{size}");
    // What would have its place in the picture comes too late; cracks that are guided go where the picture is.
    app.world_mut().entity_mut(entity).insert(CrackStrands::default());
    wait_for(&mut app, "an answer", |app| !app.world().resource::<Unbaked>().0.is_empty());
    assert!(matches!(app.world().resource::<Unbaked>().0[..], [CrackError::Bake { .. }]));
    app.world_mut().entity_mut(entity).remove::<CrackStrands>();
    app.world_mut().entity_mut(entity).insert(GuidedCracks::new(CrackGuide::text("HI")));
    wait_for(&mut app, "the bake", |app| get::<BakeProgress>(app, entity).0 == 1.0);
    assert_eq!(app.world().resource::<Unbaked>().0.len(), 1);
}

/// Whether some texel near a place, texels, is not plain, for places of a texture.
fn is_cracked_near(texels: &[u8], size: UVec2, at: Vec2, reach: i32) -> bool {
    let at = at.as_ivec2();
    let around = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| at + IVec2::new(x, y)));
    let on = around.filter(|texel| texel.min_element() >= 0 && texel.cmplt(size.as_ivec2()).all());
    let texel = |at: IVec2| texels.as_chunks::<4>().0[(at.y as u32 * size.x + at.x as u32) as usize];
    on.into_iter().any(|at| texel(at) != PLAIN)
}

/// Where a body is cut, in steps of a texel, from either side: whether there is a crack just here, and one about there on the other side.
fn at_cuts(app: &App, entity: Entity) -> Vec<[bool; 2]> {
    let texture = get::<CrackTextures>(app, entity).diffuse.expect("a texture");
    let size = app.world().resource::<Assets<Image>>().get(&texture).expect("it").size();
    let texels = texels(app, &texture);
    let key = |at: Vec3| (at * 1e3).round().as_ivec3().to_array();
    let mut edges = std::collections::BTreeMap::<_, Vec<[Vec2; 2]>>::new();
    for (corners, laid) in triangles(app, entity) {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (mut ends, mut places) = ([key(corners[i]), key(corners[j])], [laid[i], laid[j]]);
            if ends[0] > ends[1] {
                ends.reverse();
                places.reverse();
            }
            edges.entry(ends).or_default().push(places);
        }
    }
    let mut all = Vec::new();
    for places in edges.values() {
        let [[a, b], [p, q]] = places[..] else { continue };
        if a.distance(p) < 0.5 && b.distance(q) < 0.5 {
            continue;
        }
        let steps = a.distance(b).max(1.0) as u32;
        for ((a, b), (p, q)) in [((a, b), (p, q)), ((p, q), (a, b))] {
            all.extend((0..steps).map(|step| {
                let share = (step as f32 + 0.5) / steps as f32;
                let (here, there) = (a.lerp(b, share), p.lerp(q, share));
                [is_cracked_near(&texels, size, here, 0), is_cracked_near(&texels, size, there, 3)]
            }));
        }
    }
    all
}

/// Cracks that are guided run over all of a body: where it is cut to lie flat they go on at the other side, as regions do. A word stands
/// where its picture has it.
#[test]
fn guided_cracks_go_on_where_a_body_is_cut() {
    let (mut app, material) = bodies(Some(solid(UVec2::new(200, 200), PLAIN)));
    let meshes = [Mesh::from(Cuboid::new(2.0, 1.0, 1.4)), Sphere::new(1.0).mesh().ico(6).expect("few enough")];
    for (i, mesh) in meshes.into_iter().enumerate() {
        let mesh = add(&mut app, mesh);
        let entity = spawn(&mut app, &mesh, &material, Transform::default());
        // Thin ones of one width, so that what is seen is where they are.
        let params = VoronoiParams { width: 0.003, least_width: 0.003, sites: 120, ..VoronoiParams::DEFAULT };
        app.world_mut().entity_mut(entity).insert(GuidedCracks { params, max_side: 4096, ..default() });
        wait_for(&mut app, "the bake", |app| get::<BakeProgress>(app, entity).0 == 1.0);
        settle(&mut app, entity);
        assert_sound(&app, entity);
        assert!(get::<Mesh3d>(&app, entity).0 != mesh, "{i}: it is laid out");
        let cuts = at_cuts(&app, entity);
        // Against what is elsewhere on the other side. Some run along the cut, on one side of it.
        let beside = |off: usize| {
            let all = cuts.iter().enumerate().filter(|(_, [here, _])| *here);
            all.filter(|(i, _)| cuts[(i + off) % cuts.len()][1]).count()
        };
        let here = cuts.iter().filter(|[here, _]| *here).count();
        let (there, elsewhere) = (beside(0), beside(31));
        assert!(here > 60 && there * 10 >= here * 7 && there > 2 * elsewhere, "{i}: {here} {there} {elsewhere}");
        // It goes on living.
        let nodes = state(&app, entity).nodes;
        hit(&mut app, CrackHit::local(entity, Vec3::new(0.1, 0.9, 0.2)).with_energy(2.0));
        settle(&mut app, entity);
        assert!(state(&app, entity).nodes > nodes);
        app.world_mut().commands().entity(entity).heal_cracks();
        steps(&mut app, 3);
        assert!(get::<Mesh3d>(&app, entity).0 == mesh, "{i}: as it was");
    }
    assert!(app.world().resource::<Unbaked>().0.is_empty());
}

/// A mesh is laid out when its picture is there, whose size is that of the layout; and not for cracks that do not come.
#[test]
fn bodies_are_laid_out_when_their_picture_is_there() {
    let (mut app, _) = bodies(None);
    let mesh = add(&mut app, Mesh::from(Cuboid::new(1.0, 1.0, 1.0)));
    let size = |app: &App, entity: Entity| {
        let texture = get::<CrackTextures>(app, entity).diffuse.expect("a texture");
        app.world().resource::<Assets<Image>>().get(&texture).expect("it").size()
    };
    let mut sizes = Vec::new();
    for (is_late, is_guided) in [(false, true), (true, true), (true, false)] {
        let picture = app.world().resource::<Assets<Image>>().reserve_handle();
        let material = StandardMaterial { base_color_texture: Some(picture.clone()), ..default() };
        let material = add(&mut app, material);
        let give = |app: &mut App| {
            let image = solid(UVec2::new(64, 64), PLAIN);
            app.world_mut().resource_mut::<Assets<Image>>().insert(&picture, image).expect("a handle");
        };
        if !is_late {
            give(&mut app);
        }
        let entity = spawn(&mut app, &mesh, &material, Transform::default());
        if is_guided {
            app.world_mut().entity_mut(entity).insert(GuidedCracks::default());
        } else {
            hit(&mut app, CrackHit::local(entity, Vec3::new(0.5, 0.1, 0.1)));
        }
        steps(&mut app, 6);
        if is_late {
            assert!(app.world().get::<CrackTextures>(entity).is_none());
            give(&mut app);
        }
        wait_for(&mut app, "cracks", |app| app.world().get::<CrackTextures>(entity).is_some());
        sizes.push(size(&app, entity));
    }
    assert!(sizes[0].min_element() >= 3 * 64 && sizes[0].max_element() < 5 * 64, "{sizes:?}");
    assert_eq!(sizes[0], sizes[1]);
    assert!(sizes[2].element_product().abs_diff(sizes[0].element_product()) < sizes[0].element_product() / 4);
    // Cracks that are taken back before they come: the first hit lays it out.
    let material = StandardMaterial { base_color_texture: None, ..default() };
    let material = add(&mut app, material);
    let entities = [true, false].map(|is_guided| {
        let entity = spawn(&mut app, &mesh, &material, Transform::default());
        if is_guided {
            app.world_mut().entity_mut(entity).insert(GuidedCracks::new(CrackGuide::new(Handle::<Image>::default())));
            steps(&mut app, 4);
            app.world_mut().entity_mut(entity).remove::<GuidedCracks>();
        }
        hit(&mut app, CrackHit::local(entity, Vec3::new(0.2, 0.5, -0.3)).with_energy(2.0));
        settle(&mut app, entity);
        entity
    });
    let [one, other] = entities.map(|entity| triangles(&app, entity));
    assert!(one == other, "laid out around the hit");
}

#[derive(Resource, Default)]
struct Covered(Vec<Option<f32>>);

#[test]
fn a_word_stands_where_the_picture_of_a_body_has_it() {
    let (mut app, material) = bodies(Some(solid(UVec2::new(512, 256), PLAIN)));
    app.init_resource::<Covered>();
    app.add_observer(|event: On<CrackBaked>, mut covered: ResMut<Covered>| covered.0.push(event.covered));
    let mesh = Cylinder::new(0.5, 1.0).mesh().resolution(64).without_caps().build();
    let mesh = add(&mut app, mesh);
    let own = |uv: Vec2| {
        let angle = uv.x * core::f32::consts::TAU;
        let (sin, cos) = ops::sin_cos(angle);
        Vec3::new(0.5 * cos, 0.5 - uv.y, 0.5 * sin)
    };
    for (i, appearance) in [
        GuidedAppearance::AtOnce,
        GuidedAppearance::Front { from: Vec2::new(0.2, 0.5), seconds: 0.2 },
        GuidedAppearance::Emerge { seconds: 0.2 },
    ]
    .into_iter()
    .enumerate()
    {
        let entity = spawn(&mut app, &mesh, &material, Transform::default());
        let mut guided = GuidedCracks::new(CrackGuide::text("HI")).with_appearance(appearance);
        // Without noise in the guides cracks are in the very middle of the strokes, otherwise they wander within them.
        let wanders = i > 0;
        if !wanders {
            guided.params.guide_noise = 0.0;
        }
        app.world_mut().entity_mut(entity).insert(GuidedCracks { max_side: 4096, ..guided });
        wait_for(&mut app, "the bake", |app| get::<BakeProgress>(app, entity).0 == 1.0);
        settle(&mut app, entity);
        assert!(get::<Mesh3d>(&app, entity).0 != mesh, "{i}: it is laid out");
        let covered = app.world().resource::<Covered>().0[i].expect("there are strokes");
        assert!(covered > 0.9, "{i}: {covered}");
        // The broad strokes of the word, as the picture has them: the H from a quarter to the middle, the I beyond it.
        let texture = get::<CrackTextures>(&app, entity).diffuse.expect("a texture");
        let size = app.world().resource::<Assets<Image>>().get(&texture).expect("it").size();
        let texels = texels(&app, &texture);
        let laid = triangles(&app, entity);
        let cracked = |uv: Vec2| {
            let at = own(uv);
            let near = |(corners, _): &&([Vec3; 3], [Vec2; 3])| {
                let [a, b, c] = *corners;
                let normal = (b - a).cross(c - a);
                let weights = [(b, c), (c, a), (a, b)].map(|(p, q)| (p - at).cross(q - at).dot(normal));
                weights.iter().all(|weight| *weight >= -1e-4) && (at - a).dot(normal.normalize()).abs() < 0.05
            };
            let (corners, places) = laid.iter().find(near).expect("a place on the cylinder");
            let [a, b, c] = *corners;
            let normal = (b - a).cross(c - a);
            let [u, v, w] = [(b, c), (c, a), (a, b)].map(|(p, q)| (p - at).cross(q - at).dot(normal));
            let place = (places[0] * u + places[1] * v + places[2] * w) / (u + v + w);
            is_cracked_near(&texels, size, place, 2)
        };
        let font = bevy_crack::voronoi::FONT;
        let word = bevy_crack::voronoi::draw_text(font, "HI", UVec2::new(512, 256), f32::INFINITY).expect("a font");
        let has_ink = |y: &usize| word.row(*y).iter().any(|ink| *ink > 0.5);
        let (top, bottom) = ((0..256).find(has_ink).expect("ink"), (0..256).rfind(has_ink).expect("ink"));
        let (mut ink, mut hit) = (0, 0);
        // At their ends cracks run out towards a corner of the stroke.
        for y in (top + 24..bottom - 24).step_by(4) {
            // The middle of each run of ink.
            let row = word.row(y);
            let mut x = 0;
            while x < row.len() {
                let run = row[x..].iter().take_while(|ink| **ink > 0.5).count();
                if (8..64).contains(&run) {
                    ink += 1;
                    let uv = Vec2::new((x + run / 2) as f32 + 0.5, y as f32 + 0.5) / Vec2::new(512.0, 256.0);
                    let reach = if wanders { (0.3 * run as f32 / 512.0).max(0.012) } else { 0.012 };
                    let around = (-4i8..=4).map(|k| f32::from(k) / 4.0 * reach);
                    hit += usize::from(around.into_iter().any(|off| cracked(uv + off * Vec2::X)));
                }
                x += run.max(1);
            }
        }
        assert!(ink > 30 && hit * 10 >= ink * 9, "{i}: {hit} of {ink}");
    }
}

/// Meshes that nothing can be made of, and those that change: no panic, one warning at the most, nothing is left.
#[test]
fn s11_broken_meshes_crack_in_another_way_or_are_refused() {
    let (mut app, material) = bodies(None);
    let mut rng = Rng::new(11);
    let before = stock(&app);
    for round in 0..60 {
        let mut mesh = match round % 4 {
            0 => Mesh::from(Cuboid::new(1.0, 1.0, 1.0)),
            1 => Sphere::new(0.5).mesh().uv(12, 8),
            2 => Cylinder::new(0.4, 1.0).into(),
            _ => soup(&mut rng),
        };
        match round % 7 {
            0 => {
                if let Some(VertexAttributeValues::Float32x3(positions)) = mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION)
                {
                    positions[0] = [f32::NAN; 3];
                }
            }
            1 => mesh.insert_indices(Indices::U32(vec![0, 1, 9999, 0, 1, 2])),
            2 => _ = mesh.remove_attribute(Mesh::ATTRIBUTE_NORMAL),
            3 => {
                if let Some(VertexAttributeValues::Float32x2(uvs)) = mesh.attribute_mut(Mesh::ATTRIBUTE_UV_0) {
                    uvs.iter_mut().for_each(|uv| *uv = [f32::INFINITY, 0.0]);
                }
            }
            _ => {}
        }
        let mesh = add(&mut app, mesh);
        let entity = spawn(&mut app, &mesh, &material, Transform::from_scale(Vec3::new(1.0, -2.0, 0.5)));
        let told = warnings(|| {
            for _ in 0..3 {
                let at = Vec3::new(rng.signed(), rng.signed(), rng.signed()) * 0.5;
                hit(&mut app, CrackHit::local(entity, at).with_energy(2.0));
                steps(&mut app, 6);
            }
            // Another mesh, and back.
            if round % 3 == 0 {
                let other = add(&mut app, Mesh::from(Torus::default()));
                let now = core::mem::replace(&mut app.world_mut().get_mut::<Mesh3d>(entity).expect("it").0, other);
                hit(&mut app, CrackHit::local(entity, Vec3::X));
                steps(&mut app, 6);
                app.world_mut().get_mut::<Mesh3d>(entity).expect("it").0 = now;
                steps(&mut app, 2);
            }
        });
        assert!(told.len() <= 3, "{round}: {told:?}");
        app.world_mut().commands().entity(entity).heal_cracks();
        step(&mut app);
        assert_eq!(get::<Mesh3d>(&app, entity).0, mesh, "{round}");
        app.world_mut().despawn(entity);
        drop(mesh);
        steps(&mut app, 2);
    }
    assert_eq!(stock(&app)[..], before[..]);
}

fn soup(rng: &mut Rng) -> Mesh {
    let n = 3 * (4 + (rng.next_u32() % 60)) as usize;
    let positions: Vec<[f32; 3]> =
        (0..n).map(|_| [rng.signed(), rng.signed(), rng.signed()].map(|x| 0.5 * x)).collect();
    let uvs: Vec<[f32; 2]> = (0..n).map(|_| [rng.unit(), rng.unit()]).collect();
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
        .with_computed_flat_normals()
}

/// Another picture, and another material, come onto the same layout.
#[test]
fn t11_a_box_that_is_laid_out_gets_another_picture() {
    let (mut app, material) = bodies(Some(solid(UVec2::splat(96), PLAIN)));
    let cube = add(&mut app, Mesh::from(Cuboid::new(1.0, 1.0, 1.0)));
    let entity = spawn(&mut app, &cube, &material, Transform::IDENTITY);
    hit(&mut app, CrackHit::local(entity, Vec3::new(0.2, 0.1, 0.5)).with_energy(3.0));
    settle(&mut app, entity);
    let nodes = state(&app, entity).nodes;
    let dark = add(&mut app, solid(UVec2::new(32, 48), [20, 30, 40, 255]));
    let other = add(&mut app, StandardMaterial { base_color_texture: Some(dark), ..default() });
    app.world_mut().get_mut::<MeshMaterial3d<StandardMaterial>>(entity).expect("it").0 = other.clone();
    steps(&mut app, 4);
    let texels = shown_3d(&app, entity);
    let dark = texels.as_chunks::<4>().0.iter().filter(|texel| texel[..3] == [20, 30, 40]).count();
    assert!(dark * 2 > texels.len() / 4 && dark < texels.len() / 4, "{dark}");
    assert_eq!(state(&app, entity).nodes, nodes);
    assert!(get::<Mesh3d>(&app, entity).0 != cube);
    hit(&mut app, CrackHit::local(entity, Vec3::new(-0.2, 0.1, -0.5)).with_energy(3.0));
    settle(&mut app, entity);
    assert!(state(&app, entity).nodes > nodes);
    app.world_mut().commands().entity(entity).heal_cracks();
    step(&mut app);
    assert_eq!(get::<Mesh3d>(&app, entity).0, cube);
    assert_eq!(get::<MeshMaterial3d<StandardMaterial>>(&app, entity).0, other);
}

/// Hits by texture coordinates are meant for those of the picture, also where the material shows a part of it, before and after it is laid out;
/// what is not on the mesh is refused.
#[test]
fn t4_hits_by_coordinates_land_where_the_picture_has_them() {
    let (mut app, material) = bodies(Some(solid(UVec2::splat(96), PLAIN)));
    let mut half = app.world().resource::<Assets<StandardMaterial>>().get(&material).expect("it").clone();
    half.uv_transform = bevy::math::Affine2::from_scale(Vec2::splat(0.5));
    let material = add(&mut app, half);
    let cube = add(&mut app, Mesh::from(Cuboid::new(1.0, 1.0, 1.0)));
    // The front shows the picture from 0 to 0.5; v runs up it.
    let at = |u: f32, v: f32| Vec3::new(2.0 * u - 0.5, 2.0 * v - 0.5, 0.5);
    let [by_uv, by_point] = [true, false].map(|by_uv| {
        let entity = spawn(&mut app, &cube, &material, Transform::IDENTITY);
        for (u, v) in [(0.1875, 0.3125), (0.375, 0.125)] {
            let place = if by_uv { CrackHit::uv(entity, Vec2::new(u, v)) } else { CrackHit::local(entity, at(u, v)) };
            hit(&mut app, place.with_energy(2.0));
            settle(&mut app, entity);
        }
        entity
    });
    assert_eq!(state(&app, by_uv).hits, 2);
    assert_eq!(state(&app, by_uv).nodes, state(&app, by_point).nodes);
    let different =
        shown_3d(&app, by_uv).iter().zip(shown_3d(&app, by_point)).filter(|(a, b)| a.abs_diff(*b) > 8).count();
    assert!(different < 200, "{different}: by rounding of places alone");
    let before = counts(&app).rejected;
    hit(&mut app, CrackHit::uv(by_uv, Vec2::splat(0.9)));
    step(&mut app);
    assert_eq!(counts(&app).rejected, before + 1);
}
