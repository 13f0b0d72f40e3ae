//! The pull of markers on a node.

use glam::Vec2;

pub(super) const NO_PULL: u32 = u32::MAX;

/// The markers that attract one node: `S(c)` of Couto et al.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pull {
    pub(super) node: u32,
    /// Sum of the unit vectors to the markers, in units of 2⁻²⁴: integers, so that the order does not matter.
    pub(super) sum: [i64; 2],
    pub(super) closest: u32,
    pub(super) closest_sq: f32,
    pub(super) closest_id: u32,
    pub(super) child: Vec2,
    /// The direction to the child without its kink.
    pub(super) course: Vec2,
    /// The direction of the segment to the node.
    pub(super) heading: Vec2,
    /// The fork angles to the left and to the right, where there are markers for a fork; 0 if there are none.
    pub(super) fork: f32,
    pub(super) has_markers: [bool; 2],
    /// The end of the first segment of the side branch.
    pub(super) side: Option<Vec2>,
    pub(super) serves: bool,
    /// The direction in which nothing can grow from the node: its markers on that side are given up.
    pub(super) stopped: Option<Vec2>,
}

/// What a step does, one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// Adds up how markers pull nodes.
    Gathering,
    /// Finds out where the nodes that are pulled grow to.
    Aiming,
    /// Finds out whom that serves.
    Serving,
    /// These nodes grow.
    Growing,
    /// The new nodes look for markers.
    Visiting,
}

/// A step that is made in part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub(super) stage: Stage,
    /// The next marker or node of the stage.
    pub(super) at: usize,
    /// The first node that it adds.
    pub(super) first: u32,
    /// How many nodes it may add.
    pub(super) room: usize,
    /// Whether markers are to be given up.
    pub(super) any_stopped: bool,
}
