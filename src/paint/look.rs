//! [`Look`]: what a crack does to the picture, as data.

use crate::pattern::MAX_SIDE;
use glam::Vec4;
use std::{borrow::Cow, ops::RangeInclusive};

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
    ///
    /// Below the first stop its cover falls to zero; beyond the last one nothing changes.
    pub ramp: Cow<'static, [ColorStop]>,
    /// How much walls that face the light (from the upper left) brighten and the others darken, by their slope. 0..=4.
    pub glint: f32,
    /// How uneven the cover is from texel to texel (frosted glass): up to this share of it is taken away. 0..=1.
    pub grain: f32,
    /// Shift of the picture where the surface is tilted by the crack (refraction), texels at the steepest. 0..=16.
    pub shift: f32,
    /// Height of the walls: depth 1 is this many pattern units deep. 0..=1.
    ///
    /// Makes the slopes of the normal map, and those that [`glint`](Self::glint) and [`shift`](Self::shift) go by.
    pub relief: f32,
    /// Whether cracks make a translucent picture opaque by their cover (glass panes). Fully transparent texels stay so.
    pub opaque: bool,
}

impl Look {
    /// The names that [`named`](Self::named) knows.
    pub const NAMES: [&'static str; 3] = ["groove", "frosted", "toon"];

    /// The look of this name (lower case), see [`NAMES`](Self::NAMES).
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "groove" => Some(Self::GROOVE),
            "frosted" => Some(Self::FROSTED),
            "toon" => Some(Self::TOON),
            _ => None,
        }
    }

    /// A dark groove: concrete, clay, plaster.
    pub const GROOVE: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.12, [0.30, 0.27, 0.24], 0.15),
            stop(0.45, [0.13, 0.115, 0.10], 0.75),
            stop(0.8, [0.05, 0.045, 0.04], 0.95),
            stop(1.0, [0.025, 0.022, 0.02], 1.0),
        ]),
        glint: 0.6,
        grain: 0.15,
        shift: 0.0,
        relief: 0.02,
        opaque: false,
    };

    /// Cracked glass, ice: a frosted rim, a bright edge, a thin darker core, and the picture behind shifted by the walls.
    pub const FROSTED: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.1, [0.82, 0.86, 0.87], 0.12),
            stop(0.35, [0.9, 0.94, 0.94], 0.5),
            stop(0.6, [0.97, 0.99, 0.98], 0.9),
            stop(0.82, [0.8, 0.88, 0.85], 0.85),
            stop(1.0, [0.3, 0.42, 0.38], 0.8),
        ]),
        glint: 1.0,
        grain: 0.35,
        shift: 2.0,
        relief: 0.012,
        opaque: true,
    };

    /// A drawn crack: a hard black outline with one lighter colour inside.
    pub const TOON: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.05, [0.0; 3], 0.0),
            stop(0.2, [0.0; 3], 1.0),
            stop(0.6, [0.0; 3], 1.0),
            stop(0.7, [0.45, 0.42, 0.4], 1.0),
        ]),
        glint: 0.0,
        grain: 0.0,
        shift: 0.0,
        relief: 0.02,
        opaque: true,
    };
}

