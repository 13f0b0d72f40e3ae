//! [`Strands`]: a set of strands from settings, field and starts.

use super::{
    bend::bend,
    course::Course,
    error::StrandError,
    field::Directions,
    grow::{MAX_STRAND_POINTS, Paths, Strand, StrandStart},
    params::StrandParams,
    primitive::Primitive,
};
use crate::pattern::Network;
use glam::Vec2;

/// The paths of a set of strands.
///
/// ```
/// use bevy_crack::strands::{Directions, Propagation, Strand, StrandEnd, StrandParams, StrandStart, Strands};
///
/// let starts = [StrandStart::new([0.25, 0.5].into())];
/// let params = StrandParams { rotation: 0.0, inertia: 0.0, length: 0.25, ..StrandParams::DEFAULT };
/// let strands = Strands::new(&params, Directions::Linear([1.0, 0.0].into()), &starts, [1.0, 1.0].into(), 7)?;
/// let strand: &Strand = &strands.strands()[0];
/// assert_eq!(strand.points.last().copied(), Some([0.5, 0.5].into()));
/// assert_eq!((strand.end, strand.parent, strands.extent()), (StrandEnd::Length, None, [1.0, 1.0].into()));
///
/// // A long one that may turn in any direction runs to the border.
/// let params = StrandParams { length: 2.0, propagation: Propagation::Continuous, ..params };
/// let strands = Strands::new(&params, Directions::Linear([1.0, 0.2].into()), &starts, [1.0, 1.0].into(), 7)?;
/// assert_eq!(strands.strands()[0].end, StrandEnd::Border);
/// # Ok::<(), bevy_crack::strands::StrandError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Strands {
    params: StrandParams,
    extent: Vec2,
    seed: u64,
    strands: Vec<Strand>,
    pub(super) courses: Vec<Course>,
}

/// Strands that grow in slices.
#[derive(Clone, Debug)]
pub(crate) struct GrowingStrands(Paths);

impl GrowingStrands {
    /// As [`Strands::new`], with at most about so many points: strands that would need more end there.
    pub(crate) fn new(
        params: &StrandParams,
        directions: Directions,
        starts: &[StrandStart],
        extent: Vec2,
        seed: u64,
        most: usize,
    ) -> Result<Self, StrandError> {
        Paths::new(params, directions, starts, extent, seed, most).map(Self)
    }

    /// Grows them by up to about so many points. Returns whether all have ended.
    pub(crate) fn grow(&mut self, points: u32) -> bool {
        self.0.grow(points)
    }

    /// What has grown.
    pub(crate) fn finish(self) -> Strands {
        let Paths { params, extent, seed, strands, .. } = self.0;
        let mut courses: Vec<Course> = Vec::with_capacity(strands.len());
        for strand in &strands {
            let start = strand.parent.map(|(parent, point)| courses[parent as usize].at(point as f32).0);
            courses.push(Course::new(&params, &strand.points, start));
        }
        Strands { params, extent, seed, strands, courses }
    }
}

impl Strands {
    /// Grows all strands over a surface of `extent` pattern units.
    ///
    /// Strands grow together, one step at a time, in the order of their starts; children follow their parents.
    ///
    /// # Errors
    /// [`StrandError`] if a parameter is out of its range, the directions are empty or not finite, there are too many
    /// starts, or one is not on the surface.
    pub fn new(
        params: &StrandParams,
        directions: Directions,
        starts: &[StrandStart],
        extent: Vec2,
        seed: u64,
    ) -> Result<Self, StrandError> {
        let mut growing = GrowingStrands::new(params, directions, starts, extent, seed, MAX_STRAND_POINTS)?;
        while !growing.grow(u32::MAX) {}
        Ok(growing.finish())
    }

    /// The paths, parents before their children.
    #[must_use]
    pub fn strands(&self) -> &[Strand] {
        &self.strands
    }

    /// Size of the surface, pattern units.
    #[must_use]
    pub const fn extent(&self) -> Vec2 {
        self.extent
    }

    /// The cracks: primitives bent along the paths. A node's birth is its distance from the start along the strands
    /// in units of [`StrandParams::pace`].
    ///
    /// # Errors
    /// [`StrandError::NoPrimitives`] if there are none, [`StrandError::NoSides`] if there are several
    /// [lanes](StrandParams::lanes) and a primitive has no connectors at its sides.
    pub fn network(&self, primitives: &[Primitive]) -> Result<Network, StrandError> {
        if primitives.is_empty() {
            return Err(StrandError::NoPrimitives);
        }
        let lanes = self.params.lanes;
        if let Some(index) = primitives.iter().position(|primitive| lanes > 1 && !primitive.has_sides()) {
            return Err(StrandError::NoSides { lanes, index });
        }
        Ok(bend(&self.params, primitives, (&self.strands, &self.courses), self.extent, self.seed))
    }
}
