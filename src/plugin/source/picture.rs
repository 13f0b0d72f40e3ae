//! Reading pictures: [`BasePicture`].

use crate::Grid;
use crate::paint::BaseTexels;
use crate::plugin::api::error::CrackError;
use crate::plugin::source::layout::Layout;
use crate::plugin::source::unfolding::Unfolding;
use crate::raster::TexelRect;
use bevy::{
    asset::{AssetServer, LoadState},
    image::{ImageAddressMode, ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    platform::collections::HashMap,
    prelude::*,
    render::render_resource::{TextureDimension, TextureFormat},
};
use std::sync::{Arc, LazyLock, Weak};

/// The untouched pictures of a surface, all of one size.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BasePicture {
    pub(crate) size: UVec2,
    has_holes: bool,
    /// Whether its texels are shown as squares.
    pub(crate) is_nearest: bool,
    /// RGBA8, sRGB.
    pub(crate) diffuse: Vec<u8>,
    /// RGBA8, linear; `None` = flat.
    pub(crate) normal: Option<Vec<u8>>,
    /// R8; `None` = 0.
    pub(crate) depth: Option<Vec<u8>>,
    /// How the mesh is laid out in it, if it is.
    unfolding: Option<Arc<Unfolding>>,
}

/// Alpha below this is a hole: hits are refused and no crack goes there.
const OPAQUE: u8 = 8;

impl BasePicture {
    pub(crate) fn new(size: UVec2, diffuse: Vec<u8>, normal: Option<Vec<u8>>, depth: Option<Vec<u8>>) -> Self {
        let has_holes = diffuse.as_chunks::<4>().0.iter().any(|texel| texel[3] < OPAQUE);
        Self { size, has_holes, is_nearest: false, diffuse, normal, depth, unfolding: None }
    }

    /// The same with a mesh laid out in it: there are no cracks where it is not.
    pub(crate) fn with_unfolding(self, unfolding: Option<Arc<Unfolding>>) -> Self {
        Self { has_holes: self.has_holes || unfolding.is_some(), unfolding, ..self }
    }

    /// How the mesh is laid out in it, if it is.
    pub(crate) const fn unfolding(&self) -> Option<&Arc<Unfolding>> {
        self.unfolding.as_ref()
    }

    /// Texels for a unit of pattern space, if not as many as the shorter side has.
    pub(crate) fn unit(&self) -> Option<f32> {
        self.unfolding.as_ref().map(|unfolding| unfolding.unit)
    }

    /// Whether the texel is a hole: a gap, or transparent.
    pub(crate) fn is_hole(&self, texel: UVec2) -> bool {
        self.is_closed(texel, true)
    }

    /// Whether cracks may not go over the texel: a gap, or transparent if that is to be kept free (`alpha_mask`).
    pub(crate) fn is_closed(&self, texel: UVec2, alpha_mask: bool) -> bool {
        let texel = texel.min(self.size.saturating_sub(UVec2::ONE));
        if self.unfolding.as_ref().is_some_and(|unfolding| unfolding.is_gap(texel)) {
            return true;
        }
        if !alpha_mask {
            return false;
        }
        let i = (texel.y as usize * self.size.x as usize + texel.x as usize) * 4 + 3;
        self.diffuse.get(i).is_some_and(|alpha| *alpha < OPAQUE)
    }

    /// To paint on.
    pub(crate) fn texels(&self) -> BaseTexels<'_> {
        let Self { size, diffuse, normal, depth, .. } = self;
        BaseTexels { size: *size, diffuse, normal: normal.as_deref(), depth: depth.as_deref() }
    }

    /// Number of texels.
    pub(crate) fn area(&self) -> usize {
        self.size.x as usize * self.size.y as usize
    }

    /// Where cracks may go in `rect`. `None` = everywhere.
    pub(crate) fn density(&self, rect: TexelRect, alpha_mask: bool) -> Option<Grid<f32>> {
        let has_any = if alpha_mask { self.has_holes } else { self.unfolding.is_some() };
        has_any.then(|| density(rect.size(), |texel| self.is_closed(rect.min + texel, alpha_mask)))?
    }
}

/// Base pictures that are in use: surfaces that show the same have one together.
#[derive(Resource, Default)]
pub(crate) struct BasePictures(HashMap<BaseKey, Weak<BasePicture>>);

