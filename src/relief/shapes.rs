//! Seed contours to begin with: [`ReliefShape`].

use super::{shapes_island::coast, shapes_wall::wall};
use crate::math::{Rng, ops};
use glam::Vec2;
use std::f32::consts::TAU;

/// Where the contours of a relief begin.
///
/// ```
/// use bevy_crack::relief::ReliefShape;
///
/// let lines = ReliefShape::Island.contours([1.0, 1.0].into(), 7);
/// assert!((1..=5).contains(&lines.len()));
/// assert!(lines[0].len() > 300);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ReliefShape {
    /// Blocks of rock of several sizes, with gaps between them.
    #[default]
    Wall,
    /// An island around the middle: a coast line with headlands and bays, and those of up to 4 islets.
    Island,
    /// A circle around the middle.
    Circle,
    /// Closed lines, each a list of points in texture coordinates (0..=1, v down).
    Lines(Vec<Vec<Vec2>>),
}

/// A circle of so many points.
fn circle(center: Vec2, radius: f32, points: u16) -> Vec<Vec2> {
    (0..points).map(|i| center + radius * ops::unit(TAU * f32::from(i) / f32::from(points))).collect()
}

impl ReliefShape {
    /// The closed lines on a surface of `extent` pattern units.
    #[must_use]
    pub fn contours(&self, extent: Vec2, seed: u64) -> Vec<Vec<Vec2>> {
        let mut rng = Rng::new(seed).stream("seed contours");
        let (middle, side) = (0.5 * extent, extent.min_element());
        match self {
            Self::Wall => wall(extent, &mut rng),
            Self::Island => coast(extent, &mut rng),
            Self::Circle => vec![circle(middle, 0.4 * side, 256)],
            Self::Lines(lines) => lines.iter().map(|line| line.iter().map(|uv| *uv * extent).collect()).collect(),
        }
    }
}
