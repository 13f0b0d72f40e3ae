//! From hits to cracks: a surface gets its growth and textures at its first hit.

use crate::growth::HitOutcome;
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{CrackBudget, CrackChips, CrackClock, CrackState, CrackStatus, HitPoint};
use crate::plugin::carrier::kind::{CarrierKind, Found};
use crate::plugin::carrier::kinds;
use crate::plugin::draw::freeze::{freeze_if_full, has_to_wait};
use crate::plugin::jobs::background::drop_in_background;
use crate::plugin::jobs::frame_time::{FrameClock, Timer};
use crate::plugin::source::picture;
use crate::plugin::surface::cracked::{active, active_mut, has_cracked, with_queues};
use crate::plugin::surface::cracks::LastHit;
use crate::plugin::surface::create::set_status;
use crate::plugin::surface::prepare::{self, fail};
use crate::plugin::surface::queue::{HitQueue, QueuedHit, with_queue};
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::time;
use bevy::prelude::*;

/// Share of the frame's budget after which no further hit is applied.
const SHARE: f32 = 0.4;

/// Surfaces in line that are looked at for background tasks.
const MAX_OTHERS: usize = 16;

/// Surfaces that are not ready and are looked at when there is no time.
const MAX_LOOKS: usize = 64;

/// Places for markers that a hit looks at between two looks at the clock.
const SLICE: u32 = 1024;

/// Shards fly no further after harder hits: the most that [`ShatterRequest::energy`](super::ShatterRequest::energy) may be.
const HARDEST: f32 = 1000.0;

const GONE: &str = "the surface is gone";

/// Whether any hit waits, or has markers to lay out.
pub(crate) fn any_hits(hits: Res<HitQueue>, queues: Res<Queues>) -> bool {
    hits.has_any() || !queues.laying_out.is_empty() || !queues.freezing.is_empty()
}

/// Applies the hits that wait, in turns, as many as the budget allows.
pub(crate) fn apply_hits(world: &mut World) {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    let (mut looks, mut has_worked) = (0, lay_out(world, &timer));
    keep_room(world);
    world.resource_mut::<HitQueue>().unpark();
    while let Some(entity) = world.resource::<HitQueue>().next() {
        if has_worked && timer.is_over() {
            make_others(world);
            break;
        }
        // A hit comes after a change of settings that was made before it.
        if world.resource::<Queues>().late.contains(&entity) {
            world.resource_mut::<HitQueue>().park();
            continue;
        }
        // A hit comes after the markers of the one before it, all in their places.
        match prepare_some(world, entity) {
            Some(true) => {
                has_worked = true;
                continue;
            }
            Some(false) => {
                world.resource_mut::<HitQueue>().park();
                continue;
            }
            None => {}
        }
        // A hit beside a surface makes nothing for it.
        let ready = if is_missed(world, entity) { Ok(true) } else { prepare::make_ready(world, entity) };
        let is_ready = !matches!(ready, Ok(false));
        match ready {
            // Observers may have healed it.
            _ if world.resource::<HitQueue>().next() != Some(entity) => {}
            Ok(true) if has_to_wait(world, entity, |world| will_land(world, entity)) => {
                world.resource_mut::<HitQueue>().park();
            }
            Ok(true) => apply_next(world, entity, &timer),
            Ok(false) => {
                set_status(world, entity, CrackStatus::Waiting);
                world.resource_mut::<HitQueue>().park();
                looks += 1;
            }
            Err(error) => fail(world, entity, error),
        }
        has_worked |= is_ready;
        // Those that wait are not to keep others from the one hit that every frame has time for.
        if timer.is_over() && looks >= MAX_LOOKS {
            make_others(world);
            break;
        }
    }
    world.resource_mut::<FrameClock>().stop(&timer);
}

/// Goes on with the markers of a surface that have no places yet; `None` if all have, `false` if others go on with it first: a step is under way, or markers
/// are being laid out.
fn prepare_some(world: &mut World, entity: Entity) -> Option<bool> {
    let active = active_mut(world, entity)?;
    if active.cracks.growth.is_in_step() {
        return Some(false);
    }
    active.cracks.growth.is_preparing().then(|| {
        let has_places = !active.turn.is_laying_out;
        if has_places {
            active.cracks.growth.prepare_step(time::SLICE);
        }
        has_places
    })
}

/// No room is made any more for hits that have gone.
fn keep_room(world: &mut World) {
    let surfaces: Vec<Entity> = world.resource::<Queues>().freezing.iter().copied().collect();
    for entity in surfaces {
        if world.resource::<HitQueue>().first(entity).is_none() {
            world.resource_mut::<Queues>().freezing.remove(&entity);
            if let Some(active) = active_mut(world, entity) {
                drop_in_background(active.freezing.take());
            }
        }
    }
}

