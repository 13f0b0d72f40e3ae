//! A line that you draw becomes an island, while a bar shows how far it is.
//!
//! Draw a closed line with the mouse. Click the island to crack it, H heals. Without a display (or with `--headless`) a line is
//! drawn by itself, and pictures and a GIF are written to `--out`.

use bevy::{math::ops, prelude::*};
use bevy_crack::{prelude::*, relief::ReliefShape};
use bevy_crack_demos::{Cursor, DemoArguments, OnCanvas, Script, caption, demo_app, heal_on_h, play};
use std::f32::consts::TAU;

/// Size of the map in the world.
const SIZE: Vec2 = Vec2::new(960.0, 600.0);
const TEXELS: UVec2 = UVec2::new(1280, 800);

/// Least distance of two points of a drawn line.
const APART: f32 = 6.0;

/// Points of the line of the scripted run.
const POINTS: u32 = 90;

#[derive(Component)]
struct Map;

#[derive(Component)]
struct Bar;

/// A point of the line.
#[derive(Component)]
struct Dot;

/// The line that is being drawn.
#[derive(Resource, Default)]
struct Drawn(Vec<Vec2>);

fn main() -> AppExit {
    let arguments = DemoArguments::given("Draw a coast line, and it becomes an island");
    let mut app = demo_app("bevy_crack: island", &arguments);
    app.insert_resource(ClearColor(Color::srgb(0.06, 0.14, 0.22)))
        .init_resource::<Drawn>()
        .add_systems(Startup, setup)
        .add_systems(Update, show_progress)
        .add_observer(show_made);
    play(app, (draw, heal_on_h), play_script)
}

fn setup(mut commands: Commands) {
    commands.spawn(Camera2d);
    commands.spawn((
        Map,
        Sprite { color: Color::srgb(0.09, 0.26, 0.38), custom_size: Some(SIZE), ..default() },
        CrackSurface::new(CrackPreset::CONCRETE.scaled(0.5)),
    ));
    let bar = Sprite::from_color(Color::srgb(0.9, 0.75, 0.35), Vec2::new(1.0, 6.0));
    commands.spawn((Bar, bar, Transform::from_xyz(0.0, -318.0, 2.0)));
    commands.spawn(caption("draw a coast line      H: heal", Vec2::new(0.0, -338.0)));
}

fn add_point(commands: &mut Commands, drawn: &mut Drawn, point: Vec2) {
    let is_on = point.abs().cmplt(0.47 * SIZE).all();
    if !is_on || drawn.0.last().is_some_and(|last| last.distance(point) < APART) {
        return;
    }
    drawn.0.push(point);
    let dot = Sprite::from_color(Color::srgb(0.95, 0.9, 0.75), Vec2::splat(4.0));
    commands.spawn((Dot, dot, Transform::from_translation(point.extend(1.0))));
}

/// Makes the island of a line.
fn finish(commands: &mut Commands, drawn: &mut Drawn, map: Entity) {
    let line = core::mem::take(&mut drawn.0);
    if line.len() > 8 {
        let uv = |point: Vec2| Vec2::new(point.x, -point.y) / SIZE + 0.5;
        let mut relief = CrackRelief::island().with_size(TEXELS).with_seed(4);
        relief.settings.shape = ReliefShape::Lines(vec![line.into_iter().map(uv).collect()]);
        commands.entity(map).heal_cracks().insert(relief);
    }
}

fn draw(
    mut commands: Commands,
    buttons: Res<ButtonInput<MouseButton>>,
    cursor: Cursor,
    mut drawn: ResMut<Drawn>,
    map: Single<(Entity, Has<CrackRelief>), With<Map>>,
    dots: Query<Entity, With<Dot>>,
) {
    let (map, has_island) = *map;
    let Some(point) = cursor.point() else { return };
    if buttons.just_pressed(MouseButton::Left) {
        dots.iter().for_each(|dot| commands.entity(dot).despawn());
        if has_island {
            commands.trigger(CrackHit::world(map, point.extend(0.0)));
        }
    }
    if buttons.pressed(MouseButton::Left) {
        add_point(&mut commands, &mut drawn, point);
    }
    if buttons.just_released(MouseButton::Left) {
        finish(&mut commands, &mut drawn, map);
    }
}

fn show_progress(progress: Query<&ReliefProgress, With<Map>>, mut bar: Single<&mut Sprite, With<Bar>>) {
    let share = progress.single().map_or(0.0, |progress| progress.0);
    bar.custom_size = Some(Vec2::new((SIZE.x * share).max(1.0), 6.0));
}

/// The line goes when the island is there.
fn show_made(
    made: On<ReliefMade>,
    mut commands: Commands,
    dots: Query<Entity, With<Dot>>,
    mut maps: Query<&mut Sprite>,
) {
    dots.iter().for_each(|dot| commands.entity(dot).despawn());
    if let Ok(mut sprite) = maps.get_mut(made.entity) {
        sprite.color = Color::WHITE;
        commands.entity(made.entity).insert(OnCanvas { picture: sprite.image.clone(), size: SIZE });
    }
}

/// The scripted run: a line, its island, and a hit on it.
fn play_script(mut commands: Commands, script: Script, mut drawn: ResMut<Drawn>, map: Single<Entity, With<Map>>) {
    for i in script.due(POINTS, 0.0..0.3) {
        let angle = TAU * i as f32 / POINTS as f32;
        let out =
            1.0 + 0.22 * ops::sin(3.0 * angle + 0.6) + 0.13 * ops::sin(7.0 * angle) + 0.06 * ops::sin(17.0 * angle);
        let point = Vec2::new(280.0 * ops::cos(angle), 190.0 * ops::sin(angle)) * out;
        add_point(&mut commands, &mut drawn, point);
    }
    if script.is_at(0.32) {
        finish(&mut commands, &mut drawn, *map);
    }
    for i in script.due(3, 0.75..0.95) {
        let at = [Vec2::new(0.45, 0.5), Vec2::new(0.6, 0.42), Vec2::new(0.38, 0.6)][i as usize % 3];
        commands.trigger(CrackHit::uv(*map, at).with_energy(2.0));
    }
}
