//! [`PresetError`], and the allowed values of a preset's fields.

use super::CrackPreset;
use crate::{growth::ParamError, paint::LookError};
use std::ops::RangeInclusive;

/// The largest preset file, bytes.
pub(super) const MAX_FILE: usize = 1 << 20;

/// An error in a preset or its file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PresetError {
    /// A number is outside its range, or not finite.
    #[error("`{field}` is {}, must lie in {range}", plain(*value))]
    OutOfRange {
        /// Full name of the field, as in `growth.kill_distance`.
        field: String,
        /// Its value.
        value: f64,
        /// The allowed range.
        range: String,
    },
    /// A part of the preset has a value that it cannot have.
    #[error("`{section}`: {reason}")]
    Field {
        /// The part of the preset, as in `growth`.
        section: &'static str,
        /// Which field, and why.
        reason: String,
    },
    /// The file is not valid RON, or not a preset.
    #[error("line {line}, column {column}: {reason}")]
    Unreadable {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was found there.
        reason: String,
    },
    /// The file's `base` is not the name of a preset.
    #[error("`base`: there is no preset `{name}`; there are {}", CrackPreset::NAMES.join(", "))]
    UnknownBase {
        /// The name asked for.
        name: String,
    },
    /// The file is larger than [`CrackPreset::MAX_FILE`].
    #[error("a preset of {bytes} bytes or more: the most is {}", MAX_FILE)]
    TooLarge {
        /// Bytes read.
        bytes: usize,
    },
}

/// Formats a number as it was written: most come from single precision.
fn plain(value: f64) -> String {
    let single = value as f32;
    if f64::from(single) == value { single.to_string() } else { value.to_string() }
}

impl CrackPreset {
    /// Checks every field.
    ///
    /// ```
    /// use bevy_crack::CrackPreset;
    ///
    /// let mut preset = CrackPreset::GLASS;
    /// preset.growth.kill_distance = -1.0;
    /// let error = preset.validate().unwrap_err();
    /// assert!(error.to_string().starts_with("`growth.kill_distance` is -1, must lie in 0.0005..="));
    /// ```
    ///
    /// # Errors
    /// [`PresetError::OutOfRange`] for the first field that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), PresetError> {
        self.growth.validate().map_err(growth_error)?;
        let profile = &self.profile;
        for (name, value, range) in [
            ("profile.depth", profile.depth, 0.0..=1.0),
            ("profile.full_width", profile.full_width, 0.0001..=1.0),
            ("profile.wall", profile.wall, 0.0..=1.0),
            ("profile.rim_width", profile.rim_width, 0.0..=0.2),
            ("profile.rim_depth", profile.rim_depth, 0.0..=1.0),
            ("profile.faintest", profile.faintest, 0.0..=1.0),
            ("profile.ragged", profile.ragged, 0.0..=0.05),
            ("profile.chipped", profile.chipped, 0.0..=0.05),
            ("profile.rubble", profile.rubble, 0.0..=1.0),
            ("profile.edge", profile.edge, 0.0..=1.0),
            ("steps_per_second", self.steps_per_second, 0.0..=10_000.0),
        ] {
            within(name, value, &range)?;
        }
        self.look.validate().map_err(|error| match error {
            LookError::OutOfRange { field, value, range } => {
                PresetError::OutOfRange { field: format!("look.{field}"), value: value.into(), range: range.into() }
            }
        })
    }
}

/// Converts an error of the growth parameters. They use the names of
/// [`GrowthParams::set`](crate::growth::GrowthParams::set) for the fields of layouts; a preset uses longer names.
fn growth_error(error: ParamError) -> PresetError {
    match error {
        ParamError::OutOfRange { name, value, min, max } => {
            let field = match name {
                "occupancy" | "jitter" | "spacing" | "sectors" | "through" => {
                    format!("growth.markers.{name}")
                }
                name if name.starts_with("strands.") => format!("growth.markers.{name}"),
                "strand_count" => "growth.markers.count".into(),
                "start_count" => "growth.starts.count".into(),
                "start_radius" => "growth.starts.radius".into(),
                _ => format!("growth.{name}"),
            };
            PresetError::OutOfRange { field, value, range: format!("{}..={}", plain(min), plain(max)) }
        }
        error => PresetError::Field { section: "growth", reason: error.to_string() },
    }
}

fn within(field: &str, value: f32, range: &RangeInclusive<f32>) -> Result<(), PresetError> {
    if range.contains(&value) {
        return Ok(());
    }
    let range = format!("{}..={}", range.start(), range.end());
    Err(PresetError::OutOfRange { field: field.into(), value: value.into(), range })
}
