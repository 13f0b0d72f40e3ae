//! Bruises: crushed zones of short radial and ring cracks with angular flakes between them.

use super::{draws, noise::hash};
use crate::math::ops;
use glam::Vec2;
use std::f32::consts::TAU;

/// Layers of cracks on top of each other.
const SHEETS: u32 = 3;

/// Rings of a layer within the square root of a radius.
const RINGS: f32 = 4.2;

/// Directions of the innermost ring, and the increase with each further ring.
const INNER: u32 = 8;
const MORE: u32 = 5;

/// The bruise at a place, each 0..=1: a crack, and the paleness of the flake.
#[derive(Clone, Copy, Default)]
pub(super) struct Bruise {
    pub(super) crack: f32,
    pub(super) flake: f32,
}

/// The bruise around a hit. `off` is the offset from the hit in texels, `q` the distance in radii of the bruise.
/// `dense` is the share of its cracks that are there, 0..=1; `fine` is how many more cracks it has than a small
/// bruise.
pub(super) fn bruise(off: Vec2, q: f32, dense: f32, fine: f32, seed: u32) -> Bruise {
    let (distance, mut found) = (off.length(), Bruise::default());
    let turn = ops::atan2(off.y, off.x) * (1.0 / TAU) + 0.5;
    for sheet in 0..SHEETS {
        let along = RINGS * fine * q.sqrt() + 0.37 * sheet as f32;
        let (ring, share) = (along.floor(), along - along.floor());
        let count = (INNER as f32 * fine) as u32 + MORE * ring as u32 + 2 * sheet;
        let seed = seed ^ sheet.wrapping_mul(0x51ED_270B);
        let draw_of = |cell: i32, k: u32| (hash(seed ^ k, cell, ring as i32) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
        let at = turn * count as f32 + draw_of(-1, 40);
        let (cell, across) = ((at.floor() as i32).rem_euclid(count as i32), at - at.floor());
        let draw = |k: u32| draw_of(cell, k);
        let chance = dense * (1.15 - 0.25 * sheet as f32);
        // Texels from side to side of a cell, and from ring to ring.
        let (wide, long) = (TAU * distance / count as f32, distance / (0.5 * along).max(0.5));
        let line = |off: f32, thick: f32| (thick + 0.5 - off.abs()).clamp(0.0, 1.0);
        if draw(41) < chance {
            // A radial crack, which ends in a point.
            let middle = 0.25 + 0.5 * draw(42) + 0.3 * (draw(43) - 0.5) * share;
            let left = 1.0 - share * (0.3 + 0.9 * draw(44));
            let strength = (0.3 + 0.7 * draw(45)) * left.clamp(0.0, 1.0);
            found.crack = found.crack.max(strength * line((across - middle) * wide, 0.35));
        }
        if draw(46) < 0.55 * chance {
            // One across.
            let middle = 0.3 + 0.4 * draw(47) + 0.45 * (draw(48) - 0.5) * (across - 0.5);
            let strength = (0.25 + 0.6 * draw(49)) * (1.0 - (2.0 * across - 1.0).abs() * draw(50));
            found.crack = found.crack.max(strength * line((share - middle) * long, 0.3));
        }
        if draw(51) < chance {
            found.flake = found.flake.max(draw(52) * draw(53) * (0.6 + 0.4 * across));
        }
    }
    found
}

/// A cloud of short cracks that cross each other, each with a sheet to one side that fades. `off` is the offset from
/// the hit in texels, `left` how much of the cloud is left there, 0..=1.
pub(super) fn crazed(off: Vec2, radius: f32, left: f32, seed: u32) -> Bruise {
    let mut found = Bruise::default();
    let out = off.normalize_or_zero();
    for (sheet, size) in [0.54f32, 0.38, 0.25, 0.15].into_iter().enumerate() {
        let side = (size * radius).max(3.0);
        let seed = seed ^ draws::SHEETS ^ (sheet as u32).wrapping_mul(0x51ED_270B);
        let corner = (off / side).floor();
        for (dx, dy) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
            let (x, y) = ((corner.x as i32).wrapping_add(dx), (corner.y as i32).wrapping_add(dy));
            let draw = |k: u32| (hash(seed ^ k, x, y) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
            let middle = Vec2::new(x as f32 + draw(1), y as f32 + draw(2)) * side;
            // Fewer outward, by the position of the middle.
            let near = 1.2 - (0.46 + 0.16 * draw(11)) * middle.length() / radius;
            let near = near.clamp(0.0, 1.0) * (0.35 + 0.65 * left);
            if draw(3) >= 0.9 * near {
                continue;
            }
            // Most of them run away from the hit, or across.
            let any = ops::unit(TAU * draw(4));
            let way = match () {
                () if draw(5) < 0.4 => (middle.normalize_or(out) + 0.5 * any).normalize_or(Vec2::X),
                () if draw(5) < 0.6 => (middle.normalize_or(out).perp() + 0.5 * any).normalize_or(Vec2::X),
                () => any,
            };
            let half = side * (0.3 + 0.55 * draw(6));
            let (along, across) = ((off - middle).dot(way) / half, (off - middle).perp_dot(way));
            if along.abs() >= 1.0 {
                continue;
            }
            let taper = 1.0 - along * along;
            let strength = (0.2 + 0.8 * draw(7)) * (0.3 + 0.7 * near);
            found.crack =
                found.crack.max(strength * taper.sqrt() * (0.75 - 0.9 * (across.abs() - 0.35).max(0.0)).max(0.0));
            // The sheet to one side, with a slanting end.
            let deep = side * (0.12 + 0.5 * draw(8)) * (1.0 - along * (0.8 * draw(9) - 0.4)) * taper.sqrt();
            let inside = (across + 0.5).clamp(0.0, 1.0) * (deep - across + 0.5).clamp(0.0, 1.0);
            if inside > 0.0 {
                let fall = (1.0 - across / deep.max(1.0)).clamp(0.0, 1.0);
                found.flake = found.flake + (1.0 - found.flake) * inside * draw(10) * near * (0.25 + 0.7 * fall * fall);
            }
        }
    }
    found.crack = found.crack.min(1.0);
    found
}

/// `count` bubbles around a hit of this radius, in strings and clusters: positions relative to the hit, and radii.
/// Texels.
pub(super) fn bubbles(count: u32, radius: f32, reach: f32, grain: f32, seed: u32) -> Vec<(Vec2, f32)> {
    let draw =
        |i: u32, k: u32| (hash(seed ^ draws::BUBBLES ^ k, i as i32, 3) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
    (0..count.min(64))
        .map(|i| {
            let (group, place) = (i / 6, (i % 6) as f32);
            let from = ops::unit(TAU * draw(group, 1)) * (radius * (0.5 + (0.5 * reach - 0.5) * draw(group, 2)));
            let way = (from.normalize_or(Vec2::X) + 0.9 * ops::unit(TAU * draw(group, 3))).normalize_or(Vec2::X);
            let stray = ops::unit(TAU * draw(i, 4)) * draw(i, 5);
            // Every third group is a cluster.
            let middle = if group % 3 == 2 {
                from + stray * (3.0 * grain)
            } else {
                from + way * (place * grain * (1.1 + 0.7 * draw(i, 6))) + stray * (0.4 * grain)
            };
            let size = draw(i, 7);
            let limit = radius * reach - 2.0;
            (middle.clamp_length_max(0.9 * limit.max(0.0)), grain * (0.13 + 0.42 * size * size))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cracks get fewer outward, and there are none where none are wanted.
    #[test]
    fn cracks_get_fewer_as_they_are_told() {
        let covered = |dense: f32| {
            let all = (0..64u32).flat_map(|y| (0..64u32).map(move |x| Vec2::new(x as f32, y as f32) - 31.7));
            all.map(|off| bruise(off, off.length() / 32.0, dense, 1.0, 9).crack).sum::<f32>()
        };
        assert_eq!(covered(0.0), 0.0);
        let some = [0.2, 0.5, 1.0].map(covered);
        assert!(some[0] > 0.0 && some[0] < some[1] && some[1] < some[2], "{some:?}");
    }

    /// Bubbles stay within reach, and there are as many as are asked for.
    #[test]
    fn bubbles_stay_within_reach() {
        for seed in 0..40 {
            let all = bubbles(40, 30.0, 2.5, 4.0, seed);
            assert_eq!(all.len(), 40);
            assert!(all.iter().all(|(at, radius)| at.length() + radius < 2.5 * 30.0 && *radius > 0.0), "seed {seed}");
        }
        assert!(bubbles(0, 30.0, 2.5, 4.0, 1).is_empty());
    }

    /// The cloud of short cracks ends.
    #[test]
    fn the_cloud_thins_out() {
        let covered = |distance: f32| {
            let at = |i: u32| ops::unit(i as f32 * 0.1) * distance;
            (0..63).map(|i| crazed(at(i), 30.0, (1.0 - distance / 75.0).max(0.0), 5).flake).sum::<f32>()
        };
        assert!(covered(8.0) > 3.0 * covered(55.0), "{} {}", covered(8.0), covered(55.0));
    }
}
