//! Triangles and convex pieces of rings, by exact ear clipping.
//!
//! Own code instead of a library, for two reasons: the usual ones drop vertices in the middle of a straight edge,
//! which tears neighbours apart, and none of them guarantees to cover a ring exactly. Ear clipping with integers does
//! (Meisters 1975).

use super::lattice::{Place, distance_sq, orient, ring_area};
use crate::math::whole::{cross, dot, vector};
use std::collections::HashMap;

/// A corner of the ring that is being clipped.
#[derive(Clone, Copy, Debug)]
struct Corner {
    /// Its index among the places of all rings.
    place: u32,
    at: Place,
    before: u32,
    after: u32,
    /// Whether the ring does not turn inwards here: only such corners can lie in an ear.
    blocks: bool,
    clipped: bool,
}

/// Clips ears; it is kept to reuse its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Clipper {
    corners: Vec<Corner>,
    blockers: Vec<u32>,
    /// Blockers of large rings by square.
    squares: Vec<Vec<u32>>,
    origin: Place,
    shift: u32,
    columns: i32,
    rows: i32,
}

/// Up to this many blockers are checked one by one.
const FEW: usize = 48;

impl Clipper {
    /// Cuts a ring with holes into triangles: `n - 2` for a ring of `n` vertices, and two more than its vertices for
    /// each hole.
    ///
    /// The outer ring comes first and turns from x to y, the holes the other way. Rings may touch but not cross.
    /// Triangles refer to vertices by their index among those of all rings.
    pub(super) fn triangulate(&mut self, places: &[Place], rings: &[&[u32]], triangles: &mut Vec<[u32; 3]>) {
        let [outer, holes @ ..] = rings else { return };
        let at = |i: usize| places[outer[i % outer.len()] as usize];
        if holes.is_empty() && (0..outer.len()).all(|i| orient(at(i), at(i + 1), at(i + 2)) > 0) {
            triangles.extend((2..outer.len() as u32).map(|i| [0, i - 1, i]));
            return;
        }
        self.corners.clear();
        let start = self.add_ring(places, outer);
        self.bridge_holes(places, holes, start);
        self.clip(start, triangles);
    }

    fn add_ring(&mut self, places: &[Place], ring: &[u32]) -> u32 {
        let (start, n) = (self.corners.len() as u32, ring.len() as u32);
        self.corners.extend((0..n).zip(ring).map(|(i, &vertex)| Corner {
            place: start + i,
            at: places[vertex as usize],
            before: start + (i + n - 1) % n,
            after: start + (i + 1) % n,
            blocks: false,
            clipped: false,
        }));
        start
    }

    fn corner(&self, i: u32) -> &Corner {
        &self.corners[i as usize]
    }

    fn at(&self, i: u32) -> Place {
        self.corners[i as usize].at
    }

    fn turn(&self, i: u32) -> i64 {
        let corner = self.corner(i);
        orient(self.at(corner.before), corner.at, self.at(corner.after))
    }

    /// Connects each hole to the ring by an edge in both directions, the leftmost hole first.
    fn bridge_holes(&mut self, places: &[Place], holes: &[&[u32]], start: u32) {
        let mut ends: Vec<u32> = Vec::new();
        for hole in holes {
            let first = self.add_ring(places, hole);
            let leftmost = (first..self.corners.len() as u32).min_by_key(|&i| (self.at(i), i));
            ends.extend(leftmost);
        }
        ends.sort_by_key(|&i| (self.at(i), i));
        for end in ends {
            let mut ring = vec![start];
            let mut next = self.corner(start).after;
            while next != start {
                ring.push(next);
                next = self.corner(next).after;
            }
            ring.sort_by_key(|&i| (distance_sq(self.at(i), self.at(end)), i));
            // The leftmost corner of a hole sees a corner of the ring, possibly one at its own position.
            let Some(from) = ring.into_iter().find(|&i| self.sees(i, end)) else { continue };
            let copies = [self.corners.len() as u32, self.corners.len() as u32 + 1];
            self.corners.extend([*self.corner(from), *self.corner(end)]);
            // from -> end -> the hole -> copy of end -> copy of from -> on.
            let (last, on) = (self.corner(end).before, self.corner(from).after);
            self.link(from, end);
            self.link(last, copies[1]);
            self.link(copies[1], copies[0]);
            self.link(copies[0], on);
        }
    }

    fn link(&mut self, a: u32, b: u32) {
        self.corners[a as usize].after = b;
        self.corners[b as usize].before = a;
    }

