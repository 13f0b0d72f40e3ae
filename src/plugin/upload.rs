//! Upload of rectangles into GPU textures that exist. Only this file knows the render world.
//!
//! The texels on the CPU (`Image::data`) are the truth. Painting changes them without an asset event, notes the
//! rectangle here and packs its texels, while the cache still has them, the way the GPU wants them; the extraction, which
//! sees both worlds, puts them where the GPU reads them. The commands to copy them into the textures are made beside the
//! renderer's preparations. Whatever else makes the renderer prepare an image again uploads all of `data`,
//! cracks included.

mod pack;

pub(super) use pack::Packer;

use super::beside::Beside;
use crate::raster::TexelRect;
use bevy::{
    platform::collections::HashMap,
    prelude::*,
    render::{
        ExtractSchedule, GpuResourceAppExt, MainWorld, Render, RenderApp, RenderSystems,
        render_asset::{RenderAssetBytesPerFrameLimiter, RenderAssets, extract_render_asset_bytes_per_frame},
        render_resource::{
            Buffer, BufferDescriptor, BufferUsages, CommandEncoder, CommandEncoderDescriptor, Extent3d, MapMode,
            Origin3d, TexelCopyBufferInfo, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureAspect,
        },
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};
use core::ops::Range;
use pack::{Changed, Layout, Memory, PER_PACKER, Place, ROW_ALIGNMENT, Source, Write};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// What went to the GPU in the last frame that was rendered.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Resource, Default)]
pub struct CrackUploadStats {
    /// Bytes of texels.
    pub bytes: u64,
    /// Rectangles.
    pub rects: u32,
}

/// Above this many rectangles that nobody fetches, or that were fetched and wait, the one around them all is uploaded of each image.
const MAX_UNFETCHED: usize = 1024;
const MAX_WAITING: usize = 1 << 16;

/// The least size of a buffer, bytes.
const LEAST_BUFFER: u64 = 1 << 18;

/// More memory than this is not kept for the next frame, bytes.
const MAX_KEPT: u64 = 16 << 20;

/// Up to this many rectangles are written one by one, more go through one buffer.
const FEW: usize = 4;

/// No more than about this many bytes go up in a frame, so that no buffer is larger than a device allows; the rest waits.
const MAX_STAGED: usize = 64 << 20;

/// Rectangles to upload.
#[derive(Resource, Default)]
pub(super) struct Uploads {
    /// Whether there is a renderer that fetches them.
    is_wanted: bool,
    rects: Vec<Changed>,
    packers: Vec<Packer>,
    /// Where the texels of `rects` are packed that are: from the renderer, which is done with it.
    packed: Option<Packed>,
    /// Number of rectangles up to which they are not thinned out again.
    limit: usize,
    /// Whether the renderer has fetched them since they were last looked at.
    is_fetched: bool,
    /// Whether whole textures are on their way.
    has_whole: bool,
    /// Pictures, or parts of them, that come before the rectangles.
    staged: Vec<(AssetId<Image>, Staged)>,
}

/// Brings pictures to where the GPU can read them, on any thread, and keeps that memory for the next ones.
#[derive(Clone)]
pub(super) struct Stager {
    device: RenderDevice,
    buffers: Buffers,
}

/// Parts of a picture where the GPU can read them.
pub(super) struct Staged {
    device: RenderDevice,
    buffer: Buffer,
    /// Where it is to go then.
    home: Weak<Mutex<Vec<Buffer>>>,
    /// Each with the place of its first row.
    parts: Vec<(TexelRect, usize)>,
}

/// From row to row of a staged part, bytes.
fn pitch(rect: TexelRect, texel: usize) -> usize {
    (rect.size().x as usize * texel).next_multiple_of(ROW_ALIGNMENT)
}

impl Stager {
    /// Whether the GPU is still the one behind this device.
    pub(super) fn is_of(&self, device: &RenderDevice) -> bool {
        self.device.wgpu_device() == device.wgpu_device()
    }

    /// Parts of a picture of `size` texels of so many bytes; `None` if there are none, they are not in the picture, or the device has
    /// no buffer so large.
    pub(super) fn stage(&self, texels: &[u8], size: UVec2, texel: usize, rects: &[TexelRect]) -> Option<Staged> {
        let stride = size.x as usize * texel;
        let whole = TexelRect::whole(size);
        if texels.len() != stride * size.y as usize || rects.iter().any(|rect| rect.intersect(whole) != *rect) {
            return None;
        }
        let mut end = 0;
        let place = |rect: &TexelRect| {
            let start = end;
            end += pitch(*rect, texel) * rect.size().y as usize;
            (*rect, start)
        };
        let parts: Vec<_> = rects.iter().map(place).collect();
        let size = end as u64;
        if size == 0 || size.next_power_of_two() > self.device.limits().max_buffer_size {
            return None;
        }
        let buffer = self.buffers.take(size, &self.device);
        let mut memory = buffer.slice(..).get_mapped_range_mut();
        for &(rect, start) in &parts {
            let (pitch, row) = (pitch(rect, texel), rect.size().x as usize * texel);
            let rows = texels.chunks_exact(stride).skip(rect.min.y as usize).take(rect.size().y as usize);
            for (y, texels) in rows.enumerate() {
                let (to, from) = (start + y * pitch, rect.min.x as usize * texel);
                memory.slice(to..to + row).copy_from_slice(&texels[from..from + row]);
            }
        }
        drop(memory);
        buffer.unmap();
        Some(Staged { device: self.device.clone(), buffer, home: self.buffers.home(), parts })
    }
}

impl Uploads {
    /// Notes that a surface shows a texture from this frame on that the GPU does not have yet. Were it to wait for its turn under
    /// [`RenderAssetBytesPerFrame`](bevy::render::render_asset::RenderAssetBytesPerFrame), the surface would vanish
    /// meanwhile: the limit does not hold in this frame.
    pub(super) fn expect_whole(&mut self) {
        self.has_whole = self.is_wanted;
    }

    /// Notes that texels of an image have changed.
    pub(super) fn push(&mut self, image: AssetId<Image>, rect: TexelRect) {
        if self.is_wanted && !rect.is_empty() {
            self.rects.push(Changed { image, rect, place: None });
        }
    }

    /// Lends some packers to `paint`, and takes what they have packed, one after the other. What they have no room for is packed when
    /// the renderer fetches it.
    pub(super) fn pack(&mut self, count: usize, paint: impl FnOnce(&mut [Packer])) {
        let memory = self.packed.as_ref().map(|packed| packed.memory.clone());
        self.lend(count, memory.as_ref());
        paint(&mut self.packers[..count]);
        self.packers.iter_mut().for_each(|packer| self.rects.append(&mut packer.rects));
    }

    fn lend(&mut self, count: usize, memory: Option<&Arc<Memory>>) {
        let is_wanted = self.is_wanted;
        let known = self.packers.len().max(count);
        self.packers.resize_with(known, || Packer::new(is_wanted));
        self.packers[..count].iter_mut().for_each(|packer| packer.lend(memory));
    }

    /// Takes what is packed, so that nobody writes to it any more.
    fn close(&mut self) -> Option<Packed> {
        self.packers.iter_mut().for_each(Packer::close);
        self.packed.take()
    }

    /// What brings whole pictures to the renderer, if there is one.
    pub(super) fn stager(&self, device: Option<&RenderDevice>) -> Option<Stager> {
        // In a browser the device stays on its thread.
        let device = device.filter(|_| self.is_wanted && !cfg!(target_arch = "wasm32"))?;
        Some(Stager { device: device.clone(), buffers: Buffers::default() })
    }

    /// Notes that all of an image has changed to what is staged, if it is.
    pub(super) fn push_whole(&mut self, image: AssetId<Image>, size: UVec2, staged: Option<Staged>) {
        self.staged.retain(|(other, _)| *other != image);
        self.push_staged(image, size, &[TexelRect::whole(size)], staged);
    }

    /// The same of parts of an image.
    pub(super) fn push_staged(
        &mut self,
        image: AssetId<Image>,
        size: UVec2,
        rects: &[TexelRect],
        staged: Option<Staged>,
    ) {
        // What is packed is older, and would come after it.
        self.rects.iter_mut().filter(|changed| changed.image == image).for_each(|changed| changed.place = None);
        match staged {
            // Nobody fetches them: no more are kept.
            Some(_) if self.is_staged(image) => self.push_whole(image, size, None),
            Some(staged) if self.is_wanted => self.staged.push((image, staged)),
            _ => rects.iter().for_each(|rect| self.push(image, *rect)),
        }
    }

    /// Whether all of an image waits for its upload.
    pub(super) fn is_staged(&self, image: AssetId<Image>) -> bool {
        self.staged.iter().any(|(other, _)| *other == image)
    }

    /// Replaces the rectangles of each image by the one around them.
    fn thin_out(&mut self) {
        let mut places = HashMap::<AssetId<Image>, usize>::default();
        let mut thin = Vec::<Changed>::new();
        for Changed { image, rect, .. } in self.rects.drain(..) {
            match places.get(&image) {
                Some(place) => thin[*place].rect = thin[*place].rect.union(rect),
                None => {
                    places.insert(image, thin.len());
                    thin.push(Changed { image, rect, place: None });
                }
            }
        }
        self.rects = thin;
        if let Some(packed) = self.close() {
            self.packed = Some(packed.anew());
        }
    }
}

/// A buffer in which texels are packed.
struct Packed {
    buffer: Buffer,
    /// Where it is to go then.
    home: Weak<Mutex<Vec<Buffer>>>,
    memory: Arc<Memory>,
}

impl Packed {
    /// A buffer of so many bytes.
    fn open(size: u64, buffers: &Buffers, device: &RenderDevice) -> Self {
        Self::new(buffers.take(size, device), buffers.home())
    }

    fn new(buffer: Buffer, home: Weak<Mutex<Vec<Buffer>>>) -> Self {
        let mapped = buffer.clone();
        let open = move |range: Range<usize>| writer(&mapped, range);
        Self { memory: Arc::new(Memory::new(buffer.size() as usize, Box::new(open))), buffer, home }
    }

    /// The same memory with nothing in it.
    fn anew(self) -> Self {
        Self::new(self.buffer, self.home)
    }

    /// Whether it is of the device that is there, and not of one that was lost.
    fn is_of(&self, buffers: &Buffers) -> bool {
        Weak::ptr_eq(&self.home, &buffers.home())
    }

    /// What the GPU can read now.
    fn close(self) -> Buffer {
        self.buffer.unmap();
        self.buffer
    }
}

/// Writes to a part of a buffer that is mapped. The buffer cannot be unmapped as long as it lives.
fn writer(buffer: &Buffer, range: Range<usize>) -> Write {
    let mut view = buffer.slice(range.start as u64..range.end as u64).get_mapped_range_mut();
    Box::new(move |place, source| source.rows(place, |to, row| view.slice(to..to + row.len()).copy_from_slice(row)))
}

/// Keeps the list short when the renderer does not fetch it (a minimised window).
pub(super) fn drop_unwanted(mut uploads: ResMut<Uploads>) {
    let most = if core::mem::take(&mut uploads.is_fetched) { MAX_WAITING } else { MAX_UNFETCHED };
    if uploads.rects.len() > uploads.limit.max(most) {
        uploads.thin_out();
        uploads.limit = 2 * uploads.rects.len();
    }
}

/// Lets the render world fetch rectangles, if there is one.
pub(super) fn connect(app: &mut App) {
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
    render_app
        .init_resource::<Staging>()
        // Again whenever the renderer gets another device.
        .init_gpu_resource::<Staging>()
        .add_systems(ExtractSchedule, upload_rects.after(extract_render_asset_bytes_per_frame))
        .add_systems(Render, finish_sending.after(RenderSystems::Prepare).before(RenderSystems::Render));
    app.world_mut().resource_mut::<Uploads>().is_wanted = true;
}

/// A rectangle that fits, with the place of its rows in the staging buffer.
struct Copy {
    image: AssetId<Image>,
    texture: Texture,
    rect: TexelRect,
    texel: usize,
    /// Where it is packed, if it is: in which of the buffers, and where there.
    place: Option<(usize, Place)>,
}

impl Copy {
    /// Bytes of a row.
    fn row(&self) -> usize {
        self.rect.size().x as usize * self.texel
    }

    /// Bytes that it takes where it is packed, about.
    fn bytes(&self) -> usize {
        self.row().next_multiple_of(ROW_ALIGNMENT) * self.rect.size().y as usize
    }

    /// Its texels, if the image is there.
    fn source<'a>(&self, images: &'a Assets<Image>) -> Option<Source<'a>> {
        let image = images.get(self.image)?;
        Some(Source::new(image.data.as_ref()?, image.width() as usize, self.texel, self.rect))
    }
}

