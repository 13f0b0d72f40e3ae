//! `bake gallery`: every preset on its own picture, and two looks more, at three moments, on one sheet.

use crate::{own, sheet};
use clap::Args;
use std::{error::Error, fs, path::PathBuf};

#[derive(Args)]
pub(crate) struct Options {
    /// Only these presets, or looks on concrete; by default all presets
    #[arg(long)]
    preset: Vec<String>,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Side of each picture on the sheet, texels
    #[arg(long, default_value_t = sheet::SIDE, value_parser = clap::value_parser!(u32).range(16..=1024))]
    side: u32,
    /// Folder to write to; made if it is not there
    #[arg(long, default_value = "out")]
    out: PathBuf,
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    let names: Vec<&str> = match &options.preset[..] {
        [] => own::exhibits().collect(),
        names => names.iter().map(String::as_str).collect(),
    };
    fs::create_dir_all(&options.out)?;
    let path = options.out.join("gallery.png");
    sheet::draw(&names, options.seed, options.side)?.save(&path)?;
    println!("{} presets; written to {}", names.len(), path.display());
    Ok(())
}
