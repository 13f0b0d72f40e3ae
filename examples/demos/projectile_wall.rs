//! A cannon before a brick wall, a concrete slab and a pane of glass; every ball cracks what it hits, and dust flies.
//!
//! Aim with the mouse, click to fire, hold longer for a harder shot; H heals everything. A lamp wanders in front of the walls,
//! so that the normals of the cracks show.
//!
//! Without a display (or with `--headless`) a script plays a minute, and pictures and a GIF are written to `--out`.
//! Without any GPU adapter the same happens on the CPU. Try `--frames 300 --out film`.

use bevy::{math::ops, prelude::*};
use bevy_crack::prelude::*;
use bevy_crack_demos::{Cursor, DemoArguments, OnCanvas, Script, caption, demo_app, heal_on_h, play, with_normals};

/// Side of an exhibit in the world, from the middle of one to the next, and the height of their middles.
const SIDE: f32 = 412.0;
const PITCH: f32 = 424.0;
const HEIGHT: f32 = 104.0;

/// Where the ground begins.
const GROUND: f32 = HEIGHT - 0.5 * SIDE - 14.0;

/// What the barrel of the cannon turns about, and its length.
const HINGE: Vec2 = Vec2::new(0.0, -266.0);
const BARREL: f32 = 118.0;

/// Seconds from the muzzle to the wall.
const FLIGHT: f32 = 0.35;

/// Shots of the scripted run, and when everything is healed in it, as shares of its length.
const SHOTS: u32 = 26;
const HEAL_AT: f32 = 0.72;

/// Grains that fly at a hit of energy 1.
const GRAINS: u32 = 22;

/// Something to shoot at, and the colour of its dust.
#[derive(Component)]
struct Exhibit {
    dust: Color,
}

/// Jumps back at a shot.
#[derive(Component)]
struct Barrel {
    aim: Vec2,
    recoil: f32,
}

/// Flies off at a hit, falls and fades; dust hangs in the air.
#[derive(Component)]
struct Grain {
    velocity: Vec2,
    age: f32,
    life: f32,
    size: f32,
    gravity: f32,
}

#[derive(Component)]
struct Lamp;

#[derive(Component)]
struct Projectile {
    from: Vec2,
    target: Vec2,
    energy: f32,
    age: f32,
}

#[derive(Component)]
struct Flash {
    age: f32,
    size: f32,
}

#[derive(Resource)]
struct Shapes {
    ball: Handle<Mesh>,
    grain: Handle<Mesh>,
    iron: Handle<ColorMaterial>,
    hot: Handle<ColorMaterial>,
}

#[derive(Resource, Default)]
struct Charge(Option<f32>);

fn main() -> AppExit {
    let mut app = demo_app(
        "bevy_crack: projectile wall",
        &DemoArguments::given("A cannon before a brick wall, a concrete slab and a pane of glass"),
    );
    app.insert_resource(ClearColor(Color::srgb(0.17, 0.17, 0.19)))
        .init_resource::<Charge>()
        .add_systems(Startup, (setup, set_up_cannon))
        .add_systems(Update, (move_lamp, fly, fade, scatter, turn_barrel).chain());
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
    let (red, grey) = (Color::srgb(0.72, 0.45, 0.36), Color::srgb(0.66, 0.64, 0.6));
    for (x, name, surface, dust) in [(-PITCH, "brick_red", brick, red), (0.0, "concrete_fine", concrete, grey)] {
        let (picture, normal) = with_normals(&assets, name);
        commands.spawn((
            Exhibit { dust },
            Mesh2d(quad.clone()),
            MeshMaterial2d(
                lit.add(
                    CrackLitMaterial { normal: Some(normal), ..CrackLitMaterial::new(picture.clone()) }
                        .with_ambient(LinearRgba::gray(0.7)),
                ),
            ),
            Transform::from_xyz(x, HEIGHT, 0.0),
            surface,
            CrackChips::default(),
            OnCanvas { picture, size: Vec2::splat(SIDE) },
        ));
    }
    // The pane stands before a picture, so that one sees it is glass.
    let behind = assets.load("textures/clay.png");
    commands.spawn((
        Sprite {
            image: behind.clone(),
            custom_size: Some(Vec2::splat(SIDE)),
            color: Color::srgb(0.62, 0.68, 0.74),
            ..default()
        },
        Transform::from_xyz(PITCH, HEIGHT, -1.0),
        OnCanvas { picture: behind, size: Vec2::splat(SIDE) },
    ));
    let pane = assets.load("textures/glass_pane.png");
    commands.spawn((
        Exhibit { dust: Color::srgb(0.9, 0.95, 1.0) },
        Sprite { image: pane.clone(), custom_size: Some(Vec2::splat(SIDE)), ..default() },
        Transform::from_xyz(PITCH, HEIGHT, 0.0),
        CrackSurface::new(CrackPreset::GLASS).with_seed(3),
        OnCanvas { picture: pane, size: Vec2::splat(SIDE) },
    ));
    commands.spawn((
        Lamp,
        CrackLight2d { color: Color::srgb(1.0, 0.94, 0.84), intensity: 2.4, range: 1300.0, height: 190.0 },
        Transform::default(),
    ));
    commands.spawn(caption("click: fire, hold for a harder shot      H: heal", Vec2::new(0.0, 338.0)));
    commands.insert_resource(Shapes {
        ball: meshes.add(Circle::new(11.0)),
        grain: meshes.add(RegularPolygon::new(1.0, 5)),
        iron: colors.add(Color::srgb(0.13, 0.13, 0.15)),
        hot: colors.add(Color::srgb(1.0, 0.85, 0.5)),
    });
}

