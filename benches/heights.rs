//! Heights, normals and colors of contour lines on one thread.
//!
//! `cargo bench --no-default-features --bench heights`.

use bevy_crack::{
    math::{Rng, ops},
    pattern::SurfaceFrame,
    relief::{Contours, HeightMap, HeightParams, Ring},
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{UVec2, Vec2};
use std::hint::black_box;

/// Nested rings of an uneven mountain, all of one shape.
fn mountain(levels: u16, points: u16) -> Contours {
    let mut rng = Rng::new(3);
    let waves: Vec<_> = (1u8..40).map(|k| (f32::from(k), 0.35 * rng.signed() / f32::from(k), rng.unit())).collect();
    let corner = |i: u16, scale: f32| {
        let angle = std::f32::consts::TAU * f32::from(i) / f32::from(points);
        let wave = |&(k, size, phase): &(f32, f32, f32)| size * ops::cos(k * angle + std::f32::consts::TAU * phase);
        Vec2::splat(0.5) + 0.34 * scale * (1.0 + waves.iter().map(wave).sum::<f32>()) * ops::unit(angle)
    };
    let ring = |level: u16| Ring {
        points: (0..points).map(|i| corner(i, 1.0 - f32::from(level) / f32::from(levels))).collect(),
        level: level.into(),
    };
    Contours { rings: (0..levels).map(ring).collect(), distance: 0.34 / f32::from(levels) }
}

fn fields(c: &mut Criterion) {
    let mut group = c.benchmark_group("heights");
    group.sample_size(20);
    for (side, levels, points) in [(1024, 20, 256), (1024, 20, 1024), (1024, 60, 1024), (2048, 20, 1024)] {
        let Ok(frame) = SurfaceFrame::new(UVec2::splat(side)) else { return };
        let contours = mountain(levels, points);
        group.throughput(Throughput::Elements(u64::from(side) * u64::from(side)));
        let name = format!("{side}, {levels} levels of {points} points");
        group.bench_function(BenchmarkId::new("whole field", &name), |b| {
            b.iter(|| HeightMap::new(black_box(&contours), &HeightParams::DEFAULT, frame, 1).map(|map| map.heights(1)));
        });
        group.bench_function(BenchmarkId::new("preparation", &name), |b| {
            b.iter(|| HeightMap::new(black_box(&contours), &HeightParams::DEFAULT, frame, 1));
        });
    }
    group.finish();
}

criterion_group!(benches, fields);
criterion_main!(benches);
