//! Shrinks and grows regions by a distance (section 2 of the paper).

use super::{
    lattice::{Loop, Point, edges, size},
    pace::Pace,
    params::{Join, MITER_LIMIT},
    simplify::working_copy,
    untangle::{Fill, MAX_CUTS, TooTangled, untangle},
};

/// Corners that deviate less than this share of the distance from a straight line are not moved for themselves.
///
/// Larger is faster and makes rounder valleys; smaller keeps corners that make no difference one can see. A hundredth is
/// what other libraries take. The second and the third are for lines so rough that their moved edges cross very often.
const TOLERANCES: [f64; 3] = [0.005, 0.02, 0.04];

/// The same as a share of the size of a ring: of one much smaller than the distance nothing would be left but a tangle.
const FINEST: f64 = 0.03;

/// Most crossings of moved edges at the first two tolerances.
const MAX_CROSSINGS: usize = 1 << 18;

/// The share of the distance that rough lines move first.
const FIRST_STEP: f64 = 0.0625;

/// Most steps before the last one.
const FIRST_STEPS: u32 = 3;

/// The smallest step, lattice steps.
const SHORTEST_STEP: f64 = 64.0;

/// Islands with an area below this share of the squared distance are not made.
const LEAST_AREA: f64 = 0.001;

/// Largest turn of two chords of a round join, radians.
const ROUND_TURN: f64 = 0.2;

/// Shortest edge that a convex corner leaves of a moved edge, lattice steps.
const SHORTEST: f64 = 4.0;

/// Which way a region moves its border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// The region shrinks.
    Inward,
    /// The region grows.
    Outward,
}

impl Way {
    const fn sign(self) -> f64 {
        match self {
            Self::Inward => 1.0,
            Self::Outward => -1.0,
        }
    }
}

/// Twice the area below which rings are left out, for islands that are `share` of the squared distance.
pub(super) fn least_area(distance: f64, share: f64) -> i128 {
    (2.0 * share * distance * distance) as i128
}

/// A region and how it moves.
#[derive(Clone, Copy)]
pub(super) struct Move<'a> {
    pub(super) rings: &'a [Loop],
    pub(super) join: Join,
    pub(super) pace: &'a Pace,
    /// Corners that deviate less than this from a straight line are not moved for themselves, lattice steps.
    pub(super) tolerance: f64,
}

