//! `bake guided`: a picture or a word in, textures of cracks that draw it out.

use crate::{
    growth::size,
    pictures::{own_picture, read_picture},
    text::{FONT, draw_text},
};
use bevy_crack::{
    Grid,
    paint::{BaseTexels, Look, LookTable, PaintTargets, paint_into},
    pattern::SurfaceFrame,
    raster::{DepthField, Profile, TexelRect},
    voronoi::{Guide, SiteLayout, VoronoiBake, VoronoiMap, VoronoiParams},
};
use clap::{Args, ValueEnum};
use glam::{UVec2, Vec2};
use image::{GrayImage, ImageBuffer, Luma, Rgba, RgbaImage, imageops::FilterType};
use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

#[derive(Args)]
pub(crate) struct Options {
    /// A picture to follow, IMG or IMG:GAMMA; the darker part is the drawing where the picture is mostly light; may be given many times
    #[arg(long, value_parser = guide)]
    guide: Vec<(PathBuf, f32)>,
    /// A word to draw, with \n between lines; may be given many times
    #[arg(long)]
    text: Vec<String>,
    /// Weight of the words
    #[arg(long, default_value_t = 28.0)]
    gamma: f32,
    /// The font of the words, TTF or OTF; by default the one that ships with the crate
    #[arg(long)]
    font: Option<PathBuf>,
    #[arg(long, default_value_t = 175)]
    sites: u32,
    #[arg(long, value_enum)]
    layout: Option<Layout>,
    /// Where the impact is, u,v
    #[arg(long, value_parser = pair, default_value = "0.5,0.5")]
    at: Vec2,
    /// Generations of cracks, 1 to 5
    #[arg(long, default_value_t = 1)]
    levels: u32,
    /// Weight of the noise
    #[arg(long, default_value_t = 6.0)]
    alpha: f32,
    /// Width of the widest crack, in shares of the shorter side
    #[arg(long)]
    width: Option<f32>,
    #[arg(long, value_parser = size, default_value = "400x400")]
    size: UVec2,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The picture to crack; by default plain concrete
    #[arg(long)]
    base: Option<PathBuf>,
    /// groove, frosted or toon
    #[arg(long, default_value = "groove")]
    look: String,
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out")]
    out: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Layout {
    Uniform,
    Even,
    Impact,
    Image,
    Astride,
}

fn guide(text: &str) -> Result<(PathBuf, f32), String> {
    match text.rsplit_once(':') {
        Some((path, gamma)) if !path.is_empty() && gamma.parse::<f32>().is_ok() => {
            Ok((path.into(), gamma.parse().map_err(|error| format!("{gamma}: {error}"))?))
        }
        _ => Ok((text.into(), 28.0)),
    }
}

fn pair(text: &str) -> Result<Vec2, String> {
    let (u, v) = text.split_once(',').ok_or("a place is U,V")?;
    let number = |text: &str| text.trim().parse::<f32>().map_err(|error| format!("{text}: {error}"));
    Ok(Vec2::new(number(u)?, number(v)?))
}

/// The drawing in a picture: 1 where it is dark on light (or light on dark), where transparent 0.
pub(crate) fn ink(picture: &RgbaImage) -> Option<Grid<f32>> {
    let light = |p: &Rgba<u8>| (f32::from(p[0]) * 0.299 + f32::from(p[1]) * 0.587 + f32::from(p[2]) * 0.114) / 255.0;
    let n = picture.pixels().len().max(1) as f32;
    let mean = picture.pixels().map(|p| light(p) as f64).sum::<f64>() as f32 / n;
    let values = picture.pixels().map(|p| {
        let value = if mean > 0.5 { 1.0 - light(p) } else { light(p) };
        value * f32::from(p[3]) / 255.0
    });
    Grid::from_vec(picture.dimensions().into(), values.collect())
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let font = options.font.as_ref().map(fs::read).transpose()?;
    let mut guides = Vec::new();
    for (path, gamma) in &options.guide {
        let image = ink(&read_picture(path)?).ok_or("picture size")?;
        guides.push(Guide { image, gamma: *gamma });
    }
    for text in &options.text {
        let text = text.replace("\\n", "\n");
        let image = draw_text(font.as_deref().unwrap_or(FONT), &text, options.size, f32::INFINITY)
            .ok_or("the font cannot be read")?;
        guides.push(Guide { image, gamma: options.gamma });
    }
    let frame = SurfaceFrame::new(options.size)?;
    let layout = match options.layout {
        Some(Layout::Uniform) => SiteLayout::Uniform,
        None if guides.is_empty() => SiteLayout::Uniform,
        None | Some(Layout::Astride) => SiteLayout::Astride,
        Some(Layout::Even) => SiteLayout::Even,
        Some(Layout::Impact) => SiteLayout::Impact { at: frame.uv_to_pos(options.at), focus: 2.2 },
        Some(Layout::Image) => match guides.first() {
            Some(guide) => SiteLayout::Density(guide.image.clone()),
            None => return Err("--layout image needs a --guide".into()),
        },
    };
    let mut params = VoronoiParams {
        sites: options.sites,
        layout,
        levels: options.levels,
        alpha: options.alpha,
        ..VoronoiParams::DEFAULT
    };
    if let Some(width) = options.width {
        params.width = width;
        params.least_width = params.least_width.min(width);
    }
    let clock = Instant::now();
    let (map, seams) = VoronoiBake::new(params, guides, options.size, options.seed)?.finish();
    let baked = clock.elapsed();

    let profile = Profile { full_width: 0.014, wall: 0.4, faintest: 0.5, ..Profile::DEFAULT };
    let mut field = DepthField::new(frame);
    seams.stamp(&mut field, &profile);
    let base = match &options.base {
        Some(path) => read_picture(path)?,
        None => read_picture(&own_picture("concrete"))?,
    };
    let base = image::imageops::resize(&base, options.size.x, options.size.y, FilterType::CatmullRom);
    let look = Look::named(&options.look).ok_or_else(|| format!("no look `{}`", options.look))?;
    fs::create_dir_all(&options.out)?;
    write(&options.out, &base, &field, &look)?;
    regions(&map)?.save(options.out.join("regions.png"))?;
    let report = map.strokes().map_or(String::new(), |strokes| {
        format!("; {:.1} % of {:.2} units of strokes are covered", strokes.covered * 100.0, strokes.length)
    });
    println!(
        "{} sites, {} seams in {:.2} ms{report}; written to {}",
        map.sites().len(),
        seams.seams.len(),
        baked.as_secs_f64() * 1e3,
        options.out.display()
    );
    Ok(())
}

/// Diffuse, normal, depth and mask.
fn write(out: &Path, base: &RgbaImage, field: &DepthField, look: &Look) -> Result<(), Box<dyn Error>> {
    let size: UVec2 = base.dimensions().into();
    let table = LookTable::new(look, field.frame.texels_per_unit())?;
    let (mut diffuse, mut normal) = (RgbaImage::new(size.x, size.y), RgbaImage::new(size.x, size.y));
    paint_into(
        BaseTexels { size, diffuse: base.as_raw(), normal: None, depth: None },
        field,
        &table,
        TexelRect::whole(size),
        UVec2::ZERO,
        &mut PaintTargets { diffuse: Some(&mut diffuse), normal: Some(&mut normal), depth: None },
    );
    diffuse.save(out.join("diffuse.png"))?;
    normal.save(out.join("normal.png"))?;
    let texels = field.depth.as_slice();
    let depth = ImageBuffer::<Luma<u16>, _>::from_raw(size.x, size.y, texels.to_vec()).ok_or("depth size")?;
    depth.save(out.join("depth.png"))?;
    // What a person would mark as crack, and the cracks that draw.
    darker(field, u16::MAX / 3)?.save(out.join("mask.png"))?;
    darker(field, DEEP)?.save(out.join("deep.png"))?;
    Ok(())
}

/// Deeper than this are the cracks that draw.
pub(crate) const DEEP: u16 = u16::MAX / 2;

/// The cracks deeper than `depth`, black on white.
pub(crate) fn darker(field: &DepthField, depth: u16) -> Result<GrayImage, Box<dyn Error>> {
    let size = field.depth.size();
    let mask = field.depth.as_slice().iter().map(|&texel| if texel > depth { 0 } else { 255 }).collect();
    Ok(GrayImage::from_raw(size.x, size.y, mask).ok_or("mask size")?)
}

/// A colour for each region, darker with path cost; sites are white.
fn regions(map: &VoronoiMap) -> Result<RgbaImage, Box<dyn Error>> {
    let size = map.frame().size();
    let mut picture = RgbaImage::from_fn(size.x, size.y, |x, y| match (map.region(x, y), map.cost(x, y)) {
        (Some(region), Some(cost)) => {
            let dark = 1.0 / (1.0 + cost as f32 / 40_000.0);
            let channel = |k: u32| (((region * 7919 + 31) * (k * 104_729 + 13) % 160 + 90) as f32 * dark) as u8;
            Rgba([channel(1), channel(2), channel(3), 255])
        }
        _ => Rgba([0, 0, 0, 255]),
    });
    for site in map.sites() {
        picture.put_pixel(site.x, site.y, Rgba([255; 4]));
    }
    Ok(picture)
}
