//! Seams, and the networks that they become.

use super::{drawing, made};
use crate::{
    Grid,
    math::Rng,
    voronoi::{Front, Guide, Seam, SiteLayout, VoronoiParams},
};
use glam::{UVec2, Vec2};
use std::collections::BTreeMap;

#[test]
fn cracks_cover_the_strokes() {
    let mut rng = Rng::new(12);
    for seed in 0..6 {
        let image = drawing(&mut rng, UVec2::new(300, 300));
        let report = |layout: SiteLayout| {
            let params = VoronoiParams { layout, ..VoronoiParams::DEFAULT };
            made(&params, &[Guide::new(image.clone())], [400, 400], seed).0.strokes()
        };
        let report = report(SiteLayout::StrokePairs).unwrap();
        assert!(report.covered >= 0.95 && report.length > 1.0, "{report:?}");
    }
}

/// Signed area to the left of a line, texels: negative if it runs round its left side clockwise on the screen.
fn sweep(seam: &Seam) -> f64 {
    let points: Vec<_> = seam.points.iter().map(|point| point.pos.as_dvec2()).collect();
    0.5 * points.windows(2).map(|pair| pair[0].perp_dot(pair[1])).sum::<f64>()
}

#[test]
fn seams_meet_in_their_vertices_alone() {
    let mut rng = Rng::new(31);
    for seed in 0..40 {
        let guides = [Guide::new(drawing(&mut rng, UVec2::new(60, 60)))];
        let roughness = if seed % 4 == 0 { 0.02 } else { rng.range(0.0, 0.02) };
        let levels = 1 + (seed % 3) as u32;
        let params = VoronoiParams { sites: 90, levels, roughness, ..VoronoiParams::DEFAULT };
        let (map, seams) = made(&params, &guides[..(seed % 2) as usize], [120, 90], seed);
        let mut ends = vec![0; seams.vertices.len()];
        let mut pieces = Vec::new();
        for (i, seam) in seams.seams.iter().enumerate() {
            assert!(seam.left != seam.right && seam.points.len() >= 2);
            assert_eq!(seam.points[0].pos, seams.vertices[seam.from as usize].pos);
            assert_eq!(seam.points[seam.points.len() - 1].pos, seams.vertices[seam.to as usize].pos);
            ends[seam.from as usize] += 1;
            ends[seam.to as usize] += 1;
            let n = seam.points.len() - 1;
            pieces.extend(seam.points.windows(2).enumerate().map(|(k, pair)| {
                let name = |k: usize| match k {
                    0 => (usize::MAX, seam.from as usize),
                    k if k == n => (usize::MAX, seam.to as usize),
                    k => (i, k),
                };
                ([pair[0].pos, pair[1].pos], [name(k), name(k + 1)])
            }));
        }
        for (vertex, ends) in seams.vertices.iter().zip(ends) {
            let (pos, extent) = (vertex.pos, seams.extent);
            let on_border = pos.x == 0.0 || pos.y == 0.0 || pos.x == extent.x || pos.y == extent.y;
            assert_eq!(vertex.on_border, on_border);
            assert!(if on_border { ends == 1 } else { (2..=4).contains(&ends) }, "{vertex:?} has {ends} ends");
        }
        for (i, (a, a_names)) in pieces.iter().enumerate() {
            for (b, b_names) in &pieces[i + 1..] {
                let apart = a[0].min(a[1]).cmpgt(b[0].max(b[1])).any() || b[0].min(b[1]).cmpgt(a[0].max(a[1])).any();
                if apart || a_names.iter().any(|name| b_names.contains(name)) {
                    continue;
                }
                let side = |from: Vec2, to: Vec2, p: Vec2| (to - from).as_dvec2().perp_dot((p - from).as_dvec2());
                let crossed = side(a[0], a[1], b[0]) * side(a[0], a[1], b[1]) <= 0.0
                    && side(b[0], b[1], a[0]) * side(b[0], b[1], a[1]) <= 0.0;
                assert!(!crossed, "{a:?} crosses {b:?}");
            }
        }
        // Round a region that does not reach the border, its seams enclose about as much as it has texels.
        let regions = map.regions().unwrap();
        let (w, h) = (regions.width(), regions.height());
        let (mut texels, mut areas, mut inner) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        for (i, &region) in regions.as_slice().iter().enumerate() {
            *texels.entry(region).or_insert(0.0) += 1.0;
            let border = i % w == 0 || i % w == w - 1 || i < w || i / w == h - 1;
            *inner.entry(region).or_insert(true) &= !border;
        }
        for seam in &seams.seams {
            // y is down: a region to the right is run round with growing angle, its area is positive.
            *areas.entry(seam.right).or_insert(0.0) += sweep(seam) * 8100.0;
            *areas.entry(seam.left).or_insert(0.0) -= sweep(seam) * 8100.0;
        }
        for (region, texels) in texels.iter().filter(|(region, _)| inner[region]) {
            let area: f64 = areas[region];
            assert!((area - texels).abs() < 4.0 + 0.2 * texels, "region {region}: {area} instead of {texels}");
        }
    }
}

