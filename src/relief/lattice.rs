//! [`Lattice`]: the whole numbers on which contour lines are computed.

use glam::Vec2;

/// A place on the lattice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Point {
    pub(super) x: i32,
    pub(super) y: i32,
}

/// A closed line on the lattice; the last point is joined to the first.
pub(super) type Loop = Vec<Point>;

impl Point {
    pub(super) const fn new(x: i32, y: i32) -> Self {
        Self { x, y }
    }

    /// The lattice point nearest to a place. Places beyond all that a lattice holds go to its border.
    pub(super) fn round(x: f64, y: f64) -> Self {
        const FARTHEST: f64 = (1 << 28) as f64;
        let whole = |v: f64| {
            let v = (v + 0.5).clamp(-FARTHEST, FARTHEST);
            // The largest whole number up to it; `floor` is a call on old processors.
            let cut = v as i32;
            cut - i32::from(f64::from(cut) > v)
        };
        Self { x: whole(x), y: whole(y) }
    }

    /// As floating-point numbers, which is exact.
    pub(super) fn place(self) -> [f64; 2] {
        [f64::from(self.x), f64::from(self.y)]
    }

    /// From `self` to `other`.
    pub(super) fn to(self, other: Self) -> [i64; 2] {
        [i64::from(other.x) - i64::from(self.x), i64::from(other.y) - i64::from(self.y)]
    }

    /// One number for both coordinates, in the order of points: by x, then by y.
    pub(super) const fn rank(self) -> i64 {
        ((self.x as i64) << 32) + self.y as i64
    }

    pub(super) fn distance(self, other: Self) -> f64 {
        let [x, y] = self.to(other);
        ((x * x + y * y) as f64).sqrt()
    }
}

/// Positive where `v` turns from `u` as the corners of a ring with a positive area do.
pub(super) const fn cross(u: [i64; 2], v: [i64; 2]) -> i64 {
    u[0] * v[1] - u[1] * v[0]
}

pub(super) const fn dot(u: [i64; 2], v: [i64; 2]) -> i64 {
    u[0] * v[0] + u[1] * v[1]
}

/// Pairs of a point and the next one, round the loop.
pub(super) fn edges(points: &[Point]) -> impl Iterator<Item = (Point, Point)> + '_ {
    let (first, others) = points.split_at(points.len().min(1));
    points.iter().copied().zip(others.iter().chain(first).copied())
}

/// Twice the area inside, positive or negative, exact.
pub(super) fn double_area(points: &[Point]) -> i128 {
    let Some(&first) = points.first() else { return 0 };
    points.windows(2).map(|pair| i128::from(cross(first.to(pair[0]), first.to(pair[1])))).sum()
}

/// The longer side of the rectangle around a loop.
pub(super) fn size(points: &[Point]) -> f64 {
    let Some(&first) = points.first() else { return 0.0 };
    let (low, high) = points.iter().fold((first, first), |(low, high), point| {
        (Point::new(low.x.min(point.x), low.y.min(point.y)), Point::new(high.x.max(point.x), high.y.max(point.y)))
    });
    let [x, y] = low.to(high);
    x.max(y) as f64
}

/// Length of the loop.
pub(super) fn perimeter(points: &[Point]) -> f64 {
    edges(points).map(|(a, b)| a.distance(b)).sum()
}

/// Places in pattern space that are whole multiples of a power of two.
///
/// Whole numbers up to 2²⁴ times a power of two are exact as `f32`, so rings go to pattern space and back without a
/// change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    /// Lattice steps per pattern unit.
    steps: f64,
}

impl Lattice {
    /// The finest lattice that holds all places up to `reach` from the origin.
    pub(super) fn new(reach: f64) -> Self {
        const MOST: f64 = (1 << 23) as f64;
        let mut steps = 1.0;
        while reach * steps > MOST {
            steps *= 0.5;
        }
        while reach * steps * 2.0 <= MOST && steps < 1e30 {
            steps *= 2.0;
        }
        Self { steps }
    }

    /// Lattice steps per pattern unit.
    pub(super) const fn steps(self) -> f64 {
        self.steps
    }

    /// The nearest lattice point.
    pub(super) fn point(self, pos: Vec2) -> Point {
        Point::round(f64::from(pos.x) * self.steps, f64::from(pos.y) * self.steps)
    }

    /// The place of a lattice point.
    pub(super) fn pos(self, point: Point) -> Vec2 {
        let [x, y] = point.place();
        Vec2::new((x / self.steps) as f32, (y / self.steps) as f32)
    }
}
