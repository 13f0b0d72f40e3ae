//! Shards against what they must be: that they tile ([`tiling`]) along the lines that they were cut along ([`lines`]), also where there are
//! many ([`many`]), what is to be known of each and becomes of it ([`pieces`]), and those that are curved ([`shells`]).

mod lines;
mod many;
mod pieces;
mod shells;
mod tiling;

use super::{
    lattice::{orient, ring_area},
    *,
};
use crate::{
    CrackPreset,
    growth::CrackGrowth,
    math::{
        Rng,
        whole::{cross, vector},
    },
    pattern::{CellTracker, Network, random::planar_network},
};
use glam::{Vec2, Vec3};
use std::collections::{BTreeMap, BTreeSet};

const EVERYTHING: ShatterParams = ShatterParams { min_area: 0.0, ..ShatterParams::DEFAULT };

fn twice_area(shards: &Shards, ring: &[u32]) -> i64 {
    ring_area(ring.iter().map(|&corner| shards.places[corner as usize]))
}

/// Directed edges of a ring.
fn edges(ring: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..ring.len()).map(|i| [ring[i], ring[(i + 1) % ring.len()]])
}

/// Every property that makes the shards a tiling of the surface, exactly.
pub(crate) fn check_tiling(shards: &Shards) {
    let [w, h] = shards.lattice.corner.map(i64::from);
    let sum = check_pieces(shards);
    assert_eq!(sum, 2 * w * h, "areas");

    let mut sides: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for shard in 0..shards.len() as u32 {
        for edge in shards.rings_of(shard).flat_map(edges) {
            assert_eq!(sides.insert(edge, shard), None, "an edge twice: overlap");
        }
    }
    let mut border = [0i64; 4];
    let mut shared: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for (&[a, b], &shard) in &sides {
        let (pa, pb) = (shards.places[a as usize], shards.places[b as usize]);
        let way = vector(pa, pb);
        match sides.get(&[b, a]) {
            Some(&other) => {
                assert_ne!(shard, other);
                *shared.entry((shard, other)).or_default() += cross(way, [-way[1], way[0]]) as f64;
            }
            None => border[shards.lattice.side_of(pa, pb).expect("a gap")] += way[0].abs() + way[1].abs(),
        }
    }
    assert_eq!(border, [h, h, w, w], "border");
    for shard in 0..shards.len() as u32 {
        let listed: Vec<u32> = shards.neighbours(shard).iter().map(|neighbour| neighbour.shard).collect();
        let true_ones: Vec<u32> = shared.range((shard, 0)..(shard + 1, 0)).map(|(pair, _)| pair.1).collect();
        assert_eq!(listed, true_ones, "neighbours");
        for neighbour in shards.neighbours(shard) {
            let back = shards.neighbours(neighbour.shard).iter().find(|back| back.shard == shard).unwrap();
            assert!((back.length - neighbour.length).abs() <= 1e-5 * back.length);
        }
    }
}

/// Each shard by itself: triangles fill it, their free edges are its outline. Returns twice the sum of the areas, in places.
fn check_pieces(shards: &Shards) -> i64 {
    let mut sum = 0;
    for shard in 0..shards.len() as u32 {
        let corners = shards.corners(shard);
        let area: i64 = shards.rings_of(shard).map(|ring| twice_area(shards, ring)).sum();
        assert!(area > 0 && twice_area(shards, shards.outline(shard)) > 0);
        assert!(shards.holes(shard).all(|hole| twice_area(shards, hole) < 0));
        sum += area;
        let mut free: BTreeSet<[u32; 2]> = BTreeSet::new();
        let mut filled = 0;
        for triangle in shards.triangles(shard) {
            let triangle = triangle.map(|corner| corners[corner as usize]);
            let part = twice_area(shards, &triangle);
            assert!(part > 0, "a triangle of no area");
            filled += part;
            for [a, b] in edges(&triangle) {
                if !free.remove(&[b, a]) {
                    assert!(free.insert([a, b]), "two triangles on one side of an edge");
                }
            }
        }
        assert_eq!(filled, area, "triangles of shard {shard} with {} corners", corners.len());
        let outline: BTreeSet<[u32; 2]> = shards.rings_of(shard).flat_map(edges).collect();
        assert_eq!(free, outline, "the mesh is torn from its outline");

        let listed = shards.get(shard).unwrap();
        let unit = 1.0 / shards.lattice.scale;
        assert!((f64::from(listed.area) - 0.5 * area as f64 * unit * unit).abs() <= 1e-6 * f64::from(listed.area));
    }
    sum
}

