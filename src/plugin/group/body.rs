//! The mesh of a group: members, put together and laid out flat by a task.

use super::solids::{Picture, Solid, Solids};
use super::tint::Tint;
use crate::plugin::api::{CrackError, HitPoint};
use crate::plugin::carrier::kind::UnfoldOrder;
use crate::plugin::carrier::mesh::{Triangles, check_for_tangents};
use crate::plugin::carrier::unfold::{Flat, Flattening, flat_mesh};
use crate::plugin::jobs::stepped::{Step, Stepped};
use crate::plugin::source::picture::{self, Sampling};
use crate::plugin::source::unfolding::Unfolding;
use crate::unwrap::MeshShape;
use bevy::{
    asset::RenderAssetUsages,
    mesh::{PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use std::{ops::Range, sync::Arc, vec};

/// Texels that a step puts in place, about.
const SLICE: usize = 1 << 15;

/// A normal that is not tilted.
const FLAT: [u8; 4] = [128, 128, 255, 255];

/// What a task makes of the members of a group.
pub(super) struct MadeBody {
    pub(super) mesh: Box<Mesh>,
    /// The same, to be shown until it is cracked.
    pub(super) before: Mesh,
    pub(super) unfolding: Arc<Unfolding>,
    /// The triangles of each member.
    pub(super) triangles: Vec<Range<usize>>,
    /// RGBA8: the picture in sRGB, and normals if any member has some.
    pub(super) diffuse: Vec<u8>,
    pub(super) normal: Option<Vec<u8>>,
}

/// A picture that texels are read from.
struct Source {
    size: UVec2,
    /// RGBA8.
    texels: Vec<u8>,
    sampling: Sampling,
    is_nearest: bool,
}

impl Source {
    fn read(mut image: Image, of: &Picture) -> Result<Self, CrackError> {
        image.sampler = of.sampler.clone();
        let size = picture::readable_size(&image)?;
        let sampling = Sampling::of(&image, of.space);
        let texels = picture::read_colors(&image, of.space, size)?;
        Ok(Self { size, texels, sampling, is_nearest: of.is_nearest })
    }

    /// The colour of a texel of the layout.
    fn texel(&self, unfolding: &Unfolding, texel: UVec2) -> [u8; 4] {
        let place = unfolding.place(texel, self.size);
        let place = if self.is_nearest { place.floor() + 0.5 } else { place };
        self.sampling.texel(&self.texels, self.size, place)
    }
}

/// The making of the mesh and the pictures of a group.
pub(super) struct BodyWork {
    solids: Vec<Solid>,
    meshes: Vec<Mesh>,
    pictures: vec::IntoIter<Picture>,
    copies: vec::IntoIter<Image>,
    sources: Vec<Source>,
    order: UnfoldOrder,
    /// Of the group.
    scale: Vec3,
    laid: Option<Laid>,
}

/// What is laid out.
struct Laid {
    mesh: Mesh,
    triangles: Vec<Range<usize>>,
    /// The member of each triangle.
    owner: Vec<u32>,
    /// To the pictures of members.
    to_pictures: Unfolding,
    /// To the picture of the group.
    unfolding: Unfolding,
    diffuse: Vec<u8>,
    normal: Option<Vec<u8>>,
    tint: Tint,
    done: usize,
}

impl BodyWork {
    /// `meshes` are those of the members, `copies` their pictures.
    pub(super) fn new(solids: Solids, meshes: Vec<Mesh>, copies: Vec<Image>, order: UnfoldOrder, scale: Vec3) -> Self {
        Self {
            solids: solids.list,
            meshes,
            pictures: solids.pictures.into_iter(),
            copies: copies.into_iter(),
            sources: Vec::new(),
            order,
            scale,
            laid: None,
        }
    }

    fn lay_out(&mut self) -> Result<Laid, CrackError> {
        let failed = |reason: String| CrackError::Group { reason };
        let mut joined = Joined::default();
        for (i, (solid, mesh)) in (0..).zip(self.solids.iter().zip(&self.meshes)) {
            joined.add(i, solid, mesh).map_err(|reason| failed(reason.into()))?;
        }
        let positions: Vec<Vec3> = joined.positions.iter().map(|at| Vec3::from_array(*at) * self.scale).collect();
        let corners: Vec<[u32; 3]> = (0..joined.owner.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let shape = MeshShape::new(&positions, &corners).map_err(|error| failed(error.to_string()))?;
        let around = match self.order.hit {
            Some((HitPoint::Local(point), _) | (_, Some(point))) => Some(point * self.scale),
            _ => None,
        };
        let uvs = |i: usize| joined.uvs.as_chunks::<3>().0.get(i).map(|uvs| uvs.map(Vec2::from_array));
        let texels = self.density(&shape, &joined);
        let order = UnfoldOrder { must: true, ..self.order };
        let flattening =
            Flattening { shape: &shape, positions: &positions, corners: &corners, around, uvs: &uvs, texels };
        let flat = flattening.apply(&order);
        let Flat { layout, unit, around } = flat.ok_or_else(|| failed("its members cannot be laid out".into()))?;
        let around = around / self.scale;
        let to_pictures = Unfolding::new(order.id, layout.clone(), unit, around, uvs);
        let size = layout.size.as_vec2();
        let own = layout.corners.clone();
        let own =
            |i: usize| own.get(i).copied().flatten().map(|corners: [Vec2; 3]| corners.map(|corner| corner / size));
        let mut unfolding = Unfolding::new(order.id, layout, unit, around, own);
        unfolding.is_own = true;
        let Joined { owner, triangles, .. } = &joined;
        let (owner, triangles) = (owner.clone(), triangles.clone());
        let mesh = joined.mesh().ok_or_else(|| failed("its members have no mesh".into()))?;
        check_for_tangents(&mesh).map_err(|reason| CrackError::Mesh { reason })?;
        let mesh = flat_mesh(mesh, &unfolding.layout).ok_or_else(|| failed("tangents cannot be made".into()))?;
        let n = size.as_usizevec2().element_product();
        let has_normals = self.solids.iter().any(|solid| solid.normal.is_some());
        Ok(Laid {
            mesh,
            triangles,
            owner,
            to_pictures,
            unfolding,
            diffuse: vec![0; 4 * n],
            normal: has_normals.then(|| FLAT.repeat(n)),
            tint: Tint::NONE,
            done: 0,
        })
    }

    /// Texels for a unit of length: as many as the finest of the members has.
    fn density(&self, shape: &MeshShape, joined: &Joined) -> Option<f32> {
        let mut finest = None;
        for (solid, range) in self.solids.iter().zip(&joined.triangles) {
            let Some(source) = solid.diffuse.and_then(|number| self.sources.get(number)) else { continue };
            let (mut texels, mut area) = (0.0, 0.0);
            for i in range.clone().filter(|i| shape.has_area(*i)) {
                let corner = |k: usize| Vec3::from_array(joined.positions[3 * i + k]) * self.scale;
                let uv = |k: usize| Vec2::from_array(joined.uvs[3 * i + k]) * source.size.as_vec2();
                area += (corner(1) - corner(0)).cross(corner(2) - corner(0)).length();
                texels += (uv(1) - uv(0)).perp_dot(uv(2) - uv(0)).abs();
            }
            let density = (texels / area).sqrt();
            if density.is_normal() {
                finest = Some(finest.map_or(density, |finest: f32| finest.max(density)));
            }
        }
        finest
    }

    /// Puts texels in their places, from the first that is not done on.
    fn put(&self, laid: &mut Laid) {
        let layout = &laid.to_pictures.layout;
        let end = (laid.done + SLICE).min(layout.owner.len());
        for i in laid.done..end {
            let texel = UVec2::new(i as u32 % layout.size.x, i as u32 / layout.size.x);
            let Some(solid) = layout.owner(texel).and_then(|triangle| laid.owner.get(triangle)) else { continue };
            let Some(solid) = self.solids.get(*solid as usize) else { continue };
            let read = |number: Option<usize>| {
                let source = number.and_then(|number| self.sources.get(number))?;
                Some(source.texel(&laid.to_pictures, texel))
            };
            laid.tint.become_of(solid.tint);
            let color = laid.tint.of(read(solid.diffuse).unwrap_or([255; 4]));
            laid.diffuse[4 * i..4 * i + 4].copy_from_slice(&color);
            if let (Some(normals), Some(normal)) = (&mut laid.normal, read(solid.normal)) {
                normals[4 * i..4 * i + 4].copy_from_slice(&normal);
            }
        }
        laid.done = end;
    }
}

impl Stepped for BodyWork {
    type Output = MadeBody;

    fn step(mut self) -> Result<Step<Self>, CrackError> {
        if let Some((copy, picture)) = self.copies.next().zip(self.pictures.next()) {
            self.sources.push(Source::read(copy, &picture)?);
            return Ok(Step::More(self));
        }
        let Some(mut laid) = self.laid.take() else {
            self.laid = Some(self.lay_out()?);
            return Ok(Step::More(self));
        };
        self.put(&mut laid);
        if laid.done < laid.to_pictures.layout.owner.len() {
            self.laid = Some(laid);
            return Ok(Step::More(self));
        }
        let Laid { mesh, triangles, to_pictures, unfolding, diffuse, mut normal, .. } = laid;
        if let Some(normal) = &mut normal {
            to_pictures.turn_normals(normal);
        }
        let (before, mesh, unfolding) = (mesh.clone(), Box::new(mesh), Arc::new(unfolding));
        Ok(Step::Done(MadeBody { mesh, before, unfolding, triangles, diffuse, normal }))
    }

    fn progress(&self) -> f32 {
        let share = |laid: &Laid| laid.done as f32 / laid.diffuse.len().max(1) as f32 * 4.0;
        self.laid.as_ref().map_or(0.0, share)
    }
}

/// Triangles of members in the space of the group, three vertices each.
#[derive(Default)]
struct Joined {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// In the pictures of members.
    uvs: Vec<[f32; 2]>,
    owner: Vec<u32>,
    triangles: Vec<Range<usize>>,
}

impl Joined {
    fn add(&mut self, number: u32, solid: &Solid, mesh: &Mesh) -> Result<(), &'static str> {
        let (triangles, first) = (Triangles::of(mesh)?, self.owner.len());
        let normals = match mesh.try_attribute_option(Mesh::ATTRIBUTE_NORMAL) {
            Ok(Some(VertexAttributeValues::Float32x3(normals))) => normals.as_slice(),
            _ => &[],
        };
        let to_normal = solid.place.matrix3.inverse().transpose();
        // What is mirrored is seen from the other side.
        let is_mirrored = solid.place.matrix3.determinant() < 0.0;
        for i in 0..triangles.len() {
            let (Some(corners), Some((places, uvs))) = (triangles.corners(i), triangles.get(i)) else { continue };
            let places = places.map(|at| solid.place.transform_point3(at));
            let turned = if is_mirrored { [0, 2, 1] } else { [0, 1, 2] };
            let [a, b, c] = turned.map(|k| places[k]);
            let flat = (b - a).cross(c - a).normalize_or_zero();
            for k in turned {
                let normal = normals.get(corners[k]).map(|normal| to_normal * Vec3::from_array(*normal));
                let normal = normal.and_then(Vec3::try_normalize).unwrap_or(flat);
                self.positions.push(places[k].to_array());
                self.normals.push(normal.to_array());
                self.uvs.push(solid.to_picture.transform_point2(uvs[k]).to_array());
            }
            self.owner.push(number);
        }
        self.triangles.push(first..self.owner.len());
        Ok(())
    }

    fn mesh(self) -> Option<Mesh> {
        let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        mesh.try_insert_attribute(Mesh::ATTRIBUTE_POSITION, self.positions).ok()?;
        mesh.try_insert_attribute(Mesh::ATTRIBUTE_NORMAL, self.normals).ok()?;
        mesh.try_insert_attribute(Mesh::ATTRIBUTE_UV_0, self.uvs).ok()?;
        Some(mesh)
    }
}
