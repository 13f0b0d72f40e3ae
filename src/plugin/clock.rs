//! [`CrackClock`]: the time of a surface's cracks.

use super::{
    CrackTextures,
    paint::stamp_anew,
    surfaces::{Active, Surfaces},
};
use crate::{
    pattern::{Moment, SurfaceFrame},
    raster::{Profile, Replay, TexelRect},
};
use bevy::prelude::*;

/// How time passes for the cracks of a surface; without one they grow at the preset's pace and stay.
///
/// Cracks grow in steps. What is shown is the network as it was at a time between 0 (untouched) and the number of steps made so
/// far ([`CrackState::time`](super::CrackState::time) and [`end`](super::CrackState::end)), with fractions: a young segment is as
/// long, and a width as far on its way, as the step is over. Nothing is grown twice, whichever way time goes.
///
/// A hit adds steps at the end of time and makes a clock that runs backwards run forwards, from where it is; nothing jumps.
/// Removing the clock lets time run on to the end.
///
/// The cracks of [`GuidedCracks`](super::GuidedCracks) are shown a frame or a few later than their time, see
/// [`GuidedAppearance`](super::GuidedAppearance).
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// #[derive(Component)]
/// struct Health(f32);
///
/// /// The lower the health, the more of the cracks is shown.
/// fn show_damage(mut walls: Query<(&Health, &mut CrackClock)>) {
///     for (health, mut clock) in &mut walls {
///         clock.set_if_neq(CrackClock::value(1.0 - health.0));
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default)]
pub struct CrackClock {
    /// What makes time pass.
    pub drive: CrackDrive,
    /// Whether time stands still. Growth stands still as well then.
    pub paused: bool,
    /// Where time is to jump to, steps, also when paused; `None` again when it has. What lies beyond the end is grown as fast as the
    /// budget allows until the cracks come to their end: infinity jumps there. Not a number = no jump. A
    /// [`CrackDrive::Value`] that is not paused has the last word.
    pub seek: Option<f32>,
}

/// What makes time pass for the cracks of a surface.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default)]
pub enum CrackDrive {
    /// Seconds of the app's [`Time`], at this many times the preset's
    /// [`steps_per_second`](crate::CrackPreset::steps_per_second): 1 = as without a clock, 0 = it stands still, below zero it runs
    /// backwards and stops at the start. Steps are grown when their time comes. Not a number = 0; infinite = as fast as the budget allows.
    Speed(f32),
    /// A value from outside, say health, music or a slider: this share of all steps made so far is shown, 0..=1. Hits go on
    /// growing at the preset's pace, shown or not. Not a number = as before.
    Value(f32),
}

impl Default for CrackDrive {
    fn default() -> Self {
        Self::Speed(1.0)
    }
}

impl CrackClock {
    /// A clock that runs by itself, see [`CrackDrive::Speed`].
    #[must_use]
    pub const fn speed(speed: f32) -> Self {
        Self { drive: CrackDrive::Speed(speed), paused: false, seek: None }
    }

    /// A clock set from outside, see [`CrackDrive::Value`].
    #[must_use]
    pub const fn value(value: f32) -> Self {
        Self { drive: CrackDrive::Value(value), paused: false, seek: None }
    }
}

/// The most steps that can be due: after a long pause a surface does not make up for all of it.
const MAX_DUE: f64 = 64.0;

/// Frames whose steps a surface makes up for when frames had no time to let it grow or to paint it. All of a crack gets wider at each step: to
/// paint many steps at once costs half as much as to paint each, but is seen to jump.
const MAX_LATE: f64 = 4.0;

/// Markers that are taken up between two looks at the frame's clock.
pub(super) const SLICE: u32 = 8192;

/// The most steps a second that baked cracks appear in.
const MOST_STEPS: f64 = 1e6;

/// Shows a surface's cracks at times other than the end.
pub(super) struct Playback {
    pub(super) replay: Replay,
    /// Steps to show; above the end while more are to be grown.
    want: f64,
    /// What is shown.
    pub(super) shown: Moment,
}

impl Playback {
    /// Draws the field anew, from nothing.
    pub(super) fn start_over(&mut self, frame: SurfaceFrame, profile: Profile) {
        self.replay = Replay::new(frame.size(), profile);
    }

