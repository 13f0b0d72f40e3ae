//! The frame's time: who has used how much of it, and work for several threads.

use crate::plugin::api::budget::CrackBudget;
use bevy::{platform::time::Instant, prelude::*, tasks::ComputeTaskPool};
use core::time::Duration;
use std::sync::{Mutex, PoisonError};

/// Time spent in this frame by the systems of this crate.
#[derive(Resource, Default)]
pub(crate) struct FrameClock {
    spent: Duration,
    start: Option<Instant>,
    /// What a busy frame takes between the first of this crate's systems and the last, beside what they measure: on average of the
    /// last ones. It counts as spent when a frame starts.
    unmeasured: Duration,
}

/// Share of a frame's budget that counts as spent at the start at the most: what a game's own systems do in between is not ours.
const MAX_BESIDES: f32 = 0.25;

/// Share of it that must be spent for the frame to tell what others take unmeasured.
const BUSY: f32 = 0.25;

/// Weight of a frame in [`FrameClock::besides`].
const WEIGHT: f32 = 0.125;

/// Measures one system.
pub(crate) struct Timer {
    start: Instant,
    before: Duration,
    limit: Duration,
}

impl FrameClock {
    /// Starts to measure a system that must end when `share` of the frame's budget is spent, of what is left beside others.
    pub(crate) fn start(&self, budget: &CrackBudget, share: f32) -> Timer {
        let rest = budget.share(1.0).saturating_sub(self.unmeasured);
        Timer { start: Instant::now(), before: self.spent, limit: self.unmeasured + rest.mul_f32(share) }
    }

    /// What the crate's systems have spent in this frame, milliseconds.
    #[cfg(feature = "editor")]
    pub(crate) fn milliseconds(&self) -> f32 {
        self.spent.as_secs_f32() * 1000.0
    }

    /// Adds what the system has spent.
    pub(crate) fn stop(&mut self, timer: &Timer) {
        self.spent = timer.before + timer.start.elapsed();
    }
}

impl Timer {
    pub(crate) fn is_over(&self) -> bool {
        self.has_no_time_for(Duration::ZERO)
    }

    /// Whether the time would be over after `more`.
    pub(crate) fn has_no_time_for(&self, more: Duration) -> bool {
        self.before + self.start.elapsed() + more >= self.limit
    }
}

/// Does `work` for every share, on as many threads as there are; in order if there is only one share, or one thread.
///
/// Systems that call it run on the main thread, which would wait for them otherwise: so it works as well.
pub(crate) fn par_for_each<S: Send>(shares: impl ExactSizeIterator<Item = S> + Send, work: impl Fn(S) + Sync) {
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

pub(crate) fn start_frame(mut clock: ResMut<FrameClock>, budget: Res<CrackBudget>) {
    clock.start = Some(Instant::now());
    // It may have been learned under a larger budget.
    clock.unmeasured = clock.unmeasured.min(budget.share(MAX_BESIDES));
    clock.spent = clock.unmeasured;
}

/// Learns from a busy frame what it takes unmeasured what is measured.
pub(crate) fn end_frame(mut clock: ResMut<FrameClock>, budget: Res<CrackBudget>) {
    let Some(start) = clock.start.take() else { return };
    let measured = clock.spent.saturating_sub(clock.unmeasured);
    if measured >= budget.share(BUSY) {
        let now = start.elapsed().saturating_sub(measured).min(budget.share(MAX_BESIDES));
        clock.unmeasured = clock.unmeasured.mul_f32(1.0 - WEIGHT) + now.mul_f32(WEIGHT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::{ecs::system::RunSystemOnce, tasks::TaskPool};
    use std::thread::sleep;

    #[test]
    fn what_frames_take_besides_counts_as_spent() {
        let mut world = World::new();
        world.init_resource::<FrameClock>();
        let millisecond = Duration::from_millis(1);
        let mut frame = |milliseconds: f32, busy: u32, unmeasured: u32| {
            let budget = CrackBudget { milliseconds, ..default() };
            world.insert_resource(budget.clone());
            let _ = world.run_system_once(start_frame);
            sleep(unmeasured * millisecond);
            let mut clock = world.remove_resource::<FrameClock>().unwrap_or_default();
            let timer = clock.start(&budget, 1.0);
            sleep(busy * millisecond);
            clock.stop(&timer);
            world.insert_resource(clock);
            let _ = world.run_system_once(end_frame);
            let clock = world.resource::<FrameClock>();
            (clock.spent.as_secs_f32() * 1e3, clock.unmeasured.as_secs_f32() * 1e3)
        };
        assert_eq!(frame(4.0, 0, 2).1, 0.0, "an idle frame tells nothing");
        let (_, first) = frame(4.0, 2, 3);
        // A quarter of the budget, at the weight of one frame.
        assert!((0.12..0.13).contains(&first), "{first}");
        let (mut last, mut spent) = (first, 0.0);
        for _ in 0..20 {
            let before = last;
            (spent, last) = frame(4.0, 2, 3);
            assert!(last > before && last <= 1.0, "{last}");
            assert!(spent >= 2.0 + before, "{spent}");
        }
        assert!(spent > 2.8, "{spent}");
        // A smaller budget holds at once.
        assert!(frame(1.0, 0, 0).1 <= 0.25);
    }

    #[test]
    fn every_share_is_done_once() {
        ComputeTaskPool::get_or_init(TaskPool::default);
        for n in [0, 1, 3, 4, 100] {
            let mut done = vec![0; n];
            par_for_each(done.chunks_mut(3), |share| share.iter_mut().for_each(|done| *done += 1));
            assert_eq!(done, vec![1; n]);
        }
    }
}
