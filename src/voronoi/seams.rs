//! [`Seams`]: the boundaries of the regions as smooth lines.

use crate::pattern::PathPoint;
use glam::Vec2;

/// A point where seams end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamVertex {
    /// Position, pattern units. On the border of a plain surface one coordinate is exactly zero or the extent.
    pub pos: Vec2,
    /// Whether it lies on the border of the surface, or of a chart of [`MapCharts`](super::MapCharts).
    pub on_border: bool,
}

/// The line between two regions from one vertex to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// Index of the vertex at which it begins.
    pub from: u32,
    /// Index of the vertex at which it ends; equals `from` for a region that lies within another one.
    pub to: u32,
    /// The region to the left in the direction from `from` to `to` (y is down: left of east is north).
    pub left: u32,
    /// The region to the right.
    pub right: u32,
    /// The level at which the crack appeared, 0 = oldest.
    pub level: u32,
    /// The points of the line with their widths, pattern units; the first and the last are the vertices.
    pub points: Vec<PathPoint>,
}

/// All boundaries of a map: a planar graph whose lines meet only in its vertices.
///
/// ```
/// use bevy_crack::{
///     pattern::SurfaceFrame,
///     raster::{DepthField, Profile},
///     voronoi::{Front, Seam, SeamVertex, VoronoiBake, VoronoiParams},
/// };
///
/// let (_, seams) = VoronoiBake::new(VoronoiParams::DEFAULT, Vec::new(), [64, 64].into(), 7)?.finish();
/// let first: &Seam = &seams.seams[0];
/// let SeamVertex { pos, .. } = seams.vertices[first.from as usize];
/// assert_eq!(first.points[0].pos, pos);
///
/// // All of them at once, or as a front that runs out from an impact has opened them.
/// let frame = SurfaceFrame::new([64, 64].into())?;
/// let (mut whole, mut grown, mut young) = (DepthField::new(frame), DepthField::new(frame), DepthField::new(frame));
/// seams.stamp(&mut whole, &Profile::DEFAULT);
/// let front = Front::new(&seams, [0.5, 0.5].into());
/// seams.stamp_front(&mut grown, &Profile::DEFAULT, &front, front.reach());
/// seams.stamp_front(&mut young, &Profile::DEFAULT, &front, 0.2 * front.reach());
/// assert_eq!(grown, whole);
/// assert_ne!(young, whole);
/// // Or all of them, half as wide.
/// let mut narrow = DepthField::new(frame);
/// seams.stamp_share(&mut narrow, &Profile::DEFAULT, 0.5);
/// assert!(narrow.depth.as_slice().iter().zip(whole.depth.as_slice()).all(|(narrow, whole)| narrow <= whole));
/// // As a network they can be added to other cracks, or cut a surface into shards.
/// let network = seams.network([0.5, 0.5].into());
/// assert!(network.nodes().iter().any(|node| node.pos == pos));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seams {
    /// Size of the surface, pattern units.
    pub extent: Vec2,
    /// Where seams end.
    pub vertices: Vec<SeamVertex>,
    /// The seams, in scan order of the rows.
    pub seams: Vec<Seam>,
}
