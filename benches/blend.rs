//! What it takes to blend normals, on one thread.
//!
//! `cargo bench --no-default-features --bench blend`. Sizes are those of the solved rectangle: 511 has the fastest
//! transform, the period of 510 has the prime factor 73.

use bevy_crack::{
    Grid,
    blend::{NormalBlending, ReliefPatch, blend_relief, solve_correction, solve_poisson},
    math::Rng,
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::UVec2;
use std::hint::black_box;

fn noise(size: UVec2) -> Grid<f32> {
    let mut rng = Rng::new(5);
    let mut grid = Grid::new(size, 0.0);
    grid.as_mut_slice().iter_mut().for_each(|value| *value = rng.range(-1.0, 1.0));
    grid
}

fn normals(size: UVec2) -> Vec<u8> {
    let mut rng = Rng::new(6);
    let mut texel = || [100 + (rng.next_u32() % 56) as u8, 100 + (rng.next_u32() % 56) as u8, 240, 255];
    (0..size.element_product()).flat_map(|_| texel()).collect()
}

fn solves(c: &mut Criterion) {
    let mut group = c.benchmark_group("solve_poisson");
    for side in [255, 510, 511, 512, 2047] {
        let source = noise(UVec2::splat(side));
        let mut grid = source.clone();
        group.throughput(Throughput::Elements(u64::from(side) * u64::from(side)));
        group.bench_function(BenchmarkId::from_parameter(side), |b| {
            b.iter(|| {
                grid.as_mut_slice().copy_from_slice(source.as_slice());
                black_box(solve_poisson(&mut grid))
            });
        });
    }
    group.finish();
}

fn blends(c: &mut Criterion) {
    let mut group = c.benchmark_group("blend_relief");
    let (size, part) = (UVec2::splat(513), UVec2::splat(511));
    let (height, base) = (noise(part), normals(size));
    let patch = ReliefPatch { height: &height, cover: None, origin: UVec2::ONE };
    let mut out = base.clone();
    for blending in [NormalBlending::Plain, NormalBlending::Whiteout, NormalBlending::Poisson] {
        group.bench_function(format!("{blending:?}"), |b| {
            b.iter(|| {
                out.copy_from_slice(&base);
                black_box(blend_relief(&mut out, size, &patch, blending))
            });
        });
    }
    group.finish();
}

fn corrections(c: &mut Criterion) {
    let mut group = c.benchmark_group("solve_correction");
    for (side, crack) in [(512, 64), (512, 512), (2048, 256)] {
        let size = UVec2::splat(side);
        let base = normals(size);
        let mut depth = Grid::new(size, 0);
        for x in 0..crack {
            depth.row_mut(x)[x] = u16::MAX;
        }
        group.bench_function(format!("crack of {crack} in {side}"), |b| {
            b.iter(|| black_box(solve_correction(&base, size, UVec2::ZERO, &depth)));
        });
    }
    group.finish();
}

criterion_group!(benches, solves, blends, corrections);
criterion_main!(benches);
