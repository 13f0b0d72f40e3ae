//! Resamples guides of any size to the size of the surface.

use crate::Grid;
use glam::UVec2;

/// The values of a source line that make one value of the target line, and their weights.
#[derive(Clone, Debug)]
struct Taps {
    first: usize,
    weights: Vec<f32>,
}

/// For each of `to` values the taps into `from`: averages when it shrinks, linear interpolation when it grows.
fn taps(from: usize, to: usize) -> Vec<Taps> {
    let scale = from as f32 / to as f32;
    let reach = scale.max(1.0);
    let tap = |i: usize| {
        let middle = (i as f32 + 0.5) * scale - 0.5;
        let low = (middle - reach).ceil().max(0.0) as usize;
        let high = ((middle + reach).floor() as usize).min(from - 1);
        let first = low.min(high);
        let mut weights: Vec<f32> =
            (first..=high).map(|j| (1.0 - (j as f32 - middle).abs() / reach).max(1.0e-6)).collect();
        let sum: f32 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
        Taps { first, weights }
    };
    (0..to).map(tap).collect()
}

/// A picture stretched over a surface, row by row.
#[derive(Clone, Debug)]
pub(super) struct Resampler {
    across: Vec<Taps>,
    down: Vec<Taps>,
}

impl Resampler {
    /// A resampler from pictures of `from` texels to `to`.
    pub(super) fn new(from: UVec2, to: UVec2) -> Self {
        Self { across: taps(from.x as usize, to.x as usize), down: taps(from.y as usize, to.y as usize) }
    }

    /// Writes row `y`, 0..=1 to 0..=65535.
    pub(super) fn fill_row(&self, picture: &Grid<f32>, y: usize, out: &mut [u16]) {
        // NaN is not above zero.
        let cut = |value: f32| if value > 0.0 { value.min(1.0) } else { 0.0 };
        if picture.width() == out.len() && picture.height() == self.down.len() {
            for (out, &value) in out.iter_mut().zip(picture.row(y)) {
                *out = (cut(value) * 65535.0 + 0.5) as u16;
            }
            return;
        }
        let down = &self.down[y];
        for (out, across) in out.iter_mut().zip(&self.across) {
            let mut sum = 0.0;
            for (row, weight) in (down.first..).zip(&down.weights) {
                let row = &picture.row(row)[across.first..across.first + across.weights.len()];
                let part: f32 = row.iter().zip(&across.weights).map(|(&value, weight)| cut(value) * weight).sum();
                sum += part * weight;
            }
            *out = (sum * 65535.0 + 0.5) as u16;
        }
    }
}
