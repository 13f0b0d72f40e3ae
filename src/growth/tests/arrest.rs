//! Cracks that mind each other, foreign ones, and masks.

use super::{random_extent, random_params};
use crate::growth::{CrackGrowth, GrowthParams, HitOutcome, Rejected, Venation};
use crate::{
    CrackPreset, Grid,
    math::Rng,
    pattern::{CrackMask, LinkKind, Moment, NO_IMPACT, NO_PARENT, SegmentId, SurfaceFrame},
    raster::{DepthField, Profile, stamp_path},
    voronoi::{VoronoiBake, VoronoiParams},
};
use glam::{UVec2, Vec2};
use std::sync::Arc;

/// Random parameters with arrest.
pub(super) fn random_arrest(rng: &mut Rng) -> GrowthParams {
    let params = random_params(rng, true);
    let step_length = rng.range(0.012, 0.05);
    let crack_radius = rng.range(0.08, 0.6).max(2.0 * step_length);
    GrowthParams {
        step_length,
        crack_radius,
        kill_distance: rng.range(0.01, 0.07).min(crack_radius),
        venation: match rng.next_u32() % 6 {
            0 | 1 => Venation::Closed,
            2 | 3 => Venation::Subdivision,
            _ => Venation::Open,
        },
        front: if rng.unit() < 0.5 { 0.0 } else { rng.range(0.005, 0.1) },
        arrest: rng.range(0.01, 0.12),
        inertia: if rng.unit() < 0.3 { 0.0 } else { rng.range(0.0, 6.0) },
        nucleation: if rng.unit() < 0.5 { 0.0 } else { rng.range(0.0, 3.0) },
        open_ends: if rng.unit() < 0.5 { 0.0 } else { rng.unit() },
        // A crack that strays by more at every node has no direction that another could meet steeply.
        wander: params.wander.min(0.5),
        tip_taper: 9.0 * rng.unit(),
        unevenness: 0.9 * rng.unit(),
        axis: 3.0 * rng.signed(),
        directed: if rng.unit() < 0.5 { 0.0 } else { rng.unit() },
        reach: rng.range(0.3, 1.5),
        max_nodes: 3000,
        ..params
    }
}

/// All pieces of all drawn lines, with the nodes that the first and the last of a line lie at.
fn pieces(growth: &CrackGrowth) -> Vec<(Vec2, Vec2, [Option<u32>; 2])> {
    let mut pieces = Vec::new();
    for segment in growth.network().segments() {
        let (a, b) = growth.network().ends(segment).unwrap();
        let path = growth.network().path(segment).unwrap();
        let last = path.points().len() - 2;
        for (i, pair) in path.points().windows(2).enumerate() {
            pieces.push((pair[0].pos, pair[1].pos, [(i == 0).then_some(a), (i == last).then_some(b)]));
        }
    }
    pieces
}

fn cross(one: (Vec2, Vec2), other: (Vec2, Vec2)) -> bool {
    let side = |p: Vec2, q: Vec2, r: Vec2| (q - p).as_dvec2().perp_dot((r - p).as_dvec2());
    let (a, b, c, d) = (one.0, one.1, other.0, other.1);
    let apart = |k: usize| a[k].max(b[k]) < c[k].min(d[k]) || c[k].max(d[k]) < a[k].min(b[k]);
    if apart(0) || apart(1) {
        return false;
    }
    side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
}

