//! Bakes: from guides to cracks on a surface, on tasks or in slices of frames. A frame only hands over what is ready.

use super::begin::begin;
use super::commit::{commit, start_finish};
use super::work::{Bake, BakeJob, Baked, Bakes, StepResult, Work, forget_layout};
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{BakeProgress, CrackBaked, CrackBudget, CrackError, CrackFailed, CrackRecord};
use crate::plugin::jobs::background::guarded;
use crate::plugin::jobs::copy::{self, CopyProgress};
use crate::plugin::jobs::deferred::hold;
use crate::plugin::jobs::frame_time::FrameClock;
use crate::plugin::jobs::stepped::{Outcome, RunningTask, Step, Stepped};
use crate::plugin::jobs::threads::Threads;
use crate::plugin::surface::queue::with_queue;
use bevy::{ecs::entity::EntityHashSet, prelude::*};

/// Share of the frame's budget after which no further slice is made.
const SHARE: f32 = 0.9;

/// Works on all bakes: starts those that can start, asks those on tasks, and makes slices of those that have none.
pub(crate) fn bake_guided(world: &mut World) {
    for (entity, kind, result) in hold(world, work_on_bakes) {
        end(world, entity, kind, result);
    }
}

/// Returns those that have ended.
fn work_on_bakes(world: &mut World) -> Vec<(Entity, Baked, Result<Option<f32>, CrackError>)> {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    let mut bakes = world.resource_mut::<Bakes>();
    bakes.cancelled = Some(EntityHashSet::default());
    let mut list = core::mem::take(&mut bakes.list);
    let pool = world.resource::<Threads>().pool();
    let mut room = pool.map_or(1, |pool| pool.thread_num().max(1));
    room = room.saturating_sub(list.iter().filter(|(_, bake)| bake.work.is_running()).count());
    let mut left = copy::MAX_BYTES;
    let mut ended = Vec::new();
    let is_cancelled = |world: &World, entity| {
        let cancelled = &world.resource::<Bakes>().cancelled;
        cancelled.as_ref().is_some_and(|cancelled| cancelled.contains(&entity))
    };
    list.retain_mut(|(entity, bake)| {
        if is_cancelled(world, *entity) {
            return false;
        }
        let result = loop {
            match core::mem::replace(&mut bake.work, Work::Wanted) {
                Work::Wanted => match begin(world, *entity, bake) {
                    Ok(Some(work)) => bake.work = work,
                    Ok(None) => {
                        report(world, *entity, 0.0);
                        return true;
                    }
                    Err(error) => break Err(error),
                },
                Work::Reading(mut reading, mut job) => {
                    report(world, *entity, 0.0);
                    let Some(images) = world.get_resource::<Assets<Image>>() else { break Err(CrackError::NoImages) };
                    match reading.step(images, &mut left) {
                        CopyProgress::More => {
                            bake.work = Work::Reading(reading, job);
                            return true;
                        }
                        // From the start.
                        CopyProgress::Changed => return true,
                        CopyProgress::Done => {
                            job.copies = reading.finish();
                            bake.work = Work::Ready(BakeJob::Map(job));
                        }
                    }
                }
                Work::Ready(job) => {
                    report(world, *entity, job.progress());
                    if room == 0 {
                        bake.work = Work::Ready(job);
                        return true;
                    }
                    room -= 1;
                    bake.work = match pool {
                        Some(pool) => Work::Task(RunningTask::start(pool, job)),
                        None => Work::Slices(job),
                    };
                }
                Work::Task(mut run) => match run.poll() {
                    None => {
                        report(world, *entity, run.progress());
                        bake.work = Work::Task(run);
                        return true;
                    }
                    Some(Outcome::NoThread(job)) => {
                        world.resource_mut::<Threads>().are_missing = true;
                        bake.work = Work::Slices(job);
                    }
                    Some(Outcome::Ended(result)) => match result.and_then(|made| go_on(world, *entity, bake, made)) {
                        Ok(()) => room += 1,
                        Err(error) => break Err(error),
                    },
                },
                Work::Slices(job) => {
                    match guarded(|| job.step()) {
                        Ok(Step::More(job)) => {
                            report(world, *entity, job.progress());
                            bake.work = Work::Slices(job);
                        }
                        Ok(Step::Done(made)) => match go_on(world, *entity, bake, made) {
                            Ok(()) => room += 1,
                            Err(error) => break Err(error),
                        },
                        Err(error) => break Err(error),
                    }
                    if timer.is_over() {
                        return true;
                    }
                }
                Work::Uploading(finished, frames) => match commit(world, *entity, bake, finished, frames) {
                    Ok(Some(covered)) => break Ok(covered),
                    // It waits for the renderer, or has to be made again.
                    Ok(None) => {
                        if !matches!(bake.work, Work::Ready(_)) {
                            return true;
                        }
                    }
                    Err(error) => break Err(error),
                },
            }
        };
        ended.push((*entity, bake.kind, result));
        false
    });
    // What was begun or cancelled meanwhile has the last word.
    let mut bakes = world.resource_mut::<Bakes>();
    let newer = core::mem::take(&mut bakes.list);
    let cancelled = bakes.cancelled.take().unwrap_or_default();
    list.retain(|(entity, _)| !cancelled.contains(entity) && newer.iter().all(|(other, _)| other != entity));
    list.extend(newer);
    bakes.list = list;
    ended.retain(|(entity, ..)| !cancelled.contains(entity));
    world.resource_mut::<FrameClock>().stop(&timer);
    ended
}

