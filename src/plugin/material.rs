//! Meshes with a material as carriers.

use super::{
    CrackError, CrackMaps, CrackTextures,
    carrier::{Carrier, Found, Kind, Shown},
    mesh::{closest_uv, wrap},
};
use bevy::{ecs::component::Mutable, math::Affine2, prelude::*};

/// A material that can show cracks.
pub(super) trait CrackMaterial: Asset + Clone {
    /// The maps that it knows.
    const MAPS: CrackMaps;
    /// The pictures that it shows: diffuse, normal, depth.
    fn pictures(&self) -> [Option<Handle<Image>>; 3];
    /// Shows the textures that there are; `relief` is how deep a crack is, in units of the surface's shorter side.
    fn show(&mut self, textures: &CrackTextures, relief: f32);
    /// From the mesh's texture coordinates to the picture's.
    fn uv_transform(&self) -> Affine2 {
        Affine2::IDENTITY
    }
}

/// The component that holds a material.
pub(super) trait MaterialSlot: Component<Mutability = Mutable> {
    type Material: CrackMaterial;
    fn material(&self) -> &Handle<Self::Material>;
    fn set_material(&mut self, material: Handle<Self::Material>);
}

/// How to deal with meshes whose material is in the component `S`.
pub(super) const fn kind<S: MaterialSlot>() -> Kind {
    Kind { inspect: inspect::<S>, attach: attach::<S>, detach: detach::<S>, locate: locate::<S> }
}

fn inspect<S: MaterialSlot>(world: &World, entity: Entity) -> Found {
    let Some(slot) = world.get::<S>(entity) else { return Found::Other };
    let Some(materials) = world.get_resource::<Assets<S::Material>>() else {
        return Found::Unusable(CrackError::NoMaterials { material: S::Material::short_type_path().to_owned() });
    };
    let Some(material) = materials.get(slot.material()) else { return Found::Waiting };
    let [diffuse, normal, depth] = material.pictures();
    Found::Shown(Box::new(Shown {
        asset: slot.material().clone().untyped(),
        diffuse,
        normal,
        depth,
        rect: None,
        proportions: Vec2::ONE,
        maps: S::Material::MAPS,
    }))
}

fn attach<S: MaterialSlot>(
    world: &mut World,
    entity: Entity,
    carrier: &mut Carrier,
    textures: &CrackTextures,
    relief: f32,
) {
    let before = carrier.shown.asset.clone().typed::<S::Material>();
    let Some(mut materials) = world.get_resource_mut::<Assets<S::Material>>() else { return };
    let Some(mut material) = materials.get(&before).cloned() else { return };
    material.show(textures, relief);
    let own = match &carrier.own {
        Some(own) => own.clone().typed::<S::Material>(),
        None => materials.reserve_handle(),
    };
    // A handle that we hold is never refused.
    if materials.insert(&own, material).is_err() {
        return;
    }
    carrier.own = Some(own.clone().untyped());
    if let Some(mut slot) = world.get_mut::<S>(entity) {
        slot.set_material(own);
    }
    #[cfg(feature = "3d")]
    if S::Material::MAPS.depth && carrier.mesh.is_none() {
        carrier.mesh = give_tangents(world, entity);
    }
}

/// Normal and depth maps show nothing on a mesh without tangents: such a mesh is replaced by one that has them.
#[cfg(feature = "3d")]
fn give_tangents(world: &mut World, entity: Entity) -> Option<(Handle<Mesh>, Handle<Mesh>)> {
    let before = world.get::<Mesh3d>(entity)?.0.clone();
    let mut meshes = world.get_resource_mut::<Assets<Mesh>>()?;
    let mesh = meshes.get(&before)?;
    if !matches!(mesh.try_attribute_option(Mesh::ATTRIBUTE_TANGENT), Ok(None)) {
        return None;
    }
    match mesh.clone().with_generated_tangents() {
        Ok(mesh) => {
            let own = meshes.add(mesh);
            world.get_mut::<Mesh3d>(entity)?.0 = own.clone();
            Some((before, own))
        }
        Err(error) => {
            warn!("the normals of the cracks on {entity} will not show, its mesh has no tangents: {error}");
            None
        }
    }
}

