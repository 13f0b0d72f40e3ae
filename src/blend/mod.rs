//! Blends the relief of cracks into a surface's own normal map.
//!
//! A normal map stores the slopes of a surface. There are three ways to bring a crack into one
//! ([`NormalBlending`]): its slopes are added to those of the map; both are combined by whiteout blending; or the map's
//! own relief ends at the crack and both are made one surface by solving Poisson's equation for its height (Pérez,
//! Gangnet and Blake 2003, "Poisson Image Editing").
//!
//! - [`blend_relief`] blends a rectangle of heights into a normal map.
//! - [`solve_correction`] does the same for the cracks of a [`DepthField`](crate::raster::DepthField), which
//!   [`paint`](crate::paint) then paints.
//! - [`solve_poisson`] solves the equation itself.
//!
//! ```
//! use bevy_crack::{
//!     Grid,
//!     blend::{NormalBlending, ReliefPatch, blend_relief},
//! };
//! use glam::UVec2;
//!
//! // A slope of 32 x 32 texels, and a groove from top to bottom of a patch of 16 x 16.
//! let size = UVec2::splat(32);
//! let mut normals = [170, 128, 240, 255].repeat(32 * 32);
//! let mut height = Grid::new(UVec2::splat(16), 0.0);
//! for y in 0..16 {
//!     height.row_mut(y)[6..10].copy_from_slice(&[-1.0, -3.0, -3.0, -1.0]);
//! }
//! let patch = ReliefPatch { height: &height, cover: None, origin: UVec2::splat(8) };
//! let before = normals.clone();
//! let changed = blend_relief(&mut normals, size, &patch, NormalBlending::Poisson)?;
//! assert_eq!((changed.min, changed.size()), (UVec2::splat(8), UVec2::splat(16)));
//! assert_eq!(normals[..4 * 8 * 32], before[..4 * 8 * 32], "above the patch nothing changes");
//! assert_ne!(normals, before);
//! # Ok::<(), bevy_crack::blend::BlendError>(())
//! ```

mod correction;
mod error;
mod patch;
mod slopes;
mod solve;
#[cfg(test)]
mod tests;
mod transform;

pub use correction::solve_correction;
pub use error::BlendError;
pub use patch::{ReliefPatch, blend_relief};
pub(crate) use slopes::{cover, slope_of};
pub use solve::solve_poisson;

/// How the slopes of cracks and a surface's own normal map become one.
///
/// ```
/// use bevy_crack::{blend::NormalBlending, paint::Look};
///
/// let look = Look { normals: NormalBlending::Poisson, ..Look::GROOVE };
/// assert_eq!(Look::default().normals, NormalBlending::Plain);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum NormalBlending {
    /// The slopes are added: the surface's own relief continues in the crack. The default.
    #[default]
    Plain,
    /// The horizontal parts of both normals are added and the vertical parts multiplied: steep places of either keep
    /// more of their contrast.
    ///
    /// Barré-Brisebois and Hill 2012, "Blending in Detail", section "Whiteout blending".
    Whiteout,
    /// The surface's own relief gives way to the crack, and both are made one surface without a seam by solving
    /// Poisson's equation.
    Poisson,
}
