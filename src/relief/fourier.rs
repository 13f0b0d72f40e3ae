//! Fourier descriptors of closed lines, and what random phases make of them (section 4.2 of the paper).

use super::error::ReliefError;
use crate::math::Rng;
use glam::{DVec2, Vec2};
use std::f64::consts::TAU;

/// The discrete Fourier transform of one length, a power of two, with the same bits on every machine.
#[derive(Clone, Debug)]
pub(super) struct Transform {
    /// `exp(-2πi k / n)` for `k` below `n / 2`.
    roots: Vec<DVec2>,
    /// Where each value goes before the first step: its index with the bits reversed.
    order: Vec<u32>,
}

fn times(a: DVec2, b: DVec2) -> DVec2 {
    DVec2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

/// `a` with `b` turned by a root, added and subtracted.
fn both(a: DVec2, b: DVec2, root: DVec2) -> (DVec2, DVec2) {
    let turned = times(b, root);
    (a + turned, a - turned)
}

impl Transform {
    /// For `samples` values, a power of two from 2 on.
    pub(super) fn new(samples: u32) -> Self {
        let bits = samples.trailing_zeros();
        let root = |k: u32| {
            let angle = -TAU * f64::from(k) / f64::from(samples);
            DVec2::new(libm::cos(angle), libm::sin(angle))
        };
        let order = (0..samples).map(|i| i.reverse_bits() >> (32 - bits)).collect();
        Self { roots: (0..samples / 2).map(root).collect(), order }
    }

    pub(super) fn samples(&self) -> usize {
        self.order.len()
    }

    /// `Σ_j values(j) exp(-2πi j k / n)` for all `k`, without the factor `1 / n`.
    fn forward(&self, values: &[DVec2]) -> Vec<DVec2> {
        let mut out: Vec<DVec2> = self.order.iter().map(|&i| values[i as usize]).collect();
        let mut half = 1;
        if out.len() >= 4 {
            // As `two_steps`, whose loops are too short here.
            let [first, third] = [self.roots[0], self.roots[self.roots.len() / 2]];
            let (blocks, _) = out.as_chunks_mut();
            for [a, b, c, d] in blocks {
                let ((p, q), (r, s)) = (both(*a, *b, first), both(*c, *d, first));
                ((*a, *c), (*b, *d)) = (both(p, r, first), both(q, s, third));
            }
            half = 4;
        }
        while 4 * half <= out.len() {
            self.two_steps(&mut out, half);
            half *= 4;
        }
        if half < out.len() {
            let (low, high) = out.split_at_mut(half);
            for ((a, b), root) in low.iter_mut().zip(high).zip(&self.roots) {
                (*a, *b) = both(*a, *b, *root);
            }
        }
        out
    }

    /// The step for blocks of `half` values and the one after it, in one go over the values.
    fn two_steps(&self, values: &mut [DVec2], half: usize) {
        let stride = self.roots.len() / (2 * half);
        for block in values.chunks_exact_mut(4 * half) {
            let (low, high) = block.split_at_mut(2 * half);
            let ((a, b), (c, d)) = (low.split_at_mut(half), high.split_at_mut(half));
            let first = self.roots.iter().step_by(2 * stride);
            let (second, third) = (&self.roots[..half * stride], &self.roots[half * stride..]);
            let roots = first.zip(second.iter().step_by(stride).zip(third.iter().step_by(stride)));
            for (((a, b), (c, d)), (first, (second, third))) in a.iter_mut().zip(b).zip(c.iter_mut().zip(d)).zip(roots)
            {
                let ((p, q), (r, s)) = (both(*a, *b, *first), both(*c, *d, *first));
                ((*a, *c), (*b, *d)) = (both(p, r, *second), both(q, s, *third));
            }
        }
    }

    /// `Σ_k values(k) exp(2πi j k / n)` for all `j`.
    fn backward(&self, values: &[DVec2]) -> Vec<DVec2> {
        let mut out = self.forward(values);
        out[1..].reverse();
        out
    }
}

/// A closed line as the Fourier transform of its directions: the P-type descriptors of Uesaka 1984.
///
/// The line is sampled at `n` points `z(j)` at equal distances `h` along it, as complex numbers. Its directions
/// `w(j) = (z(j+1) - z(j)) / h` have the descriptors `c(k) = 1/n Σ_j w(j) exp(-2πi jk/n)`. Amplitudes `|c(k)|` say how
/// rough the line is at `|k|` waves per round; phases say where.
///
/// ```
/// use bevy_crack::{math::Rng, relief::Descriptors};
/// use glam::Vec2;
///
/// let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from_array);
/// let mut descriptors = Descriptors::new(&square, 1024)?;
/// assert!(descriptors.points()[256].distance([1.0, 0.0].into()) < 1e-9);
/// assert!((descriptors.spacing() - 4.0 / 1024.0).abs() < 1e-12);
///
/// // Another line, equally rough, which is the same for all waves below the 256th.
/// let before = descriptors.clone();
/// descriptors.scramble(256, &mut Rng::new(7));
/// assert_eq!(before.harmonic(-255), descriptors.harmonic(-255));
/// assert_ne!(before.harmonic(257), descriptors.harmonic(257));
/// # Ok::<(), bevy_crack::relief::ReliefError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Descriptors {
    /// `c(k)`, negative `k` at `n + k`.
    harmonics: Vec<DVec2>,
    /// `h`.
    spacing: f64,
    /// `z(0)`.
    start: DVec2,
}

