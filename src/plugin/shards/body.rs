//! The entities that shards are shown with, and how they are used again.

use super::{
    Broken, Shard,
    broken::Piece,
    form::{Form, Origin, Style},
};
use crate::{
    plugin::{
        CrackSurface,
        beside::throw_away,
        carrier::{Carrier, Clothes},
    },
    shatter::Pose,
};
use bevy::{asset::UntypedHandle, prelude::*};
use std::collections::BTreeMap;

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
    /// What its meshes were made of.
    origin: Origin,
}

/// So many bodies are kept for others while no shard is shown; else as many as are shown.
const KEPT: usize = 256;

/// No more go in a frame.
const GOING: usize = 64;

/// Bodies of shards that are not shown any more, hidden, numbered as they came. They are kept as long as any surface is broken, up to
/// [`KEPT`] or as many as are shown, and as they are: a piece that is shown once more has its own again if no other has taken it.
#[derive(Resource, Default)]
pub(in crate::plugin) struct Spares {
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
    pub(super) fn trim(world: &mut World, is_any_broken: bool, shown: usize, is_boundless: bool) {
        let len = world.get_resource().map_or(0, Self::len);
        let most = if is_any_broken { shown.max(KEPT) } else { 0 };
        if len > most {
            let least = if is_boundless { 0 } else { len.saturating_sub(GOING) };
            Self::shrink_to(world, most.max(least));
        }
    }

    const fn of(&mut self, is_solid: bool) -> &mut BTreeMap<u64, Body> {
        if is_solid { &mut self.solid } else { &mut self.flat }
    }

    /// The oldest body that has not been taken away meanwhile.
    fn take(world: &mut World, is_solid: bool) -> Option<Body> {
        loop {
            let (_, body) = world.get_resource_mut::<Self>()?.of(is_solid).pop_first()?;
            if body.is_there(world) {
                return Some(body);
            }
        }
    }

    /// The body with this number, if its meshes are those of `origin`.
    fn take_back(world: &mut World, is_solid: bool, number: u64, origin: &Origin) -> Option<Body> {
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
    fn is_there(&self, world: &World) -> bool {
        let is_there = |entity| world.get_entity(entity).is_ok();
        is_there(self.entity) && self.sides.as_ref().is_none_or(|(sides, _)| is_there(*sides))
    }

    /// Hides a body and keeps it for another shard. Returns its number among the spare ones. One that has been made a surface goes, with
    /// all that was made for that.
    fn park(self, world: &mut World, carrier: &Carrier) -> Option<u64> {
        let mut entity = world.get_entity_mut(self.entity).ok()?;
        if entity.contains::<CrackSurface>() {
            entity.despawn();
            return None;
        }
        // Materials and their pictures are the surface's.
        (carrier.kind.undress)(&mut entity);
        // Who is told of that may take it away.
        let mut visibility = world.get_mut::<Visibility>(self.entity)?;
        *visibility = Visibility::Hidden;
        if let Some((sides, _)) = &self.sides
            && let Ok(mut sides) = world.get_entity_mut(*sides)
        {
            (carrier.kind.undress)(&mut sides);
        }
        let mut spares = world.get_resource_mut::<Spares>()?;
        let number = spares.next;
        spares.next += 1;
        spares.of(self.sides.is_some()).insert(number, self);
        Some(number)
    }
}

/// A piece that is to be shown.
pub(super) struct Shown {
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
            self.wear[level] = (carrier.kind.shard_material)(world, surface, carrier, &self.whole, opacity);
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
        shown: Vec<Shown>,
    ) -> Vec<(Entity, [u32; 2])> {
        let (is_solid, inside) = (carrier.kind.is_solid, self.inside.clone());
        if shown.is_empty() || !world.contains_resource::<Assets<Mesh>>() {
            return Vec::new();
        }
        let style = self.style(carrier);
        let origin = |piece: &Piece| Origin::of(style, piece);
        // Its own first, so that none is taken by another.
        let own: Vec<Option<Body>> = shown
            .iter()
            .map(|Shown { index, .. }| {
                let piece = self.pieces.get_mut(*index)?;
                Spares::take_back(world, is_solid, piece.spare.take()?, &origin(piece))
            })
            .collect();
        let is_formless = |(shown, own): &(&Shown, &Option<Body>)| shown.form.is_none() && own.is_none();
        let formless = shown.iter().zip(&own).filter(is_formless);
        let formless: Vec<&Piece> = formless.filter_map(|(shown, _)| self.pieces.get(shown.index)).collect();
        let mut forms = style.forms(&formless).into_iter();
        let mut old = Vec::new();
        // Which pieces are new entities, and the meshes of their sides.
        let (mut new, mut sides, mut clothes) = (Vec::new(), Vec::new(), Vec::new());
        let mut all = Vec::with_capacity(shown.len());
        for (Shown { index, pose, form }, own) in shown.into_iter().zip(own) {
            let form = if own.is_none() { form.map(|form| *form).or_else(|| forms.next()) } else { None };
            // Who was told of the shards before has taken it away: this one comes in the next frame.
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
            let worn = Clothes { parent: surface, place, mesh: mesh.clone(), material };
            all.push(index);
            let Some(piece) = self.pieces.get_mut(index) else { continue };
            (piece.level, piece.times) = (level, piece.times + 1);
            let origin = origin(piece);
            match body {
                Some(mut body) => {
                    if let Ok(mut entity) = world.get_entity_mut(body.entity) {
                        (carrier.kind.dress)(&mut entity, Some(shard), worn);
                    }
                    if let (Some((entity, kept)), Some((mesh, material))) = (&mut body.sides, side) {
                        let worn = Clothes { parent: body.entity, place: Transform::default(), mesh, material };
                        *kept = worn.mesh.clone();
                        if let Ok(mut entity) = world.get_entity_mut(*entity) {
                            (carrier.kind.dress)(&mut entity, None, worn);
                        }
                    }
                    piece.body = Some(Body { mesh, origin, ..body });
                }
                None => {
                    new.push((index, mesh, origin));
                    sides.push(side);
                    clothes.push((shard, worn));
                }
            }
        }
        let entities = (carrier.kind.spawn)(world, clothes);
        let mut with_sides = Vec::new();
        for (((index, mesh, origin), side), entity) in new.into_iter().zip(sides).zip(entities) {
            let Some(entity) = entity else { continue };
            self.pieces[index].body = Some(Body { entity, mesh, sides: None, origin });
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
                let Some(entity) = entity else { continue };
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
        self.plane.thickness(self.settings.thickness, self.cut.extent())
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
            self.pieces[index].spare = self.put_away(world, carrier, body);
        }
    }

    /// Takes a body away, for another shard if nobody else has made something of it. Returns its number among the spare ones.
    pub(super) fn put_away(&self, world: &mut World, carrier: &Carrier, body: Body) -> Option<u64> {
        if self.settings.fly {
            return body.park(world, carrier);
        }
        world.try_despawn(body.entity).ok();
        None
    }
}