/// No two lines touch but at a shared node, and no two nodes are joined twice; returns how many pairs were compared.
pub(super) fn assert_planar(growth: &CrackGrowth, case: u64) -> u64 {
    let mut pairs = 0;
    let pieces = pieces(growth);
    let mut ends = std::collections::BTreeSet::new();
    for (a, b) in growth.network().segments().filter_map(|segment| growth.network().ends(segment)) {
        assert!(ends.insert((a.min(b), a.max(b))), "case {case}: {a} and {b} are joined twice");
    }
    for (from, to, _) in &pieces {
        assert!(from != to, "case {case}: a piece without length at {from}");
    }
    // By the left end, so that only what overlaps is compared.
    let mut order: Vec<usize> = (0..pieces.len()).collect();
    order.sort_by(|&a, &b| pieces[a].0.x.min(pieces[a].1.x).total_cmp(&pieces[b].0.x.min(pieces[b].1.x)));
    for (k, &i) in order.iter().enumerate() {
        let right = pieces[i].0.x.max(pieces[i].1.x);
        for &j in order[k + 1..].iter().take_while(|&&j| pieces[j].0.x.min(pieces[j].1.x) <= right) {
            let shares = |end: Option<u32>| end.is_some() && pieces[j].2.contains(&end);
            // Pieces next to each other come one after the other; no two other pieces share a point.
            let follow = i.abs_diff(j) == 1 && (pieces[i].0 == pieces[j].1 || pieces[i].1 == pieces[j].0);
            if pieces[i].2.into_iter().any(shares) || follow {
                continue;
            }
            pairs += 1;
            let (one, other) = ((pieces[i].0, pieces[i].1), (pieces[j].0, pieces[j].1));
            assert!(!cross(one, other), "case {case}: {one:?} crosses {other:?}");
        }
    }
    pairs
}

#[test]
fn no_two_cracks_cross_and_junctions_are_steep() {
    let mut angles = Vec::new();
    let mut pairs = 0u64;
    for case in 0..1000u64 {
        let mut rng = Rng::new(case).stream("arrest");
        let params = random_arrest(&mut rng);
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params, extent, case).unwrap();
        for _ in 0..3 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, rng.range(0.3, 2.0));
            for _ in 0..rng.next_u32() % 200 {
                growth.step();
            }
        }
        while growth.step().grew() {}
        pairs += assert_planar(&growth, case);
        // T-junctions: a crack that ends at a node in the middle of another.
        let (nodes, mut around) = (growth.network().nodes(), vec![Vec::new(); growth.network().nodes().len()]);
        for (a, b) in growth.network().segments().filter_map(|segment| growth.network().ends(segment)) {
            around[a as usize].push(b);
            around[b as usize].push(a);
        }
        for link in growth.network().links().iter().filter(|link| link.kind == LinkKind::Junction) {
            let (end, tip) = (nodes[link.a as usize].pos, nodes[link.b as usize].pos);
            let through: Vec<_> = around[link.a as usize].iter().filter(|&&node| node != link.b).collect();
            if let [one, other] = through[..] {
                let (one, other) = (nodes[*one as usize].pos, nodes[*other as usize].pos);
                let (along, coming) = ((other - one).normalize(), (tip - end).normalize());
                angles.push(along.dot(coming).abs().clamp(0.0, 1.0).acos().to_degrees());
            }
        }
    }
    angles.sort_by(f32::total_cmp);
    let median = angles[angles.len() / 2];
    println!("{pairs} pairs of pieces, {} T-junctions, median angle {median:.1} degrees", angles.len());
    // The smaller of the two angles, so at most 90.
    assert!(median > 70.0, "median angle {median}");
    assert!(angles.len() > 800, "only {} T-junctions", angles.len());
}

#[test]
fn cracks_of_the_presets_do_not_cross() {
    let mut pairs = 0;
    for preset in CrackPreset::NAMES.iter().filter_map(|name| CrackPreset::named(name)) {
        for seed in 0..12 {
            let mut rng = Rng::new(seed).stream("presets");
            let extent = if seed % 3 == 0 { Vec2::new(3.0, 1.0) } else { Vec2::ONE };
            let mut growth = CrackGrowth::new(preset.growth.clone(), extent, seed).unwrap();
            for _ in 0..3 {
                growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, rng.range(0.5, 2.0));
                while growth.step().grew() {}
            }
            pairs += assert_planar(&growth, seed);
        }
    }
    assert!(pairs > 1_000_000, "only {pairs} pairs of pieces");
}

#[test]
fn always_ends_with_arrest_and_closed_venation() {
    for case in 0..2_000u64 {
        let mut rng = Rng::new(case).stream("ends with arrest");
        let mut params = GrowthParams { max_nodes: 1_000_000, ..random_arrest(&mut rng) };
        if rng.unit() < 0.4 {
            params.arrest = 0.0;
        }
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        for _ in 0..2 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, 4.0 * rng.unit());
            for _ in 0..rng.next_u32() % 30 {
                growth.step();
            }
        }
        let starts = growth.network().nodes().iter().filter(|node| node.parent == NO_PARENT).count() as u64;
        let bound = params.most_nodes(u64::from(growth.marker_counts().total), starts);
        while growth.step().grew() {
            assert!((growth.network().nodes().len() as u64) < bound, "case {case}: {params:?}");
        }
        let census = growth.marker_counts();
        assert!(!growth.is_growing(), "case {case}");
        assert_eq!(census.attracting, 0, "case {case}: {params:?}");
        assert_eq!(census.killed + census.waiting, census.total, "case {case}: {census:?}");
    }
}

