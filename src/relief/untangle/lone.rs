//! A quick check for the common case: one loop that does not meet itself.

use super::{
    super::lattice::{Point, cross, dot, edges},
    bins::{Bins, Edge},
    meet::{crossing, passes},
};

/// Most pairs of edges that are looked at, for each edge. Far fewer than [`super::meet::cut`] looks at before it fails.
const WORK: usize = 64;

/// Cells for each edge.
const CELLS: u64 = 16;

/// Edges of a block.
const BLOCK: usize = 16;

/// Most edges that are looked at beside all blocks.
const MOST_NEW: usize = WORK * BLOCK;

/// No item of a list.
const NONE: u32 = u32::MAX;

/// An edge in the list of a cell.
struct Item {
    bounds: [i32; 4],
    edge: u32,
    /// The item before it in the same cell, or [`NONE`].
    before: u32,
}

/// Whether the loop stays as it is when it is cut: no point repeats the one before, and no edge passes through a square
/// around a corner that is not its own.
///
/// `known` is nothing, or a loop that stays. Two edges that both loops have are not looked at again.
///
/// `false` may also mean that the answer would take long.
pub(super) fn stays(points: &[Point], known: &[Point]) -> bool {
    if points.len() < 3 {
        return false;
    }
    let edges: Vec<Edge> = edges(points).map(|(a, b)| Edge { a, b }).collect();
    if !known.is_empty() {
        let is_known = which_known(points, known);
        let new: Vec<usize> = (0..edges.len()).filter(|&i| !is_known[i]).collect();
        if new.len() <= MOST_NEW {
            return are_free(&edges, &new);
        }
    }
    let mut follow = edges.iter().zip(edges[1..].iter().chain(&edges[..1]));
    if follow.any(|(first, second)| first.a == first.b || turns_back(first, second)) {
        return false;
    }
    let mut cells = Cells::new(&edges);
    (0..edges.len()).all(|i| cells.add(i))
}

/// Which edges of a loop are those of another one, in the same order. Some may be passed over.
fn which_known(points: &[Point], known: &[Point]) -> Vec<bool> {
    let mut known = edges(known).peekable();
    let is_known = |(a, b): (Point, Point)| {
        let is_here = known.next_if(|edge| *edge == (a, b)).is_some();
        // Another edge has points between its ends, and the last of their edges leads to its end.
        if !is_here {
            known.next_if(|edge| edge.1 == b);
        }
        is_here
    };
    edges(points).map(is_known).collect()
}

/// Whether some edges of a loop meet no others.
fn are_free(edges: &[Edge], new: &[usize]) -> bool {
    let blocks: Vec<[i32; 4]> = edges.chunks(BLOCK).map(bounds).collect();
    let last = edges.len() - 1;
    let is_in_line = |&i: &usize| {
        let around = [if i == 0 { last } else { i - 1 }, if i == last { 0 } else { i + 1 }];
        let ([before, after], edge) = (around.map(|i| &edges[i]), &edges[i]);
        edge.a != edge.b && !turns_back(before, edge) && !turns_back(edge, after)
    };
    let is_free = |i: usize, block: usize| {
        let (near, first) = (edges[i].bounds(), block * BLOCK);
        let mut others = (first..).zip(&edges[first..edges.len().min(first + BLOCK)]);
        others.all(|(j, other)| is_apart(near, other.bounds()) || !meet(edges, i, j))
    };
    new.iter().all(is_in_line)
        && new.chunk_by(|i, j| i + 1 == *j).all(|run| {
            let near = bounds(&edges[run[0]..=run[run.len() - 1]]);
            let is_clear = |(block, far): (usize, &[i32; 4])| {
                is_apart(near, *far) || run.iter().all(|&i| is_apart(edges[i].bounds(), *far) || is_free(i, block))
            };
            blocks.iter().enumerate().all(is_clear)
        })
}

/// Smallest and largest coordinates of all edges.
fn bounds(edges: &[Edge]) -> [i32; 4] {
    let join = |a: [i32; 4], b: [i32; 4]| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])];
    edges.iter().map(Edge::bounds).fold([i32::MAX, i32::MAX, i32::MIN, i32::MIN], join)
}

/// Without a branch for each side.
fn is_apart(near: [i32; 4], far: [i32; 4]) -> bool {
    (near[0] > far[2]) | (far[0] > near[2]) | (near[1] > far[3]) | (far[1] > near[3])
}

/// Edges by cells, those of a cell as a list from the last one.
struct Cells<'a> {
    edges: &'a [Edge],
    bins: Bins,
    last: Vec<u32>,
    items: Vec<Item>,
    /// The cells of an edge.
    reached: Vec<u32>,
    /// How many pairs may still be looked at.
    work: usize,
}

impl<'a> Cells<'a> {
    fn new(edges: &'a [Edge]) -> Self {
        let bins = Bins::new(edges, CELLS);
        let (last, items) = (vec![NONE; bins.len()], Vec::with_capacity(2 * edges.len()));
        Self { edges, bins, last, items, reached: Vec::new(), work: WORK * edges.len() }
    }

    /// Adds an edge, if it meets none of those that were added before.
    fn add(&mut self, i: usize) -> bool {
        let Self { edges, bins, last, items, reached, work } = self;
        let bounds = edges[i].bounds();
        reached.clear();
        bins.cells(&edges[i], |cell| reached.push(cell));
        for &cell in reached.iter() {
            let last = &mut last[cell as usize];
            let (mut at, mut looked) = (*last, 0);
            while let Some(item) = items.get(at as usize) {
                if !is_apart(bounds, item.bounds) && meet(edges, i, item.edge as usize) {
                    return false;
                }
                (at, looked) = (item.before, looked + 1);
            }
            *work = work.saturating_sub(looked);
            items.push(Item { bounds, edge: i as u32, before: *last });
            *last = items.len() as u32 - 1;
        }
        *work > 0
    }
}

