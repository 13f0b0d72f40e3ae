//! Baked cracks that appear and whose time is moved: what is made of them beside the frames, and what the frames do.

use crate::{guided::*, support::*};
use bevy::prelude::*;
use bevy_crack::{plugin::CrackUploadStats, prelude::*, shatter::Anchor};

const SIZE: UVec2 = UVec2::splat(600);

/// The frames of a game, which wait for nothing.
fn hurried(mut app: App) -> App {
    app.insert_resource(CrackBudget::default());
    app
}

fn spawn(app: &mut App, appearance: GuidedAppearance) -> Entity {
    let image = add(app, picture(SIZE));
    let surface = CrackSurface::new(CrackPreset::CONCRETE);
    app.world_mut().spawn((Sprite::from_image(image), surface, guided().with_appearance(appearance))).id()
}

/// Much longer than it takes to make a picture: here frames come as fast as they can.
const SLOW: f32 = 30.0;

fn front(seconds: f32) -> GuidedAppearance {
    GuidedAppearance::Front { from: Vec2::new(0.3, 0.6), seconds }
}

fn widen(seconds: f32) -> GuidedAppearance {
    GuidedAppearance::Widen { seconds }
}

/// Diffuse and normal texels.
fn pictures(app: &App, entity: Entity) -> [Vec<u8>; 2] {
    let textures = get::<CrackTextures>(app, entity);
    [textures.diffuse, textures.normal].map(|texture| texels(app, &texture.unwrap()))
}

/// Frames until all is shown.
fn finish(app: &mut App, entity: Entity) {
    wait_for(app, "the end", |app| state(app, entity).status == CrackStatus::Done);
}

/// Frames until some of a surface is shown, but not all.
fn go_half_way(app: &mut App, entity: Entity) {
    wait_for(app, "half of it", |app| {
        let CrackState { time, end, .. } = state(app, entity);
        assert!(time < end || end == 0.0, "all of it is shown at once");
        time > 0.4 * end && end > 0.0
    });
}

/// Whichever way the cracks came, the end is the same, bit for bit, and it is told once.
#[test]
fn the_end_is_that_of_a_frame_that_waits() {
    let mut unhurried = guided_app();
    let mut app = hurried(guided_app());
    let ends = [GuidedAppearance::AtOnce, widen(1.0), front(1.0)].map(|appearance| {
        let ends = [&mut unhurried, &mut app].map(|app| {
            let entity = spawn(app, appearance);
            bake(app, entity);
            finish(app, entity);
            steps(app, 3);
            assert_sound(app, entity);
            pictures(app, entity)
        });
        assert!(ends[0] == ends[1], "{appearance:?}");
        ends[1].clone()
    });
    assert!(ends[0] == ends[1], "cracks that have opened are those that came at once");
    assert_eq!((told(&app).baked.len(), told(&app).finished, told(&app).failed.len()), (3, 3, 0));
}

/// By count: no texel of a picture that is shown is painted while its cracks appear, but pictures are exchanged.
#[test]
fn frames_exchange_pictures() {
    for appearance in [front(SLOW), widen(SLOW)] {
        let mut app = hurried(guided_app());
        let entity = spawn(&mut app, appearance);
        bake(&mut app, entity);
        // The texels, where they lie, and the time they show.
        let look = |app: &App| {
            let image = image_of(app, entity);
            let data = app.world().resource::<Assets<Image>>().get(&image).unwrap().data.clone().unwrap();
            let place = app.world().resource::<Assets<Image>>().get(&image).unwrap().data.as_ref().unwrap().as_ptr();
            (data, place as usize, state(app, entity).time)
        };
        let (mut before, mut pictures) = (look(&app), 0);
        wait_for(&mut app, "the end", |app| {
            let now = look(app);
            assert!(now.2 >= before.2, "time runs forwards");
            if now.0 != before.0 {
                assert!(now.1 != before.1 && now.2 > before.2, "it is another picture, of a later time");
                pictures += 1;
            }
            before = now;
            state(app, entity).status == CrackStatus::Done
        });
        assert!(pictures > 10, "{pictures} pictures");
    }
}

