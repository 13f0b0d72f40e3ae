//! The kinds of textures that a surface has, and their texels.

use crate::paint::{BaseTexels, LookTable, MipLevels, PaintTargets, TexelKind, paint_glow, paint_new, paint_rects};
use crate::plugin::api::textures::{CrackTextures, MAPS, Maps};
use crate::plugin::gpu::buffer::{Staged, Stager};
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::source::analogy::AnalogyPicture;
use crate::plugin::source::picture::BasePicture;
use crate::raster::{DepthField, TexelRect};
use bevy::{
    asset::RenderAssetUsages,
    image::ImageSampler,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};

/// One of the pictures of a surface.
pub(crate) struct TextureKind {
    pub(crate) is_wanted: fn(Maps) -> bool,
    /// The texels of an uncracked surface.
    uncracked: fn(&BasePicture) -> Vec<u8>,
    texel: TexelKind,
    format: TextureFormat,
}

pub(crate) const DIFFUSE: TextureKind = TextureKind {
    is_wanted: |maps| maps.diffuse,
    uncracked: |base| base.diffuse.clone(),
    texel: TexelKind::Color,
    format: TextureFormat::Rgba8UnormSrgb,
};

pub(crate) const NORMAL: TextureKind = TextureKind {
    is_wanted: |maps| maps.normal,
    uncracked: |base| base.normal.clone().unwrap_or_else(|| [128, 128, 255, 255].repeat(base.area())),
    texel: TexelKind::Linear,
    format: TextureFormat::Rgba8Unorm,
};

pub(crate) const DEPTH: TextureKind = TextureKind {
    is_wanted: |maps| maps.depth,
    uncracked: |base| base.depth.clone().unwrap_or_else(|| vec![0; base.area()]),
    texel: TexelKind::Single,
    format: TextureFormat::R8Unorm,
};

pub(crate) const EMISSIVE: TextureKind = TextureKind {
    is_wanted: |maps| maps.emissive,
    uncracked: |base| [0, 0, 0, 255].repeat(base.area()),
    texel: TexelKind::Color,
    format: TextureFormat::Rgba8UnormSrgb,
};

/// In the order of [`CrackTextures`].
pub(crate) const KINDS: [TextureKind; MAPS] = [DIFFUSE, NORMAL, DEPTH, EMISSIVE];

/// Paints some rectangles of the field, whose top left is at `origin`, in all textures there are; texels in the order of [`KINDS`]. If there
/// is an analogy, its picture is in the place of the base, and has most of the cracks.
pub(crate) fn paint(
    base: &BasePicture,
    analogy: Option<&AnalogyPicture>,
    field: &DepthField,
    look: &LookTable,
    rects: &[TexelRect],
    origin: UVec2,
    texels: [Option<&mut [u8]>; MAPS],
) {
    let [diffuse, normal, depth, emissive] = texels;
    match analogy {
        None => paint_rects(base.texels(), field, look, rects, origin, &mut PaintTargets { diffuse, normal, depth }),
        Some(made) => {
            let (carried, normal) = if made.normal.is_some() { (normal, None) } else { (None, normal) };
            let over = BaseTexels { diffuse: &made.diffuse, normal: made.normal.as_deref(), ..base.texels() };
            let mut targets = PaintTargets { diffuse, normal: carried, depth: None };
            paint_new(over, made.shown(), field, look, rects, origin, &mut targets);
            if normal.is_some() || depth.is_some() {
                let mut targets = PaintTargets { diffuse: None, normal, depth };
                paint_rects(base.texels(), field, look, rects, origin, &mut targets);
            }
        }
    }
    if let Some(emissive) = emissive {
        paint_glow(None, base.size, field, look, rects, origin, emissive);
    }
}

impl TextureKind {
    /// Bytes of a texel.
    pub(crate) const fn texel(&self) -> usize {
        self.texel.bytes()
    }

    /// The mip levels that a texture may have.
    pub(crate) const fn levels(&self, size: UVec2) -> MipLevels {
        MipLevels::new(size, self.texel)
    }

    /// The texels of an uncracked surface, with those of the mip levels if there are to be any.
    pub(crate) fn texels(&self, base: &BasePicture, has_mips: bool) -> Vec<u8> {
        let mut texels = (self.uncracked)(base);
        if has_mips {
            let levels = self.levels(base.size);
            texels.resize(levels.bytes(), 0);
            levels.update(&mut texels, &[TexelRect::whole(base.size)]);
        }
        texels
    }

