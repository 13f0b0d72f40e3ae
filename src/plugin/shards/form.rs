//! [`Form`]: the meshes of a shard, made on any thread.

use crate::plugin::carrier::plane::Plane;
use crate::shatter::{MeshFrame, Pose, RimLook, ShardMesh, Shards, Shell, ShellFrame, ShellMesh, ShellPart};
use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
    tasks::{ComputeTaskPool, ParallelSlice},
};
use core::ops::Range;
use std::sync::{Arc, Weak};

/// Shards that are worth a task.
const CHUNK: usize = 32;

/// How uneven the faces are along which a shell breaks.
const ROUGHNESS: f32 = 0.8;

/// The meshes of a shard.
pub(super) struct Form {
    /// What shows the picture.
    pub(super) picture: Mesh,
    /// The sides of a solid shard.
    pub(super) sides: Option<Mesh>,
}

/// What the form of a piece follows from.
pub(super) struct Origin {
    shards: Weak<Shards>,
    number: u32,
    uv: [Vec2; 2],
    seed: u64,
    plane: Plane,
    style: Style,
}

/// A piece as far as its form goes.
#[derive(Clone, Copy)]
pub(super) struct Shape<'a> {
    /// The pieces it is one of, and its number among them.
    pub(super) cut: &'a Arc<Shards>,
    pub(super) number: u32,
    /// The part of the texture that it shows.
    pub(super) uv: [Vec2; 2],
    /// Fixes what is random about it.
    pub(super) seed: u64,
    /// Where it lies in the surface.
    pub(super) plane: Plane,
}

impl Origin {
    pub(super) fn of(style: Style, shape: Shape<'_>) -> Self {
        let Shape { cut, number, uv, seed, plane } = shape;
        Self { shards: Arc::downgrade(cut), number, uv, seed, plane, style }
    }
}

impl PartialEq for Origin {
    fn eq(&self, other: &Self) -> bool {
        self.shards.ptr_eq(&other.shards)
            && (self.number, self.uv, self.seed, self.plane) == (other.number, other.uv, other.seed, other.plane)
            && self.style == other.style
    }
}

/// How shards of a surface are formed.
#[derive(Clone)]
pub(super) struct Style {
    pub(super) rim: RimLook,
    /// Units of the entity; `None` = flat.
    pub(super) thickness: Option<f32>,
    /// The surface, if it is not flat.
    pub(super) shell: Option<Arc<Shell>>,
}

impl PartialEq for Style {
    fn eq(&self, other: &Self) -> bool {
        let of = |style: &Self| style.shell.as_ref().map(Arc::as_ptr);
        (self.rim, self.thickness, of(self)) == (other.rim, other.thickness, of(other))
    }
}

