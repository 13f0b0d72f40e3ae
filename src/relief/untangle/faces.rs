//! How often the loops wind round the region on each side of a chain.

use super::{
    super::lattice::{Point, cross},
    chains::{Chains, NONE},
    meet::Edges,
};

/// Which winding numbers are inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Fill {
    /// All but zero.
    NonZero,
    /// This number and all above it.
    AtLeast(i32),
}

impl Fill {
    /// Whether a region with this winding number is inside.
    pub(super) const fn holds(self, winding: i32) -> bool {
        match self {
            Self::NonZero => winding != 0,
            Self::AtLeast(least) => winding >= least,
        }
    }
}

/// The corner of a part of the loops with the smallest x, and then the smallest y.
struct Extreme {
    place: Point,
    /// The chain of the corner, the corner before it and the one after it.
    chain: u32,
    around: [Point; 2],
    /// The winding number towards smaller x.
    outside: i32,
}

/// Sets the winding numbers of all chains.
///
/// Chains that are joined by nodes are a part. The numbers inside a part follow from its leftmost corner, and outside
/// that there are only other parts, whose edges are counted on the line to the left.
pub(super) fn wind(chains: &mut Chains, edges: &Edges) {
    let (parts, count) = parts(chains);
    let mut extremes = extremes(chains, edges, &parts, count);
    count_left(&mut extremes, edges);
    let mut is_wound = vec![false; chains.chains.len()];
    for extreme in &extremes {
        let chain = &mut chains.chains[extreme.chain as usize];
        let ends = chain.ends;
        // Where the corner is a node, the region to the left lies between two ends.
        if let Some(node) = ends.into_iter().find(|&node| chains.nodes.get(node as usize) == Some(&extreme.place)) {
            at_node(chains, node, extreme.outside, &mut is_wound);
            continue;
        }
        let [before, after] = extreme.around;
        let is_inside_left = cross(before.to(extreme.place), extreme.place.to(after)) > 0;
        chain.left = extreme.outside + if is_inside_left { chain.weight } else { 0 };
        let (left, right) = (chain.left, chain.left - chain.weight);
        is_wound[extreme.chain as usize] = true;
        if ends[0] != NONE {
            let [start, end] = chains.places[extreme.chain as usize];
            turn(chains, ends[0], start as usize, right, &mut is_wound);
            turn(chains, ends[1], end as usize, left, &mut is_wound);
        }
    }
}

/// Starts from a node that has `outside` towards smaller x.
fn at_node(chains: &mut Chains, node: u32, outside: i32, is_wound: &mut [bool]) {
    let star = chains.star(node);
    let first = star.clone().find(|&i| chains.ends[i].half() == 1).unwrap_or(star.start);
    turn(chains, node, first, outside, is_wound);
}

/// Goes round a node from the end `first`, before which the winding number is `winding`, and from there on.
fn turn(chains: &mut Chains, node: u32, first: usize, winding: i32, is_wound: &mut [bool]) {
    let mut waiting = vec![(node, first, winding)];
    while let Some((node, first, mut winding)) = waiting.pop() {
        let star = chains.star(node);
        for i in (first..star.end).chain(star.start..first) {
            let end = chains.ends[i];
            let chain = &mut chains.chains[end.chain as usize];
            let left = if end.is_start { winding + chain.weight } else { winding };
            winding = if end.is_start { left } else { winding - chain.weight };
            if !is_wound[end.chain as usize] {
                is_wound[end.chain as usize] = true;
                chain.left = left;
                let right = left - chain.weight;
                // On arrival, the side before the chain's other end.
                let far = usize::from(end.is_start);
                let place = chains.places[end.chain as usize][far] as usize;
                let before = if end.is_start { left } else { right };
                waiting.push((chain.ends[far], place, before));
            }
        }
    }
}

/// The part of each chain, and how many parts there are.
fn parts(chains: &Chains) -> (Vec<u32>, usize) {
    let mut part = vec![NONE; chains.chains.len()];
    let mut count = 0;
    let mut waiting = Vec::new();
    for c in 0..part.len() {
        if part[c] != NONE {
            continue;
        }
        part[c] = count;
        waiting.push(c);
        while let Some(c) = waiting.pop() {
            for &node in chains.chains[c].ends.iter().filter(|&&node| node != NONE) {
                for end in &chains.ends[chains.star(node)] {
                    if part[end.chain as usize] == NONE {
                        part[end.chain as usize] = count;
                        waiting.push(end.chain as usize);
                    }
                }
            }
        }
        count += 1;
    }
    (part, count as usize)
}

fn extremes(chains: &Chains, edges: &Edges, parts: &[u32], count: usize) -> Vec<Extreme> {
    let nowhere = Point::new(i32::MAX, i32::MAX);
    let mut out: Vec<Extreme> =
        (0..count).map(|_| Extreme { place: nowhere, chain: 0, around: [nowhere; 2], outside: 0 }).collect();
    for (c, (chain, &part)) in chains.chains.iter().zip(parts).enumerate() {
        let best = &mut out[part as usize];
        let mut best_here = None;
        let (mut k, mut place) = (0, best.place);
        let end = chains.nodes.get(chain.ends[1] as usize).copied();
        for point in chain.points(edges).chain(end) {
            if point < place {
                (best_here, place) = (Some(k), point);
            }
            k += 1;
        }
        if let Some(k) = best_here {
            // A chain that is a loop goes on at its start; nodes do not need what is around them.
            let at = |i: u32| chain.points(edges).nth((i % chain.count) as usize).unwrap_or(place);
            let after = if k + 1 == chain.count { end.unwrap_or_else(|| at(0)) } else { at(k + 1) };
            *best = Extreme { place, chain: c as u32, around: [at(k + chain.count - 1), after], outside: 0 };
        }
    }
    out
}

/// Sets the winding number left of each extreme.
fn count_left(extremes: &mut [Extreme], edges: &Edges) {
    if extremes.len() < 2 {
        return;
    }
    extremes.sort_unstable_by_key(|extreme| (extreme.place.y, extreme.place.x));
    for edge in &edges.edges {
        let (low, high) = (edge.a.y.min(edge.b.y), edge.a.y.max(edge.b.y));
        let first = extremes.partition_point(|extreme| extreme.place.y < low);
        for extreme in extremes[first..].iter_mut().take_while(|extreme| extreme.place.y < high) {
            let side = cross(edge.a.to(edge.b), edge.a.to(extreme.place));
            let is_rising = edge.b.y > edge.a.y;
            if is_rising && side < 0 {
                extreme.outside -= 1;
            } else if !is_rising && side > 0 {
                extreme.outside += 1;
            }
        }
    }
}
