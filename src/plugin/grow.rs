//! The growth systems: time to steps.

use super::{CrackBudget, CrackCommandsExt, budget::FrameClock, surfaces::Surfaces};
use bevy::prelude::*;

/// Share of the frame's budget after which no further step is made.
const SHARE: f32 = 0.7;

/// Length of a frame where there is no clock, seconds.
const DEFAULT_FRAME: f32 = 1.0 / 60.0;

/// Makes the steps that are due, one surface after the other, one step each, until none is due or the budget is spent.
pub(super) fn grow_surfaces(
    mut commands: Commands,
    time: Option<Res<Time>>,
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    mut surfaces: ResMut<Surfaces>,
) {
    if surfaces.growing.is_empty() && surfaces.held.is_empty() {
        return;
    }
    let timer = clock.start(&budget, SHARE);
    let seconds = time.map_or(DEFAULT_FRAME, |time| time.delta_secs());
    let Surfaces { active, growing, held, dirty, .. } = &mut *surfaces;
    let room = budget.max_growing.max(1).saturating_sub(growing.len()).min(held.len());
    growing.extend(held.drain(..room));
    for entity in growing.iter() {
        if let Some(active) = active.get_mut(entity) {
            active.pass(seconds);
        }
    }
    // Surfaces in a row that had nothing to do and are still in the list.
    let mut idle = 0;
    while idle < growing.len() {
        let Some(entity) = growing.pop_front() else { break };
        let Some(active) = active.get_mut(&entity).filter(|active| active.is_growing) else { continue };
        let has_grown = active.step_if_due();
        if has_grown {
            idle = 0;
        }
        if !active.is_at_rest() {
            idle += usize::from(!has_grown);
            growing.push_back(entity);
        } else {
            active.is_growing = false;
            active.due = 0.0;
            if active.has_closed() {
                commands.entity(entity).heal_cracks();
            }
        }
        let is_news = has_grown || active.is_behind() || (!active.is_growing && active.is_open);
        if is_news && !active.is_dirty {
            active.is_dirty = true;
            dirty.push_back(entity);
        }
        if timer.is_over() {
            break;
        }
    }
    clock.stop(&timer);
}
