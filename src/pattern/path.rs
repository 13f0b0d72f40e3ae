//! The rough line of one segment.

use crate::math::{Rng, hash_unit};
use glam::Vec2;

/// The most points that a [`SegmentPath`] has.
pub const MAX_PATH_POINTS: usize = 17;

/// A point of a rough line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathPoint {
    /// Position, pattern units.
    pub pos: Vec2,
    /// Width of the crack here, pattern units.
    pub width: f32,
}

/// The line that stands for one segment of a network: 2 to [`MAX_PATH_POINTS`] points, the first and last being its nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentPath {
    points: [PathPoint; MAX_PATH_POINTS],
    len: usize,
}

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

    /// The same line, `by` further on (pattern units); widths stay.
    #[must_use]
    pub fn moved(mut self, by: Vec2) -> Self {
        for point in &mut self.points[..self.len] {
            point.pos += by;
        }
        self
    }

    /// The line up to a share of its points, 0..=1, the last one between two of them.
    #[must_use]
    pub(super) fn up_to(mut self, share: f32) -> Self {
        let last_point = self.len - 1;
        let reach = (share * last_point as f32).clamp(0.0, last_point as f32);
        let whole = reach as usize;
        let part = reach - whole as f32;
        if whole < last_point && (part > 0.0 || whole == 0) {
            let (from, to) = (self.points[whole], self.points[whole + 1]);
            // No wider than the line will be further on, so that a line that gets longer only ever adds to its stamp.
            let width = (from.width + (to.width - from.width) * part).min(to.width);
            self.points[whole + 1] = PathPoint { pos: from.pos + (to.pos - from.pos) * part, width };
            self.len = whole + 2;
        } else {
            self.len = whole + 1;
        }
        self
    }
}

/// Pieces of a rough line are about this long (pattern units): 8 texels of a 512-texel surface, the length at which
/// the roughness of real cracks is measured.
const PIECE: f32 = 1.0 / 72.0;

/// A line from one point to the other by midpoint displacement, kept inside `0..=extent`.
///
/// Each level halves the pieces and moves the new points across the line by up to `roughness` of the piece's length.
/// Widths vary by up to a third on the way.
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
    let mut rng = Rng::new(seed).nth(salt);
    let n = 1usize << levels;
    path.points[n] = path.points[1];
    path.len = n + 1;
    let mut span = n;
    while span > 1 {
        let half = span / 2;
        for left in (0..n).step_by(span) {
            let (a, b) = (path.points[left], path.points[left + span]);
            let across = (b.pos - a.pos).perp() * (roughness * rng.signed());
            let pos = ((a.pos + b.pos) * 0.5 + across).clamp(Vec2::ZERO, extent);
            path.points[left + half] = PathPoint { pos, width: 0.0 };
        }
        span = half;
    }
    for i in 1..n {
        let t = i as f32 / n as f32;
        let vary = 1.0 + 0.66 * (hash_unit(seed ^ salt, i as u64) - 0.5);
        path.points[i].width = (w0 + (w1 - w0) * t) * vary;
    }
    path
}
