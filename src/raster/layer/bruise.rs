//! Bruises: crushed zones of short radial and ring cracks with angular flakes between them.

use super::{
    draws,
    noise::{floor, hash},
    row::WIDE,
};
use crate::math::{ops, vectorized};
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
        let (before, ring) = floor(along);
        let share = along - before;
        let count = (INNER as f32 * fine) as u32 + MORE * ring as u32 + 2 * sheet;
        let seed = seed ^ sheet.wrapping_mul(0x51ED_270B);
        let draw_of = |cell: i32, k: u32| (hash(seed ^ k, cell, ring) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
        let at = turn * count as f32 + draw_of(-1, 40);
        let (before, cell) = floor(at);
        let across = at - before;
        // A division takes time, and few of them are needed.
        let cell = if (0..count as i32).contains(&cell) { cell } else { cell.rem_euclid(count as i32) };
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

/// A short crack of a cloud of them, with a sheet to one side that fades.
struct Crazing {
    /// From the hit, texels.
    middle: Vec2,
    way: Vec2,
    half: f32,
    /// Width of the sheet in its middle, and how much its end slants.
    deep: f32,
    slant: f32,
    /// Its share of what is there at its distance from the hit, and from which share on it is.
    near: f32,
    from: f32,
    strong: f32,
    bright: f32,
}

impl Crazing {
    /// The crack in a square of a lattice with this side, texels.
    fn new(seed: u32, [x, y]: [i32; 2], side: f32, radius: f32) -> Self {
        let draw = |k: u32| (hash(seed ^ k, x, y) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
        let middle = Vec2::new(x as f32 + draw(1), y as f32 + draw(2)) * side;
        // Fewer outward, by the position of the middle.
        let near = 1.2 - (0.46 + 0.16 * draw(11)) * middle.length() / radius;
        // Most of them run away from the hit, or across.
        let any = ops::unit(TAU * draw(4));
        let out = middle.normalize_or(Vec2::X);
        let way = match () {
            () if draw(5) < 0.4 => (out + 0.5 * any).normalize_or(Vec2::X),
            () if draw(5) < 0.6 => (out.perp() + 0.5 * any).normalize_or(Vec2::X),
            () => any,
        };
        Self {
            middle,
            way,
            half: side * (0.3 + 0.55 * draw(6)),
            deep: side * (0.12 + 0.5 * draw(8)),
            slant: 0.8 * draw(9) - 0.4,
            near: near.clamp(0.0, 1.0),
            from: draw(3),
            strong: 0.2 + 0.8 * draw(7),
            bright: draw(10),
        }
    }

    /// The least rectangle around all that it changes: the corners with the least and the largest coordinates, texels from the hit.
    fn bounds(&self) -> [Vec2; 2] {
        let deep = self.deep * (1.0 + self.slant.abs()) + 0.5;
        let across = -self.way.perp();
        let (low, high) = (across * -1.2, across * deep.max(1.2));
        let along = self.way.abs() * self.half;
        [self.middle + low.min(high) - along - 1.0, self.middle + low.max(high) + along + 1.0]
    }

    /// The crack and the flake at a place, with this one; so much of the cloud is left there, 0..=1.
    #[inline(always)]
    fn over(&self, [crack, flake]: [f32; 2], off: Vec2, left: f32) -> [f32; 2] {
        let near = self.near * (0.35 + 0.65 * left);
        let (along, across) = ((off - self.middle).dot(self.way) / self.half, (off - self.middle).perp_dot(self.way));
        let taper = 1.0 - along * along;
        let strength = self.strong * (0.3 + 0.7 * near);
        let line = strength * taper.sqrt() * (0.75 - 0.9 * (across.abs() - 0.35).max(0.0)).max(0.0);
        // The sheet to one side, with a slanting end.
        let deep = self.deep * (1.0 - along * self.slant) * taper.sqrt();
        let inside = (across + 0.5).clamp(0.0, 1.0) * (deep - across + 0.5).clamp(0.0, 1.0);
        let fall = (1.0 - across / deep.max(1.0)).clamp(0.0, 1.0);
        let more = (1.0 - flake) * inside * self.bright * near * (0.25 + 0.7 * fall * fall);
        // Without a branch, so that many places are done at a time.
        let is_there = (self.from < 0.9 * near) & (along.abs() < 1.0);
        [if is_there { crack.max(line) } else { crack }, if is_there { flake + more } else { flake }]
    }
}

/// Sides of the squares that hold a crack each, in radii: one layer for each.
const SHEET_SIDES: [f32; 4] = [0.54, 0.38, 0.25, 0.15];

/// A cloud of short cracks that cross each other around a hit: what there is of cracks and of flakes, each 0..=1, at texels in rows of [`WIDE`]
/// that begin at `corner`. `left` says how much of the cloud is left at each, 0..=1.
pub(super) fn craze(
    [cracks, flakes]: [&mut [f32]; 2],
    left: &[f32],
    (corner, hit): (Vec2, Vec2),
    radius: f32,
    seed: u32,
) {
    let (size, first) = (Vec2::new(WIDE as f32, (left.len() / WIDE) as f32), corner - hit);
    let place = |column: usize, row: usize| corner + Vec2::new(column as i32 as f32, row as i32 as f32) - hit;
    for (sheet, side) in (0u32..).zip(SHEET_SIDES) {
        let side = (side * radius).max(3.0);
        let seed = seed ^ draws::SHEETS ^ sheet.wrapping_mul(0x51ED_270B);
        let square = |at: f32| floor(at / side).1;
        let mut columns = [0; WIDE];
        (0..).zip(&mut columns).for_each(|(k, column)| *column = square(place(k, 0).x));
        let (low, high) = ((first / side).floor().as_ivec2() - 1, ((first + size - 1.0) / side).floor().as_ivec2() + 1);
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let crack = Crazing::new(seed, [x, y], side, radius);
                let [min, max] = crack.bounds().map(|corner| corner - first);
                let (from, to) =
                    (min.max(Vec2::ZERO).as_usizevec2(), (max + 1.0).clamp(Vec2::ZERO, size).as_usizevec2());
                for row in from.y..to.y {
                    // A crack is seen in its own square and those around it.
                    if (square(place(0, row).y) - y).abs() > 1 || from.x >= to.x {
                        continue;
                    }
                    let texels = row * WIDE + from.x..row * WIDE + to.x;
                    let (Some(cracks), Some(flakes), Some(left), Some(columns)) = (
                        cracks.get_mut(texels.clone()),
                        flakes.get_mut(texels.clone()),
                        left.get(texels),
                        columns.get(from.x..to.x),
                    ) else {
                        continue;
                    };
                    vectorized(
                        #[inline(always)]
                        || {
                            let texels = cracks.iter_mut().zip(flakes).zip(left).zip(columns).enumerate();
                            for (k, (((crack_here, flake_here), left), column)) in texels {
                                let before = [*crack_here, *flake_here];
                                let is_near = (column - x).abs() <= 1;
                                let after = crack.over(before, place(from.x + k, row), *left);
                                [*crack_here, *flake_here] = if is_near { after } else { before };
                            }
                        },
                    );
                }
            }
        }
    }
    cracks.iter_mut().for_each(|crack| *crack = crack.min(1.0));
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
        let first = Vec2::splat(0.3);
        let off = |k: usize| first + Vec2::new((k % WIDE) as f32, (k / WIDE) as f32);
        let left: Vec<f32> = (0..WIDE * WIDE).map(|k| (1.0 - off(k).length() / 30.0).max(0.0)).collect();
        let (mut cracks, mut flakes) = (vec![0.0; WIDE * WIDE], vec![0.0; WIDE * WIDE]);
        craze([&mut cracks, &mut flakes], &left, (first, Vec2::ZERO), 12.0, 5);
        let covered = |far: f32| {
            let ring = (0..WIDE * WIDE).filter(|&k| (off(k).length() - far).abs() < 2.0);
            let flakes: Vec<f32> = ring.map(|k| flakes[k]).collect();
            flakes.iter().sum::<f32>() / flakes.len() as f32
        };
        assert!(covered(3.2) > 3.0 * covered(22.0), "{} {}", covered(3.2), covered(22.0));
    }

    /// What is drawn crack by crack is what each place finds in the squares around it.
    #[test]
    fn cracks_are_where_each_place_finds_them() {
        let mut rng = crate::math::Rng::new(4);
        for seed in 0..30 {
            let radius = rng.range(2.0, 90.0);
            let first = Vec2::new(rng.range(-120.0, 60.0), rng.range(-120.0, 60.0));
            let left: Vec<f32> = (0..WIDE * WIDE).map(|_| rng.unit()).collect();
            let (mut cracks, mut flakes) = ([0.0; WIDE * WIDE], [0.0; WIDE * WIDE]);
            craze([&mut cracks, &mut flakes], &left, (first, Vec2::ZERO), radius, seed);
            for (k, left) in left.iter().enumerate() {
                let off = first + Vec2::new((k % WIDE) as f32, (k / WIDE) as f32);
                let [mut crack, mut flake] = [0.0; 2];
                for (sheet, side) in (0u32..).zip(SHEET_SIDES) {
                    let side = (side * radius).max(3.0);
                    let seed = seed ^ draws::SHEETS ^ sheet.wrapping_mul(0x51ED_270B);
                    let square = (off / side).floor();
                    for (dx, dy) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
                        let place = [square.x as i32 + dx, square.y as i32 + dy];
                        [crack, flake] = Crazing::new(seed, place, side, radius).over([crack, flake], off, *left);
                    }
                }
                assert_eq!((cracks[k], flakes[k]), (crack.min(1.0), flake), "seed {seed}, {off}");
            }
        }
    }
}
