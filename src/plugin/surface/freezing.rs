//! [`Freezing`]: a task works out what a surface forgets of its cracks.

use super::active::Active;
use super::drawing::Forgotten;
use crate::growth::{CrackGrowth, GrowthParams};
use crate::pattern::CrackMask;
use crate::plugin::jobs::background::{BackgroundJob, PATIENCE, guarded};
use bevy::{platform::time::Instant, prelude::*};
use std::sync::Arc;

/// What is left of the cracks of a surface, worked out while it goes on showing them. It does not grow meanwhile.
pub(crate) struct Freezing {
    seen: Seen,
    stage: Stage,
}

enum Stage {
    /// By a task, since then.
    Running(BackgroundJob<Work, Option<Box<Left>>>, Instant),
    /// `None` if the task has failed.
    Done(Option<Box<Left>>),
}

struct Work {
    growth: CrackGrowth,
    keep: u32,
    has_plates: bool,
    /// The size of the picture that is kept, if there is none yet.
    size: Option<UVec2>,
}

/// What is left of cracks, and what is not.
pub(crate) struct Left {
    pub(crate) growth: CrackGrowth,
    pub(crate) forgotten: Forgotten,
}

/// What it was worked out from: cracks that have changed meanwhile, or grow by other rules, are not those.
#[derive(PartialEq)]
struct Seen {
    steps: u32,
    nodes: usize,
    hits: usize,
    redrawn: u64,
    extent: Vec2,
    params: GrowthParams,
    mask: Arc<CrackMask>,
}

impl Seen {
    fn of(active: &Active) -> Self {
        let growth = &active.cracks.growth;
        Self {
            steps: growth.steps_made(),
            nodes: growth.network().nodes().len(),
            hits: growth.impacts().len(),
            redrawn: active.drawing.redrawn,
            extent: growth.network().extent(),
            params: growth.params().clone(),
            mask: growth.mask().clone(),
        }
    }
}

impl Freezing {
    /// Begins or goes on; returns whether it is done.
    pub(crate) fn go_on(active: &mut Active, keep: u32) -> bool {
        let seen = Seen::of(active);
        let known = active.freezing.take().filter(|freezing| freezing.seen == seen);
        let stage = known.map_or_else(
            || {
                let work = Work {
                    growth: active.cracks.growth.clone(),
                    keep,
                    has_plates: active.drawing.field.has_plates(),
                    size: active.drawing.frozen.is_none().then(|| active.drawing.field.frame.size()),
                };
                Stage::Running(BackgroundJob::start(work, Work::forget), Instant::now())
            },
            |known| known.stage,
        );
        let stage = match stage {
            Stage::Running(mut job, since) => match job.take_if_done(since.elapsed() >= PATIENCE) {
                Some(left) => Stage::Done(left),
                None => Stage::Running(job, since),
            },
            done @ Stage::Done(_) => done,
        };
        let is_done = matches!(stage, Stage::Done(_));
        active.freezing = Some(Box::new(Self { seen, stage }));
        is_done
    }

    /// What is left of the cracks of a surface, if it was worked out from what it has now.
    pub(crate) fn take(active: &mut Active) -> Option<Box<Left>> {
        let Self { seen, stage } = *active.freezing.take()?;
        match stage {
            Stage::Done(left) if seen == Seen::of(active) => left,
            _ => None,
        }
    }
}

impl Work {
    fn forget(mut self) -> Option<Box<Left>> {
        guarded(|| {
            let forgotten = Forgotten::of(&mut self.growth, self.keep, self.has_plates, self.size);
            Ok(Box::new(Left { growth: self.growth, forgotten }))
        })
        .ok()
    }
}
