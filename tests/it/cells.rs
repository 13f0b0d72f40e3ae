//! What games hang on cracks: cells that close, tips that grow, and where they are in the world.

use crate::support::{FRAME, add, app, hit, picture, settle, state, step, steps};
use bevy::{ecs::system::RunSystemOnce, prelude::*, sprite::Anchor};
use bevy_crack::{
    growth::CrackGrowth,
    math::Rng,
    pattern::{CellTracker, NO_PARENT, SurfaceFrame},
    prelude::*,
};

const SIZE: UVec2 = UVec2::new(96, 64);

/// Every cell that was told of.
#[derive(Resource, Default)]
struct Told(Vec<CellClosed>);

fn spawn(app: &mut App, preset: CrackPreset) -> Entity {
    app.init_resource::<Told>();
    app.add_observer(|closed: On<CellClosed>, mut told: ResMut<Told>| told.0.push(*closed));
    let image = add(app, picture(SIZE));
    app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset).with_seed(3))).id()
}

fn told(app: &App) -> &[CellClosed] {
    &app.world().resource::<Told>().0
}

/// The same growth without an engine.
fn grown(preset: &CrackPreset, hits: &[Vec2]) -> CrackGrowth {
    let frame = SurfaceFrame::new(SIZE).unwrap();
    let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), 3).unwrap();
    for uv in hits {
        growth.hit(frame.uv_to_pos(*uv), 1.0);
        while growth.step().grew() {}
    }
    growth
}

#[test]
fn every_cell_is_told_once_when_it_closes() {
    for preset in [CrackPreset::CLAY, CrackPreset::TEMPERED_GLASS] {
        let mut app = app();
        let entity = spawn(&mut app, preset.clone());
        let hits = [Vec2::new(0.3, 0.4), Vec2::new(0.8, 0.6)];
        for uv in hits {
            hit(&mut app, CrackHit::uv(entity, uv));
            settle(&mut app, entity);
            assert_eq!(told(&app).len(), state(&app, entity).cells as usize);
        }
        let growth = grown(&preset, &hits);
        let mut tracker = CellTracker::new(growth.network().extent());
        tracker.update(growth.network());
        assert_eq!(state(&app, entity).cells, tracker.closed());
        assert!(tracker.closed() > 5, "{} cells", tracker.closed());
        let surface = growth.network().extent().element_product();
        for (i, cell) in (1..).zip(told(&app)) {
            assert_eq!((cell.entity, cell.cell), (entity, i));
            assert!(cell.area > 0.0 && cell.area < surface, "{cell:?}");
            assert!(cell.uv.cmpge(Vec2::ZERO).all() && cell.uv.cmple(Vec2::ONE).all(), "{cell:?}");
        }
        app.world_mut().commands().entity(entity).heal_cracks();
        app.update();
        assert_eq!(state(&app, entity).cells, 0);
    }
}

#[test]
fn a_clock_hides_cells_and_tells_none_twice() {
    let mut app = app();
    let entity = spawn(&mut app, CrackPreset::CLAY);
    app.world_mut().entity_mut(entity).insert(CrackClock::value(0.0));
    hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
    steps(&mut app, 400);
    assert_eq!((state(&app, entity).cells, told(&app).len()), (0, 0), "nothing is shown");
    let (mut rng, mut most) = (Rng::new(2), 0);
    for share in [0.5, 0.9, 0.2, 1.0, 0.0].into_iter().chain((0..30).map(|_| rng.unit())) {
        app.world_mut().entity_mut(entity).insert(CrackClock::value(share));
        steps(&mut app, 2);
        most = most.max(state(&app, entity).cells);
        assert_eq!(told(&app).len(), most as usize, "told when shown for the first time");
    }
    app.world_mut().entity_mut(entity).insert(CrackClock::value(0.0));
    steps(&mut app, 2);
    assert_eq!(state(&app, entity).cells, 0);
    assert!(most > 5);
}

