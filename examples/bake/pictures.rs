//! Pictures to crack.

use image::{ImageReader, Limits, RgbaImage};
use std::{
    error::Error,
    path::{Path, PathBuf},
};

/// The pictures that ship with the crate.
pub(crate) fn own_picture(preset: &str) -> PathBuf {
    let file = match preset {
        "glass" | "tempered_glass" | "laminated_glass" => "glass_pane",
        "brick" => "brick_red",
        "plaster" | "clay" | "mud" | "glaze" | "ice" | "toon" => preset,
        _ => "concrete_fine",
    };
    Path::new(crate::ASSETS).join("textures").join(file).with_extension("png")
}

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
