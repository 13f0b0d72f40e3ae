//! [`Floor`]: a plane on which flying pieces come to rest.

use super::{ShatterError, cuts::in_range};
use crate::math::{
    ops,
    turns::{after, between, from_to, turned},
};
use glam::{Quat, Vec3};

/// A plane on which pieces land, bounce a little, slide, and come to rest. Place and time of the landing are computed
/// when a piece leaves, so that a piece is at the same place at the same time, forwards and backwards.
///
/// Coordinates are those of flights: pattern units, x right, y up, z towards the viewer, relative to the top left of
/// the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// Normal of the plane, away from the solid side; of any length except zero.
    pub up: Vec3,
    /// The value of `up · point` for points of the plane.
    pub height: f32,
    /// Distance from the plane to the middle of a resting piece, pattern units, 0..=10: half its thickness. Pieces
    /// that stand upright are as high as they are large.
    pub clearance: f32,
    /// How far a curved piece reaches behind its middle, pattern units, 0..=64; 0 = it is flat. Lying with its face up, it rests on what reaches
    /// furthest.
    pub depth: f32,
    /// Whether pieces come to lie flat on it; else they turn their faces to the viewer, as in a game with a side
    /// view.
    pub lies_flat: bool,
}

/// Share of the speed that a piece keeps when it bounces.
const BOUNCE: f32 = 0.28;

/// Number of bounces.
const BOUNCES: u32 = 3;

/// How fast a piece stops sliding, and how fast it turns to its resting position: shares a second.
const FRICTION: f32 = 4.5;
const SETTLING: f32 = 5.0;

/// The longest flight, seconds.
const LONGEST: f32 = 600.0;

impl Floor {
    pub(super) fn validate(&self) -> Result<(), ShatterError> {
        if !self.up.is_finite() || self.up.length_squared() < 1e-12 {
            return Err(ShatterError::NotFinite { index: 0 });
        }
        in_range("floor.height", self.height, -1e6, 1e6)?;
        in_range("floor.clearance", self.clearance, 0.0, 10.0)?;
        in_range("floor.depth", self.depth, 0.0, 64.0)
    }

    /// Where a piece of this size that starts at `start` lands; `motion` gives its offset and velocity after some
    /// seconds. `None` if it never reaches the floor, or if it starts below it, unless it `must` land. That is set
    /// for parts of a piece that lands, however far they reach into the floor.
    pub(super) fn landing(
        &self,
        start: Vec3,
        (size, must): (f32, bool),
        gravity: Vec3,
        motion: impl Fn(f32) -> (Vec3, Vec3),
    ) -> Option<Landing> {
        let length = self.up.length();
        let up = self.up / length;
        let clearance = if self.lies_flat { self.clearance } else { 0.5 * size };
        let base = up.dot(start) - self.height / length - clearance;
        let above = |time: f32| base + up.dot(motion(time).0);
        let pull = -up.dot(gravity);
        if (above(0.0) < -clearance - 1e-4 && !must) || pull <= 1e-4 || pull.is_nan() {
            return None;
        }
        // It can only rise before it falls, so there is one crossing.
        let mut late = 0.05;
        while above(late) > 0.0 {
            late *= 2.0;
            if late > LONGEST {
                return None;
            }
        }
        let mut early = 0.0;
        for _ in 0..30 {
            let middle = 0.5 * (early + late);
            if above(middle) > 0.0 { early = middle } else { late = middle }
        }
        let (offset, velocity) = motion(late);
        let fall = (-up.dot(velocity)).max(0.0);
        let (sunk, skid) = ((-above(late)).max(0.0), velocity - up * up.dot(velocity));
        let depth = if self.lies_flat { self.depth } else { 0.0 };
        Some(Landing { time: late, offset, up, sunk, fall, pull, skid, depth, lies_flat: self.lies_flat })
    }
}

/// How a piece comes to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Landing {
    /// When, seconds after its release.
    pub(super) time: f32,
    /// Where.
    offset: Vec3,
    up: Vec3,
    /// How far it was below the floor when it left its place; it rises by that.
    sunk: f32,
    /// Speed at which it hit the floor.
    fall: f32,
    /// Acceleration towards the floor.
    pull: f32,
    /// Its velocity along the floor.
    skid: Vec3,
    depth: f32,
    lies_flat: bool,
}

impl Landing {
    /// Offset and velocity `seconds` after it has landed.
    pub(super) fn motion(&self, seconds: f32) -> (Vec3, Vec3) {
        let left = ops::exp(-FRICTION * seconds);
        let (mut rise, mut speed) = (0.0, 0.0);
        let (mut since, mut up) = (seconds, self.fall);
        for _ in 0..BOUNCES {
            up *= BOUNCE;
            let length = 2.0 * up / self.pull;
            if since < length {
                rise = since * (up - 0.5 * self.pull * since);
                speed = up - self.pull * since;
                break;
            }
            since -= length;
        }
        let offset = self.offset + self.skid * ((1.0 - left) / FRICTION) + self.up * (rise + self.sunk * (1.0 - left));
        (offset, self.skid * left + self.up * speed)
    }

    /// How far it is lifted `seconds` after it has landed with the rotation `landed`: as far as what reaches behind it needs.
    pub(super) fn lift(&self, landed: Quat, seconds: f32) -> Vec3 {
        let is_face_up = turned(landed, Vec3::Z).dot(self.up) >= 0.0;
        if is_face_up && self.depth > 0.0 {
            self.up * (self.depth * (1.0 - ops::exp(-SETTLING * seconds)))
        } else {
            Vec3::ZERO
        }
    }

    /// Its rotation `seconds` after it has landed with the rotation `landed`.
    pub(super) fn rotation(&self, landed: Quat, seconds: f32) -> Quat {
        let face = turned(landed, Vec3::Z);
        let lie = if self.lies_flat { self.up } else { Vec3::Z };
        let lie = if face.dot(lie) < 0.0 { -lie } else { lie };
        let rest = after(from_to(face, lie), landed);
        between(landed, rest, 1.0 - ops::exp(-SETTLING * seconds))
    }
}
