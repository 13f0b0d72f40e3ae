//! Meshes laid out flat: cracks grow in a plane, also those on boxes, stairs and rocks.
//!
//! A mesh is cut into charts, parts of it that lie in the plane without covering one another. The first chart spreads from the point that is
//! hit, so that cracks run over edges and around curves; what does not lie flat any more becomes charts of its own, and so on until all of
//! the mesh is laid out.
//!
//! - Meshes of few flat faces, or of faces that mostly meet at large angles, are unfolded about their edges (`hinge.rs`): lengths and angles
//!   stay as they are. Edges that are one in part only are hinges too.
//! - Others are laid out by distance and direction from the point (`curved.rs`), the discrete exponential map of Schmidt, Grimm and Wyvill
//!   (2006), with means over neighbours as Schmidt (2013) has them, in which those count the most that lie straight before a vertex.
//!
//! ```
//! use bevy_crack::unwrap::{LaidOut, MeshShape, Unwrap};
//! use glam::{UVec2, Vec3};
//!
//! // Two squares that meet at a right angle.
//! let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
//! let positions = [
//!     corner(0., 0., 0.), corner(1., 0., 0.), corner(1., 1., 0.), corner(0., 1., 0.),
//!     corner(1., 0., -1.), corner(1., 1., -1.),
//! ];
//! let triangles = [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]];
//! let shape = MeshShape::new(&positions, &triangles)?;
//! assert_eq!((shape.len(), shape.faces(), shape.area()), (4, 2, 2.0));
//! assert!(!shape.is_empty() && shape.has_area(3) && !shape.has_area(4));
//! let around = Vec3::new(0.5, 0.5, 0.);
//! let unwrap = Unwrap { around, triangle: 0, right: Vec3::X, texels: 64.0, most_side: 4096, most_texels: 1 << 20 };
//! let laid_out: LaidOut = unwrap.apply(&shape)?;
//! // Side by side, with some texels around them.
//! assert!(laid_out.size.x >= 128 && laid_out.size.y >= 64);
//! let [corners, beside] = [0, 2].map(|triangle| laid_out.corners[triangle].unwrap());
//! // They share an edge.
//! assert!(corners[1].distance(beside[0]) < 1e-3);
//! // The texel in the middle of a triangle is one of its own.
//! let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
//! assert_eq!(laid_out.owner(middle.as_uvec2()), Some(0));
//! assert_eq!(laid_out.owner(laid_out.size), None);
//! # Ok::<(), bevy_crack::unwrap::UnwrapError>(())
//! ```

mod beside;
mod chart;
mod curved;
mod error;
mod hinge;
mod pack;
mod shape;

pub use error::{MAX_CHARTS, MAX_TRIANGLES, UnwrapError};
pub use pack::{Cut, GUTTER, LaidOut};
pub use shape::MeshShape;

use beside::Beside;
use chart::{Chart, Start};
use glam::Vec3;

/// How a mesh is laid out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unwrap {
    /// The point from which the first chart spreads, in the space of the positions.
    pub around: Vec3,
    /// The triangle in which it lies.
    pub triangle: usize,
    /// The direction that is to the right in the plane of the first chart; any length. Where it is of no use, an edge of the triangle is.
    pub right: Vec3,
    /// Texels for a unit of length, above 0.
    pub texels: f32,
    /// The most texels of a side, 1..=65,536.
    pub most_side: u32,
    /// The most texels in all, gaps among them.
    pub most_texels: u64,
}

impl Unwrap {
    /// Lays out a mesh.
    ///
    /// # Errors
    /// [`UnwrapError::Parameter`] for values out of their range, [`UnwrapError::TooManyCharts`] and [`UnwrapError::TooLarge`] for meshes
    /// that do not fit.
    pub fn apply(&self, shape: &MeshShape) -> Result<LaidOut, UnwrapError> {
        if !self.around.is_finite() {
            return Err(UnwrapError::Parameter("around"));
        }
        if !(self.texels > 0.0 && self.texels.is_finite()) {
            return Err(UnwrapError::Parameter("texels"));
        }
        if !(1..=1 << 16).contains(&self.most_side) {
            return Err(UnwrapError::Parameter("most_side"));
        }
        if !shape.has_area(self.triangle) {
            return Err(UnwrapError::Parameter("triangle"));
        }
        let beside = if hinge::has_hinges(shape) { beside::find(shape) } else { Vec::new() };
        let charts = charts(shape, &beside, self)?;
        pack::pack(shape, &beside, &charts, self.texels, (self.most_side, self.most_texels))
    }
}

fn charts(shape: &MeshShape, beside: &[Beside], unwrap: &Unwrap) -> Result<Vec<Chart>, UnwrapError> {
    let mut is_free: Vec<bool> = (0..shape.len()).map(|triangle| shape.has_area(triangle)).collect();
    let mut charts = Vec::new();
    let mut start = Some(Start { triangle: unwrap.triangle, point: unwrap.around, right: unwrap.right });
    let points = (!hinge::has_hinges(shape)).then(|| curved::Points::of(shape));
    let mut first_free = 0;
    while let Some(from) = start {
        if charts.len() == MAX_CHARTS {
            return Err(UnwrapError::TooManyCharts);
        }
        let chart = match &points {
            None => hinge::unfold(shape, beside, from, &is_free),
            Some(points) => curved::lay_out(shape, points, from, &is_free),
        };
        for (triangle, _) in &chart.triangles {
            is_free[*triangle] = false;
        }
        charts.push(chart);
        first_free += is_free[first_free..].iter().take_while(|is_free| !**is_free).count();
        start = (first_free < is_free.len()).then(|| {
            let triangle =
                if points.is_some() { farthest(shape, unwrap.around, &is_free, first_free) } else { first_free };
            Start { triangle, point: shape.centroid(triangle), right: unwrap.right }
        });
    }
    Ok(charts)
}

/// The free triangle that is farthest from a point: what is left of a curved mesh is opposite to where the first chart began.
fn farthest(shape: &MeshShape, from: Vec3, is_free: &[bool], first: usize) -> usize {
    let free = (first..is_free.len()).filter(|triangle| is_free[*triangle]);
    let distance = |triangle: &usize| shape.centroid(*triangle).distance_squared(from);
    free.max_by(|a, b| distance(a).total_cmp(&distance(b)).then(b.cmp(a))).unwrap_or(first)
}

#[cfg(test)]
mod tests;
