//! [`PicturePlan`]: what the pictures of a surface will be.

use crate::grid::ask_for;
use crate::plugin::api::textures::Maps;
use crate::plugin::api::{CrackBudget, CrackError, CrackMips, CrackResolution, CrackSurface};
use crate::plugin::carrier::kind::Shown;
use crate::plugin::gpu::memory::TextureMemory;
use crate::plugin::source::layout::{Layout, MOST_TEXELS};
use crate::plugin::source::mask::{MaskKey, PicturePart};
use crate::plugin::source::picture::{self, BaseKey, BasePicture, BasePictures, Space};
use crate::plugin::source::unfolding::Unfolding;
use crate::raster::TexelRect;
use bevy::{image::ImageSampler, prelude::*, render::renderer::RenderDevice};
use std::sync::Arc;

/// Bytes that a texel of a surface takes where pictures are read, beside those of its textures: colors, normals, depths, and on the way.
const READ_BYTES: u64 = 16;

/// Longer side of the textures of a surface without a picture, texels.
const DEFAULT_SIDE: f32 = 512.0;

/// The shorter side of those of a long one.
const DEFAULT_SHORTER: f32 = 256.0;

/// A picture that is shown so much wider or higher than it is gets textures with more columns or rows, on which cracks are not stretched.
const STRETCHED: f32 = 1.4;

/// Textures are not made coarser than this to fit the budget, texels.
const MIN_SIDE: u32 = 64;

/// What the pictures of a surface will be.
#[derive(Clone)]
pub(crate) struct PicturePlan {
    pub(crate) size: UVec2,
    /// The part of the image that is shown.
    pub(crate) rect: TexelRect,
    /// Bytes of the textures and of what belongs to them.
    pub(crate) bytes: u64,
    pub(crate) sampler: ImageSampler,
    pub(crate) maps: Maps,
    /// The size that the textures would have if the picture were not shown stretched; `None` if they have a size that was asked for.
    pub(crate) unstretched: Option<UVec2>,
    /// How the picture is laid out in its textures.
    pub(crate) layout: Option<Arc<Layout>>,
    /// Whether its texels are shown as squares.
    is_nearest: bool,
    /// Whether the textures hold the picture twice, one above the other.
    pub(crate) is_twofold: bool,
    /// How the mesh is laid out in them, if it is.
    pub(crate) unfolding: Option<Arc<Unfolding>>,
}

