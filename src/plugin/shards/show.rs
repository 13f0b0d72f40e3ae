//! Pieces are shown: entities, meshes and materials for them.

use super::body::{Body, LEVELS, Spares};
use super::broken::{Broken, Piece};
use super::form::{Form, Origin, Shape, Style};
use crate::plugin::api::Shard;
use crate::plugin::carrier::kind::Carrier;
use crate::plugin::carrier::shard_visual::ShardVisual;
use crate::plugin::jobs::background::drop_in_background;
use crate::shatter::Pose;
use bevy::{asset::UntypedHandle, prelude::*};

/// How far 2D shards lie in front of their surface, in the entity's units: they are drawn after it.
const IN_FRONT: f32 = 1e-3;

/// A piece that is to be shown.
pub(super) struct ShownPiece {
    pub(super) index: usize,
    pub(super) pose: Pose,
    /// Its form, if that has been made.
    pub(super) form: Option<Box<Form>>,
}

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
            self.wear[level] = carrier.kind.shard_material(world, surface, carrier, &self.whole, opacity);
        }
        self.wear[level].clone()
    }

    /// Makes the entities of pieces: of bodies that are there, then all others. Returns them, and which pieces they are,
    /// in order; not those for which something is missing.
    pub(super) fn spawn(
        &mut self,
        world: &mut World,
        surface: Entity,
        carrier: &Carrier,
        shown: Vec<ShownPiece>,
    ) -> Vec<(Entity, [u32; 2])> {
        let (is_solid, inside) = (carrier.is_solid, self.inside.clone());
        if shown.is_empty() || !world.contains_resource::<Assets<Mesh>>() {
            return Vec::new();
        }
        let style = self.style(carrier);
        let origin = |piece: &Piece| Origin::of(style.clone(), piece.shape());
        // Its own first, so that none is taken by another.
        let own: Vec<Option<Body>> = shown
            .iter()
            .map(|ShownPiece { index, .. }| {
                let piece = self.pieces.get_mut(*index)?;
                Spares::take_back(world, is_solid, piece.spare.take()?, &origin(piece))
            })
            .collect();
        let is_formless = |(shown, own): &(&ShownPiece, &Option<Body>)| shown.form.is_none() && own.is_none();
        let formless = shown.iter().zip(&own).filter(is_formless);
        let formless: Vec<Shape<'_>> =
            formless.filter_map(|(shown, _)| Some(self.pieces.get(shown.index)?.shape())).collect();
        let mut forms = style.forms(&formless).into_iter();
        let mut old = Vec::new();
        // Which pieces are new entities, and the meshes of their sides.
        let (mut new, mut sides, mut visuals) = (Vec::new(), Vec::new(), Vec::new());
        let mut all = Vec::with_capacity(shown.len());
        for (ShownPiece { index, pose, form }, own) in shown.into_iter().zip(own) {
            let form = if own.is_none() { form.map(|form| *form).or_else(|| forms.next()) } else { None };
            // An observer of the shards before has taken it away: this one comes in the next frame.
            if own.as_ref().is_some_and(|body| !body.is_there(world)) {
                continue;
            }
            let level = self.level(carrier, pose);
            let Some(material) = self.material(world, surface, carrier, level) else { continue };
            let Some(place) = self.place(carrier, index, pose) else { continue };
            let Some(shard) = self.shard(surface, index) else { continue };
            let body = own.or_else(|| Spares::take(world, is_solid));
            let mut meshes = world.resource_mut::<Assets<Mesh>>();
            let kept = body.as_ref().map(|body| (&body.mesh, body.sides.as_ref().map(|(_, mesh)| mesh)));
            let (mesh, side) = match (form, kept) {
                (Some(Form { picture, sides }), kept) => {
                    let mesh = place_mesh(&mut meshes, kept.map(|(mesh, _)| mesh), picture, &mut old);
                    let kept = kept.and_then(|(_, mesh)| mesh);
                    (mesh, sides.map(|sides| place_mesh(&mut meshes, kept, sides, &mut old)))
                }
                (None, Some((mesh, side))) => (mesh.clone(), side.cloned()),
                (None, None) => continue,
            };
            let side = side.zip(inside.clone());
            let visual = ShardVisual { parent: surface, place, mesh: mesh.clone(), material };
            all.push(index);
            let Some(piece) = self.pieces.get_mut(index) else { continue };
            (piece.level, piece.times) = (level, piece.times + 1);
            let origin = origin(piece);
            match body {
                Some(mut body) => {
                    if let Ok(mut entity) = world.get_entity_mut(body.entity) {
                        carrier.kind.shards().attach(&mut entity, Some(shard), visual);
                    }
                    if let (Some((entity, kept)), Some((mesh, material))) = (&mut body.sides, side) {
                        let visual = ShardVisual { parent: body.entity, place: Transform::default(), mesh, material };
                        *kept = visual.mesh.clone();
                        if let Ok(mut entity) = world.get_entity_mut(*entity) {
                            carrier.kind.shards().attach(&mut entity, None, visual);
                        }
                    }
                    piece.body = Some(Body { mesh, origin, ..body });
                }
                None => {
                    new.push((index, mesh, origin));
                    sides.push(side);
                    visuals.push((shard, visual));
                }
            }
        }
        let entities = carrier.kind.shards().spawn(world, visuals);
        let mut with_sides = Vec::new();
        for (((index, mesh, origin), side), entity) in new.into_iter().zip(sides).zip(entities) {
            let Some(entity) = entity else { continue };
            self.pieces[index].body = Some(Body { entity, mesh, sides: None, origin });
            with_sides.extend(side.map(|(mesh, material)| {
                let visual = ShardVisual { parent: entity, place: Transform::default(), mesh, material };
                (index, visual)
            }));
        }
        if !with_sides.is_empty() {
            let kept: Vec<(usize, Handle<Mesh>)> =
                with_sides.iter().map(|(index, visual)| (*index, visual.mesh.clone())).collect();
            let visuals = with_sides.into_iter().map(|(_, visual)| visual).collect();
            let entities = carrier.kind.shards().spawn_sides(world, visuals);
            for ((index, mesh), entity) in kept.into_iter().zip(entities) {
                let Some(entity) = entity else { continue };
                if let Some(body) = &mut self.pieces[index].body {
                    body.sides = Some((entity, mesh));
                }
            }
        }
        if !old.is_empty() {
            drop_in_background(old);
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
        let plane = &piece.plane;
        let scale = plane.size / piece.cut.extent();
        let flight = &piece.flight;
        Some(Shard {
            surface,
            pieces: piece.cut.clone(),
            number: piece.number,
            velocity: plane.rotation * (flight.velocity * scale.extend(scale.y.abs())),
            spin: plane.rotation * (flight.axis * flight.spin),
            scale,
            piece: [piece.id, piece.times + 1],
        })
    }

    /// How its shards are formed.
    pub(super) fn style(&self, carrier: &Carrier) -> Style {
        let thickness = carrier.is_solid.then(|| self.thickness());
        Style { rim: self.rim, thickness, shell: self.shell.as_ref().map(|shell| shell.shape.clone()) }
    }

    /// Thickness of shards in the entity's units.
    fn thickness(&self) -> f32 {
        self.plane.thickness(self.settings.thickness, self.cut.extent())
    }

    /// How much of [`LEVELS`] is there.
    fn level(&self, carrier: &Carrier, pose: Pose) -> usize {
        if carrier.is_solid {
            return LEVELS;
        }
        (pose.opacity * LEVELS as f32).ceil().clamp(1.0, LEVELS as f32) as usize
    }

    /// Where a piece is.
    fn place(&self, carrier: &Carrier, index: usize, mut pose: Pose) -> Option<Transform> {
        let is_solid = carrier.is_solid;
        if !is_solid {
            // In 2D, z is only for the order of drawing.
            pose.offset.z = 0.0;
        }
        let forward = if is_solid { 0.5 * self.thickness() } else { -IN_FRONT };
        let piece = self.pieces.get(index)?;
        let shard = piece.cut.get(piece.number)?;
        let mut place = piece.plane.place(shard.centroid, piece.cut.extent(), pose, forward);
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
                carrier.kind.shards().set_material(&mut entity, &material);
            }
            self.pieces[index].level = level;
        }
    }
}