/// A region that lies wholly within another one has a ring of a seam.
#[test]
fn islands_have_rings() {
    let mut wall = Grid::new(UVec2::splat(40), 0.0);
    for y in 10..30 {
        for x in 10..30 {
            let edge = !(14..26).contains(&x) || !(14..26).contains(&y);
            wall.row_mut(y)[x] = if edge { 1.0 } else { 0.0 };
        }
    }
    let layout = SiteLayout::Given(vec![Vec2::splat(0.05), Vec2::splat(0.5)]);
    let params = VoronoiParams { layout, ..VoronoiParams::DEFAULT };
    let (_, seams) = made(&params, &[Guide { gamma: 200.0, ..Guide::new(wall) }], [40, 40], 1);
    assert_eq!((seams.seams.len(), seams.vertices.len()), (1, 1));
    let seam = &seams.seams[0];
    assert_eq!((seam.from, seam.to), (0, 0));
    let area = sweep(seam).abs() * 1600.0;
    assert!((150.0..300.0).contains(&area), "{area}");
}

#[test]
fn networks_hold_every_seam_and_are_in_order_of_birth() {
    let mut rng = Rng::new(77);
    for seed in 0..4 {
        let guide = Guide::new(drawing(&mut rng, UVec2::new(80, 80)));
        let (_, seams) = made(&VoronoiParams::DEFAULT, &[guide], [160, 120], seed);
        let network = seams.network(Vec2::new(0.4, 0.6));
        let length: f64 = network
            .segments()
            .map(|segment| {
                let (a, b) = network.ends(segment).unwrap();
                let at = |i: u32| network.nodes()[i as usize].pos.as_dvec2();
                assert_eq!(network.path(segment).unwrap().points().len(), 2, "the line is straight");
                at(a).distance(at(b))
            })
            .sum();
        let want: f64 = seams
            .seams
            .iter()
            .flat_map(|seam| seam.points.windows(2))
            .map(|pair| pair[0].pos.as_dvec2().distance(pair[1].pos.as_dvec2()))
            .sum();
        assert!((length / want - 1.0).abs() < 1.0e-6, "{length} of {want}");
        assert!(network.nodes().is_sorted_by_key(|node| node.birth) && network.links().is_sorted_by_key(|l| l.birth));
        for (i, node) in (0u32..).zip(network.nodes()) {
            assert!(node.width > 0.0 && (node.parent < i || node.parent == crate::pattern::NO_PARENT));
        }
        let first = network.nodes()[0].pos.distance(Vec2::new(0.4, 0.6));
        assert!(network.nodes().iter().all(|node| node.pos.distance(Vec2::new(0.4, 0.6)) >= first));
    }
}

