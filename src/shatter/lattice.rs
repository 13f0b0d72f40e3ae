//! Integer coordinates: every geometric test has an exact answer.

use crate::math::whole::{cross, dot, vector};
use glam::Vec2;
use std::hash::{BuildHasherDefault, Hasher};

/// No number: an index that does not exist.
pub(super) const NONE: u32 = u32::MAX;

/// A point of the lattice.
pub(super) type Place = [i32; 2];

/// Coordinates are below this, so that they fit a 32-bit float and products of differences fit 64 bits.
const RANGE: f64 = (1u32 << 24) as f64;

/// The conversion between pattern space and the lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    pub(super) extent: Vec2,
    /// Lattice units per pattern unit, a power of two.
    pub(super) scale: f64,
    /// The corner opposite to (0, 0).
    pub(super) corner: Place,
}

impl Lattice {
    /// The lattice of a surface of 1 x 1.
    pub(super) const ONE: Self = Self { extent: Vec2::ONE, scale: RANGE, corner: [1 << 24; 2] };

    pub(super) fn new(extent: Vec2) -> Option<Self> {
        if !extent.is_finite() || extent.min_element() <= 0.0 {
            return None;
        }
        let longest = f64::from(extent.max_element());
        let mut scale = 1.0;
        while longest * scale > RANGE {
            scale *= 0.5;
        }
        while longest * scale * 2.0 <= RANGE {
            scale *= 2.0;
        }
        let corner = extent.to_array().map(|side| (f64::from(side) * scale).round() as i32);
        (corner[0] > 0 && corner[1] > 0).then_some(Self { extent, scale, corner })
    }

    /// The lattice point nearest to a position; positions off the surface are moved to the border.
    pub(super) fn snap(&self, pos: Vec2) -> Place {
        // Rounds to the nearest; below zero it does not, but there the border is nearest anyway.
        let coordinate = |x: f32, most: i32| ((f64::from(x) * self.scale + 0.5) as i32).clamp(0, most);
        [coordinate(pos.x, self.corner[0]), coordinate(pos.y, self.corner[1])]
    }

    /// Exact, because the scale is a power of two.
    pub(super) fn pos(&self, [x, y]: Place) -> Vec2 {
        let coordinate = |x: i32, most: i32, end: f32| if x == most { end } else { (f64::from(x) / self.scale) as f32 };
        Vec2::new(coordinate(x, self.corner[0], self.extent.x), coordinate(y, self.corner[1], self.extent.y))
    }

    /// Which sides of the border a place lies on: left, right, top, bottom.
    pub(super) const fn sides(&self, [x, y]: Place) -> [bool; 4] {
        [x == 0, x == self.corner[0], y == 0, y == self.corner[1]]
    }

    /// The side of the border on which the line between two places lies.
    pub(super) fn side_of(&self, a: Place, b: Place) -> Option<usize> {
        let (a, b) = (self.sides(a), self.sides(b));
        (0..4).find(|&side| a[side] && b[side])
    }
}

/// Above zero if `c` lies on the side of the line from `a` to `b` to which x turns to reach y.
pub(super) fn orient(a: Place, b: Place, c: Place) -> i64 {
    cross(vector(a, b), vector(a, c))
}

pub(super) fn distance_sq(a: Place, b: Place) -> i64 {
    let way = vector(a, b);
    dot(way, way)
}

/// Twice the signed area of a ring.
pub(super) fn ring_area(ring: impl Iterator<Item = Place> + Clone) -> i64 {
    let following = ring.clone().skip(1).chain(ring.clone().take(1));
    ring.zip(following).map(|(a, b)| cross(a.map(i64::from), b.map(i64::from))).sum()
}

/// A fast hash for places; it need not resist attacks.
#[derive(Clone, Copy, Default)]
pub(super) struct PlaceHasher(u64);

/// Index of each place.
pub(super) type PlaceMap = std::collections::HashMap<u64, u32, BuildHasherDefault<PlaceHasher>>;

/// A place as one number.
pub(super) const fn key([x, y]: Place) -> u64 {
    (x as u32 as u64) << 32 | y as u32 as u64
}

impl Hasher for PlaceHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_u64(&mut self, x: u64) {
        let mixed = (self.0 ^ x).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.0 = mixed ^ mixed >> 32;
    }
}
