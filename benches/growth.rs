//! Growth to exhaustion, beside the usual way: a k-d tree over the nodes, rebuilt at every step and asked by every marker.
//!
//! `cargo bench --no-default-features --bench growth`. The scene: random markers 11.76 px apart on average, reach 30 px,
//! segments and kill distance 5 px, one start for 1500 markers. Then each preset with six hits, alone (`-- presets`).

#![expect(clippy::print_stdout, clippy::expect_used, reason = "a benchmark")]

use bevy_crack::{
    CrackPreset,
    growth::{CrackGrowth, GrowthParams, MarkerLayout, StartLayout},
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::{
    num::NonZero,
    time::{Duration, Instant},
};

const SPACING: f32 = 11.76;

fn params(markers: u32) -> GrowthParams {
    let lines = (markers as f32).sqrt() as u32;
    let side = SPACING * (markers as f32).sqrt();
    GrowthParams {
        kill_distance: 5.0 / side,
        step_length: 5.0 / side,
        crack_radius: 30.0 / side,
        num_iterations: 100_000,
        num_lines_grid: lines,
        num_columns_grid: lines,
        markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 1.0 },
        reach: 1.0,
        starts: StartLayout::Points { count: (markers / 1500).max(1) },
        line_width: 0.0005,
        max_nodes: 1_000_000,
        ..GrowthParams::DEFAULT
    }
}

const HIT: ([f32; 2], f32) = ([0.5, 0.5], 1.0);

fn surface(markers: u32) -> CrackGrowth {
    CrackGrowth::new(params(markers), [1.0, 1.0].into(), 1).expect("the scene is valid")
}

fn ours(markers: u32) -> usize {
    let mut growth = surface(markers);
    growth.hit(HIT.0.into(), HIT.1);
    while growth.step().grew() {}
    growth.network().nodes().len()
}

/// Each step: index all nodes, ask for every marker, grow.
fn rebuilt(markers: u32) -> usize {
    let p = params(markers);
    let lines = p.num_lines_grid;
    let mut random = 1u64;
    let mut unit = move || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 40) as f32 / (1u32 << 24) as f32
    };
    let cell = 1.0 / lines as f32;
    let mut alive: Vec<[f32; 2]> = (0..lines * lines)
        .map(|i| [((i % lines) as f32 + unit()) * cell, ((i / lines) as f32 + unit()) * cell])
        .collect();
    let mut nodes: Vec<[f32; 2]> = (0..(markers / 1500).max(1)).map(|_| [unit(), unit()]).collect();
    nodes[0] = [0.5, 0.5];
    let (mut pull, mut still) = (Vec::<([f32; 2], bool)>::new(), 0);
    while !alive.is_empty() && still < 40 {
        let tree: ImmutableKdTree<f32, 2> = ImmutableKdTree::new_from_slice(&nodes);
        pull.clear();
        pull.resize(nodes.len(), ([0.0; 2], false));
        let before = alive.len();
        alive.retain(|marker| {
            let found = tree.nearest_n_within::<SquaredEuclidean>(
                marker,
                p.crack_radius * p.crack_radius,
                NonZero::<usize>::MIN,
                true,
            );
            let Some(nearest) = found.first() else { return true };
            if nearest.distance <= p.kill_distance * p.kill_distance {
                return false;
            }
            let (node, scale) = (nodes[nearest.item as usize], 1.0 / nearest.distance.sqrt());
            let (sum, any) = &mut pull[nearest.item as usize];
            *sum = [sum[0] + (marker[0] - node[0]) * scale, sum[1] + (marker[1] - node[1]) * scale];
            *any = true;
            true
        });
        still = if alive.len() == before { still + 1 } else { 0 };
        let grown = nodes.len();
        for i in 0..grown {
            let ([x, y], any) = pull[i];
            if any {
                let scale = p.step_length / (x * x + y * y).sqrt().max(1e-9);
                // The tree takes no more than a bucket of equal coordinates: a little noise, as the peers add.
                let noise = [1e-4 * (unit() - 0.5), 1e-4 * (unit() - 0.5)];
                nodes.push([nodes[i][0] + x * scale + noise[0], nodes[i][1] + y * scale + noise[1]]);
            }
        }
        if nodes.len() == grown {
            break;
        }
    }
    nodes.len()
}

/// Steps until nothing grows, and calls `each` with every one.
fn grow(growth: &mut CrackGrowth, mut each: impl FnMut(Duration)) {
    loop {
        let from = Instant::now();
        let grew = growth.step().grew();
        each(from.elapsed());
        if !grew {
            break;
        }
    }
}

/// The longest of all steps of a surface that gets these hits, in milliseconds; each step at its best of ten runs (the
/// machine may pause one, never speed it up).
fn worst_step(start: impl Fn() -> CrackGrowth, hits: &[([f32; 2], f32)]) -> f64 {
    let mut steps = Vec::<Duration>::new();
    for _ in 0..10 {
        let (mut growth, mut step) = (start(), 0);
        for &(pos, energy) in hits {
            growth.hit(pos.into(), energy);
            grow(&mut growth, |time| {
                match steps.get_mut(step) {
                    Some(least) => *least = time.min(*least),
                    None => steps.push(time),
                }
                step += 1;
            });
        }
    }
    steps.iter().max().map_or(0.0, Duration::as_secs_f64) * 1e3
}

/// Where the presets are hit, and how hard.
const HITS: [([f32; 2], f32); 6] = [
    ([0.3, 0.4], 1.0),
    ([0.7, 0.55], 2.0),
    ([0.45, 0.8], 0.5),
    ([0.8, 0.2], 3.0),
    ([0.15, 0.75], 1.0),
    ([0.5, 0.5], 2.0),
];

/// Six hits on each preset, one after the other.
fn presets(c: &mut Criterion) {
    let mut group = c.benchmark_group("growth of presets");
    group.sample_size(10);
    for name in CrackPreset::NAMES {
        let params = CrackPreset::named(name).expect("it is a preset").growth;
        let start = || CrackGrowth::new(params.clone(), [1.0, 1.0].into(), 1).expect("presets are valid");
        println!("{name}: worst step {:.3} ms", worst_step(start, &HITS));
        group.bench_function(name, |b| {
            b.iter(|| {
                let mut growth = start();
                for (pos, energy) in HITS {
                    growth.hit(pos.into(), energy);
                    grow(&mut growth, |_| {});
                }
                growth.network().nodes().len()
            });
        });
    }
    group.finish();
}

fn growth(c: &mut Criterion) {
    let mut group = c.benchmark_group("growth");
    for markers in [400u32, 2_500, 10_000, 100_000] {
        let nodes = ours(markers);
        println!("{markers} markers: {nodes} nodes, worst step {:.3} ms", worst_step(|| surface(markers), &[HIT]));
        group.throughput(Throughput::Elements(nodes as u64));
        group.sample_size(10);
        group.bench_with_input(BenchmarkId::new("ours", markers), &markers, |b, &m| b.iter(|| ours(m)));
        group.bench_with_input(BenchmarkId::new("kd-tree per step", markers), &markers, |b, &m| b.iter(|| rebuilt(m)));
    }
    group.finish();
}

criterion_group!(benches, growth, presets);
criterion_main!(benches);