/// Shortens the tables above.
const fn stop(depth: f32, color: [f32; 3], cover: f32) -> ColorStop {
    ColorStop { depth, color, cover }
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

/// The most stops that a [`Look::ramp`] has.
const MAX_STOPS: usize = 16;

/// Steps of the baked ramp: one for each value of the high byte of a depth.
const STEPS: usize = 256;

/// What a depth puts over the picture: colour times cover in 0..=255 (sRGB), and cover 0..=1.
pub(super) type Layer = Vec4;

/// A [`Look`] made ready to paint with.
#[derive(Clone, Debug, PartialEq)]
pub struct LookTable {
    /// Nothing, then the ramp at depths 0, 256, .. 65280, each with what is gained up to the next: linear between, so that slow
    /// gradients have no steps.
    ramp: Box<[[Layer; 2]; STEPS + 1]>,
    pub(super) glint: f32,
    pub(super) grain: f32,
    pub(super) shift: f32,
    /// From the Sobel sum of `u16` depths to the slope of the surface.
    pub(super) slope: f32,
    pub(super) opaque: bool,
}

impl Look {
    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), LookError> {
        let unit = "0..=1";
        within("ramp.len()", self.ramp.len() as f32, 0.0..=MAX_STOPS as f32, "0..=16")?;
        let mut above = 0.0;
        for stop in self.ramp.iter() {
            within("ramp.depth", stop.depth, above..=1.0, "0..=1, not below the stop before")?;
            above = stop.depth;
            for channel in stop.color {
                within("ramp.color", channel, 0.0..=1.0, unit)?;
            }
            within("ramp.cover", stop.cover, 0.0..=1.0, unit)?;
        }
        within("glint", self.glint, 0.0..=4.0, "0..=4")?;
        within("grain", self.grain, 0.0..=1.0, unit)?;
        within("shift", self.shift, 0.0..=16.0, "0..=16")?;
        within("relief", self.relief, 0.0..=1.0, unit)
    }

    /// Colour and cover at `depth` (0..=1); before the first stop the cover rises from zero, after the last nothing changes.
    fn at(&self, depth: f32) -> ([f32; 3], f32) {
        let Some(first) = self.ramp.first() else { return ([0.0; 3], 0.0) };
        let mut low =
            ColorStop { depth: 0.0, color: first.color, cover: if first.depth > 0.0 { 0.0 } else { first.cover } };
        for &high in self.ramp.iter() {
            if depth < high.depth {
                let t = (depth - low.depth) / (high.depth - low.depth);
                let mix = |a: f32, b: f32| a + (b - a) * t;
                let color = std::array::from_fn(|i| mix(low.color[i], high.color[i]));
                return (color, mix(low.cover, high.cover));
            }
            low = high;
        }
        (low.color, low.cover)
    }
}

pub(super) fn within(
    field: &'static str,
    value: f32,
    allowed: RangeInclusive<f32>,
    range: &'static str,
) -> Result<(), LookError> {
    if allowed.contains(&value) { Ok(()) } else { Err(LookError::OutOfRange { field, value, range }) }
}

impl LookTable {
    /// Tables for `look`; `texels_per_unit` as in [`SurfaceFrame`](crate::pattern::SurfaceFrame).
    ///
    /// # Errors
    /// If a field is out of its range or not finite.
    pub fn new(look: &Look, texels_per_unit: f32) -> Result<Self, LookError> {
        look.validate()?;
        within("texels_per_unit", texels_per_unit, f32::MIN_POSITIVE..=MAX_SIDE as f32, "above 0, up to 16384")?;
        let layer = |step: usize| {
            let (color, cover) = look.at(step as f32 / STEPS as f32);
            let [r, g, b] = color.map(|channel| 255.0 * channel * cover);
            Layer::new(r, g, b, cover)
        };
        let mut ramp = Box::new([[Layer::ZERO; 2]; STEPS + 1]);
        for (step, place) in ramp[1..].iter_mut().enumerate() {
            *place = [layer(step), layer(step + 1) - layer(step)];
        }
        // Sobel's kernel weighs a slope of one depth step per texel with 8.
        let slope = look.relief * texels_per_unit / (8.0 * 65535.0);
        let Look { glint, grain, shift, opaque, .. } = *look;
        Ok(Self { ramp, glint, grain, shift, slope, opaque })
    }

    /// What the ramp puts over the picture at `depth`, which lies so far [between](Self::between) two steps.
    #[inline(always)]
    pub(super) fn layer(&self, depth: u16, between: f32) -> Layer {
        // Depth zero lies at the first entry, without a branch.
        let [low, gain] = self.ramp[usize::from(depth >> 8) + usize::from(depth != 0)];
        low + gain * between
    }

