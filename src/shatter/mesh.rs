//! Meshes of shards, as plain arrays.

use super::{RimLook, Shards, rim::Bevel};
use glam::{Vec2, Vec3};

/// How the shards of a surface become meshes.
///
/// ```
/// use bevy_crack::shatter::{Cuts, MeshFrame, ShatterParams, shatter};
///
/// let shards = shatter(Cuts::new([1.0, 1.0].into())?, &ShatterParams::DEFAULT)?;
/// let mesh = shards.flat_mesh(0, &MeshFrame::new([200.0, 200.0].into()));
/// assert_eq!(mesh.positions.len(), 4);
/// assert_eq!(mesh.indices.len(), 6);
/// # Ok::<(), bevy_crack::shatter::ShatterError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshFrame {
    /// Size of the whole surface in the mesh's units.
    pub size: Vec2,
    /// Texture coordinates of the surface's top left and bottom right corner: those of its region in an atlas, else 0
    /// and 1.
    pub uv: [Vec2; 2],
    /// Whether positions are relative to the shard's centroid; else they are relative to the middle of the surface.
    pub centred: bool,
    /// How rims look.
    pub rim: RimLook,
    /// Seed of the direction in which the picture is displaced in each shard, if [`rim`](Self::rim) displaces it.
    pub seed: u64,
}

impl MeshFrame {
    /// A surface of `size` that shows a whole texture, for shards that move independently.
    #[must_use]
    pub const fn new(size: Vec2) -> Self {
        Self { size, uv: [Vec2::ZERO, Vec2::ONE], centred: true, rim: RimLook::PLAIN, seed: 0 }
    }
}

/// A triangle list. x points right, y up, z towards the viewer; triangles are counter-clockwise as seen from outside.
///
/// ```
/// use bevy_crack::shatter::{Cuts, MeshFrame, RimLook, ShardMesh, ShatterParams, shatter};
///
/// let mut cuts = Cuts::new([2.0, 1.0].into())?;
/// cuts.add_line(&[[1.0, 0.0].into(), [1.0, 1.0].into()])?;
/// let shards = shatter(cuts, &ShatterParams::DEFAULT)?;
/// let frame = MeshFrame::new([2.0, 1.0].into());
/// // A square plate: two triangles in front, two behind, two on each of its four sides.
/// let plate = shards.solid_mesh(0, &frame, 0.1);
/// assert_eq!((plate.indices.len() / 3, plate.sides / 3), (12, 4));
/// assert!(plate.positions.iter().all(|[_, _, z]| z.abs() == 0.05));
///
/// // Both squares in one mesh, each in its place, then the first one as a plate in the same memory.
/// let mut mesh = ShardMesh::default();
/// let whole = MeshFrame { centred: false, ..frame };
/// shards.flat_mesh_into(0, &whole, &mut mesh);
/// shards.flat_mesh_into(1, &whole, &mut mesh);
/// assert_eq!(mesh.positions.len(), 8);
/// shards.solid_mesh_into(0, &frame, 0.1, &mut mesh);
/// assert_eq!(mesh, plate);
/// mesh.clear();
/// assert_eq!(mesh, ShardMesh::default());
///
/// // With a rim of glass, vertices have colours: the outer ones are brighter.
/// let glass = shards.flat_mesh(0, &MeshFrame { rim: RimLook::GLASS, ..frame });
/// assert_eq!(glass.colors.len(), 8);
/// assert!(glass.colors[0][3] > glass.colors[7][3]);
/// assert!(RimLook { width: 0.5, ..RimLook::GLASS }.validate().is_err());
/// # Ok::<(), bevy_crack::shatter::ShatterError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShardMesh {
    /// Positions of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// Unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, v down.
    pub uvs: Vec<[f32; 2]>,
    /// Factors for the picture's colour (red, green, blue, opacity) at the vertices that show it; empty without a
    /// rim.
    pub colors: Vec<[f32; 4]>,
    /// Indices of vertices, three per triangle.
    pub indices: Vec<u32>,
    /// Index in `indices` at which the side faces start: the triangles before it show the picture, the others the
    /// inside.
    pub sides: usize,
}

