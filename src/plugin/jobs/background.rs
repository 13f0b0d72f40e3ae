//! Work that a background task does.

use crate::plugin::api::CrackError;
use bevy::tasks::{AsyncComputeTaskPool, Task, block_on};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

/// How long work may wait for a thread to begin it, before a frame does it.
pub(crate) const PATIENCE: Duration = Duration::from_millis(50);

/// Work that a task does, unless its result is wanted before the task has begun.
pub(crate) struct BackgroundJob<W, T> {
    work: Arc<Mutex<Option<W>>>,
    run: fn(W) -> T,
    /// It makes nothing where the work has been taken away from it.
    task: Option<Task<Option<T>>>,
}

impl<W: Send + 'static, T: Send + 'static> BackgroundJob<W, T> {
    /// Begins some work.
    pub(crate) fn start(work: W, run: fn(W) -> T) -> Self {
        let work = Arc::new(Mutex::new(Some(work)));
        let (begin, there) = (work.clone(), run);
        #[cfg(test)]
        let there = tests::panicking_alike(there);
        let task = AsyncComputeTaskPool::try_get().map(|pool| pool.spawn(async move { take(&begin).map(there) }));
        Self { work, run, task }
    }

    /// What comes of it. What no thread has begun, as where there are none, is done here. `None` if the task has failed.
    pub(crate) fn finish(self) -> Option<T> {
        match take(&self.work) {
            Some(work) => Some((self.run)(work)),
            // It is at work on another thread, or done.
            None => self.task.and_then(block_on),
        }
    }

    /// What comes of it, once, if a task has done it; or if no thread has begun it and it `is_late`.
    pub(crate) fn take_if_done(&mut self, is_late: bool) -> Option<T> {
        match (self.is_done(), is_late) {
            (true, _) => self.task.take().and_then(block_on),
            (false, true) => self.take_back().map(self.run),
            (false, false) => None,
        }
    }

    /// Whether a task has done it.
    pub(crate) fn is_done(&self) -> bool {
        self.task.as_ref().is_some_and(Task::is_finished)
    }

    /// Whether a thread has begun it.
    #[cfg(test)]
    pub(crate) fn is_begun(&self) -> bool {
        self.work.lock().is_ok_and(|work| work.is_none())
    }

    /// The work, if no thread has begun it.
    pub(crate) fn take_back(&self) -> Option<W> {
        take(&self.work)
    }
}

