//! 3D meshes that are laid out flat around their first hit, so that cracks run over their edges.

use super::faces::Faces;
use super::kind::{Carrier, UnfoldOrder};
use super::mesh::{Triangles, closest, is_flat, place_of};
use super::plane::Plane;
use super::slot::{CrackMaterial, MaterialSlot, to_picture};
use crate::plugin::api::CrackGroup;
use crate::plugin::api::hit::HitPoint;
use crate::plugin::jobs::background::{BackgroundJob, PATIENCE, guarded};
use crate::plugin::source::unfolding::Unfolding;
use crate::shatter::{ShellPlace, ShellTriangle};
use crate::unwrap::{LaidOut, MAX_TRIANGLES, MeshShape, Unwrap, UnwrapError};
use bevy::{
    math::{Affine2, Mat2},
    mesh::VertexAttributeValues,
    platform::time::Instant,
    prelude::*,
};
use std::sync::Arc;

/// Texels for a unit of pattern space where there is no picture.
const WITHOUT_PICTURE: f32 = 256.0;

/// A mesh with more triangles is looked at by the task only.
const FEW: usize = 1024;

/// A mesh is not laid out with fewer texels for a unit of pattern space.
const COARSEST: f32 = 8.0;

/// How much of its texels a unit of length keeps at each try to make a layout fit.
const SMALLER: f32 = 0.8;

/// Beside a surface whose mesh is laid out, or is not to be.
#[derive(Component)]
#[component(clone_behavior = Ignore)]
struct Unfold {
    /// The mesh as it was.
    before: Handle<Mesh>,
    /// From its texture coordinates to those of the picture.
    to_picture: Affine2,
    stage: Stage,
}

enum Stage {
    Working(BackgroundJob<Box<Work>, Option<Made>>, Instant),
    /// It stays as it is.
    Refused,
    Made(Box<Mesh>, Arc<Unfolding>),
    /// The entity shows this mesh.
    Shown(Handle<Mesh>, Arc<Unfolding>),
}

type Made = (Box<Mesh>, Arc<Unfolding>);

/// What a task lays out.
struct Work {
    mesh: Mesh,
    to_picture: Affine2,
    scale: Vec3,
    /// Where it is hit, in the mesh's space.
    hit: Option<Vec3>,
    picture: Option<UVec2>,
    order: UnfoldOrder,
}

/// The layout of the mesh that an entity shows, or is to show.
pub(super) fn unfolding(world: &World, entity: Entity) -> Option<Arc<Unfolding>> {
    let (unfold, mesh) = (world.get::<Unfold>(entity)?, &world.get::<Mesh3d>(entity)?.0);
    match &unfold.stage {
        Stage::Made(_, made) if *mesh == unfold.before => Some(made.clone()),
        Stage::Shown(own, made) if mesh == own => Some(made.clone()),
        _ => None,
    }
}

/// Whether the mesh of an entity is laid out, or is to stay as it is; `None` if that was not asked yet.
pub(super) fn poll(world: &mut World, entity: Entity) -> Option<bool> {
    let mesh = world.get::<Mesh3d>(entity)?.0.clone();
    let mut unfold = world.get_mut::<Unfold>(entity)?;
    let is_same = unfold.before == mesh || matches!(&unfold.stage, Stage::Shown(own, _) if *own == mesh);
    is_same.then(|| unfold.poll())
}

/// Has the mesh of an entity laid out, if that is of use; `false` if that is under way.
pub(super) fn prepare<S: MaterialSlot>(world: &mut World, entity: Entity, order: &UnfoldOrder) -> bool {
    let Some(mesh) = world.get::<Mesh3d>(entity).map(|mesh| mesh.0.clone()) else { return true };
    let Some(work) = work::<S>(world, entity, &mesh, order) else {
        forget(world, entity);
        return true;
    };
    let to_picture = work.to_picture;
    let stage = if order.at_once {
        Stage::of(work.make())
    } else {
        Stage::Working(BackgroundJob::start(Box::new(work), |work| work.make()), Instant::now())
    };
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.insert(Unfold { before: mesh, to_picture, stage });
    }
    order.at_once
}

impl Stage {
    fn of(made: Option<Made>) -> Self {
        made.map_or(Self::Refused, |(mesh, unfolding)| Self::Made(mesh, unfolding))
    }
}

impl Unfold {
    /// Whether it is done.
    fn poll(&mut self) -> bool {
        let Stage::Working(job, since) = &mut self.stage else { return true };
        let Some(made) = job.take_if_done(since.elapsed() >= PATIENCE) else { return false };
        self.stage = Stage::of(made);
        true
    }
}

