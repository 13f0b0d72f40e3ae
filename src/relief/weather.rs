//! What weather makes of a height field: [`Weathering`], [`weathered`].

use super::{
    heights_error::HeightError,
    terrain::check_heights,
    terrain_blur::blurred,
    terrain_noise::RowNoise,
    terrain_normals::Slopes,
    terrain_wear::{Gullies, Scoops},
};
use crate::{Grid, math::Rng, pattern::SurfaceFrame};
use glam::Vec2;

/// What weather makes of ground that contours have shaped: lines bend, water wears gullies into slopes, pieces break
/// off.
///
/// This goes beyond the paper. Contours and heights alone are too even for a surface that is seen from near. Lengths
/// are in pattern units.
///
/// ```
/// use bevy_crack::relief::Weathering;
///
/// let dry = Weathering { gullies: 0.0, ..Weathering::LAND };
/// assert_eq!(dry.validate(), Ok(()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Weathering {
    /// How far lines are bent aside. 0..=0.2; default 0.
    pub bend: f32,
    /// Size of the largest bends. 0.005..=4; default 0.15.
    pub bend_size: f32,
    /// Depth of the gullies that water wears into slopes above height 0, as a share of their width. They run downhill
    /// and branch. 0..=1; default 0.
    pub gullies: f32,
    /// Width of the widest gullies. 0.002..=1; default 0.05.
    pub gully_width: f32,
    /// Depth of the scoops that pieces leave which break off, as a share of their size. 0..=1; default 0.
    pub chips: f32,
    /// Size of the largest scoops. 0.002..=1; default 0.1.
    pub chip_size: f32,
    /// Height of the finest roughness. 0..=0.1; default 0.
    pub grain: f32,
}

impl Weathering {
    /// The default: heights stay as they are.
    pub const NONE: Self =
        Self { bend: 0.0, bend_size: 0.15, gullies: 0.0, gully_width: 0.05, chips: 0.0, chip_size: 0.1, grain: 0.0 };

    /// Rock that breaks in scoops.
    pub const ROCK: Self = Self { bend: 0.014, chips: 0.3, chip_size: 0.17, grain: 0.0008, ..Self::NONE };

    /// Land with soil on it: gullies and ridges.
    pub const LAND: Self =
        Self { bend: 0.02, bend_size: 0.2, gullies: 0.3, gully_width: 0.07, grain: 0.0006, ..Self::NONE };

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`HeightError::OutOfRange`] for the first number that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), HeightError> {
        let ranges = [
            ("bend", self.bend, 0.0, 0.2),
            ("bend_size", self.bend_size, 0.005, 4.0),
            ("gullies", self.gullies, 0.0, 1.0),
            ("gully_width", self.gully_width, 0.002, 1.0),
            ("chips", self.chips, 0.0, 1.0),
            ("chip_size", self.chip_size, 0.002, 1.0),
            ("grain", self.grain, 0.0, 0.1),
        ];
        match ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value)) {
            Some((name, value, min, max)) => Err(HeightError::OutOfRange { name, value, min, max }),
            None => Ok(()),
        }
    }
}

impl Default for Weathering {
    fn default() -> Self {
        Self::NONE
    }
}

/// Heights after the weather. With [`Weathering::NONE`] they are the same.
///
/// Heights are in pattern units, of texels as `frame` tells. The result depends on the arguments alone.
///
/// # Errors
/// [`HeightError`] if a number of `weathering` is out of range, or a height is not finite.
///
/// ```
/// use bevy_crack::{Grid, pattern::SurfaceFrame, relief::{Weathering, weathered}};
///
/// // A slope that is worn.
/// let frame = SurfaceFrame::new([64, 64].into())?;
/// let slope = Grid::from_vec([64, 64].into(), (0..64 * 64).map(|i| (i % 64) as f32 / 64.0).collect()).unwrap();
/// let worn = weathered(&slope, &frame, &Weathering::LAND, 1)?;
/// assert_ne!(worn, slope);
/// assert_eq!(weathered(&slope, &frame, &Weathering::NONE, 1)?, slope);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn weathered(
    heights: &Grid<f32>,
    frame: &SurfaceFrame,
    weathering: &Weathering,
    seed: u64,
) -> Result<Grid<f32>, HeightError> {
    weathering.validate()?;
    check_heights(heights, 1)?;
    let mut job = WeatherJob::new(heights.clone(), *frame, *weathering, seed);
    while job.step() {}
    Ok(job.heights)
}

/// Texels of a step, about.
const TEXELS: usize = 1 << 12;

/// The weathering of a height field in steps of bounded work.
#[derive(Clone, Debug)]
pub(super) struct WeatherJob {
    pub(super) heights: Grid<f32>,
    frame: SurfaceFrame,
    weathering: Weathering,
    seed: u64,
    stage: Stage,
}

#[derive(Clone, Debug)]
enum Stage {
    /// Lines are bent, from these heights, beginning at a row.
    Bend {
        from: Grid<f32>,
        noises: Box<[RowNoise; 2]>,
        row: usize,
    },
    /// The broad slopes are measured.
    Measure,
    /// Everything else, beginning at a row.
    Wear {
        broad: Grid<f32>,
        noise: Box<RowNoise>,
        row: usize,
    },
    Done,
}

