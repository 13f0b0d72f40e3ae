//! The corner of a room, of a wall with a ledge, another wall and a floor: seven meshes that crack as one surface. Shots near the corner send
//! cracks from the walls over the floor.
//!
//! Click to shoot; H heals everything.
//!
//! Without a display (or with `--headless`) a script plays, and pictures and a GIF are written to `--out`.
//! Try `--frames 120 --out film`.

use bevy::{
    asset::RenderAssetUsages,
    camera::Hdr,
    core_pipeline::tonemapping::Tonemapping,
    math::ops,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};
use bevy_crack::prelude::*;
use bevy_crack_demos::{DemoArguments, Script, demo_app, heal_on_h, hit_on_press, play, with_normals};

/// The corner is at (0, 0, 0): the room is to the right of it, above it and before it. Width, height and depth, metres.
const ROOM: Vec3 = Vec3::new(4.4, 2.4, 3.0);

/// Height and depth of the ledge before the wall at the back, metres.
const LEDGE: Vec2 = Vec2::new(0.35, 0.5);

/// A picture shows this many metres.
const PICTURE: f32 = 4.4;

/// Shots of the scripted run: where, and with what energy.
const SHOTS: [(Vec3, f32); 6] = [
    (Vec3::new(1.5, 0.75, 0.0), 4.0),
    (Vec3::new(0.0, 0.45, 1.5), 4.0),
    (Vec3::new(2.2, 0.0, 0.8), 3.0),
    (Vec3::new(0.35, 1.7, 0.0), 3.0),
    (Vec3::new(0.6, 0.0, 1.9), 2.0),
    (Vec3::new(2.7, 1.5, 0.0), 2.0),
];

fn main() -> AppExit {
    let arguments = DemoArguments::given("The corner of a room whose cracks run from the walls over the floor");
    let mut app = demo_app("bevy_crack: room", &arguments);
    app.add_systems(Startup, setup).add_systems(Update, sway);
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
        Camera { clear_color: ClearColorConfig::Custom(Color::srgb(0.08, 0.08, 0.09)), ..default() },
        Hdr,
        // Needs no lookup table.
        Tonemapping::AcesFitted,
        AmbientLight { brightness: 260.0, color: Color::srgb(0.85, 0.9, 1.0), ..default() },
        Transform::default(),
    ));
    commands.spawn((
        PointLight { intensity: 420_000.0, range: 12.0, color: Color::srgb(1.0, 0.93, 0.82), ..default() },
        Transform::from_xyz(2.9, 2.1, 1.9),
    ));
    let (picture, normals) = with_normals(&assets, "concrete_fine");
    let stone = materials.add(StandardMaterial {
        base_color_texture: Some(picture),
        normal_map_texture: Some(normals),
        perceptual_roughness: 0.9,
        ..default()
    });
    let plaster = materials.add(StandardMaterial {
        base_color_texture: Some(assets.load("textures/plaster.png")),
        perceptual_roughness: 0.85,
        ..default()
    });
    // All that cracks as one, and what is knocked out of its craters.
    let room = commands
        .spawn((CrackSurface::new(CrackPreset::CONCRETE).with_seed(4), CrackChips { floor: Some(0.0), ..default() }))
        .observe(hit_on_press)
        .id();
    let (x, y, z) = (ROOM * Vec3::X, ROOM * Vec3::Y, ROOM * Vec3::Z);
    let (up, out) = (Vec3::Y * LEDGE.x, Vec3::Z * LEDGE.y);
    // From one corner to the right and up, as it is seen. Edges in which two of them meet are the same.
    let parts = [
        // The wall at the back, and the ledge before it.
        (up, x, y - up, &plaster),
        (up + out, x, -out, &stone),
        (out, x, up, &stone),
        (z, x, out - z, &stone),
        // The wall on the left, in parts where the ledge ends.
        (up + out, -out, y - up, &plaster),
        (z + up, out - z, y - up, &plaster),
        (z, out - z, up, &plaster),
    ];
    for (corner, right, up, material) in parts {
        commands
            .spawn((
                Mesh3d(meshes.add(rectangle(right, up, corner))),
                MeshMaterial3d(material.clone()),
                Transform::from_translation(corner),
                CrackMemberOf(room),
            ))
            .observe(hit_on_press);
    }
}

/// A rectangle that shows its part of a picture which goes on from each part of a wall to the next.
fn rectangle(right: Vec3, up: Vec3, at: Vec3) -> Mesh {
    let normal = right.cross(up).normalize();
    let corners = [Vec3::ZERO, right, right + up, up];
    let uv = |corner: Vec3| {
        // In the picture, whichever way it runs in the room.
        let along = |way: Vec3| (corner + at).dot(way) / PICTURE + if way.element_sum() < 0.0 { 1.0 } else { 0.0 };
        [along(right.normalize()), along(-up.normalize())]
    };
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners.map(|at| at.to_array()).to_vec())
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![normal.to_array(); 4])
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, corners.map(uv).to_vec())
        .with_inserted_indices(Indices::U32(vec![0, 1, 2, 0, 2, 3]))
}

fn sway(time: Res<Time>, mut camera: Query<&mut Transform, With<Camera3d>>) {
    for mut transform in &mut camera {
        let swing = ops::sin(0.5 * time.elapsed_secs());
        let eye = Vec3::new(2.9 + 0.25 * swing, 1.75, 3.9 - 0.2 * swing);
        *transform = Transform::from_translation(eye).looking_at(Vec3::new(1.15, 0.62, 0.4), Vec3::Y);
    }
}

/// The scripted run: shots at walls and floor in turn.
fn play_script(mut commands: Commands, script: Script, room: Single<Entity, With<CrackSurface>>) {
    for i in script.due(SHOTS.len() as u32, 0.05..0.75) {
        let (at, energy) = SHOTS[i as usize];
        commands.trigger(CrackHit::world(*room, at).with_energy(energy));
    }
}