/// Goes on with the markers of hits, the oldest first, one slice at least. Returns whether there was any.
fn lay_out(world: &mut World, timer: &Timer) -> bool {
    let mut has_worked = false;
    while let Some(&entity) = world.resource::<Queues>().laying_out.front().filter(|_| !has_worked || !timer.is_over())
    {
        let is_left = active_mut(world, entity).is_some_and(|active| {
            has_worked |= active.cracks.growth.is_laying_out();
            active.turn.is_laying_out = active.cracks.growth.continue_hit(SLICE);
            active.turn.is_laying_out
        });
        if !is_left {
            world.resource_mut::<Queues>().laying_out.pop_front();
        }
    }
    has_worked
}

/// Has surfaces made by a background task for whose hits this one has no time.
fn make_others(world: &mut World) {
    // The first of them comes in the next frame in any case.
    let others: Vec<Entity> = world.resource::<HitQueue>().turns().skip(1).take(MAX_OTHERS).collect();
    for entity in others {
        // An observer of another may have healed it.
        if world.resource::<HitQueue>().first(entity).is_none() || is_missed(world, entity) {
            continue;
        }
        match prepare::make_beside(world, entity) {
            Ok(true) => set_status(world, entity, CrackStatus::Waiting),
            Ok(false) => {}
            Err(error) => fail(world, entity, error),
        }
    }
}

/// Applies the first hit of the surface in turn, which is ready.
fn apply_next(world: &mut World, entity: Entity, timer: &Timer) {
    let hit = with_queue(world, |_, queue, stats| queue.take(stats));
    if let Some(hit) = hit {
        let outcome = apply(world, entity, hit, timer);
        with_queue(world, |world, queue, stats| match outcome {
            Ok(HitOutcome::Started(_)) => stats.applied += 1,
            Ok(HitOutcome::Merged(_)) => stats.merged += 1,
            Ok(HitOutcome::Nothing) => stats.ignored += 1,
            Ok(HitOutcome::Rejected(reason)) => {
                queue.reject(&EntityLabel::of(world, entity), &reason.to_string(), stats);
            }
            Err(reason) => queue.reject(&EntityLabel::of(world, entity), reason, stats),
        });
    }
    if world.get::<CrackState>(entity).is_some_and(|state| state.status == CrackStatus::Waiting) {
        set_status(world, entity, CrackStatus::Untouched);
    }
}

/// Whether the first hit of a surface without cracks is to be refused for where it lands. If not, the hit knows its place from then on: it
/// may have to wait, and a mesh has many triangles to look at.
fn is_missed(world: &mut World, entity: Entity) -> bool {
    if has_cracked(world, entity) {
        return false;
    }
    let Some(hit) = world.resource::<HitQueue>().first(entity) else { return false };
    let (Some(kind), Found::Shown(shown)) = kinds::inspect(world, entity) else { return false };
    let is_there = shown.pictures().all(|picture| matches!(picture::is_loaded(world, picture), Ok(true)));
    if !is_there {
        return false;
    }
    match locate(world, entity, kind, hit.at) {
        Ok(uv) => {
            world.resource_mut::<HitQueue>().place_first(entity, uv);
            false
        }
        Err(_) => true,
    }
}

/// Texture coordinates of a hit, within the surface.
fn locate(world: &World, entity: Entity, kind: &dyn CarrierKind, at: HitPoint) -> Result<Vec2, &'static str> {
    let uv = match at {
        HitPoint::Uv(uv) => uv,
        HitPoint::Local(point) | HitPoint::World(point) => {
            let size = active(world, entity).map(|active| active.drawing.field.frame.size());
            kind.locate(world, entity, point, size)?
        }
    };
    // Not a number is not within either.
    let is_within = uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all();
    is_within.then_some(uv).ok_or("it lies off the surface")
}

/// Texture coordinates at which a hit meets the surface; a reason if it does not.
fn land(world: &mut World, entity: Entity, hit: &QueuedHit) -> Result<Vec2, &'static str> {
    let before = active(world, entity);
    let kind = before.map(|active| active.carrier.kind).or_else(|| kinds::inspect(world, entity).0).ok_or(GONE)?;
    let is_blank = before.is_some_and(|active| active.cracks.growth.network().nodes().is_empty());
    let at = kind.aim(world, entity, hit.at, hit.point, is_blank);
    let uv = locate(world, entity, kind, at)?;
    let active = active(world, entity).ok_or(GONE)?;
    let frame = active.drawing.field.frame;
    let texel = frame.to_texel(frame.uv_to_pos(uv)).max(Vec2::ZERO).as_uvec2();
    if active.drawing.cutouts.as_ref().is_some_and(|holes| holes.contains(texel)) {
        return Err("a shard has left the surface there");
    }
    if let Some(rect) = active.canvas.seen() {
        let texel = rect.min + (uv * frame.size().as_vec2()).as_uvec2().min(rect.size() - 1);
        if active.canvas.base.is_closed(texel, active.surface.alpha_mask) {
            return Err("the surface is transparent there");
        }
    }
    Ok(uv)
}

