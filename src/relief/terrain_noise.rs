//! Gradient noise row by row: [`RowNoise`].

use crate::math::{Rng, hash_unit, ops, vectorized};

/// Perlin's gradient noise (1985, 2002) of several octaves, in texel space, one row after another.
///
/// In one row the noise of a cell is a blend of two linear functions of x, one for each side of the cell; so a texel
/// costs as little as with value noise.
#[derive(Clone, Debug)]
pub(super) struct RowNoise {
    octaves: Vec<Octave>,
}

#[derive(Clone, Debug)]
struct Octave {
    seed: u64,
    amplitude: f32,
    /// Cells per texel.
    frequency: [f32; 2],
    /// Slope and offset of the linear function at the left of each cell.
    lines: Vec<[f32; 2]>,
    /// For each texel of a row: its position in its cell, and that position smoothed.
    inside: Vec<f32>,
    fade: Vec<f32>,
    /// Where the texels of each cell end.
    ends: Vec<usize>,
}

fn smooth(t: f32) -> f32 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// Gradients to choose from. A power of two.
const GRADIENTS: u64 = 64;

impl RowNoise {
    /// Noise for rows of `width` texels whose largest features measure `scale` texels across and down; each further
    /// octave is half as large and has `persistence` times the amplitude. Values mostly lie in -1..=1.
    pub(super) fn new(width: usize, scale: [f32; 2], octaves: u32, persistence: f32, rng: &mut Rng) -> Self {
        let mut amplitude = 1.5;
        let octaves = (0..octaves).map(|octave| {
            let frequency = scale.map(|scale| (1u32 << octave) as f32 / scale.max(1.0));
            let seed = u64::from(rng.next_u32()) << 32 | u64::from(rng.next_u32());
            let (mut inside, mut fade, mut ends) = (Vec::with_capacity(width), Vec::with_capacity(width), Vec::new());
            for x in 0..width {
                let place = (x as f32 + 0.5) * frequency[0];
                inside.push(place - place.floor());
                fade.push(smooth(place - place.floor()));
                ends.resize(ends.len().max(place as usize + 1), x);
            }
            ends.push(width);
            ends.remove(0);
            let lines = vec![[0.0; 2]; ends.len() + 1];
            let octave = Octave { seed, amplitude, frequency, lines, inside, fade, ends };
            amplitude *= persistence;
            octave
        });
        Self { octaves: octaves.collect() }
    }

    /// Writes row `y`.
    pub(super) fn fill_row(&mut self, y: usize, out: &mut [f32]) {
        out.fill(0.0);
        for octave in &mut self.octaves {
            octave.add_row(y, out);
        }
    }
}

impl Octave {
    fn gradient(&self, row: u32, column: u64) -> [f32; 2] {
        let direction = (hash_unit(self.seed, u64::from(row) << 32 | column) * GRADIENTS as f32) as u64;
        table()[direction as usize % GRADIENTS as usize]
    }

    fn add_row(&mut self, y: usize, sum: &mut [f32]) {
        let place = (y as f32 + 0.5) * self.frequency[1];
        let row = place as u32;
        let inside = place - place.floor();
        let fade = smooth(inside);
        for column in 0..self.lines.len() {
            let [above, below] = [row, row.wrapping_add(1)].map(|row| self.gradient(row, column as u64));
            let slope = above[0] + (below[0] - above[0]) * fade;
            let [from_above, from_below] = [above[1] * inside, below[1] * (inside - 1.0)];
            self.lines[column] = [slope, from_above + (from_below - from_above) * fade];
        }
        vectorized(
            #[inline(always)]
            || {
                let mut first = 0;
                for (lines, &end) in self.lines.windows(2).zip(&self.ends) {
                    let [left, right] = [lines[0], lines[1]];
                    let places = self.inside[first..end].iter().zip(&self.fade[first..end]);
                    for (sum, (&inside, &fade)) in sum[first..end].iter_mut().zip(places) {
                        let from_left = left[0] * inside + left[1];
                        let from_right = right[0] * (inside - 1.0) + right[1];
                        *sum += self.amplitude * (from_left + (from_right - from_left) * fade);
                    }
                    first = end;
                }
            },
        );
    }
}

/// Unit vectors all around.
fn table() -> &'static [[f32; 2]; GRADIENTS as usize] {
    static TABLE: std::sync::OnceLock<[[f32; 2]; GRADIENTS as usize]> = std::sync::OnceLock::new();
    TABLE.get_or_init(|| {
        std::array::from_fn(|i| ops::unit(std::f32::consts::TAU * (i as f32 + 0.25) / GRADIENTS as f32).to_array())
    })
}
