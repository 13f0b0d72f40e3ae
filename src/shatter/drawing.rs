//! [`Drawing`]: lines on the lattice, made planar.

use super::lattice::{Lattice, NONE, Place, PlaceMap, distance_sq, key, orient};
use crate::math::Rng;
use crate::math::whole::{cross, dot, vector};
use glam::Vec2;

/// Lines as edges between vertices; once planar it includes the four sides of the surface.
#[derive(Clone, Debug)]
pub(super) struct Drawing {
    pub(super) lattice: Lattice,
    pub(super) places: Vec<Place>,
    vertex_at: PlaceMap,
    /// Indices of two places.
    pub(super) edges: Vec<[u32; 2]>,
}

/// Crossings are cut at the nearest lattice point, which moves lines a little and may create new crossings. After
/// this many rounds the newer of two crossing lines is removed. Three rounds are enough except for constructed cases.
const ROUNDS: u32 = 8;

/// A removed edge: both ends are the same.
pub(super) const DEAD: [u32; 2] = [u32::MAX; 2];

/// Length of the pieces of an extended line, about, pattern units; as for the pieces of a crack.
const PIECE: f32 = 1.0 / 72.0;

/// How far an extended line deviates from a straight one, as a share of its length.
const ROUGHNESS: f32 = 0.12;

impl Drawing {
    /// The surface without lines.
    pub(super) fn new(lattice: Lattice) -> Self {
        let mut drawing = Self { lattice, places: Vec::new(), vertex_at: PlaceMap::default(), edges: Vec::new() };
        let [w, h] = lattice.corner;
        for corner in [[0, 0], [w, 0], [w, h], [0, h]] {
            drawing.vertex(corner);
        }
        drawing
    }

    /// Reserves memory for more points.
    pub(super) fn reserve(&mut self, points: usize) {
        self.places.reserve(points);
        self.vertex_at.reserve(points);
        self.edges.reserve(points);
    }

    pub(super) fn vertex(&mut self, place: Place) -> u32 {
        let new = self.places.len() as u32;
        let vertex = *self.vertex_at.entry(key(place)).or_insert(new);
        if vertex == new {
            self.places.push(place);
        }
        vertex
    }

    pub(super) fn line(&mut self, points: impl Iterator<Item = Vec2>) {
        let mut last = None;
        for point in points {
            let vertex = self.vertex(self.lattice.snap(point));
            if let Some(last) = last.replace(vertex).filter(|&last| last != vertex) {
                self.edges.push([last, vertex]);
            }
        }
    }

    fn ends(&self, edge: u32) -> [Place; 2] {
        self.edges[edge as usize].map(|vertex| self.places[vertex as usize])
    }

    /// Cuts lines where they meet, until they share only ends, and removes duplicates.
    pub(super) fn make_planar(&mut self) {
        self.make_planar_from(0);
    }

    /// [`make_planar`](Self::make_planar) if the edges before `new` share only ends already.
    fn make_planar_from(&mut self, new: usize) {
        // After the first round, only pairs with a new edge can meet.
        let (mut round, mut new, mut cuts) = (0, self.lay_border(new), Vec::new());
        loop {
            let grid = EdgeGrid::new(self);
            let mut changed = false;
            grid.pairs(new, |e, f| changed |= self.separate(e, f, round < ROUNDS, &mut cuts));
            if !changed {
                break;
            }
            new = self.apply(&mut cuts);
            round += 1;
        }
    }

    /// Replaces the border edges: from each vertex on the border to the next. Returns how many of the first `old`
    /// edges are left.
    fn lay_border(&mut self, old: usize) -> u32 {
        let is_inside = |&[a, b]: &[u32; 2]| {
            let sides = [a, b].map(|vertex| self.places[vertex as usize]);
            self.lattice.side_of(sides[0], sides[1]).is_none()
        };
        let left = self.edges[..old].iter().filter(|ends| is_inside(ends)).count() as u32;
        self.edges.retain(is_inside);
        let mut on_side: [Vec<u32>; 4] = Default::default();
        for (vertex, &place) in (0u32..).zip(&self.places) {
            for (vertices, is_on) in on_side.iter_mut().zip(self.lattice.sides(place)) {
                if is_on {
                    vertices.push(vertex);
                }
            }
        }
        for mut vertices in on_side {
            // One coordinate is the same for all of them.
            vertices.sort_unstable_by_key(|&vertex| self.places[vertex as usize]);
            self.edges.extend(vertices.windows(2).map(|pair| [pair[0], pair[1]]));
        }
        left
    }

