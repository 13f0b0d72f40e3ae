//! Work in slices: [`Cursor`].

use std::ops::Range;

/// The progress of a layout.
#[derive(Clone, Debug, Default)]
pub(super) struct Cursor {
    next: u64,
    /// Places that this slice may still visit.
    pub(super) left: u32,
    /// Markers that were kept.
    pub(super) kept: u32,
}

impl Cursor {
    /// A slice of this many places.
    pub(super) fn of(places: u32) -> Self {
        Self { left: places, ..Self::default() }
    }

    /// Continues where another slice has ended.
    pub(super) const fn go_on(&mut self, from: &Self) {
        self.next = from.next;
    }

    /// Goes back to the first place.
    pub(super) const fn rewind(&mut self) {
        self.next = 0;
    }

    /// Whether the slice is used up.
    pub(super) const fn is_spent(&self) -> bool {
        self.left == 0
    }

    /// The next of `all` items, as many as fit into the slice at `cost` places each, at least one.
    pub(super) fn slice(&mut self, all: u64, cost: u32) -> Range<u64> {
        let first = self.next.min(all);
        let count = u64::from((self.left / cost.max(1)).max(1)).min(all - first);
        self.next = first + count;
        self.left = self.left.saturating_sub((count as u32).saturating_mul(cost));
        first..self.next
    }

    /// Whether all are done.
    pub(super) const fn is_at(&self, all: u64) -> bool {
        self.next >= all
    }
}
