//! `bake realism`: masks of every preset, to be measured against masks of real cracks.

use crate::painting::mask;
use bevy_crack::{
    CrackPreset,
    growth::CrackGrowth,
    math::Rng,
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
    /// Side of a mask in texels
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    size: u32,
    /// A growth parameter, as in `kill_distance=0.02`; may be given many times
    #[arg(long, value_parser = crate::growth::setting)]
    set: Vec<(String, String)>,
    /// Folder to write to: a folder for each preset in it
    #[arg(long, default_value = "out/realism")]
    out: PathBuf,
}

/// How many hits, and how hard: least and most.
const fn hits(preset: &str) -> ((u32, u32), (f32, f32)) {
    match preset.as_bytes() {
        b"concrete" => ((1, 4), (0.3, 1.5)),
        b"plaster" => ((1, 3), (0.1, 1.0)),
        b"brick" => ((1, 3), (0.1, 1.0)),
        // Weak ones: flying stones, not hammers.
        b"glass" | b"laminated_glass" => ((1, 4), (0.02, 0.5)),
        // One hit cracks the whole surface.
        b"tempered_glass" | b"mud" | b"glaze" => ((1, 1), (1.0, 1.0)),
        _ => ((1, 3), (0.5, 1.5)),
    }
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let all = CrackPreset::NAMES.map(str::to_owned);
    let names = if options.preset.is_empty() { &all[..] } else { &options.preset };
    let frame = SurfaceFrame::new(UVec2::splat(options.size))?;
    for name in names {
        let mut preset = CrackPreset::named(name).ok_or_else(|| format!("no preset `{name}`"))?;
        for (name, value) in &options.set {
            preset.growth.set(name, value)?;
        }
        let folder = options.out.join(name);
        fs::create_dir_all(&folder)?;
        for seed in 1..=options.masks {
            let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), seed)?;
            let mut rng = Rng::new(seed).stream("realism");
            let ((fewest, most), (weakest, hardest)) = hits(name);
            for _ in 0..fewest + rng.next_u32() % (most - fewest + 1) {
                let place = Vec2::new(rng.range(0.1, 0.9), rng.range(0.1, 0.9));
                growth.hit(frame.uv_to_pos(place), rng.range(weakest, hardest));
                while growth.step().grew() {}
            }
            let mut field = DepthField::new(frame);
            for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
                stamp_path(&mut field, &preset.profile, &path);
            }
            mask(&field).save(folder.join(format!("seed_{seed:02}.png")))?;
        }
        println!("{} masks in {}", options.masks, folder.display());
    }
    Ok(())
}