/// The cannon on its carriage, and the ground that it stands on.
fn set_up_cannon(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut colors: ResMut<Assets<ColorMaterial>>,
) {
    let mut part = |mesh: Mesh, color: Color, at: Vec3| {
        (Mesh2d(meshes.add(mesh)), MeshMaterial2d(colors.add(color)), Transform::from_translation(at))
    };
    let (iron, bright) = (Color::srgb(0.24, 0.25, 0.28), Color::srgb(0.38, 0.4, 0.44));
    let (oak, dark) = (Color::srgb(0.42, 0.28, 0.17), Color::srgb(0.29, 0.19, 0.11));
    let depth = 360.0 + GROUND;
    commands.spawn((
        Sprite {
            image: assets.load("textures/paving.png"),
            color: Color::srgb(0.5, 0.49, 0.48),
            custom_size: Some(Vec2::new(1280.0, depth)),
            image_mode: SpriteImageMode::Tiled { tile_x: true, tile_y: true, stretch_value: 0.5 },
            ..default()
        },
        Transform::from_xyz(0.0, GROUND - 0.5 * depth, -2.0),
    ));
    commands.spawn(part(
        Rectangle::new(1280.0, 10.0).into(),
        Color::srgb(0.4, 0.38, 0.35),
        Vec3::new(0.0, GROUND, -1.5),
    ));
    // Its shadow.
    commands.spawn(part(
        Ellipse::new(118.0, 14.0).into(),
        Color::srgba(0.0, 0.0, 0.0, 0.35),
        HINGE.extend(1.0) - 62.0 * Vec3::Y,
    ));
    commands.spawn(part(Rectangle::new(132.0, 34.0).into(), oak, HINGE.extend(2.0) - 26.0 * Vec3::Y));
    commands.spawn(part(Rectangle::new(132.0, 6.0).into(), dark, HINGE.extend(2.1) - 40.0 * Vec3::Y));
    let barrel = commands
        .spawn((
            Barrel { aim: Vec2::Y, recoil: 0.0 },
            Transform::from_translation(HINGE.extend(3.0)),
            Visibility::default(),
        ))
        .id();
    let up = |y: f32, z: f32| Vec3::new(0.0, y, z);
    let tube = ConvexPolygon::new([[-27.0, -26.0], [27.0, -26.0], [18.0, BARREL], [-18.0, BARREL]].map(Vec2::from));
    let shine = ConvexPolygon::new([[-15.0, -20.0], [-8.0, -20.0], [-5.0, BARREL], [-10.0, BARREL]].map(Vec2::from));
    for part in [
        part(Circle::new(27.0).into(), iron, up(-26.0, 0.0)),
        part(Circle::new(9.0).into(), bright, up(-54.0, -0.1)),
        part(Rectangle::new(50.0, 9.0).into(), bright, up(18.0, 0.2)),
        part(Rectangle::new(46.0, 14.0).into(), iron, up(BARREL - 4.0, 0.3)),
        part(Rectangle::new(46.0, 4.0).into(), bright, up(BARREL - 12.0, 0.4)),
    ] {
        commands.spawn((part, ChildOf(barrel)));
    }
    for (shape, color, z) in [(tube, iron, 0.0), (shine, bright, 0.1)] {
        if let Ok(shape) = shape {
            commands.spawn((part(shape.into(), color, up(0.0, z)), ChildOf(barrel)));
        }
    }
    for x in [-70.0, 70.0] {
        let at = HINGE.extend(5.0) + Vec3::new(x, -30.0, 0.0);
        commands.spawn(part(Circle::new(36.0).into(), dark, at));
        commands.spawn(part(Circle::new(29.0).into(), oak, at + 0.1 * Vec3::Z));
        for k in 0..4 {
            let (mesh, material, place) = part(Rectangle::new(58.0, 5.0).into(), dark, at + 0.2 * Vec3::Z);
            let turned = place.with_rotation(Quat::from_rotation_z(std::f32::consts::FRAC_PI_4 * k as f32));
            commands.spawn((mesh, material, turned));
        }
        commands.spawn(part(Circle::new(8.0).into(), bright, at + 0.3 * Vec3::Z));
    }
}

