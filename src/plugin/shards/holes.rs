//! [`Holes`]: the texels that have left a surface.

use crate::{Grid, pattern::SurfaceFrame, raster::TexelRect, shatter::Shards};
use bevy::prelude::*;

/// The texels that have left a surface with its shards.
pub(in crate::plugin) struct Holes {
    gone: Grid<bool>,
    count: u64,
}

impl Holes {
    pub(super) fn new(size: UVec2) -> Self {
        Self { gone: Grid::new(size, false), count: 0 }
    }

    /// Whether the texel is one.
    pub(in crate::plugin) fn contains(&self, texel: UVec2) -> bool {
        self.gone.get(texel.x, texel.y).unwrap_or(false)
    }

    /// Texels in the rows of a rectangle that are gone: y, and the x of each.
    fn texels(&self, rect: TexelRect) -> impl Iterator<Item = UVec2> + '_ {
        let is_any = self.count > 0;
        (rect.min.y..if is_any { rect.max.y } else { rect.min.y })
            .flat_map(move |y| (rect.min.x..rect.max.x).map(move |x| UVec2::new(x, y)))
            .filter(|texel| self.contains(*texel))
    }

    /// Makes the holes in `rect` of the field transparent in the RGBA texels of an image of `size`, where the field lies at `origin`.
    pub(in crate::plugin) fn cut_out(&self, rgba: &mut [u8], size: UVec2, origin: UVec2, rect: TexelRect) {
        for texel in self.texels(rect) {
            if let Some(alpha) = rgba.get_mut(index(size, origin + texel) + 3) {
                *alpha = 0;
            }
        }
    }

    /// Copies what is there in `rect` of the field from one image to another of the same size.
    pub(super) fn copy_present(&self, from: &[u8], to: &mut [u8], size: UVec2, origin: UVec2, rect: TexelRect) {
        for y in rect.min.y..rect.max.y {
            for x in rect.min.x..rect.max.x {
                let texel = UVec2::new(x, y);
                let start = index(size, origin + texel);
                if !self.contains(texel)
                    && let (Some(from), Some(to)) = (from.get(start..start + 4), to.get_mut(start..start + 4))
                {
                    to.copy_from_slice(from);
                }
            }
        }
    }

    /// Opens or closes the hole of a shard.
    pub(super) fn set(&mut self, shards: &Shards, shard: u32, frame: SurfaceFrame, is_gone: bool) {
        let Self { gone, count } = self;
        for_each_span(shards, shard, frame, |y, from, to| {
            for texel in &mut gone.row_mut(y as usize)[from as usize..to as usize] {
                if core::mem::replace(texel, is_gone) != is_gone {
                    *count = if is_gone { *count + 1 } else { *count - 1 };
                }
            }
        });
    }
}

fn index(size: UVec2, texel: UVec2) -> usize {
    4 * (texel.y as usize * size.x as usize + texel.x as usize)
}

/// The texels whose centres lie in a shard, row by row: y, first x, and the x after the last. Each texel lies in exactly one of the
/// shards that tile a surface.
pub(super) fn for_each_span(shards: &Shards, shard: u32, frame: SurfaceFrame, mut span: impl FnMut(u32, u32, u32)) {
    let texel = |corner: u32| frame.to_texel(shards.positions()[corner as usize]).as_dvec2();
    let size = frame.size();
    // Where outlines cross the middles of rows.
    let mut crossings = Vec::new();
    for ring in core::iter::once(shards.outline(shard)).chain(shards.holes(shard)) {
        let Some(&last) = ring.last() else { continue };
        let mut a = texel(last);
        for &corner in ring {
            let b = texel(corner);
            // From above to below, so that both shards of an edge find the same crossing.
            let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
            let rows = [low.y, high.y].map(|y| (y - 0.5).ceil().clamp(0.0, f64::from(size.y)) as u32);
            crossings.extend((rows[0]..rows[1]).map(|y| {
                let height = f64::from(y) + 0.5;
                (y, low.x + (height - low.y) / (high.y - low.y) * (high.x - low.x))
            }));
            a = b;
        }
    }
    crossings.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    // Of each row an even number.
    for [from, to] in crossings.as_chunks::<2>().0 {
        // The first centre at or beyond the crossing.
        let columns = [from.1, to.1].map(|x| (x - 0.5).ceil().clamp(0.0, f64::from(size.x)) as u32);
        if columns[0] < columns[1] {
            span(from.0, columns[0], columns[1]);
        }
    }
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
            let mut holes = Holes::new(frame.size());
            for shard in 0..shards.len() as u32 {
                for_each_span(&shards, shard, frame, |y, from, to| {
                    covered.row_mut(y as usize)[from as usize..to as usize].iter_mut().for_each(|n| *n += 1);
                });
                holes.set(&shards, shard, frame, true);
            }
            assert!(covered.as_slice().iter().all(|n| *n == 1), "{} shards", shards.len());
            assert_eq!(holes.count, 90 * 60);
            for shard in (0..shards.len() as u32).rev() {
                holes.set(&shards, shard, frame, false);
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
        holes.set(&shards, left, frame, true);
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
