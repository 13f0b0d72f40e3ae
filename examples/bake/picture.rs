//! Pictures from outside, and what can be read out of them.

use bevy_crack::Grid;
use image::{ImageReader, Limits, Rgba, RgbaImage};
use std::{error::Error, path::Path};

/// A picture of at most 8192 texels a side and 256 MiB; the header is checked before memory is taken.
pub(crate) fn read_picture(path: &Path) -> Result<RgbaImage, Box<dyn Error>> {
    let named = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let mut reader = ImageReader::open(path).map_err(|error| named(&error))?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(8192);
    limits.max_image_height = Some(8192);
    limits.max_alloc = Some(256 << 20);
    reader.limits(limits);
    let picture = reader.with_guessed_format()?.decode().map_err(|error| named(&error))?;
    Ok(picture.to_rgba8())
}

fn light(texel: &Rgba<u8>) -> f32 {
    (f32::from(texel[0]) * 0.299 + f32::from(texel[1]) * 0.587 + f32::from(texel[2]) * 0.114) / 255.0
}

/// How light a picture is, 0 where it is transparent.
pub(crate) fn lightness(picture: &RgbaImage) -> Option<Grid<f32>> {
    let values = picture.pixels().map(|texel| light(texel) * f32::from(texel[3]) / 255.0);
    Grid::from_vec(picture.dimensions().into(), values.collect())
}

/// The drawing in a picture: 1 where it is dark, if most of it is light, else where it is light; 0 where it is transparent.
pub(crate) fn ink(picture: &RgbaImage) -> Option<Grid<f32>> {
    let cover = |texel: &Rgba<u8>| f32::from(texel[3]) / 255.0;
    let (sum, covered) = picture.pixels().fold((0.0, 0.0), |(sum, covered), texel| {
        (sum + f64::from(light(texel) * cover(texel)), covered + f64::from(cover(texel)))
    });
    // A drawing on nothing is ink itself, whatever its colour.
    let on_paper = covered > 0.9 * f64::from(picture.width()) * f64::from(picture.height());
    let values = picture.pixels().map(|texel| {
        let ink = match (on_paper, sum > 0.5 * covered) {
            (false, _) => 1.0,
            (true, true) => 1.0 - light(texel),
            (true, false) => light(texel),
        };
        ink * cover(texel)
    });
    Grid::from_vec(picture.dimensions().into(), values.collect())
}
