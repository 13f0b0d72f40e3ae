//! What can be read out of pictures.

use bevy_crack::{Grid, voronoi};
use image::RgbaImage;

/// How light a picture is, 0 where it is transparent.
pub(crate) fn lightness(picture: &RgbaImage) -> Option<Grid<f32>> {
    voronoi::lightness(picture.dimensions().into(), picture.as_raw())
}

/// The drawing in a picture, see [`voronoi::ink`].
pub(crate) fn ink(picture: &RgbaImage) -> Option<Grid<f32>> {
    voronoi::ink(picture.dimensions().into(), picture.as_raw())
}
