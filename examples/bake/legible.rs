//! `bake legible`: draws words by cracks and has them read back.

use crate::ocr;
use bevy_crack::voronoi::VoronoiParams;
use clap::Args;
use image::GrayImage;
use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
};

#[derive(Args)]
pub(crate) struct Options {
    /// A font, TTF or OTF; may be given many times
    #[arg(long, required = true)]
    font: Vec<PathBuf>,
    /// The words: a text file, one a line
    #[arg(long)]
    words: PathBuf,
    /// In capitals alone
    #[arg(long)]
    capitals: bool,
    /// Have the letters themselves read instead of their cracks: the most that can be reached
    #[arg(long)]
    plain: bool,
    /// Least width of cracks in strokes, as a share of the stroke's
    #[arg(long, default_value_t = VoronoiParams::DEFAULT.stroke_width)]
    stroke_width: f32,
    /// Seed of the first word; each further one has the next
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder to write to: a folder of pictures for each font in it
    #[arg(long, default_value = "out/legible")]
    out: PathBuf,
}

pub(crate) fn bake(options: &Options) -> Result<(), Box<dyn Error>> {
    if !ocr::can_read() {
        return Err("there is no `tesseract`".into());
    }
    let list = fs::read_to_string(&options.words)?;
    let words: Vec<String> =
        list.split_whitespace().map(|word| if options.capitals { word.to_uppercase() } else { word.into() }).collect();
    let (mut read, mut uncovered) = (0, 0);
    for font in &options.font {
        let name = font.file_stem().unwrap_or_default().to_string_lossy();
        let folder = options.out.join(&*name);
        fs::create_dir_all(&folder)?;
        let texts = draw(&words, &fs::read(font)?, &folder, options, &mut uncovered)?;
        let misread: Vec<_> =
            words.iter().zip(&texts).filter(|(word, text)| !word.eq_ignore_ascii_case(text)).collect();
        let n = words.len() - misread.len();
        read += n;
        let misread: Vec<_> = misread.iter().map(|(word, text)| format!("{word}={text}")).collect();
        println!("{n:3} of {} {name}: {}", words.len(), misread.join(" "));
    }
    println!(
        "{read} of {} read; {uncovered} with less than 95 % of their strokes covered",
        words.len() * options.font.len()
    );
    Ok(())
}

/// Draws all words and reads them.
fn draw(
    words: &[String],
    font: &[u8],
    folder: &Path,
    options: &Options,
    uncovered: &mut usize,
) -> Result<Vec<String>, Box<dyn Error>> {
    let mut pictures = Vec::new();
    for (seed, word) in (options.seed..).zip(words) {
        let guide = ocr::word(font, word)?;
        let picture = if options.plain {
            let texels = guide.as_slice().iter().map(|ink| 255 - (ink * 255.0) as u8).collect();
            GrayImage::from_raw(ocr::SIDE, ocr::SIDE, texels).ok_or("picture size")?
        } else {
            let params = VoronoiParams { stroke_width: options.stroke_width, ..VoronoiParams::DEFAULT };
            let (picture, strokes) = ocr::draw(guide, seed, params)?;
            *uncovered += usize::from(strokes.covered < 0.95);
            picture
        };
        let path = folder.join(format!("{word}.png"));
        picture.save(&path)?;
        pictures.push(path);
    }
    ocr::read(&pictures, folder)
}
