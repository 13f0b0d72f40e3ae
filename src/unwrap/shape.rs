//! [`MeshShape`]: the triangles of a mesh, and which of them meet.

use super::error::{MAX_TRIANGLES, UnwrapError};
use glam::Vec3;
use std::collections::HashMap;

/// Triangles lie in one plane if the sine of the angle between them is below this.
const FLAT: f32 = 1e-3;

/// Positions nearer to one another are one, as a share of the mesh's diagonal: where a ball is closed, its ends differ by rounding.
const SAME: f32 = 1e-5;

/// Positions beyond this are refused.
const FARTHEST: f32 = 1e9;

/// A mesh whose vertices in one place are one.
#[derive(Clone, Debug)]
pub struct MeshShape {
    /// Each place once.
    points: Vec<Vec3>,
    /// The point of each corner.
    triangles: Vec<[u32; 3]>,
    /// Unit normals; zero for a triangle without area.
    normals: Vec<Vec3>,
    /// Across the edge from each corner to the next: the other triangle, and its corner where that edge begins, seen from there.
    across: Vec<[Option<(u32, u8)>; 3]>,
    /// The flat face of each triangle.
    face: Vec<u32>,
    faces: usize,
    area: f64,
}

impl MeshShape {
    /// The shape of triangles, each given by three numbers of positions, counterclockwise from outside.
    ///
    /// Positions that are no further from one another than 1e-5 of the mesh's diagonal are one. Triangles without area are left out. An edge of more than two triangles, or of two that face opposite ways, is a border.
    ///
    /// # Errors
    /// [`UnwrapError`] if a number or position is out of range, or no triangle has an area.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, UnwrapError> {
        if triangles.len() > MAX_TRIANGLES {
            return Err(UnwrapError::TooManyTriangles(triangles.len()));
        }
        if let Some(i) = positions.iter().position(|at| !at.is_finite() || at.abs().max_element() > FARTHEST) {
            return Err(UnwrapError::Position(i));
        }
        let (points, of_position) = weld(positions);
        let vertices = positions.len();
        let point =
            |vertex: u32| of_position.get(vertex as usize).copied().ok_or(UnwrapError::NoVertex { vertex, vertices });
        let triangles = triangles
            .iter()
            .map(|[a, b, c]| Ok([point(*a)?, point(*b)?, point(*c)?]))
            .collect::<Result<Vec<_>, UnwrapError>>()?;
        let (mut area, mut normals) = (0.0, Vec::with_capacity(triangles.len()));
        for [a, b, c] in triangles.iter().map(|corners| corners.map(|point| points[point as usize])) {
            let across = (b - a).cross(c - a);
            let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
            // A sliver has no direction that could be relied on.
            let has_area = across.length() > 1e-6 * longest;
            normals.push(if has_area { across.normalize_or_zero() } else { Vec3::ZERO });
            area += f64::from(0.5 * across.length());
        }
        if normals.iter().all(|normal| *normal == Vec3::ZERO) {
            return Err(UnwrapError::NoTriangles(triangles.len()));
        }
        let across = neighbours(&triangles, &normals);
        let (face, faces) = flat_faces(&normals, &across);
        Ok(Self { points, triangles, normals, across, face, faces, area })
    }

    /// Number of triangles, those without area among them.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there is no triangle: never.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The area of all triangles, units of the positions.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a float of less precision")]
    pub const fn area(&self) -> f32 {
        self.area as f32
    }

    /// Number of flat faces: triangles that meet in an edge and lie in one plane are one.
    #[must_use]
    pub const fn faces(&self) -> usize {
        self.faces
    }

    /// The flat face of a triangle that is there.
    pub(super) fn face(&self, triangle: usize) -> u32 {
        self.face[triangle]
    }

    /// Whether the triangle is there and has an area.
    #[must_use]
    pub fn has_area(&self, triangle: usize) -> bool {
        self.normals.get(triangle).is_some_and(|normal| *normal != Vec3::ZERO)
    }

    /// Number of places.
    pub(super) const fn points(&self) -> usize {
        self.points.len()
    }

    /// The places of a triangle's corners.
    pub(super) fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.numbers(triangle).map(|point| self.points[point])
    }

    pub(super) fn numbers(&self, triangle: usize) -> [usize; 3] {
        self.triangles[triangle].map(|point| point as usize)
    }

    pub(super) fn normal(&self, triangle: usize) -> Vec3 {
        self.normals[triangle]
    }

    pub(super) fn across(&self, triangle: usize) -> [Option<(u32, u8)>; 3] {
        self.across[triangle]
    }

    pub(super) fn point(&self, point: usize) -> Vec3 {
        self.points[point]
    }

    pub(super) fn centroid(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (a + b + c) / 3.0
    }
}

