//! Transcendental functions with the same bits on every platform (from the `libm` crate).
//!
//! The standard library uses the platform's `sin`, `exp` and similar functions, whose last bits differ.
//!
//! ```
//! use bevy_crack::math::ops;
//!
//! assert_eq!(ops::unit(0.0), [1.0, 0.0].into());
//! assert_eq!(ops::atan2(0.0, 1.0), 0.0);
//! assert_eq!((ops::sin(0.0), ops::cos(0.0), ops::exp(0.0), ops::powf(2.0, 3.0)), (0.0, 1.0, 1.0, 8.0));
//! // The same bits on every machine.
//! assert_eq!(ops::sin(1.0).to_bits(), 0x3F57_6AA4);
//! ```

use glam::Vec2;

/// Sine of an angle in radians.
#[must_use]
pub fn sin(x: f32) -> f32 {
    libm::sinf(x)
}

/// Cosine of an angle in radians.
#[must_use]
pub fn cos(x: f32) -> f32 {
    libm::cosf(x)
}

/// Angle of the vector `(x, y)` in radians, `-π..=π`.
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

/// `e` to the power `x`.
#[must_use]
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// `x` to the power `y`.
#[must_use]
pub fn powf(x: f32, y: f32) -> f32 {
    libm::powf(x, y)
}

/// The unit vector at `angle` radians from the x axis.
#[must_use]
pub fn unit(angle: f32) -> Vec2 {
    Vec2::new(cos(angle), sin(angle))
}

/// Cosine and sine of `share` of a whole turn, with the accuracy of `f32`.
#[must_use]
pub(crate) fn turn(share: f64) -> [f32; 2] {
    let angle = std::f64::consts::TAU * share;
    [libm::cos(angle) as f32, libm::sin(angle) as f32]
}
