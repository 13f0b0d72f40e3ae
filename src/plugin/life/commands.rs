//! Commands for surfaces.

use super::heal::{close, heal, purge};
use crate::plugin::{
    api::ShatterRequest, jobs::deferred::when_free, shards::request::request_shards, surface::prepare::Preparations,
};
use bevy::{ecs::system::EntityCommands, prelude::*};

/// Commands for surfaces.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// /// What becomes of the walls when a round is over.
/// fn end_round(mut commands: Commands, walls: Query<(Entity, &CrackState)>) {
///     for (wall, state) in &walls {
///         let mut wall = commands.entity(wall);
///         match state.damage {
///             0.8.. => wall.shatter_cracks(ShatterRequest::EVERYTHING),
///             0.2.. => wall.close_cracks(1.5),
///             _ => wall.heal_cracks(),
///         };
///     }
/// }
/// # bevy::ecs::system::assert_is_system(end_round);
/// ```
pub trait CrackCommandsExt {
    /// Makes a surface ready for its first hit: for what is sure to be hit, while a level loads.
    ///
    /// Without it the crack of a first hit shows in the frame of the hit with textures of up to 512 x 512 texels, unless many are hit for
    /// the first time at once or its lines are to be read (those of brick, see [`CrackMaskSource`](crate::plugin::CrackMaskSource)), and some frames
    /// later on larger ones: background tasks make them. A surface that is prepared takes
    /// the memory of one that has cracked, and shows its textures from the frame on in which [`CrackTextures`](crate::plugin::CrackTextures) is added. Surfaces that are
    /// hit come first. Does nothing on entities without a [`CrackSurface`](crate::plugin::CrackSurface), or with cracks; one that cannot crack says
    /// so with [`CrackFailed`](crate::plugin::CrackFailed). Healing takes it back.
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

    /// Takes all cracks away, those of [`GuidedCracks`](crate::plugin::GuidedCracks) too, and all shards and holes: the surface shows its
    /// own pictures again, its textures and its growth are dropped. Hits that wait on it are refused, and so are those that were triggered
    /// before it in the same frame; those written as messages are read at the end of the frame, and crack it again. Does nothing on entities
    /// without cracks.
    fn heal_cracks(&mut self) -> &mut Self;

    /// Closes all cracks within this many seconds: they run back the way they came, whatever a [`CrackClock`](crate::plugin::CrackClock)
    /// says, and are healed as by [`heal_cracks`](Self::heal_cracks) then. Hits that wait on the surface are refused; one that comes
    /// while they close makes them grow on from where they are. Not a number, zero or below: at once; infinite: they stand still.
    fn close_cracks(&mut self, seconds: f32) -> &mut Self;

    /// Knocks shards out of a cracked surface, along the cracks it has. Nothing happens to an entity without cracks; one
    /// that cannot shatter says so with [`ShatterFailed`](crate::plugin::ShatterFailed). See [`ShatterCracks`](crate::plugin::ShatterCracks).
    ///
    /// The shards are those of this frame, and are there two frames later, on every machine (later only where the renderer has not made its
    /// pipelines for shards yet; with [`ShatterCracks`](crate::plugin::ShatterCracks) on the surface, it is asked to beforehand): they are made on the
    /// [`AsyncComputeTaskPool`](bevy::tasks::AsyncComputeTaskPool) meanwhile. Only if they are not ready then, or the surface has been
    /// shattered or mended in between, they are made in that frame. Where there are more than 500 nodes of cracks, they have one frame more
    /// for each 500, up to 20, and no frame waits for them; with a [`CrackBudget::milliseconds`](crate::plugin::CrackBudget::milliseconds) of a
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
            when_free(world, move |world| request_shards(world, entity, request));
        });
        self
    }
}
