//! Files: presets, textures, films, outlines.

use super::subject::Export;
use crate::{
    plugin::{
        CrackCommandsExt, CrackRecord, CrackShards, CrackSurface, CrackTextures, PresetSource,
        inspect::{Film, recorded},
    },
    shatter::Shards,
};
use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task},
};
use image::{Delay, Frame, RgbaImage, codecs::gif::GifEncoder, codecs::gif::Repeat};
use std::{
    fmt::Write as _,
    fs::{self, File},
    path::{Path, PathBuf},
};

/// Moments of a film, and of a sheet.
const FILM: u32 = 40;
const SHEET: u32 = 16;

/// Milliseconds between two pictures of a film.
const PACE: u32 = 50;

/// Writes the preset of a surface, and says what came of it.
pub(super) fn save_preset(world: &World, entity: Entity, path: &Path) -> String {
    let preset = match world.get::<CrackSurface>(entity).map(|surface| &surface.preset) {
        Some(PresetSource::Inline(preset)) => Some(preset),
        Some(PresetSource::Asset(handle)) => world.get_resource::<Assets<_>>().and_then(|presets| presets.get(handle)),
        None => None,
    };
    let Some(preset) = preset else { return "There is no preset to save.".into() };
    let text = match preset.to_ron() {
        Ok(text) => text,
        Err(error) => return error.to_string(),
    };
    said(path, in_folder(path).and_then(|()| fs::write(path, text).map_err(|error| error.to_string())))
}

fn in_folder(path: &Path) -> Result<(), String> {
    path.parent().map_or(Ok(()), fs::create_dir_all).map_err(|error| error.to_string())
}

fn said(path: &Path, done: Result<(), String>) -> String {
    match done {
        Ok(()) => format!("Wrote {}", path.display()),
        Err(error) => format!("Could not write {}: {error}", path.display()),
    }
}

/// Gives a surface the cracks of a file, and says what came of it.
pub(super) fn load_record(world: &mut World, entity: Entity, path: &Path) -> String {
    let read = fs::read_to_string(path).map_err(|error| error.to_string());
    let record = read.and_then(|text| ron::from_str::<CrackRecord>(&text).map_err(|error| error.to_string()));
    match record {
        Ok(record) => {
            world.commands().entity(entity).heal_cracks().insert(record);
            format!("Read {}", path.display())
        }
        Err(error) => format!("Could not read {}: {error}", path.display()),
    }
}

/// Begins to write; the task says what came of it.
pub(super) fn start(world: &World, entity: Entity, what: Export, folder: PathBuf) -> Result<Task<String>, String> {
    let pool = AsyncComputeTaskPool::try_get().ok_or("There are no threads to write with.")?;
    Ok(match what {
        Export::Maps => {
            let maps = maps(world, entity);
            if maps.is_empty() {
                return Err("There are no textures yet: hit the surface.".into());
            }
            pool.spawn(async move { write_maps(maps, &folder) })
        }
        Export::Gif | Export::Sheet => {
            let film = Film::of(world, entity).ok_or("There are no cracks yet: hit the surface.")?;
            pool.spawn(async move {
                let path = folder.join(if what == Export::Gif { "growth.gif" } else { "growth.png" });
                let done = in_folder(&path).and_then(|()| match what {
                    Export::Gif => write_gif(&film, &path),
                    _ => write_sheet(&film, &path),
                });
                said(&path, done)
            })
        }
        Export::Record => {
            let record = recorded(world, entity).ok_or("There are no cracks yet: hit the surface.")?;
            pool.spawn(async move {
                let path = folder.join(Export::RECORD);
                let text = ron::ser::to_string_pretty(&record, ron::ser::PrettyConfig::default());
                let done = text.map_err(|error| error.to_string()).and_then(|text| {
                    in_folder(&path)?;
                    fs::write(&path, text).map_err(|error| error.to_string())
                });
                said(&path, done)
            })
        }
        Export::Shards => {
            let shards = world.get::<CrackShards>(entity).map(|shards| shards.pieces.clone());
            let shards = shards.ok_or("There are no shards yet: shatter the surface.")?;
            pool.spawn(async move {
                let path = folder.join("shards.svg");
                let done = in_folder(&path);
                said(&path, done.and_then(|()| fs::write(&path, svg(&shards)).map_err(|error| error.to_string())))
            })
        }
    })
}