/// What a base picture is read from: diffuse, normal and depth, those of them that there are.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct BaseKey {
    pub(crate) pictures: [Option<AssetId<Image>>; 3],
    pub(crate) size: UVec2,
    pub(crate) layout: Option<Layout>,
    pub(crate) is_twofold: bool,
    /// The id of the layout of the mesh.
    pub(crate) unfolding: Option<u64>,
}

impl BasePictures {
    /// The one that is in use, or what `read` makes.
    pub(crate) fn get(
        &mut self,
        key: BaseKey,
        read: impl FnOnce() -> Result<BasePicture, CrackError>,
    ) -> Result<Arc<BasePicture>, CrackError> {
        if let Some(base) = self.find(key) {
            return Ok(base);
        }
        let base = Arc::new(read()?);
        self.remember(key, &base);
        Ok(base)
    }

    /// The one that is in use.
    pub(crate) fn find(&self, key: BaseKey) -> Option<Arc<BasePicture>> {
        self.0.get(&key).and_then(Weak::upgrade)
    }

    pub(crate) fn remember(&mut self, key: BaseKey, base: &Arc<BasePicture>) {
        if self.0.len() == self.0.capacity() {
            self.0.retain(|_, base| base.strong_count() > 0);
        }
        self.0.insert(key, Arc::downgrade(base));
    }

    /// The picture has changed.
    pub(crate) fn forget(&mut self, picture: AssetId<Image>) {
        self.0.retain(|key, _| !key.pictures.contains(&Some(picture)));
    }
}

/// Number of frames so far, as far as changes of pictures go.
#[derive(Resource, Default)]
pub(crate) struct FrameCount(pub(crate) u64);

/// Longer side of the mask that keeps cracks off transparent texels: a tenth of the distance between markers.
const MASK_SIDE: u32 = 256;

/// Texels of which the mean colour is taken.
const SAMPLES: usize = 4096;

impl BasePicture {
    /// Its mean colour where it is opaque, sRGB; grey if it is nowhere.
    pub(crate) fn mean(&self) -> [f32; 3] {
        let texels = self.diffuse.as_chunks::<4>().0;
        let stride = (texels.len() / SAMPLES).max(1);
        let (mut sum, mut n) = ([0.0; 3], 0.0);
        for [red, green, blue, alpha] in texels.iter().step_by(stride) {
            if *alpha >= OPAQUE {
                n += 255.0;
                sum = [sum[0] + f32::from(*red), sum[1] + f32::from(*green), sum[2] + f32::from(*blue)];
            }
        }
        if n > 0.0 { sum.map(|channel| channel / n) } else { [0.5; 3] }
    }
}

/// How the numbers of a picture are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Space {
    Srgb,
    Linear,
}

/// Where cracks may go: not over holes. `None` if there are none.
pub(crate) fn density(size: UVec2, is_hole: impl Fn(UVec2) -> bool) -> Option<Grid<f32>> {
    if !(0..size.y).any(|y| (0..size.x).any(|x| is_hole(UVec2::new(x, y)))) {
        return None;
    }
    let side = size.max_element().max(MASK_SIDE);
    let mask_size = UVec2::new((size.x * MASK_SIDE).div_ceil(side), (size.y * MASK_SIDE).div_ceil(side));
    let mut mask = Grid::new(mask_size, 0.0);
    for y in 0..mask_size.y {
        for (x, value) in (0..mask_size.x).zip(mask.row_mut(y as usize)) {
            let texel = (UVec2::new(2 * x + 1, 2 * y + 1) * size) / (2 * mask_size);
            *value = if is_hole(texel) { 0.0 } else { 1.0 };
        }
    }
    Some(mask)
}

/// Whether a picture is there; an error if it never will be.
pub(crate) fn is_loaded(world: &World, picture: &Handle<Image>) -> Result<bool, CrackError> {
    let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    if images.contains(picture) {
        return Ok(true);
    }
    match world.get_resource::<AssetServer>().and_then(|server| server.get_load_state(picture)) {
        Some(LoadState::Failed(error)) => {
            // With backtraces on, the text goes on for pages.
            let reason = error.to_string().lines().next().unwrap_or_default().to_owned();
            Err(CrackError::LoadFailed { reason })
        }
        _ => Ok(false),
    }
}

/// Whether pictures that say nothing about it show their texels as squares, as those of pixel art.
#[derive(Resource, Default)]
pub(crate) struct NearestByDefault(bool);