impl Descriptors {
    /// Samples a closed line and transforms it. The first sample is the first point.
    ///
    /// # Errors
    /// [`ReliefError::TooFewPoints`] below three points, [`ReliefError::Point`] if one is not finite, [`ReliefError::NoArea`]
    /// if all are the same, [`ReliefError::Samples`] if `samples` is no power of two in 16..=16384.
    pub fn new(points: &[Vec2], samples: u32) -> Result<Self, ReliefError> {
        if points.len() < 3 {
            return Err(ReliefError::TooFewPoints { contour: 0, points: points.len() });
        }
        if let Some(point) = points.iter().position(|point| !point.is_finite()) {
            let Vec2 { x, y } = points[point];
            return Err(ReliefError::Point { contour: 0, point, x, y, most: f32::MAX });
        }
        if !samples.is_power_of_two() || !(16..=16384).contains(&samples) {
            return Err(ReliefError::Samples { samples });
        }
        if points.iter().all(|point| *point == points[0]) {
            return Err(ReliefError::NoArea);
        }
        let places: Vec<DVec2> = points.iter().map(|point| point.as_dvec2()).collect();
        let sampled = Sampled::new(&places, samples as usize);
        Ok(Self::of(&sampled.points, sampled.spacing, &Transform::new(samples)))
    }

    /// The descriptors of samples.
    pub(super) fn of(samples: &[DVec2], spacing: f64, transform: &Transform) -> Self {
        let count = samples.len();
        let mut ways: Vec<DVec2> = samples.windows(2).map(|pair| (pair[1] - pair[0]) / spacing).collect();
        ways.push((samples[0] - samples[count - 1]) / spacing);
        let mut harmonics = transform.forward(&ways);
        // The number of samples is a power of two, so this is the same as to divide.
        let share = 1.0 / count as f64;
        harmonics.iter_mut().for_each(|c| *c *= share);
        // The line is closed.
        harmonics[0] = DVec2::ZERO;
        Self { harmonics, spacing, start: samples[0] }
    }

    /// `c(k)` as real and imaginary part, for any whole `k`; it repeats after `n`.
    #[must_use]
    pub fn harmonic(&self, k: i32) -> DVec2 {
        self.harmonics[k.rem_euclid(self.harmonics.len() as i32) as usize]
    }

    /// Distance between samples along the line, `h`.
    #[must_use]
    pub const fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Draws new phases, uniform on the circle, for all harmonics with `|k| >= first_harmonic`.
    ///
    /// Amplitudes stay, and so do all other harmonics.
    pub fn scramble(&mut self, first_harmonic: u32, rng: &mut Rng) {
        let count = self.harmonics.len();
        let first = first_harmonic.max(1) as usize;
        for k in first..=count.saturating_sub(first) {
            let angle = TAU * f64::from(rng.unit());
            let (sin, cos) = libm::sincos(angle);
            self.harmonics[k] = DVec2::new(cos, sin) * self.harmonics[k].length();
        }
    }

    /// The line's samples: `z(0)`, then `z(m) = z(0) + h Σ_(j<m) w(j)`.
    #[must_use]
    pub fn points(&self) -> Vec<DVec2> {
        self.places(&Transform::new(self.harmonics.len() as u32))
    }

    pub(super) fn places(&self, transform: &Transform) -> Vec<DVec2> {
        let ways = transform.backward(&self.harmonics);
        let mut at = self.start;
        let place = |way: DVec2| {
            let here = at;
            at += way * self.spacing;
            here
        };
        ways.into_iter().map(place).collect()
    }
}

/// A closed line at equal distances.
pub(super) struct Sampled {
    pub(super) points: Vec<DVec2>,
    /// The distance along the line between samples.
    pub(super) spacing: f64,
    /// For each corner of the line, how many samples it has passed, with a fraction.
    pub(super) passed: Vec<f64>,
}

impl Sampled {
    /// `count` samples of a closed line that is longer than 0, from its first corner.
    pub(super) fn new(line: &[DVec2], count: usize) -> Self {
        let next = |i: usize| line[if i + 1 == line.len() { 0 } else { i + 1 }];
        let others = line[1..].iter().chain(&line[..1]);
        let longs: Vec<f64> = line.iter().zip(others).map(|(point, next)| point.distance(*next)).collect();
        let mut length = 0.0;
        let to_end = |long: &f64| {
            length += long;
            length
        };
        let ends: Vec<f64> = longs.iter().map(to_end).collect();
        let spacing = length / count as f64;
        let passed_at_end: Vec<f64> = ends.iter().map(|end| end / spacing).collect();
        // How many edges end before each sample and after the one before it. Where they do is as good as random, so there is
        // no branch for it; the quotient is a sample off at most.
        let mut ended = vec![0u32; count + 1];
        for (end, passed) in ends.iter().zip(&passed_at_end) {
            let low = (*passed as usize).saturating_sub(1);
            let is_before = |j: usize| usize::from(spacing * j as f64 <= *end);
            let first = low + is_before(low) + is_before(low + 1) + is_before(low + 2);
            ended[first.min(count)] += 1;
        }
        let mut edge = 0;
        let sample = |(j, ended): (usize, &u32)| {
            edge += *ended as usize;
            let (at, edge) = (spacing * j as f64, edge.min(line.len() - 1));
            let long = longs[edge];
            let rest = if long > 0.0 { ((ends[edge] - at) / long).clamp(0.0, 1.0) } else { 0.0 };
            next(edge).lerp(line[edge], rest)
        };
        let points = ended[..count].iter().enumerate().map(sample).collect();
        let starts = std::iter::once(0.0).chain(passed_at_end);
        let passed = starts.take(line.len()).collect();
        Self { points, spacing, passed }
    }
}