/// Memory that is kept from frame to frame.
#[derive(Resource, Default)]
struct Staging {
    rects: Vec<Changed>,
    copies: Vec<Copy>,
    buffers: Buffers,
    /// Gives back the memory of its list.
    sending: Option<Beside<Sending, Vec<Copy>>>,
}

impl Staging {
    /// Waits for what is being sent.
    fn finish(&mut self) {
        if let Some(copies) = self.sending.take().and_then(Beside::finish) {
            self.copies = copies;
        }
    }
}

/// Copies to be made from buffers.
struct Sending {
    device: RenderDevice,
    queue: RenderQueue,
    /// Where the buffers are to go then.
    home: Weak<Mutex<Vec<Buffer>>>,
    buffers: Vec<Buffer>,
    copies: Vec<Copy>,
}

impl Sending {
    /// All in one submission: a write of its own for each costs more than its texels.
    fn send(self) -> Vec<Copy> {
        let Self { device, queue, home, buffers, mut copies } = self;
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor { label: Some("crack_texels") });
        for copy in copies.drain(..) {
            if let Some((buffer, place)) = copy.place
                && let Some(buffer) = buffers.get(buffer)
            {
                copy_one(&mut encoder, &copy, place, buffer);
            }
        }
        queue.submit([encoder.finish()]);
        for buffer in buffers.into_iter().filter(|buffer| buffer.size() <= MAX_KEPT) {
            Buffers::give_back(home.clone(), buffer, &device);
        }
        copies
    }
}

