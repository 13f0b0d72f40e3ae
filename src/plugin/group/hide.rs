//! Members that are not drawn, because the group shows them.

use crate::plugin::api::CrackMemberOf;
use bevy::{camera::visibility::RenderLayers, ecs::entity::EntityHashSet, prelude::*};

/// Frames after which members are hidden that the group shows: by then it is drawn.
const SHOWN_FOR: u32 = 3;

/// Members that are hidden, or shown again, in a frame.
const MAX_MEMBERS: usize = 512;

/// The members that a group shows in their place.
#[derive(Default)]
pub(super) struct Replaced {
    members: Vec<Entity>,
    /// How many of them are hidden.
    hidden: usize,
    /// For how many frames the group has been cracked.
    frames: u32,
}

impl Replaced {
    /// Goes on with hiding them, once the group has been drawn.
    pub(super) fn hide_more(&mut self, world: &mut World, has_cracked: bool) {
        self.frames = if has_cracked { self.frames.saturating_add(1) } else { 0 };
        if self.frames > SHOWN_FOR {
            let next = self.members.iter().skip(self.hidden).take(MAX_MEMBERS);
            next.for_each(|member| hide(world, *member));
            self.hidden = (self.hidden + MAX_MEMBERS).min(self.members.len());
        }
    }

    /// Shows some of them again; whether that were all.
    pub(super) fn show_more(&mut self, world: &mut World) -> bool {
        let stay = self.hidden.saturating_sub(MAX_MEMBERS);
        let next = self.members.iter().take(self.hidden).skip(stay);
        next.for_each(|member| show(world, *member));
        self.hidden = stay;
        stay == 0
    }

    /// The group shows these; others are drawn by themselves again.
    pub(super) fn become_of(&mut self, world: &mut World, members: Vec<Entity>) {
        let stay: EntityHashSet = members.iter().copied().collect();
        for member in self.members.iter().filter(|member| !stay.contains(*member)) {
            show(world, *member);
        }
        // Those that are hidden come first, so that all of them are shown again.
        let is_hidden = |member: &Entity| world.get::<HiddenMember>(*member).is_some();
        let (mut all, more): (Vec<_>, Vec<_>) = members.into_iter().partition(is_hidden);
        self.hidden = all.len();
        all.extend(more);
        self.members = all;
    }
}

/// The layers that a group is drawn in, if its members' and not its own.
#[derive(Default)]
pub(super) struct GivenLayers(Option<RenderLayers>);

impl GivenLayers {
    /// Gives a group the layers of its members, if it has none.
    pub(super) fn give(&mut self, group: &mut EntityWorldMut, layers: Option<RenderLayers>) {
        if let Some(layers) = layers.filter(|_| !group.contains::<RenderLayers>()) {
            group.insert(layers.clone());
            self.0 = Some(layers);
        }
    }

    /// Takes them away again, unless somebody has given it others meanwhile.
    pub(super) fn take_back(&mut self, group: &mut EntityWorldMut) {
        if self.0.take().is_some_and(|given| group.get::<RenderLayers>() == Some(&given)) {
            group.remove::<RenderLayers>();
        }
    }
}

/// A member that is not drawn, and the layers that it was drawn in before.
#[derive(Component)]
#[component(clone_behavior = Ignore)]
pub(crate) struct HiddenMember(Option<RenderLayers>);

/// No camera sees it any more. Its children are drawn as before.
fn hide(world: &mut World, member: Entity) {
    let Ok(mut member) = world.get_entity_mut(member) else { return };
    if !member.contains::<HiddenMember>() {
        let before = member.get::<RenderLayers>().cloned();
        member.insert((HiddenMember(before), RenderLayers::none()));
    }
}

/// It is drawn as before, unless somebody has given it other layers meanwhile.
fn show(world: &mut World, member: Entity) {
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
