//! Bakes: from guides to cracks on a surface, on tasks or in slices of frames. A frame only hands over what is ready.

mod begin;
mod finish;
mod job;
mod land;

use super::{
    BakeProgress, CrackBaked, CrackBudget, CrackError, CrackFailed,
    budget::FrameClock,
    error::Called,
    later::hold,
    plan::Plan,
    read::{self, Read, Reading},
};
use begin::begin;
use bevy::{
    ecs::entity::EntityHashSet,
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};
use finish::{Finish, Finished, Next};
use job::{Lines, MAPPED, MapJob};
use land::{land, order};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
    thread::{self, ThreadId},
};

/// Share of the frame's budget after which no further slice is made.
const SHARE: f32 = 0.9;

/// The bakes that go on, in order.
#[derive(Resource, Default)]
pub(super) struct Bakes {
    list: Vec<(Entity, Bake)>,
    /// While the list is worked on: the bakes that were cancelled meanwhile.
    cancelled: Option<EntityHashSet>,
    /// Whether tasks turned out to run in place.
    pub(super) no_threads: bool,
}

/// A bake that goes on.
struct Bake {
    work: Work,
    /// The surface, if it has not cracked when the bake began.
    plan: Option<Box<Plan>>,
    /// How often its surface has changed too late.
    rounds: u32,
}

enum Work {
    /// Its pictures may not be there yet.
    Wanted,
    /// Pictures are copied.
    Reading(Reading, Box<MapJob>),
    /// Others come first.
    Ready(Job),
    Task(Run),
    Slices(Job),
    /// Textures are on their way to the renderer, for so many frames.
    Landing(Box<Finished>, u32),
}

impl Work {
    const fn is_running(&self) -> bool {
        matches!(self, Self::Task(_) | Self::Slices(_))
    }
}

impl Bakes {
    /// Begins a bake anew.
    pub(super) fn want(&mut self, entity: Entity) {
        self.cancel(entity);
        if let Some(cancelled) = &mut self.cancelled {
            cancelled.remove(&entity);
        }
        self.list.push((entity, Bake { work: Work::Wanted, plan: None, rounds: 0 }));
    }

    /// Ends a bake without a word.
    pub(super) fn cancel(&mut self, entity: Entity) {
        self.list.retain(|(baked, _)| *baked != entity);
        if let Some(cancelled) = &mut self.cancelled {
            cancelled.insert(entity);
        }
    }

    /// What was read of the picture before this frame is another one now.
    pub(super) fn forget_picture(&mut self, picture: AssetId<Image>, frame: u64) {
        for (_, Bake { work, plan, .. }) in &mut self.list {
            let is_past = plan.as_mut().is_none_or(|plan| plan.forget_picture(picture, frame));
            if let Work::Reading(reading, _) = work
                && is_past
            {
                reading.forget(picture);
            }
        }
    }

    /// What tasks run on that do not stop the frames.
    pub(super) fn pool(&self) -> Option<&'static AsyncComputeTaskPool> {
        AsyncComputeTaskPool::try_get().filter(|_| !self.no_threads)
    }
}

/// Whether any bake goes on.
pub(super) fn any_baking(bakes: Res<Bakes>) -> bool {
    !bakes.list.is_empty()
}

/// No bake any more.
pub(super) fn reset(progress: &mut Mut<BakeProgress>) {
    progress.set_if_neq(BakeProgress(0.0));
}

/// Ends the bake of a surface that is healed.
pub(super) fn cancel(world: &mut World, entity: Entity) {
    if let Some(mut bakes) = world.get_resource_mut::<Bakes>() {
        bakes.cancel(entity);
    }
    if let Some(mut progress) = world.get_mut::<BakeProgress>(entity) {
        reset(&mut progress);
    }
}

/// A task at work, which stops within a slice when this is dropped.
struct Run {
    task: Task<Outcome>,
    line: Arc<Line>,
}

/// What a task and its surface tell one another.
struct Line {
    cancelled: AtomicBool,
    /// The bits of the progress.
    progress: AtomicU32,
}

impl Drop for Run {
    fn drop(&mut self) {
        self.line.cancelled.store(true, Ordering::Relaxed);
    }
}

