//! Widths against a recount of all that hangs on each node.

use super::{arrest::random_arrest, random_extent, random_params};
use crate::{
    CrackPreset,
    growth::{
        CrackGrowth, GrowthParams,
        width::{NOTCH, Widths, thinly},
    },
    math::{Rng, ops},
    pattern::{LinkKind, NO_PARENT, Node},
};
use glam::Vec2;

/// Nodes that hang on each, itself included; each counts for `own`, and for the node that `before` names.
fn recount(nodes: &[Node], own: impl Fn(u32) -> u32, before: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut behind: Vec<u32> = (0..nodes.len() as u32).map(own).collect();
    for node in (0..nodes.len() as u32).rev().filter(|&node| before(node) != NO_PARENT) {
        behind[before(node) as usize] += behind[node as usize];
    }
    behind
}

/// The width that the documents promise for a node with so many behind it.
fn promised(params: &GrowthParams, behind: u32) -> f32 {
    let pipes = ops::powf(behind as f32, 1.0 / params.murray);
    let width = (params.line_width * (1.0 + params.line_growth * (pipes - 1.0))).min(params.max_width);
    width * if params.tip_taper > 0.0 { ((behind as f32 - 0.95) / params.tip_taper).min(1.0) } else { 1.0 }
}

fn node(parent: u32, width: f32) -> Node {
    Node { pos: Vec2::ZERO, width, parent, generation: 0, birth: 0, impact: 0, bend: 1.0 }
}

/// Random trees of all shapes, in batches of all sizes.
#[test]
fn widths_are_those_of_a_recount_on_random_trees() {
    let (mut together, mut most_late) = (0, 0.0f64);
    for case in 0..120u64 {
        let mut rng = Rng::new(case).stream("trees");
        let params = random_params(&mut rng, true);
        let mut widths = Widths::new(&params);
        let mut nodes: Vec<Node> = Vec::new();
        let size = if case % 6 == 0 { 6000 } else { 20 + rng.next_u32() % 400 };
        // From single strands to bushes; some batches as of many tips, some of one.
        let (youth, largest) = (rng.unit().powi(2), 1.0 + 60.0 * rng.unit());
        while (nodes.len() as u32) < size {
            let first = nodes.len() as u32;
            for _ in 0..=(largest * rng.unit()) as u32 {
                let from_end = (youth * rng.unit() * first as f32) as u32;
                let parent =
                    if first == 0 || rng.unit() < 0.01 { NO_PARENT } else { first - 1 - from_end.min(first - 1) };
                let width = widths.tip((parent, true), || 0.5, 1.0);
                nodes.push(node(parent, width));
            }
            let before: Vec<f32> = nodes.iter().map(|node| node.width).collect();
            let mut told = Vec::new();
            widths.push(&mut nodes, first, |node| told.push(node));
            if rng.unit() < 0.1 {
                widths.join(&mut nodes, first, |node| told.push(node));
                widths.join(&mut nodes, first, |node| told.push(node));
            }
            // Who became wider was told of, and nobody else.
            for (index, (before, node)) in before.iter().zip(&nodes).enumerate() {
                assert_eq!(told.contains(&(index as u32)), node.width > *before, "case {case}: node {index}");
            }
            let is_last = nodes.len() as u32 >= size;
            if is_last {
                widths.settle(&mut nodes, |_| {});
            } else if size > 1000 && rng.unit() < 0.9 {
                continue;
            }
            let behind = recount(&nodes, |node| widths.form(node).0, |node| nodes[node as usize].parent);
            // In a small network each at once; in a large one no more than a twelfth of all are told later.
            let late = if is_last || nodes.len() <= 192 { 0 } else { nodes.len() as u32 / 12 };
            // What is as wide as can be has stopped telling.
            let (widest, mut enough) = (promised(&params, 1 << 24), 1);
            while promised(&params, enough) < widest && enough < 16 * size {
                enough += 1;
            }
            for (index, (node, &behind)) in nodes.iter().zip(&behind).enumerate() {
                let behind = behind.min(enough);
                let form = widths.form(index as u32).1;
                let least = promised(&params, behind.saturating_sub(late).max(1)) / NOTCH * form;
                let most = promised(&params, behind) * form;
                let is_right = (least * 0.9999..=most * 1.0001).contains(&node.width);
                assert!(
                    is_right,
                    "case {case}, node {index} of {}: {behind} behind, {} is not in {least}..={most}",
                    nodes.len(),
                    node.width
                );
                if late > 0 && node.width < promised(&params, behind) / NOTCH * form * 0.9999 {
                    together += 1;
                    most_late = most_late.max(f64::from(promised(&params, behind) * form / node.width));
                }
            }
        }
    }
    assert!(together > 0, "none is ever late: the other way of counting was not tried");
    println!("{together} were late for a while, at most {most_late:.2} times too thin");
}