/// The regions within rings, shrunk or grown: what all have in common if they shrink, and all together if they grow.
///
/// What each edge passes over when it moves is a strip, and a sector at each join. The loop of [`moved`] winds around
/// the region once and around each strip and each sector once in the other direction (or in the same direction, if it
/// grows). So what is left of the region has a winding number of one, and all that is passed over has none above zero.
/// Where `n` regions shrink, what is left of all of them has the sum `n`, and no other place has.
pub(super) fn offset(moves: &[Move<'_>], way: Way) -> Result<Vec<Loop>, TooTangled> {
    let [fine, medium, coarse] = TOLERANCES;
    moved_together(moves, way, fine, MAX_CROSSINGS)
        .or_else(|_| moved_together(moves, way, medium, MAX_CROSSINGS))
        .or_else(|_| in_two_steps(moves, way, coarse, FIRST_STEPS))
}

/// For rough lines: a small step takes away what is narrow, and with it most of the crossings of the large one.
///
/// The small step has extended edges, which leave corners as they are for the join of the large one.
///
/// The small step may need a smaller one before it, up to a number of `steps`.
fn in_two_steps(moves: &[Move<'_>], way: Way, tolerance: f64, steps: u32) -> Result<Vec<Loop>, TooTangled> {
    let small = |one: &Move<'_>| {
        let pace = one.pace.share(FIRST_STEP);
        let one = [Move { join: Join::Miter, pace: &pace, ..*one }];
        if steps < 2 || pace.least() * FIRST_STEP < SHORTEST_STEP {
            return moved_together(&one, way, tolerance, MAX_CUTS);
        }
        moved_together(&one, way, tolerance, MAX_CROSSINGS).or_else(|_| in_two_steps(&one, way, tolerance, steps - 1))
    };
    let rings = moves.iter().map(small).collect::<Result<Vec<_>, _>>()?;
    let paces: Vec<Pace> = moves.iter().map(|one| one.pace.share(1.0 - FIRST_STEP)).collect();
    let rest: Vec<Move<'_>> =
        moves.iter().zip(rings.iter().zip(&paces)).map(|(one, (rings, pace))| Move { rings, pace, ..*one }).collect();
    moved_together(&rest, way, tolerance, MAX_CUTS)
}

/// [`offset`] with corners that deviate by less than `tolerance` dropped, and at most so many cuts.
fn moved_together(moves: &[Move<'_>], way: Way, tolerance: f64, most: usize) -> Result<Vec<Loop>, TooTangled> {
    let Some(finest) = moves.iter().map(|one| one.pace.least()).reduce(f64::min) else { return Ok(Vec::new()) };
    let fill = Fill::AtLeast(if way == Way::Inward { moves.len() as i32 } else { 1 });
    let one = |Move { rings, join, pace, tolerance: own }: &Move<'_>| {
        let one = |ring: &Loop| {
            let copy = working_copy(ring, own.max(tolerance * finest).min(FINEST * size(ring)));
            let copy = if pace.is_even() { copy } else { divided(&copy, 2.0 * pace.least()) };
            moved(&copy, way, *join, pace)
        };
        rings.iter().map(one).collect::<Vec<_>>()
    };
    let loops: Vec<Loop> = moves.iter().flat_map(one).collect();
    untangle(&loops, fill, least_area(finest, LEAST_AREA), most)
}

/// A loop with edges of at most `longest`, or as near to it as 256 pieces of an edge allow.
fn divided(points: &[Point], longest: f64) -> Loop {
    let mut out = Loop::with_capacity(2 * points.len());
    for (a, b) in edges(points) {
        let pieces = (a.distance(b) / longest).ceil().clamp(1.0, 256.0);
        let ([x, y], [u, v]) = (a.place(), b.place());
        for piece in 0..pieces as u32 {
            let t = f64::from(piece) / pieces;
            out.push(Point::round(x + (u - x) * t, y + (v - y) * t));
        }
    }
    out
}

/// A corner and the two edges at it.
struct Corner {
    point: Point,
    /// Directions of the edge before and of the one after.
    ways: [[f64; 2]; 2],
    /// Sine and cosine of the turn from one to the other. The sine is positive where moved edges meet.
    turn: [f64; 2],
    distance: f64,
    sign: f64,
    /// What meeting takes from both edges; 0 where they come apart.
    trim: f64,
}

impl Corner {
    /// The direction in which an edge moves.
    fn normal(&self, edge: usize) -> [f64; 2] {
        [-self.ways[edge][1] * self.sign, self.ways[edge][0] * self.sign]
    }

    fn at(&self, way: [f64; 2], distance: f64) -> Point {
        let [x, y] = self.point.place();
        Point::round(x + way[0] * distance, y + way[1] * distance)
    }

    /// The end of a moved edge.
    fn end(&self, edge: usize) -> Point {
        self.at(self.normal(edge), self.distance)
    }

    /// Where the moved edges, or their extensions, meet.
    fn meeting(&self) -> Point {
        let ([a, b], share) = ([self.normal(0), self.normal(1)], 1.0 + self.turn[1]);
        self.at([(a[0] + b[0]) / share, (a[1] + b[1]) / share], self.distance)
    }

    /// A place on the bisector.
    fn on_bisector(&self, distance: f64) -> Point {
        let [u, v] = self.ways;
        let way = if self.turn[1] > -0.5 {
            let [a, b] = [self.normal(0), self.normal(1)];
            [a[0] + b[0], a[1] + b[1]]
        } else {
            // Nearly opposite edges: their normals cancel, but they go to and from the tip.
            [u[0] - v[0], u[1] - v[1]]
        };
        let length = (way[0] * way[0] + way[1] * way[1]).sqrt();
        self.at([way[0] / length, way[1] / length], distance)
    }

    /// Whether extended edges meet within `factor` times the distance.
    fn meets_within(&self, factor: f64) -> bool {
        2.0 <= factor * factor * (1.0 + self.turn[1])
    }

    /// What joins edges that come apart.
    fn join(&self, join: Join, out: &mut Loop) {
        let ends = [self.end(0), self.end(1)];
        let between = match join {
            // A turn that moves the ends by less than a few lattice steps is none.
            _ if -self.turn[0] * self.distance < SHORTEST && self.turn[1] > 0.0 => None,
            Join::Miter if self.meets_within(f64::from(MITER_LIMIT)) => None,
            Join::Miter => Some(self.on_bisector(self.distance * f64::from(MITER_LIMIT))),
            Join::Arc { factor } if self.meets_within(f64::from(factor)) => None,
            Join::Arc { factor } => Some(self.on_bisector(self.distance * f64::from(factor))),
            Join::Bevel if self.turn[1] < -0.5 => Some(self.on_bisector(self.distance)),
            Join::Bevel => {
                out.extend(ends);
                return;
            }
            Join::Round => {
                self.round(out);
                return;
            }
        };
        match between {
            None => out.push(self.meeting()),
            Some(point) => out.extend([ends[0], point, ends[1]]),
        }
    }

    /// The corners of a line around the circle.
    fn round(&self, out: &mut Loop) {
        // The sine of edges that go there and back may be a zero of either sign.
        let angle = libm::atan2(self.turn[0].abs(), self.turn[1]);
        let pieces = (angle / ROUND_TURN).ceil().max(1.0);
        let step = angle / pieces;
        let radius = self.distance / libm::cos(0.5 * step);
        let [x, y] = self.normal(0);
        for piece in 0..pieces as u32 {
            let at = -self.sign * step * (f64::from(piece) + 0.5);
            let (sin, cos) = (libm::sin(at), libm::cos(at));
            out.push(self.at([x * cos - y * sin, x * sin + y * cos], radius));
        }
    }
}

/// All corners of a loop, and the lengths of the edges after them.
fn corners(points: &[Point], way: Way, pace: impl Fn(Point) -> f64) -> (Vec<Corner>, Vec<f64>) {
    let mut lengths = Vec::with_capacity(points.len());
    let ways: Vec<[f64; 2]> = edges(points)
        .map(|(a, b)| {
            let ([x, y], length) = (a.to(b), a.distance(b));
            lengths.push(length);
            [x as f64 / length, y as f64 / length]
        })
        .collect();
    let sign = way.sign();
    let mut before = ways.last().copied().unwrap_or_default();
    let corner = |(&point, &after): (&Point, &[f64; 2])| {
        let ways = [before, after];
        before = after;
        let [u, v] = ways;
        let turn = [(u[0] * v[1] - u[1] * v[0]) * sign, u[0] * v[0] + u[1] * v[1]];
        let distance = pace(point);
        let trim = if turn[0] > 0.0 { distance * turn[0] / (1.0 + turn[1]).max(1e-12) } else { 0.0 };
        Corner { point, ways, turn, distance, sign, trim }
    };
    (points.iter().zip(&ways).map(corner).collect(), lengths)
}

/// The loop of all moved edges and what joins them.
///
/// Where moved edges meet, they end there, if enough is left of both. Else the line goes from the end of one to the
/// corner itself and on to the start of the other, so that it goes round each strip by itself.
fn moved(points: &[Point], way: Way, join: Join, pace: &Pace) -> Loop {
    if points.len() < 3 {
        return Loop::new();
    }
    let (corners, lengths) = corners(points, way, pace.on(points));
    let count = corners.len();
    let mut is_trimmed: Vec<bool> = corners.iter().map(|corner| corner.trim > 0.0).collect();
    for (i, &length) in lengths.iter().enumerate() {
        let next = if i + 1 == count { 0 } else { i + 1 };
        if corners[i].trim + corners[next].trim + SHORTEST > length {
            (is_trimmed[i], is_trimmed[next]) = (false, false);
        }
    }
    let mut out = Loop::with_capacity(count + count / 4);
    for (corner, is_trimmed) in corners.iter().zip(is_trimmed) {
        if is_trimmed {
            out.push(corner.meeting());
        } else if corner.trim > 0.0 {
            out.extend([corner.end(0), corner.point, corner.end(1)]);
        } else {
            corner.join(join, &mut out);
        }
    }
    out
}
