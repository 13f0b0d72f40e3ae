//! The grain of broken stone: one small picture that repeats, for the sides of all shards.

use crate::math::hash_unit;
use crate::paint::{MipLevels, TexelKind};
use crate::raster::TexelRect;
use bevy::{
    asset::RenderAssetUsages,
    image::{ImageAddressMode, ImageSampler, ImageSamplerDescriptor},
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use std::sync::LazyLock;

/// Texels along each side.
const SIDE: u32 = 128;

/// How much larger a mean texel would be if it were white: a material is lighter by that.
pub(crate) const LIGHTER: f32 = 1.0 / 0.8;

/// Cells along each side of patches, and how much lighter or darker they are.
const PATCHES: [(u32, f32); 3] = [(5, 0.07), (16, 0.07), (48, 0.1)];

/// Cells along each side with a stone or a pore each, and the share of cells that has one.
const STONES: [(u32, f32); 2] = [(17, 0.25), (40, 0.4)];

/// Texels of all sizes, the largest first.
static TEXELS: LazyLock<Vec<u8>> = LazyLock::new(texels);

/// The picture, if it is there: it goes with the last material that shows it.
#[derive(Resource, Default)]
pub(crate) struct Grain(Option<AssetId<Image>>);

/// The picture of the grain. `None` where there are no images.
pub(crate) fn picture(world: &mut World) -> Option<Handle<Image>> {
    let known = world.get_resource::<Grain>()?.0;
    let mut images = world.get_resource_mut::<Assets<Image>>()?;
    if let Some(handle) = known.and_then(|known| images.get_strong_handle(known)) {
        return Some(handle);
    }
    let handle = images.add(image());
    world.insert_resource(Grain(Some(handle.id())));
    Some(handle)
}

fn image() -> Image {
    let extent = Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba8UnormSrgb;
    let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::default());
    image.texture_descriptor.mip_level_count = SIDE.ilog2() + 1;
    image.data = Some(TEXELS.clone());
    let mode = ImageAddressMode::Repeat;
    image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
        address_mode_u: mode,
        address_mode_v: mode,
        ..ImageSamplerDescriptor::linear()
    });
    image
}

fn texels() -> Vec<u8> {
    let size = UVec2::splat(SIDE);
    let bytes =
        |i: u32| texel(UVec2::new(i % SIDE, i / SIDE)).map(|value| (255.0 * value.clamp(0.0, 1.0)).round() as u8);
    let mut texels: Vec<u8> = (0..SIDE * SIDE).flat_map(bytes).collect();
    let levels = MipLevels::new(size, TexelKind::Color);
    texels.resize(levels.bytes(), 0);
    levels.update(&mut texels, &[TexelRect::whole(size)]);
    texels
}

/// How light a texel is, and how warm.
fn texel(at: UVec2) -> [f32; 4] {
    let share = (at.as_vec2() + 0.5) / SIDE as f32;
    let mut light = 1.0 / LIGHTER + 0.18 * (hash_unit(1, u64::from(at.y * SIDE + at.x)) - 0.5);
    let mut warm = 0.0;
    for (seed, (cells, height)) in (2..).zip(PATCHES) {
        light += height * (2.0 * patch(seed, cells, share) - 1.0);
    }
    for (seed, (cells, many)) in (8..).zip(STONES) {
        let (own, hue) = stone(seed, cells, many, share);
        (light, warm) = (light + own, warm + hue);
    }
    [light * (1.0 + warm), light, light * (1.0 - warm), 1.0]
}

/// Smooth noise that repeats after so many cells, 0..=1.
fn patch(seed: u64, cells: u32, share: Vec2) -> f32 {
    let at = share * cells as f32;
    let (cell, share) = (at.floor(), at - at.floor());
    let share = share * share * (3.0 - 2.0 * share);
    let corner = |x: u32, y: u32| {
        let [x, y] = [cell.x as u32 + x, cell.y as u32 + y].map(|value| u64::from(value % cells));
        hash_unit(seed, y << 32 | x)
    };
    let top = corner(0, 0).lerp(corner(1, 0), share.x);
    top.lerp(corner(0, 1).lerp(corner(1, 1), share.x), share.y)
}

/// How much lighter and warmer a place is for the stones around it; pores are dark.
fn stone(seed: u64, cells: u32, many: f32, share: Vec2) -> (f32, f32) {
    let at = share * cells as f32;
    let (mut light, mut warm) = (0.0, 0.0);
    for (x, y) in (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))) {
        let cell = at.floor().as_ivec2() + IVec2::new(x, y);
        let own = cell.rem_euclid(IVec2::splat(cells as i32)).as_uvec2();
        let number = |k: u64| hash_unit(seed << 8 | k, u64::from(own.y) << 32 | u64::from(own.x));
        if number(0) > many {
            continue;
        }
        let middle = cell.as_vec2() + Vec2::new(number(1), number(2));
        let away = (at - middle) * Vec2::new(1.0, 0.7 + 0.6 * number(3));
        let inside = ((0.2 + 0.3 * number(4) - away.length()) * 8.0).clamp(0.0, 1.0);
        let tone = if number(5) < 0.25 { -0.16 } else { 0.22 * (number(6) - 0.4) };
        (light, warm) = (light + inside * tone, warm + inside * 0.06 * (number(7) - 0.5));
    }
    (light, warm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grain_has_all_its_sizes_and_no_seam() {
        let texels = &*TEXELS;
        assert_eq!(texels.len(), (0..=SIDE.ilog2()).map(|level| 4 * (SIDE >> level).pow(2) as usize).sum::<usize>());
        let mean = f32::from(texels[texels.len() - 4]) / 255.0;
        assert!((mean * LIGHTER - 1.0).abs() < 0.08, "{mean}");
        // Over the border it changes as it does elsewhere.
        let at = |x: u32, y: u32| f32::from(texels[4 * (y % SIDE * SIDE + x % SIDE) as usize]);
        let step = |x: u32| (0..SIDE).map(|y| (at(x, y) - at(x + 1, y)).abs()).sum::<f32>();
        let most = (0..SIDE - 1).map(step).fold(0.0, f32::max);
        assert!(step(SIDE - 1) <= most, "{} {most}", step(SIDE - 1));
    }
}
