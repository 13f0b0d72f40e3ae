//! The faces along which a shell breaks.

use super::{Shards, ShellPart};
use crate::math::mix;
use glam::{Affine3A, Vec2, Vec3};

/// How many rows of triangles an uneven face has, from the outside to the inside: light that breaks on them does not run straight through.
const ROWS: u8 = 5;

/// A side of a piece, in the space of its mesh.
pub(super) struct Side {
    /// Whether what lies in the plane is seen from behind.
    pub(super) is_turned: bool,
    /// 0..=1.
    pub(super) roughness: f32,
    pub(super) thickness: f32,
    /// Length of a pattern unit.
    pub(super) unit: f32,
}

/// An end of an edge of a piece.
#[derive(Clone, Copy)]
pub(super) struct SideEnd {
    pub(super) at: Vec3,
    /// Outward.
    pub(super) normal: Vec3,
    /// Where the inside is.
    pub(super) under: Vec3,
    /// Where it is laid out, pattern units.
    pub(super) flat: Vec2,
    /// The way out of the piece on the whole, whatever the kinks of its edge; zero = by the edge.
    pub(super) out: Vec3,
}

impl Side {
    /// Adds the face below an edge: u is a place in the plane that goes on from edge to edge, v the depth.
    pub(super) fn add(&self, [a, b]: [SideEnd; 2], to_mesh: &Affine3A, part: &mut ShellPart) {
        let way = b.at - a.at;
        let smooth = if self.is_turned { a.normal.cross(way) } else { way.cross(a.normal) };
        let Some(smooth) = smooth.try_normalize() else { return };
        let tangent = way.normalize_or_zero().extend(1.0).to_array();
        let run = (b.flat - a.flat).abs();
        let along = if run.x > run.y { Vec2::X } else { Vec2::Y };
        let (is_rough, depth) = (self.roughness > 0.0, self.thickness / self.unit);
        let rows = if is_rough { ROWS } else { 1 };
        let row = |row: u8| {
            let share = f32::from(row) / f32::from(rows);
            [a, b].map(|end| (end, share, self.point(&end, share, to_mesh), [along.dot(end.flat), share * depth]))
        };
        let mut upper = row(0);
        for i in 1..=rows {
            let lower = row(i);
            let corners = [upper[0], upper[1], lower[1], lower[0]];
            let places = corners.map(|(_, _, at, _)| at);
            let faces = [[0, 1, 2], [0, 2, 3]].map(|of| {
                let face = facing(&of.map(|i| places[i]));
                face.map_or(smooth, |face| if self.is_turned { face } else { -face })
            });
            let indices = corners.map(|(end, share, at, uv)| {
                let normal = if is_rough { self.normal(&end, share, faces, to_mesh) } else { smooth };
                part.push(at, normal, tangent, uv)
            });
            part.fill(&indices, !self.is_turned);
            upper = lower;
        }
    }

    /// How a point of an uneven face is lit: as grains of stone are, not as kinks of the edge above.
    fn normal(&self, end: &SideEnd, share: f32, faces: [Vec3; 2], to_mesh: &Affine3A) -> Vec3 {
        let out = end.out.try_normalize().unwrap_or(faces[0]);
        let grain = waves(&GRAINS, (end.flat * (self.unit / self.thickness)).extend(share + 3.0));
        let grained = out + to_mesh.transform_vector3(grain) * self.roughness;
        // It looks the way of its triangles.
        let normal =
            faces.into_iter().fold(grained, |normal, face| normal + face * (LEAST_LIT - normal.dot(face)).max(0.0));
        normal.normalize_or(faces[0])
    }

    /// A point of the face, below an end of an edge: at `share` of the depth. Outside and inside it is where the skins are.
    fn point(&self, end: &SideEnd, share: f32, to_mesh: &Affine3A) -> Vec3 {
        let straight = end.at.lerp(end.under, share);
        let between = 4.0 * share * (1.0 - share);
        if between <= 0.0 || self.roughness <= 0.0 {
            return straight;
        }
        let aside = to_mesh.transform_vector3(dents(end.flat * (self.unit / self.thickness), share));
        straight + aside * (between * self.roughness * self.thickness)
    }
}

