//! Cracks that divide domains: the cells of the presets.

use super::{arrest::assert_planar, *};
use crate::{
    growth::{division::rim_towards, domain::AXES},
    pattern::{CellTracker, SurfaceFrame},
    raster::{DepthField, Profile, stamp_path},
};
use glam::UVec2;

const PRESETS: [(&str, CrackPreset); 4] = [
    ("tempered_glass", CrackPreset::TEMPERED_GLASS),
    ("clay", CrackPreset::CLAY),
    ("mud", CrackPreset::MUD),
    ("glaze", CrackPreset::GLAZE),
];

fn grown(preset: &CrackPreset, pos: Vec2, energy: f32, seed: u64) -> CrackGrowth {
    let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).unwrap();
    growth.hit(pos, energy);
    while growth.step().grew() {}
    growth
}

/// Per node: those that it is joined to.
fn joined(growth: &CrackGrowth) -> Vec<Vec<u32>> {
    let network = growth.network();
    let mut around = vec![Vec::new(); network.nodes().len()];
    for (a, b) in network.segments().filter_map(|segment| network.ends(segment)) {
        around[a as usize].push(b);
        around[b as usize].push(a);
    }
    around
}

/// Ends of cracks that meet nothing, and all ends of cracks.
fn free_ends(growth: &CrackGrowth) -> (usize, usize) {
    let network = growth.network();
    let on_border = |pos: Vec2| (pos.cmpeq(Vec2::ZERO) | pos.cmpeq(network.extent())).any();
    let around = joined(growth);
    let free =
        (0..around.len()).filter(|&node| around[node].len() == 1 && !on_border(network.nodes()[node].pos)).count();
    let border = network.nodes().iter().filter(|node| on_border(node.pos)).count();
    let met = network.links().iter().filter(|link| link.kind == LinkKind::Junction).count();
    (free, free + border + met)
}

fn length(growth: &CrackGrowth) -> f32 {
    let network = growth.network();
    let path = |segment| network.path(segment).unwrap();
    network.segments().map(|s| path(s).points().windows(2).map(|p| p[0].pos.distance(p[1].pos)).sum::<f32>()).sum()
}

fn angles(growth: &CrackGrowth) -> Vec<f32> {
    let (nodes, around) = (growth.network().nodes(), joined(growth));
    let mut angles = Vec::new();
    for link in growth.network().links().iter().filter(|link| link.kind == LinkKind::Junction) {
        let (end, tip) = (nodes[link.a as usize].pos, nodes[link.b as usize].pos);
        let others = around[link.a as usize].iter().filter(|&&node| node != link.b);
        let gap = |node: &u32| (nodes[*node as usize].pos - end).angle_to(tip - end).abs().to_degrees();
        if around[link.a as usize].len() == 3 {
            angles.extend(others.map(gap).min_by(f32::total_cmp));
        }
    }
    angles
}

fn median(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    values[values.len() / 2]
}

/// One hit for each seed, not near the border.
fn of_seeds(preset: &CrackPreset, energy: f32) -> impl Iterator<Item = CrackGrowth> {
    (0..24).map(move |seed| {
        let mut rng = Rng::new(seed).stream("where");
        grown(preset, Vec2::new(rng.range(0.3, 0.7), rng.range(0.3, 0.7)), energy, seed)
    })
}

/// Share of a square of 256 x 256 texels that lies within a crack.
fn covered(growth: &CrackGrowth) -> f32 {
    let mut field = DepthField::new(SurfaceFrame::new(UVec2::splat(256)).unwrap());
    let profile = Profile { depth: 1.0, full_width: 0.0005, rim_width: 0.0, rim_depth: 0.0, ..Profile::default() };
    for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
        stamp_path(&mut field, &profile, &path);
    }
    field.depth.as_slice().iter().map(|depth| f32::from(*depth) / 65535.0).sum::<f32>() / 65536.0
}

