//! Moving pictures: a GIF with one palette, of which each picture holds only what has changed.

use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};
use image::RgbaImage;
use std::{borrow::Cow, fs::File, path::Path};

/// Colours of the palette; one more is transparent.
const COLORS: u8 = 255;

/// About so many texels are looked at for the palette.
const SAMPLES: usize = 300_000;

/// A colour that differs from the one shown by no more than this in each channel stays as it was.
const STILL: u8 = 5;

/// The numbers of colours, found once for every colour of six bits a channel.
struct Palette {
    network: NeuQuant,
    known: Vec<u16>,
}

impl Palette {
    fn of(pictures: &[RgbaImage]) -> Self {
        let all = pictures.iter().map(|picture| picture.pixels().len()).sum::<usize>();
        let step = (all / SAMPLES).max(1);
        let samples: Vec<u8> =
            pictures.iter().flat_map(RgbaImage::pixels).step_by(step).flat_map(|pixel| pixel.0).collect();
        Self { network: NeuQuant::new(3, COLORS.into(), &samples), known: vec![u16::MAX; 1 << 18] }
    }

    fn number(&mut self, [r, g, b, _]: [u8; 4]) -> u8 {
        let key = usize::from(r >> 2) << 12 | usize::from(g >> 2) << 6 | usize::from(b >> 2);
        if self.known[key] == u16::MAX {
            self.known[key] = self.network.index_of(&[r, g, b, 255]) as u16;
        }
        self.known[key] as u8
    }
}

/// Writes pictures of one size, each shown for `hundredths` of a second, for ever.
pub(crate) fn write_gif(pictures: &[RgbaImage], hundredths: u16, path: &Path) -> Result<(), EncodingError> {
    let Some(first) = pictures.first() else { return Ok(()) };
    let (width, height) = first.dimensions();
    let mut palette = Palette::of(pictures);
    let mut encoder = Encoder::new(File::create(path)?, width as u16, height as u16, &palette.network.color_map_rgb())?;
    encoder.set_repeat(Repeat::Infinite)?;
    let mut shown: Vec<Option<[u8; 4]>> = vec![None; (width * height) as usize];
    for picture in pictures.iter().filter(|picture| picture.dimensions() == (width, height)) {
        let [mut left, mut top, mut right, mut bottom] = [width, height, 0, 0];
        let mut numbers = vec![COLORS; shown.len()];
        for (((x, y, pixel), shown), number) in picture.enumerate_pixels().zip(&mut shown).zip(&mut numbers) {
            let is_still = |before: [u8; 4]| pixel.0.iter().zip(before).all(|(now, was)| now.abs_diff(was) <= STILL);
            if shown.is_some_and(is_still) {
                continue;
            }
            (*shown, *number) = (Some(pixel.0), palette.number(pixel.0));
            (left, right) = (left.min(x), right.max(x + 1));
            (top, bottom) = (top.min(y), bottom.max(y + 1));
        }
        if left >= right {
            (left, top, right, bottom) = (0, 0, 1, 1);
        }
        let rows = numbers.chunks_exact(width as usize).skip(top as usize).take((bottom - top) as usize);
        let part: Vec<u8> = rows.flat_map(|row| row[left as usize..right as usize].iter().copied()).collect();
        encoder.write_frame(&Frame {
            delay: hundredths,
            dispose: DisposalMethod::Keep,
            transparent: Some(COLORS),
            left: left as u16,
            top: top as u16,
            width: (right - left) as u16,
            height: (bottom - top) as u16,
            buffer: Cow::Owned(part),
            ..Frame::default()
        })?;
    }
    Ok(())
}
