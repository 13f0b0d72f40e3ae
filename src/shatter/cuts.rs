//! [`Cuts`], and [`shatter`], which makes [`Shards`] from them.

use super::{Shards, drawing::Drawing, faces::Faces, lattice::Lattice};
use crate::pattern::Network;
use glam::Vec2;

/// An error of shattering.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShatterError {
    /// The surface has no size.
    #[error(
        "a surface of {width} x {height} pattern units: both must be finite, above zero, and not 2^24 times the other"
    )]
    /// The surface has no valid size.
    Extent {
        /// Width given.
        width: f32,
        /// Height given.
        height: f32,
    },
    /// A point of a line is NaN or infinite.
    #[error("point {index} of a line is not finite")]
    NotFinite {
        /// Index of the point.
        index: usize,
    },
    /// A parameter is outside its range, or not finite.
    #[error("parameter `{name}` is {value}, must lie in {min}..={max}")]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// There is no such shard.
    #[error("there is no shard {shard}")]
    NoShard {
        /// The number that was given.
        shard: u32,
    },
}

/// `Ok` if a parameter lies in its range.
pub(super) fn in_range(name: &'static str, value: f32, min: f64, max: f64) -> Result<(), ShatterError> {
    // Compared in single precision: `1e-6_f32` is a little less than `1e-6_f64`.
    if (min as f32..=max as f32).contains(&value) {
        return Ok(());
    }
    Err(ShatterError::OutOfRange { name, value: value.into(), min, max })
}

/// The lines along which a surface is cut.
///
/// Lines may cross, touch, overlap and end anywhere. Points are moved by up to half a unit of the lattice, which is
/// up to 2⁻²⁴ of the longer side, and points off the surface are moved to its border.
///
/// ```
/// use bevy_crack::{CrackPreset, growth::CrackGrowth, shatter::{Cuts, ShatterParams, shatter}};
///
/// let mut growth = CrackGrowth::new(CrackPreset::GLASS.growth, [1.0, 1.0].into(), 1)?;
/// growth.hit([0.5, 0.5].into(), 1.0);
/// while growth.step().grew() {}
/// let shards = shatter(Cuts::from_network(growth.network())?, &ShatterParams { extend_cracks: true, ..Default::default() })?;
/// assert!(shards.len() > 4);
/// let area: f32 = shards.iter().map(|shard| shard.area).sum();
/// assert!((area - 1.0).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Cuts {
    pub(super) drawing: Drawing,
}

impl Cuts {
    /// A surface of `extent` pattern units without cuts.
    ///
    /// # Errors
    /// [`ShatterError::Extent`] if the extent is not finite, not above zero, or one side is more than 2²⁴ times the
    /// other.
    pub fn new(extent: Vec2) -> Result<Self, ShatterError> {
        let lattice = Lattice::new(extent).ok_or(ShatterError::Extent { width: extent.x, height: extent.y })?;
        Ok(Self { drawing: Drawing::new(lattice) })
    }

    /// The rough lines of a network.
    ///
    /// # Errors
    /// As for [`new`](Self::new), with the extent of the network; [`ShatterError::NotFinite`] if one of its nodes is
    /// not finite.
    pub fn from_network(network: &Network) -> Result<Self, ShatterError> {
        let mut cuts = Self::new(network.extent())?;
        cuts.drawing.reserve(2 * network.nodes().len());
        for segment in network.segments() {
            if let Some(path) = network.path(segment) {
                let points = path.points();
                if let Some(index) = points.iter().position(|point| !point.pos.is_finite()) {
                    return Err(ShatterError::NotFinite { index });
                }
                cuts.drawing.line(points.iter().map(|point| point.pos));
            }
        }
        Ok(cuts)
    }

    /// Adds a line through points in pattern units.
    ///
    /// # Errors
    /// [`ShatterError::NotFinite`] if a point is NaN or infinite; nothing is added then.
    pub fn add_line(&mut self, points: &[Vec2]) -> Result<(), ShatterError> {
        if let Some(index) = points.iter().position(|point| !point.is_finite()) {
            return Err(ShatterError::NotFinite { index });
        }
        self.drawing.line(points.iter().copied());
        Ok(())
    }
}

/// How lines become shards.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct ShatterParams {
    /// Whether cracks that end inside a piece are extended to the next crack or the border. Default: `false`.
    pub extend_cracks: bool,
    /// Pieces below this area are merged into the neighbour with which they share most of their outline. Pattern
    /// units squared, 0..=1; default: 2e-5, five texels of a surface of 512. 0 keeps every splinter.
    pub min_area: f32,
    /// Largest number of shards, 1..=1000000; the smallest are merged into their neighbours. Default: 10,000.
    pub max_shards: u32,
    /// Seed of the extended lines. Default: 0.
    pub seed: u64,
}

impl ShatterParams {
    /// The default.
    pub const DEFAULT: Self = Self { extend_cracks: false, min_area: 2e-5, max_shards: 10_000, seed: 0 };
}

impl Default for ShatterParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Cuts a surface along lines into the faces that the lines and the border enclose.
///
/// Lines that enclose nothing cut nothing; without lines there is one shard, the whole surface.
///
/// # Errors
/// [`ShatterError::OutOfRange`] if a parameter is out of its range.
pub fn shatter(cuts: Cuts, params: &ShatterParams) -> Result<Shards, ShatterError> {
    in_range("min_area", params.min_area, 0.0, 1.0)?;
    in_range("max_shards", params.max_shards as f32, 1.0, 1e6)?;
    let mut drawing = cuts.drawing;
    drawing.make_planar();
    let carried = if params.extend_cracks { drawing.extend_cracks(params.seed) } else { Vec::new() };
    let scale = drawing.lattice.scale;
    let least = (2.0 * f64::from(params.min_area) * scale * scale) as i64;
    let mut faces = Faces::trace(&mut drawing);
    while faces.join_small(&mut drawing, least, params.max_shards as usize, |_| ()) {
        faces = Faces::trace(&mut drawing);
    }
    Ok(Shards::new(&drawing, &faces, carried))
}
