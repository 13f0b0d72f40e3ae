//! Cracks that divide domains: the cells of the presets.

use super::*;
use crate::pattern::CellTracker;

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

#[test]
fn measure() {
    for (name, preset) in PRESETS {
        let mut free = (0, 0);
        let (mut worst, mut cells, mut all_angles, mut lengths) = (0.0f32, Vec::new(), Vec::new(), Vec::new());
        for seed in 0..24 {
            let mut rng = Rng::new(seed).stream("measure");
            let growth = grown(&preset, Vec2::new(rng.range(0.3, 0.7), rng.range(0.3, 0.7)), 1.0, seed);
            let (f, n) = free_ends(&growth);
            free = (free.0 + f, free.1 + n);
            worst = worst.max(f as f32 / n as f32);
            let mut tracker = CellTracker::new(Vec2::ONE);
            tracker.update(growth.network());
            cells.push(tracker.closed());
            all_angles.extend(angles(&growth));
            lengths.push(length(&growth));
        }
        cells.sort_unstable();
        all_angles.sort_by(f32::total_cmp);
        let mean = lengths.iter().sum::<f32>() / 24.0;
        let cv = (lengths.iter().map(|l| (l - mean) * (l - mean)).sum::<f32>() / 23.0).sqrt() / mean;
        println!(
            "{name}: free {free:?} {:.3} worst {worst:.3}, cells {}..{}..{}, angle {:.1} (10% {:.1}), length {mean:.2} cv {cv:.3}",
            free.0 as f32 / free.1 as f32,
            cells[0],
            cells[12],
            cells[23],
            all_angles[all_angles.len() / 2],
            all_angles[all_angles.len() / 10]
        );
        for energy in [0.5, 1.0, 2.0, 4.0, 8.0, 16.0] {
            let mut found: Vec<f32> =
                (0..8).map(|seed| length(&grown(&preset, Vec2::new(0.45, 0.5), energy, seed))).collect();
            found.sort_by(f32::total_cmp);
            print!(" e{energy}: {:.2}", found[4]);
        }
        println!();
    }
}

#[test]
fn time_steps() {
    let mut old = CrackPreset::TEMPERED_GLASS;
    old.growth = GrowthParams {
        kill_distance: 0.0145, step_length: 0.0075, crack_radius: 0.055, markers: MarkerLayout::DartThrowing { spacing: 0.034 },
        venation: Venation::Closed, reach: 64.0, starts: StartLayout::Crushed { count: 14, radius: 0.011 }, line_width: 0.0032,
        line_growth: 0.1, max_width: 0.016, unevenness: 0.35, directed: 0.25, wander: 0.072, roughness: 0.06, arrest: 0.019,
        open_ends: 0.18, nucleation: 0.7, variety: 0.35, max_nodes: 40_000, ..GrowthParams::DEFAULT
    };
    let mut old_mud = CrackPreset::MUD;
    old_mud.growth = GrowthParams {
            kill_distance: 0.0285, step_length: 0.0154, crack_radius: 0.089, markers: MarkerLayout::DartThrowing { spacing: 0.056 },
            venation: Venation::Closed, reach: 3.0, starts: StartLayout::Points { count: 3 }, line_width: 0.0083, line_growth: 0.157,
            murray: 2.28, max_width: 0.04, unevenness: 0.33, directed: 0.17, wander: 0.06, roughness: 0.032, arrest: 0.035,
            open_ends: 0.025, nucleation: 0.44, variety: 0.48, ..GrowthParams::DEFAULT
    };
    for (name, preset) in PRESETS.into_iter().chain([("old tempered", old), ("old mud", old_mud)]) {
        let mut least: Vec<f64> = Vec::new();
        let mut nodes = 0;
        for _ in 0..12 {
            let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, 3).unwrap();
            let start = std::time::Instant::now();
            growth.hit(Vec2::splat(0.5), 4.0);
            let mut took = vec![start.elapsed().as_secs_f64()];
            loop {
                let start = std::time::Instant::now();
                let grew = growth.step().grew();
                took.push(start.elapsed().as_secs_f64());
                if !grew {
                    break;
                }
            }
            if least.is_empty() { least = took.clone(); }
            least.iter_mut().zip(&took).for_each(|(a, b)| *a = a.min(*b));
            nodes = growth.network().nodes().len();
        }
        let all: f64 = least[1..].iter().sum();
        let worst = least[1..].iter().copied().fold(0.0, f64::max);
        println!("{name}: hit {:.2} ms, all {:.2} ms in {} steps, worst step {:.3} ms, {nodes} nodes", least[0] * 1e3, all * 1e3, least.len(), worst * 1e3);
    }
}