    /// How far `depth` is from the step before it to the one after, 0..1.
    #[inline(always)]
    pub(super) fn between(depth: u16) -> f32 {
        f32::from(depth & 255) * (1.0 / 256.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(table: &LookTable, depth: u16) -> [f32; 4] {
        table.layer(depth, LookTable::between(depth)).to_array()
    }

    fn refused(look: &Look) -> Option<&'static str> {
        match LookTable::new(look, 512.0) {
            Ok(_) => None,
            Err(LookError::OutOfRange { field, .. }) => Some(field),
        }
    }

    #[test]
    fn the_constants_are_valid() {
        for look in [Look::GROOVE, Look::FROSTED, Look::TOON] {
            assert_eq!(refused(&look), None);
        }
        assert_eq!(refused(&Look { ramp: vec![].into(), ..Look::GROOVE }), None);
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        for bad in [-0.1, 17.0, f32::NAN, f32::INFINITY] {
            assert_eq!(refused(&Look { glint: bad, ..Look::GROOVE }), Some("glint"));
            assert_eq!(refused(&Look { grain: bad, ..Look::GROOVE }), Some("grain"));
            assert_eq!(refused(&Look { shift: bad, ..Look::GROOVE }), Some("shift"));
            assert_eq!(refused(&Look { relief: bad, ..Look::GROOVE }), Some("relief"));
            let ramp = |stops: &[ColorStop]| refused(&Look { ramp: stops.to_vec().into(), ..Look::GROOVE });
            assert_eq!(ramp(&[stop(bad, [0.0; 3], 0.0)]), Some("ramp.depth"));
            assert_eq!(ramp(&[stop(0.5, [0.0, bad, 0.0], 0.0)]), Some("ramp.color"));
            assert_eq!(ramp(&[stop(0.5, [0.0; 3], bad)]), Some("ramp.cover"));
            assert!(LookTable::new(&Look::GROOVE, bad.min(0.0)).is_err(), "texels per unit {bad}");
        }
        let unordered = vec![stop(0.5, [0.0; 3], 0.0), stop(0.4, [0.0; 3], 0.0)];
        assert_eq!(refused(&Look { ramp: unordered.into(), ..Look::GROOVE }), Some("ramp.depth"));
        assert_eq!(
            refused(&Look { ramp: vec![stop(0.5, [0.0; 3], 0.0); 17].into(), ..Look::GROOVE }),
            Some("ramp.len()")
        );
    }

    #[test]
    fn the_ramp_is_linear_between_its_stops() {
        let ramp = vec![stop(0.25, [1.0, 0.0, 0.0], 0.5), stop(0.75, [0.0, 0.0, 1.0], 1.0)];
        let look = Look { ramp: ramp.into(), ..Look::GROOVE };
        assert_eq!(look.at(0.125), ([1.0, 0.0, 0.0], 0.25));
        assert_eq!(look.at(0.5), ([0.5, 0.0, 0.5], 0.75));
        assert_eq!(look.at(1.0), ([0.0, 0.0, 1.0], 1.0));
        let table = LookTable::new(&look, 512.0).unwrap();
        assert_eq!(layer(&table, 0), [0.0; 4]);
        assert_eq!(layer(&table, 0x8000), [0.5 * 0.75 * 255.0, 0.0, 0.5 * 0.75 * 255.0, 0.75]);
        // Two stops at one depth are a step, and a first stop at zero covers all but depth zero itself.
        let step = vec![stop(0.0, [1.0; 3], 1.0), stop(0.5, [1.0; 3], 1.0), stop(0.5, [0.0; 3], 1.0)];
        let table = LookTable::new(&Look { ramp: step.into(), ..Look::GROOVE }, 512.0).unwrap();
        assert_eq!(layer(&table, 1)[3], 1.0);
        assert_eq!((layer(&table, 0), layer(&table, 0x8000)[0], layer(&table, 0x7F00)[0]), ([0.0; 4], 0.0, 255.0));
    }
}