/// Growths of all kinds: widths at rest are what the documents promise, free ends are needles, and those that meet something are not.
#[test]
fn widths_of_growths_are_those_of_a_recount() {
    let (mut free, mut met, mut gone_on) = (0, 0, 0);
    for case in 0..400u64 {
        let mut rng = Rng::new(case).stream("recount");
        let params = if case % 2 == 0 { random_params(&mut rng, true) } else { random_arrest(&mut rng) };
        let params = GrowthParams { unevenness: 0.0, variety: 0.0, ..params };
        let extent = random_extent(&mut rng);
        let mut growth = CrackGrowth::new(params.clone(), extent, case).unwrap();
        for _ in 0..3 {
            growth.hit(Vec2::new(rng.unit(), rng.unit()) * extent, 1.0);
            for _ in 0..rng.next_u32() % 300 {
                growth.step();
            }
        }
        while growth.step().grew() {}
        let nodes = growth.network().nodes();
        let (mut is_met, mut is_thinned) = (vec![false; nodes.len()], vec![false; nodes.len()]);
        for link in growth.network().links() {
            // What closes a cell beyond the reach of its hit gets thin.
            let is_thin = growth.divides() && (growth.has_left(link.a) || growth.has_left(link.b));
            is_met[link.b as usize] |= link.kind != LinkKind::Connection && !is_thin;
            is_thinned[link.b as usize] |= link.kind != LinkKind::Connection && is_thin;
        }
        if params.keeps_apart() {
            for (node, is_met) in nodes.iter().zip(&mut is_met) {
                *is_met |= node.parent != NO_PARENT && (node.pos.cmpeq(Vec2::ZERO) | node.pos.cmpeq(extent)).any();
            }
        }
        let beyond = params.tip_taper.ceil() as u32;
        // What was met may have been an end, or have gone on since.
        let mut may_be = vec![false; nodes.len()];
        for link in growth.network().links().iter().filter(|_| growth.divides()) {
            may_be[link.a as usize] |= link.kind != LinkKind::Connection;
        }
        let counts = |node: usize| match node {
            node if is_met[node] => 1 + beyond,
            node if is_thinned[node] => 1 + thinly(beyond),
            _ => 1,
        };
        // Each hit is counted for itself.
        let before = |node: u32| {
            let Node { parent, impact, .. } = nodes[node as usize];
            if nodes.get(parent as usize).is_some_and(|parent| parent.impact == impact) { parent } else { NO_PARENT }
        };
        let behind = recount(nodes, |node| counts(node as usize), before);
        let own = |node: u32| if may_be[node as usize] { 1 + beyond } else { counts(node as usize) };
        let at_most = recount(nodes, own, before);
        for (index, ((node, &behind), &at_most)) in nodes.iter().zip(&behind).zip(&at_most).enumerate() {
            // Hits that have merged make wider ones.
            let generation = growth.division.as_ref().map_or(0, |division| division.generation_of(index as u32));
            let share = 0.5f32.powi(i32::from(generation)) * growth.impacts()[node.impact as usize].widening;
            // Beyond an older crack they are thinner; only the first node begins as wide as any tip.
            let thinner = growth.widths.share(index as u32);
            let (parent, begins) =
                (before(index as u32), node.parent != NO_PARENT && before(index as u32) == NO_PARENT);
            gone_on += usize::from(begins && thinner < 1.0);
            assert!(
                if parent == NO_PARENT { begins || thinner == 1.0 } else { thinner == growth.widths.share(parent) },
                "case {case}, node {index}: {thinner}"
            );
            let first = if begins { promised(&params, 1) * share } else { 0.0 };
            let share = share * thinner;
            let (least, most) = (promised(&params, behind) * share, (promised(&params, at_most) * share).max(first));
            let is_right = (least / NOTCH * 0.9999..=most * 1.0001).contains(&node.width);
            assert!(is_right, "case {case}, node {index}: {behind} behind, {} is not {least}: {params:?}", node.width);
            if params.tip_taper >= 2.0 && at_most == 1 {
                free += 1;
                assert!(node.width < 0.06 * params.line_width);
            }
            if is_met[index] && params.tip_taper > 0.0 {
                met += 1;
                assert!(node.width >= 0.999 * params.line_width / NOTCH * share);
            }
        }
    }
    assert!(free > 1000 && met > 1000, "{free} free ends, {met} that met something");
    assert!(gone_on > 100, "{gone_on} went on beyond an older crack");
}

