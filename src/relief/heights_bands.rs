//! Between which rings each texel lies: [`Bands`].
//!
//! Crossing a ring adds a number that is the difference of what lies on its two sides. So the sum along a row, from
//! outside of everything, tells each texel its band and which rings bound it.

use super::contours::{Contours, Ring};
use glam::Vec2;

/// The band of a texel: the ground between two levels, in a region that rings bound.
///
/// Bits 0..16: the level of the lower side, plus [`Band::OFFSET`]. Bit 20: rings above bound the region. Bit 24: rings
/// below bound it. If rings cross each other, the sum is that of no band; it is then read as one that may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Band(pub(super) i32);

impl Band {
    const OFFSET: i32 = 0x4000;

    fn new(lower: i32, has_upper: bool, has_lower: bool) -> Self {
        Self((lower + Self::OFFSET) | i32::from(has_upper) << 20 | i32::from(has_lower) << 24)
    }

    /// The level of the lower side.
    #[inline(always)]
    pub(super) fn lower(self) -> i32 {
        (self.0 & 0xFFFF) - Self::OFFSET
    }

    /// Whether there are rings at the upper side of its region.
    #[inline(always)]
    pub(super) fn has_upper(self) -> bool {
        self.0 & 1 << 20 != 0
    }

    /// Whether there are rings at the lower side of its region.
    #[inline(always)]
    pub(super) fn has_lower(self) -> bool {
        self.0 & 1 << 24 != 0
    }
}

/// A side of a ring that texel centers can lie on either side of: a segment that is not level, and what is added where
/// it is crossed from left to right.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    top: [f32; 2],
    bottom: [f32; 2],
    gain: i32,
}

/// The rings of all levels, ready to tell texels their bands.
#[derive(Clone, Debug)]
pub(super) struct Bands {
    outside: Band,
    crossings: Vec<Crossing>,
}

/// A ring and the box around it.
struct Boxed<'a> {
    ring: &'a Ring,
    min: Vec2,
    max: Vec2,
    area: f64,
}

impl<'a> Boxed<'a> {
    fn new(ring: &'a Ring) -> Self {
        let bound = |pick: fn(Vec2, Vec2) -> Vec2| ring.points.iter().copied().reduce(pick).unwrap_or_default();
        Self { ring, min: bound(Vec2::min), max: bound(Vec2::max), area: ring.signed_area() }
    }

    fn encloses(&self, point: Vec2) -> bool {
        if point.cmplt(self.min).any() || point.cmpgt(self.max).any() {
            return false;
        }
        let points = &self.ring.points;
        let mut is_inside = false;
        let mut last = points[points.len() - 1];
        for &next in points {
            if (last.y > point.y) != (next.y > point.y) {
                let x = last.x + (point.y - last.y) * ((next.x - last.x) / (next.y - last.y));
                is_inside ^= point.x < x;
            }
            last = next;
        }
        is_inside
    }
}

/// The ring around each ring that bounds the ground outside of it; `None` if there is none.
fn parents(rings: &[Boxed]) -> Vec<Option<usize>> {
    let least = rings.iter().map(|boxed| boxed.ring.level).min().unwrap_or(0);
    let most = rings.iter().map(|boxed| boxed.ring.level).max().unwrap_or(0);
    let mut levels = vec![Vec::new(); (most - least + 1) as usize];
    for (i, boxed) in rings.iter().enumerate() {
        levels[(boxed.ring.level - least) as usize].push(i);
    }
    let of_level = |level: i32| {
        usize::try_from(level - least).ok().and_then(|level| levels.get(level)).map_or(&[][..], Vec::as_slice)
    };
    let parent = |(i, inner): (usize, &Boxed)| {
        let (level, point) = (inner.ring.level, inner.ring.points[0]);
        // Level ground around a ring is bounded by a ring of the level below, or by a hole of its own level; around a
        // hole, by a ring of its own level or by a hole of the level above.
        let (rings_at, holes_at) = if inner.area < 0.0 { (level, level + 1) } else { (level - 1, level) };
        let around = of_level(rings_at).iter().filter(|&&j| rings[j].area >= 0.0);
        let holes = of_level(holes_at).iter().filter(|&&j| rings[j].area < 0.0);
        let larger = around.chain(holes).copied().filter(|&j| j != i && rings[j].area.abs() > inner.area.abs());
        larger
            .filter(|&j| rings[j].encloses(point))
            .min_by(|&a, &b| rings[a].area.abs().total_cmp(&rings[b].area.abs()))
    };
    rings.iter().enumerate().map(parent).collect()
}

