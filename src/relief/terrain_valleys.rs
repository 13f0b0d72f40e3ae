//! Valleys that rivers wear: [`Valleys`], on a coarse lattice, and [`Fine`], which brings them to texels.

use super::{
    drainage::{Drainage, DrainageJob},
    rows::{MANY, Rows},
    terrain_blur::Blur,
    terrain_noise::RowNoise,
};
use crate::{Grid, math::Rng, pattern::SurfaceFrame};
use glam::UVec2;

/// Cells of the lattice along the shorter side of a surface, about.
const CELLS: u32 = 176;

/// Most cells of the lattice along the longer side.
const MOST: u32 = 704;

/// Rounds of wear.
const ROUNDS: u32 = 20;

/// How much ground rises in a round, as a share of its height at first.
const RISE: f32 = 0.1;

/// Heights at first, as shares of those of the contours.
const START: [f32; 2] = [0.25, 0.45];

/// How fast rivers cut: height per round, for the water of one square unit and a slope of 1.
const CUT: f32 = 0.42;

/// The steepest slope that does not slide.
const STEEPEST: f32 = 1.05;

/// Height of the highest peak, as a share of what it was.
const LOWER: f32 = 0.9;

/// How far a place comes nearer to the mean of those around it in a round, where rivers cut at a speed of 1.
const CREEP: f32 = 0.62;

/// Radius over which crests are rounded, cells, and how much, where rivers cut at a speed of 1.
const CREST: usize = 2;
const SOFT: f32 = 2.0;

/// Texels along a side of a cell of the lattice.
pub(super) fn block(size: UVec2) -> u32 {
    ((2 * size.min_element() + CELLS) / (2 * CELLS)).max(size.max_element().div_ceil(MOST)).max(1)
}

/// The coarse lattice of a height field, means of blocks of texels, in steps.
#[derive(Clone, Debug)]
pub(super) struct Coarse {
    block: usize,
    rows: Rows,
    height: usize,
    out: Grid<f32>,
}

impl Coarse {
    pub(super) fn new(size: UVec2) -> Self {
        let block = block(size);
        let cells = UVec2::new(size.x.div_ceil(block), size.y.div_ceil(block));
        Self { block: block as usize, rows: Rows::new(size), height: size.y as usize, out: Grid::new(cells, 0.0) }
    }

    /// Some rows of `heights`, which are the same in all steps; `false` when all is done.
    pub(super) fn step(&mut self, heights: &Grid<f32>) -> bool {
        for y in self.rows.take(MANY) {
            let row = y / self.block;
            let n_rows = self.block.min(self.height - row * self.block);
            for (sum, texels) in self.out.row_mut(row).iter_mut().zip(heights.row(y).chunks(self.block)) {
                *sum += texels.iter().sum::<f32>() / (texels.len() * n_rows) as f32;
            }
        }
        !self.rows.is_done()
    }

    pub(super) fn finish(self) -> Grid<f32> {
        self.out
    }
}

/// Ground that rises as its contours tell, while rivers cut into it and slopes slide, round by round.
///
/// Rivers cut by the law of stream power, solved from the mouth upward (Braun and Willett 2013, "A very efficient O(n),
/// implicit and parallel method to solve the stream power equation").
#[derive(Clone, Debug)]
pub(super) struct Valleys {
    first: Grid<f32>,
    /// How much each cell rises in a round, and how fast rivers cut there.
    rise: Grid<f32>,
    cut: Grid<f32>,
    now: Grid<f32>,
    /// Length of a cell, pattern units.
    cell: f32,
    round: u32,
    /// Where water runs in this round, while that is found.
    flood: Option<Box<DrainageJob>>,
    /// The broad shape of the ground, after all rounds.
    broad: Blur,
}

impl Valleys {
    /// Over the coarse lattice of heights of `size`.
    pub(super) fn new(first: Grid<f32>, size: UVec2, frame: &SurfaceFrame, seed: u64) -> Self {
        let cell = block(size) as f32 / frame.texels_per_unit();
        // Unevenness breaks the eight directions of the lattice.
        let mut rng = Rng::new(seed).stream("valleys");
        let [massifs, hard, start] = [(0.3, 2, 0.5), (0.13, 3, 0.6), (0.22, 4, 0.6)]
            .map(|(scale, octaves, persistence)| noise(first.size(), scale / cell, octaves, persistence, &mut rng));
        let (mut rise, mut cut, mut now) = (massifs, hard, start);
        for (i, &height) in first.as_slice().iter().enumerate() {
            let height = height.max(0.0);
            let [rise, cut, now] = [&mut rise, &mut cut, &mut now].map(|grid| &mut grid.as_mut_slice()[i]);
            // Some rock rises more, and some is harder: massifs with saddles between them, spurs of all lengths.
            *rise = RISE * height * (0.85 + 1.1 * *rise).clamp(0.25, 2.0);
            *cut = CUT * (0.9 + 0.7 * *cut).clamp(0.35, 1.8);
            let uneven = START[0] + (START[1] - START[0]) * rng.unit();
            *now =
                if height > 0.0 { height * uneven * (1.0 + 1.1 * *now).clamp(0.2, 2.0) } else { first.as_slice()[i] };
        }
        let broad = Blur::new(first.size(), CREST);
        Self { first, rise, cut, now, cell, round: 0, flood: None, broad }
    }

