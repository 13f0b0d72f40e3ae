//! Members that are not drawn, because the group shows them.

use crate::plugin::api::CrackMemberOf;
use bevy::{camera::visibility::RenderLayers, prelude::*};

/// A member that is not drawn, and the layers that it was drawn in before.
#[derive(Component)]
#[component(clone_behavior = Ignore)]
pub(crate) struct HiddenMember(Option<RenderLayers>);

/// No camera sees it any more. Its children are drawn as before.
pub(super) fn hide(world: &mut World, member: Entity) {
    let Ok(mut member) = world.get_entity_mut(member) else { return };
    if !member.contains::<HiddenMember>() {
        let before = member.get::<RenderLayers>().cloned();
        member.insert((HiddenMember(before), RenderLayers::none()));
    }
}

/// It is drawn as before, unless somebody has given it other layers meanwhile.
pub(super) fn show(world: &mut World, member: Entity) {
    let Ok(mut member) = world.get_entity_mut(member) else { return };
    let Some(HiddenMember(before)) = member.take::<HiddenMember>() else { return };
    if member.get::<RenderLayers>() != Some(&RenderLayers::none()) {
        return;
    }
    match before {
        Some(before) => _ = member.insert(before),
        None => _ = member.remove::<RenderLayers>(),
    }
}

/// Who leaves a group is drawn by itself.
pub(crate) fn show_leaving(
    left: On<Remove, CrackMemberOf>,
    hidden: Query<(), With<HiddenMember>>,
    mut commands: Commands,
) {
    let member = left.entity;
    if hidden.contains(member) {
        commands.queue(move |world: &mut World| show(world, member));
    }
}