/// Nearly all cracks end at others or at the border, steeply, and none crosses another.
#[test]
fn cells_close() {
    for (name, preset) in PRESETS {
        let most_free = match name {
            "tempered_glass" => 0.0,
            "mud" => 0.15,
            "clay" => 0.05,
            _ => 0.02,
        };
        let (mut free, mut ends, mut all_angles) = (0, 0, Vec::new());
        for energy in [1.0, 4.0] {
            for (seed, growth) in of_seeds(&preset, energy).enumerate() {
                let (now_free, now) = free_ends(&growth);
                (free, ends) = (free + now_free, ends + now);
                all_angles.extend(angles(&growth));
                assert_planar(&growth, seed as u64);
            }
        }
        let angle = median(all_angles);
        println!("{name}: {free} of {ends} ends are free, median angle {angle:.1} degrees");
        assert!(free as f32 <= most_free * ends as f32, "{name}: {free} of {ends} ends are free");
        assert!((75.0..=105.0).contains(&angle), "{name}: {angle} degrees");
    }
}

/// Few cracks turn by more than 75 degrees within four segments.
#[test]
fn cracks_do_not_hook_round() {
    for (name, preset) in PRESETS.into_iter().filter(|(name, _)| *name != "tempered_glass") {
        let (mut hooks, mut all) = (0, 0);
        for growth in of_seeds(&preset, 2.0) {
            let nodes = growth.network().nodes();
            for node in 0..nodes.len() as u32 {
                let before = |node: &u32| Some(nodes[*node as usize].parent).filter(|&parent| parent != NO_PARENT);
                let line: Vec<u32> = std::iter::successors(Some(node), before).take(5).collect();
                if let [a, b, _, c, d] = line[..] {
                    let way = |from: u32, to: u32| nodes[to as usize].pos - nodes[from as usize].pos;
                    hooks += usize::from(way(b, a).angle_to(way(d, c)).abs().to_degrees() > 75.0);
                    all += 1;
                }
            }
        }
        println!("{name}: {hooks} hooks in {all}");
        assert!(all > 1000 && 100 * hooks < all, "{name}: {hooks} hooks in {all}");
    }
}

/// Where cracks begin with three arms, more cells have more sides than four.
#[test]
fn stars_have_three_arms() {
    for (stars, arms) in [(0.0, 2), (1.0, 3)] {
        let mut preset = CrackPreset::MUD;
        preset.growth.three_arm_share = stars;
        preset.growth.starts = StartLayout::Point;
        let starts = of_seeds(&preset, 1.0).filter(|growth| {
            let nodes = growth.network().nodes();
            nodes.iter().filter(|node| node.parent == 0).count() == arms
        });
        let count = starts.count();
        assert!(count >= 20, "{count} of 24 hits begin with {arms} arms");
    }
}

/// Straight cracks are nearly as long as the straight way between their ends, whatever their kinks.
#[test]
fn straight_cracks_run_straight() {
    let straightness = |steady: f32| {
        let mut preset = CrackPreset::MUD;
        preset.growth.straightness = steady;
        let mut shares = Vec::new();
        for growth in of_seeds(&preset, 2.0) {
            let (nodes, step) = (growth.network().nodes(), growth.params().step_length);
            for node in 0..nodes.len() as u32 {
                let before = |node: &u32| Some(nodes[*node as usize].parent).filter(|&parent| parent != NO_PARENT);
                if let Some(far) = std::iter::successors(Some(node), before).nth(12) {
                    shares.push(nodes[node as usize].pos.distance(nodes[far as usize].pos) / (12.0 * step));
                }
            }
        }
        median(shares)
    };
    let (bent, straight) = (straightness(0.0), straightness(1.0));
    assert!(straight > 0.93 && straight > bent, "{straight} of the way, {bent} else");
}

/// Cracks that thin out are thinner at the rim of what their hit has loaded, and as wide as others near the hit.
#[test]
fn cracks_thin_out() {
    let widths = |thinning: f32| {
        let mut preset = CrackPreset::CLAY;
        (preset.growth.thinning, preset.growth.width_variation) = (thinning, 0.0);
        let (mut near, mut far) = (Vec::new(), Vec::new());
        for growth in of_seeds(&preset, 1.0) {
            let hit = growth.impacts()[0].pos;
            let reach = growth.division.as_ref().unwrap().reach_of(0);
            for node in growth.network().nodes() {
                match node.pos.distance(hit) / reach {
                    ..0.3 => near.push(node.width),
                    0.8.. => far.push(node.width),
                    _ => {}
                }
            }
        }
        (near.iter().copied().fold(0.0, f32::max), far.iter().copied().fold(0.0, f32::max))
    };
    let (even, thin) = (widths(0.0), widths(0.8));
    assert!((thin.0 / even.0 - 1.0).abs() < 0.15 && thin.1 < 0.7 * even.1, "{even:?} and {thin:?}");
}

