//! Adds edges: each joins two loops, or splits a loop in two and so closes a cell.

use super::{
    Cell, CellTracker,
    half_edge::{Cause, Gap, Loop, NONE, Overlap, Side, Sums, Vertex},
};
use crate::math::whole::{cross, dot, vector};
use glam::Vec2;

impl CellTracker {
    /// The vertex at `pos`. If there is none a new one is added, in the border if it lies on it.
    pub(super) fn add_vertex(&mut self, name: u32, pos: Vec2) -> u32 {
        if !pos.is_finite() {
            return NONE;
        }
        let at = self.whole(pos.clamp(Vec2::ZERO, self.extent));
        let vertex = self.vertices.len() as u32;
        let known = *self.vertex_at.entry(at).or_insert(vertex);
        if known != vertex {
            return known;
        }
        self.vertices.push(Vertex { name, pos, at, first: NONE, part: vertex });
        if let Some(way) = self.way(at)
            && let Some((_, &inner)) = self.border.range(..way).next_back()
        {
            self.split_border(inner, vertex);
            self.border.insert(way, self.vertices[vertex as usize].first);
        }
        vertex
    }

    /// Inserts `vertex` into the border's edge `inner`.
    pub(super) fn split_border(&mut self, inner: u32, vertex: u32) {
        let outer = inner ^ 1;
        let end = self.origin[outer as usize];
        // The half-edge before `outer` around its origin.
        let mut before = inner;
        while self.next[before as usize] != outer {
            before = self.next[before as usize] ^ 1;
        }
        let (rest, back) = (self.origin.len() as u32, self.origin.len() as u32 + 1);
        self.origin.extend([vertex, end]);
        self.origin[outer as usize] = vertex;
        self.next.extend([self.next[inner as usize], outer]);
        self.next[inner as usize] = rest;
        self.next[before as usize] = back;
        self.loop_of.extend([self.loop_of[inner as usize], self.loop_of[outer as usize]]);
        self.vertices[end as usize].first = back;
        self.vertices[vertex as usize].first = rest;
        self.vertices[vertex as usize].part = 0;
    }

    /// Where an edge from `u` towards `v` is inserted at `u`; `Err` if it would run along another edge, `Ok(None)` if
    /// it is the first.
    pub(super) fn gap(&self, u: u32, v: u32) -> Result<Option<Gap>, Overlap> {
        let vertex = &self.vertices[u as usize];
        if vertex.first == NONE {
            return Ok(None);
        }
        let new = vector(vertex.at, self.at(v));
        // The first half-edge to the left of the new one starts just before the new one in the twin's loop.
        let mut left = (vertex.first, self.turn(new, vertex, vertex.first)?);
        let mut half_edge = self.next[vertex.first as usize ^ 1];
        while half_edge != vertex.first {
            let turn = self.turn(new, vertex, half_edge)?;
            let (half, way) = left.1;
            if turn.0 < half || (turn.0 == half && cross(turn.1, way) > 0) {
                left = (half_edge, turn);
            }
            half_edge = self.next[half_edge as usize ^ 1];
        }
        let before = left.0 ^ 1;
        Ok(Some(Gap { before, after: self.next[before as usize] }))
    }

    /// The half turn from `new` in which a half-edge lies, and its direction.
    pub(super) fn turn(&self, new: [i64; 2], from: &Vertex, half_edge: u32) -> Result<(u8, [i64; 2]), Overlap> {
        let way = vector(from.at, self.at(self.head(half_edge)));
        match cross(new, way) {
            1.. => Ok((0, way)),
            0 if dot(new, way) < 0 => Ok((1, way)),
            0 => Err(Overlap),
            _ => Ok((2, way)),
        }
    }

    /// Adds the edge between two vertices, unless it runs along another or crosses one.
    pub(super) fn join(&mut self, u: u32, v: u32, cause: Cause) {
        if u == v || u == NONE || v == NONE || self.along_border(u, v) {
            return;
        }
        let (Ok(gap_u), Ok(gap_v)) = (self.gap(u, v), self.gap(v, u)) else { return };
        let loops = [gap_u, gap_v].map(|gap| gap.map(|gap| self.find_loop(gap.after)));
        let Some(side) = self.common_side(loops) else { return };
        let (part_u, part_v) = (self.part(u), self.part(v));
        let closes = part_u == part_v;
        // In a planar drawing two visible vertices of one part are on one loop, and those of two parts are not.
        if closes != (loops[0] == loops[1] && loops[0].is_some()) {
            return;
        }

        let (out, back) = (self.origin.len() as u32, self.origin.len() as u32 + 1);
        self.origin.extend([u, v]);
        self.next.extend([back, out]);
        for (vertex, gap, leaving) in [(u, gap_u, out), (v, gap_v, back)] {
            match gap {
                Some(Gap { before, after }) => {
                    self.next[before as usize] = leaving;
                    self.next[leaving as usize ^ 1] = after;
                }
                None => self.vertices[vertex as usize].first = leaving,
            }
        }
        if closes {
            let whole = loops[0].unwrap_or(0);
            self.loop_of.extend([whole; 2]);
            self.close(whole, out, cause);
            return;
        }
        // The border's part keeps its number.
        let (above, below) = (part_u.min(part_v), part_u.max(part_v));
        self.vertices[below as usize].part = above;
        let merged = match loops {
            [Some(a), Some(b)] => self.merge(a, b, side),
            [Some(one), None] | [None, Some(one)] => one,
            [None, None] => {
                let root = self.loops.len() as u32;
                self.loops.push(Loop { root, side, sums: Sums::default() });
                root
            }
        };
        self.loop_of.extend([merged; 2]);
    }

