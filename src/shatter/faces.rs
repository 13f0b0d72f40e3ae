//! [`Faces`]: what the edges of a planar drawing enclose.

use super::{
    drawing::{DEAD, Drawing},
    lattice::{Place, cross, distance_sq, vector},
};

const NONE: u32 = u32::MAX;

/// The rings around each face. Half-edge `2 e` runs along edge `e`, `2 e + 1` against it; a face lies where x turns to
/// reach y, that is inside its outer ring.
#[derive(Clone, Debug, Default)]
pub(super) struct Faces {
    /// Per half-edge: its face, or [`NONE`] beyond the border.
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
    /// The faces of `drawing`, from which all edges go that enclose nothing. It must be planar.
    pub(super) fn trace(drawing: &mut Drawing) -> Self {
        drop_loose_ends(drawing);
        loop {
            let mut faces = Self { next: successors(drawing), ..Self::default() };
            faces.find_rings(drawing);
            // What is the same ring on both sides joins two rings.
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

    /// Turns numbers of rings into numbers of faces.
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
            // From left to right: what lies to the left of a hole's leftmost place is known, be it a hole itself.
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

    /// The rings of each face in turn, the outer one first: face and half-edges.
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

    /// Drops edges until no face is smaller than `least` (twice the area) and there are at most `most` faces: the smallest
    /// joins the neighbour with which it shares most, and so on, but only one of its own `group`. `false` if there was nothing
    /// to drop.
    pub(super) fn join_small<G: PartialEq>(
        &self,
        drawing: &mut Drawing,
        least: i64,
        most: usize,
        group: impl Fn(u32) -> G,
    ) -> bool {
        let mut areas = self.areas.clone();
        let least = if areas.len() > most.max(1) {
            // Those above the first that is too many may stay.
            let (_, first, _) = areas.select_nth_unstable_by(most.max(1), |a, b| b.cmp(a));
            least.max(*first + 1)
        } else {
            least
        };
        let mut areas = self.areas.clone();
        let mut order: Vec<u32> = (0..areas.len() as u32).filter(|&face| areas[face as usize] < least).collect();
        if order.is_empty() || areas.len() < 2 {
            return false;
        }
        order.sort_by_key(|&face| (areas[face as usize], face));
        let mut edges_of: Vec<Vec<u32>> = vec![Vec::new(); areas.len()];
        for (edge, sides) in (0u32..).zip(self.face_of.as_chunks::<2>().0) {
            for side in sides.iter().filter(|&&side| side != NONE) {
                edges_of[*side as usize].push(edge);
            }
        }
        let mut joined: Vec<u32> = (0..areas.len() as u32).collect();
        for face in order {
            let face = root(&mut joined, face);
            if areas[face as usize] >= least {
                continue;
            }
            let mut shares: Vec<(u32, f64)> = Vec::new();
            for &edge in &edges_of[face as usize] {
                let [a, b] = drawing.edges[edge as usize].map(|v| drawing.places[v as usize]);
                for side in 0..2 {
                    let other = self.face_of[2 * edge as usize + side];
                    if other == NONE {
                        continue;
                    }
                    let other = root(&mut joined, other);
                    if other != face && group(other) == group(face) {
                        shares.push((other, (distance_sq(a, b) as f64).sqrt()));
                    }
                }
            }
            shares.sort_by_key(|share| share.0);
            let best = shares
                .chunk_by(|a, b| a.0 == b.0)
                .map(|shared| (shared.iter().map(|share| share.1).sum::<f64>(), shared[0].0))
                .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            if let Some((_, other)) = best {
                joined[face as usize] = other;
                areas[other as usize] += areas[face as usize];
                let edges = std::mem::take(&mut edges_of[face as usize]);
                edges_of[other as usize].extend(edges);
            }
        }
        let mut dropped = false;
        for (edge, sides) in drawing.edges.iter_mut().zip(self.face_of.as_chunks::<2>().0) {
            if sides.contains(&NONE) || root(&mut joined, sides[0]) != root(&mut joined, sides[1]) {
                continue;
            }
            *edge = DEAD;
            dropped = true;
        }
        drawing.edges.retain(|&edge| edge != DEAD);
        dropped
    }
}

fn root(joined: &mut [u32], mut face: u32) -> u32 {
    while joined[face as usize] != face {
        let above = joined[joined[face as usize] as usize];
        joined[face as usize] = above;
        face = above;
    }
    face
}

/// Where a half-edge begins.
fn place(drawing: &Drawing, half_edge: u32) -> Place {
    drawing.places[origin(drawing, half_edge) as usize]
}

/// The vertex at which a half-edge begins.
pub(super) fn origin(drawing: &Drawing, half_edge: u32) -> u32 {
    drawing.edges[half_edge as usize / 2][half_edge as usize % 2]
}

/// Drops the edges of branches that end nowhere.
fn drop_loose_ends(drawing: &mut Drawing) {
    let mut degree = vec![0u32; drawing.places.len()];
    // Of the edges at a vertex: at one with a single edge, that edge.
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
                // The half turn from x through y first; within a half turn, by the sign of the cross product.
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

/// Edges by the bands that they pass through.
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

    /// The half-edge that has `at`, the leftmost place of its ring, on its inner side, and is the next to the left.
    fn left_of(&self, drawing: &Drawing, at: Place) -> Option<u32> {
        let mut best: Option<(f64, f64, u32)> = None;
        for &edge in self.rows.get((at[1] >> self.shift) as usize)? {
            let [a, b] = drawing.edges[edge as usize].map(|vertex| drawing.places[vertex as usize]);
            // As if the place were a little further down.
            if a == at || b == at || (a[1] <= at[1]) == (b[1] <= at[1]) {
                continue;
            }
            let slope = f64::from(b[0] - a[0]) / f64::from(b[1] - a[1]);
            let x = f64::from(a[0]) + slope * f64::from(at[1] - a[1]);
            let half_edge = 2 * edge + u32::from(a[1] < b[1]);
            // Of lines that part in one point, the one that runs further right.
            if x < f64::from(at[0]) && best.is_none_or(|best| (x, slope) > (best.0, best.1)) {
                best = Some((x, slope, half_edge));
            }
        }
        best.map(|best| best.2)
    }
}
