//! [`solve_poisson`]: heights from their Laplacian.

use super::{
    BlendError,
    transform::{LANES, Lines, SineTransform, ZERO},
};
use crate::{
    Grid,
    math::{ops, vectorized},
};

/// The largest value that is taken: sums of as many as a grid can hold stay finite.
const MOST: f32 = 1e20;

/// Solves Poisson's equation on a rectangle: replaces the values `f` of `grid` by the values `u` with
/// `u[x-1,y] + u[x+1,y] + u[x,y-1] + u[x,y+1] - 4 u[x,y] = f[x,y]`, where `u` is zero outside the grid.
///
/// For other values around the grid, subtract each from the `f` beside it first.
///
/// The solution is direct: sine transforms along both axes, a division, and the transforms back. Its error is that of
/// rounding, about `1e-5` of the largest `u` on grids up to 2048 x 2048. The time per value grows with the prime factors
/// of `width + 1` and `height + 1`; it is least where both are powers of two.
///
/// Paper: Pérez, Gangnet and Blake 2003, "Poisson Image Editing", eq. 4 and 7, on a rectangle.
///
/// # Errors
/// [`BlendError::NotFinite`] if a value is not finite or beyond ±1e20; the grid is unchanged then. An empty grid is no
/// error.
///
/// ```
/// use bevy_crack::{Grid, blend::solve_poisson};
///
/// let mut grid = Grid::new([3, 1].into(), 0.0);
/// grid.row_mut(0).copy_from_slice(&[-2.0, -4.0, -10.0]);
/// solve_poisson(&mut grid)?;
/// for (u, expected) in grid.as_slice().iter().zip([1.0, 2.0, 3.0]) {
///     assert!((u - expected).abs() < 1e-5);
/// }
/// # Ok::<(), bevy_crack::blend::BlendError>(())
/// ```
pub fn solve_poisson(grid: &mut Grid<f32>) -> Result<(), BlendError> {
    check(grid)?;
    solve(grid);
    Ok(())
}

/// Finds a value that cannot be taken.
pub(super) fn check(grid: &Grid<f32>) -> Result<(), BlendError> {
    // Largest first: a loop without a way out is vectorised.
    let is_bad = |value: &f32| value.is_nan() || value.abs() > MOST;
    if !grid.as_slice().iter().fold(false, |any, value| any | is_bad(value)) {
        return Ok(());
    }
    let index = grid.as_slice().iter().position(is_bad).unwrap_or_default();
    Err(BlendError::NotFinite { x: (index % grid.width()) as u32, y: (index / grid.width()) as u32 })
}

/// [`solve_poisson`] of values that are known to be finite.
pub(super) fn solve(grid: &mut Grid<f32>) {
    if grid.size().min_element() > 0 {
        vectorized(
            #[inline(always)]
            || Rectangle::new(grid).solve(grid),
        );
    }
}

/// A grid in strips of as many columns as are transformed at once, row after row in each.
struct Rectangle {
    width: usize,
    height: usize,
    /// Rows of a strip: the height, and what is missing to whole blocks.
    rows: usize,
    strips: Vec<Lines>,
}

/// The eigenvalues of the second difference: `2 - 2 cos(π k / (n + 1))` for `k` from 1 to `n`.
fn eigenvalues(n: usize) -> Vec<f32> {
    let sine = |k: usize| f64::from(ops::turn(k as f64 / (4 * (n + 1)) as f64)[1]);
    (1..=n).map(|k| (4.0 * sine(k) * sine(k)) as f32).collect()
}

impl Rectangle {
    fn new(grid: &Grid<f32>) -> Self {
        let (width, height) = (grid.width(), grid.height());
        let rows = height.next_multiple_of(LANES);
        Self { width, height, rows, strips: vec![ZERO; rows * width.div_ceil(LANES)] }
    }

    #[inline(always)]
    fn solve(mut self, grid: &mut Grid<f32>) {
        self.each_strip(grid, |values, strip| {
            strip.as_flattened_mut()[..values.len()].copy_from_slice(values);
        });
        let mut along_y = SineTransform::new(self.height);
        self.strips.chunks_exact_mut(self.rows).for_each(
            #[inline(always)]
            |strip| along_y.apply(strip),
        );
        self.solve_rows();
        self.strips.chunks_exact_mut(self.rows).for_each(
            #[inline(always)]
            |strip| along_y.apply(strip),
        );
        self.each_strip(grid, |values, strip| {
            values.copy_from_slice(&strip.as_flattened()[..values.len()]);
        });
    }

    /// Visits the part of each row of `grid` that is in each strip.
    #[inline(always)]
    fn each_strip(&mut self, grid: &mut Grid<f32>, visit: impl Fn(&mut [f32], &mut Lines)) {
        for y in 0..self.height {
            for (strip, values) in self.strips.chunks_exact_mut(self.rows).zip(grid.row_mut(y).chunks_mut(LANES)) {
                visit(values, &mut strip[y]);
            }
        }
    }

    /// Transforms the rows, divides by the sums of eigenvalues, and transforms them back.
    #[inline(always)]
    fn solve_rows(&mut self) {
        let (by_column, by_row) = (eigenvalues(self.width), eigenvalues(self.height));
        let mut along_x = SineTransform::new(self.width);
        // Both transforms back and forth multiply by half their period each.
        let scale = -4.0 / ((self.width + 1) as f32 * (self.height + 1) as f32);
        let mut block = vec![ZERO; self.width.next_multiple_of(LANES)];
        for top in (0..self.height).step_by(LANES) {
            self.turn_block(&mut block, top, true);
            along_x.apply(&mut block);
            let mut own: Lines = [[1.0; LANES / 2]; 2];
            for (own, row) in own.as_flattened_mut().iter_mut().zip(by_row.iter().skip(top)) {
                *own = *row;
            }
            for (lines, column) in block.iter_mut().zip(&by_column) {
                for (lines, own) in lines.iter_mut().zip(&own) {
                    for (value, own) in lines.iter_mut().zip(own) {
                        *value *= scale / (own + column);
                    }
                }
            }
            along_x.apply(&mut block);
            self.turn_block(&mut block, top, false);
        }
    }

    /// Copies the rows from `top` on to the lines of a block (`out`), or back.
    #[inline(always)]
    fn turn_block(&mut self, block: &mut [Lines], top: usize, out: bool) {
        let strips = self.strips.chunks_exact_mut(self.rows).zip(block.chunks_exact_mut(LANES));
        for (strip, columns) in strips {
            let Some(rows) = strip[top..].first_chunk_mut::<LANES>() else { continue };
            let Some(columns) = columns.first_chunk_mut::<LANES>() else { continue };
            if out { turn_square(rows, columns) } else { turn_square(columns, rows) }
        }
    }
}

/// Exchanges rows and columns.
#[inline(always)]
fn turn_square(from: &[Lines; LANES], to: &mut [Lines; LANES]) {
    const HALF: usize = LANES / 2;
    for a in 0..2 {
        for b in 0..2 {
            for i in 0..HALF {
                for j in 0..HALF {
                    to[b * HALF + j][a][i] = from[a * HALF + i][b][j];
                }
            }
        }
    }
}
