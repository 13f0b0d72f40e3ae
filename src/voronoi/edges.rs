//! The edges of a picture as a guide.

use crate::Grid;

/// Edges with at least this share of the strongest slope have the value 1.
const FULL: f32 = 0.4;

/// The edges of a picture (lightness 0..=1, or the alpha of a sprite) as a guide: 1 on strong edges, 0 in uniform
/// areas.
///
/// The slope is computed with Sobel's kernel. A picture without edges gives a guide that is zero everywhere; NaN
/// counts as 0.
///
/// ```
/// use bevy_crack::{Grid, voronoi::edges};
///
/// let step = Grid::from_vec([4, 1].into(), vec![0.0, 0.0, 1.0, 1.0]).unwrap();
/// assert_eq!(edges(&step).as_slice(), [0.0, 1.0, 1.0, 0.0]);
/// ```
#[must_use]
pub fn edges(picture: &Grid<f32>) -> Grid<f32> {
    let mut slopes = Grid::new(picture.size(), 0.0f32);
    let (w, h) = (picture.width(), picture.height());
    let mut strongest = 0.0f32;
    for y in 0..h {
        let rows = [y.saturating_sub(1), y, (y + 1).min(h - 1)].map(|y| picture.row(y));
        for x in 0..w {
            let columns = [x.saturating_sub(1), x, (x + 1).min(w - 1)];
            let value = |row: usize, column: usize| {
                let value = rows[row][columns[column]];
                if value > 0.0 { value.min(1.0) } else { 0.0 }
            };
            let side = |k: usize| value(0, k) + 2.0 * value(1, k) + value(2, k);
            let level = |k: usize| value(k, 0) + 2.0 * value(k, 1) + value(k, 2);
            let (dx, dy) = (side(2) - side(0), level(2) - level(0));
            let slope = (dx * dx + dy * dy).sqrt();
            slopes.row_mut(y)[x] = slope;
            strongest = strongest.max(slope);
        }
    }
    let scale = 1.0 / (strongest * FULL).max(1.0e-6);
    slopes.as_mut_slice().iter_mut().for_each(|slope| *slope = (*slope * scale).min(1.0));
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;
    use glam::UVec2;

    #[test]
    fn slopes_are_those_of_the_kernel() {
        const KERNEL: [[f32; 3]; 3] = [[-1.0, 0.0, 1.0], [-2.0, 0.0, 2.0], [-1.0, 0.0, 1.0]];
        let mut rng = Rng::new(2);
        for size in [UVec2::new(7, 5), UVec2::new(1, 6), UVec2::new(9, 2)] {
            let values = (0..size.x * size.y).map(|_| rng.unit()).collect();
            let picture = Grid::from_vec(size, values).unwrap();
            let slope = |x: u32, y: u32| {
                let mut sums = [0.0f32; 2];
                for (i, j) in (0..3u32).flat_map(|j| (0..3u32).map(move |i| (i, j))) {
                    let [x, y] = [(x + i).saturating_sub(1).min(size.x - 1), (y + j).saturating_sub(1).min(size.y - 1)];
                    let value = picture.row(y as usize)[x as usize];
                    sums[0] += KERNEL[j as usize][i as usize] * value;
                    sums[1] += KERNEL[i as usize][j as usize] * value;
                }
                sums[0].hypot(sums[1])
            };
            let places = || (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y)));
            let strongest = places().map(|(x, y)| slope(x, y)).fold(0.0, f32::max);
            let guide = edges(&picture);
            for (x, y) in places() {
                let (is, expected) = (guide.row(y as usize)[x as usize], (slope(x, y) / (FULL * strongest)).min(1.0));
                assert!((is - expected).abs() < 1e-5, "{x} {y} of {size}: {is} {expected}");
            }
        }
    }
}
