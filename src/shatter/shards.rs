//! [`Shards`]: the pieces and their properties.

use super::{
    drawing::Drawing,
    faces::{Faces, origin},
    lattice::{Lattice, Place, distance_sq, ring_area},
    triangulate::{Clipper, area_of, convex_pieces, simplify},
};
use crate::math::whole::cross;
use glam::{DVec2, Vec2};
use std::{ops::Range, sync::Arc};

/// A piece of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct ShardShape {
    /// Area, pattern units squared.
    pub area: f32,
    /// Centre of the area, pattern units.
    pub centroid: Vec2,
    /// Integral of the squared distance from the centroid over the area (polar second moment), pattern units to the
    /// fourth. Times the mass per area it is the moment of inertia.
    pub second_moment: f32,
    /// Length of its outline on each side of the surface: left, right, top, bottom; pattern units.
    pub border: [f32; 4],
    pub(super) rings: Range<u32>,
    pub(super) triangles: Range<u32>,
    pub(super) neighbours: Range<u32>,
}

/// A shard that shares edges with another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Number of the neighbour.
    pub shard: u32,
    /// Length of the common edges, pattern units.
    pub length: f32,
}

/// Corners of a convex polygon in pattern units, turning from x to y.
pub type ConvexPiece = Vec<Vec2>;

/// The pieces of a surface, by number. They tile it.
///
/// ```
/// use bevy_crack::shatter::{ConvexPiece, Cuts, Neighbour, ShardShape, ShatterParams, Shards, shatter};
///
/// // A square in the middle of a pane, and the frame around it.
/// let mut cuts = Cuts::new([1.0, 1.0].into())?;
/// cuts.add_line(&[[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75], [0.25, 0.25]].map(Into::into))?;
/// let shards: Shards = shatter(cuts, &ShatterParams::DEFAULT)?;
/// let (middle, frame) = (shards.at([0.5, 0.5].into()).expect("a shard"), shards.at([0.1, 0.5].into()).expect("a shard"));
/// let area = |shard: &ShardShape| shard.area;
/// assert_eq!([middle, frame].map(|shard| shards.get(shard).map(area)), [Some(0.25), Some(0.75)]);
/// assert_eq!(shards.neighbours(middle), [Neighbour { shard: frame, length: 2.0 }]);
///
/// // The frame has four corners outside and four around its hole, and eight triangles that name them.
/// assert_eq!(shards.outline(frame).len(), 4);
/// assert_eq!(shards.holes(frame).count(), 1);
/// let corners = shards.corners(frame).iter().map(|&corner| shards.positions()[corner as usize]);
/// assert!(corners.clone().any(|corner| corner == shards.extent()));
/// assert_eq!((corners.len(), shards.triangles(frame).len()), (8, 8));
///
/// // A point that lies in the frame, unlike its middle.
/// let inner = shards.inner_point(frame).expect("a shard");
/// assert_eq!((shards.distance(frame, inner), shards.distance(frame, [0.5, 0.5].into())), (0.0, 0.25));
/// let pieces: Vec<ConvexPiece> = shards.convex_pieces(frame, 0.0);
/// assert!(pieces.len() >= 4);
/// assert!(!shards.is_empty() && Shards::default().is_empty());
/// # Ok::<(), bevy_crack::shatter::ShatterError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Shards {
    pub(super) lattice: Lattice,
    pub(super) places: Vec<Place>,
    positions: Vec<Vec2>,
    /// Indices of positions, ring after ring.
    outlines: Vec<u32>,
    /// Start of each ring; one more entry at the end.
    rings: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    neighbours: Vec<Neighbour>,
    pub(super) shards: Vec<ShardShape>,
    carried: Arc<[Vec<Vec2>]>,
}

/// A surface of 1 x 1 without pieces.
impl Default for Shards {
    fn default() -> Self {
        Self {
            lattice: Lattice::ONE,
            places: Vec::new(),
            positions: Vec::new(),
            outlines: Vec::new(),
            rings: vec![0],
            triangles: Vec::new(),
            neighbours: Vec::new(),
            shards: Vec::new(),
            carried: Arc::default(),
        }
    }
}