/// What comes back from a task.
enum Outcome {
    /// It runs where it was started, which would stand still meanwhile.
    NoThread(Job),
    Ended(Result<Made, CrackError>),
}

impl Run {
    fn start(pool: &AsyncComputeTaskPool, job: Job) -> Self {
        let progress = AtomicU32::new(job.progress().to_bits());
        let line = Arc::new(Line { cancelled: AtomicBool::new(false), progress });
        let (lined, home) = (line.clone(), thread::current().id());
        Self { task: pool.spawn(async move { work(job, &lined, home) }), line }
    }
}

/// The work of a task.
fn work(mut job: Job, line: &Line, home: ThreadId) -> Outcome {
    if thread::current().id() == home {
        return Outcome::NoThread(job);
    }
    loop {
        if line.cancelled.load(Ordering::Relaxed) {
            return Outcome::Ended(Err(CrackError::Bake { reason: "cancelled".into() }));
        }
        line.progress.store(job.progress().to_bits(), Ordering::Relaxed);
        job = match guarded(|| job.step()) {
            Ok(Step::More(job)) => job,
            Ok(Step::Made(made)) => return Outcome::Ended(Ok(made)),
            Err(error) => return Outcome::Ended(Err(error)),
        };
    }
}

/// A panic becomes an error: in a task it would end the app.
pub(super) fn guarded<T>(run: impl FnOnce() -> Result<T, CrackError>) -> Result<T, CrackError> {
    guarded_as(|reason| CrackError::Bake { reason }, run)
}

/// The same, of another kind.
pub(super) fn guarded_as<T>(
    error: impl FnOnce(String) -> CrackError,
    run: impl FnOnce() -> Result<T, CrackError>,
) -> Result<T, CrackError> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().copied().or(panic.downcast_ref::<String>().map(String::as_str));
        Err(error(format!("it panicked: {}", text.unwrap_or("unknown"))))
    })
}

/// The two parts of a bake, machines that are stepped: between them it is seen what has become of the surface.
enum Job {
    Map(Box<MapJob>),
    Finish(Box<Finish>),
}

enum Made {
    Lines(Lines),
    Surface(Box<Finished>),
}

enum Step {
    More(Job),
    Made(Made),
}

impl Job {
    /// A slice of the work.
    fn step(self) -> Result<Step, CrackError> {
        Ok(match self {
            Self::Map(mut map) => match map.step()? {
                Some(lines) => Step::Made(Made::Lines(lines)),
                None => Step::More(Self::Map(map)),
            },
            Self::Finish(finish) => match finish.step()? {
                Next::More(finish) => Step::More(Self::Finish(finish)),
                Next::Done(finished) => Step::Made(Made::Surface(finished)),
            },
        })
    }

    fn progress(&self) -> f32 {
        match self {
            Self::Map(map) => map.progress,
            Self::Finish(_) => MAPPED,
        }
    }
}

/// Works on all bakes: starts those that can start, asks those on tasks, and makes slices of those that have none.
pub(super) fn bake_guided(world: &mut World) {
    for (entity, result) in hold(world, work_on_bakes) {
        end(world, entity, result);
    }
}

