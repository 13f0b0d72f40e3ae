//! How single places of a height field wear: [`Gullies`], [`Scoops`].

use super::terrain::smoothstep;
use crate::math::mix;
use glam::Vec2;
use std::f32::consts::TAU;

/// Random numbers of a cell of a lattice, 0..1.
fn draws(seed: u64, cell: [i32; 2]) -> [f32; 4] {
    let [x, y] = cell.map(|at| u64::from(at as u32));
    let bits = mix(seed ^ (x << 32 | y));
    [0, 16, 32, 48].map(|shift| f32::from((bits >> shift) as u16) * (1.0 / 65_536.0))
}

/// Sine and cosine of a whole turn times `turns`, to within 0.002.
fn wave(turns: f32) -> [f32; 2] {
    let sine = |turns: f32| {
        let t = turns - (turns + 0.5).floor();
        let arc = 8.0 * t * (1.0 - 2.0 * t.abs());
        arc + 0.225 * (arc * arc.abs() - arc)
    };
    [sine(turns), sine(turns + 0.25)]
}

/// Distance of a site from the border of its cell, in cells: what is not in the nine cells around a place is further away
/// than 1 and this.
const MARGIN: f32 = 0.15;

/// The cells around a place of a lattice, each with the offset from its random site, in cells, and its random numbers.
fn around(seed: u64, place: Vec2) -> impl Iterator<Item = (Vec2, [f32; 4])> {
    let corner = place.floor();
    let [left, top] = corner.as_ivec2().to_array();
    let inside = place - corner;
    (0..9).map(move |k| {
        let by = [k % 3 - 1, k / 3 - 1];
        let draws = draws(seed, [left.wrapping_add(by[0]), top.wrapping_add(by[1])]);
        let [x, y] = [0, 1].map(|axis| by[axis] as f32 + MARGIN + (1.0 - 2.0 * MARGIN) * draws[axis]);
        (inside - Vec2::new(x, y), draws)
    })
}

/// Sizes of gullies, each half as wide as the one before.
const GULLIES: u32 = 4;

/// How far a site counts, in cells.
const REACH: f32 = 1.0 + MARGIN;

/// Gullies: waves across the slope, in each cell of a lattice one that runs straight downhill, blended from cell to
/// cell. Narrower ones run down the sides of the wider ones, so they branch.
pub(super) struct Gullies {
    seed: u64,
    /// Of the widest.
    depth: f32,
    width: f32,
}

impl Gullies {
    /// Gullies of this depth, as a share of the width of the widest.
    pub(super) fn new(depth: f32, width: f32, seed: u64) -> Self {
        Self { seed: mix(seed ^ 0x6011), depth: depth * width, width }
    }

    /// What is worn off at a place, zero or less.
    pub(super) fn depth(&self, pos: Vec2, slope: Vec2, height: f32) -> f32 {
        // The shore stays where it is.
        let dry = smoothstep(0.0, 2.5 * self.depth, height);
        let steep = slope.length();
        let strength = dry * smoothstep(0.04, 0.5, steep);
        if self.depth <= 0.0 || strength <= 0.0 {
            return 0.0;
        }
        let (mut slope, mut worn) = (slope, 0.0);
        let (mut depth, mut width) = (self.depth, self.width);
        for octave in 0..GULLIES {
            let across = slope.perp().normalize_or_zero();
            let (mut sum, mut rise, mut weights) = (0.0, 0.0, 0.0);
            for (off, _) in around(self.seed ^ u64::from(octave) << 8, pos / width) {
                let near = (1.0 - off.length_squared() * (1.0 / (REACH * REACH))).max(0.0);
                let weight = near * near;
                let [sine, cosine] = wave(off.dot(across));
                sum += weight * cosine;
                rise -= weight * sine;
                weights += weight;
            }
            // Nothing runs down where it is level.
            let scale = smoothstep(0.0, 0.25, slope.length()) / weights.max(1e-3);
            worn += depth * 0.5 * (sum * scale - 1.0);
            slope += across * (0.5 * depth * rise * scale * TAU / width);
            (depth, width) = (0.5 * depth, 0.5 * width);
        }
        worn * strength
    }
}

/// Sizes of scoops, in units of the largest.
const SCOOPS: [f32; 2] = [1.0, 0.42];

/// How much wider than high scoops are.
const FLAT: f32 = 1.35;

/// Height above the deepest scoop at which the surface is whole, in scoop sizes.
const WHOLE: f32 = 0.55;

/// Scoops: hollow faces, each with a direction of its own, that meet in sharp edges, as where stone has been broken.
pub(super) struct Scoops {
    seed: u64,
    chips: f32,
    size: f32,
}

impl Scoops {
    /// Scoops of this depth, as a share of the size of the largest.
    pub(super) fn new(chips: f32, size: f32, seed: u64) -> Self {
        Self { seed: mix(seed ^ 0x5C00), chips, size }
    }

    /// What has broken off at a place, zero or less; `uneven` moves edges aside a little, -1..=1.
    pub(super) fn depth(&self, pos: Vec2, uneven: f32) -> f32 {
        if self.chips <= 0.0 {
            return 0.0;
        }
        let mut broken = 0.0;
        for (octave, share) in SCOOPS.into_iter().enumerate() {
            let size = share * self.size;
            let place = Vec2::new(pos.x / FLAT, pos.y) / size + 0.06 * uneven;
            let face = around(self.seed ^ (octave as u64) << 8, place).map(|(off, [a, b, c, d])| {
                let tilt = Vec2::new(c - 0.5, d - 0.5);
                // Beyond a cell no face is lower than the whole surface: what lies further away does not matter.
                0.35 * (a + b - a * b) + 0.8 * tilt.dot(off) + off.length_squared()
            });
            broken += self.chips * size * (face.fold(WHOLE, f32::min) - WHOLE);
        }
        broken
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rng, ops};

    #[test]
    fn waves_are_sines() {
        for k in -300i16..300 {
            let turns = f32::from(k) * 0.0171;
            let [sine, cosine] = wave(turns);
            assert!((sine - ops::sin(TAU * turns)).abs() < 0.002 && (cosine - ops::cos(TAU * turns)).abs() < 0.002);
        }
    }

    /// No step is higher than a slope makes it, at the borders of cells either.
    #[test]
    fn ground_is_continuous() {
        let (gullies, scoops) = (Gullies::new(0.5, 0.05, 3), Scoops::new(0.5, 0.17, 3));
        let mut rng = Rng::new(5);
        for _ in 0..20_000 {
            let pos = Vec2::new(rng.range(-1.0, 2.0), rng.range(-1.0, 2.0));
            let slope = Vec2::new(rng.signed(), rng.signed());
            let near = pos + Vec2::new(2e-5, 1e-5);
            for (here, there) in [
                (gullies.depth(pos, slope, 1.0), gullies.depth(near, slope, 1.0)),
                (scoops.depth(pos, 0.0), scoops.depth(near, 0.0)),
            ] {
                assert!(here <= 1e-4 && (here - there).abs() < 2e-3, "{here} and {there} at {pos}");
            }
        }
    }
}