/// Buffers that the GPU has read, ready to be written again: new ones cost their memory's page faults.
#[derive(Clone, Default)]
struct Buffers(Arc<Mutex<Vec<Buffer>>>);

impl Buffers {
    fn home(&self) -> Weak<Mutex<Vec<Buffer>>> {
        Arc::downgrade(&self.0)
    }

    /// A buffer that is mapped.
    fn take(&self, size: u64, device: &RenderDevice) -> Buffer {
        let mut ready = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // One that is too small goes.
        ready.pop().filter(|buffer| buffer.size() >= size).unwrap_or_else(|| {
            device.create_buffer(&BufferDescriptor {
                label: Some("crack_texels"),
                size: size.next_power_of_two().max(LEAST_BUFFER),
                usage: BufferUsages::MAP_WRITE | BufferUsages::COPY_SRC,
                mapped_at_creation: true,
            })
        })
    }

    /// Keeps a buffer that was submitted for when the GPU has read it, if it is wanted then.
    fn give_back(home: Weak<Mutex<Vec<Buffer>>>, buffer: Buffer, device: &RenderDevice) {
        if home.strong_count() == 0 {
            return;
        }
        let kept = buffer.clone();
        device.map_buffer(&buffer.slice(..), MapMode::Write, move |mapped| {
            if mapped.is_ok()
                && let Some(ready) = home.upgrade()
            {
                ready.lock().unwrap_or_else(PoisonError::into_inner).push(kept);
            }
        });
    }
}

