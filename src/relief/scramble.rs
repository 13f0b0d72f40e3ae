//! A contour with random phases: what the generator makes of Fourier descriptors (sections 4.2 and 4.3 of the paper).

use super::{
    fourier::{Descriptors, Sampled, Transform},
    lattice::{Loop, Point},
    midpoint::shortened,
};
use crate::math::Rng;
use glam::DVec2;

/// How the high frequencies of a contour change. Lengths are in lattice steps.
pub(super) struct Scramble<'a> {
    pub(super) transform: &'a Transform,
    /// Phases change from here on.
    pub(super) first_harmonic: u32,
    /// Corners that samples would miss by more than this stay corners.
    pub(super) tolerance: f64,
    /// Largest displacement of a point.
    pub(super) within: f64,
}

impl Scramble<'_> {
    /// The line with other phases. Its middle stays where it was.
    ///
    /// Differs from the paper: samples go back to the line as displacements, at most a given distance, and corners
    /// between samples that are not nearly in line with them go with their neighbours.
    pub(super) fn apply(&self, ring: &[Point], rng: &mut Rng) -> Loop {
        let places: Vec<DVec2> = ring.iter().map(|point| DVec2::from_array(point.place())).collect();
        let sampled = Sampled::new(&places, self.transform.samples());
        let mut descriptors = Descriptors::of(&sampled.points, sampled.spacing, self.transform);
        descriptors.scramble(self.first_harmonic, rng);
        let moved = descriptors.places(self.transform);
        let mut steps: Vec<DVec2> = moved.iter().zip(&sampled.points).map(|(to, from)| *to - *from).collect();
        let mean = steps.iter().copied().sum::<DVec2>() / steps.len() as f64;
        for step in &mut steps {
            *step = DVec2::from_array(shortened((*step - mean).to_array(), self.within));
        }
        self.joined(&places, &sampled, &steps)
    }

    /// Samples and those corners between them that they miss, all displaced.
    fn joined(&self, corners: &[DVec2], sampled: &Sampled, steps: &[DVec2]) -> Loop {
        let count = steps.len();
        let next = |j: usize| if j + 1 == count { 0 } else { j + 1 };
        // Corners by the sample that they follow. Whether a corner is missed is as good as random, so there is no branch for it.
        let follow = || corners.iter().zip(&sampled.passed).map(|(corner, &passed)| (*corner, passed, passed as usize));
        let follow = || follow().take_while(|(_, _, j)| *j < count);
        let mut is_missed = vec![false; count];
        for (corner, _, j) in follow() {
            is_missed[j] |= distance(corner, [sampled.points[j], sampled.points[next(j)]]) > self.tolerance;
        }
        let mut added = vec![0; count];
        let mut out = vec![Point::default(); count + corners.len() + 1];
        let mut before = 0;
        for (corner, passed, j) in follow() {
            let place = corner + steps[j].lerp(steps[next(j)], passed - j as f64);
            // What is not missed is overwritten by what comes after it.
            out[j + 1 + before] = Point::round(place.x, place.y);
            before += usize::from(is_missed[j]);
            added[j] += usize::from(is_missed[j]);
        }
        out.truncate(count + before);
        let mut before = 0;
        for (j, (sample, step)) in sampled.points.iter().zip(steps).enumerate() {
            let place = *sample + *step;
            out[j + before] = Point::round(place.x, place.y);
            before += added[j];
        }
        out
    }
}

/// Distance of a point from a piece of a line.
fn distance(point: DVec2, [a, b]: [DVec2; 2]) -> f64 {
    let way = b - a;
    let share = if way == DVec2::ZERO { 0.0 } else { ((point - a).dot(way) / way.length_squared()).clamp(0.0, 1.0) };
    point.distance(a + way * share)
}
