//! [`AnalogyState`]: how far a surface is whose cracks are shown as those of photographs.

use super::analogy_work::{AnalogyWish, AnalogyWork, MadePatch};
use crate::Grid;
use crate::paint::analogy::Analogy;
use crate::plugin::api::CrackError;
use crate::plugin::jobs::frame_time::Timer;
use crate::plugin::jobs::stepped::Running;
use crate::plugin::jobs::threads::Threads;
use crate::raster::TexelRect;
use bevy::ecs::change_detection::Tick;

/// How far the analogy of a surface is.
#[derive(Default)]
pub(crate) struct AnalogyState {
    /// What it is made from; `None` = nothing yet.
    pub(super) wish: Option<AnalogyWish>,
    /// What was made, and the depths that it has taken over. They are with the task while that is at work.
    pub(super) made: Option<(Option<Box<Analogy>>, Grid<u16>)>,
    pub(super) stage: Stage,
    /// Whether all that there was at first is shown.
    pub(super) is_shown: bool,
}

#[derive(Default)]
pub(super) enum Stage {
    #[default]
    Rest,
    /// Depths are being copied: rectangles that are left, and those that are done.
    Copy(Vec<TexelRect>, Vec<TexelRect>),
    Work(Running<AnalogyWork>),
    /// What was made is being taken over.
    Show(Vec<MadePatch>),
    /// It cannot be made from this.
    Failed(Attempt),
}

/// From what an analogy was to be made: when its component was changed last, and which examples there were.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Attempt {
    pub(crate) changed: Tick,
    /// The address of the examples; 0 = none.
    pub(crate) examples: usize,
}

/// What has become of an analogy in a frame.
pub(crate) enum AnalogyNews {
    Nothing,
    /// The first picture is on its way.
    Progress(f32),
    /// The first picture is there.
    Made,
    Failed(CrackError),
}

/// What a frame has for it.
pub(crate) struct AnalogyTools<'a> {
    pub(crate) threads: &'a mut Threads,
    pub(crate) timer: &'a Timer,
}
