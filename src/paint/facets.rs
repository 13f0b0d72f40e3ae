//! How plates differ in tone, tilt and reflection: [`Facets`].

/// Closed cells as separate plates: each is a little darker or brighter, is tilted, and has its own reflection.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Facets {
    /// Largest difference in brightness between a plate and the picture, as a share of the picture. 0..=1; default
    /// 0.1.
    pub tone: f32,
    /// Slope of the most tilted plates in the normal map. 0..=1; default 0.1.
    pub tilt: f32,
    /// Displacement of the picture behind a plate, texels at the most. 0..=16; default 0.
    pub shift: f32,
    /// Cover of the reflection ([`reflection_color`](Self::reflection_color)) on the brightest plates; it falls off across each plate.
    /// 0..=1; default 0.
    pub reflection: f32,
    /// Share of plates with a strong reflection; the others reflect at most a quarter of [`reflection`](Self::reflection).
    /// 0..=1; default 0.1.
    pub bright_share: f32,
    /// Colour of reflections, sRGB 0..=1; default the colour of a bright sky.
    pub reflection_color: [f32; 3],
    /// How much tone, tilt, shift and reflections fall off with the distance from the hit: 0 = the same everywhere, 1
    /// = next to nothing far away. 0..=1; default 0.
    pub falloff: f32,
    /// How much plates are dished, with rims that curl up: they are darker by up to this share on the side towards
    /// the light, and brighter on the other. 0..=1; default 0.
    pub concavity: f32,
    /// Distance from a hit of energy 1 at which plates fade out, so that the loaded area has no visible edge. It is
    /// proportional to the root of the energy. Pattern units, 0..=16; default 0 = plates do not fade out.
    pub fade: f32,
    /// How similar neighbouring plates are, so that tones and tilts come in groups: 0 = independent, 1 = the same.
    /// 0..=1; default 0.
    pub similarity: f32,
    /// Whether a plate smaller than the hole of a [crushed](super::Look::crushed) zone is missing as a whole if its
    /// middle lies in the hole, and whole if not; default no.
    pub missing_whole: bool,
    /// How much of the [reflections](Self::reflection) comes in broad patches of neighbouring plates, the brightest in the
    /// middle, instead of on single plates. 0..=1; default 0.
    pub patch_share: f32,
    /// Thickness of plates beside [missing](Self::missing_whole) ones: their broken sides are visible in the hole. Pattern
    /// units, 0..=0.02; default 0.
    pub thickness: f32,
    /// Colour of the broken sides, sRGB 0..=1; default the colour of the edge of a glass pane.
    pub side_color: [f32; 3],
}

impl Facets {
    /// The default: plates of slightly different tone, without reflections.
    pub const DEFAULT: Self = Self {
        tone: 0.1,
        tilt: 0.1,
        shift: 0.0,
        reflection: 0.0,
        bright_share: 0.1,
        reflection_color: [0.88, 0.94, 1.0],
        falloff: 0.0,
        concavity: 0.0,
        fade: 0.0,
        similarity: 0.0,
        missing_whole: false,
        patch_share: 0.0,
        thickness: 0.0,
        side_color: [0.62, 0.86, 0.78],
    };
}

impl Default for Facets {
    fn default() -> Self {
        Self::DEFAULT
    }
}