impl Shards {
    /// For each of a shard's corners the way out of it in the plane, unit vectors: across the line between the places of its outline `reach` before and
    /// after it.
    pub(super) fn outward(&self, shard: u32, reach: f32) -> Vec<Vec2> {
        let mut all = Vec::with_capacity(self.corners(shard).len());
        for ring in self.rings_of(shard) {
            let ring: Vec<Vec2> = ring.iter().map(|&corner| self.positions()[corner as usize]).collect();
            let n = ring.len();
            let place = |i: usize, step: usize| {
                let (mut left, mut at) = (reach, ring[i]);
                for k in 1..n {
                    let next = ring[(i + k * step) % n];
                    let length = at.distance(next);
                    if length >= left {
                        return at + (next - at) * (left / length.max(f32::MIN_POSITIVE));
                    }
                    (left, at) = (left - length, next);
                }
                at
            };
            // A step back is n - 1 steps on.
            all.extend((0..n).map(|i| (place(i, n - 1) - place(i, 1)).perp().normalize_or_zero()));
        }
        all
    }
}

/// The unit normal of a polygon on the side from which it runs counter-clockwise: the mean of its triangles'. `None` if it has no area.
pub(super) fn facing(corners: &[Vec3]) -> Option<Vec3> {
    let first = *corners.first()?;
    corners.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first)).sum::<Vec3>().try_normalize()
}

/// Lengths of the waves of uneven faces, thicknesses; and how high each is. Together they are nowhere steeper than 0.7, or faces would fold: a wave
/// rises by three times its height over its length at the most.
const WAVES: [(f32, f32); 2] = [(3.0, 0.4), (1.5, 0.13)];

/// The same of dents between the outside and the inside.
const DENTS: [(f32, f32); 2] = [(0.9, 0.09), (0.35, 0.03)];

/// The same of what lies in the light and what does not.
const GRAINS: [(f32, f32); 3] = [(0.8, 0.5), (0.35, 0.5), (0.15, 0.35)];

/// The least that lies in the light, of all that does.
const LEAST_LIT: f32 = 0.2;

/// How far a place of the inside is moved, thicknesses: the same for all pieces that meet there. The thickness is in pattern units.
pub(super) fn unevenness(at: Vec2, thickness: f32) -> Vec3 {
    waves(&WAVES, (at / thickness.max(1e-6)).extend(0.0))
}

/// How far a place of a face is moved that lies at `share` of the depth, thicknesses; `at` is in thicknesses as well.
fn dents(at: Vec2, share: f32) -> Vec3 {
    waves(&DENTS, at.extend(share + 9.0))
}

/// Waves of these lengths and heights, added.
fn waves(waves: &[(f32, f32)], at: Vec3) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (&(length, height), wave) in waves.iter().zip(0u64..) {
        let at = at / length;
        let (cell, share) = (at.floor(), at - at.floor());
        let share = share * share * (Vec3::splat(3.0) - 2.0 * share);
        // Where all is level it does not matter.
        let (layers, depth) = if share.z > 0.0 { (2, share.z) } else { (1, 0.0) };
        for layer in 0..layers {
            let weight = height * if layer == 0 { 1.0 - depth } else { depth };
            let z = u64::from((cell.z + layer as f32).to_bits());
            let corner = |x: f32, y: f32| {
                let [x, y] = [cell.x + x, cell.y + y].map(|value| u64::from(value.to_bits()));
                direction(mix(mix(mix(x ^ (wave << 44)) ^ y) ^ z))
            };
            let top = corner(0.0, 0.0).lerp(corner(1.0, 0.0), share.x);
            sum += weight * top.lerp(corner(0.0, 1.0).lerp(corner(1.0, 1.0), share.x), share.y);
        }
    }
    sum
}

/// Three numbers in -1..=1 from random bits.
fn direction(bits: u64) -> Vec3 {
    let number = |shift: u32| ((bits >> shift) & 0x1F_FFFF) as f32 / (1u32 << 20) as f32 - 1.0;
    Vec3::new(number(0), number(21), number(42))
}
