//! Chains of edges between the places where loops meet.

use super::{
    super::lattice::{Point, cross, dot},
    meet::Edges,
};
use std::cmp::Ordering;

/// No node: the chain is a whole loop that meets no other.
pub(super) const NONE: u32 = u32::MAX;

/// Edges that follow each other without a place where others meet them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chain {
    /// Indices of the first edge and of the last one.
    first: u32,
    last: u32,
    /// Number of edges.
    pub(super) count: u32,
    /// Nodes at both ends, or [`NONE`].
    pub(super) ends: [u32; 2],
    /// How many loops run along it, those the other way subtracted. Not zero.
    pub(super) weight: i32,
    /// Winding number on the side of positive turns; on the other side it is lower by the weight.
    pub(super) left: i32,
}

impl Chain {
    /// The corners from the start of the first edge to the start of the last one.
    pub(super) fn points<'a>(&self, edges: &'a Edges) -> impl Iterator<Item = Point> + 'a {
        let mut at = self.first as usize;
        (0..self.count).map(move |_| {
            let point = edges.edges[at].a;
            at = edges.next[at] as usize;
            point
        })
    }
}

/// Where a chain begins or ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    /// The node.
    node: u32,
    /// Towards the next point of the chain.
    way: [i64; 2],
    pub(super) chain: u32,
    pub(super) is_start: bool,
}

/// Chains, and in which order they leave each node.
#[derive(Debug, Default)]
pub(super) struct Chains {
    pub(super) chains: Vec<Chain>,
    /// The places of the nodes.
    pub(super) nodes: Vec<Point>,
    /// All ends, by node and then by direction, in the sense of positive turns from the direction of x.
    pub(super) ends: Vec<End>,
    /// Where the ends of a node start; one more than there are nodes.
    pub(super) starts: Vec<u32>,
    /// Where the start and the end of each chain are in `ends`.
    pub(super) places: Vec<[u32; 2]>,
}

impl Chains {
    /// The ends at a node.
    pub(super) fn star(&self, node: u32) -> std::ops::Range<usize> {
        self.starts[node as usize] as usize..self.starts[node as usize + 1] as usize
    }
}

/// 0 for directions from that of x up to its opposite, 1 for the others.
pub(super) const fn half(way: [i64; 2]) -> u8 {
    (way[1] < 0 || (way[1] == 0 && way[0] < 0)) as u8
}

/// By the angle from the direction of x.
fn by_angle(u: [i64; 2], v: [i64; 2]) -> Ordering {
    half(u).cmp(&half(v)).then_with(|| 0.cmp(&cross(u, v))).then_with(|| dot(u, u).cmp(&dot(v, v)))
}

impl End {
    /// Whether the end leaves downwards along y, or against x.
    pub(super) const fn half(&self) -> u8 {
        half(self.way)
    }
}

/// All chains of the edges.
pub(super) fn chains(edges: &Edges) -> Chains {
    let mut nodes: Vec<Point> =
        edges.edges.iter().zip(&edges.is_node).filter(|(_, is_node)| **is_node).map(|(edge, _)| edge.a).collect();
    nodes.sort_unstable_by_key(|node| node.rank());
    nodes.dedup();
    let mut out = Chains { nodes, ..Chains::default() };
    // Loops that meet nothing, loops that do.
    let mut is_done = vec![false; edges.edges.len()];
    for (i, _) in edges.is_node.iter().enumerate().filter(|(_, is_node)| **is_node) {
        let chain = follow(edges, i, &mut is_done, &out.nodes);
        out.chains.push(chain);
    }
    merge(&mut out.chains, edges);
    for i in 0..edges.edges.len() {
        if !is_done[i] {
            let chain = follow(edges, i, &mut is_done, &out.nodes);
            out.chains.push(chain);
        }
    }
    sort_ends(&mut out, edges);
    out
}

/// The chain that begins with an edge.
fn follow(edges: &Edges, first: usize, is_done: &mut [bool], nodes: &[Point]) -> Chain {
    let (mut at, mut count) = (first, 0);
    let last = loop {
        is_done[at] = true;
        count += 1;
        let here = at;
        at = edges.next[at] as usize;
        if at == first || edges.is_node[at] {
            break here;
        }
    };
    let node = |i: usize| {
        let place = edges.is_node[i]
            .then(|| nodes.binary_search_by_key(&edges.edges[i].a.rank(), |node| node.rank()).ok())
            .flatten();
        place.map_or(NONE, |node| node as u32)
    };
    Chain { first: first as u32, last: last as u32, count, ends: [node(first), node(at)], weight: 1, left: 0 }
}

/// Makes one of chains that run along the same edge, and removes those that cancel.
fn merge(chains: &mut Vec<Chain>, edges: &Edges) {
    let key = |chain: &Chain| {
        let [a, b] = chain.ends;
        (chain.count != 1, a.min(b), a.max(b))
    };
    chains.sort_by_key(|chain| (key(chain), chain.first));
    let mut out: Vec<Chain> = Vec::with_capacity(chains.len());
    for chain in chains.drain(..) {
        match out.last_mut() {
            Some(last) if chain.count == 1 && key(last) == key(&chain) => {
                last.weight += if last.ends == chain.ends { chain.weight } else { -chain.weight };
            }
            _ => out.push(chain),
        }
    }
    debug_assert!(out.iter().all(|chain| (chain.first as usize) < edges.edges.len()), "chains begin with an edge");
    out.retain(|chain| chain.weight != 0);
    *chains = out;
}

fn sort_ends(out: &mut Chains, edges: &Edges) {
    let mut ends = Vec::with_capacity(2 * out.chains.len());
    out.starts = vec![0; out.nodes.len() + 1];
    for (c, chain) in out.chains.iter().enumerate().filter(|(_, chain)| chain.ends[0] != NONE) {
        let (first, last) = (edges.edges[chain.first as usize], edges.edges[chain.last as usize]);
        let c = c as u32;
        ends.push(End { node: chain.ends[0], way: first.a.to(first.b), chain: c, is_start: true });
        ends.push(End { node: chain.ends[1], way: last.b.to(last.a), chain: c, is_start: false });
        chain.ends.iter().for_each(|&node| out.starts[node as usize + 1] += 1);
    }
    for node in 1..out.starts.len() {
        out.starts[node] += out.starts[node - 1];
    }
    // First by node, without comparing.
    let mut places = out.starts.clone();
    out.ends.clone_from(&ends);
    for end in ends {
        let place = &mut places[end.node as usize];
        out.ends[*place as usize] = end;
        *place += 1;
    }
    for star in out.starts.windows(2) {
        out.ends[star[0] as usize..star[1] as usize].sort_unstable_by(|a, b| {
            by_angle(a.way, b.way).then_with(|| (a.chain, a.is_start).cmp(&(b.chain, b.is_start)))
        });
    }
    out.places = vec![[0; 2]; out.chains.len()];
    for (i, end) in out.ends.iter().enumerate() {
        out.places[end.chain as usize][usize::from(!end.is_start)] = i as u32;
    }
}
