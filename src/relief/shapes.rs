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
    /// Blocks of rock of several sizes, with gaps between them.
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
    let size = |k: f32| 1.0 / (k * ops::powf(k, 0.2));
    let waves: Vec<_> =
        (2u8..120).map(|k| (f32::from(k), uneven * rng.signed() * size(f32::from(k)), rng.unit())).collect();
    let corner = |i: u16| {
        let angle = TAU * f32::from(i) / f32::from(points);
        let wave = |&(k, size, phase): &(f32, f32, f32)| size * ops::cos(k * angle + TAU * phase);
        let out = (1.0 + waves.iter().map(wave).sum::<f32>()).clamp(0.35, 1.3);
        center + radius * out * ops::unit(angle)
    };
    (0..points).map(corner).collect()
}

/// How far the middles of neighboring blocks are from each other at least, pattern units; the largest blocks are as far again.
const APART: f32 = 0.16;

/// How much wider than high blocks are.
const FLAT: f32 = 1.55;

/// Half of the gap between blocks, pattern units.
const GAP: f32 = 0.006;

/// The part of a polygon on the side of `place` of the line halfway to `other`, less a gap.
fn cut(polygon: &[Vec2], place: Vec2, other: Vec2) -> Vec<Vec2> {
    let way = (other - place).normalize_or_zero();
    let most = 0.5 * place.distance(other) - GAP;
    let out = |point: Vec2| (point - place).dot(way) - most;
    let next = polygon.iter().cycle().skip(1);
    let sides = polygon.iter().zip(next).flat_map(|(&from, &to)| {
        let (a, b) = (out(from), out(to));
        let kept = (a <= 0.0).then_some(from);
        let crossing = ((a <= 0.0) != (b <= 0.0)).then(|| from + (to - from) * (a / (a - b)));
        [kept, crossing]
    });
    sides.flatten().collect()
}

/// Blocks of several sizes, wider than high and somewhat aslant, with gaps between them: the cells of random places.
fn wall(extent: Vec2, rng: &mut Rng) -> Vec<Vec<Vec2>> {
    // In a space in which blocks are as wide as high.
    let slant = 0.25 * rng.signed();
    let flatten = |place: Vec2| Vec2::new(place.x / FLAT, place.y + slant * place.x);
    let back = |flat: Vec2| Vec2::new(flat.x * FLAT, flat.y - slant * flat.x * FLAT);
    let mut places: Vec<(Vec2, f32)> = Vec::new();
    for _ in 0..2000 {
        let place = Vec2::new(rng.range(-0.3, 1.3), rng.range(-0.3, 1.3)) * extent;
        let (flat, room) = (flatten(place), APART * (1.0 + rng.unit() * rng.unit()));
        if places.iter().all(|(other, least)| other.distance(flat) >= 0.5 * (room + least)) {
            places.push((flat, room));
        }
    }
    let far = 4.0 * extent.max_element();
    let all = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|corner| Vec2::from(corner) * far);
    let cells = places.iter().map(|&(place, _)| {
        let others = places.iter().map(|(other, _)| *other).filter(|other| *other != place);
        others.fold(all.to_vec(), |cell, other| cut(&cell, place, other))
    });
    let cells: Vec<_> = cells.filter(|cell| cell.len() > 2).collect();
    let is_near = |cell: &&Vec<Vec2>| {
        let near = |point: &Vec2| point.cmpgt(-0.2 * extent).all() && point.cmplt(1.2 * extent).all();
        cell.iter().map(|flat| back(*flat)).any(|point| near(&point)) && cell.iter().all(|point| point.length() < far)
    };
    cells
        .iter()
        .filter(is_near)
        .map(|cell| rough(&cell.iter().map(|flat| back(*flat)).collect::<Vec<_>>(), rng))
        .collect()
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
