//! Cuts edges where they meet.

use super::{
    super::lattice::{Loop, Point, cross},
    bins::{Bins, Edge},
};

/// Loops have more crossings than are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) struct TooTangled;

/// Edges after all cuts, and after each one the index of the next of its loop.
#[derive(Debug, Default)]
pub(super) struct Edges {
    pub(super) edges: Vec<Edge>,
    pub(super) next: Vec<u32>,
    /// Whether the start of an edge is also a point of another edge than the one before it.
    pub(super) is_node: Vec<bool>,
}

/// Most pairs of edges that are looked at, for each cut that is allowed.
const WORK: usize = 128;

/// A new corner of an edge.
type Cut = (u32, i64, Point);

/// A loop without points that repeat the one before; empty if fewer than three are left.
fn cleaned(points: &[Point]) -> Loop {
    let mut out: Loop = points.to_vec();
    out.dedup();
    while out.len() > 1 && out.first() == out.last() {
        out.pop();
    }
    if out.len() < 3 {
        out.clear();
    }
    out
}

impl Edges {
    fn new(loops: &[Loop]) -> Self {
        let mut out = Self::default();
        let many = loops.iter().map(Vec::len).sum();
        out.edges.reserve(many);
        out.next.reserve(many);
        for points in loops {
            let points = cleaned(points);
            let first = out.edges.len() as u32;
            for (i, &a) in points.iter().enumerate() {
                let last = i + 1 == points.len();
                out.edges.push(Edge { a, b: if last { points[0] } else { points[i + 1] } });
                out.next.push(if last { first } else { first + i as u32 + 1 });
            }
        }
        out.is_node = vec![false; out.edges.len()];
        out
    }

    /// Replaces edges by their pieces.
    fn split(&mut self, cuts: &[Cut]) {
        let mut out = Self::default();
        let many = self.edges.len() + cuts.len();
        out.edges.reserve(many);
        out.is_node.reserve(many);
        out.next.reserve(many);
        // The new index of the first piece of each edge.
        let mut firsts = Vec::with_capacity(self.edges.len());
        let mut cuts = cuts.iter().peekable();
        for (i, edge) in self.edges.iter().enumerate() {
            firsts.push(out.edges.len() as u32);
            let (mut a, mut is_node) = (edge.a, self.is_node[i]);
            while let Some(&(_, _, point)) = cuts.next_if(|cut| cut.0 as usize == i) {
                out.push(Edge { a, b: point }, is_node);
                (a, is_node) = (point, true);
            }
            out.push(Edge { a, b: edge.b }, is_node);
        }
        for i in 0..self.edges.len() {
            if let Some(last) = out.next.get_mut(firsts.get(i + 1).map_or(many, |&first| first as usize) - 1) {
                *last = firsts[self.next[i] as usize];
            }
        }
        *self = out;
    }

    /// Whether the edges are a single loop that does not meet itself.
    pub(super) fn is_one_ring(&self) -> bool {
        let is_next = |(i, next): (usize, &u32)| *next as usize == i + 1;
        let last = self.next.len().saturating_sub(1);
        self.next.last() == Some(&0)
            && self.next[..last].iter().enumerate().all(is_next)
            && !self.is_node.iter().any(|is_node| *is_node)
    }

    fn push(&mut self, edge: Edge, is_node: bool) {
        self.edges.push(edge);
        self.next.push(self.edges.len() as u32);
        self.is_node.push(is_node);
    }
}

/// Cuts of edges, and the lattice points nearest to crossings.
#[derive(Default)]
struct Cuts {
    cuts: Vec<Cut>,
    crossings: Vec<Point>,
}

impl Cuts {
    fn dedup(&mut self) {
        self.cuts.sort_unstable();
        self.cuts.dedup();
        self.crossings.sort_unstable_by_key(|point| point.rank());
        self.crossings.dedup();
    }
}

