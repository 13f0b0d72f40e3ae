//! A base picture and a depth field to diffuse, normal and depth texels.
//!
//! Every painted texel is a function of the base picture, of the depth field in the 3 x 3 texels around it, and of what the
//! field holds beside depths at the texel itself (the closed cell it lies in, what a hit has crushed, veils), so a
//! dirty rectangle painted alone equals the whole painted anew, bit for bit. Where the field is untouched, the
//! painted texel is the base texel.

mod cel;
mod diffuse;
mod extras;
mod facets;
mod glow;
mod look;
mod looks;
mod modulate;
mod patch;
mod range;
mod rows;
mod table;
#[cfg(test)]
mod tests;
mod texel;

pub use cel::Cel;
pub use facets::Facets;
pub use glow::paint_glow;
pub use look::{ColorStop, Look};
pub use modulate::{Modulation, modulate};
pub use range::LookError;
pub use table::LookTable;
pub use texel::{BaseTexels, PaintTargets, paint_into, paint_rects};
