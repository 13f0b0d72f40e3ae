//! [`LookError`]: a field of a look that is out of its range.

use std::ops::RangeInclusive;

/// A field of a [`Look`](super::Look) that is out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LookError {
    /// A number is outside its range, or not finite.
    #[error("look field `{field}` is {value}, must lie in {range}")]
    OutOfRange {
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: f32,
        /// The allowed range.
        range: &'static str,
    },
}

pub(super) fn within(
    field: &'static str,
    value: f32,
    allowed: RangeInclusive<f32>,
    range: &'static str,
) -> Result<(), LookError> {
    if allowed.contains(&value) { Ok(()) } else { Err(LookError::OutOfRange { field, value, range }) }
}
