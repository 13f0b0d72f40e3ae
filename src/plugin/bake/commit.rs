//! What the frames do of a bake: they order a surface, and apply what was made.

use super::finish::{Finish, FinishInputs, FinishStep, Finished, Seen};
use super::map_job::Lines;
use super::work::{Bake, BakeJob, Baked, Work};
use crate::growth::Past;
use crate::plugin::api::{CrackClock, CrackError, CrackStatus, CrackStrands, CrackTextures, GuidedCracks};
use crate::plugin::draw::async_playback::{self, AsyncPlayback};
use crate::plugin::draw::next_picture;
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::jobs::background::{drop_in_background, guarded};
use crate::plugin::shards::broken::drop_shards;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::{self, active, has_cracked, with_queues};
use crate::plugin::surface::create::{install, make_ready_now, set_status};
use crate::plugin::surface::inputs::BaseAndMask;
use crate::plugin::surface::plan::Plan;
use crate::plugin::surface::prepare::MAX_UPLOAD_FRAMES;
use crate::plugin::surface::queues::Queues;
use crate::plugin::surface::shared::Shared;
use crate::plugin::surface::time::First;
use bevy::{prelude::*, render::renderer::RenderDevice};

/// How often the surface may change while its cracks are made by background tasks; then they are made between two of them.
const MAX_ROUNDS: u32 = 8;

/// The seconds in which cracks appear; `None` = at once.
fn seconds(world: &World, entity: Entity, kind: Baked) -> Option<f32> {
    match kind {
        Baked::Strands => Some(world.get::<CrackStrands>(entity)?.seconds).filter(|seconds| *seconds > 0.0),
        Baked::Guided => world.get::<GuidedCracks>(entity)?.appearance.seconds(),
        Baked::Record => None,
    }
}

/// Has the surface made with these cracks, as it is now; from the start if it is another one.
pub(super) fn start_finish(
    world: &mut World,
    entity: Entity,
    bake: &mut Bake,
    mut lines: Lines,
) -> Result<(), CrackError> {
    let seconds = seconds(world, entity, bake.kind);
    let stager = world.resource::<Uploads>().stager(world.get_resource::<RenderDevice>());
    if !has_cracked(world, entity) {
        let (Some(plan), Some(ground)) = (&mut bake.plan, &lines.ground) else { return Ok(()) };
        if !plan.is_current(world, entity) {
            return Ok(());
        }
        if plan.has_room(world) {
            let clock = world.get::<CrackClock>(entity).copied();
            let record = lines.record.as_deref();
            let order = FinishInputs {
                surface: plan.surface.clone(),
                preset: plan.preset.clone(),
                base: ground.base.clone(),
                mask: ground.mask.clone(),
                rect: plan.pictures.rect,
                maps: plan.pictures.maps,
                past: record.map_or_else(Past::default, |record| record.past.clone()),
                seen: Seen::default(),
                first: First::of(clock, record.map_or(0.0, |record| record.time), seconds),
                has_clock: clock.is_some(),
                is_new: true,
                stager,
            };
            if plan.textures.is_none() {
                plan.allocate_textures(world)?;
            }
            bake.work = Work::Ready(BakeJob::Finish(Box::new(Finish::new(order, lines))));
            return Ok(());
        }
        // Coarser textures, or an error.
        if !make_ready_now(world, entity)? {
            return Ok(());
        }
    }
    let active = active(world, entity);
    if let (Some(active), Some(_)) = (active, &lines.record) {
        // What it shows beside hits stays.
        lines.added = active.cracks.added.clone();
    }
    if let Some(order) = active.and_then(|active| FinishInputs::of(active, seconds, stager, lines.record.as_deref())) {
        bake.work = Work::Ready(BakeJob::Finish(Box::new(Finish::new(order, lines))));
    }
    Ok(())
}

/// Applies what was made; `None` if it has to wait for the renderer, or be made again.
pub(super) fn commit(
    world: &mut World,
    entity: Entity,
    bake: &mut Bake,
    mut finished: Box<Finished>,
    frames: u32,
) -> Result<Option<Option<f32>>, CrackError> {
    let covered = finished.covered;
    match (cracked::take(world, entity), bake.plan.take()) {
        (Some(active), plan) => {
            bake.plan = plan;
            if finished.order.fits(&active) {
                replace(world, entity, bake.kind, active, *finished);
                return Ok(Some(covered));
            }
            cracked::put_back(world, entity, active);
        }
        (None, Some(mut plan))
            if finished.order.is_new
                && finished.order.has_clock == world.get::<CrackClock>(entity).is_some()
                && plan.has_room(world)
                && plan.is_current(world, entity) =>
        {
            let textures = plan.textures.take().unwrap_or_default();
            if frames == 0 {
                textures.fill(world, &mut finished.pictures);
            }
            if frames < MAX_UPLOAD_FRAMES && textures.are_staged(world) {
                plan.textures = Some(textures);
                bake.plan = Some(plan);
                bake.work = Work::Uploading(finished, frames + 1);
                return Ok(None);
            }
            settle(world, entity, bake.kind, *plan, textures, *finished);
            return Ok(Some(covered));
        }
        (None, plan) => bake.plan = plan,
    }
    again(world, entity, bake, *finished)?;
    Ok(None)
}