/// Along every branch of every preset the width never rises towards the tip by more than `unevenness` lets it, at any time.
#[test]
fn branches_taper_to_their_tips() {
    for name in CrackPreset::NAMES {
        let preset = CrackPreset::named(name).unwrap();
        for seed in 0..3 {
            let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).unwrap();
            growth.hit(Vec2::new(0.4, 0.55), 1.0);
            let most = 1.001 / (1.0 - growth.params().unevenness);
            let mut step = 0;
            loop {
                let grew = growth.step().grew();
                step += 1;
                if grew && step % 8 != 0 {
                    continue;
                }
                let nodes = growth.network().nodes();
                for node in nodes.iter().filter(|node| node.parent != NO_PARENT) {
                    let parent = nodes[node.parent as usize];
                    // What waits to be told makes a trunk thin for a while.
                    let late = if grew { 1.6 } else { NOTCH };
                    assert!(
                        node.width <= parent.width * most * late,
                        "{name} {seed}: {} on {}",
                        node.width,
                        parent.width
                    );
                    assert!(
                        grew || node.width <= parent.width * most,
                        "{name} {seed}: {} on {}",
                        node.width,
                        parent.width
                    );
                }
                if !grew {
                    break;
                }
            }
        }
    }
}

/// Every parameter of widths changes every preset.
#[test]
fn each_parameter_of_widths_does_something_in_every_preset() {
    for name in CrackPreset::NAMES {
        let preset = CrackPreset::named(name).unwrap();
        let widths_after = |steps: u32, change: &dyn Fn(&mut GrowthParams)| {
            let mut params = GrowthParams { variety: 0.0, ..preset.growth.clone() };
            change(&mut params);
            let mut growth = CrackGrowth::new(params, Vec2::ONE, 2).unwrap();
            growth.hit(Vec2::splat(0.5), 1.0);
            while growth.steps() < steps && growth.step().grew() {}
            let nodes = growth.network().nodes();
            let mut widths: Vec<f32> = nodes.iter().map(|node| node.width).collect();
            widths.sort_by(f32::total_cmp);
            let at = |share: f32| widths[((widths.len() - 1) as f32 * share) as usize];
            (at(0.0), at(0.5), at(0.98))
        };
        let widths = |change: &dyn Fn(&mut GrowthParams)| widths_after(u32::MAX, change);
        let asked = preset.growth.line_growth;
        let base = widths(&|_| {});
        let (more, none) = (
            widths(&|params| (params.line_growth, params.max_width) = (2.0 * asked + 1.0, 0.4)),
            widths(&|params| params.line_growth = 0.0),
        );
        assert!(more.2 > 1.2 * base.2 && none.2 <= base.2, "{name}: line_growth {more:?} {base:?} {none:?}");
        let flat = widths(&|params| params.murray = 8.0);
        assert!(flat.2 < base.2 || asked == 0.0, "{name}: murray {flat:?} {base:?}");
        let capped = widths(&|params| params.max_width = params.line_width);
        assert!(capped.2 <= preset.growth.line_width && (capped.2 < base.2 || asked == 0.0), "{name}: max_width");
        // While it grows: in the end hardly any end may be free.
        let tapered = |taper: f32| widths_after(20, &|params| params.tip_taper = taper);
        let (blunt, sharp) = (tapered(0.0), tapered(12.0));
        assert!(blunt.0 > sharp.0, "{name}: tip_taper {blunt:?} {sharp:?}");
        let uneven = widths(&|params| params.unevenness = 0.9);
        assert!(uneven.1 < base.1, "{name}: unevenness {uneven:?} {base:?}");
        let bold = widths(&|params| (params.line_width, params.max_width) = (3.0 * params.line_width, 0.4));
        assert!(bold.1 > 2.0 * base.1, "{name}: line_width {bold:?} {base:?}");
    }
}
