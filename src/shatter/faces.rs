//! [`Faces`]: the areas that the edges of a planar drawing enclose.

use super::{
    drawing::{DEAD, Drawing},
    lattice::{NONE, Place, distance_sq},
};
use crate::math::whole::{cross, vector};
use std::cmp::Reverse;

/// The rings around each face. Half-edge `2 e` runs along edge `e`, `2 e + 1` against it. A face lies on the side to
/// which x turns to reach y, that is inside its outer ring.
#[derive(Clone, Debug, Default)]
pub(super) struct Faces {
    /// Per half-edge: its face, or [`NONE`] outside the border.
    pub(super) face_of: Vec<u32>,
    /// One half-edge and twice the area of each ring: first the outer ring of each face, by number, then all holes.
    rings: Vec<(u32, i64)>,
    /// Per hole: its face.
    hosts: Vec<u32>,
    next: Vec<u32>,
    /// Twice the area of each face, without its holes.
    pub(super) areas: Vec<i64>,
}

impl Faces {
    /// The faces of `drawing`, which must be planar. Edges that enclose nothing are removed from it.
    pub(super) fn trace(drawing: &mut Drawing) -> Self {
        drop_loose_ends(drawing);
        loop {
            let mut faces = Self { next: successors(drawing), ..Self::default() };
            faces.find_rings(drawing);
            // An edge with the same ring on both sides is a bridge between two rings.
            let mut bridges = false;
            for (edge, sides) in drawing.edges.iter_mut().zip(faces.face_of.as_chunks::<2>().0) {
                if sides[0] == sides[1] {
                    *edge = DEAD;
                    bridges = true;
                }
            }
            if !bridges {
                faces.sort_rings(drawing);
                return faces;
            }
            drawing.edges.retain(|&edge| edge != DEAD);
        }
    }

    /// Numbers all rings, in `face_of`.
    fn find_rings(&mut self, drawing: &Drawing) {
        self.face_of.resize(self.next.len(), NONE);
        for start in 0..self.next.len() {
            if self.face_of[start] != NONE {
                continue;
            }
            let (mut half_edge, mut area) = (start, 0i64);
            let mut from = place(drawing, start as u32);
            while self.face_of[half_edge] == NONE {
                self.face_of[half_edge] = self.rings.len() as u32;
                half_edge = self.next[half_edge] as usize;
                let to = place(drawing, half_edge as u32);
                area += cross(from.map(i64::from), to.map(i64::from));
                from = to;
            }
            self.rings.push((start as u32, area));
        }
    }

    /// Converts numbers of rings into numbers of faces.
    fn sort_rings(&mut self, drawing: &Drawing) {
        let beyond = self.rings.iter().map(|ring| ring.1).min().unwrap_or(0);
        let beyond = self.rings.iter().position(|ring| ring.1 == beyond);
        let mut face_of_ring = vec![NONE; self.rings.len()];
        let mut faces = 0;
        for (face, ring) in face_of_ring.iter_mut().zip(&self.rings) {
            if ring.1 > 0 {
                *face = faces;
                faces += 1;
            }
        }
        let rings = std::mem::take(&mut self.rings);
        self.rings = rings.iter().copied().filter(|ring| ring.1 > 0).collect();
        self.areas = self.rings.iter().map(|ring| ring.1).collect();
        let holes: Vec<usize> = (0..rings.len()).filter(|&i| rings[i].1 <= 0 && Some(i) != beyond).collect();
        if !holes.is_empty() {
            let rows = Rows::new(drawing);
            // From left to right: the ring to the left of a hole's leftmost vertex is already known, even if it is a
            // hole itself.
            let mut leftmost: Vec<(Place, usize)> =
                holes.iter().map(|&hole| (self.leftmost(drawing, rings[hole].0), hole)).collect();
            leftmost.sort_unstable();
            for (at, hole) in leftmost {
                let ring = rows.left_of(drawing, at).map(|half_edge| self.face_of[half_edge as usize]);
                let face = ring.map_or(NONE, |ring| face_of_ring[ring as usize]);
                face_of_ring[hole] = face;
                if let Some(area) = self.areas.get_mut(face as usize) {
                    *area += rings[hole].1;
                    self.rings.push(rings[hole]);
                    self.hosts.push(face);
                }
            }
        }
        for face in &mut self.face_of {
            *face = face_of_ring[*face as usize];
        }
    }