fn upload_rects(
    mut main: ResMut<MainWorld>,
    mut staging: ResMut<Staging>,
    gpu_images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut limiter: ResMut<RenderAssetBytesPerFrameLimiter>,
) {
    if core::mem::take(&mut main.resource_mut::<Uploads>().has_whole) {
        limiter.max_bytes = None;
    }
    // Only if the renderer has skipped a frame.
    staging.finish();
    let mut stats = CrackUploadStats::default();
    let mut uploads = main.resource_mut::<Uploads>();
    let mut whole = core::mem::take(&mut uploads.staged);
    // What a device that was lost was to bring there.
    for (image, lost) in whole.extract_if(.., |(_, staged)| staged.device.wgpu_device() != device.wgpu_device()) {
        lost.parts.iter().for_each(|(rect, _)| uploads.push(image, *rect));
    }
    if !whole.is_empty()
        && let Some(images) = main.get_resource::<Assets<Image>>()
    {
        copy_whole(&mut whole, images, &gpu_images, &device, &queue, &mut stats);
        main.resource_mut::<Uploads>().staged = whole;
    }
    let Staging { rects, copies, buffers, sending } = &mut *staging;
    let mut uploads = main.resource_mut::<Uploads>();
    uploads.is_fetched = true;
    if !uploads.rects.is_empty() {
        core::mem::swap(rects, &mut uploads.rects);
        let room = (uploads.packers.len() * PER_PACKER) as u64;
        let mut packed = uploads.close().filter(|packed| packed.is_of(buffers));
        let has_packed = packed.is_some();
        let mut bytes = 0;
        if let Some(images) = main.get_resource::<Assets<Image>>() {
            // What is not on the GPU yet stays in the list.
            rects.retain(|Changed { image, rect, place }| match plan(*image, *rect, images, &gpu_images) {
                Plan::Copy(copy) if bytes > 0 && bytes + copy.bytes() > MAX_STAGED => true,
                Plan::Copy(copy) => {
                    bytes += copy.bytes();
                    stats.rects += 1;
                    stats.bytes += copy.rect.area() * copy.texel as u64;
                    let place = place.filter(|place| has_packed && copy.rect == *rect && copy.row() == place.row);
                    copies.push(Copy { place: place.map(|place| (0, place)), ..copy });
                    false
                }
                Plan::Wait => true,
                Plan::Drop => false,
            });
            if copies.len() <= FEW {
                copies.drain(..).for_each(|copy| write(&copy, images, &queue));
                packed = packed.map(Packed::anew);
            } else {
                let home = buffers.home();
                let filled = pack_rest(copies, images, packed.take(), buffers, &device);
                packed = Some(Packed::open(room.min(MAX_KEPT), buffers, &device));
                let (device, queue) = (device.clone(), queue.clone());
                let work = Sending { device, queue, home, buffers: filled, copies: core::mem::take(copies) };
                *sending = Some(Beside::start(work, Sending::send));
            }
        }
        let mut uploads = main.resource_mut::<Uploads>();
        uploads.packed = packed;
        rects.iter_mut().for_each(|changed| changed.place = None);
        uploads.rects.append(rects);
    }
    *main.resource_mut::<CrackUploadStats>() = stats;
}

