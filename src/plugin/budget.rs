//! [`CrackBudget`]: what cracks may cost, and [`CrackStats`]: what became of the hits.

use bevy::{platform::time::Instant, prelude::*, tasks::ComputeTaskPool};
use core::time::Duration;
use std::sync::{Mutex, PoisonError};

/// What all surfaces together may cost.
///
/// A clock decides only *when* something happens, never *what*: the cracks of a surface are the same on a slow machine.
#[derive(Resource, Reflect, Clone, Debug, PartialEq)]
#[reflect(Resource, Default)]
pub struct CrackBudget {
    /// Time for hits, growth and painting in one frame, milliseconds, however many threads grow and paint; default 2. What is left
    /// over waits for the next frame; at least one hit, one step and one surface are done in each. NaN and values below zero count
    /// as 0.
    ///
    /// With a second or more nothing that a frame shows is put off: for recordings, whose frames may take any time.
    pub milliseconds: f32,
    /// Hits that may wait on one surface; default 4096. A further one adds its energy to a waiting one near it.
    pub max_queued_per_surface: usize,
    /// Surfaces that may grow at once; default 1024. Others wait for one of them to end.
    pub max_growing: usize,
    /// Memory for the textures of all cracked surfaces, bytes; default 1 GiB. A surface that does not fit gets coarser
    /// textures, or fails.
    pub max_texture_bytes: u64,
    /// Longest side of a texture, texels; default 8192. The device's own limit holds as well.
    pub max_side: u32,
    /// Shards that are shown at once, of all surfaces together; default 4096. The oldest make room for new ones.
    pub max_shards: usize,
}

impl Default for CrackBudget {
    fn default() -> Self {
        Self {
            milliseconds: 2.0,
            max_queued_per_surface: 4096,
            max_growing: 1024,
            max_texture_bytes: 1 << 30,
            max_side: 8192,
            max_shards: 4096,
        }
    }
}

/// What became of all hits ever sent: `sent = applied + merged + ignored + rejected + queued`, after every frame.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Resource, Default)]
pub struct CrackStats {
    /// Hits sent, as events or messages.
    pub sent: u64,
    /// Hits that started a crack.
    pub applied: u64,
    /// Hits whose energy went into another hit close to them.
    pub merged: u64,
    /// Hits without energy.
    pub ignored: u64,
    /// Hits refused: not finite, off the surface, on nothing, or on a surface that failed, was healed or is gone.
    pub rejected: u64,
    /// Hits that wait.
    pub queued: u64,
}

impl CrackBudget {
    /// Whether frames may take any time.
    pub(super) fn is_boundless(&self) -> bool {
        self.milliseconds >= 1000.0
    }
}

/// Time spent in this frame by the systems of this crate.
#[derive(Resource, Default)]
pub(super) struct FrameClock {
    spent: Duration,
}

/// Measures one system.
pub(super) struct Timer {
    start: Instant,
    before: Duration,
    limit: Duration,
}

impl FrameClock {
    /// Starts to measure a system that must end when `share` of the frame's budget is spent.
    pub(super) fn start(&self, budget: &CrackBudget, share: f32) -> Timer {
        let seconds = (budget.milliseconds.max(0.0) * share / 1000.0).min(3600.0);
        Timer { start: Instant::now(), before: self.spent, limit: Duration::from_secs_f32(seconds) }
    }

    /// Adds what the system has spent.
    pub(super) fn stop(&mut self, timer: &Timer) {
        self.spent = timer.before + timer.start.elapsed();
    }
}

impl Timer {
    pub(super) fn is_over(&self) -> bool {
        self.before + self.start.elapsed() >= self.limit
    }
}

/// Does `work` for every share, on as many threads as there are; in order if there is only one share, or one thread.
///
/// Systems that call it run on the main thread, which would wait for them otherwise: so it works as well.
pub(super) fn share_out<S: Send>(shares: impl ExactSizeIterator<Item = S> + Send, work: impl Fn(S) + Sync) {
    match ComputeTaskPool::try_get().filter(|_| shares.len() > 1) {
        Some(pool) => {
            // A task for each would cost more than some of them.
            let tasks = shares.len().min(pool.thread_num() + 1);
            let (shares, work) = (&Mutex::new(shares), &work);
            let next = || shares.lock().unwrap_or_else(PoisonError::into_inner).next();
            pool.scope(|scope| {
                for _ in 0..tasks {
                    scope.spawn(async move {
                        while let Some(share) = next() {
                            work(share);
                        }
                    });
                }
            });
        }
        None => shares.for_each(work),
    }
}

pub(super) fn start_frame(mut clock: ResMut<FrameClock>) {
    clock.spent = Duration::ZERO;
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::tasks::TaskPool;

    #[test]
    fn every_share_is_done_once() {
        ComputeTaskPool::get_or_init(TaskPool::default);
        for n in [0, 1, 3, 4, 100] {
            let mut done = vec![0; n];
            share_out(done.chunks_mut(3), |share| share.iter_mut().for_each(|done| *done += 1));
            assert_eq!(done, vec![1; n]);
        }
    }
}
