//! What must hold of contours, checked with whole numbers and by other means than those that make them.

use super::super::{Contours, Ring};
use glam::Vec2;

/// A point as whole numbers.
type Whole = [i64; 2];

/// A ring as whole numbers.
type WholeRing = Vec<Whole>;

/// The power of two that makes whole numbers of all coordinates, none above 2²⁴.
fn scale(rings: &[Ring]) -> f64 {
    let all = || rings.iter().flat_map(|ring| &ring.points).flat_map(|point| [f64::from(point.x), f64::from(point.y)]);
    let scale = (-24..100).map(|e| libm::exp2(f64::from(e))).find(|s| all().all(|v| (v * s).fract() == 0.0));
    let scale = scale.expect("points lie on a lattice");
    assert!(all().all(|v| (v * scale).abs() <= f64::from(1 << 24)), "the lattice is exact as f32");
    scale
}

fn whole(ring: &Ring, scale: f64) -> WholeRing {
    ring.points.iter().map(|point| [(f64::from(point.x) * scale) as i64, (f64::from(point.y) * scale) as i64]).collect()
}

fn cross(a: Whole, b: Whole, c: Whole) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn is_between(a: Whole, b: Whole, p: Whole) -> bool {
    (0..2).all(|k| a[k].min(b[k]) <= p[k] && p[k] <= a[k].max(b[k]))
}

/// Whether two closed pieces of lines have a point in common.
fn touch([a, b]: [Whole; 2], [c, d]: [Whole; 2]) -> bool {
    let sides = [cross(a, b, c), cross(a, b, d), cross(c, d, a), cross(c, d, b)].map(i64::signum);
    (sides[0] * sides[1] < 0 && sides[2] * sides[3] < 0)
        || (sides[0] == 0 && is_between(a, b, c))
        || (sides[1] == 0 && is_between(a, b, d))
        || (sides[2] == 0 && is_between(c, d, a))
        || (sides[3] == 0 && is_between(c, d, b))
}

/// An edge, its ring and its index in it.
#[derive(Clone, Copy)]
struct Edge {
    ends: [Whole; 2],
    ring: usize,
    index: usize,
    is_upper: bool,
}

fn edges(rings: &[WholeRing], is_upper: bool, out: &mut Vec<Edge>) {
    for (number, ring) in rings.iter().enumerate() {
        for index in 0..ring.len() {
            let ends = [ring[index], ring[(index + 1) % ring.len()]];
            out.push(Edge { ends, ring: number, index, is_upper });
        }
    }
}

/// All pairs of edges with bounds less than `near` apart, found along x.
fn pairs(edges: &mut [Edge], near: i64, mut visit: impl FnMut(&Edge, &Edge)) {
    let low = |edge: &Edge, k: usize| edge.ends[0][k].min(edge.ends[1][k]);
    let high = |edge: &Edge, k: usize| edge.ends[0][k].max(edge.ends[1][k]);
    edges.sort_by_key(|edge| low(edge, 0));
    let mut open: Vec<Edge> = Vec::new();
    for edge in edges.iter() {
        open.retain(|other| high(other, 0) + near >= low(edge, 0));
        for other in &open {
            if low(other, 1) <= high(edge, 1) + near && low(edge, 1) <= high(other, 1) + near {
                visit(other, edge);
            }
        }
        open.push(*edge);
    }
}

/// Panics unless rings are simple and share single points at most.
fn assert_simple(rings: &[WholeRing], what: &str) {
    for ring in rings {
        assert!(ring.len() >= 3, "{what}: a ring of {} points", ring.len());
    }
    let mut all = Vec::new();
    edges(rings, false, &mut all);
    pairs(&mut all, 0, |a, b| {
        let ([p, q], [r, s]) = (a.ends, b.ends);
        if a.ring != b.ring {
            let is_corner = [p, q].iter().any(|end| *end == r || *end == s);
            let is_crossed = is_corner && {
                // Apart from the common corner, neither may lie on the other.
                let shared = if p == r || p == s { p } else { q };
                [p, q].iter().any(|&end| end != shared && cross(r, s, end) == 0 && is_between(r, s, end))
                    || [r, s].iter().any(|&end| end != shared && cross(p, q, end) == 0 && is_between(p, q, end))
            };
            assert!(is_corner || !touch(a.ends, b.ends), "{what}: rings meet: {a:?} {b:?}", a = a.ends, b = b.ends);
            assert!(!is_crossed, "{what}: rings share an edge: {a:?} {b:?}", a = a.ends, b = b.ends);
            return;
        }
        let count = rings[a.ring].len();
        let (first, second) = if (a.index + 1) % count == b.index { (a, b) } else { (b, a) };
        if (first.index + 1) % count == second.index {
            let [a, b] = first.ends;
            let c = second.ends[1];
            let is_back = cross(a, b, c) == 0 && (is_between(a, b, c) || is_between(b, c, a));
            assert!(!is_back, "{what}: a ring turns back: {a:?} {b:?} {c:?}");
        } else {
            assert!(!touch(a.ends, b.ends), "{what}: a ring meets itself: {a:?} {b:?}", a = a.ends, b = b.ends);
        }
    });
}