/// Whether one of two edges that follow each other passes through the square around the far end of the other one.
fn turns_back(first: &Edge, second: &Edge) -> bool {
    // Else the far end of neither lies within the bounds of the other.
    dot(first.a.to(first.b), second.a.to(second.b)) <= 0
        && (first.a == second.b || passes(second, first.a) || passes(first, second.b))
}

/// Whether two edges meet that do not follow each other. An edge does not meet itself.
fn meet(edges: &[Edge], i: usize, j: usize) -> bool {
    let between = i.abs_diff(j);
    if between < 2 || between == edges.len() - 1 {
        return false;
    }
    let (e, f) = (&edges[i], &edges[j]);
    if is_aside(e, f) || is_aside(f, e) {
        return false;
    }
    let has_corner = [f.a, f.b].iter().any(|p| *p == e.a || *p == e.b || passes(e, *p));
    has_corner || passes(f, e.a) || passes(f, e.b) || crossing(e, f).is_some()
}

/// Whether `f` lies on one side of the line along `e`, so far from it that neither reaches a square around a corner of the
/// other.
fn is_aside(e: &Edge, f: &Edge) -> bool {
    let along = e.a.to(e.b);
    let most = along[0].abs() + along[1].abs();
    let [a, b] = [f.a, f.b].map(|p| 2 * cross(along, e.a.to(p)));
    a.min(b) > most || a.max(b) < -most
}

#[cfg(test)]
mod tests {
    use super::{
        super::{Fill, MAX_CUTS, cut_and_joined, meet::cut, untangled},
        *,
    };
    use crate::{
        math::{Rng, ops},
        relief::lattice::Loop,
    };

    /// A star, whose corners come near its edges, or a walk, which crosses itself.
    fn any_loop(rng: &mut Rng) -> Loop {
        let count = 3 + rng.next_u32() % 40;
        let reach = [4.0, 12.0, 60.0, 400.0][rng.next_u32() as usize % 4];
        let is_star = !rng.next_u32().is_multiple_of(4);
        let mut at = [0.0; 2];
        let corner = |i: u32| {
            let angle = std::f32::consts::TAU * i as f32 / count as f32;
            if is_star {
                let radius = reach * rng.range(0.3, 1.0);
                at = [ops::cos(angle) * radius, ops::sin(angle) * radius];
            } else {
                at = [at[0] + rng.range(-reach, reach), at[1] + rng.range(-reach, reach)];
            }
            Point::round(f64::from(at[0]), f64::from(at[1]))
        };
        (0..count).map(corner).collect()
    }

    /// Some edges of a loop get a corner in between.
    fn with_corners(points: &[Point], rng: &mut Rng) -> Loop {
        let mut out = Loop::new();
        for (a, b) in edges(points) {
            out.push(a);
            if rng.next_u32().is_multiple_of(4) {
                let mut near = |a: i32, b: i32| a.midpoint(b) + (rng.next_u32() % 9) as i32 - 4;
                out.push(Point::new(near(a.x, b.x), near(a.y, b.y)));
            }
        }
        out
    }

    fn stays_when_cut(points: &Loop) -> bool {
        let edges = cut(std::slice::from_ref(points), MAX_CUTS).unwrap();
        edges.is_one_ring() && edges.edges.iter().map(|edge| edge.a).eq(points.iter().copied())
    }

    /// The quick check finds what cutting finds, and so makes the same rings, whether some of the edges are known or not.
    #[test]
    fn loops_stay_if_nothing_is_cut() {
        let mut counts = [[0; 2]; 2];
        let mut rng = Rng::new(9);
        for case in 0..20_000 {
            let points = any_loop(&mut rng);
            let does_stay = stays_when_cut(&points);
            assert_eq!(stays(&points, &[]), does_stay, "case {case}: {points:?}");
            counts[0][usize::from(does_stay)] += 1;
            let rings = |points: &Loop, known: &[Point]| {
                let loops = std::slice::from_ref(points);
                let slow = cut_and_joined(loops, Fill::AtLeast(1), 9, MAX_CUTS).unwrap();
                assert_eq!(untangled(loops, known, Fill::AtLeast(1), 9), Ok(slow), "case {case}: {points:?}");
            };
            rings(&points, &[]);
            if does_stay {
                let more = with_corners(&points, &mut rng);
                let does_stay = stays_when_cut(&more);
                assert_eq!(stays(&more, &points), does_stay, "case {case}: {more:?} after {points:?}");
                counts[1][usize::from(does_stay)] += 1;
                rings(&more, &points);
            }
        }
        assert!(counts.iter().flatten().all(|&count| count > 1000), "{counts:?}");
    }

    /// Edges that a loop has from another one are known, the pieces of divided edges are not.
    #[test]
    fn edges_of_another_loop_are_known() {
        let known = [[0, 0], [10, 0], [10, 10], [0, 10]].map(|[x, y]| Point::new(x, y));
        let mut points = known.to_vec();
        points.insert(2, Point::new(11, 5));
        points.push(Point::new(-1, 5));
        assert_eq!(which_known(&points, &known), [true, false, false, true, false, false]);
        assert_eq!(which_known(&points, &[]), [false; 6]);
    }
}
