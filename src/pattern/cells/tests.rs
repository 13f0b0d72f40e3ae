//! Cells against tracing all faces at once.

use super::*;
use crate::{
    CrackPreset,
    growth::CrackGrowth,
    math::Rng,
    pattern::random::{link, node, planar_network},
};

/// Twice the signed area of a closed line.
fn shoelace(line: &[Vec2]) -> f64 {
    (0..line.len()).map(|i| line[i].as_dvec2().perp_dot(line[(i + 1) % line.len()].as_dvec2())).sum()
}

fn contains(line: &[Vec2], p: Vec2) -> bool {
    let crossings = (0..line.len()).filter(|&i| {
        let (a, b) = (line[i].as_dvec2(), line[(i + 1) % line.len()].as_dvec2());
        let p = p.as_dvec2();
        (a.y <= p.y) != (b.y <= p.y) && a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) > p.x
    });
    crossings.count() % 2 == 1
}

/// All faces at once, with angles: the areas of the cells without their holes, smallest first, and the number of parts.
fn brute_force(network: &Network) -> (Vec<f64>, usize) {
    let extent = network.extent();
    let mut points: Vec<Vec2> = network.nodes.iter().map(|node| node.pos).collect();
    let mut edges: Vec<(usize, usize)> =
        network.segments().map(|s| network.ends(s).map(|(a, b)| (a as usize, b as usize)).unwrap()).collect();
    let nodes = points.len();
    points.extend([Vec2::ZERO, Vec2::new(extent.x, 0.0), extent, Vec2::new(0.0, extent.y)]);
    for side in [0, 1, 2, 3] {
        let on_side = |p: Vec2| [p.y == 0.0, p.x == extent.x, p.y == extent.y, p.x == 0.0][side];
        let mut line: Vec<usize> = (0..points.len()).filter(|&i| on_side(points[i])).collect();
        line.sort_by(|&a, &b| (points[a].x + points[a].y).total_cmp(&(points[b].x + points[b].y)));
        edges.extend(line.windows(2).map(|pair| (pair[0], pair[1])));
    }
    let half: Vec<(usize, usize)> = edges.iter().flat_map(|&(a, b)| [(a, b), (b, a)]).collect();
    let angle = |h: usize| {
        let way = (points[half[h].1] - points[half[h].0]).as_dvec2();
        way.y.atan2(way.x)
    };
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); points.len()];
    for h in 0..half.len() {
        around[half[h].0].push(h);
    }
    for leaving in &mut around {
        leaving.sort_by(|&a, &b| angle(a).total_cmp(&angle(b)));
    }
    let mut part: Vec<usize> = (0..points.len()).collect();
    for _ in 0..points.len() {
        for &(a, b) in &edges {
            let low = part[a].min(part[b]);
            (part[a], part[b]) = (low, low);
        }
    }
    let mut seen = vec![false; half.len()];
    let (mut cells, mut holes) = (Vec::new(), Vec::new());
    for start in 0..half.len() {
        let (mut line, mut h) = (Vec::new(), start);
        while !seen[h] {
            seen[h] = true;
            line.push(points[half[h].0]);
            let leaving = &around[half[h].1];
            let back = leaving.iter().position(|&other| other == h ^ 1).unwrap();
            h = leaving[(back + leaving.len() - 1) % leaving.len()];
        }
        let area = shoelace(&line);
        if area > 0.0 {
            cells.push((area, area, line, part[half[start].0]));
        } else if area < 0.0 {
            holes.push((area, line[0], part[half[start].0]));
        }
    }
    for (area, at, inner) in holes {
        let host =
            cells.iter_mut().filter(|cell| cell.3 != inner && contains(&cell.2, at)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(host) = host {
            host.1 += area;
        }
    }
    let mut areas: Vec<f64> = cells.iter().map(|cell| cell.1 / 2.0).collect();
    areas.sort_by(f64::total_cmp);
    part[nodes..].fill(nodes);
    let mut parts: Vec<usize> = network.nodes.iter().enumerate().map(|(i, _)| part[i]).collect();
    parts.push(part_of_border(&part, network));
    parts.sort_unstable();
    parts.dedup();
    (areas, parts.len())
}

fn part_of_border(part: &[usize], network: &Network) -> usize {
    let on_border =
        network.nodes.iter().position(|n| n.pos.min_element() == 0.0 || n.pos.cmpeq(network.extent()).any());
    on_border.map_or(network.nodes.len(), |i| part[i])
}

