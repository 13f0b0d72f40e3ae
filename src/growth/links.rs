//! Segments across branches: the rings of glass (`draw_connections`) and the cells of clay (`draw_islands`).

use super::{nodes::NodeGrid, params::GrowthParams, step::Impact};
use crate::{
    math::{hash_unit, ops},
    pattern::{Link, LinkKind, NO_PARENT, Network},
};
use std::ops::Range;

/// Joins newborn nodes to others.
#[derive(Clone, Debug, Default)]
pub(super) struct Linker {
    /// Newborn nodes of one ring with their angle around the impact.
    ring: Vec<(f32, u32)>,
    /// Per node: whether it has an island link.
    islanded: Vec<bool>,
}

/// Nodes that meet within so many generations are of the same branch.
const KIN: usize = 12;

impl Linker {
    pub(super) fn join(
        &mut self,
        params: &GrowthParams,
        network: &mut Network,
        nodes: &NodeGrid,
        impacts: &[Impact],
        newborn: Range<u32>,
        seed: u64,
    ) {
        if params.draw_connections {
            self.join_rings(params, network, impacts, newborn.clone(), seed);
        }
        if params.draw_islands {
            self.join_islands(params, network, nodes, newborn);
        }
    }

    /// Joins neighbours on a ring: nodes of one impact and one generation, next to each other as seen from the impact.
    fn join_rings(
        &mut self,
        params: &GrowthParams,
        network: &mut Network,
        impacts: &[Impact],
        newborn: Range<u32>,
        seed: u64,
    ) {
        let Some(first) = newborn.clone().next() else { return };
        for (index, impact) in (0u32..).zip(impacts) {
            self.ring.clear();
            for node in newborn.clone() {
                let born = network.nodes()[node as usize];
                if born.impact == index && born.generation % params.connection_every == 0 {
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
                let (a, mut b) = (self.ring[i].1, self.ring[(i + 1) % n].1);
                let draw = |what| hash_unit(seed ^ what, u64::from(a));
                let generation = network.nodes()[a as usize].generation;
                if generation != network.nodes()[b as usize].generation || draw(0xC0) < params.connection_gaps {
                    continue;
                }
                // Real rings step from radial to radial instead of closing evenly.
                let parent = network.nodes()[b as usize].parent;
                if parent != NO_PARENT && draw(0xC1) < 0.4 {
                    b = parent;
                }
                let (from, to) = (network.nodes()[a as usize].pos, network.nodes()[b as usize].pos);
                let radius = from.distance(impact.pos).max(params.step_length);
                if a != b && from.distance(to) < 1.2 * radius {
                    let width = 0.8 * params.line_width;
                    let birth = network.nodes()[first as usize].birth;
                    network.links.push(Link { a, b, width, birth, kind: LinkKind::Connection });
                }
            }
        }
    }

    /// Joins each newborn node to the nearest one of another branch.
    fn join_islands(&mut self, params: &GrowthParams, network: &mut Network, nodes: &NodeGrid, newborn: Range<u32>) {
        self.islanded.resize(network.nodes().len(), false);
        for node in newborn {
            let born = network.nodes()[node as usize];
            let kin = ancestors(network, node);
            let mut best = (f32::INFINITY, u32::MAX);
            nodes.within(born.pos, params.island_distance, |other, distance_sq| {
                let candidate = (distance_sq, other);
                if candidate < best
                    && other < node
                    && !self.islanded[other as usize]
                    && !ancestors(network, other).iter().any(|a| *a != NO_PARENT && kin.contains(a))
                {
                    best = candidate;
                }
            });
            if best.1 != u32::MAX {
                self.islanded[best.1 as usize] = true;
                self.islanded[node as usize] = true;
                let width = network.nodes()[best.1 as usize].width.max(params.line_width);
                let link = Link { a: best.1, b: node, width, birth: born.birth, kind: LinkKind::Island };
                network.links.push(link);
            }
        }
    }
}

/// A node and those it grew from, the nearest first.
fn ancestors(network: &Network, node: u32) -> [u32; KIN] {
    let mut line = [NO_PARENT; KIN];
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
