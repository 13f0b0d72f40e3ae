//! How time passes for the cracks of a surface.

use super::active::Active;
use super::cracks::LastHit;
use super::drawing::Frozen;
use super::playhead::Playback;
use super::stamp::stamp_anew;
use crate::pattern::Moment;
use crate::plugin::api::{CrackClock, CrackDrive, CrackRecord};
use crate::raster::Replay;
use bevy::math::Vec3;

/// The most steps that can be due: after a long pause a surface does not make up for all of it.
const MAX_DUE: f64 = 64.0;

/// Frames whose steps a surface makes up for when frames had no time to let it grow or to paint it. All of a crack gets wider at each step: to
/// paint many steps at once costs half as much as to paint each, but is seen to jump.
const MAX_LATE: f64 = 4.0;

/// Markers that are settled between two looks at the frame's clock.
pub(crate) const SLICE: u32 = 8192;

/// Nodes that grow between two looks at it.
const NODES: u32 = 128;

/// The most steps a second that baked cracks appear in.
const MOST_STEPS: f64 = 1e6;

/// What rules the time of a surface.
enum Ruler {
    /// Nothing: the end is shown.
    Pace,
    Speed(f64),
    Value(f64),
    Closing(f64),
    Appearing(f64),
}

impl Active {
    fn ruler(&self) -> Ruler {
        match (self.playhead.closing, self.playhead.clock) {
            _ if self.playhead.playback.is_none() => Ruler::Pace,
            (Some(rate), _) => Ruler::Closing(rate),
            (None, Some(CrackClock { paused: true, .. })) => Ruler::Speed(0.0),
            (None, Some(CrackClock { drive: CrackDrive::Speed(speed), .. })) => Ruler::Speed(f64::from(speed)),
            (None, Some(CrackClock { drive: CrackDrive::Value(value), .. })) if value.is_nan() => Ruler::Speed(0.0),
            (None, Some(CrackClock { drive: CrackDrive::Value(value), .. })) => {
                Ruler::Value(f64::from(value.clamp(0.0, 1.0)))
            }
            // The clock is gone: on to the end.
            (None, None) => self.playhead.appearing.map_or(Ruler::Speed(1.0), Ruler::Appearing),
        }
    }

    /// The step after which all is shown.
    fn end(&self) -> f64 {
        f64::from(self.cracks.growth.timeline().end())
    }

    /// The moment to show.
    pub(crate) fn moment(&self) -> Moment {
        match (&self.playhead.playback, self.ruler()) {
            (Some(_), Ruler::Value(value)) => Moment::nearest(value * self.end()),
            (Some(playback), _) => Moment::nearest(playback.want.min(self.end())),
            (None, _) => Moment::after(self.cracks.growth.timeline().end()),
        }
    }

    /// The moment that is shown.
    pub(crate) fn shown(&self) -> Moment {
        self.playhead
            .playback
            .as_ref()
            .map_or(Moment::after(self.cracks.growth.timeline().end()), |playback| playback.shown)
    }

    /// Whether another moment is shown.
    pub(crate) fn is_behind(&self) -> bool {
        self.playhead.playback.as_ref().is_some_and(|playback| playback.shown != self.moment())
    }

    /// Whether growth has ended and all of it is shown, what was crushed with it.
    pub(crate) fn is_complete(&self) -> bool {
        let end = Moment::after(self.cracks.growth.timeline().end());
        let is_shown = self.playhead.playback.as_ref().is_none_or(|playback| playback.shown == end);
        !self.cracks.growth.is_growing() && is_shown && !self.turn.is_stamping && !self.drawing.field.is_behind()
    }

    /// Lets time pass.
    pub(crate) fn pass(&mut self, seconds: f32) {
        let steps = f64::from(if self.playhead.rate.is_finite() { self.playhead.rate.max(0.0) * seconds } else { 0.0 });
        let (ruler, end, is_growing) = (self.ruler(), self.end(), self.cracks.growth.is_growing());
        // What earlier frames had no time for is made up for a little.
        let is_late = self.turn.is_late;
        let most = |is_left: bool, steps: f64| if is_late || is_left { MAX_LATE * steps } else { MAX_DUE };
        match (ruler, &mut self.playhead.playback) {
            (Ruler::Closing(rate), Some(playback)) => playback.advance(-rate * f64::from(seconds), end, MAX_DUE),
            (Ruler::Appearing(rate), Some(playback)) => playback.advance(rate * f64::from(seconds), end, MAX_DUE),
            (Ruler::Speed(speed), Some(playback)) => {
                let steps = speed * steps;
                playback.advance(steps, end, most(playback.want > end, steps));
            }
            _ => {
                let due = (self.playhead.due + steps).min(most(self.playhead.due >= 1.0, steps));
                self.playhead.due = self.playhead.due.max(due).min(MAX_DUE);
            }
        }
        if let Some(playback) = &mut self.playhead.playback
            && !is_growing
        {
            // The next hit is not to make up for time that led nowhere.
            playback.want = playback.want.min(end);
        }
    }

