//! Numbers that no component, command, event or resource should have: the fault E9 of the reliability list. Each is refused by name or means
//! what its documentation says, and nothing ends the app or keeps it busy.

use crate::{guided::*, support::*};
use bevy::prelude::*;
use bevy_crack::{
    growth::{CrackGrowth, GrowthParams},
    math::Rng,
    plugin::{MAX_LIGHTS, ShardsError},
    prelude::*,
    shatter::{Anchor, ShatterError, ShatterParams},
    voronoi::{FRONT_STEP, VoronoiBake, VoronoiParams},
};
use std::time::{Duration, Instant};

const WILD: [f32; 14] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    1e-45,
    1e30,
    -1e30,
    1e9,
    -1.0,
    -0.0,
    0.0,
    0.5,
];

fn wild(rng: &mut Rng) -> f32 {
    WILD[rng.next_u32() as usize % WILD.len()]
}

/// What a bake of this says, which is to end at once.
fn refused(app: &mut App, guided: GuidedCracks) -> CrackError {
    let image = add(app, picture(UVec2::splat(64)));
    let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), guided)).id();
    let n = told(app).failed.len();
    steps(app, 3);
    assert_eq!((told(app).failed.len(), progress(app, entity)), (n + 1, 0.0), "it fails once, before any work");
    assert_cracks(app, entity);
    told(app).failed[n].1.clone()
}

#[test]
fn e9_guided_cracks_are_refused_by_name() {
    let mut app = guided_app();
    let far = |from: Vec2| GuidedAppearance::Front { from, seconds: 1.0 };
    let appearances = [
        (far(Vec2::new(1e9, 0.5)), "appearance.from"),
        (far(Vec2::new(0.5, -65.0)), "appearance.from"),
        (far(Vec2::new(f32::NAN, 0.5)), "appearance.from"),
        (far(Vec2::new(0.5, f32::INFINITY)), "appearance.from"),
        (GuidedAppearance::Widen { seconds: f32::INFINITY }, "appearance.seconds"),
        (GuidedAppearance::Widen { seconds: 1e7 }, "appearance.seconds"),
        (GuidedAppearance::Front { from: Vec2::ZERO, seconds: f32::MAX }, "appearance.seconds"),
    ];
    for (appearance, name) in appearances {
        let error = refused(&mut app, guided().with_appearance(appearance));
        assert!(matches!(&error, CrackError::OutOfRange { field, .. } if field == name), "{appearance:?}: {error:?}");
        assert!(error.to_string().starts_with(&format!("`{name}` is ")), "{error}");
    }
    let changes: [(&str, fn(&mut GuidedCracks)); 5] = [
        ("guides", |guided| guided.guides = vec![CrackGuide::own_edges().with_gamma(0.0); 65]),
        ("guides.gamma", |guided| guided.guides[0].gamma = f32::NAN),
        ("params.beta", |guided| guided.params.beta = f32::MAX),
        ("params.noise_scale", |guided| guided.params.noise_scale = 1e-45),
        ("params.levels", |guided| guided.params.levels = u32::MAX),
    ];
    for (name, change) in changes {
        let mut guided = guided();
        change(&mut guided);
        let error = refused(&mut app, guided);
        assert!(matches!(&error, CrackError::OutOfRange { field, .. } if field == name), "{name}: {error:?}");
    }
    assert_eq!(told(&app).baked, []);
}

#[test]
fn e9_guided_cracks_at_the_ends_of_their_ranges_are_baked() {
    let mut app = guided_app();
    let at_once = [f32::NAN, 0.0, -1e30, f32::NEG_INFINITY, 1e-45, 1.0];
    let mut appearances: Vec<_> = at_once.map(|seconds| GuidedAppearance::Widen { seconds }).to_vec();
    for from in [Vec2::splat(64.0), Vec2::splat(-64.0), Vec2::new(-0.0, 1.0)] {
        appearances.push(GuidedAppearance::Front { from, seconds: 0.1 });
    }
    for appearance in appearances {
        let image = add(&mut app, picture(UVec2::splat(64)));
        let mut guided = guided().with_appearance(appearance);
        guided.max_side = 0;
        guided.seed = u64::MAX;
        let surface = CrackSurface::new(CrackPreset::CONCRETE);
        let entity = app.world_mut().spawn((Sprite::from_image(image), surface, guided)).id();
        bake(&mut app, entity);
        // A map of one texel has no seams; one of the surface's size has.
        app.world_mut().get_mut::<GuidedCracks>(entity).unwrap().max_side = u32::MAX;
        bake(&mut app, entity);
        settle(&mut app, entity);
        assert!(state(&app, entity).nodes > 10, "{appearance:?}");
        hit(&mut app, center(entity));
        settle(&mut app, entity);
    }
    assert_eq!(told(&app).failed, []);
}

