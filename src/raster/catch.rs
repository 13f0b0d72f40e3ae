//! How much light a crack catches by where it runs: that of glass and ice flares here and is hardly seen there.

use super::layer::noise;
use crate::math::mix;
use glam::Vec2;

/// The light comes from the upper left.
const LIGHT: Vec2 = Vec2::new(-std::f32::consts::FRAC_1_SQRT_2, -std::f32::consts::FRAC_1_SQRT_2);

/// Bumps of what swells and fades along cracks, a pattern unit, and of what differs from one direction to the next.
const SLOW: f32 = 9.0;
const DIRECTIONS: f32 = 3.1;

/// See [`LayerPlan::catch`](super::LayerPlan::catch).
pub(super) struct Catch {
    share: f32,
    seed: u32,
}

impl Catch {
    pub(super) fn new(share: f32, seed: u64) -> Self {
        Self { share: share.clamp(0.0, 1.0), seed: mix(seed ^ 0xCA7C) as u32 }
    }

    /// The share of its depth that a line has at `from`, and what it gains up to `to`.
    pub(super) fn of(&self, from: Vec2, to: Vec2) -> (f32, f32) {
        let way = (to - from).normalize_or_zero();
        // The same both ways.
        let way = if (way.y, way.x) < (0.0, 0.0) { -way } else { way };
        let facing = way.perp_dot(LIGHT).abs();
        let turned = noise(self.seed, DIRECTIONS * way.x, DIRECTIONS * way.y);
        let at = |pos: Vec2| {
            let slow = noise(self.seed ^ 1, SLOW * pos.x, SLOW * pos.y);
            let quick = noise(self.seed ^ 2, 3.7 * SLOW * pos.x, 3.7 * SLOW * pos.y);
            let lit = (0.12 + 0.5 * facing * facing + 0.42 * turned + 0.5 * slow + 0.16 * quick).clamp(0.0, 1.0);
            1.0 - self.share * (1.0 - lit)
        };
        let (near, far) = (at(from), at(to));
        (near, far - near)
    }
}
