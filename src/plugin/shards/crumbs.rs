//! Crumbs: small pieces that come off the edges along which shards break.

use super::form::{Style, mesh, with_tangents};
use crate::math::{Rng, mix};
use crate::plugin::api::CrackChips;
use crate::plugin::carrier::plane::Plane;
use crate::shatter::{Flight, Pose, RimLook, ShardShape, Shards};
use bevy::prelude::*;

/// The most crumbs of a shard, and of a surface in a frame.
pub(super) const MOST_OF_SHARD: usize = 64;
pub(super) const MOST_IN_FRAME: usize = 512;

/// How many different shapes the crumbs of a surface have.
pub(super) const SHAPES: usize = 6;

/// How far the corners of a stone are from its middle, as a share of the most: less than on average.
const ROUND: f32 = 0.68;

/// How long after its shard has left its place a crumb comes off at the latest, seconds.
const LATEST: f32 = 0.45;

/// How many and how large.
#[derive(Clone, Copy, Debug)]
pub(super) struct CrumbParams {
    /// For each pattern unit of an outline.
    density: f32,
    /// The largest, pattern units.
    size: f32,
}

impl CrumbParams {
    /// `None` if there are to be none.
    pub(super) fn of(settings: &CrackChips) -> Option<Self> {
        let density = settings.crumbs.min(CrackChips::MOST_CRUMBS) as f32;
        let size = settings.crumb_size.clamp(0.0, CrackChips::LARGEST_CRUMB);
        (density > 0.0 && size > 0.0).then_some(Self { density, size })
    }
}

/// A shard that comes loose.
pub(super) struct Loose<'a> {
    pub(super) cut: &'a Shards,
    pub(super) number: u32,
    /// Where it lies in the surface.
    pub(super) plane: &'a Plane,
    pub(super) flight: &'a Flight,
    pub(super) seed: u64,
    pub(super) style: &'a Style,
}

/// A crumb that has come off.
pub(super) struct Crumb {
    /// Where it was, and how long it is in each direction, in the entity's own space.
    pub(super) home: Transform,
    /// How it lies in its own place.
    pub(super) turn: Quat,
    /// Units of the entity for a pattern unit.
    pub(super) unit: Vec3,
    pub(super) flight: Flight,
    /// When the flight of its shard was begun, seconds since the surface broke.
    pub(super) start: f64,
    /// Which of the [`SHAPES`] it has.
    pub(super) shape: usize,
    /// Where it lay in the picture, pattern units.
    pub(super) at: Vec2,
}

impl Loose<'_> {
    /// The crumbs that come off along its outline, no more than `most`: always the same.
    pub(super) fn crumbs(&self, params: CrumbParams, most: usize) -> Vec<Crumb> {
        let has_size = self.plane.size.abs().min_element() > 0.0;
        let Some(shard) = self.cut.get(self.number).filter(|_| has_size) else { return Vec::new() };
        let edges = self.edges();
        let length = edges.last().map_or(0.0, |(until, _)| *until);
        let mut rng = Rng::new(self.seed).stream("crumbs");
        // The fraction is left to chance, so that small shards have some too.
        let count = (params.density * length + rng.unit()) as usize;
        let count = count.min(MOST_OF_SHARD).min(most);
        let largest = params.size.min(0.5 * shard.area.max(0.0).sqrt());
        (0..count)
            .filter_map(|_| {
                let place = rng.unit() * length;
                let (until, [from, to]) = *edges.get(edges.partition_point(|(until, _)| *until < place))?;
                let share = ((until - place) / from.distance(to).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
                self.crumb(shard, to.lerp(from, share), largest, &mut rng)
            })
            .collect()
    }

    /// Its edges but for those on the border of a flat surface, and the length of all up to the end of each.
    fn edges(&self) -> Vec<(f32, [Vec2; 2])> {
        let (positions, extent) = (self.cut.positions(), self.cut.extent());
        let is_border = |[a, b]: [Vec2; 2]| {
            let on = |side: f32, of: fn(Vec2) -> f32| of(a) == side && of(b) == side;
            let sides = [on(0.0, |at| at.x), on(0.0, |at| at.y), on(extent.x, |at| at.x), on(extent.y, |at| at.y)];
            self.style.shell.is_none() && sides.contains(&true)
        };
        let mut until = 0.0;
        let rings = core::iter::once(self.cut.outline(self.number)).chain(self.cut.holes(self.number));
        let edges = rings.flat_map(|ring| {
            let ends = ring.iter().zip(ring.iter().cycle().skip(1));
            ends.map(|(from, to)| [from, to].map(|corner| positions[*corner as usize]))
        });
        let edges = edges.filter(|edge| !is_border(*edge));
        edges
            .map(|[from, to]| {
                until += from.distance(to);
                (until, [from, to])
            })
            .collect()
    }

    /// A crumb at a place of the outline.
    fn crumb(&self, shard: &ShardShape, at: Vec2, largest: f32, rng: &mut Rng) -> Option<Crumb> {
        // Few are large.
        let size = largest * (0.25 + 0.75 * rng.unit().powi(3));
        let extent = self.cut.extent();
        let unit = self.plane.size / extent;
        let unit = unit.extend(unit.y.abs());
        let thickness = self.style.thickness.unwrap_or_default();
        // More where it is seen.
        let depth = thickness * rng.unit() * rng.unit();
        let place = match &self.style.shell {
            Some(shell) => {
                let place = shell.place(at)?;
                place.position - place.normal * depth
            }
            None => self.plane.place(at, extent, Pose::AT_REST, depth).translation,
        };
        let axes_at = self.plane.flight_axes(place, extent);
        let arm = axes_at - Vec3::new(shard.centroid.x, -shard.centroid.y, -0.5 * thickness / unit.z);
        // Off a body they fly outward.
        let outward = if self.style.shell.is_some() { Vec3::Z } else { Vec3::ZERO };
        // Some come off on the way.
        let late = LATEST * (rng.unit() * 1.6 - 0.6).max(0.0);
        let seed = mix(self.seed ^ u64::from(rng.next_u32()));
        let bright = self.style.rim.bright.clamp(0.0, 1.0);
        // Glass breaks into splinters.
        let axes = Vec3::new(1.0, rng.range(0.6, 0.95) - 0.5 * bright, rng.range(0.45, 0.8) - 0.35 * bright);
        let turn = if self.style.thickness.is_some() { any_rotation(rng) } else { about_z(rng) };
        // Of an ellipsoid of these axes, a little smaller: what lies on a floor is sunk rather than in the air.
        let half = 0.5 * size * ROUND * (axes * (turn.inverse() * Vec3::Z)).length();
        Some(Crumb {
            home: Transform { translation: place, rotation: self.plane.rotation, scale: axes * (0.5 * size * unit.z) },
            turn,
            unit,
            flight: self.flight.crumb((axes_at, arm, [size, half]), outward, late, seed),
            start: 0.0,
            shape: rng.next_u32() as usize % SHAPES,
            at,
        })
    }
}

