//! How much light a crack catches, by its direction and place: cracks in glass and ice flare in some places and are
//! hardly visible in others.

use super::layer::noise;
use crate::math::mix;
use glam::Vec2;

/// The light comes from the upper left.
const LIGHT: Vec2 = Vec2::new(-std::f32::consts::FRAC_1_SQRT_2, -std::f32::consts::FRAC_1_SQRT_2);

/// Bumps per pattern unit of the noise along cracks, and of the noise over directions.
const SLOW: f32 = 9.0;
const DIRECTIONS: f32 = 1.6;

/// Salt of its random draws. Frozen: a seed must give the same result in every version.
const OF_CATCH: u64 = 0xCA7C;

/// See [`LayerPlan::catch`](super::LayerPlan::catch).
pub(super) struct Catch {
    share: f32,
    seed: u32,
}

impl Catch {
    pub(super) fn new(share: f32, seed: u64) -> Self {
        Self { share: share.clamp(0.0, 1.0), seed: mix(seed ^ OF_CATCH) as u32 }
    }

    /// The share of its depth that a line has at `from`, and its increase up to `to`.
    pub(super) fn of(&self, from: Vec2, to: Vec2) -> (f32, f32) {
        let way = (to - from).normalize_or_zero();
        let facing = way.perp_dot(LIGHT);
        // Twice the angle: a line and its reverse give the same value.
        let twice = DIRECTIONS * way.rotate(way);
        let turned = noise(self.seed, twice.x, twice.y);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rng, ops};

    /// A line has the same share both ways, none more than all of its depth, and it goes on without a step from piece to piece.
    #[test]
    fn shares_are_the_same_both_ways_and_change_slowly() {
        let mut rng = Rng::new(5);
        for case in 0..2000 {
            let catch = Catch::new(rng.unit(), case);
            let from = Vec2::new(rng.unit(), rng.unit());
            let to = from + ops::unit(rng.range(-4.0, 4.0)) * 0.01;
            let ((there, gain), (back, loss)) = (catch.of(from, to), catch.of(to, from));
            assert!((there - back - loss).abs() < 1e-5 && (gain + loss).abs() < 1e-5, "{there} {gain} {back} {loss}");
            for share in [there, there + gain] {
                assert!((1.0 - catch.share - 1e-5..=1.0 + 1e-5).contains(&share), "{share} of {}", catch.share);
            }
            let beyond = catch.of(to, to + (to - from)).0;
            assert!((there + gain - beyond).abs() < 1e-3, "a step from {} to {beyond}", there + gain);
        }
    }

    /// Some lines flare and some are hardly seen.
    #[test]
    fn directions_differ() {
        let catch = Catch::new(1.0, 3);
        let share = |i: u32| catch.of(Vec2::splat(0.5), Vec2::splat(0.5) + ops::unit(i as f32 * 0.05) * 0.01).0;
        let all: Vec<f32> = (0..63).map(share).collect();
        let (least, most) = (all.iter().copied().fold(1.0, f32::min), all.iter().copied().fold(0.0, f32::max));
        assert!(least < 0.25 && most > 0.6, "{least} to {most}");
    }
}
