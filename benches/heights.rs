//! Heights, normals, colors and meshes of contour lines, and craters, on one thread; heights beside the plain way in the
//! same run.
//!
//! `cargo bench --no-default-features --bench heights`.

use bevy_crack::{
    Grid,
    math::{Rng, ops},
    pattern::SurfaceFrame,
    relief::{
        Contours, Crater, CraterParams, HeightMap, HeightParams, ReliefFrame, ReliefMesh, Ring, TerrainColors, colors,
        heights, normals,
    },
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

fn to_segment(pos: Vec2, a: Vec2, b: Vec2) -> f32 {
    let share = ((pos - a).dot(b - a) / a.distance_squared(b).max(1e-12)).clamp(0.0, 1.0);
    pos.distance_squared(a.lerp(b, share))
}

/// Linear between the two nearest levels, each texel against every segment of every ring.
fn naive(contours: &Contours, frame: &SurfaceFrame) -> Grid<f32> {
    let mut grid = Grid::new(frame.size(), 0.0);
    for y in 0..grid.height() {
        for (x, out) in grid.row_mut(y).iter_mut().enumerate() {
            let pos = frame.to_pos(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
            let mut nearest = [(f32::MAX, 0); 2];
            for ring in &contours.rings {
                let sides = ring.points.iter().zip(ring.points.iter().cycle().skip(1));
                let square = sides.map(|(a, b)| to_segment(pos, *a, *b)).fold(f32::MAX, f32::min);
                if square < nearest[0].0 {
                    nearest = [(square, ring.level), nearest[0]];
                } else if square < nearest[1].0 {
                    nearest[1] = (square, ring.level);
                }
            }
            let [(first, low), (second, high)] = nearest;
            let share = first.sqrt() / (first.sqrt() + second.sqrt());
            *out = low as f32 + share * (high - low) as f32;
        }
    }
    grid
}

/// Beside the plain way, on a small surface.
fn beside_the_plain_way(c: &mut Criterion) {
    let mut group = c.benchmark_group("heights at 128, 20 levels of 256 points");
    group.sample_size(10);
    let (contours, Ok(frame)) = (mountain(20, 256), SurfaceFrame::new(UVec2::splat(128))) else { return };
    group.bench_function("all segments, linear", |b| b.iter(|| naive(black_box(&contours), &frame)));
    group.bench_function("tiles, cubic", |b| {
        b.iter(|| heights(black_box(&contours), &HeightParams::DEFAULT, frame, 1));
    });
    group.finish();
}

fn pictures(c: &mut Criterion) {
    let mut group = c.benchmark_group("pictures of heights at 1024");
    group.sample_size(20);
    let Ok(frame) = SurfaceFrame::new(UVec2::splat(1024)) else { return };
    let Ok(grid) = heights(&mountain(20, 256), &HeightParams::DEFAULT, frame, 1) else { return };
    group.bench_function("normals", |b| b.iter(|| normals(black_box(&grid), &frame)));
    group.bench_function("colors", |b| b.iter(|| colors(black_box(&grid), &frame, &TerrainColors::ROCK, 1)));
    group.bench_function("mesh, one vertex for 4 x 4 texels", |b| {
        b.iter(|| ReliefMesh::new(black_box(&grid), &ReliefFrame::new(Vec2::ONE), 2));
    });
    group.finish();
}

fn craters(c: &mut Criterion) {
    let mut group = c.benchmark_group("craters");
    let Ok(frame) = SurfaceFrame::new(UVec2::splat(1024)) else { return };
    let make = |seed| Crater::new(Vec2::splat(0.5), &CraterParams::DEFAULT, seed);
    group.bench_function("rings", |b| b.iter(|| make(black_box(7))));
    let Ok(crater) = make(7) else { return };
    let mut depths = Grid::new(UVec2::splat(128), 0u16);
    group.bench_function("fill 128 x 128 texels", |b| {
        b.iter(|| crater.fill(UVec2::splat(448), &frame, 1.0, black_box(&mut depths)));
    });
    group.finish();
}

criterion_group!(benches, fields, beside_the_plain_way, pictures, craters);
criterion_main!(benches);
