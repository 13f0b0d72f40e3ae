//! [`Look`]: how cracks change the picture, as data.

use super::{
    cel::Cel,
    facets::Facets,
    range::{LookError, within},
    shades::Shades,
};
use crate::{
    blend::NormalBlending,
    raster::{CrushedZone, LayerPlan, Veil},
};
use std::borrow::Cow;

/// A point of a [`Look`]'s ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ColorStop {
    /// Depth of the crack at this stop, 0..=1.
    pub depth: f32,
    /// Colour, sRGB 0..=1.
    pub color: [f32; 3],
    /// How much the colour covers the picture, 0..=1.
    pub cover: f32,
}

/// How cracks change the picture.
///
/// ```
/// use bevy_crack::paint::{Cel, ColorStop, Facets, Look, LookError};
///
/// let shiny = Look { glint: 2.0, ..Look::GROOVE };
/// assert_eq!(shiny.validate(), Ok(()));
/// let error = Look { glint: 9.0, ..Look::GROOVE }.validate();
/// assert_eq!(error, Err(LookError::OutOfRange { field: "glint", value: 9.0, range: "0..=4" }));
/// assert_eq!(Look::named("groove"), Some(Look::GROOVE));
///
/// // Blue where cracks are shallow, black where they are deep; the plates between them are tilted.
/// let stop = |depth, color, cover| ColorStop { depth, color, cover };
/// let ice = Look {
///     ramp: vec![stop(0.1, [0.4, 0.6, 0.9], 0.5), stop(1.0, [0.0, 0.0, 0.1], 1.0)].into(),
///     facets: Some(Facets { tilt: 0.3, ..Facets::DEFAULT }),
///     ..Look::GROOVE
/// };
/// assert_eq!(ice.validate(), Ok(()));
/// // Drawn with a thick line of ink.
/// let drawn = Look { cel: Some(Cel { outline: 0.006, ..Cel::DEFAULT }), ..Look::TOON };
/// assert_eq!(drawn.validate(), Ok(()));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Look {
    /// Colour of a crack by its depth: at most 16 stops, sorted by depth, linear between them, nothing at depth 0.
    /// Default: the four stops of [`GROOVE`](Self::GROOVE).
    ///
    /// Below the first stop its cover falls to zero. Beyond the last stop colour and cover stay the same.
    pub ramp: Cow<'static, [ColorStop]>,
    /// How far the colours of the ramp are multiplied by the picture: 0 = the colours are used as they are, 1 = each
    /// is multiplied by the picture's colour: a crack in brown clay is brown. 0..=1; default 1.
    pub tint: f32,
    /// How much walls that face the light (from the upper left) brighten and walls that face away darken, by their
    /// slope. 0..=4; default 0.9.
    pub glint: f32,
    /// How much the light of [`glint`](Self::glint) comes and goes along a crack: up to this share of it is removed, so
    /// that walls are lit in places. 0..=1; default 0.
    pub uneven_glint: f32,
    /// How much of the light on walls is an added highlight instead of a share of the colour below it (glass). 0..=4;
    /// default 0.
    pub gloss: f32,
    /// How much less deep a crack looks where its wall faces the light, and how much deeper on the other side: the
    /// colour is that of a depth changed by up to this share, depending on the slope or, with [`cast`](Self::cast), on the shadows. 0..=1; default 0.
    pub shadow: f32,
    /// How deep cracks count for the shadows that their edges cast on their walls and floors, as a multiple of [`relief`](Self::relief), but at least 3 and at
    /// most 57 texels. Light comes from the upper left, and the walls inside cracks are lit, not their rims. [`shadow`](Self::shadow) is how dark shadows
    /// are. 0..=4; default 0.
    ///
    /// No shadows are cast with 0, without `shadow`, and with [`cel`](Self::cel).
    pub cast: f32,
    /// How much the cover varies along a crack (glass, ice): up to this share of it is removed. 0..=1; default 0.
    pub sparkle: f32,
    /// How much fainter cracks are that do not catch the light, depending on their direction and slowly varying along
    /// each crack (glass): up to this share of their depth is removed. 0..=1; default 0.
    pub directionality: f32,
    /// How much the cover varies from texel to texel (frosted glass): up to this share of it is removed. 0..=1; default 0.12.
    pub grain: f32,
    /// Displacement of the picture where the crack tilts the surface (refraction), texels at the steepest slope.
    /// 0..=16; default 0.
    pub shift: f32,
    /// Height of the walls: depth 1 is this many pattern units deep. 0..=1; default 0.012.
    ///
    /// It sets the slopes of the normal map, and the slopes that [`glint`](Self::glint) and [`shift`](Self::shift)
    /// use.
    pub relief: f32,
    /// How far the rims of cracks curl up, as a share of [`relief`](Self::relief). The surface is highest at depth
    /// [`curl_depth`](Self::curl_depth), and level with its surroundings at depth 0 and at twice that depth. 0..=1;
    /// default 0.
    pub curl: f32,
    /// Depth at which a curled rim is highest, see [`curl`](Self::curl); usually the profile's
    /// [`rim_depth`](crate::raster::Profile::rim_depth). 0.001..=0.5; default 0.12.
    pub curl_depth: f32,
    /// Draws cracks with flat colours instead of the ramp; default none.
    pub cel: Option<Cel>,
    /// Width from which a crack has its whole rim, pattern units; narrower cracks have a fainter rim. 0..=1; default
    /// 0 = all cracks have the same rim.
    pub full_rim: f32,
    /// Draws closed cells as separate plates; default none.
    pub facets: Option<Facets>,
    /// The crushed zone around a hit; default none.
    pub crushed: Option<CrushedZone>,
    /// Translucent sheets to one side of cracks; default none.
    pub veil: Option<Veil>,
    /// Light that cracks emit by their depth, in the format of [`ramp`](Self::ramp). It is written to the emissive
    /// map. Default nothing.
    pub glow: Cow<'static, [ColorStop]>,
    /// How the slopes of cracks and the surface's own normal map become one: `Plain`, `Whiteout` or `Poisson`; default
    /// [`Plain`](NormalBlending::Plain). It has no effect on a surface without a normal map of its own.
    pub normals: NormalBlending,
    /// In how many shades cracks show, for pixel art: `Auto`, `Smooth` or `Steps`; default [`Auto`](Shades::Auto).
    pub shades: Shades,
    /// Whether the cover of cracks makes a translucent picture opaque (glass panes). Fully transparent texels stay
    /// transparent. Default false.
    pub opaque: bool,
}