#[test]
fn the_lengths_of_tips_add_up_to_the_cracks() {
    let preset = CrackPreset { steps_per_second: 1.0 / FRAME.as_secs_f32(), ..CrackPreset::CONCRETE };
    let growth = grown(&preset, &[Vec2::splat(0.5)]);
    let nodes = growth.network().nodes();
    let whole: f32 = nodes
        .iter()
        .filter(|node| node.parent != NO_PARENT)
        .map(|node| node.pos.distance(nodes[node.parent as usize].pos))
        .sum();
    // Plain growth, and the same shown in fractions of steps.
    for clock in [None, Some(CrackClock::speed(0.37))] {
        let mut app = app();
        let entity = spawn(&mut app, preset.clone());
        if let Some(clock) = clock {
            app.world_mut().entity_mut(entity).insert(clock);
        }
        hit(&mut app, CrackHit::uv(entity, Vec2::splat(0.5)));
        let mut sum = 0.0;
        loop {
            step(&mut app);
            let state = state(&app, entity);
            for tip in &state.tips {
                assert!(tip.length >= 0.0 && (tip.direction.length() - 1.0).abs() < 1e-3, "{tip:?}");
                sum += tip.length;
            }
            if state.status == CrackStatus::Done {
                break;
            }
        }
        // The last step is told together with the end, when there are no tips any more.
        assert!((sum / whole - 1.0).abs() < 0.05, "{sum} of {whole} with {clock:?}");
    }
}

#[test]
fn places_on_sprites_are_where_bevy_says() {
    let mut app = app();
    let image = add(&mut app, picture(SIZE));
    let mut rng = Rng::new(4);
    for i in 0..200 {
        let sprite = Sprite {
            image: image.clone(),
            flip_x: rng.unit() < 0.5,
            flip_y: rng.unit() < 0.5,
            custom_size: (rng.unit() < 0.5).then(|| Vec2::new(rng.range(5.0, 50.0), rng.range(5.0, 50.0))),
            rect: (rng.unit() < 0.5).then(|| Rect::new(8.0, 16.0, 72.0, 48.0)),
            ..default()
        };
        let anchor = [Anchor::CENTER, Anchor::TOP_LEFT, Anchor::BOTTOM_RIGHT][i % 3];
        let transform = Transform::from_xyz(rng.signed(), rng.signed(), rng.signed())
            .with_rotation(Quat::from_euler(EulerRot::XYZ, rng.signed(), rng.signed(), rng.signed()))
            .with_scale(Vec3::new(rng.range(0.5, 2.0), rng.range(-2.0, -0.5), 1.0));
        let uv = Vec2::new(rng.range(0.01, 0.99), rng.range(0.01, 0.99));
        let entity = app.world_mut().spawn((sprite.clone(), anchor, transform, CrackSurface::default())).id();
        app.update();
        let place = app.world_mut().run_system_once(move |places: CrackPlaces| places.at(entity, uv)).unwrap().unwrap();
        let local = transform.compute_affine().inverse().transform_point3(place.position);
        let images = app.world().resource::<Assets<Image>>();
        let texel = sprite.compute_pixel_space_point(local.truncate(), anchor, images, &Assets::default()).unwrap();
        let rect = sprite.rect.unwrap_or(Rect { min: Vec2::ZERO, max: SIZE.as_vec2() });
        assert!(texel.distance(rect.min + uv * rect.size()) < 0.01, "{sprite:?}: {texel}");
        assert!(local.z.abs() < 1e-4);
        // Away from the sprite on its own side.
        let above = transform.compute_affine().inverse().transform_point3(place.position + place.normal);
        assert!(above.z > 0.0 && (place.normal.length() - 1.0).abs() < 1e-4);
        app.world_mut().despawn(entity);
    }
}

#[test]
fn places_on_meshes_are_on_their_triangles() {
    let mut app = app();
    let mesh = add(&mut app, Mesh::from(Rectangle::new(4.0, 2.0)));
    let turned = Transform::from_xyz(1.0, 2.0, 3.0).with_rotation(Quat::from_rotation_y(1.0));
    let flat = app.world_mut().spawn((Mesh2d(mesh.clone()), turned)).id();
    let solid = app.world_mut().spawn((Mesh3d(mesh), turned)).id();
    let bare = app.world_mut().spawn(turned).id();
    app.update();
    let mut at =
        |entity, uv| app.world_mut().run_system_once(move |places: CrackPlaces| places.at(entity, uv)).unwrap();
    for uv in [Vec2::ZERO, Vec2::ONE, Vec2::new(0.25, 0.5), Vec2::new(0.9, 0.1)] {
        let expected = turned.transform_point(Vec3::new(4.0 * (uv.x - 0.5), 2.0 * (0.5 - uv.y), 0.0));
        for entity in [flat, solid] {
            let place = at(entity, uv).unwrap();
            assert!(place.position.distance(expected) < 1e-4, "{uv}: {place:?}");
            assert!(place.normal.distance(turned.rotation * Vec3::Z) < 1e-4);
        }
        assert_eq!(at(bare, uv), None);
    }
    for uv in [Vec2::splat(1.5), Vec2::NAN, Vec2::INFINITY] {
        assert_eq!(at(solid, uv), None);
    }
    assert_eq!(at(Entity::PLACEHOLDER, Vec2::ZERO), None);
}
