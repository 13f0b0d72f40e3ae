//! `bake analogy`: photographs with their guides and a crack pattern in, a surface of the photographs' material out.

use crate::{
    growth::{setting, size},
    painting::fitted,
    pictures::read_picture,
};
use bevy_crack::{
    Grid,
    paint::analogy::{Analogy, AnalogyPair, AnalogyParams, Examples, TexelSource},
    raster::TexelRect,
};
use clap::Args;
use glam::UVec2;
use image::{ImageBuffer, ImageReader, Rgb, Rgba, RgbaImage, imageops};
use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

#[derive(Args)]
pub(crate) struct Options {
    /// A photograph of a cracked material, `A'`; may be given many times
    #[arg(long, required = true)]
    photo: Vec<PathBuf>,
    /// Its guide, `A`: white = crack; as many as photographs, by default the lines that stand out from them
    #[arg(long)]
    mask: Vec<PathBuf>,
    /// Its guide is what is darker than this, 0..=1
    #[arg(long, conflicts_with = "mask")]
    darkness: Option<f32>,
    /// Its heights; as many as photographs
    #[arg(long)]
    height: Vec<PathBuf>,
    /// Its normals; as many as photographs
    #[arg(long)]
    normal: Vec<PathBuf>,
    /// The photographs can be repeated without seams
    #[arg(long)]
    tileable_photo: bool,
    /// The pattern `B`: a picture, white = crack, or a folder that another command has written
    #[arg(long)]
    pattern: PathBuf,
    /// Width and height in texels; by default those of the pattern
    #[arg(long, value_parser = size)]
    size: Option<UVec2>,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A parameter, as in `reach=16`; may be given many times
    #[arg(long, value_parser = setting)]
    set: Vec<(String, String)>,
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out")]
    out: PathBuf,
}

type Done<T> = Result<T, Box<dyn Error>>;

/// Space between the panels of a sheet.
const GAP: u32 = 8;

/// The red channel as shares.
fn shares(picture: &RgbaImage) -> Grid<f32> {
    let values = picture.pixels().map(|texel| f32::from(texel[0]) / 255.0).collect();
    Grid::from_vec(picture.dimensions().into(), values).unwrap_or_else(|| Grid::new(UVec2::ZERO, 0.0))
}

/// The texels of a picture.
pub(crate) fn texels(picture: &RgbaImage) -> Grid<[u8; 4]> {
    let values = picture.pixels().map(|texel| texel.0).collect();
    Grid::from_vec(picture.dimensions().into(), values).unwrap_or_else(|| Grid::new(UVec2::ZERO, [0; 4]))
}

pub(crate) fn picture(texels: &Grid<[u8; 4]>) -> RgbaImage {
    RgbaImage::from_fn(texels.size().x, texels.size().y, |x, y| Rgba(texels.get(x, y).unwrap_or_default()))
}

/// The depths of a pattern: `depth.png` of a folder, or how light a picture is.
fn pattern(path: &Path, size: Option<UVec2>) -> Done<Grid<u16>> {
    let file = if path.is_dir() { path.join("depth.png") } else { path.into() };
    read_picture(&file)?; // Checks the size before memory is taken for 16 bits.
    let mut depth = ImageReader::open(&file)?.with_guessed_format()?.decode()?.to_luma16();
    if let Some(size) = size.filter(|size| UVec2::from(depth.dimensions()) != *size) {
        depth = imageops::resize(&depth, size.x, size.y, imageops::FilterType::Triangle);
    }
    Grid::from_vec(depth.dimensions().into(), depth.into_raw()).ok_or_else(|| "pattern size".into())
}

/// The photograph, its guide beside it.
fn pair(options: &Options, at: usize, photo: &RgbaImage) -> Done<AnalogyPair> {
    let (size, rgba) = (UVec2::from(photo.dimensions()), photo.as_raw());
    let pair = match (options.mask.get(at), options.darkness) {
        (Some(mask), _) => AnalogyPair::new(size, rgba, shares(&read_picture(mask)?))?,
        (None, Some(lightness)) => AnalogyPair::from_darkness(size, rgba, lightness)?,
        (None, None) => AnalogyPair::from_lines(size, rgba)?,
    };
    Ok(if options.tileable_photo { pair.tileable() } else { pair })
}