/// Copies of all textures of a surface.
fn maps(world: &World, entity: Entity) -> Vec<(&'static str, Image)> {
    let (Some(textures), Some(images)) = (world.get::<CrackTextures>(entity), world.get_resource::<Assets<Image>>())
    else {
        return Vec::new();
    };
    let named = ["diffuse", "normal", "depth", "emissive"].into_iter().zip(textures.all());
    named.filter_map(|(name, handle)| Some((name, images.get(handle?)?.clone()))).collect()
}

fn write_maps(maps: Vec<(&'static str, Image)>, folder: &Path) -> String {
    let mut written = Vec::new();
    for (name, image) in maps {
        let path = folder.join(format!("{name}.png"));
        let done = in_folder(&path).and_then(|()| {
            let picture = image.try_into_dynamic().map_err(|error| error.to_string())?;
            picture.save(&path).map_err(|error| error.to_string())
        });
        if done.is_err() {
            return said(&path, done);
        }
        written.push(name);
    }
    format!("Wrote {} into {}", written.join(", "), folder.display())
}

fn write_gif(film: &Film, path: &Path) -> Result<(), String> {
    let size = film.size();
    let file = File::create(path).map_err(|error| error.to_string())?;
    let mut encoder = GifEncoder::new_with_speed(file, 10);
    encoder.set_repeat(Repeat::Infinite).map_err(|error| error.to_string())?;
    for texels in film.pictures(FILM) {
        let picture = RgbaImage::from_raw(size.x, size.y, texels).ok_or("a picture of another size")?;
        let frame = Frame::from_parts(picture, 0, 0, Delay::from_numer_denom_ms(PACE, 1));
        encoder.encode_frame(frame).map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// All moments in one picture, four in a row.
fn write_sheet(film: &Film, path: &Path) -> Result<(), String> {
    let size = film.size();
    let mut sheet = RgbaImage::new(size.x * 4, size.y * SHEET.div_ceil(4));
    for (i, texels) in (0..).zip(film.pictures(SHEET)) {
        let picture = RgbaImage::from_raw(size.x, size.y, texels).ok_or("a picture of another size")?;
        image::imageops::replace(&mut sheet, &picture, i64::from(i % 4 * size.x), i64::from(i / 4 * size.y));
    }
    sheet.save(path).map_err(|error| error.to_string())
}

/// The outlines of shards, holes included; the shorter side of the surface is 1000 units.
fn svg(shards: &Shards) -> String {
    let extent = shards.positions().iter().fold(Vec2::ZERO, |extent, pos| extent.max(*pos)) * 1000.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.1} {:.1}\">\n<g fill=\"#ddd\" stroke=\"#333\" \
         fill-rule=\"evenodd\">\n",
        extent.x, extent.y
    );
    for shard in 0..shards.len() as u32 {
        svg.push_str("<path d=\"");
        for ring in core::iter::once(shards.outline(shard)).chain(shards.holes(shard)) {
            for (i, corner) in ring.iter().enumerate() {
                let Some(pos) = shards.positions().get(*corner as usize) else { continue };
                let _ = write!(svg, "{}{:.2} {:.2}", if i == 0 { "M" } else { "L" }, pos.x * 1000.0, pos.y * 1000.0);
            }
            svg.push('Z');
        }
        svg.push_str("\"/>\n");
    }
    svg.push_str("</g>\n</svg>\n");
    svg
}
