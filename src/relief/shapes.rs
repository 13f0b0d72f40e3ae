//! Seed contours to begin with: [`ReliefShape`].

use crate::math::{Rng, ops};
use glam::Vec2;
use std::f32::consts::TAU;

/// Where the contours of a relief begin.
///
/// ```
/// use bevy_crack::relief::ReliefShape;
///
/// let lines = ReliefShape::Island.contours([1.0, 1.0].into(), 7);
/// assert_eq!(lines.len(), 1);
/// assert!(lines[0].len() > 500);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ReliefShape {
    /// Blocks of rock in layers, with gaps between them.
    #[default]
    Wall,
    /// One coast line around the middle, uneven at all sizes.
    Island,
    /// A circle around the middle.
    Circle,
    /// Closed lines, each a list of points in texture coordinates (0..=1, v down).
    Lines(Vec<Vec<Vec2>>),
}

/// A closed line around `center`, uneven at all sizes.
fn blob(center: Vec2, radius: f32, points: u16, uneven: f32, rng: &mut Rng) -> Vec<Vec2> {
    let waves: Vec<_> = (2u8..120).map(|k| (f32::from(k), uneven * rng.signed() / f32::from(k), rng.unit())).collect();
    let corner = |i: u16| {
        let angle = TAU * f32::from(i) / f32::from(points);
        let wave = |&(k, size, phase): &(f32, f32, f32)| size * ops::cos(k * angle + TAU * phase);
        let out = (1.0 + waves.iter().map(wave).sum::<f32>()).clamp(0.35, 1.3);
        center + radius * out * ops::unit(angle)
    };
    (0..points).map(corner).collect()
}

/// Where a wall is split, pattern units: the least height of a layer of blocks and how much more there may be, the same for the widths
/// of blocks, and the gap between blocks.
const LAYER: [f32; 2] = [0.16, 0.22];
const BLOCK: [f32; 2] = [0.18, 0.5];
const GAP: f32 = 0.009;

/// Blocks in layers, wider than high, with gaps between them; some are cut through at a slant.
fn wall(extent: Vec2, rng: &mut Rng) -> Vec<Vec<Vec2>> {
    let mut blocks = Vec::new();
    let edges = |length: f32, [least, more]: [f32; 2], rng: &mut Rng| {
        let mut edges = vec![-0.5 * least * rng.unit()];
        while edges[edges.len() - 1] < length {
            edges.push(edges[edges.len() - 1] + least + more * rng.unit() * rng.unit());
        }
        edges
    };
    let layers = edges(extent.y, LAYER, rng);
    // How far a bed between two layers lies from its place: it is not level.
    let beds: Vec<_> = layers.iter().map(|_| [0.02 * rng.signed(), 0.05 * rng.signed(), TAU * rng.unit()]).collect();
    let bed = |i: usize, x: f32| {
        let [slope, size, phase] = beds[i];
        layers[i] + slope * x + 0.3 * size * ops::cos(5.0 * x + phase)
    };
    for layer in 0..layers.len() - 1 {
        let columns = edges(extent.x, BLOCK, rng);
        let tilts: Vec<_> = columns.iter().map(|_| 0.07 * rng.signed()).collect();
        for column in 0..columns.len() - 1 {
            let corner = |c: usize, l: usize| {
                let side = if l == layer { -0.5 } else { 0.5 };
                let x = columns[c] + side * tilts[c];
                Vec2::new(x, bed(l, x))
            };
            let (c, l) = (column, layer);
            let corners = [corner(c, l), corner(c + 1, l), corner(c + 1, l + 1), corner(c, l + 1)];
            let middle = 0.25 * corners.iter().sum::<Vec2>();
            // Corners of blocks break off.
            let inward = |corner: Vec2, rng: &mut Rng| {
                let way = middle - corner;
                corner + way.normalize_or_zero() * (GAP * 1.4 + 0.02 * rng.unit() * rng.unit())
            };
            let corners = corners.map(|corner| inward(corner, rng));
            blocks.push(rough(&corners, rng));
        }
    }
    blocks
}

/// A closed line through corners whose sides are uneven, by midpoint displacement.
fn rough(corners: &[Vec2], rng: &mut Rng) -> Vec<Vec2> {
    let mut points = corners.to_vec();
    for round in 0..5 {
        let share = 0.07 * 0.62f32.powi(round);
        let next: Vec<_> = points.iter().copied().cycle().skip(1).take(points.len()).collect();
        let halves = points.iter().zip(next).flat_map(|(&from, to)| {
            let aside = (to - from).perp() * (share * rng.signed());
            [from, 0.5 * (from + to) + aside]
        });
        points = halves.collect();
    }
    points
}

impl ReliefShape {
    /// The closed lines on a surface of `extent` pattern units.
    #[must_use]
    pub fn contours(&self, extent: Vec2, seed: u64) -> Vec<Vec<Vec2>> {
        let mut rng = Rng::new(seed).stream("seed contours");
        let (middle, side) = (0.5 * extent, extent.min_element());
        match self {
            Self::Wall => wall(extent, &mut rng),
            Self::Island => vec![blob(middle, 0.34 * side, 700, 0.8, &mut rng)],
            Self::Circle => vec![blob(middle, 0.4 * side, 256, 0.0, &mut rng)],
            Self::Lines(lines) => lines.iter().map(|line| line.iter().map(|uv| *uv * extent).collect()).collect(),
        }
    }
}
