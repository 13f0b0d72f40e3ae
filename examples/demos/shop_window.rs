//! A shop window in the sun: a shot, half a second of cracks, a burst in slow motion whose shards come to rest on the pavement, and time runs back.
//!
//! Click to shoot, Space to burst, hold S for slow motion, R turns time around, H heals.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! The film of the README: `--frames 210 --pictures 105 --width 960 --out film`.

use bevy::{
    camera::Hdr,
    core_pipeline::tonemapping::Tonemapping,
    light::{CascadeShadowConfigBuilder, NotShadowCaster},
    math::Affine2,
    prelude::*,
};
use bevy_crack::{
    prelude::*,
    shatter::{Anchor, BurstParams, ShatterParams},
};
use bevy_crack_demos::{Cursor, DemoArguments, OnCanvas, Script, demo_app, heal_on_h, play, repeated};

/// Width and height of the pane, metres, and the height of its middle above the pavement.
const PANE: Vec2 = Vec2::new(2.5, 1.7);
const HEIGHT: f32 = 1.45;

/// Width of the frame around it.
const BEAM: f32 = 0.11;

/// Speed of a bullet, metres a second.
const SPEED: f32 = 16.0;

/// How fast time runs in slow motion, and backwards.
const SLOW: f32 = 0.16;
const BACKWARDS: f32 = -2.6;

/// The scripted run, as shares of its length: a shot, where it lands (metres from the middle of the pane), the burst, slow motion, its end, and back.
const SHOT_AT: f32 = 0.06;
const TARGET: Vec2 = Vec2::new(0.28, 0.12);
const BURST_AT: f32 = 0.21;
const FAST_AT: f32 = 0.5;
const BACK_AT: f32 = 0.76;

#[derive(Component)]
struct Pane;

#[derive(Component)]
struct Bullet(Vec3);

#[derive(Resource)]
struct Shapes {
    ball: Handle<Mesh>,
    brass: Handle<StandardMaterial>,
}

fn main() -> AppExit {
    let arguments = DemoArguments::given("A shop window that bursts in slow motion, and becomes whole again");
    let mut app = demo_app("bevy_crack: a shop window", &arguments);
    app.insert_resource(ClearColor(Color::srgb(0.72, 0.82, 0.92)))
        .add_systems(Startup, (set_up_street, set_up_window, set_up_goods))
        .add_systems(Update, fly)
        .add_observer(mend);
    play(app, (play_by_hand, heal_on_h).before(fly), play_script.before(fly))
}

/// The light, the camera, the pavement and the front of the house.
fn set_up_street(
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
        AmbientLight { brightness: 900.0, color: Color::srgb(0.86, 0.92, 1.0), ..default() },
        Transform::from_xyz(-0.8, 1.6, 4.0).looking_at(Vec3::new(0.04, 1.12, 0.0), Vec3::Y),
    ));
    commands.spawn((
        DirectionalLight {
            illuminance: 9_500.0,
            color: Color::srgb(1.0, 0.95, 0.86),
            shadow_maps_enabled: true,
            ..default()
        },
        CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 9.0, ..default() }.build(),
        Transform::from_xyz(-2.6, 4.2, 3.6).looking_at(Vec3::new(0.0, 0.6, 0.0), Vec3::Y),
    ));
    let mut rough = |name: &str, tiles: Vec2, color: Color| {
        materials.add(StandardMaterial {
            base_color: color,
            base_color_texture: Some(repeated(&assets, name)),
            perceptual_roughness: 0.95,
            reflectance: 0.2,
            uv_transform: Affine2::from_scale(tiles),
            ..default()
        })
    };
    let paving = rough("paving", Vec2::new(6.0, 3.0), Color::srgb(0.98, 1.0, 1.04));
    let mut bricks = |size: Vec2| rough("brick_red", size / 1.6, Color::srgb(1.15, 1.1, 1.06));
    let flat = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let ground = meshes.add(Rectangle::new(12.0, 6.0));
    commands.spawn((Mesh3d(ground), MeshMaterial3d(paving), Transform::from_xyz(0.0, 0.0, 2.0).with_rotation(flat)));
    // The wall to the left and right of the window, above and below it.
    let out = 0.5 * PANE + BEAM;
    let wall = meshes.add(Cuboid::new(3.0, 3.6, 0.3));
    let side = bricks(Vec2::new(3.0, 3.6));
    for x in [-1.0, 1.0] {
        let at = Transform::from_xyz(x * (out.x + 1.5), 1.8, -0.15);
        commands.spawn((Mesh3d(wall.clone()), MeshMaterial3d(side.clone()), at));
    }
    let (bottom, top) = (HEIGHT - out.y, HEIGHT + out.y);
    for (height, y) in [(bottom, 0.5 * bottom), (1.4, top + 0.7)] {
        let size = Vec2::new(2.0 * out.x, height);
        let part = meshes.add(Cuboid::from_size(size.extend(0.3)));
        commands.spawn((Mesh3d(part), MeshMaterial3d(bricks(size)), Transform::from_xyz(0.0, y, -0.15)));
    }
}