    /// Records where two edges must be cut so that they share only ends. Returns `false` if they need no cut.
    fn separate(&mut self, e: u32, f: u32, may_cross: bool, cuts: &mut Vec<(u32, u32)>) -> bool {
        let ([a, b], [c, d]) = (self.edges[e as usize], self.edges[f as usize]);
        if [a, b] == DEAD || [c, d] == DEAD {
            return false;
        }
        let shared = match () {
            () if a == c => Some((a, b, d)),
            () if a == d => Some((a, b, c)),
            () if b == c => Some((b, a, d)),
            () if b == d => Some((b, a, c)),
            () => None,
        };
        let place = |vertex: u32| self.places[vertex as usize];
        if let Some((hub, p, q)) = shared {
            if p == q {
                self.edges[e.max(f) as usize] = DEAD;
                return true;
            }
            let (to_p, to_q) = (vector(place(hub), place(p)), vector(place(hub), place(q)));
            if cross(to_p, to_q) != 0 || dot(to_p, to_q) < 0 {
                return false;
            }
            cuts.push(if dot(to_p, to_p) < dot(to_q, to_q) { (f, p) } else { (e, q) });
            return true;
        }
        let (pa, pb, pc, pd) = (place(a), place(b), place(c), place(d));
        let apart = |i: usize| pa[i].max(pb[i]) < pc[i].min(pd[i]) || pc[i].max(pd[i]) < pa[i].min(pb[i]);
        if apart(0) || apart(1) {
            return false;
        }
        let (oc, od) = (orient(pa, pb, pc).signum(), orient(pa, pb, pd).signum());
        if oc * od > 0 {
            return false;
        }
        let (oa, ob) = (orient(pc, pd, pa).signum(), orient(pc, pd, pb).signum());
        if oa * ob > 0 {
            return false;
        }
        if oc * od < 0 && oa * ob < 0 {
            if !may_cross {
                self.edges[e.max(f) as usize] = DEAD;
                return true;
            }
            let at = self.vertex(crossing([pa, pb], [pc, pd]));
            cuts.extend([(e, at), (f, at)]);
            return true;
        }
        let between = |p: Place, a: Place, b: Place| dot(vector(p, a), vector(p, b)) < 0;
        let before = cuts.len();
        cuts.extend((oc == 0 && between(pc, pa, pb)).then_some((e, c)));
        cuts.extend((od == 0 && between(pd, pa, pb)).then_some((e, d)));
        cuts.extend((oa == 0 && between(pa, pc, pd)).then_some((f, a)));
        cuts.extend((ob == 0 && between(pb, pc, pd)).then_some((f, b)));
        cuts.len() > before
    }

    /// Replaces edges by the pieces between the vertices at which they are cut. Returns the first of the pieces.
    fn apply(&mut self, cuts: &mut Vec<(u32, u32)>) -> u32 {
        let old = self.edges.len();
        cuts.sort_by_key(|&(edge, vertex)| {
            let [from, _] = self.edges[edge as usize];
            let start = self.places.get(from as usize).copied().unwrap_or_default();
            (edge, distance_sq(start, self.places[vertex as usize]), vertex)
        });
        for on_edge in cuts.chunk_by(|a, b| a.0 == b.0) {
            let edge = on_edge[0].0 as usize;
            let [from, to] = std::mem::replace(&mut self.edges[edge], DEAD);
            if from == to {
                continue;
            }
            let mut last = from;
            for next in on_edge.iter().map(|cut| cut.1).chain([to]) {
                if next != last {
                    self.edges.push([last, next]);
                }
                last = next;
            }
        }
        cuts.clear();
        let first = self.edges[..old].iter().filter(|&&edge| edge != DEAD).count() as u32;
        self.edges.retain(|&edge| edge != DEAD);
        first
    }