/// What is to be laid out; `None` if the mesh is better left as it is: it is flat, a slab, or has too many triangles.
fn work<S: MaterialSlot>(world: &World, entity: Entity, mesh: &Handle<Mesh>, order: &UnfoldOrder) -> Option<Work> {
    let mesh = world.get_resource::<Assets<Mesh>>()?.get(mesh)?;
    let triangles = Triangles::of(mesh).ok()?;
    let plane = |i: usize| {
        let ([a, b, c], _) = triangles.get(i)?;
        // The first may have no area, as at the pole of a ball.
        Some((a, (b - a).cross(c - a).try_normalize()?))
    };
    let (point, normal) = (0..triangles.len()).find_map(plane)?;
    if triangles.len() > MAX_TRIANGLES || is_flat(mesh, point, normal) {
        return None;
    }
    let material = world.get::<S>(entity)?.material();
    let diffuse = world.get_resource::<Assets<S::Material>>()?.get(material)?.pictures()[0].clone();
    let images = world.get_resource::<Assets<Image>>();
    let picture = diffuse.and_then(|picture| images?.get(&picture).map(Image::size));
    let axes = world.get::<GlobalTransform>(entity).copied().unwrap_or_default().affine().matrix3;
    let scale = Vec3::new(axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length());
    let to_picture = to_picture::<S>(world, entity).ok()?;
    if triangles.len() <= FEW && is_slab(mesh, to_picture, scale) {
        return None;
    }
    let hit = match order.hit {
        Some((HitPoint::Local(point), _)) => Some(point),
        Some((_, Some(point))) => Some(point),
        Some((HitPoint::Uv(uv), None)) => place_in(mesh, to_picture, uv),
        _ => None,
    };
    Some(Work { mesh: mesh.clone(), to_picture, scale, hit, picture, order: *order })
}

/// The point of a mesh where its picture has these texture coordinates.
fn place_in(mesh: &Mesh, to_picture: Affine2, uv: Vec2) -> Option<Vec3> {
    place_of(mesh, to_picture.inverse().transform_point2(uv)).map(|place| place.0)
}

fn is_slab(mesh: &Mesh, to_picture: Affine2, scale: Vec3) -> bool {
    Faces::of(mesh, to_picture, scale).is_some_and(|faces| faces.slab().is_some())
}

impl Work {
    /// A panic is none.
    fn make(self) -> Option<Made> {
        guarded(|| Ok(self.lay_out())).ok().flatten()
    }

    fn lay_out(self) -> Option<Made> {
        let triangles = Triangles::of(&self.mesh).ok()?;
        if triangles.len() > FEW && is_slab(&self.mesh, self.to_picture, self.scale) {
            return None;
        }
        let corners: Vec<[u32; 3]> = (0..triangles.len())
            .map(|i| Some(triangles.corners(i)?.map(|vertex| vertex as u32)))
            .collect::<Option<_>>()?;
        let positions: Vec<Vec3> = triangles.positions().map(|at| at * self.scale).collect();
        let shape = MeshShape::new(&positions, &corners).ok()?;
        if shape.faces() == 1 {
            return None;
        }
        let uvs = |i: usize| triangles.get(i).map(|(_, uvs)| uvs.map(|uv| self.to_picture.transform_point2(uv)));
        let around = self.hit.map(|hit| hit * self.scale);
        let texels = self.density(&shape, &uvs);
        let laid = Flattening { shape: &shape, positions: &positions, corners: &corners, around, uvs: &uvs, texels }
            .apply(&self.order)?;
        let Flat { layout, unit, around } = laid;
        let unfolding = Arc::new(Unfolding::new(self.order.id, layout, unit, around / self.scale, uvs));
        let mesh = flat_mesh(self.mesh, &unfolding.layout)?;
        Some((Box::new(mesh), unfolding))
    }

    /// Texels for a unit of length: as many as its picture has.
    fn density(&self, shape: &MeshShape, uvs: &dyn Fn(usize) -> Option<[Vec2; 3]>) -> Option<f32> {
        let picture = self.picture?.as_vec2().element_product();
        let area = |i| uvs(i).map_or(0.0, |[p, q, r]| 0.5 * (q - p).perp_dot(r - p).abs());
        let texels = (0..shape.len()).filter(|i| shape.has_area(*i)).map(area).sum::<f32>() * picture;
        Some((texels / shape.area()).sqrt()).filter(|density| density.is_normal())
    }
}

/// Triangles that are to be laid out, in the proportions that they have in the world.
pub(crate) struct Flattening<'a> {
    pub(crate) shape: &'a MeshShape,
    pub(crate) positions: &'a [Vec3],
    pub(crate) corners: &'a [[u32; 3]],
    /// Where it is hit.
    pub(crate) around: Option<Vec3>,
    /// The corners of each triangle in its picture.
    pub(crate) uvs: &'a dyn Fn(usize) -> Option<[Vec2; 3]>,
    /// Texels for a unit of length; `None` = some.
    pub(crate) texels: Option<f32>,
}

