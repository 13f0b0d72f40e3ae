//! Shows a relief that was made.

use super::work::Made;
use crate::plugin::api::{CrackError, CrackMaskSource, CrackSurface};
#[cfg(any(feature = "2d", feature = "3d"))]
use crate::plugin::carrier::slot::{MaterialSlot, typed};
#[cfg(any(feature = "2d", feature = "3d"))]
use crate::plugin::surface::cracked::active;
use bevy::prelude::*;

/// Has the entity show a relief.
pub(super) fn show(world: &mut World, entity: Entity, made: Made) -> Result<(), CrackError> {
    let mut images = world.get_resource_mut::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    let [diffuse, normal] = [made.diffuse, made.normal].map(|image| images.add(image));
    let steep = made.steep.map(|image| images.add(image));
    if !give(world, entity, &diffuse, &normal, made.mesh) {
        return Err(CrackError::NothingToCrack);
    }
    // Unless the surface has a mask of its own.
    if let Some(steep) = steep
        && let Some(mut surface) = world.get_mut::<CrackSurface>(entity)
        && matches!(surface.mask, CrackMaskSource::Auto | CrackMaskSource::None)
    {
        surface.mask = CrackMaskSource::Images { weak: Some(steep), strong: None, forbidden: None };
    }
    Ok(())
}

/// Gives the pictures and the mesh to what the entity has; `false` if that is nothing that shows pictures.
#[cfg_attr(not(feature = "3d"), expect(unused_variables, reason = "what is not there shows nothing"))]
fn give(
    world: &mut World,
    entity: Entity,
    diffuse: &Handle<Image>,
    normal: &Handle<Image>,
    mesh: Option<Mesh>,
) -> bool {
    #[cfg(feature = "2d")]
    {
        if let Some(mut sprite) = world.get_mut::<Sprite>(entity) {
            // A relief is a whole picture.
            (sprite.rect, sprite.texture_atlas) = (None, None);
            sprite.image = diffuse.clone();
            return true;
        }
        if give_material::<MeshMaterial2d<ColorMaterial>>(world, entity, |material| {
            material.texture = Some(diffuse.clone());
        }) || give_material::<MeshMaterial2d<crate::plugin::CrackLitMaterial>>(world, entity, |material| {
            material.diffuse = Some(diffuse.clone());
            material.normal = Some(normal.clone());
        }) {
            return true;
        }
    }
    #[cfg(feature = "3d")]
    if give_material::<MeshMaterial3d<StandardMaterial>>(world, entity, |material| {
        material.base_color_texture = Some(diffuse.clone());
        material.normal_map_texture = Some(normal.clone());
        material.depth_map = None;
    }) {
        give_mesh(world, entity, mesh);
        return true;
    }
    false
}

/// Gives the entity a material like the one that it had before it cracked; `false` if it has none of this kind.
#[cfg(any(feature = "2d", feature = "3d"))]
fn give_material<S: MaterialSlot>(world: &mut World, entity: Entity, change: impl FnOnce(&mut S::Material)) -> bool {
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

/// Puts the mesh of the relief in the place of the entity's, or one with tangents if that has none: normal maps need them.
#[cfg(feature = "3d")]
fn give_mesh(world: &mut World, entity: Entity, made: Option<Mesh>) {
    use crate::plugin::carrier::mesh::{check_for_tangents, lacks_tangents};

    let Some(before) = world.get::<Mesh3d>(entity).map(|mesh| mesh.0.clone()) else { return };
    let Some(mut meshes) = world.get_resource_mut::<Assets<Mesh>>() else { return };
    let with_tangents = || {
        let mesh = meshes.get(&before).filter(|mesh| lacks_tangents(mesh) && check_for_tangents(mesh).is_ok())?;
        mesh.clone().with_generated_tangents().ok()
    };
    let Some(mesh) = made.or_else(with_tangents) else { return };
    let own = meshes.add(mesh);
    if let Some(mut mesh) = world.get_mut::<Mesh3d>(entity) {
        mesh.0 = own;
    }
}
