//! [`Plane`]: where a flat surface lies in its own space, and meshes for its shards.

use crate::shatter::{MeshFrame, Pose, RimLook, ShardMesh};
use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, MeshVertexAttribute, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};

/// Where a flat surface lies in the entity's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::plugin) struct Plane {
    /// The middle of the picture.
    pub(in crate::plugin) middle: Vec3,
    /// From x right, y up, z towards the viewer.
    pub(in crate::plugin) rotation: Quat,
    /// Size of the picture, in the entity's units; below zero where it is mirrored.
    pub(in crate::plugin) size: Vec2,
}

/// How much corners may stand out of the plane, as a share of the diagonal.
const SLACK: f32 = 1e-3;

impl Plane {
    /// The plane of a picture whose texture coordinates (0, 0), (1, 0), (0, 1) and (1, 1) lie at these corners.
    #[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no meshes then"))]
    pub(in crate::plugin) fn through(corners: [Vec3; 4], normal: Vec3) -> Result<Self, &'static str> {
        let [origin, right, down, last] = corners;
        let (x, y, diagonal) = (right - origin, down - origin, last.distance(origin));
        if (right + down - origin).distance(last) > SLACK * diagonal || x.dot(y).abs() > SLACK * x.length() * y.length()
        {
            return Err("its corners do not form a rectangle");
        }
        let (Some(side), Some(up)) = (x.try_normalize(), (-y).try_normalize()) else { return Err("it has no size") };
        let mirror = if side.cross(up).dot(normal) < 0.0 { -1.0 } else { 1.0 };
        let side = side * mirror;
        let rotation = Quat::from_mat3(&Mat3::from_cols(side, up, side.cross(up)));
        Ok(Self { middle: 0.5 * (origin + last), rotation, size: Vec2::new(mirror * x.length(), y.length()) })
    }

    /// Where a shard is, whose centroid lies at `centroid` of a surface of `extent` (pattern units); its mesh reaches to `forward`
    /// (the entity's units) in front of its middle.
    pub(super) fn place(&self, centroid: Vec2, extent: Vec2, pose: Pose, forward: f32) -> Transform {
        let scale = self.size / extent;
        let at = (centroid - 0.5 * extent) * scale;
        let out = pose.offset * scale.extend(scale.y.abs());
        let translation = self.middle + self.rotation * (Vec3::new(at.x, -at.y, -forward) + out);
        Transform::from_translation(translation).with_rotation(self.rotation * pose.rotation)
    }

    /// How shards become meshes, `uv` being the part of the texture that the surface shows.
    pub(super) const fn frame(&self, uv: [Vec2; 2], rim: RimLook, seed: u64) -> MeshFrame {
        MeshFrame { size: self.size, uv, centred: true, rim, seed }
    }

    /// Whether the picture is mirrored.
    pub(super) fn is_mirrored(&self) -> bool {
        self.size.x * self.size.y < 0.0
    }
}

/// Which faces of a shard.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Faces {
    /// Those that show the picture.
    Picture,
    /// The others.
    Inside,
}

/// A mesh of the engine without anything in it.
pub(super) fn empty_mesh() -> Mesh {
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
}

