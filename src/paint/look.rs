//! [`Look`]: what a crack does to the picture, as data.

use super::patch::Curve;
use crate::{
    pattern::MAX_SIDE,
    raster::{Crushed, LayerPlan, PIT_STEPS, Veil, noise as smooth_noise},
};
use glam::Vec4;
use std::{
    borrow::Cow,
    ops::RangeInclusive,
    sync::{Arc, Mutex, PoisonError, Weak},
};

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

/// Closed cells as plates of their own: each a little darker or brighter, tilted, and reflecting in its own way.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Facets {
    /// How much darker or brighter plates are, at the most, as a share of the picture. 0..=1; default 0.1.
    pub tone: f32,
    /// Slope of the most tilted plates, in the normal map. 0..=1; default 0.1.
    pub tilt: f32,
    /// How far the picture behind a plate is moved, texels at the most. 0..=16; default 0.
    pub shift: f32,
    /// How much the brightest plates reflect: cover of [`sheen`](Self::sheen), which falls off across each. 0..=1; default 0.
    pub gleam: f32,
    /// Share of plates that flash; the others reflect a quarter of it at the most. 0..=1; default 0.1.
    pub flash: f32,
    /// Colour of what plates reflect, sRGB 0..=1; default that of a bright sky.
    pub sheen: [f32; 3],
    /// How much all of that is for plates near the hit: 0 = everywhere the same, 1 = next to nothing far away. Default 0.
    pub near: f32,
    /// How much plates are dished, with rims that curl up: darker by up to this share on the side of the light, and brighter on the other.
    /// 0..=1; default 0.
    pub dish: f32,
    /// How far from a hit of energy 1 plates fade out, so that what it has loaded ends nowhere; with the root of the energy. Pattern units, 0..=16;
    /// default 0 = they do not.
    pub fade: f32,
    /// How much neighbours have in common, so that tones and tilts come in bundles: 0 = nothing, 1 = all. 0..=1; default 0.
    pub bundle: f32,
    /// Whether plates smaller than the hole of a [crushed](Look::crushed) zone are gone as a whole if their middle lies in it, and else not at
    /// all; default no.
    pub gone: bool,
    /// How much of what they [reflect](Self::gleam) comes in broad patches of neighbours, the brightest in the middle, in place of here and there.
    /// 0..=1; default 0.
    pub sweep: f32,
    /// How thick plates are whose neighbours are [gone](Self::gone): their broken sides are seen in the hole. Pattern units, 0..=0.02; default 0.
    pub thick: f32,
    /// Colour of those sides, sRGB 0..=1; default that of the edge of a pane.
    pub side: [f32; 3],
}

impl Facets {
    /// The default: plates of slightly different tone, without reflections.
    pub const DEFAULT: Self = Self {
        tone: 0.1,
        tilt: 0.1,
        shift: 0.0,
        gleam: 0.0,
        flash: 0.1,
        sheen: [0.88, 0.94, 1.0],
        near: 0.0,
        dish: 0.0,
        fade: 0.0,
        bundle: 0.0,
        gone: false,
        sweep: 0.0,
        thick: 0.0,
        side: [0.62, 0.86, 0.78],
    };
}

impl Default for Facets {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Cracks as they are drawn in a cartoon: flat colours with hard edges, in place of the [`ramp`](Look::ramp).
///
/// Inside the edge runs a line of ink; where a crack is too narrow for more there is nothing else, so it ends in a needle of ink. Further inside is
/// the fill, and on the wall that faces the light (from the upper left) a band of a lighter colour.
/// Made for a profile with [even walls](crate::raster::Profile::even_walls).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Cel {
    /// How far inside the edge depth 1 is: half of the profile's [`full_width`](crate::raster::Profile::full_width).
    /// Pattern units, 0.0001..=0.5; default 0.04.
    pub wide: f32,
    /// Width of the line of ink along the edge, pattern units, 0..=0.1; default 0.0035.
    pub outline: f32,
    /// How far inside the edge the lit wall ends, pattern units, 0..=0.5; default 0.012.
    pub wall: f32,
    /// How far the floor of a crack is moved towards the light, as a share of its half width, up to [`wall`](Self::wall): the lit wall is what the
    /// floor leaves open, so it runs out in a point where the crack turns, and each straight side has a tone of its own. 0..=1; default 0 = a band as
    /// wide as the wall along all that faces the light. A look with a [veil](Look::veil) has the band.
    pub slant: f32,
    /// Colour of the line, sRGB 0..=1; default a warm black.
    pub ink: [f32; 3],
    /// Colour inside, sRGB 0..=1; default a dark brown.
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

