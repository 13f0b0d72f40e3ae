//! What weather makes of a height field: [`Weathering`], [`weathered`].

use super::{
    error::ReliefError,
    rows::{FEW, Rows},
    stones::StonesJob,
    terrain_blur::Blur,
    terrain_check::{check_heights, smoothstep},
    terrain_coast::Coast,
    terrain_faces::Faces,
    terrain_noise::RowNoise,
    terrain_normals::Slopes,
    terrain_valleys::{Coarse, Fine, Valleys},
    terrain_wear::{Gullies, flakes, rubble, shore},
};
use crate::{
    Grid,
    math::{Rng, vectorized},
    pattern::SurfaceFrame,
};
use glam::Vec2;
use std::ops::Range;

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
    /// How much rivers shape the land above height 0: 0 = not at all, 1 = valleys branch up to ridges, and some rock
    /// rises higher, so there are massifs with saddles. 0..=1; default 0.
    pub valleys: f32,
    /// How much the shore at height 0 differs from place to place: cliffs on headlands, level ground in bays, and in
    /// the sea shelves, reefs and deep water. 0..=1; default 0.
    pub coast: f32,
    /// Depth of the gullies that water wears into slopes above height 0, as a share of their width. They run downhill
    /// and branch. 0..=1; default 0.
    pub gullies: f32,
    /// Width of the widest gullies. 0.002..=1; default 0.05.
    pub gully_width: f32,
    /// How much stones, which are parts above height 0 with gaps around them, are cut to bodies with flat faces and sharp
    /// edges. 0..=1; default 0.
    pub faces: f32,
    /// Thickness of the layers that flake off, as a share of their size. 0..=1; default 0.
    pub chips: f32,
    /// Size of the largest flakes. 0.002..=1; default 0.1.
    pub chip_size: f32,
    /// Size of the loose pieces that lie in gaps, below height 0. 0..=0.5; default 0.
    pub rubble: f32,
    /// Height of the finest roughness. 0..=0.1; default 0.
    pub grain: f32,
}

impl Weathering {
    /// The default: heights stay as they are.
    pub const NONE: Self = Self {
        bend: 0.0,
        bend_size: 0.15,
        valleys: 0.0,
        coast: 0.0,
        gullies: 0.0,
        gully_width: 0.05,
        faces: 0.0,
        chips: 0.0,
        chip_size: 0.1,
        rubble: 0.0,
        grain: 0.0,
    };

    /// Rock that breaks in flat faces, with loose pieces in its gaps.
    pub const ROCK: Self = Self {
        bend: 0.012,
        bend_size: 0.3,
        faces: 1.0,
        chips: 0.025,
        chip_size: 0.09,
        rubble: 0.02,
        grain: 0.0007,
        ..Self::NONE
    };

