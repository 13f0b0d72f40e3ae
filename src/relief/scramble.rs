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
        let steps: Vec<DVec2> = moved.iter().zip(&sampled.points).map(|(to, from)| *to - *from).collect();
        let mean = steps.iter().copied().sum::<DVec2>() / steps.len() as f64;
        let steps: Vec<DVec2> =
            steps.iter().map(|step| DVec2::from_array(shortened((*step - mean).to_array(), self.within))).collect();
        self.joined(&places, &sampled, &steps)
    }

    /// Samples and those corners between them that they miss, all displaced.
    fn joined(&self, corners: &[DVec2], sampled: &Sampled, steps: &[DVec2]) -> Loop {
        let count = steps.len();
        let next = |j: usize| if j + 1 == count { 0 } else { j + 1 };
        let mut out = Loop::with_capacity(count + corners.len() / 4);
        let mut corner = 0;
        for (j, (sample, step)) in sampled.points.iter().zip(steps).enumerate() {
            let place = *sample + *step;
            out.push(Point::round(place.x, place.y));
            let from = corner;
            while corner < corners.len() && sampled.passed[corner] < (j + 1) as f64 {
                corner += 1;
            }
            let between = from..corner;
            let chord = [*sample, sampled.points[next(j)]];
            let is_missed = between.clone().any(|i| distance(corners[i], chord) > self.tolerance);
            for i in between.filter(|_| is_missed) {
                let place = corners[i] + step.lerp(steps[next(j)], sampled.passed[i] - j as f64);
                out.push(Point::round(place.x, place.y));
            }
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
