//! Rings of all methods and joins: simple, nested, far enough apart; the same in steps.

use super::{
    super::{ContourJob, Contours, Join, Method, ReliefError, ReliefParams},
    oracle::{assert_contours, distances},
    shapes::{KINDS, count, shape},
};
use crate::math::Rng;
use glam::Vec2;

fn join(rng: &mut Rng) -> Join {
    match rng.next_u32() % 5 {
        0 => Join::Miter,
        1 => Join::Bevel,
        2 => Join::Round,
        3 => Join::Arc { factor: rng.range(1.0, 16.0) },
        _ => Join::Arc { factor: [1.2, 1.4, 3.0][rng.next_u32() as usize % 3] },
    }
}

fn params(rng: &mut Rng) -> ReliefParams {
    let samples = 1 << (4 + rng.next_u32() % 7);
    let angles = [rng.range(0.0, 1.2), rng.range(0.0, 1.2)];
    ReliefParams {
        method: Method::ALL[rng.next_u32() as usize % 4],
        join: join(rng),
        distance: 0.004 * crate::math::ops::powf(50.0, rng.unit()),
        displacement: rng.unit(),
        min_angle: angles[0].min(angles[1]),
        max_angle: angles[0].max(angles[1]),
        samples,
        first_harmonic: 1 + rng.next_u32() % (samples / 2),
        long_edges: rng.unit(),
        inward: 1 + rng.next_u32() % 12,
        outward: rng.next_u32() % 4,
        ..ReliefParams::DEFAULT
    }
}

/// How near a level may come to the one before, in units of the distance.
fn least(params: &ReliefParams) -> f64 {
    let join = match params.join {
        Join::Miter | Join::Round => 0.99,
        Join::Arc { .. } => 0.7,
        Join::Bevel => 0.49,
    };
    if params.method == Method::Simple { join } else { 0.04 }
}

fn cases(usual: u64) -> u64 {
    std::env::var("CRACK_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

#[test]
fn rings_are_simple_and_nested_whatever_the_seed_contour() {
    let first = std::env::var("CRACK_FIRST").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    for case in first..first + cases(400) {
        let mut rng = Rng::new(case).stream("contours");
        let kind = case as usize % KINDS.len();
        let points = count(&mut rng, 5000.0);
        let seed = shape(kind, points, &mut rng);
        let params = params(&mut rng);
        let what = format!("case {case}, {} of {points} points, {params:?}", KINDS[kind]);
        eprintln!("{:?} {what}", std::time::SystemTime::now());
        match Contours::generate(&params, std::slice::from_ref(&seed), case) {
            Ok(contours) => assert_contours(&contours, least(&params) * f64::from(params.distance), &what),
            Err(ReliefError::NoArea) => assert!(kind > 3, "{what}: no area"),
            Err(error) => panic!("{what}: {error}"),
        }
    }
}
