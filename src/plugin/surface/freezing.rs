//! [`Freezing`]: a task works out what a surface forgets of its cracks.

use super::cracks::Cracks;
use super::drawing::{Drawing, Forgotten};
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
    /// Waits since then for the cracks to stand still: a task reads them, and a frame that changed them meanwhile would have to copy them.
    Waiting(Instant),
    /// By a task, since then.
    Running(BackgroundJob<Work, Option<Box<Left>>>, Instant),
    /// `None` if the task has failed.
    Done(Option<Box<Left>>),
}

struct Work {
    growth: Arc<CrackGrowth>,
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
    has_plates: bool,
    extent: Vec2,
    params: GrowthParams,
    mask: Arc<CrackMask>,
}

impl Seen {
    fn of(cracks: &Cracks, drawing: &Drawing) -> Self {
        let growth = &cracks.growth;
        Self {
            steps: growth.steps_made(),
            nodes: growth.network().nodes().len(),
            hits: growth.impacts().len(),
            redrawn: drawing.redrawn,
            has_plates: drawing.field.has_plates(),
            extent: growth.network().extent(),
            params: growth.params().clone(),
            mask: growth.mask().clone(),
        }
    }
}

impl Freezing {
    /// Goes on, or begins (again) if nothing is `known` of these cracks. Its task begins when they stand still.
    pub(crate) fn go_on(
        known: Option<Box<Self>>,
        cracks: &Cracks,
        drawing: &Drawing,
        keep: u32,
        stands_still: bool,
    ) -> Self {
        let seen = Seen::of(cracks, drawing);
        let known = known.filter(|freezing| freezing.seen == seen);
        let mut stage = known.map_or_else(|| Stage::Waiting(Instant::now()), |known| known.stage);
        if let Stage::Waiting(since) = stage
            && (stands_still || since.elapsed() >= PATIENCE)
        {
            let work = Work {
                growth: cracks.growth.share(),
                keep,
                has_plates: drawing.field.has_plates(),
                size: drawing.frozen.is_none().then(|| drawing.field.frame.size()),
            };
            stage = Stage::Running(BackgroundJob::start(work, Work::forget), Instant::now());
        }
        let stage = match stage {
            Stage::Running(mut job, since) => match job.take_if_done(since.elapsed() >= PATIENCE) {
                Some(left) => Stage::Done(left),
                None => Stage::Running(job, since),
            },
            other => other,
        };
        Self { seen, stage }
    }

    /// Whether the task is done.
    pub(crate) const fn is_done(&self) -> bool {
        matches!(self.stage, Stage::Done(_))
    }

    /// What is left of these cracks, if it was worked out from what they are now.
    pub(crate) fn left(self, cracks: &Cracks, drawing: &Drawing) -> Option<Box<Left>> {
        match self.stage {
            Stage::Done(left) if self.seen == Seen::of(cracks, drawing) => left,
            _ => None,
        }
    }
}

impl Work {
    fn forget(self) -> Option<Box<Left>> {
        guarded(|| {
            let mut growth = Arc::unwrap_or_clone(self.growth);
            let forgotten = Forgotten::of(&mut growth, self.keep, self.has_plates, self.size);
            Ok(Box::new(Left { growth, forgotten }))
        })
        .ok()
    }
}
