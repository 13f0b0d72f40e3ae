//! The presets whose cracks are strands.

use super::CrackPreset;
use crate::{
    growth::{GrowthParams, MarkerLayout},
    paint::Look,
    raster::Profile,
    strands::StrandParams,
};

impl CrackPreset {
    /// Asphalt: a few jagged cracks that run far, with branches, like those of a worn road. They are
    /// [strands](crate::strands).
    pub const ASPHALT: Self = Self {
        growth: GrowthParams {
            step_length: 0.012,
            kill_distance: 0.012,
            crack_radius: 0.05,
            num_iterations: 2000,
            markers: MarkerLayout::Strands {
                count: 5,
                strands: StrandParams { length: 0.36, branch_cost: 0.12, child_length: 0.5, ..StrandParams::ASPHALT },
            },
            reach: 0.36,
            line_width: 0.0016,
            line_growth: 0.3,
            murray: 1.8,
            max_width: 0.012,
            tip_taper: 8.0,
            unevenness: 0.6,
            roughness: 0.15,
            arrest: 0.02,
            variety: 0.15,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { wall: 0.4, ragged: 0.002, edge: 0.5, ..Profile::DEFAULT },
        look: Look::ASPHALT,
        steps_per_second: 60.0,
        follows_lines: false,
    };

    /// Marble: fine, sharp cracks with small kinks, that run out straight and divide a few times. They are [strands](crate::strands).
    pub const MARBLE: Self = Self {
        growth: GrowthParams {
            step_length: 0.006,
            kill_distance: 0.006,
            crack_radius: 0.05,
            num_iterations: 2000,
            markers: MarkerLayout::Strands {
                count: 5,
                strands: StrandParams {
                    frequency: 4.0,
                    child_frequency: 4.0,
                    rotation: 0.14,
                    inertia: 0.85,
                    length: 0.42,
                    depth: 2,
                    children: 1,
                    branch_cost: 0.12,
                    child_length: 0.5,
                    spread: 0.03,
                    ..StrandParams::MARBLE
                },
            },
            reach: 0.4,
            line_width: 0.0012,
            line_growth: 0.35,
            murray: 2.0,
            max_width: 0.0055,
            tip_taper: 10.0,
            unevenness: 0.6,
            roughness: 0.2,
            arrest: 0.015,
            variety: 0.15,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { wall: 0.3, ragged: 0.0008, edge: 0.4, ..Profile::DEFAULT },
        look: Look::MARBLE,
        steps_per_second: 80.0,
        follows_lines: false,
    };

    /// Sand: a bowl with a raised rim at the hit, and clods that were thrown out. Its cracks are [strands](crate::strands) that are hardly seen: loose
    /// ground does not split.
    pub const SAND: Self = Self {
        growth: GrowthParams {
            step_length: 0.02,
            kill_distance: 0.02,
            crack_radius: 0.05,
            num_iterations: 2000,
            markers: MarkerLayout::Strands {
                count: 5,
                strands: StrandParams {
                    length: 0.16,
                    branch_cost: 0.12,
                    child_length: 0.5,
                    repulsion: 0.04,
                    ..StrandParams::SAND
                },
            },
            reach: 0.34,
            line_width: 0.0022,
            line_growth: 0.6,
            murray: 2.0,
            max_width: 0.012,
            tip_taper: 10.0,
            unevenness: 0.2,
            roughness: 0.02,
            arrest: 0.03,
            variety: 0.15,
            ..GrowthParams::DEFAULT
        },
        profile: Profile { depth: 0.15, wall: 1.0, ragged: 0.0006, rubble: 0.1, ..Profile::DEFAULT },
        look: Look::SAND,
        steps_per_second: 40.0,
        follows_lines: false,
    };
}
