//! Texels packed the way the GPU wants them.

use crate::raster::TexelRect;
use bevy::prelude::*;

/// Copies between buffers and textures want rows that begin at multiples of this, bytes.
pub(super) const ROW_ALIGNMENT: usize = 256;

/// Rows of a copy begin at multiples of this, bytes, beside those of others. Copies from elsewhere are slow or wrong on some
/// devices.
const COPY_ALIGNMENT: usize = 64;

/// Copies lie side by side in rows of so many bytes, if they are no wider: so less is lost to [`ROW_ALIGNMENT`].
const PITCH: usize = 1024;

/// Where copies may begin in a row.
const LANES: usize = PITCH / COPY_ALIGNMENT;

/// The least memory that is asked for, bytes.
const LEAST: usize = 1 << 16;

/// The part of what is not packed before the renderer fetches it.
pub(super) const LOOSE: usize = 0;

/// Up to this many bytes are packed by each [`Packer`], the rest when the renderer fetches it.
const MAX_PACKED: usize = 1 << 20;

/// More memory than this is not kept for the next frame, bytes.
pub(super) const MAX_KEPT: usize = 16 << 20;

/// Texels of an image that have changed.
pub(super) struct Changed {
    pub(super) image: AssetId<Image>,
    pub(super) rect: TexelRect,
    /// Where they are packed, if they are.
    pub(super) place: Option<Place>,
}

/// Rows of texels among the packed ones.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// Which [`Rows`].
    pub(super) part: usize,
    /// Where the first row begins.
    pub(super) offset: usize,
    /// From row to row.
    pub(super) pitch: usize,
    /// Length of a row.
    pub(super) row: usize,
}

/// Packed texels. The memory is kept from frame to frame, what lies beyond the end is of no use.
#[derive(Default)]
pub(super) struct Rows {
    pub(super) bytes: Vec<u8>,
    /// Rows of [`PITCH`] bytes that are taken, of each lane.
    taken: [usize; LANES],
}

impl Rows {
    /// Finds room for `height` rows of `row` bytes, as near the top as there is; returns where the first begins, and the way from
    /// row to row.
    pub(super) fn place(&mut self, row: usize, height: usize) -> (usize, usize) {
        let lanes = row.div_ceil(COPY_ALIGNMENT).min(LANES);
        let tops = self.taken.windows(lanes.max(1)).map(|lanes| lanes.iter().copied().max().unwrap_or(0));
        let (top, lane) = tops.zip(0..).min().unwrap_or((0, 0));
        let (pitch, rows) = if row <= PITCH {
            (PITCH, height)
        } else {
            let pitch = row.next_multiple_of(ROW_ALIGNMENT);
            (pitch, (pitch * height).div_ceil(PITCH))
        };
        self.taken[lane..lane + lanes].fill(top + rows);
        let end = (top + rows) * PITCH;
        if self.bytes.len() < end {
            self.bytes.resize(end.next_power_of_two().max(LEAST), 0);
        }
        (top * PITCH + lane * COPY_ALIGNMENT, pitch)
    }

    /// Bytes that are taken, with those between them.
    pub(super) fn end(&self) -> usize {
        self.taken.iter().copied().max().unwrap_or(0) * PITCH
    }

    pub(super) fn clear(&mut self) {
        self.taken = [0; LANES];
        if self.bytes.len() > MAX_KEPT {
            self.bytes = Vec::new();
        }
    }
}

/// Packs texels for the GPU, on any thread.
#[derive(Default)]
pub(in crate::plugin) struct Packer {
    is_wanted: bool,
    part: usize,
    pub(super) rects: Vec<Changed>,
    pub(super) rows: Rows,
}

impl Packer {
    /// A packer whose rows are those of `part`; it packs nothing if it is not wanted.
    pub(super) fn new(is_wanted: bool, part: usize) -> Self {
        Self { is_wanted, part, ..Self::default() }
    }

    /// Notes that the same texels have changed in the images of a surface of `size` texels, and packs them: they have just been
    /// written, so that the cache still has them.
    pub(in crate::plugin) fn push<'a>(
        &mut self,
        images: impl Iterator<Item = Option<(AssetId<Image>, &'a [u8])>>,
        size: UVec2,
        rect: TexelRect,
    ) {
        if !self.is_wanted || rect.is_empty() {
            return;
        }
        let (stride, area) = (size.x as usize, size.x as usize * size.y as usize);
        let [x, y] = rect.min.as_usizevec2().to_array();
        let [width, height] = rect.size().as_usizevec2().to_array();
        for (image, data) in images.flatten() {
            let texel = data.len() / area;
            let row = width * texel;
            let is_packed = self.rows.end() + row.next_multiple_of(PITCH) * height <= MAX_PACKED;
            let place = is_packed.then(|| {
                let (offset, pitch) = self.rows.place(row, height);
                let place = Place { part: self.part, offset, pitch, row };
                pack(&mut self.rows.bytes, place, data, (y * stride + x) * texel, stride * texel, height);
                place
            });
            self.rects.push(Changed { image, rect, place });
        }
    }
}

/// Copies rows of an image, the first of which begins at `from`, to their place.
pub(super) fn pack(rows: &mut [u8], place: Place, data: &[u8], mut from: usize, stride: usize, height: usize) {
    let mut to = place.offset;
    for _ in 0..height {
        rows[to..to + place.row].copy_from_slice(&data[from..from + place.row]);
        from += stride;
        to += place.pitch;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    #[test]
    fn packed_rows_are_those_of_the_pictures() {
        let mut rng = Rng::new(3);
        for size in [[37, 23], [600, 9], [1, 1], [1500, 700]] {
            let size = UVec2::from(size);
            let area = size.x as usize * size.y as usize;
            let data = [4, 4, 1].map(|texel| (0..texel * area).map(|_| rng.next_u32() as u8).collect::<Vec<_>>());
            let mut packer = Packer::new(true, 5);
            let mut rects = vec![TexelRect::whole(size), TexelRect::default()];
            for _ in 0..40 {
                let mut corner = || UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
                let (a, b) = (corner(), corner());
                rects.push(TexelRect { min: a.min(b), max: a.max(b) + 1 });
            }
            for rect in &rects {
                let pictures = data.iter().map(|data| Some((AssetId::default(), &data[..])));
                packer.push(pictures, size, *rect);
            }
            rects.retain(|rect| !rect.is_empty());
            assert_eq!(packer.rects.len(), 3 * rects.len());
            for (i, changed) in packer.rects.iter().enumerate() {
                let (rect, data) = (rects[i / 3], &data[i % 3]);
                assert_eq!(changed.rect, rect);
                let Some(Place { part, offset, pitch, row }) = changed.place else { continue };
                let texel = data.len() / area;
                assert!(part == 5 && row == rect.size().x as usize * texel, "{rect:?}");
                assert!(pitch % ROW_ALIGNMENT == 0 && offset % COPY_ALIGNMENT == 0, "{offset} {pitch}");
                assert!(offset + pitch * (rect.size().y as usize - 1) + row <= packer.rows.end(), "beyond the end");
                for y in rect.min.y..rect.max.y {
                    let from = (y * size.x + rect.min.x) as usize * texel;
                    let to = offset + (y - rect.min.y) as usize * pitch;
                    // So none lies over another: that would hold something else.
                    assert_eq!(packer.rows.bytes[to..to + row], data[from..from + row], "{rect:?}");
                }
            }
            assert!(packer.rows.end() <= MAX_PACKED);
            assert!(packer.rects.iter().any(|changed| changed.place.is_some()), "nothing is packed");
        }
    }
}
