//! Impacts, and what becomes of hits.

use glam::Vec2;

/// The most energy that an impact gathers.
pub const MAX_ENERGY: f32 = 16.0;

/// How many times wider the cracks of an impact are than those of one of energy 1.
pub(super) fn widening(energy: f32) -> f32 {
    energy.sqrt().sqrt().clamp(0.25, 2.0)
}

/// One impact on a growth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Where, pattern units.
    pub pos: Vec2,
    /// Sum of the energies of all hits merged into it, at most [`MAX_ENERGY`].
    pub energy: f32,
    /// Energy of the first of them.
    pub first_energy: f32,
    /// How many times wider its cracks are than those of an impact of energy 1: the fourth root of its energy.
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
    /// It lies off the surface.
    #[error("it lies off the surface")]
    OffSurface,
    /// Cracks are forbidden there.
    #[error("cracks are forbidden there")]
    Forbidden,
    /// The surface has all the nodes it may have.
    #[error("the surface has all the nodes it may have")]
    Full,
}

/// What became of a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HitOutcome {
    /// It became the impact with this index.
    Started(u32),
    /// It fell on the impact with this index and added its energy to it.
    Merged(u32),
    /// Its energy is zero: nothing happens.
    Nothing,
    /// It was refused.
    Rejected(Rejected),
}