    /// Extends every open end in its direction to the next line. The drawing must be planar. Returns the new lines.
    pub(super) fn extend_cracks(&mut self, seed: u64) -> Vec<Vec<Vec2>> {
        let mut at: Vec<(u32, u32)> = vec![(0, u32::MAX); self.places.len()];
        for (edge, ends) in (0u32..).zip(&self.edges) {
            for &end in ends {
                at[end as usize].0 += 1;
                // Only the last edge matters: an open end has one edge, the vertices on the way back have two.
                at[end as usize].1 ^= edge;
            }
        }
        let on_border = |place: Place| self.lattice.sides(place).contains(&true);
        let tips: Vec<u32> =
            (0..at.len() as u32).filter(|&v| at[v as usize].0 == 1 && !on_border(self.places[v as usize])).collect();
        let old = self.edges.len();
        let mut grid = EdgeGrid::new(self);
        let rng = Rng::new(seed).stream("carry on");
        let mut lines = Vec::with_capacity(tips.len());
        for tip in tips {
            let back = self.way_back(&at, tip);
            let [start, back] = [tip, back].map(|vertex| self.places[vertex as usize]);
            let way = vector(back, start).map(|x| x as f64);
            let Some((edge, hit)) = self.first_hit(start, way, &grid) else { continue };
            let [from, to] = self.edges[edge as usize];
            if let Some(pieces) = self.split(edge, hit) {
                for (end, piece) in [from, to].into_iter().zip(pieces) {
                    if let Some((_, edges)) = at.get_mut(end as usize) {
                        *edges ^= edge ^ piece;
                    }
                }
            }
            let ends = [tip, hit].map(|v| self.lattice.pos(self.places[v as usize]));
            let line = self.rough_line(ends, rng.substream(u64::from(tip)));
            self.line(line.iter().copied());
            grid.add_new(self);
            lines.push(line);
        }
        let left = self.edges[..old].iter().filter(|&&edge| edge != DEAD).count();
        self.edges.retain(|&edge| edge != DEAD);
        self.make_planar_from(left);
        lines
    }

    /// A vertex a few pieces back along the crack that ends at `tip`.
    fn way_back(&self, at: &[(u32, u32)], tip: u32) -> u32 {
        let reach = (f64::from(4.0 * PIECE) * self.lattice.scale) as i64;
        let (mut vertex, mut edge) = (tip, at[tip as usize].1 ^ u32::MAX);
        loop {
            let Some(&[a, b]) = self.edges.get(edge as usize).filter(|&&ends| ends != DEAD) else { return vertex };
            vertex = if a == vertex { b } else { a };
            let far = distance_sq(self.places[tip as usize], self.places[vertex as usize]) > reach * reach;
            match at.get(vertex as usize) {
                Some(&(2, both)) if !far && vertex != tip => edge ^= both ^ u32::MAX,
                _ => return vertex,
            }
        }
    }

    /// Where the ray from a place meets the border.
    fn border_ahead(&self, start: Place, way: [f64; 2]) -> Option<Place> {
        let to_side = |i: usize| {
            let room = if way[i] > 0.0 { self.lattice.corner[i] - start[i] } else { -start[i] };
            if way[i] == 0.0 { f64::INFINITY } else { f64::from(room) / way[i] }
        };
        let share = to_side(0).min(to_side(1));
        let at = |i: usize| ((f64::from(start[i]) + way[i] * share).round() as i32).clamp(0, self.lattice.corner[i]);
        share.is_finite().then(|| [at(0), at(1)])
    }

    /// The first edge on the ray from a place, except those that start there, and the vertex at which the ray meets
    /// it.
    fn first_hit(&mut self, start: Place, way: [f64; 2], grid: &EdgeGrid) -> Option<(u32, u32)> {
        let end = self.border_ahead(start, way)?;
        let run = vector(start, end);
        let mut best: Option<(f64, u32)> = None;
        grid.along(start, end, |edges, far| {
            for edge in edges.filter(|&edge| self.edges[edge as usize] != DEAD) {
                let [c, d] = self.ends(edge);
                let (oc, od) = (cross(run, vector(start, c)), cross(run, vector(start, d)));
                if c == start || d == start || oc.signum() * od.signum() > 0 || (oc == 0 && od == 0) {
                    continue;
                }
                let side = vector(c, d);
                let along = cross(vector(start, c), side) as f64 / cross(run, side) as f64;
                if (0.0..=1.0).contains(&along) && best.is_none_or(|best| (along, edge) < best) {
                    best = Some((along, edge));
                }
            }
            // All later squares are further away; one lattice unit more, for rounding.
            let is_before = |i: usize, along: f64| {
                let left = f64::from(far[i] - start[i]) - run[i] as f64 * along;
                left * run[i].signum() as f64 > 1.0 || run[i] == 0
            };
            best.is_some_and(|(along, _)| is_before(0, along) && is_before(1, along))
        });
        let (along, edge) = best?;
        let hit: Place = [0, 1].map(|i| start[i] + (run[i] as f64 * along).round() as i32);
        // The sides of the surface stay straight.
        let [c, d] = self.ends(edge);
        let hit = match self.lattice.side_of(c, d) {
            Some(side) if side < 2 => [c[0], hit[1]],
            Some(_) => [hit[0], c[1]],
            None => hit,
        };
        (hit != start).then(|| (edge, self.vertex(hit)))
    }

