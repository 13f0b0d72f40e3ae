//! Cracks as drawn with ink: [`Cel`].

use super::range::{LookError, within};
use crate::raster::{PIT_STEPS, noise as smooth_noise};

/// Cracks drawn as in a cartoon: flat colours with hard edges, instead of the [`ramp`](super::Look::ramp).
///
/// A line of ink runs along the inside of the edge. Where a crack is too narrow for more than ink it is all ink, so
/// it ends in a point of ink. Further inside is the fill colour, and on the wall that faces the light (from the upper
/// left) a band of a lighter colour. It is made for a profile with [even walls](crate::raster::Profile::even_walls).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Cel {
    /// Distance from the edge at which the depth is 1: half of the profile's
    /// [`full_width`](crate::raster::Profile::full_width). Pattern units, 0.0001..=0.5; default 0.04.
    pub wide: f32,
    /// Width of the ink line along the edge, pattern units, 0..=0.1; default 0.0035.
    pub outline: f32,
    /// Distance from the edge at which the lit wall ends, pattern units, 0..=0.5; default 0.012.
    pub wall: f32,
    /// How far the floor of a crack is moved towards the light, as a share of its half width, up to
    /// [`wall`](Self::wall). The lit wall is the part that the floor does not cover: it ends in a point where the
    /// crack turns, and each straight side has one tone. 0..=1; default 0 = a band as wide as the wall along every
    /// edge that faces the light. A look with a [veil](super::Look::veil) always has the band.
    pub slant: f32,
    /// Colour of the ink line, sRGB 0..=1; default a warm black.
    pub ink: [f32; 3],
    /// Colour of the inside, sRGB 0..=1; default a dark brown.
    pub fill: [f32; 3],
    /// Colour of the lit wall, sRGB 0..=1; default a lighter brown.
    pub lit: [f32; 3],
}

impl Cel {
    /// The default: warm black and browns.
    pub const DEFAULT: Self = Self {
        wide: 0.04,
        outline: 0.0035,
        wall: 0.012,
        slant: 0.0,
        ink: [0.075, 0.05, 0.055],
        fill: [0.16, 0.105, 0.10],
        lit: [0.46, 0.31, 0.24],
    };

    /// The same drawing at another scale: every length times `by`.
    pub(crate) fn scaled(&self, by: f32) -> Self {
        let scaled = |length: f32, low: f32, high: f32| (length * by).clamp(low, high);
        Self {
            wide: scaled(self.wide, 0.0001, 0.5),
            outline: scaled(self.outline, 0.0, 0.1),
            wall: scaled(self.wall, 0.0, 0.5),
            ..*self
        }
    }

    pub(super) fn validate(&self) -> Result<(), LookError> {
        within("cel.wide", self.wide, 0.0001..=0.5, "0.0001..=0.5")?;
        within("cel.outline", self.outline, 0.0..=0.1, "0..=0.1")?;
        within("cel.wall", self.wall, 0.0..=0.5, "0..=0.5")?;
        within("cel.slant", self.slant, 0.0..=1.0, "0..=1")?;
        for (field, color) in [("cel.ink", self.ink), ("cel.fill", self.fill), ("cel.lit", self.lit)] {
            for channel in color {
                within(field, channel, 0.0..=1.0, "0..=1")?;
            }
        }
        Ok(())
    }
}

impl Default for Cel {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A [`Cel`] with lengths in texels and colours in 0..=255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Strokes {
    /// Distance from the edge for one step of depth, texels.
    step: f32,
    outline: f32,
    wall: f32,
    /// Whether the lit wall is the part that the floor does not cover.
    pub(super) has_floor: bool,
    /// Bumps of the outline per texel.
    wobble: f32,
    ink: [f32; 3],
    fill: [f32; 3],
    lit: [f32; 3],
}

/// Bumps of an outline's width per pattern unit, and how much the width varies.
const WOBBLES: f32 = 13.0;

const WOBBLE: f32 = 0.35;

/// A wall is lit if the cosine of its angle to the light is above this.
const LIT: f32 = 0.2;

impl Strokes {
    pub(super) fn new(cel: &Cel, texels_per_unit: f32) -> Self {
        let [ink, fill, lit] = [cel.ink, cel.fill, cel.lit].map(|color| color.map(|channel| 255.0 * channel));
        Self {
            step: cel.wide * texels_per_unit * (1.0 / 65535.0),
            outline: (cel.outline * texels_per_unit).max(1.0),
            wall: cel.wall * texels_per_unit,
            has_floor: cel.slant > 0.0,
            wobble: WOBBLES / texels_per_unit,
            ink,
            fill,
            lit,
        }
    }

