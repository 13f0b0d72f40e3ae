//! Flat faces, unfolded about the edges in which they meet.

use super::beside::{self, Beside};
use super::chart::{Chart, Start, along, bounds};
use super::shape::MeshShape;
use glam::{Vec2, Vec3};
use std::{cmp::Reverse, collections::BinaryHeap};

/// A mesh of more flat faces is laid out as if it were curved, unless they mostly meet at large angles.
pub(super) const MAX_FACES: usize = 64;

/// Then it is only if there are more than this.
const MAX_STEPS: usize = 1024;

/// The cosine of such an angle, 60 degrees.
const STEEP: f32 = 0.5;

/// How far triangles may reach into one another, as a share of their size, and not overlap: rounding.
const SLACK: f32 = 1e-4;

/// A plane of the mesh, laid into that of the chart.
#[derive(Clone, Copy)]
struct Placed {
    origin: Vec3,
    right: Vec3,
    down: Vec3,
    at: Vec2,
}

impl Placed {
    /// With the direction `right` in space to the right in the chart, and `origin` at `at`. Seen from outside, y down.
    fn new(normal: Vec3, origin: Vec3, right: Vec3, at: Vec2) -> Option<Self> {
        let right = along(right, normal)?;
        Some(Self { origin, right, down: right.cross(normal), at })
    }

    fn apply(&self, point: Vec3) -> Vec2 {
        let to = point - self.origin;
        self.at + Vec2::new(to.dot(self.right), to.dot(self.down))
    }
}

/// An edge over which a face may come in.
struct Edge {
    /// The triangle before it, its corner where the edge begins, and the triangle behind it.
    from: usize,
    corner: usize,
    to: usize,
    placed: Placed,
}

/// Whether a mesh is one of flat faces, rather than a curve in many small ones.
pub(super) fn has_hinges(shape: &MeshShape) -> bool {
    if shape.faces() <= MAX_FACES || shape.faces() > MAX_STEPS {
        return shape.faces() <= MAX_FACES;
    }
    let (mut steep, mut all) = (0.0, 0.0);
    for triangle in 0..shape.len() {
        let corners = shape.corners(triangle);
        for (corner, (other, _)) in
            shape.across(triangle).into_iter().enumerate().filter_map(|(i, across)| Some((i, across?)))
        {
            let other = other as usize;
            if shape.face(other) != shape.face(triangle) {
                let length = corners[corner].distance(corners[(corner + 1) % 3]);
                all += length;
                steep += if shape.normal(other).dot(shape.normal(triangle)) < STEEP { length } else { 0.0 };
            }
        }
    }
    steep >= 0.5 * all
}

