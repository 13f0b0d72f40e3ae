//! Texels packed the way the GPU wants them.

use crate::raster::TexelRect;
use bevy::prelude::*;
use core::ops::Range;
use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

/// Copies between buffers and textures want rows that begin at multiples of this, bytes.
pub(crate) const ROW_ALIGNMENT: usize = 256;

/// Rows of a copy begin at multiples of this, bytes, beside those of others. Copies from elsewhere are slow or wrong on some
/// devices.
const COPY_ALIGNMENT: usize = 64;

/// Copies lie side by side in rows of so many bytes, if they are no wider: so less is lost to [`ROW_ALIGNMENT`].
const PITCH: usize = 1024;

/// Where copies may begin in a row.
const LANES: usize = PITCH / COPY_ALIGNMENT;

/// Rows that a packer takes at once.
const BLOCK_ROWS: usize = 32;

/// Bytes that suffice for a packer, mostly.
pub(crate) const PER_PACKER: usize = 4 * BLOCK_ROWS * PITCH;

/// Texels of an image that have changed.
pub(crate) struct Changed {
    pub(crate) image: AssetId<Image>,
    /// The mip level.
    pub(crate) level: u32,
    pub(crate) rect: TexelRect,
    /// Where they are packed, if they are.
    pub(crate) place: Option<Place>,
}

/// Rows of texels among the packed ones.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    /// Where the first row begins.
    pub(crate) offset: usize,
    /// From row to row.
    pub(crate) pitch: usize,
    /// Length of a row.
    pub(crate) row: usize,
}

/// Rows of texels in an image.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    data: &'a [u8],
    /// Where the first row begins.
    from: usize,
    /// From row to row.
    stride: usize,
    /// Length of a row.
    row: usize,
    height: usize,
}

impl<'a> Source<'a> {
    /// The texels `rect` of an image that is `width` texels wide.
    pub(crate) fn new(data: &'a [u8], width: usize, texel: usize, rect: TexelRect) -> Self {
        let ([x, y], [row, height]) = (rect.min.as_usizevec2().to_array(), rect.size().as_usizevec2().to_array());
        Self { data, from: (y * width + x) * texel, stride: width * texel, row: row * texel, height }
    }

    /// From row to row where they are packed, and how many rows of [`PITCH`] bytes they take there.
    fn packed(&self) -> (usize, usize) {
        if self.row <= PITCH {
            return (PITCH, self.height);
        }
        let pitch = self.row.next_multiple_of(ROW_ALIGNMENT);
        (pitch, (pitch * self.height).div_ceil(PITCH))
    }

    /// The texels from the first row to the end of the image, and the way from row to row.
    pub(crate) fn texels(&self) -> (&'a [u8], usize) {
        (&self.data[self.from..], self.stride)
    }

    /// Calls `write` with each row and where it is to go, from the place of the first one on.
    pub(crate) fn rows(&self, place: Place, mut write: impl FnMut(usize, &[u8])) {
        let (mut from, mut to) = (self.from, place.offset);
        for _ in 0..self.height {
            write(to, &self.data[from..from + self.row]);
            from += self.stride;
            to += place.pitch;
        }
    }
}

