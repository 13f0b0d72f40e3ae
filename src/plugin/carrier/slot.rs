//! Materials that can show cracks, and the components that hold them.

use crate::plugin::api::textures::{CrackTextures, Maps};
use crate::shatter::RimLook;
use bevy::{
    asset::{UntypedAssetId, UntypedHandle},
    ecs::component::Mutable,
    math::Affine2,
    prelude::*,
};

/// A material that can show cracks.
pub(crate) trait CrackMaterial: Asset + Clone {
    /// The maps that it knows.
    const MAPS: Maps;
    /// The pictures that it shows: diffuse, normal, depth.
    fn pictures(&self) -> [Option<Handle<Image>>; 3];
    /// Shows the textures that there are; `relief` is how deep a crack is, in units of the surface's shorter side.
    fn show(&mut self, textures: &CrackTextures, relief: f32);
    /// From the mesh's texture coordinates to the picture's.
    fn uv_transform(&self) -> Affine2 {
        Affine2::IDENTITY
    }
    /// Shows the upper half of its textures as if that were all of them.
    fn show_upper_half(&mut self) {}
    /// Shows its textures where the mesh's texture coordinates say.
    fn show_all(&mut self) {}
    /// Becomes transparent where its picture is.
    fn open(&mut self);
    /// Has no holes any more: transparent, and seen from behind, as the original is.
    fn close(&mut self, original: &Self);
    /// Shows its faces from behind as well: through holes, the inside of a body is seen.
    fn show_inside(&mut self) {}
    /// The same for shards: with this picture, the mesh's texture coordinates being the picture's, and so much of it there (0..=1).
    fn for_shards(&mut self, picture: &Handle<Image>, opacity: f32);
    /// The same for the sides of shards, if they have any, with the picture of a [`grain`](crate::plugin::gpu::grain) or without.
    fn for_sides(&self, look: &SideLook, grain: Option<Handle<Image>>) -> Option<Self>;
    /// What the renderer's pipelines for it depend on.
    fn pipeline_key(&self) -> u64;
}

/// What the sides of shards are to look like.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "3d"), expect(dead_code, reason = "only 3D shards have sides"))]
pub(crate) struct SideLook {
    /// The mean colour of the picture, sRGB.
    pub(crate) mean: [f32; 3],
    /// How the rims of the shards look.
    pub(crate) rim: RimLook,
    /// How far texture coordinates of the sides go on for each pattern unit.
    pub(crate) unit: f32,
}

/// The component that holds a material.
pub(crate) trait MaterialSlot: Component<Mutability = Mutable> + From<Handle<Self::Material>> {
    type Material: CrackMaterial;
    /// The component that holds the mesh beside it.
    type Mesh: Component + From<Handle<Mesh>>;
    fn material(&self) -> &Handle<Self::Material>;
    fn set_material(&mut self, material: Handle<Self::Material>);
}

pub(crate) fn mesh_of(world: &World, entity: Entity) -> Option<&Handle<Mesh>> {
    let mesh_2d = world.get::<Mesh2d>(entity).map(|mesh| &mesh.0);
    mesh_2d.or_else(|| world.get::<Mesh3d>(entity).map(|mesh| &mesh.0))
}

/// A handle as one of assets of this type, if it is one.
pub(crate) fn typed<A: Asset>(handle: &UntypedHandle) -> Option<Handle<A>> {
    handle.clone().try_typed().ok()
}

/// Beside a surface whose material, this one, shows the upper half of its textures only.
#[derive(Component)]
#[component(clone_behavior = Ignore)]
pub(super) struct UpperHalf(pub(super) UntypedAssetId);

/// From a mesh's texture coordinates to those of the picture.
pub(super) fn to_picture<S: MaterialSlot>(world: &World, entity: Entity) -> Result<Affine2, &'static str> {
    let material = world.get::<S>(entity).ok_or("the material is gone")?.material();
    let materials = world.get_resource::<Assets<S::Material>>().ok_or("there are no materials")?;
    let transform = materials.get(material).map_or(Affine2::IDENTITY, CrackMaterial::uv_transform);
    if world.get::<UpperHalf>(entity).is_some_and(|upper| upper.0 == material.id().untyped()) {
        return Ok(Affine2::from_scale(Vec2::new(1.0, 2.0)) * transform);
    }
    Ok(transform)
}