/// A clock that stands still shows the same whether frames wait for its pictures or not, wherever it has been before.
#[test]
fn a_still_clock_shows_its_time() {
    for (appearance, is_late) in [(front(1.0), false), (widen(1.0), false), (widen(1.0), true)] {
        let mut apps = [guided_app(), hurried(guided_app())];
        let entities = apps.each_mut().map(|app| {
            let entity = spawn(app, appearance);
            if !is_late {
                app.world_mut().entity_mut(entity).insert(CrackClock::value(0.0));
            }
            bake(app, entity);
            if is_late {
                finish(app, entity);
            }
            entity
        });
        let set = |app: &mut App, entity: Entity, value: f32| {
            app.world_mut().entity_mut(entity).insert(CrackClock::value(value));
            step(app);
        };
        for value in [0.3, 0.8, 0.1, 1.0, 0.0, 0.55] {
            // The one that does not wait is hunted to and fro before.
            for hunted in [0.9, 0.2, value] {
                set(&mut apps[1], entities[1], hunted);
                steps(&mut apps[1], 2);
            }
            set(&mut apps[0], entities[0], value);
            steps(&mut apps[0], 2);
            let CrackState { time, damage, cells, .. } = state(&apps[0], entities[0]);
            wait_for(&mut apps[1], "that time", |app| state(app, entities[1]).time == time);
            let other = state(&apps[1], entities[1]);
            assert!(pictures(&apps[0], entities[0]) == pictures(&apps[1], entities[1]), "{appearance:?} at {value}");
            assert_eq!((other.damage, other.cells), (damage, cells), "{appearance:?} at {value}");
        }
        // Backwards, to nothing.
        for (app, entity) in apps.iter_mut().zip(entities) {
            app.world_mut().entity_mut(entity).insert(CrackClock { seek: Some(30.0), ..CrackClock::speed(-1.0) });
            wait_for(app, "the start", |app| state(app, entity).time == 0.0);
            assert!(shown(app, entity) == picture(SIZE).data.unwrap(), "nothing is shown");
        }
    }
}

/// What happens to a surface while its cracks are on their way ends as it does where frames wait for them.
#[test]
fn whatever_happens_on_the_way() {
    type Happen = fn(&mut App, Entity);
    let hit: Happen = |app, entity| hit(app, CrackHit::uv(entity, Vec2::new(0.7, 0.3)));
    let preset: Happen = |app, entity| {
        let mut surface = app.world_mut().get_mut::<CrackSurface>(entity).unwrap();
        surface.preset = CrackPreset::GLASS.into();
    };
    let another: Happen = |app, entity| {
        let image = add(app, picture(UVec2::new(500, 300)));
        app.world_mut().get_mut::<Sprite>(entity).unwrap().image = image;
    };
    let again: Happen = |app, entity| {
        app.world_mut().get_mut::<GuidedCracks>(entity).unwrap().seed = 5;
        let n = told(app).baked.len();
        wait_for(app, "the second bake", |app| told(app).baked.len() > n);
    };
    let settings = ShatterCracks { anchor: Anchor::Nothing, speed: 0.0, ..default() };
    let shatter: Happen = |app, entity| {
        app.world_mut().commands().entity(entity).shatter_cracks(ShatterRequest::around(Vec2::splat(0.4), 0.2));
        wait_for(app, "shards", |app| app.world().get::<CrackShards>(entity).is_some_and(|told| told.shown > 0));
    };
    let part: Happen = |app, entity| {
        let rect = Rect::new(0.0, 0.0, 600.0, 300.0);
        app.world_mut().get_mut::<Sprite>(entity).unwrap().rect = Some(rect);
    };
    let removed: Happen = |app, entity| _ = app.world_mut().entity_mut(entity).remove::<GuidedCracks>();
    let tinted: Happen = |app, _| {
        // In each frame, and what is shown stays the same.
        app.add_systems(Update, |mut sprites: Query<&mut Sprite>| {
            sprites.iter_mut().for_each(|mut sprite| sprite.color = Color::WHITE);
        });
    };
    let happenings: [(&str, Happen); 8] = [
        ("tint", tinted),
        ("hit", hit),
        ("preset", preset),
        ("another picture", another),
        ("another bake", again),
        ("shatter", shatter),
        ("another part", part),
        ("no component", removed),
    ];
    for (name, happen) in happenings {
        let ends = [(guided_app(), 1.0), (hurried(guided_app()), SLOW)].map(|(mut app, seconds)| {
            let entity = spawn(&mut app, widen(seconds));
            app.world_mut().entity_mut(entity).insert(settings.clone());
            bake(&mut app, entity);
            go_half_way(&mut app, entity);
            happen(&mut app, entity);
            steps(&mut app, 3);
            finish(&mut app, entity);
            assert_eq!(told(&app).failed, []);
            (pictures(&app, entity), state(&app, entity).nodes)
        });
        assert_eq!(ends[0].1, ends[1].1, "{name}");
        let of = |picture: &[u8]| match name {
            // Which cracks the shards have cut depends on when.
            "shatter" => 0,
            // What is not shown any more stays as it was.
            "another part" => picture.len() / 2,
            _ => picture.len(),
        };
        for (one, other) in ends[0].0.iter().zip(&ends[1].0) {
            assert!(one[..of(one)] == other[..of(other)], "{name}");
        }
    }
}