    /// Cuts an edge at a vertex that lies on it, or nearly. Returns its pieces.
    fn split(&mut self, edge: u32, at: u32) -> Option<[u32; 2]> {
        let [from, to] = self.edges[edge as usize];
        if at == from || at == to {
            return None;
        }
        let pieces = [self.edges.len() as u32, self.edges.len() as u32 + 1];
        self.edges[edge as usize] = DEAD;
        self.edges.extend([[from, at], [at, to]]);
        Some(pieces)
    }

    /// Adds rough lines, each through a point, in both directions to the next line, those before it included.
    pub(super) fn cut_across(&mut self, cuts: impl IntoIterator<Item = (Vec2, Vec2, Rng)>) {
        let mut grid = EdgeGrid::new(self);
        for (from, way, rng) in cuts {
            let start = self.lattice.snap(from);
            let way = way.as_dvec2().to_array();
            let Some((there, one)) = self.first_hit(start, way, &grid) else { continue };
            let Some((back, other)) = self.first_hit(start, way.map(|x| -x), &grid) else { continue };
            self.split(there, one);
            if back != there {
                self.split(back, other);
            }
            let ends = [other, one].map(|vertex| self.lattice.pos(self.places[vertex as usize]));
            let line = self.rough_line(ends, rng);
            self.line(line.into_iter());
            grid.add_new(self);
        }
        self.edges.retain(|&edge| edge != DEAD);
    }

    /// A rough line between two points, by midpoint displacement.
    fn rough_line(&self, [from, to]: [Vec2; 2], mut rng: Rng) -> Vec<Vec2> {
        let mut line = vec![from, to];
        while line.len() < 64 && line[0].distance(line[1]) > PIECE {
            let mut finer = Vec::with_capacity(2 * line.len());
            for pair in line.windows(2) {
                let across = (pair[1] - pair[0]).perp() * (ROUGHNESS * rng.signed());
                finer.extend([pair[0], (0.5 * (pair[0] + pair[1]) + across).clamp(Vec2::ZERO, self.lattice.extent)]);
            }
            finer.push(to);
            line = finer;
        }
        line
    }
}

/// The lattice point nearest to where two lines cross.
fn crossing([a, b]: [Place; 2], [c, d]: [Place; 2]) -> Place {
    let (run, side) = (vector(a, b), vector(c, d));
    let (above, below) = (i128::from(cross(vector(a, c), side)), i128::from(cross(run, side)));
    let (above, below) = if below < 0 { (-above, -below) } else { (above, below) };
    [0, 1].map(|i| {
        let doubled = 2 * i128::from(run[i]) * above + below;
        a[i] + doubled.div_euclid(2 * below) as i32
    })
}

/// An index of edges by the squares through which they pass.
struct EdgeGrid {
    /// Squares are `1 << shift` wide.
    shift: u32,
    columns: usize,
    /// Per square: the start of its edges in `edges`; one more entry at the end.
    starts: Vec<u32>,
    edges: Vec<u32>,
    /// Number of edges of the drawing that are in the index.
    known: usize,
    /// Edges that were added later, each with the previous one in its square, or [`NONE`].
    newer: Vec<[u32; 2]>,
    /// Per square: the last of them; empty as long as there are none.
    newest: Vec<u32>,
}

impl EdgeGrid {
    fn new(drawing: &Drawing) -> Self {
        let [w, h] = drawing.lattice.corner.map(|side| side as u64 + 1);
        // About as many squares as edges.
        let mut shift = 0;
        while ((w >> shift) + 1) * ((h >> shift) + 1) > drawing.edges.len() as u64 + 16 {
            shift += 1;
        }
        let (columns, rows) = ((w >> shift) as usize + 1, (h >> shift) as usize + 1);
        let known = drawing.edges.len();
        let starts = vec![0; columns * rows + 1];
        let mut grid = Self { shift, columns, starts, edges: Vec::new(), known, newer: Vec::new(), newest: Vec::new() };
        let mut passes = Vec::with_capacity(3 * drawing.edges.len());
        for edge in 0..drawing.edges.len() as u32 {
            if drawing.edges[edge as usize] == DEAD {
                continue;
            }
            let [a, b] = drawing.ends(edge);
            grid.squares(a, b, |[column, row]| {
                passes.push((grid.square(column, row), edge));
                false
            });
        }
        for &(square, _) in &passes {
            grid.starts[square as usize + 1] += 1;
        }
        for i in 1..grid.starts.len() {
            grid.starts[i] += grid.starts[i - 1];
        }
        grid.edges.resize(passes.len(), 0);
        let mut fill = grid.starts.clone();
        for (square, edge) in passes {
            grid.edges[fill[square as usize] as usize] = edge;
            fill[square as usize] += 1;
        }
        grid
    }

