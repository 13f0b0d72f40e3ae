//! Meshes with a material as carriers.

#[cfg(feature = "3d")]
use super::kind::UnfoldOrder;
use super::kind::{Carrier, CarrierKind, Found, NextLook, Shown};
use super::mesh::{aspect_of, check_for_tangents, closest, is_flat, lacks_tangents, place_of, wrap};
use super::pipelines::{self, Shape};
use super::plane::Plane;
use super::shard_visual::{MaterialVisuals, ShardVisuals};
use super::slot::{CrackMaterial, MaterialSlot, SideLook, mesh_of, to_picture, typed};
#[cfg(feature = "3d")]
use super::{split, unfold};
use crate::plugin::api::error::CrackError;
#[cfg(feature = "3d")]
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::hit::HitPoint;
use crate::plugin::api::textures::{CrackTextures, Maps};
use crate::plugin::gpu::grain;
#[cfg(feature = "3d")]
use crate::plugin::source::unfolding::Unfolding;
use crate::raster::TexelRect;
use crate::shatter::RimLook;
#[cfg(feature = "3d")]
use crate::shatter::ShellTriangle;
use bevy::{
    asset::{LoadState, UntypedHandle},
    math::Mat3A,
    prelude::*,
};
use core::marker::PhantomData;
#[cfg(feature = "3d")]
use std::sync::Arc;

const NOT_FLAT: &str =
    "its mesh is neither flat nor a slab, which is a box at least four times as wide and high as thick";

/// Meshes whose material is in the component `S`.
pub(super) struct MaterialKind<S>(PhantomData<S>);

impl<S> MaterialKind<S> {
    pub(super) const NEW: Self = Self(PhantomData);
}

impl<S: MaterialSlot> CarrierKind for MaterialKind<S> {
    fn inspect(&self, world: &World, entity: Entity) -> Found {
        let Some(slot) = world.get::<S>(entity) else { return Found::Other };
        let Some(materials) = world.get_resource::<Assets<S::Material>>() else {
            return Found::Unusable(CrackError::NoMaterials { material: S::Material::short_type_path().to_owned() });
        };
        let Some(material) = materials.get(slot.material()).filter(|_| !is_mesh_loading(world, entity)) else {
            return Found::Waiting;
        };
        let [diffuse, normal, depth] = material.pictures();
        Found::Shown(Box::new(Shown {
            asset: slot.material().clone().untyped(),
            diffuse,
            normal,
            depth,
            rect: None,
            layout: None,
            size: None,
            maps: S::Material::MAPS,
        }))
    }

    fn attach(&self, world: &mut World, entity: Entity, carrier: &mut Carrier, textures: &CrackTextures, relief: f32) {
        let Some(before) = typed::<S::Material>(&carrier.shown.asset) else { return };
        let Some(mut materials) = world.get_resource_mut::<Assets<S::Material>>() else { return };
        let Some(mut material) = materials.get(&before).cloned() else { return };
        material.show(textures, relief);
        if carrier.is_twofold {
            material.show_upper_half();
        }
        if carrier.unfolding.is_some() {
            material.show_all();
        }
        let own = carrier.own.as_ref().and_then(typed::<S::Material>).unwrap_or_else(|| materials.reserve_handle());
        // A handle that we hold is never refused.
        if materials.insert(&own, material).is_err() {
            return;
        }
        carrier.own = Some(own.clone().untyped());
        if let Some(mut slot) = world.get_mut::<S>(entity) {
            slot.set_material(own);
        }
        #[cfg(feature = "3d")]
        unfold::show(world, entity, carrier);
        #[cfg(feature = "3d")]
        if S::Material::MAPS.depth && carrier.mesh.is_none() && (textures.normal.is_some() || textures.depth.is_some())
        {
            carrier.mesh = give_tangents(world, entity);
        }
        #[cfg(feature = "3d")]
        split::give_faces::<S>(world, entity, carrier);
    }

