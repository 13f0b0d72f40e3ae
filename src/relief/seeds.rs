//! Checks closed lines that come from outside, and puts them on a lattice.

use super::{
    error::ReliefError,
    lattice::{Lattice, Loop, edges},
    untangle::{Fill, untangle},
};
use glam::Vec2;

/// Most closed lines.
pub const MAX_SEEDS: usize = 1 << 16;

/// Largest coordinate of a point of a seed contour, pattern units.
pub const MAX_COORDINATE: f32 = 1e6;

/// Smallest size of all seed contours together, pattern units.
const LEAST_SIZE: f32 = 1e-6;

/// Most cuts where seed contours cross.
const MAX_SEED_CUTS: usize = 1 << 19;

/// Checks numbers.
pub(super) fn limits(seeds: &[Vec<Vec2>], most: usize) -> Result<(), ReliefError> {
    if seeds.is_empty() || seeds.len() > MAX_SEEDS {
        return Err(ReliefError::Contours { contours: seeds.len(), most: MAX_SEEDS });
    }
    if seeds.iter().map(Vec::len).sum::<usize>() > most {
        return Err(ReliefError::TooManyPoints { most });
    }
    for (contour, points) in seeds.iter().enumerate() {
        let is_fit = |v: f32| (-MAX_COORDINATE..=MAX_COORDINATE).contains(&v);
        if points.len() < 3 {
            return Err(ReliefError::TooFewPoints { contour, points: points.len() });
        }
        if let Some(point) = points.iter().position(|point| !(is_fit(point.x) && is_fit(point.y))) {
            let Vec2 { x, y } = points[point];
            return Err(ReliefError::Point { contour, point, x, y, most: MAX_COORDINATE });
        }
    }
    Ok(())
}

/// Seed contours on a lattice.
pub(super) struct Seeds {
    pub(super) lattice: Lattice,
    /// Simple rings.
    pub(super) rings: Vec<Loop>,
    /// `d0`: mean length of an edge as given, lattice steps.
    pub(super) mean_edge: f64,
}

impl Seeds {
    /// The region within contours that have passed [`limits`], on a lattice with room for `around` on all sides.
    pub(super) fn new(seeds: &[Vec<Vec2>], around: f64) -> Result<Self, ReliefError> {
        let all = || seeds.iter().flatten().copied();
        let (low, high) = (all().fold(Vec2::INFINITY, Vec2::min), all().fold(Vec2::NEG_INFINITY, Vec2::max));
        if (high - low).max_element() < LEAST_SIZE {
            return Err(ReliefError::NoArea);
        }
        let farthest = all().map(|point| point.abs().max_element()).fold(0.0, f32::max);
        let lattice = Lattice::new(f64::from(farthest) + around);
        let loops: Vec<Loop> =
            seeds.iter().map(|points| points.iter().map(|&point| lattice.point(point)).collect()).collect();
        let lengths = loops.iter().flat_map(|points| edges(points)).map(|(a, b)| a.distance(b)).filter(|&l| l > 0.0);
        let (count, length) = lengths.fold((0.0, 0.0), |(count, sum), length| (count + 1.0, sum + length));
        let rings = untangle(&loops, Fill::NonZero, 1, MAX_SEED_CUTS).map_err(|_| ReliefError::Tangled { level: 0 })?;
        if rings.is_empty() {
            return Err(ReliefError::NoArea);
        }
        Ok(Self { lattice, rings, mean_edge: length / f64::max(count, 1.0) })
    }
}
