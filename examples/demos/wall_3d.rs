//! A room of brick and concrete, with normal maps and relief parallax; every shot cracks the wall that it meets.
//!
//! Click to shoot; H heals everything. The camera sways, so that the depth of the cracks shows.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! Try `--frames 120 --out film`.

use bevy::{
    camera::Hdr, core_pipeline::tonemapping::Tonemapping, image::ImageLoaderSettings, math::ops,
    picking::mesh_picking::MeshPickingPlugin, prelude::*,
};
use bevy_crack::prelude::*;
use bevy_crack_demos::{DemoArguments, Film, FilmPlugin, Output, demo_app};
use clap::Parser;

/// Half the width of the room, metres.
const HALF: f32 = 2.0;

/// Shots of the scripted run.
const SHOTS: u32 = 12;

#[derive(Parser)]
#[command(about = "A room of brick and concrete to shoot at")]
struct Arguments {
    #[command(flatten)]
    demo: DemoArguments,
}

#[derive(Component)]
struct Wall;

#[derive(Component)]
struct Lamp;

fn main() -> AppExit {
    let (mut app, output) = demo_app("bevy_crack: walls in 3D", &Arguments::parse().demo);
    app.add_plugins((CrackPlugins, FilmPlugin)).add_systems(Startup, setup).add_systems(Update, (sway, move_lamp));
    if output == Output::Window {
        app.add_plugins(MeshPickingPlugin).add_systems(Update, heal_on_h);
    } else {
        app.add_systems(Update, play_script);
    }
    app.run()
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,
    film: Res<Film>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let mut camera = commands.spawn((
        Camera3d::default(),
        Hdr,
        // Needs no lookup table.
        Tonemapping::AcesFitted,
        AmbientLight { brightness: 420.0, ..default() },
        Transform::default(),
    ));
    if let Some(target) = film.camera_target() {
        camera.insert(target);
    }
    let mut material = |name: &str| {
        materials.add(StandardMaterial {
            base_color_texture: Some(assets.load(format!("textures/{name}.png"))),
            normal_map_texture: Some(
                assets
                    .load_builder()
                    .with_settings(|settings: &mut ImageLoaderSettings| settings.is_srgb = false)
                    .load(format!("textures/{name}_normal.png")),
            ),
            perceptual_roughness: 0.9,
            ..default()
        })
    };
    let (brick, concrete) = (material("brick_red"), material("concrete_fine"));
    let wall = meshes.add(Rectangle::new(2.0 * HALF, 2.0 * HALF));
    let right = Quat::from_rotation_y(-std::f32::consts::FRAC_PI_2);
    let floor = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let sides = [
        (Transform::from_xyz(0.0, 0.0, -HALF), concrete.clone(), 1),
        (Transform::from_xyz(-HALF, 0.0, 0.0).with_rotation(right.inverse()), brick.clone(), 2),
        (Transform::from_xyz(HALF, 0.0, 0.0).with_rotation(right), brick, 3),
        (Transform::from_xyz(0.0, -HALF, 0.0).with_rotation(floor), concrete, 4),
    ];
    for (transform, material, seed) in sides {
        commands
            .spawn((
                Wall,
                Mesh3d(wall.clone()),
                MeshMaterial3d(material),
                transform,
                CrackSurface::new(CrackPreset::CONCRETE).with_seed(seed),
            ))
            .observe(|press: On<Pointer<Press>>, mut commands: Commands| {
                if let Some(point) = press.hit.position {
                    commands.trigger(CrackHit::world(press.entity, point).with_energy(1.5));
                }
            });
    }
    commands.spawn((
        Lamp,
        PointLight { intensity: 420_000.0, range: 12.0, shadow_maps_enabled: false, ..default() },
        Transform::default(),
    ));
}

fn sway(time: Res<Time>, mut camera: Query<&mut Transform, With<Camera3d>>) {
    let t = time.elapsed_secs();
    for mut transform in &mut camera {
        let eye = Vec3::new(0.5 * ops::sin(0.4 * t), 0.25 + 0.15 * ops::sin(0.31 * t), 3.6);
        *transform = Transform::from_translation(eye).looking_at(Vec3::new(0.0, -0.2, -1.0), Vec3::Y);
    }
}

fn move_lamp(time: Res<Time>, mut lamp: Query<&mut Transform, With<Lamp>>) {
    let t = time.elapsed_secs();
    for mut transform in &mut lamp {
        transform.translation = Vec3::new(1.3 * ops::cos(0.7 * t), 1.2, 0.3 + 0.9 * ops::sin(0.7 * t));
    }
}

fn heal_on_h(mut commands: Commands, keys: Res<ButtonInput<KeyCode>>, walls: Query<Entity, With<Wall>>) {
    if keys.just_pressed(KeyCode::KeyH) {
        for wall in &walls {
            commands.entity(wall).heal_cracks();
        }
    }
}

/// The scripted run: shots at all sides in turn.
fn play_script(
    mut commands: Commands,
    mut frame: Local<u32>,
    mut fired: Local<u32>,
    arguments: Res<DemoArguments>,
    walls: Query<(Entity, &GlobalTransform), With<Wall>>,
) {
    *frame += 1;
    let share = *frame as f32 / arguments.frames.max(1) as f32;
    while *fired < (share / 0.7 * SHOTS as f32) as u32 && *fired < SHOTS {
        let i = *fired;
        *fired += 1;
        let golden = |k: f32| ((i as f32 * k).fract() - 0.5) * 2.4;
        let Some((wall, at)) = walls.iter().nth(i as usize % 4) else { continue };
        let point = at.transform_point(Vec3::new(golden(0.618), golden(0.755), 0.0));
        commands.trigger(CrackHit::world(wall, point).with_energy([1.0, 2.0, 0.7][i as usize % 3]));
    }
}