    pub(super) fn progress(&self) -> f32 {
        self.round as f32 / ROUNDS as f32
    }

    /// A part of a round; `false` when all are done.
    pub(super) fn step(&mut self) -> bool {
        match self.flood.take() {
            None if self.round == ROUNDS => return self.broad.step(&self.now),
            None => self.flood = Some(Box::new(DrainageJob::new(&self.now))),
            Some(mut flood) => {
                if flood.step() {
                    self.flood = Some(flood);
                } else {
                    self.wear(&flood.finish());
                    self.creep();
                    self.round += 1;
                }
            }
        }
        true
    }

    /// Ground rises, rivers cut into it and slopes slide.
    fn wear(&mut self, drainage: &Drainage) {
        let water = drainage.gathered();
        let heights = self.now.as_mut_slice();
        for &at in &drainage.order {
            let (i, into) = (at as usize, drainage.into[at as usize]);
            if into == at {
                continue;
            }
            let distance = drainage.distance(at, into) * self.cell;
            let cut = self.cut.as_slice()[i] * (water[i] * self.cell * self.cell).sqrt() / distance;
            let below = heights[into as usize];
            let risen = heights[i] + self.rise.as_slice()[i];
            heights[i] = ((risen + cut * below) / (1.0 + cut)).min(below + STEEPEST * distance).max(below.min(risen));
        }
    }

    /// Soil creeps down: ridges become a little rounder.
    fn creep(&mut self) {
        let from = self.now.clone();
        let last = self.now.height() - 1;
        for y in 1..last.max(1) {
            let [above, here, below] = [y - 1, y, (y + 1).min(last)].map(|y| from.row(y));
            for x in 1..here.len().saturating_sub(1) {
                if here[x] > 0.0 {
                    let mean = 0.25 * (above[x] + below[x] + here[x - 1] + here[x + 1]);
                    self.now.row_mut(y)[x] =
                        (here[x] + CREEP * self.cut.row(y)[x] * (mean - here[x])).max(0.1 * here[x]);
                }
            }
        }
    }

    /// What the valleys change, `amount` 0..=1 of it.
    pub(super) fn finish(self, amount: f32) -> Grid<f32> {
        let highest = |grid: &Grid<f32>| grid.as_slice().iter().fold(1e-6f32, |most, height| most.max(*height));
        let scale = LOWER * highest(&self.first) / highest(&self.now);
        let broad = self.broad.finish();
        let mut out = self.now;
        for ((out, &broad), &cut) in out.as_mut_slice().iter_mut().zip(broad.as_slice()).zip(self.cut.as_slice()) {
            // Crests are broad where rock is soft.
            *out += (broad - *out).min(0.0) * (SOFT * cut).min(1.0);
        }
        for (out, &first) in out.as_mut_slice().iter_mut().zip(self.first.as_slice()) {
            *out = if first > 0.0 { amount * (*out * scale - first) } else { 0.0 };
        }
        out
    }
}

/// Noise whose largest features measure `scale` cells.
pub(super) fn noise(size: UVec2, scale: f32, octaves: u32, persistence: f32, rng: &mut Rng) -> Grid<f32> {
    let mut noise = RowNoise::new(size.x as usize, [scale; 2], octaves, persistence, rng);
    let mut out = Grid::new(size, 0.0);
    for y in 0..out.height() {
        noise.fill_row(y, out.row_mut(y));
    }
    out
}

/// A coarse lattice read at texels, row by row: smooth, by cubic B-splines.
#[derive(Clone, Debug)]
pub(super) struct Fine {
    coarse: Grid<f32>,
    /// Cells per texel.
    scale: f32,
    column: Vec<f32>,
    /// The row that was read last.
    pub(super) row: Vec<f32>,
}

