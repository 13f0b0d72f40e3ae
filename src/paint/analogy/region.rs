//! [`Region`]: any set of texels, as spans of rows.

use crate::raster::TexelRect;
use glam::UVec2;

/// Texels `start..end` of row `y`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Span {
    pub(super) y: u32,
    pub(super) start: u32,
    pub(super) end: u32,
}

/// Spans in the order of rows and columns; they neither overlap nor touch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Region(Vec<Span>);

impl Region {
    pub(super) const NONE: Self = Self(Vec::new());

    pub(super) fn new(mut spans: Vec<Span>) -> Self {
        spans.retain(|span| span.start < span.end);
        spans.sort_unstable();
        let mut merged: Vec<Span> = Vec::with_capacity(spans.len());
        for span in spans {
            match merged.last_mut() {
                Some(last) if last.y == span.y && span.start <= last.end => last.end = last.end.max(span.end),
                _ => merged.push(span),
            }
        }
        Self(merged)
    }

    pub(super) fn whole(size: UVec2) -> Self {
        Self((0..size.y).map(|y| Span { y, start: 0, end: size.x }).collect())
    }

    pub(super) fn spans(&self) -> &[Span] {
        &self.0
    }

    pub(super) fn area(&self) -> u64 {
        self.0.iter().map(|span| u64::from(span.end - span.start)).sum()
    }

    /// The texels of the level of half the size that cover these.
    pub(super) fn halved(&self) -> Self {
        let half = |span: &Span| Span { y: span.y / 2, start: span.start / 2, end: span.end.div_ceil(2) };
        Self::new(self.0.iter().map(half).collect())
    }

    /// All texels at most `by` columns and rows away, within `size` or around its borders.
    pub(super) fn grown(&self, by: u32, size: UVec2, wraps: bool) -> Self {
        let (w, h, by) = (i64::from(size.x), i64::from(size.y), i64::from(by));
        let mut spans = Vec::new();
        let mut add = |y: i64, start: i64, end: i64| {
            let (start, end) = (start.clamp(0, w), end.clamp(0, w));
            if start < end {
                spans.push(Span { y: y as u32, start: start as u32, end: end as u32 });
            }
        };
        for span in &self.0 {
            let (start, end) = (i64::from(span.start) - by, i64::from(span.end) + by);
            for y in i64::from(span.y) - by..=i64::from(span.y) + by {
                if wraps {
                    let y = y.rem_euclid(h);
                    add(y, start, end);
                    // What passes a border, at most once around.
                    add(y, start + w, (end + w).min(start + 2 * w));
                    add(y, (start - w).max(end - 2 * w), end - w);
                } else if (0..h).contains(&y) {
                    add(y, start, end);
                }
            }
        }
        Self::new(spans)
    }

    /// Rectangles that cover the region without overlap: runs of tiles of `2^log_side` texels a side, cut at the border
    /// of `size`.
    pub(super) fn tiles(&self, log_side: u32, size: UVec2) -> Vec<TexelRect> {
        let mut tiles = self.clone();
        for _ in 0..log_side {
            tiles = tiles.halved();
        }
        let rect = |span: &Span| {
            let (min, max) = (UVec2::new(span.start, span.y) << log_side, UVec2::new(span.end, span.y + 1) << log_side);
            TexelRect { min, max: max.min(size) }
        };
        tiles.0.iter().map(rect).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// Against the texels themselves.
    #[test]
    fn regions_hold_the_texels_that_they_should() {
        let mut rng = Rng::new(3);
        for case in 0..300 {
            let size = UVec2::new(1 + rng.next_u32() % 20, 1 + rng.next_u32() % 20);
            let flags: Vec<bool> = (0..size.x * size.y).map(|_| rng.unit() < 0.06).collect();
            let has = |x: i64, y: i64| flags[(y * i64::from(size.x) + x) as usize];
            let all = |size: UVec2| (0..size.y).flat_map(move |y| (0..size.x).map(move |x| (x, y)));
            let set = |region: &Region| -> Vec<(u32, u32)> {
                region.spans().iter().flat_map(|span| (span.start..span.end).map(|x| (x, span.y))).collect()
            };
            let span = |(x, y): (u32, u32)| Span { y, start: x, end: x + 1 };
            let region = Region::new(all(size).filter(|&(x, y)| has(x.into(), y.into())).map(span).collect());
            let (by, wraps) = (rng.next_u32() % 4, case % 2 == 0);
            let near = |&(x, y): &(u32, u32)| {
                let by = i64::from(by);
                (-by..=by).any(|dy| {
                    (-by..=by).any(|dx| {
                        let (u, v) = (i64::from(x) + dx, i64::from(y) + dy);
                        let (w, h) = (i64::from(size.x), i64::from(size.y));
                        if wraps {
                            has(u.rem_euclid(w), v.rem_euclid(h))
                        } else {
                            (0..w).contains(&u) && (0..h).contains(&v) && has(u, v)
                        }
                    })
                })
            };
            let want: Vec<_> = all(size).filter(near).collect();
            let grown = region.grown(by, size, wraps);
            assert_eq!(set(&grown), want, "{size} by {by}, wraps {wraps}");
            assert_eq!(grown.area(), want.len() as u64);
            let half = size.map(|side| side.div_ceil(2));
            let covers =
                |&(x, y): &(u32, u32)| all(size).any(|(u, v)| (u / 2, v / 2) == (x, y) && has(u.into(), v.into()));
            assert_eq!(set(&region.halved()), all(half).filter(covers).collect::<Vec<_>>());
            let rects = grown.tiles(rng.next_u32() % 4, size);
            for (x, y) in want {
                let at = UVec2::new(x, y);
                let hits = rects.iter().filter(|rect| at.cmpge(rect.min).all() && at.cmplt(rect.max).all()).count();
                assert_eq!(hits, 1);
            }
        }
        assert_eq!(set_area(UVec2::new(7, 5)), 35);
    }

    fn set_area(size: UVec2) -> u64 {
        Region::whole(size).area()
    }
}