    /// No more than `most` steps beyond the end are asked for.
    fn advance(&mut self, steps: f64, end: f64, most: f64) {
        if steps > 0.0 {
            self.want = (self.want + steps).min(self.want.max(end + most));
        } else if steps < 0.0 {
            self.want = (self.want.min(end) + steps).max(0.0);
        }
    }
}

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
        match (self.closing, self.clock) {
            _ if self.playback.is_none() => Ruler::Pace,
            (Some(rate), _) => Ruler::Closing(rate),
            (None, Some(CrackClock { paused: true, .. })) => Ruler::Speed(0.0),
            (None, Some(CrackClock { drive: CrackDrive::Speed(speed), .. })) => Ruler::Speed(f64::from(speed)),
            (None, Some(CrackClock { drive: CrackDrive::Value(value), .. })) if value.is_nan() => Ruler::Speed(0.0),
            (None, Some(CrackClock { drive: CrackDrive::Value(value), .. })) => {
                Ruler::Value(f64::from(value.clamp(0.0, 1.0)))
            }
            // The clock is gone: on to the end.
            (None, None) => self.appearing.map_or(Ruler::Speed(1.0), Ruler::Appearing),
        }
    }

    /// The step after which all is shown.
    fn end(&self) -> f64 {
        f64::from(self.growth.timeline().end())
    }

    /// The moment to show.
    pub(super) fn moment(&self) -> Moment {
        match (&self.playback, self.ruler()) {
            (Some(_), Ruler::Value(value)) => Moment::nearest(value * self.end()),
            (Some(playback), _) => Moment::nearest(playback.want.min(self.end())),
            (None, _) => Moment::after(self.growth.timeline().end()),
        }
    }

    /// The moment that is shown.
    pub(super) fn shown(&self) -> Moment {
        self.playback.as_ref().map_or(Moment::after(self.growth.timeline().end()), |playback| playback.shown)
    }

    /// Whether another moment is shown.
    pub(super) fn is_behind(&self) -> bool {
        self.playback.as_ref().is_some_and(|playback| playback.shown != self.moment())
    }

    /// Whether growth has ended and all of it is shown, what was crushed with it.
    pub(super) fn is_complete(&self) -> bool {
        let end = Moment::after(self.growth.timeline().end());
        let is_shown = self.playback.as_ref().is_none_or(|playback| playback.shown == end);
        !self.growth.is_growing() && is_shown && !self.field.is_behind()
    }

    /// Lets time pass.
    pub(super) fn pass(&mut self, seconds: f32) {
        let steps = f64::from(if self.rate.is_finite() { self.rate.max(0.0) * seconds } else { 0.0 });
        let (ruler, end, is_growing) = (self.ruler(), self.end(), self.growth.is_growing());
        // What earlier frames had no time for is made up for a little.
        let is_late = self.is_late;
        let most = |is_left: bool, steps: f64| if is_late || is_left { MAX_LATE * steps } else { MAX_DUE };
        match (ruler, &mut self.playback) {
            (Ruler::Closing(rate), Some(playback)) => playback.advance(-rate * f64::from(seconds), end, MAX_DUE),
            (Ruler::Appearing(rate), Some(playback)) => playback.advance(rate * f64::from(seconds), end, MAX_DUE),
            (Ruler::Speed(speed), Some(playback)) => {
                let steps = speed * steps;
                playback.advance(steps, end, most(playback.want > end, steps));
            }
            _ => {
                let due = (self.due + steps).min(most(self.due >= 1.0, steps));
                self.due = self.due.max(due).min(MAX_DUE);
            }
        }
        if let Some(playback) = &mut self.playback
            && !is_growing
        {
            // The next hit is not to make up for time that led nowhere.
            playback.want = playback.want.min(end);
        }
    }

    /// Whether a step of growth is due.
    pub(super) fn is_due(&self) -> bool {
        let is_due = match (self.ruler(), &self.playback) {
            (Ruler::Speed(_) | Ruler::Appearing(_), Some(playback)) => playback.want > self.end(),
            (Ruler::Closing(_), _) => false,
            _ => self.due >= 1.0,
        };
        is_due && self.growth.is_growing() && !self.growth.is_laying_out()
    }

    /// Makes a step of growth if one is due and the markers of the last hits have been taken up, which may need more than one turn.
    pub(super) fn step_if_due(&mut self) -> bool {
        if !self.is_due() || !self.growth.prepare_step(SLICE) {
            return false;
        }
        self.due = (self.due - 1.0).max(0.0);
        self.growth.step();
        true
    }

    /// Whether nothing more happens by itself.
    pub(super) fn is_at_rest(&self) -> bool {
        let (is_growing, want) = (self.growth.is_growing(), self.playback.as_ref().map_or(0.0, |p| p.want));
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
    pub(super) fn has_closed(&self) -> bool {
        self.closing.is_some() && self.is_at_rest()
    }

    /// Makes times other than the end possible.
    fn open_playback(&mut self) -> &mut Playback {
        if self.frozen.take().is_some() {
            stamp_anew(self);
            self.mark(TexelRect::whole(self.field.frame.size()));
        }
        let (size, profile, end) = (self.field.frame.size(), self.profile, self.growth.timeline().end());
        self.playback.get_or_insert_with(|| Playback {
            // A growth without steps has left no trace yet.
            replay: if end == 0 { Replay::new(size, profile) } else { Replay::over(size, profile) },
            want: f64::from(end),
            shown: Moment::after(end),
        })
    }

    /// Goes by `clock` from now on, jumping if it says so.
    pub(super) fn follow(&mut self, clock: &mut CrackClock) {
        self.stand_still();
        let jump = clock.seek.take().filter(|steps| !steps.is_nan());
        self.clock = Some(*clock);
        let playback = self.open_playback();
        if let Some(steps) = jump {
            playback.want = f64::from(steps.max(0.0));
        }
    }

    /// Goes by no clock from now on.
    pub(super) fn unfollow(&mut self) {
        self.stand_still();
        self.clock = None;
    }

    /// What a value from outside has shown is where time goes on when it no longer rules.
    fn stand_still(&mut self) {
        let steps = self.moment().steps();
        if let (Ruler::Value(_), Some(playback)) = (self.ruler(), &mut self.playback) {
            playback.want = steps;
        }
    }

    /// Closes the cracks within `seconds`; `false` if that is at once.
    pub(super) fn close(&mut self, seconds: f32) -> bool {
        let steps = self.moment().steps();
        if steps <= 0.0 || seconds.is_nan() || seconds <= 0.0 {
            return false;
        }
        self.open_playback().want = steps;
        self.closing = Some(steps / f64::from(seconds));
        true
    }

    /// Shows a network that has taken the place of another, as it was made to be shown `first`: without a clock, and with
    /// `seconds`, it appears within them. Returns the playback of the other one.
    pub(super) fn show_made(&mut self, replay: Option<(Replay, Moment)>, seconds: Option<f32>) -> Option<Playback> {
        self.closing = None;
        self.frozen = None;
        self.appearing = seconds.map(|seconds| (self.end() / f64::from(seconds)).min(MOST_STEPS));
        let want =
            if self.clock.is_some() { self.playback.as_ref().map_or(0.0, |playback| playback.want) } else { 0.0 };
        core::mem::replace(&mut self.playback, replay.map(|(replay, shown)| Playback { replay, want, shown }))
    }

    /// What a network is to show first that takes the place of this one.
    pub(super) fn first(&self, seconds: Option<f32>) -> First {
        First::of(self.clock, self.playback.as_ref().map_or(0.0, |playback| playback.want), seconds)
    }

    /// A hit: time runs forwards again. Returns the clock that it goes by if that is another one now.
    pub(super) fn turn_forwards(&mut self) -> Option<CrackClock> {
        self.closing = None;
        let clock = self.clock.as_mut()?;
        let CrackDrive::Speed(speed) = &mut clock.drive else { return None };
        if *speed >= 0.0 || speed.is_nan() {
            return None;
        }
        *speed = -*speed;
        Some(*clock)
    }

    /// Without a clock, nothing needs the playback once the end is shown.
    pub(super) fn close_playback(&mut self) {
        let end = Moment::after(self.growth.timeline().end());
        if let Some(playback) = &self.playback
            && self.clock.is_none()
            && self.closing.is_none()
            && playback.shown == end
        {
            self.due = (playback.want - end.steps()).clamp(0.0, MAX_DUE);
            self.playback = None;
            self.appearing = None;
            // All of it is in the field.
            self.growth.take_changed(&mut Vec::new());
            self.growth.take_markers(&mut Vec::new());
        }
    }
}

