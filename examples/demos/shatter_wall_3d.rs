//! A pane of glass to shoot out of its frame: what the frame holds stays, the rest flies, thick and with bright edges.
//!
//! Click to shoot, R turns time around, H heals.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! Without any GPU adapter only the pane itself is shown. Try `--frames 180 --out film`.

use bevy::{camera::Hdr, core_pipeline::tonemapping::Tonemapping, math::ops, prelude::*};
use bevy_crack::{
    prelude::*,
    shatter::{BurstParams, ShatterParams},
};
use bevy_crack_demos::{Cursor, DemoArguments, OnCanvas, Script, demo_app, heal_on_h, play, with_normals};

/// Width and height of the pane, and width of its frame, metres.
const PANE: Vec2 = Vec2::new(2.4, 1.8);
const BEAM: f32 = 0.16;

/// Speed of a bullet, metres a second.
const SPEED: f32 = 14.0;

/// How hard a shot hits.
const ENERGY: f32 = 1.8;

/// How far around a shot glass is knocked out, in heights of the pane.
const REACH: f32 = 0.34;

/// The scripted run: when a shot is fired (share of its length) and where it lands (metres from the middle of the pane), and when
/// time turns around.
const SHOTS: [(f32, Vec2); 6] = [
    (0.03, Vec2::new(-0.42, 0.2)),
    (0.14, Vec2::new(0.45, -0.2)),
    (0.25, Vec2::new(0.1, 0.4)),
    (0.36, Vec2::new(-0.3, -0.35)),
    (0.47, Vec2::new(0.75, 0.3)),
    (0.56, Vec2::new(-0.75, -0.1)),
];
const TURN_AT: f32 = 0.78;

#[derive(Component)]
struct Pane;

/// Flies straight until it meets the pane, or for a while.
#[derive(Component)]
struct Bullet {
    way: Dir3,
    age: f32,
}

#[derive(Resource)]
struct Shapes {
    ball: Handle<Mesh>,
    brass: Handle<StandardMaterial>,
}

fn main() -> AppExit {
    let arguments = DemoArguments::given("A pane of glass to shoot out of its frame");
    let mut app = demo_app("bevy_crack: a pane in 3D", &arguments);
    app.insert_resource(ClearColor(Color::srgb(0.05, 0.06, 0.08)))
        .add_systems(Startup, setup)
        .add_systems(Update, (sway, fly).chain());
    play(app, (shoot, turn_time, heal_on_h).before(sway), play_script.before(sway))
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    commands.spawn((
        Camera3d::default(),
        Hdr,
        // Needs no lookup table.
        Tonemapping::AcesFitted,
        AmbientLight { brightness: 700.0, ..default() },
        Transform::default(),
    ));
    commands.spawn((
        PointLight { intensity: 700_000.0, range: 16.0, shadow_maps_enabled: false, ..default() },
        Transform::from_xyz(-1.6, 2.0, 2.2),
    ));
    // Behind the pane, on the wall.
    commands.spawn((
        PointLight {
            color: Color::srgb(1.0, 0.86, 0.68),
            intensity: 500_000.0,
            range: 9.0,
            shadow_maps_enabled: false,
            ..default()
        },
        Transform::from_xyz(1.4, 1.5, -0.9),
    ));
    let (brick, normals) = with_normals(&assets, "brick_red");
    let wall = materials.add(StandardMaterial {
        base_color_texture: Some(brick),
        normal_map_texture: Some(normals),
        perceptual_roughness: 0.95,
        ..default()
    });
    if let Ok(mesh) = Mesh::from(Rectangle::new(4.0, 4.0)).with_generated_tangents() {
        let mesh = meshes.add(mesh);
        for i in -2..=2 {
            let at = Transform::from_xyz(4.0 * i as f32, 0.9, -2.2);
            commands.spawn((Mesh3d(mesh.clone()), MeshMaterial3d(wall.clone()), at));
        }
    }
    let stone = materials.add(StandardMaterial {
        base_color: Color::srgb(0.3, 0.3, 0.32),
        perceptual_roughness: 0.9,
        ..default()
    });
    let floor = meshes.add(Rectangle::new(12.0, 7.0));
    let flat = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    commands.spawn((Mesh3d(floor), MeshMaterial3d(stone), Transform::from_xyz(0.0, -1.1, 0.5).with_rotation(flat)));

    let wood = materials.add(StandardMaterial {
        base_color: Color::srgb(0.2, 0.12, 0.07),
        perceptual_roughness: 0.7,
        ..default()
    });
    let across = meshes.add(Cuboid::new(PANE.x + 2.0 * BEAM, BEAM, BEAM));
    let upright = meshes.add(Cuboid::new(BEAM, PANE.y, BEAM));
    let out = 0.5 * (PANE + BEAM) - 0.01;
    for (beam, at) in
        [(&across, out * Vec2::Y), (&across, -out * Vec2::Y), (&upright, out * Vec2::X), (&upright, -out * Vec2::X)]
    {
        commands.spawn((
            Mesh3d(beam.clone()),
            MeshMaterial3d(wood.clone()),
            Transform::from_translation(at.extend(0.0)),
        ));
    }

    let picture = assets.load("textures/glass_pane.png");
    let glass = materials.add(StandardMaterial {
        base_color_texture: Some(picture.clone()),
        alpha_mode: AlphaMode::Blend,
        perceptual_roughness: 0.12,
        reflectance: 0.6,
        ..default()
    });
    commands.spawn((
        Pane,
        Mesh3d(meshes.add(Rectangle::from_size(PANE))),
        MeshMaterial3d(glass),
        Transform::default(),
        CrackSurface::new(CrackPreset::GLASS).with_seed(11),
        ShatterCracks {
            // When the cracks of a shot have come to their end.
            when: ShatterWhen::AtDamage(0.0),
            reach: REACH,
            cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
            burst: BurstParams {
                hold: 0.05,
                speed: 1.6,
                along: 0.75,
                gravity: Vec2::new(0.0, -3.6),
                ..BurstParams::DEFAULT
            },
            thickness: 0.024,
            ..default()
        },
        OnCanvas { picture, size: 300.0 * PANE },
    ));
    commands.insert_resource(Shapes {
        ball: meshes.add(Sphere::new(0.03)),
        brass: materials.add(StandardMaterial {
            base_color: Color::srgb(0.8, 0.6, 0.25),
            metallic: 0.6,
            perceptual_roughness: 0.4,
            ..default()
        }),
    });
}

