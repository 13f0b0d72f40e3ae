//! Maps of cracks, on one thread, beside the usual way (a binary heap) in the same run.
//!
//! `cargo bench --no-default-features --bench voronoi`. The scene: 175 sites anywhere, smooth noise, a drawing of bars
//! and rings.

use bevy_crack::{
    Grid,
    pattern::SurfaceFrame,
    raster::{DepthField, Profile, crack_distance},
    voronoi::{Guide, SiteLayout, VoronoiBake, VoronoiMap, VoronoiParams, voronoi_map},
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{UVec2, Vec2};
use std::{cmp::Reverse, collections::BinaryHeap, hint::black_box, ops::ControlFlow};

/// Bars and rings, about a fifth of the surface; `part` of its width is drawn on.
fn drawing(side: u32, part: f32) -> Grid<f32> {
    let mut grid = Grid::new(UVec2::splat(side), 0.0);
    let scale = side as f32;
    for y in 0..side {
        for x in 0..side {
            let at = Vec2::new(x as f32, y as f32) / scale;
            let ring = (at.distance(Vec2::splat(0.5)) * 8.0).fract() < 0.18;
            let bar = ((at.x + at.y) * 5.0).fract() < 0.06;
            grid.row_mut(y as usize)[x as usize] = if at.x < part && (ring || bar) { 1.0 } else { 0.0 };
        }
    }
    grid
}

fn all(params: &VoronoiParams, guides: &[Guide], side: u32) -> Option<VoronoiMap> {
    voronoi_map(params, guides, UVec2::splat(side), 1, |_| ControlFlow::Continue(())).ok()
}

/// Dijkstra's method with a heap over the map's own edges.
fn heap(map: &VoronoiMap) -> Vec<(u64, u32)> {
    let size = map.frame().size();
    let (w, n) = (size.x as usize, (size.x * size.y) as usize);
    let mut best = vec![(u64::MAX, u32::MAX); n];
    let mut heap: BinaryHeap<_> = BinaryHeap::new();
    for (i, site) in (0u32..).zip(map.sites()) {
        let at = (site.y * size.x + site.x) as usize;
        if (0, i) < best[at] {
            best[at] = (0, i);
            heap.push(Reverse((0, i, at as u32)));
        }
    }
    while let Some(Reverse((cost, site, at))) = heap.pop() {
        let at = at as usize;
        if (cost, site) > best[at] {
            continue;
        }
        let mut go = |to: usize, edge: Option<u16>| {
            let next = (cost + u64::from(edge.unwrap_or(u16::MAX)), site);
            if next < best[to] {
                best[to] = next;
                heap.push(Reverse((next.0, site, to as u32)));
            }
        };
        let edge = |i: usize| map.edges((i % w) as u32, (i / w) as u32);
        if at % w + 1 < w {
            go(at + 1, edge(at).0);
        }
        if !at.is_multiple_of(w) {
            go(at - 1, edge(at - 1).0);
        }
        if at + w < n {
            go(at + w, edge(at).1);
        }
        if at >= w {
            go(at - w, edge(at - w).1);
        }
    }
    best
}

fn maps(c: &mut Criterion) {
    let mut group = c.benchmark_group("map");
    group.sample_size(10);
    for side in [400, 1000, 2048, 4096] {
        group.throughput(Throughput::Elements(u64::from(side) * u64::from(side)));
        let guides = [Guide::new(drawing(side, 1.0))];
        let params = VoronoiParams::DEFAULT;
        let Some(map) = all(&params, &guides, side) else { continue };
        let want = heap(&map);
        let same = (0..side * side).all(|i| {
            let (x, y) = (i % side, i / side);
            (map.cost(x, y), map.region(x, y)) == (Some(want[i as usize].0), Some(want[i as usize].1))
        });
        assert!(same, "the map of {side} texels a side is not that of the heap");
        group.bench_function(BenchmarkId::new("paths alone", side), |b| {
            let mut map = map.clone();
            b.iter(|| map.search_again());
        });
        if side <= 2048 {
            group.bench_function(BenchmarkId::new("binary heap", side), |b| b.iter(|| heap(black_box(&map))));
        }
        group.bench_function(BenchmarkId::new("from noise to map", side), |b| {
            b.iter(|| all(&params, &guides, side));
        });
        group.bench_function(BenchmarkId::new("seams", side), |b| b.iter(|| map.seams()));
    }
}

/// A step of an animation: the weight of a guide that is drawn on a tenth of the surface, or on all of it.
fn steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("gamma step");
    group.sample_size(10);
    for side in [400, 1000, 2048] {
        for (name, part) in [("a tenth", 0.1), ("all", 1.0)] {
            let guides = [Guide::new(drawing(side, part))];
            let Some(mut map) = all(&VoronoiParams::DEFAULT, &guides, side) else { continue };
            let mut gamma = 0.0;
            group.bench_function(BenchmarkId::new(name, side), |b| {
                b.iter(|| {
                    gamma = if gamma >= 28.0 { 1.0 } else { gamma + 1.0 };
                    map.set_gammas(&[gamma])
                });
            });
        }
    }
}

/// Sites in pairs: trial maps on a small lattice, then the map.
fn stroke_pairs(c: &mut Criterion) {
    let mut group = c.benchmark_group("stroke pairs");
    group.sample_size(10);
    for side in [400, 2048] {
        let guides = vec![Guide::new(drawing(side, 1.0))];
        let params = VoronoiParams { layout: SiteLayout::StrokePairs, ..VoronoiParams::DEFAULT };
        group.bench_function(BenchmarkId::from_parameter(side), |b| b.iter(|| all(&params, &guides, side)));
    }
}

/// Distance to the nearest crack within 16 texels.
fn distance(c: &mut Criterion) {
    let mut group = c.benchmark_group("distance within 16");
    for side in [1000, 2048] {
        let size = UVec2::splat(side);
        let Ok(bake) = VoronoiBake::new(VoronoiParams::DEFAULT, Vec::new(), size, 1) else { continue };
        let Ok(frame) = SurfaceFrame::new(size) else { continue };
        let mut field = DepthField::new(frame);
        bake.finish().1.stamp_share(&mut field, &Profile { faintest: 1.0, ..Profile::DEFAULT }, 0.3);
        group.throughput(Throughput::Elements(u64::from(side) * u64::from(side)));
        group.bench_function(BenchmarkId::from_parameter(side), |b| {
            b.iter(|| crack_distance(black_box(&field), 10_000, 16));
        });
    }
}

criterion_group!(benches, maps, steps, stroke_pairs, distance);
criterion_main!(benches);
