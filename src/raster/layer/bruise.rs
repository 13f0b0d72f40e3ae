//! Bruises: a crushed zone that is made of short radial and ring cracks with angular flakes between them.

use super::hash;
use crate::math::ops;
use glam::Vec2;
use std::f32::consts::TAU;

/// Sheets of cracks that lie over one another.
const SHEETS: u32 = 3;

/// Rings of a sheet within the square root of a radius.
const RINGS: f32 = 4.2;

/// Directions of the innermost ring, and how many more each further one has.
const INNER: u32 = 8;
const MORE: u32 = 5;

/// What a bruise shows at a place, each 0..=1: a crack, and how pale the flake is.
#[derive(Clone, Copy, Default)]
pub(super) struct Bruise {
    pub(super) crack: f32,
    pub(super) flake: f32,
}

/// The bruise around a hit: `off` is the way from it in texels, `q` the same in radii of the bruise, `turn` its direction as a share of a
/// full one. `dense` is how many of its cracks are there, 0..=1, `fine` how many more of them than one that is small has.
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
            // A radial one, which runs out as a needle.
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

/// How far a hole with straight chipped sides reaches in a direction, about 1; `turn` as a share of a full one.
pub(super) fn chipped(turn: f32, seed: u32) -> f32 {
    const SIDES: u32 = 11;
    let at = turn * SIDES as f32;
    let corner = |i: i32| {
        let i = i.rem_euclid(SIDES as i32);
        0.72 + 0.56 * (hash(seed ^ 60, i, 0) >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
    };
    let (low, share) = (at.floor() as i32, at - at.floor());
    corner(low) + (corner(low + 1) - corner(low)) * share
}

/// The broken edge of a hole, 0..=1: facets of their own brightness. `out` is the way outward from the hole in widths of the edge.
pub(super) fn broken_edge(turn: f32, out: f32, seed: u32) -> f32 {
    let facet = |sides: u32, k: u32, shift: f32| {
        let cell = ((turn * sides as f32 + shift * out).floor() as i32).rem_euclid(sides as i32);
        (hash(seed ^ k, cell, (2.0 * out).floor() as i32) >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
    };
    let (coarse, fine) = (facet(13, 61, 0.7), facet(29, 62, -1.1));
    let fall = (1.0 - out).clamp(0.0, 1.0);
    (fall * (0.25 + 0.55 * coarse + 0.5 * fine * fine) + 0.25 * coarse * fine * fall.sqrt()).clamp(0.0, 1.0)
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

    /// A hole is closed: its sides meet where a turn ends.
    #[test]
    fn sides_of_a_hole_meet() {
        for seed in 0..50 {
            assert!((chipped(0.0, seed) - chipped(1.0 - 1e-6, seed)).abs() < 1e-4);
            assert!((0..100).all(|i| (0.7..=1.3).contains(&chipped(i as f32 * 0.01, seed))));
        }
    }
}
