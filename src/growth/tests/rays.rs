//! Rays: glass, laminated glass, ice.

use crate::{
    CrackPreset,
    growth::{
        CrackGrowth,
        rays::{NO_RAY, RAY},
    },
    pattern::NO_PARENT,
};
use glam::Vec2;

/// What comes of one hit in the middle.
fn grown(preset: &CrackPreset, energy: f32, seed: u64) -> CrackGrowth {
    let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).unwrap();
    growth.hit(Vec2::splat(0.5), energy);
    while growth.step().grew() {}
    growth
}

/// The ray of each node.
fn ray_of(growth: &CrackGrowth, node: usize) -> Option<u32> {
    growth.field.ray_of.get(node).filter(|ray| **ray != NO_RAY).map(|ray| ray & !RAY)
}

/// The nodes to which each is joined.
fn neighbours(growth: &CrackGrowth) -> Vec<Vec<u32>> {
    let network = growth.network();
    let mut around = vec![Vec::new(); network.nodes().len()];
    for (a, b) in network.segments().filter_map(|segment| network.ends(segment)) {
        around[a as usize].push(b);
        around[b as usize].push(a);
    }
    around
}

/// Free ends: nodes with one neighbour that do not lie on the border.
fn free_ends(growth: &CrackGrowth) -> Vec<usize> {
    let (nodes, extent) = (growth.network().nodes(), growth.network().extent());
    let on_border = |pos: Vec2| (pos.cmpeq(Vec2::ZERO) | pos.cmpeq(extent)).any();
    let around = neighbours(growth);
    (0..nodes.len()).filter(|&node| around[node].len() < 2 && !on_border(nodes[node].pos)).collect()
}

fn length(growth: &CrackGrowth) -> f32 {
    let network = growth.network();
    let nodes = network.nodes();
    let ends = network.segments().filter_map(|segment| network.ends(segment));
    ends.map(|(a, b)| nodes[a as usize].pos.distance(nodes[b as usize].pos)).sum()
}

#[test]
fn stats() {
    for (name, preset) in
        [("glass", CrackPreset::GLASS), ("laminated", CrackPreset::LAMINATED_GLASS), ("ice", CrackPreset::ICE)]
    {
        for energy in [0.5, 1.0, 2.0, 4.0, 8.0] {
            let (mut lengths, mut rays, mut free, mut others) = (Vec::new(), 0, 0, 0);
            for seed in 0..24 {
                let growth = grown(&preset, energy, seed);
                lengths.push(length(&growth));
                let all: std::collections::BTreeSet<_> =
                    (0..growth.network().nodes().len()).filter_map(|node| ray_of(&growth, node)).collect();
                rays += all.len();
                for end in free_ends(&growth) {
                    let node = growth.network().nodes()[end];
                    if let Some(ray) = ray_of(&growth, end) {
                        free += 1;
                        if name == "glass" && energy == 1.0 {
                            println!(
                                "  seed {seed} ray {ray} at {} gen {} {}",
                                node.pos,
                                node.generation,
                                node.parent == NO_PARENT
                            );
                        }
                    } else {
                        others += 1;
                    }
                }
            }
            let n = lengths.len() as f32;
            let mean = lengths.iter().sum::<f32>() / n;
            let cv = (lengths.iter().map(|l| (l - mean).powi(2)).sum::<f32>() / n).sqrt() / mean;
            lengths.sort_by(f32::total_cmp);
            println!(
                "{name} {energy}: length {:.2} cv {cv:.3}, {:.1} rays, {free} free rays, {others} other free",
                lengths[12],
                rays as f32 / n
            );
        }
    }
}