/// Each place once, and the place of each position.
fn weld(positions: &[Vec3]) -> (Vec<Vec3>, Vec<u32>) {
    let (min, max) =
        positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), at| (min.min(*at), max.max(*at)));
    let near = (SAME * min.distance(max)).max(f32::MIN_POSITIVE);
    // In cells that are larger: most positions lie in one, whatever is near them.
    let cell = |at: Vec3| ((at - min) / (8.0 * near)).floor().as_ivec3();
    let mut points = Vec::<Vec3>::new();
    let mut cells: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
    let mut find = |at: Vec3| {
        let (low, high) = (cell(at - near), cell(at + near));
        for (x, y, z) in
            (low.x..=high.x).flat_map(|x| (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| (x, y, z))))
        {
            let known = cells.get(&[x, y, z]).into_iter().flatten();
            if let Some(point) = known.copied().find(|point| points[*point as usize].distance(at) <= near) {
                return point;
            }
        }
        let point = points.len() as u32;
        points.push(at);
        cells.entry(cell(at).to_array()).or_default().push(point);
        point
    };
    let of_position = positions.iter().map(|at| find(*at)).collect();
    (points, of_position)
}

/// The triangle across each edge, if there is one.
fn neighbours(triangles: &[[u32; 3]], normals: &[Vec3]) -> Vec<[Option<(u32, u8)>; 3]> {
    // Each edge, as it runs in a triangle: at most one, else none counts.
    let mut edges: HashMap<[u32; 2], Option<(u32, u8)>> = HashMap::new();
    let with_area = || triangles.iter().zip(normals).enumerate().filter(|(_, (_, normal))| **normal != Vec3::ZERO);
    for (triangle, (corners, _)) in with_area() {
        for corner in 0..3 {
            let edge = [corners[corner], corners[(corner + 1) % 3]];
            edges.entry(edge).and_modify(|known| *known = None).or_insert(Some((triangle as u32, corner as u8)));
        }
    }
    let mut across = vec![[None; 3]; triangles.len()];
    for (triangle, (corners, _)) in with_area() {
        for corner in 0..3 {
            let (from, to) = (corners[corner], corners[(corner + 1) % 3]);
            let is_own = edges.get(&[from, to]).is_some_and(Option::is_some);
            across[triangle][corner] = edges.get(&[to, from]).copied().flatten().filter(|_| is_own);
        }
    }
    across
}

/// The flat face of each triangle, and how many there are. One without area counts to the first.
fn flat_faces(normals: &[Vec3], across: &[[Option<(u32, u8)>; 3]]) -> (Vec<u32>, usize) {
    const NONE: u32 = u32::MAX;
    let mut face = vec![NONE; normals.len()];
    let (mut faces, mut next) = (0, Vec::new());
    for first in 0..normals.len() {
        if face[first] != NONE || normals[first] == Vec3::ZERO {
            continue;
        }
        face[first] = faces;
        next.push(first);
        while let Some(triangle) = next.pop() {
            for (other, _) in across[triangle].into_iter().flatten() {
                let other = other as usize;
                // As the first, so that no curve counts as flat bit by bit.
                let is_flat = normals[other].dot(normals[first]) > 0.0
                    && normals[other].cross(normals[first]).length_squared() < FLAT * FLAT;
                if face[other] == NONE && is_flat {
                    face[other] = faces;
                    next.push(other);
                }
            }
        }
        faces += 1;
    }
    face.iter_mut().for_each(|face| *face = if *face == NONE { 0 } else { *face });
    (face, faces as usize)
}