/// What a network shows first that is made beside the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum First {
    /// All of it, for good.
    End,
    /// So many steps.
    Steps(f64),
    /// This share of its steps.
    Share(f64),
}

impl First {
    /// Under a clock that shows `steps`; without one it appears if there are `seconds`.
    pub(super) fn of(clock: Option<CrackClock>, steps: f64, seconds: Option<f32>) -> Self {
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
    pub(super) fn moment(self, end: u32) -> Option<Moment> {
        match self {
            Self::End => None,
            Self::Steps(steps) => Some(Moment::nearest(steps.min(f64::from(end)))),
            Self::Share(share) => Some(Moment::nearest(share * f64::from(end))),
        }
    }
}

/// Takes up clocks that were set, changed or removed.
pub(super) fn follow_clocks(
    mut changed: Query<(Entity, &mut CrackClock), (Changed<CrackClock>, With<CrackTextures>)>,
    mut removed: RemovedComponents<CrackClock>,
    mut surfaces: ResMut<Surfaces>,
) {
    for entity in removed.read() {
        if let Some(active) = surfaces.active.get_mut(&entity) {
            active.unfollow();
            surfaces.wake(entity);
        }
    }
    for (entity, mut clock) in &mut changed {
        if let Some(active) = surfaces.active.get_mut(&entity) {
            let is_first = active.playback.is_none();
            active.follow(clock.bypass_change_detection());
            surfaces.wake(entity);
            surfaces.film(entity, None);
            if is_first {
                // What has grown frame by frame is drawn once more, at a stroke.
                surfaces.soil(entity);
            }
        }
    }
}