    /// Whether a step of growth is due, or under way.
    pub(crate) fn is_due(&self) -> bool {
        let is_due = match (self.ruler(), &self.playhead.playback) {
            (Ruler::Speed(_) | Ruler::Appearing(_), Some(playback)) => playback.want > self.end(),
            (Ruler::Closing(_), _) => false,
            _ => self.playhead.due >= 1.0,
        };
        let is_free = !self.turn.is_laying_out && !self.turn.is_held && self.freezing.is_none();
        is_free && (is_due && self.cracks.growth.is_growing() || self.cracks.growth.is_in_step())
    }

    /// Makes a step of growth if one is due and its preparations are done, which may need more than one turn: markers of the last hits are
    /// settled, more strands of them are laid out. What there is no time for is left to the next turn. Returns whether all of a step was made.
    pub(crate) fn step_if_due(&mut self, is_over: impl Fn() -> bool) -> bool {
        if !self.is_due() {
            return false;
        }
        if !self.cracks.growth.is_in_step() {
            if !self.cracks.growth.prepare_step(SLICE) {
                return false;
            }
            self.playhead.due = (self.playhead.due - 1.0).max(0.0);
        }
        // A playback shows whole steps.
        let nodes = if self.playhead.playback.is_none() { NODES } else { u32::MAX };
        while self.cracks.growth.continue_step(nodes).is_none() {
            if is_over() {
                return false;
            }
        }
        true
    }

    /// Whether nothing more happens by itself.
    pub(crate) fn is_at_rest(&self) -> bool {
        let (is_growing, want) =
            (self.cracks.growth.is_growing(), self.playhead.playback.as_ref().map_or(0.0, |p| p.want));
        match self.ruler() {
            Ruler::Pace | Ruler::Value(_) => !is_growing,
            Ruler::Speed(speed) if speed > 0.0 => !is_growing && want >= self.end(),
            Ruler::Speed(speed) if speed < 0.0 => want <= 0.0,
            Ruler::Speed(_) => !is_growing || want <= self.end(),
            Ruler::Closing(_) => want <= 0.0,
            Ruler::Appearing(_) => !is_growing && want >= self.end(),
        }
    }

    /// Whether it has closed and is to be healed.
    pub(crate) fn has_closed(&self) -> bool {
        self.playhead.closing.is_some() && self.is_at_rest()
    }

    /// All of its cracks will be drawn in another way.
    fn stop_stamping(&mut self) {
        if core::mem::take(&mut self.turn.is_stamping) {
            self.cracks.cells.update(self.cracks.growth.network());
        }
    }

    /// Makes times other than the end possible.
    fn open_playback(&mut self) -> &mut Playback {
        let has_drawn_all = !self.cracks.growth.is_in_step();
        self.cracks.growth.finish_step();
        self.stop_stamping();
        if self.drawing.frozen.take().is_some() {
            stamp_anew(self);
            self.mark_all();
        }
        let (size, profile, end) =
            (self.drawing.field.frame.size(), self.drawing.profile, self.cracks.growth.timeline().end());
        self.playhead.playback.get_or_insert_with(|| Playback {
            // A growth without steps has left no trace yet.
            replay: if end == 0 { Replay::new(size, profile) } else { Replay::stale(size, profile) },
            want: f64::from(end),
            shown: if has_drawn_all { Moment::after(end) } else { Moment::START },
        })
    }

    /// Goes by `clock` from now on, jumping if it says so.
    pub(crate) fn follow(&mut self, clock: &mut CrackClock) {
        self.stand_still();
        let jump = clock.seek.take().filter(|steps| !steps.is_nan());
        self.playhead.clock = Some(*clock);
        let playback = self.open_playback();
        if let Some(steps) = jump {
            playback.want = f64::from(steps.max(0.0));
        }
    }

    /// Goes by no clock from now on.
    pub(crate) fn unfollow(&mut self) {
        self.stand_still();
        self.playhead.clock = None;
    }

    /// What a value from outside has shown is where time goes on when it no longer rules.
    fn stand_still(&mut self) {
        let steps = self.moment().steps();
        if let (Ruler::Value(_), Some(playback)) = (self.ruler(), &mut self.playhead.playback) {
            playback.want = steps;
        }
    }

    /// Closes the cracks within `seconds`; `false` if that is at once.
    pub(crate) fn close(&mut self, seconds: f32) -> bool {
        let steps = self.moment().steps();
        if steps <= 0.0 || seconds.is_nan() || seconds <= 0.0 {
            return false;
        }
        self.open_playback().want = steps;
        self.playhead.closing = Some(steps / f64::from(seconds));
        true
    }

