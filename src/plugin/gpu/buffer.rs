//! Memory that the GPU reads.

use crate::paint::MipLevels;
use crate::plugin::gpu::pack::{Memory, Place, ROW_ALIGNMENT, Source, Write};
use crate::raster::TexelRect;
use bevy::{
    prelude::*,
    render::{
        render_resource::{Buffer, BufferDescriptor, BufferUsages, MapMode},
        renderer::RenderDevice,
    },
};
use core::ops::Range;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// The least size of a buffer, bytes.
const LEAST_BUFFER: u64 = 1 << 18;

/// More memory than this is not kept for the next frame, bytes.
pub(crate) const MAX_KEPT: u64 = 16 << 20;

/// Buffers that the GPU has read, ready to be written again: new ones cost their memory's page faults.
#[derive(Clone, Default)]
pub(crate) struct Buffers(Arc<Mutex<Vec<Buffer>>>);

impl Buffers {
    pub(crate) fn home(&self) -> Weak<Mutex<Vec<Buffer>>> {
        Arc::downgrade(&self.0)
    }

    /// A buffer that is mapped.
    pub(crate) fn take(&self, size: u64, device: &RenderDevice) -> Buffer {
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
    pub(crate) fn give_back(home: Weak<Mutex<Vec<Buffer>>>, buffer: Buffer, device: &RenderDevice) {
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

/// A buffer in which texels are packed.
pub(crate) struct Packed {
    buffer: Buffer,
    /// Where it is to go then.
    home: Weak<Mutex<Vec<Buffer>>>,
    pub(crate) memory: Arc<Memory>,
}

impl Packed {
    /// A buffer of this many bytes.
    pub(crate) fn open(size: u64, buffers: &Buffers, device: &RenderDevice) -> Self {
        Self::new(buffers.take(size, device), buffers.home())
    }

    fn new(buffer: Buffer, home: Weak<Mutex<Vec<Buffer>>>) -> Self {
        let mapped = buffer.clone();
        let open = move |range: Range<usize>| writer(&mapped, range);
        Self { memory: Arc::new(Memory::new(buffer.size() as usize, Box::new(open))), buffer, home }
    }

    /// The same memory with nothing in it.
    pub(crate) fn anew(self) -> Self {
        Self::new(self.buffer, self.home)
    }

    /// Whether it is of the device that is there, and not of one that was lost.
    pub(crate) fn is_of(&self, buffers: &Buffers) -> bool {
        Weak::ptr_eq(&self.home, &buffers.home())
    }

    /// What the GPU can read now.
    pub(crate) fn close(self) -> Buffer {
        self.buffer.unmap();
        self.buffer
    }
}

/// Writes to a part of a buffer that is mapped. The buffer cannot be unmapped as long as it lives.
pub(crate) fn writer(buffer: &Buffer, range: Range<usize>) -> Write {
    let mut view = buffer.slice(range.start as u64..range.end as u64).get_mapped_range_mut();
    Box::new(move |place, source| source.rows(place, |to, row| view.slice(to..to + row.len()).copy_from_slice(row)))
}

/// Brings pictures to where the GPU can read them, on any thread, and keeps that memory for the next ones.
#[derive(Clone)]
pub(crate) struct Stager {
    device: RenderDevice,
    buffers: Buffers,
}

/// Parts of a picture where the GPU can read them.
pub(crate) struct Staged {
    device: RenderDevice,
    pub(crate) buffer: Buffer,
    /// Where it is to go then.
    pub(crate) home: Weak<Mutex<Vec<Buffer>>>,
    /// Each with its mip level and its place there.
    pub(crate) parts: Vec<(u32, TexelRect, Place)>,
}

impl Staged {
    /// Whether the GPU is still the one behind this device.
    pub(crate) fn is_of(&self, device: &RenderDevice) -> bool {
        is_same(&self.device, device)
    }
}

fn is_same(a: &RenderDevice, b: &RenderDevice) -> bool {
    a.wgpu_device() == b.wgpu_device()
}

impl Stager {
    /// Beside others, with memory of its own.
    pub(crate) fn new(device: &RenderDevice) -> Self {
        Self { device: device.clone(), buffers: Buffers::default() }
    }

    /// Whether the GPU is still the one behind this device.
    pub(crate) fn is_of(&self, device: &RenderDevice) -> bool {
        is_same(&self.device, device)
    }

    /// Parts of a texture, with what depends on them in its mip levels if it has any; `None` if there are none, they are not in it, or
    /// the device has no buffer so large.
    pub(crate) fn stage(&self, texels: &[u8], levels: MipLevels, rects: &[TexelRect]) -> Option<Staged> {
        let (whole, texel) = (TexelRect::whole(levels.size(0)), levels.kind().bytes());
        let has_mips = texels.len() == levels.bytes();
        let has_all = has_mips || texels.len() == levels.range(0).end;
        if !has_all || rects.iter().any(|rect| rect.intersect(whole) != *rect) {
            return None;
        }
        let above = if has_mips { levels.above(rects) } else { Vec::new() };
        let mut end = 0;
        let place = |(level, rect): (u32, TexelRect)| {
            let row = rect.size().x as usize * texel;
            let place = Place { offset: end, pitch: row.next_multiple_of(ROW_ALIGNMENT), row };
            end += place.pitch * rect.size().y as usize;
            (level, rect, place)
        };
        let parts: Vec<_> = rects.iter().map(|rect| (0, *rect)).chain(above).map(place).collect();
        if end == 0 || (end as u64).next_power_of_two() > self.device.limits().max_buffer_size {
            return None;
        }
        let buffer = self.buffers.take(end as u64, &self.device);
        let mut write = writer(&buffer, 0..end);
        for &(level, rect, place) in &parts {
            let (texels, width) = (&texels[levels.range(level)], levels.size(level).x as usize);
            write(place, Source::new(texels, width, texel, rect));
        }
        drop(write);
        buffer.unmap();
        Some(Staged { device: self.device.clone(), buffer, home: self.buffers.home(), parts })
    }
}
