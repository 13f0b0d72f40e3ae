//! Normal maps of height fields: [`normals`].

use super::rows::{MANY, Rows};
use crate::{Grid, math::vectorized, pattern::SurfaceFrame};
use glam::UVec2;

/// The normal map of a height field: tangent space, +Y up, `[red, green, blue, 255]`, linear.
///
/// Heights are in pattern units. Slopes are by Sobel's operator; heights continue beyond the border as they are at it.
///
/// ```
/// use bevy_crack::{Grid, pattern::SurfaceFrame, relief::normals};
///
/// // Ground that rises to the right, one texel up per texel.
/// let frame = SurfaceFrame::new([4, 4].into())?;
/// let heights = Grid::from_vec([4, 4].into(), (0..16).map(|i| (i % 4) as f32 / 4.0).collect()).unwrap();
/// assert_eq!(normals(&heights, &frame).get(1, 1), Some([37, 128, 218, 255]));
/// # Ok::<(), bevy_crack::pattern::FrameError>(())
/// ```
#[must_use]
pub fn normals(heights: &Grid<f32>, frame: &SurfaceFrame) -> Grid<[u8; 4]> {
    let mut normals = Normals::new(heights.size(), frame);
    while normals.step(heights) {}
    normals.out
}

/// The normal map of a height field in steps.
#[derive(Clone, Debug)]
pub(super) struct Normals {
    slopes: Slopes,
    rows: Rows,
    pub(super) out: Grid<[u8; 4]>,
}

impl Normals {
    pub(super) fn new(size: UVec2, frame: &SurfaceFrame) -> Self {
        let height = if size.x == 0 { 0 } else { size.y };
        let rows = Rows::new(UVec2::new(size.x, height));
        Self { slopes: Slopes::new(size.x as usize, frame), rows, out: Grid::new(size, [128, 128, 255, 255]) }
    }

    /// Some rows of `heights`, which are the same in all steps; `false` when all is done.
    pub(super) fn step(&mut self, heights: &Grid<f32>) -> bool {
        let slopes = &mut self.slopes;
        for y in self.rows.take(MANY) {
            slopes.read(heights, y);
            vectorized(
                #[inline(always)]
                || {
                    for ((out, &x), &y) in self.out.row_mut(y).iter_mut().zip(&slopes.right).zip(&slopes.down) {
                        let scale = 127.5 / (x * x + y * y + 1.0).sqrt();
                        let byte = |value: f32| (value * scale + 128.0) as u8;
                        *out = [byte(-x), byte(y), byte(1.0), 255];
                    }
                },
            );
        }
        !self.rows.is_done()
    }

    /// How much is done, 0..=1.
    pub(super) fn progress(&self) -> f32 {
        self.rows.share()
    }
}

/// Slopes of one row of a height field after another.
#[derive(Clone, Debug)]
pub(super) struct Slopes {
    scale: f32,
    /// Three rows with one texel more on either side.
    rows: [Vec<f32>; 3],
    /// Slopes of the row read last: height per length, to the right and down.
    pub(super) right: Vec<f32>,
    pub(super) down: Vec<f32>,
}

impl Slopes {
    /// For rows of `width` texels.
    pub(super) fn new(width: usize, frame: &SurfaceFrame) -> Self {
        let [wide, row] = [vec![0.0; width + 2], vec![0.0; width]];
        let rows = [wide.clone(), wide.clone(), wide];
        Self { scale: frame.texels_per_unit() / 8.0, rows, right: row.clone(), down: row }
    }

    /// Reads row `y`.
    pub(super) fn read(&mut self, heights: &Grid<f32>, y: usize) {
        let (width, last) = (heights.width(), heights.height() - 1);
        for (wide, y) in self.rows.iter_mut().zip([y.saturating_sub(1), y, (y + 1).min(last)]) {
            let row = heights.row(y);
            wide[1..=width].copy_from_slice(row);
            (wide[0], wide[width + 1]) = (row[0], row[width - 1]);
        }
        let [above, here, below] = &self.rows;
        let (right, down, scale) = (&mut self.right, &mut self.down, self.scale);
        vectorized(
            #[inline(always)]
            || {
                let n = right.len();
                let [a, b, c] = [&above[..n], &above[1..=n], &above[2..n + 2]];
                let [d, f] = [&here[..n], &here[2..n + 2]];
                let [g, h, i] = [&below[..n], &below[1..=n], &below[2..n + 2]];
                let down = &mut down[..n];
                for k in 0..n {
                    right[k] = ((c[k] - a[k]) + 2.0 * (f[k] - d[k]) + (i[k] - g[k])) * scale;
                    down[k] = ((g[k] - a[k]) + 2.0 * (h[k] - b[k]) + (i[k] - c[k])) * scale;
                }
            },
        );
    }
}
