//! Faces that meet in a part of an edge: a panel on a floor that is wider, a step against a wall.

use super::shape::MeshShape;
use glam::Vec3;

/// How far edges may be from one another that are one, as a share of the longer; and how much of it they must have in common at least.
const SLACK: f32 = 1e-4;

/// More edges at borders are not compared with one another.
const MAX_EDGES: usize = 2048;

/// An edge of a triangle at a border, on which a part of the edge of another lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Beside {
    pub(super) triangle: usize,
    /// The corner where the edge begins.
    pub(super) corner: usize,
    pub(super) other: usize,
}

/// All of them, in the order of the triangles. Empty where there are more than [`MAX_EDGES`] edges at borders.
pub(super) fn find(shape: &MeshShape) -> Vec<Beside> {
    let mut edges = Vec::new();
    for triangle in (0..shape.len()).filter(|triangle| shape.has_area(*triangle)) {
        let corners = shape.corners(triangle);
        for corner in (0..3).filter(|corner| shape.across(triangle)[*corner].is_none()) {
            edges.push((triangle, corner, corners[corner], corners[(corner + 1) % 3]));
            if edges.len() > MAX_EDGES {
                return Vec::new();
            }
        }
    }
    let mut found = Vec::new();
    for &(triangle, corner, a, b) in &edges {
        for &(other, _, c, d) in &edges {
            if shape.face(triangle) != shape.face(other) && lie_on_one_another([a, b], [c, d]) {
                found.push(Beside { triangle, corner, other });
            }
        }
    }
    found.sort_unstable();
    found
}

/// Those of a triangle.
pub(super) fn of(all: &[Beside], triangle: usize) -> impl Iterator<Item = &Beside> {
    let first = all.partition_point(|beside| beside.triangle < triangle);
    all[first..].iter().take_while(move |beside| beside.triangle == triangle)
}

/// Whether two edges that run opposite ways have more than a point in common.
fn lie_on_one_another(one: [Vec3; 2], other: [Vec3; 2]) -> bool {
    common(one, other).is_some()
}

/// What two edges that run opposite ways have in common, if that is more than a point: both its ends, as shares of the way along the first and
/// along the other.
pub(super) fn common([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> Option<[[f32; 2]; 2]> {
    let length = a.distance(b);
    let slack = SLACK * length.max(c.distance(d));
    let along = (b - a) / length;
    let is_off = |at: Vec3| (at - a).reject_from_normalized(along).length_squared() > slack * slack;
    if is_off(c) || is_off(d) {
        return None;
    }
    let (from, to) = ((d - a).dot(along), (c - a).dot(along));
    let ends = [from.max(0.0), to.min(length)];
    (to > from && ends[1] - ends[0] > slack)
        .then(|| [ends.map(|at| at / length), ends.map(|at| (to - at) / (to - from))])
}
