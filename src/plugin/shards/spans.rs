//! The texels of shards.

use crate::Grid;
use crate::pattern::SurfaceFrame;
use crate::plugin::surface::cutouts::Span;
use crate::raster::TexelRect;
use crate::shatter::Shards;
use bevy::prelude::*;

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

/// How far from a piece texels go with it that are no piece's, texels: so far away parallax and filtering find them. Charts lie eight apart, and the
/// one beside keeps two of them.
const FRINGE: u32 = 6;

/// The texels of a mesh that is laid out that are no piece's, but shown at the border of one: those around it, and splinters of it that have become
/// part of what lies beside it, `gaps`.
pub(super) fn fringe(cut: &Shards, gaps: &[u32], frame: SurfaceFrame) -> Grid<bool> {
    let mut fringe = Grid::new(frame.size(), false);
    let (mut scan, mut spans) = (Scan::new(frame), Vec::new());
    gaps.iter().for_each(|gap| scan.find(cut, *gap, &mut spans));
    for [y, from, to] in spans {
        fringe.row_mut(y as usize)[from as usize..to as usize].fill(true);
    }
    fringe
}

/// Adds to the texels of a piece those of the fringe beside it.
pub(super) fn add_fringe(spans: &mut Vec<Span>, fringe: &Grid<bool>) {
    let size = fringe.size();
    for i in 0..spans.len() {
        let [y, from, to] = spans[i];
        let (left, right) = (from.saturating_sub(FRINGE), (to + FRINGE).min(size.x));
        for row in y.saturating_sub(FRINGE)..(y + FRINGE + 1).min(size.y) {
            let beside = fringe.row(row as usize)[left as usize..right as usize].iter();
            spans.extend((left..).zip(beside).filter(|(_, is)| **is).map(|(x, _)| [row, x, x + 1]));
        }
    }
    spans.sort_unstable();
    spans.dedup();
}

/// Puts spans in order, and makes one of those that touch.
pub(super) fn join_spans(spans: &mut Vec<Span>) {
    spans.sort_unstable();
    spans.dedup_by(|[y, from, to], [last_y, _, end]| {
        let touches = y == last_y && *from <= *end;
        if touches {
            *end = (*end).max(*to);
        }
        touches
    });
}

/// The texels around a shard, and those of its fringe.
pub(super) fn bounds(shards: &Shards, shard: u32, frame: SurfaceFrame) -> TexelRect {
    let places = shards.outline(shard).iter().map(|&corner| frame.to_texel(shards.positions()[corner as usize]));
    let (min, max) = places.fold((Vec2::INFINITY, Vec2::ZERO), |(min, max), at| (min.min(at), max.max(at)));
    let rect = TexelRect { min: min.max(Vec2::ZERO).as_uvec2(), max: max.ceil().as_uvec2() };
    rect.grow(FRINGE, frame.size()).intersect(TexelRect::whole(frame.size()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::Rng,
        plugin::surface::cutouts::Holes,
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
            let shards = shatter(cuts, &ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT }).unwrap();
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
