//! Every preset on its own picture, at three moments after a hit, on one sheet; made without an engine.

use crate::{
    own::{exhibit, own_picture},
    painting::{covering, paint},
    pictures::read_picture,
};
use bevy_crack::{
    CrackPreset,
    growth::CrackGrowth,
    paint::LookTable,
    pattern::{CrackMask, Moment, SurfaceFrame},
    raster::{DepthField, stamp_path},
    voronoi::{FONT, draw_text},
};
use glam::{UVec2, Vec2};
use image::{
    Rgba, RgbaImage,
    imageops::{self, FilterType},
};
use std::{error::Error, sync::Arc};

/// Side of each picture where nobody says otherwise, texels.
pub(crate) const SIDE: u32 = 224;

/// Shares of all steps at which the cracks are shown.
const MOMENTS: [f32; 3] = [0.15, 0.4, 1.0];

/// Presets side by side.
const COLUMNS: u32 = 2;

/// Where the one hit lands, and how hard it is.
const HIT: Vec2 = Vec2::new(0.46, 0.53);
const HARD: f32 = 3.0;

const PAPER: Rgba<u8> = Rgba([24, 26, 30, 255]);
const INK: [f32; 3] = [214.0, 216.0, 220.0];
const GAP: u32 = 4;
const LABEL: u32 = 28;
const LETTERS: f32 = 20.0;

/// The sheet of the presets of these names; `side` is that of each picture, texels.
pub(crate) fn draw(names: &[&str], seed: u64, side: u32) -> Result<RgbaImage, Box<dyn Error>> {
    let block = UVec2::new(MOMENTS.len() as u32 * (side + GAP) + 4 * GAP, side + LABEL + 2 * GAP);
    let columns = COLUMNS.min(names.len() as u32);
    let rows = (names.len() as u32).div_ceil(COLUMNS);
    let mut sheet = RgbaImage::from_pixel(columns * block.x, rows * block.y, PAPER);
    for (i, name) in (0..).zip(names) {
        let preset = exhibit(name).ok_or_else(|| format!("no preset `{name}`"))?;
        let corner = UVec2::new(i % COLUMNS, i / COLUMNS) * block + 2 * GAP;
        label(&mut sheet, name, corner, UVec2::new(block.x - 4 * GAP, LABEL));
        for (column, picture) in (0..).zip(moments(&preset, name, seed, side)?) {
            let x = corner.x + column * (side + GAP);
            imageops::overlay(&mut sheet, &picture, x.into(), (corner.y + LABEL).into());
        }
    }
    Ok(sheet)
}

/// The preset's own picture at each moment after a hit.
fn moments(preset: &CrackPreset, name: &str, seed: u64, side: u32) -> Result<Vec<RgbaImage>, Box<dyn Error>> {
    // Painted twice as large: cracks are finer than texels.
    let (small, side) = (side, UVec2::splat(2 * side));
    let base = covering(read_picture(&own_picture(name))?, side);
    let behind = covering(read_picture(&own_picture("clay"))?, side);
    let mask = if preset.follows_lines { CrackMask::from_picture(side, base.as_raw())? } else { CrackMask::default() };
    let mask = Arc::new(mask);
    let frame = SurfaceFrame::new(side)?;
    let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), seed)?;
    growth.set_mask(mask.clone());
    growth.hit(frame.uv_to_pos(HIT), HARD);
    while growth.step().grew() {}
    let table = LookTable::new(&preset.look, frame.texels_per_unit())?;
    let mut pictures = Vec::new();
    for share in MOMENTS {
        let moment = Moment::nearest(f64::from(share) * f64::from(growth.timeline().end()));
        let mut field = DepthField::new(frame);
        field.set_forbidden(&mask);
        field.set_layers(preset.look.layer(seed));
        for segment in growth.network().segments() {
            if let Some(path) = growth.timeline().path_at(growth.network(), segment, moment) {
                stamp_path(&mut field, &preset.profile, &path);
            }
        }
        field.show_layers(growth.network(), growth.timeline(), moment, &mut Vec::new());
        let [cracked, _] = paint(&base, &field, &table);
        // What one sees through panes of glass.
        let mut picture = behind.clone();
        picture.pixels_mut().for_each(|Rgba([r, g, b, _])| {
            (*r, *g, *b) = (*r / 2, (f32::from(*g) * 0.55) as u8, (f32::from(*b) * 0.6) as u8);
        });
        imageops::overlay(&mut picture, &cracked, 0, 0);
        pictures.push(imageops::resize(&picture, small, small, FilterType::Triangle));
    }
    Ok(pictures)
}

/// Writes the name of a preset in the middle of a line.
fn label(sheet: &mut RgbaImage, name: &str, corner: UVec2, size: UVec2) {
    let Some(letters) = draw_text(FONT, &name.replace('_', " "), size, LETTERS) else { return };
    for y in 0..size.y {
        for x in 0..size.x {
            let (cover, at) = (letters.get(x, y).unwrap_or(0.0), corner + UVec2::new(x, y));
            if let Some(Rgba([r, g, b, _])) = sheet.get_pixel_mut_checked(at.x, at.y) {
                for (channel, ink) in [r, g, b].into_iter().zip(INK) {
                    *channel = (f32::from(*channel) * (1.0 - cover) + ink * cover) as u8;
                }
            }
        }
    }
}
