//! Curved meshes, laid out by distance and direction from a point.

use super::chart::{Chart, Start, along, bounds, cells};
use super::shape::MeshShape;
use crate::math::turns::{from_to, turned};
use glam::{UVec2, Vec2, Vec3};
use std::{cmp::Reverse, collections::BinaryHeap};

/// The most that a triangle may be stretched or shrunk in the plane, along any of its edges and in area.
const MOST_STRETCH: f32 = 2.0;

/// Cells along the longer side of a chart in which triangles are looked for that cover one another: so many for each triangle in a row, and the
/// most.
const CELLS: f32 = 8.0;
const MOST_CELLS: f32 = 512.0;

/// How far within a triangle the middle of a cell is that it covers, cells: neighbours that share an edge do not share a cell by rounding.
const CLEARANCE: f32 = 1e-3;

/// What meets in each point of a mesh.
pub(super) struct Points {
    /// Unit normals, means over the triangles.
    normals: Vec<Vec3>,
    /// The triangles of each point: where they begin in `triangles`, one more at the end.
    first: Vec<u32>,
    triangles: Vec<u32>,
}

impl Points {
    pub(super) fn of(shape: &MeshShape) -> Self {
        let with_area = || (0..shape.len()).filter(|triangle| shape.has_area(*triangle));
        let (mut normals, mut first) = (vec![Vec3::ZERO; shape.points()], vec![0; shape.points() + 1]);
        for triangle in with_area() {
            let [a, b, c] = shape.corners(triangle);
            for point in shape.numbers(triangle) {
                normals[point] += (b - a).cross(c - a);
                first[point + 1] += 1;
            }
        }
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let (mut next, mut triangles) = (first.clone(), vec![0; first[shape.points()] as usize]);
        for triangle in with_area() {
            for point in shape.numbers(triangle) {
                triangles[next[point] as usize] = triangle as u32;
                next[point] += 1;
            }
        }
        normals.iter_mut().for_each(|normal| *normal = normal.normalize_or_zero());
        Self { normals, first, triangles }
    }

    fn triangles(&self, point: usize) -> impl Iterator<Item = usize> + '_ {
        let range = self.first[point] as usize..self.first[point + 1] as usize;
        self.triangles[range].iter().map(|triangle| *triangle as usize)
    }
}

/// A point in the plane.
#[derive(Clone, Copy)]
struct Laid {
    at: Vec2,
    /// The direction on the mesh that is to the right in the plane.
    right: Vec3,
}

impl Laid {
    /// Where a point of the mesh is, seen from this one, which is at `from` and faces `normal`.
    fn see(&self, from: Vec3, normal: Vec3, to: Vec3) -> Vec2 {
        let way = to - from;
        let flat = way.reject_from_normalized(normal).normalize_or_zero() * way.length();
        self.at + Vec2::new(flat.dot(self.right), flat.dot(self.right.cross(normal)))
    }

    /// The same direction elsewhere.
    fn turned(&self, from: Vec3, to: Vec3) -> Vec3 {
        turned(from_to(from, to), self.right).reject_from_normalized(to).normalize_or(to.any_orthonormal_vector())
    }
}

