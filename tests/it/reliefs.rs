//! Reliefs on surfaces of a game: made by a task, shown, cracked, changed, cancelled, refused.

use crate::support::*;
use bevy::prelude::*;
use bevy_crack::{
    prelude::*,
    relief::{ReliefJob, ReliefShape},
};

/// What was told of reliefs.
#[derive(Resource, Default)]
struct Told {
    made: Vec<Entity>,
    failed: Vec<CrackError>,
}

fn relief_app() -> App {
    let mut app = app();
    app.init_resource::<Told>()
        .add_observer(|made: On<ReliefMade>, mut told: ResMut<Told>| told.made.push(made.entity))
        .add_observer(|failed: On<ReliefFailed>, mut told: ResMut<Told>| told.failed.push(failed.error.clone()));
    app
}

fn told(app: &App) -> &Told {
    app.world().resource::<Told>()
}

fn progress(app: &App, entity: Entity) -> f32 {
    app.world().get::<ReliefProgress>(entity).unwrap().0
}

fn island() -> CrackRelief {
    CrackRelief::island().with_size(UVec2::new(96, 64)).with_seed(5)
}

fn make(app: &mut App) {
    let before = told(app).made.len() + told(app).failed.len();
    let mut frames = 0;
    while told(app).made.len() + told(app).failed.len() == before {
        app.update();
        std::thread::sleep(std::time::Duration::from_millis(1));
        frames += 1;
        assert!(frames < 60_000, "it never ends");
    }
}

fn texels(app: &App, image: &Handle<Image>) -> Vec<u8> {
    app.world().resource::<Assets<Image>>().get(image).unwrap().data.clone().unwrap()
}

/// The picture is that of the algorithm, bit for bit, and cracks grow on it and heal to it.
#[test]
fn a_sprite_shows_its_relief_and_cracks() {
    let mut app = relief_app();
    let sprite = Sprite::from_color(Color::WHITE, Vec2::new(96.0, 64.0));
    let entity = app.world_mut().spawn((sprite, island(), CrackSurface::new(CrackPreset::CONCRETE))).id();
    app.update();
    assert!(progress(&app, entity) < 1.0);
    make(&mut app);
    assert_eq!((told(&app).made.as_slice(), told(&app).failed.len(), progress(&app, entity)), (&[entity][..], 0, 1.0));
    let expected = ReliefJob::new(island().settings, island().size, 5).unwrap().finish().unwrap();
    let image = app.world().get::<Sprite>(entity).unwrap().image.clone();
    assert!(texels(&app, &image) == expected.diffuse.as_slice().as_flattened());
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)).with_energy(4.0));
    settle(&mut app, entity);
    assert!(shown(&app, entity) != texels(&app, &image), "it cracks");
    app.world_mut().commands().entity(entity).heal_cracks();
    app.update();
    assert_eq!(app.world().get::<Sprite>(entity).unwrap().image, image);
}

/// A relief that changes under cracks keeps them; the last change wins; nothing is left of what was cancelled.
#[test]
fn changes_and_removals() {
    let mut app = relief_app();
    let sprite = Sprite::from_color(Color::WHITE, Vec2::new(96.0, 64.0));
    let entity = app.world_mut().spawn((sprite, island(), CrackSurface::new(CrackPreset::CONCRETE))).id();
    make(&mut app);
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)).with_energy(4.0));
    settle(&mut app, entity);
    let (before, nodes) = (shown(&app, entity), state(&app, entity).nodes);
    for seed in [6, 7] {
        app.world_mut().get_mut::<CrackRelief>(entity).unwrap().seed = seed;
        app.update();
    }
    make(&mut app);
    (0..10).for_each(|_| app.update());
    settle(&mut app, entity);
    assert_eq!((told(&app).made.len(), state(&app, entity).nodes), (2, nodes));
    assert!(shown(&app, entity) != before);
    // Cancelled by removing the component, and by despawning.
    app.world_mut().get_mut::<CrackRelief>(entity).unwrap().seed = 8;
    app.update();
    app.world_mut().entity_mut(entity).remove::<CrackRelief>();
    assert_eq!(progress(&app, entity), 0.0);
    let other = app.world_mut().spawn((Sprite::default(), island())).id();
    app.update();
    app.world_mut().despawn(other);
    (0..200).for_each(|_| app.update());
    assert_eq!((told(&app).made.len(), told(&app).failed.len()), (2, 0));
}

