//! `bake growth`: hits in, textures and the network out.

use crate::{
    blend::write_blended,
    maps::{preset, write_maps},
    own::own_picture,
    painting::{covering, fitted, paint},
    pictures::read_picture,
};
use bevy_crack::{
    growth::{CrackGrowth, HitOutcome},
    paint::{BaseTexels, Look, LookTable, PaintTargets, paint_glow, paint_into},
    pattern::{CrackMask, LinkKind, Moment, NO_PARENT, Network, SurfaceFrame},
    raster::{DepthField, TexelRect, stamp_dot, stamp_path},
};
use clap::Args;
use glam::{UVec2, Vec2};
use image::{Rgba, RgbaImage};
use serde_json::json;
use std::{error::Error, fs, path::PathBuf, sync::Arc, time::Instant};

#[derive(Args)]
pub(crate) struct Options {
    /// One of the presets: glass, concrete, clay and others
    #[arg(long, default_value = "concrete")]
    preset: String,
    /// A preset file (`*.crack.ron`) in its place
    #[cfg(feature = "serde")]
    #[arg(long)]
    file: Option<PathBuf>,
    /// Width and height in texels; by default those of the base picture, or 512x512
    #[arg(long, value_parser = size)]
    size: Option<UVec2>,
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Where and how hard: u,v or u,v,energy; may be given many times
    #[arg(long, value_parser = hit, default_value = "0.5,0.5")]
    pub(crate) hit: Vec<(Vec2, f32)>,
    /// The picture to crack; by default one that suits the preset
    #[arg(long)]
    base: Option<PathBuf>,
    /// A normal map of the surface: the cracks are blended into it in each way, side by side
    #[arg(long)]
    base_normal: Option<PathBuf>,
    /// A growth parameter, as in `kill_distance=0.02`; may be given many times
    #[arg(long, value_parser = setting)]
    set: Vec<(String, String)>,
    /// Where cracks like to run: light texels of this picture
    #[arg(long)]
    weak: Option<PathBuf>,
    /// Where they do not
    #[arg(long)]
    strong: Option<PathBuf>,
    /// Where they never go
    #[arg(long)]
    forbidden: Option<PathBuf>,
    /// Cracks like to run in the lines of the base picture (mortar, joints) and never where it is transparent; by default as the
    /// preset has it
    #[arg(long, num_args = 0..=1, default_missing_value = "true")]
    mask_from_picture: Option<bool>,
    /// Another look than the preset's: groove, frosted or toon
    #[arg(long)]
    look: Option<String>,
    /// Stop after so many steps
    #[arg(long)]
    steps: Option<u32>,
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out")]
    pub(crate) out: PathBuf,
}

pub(crate) fn size(text: &str) -> Result<UVec2, String> {
    let (width, height) = text.split_once('x').ok_or("a size is WIDTHxHEIGHT")?;
    let side = |text: &str| text.parse::<u32>().map_err(|error| format!("{text}: {error}"));
    let size = UVec2::new(side(width)?, side(height)?);
    SurfaceFrame::new(size).map_err(|error| error.to_string())?;
    Ok(size)
}

fn hit(text: &str) -> Result<(Vec2, f32), String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|number| number.trim().parse::<f32>()).collect();
    match numbers.map_err(|error| format!("{text}: {error}"))?[..] {
        [u, v] => Ok((Vec2::new(u, v), 1.0)),
        [u, v, energy] => Ok((Vec2::new(u, v), energy)),
        _ => Err("a hit is U,V or U,V,ENERGY".into()),
    }
}

pub(crate) fn setting(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("a setting is NAME=VALUE")?;
    Ok((name.into(), value.into()))
}