/// Has a surface made again that has changed meanwhile.
fn again(world: &mut World, entity: Entity, bake: &mut Bake, finished: Finished) -> Result<(), CrackError> {
    let Finished { order: past, added, record, covered, growth, cells, field, pictures, replay, .. } = finished;
    drop_in_background((growth, cells, field, pictures, replay));
    let ground = BaseAndMask { base: past.base, mask: past.mask };
    let ground = past.is_new.then_some(ground);
    start_finish(world, entity, bake, Lines { added, record, covered, ground })?;
    bake.rounds += 1;
    if bake.rounds < MAX_ROUNDS {
        return Ok(());
    }
    match core::mem::replace(&mut bake.work, Work::Wanted) {
        Work::Ready(BakeJob::Finish(mut finish)) => loop {
            match guarded(|| finish.step())? {
                FinishStep::More(more) => finish = more,
                FinishStep::Done(finished) => {
                    bake.work = Work::Uploading(finished, 0);
                    return Ok(());
                }
            }
        },
        work => bake.work = work,
    }
    Ok(())
}

/// Makes a surface of one that has not cracked before, whose textures are where they are shown from.
fn settle(world: &mut World, entity: Entity, kind: Baked, plan: Plan, textures: CrackTextures, finished: Finished) {
    let seconds = seconds(world, entity, kind);
    let is_outdated = plan.is_outdated;
    let Finished { order, added, record, growth, frozen, cells, field, touched, look, replay, playback, .. } = finished;
    let ground = plan.ground(world, BaseAndMask { base: order.base, mask: order.mask }, look, textures);
    let mut active = Box::new(Active::new(ground, growth, field));
    (active.drawing.touched, active.cracks.cells, active.cracks.added, active.canvas.is_outdated) =
        (touched, cells, added, is_outdated);
    active.show_made(replay, seconds);
    active.resume(record.as_deref(), frozen);
    install(world, entity, active);
    // It may show another part of its pictures, or they have changed.
    world.resource_mut::<Queues>().changed.push(entity);
    begin_to_show(world, entity, playback);
}

/// Puts baked cracks on a surface that has cracked before and is taken out of the others.
fn replace(world: &mut World, entity: Entity, kind: Baked, mut active: Box<Active>, mut finished: Finished) {
    let seconds = seconds(world, entity, kind);
    async_playback::stop(world, entity, &mut active);
    next_picture::give_up(world, entity);
    // Shards are of the cells that were.
    drop_shards(world, entity, &mut active);
    let textures = active.canvas.textures.clone();
    textures.fill(world, &mut finished.pictures);
    let Finished {
        order, added, record, growth, frozen, cells, field, touched, look, replay, playback, pictures, ..
    } = finished;
    // Steps that it has grown since are made up for.
    active.playhead.due += f64::from(active.cracks.growth.steps_made().saturating_sub(order.seen.steps));
    let before = (
        core::mem::replace(&mut active.cracks.growth, Shared::new(growth)),
        core::mem::replace(&mut active.cracks.cells, cells),
        core::mem::replace(&mut active.drawing.field, field),
        core::mem::replace(&mut active.drawing.touched, touched),
        core::mem::replace(&mut active.canvas.look, look),
        core::mem::replace(&mut active.cracks.added, added),
        pictures,
    );
    active.drawing.is_stale = false;
    let is_untouched = order.past.is_empty();
    let shown_before = active.show_made(replay, seconds.filter(|_| is_untouched));
    active.resume(record.as_deref(), frozen);
    active.cracks.cells_reported = 1;
    active.fell_at = (0, 1);
    active.cracks.tips_from = 0;
    active.mark_all();
    // All that is shown is painted, as without an analogy.
    if active.canvas.analogy.is_none()
        && let Some(view) = active.canvas.views.get_mut(active.canvas.view)
    {
        view.dirty.clear();
    }
    cracked::put_back(world, entity, active);
    begin_to_show(world, entity, playback);
    drop_in_background((before, shown_before));
}

fn begin_to_show(world: &mut World, entity: Entity, playback: Option<AsyncPlayback>) {
    async_playback::start(world, entity, playback);
    with_queues(world, entity, |queues, turn| {
        queues.start_growing(entity, turn);
        queues.mark_dirty(entity, turn);
    });
    set_status(world, entity, CrackStatus::Growing);
}
