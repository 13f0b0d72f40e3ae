//! A turret shoots at a brick wall, a concrete slab and a pane of glass; every hit cracks what it hits.
//!
//! Aim with the mouse, click to fire, hold longer for a harder shot; H heals everything. A lamp wanders in front of the walls,
//! so that the normals of the cracks show.
//!
//! Without a display (or with `--headless`) a script plays a minute, and pictures and a GIF are written to `--out`.
//! Without any GPU adapter the same happens on the CPU. Try `--frames 300 --out film`.

use bevy::{math::ops, prelude::*};
use bevy_crack::prelude::*;
use bevy_crack_demos::{Cursor, DemoArguments, OnCanvas, Script, caption, demo_app, heal_on_h, play, with_normals};

/// Side of an exhibit in the world.
const SIDE: f32 = 380.0;

/// Where shots come from.
const MUZZLE: Vec2 = Vec2::new(0.0, -290.0);

/// Seconds from the muzzle to the wall.
const FLIGHT: f32 = 0.35;

/// Shots of the scripted run, and when everything is healed in it, as shares of its length.
const SHOTS: u32 = 26;
const HEAL_AT: f32 = 0.72;

/// Something to shoot at.
#[derive(Component)]
struct Exhibit;

#[derive(Component)]
struct Barrel;

#[derive(Component)]
struct Lamp;

#[derive(Component)]
struct Projectile {
    target: Vec2,
    energy: f32,
    age: f32,
}

#[derive(Component)]
struct Flash {
    age: f32,
}

#[derive(Resource)]
struct Shapes {
    ball: Handle<Mesh>,
    hot: Handle<ColorMaterial>,
}

#[derive(Resource, Default)]
struct Charge(Option<f32>);

fn main() -> AppExit {
    let mut app = demo_app(
        "bevy_crack: projectile wall",
        &DemoArguments::given("A turret shoots at a brick wall, a concrete slab and a pane of glass"),
    );
    app.insert_resource(ClearColor(Color::srgb(0.11, 0.12, 0.14)))
        .init_resource::<Charge>()
        .add_systems(Startup, setup)
        .add_systems(Update, (move_lamp, fly, fade).chain());
    play(app, (aim_and_fire, heal_on_h).before(move_lamp), play_script.before(move_lamp))
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,

    mut meshes: ResMut<Assets<Mesh>>,
    mut lit: ResMut<Assets<CrackLitMaterial>>,
    mut colors: ResMut<Assets<ColorMaterial>>,
) {
    commands.spawn(Camera2d);
    let quad = meshes.add(Rectangle::new(SIDE, SIDE));
    // Walls crack along their mortar, the light lines of the picture.
    let brick = CrackSurface::new(CrackPreset::BRICK).with_seed(1);
    let concrete = CrackSurface::new(CrackPreset::CONCRETE).with_seed(2);
    for (x, name, surface) in [(-430.0, "brick_red", brick), (0.0, "concrete_fine", concrete)] {
        let (picture, normal) = with_normals(&assets, name);
        commands.spawn((
            Exhibit,
            Mesh2d(quad.clone()),
            MeshMaterial2d(
                lit.add(
                    CrackLitMaterial { normal: Some(normal), ..CrackLitMaterial::new(picture.clone()) }
                        .with_ambient(LinearRgba::gray(0.55)),
                ),
            ),
            Transform::from_xyz(x, 60.0, 0.0),
            surface,
            OnCanvas { picture, size: Vec2::splat(SIDE) },
        ));
    }
    // The pane stands before a picture, so that one sees it is glass.
    let behind = assets.load("textures/clay.png");
    commands.spawn((
        Sprite {
            image: behind.clone(),
            custom_size: Some(Vec2::splat(SIDE)),
            color: Color::srgb(0.5, 0.55, 0.6),
            ..default()
        },
        Transform::from_xyz(430.0, 60.0, -1.0),
        OnCanvas { picture: behind, size: Vec2::splat(SIDE) },
    ));
    let pane = assets.load("textures/glass_pane.png");
    commands.spawn((
        Exhibit,
        Sprite { image: pane.clone(), custom_size: Some(Vec2::splat(SIDE)), ..default() },
        Transform::from_xyz(430.0, 60.0, 0.0),
        CrackSurface::new(CrackPreset::GLASS).with_seed(3),
        OnCanvas { picture: pane, size: Vec2::splat(SIDE) },
    ));
    commands.spawn((
        Lamp,
        CrackLight2d { color: Color::srgb(1.0, 0.93, 0.8), intensity: 2.6, range: 1100.0, height: 170.0 },
        Transform::default(),
    ));
    let steel = colors.add(Color::srgb(0.35, 0.38, 0.42));
    commands.spawn((
        Mesh2d(meshes.add(Circle::new(38.0))),
        MeshMaterial2d(steel.clone()),
        Transform::from_translation(MUZZLE.extend(2.0)),
    ));
    commands.spawn((
        Barrel,
        Mesh2d(meshes.add(Rectangle::new(16.0, 74.0))),
        MeshMaterial2d(steel),
        Transform::from_translation(MUZZLE.extend(3.0)),
    ));
    commands.spawn(caption("click: fire, hold for a harder shot      H: heal", Vec2::new(0.0, 325.0)));
    commands
        .insert_resource(Shapes { ball: meshes.add(Circle::new(9.0)), hot: colors.add(Color::srgb(1.0, 0.75, 0.35)) });
}

