//! [`Holes`]: the texels that have left a surface.

use crate::Grid;
use crate::plugin::source::picture::{BasePicture, density};
use crate::raster::TexelRect;
use bevy::prelude::*;
use core::ops::Range;

/// The texels that have left a surface with its shards.
#[derive(Clone)]
pub(crate) struct Holes {
    pub(crate) gone: Grid<bool>,
    pub(crate) count: u64,
}

/// Texels beside each other: y, first x, and the x after the last.
pub(crate) type Span = [u32; 3];

impl Holes {
    pub(crate) fn new(size: UVec2) -> Self {
        Self { gone: Grid::new(size, false), count: 0 }
    }

    /// Whether the texel is one.
    pub(crate) fn contains(&self, texel: UVec2) -> bool {
        self.gone.get(texel.x, texel.y).unwrap_or(false)
    }

    /// Whether there are any.
    pub(crate) fn is_any(&self) -> bool {
        self.count > 0
    }

    /// What lies in a rectangle, row by row: runs of texels that are all gone, or all there.
    fn for_each_run(&self, rect: TexelRect, is_gone: bool, mut run: impl FnMut(Span)) {
        let rect = rect.intersect(TexelRect::whole(self.gone.size()));
        for y in rect.min.y..rect.max.y {
            let mut x = rect.min.x;
            for texels in self.gone.row(y as usize)[rect.min.x as usize..rect.max.x as usize].chunk_by(|a, b| a == b) {
                let end = x + texels.len() as u32;
                if texels[0] == is_gone {
                    run([y, x, end]);
                }
                x = end;
            }
        }
    }

    /// Makes the holes in `rect` of the field transparent in the RGBA texels of an image of `size`, where the field lies at `origin`.
    pub(crate) fn cut_out(&self, rgba: &mut [u8], size: UVec2, origin: UVec2, rect: TexelRect) {
        if self.is_any() {
            self.for_each_run(rect, true, |span| cut_span(rgba, size, origin, span));
        }
    }

    /// Copies what is there in `rect` of the field from one image to another of the same size.
    pub(crate) fn copy_present(&self, from: &[u8], to: &mut [u8], size: UVec2, origin: UVec2, rect: TexelRect) {
        self.for_each_run(rect, false, |span| {
            let texels = texels(size, origin, span);
            if let (Some(from), Some(to)) = (from.get(texels.clone()), to.get_mut(texels)) {
                to.copy_from_slice(from);
            }
        });
    }

    /// Where cracks may go on a surface that shows `view` of a picture. `None` = everywhere.
    pub(crate) fn density(&self, view: TexelRect, base: &BasePicture, alpha_mask: bool) -> Option<Grid<f32>> {
        let is_hole = |texel| self.contains(texel) || base.is_closed(view.min + texel, alpha_mask);
        density(view.size(), is_hole)
    }

    /// Opens or closes a hole.
    pub(crate) fn set(&mut self, spans: &[Span], is_gone: bool) {
        let Self { gone, count } = self;
        for &[y, from, to] in spans {
            let row = &mut gone.row_mut(y as usize)[from as usize..to as usize];
            let changed = row.iter().filter(|texel| **texel != is_gone).count() as u64;
            row.fill(is_gone);
            *count = if is_gone { *count + changed } else { *count - changed };
        }
    }
}

/// Makes texels of an image transparent, see [`Holes::cut_out`].
pub(crate) fn cut_span(rgba: &mut [u8], size: UVec2, origin: UVec2, span: Span) {
    if let Some(texels) = rgba.get_mut(texels(size, origin, span)) {
        texels.as_chunks_mut().0.iter_mut().for_each(|[.., alpha]: &mut [u8; 4]| *alpha = 0);
    }
}

/// Where texels of the field lie in an image.
fn texels(size: UVec2, origin: UVec2, [y, from, to]: Span) -> Range<usize> {
    let start = index(size, origin + UVec2::new(from, y));
    start..start + 4 * (to - from) as usize
}

fn index(size: UVec2, texel: UVec2) -> usize {
    4 * (texel.y as usize * size.x as usize + texel.x as usize)
}