impl NearestByDefault {
    /// What the app's [`ImagePlugin`] says.
    pub(crate) fn of(app: &App) -> Self {
        Self(app.get_added_plugins::<ImagePlugin>().iter().any(|plugin| shows_squares(&plugin.default_sampler)))
    }
}

fn shows_squares(sampler: &ImageSamplerDescriptor) -> bool {
    sampler.mag_filter == ImageFilterMode::Nearest
}

/// Whether the texels of a picture are shown as squares: between them nothing is made up then.
pub(crate) fn is_nearest(world: &World, image: &Image) -> bool {
    match &image.sampler {
        ImageSampler::Default => world.get_resource::<NearestByDefault>().is_some_and(|nearest| nearest.0),
        ImageSampler::Descriptor(sampler) => shows_squares(sampler),
    }
}

/// The size of a picture whose data can be read.
pub(crate) fn readable_size(image: &Image) -> Result<UVec2, CrackError> {
    let (size, format) = (image.size(), image.texture_descriptor.format);
    if size.min_element() == 0 {
        return Err(CrackError::Size { width: size.x, height: size.y });
    }
    let unsupported = || CrackError::UnsupportedFormat { format: format!("{format:?}") };
    let layers = image.texture_descriptor.size.depth_or_array_layers;
    if image.texture_descriptor.dimension != TextureDimension::D2 || layers != 1 || image.is_compressed() {
        return Err(unsupported());
    }
    let data = image.data.as_ref().ok_or(CrackError::NoCpuData)?;
    let texel = u64::from(format.block_copy_size(None).ok_or_else(unsupported)?);
    let expected = (u64::from(size.x) * u64::from(size.y)).saturating_mul(texel);
    let actual = data.len() as u64;
    let has_mips = image.texture_descriptor.mip_level_count > 1;
    if actual < expected || (actual > expected && !has_mips) {
        return Err(CrackError::DataLength { expected, actual });
    }
    Ok(size)
}

/// The texels of a picture, RGBA8 in `space`, resampled to `size`.
pub(crate) fn read(image: &Image, space: Space, size: UVec2) -> Result<Vec<u8>, CrackError> {
    use TextureFormat::{Bgra8Unorm, Bgra8UnormSrgb, Rgba8Unorm, Rgba8UnormSrgb};
    let own_size = readable_size(image)?;
    let n = own_size.x as usize * own_size.y as usize;
    let data = image.data.as_ref().ok_or(CrackError::NoCpuData)?;
    let format = image.texture_descriptor.format;
    let texels = match (format, space) {
        (Rgba8UnormSrgb, Space::Srgb) | (Rgba8Unorm, Space::Linear) => data[..n * 4].to_vec(),
        (Bgra8UnormSrgb, Space::Srgb) | (Bgra8Unorm, Space::Linear) => {
            data[..n * 4].as_chunks().0.iter().flat_map(|&[b, g, r, a]| [r, g, b, a]).collect()
        }
        _ => {
            let mut texels = Vec::with_capacity(n * 4);
            for y in 0..own_size.y {
                for x in 0..own_size.x {
                    let mut color = image
                        .get_color_at(x, y)
                        .map_err(|_| CrackError::UnsupportedFormat { format: format!("{format:?}") })?;
                    if format == TextureFormat::Rg16Uint {
                        // What the engine makes of a file with grey and alpha.
                        let LinearRgba { red, green, .. } = color.to_linear();
                        color = LinearRgba::new(red, red, red, green).into();
                    }
                    let rgba = match space {
                        Space::Srgb => color.to_srgba().to_f32_array(),
                        Space::Linear => color.to_linear().to_f32_array(),
                    };
                    texels.extend(rgba.map(to_byte));
                }
            }
            texels
        }
    };
    Ok(if size == own_size { texels } else { Sampling::of(image, space).resample(&texels, own_size, size) })
}

/// As [`read`], but as the renderer shows a picture in sRGB: one channel is red, not grey.
pub(crate) fn read_colors(image: &Image, space: Space, size: UVec2) -> Result<Vec<u8>, CrackError> {
    let mut texels = read(image, space, size)?;
    if space == Space::Srgb && image.texture_descriptor.format.components() == 1 {
        texels.as_chunks_mut::<4>().0.iter_mut().for_each(|texel| (texel[1], texel[2]) = (0, 0));
    }
    Ok(texels)
}

