//! The copy of a mesh whose faces share the picture: only one of them shows the half of the textures that cracks.

use super::faces::Faces;
use super::kind::Carrier;
use super::mesh::closest;
use super::slot::{CrackMaterial, MaterialSlot, UpperHalf, to_picture, typed};
use crate::plugin::api::hit::HitPoint;
use bevy::{math::Affine2, prelude::*};
use std::sync::Arc;

/// Beside a surface whose textures hold its picture twice.
#[derive(Component)]
#[component(clone_behavior = Ignore)]
struct Twofold {
    /// `None` if its faces cannot be told apart any more.
    split: Option<Split>,
}

struct Split {
    faces: Arc<Faces>,
    /// The mesh as it was.
    before: Handle<Mesh>,
    own: Handle<Mesh>,
    to_picture: Affine2,
    /// The face that cracks.
    face: u32,
    /// Whether holes go through it.
    is_open: bool,
}

/// What an entity shows, if that is the copy.
fn split_of(world: &World, entity: Entity) -> Option<&Split> {
    let split = world.get::<Twofold>(entity)?.split.as_ref()?;
    (world.get::<Mesh3d>(entity)?.0 == split.own).then_some(split)
}

/// Whether faces of the mesh share the picture.
pub(super) fn shares_its_picture<S: MaterialSlot>(world: &World, entity: Entity) -> bool {
    if split_of(world, entity).is_some() {
        return true;
    }
    let mesh = world.get::<Mesh3d>(entity).and_then(|mesh| world.get_resource::<Assets<Mesh>>()?.get(&mesh.0));
    let Some((mesh, to_picture)) = mesh.zip(to_picture::<S>(world, entity).ok()) else { return false };
    Faces::of(mesh, to_picture, scale(world, entity)).is_some()
}

fn scale(world: &World, entity: Entity) -> Vec3 {
    let axes = world.get::<GlobalTransform>(entity).copied().unwrap_or_default().affine().matrix3;
    Vec3::new(axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length())
}

/// Gives an entity the copy, or a new one of another material's.
pub(super) fn give_faces<S: MaterialSlot>(world: &mut World, entity: Entity, carrier: &mut Carrier) {
    let Some(material) = carrier.own.as_ref().filter(|_| carrier.is_twofold).map(|own| own.id()) else {
        forget(world, entity);
        return;
    };
    let split = new_split::<S>(world, entity, carrier);
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.insert((UpperHalf(material), Twofold { split }));
    }
    show(world, entity);
}

fn new_split<S: MaterialSlot>(world: &mut World, entity: Entity, carrier: &mut Carrier) -> Option<Split> {
    let shown = world.get::<Mesh3d>(entity)?.0.clone();
    let known = split_of(world, entity).map(|split| (split.before.clone(), split.face, split.is_open));
    let own = carrier.mesh.as_ref().filter(|(_, own)| *own == shown);
    let before = own.map_or_else(|| shown.clone(), |(before, _)| before.clone());
    let materials = world.get_resource::<Assets<S::Material>>()?;
    let to_picture = materials.get(&typed(&carrier.shown.asset)?)?.uv_transform();
    let mesh = world.get_resource::<Assets<Mesh>>()?.get(&before)?;
    let faces = Arc::new(Faces::of(mesh, to_picture, scale(world, entity))?);
    let (face, is_open) = known
        .filter(|(known, ..)| *known == before)
        .map_or_else(|| (faces.first(), false), |(_, face, is_open)| (face, is_open));
    let own = match own {
        Some((_, own)) => own.clone(),
        None => {
            let copy = mesh.clone();
            let own = world.get_resource_mut::<Assets<Mesh>>()?.add(copy);
            world.get_mut::<Mesh3d>(entity)?.0 = own.clone();
            carrier.mesh = Some((before.clone(), own.clone()));
            own
        }
    };
    Some(Split { faces, before, own, to_picture, face, is_open })
}

/// Has the copy show what it is to.
fn show(world: &mut World, entity: Entity) {
    let Some(Split { faces, before, own, to_picture, face, is_open }) = split_of(world, entity) else { return };
    let (faces, before, own, to_picture) = (faces.clone(), before.clone(), own.clone(), *to_picture);
    let (face, is_open) = (*face, *is_open);
    let Some(mut meshes) = world.get_resource_mut::<Assets<Mesh>>() else { return };
    let uvs = meshes.get(&before).and_then(|mesh| mesh.try_attribute_option(Mesh::ATTRIBUTE_UV_0).ok().flatten());
    let Some(uvs) = uvs.cloned() else { return };
    let Some(mut mesh) = meshes.get_mut(&own) else { return };
    if mesh.try_insert_attribute(Mesh::ATTRIBUTE_UV_0, uvs).is_ok() {
        faces.split(&mut mesh, face, is_open, to_picture);
    }
}

/// The entity shows the mesh that it had.
pub(super) fn forget(world: &mut World, entity: Entity) {
    if world.get::<Twofold>(entity).is_some()
        && let Ok(mut entity) = world.get_entity_mut(entity)
    {
        entity.remove::<(UpperHalf, Twofold)>();
    }
}

/// Says where a hit lands on a mesh with a copy; the first chooses the face that cracks.
pub(super) fn aim(
    world: &mut World,
    entity: Entity,
    at: HitPoint,
    point: Option<Vec3>,
    is_blank: bool,
) -> Option<HitPoint> {
    let split = split_of(world, entity)?;
    let point = match at {
        HitPoint::Local(point) => point,
        _ => point?,
    };
    let (triangle, _) = closest(world.get_resource::<Assets<Mesh>>()?.get(&split.before)?, point).ok()?;
    let face = split.faces.face(triangle);
    if is_blank && face != split.face {
        if let Some(split) = world.get_mut::<Twofold>(entity)?.split.as_mut() {
            split.face = face;
        }
        show(world, entity);
    }
    Some(HitPoint::Local(point))
}

/// Texture coordinates of a point on a mesh with a copy; `None` if there is none.
pub(super) fn locate(
    world: &World,
    entity: Entity,
    meshes: &Assets<Mesh>,
    point: Vec3,
) -> Result<Option<Vec2>, &'static str> {
    let Some(split) = split_of(world, entity) else { return Ok(None) };
    let Some(before) = meshes.get(&split.before) else { return Ok(None) };
    let (triangle, uv) = closest(before, point)?;
    if split.faces.face(triangle) != split.face {
        return Err(
            "it lands on another face than its cracks: where faces of a mesh share texture coordinates, only the one that \
                    is hit first cracks",
        );
    }
    Ok(Some(split.faces.uv_of_slab(point).unwrap_or(uv)))
}

/// How thick the mesh is, if it is a slab.
pub(super) fn thickness(world: &World, entity: Entity) -> Option<f32> {
    split_of(world, entity)?.faces.slab().map(|slab| slab.thickness)
}

/// Lets the narrow sides of a slab go where it has holes.
pub(super) fn open(world: &mut World, entity: Entity, has_holes: bool) {
    if let Some(mut twofold) = world.get_mut::<Twofold>(entity)
        && let Some(split) = twofold.split.as_mut().filter(|split| split.is_open != has_holes)
    {
        split.is_open = has_holes;
        show(world, entity);
    }
}
