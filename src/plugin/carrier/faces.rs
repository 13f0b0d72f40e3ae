//! [`Faces`]: meshes whose faces show the same part of the picture, such as Bevy's own boxes and cylinders.
//!
//! A crack in such a picture would show on all of those faces. So the textures of such a surface hold the picture twice, one above the
//! other: the upper one cracks, the lower one stays as it is. The surface's material shows the upper half where the mesh's texture
//! coordinates are 0..=1, and a copy of the mesh has the faces that are not to crack moved down by one picture. A slab, a box much thinner
//! than it is wide and high, cracks through: its back shows what its front shows.

use crate::plugin::carrier::mesh::Triangles;
use bevy::{
    math::{Affine2, Mat2},
    mesh::VertexAttributeValues,
    platform::collections::HashMap,
    prelude::*,
};

/// A box is a slab if it is no thicker than this share of its width and height.
const SLAB: f32 = 0.25;

/// Meshes with more triangles are taken as they are.
const MOST_TRIANGLES: usize = 1 << 16;

/// Cells along a side of the picture in which faces are looked for that overlap.
const CELLS: usize = 64;

/// How far other faces lie below the picture, in pictures: no point of the picture is in two of them, and none sees the other half.
const BELOW: f32 = 1.0 + 4e-4;

/// How far the narrow sides of a broken slab stay off the edge of the picture: beyond it is the other half.
const OFF_EDGE: f32 = 2e-3;

/// How exact corners of a box are, as a share of its diagonal, and texture coordinates.
const SLACK: f32 = 1e-4;

/// The faces of a mesh that share parts of the picture.
pub(crate) struct Faces {
    /// The face of each vertex; `None` = it is in no triangle.
    of_vertex: Vec<Option<u32>>,
    /// The face of each triangle, the first being 0.
    of_triangle: Vec<u32>,
    slab: Option<Slab>,
}

/// A box much thinner than it is wide and high.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slab {
    /// Its front: the first of its broad faces.
    front: u32,
    back: u32,
    /// The axis along which it is thin.
    axis: usize,
    /// How thick it is, units of the mesh.
    pub(crate) thickness: f32,
    /// From the place on its front (the other two axes, in order) to texture coordinates.
    to_uv: Affine2,
}

