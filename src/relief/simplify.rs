//! Drops corners in nearly straight lines.

use super::lattice::{Loop, Point, double_area};

/// A loop without those corners that lie within `tolerance` of a line between corners that stay.
///
/// One pass over the corners: from the last corner that stays, the directions that pass all corners since near enough
/// form a wedge, and the line goes on as long as its end lies in the wedge (the sleeve of Zhao and Saalfeld 1997). The pass starts at the
/// corner with the smallest x, which stays, so it does not matter where the loop starts. The result may cross itself.
pub(super) fn simplified(points: &[Point], tolerance: f64) -> Loop {
    let Some(first) = first_along_x(points) else { return Loop::new() };
    let mut out = Loop::with_capacity(points.len());
    out.push(points[first]);
    let mut wedge = Wedge::new(points[first]);
    let mut last = points[first];
    for &point in points[first + 1..].iter().chain(&points[..=first]) {
        let mut way = wedge.to(point);
        if !wedge.holds(way) {
            out.push(last);
            wedge = Wedge::new(last);
            way = wedge.to(point);
        }
        wedge.narrow(way, tolerance);
        last = point;
    }
    out
}

/// The first of the points with the smallest x and, of these, the smallest y.
fn first_along_x(points: &[Point]) -> Option<usize> {
    let least = points.iter().map(|point| point.rank()).min()?;
    points.iter().position(|point| point.rank() == least)
}

/// Directions from a corner.
struct Wedge {
    from: [f64; 2],
    /// The two borders; between them turns are positive from the first and negative from the second.
    borders: Option<[[f64; 2]; 2]>,
    /// Squared distance of the farthest corner.
    ///
    /// Squares are whole numbers below 2⁵², which are exact, and differ so much that no two have the same root.
    far: f64,
}

fn cross(u: [f64; 2], v: [f64; 2]) -> f64 {
    u[0] * v[1] - u[1] * v[0]
}

impl Wedge {
    fn new(from: Point) -> Self {
        Self { from: from.place(), borders: None, far: 0.0 }
    }

    /// The way to a point, and its squared length.
    fn to(&self, point: Point) -> ([f64; 2], f64) {
        let [x, y] = point.place();
        let way = [x - self.from[0], y - self.from[1]];
        (way, way[0] * way[0] + way[1] * way[1])
    }

    /// Whether a line to the point passes all corners so far, and does not turn back.
    fn holds(&self, (way, far): ([f64; 2], f64)) -> bool {
        let is_between = |[low, high]: [[f64; 2]; 2]| {
            let along = [low[0] + high[0], low[1] + high[1]];
            // Without a branch for each.
            (cross(low, way) >= 0.0) & (cross(way, high) >= 0.0) & (along[0] * way[0] + along[1] * way[1] > 0.0)
        };
        far >= self.far && self.borders.is_none_or(is_between)
    }

    /// Leaves the directions that pass the point within `tolerance`.
    fn narrow(&mut self, (way, square): ([f64; 2], f64), tolerance: f64) {
        self.far = self.far.max(square);
        let far = square.sqrt();
        if far <= tolerance {
            return;
        }
        let aside = [-way[1] * tolerance / far, way[0] * tolerance / far];
        let own = [[way[0] - aside[0], way[1] - aside[1]], [way[0] + aside[0], way[1] + aside[1]]];
        self.borders = Some(match self.borders {
            None => own,
            Some([low, high]) => [
                if cross(low, own[0]) > 0.0 { own[0] } else { low },
                if cross(own[1], high) > 0.0 { own[1] } else { high },
            ],
        });
    }
}

/// [`simplified`], or the loop itself where too little is left of it.
pub(super) fn working_copy(points: &[Point], tolerance: f64) -> Loop {
    let out = simplified(points, tolerance);
    let is_same_side = || double_area(&out).signum() == double_area(points).signum();
    if out.len() >= 3 && is_same_side() { out } else { points.to_vec() }
}
