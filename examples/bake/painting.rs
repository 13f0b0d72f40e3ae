//! Cracks over a picture.

use bevy_crack::{
    paint::{BaseTexels, LookTable, PaintTargets, paint_into},
    raster::{DepthField, TexelRect},
};
use glam::UVec2;
use image::{
    DynamicImage, RgbaImage,
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

/// A picture that covers `size` without being stretched: repeated if it joins, else its middle.
pub(crate) fn covering(picture: RgbaImage, size: UVec2) -> RgbaImage {
    let side = size.min_element();
    if joins(&picture) && side > 0 {
        let tile = fitted(picture, UVec2::splat(side));
        RgbaImage::from_fn(size.x, size.y, |x, y| *tile.get_pixel(x % side, y % side))
    } else if UVec2::from(picture.dimensions()) == size {
        picture
    } else {
        DynamicImage::from(picture).resize_to_fill(size.x, size.y, FilterType::CatmullRom).into_rgba8()
    }
}

/// Whether a square picture goes on at its left where it ends at its right, and at its top where it ends at its bottom.
fn joins(picture: &RgbaImage) -> bool {
    let side = picture.width();
    if picture.height() != side || side < 3 {
        return false;
    }
    // How much two columns, or rows, differ.
    let step = |is_column: bool, from: u32, to: u32| {
        let texel = |at: u32, along: u32| if is_column { (at, along) } else { (along, at) };
        let light =
            |(x, y): (u32, u32)| picture.get_pixel(x, y).0[..3].iter().map(|channel| u32::from(*channel)).sum::<u32>();
        (0..side).map(|along| light(texel(from, along)).abs_diff(light(texel(to, along)))).sum::<u32>()
    };
    [true, false].into_iter().all(|is_column| {
        let beside = step(is_column, 0, 1).max(step(is_column, side - 2, side - 1));
        10 * step(is_column, side - 1, 0) <= 13 * beside
    })
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
