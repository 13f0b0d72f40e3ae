//! Noise that makes the two edges of a crack uneven, in tiles that are made once.

use crate::math::hash_unit;
use std::sync::OnceLock;

/// Side of a tile, texels. Every cell size divides it, so that tiles join.
pub(super) const SIDE: usize = 192;

/// Length of a stored row: a block that starts in a row ends in it.
pub(super) const ROW: usize = SIDE + 8;

/// Distances between kinks, texels.
pub(super) const CELLS: [usize; 9] = [2, 3, 4, 6, 8, 12, 16, 24, 32];

/// Distance between kinks, in units of the largest deviation.
const SPACING: f32 = 6.0;

/// Share of the wide kinks; the others are half as far apart, but at least two texels.
const WIDE: f32 = 0.8;

/// Salt of the draws. Frozen: a seed must give the same result in every version.
const KINKS: u64 = 0x7A66;

/// The tiles of each cell size, as soon as they are needed.
static TILES: [OnceLock<Box<[i8]>>; CELLS.len()] = [const { OnceLock::new() }; CELLS.len()];

/// The tile for deviations of up to `most` texels: shares of it, -127..=127.
pub(super) fn tile(most: f32) -> &'static [i8] {
    let wanted = SPACING * most;
    let index = CELLS.iter().rposition(|cell| *cell as f32 <= wanted).unwrap_or(0);
    TILES[index].get_or_init(|| made(CELLS[index]))
}

/// The part of a tile for the eight texels of row `y` from column `x` on; tiles repeat.
#[inline(always)]
pub(super) fn at(tile: &[i8], x: usize, y: usize) -> &[i8] {
    let first = y % SIDE * ROW + x % SIDE;
    tile.get(first..first + 8).unwrap_or_default()
}

fn made(cell: usize) -> Box<[i8]> {
    let fine = (cell / 2).max(2);
    let mut texels = Vec::with_capacity(SIDE * ROW);
    for y in 0..SIDE {
        for x in 0..ROW {
            let value = WIDE * kinked(cell, x % SIDE, y) + (1.0 - WIDE) * kinked(fine, x % SIDE, y);
            texels.push((127.0 * value) as i8);
        }
    }
    texels.into_boxed_slice()
}

/// Random values in `-1..=1` at distances of `cell` texels, linear between.
fn kinked(cell: usize, x: usize, y: usize) -> f32 {
    let count = SIDE / cell;
    let (column, row) = (x / cell, y / cell);
    let (tx, ty) = ((x % cell) as f32 / cell as f32, (y % cell) as f32 / cell as f32);
    let value = |column: usize, row: usize| {
        let index = (row % count) * count + column % count;
        2.0 * hash_unit(KINKS + cell as u64, index as u64) - 1.0
    };
    let top = value(column, row) + (value(column + 1, row) - value(column, row)) * tx;
    let low = value(column, row + 1) + (value(column + 1, row + 1) - value(column, row + 1)) * tx;
    top + (low - top) * ty
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tiles join, deviate both ways, and their kinks are as far apart as asked.
    #[test]
    fn tiles_join() {
        for (most, cell) in [(0.0, 2), (1.0, 6), (2.4, 12), (5.0, 24), (1.0e6, 32), (f32::NAN, 2)] {
            let texels = tile(most);
            assert_eq!(
                CELLS.iter().find(|cell| std::ptr::eq(tile(**cell as f32 / SPACING + 0.01), texels)),
                Some(&cell)
            );
            let steepest = 127.0 * 2.0 * (WIDE / cell as f32 + (1.0 - WIDE) / (cell / 2).max(2) as f32) + 2.0;
            let (mut low, mut high) = (0, 0);
            for y in 0..2 * SIDE {
                for x in 0..2 * SIDE {
                    let [here, right, below] = [(x, y), (x + 1, y), (x, y + 1)].map(|(x, y)| at(texels, x, y)[0]);
                    assert_eq!(at(texels, x, y)[1], right);
                    (low, high) = (here.min(low), here.max(high));
                    let step = |to: i8| (f32::from(to) - f32::from(here)).abs();
                    assert!(step(below) <= steepest && step(right) <= steepest, "{x} {y}");
                }
            }
            assert!(low < -90 && high > 90, "{low} {high}");
        }
    }
}