fn take<W>(work: &Mutex<Option<W>>) -> Option<W> {
    work.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// Gives back memory where no frame waits for it.
pub(crate) fn drop_in_background(rubbish: impl Send + 'static) {
    if let Some(pool) = AsyncComputeTaskPool::try_get() {
        pool.spawn(async move { drop(rubbish) }).detach();
    }
}

/// A panic becomes an error: in a task it would end the app.
pub(crate) fn guarded<T>(run: impl FnOnce() -> Result<T, CrackError>) -> Result<T, CrackError> {
    guarded_as(|reason| CrackError::Bake { reason }, run)
}

/// The same, of another kind.
pub(crate) fn guarded_as<T, E>(error: impl FnOnce(String) -> E, run: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
    #[cfg(test)]
    let run = tests::panicking_if_asked(run);
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().copied().or(panic.downcast_ref::<String>().map(String::as_str));
        Err(error(format!("it panicked: {}", text.unwrap_or("unknown"))))
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use bevy::tasks::TaskPool;
    use std::{
        cell::Cell,
        sync::{
            atomic::{AtomicU32, Ordering},
            mpsc,
        },
        thread,
    };

    thread_local! {
        /// If guarded work is to panic, on this thread and in tasks that are begun on it: counts how often it does.
        static PANICS: Cell<Option<&'static AtomicU32>> = const { Cell::new(None) };
    }

    /// Guarded work, which panics if the thread on which it is done says so.
    pub(super) fn panicking_if_asked<T>(run: impl FnOnce() -> T) -> impl FnOnce() -> T {
        || {
            if let Some(count) = PANICS.get() {
                count.fetch_add(1, Ordering::Relaxed);
            }
            assert!(PANICS.get().is_none(), "as a test has asked");
            run()
        }
    }

    /// What a task is to do, with panics as on the thread on which it is begun.
    pub(crate) fn panicking_alike<W, T>(run: impl FnOnce(W) -> T) -> impl FnOnce(W) -> T {
        let panics = PANICS.get();
        move |work| {
            PANICS.set(panics);
            run(work)
        }
    }

    #[test]
    fn work_is_done_once_whoever_does_it() {
        let run = |(number, done): (u32, mpsc::Sender<thread::ThreadId>)| {
            done.send(thread::current().id()).expect("someone listens");
            2 * number
        };
        AsyncComputeTaskPool::get_or_init(TaskPool::new);
        let (mut here, mut there) = (0, 0);
        for number in 0..200 {
            let (tell, told) = mpsc::channel();
            let job = BackgroundJob::start((number, tell), run);
            let mut who = None;
            if number % 2 == 0 {
                // Not before it is done.
                who = told.recv().ok();
            }
            assert_eq!(job.finish(), Some(2 * number));
            let who = who.or_else(|| told.recv().ok()).expect("it was done");
            assert!(told.recv().is_err(), "only once");
            *if who == thread::current().id() { &mut here } else { &mut there } += 1;
        }
        assert!(there >= 100 && here + there == 200, "{here} {there}");
    }

    #[test]
    fn what_is_late_is_done_here_unless_a_thread_has_begun_it() {
        AsyncComputeTaskPool::get_or_init(TaskPool::new);
        for is_late in [false, true] {
            let (free, wait) = mpsc::channel::<()>();
            let (begin, begun) = mpsc::channel();
            let mut job = BackgroundJob::start((wait, begin), |(wait, begin)| {
                begin.send(()).expect("someone listens");
                wait.recv().is_err()
            });
            begun.recv().expect("it begins");
            assert_eq!(job.take_if_done(is_late), None, "a thread is at it");
            drop(free);
            while !job.is_done() {
                thread::yield_now();
            }
            assert_eq!(job.take_if_done(is_late), Some(true));
            assert_eq!(job.take_if_done(is_late), None, "once");
        }
        // No thread will ever begin this one.
        let work = Arc::new(Mutex::new(Some(4)));
        let mut job = BackgroundJob { work, run: |number| 2 * number, task: None };
        assert_eq!(job.take_if_done(false), None);
        assert_eq!(job.take_if_done(true), Some(8));
        assert_eq!(job.take_if_done(true), None);
    }

    /// Fault E11: a panic in whatever a task does, or slices of frames where there are no threads, is told of once, and the game goes on.
    #[cfg(feature = "2d")]
    mod panics {
        use super::PANICS;
        use crate::{
            Grid,
            growth::PastEvent,
            paint::analogy::{AnalogyPair, AnalogyParams},
            plugin::{
                headless::{app, blank, shown},
                jobs::threads::Threads,
                prelude::*,
            },
        };
        use bevy::{ecs::schedule::SingleThreadedExecutor, prelude::*, time::TimeUpdateStrategy};
        use std::{
            sync::atomic::{AtomicU32, Ordering},
            thread,
            time::Duration,
        };

        static COUNT: AtomicU32 = AtomicU32::new(0);

        /// What was told of failures.
        #[derive(Resource, Default)]
        struct Told(Vec<(Entity, String)>);

        fn told(app: &App) -> &[(Entity, String)] {
            &app.world().resource::<Told>().0
        }

        fn frames_until(app: &mut App, what: &str, mut is_so: impl FnMut(&App) -> bool) {
            for _ in 0..30_000 {
                if is_so(app) {
                    return;
                }
                app.update();
                thread::sleep(Duration::from_millis(1));
            }
            panic!("{what}: it never comes");
        }

        fn state(app: &App, entity: Entity) -> CrackState {
            app.world().get::<CrackState>(entity).cloned().unwrap_or_default()
        }

        fn is_at_rest(app: &App, entity: Entity) -> bool {
            state(app, entity).status == CrackStatus::Done && app.world().resource::<CrackStats>().queued == 0
        }

        fn hit(app: &mut App, entity: Entity) {
            app.world_mut().trigger(CrackHit::uv(entity, Vec2::splat(0.5)));
        }

        /// An app that keeps what it is told of failures.
        fn watched() -> App {
            let mut app = app(CrackBudget { milliseconds: 1e6, ..default() });
            // What begins is begun on this thread.
            app.edit_schedule(PostUpdate, |schedule| {
                schedule.set_executor(SingleThreadedExecutor::new());
            });
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)))
                .init_resource::<Told>()
                .add_observer(|failed: On<CrackFailed>, mut told: ResMut<Told>| {
                    told.0.push((failed.entity, format!("{:?}", failed.error)));
                })
                .add_observer(|failed: On<ShatterFailed>, mut told: ResMut<Told>| {
                    told.0.push((failed.entity, format!("{:?}", failed.error)));
                })
                .add_observer(|failed: On<ReliefFailed>, mut told: ResMut<Told>| {
                    told.0.push((failed.entity, format!("{:?}", failed.error)));
                })
                .add_observer(|failed: On<AnalogyFailed>, mut told: ResMut<Told>| {
                    told.0.push((failed.entity, format!("{:?}", failed.error)));
                });
            app
        }

        /// Has work begun that panics, on a sprite of this size; `is_cracked` before, or not.
        fn check(
            what: &str,
            has_threads: bool,
            side: u32,
            is_cracked: bool,
            begin: fn(&mut App, Entity, &Handle<Image>),
        ) {
            let what = format!("{what}, threads: {has_threads}");
            let mut app = watched();
            app.world_mut().resource_mut::<Threads>().are_missing = !has_threads;
            let spawn = |app: &mut App, side: u32| {
                let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::splat(side)));
                let sprite = (Sprite::from_image(image.clone()), CrackSurface::new(CrackPreset::GLASS));
                (app.world_mut().spawn(sprite).id(), image)
            };
            let (entity, image) = spawn(&mut app, side);
            app.update();
            if is_cracked {
                hit(&mut app, entity);
                frames_until(&mut app, &what, |app| state(app, entity).status == CrackStatus::Done);
            }
            app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.0;
            PANICS.set(Some(&COUNT));
            begin(&mut app, entity, &image);
            frames_until(&mut app, &what, |app| !told(app).is_empty());
            (0..20).for_each(|_| app.update());
            PANICS.set(None);
            let [(failed, error)] = told(&app) else { panic!("{what}: {:?}", told(&app)) };
            assert_eq!(*failed, entity, "{what}");
            assert!(error.contains("as a test has asked"), "{what}: {error}");
            assert_eq!(app.world().resource::<CrackStats>().queued, 0, "{what}: hits that wait are refused");
            // Others crack.
            let (other, _) = spawn(&mut app, 64);
            hit(&mut app, other);
            frames_until(&mut app, &what, |app| state(app, other).nodes > 0);
            assert_eq!(told(&app).len(), 1, "{what}: {:?}", told(&app));
        }

        /// Has work begun of which nobody is told if it panics, on a sprite that is cracked and `prepared`: it is done in another way or
        /// again, and what is shown in the end is the same.
        fn check_quiet(what: &str, preset: &CrackPreset, prepare: fn(&mut App, Entity), begin: fn(&mut App, Entity)) {
            let end = |panics: bool| {
                let mut app = watched();
                let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(300, 200)));
                let surface = CrackSurface::new(preset.clone()).with_seed(4);
                let entity = app.world_mut().spawn((Sprite::from_image(image), surface)).id();
                app.update();
                prepare(&mut app, entity);
                frames_until(&mut app, what, |app| is_at_rest(app, entity));
                app.world_mut().resource_mut::<CrackBudget>().milliseconds = 0.5;
                let count: &'static AtomicU32 = Box::leak(Box::default());
                PANICS.set(panics.then_some(count));
                begin(&mut app, entity);
                if panics {
                    frames_until(&mut app, what, |_| count.load(Ordering::Relaxed) > 0);
                    (0..5).for_each(|_| app.update());
                }
                PANICS.set(None);
                frames_until(&mut app, what, |app| is_at_rest(app, entity));
                for _ in 0..200 {
                    app.update();
                    thread::sleep(Duration::from_millis(1));
                }
                assert!(is_at_rest(&app, entity) && told(&app).is_empty(), "{what}: {:?}", told(&app));
                // Not its tips: they are those of the last frame in which something moved.
                let CrackState { nodes, frozen, hits, time, cells, .. } = state(&app, entity);
                (shown(&app, entity), (nodes, frozen, hits, time, cells))
            };
            let (with, without) = (end(true), end(false));
            assert!(with.0 == without.0, "{what}: other cracks");
            assert_eq!(with.1, without.1, "{what}");
        }

        #[test]
        fn e11_in_what_is_done_in_another_way() {
            let hits = |app: &mut App, entity: Entity| {
                for number in 0..12u32 {
                    let place = Vec2::new(number as f32 * 0.618, number as f32 * 0.414).fract_gl();
                    app.world_mut().trigger(CrackHit::uv(entity, place).with_energy(2.0));
                    // One after the other: what they crack depends on what has grown.
                    app.update();
                    frames_until(app, "a hit", |app| is_at_rest(app, entity));
                }
            };
            let mut small = CrackPreset::CONCRETE;
            small.growth.max_nodes = 400;
            check_quiet("what is forgotten", &small, hit, hits);
            let guided = |app: &mut App, entity: Entity| {
                let guide = CrackGuide::new(Grid::new(UVec2::new(3, 1), 0.5));
                app.world_mut().entity_mut(entity).insert(GuidedCracks::new(guide));
                frames_until(app, "the bake", |app| {
                    app.world().get::<BakeProgress>(entity).is_some_and(|progress| progress.0 == 1.0)
                });
            };
            let back = |app: &mut App, entity: Entity| {
                let clock = CrackClock { seek: Some(0.3), ..CrackClock::speed(0.0) };
                app.world_mut().entity_mut(entity).insert(clock);
            };
            check_quiet("another time", &CrackPreset::CONCRETE, guided, back);
        }

        #[test]
        fn e11_in_what_is_grown_again() {
            check("a picture of other proportions", true, 600, true, |app, entity, _| {
                let image = app.world_mut().resource_mut::<Assets<Image>>().add(blank(UVec2::new(600, 480)));
                if let Some(mut sprite) = app.world_mut().get_mut::<Sprite>(entity) {
                    sprite.image = image;
                }
            });
        }

        #[test]
        fn e11_in_masks() {
            check("the lines of a picture", true, 600, false, |app, entity, _| {
                if let Some(mut surface) = app.world_mut().get_mut::<CrackSurface>(entity) {
                    surface.preset = CrackPreset::BRICK.into();
                }
                hit(app, entity);
            });
        }

        #[test]
        fn e11_in_bakes() {
            for has_threads in [true, false] {
                check("guided cracks", has_threads, 64, false, |app, entity, _| {
                    let guide = CrackGuide::new(Grid::new(UVec2::new(3, 1), 0.5));
                    app.world_mut().entity_mut(entity).insert(GuidedCracks::new(guide));
                });
                check("strands", has_threads, 64, false, |app, entity, _| {
                    let start = HitPoint::Uv(Vec2::new(0.0, 0.5));
                    app.world_mut().entity_mut(entity).insert(CrackStrands::new([start], StrandField::Linear(Vec2::X)));
                });
                check("a record", has_threads, 64, false, |app, entity, _| {
                    let mut record = CrackRecord::default();
                    record.past.events.push(PastEvent::Hit { after: 0, pos: Vec2::splat(0.5), energy: 1.0 });
                    app.world_mut().entity_mut(entity).insert(record);
                });
            }
        }

        #[test]
        fn e11_in_reliefs_and_analogies() {
            for has_threads in [true, false] {
                check("a relief", has_threads, 64, false, |app, entity, _| {
                    let relief = CrackRelief::island().with_size(UVec2::splat(64));
                    app.world_mut().entity_mut(entity).insert(relief);
                });
                check("an analogy", has_threads, 64, true, |app, entity, _| {
                    let texel = |i: usize| if i / 4 % 16 == 5 { [9, 9, 9, 255] } else { [200, 190, 180, 255] };
                    let rgba: Vec<u8> = (0..64 * 64).flat_map(texel).collect();
                    let photo = AnalogyPair::from_darkness(UVec2::splat(64), &rgba, 0.3).expect("it has cracks");
                    let examples = AnalogyExamples::new(vec![photo], &AnalogyParams::DEFAULT).expect("it is whole");
                    let examples = app.world_mut().resource_mut::<Assets<AnalogyExamples>>().add(examples);
                    app.world_mut().entity_mut(entity).insert(CrackAnalogy::new(examples));
                });
            }
        }

        #[test]
        fn e11_in_what_makes_a_large_surface() {
            check("its first hit", true, 600, false, |app, entity, _| {
                (0..3).for_each(|_| hit(app, entity));
            });
            check("another picture", true, 600, true, |app, _, image| {
                if let Some(mut image) = app.world_mut().resource_mut::<Assets<Image>>().get_mut(image) {
                    image.data.iter_mut().flatten().for_each(|value| *value ^= 8);
                }
            });
        }

        #[test]
        fn e11_in_what_cuts_shards() {
            check("shards", true, 64, true, |app, entity, _| {
                let mut commands = app.world_mut().commands();
                commands.entity(entity).insert(ShatterCracks::default()).shatter_cracks(ShatterRequest::EVERYTHING);
                app.world_mut().flush();
            });
        }
    }
}
