//! Where ground is moist and where rivers run: [`WaterJob`] finds it, [`Water`] holds it.

use super::{
    drainage::{Drainage, DrainageJob},
    terrain_blur::Blur,
    terrain_valleys::{Coarse, Fine, block},
};
use crate::{Grid, math::hash_unit, pattern::SurfaceFrame};
use glam::{UVec2, Vec2};

/// Radius over which moisture spreads, cells.
const SPREAD: usize = 1;

/// Rounds in which the corners of rivers are cut.
const ROUNDS: usize = 3;

/// What a source gathers, as a share of what makes a river at its mouth.
const SOURCE: f32 = 0.12;

/// Points over which a river appears at its source.
const APPEARS: f32 = 6.0;

/// How much wider the last points of a river are where it meets the sea.
const MOUTH: [f32; 3] = [1.9, 1.6, 1.25];

/// How far the points of rivers are moved aside, cells.
const WINDING: f32 = 0.8;

/// The water on the ground, from the drainage of its heights.
#[derive(Clone, Debug)]
pub(super) struct Water {
    /// 0 on ridges, near 1 along large streams.
    pub(super) moisture: Fine,
    /// Share of each texel that is river; empty without rivers.
    pub(super) rivers: Option<Grid<f32>>,
}

/// Which rivers are drawn: the ground that makes one, square pattern units, and the width of the widest, pattern units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measure {
    pub(super) gather: f32,
    pub(super) width: f32,
}

/// The search for water in steps.
#[derive(Clone, Debug)]
pub(super) struct WaterJob {
    size: UVec2,
    rivers: Option<Measure>,
    stage: Stage,
}

#[derive(Clone, Debug)]
enum Stage {
    /// The coarse lattice of the heights.
    Coarse(Box<Coarse>),
    /// Where the water of that lattice runs.
    Drain(Box<DrainageJob>, Grid<f32>),
    /// How moist ground is.
    Moist {
        drainage: Box<Drainage>,
        ground: Grid<f32>,
        moist: Grid<f32>,
        blur: Box<Blur>,
    },
    Done(Box<Water>),
}

impl WaterJob {
    /// On heights of `size`, with rivers of a measure or without.
    pub(super) fn new(size: UVec2, rivers: Option<Measure>) -> Self {
        Self { size, rivers, stage: Stage::Coarse(Box::new(Coarse::new(size))) }
    }

    /// A part of the search on `heights`, which are the same in all steps; `false` when all is done.
    pub(super) fn step(&mut self, heights: &Grid<f32>, frame: &SurfaceFrame) -> bool {
        let is_open = match &mut self.stage {
            Stage::Coarse(coarse) => coarse.step(heights),
            Stage::Drain(drainage, _) => drainage.step(),
            Stage::Moist { moist, blur, .. } => blur.step(moist),
            Stage::Done(_) => true,
        };
        if !is_open {
            let none = Stage::Coarse(Box::new(Coarse::new(UVec2::ONE)));
            self.stage = match std::mem::replace(&mut self.stage, none) {
                Stage::Coarse(coarse) => {
                    let ground = coarse.finish();
                    Stage::Drain(Box::new(DrainageJob::new(&ground)), ground)
                }
                Stage::Drain(drainage, ground) => {
                    let drainage = Box::new(drainage.finish());
                    let moist = drainage.gathered().into_iter().map(|cells| 1.0 - 1.0 / cells.sqrt().sqrt()).collect();
                    let moist = Grid::from_vec(ground.size(), moist).unwrap_or_else(|| Grid::new(ground.size(), 0.0));
                    let blur = Box::new(Blur::new(ground.size(), SPREAD));
                    Stage::Moist { drainage, ground, moist, blur }
                }
                Stage::Moist { drainage, ground, blur, .. } => {
                    let moisture = Fine::new(blur.finish(), self.size);
                    let rivers = self.rivers.map(|measure| {
                        let mut out = Grid::new(self.size, 0.0);
                        let gathered = drainage.gathered();
                        let course =
                            Course { ground: &ground, drainage: &drainage, gathered: &gathered, frame, measure };
                        course.draw(&mut out);
                        out
                    });
                    Stage::Done(Box::new(Water { moisture, rivers }))
                }
                done @ Stage::Done(_) => done,
            };
        }
        !matches!(self.stage, Stage::Done(_))
    }

    /// The water, when all is done.
    pub(super) fn finish(self) -> Option<Water> {
        if let Stage::Done(water) = self.stage { Some(*water) } else { None }
    }
}

/// The courses of rivers on the lattice.
struct Course<'a> {
    ground: &'a Grid<f32>,
    drainage: &'a Drainage,
    gathered: &'a [f32],
    frame: &'a SurfaceFrame,
    measure: Measure,
}