    /// Shows a network that has taken the place of another, as it was made to be shown `first`: without a clock, and with
    /// `seconds`, it appears within them. Returns the playback of the other one.
    pub(crate) fn show_made(&mut self, replay: Option<(Replay, Moment)>, seconds: Option<f32>) -> Option<Playback> {
        self.stop_stamping();
        self.playhead.closing = None;
        self.drawing.frozen = None;
        self.playhead.appearing = seconds.map(|seconds| (self.end() / f64::from(seconds)).min(MOST_STEPS));
        let want = if self.playhead.clock.is_some() {
            self.playhead.playback.as_ref().map_or(0.0, |playback| playback.want)
        } else {
            0.0
        };
        core::mem::replace(&mut self.playhead.playback, replay.map(|(replay, shown)| Playback { replay, want, shown }))
    }

    /// What has happened to it; `None` if that is too much to be kept.
    pub(crate) fn record(&self) -> Option<CrackRecord> {
        let past = self.cracks.growth.past()?;
        let time = self.playhead.playback.as_ref().map_or(self.end() + self.playhead.due, |playback| playback.want);
        let around = self.carrier.unfolding.as_ref().map(|unfolding| unfolding.around);
        Some(CrackRecord { version: CrackRecord::VERSION, seed: self.surface.seed, past, time, around })
    }

    /// Goes on where `record` ends, on cracks that were grown from it and show the picture of those that were removed.
    pub(crate) fn resume(&mut self, record: Option<&CrackRecord>, frozen: Option<Frozen>) {
        if self.playhead.playback.is_none() {
            self.drawing.frozen = frozen;
        }
        let Some(record) = record else { return };
        let end = self.end();
        match &mut self.playhead.playback {
            Some(playback) => playback.want = record.time,
            None => self.playhead.due += (record.time - end).clamp(0.0, MAX_DUE),
        }
        self.cracks.hits = self.cracks.hits.saturating_add(record.hits().count() as u32);
        if self.cracks.last_hit.is_none() {
            let hit = |(pos, energy)| LastHit { pos, energy, direction: Vec3::ZERO };
            self.cracks.last_hit = record.hits().next_back().map(hit);
        }
    }

    /// What a network is to show first that takes the place of this one.
    pub(crate) fn first(&self, seconds: Option<f32>) -> First {
        First::of(self.playhead.clock, self.playhead.playback.as_ref().map_or(0.0, |playback| playback.want), seconds)
    }

    /// A hit: time runs forwards again. Returns the clock that it goes by if that has changed.
    pub(crate) fn turn_forwards(&mut self) -> Option<CrackClock> {
        self.playhead.closing = None;
        let clock = self.playhead.clock.as_mut()?;
        let CrackDrive::Speed(speed) = &mut clock.drive else { return None };
        if *speed >= 0.0 || speed.is_nan() {
            return None;
        }
        *speed = -*speed;
        Some(*clock)
    }

    /// Without a clock, nothing needs the playback once the end is shown.
    pub(crate) fn close_playback(&mut self) {
        let end = Moment::after(self.cracks.growth.timeline().end());
        if let Some(playback) = &self.playhead.playback
            && self.playhead.clock.is_none()
            && self.playhead.closing.is_none()
            && playback.shown == end
        {
            self.playhead.due = (playback.want - end.steps()).clamp(0.0, MAX_DUE);
            self.playhead.playback = None;
            self.playhead.appearing = None;
            // All of it is in the field.
            self.cracks.growth.take_changed(&mut Vec::new());
            self.cracks.growth.take_markers(&mut Vec::new());
        }
    }
}

/// What a network shows first that is made by a background task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum First {
    /// All of it, for good.
    End,
    /// So many steps.
    Steps(f64),
    /// This share of its steps.
    Share(f64),
}

impl First {
    /// Under a clock that shows `steps`; without one it appears if there are `seconds`.
    pub(crate) fn of(clock: Option<CrackClock>, steps: f64, seconds: Option<f32>) -> Self {
        match clock {
            Some(CrackClock { drive: CrackDrive::Value(value), paused: false, .. }) if !value.is_nan() => {
                Self::Share(f64::from(value.clamp(0.0, 1.0)))
            }
            Some(clock) => {
                Self::Steps(clock.seek.filter(|seek| !seek.is_nan()).map_or(steps, |s| f64::from(s.max(0.0))))
            }
            None if seconds.is_some() => Self::Steps(0.0),
            None => Self::End,
        }
    }

    /// The moment that it is in a network of so many steps; `None` = the end, for good.
    pub(crate) fn moment(self, end: u32) -> Option<Moment> {
        match self {
            Self::End => None,
            Self::Steps(steps) => Some(Moment::nearest(steps.min(f64::from(end)))),
            Self::Share(share) => Some(Moment::nearest(share * f64::from(end))),
        }
    }
}