/// The edges of `loops`, cut so that they meet at their ends only.
///
/// This is snap rounding: around each corner, and each lattice point nearest to a crossing, is a square of side 1. Edges
/// are cut where they pass through a square, and the cut goes to its centre. As the squares are taken by the edges as they
/// were given, pieces do not cross (Hobby 1999, theorem 1).
pub(super) fn cut(loops: &[Loop], most: usize) -> Result<Edges, TooTangled> {
    let mut edges = Edges::new(loops);
    if edges.edges.is_empty() {
        return Ok(edges);
    }
    let bins = Bins::new(&edges.edges, 4);
    let members = members(&edges, &bins);
    let mut found = Cuts::default();
    find(&mut edges, &members, &mut found, most)?;
    found.dedup();
    let Cuts { mut cuts, crossings } = found;
    if cuts.len() + 2 * crossings.len() > most {
        return Err(TooTangled);
    }
    for &p in &crossings {
        pass(&mut edges, members.of(bins.cell(p)), p, &mut cuts);
    }
    cuts.sort_unstable();
    cuts.dedup();
    if !cuts.is_empty() {
        edges.split(&cuts);
        fold(&mut edges);
    }
    Ok(edges)
}

/// Cuts all edges of a cell that pass through the square around a crossing.
fn pass(edges: &mut Edges, cell: &[u32], p: Point, cuts: &mut Vec<Cut>) {
    for &i in cell {
        let edge = edges.edges[i as usize];
        if p == edge.a || p == edge.b {
            let vertex = if p == edge.a { i } else { edges.next[i as usize] };
            edges.is_node[vertex as usize] = true;
        } else if passes(&edge, p) {
            cuts.push(cut_at(&edge, i, p));
        }
    }
}

/// Marks pieces that go there and back again.
fn fold(edges: &mut Edges) {
    for i in 0..edges.edges.len() {
        let next = edges.next[i] as usize;
        if edges.edges[i].a == edges.edges[next].b {
            let after = edges.next[next] as usize;
            [i, next, after].into_iter().for_each(|vertex| edges.is_node[vertex] = true);
        }
    }
}

