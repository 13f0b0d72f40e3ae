//! Cracks over a picture.

use bevy_crack::{
    paint::{BaseTexels, LookTable, PaintTargets, paint_into},
    raster::{DepthField, TexelRect},
};
use glam::UVec2;
use image::{
    RgbaImage,
    imageops::{FilterType, resize},
};

/// A picture stretched to `size`.
pub(crate) fn fitted(picture: RgbaImage, size: UVec2) -> RgbaImage {
    if UVec2::from(picture.dimensions()) == size {
        picture
    } else {
        resize(&picture, size.x, size.y, FilterType::CatmullRom)
    }
}

/// Diffuse and normal of cracks in a picture.
pub(crate) fn paint(base: &RgbaImage, field: &DepthField, table: &LookTable) -> [RgbaImage; 2] {
    let size: UVec2 = base.dimensions().into();
    let (mut diffuse, mut normal) = (RgbaImage::new(size.x, size.y), RgbaImage::new(size.x, size.y));
    paint_into(
        BaseTexels { size, diffuse: base.as_raw(), normal: None, depth: None },
        field,
        table,
        TexelRect::whole(size),
        UVec2::ZERO,
        &mut PaintTargets { diffuse: Some(&mut diffuse), normal: Some(&mut normal), depth: None },
    );
    [diffuse, normal]
}