    /// Adds the new edges of the drawing.
    fn add_new(&mut self, drawing: &Drawing) {
        let (mut newer, mut newest) = (std::mem::take(&mut self.newer), std::mem::take(&mut self.newest));
        newest.resize(self.starts.len() - 1, NONE);
        for edge in self.known as u32..drawing.edges.len() as u32 {
            let [a, b] = drawing.ends(edge);
            self.squares(a, b, |[column, row]| {
                let last = &mut newest[self.square(column, row) as usize];
                newer.push([edge, std::mem::replace(last, newer.len() as u32)]);
                false
            });
        }
        (self.known, self.newer, self.newest) = (drawing.edges.len(), newer, newest);
    }

    const fn square(&self, column: usize, row: usize) -> u32 {
        (row * self.columns + column) as u32
    }

    /// Visits every square that the line between two places touches, in the order of the line: row by row, and within
    /// a row one after the other. Stops when `visit` returns `true`.
    fn squares(&self, a: Place, b: Place, mut visit: impl FnMut([usize; 2]) -> bool) {
        let index = |x: i32| (x >> self.shift) as usize;
        let (low, high) = (a[0].min(b[0]), a[0].max(b[0]));
        let (first, last) = (index(a[1].min(b[1])), index(a[1].max(b[1])));
        let is_narrow = first == last || index(low) == index(high);
        let slope = f64::from(b[0] - a[0]) / f64::from(b[1] - a[1]);
        let x_at = |y: i64| f64::from(a[0]) + slope * (y as f64 - f64::from(a[1]));
        for step in 0..=last - first {
            let row = if a[1] <= b[1] { first + step } else { last - step };
            let (from, to) = if is_narrow {
                (low, high)
            } else {
                // A little wider on both sides, for rounding.
                let ends = [row, row + 1].map(|row| x_at((row << self.shift) as i64));
                let from = (ends[0].min(ends[1]) as i32).saturating_sub(2);
                (low.max(from), high.min((ends[0].max(ends[1]) as i32).saturating_add(2)))
            };
            let (from, to) = (index(from), index(to));
            for step in 0..=to.saturating_sub(from) {
                if visit([if a[0] <= b[0] { from + step } else { to - step }, row]) {
                    return;
                }
            }
        }
    }

    fn in_square(&self, square: u32) -> &[u32] {
        &self.edges[self.starts[square as usize] as usize..self.starts[square as usize + 1] as usize]
    }

    /// Visits the edges in every square on the line from a place to another, and the last corner at which the line
    /// can leave the square, until `visit` returns `true`.
    fn along(&self, a: Place, b: Place, mut visit: impl FnMut(&mut dyn Iterator<Item = u32>, Place) -> bool) {
        self.squares(a, b, |[column, row]| {
            let square = self.square(column, row);
            let mut newer = self.newest.get(square as usize).copied().unwrap_or(NONE);
            let newer = std::iter::from_fn(|| {
                let &[edge, before] = self.newer.get(newer as usize)?;
                newer = before;
                Some(edge)
            });
            let far = |i: usize, at: usize| ((at + usize::from(a[i] <= b[i])) << self.shift) as i32;
            visit(&mut self.in_square(square).iter().copied().chain(newer), [far(0, column), far(1, row)])
        });
    }