/// Copies the pictures that are staged, and takes them off the list.
fn copy_whole(
    staged: &mut Vec<(AssetId<Image>, Staged)>,
    images: &Assets<Image>,
    gpu_images: &RenderAssets<GpuImage>,
    device: &RenderDevice,
    queue: &RenderQueue,
    stats: &mut CrackUploadStats,
) {
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor { label: Some("crack_pictures") });
    let mut done = Vec::new();
    *staged = core::mem::take(staged)
        .into_iter()
        .filter_map(|(id, staged)| {
            let mut waits = false;
            for &(rect, offset) in &staged.parts {
                match plan(id, rect, images, gpu_images) {
                    Plan::Copy(copy) => {
                        let place = Place { offset, pitch: pitch(rect, copy.texel), row: copy.row() };
                        let end = offset + place.pitch * rect.size().y as usize;
                        if copy.rect == rect && end as u64 <= staged.buffer.size() {
                            copy_one(&mut encoder, &copy, place, &staged.buffer);
                            stats.rects += 1;
                            stats.bytes += copy.rect.area() * copy.texel as u64;
                        }
                    }
                    Plan::Wait => waits = true,
                    Plan::Drop => {}
                }
            }
            if waits {
                return Some((id, staged));
            }
            done.push(staged);
            None
        })
        .collect();
    queue.submit([encoder.finish()]);
    done.into_iter().for_each(|Staged { buffer, home, .. }| Buffers::give_back(home, buffer, device));
}

/// What is sent beside the renderer's preparations comes before what is drawn.
fn finish_sending(mut staging: ResMut<Staging>) {
    staging.finish();
}

fn copy_one(encoder: &mut CommandEncoder, copy: &Copy, place: Place, buffer: &Buffer) {
    let (to, size) = destination(copy);
    let layout = layout(place.offset, place.pitch);
    encoder.copy_buffer_to_texture(TexelCopyBufferInfo { buffer, layout }, to, size);
}

enum Plan {
    Copy(Copy),
    Wait,
    Drop,
}

/// A copy out of bounds is a validation error, which ends the app: everything is compared first.
fn plan(id: AssetId<Image>, rect: TexelRect, images: &Assets<Image>, gpu_images: &RenderAssets<GpuImage>) -> Plan {
    let Some(image) = images.get(id) else { return Plan::Drop };
    let Some(gpu) = gpu_images.get(id) else { return Plan::Wait };
    let (cpu_texture, gpu_texture) = (&image.texture_descriptor, &gpu.texture_descriptor);
    if cpu_texture.size != gpu_texture.size || cpu_texture.format != gpu_texture.format {
        // The asset was replaced in this frame: all of it is on its way.
        return Plan::Wait;
    }
    let Some(texel) = gpu_texture.format.block_copy_size(None) else { return Plan::Drop };
    let size = image.size();
    let rect = rect.intersect(TexelRect::whole(size));
    let needed = size.x as usize * size.y as usize * texel as usize;
    if rect.is_empty() || image.data.as_ref().is_none_or(|data| data.len() < needed) {
        return Plan::Drop;
    }
    let (texture, texel) = (gpu.texture.clone(), texel as usize);
    Plan::Copy(Copy { image: id, texture, rect, texel, place: None })
}