fn any_rotation(rng: &mut Rng) -> Quat {
    let mut number = || rng.signed();
    let any = Vec4::new(number(), number(), number(), number());
    any.try_normalize().map_or(Quat::IDENTITY, Quat::from_vec4)
}

fn about_z(rng: &mut Rng) -> Quat {
    let way = Vec2::new(rng.signed(), rng.signed()).normalize_or(Vec2::X);
    Quat::from_xyzw(0.0, 0.0, way.x, way.y)
}

/// The meshes of crumbs, from -1 to 1: stones of many corners.
pub(super) fn solid_shapes(seed: u64) -> Vec<Mesh> {
    (0..SHAPES as u64).map(|shape| stone(Rng::new(seed).stream("stones").substream(shape))).collect()
}

/// An uneven stone: the corners of an icosahedron moved in and out.
fn stone(mut rng: Rng) -> Mesh {
    const GOLDEN: f32 = 1.618_034;
    const FACES: [[usize; 3]; 20] = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let corners: Vec<Vec3> = [(-1.0, 1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
        .into_iter()
        .map(|(a, b)| Vec3::new(a, b * GOLDEN, 0.0))
        .chain([(-1.0, 1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(a, b)| Vec3::new(0.0, a, b * GOLDEN)))
        .chain([(1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (-1.0, 1.0)].map(|(a, b)| Vec3::new(a * GOLDEN, 0.0, b)))
        .map(|corner| corner.normalize() * rng.range(0.55, 1.0))
        .collect();
    let (mut positions, mut normals, mut uvs, mut tangents) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for face in FACES {
        let [a, b, c] = face.map(|i| corners[i]);
        let (normal, along) = ((b - a).cross(c - a).normalize_or(Vec3::Z), (b - a).normalize_or(Vec3::X));
        let across = normal.cross(along);
        let corner = Vec2::new(rng.unit(), rng.unit());
        for at in [a, b, c] {
            positions.push(at.to_array());
            normals.push(normal.to_array());
            uvs.push((corner + 0.02 * Vec2::new(at.dot(along), at.dot(across))).to_array());
            tangents.push(along.extend(-1.0).to_array());
        }
    }
    let indices = (0..positions.len() as u32).collect();
    with_tangents(mesh(positions, normals, uvs, Vec::new(), indices, false), tangents)
}

/// The same in 2D: uneven polygons that show the picture around a place each (texture coordinates), `reach` around it.
pub(super) fn flat_shapes(seed: u64, rim: RimLook, places: &[Vec2], reach: Vec2) -> Vec<Mesh> {
    let places = places.iter().cycle().take(SHAPES);
    let shape =
        |(shape, place): (u64, &Vec2)| polygon(Rng::new(seed).stream("polygons").substream(shape), rim, *place, reach);
    (0..).zip(places).map(shape).collect()
}

fn polygon(mut rng: Rng, rim: RimLook, place: Vec2, reach: Vec2) -> Mesh {
    let corners = 4 + rng.next_u32() % 4;
    let at: Vec<Vec2> = (0..corners)
        .map(|i| {
            let turn = core::f32::consts::TAU * (i as f32 + 0.7 * rng.unit()) / corners as f32;
            crate::math::ops::unit(turn) * rng.range(0.6, 1.0)
        })
        .collect();
    let light = 1.0 + rim.bright * rng.unit() + rim.relief * rng.signed();
    let color = [light, light, light, 1.0 + rim.bright.max(0.0)];
    let colors = if rim.width > 0.0 { vec![color; at.len()] } else { Vec::new() };
    mesh(
        at.iter().map(|at| at.extend(0.0).to_array()).collect(),
        vec![[0.0, 0.0, 1.0]; at.len()],
        at.iter().map(|at| (place + *at * reach).to_array()).collect(),
        colors,
        (2..corners).flat_map(|i| [0, i - 1, i]).collect(),
        false,
    )
}
