//! What can be read out of pictures.

use bevy_crack::Grid;
use image::{Rgba, RgbaImage};

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
