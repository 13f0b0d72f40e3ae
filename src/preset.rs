//! [`CrackPreset`]: everything that makes glass glass.

mod check;
#[cfg(feature = "serde")]
mod file;

pub use check::PresetError;

use crate::{
    growth::{GrowthParams, MarkerLayout, StartLayout, Venation},
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
    /// Whether cracks follow the lines of the picture (mortar, joints) and keep off what is transparent: a surface without a mask of
    /// its own gets the one [from its picture](crate::pattern::CrackMask::from_picture).
    #[cfg_attr(feature = "serde", serde(default))]
    pub follows_lines: bool,
}

impl CrackPreset {
    /// The names that [`named`](Self::named) knows.
    pub const NAMES: [&'static str; 11] = [
        "glass",
        "tempered_glass",
        "laminated_glass",
        "concrete",
        "plaster",
        "brick",
        "clay",
        "mud",
        "glaze",
        "ice",
        "toon",
    ];

    /// Concrete: a few long, rough, branching cracks of uneven width.
    ///
    /// Couto et al. use `kill_distance` 0.08, `D` 1.0, `num_iterations` 100, `crack_radius` 0.4, a grid of 7 x 7 and
    /// `line_growth` 1, in a unit that they do not give.
    pub const CONCRETE: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.052,
            step_length: 0.022,
            crack_radius: 0.4,
            num_lines_grid: 7,
            num_columns_grid: 5,
            markers: MarkerLayout::PseudoGrid { occupancy: 0.5, jitter: 1.0 },
            focus: 0.3,
            reach: 0.78,
            line_width: 0.0052,
            line_growth: 2.0,
            murray: 3.7,
            max_width: 0.036,
            unevenness: 0.36,
            inertia: 2.4,
            wander: 0.39,
            roughness: 0.1,
            arrest: 0.06,
            variety: 0.3,
            width_variety: 0.4,
            hairlines: 0.05,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.02, wall: 0.55, rim_width: 0.005, rim_depth: 0.10, faintest: 0.0 },
        look: Look::CONCRETE,
        steps_per_second: 60.0,
        follows_lines: false,
    };

    /// Plaster: thin, long cracks that wander and hardly branch.
    pub const PLASTER: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.05,
            step_length: 0.02,
            crack_radius: 0.4,
            num_lines_grid: 6,
            num_columns_grid: 6,
            markers: MarkerLayout::PseudoGrid { occupancy: 0.3, jitter: 1.0 },
            reach: 0.8,
            line_width: 0.005,
            line_growth: 0.5,
            murray: 3.0,
            max_width: 0.03,
            unevenness: 0.3,
            inertia: 1.5,
            wander: 0.4,
            roughness: 0.13,
            arrest: 0.06,
            variety: 0.35,
            width_variety: 0.4,
            hairlines: 0.06,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.012, wall: 0.4, rim_width: 0.0, rim_depth: 0.0, faintest: 0.0 },
        look: Look::PLASTER,
        steps_per_second: 60.0,
        follows_lines: false,
    };

    /// Brick: wide cracks, one or two, that keep to the mortar of the picture.
    pub const BRICK: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.06,
            step_length: 0.022,
            crack_radius: 0.4,
            num_lines_grid: 7,
            num_columns_grid: 7,
            markers: MarkerLayout::PseudoGrid { occupancy: 0.35, jitter: 1.0 },
            reach: 0.75,
            line_width: 0.009,
            line_growth: 0.4,
            murray: 3.0,
            max_width: 0.05,
            unevenness: 0.427,
            inertia: 1.26,
            axis: 0.6,
            directed: 0.524,
            wander: 0.3,
            roughness: 0.063,
            arrest: 0.06,
            variety: 0.4,
            width_variety: 0.489,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.006, wall: 0.4, rim_width: 0.003, rim_depth: 0.12, faintest: 0.0 },
        look: Look::BRICK,
        steps_per_second: 60.0,
        follows_lines: true,
    };

    /// Annealed window glass: a crushed core, a few long uneven radials up to the edge, few rings with gaps.
    ///
    /// Couto et al. use `kill_distance` 0.02, `D` 0.8, `num_iterations` 80, `crack_radius` 1.0, a grid of 20 x 20,
    /// `draw_connections` and `line_growth` 0.5 for the white lines, in a unit that they do not give.
    pub const GLASS: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.035,
            step_length: 0.0115,
            crack_radius: 0.25,
            num_iterations: 120,
            markers: MarkerLayout::Polar { sectors: 14, rings: 12, ring_growth: 1.12, jitter: 0.84, occupancy: 1.0 },
            reach: 1.05,
            starts: StartLayout::Crushed { count: 14, radius: 0.014 },
            line_width: 0.0055,
            line_growth: 0.12,
            murray: 2.6,
            max_width: 0.017,
            unevenness: 0.2,
            wander: 0.045,
            roughness: 0.035,
            draw_connections: true,
            connection_gaps: 0.38,
            chips: 0.244,
            connection_every: 3,
            arrest: 0.03,
            variety: 0.2,
            width_variety: 0.1,
            tip_taper: 0.22,
            inertia: 1.2,
            hairlines: 0.05,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.003, wall: 0.5, rim_width: 0.0, rim_depth: 0.0, faintest: 0.0 },
        look: Look::GLASS,
        steps_per_second: 120.0,
        follows_lines: false,
    };

    /// Tempered glass: the whole pane goes to small dice, from the hit outward.
    pub const TEMPERED_GLASS: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.0145,
            step_length: 0.0075,
            crack_radius: 0.055,
            markers: MarkerLayout::DartThrowing { spacing: 0.034 },
            venation: Venation::Closed,
            reach: 64.0,
            starts: StartLayout::Crushed { count: 14, radius: 0.011 },
            line_width: 0.0032,
            line_growth: 0.1,
            murray: 3.0,
            max_width: 0.016,
            tip_taper: 0.4,
            unevenness: 0.35,
            directed: 0.25,
            wander: 0.072,
            roughness: 0.06,
            arrest: 0.019,
            open_ends: 0.18,
            nucleation: 0.7,
            variety: 0.35,
            width_variety: 0.25,
            max_nodes: 40_000,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.003, wall: 0.5, rim_width: 0.0, rim_depth: 0.0, faintest: 0.0 },
        look: Look::TEMPERED_GLASS,
        steps_per_second: 240.0,
        follows_lines: false,
    };

    /// Laminated glass: a dense web of radials and rings around the hit, which holds together.
    pub const LAMINATED_GLASS: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.024,
            step_length: 0.018,
            crack_radius: 0.2,
            num_iterations: 120,
            markers: MarkerLayout::Polar { sectors: 34, rings: 18, ring_growth: 1.14, jitter: 0.85, occupancy: 1.0 },
            reach: 0.6,
            starts: StartLayout::Crushed { count: 30, radius: 0.035 },
            line_width: 0.0022,
            line_growth: 0.8,
            murray: 2.6,
            max_width: 0.008,
            unevenness: 0.3,
            wander: 0.05,
            roughness: 0.04,
            draw_connections: true,
            connection_gaps: 0.1,
            chips: 0.15,
            connection_every: 1,
            arrest: 0.02,
            variety: 0.2,
            width_variety: 0.2,
            inertia: 1.2,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.003, wall: 0.5, rim_width: 0.0, rim_depth: 0.0, faintest: 0.0 },
        look: Look::LAMINATED_GLASS,
        steps_per_second: 120.0,
        follows_lines: false,
    };

    /// Dry clay: long cracks first, shorter ones between them, which end at them: cells that do not all close.
    ///
    /// Couto et al. use `kill_distance` 0.08, `D` 0.8, `num_iterations` 100, `crack_radius` 0.4, a grid of 20 x 20,
    /// `line_growth` 0.5 and `draw_islands`, in a unit that they do not give.
    pub const CLAY: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.05,
            step_length: 0.02,
            crack_radius: 0.21,
            markers: MarkerLayout::DartThrowing { spacing: 0.025 },
            reach: 2.0,
            starts: StartLayout::Points { count: 12 },
            line_width: 0.0085,
            line_growth: 0.5,
            murray: 2.5,
            max_width: 0.04,
            tip_taper: 0.2,
            unevenness: 0.11,
            directed: 0.24,
            inertia: 4.0,
            wander: 0.063,
            roughness: 0.056,
            draw_islands: true,
            island_distance: 0.11,
            arrest: 0.08,
            open_ends: 0.3,
            nucleation: 1.03,
            variety: 0.45,
            width_variety: 0.4,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.02, wall: 0.7, rim_width: 0.012, rim_depth: 0.12, faintest: 0.0 },
        look: Look::CLAY,
        steps_per_second: 40.0,
        follows_lines: false,
    };

    /// Mud: wide cracks that close into rounded cells.
    pub const MUD: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.0285,
            step_length: 0.0154,
            crack_radius: 0.089,
            markers: MarkerLayout::DartThrowing { spacing: 0.056 },
            venation: Venation::Closed,
            reach: 3.0,
            starts: StartLayout::Points { count: 3 },
            line_width: 0.0083,
            line_growth: 0.157,
            murray: 2.28,
            max_width: 0.04,
            tip_taper: 0.25,
            unevenness: 0.33,
            directed: 0.17,
            wander: 0.06,
            roughness: 0.032,
            arrest: 0.035,
            open_ends: 0.025,
            nucleation: 0.44,
            variety: 0.48,
            width_variety: 0.31,
            spurs: 0.1,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.022,
            wall: 0.75,
            rim_width: 0.014,
            rim_depth: 0.12,
            faintest: 0.0,
        },
        look: Look::MUD,
        steps_per_second: 40.0,
        follows_lines: false,
    };

    /// The glaze of pottery: fine, nearly straight cracks, each ending at an older one.
    pub const GLAZE: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.04,
            step_length: 0.02,
            crack_radius: 0.15,
            markers: MarkerLayout::DartThrowing { spacing: 0.042 },
            reach: 3.0,
            starts: StartLayout::Points { count: 4 },
            line_width: 0.005,
            line_growth: 0.25,
            murray: 2.5,
            max_width: 0.05,
            tip_taper: 0.3,
            unevenness: 0.17,
            inertia: 5.0,
            directed: 0.25,
            wander: 0.04,
            roughness: 0.08,
            draw_islands: true,
            island_distance: 0.09,
            arrest: 0.12,
            open_ends: 0.4,
            nucleation: 0.6,
            variety: 0.5,
            width_variety: 0.2,
            spurs: 0.1,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.003, wall: 0.4, rim_width: 0.0, rim_depth: 0.0, faintest: 0.0 },
        look: Look::STAIN,
        steps_per_second: 60.0,
        follows_lines: false,
    };

    /// Ice: a crushed white spot, long straight bright cracks that run far and meet at clear angles, fine ones between them.
    pub const ICE: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.04,
            step_length: 0.02,
            crack_radius: 0.3,
            markers: MarkerLayout::Polar { sectors: 13, rings: 9, ring_growth: 1.12, jitter: 1.0, occupancy: 0.8 },
            reach: 1.8,
            starts: StartLayout::Crushed { count: 34, radius: 0.02 },
            line_width: 0.0055,
            line_growth: 0.35,
            murray: 2.6,
            max_width: 0.014,
            unevenness: 0.35,
            inertia: 1.5,
            wander: 0.17,
            roughness: 0.06,
            draw_connections: true,
            connection_gaps: 0.5,
            connection_every: 3,
            arrest: 0.035,
            tip_taper: 0.35,
            variety: 0.3,
            width_variety: 0.3,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 1.0, full_width: 0.006, wall: 0.6, rim_width: 0.0, rim_depth: 0.0, faintest: 0.0 },
        look: Look::ICE,
        steps_per_second: 90.0,
        follows_lines: false,
    };

    /// Cartoon: few bold, smooth, tapering cracks with an outline.
    pub const TOON: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.07,
            step_length: 0.04,
            crack_radius: 0.5,
            markers: MarkerLayout::Polar { sectors: 7, rings: 6, ring_growth: 1.2, jitter: 0.7, occupancy: 1.0 },
            reach: 0.5,
            line_width: 0.006,
            line_growth: 3.0,
            murray: 1.6,
            max_width: 0.04,
            wander: 0.5,
            roughness: 0.0,
            arrest: 0.05,
            variety: 0.2,
            width_variety: 0.2,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.0005,
            wall: 1.0,
            rim_width: 0.0055,
            rim_depth: 0.5,
            faintest: 0.0,
        },
        look: Look::TOON,
        steps_per_second: 30.0,
        follows_lines: false,
    };

    /// The same material seen from nearer (`by` above 1) or further away: every length times `by`, as
    /// [`GrowthParams::scaled`].
    ///
    /// Lengths are shares of the surface's shorter side, so on a wall that is four times as large as another, both ways, the same preset looks four times as
    /// coarse: `CrackPreset::MUD.scaled(0.25)` there.
    ///
    /// ```
    /// use bevy_crack::CrackPreset;
    ///
    /// let fine = CrackPreset::MUD.scaled(0.25);
    /// assert_eq!(fine.growth.line_width, 0.25 * CrackPreset::MUD.growth.line_width);
    /// assert_eq!(fine.validate(), Ok(()));
    /// ```
    #[must_use]
    pub fn scaled(&self, by: f32) -> Self {
        let growth = self.growth.scaled(by);
        let by = growth.step_length / self.growth.step_length;
        let Profile { full_width, rim_width, .. } = self.profile;
        let profile = Profile { full_width: full_width * by, rim_width: rim_width * by, ..self.profile };
        let crushed = self.look.crushed.map(|crushed| crushed.scaled(by));
        let veil = self.look.veil.map(|veil| veil.scaled(by));
        let look = Look { crushed, veil, ..self.look.clone() };
        Self { growth, profile, look, ..self.clone() }
    }

    /// The preset of this name (lower case), see [`NAMES`](Self::NAMES).
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "glass" => Some(Self::GLASS),
            "tempered_glass" => Some(Self::TEMPERED_GLASS),
            "laminated_glass" => Some(Self::LAMINATED_GLASS),
            "concrete" => Some(Self::CONCRETE),
            "plaster" => Some(Self::PLASTER),
            "brick" => Some(Self::BRICK),
            "clay" => Some(Self::CLAY),
            "mud" => Some(Self::MUD),
            "glaze" => Some(Self::GLAZE),
            "ice" => Some(Self::ICE),
            "toon" => Some(Self::TOON),
            _ => None,
        }
    }
}

impl Default for CrackPreset {
    fn default() -> Self {
        Self::CONCRETE
    }
}
