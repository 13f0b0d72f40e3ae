//! The colors of height fields: [`colors`], and in steps [`ColorJob`].

use super::{
    error::ReliefError,
    rows::{FEW, MANY, Rows},
    stones::{Stones, StonesJob},
    terrain::TerrainColors,
    terrain_blur::Blur,
    terrain_check::{check_heights, check_row},
    terrain_paint::{Measured, Painter, RADII, STONE},
    terrain_water::{Measure, Water, WaterJob},
};
use crate::{Grid, pattern::SurfaceFrame};

/// The colors of a height field: `[red, green, blue, 255]`, sRGB.
///
/// Heights are in pattern units, of texels as `frame` tells. `seed` is that of the variety.
///
/// # Errors
/// [`ReliefError`] if a number of `colors` is out of range, or a height is not finite.
///
/// ```
/// use bevy_crack::{Grid, pattern::SurfaceFrame, relief::{TerrainColors, colors}};
///
/// // Sea on the left, land on the right.
/// let frame = SurfaceFrame::new([64, 64].into())?;
/// let shore = (0..64 * 64).map(|i| (i % 64) as f32 / 320.0 - 0.1).collect();
/// let heights = Grid::from_vec([64, 64].into(), shore).unwrap();
/// let picture = colors(&heights, &frame, &TerrainColors::ISLAND, 1)?;
/// let [red, _, blue, _] = picture.get(2, 30).unwrap();
/// assert!(blue > red);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn colors(
    heights: &Grid<f32>,
    frame: &SurfaceFrame,
    colors: &TerrainColors,
    seed: u64,
) -> Result<Grid<[u8; 4]>, ReliefError> {
    colors.validate()?;
    check_heights(heights, 1)?;
    let mut job = ColorJob::new(heights, *frame, *colors, seed);
    while job.step(heights)? {}
    Ok(job.out)
}

/// The painting of a height field in steps of bounded work.
#[derive(Clone, Debug)]
pub(super) struct ColorJob {
    pub(super) out: Grid<[u8; 4]>,
    colors: TerrainColors,
    frame: SurfaceFrame,
    seed: u64,
    stage: Stage,
    rows: Rows,
    range: [f32; 2],
    blurs: Vec<Grid<f32>>,
    stones: Option<Stones>,
    water: Option<Water>,
}

#[derive(Clone, Debug)]
enum Stage {
    /// Heights are checked, the lowest and the highest are looked for.
    Range,
    /// Heights are blurred by the next radius.
    Blur(Box<Blur>),
    Stones(Box<StonesJob>),
    Water(Box<WaterJob>),
    Paint(Box<Painter>),
    Done,
}

impl ColorJob {
    /// Colors have been checked; `heights` are the same in all steps.
    pub(super) fn new(heights: &Grid<f32>, frame: SurfaceFrame, colors: TerrainColors, seed: u64) -> Self {
        Self {
            out: Grid::new(heights.size(), [0, 0, 0, 255]),
            colors,
            frame,
            seed,
            stage: Stage::Range,
            rows: Rows::new(heights.size()),
            range: [f32::MAX, f32::MIN],
            blurs: Vec::new(),
            stones: None,
            water: None,
        }
    }

    /// How much is done, 0..=1.
    pub(super) fn progress(&self) -> f32 {
        match &self.stage {
            Stage::Range => 0.0,
            Stage::Blur(_) => 0.01 + 0.08 * self.blurs.len() as f32,
            Stage::Stones(_) => 0.17,
            Stage::Water(_) => 0.2,
            Stage::Paint(_) => 0.23 + 0.77 * self.rows.share(),
            Stage::Done => 1.0,
        }
    }

    /// Some rows; `false` when all is done.
    ///
    /// Fails where a height is not finite.
    pub(super) fn step(&mut self, heights: &Grid<f32>) -> Result<bool, ReliefError> {
        let mut stage = std::mem::replace(&mut self.stage, Stage::Done);
        let is_open = match &mut stage {
            Stage::Range => {
                self.find_range(heights)?;
                !self.rows.is_done()
            }
            Stage::Blur(blur) => blur.step(heights),
            Stage::Stones(stones) => stones.step(heights, &self.frame),
            Stage::Water(water) => water.step(heights, &self.frame),
            Stage::Paint(painter) => {
                self.rows.take(FEW).for_each(|y| painter.paint_row(heights, y, self.out.row_mut(y)));
                !self.rows.is_done()
            }
            Stage::Done => false,
        };
        self.stage = if is_open { stage } else { self.next(stage) };
        Ok(!matches!(self.stage, Stage::Done))
    }

    fn find_range(&mut self, heights: &Grid<f32>) -> Result<(), ReliefError> {
        for y in self.rows.take(MANY) {
            let row = heights.row(y);
            check_row(row, y)?;
            self.range = row.iter().fold(self.range, |[low, high], &height| [low.min(height), high.max(height)]);
        }
        Ok(())
    }

    /// What comes after a stage.
    fn next(&mut self, stage: Stage) -> Stage {
        match stage {
            Stage::Range => self.blur(),
            Stage::Blur(blur) => {
                self.blurs.push(blur.finish());
                self.blur()
            }
            Stage::Stones(stones) => {
                self.stones = Some(stones.finish());
                self.find_water()
            }
            Stage::Water(water) => {
                self.water = water.finish();
                self.paint()
            }
            Stage::Paint(_) | Stage::Done => Stage::Done,
        }
    }

    fn blur(&mut self) -> Stage {
        let Some(radius) = RADII.get(self.blurs.len()) else { return self.find_stones() };
        let radius = (radius * self.frame.texels_per_unit()).round() as usize;
        Stage::Blur(Box::new(Blur::new(self.out.size(), radius)))
    }

    fn find_stones(&mut self) -> Stage {
        if self.colors.stones.is_none() {
            return self.find_water();
        }
        Stage::Stones(Box::new(StonesJob::new(self.out.size(), STONE[0], self.seed)))
    }

    fn find_water(&mut self) -> Stage {
        if self.colors.woods.is_none() && self.colors.rivers.is_none() {
            return self.paint();
        }
        let rivers = self.colors.rivers.map(|rivers| Measure { gather: rivers.gather, width: rivers.width });
        Stage::Water(Box::new(WaterJob::new(self.out.size(), rivers)))
    }

    fn paint(&mut self) -> Stage {
        let [low, high] = self.range;
        let low = if self.colors.sea.is_some() { 0.0 } else { low };
        let mut blurs = std::mem::take(&mut self.blurs).into_iter();
        let measured = Measured {
            range: [low, high.max(low + 1e-6)],
            blurs: std::array::from_fn(|_| blurs.next().unwrap_or_else(|| Grid::new(self.out.size(), 0.0))),
            stones: self.stones.take(),
            water: self.water.take(),
        };
        self.rows = Rows::new(self.out.size());
        Stage::Paint(Box::new(Painter::new(self.out.width(), &self.frame, &self.colors, measured, self.seed)))
    }
}
