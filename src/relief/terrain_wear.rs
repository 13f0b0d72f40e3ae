//! How single places of a height field wear: [`Gullies`], [`shore`].

use super::terrain_check::smoothstep;
use crate::math::mix;
use glam::Vec2;
use std::f32::consts::TAU;

/// Random numbers of a cell of a lattice, 0..1.
#[inline(always)]
fn draws(seed: u64, cell: [i32; 2]) -> [f32; 4] {
    let [x, y] = cell.map(|at| u64::from(at as u32));
    let bits = mix(seed ^ (x << 32 | y));
    [0, 16, 32, 48].map(|shift| f32::from((bits >> shift) as u16) * (1.0 / 65_536.0))
}

/// Sine and cosine of a whole turn times `turns`, to within 0.002.
#[inline(always)]
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
#[inline(always)]
pub(super) fn around(seed: u64, place: Vec2) -> impl Iterator<Item = (Vec2, [f32; 4])> {
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
const GULLIES: u32 = 3;

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
    #[inline(always)]
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

/// Sizes of loose pieces, in units of the largest.
const PIECES: [f32; 3] = [1.0, 0.62, 0.36];

/// Loose pieces with flat faces that lie where the ground is below height 0: the height of their surface, or of the
/// ground above it.
#[inline(always)]
pub(super) fn rubble(seed: u64, largest: f32, pos: Vec2, height: f32) -> f32 {
    let most = 0.3 * largest;
    if largest <= 0.0 || height > most {
        return height;
    }
    let mut highest = height;
    for (kind, share) in (0u64..).zip(PIECES) {
        let size = share * largest;
        for (off, [a, b, c, d]) in around(mix(seed ^ 0x2B_B1 ^ kind << 8), pos / size) {
            // Some cells are empty.
            if d > 0.75 {
                continue;
            }
            // A four-sided piece that is turned and tilted.
            let [sine, cosine] = wave(a);
            let turned = Vec2::new(cosine * off.x + sine * off.y, cosine * off.y - sine * off.x).abs();
            let half = Vec2::new(0.3 + 0.2 * b, 0.22 + 0.22 * c);
            let inside = (half - turned).min_element().min(0.8 * (half.element_sum() - turned.element_sum()) - 0.12);
            let tilt = Vec2::new(b - 0.5, c - 0.5).dot(off);
            if inside > 0.0 {
                // Its sides rise from below the ground.
                let top = 0.22 - 0.5 * (0.3 - inside).max(0.0);
                let rise = (3.0 * inside).min(top + 0.3) - 0.55;
                highest = highest.max(size * (rise + 0.5 * tilt + 0.3 * d));
            }
        }
    }
    height.max(highest.min(most))
}

/// How much of a thin layer has worn off, from noise: 0..=1, with soft edges.
#[inline(always)]
pub(super) fn flakes(noise: f32) -> f32 {
    smoothstep(0.2, 0.6, noise)
}

/// Height up to which the coast is shaped, pattern units.
const SHORE: f32 = 0.03;

/// Height of the highest cliffs, pattern units.
const CLIFF: f32 = 0.02;

/// A height after valleys have changed it by `carved` and the sea has shaped its coast: a cliff on headlands (1), level
/// ground in bays (0). The sea is as deep as the share of its depth tells. The shore stays where it is.
pub(super) fn shore(height: f32, carved: f32, [headland, depth]: [f32; 2], coast: f32) -> f32 {
    if height <= 0.0 {
        return height * (1.0 + coast * (depth - 1.0));
    }
    let height = (height + carved * smoothstep(0.0, 0.5 * SHORE, height)).max(0.3 * height);
    let level = height * (0.3 + 0.7 * smoothstep(0.0, SHORE, height));
    let cliff = height + CLIFF * smoothstep(0.0, 0.25 * SHORE, height);
    height + coast * (level + (cliff - level) * headland - height)
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
        let gullies = Gullies::new(0.5, 0.05, 3);
        let mut rng = Rng::new(5);
        for _ in 0..20_000 {
            let pos = Vec2::new(rng.range(-1.0, 2.0), rng.range(-1.0, 2.0));
            let slope = Vec2::new(rng.signed(), rng.signed());
            let near = pos + Vec2::new(2e-5, 1e-5);
            let (here, there) = (gullies.depth(pos, slope, 1.0), gullies.depth(near, slope, 1.0));
            assert!(here <= 1e-4 && (here - there).abs() < 2e-3, "{here} and {there} at {pos}");
        }
    }
}
