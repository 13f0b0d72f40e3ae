//! Shards in motion.

use super::body::Spares;
use super::broken::{self, Broken, Piece, drop_shards};
use super::crumbs::{Crumb, Loose, MOST_IN_FRAME};
use super::order::MOST_NEW;
use super::release::{count_shown, evict_oldest, with_active};
use super::request::ShardQueue;
use super::show::ShownPiece;
use super::spans::{add_fringe, bounds, spans_of};
use crate::math::mix;
use crate::plugin::api::{CrackBudget, Reassembled, ShatterCracks};
use crate::plugin::carrier::kind::Carrier;
use crate::plugin::draw::async_playback::is_at_work;
use crate::plugin::jobs::deferred::hold;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::with_queues;
use crate::shatter::Pose;
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

/// A piece breaks into no more than about twice so many at a time; those break again.
const MOST_PARTS: f32 = 64.0;

/// How many more shards there may be.
struct Room {
    /// That are made in this frame.
    new: usize,
    /// In all.
    all: usize,
}

impl Room {
    fn take(&mut self, new: usize, all: usize) {
        // Frames that may take any time have no end of it.
        if self.new != usize::MAX {
            self.new = self.new.saturating_sub(new);
        }
        self.all = self.all.saturating_sub(all);
    }
}

/// Lets time pass for all shards and puts them where they are then.
pub(crate) fn fly_shards(world: &mut World) {
    let seconds = world.get_resource::<Time>().map_or(DEFAULT_FRAME, |time| time.delta_secs());
    let mut whole = Vec::new();
    hold(world, |world| {
        world.resource_scope(|world, mut queue: Mut<ShardQueue>| fly_all(world, &mut queue, seconds, &mut whole));
    });
    for entity in whole {
        world.trigger(Reassembled { entity });
    }
}

fn fly_all(world: &mut World, queue: &mut ShardQueue, seconds: f32, whole: &mut Vec<Entity>) {
    let budget = world.resource::<CrackBudget>();
    let (most, is_unlimited) = (budget.max_shards, budget.is_unlimited());
    let mut surfaces = core::mem::take(&mut queue.broken);
    let shown = if surfaces.is_empty() { 0 } else { count_shown(world, queue) };
    let mut room = Room { new: if is_unlimited { usize::MAX } else { MOST_NEW }, all: most.saturating_sub(shown) };
    let mut fresh = Vec::new();
    surfaces.retain(|&entity| {
        let fly = |world: &mut World, active: &mut Active| {
            let broken = broken::take(world, entity)?;
            let (fate, pieces) = fly(world, entity, active, broken, seconds, &mut room);
            match fate {
                Fate::Broken => {}
                Fate::Mended => {
                    active.bump_revision();
                    active.avoid_holes();
                }
                Fate::Whole => drop_shards(world, entity, active),
            }
            Some((fate, pieces))
        };
        let Some((fate, pieces)) = with_active(world, entity, fly).flatten() else { return false };
        if !matches!(fate, Fate::Broken) {
            with_queues(world, entity, |queues, turn| queues.mark_dirty(entity, turn));
        }
        if matches!(fate, Fate::Whole) {
            whole.push(entity);
            return false;
        }
        fresh.push((entity, pieces));
        true
    });
    queue.broken = surfaces;
    queue.new = room.new;
    // The oldest make room only for what is shown again.
    for (entity, mut pieces) in fresh.into_iter().filter(|(_, pieces)| !pieces.is_empty()) {
        pieces.truncate(most);
        let show = |world: &mut World, active: &mut Active| {
            let mut broken = broken::take(world, entity)?;
            evict_oldest(world, queue, pieces.len(), (entity, active, &mut broken));
            let shards = broken.spawn(world, entity, &active.carrier, pieces);
            broken.report(world, entity);
            broken::put_back(world, entity, broken);
            Some(shards)
        };
        let Some(shards) = with_active(world, entity, show).flatten() else { continue };
        queue.shown.extend(shards.into_iter().map(|(shard, piece)| (shard, entity, piece)));
        Spares::shrink_to(world, most.saturating_sub(queue.shown.len()));
    }
    Spares::trim(world, !queue.broken.is_empty(), queue.shown.len(), is_unlimited);
}

