//! What varies along a row of texels, worked out for many of them at a time.

use super::spot::TILE;
use core::ops::Range;
use glam::Vec2;

/// Texels of a row of a tile, and one more at either end.
pub(super) const WIDE: usize = TILE as usize + 2;

/// A value for each texel of a row.
pub(super) type Row = [f32; WIDE];

/// 0 for each.
pub(super) const ZEROS: Row = [0.0; WIDE];

/// The texels from the first to the last one for which something holds.
pub(super) fn span(all: Range<usize>, holds: impl Fn(usize) -> bool) -> Range<usize> {
    let first = all.clone().find(|&k| holds(k));
    let last = all.rev().find(|&k| holds(k));
    first.zip(last).map_or(0..0, |(first, last)| first..last + 1)
}

/// A row of texels.
#[derive(Clone, Copy)]
pub(super) struct TexelRow {
    /// The place of its first texel, in the field.
    pub(super) first: Vec2,
    /// The place that offsets are from, as the middle of a zone.
    pub(super) centre: Vec2,
}

impl TexelRow {
    #[inline(always)]
    pub(super) fn at(self, k: usize) -> Vec2 {
        Vec2::new(self.first.x + k as i32 as f32, self.first.y)
    }

    #[inline(always)]
    pub(super) fn off(self, k: usize) -> Vec2 {
        self.at(k) - self.centre
    }

    /// The value of each place, for some of the texels.
    #[inline(always)]
    pub(super) fn fill(self, row: &mut Row, texels: &Range<usize>, value: impl Fn(Vec2) -> f32) {
        let Some(row) = row.get_mut(texels.clone()) else { return };
        let first = texels.start as i32;
        for (k, to) in row.iter_mut().enumerate() {
            *to = value(Vec2::new(self.first.x + (first + k as i32) as f32, self.first.y));
        }
    }
}