/// The axes of a picture on a face across this one.
const fn across(axis: usize) -> [usize; 2] {
    match axis {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}

impl Slab {
    /// Texture coordinates of the place on its front that is nearest to a point.
    fn uv(&self, point: Vec3) -> Vec2 {
        let [a, b] = across(self.axis);
        self.to_uv.transform_point2(Vec2::new(point[a], point[b]))
    }
}

impl Faces {
    /// The faces of a mesh, which is shown `scale` times as large, and whose texture coordinates `to_picture` makes those of the picture.
    /// `None` if each point of the picture is on one face at the most, or the faces cannot be told apart: they share vertices, the
    /// picture repeats on them, or there are too many triangles.
    pub(crate) fn of(mesh: &Mesh, to_picture: Affine2, scale: Vec3) -> Option<Self> {
        let triangles = Triangles::of(mesh).ok()?;
        let area = to_picture.matrix2.determinant().abs();
        if triangles.len() > MOST_TRIANGLES || area.is_nan() || area <= 1e-6 {
            return None;
        }
        let solid = BoxShape::of(&triangles);
        let of_triangle = match &solid {
            Some(solid) => (0..triangles.len()).map(|i| solid.face_of(&triangles, i)).collect::<Option<Vec<u32>>>()?,
            None => islands(&triangles)?,
        };
        let mut of_vertex = vec![None; triangles.vertices()];
        for (i, face) in of_triangle.iter().enumerate() {
            for vertex in triangles.corners(i)? {
                let known = of_vertex.get_mut(vertex)?.get_or_insert(*face);
                if known != face {
                    return None;
                }
            }
        }
        if !overlap(&triangles, &of_triangle, to_picture)? {
            return None;
        }
        let slab = solid.and_then(|solid| solid.slab(&triangles, &of_triangle, scale));
        Some(Self { of_vertex, of_triangle, slab })
    }

    /// Its shape, if it is a slab.
    pub(crate) const fn slab(&self) -> Option<&Slab> {
        self.slab.as_ref()
    }

    /// The face that cracks if nothing has been hit yet.
    pub(crate) fn first(&self) -> u32 {
        self.slab.map_or_else(|| self.of_triangle.first().copied().unwrap_or(0), |slab| slab.front)
    }

    /// The face that cracks when a hit lands on this triangle.
    pub(crate) fn face(&self, triangle: usize) -> u32 {
        match self.slab {
            Some(slab) => slab.front,
            None => self.of_triangle.get(triangle).copied().unwrap_or_else(|| self.first()),
        }
    }

    /// Texture coordinates where a slab is hit at `point`.
    pub(crate) fn uv_of_slab(&self, point: Vec3) -> Option<Vec2> {
        self.slab.map(|slab| slab.uv(point))
    }

    /// Gives the vertices of `mesh`, which is the one that the faces are of or a copy of it with tangents, texture coordinates of their own: only
    /// `face` shows the picture that cracks, and of a slab its back; and its narrow sides if it `is_open`, so that they go where it has holes.
    pub(crate) fn split(&self, mesh: &mut Mesh, face: u32, is_open: bool, to_picture: Affine2) {
        let from_picture = to_picture.inverse();
        let positions = match mesh.try_attribute_option(Mesh::ATTRIBUTE_POSITION) {
            Ok(Some(VertexAttributeValues::Float32x3(positions))) => positions.clone(),
            _ => return,
        };
        if let Ok(Some(VertexAttributeValues::Float32x2(uvs))) = mesh.try_attribute_mut_option(Mesh::ATTRIBUTE_UV_0) {
            for ((uv, position), of) in uvs.iter_mut().zip(&positions).zip(&self.of_vertex) {
                let position = Vec3::from_array(*position);
                let Some(of) = of.filter(|of| *of != face) else { continue };
                *uv = match self.slab {
                    Some(slab) if of == slab.back => slab.uv(position),
                    Some(slab) if is_open => {
                        let on_picture = to_picture.transform_point2(slab.uv(position));
                        let (least, most) = (Vec2::splat(OFF_EDGE), Vec2::splat(1.0 - OFF_EDGE));
                        from_picture.transform_point2(on_picture.clamp(least, most))
                    }
                    _ => from_picture.transform_point2(to_picture.transform_point2(Vec2::from(*uv)) + BELOW * Vec2::Y),
                }
                .to_array();
            }
        }
        let Some(slab) = self.slab else { return };
        // On its back u runs as on its front, so normals look the other way beside it.
        if let Ok(Some(VertexAttributeValues::Float32x4(tangents))) =
            mesh.try_attribute_mut_option(Mesh::ATTRIBUTE_TANGENT)
            && let Some(front) = self.of_vertex.iter().position(|of| *of == Some(slab.front))
            && let Some([x, y, z, w]) = tangents.get(front).copied()
        {
            for (tangent, _) in tangents.iter_mut().zip(&self.of_vertex).filter(|(_, of)| **of == Some(slab.back)) {
                *tangent = [x, y, z, -w];
            }
        }
    }
}

/// A mesh all of whose triangles lie in the sides of the box around it.
struct BoxShape {
    min: Vec3,
    max: Vec3,
}

impl BoxShape {
    /// `None` if it is no such mesh, or has no volume.
    fn of(triangles: &Triangles<'_>) -> Option<Self> {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for i in 0..triangles.len() {
            for corner in triangles.get(i)?.0 {
                (min, max) = (min.min(corner), max.max(corner));
            }
        }
        let solid = Self { min, max };
        let is_body = (max - min).min_element() > 10.0 * solid.slack();
        (is_body && (0..triangles.len()).all(|i| solid.face_of(triangles, i).is_some())).then_some(solid)
    }

    fn slack(&self) -> f32 {
        SLACK * self.min.distance(self.max)
    }

    /// The side in which a triangle lies: twice the axis, and one more for the far one.
    fn face_of(&self, triangles: &Triangles<'_>, i: usize) -> Option<u32> {
        let (corners, _) = triangles.get(i)?;
        (0..6u32).find(|side| {
            let axis = (side / 2) as usize;
            let at = if side % 2 == 0 { self.min[axis] } else { self.max[axis] };
            corners.iter().all(|corner| (corner[axis] - at).abs() <= self.slack())
        })
    }

    /// The slab that it is, if it is one whose broad faces are there, and the picture lies flat on the front.
    fn slab(&self, triangles: &Triangles<'_>, of_triangle: &[u32], scale: Vec3) -> Option<Slab> {
        let size = (self.max - self.min) * scale.abs();
        let axis = (0..3).min_by(|a, b| size[*a].total_cmp(&size[*b]))?;
        let [a, b] = across(axis);
        let thickest = SLAB * size[a].min(size[b]);
        if size[axis].is_nan() || thickest.is_nan() || size[axis] > thickest {
            return None;
        }
        let is_broad = |face: &u32| (*face / 2) as usize == axis;
        let front = *of_triangle.iter().find(|face| is_broad(face))?;
        let back = front ^ 1;
        if !of_triangle.contains(&back) {
            return None;
        }
        let of_front = || (0..triangles.len()).filter(|i| of_triangle[*i] == front).filter_map(|i| triangles.get(i));
        let place = |point: Vec3| Vec2::new(point[a], point[b]);
        let area = |[p, q, r]: [Vec3; 3]| (place(q) - place(p)).perp_dot(place(r) - place(p)).abs();
        let ([p, q, r], uvs) = of_front().max_by(|one, other| area(one.0).total_cmp(&area(other.0)))?;
        let from = Mat2::from_cols(place(q) - place(p), place(r) - place(p));
        if from.determinant() == 0.0 {
            return None;
        }
        let matrix = Mat2::from_cols(uvs[1] - uvs[0], uvs[2] - uvs[0]) * from.inverse();
        let to_uv = Affine2::from_mat2_translation(matrix, uvs[0] - matrix * place(p));
        let is_flat = of_front().all(|(corners, uvs)| {
            let pairs = corners.into_iter().zip(uvs);
            pairs.into_iter().all(|(corner, uv)| to_uv.transform_point2(place(corner)).distance(uv) < 10.0 * SLACK)
        });
        is_flat.then(|| Slab { front, back, axis, thickness: (self.max - self.min)[axis], to_uv })
    }
}

