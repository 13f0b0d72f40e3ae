//! Box blurs whose cost does not depend on their radius: [`Blur`].

use super::rows::{MANY, Rows};
use crate::{Grid, math::vectorized};
use glam::UVec2;

/// Whole numbers up to the highest value: windows of 2^16 values still fit into an exact sum.
const STEPS: f32 = (1u32 << 30) as f32;

/// A grid blurred twice by boxes of `2 * radius + 1` texels, in steps; values continue beyond the border as they are at it.
///
/// Sums are of whole numbers, so that they do not drift; values lie in -1e6..=1e6.
#[derive(Clone, Debug)]
pub(super) struct Blur {
    radius: usize,
    size: UVec2,
    stage: Stage,
    rows: Rows,
    highest: f32,
    /// Whole numbers: what the stage reads, and what it makes.
    from: Vec<i32>,
    to: Vec<i32>,
    /// Sums of the windows of all columns, and of those of a row.
    sums: [Vec<f64>; 2],
    /// A row before it is blurred.
    line: Vec<i32>,
    out: Grid<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Highest,
    /// Whole numbers, blurred across.
    Across,
    /// Blurred down, and across once more.
    Both,
    /// Blurred down.
    Down,
    Done,
}

/// The mean of `1 / inverse` whole numbers, from their sum, cut to a whole number.
///
/// Exact: the half keeps quotients away from whole numbers by more than they are rounded.
#[inline(always)]
fn mean(sum: f64, inverse: f64) -> i32 {
    ((sum + 0.5f64.copysign(sum)) * inverse) as i32
}

impl Blur {
    pub(super) fn new(size: UVec2, radius: usize) -> Self {
        let [width, height] = size.to_array().map(|side| side as usize);
        let whole = || if radius == 0 { Vec::new() } else { vec![0; width * height] };
        Self {
            radius,
            size,
            stage: if width * height == 0 { Stage::Done } else { Stage::Highest },
            rows: Rows::new(size),
            highest: 1e-3,
            from: whole(),
            to: whole(),
            sums: [vec![0.0; width], vec![0.0; width]],
            line: vec![0; width],
            out: Grid::new(size, 0.0),
        }
    }

    /// Some rows of `grid`, which is the same in all steps; `false` when all is done.
    pub(super) fn step(&mut self, grid: &Grid<f32>) -> bool {
        if self.stage == Stage::Done {
            return false;
        }
        for y in self.rows.take(MANY) {
            match self.stage {
                Stage::Highest if self.radius == 0 => self.out.row_mut(y).copy_from_slice(grid.row(y)),
                Stage::Highest => {
                    self.highest = grid.row(y).iter().fold(self.highest, |most, value| most.max(value.abs()));
                }
                Stage::Across => self.across(y, grid.row(y)),
                Stage::Both | Stage::Down => self.down(y),
                Stage::Done => {}
            }
        }
        if self.rows.is_done() {
            self.advance();
        }
        self.stage != Stage::Done
    }

    pub(super) fn is_done(&self) -> bool {
        self.stage == Stage::Done
    }

    fn advance(&mut self) {
        self.stage = match self.stage {
            Stage::Highest if self.radius > 0 => Stage::Across,
            Stage::Across => Stage::Both,
            Stage::Both => Stage::Down,
            Stage::Highest | Stage::Down | Stage::Done => Stage::Done,
        };
        self.rows = Rows::new(self.size);
        if matches!(self.stage, Stage::Both | Stage::Down) {
            std::mem::swap(&mut self.from, &mut self.to);
            // Windows reach `radius` rows further down than the row that they are for. Above the border is row 0.
            self.rows = Rows::new(self.size + UVec2::new(0, self.radius as u32));
            let first = &self.from[..self.line.len()];
            self.sums[0].iter_mut().zip(first).for_each(|(sum, value)| *sum = f64::from(*value) * self.radius as f64);
        }
    }

    /// The blurred grid, when all is done.
    pub(super) fn finish(self) -> Grid<f32> {
        self.out
    }

    fn inverse(&self) -> f64 {
        1.0 / (2 * self.radius + 1) as f64
    }

