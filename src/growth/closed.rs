//! Closed venation (Runions et al. 2005): a marker attracts all its relative neighbours, so that cracks meet in it.

use super::{GrowthParams, nodes::NodeGrid, params::PROGRESS};
use crate::pattern::Node;
use glam::Vec2;

/// The nodes that every marker attracts.
///
/// A node `v` is a *relative neighbour* of a marker `s` if no node `u` is closer to both than they are to each other:
/// there is no `u` with `max(|us|, |uv|) < |vs|`. A neighbour is dropped when one of its children is closer to the
/// marker by the progress that every new node must make, because the child continues. When the first node is within
/// the kill distance, the marker is *reached*. It then attracts the neighbours that it has at that time, and their
/// continuations, until each is within the kill distance too or is dropped; then the marker is removed. Each node
/// that arrives is linked to the first one.
#[derive(Clone, Debug)]
pub(super) struct Relations {
    /// Smallest decrease of squared distance that counts as a continuation.
    progress: f32,
    kill_sq: f32,
    /// Largest number of steps for which a marker attracts nodes.
    patience: u32,
    /// Per marker, in the order of creation.
    of: Vec<Relation>,
    /// Pairs of nodes that have come together in a marker.
    pub(super) met: Vec<(u32, u32)>,
}

#[derive(Clone, Debug, Default)]
struct Relation {
    neighbours: Vec<u32>,
    /// The node that reached the marker first.
    reached_by: Option<u32>,
    /// Number of nodes that have been visited.
    seen: u32,
    age: u32,
}

/// The state of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bond {
    /// It attracts this node and possibly others.
    Attracts(u32),
    Waits,
    Dead,
}

impl Relations {
    pub(super) fn new(params: &GrowthParams) -> Self {
        Self {
            progress: PROGRESS * params.step_length * params.step_length,
            kill_sq: params.kill_distance * params.kill_distance,
            patience: patience(params),
            of: Vec::new(),
            met: Vec::new(),
        }
    }

    pub(super) fn add(&mut self) {
        self.of.push(Relation::default());
    }

    /// Removes all but the first markers.
    pub(super) fn keep(&mut self, markers: usize) {
        self.of.truncate(markers);
    }

    /// The nodes that a marker attracts.
    pub(super) fn neighbours(&self, id: u32) -> &[u32] {
        &self.of[id as usize].neighbours
    }

    /// Shows a marker at `pos` a node that is within the radius; `is_own` says whether it may attract it.
    pub(super) fn visit(
        &mut self,
        (id, pos): (u32, Vec2),
        (index, distance_sq, is_own): (u32, f32, bool),
        nodes: &[Node],
        grid: &NodeGrid,
    ) -> Bond {
        let relation = &mut self.of[id as usize];
        if index < relation.seen {
            return relation.bond();
        }
        relation.seen = index + 1;
        let place = nodes[index as usize].pos;
        let parent = nodes[index as usize].parent;
        let apart_sq = |node: u32| nodes[node as usize].pos.distance_squared(pos);
        let is_on = |node: u32| distance_sq <= self.kill_sq || distance_sq <= apart_sq(node) - self.progress;
        if let Some(first) = relation.reached_by {
            if let Some(i) = relation.neighbours.iter().position(|&node| node == parent && is_on(node)) {
                if distance_sq <= self.kill_sq {
                    relation.neighbours.remove(i);
                    self.met.push((first, index));
                } else {
                    relation.neighbours[i] = index;
                }
            }
            return relation.bond();
        }
        relation.neighbours.retain(|&node| {
            let is_blocked =
                distance_sq < apart_sq(node) && nodes[node as usize].pos.distance_squared(place) < apart_sq(node);
            !(is_blocked || node == parent && is_on(node))
        });
        if distance_sq <= self.kill_sq {
            relation.reached_by = Some(index);
        } else if is_own
            && !grid.any(place, distance_sq.sqrt(), |node, from_place_sq| {
                node < index && from_place_sq < distance_sq && apart_sq(node) < distance_sq
            })
        {
            relation.neighbours.push(index);
        }
        relation.bond()
    }

    /// Ages a marker that attracts nodes by one step; it dies when it is too old.
    pub(super) fn grow_older(&mut self, id: u32) -> Bond {
        let relation = &mut self.of[id as usize];
        relation.age += 1;
        if relation.age > self.patience { Bond::Dead } else { relation.bond() }
    }

    /// Removes a node from those that a marker attracts.
    pub(super) fn give_up(&mut self, id: u32, node: u32) -> Bond {
        let relation = &mut self.of[id as usize];
        relation.neighbours.retain(|&neighbour| neighbour != node);
        relation.bond()
    }
}

impl Relation {
    fn bond(&self) -> Bond {
        match (self.neighbours.first(), self.reached_by) {
            (Some(&node), _) => Bond::Attracts(node),
            (None, Some(_)) => Bond::Dead,
            (None, None) => Bond::Waits,
        }
    }
}

/// Steps after which a marker stops attracting nodes: twice the largest number that one of them needs.
pub(super) fn patience(params: &GrowthParams) -> u32 {
    let approaches = (params.crack_radius / params.step_length).powi(2) / PROGRESS;
    2 * (approaches.ceil() as u32 + 2)
}
