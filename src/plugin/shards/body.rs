//! The entities that shards are shown with, and how they are used again.

use super::form::Origin;
use crate::plugin::{api::CrackSurface, carrier::kind::Carrier};
use bevy::prelude::*;
use std::collections::BTreeMap;

/// How many degrees of fading there are in 2D, a material each; 3D shards shrink instead.
pub(super) const LEVELS: usize = 8;

/// What a shard is shown with.
pub(super) struct Body {
    pub(super) entity: Entity,
    pub(super) mesh: Handle<Mesh>,
    /// The sides of a solid shard.
    pub(super) sides: Option<(Entity, Handle<Mesh>)>,
    /// What its meshes were made of.
    pub(super) origin: Origin,
}

/// Bodies that are kept for others while no shard is shown; else as many as are shown.
const KEPT: usize = 256;

/// No more go in a frame.
const GOING: usize = 64;

/// Bodies of shards that are not shown any more, hidden, numbered as they came. They are kept as long as any surface is broken, up to
/// [`KEPT`] or as many as are shown, and as they are: a piece that is shown once more has its own again if no other has taken it.
#[derive(Resource, Default)]
pub(crate) struct Spares {
    flat: BTreeMap<u64, Body>,
    solid: BTreeMap<u64, Body>,
    next: u64,
}

impl Spares {
    fn len(&self) -> usize {
        self.flat.len() + self.solid.len()
    }

    /// Takes out the oldest of all.
    fn pop(&mut self) -> Option<Body> {
        let first = |bodies: &BTreeMap<u64, Body>| bodies.first_key_value().map(|(number, _)| *number);
        let is_flat = match (first(&self.flat), first(&self.solid)) {
            (Some(flat), Some(solid)) => flat < solid,
            (flat, _) => flat.is_some(),
        };
        self.of(!is_flat).pop_first().map(|(_, body)| body)
    }

    /// Lets the oldest go until there are no more than `most`.
    pub(super) fn shrink_to(world: &mut World, most: usize) {
        while let Some(mut spares) = world.get_resource_mut::<Self>()
            && spares.len() > most
            && let Some(body) = spares.pop()
        {
            world.try_despawn(body.entity).ok();
        }
    }

    /// Lets those go, some in each frame, that will hardly be of use, so many shards being shown; without a broken surface all.
    pub(super) fn trim(world: &mut World, is_any_broken: bool, shown: usize, is_unlimited: bool) {
        let len = world.get_resource().map_or(0, Self::len);
        let most = if is_any_broken { shown.max(KEPT) } else { 0 };
        if len > most {
            let least = if is_unlimited { 0 } else { len.saturating_sub(GOING) };
            Self::shrink_to(world, most.max(least));
        }
    }

    const fn of(&mut self, is_solid: bool) -> &mut BTreeMap<u64, Body> {
        if is_solid { &mut self.solid } else { &mut self.flat }
    }

    /// The oldest body that has not been taken away meanwhile.
    pub(super) fn take(world: &mut World, is_solid: bool) -> Option<Body> {
        loop {
            let (_, body) = world.get_resource_mut::<Self>()?.of(is_solid).pop_first()?;
            if body.is_there(world) {
                return Some(body);
            }
        }
    }

    /// The body with this number, if its meshes are those of `origin`.
    pub(super) fn take_back(world: &mut World, is_solid: bool, number: u64, origin: &Origin) -> Option<Body> {
        let mut spares = world.get_resource_mut::<Self>()?;
        let spares = spares.of(is_solid);
        if spares.get(&number)?.origin != *origin {
            return None;
        }
        let body = spares.remove(&number)?;
        let meshes = world.get_resource::<Assets<Mesh>>()?;
        let has_meshes = meshes.contains(&body.mesh) && body.sides.iter().all(|(_, mesh)| meshes.contains(mesh));
        (has_meshes && body.is_there(world)).then_some(body)
    }
}

impl Body {
    pub(super) fn is_there(&self, world: &World) -> bool {
        let is_there = |entity| world.get_entity(entity).is_ok();
        is_there(self.entity) && self.sides.as_ref().is_none_or(|(sides, _)| is_there(*sides))
    }

    /// Hides a body and keeps it for another shard. Returns its number among the spare ones. One that has been made a surface goes, with
    /// all that was made for that.
    pub(super) fn park(self, world: &mut World, carrier: &Carrier) -> Option<u64> {
        let mut entity = world.get_entity_mut(self.entity).ok()?;
        if entity.contains::<CrackSurface>() {
            entity.despawn();
            return None;
        }
        // Materials and their pictures are the surface's.
        carrier.kind.shards().detach(&mut entity);
        // An observer of that may take it away.
        let mut visibility = world.get_mut::<Visibility>(self.entity)?;
        *visibility = Visibility::Hidden;
        if let Some((sides, _)) = &self.sides
            && let Ok(mut sides) = world.get_entity_mut(*sides)
        {
            carrier.kind.shards().detach(&mut sides);
        }
        let mut spares = world.get_resource_mut::<Spares>()?;
        let number = spares.next;
        spares.next += 1;
        spares.of(self.sides.is_some()).insert(number, self);
        Some(number)
    }
}
