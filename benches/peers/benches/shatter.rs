//! Lines to finished shard meshes, beside what `bevy_shatter` does for the same shards; flights; grown networks.
//!
//! `cargo bench --manifest-path benches/peers/Cargo.toml`. The scene: a pane cut into the Voronoi cells of a jittered grid. The
//! peer is given its diagram, and triangulates each cell by Delaunay and hashes its edges to find the rim, without the
//! hull for the collider (a third of its time); ours begins with bare lines, and makes 3D meshes with flat sides.

#![expect(clippy::expect_used, clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark")]

use bevy_crack::{
    CrackPreset,
    growth::CrackGrowth,
    math::Rng,
    pattern::CellTracker,
    shatter::{Anchor, Burst, BurstParams, Cuts, MeshFrame, ShardMesh, Shards, ShatterParams, Support, shatter},
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use std::{
    collections::{BTreeSet, HashMap},
    hint::black_box,
    time::Instant,
};
use voronator::{
    VoronoiDiagram,
    delaunator::{Point, triangulate},
};

fn sites(n: usize) -> Vec<(f64, f64)> {
    let side = (n as f64).sqrt().round() as usize;
    let mut rng = Rng::new(3);
    let mut place = |i: usize| (i as f64 + 0.05 + 0.9 * f64::from(rng.unit())) / side as f64;
    (0..side * side).map(|i| (place(i % side), place(i / side))).collect()
}

fn diagram(sites: &[(f64, f64)]) -> VoronoiDiagram<Point> {
    VoronoiDiagram::from_tuple(&(0.0, 0.0), &(1.0, 1.0), sites).expect("the sites are in order")
}

fn theirs(diagram: &VoronoiDiagram<Point>) -> usize {
    let mut rim = 0;
    for cell in diagram.cells() {
        let Some(mesh) = triangulate(cell.points()) else { continue };
        let mut edges = HashMap::<(usize, usize), i32>::new();
        for triangle in mesh.triangles.as_chunks::<3>().0 {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                *edges.entry((a, b)).or_insert(0) += 1;
                *edges.entry((b, a)).or_insert(0) -= 1;
            }
        }
        rim += edges.values().filter(|&&count| count > 0).count();
    }
    rim
}

/// The sides of all cells, each once.
fn lines(diagram: &VoronoiDiagram<Point>) -> Vec<[Vec2; 2]> {
    let place = |point: &Point| Vec2::new(point.x as f32, point.y as f32);
    let mut seen = BTreeSet::new();
    let mut lines = Vec::new();
    for cell in diagram.cells() {
        let points = cell.points();
        for i in 0..points.len() {
            let (a, b) = (place(&points[i]), place(&points[(i + 1) % points.len()]));
            let [x, y] = [a, b].map(|p| p.to_array().map(f32::to_bits));
            if a != b && seen.insert((x.min(y), x.max(y))) {
                lines.push([a, b]);
            }
        }
    }
    lines
}

const EVERYTHING: ShatterParams = ShatterParams { min_area: 0.0, max_shards: 1_000_000, ..ShatterParams::DEFAULT };

fn cut(lines: &[[Vec2; 2]]) -> Shards {
    let mut cuts = Cuts::new(Vec2::ONE).expect("a unit square");
    for line in lines {
        cuts.add_line(line).expect("finite");
    }
    shatter(cuts, &EVERYTHING).expect("valid")
}

fn solid(shards: &Shards, mesh: &mut ShardMesh) -> usize {
    let frame = MeshFrame::new(Vec2::ONE);
    let mut triangles = 0;
    for shard in 0..shards.len() as u32 {
        shards.solid_mesh_into(shard, &frame, 0.02, mesh);
        triangles += black_box(&mesh.indices).len() / 3;
    }
    triangles
}

/// Best of some runs, in microseconds: the machine may pause a run, never speed it up.
fn best<T>(runs: u32, mut work: impl FnMut() -> T) -> f64 {
    let once = |_| {
        let from = Instant::now();
        black_box(work());
        from.elapsed().as_secs_f64() * 1e6
    };
    (0..runs).map(once).fold(f64::INFINITY, f64::min)
}

fn panes(c: &mut Criterion) {
    let mut group = c.benchmark_group("shatter");
    for n in [100, 1_000, 10_000] {
        let sites = sites(n);
        let diagram = diagram(&sites);
        let lines = lines(&diagram);
        let shards = cut(&lines);
        println!("{n}: {} sites, {} lines, {} shards", sites.len(), lines.len(), shards.len());
        assert!(shards.len().abs_diff(sites.len()) < 1 + n / 50, "the same cells");
        group.throughput(Throughput::Elements(shards.len() as u64));
        group.sample_size(20);
        let mut mesh = ShardMesh::default();
        let per_shard = 1.0 / shards.len() as f64;
        let ours = best(30, || solid(&cut(&lines), &mut mesh)) * per_shard;
        let theirs_takes = best(10, || theirs(&diagram)) * per_shard;
        let times = theirs_takes / ours;
        println!("best runs: {ours:.3} us a shard, the way of bevy_shatter {theirs_takes:.3} us: {times:.1} times");
        group.bench_function(BenchmarkId::new("lines to solid meshes", n), |b| {
            b.iter(|| solid(&cut(&lines), &mut mesh))
        });
        group.bench_function(BenchmarkId::new("of that, lines to shards", n), |b| b.iter(|| cut(&lines).len()));
        group.bench_function(BenchmarkId::new("the way of bevy_shatter", n), |b| b.iter(|| theirs(&diagram)));
    }
    group.finish();
}

fn grown(c: &mut Criterion) {
    let mut group = c.benchmark_group("shatter a grown network");
    for name in ["glass", "clay"] {
        let preset = CrackPreset::named(name).expect("it is there");
        let mut growth = CrackGrowth::new(preset.growth, Vec2::ONE, 1).expect("valid");
        growth.hit(Vec2::splat(0.5), 1.0);
        while growth.step().grew() {}
        let network = growth.network();
        for extend_cracks in [false, true] {
            let params = ShatterParams { extend_cracks, ..ShatterParams::DEFAULT };
            let run = || shatter(Cuts::from_network(network).unwrap(), &params).unwrap();
            let what = if extend_cracks { "carried on" } else { "as it is" };
            println!("{name}, {what}: {} nodes, {} shards", network.nodes().len(), run().len());
            group.bench_function(BenchmarkId::new(name, what), |b| b.iter(|| run().len()));
        }
        group.bench_function(BenchmarkId::new(name, "cells"), |b| {
            b.iter(|| CellTracker::new(Vec2::ONE).update(network).len());
        });
    }
    group.finish();
}

fn moving(c: &mut Criterion) {
    let shards = cut(&lines(&diagram(&sites(5_000))));
    let burst = Burst::new(BurstParams::DEFAULT, Vec2::splat(0.5), Vec3::NEG_Z, 1.0, 1).expect("valid");
    let flights: Vec<_> = (0u32..).zip(shards.iter()).map(|(i, shard)| burst.flight(i, shard)).collect();
    let mut group = c.benchmark_group("5,000 shards");
    group.throughput(Throughput::Elements(flights.len() as u64));
    group.bench_function("where they are", |b| {
        b.iter(|| flights.iter().map(|flight| flight.pose(black_box(0.7)).offset).sum::<Vec3>());
    });
    group.bench_function("what falls after a hit", |b| {
        b.iter(|| Support::new(&shards, Anchor::Border).hit(&shards, Vec2::splat(0.5), 0.1).unwrap().hit.len());
    });
    group.finish();
}

criterion_group!(benches, panes, grown, moving);
criterion_main!(benches);