    /// Visits every pair of edges that share a square if at least one is not older than `new`, the older first; some
    /// pairs more than once.
    fn pairs(&self, new: u32, mut visit: impl FnMut(u32, u32)) {
        for square in 0..self.starts.len() as u32 - 1 {
            let edges = self.in_square(square);
            // In every square the older edges come first.
            let first = edges.iter().rposition(|&edge| edge < new).map_or(0, |last| last + 1);
            for (i, &f) in edges.iter().enumerate().skip(first.max(1)) {
                edges[..i].iter().for_each(|&e| visit(e, f));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The edge that a way meets first, by a look at each.
    fn first_of_all(drawing: &Drawing, start: Place, end: Place) -> Option<u32> {
        let run = vector(start, end);
        let alongs = (0..drawing.edges.len() as u32).filter_map(|edge| {
            let [c, d] = drawing.ends(edge);
            let (oc, od) = (orient(start, end, c), orient(start, end, d));
            if c == start || d == start || oc.signum() * od.signum() > 0 || (oc == 0 && od == 0) {
                return None;
            }
            let along = cross(vector(start, c), vector(c, d)) as f64 / cross(run, vector(c, d)) as f64;
            (0.0..=1.0).contains(&along).then_some((along, edge))
        });
        alongs.min_by(|a, b| a.partial_cmp(b).unwrap()).map(|(_, edge)| edge)
    }

    #[test]
    fn a_way_meets_what_it_would_meet_if_it_looked_at_every_line() {
        let mut rng = Rng::new(3);
        let (mut met, mut upright) = (0, 0);
        for case in 0..200 {
            let extent = Vec2::new(1.0, 0.2 + rng.unit());
            let mut drawing = Drawing::new(Lattice::new(extent).unwrap());
            let mut place = |rng: &mut Rng| Vec2::new(rng.unit(), rng.unit()) * extent;
            let draw = |drawing: &mut Drawing, rng: &mut Rng, place: &mut dyn FnMut(&mut Rng) -> Vec2| {
                let from = place(rng);
                let length = if rng.unit() < 0.2 { 1.0 } else { 0.05 };
                let to = from + Vec2::new(rng.signed(), rng.signed()) * length;
                drawing.line([from, to.clamp(Vec2::ZERO, extent)].into_iter());
            };
            (0..rng.next_u32() % 80).for_each(|_| draw(&mut drawing, &mut rng, &mut place));
            drawing.make_planar();
            let mut grid = EdgeGrid::new(&drawing);
            (0..rng.next_u32() % 40).for_each(|_| draw(&mut drawing, &mut rng, &mut place));
            grid.add_new(&drawing);
            for _ in 0..20 {
                let start = drawing.lattice.snap(place(&mut rng));
                let way = match rng.next_u32() % 4 {
                    0 => [0.0, 1.0],
                    1 => [-1.0, 0.0],
                    _ => [rng.signed().into(), rng.signed().into()],
                };
                let vertices = drawing.places.len();
                let Some(end) = drawing.border_ahead(start, way) else { continue };
                let expected = first_of_all(&drawing, start, end);
                let found = drawing.first_hit(start, way, &grid);
                if let Some((edge, _)) = found {
                    assert_eq!(Some(edge), expected, "case {case}: from {start:?} to {end:?}");
                    (met, upright) = (met + 1, upright + u32::from(way[0] == 0.0));
                } else {
                    // Nothing, or something that begins so near that it is met where the way begins.
                    let near = expected.map(|edge| drawing.ends(edge));
                    assert!(near.is_none_or(|[c, d]| orient(c, d, start).unsigned_abs() <= 1 << 26), "{near:?}");
                }
                drawing.places.truncate(vertices);
                drawing.vertex_at.retain(|_, vertex| (*vertex as usize) < vertices);
            }
        }
        assert!(met > 3000 && upright > 300, "{met} {upright}");
    }

    /// The index that is kept up to date against one that is made anew for each line.
    #[test]
    fn lines_across_are_the_same_one_by_one() {
        let mut rng = Rng::new(9);
        let mut added = 0;
        for case in 0..60 {
            let extent = Vec2::new(1.0, 0.3 + rng.unit());
            let place = |rng: &mut Rng| Vec2::new(rng.unit(), rng.unit()) * extent;
            let mut drawing = Drawing::new(Lattice::new(extent).unwrap());
            for _ in 0..rng.next_u32() % 20 {
                let line = [place(&mut rng), place(&mut rng)];
                drawing.line(line.into_iter());
            }
            drawing.make_planar();
            let cuts: Vec<_> = (0..rng.next_u32() % 50)
                .map(|i| {
                    let way = Vec2::new(rng.signed(), rng.signed()) * if i % 7 == 0 { 0.0 } else { 1.0 };
                    (place(&mut rng), way, rng.substream(u64::from(i)))
                })
                .collect();
            let (mut all, mut single) = (drawing.clone(), drawing.clone());
            all.cut_across(cuts.iter().cloned());
            for cut in cuts {
                single.cut_across([cut]);
            }
            assert_eq!((&all.places, &all.edges), (&single.places, &single.edges), "case {case}");
            added += all.edges.len() - drawing.edges.len();
        }
        assert!(added > 5000, "{added}");
    }
}