impl Shards {
    pub(super) fn new(drawing: &Drawing, faces: &Faces, carried: Vec<Vec<Vec2>>) -> Self {
        let lattice = drawing.lattice;
        let mut shards = Self {
            lattice,
            places: drawing.places.clone(),
            positions: drawing.places.iter().map(|&place| lattice.pos(place)).collect(),
            outlines: Vec::with_capacity(2 * drawing.edges.len()),
            rings: vec![0],
            triangles: Vec::with_capacity(2 * drawing.edges.len()),
            neighbours: Vec::with_capacity(2 * faces.len() + 16),
            shards: Vec::with_capacity(faces.len()),
            carried: carried.into(),
        };
        let mut builder =
            Builder { shards: &mut shards, clipper: Clipper::default(), shared: Vec::new(), border: [0.0; 4] };
        let mut current = 0;
        for (face, ring) in faces.rings() {
            if face != current {
                builder.finish();
                current = face;
            }
            builder.add_ring(drawing, faces, ring);
        }
        if faces.len() > 0 {
            builder.finish();
        }
        shards
    }

    /// Number of shards.
    #[must_use]
    pub fn len(&self) -> usize {
        self.shards.len()
    }

    /// Whether there are no shards.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.shards.is_empty()
    }

    /// Size of the surface, pattern units.
    #[must_use]
    pub const fn extent(&self) -> Vec2 {
        self.lattice.extent
    }

    /// All shards, by number.
    pub fn iter(&self) -> std::slice::Iter<'_, ShardShape> {
        self.shards.iter()
    }

    /// The shard with this number; `None` if there is none.
    #[must_use]
    pub fn get(&self, shard: u32) -> Option<&ShardShape> {
        self.shards.get(shard as usize)
    }

    /// Positions in pattern units, to which outlines and triangles refer by index.
    #[must_use]
    pub fn positions(&self) -> &[Vec2] {
        &self.positions
    }

    /// The outline of a shard, turning from x to y: indices of [`positions`](Self::positions). Neighbours share every
    /// vertex between them.
    #[must_use]
    pub fn outline(&self, shard: u32) -> &[u32] {
        self.rings_of(shard).next().unwrap_or(&[])
    }

    /// The outlines of holes in a shard, in the opposite direction.
    pub fn holes(&self, shard: u32) -> impl Iterator<Item = &[u32]> {
        self.rings_of(shard).skip(1)
    }

    pub(super) fn rings_of(&self, shard: u32) -> impl Iterator<Item = &[u32]> {
        let rings = self.get(shard).map_or(0..0, |shard| shard.rings.clone());
        rings.map(|ring| &self.outlines[self.rings[ring as usize] as usize..self.rings[ring as usize + 1] as usize])
    }

    /// The outline of a shard followed by its holes: indices of [`positions`](Self::positions).
    #[must_use]
    pub fn corners(&self, shard: u32) -> &[u32] {
        let rings = self.get(shard).map_or(0..0, |shard| shard.rings.clone());
        &self.outlines[self.rings[rings.start as usize] as usize..self.rings[rings.end as usize] as usize]
    }

    /// Triangles that fill a shard, turning from x to y: indices of its [`corners`](Self::corners). Their edges on
    /// the outline are exactly the shard's edges.
    #[must_use]
    pub fn triangles(&self, shard: u32) -> &[[u32; 3]] {
        let range = self.get(shard).map_or(0..0, |shard| shard.triangles.clone());
        &self.triangles[range.start as usize..range.end as usize]
    }

    /// The neighbours of a shard, by number.
    #[must_use]
    pub fn neighbours(&self, shard: u32) -> &[Neighbour] {
        let range = self.get(shard).map_or(0..0, |shard| shard.neighbours.clone());
        &self.neighbours[range.start as usize..range.end as usize]
    }

    /// The lines by which cracks were extended, pattern units. They are cracks too and should be drawn.
    ///
    /// ```
    /// use bevy_crack::shatter::{Cuts, ShatterParams, shatter};
    ///
    /// // A crack that ends in the middle of the pane.
    /// let mut cuts = Cuts::new([1.0, 1.0].into())?;
    /// cuts.add_line(&[[0.5, 0.0].into(), [0.5, 0.5].into()])?;
    /// let shards = shatter(cuts.clone(), &ShatterParams::DEFAULT)?;
    /// assert_eq!((shards.len(), shards.extended_lines().len()), (1, 0));
    /// let shards = shatter(cuts, &ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT })?;
    /// assert_eq!((shards.len(), shards.extended_lines().len()), (2, 1));
    /// # Ok::<(), bevy_crack::shatter::ShatterError>(())
    /// ```
    #[must_use]
    pub fn extended_lines(&self) -> &[Vec<Vec2>] {
        &self.carried
    }

    /// The same, to be kept.
    #[cfg(feature = "bevy")]
    pub(crate) fn shared_carried(&self) -> Arc<[Vec<Vec2>]> {
        self.carried.clone()
    }

    /// The shard at a position in pattern units; the cost is proportional to the length of all outlines.
    #[must_use]
    pub fn at(&self, pos: Vec2) -> Option<u32> {
        let inside = pos.cmpge(Vec2::ZERO).all() && pos.cmple(self.extent()).all();
        (0..self.len() as u32).find(|&shard| inside && self.contains(shard, pos))
    }

    /// Whether a position in pattern units lies in a shard. A position on an edge lies in one of the two.
    pub(super) fn contains(&self, shard: u32, pos: Vec2) -> bool {
        // The lower and right sides of the surface belong to the shards there.
        let end = DVec2::from(self.lattice.corner.map(|side| f64::from(side) - 1e-3));
        self.contains_place(shard, (pos.as_dvec2() * self.lattice.scale).min(end))
    }

    /// [`contains`](Self::contains) for a place of the lattice, or between.
    pub(super) fn contains_place(&self, shard: u32, p: DVec2) -> bool {
        let mut inside = false;
        for ring in self.rings_of(shard) {
            let mut from = self.places[ring[ring.len() - 1] as usize];
            for &vertex in ring {
                let to = self.places[vertex as usize];
                let (low, high) = if from[1] < to[1] { (from, to) } else { (to, from) };
                if (f64::from(low[1]) <= p.y) != (f64::from(high[1]) <= p.y) {
                    let share = (p.y - f64::from(low[1])) / f64::from(high[1] - low[1]);
                    inside ^= f64::from(low[0]) + share * f64::from(high[0] - low[0]) > p.x;
                }
                from = to;
            }
        }
        inside
    }

    /// Distance from a position to a shard, zero inside; pattern units.
    #[must_use]
    pub fn distance(&self, shard: u32, pos: Vec2) -> f32 {
        if self.contains(shard, pos) {
            return 0.0;
        }
        let to_ring = |ring: &[u32]| {
            let ends = ring.iter().zip(ring.iter().cycle().skip(1));
            ends.map(|(&a, &b)| distance_to_line(pos, self.positions[a as usize], self.positions[b as usize]))
                .fold(f32::INFINITY, f32::min)
        };
        self.rings_of(shard).map(to_ring).fold(f32::INFINITY, f32::min)
    }

    /// Convex polygons that form a shard, for colliders. Corners are in pattern units, relative to the shard's
    /// centroid.
    ///
    /// With a `tolerance` of 0 they fill the shard exactly. With a larger one (pattern units) edges may deviate by
    /// that much, and rough outlines need far fewer pieces. A tolerance that would make the outline cross itself is
    /// not used.
    #[must_use]
    pub fn convex_pieces(&self, shard: u32, tolerance: f32) -> Vec<ConvexPiece> {
        let Some(centroid) = self.get(shard).map(|shard| shard.centroid) else { return Vec::new() };
        let smooth = self.smoothed(shard, f64::from(tolerance) * self.lattice.scale);
        let (corners, triangles) =
            smooth.unwrap_or_else(|| (self.corners(shard).to_vec(), self.triangles(shard).to_vec()));
        let pieces = convex_pieces(&self.places, &named(&corners, &triangles));
        pieces
            .into_iter()
            .map(|piece| piece.into_iter().map(|vertex| self.positions[vertex as usize] - centroid).collect())
            .collect()
    }

    /// Triangles of a shard with a simpler outline.
    fn smoothed(&self, shard: u32, tolerance: f64) -> Option<(Vec<u32>, Vec<[u32; 3]>)> {
        if tolerance.is_nan() || tolerance <= 0.0 {
            return None;
        }
        let rings: Vec<Vec<u32>> = self.rings_of(shard).map(|ring| simplify(&self.places, ring, tolerance)).collect();
        let area = |ring: &[u32]| ring_area(ring.iter().map(|&vertex| self.places[vertex as usize]));
        // Holes that are too small to matter are filled.
        let rings: Vec<&[u32]> =
            (0..).zip(&rings).filter(|(i, ring)| *i == 0 || area(ring) < 0).map(|(_, ring)| &ring[..]).collect();
        let whole: i64 = rings.iter().map(|ring| area(ring)).sum();
        let mut triangles = Vec::new();
        Clipper::default().triangulate(&self.places, &rings, &mut triangles);
        let corners = rings.concat();
        let right = triangles.len() + 4 == corners.len() + 2 * rings.len()
            && triangles.iter().all(|triangle| area_of(&self.places, &named(&corners, &[*triangle])) > 0)
            && area_of(&self.places, &named(&corners, &triangles)) == whole;
        (whole > 0 && right).then_some((corners, triangles))
    }

    /// Keeps some shards, and renumbers them.
    pub(super) fn retain(&mut self, keep: &[bool]) {
        let mut new_number = vec![u32::MAX; self.len()];
        let kept = new_number.iter_mut().zip(keep).filter(|(_, keep)| **keep);
        for (next, (number, _)) in (0u32..).zip(kept) {
            *number = next;
        }
        let (shards, neighbours) = (std::mem::take(&mut self.shards), std::mem::take(&mut self.neighbours));
        for (mut shard, _) in shards.into_iter().zip(keep).filter(|(_, keep)| **keep) {
            let first = self.neighbours.len() as u32;
            let range = shard.neighbours.start as usize..shard.neighbours.end as usize;
            self.neighbours.extend(neighbours[range].iter().filter_map(|&Neighbour { shard, length }| {
                let shard = new_number[shard as usize];
                (shard != u32::MAX).then_some(Neighbour { shard, length })
            }));
            shard.neighbours = first..self.neighbours.len() as u32;
            self.shards.push(shard);
        }
    }

    /// A position well inside a shard, pattern units.
    #[must_use]
    pub fn inner_point(&self, shard: u32) -> Option<Vec2> {
        self.inner_place(shard).map(|place| (place / self.lattice.scale).as_vec2())
    }

    /// The middle of the largest triangle of a shard, on the lattice or between.
    pub(super) fn inner_place(&self, shard: u32) -> Option<DVec2> {
        let corners = self.corners(shard);
        let place = |corner: u32| self.places[corners[corner as usize] as usize];
        let largest =
            self.triangles(shard).iter().max_by_key(|triangle| ring_area(triangle.iter().map(|&i| place(i))))?;
        Some(largest.map(|corner| DVec2::from(place(corner).map(f64::from))).into_iter().sum::<DVec2>() / 3.0)
    }
}

