//! Impacts, and the outcome of a hit.

use glam::Vec2;

/// The largest energy that an impact accumulates.
pub const MAX_ENERGY: f32 = 16.0;

/// How many times wider the cracks of an impact with this energy are than those of an impact of energy 1.
pub(super) fn widening(energy: f32) -> f32 {
    energy.sqrt().sqrt().clamp(0.25, 2.0)
}

/// One impact on a surface, with all hits that were merged into it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Position, pattern units.
    pub pos: Vec2,
    /// Sum of the energies of all hits merged into it, at most [`MAX_ENERGY`].
    pub energy: f32,
    /// Energy of the first hit.
    pub first_energy: f32,
    /// How many times wider its cracks are than those of an impact of energy 1: the fourth root of its energy, within
    /// 0.25..=2.
    pub widening: f32,
}

/// Why a hit was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Rejected {
    /// A coordinate or the energy is NaN or infinite.
    #[error("a coordinate or the energy is not finite")]
    NotFinite,
    /// The energy is negative.
    #[error("the energy is negative")]
    NegativeEnergy,
    /// The position is outside the surface.
    #[error("it lies off the surface")]
    OffSurface,
    /// The mask forbids cracks there.
    #[error("cracks are forbidden there")]
    Forbidden,
    /// The surface already has [`max_nodes`](super::GrowthParams::max_nodes) nodes.
    #[error("the surface has all the nodes it may have")]
    Full,
}

/// The outcome of a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HitOutcome {
    /// It started a new impact with this index.
    Started(u32),
    /// It was close to the impact with this index and added its energy to it.
    Merged(u32),
    /// Its energy is zero: nothing happened.
    Nothing,
    /// It was rejected; nothing changed.
    Rejected(Rejected),
}