/// The pointer aims; the button charges while it is down and fires when it is let go.
fn aim_and_fire(
    mut commands: Commands,
    mut charge: ResMut<Charge>,
    time: Res<Time>,
    buttons: Res<ButtonInput<MouseButton>>,
    cursor: Cursor,
    mut barrel: Single<&mut Barrel>,
    shapes: Res<Shapes>,
) {
    let Some(target) = cursor.point() else { return };
    barrel.aim(target);
    if buttons.just_pressed(MouseButton::Left) {
        charge.0 = Some(0.0);
    }
    if let Some(seconds) = &mut charge.0 {
        *seconds += time.delta_secs();
        if buttons.just_released(MouseButton::Left) {
            let energy = 0.5 + 3.5 * seconds.min(1.0);
            charge.0 = None;
            fire(&mut commands, &shapes, &mut barrel, target, energy);
        }
    }
}

impl Barrel {
    fn aim(&mut self, target: Vec2) {
        let aim = (target - HINGE).normalize_or(Vec2::Y);
        // It does not shoot itself in the wheels.
        self.aim = Vec2::new(aim.x, aim.y.max(0.25)).normalize_or(Vec2::Y);
    }
}

fn turn_barrel(time: Res<Time>, barrel: Single<(&mut Barrel, &mut Transform)>) {
    let (mut barrel, mut transform) = barrel.into_inner();
    barrel.recoil *= ops::exp(-7.0 * time.delta_secs());
    transform.rotation = Quat::from_rotation_arc_2d(Vec2::Y, barrel.aim);
    transform.translation = (HINGE - barrel.recoil * barrel.aim).extend(3.0);
}

fn fire(commands: &mut Commands, shapes: &Shapes, barrel: &mut Barrel, target: Vec2, energy: f32) {
    barrel.aim(target);
    barrel.recoil = 26.0;
    let from = HINGE + (BARREL + 6.0) * barrel.aim;
    commands.spawn((
        Projectile { from, target, energy, age: 0.0 },
        Mesh2d(shapes.ball.clone()),
        MeshMaterial2d(shapes.iron.clone()),
        Transform::from_translation(from.extend(4.0)),
    ));
    commands.spawn(flash(shapes, from, 2.4));
}

/// Light for a moment.
fn flash(shapes: &Shapes, at: Vec2, size: f32) -> impl Bundle {
    (
        Flash { age: 0.0, size },
        Mesh2d(shapes.ball.clone()),
        MeshMaterial2d(shapes.hot.clone()),
        Transform::from_translation(at.extend(6.0)),
    )
}