/// Taken back half-way: the surface shows its own picture, and can be cracked anew.
#[test]
fn taken_back_half_way() {
    type End = fn(&mut App, Entity);
    let heal: End = |app, entity| _ = app.world_mut().commands().entity(entity).heal_cracks();
    let close: End = |app, entity| {
        app.world_mut().commands().entity(entity).close_cracks(0.2);
        wait_for(app, "the end", |app| app.world().get::<CrackTextures>(entity).is_none());
    };
    let removed: End = |app, entity| _ = app.world_mut().entity_mut(entity).remove::<CrackSurface>();
    let despawned: End = |app, entity| _ = app.world_mut().despawn(entity);
    for (appearance, end) in
        [(widen(SLOW), heal), (front(SLOW), close), (front(SLOW), removed), (widen(SLOW), despawned)]
    {
        let mut app = hurried(guided_app());
        let entity = spawn(&mut app, appearance);
        bake(&mut app, entity);
        go_half_way(&mut app, entity);
        end(&mut app, entity);
        for _ in 0..20 {
            step(&mut app);
            if app.world().get_entity(entity).is_ok() {
                assert!(shown(&app, entity) == picture(SIZE).data.unwrap());
                assert!(app.world().get::<CrackTextures>(entity).is_none());
            }
        }
        assert_eq!((told(&app).failed.len(), told(&app).finished), (0, 0));
        if app.world().get::<CrackSurface>(entity).is_some() {
            assert_cracks(&mut app, entity);
        }
    }
}

/// The GPU has what is shown, in every frame, by few copies.
#[test]
fn appearing_cracks_reach_the_gpu() {
    let Some((_one, app)) = gpu_app() else { return };
    let mut app = hurried(listening(app));
    for appearance in [front(SLOW), widen(SLOW)] {
        let entity = spawn(&mut app, appearance);
        bake(&mut app, entity);
        let (mut pictures, mut bytes) = (0, 0);
        wait_for(&mut app, "the end", |app| {
            let stats = app.world().resource::<CrackUploadStats>();
            // Eight times eight parts of two textures.
            assert!(stats.rects <= 128, "{stats:?}");
            pictures += u64::from(stats.rects > 0);
            bytes += stats.bytes;
            state(app, entity).status == CrackStatus::Done
        });
        assert!(pictures > 10, "{pictures} pictures");
        assert!(bytes < pictures * 8 * u64::from(SIZE.element_product()), "only what has changed");
        assert_on_gpu(&mut app, &[entity]);
    }
    let entity = spawn(&mut app, front(1.0));
    app.world_mut().entity_mut(entity).insert(CrackClock::value(0.0));
    bake(&mut app, entity);
    for value in [0.5, 0.2, 1.0, 0.7] {
        app.world_mut().entity_mut(entity).insert(CrackClock::value(value));
        step(&mut app);
        wait_for(&mut app, "that time", |app| {
            let CrackState { time, end, .. } = state(app, entity);
            (time - value * end).abs() < 0.01
        });
        assert_on_gpu(&mut app, &[entity]);
    }
}
