//! Markers that have not settled, and how far a field has come with them.

use crate::growth::cursor::Cursor;
use glam::Vec2;

/// A marker that has not settled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Newborn {
    pub(super) pos: Vec2,
    pub(super) id: u32,
    pub(super) loyal: u32,
    pub(super) given_up: u8,
    /// Squared distance beyond which nothing is nearer.
    pub(super) near_sq: f32,
}

/// How far a field has come with its newborn markers.
#[derive(Clone, Debug, Default)]
pub(super) struct Settling {
    pub(super) phase: Phase,
    pub(super) cursor: Cursor,
    pub(super) all: Vec<Newborn>,
    /// The cell of each of them.
    pub(super) homes: Vec<u32>,
    /// The next place of each cell.
    pub(super) next: Vec<u32>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Phase {
    /// The living are taken out of their places.
    #[default]
    Gather,
    /// Cells get to know how many they will have.
    Count,
    /// All get a place.
    Place,
    /// What they know of nodes already holds.
    Recall,
    /// Nodes look at them.
    Visit,
}

impl Settling {
    /// Markers that are nowhere else.
    pub(super) fn in_hand(&self) -> usize {
        if self.phase == Phase::Count { self.all.len() } else { 0 }
    }
}
