//! [`CrackMaskSource`]: where a surface's masks come from.

use super::{
    CrackError,
    carrier::Shown,
    picture::{self, BasePicture, Space},
    plan::{Draft, PicturePlan},
};
use crate::{
    CrackPreset, Grid,
    pattern::{CrackMask, MaskError},
    raster::TexelRect,
};
use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};
use std::sync::{Arc, Weak};

/// Where cracks like to run, where they do not, and where they never go. See [`CrackMask`].
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
pub enum CrackMaskSource {
    /// As the preset has it: [`FromPicture`](Self::FromPicture) if its cracks follow lines
    /// ([`CrackPreset::follows_lines`], as those of brick do), else [`None`](Self::None).
    #[default]
    Auto,
    /// Everywhere alike.
    None,
    /// By the surface's own picture: cracks follow its lines (mortar, joints of tiles and planks, old cracks) and keep off
    /// what is less than half opaque. It is read once for each picture, beside the frames; the first hit waits for that.
    FromPicture,
    /// By images over the shown part of the surface's picture, of any size: black = not at all, white = wholly (lightness as
    /// it is stored, times alpha). The first hit waits until they are loaded; later changes of theirs have no effect.
    Images {
        /// Where cracks like to run.
        weak: Option<Handle<Image>>,
        /// What they avoid.
        strong: Option<Handle<Image>>,
        /// What they never enter: where the image is lighter than half.
        forbidden: Option<Handle<Image>>,
    },
}

impl CrackMaskSource {
    /// What it is on a surface with this preset; never [`Auto`](Self::Auto).
    pub(super) const fn with(&self, preset: &CrackPreset) -> &Self {
        match self {
            Self::Auto if preset.follows_lines => &Self::FromPicture,
            Self::Auto => &Self::None,
            own => own,
        }
    }

    /// Its images.
    pub(super) fn images(&self) -> impl Iterator<Item = &Handle<Image>> {
        let layers = match self {
            Self::Images { weak, strong, forbidden } => [weak, strong, forbidden].map(Option::as_ref),
            Self::Auto | Self::None | Self::FromPicture => [None; 3],
        };
        layers.into_iter().flatten()
    }
}

/// The masks of pictures. Made beside the frames: reading a picture takes longer than a frame may.
#[derive(Resource, Default)]
pub(super) struct PictureMasks {
    /// Those that a surface uses, for others with the same picture.
    made: Vec<(Key, Weak<CrackMask>)>,
    in_work: Vec<(Key, Task<Arc<CrackMask>>)>,
}

/// A part of a picture, at the size at which it is cracked.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Key {
    picture: AssetId<Image>,
    size: UVec2,
    rect: TexelRect,
}

impl Key {
    pub(super) fn new(picture: &Handle<Image>, plan: &PicturePlan) -> Self {
        Self { picture: picture.id(), size: plan.size, rect: plan.rect }
    }

    /// The mask of the picture.
    pub(super) fn make(self, base: &[u8]) -> Arc<CrackMask> {
        let part = part(base, self.size, self.rect);
        Arc::new(CrackMask::from_picture(self.rect.size(), &part).unwrap_or_default())
    }
}

impl PictureMasks {
    /// The mask of a picture, if it is made.
    pub(super) fn find(&self, key: Key) -> Option<Arc<CrackMask>> {
        self.made.iter().find(|(known, _)| *known == key).and_then(|(_, mask)| mask.upgrade())
    }

    pub(super) fn remember(&mut self, key: Key, mask: &Arc<CrackMask>) {
        self.made.retain(|(known, mask)| *known != key && mask.strong_count() > 0);
        self.in_work.retain(|(known, _)| *known != key);
        self.made.push((key, Arc::downgrade(mask)));
    }

    /// The picture is another one now.
    pub(super) fn forget(&mut self, picture: AssetId<Image>) {
        self.made.retain(|(key, _)| key.picture != picture);
        self.in_work.retain(|(key, _)| key.picture != picture);
    }

    fn get(&mut self, key: Key, base: &Arc<BasePicture>) -> Option<Arc<CrackMask>> {
        if let Some(mask) = self.find(key) {
            return Some(mask);
        }
        let mask = match self.in_work.iter().position(|(known, _)| *known == key) {
            Some(index) => {
                let mask = check_ready(&mut self.in_work[index].1)?;
                drop(self.in_work.swap_remove(index));
                mask
            }
            None => match AsyncComputeTaskPool::try_get() {
                Some(pool) => {
                    let base = base.clone();
                    self.in_work.push((key, pool.spawn(async move { key.make(&base.diffuse) })));
                    return None;
                }
                None => key.make(&base.diffuse),
            },
        };
        self.remember(key, &mask);
        Some(mask)
    }
}

/// The texels in `rect` of RGBA rows.
pub(super) fn part(rgba: &[u8], size: UVec2, rect: TexelRect) -> Vec<u8> {
    if rect == TexelRect::whole(size) {
        return rgba.to_vec();
    }
    let row = |y: u32| {
        let start = 4 * (y as usize * size.x as usize + rect.min.x as usize);
        &rgba[start..start + 4 * rect.size().x as usize]
    };
    (rect.min.y..rect.max.y).flat_map(row).copied().collect()
}

/// The mask from a source; `None` if it is not there yet.
pub(super) fn resolve(
    world: &mut World,
    source: &CrackMaskSource,
    shown: &Shown,
    draft: &Draft,
) -> Result<Option<Arc<CrackMask>>, CrackError> {
    match source {
        CrackMaskSource::Auto | CrackMaskSource::None => Ok(Some(Arc::default())),
        CrackMaskSource::FromPicture => {
            // Without a picture there is nothing to go by.
            let Some(picture) = &shown.diffuse else { return Ok(Some(Arc::default())) };
            let key = Key::new(picture, &draft.plan);
            Ok(world.resource_mut::<PictureMasks>().get(key, &draft.base))
        }
        CrackMaskSource::Images { weak, strong, forbidden } => {
            for image in source.images() {
                if !picture::is_loaded(world, image)? {
                    return Ok(None);
                }
            }
            let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
            let layer = |image: &Option<Handle<Image>>| {
                image.as_ref().and_then(|image| images.get(image)).map(layer).transpose()
            };
            let mask = CrackMask { weak: layer(weak)?, strong: layer(strong)?, forbidden: layer(forbidden)? };
            Ok(Some(Arc::new(mask)))
        }
    }
}

/// The values of an image as they are stored.
pub(super) fn layer(image: &Image) -> Result<Grid<f32>, CrackError> {
    let size = picture::readable_size(image)?;
    let space = if image.texture_descriptor.format.is_srgb() { Space::Srgb } else { Space::Linear };
    let too_large = |MaskError { width, height, .. }| CrackError::Size { width, height };
    CrackMask::layer(size, &picture::read(image, space, size)?).map_err(too_large)
}
