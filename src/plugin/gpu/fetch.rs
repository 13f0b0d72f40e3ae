//! The render world's side: rectangles to textures.

use crate::paint::MipLevels;
use crate::plugin::api::budget::CrackUploadStats;
use crate::plugin::gpu::buffer::{Buffers, MAX_KEPT, Packed, Staged, writer};
use crate::plugin::gpu::pack::{Changed, PER_PACKER, PackLayout, Place, ROW_ALIGNMENT, Source};
use crate::plugin::gpu::textures;
use crate::plugin::gpu::uploads::Uploads;
use crate::plugin::jobs::background::BackgroundJob;
use crate::raster::TexelRect;
use bevy::{
    prelude::*,
    render::{
        ExtractSchedule, GpuResourceAppExt, MainWorld, Render, RenderApp, RenderSystems,
        render_asset::{RenderAssetBytesPerFrameLimiter, RenderAssets, extract_render_asset_bytes_per_frame},
        render_resource::{
            Buffer, CommandEncoder, CommandEncoderDescriptor, Extent3d, Origin3d, TexelCopyBufferInfo,
            TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureAspect,
        },
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};
use std::sync::{Mutex, Weak};

/// Up to this many rectangles are written one by one, more go through one buffer.
const FEW: usize = 4;

/// No more than about this many bytes go up in a frame, so that no buffer is larger than a device allows; the rest waits.
const MAX_STAGED: usize = 64 << 20;

/// Lets the render world fetch rectangles, if there is one.
pub(crate) fn connect(app: &mut App) {
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
    /// All levels of the image, and which one it is of.
    levels: MipLevels,
    level: u32,
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
        let texels = images.get(self.image)?.data.as_ref()?.get(self.levels.range(self.level))?;
        Some(Source::new(texels, self.levels.size(self.level).x as usize, self.texel, self.rect))
    }
}

/// Memory that is kept from frame to frame.
#[derive(Resource, Default)]
struct Staging {
    rects: Vec<Changed>,
    copies: Vec<Copy>,
    buffers: Buffers,
    /// Gives back the memory of its list.
    sending: Option<BackgroundJob<Sending, Vec<Copy>>>,
}

impl Staging {
    /// Waits for what is being sent.
    fn finish(&mut self) {
        if let Some(copies) = self.sending.take().and_then(BackgroundJob::finish) {
            self.copies = copies;
        }
    }

    /// Makes copies of the rectangles; what is not on the GPU yet stays in the list. Of those that are packed the places hold if
    /// `has_packed`.
    fn take_up(
        &mut self,
        has_packed: bool,
        images: &Assets<Image>,
        gpu_images: &RenderAssets<GpuImage>,
        stats: &mut CrackUploadStats,
    ) {
        let Self { rects, copies, .. } = self;
        let mut bytes = 0;
        rects.retain(|Changed { image, level, rect, place }| match plan(*image, *level, *rect, images, gpu_images) {
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
    }

    /// Makes the copies, many of them from what is packed; returns `room` bytes to pack the next ones.
    fn send(
        &mut self,
        packed: Option<Packed>,
        room: u64,
        images: &Assets<Image>,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<Packed> {
        let Self { copies, buffers, sending, .. } = self;
        if copies.len() <= FEW {
            copies.drain(..).for_each(|copy| write(&copy, images, queue));
            return packed.map(Packed::anew);
        }
        let filled = pack_rest(copies, images, packed, buffers, device);
        let (copies, home) = (core::mem::take(copies), buffers.home());
        let work = Sending { device: device.clone(), queue: queue.clone(), home, buffers: filled, copies };
        *sending = Some(BackgroundJob::start(work, Sending::send));
        Some(Packed::open(room, buffers, device))
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
    for (image, lost) in whole.extract_if(.., |(_, staged)| !staged.is_of(&device)) {
        lost.parts.iter().for_each(|(level, rect, _)| uploads.push_level(image, *level, *rect));
    }
    if !whole.is_empty()
        && let Some(images) = main.get_resource::<Assets<Image>>()
    {
        copy_whole(&mut whole, images, &gpu_images, &device, &queue, &mut stats);
        main.resource_mut::<Uploads>().staged = whole;
    }
    let mut uploads = main.resource_mut::<Uploads>();
    uploads.is_fetched = true;
    if !uploads.rects.is_empty() {
        core::mem::swap(&mut staging.rects, &mut uploads.rects);
        let room = (uploads.packers.len() * PER_PACKER) as u64;
        let mut packed = uploads.close().filter(|packed| packed.is_of(&staging.buffers));
        if let Some(images) = main.get_resource::<Assets<Image>>() {
            staging.take_up(packed.is_some(), images, &gpu_images, &mut stats);
            packed = staging.send(packed, room.min(MAX_KEPT), images, &device, &queue);
        }
        let mut uploads = main.resource_mut::<Uploads>();
        uploads.packed = packed;
        staging.rects.iter_mut().for_each(|changed| changed.place = None);
        uploads.rects.append(&mut staging.rects);
    }
    let mut uploads = main.resource_mut::<Uploads>();
    uploads.levelled = uploads.rects.len();
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
            for &(level, rect, place) in &staged.parts {
                match plan(id, level, rect, images, gpu_images) {
                    Plan::Copy(copy) if copy.rect == rect && copy.row() == place.row => {
                        copy_one(&mut encoder, &copy, place, &staged.buffer);
                        stats.rects += 1;
                        stats.bytes += copy.rect.area() * copy.texel as u64;
                    }
                    Plan::Wait => waits = true,
                    Plan::Copy(_) | Plan::Drop => {}
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
fn plan(
    id: AssetId<Image>,
    level: u32,
    rect: TexelRect,
    images: &Assets<Image>,
    gpu_images: &RenderAssets<GpuImage>,
) -> Plan {
    let Some(image) = images.get(id) else { return Plan::Drop };
    let Some(gpu) = gpu_images.get(id) else { return Plan::Wait };
    let (cpu_texture, gpu_texture) = (&image.texture_descriptor, &gpu.texture_descriptor);
    if (cpu_texture.size, cpu_texture.format, cpu_texture.mip_level_count)
        != (gpu_texture.size, gpu_texture.format, gpu_texture.mip_level_count)
    {
        // The asset was replaced in this frame: all of it is on its way.
        return Plan::Wait;
    }
    let (Some(texel), Some(levels)) = (gpu_texture.format.block_copy_size(None), textures::levels(image)) else {
        return Plan::Drop;
    };
    let rect = rect.intersect(TexelRect::whole(levels.size(level)));
    let has_level = level < gpu_texture.mip_level_count;
    let needed = levels.range(level).end;
    if rect.is_empty() || !has_level || image.data.as_ref().is_none_or(|data| data.len() < needed) {
        return Plan::Drop;
    }
    let (texture, texel) = (gpu.texture.clone(), texel as usize);
    Plan::Copy(Copy { image: id, texture, levels, level, rect, texel, place: None })
}

fn destination(copy: &Copy) -> (TexelCopyTextureInfo<'_>, Extent3d) {
    let (min, size) = (copy.rect.min, copy.rect.size());
    let origin = Origin3d { x: min.x, y: min.y, z: 0 };
    (
        TexelCopyTextureInfo { texture: &copy.texture, mip_level: copy.level, origin, aspect: TextureAspect::All },
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
    let mut layout = PackLayout::default();
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