/// Grains and dust from a hit.
fn burst(
    commands: &mut Commands,
    shapes: &Shapes,
    colors: &mut Assets<ColorMaterial>,
    at: Vec2,
    energy: f32,
    dust: Color,
) {
    for i in 0..(GRAINS as f32 * energy.sqrt()) as u32 {
        let draw = |k: f32| (i as f32 * k + at.x * 0.013 + at.y * 0.037).rem_euclid(1.0);
        let (sin, cos) = ops::sin_cos(std::f32::consts::TAU * draw(0.618_034));
        let is_dust = i % 3 == 0;
        let speed = if is_dust { 30.0 + 60.0 * draw(0.755) } else { 90.0 + 260.0 * draw(0.755) } * energy.sqrt();
        let shade = 0.75 + 0.35 * draw(0.327);
        let Srgba { red, green, blue, .. } = dust.to_srgba();
        let color = Color::srgba(red * shade, green * shade, blue * shade, if is_dust { 0.25 } else { 1.0 });
        commands.spawn((
            Grain {
                velocity: Vec2::new(cos, sin + 0.35) * speed,
                age: 0.0,
                life: if is_dust { 0.9 } else { 1.3 },
                size: if is_dust { 16.0 + 14.0 * draw(0.913) } else { 1.6 + 3.4 * draw(0.913) },
                gravity: if is_dust { -20.0 } else { 620.0 },
            },
            Mesh2d(shapes.grain.clone()),
            MeshMaterial2d(colors.add(color)),
            Transform::from_translation(at.extend(if is_dust { 4.5 } else { 5.0 })),
        ));
    }
}

fn scatter(mut commands: Commands, time: Res<Time>, mut grains: Query<(Entity, &mut Grain, &mut Transform)>) {
    let seconds = time.delta_secs();
    for (entity, mut grain, mut transform) in &mut grains {
        grain.age += seconds;
        grain.velocity *= ops::exp(-1.2 * seconds);
        grain.velocity.y -= grain.gravity * seconds;
        transform.translation += (grain.velocity * seconds).extend(0.0);
        let left = 1.0 - grain.age / grain.life;
        transform.scale = Vec3::splat(grain.size * left.max(0.0).sqrt());
        transform.rotate_z(4.0 * seconds);
        if left <= 0.0 {
            commands.entity(entity).despawn();
        }
    }
}

/// Projectiles fly into the picture; those that arrive at an exhibit hit it.
fn fly(
    mut commands: Commands,
    time: Res<Time>,
    mut projectiles: Query<(Entity, &mut Projectile, &mut Transform)>,
    exhibits: Query<(Entity, &Exhibit, &GlobalTransform)>,
    shapes: Res<Shapes>,
    mut colors: ResMut<Assets<ColorMaterial>>,
) {
    for (entity, mut projectile, mut transform) in &mut projectiles {
        projectile.age += time.delta_secs();
        let share = (projectile.age / FLIGHT).min(1.0);
        let size = (1.5 - share) * projectile.energy.sqrt().clamp(0.6, 2.0);
        transform.translation = projectile.from.lerp(projectile.target, share).extend(4.0);
        transform.scale = Vec3::splat(size);
        if share < 1.0 {
            continue;
        }
        commands.entity(entity).despawn();
        for (exhibit, Exhibit { dust }, at) in &exhibits {
            let offset = (projectile.target - at.translation().truncate()).abs();
            if offset.max_element() <= SIDE / 2.0 {
                let Projectile { target, energy, .. } = *projectile;
                let point = target.extend(at.translation().z);
                commands.trigger(CrackHit::world(exhibit, point).with_energy(energy));
                commands.spawn(flash(&shapes, target, 1.6));
                burst(&mut commands, &shapes, &mut colors, target, energy, *dust);
            }
        }
    }
}

fn fade(mut commands: Commands, time: Res<Time>, mut flashes: Query<(Entity, &mut Flash, &mut Transform)>) {
    for (entity, mut flash, mut transform) in &mut flashes {
        flash.age += time.delta_secs();
        let share = flash.age / 0.15;
        transform.scale = Vec3::splat(flash.size * (1.0 - share).max(0.0));
        if share >= 1.0 {
            commands.entity(entity).despawn();
        }
    }
}

fn move_lamp(time: Res<Time>, mut lamp: Query<&mut Transform, With<Lamp>>) {
    let t = time.elapsed_secs();
    for mut transform in &mut lamp {
        transform.translation = Vec3::new(560.0 * ops::sin(0.6 * t), HEIGHT + 190.0 * ops::cos(0.83 * t), 0.0);
    }
}

/// The scripted run: shots at all three, harder as it goes on, everything healed once, and hit again.
fn play_script(
    mut commands: Commands,
    script: Script,
    mut barrel: Single<&mut Barrel>,
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
        let middle = Vec2::new([-PITCH, 0.0, PITCH][i as usize % 3], HEIGHT);
        let target = middle + Vec2::new(golden(0.618), golden(0.755)) * SIDE * 0.75;
        fire(&mut commands, &shapes, &mut barrel, target, [0.6, 1.0, 1.5, 2.5][i as usize / 3 % 4]);
    }
}
