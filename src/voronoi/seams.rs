//! [`Seams`]: the boundaries of the regions as smooth lines.

use crate::pattern::PathPoint;
use glam::Vec2;

/// A point where seams end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamVertex {
    /// Position, pattern units. On the border one coordinate is exactly zero or the extent.
    pub pos: Vec2,
    /// Whether it lies on the border of the surface.
    pub on_border: bool,
}

/// The line between two regions from one vertex to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// Index of the vertex at which it begins.
    pub from: u32,
    /// Index of the vertex at which it ends; the same as `from` for a region that lies within another one.
    pub to: u32,
    /// The region to the left as one goes from `from` to `to` (y is down: left of east is north).
    pub left: u32,
    /// The region to the right.
    pub right: u32,
    /// The level at which the crack appeared, 0 = oldest.
    pub level: u32,
    /// The line with its widths, pattern units; first and last are the vertices.
    pub points: Vec<PathPoint>,
}

/// All boundaries of a map: a planar graph that meets only in its vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seams {
    /// Size of the surface, pattern units.
    pub extent: Vec2,
    /// Where seams end.
    pub vertices: Vec<SeamVertex>,
    /// The seams, in the order in which rows are read.
    pub seams: Vec<Seam>,
}