/// The pointer aims; the button charges while it is down and fires when it is let go.
fn aim_and_fire(
    mut commands: Commands,
    mut charge: ResMut<Charge>,
    time: Res<Time>,
    buttons: Res<ButtonInput<MouseButton>>,
    cursor: Cursor,
    mut barrel: Query<&mut Transform, With<Barrel>>,
    shapes: Res<Shapes>,
) {
    let Some(target) = cursor.point() else { return };
    turn_barrel(&mut barrel, target);
    if buttons.just_pressed(MouseButton::Left) {
        charge.0 = Some(0.0);
    }
    if let Some(seconds) = &mut charge.0 {
        *seconds += time.delta_secs();
        if buttons.just_released(MouseButton::Left) {
            let energy = 0.5 + 3.5 * seconds.min(1.0);
            charge.0 = None;
            fire(&mut commands, &shapes, target, energy);
        }
    }
}

fn turn_barrel(barrel: &mut Query<&mut Transform, With<Barrel>>, target: Vec2) {
    if let Ok(mut barrel) = barrel.single_mut() {
        let aim = (target - MUZZLE).normalize_or(Vec2::Y);
        barrel.rotation = Quat::from_rotation_arc_2d(Vec2::Y, aim);
        barrel.translation = (MUZZLE + aim * 37.0).extend(3.0);
    }
}

fn fire(commands: &mut Commands, shapes: &Shapes, target: Vec2, energy: f32) {
    commands.spawn((
        Projectile { target, energy, age: 0.0 },
        Mesh2d(shapes.ball.clone()),
        MeshMaterial2d(shapes.hot.clone()),
        Transform::from_translation(MUZZLE.extend(4.0)),
    ));
}

/// Projectiles fly into the picture; those that arrive at an exhibit hit it.
fn fly(
    mut commands: Commands,
    time: Res<Time>,
    mut projectiles: Query<(Entity, &mut Projectile, &mut Transform)>,
    exhibits: Query<(Entity, &GlobalTransform), With<Exhibit>>,
    shapes: Res<Shapes>,
) {
    for (entity, mut projectile, mut transform) in &mut projectiles {
        projectile.age += time.delta_secs();
        let share = (projectile.age / FLIGHT).min(1.0);
        let size = (1.5 - share) * projectile.energy.sqrt().clamp(0.6, 2.0);
        transform.translation = MUZZLE.lerp(projectile.target, share).extend(4.0);
        transform.scale = Vec3::splat(size);
        if share < 1.0 {
            continue;
        }
        commands.entity(entity).despawn();
        for (exhibit, at) in &exhibits {
            let offset = (projectile.target - at.translation().truncate()).abs();
            if offset.max_element() <= SIDE / 2.0 {
                let point = projectile.target.extend(at.translation().z);
                commands.trigger(CrackHit::world(exhibit, point).with_energy(projectile.energy));
                commands.spawn((
                    Flash { age: 0.0 },
                    Mesh2d(shapes.ball.clone()),
                    MeshMaterial2d(shapes.hot.clone()),
                    Transform::from_translation(projectile.target.extend(5.0)),
                ));
            }
        }
    }
}

fn fade(mut commands: Commands, time: Res<Time>, mut flashes: Query<(Entity, &mut Flash, &mut Transform)>) {
    for (entity, mut flash, mut transform) in &mut flashes {
        flash.age += time.delta_secs();
        let share = flash.age / 0.15;
        transform.scale = Vec3::splat(1.6 * (1.0 - share).max(0.0));
        if share >= 1.0 {
            commands.entity(entity).despawn();
        }
    }
}

fn move_lamp(time: Res<Time>, mut lamp: Query<&mut Transform, With<Lamp>>) {
    let t = time.elapsed_secs();
    for mut transform in &mut lamp {
        transform.translation = Vec3::new(560.0 * ops::sin(0.6 * t), 60.0 + 190.0 * ops::cos(0.83 * t), 0.0);
    }
}

/// The scripted run: shots at all three, harder as it goes on, everything healed once, and hit again.
fn play_script(
    mut commands: Commands,
    script: Script,
    mut barrel: Query<&mut Transform, With<Barrel>>,
    exhibits: Query<Entity, With<Exhibit>>,
    shapes: Res<Shapes>,
) {
    if script.is_at(HEAL_AT) {
        for exhibit in &exhibits {
            commands.entity(exhibit).heal_cracks();
        }
    }
    // The last shots have time to crack what they hit.
    for i in script.due(SHOTS, 0.0..0.9) {
        let golden = |k: f32| (i as f32 * k).fract() - 0.5;
        let middle = Vec2::new([-430.0, 0.0, 430.0][i as usize % 3], 60.0);
        let target = middle + Vec2::new(golden(0.618), golden(0.755)) * SIDE * 0.75;
        turn_barrel(&mut barrel, target);
        fire(&mut commands, &shapes, target, [0.6, 1.0, 1.5, 2.5][i as usize / 3 % 4]);
    }
}