#[test]
fn fronts_only_open_and_end_with_all_seams() {
    let (map, seams) = made(&VoronoiParams::DEFAULT, &[], [200, 150], 4);
    let profile = crate::raster::Profile::DEFAULT;
    let empty = crate::raster::DepthField::new(*map.frame());
    let mut full = empty.clone();
    seams.stamp(&mut full, &profile);
    let front = Front::new(&seams, Vec2::splat(0.5));
    let mut last = empty.clone();
    for i in 0..=10 {
        let mut field = empty.clone();
        seams.stamp_front(&mut field, &profile, &front, front.reach() * i as f32 / 10.0);
        let mut pairs = last.depth.as_slice().iter().zip(field.depth.as_slice());
        // Equal but for the last bits of the f32 arithmetic.
        assert!(pairs.all(|(&before, &now)| now.saturating_add(64) >= before), "a crack has closed at {i}");
        assert!(i == 10 || field != full);
        last = field;
    }
    assert!(last == full);
    let mut field = empty.clone();
    seams.stamp_front(&mut field, &profile, &front, -1.0);
    seams.stamp_share(&mut field, &profile, 0.0);
    assert!(field == empty);
    seams.stamp_share(&mut field, &profile, 7.0);
    assert!(field == full);
}

/// Strokes end in needles: no crack widens faster than by a slope, and none is alone as wide as it is where it meets others.
#[test]
fn strokes_run_out() {
    for seed in 0..6 {
        let mut rng = Rng::new(seed);
        let guide = Guide::new(drawing(&mut rng, UVec2::new(300, 200)));
        let (_, seams) = made(&VoronoiParams::DEFAULT, &[guide], [300, 200], seed);
        let mut widths = vec![Vec::new(); seams.vertices.len()];
        let (mut steepest, mut widest) = (0.0f32, 0.0f32);
        for seam in &seams.seams {
            widths[seam.from as usize].push(seam.points[0].width);
            widths[seam.to as usize].push(seam.points[seam.points.len() - 1].width);
            for pair in seam.points.windows(2) {
                let slope = (pair[1].width - pair[0].width).abs() / pair[0].pos.distance(pair[1].pos).max(1.0e-6);
                steepest = steepest.max(slope);
                widest = widest.max(pair[0].width);
            }
        }
        // The line is a little shorter than the way along all its texels.
        assert!(steepest < 0.3, "seed {seed}: {steepest}");
        assert!(widest > 0.01, "seed {seed}: no stroke is wide");
        for (vertex, mut widths) in seams.vertices.iter().zip(widths) {
            widths.sort_by(f32::total_cmp);
            if let [.., second, first] = widths[..]
                && !vertex.on_border
            {
                assert_eq!(first, second, "seed {seed} at {}", vertex.pos);
            }
        }
    }
}

/// A bar of this width and length at an angle.
fn bar(size: f32, width: f32, length: f32, angle: f32) -> Grid<f32> {
    let along = crate::math::ops::unit(angle);
    let mut image = Grid::new(UVec2::splat(size as u32), 0.0);
    for y in 0..size as usize {
        for (x, value) in image.row_mut(y).iter_mut().enumerate() {
            let off = Vec2::new(x as f32, y as f32) + 0.5 - 0.5 * size;
            let is_in = off.dot(along).abs() < 0.5 * length && off.perp_dot(along).abs() < 0.5 * width;
            *value = if is_in { 1.0 } else { 0.0 };
        }
    }
    image
}

