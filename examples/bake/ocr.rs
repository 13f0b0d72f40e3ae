//! Words drawn by cracks, as Tesseract reads them.

use bevy_crack::{
    Grid,
    pattern::SurfaceFrame,
    raster::{DepthField, Profile},
    voronoi::{Guide, SiteLayout, StrokeReport, VoronoiBake, VoronoiParams, draw_text},
};
use glam::UVec2;
use image::GrayImage;
use std::{
    error::Error,
    fs, iter,
    path::{Path, PathBuf},
    process::Command,
};

/// Side of the paper's pictures, texels.
pub(crate) const SIDE: u32 = 400;

/// Deeper than this are the cracks that draw.
const DEEP: u16 = u16::MAX / 2;

/// The cross-section of the cracks that draw.
pub(crate) const PROFILE: Profile = Profile { full_width: 0.014, wall: 0.4, faintest: 0.5, ..Profile::DEFAULT };

/// Whether there is a `tesseract`.
pub(crate) fn can_read() -> bool {
    Command::new("tesseract").arg("--version").output().is_ok_and(|output| output.status.success())
}

/// The letters and digits of each picture, of one line of text.
pub(crate) fn read(pictures: &[PathBuf], folder: &Path) -> Result<Vec<String>, Box<dyn Error>> {
    let list = folder.join("pictures.txt");
    let names: Vec<_> = pictures.iter().map(|picture| picture.to_string_lossy()).collect();
    fs::write(&list, names.join("\n"))?;
    let mut command = Command::new("tesseract");
    let output = command.arg(&list).args(["-", "--psm", "7"]).env("OMP_THREAD_LIMIT", "1").output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let letters = |page: &str| page.chars().filter(|c| c.is_alphanumeric()).collect();
    let pages = text.split('\x0C').map(letters).chain(iter::repeat(String::new()));
    Ok(pages.take(pictures.len()).collect())
}

/// A word as a guide.
pub(crate) fn word(font: &[u8], word: &str) -> Result<Grid<f32>, Box<dyn Error>> {
    Ok(draw_text(font, word, UVec2::splat(SIDE), f32::INFINITY).ok_or("the font cannot be read")?)
}

/// The deep cracks of a word at the paper's size with the paper's number of sites, black on white.
pub(crate) fn draw(
    image: Grid<f32>,
    seed: u64,
    params: VoronoiParams,
) -> Result<(GrayImage, StrokeReport), Box<dyn Error>> {
    let size = image.size();
    let params = VoronoiParams { layout: SiteLayout::StrokePairs, ..params };
    let (map, seams) = VoronoiBake::new(params, vec![Guide::new(image)], size, seed)?.finish();
    let mut field = DepthField::new(SurfaceFrame::new(size)?);
    seams.stamp(&mut field, &PROFILE);
    Ok((deep(&field).ok_or("mask size")?, map.strokes().ok_or("there are no strokes")?))
}

/// The cracks that draw, black on white.
pub(crate) fn deep(field: &DepthField) -> Option<GrayImage> {
    let size = field.depth.size();
    let mask = field.depth.as_slice().iter().map(|&depth| if depth > DEEP { 0 } else { 255 }).collect();
    GrayImage::from_raw(size.x, size.y, mask)
}