impl Look {
    /// The names that [`named`](Self::named) knows.
    pub const NAMES: [&'static str; 18] = [
        "groove",
        "frosted",
        "toon",
        "glass",
        "tempered_glass",
        "laminated_glass",
        "ice",
        "concrete",
        "asphalt",
        "marble",
        "sand",
        "plaster",
        "brick",
        "clay",
        "mud",
        "stain",
        "mirror",
        "glowing",
    ];

    /// The look with this name (lower case), see [`NAMES`](Self::NAMES); `None` if there is none.
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
            "asphalt" => Some(Self::ASPHALT),
            "marble" => Some(Self::MARBLE),
            "sand" => Some(Self::SAND),
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

    /// A groove with lit walls, filled with a dark shade of the surface's own colour: concrete, clay, plaster.
    pub const GROOVE: Self = Self {
        ramp: Cow::Borrowed(&[
            stop(0.15, [0.62, 0.59, 0.56], 0.10),
            stop(0.40, [0.45, 0.41, 0.37], 0.80),
            stop(0.80, [0.31, 0.275, 0.24], 0.95),
            stop(1.0, [0.17, 0.148, 0.128], 1.0),
        ]),
        tint: 1.0,
        glint: 0.9,
        uneven_glint: 0.0,
        gloss: 0.0,
        shadow: 0.0,
        cast: 0.0,
        grain: 0.12,
        sparkle: 0.0,
        directionality: 0.0,
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
        normals: NormalBlending::Plain,
        shades: Shades::Auto,
        opaque: false,
    };

    /// Cracked glass, ice: a bright hairline with a dark line on the side away from the light. The walls displace the
    /// picture behind them.
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

