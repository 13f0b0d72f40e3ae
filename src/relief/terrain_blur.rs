//! Box blurs whose cost does not depend on their radius: [`blurred`].

use crate::Grid;

/// A grid blurred twice by boxes of `2 * radius + 1` texels; values continue beyond the border as they are at it.
///
/// Sums are of whole numbers, so that they do not drift; values lie in -1e6..=1e6.
pub(super) fn blurred(grid: &Grid<f32>, radius: usize) -> Grid<f32> {
    if radius == 0 || grid.as_slice().is_empty() {
        return grid.clone();
    }
    let highest = grid.as_slice().iter().fold(1e-3f32, |most, value| most.max(value.abs()));
    // 2^30 steps up to the highest value: windows of 2^16 values still fit.
    let step = highest / (1u32 << 30) as f32;
    let mut values: Vec<i64> = grid.as_slice().iter().map(|&value| (value / step) as i64).collect();
    let (width, height) = (grid.width(), grid.height());
    let mut line = vec![0; width.max(height)];
    for _ in 0..2 {
        for row in values.chunks_exact_mut(width) {
            line[..width].copy_from_slice(row);
            blur_line(&line[..width], radius, row);
        }
        blur_columns(&mut values, width, radius);
    }
    let out = values.into_iter().map(|value| value as f32 * step).collect();
    Grid::from_vec(grid.size(), out).unwrap_or_else(|| grid.clone())
}

fn blur_line(line: &[i64], radius: usize, out: &mut [i64]) {
    let (last, window) = (line.len() - 1, 2 * radius as i64 + 1);
    let mut sum = line[0] * (radius as i64 + 1);
    sum += (1..=radius).map(|i| line[i.min(last)]).sum::<i64>();
    for (i, out) in out.iter_mut().enumerate() {
        *out = sum / window;
        sum += line[(i + radius + 1).min(last)] - line[i.saturating_sub(radius)];
    }
}

/// All columns at once, row by row.
fn blur_columns(values: &mut Vec<i64>, width: usize, radius: usize) {
    let height = values.len() / width;
    let (last, window) = (height - 1, 2 * radius as i64 + 1);
    let row = |y: usize| y * width..(y + 1) * width;
    let mut sums: Vec<_> = values[row(0)].iter().map(|value| value * (radius as i64 + 1)).collect();
    for y in 1..=radius {
        sums.iter_mut().zip(&values[row(y.min(last))]).for_each(|(sum, value)| *sum += value);
    }
    let mut out = vec![0; values.len()];
    for y in 0..height {
        out[row(y)].iter_mut().zip(&sums).for_each(|(out, sum)| *out = sum / window);
        let (enter, leave) = (&values[row((y + radius + 1).min(last))], &values[row(y.saturating_sub(radius))]);
        for ((sum, enter), leave) in sums.iter_mut().zip(enter).zip(leave) {
            *sum += enter - leave;
        }
    }
    *values = out;
}