/// Returns those that have ended.
fn work_on_bakes(world: &mut World) -> Vec<(Entity, Result<Option<f32>, CrackError>)> {
    let timer = world.resource::<FrameClock>().start(world.resource::<CrackBudget>(), SHARE);
    let mut bakes = world.resource_mut::<Bakes>();
    bakes.cancelled = Some(EntityHashSet::default());
    let mut list = core::mem::take(&mut bakes.list);
    let pool = bakes.pool();
    let mut room = pool.map_or(1, |pool| pool.thread_num().max(1));
    room = room.saturating_sub(list.iter().filter(|(_, bake)| bake.work.is_running()).count());
    let mut left = read::MAX_BYTES;
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
                        tell(world, *entity, 0.0);
                        return true;
                    }
                    Err(error) => break Err(error),
                },
                Work::Reading(mut reading, mut job) => {
                    tell(world, *entity, 0.0);
                    let Some(images) = world.get_resource::<Assets<Image>>() else { break Err(CrackError::NoImages) };
                    match reading.step(images, &mut left) {
                        Read::More => {
                            bake.work = Work::Reading(reading, job);
                            return true;
                        }
                        // From the start.
                        Read::Changed => return true,
                        Read::Done => {
                            job.copies = reading.finish();
                            bake.work = Work::Ready(Job::Map(job));
                        }
                    }
                }
                Work::Ready(job) => {
                    tell(world, *entity, job.progress());
                    if room == 0 {
                        bake.work = Work::Ready(job);
                        return true;
                    }
                    room -= 1;
                    bake.work = match pool {
                        Some(pool) => Work::Task(Run::start(pool, job)),
                        None => Work::Slices(job),
                    };
                }
                Work::Task(mut run) => match check_ready(&mut run.task) {
                    None => {
                        tell(world, *entity, f32::from_bits(run.line.progress.load(Ordering::Relaxed)));
                        bake.work = Work::Task(run);
                        return true;
                    }
                    Some(Outcome::NoThread(job)) => {
                        world.resource_mut::<Bakes>().no_threads = true;
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
                            tell(world, *entity, job.progress());
                            bake.work = Work::Slices(job);
                        }
                        Ok(Step::Made(made)) => match go_on(world, *entity, bake, made) {
                            Ok(()) => room += 1,
                            Err(error) => break Err(error),
                        },
                        Err(error) => break Err(error),
                    }
                    if timer.is_over() {
                        return true;
                    }
                }
                Work::Landing(finished, frames) => match land(world, *entity, bake, finished, frames) {
                    Ok(Some(covered)) => break Ok(covered),
                    // It waits for the renderer, or has to be made anew.
                    Ok(None) => {
                        if !matches!(bake.work, Work::Ready(_)) {
                            return true;
                        }
                    }
                    Err(error) => break Err(error),
                },
            }
        };
        ended.push((*entity, result));
        false
    });
    // What was begun or cancelled meanwhile has the last word.
    let mut bakes = world.resource_mut::<Bakes>();
    let newer = core::mem::take(&mut bakes.list);
    let cancelled = bakes.cancelled.take().unwrap_or_default();
    list.retain(|(entity, _)| !cancelled.contains(entity) && newer.iter().all(|(other, _)| other != entity));
    list.extend(newer);
    bakes.list = list;
    ended.retain(|(entity, _)| !cancelled.contains(entity));
    world.resource_mut::<FrameClock>().stop(&timer);
    ended
}

fn tell(world: &mut World, entity: Entity, progress: f32) {
    if let Some(mut told) = world.get_mut::<BakeProgress>(entity) {
        told.set_if_neq(BakeProgress(progress));
    }
}

/// Tells of the end of a bake.
fn end(world: &mut World, entity: Entity, result: Result<Option<f32>, CrackError>) {
    match result {
        Ok(covered) => {
            tell(world, entity, 1.0);
            world.trigger(CrackBaked { entity, covered });
        }
        Err(error) => {
            warn!("the guided cracks of {} are not made: {error}", Called::of(world, entity));
            world.trigger(CrackFailed { entity, error });
        }
    }
}

/// The next part of a bake, from what has been made: work that is ready, or again from the start.
fn go_on(world: &mut World, entity: Entity, bake: &mut Bake, made: Made) -> Result<(), CrackError> {
    match made {
        Made::Lines(lines) => order(world, entity, bake, lines),
        Made::Surface(finished) => {
            bake.work = Work::Landing(finished, 0);
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
            surfaces::Surfaces,
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
        app.world_mut().resource_mut::<Bakes>().no_threads = no_threads;
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

    /// What a frame takes up is ready: all of it is stamped and painted when its end is told.
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
             mut surfaces: ResMut<Surfaces>,
             images: Res<Assets<Image>>,
             sprites: Query<&Sprite>,
             mut seen: ResMut<Seen>| {
                let Some(active) = surfaces.active.get_mut(&baked.entity) else { return };
                let mut changed = Vec::new();
                active.growth.take_changed(&mut changed);
                let is_dirty = active.views.iter().any(|view| !view.dirty.is_empty());
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
