//! [`Broken`]: a surface that has shattered.

use super::batch::Batch;
use super::body::{Body, LEVELS};
use super::crumbs::{Crumb, CrumbParams};
use super::form::Shape;
use crate::Grid;
use crate::plugin::api::{CrackShards, ShatterCracks};
use crate::plugin::carrier::kind::Carrier;
use crate::plugin::carrier::plane::Plane;
use crate::plugin::gpu::memory::TextureBytes;
use crate::plugin::surface::active::Active;
use crate::shatter::{BreakAgain, Flight, RimLook, Shards, Shell, Support};
use bevy::{asset::UntypedHandle, prelude::*};
use std::{collections::VecDeque, sync::Arc};

/// What a surface that has shattered is made of.
pub(crate) struct Broken {
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
    /// The surface, if it is not flat.
    pub(super) shell: Option<BrokenShell>,
    /// How the rims of shards look.
    pub(super) rim: RimLook,
    /// Pieces that are out of their places and fragments of them, by id: fragments come after what they were part of.
    pub(super) pieces: Vec<Piece>,
    /// What is to leave in the next frames.
    pub(super) waiting: VecDeque<Batch>,
    /// Whether its copy of the picture has just been made.
    pub(super) is_fresh: bool,
    /// Whether pieces wait to be shown or to break: a frame had no room for them.
    pub(super) is_behind: bool,
    /// Whether pieces that had broken have faded away.
    pub(super) has_faded: bool,
    /// When what waits was released, seconds since it broke: with the first that leave.
    pub(super) since: f64,
    /// Whether any of it has left.
    pub(super) has_begun: bool,
    /// Id for the next piece.
    pub(super) next: u32,
    /// How many pieces were released so far.
    pub(super) released: u32,
    /// Seconds since it broke.
    pub(super) time: f64,
    /// When the last piece has faded.
    pub(super) end: f64,
    /// Materials of the shards, by how much of them is there.
    pub(super) wear: [Option<UntypedHandle>; LEVELS + 1],
    /// Material of their sides.
    pub(super) inside: Option<UntypedHandle>,
    /// Which crumbs come off its pieces, and those that have in this frame.
    pub(super) crumb_params: Option<CrumbParams>,
    pub(super) crumbs: Vec<Crumb>,
    /// Bytes of the picture.
    pub(super) _bytes: TextureBytes,
}

/// A surface that is not flat.
#[derive(Clone)]
pub(super) struct BrokenShell {
    pub(super) shape: Arc<Shell>,
    /// Its texels that are no piece's, see [`fringe`](super::spans::fringe).
    pub(super) fringe: Arc<Grid<bool>>,
}

/// A piece that is out of its place, or a fragment of one.
pub(super) struct Piece {
    /// The pieces it is one of, and its number among them.
    pub(super) cut: Arc<Shards>,
    pub(super) number: u32,
    /// Where it lies in the surface: fragments lie where the whole does.
    pub(super) plane: Plane,
    /// Tells it from all other pieces of the surface.
    pub(super) id: u32,
    /// Fixes what is random about it.
    pub(super) seed: u64,
    /// When its flight was begun by a blow, seconds since the surface broke.
    pub(super) start: f64,
    /// Since when it is there: from the blow on or, a fragment, since it has parted.
    pub(super) born: f64,
    pub(super) flight: Flight,
    /// How it breaks again, and how many seconds after the blow.
    pub(super) again: Option<(BreakAgain, f32)>,
    /// Whether its fragments have taken its place.
    pub(super) is_broken: bool,
    /// Whether there was no room for its fragments when it was to break.
    pub(super) stays_whole: bool,
    /// A fragment: the id of the piece that it was part of.
    pub(super) part_of: Option<u32>,
    /// The part of the texture that the surface showed then.
    pub(super) uv: [Vec2; 2],
    /// Whether it is not to be shown any more: it is transparent, or has made room for another.
    pub(super) is_spent: bool,
    pub(super) body: Option<Body>,
    /// The number of its last body among the spare ones.
    pub(super) spare: Option<u64>,
    /// How often it has been shown.
    pub(super) times: u32,
    pub(super) level: usize,
}

impl Piece {
    /// What its form follows from.
    pub(super) fn shape(&self) -> Shape<'_> {
        Shape { cut: &self.cut, number: self.number, uv: self.uv, seed: self.seed, plane: self.plane }
    }
}

impl Broken {
    pub(super) fn new(
        (cut, support): (Arc<Shards>, Support),
        grown: (usize, usize),
        settings: ShatterCracks,
        (whole, bytes): (Handle<Image>, TextureBytes),
        plane: Plane,
    ) -> Self {
        Self {
            cut,
            support,
            grown,
            settings,
            whole,
            plane,
            shell: None,
            rim: RimLook::PLAIN,
            pieces: Vec::new(),
            waiting: VecDeque::new(),
            is_fresh: true,
            is_behind: false,
            has_faded: false,
            since: 0.0,
            has_begun: false,
            next: 0,
            released: 0,
            time: 0.0,
            end: 0.0,
            wear: Default::default(),
            inside: None,
            crumb_params: None,
            crumbs: Vec::new(),
            _bytes: bytes,
        }
    }

