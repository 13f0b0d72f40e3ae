//! [`Cracked`]: the private component of a surface that has been hit.

use super::active::{Active, Turn};
use super::owners::Owners;
use super::queues::Queues;
use bevy::{
    ecs::{
        entity::EntityIndexSet, entity_disabling::Disabled, lifecycle::HookContext, query::Allow, world::DeferredWorld,
    },
    prelude::*,
};
use std::collections::VecDeque;

/// The state of a surface that has been hit.
///
/// It is taken out while a system needs the world beside it. Whatever asks for the surface meanwhile finds none, and what is asked of it is
/// done later, see [`hold`](crate::plugin::jobs::deferred::hold).
#[derive(Component)]
#[component(clone_behavior = Ignore, on_remove = removed)]
pub(crate) struct Cracked(Option<Box<Active>>);

/// The surfaces that have been hit. Those of disabled entities go on as all others.
pub(crate) type CrackedSurfaces<'w, 's> = Query<'w, 's, (Entity, &'static mut Cracked), Allow<Disabled>>;

impl Cracked {
    pub(crate) fn get(&self) -> Option<&Active> {
        self.0.as_deref()
    }

    pub(crate) fn get_mut(&mut self) -> Option<&mut Active> {
        self.0.as_deref_mut()
    }
}

/// The state of a surface, if it has been hit.
pub(crate) fn active(world: &World, entity: Entity) -> Option<&Active> {
    world.get::<Cracked>(entity)?.get()
}

/// The same, to change it.
pub(crate) fn active_mut(world: &mut World, entity: Entity) -> Option<&mut Active> {
    world.get_mut::<Cracked>(entity)?.into_inner().get_mut()
}

/// Whether a surface has been hit.
pub(crate) fn has_cracked(world: &World, entity: Entity) -> bool {
    active(world, entity).is_some()
}

/// Gives an entity its state, and the component that names its textures. Observers and commands that wait run then, and may heal the
/// surface.
pub(crate) fn insert(world: &mut World, entity: Entity, active: Box<Active>) {
    let Ok(mut to) = world.get_entity_mut(entity) else { return };
    let textures = active.canvas.textures.clone();
    to.resource_mut::<Owners>().add(entity, &active);
    to.insert((Cracked(Some(active)), textures));
}

/// Takes the state of a surface out, for [`put_back`].
pub(crate) fn take(world: &mut World, entity: Entity) -> Option<Box<Active>> {
    world.get_mut::<Cracked>(entity)?.0.take()
}

/// Puts the state of a surface back that was taken out. An entity that is gone needs none.
pub(crate) fn put_back(world: &mut World, entity: Entity, active: Box<Active>) {
    match world.get_mut::<Cracked>(entity) {
        Some(mut cracked) => cracked.0 = Some(active),
        None => forget(&mut world.into(), entity, &active),
    }
}

/// Lets `change` put other assets in the place of those that a surface shows.
pub(crate) fn with_other_assets<T>(
    world: &mut World,
    entity: Entity,
    active: &mut Active,
    change: impl FnOnce(&mut World, &mut Active) -> T,
) -> T {
    world.resource_mut::<Owners>().remove(entity, active);
    let result = change(world, active);
    world.resource_mut::<Owners>().add(entity, active);
    result
}

/// Takes the state of a surface away for good.
pub(crate) fn remove(world: &mut World, entity: Entity) -> Option<Box<Active>> {
    let active = take(world, entity)?;
    forget(&mut world.into(), entity, &active);
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.remove::<Cracked>();
    }
    Some(active)
}

fn removed(mut world: DeferredWorld, context: HookContext) {
    if let Some(active) = world.get_mut::<Cracked>(context.entity).and_then(|mut cracked| cracked.0.take()) {
        forget(&mut world, context.entity, &active);
    }
}

fn forget(world: &mut DeferredWorld, entity: Entity, active: &Active) {
    if let Some(mut owners) = world.get_resource_mut::<Owners>() {
        owners.remove(entity, active);
    }
    if let Some(mut queues) = world.get_resource_mut::<Queues>() {
        queues.remove(entity, &active.turn);
    }
}

/// Does something with the queues and the turn of a surface that has been hit.
pub(crate) fn with_queues<T>(
    world: &mut World,
    entity: Entity,
    work: impl FnOnce(&mut Queues, &mut Turn) -> T,
) -> Option<T> {
    world.resource_scope(|world, mut queues: Mut<Queues>| Some(work(&mut queues, &mut active_mut(world, entity)?.turn)))
}

/// The most surfaces that are worked on at once.
const BATCH: usize = 128;

/// Takes the first surfaces out of a queue in which each is once, and makes a job of each that is there.
pub(crate) fn batch<'a, J>(
    surfaces: &'a mut CrackedSurfaces,
    queue: &mut VecDeque<Entity>,
    mut job: impl FnMut(Entity, &'a mut Active) -> Option<J>,
) -> Vec<J> {
    let entities: EntityIndexSet = queue.drain(..queue.len().min(BATCH)).collect();
    let found = surfaces.iter_many_unique_mut(&entities);
    found.filter_map(|(entity, cracked)| job(entity, cracked.into_inner().get_mut()?)).collect()
}
