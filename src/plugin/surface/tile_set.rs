//! [`Touched`]: a set of tiles.

use crate::raster::{DirtyTiles, ReplayChanges, TexelRect};
use bevy::prelude::*;

/// A set of tiles.
#[derive(Default)]
pub(crate) struct Touched {
    tiles: UVec2,
    /// A bit each, row by row, from a new word on in each row.
    bits: Vec<u64>,
    count: u32,
}

impl Touched {
    pub(crate) fn new(size: UVec2) -> Self {
        let tiles = UVec2::new(size.x.div_ceil(DirtyTiles::TILE), size.y.div_ceil(DirtyTiles::TILE));
        Self { tiles, bits: vec![0; tiles.x.div_ceil(64) as usize * tiles.y as usize], count: 0 }
    }

    pub(crate) fn mark(&mut self, rect: TexelRect) {
        let (min, max) =
            (rect.min / DirtyTiles::TILE, rect.max.map(|end| end.div_ceil(DirtyTiles::TILE)).min(self.tiles));
        for y in min.y..max.y {
            for first in (min.x / 64 * 64..max.x).step_by(64) {
                let (from, to) = (min.x.max(first) - first, (max.x - first).min(64));
                let all = (u64::MAX << from) & (u64::MAX >> (64 - to));
                let word = &mut self.bits[(y * self.tiles.x.div_ceil(64) + first / 64) as usize];
                self.count += (all & !*word).count_ones();
                *word |= all;
            }
        }
    }

    /// Takes up what has been drawn again.
    pub(crate) fn follow(&mut self, redrawn: &ReplayChanges) {
        redrawn.cleared.iter().for_each(|tile| self.unmark(*tile));
        redrawn.stamped.iter().for_each(|rect| self.mark(*rect));
    }

    /// Takes the one tile `rect` out.
    fn unmark(&mut self, rect: TexelRect) {
        let tile = rect.min / DirtyTiles::TILE;
        if tile.cmplt(self.tiles).all() {
            let word = &mut self.bits[(tile.y * self.tiles.x.div_ceil(64) + tile.x / 64) as usize];
            let bit = 1 << (tile.x % 64);
            self.count -= u32::from(*word & bit != 0);
            *word &= !bit;
        }
    }

    /// Share of tiles in the set, 0..=1.
    pub(crate) fn share(&self) -> f32 {
        self.count as f32 / (self.tiles.x * self.tiles.y).max(1) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;
    use std::collections::BTreeSet;

    #[test]
    fn touched_tiles_are_those_of_a_set() {
        let mut rng = Rng::new(8);
        let tile = |texel: UVec2| (texel / DirtyTiles::TILE).to_array();
        for size in [[512, 512], [3000, 40], [1, 1], [1040, 2000]].map(UVec2::from) {
            let (mut touched, mut set) = (Touched::new(size), BTreeSet::new());
            for round in 0..200 {
                let mut corner = || UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
                let (a, b) = (corner(), corner());
                if round % 3 == 0 {
                    touched.unmark(TexelRect { min: a, max: a + 1 });
                    set.remove(&tile(a));
                } else {
                    let near = a.min(b) + (a.max(b) - a.min(b)) / (1 + round % 30);
                    let rect = TexelRect { min: a.min(b), max: near + 1 };
                    touched.mark(rect);
                    let tiles = |axis: usize| rect.min[axis] / DirtyTiles::TILE..=near[axis] / DirtyTiles::TILE;
                    set.extend(tiles(1).flat_map(|y| tiles(0).map(move |x| [x, y])));
                }
                touched.mark(TexelRect::default());
                let all = size.map(|side| side.div_ceil(DirtyTiles::TILE)).element_product();
                assert_eq!(touched.share(), set.len() as f32 / all as f32, "{size}");
            }
        }
    }
}
