//! Polygons with broken sides: [`Outline`].

use super::noise::draw;
use crate::math::ops;
use glam::Vec2;

/// Largest deviation of an outline at a raggedness of 1.
pub(super) const WIDEST: f32 = 1.1;

/// A polygon around a place, texels.
pub(super) struct Outline {
    pub(super) centre: Vec2,
    /// Largest distance of its corners.
    pub(super) reach: f32,
    /// Corners relative to the centre, sorted by their [`turn`].
    pub(super) corners: Vec<(f32, Vec2)>,
    /// Whether the distance to the edge accounts for both sides of narrow tips.
    pub(super) is_worn: bool,
}

/// A direction as a number in 0..4 that increases with its angle.
fn turn(way: Vec2) -> f32 {
    let share = way.y / (way.x.abs() + way.y.abs()).max(1.0e-6);
    if way.x < 0.0 {
        2.0 - share
    } else if way.y < 0.0 {
        4.0 + share
    } else {
        share
    }
}

impl Outline {
    /// A polygon with about `count` corners, between which sides are broken `levels` times.
    pub(super) fn new(centre: Vec2, radius: f32, count: u32, levels: u32, ragged: f32, seed: u32) -> Self {
        let most = radius * (1.0 + WIDEST * ragged);
        let phase = draw(seed, -1, 0);
        let mut corners: Vec<Vec2> = (0..count as i32)
            .map(|k| {
                let turn = (k as f32 + phase + 0.7 * (draw(seed, k, 1) - 0.5)) / count as f32;
                let far = radius * (1.0 + ragged * (1.4 * draw(seed, k, 2) - 0.7));
                ops::unit(std::f32::consts::TAU * turn) * far
            })
            .collect();
        for level in 0..levels as i32 {
            let n = corners.len();
            corners = (0..n)
                .flat_map(|k| {
                    let (a, b) = (corners[k], corners[(k + 1) % n]);
                    let along = 0.3 + 0.4 * draw(seed, k as i32, 5 + 2 * level);
                    let aside = 0.45 * ragged * (draw(seed, k as i32, 6 + 2 * level) - 0.5);
                    [a, a + (b - a) * along + (b - a).perp() * aside]
                })
                .collect();
        }
        let mut corners: Vec<(f32, Vec2)> = corners
            .into_iter()
            .map(|corner| corner.clamp_length_max(most))
            .map(|corner| (turn(corner), corner))
            .collect();
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let reach = corners.iter().map(|(_, corner)| corner.length()).fold(0.0, f32::max);
        Self { centre, reach, corners, is_worn: false }
    }

    /// The polygon around the origin with these corners.
    pub(super) fn through(corners: impl Iterator<Item = Vec2>) -> Self {
        let mut corners: Vec<(f32, Vec2)> = corners.map(|corner| (turn(corner), corner)).collect();
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let reach = corners.iter().map(|(_, corner)| corner.length()).fold(0.0, f32::max);
        Self { centre: Vec2::ZERO, reach, corners, is_worn: true }
    }

    /// The same polygon, longer in one direction and shorter across it.
    pub(super) fn stretched(mut self, seed: u32) -> Self {
        self.is_worn = true;
        let way = ops::unit(std::f32::consts::PI * draw(seed, -2, 0));
        let (by, most) = (1.0 + 0.5 * draw(seed, -2, 1), self.reach);
        for (at, corner) in &mut self.corners {
            let along = way * corner.dot(way);
            *corner = (along * by + (*corner - along) / by).clamp_length_max(most);
            *at = turn(*corner);
        }
        self.corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        self
    }

    /// Distance of a place from the edge, texels: positive inside, negative outside.
    pub(super) fn within(&self, at: Vec2) -> f32 {
        self.side(at).0
    }

    /// The same, and the direction inward from the nearest side.
    pub(super) fn side(&self, at: Vec2) -> (f32, Vec2) {
        let off = at - self.centre;
        if off.length_squared() > (self.reach + 1.0) * (self.reach + 1.0) {
            return (-FAR_OUT, Vec2::ZERO);
        }
        let turn = turn(off);
        let n = self.corners.len();
        let next = self.corners.partition_point(|corner| corner.0 <= turn) + n;
        let corner = |k: usize| self.corners.get(k % n.max(1)).map(|corner| corner.1);
        let (Some(a), Some(b)) = (corner(next - 1), corner(next)) else {
            return (-FAR_OUT, Vec2::ZERO);
        };
        let side = b - a;
        let within = side.perp_dot(off - a) / side.length().max(0.1);
        let inward = side.perp().normalize_or_zero();
        if !self.is_worn {
            return (within, inward);
        }
        // The sides of its sector and of the neighbouring ones.
        let mut nearest = f32::MAX;
        for k in 0..=2 * BESIDE {
            let (Some(from), Some(to)) = (corner(next + n + k - BESIDE - 1), corner(next + n + k - BESIDE)) else {
                continue;
            };
            let side = to - from;
            let share = ((off - from).dot(side) / side.length_squared().max(0.01)).clamp(0.0, 1.0);
            nearest = nearest.min(off.distance_squared(from + side * share));
        }
        (if within > 0.0 { nearest.sqrt() } else { -nearest.sqrt() }, inward)
    }
}

/// Number of neighbouring sectors on either side that are searched for the nearest edge.
const BESIDE: usize = 3;

/// From this distance outside, in texels, a place counts as far away.
pub(super) const FAR_OUT: f32 = 1.0e3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// From the centre outward a place leaves once, where the outline's own corners say.
    #[test]
    fn outlines_are_closed_and_stay_within_reach() {
        let mut rng = Rng::new(8);
        for seed in 0..200 {
            let (centre, ragged) = (Vec2::new(100.0 * rng.unit(), 100.0 * rng.unit()), rng.unit());
            let radius = 2.0 + 60.0 * rng.unit();
            let outline = Outline::new(centre, radius, 4 + seed % 6, seed % 3, ragged, seed);
            assert!(outline.reach <= radius * (1.0 + WIDEST * ragged) + 1.0e-3);
            assert!(outline.within(centre) > 0.0, "seed {seed}");
            for k in 0..64 {
                let way = ops::unit(k as f32 * 0.1);
                let mut was_inside = true;
                for step in 0..400 {
                    let is_inside = outline.within(centre + way * (step as f32 * 0.005 * outline.reach)) > 0.0;
                    assert!(was_inside || !is_inside, "seed {seed}: back inside on way {k}");
                    was_inside = is_inside;
                }
                assert!(!was_inside, "seed {seed}: it has no end on way {k}");
            }
        }
    }

    /// What is worn has its edge where it was.
    #[test]
    fn worn_outlines_have_the_same_edge() {
        let mut rng = Rng::new(10);
        for seed in 0..60 {
            let worn = Outline::new(Vec2::ZERO, 30.0, 4 + seed % 6, seed % 3, 0.6, seed).stretched(seed);
            let clean = Outline { is_worn: false, corners: worn.corners.clone(), ..worn };
            for _ in 0..200 {
                let at = Vec2::new(rng.range(-40.0, 40.0), rng.range(-40.0, 40.0));
                assert_eq!(worn.within(at) > 0.0, clean.within(at) > 0.0, "seed {seed} at {at}");
            }
        }
    }
}
