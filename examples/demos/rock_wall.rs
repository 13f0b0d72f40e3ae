//! A face of rock, made from contour lines while the game runs, and shot at.
//!
//! Click to shoot, N for another wall, H heals. Without a display (or with `--headless`) a script plays, and pictures and a GIF are
//! written to `--out`.

use bevy::{camera::Hdr, core_pipeline::tonemapping::Tonemapping, math::ops, prelude::*};
use bevy_crack::prelude::*;
use bevy_crack_demos::{DemoArguments, Script, demo_app, heal_on_h, hit_on_press, play};

/// Size of the wall, metres.
const SIZE: Vec2 = Vec2::new(6.0, 4.0);

/// Shots of the scripted run.
const SHOTS: u32 = 9;

#[derive(Component)]
struct Wall;

#[derive(Component)]
struct Lamp;

fn main() -> AppExit {
    let about = "A face of rock, made from contour lines, and shot at";
    let mut app = demo_app("bevy_crack: rock wall", &DemoArguments::given(about));
    app.insert_resource(ClearColor(Color::srgb(0.05, 0.06, 0.08)))
        .add_systems(Startup, setup)
        .add_systems(Update, (sway, move_lamp));
    play(app, (heal_on_h, make_anew), play_script)
}

fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    commands.spawn((
        Camera3d::default(),
        Hdr,
        // Needs no lookup table.
        Tonemapping::AcesFitted,
        AmbientLight { brightness: 700.0, color: Color::srgb(0.72, 0.84, 1.0), ..default() },
        Transform::default(),
    ));
    commands
        .spawn((
            Wall,
            Mesh3d(meshes.add(Rectangle::from_size(SIZE))),
            MeshMaterial3d(materials.add(StandardMaterial {
                base_color: Color::WHITE,
                perceptual_roughness: 0.95,
                ..default()
            })),
            rock(1),
            CrackSurface::new(CrackPreset::CONCRETE.scaled(0.6)).with_seed(1),
        ))
        .observe(hit_on_press);
    commands.spawn((
        Lamp,
        DirectionalLight { color: Color::srgb(1.0, 0.93, 0.82), illuminance: 6000.0, ..default() },
        Transform::default(),
    ));
}

fn rock(seed: u64) -> CrackRelief {
    CrackRelief {
        detail: 3,
        ..CrackRelief::rock_wall().with_size(UVec2::new(1536, 1024)).with_seed(seed).with_displacement(1.0)
    }
}

/// N: another wall.
fn make_anew(mut relief: Single<&mut CrackRelief, With<Wall>>, keys: Res<ButtonInput<KeyCode>>) {
    if keys.just_pressed(KeyCode::KeyN) {
        relief.seed += 1;
    }
}

fn sway(time: Res<Time>, mut camera: Single<&mut Transform, With<Camera3d>>) {
    let t = time.elapsed_secs();
    let eye = Vec3::new(0.5 * ops::sin(0.35 * t), 0.2 * ops::sin(0.27 * t), 3.7);
    **camera = Transform::from_translation(eye).looking_at(Vec3::ZERO, Vec3::Y);
}

/// The sun goes over the wall, low enough to show its relief.
fn move_lamp(time: Res<Time>, mut lamp: Single<&mut Transform, With<Lamp>>) {
    let angle = 0.7 + 0.5 * ops::sin(0.3 * time.elapsed_secs());
    let from = Vec3::new(-3.0 * ops::cos(angle), 3.0 * ops::sin(angle) + 0.6, 2.8);
    **lamp = Transform::from_translation(from).looking_at(Vec3::ZERO, Vec3::Y);
}

/// The scripted run: shots, once the wall is there.
fn play_script(
    mut commands: Commands,
    script: Script,
    wall: Single<(Entity, &GlobalTransform, &ReliefProgress), With<Wall>>,
) {
    let (entity, at, progress) = *wall;
    for i in script.due(SHOTS, 0.3..0.85) {
        if progress.0 < 1.0 {
            continue;
        }
        let golden = |k: f32| ((i as f32 + 1.0) * k).fract() - 0.5;
        let place = Vec3::new(0.8 * SIZE.x * golden(0.618), 0.75 * SIZE.y * golden(0.755), 0.1);
        commands
            .trigger(CrackHit::world(entity, at.transform_point(place)).with_energy([3.0, 1.5, 5.0][i as usize % 3]));
    }
}
