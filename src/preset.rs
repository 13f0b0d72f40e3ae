//! [`CrackPreset`]: the settings of a material.

mod check;
#[cfg(feature = "serde")]
mod file;
mod modulated;
mod of_strands;

pub use check::PresetError;

use crate::{
    growth::{GrowthParams, MarkerLayout, StartLayout, Venation},
    paint::{Facets, Look},
    raster::Profile,
};

/// The settings of a material, such as glass: how its cracks grow, their cross-section and their look.
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
    /// How cracks grow. Default, as of the other fields: that of [`CONCRETE`](Self::CONCRETE).
    pub growth: GrowthParams,
    /// The cross-section of cracks.
    pub profile: Profile,
    /// How cracks change the picture.
    pub look: Look,
    /// Steps of growth a second, 0..=10000.
    pub steps_per_second: f32,
    /// Whether cracks follow the lines of the picture (mortar, joints) and avoid its transparent parts. A surface
    /// without a mask gets the one [from its picture](crate::pattern::CrackMask::from_picture).
    #[cfg_attr(feature = "serde", serde(default))]
    pub follows_lines: bool,
}

impl CrackPreset {
    /// The names that [`named`](Self::named) knows.
    pub const NAMES: [&'static str; 14] = [
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
        "asphalt",
        "marble",
        "sand",
        "toon",
    ];