/// Which edges lie in which cell: those of cell `c` are `items[starts[c]..starts[c + 1]]`.
struct Members {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Members {
    fn of(&self, cell: u32) -> &[u32] {
        &self.items[self.starts[cell as usize] as usize..self.starts[cell as usize + 1] as usize]
    }
}

fn members(edges: &Edges, bins: &Bins) -> Members {
    let mut pairs = Vec::with_capacity(4 * edges.edges.len());
    // First where each cell ends, then where it starts.
    let mut starts = vec![0u32; bins.len() + 1];
    for (i, edge) in edges.edges.iter().enumerate() {
        bins.cells(edge, |cell| {
            starts[cell as usize] += 1;
            pairs.push((cell, i as u32));
        });
    }
    let mut end = 0;
    for start in &mut starts {
        end += *start;
        *start = end;
    }
    let mut items = vec![0; pairs.len()];
    for &(cell, edge) in pairs.iter().rev() {
        let start = &mut starts[cell as usize];
        *start -= 1;
        items[*start as usize] = edge;
    }
    Members { starts, items }
}

/// Finds where edges must be cut, and marks the corners that they share.
fn find(edges: &mut Edges, members: &Members, found: &mut Cuts, most: usize) -> Result<(), TooTangled> {
    let mut boxes = Vec::new();
    let mut work = 0;
    for cell in (0..members.starts.len() as u32 - 1).map(|cell| members.of(cell)).filter(|cell| cell.len() > 1) {
        work += cell.len() * cell.len() / 2;
        if work > most.saturating_mul(WORK) {
            return Err(TooTangled);
        }
        boxes.clear();
        boxes.extend(cell.iter().map(|&i| (edges.edges[i as usize].bounds(), i)));
        for (k, &(near, e)) in boxes.iter().enumerate() {
            for &(far, f) in &boxes[k + 1..] {
                // Without a branch for each side.
                let is_apart = (near[0] > far[2]) | (far[0] > near[2]) | (near[1] > far[3]) | (far[1] > near[3]);
                if !is_apart {
                    meet(edges, e, f, found);
                }
            }
        }
        // Cells share edges, so a cut may be found several times. A crossing makes two cuts.
        if found.cuts.len() + 2 * found.crossings.len() > 2 * most {
            found.dedup();
            if found.cuts.len() + 2 * found.crossings.len() > most {
                return Err(TooTangled);
            }
        }
    }
    Ok(())
}

/// Whether the edge passes through the square of side 1 around `p`, which is none of its ends.
///
/// Of its border, the square has the sides towards smaller coordinates, and of its corners the one between them.
pub(super) fn passes(edge: &Edge, p: Point) -> bool {
    let [x0, y0, x1, y1] = edge.bounds();
    if p.x < x0 || p.x > x1 || p.y < y0 || p.y > y1 || p == edge.a || p == edge.b {
        return false;
    }
    let along = edge.a.to(edge.b);
    let (side, most) = (2 * cross(along, edge.a.to(p)), along[0].abs() + along[1].abs());
    let is_at_corner = || along[0].signum() * along[1].signum() < 0 && side == along[0] - along[1];
    side.abs() < most || (side.abs() == most && is_at_corner())
}

fn cut_at(edge: &Edge, index: u32, p: Point) -> Cut {
    let [x, y] = edge.a.to(p);
    (index, x.abs() + y.abs(), p)
}

/// Two edges whose bounds meet.
fn meet(all: &mut Edges, i: u32, j: u32, found: &mut Cuts) {
    let cuts = &mut found.cuts;
    let (e, f) = (all.edges[i as usize], all.edges[j as usize]);
    let (next_i, next_j) = (all.next[i as usize], all.next[j as usize]);
    if next_i == j || next_j == i {
        let ((first, k), (second, l)) = if next_i == j { ((e, i), (f, j)) } else { ((f, j), (e, i)) };
        follow(all, [&first, &second], [k, l], cuts);
        return;
    }
    for (p, vertex) in [(f.a, j), (f.b, next_j)] {
        if p == e.a || p == e.b {
            all.is_node[vertex as usize] = true;
            all.is_node[if p == e.a { i } else { next_i } as usize] = true;
        } else if passes(&e, p) {
            all.is_node[vertex as usize] = true;
            cuts.push(cut_at(&e, i, p));
        }
    }
    for (p, vertex) in [(e.a, i), (e.b, next_i)] {
        if passes(&f, p) {
            all.is_node[vertex as usize] = true;
            cuts.push(cut_at(&f, j, p));
        }
    }
    found.crossings.extend(crossing(&e, &f));
}

/// Two edges of which one follows the other.
fn follow(all: &mut Edges, [first, second]: [&Edge; 2], [i, j]: [u32; 2], cuts: &mut Vec<Cut>) {
    let after = all.next[j as usize];
    if first.a == second.b {
        // There and back again.
        [i, j, after].into_iter().for_each(|vertex| all.is_node[vertex as usize] = true);
        return;
    }
    if passes(second, first.a) {
        all.is_node[i as usize] = true;
        cuts.push(cut_at(second, j, first.a));
    }
    if passes(first, second.b) {
        all.is_node[after as usize] = true;
        cuts.push(cut_at(first, i, second.b));
    }
}

/// The lattice point nearest to the place where two edges cross, if they do.
pub(super) fn crossing(e: &Edge, f: &Edge) -> Option<Point> {
    let (u, v) = (e.a.to(e.b), f.a.to(f.b));
    let [a, b] = [f.a, f.b].map(|p| cross(u, e.a.to(p)));
    let [c, d] = [e.a, e.b].map(|p| cross(v, f.a.to(p)));
    if a.signum() * b.signum() >= 0 || c.signum() * d.signum() >= 0 {
        return None;
    }
    // The share of `e` up to the crossing is c / (c - d).
    let (part, whole) = if c > d { (c, c - d) } else { (-c, d - c) };
    let along = |from: i32, step: i64| {
        let (num, den) = (2 * i128::from(part) * i128::from(step) + i128::from(whole), 2 * i128::from(whole));
        from + num.div_euclid(den) as i32
    };
    Some(Point::new(along(e.a.x, u[0]), along(e.a.y, u[1])))
}
