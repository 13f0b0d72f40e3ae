//! What is asked: [`VoronoiParams`], [`Guide`], [`SiteLayout`].

use super::lattice::MAX_WEIGHT;
use crate::{Grid, pattern::FrameError};
use glam::Vec2;

/// The most sites that a map has; more are cut to this number.
pub const MAX_SITES: u32 = 1 << 16;

/// The most levels of cracks.
pub const MAX_LEVELS: u32 = 5;

/// How sites are laid out.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[non_exhaustive]
pub enum SiteLayout {
    /// Anywhere, as in the paper: pavement.
    Uniform,
    /// Far from each other (blue noise): drying mud.
    Even,
    /// Denser towards a point, as after an impact.
    Impact {
        /// The point, pattern units.
        at: Vec2,
        /// 1 = half of the sites in the inner half of the radius, 3 = in the inner eighth. 1..=8.
        focus: f32,
    },
    /// By a density image, stretched over the surface; values that are negative or not finite count as zero.
    ///
    /// Where it is zero everywhere, sites are even.
    Density(Grid<f32>),
    /// These points, pattern units; [`VoronoiParams::sites`] is not asked. Points that are not finite are left out.
    Given(Vec<Vec2>),
    /// In pairs on either side of the strokes of the guides, so that a seam must run down the middle of every stroke;
    /// the rest evenly.
    ///
    /// Goes beyond the paper ("automatic mechanisms for placing Voronoi sites to produce images are not available",
    /// section 4). Where no guide has strokes (nothing above a half, or hardly anything else), sites are even.
    Astride,
}

/// A picture that cracks shall follow.
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    /// 0..=1, of any size: stretched over the surface (averaged when it shrinks, linear between its texels when it
    /// grows). Values beyond are cut; what is not a number counts as 0.
    pub image: Grid<f32>,
    /// Weight `γ` of the picture in the cost of an edge. Same unit as [`VoronoiParams::alpha`]; 0 or more.
    ///
    /// The paper uses 4 (α + β), see [`Guide::new`]; less draws the picture more faintly, more hardly changes it.
    pub gamma: f32,
}

impl Guide {
    /// A guide with the paper's weight for the default α and β: 28.
    #[must_use]
    pub const fn new(image: Grid<f32>) -> Self {
        Self { image, gamma: 28.0 }
    }
}

/// Everything that a map of cracks is told, besides size, seed and guides.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
pub struct VoronoiParams {
    /// Weight `α` of the noise in the cost of an edge (Mould 2005, eq. 1). 0..=100 times [`beta`](Self::beta); default 6.
    ///
    /// 0 = cracks are as straight as the lattice allows; larger = more random.
    pub alpha: f32,
    /// Least cost `β` of an edge. 0.001..=1000; default 1. Only its ratio to the other weights matters.
    pub beta: f32,
    /// How many sites, at most [`MAX_SITES`]; default 175.
    pub sites: u32,
    /// Where they lie; default [`SiteLayout::Uniform`].
    pub layout: SiteLayout,
    /// How many generations of cracks (Mould 2005, section 3.2 and fig. 3): each divides the regions of the one before,
    /// with four times as many sites, and has thinner cracks. 1..=[`MAX_LEVELS`]; default 1.
    pub levels: u32,
    /// Size of the largest features of the noise, pattern units, 0.01..=1; default 0.12. Five more octaves follow.
    pub noise_scale: f32,
    /// Width of the widest cracks, pattern units, 0..=0.2; default 0.014. In broad strokes of guides they are wider, see
    /// [`stroke_width`](Self::stroke_width).
    pub width: f32,
    /// Width of the thinnest ones, pattern units, 0..=[`width`](Self::width); default 0.0015.
    pub least_width: f32,
    /// How cracks taper: their width grows with this power of the path cost from the sites (section 3.2), up to full
    /// width where it is dearest. 0..=8; default 2. 0 makes all cracks equally wide.
    pub taper: f32,
    /// How wide a crack down the middle of a guide's stroke is at least, as a share of the stroke's own width; 0..=1, default
    /// 0.45; at most about twice [`width`](Self::width).
    ///
    /// So large letters have wide cracks, and thin parts of a letter are not lost. 0 = as the paper, all cracks by path
    /// cost alone.
    pub stroke_width: f32,
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
        width: 0.014,
        least_width: 0.0015,
        taper: 2.0,
        stroke_width: 0.45,
    };

    /// Checks every parameter, and the weights of `guides`, against their ranges.
    ///
    /// # Errors
    /// Names the first field that is out of its range or not finite.
    pub fn validate(&self, guides: &[Guide]) -> Result<(), VoronoiError> {
        self.validate_with(guides.iter().map(|guide| guide.gamma))
    }

    /// The same with the weights of guides that are not read yet.
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
            ("width", self.width, 0.0, 0.2),
            ("least_width", self.least_width, 0.0, self.width),
            ("taper", self.taper, 0.0, 8.0),
            ("stroke_width", self.stroke_width, 0.0, 1.0),
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

/// Why there is no map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VoronoiError {
    /// A number outside its range, or not finite.
    #[error("`{field}` is {value}, must lie in {min}..={max}")]
    OutOfRange {
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: f32,
        /// Least value allowed.
        min: f32,
        /// Greatest value allowed.
        max: f32,
    },
    /// A size that no surface can have.
    #[error(transparent)]
    Size(#[from] FrameError),
    /// The progress callback asked to stop.
    #[error("cancelled")]
    Cancelled,
}
