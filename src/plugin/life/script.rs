//! Hits at given times.

use super::commands::CrackCommandsExt;
use crate::plugin::api::{CrackHit, CrackScript, ShatterRequest};
use bevy::prelude::*;
use core::ops::Range;

/// Lets the time of all scripts pass, and does what is due.
pub(crate) fn play_scripts(
    time: Option<Res<Time>>,
    mut scripts: Query<(Entity, &mut CrackScript)>,
    mut hits: MessageWriter<CrackHit>,
    mut commands: Commands,
) {
    let Some(time) = time else { return };
    for (entity, mut script) in &mut scripts {
        // Also a time that is not a number.
        if script.time.is_nan() || script.time > script.end() {
            continue;
        }
        let due = script.time..script.time + time.delta_secs();
        script.time = due.end;
        let hit = |hit: &crate::plugin::api::ScriptedHit| {
            CrackHit::uv(entity, hit.uv).with_energy(hit.energy).with_direction(hit.direction)
        };
        hits.write_batch(script.hits.iter().filter(|hit| is_in(&due, hit.at)).map(hit));
        if script.shatter_at.is_some_and(|at| is_in(&due, at)) {
            commands.entity(entity).shatter_cracks(ShatterRequest::ALL);
        }
        if script.repeat_after.is_some_and(|at| at > 0.0 && is_in(&due, at)) {
            commands.entity(entity).heal_cracks();
            script.time = 0.0;
        }
    }
}

fn is_in(due: &Range<f32>, at: f32) -> bool {
    due.contains(&at)
}