/// A 3D wall gets a material of its own with normals, and a mesh that stands out of it.
#[test]
fn walls_stand_out() {
    let mut app = relief_app();
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(Rectangle::new(3.0, 2.0));
    let shared = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial::default());
    let wall = CrackRelief::rock_wall().with_size(UVec2::new(96, 64)).with_displacement(1.5).with_steep_cracks(1.0);
    let surface = CrackSurface::new(CrackPreset::CONCRETE);
    let entity = app.world_mut().spawn((Mesh3d(mesh.clone()), MeshMaterial3d(shared.clone()), wall, surface)).id();
    make(&mut app);
    assert_eq!(told(&app).failed, []);
    let material = app.world().get::<MeshMaterial3d<StandardMaterial>>(entity).unwrap().0.clone();
    assert_ne!(material, shared);
    let materials = app.world().resource::<Assets<StandardMaterial>>();
    assert!(materials.get(&shared).unwrap().base_color_texture.is_none(), "others keep theirs");
    assert!(materials.get(&material).unwrap().normal_map_texture.is_some());
    let own = app.world().get::<Mesh3d>(entity).unwrap().0.clone();
    let made = app.world().resource::<Assets<Mesh>>().get(&own).unwrap();
    assert!(made.attribute(Mesh::ATTRIBUTE_TANGENT).is_some());
    let places = made.attribute(Mesh::ATTRIBUTE_POSITION).unwrap().as_float3().unwrap();
    let [low, high] = [f32::min, f32::max].map(|pick| places.iter().map(|at| at[2]).reduce(pick).unwrap());
    assert!(high - low > 0.05, "{low} to {high}");
    assert!(places.iter().all(|at| at[0].abs() < 1.5001 && at[1].abs() < 1.0001));
    let mask = &app.world().get::<CrackSurface>(entity).unwrap().mask;
    assert!(matches!(mask, CrackMaskSource::Images { weak: Some(_), .. }));
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
    settle(&mut app, entity);
    assert!(state(&app, entity).nodes > 20);
}

/// Fault E9: each is refused once, by name, and the game goes on; what was shown stays.
#[test]
fn e9_what_cannot_be_made_is_refused() {
    let mut app = relief_app();
    let image = add(&mut app, solid(UVec2::splat(16), [9, 9, 9, 255]));
    let mut wrong = Vec::new();
    for (name, change) in [
        ("size.x", (|relief| relief.size = UVec2::new(0, 64)) as fn(&mut CrackRelief)),
        ("size.y", |relief| relief.size = UVec2::new(64, 5000)),
        ("displacement", |relief| relief.displacement = f32::NAN),
        ("prefers_steep", |relief| relief.prefers_steep = -1.0),
        ("detail", |relief| relief.detail = 99),
        ("distance", |relief| relief.settings.contours.distance = f32::INFINITY),
        ("step", |relief| relief.settings.heights.step = 0.0),
        ("strata", |relief| relief.settings.colors.strata = 7.0),
        ("contour 0", |relief| relief.settings.shape = ReliefShape::Lines(vec![vec![Vec2::NAN; 4]])),
    ] {
        let mut relief = island();
        change(&mut relief);
        wrong.push((name, app.world_mut().spawn((Sprite::from_image(image.clone()), relief)).id()));
    }
    let bare = app.world_mut().spawn(island()).id();
    let mut frames = 0;
    while told(&app).failed.len() <= wrong.len() && frames < 20_000 {
        app.update();
        std::thread::sleep(std::time::Duration::from_millis(1));
        frames += 1;
    }
    (0..20).for_each(|_| app.update());
    let failed: Vec<String> = told(&app).failed.iter().map(ToString::to_string).collect();
    assert_eq!((failed.len(), told(&app).made.len()), (wrong.len() + 1, 0), "{failed:?}");
    for (name, entity) in wrong {
        assert!(failed.iter().any(|error| error.contains(name)), "{name}: {failed:?}");
        assert_eq!(app.world().get::<Sprite>(entity).unwrap().image, image);
        assert_eq!(progress(&app, entity), 0.0);
    }
    assert_eq!(progress(&app, bare), 0.0);
}