/// The frame, the awning over it, and the pane.
fn set_up_window(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let paint = materials.add(StandardMaterial {
        base_color: Color::srgb(0.07, 0.24, 0.19),
        perceptual_roughness: 0.45,
        ..default()
    });
    let mut beam = |size: Vec3, at: Vec3| {
        commands.spawn((
            Mesh3d(meshes.add(Cuboid::from_size(size))),
            MeshMaterial3d(paint.clone()),
            Transform::from_translation(at),
        ));
    };
    let out = 0.5 * (PANE + BEAM);
    for x in [-1.0, 1.0] {
        beam(Vec3::new(BEAM, PANE.y, 0.16), Vec3::new(x * out.x, HEIGHT, 0.0));
    }
    beam(Vec3::new(PANE.x + 2.0 * BEAM, BEAM, 0.16), Vec3::new(0.0, HEIGHT + out.y, 0.0));
    beam(Vec3::new(PANE.x + 2.0 * BEAM + 0.1, BEAM, 0.26), Vec3::new(0.0, HEIGHT - out.y, 0.04));
    // A striped awning.
    let stripe = meshes.add(Cuboid::new(0.22, 0.02, 0.8));
    let cloth = [Color::srgb(0.86, 0.2, 0.16), Color::srgb(0.95, 0.93, 0.88)]
        .map(|color| materials.add(StandardMaterial { base_color: color, perceptual_roughness: 0.95, ..default() }));
    for i in -7..=7 {
        commands.spawn((
            Mesh3d(stripe.clone()),
            MeshMaterial3d(cloth[(i + 8) as usize % 2].clone()),
            Transform::from_xyz(0.22 * i as f32, HEIGHT + out.y + 0.13, 0.38)
                .with_rotation(Quat::from_rotation_x(0.42)),
        ));
    }
    let picture = assets.load("textures/glass_pane.png");
    let glass = materials.add(StandardMaterial {
        base_color_texture: Some(picture.clone()),
        alpha_mode: AlphaMode::Blend,
        perceptual_roughness: 0.08,
        reflectance: 0.7,
        ..default()
    });
    commands.spawn((
        Pane,
        Mesh3d(meshes.add(Rectangle::from_size(PANE))),
        MeshMaterial3d(glass),
        NotShadowCaster,
        Transform::from_xyz(0.0, HEIGHT, 0.0),
        CrackSurface::new(CrackPreset::GLASS).with_seed(4),
        ShatterCracks {
            cut: ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT },
            anchor: Anchor::Nothing,
            floor: Some(0.0),
            burst: BurstParams {
                hold: 0.0,
                front: 14.0,
                speed: 1.15,
                along: 0.42,
                spin: 3.0,
                gravity: Vec2::new(0.0, -4.6),
                drag: 0.25,
                fade_after: 60.0,
                ..BurstParams::DEFAULT
            },
            thickness: 0.008,
            ..default()
        },
        OnCanvas { picture, size: 250.0 * PANE },
    ));
    commands.insert_resource(Shapes {
        ball: meshes.add(Sphere::new(0.028)),
        brass: materials.add(StandardMaterial {
            base_color: Color::srgb(0.85, 0.62, 0.2),
            metallic: 0.7,
            perceptual_roughness: 0.35,
            ..default()
        }),
    });
}

/// What is shown in the window: pots and toys on boxes, in warm light.
fn set_up_goods(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let mut color = |r: f32, g: f32, b: f32, roughness: f32| {
        materials.add(StandardMaterial {
            base_color: Color::srgb(r, g, b),
            perceptual_roughness: roughness,
            ..default()
        })
    };
    let (cream, wood) = (color(0.94, 0.86, 0.7, 0.95), color(0.55, 0.36, 0.2, 0.8));
    let red = color(0.8, 0.16, 0.14, 0.3);
    let blue = color(0.12, 0.34, 0.72, 0.3);
    let (gold, green, white) = (color(0.93, 0.68, 0.2, 0.35), color(0.2, 0.55, 0.33, 0.4), color(0.93, 0.92, 0.9, 0.4));
    let mut put = |mesh: Mesh, material: &Handle<StandardMaterial>, at: [f32; 3]| {
        commands.spawn((
            Mesh3d(meshes.add(mesh)),
            MeshMaterial3d(material.clone()),
            Transform::from_translation(at.into()),
        ));
    };
    let sill = HEIGHT - 0.5 * PANE.y - 0.05;
    put(Cuboid::new(3.2, 2.6, 0.1).into(), &cream, [0.0, 1.5, -1.5]);
    put(Cuboid::new(3.2, 0.06, 1.4).into(), &wood, [0.0, sill, -0.8]);
    put(Cuboid::new(3.2, 0.1, 1.4).into(), &cream, [0.0, 2.6, -0.8]);
    put(Cuboid::new(0.1, 2.6, 1.4).into(), &cream, [-1.55, 1.5, -0.8]);
    put(Cuboid::new(0.1, 2.6, 1.4).into(), &cream, [1.55, 1.5, -0.8]);
    put(Cuboid::new(0.5, 0.3, 0.4).into(), &white, [-0.85, sill + 0.18, -0.75]);
    put(Sphere::new(0.2).into(), &red, [-0.85, sill + 0.53, -0.75]);
    put(Cuboid::new(0.42, 0.5, 0.4).into(), &white, [-0.1, sill + 0.28, -0.95]);
    put(
        Torus::new(0.1, 0.22).mesh().build().rotated_by(Quat::from_rotation_x(1.25)),
        &gold,
        [-0.1, sill + 0.75, -0.92],
    );
    put(Cylinder::new(0.13, 0.5).into(), &blue, [0.5, sill + 0.28, -0.6]);
    put(Sphere::new(0.16).into(), &blue, [0.5, sill + 0.56, -0.6]);
    put(Cone::new(0.24, 0.62).into(), &green, [1.0, sill + 0.34, -0.85]);
    put(Sphere::new(0.09).into(), &gold, [1.0, sill + 0.7, -0.85]);
    put(
        Cuboid::new(0.2, 0.2, 0.2).mesh().build().rotated_by(Quat::from_rotation_y(0.5)),
        &gold,
        [-0.42, sill + 0.13, -0.5],
    );
    put(Sphere::new(0.1).into(), &green, [0.15, sill + 0.13, -0.45]);
    commands.spawn((
        PointLight {
            color: Color::srgb(1.0, 0.86, 0.64),
            intensity: 130_000.0,
            range: 5.0,
            shadow_maps_enabled: false,
            ..default()
        },
        Transform::from_xyz(0.1, 2.25, -0.55),
    ));
}

