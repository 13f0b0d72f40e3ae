//! The rough line of one segment.

use crate::math::{Rng, hash_unit};
use glam::Vec2;

/// The largest number of points of a [`SegmentPath`].
pub const MAX_PATH_POINTS: usize = 17;

/// A point of a rough line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathPoint {
    /// Position, pattern units.
    pub pos: Vec2,
    /// Width of the crack here, pattern units.
    pub width: f32,
}

/// The line of one segment of a network: 2 to [`MAX_PATH_POINTS`] points, of which the first and the last are its
/// nodes.
///
/// ```
/// use bevy_crack::pattern::{PathPoint, SegmentPath};
///
/// let point = |x, width| PathPoint { pos: [x, 0.5].into(), width };
/// let path = SegmentPath::straight(point(0.2, 0.01), point(0.8, 0.0));
/// assert_eq!(path.points(), [point(0.2, 0.01), point(0.8, 0.0)]);
/// let lower = path.moved([0.0, 0.25].into());
/// assert_eq!(lower.points()[0], PathPoint { pos: [0.2, 0.75].into(), width: 0.01 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentPath {
    points: [PathPoint; MAX_PATH_POINTS],
    len: usize,
}

/// Salts of the draws of a swayed line: horizontal, vertical, the finer ones of both, and for the width. Frozen: a
/// seed must give the same result in every version.
const SWAY_X: u64 = 0x51;
const SWAY_Y: u64 = 0x52;
const FINER: u64 = 0x50;
const WIDTH_WIDE: u64 = 0x53;
const WIDTH_FINE: u64 = 0x54;

impl SegmentPath {
    /// A straight line.
    #[must_use]
    pub fn straight(from: PathPoint, to: PathPoint) -> Self {
        let mut points = [PathPoint::default(); MAX_PATH_POINTS];
        points[0] = from;
        points[1] = to;
        Self { points, len: 2 }
    }

    /// The points, at least two.
    #[must_use]
    pub fn points(&self) -> &[PathPoint] {
        &self.points[..self.len]
    }

    /// The same line, displaced by `by` (pattern units); widths stay.
    #[must_use]
    pub fn moved(mut self, by: Vec2) -> Self {
        for point in &mut self.points[..self.len] {
            point.pos += by;
        }
        self
    }

    /// The same line, displaced by smooth noise of up to `by` (pattern units): lines that meet still meet. Its width
    /// varies too. Points on the border of `0..=extent` stay there.
    #[must_use]
    pub(super) fn swayed(mut self, by: f32, extent: Vec2, seed: u64) -> Self {
        for point in &mut self.points[..self.len] {
            let room = point.pos.min(extent - point.pos).max(Vec2::ZERO);
            let way = |what: u64| {
                let wide = smooth(seed ^ what, point.pos / (18.0 * by));
                0.6 * wide + 0.4 * smooth(seed ^ what ^ FINER, point.pos / (3.5 * by))
            };
            let off = Vec2::new(way(SWAY_X), way(SWAY_Y)) * (room * 0.25).min(Vec2::splat(by));
            let [wide, fine] =
                [(WIDTH_WIDE, 4.0), (WIDTH_FINE, 1.3)].map(|(what, size)| smooth(seed ^ what, point.pos / (size * by)));
            point.width *= (0.9 + 0.45 * wide + 0.35 * fine).clamp(0.2, 1.0);
            point.pos = (point.pos + off).clamp(Vec2::ZERO, extent);
        }
        self
    }

    /// The start of the line, up to a share of its points, 0..=1; the last point lies between two of them.
    #[must_use]
    pub(super) fn up_to(mut self, share: f32) -> Self {
        let last_point = self.len - 1;
        let reach = (share * last_point as f32).clamp(0.0, last_point as f32);
        let whole = reach as usize;
        let part = reach - whole as f32;
        if whole < last_point && (part > 0.0 || whole == 0) {
            let (from, to) = (self.points[whole], self.points[whole + 1]);
            // No wider than the line is further on, so that a growing line only ever adds to its stamp.
            let width = (from.width + (to.width - from.width) * part).min(to.width);
            self.points[whole + 1] = PathPoint { pos: from.pos + (to.pos - from.pos) * part, width };
            self.len = whole + 2;
        } else {
            self.len = whole + 1;
        }
        self
    }
}

