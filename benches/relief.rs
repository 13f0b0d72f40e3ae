//! Fifty contours inward of a wavy polygon with 1,000 and 10,000 corners, on one thread, beside `i_overlay` in the same
//! run.
//!
//! `i_overlay` offsets the original by ten of the fifty distances, as its offset of an offset takes longer; with
//! 10,000 corners it takes about a second for each, so it is left out.
//!
//! `cargo bench --no-default-features --bench relief`.

use bevy_crack::relief::{ContourJob, Contours, Join, Method, ReliefParams};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::Vec2;
use i_overlay::mesh::{
    float::outline::offset::OutlineOffset,
    float::style::{LineJoin, OutlineStyle},
};
use std::{f64::consts::TAU, hint::black_box};

const STEP: f32 = 2.0;
const LEVELS: u32 = 50;

/// Eight waves round a circle of radius 300.
fn polygon(corners: u32) -> Vec<Vec2> {
    let mut state = 5u64;
    let phases: [f64; 8] = std::array::from_fn(|_| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64 * 628.0 / 100.0
    });
    (0..corners)
        .map(|i| {
            let t = f64::from(i) / f64::from(corners) * TAU;
            let wave = |(k, phase): (usize, &f64)| 40.0 / (k + 1) as f64 * ((2 * k + 3) as f64 * t + phase).sin();
            let radius = 300.0 + phases.iter().enumerate().map(wave).sum::<f64>();
            Vec2::new((400.0 + radius * t.cos()) as f32, (400.0 + radius * t.sin()) as f32)
        })
        .collect()
}

fn inward(c: &mut Criterion) {
    let mut group = c.benchmark_group("50 contours inward");
    group.sample_size(10);
    let base = ReliefParams { distance: STEP, inward: LEVELS, ..ReliefParams::IMPROVED };
    let methods = [
        ("simple, miter", ReliefParams { method: Method::Simple, join: Join::Miter, ..base }),
        ("simple, arc 1.4", ReliefParams { join: Join::Arc { factor: 1.4 }, method: Method::Simple, ..base }),
        ("simple, round", ReliefParams { method: Method::Simple, join: Join::Round, ..base }),
        ("improved", base),
    ];
    for corners in [1000, 10_000] {
        let seeds = [polygon(corners)];
        for (name, params) in methods {
            let contours = || Contours::generate(&params, black_box(&seeds), 1);
            let has_all = contours().is_ok_and(|contours| contours.levels() == Some((0, LEVELS as i32)));
            assert!(has_all, "{name} makes all contours");
            group.bench_function(BenchmarkId::new(name, corners), |b| b.iter(contours));
        }
        if corners > 1000 {
            continue;
        }
        let peer: Vec<Vec<[f64; 2]>> =
            vec![seeds[0].iter().map(|point| [f64::from(point.x), f64::from(point.y)]).collect()];
        group.bench_function(BenchmarkId::new("i_overlay, 10 of 50", corners), |b| {
            b.iter(|| {
                let style =
                    |k: u32| OutlineStyle::new(-f64::from(5 * k) * f64::from(STEP)).line_join(LineJoin::Miter(0.2));
                (1..=10).map(|k| peer.outline(&style(k)).len()).sum::<usize>()
            });
        });
    }
    group.finish();
}

/// The longest step of a job: what a background task cannot be stopped in.
fn one_step(c: &mut Criterion) {
    let mut group = c.benchmark_group("first contour");
    let params = ReliefParams { distance: STEP, ..ReliefParams::IMPROVED };
    for corners in [1000, 10_000] {
        let Ok(job) = ContourJob::new(&params, &[polygon(corners)], 1) else { continue };
        group.bench_function(BenchmarkId::new("improved", corners), |b| {
            b.iter_batched(|| job.clone(), |mut job| job.step(), criterion::BatchSize::LargeInput);
        });
    }
    group.finish();
}

criterion_group!(benches, inward, one_step);
criterion_main!(benches);