    fn leftmost(&self, drawing: &Drawing, start: u32) -> Place {
        self.ring(start).map(|half_edge| place(drawing, half_edge)).min().unwrap_or_default()
    }

    /// The half-edges of a ring.
    fn ring(&self, start: u32) -> impl Iterator<Item = u32> + '_ {
        let mut following = Some(start);
        std::iter::from_fn(move || {
            let half_edge = following?;
            following = Some(self.next[half_edge as usize]).filter(|&next| next != start);
            Some(half_edge)
        })
    }

    pub(super) fn len(&self) -> usize {
        self.areas.len()
    }

    /// The rings of each face, the outer one first: face and half-edges.
    pub(super) fn rings(&self) -> impl Iterator<Item = (u32, impl Iterator<Item = u32> + '_)> {
        let mut holes: Vec<u32> = (0..self.hosts.len() as u32).collect();
        holes.sort_by_key(|&hole| self.hosts[hole as usize]);
        let (mut face, mut hole) = (0, 0);
        let mut outer_done = false;
        std::iter::from_fn(move || {
            loop {
                if face == self.areas.len() {
                    return None;
                }
                if !std::mem::replace(&mut outer_done, true) {
                    return Some((face as u32, self.ring(self.rings[face].0)));
                }
                if let Some(&next) = holes.get(hole).filter(|&&next| self.hosts[next as usize] == face as u32) {
                    hole += 1;
                    return Some((face as u32, self.ring(self.rings[self.areas.len() + next as usize].0)));
                }
                (face, outer_done) = (face + 1, false);
            }
        })
    }

    /// Removes edges until no face is smaller than `least` (twice the area) and there are at most `most` faces. The
    /// smallest face is merged into the neighbour of its own `group` with which it shares most, and so on. Returns
    /// `false` if there was nothing to remove.
    pub(super) fn join_small<G: PartialEq>(
        &self,
        drawing: &mut Drawing,
        least: i64,
        most: usize,
        group: impl Fn(u32) -> G,
    ) -> bool {
        let length = |ends: &[u32; 2]| {
            let [a, b] = ends.map(|vertex| drawing.places[vertex as usize]);
            (distance_sq(a, b) as f64).sqrt()
        };
        let lengths: Vec<f64> = drawing.edges.iter().map(length).collect();
        let edges = EdgesOf::new(self);
        let (mut areas, mut joined) = (self.areas.clone(), Joined::new(self.len()));
        let (mut order, mut shares): (Vec<u32>, Vec<(u32, f64)>) = (Vec::new(), Vec::new());
        // Merged small faces may become large enough, or there may still be too many: repeat until no face has a
        // neighbour to merge with.
        let mut any = true;
        while std::mem::take(&mut any) {
            order.clear();
            order.extend((0..areas.len() as u32).filter(|&face| joined.root(face) == face));
            let mut least = least;
            if order.len() > most.max(1) {
                // Faces above the first surplus one may stay.
                let (_, &mut first, _) =
                    order.select_nth_unstable_by_key(most.max(1), |&face| Reverse(areas[face as usize]));
                least = least.max(areas[first as usize] + 1);
            }
            order.retain(|&face| areas[face as usize] < least);
            order.sort_unstable_by_key(|&face| (areas[face as usize], face));
            for &face in &order {
                let face = joined.root(face);
                if areas[face as usize] >= least {
                    continue;
                }
                shares.clear();
                let mut member = face;
                while member != NONE {
                    for &edge in edges.of(member) {
                        for side in [2 * edge, 2 * edge + 1] {
                            let other = self.face_of[side as usize];
                            let other = if other == NONE { face } else { joined.root(other) };
                            if other == face || group(other) != group(face) {
                                continue;
                            }
                            let length = lengths[edge as usize];
                            match shares.iter_mut().rev().find(|share| share.0 == other) {
                                Some(share) => share.1 += length,
                                None => shares.push((other, length)),
                            }
                        }
                    }
                    member = joined.following[member as usize];
                }
                let best = shares.iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
                if let Some(&(other, _)) = best {
                    joined.join(face, other);
                    areas[other as usize] += areas[face as usize];
                    any = true;
                }
            }
        }
        let mut dropped = false;
        for (edge, sides) in drawing.edges.iter_mut().zip(self.face_of.as_chunks::<2>().0) {
            if sides.contains(&NONE) || joined.root(sides[0]) != joined.root(sides[1]) {
                continue;
            }
            *edge = DEAD;
            dropped = true;
        }
        drawing.edges.retain(|&edge| edge != DEAD);
        dropped
    }
}