    /// The layers that a depth field needs in addition to depths so that this look can be painted. `seed` fixes their
    /// random details.
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
    /// field.set_layers(preset.look.layer(7));
    /// let (timeline, mut changed) = (growth.timeline(), Vec::new());
    /// field.show_layers(growth.network(), timeline, Moment::after(timeline.end()), &mut changed);
    /// assert!(!changed.is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub const fn layer(&self, seed: u64) -> LayerPlan {
        LayerPlan {
            plates: self.facets.is_some(),
            thickness: match self.facets {
                Some(facets) => facets.thickness,
                None => 0.0,
            },
            crushed: self.crushed,
            veil: self.veil,
            floor: match self.cel {
                Some(cel) => [cel.slant, cel.wall],
                None => [0.0; 2],
            },
            directionality: self.directionality,
            full_rim: self.full_rim,
            seed,
        }
    }
}

impl Look {
    /// Checks every field.
    ///
    /// # Errors
    /// [`LookError::OutOfRange`] for the first field that is out of its range or not finite.
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
        within("uneven_glint", self.uneven_glint, 0.0..=1.0, unit)?;
        within("gloss", self.gloss, 0.0..=4.0, "0..=4")?;
        within("shadow", self.shadow, 0.0..=1.0, unit)?;
        within("cast", self.cast, 0.0..=4.0, "0..=4")?;
        within("sparkle", self.sparkle, 0.0..=1.0, unit)?;
        within("directionality", self.directionality, 0.0..=1.0, unit)?;
        within("full_rim", self.full_rim, 0.0..=1.0, unit)?;
        within("grain", self.grain, 0.0..=1.0, unit)?;
        within("shift", self.shift, 0.0..=16.0, "0..=16")?;
        within("relief", self.relief, 0.0..=1.0, unit)?;
        within("curl", self.curl, 0.0..=1.0, unit)?;
        within("curl_depth", self.curl_depth, 0.001..=0.5, "0.001..=0.5")?;
        if let Shades::Steps(steps) = self.shades {
            within("shades", steps.into(), 1.0..=f32::from(Shades::MOST), "1..=16")?;
        }
        if let Some(cel) = &self.cel {
            cel.validate()?;
        }
        if let Some(facets) = &self.facets {
            within("facets.tone", facets.tone, 0.0..=1.0, unit)?;
            within("facets.tilt", facets.tilt, 0.0..=1.0, unit)?;
            within("facets.shift", facets.shift, 0.0..=16.0, "0..=16")?;
            within("facets.reflection", facets.reflection, 0.0..=1.0, unit)?;
            within("facets.bright_share", facets.bright_share, 0.0..=1.0, unit)?;
            for channel in facets.reflection_color {
                within("facets.reflection_color", channel, 0.0..=1.0, unit)?;
            }
            for channel in facets.side_color {
                within("facets.side_color", channel, 0.0..=1.0, unit)?;
            }
            within("facets.patch_share", facets.patch_share, 0.0..=1.0, unit)?;
            within("facets.thickness", facets.thickness, 0.0..=0.02, "0..=0.02")?;
            within("facets.falloff", facets.falloff, 0.0..=1.0, unit)?;
            within("facets.concavity", facets.concavity, 0.0..=1.0, unit)?;
            within("facets.fade", facets.fade, 0.0..=16.0, "0..=16")?;
            within("facets.similarity", facets.similarity, 0.0..=1.0, unit)?;
        }
        match self.crushed.as_ref().and_then(CrushedZone::fault).or(self.veil.as_ref().and_then(Veil::fault)) {
            Some((field, value, range)) => Err(LookError::OutOfRange { field, value, range }),
            None => Ok(()),
        }
    }
}

/// Keeps tables short.
pub(super) const fn stop(depth: f32, color: [f32; 3], cover: f32) -> ColorStop {
    ColorStop { depth, color, cover }
}

impl Default for Look {
    fn default() -> Self {
        Self::GROOVE
    }
}

/// The largest number of stops of a [`Look::ramp`].
const MAX_STOPS: usize = 16;
