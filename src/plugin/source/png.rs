//! PNG files as images.

use bevy::{
    asset::RenderAssetUsages,
    image::{CompressedImageFormats, ImageSampler, ImageType},
    prelude::*,
};

/// Longest side, texels.
pub(crate) const MAX_SIDE: u32 = 8192;

/// The most bytes of a picture.
const MAX_BYTES: u64 = 256 << 20;

/// A PNG file as an image; what is too large is refused before memory is taken.
pub(crate) fn decode(file: &[u8]) -> Result<Image, String> {
    // Signature, length of the header, its name; width, height, bits, kind of colour.
    let header = file.strip_prefix(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR").and_then(|rest| rest.first_chunk::<10>());
    let &[a, b, c, d, e, f, g, h, bits, _] = header.ok_or("it is no PNG file")?;
    let (width, height) = (u32::from_be_bytes([a, b, c, d]), u32::from_be_bytes([e, f, g, h]));
    let texel = 4 * u64::from(bits.div_ceil(8));
    if width.max(height) > MAX_SIDE || u64::from(width) * u64::from(height) * texel > MAX_BYTES {
        return Err(format!("{width} x {height} texels are beyond the limit of {MAX_SIDE} a side and 256 MiB"));
    }
    let (kind, sampler) = (ImageType::MimeType("image/png"), ImageSampler::Default);
    let usage = RenderAssetUsages::MAIN_WORLD;
    Image::from_buffer(file, kind, CompressedImageFormats::NONE, true, sampler, usage)
        .map_err(|error| error.to_string().lines().next().unwrap_or_default().to_owned())
}
