//! Healing, and what happens when a surface goes.

use super::{
    CrackState, CrackStats, CrackTextures, ShatterRequest, bake,
    carrier::{self, Found},
    later::when_free,
    prepare::{self, Preparations},
    queue::HitQueue,
    shards::{Request, drop_shards},
    surfaces::Surfaces,
};
use bevy::{
    ecs::{system::EntityCommands, world::DeferredWorld},
    prelude::*,
};

/// Commands for surfaces.
pub trait CrackCommandsExt {
    /// Makes a surface ready for its first hit: for what is sure to be hit, while a level loads.
    ///
    /// Without it the crack of a first hit shows in the frame of the hit with textures of up to 512 x 512 texels, unless many are hit for
    /// the first time at once or its lines are to be read (those of brick, see [`CrackMaskSource`](super::CrackMaskSource)), and some frames
    /// later on larger ones: they are made beside the frames. A surface that is prepared takes
    /// the memory of one that has cracked, and shows its textures from the frame on in which [`CrackTextures`] is added. Surfaces that are
    /// hit come first. Does nothing on entities without a [`CrackSurface`](super::CrackSurface), or with cracks; one that cannot crack says
    /// so with [`CrackFailed`](super::CrackFailed). Healing takes it back.
    ///
    /// ```
    /// use bevy::prelude::*;
    /// use bevy_crack::prelude::*;
    ///
    /// fn prepare(mut commands: Commands, walls: Query<Entity, Added<CrackSurface>>) {
    ///     for wall in &walls {
    ///         commands.entity(wall).prepare_cracks();
    ///     }
    /// }
    /// bevy::ecs::system::assert_is_system(prepare);
    /// ```
    fn prepare_cracks(&mut self) -> &mut Self;

    /// Takes all cracks away, those of [`GuidedCracks`](super::GuidedCracks) too, and all shards and holes: the surface shows its
    /// own pictures again, its textures and its growth are dropped. Hits that wait on it are refused, and so are those that were triggered
    /// before it in the same frame; those written as messages are read at the end of the frame, and crack it anew. Does nothing on entities
    /// without cracks.
    fn heal_cracks(&mut self) -> &mut Self;

    /// Closes all cracks within so many seconds: they run back the way they came, whatever a [`CrackClock`](super::CrackClock)
    /// says, and are healed as by [`heal_cracks`](Self::heal_cracks) then. Hits that wait on the surface are refused; one that comes
    /// while they close makes them grow on from where they are. Not a number, zero or below: at once; infinite: they stand still.
    fn close_cracks(&mut self, seconds: f32) -> &mut Self;

    /// Knocks shards out of a cracked surface, along the cracks it has. Nothing happens to an entity without cracks; one
    /// that cannot shatter says so with [`ShatterFailed`](super::ShatterFailed). See [`ShatterCracks`](super::ShatterCracks).
    ///
    /// The shards are those of this frame, and are there two frames later, on every machine (later only where the renderer has not made its
    /// pipelines for shards yet; with [`ShatterCracks`](super::ShatterCracks) on the surface, it is asked to beforehand): they are made on the
    /// [`AsyncComputeTaskPool`](bevy::tasks::AsyncComputeTaskPool) meanwhile. Only if they are not ready then, or the surface has been
    /// shattered or mended in between, they are made in that frame. Where there are more than 500 nodes of cracks, they have one frame more
    /// for each 500, up to 20, and no frame waits for them; with a [`CrackBudget::milliseconds`](super::CrackBudget::milliseconds) of a
    /// second or more it is two frames there, too. Healing takes the request back.
    fn shatter_cracks(&mut self, request: ShatterRequest) -> &mut Self;
}

