//! Freezing: a surface that has all its nodes keeps the picture of its oldest cracks and forgets the rest of them.

use super::{
    paint::{Scratch, stamp},
    surfaces::Active,
};
use crate::{Grid, pattern::CellTracker, raster::DepthField};

/// What a surface has forgotten of its cracks, and still shows.
pub(super) struct Frozen {
    /// All of the picture when they were frozen.
    depth: Grid<u16>,
    pub(super) nodes: u32,
    /// Cells that they closed.
    pub(super) cells: u32,
}

impl Frozen {
    /// Draws it into a field of any size.
    pub(super) fn draw(&self, field: &mut DepthField) {
        let (from, to) = (self.depth.size(), field.depth.size());
        for y in 0..to.y {
            let row = self.depth.row((u64::from(y) * u64::from(from.y) / u64::from(to.y)) as usize);
            for (x, depth) in (0u64..).zip(field.depth.row_mut(y as usize)) {
                let frozen = row.get((x * u64::from(from.x) / u64::from(to.x)) as usize);
                *depth = (*depth).max(frozen.copied().unwrap_or(0));
            }
        }
    }
}

impl Active {
    /// Makes room for a hit: with less than a quarter of its nodes left, a surface forgets all but the newest half of them. A surface
    /// whose time may be turned back needs all of its cracks.
    pub(super) fn freeze_if_full(&mut self) {
        let most = self.growth.params().max_nodes;
        if self.playback.is_some() || self.growth.nodes_left() >= most.div_ceil(4) {
            return;
        }
        stamp(self, &mut Scratch::default());
        self.cells.update(self.growth.network());
        let gone = self.growth.forget_oldest(most / 2);
        self.field.freeze_layer(self.growth.network(), self.growth.timeline());
        let before = self.frozen.take();
        let (nodes, cells) = before.map_or((0, 0), |before| (before.nodes, before.cells));
        let closed = cells + self.cells.closed();
        self.cells = CellTracker::new(self.field.frame.extent());
        self.cells.update(self.growth.network());
        self.cells_told = self.cells.cells().len();
        self.tips_from = self.tips_from.saturating_sub(gone as usize);
        self.fell_at = (self.fell_at.0.saturating_sub(gone as usize), self.cells_told);
        let cells = closed.saturating_sub(self.cells.closed());
        self.frozen = Some(Frozen { depth: self.field.depth.clone(), nodes: nodes.saturating_add(gone), cells });
    }
}
