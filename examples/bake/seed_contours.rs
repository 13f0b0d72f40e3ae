//! Seed contours for `bake relief`: shapes with a name, lists of points, outlines in pictures.

use bevy_crack::{
    Grid,
    relief::{ReliefShape, Ring, outlines},
};
use glam::{UVec2, Vec2};
use std::{error::Error, fs, path::Path};

/// Reads `[[x, y], ..]`, pattern units.
fn points(text: &str) -> Result<Vec<Vec<Vec2>>, Box<dyn Error>> {
    let points: Vec<[f32; 2]> = serde_json::from_str(text)?;
    Ok(vec![points.into_iter().map(Vec2::from).collect()])
}

/// The outlines of what is dark in a picture, fitted to the surface.
fn of_picture(path: &Path, extent: Vec2) -> Result<Vec<Vec<Vec2>>, Box<dyn Error>> {
    let picture = image::open(path)?.into_luma8();
    let size = UVec2::from(picture.dimensions());
    let dark = picture.into_raw().into_iter().map(|light| 255.0 - f32::from(light)).collect();
    let dark = Grid::from_vec(size, dark).ok_or("a picture of another size")?;
    let texels = size.min_element() as f32;
    let scale = (extent * texels / size.as_vec2()).min_element();
    let shift = 0.5 * (extent - scale * size.as_vec2() / texels);
    let rings = outlines(&dark, 127.5)?.into_iter().map(|points| Ring { points, level: 0 });
    let rings = rings.filter(|ring| ring.signed_area() * f64::from(texels * texels) > 20.0);
    Ok(rings.map(|ring| ring.points.iter().map(|point| *point * scale + shift).collect()).collect())
}

/// The contours that `name` names: `circle`, `island`, `wall`, or a file.
pub(crate) fn seed_contours(name: &str, extent: Vec2, seed: u64) -> Result<Vec<Vec<Vec2>>, Box<dyn Error>> {
    match name {
        "circle" => Ok(ReliefShape::Circle.contours(extent, seed)),
        "island" => Ok(ReliefShape::Island.contours(extent, seed)),
        "wall" => Ok(ReliefShape::Wall.contours(extent, seed)),
        _ if name.ends_with(".json") => points(&fs::read_to_string(name)?),
        _ => of_picture(name.as_ref(), extent),
    }
}