/// The chart that spreads from a point, as far as triangles keep their size and do not cover others.
pub(super) fn lay_out(shape: &MeshShape, points: &Points, start: Start, is_free: &[bool]) -> Chart {
    let laid = spread(shape, points, start, is_free);
    let corners = |triangle: usize| -> Option<[Vec2; 3]> {
        let [a, b, c] = shape.numbers(triangle).map(|point| laid[point].map(|laid| laid.at));
        Some([a?, b?, c?])
    };
    let free = is_free.iter().filter(|is_free| **is_free).count();
    let mut cover = Cover::new(free, laid.iter().flatten().map(|laid| laid.at));
    let mut chart = Chart { triangles: Vec::new() };
    let mut is_seen: Vec<bool> = is_free.iter().map(|is_free| !is_free).collect();
    let mut nearest = BinaryHeap::new();
    is_seen[start.triangle] = true;
    nearest.push(Reverse((0, start.triangle)));
    while let Some(Reverse((_, triangle))) = nearest.pop() {
        // The first is there in any case, so that every chart has one.
        let is_first = chart.triangles.is_empty();
        let laid = corners(triangle).filter(|laid| is_first || keeps_its_size(shape.corners(triangle), *laid));
        let Some(laid) = laid.filter(|laid| cover.take(*laid) || is_first) else { continue };
        chart.triangles.push((triangle, laid));
        for (other, _) in shape.across(triangle).into_iter().flatten() {
            let other = other as usize;
            if !is_seen[other] {
                is_seen[other] = true;
                let distance = corners(other).map_or(f32::MAX, |[a, b, c]| (a + b + c).length());
                nearest.push(Reverse((distance.to_bits(), other)));
            }
        }
    }
    trim(shape, &mut chart, is_free);
    chart
}

/// How often triangles that stick out are taken away.
const TRIMS: u32 = 2;

/// Takes away triangles that hang on to a chart by one edge, so that it does not end in steps: cracks and pieces end there, too. Only those that
/// another chart can have, or each would be one of its own.
fn trim(shape: &MeshShape, chart: &mut Chart, is_free: &[bool]) {
    let mut is_in = vec![false; shape.len()];
    chart.triangles.iter().for_each(|(triangle, _)| is_in[*triangle] = true);
    for _ in 0..TRIMS {
        let sticks_out = |triangle: usize| {
            let beside = shape.across(triangle).map(|other| other.map(|(other, _)| other as usize));
            let [own, free] = beside.into_iter().flatten().fold([0, 0], |[own, free], other| {
                if is_in[other] { [own + 1, free] } else { [own, free + u32::from(is_free[other])] }
            });
            (own, free) == (1, 2)
        };
        // The first one stays.
        let out: Vec<usize> =
            chart.triangles.iter().skip(1).map(|(triangle, _)| *triangle).filter(|i| sticks_out(*i)).collect();
        out.iter().for_each(|triangle| is_in[*triangle] = false);
        chart.triangles.retain(|(triangle, _)| is_in[*triangle]);
    }
}

/// Distance and direction of all points that can be reached, the nearest first.
fn spread(shape: &MeshShape, points: &Points, start: Start, is_free: &[bool]) -> Vec<Option<Laid>> {
    let mut laid: Vec<Option<Laid>> = vec![None; shape.points()];
    let normal = shape.normal(start.triangle);
    let [a, b, _] = shape.corners(start.triangle);
    let right = [start.right, b - a].into_iter().find_map(|way| along(way, normal));
    let first = Laid { at: Vec2::ZERO, right: right.unwrap_or_else(|| normal.any_orthonormal_vector()) };
    let mut nearest = BinaryHeap::new();
    for point in shape.numbers(start.triangle) {
        let at = first.see(start.point, normal, shape.point(point));
        laid[point] = Some(Laid { at, right: first.turned(normal, points.normals[point]) });
    }
    let mut is_done = vec![false; shape.points()];
    for point in shape.numbers(start.triangle) {
        is_done[point] = true;
    }
    let reach = |point: usize, laid: &[Option<Laid>], is_done: &[bool], nearest: &mut BinaryHeap<_>| {
        let Some(from) = laid[point] else { return };
        for other in around(shape, points, point, is_free).filter(|other| !is_done[*other]) {
            let at = from.see(shape.point(point), points.normals[point], shape.point(other));
            nearest.push(Reverse((at.length().to_bits(), other)));
        }
    };
    for point in shape.numbers(start.triangle) {
        reach(point, &laid, &is_done, &mut nearest);
    }
    while let Some(Reverse((_, point))) = nearest.pop() {
        if is_done[point] {
            continue;
        }
        is_done[point] = true;
        laid[point] = mean(shape, points, point, is_free, &laid);
        reach(point, &laid, &is_done, &mut nearest);
    }
    laid
}

