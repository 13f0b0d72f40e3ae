//! Seed contours for `bake relief`: shapes with a name, lists of points, outlines in pictures.

use crate::contour_lines::contour_lines;
use bevy_crack::{
    Grid,
    math::{Rng, ops},
};
use glam::{UVec2, Vec2};
use std::{error::Error, fs, path::Path};

/// A closed line around `center`, uneven at all sizes.
fn blob(center: Vec2, radius: f32, points: u16, uneven: f32, rng: &mut Rng) -> Vec<Vec2> {
    let waves: Vec<_> = (2u8..120).map(|k| (f32::from(k), uneven * rng.signed() / f32::from(k), rng.unit())).collect();
    let corner = |i: u16| {
        let angle = std::f32::consts::TAU * f32::from(i) / f32::from(points);
        let wave = |&(k, size, phase): &(f32, f32, f32)| size * ops::cos(k * angle + std::f32::consts::TAU * phase);
        let out = (1.0 + waves.iter().map(wave).sum::<f32>()).clamp(0.35, 1.3);
        center + radius * out * ops::unit(angle)
    };
    (0..points).map(corner).collect()
}

/// Blobs beside each other: the parts of a wall that stand out.
fn wall(extent: Vec2, rng: &mut Rng) -> Vec<Vec<Vec2>> {
    let cells = (extent * 3.0).ceil();
    let cell = extent / cells;
    let places = (0..cells.y as u32).flat_map(|y| (0..cells.x as u32).map(move |x| UVec2::new(x, y).as_vec2()));
    let blobs = places.map(|place| {
        let center = (place + 0.5 + 0.1 * Vec2::new(rng.signed(), rng.signed())) * cell;
        blob(center, cell.min_element() * rng.range(0.26, 0.34), 160, 0.9, rng)
    });
    blobs.collect()
}

/// Reads `[[x, y], ..]`, pattern units.
fn points(text: &str) -> Result<Vec<Vec<Vec2>>, Box<dyn Error>> {
    let points: Vec<[f32; 2]> = serde_json::from_str(text)?;
    Ok(vec![points.into_iter().map(Vec2::from).collect()])
}

/// The outlines of what is dark in a picture, fitted to the surface.
fn outlines(path: &Path, extent: Vec2) -> Result<Vec<Vec<Vec2>>, Box<dyn Error>> {
    let picture = image::open(path)?.into_luma8();
    let size = UVec2::from(picture.dimensions());
    let dark = picture.into_raw().into_iter().map(|light| 255.0 - f32::from(light)).collect();
    let dark = Grid::from_vec(size, dark).ok_or("a picture of another size")?;
    let scale = (extent / size.as_vec2()).min_element();
    let shift = 0.5 * (extent - scale * size.as_vec2());
    let rings = contour_lines(&dark, 127.5, 0);
    let rings = rings.into_iter().filter(|ring| ring.signed_area() > 20.0);
    Ok(rings.map(|ring| ring.points.iter().map(|point| *point * scale + shift).collect()).collect())
}

/// The contours that `name` names: `circle`, `island`, `wall`, or a file.
pub(crate) fn seed_contours(name: &str, extent: Vec2, seed: u64) -> Result<Vec<Vec<Vec2>>, Box<dyn Error>> {
    let mut rng = Rng::new(seed).stream("seed contours");
    let middle = 0.5 * extent;
    match name {
        "circle" => Ok(vec![blob(middle, 0.4, 256, 0.0, &mut rng)]),
        "island" => Ok(vec![blob(middle, 0.34, 700, 0.8, &mut rng)]),
        "wall" => Ok(wall(extent, &mut rng)),
        _ if name.ends_with(".json") => points(&fs::read_to_string(name)?),
        _ => outlines(name.as_ref(), extent),
    }
}
