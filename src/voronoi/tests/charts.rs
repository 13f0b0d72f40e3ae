//! Maps of surfaces that are laid out in parts.

use super::{below, dijkstra, drawing, random_lattice, unpacked};
use crate::{
    Grid,
    math::Rng,
    voronoi::{
        Guide, MapCharts, SiteLayout, VoronoiBake, VoronoiError, VoronoiMap, VoronoiParams, lattice::Layer,
        search::Search, tests::Kind,
    },
};
use glam::{UVec2, Vec2};

/// Any graph of texels: a lattice, and edges between texels anywhere.
#[test]
fn with_links_costs_and_regions_equal_dijkstra() {
    let mut rng = Rng::new(6);
    for size in [[1, 1], [7, 5], [130, 3], [64, 64], [257, 31]].map(UVec2::from) {
        for kind in [Kind::White, Kind::Smooth, Kind::Flat, Kind::Maze] {
            for n_links in [1, 8, 300] {
                let n = size.x * size.y;
                let mut lattice = random_lattice(&mut rng, size, kind);
                let links: Vec<[u32; 2]> = (0..n_links).map(|_| [below(&mut rng, n), below(&mut rng, n)]).collect();
                let noise: Vec<u16> = (0..n).map(|_| (rng.next_u32() >> 16) as u16).collect();
                let mut layer = Layer::new(Grid::from_vec(size, noise).unwrap());
                layer.set_weight(30.0 * rng.unit());
                lattice.set_links(&links, &[layer]);
                let sites: Vec<_> =
                    (0..5).map(|_| UVec2::new(below(&mut rng, size.x), below(&mut rng, size.y))).collect();
                let (mut narrow, mut wide) = (Search::<i32>::new(size), Search::<i64>::new(size));
                for (i, &site) in (0u32..).zip(&sites) {
                    narrow.add_site(site, i);
                    wide.add_site(site, i);
                }
                narrow.finish::<true>(&lattice);
                wide.finish::<true>(&lattice);
                let want = dijkstra(&lattice, &sites);
                assert!(unpacked(&narrow) == want, "{size} {kind:?} {n_links}");
                assert!(unpacked(&wide) == want, "{size} {kind:?} {n_links}");
            }
        }
    }
}

const WHOLE: UVec2 = UVec2::new(110, 80);

/// Where the surface is cut, and the other part lies in the picture of both.
const CUT: u32 = 47;

const OTHER: UVec2 = UVec2::new(3, 95);

const BOTH: UVec2 = UVec2::new(90, 181);

/// Where a texel of the whole lies.
fn moved(at: UVec2) -> UVec2 {
    if at.x < CUT { at } else { UVec2::new(at.x - CUT, at.y) + OTHER }
}

fn texels() -> impl Iterator<Item = UVec2> {
    (0..WHOLE.y).flat_map(|y| (0..WHOLE.x).map(move |x| UVec2::new(x, y)))
}

fn cut_in_two() -> MapCharts {
    let mut chart = Grid::new(BOTH, MapCharts::NOTHING);
    for at in texels() {
        let to = moved(at);
        chart.row_mut(to.y as usize)[to.x as usize] = u32::from(at.x >= CUT);
    }
    let links = (0..WHOLE.y).map(|y| [CUT - 1, CUT].map(|x| moved(UVec2::new(x, y)))).collect();
    MapCharts::new(chart, 80.0, 0, links).unwrap()
}

/// A map of the whole, and the same of two parts.
fn maps(levels: u32, sites: &[UVec2], guide: &Grid<f32>) -> [VoronoiBake; 2] {
    let mut laid_out = Grid::new(BOTH, 0.0);
    for at in texels() {
        let to = moved(at);
        laid_out.row_mut(to.y as usize)[to.x as usize] = guide.get(at.x, at.y).unwrap();
    }
    let params = |sites: Vec<UVec2>| {
        let places = sites.into_iter().map(|site| (site.as_vec2() + 0.5) / 80.0).collect();
        VoronoiParams {
            alpha: 0.0,
            guide_noise: 0.0,
            levels,
            layout: SiteLayout::Given(places),
            ..VoronoiParams::DEFAULT
        }
    };
    let whole = VoronoiBake::new(params(sites.to_vec()), vec![Guide::new(guide.clone())], WHOLE, 1);
    let moved = sites.iter().map(|site| moved(*site)).collect();
    [whole.unwrap(), VoronoiBake::on_charts(params(moved), vec![Guide::new(laid_out)], cut_in_two(), 1).unwrap()]
}

