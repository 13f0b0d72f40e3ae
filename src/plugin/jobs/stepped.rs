//! Jobs that are done step by step: by a background task, or in slices of frames.

use super::background::guarded;
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
        Self { task: pool.spawn(async move { run(job, &linked, home) }), link }
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