/// The points that share a free triangle with this one; most of them twice.
fn around<'a>(
    shape: &'a MeshShape,
    points: &'a Points,
    point: usize,
    is_free: &'a [bool],
) -> impl Iterator<Item = usize> + 'a {
    let free = points.triangles(point).filter(|triangle| is_free[*triangle]);
    free.flat_map(|triangle| shape.numbers(triangle)).filter(move |other| *other != point)
}

/// Where a point is, as its neighbours see it that are laid out. Those count the most from which the way leads straight away from where the
/// chart begins: ways along a curve are longer there than in the plane.
fn mean(shape: &MeshShape, points: &Points, point: usize, is_free: &[bool], laid: &[Option<Laid>]) -> Option<Laid> {
    let (to, normal) = (shape.point(point), points.normals[point]);
    let (mut at, mut right, mut sum) = (Vec2::ZERO, Vec3::ZERO, 0.0);
    for other in around(shape, points, point, is_free) {
        let Some(from) = laid[other] else { continue };
        let (place, other_normal) = (shape.point(other), points.normals[other]);
        let seen = from.see(place, other_normal, to);
        let straight = (seen - from.at).normalize_or_zero().dot(from.at.normalize_or_zero()).max(0.05);
        let weight = straight * straight * straight * place.distance(to).recip().min(1e12);
        at += weight * seen;
        right += weight * from.turned(other_normal, normal);
        sum += weight;
    }
    let right = right.reject_from_normalized(normal).try_normalize()?;
    (sum > 0.0 && at.is_finite()).then(|| Laid { at: at / sum, right })
}

/// Whether a triangle is about as large in the plane as on the mesh, and not turned over.
fn keeps_its_size([a, b, c]: [Vec3; 3], [p, q, r]: [Vec2; 3]) -> bool {
    let is_like = |own: f32, laid: f32| laid <= MOST_STRETCH * own && own <= MOST_STRETCH * laid;
    // Seen from outside, y down.
    let area = -(q - p).perp_dot(r - p);
    let edges = [(b - a, q - p), (c - b, r - q), (a - c, p - r)];
    is_like((b - a).cross(c - a).length(), area) && edges.iter().all(|(own, laid)| is_like(own.length(), laid.length()))
}

/// Which parts of the plane are covered.
struct Cover {
    min: Vec2,
    /// Cells for a unit of length.
    scale: f32,
    size: UVec2,
    is_covered: Vec<bool>,
}

impl Cover {
    /// For so many triangles at the most, whose corners are at these places.
    fn new(triangles: usize, places: impl Iterator<Item = Vec2>) -> Self {
        let (min, max) = bounds(places);
        let scale = (CELLS * (triangles as f32).sqrt()).min(MOST_CELLS) / (max - min).max_element();
        // Where all places are one there is nothing to cover.
        let scale = if scale.is_finite() { scale } else { 0.0 };
        let size = ((max - min) * scale).ceil().max(Vec2::ONE).as_uvec2();
        Self { min, scale, size, is_covered: vec![false; size.as_usizevec2().element_product()] }
    }

    /// Covers the cells whose middles lie in a triangle; `false` if one of them is covered.
    fn take(&mut self, corners: [Vec2; 3]) -> bool {
        let corners = corners.map(|corner| (corner - self.min) * self.scale);
        let own: Vec<usize> =
            cells(corners, self.size, CLEARANCE).map(|cell| (cell.y * self.size.x + cell.x) as usize).collect();
        let is_free = own.iter().all(|cell| !self.is_covered[*cell]);
        if is_free {
            own.into_iter().for_each(|cell| self.is_covered[cell] = true);
        }
        is_free
    }
}
