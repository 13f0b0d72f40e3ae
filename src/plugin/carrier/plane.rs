//! [`Plane`]: where a flat surface lies in its own space.

use crate::plugin::carrier::space;
use crate::shatter::{Floor, Pose, ShellPlace};
use bevy::prelude::*;

/// Where a flat surface lies in the entity's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    /// The middle of the picture.
    pub(crate) middle: Vec3,
    /// From x right, y up, z towards the viewer.
    pub(crate) rotation: Quat,
    /// Size of the picture, in the entity's units; below zero where it is mirrored.
    pub(crate) size: Vec2,
    /// How thick it is, in the entity's units, if it has a thickness.
    pub(crate) thickness: Option<f32>,
}

/// How much corners may stand out of the plane, as a share of the diagonal.
const SLACK: f32 = 1e-3;

impl Plane {
    /// The plane of a picture whose texture coordinates (0, 0), (1, 0), (0, 1) and (1, 1) lie at these corners.
    #[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no meshes then"))]
    pub(crate) fn through(corners: [Vec3; 4], normal: Vec3) -> Result<Self, &'static str> {
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
        let size = Vec2::new(mirror * x.length(), y.length());
        Ok(Self { middle: 0.5 * (origin + last), rotation, size, thickness: None })
    }

    /// The plane in which a place of a body lies that is laid out flat in a plane of `extent`, `at` being where it is laid out. Exact there,
    /// whatever is stretched. `None` if it has no size.
    pub(crate) fn on(place: &ShellPlace, at: Vec2, extent: Vec2) -> Option<Self> {
        let (side, scale) = (place.right.try_normalize()?, Vec2::new(place.right.length(), place.down.length()));
        let up = place.normal.cross(side);
        let to_middle = (0.5 * extent - at) * scale;
        let middle = place.position + side * to_middle.x - up * to_middle.y;
        let (rotation, size) = (Quat::from_mat3(&Mat3::from_cols(side, up, place.normal)), extent * scale);
        (middle.is_finite() && size.is_finite()).then_some(Self { middle, rotation, size, thickness: None })
    }

    /// How thick shards are, in the entity's units: as a slab is, else `thickness` (pattern units).
    pub(crate) fn thickness(&self, thickness: f32, extent: Vec2) -> f32 {
        self.thickness.unwrap_or(thickness * self.size.y.abs() / extent.y)
    }

    /// Where a shard is, whose centroid lies at `centroid` of a surface of `extent` (pattern units); its mesh reaches to `forward`
    /// (the entity's units) in front of its middle.
    pub(crate) fn place(&self, centroid: Vec2, extent: Vec2, pose: Pose, forward: f32) -> Transform {
        let scale = self.size / extent;
        let at = (centroid - 0.5 * extent) * scale;
        let out = pose.offset * scale.extend(scale.y.abs());
        let translation = self.middle + self.rotation * (Vec3::new(at.x, -at.y, -forward) + out);
        Transform::from_translation(translation).with_rotation(self.rotation * pose.rotation)
    }

    /// A point of the entity's own space in the axes of flights on a surface of `extent`, pattern units.
    pub(crate) fn flight_axes(&self, point: Vec3, extent: Vec2) -> Vec3 {
        let scale = self.size / extent;
        let way = self.rotation.inverse() * (point - self.middle) / scale.extend(scale.y.abs());
        way + (0.5 * extent * Vec2::new(1.0, -1.0)).extend(0.0)
    }

    /// The acceleration `gravity`, given along the world's x and y, in the axes of the flights on a surface of `extent`, all in pattern
    /// units. `None` if there is no telling: the surface has no size in the world.
    pub(crate) fn down(&self, extent: Vec2, place: &GlobalTransform, gravity: Vec2) -> Option<Vec3> {
        let scale = self.size / extent;
        let scale = scale.extend(scale.y.abs());
        let shown = |axis: Vec3| place.affine().transform_vector3(self.rotation * (axis * scale)).length();
        // A pattern unit is as long as this in the world.
        let unit = (shown(Vec3::X) * shown(Vec3::Y)).sqrt();
        let own = space::to_local(place)?.transform_vector3(gravity.extend(0.0) * unit);
        let down = self.rotation.inverse() * own / scale;
        down.is_finite().then_some(down)
    }

    /// The world's plane y = `height`, for flights on a surface of `extent`; pieces are `thickness` (the entity's units) thick if they lie
    /// flat. `None` if there is no telling: the surface has no size in the world.
    pub(crate) fn floor(
        &self,
        extent: Vec2,
        place: &GlobalTransform,
        height: f32,
        thickness: Option<f32>,
    ) -> Option<Floor> {
        let scale = self.size / extent;
        let scale = scale.extend(scale.y.abs());
        let corner = 0.5 * extent * Vec2::new(-1.0, 1.0);
        let at =
            |point: Vec3| place.transform_point(self.middle + self.rotation * ((point + corner.extend(0.0)) * scale)).y;
        let none = at(Vec3::ZERO);
        let mut up = Vec3::new(at(Vec3::X), at(Vec3::Y), at(Vec3::Z)) - none;
        if thickness.is_none() {
            // In 2D pieces stay in the plane of the picture.
            up.z = 0.0;
        }
        let (up, length) = (up.try_normalize()?, up.length());
        let clearance = thickness.map_or(0.0, |thickness| 0.5 * thickness / scale.y.abs());
        let floor =
            Floor { up, height: (height - none) / length, clearance, depth: 0.0, lies_flat: thickness.is_some() };
        floor.height.is_finite().then_some(floor)
    }

    /// Whether the picture is mirrored.
    pub(crate) fn is_mirrored(&self) -> bool {
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

    /// However a surface is turned, mirrored and scaled, what falls by the formula falls along the world's y.
    #[test]
    fn down_is_the_worlds() {
        let mut rng = crate::math::Rng::new(3);
        for round in 0..200 {
            let mut number = |from, to| rng.range(from, to);
            let rotation = Quat::from_euler(EulerRot::XYZ, number(-3.0, 3.0), number(-1.5, 1.5), number(-3.0, 3.0));
            let mut scale = || number(0.3, 4.0) * if number(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
            let scale = Vec3::new(scale(), scale(), scale());
            let place = Transform { translation: Vec3::new(1.0, 2.0, 3.0), rotation, scale };
            // Under a parent that shears it.
            let parent = Transform::from_scale(Vec3::new(1.0, 2.0, 0.5)).with_rotation(Quat::from_rotation_z(0.4));
            let place = GlobalTransform::from(parent) * GlobalTransform::from(place);
            let (extent, size) = (Vec2::new(1.5, 1.0), Vec2::new(if round % 2 == 0 { 3.0 } else { -3.0 }, 2.0));
            let plane = Plane { middle: Vec3::X, rotation: Quat::from_rotation_x(0.7), size, thickness: None };
            let down = plane.down(extent, &place, Vec2::new(0.0, -2.0)).unwrap();
            let at = |offset| {
                let pose = Pose { offset, ..Pose::AT_REST };
                place.transform_point(plane.place(Vec2::ZERO, extent, pose, 0.0).translation)
            };
            let fallen = at(down) - at(Vec3::ZERO);
            let unit = (at(Vec3::X).distance(at(Vec3::ZERO)) * at(Vec3::Y).distance(at(Vec3::ZERO))).sqrt();
            assert!(fallen.distance(Vec3::NEG_Y * 2.0 * unit) < 1e-3 * unit.max(1.0), "{fallen} {unit}");
        }
        let plane =
            Plane { middle: Vec3::ZERO, rotation: Quat::IDENTITY, size: Vec2::new(30.0, 20.0), thickness: None };
        let down = |place: Transform| plane.down(Vec2::new(1.5, 1.0), &place.into(), Vec2::new(0.5, -2.0));
        assert_eq!(down(Transform::default()), Some(Vec3::new(0.5, -2.0, 0.0)), "as in its own axes");
        assert_eq!(down(Transform::from_scale(Vec3::new(3.0, 3.0, 0.0))), Some(Vec3::new(0.5, -2.0, 0.0)));
        assert_eq!(down(Transform::from_scale(Vec3::ZERO)), None);
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