    /// The same seen from nearer or further away.
    pub(crate) fn scaled(&self, by: f32) -> Self {
        let scaled = |length: f32, low: f32, high: f32| (length * by).clamp(low, high);
        Self {
            wide: scaled(self.wide, 0.0001, 0.5),
            outline: scaled(self.outline, 0.0, 0.1),
            wall: scaled(self.wall, 0.0, 0.5),
            ..*self
        }
    }

    fn validate(&self) -> Result<(), LookError> {
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

/// What a crack does to the picture.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Look {
    /// Colour over depth, in order of depth, at most 16 stops; linear between, nothing at depth 0.
    ///
    /// Below the first stop its cover falls to zero; beyond the last one nothing changes.
    pub ramp: Cow<'static, [ColorStop]>,
    /// How far colours of the ramp are shares of the picture's own: 0 = they are what they say, 1 = each is multiplied by the picture.
    /// Default 1: a crack in brown clay is brown.
    pub tint: f32,
    /// How much walls that face the light (from the upper left) brighten and the others darken, by their slope. 0..=4.
    pub glint: f32,
    /// How much of that is a highlight of the crack's own, not a share of the colour that is there (glass). 0..=4; default 0.
    pub gloss: f32,
    /// How much the cover swells and fades along the way (glass, ice): up to this share of it is taken away. 0..=1; default 0.
    pub sparkle: f32,
    /// How much less is seen of cracks that do not catch the light, by the direction in which they run and slowly along each (glass): up to this
    /// share of their depth is left out. 0..=1; default 0.
    pub catch: f32,
    /// How uneven the cover is from texel to texel (frosted glass): up to this share of it is taken away. 0..=1.
    pub grain: f32,
    /// Shift of the picture where the surface is tilted by the crack (refraction), texels at the steepest. 0..=16.
    pub shift: f32,
    /// Height of the walls: depth 1 is this many pattern units deep. 0..=1.
    ///
    /// Makes the slopes of the normal map, and those that [`glint`](Self::glint) and [`shift`](Self::shift) go by.
    pub relief: f32,
    /// How far the rims of cracks curl up, as a share of [`relief`](Self::relief): the surface is highest at depth
    /// [`curl_depth`](Self::curl_depth), and level with its surroundings at depth 0 and at twice that depth. 0..=1; default 0.
    pub curl: f32,
    /// See [`curl`](Self::curl); the profile's [`rim_depth`](crate::raster::Profile::rim_depth) as a rule. 0.001..=0.5; default 0.12.
    pub curl_depth: f32,
    /// Cracks drawn with flat colours; default none, the ramp holds.
    pub cel: Option<Cel>,
    /// Width of a crack from which on its rim is whole, pattern units; narrower ones have less of one. 0..=1; default 0 = all alike.
    pub full_rim: f32,
    /// Closed cells as plates of their own; default none.
    pub facets: Option<Facets>,
    /// What a hit crushes around it; default nothing.
    pub crushed: Option<Crushed>,
    /// Translucent sheets along cracks, to one side; default none.
    pub veil: Option<Veil>,
    /// Light that cracks give off, over depth, as [`ramp`](Self::ramp): what is written to the emissive map. Default nothing.
    pub glow: Cow<'static, [ColorStop]>,
    /// Whether cracks make a translucent picture opaque by their cover (glass panes). Fully transparent texels stay so.
    pub opaque: bool,
}

impl Look {
    /// The names that [`named`](Self::named) knows.
    pub const NAMES: [&'static str; 15] = [
        "groove",
        "frosted",
        "toon",
        "glass",
        "tempered_glass",
        "laminated_glass",
        "ice",
        "concrete",
        "plaster",
        "brick",
        "clay",
        "mud",
        "stain",
        "mirror",
        "glowing",
    ];

