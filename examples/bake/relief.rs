//! `bake relief`: one contour in; all other contours, heights, pictures and a mesh out.

use crate::{
    birds_eye::{View, birds_eye},
    growth::{setting, size},
    seed_contours::seed_contours,
};
use bevy_crack::{
    Grid,
    pattern::SurfaceFrame,
    relief::{
        Contours, HeightMap, HeightParams, ReliefFrame, ReliefMesh, ReliefParams, ReliefSettings, TerrainColors,
        Weathering, colors, normals, weathered,
    },
};
use clap::Args;
use glam::UVec2;
use image::{ImageBuffer, Luma, RgbaImage};
use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

#[derive(Args)]
pub(crate) struct Options {
    /// circle, island, wall, a JSON list of points, or a picture whose dark outlines are taken
    #[arg(long, default_value = "island")]
    seed_contour: String,
    /// simple, midpoint, fourier or improved
    #[arg(long, default_value = "improved")]
    method: String,
    /// miter, bevel, arc or round
    #[arg(long)]
    join: Option<String>,
    #[arg(long, value_parser = size, default_value = "1024x1024")]
    size: UVec2,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// rock, island or mountain; by default what suits the seed contour
    #[arg(long)]
    colors: Option<String>,
    /// A parameter of contours or heights, as in `distance=0.02`; may be given many times
    #[arg(long, value_parser = setting)]
    set: Vec<(String, String)>,
    /// Level of detail of the mesh: one vertex for 2^detail texels
    #[arg(long, default_value_t = 2)]
    detail: u32,
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out")]
    out: PathBuf,
}

pub(crate) fn save(path: &Path, texels: &Grid<[u8; 4]>) -> Result<(), Box<dyn Error>> {
    let size = texels.size();
    let bytes = texels.as_slice().as_flattened().to_vec();
    RgbaImage::from_raw(size.x, size.y, bytes).ok_or("a picture of another size")?.save(path)?;
    Ok(())
}

/// Heights as a 16-bit picture: black is the lowest, white the highest.
fn save_heights(path: &Path, heights: &Grid<f32>) -> Result<(), Box<dyn Error>> {
    let (low, high) = heights.as_slice().iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (l.min(v), h.max(v)));
    let gray = heights.as_slice().iter().map(|&v| ((v - low) / (high - low).max(1e-9) * 65535.0 + 0.5) as u16);
    let size = heights.size();
    let image: ImageBuffer<Luma<u16>, _> =
        ImageBuffer::from_raw(size.x, size.y, gray.collect::<Vec<_>>()).ok_or("a picture of another size")?;
    image.save(path)?;
    Ok(())
}

fn look(name: &str) -> Result<TerrainColors, String> {
    match name {
        "rock" => Ok(TerrainColors::ROCK),
        "island" => Ok(TerrainColors::ISLAND),
        "mountain" => Ok(TerrainColors::MOUNTAIN),
        _ => Err(format!("`{name}` is none of rock, island and mountain")),
    }
}

/// Settings that suit a seed contour, changed as the options tell.
fn params(options: &Options) -> Result<(ReliefParams, HeightParams, Weathering), Box<dyn Error>> {
    let settings = if options.seed_contour == "wall" { ReliefSettings::rock_wall() } else { ReliefSettings::island() };
    let (mut rings, mut heights) = (settings.contours, settings.heights);
    rings.set("method", &options.method)?;
    if let Some(join) = &options.join {
        rings.set("join", join)?;
    }
    for (name, value) in &options.set {
        if heights.set(name, value).is_err() {
            rings.set(name, value)?;
        }
    }
    Ok((rings, heights, settings.weathering))
}

/// All pictures, texts and meshes of a height field.
fn write(
    options: &Options,
    frame: &SurfaceFrame,
    contours: &Contours,
    heights: &Grid<f32>,
) -> Result<(), Box<dyn Error>> {
    let name = options.colors.as_deref().unwrap_or(if options.seed_contour == "wall" { "rock" } else { "island" });
    let look = look(name)?;
    let out = |name: &str| options.out.join(name);
    fs::create_dir_all(&options.out)?;
    fs::write(out("contours.svg"), contours.to_svg(frame.extent(), 1000.0))?;
    fs::write(out("contours.json"), contours.to_json())?;
    save_heights(&out("height.png"), heights)?;
    save(&out("normal.png"), &normals(heights, frame))?;
    for (file, light) in [("diffuse.png", look.light), ("shaded.png", 1.0)] {
        save(&out(file), &colors(heights, frame, &TerrainColors { light, ..look }, options.seed)?)?;
    }
    let unlit = colors(heights, frame, &TerrainColors { light: 0.0, ..look }, options.seed)?;
    let view = View { sea: look.sea.is_some(), ..if name == "rock" { View::FRONT } else { View::WIDE } };
    birds_eye(heights, &unlit, frame, &view).save(out("birds_eye.png"))?;
    let mesh = ReliefMesh::new(heights, &ReliefFrame::new(frame.extent()), options.detail)?;
    fs::write(out("mesh.obj"), mesh.to_obj())?;
    Ok(())
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let frame = SurfaceFrame::new(options.size)?;
    let (rings, params, weathering) = params(options)?;
    let seeds = seed_contours(&options.seed_contour, frame.extent(), options.seed)?;
    let clock = Instant::now();
    let contours = Contours::generate(&rings, &seeds, options.seed)?;
    let drawn = clock.elapsed();
    let heights = HeightMap::new(&contours, &params, frame, options.seed)?.heights(1);
    let filled = clock.elapsed();
    let heights = weathered(&heights, &frame, &weathering, options.seed)?;
    let worn = clock.elapsed();
    write(options, &frame, &contours, &heights)?;
    println!(
        "{} rings in {:.1} ms, heights in {:.1} ms, weather in {:.1} ms; written to {}",
        contours.rings.len(),
        drawn.as_secs_f64() * 1e3,
        (filled - drawn).as_secs_f64() * 1e3,
        (worn - filled).as_secs_f64() * 1e3,
        options.out.display()
    );
    Ok(())
}