    /// Concrete: a few long, rough, branching cracks of uneven width.
    ///
    /// Couto et al. use `kill_distance` 0.08, `D` 1.0, `num_iterations` 100, `crack_radius` 0.4, a grid of 7 x 7 and
    /// `line_growth` 1, in a unit that they do not give.
    pub const CONCRETE: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.02,
            step_length: 0.014,
            crack_radius: 0.15,
            num_lines_grid: 24,
            num_columns_grid: 24,
            markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 1.0 },
            focus: 0.4,
            reach: 0.37,
            reach_variation: 0.5,
            starts: StartLayout::Arms { count: 5 },
            line_width: 0.002,
            line_growth: 0.26,
            murray: 1.55,
            max_width: 0.02,
            tip_taper: 4.0,
            unevenness: 0.6,
            inertia: 1.5,
            wander: 0.7,
            grain: 0.02,
            forks: 0.11,
            fork_angle: 0.7,
            roughness: 0.12,
            arrest: 0.06,
            variety: 0.15,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { wall: 0.7, ragged: 0.0022, chipped: 0.009, rubble: 0.4, edge: 0.4, ..Profile::DEFAULT },
        look: Look::CONCRETE,
        steps_per_second: 60.0,
        follows_lines: false,
    };

    /// Plaster: thin cracks that close into large plates (map cracking), and flakes that have come off.
    pub const PLASTER: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.06,
            step_length: 0.02,
            crack_radius: 0.16,
            num_lines_grid: 26,
            num_columns_grid: 26,
            markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 1.0 },
            venation: Venation::Subdivision,
            generations: 2,
            focus: 0.9,
            reach: 0.34,
            line_width: 0.002,
            line_growth: 0.15,
            murray: 1.8,
            max_width: 0.006,
            unevenness: 0.45,
            inertia: 2.0,
            wander: 0.35,
            grain: 0.06,
            nucleation: 1.0,
            num_iterations: 400,
            tip_taper: 6.0,
            open_ends: 0.06,
            roughness: 0.12,
            arrest: 0.06,
            starts: StartLayout::Arms { count: 4 },
            variety: 0.15,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.012,
            wall: 0.7,
            rim_width: 0.0,
            rim_depth: 0.0,
            faintest: 0.0,
            ragged: 0.0012,
            chipped: 0.006,
            rubble: 0.3,
            edge: 0.4,
            ..Profile::DEFAULT
        },
        look: Look::PLASTER,
        steps_per_second: 60.0,
        follows_lines: false,
    };

    /// Brick: one or two wide cracks that follow the mortar of the picture.
    pub const BRICK: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.02,
            step_length: 0.022,
            crack_radius: 0.18,
            num_lines_grid: 28,
            num_columns_grid: 28,
            markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 1.0 },
            reach: 0.3,
            starts: StartLayout::Arms { count: 4 },
            line_width: 0.0025,
            line_growth: 0.34,
            murray: 1.8,
            max_width: 0.02,
            unevenness: 0.75,
            inertia: 1.5,
            wander: 0.3,
            forks: 0.02,
            roughness: 0.12,
            arrest: 0.06,
            variety: 0.0,
            courses: 0.0625,
            distortion: 0.0048,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.006,
            wall: 0.5,
            rim_width: 0.003,
            rim_depth: 0.08,
            faintest: 0.0,
            ragged: 0.0024,
            ..Profile::DEFAULT
        },
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
            kill_distance: 0.02,
            step_length: 0.0115,
            crack_radius: 0.25,
            num_iterations: 400,
            markers: MarkerLayout::Rays { sectors: 13, jitter: 0.7, through: 0.8 },
            reach: 0.42,
            starts: StartLayout::Crushed { count: 14, radius: 0.016 },
            line_width: 0.0010,
            line_growth: 0.3,
            murray: 1.6,
            max_width: 0.0052,
            unevenness: 0.2,
            wander: 0.03,
            roughness: 0.01,
            draw_connections: true,
            connection_gaps: 0.2,
            connection_every: 3,
            arrest: 0.03,
            variety: 0.15,
            inertia: 0.4,
            tip_taper: 2.0,
            forks: 0.01,
            fork_angle: 0.45,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.003,
            wall: 0.5,
            rim_width: 0.0,
            rim_depth: 0.0,
            faintest: 0.0,
            ..Profile::DEFAULT
        },
        look: Look::GLASS,
        steps_per_second: 120.0,
        follows_lines: false,
    };

    /// Tempered glass: the whole pane breaks into small dice, from the hit outward.
    pub const TEMPERED_GLASS: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.0094,
            step_length: 0.0077,
            crack_radius: 0.02,
            num_iterations: 400,
            num_lines_grid: 107,
            num_columns_grid: 107,
            markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 0.9 },
            venation: Venation::Subdivision,
            focus: 1.0,
            front: 0.008,
            patchiness: 0.8,
            reach: 64.0,
            line_width: 0.0016,
            tip_taper: 0.0,
            line_growth: 0.0,
            max_width: 0.0016,
            unevenness: 0.2,
            inertia: 3.0,
            wander: 0.1,
            roughness: 0.02,
            arrest: 0.02,
            nucleation: 31.0,
            max_nodes: 40_000,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.0026,
            wall: 0.5,
            rim_width: 0.0,
            rim_depth: 0.0,
            faintest: 0.0,
            ..Profile::DEFAULT
        },
        look: Look::TEMPERED_GLASS,
        steps_per_second: 240.0,
        follows_lines: false,
    };

    /// Laminated glass: a dense web of radial cracks and rings around the hit; the pane stays in one piece.
    pub const LAMINATED_GLASS: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.02,
            step_length: 0.0115,
            crack_radius: 0.25,
            num_iterations: 400,
            markers: MarkerLayout::Rays { sectors: 26, jitter: 0.9, through: 0.0 },
            reach: 0.48,
            starts: StartLayout::Crushed { count: 30, radius: 0.012 },
            line_width: 0.0010,
            line_growth: 0.4,
            murray: 2.0,
            max_width: 0.0034,
            unevenness: 0.4,
            wander: 0.05,
            roughness: 0.02,
            draw_connections: true,
            connection_gaps: 0.15,
            connection_every: 1,
            arrest: 0.02,
            open_ends: 1.0,
            variety: 0.15,
            inertia: 0.4,
            tip_taper: 6.0,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.003,
            wall: 0.5,
            rim_width: 0.0,
            rim_depth: 0.0,
            faintest: 0.0,
            ..Profile::DEFAULT
        },
        look: Look::LAMINATED_GLASS,
        steps_per_second: 120.0,
        follows_lines: false,
    };

    /// Dry clay: a dense net of fine cracks; first long ones, then shorter ones between them, which end at the long
    /// ones.
    ///
    /// Couto et al. use `kill_distance` 0.08, `D` 0.8, `num_iterations` 100, `crack_radius` 0.4, a grid of 20 x 20,
    /// `line_growth` 0.5 and `draw_islands`, in a unit that they do not give.
    pub const CLAY: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.026,
            step_length: 0.014,
            crack_radius: 0.3,
            num_lines_grid: 56,
            num_columns_grid: 56,
            markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 0.9 },
            venation: Venation::Subdivision,
            generations: 3,
            three_arm_share: 0.5,
            grain: 0.035,
            reach: 0.37,
            line_width: 0.0078,
            line_growth: 0.05,
            murray: 3.0,
            max_width: 0.016,
            unevenness: 0.5,
            inertia: 3.0,
            wander: 0.25,
            roughness: 0.09,
            arrest: 0.036,
            open_ends: 0.02,
            nucleation: 1.0,
            num_iterations: 400,
            tip_taper: 10.0,
            starts: StartLayout::Arms { count: 4 },
            straightness: 0.75,
            thinning: 0.8,
            width_variation: 0.4,
            focus: 0.6,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.010,
            wall: 0.6,
            rim_width: 0.007,
            rim_depth: 0.08,
            faintest: 0.0,
            ragged: 0.0018,
            ..Profile::DEFAULT
        },
        look: Look::CLAY,
        steps_per_second: 40.0,
        follows_lines: false,
    };

    /// Mud: wide, deep cracks around large plates of four to six sides with curled rims; narrower cracks inside the
    /// plates.
    pub const MUD: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.056,
            step_length: 0.017,
            crack_radius: 0.3,
            num_lines_grid: 30,
            num_columns_grid: 30,
            markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 0.9 },
            venation: Venation::Subdivision,
            generations: 3,
            three_arm_share: 0.5,
            grain: 0.045,
            reach: 0.385,
            line_width: 0.019,
            line_growth: 0.05,
            murray: 3.0,
            max_width: 0.04,
            unevenness: 0.45,
            inertia: 2.0,
            wander: 0.32,
            roughness: 0.10,
            arrest: 0.045,
            open_ends: 0.06,
            nucleation: 2.0,
            num_iterations: 400,
            tip_taper: 10.0,
            starts: StartLayout::Arms { count: 3 },
            straightness: 0.75,
            thinning: 0.8,
            width_variation: 0.4,
            focus: 0.4,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.022,
            wall: 0.8,
            rim_width: 0.024,
            rim_depth: 0.08,
            faintest: 0.0,
            ragged: 0.0034,
            edge: 0.4,
            ..Profile::DEFAULT
        },
        look: Look::MUD,
        steps_per_second: 40.0,
        follows_lines: false,
    };

    /// The glaze of pottery: fine, nearly straight cracks, each ending at an older one.
    pub const GLAZE: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.028,
            step_length: 0.016,
            crack_radius: 0.3,
            num_lines_grid: 52,
            num_columns_grid: 52,
            markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 0.9 },
            venation: Venation::Subdivision,
            generations: 3,
            three_arm_share: 0.25,
            grain: 0.06,
            reach: 0.38,
            line_width: 0.0028,
            tip_taper: 6.0,
            line_growth: 0.0,
            max_width: 0.0028,
            unevenness: 0.5,
            inertia: 3.0,
            wander: 0.18,
            roughness: 0.03,
            arrest: 0.05,
            nucleation: 3.0,
            num_iterations: 400,
            starts: StartLayout::Arms { count: 4 },
            straightness: 0.8,
            thinning: 0.85,
            width_variation: 0.35,
            focus: 0.6,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.0016,
            wall: 0.4,
            rim_width: 0.0,
            rim_depth: 0.0,
            faintest: 0.0,
            ..Profile::DEFAULT
        },
        look: Look::STAIN,
        steps_per_second: 60.0,
        follows_lines: false,
    };

    /// Ice: a crushed white spot, long straight bright cracks that run far and meet at clear angles, fine cracks
    /// between them.
    pub const ICE: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.024,
            step_length: 0.016,
            crack_radius: 0.3,
            num_iterations: 400,
            markers: MarkerLayout::Rays { sectors: 5, jitter: 0.8, through: 1.0 },
            reach: 1.0,
            starts: StartLayout::Crushed { count: 6, radius: 0.006 },
            line_width: 0.0016,
            line_growth: 0.3,
            murray: 1.7,
            max_width: 0.0068,
            unevenness: 0.3,
            wander: 0.06,
            roughness: 0.03,
            arrest: 0.035,
            variety: 0.2,
            inertia: 0.4,
            tip_taper: 4.0,
            forks: 0.055,
            fork_angle: 1.0,
            ..GrowthParams::DEFAULT
        },
        profile: Profile {
            depth: 1.0,
            full_width: 0.006,
            wall: 0.6,
            rim_width: 0.0,
            rim_depth: 0.0,
            faintest: 0.0,
            ..Profile::DEFAULT
        },
        look: Look::ICE,
        steps_per_second: 90.0,
        follows_lines: false,
    };

    /// Cartoon: a ragged star at the hit, and bold zigzag arms that end in points.
    pub const TOON: Self = Self {
        growth: GrowthParams {
            kill_distance: 0.05,
            step_length: 0.048,
            crack_radius: 0.25,
            num_lines_grid: 16,
            num_columns_grid: 16,
            markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 1.0 },
            focus: 0.5,
            reach: 0.33,
            reach_variation: 0.5,
            starts: StartLayout::Arms { count: 5 },
            line_width: 0.0021,
            line_growth: 4.2,
            murray: 1.4,
            max_width: 0.036,
            tip_taper: 0.0,
            inertia: 1.6,
            wander: 0.6,
            zigzag: 0.75,
            forks: 0.18,
            fork_angle: 0.9,
            roughness: 0.0,
            arrest: 0.12,
            open_ends: 1.0,
            variety: 0.2,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { full_width: 0.08, even_walls: true, ..Profile::DEFAULT },
        look: Look::TOON,
        steps_per_second: 30.0,
        follows_lines: false,
    };

    /// The same material at another scale: every length times `by` (above 1 = seen from nearer), as in
    /// [`GrowthParams::scaled`].
    ///
    /// Lengths are shares of the surface's shorter side. So the same preset looks four times as coarse on a wall that
    /// is four times as large in both directions as another one: use `CrackPreset::MUD.scaled(0.25)` there.
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
        let full_width = (self.profile.full_width * by).clamp(0.0001, 1.0);
        let rim_width = (self.profile.rim_width * by).clamp(0.0, 0.2);
        let ragged = (self.profile.ragged * by).clamp(0.0, 0.05);
        let chipped = (self.profile.chipped * by).clamp(0.0, 0.05);
        let profile = Profile { full_width, rim_width, ragged, chipped, ..self.profile };
        let crushed = self.look.crushed.map(|crushed| crushed.scaled(by));
        let veil = self.look.veil.map(|veil| veil.scaled(by));
        let cel = self.look.cel.map(|cel| cel.scaled(by));
        let facets = self.look.facets.map(|facets| Facets {
            fade: (facets.fade * by).clamp(0.0, 16.0),
            thickness: (facets.thickness * by).clamp(0.0, 0.02),
            ..facets
        });
        let full_rim = (self.look.full_rim * by).clamp(0.0, 1.0);
        let look = Look { cel, crushed, veil, facets, full_rim, ..self.look.clone() };
        Self { growth, profile, look, ..self.clone() }
    }

    /// The preset with this name (lower case), see [`NAMES`](Self::NAMES); `None` if there is none.
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
            "asphalt" => Some(Self::ASPHALT),
            "marble" => Some(Self::MARBLE),
            "sand" => Some(Self::SAND),
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