/// The parts of a mesh that hang together, vertices in one place with the same texture coordinates being one.
fn islands(triangles: &Triangles<'_>) -> Option<Vec<u32>> {
    let mut first: HashMap<[u32; 5], u32> = HashMap::default();
    // For each triangle another one of its island with a lower number, or itself.
    let mut lower: Vec<u32> = (0..triangles.len() as u32).collect();
    fn root(lower: &mut [u32], mut i: u32) -> u32 {
        while lower[i as usize] != i {
            lower[i as usize] = lower[lower[i as usize] as usize];
            i = lower[i as usize];
        }
        i
    }
    for i in 0..triangles.len() {
        let (corners, uvs) = triangles.get(i)?;
        for (corner, uv) in corners.into_iter().zip(uvs) {
            // 0 and -0 are the same.
            let key = [corner.x, corner.y, corner.z, uv.x, uv.y].map(|value| (value + 0.0).to_bits());
            let other = *first.entry(key).or_insert(i as u32);
            let (a, b) = (root(&mut lower, other), root(&mut lower, i as u32));
            lower[a.max(b) as usize] = a.min(b);
        }
    }
    Some((0..triangles.len() as u32).map(|i| root(&mut lower, i)).collect())
}

/// Whether faces show the same part of the picture; `None` if they show what is beyond it.
fn overlap(triangles: &Triangles<'_>, of_triangle: &[u32], to_picture: Affine2) -> Option<bool> {
    let mut cells: Vec<Option<u32>> = vec![None; CELLS * CELLS];
    let (mut shared, mut own) = (HashMap::<u32, u32>::default(), HashMap::<u32, u32>::default());
    for (i, face) in of_triangle.iter().enumerate() {
        let uvs = triangles.get(i)?.1.map(|uv| to_picture.transform_point2(uv));
        let is_within = |uv: &Vec2| uv.cmpge(Vec2::splat(-SLACK)).all() && uv.cmple(Vec2::splat(1.0 + SLACK)).all();
        if !uvs.iter().all(is_within) {
            return None;
        }
        let [a, b, c] = uvs.map(|uv| uv * CELLS as f32);
        let turn = (b - a).perp_dot(c - a).signum();
        let (min, max) = (a.min(b).min(c).max(Vec2::ZERO).as_usizevec2(), a.max(b).max(c).ceil().as_usizevec2());
        for y in min.y..max.y.min(CELLS) {
            for x in min.x..max.x.min(CELLS) {
                let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let is_inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).perp_dot(at - *p) * turn > 0.0);
                if is_inside {
                    match cells[CELLS * y + x] {
                        Some(other) if other != *face => *shared.entry(*face).or_default() += 1,
                        _ => {
                            cells[CELLS * y + x] = Some(*face);
                            *own.entry(*face).or_default() += 1;
                        }
                    }
                }
            }
        }
    }
    // A few cells where neighbours meet do not count.
    Some(shared.iter().any(|(face, shared)| 10 * shared > own.get(face).copied().unwrap_or(0) + shared))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plugin::carrier::mesh::{closest, place_of};

    fn faces(mesh: &Mesh, scale: Vec3) -> Option<Faces> {
        Faces::of(mesh, Affine2::IDENTITY, scale)
    }

    fn uvs(mesh: &Mesh) -> Vec<Vec2> {
        let Some(VertexAttributeValues::Float32x2(uvs)) = mesh.attribute(Mesh::ATTRIBUTE_UV_0) else { panic!() };
        uvs.iter().map(|uv| Vec2::from(*uv)).collect()
    }

    #[test]
    fn boxes_and_cylinders_have_faces_that_share_the_picture() {
        let count = |mesh: Mesh| {
            let mut all = faces(&mesh, Vec3::ONE)?.of_triangle;
            all.sort_unstable();
            all.dedup();
            Some(all.len())
        };
        assert_eq!(count(Cuboid::default().into()), Some(6));
        assert_eq!(count(Cuboid::new(4.0, 2.0, 0.1).into()), Some(6));
        assert_eq!(count(Cylinder::default().into()), Some(3));
        // One face, or none twice.
        assert_eq!(count(Rectangle::default().into()), None);
        assert_eq!(count(Plane3d::default().mesh().subdivisions(5).into()), None);
        assert_eq!(count(Sphere::default().mesh().uv(32, 18)), None);
        assert_eq!(count(Sphere::default().mesh().ico(5).unwrap()), None);
        assert_eq!(count(Torus::default().into()), None);
        // The picture repeats, or is one line of it.
        let tiled = |scale| Faces::of(&Cuboid::default().into(), Affine2::from_scale(scale), Vec3::ONE).is_some();
        assert!(!tiled(Vec2::splat(2.0)) && !tiled(Vec2::new(1.0, 0.0)) && tiled(Vec2::new(0.5, 0.5)));
        // Odd ones.
        assert_eq!(count(Mesh::from(Cuboid::default()).with_removed_attribute(Mesh::ATTRIBUTE_UV_0)), None);
        let mut wild = Mesh::from(Cuboid::default());
        wild.insert_indices(bevy::mesh::Indices::U32(vec![0, 1, 2, 3, 4, 999]));
        assert_eq!(count(wild), None);
        let mut wild = Mesh::from(Cuboid::default());
        wild.insert_attribute(Mesh::ATTRIBUTE_POSITION, vec![[f32::NAN; 3]; 24]);
        assert!(count(wild).is_none_or(|n| n == 6));
    }

    /// Faces side by side in the picture, as an artist lays them out, stay as they are.
    #[test]
    fn faces_with_room_of_their_own_are_left_alone() {
        let mut mesh = Mesh::from(Cuboid::default());
        let Some(VertexAttributeValues::Float32x2(uvs)) = mesh.attribute_mut(Mesh::ATTRIBUTE_UV_0) else { panic!() };
        for (i, uv) in uvs.iter_mut().enumerate() {
            let face = (i / 4) as f32;
            *uv = [(uv[0] + face % 3.0) / 3.0, (uv[1] + (face / 3.0).floor()) / 2.0];
        }
        assert!(faces(&mesh, Vec3::ONE).is_none());
    }

    #[test]
    fn only_the_face_that_was_hit_keeps_its_place_in_the_picture() {
        let mesh = Mesh::from(Cuboid::default());
        let faces = faces(&mesh, Vec3::ONE).unwrap();
        assert!(faces.slab().is_none());
        for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
            let point = 0.5 * normal + 0.2 * normal.any_orthonormal_vector();
            let (triangle, uv) = closest(&mesh, point).unwrap();
            let mut own = mesh.clone();
            faces.split(&mut own, faces.face(triangle), false, Affine2::IDENTITY);
            let moved = uvs(&own).into_iter().zip(uvs(&mesh)).filter(|(own, before)| own != before).count();
            assert_eq!(moved, 20, "all but four vertices");
            assert!(uvs(&own).into_iter().zip(uvs(&mesh)).all(|(own, uv)| own == uv || own == uv + BELOW * Vec2::Y));
            // The places of its cracks are on it, up to the very edge.
            for uv in [uv, Vec2::ZERO, Vec2::ONE, Vec2::X, Vec2::Y, Vec2::splat(0.5)] {
                let (at, out) = place_of(&own, uv).unwrap();
                assert!((at.dot(normal) - 0.5).abs() < 1e-5 && out.dot(normal) > 0.999, "{normal}: {at} {out}");
            }
            assert!(place_of(&own, uv).unwrap().0.distance(point) < 1e-5);
        }
    }

    #[test]
    fn slabs_crack_through() {
        // A unit box that is scaled is a slab as well.
        let thin: [(Vec3, Vec3); 4] = [
            (Vec3::new(4.0, 2.0, 0.1), Vec3::ONE),
            (Vec3::ONE, Vec3::new(4.0, -2.0, 0.1)),
            (Vec3::new(0.2, 3.0, 2.0), Vec3::ONE),
            (Vec3::new(3.0, 0.2, 2.0), Vec3::ONE),
        ];
        for (size, scale) in thin {
            let mesh = Mesh::from(Cuboid::from_size(size));
            let faces = faces(&mesh, scale).unwrap();
            let slab = *faces.slab().expect("a slab");
            assert_eq!(slab.thickness, size[slab.axis]);
            let (mut closed, mut open) = (mesh.clone(), mesh.clone());
            faces.split(&mut closed, faces.first(), false, Affine2::IDENTITY);
            faces.split(&mut open, faces.first(), true, Affine2::IDENTITY);
            let Some(VertexAttributeValues::Float32x3(positions)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION) else {
                panic!()
            };
            let (before, closed, open) = (uvs(&mesh), uvs(&closed), uvs(&open));
            for (i, position) in positions.iter().enumerate() {
                let position = Vec3::from(*position);
                let through = slab.uv(position);
                match faces.of_vertex[i] {
                    Some(face) if face == slab.front => assert!(closed[i] == before[i] && open[i] == before[i]),
                    Some(face) if face == slab.back => assert!(closed[i] == through && open[i] == through),
                    _ => {
                        assert_eq!(closed[i], before[i] + BELOW * Vec2::Y);
                        assert!(open[i].distance(through) < 2.0 * OFF_EDGE && open[i].max_element() < 1.0);
                    }
                }
            }
            // Wherever it is hit, front, back or side, the crack is at that place of its front.
            let mut cracked = mesh.clone();
            faces.split(&mut cracked, faces.first(), false, Affine2::IDENTITY);
            for share in [Vec3::new(0.3, 0.1, 0.5), Vec3::new(-0.5, 0.2, 0.0), Vec3::new(0.1, -0.2, -0.5)] {
                let point = share * size;
                let uv = faces.uv_of_slab(point).unwrap();
                let (at, _) = place_of(&cracked, uv).unwrap();
                let mut away = at - point;
                away[slab.axis] = 0.0;
                assert!(away.length() < 1e-4 * size.length(), "{point} {at}");
            }
        }
        for (size, scale) in
            [(Vec3::ONE, Vec3::ONE), (Vec3::new(1.0, 1.0, 0.3), Vec3::ONE), (Vec3::new(9.0, 0.2, 0.3), Vec3::ONE)]
        {
            assert!(faces(&Cuboid::from_size(size).into(), scale).unwrap().slab().is_none(), "{size}");
        }
    }
}