fn fly(
    world: &mut World,
    surface: Entity,
    active: &mut Active,
    mut broken: Box<Broken>,
    seconds: f32,
    room: &mut Room,
) -> (Fate, Vec<ShownPiece>) {
    let (speed, seek, is_flying) = match world.get_mut::<ShatterCracks>(surface) {
        Some(mut settings) => (settings.speed, settings.bypass_change_detection().seek.take(), settings.fly),
        None => (1.0, None, true),
    };
    // Nobody wanted what is left of them.
    broken.crumbs.clear();
    let before = broken.time;
    let run = f64::from(speed) * f64::from(seconds);
    let run = if run.is_finite() { run } else { 0.0 };
    let time = seek.map_or(before + run, f64::from);
    broken.time = if time.is_nan() { 0.0 } else { time.clamp(0.0, MAX_TIME) };
    // What a task makes of it still has the holes.
    if run < 0.0 && time <= 0.0 && !is_at_work(world, surface) {
        broken::put_back(world, surface, broken);
        return (Fate::Whole, Vec::new());
    }
    let now = broken.time;
    // Some may have had to wait for their turn.
    if now == before && !broken.is_behind && !broken.has_faded {
        broken::put_back(world, surface, broken);
        return (Fate::Broken, Vec::new());
    }
    let mut fate = Fate::Broken;
    if now < broken.since && !broken.waiting.is_empty() {
        broken.keep_waiting();
        fate = Fate::Mended;
    }
    if core::mem::take(&mut broken.has_faded) {
        broken.join_faded(world, &active.carrier);
    }
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
        if let Some(holes) = &mut active.drawing.cutouts {
            let mut spans = spans_of(&piece.cut, piece.number, active.drawing.field.frame);
            if let Some(shell) = &broken.shell {
                add_fringe(&mut spans, &shell.fringe);
            }
            holes.set(&spans, false);
        }
        broken.put_back(&piece);
        active.mark(bounds(&piece.cut, piece.number, active.drawing.field.frame));
        fate = Fate::Mended;
    }
    let is_over = before > broken.end && now > broken.end;
    let mut fresh = Vec::new();
    broken.is_behind = false;
    if is_flying && !is_over {
        let first = broken.next;
        let mut index = 0;
        while index < broken.pieces.len() {
            // Parts that have come off in this frame were counted then.
            let is_counted = broken.pieces[index].id >= first;
            broken.break_if_due(&active.carrier, index, is_counted, room);
            if let Some(pose) = broken.show(world, surface, &active.carrier, index) {
                if is_counted || room.new > 0 {
                    fresh.push(ShownPiece { index, pose, form: None });
                    room.take(usize::from(!is_counted), usize::from(!is_counted));
                } else {
                    broken.is_behind = true;
                }
            }
            index += 1;
        }
    }
    broken.report(world, surface);
    broken::put_back(world, surface, broken);
    (fate, fresh)
}

impl Broken {
    /// Puts a piece where it is now, if it is anywhere. Returns its pose if it is to be shown from now on.
    fn show(&mut self, world: &mut World, surface: Entity, carrier: &Carrier, index: usize) -> Option<Pose> {
        let piece = &self.pieces[index];
        let pose = piece.flight.pose((self.time - piece.start) as f32);
        self.has_faded |= pose.opacity <= 0.0 && piece.is_broken;
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

    /// Lets fragments take the place of a piece if its time has come. They are always the same. It stays whole if there is no room for
    /// them when it has come, and waits for a frame that has.
    fn break_if_due(&mut self, carrier: &Carrier, index: usize, is_counted: bool, room: &mut Room) {
        let piece = &mut self.pieces[index];
        let Some((again, due)) = piece.again.filter(|_| !piece.is_broken && !piece.is_spent) else { return };
        let born = piece.start + f64::from(due);
        let end = piece.start + f64::from(piece.flight.end());
        let is_due = born <= self.time && born < end && self.time < end;
        piece.stays_whole &= is_due;
        let Some(whole) = piece.cut.get(piece.number).filter(|_| is_due && !piece.stays_whole) else { return };
        let Some(largest) = again.classes.next(whole.area) else { return };
        let largest = largest.max(whole.area / MOST_PARTS);
        // Its own place becomes free.
        let own = usize::from(is_counted || piece.body.is_some());
        let least = (whole.area / largest).ceil() as usize;
        if least > room.all + own {
            piece.stays_whole = true;
            return;
        }
        if least > room.new && room.new < MOST_NEW {
            self.is_behind = true;
            return;
        }
        let Ok(fragments) = piece.cut.break_again(piece.number, largest, piece.seed) else { return };
        if fragments.len() > room.all + own {
            piece.stays_whole = true;
            return;
        }
        room.take(fragments.len() - usize::from(is_counted).min(fragments.len()), fragments.len().saturating_sub(own));
        let fragments = Arc::new(fragments);
        let mut parts = Vec::with_capacity(fragments.len());
        for (number, fragment) in (0u32..).zip(fragments.iter()) {
            let seed = mix(piece.seed ^ mix(u64::from(number)));
            parts.push(Piece {
                cut: fragments.clone(),
                number,
                plane: piece.plane,
                id: self.next + number,
                seed,
                start: piece.start,
                born,
                flight: piece.flight.fragment(due, whole, fragment, again.apart, seed),
                again: again.due(fragment.area, seed).map(|more| (again, due + more)),
                is_broken: false,
                stays_whole: false,
                part_of: Some(piece.id),
                uv: piece.uv,
                is_spent: piece.is_spent,
                body: None,
                spare: None,
                times: 0,
                level: 0,
            });
        }
        self.shed_crumbs(carrier, &parts);
        self.next += parts.len() as u32;
        self.pieces[index].is_broken = true;
        self.pieces.append(&mut parts);
    }

    /// Crumbs come off the edges of fragments.
    fn shed_crumbs(&mut self, carrier: &Carrier, parts: &[Piece]) {
        let Some(params) = self.crumb_params else { return };
        let style = self.style(carrier);
        let most = MOST_IN_FRAME.saturating_sub(self.crumbs.len()) / parts.len().max(1);
        for Piece { cut, number, plane, flight, seed, start, .. } in parts {
            let loose = Loose { cut, number: *number, plane, flight, seed: *seed, style: &style };
            self.crumbs.extend(loose.crumbs(params, most).into_iter().map(|crumb| Crumb { start: *start, ..crumb }));
        }
    }
}
