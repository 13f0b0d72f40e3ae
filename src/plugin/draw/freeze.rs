//! Freezing: a surface that has all its nodes keeps the picture of its oldest cracks and forgets the rest of them.

use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracks::Cracks;
use crate::plugin::surface::drawing::{Drawing, Frozen};
use crate::plugin::surface::stamp::{Scratch, stamp};

/// Makes room for a hit: with less than a quarter of its nodes left, a surface forgets all but the newest half of them. A surface
/// whose time may be turned back needs all of its cracks.
pub(crate) fn freeze_if_full(active: &mut Active) {
    let most = active.cracks.growth.params().max_nodes;
    if active.playhead.playback.is_some() || active.cracks.growth.nodes_left() >= most.div_ceil(4) {
        return;
    }
    stamp(active, &mut Scratch::default());
    let Drawing { field, frozen, .. } = &mut active.drawing;
    let Cracks { growth, cells, .. } = &mut active.cracks;
    let (now, gone) = Frozen::after(frozen.take(), growth, most / 2, field, cells);
    *frozen = Some(now);
    if let Some(added) = &mut active.cracks.added {
        // What is forgotten does not move any more.
        added.motion = None;
    }
    active.cracks.cells_reported = active.cracks.cells.cells().len();
    active.cracks.tips_from = active.cracks.tips_from.saturating_sub(gone as usize);
    active.fell_at = (active.fell_at.0.saturating_sub(gone as usize), active.cracks.cells_reported);
}