/// Weights of four values around a place between the middle two.
fn weights(t: f32) -> [f32; 4] {
    let (u, square) = (1.0 - t, t * t);
    let cube = square * t;
    [u * u * u, 3.0 * cube - 6.0 * square + 4.0, 3.0 * (t + square - cube) + 1.0, cube].map(|weight| weight / 6.0)
}

/// The four indices around a place, of `len`, and their weights.
fn four(place: f32, len: usize) -> ([usize; 4], [f32; 4]) {
    let corner = (place - 0.5).floor();
    let at = |by: i32| (corner as i32 + by).clamp(0, len as i32 - 1) as usize;
    ([at(-1), at(0), at(1), at(2)], weights(place - 0.5 - corner))
}

impl Fine {
    pub(super) fn new(coarse: Grid<f32>, size: UVec2) -> Self {
        let scale = 1.0 / block(size) as f32;
        Self { scale, column: vec![0.0; coarse.width()], row: vec![0.0; size.x as usize], coarse }
    }

    /// Reads row `y` of texels.
    pub(super) fn read(&mut self, y: usize) {
        let (rows, shares) = four((y as f32 + 0.5) * self.scale, self.coarse.height());
        let rows = rows.map(|row| self.coarse.row(row));
        for (x, out) in self.column.iter_mut().enumerate() {
            *out = (0..4).map(|i| rows[i][x] * shares[i]).sum();
        }
        for (x, out) in self.row.iter_mut().enumerate() {
            let (columns, shares) = four((x as f32 + 0.5) * self.scale, self.column.len());
            *out = (0..4).map(|i| self.column[columns[i]] * shares[i]).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relief::{Weathering, weathered};

    fn cone(size: [u32; 2]) -> (Grid<f32>, SurfaceFrame) {
        let frame = SurfaceFrame::new(size.into()).unwrap();
        let height = |i: u32| {
            let pos = frame.to_pos(UVec2::new(i % size[0], i / size[0]).as_vec2() + 0.5);
            0.3 - 0.7 * pos.distance(0.5 * frame.extent())
        };
        (Grid::from_vec(size.into(), (0..size[0] * size[1]).map(height).collect()).unwrap(), frame)
    }

    /// The even slope of a cone gets valleys: ground at the same distance from its top differs more than before.
    #[test]
    fn rivers_wear_valleys() {
        let (heights, frame) = cone([220, 220]);
        let valleys = Weathering { valleys: 1.0, ..Weathering::NONE };
        let worn = weathered(&heights, &frame, &valleys, 5).unwrap();
        let around = |grid: &Grid<f32>| {
            let ring =
                grid.as_slice().iter().zip(heights.as_slice()).filter(|(_, height)| (0.14..0.15).contains(*height));
            let ring: Vec<_> = ring.map(|(value, _)| *value).collect();
            ring.iter().copied().fold(f32::MIN, f32::max) - ring.iter().copied().fold(f32::MAX, f32::min)
        };
        assert!(around(&heights) < 0.011 && around(&worn) > 0.05, "{}", around(&worn));
        // The sea and the shore stay.
        let both = || worn.as_slice().iter().zip(heights.as_slice());
        assert!(both().all(|(worn, height)| (*height > 0.0) == (*worn > 0.0) && (*height > 0.0 || worn == height)));
        assert_eq!(worn, weathered(&heights, &frame, &valleys, 5).unwrap());
        assert_ne!(worn, weathered(&heights, &frame, &valleys, 6).unwrap());
    }

    /// Surfaces of all shapes and heights can be worn.
    #[test]
    fn nothing_is_too_small_or_too_high() {
        for size in [[1, 1], [1, 9], [64, 1], [2, 2], [300, 5]] {
            let (mut heights, frame) = cone(size);
            for scale in [1.0, -1.0, 1e4] {
                heights.as_mut_slice().iter_mut().for_each(|height| *height *= scale);
                for weathering in [Weathering::LAND, Weathering::ROCK] {
                    let worn = weathered(&heights, &frame, &weathering, 1).unwrap();
                    assert!(worn.as_slice().iter().all(|height| height.is_finite()), "{size:?} {scale}");
                }
            }
        }
    }

    /// Coarse values that are the same everywhere stay so between cells.
    #[test]
    fn fine_rows_keep_constants() {
        let size = UVec2::new(400, 360);
        let cells = size.map(|side| side.div_ceil(block(size)));
        let mut fine = Fine::new(Grid::new(cells, 0.75), size);
        for y in [0, 1, 200, 359] {
            fine.read(y);
            assert!(fine.row.iter().all(|value| (value - 0.75).abs() < 1e-5));
        }
    }
}
