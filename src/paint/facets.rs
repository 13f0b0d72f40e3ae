//! How plates differ from each other: [`Facets`].

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
    /// Whether plates smaller than the hole of a [crushed](super::Look::crushed) zone are gone as a whole if their middle lies in it, and else not at
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
