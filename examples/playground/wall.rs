//! The wall, which may be of any material, and the small pictures that choose it.

use super::{place, with_normals};
use bevy::prelude::*;
use bevy_crack::{editor::CrackEditor, plugin::CrackLitMaterial, prelude::*};

/// A picture in the assets, whether there is a normal map for it, and how it cracks.
struct Material {
    name: &'static str,
    picture: &'static str,
    has_normals: bool,
    preset: CrackPreset,
}

const fn material(name: &'static str, picture: &'static str, has_normals: bool, preset: CrackPreset) -> Material {
    Material { name, picture, has_normals, preset }
}

const MATERIALS: [Material; 12] = [
    material("concrete", "concrete_fine", true, CrackPreset::CONCRETE),
    material("plaster", "plaster", false, CrackPreset::PLASTER),
    material("bricks", "brick_red", true, CrackPreset::BRICK),
    material("clay", "clay", false, CrackPreset::CLAY),
    material("mud", "mud", false, CrackPreset::MUD),
    material("sand", "sand", false, CrackPreset::SAND),
    material("asphalt", "asphalt", false, CrackPreset::ASPHALT),
    material("paving", "paving", false, CrackPreset::CONCRETE),
    material("marble", "marble", false, CrackPreset::MARBLE),
    material("glaze", "glaze", false, CrackPreset::GLAZE),
    material("ice", "ice", false, CrackPreset::ICE),
    material("cartoon", "toon", false, CrackPreset::TOON),
];

/// Small pictures in a row, and how much of its place each fills.
const COLUMNS: usize = 4;
const FILLED: f32 = 0.92;

/// Colour of a small picture.
const fn shade(is_chosen: bool) -> Color {
    if is_chosen { Color::WHITE } else { Color::srgb(0.55, 0.55, 0.55) }
}

#[derive(Component)]
pub(crate) struct Wall;

/// A small picture, with its number among the materials.
#[derive(Component)]
pub(crate) struct Sample(usize);

/// The light of the wall, which is where the pointer was last.
#[derive(Component)]
pub(crate) struct Lamp;

pub(crate) fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut lit: ResMut<Assets<CrackLitMaterial>>,
) {
    let light = CrackLight2d { range: 460.0, intensity: 1.35, height: 110.0, ..default() };
    let corner = Vec2::new(-100.0, 130.0);
    commands.spawn((Lamp, light, Transform::from_translation((place::WALL.center() + corner).extend(0.0))));
    let cell = place::CHOICE.size() / Vec2::new(COLUMNS as f32, MATERIALS.len().div_ceil(COLUMNS) as f32);
    let first = Vec2::new(place::CHOICE.min.x, place::CHOICE.max.y) + Vec2::new(0.5, -0.5) * cell;
    for (i, material) in MATERIALS.iter().enumerate() {
        let at = first + Vec2::new((i % COLUMNS) as f32, -((i / COLUMNS) as f32)) * cell;
        let image = assets.load(format!("textures/{}.png", material.picture));
        // The middle of each picture, in the proportions of its place.
        let rect = Rect::from_center_size(Vec2::splat(128.0), cell);
        commands.spawn((
            Sample(i),
            Sprite { image, rect: Some(rect), custom_size: Some(FILLED * cell), color: shade(i == 0), ..default() },
            Pickable::default(),
            Transform::from_translation(at.extend(0.0)),
        ));
    }
    spawn(&mut commands, &assets, &mut meshes, &mut lit, &MATERIALS[0]);
}

fn spawn(
    commands: &mut Commands,
    assets: &AssetServer,
    meshes: &mut Assets<Mesh>,
    lit: &mut Assets<CrackLitMaterial>,
    of: &Material,
) -> Entity {
    let (picture, normal) = if of.has_normals {
        let [picture, normal] = with_normals(assets, of.picture);
        (picture, Some(normal))
    } else {
        (assets.load(format!("textures/{}.png", of.picture)), None)
    };
    let material = CrackLitMaterial { normal, ..CrackLitMaterial::new(picture) };
    let wall = commands.spawn((
        Wall,
        Name::new(format!("Wall of {}", of.name)),
        Mesh2d(meshes.add(Rectangle::from_size(place::WALL.size()))),
        MeshMaterial2d(lit.add(material.with_ambient(LinearRgba::gray(0.55)))),
        Transform::from_translation(place::WALL.center().extend(0.0)),
        CrackSurface::new(of.preset.clone()).with_seed(5),
    ));
    wall.id()
}

/// A click on a small picture: another wall.
pub(crate) fn choose(
    press: On<Pointer<Press>>,
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut lit: ResMut<Assets<CrackLitMaterial>>,
    walls: Query<Entity, With<Wall>>,
    mut samples: Query<(&Sample, &mut Sprite)>,
    mut editor: ResMut<CrackEditor>,
) {
    let Ok((&Sample(chosen), _)) = samples.get(press.entity) else { return };
    for (sample, mut sprite) in &mut samples {
        sprite.color = shade(sample.0 == chosen);
    }
    for wall in &walls {
        commands.entity(wall).despawn();
    }
    let wall = spawn(&mut commands, &assets, &mut meshes, &mut lit, &MATERIALS[chosen]);
    commands.entity(wall).prepare_cracks();
    editor.chosen = Some(wall);
}

/// The light follows the pointer while that is over the wall.
pub(crate) fn move_lamp(
    window: Single<&Window>,
    camera: Single<(&Camera, &GlobalTransform), With<Camera2d>>,
    mut lamp: Single<&mut Transform, With<Lamp>>,
) {
    let (camera, at) = *camera;
    if let Some(cursor) = window.cursor_position()
        && let Ok(point) = camera.viewport_to_world_2d(at, cursor)
        && place::WALL.contains(point)
        && lamp.translation.xy() != point
    {
        lamp.translation = point.extend(0.0);
    }
}
