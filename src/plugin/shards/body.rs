//! The entities that shards are shown with, and how they are used again.

use super::{
    Broken, Shard,
    broken::Piece,
    plane::{Faces, empty_mesh, write_mesh},
};
use crate::{
    plugin::carrier::Carrier,
    shatter::{Pose, ShardMesh},
};
use bevy::{asset::UntypedHandle, prelude::*};
use std::collections::VecDeque;

/// How many degrees of fading there are in 2D, a material each; 3D shards shrink instead.
pub(super) const LEVELS: usize = 8;

/// How far 2D shards lie in front of their surface, in the entity's units: they are drawn after it.
const IN_FRONT: f32 = 1e-3;

/// What a shard is shown with.
pub(super) struct Body {
    pub(super) entity: Entity,
    mesh: Handle<Mesh>,
    /// The sides of a solid shard.
    sides: Option<(Entity, Handle<Mesh>)>,
}

/// Bodies of shards that are not shown any more, hidden, the oldest first. They are kept as long as any surface is broken.
#[derive(Resource, Default)]
pub(in crate::plugin) struct Spares {
    flat: VecDeque<Body>,
    solid: VecDeque<Body>,
}

impl Spares {
    /// Lets all go.
    pub(super) fn clear(world: &mut World) {
        let is_any = |spares: &Self| !(spares.flat.is_empty() && spares.solid.is_empty());
        if world.get_resource().is_some_and(is_any) {
            let Self { flat, solid } = core::mem::take(&mut *world.resource_mut());
            for body in flat.into_iter().chain(solid) {
                world.try_despawn(body.entity).ok();
            }
        }
    }

    /// A body that has not been taken away meanwhile.
    fn take(world: &mut World, is_solid: bool) -> Option<Body> {
        loop {
            let mut spares = world.get_resource_mut::<Self>()?;
            let body = if is_solid { spares.solid.pop_front() } else { spares.flat.pop_front() }?;
            let is_there = |entity| world.get_entity(entity).is_ok();
            if is_there(body.entity) && body.sides.as_ref().is_none_or(|(sides, _)| is_there(*sides)) {
                return Some(body);
            }
        }
    }
}

impl Body {
    /// Hides a body and keeps it for another shard.
    fn park(self, world: &mut World, carrier: &Carrier) {
        let Ok(mut entity) = world.get_entity_mut(self.entity) else { return };
        entity.remove::<Shard>();
        // Materials and their pictures are the surface's.
        (carrier.kind.undress)(&mut entity);
        if let Some(mut visibility) = entity.get_mut::<Visibility>() {
            *visibility = Visibility::Hidden;
        }
        if let Some((sides, _)) = &self.sides
            && let Ok(mut sides) = world.get_entity_mut(*sides)
        {
            (carrier.kind.undress)(&mut sides);
        }
        if let Some(mut spares) = world.get_resource_mut::<Spares>() {
            let kept = if self.sides.is_some() { &mut spares.solid } else { &mut spares.flat };
            kept.push_back(self);
        }
    }
}

/// What the entity of a shard wears.
pub(super) struct Clothes<'a> {
    pub(super) carrier: &'a Carrier,
    pub(super) material: &'a UntypedHandle,
    pub(super) inside: Option<&'a UntypedHandle>,
    pub(super) is_mirrored: bool,
}

impl Clothes<'_> {
    /// Shows a shard of the form of `mesh`, with a body that is there or a new one.
    pub(super) fn put_on(&self, world: &mut World, shard: Shard, place: Transform, mesh: &ShardMesh) -> Option<Body> {
        let Self { carrier, material, inside, is_mirrored } = *self;
        let (is_solid, surface) = (carrier.kind.is_solid, shard.surface);
        let form = |world: &mut World, kept: Option<&Handle<Mesh>>, faces| {
            let mut meshes = world.get_resource_mut::<Assets<Mesh>>()?;
            if let Some(kept) = kept
                && let Some(mut old) = meshes.get_mut(kept)
            {
                write_mesh(&mut old, mesh, faces, is_mirrored, is_solid);
                return Some(kept.clone());
            }
            let mut new = empty_mesh();
            write_mesh(&mut new, mesh, faces, is_mirrored, is_solid);
            Some(meshes.add(new))
        };
        if let Some(mut body) = Spares::take(world, is_solid) {
            body.mesh = form(world, Some(&body.mesh), Faces::Picture)?;
            let mut entity = world.entity_mut(body.entity);
            entity.insert((shard, place, Visibility::Inherited));
            if entity.get::<ChildOf>().is_none_or(|parent| parent.parent() != surface) {
                entity.insert(ChildOf(surface));
            }
            (carrier.kind.dress)(&mut entity, Some(body.mesh.clone()), material);
            if let (Some((sides, kept)), Some(inside)) = (&mut body.sides, inside) {
                *kept = form(world, Some(kept), Faces::Inside)?;
                (carrier.kind.dress)(&mut world.entity_mut(*sides), Some(kept.clone()), inside);
            }
            return Some(body);
        }
        let picture = form(world, None, Faces::Picture)?;
        let mut entity = world.spawn((shard, place, Visibility::Inherited, ChildOf(surface)));
        (carrier.kind.dress)(&mut entity, Some(picture.clone()), material);
        let mut body = Body { entity: entity.id(), mesh: picture, sides: None };
        if is_solid && let Some(inside) = inside {
            let sides = form(world, None, Faces::Inside)?;
            let mut child = world.spawn((Transform::default(), Visibility::Inherited, ChildOf(body.entity)));
            (carrier.kind.dress)(&mut child, Some(sides.clone()), inside);
            body.sides = Some((child.id(), sides));
        }
        Some(body)
    }
}

