//! The entities that shards are shown with, and how they are used again.

use super::{
    Broken, Shard,
    broken::Piece,
    form::{Form, Style},
};
use crate::{
    plugin::{
        beside::throw_away,
        carrier::{Carrier, Clothes},
    },
    shatter::Pose,
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

/// A piece that is to be shown: its index, its pose, and its form.
pub(super) type Shown = (usize, Pose, Form);

/// Puts meshes where they are drawn from: in the place of others, which go to `old`, or beside them.
fn place_mesh(meshes: &mut Assets<Mesh>, kept: Option<&Handle<Mesh>>, mesh: Mesh, old: &mut Vec<Mesh>) -> Handle<Mesh> {
    if let Some(kept) = kept
        && let Some(mut before) = meshes.get_mut(kept)
    {
        old.push(core::mem::replace(&mut *before, mesh));
        return kept.clone();
    }
    meshes.add(mesh)
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

    /// Makes the entities of pieces: of bodies that are there, then all others at a stroke. Returns them, and which pieces they are,
    /// in order; not those for which something is missing.
    pub(super) fn spawn(
        &mut self,
        world: &mut World,
        surface: Entity,
        carrier: &Carrier,
        shown: Vec<Shown>,
    ) -> Vec<(Entity, [u32; 2])> {
        let (is_solid, inside) = (carrier.kind.is_solid, self.inside.clone());
        if shown.is_empty() || !world.contains_resource::<Assets<Mesh>>() {
            return Vec::new();
        }
        let mut old = Vec::new();
        // Which pieces are new entities, and the meshes of their sides.
        let (mut new, mut sides, mut clothes) = (Vec::new(), Vec::new(), Vec::new());
        let mut all = Vec::with_capacity(shown.len());
        for (index, pose, form) in shown {
            let level = self.level(carrier, pose);
            let Some(material) = self.material(world, surface, carrier, level) else { continue };
            let Some(place) = self.place(carrier, index, pose) else { continue };
            let Some(shard) = self.shard(surface, index) else { continue };
            let body = Spares::take(world, is_solid);
            let mut meshes = world.resource_mut::<Assets<Mesh>>();
            let mesh = place_mesh(&mut meshes, body.as_ref().map(|body| &body.mesh), form.picture, &mut old);
            let side = form.sides.zip(inside.clone()).map(|(side, inside)| {
                let kept = body.as_ref().and_then(|body| body.sides.as_ref()).map(|(_, kept)| kept);
                (place_mesh(&mut meshes, kept, side, &mut old), inside)
            });
            let worn = Clothes { parent: surface, place, mesh: mesh.clone(), material };
            all.push(index);
            let Some(piece) = self.pieces.get_mut(index) else { continue };
            (piece.level, piece.times) = (level, piece.times + 1);
            match body {
                Some(mut body) => {
                    (carrier.kind.dress)(&mut world.entity_mut(body.entity), Some(shard), worn);
                    if let (Some((entity, kept)), Some((mesh, material))) = (&mut body.sides, side) {
                        let worn = Clothes { parent: body.entity, place: Transform::default(), mesh, material };
                        *kept = worn.mesh.clone();
                        (carrier.kind.dress)(&mut world.entity_mut(*entity), None, worn);
                    }
                    piece.body = Some(Body { mesh, ..body });
                }
                None => {
                    new.push((index, mesh));
                    sides.push(side);
                    clothes.push((shard, worn));
                }
            }
        }
        let entities = (carrier.kind.spawn)(world, clothes);
        let mut with_sides = Vec::new();
        for (((index, mesh), side), entity) in new.into_iter().zip(sides).zip(entities) {
            self.pieces[index].body = Some(Body { entity, mesh, sides: None });
            with_sides.extend(side.map(|(mesh, material)| {
                let clothes = Clothes { parent: entity, place: Transform::default(), mesh, material };
                (index, clothes)
            }));
        }
        if !with_sides.is_empty() {
            let kept: Vec<(usize, Handle<Mesh>)> =
                with_sides.iter().map(|(index, clothes)| (*index, clothes.mesh.clone())).collect();
            let clothes = with_sides.into_iter().map(|(_, clothes)| clothes).collect();
            let entities = (carrier.kind.spawn_sides)(world, clothes);
            for ((index, mesh), entity) in kept.into_iter().zip(entities) {
                if let Some(body) = &mut self.pieces[index].body {
                    body.sides = Some((entity, mesh));
                }
            }
        }
        if !old.is_empty() {
            throw_away(old);
        }
        let of = |index: usize| {
            let piece = &self.pieces[index];
            Some((piece.body.as_ref()?.entity, [piece.id, piece.times]))
        };
        all.into_iter().filter_map(of).collect()
    }

    /// What the entity of a piece says that is to be shown once more.
    fn shard(&self, surface: Entity, index: usize) -> Option<Shard> {
        let piece = self.pieces.get(index)?;
        let scale = self.plane.size / piece.cut.extent();
        let flight = &piece.flight;
        Some(Shard {
            surface,
            pieces: piece.cut.clone(),
            number: piece.number,
            velocity: self.plane.rotation * (flight.velocity * scale.extend(scale.y.abs())),
            spin: self.plane.rotation * (flight.axis * flight.spin),
            scale,
            piece: [piece.id, piece.times + 1],
        })
    }

    /// How its shards are formed.
    pub(super) fn style(&self, carrier: &Carrier) -> Style {
        let thickness = carrier.kind.is_solid.then(|| self.thickness());
        Style { plane: self.plane, rim: self.rim, thickness }
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
                (carrier.kind.change)(&mut entity, &material);
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
