//! The room against slow and plain versions of itself.

mod charts;
mod seams;

use super::{
    BakeStatus, FONT, Guide, Seams, SiteLayout, VoronoiBake, VoronoiError, VoronoiMap, VoronoiParams, draw_text,
    lattice::{Lattice, Layer, WALL},
    resample::Resampler,
    search::{Packed, Search},
    voronoi_map,
};
use crate::{Grid, math::Rng};
use glam::{UVec2, Vec2};
use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap},
    ops::ControlFlow,
};

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
            if edge != WALL {
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
        for link in lattice.links() {
            let [a, b] = link.ends.map(|end| end as usize);
            if a == at {
                go(b, link.cost);
            }
            if b == at {
                go(a, link.cost);
            }
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
    let mut layer = Layer::new(Grid::from_vec(size, values).unwrap());
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

/// A drawing: bars, a ring and noise, of a size of its own.
fn drawing(rng: &mut Rng, size: UVec2) -> Grid<f32> {
    let mut grid = Grid::new(size, 0.0);
    let scale = size.min_element() as f32;
    let (centre, radius) = (size.as_vec2() * Vec2::new(rng.range(0.3, 0.7), 0.5), scale * rng.range(0.15, 0.3));
    let (row, column) = (rng.range(0.2, 0.4) * scale, rng.range(0.6, 0.8) * scale);
    for y in 0..size.y {
        for x in 0..size.x {
            let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let thick = 0.04 * scale;
            let ring = (at.distance(centre) - radius).abs() < thick;
            let bars = (at.y - row).abs() < thick || (at.x - column).abs() < thick && at.y > row;
            grid.row_mut(y as usize)[x as usize] = if ring || bars { 1.0 } else { 0.0 };
        }
    }
    grid
}

fn made(params: &VoronoiParams, guides: &[Guide], size: [u32; 2], seed: u64) -> (VoronoiMap, Seams) {
    VoronoiBake::new(params.clone(), guides.to_vec(), size.into(), seed).unwrap().finish()
}

/// Cost and region of every texel of the finest level.
fn values(map: &VoronoiMap) -> Vec<Option<(u64, u32)>> {
    let size = map.frame().size();
    let at = |i: u32| (i % size.x, i / size.x);
    (0..size.x * size.y).map(at).map(|(x, y)| Some((map.cost(x, y)?, map.region(x, y)?))).collect()
}

#[test]
fn costs_beyond_the_narrow_numbers_equal_dijkstra() {
    let params = VoronoiParams { alpha: 100.0, sites: 2, ..VoronoiParams::DEFAULT };
    let (map, _) = made(&params, &[], [2000, 2], 3);
    let lattice = map.lattice(0);
    let want = dijkstra(lattice, map.sites());
    assert!(want.iter().flatten().any(|(cost, _)| *cost > 32_000 * 256), "the test asks for too little");
    assert!(values(&map) == want);
}

#[test]
fn more_than_256_sites_equal_dijkstra() {
    let params = VoronoiParams { sites: 700, ..VoronoiParams::DEFAULT };
    let (map, _) = made(&params, &[], [150, 110], 3);
    assert!(values(&map) == dijkstra(map.lattice(0), map.sites()));
}

#[test]
fn levels_divide_the_regions_of_the_level_before() {
    let mut rng = Rng::new(8);
    for seed in 0..4 {
        let guide = Guide::new(drawing(&mut rng, UVec2::new(80, 60)));
        let params = VoronoiParams { levels: 3, stroke_width: 0.0, layout: SiteLayout::Even, ..VoronoiParams::DEFAULT };
        let (map, seams) = made(&params, &[guide], [131, 97], seed);
        let mut coarse: Option<Vec<u32>> = None;
        for (i, n) in [(0, 10), (1, 43), (2, 175)] {
            let want = dijkstra(map.lattice(i), &map.sites()[..n]);
            let regions: Vec<u32> = want.iter().map(|at| at.unwrap().1).collect();
            if let Some(coarse) = coarse {
                let mut parents = BTreeMap::new();
                for (fine, coarse) in regions.iter().zip(coarse) {
                    assert_eq!(*parents.entry(*fine).or_insert(coarse), coarse, "region {fine} lies in two");
                }
            }
            coarse = Some(regions);
            if i == 2 {
                assert!(values(&map) == want);
            }
        }
        let widest = |level: u32| {
            let points = seams.seams.iter().filter(|seam| seam.level == level).flat_map(|seam| &seam.points);
            let widths: Vec<f32> = points.map(|point| point.width).collect();
            assert!(!widths.is_empty());
            widths.iter().sum::<f32>() / widths.len() as f32
        };
        assert!(widest(0) > widest(1) && widest(1) > widest(2), "older cracks are wider");
    }
}

#[test]
fn changed_weights_give_the_map_that_a_new_one_has() {
    let mut rng = Rng::new(21);
    // Drawings that change most of the edges, and one that changes a few.
    for (n, size) in [[97, 61], [300, 140], [1, 200], [260, 3], [301, 139]].into_iter().enumerate() {
        for levels in [1, 3] {
            let mut images = [0, 1].map(|_| drawing(&mut rng, UVec2::new(90, 70)));
            if n == 4 {
                let beside = |image: &mut Grid<f32>| (0..70).for_each(|y| image.row_mut(y)[..75].fill(0.0));
                images.iter_mut().for_each(beside);
            }
            let guides = |gammas: [f32; 2]| [0, 1].map(|i| Guide { image: images[i].clone(), gamma: gammas[i] });
            let params = VoronoiParams { sites: 60, levels, ..VoronoiParams::DEFAULT };
            let mut map = made(&params, &guides([0.0, 28.0]), size, n as u64).0;
            // Up, down, both, back and forth by large and small steps: the morph of eq. 4 and the rise of section 6.1.
            let steps = [[0.1, 28.0], [4.0, 24.0], [28.0, 0.0], [27.0, 0.5], [0.0, 0.0], [0.0, 0.0], [12.0, 30.0]];
            for gammas in steps {
                map.set_gammas(&gammas).unwrap();
                let mut new = made(&params, &guides(gammas), size, n as u64).0;
                for level in 0..levels as usize {
                    assert!(map.lattice(level) == new.lattice(level), "{size:?} {gammas:?} level {level}");
                }
                assert!(values(&map) == values(&new), "{size:?} {gammas:?}");
                map.rescale_widths();
                new.rescale_widths();
                assert!(map.seams() == new.seams(), "{size:?} {gammas:?}");
            }
        }
    }
}

/// Weights that stay count too: each alone is allowed, their sum is more than an edge can cost.
#[test]
fn weights_that_stay_have_a_share_of_what_is_allowed() {
    let ink = Grid::from_vec(UVec2::ONE, vec![1.0]).unwrap();
    let guides = [0.0, 240.0].map(|gamma| Guide { image: ink.clone(), gamma });
    let mut map = made(&VoronoiParams::DEFAULT, &guides, [30, 20], 1).0;
    let before = values(&map);
    let error = map.set_gammas(&[240.0]).unwrap_err();
    assert!(matches!(error, VoronoiError::OutOfRange { field: "gamma", .. }), "{error}");
    assert!(values(&map) == before);
    // What is at the very limit may stay there; weights beyond the number of guides are ignored.
    let most = 254.0 - 1.0 - 6.0;
    map.set_gammas(&[0.3, most - 0.3, f32::NAN]).unwrap();
    map.set_gammas(&[0.3]).unwrap();
}

/// A link costs what an edge between the same texels costs, and without noise on guides that is eq. 2 of the paper.
#[test]
fn links_cost_what_edges_cost() {
    let size = UVec2::new(40, 3);
    let mut rng = Rng::new(8);
    for share in [0, 20_000, u16::MAX] {
        let layers: Vec<Layer> = [0, share, share / 2]
            .map(|noise_share| {
                let values = (0..size.x * size.y).map(|_| rng.next_u32() as u16).collect();
                let weight = 1 + (rng.next_u32() % 9_000) as u16;
                Layer { weight, noise_share, ..Layer::new(Grid::from_vec(size, values).unwrap()) }
            })
            .into();
        let mut lattice = Lattice::new(size);
        (0..3).for_each(|y| lattice.set_row(y, &layers));
        let ends: Vec<[u32; 2]> = (0..79).filter(|i| i % 40 != 39).flat_map(|i| [[i, i + 1], [i, i + 40]]).collect();
        lattice.set_links(&ends, &layers);
        for (link, [a, b]) in lattice.links().iter().zip(ends) {
            let (across, down) = lattice.edges(a as usize);
            assert_eq!(link.cost, if b == a + 1 { across } else { down });
            let largest = |layer: &Layer| {
                let values = layer.values.as_slice();
                f64::from(values[a as usize].max(values[b as usize])) / 65536.0
            };
            let noise = largest(&layers[0]);
            let part = |layer: &Layer| {
                f64::from(layer.weight) * largest(layer) * (1.0 - f64::from(layer.noise_share) / 65536.0 * noise)
            };
            let want = 256.0 + layers.iter().map(part).sum::<f64>();
            assert!((f64::from(link.cost) - want).abs() < 6.0, "{} of {want}", link.cost);
            let plain = |layer: &Layer| (f64::from(layer.weight) * largest(layer)) as u16;
            assert!(share > 0 || link.cost == 256 + layers.iter().map(plain).sum::<u16>());
        }
    }
}

#[test]
fn slices_of_any_size_give_the_same_bits_and_progress_never_falls() {
    let mut rng = Rng::new(3);
    let guide = Guide::new(drawing(&mut rng, UVec2::new(60, 40)));
    let params = VoronoiParams { layout: SiteLayout::StrokePairs, levels: 2, ..VoronoiParams::DEFAULT };
    let (whole, whole_seams) = made(&params, std::slice::from_ref(&guide), [150, 100], 5);
    for rows in [1, 7, 100] {
        let mut bake = VoronoiBake::new(params.clone(), vec![guide.clone()], [150, 100].into(), 5).unwrap();
        let mut last = 0.0;
        while let BakeStatus::Working(share) = bake.step(rows) {
            assert!((last..=1.0).contains(&share), "{share} after {last}");
            last = share;
        }
        let (map, seams) = bake.finish();
        assert!(values(&map) == values(&whole) && seams == whole_seams, "{rows} rows at a time");
    }
    assert_eq!(whole.seams(), whole_seams);
}

/// A bake is stopped by its callback.
#[test]
fn g4_cancelled() {
    let mut calls = 0;
    let stop = |_| {
        calls += 1;
        if calls == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let map = voronoi_map(&VoronoiParams::DEFAULT, &[], [300, 300].into(), 1, stop);
    assert_eq!(map.err(), Some(VoronoiError::Cancelled));
    assert_eq!(calls, 3);
}

/// Guides of any size and content: each texel gets its one owner.
#[test]
fn g1_g2_guides_of_any_kind() {
    let mut rng = Rng::new(4);
    let wild = [f32::NAN, f32::INFINITY, -f32::INFINITY, -1.0, 2.0, 1.0e30, 0.0, 0.5, 1.0];
    let fill = |value: f32| move |_: u32| value;
    let mut images: Vec<Grid<f32>> = Vec::new();
    for size in [[0, 0], [0, 9], [1, 1], [1, 700], [3, 2], [64, 48], [500, 400]].map(UVec2::from) {
        let n = size.x * size.y;
        let mut grid = |value: &dyn Fn(u32) -> f32| {
            images.push(Grid::from_vec(size, (0..n).map(value).collect()).unwrap());
        };
        grid(&fill(0.0));
        grid(&fill(1.0));
        grid(&fill(f32::NAN));
        grid(&|i| wild[i as usize % wild.len()]);
        let noise: Vec<f32> = (0..n).map(|_| rng.unit()).collect();
        grid(&|i| noise[i as usize]);
        grid(&|i| if i == n / 2 { 1.0 } else { 0.0 });
    }
    for image in images {
        for layout in [SiteLayout::Uniform, SiteLayout::StrokePairs, SiteLayout::Density(image.clone())] {
            let params = VoronoiParams { sites: 20, layout, ..VoronoiParams::DEFAULT };
            let (map, seams) = made(&params, &[Guide::new(image.clone())], [64, 48], 1);
            assert_eq!(map.sites().len(), 20);
            assert!(values(&map) == dijkstra(map.lattice(0), map.sites()), "{:?}", image.size());
            assert!(seams.seams.iter().flat_map(|seam| &seam.points).all(|p| p.pos.is_finite() && p.width.is_finite()));
        }
    }
}

/// Any number of sites, anywhere.
#[test]
fn g3_any_number_of_sites() {
    for (asked, got) in [(0, 0), (1, 1), (2, 2), (1_000_000, super::MAX_SITES)] {
        for layout in [SiteLayout::Uniform, SiteLayout::Even, SiteLayout::Impact { at: Vec2::splat(0.5), focus: 2.0 }] {
            let params = VoronoiParams { sites: asked, layout, ..VoronoiParams::DEFAULT };
            let (map, seams) = made(&params, &[], [40, 30], 1);
            assert_eq!(map.sites().len(), got as usize);
            if asked == 0 {
                assert_eq!((map.region(3, 3), map.cost(3, 3), map.regions(), seams.seams.len()), (None, None, None, 0));
            } else {
                assert!(values(&map) == dijkstra(map.lattice(0), map.sites()));
            }
        }
    }
    // Beside strokes as well.
    let word = draw_text(FONT, "A", [40, 30].into(), f32::INFINITY).unwrap();
    let params = VoronoiParams { sites: u32::MAX, layout: SiteLayout::StrokePairs, ..VoronoiParams::DEFAULT };
    let (map, _) = made(&params, &[Guide { image: word, gamma: 28.0 }], [40, 30], 1);
    assert!(map.strokes().is_some() && map.sites().len() == super::MAX_SITES as usize);
    let given = |points: Vec<Vec2>| {
        let params = VoronoiParams { layout: SiteLayout::Given(points), ..VoronoiParams::DEFAULT };
        made(&params, &[], [40, 30], 1)
    };
    // All at one texel: the first has it all.
    let (map, seams) = given(vec![Vec2::splat(0.4); 300]);
    assert!(values(&map).iter().all(|at| at.unwrap().1 == 0) && seams.seams.is_empty());
    // On a line, beyond the border, not finite.
    let line = (0..20).map(|i| Vec2::new(i as f32 * 0.07, 0.5)).collect();
    assert_eq!(given(line).0.sites().len(), 20);
    let far = vec![Vec2::splat(-9.0), Vec2::splat(1.0e30), Vec2::new(f32::NAN, 0.0), Vec2::splat(f32::INFINITY)];
    assert_eq!(given(far).0.sites(), [UVec2::ZERO, UVec2::new(39, 29)]);
}

#[test]
fn parameters_out_of_range_are_named() {
    let refused = |params: VoronoiParams, gamma: f32| {
        let guides = vec![Guide { gamma, ..Guide::new(Grid::new(UVec2::ONE, 0.0)) }];
        match VoronoiBake::new(params, guides, [9, 9].into(), 1) {
            Err(VoronoiError::OutOfRange { field, .. }) => Some(field),
            _ => None,
        }
    };
    let ok = VoronoiParams::DEFAULT;
    assert_eq!(refused(ok.clone(), 28.0), None);
    for bad in [-1.0, f32::NAN, f32::INFINITY, 1.0e9] {
        assert_eq!(refused(ok.clone(), bad), Some("gamma"));
        assert_eq!(refused(VoronoiParams { alpha: bad, ..ok.clone() }, 1.0), Some("alpha"));
        assert_eq!(refused(VoronoiParams { beta: bad, ..ok.clone() }, 1.0), Some("beta"));
        assert_eq!(refused(VoronoiParams { noise_scale: bad, ..ok.clone() }, 1.0), Some("noise_scale"));
        assert_eq!(refused(VoronoiParams { width: bad, ..ok.clone() }, 1.0), Some("width"));
        assert_eq!(refused(VoronoiParams { least_width: bad, ..ok.clone() }, 1.0), Some("least_width"));
        assert_eq!(refused(VoronoiParams { taper: bad, ..ok.clone() }, 1.0), Some("taper"));
        assert_eq!(refused(VoronoiParams { roughness: bad, ..ok.clone() }, 1.0), Some("roughness"));
        let layout = SiteLayout::Impact { at: Vec2::ZERO, focus: bad };
        assert_eq!(refused(VoronoiParams { layout, ..ok.clone() }, 1.0), Some("layout.focus"));
    }
    assert_eq!(refused(VoronoiParams { levels: 0, ..ok.clone() }, 1.0), Some("levels"));
    assert!(matches!(VoronoiBake::new(ok, Vec::new(), [0, 9].into(), 1), Err(VoronoiError::Size(_))));
}

#[test]
fn guides_keep_their_values_and_their_mean() {
    let mut rng = Rng::new(6);
    let picture =
        |rng: &mut Rng, size: UVec2| Grid::from_vec(size, (0..size.x * size.y).map(|_| rng.unit()).collect()).unwrap();
    let stretched = |picture: &Grid<f32>, size: UVec2| {
        let mut out = Grid::new(size, 0u16);
        let resampler = Resampler::new(picture.size(), size);
        (0..size.y as usize).for_each(|y| resampler.fill_row(picture, y, out.row_mut(y)));
        out
    };
    let size = UVec2::new(37, 21);
    let same = picture(&mut rng, size);
    let got = stretched(&same, size);
    let mut pairs = got.as_slice().iter().zip(same.as_slice());
    assert!(pairs.all(|(&got, &want)| (f32::from(got) / 65535.0 - want).abs() < 1.0e-4));
    let large = picture(&mut rng, UVec2::new(400, 300));
    let got = stretched(&large, UVec2::new(40, 30));
    let mean = |values: &mut dyn Iterator<Item = f32>| values.sum::<f32>() / got.as_slice().len() as f32;
    let got_mean = mean(&mut got.as_slice().iter().map(|&v| f32::from(v) / 65535.0));
    assert!((got_mean - 0.5).abs() < 0.01, "{got_mean}");
    let spread = got.as_slice().iter().map(|&v| (f32::from(v) / 65535.0 - 0.5).abs()).fold(0.0, f32::max);
    assert!(spread < 0.2, "a mean of 100 random values does not lie {spread} off");
    let ramp = Grid::from_vec(UVec2::new(2, 1), vec![0.0, 1.0]).unwrap();
    let got = stretched(&ramp, UVec2::new(8, 1));
    let want = [0.0, 0.0, 0.125, 0.375, 0.625, 0.875, 1.0, 1.0];
    assert!(got.as_slice().iter().zip(want).all(|(&got, want)| (f32::from(got) / 65535.0 - want).abs() < 1.0e-3));
}

#[test]
fn even_sites_keep_their_distance_and_focused_ones_crowd() {
    let spread = |layout: SiteLayout| {
        let params = VoronoiParams { layout, ..VoronoiParams::DEFAULT };
        let (map, _) = made(&params, &[], [400, 400], 7);
        let sites = map.sites().to_vec();
        let nearest = |i: usize| {
            let others = (0..sites.len()).filter(|&j| j != i);
            others.map(|j| sites[i].as_vec2().distance(sites[j].as_vec2())).fold(f32::MAX, f32::min)
        };
        let least = (0..sites.len()).map(nearest).fold(f32::MAX, f32::min);
        let inner = sites.iter().filter(|site| site.as_vec2().distance(Vec2::splat(200.0)) < 50.0).count();
        (least, inner)
    };
    // 175 points as far apart as possible: 32 texels.
    assert!(spread(SiteLayout::Even).0 > 15.0);
    assert!(spread(SiteLayout::Uniform).0 < 6.0);
    assert!(spread(SiteLayout::Impact { at: Vec2::splat(0.5), focus: 2.0 }).1 > 50);
    let mut density = Grid::new(UVec2::new(2, 1), 0.0);
    density.row_mut(0)[1] = 3.0;
    let params = VoronoiParams { layout: SiteLayout::Density(density), ..VoronoiParams::DEFAULT };
    assert!(made(&params, &[], [400, 400], 7).0.sites().iter().all(|site| site.x >= 200));
}

/// A change here changes the patterns of all users.
#[test]
fn maps_are_frozen() {
    let mut rng = Rng::new(1);
    let guide = Guide::new(drawing(&mut rng, UVec2::new(120, 90)));
    let print = |layout: SiteLayout, levels: u32| {
        let params = VoronoiParams { layout, levels, ..VoronoiParams::DEFAULT };
        let (map, seams) = made(&params, std::slice::from_ref(&guide), [160, 120], 7);
        let texels = values(&map).into_iter().flatten().flat_map(|(cost, region)| [cost, u64::from(region)]);
        let points = seams.seams.iter().flat_map(|seam| &seam.points);
        let bits = points.flat_map(|point| [point.pos.x, point.pos.y, point.width]).map(|value| value.to_bits().into());
        texels.chain(bits).fold(0xCBF2_9CE4_8422_2325, |hash: u64, value| (hash ^ value).wrapping_mul(0x100_0000_01B3))
    };
    let impact = SiteLayout::Impact { at: Vec2::new(0.5, 0.4), focus: 2.0 };
    let prints = [
        print(SiteLayout::Uniform, 1),
        print(SiteLayout::Even, 3),
        print(impact, 1),
        print(SiteLayout::Density(guide.image.clone()), 1),
        print(SiteLayout::StrokePairs, 2),
    ];
    assert_eq!(
        prints,
        [2047274011768833231, 3022983925121957803, 12472721612593595598, 9925003892384198509, 8889205730238494924]
    );
}
