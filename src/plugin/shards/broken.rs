//! [`Broken`]: a surface that has shattered.

use super::{
    CrackShards, Plane, ShatterCracks,
    body::{Body, LEVELS},
    holes::Holes,
    order::Batch,
};
use crate::{
    plugin::{carrier::Carrier, paint::stamp_anew, surfaces::Active},
    raster::TexelRect,
    shatter::{BreakAgain, Flight, RimLook, Shards, Support},
};
use bevy::{asset::UntypedHandle, prelude::*};
use std::{collections::VecDeque, sync::Arc};

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
    /// How the rims of shards look.
    pub(super) rim: RimLook,
    pub(in crate::plugin) holes: Holes,
    /// Cracks that were carried on when it was cut, and are drawn.
    pub(in crate::plugin) carried: Vec<Arc<[Vec<Vec2>]>>,
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
    /// Bytes of the picture, counted against the budget.
    pub(super) bytes: u64,
}

/// A piece that is out of its place, or a fragment of one.
pub(super) struct Piece {
    /// The pieces it is one of, and its number among them.
    pub(super) cut: Arc<Shards>,
    pub(super) number: u32,
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
            rim: RimLook::PLAIN,
            holes: Holes::new(active.field.frame.size()),
            carried: Vec::new(),
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
            bytes,
        }
    }

    /// Writes on the surface what has become of it.
    pub(super) fn tell(&self, world: &mut World, surface: Entity) {
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
    active.renew();
    let Some(mut broken) = active.broken.take() else { return 0 };
    for index in 0..broken.pieces.len() {
        broken.hide(world, &active.carrier, index);
    }
    (active.carrier.kind.open)(world, entity, &active.carrier, false);
    if !broken.carried.is_empty() {
        stamp_anew(active);
    }
    if let Ok(mut entity) = world.get_entity_mut(entity) {
        entity.remove::<CrackShards>();
    }
    active.bytes -= broken.bytes;
    active.mind_holes();
    active.mark(TexelRect::whole(active.field.frame.size()));
    broken.bytes
}
