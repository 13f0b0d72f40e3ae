//! Copies of pictures for background tasks: the images of the engine stay with the main world, so they are
//! copied there, a little in each frame, into memory that a task has made ready.

use super::background::BackgroundJob;
use bevy::{prelude::*, tasks::AsyncComputeTaskPool};

/// Bytes that are copied without a look at the clock: by all bakes together no more in a frame.
pub(crate) const MAX_BYTES: usize = 1 << 19;

/// How often what changes while it is read is read again: a picture that changes in every frame would never be there.
pub(crate) const MAX_RESTARTS: u32 = 8;

/// Pictures of which some is copied.
pub(crate) struct PictureCopies {
    copies: Vec<PictureCopy>,
    /// Whether a task got the memory ready.
    pub(crate) has_task: bool,
    /// The memory for the copies, in order.
    memory: Option<BackgroundJob<Vec<usize>, Vec<Vec<u8>>>>,
}

struct PictureCopy {
    picture: Handle<Image>,
    image: Image,
    data: Vec<u8>,
    length: usize,
    restarts: u32,
}

/// How far it is.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum CopyProgress {
    More,
    Done,
    /// A picture has another shape now, or is gone.
    Changed,
}

impl PictureCopies {
    /// `None` if a picture is not there.
    pub(crate) fn new(pictures: Vec<Handle<Image>>, images: &Assets<Image>, has_threads: bool) -> Option<Self> {
        let copies: Option<Vec<PictureCopy>> =
            pictures.into_iter().map(|picture| PictureCopy::new(picture, images)).collect();
        let copies = copies?;
        let lengths: Vec<usize> = copies.iter().map(|copy| copy.length).collect();
        // What is copied at a stroke is not worth a task.
        let is_much = lengths.iter().sum::<usize>() > MAX_BYTES;
        let has_task = has_threads && is_much && AsyncComputeTaskPool::try_get().is_some();
        // Written once: the first write to memory page-faults.
        let get_ready = |lengths: Vec<usize>| lengths.into_iter().map(|length| vec![1; length]).collect();
        Some(Self { copies, has_task, memory: has_task.then(|| BackgroundJob::start(lengths, get_ready)) })
    }

    /// Does without the task that gets memory ready, if no thread has begun it.
    pub(crate) fn wait_no_more(&mut self) {
        if self.memory.take_if(|task| task.take_back().is_some()).is_some() {
            self.has_task = false;
        }
    }

    /// A picture has changed: half of the copy may be of before. `false` if it stays so: it has begun again often enough.
    pub(crate) fn forget(&mut self, picture: AssetId<Image>) -> bool {
        let begun = |copy: &&mut PictureCopy| copy.picture.id() == picture && !copy.data.is_empty();
        let mut begins_again = true;
        for copy in self.copies.iter_mut().filter(begun) {
            if copy.restarts >= MAX_RESTARTS {
                begins_again = false;
                continue;
            }
            copy.data.clear();
            copy.restarts += 1;
        }
        begins_again
    }

    /// Copies what there is to copy, no more bytes than are `left` of this frame. What takes several frames is done in the one after the
    /// last copy: until then a picture may turn out to have changed meanwhile.
    pub(crate) fn step(&mut self, images: &Assets<Image>, left: &mut usize) -> CopyProgress {
        if let Some(task) = &mut self.memory {
            let Some(memory) = task.take_if_done(false) else { return CopyProgress::More };
            self.memory = None;
            for (copy, mut memory) in self.copies.iter_mut().zip(memory) {
                memory.clear();
                copy.data = memory;
            }
        }
        let copied = |copies: &[PictureCopy]| copies.iter().map(|copy| copy.data.len()).sum::<usize>();
        let before = copied(&self.copies);
        for copy in &mut self.copies {
            if !copy.step(images, left) {
                return CopyProgress::Changed;
            }
        }
        if self.is_whole() && (before == 0 || before == copied(&self.copies)) {
            CopyProgress::Done
        } else {
            CopyProgress::More
        }
    }

    /// Whether all is copied.
    pub(crate) fn is_whole(&self) -> bool {
        self.copies.iter().all(|copy| copy.data.len() == copy.length)
    }

    /// The pictures, wholly copied.
    pub(crate) fn finish(self) -> Vec<Image> {
        self.copies.into_iter().map(|PictureCopy { image, data, .. }| Image { data: Some(data), ..image }).collect()
    }
}

impl PictureCopy {
    fn new(picture: Handle<Image>, images: &Assets<Image>) -> Option<Self> {
        let image = images.get(&picture)?;
        let Image { data, texture_descriptor, asset_usage, .. } = image;
        let (length, format) = (data.as_ref()?.len(), texture_descriptor.format);
        let mut copy = Image::new_uninit(texture_descriptor.size, texture_descriptor.dimension, format, *asset_usage);
        copy.texture_descriptor.mip_level_count = texture_descriptor.mip_level_count;
        Some(Self { picture, image: copy, data: Vec::new(), length, restarts: 0 })
    }

