//! [`Playhead`]: the time of a surface.

use crate::pattern::{Moment, SurfaceFrame};
use crate::plugin::api::clock::CrackClock;
use crate::raster::{Profile, Replay};

/// Where a surface is in time, and what lets its time pass.
pub(crate) struct Playhead {
    /// Steps of growth a second.
    pub(crate) rate: f32,
    /// Steps of growth that are due, with their fraction.
    pub(crate) due: f64,
    /// The component, if it has one.
    pub(crate) clock: Option<CrackClock>,
    /// While its cracks close: steps a second, backwards.
    pub(crate) closing: Option<f64>,
    /// While baked cracks appear without a clock: steps a second.
    pub(crate) appearing: Option<f64>,
    /// Shows other times than the end; `None` = everything that has grown is shown.
    pub(crate) playback: Option<Playback>,
}

impl Playhead {
    pub(crate) const fn new(rate: f32) -> Self {
        Self { rate, due: 0.0, clock: None, closing: None, appearing: None, playback: None }
    }
}

/// Shows a surface's cracks at times other than the end.
pub(crate) struct Playback {
    pub(crate) replay: Replay,
    /// Steps to show; above the end while more are to be grown.
    pub(super) want: f64,
    /// What is shown.
    pub(crate) shown: Moment,
}

impl Playback {
    /// Draws the field again, from nothing.
    pub(crate) fn start_over(&mut self, frame: SurfaceFrame, profile: Profile) {
        self.replay = Replay::new(frame.size(), profile);
    }

    /// No more than `most` steps beyond the end are asked for.
    pub(super) fn advance(&mut self, steps: f64, end: f64, most: f64) {
        if steps > 0.0 {
            self.want = (self.want + steps).min(self.want.max(end + most));
        } else if steps < 0.0 {
            self.want = (self.want.min(end) + steps).max(0.0);
        }
    }
}
