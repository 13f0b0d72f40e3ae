//! [`CrackTextures`]: a surface's own pictures.

use super::picture::BasePicture;
use bevy::{
    asset::RenderAssetUsages,
    image::ImageSampler,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};

/// The private textures of a cracked surface, for materials of your own. Written by the crate, gone after healing.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default)]
#[component(clone_behavior = Ignore)]
pub struct CrackTextures {
    /// The picture with its cracks, `Rgba8UnormSrgb`.
    pub diffuse: Option<Handle<Image>>,
    /// Tangent-space normals, +Y up, `Rgba8Unorm`.
    pub normal: Option<Handle<Image>>,
    /// Depth, `R8Unorm`, white = deep.
    pub depth: Option<Handle<Image>>,
}

impl CrackTextures {
    /// The textures there are.
    pub fn handles(&self) -> impl Iterator<Item = &Handle<Image>> {
        [&self.diffuse, &self.normal, &self.depth].into_iter().flatten()
    }
}

/// The only place where textures are made. `None` if the data has not the length that size and format need, or there
/// is no texel: the renderer ends the app over such an image.
fn texture(size: UVec2, data: Vec<u8>, format: TextureFormat, sampler: &ImageSampler) -> Option<Image> {
    let texel = format.block_copy_size(None)? as usize;
    let length = (size.x as usize).checked_mul(size.y as usize)?.checked_mul(texel)?;
    if length == 0 || data.len() != length {
        return None;
    }
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let mut image = Image::new(extent, TextureDimension::D2, data, format, RenderAssetUsages::default());
    image.sampler = sampler.clone();
    Some(image)
}

/// The diffuse texture of an uncracked surface.
pub(super) fn diffuse(base: &BasePicture, sampler: &ImageSampler) -> Option<Image> {
    texture(base.size, base.diffuse.clone(), TextureFormat::Rgba8UnormSrgb, sampler)
}

/// The normal map of an uncracked surface.
pub(super) fn normal(base: &BasePicture, sampler: &ImageSampler) -> Option<Image> {
    let n = base.size.x as usize * base.size.y as usize;
    let data = base.normal.clone().unwrap_or_else(|| [128, 128, 255, 255].repeat(n));
    texture(base.size, data, TextureFormat::Rgba8Unorm, sampler)
}

/// The depth map of an uncracked surface.
pub(super) fn depth(base: &BasePicture, sampler: &ImageSampler) -> Option<Image> {
    let n = base.size.x as usize * base.size.y as usize;
    let data = base.depth.clone().unwrap_or_else(|| vec![0; n]);
    texture(base.size, data, TextureFormat::R8Unorm, sampler)
}
