//! [`CrackPreset`]: everything that makes glass glass.

mod check;
#[cfg(feature = "serde")]
mod file;

pub use check::PresetError;

use crate::{
    growth::{GrowthParams, MarkerLayout, StartLayout},
    paint::Look,
    raster::Profile,
};

/// Everything that makes glass glass: how cracks grow, their cross-section, their look.
///
/// ```
/// use bevy_crack::CrackPreset;
///
/// let mut slow_glass = CrackPreset::GLASS;
/// slow_glass.steps_per_second = 5.0;
/// assert_eq!(CrackPreset::named("glass"), Some(CrackPreset::GLASS));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::asset::Asset, bevy::reflect::Reflect))]
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
    /// The names that [`named`](Self::named) knows.
    pub const NAMES: [&'static str; 3] = ["glass", "concrete", "clay"];

    /// Concrete: a few long, rough, branching cracks.
    ///
    /// Couto et al. use `kill_distance` 0.08, `D` 1.0, `num_iterations` 100, `crack_radius` 0.4, a grid of 7 x 7 and
    /// `line_growth` 1, in a unit that they do not give.
    pub const CONCRETE: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.05,
            step_length: 0.022,
            crack_radius: 0.4,
            num_lines_grid: 7,
            num_columns_grid: 7,
            markers: MarkerLayout::PseudoGrid { occupancy: 0.45, jitter: 1.0 },
            focus: 0.3,
            reach: 0.55,
            line_width: 0.004,
            line_growth: 0.55,
            murray: 2.6,
            max_width: 0.022,
            wander: 0.55,
            roughness: 0.3,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.014,
            wall: 0.35,
            rim_width: 0.005,
            rim_depth: 0.14,
            faintest: 0.6,
        },
        look: Look::GROOVE,
        steps_per_second: 60.0,
    };

    /// Window glass: bright radials and broken rings.
    ///
    /// Couto et al. use `kill_distance` 0.02, `D` 0.8, `num_iterations` 80, `crack_radius` 1.0, a grid of 20 x 20,
    /// `draw_connections` and `line_growth` 0.5 for the white lines, in a unit that they do not give.
    pub const GLASS: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.036,
            step_length: 0.02,
            crack_radius: 0.2,
            num_iterations: 80,
            markers: MarkerLayout::Polar { sectors: 24, rings: 16, ring_growth: 1.12, jitter: 0.9, occupancy: 1.0 },
            reach: 0.75,
            starts: StartLayout::Ring { count: 24, radius: 0.014 },
            line_width: 0.0022,
            line_growth: 0.9,
            murray: 2.6,
            max_width: 0.009,
            wander: 0.07,
            roughness: 0.05,
            draw_connections: true,
            connection_gaps: 0.1,
            connection_every: 2,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.004, wall: 0.3, rim_width: 0.006, rim_depth: 0.3, faintest: 0.6 },
        look: Look { relief: 0.004, glint: 0.5, ..Look::FROSTED },
        steps_per_second: 90.0,
    };

    /// Dry clay: many short cracks that close into cells.
    ///
    /// Couto et al. use `kill_distance` 0.08, `D` 0.8, `num_iterations` 100, `crack_radius` 0.4, a grid of 20 x 20,
    /// `line_growth` 0.5 and `draw_islands`, in a unit that they do not give.
    pub const CLAY: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.045,
            step_length: 0.02,
            crack_radius: 0.25,
            markers: MarkerLayout::DartThrowing { spacing: 0.06 },
            reach: 0.7,
            starts: StartLayout::Points { count: 24 },
            line_width: 0.006,
            line_growth: 0.3,
            murray: 3.5,
            max_width: 0.016,
            wander: 0.45,
            roughness: 0.22,
            draw_islands: true,
            island_distance: 0.16,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.014, wall: 0.5, rim_width: 0.012, rim_depth: 0.12, faintest: 0.6 },
        look: Look::GROOVE,
        steps_per_second: 40.0,
    };

    /// The preset of this name (lower case), see [`NAMES`](Self::NAMES).
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "glass" => Some(Self::GLASS),
            "concrete" => Some(Self::CONCRETE),
            "clay" => Some(Self::CLAY),
            _ => None,
        }
    }
}

impl Default for CrackPreset {
    fn default() -> Self {
        Self::CONCRETE
    }
}