/// Of one generation some cracks are narrower than others, by what they are told at the most; each is alike along its way.
#[test]
fn cracks_of_a_generation_are_mixed() {
    let mut preset = CrackPreset::CLAY;
    for mixed in [0.0, 0.5] {
        preset.growth.width_variation = mixed;
        let growth = grown(&preset, Vec2::splat(0.5), 4.0, 3);
        let division = growth.division.as_ref().unwrap();
        let nodes = growth.network().nodes();
        let mut shares = Vec::new();
        for node in (0..nodes.len() as u32).filter(|&node| division.generation_of(node) == 0) {
            let parent = nodes[node as usize].parent;
            shares.push(division.share(node));
            assert!(parent == NO_PARENT || division.share(parent) == division.share(node));
        }
        let least = shares.iter().copied().fold(1.0, f32::min);
        assert!(least >= 1.0 - mixed && (mixed == 0.0 || least < 1.0 - 0.5 * mixed), "{least} of {mixed}");
    }
}

/// Dice all over the pane, finer at the hit, from there outward, whatever the energy.
#[test]
fn tempered_glass_goes_to_dice() {
    let mut lengths = Vec::new();
    for energy in [1.0, 8.0] {
        for (seed, growth) in of_seeds(&CrackPreset::TEMPERED_GLASS, energy).enumerate() {
            let mut tracker = CellTracker::new(Vec2::ONE);
            tracker.update(growth.network());
            let cells = tracker.cells();
            assert!((2000..=3000).contains(&cells.len()), "seed {seed}: {} cells", cells.len());
            let size = |cell: &crate::pattern::Cell| 768.0 * cell.area.sqrt();
            let mut sizes: Vec<f32> = cells.iter().map(size).collect();
            sizes.sort_by(f32::total_cmp);
            let of = |share: f32| sizes[(share * sizes.len() as f32) as usize];
            assert!((12.0..=18.0).contains(&of(0.5)), "seed {seed}: {} texels", of(0.5));
            assert!(of(0.05) > 6.0 && of(0.95) < 25.0, "seed {seed}: {} to {} texels", of(0.05), of(0.95));
            let hit = growth.impacts()[0].pos;
            let near = cells.iter().filter(|cell| cell.centroid.distance(hit) < 0.06).map(|cell| cell.area).collect();
            let far = cells.iter().filter(|cell| cell.centroid.distance(hit) > 0.2).map(|cell| cell.area).collect();
            assert!(median(near) < median(far), "seed {seed}: no finer at the hit");
            // One front: later is further out.
            let nodes = growth.network().nodes();
            let tenth = growth.steps() / 10 + 1;
            let away = |i: u32| {
                let born = nodes.iter().filter(|node| node.birth / tenth == i);
                born.map(|node| node.pos.distance(hit)).collect::<Vec<_>>()
            };
            let fronts: Vec<f32> = (0..8).map(|i| median(away(i))).collect();
            assert!(fronts.windows(2).all(|pair| pair[0] < pair[1]), "seed {seed}: {fronts:?}");
            lengths.push(length(&growth));
        }
    }
    let (least, most) = (median(lengths[..24].to_vec()), median(lengths[24..].to_vec()));
    assert!((most / least - 1.0).abs() < 0.02, "{least} and {most}");
}