    fn detach(&self, world: &mut World, entity: Entity, carrier: &Carrier) {
        if let Some(mut slot) = world.get_mut::<S>(entity)
            && carrier.is_showing(&slot.material().clone().untyped())
            && let Some(before) = typed(&carrier.shown.asset)
        {
            slot.set_material(before);
        }
        if let Some((before, own)) = &carrier.mesh
            && let Some(mut mesh) = world.get_mut::<Mesh3d>(entity)
            && mesh.0 == *own
        {
            mesh.0 = before.clone();
        }
        #[cfg(feature = "3d")]
        {
            split::forget(world, entity);
            unfold::forget(world, entity);
        }
    }

    fn can_draw(&self, world: &mut World, entity: Entity, look: &NextLook<'_>) -> bool {
        let Some(materials) = world.get_resource::<Assets<S::Material>>() else { return true };
        let Some(now) = world.get::<S>(entity).and_then(|slot| materials.get(slot.material())) else { return true };
        // Any picture will do, and the engine's white one is there.
        let (white, is_solid) = (Handle::<Image>::default(), S::Material::MAPS.depth);
        let textures = |maps: &Maps| CrackTextures {
            diffuse: (maps.diffuse && S::Material::MAPS.diffuse).then(|| white.clone()),
            normal: (maps.normal && S::Material::MAPS.normal).then(|| white.clone()),
            depth: (maps.depth && S::Material::MAPS.depth).then(|| white.clone()),
            emissive: (maps.emissive && S::Material::MAPS.emissive).then(|| white.clone()),
        };
        let own = Shape::Own { has_tangents: is_solid };
        let mut cracked = now.clone();
        match look {
            NextLook::Cracked(maps) => {
                cracked.show(&textures(maps), 0.0);
                let is_as_before = !is_solid && cracked.pipeline_key() == now.pipeline_key();
                is_as_before || pipelines::can_draw::<S>(world, entity, cracked, &own)
            }
            NextLook::Broken { maps, original, has_rims, inside } => {
                cracked.show(&textures(maps), 0.0);
                let read = |material: &UntypedHandle| materials.get(&material.clone().try_typed().ok()?);
                let sides = match inside {
                    Some(inside) => read(inside).cloned(),
                    None => read(original).and_then(|before| {
                        before.for_sides(&SideLook { mean: [0.0; 3], rim: RimLook::PLAIN, unit: 1.0 }, None)
                    }),
                };
                cracked.open();
                if self.unfolding(world, entity).is_some() {
                    cracked.show_inside();
                }
                let mut shard = cracked.clone();
                shard.for_shards(&white, 1.0);
                let shape = Shape::Shard { has_colors: *has_rims, has_tangents: is_solid };
                let bare = Shape::Shard { has_colors: false, has_tangents: true };
                // All of them, that they come at once.
                let has_surface = pipelines::can_draw::<S>(world, entity, cracked, &own);
                let has_shards = pipelines::can_draw::<S>(world, entity, shard, &shape);
                let has_sides =
                    !is_solid || sides.is_none_or(|sides| pipelines::can_draw::<S>(world, entity, sides, &bare));
                has_surface && has_shards && has_sides
            }
        }
    }

    fn aspect(&self, world: &World, entity: Entity, _: Option<Vec2>, _: Option<Vec2>) -> Option<f32> {
        let mesh = world.get_resource::<Assets<Mesh>>()?.get(mesh_of(world, entity)?)?;
        world.get_resource::<Assets<S::Material>>()?.get(world.get::<S>(entity)?.material())?;
        let place = world.get::<GlobalTransform>(entity).map_or(Mat3A::IDENTITY, |place| place.affine().matrix3);
        aspect_of(mesh, place, to_picture::<S>(world, entity).ok()?)
    }

    fn is_twofold(&self, world: &World, entity: Entity) -> bool {
        #[cfg(feature = "3d")]
        if S::Material::MAPS.depth {
            return unfold::unfolding(world, entity).is_none() && split::shares_its_picture::<S>(world, entity);
        }
        let _ = (world, entity);
        false
    }

    #[cfg(feature = "3d")]
    fn poll_unfold(&self, world: &mut World, entity: Entity) -> Option<bool> {
        if S::Material::MAPS.depth { unfold::poll(world, entity) } else { Some(true) }
    }

