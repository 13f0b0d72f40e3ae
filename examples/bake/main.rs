//! Makes crack textures without an engine.
//!
//! ```text
//! cargo run --no-default-features --example bake -- growth --preset glass --size 512x512 --seed 1 --hit 0.5,0.5 --out out
//! ```
//!
//! Try `--preset concrete --hit 0.3,0.4,2 --hit 0.7,0.6`, `--set line_growth=1.5`, `--base wall.png`.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line tool")]

mod analogy;
mod birds_eye;
mod blend;
mod figures;
mod figures_misawa;
mod figures_strands;
mod gallery;
mod grounds;
mod growth;
mod guided;
mod ink;
mod legible;
mod maps;
mod mountain;
mod ocr;
mod own;
mod painting;
mod pictures;
mod relief;
mod relief_terrain;
mod seed_contours;
mod shatter;
mod sheet;
mod strands;
mod terrain;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Pictures, fonts and presets that ship with the crate.
pub(crate) const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets");

#[derive(Parser)]
#[command(about = "Makes crack textures without an engine")]
struct Arguments {
    #[command(subcommand)]
    method: Method,
}

#[derive(Subcommand)]
enum Method {
    /// Cracks in the material of a photograph, by image analogies.
    Analogy(Box<analogy::Options>),
    /// Cracks that grow from hits, by space colonization.
    Growth(Box<growth::Options>),
    /// Every preset on its own picture, at three moments, on one sheet.
    Gallery(gallery::Options),
    /// Cracks that draw a picture or a word, all at once.
    Guided(Box<guided::Options>),
    /// The figures of the paper on contour generation, made again.
    FiguresMisawa(figures_misawa::Options),
    /// The figures of the paper on image-guided fracture, made again.
    FiguresMould(figures::Options),
    /// The figures of the paper on primitives along a guidance field, made again.
    FiguresStrands(figures_strands::Options),
    /// Words drawn by cracks and read back, to see how legible they are.
    Legible(legible::Options),
    /// Single cracks that follow a direction: primitives along a guidance field.
    Strands(Box<strands::Options>),
    /// Craters, rock walls, islands and mountains from one contour line.
    Relief(Box<relief::Options>),
    /// All contours of a mountain from one real contour, by each method, beside the real ones.
    ReliefTerrain(relief_terrain::Options),
    /// Shards: the pieces into which the cracks cut the picture.
    Shatter(Box<shatter::Options>),
}

fn main() -> ExitCode {
    let done = match Arguments::parse().method {
        Method::Analogy(options) => analogy::bake(&options),
        Method::Gallery(options) => gallery::bake(&options),
        Method::Growth(options) => growth::bake(&options).map(drop),
        Method::Guided(options) => guided::bake(&options),
        Method::FiguresMisawa(options) => figures_misawa::bake(&options),
        Method::FiguresMould(options) => figures::bake(&options),
        Method::FiguresStrands(options) => figures_strands::bake(&options),
        Method::Legible(options) => legible::bake(&options),
        Method::Strands(options) => strands::bake(&options),
        Method::Relief(options) => relief::bake(&options),
        Method::ReliefTerrain(options) => relief_terrain::bake(&options),
        Method::Shatter(options) => shatter::bake(&options),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bake: {error}");
            ExitCode::FAILURE
        }
    }
}
