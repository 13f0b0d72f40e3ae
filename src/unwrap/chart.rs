//! [`Chart`]: a part of a mesh in the plane.

use glam::{Vec2, Vec3};

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

/// The unit vector in the plane across `normal` that is nearest to a direction; `None` if that is about the normal's.
pub(super) fn along(way: Vec3, normal: Vec3) -> Option<Vec3> {
    let flat = way.try_normalize()?.reject_from_normalized(normal);
    (flat.length() > 0.01).then(|| flat.normalize())
}
