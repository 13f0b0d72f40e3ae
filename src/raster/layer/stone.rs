//! Facets, grains and rounded stones on the floor where material has broken off.

use super::{
    draws,
    noise::{draw, floor, lattice},
};
use glam::Vec2;

/// Flat facets in -1..=1, about one unit wide: heights at the corners of a lattice of triangles, linear between.
#[inline(always)]
pub(super) fn facets(seed: u32, at: Vec2) -> f32 {
    const SKEW: f32 = 0.366_025_4;
    let skewed = at + SKEW * (at.x + at.y);
    let ((left, x), (top, y)) = (floor(skewed.x), floor(skewed.y));
    let (u, v) = (skewed.x - left, skewed.y - top);
    let height = |dx: i32, dy: i32| lattice(seed, x.wrapping_add(dx), y.wrapping_add(dy));
    let (first, last) = (height(0, 0), height(1, 1));
    // Without a branch, so that many of them are found at a time.
    let is_right = u > v;
    let between = height(i32::from(is_right), i32::from(!is_right));
    let (more, less) = if is_right { (u, v) } else { (v, u) };
    first * (1.0 - more) + between * (more - less) + last * less
}

/// The nearest of some scattered places, as of a stone.
pub(super) struct Cell {
    /// Its random number, -1..=1.
    pub(super) draw: f32,
    /// How much further the second nearest is.
    pub(super) gap: f32,
}

impl Cell {
    pub(super) fn find(seed: u32, at: Vec2) -> Self {
        let corner = at.floor();
        let (mut nearest, mut next) = ((f32::MAX, 0, 0), f32::MAX);
        for dy in -1..=1 {
            for dx in -1..=1 {
                let (x, y) = ((corner.x as i32).wrapping_add(dx), (corner.y as i32).wrapping_add(dy));
                let site = Vec2::new(lattice(seed, x, y), lattice(seed ^ draws::SITE_DOWN, x, y)) * 0.45;
                let off = at - corner - Vec2::new(dx as f32 + 0.5, dy as f32 + 0.5) - site;
                let distance = off.length();
                if distance < nearest.0 {
                    next = nearest.0;
                    nearest = (distance, x, y);
                } else if distance < next {
                    next = distance;
                }
            }
        }
        let (distance, x, y) = nearest;
        Self { draw: lattice(seed ^ draws::SITE_OWN, x, y), gap: next - distance }
    }
}

/// A rounded stone at a place.
pub(super) struct Stone {
    /// Its height there, texels; below zero where it has fallen out.
    pub(super) height: f32,
    /// Its difference in brightness from the material around it.
    pub(super) tone: f32,
}

impl Stone {
    /// For each size: the side of the squares that hold at most one stone, in grains, and the probability of one.
    const SIZES: [(f32, f32); 4] = [(3.0, 0.5), (2.0, 0.65), (1.25, 0.7), (0.75, 0.6)];

    /// The largest stone at a place, if there is one; `share` sets how many there are.
    pub(super) fn find(seed: u32, at: Vec2, grain: f32, share: f32) -> Option<Self> {
        let mut turned = at;
        for ((size, chance), k) in Self::SIZES.into_iter().zip(0u32..) {
            // Each size has its own squares, rotated against the others.
            turned = Vec2::new(0.8 * turned.x - 0.6 * turned.y, 0.6 * turned.x + 0.8 * turned.y);
            let side = (size * grain).max(2.0);
            let cell = (turned / side).floor();
            let (x, y) = (cell.x as i32, cell.y as i32);
            let pick = |what: u32| draw(seed ^ (what + 16 * k), x, y);
            if pick(1) >= chance * share {
                continue;
            }
            let radius = 0.24 + 0.22 * pick(2);
            let middle = Vec2::new(pick(3) - 0.5, pick(4) - 0.5) * (1.0 - 2.0 * radius);
            let off = turned / side - cell - 0.5 - middle;
            let way = Vec2::new(pick(5) - 0.5, pick(6) - 0.5).normalize_or(Vec2::X);
            let (u, v) = (off.dot(way).abs(), (1.0 + 0.4 * pick(7)) * off.perp_dot(way).abs());
            let far = (0.6 * (u * u + v * v).sqrt() + 0.33 * (u + v)) / radius;
            if far < 1.0 {
                let rise = radius * side * (1.0 - far * far);
                let own = pick(8) - 0.5;
                return Some(if pick(9) < 0.14 {
                    Self { height: -0.5 * rise, tone: -0.22 }
                } else {
                    Self { height: 0.55 * rise, tone: 0.13 + 1.2 * own * own.abs() - 0.3 * far * far * far }
                });
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// About the share that is asked for is stones, large ones and small ones; without any there are none.
    #[test]
    fn stones_cover_what_they_are_told() {
        let count = |share: f32| {
            let at = |k: u32| Vec2::new((k % 200) as f32, (k / 200) as f32);
            (0..40_000).filter(|&k| Stone::find(3, at(k), 6.0, share).is_some()).count() as f32 / 40_000.0
        };
        let (none, some, all) = (count(0.0), count(0.5), count(1.0));
        assert!(none == 0.0 && (0.2..0.6).contains(&some) && (0.4..0.9).contains(&all), "{none} {some} {all}");
    }

    #[test]
    fn facets_are_flat_and_join() {
        let mut rng = Rng::new(9);
        let mut flat = 0;
        for _ in 0..2000 {
            let at = Vec2::new(rng.range(-20.0, 20.0), rng.range(-20.0, 20.0));
            let height = |by: f32| facets(7, at + Vec2::new(by, 0.6 * by));
            assert!(height(0.0).abs() <= 1.0);
            assert!((height(1.0e-3) - height(0.0)).abs() < 0.01, "a step at {at}");
            flat += usize::from((height(0.02) - 2.0 * height(0.01) + height(0.0)).abs() < 1.0e-4);
        }
        assert!(flat > 1800, "{flat} of 2000 places are on a flat facet");
    }
}
