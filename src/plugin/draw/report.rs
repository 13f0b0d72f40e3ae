//! What is shown of a surface is reported: its state, its cells, its end.

use crate::pattern::{Moment, NO_PARENT, SegmentId};
use crate::plugin::api::{CellClosed, CrackFinished, CrackState, CrackStatus, CrackTip};
use crate::plugin::surface::active::Active;
use bevy::prelude::*;

/// Reports what is shown of a surface that has been painted; `before` was shown before if it has a playback.
pub(crate) fn report_painted(
    active: &mut Active,
    entity: Entity,
    before: Option<Moment>,
    states: &mut Query<&mut CrackState>,
    commands: &mut Commands,
) {
    (active.turn.is_dirty, active.turn.is_late) = (false, false);
    active.drawing.painted += 1;
    let is_done = active.turn.is_open && active.is_complete();
    if !active.turn.is_stamping {
        report_cells(active, entity, commands);
    }
    if let Ok(mut state) = states.get_mut(entity) {
        write_state(active, &mut state, before, is_done);
    }
    active.close_playback();
    if is_done {
        active.turn.is_open = false;
        commands.trigger(CrackFinished { entity });
    }
}

/// Reports the cells that have closed and are shown closed for the first time.
fn report_cells(active: &mut Active, entity: Entity, commands: &mut Commands) {
    let now = active.shown().whole();
    while let Some(cell) =
        active.cracks.cells.cells().get(active.cracks.cells_reported).filter(|cell| cell.birth <= now)
    {
        let uv = active.drawing.field.frame.pos_to_uv(cell.centroid);
        let frozen = active.drawing.frozen.as_ref().map_or(0, |frozen| frozen.cells);
        commands.trigger(CellClosed {
            entity,
            cell: active.cracks.cells_reported as u32 + frozen,
            area: cell.area,
            uv,
        });
        active.cracks.cells_reported += 1;
    }
}

/// Writes down how the surface is doing; `before` was shown before if it has a playback.
fn write_state(active: &mut Active, state: &mut CrackState, before: Option<Moment>, is_done: bool) {
    let network = active.cracks.growth.network();
    let nodes = network.nodes();
    state.damage = active.drawing.touched.share();
    state.nodes = u32::try_from(nodes.len()).unwrap_or(u32::MAX);
    state.hits = active.cracks.hits;
    let (frozen, closed) = active.drawing.frozen.as_ref().map_or((0, 0), |frozen| (frozen.nodes, frozen.cells));
    state.frozen = frozen;
    let moment = active.shown();
    // In order of birth; the first is no piece.
    let cells = active.cracks.cells.cells().get(1..).unwrap_or_default();
    state.cells = closed + cells.partition_point(|cell| cell.birth <= moment.whole()) as u32;
    state.time = moment.steps() as f32;
    state.end = active.cracks.growth.timeline().end() as f32;
    if is_done {
        state.status = CrackStatus::Done;
    }
    // Those of the last frame in which any grew.
    if active.is_complete() || before.is_some() || nodes.len() != active.cracks.tips_from {
        state.tips.clear();
    }
    if active.is_complete() {
        // No crack is on its way.
    } else if let Some(before) = before {
        let timeline = active.cracks.growth.timeline();
        let born = if before < moment { timeline.born(before.whole(), moment.begun()) } else { 0..0 };
        let first = born.start.max(born.end.saturating_sub(CrackState::MAX_TIPS as u32));
        state.tips.extend((first..born.end).filter_map(|node| {
            // From the node it grows from to as far as it is shown.
            let way = |moment| match timeline.path_at(network, SegmentId::Branch(node), moment)?.points() {
                [from, .., to] => Some((to.pos, to.pos - from.pos)),
                _ => None,
            };
            let (tip, now) = way(moment)?;
            let length = now.length() - way(before).map_or(0.0, |(_, earlier)| earlier.length());
            let uv = active.drawing.field.frame.pos_to_uv(tip);
            Some(CrackTip { uv, direction: now.normalize_or_zero(), length: length.max(0.0) })
        }));
    } else if nodes.len() != active.cracks.tips_from {
        let first = active.cracks.tips_from.max(nodes.len().saturating_sub(CrackState::MAX_TIPS)).min(nodes.len());
        state.tips.extend(nodes[first..].iter().filter(|node| node.parent != NO_PARENT).map(|node| {
            let way = node.pos - nodes[node.parent as usize].pos;
            let uv = active.drawing.field.frame.pos_to_uv(node.pos);
            CrackTip { uv, direction: way.normalize_or_zero(), length: way.length() }
        }));
    }
    active.cracks.tips_from = nodes.len();
}
