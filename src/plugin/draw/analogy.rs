//! Cracks that are shown as those of photographs.

use super::async_playback::AsyncPlayback;
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{
    AnalogyExamples, AnalogyFailed, AnalogyMade, AnalogyProgress, CrackAnalogy, CrackBudget, CrackError, CrackSurface,
};
use crate::plugin::jobs::deferred::when_free;
use crate::plugin::jobs::frame_time::FrameClock;
use crate::plugin::jobs::threads::Threads;
use crate::plugin::source::analogy::resolve;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::analogy::{AnalogyNews, AnalogyTools, Attempt};
use crate::plugin::surface::cracked::{Cracked, active_mut, with_queues};
use crate::plugin::surface::prepare::Preparations;
use crate::plugin::surface::queues::Queues;
use bevy::{
    ecs::{entity_disabling::Disabled, query::Allow},
    prelude::*,
};
use std::sync::Arc;

/// A surface with an analogy is made ready before its first hit.
pub(crate) fn prepare_added(
    added: On<Insert, CrackAnalogy>,
    mut progress: Query<&mut AnalogyProgress>,
    mut commands: Commands,
) {
    let entity = added.entity;
    if let Ok(mut progress) = progress.get_mut(entity) {
        progress.set_if_neq(AnalogyProgress(0.0));
    }
    commands.queue(move |world: &mut World| {
        if let Some(mut preparations) = world.get_resource_mut::<Preparations>() {
            preparations.want(entity);
        }
    });
}

/// A surface without its analogy shows the look of its preset again.
pub(crate) fn drop_removed(
    removed: On<Remove, CrackAnalogy>,
    mut progress: Query<&mut AnalogyProgress>,
    mut commands: Commands,
) {
    let entity = removed.entity;
    if let Ok(mut progress) = progress.get_mut(entity) {
        progress.set_if_neq(AnalogyProgress(0.0));
    }
    commands.queue(move |world: &mut World| when_free(world, move |world| drop_analogy(world, entity)));
}

fn drop_analogy(world: &mut World, entity: Entity) {
    // It may have another by now.
    if !world.entities().contains(entity) || world.get::<CrackAnalogy>(entity).is_some() {
        return;
    }
    if active_mut(world, entity).is_some_and(Active::drop_analogy) {
        with_queues(world, entity, |queues, turn| queues.mark_dirty(entity, turn));
    }
}

/// Surfaces with an analogy that have been hit, or are ready for it.
type WithAnalogies<'w, 's> = Query<
    'w,
    's,
    (
        Entity,
        Option<&'static Name>,
        Ref<'static, CrackAnalogy>,
        &'static mut AnalogyProgress,
        &'static mut Cracked,
        &'static AsyncPlayback,
    ),
    (With<CrackSurface>, Allow<Disabled>),
>;

