//! Masks of pictures.

use super::layout::Layout;
use super::picture::{self, BasePicture, Space};
use crate::pattern::{CrackMask, MaskError};
use crate::plugin::api::{CrackError, CrackMaskSource};
use crate::plugin::jobs::background::{BackgroundJob, PATIENCE, guarded_as};
use crate::plugin::jobs::copy::MAX_RESTARTS;
use crate::raster::TexelRect;
use crate::{CrackPreset, Grid};
use bevy::{platform::time::Instant, prelude::*, tasks::AsyncComputeTaskPool};
use std::{
    sync::{Arc, Weak},
    time::Duration,
};

/// What a mask is made from.
#[derive(Clone, Copy)]
pub(crate) enum MaskFrom<'a> {
    Nothing,
    Picture(PicturePart),
    /// The layers: weak, strong, forbidden.
    Images([Option<&'a Handle<Image>>; 3]),
}

/// What of a picture makes a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PicturePart {
    Lines,
    /// What is transparent is forbidden.
    LinesAndAlpha,
}

impl<'a> MaskFrom<'a> {
    /// What the mask of a surface with this preset is made from.
    pub(crate) fn new(source: &'a CrackMaskSource, preset: &CrackPreset) -> Self {
        match source {
            // What is transparent is the matter of `CrackSurface::alpha_mask`.
            CrackMaskSource::Auto if preset.follows_lines => Self::Picture(PicturePart::Lines),
            CrackMaskSource::Auto | CrackMaskSource::None => Self::Nothing,
            CrackMaskSource::FromPicture => Self::Picture(PicturePart::LinesAndAlpha),
            CrackMaskSource::Images { weak, strong, forbidden } => {
                Self::Images([weak, strong, forbidden].map(Option::as_ref))
            }
        }
    }
}

impl<'a> MaskFrom<'a> {
    /// Its images.
    pub(crate) fn images(self) -> impl Iterator<Item = &'a Handle<Image>> {
        let layers = match self {
            Self::Images(layers) => layers,
            Self::Nothing | Self::Picture(_) => [None; 3],
        };
        layers.into_iter().flatten()
    }
}

/// How long a mask is kept for surfaces that have asked for it and do not come for it.
const KEPT: Duration = Duration::from_secs(5);

/// The masks of pictures. Made in the background: reading a picture takes longer than a frame may.
#[derive(Resource, Default)]
pub(crate) struct PictureMasks {
    /// Those that a surface uses, for others with the same picture.
    made: Vec<(MaskKey, Weak<CrackMask>)>,
    in_work: Vec<InWork>,
}

/// A mask that is being made.
struct InWork {
    key: MaskKey,
    /// Its picture, which is not to be read twice meanwhile; `None` = it has changed, and nobody has asked since.
    task: Option<(Arc<BasePicture>, BackgroundJob<(MaskKey, Arc<BasePicture>), Result<Arc<CrackMask>, CrackError>>)>,
    since: Instant,
    asked: Instant,
    /// Up to [`MAX_RESTARTS`]; then the one that is being made has to do.
    restarts: u32,
    /// Whether the picture has changed since it was begun for the last time.
    is_outdated: bool,
}

/// A part of a picture, at the size at which it is cracked, and what of it makes a mask.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct MaskKey {
    pub(crate) picture: AssetId<Image>,
    pub(crate) size: UVec2,
    pub(crate) rect: TexelRect,
    pub(crate) part: PicturePart,
    pub(crate) layout: Option<Layout>,
    /// The id of the layout of the mesh.
    pub(crate) unfolding: Option<u64>,
}

impl MaskKey {
    /// The mask of the picture. A panic is an error.
    pub(crate) fn make(self, base: &[u8]) -> Result<Arc<CrackMask>, CrackError> {
        let make = || {
            let (size, texels) = (self.rect.size(), part(base, self.size, self.rect));
            let mask = match self.part {
                PicturePart::Lines => {
                    CrackMask::weak_from_picture(size, &texels).map(|weak| CrackMask { weak, ..CrackMask::default() })
                }
                PicturePart::LinesAndAlpha => CrackMask::from_picture(size, &texels),
            };
            Ok(Arc::new(mask.unwrap_or_default()))
        };
        guarded_as(|reason| CrackError::Textures { reason }, make)
    }
}