fn fire(commands: &mut Commands, shapes: &Shapes, from: Vec3, at: Vec3) {
    commands.spawn((
        Bullet((at - from).normalize_or(Vec3::NEG_Z) * SPEED),
        Mesh3d(shapes.ball.clone()),
        MeshMaterial3d(shapes.brass.clone()),
        NotShadowCaster,
        Transform::from_translation(from),
    ));
}

/// Bullets fly; one that passes through the pane hits it, and is gone behind it.
fn fly(
    mut commands: Commands,
    time: Res<Time>,
    mut bullets: Query<(Entity, &Bullet, &mut Transform)>,
    pane: Single<Entity, With<Pane>>,
) {
    for (entity, bullet, mut transform) in &mut bullets {
        let before = transform.translation;
        let after = before + bullet.0 * time.delta_secs();
        transform.translation = after;
        if before.z > 0.0 && after.z <= 0.0 {
            let at = before.lerp(after, before.z / (before.z - after.z));
            let hit = CrackHit::world(*pane, at).with_energy(2.2).with_direction(bullet.0);
            commands.trigger(hit);
        }
        if after.z < -0.4 {
            commands.entity(entity).despawn();
        }
    }
}

/// Whole again: now the cracks close as well.
fn mend(whole: On<Reassembled>, mut commands: Commands, mut panes: Query<&mut ShatterCracks>) {
    commands.entity(whole.entity).close_cracks(0.7);
    if let Ok(mut pane) = panes.get_mut(whole.entity) {
        pane.speed = 1.0;
    }
}

fn play_by_hand(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    buttons: Res<ButtonInput<MouseButton>>,
    cursor: Cursor,
    pane: Single<(Entity, &mut ShatterCracks), With<Pane>>,
    shapes: Res<Shapes>,
) {
    let (entity, mut shatter) = pane.into_inner();
    if buttons.just_pressed(MouseButton::Left)
        && let Some(ray) = cursor.ray()
    {
        fire(&mut commands, &shapes, ray.origin + 0.3 * *ray.direction, ray.get_point(10.0));
    }
    if keys.just_pressed(KeyCode::Space) {
        shatter.speed = 1.0;
        commands.entity(entity).shatter_cracks(ShatterRequest::ALL);
    }
    if keys.just_pressed(KeyCode::KeyS) {
        shatter.speed *= SLOW;
    }
    if keys.just_released(KeyCode::KeyS) {
        shatter.speed = shatter.speed.signum();
    }
    if keys.just_pressed(KeyCode::KeyR) {
        shatter.speed = -shatter.speed;
    }
}

fn play_script(
    mut commands: Commands,
    script: Script,
    pane: Single<(Entity, &mut ShatterCracks), With<Pane>>,
    shapes: Res<Shapes>,
) {
    let (entity, mut shatter) = pane.into_inner();
    if script.is_at(SHOT_AT) {
        let target = (TARGET + HEIGHT * Vec2::Y).extend(0.0);
        fire(&mut commands, &shapes, target + Vec3::new(-1.9, 0.5, 4.0), target);
    }
    if script.is_at(BURST_AT) {
        shatter.speed = SLOW;
        // Out on the street, where it is seen.
        let direction = Some(Vec3::new(-0.25, 0.1, 1.0));
        commands.entity(entity).shatter_cracks(ShatterRequest { direction, ..ShatterRequest::ALL });
    }
    if script.is_at(FAST_AT) {
        shatter.speed = 1.0;
    }
    if script.is_at(BACK_AT) {
        shatter.speed = BACKWARDS;
    }
}
