//! Shows a relief that was made.

use crate::plugin::api::{CrackError, CrackMaskSource, CrackRelief, CrackSurface};
#[cfg(any(feature = "2d", feature = "3d"))]
use crate::plugin::carrier::slot::{CrackMaterial, MaterialSlot, typed};
#[cfg(any(feature = "2d", feature = "3d"))]
use crate::plugin::surface::cracked::active;
#[cfg(feature = "3d")]
use crate::relief::{ReliefFrame, ReliefMesh};
use crate::{
    Grid,
    pattern::SurfaceFrame,
    relief::{Relief, normals},
};
use bevy::{
    asset::RenderAssetUsages,
    image::Image,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};

fn image(texels: &Grid<[u8; 4]>, format: TextureFormat) -> Image {
    let size = texels.size();
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let data = texels.as_slice().as_flattened().to_vec();
    Image::new(extent, TextureDimension::D2, data, format, RenderAssetUsages::default())
}

/// The pictures of a relief.
#[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "nothing shows them then"))]
struct Pictures {
    diffuse: Handle<Image>,
    normal: Handle<Image>,
}

/// Has the entity show a relief.
pub(super) fn show(world: &mut World, entity: Entity, relief: Relief) -> Result<(), CrackError> {
    let Some(wish) = world.get::<CrackRelief>(entity).cloned() else { return Ok(()) };
    // A relief that stands out more, or less, has other slopes.
    let frame = SurfaceFrame::new(wish.size).ok().filter(|_| wish.displacement > 0.0 && wish.displacement != 1.0);
    let steeper = frame.map(|frame| normals(&scaled(&relief.heights, wish.displacement), &frame));
    let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let pictures = Pictures {
        diffuse: images.add(image(&relief.diffuse, TextureFormat::Rgba8UnormSrgb)),
        normal: images.add(image(&steeper.unwrap_or_else(|| relief.normal.clone()), TextureFormat::Rgba8Unorm)),
    };
    if !give(world, entity, &pictures, &wish, &relief) {
        return Err(CrackError::NothingToCrack);
    }
    prefer_steep(world, entity, wish.prefers_steep, &relief);
    Ok(())
}

/// Gives the pictures to what the entity has; `false` if that is nothing that shows pictures.
fn give(world: &mut World, entity: Entity, pictures: &Pictures, wish: &CrackRelief, relief: &Relief) -> bool {
    let _ = (&world, entity, pictures, wish, relief);
    #[cfg(feature = "2d")]
    {
        if let Some(mut sprite) = world.get_mut::<Sprite>(entity) {
            // A relief is a whole picture.
            (sprite.rect, sprite.texture_atlas) = (None, None);
            sprite.image = pictures.diffuse.clone();
            return true;
        }
        if give_material::<MeshMaterial2d<ColorMaterial>>(world, entity, |material| {
            material.texture = Some(pictures.diffuse.clone());
        }) || give_material::<MeshMaterial2d<crate::plugin::CrackLitMaterial>>(world, entity, |material| {
            material.diffuse = Some(pictures.diffuse.clone());
            material.normal = Some(pictures.normal.clone());
        }) {
            return true;
        }
    }
    #[cfg(feature = "3d")]
    if give_material::<MeshMaterial3d<StandardMaterial>>(world, entity, |material| {
        material.base_color_texture = Some(pictures.diffuse.clone());
        material.normal_map_texture = Some(pictures.normal.clone());
        material.depth_map = None;
    }) {
        give_mesh(world, entity, wish, relief);
        return true;
    }
    false
}

