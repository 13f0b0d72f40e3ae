//! What groups of sprites and groups of meshes have in common.

use crate::plugin::api::{CrackAnalogy, CrackRecord, CrackStrands, CrackSurface, GuidedCracks, error::EntityLabel};
use crate::plugin::surface::queue::HitQueue;
use bevy::{ecs::entity::EntityHashSet, prelude::*};

/// Share of the frame's budget after which no further slice is made.
pub(super) const SHARE: f32 = 0.9;

/// Whether something waits for a group to be shown as one. `prepared` are those that are to be made without a hit.
pub(super) fn is_wanted(world: &World, group: Entity, prepared: &EntityHashSet) -> bool {
    let Ok(entity) = world.get_entity(group) else { return false };
    entity.contains::<CrackSurface>()
        && (world.resource::<HitQueue>().first(group).is_some()
            || prepared.contains(&group)
            || entity.contains::<GuidedCracks>()
            || entity.contains::<CrackStrands>()
            || entity.contains::<CrackRecord>()
            || entity.contains::<CrackAnalogy>())
}

/// Says once why members of a group are left out.
pub(super) fn warn_left_out(world: &World, group: Entity, reason: Option<&str>, has_warned: &mut bool) {
    if let Some(reason) = reason
        && !core::mem::replace(has_warned, true)
    {
        warn!("a member of the group {} is left out: {reason}", EntityLabel::of(world, group));
    }
}