impl WeatherJob {
    /// Numbers and heights have been checked.
    pub(super) fn new(heights: Grid<f32>, frame: SurfaceFrame, weathering: Weathering, seed: u64) -> Self {
        let stage = if weathering == Weathering::NONE {
            Stage::Done
        } else if weathering.bend > 0.0 {
            let scale = weathering.bend_size * frame.texels_per_unit();
            let mut rng = Rng::new(seed).stream("bends");
            let mut noise = || RowNoise::new(heights.width(), [scale; 2], 5, 0.55, &mut rng);
            Stage::Bend { from: heights.clone(), noises: Box::new([noise(), noise()]), row: 0 }
        } else {
            Stage::Measure
        };
        Self { heights, frame, weathering, seed, stage }
    }

    /// How much is done, 0..=1.
    pub(super) fn progress(&self) -> f32 {
        let share = |row: usize| row as f32 / self.heights.height().max(1) as f32;
        match &self.stage {
            Stage::Bend { row, .. } => 0.1 * share(*row),
            Stage::Measure => 0.1,
            Stage::Wear { row, .. } => 0.15 + 0.85 * share(*row),
            Stage::Done => 1.0,
        }
    }

    /// Some rows; `false` when all is done.
    pub(super) fn step(&mut self) -> bool {
        let Self { heights, frame, weathering, seed, .. } = self;
        let (width, height) = (heights.width(), heights.height());
        let rows = (TEXELS / width.max(1)).max(1);
        self.stage = match std::mem::replace(&mut self.stage, Stage::Done) {
            Stage::Bend { from, mut noises, row } => {
                let end = (row + rows).min(height);
                let far = weathering.bend * frame.texels_per_unit();
                let mut aside = [vec![0.0; width], vec![0.0; width]];
                for y in row..end {
                    for (noise, aside) in noises.iter_mut().zip(&mut aside) {
                        noise.fill_row(y, aside);
                    }
                    for (x, out) in heights.row_mut(y).iter_mut().enumerate() {
                        *out = sample(&from, Vec2::new(x as f32 + far * aside[0][x], y as f32 + far * aside[1][x]));
                    }
                }
                if end < height { Stage::Bend { from, noises, row: end } } else { Stage::Measure }
            }
            Stage::Measure => {
                let radius = 0.25 * weathering.gully_width * frame.texels_per_unit();
                let mut rng = Rng::new(*seed).stream("grain");
                let noise = RowNoise::new(width, [0.012 * frame.texels_per_unit(); 2], 4, 0.75, &mut rng);
                Stage::Wear { broad: blurred(heights, radius.round() as usize), noise: Box::new(noise), row: 0 }
            }
            Stage::Wear { broad, mut noise, row } => {
                let end = (row + rows).min(height);
                let mut slopes = Slopes::new(&broad, frame);
                let Weathering { gullies, gully_width, chips, chip_size, .. } = *weathering;
                let (gullies, scoops) =
                    (Gullies::new(gullies, gully_width, *seed), Scoops::new(chips, chip_size, *seed));
                let mut grain = vec![0.0; width];
                for y in row..end {
                    slopes.read(y);
                    noise.fill_row(y, &mut grain);
                    for (x, out) in heights.row_mut(y).iter_mut().enumerate() {
                        let pos = frame.to_pos(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                        let slope = Vec2::new(slopes.right[x], slopes.down[x]);
                        *out +=
                            gullies.depth(pos, slope, *out) + scoops.depth(pos, grain[x]) + weathering.grain * grain[x];
                    }
                }
                if end < height { Stage::Wear { broad, noise, row: end } } else { Stage::Done }
            }
            Stage::Done => Stage::Done,
        };
        !matches!(self.stage, Stage::Done)
    }
}

/// The height at a texel position, linear between texels; heights continue beyond the border as they are at it.
fn sample(heights: &Grid<f32>, at: Vec2) -> f32 {
    let last = Vec2::new((heights.width() - 1) as f32, (heights.height() - 1) as f32);
    let at = at.clamp(Vec2::ZERO, last);
    let corner = at.floor();
    let (share, [x, y]) = (at - corner, corner.as_usizevec2().to_array());
    let right = (x + 1).min(heights.width() - 1);
    let [above, below] = [y, (y + 1).min(heights.height() - 1)].map(|y| {
        let row = heights.row(y);
        row[x] + (row[right] - row[x]) * share.x
    });
    above + (below - above) * share.y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_range_are_named() {
        let frame = SurfaceFrame::new([8, 8].into()).unwrap();
        let heights = Grid::new([8, 8].into(), 0.5);
        let with = |weathering| weathered(&heights, &frame, &weathering, 1).unwrap_err().to_string();
        assert!(with(Weathering { bend: f32::NAN, ..Weathering::NONE }).contains("`bend`"));
        assert!(with(Weathering { gully_width: 0.0, ..Weathering::LAND }).contains("`gully_width`"));
        assert!(with(Weathering { chips: 2.0, ..Weathering::ROCK }).contains("`chips`"));
        let broken = Grid::new([8, 8].into(), f32::INFINITY);
        assert!(weathered(&broken, &frame, &Weathering::ROCK, 1).is_err());
    }
}
