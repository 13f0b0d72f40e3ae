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
        let begin = work.clone();
        let task = AsyncComputeTaskPool::try_get().map(|pool| pool.spawn(async move { take(&begin).map(run) }));
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
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().copied().or(panic.downcast_ref::<String>().map(String::as_str));
        Err(error(format!("it panicked: {}", text.unwrap_or("unknown"))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::tasks::TaskPool;
    use std::{sync::mpsc, thread};

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
}