/// The chart that spreads from a face: first those come in whose edges are the nearest to where it begins. A face that would cover another
/// waits for another chart.
pub(super) fn unfold(shape: &MeshShape, beside: &[Beside], start: Start, is_free: &[bool]) -> Chart {
    let normal = shape.normal(start.triangle);
    let [a, b, _] = shape.corners(start.triangle);
    let ways = [start.right, b - a];
    let first = ways.into_iter().find_map(|right| Placed::new(normal, start.point, right, Vec2::ZERO));
    let mut chart = Chart { triangles: Vec::new() };
    let Some(first) = first else { return chart };
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); shape.faces()];
    for triangle in (0..shape.len()).filter(|triangle| is_free[*triangle]) {
        members[shape.face(triangle) as usize].push(triangle);
    }
    let (mut is_in, mut edges) = (vec![false; shape.faces()], Vec::<Edge>::new());
    let mut nearest: BinaryHeap<Reverse<(u64, usize)>> = BinaryHeap::new();
    let mut come_in = |face: u32, placed: Placed, chart: &mut Chart, edges: &mut Vec<Edge>| {
        let members = &members[face as usize];
        let laid = |triangle: &usize| (*triangle, shape.corners(*triangle).map(|corner| placed.apply(corner)));
        let new: Vec<(usize, [Vec2; 3])> = members.iter().map(laid).collect();
        if is_in[face as usize] || covers(&chart.triangles, &new) {
            return Vec::new();
        }
        is_in[face as usize] = true;
        let before = edges.len();
        for (triangle, _) in &new {
            let across = shape.across(*triangle).into_iter().enumerate();
            let across = across.filter_map(|(corner, to)| Some((corner, to?.0 as usize)));
            let in_part = beside::of(beside, *triangle).map(|beside| (beside.corner, beside.other));
            for (corner, other) in across.chain(in_part) {
                if shape.face(other) != face && is_free[other] {
                    edges.push(Edge { from: *triangle, corner, to: other, placed });
                }
            }
        }
        chart.triangles.extend(new);
        (before..edges.len()).collect()
    };
    let key = |edge: &Edge| {
        let corners = shape.corners(edge.from);
        let ends = [corners[edge.corner], corners[(edge.corner + 1) % 3]].map(|end| edge.placed.apply(end));
        u64::from(distance(ends).to_bits())
    };
    for i in come_in(shape.face(start.triangle), first, &mut chart, &mut edges) {
        nearest.push(Reverse((key(&edges[i]), i)));
    }
    while let Some(Reverse((_, i))) = nearest.pop() {
        let Edge { from, corner, to, placed } = &edges[i];
        let (from, to, corner, before) = (*from, *to, *corner, *placed);
        let corners = shape.corners(from);
        let (begin, end) = (corners[corner], corners[(corner + 1) % 3]);
        // The edge stays where it is, the face behind it is turned into the plane.
        let edge = (before.apply(end) - before.apply(begin)).normalize_or_zero();
        let Some(side) = Placed::new(shape.normal(to), begin, end - begin, before.apply(begin)) else { continue };
        let turned = Placed {
            right: side.right * edge.x - side.down * edge.y,
            down: side.right * edge.y + side.down * edge.x,
            ..side
        };
        for i in come_in(shape.face(to), turned, &mut chart, &mut edges) {
            nearest.push(Reverse((key(&edges[i]), i)));
        }
    }
    chart
}

/// How far a line is from where the chart begins.
fn distance([a, b]: [Vec2; 2]) -> f32 {
    let along = b - a;
    let share = (-a.dot(along) / along.length_squared()).clamp(0.0, 1.0);
    (a + along * share).length()
}

/// Whether any of the triangles covers a part of any other.
fn covers(some: &[(usize, [Vec2; 3])], others: &[(usize, [Vec2; 3])]) -> bool {
    let (min, max) = bounds(others.iter().flat_map(|(_, corners)| *corners));
    let is_near = |(_, corners): &&(usize, [Vec2; 3])| {
        let (low, high) = bounds(*corners);
        low.cmplt(max).all() && high.cmpgt(min).all()
    };
    some.iter().filter(is_near).any(|(_, a)| others.iter().any(|(_, b)| overlap(a, b)))
}

/// Whether two triangles have more than their borders in common: there is no line between them (Gottschalk, Lin and Manocha 1996, in the
/// plane).
fn overlap(a: &[Vec2; 3], b: &[Vec2; 3]) -> bool {
    let is_apart = |one: &[Vec2; 3], other: &[Vec2; 3]| {
        (0..3).any(|i| {
            let Some(normal) = (one[(i + 1) % 3] - one[i]).perp().try_normalize() else { return false };
            let reach = |corners: &[Vec2; 3]| {
                let along = corners.map(|corner| corner.dot(normal));
                (along.into_iter().fold(f32::INFINITY, f32::min), along.into_iter().fold(f32::NEG_INFINITY, f32::max))
            };
            let ((low, high), (other_low, other_high)) = (reach(one), reach(other));
            let slack = SLACK * (high - low).min(other_high - other_low);
            high - slack <= other_low || other_high - slack <= low
        })
    };
    !is_apart(a, b) && !is_apart(b, a)
}