fn check(network: &Network, tracker: &CellTracker) {
    let (areas, parts) = brute_force(network);
    let mut ours: Vec<f64> = tracker.cells().iter().map(|cell| f64::from(cell.area)).collect();
    ours.sort_by(f64::total_cmp);
    assert_eq!(ours.len(), areas.len());
    for (ours, area) in ours.iter().zip(&areas) {
        assert!((ours - area).abs() < 1e-6, "{ours} {area}");
    }
    let sum: f64 = ours.iter().sum();
    assert!((sum - f64::from(network.extent().element_product())).abs() < 1e-6 * sum);

    let on_border = |p: Vec2| p.min_element() == 0.0 || p.cmpeq(network.extent()).any();
    let vertices = network.nodes.len() + 4;
    let edges = network.segments().count() + 4 + network.nodes.iter().filter(|node| on_border(node.pos)).count();
    let faces = tracker.cells().len() + 1;
    assert_eq!(vertices + faces, 1 + parts + edges, "Euler");

    for (id, cell) in (0u32..).zip(tracker.cells()) {
        let line = |outline: Vec<u32>| -> Vec<Vec2> { outline.into_iter().map(|i| tracker.pos(i).unwrap()).collect() };
        let outer = line(tracker.outline(id));
        let area = shoelace(&outer) + tracker.holes(id).map(|hole| shoelace(&line(hole))).sum::<f64>();
        assert!((area / 2.0 - f64::from(cell.area)).abs() < 1e-6, "{area} {}", cell.area);
        assert!(cell.centroid.cmpge(Vec2::ZERO).all() && cell.centroid.cmple(network.extent()).all());
    }
}

#[test]
fn equals_tracing_everything_at_once() {
    let mut rng = Rng::new(11);
    let (mut closed, mut holes) = (0, 0);
    for _ in 0..1000 {
        let extent = [Vec2::ONE, Vec2::new(2.0, 1.0), Vec2::new(1.0, 1.5)][rng.next_u32() as usize % 3];
        let nodes = 2 + rng.next_u32() % 90;
        let network = planar_network(nodes, extent, &mut rng);
        let mut tracker = CellTracker::new(extent);
        let born = tracker.update(&network);
        assert_eq!(born, 1..tracker.cells().len() as u32);
        check(&network, &tracker);
        assert_eq!(tracker.update(&network).len(), 0);
        closed += tracker.closed();
        holes += (0..=tracker.closed()).map(|id| tracker.holes(id).count()).sum::<usize>();
    }
    assert!(closed > 10_000 && holes > 100, "{closed} cells and {holes} holes put it to the test");
}

#[test]
fn it_does_not_matter_how_often_it_looks() {
    let mut rng = Rng::new(12);
    for _ in 0..100 {
        let whole = planar_network(60, Vec2::ONE, &mut rng);
        let mut at_once = CellTracker::new(Vec2::ONE);
        at_once.update(&whole);
        let (mut part, mut tracker) = (Network::new(Vec2::ONE, 0.0, 0), CellTracker::new(Vec2::ONE));
        let mut last = 0;
        for birth in 0..60 {
            part.nodes.extend(whole.nodes.iter().filter(|node| node.birth == birth));
            part.links.extend(whole.links.iter().filter(|link| link.birth == birth));
            for id in tracker.update(&part) {
                assert_eq!((id, tracker.cells()[id as usize].birth), (last + 1, birth));
                last = id;
            }
            check(&part, &tracker);
        }
        assert_eq!(tracker.cells(), at_once.cells());
    }
}

#[test]
fn the_cell_at_a_place_has_it_inside() {
    let mut rng = Rng::new(13);
    for _ in 0..100 {
        let network = planar_network(80, Vec2::ONE, &mut rng);
        let mut tracker = CellTracker::new(Vec2::ONE);
        tracker.update(&network);
        let line = |outline: Vec<u32>| -> Vec<Vec2> { outline.into_iter().map(|i| tracker.pos(i).unwrap()).collect() };
        for _ in 0..50 {
            let place = Vec2::new(rng.unit(), rng.unit());
            let cell = tracker.cell_at(place).unwrap();
            assert!(contains(&line(tracker.outline(cell)), place));
            assert!(tracker.holes(cell).all(|hole| !contains(&line(hole), place)));
        }
    }
    assert_eq!(CellTracker::new(Vec2::ONE).cell_at(Vec2::new(1.5, 0.5)), None);
    assert_eq!(CellTracker::new(Vec2::ONE).cell_at(Vec2::NAN), None);
}

