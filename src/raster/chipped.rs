//! Pieces that have come off the edges of wide cracks, and stones in these cracks, in tiles that are made once.

use super::ragged::{CELLS, ROW, SIDE};
use crate::math::hash_unit;
use std::sync::OnceLock;

/// Mean size of a piece, in units of its largest reach.
const SPACING: f32 = 3.5;

/// Share of the edge that no piece has come off, least reach of a piece as a share of the largest, and share of the pieces that have come off
/// whole: the others left a shallow step.
const ENTIRE: f32 = 0.65;
const LEAST: f32 = 0.3;
const WHOLE: f32 = 0.6;

/// Distance over which the sides of a piece rise, as a share of a cell: so slowly (one texel a texel) that each piece begins at the edge of the crack.
const SIDES: f32 = 2.0 / SPACING;

/// Size of stones in units of that of pieces, share of the ground without any, and where a stone ends, in units of the distance between stones.
const STONE: f32 = 0.67;
const BARE: f32 = 0.45;
const END: f32 = 1.2;

/// Salts of the draws. Frozen: a seed must give the same result in every version.
const PIECES: u64 = 0xB20C;
const STONES: u64 = 0x5703;

/// The tiles of each cell size, as soon as they are needed.
static TILES: [OnceLock<[Box<[i8]>; 2]>; CELLS.len()] = [const { OnceLock::new() }; CELLS.len()];

/// Pieces and stones.
#[derive(Clone, Copy)]
pub(super) struct Tiles {
    /// How far pieces reach, -127..=127: those below zero have come off whole, 0 = none has. To be read with [`ragged::at`](super::ragged::at).
    pub(super) pieces: &'static [i8],
    /// How high stones lie, 0..=127.
    pub(super) stones: &'static [i8],
    /// The largest reach of a piece, texels: with more some would not begin at the edge of the crack.
    pub(super) most: f32,
}

/// The tiles for pieces of up to about `most` texels.
pub(super) fn tiles(most: f32) -> Tiles {
    let index = fitting(SPACING * most);
    let [pieces, stones] = TILES[index].get_or_init(|| made(index));
    let largest = CELLS[index] as f32 / SPACING;
    Tiles { pieces, stones, most: if most < largest { most } else { largest } }
}

/// The largest cell size of at most `wanted` texels.
fn fitting(wanted: f32) -> usize {
    CELLS.iter().rposition(|cell| *cell as f32 <= wanted).unwrap_or(0)
}

fn made(index: usize) -> [Box<[i8]>; 2] {
    let (pieces, stones) =
        (Places::new(PIECES, CELLS[index]), Places::new(STONES, CELLS[fitting(STONE * CELLS[index] as f32)]));
    let tile = |of: &dyn Fn(usize, usize) -> f32| {
        let row = |y: usize| (0..ROW).map(move |x| (127.0 * of(x % SIDE, y)) as i8);
        (0..SIDE).flat_map(row).collect()
    };
    let piece = |x: usize, y: usize| {
        let (piece, _, border) = pieces.nearest(x, y);
        let drawn = hash_unit(PIECES ^ 1, piece) - ENTIRE;
        let reach = if drawn < 0.0 { 0.0 } else { LEAST + (1.0 - LEAST) * drawn / (1.0 - ENTIRE) };
        let reach = reach * (border / SIDES).min(1.0);
        if hash_unit(PIECES ^ 2, piece) < WHOLE { -reach } else { reach }
    };
    let stone = |x: usize, y: usize| {
        let (stone, far, _) = stones.nearest(x, y);
        let drawn = hash_unit(STONES ^ 1, stone) - BARE;
        if drawn < 0.0 { 0.0 } else { drawn / (1.0 - BARE) * (END - far).clamp(0.0, 1.0) }
    };
    [tile(&piece), tile(&stone)]
}

