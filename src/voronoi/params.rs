//! The settings of a map: [`VoronoiParams`], [`Guide`], [`SiteLayout`].

use super::lattice::MAX_WEIGHT;
use crate::{Grid, OutOfMemory, pattern::FrameError};
use glam::Vec2;

/// The largest number of sites of a map; larger numbers are clamped.
pub const MAX_SITES: u32 = 1 << 16;

/// The largest number of levels of cracks.
pub const MAX_LEVELS: u32 = 5;

/// How sites are laid out.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[non_exhaustive]
pub enum SiteLayout {
    /// Uniformly random, as in the paper: pavement.
    Uniform,
    /// Far from each other (blue noise): drying mud.
    Even,
    /// Denser towards a point, as after an impact.
    Impact {
        /// The point, pattern units.
        at: Vec2,
        /// Concentration around the point: 1 = half of the sites in the inner half of the radius, 3 = half in the
        /// inner eighth. 1..=8.
        focus: f32,
    },
    /// By a density image, stretched over the surface. Values that are negative or not finite count as zero.
    ///
    /// If it is zero everywhere, sites are laid out as with `Even`.
    Density(Grid<f32>),
    /// These points, pattern units; [`VoronoiParams::sites`] is not used. Points that are not finite are ignored.
    Given(Vec<Vec2>),
    /// In pairs on both sides of the strokes of the guides, so that a seam must run along the middle of every stroke;
    /// the remaining sites evenly.
    ///
    /// This goes beyond the paper ("automatic mechanisms for placing Voronoi sites to produce images are not
    /// available", section 4). If no guide has strokes (no value above a half, or hardly any other value), sites are
    /// laid out as with `Even`.
    StrokePairs,
}

/// A picture that cracks are to follow.
///
/// ```
/// use bevy_crack::{Grid, voronoi::Guide};
///
/// // A vertical line; cracks follow it.
/// let mut line = Grid::new([9, 9].into(), 0.0);
/// (0..9).for_each(|y| line.row_mut(y)[4] = 1.0);
/// assert_eq!(Guide::new(line).gamma, 28.0);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    /// 0..=1, of any size: stretched over the surface (averaged when it shrinks, linear between its texels when it
    /// grows). Values outside are clamped; NaN counts as 0.
    pub image: Grid<f32>,
    /// Weight `γ` of the picture in the cost of an edge. Same unit as [`VoronoiParams::alpha`]; 0 or more.
    ///
    /// The paper uses 4 (α + β), see [`Guide::new`]. Smaller values draw the picture more faintly; larger values
    /// change little.
    pub gamma: f32,
}

impl Guide {
    /// A guide with the paper's weight for the default α and β: 28.
    #[must_use]
    pub const fn new(image: Grid<f32>) -> Self {
        Self { image, gamma: 28.0 }
    }
}

/// All settings of a map of cracks except size, seed and guides.
///
/// ```
/// use bevy_crack::voronoi::VoronoiParams;
///
/// let params = VoronoiParams { sites: 40, ..VoronoiParams::DEFAULT };
/// assert!(params.validate(&[]).is_ok());
/// let error = VoronoiParams { taper: 9.0, ..params }.validate(&[]).unwrap_err();
/// assert_eq!(error.to_string(), "`taper` is 9, must lie in 0..=8");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
pub struct VoronoiParams {
    /// Weight `α` of the noise in the cost of an edge (Mould 2005, eq. 1). 0..=100 times [`beta`](Self::beta);
    /// default 6.
    ///
    /// 0 = cracks are as straight as the lattice allows; larger = more random.
    pub alpha: f32,
    /// Minimum cost `β` of an edge. 0.001..=1000; default 1. Only its ratio to the other weights matters.
    pub beta: f32,
    /// Number of sites, at most [`MAX_SITES`]; default 175.
    pub sites: u32,
    /// How sites are laid out; default [`SiteLayout::Uniform`].
    pub layout: SiteLayout,
    /// Number of generations of cracks (Mould 2005, section 3.2 and fig. 3). Each divides the regions of the one
    /// before, with four times as many sites and thinner cracks. 1..=[`MAX_LEVELS`]; default 1.
    pub levels: u32,
    /// Size of the largest features of the noise, pattern units, 0.01..=1; default 0.12. Five finer octaves are
    /// added.
    pub noise_scale: f32,
    /// How much of a guide's weight the noise takes away, 0..=1; default 0.85: the cost of an edge is `β + α n + γ g (1 - guide_noise n)`,
    /// n and g being the noise and the guide. 0 = as in the paper (eq. 2): cracks run along the very middle of strokes. With more they wander within
    /// them. A guide whose strokes have a mean width below 32 texels of the map gets less of it, down to 0.3 of it at 18, so that small letters can be read.
    pub guide_noise: f32,
    /// Width of the widest cracks, pattern units, 0..=0.2; default 0.014. They are wider in broad strokes of guides,
    /// see [`stroke_width`](Self::stroke_width).
    pub width: f32,
    /// Width of the thinnest cracks, pattern units, 0..=[`width`](Self::width); default 0.0015. If there are guides the cracks beside them are thinner in
    /// some places, down to an eighth of it, and a tenth of that where they meet a broad stroke.
    pub least_width: f32,
    /// How cracks taper: their width is proportional to this power of the path cost from the sites (section 3.2), up
    /// to full width where the cost is highest. 0..=8; default 2. 0 makes all cracks equally wide if there are no guides. If there are, the cracks beside
    /// them count as cheaper, in some places more than in others, and some of those that leave broad strokes are wider, as their branches.
    pub taper: f32,
    /// Minimum width of a crack along the middle of a guide's stroke, as a share of the stroke's own width; 0..=1,
    /// default 0.45; at most 2.6 times [`width`](Self::width). Where strokes have a mean width of more than 18 texels of the map it is less in places,
    /// from 32 on down to 0.4 of it.
    ///
    /// With it large letters have wide cracks, and thin parts of a letter do not disappear. 0 = the width of all cracks depends on the path cost, as in the
    /// paper, and cracks in broad strokes are down to half as wide in places.
    pub stroke_width: f32,
    /// How far cracks deviate from the boundaries of the regions, in small kinks. Pattern units, 0..=0.02; default 0.005. 0 = cracks run along the
    /// boundaries, as smooth as the noise makes them. Cracks that meet deviate together. Where strokes have a mean width below 32 texels of the map all
    /// of it is less, down to a tenth at 18.
    pub roughness: f32,
}