impl PicturePlan {
    /// The pictures that are needed.
    pub(super) fn needed<'a>(&self, shown: &'a Shown) -> [Option<&'a Handle<Image>>; 3] {
        let maps = [(&shown.diffuse, true), (&shown.normal, self.maps.normal), (&shown.depth, self.maps.depth)];
        maps.map(|(map, is_needed)| map.as_ref().filter(|_| is_needed))
    }

    pub(super) fn key(&self, shown: &Shown) -> BaseKey {
        let pictures = self.needed(shown).map(|map| map.map(Handle::id));
        let layout = self.layout.as_deref().copied();
        let unfolding = self.unfolding.as_ref().map(|unfolding| unfolding.id);
        BaseKey { pictures, size: self.size, layout, is_twofold: self.is_twofold, unfolding }
    }

    /// What the mask is made from that `part` of the picture makes.
    pub(super) fn mask_key(&self, picture: &Handle<Image>, part: PicturePart) -> MaskKey {
        let (picture, layout) = (picture.id(), self.layout.as_deref().copied());
        let unfolding = self.unfolding.as_ref().map(|unfolding| unfolding.id);
        MaskKey { picture, size: self.size, rect: self.rect, part, layout, unfolding }
    }

    /// Reads the pictures, unless somebody else has.
    pub(crate) fn draft(self, world: &mut World, shown: &Shown) -> Result<ReadPictures, CrackError> {
        let base = world.resource_scope(|world, mut bases: Mut<BasePictures>| {
            let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
            let picture = |map: Option<&Handle<Image>>| map.and_then(|picture| images.get(picture));
            bases.get(self.key(shown), || self.read(self.needed(shown).map(picture)))
        })?;
        Ok(ReadPictures { base, plan: self })
    }

    /// The pictures, read.
    pub(super) fn read(&self, [diffuse, normal, depth]: [Option<&Image>; 3]) -> Result<BasePicture, CrackError> {
        let bytes = self.bytes.saturating_add(READ_BYTES * self.size.as_u64vec2().element_product());
        ask_for(bytes).map_err(|error| CrackError::Textures { reason: error.to_string() })?;
        if let Some(unfolding) = &self.unfolding {
            return self.read_unfolded(unfolding, [diffuse, normal, depth]);
        }
        let size = if self.is_twofold { self.size / UVec2::new(1, 2) } else { self.size };
        let n = size.x as usize * size.y as usize;
        let read = |image: Option<&Image>| image.map(|image| picture::read(image, Space::Linear, size)).transpose();
        let diffuse = match diffuse {
            Some(image) => picture::read_shown(image, size, self.layout.as_deref(), self.is_nearest)?,
            None => vec![255; n * 4],
        };
        let normal = if self.maps.normal { read(normal)? } else { None };
        let depth = if self.maps.depth { read(depth)?.map(|rgba| picture::red(&rgba)) } else { None };
        let all = |texels: Vec<u8>| if self.is_twofold { texels.repeat(2) } else { texels };
        let mut picture = BasePicture::new(self.size, all(diffuse), normal.map(all), depth.map(all));
        picture.is_nearest = self.is_nearest;
        Ok(picture)
    }

    fn read_unfolded(
        &self,
        unfolding: &Arc<Unfolding>,
        [diffuse, normal, depth]: [Option<&Image>; 3],
    ) -> Result<BasePicture, CrackError> {
        let read = |image: Option<&Image>, space| {
            image.map(|image| picture::read_unfolded(image, space, unfolding, self.is_nearest)).transpose()
        };
        let diffuse =
            read(diffuse, Space::Srgb)?.unwrap_or_else(|| vec![255; self.size.as_usizevec2().element_product() * 4]);
        let mut normal = if self.maps.normal { read(normal, Space::Linear)? } else { None };
        if let Some(normal) = &mut normal {
            unfolding.turn_normals(normal);
        }
        let depth = if self.maps.depth { read(depth, Space::Linear)?.map(|rgba| picture::red(&rgba)) } else { None };
        let mut picture = BasePicture::new(self.size, diffuse, normal, depth).with_unfolding(Some(unfolding.clone()));
        picture.is_nearest = self.is_nearest;
        Ok(picture)
    }
}

/// The pictures of a surface, ready to be cracked.
pub(crate) struct ReadPictures {
    pub(crate) base: Arc<BasePicture>,
    pub(crate) plan: PicturePlan,
}

/// How a picture is shown in the world.
pub(crate) struct Stretch<'a> {
    /// Its width over its height there, its own size being given; see [`Kind::aspect`].
    pub(crate) aspect: &'a dyn Fn(Option<Vec2>) -> Option<f32>,
    /// The size that the surface's textures would have had without it, and what they have: as long as the former is the same, so is the
    /// latter, however it is shown now.
    pub(crate) kept: Option<(UVec2, UVec2)>,
    /// Whether the textures hold it twice, one above the other.
    pub(crate) is_twofold: bool,
    /// How the mesh is laid out in them, if it is.
    pub(crate) unfolding: Option<Arc<Unfolding>>,
}

