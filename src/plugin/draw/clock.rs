//! Clocks that were set, changed or removed.

use super::async_playback::AsyncPlayback;
use crate::plugin::api::{CrackClock, CrackTextures};
use crate::plugin::surface::cracked::Cracked;
use crate::plugin::surface::queues::Queues;
use bevy::{
    ecs::{entity_disabling::Disabled, query::Allow},
    prelude::*,
};

/// Applies clocks that were set, changed or removed.
pub(crate) fn follow_clocks(
    mut changed: Query<(Entity, &mut CrackClock), (Changed<CrackClock>, With<CrackTextures>)>,
    mut removed: RemovedComponents<CrackClock>,
    mut surfaces: Query<(&mut Cracked, &mut AsyncPlayback), Allow<Disabled>>,
    mut queues: ResMut<Queues>,
) {
    for entity in removed.read() {
        if let Ok((mut cracked, _)) = surfaces.get_mut(entity)
            && let Some(active) = cracked.get_mut()
        {
            active.unfollow();
            queues.wake(entity, &mut active.turn);
        }
    }
    for (entity, mut clock) in &mut changed {
        if let Ok((mut cracked, mut playback)) = surfaces.get_mut(entity)
            && let Some(active) = cracked.get_mut()
        {
            let is_first = active.playhead.playback.is_none();
            active.follow(clock.bypass_change_detection());
            queues.wake(entity, &mut active.turn);
            if AsyncPlayback::is_for(active) {
                playback.turn_on();
            }
            if is_first {
                // What has grown frame by frame is drawn once more, at a stroke.
                queues.mark_dirty(entity, &mut active.turn);
            }
        }
    }
}