/// Makes a mesh of the engine the faces of a shard, in the memory that it has.
pub(super) fn write_mesh(mesh: &mut Mesh, shard: &ShardMesh, faces: Faces, is_mirrored: bool, with_tangents: bool) {
    // Where the sides' vertices begin: their first triangle names the first of them.
    let split = shard.indices.get(shard.sides).map_or(shard.positions.len(), |first| *first as usize);
    let (vertices, indices) = match faces {
        Faces::Picture => (0..split, 0..shard.sides),
        Faces::Inside => (split..shard.positions.len(), shard.sides..shard.indices.len()),
    };
    let start = vertices.start as u32;
    let mut kept = match mesh.try_remove_indices() {
        Ok(Some(Indices::U32(kept))) => kept,
        _ => Vec::new(),
    };
    kept.clear();
    kept.extend(shard.indices[indices].iter().map(|index| index - start));
    // Where the picture is mirrored, what ran around counter-clockwise runs clockwise, and normals look inward.
    let side = if is_mirrored { -1.0 } else { 1.0 };
    if is_mirrored {
        kept.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    mesh.insert_indices(Indices::U32(kept));
    let normals = shard.normals[vertices.clone()].iter().map(|[x, y, z]| [side * x, side * y, *z]);
    if with_tangents {
        // u runs along x; the normal map's green points up.
        let tangent = |[x, y, z]: [f32; 3]| match faces {
            Faces::Inside => [y, -x, 0.0, 1.0],
            Faces::Picture => {
                let along = Vec3::new(1.0 - x * x, -x * y, -x * z).normalize_or(Vec3::X) * side;
                along.extend(side * z.signum()).to_array()
            }
        };
        fill(mesh, Mesh::ATTRIBUTE_TANGENT, normals.clone().map(tangent));
    }
    fill(mesh, Mesh::ATTRIBUTE_NORMAL, normals);
    fill(mesh, Mesh::ATTRIBUTE_POSITION, shard.positions[vertices.clone()].iter().copied());
    fill(mesh, Mesh::ATTRIBUTE_UV_0, shard.uvs[vertices].iter().copied());
    if faces == Faces::Picture && !shard.colors.is_empty() {
        fill(mesh, Mesh::ATTRIBUTE_COLOR, shard.colors.iter().copied());
    } else {
        mesh.remove_attribute(Mesh::ATTRIBUTE_COLOR);
    }
}

/// Replaces the values of an attribute, in the memory that they had.
fn fill<const N: usize>(mesh: &mut Mesh, attribute: MeshVertexAttribute, values: impl Iterator<Item = [f32; N]>)
where
    Vec<[f32; N]>: Into<VertexAttributeValues> + TryFrom<VertexAttributeValues>,
{
    let kept = mesh.try_remove_attribute(attribute).ok();
    let mut kept: Vec<[f32; N]> = kept.and_then(|kept| kept.try_into().ok()).unwrap_or_default();
    kept.clear();
    kept.extend(values);
    mesh.insert_attribute(attribute, kept);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirrored_picture_keeps_its_places() {
        let extent = Vec2::new(2.0, 1.0);
        for mirror in [1.0, -1.0] {
            let corner = |u: f32, v: f32| Vec3::new(mirror * (u - 0.5) * 4.0, 1.0 - 2.0 * v, 3.0);
            let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
            let plane = Plane::through(corners, Vec3::Z).unwrap();
            assert_eq!(plane.is_mirrored(), mirror < 0.0);
            let at = plane.place(Vec2::new(0.5, 0.25), extent, Pose::AT_REST, 0.0);
            assert!(at.translation.distance(corner(0.25, 0.25)) < 1e-5, "{at:?}");
            assert!((at.rotation * Vec3::Z).distance(Vec3::Z) < 1e-5, "its face looks at the viewer");
            let risen = Pose { offset: Vec3::new(0.25, 0.5, 1.0), ..Pose::AT_REST };
            let risen = plane.place(Vec2::new(0.5, 0.25), extent, risen, 0.0).translation - at.translation;
            assert!(risen.distance(Vec3::new(mirror * 0.5, 1.0, 2.0)) < 1e-5, "{risen}");
        }
    }

    #[test]
    fn what_is_not_a_rectangle_is_refused() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::NEG_Y, Vec3::new(1.0, -1.0, 0.5)];
        assert!(Plane::through(corners, Vec3::Z).is_err(), "bent");
        let corners = [Vec3::ZERO, Vec3::X, Vec3::new(0.5, -1.0, 0.0), Vec3::new(1.5, -1.0, 0.0)];
        assert!(Plane::through(corners, Vec3::Z).is_err(), "askew");
        assert!(Plane::through([Vec3::ZERO; 4], Vec3::Z).is_err(), "a point");
    }
}
