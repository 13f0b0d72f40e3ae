//! Every preset on its own picture: a wall of panes to click.
//!
//! Click to hit, H heals. Without a display (or with `--headless`) each pane is hit by a script, and pictures are written to
//! `--out`: `gallery.png`, made without the engine, shows every preset at three moments; the others are of the wall.

#[path = "../bake/own.rs"]
mod own;
#[path = "../bake/painting.rs"]
mod painting;
#[path = "../bake/pictures.rs"]
mod pictures;
#[path = "../bake/sheet.rs"]
mod sheet;

use bevy::prelude::*;
use bevy_crack::prelude::*;
use bevy_crack_demos::{DemoArguments, Label, OnCanvas, Output, Script, demo_app, heal_on_h, hit_on_press, play};
use std::{error::Error, fs, path::Path};

/// Pictures, fonts and presets that ship with the crate.
pub(crate) const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets");

/// Side of a pane in the world, and from the middle of one to the next.
const SIDE: f32 = 200.0;
const PITCH: Vec2 = Vec2::new(210.0, 237.0);

/// Most panes in a row.
const COLUMNS: usize = 6;

/// Hits on each pane in the scripted run.
const HITS: u32 = 2;

#[derive(Component)]
struct Pane;

#[expect(clippy::print_stderr, reason = "a demo says what went wrong")]
fn main() -> AppExit {
    let arguments = DemoArguments::given("Every preset on its own picture: a wall of panes to click");
    let mut app = demo_app("bevy_crack: gallery", &arguments);
    if *app.world().resource::<Output>() != Output::Window
        && let Err(error) = write_sheet(&arguments.out)
    {
        eprintln!("gallery.png: {error}");
        return AppExit::error();
    }
    app.insert_resource(ClearColor(Color::srgb(0.09, 0.1, 0.115))).add_systems(Startup, setup);
    play(app, heal_on_h, play_script)
}

fn write_sheet(out: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(out)?;
    Ok(sheet::draw(&own::exhibits().collect::<Vec<_>>(), 1, sheet::SIDE)?.save(out.join("gallery.png"))?)
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    commands.spawn(Camera2d);
    let size = Vec2::splat(SIDE);
    let count = own::exhibits().count();
    let rows = count.div_ceil(COLUMNS);
    for (i, name) in own::exhibits().enumerate() {
        let Some(preset) = own::exhibit(name) else { continue };
        // Rows of nearly as many panes, each in the middle.
        let row = (i * rows + rows - 1) / count;
        let (first, end) = ((row * count).div_euclid(rows), ((row + 1) * count).div_euclid(rows));
        let cell = Vec2::new(i as f32 - 0.5 * (first + end - 1) as f32, row as f32 - 0.5 * (rows as f32 - 1.0));
        let at = cell * PITCH * Vec2::new(1.0, -1.0) + Vec2::Y * 14.0;
        let file = |name: &str| own::own_picture(name).file_name().map(|file| Path::new("textures").join(file));
        let Some(picture) = file(name).map(|file| assets.load(file)) else { continue };
        if name.contains("glass")
            && let Some(behind) = file("clay").map(|file| assets.load(file))
        {
            // Panes stand before a picture, so that one sees they are glass.
            let color = Color::srgb(0.5, 0.55, 0.6);
            commands.spawn((
                Sprite { image: behind.clone(), color, custom_size: Some(size), ..default() },
                Transform::from_translation(at.extend(-1.0)),
                OnCanvas { picture: behind, size },
            ));
        }
        commands
            .spawn((
                Pane,
                Sprite { image: picture.clone(), custom_size: Some(size), ..default() },
                Transform::from_translation(at.extend(0.0)),
                CrackSurface::new(preset).with_seed(i as u64),
                OnCanvas { picture, size },
                Pickable::default(),
            ))
            .observe(hit_on_press);
        commands.spawn((
            Label::grey(name.replace('_', " "), 16.0, 0.7),
            Transform::from_translation((at - Vec2::Y * (SIDE / 2.0 + 16.0)).extend(1.0)),
        ));
    }
}

/// The scripted run: every pane is hit, one after the other, and again.
fn play_script(mut commands: Commands, script: Script, panes: Query<Entity, With<Pane>>) {
    // Sorted: as panes crack they get components, and a query lists them in another order.
    let panes: Vec<_> = panes.iter().sort::<Entity>().collect();
    for i in script.due(HITS * panes.len() as u32, 0.0..0.8) {
        let pane = panes[i as usize % panes.len()];
        let at = Vec2::new((0.45 + i as f32 * 0.618).fract(), (0.5 + i as f32 * 0.755).fract()) * 0.6 + 0.2;
        commands.trigger(CrackHit::uv(pane, at));
    }
}
