//! Cracks in a surface with a normal map of its own, blended in each way, side by side.

use crate::{painting::fitted, pictures::read_picture};
use bevy_crack::{
    blend::NormalBlending,
    paint::{BaseTexels, Look, LookTable, PaintTargets, correct_normals, paint_into},
    raster::{DepthField, TexelRect},
    voronoi::{FONT, draw_text},
};
use glam::{UVec2, Vec3};
use image::{
    Rgba, RgbaImage,
    imageops::{overlay, replace},
};
use std::{error::Error, path::Path};

const ALL: [(NormalBlending, &str); 3] =
    [(NormalBlending::Plain, "plain"), (NormalBlending::Whiteout, "whiteout"), (NormalBlending::Poisson, "poisson")];

const PAPER: Rgba<u8> = Rgba([24, 26, 30, 255]);
const INK: Rgba<u8> = Rgba([214, 216, 220, 255]);
const GAP: u32 = 6;
const LABEL: u32 = 26;
const LETTERS: f32 = 18.0;

/// Writes `normal_plain.png`, `normal_whiteout.png`, `normal_poisson.png`, and `normals.png`: the three side by side, as
/// maps, and lit from the upper left without colours.
pub(crate) fn write_blended(
    folder: &Path,
    normals: &Path,
    field: &mut DepthField,
    look: &Look,
) -> Result<(), Box<dyn Error>> {
    let size = field.frame.size();
    let normals = fitted(read_picture(normals)?, size);
    let base = BaseTexels { size, diffuse: &[], normal: Some(normals.as_raw()), depth: None };
    correct_normals(base, field, UVec2::ZERO)?;
    let step = UVec2::new(size.x + GAP, size.y + GAP);
    let mut sheet = RgbaImage::from_pixel(3 * step.x + GAP, 2 * step.y + LABEL + GAP, PAPER);
    for (column, (blending, name)) in (0..).zip(ALL) {
        let look = Look { normals: blending, ..look.clone() };
        let table = LookTable::new(&look, field.frame.texels_per_unit())?;
        let mut painted = RgbaImage::new(size.x, size.y);
        let mut targets = PaintTargets { diffuse: None, normal: Some(&mut painted), depth: None };
        paint_into(base, field, &table, TexelRect::whole(size), UVec2::ZERO, &mut targets);
        painted.save(folder.join(format!("normal_{name}.png")))?;
        let x = GAP + column * step.x;
        label(&mut sheet, name, UVec2::new(x, 0), UVec2::new(size.x, LABEL));
        replace(&mut sheet, &lit(&painted), x.into(), LABEL.into());
        replace(&mut sheet, &painted, x.into(), (LABEL + step.y).into());
    }
    sheet.save(folder.join("normals.png"))?;
    Ok(())
}

/// A grey surface with these normals in raking light from the upper left.
fn lit(normals: &RgbaImage) -> RgbaImage {
    let light = Vec3::new(-0.55, 0.55, 0.63).normalize();
    RgbaImage::from_fn(normals.width(), normals.height(), |x, y| {
        let [r, g, b, _] = normals.get_pixel(x, y).0.map(|byte| f32::from(byte) / 127.5 - 1.0);
        let shade = (255.0 * (0.08 + 0.9 * Vec3::new(r, g, b).dot(light).max(0.0)).min(1.0).sqrt()) as u8;
        Rgba([shade, shade, shade, 255])
    })
}

fn label(sheet: &mut RgbaImage, name: &str, corner: UVec2, size: UVec2) {
    let Some(letters) = draw_text(FONT, name, size, LETTERS) else { return };
    let ink = RgbaImage::from_fn(size.x, size.y, |x, y| {
        let cover = letters.get(x, y).unwrap_or(0.0);
        let Rgba([r, g, b, _]) = INK;
        Rgba([r, g, b, (255.0 * cover) as u8])
    });
    overlay(sheet, &ink, corner.x.into(), corner.y.into());
}