/// The edges around each face.
struct EdgesOf {
    /// Per face: the start of its edges in `edges`; one more entry at the end.
    starts: Vec<u32>,
    edges: Vec<u32>,
}

impl EdgesOf {
    fn new(faces: &Faces) -> Self {
        let mut starts = vec![0; faces.len() + 1];
        for &face in faces.face_of.iter().filter(|&&face| face != NONE) {
            starts[face as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let (mut fill, mut edges) = (starts.clone(), vec![0; starts[faces.len()] as usize]);
        for (half_edge, &face) in (0..).zip(&faces.face_of).filter(|(_, face)| **face != NONE) {
            let at = &mut fill[face as usize];
            edges[*at as usize] = half_edge / 2;
            *at += 1;
        }
        Self { starts, edges }
    }

    fn of(&self, face: u32) -> &[u32] {
        &self.edges[self.starts[face as usize] as usize..self.starts[face as usize + 1] as usize]
    }
}

/// Which faces have been merged (union-find).
struct Joined {
    above: Vec<u32>,
    /// Per face: the next one of the same set, starting at the root.
    following: Vec<u32>,
    /// Per root: the last face of its set.
    last: Vec<u32>,
}

impl Joined {
    fn new(faces: usize) -> Self {
        let each: Vec<u32> = (0..faces as u32).collect();
        Self { above: each.clone(), following: vec![NONE; faces], last: each }
    }

    fn root(&mut self, mut face: u32) -> u32 {
        while self.above[face as usize] != face {
            let above = self.above[self.above[face as usize] as usize];
            self.above[face as usize] = above;
            face = above;
        }
        face
    }

    /// Merges one root into another.
    fn join(&mut self, root: u32, other: u32) {
        self.above[root as usize] = other;
        self.following[self.last[other as usize] as usize] = root;
        self.last[other as usize] = self.last[root as usize];
    }
}

/// The vertex position at which a half-edge starts.
fn place(drawing: &Drawing, half_edge: u32) -> Place {
    drawing.places[origin(drawing, half_edge) as usize]
}

/// The vertex at which a half-edge starts.
pub(super) fn origin(drawing: &Drawing, half_edge: u32) -> u32 {
    drawing.edges[half_edge as usize / 2][half_edge as usize % 2]
}

/// Removes the edges of branches with open ends.
fn drop_loose_ends(drawing: &mut Drawing) {
    let mut degree = vec![0u32; drawing.places.len()];
    // Per vertex the XOR of its edges: for a vertex with a single edge, that edge.
    let mut edges = vec![0u32; drawing.places.len()];
    for (edge, ends) in (0u32..).zip(&drawing.edges) {
        for &end in ends {
            degree[end as usize] += 1;
            edges[end as usize] ^= edge;
        }
    }
    let mut any = false;
    for vertex in 0..degree.len() {
        let mut end = vertex;
        while degree[end] == 1 {
            let edge = edges[end];
            let [a, b] = std::mem::replace(&mut drawing.edges[edge as usize], DEAD);
            for end in [a, b] {
                degree[end as usize] -= 1;
                edges[end as usize] ^= edge;
            }
            end ^= (a ^ b) as usize;
            any = true;
        }
    }
    if any {
        drawing.edges.retain(|&edge| edge != DEAD);
    }
}

/// Per half-edge: the next one around the face beside it.
fn successors(drawing: &Drawing) -> Vec<u32> {
    let mut starts = vec![0u32; drawing.places.len() + 1];
    for &end in drawing.edges.iter().flatten() {
        starts[end as usize + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let mut leaving = vec![0u32; 2 * drawing.edges.len()];
    let mut fill = starts.clone();
    for half_edge in 0..leaving.len() as u32 {
        let slot = &mut fill[origin(drawing, half_edge) as usize];
        leaving[*slot as usize] = half_edge;
        *slot += 1;
    }
    let mut next = vec![0u32; leaving.len()];
    for (vertex, ends) in starts.windows(2).enumerate() {
        let around = &mut leaving[ends[0] as usize..ends[1] as usize];
        if around.len() > 2 {
            let centre = drawing.places[vertex];
            let way = |half_edge: u32| vector(centre, place(drawing, half_edge ^ 1));
            around.sort_unstable_by(|&a, &b| {
                let (a, b) = (way(a), way(b));
                // First the half turn from x through y; within a half turn, by the sign of the cross product.
                is_back(a).cmp(&is_back(b)).then(0.cmp(&cross(a, b)))
            });
        }
        let mut last = around.last().copied().unwrap_or(0);
        for &half_edge in &*around {
            next[half_edge as usize ^ 1] = last;
            last = half_edge;
        }
    }
    next
}

const fn is_back([x, y]: [i64; 2]) -> bool {
    y < 0 || (y == 0 && x < 0)
}

/// An index of edges by the bands through which they pass.
struct Rows {
    shift: u32,
    rows: Vec<Vec<u32>>,
}

impl Rows {
    fn new(drawing: &Drawing) -> Self {
        let height = drawing.lattice.corner[1] as u32;
        let mut shift = 0;
        while u64::from(height >> shift) + 1 > drawing.edges.len() as u64 / 4 + 1 {
            shift += 1;
        }
        let mut rows = vec![Vec::new(); (height >> shift) as usize + 1];
        for (edge, ends) in (0u32..).zip(&drawing.edges) {
            let [a, b] = ends.map(|vertex| drawing.places[vertex as usize][1]);
            for row in &mut rows[(a.min(b) >> shift) as usize..=(a.max(b) >> shift) as usize] {
                row.push(edge);
            }
        }
        Self { shift, rows }
    }

    /// The nearest half-edge to the left of `at`, the leftmost vertex of a ring, with `at` on its inner side.
    fn left_of(&self, drawing: &Drawing, at: Place) -> Option<u32> {
        let mut best: Option<(f64, f64, u32)> = None;
        for &edge in self.rows.get((at[1] >> self.shift) as usize)? {
            let [a, b] = drawing.edges[edge as usize].map(|vertex| drawing.places[vertex as usize]);
            // As if the vertex were a little further down.
            if a == at || b == at || (a[1] <= at[1]) == (b[1] <= at[1]) {
                continue;
            }
            let slope = f64::from(b[0] - a[0]) / f64::from(b[1] - a[1]);
            let x = f64::from(a[0]) + slope * f64::from(at[1] - a[1]);
            let half_edge = 2 * edge + u32::from(a[1] < b[1]);
            // If lines start at the same point, the one that runs further right.
            if x < f64::from(at[0]) && best.is_none_or(|best| (x, slope) > (best.0, best.1)) {
                best = Some((x, slope, half_edge));
            }
        }
        best.map(|best| best.2)
    }
}
