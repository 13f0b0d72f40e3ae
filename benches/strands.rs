//! Strands on one thread at 2048 x 2048: one and ten, from the field to stamped cracks, and a whole field image beside
//! the plain way in the same run.
//!
//! `cargo bench --no-default-features --bench strands`.

use bevy_crack::{
    Grid,
    math::{Rng, ops},
    pattern::SurfaceFrame,
    raster::{DepthField, Profile, stamp_path},
    strands::{Directions, GuidanceField, Material, StrandParams, StrandStart, Strands},
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
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

criterion_group!(benches, strands, pictures);
criterion_main!(benches);