    /// Whether the line between two vertices lies on the border.
    pub(super) fn along_border(&self, u: u32, v: u32) -> bool {
        let (a, b) = (self.at(u), self.at(v));
        (0..2).any(|i| a[i] == b[i] && (a[i] == 0 || a[i] == self.corner[i]))
    }

    /// The side to the left of the loops at the ends of a new edge, if both can be the same.
    pub(super) fn common_side(&self, loops: [Option<u32>; 2]) -> Option<Side> {
        let unknown = Side::Around { host: NONE };
        let [a, b] = loops.map(|root| root.map_or(unknown, |root| self.loops[root as usize].side));
        match (a, b) {
            (Side::Beyond, _) | (_, Side::Beyond) => None,
            (Side::Cell(cell), Side::Cell(other)) => (cell == other).then_some(a),
            (Side::Cell(cell), Side::Around { host }) => (host == NONE || host == cell).then_some(a),
            (Side::Around { host }, Side::Cell(cell)) => (host == NONE || host == cell).then_some(b),
            (Side::Around { host }, Side::Around { host: other }) => {
                (host == NONE || other == NONE || host == other).then_some(if host == NONE { b } else { a })
            }
        }
    }

    /// Merges the loops of two parts into one.
    pub(super) fn merge(&mut self, a: u32, b: u32, side: Side) -> u32 {
        let hole_of = |root: u32| match self.loops[root as usize].side {
            Side::Around { host } if host != NONE => Some(host),
            _ => None,
        };
        let (hole_a, hole_b) = (hole_of(a), hole_of(b));
        // A hole that is now connected to the outline is no longer a hole; of two connected holes one remains.
        if matches!(side, Side::Cell(_)) {
            for (host, root) in [(hole_a, a), (hole_b, b)] {
                host.into_iter().for_each(|host| self.remove_holes(host, &[root]));
            }
        } else if let (Some(_), Some(host)) = (hole_a, hole_b) {
            self.remove_holes(host, &[b]);
        }
        let sums = self.loops[b as usize].sums;
        self.loops[b as usize].root = a;
        let root = &mut self.loops[a as usize];
        root.sums.add(sums);
        root.side = side;
        a
    }

    /// Removes loops from a cell's list of holes.
    pub(super) fn remove_holes(&mut self, host: u32, roots: &[u32]) {
        let mut holes = std::mem::take(&mut self.cells[host as usize].holes);
        holes.retain(|&hole| !roots.contains(&self.loop_root(hole)));
        self.cells[host as usize].holes = holes;
    }

    /// Handles the edge `out` that has just split the loop `whole`: a cell has closed.
    pub(super) fn close(&mut self, whole: u32, out: u32, Cause { birth, impact }: Cause) {
        let (mut one, mut other) = (self.next[out as usize], self.next[out as usize ^ 1]);
        while one != out && other != out ^ 1 {
            (one, other) = (self.next[one as usize], self.next[other as usize]);
        }
        let (short, long) = if one == out { (out, out ^ 1) } else { (out ^ 1, out) };

        let cut = self.loops.len() as u32;
        let mut half_edge = short;
        while self.loop_of[half_edge as usize] != cut {
            self.loop_of[half_edge as usize] = cut;
            half_edge = self.next[half_edge as usize];
        }
        let (side, sums) = (self.loops[whole as usize].side, self.sums_from(short));
        self.loops.push(Loop { root: cut, side, sums });
        self.loops[whole as usize].sums.subtract(sums);
        let rest = self.loops[whole as usize].sums;

        // The smaller part of a cell is the new one; for a hole's loop it is the part with the right orientation.
        let short_is_new = match side {
            Side::Cell(_) => sums.area < rest.area || (sums.area == rest.area && short == out),
            _ => sums.area > rest.area,
        };
        let ((new, new_loop), (old, old_loop)) =
            if short_is_new { ((short, cut), (long, whole)) } else { ((long, whole), (short, cut)) };
        let id = self.cells.len() as u32;
        self.cells.push(Cell { area: 0.0, centroid: Vec2::ZERO, birth, impact, start: new, holes: Vec::new() });
        self.loops[new_loop as usize].side = Side::Cell(id);
        let host = match side {
            Side::Cell(cell) => {
                self.cells[cell as usize].start = old;
                cell
            }
            Side::Around { host } if host != NONE => {
                self.remove_holes(host, &[whole, cut]);
                host
            }
            _ => self.cell_around(self.at(self.origin[new as usize]), Some(id)),
        };
        self.hand_over_holes(host, id);
        if let Some(mut closings) = self.closings.take() {
            let sums = self.loops[new_loop as usize].sums;
            let corners = self.corners(new);
            let outline = corners.into_iter().map(|vertex| self.vertices[vertex as usize].pos);
            closings.push(Cause { birth, impact }, host, self.area_and_centre(sums, new), outline);
            self.closings = Some(closings);
        }
        if !matches!(side, Side::Cell(_)) {
            self.loops[old_loop as usize].side = Side::Around { host };
            self.cells[host as usize].holes.push(old);
        }
        self.touched.extend([host, id]);
    }

    /// Moves the holes of a cell that lie inside another cell's loop to that cell.
    pub(super) fn hand_over_holes(&mut self, from: u32, to: u32) {
        let start = self.cells[to as usize].start;
        let (inside, outside): (Vec<u32>, Vec<u32>) = std::mem::take(&mut self.cells[from as usize].holes)
            .into_iter()
            .partition(|&hole| self.is_inside(start, self.at(self.origin[hole as usize])));
        for &hole in &inside {
            let root = self.find_loop(hole);
            self.loops[root as usize].side = Side::Around { host: to };
        }
        self.cells[from as usize].holes = outside;
        self.cells[to as usize].holes = inside;
    }
}