/// Smooth noise in `-1..=1` with bumps about one unit wide.
fn smooth(seed: u64, at: Vec2) -> f32 {
    let corner = at.floor();
    let t = at - corner;
    let t = t * t * (Vec2::splat(3.0) - 2.0 * t);
    let (x, y) = (corner.x as i32, corner.y as i32);
    let value = |dx: i32, dy: i32| {
        let (x, y) = (x.wrapping_add(dx) as u32, y.wrapping_add(dy) as u32);
        2.0 * hash_unit(seed, u64::from(x) << 32 | u64::from(y)) - 1.0
    };
    let row = |dy: i32| value(0, dy) + (value(1, dy) - value(0, dy)) * t.x;
    let top = row(0);
    top + (row(1) - top) * t.y
}

/// Length of the pieces of a rough line, about (pattern units): 4 texels of a 512-texel surface, half the length at
/// which the roughness of real cracks is measured.
const PIECE: f32 = 1.0 / 120.0;

/// Largest distance of a kink from the middle of its piece, as a share of the piece's length.
const OFF_MIDDLE: f32 = 0.18;

/// The sharpest kink moves a point across its piece by this many times the roughness.
const SHARPEST: f32 = 1.7;

/// A line between two points by midpoint displacement, kept inside `0..=extent`.
///
/// Each level cuts the pieces in two and moves the new points across the line: mostly by a little, sometimes by up to
/// `1.7 roughness` of the piece's length. The result is straight runs with sharp kinks. Widths are linear between the
/// ends.
pub(super) fn rough_path(
    (from, to): (Vec2, Vec2),
    (w0, w1): (f32, f32),
    roughness: f32,
    extent: Vec2,
    seed: u64,
    salt: u64,
) -> SegmentPath {
    let length = from.distance(to);
    let mut levels = 0;
    while levels < 4 && length > PIECE * (1 << levels) as f32 {
        levels += 1;
    }
    let mut path = SegmentPath::straight(PathPoint { pos: from, width: w0 }, PathPoint { pos: to, width: w1 });
    if roughness <= 0.0 || levels == 0 {
        return path;
    }
    let mut rng = Rng::new(seed).substream(salt);
    let n = 1usize << levels;
    path.points[n] = path.points[1];
    path.len = n + 1;
    let mut span = n;
    while span > 1 {
        let half = span / 2;
        for left in (0..n).step_by(span) {
            let (a, b) = (path.points[left], path.points[left + span]);
            let (kink, along) = (rng.signed(), 0.5 + OFF_MIDDLE * rng.signed());
            let across = (b.pos - a.pos).perp() * (SHARPEST * roughness * kink * kink.abs());
            let pos = (a.pos + (b.pos - a.pos) * along + across).clamp(Vec2::ZERO, extent);
            path.points[left + half] = PathPoint { pos, width: a.width + (b.width - a.width) * along };
        }
        span = half;
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines that meet still meet, no point moves further than allowed, and ends on the border stay there.
    #[test]
    fn lines_sway_together() {
        let (extent, by) = (Vec2::new(1.0, 0.7), 0.006);
        let mut rng = Rng::new(4);
        let mut moved = 0.0f32;
        for salt in 0..200 {
            let mut place = || Vec2::new(rng.unit(), rng.unit()) * extent;
            let (a, b, c) = (place(), place().with_x(0.0), place());
            let line = |ends| rough_path(ends, (0.004, 0.003), 0.1, extent, 9, salt);
            let (first, second) = (line((c, a)).swayed(by, extent, 9), line((a, b)).swayed(by, extent, 9));
            let (Some(meets), Some(end)) = (first.points().last(), second.points().last()) else { panic!("no points") };
            assert_eq!(meets.pos, second.points()[0].pos);
            assert_eq!(end.pos.x, 0.0);
            moved = moved.max(meets.pos.distance(a));
            for (point, was) in first.points().iter().zip(line((c, a)).points()) {
                assert!((point.pos - was.pos).abs().max_element() <= by + 1.0e-6);
                assert!(point.width > 0.19 * was.width && point.width <= was.width);
            }
        }
        assert!(moved > 0.5 * by, "{moved}");
    }
}
