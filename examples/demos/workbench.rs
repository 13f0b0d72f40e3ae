//! The workbench: a panel over a sprite, a lit 2D wall, a pane of glass and a 3D wall.
//!
//! Click to hit, drag to aim; the panel shows the settings of what was clicked last. F1 hides it.
//!
//! Without a display (or with `--headless`) a script hits, changes and shatters, and pictures and a GIF are written to `--out`.

use bevy::{
    camera::Viewport, core_pipeline::tonemapping::Tonemapping, light::GlobalAmbientLight, math::ops, prelude::*,
};
use bevy_crack::{
    editor::{CrackEditor, CrackEditorPlugin},
    plugin::CrackLitMaterial,
    prelude::*,
};
use bevy_crack_demos::{DemoArguments, Label, OnCanvas, Script, demo_app, play, with_normals};

/// Size of the exhibits in the world, and where they are.
const SIZE: Vec2 = Vec2::new(400.0, 300.0);
const LEFT: f32 = -420.0;
const MIDDLE: f32 = 0.0;
const ABOVE: f32 = 175.0;
const BELOW: f32 = -170.0;

fn main() -> AppExit {
    let about = DemoArguments::given("A panel over a sprite, a lit 2D wall, a pane and a 3D wall");
    let mut app = demo_app("bevy_crack: workbench", &about);
    app.add_plugins(CrackEditorPlugin::default())
        .insert_resource(ClearColor(Color::srgb(0.13, 0.145, 0.16)))
        .insert_resource(GlobalAmbientLight { brightness: 260.0, ..default() })
        .add_systems(Startup, setup)
        .add_systems(Update, move_light);
    play(app, || {}, play_script)
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut lit: ResMut<Assets<CrackLitMaterial>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    commands.spawn(Camera2d);
    let name = |commands: &mut Commands, text: &str, x: f32, y: f32| {
        commands.spawn((Label::grey(text, 15.0, 0.62), Transform::from_xyz(x, y - SIZE.y / 2.0 - 14.0, 3.0)));
    };
    // A sprite.
    let concrete = assets.load("textures/plaster.png");
    commands.spawn((
        Name::new("Sprite"),
        Sprite { image: concrete.clone(), custom_size: Some(SIZE), ..default() },
        Transform::from_xyz(LEFT, ABOVE, 0.0),
        CrackSurface::new(CrackPreset::PLASTER).with_seed(3),
        OnCanvas { picture: concrete, size: SIZE },
    ));
    name(&mut commands, "sprite", LEFT, ABOVE);
    // A lit wall in 2D.
    let (picture, normal) = with_normals(&assets, "concrete_fine");
    let material = CrackLitMaterial { normal: Some(normal), ..CrackLitMaterial::new(picture.clone()) };
    commands.spawn((
        Name::new("Lit wall"),
        Mesh2d(meshes.add(Rectangle::from_size(SIZE))),
        MeshMaterial2d(lit.add(material.with_ambient(LinearRgba::gray(0.55)))),
        Transform::from_xyz(MIDDLE, ABOVE, 0.0),
        CrackSurface::new(CrackPreset::CONCRETE).with_seed(5),
        OnCanvas { picture, size: SIZE },
    ));
    name(&mut commands, "lit 2D wall", MIDDLE, ABOVE);
    commands.spawn((CrackLight2d { range: 420.0, intensity: 1.3, ..default() }, Transform::default(), Lamp));
    // A pane before a picture.
    let behind = assets.load("textures/clay.png");
    commands.spawn((
        Sprite { image: behind.clone(), custom_size: Some(SIZE), color: Color::srgb(0.5, 0.56, 0.62), ..default() },
        Transform::from_xyz(LEFT, BELOW, -1.0),
        OnCanvas { picture: behind, size: SIZE },
    ));
    let pane = assets.load("textures/glass_pane.png");
    commands.spawn((
        Name::new("Pane"),
        Sprite { image: pane.clone(), custom_size: Some(SIZE), ..default() },
        Transform::from_xyz(LEFT, BELOW, 0.0),
        CrackSurface::new(CrackPreset::GLASS).with_seed(7),
        ShatterCracks::default(),
        OnCanvas { picture: pane, size: SIZE },
    ));
    name(&mut commands, "pane", LEFT, BELOW);
    spawn_wall(&mut commands, &assets, &mut meshes, &mut materials);
    name(&mut commands, "3D wall", MIDDLE, BELOW);
}

