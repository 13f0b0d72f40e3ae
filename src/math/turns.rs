//! Rotations in plain arithmetic: those of `glam` use other instructions on each kind of machine, which give other bits.

use super::ops;
use glam::{Quat, Vec3};

fn axis(rotation: Quat) -> Vec3 {
    Vec3::new(rotation.x, rotation.y, rotation.z)
}

fn dot(a: Quat, b: Quat) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w
}

/// So much of one and so much of the other, as a rotation.
fn mix((a, of_a): (Quat, f32), (b, of_b): (Quat, f32)) -> Quat {
    let sum = |a: f32, b: f32| a * of_a + b * of_b;
    let mixed = Quat::from_xyzw(sum(a.x, b.x), sum(a.y, b.y), sum(a.z, b.z), sum(a.w, b.w));
    let scale = 1.0 / dot(mixed, mixed).sqrt();
    Quat::from_xyzw(mixed.x * scale, mixed.y * scale, mixed.z * scale, mixed.w * scale)
}

/// A place that is turned by a rotation.
pub(crate) fn turned(rotation: Quat, place: Vec3) -> Vec3 {
    let (axis, w) = (axis(rotation), rotation.w);
    place * (w * w - axis.dot(axis)) + axis * (2.0 * place.dot(axis)) + axis.cross(place) * (2.0 * w)
}

/// The rotation by `first` and then by `next`.
pub(crate) fn after(next: Quat, first: Quat) -> Quat {
    let (a, b) = (next, first);
    Quat::from_xyzw(
        a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
        a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
    )
}

/// One plus the cosine of an angle below which two directions are opposite: rounding would decide how to turn.
const OPPOSITE: f32 = 8.0 * f32::EPSILON;

/// The shortest rotation from a direction to another; to the opposite one it is about any axis across.
pub(crate) fn from_to(from: Vec3, to: Vec3) -> Quat {
    let (across, w) = (from.cross(to), 1.0 + from.dot(to));
    if w < OPPOSITE {
        let axis = from.any_orthonormal_vector();
        return Quat::from_xyzw(axis.x, axis.y, axis.z, 0.0);
    }
    mix((Quat::from_xyzw(across.x, across.y, across.z, w), 1.0), (Quat::IDENTITY, 0.0))
}

/// The rotation that is this share of the way between two.
pub(crate) fn between(from: Quat, to: Quat, share: f32) -> Quat {
    let cos = dot(from, to);
    // Of both signs of a rotation the nearer one.
    let (cos, sign) = if cos < 0.0 { (-cos, -1.0) } else { (cos, 1.0) };
    if cos > 0.9995 {
        return mix((from, 1.0 - share), (to, sign * share));
    }
    let angle = ops::atan2((1.0 - cos * cos).max(0.0).sqrt(), cos);
    mix((from, ops::sin(angle * (1.0 - share))), (to, sign * ops::sin(angle * share)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    #[test]
    fn they_are_those_of_glam() {
        let mut rng = Rng::new(4);
        let mut draw = || Vec3::new(rng.signed(), rng.signed(), rng.signed());
        for _ in 0..500 {
            let [a, b] = [0, 1].map(|_| {
                let (axis, angle) = (draw().normalize_or(Vec3::X), 3.0 * draw().x);
                Quat::from_axis_angle(axis, angle)
            });
            let (place, share) = (draw(), draw().x.abs());
            assert!(turned(a, place).abs_diff_eq(a * place, 1e-5));
            assert!(after(a, b).abs_diff_eq(a * b, 1e-5));
            let between = between(a, b, share);
            let expected = a.slerp(b, share);
            assert!(between.abs_diff_eq(expected, 1e-3) || between.abs_diff_eq(-expected, 1e-3), "{a} {b} {share}");
            let from = place.normalize_or(Vec3::X);
            let to = draw().normalize_or(Vec3::Y);
            let to = if from.dot(to) < 0.0 { -to } else { to };
            assert!(turned(from_to(from, to), from).abs_diff_eq(to, 1e-5), "{from} {to}");
            // Further away, up to the opposite direction.
            for to in [to, -to, from, -from, (2e-4 * to - from).normalize_or(to)] {
                let found = from_to(from, to);
                assert!(turned(found, from).abs_diff_eq(to, 2e-3), "{from} {to}");
                assert!((found.length() - 1.0).abs() < 1e-5, "{from} {to}");
                if from.dot(to) > -0.99 {
                    let expected = Quat::from_rotation_arc(from, to);
                    assert!(turned(found, place).abs_diff_eq(expected * place, 1e-4), "{from} {to}");
                }
            }
        }
    }
}