/// However far away a front begins, its births are as many as can be counted, and growth goes on after them.
#[test]
fn e9_a_front_from_far_away_comes_in_a_countable_time() {
    let params = VoronoiParams { sites: 12, ..VoronoiParams::DEFAULT };
    let bake = VoronoiBake::new(params, Vec::new(), UVec2::splat(48), 3).expect("good parameters");
    let (_, seams) = bake.finish();
    for from in [1.0, 1e4, 1e9, 1e30, f32::MAX, f32::NAN, f32::NEG_INFINITY] {
        let network = seams.network(Vec2::splat(from));
        let last = network.nodes().iter().map(|node| node.birth).max().expect("nodes");
        let away = if from.is_finite() { 1.5 * from.abs() + 10.0 } else { 10.0 };
        assert!(last <= 1_000_000 && last as f32 <= away / FRONT_STEP, "{from}: {last}");
        // As of tempered glass, which begins cracks of its own accord.
        let params = GrowthParams { nucleation: 4.0, ..CrackPreset::TEMPERED_GLASS.growth };
        let mut growth = CrackGrowth::new(params, Vec2::ONE, 1).expect("good parameters");
        let start = Instant::now();
        assert_eq!(growth.add_cracks(&network, 12), last + 13);
        growth.hit(Vec2::splat(0.5), 1.0);
        (0..20).for_each(|_| _ = growth.step());
        assert!(start.elapsed() < Duration::from_secs(20), "{from}");
        assert!(growth.network().nodes().len() > network.nodes().len());
    }
}

#[derive(Resource, Default)]
struct Outcomes(Vec<Result<usize, ShardsError>>);

#[test]
fn e9_blows_of_any_strength_and_direction() {
    let mut app = app();
    app.init_resource::<Outcomes>()
        .add_observer(|done: On<Shattered>, mut all: ResMut<Outcomes>| all.0.push(Ok(done.shards.len())))
        .add_observer(|failed: On<ShatterFailed>, mut all: ResMut<Outcomes>| all.0.push(Err(failed.error.clone())));
    let settings = || ShatterCracks {
        cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
        anchor: Anchor::Nothing,
        ..default()
    };
    let mut outcome = |energy: f32, direction: Vec3, scale: f32, request: ShatterRequest| {
        let image = add(&mut app, picture(UVec2::splat(48)));
        let place = Transform::from_scale(Vec3::splat(scale));
        let entity = app.world_mut().spawn((
            Sprite::from_image(image),
            place,
            CrackSurface::new(CrackPreset::GLASS),
            settings(),
        ));
        let entity = entity.id();
        hit(&mut app, center(entity).with_energy(energy).with_direction(direction));
        settle(&mut app, entity);
        app.world_mut().commands().entity(entity).shatter_cracks(request);
        steps(&mut app, 4);
        let mut shards = app.world_mut().query::<(&Shard, &Transform)>();
        for (shard, transform) in shards.iter(app.world()) {
            assert!(shard.velocity.is_finite() && shard.spin.is_finite() && transform.is_finite(), "{shard:?}");
        }
        app.world_mut().despawn(entity);
        let mut outcomes = core::mem::take(&mut app.world_mut().resource_mut::<Outcomes>().0);
        assert_eq!(outcomes.len(), 1, "one answer: {outcomes:?}");
        outcomes.remove(0)
    };
    let all = ShatterRequest::ALL;
    // A hit may be as hard as it likes, and come from wherever.
    for energy in [1e-30, 1.0, 1000.0, 1e9, f32::MAX] {
        assert!(outcome(energy, Vec3::ZERO, 1.0, all).is_ok_and(|n| n > 0), "{energy}");
    }
    let ways = [1e-45, 1e-30, 1e10, 1e30, f32::MAX].map(|length| Vec3::new(length, -0.5 * length, 0.0));
    for direction in ways {
        for scale in [1e-6, 1.0, 1e6] {
            let given = outcome(1.0, direction, scale, all);
            assert!(given.is_ok_and(|n| n > 0), "{direction} {scale}");
        }
        let asked = ShatterRequest { direction: Some(direction), ..all };
        assert!(outcome(1.0, Vec3::ZERO, 1.0, asked).is_ok_and(|n| n > 0), "{direction}");
    }
    // What a request asks for is refused by name where it is out of its range.
    for value in WILD {
        let requests = [
            ("uv", ShatterRequest { uv: Some(Vec2::new(value, 0.5)), ..all }, -64.0..=64.0),
            ("uv", ShatterRequest { uv: Some(Vec2::new(0.5, value)), ..all }, -64.0..=64.0),
            ("reach", ShatterRequest { reach: value, ..all }, 0.0..=64.0),
            ("energy", all.with_energy(value), 0.0..=1000.0),
            ("direction", ShatterRequest { direction: Some(Vec3::Y * value), ..all }, f32::MIN..=f32::MAX),
        ];
        for (name, request, range) in requests {
            let valid = request.validate();
            let is_everything = name == "reach" && value == f32::INFINITY;
            assert_eq!(valid.is_ok(), range.contains(&value) || is_everything, "{name} {value}");
            if valid.is_err() {
                let error = outcome(1.0, Vec3::ZERO, 1.0, request).expect_err("it is refused");
                let named =
                    matches!(error, ShardsError::Parameter(ShatterError::OutOfRange { name: n, .. }) if n == name);
                assert!(named, "{name} {value}: {error}");
            }
        }
    }
}