    /// The only place where textures of surfaces are made, with mip levels if the data has them. `None` if the data has not the length that size and format
    /// need, or there is no texel: the renderer ends the app over such an image.
    pub(crate) fn image(&self, size: UVec2, data: Vec<u8>, sampler: &ImageSampler) -> Option<Image> {
        let levels = self.levels(size);
        let has_mips = data.len() == levels.bytes();
        let mut image =
            self.empty(size, sampler, has_mips).filter(|_| has_mips || data.len() == levels.range(0).end)?;
        image.data = Some(data);
        Some(image)
    }

    /// The same without texels yet; the renderer makes room for them.
    pub(crate) fn empty(&self, size: UVec2, sampler: &ImageSampler, has_mips: bool) -> Option<Image> {
        let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
        let mut image = Image::new_uninit(extent, TextureDimension::D2, self.format, RenderAssetUsages::default());
        image.texture_descriptor.mip_level_count = if has_mips { self.levels(size).count() } else { 1 };
        image.sampler = sampler.clone();
        (size.min_element() > 0).then_some(image)
    }
}

/// The texels of the uncracked textures that are wanted, in the order of [`KINDS`].
pub(crate) fn texels(maps: Maps, base: &BasePicture) -> [Option<Vec<u8>>; MAPS] {
    KINDS.each_ref().map(|kind| (kind.is_wanted)(maps).then(|| kind.texels(base, maps.mips)))
}

/// The mip levels that one of the textures may have; `None` of other images.
pub(crate) fn levels(image: &Image) -> Option<MipLevels> {
    let kind = KINDS.iter().find(|kind| kind.format == image.texture_descriptor.format)?;
    Some(kind.levels(image.size()))
}

/// Brings mip levels up to date, of textures that have some, where rectangles of the field are painted, whose top left is at `origin`.
pub(crate) fn update_mips(texels: &mut [Option<Vec<u8>>; MAPS], size: UVec2, rects: &[TexelRect], origin: UVec2) {
    let in_image = |rect: &TexelRect| TexelRect { min: rect.min + origin, max: rect.max + origin };
    let rects: Vec<_> = rects.iter().map(in_image).collect();
    for (kind, texels) in KINDS.iter().zip(texels) {
        texels.as_mut().map(|texels| kind.levels(size).update(texels, &rects));
    }
}

/// The texels of a texture, and the same where the renderer can read them.
pub(crate) struct Picture {
    pub(crate) texels: Vec<u8>,
    staged: Option<Staged>,
}

/// Texels of textures of this size, in the order of [`KINDS`], brought to the renderer if there is one.
pub(crate) fn stage(texels: [Option<Vec<u8>>; MAPS], size: UVec2, stager: Option<&Stager>) -> [Option<Picture>; MAPS] {
    let mut kinds = KINDS.iter();
    texels.map(|texels| {
        let (kind, texels) = (kinds.next()?, texels?);
        let staged = stager.and_then(|stager| stager.stage(&texels, kind.levels(size), &[TexelRect::whole(size)]));
        Some(Picture { texels, staged })
    })
}

impl CrackTextures {
    /// Gives them their texels, and the renderer; `pictures` have what they had before then.
    pub(crate) fn fill(&self, world: &mut World, pictures: &mut [Option<Picture>; MAPS]) {
        world.resource_scope(|world, mut uploads: Mut<Uploads>| {
            let Some(mut images) = world.get_resource_mut::<Assets<Image>>() else { return };
            for (texture, picture) in self.all().into_iter().zip(pictures) {
                // Without an asset event, which would upload the whole image once more.
                if let (Some(texture), Some(picture)) = (texture, picture)
                    && let Some(image) = images.get_mut_untracked(texture)
                {
                    let before = image.data.replace(core::mem::take(&mut picture.texels));
                    picture.texels = before.unwrap_or_default();
                    uploads.push_whole(texture.id(), image.size(), picture.staged.take());
                }
            }
        });
    }

    /// Whether the renderer has yet to upload what they were filled with.
    pub(crate) fn are_staged(&self, world: &World) -> bool {
        let uploads = world.resource::<Uploads>();
        self.handles().any(|texture| uploads.is_staged(texture.id()))
    }
}
