//! A corridor of brick and concrete in raking light, with normal maps and relief parallax; every shot cracks what it meets, and dust hangs in the air.
//!
//! Click to shoot; H heals everything. The camera sways, so that the depth of the cracks shows.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! Try `--frames 120 --out film`.

use bevy::{
    asset::RenderAssetUsages,
    camera::Hdr,
    core_pipeline::tonemapping::Tonemapping,
    math::ops,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_crack::prelude::*;
use bevy_crack_demos::{DemoArguments, Script, demo_app, heal_on_h, hit_on_press, play, with_normals};

/// Half the width of the room, metres.
const HALF: f32 = 2.0;

/// Shots of the scripted run.
const SHOTS: u32 = 12;

#[derive(Component)]
struct Wall;

#[derive(Component)]
struct Lamp;

/// A cloud of dust.
#[derive(Component)]
struct Puff {
    velocity: Vec3,
    size: f32,
    age: f32,
}

/// Seconds that dust hangs in the air, and clouds of a hit of energy 1.
const DUSTY: f32 = 2.6;
const PUFFS: u32 = 7;

#[derive(Resource)]
struct Dust {
    quad: Handle<Mesh>,
    cloud: Handle<Image>,
}

fn main() -> AppExit {
    let mut app =
        demo_app("bevy_crack: walls in 3D", &DemoArguments::given("A room of brick and concrete to shoot at"));
    app.add_systems(Startup, setup).add_systems(Update, (sway, move_lamp, drift)).add_observer(raise_dust);
    play(app, heal_on_h, play_script)
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,

    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut images: ResMut<Assets<Image>>,
) {
    commands.spawn((
        Camera3d::default(),
        Hdr,
        // Needs no lookup table.
        Tonemapping::AcesFitted,
        AmbientLight { brightness: 330.0, color: Color::srgb(0.82, 0.9, 1.0), ..default() },
        Transform::default(),
    ));
    let mut material = |name: &str| {
        let (picture, normals) = with_normals(&assets, name);
        materials.add(StandardMaterial {
            base_color_texture: Some(picture),
            normal_map_texture: Some(normals),
            perceptual_roughness: 0.9,
            ..default()
        })
    };
    let (brick, concrete) = (material("brick_red"), material("concrete_fine"));
    let wall = meshes.add(Rectangle::new(2.0 * HALF, 2.0 * HALF));
    let right = Quat::from_rotation_y(-std::f32::consts::FRAC_PI_2);
    let floor = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    // Walls crack along their mortar, the light lines of the picture.
    let of_brick = CrackSurface::new(CrackPreset::BRICK).with_mips(CrackMips::Always);
    let of_concrete = CrackSurface::new(CrackPreset::CONCRETE).with_mips(CrackMips::Always);
    // They come to rest on the floor.
    let mut chips = CrackChips { floor: Some(-HALF), ..default() };
    chips.burst.fade_after = 4.0;
    let sides = [
        (Transform::from_xyz(0.0, 0.0, -HALF), concrete.clone(), of_concrete.clone().with_seed(1)),
        (
            Transform::from_xyz(-HALF, 0.0, 0.0).with_rotation(right.inverse()),
            brick.clone(),
            of_brick.clone().with_seed(2),
        ),
        (Transform::from_xyz(HALF, 0.0, 0.0).with_rotation(right), brick, of_brick.with_seed(3)),
        (Transform::from_xyz(0.0, -HALF, 0.0).with_rotation(floor), concrete, of_concrete.with_seed(4)),
    ];
    for (transform, material, surface) in sides {
        commands
            .spawn((Wall, Mesh3d(wall.clone()), MeshMaterial3d(material), transform, surface, chips.clone()))
            .observe(hit_on_press);
    }
    commands.spawn((
        Lamp,
        PointLight {
            color: Color::srgb(1.0, 0.9, 0.74),
            intensity: 330_000.0,
            range: 14.0,
            shadow_maps_enabled: false,
            ..default()
        },
        Transform::default(),
    ));
    commands.insert_resource(Dust { quad: meshes.add(Rectangle::new(1.0, 1.0)), cloud: images.add(cloud()) });
}

/// A soft white disc.
fn cloud() -> Image {
    const SIDE: u32 = 32;
    let texel = |i: u32| {
        let at = Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) / (0.5 * (SIDE - 1) as f32) - 1.0;
        let left = (1.0 - at.length()).max(0.0);
        [255, 255, 255, (255.0 * left * left * (3.0 - 2.0 * left)) as u8]
    };
    let size = Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 };
    let texels = (0..SIDE * SIDE).flat_map(texel).collect();
    Image::new(size, TextureDimension::D2, texels, TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::RENDER_WORLD)
}

