//! Freezing: a surface that has all its nodes keeps the picture of its oldest cracks and forgets the rest of them.

use crate::pattern::CellTracker;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::drawing::Frozen;
use crate::plugin::surface::stamp::{Scratch, stamp};

/// Makes room for a hit: with less than a quarter of its nodes left, a surface forgets all but the newest half of them. A surface
/// whose time may be turned back needs all of its cracks.
pub(crate) fn freeze_if_full(active: &mut Active) {
    let most = active.cracks.growth.params().max_nodes;
    if active.playhead.playback.is_some() || active.cracks.growth.nodes_left() >= most.div_ceil(4) {
        return;
    }
    stamp(active, &mut Scratch::default());
    active.cracks.cells.update(active.cracks.growth.network());
    let gone = active.cracks.growth.remove_oldest(most / 2);
    active.drawing.field.freeze_layer(active.cracks.growth.network(), active.cracks.growth.timeline());
    if let Some(added) = &mut active.cracks.added {
        // What is forgotten does not move any more.
        added.motion = None;
    }
    let before = active.drawing.frozen.take();
    let (nodes, cells) = before.map_or((0, 0), |before| (before.nodes, before.cells));
    let closed = cells + active.cracks.cells.closed();
    active.cracks.cells = CellTracker::new(active.drawing.field.frame.extent());
    active.cracks.cells.update(active.cracks.growth.network());
    active.cracks.cells_reported = active.cracks.cells.cells().len();
    active.cracks.tips_from = active.cracks.tips_from.saturating_sub(gone as usize);
    active.fell_at = (active.fell_at.0.saturating_sub(gone as usize), active.cracks.cells_reported);
    let cells = closed.saturating_sub(active.cracks.cells.closed());
    active.drawing.frozen =
        Some(Frozen { depth: active.drawing.field.depth.clone(), nodes: nodes.saturating_add(gone), cells });
}