/// Writes texels to their place in a part of the memory, counted from its start.
pub(crate) type Write = Box<dyn FnMut(Place, Source<'_>) + Send + Sync>;

/// Opens a range of bytes.
type Open = Box<dyn Fn(Range<usize>) -> Write + Send + Sync>;

/// Memory that the GPU will read, taken in blocks of rows of [`PITCH`] bytes.
pub(crate) struct Memory {
    /// It is not asked for the same bytes twice.
    open: Open,
    rows: usize,
    /// The first row that nobody has taken.
    next: AtomicUsize,
}

impl Memory {
    pub(crate) fn new(bytes: usize, open: Open) -> Self {
        Self { open, rows: bytes / PITCH, next: AtomicUsize::new(0) }
    }

    /// Takes some rows; `None` if there are no more.
    fn block(&self, height: usize) -> Option<Block> {
        let beyond = |first: usize| first.checked_add(height).filter(|end| *end <= self.rows);
        let first = self.next.fetch_update(Ordering::Relaxed, Ordering::Relaxed, beyond).ok()?;
        let end = first + height;
        let write = (self.open)(first * PITCH..end * PITCH);
        Some(Block { write, first, height, layout: PackLayout::default() })
    }
}

/// Where texels lie in rows of [`PITCH`] bytes: how many of them are taken, of each lane.
#[derive(Default)]
pub(crate) struct PackLayout([usize; LANES]);

impl PackLayout {
    /// Finds room for texels, as near the top as there is above row `end`.
    pub(crate) fn place(&mut self, source: Source, end: usize) -> Option<Place> {
        let lanes = source.row.div_ceil(COPY_ALIGNMENT).clamp(1, LANES);
        let (pitch, height) = source.packed();
        let tops = self.0.windows(lanes).map(|lanes| lanes.iter().copied().max().unwrap_or(0));
        let (top, lane) = tops.zip(0..).min()?;
        let bottom = top.checked_add(height).filter(|bottom| *bottom <= end)?;
        self.0[lane..lane + lanes].fill(bottom);
        Some(Place { offset: top * PITCH + lane * COPY_ALIGNMENT, pitch, row: source.row })
    }

    /// Bytes that are taken, with those between them.
    pub(crate) fn end(&self) -> usize {
        self.0.iter().copied().max().unwrap_or(0) * PITCH
    }
}

/// Some rows of a [`Memory`].
struct Block {
    write: Write,
    first: usize,
    height: usize,
    layout: PackLayout,
}

impl Block {
    /// Packs texels; `None` if there is no room for them.
    fn pack(&mut self, source: Source) -> Option<Place> {
        let place = self.layout.place(source, self.height)?;
        (self.write)(place, source);
        Some(Place { offset: self.first * PITCH + place.offset, ..place })
    }
}

/// Packs texels for the GPU, on any thread.
#[derive(Default)]
pub(crate) struct Packer {
    is_wanted: bool,
    memory: Option<Arc<Memory>>,
    /// What it has taken last.
    block: Option<Block>,
    pub(crate) rects: Vec<Changed>,
}

impl Packer {
    /// A packer without memory; if it is not wanted, it notes nothing.
    pub(crate) fn new(is_wanted: bool) -> Self {
        Self { is_wanted, ..Self::default() }
    }

    /// Gives it memory if it has none.
    pub(crate) fn lend(&mut self, memory: Option<&Arc<Memory>>) {
        if self.memory.is_none() {
            self.memory = memory.cloned();
        }
    }

    /// Gives back the memory.
    pub(crate) fn close(&mut self) {
        (self.block, self.memory) = (None, None);
    }

    /// Notes that the same texels have changed in the images of a surface of `size` texels, and packs them: they have just been
    /// written, so that the cache still has them. With each image come its texels, and the bytes of one.
    pub(crate) fn push<'a>(
        &mut self,
        images: impl Iterator<Item = Option<(AssetId<Image>, &'a [u8], usize)>>,
        size: UVec2,
        rect: TexelRect,
    ) {
        if !self.is_wanted || rect.is_empty() {
            return;
        }
        let area = size.as_usizevec2().element_product();
        for (image, data, texel) in images.flatten() {
            // Somebody else may have broken it.
            let is_whole = data.len() >= area * texel;
            let place = if is_whole { self.pack(Source::new(data, size.x as usize, texel, rect)) } else { None };
            self.rects.push(Changed { image, level: 0, rect, place });
        }
    }

    /// Packs texels; `None` if there is no room for them.
    fn pack(&mut self, source: Source) -> Option<Place> {
        let memory = self.memory.as_ref()?;
        if let Some(place) = self.block.as_mut().and_then(|block| block.pack(source)) {
            return Some(place);
        }
        let height = source.packed().1;
        let mut block = memory.block(height.max(BLOCK_ROWS))?;
        let place = block.pack(source);
        // One that is full is of no use.
        if source.row < PITCH {
            self.block = Some(block);
        }
        place
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::math::Rng;
    use std::sync::{Mutex, PoisonError};

    /// Memory that no device knows.
    pub(in super::super) fn memory(size: usize) -> (Arc<Memory>, Arc<Mutex<Vec<u8>>>) {
        let bytes = Arc::new(Mutex::new(vec![0; size]));
        let all = bytes.clone();
        let open = move |range: Range<usize>| -> Write {
            let all = all.clone();
            Box::new(move |place, source| {
                let mut bytes = all.lock().unwrap_or_else(PoisonError::into_inner);
                let bytes = &mut bytes[range.clone()];
                source.rows(place, |to, row| bytes[to..to + row.len()].copy_from_slice(row));
            })
        };
        (Arc::new(Memory::new(size, Box::new(open))), bytes)
    }

    #[test]
    fn packed_rows_are_those_of_the_pictures() {
        const BYTES: usize = 1 << 20;
        let mut rng = Rng::new(3);
        for size in [[37, 23], [600, 9], [1, 1], [1500, 700]] {
            let size = UVec2::from(size);
            let area = size.x as usize * size.y as usize;
            let data = [4, 4, 1].map(|texel| (0..texel * area).map(|_| rng.next_u32() as u8).collect::<Vec<_>>());
            let (memory, bytes) = memory(BYTES);
            let mut packers = [(); 3].map(|()| Packer::new(true));
            packers.iter_mut().for_each(|packer| packer.lend(Some(&memory)));
            let mut rects = vec![TexelRect::whole(size), TexelRect::default()];
            for _ in 0..40 {
                let mut corner = || UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
                let (a, b) = (corner(), corner());
                rects.push(TexelRect { min: a.min(b), max: a.max(b) + 1 });
            }
            for (i, rect) in rects.iter().enumerate() {
                let pictures =
                    data.iter().zip([4, 4, 1]).map(|(data, texel)| Some((AssetId::default(), &data[..], texel)));
                packers[i % 3].push(pictures, size, *rect);
            }
            let mut packed = 0;
            for (i, packer) in packers.iter().enumerate() {
                let rects: Vec<_> = rects.iter().skip(i).step_by(3).filter(|rect| !rect.is_empty()).collect();
                assert_eq!(packer.rects.len(), 3 * rects.len());
                for (k, changed) in packer.rects.iter().enumerate() {
                    let (rect, data) = (*rects[k / 3], &data[k % 3]);
                    assert_eq!(changed.rect, rect);
                    let Some(Place { offset, pitch, row }) = changed.place else { continue };
                    packed += 1;
                    let texel = data.len() / area;
                    assert_eq!(row, rect.size().x as usize * texel, "{rect:?}");
                    assert!(pitch % ROW_ALIGNMENT == 0 && offset % COPY_ALIGNMENT == 0, "{offset} {pitch}");
                    for y in rect.min.y..rect.max.y {
                        let from = (y * size.x + rect.min.x) as usize * texel;
                        let to = offset + (y - rect.min.y) as usize * pitch;
                        // So none lies over another: that would hold something else.
                        let bytes = bytes.lock().unwrap_or_else(PoisonError::into_inner);
                        assert_eq!(bytes[to..to + row], data[from..from + row], "{rect:?}");
                    }
                }
            }
            let all = 3 * (rects.len() - 1);
            assert!(packed > 0 && (packed == all) == (area < 100_000), "{packed} of {all} are packed");
        }
    }
}
