//! [`SeamMotion`]: seams that move as the weights of the guides change.

use super::{Seams, VoronoiError, VoronoiMap};

/// Seams that move while the weights of the guides change from one set to another (Mould 2005, section 6.1 and eq. 4).
///
/// Weights that rise from zero let a picture emerge from plain cracks. Weights of two guides that change in opposite directions turn one
/// picture into the other.
///
/// ```
/// use bevy_crack::{Grid, voronoi::{Guide, SeamMotion, VoronoiBake, VoronoiParams}};
///
/// let mut bar = Grid::new([9, 1].into(), 0.0);
/// bar.row_mut(0)[4] = 1.0;
/// let map = VoronoiBake::new(VoronoiParams::DEFAULT, vec![Guide::new(bar)], [90, 90].into(), 1)?.finish().0;
/// let last = map.seams();
/// let mut emerging = SeamMotion::new(map, vec![0.0], vec![28.0])?;
/// assert_ne!(emerging.at(0.0)?, last);
/// assert_eq!(emerging.at(1.0)?, last);
/// assert_eq!(emerging.into_map().seams(), last);
/// # Ok::<(), bevy_crack::voronoi::VoronoiError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SeamMotion {
    map: VoronoiMap,
    from: Vec<f32>,
    to: Vec<f32>,
}

impl SeamMotion {
    /// The seams of `map` while the weights of its guides change from `from` to `to`, in the unit of
    /// [`Guide::gamma`](super::Guide::gamma). Guides beyond either list keep their weights.
    ///
    /// The cracks that are widest in the map as it is are the widest throughout.
    ///
    /// # Errors
    /// [`VoronoiError::OutOfRange`] if a weight is out of its range.
    pub fn new(mut map: VoronoiMap, from: Vec<f32>, to: Vec<f32>) -> Result<Self, VoronoiError> {
        map.set_gammas(&to)?;
        map.set_gammas(&from)?;
        Ok(Self { map, from, to })
    }

    /// The seams when this share of the way is done, 0..=1; values outside are clamped, and NaN counts as 0.
    ///
    /// The result depends on the share alone. Only what changes since the last call is computed, or all of it on
    /// [`MapCharts`](super::MapCharts) with links.
    ///
    /// # Errors
    /// None: weights between two valid ones are valid. The type is that of [`VoronoiMap::set_gammas`].
    pub fn at(&mut self, share: f32) -> Result<Seams, VoronoiError> {
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        // Exactly the last weights at the end.
        let weights: Vec<f32> =
            self.from.iter().zip(&self.to).map(|(from, to)| from * (1.0 - share) + to * share).collect();
        self.map.set_gammas(&weights)?;
        Ok(self.map.seams())
    }

    /// The map with the weights of the last call.
    #[must_use]
    pub fn into_map(self) -> VoronoiMap {
        self.map
    }
}
