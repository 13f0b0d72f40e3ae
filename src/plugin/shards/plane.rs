//! [`Plane`]: where a flat surface lies in its own space.

use crate::shatter::Pose;
use bevy::prelude::*;

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

    /// Whether the picture is mirrored.
    pub(super) fn is_mirrored(&self) -> bool {
        self.size.x * self.size.y < 0.0
    }
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