fn destination(copy: &Copy) -> (TexelCopyTextureInfo<'_>, Extent3d) {
    let (min, size) = (copy.rect.min, copy.rect.size());
    let origin = Origin3d { x: min.x, y: min.y, z: 0 };
    (
        TexelCopyTextureInfo { texture: &copy.texture, mip_level: 0, origin, aspect: TextureAspect::All },
        Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
    )
}

fn layout(offset: usize, pitch: usize) -> TexelCopyBufferLayout {
    TexelCopyBufferLayout { offset: offset as u64, bytes_per_row: u32::try_from(pitch).ok(), rows_per_image: None }
}

/// Writes a rectangle by itself.
fn write(copy: &Copy, images: &Assets<Image>, queue: &RenderQueue) {
    if let Some(source) = copy.source(images) {
        let (to, size) = destination(copy);
        let (texels, stride) = source.texels();
        queue.write_texture(to, texels, layout(0, stride), size);
    }
}

/// Packs what is not packed yet; returns the buffers of all.
fn pack_rest(
    copies: &mut [Copy],
    images: &Assets<Image>,
    packed: Option<Packed>,
    home: &Buffers,
    device: &RenderDevice,
) -> Vec<Buffer> {
    let mut buffers: Vec<Buffer> = packed.into_iter().map(Packed::close).collect();
    let mut layout = Layout::default();
    let mut rest = Vec::new();
    for copy in copies.iter_mut().filter(|copy| copy.place.is_none()) {
        if let Some(source) = copy.source(images)
            && let Some(place) = layout.place(source, usize::MAX)
        {
            copy.place = Some((buffers.len(), place));
            rest.push((place, source));
        }
    }
    if !rest.is_empty() {
        let buffer = home.take(layout.end() as u64, device);
        let mut write = writer(&buffer, 0..layout.end());
        rest.into_iter().for_each(|(place, source)| write(place, source));
        drop(write);
        buffer.unmap();
        buffers.push(buffer);
    }
    buffers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_gives_way_to_what_comes_later() {
        let ids = [1, 2].map(|n| AssetId::Uuid { uuid: bevy::asset::uuid::Uuid::from_u128(n) });
        let size = UVec2::new(20, 10);
        let data = vec![7; 800];
        let rect = |x| TexelRect { min: UVec2::new(x, 2), max: UVec2::new(x + 3, 6) };
        let mut uploads = Uploads { is_wanted: true, ..default() };
        let fill = |uploads: &mut Uploads| {
            uploads.lend(2, Some(&pack::tests::memory(1 << 18).0));
            uploads.pack(2, |packers| {
                for (packer, x) in packers.iter_mut().zip([4, 9]) {
                    packer.push(ids.into_iter().map(|id| Some((id, &data[..]))), size, rect(x));
                }
            });
        };
        let packed = |uploads: &Uploads, id| -> Vec<bool> {
            let changed = uploads.rects.iter().filter(|changed| changed.image == id);
            changed.map(|changed| changed.place.is_some()).collect()
        };
        fill(&mut uploads);
        uploads.push_whole(ids[0], size, None);
        assert_eq!(packed(&uploads, ids[0]), [false, false, false], "older than the whole");
        assert_eq!(packed(&uploads, ids[1]), [true, true]);
        // Thinned out: one rectangle of each image around all of its own, packed when it is fetched.
        fill(&mut uploads);
        uploads.thin_out();
        assert_eq!(uploads.rects.len(), 2);
        for (changed, around) in uploads.rects.iter().zip([TexelRect::whole(size), rect(4).union(rect(9))]) {
            assert!(changed.rect == around && changed.place.is_none(), "{:?}", changed.rect);
        }
    }

    #[test]
    fn only_what_nobody_fetches_is_thinned_out() {
        for is_fetched in [true, false] {
            let mut app = App::new();
            app.init_resource::<Uploads>().add_systems(Update, drop_unwanted);
            let mut uploads = app.world_mut().resource_mut::<Uploads>();
            (uploads.is_wanted, uploads.is_fetched) = (true, is_fetched);
            for x in 0..=MAX_UNFETCHED as u32 {
                let min = UVec2::new(x, 0);
                uploads.push(AssetId::default(), TexelRect { min, max: min + 1 });
            }
            app.update();
            let left = app.world().resource::<Uploads>().rects.len();
            assert_eq!(left, if is_fetched { MAX_UNFETCHED + 1 } else { 1 });
        }
    }
}
