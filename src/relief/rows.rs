//! Work on the rows of a grid in steps: [`Rows`].

use glam::UVec2;
use std::ops::Range;

/// Texels of a step in which each takes long, about.
pub(super) const FEW: usize = 1 << 12;

/// Texels of a step in which each is only read, or added to a sum, about.
pub(super) const MANY: usize = 1 << 15;

/// The rows of a grid that are still to be worked on.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    next: usize,
    height: usize,
    width: usize,
}

impl Rows {
    pub(super) fn new(size: UVec2) -> Self {
        Self { next: 0, height: size.y as usize, width: size.x as usize }
    }

    /// The rows of the next step: so many that they have `texels` at most, but one at least unless all are done.
    pub(super) fn take(&mut self, texels: usize) -> Range<usize> {
        let first = self.next;
        self.next = (first + (texels / self.width.max(1)).max(1)).min(self.height);
        #[cfg(test)]
        tests::TAKEN.set(tests::TAKEN.get() + (self.next - first) * self.width);
        first..self.next
    }

    pub(super) fn is_done(&self) -> bool {
        self.next == self.height
    }

    /// How much is done, 0..=1.
    pub(super) fn share(&self) -> f32 {
        self.next as f32 / self.height.max(1) as f32
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::cell::Cell;

    std::thread_local! {
        /// Texels of all rows that were taken on this thread.
        pub(in super::super) static TAKEN: Cell<usize> = const { Cell::new(0) };
    }

    #[test]
    fn all_rows_are_taken_once() {
        for (size, texels) in [([10, 7], 25), ([10, 7], 3), ([1, 9], 100), ([10, 0], 5), ([0, 3], 5)] {
            let mut rows = Rows::new(size.into());
            let mut taken = Vec::new();
            while !rows.is_done() {
                assert!(rows.share() < 1.0);
                let next = rows.take(texels);
                assert!(!next.is_empty() && (next.len() == 1 || next.len() * size[0] as usize <= texels));
                taken.extend(next);
            }
            assert!(taken.into_iter().eq(0..size[1] as usize));
        }
    }
}