/// Plans the pictures of a surface of which these maps are wanted; `None` if they are not there yet. Beside depths, a field takes `layer` bytes a texel; `owned` bytes of the
/// budget are its own already.
pub(super) fn plan_pictures(
    world: &World,
    (surface, wanted): (&CrackSurface, Maps),
    shown: &Shown,
    stretch: &Stretch<'_>,
    layer: u64,
    owned: u64,
) -> Result<Option<PicturePlan>, CrackError> {
    let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
    for picture in shown.pictures() {
        if !picture::is_loaded(world, picture)? {
            return Ok(None);
        }
    }
    let image = shown.diffuse.as_ref().and_then(|picture| images.get(picture));
    let mut maps = wanted.and(shown.maps);
    maps.mips &= match surface.mips {
        CrackMips::Auto => image.is_some_and(|image| image.texture_descriptor.mip_level_count > 1),
        CrackMips::Always => true,
        CrackMips::Never => false,
    };
    let is_nearest = image.is_some_and(|image| picture::is_nearest(world, image));
    let sampler = image.map_or(ImageSampler::Default, |image| image.sampler.clone());
    if let Some(unfolding) = &stretch.unfolding {
        let size = unfolding.layout.size;
        let bytes = bytes(size, (maps, layer));
        let used = world.resource::<TextureMemory>().used().saturating_sub(owned);
        let left = world.resource::<CrackBudget>().max_texture_bytes.saturating_sub(used);
        if bytes > left {
            return Err(CrackError::TextureBudget { needed: bytes, left });
        }
        let (rect, unfolding) = (TexelRect::whole(size), Some(unfolding.clone()));
        let plan = PicturePlan {
            size,
            rect,
            bytes,
            sampler,
            maps,
            unstretched: None,
            layout: None,
            is_nearest,
            is_twofold: false,
            unfolding,
        };
        return Ok(Some(plan));
    }
    let (size, unstretched) = size(world, surface, shown, image, stretch, is_nearest, (maps, layer), owned)?;
    let is_twofold = stretch.is_twofold && shown.rect.is_none();
    let rect = shown.texels(size).ok_or_else(|| {
        let URect { min, max } = shown.rect.unwrap_or_default();
        CrackError::Part { min, max, size }
    })?;
    let size = if is_twofold { size * UVec2::new(1, 2) } else { size };
    let (bytes, layout) = (bytes(size, (maps, layer)), shown.layout.clone());
    Ok(Some(PicturePlan {
        size,
        rect,
        bytes,
        sampler,
        maps,
        unstretched,
        layout,
        is_nearest,
        is_twofold,
        unfolding: None,
    }))
}

/// Bytes of the textures on the CPU and the GPU, the base picture, as if no other surface had the same, and the depth field with what it
/// may hold beside depths.
fn bytes(size: UVec2, (maps, layer): (Maps, u64)) -> u64 {
    u64::from(size.x) * u64::from(size.y) * texel_bytes(maps, layer)
}

/// The same of one texel.
pub(super) fn texel_bytes(maps: Maps, layer: u64) -> u64 {
    let whole = [maps.diffuse, maps.normal, maps.emissive].map(u64::from).iter().sum::<u64>();
    let textures = 8 * whole + 2 * u64::from(maps.depth);
    // A third more for mip levels.
    4 + 2 + layer + if maps.mips { (4 * textures).div_ceil(3) } else { textures }
}

