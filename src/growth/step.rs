//! The growth itself.

use super::{GrowthParams, ParamError};
use crate::{Grid, pattern::{Network, SegmentId}};
use glam::Vec2;

/// One impact on a growth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Where, pattern units.
    pub pos: Vec2,
    /// Sum of the energies of all hits merged into it, capped at 16.
    pub energy: f32,
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

/// What one step did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepReport {
    /// Number of nodes born.
    pub born: u32,
}

impl StepReport {
    /// Whether anything grew; if not, the growth has ended until the next hit.
    #[must_use]
    pub const fn grew(&self) -> bool {
        self.born > 0
    }
}

/// Where all markers are: the numbers add up to `total`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Census {
    /// Markers ever made.
    pub total: u32,
    /// Reached and removed.
    pub killed: u32,
    /// Attracting a node.
    pub attracting: u32,
    /// Out of every node's reach.
    pub waiting: u32,
}

/// A growing crack pattern on one surface.
#[derive(Clone, Debug)]
pub struct CrackGrowth {
    network: Network,
}

impl CrackGrowth {
    /// A pattern without cracks on a surface of `extent` pattern units.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: GrowthParams, extent: Vec2, seed: u64) -> Result<Self, ParamError> {
        todo!("{params:?} {extent} {seed}")
    }

    /// Where markers may be: the probability over the whole surface (any resolution); `None` = everywhere.
    pub fn set_density(&mut self, _density: Option<Grid<f32>>) {
        todo!()
    }

    /// Hits the surface at `pos` (pattern units). Never grows by itself: call [`step`](Self::step).
    pub fn hit(&mut self, _pos: Vec2, _energy: f32) -> HitOutcome {
        todo!()
    }

    /// One step of growth.
    pub fn step(&mut self) -> StepReport {
        todo!()
    }

    /// Whether another step may grow something.
    #[must_use]
    pub fn is_growing(&self) -> bool {
        todo!()
    }

    /// Nodes and segments so far.
    #[must_use]
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// The impacts so far.
    #[must_use]
    pub fn impacts(&self) -> &[Impact] {
        todo!()
    }

    /// Number of steps made.
    #[must_use]
    pub fn steps(&self) -> u32 {
        todo!()
    }

    /// Indices of the nodes born in the last step.
    #[must_use]
    pub fn newborn(&self) -> std::ops::Range<u32> {
        todo!()
    }

    /// Appends the segments that are new or wider since the last call (each at most once per call), and forgets them.
    pub fn take_changed(&mut self, _changed: &mut Vec<SegmentId>) {
        todo!()
    }

    /// Appends the positions of markers made since the last call, if `draw_markers` is set.
    pub fn take_markers(&mut self, _markers: &mut Vec<Vec2>) {
        todo!()
    }

    /// Where all markers are.
    #[must_use]
    pub fn census(&self) -> Census {
        todo!()
    }

    /// The parameters.
    #[must_use]
    pub fn params(&self) -> &GrowthParams {
        todo!()
    }

    /// Takes up other parameters; what is grown stays.
    ///
    /// # Errors
    /// If a parameter is out of its range; nothing changes then.
    pub fn set_params(&mut self, _params: GrowthParams) -> Result<(), ParamError> {
        todo!()
    }
}
