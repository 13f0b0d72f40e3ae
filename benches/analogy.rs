//! Image analogies on one thread: whole surfaces, photographs of several sizes, one more crack on a finished surface;
//! and the plain way, which compares every texel with all of the photograph, on a small picture.
//!
//! `cargo bench --no-default-features --bench analogy`.

use bevy_crack::{
    Grid,
    paint::analogy::{Analogy, AnalogyPair, AnalogyParams, Examples},
    pattern::SurfaceFrame,
    raster::{DepthField, Profile, TexelRect},
    voronoi::{VoronoiBake, VoronoiParams},
};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::UVec2;
use std::{hint::black_box, path::Path, sync::Arc};

/// The paving that ships, repeated or cut to a side.
fn pair(side: u32) -> Option<AnalogyPair> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/analogies");
    let open = |name: &str| image::open(folder.join(name)).map(|picture| picture.to_rgba8());
    let (photo, mask) = (open("paving.png").ok()?, open("paving_mask.png").ok()?);
    let at = |i: u32| (i % side % photo.width(), i / side % photo.height());
    let all = 0..side * side;
    let rgba: Vec<u8> = all.clone().flat_map(|i| photo.get_pixel(at(i).0, at(i).1).0).collect();
    let guide = all.map(|i| f32::from(mask.get_pixel(at(i).0, at(i).1)[0]) / 255.0).collect();
    AnalogyPair::new(UVec2::splat(side), &rgba, Grid::from_vec(UVec2::splat(side), guide)?).ok()
}

/// Seams of a map.
fn pattern(side: u32) -> Option<Grid<u16>> {
    let size = UVec2::splat(side);
    let params = VoronoiParams { sites: (side * side / 4000).max(4), ..VoronoiParams::DEFAULT };
    let (_, seams) = VoronoiBake::new(params, Vec::new(), size, 1).ok()?.finish();
    let mut field = DepthField::new(SurfaceFrame::new(size).ok()?);
    seams.stamp(&mut field, &Profile { full_width: 3.0 / side as f32, ..Profile::DEFAULT });
    Some(field.depth)
}

fn made(examples: &Arc<Examples>, depth: &Grid<u16>) -> Option<Analogy> {
    let mut analogy = Analogy::new(examples.clone(), depth, &[], 1).ok()?;
    analogy.finish();
    Some(analogy)
}

fn surfaces(c: &mut Criterion) {
    let mut group = c.benchmark_group("analogy");
    group.sample_size(10);
    let prepared = |side| Some(Arc::new(Examples::new(&[pair(side)?], &AnalogyParams::DEFAULT).ok()?));
    for side in [100, 200, 400, 1024] {
        let (Some(examples), Some(depth)) = (prepared(384), pattern(side)) else { return };
        group.throughput(Throughput::Elements(u64::from(side * side)));
        group.bench_function(BenchmarkId::new("surface of side", side), |b| {
            b.iter(|| made(&examples, black_box(&depth)));
        });
    }
    for side in [192, 384, 768, 1536] {
        let (Some(examples), Some(depth), Some(pair)) = (prepared(side), pattern(256), pair(side)) else { return };
        group.throughput(Throughput::Elements(256 * 256));
        group.bench_function(BenchmarkId::new("photograph of side", side), |b| {
            b.iter(|| made(&examples, black_box(&depth)));
        });
        group.throughput(Throughput::Elements(u64::from(side * side)));
        group.bench_function(BenchmarkId::new("making ready", side), |b| {
            b.iter(|| Examples::new(black_box(std::slice::from_ref(&pair)), &AnalogyParams::DEFAULT));
        });
    }
    group.finish();
}

fn changes(c: &mut Criterion) {
    let mut group = c.benchmark_group("analogy, 12 texels more");
    group.sample_size(20);
    for side in [256, 1024] {
        let examples = pair(384).and_then(|pair| Examples::new(&[pair], &AnalogyParams::DEFAULT).ok().map(Arc::new));
        let Some(examples) = examples else { return };
        let mut depth = Grid::new(UVec2::splat(side), 0);
        let Some(whole) = made(&examples, &depth) else { return };
        depth.row_mut(100)[100..112].fill(u16::MAX);
        let rect = TexelRect { min: UVec2::splat(100), max: UVec2::new(112, 101) };
        group.bench_function(BenchmarkId::from_parameter(side), |b| {
            b.iter_batched_ref(
                || whole.clone(),
                |wall| {
                    let done = wall.update(&depth, &[rect]);
                    wall.finish();
                    done
                },
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

/// Colours and guide of a picture.
type Picture<'a> = (&'a Grid<[u8; 4]>, &'a Grid<u8>);

/// The squared difference of the 7 x 7 texels around two texels.
fn difference(a: Picture<'_>, [x, y]: [usize; 2], b: Picture<'_>, [u, v]: [usize; 2]) -> u32 {
    let square = |a: u8, b: u8| u32::from(a.abs_diff(b)).pow(2);
    let mut sum = 0;
    for row in 0..7 {
        let (wanted, found) = (&a.0.row(y + row - 3)[x - 3..x + 4], &b.0.row(v + row - 3)[u - 3..u + 4]);
        let colors = wanted.iter().zip(found).flat_map(|(a, b)| (0..3).map(|channel| square(a[channel], b[channel])));
        let (wanted, found) = (&a.1.row(y + row - 3)[x - 3..x + 4], &b.1.row(v + row - 3)[u - 3..u + 4]);
        sum += colors.sum::<u32>() + wanted.iter().zip(found).map(|(a, b)| 9 * square(*a, *b)).sum::<u32>();
    }
    sum
}

/// One pass over 32 x 32 texels at full size: each is compared with all of a photograph of 96 x 96.
fn plain(c: &mut Criterion) {
    let mut group = c.benchmark_group("analogy, plain search");
    group.sample_size(10);
    let (side, photo) = (32_usize, 96_usize);
    let (Some(pair), Some(depth)) = (pair(photo as u32), pattern(side as u32)) else { return };
    let Ok(examples) = Examples::new(std::slice::from_ref(&pair), &AnalogyParams::DEFAULT) else { return };
    let Some(guide) = examples.ramp(0) else { return };
    let examples = Arc::new(examples);
    let Some(start) = made(&examples, &depth) else { return };
    let (colors, ramp) = (start.colors(), start.ramp());
    group.throughput(Throughput::Elements((side * side) as u64));
    group.bench_function("one pass, 32 of 96", |b| {
        b.iter(|| {
            let all = |side: usize| (3..side - 3).flat_map(move |y| (3..side - 3).map(move |x| [x, y]));
            let cost = |at, from| difference((&colors, &ramp), at, (pair.picture(), &guide), from);
            all(side).map(|at| all(photo).map(|from| (cost(at, from), from)).min()).collect::<Vec<_>>()
        });
    });
    group.bench_function("this crate, 32 of 96", |b| b.iter(|| made(&examples, black_box(&depth))));
    group.finish();
}

criterion_group!(benches, surfaces, changes, plain);
criterion_main!(benches);