impl Bands {
    pub(super) fn new(contours: &Contours, texels_per_unit: f32) -> Self {
        let rings: Vec<_> = contours.rings.iter().map(Boxed::new).collect();
        let parents = parents(&rings);
        let mut has_upper: Vec<_> = rings.iter().map(|boxed| boxed.area < 0.0).collect();
        let mut has_lower: Vec<_> = rings.iter().map(|boxed| boxed.area >= 0.0).collect();
        for (inner, &parent) in rings.iter().zip(&parents) {
            let Some(parent) = parent else { continue };
            if inner.area < 0.0 {
                has_lower[parent] = true;
            } else {
                has_upper[parent] = true;
            }
        }
        let lowest = contours.levels().map_or(0, |(lowest, _)| lowest);
        let outside = Band::new(lowest - 1, true, false);
        let inside = |i: usize| {
            let level = rings[i].ring.level;
            Band::new(if rings[i].area < 0.0 { level - 1 } else { level }, has_upper[i], has_lower[i])
        };
        let mut bands = Self { outside, crossings: Vec::new() };
        for (i, boxed) in rings.iter().enumerate() {
            // Without a ring around it the ground outside is taken for that of everything, whatever the level.
            let gain = inside(i).0 - parents[i].map_or(outside, inside).0;
            bands.add_ring(boxed, gain, texels_per_unit);
        }
        bands
    }

    fn add_ring(&mut self, boxed: &Boxed, gain: i32, texels_per_unit: f32) {
        let points = &boxed.ring.points;
        let mut last = points[points.len() - 1] * texels_per_unit;
        for &next in points {
            let next = next * texels_per_unit;
            if (last.y - 0.5).ceil() != (next.y - 0.5).ceil() {
                // The left side of a ring with positive area runs up.
                let enters = (next.y < last.y) == (boxed.area >= 0.0);
                let [top, bottom] = if last.y < next.y { [last, next] } else { [next, last] };
                let gain = if enters { gain } else { -gain };
                self.crossings.push(Crossing { top: top.to_array(), bottom: bottom.to_array(), gain });
            }
            last = next;
        }
    }

    /// Writes the bands of the rows from `first` on, of `width` texels each.
    pub(super) fn fill(&self, first: usize, width: usize, out: &mut [i32]) {
        out.fill(0);
        let rows = out.len() / width;
        for crossing in &self.crossings {
            let ([x, y], [end_x, end_y]) = (crossing.top, crossing.bottom);
            // Rows whose centers lie in top..bottom.
            let row = |y: f32| ((y - 0.5).ceil() as i64 - first as i64).clamp(0, rows as i64) as usize;
            let slope = (f64::from(end_x) - f64::from(x)) / (f64::from(end_y) - f64::from(y));
            for row in row(y)..row(end_y) {
                let center = (first + row) as f64 + 0.5;
                let column = (f64::from(x) + (center - f64::from(y)) * slope - 0.5).ceil().max(0.0) as usize;
                if column < width {
                    let sum = &mut out[row * width + column];
                    *sum = sum.wrapping_add(crossing.gain);
                }
            }
        }
        for row in out.chunks_exact_mut(width) {
            let mut band = self.outside.0;
            for out in row {
                band = band.wrapping_add(*out);
                *out = band;
            }
        }
    }
}