/// The energy decides how much cracks, not the seed.
#[test]
fn energy_decides_how_much_is_divided() {
    for (name, preset) in PRESETS.into_iter().filter(|(name, _)| *name != "tempered_glass") {
        let mut found: Vec<(f32, f32)> = Vec::new();
        for energy in [0.5, 1.0, 2.0, 4.0, 8.0] {
            let all: Vec<CrackGrowth> = of_seeds(&preset, energy).collect();
            let lengths: Vec<f32> = all.iter().map(length).collect();
            let mean = lengths.iter().sum::<f32>() / lengths.len() as f32;
            let variance = lengths.iter().map(|length| (length - mean) * (length - mean)).sum::<f32>() / 24.0;
            let variation = variance.sqrt() / mean;
            let now = (median(lengths), median(all.iter().map(covered).collect()));
            println!(
                "{name} at {energy}: {:.2} long, {:.2} % covered, varying by {variation:.2}",
                now.0,
                100.0 * now.1
            );
            assert!(variation <= 0.25, "{name} at {energy}: varies by {variation}");
            assert!(
                found.last().is_none_or(|before| now.0 > before.0 && now.1 > before.1),
                "{name} at {energy}: {now:?}"
            );
            found.push(now);
        }
        let (one, eight) = (found[1], found[4]);
        assert!(eight.0 >= 2.5 * one.0 && eight.1 >= 2.5 * one.1, "{name}: {eight:?} from {one:?}");
    }
}

/// Each generation is about half as wide as the one before.
#[test]
fn generations_are_of_their_widths() {
    for (name, preset, shares) in [
        ("clay", CrackPreset::CLAY, &[0.5, 0.25][..]),
        ("mud", CrackPreset::MUD, &[0.5, 0.25]),
        ("glaze", CrackPreset::GLAZE, &[0.5, 0.25]),
    ] {
        let mut widths = vec![Vec::new(); shares.len() + 1];
        for growth in of_seeds(&preset, 4.0) {
            let division = growth.division.as_ref().unwrap();
            let nodes = growth.network().nodes();
            for node in (0..nodes.len() as u32).filter(|&node| nodes[node as usize].parent != NO_PARENT) {
                widths[usize::from(division.generation_of(node))].push(nodes[node as usize].width);
            }
        }
        let widths: Vec<f32> = widths.into_iter().map(median).collect();
        println!("{name}: {widths:?}");
        for (width, share) in widths[1..].iter().zip(shares) {
            assert!((width / widths[0] / share - 1.0).abs() < 0.3, "{name}: {widths:?}");
        }
    }
}

/// Where there are places for more cracks and none can start, growth ends and does not wait: where no crack starts by itself, and where there is
/// room for a node or two.
#[test]
fn growth_ends_where_no_crack_can_start() {
    let num_iterations = 20_000;
    let mut nearly_full = 0;
    for (name, preset) in PRESETS {
        let params = GrowthParams { nucleation: 0.0, num_iterations, ..preset.growth.clone() };
        let mut growth = CrackGrowth::new(params, Vec2::ONE, 3).unwrap();
        growth.hit(Vec2::splat(0.5), 1.0);
        while growth.step().grew() {}
        assert!(growth.steps() < 2000 && growth.network().nodes().len() > 4, "{name}: {} steps", growth.steps());
        // One crack after the other, until there is room for no other.
        for (seed, max_nodes) in (0..4).flat_map(|seed| (40..140).map(move |max_nodes| (seed, max_nodes))) {
            let params = GrowthParams { max_nodes, num_iterations, nucleation: 0.05, ..preset.growth.clone() };
            let mut growth = CrackGrowth::new(params, Vec2::ONE, seed).unwrap();
            growth.hit(Vec2::splat(0.5), 1.0);
            while growth.step().grew() {}
            nearly_full += u32::from((1..3).contains(&growth.room()));
            assert!(growth.steps() < 2000, "{name}, {max_nodes} nodes: {} steps", growth.steps());
        }
    }
    assert!(nearly_full > 5, "{nearly_full}");
}

