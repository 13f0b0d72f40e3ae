//! Normals of surfaces at rest are made one with their cracks.

use super::async_playback::AsyncPlayback;
use crate::plugin::api::CrackBudget;
use crate::plugin::jobs::frame_time::FrameClock;
use crate::plugin::surface::cracked::Cracked;
use crate::plugin::surface::queues::Queues;
use bevy::{
    ecs::{entity_disabling::Disabled, query::Allow},
    prelude::*,
};

/// Goes on with the surfaces whose normals are to be blended and that are at rest: painted, and neither growing nor with their time passing.
pub(crate) fn blend_normals(
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    mut queues: ResMut<Queues>,
    mut surfaces: Query<(&mut Cracked, &AsyncPlayback), Allow<Disabled>>,
) {
    if queues.blending.is_empty() {
        return;
    }
    let timer = clock.start(&budget, 1.0);
    for _ in 0..queues.blending.len() {
        let Some(entity) = queues.blending.pop_front() else { break };
        let Ok((mut cracked, playback)) = surfaces.get_mut(entity) else { continue };
        let Some(active) = cracked.get_mut() else { continue };
        let turn = &active.turn;
        let is_at_rest = !(turn.is_growing || turn.is_dirty || turn.is_to_shatter);
        if is_at_rest {
            active.blend_normals(budget.is_unlimited());
            let is_dirty = active.canvas.views.iter().any(|view| !view.dirty.is_empty());
            // Tasks that play baked cracks see for themselves what is to be painted.
            if is_dirty && !playback.is_on() {
                queues.mark_dirty(entity, &mut active.turn);
            }
        }
        active.turn.is_blending = active.has_normals_to_blend();
        if active.turn.is_blending {
            queues.blending.push_back(entity);
        }
        if is_at_rest && timer.is_over() {
            break;
        }
    }
    clock.stop(&timer);
}
