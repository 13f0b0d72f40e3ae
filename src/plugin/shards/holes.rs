//! [`Holes`]: the texels that have left a surface.

use crate::{
    Grid,
    pattern::SurfaceFrame,
    plugin::picture::{BasePicture, density},
    raster::TexelRect,
    shatter::Shards,
};
use bevy::prelude::*;
use core::ops::Range;

/// The texels that have left a surface with its shards.
#[derive(Clone)]
pub(in crate::plugin) struct Holes {
    gone: Grid<bool>,
    count: u64,
}

/// Texels beside each other: y, first x, and the x after the last.
pub(super) type Span = [u32; 3];

impl Holes {
    pub(super) fn new(size: UVec2) -> Self {
        Self { gone: Grid::new(size, false), count: 0 }
    }

    /// Whether the texel is one.
    pub(in crate::plugin) fn contains(&self, texel: UVec2) -> bool {
        self.gone.get(texel.x, texel.y).unwrap_or(false)
    }

    /// Whether there are any.
    pub(in crate::plugin) fn is_any(&self) -> bool {
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
    pub(in crate::plugin) fn cut_out(&self, rgba: &mut [u8], size: UVec2, origin: UVec2, rect: TexelRect) {
        if self.is_any() {
            self.for_each_run(rect, true, |span| cut_span(rgba, size, origin, span));
        }
    }

    /// Copies what is there in `rect` of the field from one image to another of the same size.
    pub(super) fn copy_present(&self, from: &[u8], to: &mut [u8], size: UVec2, origin: UVec2, rect: TexelRect) {
        self.for_each_run(rect, false, |span| {
            let texels = texels(size, origin, span);
            if let (Some(from), Some(to)) = (from.get(texels.clone()), to.get_mut(texels)) {
                to.copy_from_slice(from);
            }
        });
    }

    /// Where cracks may go on a surface that shows `view` of a picture, if its holes matter: not over any hole. `None` = everywhere.
    pub(in crate::plugin) fn density(&self, view: TexelRect, base: Option<&BasePicture>) -> Option<Grid<f32>> {
        let is_hole = |texel| self.contains(texel) || base.is_some_and(|base| base.is_hole(view.min + texel));
        density(view.size(), is_hole)
    }

    /// Opens or closes a hole.
    pub(super) fn set(&mut self, spans: &[Span], is_gone: bool) {
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
pub(super) fn cut_span(rgba: &mut [u8], size: UVec2, origin: UVec2, span: Span) {
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

/// Finds the texels of shards. Each lies in exactly one of the shards that tile a surface.
pub(super) struct Scan {
    frame: SurfaceFrame,
    /// Where outlines cross the middles of rows: y, and the first texel beyond, as one number.
    crossings: Vec<u64>,
}

impl Scan {
    pub(super) const fn new(frame: SurfaceFrame) -> Self {
        Self { frame, crossings: Vec::new() }
    }

    /// Adds the texels whose centres lie in a shard, row by row.
    pub(super) fn find(&mut self, shards: &Shards, shard: u32, spans: &mut Vec<Span>) {
        let texel = |corner: u32| self.frame.to_texel(shards.positions()[corner as usize]).as_dvec2();
        let size = self.frame.size();
        // Of what lies at `at`, the first centre there or beyond.
        let first = |at: f64, most: u32| (at - 0.5).ceil().clamp(0.0, f64::from(most)) as u32;
        self.crossings.clear();
        for ring in core::iter::once(shards.outline(shard)).chain(shards.holes(shard)) {
            let Some(&last) = ring.last() else { continue };
            let mut a = texel(last);
            for &corner in ring {
                let b = texel(corner);
                // From above to below, so that both shards of an edge find the same crossing.
                let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
                self.crossings.extend((first(low.y, size.y)..first(high.y, size.y)).map(|y| {
                    let height = f64::from(y) + 0.5;
                    let x = low.x + (height - low.y) / (high.y - low.y) * (high.x - low.x);
                    u64::from(y) << 32 | u64::from(first(x, size.x))
                }));
                a = b;
            }
        }
        self.crossings.sort_unstable();
        // Of each row an even number.
        let pairs = self.crossings.as_chunks::<2>().0.iter();
        let found = pairs.map(|[from, to]| [(from >> 32) as u32, *from as u32, *to as u32]);
        spans.extend(found.filter(|[_, start, end]| start < end));
    }
}

/// The texels whose centres lie in a shard, row by row.
pub(super) fn spans_of(shards: &Shards, shard: u32, frame: SurfaceFrame) -> Vec<Span> {
    let mut spans = Vec::new();
    Scan::new(frame).find(shards, shard, &mut spans);
    spans
}

/// Puts spans in order, and makes one of those that touch.
pub(super) fn join_spans(spans: &mut Vec<Span>) {
    spans.sort_unstable();
    spans.dedup_by(|[y, from, to], [last_y, _, end]| {
        let touches = y == last_y && from == end;
        if touches {
            *end = *to;
        }
        touches
    });
}

/// The texels around a shard.
pub(super) fn bounds(shards: &Shards, shard: u32, frame: SurfaceFrame) -> TexelRect {
    let places = shards.outline(shard).iter().map(|&corner| frame.to_texel(shards.positions()[corner as usize]));
    let (min, max) = places.fold((Vec2::INFINITY, Vec2::ZERO), |(min, max), at| (min.min(at), max.max(at)));
    let rect = TexelRect { min: min.max(Vec2::ZERO).as_uvec2(), max: max.ceil().as_uvec2() };
    rect.intersect(TexelRect::whole(frame.size()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::Rng,
        shatter::{Cuts, ShatterParams, shatter},
    };

    #[test]
    fn every_texel_lies_in_one_shard() {
        let frame = SurfaceFrame::new(UVec2::new(90, 60)).unwrap();
        let mut rng = Rng::new(5);
        for _ in 0..50 {
            let mut cuts = Cuts::new(frame.extent()).unwrap();
            for _ in 0..12 {
                let mut place = || {
                    let at = Vec2::new(rng.unit(), rng.unit()) * frame.extent();
                    // Through the centres of texels, too.
                    if rng.unit() < 0.5 { ((at * 60.0).floor() + 0.5) / 60.0 } else { at }
                };
                let line = [place(), place()];
                cuts.add_line(&line).unwrap();
            }
            let shards = shatter(cuts, &ShatterParams { carry_on: true, ..ShatterParams::DEFAULT }).unwrap();
            let mut covered = Grid::new(frame.size(), 0u8);
            let (mut holes, mut all) = (Holes::new(frame.size()), Vec::new());
            for shard in 0..shards.len() as u32 {
                let spans = spans_of(&shards, shard, frame);
                for &[y, from, to] in &spans {
                    covered.row_mut(y as usize)[from as usize..to as usize].iter_mut().for_each(|n| *n += 1);
                }
                holes.set(&spans, true);
                all.extend(spans);
            }
            join_spans(&mut all);
            assert_eq!(all, (0..60).map(|y| [y, 0, 90]).collect::<Vec<Span>>());
            assert!(covered.as_slice().iter().all(|n| *n == 1), "{} shards", shards.len());
            assert_eq!(holes.count, 90 * 60);
            for shard in (0..shards.len() as u32).rev() {
                holes.set(&spans_of(&shards, shard, frame), false);
            }
            assert!(holes.count == 0 && !holes.gone.as_slice().contains(&true));
        }
    }

    #[test]
    fn only_holes_become_transparent_and_only_the_rest_is_copied() {
        let frame = SurfaceFrame::new(UVec2::splat(4)).unwrap();
        let mut cuts = Cuts::new(frame.extent()).unwrap();
        cuts.add_line(&[Vec2::new(0.5, 0.0), Vec2::new(0.5, 1.0)]).unwrap();
        let shards = shatter(cuts, &ShatterParams::DEFAULT).unwrap();
        let left = shards.at(Vec2::new(0.2, 0.5)).unwrap();
        let mut holes = Holes::new(frame.size());
        holes.set(&spans_of(&shards, left, frame), true);
        // A frame in an atlas.
        let (size, origin, whole) = (UVec2::new(10, 6), UVec2::new(3, 1), TexelRect::whole(frame.size()));
        let mut image = vec![200; 240];
        holes.cut_out(&mut image, size, origin, whole);
        let mut copy = vec![0; 240];
        holes.copy_present(&image, &mut copy, size, origin, whole);
        for y in 0..6 {
            for x in 0..10 {
                let (i, inside) = (4 * (10 * y + x), (1..5).contains(&y) && (3..7).contains(&x));
                let expected = if inside && x < 5 { 0 } else { 200 };
                assert_eq!(image[i..i + 4], [200, 200, 200, expected], "{x} {y}");
                assert_eq!(copy[i], if inside && x >= 5 { 200 } else { 0 }, "{x} {y}");
            }
        }
    }
}
