//! [`ShardVisuals`]: the entities that show shards.

use super::slot::{MaterialSlot, typed};
use crate::plugin::api::shatter::Shard;
use bevy::{asset::UntypedHandle, prelude::*};
use core::marker::PhantomData;

/// What a shard or its sides are shown with.
pub(crate) struct ShardVisual {
    pub(crate) parent: Entity,
    pub(crate) place: Transform,
    pub(crate) mesh: Handle<Mesh>,
    pub(crate) material: UntypedHandle,
}

/// How entities show shards.
pub(crate) trait ShardVisuals: Send + Sync {
    /// Makes entities of shards; `None` once their surface is gone.
    ///
    /// One after the other, and each a child of its surface before it is a shard: observers of shards may despawn the surface, and the engine
    /// panics where that comes between a child and its parent.
    fn spawn(&self, world: &mut World, shards: Vec<(Shard, ShardVisual)>) -> Vec<Option<Entity>>;

    /// Makes entities of the sides of shards; `None` where the shard is gone.
    fn spawn_sides(&self, world: &mut World, sides: Vec<ShardVisual>) -> Vec<Option<Entity>>;

    /// Makes a shard of an entity that was one.
    fn attach(&self, entity: &mut EntityWorldMut, shard: Option<Shard>, visual: ShardVisual);

    /// Gives a shard another material.
    fn set_material(&self, entity: &mut EntityWorldMut, material: &UntypedHandle);

    /// Takes what makes it a shard from an entity, and the material.
    fn detach(&self, entity: &mut EntityWorldMut);
}

/// Shards whose material is in the component `S`.
pub(super) struct MaterialVisuals<S>(PhantomData<S>);

impl<S> MaterialVisuals<S> {
    pub(super) const NEW: Self = Self(PhantomData);
}

impl<S: MaterialSlot> ShardVisuals for MaterialVisuals<S> {
    fn spawn(&self, world: &mut World, shards: Vec<(Shard, ShardVisual)>) -> Vec<Option<Entity>> {
        let spawn = |(shard, visual)| {
            let entity = spawn_one::<S>(world, visual)?;
            if let Ok(mut entity) = world.get_entity_mut(entity) {
                entity.insert(shard);
            }
            Some(entity)
        };
        shards.into_iter().map(spawn).collect()
    }

    fn spawn_sides(&self, world: &mut World, sides: Vec<ShardVisual>) -> Vec<Option<Entity>> {
        sides.into_iter().map(|visual| spawn_one::<S>(world, visual)).collect()
    }

    fn attach(&self, entity: &mut EntityWorldMut, shard: Option<Shard>, visual: ShardVisual) {
        let is_child = entity.get::<ChildOf>().is_some_and(|child| child.parent() == visual.parent);
        let (parent, place, visibility, mesh, material) = bundle::<S>(visual);
        let has_parent = is_child || entity.world().get_entity(parent.parent()).is_ok();
        if !is_child && has_parent {
            entity.insert(parent);
        }
        if !entity.is_despawned() {
            entity.insert((place, visibility, mesh, material));
        }
        // Last, as in `spawn`.
        if let Some(shard) = shard.filter(|_| has_parent && !entity.is_despawned()) {
            entity.insert(shard);
        }
    }

    fn set_material(&self, entity: &mut EntityWorldMut, material: &UntypedHandle) {
        if let Some(material) = typed::<S::Material>(material) {
            entity.insert(S::from(material));
        }
    }

    fn detach(&self, entity: &mut EntityWorldMut) {
        entity.remove::<(Shard, S)>();
    }
}

fn spawn_one<S: MaterialSlot>(world: &mut World, visual: ShardVisual) -> Option<Entity> {
    world.get_entity(visual.parent).is_ok().then(|| world.spawn(bundle::<S>(visual)).id())
}

/// All that is seen of a shard; nothing of one whose material is of another kind.
fn bundle<S: MaterialSlot>(visual: ShardVisual) -> (ChildOf, Transform, Visibility, S::Mesh, S) {
    let ShardVisual { parent, place, mesh, material } = visual;
    let material: Handle<S::Material> = typed(&material).unwrap_or_default();
    (ChildOf(parent), place, Visibility::Inherited, mesh.into(), material.into())
}