    /// The look of this name (lower case), see [`NAMES`](Self::NAMES).
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "groove" => Some(Self::GROOVE),
            "frosted" => Some(Self::FROSTED),
            "toon" => Some(Self::TOON),
            "glass" => Some(Self::GLASS),
            "tempered_glass" => Some(Self::TEMPERED_GLASS),
            "laminated_glass" => Some(Self::LAMINATED_GLASS),
            "ice" => Some(Self::ICE),
            "concrete" => Some(Self::CONCRETE),
            "plaster" => Some(Self::PLASTER),
            "brick" => Some(Self::BRICK),
            "clay" => Some(Self::CLAY),
            "mud" => Some(Self::MUD),
            "stain" => Some(Self::STAIN),
            "mirror" => Some(Self::MIRROR),
            "glowing" => Some(Self::GLOWING),
            _ => None,
        }
    }

    /// A groove whose walls are lit, filled with the dark of the surface's own colour: concrete, clay, plaster.
    pub const GROOVE: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.15, [0.62, 0.59, 0.56], 0.10),
            stop(0.40, [0.45, 0.41, 0.37], 0.80),
            stop(0.80, [0.31, 0.275, 0.24], 0.95),
            stop(1.0, [0.17, 0.148, 0.128], 1.0),
        ]),
        tint: 1.0,
        glint: 0.9,
        gloss: 0.0,
        grain: 0.12,
        sparkle: 0.0,
        catch: 0.0,
        shift: 0.0,
        relief: 0.012,
        curl: 0.0,
        curl_depth: 0.12,
        cel: None,
        full_rim: 0.0,
        facets: None,
        crushed: None,
        veil: None,
        glow: Cow::Borrowed(&[]),
        opaque: false,
    };

    /// Cracked glass, ice: a bright hairline with a dark companion on the side that is turned away, and the picture behind shifted by the
    /// walls.
    pub const FROSTED: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.10, [0.86, 0.91, 0.92], 0.06),
            stop(0.40, [0.93, 0.97, 0.97], 0.55),
            stop(0.75, [0.97, 0.99, 1.0], 0.85),
            stop(1.0, [0.98, 1.0, 1.0], 0.95),
        ]),
        tint: 0.0,
        glint: 0.6,
        gloss: 1.0,
        grain: 0.10,
        sparkle: 0.35,
        shift: 1.5,
        relief: 0.003,
        opaque: true,
        ..Self::GROOVE
    };

    /// What a field is to hold beside depths so that this look can show it. `seed` fixes what is random in it.
    ///
    /// ```
    /// use bevy_crack::{
    ///     CrackPreset,
    ///     growth::CrackGrowth,
    ///     pattern::{Moment, SurfaceFrame},
    ///     raster::DepthField,
    /// };
    ///
    /// let (preset, frame) = (CrackPreset::GLASS, SurfaceFrame::new([256, 256].into())?);
    /// let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), 7)?;
    /// growth.hit([0.5, 0.5].into(), 1.0);
    /// while growth.step().grew() {}
    ///
    /// let mut field = DepthField::new(frame);
    /// field.lay(preset.look.layer(7));
    /// let (timeline, mut changed) = (growth.timeline(), Vec::new());
    /// field.show_layer(growth.network(), timeline, Moment::after(timeline.end()), &mut changed);
    /// assert!(!changed.is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub const fn layer(&self, seed: u64) -> LayerPlan {
        LayerPlan {
            plates: self.facets.is_some(),
            thick: match self.facets {
                Some(facets) => facets.thick,
                None => 0.0,
            },
            crushed: self.crushed,
            veil: self.veil,
            floor: match self.cel {
                Some(cel) => [cel.slant, cel.wall],
                None => [0.0; 2],
            },
            catch: self.catch,
            full_rim: self.full_rim,
            seed,
        }
    }
}

/// Shortens tables.
pub(super) const fn stop(depth: f32, color: [f32; 3], cover: f32) -> ColorStop {
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

/// Bumps of what swells and fades along cracks, a pattern unit.
const SPARKLES: f32 = 28.0;

/// Steps of the baked ramp: one for each value of the high byte of a depth.
const STEPS: usize = 256;

/// What a depth puts over the picture: colour times cover in 0..=255 (sRGB), and cover 0..=1.
pub(super) type Layer = Vec4;

/// Nothing, then the ramp at depths 0, 256, .. 65280, each with what is gained up to the next: linear between, so that slow
/// gradients have no steps.
type Ramp = [[Layer; 2]; STEPS + 1];

/// Ramps in use, with the stops that they are made from. Surfaces with the same stops share one: so the processor's caches hold one
/// while many surfaces are painted, and not each surface's own.
static RAMPS: Mutex<Vec<(Vec<ColorStop>, Weak<Ramp>)>> = Mutex::new(Vec::new());

/// No more than so many are shared.
const MAX_SHARED: usize = 64;

/// A [`Cel`] in texels, colours 0..=255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Strokes {
    /// Texels inside the edge, a step of depth.
    step: f32,
    outline: f32,
    wall: f32,
    /// Whether what is lit is what the floor leaves open.
    pub(super) has_floor: bool,
    /// Bumps of its outline, a texel.
    wobble: f32,
    ink: [f32; 3],
    fill: [f32; 3],
    lit: [f32; 3],
}

