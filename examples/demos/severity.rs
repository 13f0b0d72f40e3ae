//! One wall after one hit, three, six, and after the one that brings it down: all in a row, in one light.
//!
//! Click a wall to hit it, Space brings all of them down, R turns time around, H heals.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! The picture of the README is the last one of `--frames 240 --height 400 --out film`.

use bevy::{
    camera::{Hdr, ScalingMode},
    core_pipeline::tonemapping::Tonemapping,
    light::CascadeShadowConfigBuilder,
    prelude::*,
};
use bevy_crack::{
    prelude::*,
    shatter::{BurstParams, ShatterParams},
};
use bevy_crack_demos::{DemoArguments, OnCanvas, Script, demo_app, heal_on_h, hit_on_press, play, with_normals};

/// Side of a wall, metres, and from the middle of one to the next.
const SIDE: f32 = 2.0;
const PITCH: f32 = 2.14;

/// Hits on each wall.
const HITS: [usize; 4] = [1, 3, 6, 6];

/// Where they land, texture coordinates, and how hard they are.
const PLACES: [(Vec2, f32); 6] = [
    (Vec2::new(0.45, 0.42), 1.4),
    (Vec2::new(0.72, 0.66), 1.0),
    (Vec2::new(0.25, 0.74), 1.4),
    (Vec2::new(0.74, 0.24), 1.8),
    (Vec2::new(0.2, 0.3), 1.0),
    (Vec2::new(0.5, 0.84), 2.2),
];

/// When the last hits land, and when the last wall comes down, as shares of the run.
const HIT_UNTIL: f32 = 0.4;
const DOWN_AT: f32 = 0.62;

#[derive(Component)]
struct Wall(usize);

fn main() -> AppExit {
    let arguments = DemoArguments::given("One wall after one hit, three, six, and after the one that brings it down");
    let mut app = demo_app("bevy_crack: severity", &arguments);
    app.insert_resource(ClearColor(Color::srgb(0.42, 0.45, 0.5))).add_systems(Startup, setup);
    play(app, (play_by_hand, heal_on_h), play_script)
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let view = OrthographicProjection {
        scaling_mode: ScalingMode::FixedHorizontal { viewport_width: 4.0 * PITCH + 0.1 },
        ..OrthographicProjection::default_3d()
    };
    commands.spawn((
        Camera3d::default(),
        Projection::Orthographic(view),
        Hdr,
        // Needs no lookup table.
        Tonemapping::AcesFitted,
        AmbientLight { brightness: 700.0, color: Color::srgb(0.85, 0.91, 1.0), ..default() },
        Transform::from_xyz(0.0, 2.6, 9.0).looking_at(Vec3::new(0.0, 0.92, 0.0), Vec3::Y),
    ));
    // It rakes over the walls.
    commands.spawn((
        DirectionalLight {
            illuminance: 11_000.0,
            color: Color::srgb(1.0, 0.94, 0.84),
            shadow_maps_enabled: true,
            ..default()
        },
        CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 16.0, ..default() }.build(),
        Transform::from_xyz(-3.4, 4.6, 4.6).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    let plain =
        |color| StandardMaterial { base_color: color, perceptual_roughness: 0.95, reflectance: 0.2, ..default() };
    let ground = materials.add(plain(Color::srgb(0.43, 0.41, 0.38)));
    let back = materials.add(plain(Color::srgb(0.5, 0.53, 0.58)));
    let flat = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let field = meshes.add(Rectangle::new(24.0, 16.0));
    commands.spawn((
        Mesh3d(field.clone()),
        MeshMaterial3d(ground),
        Transform::from_xyz(0.0, 0.0, 2.0).with_rotation(flat),
    ));
    commands.spawn((Mesh3d(field), MeshMaterial3d(back), Transform::from_xyz(0.0, 2.0, -2.4)));
    let (picture, normals) = with_normals(&assets, "concrete_fine");
    let concrete = materials.add(StandardMaterial {
        base_color_texture: Some(picture.clone()),
        normal_map_texture: Some(normals),
        perceptual_roughness: 0.92,
        reflectance: 0.25,
        ..default()
    });
    let slab = meshes.add(Rectangle::new(SIDE, SIDE));
    for i in 0..HITS.len() {
        commands
            .spawn((
                Wall(i),
                Mesh3d(slab.clone()),
                MeshMaterial3d(concrete.clone()),
                Transform::from_xyz((i as f32 - 1.5) * PITCH, 0.5 * SIDE + 0.02, 0.0),
                CrackSurface::new(CrackPreset::CONCRETE.scaled(0.8))
                    .with_seed(6)
                    .with_resolution(CrackResolution::Fixed(UVec2::splat(768))),
                ShatterCracks {
                    cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
                    floor: Some(0.0),
                    burst: BurstParams {
                        hold: 0.0,
                        front: 2.5,
                        speed: 1.1,
                        along: 0.75,
                        scatter: 1.0,
                        spin: 2.2,
                        gravity: Vec2::new(0.0, -4.9),
                        fade_after: 600.0,
                        ..BurstParams::DEFAULT
                    },
                    thickness: 0.05,
                    ..default()
                },
                OnCanvas { picture: picture.clone(), size: Vec2::splat(290.0) },
            ))
            .observe(hit_on_press);
    }
}

fn play_by_hand(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    mut walls: Query<(Entity, &mut ShatterCracks), With<Wall>>,
) {
    for (wall, mut settings) in &mut walls {
        if keys.just_pressed(KeyCode::Space) {
            settings.speed = 1.0;
            commands.entity(wall).shatter_cracks(ShatterRequest::EVERYTHING);
        }
        if keys.just_pressed(KeyCode::KeyR) {
            settings.speed = -settings.speed;
        }
    }
}

/// The scripted run: each wall gets its hits, and the last one comes down.
fn play_script(mut commands: Commands, script: Script, walls: Query<(Entity, &Wall)>) {
    for (wall, Wall(number)) in walls.iter().sort::<Entity>() {
        for i in script.due(PLACES.len() as u32, 0.0..HIT_UNTIL).map(|i| i as usize).filter(|i| *i < HITS[*number]) {
            let (at, energy) = PLACES[i];
            let hit = CrackHit::uv(wall, at).with_energy(energy).with_direction(Vec3::Z);
            commands.trigger(hit);
        }
        if *number + 1 == HITS.len() && script.is_at(DOWN_AT) {
            commands.entity(wall).shatter_cracks(ShatterRequest::EVERYTHING.with_energy(1.5));
        }
    }
}
