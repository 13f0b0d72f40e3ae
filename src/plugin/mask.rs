//! [`CrackMaskSource`]: where a surface's masks come from.

use super::{
    CrackBudget, CrackError,
    beside::{Beside, PATIENCE},
    carrier::Shown,
    layout::Layout,
    picture::{self, BasePicture, Space},
    plan::{Draft, PicturePlan},
    read::MAX_RESTARTS,
};
use crate::{
    CrackPreset, Grid,
    pattern::{CrackMask, MaskError},
    raster::TexelRect,
};
use bevy::{
    platform::time::Instant, prelude::*, reflect::serde::ReflectSerializeWithRegistry, tasks::AsyncComputeTaskPool,
};
use std::{
    sync::{Arc, Weak},
    time::Duration,
};

/// Where cracks like to run, where they do not, and where they never go. See [`CrackMask`].
///
/// Cracks that [divide](crate::growth::Venation::Dividing) what there is (tempered glass, plaster, clay, mud, glaze) hardly mind where they like to run.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default, SerializeWithRegistry)]
pub enum CrackMaskSource {
    /// As the preset has it: cracks of brick, and of every preset that [follows lines](CrackPreset::follows_lines), follow the lines of the
    /// surface's own picture, which are read as those of [`FromPicture`](Self::FromPicture); else [`None`](Self::None).
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

/// What a mask is made from.
#[derive(Clone, Copy)]
pub(super) enum MaskFrom<'a> {
    Nothing,
    Picture(PicturePart),
    /// The layers: weak, strong, forbidden.
    Images([Option<&'a Handle<Image>>; 3]),
}

/// What of a picture makes a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PicturePart {
    Lines,
    /// What is transparent is forbidden.
    LinesAndAlpha,
}

impl CrackMaskSource {
    /// What the mask of a surface with this preset is made from.
    pub(super) fn with(&self, preset: &CrackPreset) -> MaskFrom<'_> {
        match self {
            // What is transparent is the matter of `CrackSurface::alpha_mask`.
            Self::Auto if preset.follows_lines => MaskFrom::Picture(PicturePart::Lines),
            Self::Auto | Self::None => MaskFrom::Nothing,
            Self::FromPicture => MaskFrom::Picture(PicturePart::LinesAndAlpha),
            Self::Images { weak, strong, forbidden } => MaskFrom::Images([weak, strong, forbidden].map(Option::as_ref)),
        }
    }
}

impl<'a> MaskFrom<'a> {
    /// Its images.
    pub(super) fn images(self) -> impl Iterator<Item = &'a Handle<Image>> {
        let layers = match self {
            Self::Images(layers) => layers,
            Self::Nothing | Self::Picture(_) => [None; 3],
        };
        layers.into_iter().flatten()
    }
}

/// So long a mask is kept for those who have asked for it and do not come for it.
const KEPT: Duration = Duration::from_secs(5);

/// The masks of pictures. Made beside the frames: reading a picture takes longer than a frame may.
#[derive(Resource, Default)]
pub(super) struct PictureMasks {
    /// Those that a surface uses, for others with the same picture.
    made: Vec<(Key, Weak<CrackMask>)>,
    in_work: Vec<InWork>,
}

/// A mask that is being made.
struct InWork {
    key: Key,
    /// Its picture, which is not to be read twice meanwhile; `None` = it has changed, and nobody has asked since.
    task: Option<(Arc<BasePicture>, Beside<(Key, Arc<BasePicture>), Arc<CrackMask>>)>,
    since: Instant,
    asked: Instant,
    /// Up to [`MAX_RESTARTS`]; then the one that is being made has to do.
    restarts: u32,
    /// Whether the picture has changed since it was begun for the last time.
    is_outdated: bool,
}

/// A part of a picture, at the size at which it is cracked, and what of it makes a mask.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Key {
    picture: AssetId<Image>,
    size: UVec2,
    rect: TexelRect,
    part: PicturePart,
    layout: Option<Layout>,
}