/// Triangles that are laid out.
pub(crate) struct Flat {
    pub(crate) layout: LaidOut,
    /// Texels for a unit of pattern space.
    pub(crate) unit: f32,
    /// Around which point.
    pub(crate) around: Vec3,
}

impl Flattening<'_> {
    /// Lays them out; `None` if they do not fit.
    pub(crate) fn apply(&self, order: &UnfoldOrder) -> Option<Flat> {
        let Self { shape, positions, corners, .. } = *self;
        let triangle = nearest(shape, positions, corners, self.around)?;
        let [a, b, c] = corners[triangle].map(|vertex| positions[vertex as usize]);
        let around = self.around.unwrap_or((a + b + c) / 3.0);
        // To the right in the picture where it is hit.
        let right = (self.uvs)(triangle).map_or(Vec3::ZERO, |[p, q, r]| {
            ((b - a) * (r - p).y - (c - a) * (q - p).y) * (q - p).perp_dot(r - p).signum()
        });
        let unit = (shape.area() / 6.0).sqrt();
        let UnfoldOrder { must, most_side, most_texels, .. } = *order;
        let mut texels = steady(self.texels.unwrap_or(WITHOUT_PICTURE / unit));
        if must {
            // Charts fill about two thirds of what is around them.
            texels = texels.min((most_texels as f32 / (1.5 * shape.area())).sqrt());
        }
        loop {
            match (Unwrap { around, triangle, right, texels, most_side, most_texels }).apply(shape) {
                Ok(layout) => return Some(Flat { layout, unit: texels * unit, around }),
                Err(UnwrapError::TooLarge { .. }) if must && texels * unit > COARSEST => texels *= SMALLER,
                Err(_) => return None,
            }
        }
    }
}

/// A number without its last bits: the same, whichever way it was computed.
fn steady(number: f32) -> f32 {
    const LAST: u32 = 1 << 7;
    f32::from_bits((number.to_bits() + LAST / 2) & !(LAST - 1))
}

/// A mesh with its triangles where they are laid out, and with tangents.
pub(crate) fn flat_mesh(mut mesh: Mesh, layout: &LaidOut) -> Option<Mesh> {
    let size = layout.size.as_vec2();
    let uvs: Vec<[f32; 2]> = layout
        .corners
        .iter()
        .flat_map(|corners| corners.unwrap_or_default().map(|corner| (corner / size).to_array()))
        .collect();
    let _tangents = mesh.try_remove_attribute(Mesh::ATTRIBUTE_TANGENT);
    mesh.try_duplicate_vertices().ok()?;
    mesh.try_insert_attribute(Mesh::ATTRIBUTE_UV_0, uvs).ok()?;
    mesh.with_generated_tangents().ok()
}

/// The triangle of a point, or the largest one.
fn nearest(shape: &MeshShape, positions: &[Vec3], corners: &[[u32; 3]], point: Option<Vec3>) -> Option<usize> {
    let with_area = (0..shape.len()).filter(|i| shape.has_area(*i));
    let of = |i: usize| corners[i].map(|vertex| positions[vertex as usize]);
    let Some(point) = point else {
        let area = |i: &usize| {
            let [a, b, c] = of(*i);
            (b - a).cross(c - a).length()
        };
        return with_area.max_by(|a, b| area(a).total_cmp(&area(b)).then(b.cmp(a)));
    };
    let distance = |i: &usize| {
        let [a, b, c] = of(*i);
        super::mesh::nearest_on(point, [a, b, c]).distance_squared(point)
    };
    with_area.map(|i| (distance(&i), i)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
}

/// Gives an entity a mesh that is laid out already: its surface will be so too. `before` is the same mesh, which it shows until it is cracked.
pub(crate) fn give(
    world: &mut World,
    entity: Entity,
    before: Handle<Mesh>,
    mesh: Box<Mesh>,
    unfolding: Arc<Unfolding>,
) {
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        let stage = Stage::Made(mesh, unfolding);
        entity.insert((Mesh3d(before.clone()), Unfold { before, to_picture: Affine2::IDENTITY, stage }));
    }
}

/// Gives an entity the mesh that is laid out, if its textures are.
pub(super) fn show(world: &mut World, entity: Entity, carrier: &mut Carrier) {
    if carrier.unfolding.is_none() {
        forget(world, entity);
        return;
    }
    let Some(mut unfold) = world.get_mut::<Unfold>(entity) else { return };
    let before = unfold.before.clone();
    let (mesh, unfolding) = match core::mem::replace(&mut unfold.stage, Stage::Refused) {
        Stage::Made(mesh, unfolding) => (mesh, unfolding),
        other => {
            unfold.stage = other;
            return;
        }
    };
    let Some(mut meshes) = world.get_resource_mut::<Assets<Mesh>>() else { return };
    let own = meshes.add(*mesh);
    if let Some(mut unfold) = world.get_mut::<Unfold>(entity) {
        unfold.stage = Stage::Shown(own.clone(), unfolding);
    }
    if let Some(mut mesh) = world.get_mut::<Mesh3d>(entity) {
        mesh.0 = own.clone();
        carrier.mesh = Some((before, own));
    }
}