    /// Land with soil on it: valleys, gullies and ridges.
    pub const LAND: Self = Self {
        bend: 0.02,
        bend_size: 0.2,
        valleys: 1.0,
        coast: 1.0,
        gullies: 0.2,
        gully_width: 0.035,
        grain: 0.0008,
        ..Self::NONE
    };

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ReliefError::OutOfRange`] for the first number that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), ReliefError> {
        let ranges = [
            ("bend", self.bend, 0.0, 0.2),
            ("bend_size", self.bend_size, 0.005, 4.0),
            ("valleys", self.valleys, 0.0, 1.0),
            ("coast", self.coast, 0.0, 1.0),
            ("gullies", self.gullies, 0.0, 1.0),
            ("gully_width", self.gully_width, 0.002, 1.0),
            ("faces", self.faces, 0.0, 1.0),
            ("chips", self.chips, 0.0, 1.0),
            ("chip_size", self.chip_size, 0.002, 1.0),
            ("rubble", self.rubble, 0.0, 0.5),
            ("grain", self.grain, 0.0, 0.1),
        ];
        match ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value)) {
            Some((name, value, min, max)) => Err(ReliefError::OutOfRange { name, value, min, max }),
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
/// [`ReliefError`] if a number of `weathering` is out of range, or a height is not finite.
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
) -> Result<Grid<f32>, ReliefError> {
    weathering.validate()?;
    check_heights(heights, 1)?;
    let mut job = WeatherJob::new(heights.clone(), *frame, *weathering, seed);
    while job.step() {}
    Ok(job.heights)
}

/// The weathering of a height field in steps of bounded work.
#[derive(Clone, Debug)]
pub(super) struct WeatherJob {
    pub(super) heights: Grid<f32>,
    frame: SurfaceFrame,
    weathering: Weathering,
    seed: u64,
    stage: Stage,
    rows: Rows,
}

#[derive(Clone, Debug)]
enum Stage {
    /// Lines are bent, from these heights.
    Bend {
        from: Grid<f32>,
        noises: Box<[RowNoise; 2]>,
    },
    /// The coarse lattice for rivers and the coast.
    Coarse(Box<Coarse>),
    /// Rivers are at work on the coarse lattice.
    Valleys(Box<Valleys>, Grid<f32>),
    /// The coast is looked at on the coarse lattice; what valleys change.
    Coast(Box<Coast>, Option<Grid<f32>>),
    /// Valleys and the coast are brought to the heights.
    Carve {
        valleys: Option<Box<Fine>>,
        /// Headlands and the seabed.
        coast: Box<[Fine; 2]>,
    },
    /// Stones are looked for.
    Stones(Box<StonesJob>),
    /// Stones are cut.
    Cut(Box<Faces>),
    /// The broad slopes are measured.
    Measure(Box<Blur>),
    /// Everything else.
    Wear {
        slopes: Box<Slopes>,
        broad: Grid<f32>,
        noises: Box<[RowNoise; 2]>,
    },
    Done,
}

impl WeatherJob {
    /// Numbers and heights have been checked.
    pub(super) fn new(heights: Grid<f32>, frame: SurfaceFrame, weathering: Weathering, seed: u64) -> Self {
        let rows = Rows::new(heights.size());
        let mut job = Self { heights, frame, weathering, seed, stage: Stage::Done, rows };
        if weathering != Weathering::NONE {
            job.stage = if weathering.bend > 0.0 { job.bend() } else { job.coarse() };
        }
        job
    }

    fn bend(&mut self) -> Stage {
        let scale = self.weathering.bend_size * self.frame.texels_per_unit();
        let mut rng = Rng::new(self.seed).stream("bends");
        let mut noise = || RowNoise::new(self.heights.width(), [scale; 2], 5, 0.55, &mut rng);
        let noises = Box::new([noise(), noise()]);
        let bent = Grid::new(self.heights.size(), 0.0);
        Stage::Bend { from: std::mem::replace(&mut self.heights, bent), noises }
    }

    fn coarse(&self) -> Stage {
        if self.weathering.valleys <= 0.0 && self.weathering.coast <= 0.0 {
            return self.stones();
        }
        Stage::Coarse(Box::new(Coarse::new(self.heights.size())))
    }

    fn valleys(&self, ground: Grid<f32>) -> Stage {
        if self.weathering.valleys <= 0.0 {
            return self.coast(&ground, None);
        }
        Stage::Valleys(Box::new(Valleys::new(ground.clone(), self.heights.size(), &self.frame, self.seed)), ground)
    }

    fn coast(&self, ground: &Grid<f32>, valleys: Option<Grid<f32>>) -> Stage {
        Stage::Coast(Box::new(Coast::new(ground, self.heights.size(), &self.frame, self.seed)), valleys)
    }

    fn carve(&self, coast: Coast, valleys: Option<Grid<f32>>) -> Stage {
        let fine = |grid| Fine::new(grid, self.heights.size());
        Stage::Carve { valleys: valleys.map(|grid| Box::new(fine(grid))), coast: Box::new(coast.finish().map(fine)) }
    }

    fn stones(&self) -> Stage {
        if self.weathering.faces <= 0.0 {
            return self.measure();
        }
        Stage::Stones(Box::new(StonesJob::new(self.heights.size(), 0.0, self.seed)))
    }

    fn measure(&self) -> Stage {
        let radius = 0.25 * self.weathering.gully_width * self.frame.texels_per_unit();
        Stage::Measure(Box::new(Blur::new(self.heights.size(), radius.round() as usize)))
    }

    /// How much is done, 0..=1.
    pub(super) fn progress(&self) -> f32 {
        let rows = self.rows.share();
        match &self.stage {
            Stage::Bend { .. } => 0.1 * rows,
            Stage::Coarse(_) => 0.1,
            Stage::Valleys(valleys, _) => 0.1 + 0.4 * valleys.progress(),
            Stage::Coast(..) => 0.5,
            Stage::Carve { .. } => 0.5 + 0.03 * rows,
            Stage::Stones(_) => 0.53,
            Stage::Cut(_) => 0.54 + 0.01 * rows,
            Stage::Measure(_) => 0.55,
            Stage::Wear { .. } => 0.6 + 0.4 * rows,
            Stage::Done => 1.0,
        }
    }

    /// Some rows; `false` when all is done.
    pub(super) fn step(&mut self) -> bool {
        let mut stage = std::mem::replace(&mut self.stage, Stage::Done);
        let is_open = match &mut stage {
            Stage::Coarse(coarse) => coarse.step(&self.heights),
            Stage::Valleys(valleys, _) => valleys.step(),
            Stage::Coast(coast, _) => coast.step(),
            Stage::Stones(stones) => stones.step(&self.heights, &self.frame),
            Stage::Measure(blur) => blur.step(&self.heights),
            Stage::Done => false,
            Stage::Bend { .. } | Stage::Carve { .. } | Stage::Cut(_) | Stage::Wear { .. } => {
                self.change_rows(&mut stage);
                !self.rows.is_done()
            }
        };
        self.stage = if is_open { stage } else { self.next(stage) };
        !matches!(self.stage, Stage::Done)
    }

    /// Some rows of a stage that changes heights.
    fn change_rows(&mut self, stage: &mut Stage) {
        let rows = self.rows.take(FEW);
        match stage {
            Stage::Bend { from, noises } => self.bend_rows(from, noises, rows),
            Stage::Carve { valleys, coast } => self.carve_rows(valleys.as_deref_mut(), coast, rows),
            Stage::Cut(faces) => rows.for_each(|y| faces.cut_row(y, self.heights.row_mut(y))),
            Stage::Wear { slopes, broad, noises } => self.wear_rows(slopes, broad, noises, rows),
            _ => {}
        }
    }

    /// What comes after a stage.
    fn next(&mut self, stage: Stage) -> Stage {
        self.rows = Rows::new(self.heights.size());
        match stage {
            Stage::Bend { .. } => self.coarse(),
            Stage::Coarse(coarse) => self.valleys(coarse.finish()),
            Stage::Valleys(valleys, ground) => self.coast(&ground, Some(valleys.finish(self.weathering.valleys))),
            Stage::Coast(coast, valleys) => self.carve(*coast, valleys),
            Stage::Carve { .. } => self.stones(),
            Stage::Stones(stones) => {
                let faces = Faces::new(stones.finish(), &self.frame, self.weathering.faces, self.seed);
                Stage::Cut(Box::new(faces))
            }
            Stage::Cut(_) => self.measure(),
            Stage::Measure(blur) => self.wear(blur.finish()),
            Stage::Wear { .. } | Stage::Done => Stage::Done,
        }
    }

    /// What comes after the broad slopes are measured.
    fn wear(&self, broad: Grid<f32>) -> Stage {
        let (unit, width, weathering) = (self.frame.texels_per_unit(), self.heights.width(), &self.weathering);
        let rng = Rng::new(self.seed);
        let grain = RowNoise::new(width, [0.012 * unit; 2], 4, 0.75, &mut rng.stream("grain"));
        let octaves = if weathering.chips > 0.0 { 6 } else { 0 };
        let flakes = RowNoise::new(width, [weathering.chip_size * unit; 2], octaves, 0.55, &mut rng.stream("flakes"));
        Stage::Wear { slopes: Box::new(Slopes::new(width, &self.frame)), broad, noises: Box::new([grain, flakes]) }
    }

    fn bend_rows(&mut self, from: &Grid<f32>, noises: &mut [RowNoise; 2], rows: Range<usize>) {
        let far = self.weathering.bend * self.frame.texels_per_unit();
        let width = self.heights.width();
        let mut aside = [vec![0.0; width], vec![0.0; width]];
        for y in rows {
            for (noise, aside) in noises.iter_mut().zip(&mut aside) {
                noise.fill_row(y, aside);
            }
            for (x, out) in self.heights.row_mut(y).iter_mut().enumerate() {
                *out = sample(from, Vec2::new(x as f32 + far * aside[0][x], y as f32 + far * aside[1][x]));
            }
        }
    }

    fn carve_rows(&mut self, mut valleys: Option<&mut Fine>, coast: &mut [Fine; 2], rows: Range<usize>) {
        for y in rows {
            coast.iter_mut().for_each(|fine| fine.read(y));
            if let Some(valleys) = &mut valleys {
                valleys.read(y);
            }
            for (x, out) in self.heights.row_mut(y).iter_mut().enumerate() {
                let carved = valleys.as_ref().map_or(0.0, |valleys| valleys.row[x]);
                *out = shore(*out, carved, coast.each_ref().map(|fine| fine.row[x]), self.weathering.coast);
            }
        }
    }

    fn wear_rows(&mut self, slopes: &mut Slopes, broad: &Grid<f32>, noises: &mut [RowNoise; 2], rows: Range<usize>) {
        let Weathering { gullies, gully_width, chips, chip_size, coast, grain, .. } = self.weathering;
        let gullies = Gullies::new(gullies, gully_width, self.seed);
        let mut rows_of_noise = [vec![0.0; self.heights.width()], vec![0.0; self.heights.width()]];
        for y in rows {
            slopes.read(broad, y);
            for (noise, row) in noises.iter_mut().zip(&mut rows_of_noise) {
                noise.fill_row(y, row);
            }
            let [rough, layers] = &rows_of_noise;
            vectorized(
                #[inline(always)]
                || {
                    for (x, out) in self.heights.row_mut(y).iter_mut().enumerate() {
                        let pos = self.frame.to_pos(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                        let slope = Vec2::new(slopes.right[x], slopes.down[x]);
                        // Beaches are smooth.
                        let dry = 1.0 - coast * (1.0 - smoothstep(0.0, 0.012, out.abs()));
                        *out += gullies.depth(pos, slope, *out) + grain * dry * rough[x];
                        if *out > 0.0 {
                            // Flakes end before a stone does.
                            *out = (*out - chips * chip_size * flakes(layers[x])).max(0.5 * *out);
                        }
                        *out = rubble(self.seed, self.weathering.rubble, pos, *out);
                    }
                },
            );
        }
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
        assert!(with(Weathering { valleys: f32::NAN, ..Weathering::LAND }).contains("`valleys`"));
        assert!(with(Weathering { coast: -0.1, ..Weathering::LAND }).contains("`coast`"));
        assert!(with(Weathering { faces: f32::NAN, ..Weathering::ROCK }).contains("`faces`"));
        assert!(with(Weathering { rubble: 0.6, ..Weathering::ROCK }).contains("`rubble`"));
        let broken = Grid::new([8, 8].into(), f32::INFINITY);
        assert!(weathered(&broken, &frame, &Weathering::ROCK, 1).is_err());
    }
}