    #[cfg(feature = "3d")]
    fn unfold(&self, world: &mut World, entity: Entity, order: &UnfoldOrder) -> bool {
        unfold::prepare::<S>(world, entity, order)
    }

    #[cfg(feature = "3d")]
    fn forget_layout(&self, world: &mut World, entity: Entity) {
        if S::Material::MAPS.depth {
            unfold::forget_own(world, entity);
        }
    }

    #[cfg(feature = "3d")]
    fn unfolding(&self, world: &World, entity: Entity) -> Option<Arc<Unfolding>> {
        unfold::unfolding(world, entity).filter(|_| S::Material::MAPS.depth)
    }

    fn aim(&self, world: &mut World, entity: Entity, at: HitPoint, point: Option<Vec3>, is_blank: bool) -> HitPoint {
        #[cfg(feature = "3d")]
        if let Some(at) =
            unfold::aim(world, entity, at, point).or_else(|| split::aim(world, entity, at, point, is_blank))
        {
            return at;
        }
        let _ = (world, entity, point, is_blank);
        at
    }

    fn locate(&self, world: &World, entity: Entity, local: Vec3, _: Option<UVec2>) -> Result<Vec2, &'static str> {
        let mesh = mesh_of(world, entity).ok_or("there is no mesh")?;
        let meshes = world.get_resource::<Assets<Mesh>>().ok_or("there are no mesh assets")?;
        let transform = to_picture::<S>(world, entity)?;
        #[cfg(feature = "3d")]
        if let Some(uv) = split::locate(world, entity, meshes, local)? {
            return Ok(transform.transform_point2(uv).clamp(Vec2::ZERO, Vec2::ONE));
        }
        let (_, uv) = closest(meshes.get(mesh).ok_or("the mesh is not loaded")?, local)?;
        Ok(wrap(transform.transform_point2(uv)))
    }

    /// Whether tangents can be made for a mesh that has none.
    fn check_mesh(&self, world: &World, entity: Entity) -> Result<(), CrackError> {
        let meshes = world.get_resource::<Assets<Mesh>>();
        match meshes.and_then(|meshes| meshes.get(mesh_of(world, entity)?)) {
            Some(mesh) if S::Material::MAPS.depth && lacks_tangents(mesh) => {
                check_for_tangents(mesh).map_err(|reason| CrackError::Mesh { reason })
            }
            _ => Ok(()),
        }
    }

    fn plane(&self, world: &World, entity: Entity, _: TexelRect) -> Result<Plane, &'static str> {
        let mesh = mesh_of(world, entity).ok_or("there is no mesh")?;
        let mesh =
            world.get_resource::<Assets<Mesh>>().and_then(|meshes| meshes.get(mesh)).ok_or("its mesh is not loaded")?;
        #[cfg(feature = "3d")]
        if unfold::unfolding(world, entity).is_some() {
            return Err(NOT_FLAT);
        }
        let transform = to_picture::<S>(world, entity)?;
        if transform.matrix2.determinant() == 0.0 {
            return Err("its material shows one line of the picture only");
        }
        let to_mesh = transform.inverse();
        let corner = |u, v| place_of(mesh, to_mesh.transform_point2(Vec2::new(u, v))).ok_or("its mesh lacks a corner");
        let (first, normal) = corner(0.0, 0.0)?;
        let plane = Plane::through([first, corner(1.0, 0.0)?.0, corner(0.0, 1.0)?.0, corner(1.0, 1.0)?.0], normal)?;
        #[cfg(feature = "3d")]
        if let Some(thickness) = split::thickness(world, entity) {
            return Ok(Plane { thickness: Some(thickness), ..plane });
        }
        if !is_flat(mesh, first, normal) {
            return Err(NOT_FLAT);
        }
        Ok(plane)
    }

    #[cfg(feature = "3d")]
    fn plane_at(&self, world: &World, entity: Entity, texel: Vec2) -> Option<Plane> {
        unfold::plane_at(world, entity, texel)
    }

    #[cfg(feature = "3d")]
    fn triangles(&self, world: &World, entity: Entity) -> Option<Vec<ShellTriangle>> {
        unfold::triangles(world, entity)
    }

    #[cfg(feature = "3d")]
    fn texel_of(&self, world: &World, entity: Entity, uv: Vec2) -> Option<Vec2> {
        unfold::texel_of(world, entity, uv)
    }

    #[cfg_attr(not(feature = "3d"), expect(unused_variables, reason = "only 3D meshes have sides"))]
    fn open(&self, world: &mut World, entity: Entity, carrier: &Carrier, has_holes: bool) {
        #[cfg(feature = "3d")]
        split::open(world, entity, has_holes);
        let (Some(own), Some(mut materials)) = (&carrier.own, world.get_resource_mut::<Assets<S::Material>>()) else {
            return;
        };
        let original = if has_holes { None } else { typed(&carrier.shown.asset) };
        let original = original.and_then(|original| materials.get(&original)).cloned();
        let Some(mut material) = typed(own).and_then(|own| materials.get_mut(&own)) else { return };
        if let Some(original) = original {
            material.close(&original);
        } else if has_holes {
            material.open();
            if carrier.unfolding.is_some() {
                material.show_inside();
            }
        }
    }

    fn shard_material(
        &self,
        world: &mut World,
        _entity: Entity,
        carrier: &Carrier,
        picture: &Handle<Image>,
        opacity: f32,
    ) -> Option<UntypedHandle> {
        let mut materials = world.get_resource_mut::<Assets<S::Material>>()?;
        let own = typed(carrier.own.as_ref().unwrap_or(&carrier.shown.asset))?;
        let mut material = materials.get(&own)?.clone();
        material.for_shards(picture, opacity);
        Some(materials.add(material).untyped())
    }

    fn side_material(&self, world: &mut World, carrier: &Carrier, look: &SideLook) -> Option<UntypedHandle> {
        if !S::Material::MAPS.depth {
            return None;
        }
        // What is drawn is flat, and glass clear.
        let has_grain = look.rim.bright < 0.0;
        let grain = if has_grain { grain::picture(world) } else { None };
        let mut materials = world.get_resource_mut::<Assets<S::Material>>()?;
        let inside = materials.get(&typed(&carrier.shown.asset)?)?.for_sides(look, grain)?;
        Some(materials.add(inside).untyped())
    }

    fn is_solid(&self) -> bool {
        S::Material::MAPS.depth
    }

    fn shards(&self) -> &'static dyn ShardVisuals {
        &MaterialVisuals::<S>::NEW
    }
}

