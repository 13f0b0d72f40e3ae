//! The growth systems: time to steps.

use crate::plugin::api::CrackBudget;
use crate::plugin::jobs::frame_time::{FrameClock, par_for_each};
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::{CrackedSurfaces, batch};
use crate::plugin::surface::queues::Queues;
use bevy::{ecs::system::NonSendMarker, prelude::*};

/// Share of the frame's budget after which no further step is made.
const BUDGET_SHARE: f32 = 0.6;

/// Surfaces whose steps one thread makes, one after the other: fewer are not worth another thread.
const SHARE: usize = 16;

/// Length of a frame where there is no clock, seconds.
const DEFAULT_FRAME: f32 = 1.0 / 60.0;

/// The cracks of a surface have closed: it is to be healed.
#[derive(EntityEvent, Clone, Copy, Debug)]
pub(crate) struct CracksClosed {
    pub(crate) entity: Entity,
}

/// A surface in turn.
struct GrowJob<'a> {
    entity: Entity,
    active: &'a mut Active,
    /// Whether it has grown; `None` = its turn has not come.
    has_grown: Option<bool>,
    /// Whether an earlier frame has begun a step.
    was_in_step: bool,
}

/// Makes the steps that are due, some surfaces at once, one step each in turn, until none is due or the budget is spent. Those that wait to be
/// painted do not grow meanwhile.
pub(crate) fn grow_surfaces(
    _main_thread: NonSendMarker,
    mut commands: Commands,
    time: Option<Res<Time>>,
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    mut queues: ResMut<Queues>,
    mut surfaces: CrackedSurfaces,
) {
    if queues.growing.is_empty() && queues.held.is_empty() {
        return;
    }
    let timer = clock.start(&budget, BUDGET_SHARE);
    let seconds = time.map_or(DEFAULT_FRAME, |time| time.delta_secs());
    let Queues { growing, held, dirty, .. } = &mut *queues;
    let room = budget.max_growing.max(1).saturating_sub(growing.len()).min(held.len());
    growing.extend(held.drain(..room));
    for entity in growing.iter() {
        if let Ok((_, mut cracked)) = surfaces.get_mut(*entity)
            && let Some(active) = cracked.get_mut()
        {
            active.pass(seconds);
        }
    }
    let (mut left, mut idle) = (Vec::new(), Vec::new());
    while left.is_empty() && !growing.is_empty() {
        let mut jobs = batch(&mut surfaces, growing, |entity, active| {
            let was_in_step = active.cracks.growth.is_in_step();
            active.turn.is_growing.then_some(GrowJob { entity, active, has_grown: None, was_in_step })
        });
        par_for_each(jobs.chunks_mut(SHARE).enumerate(), |(i, jobs)| {
            for (k, job) in jobs.iter_mut().enumerate() {
                // Every frame makes one step, whatever waits.
                let is_first = (i, k) == (0, 0);
                if is_first || !timer.is_over() {
                    let is_free = !job.active.is_partly_painted() && (is_first || !job.active.turn.is_late);
                    job.has_grown = Some(is_free && job.active.step_if_due(|| timer.is_over()));
                }
            }
        });
        for GrowJob { entity, active, has_grown, was_in_step } in jobs {
            let Some(has_grown) = has_grown else {
                left.push(entity);
                continue;
            };
            // Whole steps are shown, and hits land, before the next one begins.
            let waits = active.turn.is_late || active.is_partly_painted() || (was_in_step && has_grown);
            if active.is_at_rest() {
                active.turn.is_growing = false;
                active.playhead.due = 0.0;
                if active.has_closed() {
                    commands.trigger(CracksClosed { entity });
                }
            } else if active.is_due() && !waits {
                growing.push_back(entity);
            } else {
                idle.push(entity);
            }
            let is_news = has_grown
                || (active.cracks.growth.is_in_step() && active.cracks.growth.has_changed())
                || active.is_behind()
                || (!active.turn.is_growing && active.turn.is_open);
            active.turn.has_news |= is_news;
            if is_news && !active.turn.is_dirty {
                active.turn.is_dirty = true;
                dirty.push_back(entity);
            }
        }
        if timer.is_over() {
            break;
        }
    }
    left.into_iter().rev().for_each(|entity| growing.push_front(entity));
    growing.extend(idle);
    clock.stop(&timer);
}