impl Style {
    /// The meshes of a shard that shows the part `uv` of the texture.
    pub(super) fn form(&self, shards: &Shards, number: u32, plane: &Plane, uv: [Vec2; 2], seed: u64) -> Form {
        if let Some((shell, thickness)) = self.shell.as_ref().zip(self.thickness) {
            return self.curved((shards, number), shell, plane, (uv, seed, thickness));
        }
        let frame = MeshFrame { size: plane.size, uv, centred: true, rim: self.rim, seed };
        let is_mirrored = plane.is_mirrored();
        let Some(thickness) = self.thickness else {
            let ShardMesh { positions, normals, uvs, colors, indices, .. } = shards.flat_mesh(number, &frame);
            return Form { picture: mesh(positions, normals, uvs, colors, indices, is_mirrored), sides: None };
        };
        let form = shards.solid_mesh(number, &frame, thickness);
        // Where the sides' vertices begin: their first triangle names the first of them.
        let split = form.indices.get(form.sides).map_or(form.positions.len(), |first| *first as usize);
        let part = |vertices: Range<usize>, indices: Range<usize>, colors: &[[f32; 4]]| {
            let start = vertices.start as u32;
            mesh(
                form.positions[vertices.clone()].to_vec(),
                form.normals[vertices.clone()].to_vec(),
                form.uvs[vertices].to_vec(),
                colors.to_vec(),
                form.indices[indices].iter().map(|index| index - start).collect(),
                is_mirrored,
            )
        };
        let picture = part(0..split, 0..form.sides, &form.colors);
        let sides = part(split..form.positions.len(), form.sides..form.indices.len(), &[]);
        let side = if is_mirrored { -1.0 } else { 1.0 };
        // u runs along x; the normal map's green points up.
        let on_picture = |[x, y, z]: [f32; 3]| {
            let [x, y] = [side * x, side * y];
            let along = Vec3::new(1.0 - x * x, -x * y, -x * z).normalize_or(Vec3::X) * side;
            along.extend(side * z.signum()).to_array()
        };
        let on_sides = |[x, y, _]: [f32; 3]| [side * y, -side * x, 0.0, 1.0];
        Form {
            picture: with_tangents(picture, form.normals[..split].iter().copied().map(on_picture).collect()),
            sides: Some(with_tangents(sides, form.normals[split..].iter().copied().map(on_sides).collect())),
        }
    }

    /// The meshes of a piece of what is not flat.
    fn curved(
        &self,
        (shards, number): (&Shards, u32),
        shell: &Shell,
        plane: &Plane,
        (uv, seed, thickness): ([Vec2; 2], u64, f32),
    ) -> Form {
        let centroid = shards.get(number).map_or(Vec2::ZERO, |shard| shard.centroid);
        let at_rest = plane.place(centroid, shards.extent(), Pose::AT_REST, 0.5 * thickness);
        let to_mesh = at_rest.compute_affine().inverse();
        // Glass breaks smoothly.
        let roughness = ROUGHNESS * (1.0 - self.rim.bright.clamp(0.0, 1.0));
        let frame = ShellFrame { to_mesh, uv, rim: self.rim, seed, thickness, roughness };
        let ShellMesh { picture, inside } = shards.shell_mesh(number, shell, &frame);
        let part = |part: ShellPart| {
            let ShellPart { positions, normals, tangents, uvs, colors, indices } = part;
            with_tangents(mesh(positions, normals, uvs, colors, indices, false), tangents)
        };
        Form { picture: part(picture), sides: Some(part(inside)) }
    }

    /// The meshes of pieces, by all threads that there are.
    pub(super) fn forms(&self, pieces: &[Shape<'_>]) -> Vec<Form> {
        let form = |piece: &Shape<'_>| self.form(piece.cut, piece.number, &piece.plane, piece.uv, piece.seed);
        match ComputeTaskPool::try_get() {
            Some(pool) if pieces.len() > CHUNK => {
                let chunks =
                    pieces.par_chunk_map(pool, CHUNK, |_, chunk| chunk.iter().map(form).collect::<Vec<Form>>());
                chunks.into_iter().flatten().collect()
            }
            _ => pieces.iter().map(form).collect(),
        }
    }
}

/// A mesh of the engine.
pub(super) fn mesh(
    positions: Vec<[f32; 3]>,
    mut normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    colors: Vec<[f32; 4]>,
    mut indices: Vec<u32>,
    is_mirrored: bool,
) -> Mesh {
    // Where the picture is mirrored, what ran around counter-clockwise runs clockwise, and normals look inward.
    if is_mirrored {
        normals.iter_mut().for_each(|[x, y, _]| (*x, *y) = (-*x, -*y));
        indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
        .with_inserted_indices(Indices::U32(indices));
    if colors.is_empty() { mesh } else { mesh.with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colors) }
}

pub(super) fn with_tangents(mesh: Mesh, tangents: Vec<[f32; 4]>) -> Mesh {
    mesh.with_inserted_attribute(Mesh::ATTRIBUTE_TANGENT, tangents)
}