/// Size of the textures: what is asked for, made smaller until it fits device and budget; and what it would be if the picture were not
/// shown stretched, unless another was asked for.
fn size(
    world: &World,
    surface: &CrackSurface,
    shown: &Shown,
    image: Option<&Image>,
    stretch: &Stretch<'_>,
    is_nearest: bool,
    maps: (Maps, u64),
    owned: u64,
) -> Result<(UVec2, Option<UVec2>), CrackError> {
    let aspect = |picture| (stretch.aspect)(picture).filter(|aspect| aspect.is_normal());
    let own_size = match image {
        Some(image) => {
            let size = picture::readable_size(image)?;
            shown.layout.as_ref().map_or(size, |layout| layout.texels(size))
        }
        None => {
            let aspect = aspect(None).unwrap_or(1.0);
            let longer =
                DEFAULT_SIDE.max(DEFAULT_SHORTER * aspect.max(aspect.recip())).min(MOST_TEXELS / DEFAULT_SHORTER);
            (Vec2::new(aspect, 1.0) * (longer / aspect.max(1.0))).as_uvec2().max(UVec2::ONE)
        }
    };
    let unstretched = (surface.resolution == CrackResolution::Picture).then_some(own_size);
    let budget = world.resource::<CrackBudget>();
    let device = world.get_resource::<RenderDevice>().map_or(u32::MAX, |d| d.limits().max_texture_dimension_2d);
    let max_side = budget.max_side.clamp(1, device.clamp(1, crate::pattern::MAX_SIDE));
    // Twice as high as the picture, and as large.
    let times = if stretch.is_twofold && shown.rect.is_none() { 2 } else { 1 };
    let max_side = (max_side / times).max(1);
    let bytes = |size, maps| u64::from(times) * bytes(size, maps);
    let left = budget.max_texture_bytes.saturating_sub(world.resource::<TextureMemory>().used().saturating_sub(owned));
    let keeps_size = shown.layout.as_ref().is_some_and(|layout| layout.keeps_size);
    let mut size = match surface.resolution {
        _ if keeps_size => own_size,
        CrackResolution::Fixed(size) if shown.rect.is_none() => size,
        CrackResolution::Picture if shown.rect.is_none() && !is_nearest => {
            let is_same = |(before, size): &(UVec2, UVec2)| *before == own_size && size.cmpge(own_size).all();
            let kept = stretch.kept.filter(is_same).map(|(_, size)| size);
            let fit = |image: &Image| Some(stretched(own_size, aspect(Some(image.size_f32()))?, max_side));
            let size = kept.or_else(|| image.and_then(fit));
            size.filter(|size| bytes(*size, maps) <= left).unwrap_or(own_size)
        }
        _ => own_size,
    };
    if size.min_element() == 0 {
        return Err(CrackError::Size { width: size.x, height: size.y });
    }
    if size.max_element() > max_side {
        if shown.rect.is_some() {
            return Err(CrackError::Size { width: size.x, height: size.y });
        }
        let scale = f64::from(max_side) / f64::from(size.max_element());
        size = (size.as_dvec2() * scale).as_uvec2().clamp(UVec2::ONE, UVec2::splat(max_side));
    }
    while bytes(size, maps) > left {
        if shown.rect.is_some() || size.max_element() <= MIN_SIDE {
            return Err(CrackError::TextureBudget { needed: bytes(size, maps), left });
        }
        size = (size / 2).max(UVec2::ONE);
    }
    Ok((size, unstretched))
}

/// Size of the textures of a picture of this size that is shown in the proportions `aspect`: all its columns and rows, and more of those
/// that are shown stretched, as far as they have room.
fn stretched(size: UVec2, aspect: f32, max_side: u32) -> UVec2 {
    let UVec2 { x: width, y: height } = size;
    // How much wider than high a texel is shown.
    let stretch = aspect * height as f32 / width as f32;
    if (STRETCHED.recip()..=STRETCHED).contains(&stretch) {
        return size;
    }
    let longer = |side: u32, other: u32, by: f32| {
        let most = f64::from(MOST_TEXELS / other as f32).min(f64::from(max_side)).max(f64::from(side));
        (f64::from(side) * f64::from(by)).min(most).round() as u32
    };
    if stretch > 1.0 {
        UVec2::new(longer(width, height, stretch), height)
    } else {
        UVec2::new(width, longer(height, width, stretch.recip()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretched_pictures_get_more_columns_or_rows() {
        let of = |width, height, aspect| stretched(UVec2::new(width, height), aspect, 8192).to_array();
        assert_eq!(of(512, 512, 1.0), [512, 512]);
        assert_eq!(of(512, 512, 1.39), [512, 512], "nobody sees it");
        assert_eq!(of(512, 512, 4.0), [2048, 512]);
        assert_eq!(of(512, 512, 0.25), [512, 2048]);
        assert_eq!(of(512, 128, 4.0), [512, 128]);
        assert_eq!(of(512, 128, 1.0), [512, 512]);
        assert_eq!(of(512, 1024, 100.0), [2048, 1024], "no more than two million texels");
        assert_eq!(of(4096, 2048, 9.0), [4096, 2048], "nor fewer than the picture has");
        assert_eq!(of(100, 100, 200.0), [8192, 100]);
        assert_eq!(of(1, 1, f32::MAX), [8192, 1]);
        assert_eq!(of(1, 1, f32::MIN_POSITIVE), [1, 8192]);
    }
}