/// Cracks, white on black.
pub(crate) fn guide_picture(is_crack: impl Fn(u32, u32) -> bool, size: UVec2) -> RgbaImage {
    RgbaImage::from_fn(size.x, size.y, |x, y| {
        let light = if is_crack(x, y) { 255 } else { 0 };
        Rgba([light, light, light, 255])
    })
}

/// Panels side by side.
pub(crate) fn row(panels: &[RgbaImage]) -> RgbaImage {
    let width = panels.iter().map(|panel| panel.width() + GAP).sum::<u32>() + GAP;
    let height = panels.iter().map(RgbaImage::height).max().unwrap_or(0) + 2 * GAP;
    let mut sheet = RgbaImage::from_pixel(width, height, Rgba([120, 130, 150, 255]));
    let mut x = GAP;
    for panel in panels {
        imageops::replace(&mut sheet, panel, i64::from(x), i64::from(GAP));
        x += panel.width() + GAP;
    }
    sheet
}

/// A map of each photograph, of its size.
fn maps(files: &[PathBuf], pairs: &[AnalogyPair]) -> Done<Vec<Grid<[u8; 4]>>> {
    files.iter().zip(pairs).map(|(file, pair)| Ok(texels(&fitted(read_picture(file)?, pair.size())))).collect()
}

/// Writes another map of the photographs, carried over, if there is one for each.
fn carry(analogy: &Analogy, files: &[PathBuf], pairs: &[AnalogyPair], out: &Path) -> Done<()> {
    if files.is_empty() {
        return Ok(());
    }
    let maps = maps(files, pairs)?;
    let carried = analogy.carry(&maps.iter().collect::<Vec<_>>(), [0; 4])?;
    picture(&carried).save(out)?;
    Ok(())
}

pub(crate) fn bake(options: &Options) -> Done<()> {
    let mut params = AnalogyParams::DEFAULT;
    for (name, value) in &options.set {
        params.set(name, value)?;
    }
    let photos = options.photo.iter().map(|path| read_picture(path)).collect::<Done<Vec<_>>>()?;
    let pairs = photos.iter().enumerate().map(|(at, photo)| pair(options, at, photo)).collect::<Done<Vec<_>>>()?;
    let depth = pattern(&options.pattern, options.size)?;

    let clock = Instant::now();
    let examples = Arc::new(Examples::new(&pairs, &params)?);
    let prepared = clock.elapsed();
    let mut analogy = Analogy::new(examples, &depth, &[], options.seed)?;
    analogy.finish();
    let made = clock.elapsed() - prepared;

    fs::create_dir_all(&options.out)?;
    let colors = picture(&analogy.colors());
    colors.save(options.out.join("diffuse.png"))?;
    carry(&analogy, &options.height, &pairs, &options.out.join("height.png"))?;
    carry(&analogy, &options.normal, &pairs, &options.out.join("normal.png"))?;
    let size = analogy.size();
    let sources = ImageBuffer::<Rgb<u16>, _>::from_fn(size.x, size.y, |x, y| {
        let TexelSource { pair, texel: [u, v] } =
            analogy.source(x, y).unwrap_or(TexelSource { pair: TexelSource::NONE, texel: [0; 2] });
        Rgb([u, v, pair])
    });
    sources.save(options.out.join("sources.png"))?;
    let least = ((params.depth * 65535.0) as u16).max(1);
    let mut panels = Vec::new();
    for (photo, pair) in photos.iter().zip(&pairs) {
        let is_crack = |x, y| pair.cracks().get(x, y).is_some_and(|value| value > 0.0 && value >= params.depth);
        panels.extend([guide_picture(is_crack, pair.size()), photo.clone()]);
    }
    panels.extend([guide_picture(|x, y| depth.get(x, y).is_some_and(|depth| depth >= least), size), colors]);
    row(&panels).save(options.out.join("sheet.png"))?;
    let area = TexelRect::whole(size).area() as f64;
    println!(
        "{} pairs in {:.1} ms, {size} texels in {:.1} ms ({:.2} us each); written to {}",
        pairs.len(),
        prepared.as_secs_f64() * 1e3,
        made.as_secs_f64() * 1e3,
        made.as_secs_f64() * 1e6 / area,
        options.out.display()
    );
    Ok(())
}
