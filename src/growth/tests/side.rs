//! Spurs and hairlines.

use crate::{
    CrackPreset,
    growth::{CrackGrowth, GrowthParams},
    pattern::{NO_PARENT, Node},
};
use glam::Vec2;

/// What comes of three hits.
fn grown(params: GrowthParams, seed: u64) -> Vec<Node> {
    let mut growth = CrackGrowth::new(params, Vec2::ONE, seed).unwrap();
    for place in [Vec2::new(0.3, 0.4), Vec2::new(0.7, 0.6), Vec2::new(0.4, 0.8)] {
        growth.hit(place, 1.0);
        while growth.step().grew() {}
    }
    growth.network().nodes().to_vec()
}

/// How many nodes grew from each.
fn children(nodes: &[Node]) -> Vec<u32> {
    let mut children = vec![0; nodes.len()];
    for node in nodes.iter().filter(|node| node.parent != NO_PARENT) {
        children[node.parent as usize] += 1;
    }
    children
}

/// Side cracks are short, start at a crack that runs on, and nothing grows from them: their share is what was asked for, less where
/// there is no room.
#[test]
fn spurs_are_short_and_end() {
    let of = |spurs: f32, seed: u64| grown(GrowthParams { spurs, variety: 0.0, ..CrackPreset::GLAZE.growth }, seed);
    let short_ends = |nodes: &[Node]| {
        let children = children(nodes);
        let is_end = |i: usize| {
            let node = nodes[i];
            node.parent != NO_PARENT && children[i] == 0 && children[node.parent as usize] > 1
        };
        (0..nodes.len()).filter(|&i| is_end(i)).count() as f32
    };
    let (mut without, mut few, mut many, mut nodes) = (0.0, 0.0, 0.0, 0.0);
    for seed in 0..12 {
        without += short_ends(&of(0.0, seed));
        few += short_ends(&of(0.1, seed));
        let spurred = of(0.4, seed);
        many += short_ends(&spurred);
        nodes += spurred.len() as f32;
    }
    println!("short side cracks: {without} without, {few} at 0.1, {many} at 0.4 of {nodes} nodes");
    assert!(few > without + 0.02 * nodes, "few show");
    assert!(
        (1.8..=4.2).contains(&((many - without) / (few - without))),
        "four times the share, about four times as many"
    );
    // Of ten nodes that are no spur four have one, but where another crack is near.
    assert!(((many - without) / (nodes - many)) <= 0.4 * 1.1);
    assert!(((many - without) / (nodes - many)) > 0.15);
}

/// Hairlines change widths alone, and as much of them as was asked for.
#[test]
fn hairlines_change_only_widths() {
    let even = GrowthParams { line_growth: 0.0, unevenness: 0.0, hairlines: 0.0, ..CrackPreset::PLASTER.growth };
    for share in [0.0f32, 0.1, 0.3, 0.6] {
        let (mut fine, mut all) = (0.0, 0.0);
        for seed in 0..12 {
            let plain = grown(even.clone(), seed);
            let with = grown(GrowthParams { hairlines: share, ..even.clone() }, seed);
            assert_eq!(plain.len(), with.len());
            for (plain, with) in plain.iter().zip(&with) {
                assert_eq!((plain.pos, plain.parent, plain.birth), (with.pos, with.parent, with.birth));
                assert!(with.width <= plain.width);
                all += 1.0;
                fine += f32::from(u8::from(with.width < 0.5 * plain.width));
            }
        }
        assert!((fine / all - share).abs() < 0.03 + 0.1 * share, "{share} asked for, {} came", fine / all);
    }
}
