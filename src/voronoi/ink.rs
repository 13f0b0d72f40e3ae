//! Pictures as guides.

use crate::Grid;
use glam::UVec2;

fn light(texel: &[u8; 4]) -> f32 {
    (f32::from(texel[0]) * 0.299 + f32::from(texel[1]) * 0.587 + f32::from(texel[2]) * 0.114) / 255.0
}

fn cover(texel: &[u8; 4]) -> f32 {
    f32::from(texel[3]) / 255.0
}

/// Lightness of a picture (rows of RGBA), 0..=1, 0 where it is transparent; `None` if it does not have exactly `size`
/// texels.
///
/// ```
/// use bevy_crack::voronoi::lightness;
///
/// let (white, glass) = ([255, 255, 255, 255], [255, 255, 255, 0]);
/// let light = lightness([2, 1].into(), [white, glass].as_flattened()).unwrap();
/// assert_eq!(light.as_slice(), [1.0, 0.0]);
/// ```
#[must_use]
pub fn lightness(size: UVec2, rgba: &[u8]) -> Option<Grid<f32>> {
    let texels = rgba.as_chunks::<4>().0;
    Grid::from_vec(size, texels.iter().map(|texel| light(texel) * cover(texel)).collect())
}

/// The drawing in a picture (rows of RGBA) as a guide: 1 where it is dark if most of it is light, else 1 where it is
/// light; 0 where it is transparent. In a picture with a transparent background everything else counts as drawing.
/// `None` if the picture does not have exactly `size` texels.
///
/// ```
/// use bevy_crack::voronoi::ink;
///
/// let (paper, pen) = ([255, 255, 255, 255], [0, 0, 0, 255]);
/// let guide = ink([4, 1].into(), [paper, pen, paper, paper].as_flattened()).unwrap();
/// assert_eq!(guide.as_slice(), [0.0, 1.0, 0.0, 0.0]);
/// ```
#[must_use]
pub fn ink(size: UVec2, rgba: &[u8]) -> Option<Grid<f32>> {
    let texels = rgba.as_chunks::<4>().0;
    let (sum, covered) = texels.iter().fold((0.0, 0.0), |(sum, covered), texel| {
        (sum + f64::from(light(texel) * cover(texel)), covered + f64::from(cover(texel)))
    });
    let on_paper = covered > 0.9 * texels.len() as f64;
    let values = texels.iter().map(|texel| {
        let ink = match (on_paper, sum > 0.5 * covered) {
            (false, _) => 1.0,
            (true, true) => 1.0 - light(texel),
            (true, false) => light(texel),
        };
        ink * cover(texel)
    });
    Grid::from_vec(size, values.collect())
}