pub(crate) fn check_meshes(shards: &Shards, rng: &mut Rng) {
    let rim = RimLook { width: [0.0, 0.002, 0.02][rng.next_u32() as usize % 3], ..RimLook::STONE };
    let frame = MeshFrame {
        size: Vec2::new(3.0, 2.0),
        uv: [Vec2::new(0.25, 0.5), Vec2::new(0.5, 1.0)],
        centred: rng.next_u32().is_multiple_of(2),
        rim,
        seed: 1,
    };
    for (number, shard) in (0u32..).zip(shards.iter()) {
        let mesh = shards.solid_mesh(number, &frame, 0.1);
        let at = |i: u32| mesh.positions[i as usize].map(f32::to_bits);
        let mut free = BTreeMap::<_, i32>::new();
        let mut volume = 0.0;
        for triangle in mesh.indices.as_chunks::<3>().0 {
            for k in 0..3 {
                let (a, b) = (at(triangle[k]), at(triangle[(k + 1) % 3]));
                *free.entry((a, b)).or_default() += 1;
                *free.entry((b, a)).or_default() -= 1;
            }
            let [a, b, c] = triangle.map(|i| Vec3::from(mesh.positions[i as usize]).as_dvec3());
            let normal = Vec3::from(mesh.normals[triangle[0] as usize]).as_dvec3();
            let face = (b - a).cross(c - a);
            // Splinters may lose their area to the rounding of the mesh's places; rims are rounded at sharp corners.
            let is_outward = face.dot(normal) > -1e-5 || (rim.width > 0.0 && face.z * normal.z > -1e-5);
            assert!((normal.length() - 1.0).abs() < 1e-5 && is_outward, "{face} {normal}");
            volume += a.dot(b.cross(c)) / 6.0;
        }
        assert!(free.values().all(|&count| count == 0), "an open edge");
        let scale = frame.size.as_dvec2() / shards.extent().as_dvec2();
        let expected = f64::from(shard.area) * scale.x * scale.y * 0.1;
        if rim.width == 0.0 {
            assert!((volume - expected).abs() < 1e-4 * expected + 1e-6, "volume {volume}, expected {expected}");
        } else {
            // A bevel takes something off, and never more than its slope all over.
            assert!(
                (0.4 * expected - 1e-6..=expected * 1.0001 + 1e-6).contains(&volume),
                "{volume}, at most {expected}"
            );
        }

        let flat = shards.flat_mesh(number, &frame);
        let middle = if frame.centred { shard.centroid } else { shards.extent() * 0.5 };
        for (pos, uv) in flat.positions.iter().zip(&flat.uvs) {
            let pattern = Vec2::new(pos[0], -pos[1]) * shards.extent() / frame.size + middle;
            let expected = frame.uv[0] + pattern / shards.extent() * (frame.uv[1] - frame.uv[0]);
            assert!((Vec2::from(*uv) - expected).length() < 1e-5);
        }
    }
}

/// Lines all over the place.
fn random_cuts(rng: &mut Rng) -> Cuts {
    let extent = [Vec2::ONE, Vec2::new(4.0 / 3.0, 1.0), Vec2::new(1.0, 7.3)][rng.next_u32() as usize % 3];
    if rng.next_u32().is_multiple_of(3) {
        let nodes = 2 + rng.next_u32() % 40;
        return Cuts::from_network(&planar_network(nodes, Vec2::new(2.0, 1.0), rng)).unwrap();
    }
    let mut cuts = Cuts::new(extent).unwrap();
    // On a coarse grid, lines lie on each other and on the border, and run through corners.
    let grid = [3.0, 8.0, 1e6][rng.next_u32() as usize % 3];
    for _ in 0..rng.next_u32() % 12 {
        let points = 1 + rng.next_u32() % 6;
        let line: Vec<Vec2> = (0..points)
            .map(|_| (Vec2::new(rng.range(-0.1, 1.1), rng.range(-0.1, 1.1)) * grid).round() / grid * extent)
            .collect();
        cuts.add_line(&line).unwrap();
    }
    cuts
}

fn random_params(rng: &mut Rng) -> ShatterParams {
    ShatterParams {
        extend_cracks: rng.next_u32().is_multiple_of(2),
        min_area: [0.0, 2e-5, 0.01][rng.next_u32() as usize % 3],
        max_shards: [10_000, 4][usize::from(rng.unit() < 0.1)],
        seed: u64::from(rng.next_u32()),
    }
}

fn grown(preset: &CrackPreset, hits: u32, seed: u64) -> Network {
    let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::new(1.5, 1.0), seed).unwrap();
    let mut rng = Rng::new(seed);
    for _ in 0..hits {
        growth.hit(Vec2::new(1.5 * rng.unit(), rng.unit()), 1.0);
        while growth.step().grew() {}
    }
    growth.network().clone()
}
