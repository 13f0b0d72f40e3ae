//! Displaces the midpoints of long edges (section 4.1 of the paper).

use super::lattice::{Loop, Point, edges};
use crate::math::Rng;

/// How midpoints are displaced. Lengths are in lattice steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Displacement {
    /// Edges longer than this are divided: `2 d0`.
    pub(super) longest: f64,
    /// Largest displacement of one midpoint: `d''`.
    pub(super) most: f64,
    /// Largest displacement of a point from its edge, by all midpoints together.
    pub(super) within: f64,
    /// Range of the angle at the end of the edge, radians.
    pub(super) angles: [f32; 2],
}

/// A point that midpoints have displaced, and where it would lie on the edge.
#[derive(Clone, Copy)]
struct Displaced {
    place: [f64; 2],
    base: [f64; 2],
}

impl Displacement {
    /// The loop with displaced midpoints in its long edges.
    ///
    /// An edge of the length `2 l` is displaced by `min(d'', l tan θ)`, with θ uniform in its range, to a random side;
    /// both halves again, until none is longer than `2 d0`. Differs from the paper: a point stays within a distance of the edge.
    pub(super) fn apply(&self, points: &[Point], rng: &mut Rng) -> Loop {
        let mut out = Loop::with_capacity(2 * points.len());
        let mut waiting = Vec::new();
        for (a, b) in edges(points) {
            let length = a.distance(b);
            if length <= self.longest {
                out.push(a);
                continue;
            }
            let [from, to] = [a, b].map(|point| Displaced { place: point.place(), base: point.place() });
            waiting.push((from, to, self.halvings(length)));
            while let Some((from, to, halvings)) = waiting.pop() {
                match self.midpoint(from, to, rng) {
                    Some(middle) if halvings > 0 => {
                        waiting.push((middle, to, halvings - 1));
                        waiting.push((from, middle, halvings - 1));
                    }
                    _ => out.push(Point::round(from.place[0], from.place[1])),
                }
            }
        }
        out
    }

    /// How often an edge of a length is halved at most: once more than if midpoints were not displaced.
    ///
    /// Steep displacements make halves that are longer than their edge, and would not come to an end.
    fn halvings(&self, length: f64) -> u32 {
        (1..).take_while(|&halvings| length > self.longest * f64::from(1 << halvings.min(30))).count().min(30) as u32
            + 2
    }

    /// The midpoint of an edge that is long.
    fn midpoint(&self, from: Displaced, to: Displaced, rng: &mut Rng) -> Option<Displaced> {
        let way = [to.place[0] - from.place[0], to.place[1] - from.place[1]];
        let length = (way[0] * way[0] + way[1] * way[1]).sqrt();
        if length <= self.longest {
            return None;
        }
        let angle = f64::from(rng.range(self.angles[0], self.angles[1]));
        let aside = self.most.min(0.5 * length * libm::tan(angle)) * if rng.unit() < 0.5 { -1.0 } else { 1.0 };
        let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let (place, base) = (middle(from.place, to.place), middle(from.base, to.base));
        let place = [place[0] - way[1] / length * aside, place[1] + way[0] / length * aside];
        let [x, y] = shortened([place[0] - base[0], place[1] - base[1]], self.within);
        Some(Displaced { place: [base[0] + x, base[1] + y], base })
    }
}

/// A vector, at most `longest` long.
pub(super) fn shortened([x, y]: [f64; 2], longest: f64) -> [f64; 2] {
    let length = (x * x + y * y).sqrt();
    if length > longest { [x / length * longest, y / length * longest] } else { [x, y] }
}