fn named(corners: &[u32], triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    triangles.iter().map(|triangle| triangle.map(|corner| corners[corner as usize])).collect()
}

/// Assembles shards, ring by ring.
struct Builder<'a> {
    shards: &'a mut Shards,
    clipper: Clipper,
    /// Length of the edges shared with each neighbour, lattice units.
    shared: Vec<(u32, f64)>,
    border: [f64; 4],
}

impl Builder<'_> {
    fn add_ring(&mut self, drawing: &Drawing, faces: &Faces, ring: impl Iterator<Item = u32>) {
        for half_edge in ring {
            let vertex = origin(drawing, half_edge);
            self.shards.outlines.push(vertex);
            let (a, b) = (drawing.places[vertex as usize], drawing.places[origin(drawing, half_edge ^ 1) as usize]);
            let length = (distance_sq(a, b) as f64).sqrt();
            let beside = faces.face_of[half_edge as usize ^ 1];
            if beside == u32::MAX {
                if let Some(side) = drawing.lattice.side_of(a, b) {
                    self.border[side] += length;
                }
            } else if let Some(shared) = self.shared.iter_mut().rev().find(|shared| shared.0 == beside) {
                shared.1 += length;
            } else {
                self.shared.push((beside, length));
            }
        }
        self.shards.rings.push(self.shards.outlines.len() as u32);
    }

    fn finish(&mut self) {
        let Shards { lattice, places, outlines, rings, triangles, neighbours, shards, .. } = &mut *self.shards;
        let first_ring = shards.last().map_or(0, |shard| shard.rings.end);
        let first_triangle = triangles.len() as u32;
        let first_neighbour = neighbours.len() as u32;
        let last_ring = rings.len() as u32 - 1;
        let ring = |ring: u32| &outlines[rings[ring as usize] as usize..rings[ring as usize + 1] as usize];
        if last_ring == first_ring + 1 {
            self.clipper.triangulate(places, &[ring(first_ring)], triangles);
        } else {
            let rings: Vec<&[u32]> = (first_ring..last_ring).map(ring).collect();
            self.clipper.triangulate(places, &rings, triangles);
        }
        let moments = moments(places, (first_ring..last_ring).map(ring));

        self.shared.sort_unstable_by_key(|shared| shared.0);
        let to_units = 1.0 / lattice.scale;
        neighbours.extend(
            self.shared.drain(..).map(|(shard, length)| Neighbour { shard, length: (length * to_units) as f32 }),
        );
        shards.push(ShardShape {
            area: (moments.area * to_units * to_units) as f32,
            centroid: Vec2::new((moments.centroid[0] * to_units) as f32, (moments.centroid[1] * to_units) as f32),
            second_moment: (moments.second * to_units * to_units * to_units * to_units) as f32,
            border: std::mem::take(&mut self.border).map(|length| (length * to_units) as f32),
            rings: first_ring..last_ring,
            triangles: first_triangle..triangles.len() as u32,
            neighbours: first_neighbour..neighbours.len() as u32,
        });
    }
}

