//! Shards in motion.

use super::{
    Broken, Reassembled, ShatterCracks, Spares,
    body::Shown,
    broken::Piece,
    drop_shards,
    holes::{bounds, spans_of},
    release::make_room,
};
use crate::{
    math::mix,
    plugin::{
        carrier::Carrier,
        surfaces::{Active, Surfaces},
    },
    shatter::Pose,
};
use bevy::prelude::*;
use std::sync::Arc;

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

/// Shards that are shown from this frame on: entity, surface, and which of its pieces for which time.
type News = Vec<(Entity, Entity, [u32; 2])>;

/// Lets time pass for all shards and puts them where they are then.
pub(in crate::plugin) fn fly_shards(world: &mut World) {
    let seconds = world.get_resource::<Time>().map_or(DEFAULT_FRAME, |time| time.delta_secs());
    let (mut whole, mut shown) = (Vec::new(), Vec::new());
    world.resource_scope(|world, mut surfaces: Mut<Surfaces>| {
        let mut broken = core::mem::take(&mut surfaces.broken);
        broken.retain(|&entity| {
            let Some(active) = surfaces.active.get_mut(&entity) else { return false };
            let Some(pieces) = active.broken.take() else { return false };
            match fly(world, entity, active, pieces, seconds, &mut shown) {
                Fate::Broken => {}
                Fate::Mended => {
                    active.renew();
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
        if broken.is_empty() {
            Spares::clear(world);
        }
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
    shown: &mut News,
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
    let now = broken.time;
    if now == before {
        active.broken = Some(broken);
        return Fate::Broken;
    }
    let mut fate = Fate::Broken;
    // What was released later than now is in its place, and what parted later is one.
    let early: Vec<Piece> =
        if now < before { broken.pieces.extract_if(.., |piece| piece.born > now).collect() } else { Vec::new() };
    for mut piece in early {
        if let Some(body) = piece.body.take() {
            broken.put_away(world, &active.carrier, body);
        }
        if let Some(whole) = piece.part_of {
            if let Some(index) = broken.index_of(whole) {
                broken.pieces[index].is_broken = false;
            }
            continue;
        }
        broken.holes.set(&spans_of(&piece.cut, piece.number, active.field.frame), false);
        broken.put_back(&piece);
        active.mark(bounds(&piece.cut, piece.number, active.field.frame));
        fate = Fate::Mended;
    }
    let is_over = before > broken.end && now > broken.end;
    if is_flying && !is_over {
        let mut fresh = Vec::new();
        let mut index = 0;
        while index < broken.pieces.len() {
            broken.break_if_due(index);
            let pose = broken.show(world, surface, &active.carrier, index);
            fresh.extend(pose.map(|pose| Shown { index, pose, form: None }));
            index += 1;
        }
        let fresh = broken.spawn(world, surface, &active.carrier, fresh);
        shown.extend(fresh.into_iter().map(|(entity, piece)| (entity, surface, piece)));
    }
    broken.tell(world, surface);
    active.broken = Some(broken);
    fate
}

impl Broken {
    /// Puts a piece where it is now, if it is anywhere. Returns its pose if it is to be shown from now on.
    fn show(&mut self, world: &mut World, surface: Entity, carrier: &Carrier, index: usize) -> Option<Pose> {
        let piece = &self.pieces[index];
        let pose = piece.flight.pose((self.time - piece.start) as f32);
        if pose.opacity <= 0.0 || piece.is_broken {
            self.hide(world, carrier, index);
            return None;
        }
        if piece.body.is_none() && !piece.is_spent {
            return Some(pose);
        }
        self.pose(world, surface, carrier, index, pose);
        None
    }

    /// Lets fragments take the place of a piece if its time has come. They are always the same.
    fn break_if_due(&mut self, index: usize) {
        let piece = &self.pieces[index];
        let Some((again, due)) = piece.again.filter(|_| !piece.is_broken) else { return };
        let born = piece.start + f64::from(due);
        let end = piece.start + f64::from(piece.flight.end());
        let is_due = born <= self.time && born < end && self.time < end;
        let Some(whole) = piece.cut.get(piece.number).filter(|_| is_due) else { return };
        let Some(largest) = again.classes.next(whole.area) else { return };
        let Ok(fragments) = piece.cut.break_again(piece.number, largest, piece.seed) else { return };
        let fragments = Arc::new(fragments);
        let mut parts = Vec::with_capacity(fragments.len());
        for (number, fragment) in (0u32..).zip(fragments.iter()) {
            let seed = mix(piece.seed ^ mix(u64::from(number)));
            parts.push(Piece {
                cut: fragments.clone(),
                number,
                id: self.next + number,
                seed,
                start: piece.start,
                born,
                flight: piece.flight.fragment(due, whole, fragment, again.apart, seed),
                again: again.due(fragment.area, seed).map(|more| (again, due + more)),
                is_broken: false,
                part_of: Some(piece.id),
                uv: piece.uv,
                is_spent: piece.is_spent,
                body: None,
                spare: None,
                times: 0,
                level: 0,
            });
        }
        self.next += parts.len() as u32;
        self.pieces[index].is_broken = true;
        self.pieces.append(&mut parts);
    }
}
