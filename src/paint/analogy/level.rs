//! [`Level`]: one level of what is made: its guide, its colours so far, and where they come from.

use super::atlas::{Atlas, NOWHERE, Place, RADIUS, ROW, SIDE};
use glam::{IVec2, UVec2};

/// The texels around one, for comparison.
pub(super) type Around = [[i16; 4 * ROW]; SIDE];

#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) size: UVec2,
    pub(super) wraps: bool,
    /// Red, green, blue, and the ramp.
    pub(super) texels: Vec<[u8; 4]>,
    pub(super) extras: Vec<u8>,
    pub(super) channels: usize,
    /// Where each texel comes from.
    pub(super) places: Vec<Place>,
    /// Whether the place of a texel is another one than before the work in progress.
    pub(super) is_new: Vec<bool>,
    /// How often each texel of the atlas has been copied; empty on the large levels, which take over what the small
    /// ones have chosen.
    pub(super) uses: Vec<u16>,
}

impl Level {
    pub(super) fn new(size: UVec2, wraps: bool, channels: usize, counted: usize) -> Self {
        let count = size.element_product() as usize;
        Self {
            size,
            wraps,
            texels: vec![[0, 0, 0, 255]; count],
            extras: vec![0; count * channels],
            channels,
            places: vec![NOWHERE; count],
            is_new: vec![false; count],
            uses: vec![0; counted],
        }
    }

    #[inline(always)]
    pub(super) const fn index(&self, texel: UVec2) -> usize {
        texel.y as usize * self.size.x as usize + texel.x as usize
    }

    /// The texel itself, or the one that stands for it beyond the border.
    #[inline(always)]
    pub(super) fn inside(&self, texel: IVec2) -> UVec2 {
        let size = self.size.as_ivec2();
        if self.wraps { texel.rem_euclid(size) } else { texel.clamp(IVec2::ZERO, size - 1) }.as_uvec2()
    }

    /// The neighbour of a texel, if there is one.
    #[inline(always)]
    pub(super) fn neighbour(&self, texel: UVec2, by: IVec2) -> Option<UVec2> {
        let at = texel.as_ivec2() + by;
        let is_in = at.cmpge(IVec2::ZERO).all() && at.cmplt(self.size.as_ivec2()).all();
        (is_in || self.wraps).then(|| self.inside(at))
    }

    /// The texels around one.
    #[inline(always)]
    pub(super) fn around(&self, texel: UVec2) -> Around {
        let mut out = [[0; 4 * ROW]; SIDE];
        let first = texel.as_ivec2() - RADIUS as i32;
        let last = first + IVec2::new(ROW as i32, SIDE as i32);
        if first.cmpge(IVec2::ZERO).all() && last.cmple(self.size.as_ivec2()).all() {
            let mut at = self.index(first.as_uvec2());
            for row in &mut out {
                let texels = self.texels[at..at + ROW].as_flattened();
                for (out, &value) in row.iter_mut().zip(texels) {
                    *out = i16::from(value);
                }
                at += self.size.x as usize;
            }
            return out;
        }
        for (y, row) in (0..).zip(&mut out) {
            for (x, out) in (0..).zip(row.as_chunks_mut::<4>().0) {
                *out = self.texels[self.index(self.inside(first + IVec2::new(x, y)))].map(i16::from);
            }
        }
        out
    }

    /// How often the place at an index of the atlas has been copied to other texels than one that has it now.
    #[inline(always)]
    pub(super) fn uses(&self, at: usize, is_own: bool) -> u32 {
        self.uses.get(at).map_or(0, |&uses| u32::from(uses).saturating_sub(u32::from(is_own)))
    }

    /// Copies a texel of the photographs.
    #[inline(always)]
    pub(super) fn put(&mut self, index: usize, place: Place, atlas: &Atlas) {
        let at = atlas.index(place);
        let [r, g, b, _] = atlas.texels[at];
        let [.., ramp] = self.texels[index];
        self.texels[index] = [r, g, b, ramp];
        let before = std::mem::replace(&mut self.places[index], place);
        if let Some(uses) = self.uses.get_mut(at) {
            *uses = uses.saturating_add(1);
            if before != NOWHERE {
                let uses = &mut self.uses[atlas.index(before)];
                *uses = uses.saturating_sub(1);
            }
        }
    }
}