impl CrackCommandsExt for EntityCommands<'_> {
    fn prepare_cracks(&mut self) -> &mut Self {
        let entity = self.id();
        self.commands().queue(move |world: &mut World| {
            if let Some(mut preparations) = world.get_resource_mut::<Preparations>() {
                preparations.want(entity);
            }
        });
        self
    }

    fn heal_cracks(&mut self) -> &mut Self {
        let entity = self.id();
        self.commands().queue(move |world: &mut World| heal(world, entity));
        self
    }

    fn close_cracks(&mut self, seconds: f32) -> &mut Self {
        let entity = self.id();
        self.commands().queue(move |world: &mut World| {
            purge(world, entity);
            when_free(world, move |world| close(world, entity, seconds));
        });
        self
    }

    fn shatter_cracks(&mut self, request: ShatterRequest) -> &mut Self {
        let entity = self.id();
        self.commands().queue(move |world: &mut World| {
            when_free(world, move |world| {
                if let Some(mut surfaces) = world.get_resource_mut::<Surfaces>() {
                    surfaces.requests.push(Request::new(entity, request));
                }
            });
        });
        self
    }
}

fn close(world: &mut World, entity: Entity, seconds: f32) {
    bake::cancel(world, entity);
    let is_closing = world.get_resource_mut::<Surfaces>().is_some_and(|mut surfaces| {
        let is_closing = surfaces.active.get_mut(&entity).is_some_and(|active| active.close(seconds));
        surfaces.wake(entity);
        surfaces.film(entity, None);
        is_closing
    });
    if !is_closing {
        heal_now(world, entity);
    }
}

fn heal(world: &mut World, entity: Entity) {
    // At once, wherever the list of bakes is; hits that come after this stay.
    bake::cancel(world, entity);
    purge(world, entity);
    when_free(world, move |world| heal_now(world, entity));
}

fn heal_now(world: &mut World, entity: Entity) {
    forget(world, entity);
    if let Some(mut state) = world.get_mut::<CrackState>(entity) {
        state.set_if_neq(CrackState::default());
    }
}

fn purge(world: &mut World, entity: Entity) {
    if !world.contains_resource::<HitQueue>() {
        return;
    }
    world.resource_scope(|world, mut queue: Mut<HitQueue>| {
        if let Some(mut stats) = world.get_resource_mut::<CrackStats>() {
            queue.purge(entity, &mut stats);
        }
    });
}

/// Drops growth and textures and gives the entity back what it showed before.
fn forget(world: &mut World, entity: Entity) {
    bake::cancel(world, entity);
    prepare::cancel(world, entity);
    let Some(mut surfaces) = world.get_resource_mut::<Surfaces>() else { return };
    let Some(mut active) = surfaces.remove(entity) else { return };
    drop_shards(world, entity, &mut active);
    (active.carrier.kind.detach)(world, entity, &active.carrier);
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.remove::<CrackTextures>();
    }
}

/// From the hook of a component that goes: the entity is healed when commands are applied.
pub(super) fn heal_later(world: &mut DeferredWorld, entity: Entity) {
    world.commands().queue(move |world: &mut World| heal(world, entity));
}

/// From the hook of a new component: if the entity is a clone and shows private textures of another, it gets the
/// original pictures.
pub(super) fn disown_clone(world: &mut DeferredWorld, entity: Entity) {
    // Without it, a system has the surfaces in its hands.
    if world.get_resource::<Surfaces>().is_none_or(|surfaces| !surfaces.owners.is_empty()) {
        world.commands().queue(move |world: &mut World| when_free(world, move |world| disown(world, entity)));
    }
}

fn disown(world: &mut World, entity: Entity) {
    let (_, Found::Shown(shown)) = carrier::inspect(world, entity) else { return };
    if !world.contains_resource::<Surfaces>() {
        return;
    }
    world.resource_scope(|world, surfaces: Mut<Surfaces>| {
        let owner = surfaces.owners.get(&shown.asset.id()).filter(|owner| **owner != entity);
        if let Some(active) = owner.and_then(|owner| surfaces.active.get(owner)) {
            (active.carrier.kind.detach)(world, entity, &active.carrier);
        }
    });
}
