//! PNG files as images.

use bevy::{
    asset::RenderAssetUsages,
    image::{CompressedImageFormats, ImageSampler, ImageType},
    prelude::*,
    render::render_resource::{TextureDimension, TextureFormat},
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
    let image = Image::from_buffer(file, kind, CompressedImageFormats::NONE, true, sampler, usage)
        .map_err(|error| error.to_string().lines().next().unwrap_or_default().to_owned())?;
    Ok(with_levels(image))
}

/// 16 bits of a channel are a level for the eye, as 8 are; the engine takes them for light.
fn with_levels(image: Image) -> Image {
    use TextureFormat::{R16Uint, Rg16Uint, Rgba8UnormSrgb, Rgba16Unorm};
    let channels = match image.texture_descriptor.format {
        R16Uint => 1,
        Rg16Uint => 2,
        Rgba16Unorm => 4,
        _ => return image,
    };
    let share = |bytes: [u8; 2]| (u32::from(u16::from_ne_bytes(bytes)) * 255 + 32_767) / 65_535;
    let level = |bytes: [u8; 2]| u8::try_from(share(bytes)).unwrap_or(u8::MAX);
    let texel = |texel: &[u8]| match *texel.as_chunks().0 {
        [grey] => [level(grey), level(grey), level(grey), u8::MAX],
        [grey, cover] => [level(grey), level(grey), level(grey), level(cover)],
        [red, green, blue, cover] => [red, green, blue, cover].map(level),
        _ => [0; 4],
    };
    let data = image.data.iter().flat_map(|data| data.chunks_exact(2 * channels)).flat_map(texel).collect();
    let (size, usage) = (image.texture_descriptor.size, image.asset_usage);
    Image::new(size, TextureDimension::D2, data, Rgba8UnormSrgb, usage)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, Rgba, RgbaImage};

    fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
        let body = [&kind[..], data].concat();
        let crc = body.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
        });
        [&(data.len() as u32).to_be_bytes()[..], &body, &(!crc).to_be_bytes()].concat()
    }

    /// A file of 68 bytes that claims so many RGBA texels.
    fn bomb(width: u32, height: u32, bits: u8) -> Vec<u8> {
        let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[bits, 6, 0, 0, 0]].concat();
        let data = [0x78, 0x9C, 0x63, 0, 0, 0, 1, 0, 1, 0, 0];
        let parts = [chunk(b"IHDR", &header), chunk(b"IDAT", &data), chunk(b"IEND", &[])].concat();
        [&b"\x89PNG\r\n\x1a\n"[..], &parts].concat()
    }

    /// Fault F2: what a header claims is refused before memory is taken, by its sides or by its bytes.
    #[test]
    fn f2_bombs_are_refused_by_their_headers() {
        for (width, height, bits) in [
            (60_000, 60_000, 8),
            (24_000, 24_000, 8),
            (MAX_SIDE + 1, 1, 8),
            (1, MAX_SIDE + 1, 8),
            (u32::MAX, 1, 8),
            (u32::MAX, u32::MAX, 16),
            // Within the limit of the sides, beyond that of the bytes.
            (MAX_SIDE, MAX_SIDE, 16),
            (MAX_SIDE, MAX_SIDE / 2 + 1, 16),
        ] {
            let file = bomb(width, height, bits);
            assert_eq!(file.len(), 68);
            let refused = decode(&file).expect_err("it is a bomb");
            assert!(refused.contains("limit"), "{width} x {height}, {bits} bits: {refused}");
        }
        // What is no bomb is refused for another reason.
        let refused = decode(&bomb(3, 2, 8)).expect_err("there are no texels in it");
        assert!(!refused.contains("limit"), "{refused}");
    }

    /// Fault F1: files that are cut off anywhere or have any bit flipped are an error, or a picture as its header says.
    #[test]
    fn f1_broken_files_are_errors() {
        let mut good = std::io::Cursor::new(Vec::new());
        let picture = RgbaImage::from_fn(9, 7, |x, y| Rgba([(x * 20) as u8, (y * 30) as u8, 99, 255]));
        picture.write_to(&mut good, ImageFormat::Png).expect("it can be written");
        let good = good.into_inner();
        let whole = decode(&good).expect("it is whole");
        assert_eq!((whole.size(), whole.data.as_deref()), (UVec2::new(9, 7), Some(&picture.as_raw()[..])));
        let cut = (0..good.len()).map(|n| good[..n].to_vec());
        let flipped = (0..8 * good.len()).map(|bit| {
            let mut file = good.clone();
            file[bit / 8] ^= 1 << (bit % 8);
            file
        });
        let other = [b"GIF89a".to_vec(), b"<svg/>".to_vec(), vec![0; 1000], Vec::new()];
        let (mut refused, mut n) = (0, 0);
        for file in cut.chain(flipped).chain(other) {
            n += 1;
            match decode(&file) {
                Err(reason) => {
                    assert!(!reason.is_empty());
                    refused += 1;
                }
                Ok(image) => {
                    let texel = image.texture_descriptor.format.block_copy_size(None).unwrap_or(0);
                    let expected = image.size().element_product() * texel;
                    assert_eq!(image.data.map(|data| data.len()), Some(expected as usize));
                    assert!(image.texture_descriptor.size.width <= MAX_SIDE);
                }
            }
        }
        assert!(refused > n / 2, "{refused} of {n}");
        // As long as the header is not whole, nothing else can be.
        assert!((0..33).all(|n| decode(&good[..n]).is_err()));
    }
}
