//! Pictures from outside.

use image::{ImageReader, Limits, RgbaImage};
use std::{error::Error, path::Path};

/// A picture of at most 8192 texels a side and 256 MiB; the header is checked before memory is taken.
pub(crate) fn read_picture(path: &Path) -> Result<RgbaImage, Box<dyn Error>> {
    let mut reader = ImageReader::open(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(8192);
    limits.max_image_height = Some(8192);
    limits.max_alloc = Some(256 << 20);
    reader.limits(limits);
    let picture = reader.with_guessed_format()?.decode().map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(picture.to_rgba8())
}
