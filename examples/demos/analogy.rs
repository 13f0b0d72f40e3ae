//! A wall that cracks as the photograph does that you choose.
//!
//! 1, 2 and 3, or a click on a photograph, choose one: the wall is made in its material by a background task. Click the wall to
//! crack it, H heals. Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.

use bevy::prelude::*;
use bevy_crack::prelude::*;
use bevy_crack_demos::{Cursor, DemoArguments, OnCanvas, Script, caption, demo_app, heal_on_h, play};

/// Size of the wall in the world, and in texels.
const SIZE: Vec2 = Vec2::new(800.0, 600.0);
const TEXELS: UVec2 = UVec2::new(800, 600);

/// Middle of the wall.
const WALL: Vec2 = Vec2::new(110.0, 20.0);

/// Side of a photograph beside it, and how far apart they are.
const PHOTO: f32 = 190.0;
const STEP: f32 = 205.0;

/// The photographs, each with a preset beside it that cracks as it does.
const NAMES: [&str; 3] = ["concrete", "clay", "paving"];

#[derive(Component)]
struct Wall;

#[derive(Component)]
struct Bar;

/// A photograph beside the wall.
#[derive(Component)]
struct Photo(usize);

fn main() -> AppExit {
    let arguments = DemoArguments::given("A wall that cracks as the photograph does that you choose");
    let mut app = demo_app("bevy_crack: image analogies", &arguments);
    app.insert_resource(ClearColor(Color::srgb(0.12, 0.13, 0.15)))
        .add_systems(Startup, setup)
        .add_systems(Update, show_progress);
    play(app, (choose_and_hit, heal_on_h), play_script)
}

fn setup(mut commands: Commands, assets: Res<AssetServer>, mut images: ResMut<Assets<Image>>) {
    commands.spawn(Camera2d);
    for (number, name) in NAMES.into_iter().enumerate() {
        let photo = assets.load(format!("analogies/{name}.png"));
        let sprite = Sprite { custom_size: Some(Vec2::splat(PHOTO)), ..Sprite::from_image(photo.clone()) };
        let at = Vec3::new(-415.0, 20.0 + STEP * (1.0 - number as f32), 0.0);
        let on_canvas = OnCanvas { picture: photo, size: Vec2::splat(PHOTO) };
        commands.spawn((Photo(number), sprite, on_canvas, Transform::from_translation(at)));
    }
    // The wall has nothing to keep of its own.
    let blank = images.add(blank());
    let sprite = Sprite { custom_size: Some(SIZE), ..Sprite::from_image(blank.clone()) };
    let on_canvas = OnCanvas { picture: blank, size: SIZE };
    let wall = (Wall, sprite, on_canvas, Transform::from_translation(WALL.extend(0.0)), made_as(0, &assets));
    commands.spawn(wall);
    let bar = Sprite::from_color(Color::srgb(0.9, 0.75, 0.35), Vec2::new(1.0, 6.0));
    commands.spawn((Bar, bar, Transform::from_xyz(WALL.x, -290.0, 2.0)));
    commands.spawn(caption("1, 2, 3: photograph      click: hit      H: heal", Vec2::new(WALL.x, -325.0)));
}

/// A grey picture.
fn blank() -> Image {
    use bevy::{
        asset::RenderAssetUsages,
        render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    };
    let extent = Extent3d { width: TEXELS.x, height: TEXELS.y, depth_or_array_layers: 1 };
    let (format, usage) = (TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::default());
    Image::new_fill(extent, TextureDimension::D2, &[120, 118, 115, 255], format, usage)
}

/// What makes a surface crack as a photograph.
fn made_as(number: usize, assets: &AssetServer) -> (CrackSurface, CrackAnalogy) {
    let name = NAMES[number % NAMES.len()];
    let examples = assets.load(format!("analogies/{name}.{}", AnalogyExamples::EXTENSION));
    let preset: Handle<CrackPreset> = assets.load(format!("analogies/{name}.crack.ron"));
    (CrackSurface::new(preset).with_seed(3), CrackAnalogy::new(examples).with_their_material())
}

fn choose(commands: &mut Commands, wall: Entity, number: usize, assets: &AssetServer) {
    commands.entity(wall).heal_cracks().insert(made_as(number, assets));
}

fn choose_and_hit(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    buttons: Res<ButtonInput<MouseButton>>,
    cursor: Cursor,
    assets: Res<AssetServer>,
    wall: Single<Entity, With<Wall>>,
    photos: Query<(&Photo, &Transform)>,
) {
    let number = [KeyCode::Digit1, KeyCode::Digit2, KeyCode::Digit3].iter().position(|key| keys.just_pressed(*key));
    let point = cursor.point().filter(|_| buttons.just_pressed(MouseButton::Left));
    let clicked = point.and_then(|point| {
        let is_on = |at: &Transform| (point - at.translation.truncate()).abs().max_element() < 0.5 * PHOTO;
        photos.iter().find(|(_, at)| is_on(at)).map(|(photo, _)| photo.0)
    });
    if let Some(number) = number.or(clicked) {
        choose(&mut commands, *wall, number, &assets);
    } else if let Some(point) = point {
        commands.trigger(CrackHit::world(*wall, point.extend(0.0)));
    }
}

fn show_progress(progress: Query<&AnalogyProgress, With<Wall>>, mut bar: Single<&mut Sprite, With<Bar>>) {
    let share = progress.single().map_or(0.0, |progress| progress.0);
    bar.custom_size = Some(Vec2::new((SIZE.x * share).max(1.0), 6.0));
}

/// The scripted run: three hits in the material of each photograph.
fn play_script(mut commands: Commands, script: Script, assets: Res<AssetServer>, wall: Single<Entity, With<Wall>>) {
    const PART: f32 = 1.0 / NAMES.len() as f32;
    for number in 0..NAMES.len() {
        let start = PART * number as f32;
        if number > 0 && script.is_at(start) {
            choose(&mut commands, *wall, number, &assets);
        }
        for i in script.due(3, start + 0.3 * PART..start + 0.7 * PART) {
            let at = [Vec2::new(0.36, 0.45), Vec2::new(0.7, 0.6), Vec2::new(0.55, 0.2)][i as usize % 3];
            commands.trigger(CrackHit::uv(*wall, at).with_energy(2.0));
        }
    }
}
