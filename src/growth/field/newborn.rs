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
    /// Number of markers that are only stored here.
    pub(super) fn in_hand(&self) -> usize {
        if self.phase == Phase::Count { self.all.len() } else { 0 }
    }
}