/// A wall in 3D, seen by a camera of its own in a part of the window.
fn spawn_wall(
    commands: &mut Commands,
    assets: &AssetServer,
    meshes: &mut Assets<Mesh>,
    materials: &mut Assets<StandardMaterial>,
) {
    // Where the exhibit would be: the view is 1280 x 720, its middle at (0, 0).
    let corner = Vec2::new(640.0 + MIDDLE - SIZE.x / 2.0, 360.0 - BELOW - SIZE.y / 2.0);
    commands.spawn((
        Camera3d::default(),
        Camera {
            order: 1,
            viewport: Some(Viewport {
                physical_position: corner.as_uvec2(),
                physical_size: SIZE.as_uvec2(),
                ..default()
            }),
            ..default()
        },
        Tonemapping::AcesFitted,
        Transform::from_xyz(0.9, 0.35, 2.5).looking_at(Vec3::new(0.0, -0.02, 0.0), Vec3::Y),
    ));
    let (picture, normals) = with_normals(assets, "brick_red");
    let material = StandardMaterial {
        base_color_texture: Some(picture),
        normal_map_texture: Some(normals),
        perceptual_roughness: 0.9,
        ..default()
    };
    commands.spawn((
        Name::new("3D wall"),
        Mesh3d(meshes.add(Rectangle::new(2.6, 2.0))),
        MeshMaterial3d(materials.add(material)),
        CrackSurface::new(CrackPreset::BRICK).with_seed(2),
    ));
    commands.spawn((
        PointLight { intensity: 280_000.0, range: 12.0, color: Color::srgb(1.0, 0.92, 0.8), ..default() },
        Transform::from_xyz(-1.6, 1.5, 1.6),
    ));
}

#[derive(Component)]
struct Lamp;

fn move_light(time: Res<Time>, mut lamp: Single<&mut Transform, With<Lamp>>) {
    let turn = 0.5 * time.elapsed_secs();
    lamp.translation = Vec3::new(MIDDLE + 150.0 * ops::cos(turn), ABOVE + 90.0 * ops::sin(turn), 120.0);
}

/// The scripted run: everything is hit, one after the other, with other things shown over it; in the end the pane falls.
fn play_script(
    script: Script,
    surfaces: Query<(Entity, &Name), With<CrackSurface>>,
    mut editor: ResMut<CrackEditor>,
    mut commands: Commands,
) {
    let find = |wanted: &str| surfaces.iter().find(|(_, name)| name.as_str() == wanted).map(|(entity, _)| entity);
    for (i, name) in ["Sprite", "Lit wall", "3D wall", "Pane"].into_iter().enumerate() {
        let Some(surface) = find(name) else { continue };
        let start = 0.04 + 0.2 * i as f32;
        for (k, uv) in [Vec2::new(0.42, 0.5), Vec2::new(0.66, 0.4)].into_iter().enumerate() {
            if script.is_at(start + 0.06 * k as f32) {
                editor.chosen = Some(surface);
                commands.trigger(CrackHit::uv(surface, uv).with_energy(1.5));
            }
        }
    }
    editor.panel.overlays.network = (0.3..0.45).contains(&script.share());
    editor.panel.overlays.markers = editor.panel.overlays.network;
    if script.is_at(0.85)
        && let Some(pane) = find("Pane")
    {
        commands.entity(pane).shatter_cracks(ShatterRequest::ALL.with_energy(2.0));
    }
}