/// How often rings wind round a point that is on none of them.
fn winding(rings: &[WholeRing], p: Whole) -> i32 {
    let mut out = 0;
    for ring in rings {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            if (a[1] <= p[1]) != (b[1] <= p[1]) {
                let side = cross(*a, *b, p).signum();
                if b[1] > a[1] && side > 0 {
                    out += 1;
                } else if b[1] < a[1] && side < 0 {
                    out -= 1;
                }
            }
        }
    }
    out
}

fn distance(p: Whole, [a, b]: [Whole; 2]) -> f64 {
    let [px, py, ax, ay, bx, by] = [p[0], p[1], a[0], a[1], b[0], b[1]].map(|v| v as f64);
    let (x, y) = (bx - ax, by - ay);
    let share = (((px - ax) * x + (py - ay) * y) / (x * x + y * y)).clamp(0.0, 1.0);
    let (dx, dy) = (px - ax - share * x, py - ay - share * y);
    (dx * dx + dy * dy).sqrt()
}

/// Panics unless the region of `upper` lies inside that of `lower`, `least` away from its border.
fn assert_inside(upper: &[WholeRing], lower: &[WholeRing], least: f64, what: &str) {
    let mut all = Vec::new();
    edges(upper, true, &mut all);
    edges(lower, false, &mut all);
    pairs(&mut all, least as i64 + 1, |a, b| {
        if a.is_upper != b.is_upper {
            assert!(!touch(a.ends, b.ends), "{what}: levels meet: {:?} {:?}", a.ends, b.ends);
            let gaps = [
                distance(a.ends[0], b.ends),
                distance(a.ends[1], b.ends),
                distance(b.ends[0], a.ends),
                distance(b.ends[1], a.ends),
            ];
            let gap = gaps.into_iter().fold(f64::INFINITY, f64::min);
            assert!(gap >= least, "{what}: {gap} apart, not {least}: {:?} {:?}", a.ends, b.ends);
        }
    });
    for ring in upper {
        assert_eq!(winding(lower, ring[0]), 1, "{what}: a ring is not inside the level below");
    }
    for ring in lower {
        assert_eq!(winding(upper, ring[0]), 0, "{what}: a ring is inside the level above");
    }
}

fn area(rings: &[WholeRing]) -> i128 {
    let cross = |(a, b): (&Whole, &Whole)| i128::from(a[0]) * i128::from(b[1]) - i128::from(a[1]) * i128::from(b[0]);
    rings.iter().map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)).map(cross).sum::<i128>()).sum()
}

/// Panics unless all rings are simple, all levels nested and at least `least` apart (pattern units), and areas shrink.
pub(crate) fn assert_contours(contours: &Contours, least: f64, what: &str) {
    let Some((low, high)) = contours.levels() else { return };
    let scale = scale(&contours.rings);
    let level = |level: i32| contours.level(level).map(|ring| whole(ring, scale)).collect::<Vec<_>>();
    let mut lower = level(low);
    assert_simple(&lower, what);
    assert!(area(&lower) > 0, "{what}: no area");
    for k in low + 1..=high {
        let what = format!("{what}, level {k}");
        let upper = level(k);
        assert!(!upper.is_empty(), "{what}: no rings");
        assert_simple(&upper, &what);
        assert_inside(&upper, &lower, least * scale, &what);
        assert!(area(&upper) < area(&lower), "{what}: area grows");
        assert!(area(&upper) > 0, "{what}: no area");
        lower = upper;
    }
}

/// The distance of each texel centre to the nearest point of closed lines, by looking at all of them.
pub(super) fn distances(lines: &[Vec<Vec2>], side: u32) -> Vec<f64> {
    let mut out = Vec::new();
    for y in 0..side {
        for x in 0..side {
            let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let mut best = f32::INFINITY;
            for line in lines {
                for (a, b) in line.iter().zip(line.iter().cycle().skip(1)) {
                    let way = *b - *a;
                    let share = ((p - *a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                    best = best.min(p.distance_squared(*a + way * share));
                }
            }
            out.push(f64::from(best).sqrt());
        }
    }
    out
}

/// Whether closed lines wind round a place.
pub(super) fn is_inside(lines: &[Vec<Vec2>], p: Vec2) -> bool {
    let mut winding = 0;
    for line in lines {
        for (a, b) in line.iter().zip(line.iter().cycle().skip(1)) {
            let side = (*b - *a).perp_dot(p - *a);
            winding += i32::from(a.y <= p.y && b.y > p.y && side > 0.0);
            winding -= i32::from(b.y <= p.y && a.y > p.y && side < 0.0);
        }
    }
    winding != 0
}