/// Seams of a random map, as a network.
fn random_seams(rng: &mut Rng, extent: Vec2, seed: u64) -> crate::pattern::Network {
    let params = VoronoiParams { sites: 3 + rng.next_u32() % 30, ..VoronoiParams::DEFAULT };
    let size = (extent * rng.range(40.0, 120.0)).as_uvec2();
    let (_, seams) = VoronoiBake::new(params, Vec::new(), size, seed).unwrap().finish();
    seams.network(Vec2::new(rng.unit(), rng.unit()) * extent)
}

#[test]
fn added_cracks_are_walls() {
    let (mut met, mut sprouted) = (0, 0);
    for case in 0..150u64 {
        let mut rng = Rng::new(case).stream("added");
        let extent = Vec2::new(rng.range(1.0, 1.6), 1.0);
        let mut growth = CrackGrowth::new(random_arrest(&mut rng), extent, case).unwrap();
        let seams = random_seams(&mut rng, extent, case);
        growth.add_cracks(&seams, rng.next_u32() % 4);
        let n = growth.network().nodes().len();
        assert_eq!(n, seams.nodes().len());
        // Everywhere, and on a seam.
        growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, rng.range(0.3, 2.0));
        growth.hit(growth.network().nodes()[rng.next_u32() as usize % n].pos, 1.0);
        while growth.step().grew() {}
        assert_planar(&growth, case);
        let nodes = growth.network().nodes();
        let is_seam = |node: u32| (node as usize) < n;
        met += growth.network().links().iter().filter(|link| is_seam(link.a) != is_seam(link.b)).count();
        sprouted += nodes[n..].iter().filter(|node| node.parent != NO_PARENT && is_seam(node.parent)).count();
        assert!(
            nodes[n..].iter().all(|node| node.impact < 2) && nodes[..n].iter().all(|node| node.impact == NO_IMPACT)
        );
    }
    assert!(met > 150 && sprouted > 50, "{met} cracks ended at seams, {sprouted} began there");
}

#[test]
fn added_cracks_come_as_their_network_says() {
    for case in 0..20u64 {
        let mut rng = Rng::new(case).stream("added");
        let extent = Vec2::new(rng.range(1.0, 1.6), 1.0);
        let opening = rng.next_u32() % 20;
        let mut growth =
            CrackGrowth::new(GrowthParams { max_nodes: 50, ..GrowthParams::DEFAULT }, extent, case).unwrap();
        let seams = random_seams(&mut rng, extent, case);
        let steps = growth.add_cracks(&seams, opening);
        let last = seams.nodes().iter().map(|node| node.birth).max().unwrap();
        assert_eq!(steps, last + opening + 1);
        let (network, timeline) = (growth.network(), growth.timeline());
        assert_eq!((timeline.end(), growth.steps()), (steps, steps));
        for (i, (node, seam)) in (0u32..).zip(network.nodes().iter().zip(seams.nodes())) {
            let place = seam.pos / seams.extent() * extent;
            assert!(node.pos.distance(place) < 1e-5 && node.width == seam.width && node.parent == seam.parent);
            let on_border = |pos: Vec2, extent: Vec2| (pos.cmpeq(Vec2::ZERO) | pos.cmpeq(extent)).any();
            assert_eq!(on_border(node.pos, extent), on_border(seam.pos, seams.extent()), "{node:?}");
            let width = |step: u32| timeline.width_at(i, Moment::after(step)).unwrap();
            assert_eq!(width(seam.birth + 1 + opening), seam.width);
            for age in 0..opening {
                let expected = seam.width * (age + 1) as f32 / (opening + 1) as f32;
                assert!((width(seam.birth + 1 + age) - expected).abs() < 1e-6);
            }
            let segment = SegmentId::Branch(i);
            if seam.parent != NO_PARENT {
                assert!(timeline.path_at(network, segment, Moment::after(seam.birth)).is_none());
                assert_eq!(timeline.path_at(network, segment, Moment::after(steps)), network.path(segment));
            }
        }
        let mut changed = Vec::new();
        growth.take_changed(&mut changed);
        changed.sort_unstable();
        assert_eq!(changed, growth.network().segments().collect::<Vec<_>>(), "each segment once");
        // They leave room for as many nodes as before.
        let n = growth.network().nodes().len();
        assert!(matches!(growth.hit(0.5 * extent, 4.0), HitOutcome::Started(_)));
        while growth.step().grew() {}
        assert_eq!(growth.network().nodes().len(), n + 50);
    }
}

