//! `bake guided`: a picture or a word in, textures of cracks that draw it out.

use crate::{
    growth::size,
    ink::{ink, lightness},
    maps::{Paint, base_picture, preset, write_maps},
    ocr::{PROFILE, deep},
    pictures::read_picture,
};
use bevy_crack::{
    paint::LookTable,
    pattern::{Moment, NO_PARENT, SurfaceFrame, Timeline},
    raster::{DepthField, LayerPlan},
    voronoi::{
        FONT, Front, Guide, SeamMotion, Seams, SiteLayout, VoronoiBake, VoronoiMap, VoronoiParams, draw_text, edges,
    },
};
use clap::{Args, ValueEnum};
use glam::{UVec2, Vec2};
use image::{
    Delay, Frame, Rgba, RgbaImage,
    codecs::gif::{GifEncoder, Repeat},
};
use serde_json::json;
use std::{
    error::Error,
    fs::{self, File},
    path::PathBuf,
    time::Instant,
};

#[derive(Args)]
pub(crate) struct Options {
    /// A drawing to follow, IMG or IMG:GAMMA: its dark part, or its light part if most of it is dark; may be given many times
    #[arg(long, value_parser = guide)]
    guide: Vec<(PathBuf, f32)>,
    /// A picture whose edges to follow, IMG or IMG:GAMMA; may be given many times
    #[arg(long, value_parser = guide)]
    edges: Vec<(PathBuf, f32)>,
    /// A word to draw, with \n between lines; may be given many times
    #[arg(long)]
    text: Vec<String>,
    /// Weight of the words
    #[arg(long, default_value_t = GAMMA)]
    gamma: f32,
    /// The font of the words, TTF or OTF; by default the one that ships with the crate
    #[arg(long)]
    font: Option<PathBuf>,
    /// How many sites there are
    #[arg(long, default_value_t = 175)]
    sites: u32,
    /// Where they lie; by default in pairs on both sides of the drawing, or uniform where there is none
    #[arg(long, value_enum)]
    layout: Option<Layout>,
    /// Where the impact is, for `--layout impact` and `--animate front`: u,v
    #[arg(long, value_parser = pair, default_value = "0.5,0.5")]
    at: Vec2,
    /// Generations of cracks, 1 to 5
    #[arg(long, default_value_t = 1)]
    levels: u32,
    /// Weight of the noise
    #[arg(long, default_value_t = 6.0)]
    alpha: f32,
    /// How much of the weight of the drawings the noise takes away, 0 to 1: how far cracks wander within strokes
    #[arg(long, default_value_t = VoronoiParams::DEFAULT.guide_noise)]
    guide_noise: f32,
    /// Width of the widest crack, in shares of the shorter side
    #[arg(long)]
    width: Option<f32>,
    /// Least width of a crack in a stroke, in shares of the stroke's
    #[arg(long, default_value_t = VoronoiParams::DEFAULT.stroke_width)]
    stroke_width: f32,
    /// How far cracks deviate in small kinks, in shares of the shorter side
    #[arg(long, default_value_t = VoronoiParams::DEFAULT.roughness)]
    roughness: f32,
    /// Width and height in texels
    #[arg(long, value_parser = size, default_value = "400x400")]
    size: UVec2,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The picture to crack; by default the one that suits the preset
    #[arg(long)]
    base: Option<PathBuf>,
    /// The material: its cross-section, look and picture
    #[arg(long, default_value = "concrete")]
    preset: String,
    /// Another look; dark or bright: the plain modulation of the paper
    #[arg(long)]
    look: Option<String>,
    /// Also frames of an animation, and an animated GIF
    #[arg(long, value_enum)]
    animate: Option<Animation>,
    /// How many frames
    #[arg(long, default_value_t = 24)]
    frames: u32,
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
    StrokePairs,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Animation {
    /// The picture emerges from plain cracks.
    Gamma,
    /// From the first guide to the second.
    Morph,
    /// All cracks widen.
    Width,
    /// The cracks run outward from a point.
    Front,
}

/// The weight that the paper gives its guides.
const GAMMA: f32 = 28.0;

fn guide(text: &str) -> Result<(PathBuf, f32), String> {
    match text.rsplit_once(':').map(|(path, gamma)| (path, gamma.parse::<f32>())) {
        Some((path, Ok(gamma))) if !path.is_empty() => Ok((path.into(), gamma)),
        _ => Ok((text.into(), GAMMA)),
    }
}

fn pair(text: &str) -> Result<Vec2, String> {
    let (u, v) = text.split_once(',').ok_or("a place is U,V")?;
    let number = |text: &str| text.trim().parse::<f32>().map_err(|error| format!("{text}: {error}"));
    Ok(Vec2::new(number(u)?, number(v)?))
}

/// Pictures, then edges, then words.
fn guides(options: &Options) -> Result<Vec<Guide>, Box<dyn Error>> {
    let font = options.font.as_ref().map(fs::read).transpose()?;
    let mut guides = Vec::new();
    for (path, gamma) in &options.guide {
        guides.push(Guide { image: ink(&read_picture(path)?).ok_or("picture size")?, gamma: *gamma });
    }
    for (path, gamma) in &options.edges {
        let picture = lightness(&read_picture(path)?).ok_or("picture size")?;
        guides.push(Guide { image: edges(&picture), gamma: *gamma });
    }
    for text in &options.text {
        let text = text.replace("\\n", "\n");
        let image = draw_text(font.as_deref().unwrap_or(FONT), &text, options.size, f32::INFINITY)
            .ok_or("the font cannot be read")?;
        guides.push(Guide { image, gamma: options.gamma });
    }
    Ok(guides)
}

fn params(options: &Options, guides: &[Guide], frame: &SurfaceFrame) -> Result<VoronoiParams, Box<dyn Error>> {
    let layout = match options.layout {
        None if guides.is_empty() => SiteLayout::Uniform,
        Some(Layout::Uniform) => SiteLayout::Uniform,
        None | Some(Layout::StrokePairs) => SiteLayout::StrokePairs,
        Some(Layout::Even) => SiteLayout::Even,
        Some(Layout::Impact) => SiteLayout::Impact { at: frame.uv_to_pos(options.at), focus: 2.2 },
        Some(Layout::Image) => {
            SiteLayout::Density(guides.first().ok_or("`--layout image` needs a `--guide`")?.image.clone())
        }
    };
    let &Options { sites, levels, alpha, guide_noise, stroke_width, roughness, .. } = options;
    let mut params =
        VoronoiParams { sites, layout, levels, alpha, guide_noise, stroke_width, roughness, ..VoronoiParams::DEFAULT };
    if let Some(width) = options.width {
        params.width = width;
        params.least_width = params.least_width.min(width);
    }
    Ok(params)
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let frame = SurfaceFrame::new(options.size)?;
    let preset = preset(&options.preset)?;
    let profile = &preset.profile;
    let guides = guides(options)?;
    let params = params(options, &guides, &frame)?;
    let at = frame.uv_to_pos(options.at);
    let gammas: Vec<f32> = guides.iter().map(|guide| guide.gamma).collect();
    let clock = Instant::now();
    let (mut map, seams) = VoronoiBake::new(params, guides, options.size, options.seed)?.finish();
    let baked = clock.elapsed();

    let paint = match &options.look {
        Some(look) => Paint::new(look, &frame)?,
        None => Paint::Look(Box::new(LookTable::new(&preset.look, frame.texels_per_unit())?)),
    };
    let base = base_picture(options.base.as_deref(), &options.preset, options.size)?;
    let mut field = DepthField::new(frame);
    let layers = if options.look.is_none() { preset.look.layer(options.seed) } else { LayerPlan::default() };
    field.set_layers(layers.clone());
    seams.stamp(&mut field, profile);
    show_plates(&mut field, &seams, at);
    write_maps(&options.out, &paint.paint(&base, &field)?, &field, &[])?;
    // The cracks that draw alone, black on white.
    let mut plain = DepthField::new(frame);
    seams.stamp(&mut plain, &PROFILE);
    deep(&plain).ok_or("mask size")?.save(options.out.join("deep.png"))?;
    regions(&map).save(options.out.join("regions.png"))?;
    fs::write(options.out.join("network.json"), serde_json::to_string(&describe(&seams, at))?)?;

    let (strokes, n_sites) = (map.strokes(), map.sites().len());
    if let Some(animation) = options.animate {
        let front = Front::new(&seams, at);
        let mut motion = match (animation, &gammas[..]) {
            (Animation::Gamma, _) => Some(SeamMotion::new(map, vec![0.0; gammas.len()], gammas)?),
            (Animation::Morph, &[first, second, ..]) => {
                map.set_gammas(&[first, 0.0])?;
                map.rescale_widths();
                Some(SeamMotion::new(map, vec![first, 0.0], vec![0.0, second])?)
            }
            (Animation::Morph, _) => return Err("`--animate morph` needs two guides".into()),
            (Animation::Width | Animation::Front, _) => None,
        };
        animate(options, &base, &paint, |t, field| {
            field.set_layers(layers.clone());
            let seams = match &mut motion {
                Some(motion) => &motion.at(t)?,
                None => &seams,
            };
            match animation {
                Animation::Width => seams.stamp_share(field, profile, t),
                Animation::Front => seams.stamp_front(field, profile, &front, t * front.reach()),
                Animation::Gamma | Animation::Morph => seams.stamp(field, profile),
            }
            if t >= 1.0 {
                show_plates(field, seams, at);
            }
            Ok(())
        })?;
    }
    let report = strokes.map_or(String::new(), |strokes| {
        format!("; {:.1} % of {:.2} units of strokes are covered", strokes.covered * 100.0, strokes.length)
    });
    println!(
        "{} sites, {} seams in {:.2} ms{report}; written to {}",
        n_sites,
        seams.seams.len(),
        baked.as_secs_f64() * 1e3,
        options.out.display()
    );
    Ok(())
}

/// Shows the plates between cracks that are all there, if the look has any.
fn show_plates(field: &mut DepthField, seams: &Seams, at: Vec2) {
    field.show_layers(&seams.network(at), &Timeline::default(), Moment::after(u32::MAX), &mut Vec::new());
}

/// Writes the frames at times 0..=1 that `stamp` draws.
fn animate(
    options: &Options,
    base: &RgbaImage,
    paint: &Paint,
    mut stamp: impl FnMut(f32, &mut DepthField) -> Result<(), Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let folder = options.out.join("frames");
    fs::create_dir_all(&folder)?;
    let mut gif = GifEncoder::new_with_speed(File::create(options.out.join("animation.gif"))?, 10);
    gif.set_repeat(Repeat::Infinite)?;
    for i in 0..options.frames {
        let t = i as f32 / (options.frames.max(2) - 1) as f32;
        let mut field = DepthField::new(SurfaceFrame::new(options.size)?);
        stamp(t, &mut field)?;
        let [diffuse, _] = paint.paint(base, &field)?;
        diffuse.save(folder.join(format!("{i:04}.png")))?;
        gif.encode_frame(Frame::from_parts(diffuse, 0, 0, Delay::from_numer_denom_ms(70, 1)))?;
    }
    Ok(())
}

/// A colour for each region, darker with path cost; sites are white.
pub(crate) fn regions(map: &VoronoiMap) -> RgbaImage {
    let size = map.frame().size();
    let mut picture = RgbaImage::from_fn(size.x, size.y, |x, y| match (map.region(x, y), map.cost(x, y)) {
        (Some(region), Some(cost)) => {
            let dark = 1.0 / (1.0 + cost as f32 / 40_000.0);
            let channel =
                |k: u32| ((region.wrapping_mul(7919) + 31).wrapping_mul(k * 104_729 + 13) % 160 + 90) as f32 * dark;
            Rgba([channel(1) as u8, channel(2) as u8, channel(3) as u8, 255])
        }
        _ => Rgba([0, 0, 0, 255]),
    });
    for site in map.sites() {
        picture.put_pixel(site.x, site.y, Rgba([255; 4]));
    }
    picture
}

/// The seams as a network that has grown from `at`, in the form of `bake growth`.
fn describe(seams: &Seams, at: Vec2) -> serde_json::Value {
    let network = seams.network(at);
    let nodes: Vec<_> = network
        .nodes()
        .iter()
        .map(|node| {
            let parent = (node.parent != NO_PARENT).then_some(node.parent);
            json!({ "pos": node.pos.to_array(), "width": node.width, "parent": parent, "generation": node.generation,
                    "birth": node.birth })
        })
        .collect();
    let lines: Vec<_> = seams
        .seams
        .iter()
        .map(|seam| {
            let path: Vec<_> = seam.points.iter().map(|point| [point.pos.x, point.pos.y, point.width]).collect();
            json!({ "from": seam.from, "to": seam.to, "left": seam.left, "right": seam.right, "level": seam.level,
                    "path": path })
        })
        .collect();
    let links: Vec<_> = network.links().iter().map(|link| json!({ "a": link.a, "b": link.b })).collect();
    json!({ "extent": seams.extent.to_array(), "nodes": nodes, "links": links, "seams": lines })
}
