//! The room against slow and plain versions of itself.

use super::{
    lattice::{Lattice, Layer, UNIT},
    search::{Packed, Search},
};
use crate::{Grid, math::Rng};
use glam::UVec2;
use std::{cmp::Reverse, collections::BinaryHeap};

/// Dijkstra's method with a heap: cost and site of each texel.
pub(super) fn dijkstra(lattice: &Lattice, sites: &[UVec2]) -> Vec<Option<(u64, u32)>> {
    let (w, n) = (lattice.width(), lattice.width() * lattice.size().y as usize);
    let mut best = vec![None; n];
    let mut heap: BinaryHeap<_> =
        (0u32..).zip(sites).map(|(i, site)| Reverse((0u64, i, site.y as usize * w + site.x as usize))).collect();
    while let Some(Reverse((cost, site, at))) = heap.pop() {
        if best[at].is_some() {
            continue;
        }
        best[at] = Some((cost, site));
        let mut go = |to: usize, edge: u16| {
            if edge != super::lattice::WALL {
                heap.push(Reverse((cost + u64::from(edge), site, to)));
            }
        };
        if at % w + 1 < w {
            go(at + 1, lattice.edges(at).0);
        }
        if !at.is_multiple_of(w) {
            go(at - 1, lattice.edges(at - 1).0);
        }
        if at + w < n {
            go(at + w, lattice.edges(at).1);
        }
        if at >= w {
            go(at - w, lattice.edges(at - w).1);
        }
    }
    best
}

fn unpacked<P: Packed>(search: &Search<P>) -> Vec<Option<(u64, u32)>> {
    search.field().iter().map(|&p| (p < P::FAR).then(|| (p.cost(), p.index()))).collect()
}

fn below(rng: &mut Rng, n: u32) -> u32 {
    ((u64::from(rng.next_u32()) * u64::from(n)) >> 32) as u32
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    White,
    Smooth,
    Flat,
    Maze,
}

fn random_lattice(rng: &mut Rng, size: UVec2, kind: Kind) -> Lattice {
    let n = (size.x * size.y) as usize;
    let mut values = Vec::with_capacity(n);
    for i in 0..n as u32 {
        let (x, y) = (i % size.x, i / size.x);
        values.push(match kind {
            Kind::White => (rng.next_u32() >> 16) as u16,
            Kind::Smooth => (((x / 5) * 977 + (y / 3) * 3571) % 65536) as u16,
            Kind::Flat => 0,
            // Lanes with a gap at alternating ends.
            Kind::Maze => {
                let gap = if (y / 4).is_multiple_of(2) { size.x - 1 } else { 0 };
                if y % 4 == 3 && x != gap { u16::MAX } else { 0 }
            }
        });
    }
    let mut layer = Layer { values: Grid::from_vec(size, values).unwrap(), weight: 0 };
    layer.set_weight(if matches!(kind, Kind::Maze) { 250.0 } else { 1.0 + 60.0 * rng.unit() });
    let mut lattice = Lattice::new(size);
    for y in 0..size.y as usize {
        lattice.set_row(y, std::slice::from_ref(&layer));
    }
    lattice
}

const SIZES: [[u32; 2]; 12] = [
    [1, 1],
    [1, 40],
    [300, 1],
    [2, 2],
    [127, 5],
    [128, 9],
    [129, 33],
    [64, 64],
    [257, 31],
    [400, 100],
    [31, 300],
    [520, 61],
];

#[test]
fn costs_and_regions_equal_dijkstra() {
    let mut rng = Rng::new(5);
    for size in SIZES.map(UVec2::from) {
        for kind in [Kind::White, Kind::Smooth, Kind::Flat, Kind::Maze] {
            for n_sites in [1, 2, 7, 200] {
                let lattice = random_lattice(&mut rng, size, kind);
                let sites: Vec<_> =
                    (0..n_sites).map(|_| UVec2::new(below(&mut rng, size.x), below(&mut rng, size.y))).collect();
                let (mut narrow, mut wide) = (Search::<i32>::new(size), Search::<i64>::new(size));
                for (i, &site) in (0u32..).zip(&sites) {
                    narrow.add_site(site, i);
                    wide.add_site(site, i);
                }
                narrow.finish::<false>(&lattice);
                wide.finish::<false>(&lattice);
                let want = dijkstra(&lattice, &sites);
                assert!(unpacked(&narrow) == want, "{size} {kind:?} {n_sites}");
                assert!(unpacked(&wide) == want, "{size} {kind:?} {n_sites}");
                assert!(want.iter().all(Option::is_some));
            }
        }
    }
}

#[test]
#[ignore = "prints times"]
fn speed() {
    for n in [400u32, 1000, 2048, 4096] {
        let size = UVec2::splat(n);
        let mut rng = Rng::new(1);
        let read = |name: &str| std::fs::read(format!("/tmp/crack_anchors/{name}_{n}.raw")).ok();
        let (Some(noise), Some(drawing), Some(sites)) = (read("noise"), read("drawing"), read("sites")) else {
            continue;
        };
        let noise: Vec<u16> = noise.as_chunks().0.iter().map(|&b| (f32::from_le_bytes(b) * 65535.0) as u16).collect();
        let drawing: Vec<u16> = drawing.iter().map(|&b| u16::from(b) * 65535).collect();
        let sites: Vec<u32> = sites.as_chunks().0.iter().map(|&b| u32::from_le_bytes(b)).collect();
        let layers = [
            Layer { values: Grid::from_vec(size, noise).unwrap(), weight: 6 * UNIT },
            Layer { values: Grid::from_vec(size, drawing).unwrap(), weight: 28 * UNIT },
        ];
        for _ in 0..3 {
            let t = std::time::Instant::now();
            let mut lattice = Lattice::new(size);
            for y in 0..n as usize {
                lattice.set_row(y, &layers);
            }
            let built = t.elapsed();
            let t = std::time::Instant::now();
            let mut search = Search::<i32>::new(size);
            for (i, &site) in (0..).zip(&sites) {
                search.add_site(UVec2::new(site % n, site / n), i);
            }
            search.finish::<false>(&lattice);
            let narrow = t.elapsed();
            let t = std::time::Instant::now();
            let mut search = Search::<i64>::new(size);
            for (i, &site) in (0..).zip(&sites) {
                search.add_site(UVec2::new(site % n, site / n), i);
            }
            search.finish::<false>(&lattice);
            let px = f64::from(n * n);
            println!(
                "{n}: lattice {:.2} ns/px, narrow {:.2} ns/px = {:.2} ms, wide {:.2}",
                built.as_nanos() as f64 / px,
                narrow.as_nanos() as f64 / px,
                narrow.as_secs_f64() * 1e3,
                t.elapsed().as_nanos() as f64 / px
            );
        }
        let _ = rng.unit();
    }
}
