//! The texel loops.

use super::LookTable;
use crate::raster::{DepthField, TexelRect};
use glam::UVec2;

/// The untouched picture. All slices are row-major over the whole image of `size` texels.
#[derive(Clone, Copy, Debug)]
pub struct BaseTexels<'a> {
    /// Size of the image.
    pub size: UVec2,
    /// RGBA8, sRGB.
    pub diffuse: &'a [u8],
    /// RGBA8 tangent-space normals, linear, +Y up; `None` = flat.
    pub normal: Option<&'a [u8]>,
    /// R8 depth, 255 = bottom; `None` = 0 everywhere.
    pub depth: Option<&'a [u8]>,
}

/// Where to paint. Slices as in [`BaseTexels`], same size; `None` = not wanted.
#[derive(Debug)]
pub struct PaintTargets<'a> {
    /// RGBA8, sRGB.
    pub diffuse: Option<&'a mut [u8]>,
    /// RGBA8 tangent-space normals, linear, +Y up.
    pub normal: Option<&'a mut [u8]>,
    /// R8 depth, 255 = bottom.
    pub depth: Option<&'a mut [u8]>,
}

/// Paints the texels `rect` of `field`, whose top left lies at `origin` in the image (an atlas frame; else zero).
///
/// `rect` is in texels of the field and is clipped to it; texels of the field outside the image are left out.
/// Slices shorter than `size` says are left alone.
pub fn paint_into(
    _base: BaseTexels<'_>,
    _field: &DepthField,
    _look: &LookTable,
    _rect: TexelRect,
    _origin: UVec2,
    _targets: &mut PaintTargets<'_>,
) {
    todo!()
}
