//! [`DirtyTiles`]: which parts of a surface changed.

use super::TexelRect;
use glam::UVec2;

/// The changed parts of a surface, in tiles of [`DirtyTiles::TILE`] texels.
#[derive(Clone, Debug, Default)]
pub struct DirtyTiles {
    size: UVec2,
}

impl DirtyTiles {
    /// Side of a tile, texels.
    pub const TILE: u32 = 16;

    /// Nothing changed on a surface of `size` texels.
    #[must_use]
    pub fn new(size: UVec2) -> Self {
        Self { size }
    }

    /// Marks every tile that `rect` touches (clipped to the surface).
    pub fn mark(&mut self, _rect: TexelRect) {
        todo!()
    }

    /// Whether nothing is marked.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        todo!()
    }

    /// Unmarks everything and appends rectangles that cover exactly... all marked tiles, disjoint, few, in a fixed order.
    pub fn take_rects(&mut self, _rects: &mut Vec<TexelRect>) {
        todo!()
    }
}