impl Key {
    pub(super) fn new(picture: &Handle<Image>, plan: &PicturePlan, part: PicturePart) -> Self {
        Self { picture: picture.id(), size: plan.size, rect: plan.rect, part, layout: plan.layout.as_deref().copied() }
    }

    /// The mask of the picture.
    pub(super) fn make(self, base: &[u8]) -> Arc<CrackMask> {
        let (size, texels) = (self.rect.size(), part(base, self.size, self.rect));
        let mask = match self.part {
            PicturePart::Lines => {
                CrackMask::weak_from_picture(size, &texels).map(|weak| CrackMask { weak, ..CrackMask::default() })
            }
            PicturePart::LinesAndAlpha => CrackMask::from_picture(size, &texels),
        };
        Arc::new(mask.unwrap_or_default())
    }
}

impl PictureMasks {
    /// The mask of a picture, if it is made.
    pub(super) fn find(&self, key: Key) -> Option<Arc<CrackMask>> {
        self.made.iter().find(|(known, _)| *known == key).and_then(|(_, mask)| mask.upgrade())
    }

    pub(super) fn remember(&mut self, key: Key, mask: &Arc<CrackMask>) {
        self.made.retain(|(known, mask)| *known != key && mask.strong_count() > 0);
        self.in_work.retain(|work| work.key != key);
        self.made.push((key, Arc::downgrade(mask)));
    }

    /// The picture is another one now.
    pub(super) fn forget(&mut self, picture: AssetId<Image>) {
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
    fn get(&mut self, key: Key, base: &Arc<BasePicture>, has_time: bool) -> Option<Arc<CrackMask>> {
        if let Some(mask) = self.find(key) {
            return Some(mask);
        }
        let now = Instant::now();
        self.in_work.retain(|work| work.key == key || now - work.asked < KEPT);
        if has_time || AsyncComputeTaskPool::try_get().is_none() {
            let mask = key.make(&base.diffuse);
            self.remember(key, &mask);
            return Some(mask);
        }
        let index = self.in_work.iter().position(|work| work.key == key).unwrap_or_else(|| {
            self.in_work.push(InWork { key, task: None, since: now, asked: now, restarts: 0, is_outdated: false });
            self.in_work.len() - 1
        });
        let work = &mut self.in_work[index];
        work.asked = now;
        let begin = || (base.clone(), Beside::start((key, base.clone()), |(key, base)| key.make(&base.diffuse)));
        let (_, task) = work.task.get_or_insert_with(begin);
        let mask = task.take_if_done(now - work.since >= PATIENCE)?;
        if self.in_work.swap_remove(index).is_outdated {
            return Some(mask);
        }
        self.remember(key, &mask);
        Some(mask)
    }
}

/// The texels in `rect` of RGBA rows, as far as they are there.
pub(super) fn part(rgba: &[u8], size: UVec2, rect: TexelRect) -> Vec<u8> {
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

/// The mask of a surface; `None` if it is not there yet.
pub(super) fn resolve(
    world: &mut World,
    from: MaskFrom<'_>,
    shown: &Shown,
    draft: &Draft,
) -> Result<Option<Arc<CrackMask>>, CrackError> {
    for image in from.images() {
        if !picture::is_loaded(world, image)? {
            return Ok(None);
        }
    }
    match (from, &shown.diffuse) {
        (MaskFrom::Picture(part), Some(picture)) => {
            let has_time = world.resource::<CrackBudget>().is_boundless();
            let key = Key::new(picture, &draft.plan, part);
            Ok(world.resource_mut::<PictureMasks>().get(key, &draft.base, has_time))
        }
        // Without a picture there is nothing to go by.
        (MaskFrom::Nothing | MaskFrom::Picture(_), _) => Ok(Some(Arc::default())),
        (MaskFrom::Images(layers), _) => {
            let images = world.get_resource::<Assets<Image>>().ok_or(CrackError::NoImages)?;
            let layer =
                |image: Option<&Handle<Image>>| image.and_then(|image| images.get(image)).map(layer).transpose();
            let [weak, strong, forbidden] = layers.map(layer);
            Ok(Some(Arc::new(CrackMask { weak: weak?, strong: strong?, forbidden: forbidden? })))
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
