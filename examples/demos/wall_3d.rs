//! A room of brick and concrete, with normal maps and relief parallax; every shot cracks the wall that it meets.
//!
//! Click to shoot; H heals everything. The camera sways, so that the depth of the cracks shows.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! Try `--frames 120 --out film`.

use bevy::{camera::Hdr, core_pipeline::tonemapping::Tonemapping, math::ops, prelude::*};
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

fn main() -> AppExit {
    let mut app =
        demo_app("bevy_crack: walls in 3D", &DemoArguments::given("A room of brick and concrete to shoot at"));
    app.add_systems(Startup, setup).add_systems(Update, (sway, move_lamp));
    play(app, heal_on_h, play_script)
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
        AmbientLight { brightness: 420.0, ..default() },
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
    let of_brick = CrackSurface::new(CrackPreset::BRICK);
    let of_concrete = CrackSurface::new(CrackPreset::CONCRETE);
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
            .spawn((Wall, Mesh3d(wall.clone()), MeshMaterial3d(material), transform, surface))
            .observe(hit_on_press);
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
