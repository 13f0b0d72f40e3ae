//! Shards in motion.

use super::{Broken, CrackShards, Reassembled, ShatterCracks, drop_shards, holes::bounds, release::make_room};
use crate::{
    plugin::{
        carrier::Carrier,
        surfaces::{Active, Surfaces},
    },
    shatter::ShardMesh,
};
use bevy::prelude::*;

/// Length of a frame where there is no clock, seconds.
const DEFAULT_FRAME: f32 = 1.0 / 60.0;

/// Time goes no further, seconds: by then everything has faded.
const MAX_TIME: f64 = 1e6;

/// What has become of a surface.
enum Fate {
    Broken,
    /// A hole has closed.
    Mended,
    /// The last shard has come back.
    Whole,
}

/// Lets time pass for all shards and puts them where they are then.
pub(in crate::plugin) fn fly_shards(world: &mut World, mut scratch: Local<ShardMesh>) {
    let seconds = world.get_resource::<Time>().map_or(DEFAULT_FRAME, |time| time.delta_secs());
    let (mut whole, mut shown) = (Vec::new(), Vec::new());
    world.resource_scope(|world, mut surfaces: Mut<Surfaces>| {
        let mut broken = core::mem::take(&mut surfaces.broken);
        broken.retain(|&entity| {
            let Some(active) = surfaces.active.get_mut(&entity) else { return false };
            let Some(pieces) = active.broken.take() else { return false };
            match fly(world, entity, active, pieces, seconds, &mut scratch, &mut shown) {
                Fate::Broken => {}
                Fate::Mended => {
                    active.mind_holes();
                    surfaces.soil(entity);
                }
                Fate::Whole => {
                    let bytes = drop_shards(world, entity, active);
                    surfaces.bytes -= bytes;
                    surfaces.soil(entity);
                    whole.push(entity);
                    return false;
                }
            }
            true
        });
        surfaces.broken = broken;
        if !shown.is_empty() {
            surfaces.shards.extend(shown);
            make_room(world, &mut surfaces);
        }
    });
    for entity in whole {
        world.trigger(Reassembled { entity });
    }
}

fn fly(
    world: &mut World,
    surface: Entity,
    active: &mut Active,
    mut broken: Box<Broken>,
    seconds: f32,
    scratch: &mut ShardMesh,
    shown: &mut Vec<Entity>,
) -> Fate {
    let (speed, seek, is_flying) = match world.get_mut::<ShatterCracks>(surface) {
        Some(mut settings) => (settings.speed, settings.bypass_change_detection().seek.take(), settings.fly),
        None => (1.0, None, true),
    };
    let before = broken.time;
    let run = f64::from(speed) * f64::from(seconds);
    let run = if run.is_finite() { run } else { 0.0 };
    let time = seek.map_or(before + run, f64::from);
    broken.time = if time.is_nan() { 0.0 } else { time.clamp(0.0, MAX_TIME) };
    if run < 0.0 && time <= 0.0 {
        active.broken = Some(broken);
        return Fate::Whole;
    }
    // What was released later than now is in its place.
    let now = broken.time;
    let mut fate = Fate::Broken;
    let mut index = 0;
    while let Some(piece) = broken.pieces.get(index) {
        if piece.start <= now {
            index += 1;
            continue;
        }
        broken.hide(world, index);
        let piece = broken.pieces.remove(index);
        broken.holes.set(&piece.cut, piece.number, active.field.frame, false);
        broken.put_back(&piece);
        active.mark(bounds(&piece.cut, piece.number, active.field.frame));
        fate = Fate::Mended;
    }
    let is_over = before > broken.end && now > broken.end;
    if is_flying && now != before && !is_over {
        for index in 0..broken.pieces.len() {
            shown.extend(broken.show(world, surface, &active.carrier, index, scratch));
        }
    }
    if now != before
        && let Some(mut report) = world.get_mut::<CrackShards>(surface)
    {
        *report = broken.report();
    }
    active.broken = Some(broken);
    fate
}

impl Broken {
    /// Puts a piece where it is now, if it is anywhere. Returns its entity if that is new.
    fn show(
        &mut self,
        world: &mut World,
        surface: Entity,
        carrier: &Carrier,
        index: usize,
        scratch: &mut ShardMesh,
    ) -> Option<Entity> {
        let piece = &self.pieces[index];
        let pose = piece.flight.pose((self.time - piece.start) as f32);
        if pose.opacity <= 0.0 {
            self.hide(world, index);
            return None;
        }
        let is_new = piece.entity.is_none() && !piece.is_spent;
        let shard = if is_new { self.spawn(world, surface, carrier, index, scratch) } else { None };
        self.pose(world, surface, carrier, index, pose);
        shard
    }
}
