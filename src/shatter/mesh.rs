//! Shards as meshes: plain arrays.

use super::Shards;
use glam::Vec2;

/// How a surface becomes meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshFrame {
    /// Size of the whole surface in the mesh's units.
    pub size: Vec2,
    /// The texture coordinates of the surface's top left and bottom right corner: those of its region in an atlas, else 0 and 1.
    pub uv: [Vec2; 2],
    /// Whether positions are relative to the shard's centroid; else to the middle of the surface.
    pub centred: bool,
}

impl MeshFrame {
    /// A surface of `size` that shows a whole texture, for shards that move one by one.
    #[must_use]
    pub const fn new(size: Vec2) -> Self {
        Self { size, uv: [Vec2::ZERO, Vec2::ONE], centred: true }
    }
}

/// A triangle list. x runs right, y up, z towards the viewer; triangles are counter-clockwise from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShardMesh {
    /// Places of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// Unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, v down.
    pub uvs: Vec<[f32; 2]>,
    /// Three a triangle.
    pub indices: Vec<u32>,
    /// Where in `indices` the side faces begin: what comes before carries the picture, what follows the inside.
    pub sides: usize,
}

impl ShardMesh {
    /// Takes everything out and keeps the memory.
    pub fn clear(&mut self) {
        self.positions.clear();
        self.normals.clear();
        self.uvs.clear();
        self.indices.clear();
        self.sides = 0;
    }
}

impl Shards {
    /// A shard as a flat mesh at z = 0 that faces +z, as for a sprite. Its places are the [`corners`](Self::corners), in order.
    #[must_use]
    pub fn flat_mesh(&self, shard: u32, frame: &MeshFrame) -> ShardMesh {
        let mut mesh = ShardMesh::default();
        self.flat_mesh_into(shard, frame, &mut mesh);
        mesh
    }

    /// [`flat_mesh`](Self::flat_mesh), added to a mesh: to use memory again, or for many shards in one mesh.
    pub fn flat_mesh_into(&self, shard: u32, frame: &MeshFrame, mesh: &mut ShardMesh) {
        self.cap(shard, frame, 0.0, mesh);
        mesh.sides = mesh.indices.len();
    }

    /// A shard with `thickness`, half of it on either side of z = 0: front, back, and a side face for every edge.
    ///
    /// The back shows the picture as seen through the shard. Texture coordinates of the sides are lengths in the mesh's units:
    /// along the outline, and from the front. The mesh is closed: every edge has a triangle on either side.
    #[must_use]
    pub fn solid_mesh(&self, shard: u32, frame: &MeshFrame, thickness: f32) -> ShardMesh {
        let mut mesh = ShardMesh::default();
        self.solid_mesh_into(shard, frame, thickness, &mut mesh);
        mesh
    }

    /// [`solid_mesh`](Self::solid_mesh) in the memory of a mesh, of which nothing is kept.
    pub fn solid_mesh_into(&self, shard: u32, frame: &MeshFrame, thickness: f32, mesh: &mut ShardMesh) {
        mesh.clear();
        let half = 0.5 * thickness;
        let corners = self.corners(shard).len();
        mesh.positions.reserve(6 * corners);
        mesh.normals.reserve(6 * corners);
        mesh.uvs.reserve(6 * corners);
        mesh.indices.reserve(6 * self.triangles(shard).len() + 6 * corners);
        self.cap(shard, frame, half, mesh);
        self.cap(shard, frame, -half, mesh);
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
                    [a[0], a[1], half],
                    [b[0], b[1], half],
                    [b[0], b[1], -half],
                    [a[0], a[1], -half],
                ]);
                mesh.normals.extend([normal; 4]);
                let end = along + length;
                mesh.uvs.extend([[along, 0.0], [end, 0.0], [end, thickness], [along, thickness]]);
                mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| start + corner));
                along = end;
            }
            first += ring.len();
        }
    }

    /// The picture's side of a shard at height `z`; seen from below if that is negative.
    fn cap(&self, shard: u32, frame: &MeshFrame, z: f32, mesh: &mut ShardMesh) {
        let Some(centroid) = self.get(shard).map(|shard| shard.centroid) else { return };
        let middle = if frame.centred { centroid } else { 0.5 * self.extent() };
        let scale = frame.size / self.extent();
        let [uv_start, uv_end] = frame.uv;
        let uv_scale = (uv_end - uv_start) / self.extent();
        let start = mesh.positions.len() as u32;
        let corners = self.corners(shard);
        let places = corners.iter().map(|&corner| self.positions()[corner as usize]);
        mesh.positions.extend(places.clone().map(|pos| {
            let at = (pos - middle) * scale;
            [at.x, -at.y, z]
        }));
        mesh.uvs.extend(places.map(|pos| (uv_start + pos * uv_scale).to_array()));
        let normal = [0.0, 0.0, if z < 0.0 { -1.0 } else { 1.0 }];
        mesh.normals.extend(std::iter::repeat_n(normal, corners.len()));
        // From x to y is clockwise when y is up.
        let order = if z < 0.0 { [0, 1, 2] } else { [0, 2, 1] };
        let triangles = self.triangles(shard).iter();
        mesh.indices.extend(triangles.flat_map(|triangle| order.map(|i| start + triangle[i])));
    }
}
