//! Cells as they were when they closed.

use super::half_edge::Cause;
use glam::Vec2;

/// The cells of a network, each as it was when it closed: later cells have been cut off from it since.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Closings {
    list: Vec<Closing>,
    /// All outlines, concatenated.
    points: Vec<Vec2>,
}

/// A cell at the moment when it closed. The first entry is cell 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closing {
    /// Step of the timeline of the segment that closes it.
    pub(crate) birth: u32,
    /// The impact of that segment.
    pub(crate) impact: u32,
    /// The cell from which it was cut off.
    pub(crate) host: u32,
    /// Area inside the outline, pattern units squared, and its centre.
    pub(crate) area: f32,
    pub(crate) centroid: Vec2,
    first: usize,
    end: usize,
}

impl Closings {
    pub(crate) fn all(&self) -> &[Closing] {
        &self.list
    }

    /// The straight outline, pattern units.
    pub(crate) fn outline(&self, closing: &Closing) -> &[Vec2] {
        self.points.get(closing.first..closing.end).unwrap_or_default()
    }

    pub(super) fn push(
        &mut self,
        cause: Cause,
        host: u32,
        (area, centroid): (f32, Vec2),
        outline: impl Iterator<Item = Vec2>,
    ) {
        let first = self.points.len();
        self.points.extend(outline);
        let Cause { birth, impact } = cause;
        self.list.push(Closing { birth, impact, host, area, centroid, first, end: self.points.len() });
    }
}