    /// The colour over the picture at a depth and slope: three channels times cover, and the cover.
    #[inline(always)]
    pub(super) fn layer(&self, depth: u16, [x, y]: [f32; 2]) -> [f32; 4] {
        let share = |value: f32| value.clamp(0.0, 1.0);
        // All edges are one texel wide.
        let inside = f32::from(depth) * self.step;
        let cover = share(inside);
        let open = share(inside - self.outline);
        let steep = (x * x + y * y).sqrt();
        let facing = if steep > 1.0e-6 { -std::f32::consts::FRAC_1_SQRT_2 * (x + y) / steep } else { 0.0 };
        let lit = share(8.0 * (facing - LIT) + 0.5) * share(self.wall - inside + 0.5);
        let color = |c: usize| {
            let within = self.fill[c] + (self.lit[c] - self.fill[c]) * lit;
            (self.ink[c] + (within - self.ink[c]) * open) * cover
        };
        [color(0), color(1), color(2), cover]
    }
}

impl Strokes {
    /// Like [`layer`](Self::layer), at a texel with a floor of the given cover and a pit.
    #[inline(always)]
    pub(super) fn layer_over(&self, depth: u16, [x, y]: [f32; 2], floor: u8, pit: [u8; 3], at: [f32; 2]) -> [f32; 4] {
        let share = |value: f32| value.clamp(0.0, 1.0);
        let (crack, hollow) = (f32::from(depth) * self.step, f32::from(pit[0]) * (1.0 / PIT_STEPS));
        let inside = crack.max(hollow);
        let cover = share(inside);
        let bold = self.outline * (1.0 + WOBBLE * smooth_noise(0x1A4, at[0] * self.wobble, at[1] * self.wobble));
        let open = share(inside - bold);
        let steep = (x * x + y * y).sqrt();
        let facing = if steep > 1.0e-6 { -std::f32::consts::FRAC_1_SQRT_2 * (x + y) / steep } else { 0.0 };
        let facing = if hollow > crack { f32::from(pit[2]) * (2.0 / 255.0) - 1.0 } else { facing };
        let floor = f32::from(floor.max(pit[1])) * (1.0 / 255.0);
        // Flat tones: one per straight side.
        let least = if hollow > crack { 0.15 } else { 0.0 };
        let lit = (0.22 + 0.9 * facing).clamp(least, 1.0) * (1.0 - floor);
        let color = |c: usize| {
            let within = self.fill[c] + (self.lit[c] - self.fill[c]) * lit;
            (self.ink[c] + (within - self.ink[c]) * open) * cover
        };
        [color(0), color(1), color(2), cover]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_cracks_end_in_ink_and_one_wall_is_lit() {
        let cel = Cel { wide: 0.1, outline: 0.004, wall: 0.02, ..Cel::DEFAULT };
        // 50 texels of depth, an outline of 2, a lit wall up to 10.
        let strokes = Strokes::new(&cel, 500.0);
        let at = |texels: f32, slope: [f32; 2]| strokes.layer((texels / 50.0 * 65535.0) as u16, slope);
        let close = |got: [f32; 4], color: [f32; 3], cover: f32| {
            let want = [color[0], color[1], color[2]].map(|channel| 255.0 * channel * cover);
            (0..3).all(|c| (got[c] - want[c]).abs() < 0.1) && (got[3] - cover).abs() < 1.0e-3
        };
        let (to_light, off_light) = ([-1.0, -1.0], [1.0, 1.0]);
        assert_eq!(at(0.0, to_light), [0.0; 4]);
        assert!(close(at(0.5, to_light), cel.ink, 0.5), "half a texel of edge is half covered");
        assert!(close(at(1.9, to_light), cel.ink, 1.0), "a needle is all ink");
        assert!(close(at(5.0, to_light), cel.lit, 1.0), "the wall that faces the light");
        assert!(close(at(5.0, off_light), cel.fill, 1.0), "the other wall");
        assert!(close(at(20.0, to_light), cel.fill, 1.0), "further inside");
    }

    #[test]
    fn what_a_floor_leaves_open_is_lit() {
        let cel = Cel { wide: 0.1, outline: 0.002, wall: 0.02, slant: 0.8, ..Cel::DEFAULT };
        let strokes = Strokes::new(&cel, 500.0);
        let at = |slope: [f32; 2], floor: u8, pit: [u8; 3]| strokes.layer_over(20_000, slope, floor, pit, [3.0, 4.0]);
        let (to_light, off_light) = ([-1.0, -1.0], [1.0, 1.0]);
        let bright = |got: [f32; 4]| got[0] + got[1] + got[2];
        let fill = 255.0 * (cel.fill[0] + cel.fill[1] + cel.fill[2]);
        assert!((bright(at(to_light, 255, [0; 3])) - fill).abs() < 0.1, "the floor");
        assert!((bright(at(off_light, 0, [0; 3])) - fill).abs() < 0.1, "the wall in the shade");
        assert!(bright(at(to_light, 0, [0; 3])) > 2.0 * fill, "the lit wall");
        // A pit that is deeper than the crack has walls of its own.
        assert!(bright(at(off_light, 0, [255, 0, 255])) > 2.0 * fill);
        assert_eq!(strokes.layer_over(0, to_light, 0, [0; 3], [0.0; 2]), [0.0; 4]);
    }
}