    /// False if it cannot be copied as it was to be.
    fn step(&mut self, images: &Assets<Image>, left: &mut usize) -> bool {
        let Some(image) = images.get(&self.picture) else { return false };
        let (now, then) = (&image.texture_descriptor, &self.image.texture_descriptor);
        let Some(data) = image.data.as_ref().filter(|data| data.len() == self.length) else { return false };
        if (now.size, now.format, now.dimension) != (then.size, then.format, then.dimension) {
            return false;
        }
        self.data.reserve_exact(self.length - self.data.len());
        let from = self.data.len();
        let to = self.length.min(from + *left);
        self.data.extend_from_slice(&data[from..to]);
        *left -= to - from;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::{
        asset::RenderAssetUsages,
        render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    };

    fn picture(side: u32) -> Image {
        let extent = Extent3d { width: side, height: side, depth_or_array_layers: 1 };
        let data = (0..side * side * 4).map(|i| (i * 7 % 251) as u8).collect();
        Image::new(extent, TextureDimension::D2, data, TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::default())
    }

    #[test]
    fn no_frame_copies_more_than_is_left() {
        let mut images = Assets::<Image>::default();
        let pictures = [600, 3, 400].map(|side| images.add(picture(side)));
        let mut reading = PictureCopies::new(pictures.to_vec(), &images, false).expect("they are there");
        let copied = |reading: &PictureCopies| reading.copies.iter().map(|copy| copy.data.len()).sum::<usize>();
        let mut frames = 0;
        let all = 4 * (600 * 600 + 9 + 400 * 400usize);
        loop {
            let (before, mut left) = (copied(&reading), MAX_BYTES);
            let read = reading.step(&images, &mut left);
            assert!(copied(&reading) - before == MAX_BYTES - left, "what is copied is counted");
            frames += 1;
            if read == CopyProgress::Done {
                break;
            }
            assert!(read == CopyProgress::More && (left == 0 || copied(&reading) == all));
        }
        assert_eq!(frames, all.div_ceil(MAX_BYTES) + 1, "and one to hear of changes");
        for (copy, picture) in reading.finish().iter().zip(&pictures) {
            assert!(images.get(picture).is_some_and(|image| image.data == copy.data), "a copy equals its picture");
        }
    }

    #[test]
    fn a_picture_that_changes_meanwhile_is_copied_anew() {
        let mut images = Assets::<Image>::default();
        let [changing, other] = [600, 500].map(|side| images.add(picture(side)));
        let mut reading = PictureCopies::new(vec![changing.clone(), other], &images, false).expect("it is there");
        let mut change = |reading: &mut PictureCopies, value| {
            let image = images.get_mut(&changing).expect("it is there").into_inner();
            image.data.iter_mut().flatten().for_each(|byte| *byte = value);
            reading.forget(changing.id());
            reading.step(&images, &mut 1000)
        };
        assert_eq!(change(&mut reading, 5), CopyProgress::More);
        assert_eq!(change(&mut reading, 6), CopyProgress::More);
        assert_eq!(change(&mut reading, 7), CopyProgress::More);
        assert_eq!(reading.copies[0].data, [7; 1000], "no half of what was before");
        // One that never stands still is read as it comes.
        let frames = (8..=255).take_while(|value| change(&mut reading, *value) == CopyProgress::More).count();
        assert_eq!(frames, 255 - 7);
        assert!(reading.copies[0].data.len() > 100_000);
        assert_eq!(reading.step(&images, &mut (1 << 30)), CopyProgress::More);
        assert_eq!(reading.step(&images, &mut (1 << 30)), CopyProgress::Done);
        // What is copied at a stroke is of one frame.
        let small = images.add(picture(9));
        let mut reading = PictureCopies::new(vec![small], &images, false).expect("it is there");
        assert_eq!(reading.step(&images, &mut 1000), CopyProgress::Done);
    }

    #[test]
    fn a_picture_that_changes_its_shape_is_told() {
        let mut images = Assets::<Image>::default();
        let handle = images.add(picture(600));
        let mut reading = PictureCopies::new(vec![handle.clone()], &images, false).expect("it is there");
        assert_eq!(reading.step(&images, &mut 1000), CopyProgress::More);
        images.insert(&handle, picture(599)).expect("the handle is good");
        assert_eq!(reading.step(&images, &mut 1000), CopyProgress::Changed);
        images.remove(&handle);
        assert_eq!(reading.step(&images, &mut 1000), CopyProgress::Changed);
        assert!(PictureCopies::new(vec![handle], &images, false).is_none());
    }
}