impl Broken {
    /// Material of shards of which `level` of [`LEVELS`] is there.
    fn material(
        &mut self,
        world: &mut World,
        surface: Entity,
        carrier: &Carrier,
        level: usize,
    ) -> Option<UntypedHandle> {
        if self.wear[level].is_none() {
            let opacity = level as f32 / LEVELS as f32;
            self.wear[level] = (carrier.kind.shard_material)(world, surface, carrier, &self.whole, opacity);
        }
        self.wear[level].clone()
    }

    /// Makes the entity of a piece, in its pose. `None` if there is nothing to make it of.
    pub(super) fn spawn(
        &mut self,
        world: &mut World,
        surface: Entity,
        carrier: &Carrier,
        index: usize,
        pose: Pose,
        scratch: &mut ShardMesh,
    ) -> Option<(Entity, [u32; 2])> {
        let level = self.level(carrier, pose);
        let material = self.material(world, surface, carrier, level)?;
        let place = self.place(carrier, index, pose)?;
        let piece = self.pieces.get(index)?;
        let frame = self.plane.frame(piece.uv, self.rim, piece.seed);
        if carrier.kind.is_solid {
            piece.cut.solid_mesh_into(piece.number, &frame, self.thickness(), scratch);
        } else {
            scratch.clear();
            piece.cut.flat_mesh_into(piece.number, &frame, scratch);
        }
        let scale = self.plane.size / piece.cut.extent();
        let flight = &piece.flight;
        let shard = Shard {
            surface,
            pieces: piece.cut.clone(),
            number: piece.number,
            velocity: self.plane.rotation * (flight.velocity * scale.extend(scale.y.abs())),
            spin: self.plane.rotation * (flight.axis * flight.spin),
            scale,
            piece: [piece.id, piece.times + 1],
        };
        let is_mirrored = self.plane.is_mirrored();
        let clothes = Clothes { carrier, material: &material, inside: self.inside.as_ref(), is_mirrored };
        let body = clothes.put_on(world, shard, place, scratch)?;
        let entity = body.entity;
        let piece = self.pieces.get_mut(index)?;
        (piece.body, piece.level) = (Some(body), level);
        piece.times += 1;
        Some((entity, [piece.id, piece.times]))
    }

    /// Thickness of shards in the entity's units.
    fn thickness(&self) -> f32 {
        self.settings.thickness * self.plane.size.y.abs() / self.cut.extent().y
    }

    /// How much of [`LEVELS`] is there.
    fn level(&self, carrier: &Carrier, pose: Pose) -> usize {
        if carrier.kind.is_solid {
            return LEVELS;
        }
        (pose.opacity * LEVELS as f32).ceil().clamp(1.0, LEVELS as f32) as usize
    }

    /// Where a piece is.
    fn place(&self, carrier: &Carrier, index: usize, mut pose: Pose) -> Option<Transform> {
        let is_solid = carrier.kind.is_solid;
        if !is_solid {
            // In 2D, z is only for the order of drawing.
            pose.offset.z = 0.0;
        }
        let forward = if is_solid { 0.5 * self.thickness() } else { -IN_FRONT };
        let piece = self.pieces.get(index)?;
        let shard = piece.cut.get(piece.number)?;
        let mut place = self.plane.place(shard.centroid, piece.cut.extent(), pose, forward);
        if is_solid {
            place.scale = Vec3::splat(pose.opacity);
        }
        Some(place)
    }

    /// Puts the entity of a piece where it belongs.
    pub(super) fn pose(&mut self, world: &mut World, surface: Entity, carrier: &Carrier, index: usize, pose: Pose) {
        let Some(Piece { body: Some(body), level: was, .. }) = self.pieces.get(index) else { return };
        let (entity, was, level) = (body.entity, *was, self.level(carrier, pose));
        let Some(place) = self.place(carrier, index, pose) else { return };
        if let Some(mut transform) = world.get_mut::<Transform>(entity) {
            transform.set_if_neq(place);
        }
        if level != was {
            let material = self.material(world, surface, carrier, level);
            if let (Some(material), Ok(mut entity)) = (material, world.get_entity_mut(entity)) {
                (carrier.kind.dress)(&mut entity, None, &material);
            }
            self.pieces[index].level = level;
        }
    }

    /// Takes the entity of a piece away.
    pub(super) fn hide(&mut self, world: &mut World, carrier: &Carrier, index: usize) {
        if let Some(body) = self.pieces.get_mut(index).and_then(|piece| piece.body.take()) {
            self.put_away(world, carrier, body);
        }
    }

    /// Takes a body away, for another shard if nobody else has made something of it.
    pub(super) fn put_away(&self, world: &mut World, carrier: &Carrier, body: Body) {
        if self.settings.fly {
            body.park(world, carrier);
        } else {
            world.try_despawn(body.entity).ok();
        }
    }
}