/// Cracks that meet a broad stroke do not widen in it: no forks at its ends, no thorns on its sides, apart from the one crack that goes on at an
/// end.
#[test]
fn one_crack_goes_on_where_strokes_end() {
    const SIDE: f32 = 400.0;
    let mut rng = Rng::new(5);
    let (mut n_aside, mut n_thorns) = (0, 0);
    for seed in 0..24 {
        let (width, angle) = (rng.range(32.0, 44.0), rng.range(0.0, std::f32::consts::PI));
        let image = bar(SIDE, width, 200.0, angle);
        let params = VoronoiParams { layout: SiteLayout::StrokePairs, ..VoronoiParams::DEFAULT };
        let (_, seams) = made(&params, &[Guide::new(image.clone())], [400, 400], seed);
        let has_ink = |pos: Vec2| image.get(pos.x as u32, pos.y as u32) == Some(1.0);
        // For each vertex in the ink: the widest place of each crack in the ink, and how wide it is where it leaves it, texels.
        let mut widths = vec![Vec::new(); seams.vertices.len()];
        for seam in &seams.seams {
            let mut points: Vec<_> = seam.points.iter().map(|point| (point.pos * SIDE, point.width * SIDE)).collect();
            for vertex in [seam.from, seam.to] {
                let out = points.iter().position(|(pos, _)| !has_ink(*pos));
                let inside = &points[..out.unwrap_or(points.len())];
                let widest = inside.iter().map(|(_, width)| *width).fold(0.0, f32::max);
                // Cracks that stay in the ink are parts of the stroke.
                widths[vertex as usize].push((widest, out.map(|out| points[out].1)));
                points.reverse();
            }
        }
        for (vertex, widths) in seams.vertices.iter().zip(&mut widths) {
            widths.sort_by(|a, b| b.0.total_cmp(&a.0));
            if let [(first, _), _, others @ ..] = &widths[..]
                && has_ink(vertex.pos * SIDE)
                && *first > 0.2 * width
            {
                let others = others.iter().filter_map(|&(inside, outside)| Some((inside, inside - outside?)));
                n_aside += others.clone().count();
                // A branch loses its width on a longer way.
                let most = |inside: f32| (0.03 * width).max(if inside < 0.6 * first { 0.55 * inside } else { 0.0 });
                n_thorns += others.filter(|(inside, more)| *more > most(*inside)).count();
            }
        }
    }
    // If each crack had the width that its own path cost gives, it would be more than one in five.
    assert!(n_aside > 200 && 12 * n_thorns < n_aside, "{n_thorns} of {n_aside}");
}

/// Some cracks that leave a broad stroke are branches, which get thinner away from it, rarely more than one beside a region. A narrow stroke has none: few cracks are as wide by their own path cost.
#[test]
fn broad_strokes_have_branches() {
    const SIDE: f32 = 400.0;
    let (mut found, mut n_crowded) = ([0, 0], 0);
    for seed in 0..12 {
        for (width, found) in [40.0, 17.0].into_iter().zip(&mut found) {
            let image = bar(SIDE, width, 260.0, 0.3 * seed as f32);
            let params = VoronoiParams { layout: SiteLayout::StrokePairs, ..VoronoiParams::DEFAULT };
            let (_, seams) = made(&params, &[Guide::new(image.clone())], [400, 400], seed);
            let has_ink = |pos: Vec2| image.get((pos.x * SIDE) as u32, (pos.y * SIDE) as u32) == Some(1.0);
            let mut beside = BTreeMap::new();
            for seam in &seams.seams {
                let is_in = |vertex: u32| has_ink(seams.vertices[vertex as usize].pos);
                // From the stroke outward.
                let mut points = seam.points.clone();
                match (is_in(seam.from), is_in(seam.to)) {
                    (true, false) => {}
                    (false, true) => points.reverse(),
                    _ => continue,
                }
                let outside: Vec<_> = points.iter().skip_while(|point| has_ink(point.pos)).collect();
                // Far enough from the end of the stroke, where one crack goes on.
                let off = (points[0].pos - 0.5).dot(crate::math::ops::unit(0.3 * seed as f32)).abs();
                let Some(first) = outside.first() else { continue };
                let thinnest = outside.iter().map(|point| point.width).fold(first.width, f32::min);
                if off * SIDE < 90.0 && first.width > 2.0 * params.least_width && thinnest < 0.6 * first.width {
                    *found += 1;
                    *beside.entry(seam.left).or_insert(0) += 1;
                    *beside.entry(seam.right).or_insert(0) += 1;
                }
            }
            n_crowded += beside.values().filter(|count| **count > 1).count();
        }
    }
    assert!(found[0] >= 12 && 4 * found[1] <= found[0], "{found:?}");
    assert!(8 * n_crowded <= found[0], "{n_crowded} of {found:?}");
}
