//! [`PrimitiveLine`]: the middle line of a crack in a primitive.

use glam::Vec2;

/// A point of a line of a primitive, in heights of its image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrimitivePoint {
    /// Across: 0 in the middle, positive to the right. Down: 0 at the head, 1 at the tail.
    pub at: Vec2,
    /// Width of the crack there.
    pub width: f32,
}

/// A line of a primitive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PrimitiveLine {
    /// Line and point at which it begins; `None` for the main line, which runs from head to tail.
    pub from: Option<(u32, u32)>,
    /// Its points; for a side line without the point at which it begins.
    pub points: Vec<PrimitivePoint>,
}
