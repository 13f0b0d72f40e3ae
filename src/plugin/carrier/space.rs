//! From the world into a surface's own space.

use bevy::{math::Affine3A, prelude::*};

/// The way back from the world; `None` if there is none. Scale 0 along z alone makes a picture no smaller and counts as 1; its front is
/// the side that looks along the world's z then, as that of sprites does.
pub(crate) fn to_local(transform: &GlobalTransform) -> Option<Affine3A> {
    let mut affine = transform.affine();
    let axes = &mut affine.matrix3;
    if axes.z_axis.length_squared() == 0.0 {
        let across = axes.x_axis.cross(axes.y_axis).normalize_or_zero();
        axes.z_axis = if across.z < 0.0 { -across } else { across };
    }
    let is_flat = axes.determinant() == 0.0;
    let inverse = affine.inverse();
    (!is_flat && inverse.is_finite()).then_some(inverse)
}

/// A vector of the same direction whose length can be reckoned with; zero if it has none.
pub(crate) fn direction(of: Vec3) -> Vec3 {
    let length_sq = of.length_squared();
    if length_sq.is_normal() { of } else { (of / of.abs().max_element()).try_normalize().unwrap_or(Vec3::ZERO) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_may_be_of_any_length() {
        let way = Vec3::new(1.0, -2.0, 2.0) / 3.0;
        for length in [1e-40, 1e-30, 1e-3, 1.0, 1e10, 1e30, 1e38] {
            let found = direction(way * length).normalize();
            assert!(found.distance(way) < 1e-3, "{length}: {found}");
        }
        assert_eq!(direction(way), way, "as it is");
        for bad in [0.0, f32::NAN, f32::INFINITY] {
            assert_eq!(direction(Vec3::new(bad, 0.0, bad)), Vec3::ZERO, "{bad}");
        }
    }

    #[test]
    fn what_is_flat_along_z_alone_can_be_hit() {
        let of = |scale: [f32; 3]| {
            let rotation = Quat::from_rotation_y(0.3);
            let at = Transform { translation: Vec3::new(1.0, 2.0, 3.0), rotation, scale: scale.into() };
            let at = GlobalTransform::from(at);
            let point = at.transform_point(Vec3::new(0.5, -0.25, 0.0));
            to_local(&at).map(|back| back.transform_point3(point))
        };
        for scale in [[2.0, -3.0, 0.0], [2.0, 3.0, 0.5]] {
            assert!(of(scale).is_some_and(|point| point.distance(Vec3::new(0.5, -0.25, 0.0)) < 1e-5), "{scale:?}");
        }
        for scale in [[-2.0, 1.0, 0.0], [2.0, -1.0, 0.0], [2.0, 1.0, 0.0]] {
            let at = GlobalTransform::from(Transform::from_scale(scale.into()));
            let front = to_local(&at).map(|back| back.matrix3.transpose() * Vec3::Z);
            assert!(front.is_some_and(|front| front.z > 0.0), "{scale:?}");
        }
        for scale in [[0.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0; 3], [f32::NAN, 1.0, 1.0], [1.0, f32::INFINITY, 0.0]] {
            assert_eq!(of(scale), None, "{scale:?}");
        }
    }
}
