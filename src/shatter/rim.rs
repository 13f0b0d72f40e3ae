//! The rims of shards: a bevel along the outline that catches the light.

use super::{Shards, ShatterError, cuts::in_range};
use crate::math::Rng;
use glam::{DVec2, Vec2};

/// The look of the rims of shards. All numbers are 0 by default, as in [`PLAIN`](Self::PLAIN).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct RimLook {
    /// Width of the bevel along the outline, pattern units, 0..=0.1; 0 = no bevel, and `bright` and `relief` have no
    /// effect. It is narrower where a shard is too narrow.
    pub width: f32,
    /// How much brighter and less transparent the outer edge is than the picture, as a share of it, -1..=8; below
    /// zero it is darker.
    pub bright: f32,
    /// How much brighter edges are that face the upper left of the picture, and how much darker those that face away,
    /// 0..=1.
    pub relief: f32,
    /// Displacement of the picture in each shard, in a different direction in each (refraction), pattern units,
    /// 0..=0.1. Above 0, shards in their places do not look exactly like the surface.
    pub shift: f32,
}

impl RimLook {
    /// No rim: shards in their places look exactly like the surface, bit for bit.
    pub const PLAIN: Self = Self { width: 0.0, bright: 0.0, relief: 0.0, shift: 0.0 };
    /// Glass: bright edges.
    pub const GLASS: Self = Self { width: 0.009, bright: 0.9, relief: 0.45, shift: 0.004 };
    /// Stone, clay, plaster: worn, darker edges.
    pub const STONE: Self = Self { width: 0.007, bright: -0.3, relief: 0.25, shift: 0.0 };

    /// Checks every field against its range.
    ///
    /// # Errors
    /// [`ShatterError::OutOfRange`] for the first field that is out of its range.
    pub fn validate(&self) -> Result<(), ShatterError> {
        in_range("width", self.width, 0.0, 0.1)?;
        in_range("bright", self.bright, -1.0, 8.0)?;
        in_range("relief", self.relief, 0.0, 1.0)?;
        in_range("shift", self.shift, 0.0, 0.1)
    }

    /// Factor for the colour at an outer edge that faces `outward` (unit vector, y down): red, green, blue, opacity.
    pub(super) fn gain(&self, outward: Vec2) -> [f32; 4] {
        const LIGHT: Vec2 = Vec2::new(-0.6, -0.8);
        let light = (1.0 + self.bright + self.relief * outward.dot(LIGHT)).max(0.0);
        [light, light, light, 1.0 + self.bright.max(0.0)]
    }
}

/// A corner of a bevel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bevel {
    /// Position of the corner's inner counterpart, pattern units.
    pub(super) inner: DVec2,
    /// Direction away from the shard, a unit vector.
    pub(super) outward: Vec2,
}

/// Where there is no room for the full width, it is halved up to this many times; after that there is no bevel.
const HALVINGS: u32 = 5;

impl Shards {
    /// Computes the bevel of a shard: an inner counterpart for each of its [`corners`](Self::corners), into `bevels`.
    ///
    /// The triangles of the counterparts, and of the bands between them and the outline, have positive areas wherever
    /// the bevel has a width. They have the topology of the shard's own triangulation and the same outline, so they
    /// fill the shard without overlap.
    pub(super) fn bevels(&self, shard: u32, width: f32, bevels: &mut Vec<Bevel>) {
        bevels.clear();
        let places: Vec<DVec2> =
            self.corners(shard).iter().map(|&corner| self.positions()[corner as usize].as_dvec2()).collect();
        // The corner after each corner.
        let mut following: Vec<u32> = (1..=places.len() as u32).collect();
        bevels.reserve(places.len());
        let mut first = 0;
        for ring in self.rings_of(shard).map(<[u32]>::len) {
            let end = first + ring;
            following[end - 1] = first as u32;
            let normal = |from: DVec2, to: DVec2| (to - from).normalize_or_zero().perp();
            let mut before = normal(places[end - 1], places[first]);
            for i in first..end {
                let after = normal(places[i], places[following[i] as usize]);
                let sum = before + after;
                // Limited: sharp corners would reach far inside, and spikes to infinity.
                let way = sum / (1.0 + before.dot(after)).max(0.5);
                let inner = places[i] + way * f64::from(width);
                bevels.push(Bevel { inner, outward: -sum.normalize_or_zero().as_vec2() });
                before = after;
            }
            first = end;
        }
        // Without branches: which triangles are folded is unpredictable.
        let triangles = self.triangles(shard);
        let mut folded = vec![false; places.len()];
        for round in 0.. {
            for triangle in triangles {
                let is_bad = is_folded(triangle.map(|i| bevels[i as usize].inner));
                triangle.iter().for_each(|&i| folded[i as usize] |= is_bad);
            }
            for (a, &b) in following.iter().enumerate() {
                let b = b as usize;
                let [inner_a, inner_b] = [bevels[a].inner, bevels[b].inner];
                let is_bad = is_folded([places[a], places[b], inner_b]) | is_folded([places[a], inner_b, inner_a]);
                folded[a] |= is_bad;
                folded[b] |= is_bad;
            }
            let mut moved = false;
            for ((bevel, &place), folded) in bevels.iter_mut().zip(&places).zip(&mut folded) {
                if std::mem::take(folded) && bevel.inner != place {
                    bevel.inner = if round < HALVINGS { 0.5 * (bevel.inner + place) } else { place };
                    moved = true;
                }
            }
            if !moved {
                break;
            }
        }
    }

    /// Displacement of the picture in a shard, pattern units, limited so that nothing beyond the surface shows.
    pub(super) fn shift(&self, shard: u32, shift: f32, seed: u64) -> Vec2 {
        if shift == 0.0 {
            return Vec2::ZERO;
        }
        let mut rng = Rng::new(seed).stream("shift").substream(u64::from(shard));
        let way = Vec2::new(rng.signed(), rng.signed()).normalize_or(Vec2::X) * shift;
        let places = self.outline(shard).iter().map(|&corner| self.positions()[corner as usize]);
        let (low, high) =
            places.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
        way.max(-low).min(self.extent() - high)
    }
}

/// Whether the corners of a triangle, from x to y, have reversed their order.
fn is_folded([a, b, c]: [DVec2; 3]) -> bool {
    (b - a).perp_dot(c - a) < 0.0
}
