//! Scenes in files: every file is what its description makes, loads, and plays.

use crate::{ASSETS, app, app_in, state, wait_for};
use bevy::{
    ecs::reflect::AppTypeRegistry,
    prelude::*,
    world_serialization::{DynamicWorld, DynamicWorldBuilder, DynamicWorldRoot},
};
use bevy_crack::{plugin::PresetSource, prelude::*, shatter::BurstParams};
use std::{fs, path::PathBuf};

const NAMES: [&str; 6] = ["shooting_range", "shop_window", "mud_flat", "ice_lake", "writing_on_the_wall", "shatter"];

/// One surface of a scene.
struct Exhibit {
    name: &'static str,
    picture: &'static str,
    preset: &'static str,
    at: Vec2,
    size: Vec2,
    mode: SpriteImageMode,
    resolution: CrackResolution,
    seed: u64,
    script: CrackScript,
}

impl Exhibit {
    fn new(name: &'static str, picture: &'static str, preset: &'static str, at: [f32; 2], size: [f32; 2]) -> Self {
        let (at, size) = (at.into(), size.into());
        let (mode, resolution) = (SpriteImageMode::Auto, CrackResolution::Picture);
        Self { name, picture, preset, at, size, mode, resolution, seed: 1, script: CrackScript::default() }
    }

    /// Hits at these seconds and places, with this energy.
    fn hit(mut self, hits: &[(f32, [f32; 2], f32)]) -> Self {
        let hits = hits.iter().map(|&(at, uv, energy)| ScriptedHit { at, uv: uv.into(), energy, ..default() });
        self.script.hits = hits.collect();
        self
    }

    fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Repeats the picture in tiles so many times as large as it is: stretched, its cracks would be stretched too. Cracks have a texel
    /// for each of the window.
    fn tiled(mut self, scale: f32) -> Self {
        self.mode = SpriteImageMode::Tiled { tile_x: true, tile_y: true, stretch_value: scale };
        self.resolution = CrackResolution::Fixed(self.size.as_uvec2());
        self
    }

    /// Keeps the edges of the picture as wide as they are, texels.
    fn framed(mut self, edge: f32) -> Self {
        self.mode = SpriteImageMode::Sliced(TextureSlicer { border: BorderRect::all(edge), ..default() });
        self
    }

    fn shatter(mut self, at: f32) -> Self {
        self.script.shatter_at = Some(at);
        self
    }

    fn spawn<'a>(self, commands: &'a mut World, server: &AssetServer) -> EntityWorldMut<'a> {
        let preset: Handle<CrackPreset> = server.load(format!("presets/{}.crack.ron", self.preset));
        commands.spawn((
            Name::new(self.name),
            Sprite {
                image: server.load(format!("textures/{}.png", self.picture)),
                custom_size: Some(self.size),
                image_mode: self.mode,
                ..default()
            },
            Transform::from_translation(self.at.extend(0.0)),
            CrackSurface::new(preset).with_seed(self.seed).with_resolution(self.resolution),
            self.script,
        ))
    }
}