/// As [`read_colors`] in sRGB, laid out as the renderer shows the picture, its texels as squares if `is_nearest`.
pub(crate) fn read_shown(
    image: &Image,
    size: UVec2,
    layout: Option<&Layout>,
    is_nearest: bool,
) -> Result<Vec<u8>, CrackError> {
    let Some(layout) = layout else { return read_colors(image, Space::Srgb, size) };
    let own_size = readable_size(image)?;
    let texels = read_colors(image, Space::Srgb, own_size)?;
    let places = layout.places(own_size, size);
    Ok(Sampling::of(image, Space::Srgb).sample(&texels, own_size, size, |x, y| {
        let place = places(x, y);
        if is_nearest { place.floor() + 0.5 } else { place }
    }))
}

/// As [`read_colors`], where a mesh shows them that is laid out.
pub(crate) fn read_unfolded(
    image: &Image,
    space: Space,
    unfolding: &Unfolding,
    is_nearest: bool,
) -> Result<Vec<u8>, CrackError> {
    let own_size = readable_size(image)?;
    let texels = read_colors(image, space, own_size)?;
    let place = |x, y| {
        let place = unfolding.place(UVec2::new(x, y), own_size);
        if is_nearest { place.floor() + 0.5 } else { place }
    };
    Ok(Sampling::of(image, space).sample(&texels, own_size, unfolding.layout.size, place))
}

/// The red channel alone.
pub(crate) fn red(rgba: &[u8]) -> Vec<u8> {
    rgba.iter().step_by(4).copied().collect()
}

/// NaN becomes 0.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn to_byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// How a picture is read between its texels: bilinear, as the renderer does.
pub(crate) struct Sampling {
    /// Whether it goes on at the other side beyond an edge, across and down; else the edge is held.
    repeats: [bool; 2],
    levels: &'static Levels,
}

/// What the levels of a picture stand for.
struct Levels {
    /// The light of each level.
    light: [f32; 256],
    /// The level of each light, by its root.
    level: Vec<u8>,
}

static SRGB: LazyLock<Levels> = LazyLock::new(|| Levels::new(Space::Srgb));

static LINEAR: LazyLock<Levels> = LazyLock::new(|| Levels::new(Space::Linear));

impl Sampling {
    pub(crate) fn of(image: &Image, space: Space) -> Self {
        let repeats = match &image.sampler {
            ImageSampler::Default => [false; 2],
            ImageSampler::Descriptor(sampler) => {
                [sampler.address_mode_u, sampler.address_mode_v].map(|mode| mode == ImageAddressMode::Repeat)
            }
        };
        Self::new(repeats, space)
    }

    fn new(repeats: [bool; 2], space: Space) -> Self {
        let levels = match space {
            Space::Srgb => &SRGB,
            Space::Linear => &LINEAR,
        };
        Self { repeats, levels }
    }

    /// A picture at another size, its edges where they were.
    fn resample(&self, texels: &[u8], from: UVec2, to: UVec2) -> Vec<u8> {
        let scale = from.as_vec2() / to.as_vec2();
        self.sample(texels, from, to, |x, y| (UVec2::new(x, y).as_vec2() + 0.5) * scale)
    }

    /// The colours `at` the places of other texels; texel centres are at half-integers.
    fn sample(&self, texels: &[u8], from: UVec2, to: UVec2, at: impl Fn(u32, u32) -> Vec2) -> Vec<u8> {
        let mut out = Vec::with_capacity(to.x as usize * to.y as usize * 4);
        for y in 0..to.y {
            for x in 0..to.x {
                out.extend(self.texel(texels, from, at(x, y)));
            }
        }
        out
    }

    /// The colour of one place.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "coordinates lie inside the picture")]
    #[inline]
    pub(crate) fn texel(&self, texels: &[u8], from: UVec2, place: Vec2) -> [u8; 4] {
        // The texels before and after a place along an axis, and how far it is from the one to the other.
        let beside = |at: f32, axis: usize| {
            let last = from[axis] - 1;
            if self.repeats[axis] {
                let at = (at - 0.5).rem_euclid(from[axis] as f32);
                let low = (at as u32).min(last);
                (low, if low == last { 0 } else { low + 1 }, at.fract())
            } else {
                let at = (at - 0.5).clamp(0.0, last as f32);
                let low = at as u32;
                (low, (low + 1).min(last), at.fract())
            }
        };
        let rows = texels.as_chunks::<4>().0;
        let ((left, right, across), (top, bottom, down)) = (beside(place.x, 0), beside(place.y, 1));
        let texel = |x: u32, y: u32| rows[y as usize * from.x as usize + x as usize];
        let corners = [texel(left, top), texel(right, top), texel(left, bottom), texel(right, bottom)];
        let mix = |[a, b, c, d]: [f32; 4]| a.lerp(b, across).lerp(c.lerp(d, across), down);
        let level = |channel: usize| {
            let light = mix(corners.map(|texel| self.levels.light[usize::from(texel[channel])]));
            let root = (light.sqrt() * Levels::LIGHTS + 0.5) as usize;
            self.levels.level[root.min(self.levels.level.len() - 1)]
        };
        let alpha = (mix(corners.map(|texel| f32::from(texel[3]))) + 0.5) as u8;
        [level(0), level(1), level(2), alpha]
    }
}

