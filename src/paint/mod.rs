//! Paints diffuse, normal and depth texels from a base picture and a depth field.
//!
//! Every painted texel depends only on the base picture, the depth field in the 3 x 3 texels around it (with
//! [cast shadows](Look::cast) also to the left and above, see [`LookTable::affected`]), and the other layers of the field
//! at the texel itself (the closed cell it lies in, crushed zones, veils). So a dirty rectangle
//! painted alone equals the same part of a full repaint, bit for bit. Where the field is untouched, the painted texel
//! is the base texel.
//!
//! Normals of a look that blends by Poisson depend on one thing more: the slopes that [`correct_normals`] has solved for
//! all of the cracks.
//!
//! [`analogy`] makes surfaces in the material of a photograph instead.
//!
//! ```
//! use bevy_crack::{
//!     paint::{BaseTexels, Look, LookTable, PaintTargets, paint_into},
//!     pattern::{PathPoint, SegmentPath, SurfaceFrame},
//!     raster::{DepthField, Profile, TexelRect, stamp_path},
//! };
//! use glam::UVec2;
//!
//! // A grey picture with a crack across its middle.
//! let size = UVec2::new(64, 32);
//! let mut field = DepthField::new(SurfaceFrame::new(size)?);
//! let [from, to] = [0.0, 2.0].map(|x| PathPoint { pos: [x, 0.5].into(), width: 0.1 });
//! stamp_path(&mut field, &Profile::DEFAULT, &SegmentPath::straight(from, to));
//!
//! let picture = [128, 128, 128, 255].repeat(64 * 32);
//! let mut painted = picture.clone();
//! let base = BaseTexels { size, diffuse: &picture, normal: None, depth: None };
//! let look = LookTable::new(&Look::GROOVE, field.frame.texels_per_unit())?;
//! let mut targets = PaintTargets { diffuse: Some(&mut painted), normal: None, depth: None };
//! paint_into(base, &field, &look, TexelRect::whole(size), UVec2::ZERO, &mut targets);
//! assert_eq!(painted[..4], picture[..4], "away from the crack nothing changes");
//! let middle = 4 * (16 * 64 + 32);
//! assert!(painted[middle] < picture[middle], "the crack is darker");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod analogy;
mod cast;
mod cel;
mod diffuse;
mod extras;
mod facets;
mod glow;
mod look;
mod looks;
mod mips;
mod modulate;
mod patch;
mod range;
mod rows;
mod shades;
mod table;
#[cfg(test)]
mod tests;
mod texel;

pub use cel::Cel;
pub use facets::Facets;
pub use glow::paint_glow;
pub use look::{ColorStop, Look};
pub use mips::{MipLevels, TexelKind};
pub use modulate::{Modulation, modulate};
pub use patch::ShownCracks;
pub use range::LookError;
pub use shades::Shades;
pub use table::LookTable;
pub use texel::{BaseTexels, PaintTargets, correct_normals, paint_into, paint_new, paint_rects};