    /// Blurs a row across.
    fn across(&mut self, y: usize, row: &[f32]) {
        let (step, inverse) = (self.highest / STEPS, self.inverse());
        vectorized(
            #[inline(always)]
            || self.line.iter_mut().zip(row).for_each(|(whole, value)| *whole = (value / step) as i32),
        );
        blur_line(&self.line, self.radius, inverse, &mut self.sums[1], &mut self.to[y * row.len()..][..row.len()]);
    }

    /// Adds row `lower` to the windows of all columns, and makes the row whose windows end there.
    fn down(&mut self, lower: usize) {
        let (width, last, inverse) = (self.line.len(), self.size.y as usize - 1, self.inverse());
        let row = |y: usize| &self.from[y.min(last) * width..][..width];
        let sums = &mut self.sums[0];
        let Some(y) = lower.checked_sub(self.radius) else {
            sums.iter_mut().zip(row(lower)).for_each(|(sum, value)| *sum += f64::from(*value));
            return;
        };
        let (enter, leave) = (row(lower), row(y.saturating_sub(self.radius)));
        let line = &mut self.line;
        vectorized(
            #[inline(always)]
            || {
                for (((sum, out), &enter), &leave) in sums.iter_mut().zip(line).zip(enter).zip(leave) {
                    let all = *sum + f64::from(enter);
                    *out = mean(all, inverse);
                    *sum = all - f64::from(leave);
                }
            },
        );
        if self.stage == Stage::Both {
            blur_line(&self.line, self.radius, inverse, &mut self.sums[1], &mut self.to[y * width..][..width]);
        } else {
            let step = self.highest / STEPS;
            self.out.row_mut(y).iter_mut().zip(&self.line).for_each(|(out, &value)| *out = value as f32 * step);
        }
    }
}

/// Blurs a line of whole numbers.
fn blur_line(line: &[i32], radius: usize, inverse: f64, sums: &mut [f64], out: &mut [i32]) {
    let last = line.len() - 1;
    let at = |i: usize| f64::from(line[i.min(last)]);
    let mut sum = at(0) * (radius + 1) as f64;
    sum += (1..=radius).map(at).sum::<f64>();
    for (i, out) in sums.iter_mut().enumerate() {
        *out = sum;
        sum += at(i + radius + 1) - at(i.saturating_sub(radius));
    }
    vectorized(
        #[inline(always)]
        || out.iter_mut().zip(sums).for_each(|(out, sum)| *out = mean(*sum, inverse)),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    fn blurred(grid: &Grid<f32>, radius: usize) -> Grid<f32> {
        let mut blur = Blur::new(grid.size(), radius);
        while blur.step(grid) {}
        blur.finish()
    }

    /// The mean of whole numbers by division, one window after another.
    fn plain(grid: &Grid<f32>, radius: i64) -> Grid<f32> {
        let step = grid.as_slice().iter().fold(1e-3f32, |most, value| most.max(value.abs())) / STEPS;
        let [width, height] = grid.size().as_i64vec2().to_array();
        let mut values: Vec<i64> = grid.as_slice().iter().map(|value| (value / step) as i64).collect();
        for [right, down] in [[1, 0], [0, 1], [1, 0], [0, 1]] {
            let from = values.clone();
            for (i, value) in (0..).zip(&mut values) {
                let place = |k: i64| {
                    let (x, y) = (i % width + right * k, i / width + down * k);
                    y.clamp(0, height - 1) * width + x.clamp(0, width - 1)
                };
                *value = (-radius..=radius).map(|k| from[place(k) as usize]).sum::<i64>() / (2 * radius + 1);
            }
        }
        Grid::from_vec(grid.size(), values.into_iter().map(|value| value as f32 * step).collect()).unwrap()
    }

    #[test]
    fn windows_have_the_mean_of_their_values() {
        let mut rng = Rng::new(2);
        for size in [[1, 1], [1, 9], [13, 1], [40, 33], [3, 50]] {
            for radius in [0, 1, 2, 7, 60] {
                for scale in [1e-6, 1.0, 1e6] {
                    let values = (0..size[0] * size[1]).map(|_| scale * rng.signed()).collect();
                    let grid = Grid::from_vec(size.into(), values).unwrap();
                    let expected = if radius == 0 { grid.clone() } else { plain(&grid, radius) };
                    assert!(blurred(&grid, radius as usize) == expected, "{size:?}, {radius}");
                }
            }
        }
        assert_eq!(blurred(&Grid::new(UVec2::ZERO, 0.0), 3).size(), UVec2::ZERO);
    }
}
