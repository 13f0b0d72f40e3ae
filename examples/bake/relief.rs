//! `bake relief`: one contour in; all other contours, heights, pictures and a mesh out.

use crate::{
    birds_eye::{View, birds_eye},
    growth::{setting, size},
    terrain::Terrain,
};
use bevy_crack::{
    Grid,
    math::{Rng, ops},
    pattern::SurfaceFrame,
    relief::{Contours, HeightMap, HeightParams, Ring, TerrainColors, colors, normals},
};
use clap::Args;
use glam::{UVec2, Vec2};
use image::{ImageBuffer, Luma, RgbaImage};
use std::{error::Error, fs, path::PathBuf, time::Instant};

#[derive(Args)]
pub(crate) struct Options {
    #[arg(long, value_parser = size, default_value = "1024x1024")]
    size: UVec2,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[arg(long)]
    dem: Option<PathBuf>,
    #[arg(long, default_value_t = 12)]
    levels: u16,
    /// rock, island or mountain
    #[arg(long, default_value = "island")]
    colors: String,
    /// A parameter of the heights, as in `step=0.03`; may be given many times
    #[arg(long, value_parser = setting)]
    set: Vec<(String, String)>,
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out")]
    out: PathBuf,
}

/// Nested rings of an uneven mountain, all of one shape.
fn mountain(levels: u16, points: u16, seed: u64) -> Contours {
    let mut rng = Rng::new(seed);
    let waves: Vec<_> = (1u8..60).map(|k| (f32::from(k), 0.6 * rng.signed() / f32::from(k).powf(1.1), rng.unit())).collect();
    let corner = |i: u16, scale: f32| {
        let angle = std::f32::consts::TAU * f32::from(i) / f32::from(points);
        let wave = |&(k, size, phase): &(f32, f32, f32)| size * ops::cos(k * angle + std::f32::consts::TAU * phase);
        Vec2::splat(0.5) + 0.27 * scale * (1.0 + waves.iter().map(wave).sum::<f32>()) * ops::unit(angle)
    };
    let ring = |level: u16| Ring {
        points: (0..points).map(|i| corner(i, 1.0 - f32::from(level) / f32::from(levels))).collect(),
        level: level.into(),
    };
    Contours { rings: (0..levels).map(ring).collect(), distance: 0.34 / f32::from(levels) }
}

fn save(path: PathBuf, texels: &Grid<[u8; 4]>) -> Result<(), Box<dyn Error>> {
    let size = texels.size();
    let bytes = texels.as_slice().as_flattened().to_vec();
    RgbaImage::from_raw(size.x, size.y, bytes).ok_or("a picture of another size")?.save(path)?;
    Ok(())
}

fn save_heights(path: PathBuf, heights: &Grid<f32>) -> Result<(), Box<dyn Error>> {
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

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let frame = SurfaceFrame::new(options.size)?;
    let mut params = HeightParams::DEFAULT;
    for (name, value) in &options.set {
        params.set(name, value)?;
    }
    let look = look(&options.colors)?;
    let mut contours = mountain(16, 512, options.seed);
    let mut frame = frame;
    if let Some(dem) = &options.dem {
        let terrain = Terrain::read(dem)?;
        let step;
        (contours, step) = terrain.contours(options.levels);
        params.step = step * 6.0;
        frame = SurfaceFrame::new(terrain.frame.size() * 2)?;
    }
    let clock = Instant::now();
    let map = HeightMap::new(&contours, &params, frame, options.seed)?;
    let heights = map.heights(1);
    let filled = clock.elapsed();
    let normal = normals(&heights, &frame);
    let shaded = clock.elapsed();
    let diffuse = colors(&heights, &frame, &look, options.seed)?;
    let colored = clock.elapsed();
    fs::create_dir_all(&options.out)?;
    save_heights(options.out.join("height.png"), &heights)?;
    save(options.out.join("normal.png"), &normal)?;
    save(options.out.join("diffuse.png"), &diffuse)?;
    let lit = colors(&heights, &frame, &TerrainColors { light: 1.0, ..look }, options.seed)?;
    save(options.out.join("shaded.png"), &lit)?;
    let plain = colors(&heights, &frame, &TerrainColors { light: 0.0, ..look }, options.seed)?;
    let view = View { sea: look.sea.is_some(), ..View::WIDE };
    birds_eye(&heights, &plain, &frame, &view).save(options.out.join("birds_eye.png"))?;
    println!(
        "{} rings; heights in {:.1} ms, normals in {:.1} ms, colors in {:.1} ms",
        contours.rings.len(),
        filled.as_secs_f64() * 1e3,
        (shaded - filled).as_secs_f64() * 1e3,
        (colored - shaded).as_secs_f64() * 1e3,
    );
    Ok(())
}