/// A marker whose distance is what its generation allows, but for rounding of its square, does not keep the next generation from its turn.
#[test]
fn a_marker_at_the_limit_does_not_hold_up_growth() {
    let mut params = GrowthParams {
        generations: 2,
        focus: 0.0,
        thinning: 0.0,
        patchiness: 0.0,
        variety: 0.0,
        num_iterations: 20_000,
        ..CrackPreset::MUD.growth
    };
    let limit_of = |params: &GrowthParams| params.loaded(0, 0.0, f32::INFINITY);
    while (limit_of(&params) * limit_of(&params)).next_up().sqrt() > limit_of(&params) {
        params.kill_distance *= 1.001;
    }
    let limit = limit_of(&params);
    let mut growth = CrackGrowth::new(params, Vec2::ONE, 3).unwrap();
    growth.set_density(Some(Grid::new(UVec2::ONE, 0.0)));
    growth.hit(Vec2::splat(0.5), 1.0);
    while growth.step().grew() {}
    let nearest_sq = |pos: Vec2| {
        let nodes = growth.network().nodes().iter().map(|node| node.pos.distance_squared(pos));
        nodes.fold(f32::INFINITY, f32::min)
    };
    let mut rng = Rng::new(8);
    let nodes = growth.network().nodes();
    let place = (0..1_000_000).find_map(|_| {
        let way = Vec2::new(rng.signed(), rng.signed()).normalize_or(Vec2::X);
        let pos = nodes[rng.next_u32() as usize % nodes.len()].pos + way * (limit * (1.0 + 1e-6 * rng.signed()));
        let near_sq = nearest_sq(pos);
        (near_sq > limit * limit && near_sq.sqrt() <= limit).then_some(pos)
    });
    growth.field.add(place.unwrap(), 0, f32::INFINITY);
    growth.division.as_mut().unwrap().generation = 0;
    let before = growth.steps();
    growth.steps_left = 20_000;
    while growth.step().grew() {}
    assert!(growth.steps() - before < 1000, "{} steps", growth.steps() - before);
    assert_eq!(growth.division.as_ref().unwrap().generation, 1);
}