impl PictureMasks {
    /// The mask of a picture, if it is made.
    pub(crate) fn find(&self, key: MaskKey) -> Option<Arc<CrackMask>> {
        self.made.iter().find(|(known, _)| *known == key).and_then(|(_, mask)| mask.upgrade())
    }

    pub(crate) fn remember(&mut self, key: MaskKey, mask: &Arc<CrackMask>) {
        self.made.retain(|(known, mask)| *known != key && mask.strong_count() > 0);
        self.in_work.retain(|work| work.key != key);
        self.made.push((key, Arc::downgrade(mask)));
    }

    /// Drops what nobody has come for.
    pub(crate) fn trim(&mut self) {
        if !self.in_work.is_empty() {
            let now = Instant::now();
            self.in_work.retain(|work| now - work.asked < KEPT);
        }
    }

    /// The picture has changed.
    pub(crate) fn forget(&mut self, picture: AssetId<Image>) {
        self.made.retain(|(key, _)| key.picture != picture);
        for work in self.in_work.iter_mut().filter(|work| work.key.picture == picture) {
            if work.restarts < MAX_RESTARTS {
                work.task = None;
                work.restarts += 1;
            } else {
                work.is_outdated = true;
            }
        }
    }

    /// The mask of a picture; `None` if it is being made, which it is not if the frame `has_time`.
    pub(crate) fn get(
        &mut self,
        key: MaskKey,
        base: &Arc<BasePicture>,
        has_time: bool,
    ) -> Result<Option<Arc<CrackMask>>, CrackError> {
        if let Some(mask) = self.find(key) {
            return Ok(Some(mask));
        }
        let now = Instant::now();
        if has_time || AsyncComputeTaskPool::try_get().is_none() {
            let mask = key.make(&base.diffuse)?;
            self.remember(key, &mask);
            return Ok(Some(mask));
        }
        let index = self.in_work.iter().position(|work| work.key == key).unwrap_or_else(|| {
            self.in_work.push(InWork { key, task: None, since: now, asked: now, restarts: 0, is_outdated: false });
            self.in_work.len() - 1
        });
        let work = &mut self.in_work[index];
        work.asked = now;
        let begin = || (base.clone(), BackgroundJob::start((key, base.clone()), |(key, base)| key.make(&base.diffuse)));
        let (_, task) = work.task.get_or_insert_with(begin);
        let Some(mask) = task.take_if_done(now - work.since >= PATIENCE) else { return Ok(None) };
        let is_outdated = self.in_work.swap_remove(index).is_outdated;
        let mask = mask?;
        if !is_outdated {
            self.remember(key, &mask);
        }
        Ok(Some(mask))
    }
}

/// The texels in `rect` of RGBA rows, as far as they are there.
pub(crate) fn part(rgba: &[u8], size: UVec2, rect: TexelRect) -> Vec<u8> {
    if rect == TexelRect::whole(size) {
        return rgba.to_vec();
    }
    let rect = rect.intersect(TexelRect::whole(size));
    let row = |y: u32| {
        let start = 4 * (y as usize * size.x as usize + rect.min.x as usize);
        rgba.get(start..start + 4 * rect.size().x as usize).unwrap_or_default()
    };
    (rect.min.y..rect.max.y).flat_map(row).copied().collect()
}

/// The values of an image as they are stored.
pub(crate) fn layer(image: &Image) -> Result<Grid<f32>, CrackError> {
    let size = picture::readable_size(image)?;
    let space = if image.texture_descriptor.format.is_srgb() { Space::Srgb } else { Space::Linear };
    let too_large = |MaskError { width, height, .. }| CrackError::Size { width, height };
    CrackMask::layer(size, &picture::read(image, space, size)?).map_err(too_large)
}