/// Gives the entity a material like the one that it had before it cracked; `false` if it has none of this kind.
#[cfg(any(feature = "2d", feature = "3d"))]
fn give_material<S: MaterialSlot>(world: &mut World, entity: Entity, change: impl FnOnce(&mut S::Material)) -> bool
where
    S::Material: CrackMaterial,
{
    let Some(slot) = world.get::<S>(entity) else { return false };
    let own = active(world, entity).and_then(|active| typed::<S::Material>(&active.carrier.shown.asset));
    let before = own.unwrap_or_else(|| slot.material().clone());
    let Some(mut materials) = world.get_resource_mut::<Assets<S::Material>>() else { return false };
    let Some(mut material) = materials.get(&before).cloned() else { return false };
    change(&mut material);
    let material = materials.add(material);
    if let Some(mut slot) = world.get_mut::<S>(entity) {
        slot.set_material(material);
    }
    true
}

/// Puts the mesh of the relief in the place of a rectangle.
#[cfg(feature = "3d")]
fn give_mesh(world: &mut World, entity: Entity, wish: &CrackRelief, relief: &Relief) {
    use crate::plugin::carrier::mesh::{check_for_tangents, lacks_tangents};
    use bevy::{
        camera::primitives::MeshAabb,
        mesh::{Indices, PrimitiveTopology},
    };

    let Some(before) = world.get::<Mesh3d>(entity).map(|mesh| mesh.0.clone()) else { return };
    let Some(mut meshes) = world.get_resource_mut::<Assets<Mesh>>() else { return };
    let Some(mesh) = meshes.get(&before) else { return };
    let mut made = if wish.displacement > 0.0 {
        let Some(bounds) = mesh.compute_aabb() else { return };
        let half = Vec3::from(bounds.half_extents);
        // Ground lies in the plane of x and z.
        let is_ground = half.y < half.z;
        let size = 2.0 * if is_ground { Vec2::new(half.x, half.z) } else { half.truncate() };
        let heights = scaled(&relief.heights, wish.displacement);
        let frame = ReliefFrame::new(size.max(Vec2::splat(1e-6)));
        let Ok(made) = ReliefMesh::new(&heights, &frame, wish.detail) else { return };
        let turn = if is_ground { Quat::from_rotation_x(-core::f32::consts::FRAC_PI_2) } else { Quat::IDENTITY };
        Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, made.positions)
            // The slopes are in the normal map.
            .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; made.normals.len()])
            .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, made.uvs)
            .with_inserted_indices(Indices::U32(made.indices))
            .transformed_by(Transform::from_rotation(turn).with_translation(Vec3::from(bounds.center)))
    } else if lacks_tangents(mesh) && check_for_tangents(mesh).is_ok() {
        mesh.clone()
    } else {
        return;
    };
    // Normals of a material need them. Without them the relief is shown flat.
    if let Ok(with) = made.clone().with_generated_tangents() {
        made = with;
    }
    let made = meshes.add(made);
    if let Some(mut mesh) = world.get_mut::<Mesh3d>(entity) {
        mesh.0 = made;
    }
}

fn scaled(heights: &Grid<f32>, by: f32) -> Grid<f32> {
    let mut scaled = heights.clone();
    scaled.as_mut_slice().iter_mut().for_each(|height| *height *= by);
    scaled
}

/// Has cracks prefer steep ground, unless the surface has a mask of its own.
fn prefer_steep(world: &mut World, entity: Entity, share: f32, relief: &Relief) {
    let has_none = |surface: &CrackSurface| matches!(surface.mask, CrackMaskSource::Auto | CrackMaskSource::None);
    if share <= 0.0 || !world.get::<CrackSurface>(entity).is_some_and(has_none) {
        return;
    }
    let steep = relief.steepness();
    let gray = steep.as_slice().iter().map(|&steep| {
        let value = (f32::from(steep) * share) as u8;
        [value, value, value, 255]
    });
    let Some(mask) = Grid::from_vec(steep.size(), gray.collect()) else { return };
    let Some(mut images) = world.get_resource_mut::<Assets<Image>>() else { return };
    let weak = Some(images.add(image(&mask, TextureFormat::Rgba8UnormSrgb)));
    if let Some(mut surface) = world.get_mut::<CrackSurface>(entity) {
        surface.mask = CrackMaskSource::Images { weak, strong: None, forbidden: None };
    }
}
