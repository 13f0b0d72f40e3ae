//! Joins the chains between inside and outside to rings.

use super::{
    super::lattice::{Loop, Point},
    chains::{Chains, NONE},
    faces::Fill,
    meet::Edges,
};

/// Rings around the regions that `fill` calls inside, with the inside on the side of positive turns.
pub(super) fn trace(chains: &Chains, edges: &Edges, fill: Fill) -> Vec<Loop> {
    // Which way the border runs along a chain, if it does.
    let forward: Vec<Option<bool>> = chains
        .chains
        .iter()
        .map(|chain| {
            let [left, right] = [chain.left, chain.left - chain.weight].map(|winding| fill.holds(winding));
            (left != right).then_some(left)
        })
        .collect();
    let mut is_done = vec![false; chains.chains.len()];
    let mut out = Vec::new();
    let mut seen = vec![NONE; chains.nodes.len()];
    for c in 0..chains.chains.len() {
        let Some(is_forward) = forward[c].filter(|_| !is_done[c]) else { continue };
        if chains.chains[c].ends[0] == NONE {
            out.push(line(chains, edges, c, is_forward).collect());
        } else {
            let around = walk(chains, c, &forward, &mut is_done);
            part(chains, edges, &around, &mut seen, &mut out);
        }
    }
    out
}

/// The corners of a chain without the last one, in the given direction.
fn line<'a>(chains: &'a Chains, edges: &'a Edges, chain: usize, is_forward: bool) -> impl Iterator<Item = Point> + 'a {
    let chain = &chains.chains[chain];
    let mut points: Vec<Point> = chain.points(edges).collect();
    if !is_forward {
        // From the last point, which `points` leaves out, back to the second.
        if let Some(&end) = chains.nodes.get(chain.ends[1] as usize) {
            points.push(end);
            points.remove(0);
        }
        points.reverse();
    }
    points.into_iter()
}

/// The chains of the border from `first` until it comes back, each with its direction.
fn walk(chains: &Chains, first: usize, forward: &[Option<bool>], is_done: &mut [bool]) -> Vec<(usize, bool)> {
    let mut out = Vec::new();
    let mut at = first;
    while let Some(is_forward) = forward[at].filter(|_| !is_done[at]) {
        is_done[at] = true;
        out.push((at, is_forward));
        let far = usize::from(is_forward);
        let star = chains.star(chains.chains[at].ends[far]);
        let place = chains.places[at][far] as usize;
        // The region lies on one side of the way here, and its next border on the other side of it.
        let back = (star.start..place).rev().chain((place..star.end).rev());
        let next = back.map(|i| chains.ends[i].chain as usize).find(|&c| forward[c].is_some());
        at = next.unwrap_or(first);
    }
    out
}

/// Divides a border at the nodes that it passes several times.
fn part(chains: &Chains, edges: &Edges, around: &[(usize, bool)], seen: &mut [u32], out: &mut Vec<Loop>) {
    let start = |&(c, is_forward): &(usize, bool)| chains.chains[c].ends[usize::from(!is_forward)] as usize;
    let mut open: Vec<(usize, bool)> = Vec::new();
    for piece in around {
        let node = start(piece);
        if seen[node] != NONE {
            let from = seen[node] as usize;
            open[from..].iter().for_each(|piece| seen[start(piece)] = NONE);
            let ring = open.drain(from..).flat_map(|(c, is_forward)| line(chains, edges, c, is_forward));
            out.push(ring.collect());
        }
        seen[node] = open.len() as u32;
        open.push(*piece);
    }
    open.iter().for_each(|piece| seen[start(piece)] = NONE);
    out.push(open.into_iter().flat_map(|(c, is_forward)| line(chains, edges, c, is_forward)).collect());
}