fn sway(time: Res<Time>, mut camera: Query<&mut Transform, With<Camera3d>>) {
    let t = time.elapsed_secs();
    for mut transform in &mut camera {
        let eye = Vec3::new(0.9 * ops::sin(0.3 * t + 0.6), 0.25 + 0.12 * ops::sin(0.41 * t), 3.1);
        *transform = Transform::from_translation(eye).looking_at(Vec3::new(0.0, -0.08, 0.0), Vec3::Y);
    }
}

fn fire(commands: &mut Commands, shapes: &Shapes, from: Vec3, way: Dir3) {
    commands.spawn((
        Bullet { way, age: 0.0 },
        Mesh3d(shapes.ball.clone()),
        MeshMaterial3d(shapes.brass.clone()),
        Transform::from_translation(from),
    ));
}

/// Bullets fly; one that passes through the pane hits it, and flies on.
fn fly(
    mut commands: Commands,
    time: Res<Time>,
    mut bullets: Query<(Entity, &mut Bullet, &mut Transform)>,
    pane: Single<Entity, With<Pane>>,
) {
    for (entity, mut bullet, mut transform) in &mut bullets {
        let before = transform.translation;
        let after = before + bullet.way * (SPEED * time.delta_secs());
        transform.translation = after;
        bullet.age += time.delta_secs();
        if before.z > 0.0 && after.z <= 0.0 {
            let at = before.lerp(after, before.z / (before.z - after.z));
            if (at.truncate().abs() * 2.0).cmplt(PANE).all() {
                let hit = CrackHit::world(*pane, at).with_energy(ENERGY).with_direction(*bullet.way);
                commands.trigger(hit);
            }
        }
        if bullet.age > 1.0 || after.z < -2.2 {
            commands.entity(entity).despawn();
        }
    }
}

fn shoot(mut commands: Commands, buttons: Res<ButtonInput<MouseButton>>, cursor: Cursor, shapes: Res<Shapes>) {
    if buttons.just_pressed(MouseButton::Left)
        && let Some(ray) = cursor.ray()
    {
        fire(&mut commands, &shapes, ray.origin + 0.3 * *ray.direction, ray.direction);
    }
}

fn turn_time(keys: Res<ButtonInput<KeyCode>>, mut pane: Single<&mut ShatterCracks, With<Pane>>) {
    if keys.just_pressed(KeyCode::KeyR) {
        pane.speed = -pane.speed;
    }
}

/// The scripted run: a few shots, and back again.
fn play_script(
    mut commands: Commands,
    script: Script,
    camera: Single<&Transform, With<Camera3d>>,
    mut pane: Single<&mut ShatterCracks, With<Pane>>,
    shapes: Res<Shapes>,
) {
    for (_, target) in SHOTS.into_iter().filter(|(share, _)| script.is_at(*share)) {
        let from = camera.translation - 0.2 * Vec3::Y;
        if let Ok(way) = Dir3::new(target.extend(0.0) - from) {
            fire(&mut commands, &shapes, from, way);
        }
    }
    if script.is_at(TURN_AT) {
        pane.speed = -1.5;
    }
}