    /// Whether the line between two corners runs inside, without touching any edge or corner.
    fn sees(&self, i: u32, j: u32) -> bool {
        let (a, b) = (self.at(i), self.at(j));
        if a == b {
            return true;
        }
        self.opens_to(i, b)
            && self.opens_to(j, a)
            && self.corners.iter().all(|corner| {
                let (c, d) = (corner.at, self.at(corner.after));
                let on_way = orient(a, b, c) == 0 && dot(vector(c, a), vector(c, b)) < 0;
                let crosses = (orient(a, b, c) > 0) != (orient(a, b, d) > 0)
                    && orient(a, b, c) != 0
                    && orient(a, b, d) != 0
                    && (orient(c, d, a) > 0) != (orient(c, d, b) > 0)
                    && orient(c, d, a) != 0
                    && orient(c, d, b) != 0;
                !on_way && !crosses
            })
    }

    /// Whether the line from a corner to a place starts on the inside.
    fn opens_to(&self, i: u32, to: Place) -> bool {
        let corner = self.corner(i);
        let [on, back, way] = [self.at(corner.after), self.at(corner.before), to].map(|to| vector(corner.at, to));
        match cross(on, back) {
            1.. => cross(on, way) > 0 && cross(way, back) > 0,
            0 if dot(on, back) < 0 => cross(on, way) > 0,
            0 => cross(on, way) != 0 || dot(on, way) < 0,
            _ => cross(on, way) > 0 || cross(way, back) > 0,
        }
    }

    fn clip(&mut self, start: u32, triangles: &mut Vec<[u32; 3]>) {
        let mut left = 1;
        self.blockers.clear();
        let mut i = start;
        loop {
            let blocks = self.turn(i) <= 0;
            self.corners[i as usize].blocks = blocks;
            if blocks {
                self.blockers.push(i);
            }
            i = self.corner(i).after;
            if i == start {
                break;
            }
            left += 1;
        }
        self.fill_squares();
        let (mut i, mut tried) = (start, 0);
        while left > 2 {
            let Corner { before, after, place, .. } = *self.corner(i);
            // After a round without an ear (impossible for a ring traced in a planar drawing) any corner that turns
            // right is taken.
            let is_ear = self.turn(i) > 0 && (tried > left || !self.is_blocked(before, i, after));
            if !is_ear && tried <= 2 * left {
                (i, tried) = (after, tried + 1);
                continue;
            }
            if is_ear {
                triangles.push([self.corner(before).place, place, self.corner(after).place]);
            }
            self.corners[i as usize].clipped = true;
            self.link(before, after);
            for end in [before, after] {
                self.corners[end as usize].blocks &= self.turn(end) <= 0;
            }
            left -= 1;
            tried = 0;
            // Skips the neighbour, which would make a fan of slivers.
            i = self.corner(after).after;
        }
    }

    /// Whether another corner lies in the triangle or on its edge.
    fn is_blocked(&mut self, before: u32, i: u32, after: u32) -> bool {
        let triangle = [self.at(before), self.at(i), self.at(after)];
        if self.squares.is_empty() {
            let mut k = 0;
            while let Some(&blocker) = self.blockers.get(k) {
                let corner = self.corners[blocker as usize];
                if corner.clipped || !corner.blocks {
                    self.blockers.swap_remove(k);
                } else if blocks(triangle, corner.at) {
                    return true;
                } else {
                    k += 1;
                }
            }
            return false;
        }
        let low = [0, 1].map(|k| triangle[0][k].min(triangle[1][k]).min(triangle[2][k]));
        let high = [0, 1].map(|k| triangle[0][k].max(triangle[1][k]).max(triangle[2][k]));
        let square = |place: Place| [0, 1].map(|k| (place[k] - self.origin[k]) >> self.shift);
        let ([left, top], [right, bottom]) = (square(low), square(high));
        (top..=bottom).any(|row| {
            (left..=right).any(|column| {
                self.squares[(row * self.columns + column) as usize].iter().any(|&blocker| {
                    let corner = self.corner(blocker);
                    corner.blocks && !corner.clipped && blocks(triangle, corner.at)
                })
            })
        })
    }