/// Writes the textures, and returns the network and the cracked picture.
pub(crate) fn bake(options: &Options) -> Result<(Network, RgbaImage), Box<dyn Error>> {
    let mut preset = preset(&options.preset)?;
    #[cfg(feature = "serde")]
    if let Some(file) = &options.file {
        preset = bevy_crack::CrackPreset::from_ron(&fs::read_to_string(file)?)?;
    }
    for (name, value) in &options.set {
        preset.growth.set(name, value)?;
    }
    if let Some(look) = &options.look {
        preset.look =
            Look::named(look).ok_or_else(|| format!("no look `{look}`; there are {}", Look::NAMES.join(", ")))?;
    }
    let own = own_picture(&options.preset);
    let picture = match &options.base {
        Some(path) => Some(read_picture(path)?),
        None => own.exists().then(|| read_picture(&own)).transpose()?,
    };
    let size = options.size.or(picture.as_ref().map(|p| p.dimensions().into())).unwrap_or(UVec2::splat(512));
    let base = match picture {
        Some(picture) if options.base.is_some() => fitted(picture, size),
        Some(picture) => covering(picture, size),
        None => RgbaImage::from_pixel(size.x, size.y, Rgba([150, 150, 146, 255])),
    };

    let frame = SurfaceFrame::new(size)?;
    let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), options.seed)?;
    let follows_lines = options.mask_from_picture.unwrap_or(preset.follows_lines);
    let mut layers = if follows_lines { CrackMask::from_picture(size, base.as_raw())? } else { CrackMask::default() };
    for (layer, path) in [
        (&mut layers.weak, &options.weak),
        (&mut layers.strong, &options.strong),
        (&mut layers.forbidden, &options.forbidden),
    ] {
        if let Some(path) = path {
            let picture = read_picture(path)?;
            *layer = Some(CrackMask::layer(picture.dimensions().into(), picture.as_raw())?);
        }
    }
    let layers = Arc::new(layers);
    growth.set_mask(layers.clone());
    for &(uv, energy) in &options.hit {
        if let HitOutcome::Rejected(reason) = growth.hit(frame.uv_to_pos(uv), energy) {
            return Err(format!("the hit at {uv}: {reason}").into());
        }
    }
    let clock = Instant::now();
    while options.steps.is_none_or(|steps| growth.steps() < steps) && growth.step().grew() {}
    let grown = clock.elapsed();

    let clock = Instant::now();
    let mut field = DepthField::new(frame);
    field.set_forbidden(&layers);
    field.set_layers(preset.look.layer(options.seed));
    let mut changed = Vec::new();
    growth.take_changed(&mut changed);
    for segment in changed {
        if let Some(path) = growth.network().path(segment) {
            stamp_path(&mut field, &preset.profile, &path);
        }
    }
    let mut markers = Vec::new();
    growth.take_markers(&mut markers);
    for marker in markers {
        stamp_dot(&mut field, marker, 2.0 / frame.texels_per_unit(), 0.6);
    }
    let (timeline, mut rects) = (growth.timeline(), Vec::new());
    field.show_layers(growth.network(), timeline, Moment::after(timeline.end()), &mut rects);
    let stamped = clock.elapsed();

    let clock = Instant::now();
    let table = LookTable::new(&preset.look, frame.texels_per_unit())?;
    let maps = paint(&base, &field, &table);
    let painted = clock.elapsed();

    let craters = if preset.look.crushed.is_some() { depths(&field, &table) } else { Vec::new() };
    write_maps(&options.out, &maps, &field, &craters)?;
    if let Some(normals) = &options.base_normal {
        write_blended(&options.out, normals, &mut field, &preset.look)?;
    }
    if !preset.look.glow.is_empty() {
        let mut light = RgbaImage::new(size.x, size.y);
        paint_glow(None, size, &field, &table, &[TexelRect::whole(size)], UVec2::ZERO, &mut light);
        light.save(options.out.join("emissive.png"))?;
    }
    let network = growth.network();
    fs::write(options.out.join("network.json"), serde_json::to_string(&describe(network, options))?)?;

    println!(
        "{} nodes, {} segments, {} steps; grown in {:.2} ms, stamped in {:.2} ms, painted in {:.2} ms; written to {}",
        network.nodes().len(),
        network.segments().count(),
        growth.steps(),
        grown.as_secs_f64() * 1e3,
        stamped.as_secs_f64() * 1e3,
        painted.as_secs_f64() * 1e3,
        options.out.display()
    );
    let [diffuse, _] = maps;
    Ok((network.clone(), diffuse))
}

/// The network in pattern units (the shorter side is 1), with the rough line of each segment.
fn describe(network: &Network, options: &Options) -> serde_json::Value {
    let nodes: Vec<_> = network
        .nodes()
        .iter()
        .map(|node| {
            let parent = (node.parent != NO_PARENT).then_some(node.parent);
            json!({ "pos": node.pos.to_array(), "width": node.width, "parent": parent, "generation": node.generation,
                    "birth": node.birth, "impact": node.impact })
        })
        .collect();
    let links: Vec<_> = network
        .links()
        .iter()
        .map(|link| {
            let kind = match link.kind {
                LinkKind::Connection => "connection",
                LinkKind::Island => "island",
                LinkKind::Meeting => "meeting",
                LinkKind::Junction => "junction",
            };
            json!({ "a": link.a, "b": link.b, "width": link.width, "birth": link.birth, "kind": kind })
        })
        .collect();
    let segments: Vec<_> = network
        .segments()
        .filter_map(|segment| {
            let (a, b) = network.ends(segment)?;
            let path = network.path(segment)?;
            let path: Vec<_> = path.points().iter().map(|p| [p.pos.x, p.pos.y, p.width]).collect();
            Some(json!({ "a": a, "b": b, "path": path }))
        })
        .collect();
    json!({ "preset": options.preset, "seed": options.seed, "extent": network.extent().to_array(),
            "nodes": nodes, "links": links, "segments": segments })
}

/// The depth map of cracks and craters.
fn depths(field: &DepthField, table: &LookTable) -> Vec<u8> {
    let (size, rect) = (field.frame.size(), TexelRect::whole(field.frame.size()));
    let mut depth = vec![0; field.depth.as_slice().len()];
    let base = BaseTexels { size, diffuse: &[], normal: None, depth: None };
    let mut targets = PaintTargets { diffuse: None, normal: None, depth: Some(&mut depth) };
    paint_into(base, field, table, rect, UVec2::ZERO, &mut targets);
    depth
}