#[test]
fn e9_clocks_and_closing_times_of_any_bits() {
    let mut app = app();
    let mut rng = Rng::new(9);
    let entities: Vec<Entity> = (0..12).map(|_| spawn_picture(&mut app, UVec2::splat(32))).collect();
    let guided = guided().with_appearance(GuidedAppearance::Widen { seconds: 0.3 });
    app.world_mut().entity_mut(entities[0]).insert(guided);
    for _ in 0..400 {
        let entity = entities[rng.next_u32() as usize % entities.len()];
        let value = wild(&mut rng);
        match rng.next_u32() % 6 {
            0 => _ = app.world_mut().entity_mut(entity).insert(CrackClock::speed(value)),
            1 => _ = app.world_mut().entity_mut(entity).insert(CrackClock::value(value)),
            2 => _ = app.world_mut().entity_mut(entity).insert(CrackClock { seek: Some(value), ..default() }),
            3 => _ = app.world_mut().entity_mut(entity).remove::<CrackClock>(),
            4 => _ = app.world_mut().commands().entity(entity).close_cracks(value),
            _ => hit(&mut app, center(entity).with_energy(value)),
        }
        step(&mut app);
        for entity in &entities {
            let CrackState { time, end, damage, .. } = state(&app, *entity);
            assert!((0.0..=end).contains(&time) && end < 1e5 && (0.0..=1.0).contains(&damage), "{time} {end} {damage}");
        }
    }
    // Infinitely fast is as fast as the budget allows.
    let entity = spawn_picture(&mut app, UVec2::splat(48));
    app.world_mut().entity_mut(entity).insert(CrackClock::speed(f32::INFINITY));
    hit(&mut app, center(entity));
    settle(&mut app, entity);
}

#[test]
fn e9_budgets_of_any_bits() {
    let mut rng = Rng::new(11);
    let mut any = |most: u64| match rng.next_u32() % 5 {
        0 => 0,
        1 => 1,
        2 => most,
        _ => u64::from(rng.next_u32()).min(most),
    };
    for round in 0..40 {
        let mut app = app();
        let budget = CrackBudget {
            milliseconds: WILD[round % WILD.len()],
            max_queued_per_surface: any(u64::MAX) as usize,
            max_growing: any(u64::MAX) as usize,
            max_texture_bytes: any(u64::MAX),
            max_side: any(u64::from(u32::MAX)) as u32,
            max_shards: any(u64::MAX) as usize,
        };
        app.insert_resource(budget.clone());
        let resolution = match round % 4 {
            0 => CrackResolution::Fixed(UVec2::MAX),
            1 => CrackResolution::Fixed(UVec2::new(0, u32::MAX)),
            2 => CrackResolution::Fixed(UVec2::new(u32::MAX, 1)),
            _ => CrackResolution::Picture,
        };
        // No more than some MiB, whatever the budget allows.
        let is_much = budget.max_side > 2048 && budget.max_texture_bytes > 1 << 26 && round % 4 == 0;
        let image = add(&mut app, picture(UVec2::new(40, 30)));
        let surface = CrackSurface::new(small_preset()).with_resolution(resolution);
        let entity = app.world_mut().spawn((Sprite::from_image(image), surface)).id();
        if is_much {
            app.world_mut().resource_mut::<CrackBudget>().max_side = 1024;
        }
        for _ in 0..5 {
            hit(&mut app, center(entity));
        }
        wait_for(&mut app, "an end", |app| {
            matches!(state(app, entity).status, CrackStatus::Done | CrackStatus::Failed(_)) && counts(app).queued == 0
        });
        app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::ALL);
        steps(&mut app, 5);
        let shown = app.world_mut().query::<&Shard>().iter(app.world()).count();
        assert!(shown <= budget.max_shards, "{shown} shards: {budget:?}");
        if matches!(state(&app, entity).status, CrackStatus::Done) {
            assert_sound(&app, entity);
        }
    }
}

