//! [`CrackClock`]: the time of a surface's cracks.

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
///
/// // Twice as fast and backwards; the same, but it waits at the end of the third step.
/// let backwards = CrackClock::speed(-2.0);
/// assert_eq!((backwards.drive, backwards.paused), (CrackDrive::Speed(-2.0), false));
/// let waiting = CrackClock { paused: true, seek: Some(3.0), ..backwards };
/// # let _ = waiting;
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default)]
pub struct CrackClock {
    /// What makes time pass. Default: as without a clock, [`CrackDrive::Speed`] of 1.
    pub drive: CrackDrive,
    /// Whether time stands still. Growth stands still as well then. Default false.
    pub paused: bool,
    /// Where time is to jump to, steps, also when paused; `None` (default) again when it has. What lies beyond the end is grown as fast as the
    /// budget allows until the cracks come to their end: infinity jumps there. Not a number = no jump. A
    /// [`CrackDrive::Value`] that is not paused has the last word.
    pub seek: Option<f32>,
}

/// What makes time pass for the cracks of a surface.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
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