/// A surface that is cut in two and joined by links has the map of one that is whole.
#[test]
fn regions_go_on_from_chart_to_chart() {
    let mut rng = Rng::new(77);
    for (seed, levels) in [1, 2, 3].into_iter().cycle().take(9).enumerate() {
        let guide = drawing(&mut rng, WHOLE);
        let sites: Vec<UVec2> =
            (0..40).map(|_| UVec2::new(below(&mut rng, WHOLE.x), below(&mut rng, WHOLE.y))).collect();
        let [mut whole, mut cut] = maps(levels, &sites, &guide).map(|bake| bake.finish().0);
        let compare = |whole: &VoronoiMap, cut: &VoronoiMap| {
            for at in texels() {
                let to = moved(at);
                let (one, other) = (whole.cost(at.x, at.y), cut.cost(to.x, to.y));
                assert_eq!(one, other, "seed {seed}, {levels} levels: cost at {at}");
                assert_eq!(whole.region(at.x, at.y), cut.region(to.x, to.y), "seed {seed}, {levels} levels: at {at}");
            }
        };
        compare(&whole, &cut);
        for gamma in [3.0, 0.0, 28.0] {
            whole.set_gammas(&[gamma]).unwrap();
            cut.set_gammas(&[gamma]).unwrap();
            compare(&whole, &cut);
        }
        assert_eq!(cut.region(BOTH.x - 1, 3), None, "nothing of the surface is there");
    }
}

/// Each chart has its own lines, which end where it is cut, and go on at the other side.
#[test]
fn cracks_end_at_a_cut_and_go_on_behind_it() {
    let mut rng = Rng::new(78);
    let mut ends = 0;
    for _ in 0..6 {
        let sites: Vec<UVec2> =
            (0..60).map(|_| UVec2::new(below(&mut rng, WHOLE.x), below(&mut rng, WHOLE.y))).collect();
        let [(_, whole), (map, cut)] = maps(1, &sites, &Grid::new(WHOLE, 0.0)).map(VoronoiBake::finish);
        let chart = |at: Vec2| u32::from(at.y * 80.0 > 87.0);
        for seam in &cut.seams {
            let first = chart(seam.points[0].pos);
            assert!(seam.points.iter().all(|point| chart(point.pos) == first), "{seam:?}");
        }
        let borders = |chart_of: u32, x: f32| {
            let at_cut = cut.vertices.iter().filter(move |vertex| vertex.on_border && chart(vertex.pos) == chart_of);
            let mut rows: Vec<f32> =
                at_cut.filter(|vertex| vertex.pos.x * 80.0 == x).map(|vertex| vertex.pos.y * 80.0).collect();
            rows.sort_by(f32::total_cmp);
            rows
        };
        let (left, right) = (borders(0, CUT as f32), borders(1, OTHER.x as f32));
        // Elsewhere they run along the cut: what is on both sides of it belongs to different regions.
        let runs_along = |row: f32| {
            let rows = (row - 2.0).max(0.0) as u32..(row + 2.0).min(WHOLE.y as f32) as u32;
            rows.into_iter().any(|y| {
                let [a, b] = [CUT - 1, CUT].map(|x| moved(UVec2::new(x, y))).map(|at| map.region(at.x, at.y));
                a != b
            })
        };
        for row in &left {
            let goes_on = right.iter().any(|other| (other - OTHER.y as f32 - row).abs() < 1.0);
            assert!(goes_on || runs_along(*row), "{row}: {left:?} {right:?}");
        }
        ends += left.len();
        let length = |seams: &crate::voronoi::Seams| {
            let pieces = seams.seams.iter().flat_map(|seam| seam.points.windows(2));
            pieces.map(|pair| pair[0].pos.distance(pair[1].pos)).sum::<f32>()
        };
        let ratio = length(&cut) / length(&whole);
        assert!((0.93..1.02).contains(&ratio), "{ratio}");
    }
    assert!(ends > 30, "cracks reach the cut: {ends}");
}

/// A front comes to the other side of a cut when it has run there, not when it would have come straight through the picture.
#[test]
fn fronts_go_over_cuts() {
    let mut rng = Rng::new(79);
    let sites: Vec<UVec2> = (0..60).map(|_| UVec2::new(below(&mut rng, WHOLE.x), below(&mut rng, WHOLE.y))).collect();
    let [(one, whole), (two, cut)] = maps(1, &sites, &Grid::new(WHOLE, 0.0)).map(VoronoiBake::finish);
    let from = Vec2::new(20.0, 40.0) / 80.0;
    assert_eq!(one.network(&whole, from), whole.network(from), "a plain surface has the plain front");
    let network = two.network(&cut, from);
    let births = |is_other: bool| {
        let texel = |at: Vec2| at * 80.0;
        let nodes = network.nodes.iter().filter(move |node| (texel(node.pos).y > 90.0) == is_other);
        let near_cut = move |at: Vec2| {
            let column = if is_other { at.x - OTHER.x as f32 } else { CUT as f32 - at.x };
            column < 6.0
        };
        let mut births: Vec<u32> = nodes.filter(|node| near_cut(texel(node.pos))).map(|node| node.birth).collect();
        births.sort_unstable();
        births
    };
    let (near, beyond) = (births(false), births(true));
    assert!(near.len() > 5 && beyond.len() > 5);
    // Across the cut at the nearest place it is 27 texels away, a third of a unit: 33 steps; straight through the picture it is 71.
    assert!((25..60).contains(&beyond[0]) && beyond[0].abs_diff(near[0]) < 20, "{near:?} {beyond:?}");
    let straight = cut.network(from);
    let first = straight.nodes.iter().filter(|node| node.pos.y * 80.0 > 90.0).map(|node| node.birth).min();
    assert!(first.is_some_and(|first| first > 60), "{first:?}");
}

