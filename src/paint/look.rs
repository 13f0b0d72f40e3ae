//! [`Look`]: what a crack does to the picture, as data.

use std::borrow::Cow;

/// A point of a [`Look`]'s ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ColorStop {
    /// Depth at which it holds, 0..=1.
    pub depth: f32,
    /// Colour, sRGB 0..=1.
    pub color: [f32; 3],
    /// How much it covers the picture, 0..=1.
    pub cover: f32,
}

/// What a crack does to the picture.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Look {
    /// Colour over depth, in order of depth, at most 16 stops; linear between, nothing at depth 0.
    pub ramp: Cow<'static, [ColorStop]>,
    /// How much walls that face the light (from the upper left) brighten and the others darken. 0..=4.
    pub glint: f32,
    /// How uneven the cover is from texel to texel (frosted glass). 0..=1.
    pub grain: f32,
    /// Shift of the picture where the surface is tilted by the crack (refraction), texels at the steepest. 0..=16.
    pub shift: f32,
    /// Height of the walls in the normal map: depth 1 is this many pattern units deep. 0..=1.
    pub relief: f32,
    /// Whether cracks make a translucent picture opaque (glass panes). Fully transparent texels stay so.
    pub opaque: bool,
}

impl Look {
    /// A dark groove: concrete, clay, plaster.
    pub const GROOVE: Self = Self {
        ramp: Cow::Borrowed(&[
            ColorStop { depth: 0.15, color: [0.1, 0.09, 0.08], cover: 0.2 },
            ColorStop { depth: 0.6, color: [0.05, 0.045, 0.04], cover: 0.9 },
            ColorStop { depth: 1.0, color: [0.02, 0.02, 0.02], cover: 1.0 },
        ]),
        glint: 0.5,
        grain: 0.2,
        shift: 0.0,
        relief: 0.02,
        opaque: false,
    };
}

impl Default for Look {
    fn default() -> Self {
        Self::GROOVE
    }
}

/// A field of a [`Look`] out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LookError {
    /// A number outside its range.
    #[error("look field `{field}` is {value}, must lie in {range}")]
    OutOfRange {
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: f32,
        /// What is allowed.
        range: &'static str,
    },
}

/// A [`Look`] made ready to paint with.
#[derive(Clone, Debug, PartialEq)]
pub struct LookTable {}

impl LookTable {
    /// Tables for `look`; `texels_per_unit` as in [`SurfaceFrame`](crate::pattern::SurfaceFrame).
    ///
    /// # Errors
    /// If a field is out of its range or not finite.
    pub fn new(_look: &Look, _texels_per_unit: f32) -> Result<Self, LookError> {
        todo!()
    }
}
