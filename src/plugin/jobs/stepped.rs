//! Jobs that are done step by step: by a background task, or in slices of frames.

use super::background::guarded;
use super::frame_time::Timer;
use super::threads::Threads;
use crate::plugin::api::CrackError;
use bevy::tasks::{AsyncComputeTaskPool, Task, futures::check_ready};
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
    thread::{self, ThreadId},
};

/// Work in steps, each short enough for a frame where there are no threads.
pub(crate) trait Stepped: Sized + Send + 'static {
    type Output: Send + 'static;

    /// One step of the work.
    fn step(self) -> Result<Step<Self>, CrackError>;

    /// How much is done, 0..=1.
    fn progress(&self) -> f32;
}

/// What comes of a step.
pub(crate) enum Step<J: Stepped> {
    More(J),
    Done(J::Output),
}

/// A task at work, which stops within a step when this is dropped.
pub(crate) struct RunningTask<J: Stepped> {
    task: Task<Outcome<J>>,
    link: Arc<TaskLink>,
}

/// What a task and its surface tell one another.
struct TaskLink {
    cancelled: AtomicBool,
    /// The bits of the progress.
    progress: AtomicU32,
}

impl<J: Stepped> Drop for RunningTask<J> {
    fn drop(&mut self) {
        self.link.cancelled.store(true, Ordering::Relaxed);
    }
}

/// What comes back from a task.
pub(crate) enum Outcome<J: Stepped> {
    /// It runs where it was started, which would stand still meanwhile.
    NoThread(J),
    Ended(Result<J::Output, CrackError>),
}

impl<J: Stepped> RunningTask<J> {
    pub(crate) fn start(pool: &AsyncComputeTaskPool, job: J) -> Self {
        let progress = AtomicU32::new(job.progress().to_bits());
        let link = Arc::new(TaskLink { cancelled: AtomicBool::new(false), progress });
        let (linked, home) = (link.clone(), thread::current().id());
        let work = move |job: J| run(job, &linked, home);
        #[cfg(test)]
        let work = super::background::tests::panicking_alike(work);
        Self { task: pool.spawn(async move { work(job) }), link }
    }

    /// What comes back, once it is there.
    pub(crate) fn poll(&mut self) -> Option<Outcome<J>> {
        check_ready(&mut self.task)
    }

    pub(crate) fn progress(&self) -> f32 {
        f32::from_bits(self.link.progress.load(Ordering::Relaxed))
    }
}

/// The work of a task.
fn run<J: Stepped>(mut job: J, link: &TaskLink, home: ThreadId) -> Outcome<J> {
    if thread::current().id() == home {
        return Outcome::NoThread(job);
    }
    loop {
        if link.cancelled.load(Ordering::Relaxed) {
            return Outcome::Ended(Err(CrackError::Bake { reason: "cancelled".into() }));
        }
        link.progress.store(job.progress().to_bits(), Ordering::Relaxed);
        job = match guarded(|| job.step()) {
            Ok(Step::More(job)) => job,
            Ok(Step::Done(output)) => return Outcome::Ended(Ok(output)),
            Err(error) => return Outcome::Ended(Err(error)),
        };
    }
}

/// Work that a task does, or slices of frames where there are no threads.
pub(crate) enum Running<J: Stepped> {
    Task(RunningTask<J>),
    Slices(Box<J>),
}

/// How far it is.
pub(crate) enum News<J: Stepped> {
    /// It goes on; this much is done, 0..=1.
    Going(Running<J>, f32),
    Ended(Result<J::Output, CrackError>),
}

impl<J: Stepped> Running<J> {
    pub(crate) fn start(threads: &Threads, job: J) -> Self {
        match threads.pool() {
            Some(pool) => Self::Task(RunningTask::start(pool, job)),
            None => Self::Slices(Box::new(job)),
        }
    }

    /// Looks after it; makes slices until the time is over, one at least.
    pub(crate) fn look(self, threads: &mut Threads, timer: &Timer) -> News<J> {
        match self {
            Self::Task(mut task) => match task.poll() {
                None => {
                    let progress = task.progress();
                    News::Going(Self::Task(task), progress)
                }
                Some(Outcome::NoThread(job)) => {
                    threads.are_missing = true;
                    News::Going(Self::Slices(Box::new(job)), 0.0)
                }
                Some(Outcome::Ended(result)) => News::Ended(result),
            },
            Self::Slices(job) => {
                let mut job = *job;
                loop {
                    match guarded(|| job.step()) {
                        Ok(Step::More(more)) if timer.is_over() => {
                            let progress = more.progress();
                            return News::Going(Self::Slices(Box::new(more)), progress);
                        }
                        Ok(Step::More(more)) => job = more,
                        Ok(Step::Done(output)) => return News::Ended(Ok(output)),
                        Err(error) => return News::Ended(Err(error)),
                    }
                }
            }
        }
    }
}
