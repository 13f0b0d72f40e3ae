//! The state of a growth with arrest: the lines of all cracks, and the tips that are moving to one.

use super::walls::Walls;
use crate::pattern::{Network, SegmentId};
use glam::Vec2;

/// Cosine of the angle to the heading within which a crack is ahead of a tip: 60 degrees.
pub(super) const AHEAD: f32 = 0.5;

/// The state of a growth with arrest, in addition to its network.
#[derive(Clone, Debug)]
pub(super) struct Arrest {
    pub(super) walls: Walls,
    /// Per node: whether nothing more may grow from it.
    pub(super) sealed: Vec<bool>,
    pub(super) runners: Vec<Runner>,
}

/// A tip that is moving to a crack or to the border.
#[derive(Clone, Copy, Debug)]
pub(super) struct Runner {
    pub(super) tip: u32,
    pub(super) goal: Goal,
    pub(super) steps_left: u32,
    /// Its direction when it started.
    pub(super) course: Vec2,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Goal {
    Node(u32),
    Border(Vec2),
}

/// The result of trying to grow from a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Advance {
    Grown,
    /// Nothing can grow from the node in this direction.
    Stopped(Vec2),
}

impl Arrest {
    pub(super) fn new(network: &Network, length: f32) -> Self {
        let walls = Walls::new(network.extent(), length);
        let mut arrest = Self { walls, sealed: vec![false; network.nodes().len()], runners: Vec::new() };
        arrest.add_walls(network, network.segments());
        arrest
    }

    /// The same without the first nodes; `network` is the remaining network.
    pub(super) fn after(before: Self, network: &Network, length: f32, first: u32) -> Self {
        let mut arrest = Self::new(network, length);
        for (sealed, was_sealed) in arrest.sealed.iter_mut().zip(before.sealed.iter().skip(first as usize)) {
            *sealed = *was_sealed;
        }
        let left = |runner: Runner| {
            let goal = match runner.goal {
                Goal::Node(node) => Goal::Node(node.checked_sub(first)?),
                goal @ Goal::Border(_) => goal,
            };
            Some(Runner { tip: runner.tip.checked_sub(first)?, goal, ..runner })
        };
        arrest.runners = before.runners.into_iter().filter_map(left).collect();
        arrest
    }

    /// Adds the lines of segments.
    pub(super) fn add_walls(&mut self, network: &Network, segments: impl Iterator<Item = SegmentId>) {
        for segment in segments {
            if let (Some(ends), Some(path)) = (network.ends(segment), network.path(segment)) {
                self.walls.add(ends, &path);
            }
        }
    }

    pub(super) fn reserve(&mut self, nodes: usize) {
        self.sealed.reserve(nodes);
        self.walls.reserve(nodes);
    }

    pub(super) fn push_node(&mut self, is_sealed: bool) {
        self.sealed.push(is_sealed);
    }

    pub(super) fn is_sealed(&self, node: u32) -> bool {
        self.sealed[node as usize]
    }

    pub(super) fn seal(&mut self, node: u32) {
        self.sealed[node as usize] = true;
    }

    /// The tips that are moving.
    pub(super) fn running(&self) -> impl Iterator<Item = u32> + '_ {
        self.runners.iter().map(|runner| runner.tip)
    }

    pub(super) const fn is_running(&self) -> bool {
        !self.runners.is_empty()
    }
}

/// Largest number of steps that a tip takes to a goal at `distance`.
pub(super) fn steps_for(distance: f32, length: f32) -> u32 {
    (1.5 * distance / length) as u32 + 2
}
