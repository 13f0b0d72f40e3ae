//! What groups of sprites and groups of meshes have in common.

use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{
    CrackAnalogy, CrackBudget, CrackError, CrackGroup, CrackRecord, CrackStrands, CrackSurface, GuidedCracks,
};
use crate::plugin::jobs::copy::MAX_BYTES;
use crate::plugin::jobs::frame_time::{FrameClock, Timer};
use crate::plugin::surface::prepare::{self, Preparations};
use crate::plugin::surface::queue::HitQueue;
use bevy::{
    ecs::{component::Mutable, entity::EntityHashSet},
    prelude::*,
};

/// Share of the frame's budget after which no further slice is made.
const SHARE: f32 = 0.9;

/// What is made of the members of a group: a component of it.
pub(super) trait Whole: Component<Mutability = Mutable> + Default {
    /// Whether it is for this group.
    fn is_for(world: &World, group: Entity) -> bool;

    /// A frame's work; whether there is anything to remember.
    fn go_on(&mut self, world: &mut World, group: Entity, frame: &mut GroupFrame<'_>) -> Result<bool, CrackError>;

    /// Gives up what is being made. What is shown stays until the cracks are healed.
    fn rest(&mut self);
}

/// What a frame has for a group.
pub(super) struct GroupFrame<'a> {
    /// Whether something waits for the group to be shown as one.
    pub(super) wanted: bool,
    /// Whether some member has changed.
    pub(super) has_changed: bool,
    pub(super) timer: &'a Timer,
    /// Bytes that may still be copied in it.
    pub(super) left: usize,
}

/// Whether there is any group.
pub(super) fn any_groups<W: Component>(groups: Query<(), Or<(With<CrackGroup>, With<W>)>>) -> bool {
    !groups.is_empty()
}

/// Goes on with all groups; some members of those in `changes` have changed.
pub(super) fn go_on_with_all<W: Whole>(world: &mut World, found: &mut Vec<Entity>, changes: &EntityHashSet) {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    let mut groups = world.query_filtered::<Entity, Or<(With<CrackGroup>, With<W>)>>();
    found.clear();
    found.extend(groups.iter(world));
    found.sort_unstable();
    let prepared: EntityHashSet = world.resource::<Preparations>().wanted().collect();
    let mut frame = GroupFrame { wanted: false, has_changed: false, timer: &timer, left: MAX_BYTES };
    for &group in found.iter() {
        frame.wanted = is_wanted(world, group, &prepared);
        frame.has_changed = changes.contains(&group);
        let whole = world.get_mut::<W>(group).map(|mut whole| core::mem::take(&mut *whole));
        if whole.is_none() && !(frame.wanted && W::is_for(world, group)) {
            continue;
        }
        let mut whole = whole.unwrap_or_default();
        match whole.go_on(world, group, &mut frame) {
            Ok(true) => match world.get_mut::<W>(group) {
                Some(mut place) => *place = whole,
                None => _ = world.get_entity_mut(group).map(|mut group| _ = group.insert(whole)),
            },
            Ok(false) => _ = world.get_entity_mut(group).map(|mut group| _ = group.remove::<W>()),
            Err(error) => {
                whole.rest();
                if let Some(mut place) = world.get_mut::<W>(group) {
                    *place = whole;
                }
                prepare::fail(world, group, error);
            }
        }
    }
    world.resource_mut::<FrameClock>().stop(&timer);
}

/// Whether a group is one of meshes in 3D.
pub(super) fn is_solid(world: &World, group: Entity) -> bool {
    #[cfg(feature = "2d")]
    if world.get::<Sprite>(group).is_some() {
        return false;
    }
    #[cfg(feature = "3d")]
    {
        let has_mesh = |entity| world.get::<Mesh3d>(entity).is_some();
        has_mesh(group) || world.get::<CrackGroup>(group).is_some_and(|members| members.iter().any(has_mesh))
    }
    #[cfg(not(feature = "3d"))]
    false
}

/// Whether something waits for a group to be shown as one. `prepared` are those that are to be made without a hit.
fn is_wanted(world: &World, group: Entity, prepared: &EntityHashSet) -> bool {
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
