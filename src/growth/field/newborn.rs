//! Unsettled markers, and the progress of settling them.

use crate::growth::cursor::Cursor;
use glam::Vec2;

/// A marker that is not settled yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Newborn {
    pub(super) pos: Vec2,
    pub(super) id: u32,
    pub(super) owner: u32,
    pub(super) given_up: u8,
    /// Squared distance of the nearest known crack, or the limit of the search.
    pub(super) near_sq: f32,
    /// The node that attracts it, if that is known.
    pub(super) node: u32,
    /// Whether it is: then none of the nodes that have been shown to the field is nearer.
    pub(super) is_known: bool,
}

/// The progress of settling new markers.
#[derive(Clone, Debug, Default)]
pub(super) struct Settling {
    pub(super) phase: Phase,
    pub(super) cursor: Cursor,
    pub(super) all: Vec<Newborn>,
    /// The cell of each marker.
    pub(super) homes: Vec<u32>,
    /// The next free index of each cell.
    pub(super) next: Vec<u32>,
    /// Which cells of nodes have a marker, if it is worth knowing.
    pub(super) marked: Vec<bool>,
    /// The nodes that visit their markers, if they are picked.
    pub(super) picked: Option<Picked>,
}

/// The nodes that visit their markers: others would find none.
#[derive(Clone, Debug)]
pub(super) struct Picked {
    /// By index.
    pub(super) nodes: Vec<u32>,
    /// The node from which on all visit: they have been shown to no marker.
    pub(super) end: u32,
    /// Share of the field that they lie in.
    pub(super) share: f32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Phase {
    /// The living markers are collected.
    #[default]
    Gather,
    /// The markers of each cell are counted.
    Count,
    /// All markers are sorted into cells.
    Place,
    /// Known distances to nodes are restored.
    Recall,
    /// Nodes visit the new markers.
    Visit,
}

impl Settling {
    /// Number of nodes that visit their markers, of so many.
    pub(super) fn visits(&self, nodes: usize) -> usize {
        self.picked.as_ref().map_or(nodes, |picked| picked.nodes.len() + nodes - picked.end as usize)
    }

    /// The node that is the `k`th to visit its markers.
    pub(super) fn visitor(&self, k: usize) -> u32 {
        self.picked.as_ref().map_or(k as u32, |Picked { nodes, end, .. }| {
            nodes.get(k).copied().unwrap_or_else(|| end + (k - nodes.len()) as u32)
        })
    }

    /// Number of markers that are only stored here.
    pub(super) fn in_hand(&self) -> usize {
        if self.phase == Phase::Count { self.all.len() } else { 0 }
    }
}