/// Two parts of one chart that touch where the surface has no way across.
#[test]
fn walls_part_what_is_no_neighbour() {
    let size = UVec2::new(9, 5);
    let walls = (0..4).map(|y| [UVec2::new(5, y), UVec2::new(4, y)]);
    let charts = MapCharts::new(Grid::new(size, 0), 5.0, 0, Vec::new()).unwrap();
    let beyond = [[UVec2::new(8, 0), UVec2::new(9, 0)], [UVec2::ZERO, UVec2::new(2, 0)]];
    let charts = charts.with_walls(walls.chain(beyond));
    let params = VoronoiParams {
        alpha: 0.0,
        layout: SiteLayout::Given(vec![Vec2::new(0.9, 0.1), Vec2::new(1.7, 0.9)]),
        ..VoronoiParams::DEFAULT
    };
    let (map, seams) = VoronoiBake::on_charts(params, Vec::new(), charts, 1).unwrap().finish();
    // From the first site at (4, 0) the way to (5, 0) leads around the wall, and the other site at (8, 4) is nearer.
    assert_eq!((map.region(4, 0), map.region(5, 0), map.cost(5, 0)), (Some(0), Some(1), Some(7 * 256)));
    for seam in &seams.seams {
        let across = |point: &&crate::pattern::PathPoint| point.pos.y < 0.7 && (point.pos.x - 1.0).abs() < 0.05;
        assert!(!seam.points.iter().any(|point| across(&point)), "no crack along a wall: {seam:?}");
    }
}

#[test]
fn sites_lie_within_their_charts_and_what_none_reaches_has_no_region() {
    // Two charts that are not joined, with a margin of three texels.
    let mut chart = Grid::new(UVec2::new(60, 40), MapCharts::NOTHING);
    for y in 0..40 {
        chart.row_mut(y)[..30].fill(4);
        chart.row_mut(y)[30..52].fill(9);
    }
    let inside = |site: UVec2| (3..37).contains(&site.y) && ((3..27).contains(&site.x) || (33..49).contains(&site.x));
    let stroke = {
        let mut stroke = Grid::new(UVec2::new(60, 40), 0.0);
        (0..40).for_each(|y| stroke.row_mut(y)[14..17].fill(1.0));
        stroke
    };
    for layout in [
        SiteLayout::Uniform,
        SiteLayout::Even,
        SiteLayout::Impact { at: Vec2::new(0.75, 0.5), focus: 3.0 },
        SiteLayout::Density(Grid::new(UVec2::new(2, 2), 1.0)),
        SiteLayout::StrokePairs,
        SiteLayout::Given(vec![Vec2::ZERO, Vec2::new(0.3, 0.4), Vec2::new(1.4, 0.5)]),
    ] {
        let charts = MapCharts::new(chart.clone(), 40.0, 3, Vec::new()).unwrap();
        let params = VoronoiParams { sites: 20, layout: layout.clone(), ..VoronoiParams::DEFAULT };
        let guides = vec![Guide::new(stroke.clone())];
        let (map, seams) = VoronoiBake::on_charts(params, guides, charts, 2).unwrap().finish();
        let least = if matches!(layout, SiteLayout::Given(_)) { 1 } else { 20 };
        assert!(map.sites().len() >= least, "{layout:?}: {:?}", map.sites());
        assert!(map.sites().iter().all(|site| inside(*site)), "{layout:?}: {:?}", map.sites());
        assert_eq!(map.region(55, 20), None);
        for seam in &seams.seams {
            // It may end on the line between the charts.
            let side = |at: Vec2| (at.x * 40.0 - 30.0).signum() * f32::from(at.x * 40.0 != 30.0);
            let sides = seam.points.iter().map(|point| side(point.pos));
            let (least, most) = sides.fold((1.0f32, -1.0f32), |(least, most), side| (least.min(side), most.max(side)));
            assert!(least * most >= 0.0, "{layout:?}: {seam:?}");
        }
        if least == 1 {
            assert_eq!((map.region(5, 5), map.region(40, 5)), (Some(0), None), "no site, no region");
        }
    }
}

#[test]
fn links_that_join_nothing_are_refused() {
    let mut chart = Grid::new(UVec2::new(4, 1), 0);
    chart.row_mut(0)[3] = MapCharts::NOTHING;
    let good = [UVec2::ZERO, UVec2::new(2, 0)];
    for bad in [[UVec2::ZERO, UVec2::new(3, 0)], [UVec2::new(0, 1), UVec2::ZERO], [UVec2::ZERO; 2]] {
        let outcome = MapCharts::new(chart.clone(), 1.0, 0, vec![good, bad]);
        assert_eq!(outcome, Err(VoronoiError::Link { index: 1 }));
    }
    assert!(MapCharts::new(chart, f32::NAN, 0, vec![good]).is_ok(), "as a plain surface of its size");
    assert!(matches!(MapCharts::new(Grid::new(UVec2::ZERO, 0), 1.0, 0, Vec::new()), Err(VoronoiError::Size(_))));
}
