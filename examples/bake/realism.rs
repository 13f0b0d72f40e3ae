//! `bake realism`: masks of every preset, to be measured against masks of real cracks.

use crate::maps::mask;
use bevy_crack::{
    CrackPreset,
    growth::CrackGrowth,
    math::{Rng, ops},
    pattern::SurfaceFrame,
    raster::{DepthField, stamp_path},
};
use clap::Args;
use glam::{UVec2, Vec2};
use std::{error::Error, fs, path::PathBuf};

#[derive(Args)]
pub(crate) struct Options {
    /// A preset; by default all of them. May be given many times
    #[arg(long)]
    preset: Vec<String>,
    /// Masks of each preset
    #[arg(long, default_value_t = 24)]
    masks: u64,
    /// Seed of the first mask; each further one has the next
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Side of a mask in texels
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    size: u32,
    /// A growth parameter, as in `kill_distance=0.02`; may be given many times
    #[arg(long, value_parser = crate::growth::setting)]
    set: Vec<(String, String)>,
    /// How many times larger than on a surface of a game the cracks are, instead of what each preset has
    #[arg(long)]
    scale: Option<f32>,
    /// How much that differs between masks, 0..1, instead of what each preset has
    #[arg(long)]
    spread: Option<f32>,
    /// How hard hits are, times what each preset has
    #[arg(long, default_value_t = 1.0)]
    energy: f32,
    /// Folder to write to: a folder for each preset in it
    #[arg(long, default_value = "out/realism")]
    out: PathBuf,
}

/// What the photographs of a material have in common.
struct View {
    /// How many hits: least and most.
    hits: (u32, u32),
    /// How hard they are: least and most.
    energy: (f32, f32),
    /// How many times larger than on a surface of a game the cracks are in the middle one: photographs are taken from nearby.
    scale: f32,
    /// How much the distances differ: 0 = not at all, 1 = by a factor of about 2 either way.
    spread: f32,
    /// Side of the surface, in sides of a picture: they show a part of it.
    pane: f32,
}

const fn view(preset: &str) -> View {
    let (hits, energy, scale, spread, pane) = match preset.as_bytes() {
        b"concrete" => ((1, 4), (0.3, 1.5), 1.4, 0.5, 1.0),
        b"plaster" => ((1, 3), (0.1, 1.0), 1.2, 0.8, 1.0),
        b"brick" => ((1, 3), (0.0134, 0.134), 3.57, 0.817, 1.0),
        // Weak ones: flying stones, not hammers.
        b"glass" => ((1, 10), (0.004, 0.1), 2.3, 0.9, 2.1),
        b"laminated_glass" => ((1, 4), (0.02, 0.5), 1.0, 0.5, 1.0),
        // One hit cracks the whole surface.
        b"tempered_glass" => ((1, 1), (1.0, 1.0), 2.7, 0.8, 1.0),
        b"mud" => ((1, 1), (1.0, 1.0), 1.5, 0.96, 1.0),
        b"glaze" => ((1, 1), (1.0, 1.0), 1.4, 0.8, 1.0),
        b"clay" => ((1, 3), (0.5, 1.5), 1.0, 1.0, 1.0),
        _ => ((1, 3), (0.5, 1.5), 1.0, 0.5, 1.0),
    };
    View { hits, energy, scale, spread, pane }
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let all = CrackPreset::NAMES.map(str::to_owned);
    let names = if options.preset.is_empty() { &all[..] } else { &options.preset };
    let frame = SurfaceFrame::new(UVec2::splat(options.size))?;
    for name in names {
        let View { hits: (fewest, most), energy: (weakest, hardest), scale, spread, pane } = view(name);
        let (scale, spread) = (options.scale.unwrap_or(scale), options.spread.unwrap_or(spread));
        let mut preset = CrackPreset::named(name).ok_or_else(|| format!("no preset `{name}`"))?;
        for (name, value) in &options.set {
            preset.growth.set(name, value)?;
        }
        let folder = options.out.join(name);
        fs::create_dir_all(&folder)?;
        for seed in (0..options.masks).map(|i| options.seed.wrapping_add(i)) {
            let mut rng = Rng::new(seed).stream("realism");
            let distance = spread * 0.7 * (rng.signed() + rng.signed());
            let seen = preset.scaled(scale * ops::exp(distance));
            let extent = pane * frame.extent();
            let mut growth = CrackGrowth::new(seen.growth, extent, seed)?;
            for _ in 0..fewest + rng.next_u32() % (most - fewest + 1) {
                let place = Vec2::new(rng.range(0.1, 0.9), rng.range(0.1, 0.9));
                growth.hit(place * extent, options.energy * rng.range(weakest, hardest));
                while growth.step().grew() {}
            }
            // Nobody takes a picture of a part without cracks.
            let nodes = growth.network().nodes();
            let node = nodes.get(rng.next_u32() as usize % nodes.len().max(1)).map_or(extent * 0.5, |node| node.pos);
            let place = node - frame.extent() * Vec2::new(rng.range(0.2, 0.8), rng.range(0.2, 0.8));
            let window = place.clamp(Vec2::ZERO, extent - frame.extent());
            let mut field = DepthField::new(frame);
            for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
                stamp_path(&mut field, &seen.profile, &path.moved(-window));
            }
            mask(&field).save(folder.join(format!("seed_{seed:02}.png")))?;
        }
        println!("{} masks in {}", options.masks, folder.display());
    }
    Ok(())
}