/// Dust rises where something is hit.
fn raise_dust(
    hit: On<CrackHit>,
    mut commands: Commands,
    dust: Res<Dust>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    walls: Query<&GlobalTransform>,
) {
    let (HitPoint::World(point), Ok(wall)) = (hit.at, walls.get(hit.entity)) else { return };
    let out = wall.rotation() * Vec3::Z;
    for i in 0..(PUFFS as f32 * hit.energy.sqrt()) as u32 {
        let draw = |k: f32| (i as f32 * k + 3.7 * point.x + 5.1 * point.y + point.z).rem_euclid(1.0) - 0.5;
        let away = Vec3::new(draw(0.618), draw(0.755) + 0.2, draw(0.327));
        commands.spawn((
            Puff { velocity: 0.7 * out + 0.9 * away, size: 0.35 + 0.3 * draw(0.913), age: 0.0 },
            Mesh3d(dust.quad.clone()),
            MeshMaterial3d(materials.add(StandardMaterial {
                base_color: Color::srgba(0.78, 0.74, 0.68, 0.0),
                base_color_texture: Some(dust.cloud.clone()),
                alpha_mode: AlphaMode::Blend,
                unlit: true,
                ..default()
            })),
            Transform::from_translation(point + 0.1 * out + 0.12 * away),
        ));
    }
}

/// Dust slows down, spreads and fades, and faces the camera.
fn drift(
    mut commands: Commands,
    time: Res<Time>,
    mut puffs: Query<(Entity, &mut Puff, &mut Transform, &MeshMaterial3d<StandardMaterial>)>,
    camera: Single<&Transform, (With<Camera3d>, Without<Puff>)>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let seconds = time.delta_secs();
    for (entity, mut puff, mut transform, material) in &mut puffs {
        puff.age += seconds;
        puff.velocity *= ops::exp(-2.5 * seconds);
        transform.translation += (puff.velocity - 0.05 * Vec3::Y) * seconds;
        transform.rotation = camera.rotation;
        let share = puff.age / DUSTY;
        transform.scale = Vec3::splat(puff.size * (0.5 + 1.5 * share.sqrt()));
        if let Some(mut material) = materials.get_mut(&material.0) {
            material.base_color.set_alpha(0.34 * (1.0 - share).max(0.0));
        }
        if share >= 1.0 {
            commands.entity(entity).despawn();
        }
    }
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
        transform.translation = Vec3::new(1.35 * ops::cos(0.5 * t), 1.45, -0.9 + 0.7 * ops::sin(0.5 * t));
    }
}

/// The scripted run: shots at all sides in turn.
fn play_script(mut commands: Commands, script: Script, walls: Query<(Entity, &GlobalTransform), With<Wall>>) {
    for i in script.due(SHOTS, 0.0..0.7) {
        let golden = |k: f32| ((i as f32 * k).fract() - 0.5) * 2.4;
        // Sorted: a wall that cracks gets components, and a query lists the walls in another order.
        let Some((wall, at)) = walls.iter().sort::<Entity>().nth(i as usize % 4) else { continue };
        let point = at.transform_point(Vec3::new(golden(0.618), golden(0.755), 0.0));
        commands.trigger(CrackHit::world(wall, point).with_energy([1.0, 2.0, 0.7][i as usize % 3]));
    }
}
