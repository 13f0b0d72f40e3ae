//! Type a word; it appears in the cracks of a wall.
//!
//! Letters, space and backspace change the word, and each change starts another bake while the bar below runs. Click to hit the
//! wall: new cracks start from those that are there and stop at them. Escape heals.
//!
//! Without a display (or with `--headless`) a script types, and pictures and a GIF are written to `--out`.

use bevy::{
    asset::RenderAssetUsages,
    input::keyboard::{Key, KeyboardInput},
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_crack::{prelude::*, voronoi::VoronoiParams};
use bevy_crack_demos::{Cursor, DemoArguments, Label, OnCanvas, Script, demo_app, play};
use clap::Parser;
use std::{thread, time::Duration};

/// Size of the wall's picture, texels, and in the world.
const TEXELS: UVec2 = UVec2::new(1024, 512);
const SIZE: Vec2 = Vec2::new(1120.0, 560.0);

/// Middle of the wall.
const MIDDLE: Vec2 = Vec2::new(0.0, 40.0);

/// Size of the bar when it is full.
const BAR: Vec2 = Vec2::new(700.0, 10.0);

/// The most letters.
const MOST: usize = 14;

/// Hits of the scripted run.
const HITS: u32 = 6;

#[derive(Parser)]
#[command(about = "Type a word; it appears in the cracks of a wall")]
struct Arguments {
    #[command(flatten)]
    demo: DemoArguments,
    /// What the script types
    #[arg(long, default_value = "HELLO")]
    word: String,
}

#[derive(Resource, Default)]
struct Word(String);

/// What the script types.
#[derive(Resource)]
struct Letters(Vec<char>);

#[derive(Component)]
struct Wall;

#[derive(Component)]
struct Bar;

#[derive(Component)]
struct Caption;

fn main() -> AppExit {
    let arguments = Arguments::parse();
    let mut app = demo_app("bevy_crack: writing on the wall", &arguments.demo);
    app.insert_resource(ClearColor(Color::srgb(0.09, 0.1, 0.115)))
        .insert_resource(Letters(arguments.word.chars().take(MOST).collect()))
        .init_resource::<Word>()
        .add_systems(Startup, setup)
        .add_systems(Update, (write_word.run_if(resource_changed::<Word>), run_bar).chain());
    play(app, (type_word, hit_on_click, heal_on_escape).before(write_word), play_script.before(write_word))
}

fn setup(mut commands: Commands, mut images: ResMut<Assets<Image>>) -> Result {
    commands.spawn(Camera2d);
    // The wall is two pictures wide.
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/textures");
    let plaster = image::open(format!("{folder}/plaster.png"))?.to_rgba8();
    let wall = image::RgbaImage::from_fn(TEXELS.x, TEXELS.y, |x, y| {
        *plaster.get_pixel(x % plaster.width(), y % plaster.height())
    });
    let picture = images.add(image_of(TEXELS, wall.into_raw()));
    commands.spawn((
        Wall,
        Sprite { image: picture.clone(), custom_size: Some(SIZE), ..default() },
        Transform::from_translation(MIDDLE.extend(0.0)),
        CrackSurface::new(CrackPreset::PLASTER).with_seed(4),
        OnCanvas { picture, size: SIZE },
    ));
    let amber = images.add(image_of(UVec2::ONE, vec![235, 170, 70, 255]));
    commands.spawn((
        Bar,
        Sprite { image: amber.clone(), custom_size: Some(Vec2::ONE), ..default() },
        Transform::from_xyz(0.0, -275.0, 1.0).with_scale(Vec3::new(0.001, BAR.y, 1.0)),
        OnCanvas { picture: amber, size: Vec2::ONE },
    ));
    commands.spawn((Caption, Label::grey("", 20.0, 0.75), Transform::from_xyz(0.0, -310.0, 1.0)));
    Ok(())
}

fn image_of(size: UVec2, texels: Vec<u8>) -> Image {
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    Image::new(extent, TextureDimension::D2, texels, TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::default())
}

fn type_word(mut word: ResMut<Word>, mut keys: MessageReader<KeyboardInput>) {
    for key in keys.read().filter(|key| key.state.is_pressed()) {
        match &key.logical_key {
            Key::Character(letters) if word.0.chars().count() < MOST => word.0.push_str(letters),
            Key::Space if !word.0.is_empty() => word.0.push(' '),
            Key::Backspace => _ = word.0.pop(),
            _ => {}
        }
    }
}

/// Another word: another bake. An empty one: a whole wall.
fn write_word(
    mut commands: Commands,
    word: Res<Word>,
    wall: Single<Entity, With<Wall>>,
    mut caption: Single<&mut Label, With<Caption>>,
) {
    caption.text = if word.0.is_empty() {
        "type a word      click: hit      escape: heal".into()
    } else {
        format!("{}      (click: hit, escape: heal)", word.0)
    };
    if word.0.trim().is_empty() {
        commands.entity(*wall).remove::<GuidedCracks>().heal_cracks();
        return;
    }
    let guided = GuidedCracks::new(CrackGuide::text(&word.0)).with_seed(word.0.len() as u64);
    let from = Vec2::new(0.0, 0.5);
    commands.entity(*wall).insert(GuidedCracks {
        params: VoronoiParams { sites: 260, ..guided.params.clone() },
        appearance: GuidedAppearance::Front { from, seconds: 2.0 },
        ..guided
    });
}

/// The bar grows with the bake, and is gone when it is done.
fn run_bar(wall: Query<Option<&BakeProgress>, With<Wall>>, mut bar: Single<&mut Transform, With<Bar>>) {
    let share = wall.iter().flatten().next().map_or(0.0, |progress| progress.0);
    bar.scale.x = if share < 1.0 { (share * BAR.x).max(0.001) } else { 0.001 };
    bar.translation.x = 0.5 * (bar.scale.x - BAR.x);
}

fn hit_on_click(
    mut commands: Commands,
    buttons: Res<ButtonInput<MouseButton>>,
    cursor: Cursor,
    wall: Single<Entity, With<Wall>>,
) {
    if buttons.just_pressed(MouseButton::Left)
        && let Some(point) = cursor.point()
        && (point - MIDDLE).abs().cmple(SIZE / 2.0).all()
    {
        commands.trigger(CrackHit::world(*wall, point.extend(0.0)));
    }
}

fn heal_on_escape(keys: Res<ButtonInput<KeyCode>>, mut word: ResMut<Word>) {
    if keys.just_pressed(KeyCode::Escape) {
        word.0.clear();
    }
}

/// The scripted run: the word letter by letter, time to appear, then hits.
fn play_script(
    mut commands: Commands,
    script: Script,
    letters: Res<Letters>,
    mut word: ResMut<Word>,
    wall: Single<(Entity, Option<&BakeProgress>), With<Wall>>,
) {
    let (wall, progress) = *wall;
    // Without a window frames are short: a bake is given the time that it has in a game.
    if progress.is_some_and(|progress| progress.0 < 1.0) {
        thread::sleep(Duration::from_millis(20));
    }
    let due = script.due(letters.0.len() as u32, 0.0..0.3);
    if !due.is_empty() {
        word.0 = letters.0[..due.end as usize].iter().collect();
    }
    for i in script.due(HITS, 0.7..0.9) {
        let i = i as f32;
        let uv = Vec2::new((0.2 + 0.618 * i).fract(), (0.3 + 0.755 * i).fract()) * 0.8 + 0.1;
        commands.trigger(CrackHit::uv(wall, uv));
    }
}