fn detach<S: MaterialSlot>(world: &mut World, entity: Entity, carrier: &Carrier) {
    if let Some(mut slot) = world.get_mut::<S>(entity)
        && carrier.is_showing(&slot.material().clone().untyped())
    {
        slot.set_material(carrier.shown.asset.clone().typed());
    }
    if let Some((before, own)) = &carrier.mesh
        && let Some(mut mesh) = world.get_mut::<Mesh3d>(entity)
        && mesh.0 == *own
    {
        mesh.0 = before.clone();
    }
}

fn locate<S: MaterialSlot>(world: &World, entity: Entity, local: Vec3) -> Result<Vec2, &'static str> {
    let mesh_2d = world.get::<Mesh2d>(entity).map(|mesh| &mesh.0);
    let mesh = mesh_2d.or_else(|| world.get::<Mesh3d>(entity).map(|mesh| &mesh.0)).ok_or("there is no mesh")?;
    let meshes = world.get_resource::<Assets<Mesh>>().ok_or("there are no mesh assets")?;
    let uv = closest_uv(meshes.get(mesh).ok_or("the mesh is not loaded")?, local)?;
    let material = world.get::<S>(entity).ok_or("the material is gone")?;
    let materials = world.get_resource::<Assets<S::Material>>().ok_or("there are no materials")?;
    let transform = materials.get(material.material()).map_or(Affine2::IDENTITY, CrackMaterial::uv_transform);
    Ok(wrap(transform.transform_point2(uv)))
}

#[cfg(feature = "2d")]
mod flat {
    use super::{Affine2, CrackMaps, CrackMaterial, CrackTextures, Handle, Image, MaterialSlot};
    use bevy::prelude::{ColorMaterial, MeshMaterial2d};

    impl CrackMaterial for ColorMaterial {
        const MAPS: CrackMaps = CrackMaps { diffuse: true, normal: true, depth: false };

        fn pictures(&self) -> [Option<Handle<Image>>; 3] {
            [self.texture.clone(), None, None]
        }

        fn show(&mut self, textures: &CrackTextures, _relief: f32) {
            if let Some(diffuse) = &textures.diffuse {
                self.texture = Some(diffuse.clone());
            }
        }

        fn uv_transform(&self) -> Affine2 {
            self.uv_transform
        }
    }

    impl MaterialSlot for MeshMaterial2d<ColorMaterial> {
        type Material = ColorMaterial;

        fn material(&self) -> &Handle<ColorMaterial> {
            &self.0
        }

        fn set_material(&mut self, material: Handle<ColorMaterial>) {
            self.0 = material;
        }
    }
}

#[cfg(feature = "3d")]
mod standard {
    use super::{Affine2, CrackMaps, CrackMaterial, CrackTextures, Handle, Image, MaterialSlot};
    use bevy::{
        pbr::ParallaxMappingMethod,
        prelude::{MeshMaterial3d, StandardMaterial},
    };

    impl CrackMaterial for StandardMaterial {
        const MAPS: CrackMaps = CrackMaps { diffuse: true, normal: true, depth: true };

        fn pictures(&self) -> [Option<Handle<Image>>; 3] {
            [self.base_color_texture.clone(), self.normal_map_texture.clone(), self.depth_map.clone()]
        }

        fn show(&mut self, textures: &CrackTextures, relief: f32) {
            if let Some(diffuse) = &textures.diffuse {
                self.base_color_texture = Some(diffuse.clone());
            }
            if let Some(normal) = &textures.normal {
                self.normal_map_texture = Some(normal.clone());
            }
            let Some(depth) = &textures.depth else { return };
            if self.depth_map.is_none() {
                // Half of what the normals say: seen from the side, deeper cracks swim.
                self.parallax_depth_scale = 0.5 * relief;
                self.parallax_mapping_method = ParallaxMappingMethod::Relief { max_steps: 5 };
                self.max_parallax_layer_count = 32.0;
            }
            self.depth_map = Some(depth.clone());
        }

        fn uv_transform(&self) -> Affine2 {
            self.uv_transform
        }
    }

    impl MaterialSlot for MeshMaterial3d<StandardMaterial> {
        type Material = StandardMaterial;

        fn material(&self) -> &Handle<StandardMaterial> {
            &self.0
        }

        fn set_material(&mut self, material: Handle<StandardMaterial>) {
            self.0 = material;
        }
    }
}
