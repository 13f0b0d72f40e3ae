//! The noise that makes cracks irregular: [`Noise`].

use crate::{
    math::{hash_unit, smooth, vectorized},
    pattern::SurfaceFrame,
};

/// Number of octaves; the finest features are 1/32 of the largest.
const OCTAVES: usize = 6;

/// Ratio of the amplitudes of successive octaves. Below 0.6 cracks are smooth and follow the axes of the lattice.
const PERSISTENCE: f32 = 0.9;

/// Factor by which the sum of the octaves is stretched around its middle: six octaves together rarely leave
/// 0.25..0.75.
const CONTRAST: f32 = 2.6;

/// Value noise of several octaves, in pattern space, row by row.
#[derive(Clone, Debug)]
pub(super) struct Noise {
    octaves: Vec<Octave>,
    sum: Vec<f32>,
}

#[derive(Clone, Debug)]
struct Octave {
    seed: u64,
    amplitude: f32,
    /// Cells per texel.
    frequency: f32,
    /// For each texel of a row: its position in its cell, smoothed.
    fade: Vec<f32>,
    /// Column of texels at which each cell begins, and the end of the last one.
    begins: Vec<usize>,
    /// Values at the corners of the current row of cells: above, below, and the number of that row.
    above: Vec<f32>,
    below: Vec<f32>,
    cell_row: Option<u32>,
}

impl Noise {
    /// Noise over `frame` whose largest features are `scale` pattern units.
    pub(super) fn new(frame: &SurfaceFrame, scale: f32, seed: u64) -> Self {
        let width = frame.size().x as usize;
        let mut amplitudes = [1.0; OCTAVES];
        for octave in 1..OCTAVES {
            amplitudes[octave] = amplitudes[octave - 1] * PERSISTENCE;
        }
        let sum: f32 = amplitudes.iter().sum();
        let octaves = (0u32..).zip(amplitudes).map(|(octave, amplitude)| {
            let frequency = (1u32 << octave) as f32 / (scale * frame.texels_per_unit());
            let places = (0..width).map(|x| (x as f32 + 0.5) * frequency);
            let fade = places.clone().map(|place| smooth(place - place.floor())).collect();
            let mut begins = Vec::new();
            for (x, place) in places.enumerate() {
                // Cells narrower than a texel contain no texels.
                while begins.len() <= place as usize {
                    begins.push(x);
                }
            }
            begins.push(width);
            let corners = vec![0.0; begins.len()];
            Octave {
                seed: seed.wrapping_add(u64::from(octave)),
                amplitude: amplitude / sum,
                frequency,
                fade,
                begins,
                above: corners.clone(),
                below: corners,
                cell_row: None,
            }
        });
        Self { octaves: octaves.collect(), sum: vec![0.0; width] }
    }

    /// Writes row `y`, 0..=65535.
    pub(super) fn fill_row(&mut self, y: usize, out: &mut [u16]) {
        vectorized(
            #[inline(always)]
            || {
                self.sum.fill(0.0);
                for octave in &mut self.octaves {
                    octave.add_row(y, &mut self.sum);
                }
                for (out, &sum) in out.iter_mut().zip(&self.sum) {
                    *out = (((sum - 0.5) * CONTRAST + 0.5) * 65535.0) as u16;
                }
            },
        );
    }
}

impl Octave {
    fn corners(seed: u64, row: u32, out: &mut [f32]) {
        for (column, out) in (0u64..).zip(out) {
            *out = hash_unit(seed, u64::from(row) << 32 | column);
        }
    }

    #[inline(always)]
    fn add_row(&mut self, y: usize, sum: &mut [f32]) {
        let place = (y as f32 + 0.5) * self.frequency;
        let row = place as u32;
        if self.cell_row != Some(row) {
            Self::corners(self.seed, row, &mut self.above);
            Self::corners(self.seed, row + 1, &mut self.below);
            self.cell_row = Some(row);
        }
        let down = smooth(place - row as f32);
        let corner = |i: usize| (self.above[i] + (self.below[i] - self.above[i]) * down) * self.amplitude;
        let mut right = corner(0);
        for (i, ends) in self.begins.windows(2).enumerate() {
            let left = right;
            right = corner(i + 1);
            let cell = ends[0]..ends[1];
            for (sum, &fade) in sum[cell.clone()].iter_mut().zip(&self.fade[cell]) {
                *sum += left + (right - left) * fade;
            }
        }
    }
}