impl VoronoiParams {
    /// The default: the paper's numbers.
    pub const DEFAULT: Self = Self {
        alpha: 6.0,
        beta: 1.0,
        sites: 175,
        layout: SiteLayout::Uniform,
        levels: 1,
        noise_scale: 0.12,
        guide_noise: 0.85,
        width: 0.014,
        least_width: 0.0015,
        taper: 2.0,
        stroke_width: 0.45,
        roughness: 0.005,
    };

    /// Checks every parameter, and the weights of `guides`, against their ranges.
    ///
    /// # Errors
    /// [`VoronoiError::OutOfRange`] for the first field that is out of its range or not finite.
    pub fn validate(&self, guides: &[Guide]) -> Result<(), VoronoiError> {
        self.validate_with(guides.iter().map(|guide| guide.gamma))
    }

    /// Like [`validate`](Self::validate), for the weights of guides whose images are not loaded yet.
    pub(crate) fn validate_with(&self, gammas: impl Iterator<Item = f32>) -> Result<(), VoronoiError> {
        let focus = match self.layout {
            SiteLayout::Impact { focus, .. } => focus,
            _ => 1.0,
        };
        let at = match self.layout {
            SiteLayout::Impact { at, .. } if !at.is_finite() => f32::NAN,
            _ => 0.0,
        };
        let fields = [
            ("beta", self.beta, 0.001, 1000.0),
            ("alpha", self.alpha, 0.0, 100.0 * self.beta),
            ("levels", self.levels as f32, 1.0, MAX_LEVELS as f32),
            ("noise_scale", self.noise_scale, 0.01, 1.0),
            ("guide_noise", self.guide_noise, 0.0, 1.0),
            ("width", self.width, 0.0, 0.2),
            ("least_width", self.least_width, 0.0, self.width),
            ("taper", self.taper, 0.0, 8.0),
            ("stroke_width", self.stroke_width, 0.0, 1.0),
            ("roughness", self.roughness, 0.0, 0.02),
            ("layout.focus", focus, 1.0, 8.0),
            ("layout.at", at, 0.0, 0.0),
        ];
        for (field, value, min, max) in fields {
            if !(min..=max).contains(&value) {
                return Err(VoronoiError::OutOfRange { field, value, min, max });
            }
        }
        let mut room = (MAX_WEIGHT - 1.0) * self.beta - self.alpha;
        for gamma in gammas {
            if !(0.0..=room).contains(&gamma) {
                return Err(VoronoiError::OutOfRange { field: "gamma", value: gamma, min: 0.0, max: room });
            }
            room -= gamma;
        }
        Ok(())
    }
}

impl Default for VoronoiParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Why a map cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VoronoiError {
    /// A number is outside its range, or not finite.
    #[error("`{field}` is {value}, must lie in {min}..={max}")]
    OutOfRange {
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: f32,
        /// Smallest value allowed.
        min: f32,
        /// Largest value allowed.
        max: f32,
    },
    /// A size that a surface cannot have.
    #[error(transparent)]
    Size(#[from] FrameError),
    /// A link of [`MapCharts`](super::MapCharts) does not join two texels of charts.
    #[error("link {index} does not join two texels of charts")]
    Link {
        /// Its number.
        index: usize,
    },
    /// There is no memory for a map of this size.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
    /// The progress callback asked to stop.
    #[error("cancelled")]
    Cancelled,
}
