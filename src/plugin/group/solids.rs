//! What the meshes of a group show.

use crate::plugin::api::{CrackError, CrackGroup};
use crate::plugin::carrier::mesh::Triangles;
use crate::plugin::carrier::slot::CrackMaterial;
use crate::plugin::source::picture::{self, Space};
use crate::unwrap::MAX_TRIANGLES;
use bevy::{
    asset::LoadState,
    camera::visibility::RenderLayers,
    ecs::entity::EntityHashSet,
    image::ImageSampler,
    math::{Affine2, Affine3A},
    prelude::*,
};

/// Meshes of a group and what they show.
#[derive(Default)]
pub(super) struct Solids {
    pub(super) list: Vec<Solid>,
    pub(super) pictures: Vec<Picture>,
    /// What the first one is made of.
    pub(super) material: StandardMaterial,
    /// Which cameras see it.
    pub(super) layers: Option<RenderLayers>,
    /// Why some are left out.
    pub(super) left_out: Option<&'static str>,
}

/// A picture that members show.
pub(super) struct Picture {
    pub(super) handle: Handle<Image>,
    pub(super) space: Space,
    pub(super) sampler: ImageSampler,
    /// Whether its texels are seen as squares.
    pub(super) is_nearest: bool,
}

/// A member and what it shows.
#[derive(Clone)]
pub(super) struct Solid {
    pub(super) entity: Entity,
    /// From its own space to the group's.
    pub(super) place: Affine3A,
    pub(super) mesh: Handle<Mesh>,
    /// The numbers of its picture and of its normal map.
    pub(super) diffuse: Option<usize>,
    pub(super) normal: Option<usize>,
    /// From its texture coordinates to those of its pictures.
    pub(super) to_picture: Affine2,
    /// Red, green, blue, alpha; sRGB.
    pub(super) tint: [f32; 4],
}

/// The place of a member in its group.
pub(super) fn place_in(world: &World, group: Entity, member: Entity) -> Option<Affine3A> {
    let place = |entity| world.get::<GlobalTransform>(entity).map(GlobalTransform::affine);
    Some(place(group).unwrap_or_default().inverse() * place(member)?)
}

impl Solids {
    /// Those of a group as they are now, without `gone`; `None` if something is not there yet.
    pub(super) fn of(world: &World, group: Entity, gone: &EntityHashSet) -> Result<Option<Self>, CrackError> {
        let mut solids = Self::default();
        let Some(members) = world.get::<CrackGroup>(group) else { return Ok(Some(solids)) };
        let place = world.get::<GlobalTransform>(group).map(GlobalTransform::affine).unwrap_or_default();
        if place.matrix3.determinant() == 0.0 || !place.is_finite() {
            return Err(CrackError::Group { reason: "its transform cannot be inverted".into() });
        }
        let mut triangles = 0;
        for member in members.iter().filter(|member| !gone.contains(member)) {
            let Some(place) = place_in(world, group, member) else { continue };
            if !place.is_finite() || place.matrix3.determinant() == 0.0 {
                solids.left_out = Some("its transform has a scale of zero, or is not finite");
                continue;
            }
            let (Some(mesh), Some(material)) =
                (world.get::<Mesh3d>(member), world.get::<MeshMaterial3d<StandardMaterial>>(member))
            else {
                solids.left_out = Some("it has no `Mesh3d` with a `StandardMaterial`");
                continue;
            };
            let meshes = world.get_resource::<Assets<Mesh>>();
            let Some(found) = meshes.and_then(|meshes| meshes.get(&mesh.0)) else {
                if has_failed(world, &mesh.0) {
                    solids.left_out = Some("its mesh could not be loaded");
                    continue;
                }
                return Ok(None);
            };
            match check(found) {
                Ok(count) => triangles += count,
                Err(reason) => {
                    solids.left_out = Some(reason);
                    continue;
                }
            }
            if triangles > MAX_TRIANGLES {
                let reason = format!("its members have more than {MAX_TRIANGLES} triangles");
                return Err(CrackError::Group { reason });
            }
            if !solids.add(world, member, place, mesh, material)? {
                return Ok(None);
            }
        }
        Ok(Some(solids))
    }