/// Goes on with the analogies of all surfaces, one at least, until the budget is spent. What is being painted has its turn later.
pub(crate) fn make_analogies(
    mut commands: Commands,
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    mut threads: ResMut<Threads>,
    mut queues: ResMut<Queues>,
    examples: Option<Res<Assets<AnalogyExamples>>>,
    server: Option<Res<AssetServer>>,
    mut surfaces: WithAnalogies,
    mut first: Local<usize>,
) {
    if surfaces.is_empty() {
        return;
    }
    let timer = clock.start(&budget, 1.0);
    let count = surfaces.iter().count();
    // In turns: who was first is the last in the next frame in which there is no time for all.
    let mut seen = 0;
    for (number, (entity, name, analogy, mut progress, mut cracked, playback)) in surfaces.iter_mut().enumerate() {
        if number < *first % count {
            continue;
        }
        seen += 1;
        let Some(active) = cracked.bypass_change_detection().get_mut() else { continue };
        if active.turn.is_dirty || active.turn.is_to_shatter {
            continue;
        }
        let known = examples.as_ref().and_then(|examples| examples.get(&analogy.examples));
        let address = known.map_or(0, |examples| Arc::as_ptr(&examples.0) as usize);
        let attempt = Attempt { changed: analogy.last_changed(), examples: address };
        if active.has_failed_analogy(attempt) {
            continue;
        }
        let mut tools = AnalogyTools { threads: &mut threads, timer: &timer };
        let news = match go_on(active, &analogy, examples.as_deref(), server.as_deref(), &mut tools) {
            Ok(news) => news,
            Err(error) => AnalogyNews::Failed(error),
        };
        match news {
            AnalogyNews::Nothing => {}
            AnalogyNews::Progress(share) => {
                progress.set_if_neq(AnalogyProgress(share));
            }
            AnalogyNews::Made => {
                progress.set_if_neq(AnalogyProgress(1.0));
                commands.trigger(AnalogyMade { entity });
            }
            AnalogyNews::Failed(error) => {
                active.fail_analogy(attempt);
                progress.set_if_neq(AnalogyProgress(0.0));
                warn!("the analogy of {} is not made: {error}", EntityLabel { entity, name });
                commands.trigger(AnalogyFailed { entity, error });
            }
        }
        let is_dirty = active.canvas.views.iter().any(|view| !view.dirty.is_empty());
        // Tasks that play baked cracks see for themselves what is to be painted.
        if is_dirty && !playback.is_on() {
            queues.mark_dirty(entity, &mut active.turn);
        }
        if timer.is_over() {
            break;
        }
    }
    *first = if *first % count + seen >= count { 0 } else { *first % count + seen };
    clock.stop(&timer);
}

fn go_on(
    active: &mut Active,
    analogy: &CrackAnalogy,
    examples: Option<&Assets<AnalogyExamples>>,
    server: Option<&AssetServer>,
    tools: &mut AnalogyTools,
) -> Result<AnalogyNews, CrackError> {
    let Some(examples) = resolve(examples, server, &analogy.examples)? else { return Ok(AnalogyNews::Nothing) };
    let wish = active.analogy_wish(analogy, examples)?;
    Ok(active.make_analogy(&wish, tools))
}

#[cfg(all(test, feature = "2d"))]
mod tests {
    use super::*;
    use crate::paint::analogy::{AnalogyPair, AnalogyParams};
    use crate::plugin::CrackTextures;
    use crate::plugin::headless::{app, blank, shown};

    /// E12: where tasks run in place, an analogy is made in slices of frames, and is the same.
    #[test]
    fn e12_slices_make_the_analogies_that_tasks_make() {
        let make = |are_missing: bool| {
            let mut app = app(CrackBudget::default());
            app.world_mut().resource_mut::<Threads>().are_missing = are_missing;
            let texel = |i: usize| if i % 40 < 3 { [30, 20, 10, 255] } else { [(i * i % 251) as u8, 90, 200, 255] };
            let photo: Vec<u8> = (0..1600).flat_map(texel).collect();
            let pair = AnalogyPair::from_darkness(UVec2::splat(40), &photo, 0.2).expect("it has a crack");
            let examples = AnalogyExamples::new(vec![pair], &AnalogyParams::DEFAULT).expect("they are valid");
            let examples = app.world_mut().resource_mut::<Assets<AnalogyExamples>>().add(examples);
            let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(150, 100)));
            let analogy = CrackAnalogy::new(examples).with_their_material();
            let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), analogy)).id();
            let mut frames = 0;
            while app.world().get::<CrackTextures>(entity).is_none() {
                app.update();
                frames += 1;
                assert!(frames < 100_000, "it is never prepared");
            }
            app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
            let mut told = Vec::new();
            while told.last() != Some(&1.0) {
                app.update();
                told.extend(app.world().get::<AnalogyProgress>(entity).map(|progress| progress.0));
                assert!(told.len() < 100_000, "it never ends");
            }
            for _ in 0..100 {
                app.update();
            }
            (told, shown(&app, entity))
        };
        let (slices, sliced) = make(true);
        assert!(slices.len() > 8 && slices.is_sorted(), "{slices:?}");
        let (task, made) = make(false);
        assert!(task.is_sorted());
        assert!(sliced == made && made.as_chunks::<4>().0.iter().all(|texel| texel[0] != 200 || texel[1] == 90));
    }
}
