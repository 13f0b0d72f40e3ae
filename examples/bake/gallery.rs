//! `bake gallery`: every preset on its own picture, at three moments, on one sheet.

use crate::{
    growth::own_picture,
    picture::read_picture,
    text::{FONT, draw_text_up_to},
};
use bevy_crack::{
    CrackPreset,
    growth::CrackGrowth,
    paint::{BaseTexels, LookTable, PaintTargets, paint_into},
    pattern::{CrackMask, Moment, SurfaceFrame},
    raster::{DepthField, TexelRect, stamp_path},
};
use clap::Args;
use glam::{UVec2, Vec2};
use image::{
    Rgba, RgbaImage,
    imageops::{self, FilterType},
};
use std::{error::Error, fs, path::PathBuf, sync::Arc};

#[derive(Args)]
pub(crate) struct Options {
    /// Only these presets; by default all
    #[arg(long)]
    preset: Vec<String>,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Side of each picture on the sheet, texels
    #[arg(long, default_value_t = 224, value_parser = clap::value_parser!(u32).range(16..=1024))]
    side: u32,
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out")]
    out: PathBuf,
}

/// Shares of all steps at which the cracks are shown.
const MOMENTS: [f32; 3] = [0.15, 0.4, 1.0];

/// Presets side by side.
const COLUMNS: u32 = 2;

/// Where the one hit lands.
const HIT: Vec2 = Vec2::new(0.46, 0.53);

const PAPER: Rgba<u8> = Rgba([24, 26, 30, 255]);
const INK: [f32; 3] = [214.0, 216.0, 220.0];
const GAP: u32 = 4;
const LABEL: u32 = 28;
const LETTERS: f32 = 20.0;

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let names =
        if options.preset.is_empty() { CrackPreset::NAMES.map(String::from).to_vec() } else { options.preset.clone() };
    let block = UVec2::new(MOMENTS.len() as u32 * (options.side + GAP) + 4 * GAP, options.side + LABEL + 2 * GAP);
    let rows = (names.len() as u32).div_ceil(COLUMNS);
    let columns = COLUMNS.min(names.len() as u32);
    let mut sheet = RgbaImage::from_pixel(columns * block.x, rows * block.y, PAPER);
    for (i, name) in (0..).zip(&names) {
        let preset = CrackPreset::named(name).ok_or_else(|| format!("no preset `{name}`"))?;
        let corner = UVec2::new(i % COLUMNS, i / COLUMNS) * block + 2 * GAP;
        label(&mut sheet, name, corner, UVec2::new(block.x - 4 * GAP, LABEL));
        for (column, picture) in (0..).zip(moments(&preset, name, options)?) {
            let x = corner.x + column * (options.side + GAP);
            imageops::overlay(&mut sheet, &picture, x.into(), (corner.y + LABEL).into());
        }
    }
    fs::create_dir_all(&options.out)?;
    let path = options.out.join("gallery.png");
    sheet.save(&path)?;
    println!("{} presets; written to {}", names.len(), path.display());
    Ok(())
}

/// The preset's own picture at each moment after a hit.
fn moments(preset: &CrackPreset, name: &str, options: &Options) -> Result<Vec<RgbaImage>, Box<dyn Error>> {
    // Painted twice as large: cracks are finer than texels.
    let side = UVec2::splat(2 * options.side);
    let resize = |picture: &RgbaImage| imageops::resize(picture, side.x, side.y, FilterType::CatmullRom);
    let base = resize(&read_picture(&own_picture(name))?);
    let behind = resize(&read_picture(&own_picture("clay"))?);
    let mask = match name {
        "brick" => CrackMask::from_picture(side, base.as_raw())?,
        _ => CrackMask::default(),
    };
    let mask = Arc::new(mask);
    let frame = SurfaceFrame::new(side)?;
    let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), options.seed)?;
    growth.set_mask(mask.clone());
    growth.hit(frame.uv_to_pos(HIT), 1.0);
    while growth.step().grew() {}
    let table = LookTable::new(&preset.look, frame.texels_per_unit())?;
    let mut pictures = Vec::new();
    for share in MOMENTS {
        let moment = Moment::nearest(f64::from(share) * f64::from(growth.timeline().end()));
        let mut field = DepthField::new(frame);
        field.forbid(&mask);
        for segment in growth.network().segments() {
            if let Some(path) = growth.timeline().path_at(growth.network(), segment, moment) {
                stamp_path(&mut field, &preset.profile, &path);
            }
        }
        let mut cracked = RgbaImage::new(side.x, side.y);
        paint_into(
            BaseTexels { size: side, diffuse: base.as_raw(), normal: None, depth: None },
            &field,
            &table,
            TexelRect::whole(side),
            UVec2::ZERO,
            &mut PaintTargets { diffuse: Some(&mut cracked), normal: None, depth: None },
        );
        // What one sees through panes of glass.
        let mut picture = behind.clone();
        picture.pixels_mut().for_each(|Rgba([r, g, b, _])| {
            (*r, *g, *b) = (*r / 2, (f32::from(*g) * 0.55) as u8, (f32::from(*b) * 0.6) as u8);
        });
        imageops::overlay(&mut picture, &cracked, 0, 0);
        pictures.push(imageops::resize(&picture, options.side, options.side, FilterType::Triangle));
    }
    Ok(pictures)
}

/// Writes the name of a preset in the middle of a line.
fn label(sheet: &mut RgbaImage, name: &str, corner: UVec2, size: UVec2) {
    let Some(letters) = draw_text_up_to(FONT, &name.replace('_', " "), size, LETTERS) else { return };
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