/// Random places, one in each cell.
struct Places {
    /// Texels.
    cell: usize,
    /// How far they lie to the right and down in their cells, row by row; in cells, less the margin, which is added last: these are the same bits.
    within: Vec<[f32; 2]>,
}

impl Places {
    fn new(salt: u64, cell: usize) -> Self {
        let count = (SIDE / cell) as u64;
        let place = |number| [0, 1].map(|axis| 0.8 * hash_unit(salt + 8 * cell as u64 + axis, number));
        Self { cell, within: (0..count * count).map(place).collect() }
    }

    /// The nearest place to a texel, its distance, and by how much the next one is further; in cells. What repeats with the tile has one number.
    fn nearest(&self, x: usize, y: usize) -> (u64, f32, f32) {
        let (cell, count) = (self.cell, SIDE / self.cell);
        let (column, row) = (x / cell, y / cell);
        let [at_x, at_y] = [x, y].map(|texel| (texel as f32 + 0.5) / cell as f32);
        let (mut best, mut second) = ((0, f32::INFINITY), f32::INFINITY);
        // From the cell before to the one after, both ways.
        for (right, down) in (0..9).map(|i| (i % 3, i / 3)) {
            let number = (row + down + count - 1) % count * count + (column + right + count - 1) % count;
            let [to_right, further_down] = self.within[number];
            let place = |before: usize, within: f32| before as f32 - 1.0 + 0.1 + within;
            let (dx, dy) = (place(column + right, to_right) - at_x, place(row + down, further_down) - at_y);
            let far = dx * dx + dy * dy;
            if far < best.1 {
                (best, second) = ((number as u64, far), best.1);
            } else if far < second {
                second = far;
            }
        }
        let far = best.1.sqrt();
        (best.0, far, second.sqrt() - far)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::ragged, *};

    /// Tiles join, most of an edge is entire, pieces of both kinds are there and about as large as asked, and so are stones.
    #[test]
    fn pieces_and_stones_have_their_shares_and_sizes() {
        for (most, cell) in [(0.0, 2), (2.0, 6), (3.0, 8), (6.0, 16), (1.0e6, 32), (f32::NAN, 2)] {
            let Tiles { pieces, stones, most: reach } = tiles(most);
            assert!(most.is_nan() || reach <= most && reach >= 0.55 * most.min(9.0), "{reach} of {most}");
            assert_eq!(CELLS[fitting(SPACING * most)], cell);
            let at = |tile, x, y| i32::from(ragged::at(tile, x, y)[0]);
            let (mut none, mut whole, mut bare, mut steepest) = (0, 0, 0, 0);
            for (x, y) in (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE)) {
                let [piece, stone] = [pieces, stones].map(|tile| at(tile, x, y));
                assert_eq!(i32::from(ragged::at(pieces, x, y)[1]), at(pieces, x + 1, y));
                assert!((-127..=127).contains(&piece), "{piece}");
                assert!((0..=127).contains(&stone), "{stone}");
                none += usize::from(piece == 0);
                whole += usize::from(piece < 0);
                // From one piece to the next through nothing, and no steeper than a texel a texel, so that none is apart from the edge.
                for next in [at(pieces, x + 1, y), at(pieces, x, y + 1)] {
                    let step = (piece - next).abs() as f32 / 127.0 * cell as f32 / SPACING;
                    assert!(step < 1.45, "a step of {step} texels at {x} {y}");
                }
                bare += usize::from(stone == 0);
                steepest = steepest.max((stone - at(stones, x, y + 1)).abs());
            }
            let share = |n: usize| n as f32 / (SIDE * SIDE) as f32;
            assert!((share(none) - ENTIRE).abs() < 0.13, "{most}: {}", share(none));
            assert!((share(whole) - WHOLE * (1.0 - ENTIRE)).abs() < 0.13, "{most}: {}", share(whole));
            assert!((share(bare) - BARE).abs() < 0.15, "{most}: {}", share(bare));
            assert!(steepest > 40, "{steepest}");
        }
    }
}
