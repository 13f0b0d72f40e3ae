//! `bake strands`: starts and a field in, textures and the network out.

use crate::{
    grounds::ground,
    growth::{setting, size},
    maps::write_maps,
    painting::{fitted, paint},
    pictures::read_picture,
};
use bevy_crack::{
    Grid,
    paint::{Look, LookTable},
    pattern::{Network, SurfaceFrame},
    raster::{DepthField, Profile, stamp_path},
    strands::{Directions, Primitive, Propagation, StrandParams, StrandStart, Strands},
};
use clap::Args;
use glam::{UVec2, Vec2};
use image::RgbaImage;
use std::{error::Error, fs, path::PathBuf, time::Instant};

#[derive(Args)]
pub(crate) struct Options {
    /// asphalt, marble or sand
    #[arg(long, default_value = "asphalt")]
    material: String,
    #[arg(long, value_parser = size, default_value = "1024x1024")]
    size: UVec2,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where a strand starts: u,v or u,v,x,y with the direction in which it is driven at first; may be given many times
    #[arg(long, value_parser = start, default_value = "0,0.5")]
    start: Vec<(Vec2, Option<Vec2>)>,
    /// Directions: linear:X,Y, radial:U,V, swirl:U,V,ANGLE, line:U,V,U,V,... or image:PATH (red and green)
    #[arg(long, default_value = "linear:1,0")]
    field: String,
    /// Moves in four directions by costs, as in the paper, instead of in all
    #[arg(long)]
    costs: bool,
    /// A parameter, as in `inertia=0.4`; may be given many times
    #[arg(long, value_parser = setting)]
    set: Vec<(String, String)>,
    /// Images of primitives, dark cracks on white, instead of the material's own; may be given many times
    #[arg(long)]
    primitive: Vec<PathBuf>,
    /// The picture to crack; by default one that suits the material
    #[arg(long)]
    base: Option<PathBuf>,
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out")]
    out: PathBuf,
}

fn numbers(text: &str) -> Result<Vec<f32>, String> {
    text.split(',').map(|number| number.trim().parse().map_err(|error| format!("{number}: {error}"))).collect()
}

fn start(text: &str) -> Result<(Vec2, Option<Vec2>), String> {
    match numbers(text)?[..] {
        [u, v] => Ok((Vec2::new(u, v), None)),
        [u, v, x, y] => Ok((Vec2::new(u, v), Some(Vec2::new(x, y)))),
        _ => Err("a start is U,V or U,V,X,Y".into()),
    }
}

fn directions(text: &str, frame: &SurfaceFrame) -> Result<Directions, Box<dyn Error>> {
    let (kind, rest) = text.split_once(':').ok_or("a field is KIND:VALUES")?;
    if kind == "image" {
        let picture = read_picture(rest.as_ref())?;
        return Ok(Directions::from_picture(picture.dimensions().into(), picture.as_raw())?);
    }
    let place = |u: f32, v: f32| frame.uv_to_pos(Vec2::new(u, v));
    match (kind, &numbers(rest)?[..]) {
        ("linear", &[x, y]) => Ok(Directions::Linear(Vec2::new(x, y))),
        ("radial", &[u, v]) => Ok(Directions::Radial { center: place(u, v) }),
        ("swirl", &[u, v, turn]) => Ok(Directions::Swirl { center: place(u, v), turn }),
        ("line", uv) if uv.len() >= 4 && uv.len().is_multiple_of(2) => {
            let line = uv.as_chunks::<2>().0.iter().map(|&[u, v]| place(u, v)).collect();
            Ok(Directions::Along { line, hold: 0.15 })
        }
        _ => Err(format!("`{text}` is no field").into()),
    }
}

/// How a material's strands are made and shown.
pub(crate) struct Setting {
    pub(crate) params: StrandParams,
    pub(crate) profile: Profile,
    pub(crate) look: Look,
}

pub(crate) fn material(name: &str) -> Option<Setting> {
    let (params, profile, look) = match name {
        "asphalt" => (
            StrandParams::ASPHALT,
            Profile { full_width: 0.008, wall: 0.5, rim_width: 0.002, rim_depth: 0.14, ..Profile::DEFAULT },
            Look::ASPHALT,
        ),
        "marble" => (StrandParams::MARBLE, Profile { full_width: 0.004, wall: 0.4, ..Profile::DEFAULT }, Look::MARBLE),
        "sand" => (StrandParams::SAND, Profile { full_width: 0.028, wall: 0.85, ..Profile::DEFAULT }, Look::SAND),
        _ => return None,
    };
    Some(Setting { params, profile, look })
}

/// Draws a network into a depth field.
pub(crate) fn stamped(network: &Network, frame: SurfaceFrame, profile: &Profile) -> DepthField {
    let mut field = DepthField::new(frame);
    for path in network.segments().filter_map(|segment| network.path(segment)) {
        stamp_path(&mut field, profile, &path);
    }
    field
}

/// A height image from a picture: black is deepest.
fn heights(picture: &RgbaImage) -> Grid<u16> {
    let depth = |texel: &image::Rgba<u8>| {
        let light = (u32::from(texel[0]) + u32::from(texel[1]) + u32::from(texel[2])) / 3;
        257 * (255 - light as u16)
    };
    Grid::from_vec(picture.dimensions().into(), picture.pixels().map(depth).collect())
        .unwrap_or(Grid::new(UVec2::ZERO, 0))
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let mut setting = material(&options.material).ok_or("a material is asphalt, marble or sand")?;
    for (name, value) in &options.set {
        setting.params.set(name, value)?;
    }
    if options.costs {
        setting.params.propagation = Propagation::Costs;
    }
    let frame = SurfaceFrame::new(options.size)?;
    let starts: Vec<_> =
        options.start.iter().map(|&(uv, direction)| StrandStart { pos: frame.uv_to_pos(uv), direction }).collect();
    let mut primitives = Vec::new();
    for path in &options.primitive {
        let image = heights(&read_picture(path)?);
        primitives.push(Primitive::from_image(image).map_err(|error| format!("{}: {error}", path.display()))?);
    }
    let material = setting.params.material;
    if primitives.is_empty() {
        primitives = if setting.params.lanes > 1 { material.nets() } else { material.primitives() };
    }
    let clock = Instant::now();
    let directions = directions(&options.field, &frame)?;
    let strands = Strands::new(&setting.params, directions, &starts, frame.extent(), options.seed)?;
    let paths = clock.elapsed();
    let network = strands.network(&primitives)?;
    let grown = clock.elapsed();
    let field = stamped(&network, frame, &setting.profile);
    let stamped = clock.elapsed();
    let base = match &options.base {
        Some(path) => fitted(read_picture(path)?, options.size),
        None => ground(&options.material, options.size)?,
    };
    fs::create_dir_all(&options.out)?;
    let maps = paint(&base, &field, &LookTable::new(&setting.look, frame.texels_per_unit())?);
    base.save(options.out.join("base.png"))?;
    write_maps(&options.out, &maps, &field, &[])?;
    println!(
        "{} strands, {} nodes; paths in {:.2} ms, network in {:.2} ms, stamped in {:.2} ms; written to {}",
        strands.strands().len(),
        network.nodes().len(),
        paths.as_secs_f64() * 1e3,
        (grown - paths).as_secs_f64() * 1e3,
        (stamped - grown).as_secs_f64() * 1e3,
        options.out.display()
    );
    Ok(())
}
