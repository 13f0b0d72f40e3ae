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
        // What happened just before the surface is healed would come after it.
        if script.repeat_after.is_some_and(|at| at > 0.0 && is_in(&due, at)) {
            commands.entity(entity).heal_cracks();
            script.time = 0.0;
            continue;
        }
        let hit = |hit: &crate::plugin::api::ScriptedHit| {
            CrackHit::uv(entity, hit.uv).with_energy(hit.energy).with_direction(hit.direction)
        };
        hits.write_batch(script.hits.iter().filter(|hit| is_in(&due, hit.at)).map(hit));
        if script.shatter_at.is_some_and(|at| is_in(&due, at)) {
            commands.entity(entity).shatter_cracks(ShatterRequest::ALL);
        }
    }
}

fn is_in(due: &Range<f32>, at: f32) -> bool {
    due.contains(&at)
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::plugin::{
        headless::{app, blank},
        prelude::*,
    };
    use bevy::time::TimeUpdateStrategy;
    use core::time::Duration;

    /// A round begins without cracks, also if there is a hit in the frame in which the one before ends.
    #[test]
    fn a_round_begins_whole() {
        for frame in [20, 90, 260] {
            let mut app = app(CrackBudget { milliseconds: f32::INFINITY, ..default() });
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(frame)));
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(64)));
            let hits = vec![ScriptedHit { at: 0.3, ..default() }, ScriptedHit { at: 0.5, ..default() }];
            let script = CrackScript { hits, repeat_after: Some(0.5), ..default() };
            let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), script)).id();
            let (mut begun, mut cracked) = (0, 0);
            for _ in 0..100 {
                app.update();
                let world = app.world();
                let time = world.get::<CrackScript>(entity).map_or(f32::NAN, |script| script.time);
                let nodes = world.get::<CrackState>(entity).map_or(0, |state| state.nodes);
                begun += u32::from(time == 0.0);
                cracked += u32::from(nodes > 0);
                assert!(time >= 0.3 || nodes == 0, "frames of {frame} ms: {nodes} nodes after {time} s");
            }
            assert!(begun > 3 && cracked > 3, "frames of {frame} ms: {begun} rounds, {cracked} frames with cracks");
        }
    }
}