impl Course<'_> {
    /// Texels along a side of a cell.
    fn cell(&self) -> f32 {
        block(self.frame.size()) as f32
    }

    /// What the mouth of each cell's river gathers, cells.
    fn mouths(&self) -> Vec<f32> {
        let mut mouths = vec![0.0; self.gathered.len()];
        for &at in &self.drainage.order {
            let (i, into) = (at as usize, self.drainage.into[at as usize]);
            let is_mouth = into == at || self.drainage.into[into as usize] == into;
            mouths[i] = if is_mouth { self.gathered[i] } else { mouths[into as usize] };
        }
        mouths
    }

    /// Draws every river from its sources down to a larger one, or to the sea.
    fn draw(&self, out: &mut Grid<f32>) {
        let cell = self.cell() / self.frame.texels_per_unit();
        let least = (self.measure.gather / (cell * cell)).max(2.0);
        let mouths = self.mouths();
        let is_river = |i: usize| {
            let is_land = self.drainage.into[i] as usize != i && self.ground.as_slice()[i] > 0.0;
            is_land && mouths[i] >= least && self.gathered[i] >= SOURCE * least
        };
        let mut has_source = vec![false; self.gathered.len()];
        let mut is_done = vec![false; self.gathered.len()];
        for (i, &into) in self.drainage.into.iter().enumerate() {
            has_source[into as usize] |= is_river(i);
        }
        for &source in self.drainage.order.iter().rev() {
            let mut at = source as usize;
            if !is_river(at) || has_source[at] {
                continue;
            }
            let mut line = vec![self.point(at, least)];
            while is_river(at) && !is_done[at] {
                is_done[at] = true;
                at = self.drainage.into[at] as usize;
                line.push(self.point(at, least));
            }
            self.wind(&mut line);
            for (k, (_, width)) in (0u16..).zip(&mut line) {
                *width *= (f32::from(k) / APPEARS).min(1.0);
            }
            if self.ground.as_slice()[at] <= 0.0 {
                line.iter_mut().rev().zip(MOUTH).for_each(|((_, width), wider)| *width *= wider);
            }
            for _ in 0..ROUNDS {
                line = smoothed(&line);
            }
            line.windows(2).for_each(|ends| stroke(out, [ends[0], ends[1]]));
        }
    }

    /// Moves the points of a river aside, all but its ends.
    fn wind(&self, line: &mut [(Vec2, f32)]) {
        let last = line.len().saturating_sub(1);
        for (point, _) in line.iter_mut().take(last).skip(1) {
            let cell = (*point / self.cell()).as_uvec2();
            let draw = |axis: u64| hash_unit(axis, u64::from(cell.x) << 32 | u64::from(cell.y)) - 0.5;
            *point += Vec2::new(draw(1), draw(2)) * (WINDING * self.cell());
        }
    }

    /// The middle of a cell and the width of the river there, texels.
    fn point(&self, i: usize, least: f32) -> (Vec2, f32) {
        let width = self.ground.width();
        let place = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) * self.cell();
        let share = (self.gathered[i] / least).sqrt();
        (place, self.measure.width * self.frame.texels_per_unit() * (0.5 * share).min(1.0))
    }
}

/// A line with its corners cut; its ends stay.
fn smoothed(line: &[(Vec2, f32)]) -> Vec<(Vec2, f32)> {
    let between = |a: (Vec2, f32), b: (Vec2, f32), share: f32| (a.0.lerp(b.0, share), a.1 + (b.1 - a.1) * share);
    let halves = line.windows(2).flat_map(|ends| [between(ends[0], ends[1], 0.25), between(ends[0], ends[1], 0.75)]);
    line.first().copied().into_iter().chain(halves).chain(line.last().copied()).collect()
}

/// Draws a part of a river with soft banks.
fn stroke(out: &mut Grid<f32>, [(from, wide), (to, wider)]: [(Vec2, f32); 2]) {
    let reach = 0.5 * wide.max(wider) + 1.0;
    let low = (from.min(to) - reach).max(Vec2::ZERO).as_usizevec2();
    let high = (from.max(to) + reach).max(Vec2::ZERO).as_usizevec2();
    let way = to - from;
    for y in low.y..=high.y.min(out.height() - 1) {
        let last = high.x.min(out.width() - 1);
        for (x, texel) in out.row_mut(y).iter_mut().enumerate().take(last + 1).skip(low.x) {
            let off = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - from;
            let along = (off.dot(way) / way.length_squared().max(1e-6)).clamp(0.0, 1.0);
            let half = 0.5 * (wide + (wider - wide) * along);
            let share = (half + 0.5 - (off - way * along).length()).clamp(0.0, 1.0) * (2.0 * half).min(1.0);
            *texel = texel.max(share);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a valley that falls to the right a river runs to the right, in its middle.
    #[test]
    fn rivers_follow_valleys() {
        let size = [240, 160];
        let height = |i: u32| {
            let (x, y) = ((i % size[0]) as f32 / 160.0, (i / size[0]) as f32 / 160.0);
            0.2 + 0.3 * (y - 0.5).abs() + 0.1 * (1.5 - x)
        };
        let heights = Grid::from_vec(size.into(), (0..size[0] * size[1]).map(height).collect()).unwrap();
        let frame = SurfaceFrame::new(size.into()).unwrap();
        let rivers = |gather| {
            let mut job = WaterJob::new(heights.size(), Some(Measure { gather, width: 0.02 }));
            while job.step(&heights, &frame) {}
            job.finish().unwrap().rivers.unwrap()
        };
        let river = rivers(0.1);
        assert!((60..230).all(|x| (0..160).any(|y| river.row(y)[x] > 0.2)));
        assert!((0..160usize).all(|y| y.abs_diff(80) < 30 || river.row(y)[30..200].iter().all(|share| *share == 0.0)));
        assert!(rivers(16.0).as_slice().iter().all(|share| *share == 0.0));
    }
}
