//! [`Broken`]: a surface that has shattered.

use super::{
    CrackShards, Plane, Shard, ShatterCracks,
    holes::Holes,
    plane::{Faces, to_mesh},
};
use crate::{
    plugin::{carrier::Carrier, surfaces::Active},
    raster::TexelRect,
    shatter::{Flight, Pose, ShardMesh, Shards, Support},
};
use bevy::{asset::UntypedHandle, prelude::*};
use std::sync::Arc;

/// How many degrees of fading there are in 2D, a material each; 3D shards shrink instead.
const LEVELS: usize = 8;

/// How far 2D shards lie in front of their surface, in the entity's units: they are drawn after it.
const IN_FRONT: f32 = 1e-3;

/// The last hit of a surface.
#[derive(Clone, Copy)]
pub(in crate::plugin) struct Struck {
    /// Pattern units.
    pub(in crate::plugin) pos: Vec2,
    pub(in crate::plugin) energy: f32,
    /// In the world.
    pub(in crate::plugin) direction: Vec3,
}

/// What a surface that has shattered is made of.
pub(in crate::plugin) struct Broken {
    /// The pieces it was cut into last.
    pub(super) cut: Arc<Shards>,
    pub(super) support: Support,
    /// Nodes and links of the network it was cut along.
    pub(super) grown: (usize, usize),
    /// The settings it was cut with.
    pub(super) settings: ShatterCracks,
    /// The picture with its cracks and without holes.
    pub(super) whole: Handle<Image>,
    pub(super) plane: Plane,
    pub(in crate::plugin) holes: Holes,
    /// Pieces that are out of their places.
    pub(super) pieces: Vec<Piece>,
    /// Number for the next piece.
    pub(super) next: u32,
    /// Seconds since it broke.
    pub(super) time: f64,
    /// When the last piece has faded.
    pub(super) end: f64,
    /// Materials of the shards, by how much of them is there.
    wear: [Option<UntypedHandle>; LEVELS + 1],
    /// Material of their sides.
    pub(super) inside: Option<UntypedHandle>,
    /// Bytes of the picture, counted against the budget.
    pub(super) bytes: u64,
}

/// A piece that is out of its place.
pub(super) struct Piece {
    /// The pieces it is one of, and its number among them.
    pub(super) cut: Arc<Shards>,
    pub(super) number: u32,
    /// Tells it from all other pieces of the surface.
    pub(super) id: u32,
    /// When it was released, seconds since the surface broke.
    pub(super) start: f64,
    pub(super) flight: Flight,
    /// The part of the texture that the surface showed then.
    pub(super) uv: [Vec2; 2],
    /// Whether it is not to be shown any more: it is transparent, or has made room for another.
    pub(super) is_spent: bool,
    pub(super) entity: Option<Entity>,
    pub(super) level: usize,
}

impl Broken {
    pub(super) fn new(
        (cut, support): (Arc<Shards>, Support),
        grown: (usize, usize),
        settings: ShatterCracks,
        (whole, bytes): (Handle<Image>, u64),
        plane: Plane,
        active: &Active,
    ) -> Self {
        Self {
            cut,
            support,
            grown,
            settings,
            whole,
            plane,
            holes: Holes::new(active.field.frame.size()),
            pieces: Vec::new(),
            next: 0,
            time: 0.0,
            end: 0.0,
            wear: Default::default(),
            inside: None,
            bytes,
        }
    }

    /// What the surface tells of itself.
    pub(super) fn report(&self) -> CrackShards {
        CrackShards {
            pieces: self.cut.clone(),
            gone: self.pieces.len() as u32,
            shown: self.pieces.iter().filter(|piece| piece.entity.is_some()).count() as u32,
            time: self.time as f32,
        }
    }

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