/// Bumps of the width of an outline, a pattern unit, and how much it varies.
const WOBBLES: f32 = 13.0;
const WOBBLE: f32 = 0.35;

/// A wall is lit that faces the light by more than this (a cosine).
const LIT: f32 = 0.2;

impl Strokes {
    fn new(cel: &Cel, texels_per_unit: f32) -> Self {
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

    /// What lies over the picture at a depth where the surface leans this way: three colours times cover, and cover.
    #[inline(always)]
    pub(super) fn layer(&self, depth: u16, [x, y]: [f32; 2]) -> [f32; 4] {
        let share = |value: f32| value.clamp(0.0, 1.0);
        // All edges are one texel soft.
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
    /// The same at a place with a floor, which covers so much of it, and a pit.
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
        // Flat tones: one for each straight side.
        let least = if hollow > crack { 0.15 } else { 0.0 };
        let lit = (0.22 + 0.9 * facing).clamp(least, 1.0) * (1.0 - floor);
        let color = |c: usize| {
            let within = self.fill[c] + (self.lit[c] - self.fill[c]) * lit;
            (self.ink[c] + (within - self.ink[c]) * open) * cover
        };
        [color(0), color(1), color(2), cover]
    }
}

/// A [`Look`] made ready to paint with.
#[derive(Clone, Debug, PartialEq)]
pub struct LookTable {
    ramp: Arc<Ramp>,
    glow: Option<Arc<Ramp>>,
    pub(super) tint: f32,
    pub(super) glint: f32,
    pub(super) gloss: f32,
    pub(super) sparkle: f32,
    /// Bumps of it a texel.
    pub(super) sparkle_scale: f32,
    /// Where rims curl up.
    pub(super) curve: Option<Box<Curve>>,
    pub(super) cel: Option<Strokes>,
    pub(super) facets: Option<Facets>,
    /// Colour that plates reflect, 0..=255.
    pub(super) sheen: [f32; 3],
    /// Colour of their sides, 0..=255, and how thick they are, texels.
    pub(super) side: [f32; 3],
    pub(super) thick: f32,
    /// Colour of veils, 0..=255, and what a step of their density covers; nothing if there are none.
    pub(super) veil: [f32; 3],
    pub(super) veil_cover: f32,
    pub(super) grain: f32,
    pub(super) shift: f32,
    /// Share of a depth map's range that a pattern unit of depth is.
    pub(super) deep: f32,
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
        let ramp = ["ramp.len()", "ramp.depth", "ramp.color", "ramp.cover"];
        let glow = ["glow.len()", "glow.depth", "glow.color", "glow.cover"];
        for ([len, depth, color, cover], stops) in [(ramp, &self.ramp), (glow, &self.glow)] {
            within(len, stops.len() as f32, 0.0..=MAX_STOPS as f32, "0..=16")?;
            let mut above = 0.0;
            for stop in stops.iter() {
                within(depth, stop.depth, above..=1.0, "0..=1, not below the stop before")?;
                above = stop.depth;
                for channel in stop.color {
                    within(color, channel, 0.0..=1.0, unit)?;
                }
                within(cover, stop.cover, 0.0..=1.0, unit)?;
            }
        }
        within("tint", self.tint, 0.0..=1.0, unit)?;
        within("glint", self.glint, 0.0..=4.0, "0..=4")?;
        within("gloss", self.gloss, 0.0..=4.0, "0..=4")?;
        within("sparkle", self.sparkle, 0.0..=1.0, unit)?;
        within("catch", self.catch, 0.0..=1.0, unit)?;
        within("full_rim", self.full_rim, 0.0..=1.0, unit)?;
        within("grain", self.grain, 0.0..=1.0, unit)?;
        within("shift", self.shift, 0.0..=16.0, "0..=16")?;
        within("relief", self.relief, 0.0..=1.0, unit)?;
        within("curl", self.curl, 0.0..=1.0, unit)?;
        within("curl_depth", self.curl_depth, 0.001..=0.5, "0.001..=0.5")?;
        if let Some(cel) = &self.cel {
            cel.validate()?;
        }
        if let Some(facets) = &self.facets {
            within("facets.tone", facets.tone, 0.0..=1.0, unit)?;
            within("facets.tilt", facets.tilt, 0.0..=1.0, unit)?;
            within("facets.shift", facets.shift, 0.0..=16.0, "0..=16")?;
            within("facets.gleam", facets.gleam, 0.0..=1.0, unit)?;
            within("facets.flash", facets.flash, 0.0..=1.0, unit)?;
            for channel in facets.sheen {
                within("facets.sheen", channel, 0.0..=1.0, unit)?;
            }
            for channel in facets.side {
                within("facets.side", channel, 0.0..=1.0, unit)?;
            }
            within("facets.sweep", facets.sweep, 0.0..=1.0, unit)?;
            within("facets.thick", facets.thick, 0.0..=0.02, "0..=0.02")?;
            within("facets.near", facets.near, 0.0..=1.0, unit)?;
            within("facets.dish", facets.dish, 0.0..=1.0, unit)?;
            within("facets.fade", facets.fade, 0.0..=16.0, "0..=16")?;
            within("facets.bundle", facets.bundle, 0.0..=1.0, unit)?;
        }
        match self.crushed.as_ref().and_then(Crushed::fault).or(self.veil.as_ref().and_then(Veil::fault)) {
            Some((field, value, range)) => Err(LookError::OutOfRange { field, value, range }),
            None => Ok(()),
        }
    }

