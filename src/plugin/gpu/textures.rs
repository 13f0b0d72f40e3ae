//! The kinds of textures that a surface has, and their texels.

use crate::paint::{BaseTexels, LookTable, PaintTargets, paint_glow, paint_new, paint_rects};
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
    pub(crate) texels: fn(&BasePicture) -> Vec<u8>,
    format: TextureFormat,
}

pub(crate) const DIFFUSE: TextureKind = TextureKind {
    is_wanted: |maps| maps.diffuse,
    texels: |base| base.diffuse.clone(),
    format: TextureFormat::Rgba8UnormSrgb,
};

pub(crate) const NORMAL: TextureKind = TextureKind {
    is_wanted: |maps| maps.normal,
    texels: |base| base.normal.clone().unwrap_or_else(|| [128, 128, 255, 255].repeat(base.area())),
    format: TextureFormat::Rgba8Unorm,
};

pub(crate) const DEPTH: TextureKind = TextureKind {
    is_wanted: |maps| maps.depth,
    texels: |base| base.depth.clone().unwrap_or_else(|| vec![0; base.area()]),
    format: TextureFormat::R8Unorm,
};

pub(crate) const EMISSIVE: TextureKind = TextureKind {
    is_wanted: |maps| maps.emissive,
    texels: |base| [0, 0, 0, 255].repeat(base.area()),
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
    pub(crate) fn texel(&self) -> usize {
        self.format.block_copy_size(None).map_or(0, |size| size as usize)
    }

    /// The only place where textures of surfaces are made. `None` if the data has not the length that size and format need, or there
    /// is no texel: the renderer ends the app over such an image.
    pub(crate) fn image(&self, size: UVec2, data: Vec<u8>, sampler: &ImageSampler) -> Option<Image> {
        let length = (size.x as usize).checked_mul(size.y as usize)?.checked_mul(self.texel())?;
        let mut image = self.empty(size, sampler).filter(|_| data.len() == length)?;
        image.data = Some(data);
        Some(image)
    }

    /// The same without texels yet; the renderer makes room for them.
    pub(crate) fn empty(&self, size: UVec2, sampler: &ImageSampler) -> Option<Image> {
        let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
        let mut image = Image::new_uninit(extent, TextureDimension::D2, self.format, RenderAssetUsages::default());
        image.sampler = sampler.clone();
        (size.min_element() > 0).then_some(image)
    }
}

/// The texels of the uncracked textures that are wanted, in the order of [`KINDS`].
pub(crate) fn texels(maps: Maps, base: &BasePicture) -> [Option<Vec<u8>>; MAPS] {
    KINDS.each_ref().map(|kind| (kind.is_wanted)(maps).then(|| (kind.texels)(base)))
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
        let texel = kinds.next().map_or(0, TextureKind::texel);
        let texels = texels?;
        let staged = stager.and_then(|stager| stager.stage(&texels, size, texel, &[TexelRect::whole(size)]));
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
