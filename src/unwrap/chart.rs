//! [`Chart`]: a part of a mesh in the plane.

use glam::{UVec2, Vec2, Vec3};

/// Triangles in a plane, y down, seen from outside.
pub(super) struct Chart {
    /// Each with its corners.
    pub(super) triangles: Vec<(usize, [Vec2; 3])>,
}

/// Where a chart begins.
#[derive(Clone, Copy)]
pub(super) struct Start {
    pub(super) triangle: usize,
    pub(super) point: Vec3,
    pub(super) right: Vec3,
}

/// The least and the greatest coordinates of some places; infinite if there is none.
pub(super) fn bounds(places: impl IntoIterator<Item = Vec2>) -> (Vec2, Vec2) {
    let grow = |(min, max): (Vec2, Vec2), at: Vec2| (min.min(at), max.max(at));
    places.into_iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), grow)
}

/// The cells, x and y below `size`, whose middles lie in a triangle, at least `clearance` cells from its edges.
pub(super) fn cells(corners: [Vec2; 3], size: UVec2, clearance: f32) -> impl Iterator<Item = UVec2> {
    let [a, b, c] = corners;
    let turn = (b - a).perp_dot(c - a).signum();
    let (min, max) = bounds(corners);
    let (min, max) = (min.max(Vec2::ZERO).as_uvec2(), max.ceil().as_uvec2().min(size));
    // How far a place is within an edge, times the length of the edge, and how far it has to be.
    let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| (p, (q - p) * turn, clearance * p.distance(q)));
    let all = (min.y..max.y).flat_map(move |y| (min.x..max.x).map(move |x| UVec2::new(x, y)));
    all.filter(move |cell| {
        let at = cell.as_vec2() + 0.5;
        edges.iter().all(|(from, along, least)| along.perp_dot(at - from) >= *least)
    })
}

/// The unit vector in the plane across `normal` that is nearest to a direction; `None` if that is about the normal's.
pub(super) fn along(way: Vec3, normal: Vec3) -> Option<Vec3> {
    let flat = way.try_normalize()?.reject_from_normalized(normal);
    (flat.length() > 0.01).then(|| flat.normalize())
}
