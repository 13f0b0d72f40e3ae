//! Reliefs that are being made.

use super::show::show;
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{CrackBudget, CrackError, CrackRelief, ReliefFailed, ReliefMade, ReliefProgress};
use crate::plugin::jobs::background::guarded;
use crate::plugin::jobs::frame_time::FrameClock;
use crate::plugin::jobs::stepped::{Outcome, RunningTask, Step, Stepped};
use crate::plugin::jobs::threads::Threads;
use crate::relief::{Relief, ReliefJob};
use bevy::prelude::*;

/// Share of the frame's budget after which no further slice is made.
const SHARE: f32 = 0.9;

/// A relief that is being made; when this goes, the work stops within a step.
#[derive(Component)]
#[component(storage = "SparseSet", clone_behavior = Ignore)]
pub(crate) struct ReliefInProgress(Work);

enum Work {
    Wanted,
    Task(RunningTask<ReliefJob>),
    Slices(Box<ReliefJob>),
}

impl Stepped for ReliefJob {
    type Output = Box<Relief>;

    fn step(mut self) -> Result<Step<Self>, CrackError> {
        Ok(match Self::step(&mut self)? {
            Some(relief) => Step::Done(Box::new(relief)),
            None => Step::More(self),
        })
    }

    fn progress(&self) -> f32 {
        Self::progress(self)
    }
}

/// Begins reliefs that are new or have changed.
pub(crate) fn watch_reliefs(
    changed: Query<(Entity, &CrackRelief), Changed<CrackRelief>>,
    mut progress: Query<&mut ReliefProgress>,
    mut commands: Commands,
) {
    for (entity, _) in &changed {
        if let Ok(mut progress) = progress.get_mut(entity) {
            progress.set_if_neq(ReliefProgress(0.0));
        }
        commands.entity(entity).try_insert(ReliefInProgress(Work::Wanted));
    }
}

/// Cancels the relief of a component that goes.
pub(crate) fn cancel_removed(
    removed: On<Remove, CrackRelief>,
    in_progress: Query<(), With<ReliefInProgress>>,
    mut progress: Query<&mut ReliefProgress>,
    mut commands: Commands,
) {
    if !in_progress.contains(removed.entity) {
        return;
    }
    if let Ok(mut progress) = progress.get_mut(removed.entity) {
        progress.set_if_neq(ReliefProgress(0.0));
    }
    if let Ok(mut entity) = commands.get_entity(removed.entity) {
        entity.try_remove::<ReliefInProgress>();
    }
}

/// Whether any relief is being made.
pub(crate) fn any_reliefs(in_progress: Query<(), With<ReliefInProgress>>) -> bool {
    !in_progress.is_empty()
}

/// Works on all reliefs: starts tasks, asks those that run, and makes slices where there are no threads.
pub(crate) fn make_reliefs(world: &mut World, mut found: Local<Vec<Entity>>) {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    let mut query = world.query_filtered::<Entity, With<ReliefInProgress>>();
    found.clear();
    found.extend(query.iter(world));
    found.sort_unstable();
    let pool = world.resource::<Threads>().pool();
    let running = |world: &World, entity: &Entity| {
        matches!(world.get::<ReliefInProgress>(*entity), Some(ReliefInProgress(Work::Task(_))))
    };
    let busy = found.iter().filter(|entity| running(world, entity)).count();
    let mut room = pool.map_or(1, |pool| pool.thread_num().max(1)).saturating_sub(busy);
    for &entity in found.iter() {
        let Some(mut making) = world.get_mut::<ReliefInProgress>(entity) else { continue };
        let work = core::mem::replace(&mut making.0, Work::Wanted);
        let (work, progress) = match work {
            Work::Wanted if room == 0 => (Ok(Err(Work::Wanted)), 0.0),
            Work::Wanted => {
                room -= 1;
                (begin(world, entity).map(Err), 0.0)
            }
            Work::Task(mut task) => match task.poll() {
                None => {
                    let progress = task.progress();
                    (Ok(Err(Work::Task(task))), progress)
                }
                Some(Outcome::NoThread(job)) => {
                    world.resource_mut::<Threads>().are_missing = true;
                    (Ok(Err(Work::Slices(Box::new(job)))), 0.0)
                }
                Some(Outcome::Ended(result)) => (result.map(Ok), 1.0),
            },
            Work::Slices(mut job) => loop {
                let progress = Stepped::progress(&*job);
                match guarded(|| Stepped::step(*job)) {
                    Ok(Step::More(more)) if timer.is_over() => break (Ok(Err(Work::Slices(Box::new(more)))), progress),
                    Ok(Step::More(more)) => job = Box::new(more),
                    Ok(Step::Done(relief)) => break (Ok(Ok(relief)), 1.0),
                    Err(error) => break (Err(error), 0.0),
                }
            },
        };
        match work {
            Ok(Err(work)) => {
                if let Some(mut making) = world.get_mut::<ReliefInProgress>(entity) {
                    making.0 = work;
                }
                report(world, entity, progress);
            }
            Ok(Ok(relief)) => {
                let shown = show(world, entity, *relief);
                end(world, entity, shown);
            }
            Err(error) => end(world, entity, Err(error)),
        }
    }
    world.resource_mut::<FrameClock>().stop(&timer);
}

fn begin(world: &mut World, entity: Entity) -> Result<Work, CrackError> {
    let relief = world.get::<CrackRelief>(entity).ok_or(CrackError::NothingToCrack)?;
    relief.validate()?;
    let job = ReliefJob::new(relief.settings.clone(), relief.size, relief.seed)?;
    Ok(match world.resource::<Threads>().pool() {
        Some(pool) => Work::Task(RunningTask::start(pool, job)),
        None => Work::Slices(Box::new(job)),
    })
}

fn report(world: &mut World, entity: Entity, share: f32) {
    if let Some(mut progress) = world.get_mut::<ReliefProgress>(entity)
        && share > progress.0
    {
        progress.0 = share;
    }
}

fn end(world: &mut World, entity: Entity, result: Result<(), CrackError>) {
    let Ok(mut of) = world.get_entity_mut(entity) else { return };
    of.remove::<ReliefInProgress>();
    match result {
        Ok(()) => {
            report(world, entity, 1.0);
            world.trigger(ReliefMade { entity });
        }
        Err(error) => {
            if let Some(mut progress) = world.get_mut::<ReliefProgress>(entity) {
                progress.set_if_neq(ReliefProgress(0.0));
            }
            warn!("the relief of {} is not made: {error}", EntityLabel::of(world, entity));
            world.trigger(ReliefFailed { entity, error });
        }
    }
}
