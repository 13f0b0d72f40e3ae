//! Polygons with broken sides: [`Outline`].

use super::noise::draw;
use crate::math::ops;
use glam::Vec2;

/// Largest deviation of an outline at a raggedness of 1.
pub(super) const WIDEST: f32 = 1.1;

/// A polygon around a place, texels.
#[derive(Debug)]
pub(super) struct Outline {
    pub(super) centre: Vec2,
    /// Largest distance of its corners.
    pub(super) reach: f32,
    /// Least distance of its sides from its centre.
    inner: f32,
    /// Corners relative to the centre, sorted by their [`turn`].
    corners: Vec<(f32, Vec2)>,
    /// The side that ends at each corner, in the same order; before and after them the last and the first ones again.
    sides: Vec<Side>,
    /// Whether the distance to the edge accounts for both sides of narrow tips.
    is_worn: bool,
}

/// A side of an outline, relative to its centre.
#[derive(Debug)]
struct Side {
    from: Vec2,
    along: Vec2,
    length: f32,
    length_sq: f32,
    inward: Vec2,
}

impl Side {
    fn new(from: Vec2, to: Vec2) -> Self {
        let along = to - from;
        let (length, length_sq) = (along.length().max(0.1), along.length_squared().max(0.01));
        Self { from, along, length, length_sq, inward: along.perp().normalize_or_zero() }
    }

    /// Distance from the line along it; positive inside.
    fn within(&self, off: Vec2) -> f32 {
        self.along.perp_dot(off - self.from) / self.length
    }

    fn distance_squared(&self, off: Vec2) -> f32 {
        let share = ((off - self.from).dot(self.along) / self.length_sq).clamp(0.0, 1.0);
        off.distance_squared(self.from + self.along * share)
    }
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
        Self::of(centre, corners, false)
    }

    /// The polygon around the origin with these corners.
    pub(super) fn through(corners: impl Iterator<Item = Vec2>) -> Self {
        let mut corners: Vec<(f32, Vec2)> = corners.map(|corner| (turn(corner), corner)).collect();
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self::of(Vec2::ZERO, corners, true)
    }

    /// Of sorted corners.
    fn of(centre: Vec2, corners: Vec<(f32, Vec2)>, is_worn: bool) -> Self {
        let reach = corners.iter().map(|(_, corner)| corner.length()).fold(0.0, f32::max);
        let n = corners.len();
        let side = |k: usize| {
            // One end is the corner before.
            let (before, k) = ((k + (BESIDE + 1) * n - BESIDE - 1) % n, (k + BESIDE * n - BESIDE) % n);
            Some(Side::new(corners.get(before)?.1, corners.get(k)?.1))
        };
        let sides = if n > 0 { (0..n + 1 + 2 * BESIDE).filter_map(side).collect() } else { Vec::new() };
        // The centre is inside, or nothing is known.
        let is_around = sides.iter().all(|side| side.within(Vec2::ZERO) > 0.0);
        let distance = |side: &Side| match is_worn {
            true => side.distance_squared(Vec2::ZERO).sqrt(),
            false => side.within(Vec2::ZERO),
        };
        let inner = if is_around { sides.iter().map(distance).fold(f32::MAX, f32::min) } else { 0.0 };
        Self { centre, reach, inner, corners, sides, is_worn }
    }

    /// The same polygon, longer in one direction and shorter across it.
    pub(super) fn stretched(mut self, seed: u32) -> Self {
        let way = ops::unit(std::f32::consts::PI * draw(seed, -2, 0));
        let (by, most) = (1.0 + 0.5 * draw(seed, -2, 1), self.reach);
        for (at, corner) in &mut self.corners {
            let along = way * corner.dot(way);
            *corner = (along * by + (*corner - along) / by).clamp_length_max(most);
            *at = turn(*corner);
        }
        self.corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { reach: self.reach, ..Self::of(self.centre, self.corners, true) }
    }

    /// Distance of a place from the edge, texels: positive inside, negative outside.
    pub(super) fn within(&self, at: Vec2) -> f32 {
        self.nearest(at).map_or(-FAR_OUT, |(within, _)| within)
    }

    /// The same, or `most` where the distance is so much or more.
    pub(super) fn within_at_most(&self, at: Vec2, most: f32) -> f32 {
        let rest = self.inner - most;
        // No side is nearer to the centre. A little less, for rounding.
        if rest > 0.0 && at.distance_squared(self.centre) < 0.999 * rest * rest {
            return most;
        }
        self.within(at).min(most)
    }

    /// The same as [`Self::within`], and the direction inward from the nearest side.
    pub(super) fn side(&self, at: Vec2) -> (f32, Vec2) {
        self.nearest(at).map_or((-FAR_OUT, Vec2::ZERO), |(within, side)| (within, side.inward))
    }

    /// The same, and the side of the sector of a place. `None` if it is far away.
    #[inline]
    fn nearest(&self, at: Vec2) -> Option<(f32, &Side)> {
        let off = at - self.centre;
        if off.length_squared() > (self.reach + 1.0) * (self.reach + 1.0) {
            return None;
        }
        let turn = turn(off);
        let next = self.corners.partition_point(|corner| corner.0 <= turn);
        let side = self.sides.get(next + BESIDE)?;
        let within = side.within(off);
        if !self.is_worn {
            return Some((within, side));
        }
        // The sides of its sector and of the neighbouring ones.
        let near = self.sides.get(next..=next + 2 * BESIDE)?;
        let nearest = near.iter().map(|side| side.distance_squared(off)).fold(f32::MAX, f32::min).sqrt();
        Some((if within > 0.0 { nearest } else { -nearest }, side))
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

    /// What is far enough inside is found without looking for the nearest side.
    #[test]
    fn distances_end_where_they_are_to() {
        let mut rng = Rng::new(11);
        for seed in 0..100 {
            let mut outline = Outline::new(Vec2::splat(3.0), 30.0, 4 + seed % 20, seed % 3, 0.6 * rng.unit(), seed);
            if seed % 2 == 0 {
                outline = outline.stretched(seed);
            }
            for _ in 0..200 {
                let at = Vec2::new(rng.range(-40.0, 40.0), rng.range(-40.0, 40.0));
                let most = rng.range(0.5, 30.0);
                assert_eq!(outline.within_at_most(at, most), outline.within(at).min(most), "seed {seed} at {at}");
            }
        }
    }

    /// What is worn has its edge where it was.
    #[test]
    fn worn_outlines_have_the_same_edge() {
        let mut rng = Rng::new(10);
        for seed in 0..60 {
            let worn = Outline::new(Vec2::ZERO, 30.0, 4 + seed % 6, seed % 3, 0.6, seed).stretched(seed);
            let clean = Outline::of(worn.centre, worn.corners.clone(), false);
            for _ in 0..200 {
                let at = Vec2::new(rng.range(-40.0, 40.0), rng.range(-40.0, 40.0));
                assert_eq!(worn.within(at) > 0.0, clean.within(at) > 0.0, "seed {seed} at {at}");
            }
        }
    }
}