impl ShardMesh {
    /// Removes all content and keeps the allocated memory.
    pub fn clear(&mut self) {
        self.positions.clear();
        self.normals.clear();
        self.uvs.clear();
        self.colors.clear();
        self.indices.clear();
        self.sides = 0;
    }
}

impl Shards {
    /// A shard as a flat mesh at z = 0 that faces +z, as for a sprite. Its vertices are the
    /// [`corners`](Self::corners), in order; with a rim they are followed by the inner vertices of the rim.
    #[must_use]
    pub fn flat_mesh(&self, shard: u32, frame: &MeshFrame) -> ShardMesh {
        let mut mesh = ShardMesh::default();
        self.flat_mesh_into(shard, frame, &mut mesh);
        mesh
    }

    /// Like [`flat_mesh`](Self::flat_mesh), appended to a mesh: to reuse memory, or to put many shards into one mesh.
    pub fn flat_mesh_into(&self, shard: u32, frame: &MeshFrame, mesh: &mut ShardMesh) {
        self.cap(shard, frame, [0.0; 2], &self.bevels_for(shard, frame), mesh);
        mesh.sides = mesh.indices.len();
    }

    /// A shard with `thickness`, half of it on either side of z = 0: front, back, and a side face for every edge.
    /// Rims slope.
    ///
    /// The back shows the picture as seen through the shard. Texture coordinates of the sides are lengths in the
    /// mesh's units: along the outline, and from the front. The mesh is closed: every edge has a triangle on either
    /// side.
    #[must_use]
    pub fn solid_mesh(&self, shard: u32, frame: &MeshFrame, thickness: f32) -> ShardMesh {
        let mut mesh = ShardMesh::default();
        self.solid_mesh_into(shard, frame, thickness, &mut mesh);
        mesh
    }

