//! Plays a scene from a file in `assets/scenes`: surfaces, presets and scripted hits, without code.
//!
//! `cargo run --example scene -- shop_window`; without a name it says which there are. Click to hit, H heals.
//! Without a display (or with `--headless`) pictures and a GIF are written to `--out`.

use bevy::{prelude::*, world_serialization::DynamicWorldRoot};
use bevy_crack::prelude::*;
use bevy_crack_demos::{DemoArguments, OnCanvas, demo_app, heal_on_h, hit_on_press, play};
use std::process::ExitCode;

/// Names of the scenes there are.
fn names() -> Vec<String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/scenes");
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> =
        files.filter_map(|file| Some(file.file_name().to_str()?.strip_suffix(".scn.ron")?.to_owned())).collect();
    names.sort();
    names
}

#[expect(clippy::print_stderr, reason = "a demo says what it takes")]
fn main() -> ExitCode {
    let (arguments, name) = DemoArguments::given_with_name("Plays a scene from a file in assets/scenes");
    let Some(name) = name.filter(|name| names().contains(name)) else {
        eprintln!("scene: name one of {}", names().join(", "));
        return ExitCode::FAILURE;
    };
    let mut app = demo_app("bevy_crack: scene", &arguments);
    app.insert_resource(ClearColor(Color::srgb(0.2, 0.23, 0.27))).add_observer(prepare);
    app.add_systems(Startup, move |mut commands: Commands, assets: Res<AssetServer>| {
        commands.spawn(Camera2d);
        commands.spawn(DynamicWorldRoot(assets.load(format!("scenes/{name}.scn.ron"))));
    });
    match play(app, heal_on_h, || {}) {
        AppExit::Success => ExitCode::SUCCESS,
        AppExit::Error(code) => ExitCode::from(code.get()),
    }
}

/// Surfaces of the file can be clicked, and are seen where nothing can be drawn.
fn prepare(added: On<Add, CrackSurface>, sprites: Query<&Sprite>, mut commands: Commands) {
    let Ok(sprite) = sprites.get(added.entity) else { return };
    let size = sprite.custom_size.unwrap_or(Vec2::splat(256.0));
    commands.entity(added.entity).insert(OnCanvas { picture: sprite.image.clone(), size }).observe(hit_on_press);
}