/// Whether the mesh of an entity is on its way. Hits wait for it: where they land, and tangents, are found on it.
fn is_mesh_loading(world: &World, entity: Entity) -> bool {
    let server = world.get_resource::<AssetServer>();
    let state = server.zip(mesh_of(world, entity)).and_then(|(server, mesh)| server.get_load_state(mesh));
    matches!(state, Some(LoadState::NotLoaded | LoadState::Loading))
}

/// Normal and depth maps show nothing on a mesh without tangents: such a mesh is replaced by one that has them.
#[cfg(feature = "3d")]
fn give_tangents(world: &mut World, entity: Entity) -> Option<(Handle<Mesh>, Handle<Mesh>)> {
    let before = world.get::<Mesh3d>(entity)?.0.clone();
    let mut meshes = world.get_resource_mut::<Assets<Mesh>>()?;
    let mesh = meshes.get(&before)?;
    if !lacks_tangents(mesh) {
        return None;
    }
    // It may be another one than when the surface was planned.
    let made = check_for_tangents(mesh)
        .and_then(|()| mesh.clone().with_generated_tangents().map_err(|error| error.to_string()));
    match made {
        Ok(mesh) => {
            let own = meshes.add(mesh);
            world.get_mut::<Mesh3d>(entity)?.0 = own.clone();
            Some((before, own))
        }
        Err(error) => {
            let surface = EntityLabel::of(world, entity);
            warn!("the normals of the cracks on {surface} will not show, its mesh has no tangents: {error}");
            None
        }
    }
}
