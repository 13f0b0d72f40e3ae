//! Healing, and what happens when a surface goes.

#[cfg(any(feature = "2d", feature = "3d"))]
use crate::plugin::api::CrackGroup;
use crate::plugin::api::{AnalogyProgress, CrackRecord, CrackState, CrackStats, CrackSurface, CrackTextures};
use crate::plugin::bake::work;
use crate::plugin::carrier::kind::Found;
use crate::plugin::carrier::kinds;
use crate::plugin::draw::async_playback::{self, AsyncPlayback};
use crate::plugin::draw::grow::CracksClosed;
use crate::plugin::draw::next_picture::NextPicture;
use crate::plugin::jobs::deferred::when_free;
use crate::plugin::shards::broken::drop_shards;
use crate::plugin::shards::request::cancel_requests;
use crate::plugin::surface::cracked::{self, active_mut, with_queues};
use crate::plugin::surface::owners::Owners;
use crate::plugin::surface::prepare;
use crate::plugin::surface::queue::HitQueue;
#[cfg(any(feature = "2d", feature = "3d"))]
use bevy::ecs::entity::EntityHashSet;
use bevy::prelude::*;

pub(super) fn close(world: &mut World, entity: Entity, seconds: f32) {
    give_up_record(world, entity);
    work::give_up(world, entity);
    let is_closing = active_mut(world, entity).is_some_and(|active| active.close(seconds));
    if is_closing {
        with_queues(world, entity, |queues, turn| queues.wake(entity, turn));
        async_playback::start(world, entity, None);
    } else {
        heal_now(world, entity);
    }
}

pub(super) fn heal(world: &mut World, entity: Entity) {
    // At once, wherever the list of bakes is; hits that come after this stay.
    give_up_record(world, entity);
    work::give_up(world, entity);
    purge(world, entity);
    when_free(world, move |world| heal_now(world, entity));
}

/// A record that is still to be taken up goes with the cracks that are there.
fn give_up_record(world: &mut World, entity: Entity) {
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.remove::<CrackRecord>();
    }
}

fn heal_now(world: &mut World, entity: Entity) {
    forget(world, entity);
    if let Some(mut state) = world.get_mut::<CrackState>(entity) {
        state.set_if_neq(CrackState::default());
    }
}

pub(super) fn purge(world: &mut World, entity: Entity) {
    if !world.contains_resource::<HitQueue>() {
        return;
    }
    world.resource_scope(|world, mut queue: Mut<HitQueue>| {
        #[cfg(any(feature = "2d", feature = "3d"))]
        let members: EntityHashSet = world.get::<CrackGroup>(entity).into_iter().flat_map(CrackGroup::iter).collect();
        if let Some(mut stats) = world.get_resource_mut::<CrackStats>() {
            queue.purge(entity, &mut stats);
            // A hit on a member is one on its group.
            #[cfg(any(feature = "2d", feature = "3d"))]
            queue.purge_inbox(|hit| members.contains(&hit), &mut stats);
        }
    });
}

/// Drops growth and textures and gives the entity back what it showed before.
fn forget(world: &mut World, entity: Entity) {
    work::cancel(world, entity);
    prepare::cancel(world, entity);
    cancel_requests(world, entity);
    let Some(mut active) = cracked::remove(world, entity) else {
        // A mesh that is being laid out is so around a hit that is gone.
        if let Some(kind) = kinds::inspect(world, entity).0 {
            kind.forget_layout(world, entity);
        }
        return;
    };
    drop_shards(world, entity, &mut active);
    if let Some(mut progress) = world.get_mut::<AnalogyProgress>(entity) {
        progress.set_if_neq(AnalogyProgress(0.0));
    }
    active.carrier.give_back(world, entity);
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.remove::<(CrackTextures, AsyncPlayback, NextPicture)>();
    }
}

/// A surface whose component goes is healed when commands are applied.
pub(crate) fn heal_removed(surface: On<Remove, CrackSurface>, mut commands: Commands) {
    let entity = surface.entity;
    commands.queue(move |world: &mut World| heal(world, entity));
}

/// Cracks that have closed are healed.
pub(crate) fn heal_closed(closed: On<CracksClosed>, mut commands: Commands) {
    let entity = closed.entity;
    commands.queue(move |world: &mut World| heal(world, entity));
}

/// A clone of a cracked entity shows the private textures of its original: it is given the original pictures.
pub(crate) fn disown_added(surface: On<Add, CrackSurface>, owners: Res<Owners>, mut commands: Commands) {
    if owners.has_any() {
        let entity = surface.entity;
        commands.queue(move |world: &mut World| when_free(world, move |world| disown(world, entity)));
    }
}

fn disown(world: &mut World, entity: Entity) {
    let (_, Found::Shown(shown)) = kinds::inspect(world, entity) else { return };
    let owner = world.resource::<Owners>().owner(shown.asset.id()).filter(|owner| *owner != entity);
    let Some(owner) = owner else { return };
    if let Some(mut active) = cracked::take(world, owner) {
        active.carrier.give_back(world, entity);
        cracked::put_back(world, owner, active);
    }
}