/// Puts a scene into the world, to be written.
fn build(world: &mut World, server: &AssetServer, name: &str) {
    match name {
        "shooting_range" => {
            let targets = [("brick_red", "brick"), ("concrete_fine", "concrete"), ("plaster", "plaster")];
            for (i, (picture, preset)) in (0u16..).zip(targets) {
                let (x, after) = (-400.0 + 400.0 * f32::from(i), 0.5 * f32::from(i));
                let hits =
                    [(0.6 + after, [0.4, 0.42], 1.0), (2.4 + after, [0.62, 0.6], 2.0), (4.2 + after, [0.5, 0.3], 4.0)];
                Exhibit::new(preset, picture, preset, [x, 0.0], [380.0, 380.0])
                    .hit(&hits)
                    .seed(u64::from(i) + 3)
                    .spawn(world, server);
            }
        }
        "shop_window" => {
            Exhibit::new("pane", "glass_pane", "glass", [0.0, 0.0], [960.0, 540.0])
                .framed(20.0)
                .hit(&[(0.8, [0.42, 0.46], 3.0)])
                .seed(5)
                .shatter(2.0)
                .spawn(world, server)
                .insert(ShatterCracks { floor: Some(-300.0), ..default() });
        }
        "mud_flat" => {
            let hits = [(0.3, [0.3, 0.4], 1.0), (2.0, [0.72, 0.6], 1.0), (3.6, [0.5, 0.8], 0.6)];
            let flat = Exhibit::new("flat", "mud", "mud", [0.0, 0.0], [1120.0, 620.0]).tiled(1.25);
            flat.hit(&hits).seed(9).spawn(world, server);
        }
        "ice_lake" => {
            let hits = [(0.5, [0.35, 0.5], 2.0), (2.5, [0.7, 0.35], 4.0)];
            let lake = Exhibit::new("lake", "ice", "ice", [0.0, 0.0], [1120.0, 620.0]).tiled(2.5);
            lake.hit(&hits).seed(2).spawn(world, server);
        }
        "writing_on_the_wall" => {
            let guided = GuidedCracks::new(CrackGuide::text("HELLO"));
            Exhibit::new("wall", "plaster", "concrete", [0.0, 0.0], [1120.0, 480.0])
                .tiled(2.0)
                .spawn(world, server)
                .insert(guided.with_appearance(GuidedAppearance::Front { from: Vec2::new(0.0, 0.5), seconds: 3.0 }));
        }
        "shatter" => {
            Exhibit::new("tempered", "glass_pane", "tempered_glass", [-300.0, 0.0], [520.0, 520.0])
                .hit(&[(0.5, [0.5, 0.5], 1.0)])
                .shatter(2.2)
                .spawn(world, server)
                .insert(ShatterCracks { floor: Some(-330.0), ..default() });
            let burst = BurstParams { fade_after: 6.0, ..BurstParams::DEFAULT };
            Exhibit::new("toon", "toon", "toon", [300.0, 0.0], [520.0, 520.0])
                .hit(&[(0.8, [0.5, 0.45], 2.0)])
                .shatter(2.6)
                .spawn(world, server)
                .insert(ShatterCracks { burst, floor: Some(-330.0), ..default() });
        }
        _ => panic!("no scene {name}"),
    }
}

fn path(name: &str) -> PathBuf {
    PathBuf::from(ASSETS).join(format!("scenes/{name}.scn.ron"))
}

/// The text of a scene's file.
fn written(name: &str) -> String {
    let app = app(|_| {});
    let mut world = World::new();
    build(&mut world, app.world().resource::<AssetServer>(), name);
    let entities: Vec<Entity> = world.query_filtered::<Entity, With<CrackSurface>>().iter(&world).collect();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let scene = DynamicWorldBuilder::from_world(&world, &registry)
        .deny_all()
        .allow_component::<Name>()
        .allow_component::<Sprite>()
        .allow_component::<Transform>()
        .allow_component::<CrackSurface>()
        .allow_component::<CrackScript>()
        .allow_component::<GuidedCracks>()
        .allow_component::<ShatterCracks>()
        .extract_entities(entities.into_iter())
        .build();
    scene.serialize(&registry).expect("it can be written")
}

#[test]
fn files_are_as_they_are_described() {
    for name in NAMES {
        let text = written(name);
        if std::env::var_os("UPDATE_SCENES").is_some() {
            fs::create_dir_all(path(name).parent().expect("a folder")).expect("a folder");
            fs::write(path(name), &text).expect("a file");
        }
        let there = fs::read_to_string(path(name)).unwrap_or_default();
        assert!(there == text, "assets/scenes/{name}.scn.ron is another one: set UPDATE_SCENES=1");
    }
    assert_eq!(fs::read_dir(path("x").parent().expect("a folder")).expect("a folder").count(), NAMES.len());
}

#[test]
fn every_scene_loads_and_plays() {
    for name in NAMES {
        let mut app = app(|_| {});
        let scene: Handle<DynamicWorld> = app.world().resource::<AssetServer>().load(format!("scenes/{name}.scn.ron"));
        // Time passes in frames, while files are loaded in real time.
        wait_for(&mut app, name, |app| app.world().resource::<AssetServer>().is_loaded_with_dependencies(&scene));
        app.world_mut().spawn(DynamicWorldRoot(scene));
        let mut surfaces = Vec::new();
        wait_for(&mut app, name, |app| {
            let mut all = app.world_mut().query_filtered::<Entity, With<CrackSurface>>();
            surfaces = all.iter(app.world()).collect();
            !surfaces.is_empty()
        });
        wait_for(&mut app, name, |app| surfaces.iter().all(|entity| state(app, *entity).status == CrackStatus::Done));
        for entity in &surfaces {
            let surface = app.world().get::<CrackSurface>(*entity).expect("a surface");
            assert!(matches!(surface.preset, PresetSource::Asset(_)), "{name}: its preset is in a file");
            assert!(state(&app, *entity).nodes > 20, "{name}: {:?}", state(&app, *entity));
        }
        let scripts: Vec<_> = surfaces.iter().filter_map(|entity| app.world().get::<CrackScript>(*entity)).collect();
        let falls = scripts.iter().any(|script| script.shatter_at.is_some());
        if falls {
            wait_for(&mut app, "shards", |app| {
                surfaces
                    .iter()
                    .any(|entity| app.world().get::<CrackShards>(*entity).is_some_and(|shards| shards.gone > 0))
            });
        }
    }
}