    /// Makes the entity of a piece. `None` if there is nothing to make it of.
    pub(super) fn spawn(
        &mut self,
        world: &mut World,
        surface: Entity,
        carrier: &Carrier,
        index: usize,
        scratch: &mut ShardMesh,
    ) -> Option<Entity> {
        let material = self.material(world, surface, carrier, LEVELS)?;
        let is_solid = carrier.kind.is_solid;
        let (plane, thickness) = (self.plane, self.thickness());
        let piece = self.pieces.get_mut(index)?;
        let frame = plane.frame(piece.uv);
        if is_solid {
            piece.cut.solid_mesh_into(piece.number, &frame, thickness, scratch);
        } else {
            scratch.clear();
            piece.cut.flat_mesh_into(piece.number, &frame, scratch);
        }
        let is_mirrored = plane.is_mirrored();
        let mut meshes = world.get_resource_mut::<Assets<Mesh>>()?;
        let picture = meshes.add(to_mesh(scratch, Faces::Picture, is_mirrored, is_solid));
        let sides = is_solid.then(|| meshes.add(to_mesh(scratch, Faces::Inside, is_mirrored, is_solid)));
        let scale = plane.size / piece.cut.extent();
        let flight = &piece.flight;
        let shard = Shard {
            surface,
            pieces: piece.cut.clone(),
            number: piece.number,
            velocity: plane.rotation * (flight.velocity * scale.extend(scale.y.abs())),
            spin: plane.rotation * (flight.axis * flight.spin),
            scale,
            piece: piece.id,
        };
        let mut entity = world.spawn((shard, Transform::default(), Visibility::Inherited, ChildOf(surface)));
        (carrier.kind.dress)(&mut entity, Some(picture), &material);
        let entity = entity.id();
        if let (Some(sides), Some(inside)) = (sides, &self.inside) {
            let mut child = world.spawn((Transform::default(), Visibility::Inherited, ChildOf(entity)));
            (carrier.kind.dress)(&mut child, Some(sides), inside);
        }
        piece.entity = Some(entity);
        piece.level = LEVELS;
        Some(entity)
    }

    /// Thickness of shards in the entity's units.
    fn thickness(&self) -> f32 {
        self.settings.thickness * self.plane.size.y.abs() / self.cut.extent().y
    }

    /// Puts the entity of a piece where it belongs.
    pub(super) fn pose(&mut self, world: &mut World, surface: Entity, carrier: &Carrier, index: usize, mut pose: Pose) {
        let is_solid = carrier.kind.is_solid;
        if !is_solid {
            // In 2D, z is only for the order of drawing.
            pose.offset.z = 0.0;
        }
        let forward = if is_solid { 0.5 * self.thickness() } else { -IN_FRONT };
        let Some(piece) = self.pieces.get(index) else { return };
        let (Some(entity), Some(shard)) = (piece.entity, piece.cut.get(piece.number)) else { return };
        let mut place = self.plane.place(shard.centroid, piece.cut.extent(), pose, forward);
        let level = (pose.opacity * LEVELS as f32).ceil().clamp(1.0, LEVELS as f32) as usize;
        let was = piece.level;
        if is_solid {
            place.scale = Vec3::splat(pose.opacity);
        }
        if let Some(mut transform) = world.get_mut::<Transform>(entity) {
            transform.set_if_neq(place);
        }
        if !is_solid && level != was {
            let material = self.material(world, surface, carrier, level);
            if let (Some(material), Ok(mut entity)) = (material, world.get_entity_mut(entity)) {
                (carrier.kind.dress)(&mut entity, None, &material);
            }
            self.pieces[index].level = level;
        }
    }

    /// Takes the entity of a piece away.
    pub(super) fn hide(&mut self, world: &mut World, index: usize) {
        if let Some(entity) = self.pieces.get_mut(index).and_then(|piece| piece.entity.take()) {
            world.try_despawn(entity).ok();
        }
    }

    /// A piece is in its place again.
    pub(super) fn put_back(&mut self, piece: &Piece) {
        if Arc::ptr_eq(&piece.cut, &self.cut) {
            self.support.put_back(piece.number);
            return;
        }
        // The surface has been cut anew since: what lies in the piece is back.
        for shard in self.support.gone().collect::<Vec<u32>>() {
            let place = self.cut.inner_point(shard);
            if place.is_some_and(|place| piece.cut.distance(piece.number, place) == 0.0) {
                self.support.put_back(shard);
            }
        }
    }
}

/// Makes a surface whole again: its shards and holes go. Returns the bytes that it no longer needs.
pub(in crate::plugin) fn drop_shards(world: &mut World, entity: Entity, active: &mut Active) -> u64 {
    let Some(mut broken) = active.broken.take() else { return 0 };
    for index in 0..broken.pieces.len() {
        broken.hide(world, index);
    }
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.remove::<CrackShards>();
    }
    active.bytes -= broken.bytes;
    active.mind_holes();
    active.mark(TexelRect::whole(active.field.frame.size()));
    broken.bytes
}
