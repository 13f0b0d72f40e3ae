//! Strands on one thread at 2048 x 2048: one and ten, from the field to painted cracks, and a whole field image beside
//! the plain way in the same run.
//!
//! `cargo bench --no-default-features --bench strands`.

use bevy_crack::{
    Grid,
    blend::NormalBlending,
    math::{Rng, ops},
    paint::{BaseTexels, Look, LookTable, PaintTargets, correct_normals, paint_rects},
    pattern::SurfaceFrame,
    raster::{DepthField, DirtyTiles, Profile, stamp_path},
    strands::{Directions, GuidanceField, Material, StrandParams, StrandStart, Strands},
};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{UVec2, Vec2};
use noise::{NoiseFn, Perlin};
use std::hint::black_box;

const SIDE: u32 = 2048;
const EAST: Directions = Directions::Linear(Vec2::X);

/// Paths with one step per texel, as in the paper.
fn params() -> StrandParams {
    StrandParams { step: 1.0 / SIDE as f32, ..StrandParams::ASPHALT }
}

fn starts(count: u32) -> Vec<StrandStart> {
    let mut rng = Rng::new(1);
    let start = |i| Vec2::new(0.02 + 0.1 * rng.unit(), (i as f32 + 0.5) / count as f32);
    (0..count).map(start).map(|pos| StrandStart { pos, direction: Some(Vec2::X) }).collect()
}

fn strands(c: &mut Criterion) {
    let mut group = c.benchmark_group("strands at 2048");
    group.sample_size(20);
    let Ok(frame) = SurfaceFrame::new(UVec2::splat(SIDE)) else { return };
    let (params, primitives) = (params(), Material::Asphalt.primitives());
    let profile = Profile { full_width: 0.008, ..Profile::DEFAULT };
    for count in [1, 10] {
        let starts = starts(count);
        let paths = || Strands::new(&params, EAST, black_box(&starts), frame.extent(), 1);
        group.bench_function(BenchmarkId::new("paths", count), |b| b.iter(paths));
        let Ok(grown) = paths() else { continue };
        group.bench_function(BenchmarkId::new("network", count), |b| b.iter(|| grown.network(&primitives)));
        let mut field = DepthField::new(frame);
        group.bench_function(BenchmarkId::new("paths, network and stamps", count), |b| {
            b.iter(|| {
                let network = paths()?.network(&primitives)?;
                for path in network.segments().filter_map(|segment| network.path(segment)) {
                    stamp_path(&mut field, &profile, &path);
                }
                Ok::<_, bevy_crack::strands::StrandError>(network)
            });
        });
    }
    group.finish();
}

/// From the directions to the painted picture: paths, network, stamps, diffuse and normals, and the normals of the touched
/// rectangle made one with those of the surface by Poisson's equation.
fn all_of_it(c: &mut Criterion) {
    let mut group = c.benchmark_group("from directions to texels at 2048");
    group.sample_size(10);
    let size = UVec2::splat(SIDE);
    let Ok(frame) = SurfaceFrame::new(size) else { return };
    let look = Look { normals: NormalBlending::Poisson, ..Look::GROOVE };
    let Ok(look) = LookTable::new(&look, frame.texels_per_unit()) else { return };
    let (params, primitives) = (params(), Material::Asphalt.primitives());
    let profile = Profile { full_width: 0.008, ..Profile::DEFAULT };
    let mut rng = Rng::new(6);
    let mut texel = || [110 + (rng.next_u32() % 36) as u8, 110 + (rng.next_u32() % 36) as u8, 240, 255];
    let (diffuse, normal): (Vec<u8>, Vec<u8>) =
        ([130; 4].repeat((SIDE * SIDE) as usize), (0..SIDE * SIDE).flat_map(|_| texel()).collect());
    let base = BaseTexels { size, diffuse: &diffuse, normal: Some(&normal), depth: None };
    let (mut out, mut normals) = (diffuse.clone(), normal.clone());
    for (count, blends) in [(1, false), (1, true), (10, false), (10, true)] {
        let starts = starts(count);
        let mut run = |mut field: DepthField| {
            let network = Strands::new(&params, EAST, black_box(&starts), frame.extent(), 1)?.network(&primitives)?;
            let mut dirty = DirtyTiles::new(size);
            for path in network.segments().filter_map(|segment| network.path(segment)) {
                dirty.mark(stamp_path(&mut field, &profile, &path).grow(1, size));
            }
            let mut rects = Vec::new();
            dirty.take_rects(&mut rects);
            // The cracks are at rest: their normals are painted once, blended.
            let changed = if blends { correct_normals(base, &mut field, UVec2::ZERO)? } else { rects.clone() };
            let mut targets = PaintTargets { diffuse: Some(&mut out), normal: None, depth: None };
            paint_rects(base, &field, &look, &rects, UVec2::ZERO, &mut targets);
            let mut targets = PaintTargets { diffuse: None, normal: Some(&mut normals), depth: None };
            paint_rects(base, &field, &look, &changed, UVec2::ZERO, &mut targets);
            Ok::<_, Box<dyn std::error::Error>>(field)
        };
        let name = if blends { "with Poisson blending" } else { "without" };
        group.bench_function(BenchmarkId::new(name, count), |b| {
            // A surface that has been touched before: its memory is there.
            let fresh = || {
                let mut field = DepthField::new(frame);
                field.depth.as_mut_slice().fill(1);
                field.depth.as_mut_slice().fill(0);
                field
            };
            b.iter_batched(fresh, &mut run, BatchSize::PerIteration);
        });
    }
    group.finish();
}

/// The field of every texel, one by one.
fn texel_by_texel(frequency: f64, rotation: f32) -> Grid<[u8; 4]> {
    let perlin = Perlin::new(1);
    let mut picture = Grid::new(UVec2::splat(SIDE), [0; 4]);
    for y in 0..SIDE as usize {
        for (x, out) in picture.row_mut(y).iter_mut().enumerate() {
            let at = [x, y].map(|i| (i as f64 + 0.5) / f64::from(SIDE) * frequency);
            let way = ops::unit(std::f32::consts::PI * rotation * perlin.get(at) as f32);
            let [red, green] = way.to_array().map(|value| (value * 127.5 + 127.5).round() as u8);
            *out = [red, green, 128, 255];
        }
    }
    picture
}

fn pictures(c: &mut Criterion) {
    let mut group = c.benchmark_group("field image at 2048");
    group.sample_size(10);
    group.throughput(Throughput::Elements(u64::from(SIDE) * u64::from(SIDE)));
    let Ok(frame) = SurfaceFrame::new(UVec2::splat(SIDE)) else { return };
    for frequency in [4.0, 16.0] {
        group.bench_function(BenchmarkId::new("texel by texel", frequency), |b| {
            b.iter(|| texel_by_texel(f64::from(frequency), 0.5));
        });
        for (name, directions) in [("linear", EAST), ("radial", Directions::Radial { center: Vec2::splat(0.5) })] {
            let Ok(field) = GuidanceField::new(directions, frequency, 0.5, frame.extent(), 1) else { continue };
            group.bench_function(BenchmarkId::new(name, frequency), |b| b.iter(|| field.picture(frame)));
        }
    }
    group.finish();
}

criterion_group!(benches, strands, all_of_it, pictures);
criterion_main!(benches);