    /// Like [`solid_mesh`](Self::solid_mesh), in the memory of a mesh whose content is replaced.
    pub fn solid_mesh_into(&self, shard: u32, frame: &MeshFrame, thickness: f32, mesh: &mut ShardMesh) {
        mesh.clear();
        let half = 0.5 * thickness;
        let bevels = self.bevels_for(shard, frame);
        let slope = (frame.rim.width * frame.size.y.abs() / self.extent().y).min(MOST_SLOPE * thickness);
        let edge = if bevels.is_empty() { half } else { half - slope };
        let (corners, inner) = (self.corners(shard).len(), bevels.len());
        mesh.positions.reserve(6 * corners + 2 * inner);
        mesh.normals.reserve(6 * corners + 2 * inner);
        mesh.uvs.reserve(6 * corners + 2 * inner);
        mesh.indices.reserve(6 * self.triangles(shard).len() + 6 * corners + 12 * inner);
        self.cap(shard, frame, [edge, half], &bevels, mesh);
        self.cap(shard, frame, [-edge, -half], &bevels, mesh);
        mesh.sides = mesh.indices.len();
        let mut first = 0;
        for ring in self.rings_of(shard) {
            let mut along = 0.0;
            for i in 0..ring.len() {
                let [a, b] = [i, (i + 1) % ring.len()].map(|i| mesh.positions[first + i]);
                let way = Vec2::new(b[0] - a[0], b[1] - a[1]);
                let length = way.length();
                // Outlines run clockwise when y is up.
                let normal = if length > 0.0 { [-way.y / length, way.x / length, 0.0] } else { [1.0, 0.0, 0.0] };
                let start = mesh.positions.len() as u32;
                mesh.positions.extend([
                    [a[0], a[1], edge],
                    [b[0], b[1], edge],
                    [b[0], b[1], -edge],
                    [a[0], a[1], -edge],
                ]);
                mesh.normals.extend([normal; 4]);
                let end = along + length;
                mesh.uvs.extend([[along, 0.0], [end, 0.0], [end, 2.0 * edge], [along, 2.0 * edge]]);
                mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| start + corner));
                along = end;
            }
            first += ring.len();
        }
    }

    fn bevels_for(&self, shard: u32, frame: &MeshFrame) -> Vec<Bevel> {
        let mut bevels = Vec::new();
        if frame.rim.width > 0.0 {
            self.bevels(shard, frame.rim.width, &mut bevels);
        }
        bevels
    }

    /// The face of a shard that shows the picture: its outline at the height `edge`, the area inside the bevel at
    /// `z`. It is seen from below if they are negative.
    fn cap(&self, shard: u32, frame: &MeshFrame, [edge, z]: [f32; 2], bevels: &[Bevel], mesh: &mut ShardMesh) {
        let Some(centroid) = self.get(shard).map(|shard| shard.centroid) else { return };
        let middle = if frame.centred { centroid } else { 0.5 * self.extent() };
        let scale = frame.size / self.extent();
        let [uv_start, uv_end] = frame.uv;
        let uv_scale = (uv_end - uv_start) / self.extent();
        let shift = self.shift(shard, frame.rim.shift, frame.seed);
        let to_mesh = |pos: Vec2, z: f32| {
            let at = (pos - middle) * scale;
            [at.x, -at.y, z]
        };
        let to_uv = |pos: Vec2| (uv_start + (pos + shift) * uv_scale).to_array();
        let start = mesh.positions.len() as u32;
        let corners = self.corners(shard);
        let places = corners.iter().map(|&corner| self.positions()[corner as usize]);
        mesh.positions.extend(places.clone().map(|pos| to_mesh(pos, edge)));
        mesh.uvs.extend(places.map(to_uv));
        let up = if z < 0.0 { -1.0 } else { 1.0 };
        // Turning from x to y is clockwise when y is up.
        let order = if z < 0.0 { [0, 1, 2] } else { [0, 2, 1] };
        let triangles = self.triangles(shard).iter();
        mesh.indices.reserve(3 * triangles.len() + 6 * bevels.len());
        if bevels.is_empty() {
            mesh.normals.extend(std::iter::repeat_n([0.0, 0.0, up], corners.len()));
            mesh.indices.extend(triangles.flat_map(|triangle| order.map(|i| start + triangle[i])));
            return;
        }
        let inner = start + corners.len() as u32;
        mesh.positions.extend(bevels.iter().map(|bevel| to_mesh(bevel.inner.as_vec2(), z)));
        mesh.uvs.extend(bevels.iter().map(|bevel| to_uv(bevel.inner.as_vec2())));
        let tilted = bevels.iter().map(|bevel| {
            // Like all normals it points inward where the picture is mirrored, and the order of corners is reversed
            // too.
            let out = bevel.outward / scale * (scale.x * scale.y).signum();
            Vec3::new(out.x, -out.y, 0.0).normalize_or_zero() + up * Vec3::Z
        });
        mesh.normals.extend(tilted.map(|normal| normal.normalize().to_array()));
        mesh.normals.extend(std::iter::repeat_n([0.0, 0.0, up], corners.len()));
        mesh.colors.extend(bevels.iter().map(|bevel| frame.rim.gain(bevel.outward)));
        mesh.colors.extend(std::iter::repeat_n([1.0; 4], corners.len()));
        mesh.indices.extend(triangles.flat_map(|triangle| order.map(|i| inner + triangle[i])));
        let mut first = 0;
        for ring in self.rings_of(shard) {
            let n = ring.len() as u32;
            for i in 0..n {
                let [a, b] = [first + i, first + (i + 1) % n];
                for triangle in [[start + a, start + b, inner + b], [start + a, inner + b, inner + a]] {
                    mesh.indices.extend(order.map(|i| triangle[i]));
                }
            }
            first += n;
        }
    }
}

/// Rims of solid shards slope down by at most this share of the thickness.
const MOST_SLOPE: f32 = 0.3;