impl Levels {
    /// Lights that are told apart: ten or more for each level.
    const LIGHTS: f32 = 4095.0;

    #[expect(clippy::cast_possible_truncation, reason = "the number of lights")]
    fn new(space: Space) -> Self {
        let light = |level: u8| match space {
            Space::Srgb => Color::srgb_u8(level, 0, 0).to_linear().red,
            Space::Linear => f32::from(level) / 255.0,
        };
        let level = |root: u32| {
            let light = (root as f32 / Self::LIGHTS).powi(2);
            to_byte(match space {
                Space::Srgb => Srgba::from(LinearRgba::rgb(light, 0.0, 0.0)).red,
                Space::Linear => light,
            })
        };
        let light = core::array::from_fn(|i| light(i as u8));
        Self { light, level: (0..=Self::LIGHTS as u32).map(level).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_picture_in_use_is_read_once() {
        let mut bases = BasePictures::default();
        let id = AssetId::from(bevy::asset::uuid::Uuid::from_u128(7));
        let pictures = [None, Some(id), None];
        let key =
            |side| BaseKey { pictures, size: UVec2::splat(side), layout: None, is_twofold: false, unfolding: None };
        let white = |side: u32| BasePicture::new(UVec2::splat(side), vec![255; 4 * (side * side) as usize], None, None);
        let unread = || -> Result<BasePicture, CrackError> { panic!("it is in use") };
        assert_eq!(bases.get(key(1), || Err(CrackError::NoCpuData)), Err(CrackError::NoCpuData));
        let one = bases.get(key(1), || Ok(white(1))).unwrap();
        assert!(Arc::ptr_eq(&one, &bases.get(key(1), unread).unwrap()));
        let two = bases.get(key(2), || Ok(white(2))).unwrap();
        assert_eq!((one.size, two.size), (UVec2::ONE, UVec2::splat(2)));
        bases.forget(AssetId::default());
        assert!(Arc::ptr_eq(&two, &bases.get(key(2), unread).unwrap()));
        bases.forget(id);
        assert!(!Arc::ptr_eq(&two, &bases.get(key(2), || Ok(white(2))).unwrap()));
        // Those that nobody uses are not kept.
        (3..99).for_each(|side| _ = bases.get(key(side), || Ok(white(side))));
        assert!(bases.0.len() < 33, "{} are known", bases.0.len());
    }

    #[test]
    fn resampling_keeps_even_pictures() {
        for (space, level) in
            [Space::Srgb, Space::Linear].into_iter().flat_map(|space| (0..=255).map(move |i| (space, i)))
        {
            let even = Sampling::new([level % 2 == 0, true], space);
            assert_eq!(even.resample(&[level; 3 * 2 * 4], UVec2::new(3, 2), UVec2::new(5, 4)), [level; 5 * 4 * 4]);
        }
    }

    #[test]
    fn steps_are_halved_as_the_renderer_halves_them() {
        let step = |space, repeats, high: u8| {
            let texels = [0, 0, 0, 0, high, high, high, high];
            Sampling::new([repeats; 2], space).resample(&texels, UVec2::new(2, 1), UVec2::new(4, 1))
        };
        assert_eq!(red(&step(Space::Linear, false, 100)), [0, 25, 75, 100]);
        assert_eq!(red(&step(Space::Linear, true, 100)), [25, 25, 75, 75], "it goes on at the other side");
        // A quarter and three quarters of the light of white.
        assert_eq!(red(&step(Space::Srgb, false, 255)), [0, 137, 225, 255]);
        assert_eq!(step(Space::Srgb, false, 255)[7], 64, "alpha is no light");
    }
}