    /// Writes on the surface what has become of it.
    pub(super) fn report(&self, world: &mut World, surface: Entity) {
        let report = CrackShards {
            pieces: self.cut.clone(),
            gone: self.pieces.iter().filter(|piece| piece.part_of.is_none()).count() as u32,
            shown: self.pieces.iter().filter(|piece| piece.body.is_some()).count() as u32,
            time: self.time as f32,
        };
        match world.get_mut::<CrackShards>(surface) {
            Some(mut told) => *told = report,
            None => {
                if let Ok(mut entity) = world.get_entity_mut(surface) {
                    entity.insert(report);
                }
            }
        }
    }

    /// Where the piece with this id is in the list.
    pub(super) fn index_of(&self, id: u32) -> Option<usize> {
        self.pieces.binary_search_by_key(&id, |piece| piece.id).ok()
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

    /// Shows a piece no more: it makes room for others. Returns whether it is there.
    pub(super) fn spend(&mut self, world: &mut World, active: &Active, piece: u32) -> bool {
        let Some(index) = self.index_of(piece) else { return false };
        self.pieces[index].is_spent = true;
        self.hide(world, &active.carrier, index);
        true
    }

    /// What has waited to leave stays after all.
    pub(super) fn keep_waiting(&mut self) {
        for leaving in self.waiting.drain(..).flat_map(|batch| batch.leaving) {
            self.support.put_back(leaving.number);
        }
    }

    /// Puts fragments of pieces that have faded away together again: they are the same whenever the piece breaks.
    pub(super) fn join_faded(&mut self, world: &mut World, carrier: &Carrier) {
        let now = self.time;
        let is_faded = |piece: &Piece| piece.flight.pose((now - piece.start) as f32).opacity <= 0.0;
        // Fragments come after what they were part of, so ids are in order.
        let mut gone: Vec<u32> = Vec::new();
        let mut bodies = Vec::new();
        self.pieces.retain_mut(|piece| {
            let goes = piece.part_of.is_some_and(|whole| gone.binary_search(&whole).is_ok());
            if piece.is_broken && (goes || is_faded(piece)) {
                gone.push(piece.id);
                piece.is_broken = false;
            }
            if goes {
                bodies.extend(piece.body.take());
            }
            !goes
        });
        for body in bodies {
            self.put_away(world, carrier, body);
        }
    }

    /// A piece is in its place again.
    pub(super) fn put_back(&mut self, piece: &Piece) {
        if Arc::ptr_eq(&piece.cut, &self.cut) {
            self.support.put_back(piece.number);
            return;
        }
        // The surface has been cut again since: what lies in the piece is back.
        for shard in self.support.missing().collect::<Vec<u32>>() {
            let place = self.cut.inner_point(shard);
            if place.is_some_and(|place| piece.cut.distance(piece.number, place) == 0.0) {
                self.support.put_back(shard);
            }
        }
    }
}

/// Seconds of the shards since a surface broke, if it has.
pub(super) fn time_of(world: &World, surface: Entity) -> Option<f64> {
    broken(world, surface).map(|broken| broken.time)
}

/// Takes the crumbs that have come off in this frame, and what they are made of.
pub(super) fn take_crumbs(world: &mut World, surface: Entity) -> Option<(Vec<Crumb>, Option<UntypedHandle>, RimLook)> {
    let broken = world.get_mut::<Pieces>(surface)?.into_inner().0.as_mut()?;
    let crumbs = core::mem::take(&mut broken.crumbs);
    (!crumbs.is_empty()).then(|| (crumbs, broken.inside.clone(), broken.rim))
}

/// The pieces of a surface that has shattered. They are taken out while shards come and go.
#[derive(Component, Default)]
#[component(clone_behavior = Ignore)]
pub(crate) struct Pieces(Option<Box<Broken>>);

impl Pieces {
    pub(super) fn get(&self) -> Option<&Broken> {
        self.0.as_deref()
    }

    /// Whether some of what was released is still to leave.
    pub(super) fn is_waiting(&self) -> bool {
        self.0.as_ref().is_some_and(|broken| !broken.waiting.is_empty())
    }
}

/// The pieces of a surface, if it has shattered.
pub(super) fn broken(world: &World, surface: Entity) -> Option<&Broken> {
    world.get::<Pieces>(surface)?.get()
}

/// Takes the pieces of a surface out, for [`put_back`].
pub(super) fn take(world: &mut World, surface: Entity) -> Option<Box<Broken>> {
    world.get_mut::<Pieces>(surface)?.0.take()
}

/// Puts the pieces of a surface back.
pub(super) fn put_back(world: &mut World, surface: Entity, broken: Box<Broken>) {
    if let Some(mut pieces) = world.get_mut::<Pieces>(surface) {
        pieces.0 = Some(broken);
    } else if let Ok(mut entity) = world.get_entity_mut(surface) {
        entity.insert(Pieces(Some(broken)));
    }
}

/// Makes a surface whole again: its shards and holes go.
pub(crate) fn drop_shards(world: &mut World, entity: Entity, active: &mut Active) {
    active.bump_revision();
    let Some(mut broken) = take(world, entity) else { return };
    for index in 0..broken.pieces.len() {
        broken.hide(world, &active.carrier, index);
    }
    active.carrier.kind.open(world, entity, &active.carrier, false);
    active.drawing.cutouts = None;
    active.drawing.is_stale |= !core::mem::take(&mut active.drawing.carried).is_empty();
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.remove::<(CrackShards, Pieces)>();
    }
    active.avoid_holes();
    active.mark_all();
}