    fn fill_squares(&mut self) {
        self.squares.clear();
        if self.blockers.len() <= FEW {
            return;
        }
        let ends = |k: usize| {
            let coordinates = || self.corners.iter().map(|corner| corner.at[k]);
            (coordinates().min().unwrap_or(0), coordinates().max().unwrap_or(0))
        };
        let ((left, right), (top, bottom)) = (ends(0), ends(1));
        self.origin = [left, top];
        self.shift = 0;
        let size = |shift: u32| (((right - left) >> shift) + 1, ((bottom - top) >> shift) + 1);
        // In 64 bits: on 32-bit machines the first products are above all numbers.
        let count = |shift: u32| size(shift).0 as u64 * size(shift).1 as u64;
        while count(self.shift) > 2 * self.blockers.len() as u64 + 16 {
            self.shift += 1;
        }
        (self.columns, self.rows) = size(self.shift);
        self.squares.resize((self.columns * self.rows) as usize, Vec::new());
        for &blocker in &self.blockers {
            let [column, row] = [0, 1].map(|k| (self.corners[blocker as usize].at[k] - self.origin[k]) >> self.shift);
            self.squares[(row * self.columns + column) as usize].push(blocker);
        }
    }
}

fn blocks([a, b, c]: [Place; 3], p: Place) -> bool {
    orient(a, b, p) >= 0 && orient(b, c, p) >= 0 && orient(c, a, p) >= 0 && p != a && p != b && p != c
}

/// Merges triangles into convex pieces (Hertel and Mehlhorn 1983): at most four times as many as necessary.
pub(super) fn convex_pieces(places: &[Place], triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut pieces: Vec<Vec<u32>> = triangles.iter().map(|triangle| triangle.to_vec()).collect();
    let mut piece_of: HashMap<[u32; 2], u32> = HashMap::with_capacity(3 * triangles.len());
    for (piece, &[a, b, c]) in (0u32..).zip(triangles) {
        piece_of.extend([([a, b], piece), ([b, c], piece), ([c, a], piece)]);
    }
    for &[a, b, c] in triangles {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            let (Some(&p), Some(&q)) = (piece_of.get(&[a, b]), piece_of.get(&[b, a])) else { continue };
            if p == q {
                continue;
            }
            // The first piece from b around to a, then the second from after a to before b.
            let mut joined = turned_to(&pieces[p as usize], b);
            joined.extend(turned_to(&pieces[q as usize], a).into_iter().skip(1).take_while(|&vertex| vertex != b));
            let n = joined.len();
            let at = |i: usize| places[joined[i % n] as usize];
            let middle = pieces[p as usize].len() - 1;
            if orient(at(n - 1), at(0), at(1)) < 0 || orient(at(middle - 1), at(middle), at(middle + 1)) < 0 {
                continue;
            }
            for k in 0..n {
                piece_of.insert([joined[k], joined[(k + 1) % n]], p);
            }
            piece_of.remove(&[a, b]);
            piece_of.remove(&[b, a]);
            pieces[q as usize].clear();
            pieces[p as usize] = joined;
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

fn turned_to(ring: &[u32], vertex: u32) -> Vec<u32> {
    let start = ring.iter().position(|&other| other == vertex).unwrap_or(0);
    ring[start..].iter().chain(&ring[..start]).copied().collect()
}

/// A ring without the corners that deviate less than `tolerance` (Ramer 1972; Douglas and Peucker 1973).
pub(super) fn simplify(places: &[Place], ring: &[u32], tolerance: f64) -> Vec<u32> {
    let at = |i: usize| places[ring[i % ring.len()] as usize];
    let far = (0..ring.len()).max_by_key(|&i| distance_sq(at(0), at(i))).unwrap_or(0);
    let mut kept = vec![false; ring.len() + 1];
    (kept[0], kept[far]) = (true, true);
    let mut spans = vec![(0, far), (far, ring.len())];
    while let Some((from, to)) = spans.pop() {
        let (a, b) = (at(from), at(to));
        let length = (distance_sq(a, b) as f64).sqrt();
        let strays = |i: usize| {
            if length == 0.0 {
                (distance_sq(a, at(i)) as f64).sqrt()
            } else {
                orient(a, b, at(i)).abs() as f64 / length
            }
        };
        let most = (from + 1..to).map(|i| (strays(i), i)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, i)) = most.filter(|most| most.0 > tolerance) {
            kept[i] = true;
            spans.extend([(from, i), (i, to)]);
        }
    }
    (0..ring.len()).filter(|&i| kept[i]).map(|i| ring[i]).collect()
}

/// Twice the area of triangles.
pub(super) fn area_of(places: &[Place], triangles: &[[u32; 3]]) -> i64 {
    triangles.iter().map(|triangle| ring_area(triangle.iter().map(|&vertex| places[vertex as usize]))).sum()
}