fn report(world: &mut World, entity: Entity, progress: f32) {
    if let Some(mut told) = world.get_mut::<BakeProgress>(entity) {
        told.set_if_neq(BakeProgress(progress));
    }
}

/// Tells of the end of a bake.
fn end(world: &mut World, entity: Entity, kind: Baked, result: Result<Option<f32>, CrackError>) {
    if result.is_ok() {
        report(world, entity, 1.0);
    }
    if kind == Baked::Record
        && let Ok(mut entity) = world.get_entity_mut(entity)
    {
        // It has been taken up, or is of no use.
        entity.remove::<CrackRecord>();
    }
    match result {
        Ok(covered) => {
            world.trigger(CrackBaked { entity, covered });
        }
        Err(error) => {
            forget_layout(world, entity);
            warn!("the baked cracks of {} are not made: {error}", EntityLabel::of(world, entity));
            with_queue(world, |_, queue, stats| queue.purge(entity, stats));
            world.trigger(CrackFailed { entity, error });
        }
    }
}

/// The next part of a bake, from what has been made: work that is ready, or again from the start.
fn go_on(world: &mut World, entity: Entity, bake: &mut Bake, made: StepResult) -> Result<(), CrackError> {
    match made {
        StepResult::Lines(lines) => start_finish(world, entity, bake, lines),
        StepResult::Surface(finished) => {
            bake.work = Work::Uploading(finished, 0);
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(feature = "2d")]
    use crate::{
        Grid,
        plugin::{
            headless::{app, blank, shown},
            surface::cracked::Cracked,
        },
    };

    #[test]
    fn e11_a_panic_is_an_error() {
        let outcome = guarded(|| -> Result<(), CrackError> { panic!("no {}", "luck") });
        assert_eq!(outcome, Err(CrackError::Bake { reason: "it panicked: no luck".into() }));
        assert_eq!(guarded(|| Ok(7)), Ok(7));
    }

    /// Whatever is healed, closed or despawned in the frames is not remembered.
    #[cfg(feature = "2d")]
    #[test]
    fn s3_nothing_is_kept_of_what_was_cancelled() {
        use crate::plugin::prelude::*;
        let mut app = app(CrackBudget::default());
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(16)));
        for _ in 0..20 {
            let surface = || (Sprite::from_image(image.clone()), CrackSurface::default());
            let all: Vec<Entity> = (0..100).map(|_| app.world_mut().spawn(surface()).id()).collect();
            for (i, entity) in all.iter().enumerate() {
                let mut commands = app.world_mut().commands();
                match i % 3 {
                    0 => _ = commands.entity(*entity).heal_cracks(),
                    1 => _ = commands.entity(*entity).close_cracks(1.0),
                    _ => _ = commands.entity(*entity).remove::<CrackSurface>(),
                }
            }
            app.update();
            all.into_iter().for_each(|entity| _ = app.world_mut().despawn(entity));
            let bakes = app.world().resource::<Bakes>();
            assert!(bakes.list.is_empty() && bakes.cancelled.is_none());
        }
    }

    /// Frames until the bake has ended, and the progress after each.
    #[cfg(feature = "2d")]
    fn frames(no_threads: bool) -> (Vec<f32>, Vec<u8>) {
        use crate::plugin::prelude::*;
        let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
        app.world_mut().resource_mut::<Threads>().are_missing = no_threads;
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(300, 200)));
        let guide = CrackGuide::new(Grid::new(UVec2::new(3, 1), 0.5));
        let guided = GuidedCracks { max_side: 4096, ..GuidedCracks::new(guide) };
        let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), guided)).id();
        let mut told = Vec::new();
        while told.last() != Some(&1.0) {
            app.update();
            told.extend(app.world().get::<BakeProgress>(entity).map(|progress| progress.0));
            assert!(told.len() < 1_000_000, "it never ends");
        }
        while app.world().get::<CrackState>(entity).is_some_and(|state| state.status != CrackStatus::Done) {
            app.update();
        }
        (told, shown(&app, entity))
    }

    /// M9: where tasks run in place, a bake goes on in slices of frames, and makes the same cracks.
    #[cfg(feature = "2d")]
    #[test]
    fn e12_slices_make_what_tasks_make() {
        let (slices, cracked) = frames(true);
        assert!(slices.len() > 8 && slices.is_sorted(), "{slices:?}");
        let (task, same) = frames(false);
        assert!(task.is_sorted());
        assert!(cracked.iter().any(|&value| value < 100), "cracks show");
        assert!(cracked == same, "the same cracks");
    }

    /// What a frame applies is ready: all of it is stamped and painted when its end is reported.
    #[cfg(feature = "2d")]
    #[test]
    fn no_frame_stamps_or_paints_what_was_baked() {
        use crate::plugin::prelude::*;

        /// Segments to stamp, whether texels are dirty, and the picture, when the bake ends.
        #[derive(Resource, Default)]
        struct Seen(Vec<(usize, bool, Vec<u8>)>);

        let mut app = app(CrackBudget { milliseconds: 0.0, ..default() });
        app.init_resource::<Seen>().add_observer(
            |baked: On<CrackBaked>,
             mut surfaces: Query<&mut Cracked>,
             images: Res<Assets<Image>>,
             sprites: Query<&Sprite>,
             mut seen: ResMut<Seen>| {
                let Ok(mut cracked) = surfaces.get_mut(baked.entity) else { return };
                let Some(active) = cracked.get_mut() else { return };
                let mut changed = Vec::new();
                active.cracks.growth.take_changed(&mut changed);
                let is_dirty = active.canvas.views.iter().any(|view| !view.dirty.is_empty());
                let image = sprites.get(baked.entity).ok().and_then(|sprite| images.get(&sprite.image));
                let texels = image.and_then(|image| image.data.clone()).unwrap_or_default();
                seen.0.push((changed.len(), is_dirty, texels));
            },
        );
        let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(300, 200)));
        let guided = GuidedCracks::new(CrackGuide::new(Grid::new(UVec2::new(3, 1), 0.5)));
        let entity = app.world_mut().spawn((Sprite::from_image(image), CrackSurface::default(), guided)).id();
        // A new surface, and one that has cracked.
        for seed in 0..2 {
            if let Some(mut guided) = app.world_mut().get_mut::<GuidedCracks>(entity) {
                guided.seed = seed;
            }
            while app.world().resource::<Seen>().0.len() <= seed as usize {
                app.update();
            }
            while app.world().get::<CrackState>(entity).is_some_and(|state| state.status != CrackStatus::Done) {
                app.update();
            }
            let shown = shown(&app, entity);
            let (to_stamp, is_dirty, texels) = &app.world().resource::<Seen>().0[seed as usize];
            assert_eq!((*to_stamp, *is_dirty), (0, false), "bake {seed}");
            assert!(
                *texels == shown && shown.iter().any(|&value| value < 100),
                "bake {seed}: all of it is there at once"
            );
        }
    }
}
