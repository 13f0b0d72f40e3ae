//! Freezing: a surface that has all its nodes keeps the picture of its oldest cracks and forgets the rest of them.

use super::async_playback::is_at_work;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::active;
use crate::plugin::surface::cracks::Cracks;
use crate::plugin::surface::drawing::{Drawing, Frozen};
use crate::plugin::surface::stamp::{Scratch, stamp};
use bevy::prelude::*;

/// Whether less than a quarter of its nodes are left to a surface. One whose time may be turned back needs all of its cracks.
fn is_full(active: &Active) -> bool {
    let growth = &active.cracks.growth;
    active.playhead.playback.is_none() && growth.nodes_left() < growth.params().max_nodes.div_ceil(4)
}

/// Whether a hit has to wait for room: what is to be frozen is being drawn again.
pub(crate) fn has_to_wait(world: &World, entity: Entity) -> bool {
    is_at_work(world, entity) && active(world, entity).is_some_and(is_full)
}

/// Makes room for a hit: a surface that is full forgets all but the newest half of its nodes.
pub(crate) fn freeze_if_full(active: &mut Active) {
    if !is_full(active) {
        return;
    }
    let most = active.cracks.growth.params().max_nodes;
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
