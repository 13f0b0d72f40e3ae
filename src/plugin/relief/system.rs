//! Reliefs that are being made.

use super::show::show;
use super::work::{Made, Rectangle, ReliefWork};
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{CrackBudget, CrackError, CrackRelief, ReliefFailed, ReliefMade, ReliefProgress};
use crate::plugin::carrier::{kind::Found, kinds};
use crate::plugin::jobs::frame_time::FrameClock;
use crate::plugin::jobs::stepped::{News, Running};
use crate::plugin::jobs::threads::Threads;
use bevy::prelude::*;

/// Share of the frame's budget after which no further slice is made.
const SHARE: f32 = 0.9;

/// A relief that is being made; when this goes, the work stops within a step.
#[derive(Component)]
#[component(storage = "SparseSet", clone_behavior = Ignore)]
pub(crate) struct ReliefInProgress(Work);

enum Work {
    /// It has not begun: there is no room for it, or its mesh or material is not there yet.
    Wanted,
    Running(Running<ReliefWork>),
}

/// What comes of working on a relief in a frame.
enum Outcome {
    /// It goes on; this much is done.
    Going(Work, f32),
    Made(Box<Made>),
    Failed(CrackError),
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
        matches!(world.get::<ReliefInProgress>(*entity), Some(ReliefInProgress(Work::Running(Running::Task(_)))))
    };
    let busy = found.iter().filter(|entity| running(world, entity)).count();
    let mut room = pool.map_or(1, |pool| pool.thread_num().max(1)).saturating_sub(busy);
    for &entity in found.iter() {
        let Some(mut making) = world.get_mut::<ReliefInProgress>(entity) else { continue };
        let outcome = match core::mem::replace(&mut making.0, Work::Wanted) {
            Work::Wanted if room == 0 => Outcome::Going(Work::Wanted, 0.0),
            Work::Wanted => match begin(world, entity) {
                Ok(work) => {
                    room -= usize::from(!matches!(work, Work::Wanted));
                    Outcome::Going(work, 0.0)
                }
                Err(error) => Outcome::Failed(error),
            },
            Work::Running(running) => match running.look(&mut world.resource_mut::<Threads>(), &timer) {
                News::Going(running, progress) => Outcome::Going(Work::Running(running), progress),
                News::Ended(Ok(made)) => Outcome::Made(made),
                News::Ended(Err(error)) => Outcome::Failed(error),
            },
        };
        match outcome {
            Outcome::Going(work, progress) => {
                if let Some(mut making) = world.get_mut::<ReliefInProgress>(entity) {
                    making.0 = work;
                }
                report(world, entity, progress);
            }
            Outcome::Made(made) => {
                let shown = show(world, entity, *made);
                end(world, entity, shown);
            }
            Outcome::Failed(error) => end(world, entity, Err(error)),
        }
    }
    world.resource_mut::<FrameClock>().stop(&timer);
}

/// Begins a relief, unless its mesh or material is not there yet.
fn begin(world: &mut World, entity: Entity) -> Result<Work, CrackError> {
    let wish = world.get::<CrackRelief>(entity).ok_or(CrackError::NothingToCrack)?;
    wish.validate()?;
    match kinds::inspect(world, entity).1 {
        Found::Waiting => return Ok(Work::Wanted),
        // What cannot crack may have a relief: one that is not loaded, or shown in a way of its own.
        Found::Unusable(error) if matches!(error, CrackError::NothingToCrack | CrackError::Tilemap) => {
            return Err(error);
        }
        Found::Unusable(_) | Found::Shown(_) | Found::Other => {}
    }
    let work = ReliefWork::new(wish, (wish.displacement > 0.0).then(|| rectangle(world, entity)).flatten())?;
    Ok(Work::Running(Running::start(world.resource::<Threads>(), work)))
}

/// The rectangle of a 3D mesh.
#[cfg(feature = "3d")]
fn rectangle(world: &World, entity: Entity) -> Option<Rectangle> {
    use bevy::camera::primitives::MeshAabb;
    let mesh = &world.get::<Mesh3d>(entity)?.0;
    let bounds = world.get_resource::<Assets<Mesh>>()?.get(mesh)?.compute_aabb()?;
    let half = Vec3::from(bounds.half_extents);
    let is_ground = half.y < half.z;
    let size = 2.0 * if is_ground { Vec2::new(half.x, half.z) } else { half.truncate() };
    Some(Rectangle { center: Vec3::from(bounds.center), size, is_ground })
}

#[cfg(not(feature = "3d"))]
fn rectangle(_: &World, _: Entity) -> Option<Rectangle> {
    None
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