/// What markers, cracks and tips know of each other, against all of them looked through, after every step.
#[test]
fn what_is_known_equals_brute_force() {
    let (mut markers, mut goals, mut sights) = (0, 0, 0);
    for (name, preset) in PRESETS {
        for seed in 0..3u64 {
            let mut rng = Rng::new(seed).stream("brute force");
            let mut params = preset.growth.clone();
            if name == "tempered_glass" {
                params = params.scaled(4.0);
                params.reach = 64.0;
            }
            let mut growth = CrackGrowth::new(params, Vec2::new(1.2, 1.0), seed).unwrap();
            for _ in 0..2 {
                growth.hit(Vec2::new(1.2 * rng.unit(), rng.unit()), rng.range(0.5, 1.5));
                // What the border and the rim leave each marker, before any crack is seen.
                while growth.step().grew() {
                    let (nodes, p) = (growth.network().nodes(), growth.params());
                    let nearest = |pos: Vec2| {
                        nodes
                            .iter()
                            .map(|node| node.pos.distance_squared(pos))
                            .fold(p.crack_radius * p.crack_radius, f32::min)
                    };
                    growth.field.each_living(|pos, near_sq, impact| {
                        let hit = growth.impacts()[impact as usize];
                        let reach = growth.division.as_ref().unwrap().reach_of(impact);
                        let rim = rim_towards(pos - hit.pos, reach, seed ^ u64::from(impact)) - pos.distance(hit.pos);
                        let free = pos.min(growth.network().extent() - pos).min_element().min(rim);
                        assert_eq!(near_sq, nearest(pos).min(free.max(0.0) * free), "{name} {seed}: {pos}");
                        markers += 1;
                    });
                    // Markers of its own: those that have no nearer node.
                    let node = &nodes[nodes.len() - 1];
                    let (mut own, mut expected) = (Vec::new(), Vec::new());
                    growth.field.each_own(node.pos, |pos, _| own.push(pos.to_array().map(f32::to_bits)));
                    growth.field.each_living(|pos, near_sq, _| {
                        let distance_sq = node.pos.distance_squared(pos);
                        if distance_sq == near_sq && distance_sq < p.crack_radius * p.crack_radius {
                            expected.push(pos.to_array().map(f32::to_bits));
                        }
                    });
                    own.sort_unstable();
                    expected.sort_unstable();
                    assert_eq!(own, expected, "{name} {seed}");
                    // Where cracks may start: the same as without what the searches before have ruled out.
                    for is_idle in [false, true] {
                        let (mut known, mut fresh) = (growth.clone(), growth.clone());
                        fresh.field.seek_again();
                        assert_eq!(known.candidates(is_idle), fresh.candidates(is_idle), "{name} {seed}");
                    }
                    // What a place sees along its axes: every straight line that each axis crosses.
                    let at = Vec2::new(1.2 * rng.unit(), rng.unit());
                    let turn = 3.0 * rng.unit();
                    let axes: [Vec2; AXES] = std::array::from_fn(|i| Vec2::from_angle(turn + 0.39 * i as f32));
                    let far = rng.range(0.02, 0.3);
                    let sight = growth.look_around(at, &axes, far);
                    for (i, axis) in axes.iter().enumerate() {
                        for (side, way) in [*axis, -*axis].into_iter().enumerate() {
                            let crossed = |segment| {
                                let path = growth.network().path(segment).unwrap();
                                let [from, to] = [0, path.points().len() - 1].map(|k| path.points()[k].pos.as_dvec2());
                                let (from, line, way) = (from - at.as_dvec2(), to - from, way.as_dvec2());
                                let share = -way.perp_dot(from) / way.perp_dot(line);
                                let distance = way.dot(from + line * share);
                                ((0.0..=1.0).contains(&share) && distance >= 0.0).then_some(distance)
                            };
                            let nearest = growth.network().segments().filter_map(crossed).fold(f64::INFINITY, f64::min);
                            // Beyond what was asked for lines may be seen or not.
                            let seen = f64::from(sight[side].distance[i]);
                            let is_so = (seen - nearest).abs() < 1e-4
                                || seen > f64::from(far) - 1e-4 && nearest > f64::from(far) - 1e-4;
                            assert!(is_so, "{name} {seed}: {seen} for {nearest}");
                            sights += usize::from(nearest < f64::from(far));
                        }
                    }
                    // The crack that a tip would make for.
                    let heading = growth.heading_of(nodes.len() as u32 - 1);
                    let mut best = (f32::INFINITY, u32::MAX, 0.0);
                    for (i, other) in (0u32..).zip(nodes) {
                        let way = other.pos - node.pos;
                        let distance_sq = node.pos.distance_squared(other.pos);
                        let (along, distance) = (way.dot(heading), distance_sq.sqrt());
                        let is_ahead = distance > 0.0 && distance_sq <= p.arrest * p.arrest && along >= 0.5 * distance;
                        if is_ahead && !is_of_one_crack(&growth, nodes.len() as u32 - 1, i) {
                            let rank = distance_sq * distance / along.max(0.1 * distance);
                            if (rank, i) < (best.0, best.1) {
                                best = (rank, i, distance);
                            }
                        }
                    }
                    let expected = (best.1 != u32::MAX).then_some((best.2, best.1));
                    let found = growth.foreign(nodes.len() as u32 - 1, Some(heading), p.arrest, 0.5);
                    assert_eq!(found, expected, "{name} {seed}");
                    goals += usize::from(found.is_some());
                }
            }
        }
    }
    println!("{markers} markers, {goals} goals, {sights} sights");
    assert!(markers > 100_000 && goals > 200 && sights > 2000, "{markers} markers, {goals} goals, {sights} sights");
}

/// Whether two nodes are of one crack, few segments from each other; a crack's nodes are a tree.
fn is_of_one_crack(growth: &CrackGrowth, one: u32, other: u32) -> bool {
    let (nodes, p) = (growth.network().nodes(), growth.params());
    let line =
        |node: u32| std::iter::successors(Some(node), |&n| Some(nodes[n as usize].parent).filter(|&n| n != NO_PARENT));
    let most = (3.0 * p.arrest.max(p.island_distance) / p.step_length) as usize + 2;
    let met = line(one).enumerate().find_map(|(i, a)| line(other).position(|b| a == b).map(|j| i + j));
    nodes[one as usize].impact == nodes[other as usize].impact && met.is_some_and(|apart| apart <= most)
}