/// Whether the first hit of a surface that waits meets it.
fn will_land(world: &mut World, entity: Entity) -> bool {
    let hit = world.resource::<HitQueue>().first(entity).copied();
    hit.is_some_and(|hit| land(world, entity, &hit).is_ok())
}

fn apply(world: &mut World, entity: Entity, hit: QueuedHit, timer: &Timer) -> Result<HitOutcome, &'static str> {
    let uv = land(world, entity, &hit)?;
    let has_chips = world.get::<CrackChips>(entity).is_some();
    let active = active_mut(world, entity).ok_or(GONE)?;
    let pos = uv * active.cracks.growth.network().extent();
    if freeze_if_full(active) {
        with_queues(world, entity, |queues, turn| queues.mark_dirty(entity, turn));
    }
    let active = active_mut(world, entity).ok_or(GONE)?;
    let outcome = active.cracks.growth.begin_hit(pos, hit.energy);
    let mut is_left = active.cracks.growth.continue_hit(SLICE);
    while is_left && !timer.is_over() {
        is_left = active.cracks.growth.continue_hit(SLICE);
    }
    if matches!(outcome, HitOutcome::Started(_) | HitOutcome::Merged(_)) {
        let energy = hit.energy.min(HARDEST);
        active.cracks.last_hit = Some(LastHit { pos, energy, direction: hit.direction });
        active.cracks.hits += 1;
        active.cracks.unchipped += u32::from(has_chips);
        active.note_hit();
        let turned = active.turn_forwards();
        with_queues(world, entity, |queues, turn| {
            if is_left {
                queues.lay_out(entity, turn);
            }
            queues.start_growing(entity, turn);
            // The nodes it starts with show at once.
            queues.mark_dirty(entity, turn);
        });
        if let (Some(turned), Some(mut clock)) = (turned, world.get_mut::<CrackClock>(entity)) {
            *clock = turned;
        }
        set_status(world, entity, CrackStatus::Growing);
    }
    Ok(outcome)
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::{
        CrackPreset,
        growth::CrackGrowth,
        plugin::{
            CrackHit, CrackStats, CrackSurface,
            headless::{app, blank},
        },
    };
    use bevy::time::TimeUpdateStrategy;
    use core::time::Duration;

    /// Fault B5: a frame without time looks at one slice of places, however many markers hits make and however many hits there are, and
    /// the cracks are those of hits that take effect at once.
    #[test]
    fn b5_the_markers_of_hits_are_laid_out_within_the_budget() {
        let preset = CrackPreset::TEMPERED_GLASS.scaled(0.3);
        let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
        // However long its frames take.
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(1)));
        let places = [Vec2::splat(0.5), Vec2::new(0.2, 0.7)];
        let entities: Vec<Entity> = (0..3)
            .map(|seed| {
                let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(64)));
                let surface = CrackSurface::new(preset.clone()).with_seed(seed);
                app.world_mut().spawn((Sprite::from_image(image), surface)).id()
            })
            .collect();
        app.update();
        for (entity, at) in entities.iter().flat_map(|entity| places.map(|at| (*entity, at))) {
            app.world_mut().trigger(CrackHit::uv(entity, at));
        }
        let made = |app: &App| -> u32 {
            let active = |entity: &Entity| active(app.world(), *entity);
            entities.iter().filter_map(active).map(|active| active.cracks.growth.marker_counts().total).sum()
        };
        let (mut before, mut frames, mut has_waited) = (0, 0, false);
        loop {
            app.update();
            frames += 1;
            let now = made(&app);
            assert!(now - before <= SLICE, "{} markers in a frame", now - before);
            before = now;
            let all: Vec<_> = entities.iter().filter_map(|entity| active(app.world(), *entity)).collect();
            has_waited |=
                all.iter().any(|active| active.cracks.growth.is_laying_out() && active.cracks.growth.steps() == 0);
            let is_done = all.len() == entities.len() && all.iter().all(|active| active.cracks.hits == 2);
            if is_done && app.world().resource::<Queues>().laying_out.is_empty() {
                break;
            }
            assert!(frames < 20_000, "they never come");
        }
        assert!(has_waited && frames > 100, "{frames} frames");
        let stats = app.world().resource::<CrackStats>();
        assert_eq!((stats.sent, stats.applied, stats.queued), (6, 6, 0));
        for (seed, entity) in (0..).zip(&entities) {
            let growth = &active(app.world(), *entity).expect("it has cracked").cracks.growth;
            let mut at_once = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, seed).expect("it is valid");
            at_once.hit(places[0], 1.0);
            // The other hit came after as many steps as there were by then.
            let first_of_second = growth.network().nodes().iter().position(|node| node.impact == 1);
            let born = first_of_second.map_or(0, |node| growth.network().nodes()[node].birth);
            while at_once.steps() < born && at_once.step().grew() {}
            at_once.hit(places[1], 1.0);
            while at_once.steps() < growth.steps() && at_once.step().grew() {}
            assert_eq!(at_once.network().nodes(), growth.network().nodes(), "surface {seed}");
        }
    }
}
