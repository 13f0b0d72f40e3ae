//! A moment that is being made: by a task, or in slices of frames.

use super::frame_job::FrameJob;
use crate::plugin::jobs::background::{BackgroundJob, guarded};
use crate::plugin::jobs::frame_time::Timer;
use bevy::platform::time::Instant;
use std::time::Duration;

/// How long a task may wait for a thread before its work is done in slices of frames.
const PATIENCE: Duration = Duration::from_millis(50);

/// A moment that is being made.
pub(super) enum Running {
    /// By a task, since then.
    Task(BackgroundJob<Box<FrameJob>, Option<Box<FrameJob>>>, Instant),
    Slices(Box<FrameJob>),
}

/// What has become of it.
pub(super) enum News {
    Running(Running),
    Made(Box<FrameJob>),
    /// The task has failed.
    Lost,
}

impl Running {
    pub(super) fn start(job: Box<FrameJob>, has_threads: bool) -> Self {
        if has_threads {
            Self::Task(BackgroundJob::start(job, |job| guarded(|| Ok(job.finish())).ok()), Instant::now())
        } else {
            Self::Slices(job)
        }
    }

    /// Looks after it; makes slices until the time is over.
    pub(super) fn look(self, timer: &Timer) -> News {
        match self {
            Self::Task(task, _) if task.is_done() => task.finish().flatten().map_or(News::Lost, News::Made),
            Self::Task(task, since) if since.elapsed() < PATIENCE => News::Running(Self::Task(task, since)),
            Self::Task(task, since) => match task.take_back() {
                Some(job) => Self::Slices(job).look(timer),
                None => News::Running(Self::Task(task, since)),
            },
            Self::Slices(mut job) => loop {
                if job.step() {
                    return News::Made(job);
                }
                if timer.is_over() {
                    return News::Running(Self::Slices(job));
                }
            },
        }
    }

    /// Whether [`Self::recall`] gives back what there is without work and without waiting. Until it is looked after, this stays so.
    pub(super) fn is_at_rest(&self) -> bool {
        match self {
            Self::Task(task, _) => task.is_done(),
            Self::Slices(job) => !job.is_half_drawn(),
        }
    }

    /// What there is of it; waits for a task that is at work.
    pub(super) fn recall(self) -> Option<Box<FrameJob>> {
        match self {
            Self::Task(task, _) => task.take_back().or_else(|| task.finish().flatten()),
            Self::Slices(mut job) => {
                while job.is_half_drawn() {
                    job.step();
                }
                Some(job)
            }
        }
    }
}