#[test]
fn a_crack_from_side_to_side_cuts_the_smaller_part_off() {
    let mut network = Network::new(Vec2::ONE, 0.0, 0);
    let mut tracker = CellTracker::new(Vec2::ONE);
    for (i, x) in [0.0, 0.25, 0.25, 0.25].into_iter().enumerate() {
        let y = [0.5, 0.5, 0.0, 1.0][i];
        let parent = [NO_PARENT, 0, 1, 1][i];
        network.nodes.push(node(Vec2::new(x, y), parent, i as u32));
    }
    assert_eq!(tracker.update(&network), 1..3);
    let corner = |i| CORNERS + i;
    let areas: Vec<f32> = tracker.cells().iter().map(|cell| cell.area).collect();
    assert_eq!(areas, [0.75, 0.125, 0.125]);
    assert_eq!(tracker.outline(0), [3, 1, 2, corner(1), corner(2)]);
    assert_eq!(tracker.cells()[1].centroid, Vec2::new(0.125, 0.25));
    assert_eq!((tracker.cells()[2].birth, tracker.cells()[2].impact), (3, 0));
}

#[test]
fn degenerate_networks_stay_sane() {
    let pos = |x: f32, y: f32| Vec2::new(x, y);
    let mut network = Network::new(Vec2::ONE, 0.0, 0);
    // A triangle, one of its corners twice, a link beside a branch, a link from a node to itself, an edge along the
    // border, one through a corner, three in a row, a node that is not a number, a link to nowhere.
    let places = [pos(0.25, 0.25), pos(0.75, 0.25), pos(0.5, 0.75), pos(0.5, 0.75), pos(0.0, 0.5), pos(0.0, 0.75)];
    for (i, place) in (0u32..).zip(places) {
        network.nodes.push(node(place, if i == 0 { NO_PARENT } else { i - 1 }, i));
    }
    network.nodes.push(node(Vec2::ZERO, 0, 6));
    network.nodes.push(node(pos(0.5, 0.25), 0, 7));
    network.nodes.push(node(pos(f32::NAN, 0.25), 0, 8));
    network.nodes.push(node(pos(2.0, 0.25), 8, 9));
    for (a, b) in [(0, 2), (0, 3), (1, 0), (2, 2), (0, 7), (8, 9), (77, 1), (6, 4)] {
        network.links.push(link(a, b, 10));
    }
    let mut tracker = CellTracker::new(Vec2::ONE);
    tracker.update(&network);
    let areas: Vec<f32> = tracker.cells().iter().map(|cell| cell.area).collect();
    // The triangle, and the part left of it between corner and border.
    assert_eq!(areas.len(), 3, "{areas:?}");
    assert!((areas.iter().sum::<f32>() - 1.0).abs() < 1e-6 && areas.contains(&0.125), "{areas:?}");

    for extent in [Vec2::ZERO, Vec2::NAN, Vec2::new(1.0, f32::INFINITY), Vec2::new(-1.0, 1.0), Vec2::new(1e-30, 1.0)] {
        let mut tracker = CellTracker::new(extent);
        assert_eq!(tracker.update(&network), 0..0);
        assert_eq!((tracker.cells().len(), tracker.outline(0).len(), tracker.cell_at(Vec2::ZERO)), (0, 0, None));
    }
}

/// Segments that cross, on top of each other, in each other's way: no answer is right, but it must come.
#[test]
fn crossing_segments_do_no_harm() {
    let mut rng = Rng::new(14);
    for _ in 0..2000 {
        let mut network = Network::new(Vec2::ONE, 0.0, 0);
        let grid = 2 + rng.next_u32() % 30;
        let place = |rng: &mut Rng| (rng.next_u32() % (grid + 1)) as f32 / grid as f32;
        for i in 0..rng.next_u32() % 60 {
            let parent = if rng.unit() < 0.2 || i == 0 { NO_PARENT } else { rng.next_u32() % i };
            network.nodes.push(node(Vec2::new(place(&mut rng), place(&mut rng)), parent, i));
        }
        let n = network.nodes.len() as u32 + 1;
        network.links.extend((0..rng.next_u32() % 60).map(|_| link(rng.next_u32() % n, rng.next_u32() % n, 60)));
        let mut tracker = CellTracker::new(Vec2::ONE);
        tracker.update(&network);
        let sum: f32 = tracker.cells().iter().map(|cell| cell.area).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        for id in 0..=tracker.closed() {
            assert!(tracker.cells()[id as usize].centroid.is_finite());
            assert!(tracker.outline(id).len() < 1000 && tracker.holes(id).count() < 100);
        }
    }
}

#[test]
fn clay_closes_cells() {
    let mut growth = CrackGrowth::new(CrackPreset::CLAY.growth, Vec2::ONE, 1).unwrap();
    growth.hit(Vec2::splat(0.5), 1.0);
    let mut tracker = CellTracker::new(Vec2::ONE);
    while growth.step().grew() {
        tracker.update(growth.network());
    }
    assert!(tracker.closed() > 4, "{}", tracker.closed());
}