    /// How the first picture is sampled: that of the group is so too.
    pub(super) fn sampler(&self) -> ImageSampler {
        let first = self.pictures.iter().find(|picture| picture.space == Space::Srgb);
        first.map_or(ImageSampler::Default, |picture| picture.sampler.clone())
    }

    /// Adds a member; false if its material or a picture is not there yet.
    fn add(
        &mut self,
        world: &World,
        entity: Entity,
        place: Affine3A,
        mesh: &Mesh3d,
        material: &MeshMaterial3d<StandardMaterial>,
    ) -> Result<bool, CrackError> {
        let materials = world.get_resource::<Assets<StandardMaterial>>();
        let Some(material) = materials.and_then(|materials| materials.get(&material.0)) else { return Ok(false) };
        let [diffuse, normal, _] = material.pictures();
        let (diffuse, normal) =
            match (self.picture(world, diffuse, Space::Srgb)?, self.picture(world, normal, Space::Linear)?) {
                (Some(diffuse), Some(normal)) => (diffuse, normal),
                _ => return Ok(false),
            };
        if self.list.is_empty() {
            self.material = StandardMaterial {
                base_color: Color::WHITE,
                base_color_texture: None,
                normal_map_texture: None,
                metallic_roughness_texture: None,
                occlusion_texture: None,
                emissive_texture: None,
                depth_map: None,
                uv_transform: Affine2::IDENTITY,
                ..material.clone()
            };
            self.layers = world.get::<RenderLayers>(entity).cloned();
        }
        self.list.push(Solid {
            entity,
            place,
            mesh: mesh.0.clone(),
            diffuse,
            normal,
            to_picture: material.uv_transform,
            tint: material.base_color.to_srgba().to_f32_array(),
        });
        Ok(true)
    }

    /// The number of a picture if there is one; `None` if it is not there yet.
    fn picture(
        &mut self,
        world: &World,
        picture: Option<Handle<Image>>,
        space: Space,
    ) -> Result<Option<Option<usize>>, CrackError> {
        let Some(handle) = picture else { return Ok(Some(None)) };
        if !picture::is_loaded(world, &handle)? {
            return Ok(None);
        }
        let Some(image) = world.get_resource::<Assets<Image>>().and_then(|images| images.get(&handle)) else {
            return Ok(None);
        };
        picture::readable_size(image)?;
        let known = self.pictures.iter().position(|known| known.handle == handle && known.space == space);
        let number = known.unwrap_or_else(|| {
            let is_nearest = picture::is_nearest(world, image);
            self.pictures.push(Picture { handle, space, sampler: image.sampler.clone(), is_nearest });
            self.pictures.len() - 1
        });
        Ok(Some(Some(number)))
    }
}

/// Whether a mesh can be put together with others; its number of triangles.
fn check(mesh: &Mesh) -> Result<usize, &'static str> {
    let triangles = Triangles::of(mesh)?;
    if !triangles.positions().all(|at| at.is_finite() && at.abs().max_element() < FARTHEST) {
        return Err("a position of its mesh is not finite, or too far away");
    }
    let is_there =
        |i: usize| triangles.corners(i).is_some_and(|corners| corners.iter().all(|i| *i < triangles.vertices()));
    if !(0..triangles.len()).all(is_there) {
        return Err("a triangle of its mesh names a vertex that is not there");
    }
    Ok(triangles.len())
}

/// Positions of meshes lie within this.
const FARTHEST: f32 = 1e6;

fn has_failed(world: &World, mesh: &Handle<Mesh>) -> bool {
    let state = world.get_resource::<AssetServer>().and_then(|server| server.get_load_state(mesh));
    matches!(state, Some(LoadState::Failed(_)))
}