/// Every segment is told of and has its time, also the link of a hit where there is room for nothing else.
#[test]
fn crowded_hits_are_told_of() {
    for case in 0..400u64 {
        let mut rng = Rng::new(case).stream("crowded");
        let params = GrowthParams { reach: 0.1, crack_radius: 0.2, arrest: 0.1, ..random_arrest(&mut rng) };
        let mut growth = CrackGrowth::new(params, Vec2::ONE, case).unwrap();
        let (mut changed, mut told) = (Vec::new(), std::collections::BTreeSet::new());
        for hit in 0..12 {
            growth.hit(Vec2::new(rng.range(0.35, 0.65), rng.range(0.35, 0.65)), 0.02);
            while growth.step().grew() {}
            growth.take_changed(&mut changed);
            told.extend(changed.drain(..));
            let (network, timeline) = (growth.network(), growth.timeline());
            let is_whole = |&segment: &SegmentId| told.contains(&segment) && timeline.step_of(segment).is_some();
            assert_eq!(network.segments().find(|segment| !is_whole(segment)), None, "case {case}, hit {hit}");
        }
    }
}

/// Forbidden texels hold no line, and, with the field that keeps them, no depth.
#[test]
fn forbidden_texels_hold_no_crack() {
    let mut drawn = 0;
    for case in 0..120u64 {
        let mut rng = Rng::new(case).stream("forbidden");
        let mut params = random_arrest(&mut rng);
        if rng.unit() < 0.5 {
            params.arrest = 0.0;
        }
        let side = 8 + rng.next_u32() % 40;
        let mut forbidden = Grid::new(UVec2::splat(side), 0.0);
        for texel in forbidden.as_mut_slice() {
            *texel = if rng.unit() < 0.15 { 1.0 } else { 0.0 };
        }
        let mask = Arc::new(CrackMask { forbidden: Some(forbidden), ..CrackMask::default() });
        let mut growth = CrackGrowth::new(params, Vec2::ONE, case).unwrap();
        growth.set_mask(mask.clone());
        for _ in 0..3 {
            let at = Vec2::new(rng.unit(), rng.unit());
            let outcome = growth.hit(at, 1.0);
            assert_eq!(outcome == HitOutcome::Rejected(Rejected::Forbidden), mask.is_forbidden(at), "case {case}");
            while growth.step().grew() {}
        }
        let mut field = DepthField::new(SurfaceFrame::new(UVec2::splat(160)).unwrap());
        field.set_forbidden(&mask);
        for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
            for pair in path.points().windows(2) {
                // Far finer than a texel of the mask.
                for i in 0..=50 {
                    let at = pair[0].pos.lerp(pair[1].pos, i as f32 / 50.0);
                    let inner = [Vec2::new(1e-5, 1e-5), Vec2::new(-1e-5, -1e-5)];
                    let is_inside = inner.iter().all(|&nudge| mask.is_forbidden(at + nudge));
                    assert!(!is_inside, "case {case}: a line enters a forbidden texel at {at}");
                }
            }
            stamp_path(&mut field, &Profile::default(), &path);
            drawn += 1;
        }
        for y in 0..160 {
            for x in 0..160 {
                let uv = (Vec2::new(x as f32, y as f32) + 0.5) / 160.0;
                assert!(!mask.is_forbidden(uv) || field.depth.get(x, y) == Some(0), "case {case}: {x} {y} is cracked");
            }
        }
    }
    assert!(drawn > 3000, "only {drawn} segments");
}
