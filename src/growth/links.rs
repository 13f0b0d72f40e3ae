//! Links between branches: the rings of glass (`draw_connections`) and the cells of clay (`draw_islands`).

use super::{draws, impact::Impact, nodes::NodeGrid, params::GrowthParams};
use crate::{
    math::{hash_unit, ops},
    pattern::{Link, LinkKind, NO_PARENT, Network},
};
use std::{collections::VecDeque, ops::Range};

/// Finds the nodes to which new nodes are linked.
#[derive(Clone, Debug, Default)]
pub(super) struct Linker {
    /// Links found and not taken yet.
    links: Vec<Link>,
    /// New nodes of one ring with their angle around the impact.
    ring: Vec<(f32, u32)>,
    /// Per node: whether another node grew from it.
    parents: Vec<bool>,
    /// Nodes of the last steps, which may be tips.
    waiting: VecDeque<Range<u32>>,
}

/// Nodes with a common ancestor within this many generations belong to the same branch.
const NEAR_GENERATIONS: usize = 8;

impl Linker {
    /// Links between neighbours on a ring: nodes of one impact and one generation, next to each other as seen from the impact.
    pub(super) fn rings(
        &mut self,
        params: &GrowthParams,
        network: &Network,
        impacts: &[Impact],
        new_nodes: Range<u32>,
        seed: u64,
    ) {
        let Some(first) = new_nodes.clone().next() else { return };
        for (index, impact) in (0u32..).zip(impacts) {
            self.ring.clear();
            for node in new_nodes.clone() {
                let born = network.nodes()[node as usize];
                if born.impact == index {
                    let arm = born.pos - impact.pos;
                    self.ring.push((ops::atan2(arm.y, arm.x), node));
                }
            }
            let n = self.ring.len();
            if n < 2 {
                continue;
            }
            self.ring.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            // With two nodes there is one pair, not two.
            for i in 0..if n == 2 { 1 } else { n } {
                let (a, b) = (self.ring[i].1, self.ring[(i + 1) % n].1);
                let generation = network.nodes()[a as usize].generation;
                let (from, beside) = (network.nodes()[a as usize].pos, network.nodes()[b as usize].pos);
                // No link spans a wide gap.
                let radius = from.distance(impact.pos).max(params.step_length);
                let apart = generation != network.nodes()[b as usize].generation || from.distance(beside) > radius;
                let is_left_out = hash_unit(seed ^ draws::CONNECTION_GAP, u64::from(a)) < params.connection_gaps;
                if apart || is_left_out || !is_ring(generation, params.connection_every) {
                    continue;
                }
                let width = 0.8 * params.line_width;
                let birth = network.nodes()[first as usize].birth;
                self.links.push(Link { a, b, width, birth, kind: LinkKind::Connection, bend: 1.0 });
            }
        }
    }

    /// The links found since the last call.
    pub(super) fn take_links(&mut self) -> Vec<Link> {
        std::mem::take(&mut self.links)
    }

    /// Forgets the first nodes.
    pub(super) fn forget(&mut self, first: u32) {
        self.parents.drain(..self.parents.len().min(first as usize));
        for nodes in &mut self.waiting {
            *nodes = nodes.start.saturating_sub(first)..nodes.end.saturating_sub(first);
        }
    }

    /// Tips that no longer grow: nodes without a child two steps after they were added; when growth has ended, all of
    /// them.
    pub(super) fn tips_at_rest(&mut self, network: &Network, new_nodes: Range<u32>) -> Vec<u32> {
        self.parents.resize(network.nodes().len(), false);
        for node in new_nodes.clone() {
            if let Some(is_parent) = self.parents.get_mut(network.nodes()[node as usize].parent as usize) {
                *is_parent = true;
            }
        }
        self.waiting.push_back(new_nodes.clone());
        let mut tips = Vec::new();
        while self.waiting.len() > 2 || (new_nodes.is_empty() && !self.waiting.is_empty()) {
            let settled = self.waiting.pop_front().into_iter().flatten();
            tips.extend(settled.filter(|&node| !self.parents[node as usize]));
        }
        tips
    }
}

/// A link from a tip to the nearest node of another branch ahead of it.
pub(super) fn island(params: &GrowthParams, network: &Network, nodes: &NodeGrid, tip: u32) -> Option<Link> {
    let born = network.nodes()[tip as usize];
    let parent = network.nodes().get(born.parent as usize)?;
    let ahead = (born.pos - parent.pos).normalize_or_zero();
    let own = ancestors(network, tip);
    let mut best = (f32::INFINITY, u32::MAX);
    nodes.within(born.pos, params.island_distance, |other, distance_sq| {
        let way = network.nodes()[other as usize].pos - born.pos;
        if (distance_sq, other) < best
            && way.dot(ahead) > 0.3 * distance_sq.sqrt()
            && !ancestors(network, other).iter().any(|a| *a != NO_PARENT && own.contains(a))
        {
            best = (distance_sq, other);
        }
    });
    let link = Link { a: best.1, b: tip, width: born.width, birth: born.birth, kind: LinkKind::Island, bend: 1.0 };
    (best.1 != u32::MAX).then_some(link)
}

/// Whether there is a ring at generation `generation`: rings are at `every` times 1, 3, 6, 10 ..., wider apart
/// further out.
const fn is_ring(generation: u32, every: u32) -> bool {
    let (mut ring, mut gap) = (0, every);
    while ring < generation {
        ring += gap;
        gap += every;
    }
    ring == generation
}

/// A node and its ancestors, the nearest first.
fn ancestors(network: &Network, node: u32) -> [u32; NEAR_GENERATIONS] {
    let mut line = [NO_PARENT; NEAR_GENERATIONS];
    let mut next = node;
    for slot in &mut line {
        if next == NO_PARENT {
            break;
        }
        *slot = next;
        next = network.nodes()[next as usize].parent;
    }
    line
}