    /// How far down the surface is at each depth, 65536 = at the bottom.
    fn curve(&self) -> Option<Box<Curve>> {
        (self.curl > 0.0).then(|| {
            Box::new(Curve(std::array::from_fn(|step| {
                let depth = step as f32 / STEPS as f32;
                let rim = (1.0 - (depth / self.curl_depth - 1.0).abs()).max(0.0);
                ((depth - self.curl * rim) * 65535.0) as i32
            })))
        })
    }
}

/// Colour and cover at `depth` (0..=1); before the first stop the cover rises from zero, after the last nothing changes.
fn at(stops: &[ColorStop], depth: f32) -> ([f32; 3], f32) {
    let Some(first) = stops.first() else { return ([0.0; 3], 0.0) };
    let mut low =
        ColorStop { depth: 0.0, color: first.color, cover: if first.depth > 0.0 { 0.0 } else { first.cover } };
    for &high in stops {
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

pub(super) fn within(
    field: &'static str,
    value: f32,
    allowed: RangeInclusive<f32>,
    range: &'static str,
) -> Result<(), LookError> {
    if allowed.contains(&value) { Ok(()) } else { Err(LookError::OutOfRange { field, value, range }) }
}

fn ramp(stops: &[ColorStop]) -> Ramp {
    let layer = |step: usize| {
        let (color, cover) = at(stops, step as f32 / STEPS as f32);
        let [r, g, b] = color.map(|channel| 255.0 * channel * cover);
        Layer::new(r, g, b, cover)
    };
    let mut ramp = [[Layer::ZERO; 2]; STEPS + 1];
    for (step, place) in ramp[1..].iter_mut().enumerate() {
        *place = [layer(step), layer(step + 1) - layer(step)];
    }
    ramp
}

fn shared_ramp(wanted: &[ColorStop]) -> Arc<Ramp> {
    let mut ramps = RAMPS.lock().unwrap_or_else(PoisonError::into_inner);
    let known = ramps.iter().find(|(stops, _)| **stops == *wanted).and_then(|(_, ramp)| ramp.upgrade());
    known.unwrap_or_else(|| {
        ramps.retain(|(_, ramp)| ramp.strong_count() > 0);
        let ramp = Arc::new(ramp(wanted));
        if ramps.len() < MAX_SHARED {
            ramps.push((wanted.to_vec(), Arc::downgrade(&ramp)));
        }
        ramp
    })
}

impl LookTable {
    /// Tables for `look`; `texels_per_unit` as in [`SurfaceFrame`](crate::pattern::SurfaceFrame).
    ///
    /// # Errors
    /// If a field is out of its range or not finite.
    pub fn new(look: &Look, texels_per_unit: f32) -> Result<Self, LookError> {
        look.validate()?;
        within("texels_per_unit", texels_per_unit, f32::MIN_POSITIVE..=MAX_SIDE as f32, "above 0, up to 16384")?;
        let ramp = shared_ramp(&look.ramp);
        let glow = (!look.glow.is_empty()).then(|| shared_ramp(&look.glow));
        // Sobel's kernel weighs a slope of one depth step per texel with 8.
        let slope = look.relief * texels_per_unit / (8.0 * 65535.0);
        let Look { tint, glint, gloss, sparkle, grain, shift, opaque, facets, .. } = *look;
        Ok(Self {
            ramp,
            glow,
            tint,
            glint,
            gloss,
            sparkle,
            sparkle_scale: SPARKLES / texels_per_unit,
            curve: look.curve(),
            cel: look.cel.map(|cel| Strokes::new(&cel, texels_per_unit)),
            facets,
            side: facets.map_or([0.0; 3], |facets| facets.side.map(|channel| 255.0 * channel)),
            thick: facets.map_or(0.0, |facets| facets.thick * texels_per_unit),
            sheen: facets.map_or([0.0; 3], |facets| facets.sheen.map(|channel| 255.0 * channel)),
            veil: look.veil.map_or([0.0; 3], |veil| veil.color.map(|channel| 255.0 * channel)),
            veil_cover: look.veil.map_or(0.0, |veil| veil.cover * (1.0 / 255.0)),
            grain,
            shift,
            deep: if look.relief > 0.0 { 1.0 / look.relief } else { 0.0 },
            slope,
            opaque,
        })
    }

    /// Whether cracks give off light.
    pub(super) const fn glows(&self) -> bool {
        self.glow.is_some()
    }

    /// The light at a depth: three colours, 0..=255.
    pub(super) fn light(&self, depth: u16) -> [f32; 3] {
        let Some(glow) = &self.glow else { return [0.0; 3] };
        let [low, gain] = glow[usize::from(depth >> 8) + usize::from(depth != 0)];
        let [r, g, b, _] = (low + gain * Self::between(depth)).to_array();
        [r, g, b]
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
        for name in Look::NAMES {
            assert_eq!(refused(&Look::named(name).unwrap()), None, "{name}");
        }
        assert_eq!(Look::named("no such"), None);
        assert_eq!(refused(&Look { ramp: vec![].into(), ..Look::GROOVE }), None);
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        for bad in [-0.1, 17.0, f32::NAN, f32::INFINITY] {
            assert_eq!(refused(&Look { glint: bad, ..Look::GROOVE }), Some("glint"));
            assert_eq!(refused(&Look { grain: bad, ..Look::GROOVE }), Some("grain"));
            assert_eq!(refused(&Look { shift: bad, ..Look::GROOVE }), Some("shift"));
            assert_eq!(refused(&Look { relief: bad, ..Look::GROOVE }), Some("relief"));
            assert_eq!(refused(&Look { tint: bad, ..Look::GROOVE }), Some("tint"));
            assert_eq!(refused(&Look { gloss: bad, ..Look::GROOVE }), Some("gloss"));
            assert_eq!(refused(&Look { sparkle: bad, ..Look::GROOVE }), Some("sparkle"));
            assert_eq!(refused(&Look { catch: bad, ..Look::GROOVE }), Some("catch"));
            assert_eq!(refused(&Look { full_rim: bad, ..Look::GROOVE }), Some("full_rim"));
            assert_eq!(refused(&Look { curl: bad, ..Look::GROOVE }), Some("curl"));
            assert_eq!(refused(&Look { curl_depth: bad, ..Look::GROOVE }), Some("curl_depth"));
            let cel = |cel| refused(&Look { cel: Some(cel), ..Look::GROOVE });
            assert_eq!(cel(Cel { wide: bad, ..Cel::DEFAULT }), Some("cel.wide"));
            assert_eq!(cel(Cel { outline: bad, ..Cel::DEFAULT }), Some("cel.outline"));
            assert_eq!(cel(Cel { wall: bad, ..Cel::DEFAULT }), Some("cel.wall"));
            assert_eq!(cel(Cel { slant: bad, ..Cel::DEFAULT }), Some("cel.slant"));
            assert_eq!(cel(Cel { ink: [bad, 0.0, 0.0], ..Cel::DEFAULT }), Some("cel.ink"));
            assert_eq!(cel(Cel { fill: [0.0, bad, 0.0], ..Cel::DEFAULT }), Some("cel.fill"));
            assert_eq!(cel(Cel { lit: [0.0, 0.0, bad], ..Cel::DEFAULT }), Some("cel.lit"));
            let facets = |facets| refused(&Look { facets: Some(facets), ..Look::GROOVE });
            assert_eq!(facets(Facets { tone: bad, ..Facets::DEFAULT }), Some("facets.tone"));
            assert_eq!(facets(Facets { tilt: bad, ..Facets::DEFAULT }), Some("facets.tilt"));
            assert_eq!(facets(Facets { shift: bad, ..Facets::DEFAULT }), Some("facets.shift"));
            assert_eq!(facets(Facets { gleam: bad, ..Facets::DEFAULT }), Some("facets.gleam"));
            assert_eq!(facets(Facets { flash: bad, ..Facets::DEFAULT }), Some("facets.flash"));
            assert_eq!(facets(Facets { sheen: [0.0, 0.0, bad], ..Facets::DEFAULT }), Some("facets.sheen"));
            assert_eq!(facets(Facets { near: bad, ..Facets::DEFAULT }), Some("facets.near"));
            assert_eq!(facets(Facets { dish: bad, ..Facets::DEFAULT }), Some("facets.dish"));
            assert_eq!(facets(Facets { fade: bad, ..Facets::DEFAULT }), Some("facets.fade"));
            assert_eq!(facets(Facets { bundle: bad, ..Facets::DEFAULT }), Some("facets.bundle"));
            assert_eq!(facets(Facets { sweep: bad, ..Facets::DEFAULT }), Some("facets.sweep"));
            assert_eq!(facets(Facets { thick: bad, ..Facets::DEFAULT }), Some("facets.thick"));
            assert_eq!(facets(Facets { side: [0.0, bad, 0.0], ..Facets::DEFAULT }), Some("facets.side"));
            let crushed = |crushed| refused(&Look { crushed: Some(crushed), ..Look::GROOVE });
            assert_eq!(crushed(Crushed { radius: bad, ..Crushed::DEFAULT }), Some("crushed.radius"));
            assert_eq!(crushed(Crushed { ragged: bad, ..Crushed::DEFAULT }), Some("crushed.ragged"));
            assert_eq!(crushed(Crushed { soft: bad, ..Crushed::DEFAULT }), Some("crushed.soft"));
            assert_eq!(crushed(Crushed { hole: bad, ..Crushed::DEFAULT }), Some("crushed.hole"));
            assert_eq!(crushed(Crushed { depth: bad, ..Crushed::DEFAULT }), Some("crushed.depth"));
            assert_eq!(crushed(Crushed { rough: bad, ..Crushed::DEFAULT }), Some("crushed.rough"));
            assert_eq!(crushed(Crushed { grain: bad, ..Crushed::DEFAULT }), Some("crushed.grain"));
            assert_eq!(crushed(Crushed { color: [0.0, bad, 0.0], ..Crushed::DEFAULT }), Some("crushed.color"));
            assert_eq!(crushed(Crushed { pale: bad, ..Crushed::DEFAULT }), Some("crushed.pale"));
            assert_eq!(crushed(Crushed { speckle: bad, ..Crushed::DEFAULT }), Some("crushed.speckle"));
            assert_eq!(crushed(Crushed { flake: bad, ..Crushed::DEFAULT }), Some("crushed.flake"));
            assert_eq!(crushed(Crushed { dust: bad, ..Crushed::DEFAULT }), Some("crushed.dust"));
            assert_eq!(crushed(Crushed { chips: bad, ..Crushed::DEFAULT }), Some("crushed.chips"));
            assert_eq!(crushed(Crushed { reach: bad, ..Crushed::DEFAULT }), Some("crushed.reach"));
            assert_eq!(crushed(Crushed { bare: bad, ..Crushed::DEFAULT }), Some("crushed.bare"));
            assert_eq!(crushed(Crushed { jag: bad, ..Crushed::DEFAULT }), Some("crushed.jag"));
            assert_eq!(crushed(Crushed { stones: bad, ..Crushed::DEFAULT }), Some("crushed.stones"));
            assert_eq!(crushed(Crushed { tint: bad, ..Crushed::DEFAULT }), Some("crushed.tint"));
            assert_eq!(crushed(Crushed { basin: bad, ..Crushed::DEFAULT }), Some("crushed.basin"));
            assert_eq!(crushed(Crushed { fall: bad, ..Crushed::DEFAULT }), Some("crushed.fall"));
            assert_eq!(crushed(Crushed { outline: bad, ..Crushed::DEFAULT }), Some("crushed.outline"));
            assert_eq!(crushed(Crushed { pit: bad, ..Crushed::DEFAULT }), Some("crushed.pit"));
            assert_eq!(crushed(Crushed { ticks: 17, ..Crushed::DEFAULT }), Some("crushed.ticks"));
            assert_eq!(crushed(Crushed { flakes: 17, ..Crushed::DEFAULT }), Some("crushed.flakes"));
            assert_eq!(crushed(Crushed { needles: bad, ..Crushed::DEFAULT }), Some("crushed.needles"));
            assert_eq!(crushed(Crushed { crazing: bad, ..Crushed::DEFAULT }), Some("crushed.crazing"));
            assert_eq!(crushed(Crushed { bubbles: 65, ..Crushed::DEFAULT }), Some("crushed.bubbles"));
            assert_eq!(crushed(Crushed { edge: bad, ..Crushed::DEFAULT }), Some("crushed.edge"));
            let veil = |veil| refused(&Look { veil: Some(veil), ..Look::GROOVE });
            assert_eq!(veil(Veil { reach: bad, ..Veil::DEFAULT }), Some("veil.reach"));
            assert_eq!(veil(Veil { full_width: bad, ..Veil::DEFAULT }), Some("veil.full_width"));
            assert_eq!(veil(Veil { cover: bad, ..Veil::DEFAULT }), Some("veil.cover"));
            assert_eq!(veil(Veil { uneven: bad, ..Veil::DEFAULT }), Some("veil.uneven"));
            assert_eq!(veil(Veil { bubbles: bad, ..Veil::DEFAULT }), Some("veil.bubbles"));
            assert_eq!(veil(Veil { color: [bad, 0.0, 0.0], ..Veil::DEFAULT }), Some("veil.color"));
            let glow = |stops: &[ColorStop]| refused(&Look { glow: stops.to_vec().into(), ..Look::GROOVE });
            assert_eq!(glow(&[stop(bad, [0.0; 3], 0.0)]), Some("glow.depth"));
            assert_eq!(glow(&[stop(0.5, [bad, 0.0, 0.0], 0.0)]), Some("glow.color"));
            assert_eq!(glow(&[stop(0.5, [0.0; 3], bad)]), Some("glow.cover"));
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

    #[test]
    fn equal_stops_share_a_ramp_and_others_do_not() {
        let stops = vec![stop(0.3, [0.1, 0.9, 0.2], 0.7), stop(0.9, [0.4, 0.2, 0.3], 1.0)];
        let look = Look { ramp: stops.clone().into(), ..Look::GROOVE };
        let table = |look: &Look| LookTable::new(look, 512.0).unwrap();
        let (first, second) = (table(&look), table(&Look { glint: 0.1, ..look.clone() }));
        assert!(Arc::ptr_eq(&first.ramp, &second.ramp), "not shared");
        let other = table(&Look { ramp: stops[..1].to_vec().into(), ..Look::GROOVE });
        assert_ne!(first.ramp, other.ramp);
        let before = *first.ramp;
        drop((first, second));
        assert_eq!(*table(&look).ramp, before);
        // Many looks at once: those that are not shared are right as well.
        let tables: Vec<_> = (0..2 * MAX_SHARED)
            .map(|i| {
                let stops = vec![stop(0.5, [0.0, 0.0, i as f32 / 255.0], 1.0)];
                (i, table(&Look { ramp: stops.into(), ..Look::GROOVE }))
            })
            .collect();
        for (i, table) in tables {
            assert_eq!(layer(&table, 0x8000)[2], i as f32 / 255.0 * 255.0);
        }
    }

    #[test]
    fn the_ramp_is_linear_between_its_stops() {
        let ramp = vec![stop(0.25, [1.0, 0.0, 0.0], 0.5), stop(0.75, [0.0, 0.0, 1.0], 1.0)];
        let look = Look { ramp: ramp.into(), ..Look::GROOVE };
        let look_at = |depth| at(&look.ramp, depth);
        assert_eq!(look_at(0.125), ([1.0, 0.0, 0.0], 0.25));
        assert_eq!(look_at(0.5), ([0.5, 0.0, 0.5], 0.75));
        assert_eq!(look_at(1.0), ([0.0, 0.0, 1.0], 1.0));
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