#[test]
fn a_broken_scene_is_an_error_and_no_more() {
    let whole = written("mud_flat");
    let broken = [
        ("unknown", whole.replacen("bevy_crack::CrackScript", "bevy_crack::NoSuchThing", 1)),
        ("mistyped", whole.replacen("seed: 9", "seed: \"nine\"", 1)),
        ("cut_off", whole[..whole.len() / 2].to_owned()),
    ];
    // A folder of its own, with the pictures of a bystander.
    let folder = std::env::temp_dir().join(format!("bevy_crack_scenes_{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    for (name, text) in &broken {
        assert_ne!(text, &whole);
        fs::write(folder.join(format!("{name}.scn.ron")), text).expect("a file");
    }
    let mut app = app_in(folder.to_str().expect("a name"), |_| {});
    let bystander =
        app.world_mut().spawn((Sprite::from_color(Color::WHITE, Vec2::splat(64.0)), CrackSurface::default()));
    let bystander = bystander.id();
    let server = app.world().resource::<AssetServer>().clone();
    for (name, _) in broken {
        let scene = server.load(format!("{name}.scn.ron"));
        app.world_mut().spawn(DynamicWorldRoot(scene.clone()));
        wait_for(&mut app, name, |_| server.load_state(&scene).is_failed());
    }
    let surfaces = app.world_mut().query_filtered::<(), With<CrackSurface>>().iter(app.world()).count();
    assert_eq!(surfaces, 1, "nothing of them is there");
    app.world_mut().trigger(CrackHit::uv(bystander, Vec2::splat(0.5)));
    wait_for(&mut app, "cracks", |app| state(app, bystander).status == CrackStatus::Done);
    fs::remove_dir_all(folder).expect("it was there");
}

/// The same hits at the same times, frames of other lengths: the same cracks.
#[test]
fn scripts_do_not_depend_on_the_frame_rate() {
    let cracks = |milliseconds: u64| {
        let mut app = app(|app| {
            let step = std::time::Duration::from_millis(milliseconds);
            app.insert_resource(bevy::time::TimeUpdateStrategy::ManualDuration(step));
        });
        let picture = app.world().resource::<AssetServer>().load("textures/plaster.png");
        let script =
            CrackScript::new([(4.0, Vec2::new(0.3, 0.4)), (8.0, Vec2::new(0.7, 0.6)), (0.0, Vec2::splat(0.5))]);
        let surface = CrackSurface::new(CrackPreset::CONCRETE);
        let wall = app.world_mut().spawn((Sprite::from_image(picture), surface, script)).id();
        wait_for(&mut app, "three hits", |app| state(app, wall).hits == 3);
        wait_for(&mut app, "the end", |app| state(app, wall).status == CrackStatus::Done);
        state(&app, wall)
    };
    let (slow, fast) = (cracks(33), cracks(7));
    assert_eq!((slow.nodes, slow.damage), (fast.nodes, fast.damage));
}

#[test]
fn a_script_repeats_itself() {
    let mut app = app(|_| {});
    let picture = app.world().resource::<AssetServer>().load("textures/plaster.png");
    let mut script = CrackScript::new([(0.1, Vec2::splat(0.5)), (f32::NAN, Vec2::ZERO), (-1.0, Vec2::ZERO)]);
    script.repeat_after = Some(1.0);
    // Time passes in frames, while the picture is loaded in real time.
    wait_for(&mut app, "the picture", |app| app.world().resource::<AssetServer>().is_loaded(&picture));
    let surface = CrackSurface::new(CrackPreset::PLASTER);
    let wall = app.world_mut().spawn((Sprite::from_image(picture), surface, script)).id();
    wait_for(&mut app, "the first time", |app| state(app, wall).nodes > 0);
    wait_for(&mut app, "healing", |app| state(app, wall).status == CrackStatus::Untouched);
    wait_for(&mut app, "the second time", |app| state(app, wall).nodes > 0);
    let stats = app.world().resource::<CrackStats>();
    assert_eq!((stats.sent, stats.applied), (2, 2));
}
