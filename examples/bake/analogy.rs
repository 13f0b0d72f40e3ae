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
use image::{GrayImage, ImageBuffer, ImageReader, Luma, Rgb, Rgba, RgbaImage, imageops};
use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

#[derive(Args)]
pub(crate) struct Options {
    /// A pair that ships: clay, concrete or paving; may be given many times, with the parameters of the first
    #[arg(long, required_unless_present = "photo", conflicts_with = "photo")]
    pair: Vec<String>,
    /// A photograph of a cracked material, `A'`; may be given many times
    #[arg(long)]
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
    /// Takes shading out of the photographs that changes over more than about so many texels
    #[arg(long)]
    flatten: Option<u32>,
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
fn texels(picture: &RgbaImage) -> Grid<[u8; 4]> {
    let values = picture.pixels().map(|texel| texel.0).collect();
    Grid::from_vec(picture.dimensions().into(), values).unwrap_or_else(|| Grid::new(UVec2::ZERO, [0; 4]))
}

pub(crate) fn picture(texels: &Grid<[u8; 4]>) -> RgbaImage {
    RgbaImage::from_fn(texels.size().x, texels.size().y, |x, y| Rgba(texels.get(x, y).unwrap_or_default()))
}

/// The depths of a pattern: `depth.png` of a folder, `cracks.png` if there are craters, or how light a picture is. Photographs of
/// cracks have no craters to copy.
fn pattern(path: &Path, size: Option<UVec2>) -> Done<Grid<u16>> {
    let file = match path.join("cracks.png") {
        cracks if path.is_dir() && cracks.exists() => cracks,
        _ if path.is_dir() => path.join("depth.png"),
        _ => path.into(),
    };
    read_picture(&file)?; // Checks the size before memory is taken for 16 bits.
    let mut depth = ImageReader::open(&file)?.with_guessed_format()?.decode()?.to_luma16();
    if let Some(size) = size.filter(|size| UVec2::from(depth.dimensions()) != *size) {
        depth = imageops::resize(&depth, size.x, size.y, imageops::FilterType::Triangle);
    }
    Grid::from_vec(depth.dimensions().into(), depth.into_raw()).ok_or_else(|| "pattern size".into())
}

/// The file of a map of a pair that ships.
fn shipped(name: &str, map: &str) -> PathBuf {
    Path::new(crate::ASSETS).join("analogies").join(format!("{name}{map}.png"))
}

/// A pair that ships.
pub(crate) fn shipped_pair(name: &str) -> Done<AnalogyPair> {
    let photo = read_picture(&shipped(name, ""))?;
    let guide = shares(&read_picture(&shipped(name, "_mask"))?);
    let pair = AnalogyPair::new(photo.dimensions().into(), photo.as_raw(), guide)?;
    Ok(if shipped_file(name)?.contains("is_tileable: true") { pair.tileable() } else { pair })
}

/// The text of the file of a pair that ships.
fn shipped_file(name: &str) -> Done<String> {
    Ok(fs::read_to_string(Path::new(crate::ASSETS).join("analogies").join(format!("{name}.analogy.ron")))?)
}

/// The parameters of a pair that ships.
pub(crate) fn shipped_params(name: &str) -> Done<AnalogyParams> {
    let (file, mut params) = (shipped_file(name)?, AnalogyParams::DEFAULT);
    // Without the engine no reader of such files is at hand.
    let fields = file.split_once("params: (").and_then(|(_, rest)| rest.split_once(')')).map_or("", |(inner, _)| inner);
    for (field, value) in fields.split(',').filter_map(|field| field.split_once(':')) {
        params.set(field.trim(), value)?;
    }
    Ok(params)
}

/// The guide of a pair and its photograph.
pub(crate) fn panels(pair: &AnalogyPair, depth: f32) -> [RgbaImage; 2] {
    let is_crack = |x, y| pair.cracks().get(x, y).is_some_and(|value| value > 0.0 && value >= depth);
    [guide_picture(is_crack, pair.size()), picture(pair.picture())]
}

/// The pattern: white = crack.
pub(crate) fn pattern_panel(depth: &Grid<u16>, params: &AnalogyParams) -> RgbaImage {
    let least = ((params.depth * 65535.0) as u16).max(1);
    guide_picture(|x, y| depth.get(x, y).is_some_and(|depth| depth >= least), depth.size())
}

/// The photograph, its guide beside it.
fn pair(options: &Options, at: usize, photo: &RgbaImage) -> Done<AnalogyPair> {
    let (size, rgba) = (UVec2::from(photo.dimensions()), photo.as_raw());
    let pair = match (options.mask.get(at), options.darkness) {
        (Some(mask), _) => AnalogyPair::new(size, rgba, shares(&read_picture(mask)?))?,
        (None, Some(lightness)) => AnalogyPair::from_darkness(size, rgba, lightness)?,
        (None, None) => AnalogyPair::from_lines(size, rgba)?,
    };
    let pair = if options.tileable_photo { pair.tileable() } else { pair };
    Ok(match options.flatten {
        Some(radius) => pair.flattened(radius)?,
        None => pair,
    })
}

/// Cracks, white on black.
fn guide_picture(is_crack: impl Fn(u32, u32) -> bool, size: UVec2) -> RgbaImage {
    RgbaImage::from_fn(size.x, size.y, |x, y| {
        let light = if is_crack(x, y) { 255 } else { 0 };
        Rgba([light, light, light, 255])
    })
}

fn grey(values: &Grid<u8>) -> GrayImage {
    let size = values.size();
    GrayImage::from_fn(size.x, size.y, |x, y| Luma([values.get(x, y).unwrap_or(0)]))
}

/// Panels side by side.
fn row(panels: &[RgbaImage]) -> RgbaImage {
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
    let mut params = options.pair.first().map_or(Ok(AnalogyParams::DEFAULT), |name| shipped_params(name))?;
    for (name, value) in &options.set {
        params.set(name, value)?;
    }
    let mut pairs = options.pair.iter().map(|name| shipped_pair(name)).collect::<Done<Vec<_>>>()?;
    for (at, path) in options.photo.iter().enumerate() {
        pairs.push(pair(options, at, &read_picture(path)?)?);
    }
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
    for (files, map) in [(&options.height, "height"), (&options.normal, "normal")] {
        let own: Vec<_> = options.pair.iter().map(|name| shipped(name, &format!("_{map}"))).collect();
        let own = if own.iter().all(|file| file.exists()) { own } else { Vec::new() };
        let files = if options.pair.is_empty() { files } else { &own };
        carry(&analogy, files, &pairs, &options.out.join(format!("{map}.png")))?;
    }
    let size = analogy.size();
    let sources = ImageBuffer::<Rgb<u16>, _>::from_fn(size.x, size.y, |x, y| {
        let TexelSource { pair, texel: [u, v] } =
            analogy.source(x, y).unwrap_or(TexelSource { pair: TexelSource::NONE, texel: [0; 2] });
        Rgb([u, v, pair])
    });
    sources.save(options.out.join("sources.png"))?;
    for (at, guide) in (0..pairs.len()).filter_map(|at| analogy.examples().ramp(at)).enumerate() {
        grey(&guide).save(options.out.join(format!("guide_a{at}.png")))?;
    }
    grey(&analogy.ramp()).save(options.out.join("guide_b.png"))?;
    let mut all: Vec<_> = pairs.iter().flat_map(|pair| panels(pair, params.depth)).collect();
    all.extend([pattern_panel(&depth, &params), colors]);
    row(&all).save(options.out.join("sheet.png"))?;
    let area = TexelRect::whole(size).area() as f64;
    println!(
        "{} pairs in {:.1} ms, {size} texels in {:.1} ms ({:.2} us each), guides agree at {:.2} %; written to {}",
        pairs.len(),
        prepared.as_secs_f64() * 1e3,
        made.as_secs_f64() * 1e3,
        made.as_secs_f64() * 1e6 / area,
        100.0 * analogy.agreement(0.1),
        options.out.display()
    );
    Ok(())
}