/// Integrals over a polygon, in lattice units.
struct Moments {
    area: f64,
    centroid: [f64; 2],
    second: f64,
}

fn moments<'a>(places: &[Place], rings: impl Iterator<Item = &'a [u32]>) -> Moments {
    let (mut origin, mut twice, mut first, mut second) = (None, 0i64, [0.0; 2], 0.0);
    for ring in rings {
        let Some(&last) = ring.last() else { continue };
        // Relative to a vertex of the polygon, to keep precision.
        let origin = *origin.get_or_insert(places[last as usize]);
        let relative = |vertex: u32| [0, 1].map(|i| i64::from(places[vertex as usize][i]) - i64::from(origin[i]));
        let mut a = relative(last);
        for &vertex in ring {
            let b = relative(vertex);
            let doubled = cross(a, b);
            twice += doubled;
            let (weight, [ax, ay], [bx, by]) = (doubled as f64, a.map(|x| x as f64), b.map(|x| x as f64));
            first = [first[0] + weight * (ax + bx), first[1] + weight * (ay + by)];
            second += weight * (ax * ax + ax * bx + bx * bx + ay * ay + ay * by + by * by);
            a = b;
        }
    }
    let (origin, area) = (origin.unwrap_or_default(), 0.5 * twice as f64);
    if twice == 0 {
        return Moments { area: 0.0, centroid: origin.map(f64::from), second: 0.0 };
    }
    let [x, y] = first.map(|sum| sum / (6.0 * area));
    let second = (second / 12.0 - area * (x * x + y * y)).max(0.0);
    Moments { area, centroid: [f64::from(origin[0]) + x, f64::from(origin[1]) + y], second }
}

pub(super) fn distance_to_line(p: Vec2, a: Vec2, b: Vec2) -> f32 {
    let way = b - a;
    let share = ((p - a).dot(way) / way.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
    p.distance(a + way * share)
}
