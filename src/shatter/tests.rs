//! Tilings, meshes, support and flights against what they must be.

use super::{
    lattice::{cross, orient, ring_area, vector},
    *,
};
use crate::{
    CrackPreset,
    growth::CrackGrowth,
    math::Rng,
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
fn check_tiling(shards: &Shards) {
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

fn check_meshes(shards: &Shards, rng: &mut Rng) {
    let frame = MeshFrame {
        size: Vec2::new(3.0, 2.0),
        uv: [Vec2::new(0.25, 0.5), Vec2::new(0.5, 1.0)],
        centred: rng.next_u32().is_multiple_of(2),
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
            // Splinters may lose their area to the rounding of the mesh's places.
            assert!((normal.length() - 1.0).abs() < 1e-5 && face.dot(normal) > -1e-5, "{face} {normal}");
            volume += a.dot(b.cross(c)) / 6.0;
        }
        assert!(free.values().all(|&count| count == 0), "an open edge");
        let scale = frame.size.as_dvec2() / shards.extent().as_dvec2();
        let expected = f64::from(shard.area) * scale.x * scale.y * 0.1;
        assert!((volume - expected).abs() < 1e-4 * expected + 1e-6, "volume {volume}, expected {expected}");

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
        carry_on: rng.next_u32().is_multiple_of(2),
        min_area: [0.0, 2e-5, 0.01][rng.next_u32() as usize % 3],
        max_shards: [10_000, 4][usize::from(rng.unit() < 0.1)],
        seed: u64::from(rng.next_u32()),
    }
}

#[test]
fn random_lines_tile() {
    let mut rng = Rng::new(21);
    let (mut shards_in_all, mut holes, mut carried) = (0, 0, 0);
    for i in 0..10_000 {
        let (cuts, params) = (random_cuts(&mut rng), random_params(&mut rng));
        let shards = shatter(cuts.clone(), &params).unwrap();
        check_tiling(&shards);
        assert!(shards.len() <= params.max_shards as usize);
        if shards.len() > 1 {
            assert!(shards.iter().all(|shard| shard.area > 0.999 * params.min_area));
        }
        if i % 20 == 0 {
            check_meshes(&shards, &mut rng);
        }
        shards_in_all += shards.len();
        holes += (0..shards.len() as u32).map(|shard| shards.holes(shard).count()).sum::<usize>();
        carried += shards.carried().len();
    }
    assert!(shards_in_all > 50_000 && holes > 100 && carried > 1000, "{shards_in_all} {holes} {carried}");
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

#[test]
fn presets_tile() {
    for name in CrackPreset::NAMES {
        for seed in 0..4 {
            let network = grown(&CrackPreset::named(name).unwrap(), 1 + seed as u32 % 3, seed);
            let cuts = Cuts::from_network(&network).unwrap();
            for carry_on in [false, true] {
                let shards =
                    shatter(cuts.clone(), &ShatterParams { carry_on, seed, ..ShatterParams::DEFAULT }).unwrap();
                check_tiling(&shards);
                if seed == 0 {
                    check_meshes(&shards, &mut Rng::new(1));
                }
            }
        }
    }
}

/// Half a texel of the largest surface.
#[test]
fn edges_lie_on_drawn_lines() {
    let network = grown(&CrackPreset::GLASS, 2, 5);
    let shards =
        shatter(Cuts::from_network(&network).unwrap(), &ShatterParams { carry_on: true, ..ShatterParams::DEFAULT })
            .unwrap();
    let mut lines: Vec<(Vec2, Vec2)> = network
        .segments()
        .filter_map(|segment| network.path(segment))
        .flat_map(|path| path.points().windows(2).map(|pair| (pair[0].pos, pair[1].pos)).collect::<Vec<_>>())
        .collect();
    lines.extend(shards.carried().iter().flat_map(|line| line.windows(2).map(|pair| (pair[0], pair[1]))));
    let mut checked = 0;
    for shard in 0..shards.len() as u32 {
        for [a, b] in edges(shards.outline(shard)) {
            if shards.lattice.side_of(shards.places[a as usize], shards.places[b as usize]).is_some() {
                continue;
            }
            let middle = 0.5 * (shards.positions()[a as usize] + shards.positions()[b as usize]);
            let nearest = lines
                .iter()
                .filter(|(a, b)| a.min(*b).cmple(middle + 1e-4).all() && a.max(*b).cmpge(middle - 1e-4).all())
                .map(|&(a, b)| shards::distance_to_line(middle, a, b))
                .fold(f32::INFINITY, f32::min);
            assert!(nearest < 0.5 / 16_384.0, "{nearest} at {middle}");
            checked += 1;
        }
    }
    assert!(checked > 200, "{checked}");
}

#[test]
fn degenerate_lines_are_survived() {
    let corner = Vec2::new(1.0, 1.0);
    let cases: [(&str, &[&[Vec2]], usize); 9] = [
        ("nothing", &[], 1),
        ("a point", &[&[Vec2::splat(0.5)], &[Vec2::splat(0.25), Vec2::splat(0.25)]], 1),
        ("along the border", &[&[Vec2::ZERO, Vec2::X, corner]], 1),
        ("off the surface", &[&[Vec2::new(-5.0, -5.0), Vec2::new(9.0, -1.0)]], 1),
        ("a diagonal twice", &[&[Vec2::ZERO, corner], &[corner, Vec2::ZERO]], 2),
        ("a way and back", &[&[Vec2::new(0.5, 0.0), Vec2::new(0.5, 0.9), Vec2::new(0.5, 0.0)]], 1),
        ("zero area", &[&[Vec2::splat(0.2), Vec2::splat(0.4), Vec2::splat(0.3), Vec2::splat(0.2)]], 1),
        (
            "a bow tie",
            &[&[Vec2::splat(0.2), Vec2::splat(0.8), Vec2::new(0.8, 0.2), Vec2::new(0.2, 0.8), Vec2::splat(0.2)]],
            3,
        ),
        (
            "a speck",
            &[&[Vec2::splat(0.5), Vec2::new(0.5 + 1e-7, 0.5), Vec2::new(0.5, 0.5 + 1e-7), Vec2::splat(0.5)]],
            2,
        ),
    ];
    for (name, lines, pieces) in cases {
        let mut cuts = Cuts::new(Vec2::ONE).unwrap();
        for line in lines {
            cuts.add_line(line).unwrap();
        }
        let shards = shatter(cuts.clone(), &EVERYTHING).unwrap();
        check_tiling(&shards);
        assert_eq!(shards.len(), pieces, "{name}");
        let whole =
            shatter(cuts.clone(), &ShatterParams { carry_on: true, max_shards: 1, ..ShatterParams::DEFAULT }).unwrap();
        assert_eq!(whole.len(), 1);
        check_tiling(&whole);
    }
    // One texel, a ribbon, a giant and a dwarf.
    for extent in [Vec2::splat(1e-3), Vec2::new(64.0, 1.0), Vec2::splat(1e30), Vec2::splat(1e-30)] {
        let mut cuts = Cuts::new(extent).unwrap();
        cuts.add_line(&[Vec2::ZERO, extent]).unwrap();
        let shards = shatter(cuts.clone(), &EVERYTHING).unwrap();
        assert_eq!(shards.len(), 2);
        check_pieces_count(&shards);
    }
}

fn check_pieces_count(shards: &Shards) {
    let [w, h] = shards.lattice.corner.map(i64::from);
    let sum: i64 = (0..shards.len() as u32).map(|shard| twice_area(shards, shards.outline(shard))).sum();
    assert_eq!(sum, 2 * w * h);
}

#[test]
fn what_is_not_a_number_is_refused() {
    for extent in [Vec2::ZERO, Vec2::NAN, Vec2::INFINITY, Vec2::new(1.0, -1.0), Vec2::new(1e-9, 1.0)] {
        assert!(matches!(Cuts::new(extent), Err(ShatterError::Extent { .. })));
    }
    let mut cuts = Cuts::new(Vec2::ONE).unwrap();
    assert_eq!(cuts.add_line(&[Vec2::ZERO, Vec2::NAN]), Err(ShatterError::NotFinite { index: 1 }));
    assert_eq!(cuts.add_line(&[Vec2::INFINITY, Vec2::ZERO]), Err(ShatterError::NotFinite { index: 0 }));
    cuts.add_line(&[Vec2::MAX, Vec2::MIN]).unwrap();
    let shards = shatter(cuts.clone(), &EVERYTHING).unwrap();
    check_tiling(&shards);
    for min_area in [f32::NAN, -1.0, f32::INFINITY] {
        assert!(shatter(cuts.clone(), &ShatterParams { min_area, ..EVERYTHING }).is_err());
    }
    assert!(shatter(cuts.clone(), &ShatterParams { max_shards: 0, ..EVERYTHING }).is_err());
    let mut support = Support::new(&shards, Anchor::Border);
    assert!(support.hit(&shards, Vec2::NAN, 0.1).is_err() && support.hit(&shards, Vec2::ONE, f32::NAN).is_err());
    assert!(shards.break_again(0, f32::NAN, 0).is_err() && shards.break_again(77, 0.1, 0).is_err());
    assert!(
        Burst::new(BurstParams { drag: f32::NAN, ..BurstParams::DEFAULT }, Vec2::ZERO, Vec3::ZERO, 1.0, 0).is_err()
    );
    assert!(Burst::new(BurstParams::DEFAULT, Vec2::NAN, Vec3::ZERO, 1.0, 0).is_err());
}

/// Every open end is carried on: nothing that was drawn is left out of the outlines, but for what was too small.
#[test]
fn open_cracks_are_carried_on() {
    let mut cuts = Cuts::new(Vec2::ONE).unwrap();
    cuts.add_line(&[Vec2::new(0.2, 0.5), Vec2::new(0.6, 0.5)]).unwrap();
    assert_eq!(shatter(cuts.clone(), &EVERYTHING).unwrap().len(), 1);
    let shards = shatter(cuts.clone(), &ShatterParams { carry_on: true, ..EVERYTHING }).unwrap();
    assert_eq!((shards.len(), shards.carried().len()), (2, 2));
    check_tiling(&shards);

    let mut rng = Rng::new(22);
    for _ in 0..200 {
        let network = planar_network(30, Vec2::ONE, &mut rng);
        let cuts = Cuts::from_network(&network).unwrap();
        let mut drawing = cuts.drawing.clone();
        drawing.make_planar();
        drawing.carry_on(1);
        let mut degree = vec![0; drawing.places.len()];
        drawing.edges.iter().flatten().for_each(|&end| degree[end as usize] += 1);
        let on_border = |place| drawing.lattice.sides(place).contains(&true);
        for (&place, degree) in drawing.places.iter().zip(degree) {
            assert!(degree != 1 || on_border(place), "the crack at {place:?} ends nowhere");
        }
    }
}

#[test]
fn moments_equal_those_of_the_triangles() {
    let shards = shatter(Cuts::from_network(&grown(&CrackPreset::GLASS, 2, 9)).unwrap(), &EVERYTHING).unwrap();
    for (number, shard) in (0u32..).zip(shards.iter()) {
        let corners = shards.corners(number);
        let (mut area, mut first, mut second) = (0.0, glam::DVec2::ZERO, 0.0);
        for triangle in shards.triangles(number) {
            let [a, b, c] = triangle.map(|i| shards.positions()[corners[i as usize] as usize].as_dvec2());
            let part = 0.5 * (b - a).perp_dot(c - a);
            area += part;
            first += part * (a + b + c) / 3.0;
            // Exact for squares: the mean over the middles of the sides.
            second += part * [a + b, b + c, c + a].map(|sum| (0.5 * sum).length_squared()).iter().sum::<f64>() / 3.0;
        }
        let centroid = first / area;
        second -= area * centroid.length_squared();
        assert!((shard.centroid.as_dvec2() - centroid).length() < 1e-6, "{} {centroid}", shard.centroid);
        assert!(
            (f64::from(shard.second_moment) - second).abs() < 1e-5 * second + 1e-12,
            "{} {second}",
            shard.second_moment
        );
    }
}

#[test]
fn convex_pieces_fill_their_shard() {
    let shards =
        shatter(Cuts::from_network(&grown(&CrackPreset::CLAY, 1, 3)).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let area = |piece: &[Vec2]| -> f64 {
        (0..piece.len()).map(|i| 0.5 * piece[i].as_dvec2().perp_dot(piece[(i + 1) % piece.len()].as_dvec2())).sum()
    };
    let (mut exact_pieces, mut rough_pieces) = (0, 0);
    for (number, shard) in (0u32..).zip(shards.iter()) {
        let exact = shards.convex_pieces(number, 0.0);
        let rough = shards.convex_pieces(number, 0.004);
        for pieces in [&exact, &rough] {
            for piece in pieces {
                let n = piece.len();
                for i in 0..n {
                    let (a, b, c) = (piece[i], piece[(i + 1) % n], piece[(i + 2) % n]);
                    assert!((b - a).as_dvec2().perp_dot((c - b).as_dvec2()) > -1e-9, "a hollow corner");
                }
            }
        }
        let whole: f64 = exact.iter().map(|piece| area(piece)).sum();
        assert!((whole - f64::from(shard.area)).abs() < 1e-6, "{whole} {}", shard.area);
        let around: f32 = shards.neighbours(number).iter().map(|neighbour| neighbour.length).sum::<f32>()
            + shard.border.iter().sum::<f32>();
        let strayed: f64 = rough.iter().map(|piece| area(piece)).sum();
        assert!((strayed - f64::from(shard.area)).abs() < 0.004 * f64::from(around), "{strayed} {}", shard.area);
        exact_pieces += exact.len();
        rough_pieces += rough.len();
    }
    assert!(2 * rough_pieces < exact_pieces, "{rough_pieces} of {exact_pieces}");
    assert!(shards.convex_pieces(u32::MAX, 0.1).is_empty());
}

#[test]
fn the_shard_at_a_place_is_the_only_one() {
    let mut rng = Rng::new(23);
    for _ in 0..100 {
        let shards = shatter(random_cuts(&mut rng), &EVERYTHING).unwrap();
        for _ in 0..20 {
            let place = Vec2::new(rng.unit(), rng.unit()) * shards.extent();
            let around: Vec<u32> = (0..shards.len() as u32).filter(|&shard| shards.contains(shard, place)).collect();
            assert_eq!(around.len(), 1);
            assert_eq!(shards.at(place), Some(around[0]));
            assert_eq!(shards.distance(around[0], place), 0.0);
        }
        for shard in 0..shards.len() as u32 {
            // A splinter may be thinner than single precision can tell.
            assert!(shards.contains_place(shard, shards.inner_place(shard).unwrap()));
        }
        assert_eq!(shards.at(Vec2::splat(-0.1)), None);
        assert!(shards.at(shards.extent()).is_some() && shards.at(Vec2::NAN).is_none());
    }
}

/// Two ways to the same cells: found one by one as they close, and all at once.
#[test]
fn shards_are_the_closed_cells() {
    let mut rng = Rng::new(27);
    for _ in 0..300 {
        let network = planar_network(60, Vec2::new(2.0, 1.0), &mut rng);
        let mut tracker = CellTracker::new(network.extent());
        tracker.update(&network);
        let mut cuts = Cuts::new(network.extent()).unwrap();
        for segment in network.segments() {
            let (a, b) = network.ends(segment).unwrap();
            cuts.add_line(&[a, b].map(|node| network.nodes()[node as usize].pos)).unwrap();
        }
        let shards = shatter(cuts, &EVERYTHING).unwrap();
        assert_eq!(shards.len(), tracker.cells().len());
        let mut areas = [
            tracker.cells().iter().map(|cell| cell.area).collect::<Vec<f32>>(),
            shards.iter().map(|shard| shard.area).collect(),
        ];
        areas.iter_mut().for_each(|areas| areas.sort_by(f32::total_cmp));
        assert!(areas[0].iter().zip(&areas[1]).all(|(a, b)| (a - b).abs() < 1e-6));
        for number in 0..shards.len() as u32 {
            let cell = tracker.cell_at(shards.inner_point(number).unwrap()).unwrap();
            let centre = tracker.cells()[cell as usize].centroid;
            assert!(centre.distance(shards.get(number).unwrap().centroid) < 1e-4);
        }
    }
}

#[test]
fn what_no_anchor_holds_falls() {
    let mut rng = Rng::new(24);
    let mut fell = 0;
    for _ in 0..300 {
        let network = planar_network(60, Vec2::ONE, &mut rng);
        let params = ShatterParams { carry_on: true, ..ShatterParams::DEFAULT };
        let shards = shatter(Cuts::from_network(&network).unwrap(), &params).unwrap();
        let sides = [0; 4].map(|_| rng.unit() < 0.4);
        let mut support = Support::new(&shards, Anchor::Sides(sides));
        let held = |shard: u32| (0..4).any(|side| sides[side] && shards.get(shard).unwrap().border[side] > 0.0);
        for _ in 0..5 {
            let before = support.clone();
            let (at, reach) = (Vec2::new(rng.unit(), rng.unit()), 0.2 * rng.unit());
            let Fallen { hit, loose } = support.hit(&shards, at, reach).unwrap();
            for shard in 0..shards.len() as u32 {
                let distance = shards.distance(shard, at);
                let in_reach = distance <= if held(shard) { 0.0 } else { reach };
                assert_eq!(hit.contains(&shard), before.is_there(shard) && in_reach);
            }
            // By spreading until nothing changes.
            let there = |shard: u32| before.is_there(shard) && !hit.contains(&shard);
            let mut stays: Vec<bool> = (0..shards.len() as u32).map(|shard| there(shard) && held(shard)).collect();
            for _ in 0..shards.len() {
                for shard in 0..shards.len() as u32 {
                    let touches = shards.neighbours(shard).iter().any(|neighbour| stays[neighbour.shard as usize]);
                    stays[shard as usize] |= there(shard) && touches;
                }
            }
            for shard in 0..shards.len() as u32 {
                let falls = sides.contains(&true) && there(shard) && !stays[shard as usize];
                assert_eq!(loose.contains(&shard), falls);
                assert_eq!(support.is_there(shard), there(shard) && !falls);
            }
            fell += loose.len();
        }
        support.restore();
        assert_eq!(support, Support::new(&shards, Anchor::Sides(sides)));
    }
    assert!(fell > 100, "{fell}");
}

/// A second set of cracks runs through what is left; the hole stays.
#[test]
fn a_hole_stays_when_the_rest_cracks_further() {
    let mut rng = Rng::new(25);
    for _ in 0..100 {
        let mut cuts = random_cuts(&mut rng);
        let old = shatter(cuts.clone(), &EVERYTHING).unwrap();
        let mut support = Support::new(&old, Anchor::Nothing);
        let extent = old.extent();
        support.hit(&old, extent * 0.5, 0.2).unwrap();
        let hole: f32 = support.gone().map(|shard| old.get(shard).unwrap().area).sum();
        for _ in 0..5 {
            cuts.add_line(&[0, 1].map(|_| Vec2::new(rng.unit(), rng.unit()) * extent)).unwrap();
        }
        let new = shatter(cuts.clone(), &EVERYTHING).unwrap();
        let renewed = support.renewed(&old, &new, Anchor::Nothing);
        let after: f32 = renewed.gone().map(|shard| new.get(shard).unwrap().area).sum();
        assert!((after - hole).abs() < 1e-5 * extent.element_product(), "{hole} {after}");
    }
}

#[test]
fn pieces_break_again_by_size() {
    let shards =
        shatter(Cuts::from_network(&grown(&CrackPreset::CLAY, 2, 1)).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let classes = SizeClasses::DEFAULT;
    assert_eq!([1e-4, 0.002, 0.01, 0.5].map(|area| classes.class(area)), [0, 1, 2, 3]);
    let mut broken = 0;
    for (number, shard) in (0u32..).zip(shards.iter()) {
        let Some(largest) = classes.next(shard.area) else { continue };
        let pieces = shards.break_again(number, largest, 4).unwrap();
        assert_eq!(pieces, shards.break_again(number, largest, 4).unwrap());
        assert!(pieces.len() > 1);
        check_pieces(&pieces);
        let sum: f32 = pieces.iter().map(|piece| piece.area).sum();
        assert!((sum - shard.area).abs() < 1e-5 * shard.area + 1e-7, "{sum} {}", shard.area);
        for (i, piece) in (0u32..).zip(pieces.iter()) {
            assert!(piece.area <= largest && classes.class(piece.area) < classes.class(shard.area));
            assert!(shards.contains(number, pieces.inner_point(i).unwrap()));
        }
        broken += pieces.len();
    }
    assert!(broken > 20, "{broken}");
}

/// The flight solves `v' = g - drag v`, whatever the drag, and does not depend on how its time came about.
#[test]
fn flights_obey_their_forces() {
    let shards =
        shatter(Cuts::from_network(&grown(&CrackPreset::GLASS, 1, 2)).unwrap(), &ShatterParams::DEFAULT).unwrap();
    for drag in [0.0, 0.0009, 0.0011, 0.5, 20.0] {
        let params = BurstParams { drag, ..BurstParams::DEFAULT };
        let burst = Burst::new(params, Vec2::new(0.7, 0.5), Vec3::new(0.3, 0.0, -1.0), 2.0, 8).unwrap();
        for (number, shard) in (0u32..).zip(shards.iter()).take(40) {
            for flight in [burst.flight(number, shard), burst.fall(number, shard)] {
                assert_eq!(flight.pose(flight.delay), Pose::AT_REST);
                assert_eq!(flight.pose(flight.end() + 1.0).opacity, 0.0);
                // Fourth-order steps of the equation of motion.
                let force = |velocity: glam::DVec3| params.gravity.extend(0.0).as_dvec3() - f64::from(drag) * velocity;
                let (mut offset, mut velocity, step) = (glam::DVec3::ZERO, flight.velocity.as_dvec3(), 0.002);
                for k in 1..=500 {
                    let k1 = force(velocity);
                    let k2 = force(velocity + 0.5 * step * k1);
                    let k3 = force(velocity + 0.5 * step * k2);
                    let k4 = force(velocity + step * k3);
                    offset += step * (velocity + step / 6.0 * (k1 + k2 + k3));
                    velocity += step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                    if k % 100 == 0 {
                        let pose = flight.pose(flight.delay + (f64::from(k) * step) as f32);
                        let error = (pose.offset.as_dvec3() - offset).length();
                        assert!(error < 1e-3 * (1.0 + offset.length()), "{error} at {k} with drag {drag}");
                        assert!(pose.rotation.is_normalized() && (0.0..=1.0).contains(&pose.opacity));
                    }
                }
            }
        }
    }
}

#[test]
fn pieces_near_the_hit_leave_first_and_fastest() {
    let mut cuts = Cuts::new(Vec2::ONE).unwrap();
    for i in 1..8 {
        let x = i as f32 / 8.0;
        cuts.add_line(&[Vec2::new(x, 0.0), Vec2::new(x, 1.0)]).unwrap();
    }
    let shards = shatter(cuts.clone(), &EVERYTHING).unwrap();
    let params = BurstParams { scatter: 0.0, ..BurstParams::DEFAULT };
    let burst = Burst::new(params, Vec2::new(0.0, 0.5), Vec3::ZERO, 1.0, 0).unwrap();
    let mut flights: Vec<(f32, Flight)> =
        (0u32..).zip(shards.iter()).map(|(i, shard)| (shard.centroid.x, burst.flight(i, shard))).collect();
    flights.sort_by(|a, b| a.0.total_cmp(&b.0));
    for pair in flights.windows(2) {
        assert!(pair[0].1.delay < pair[1].1.delay);
    }
    assert!(flights[0].1.velocity.length() > 2.0 * flights[7].1.velocity.length());
}

/// Frozen: what a player has seen break must break the same way after an update.
#[test]
fn shards_are_the_same_every_time() {
    let network = grown(&CrackPreset::GLASS, 2, 1);
    let params = ShatterParams { carry_on: true, ..ShatterParams::DEFAULT };
    let once = shatter(Cuts::from_network(&network).unwrap(), &params).unwrap();
    let again = shatter(Cuts::from_network(&network).unwrap(), &params).unwrap();
    assert_eq!(once, again);
    assert!(once.len() > 4, "{}", once.len());
}

#[test]
fn crossings_are_cut_where_they_are() {
    let mut rng = Rng::new(26);
    for _ in 0..1000 {
        let mut cuts = random_cuts(&mut rng);
        cuts.drawing.make_planar();
        let edges: Vec<_> =
            cuts.drawing.edges.iter().map(|edge| edge.map(|v| cuts.drawing.places[v as usize])).collect();
        for (i, &[a, b]) in edges.iter().enumerate() {
            for &[c, d] in &edges[i + 1..] {
                let sides = [orient(a, b, c), orient(a, b, d), orient(c, d, a), orient(c, d, b)].map(i64::signum);
                assert!(sides[0] * sides[1] >= 0 || sides[2] * sides[3] >= 0, "{a:?} {b:?} cross {c:?} {d:?}");
                assert!(a != b && [a, b] != [c, d] && [a, b] != [d, c]);
            }
        }
    }
}