#[test]
fn e9_lights_that_are_no_lights_are_dark() {
    let mut app = app();
    single_threaded(&mut app);
    let material = add(&mut app, CrackLitMaterial::default());
    let good = app.world_mut().spawn((CrackLight2d::default(), Transform::from_xyz(3.0, 4.0, 0.0))).id();
    let bad = app.world_mut().spawn((Name::new("lamp"), CrackLight2d::default(), Transform::default())).id();
    let shining = |app: &App| {
        let lit = app.world().resource::<Assets<CrackLitMaterial>>().get(&material).expect("the material").lit;
        assert!(lit.position.iter().chain(&lit.color).all(|value| value.is_finite()), "{lit:?}");
        (0..MAX_LIGHTS).filter(|i| lit.position[*i].w > 0.0).count()
    };
    steps(&mut app, 2);
    assert_eq!(shining(&app), 2);
    let heard = warnings(|| {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
            let changes: [fn(&mut CrackLight2d, f32); 4] = [
                |light, value| light.range = value,
                |light, value| light.height = value,
                |light, value| light.intensity = value,
                |light, value| light.color = LinearRgba::rgb(value, 0.0, 0.0).into(),
            ];
            for change in changes {
                let mut light = CrackLight2d { intensity: 2.0, ..default() };
                change(&mut light, value);
                app.world_mut().entity_mut(bad).insert(light);
                steps(&mut app, 2);
                // Nothing is below the least number, and light of it is none; others that are finite are what they say.
                assert!(shining(&app) <= 2);
                assert!(value == f32::MAX || shining(&app) == 1, "{light:?}");
                // What stands still is written once.
                let mut changed = app.world().resource::<Messages<AssetEvent<CrackLitMaterial>>>().get_cursor_current();
                steps(&mut app, 3);
                let events = app.world().resource::<Messages<AssetEvent<CrackLitMaterial>>>();
                assert_eq!(changed.read(events).count(), 0, "{light:?}");
            }
        }
    });
    assert_eq!(heard.len(), 1, "{heard:?}");
    assert!(heard[0].contains("lamp"), "{heard:?}");
    app.world_mut().entity_mut(bad).insert((CrackLight2d::default(), Transform::from_xyz(f32::NAN, 0.0, 0.0)));
    steps(&mut app, 2);
    assert_eq!(shining(&app), 1);
    app.world_mut().despawn(good);
    app.world_mut().entity_mut(bad).insert(Transform::default());
    steps(&mut app, 2);
    assert_eq!(shining(&app), 1);
}

/// Numbers of presets: refused by name, or they work.
#[test]
fn e9_presets_of_any_numbers_are_refused_or_work() {
    let mut app = app();
    let mut rng = Rng::new(5);
    let (mut worked, mut refused) = (0, 0);
    for round in 0..300 {
        let name = CrackPreset::NAMES[round % CrackPreset::NAMES.len()];
        let mut preset = CrackPreset::named(name).expect("a preset");
        let value = wild(&mut rng);
        match rng.next_u32() % 12 {
            0 => preset = preset.scaled(value),
            1 => preset.steps_per_second = value,
            2 => preset.growth.reach = value,
            3 => preset.growth.step_length = value,
            4 => preset.growth.nucleation = value,
            5 => preset.growth.max_nodes = value as u32,
            6 => preset.growth.num_iterations = value as u32,
            7 => preset.profile.full_width = value,
            8 => preset.look.glint = value,
            9 => preset.look.relief = value,
            10 => preset.growth.max_width = value,
            _ => preset.growth.arrest = value,
        }
        // As fast as it may be, so that it comes to an end.
        let is_halted = preset.steps_per_second == 0.0;
        let valid = preset.validate();
        let image = add(&mut app, picture(UVec2::splat(24)));
        let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset))).id();
        hit(&mut app, center(entity));
        steps(&mut app, 3);
        match (valid, state(&app, entity).status) {
            (Err(error), CrackStatus::Failed(CrackError::Preset { reason })) => {
                assert!(reason.starts_with('`') && reason == error.to_string(), "{reason}");
                refused += 1;
            }
            (Ok(()), CrackStatus::Failed(error)) => panic!("{name}: {error}"),
            (Ok(()), _) => {
                worked += 1;
                if !is_halted {
                    assert_sound(&app, entity);
                }
            }
            (Err(error), status) => panic!("{name}: {error} {status:?}"),
        }
        app.world_mut().despawn(entity);
    }
    assert!(worked > 50 && refused > 50, "{worked} {refused}");
}
