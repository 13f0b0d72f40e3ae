//! Paths of strands that were laid out and grow step by step: [`StrandPaths`].

use crate::pattern::{NO_PARENT, Network};
use glam::Vec2;

/// Lines of at most this many points that leave a longer one grow this many steps later.
const SHORT: u32 = 12;
const LATER: u32 = 6;

/// What strands are laid out from.
pub(super) struct Order {
    pub(super) impact: u32,
    pub(super) center: Vec2,
    pub(super) reach: f32,
    /// See [`StrandPaths`].
    pub(super) roots: Vec<(Vec2, u32)>,
    pub(super) least: f32,
    pub(super) rounds: u32,
    pub(super) seed: u64,
}

/// Paths that were laid out, as far as they have grown.
#[derive(Clone, Debug)]
pub(super) struct StrandPaths {
    pub(super) impact: u32,
    /// Where strands start, and the node there.
    pub(super) roots: Vec<(Vec2, u32)>,
    pub(super) paths: Network,
    /// The points in the order in which they grow, each after a number of steps.
    order: Vec<(u32, u32)>,
    /// How many of them have grown.
    grown: usize,
    /// For each point: its node, or [`NO_PARENT`] if it has not grown or the way is blocked.
    pub(super) nodes: Vec<u32>,
    /// Steps made since the hit.
    pub(super) steps: u32,
    /// How long all strands of the impact should be at least, pattern units, and how often more may be laid out for that.
    pub(super) least: f32,
    pub(super) rounds: u32,
}

impl StrandPaths {
    pub(super) fn new(order: &Order, paths: Network) -> Self {
        let nodes = vec![NO_PARENT; paths.nodes.len()];
        let Order { impact, least, rounds, .. } = *order;
        Self {
            impact,
            roots: order.roots.clone(),
            order: in_order(&paths),
            paths,
            grown: 0,
            nodes,
            steps: 0,
            least,
            rounds,
        }
    }

    pub(super) const fn is_over(&self) -> bool {
        self.grown >= self.order.len()
    }

    /// The next point that is to grow by now.
    pub(super) fn next(&mut self) -> Option<u32> {
        let &(_, point) = self.order.get(self.grown).filter(|(step, _)| *step <= self.steps)?;
        self.grown += 1;
        Some(point)
    }

    /// The first `count` nodes of the growth have been removed: nothing grows from those any more.
    pub(super) fn forget(&mut self, count: u32) {
        let roots = self.roots.iter_mut().map(|(_, node)| node);
        for node in self.nodes.iter_mut().chain(roots).filter(|node| **node != NO_PARENT) {
            *node = node.checked_sub(count).unwrap_or(NO_PARENT);
        }
    }

    /// The node from which a strand starts that begins at `pos`.
    pub(super) fn root(&self, pos: Vec2) -> u32 {
        let distance = |root: &&(Vec2, u32)| root.0.distance_squared(pos);
        let nearest = self.roots.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(NO_PARENT, |(_, node)| *node)
    }
}

/// The order in which points grow: short side lines come a little later than the line that they leave, which is not to stop at them.
fn in_order(paths: &Network) -> Vec<(u32, u32)> {
    let nodes = &paths.nodes;
    // Number of points of the longest line from each point on. Parents come before their children.
    let mut longest = vec![1u32; nodes.len()];
    for (i, node) in nodes.iter().enumerate().rev() {
        if let Some(parent) = longest.get(node.parent as usize).copied() {
            longest[node.parent as usize] = parent.max(longest[i] + 1);
        }
    }
    let mut is_side = vec![false; nodes.len()];
    let mut order = Vec::with_capacity(nodes.len());
    for (i, node) in nodes.iter().enumerate() {
        if node.parent != NO_PARENT {
            let parent = node.parent as usize;
            is_side[i] = is_side[parent] || longest[i] <= SHORT && longest[i] + 1 < longest[parent];
        }
        order.push((node.birth.saturating_add(if is_side[i] { LATER } else { 0 }), i as u32));
    }
    order.sort_unstable();
    order
}
