//! Fourier descriptors against the sums that define them.

use super::{
    super::{Descriptors, ReliefError},
    shapes::{KINDS, count, shape},
};
use crate::math::Rng;
use glam::{DVec2, Vec2};
use std::f64::consts::TAU;

fn lines(number: u64) -> impl Iterator<Item = (Vec<Vec2>, Rng)> {
    (0..number).map(|case| {
        let mut rng = Rng::new(case).stream("descriptors");
        let points = count(&mut rng, 2000.0);
        (shape(case as usize % KINDS.len(), points, &mut rng), rng)
    })
}

/// The definition, term by term.
fn harmonic(points: &[DVec2], spacing: f64, k: i32) -> DVec2 {
    let count = points.len();
    let term = |j: usize| {
        let w = (points[(j + 1) % count] - points[j]) / spacing;
        let angle = -TAU * f64::from(k) * j as f64 / count as f64;
        let (cos, sin) = (libm::cos(angle), libm::sin(angle));
        DVec2::new(w.x * cos - w.y * sin, w.x * sin + w.y * cos)
    };
    (0..count).map(term).sum::<DVec2>() / count as f64
}

#[test]
fn harmonics_are_the_sums_of_the_paper() {
    for (case, (line, mut rng)) in lines(20).enumerate() {
        // Even and odd powers of two.
        let samples = [256, 512, 16, 32][case % 4];
        let descriptors = Descriptors::new(&line, samples).unwrap();
        let points = descriptors.points();
        for _ in 0..8 {
            let k = (rng.next_u32() % samples) as i32 - samples as i32 / 2;
            let error = descriptors.harmonic(k).distance(harmonic(&points, descriptors.spacing(), k));
            assert!(error < 1e-11, "harmonic {k}: {error}");
        }
    }
}

#[test]
fn samples_come_back() {
    for (line, _) in lines(60) {
        let descriptors = Descriptors::new(&line, 1024).unwrap();
        let length: f64 =
            line.iter().zip(line.iter().cycle().skip(1)).map(|(a, b)| a.as_dvec2().distance(b.as_dvec2())).sum();
        assert!((descriptors.spacing() * 1024.0 - length).abs() < 1e-9 * length);
        let points = descriptors.points();
        assert!(points[0].distance(line[0].as_dvec2()) < 1e-12);
        // Every sample lies on the line, at its length from the start.
        let (mut edge, mut before) = (0, 0.0);
        for (j, point) in points.iter().enumerate() {
            let at = descriptors.spacing() * j as f64;
            let ends = |edge: usize| [line[edge % line.len()].as_dvec2(), line[(edge + 1) % line.len()].as_dvec2()];
            while edge + 1 < line.len() && before + ends(edge)[0].distance(ends(edge)[1]) < at {
                before += ends(edge)[0].distance(ends(edge)[1]);
                edge += 1;
            }
            let [a, b] = ends(edge);
            let expected = if a == b { a } else { a + (b - a).normalize() * (at - before) };
            assert!(point.distance(expected) < 1e-6 * length, "sample {j}: {point} {expected}");
        }
    }
}

#[test]
fn random_phases_keep_amplitudes_low_frequencies_and_the_line_closed() {
    for (line, mut rng) in lines(60) {
        let before = Descriptors::new(&line, 1024).unwrap();
        let first = 1 + rng.next_u32() % 512;
        let mut after = before.clone();
        after.scramble(first, &mut rng);
        let mut changed = 0;
        for k in -512..512 {
            let [old, new] = [before.harmonic(k), after.harmonic(k)];
            assert!((old.length() - new.length()).abs() <= 1e-12, "amplitude {k}");
            if k.unsigned_abs() < first {
                assert_eq!(old, new, "harmonic {k} below {first}");
            } else if old.distance(new) > 1e-3 * old.length() {
                changed += 1;
            }
        }
        let most = 1024 - 2 * (first as i32 - 1) - 1;
        assert!(changed as f64 >= 0.9 * f64::from(most) || line.len() < 8, "{changed} of {most} changed");
        let points = after.points();
        // The last direction leads back to the first sample.
        let length = before.spacing() * 1024.0;
        let last = after.spacing() * synthesized(&after, 1023);
        let gap = points[1023] + last - points[0];
        assert!(gap.length() < 1e-6 * length, "open by {}", gap.length());
    }
}

/// `w(j)`, by the sum over all harmonics.
fn synthesized(descriptors: &Descriptors, j: i32) -> DVec2 {
    (-512..512)
        .map(|k| {
            let angle = TAU * f64::from(k) * f64::from(j) / 1024.0;
            let (cos, sin, c) = (libm::cos(angle), libm::sin(angle), descriptors.harmonic(k));
            DVec2::new(c.x * cos - c.y * sin, c.x * sin + c.y * cos)
        })
        .sum()
}

#[test]
fn phases_are_even_on_the_circle() {
    let line: Vec<Vec2> = [[0.0, 0.0], [1.0, 0.1], [0.7, 0.9]].map(Vec2::from_array).into();
    let mut sum = DVec2::ZERO;
    let mut number = 0.0;
    for seed in 0..40 {
        let mut descriptors = Descriptors::new(&line, 1024).unwrap();
        descriptors.scramble(256, &mut Rng::new(seed));
        for k in 256..512 {
            sum += descriptors.harmonic(k).normalize_or_zero();
            number += 1.0;
        }
    }
    assert!((sum / number).length() < 0.03, "mean {}", sum / number);
}

#[test]
fn hostile_lines_are_errors() {
    let line: Vec<Vec2> = [[0.0, 0.0], [1.0, 0.1], [0.7, 0.9]].map(Vec2::from_array).into();
    assert_eq!(Descriptors::new(&line[..2], 64), Err(ReliefError::TooFewPoints { contour: 0, points: 2 }));
    for samples in [0, 8, 100, 32768] {
        assert_eq!(Descriptors::new(&line, samples), Err(ReliefError::Samples { samples }));
    }
    assert_eq!(Descriptors::new(&[Vec2::ONE; 5], 64), Err(ReliefError::NoArea));
    let odd = [Vec2::ZERO, Vec2::ONE, Vec2::new(f32::NAN, 1.0)];
    assert!(matches!(Descriptors::new(&odd, 64), Err(ReliefError::Point { point: 2, .. })));
}