/// Nothing is known any more of a mesh that has not cracked, unless it is that of a group, which comes with its layout.
pub(super) fn forget_own(world: &mut World, entity: Entity) {
    if world.get::<CrackGroup>(entity).is_none() {
        forget(world, entity);
    }
}

/// Nothing is known of its mesh any more.
pub(super) fn forget(world: &mut World, entity: Entity) {
    if world.get::<Unfold>(entity).is_some()
        && let Ok(mut entity) = world.get_entity_mut(entity)
    {
        entity.remove::<Unfold>();
    }
}

/// The plane of the triangle in which a texel of a mesh lies that is laid out. Its picture is all of the layout, as it would lie in that plane.
pub(super) fn plane_at(world: &World, entity: Entity, texel: Vec2) -> Option<Plane> {
    let unfolding = unfolding(world, entity)?;
    let layout = &unfolding.layout;
    let triangle = layout.owner(texel.max(Vec2::ZERO).as_uvec2())?;
    let [a, b, c] = layout.corners.get(triangle).copied().flatten()?;
    let mesh = world.get_resource::<Assets<Mesh>>()?.get(&world.get::<Mesh3d>(entity)?.0)?;
    let ([p, q, r], _) = Triangles::of(mesh).ok()?.get(triangle)?;
    // From texels to the mesh's space.
    let back = Mat2::from_cols(b - a, c - a).inverse();
    let along = |way: Vec2| (q - p) * (back * way).x + (r - p) * (back * way).y;
    let (right, down) = (along(Vec2::X), along(Vec2::Y));
    let normal = (q - p).cross(r - p).try_normalize()?;
    let place = ShellPlace { position: p + along(texel - a), normal, right, down };
    Plane::on(&place, texel, layout.size.as_vec2())
}

/// The triangles of a mesh that is laid out, with their places in pattern space.
pub(super) fn triangles(world: &World, entity: Entity) -> Option<Vec<ShellTriangle>> {
    let unfolding = unfolding(world, entity)?;
    let mesh = world.get_resource::<Assets<Mesh>>()?.get(&world.get::<Mesh3d>(entity)?.0)?;
    let triangles = Triangles::of(mesh).ok()?;
    let normals = match mesh.try_attribute_option(Mesh::ATTRIBUTE_NORMAL) {
        Ok(Some(VertexAttributeValues::Float32x3(normals))) => normals.as_slice(),
        _ => &[],
    };
    let all = unfolding.layout.corners.iter().enumerate().filter_map(|(i, laid)| {
        let (flat, (corners, _)) = ((*laid)?, triangles.get(i)?);
        let normal = |vertex: usize| normals.get(vertex).map_or(Vec3::ZERO, |normal| Vec3::from_array(*normal));
        let normals = triangles.corners(i)?.map(normal);
        Some(ShellTriangle { flat: flat.map(|at| at / unfolding.unit), corners, normals })
    });
    Some(all.collect())
}

/// Where the layout of a mesh has what its picture has at these texture coordinates, texels.
pub(super) fn texel_of(world: &World, entity: Entity, uv: Vec2) -> Option<Vec2> {
    let HitPoint::Local(point) = aim(world, entity, HitPoint::Uv(uv), None)? else { return None };
    let unfolding = unfolding(world, entity)?;
    let mesh = world.get_resource::<Assets<Mesh>>()?.get(&world.get::<Mesh3d>(entity)?.0)?;
    let (_, uv) = closest(mesh, point).ok()?;
    Some(uv * unfolding.layout.size.as_vec2())
}

/// The point that a hit is meant for on a mesh that is laid out: texture coordinates are those of its picture.
pub(super) fn aim(world: &World, entity: Entity, at: HitPoint, point: Option<Vec3>) -> Option<HitPoint> {
    unfolding(world, entity)?;
    match (at, point) {
        (HitPoint::Local(_), _) => Some(at),
        (_, Some(point)) => Some(HitPoint::Local(point)),
        (HitPoint::Uv(uv), None) => {
            let Unfold { before, to_picture, .. } = world.get::<Unfold>(entity)?;
            let before = world.get_resource::<Assets<Mesh>>()?.get(before)?;
            // Nowhere on the surface if not on the mesh.
            Some(place_in(before, *to_picture, uv).map_or(HitPoint::Uv(Vec2::NAN), HitPoint::Local))
        }
        _ => None,
    }
}
