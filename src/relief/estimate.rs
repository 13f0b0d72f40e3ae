//! Parameters that suit a seed contour (what section 5 of the paper asks for).

use super::{
    error::ReliefError,
    fourier::{Descriptors, Sampled, Transform},
    lattice::{Loop, Point, cross, dot, double_area, perimeter},
    params::{Join, ReliefParams},
    seeds::{Seeds, limits},
    simplify::working_copy,
};
use glam::{DVec2, Vec2};

/// Levels from the border of a disc to its middle at the estimated distance.
const LEVELS: f64 = 10.0;

/// Share of the power above the first harmonic that changes.
const POWER: f64 = 0.05;

impl ReliefParams {
    /// The improved method with numbers taken from a seed contour, so that a rough and eroded contour makes a rough and
    /// eroded mountain. The paper leaves this open (section 5); these rules are ours.
    ///
    /// - *Distance*: a tenth of the contour's mean half width, twice its area divided by its length.
    /// - *Roughness*: the angles at which corners stand out from the line between their neighbours are the angles of
    ///   midpoints, from the lower quartile to one and a half of the upper; the 90th percentile of how far they stand
    ///   out, twice, is the largest displacement.
    /// - *Spectrum*: phases change where all higher frequencies together have a twentieth of the power of the contour's
    ///   directions.
    /// - *Erosion*: corners of valleys up to the mean turn of those of the seed stay corners, so `factor` is where extended
    ///   edges of such a corner meet, 1..=4.
    ///
    /// ```
    /// use bevy_crack::relief::ReliefParams;
    /// use glam::Vec2;
    ///
    /// let smooth: Vec<_> = (0..400).map(|i| Vec2::from_angle(i as f32 * 0.015_707_96)).collect();
    /// let rough: Vec<_> = smooth.iter().enumerate().map(|(i, p)| *p * [1.0, 1.02][i % 2]).collect();
    /// let [smooth, rough] = [ReliefParams::estimate(&smooth)?, ReliefParams::estimate(&rough)?];
    /// assert!(smooth.max_angle < 0.1 * rough.max_angle);
    /// # Ok::<(), bevy_crack::relief::ReliefError>(())
    /// ```
    ///
    /// # Errors
    /// [`ReliefError::TooFewPoints`], [`ReliefError::TooManyPoints`], [`ReliefError::Point`], [`ReliefError::NoArea`],
    /// [`ReliefError::Tangled`].
    pub fn estimate(contour: &[Vec2]) -> Result<Self, ReliefError> {
        let contours = [contour.to_vec()];
        limits(&contours, super::generate::MAX_LEVEL_POINTS)?;
        let Seeds { lattice, rings, .. } = Seeds::new(&contours, 0.0)?;
        let ring = rings.into_iter().max_by_key(|ring| double_area(ring)).ok_or(ReliefError::NoArea)?;
        let distance = double_area(&ring) as f64 / perimeter(&ring) / LEVELS;
        let [low, high, displacement] = roughness(&ring);
        let number = |name: f64, least: f64, most: f64| name.clamp(least, most) as f32;
        let out = Self {
            distance: number(distance / lattice.steps(), 1e-6, 1e6),
            min_angle: number(low, 0.0, 1.2),
            max_angle: number(1.5 * high, low.min(1.2), 1.2),
            displacement: number(2.0 * displacement / distance, 0.0, 1.0),
            first_harmonic: first_harmonic(&ring, Self::DEFAULT.samples),
            join: Join::Arc { factor: number(erosion(&working_copy(&ring, 0.05 * distance)), 1.0, 4.0) },
            ..Self::IMPROVED
        };
        Ok(Self { max_angle: out.max_angle.max(out.min_angle), ..out })
    }
}

/// Each corner with the ones before and after it.
fn corners(ring: &[Point]) -> impl Iterator<Item = [Point; 3]> + '_ {
    (0..ring.len()).map(|i| [ring[(i + ring.len() - 1) % ring.len()], ring[i], ring[(i + 1) % ring.len()]])
}

/// Quartiles of the angles at which corners stand out, radians, and the 90th percentile of how far.
fn roughness(ring: &Loop) -> [f64; 3] {
    let mut angles = Vec::with_capacity(ring.len());
    let mut heights = Vec::with_capacity(ring.len());
    for [a, b, c] in corners(ring) {
        let length = a.distance(c).max(1.0);
        let height = cross(a.to(c), a.to(b)).abs() as f64 / length;
        heights.push(height);
        angles.push(libm::atan2(height, 0.5 * length));
    }
    angles.sort_by(f64::total_cmp);
    heights.sort_by(f64::total_cmp);
    let at = |sorted: &[f64], share: f64| sorted[(share * (sorted.len() - 1) as f64) as usize];
    [at(&angles, 0.25), at(&angles, 0.75), at(&heights, 0.9)]
}

fn first_harmonic(ring: &Loop, samples: u32) -> u32 {
    let places: Vec<DVec2> = ring.iter().map(|point| DVec2::from_array(point.place())).collect();
    let sampled = Sampled::new(&places, samples as usize);
    let descriptors = Descriptors::of(&sampled.points, sampled.spacing, &Transform::new(samples));
    let power = |k: i32| descriptors.harmonic(k).length_squared() + descriptors.harmonic(-k).length_squared();
    let highest = samples as i32 / 2;
    let all: f64 = (2..=highest).map(power).sum();
    let mut above = 0.0;
    let is_little = |k: &i32| {
        above += power(*k);
        above <= POWER * all
    };
    let first = (2..=highest).rev().take_while(is_little).last().unwrap_or(highest);
    first.max(8) as u32
}

/// How far, in units of the distance, extended edges meet at a valley corner with the mean turn.
fn erosion(ring: &Loop) -> f64 {
    /// Turns that count, radians.
    const LEAST: f64 = 0.2;
    let turns = corners(ring).map(|[a, b, c]| {
        let (u, v) = (a.to(b), b.to(c));
        -libm::atan2(cross(u, v) as f64, dot(u, v) as f64)
    });
    // Sharp corners weigh more.
    let (sum, weight) =
        turns.filter(|turn| *turn > LEAST).fold((0.0, 0.0), |(s, w), turn| (s + turn * turn * turn, w + turn * turn));
    if weight > 0.0 { 1.0 / libm::cos(0.5 * sum / weight).max(0.1) } else { 1.0 }
}
