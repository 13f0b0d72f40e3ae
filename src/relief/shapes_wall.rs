//! Blocks of a rock wall: [`wall`].

use crate::math::{Rng, ops};
use glam::Vec2;

/// Width and height of a cell of the lattice that stones are laid on, pattern units.
const CELL: Vec2 = Vec2::new(0.084, 0.064);

/// Half of the gap between middling blocks, pattern units.
const GAP: f32 = 0.0044;

/// How far sides are worn back, pattern units.
const ROUGH: f32 = 0.0055;

/// Most cells.
const MOST: f32 = 16_384.0;

/// How far the corners of cells are moved, as a share of a cell.
const MOVE: Vec2 = Vec2::new(0.27, 0.29);

/// The sharpest corner of a block, as the cosine of its angle: 54 degrees.
const SHARPEST: f32 = 0.588;

/// The shortest side of a block, as a share of the height of a cell.
const SHORTEST: f32 = 0.62;

/// Rounds in which corners that are too sharp are moved back.
const ROUNDS: usize = 8;

/// Cells across and down of large blocks, which are laid first.
const LARGE: [[usize; 2]; 6] = [[4, 3], [3, 3], [3, 2], [2, 3], [4, 2], [3, 2]];

/// Cells across and down of those laid between them.
const SMALL: [[usize; 2]; 8] = [[2, 2], [2, 1], [2, 1], [1, 2], [2, 2], [3, 1], [2, 1], [1, 1]];

/// Blocks of many sizes, with gaps between them.
///
/// Blocks share the corners of a lattice, so every joint runs from one joint to another. The larger blocks lie across
/// the lines of the smaller ones.
pub(super) fn wall(extent: Vec2, rng: &mut Rng) -> Vec<Vec<Vec2>> {
    if !extent.is_finite() || extent.min_element() <= 0.0 {
        return Vec::new();
    }
    let whole = 1.3 * extent;
    let least = (whole / CELL).max(Vec2::splat(3.0));
    let scale = (least.element_product() / MOST).sqrt().max(1.0);
    let across = (least.x / scale).clamp(3.0, MOST / 3.0).ceil();
    let down = (least.y / scale).min(MOST / across).max(3.0).floor();
    let size = [across as usize, down as usize];
    let blocks = laid(size, rng);
    let corners = corners(&blocks, size, whole / Vec2::new(across, down), rng);
    let dip = ops::unit(0.1 * rng.signed());
    let mut block = |block: &Block| {
        let outline: Vec<_> = block.corners(size).map(|corner| corners[corner]).collect();
        let outline = rough(&blunt(&inset(&outline, rng), rng), rng);
        outline.into_iter().map(|point| 0.5 * extent + dip.rotate(point - 0.5 * whole)).collect()
    };
    blocks.iter().map(&mut block).collect()
}

/// Cells that are one block: the first, and those behind the last.
#[derive(Clone, Copy, Debug)]
struct Block {
    low: [usize; 2],
    high: [usize; 2],
}

impl Block {
    /// The indices of the corners of cells along its border, all around.
    fn corners(&self, size: [usize; 2]) -> impl Iterator<Item = usize> + use<> {
        let ([left, top], [right, bottom]) = (self.low, self.high);
        let at = move |x: usize, y: usize| y * (size[0] + 1) + x;
        let upper = (left..right).map(move |x| at(x, top)).chain((top..bottom).map(move |y| at(right, y)));
        let back = (left + 1..=right).rev().map(move |x| at(x, bottom));
        upper.chain(back).chain((top + 1..=bottom).rev().map(move |y| at(left, y)))
    }

    /// Its four corners, and the number of steps from each to the next.
    fn sides(&self, size: [usize; 2]) -> [[usize; 3]; 4] {
        let [wide, high] = [self.high[0] - self.low[0], self.high[1] - self.low[1]];
        let at = |x: usize, y: usize| y * (size[0] + 1) + x;
        let [a, b] = [at(self.low[0], self.low[1]), at(self.high[0], self.low[1])];
        let [c, d] = [at(self.high[0], self.high[1]), at(self.low[0], self.high[1])];
        [[a, b, wide], [b, c, high], [d, c, wide], [a, d, high]]
    }
}

/// Blocks that cover a lattice.
fn laid(size: [usize; 2], rng: &mut Rng) -> Vec<Block> {
    let mut taken = vec![false; size[0] * size[1]];
    let mut blocks = Vec::new();
    let mut lay = |low: [usize; 2], cells: [usize; 2]| {
        let high = [low[0] + cells[0], low[1] + cells[1]];
        let is_inside = high[0] <= size[0] && high[1] <= size[1];
        let rows = || (low[1]..high[1]).map(|y| y * size[0] + low[0]..y * size[0] + high[0]);
        if !is_inside || rows().flatten().any(|cell| taken[cell]) {
            return false;
        }
        rows().flatten().for_each(|cell| taken[cell] = true);
        blocks.push(Block { low, high });
        true
    };
    let mut below = |most: usize| rng.next_u32() as usize % most;
    for _ in 0..size[0] * size[1] / 9 {
        let low = [below(size[0]), below(size[1])];
        lay(low, LARGE[below(LARGE.len())]);
    }
    for cell in 0..size[0] * size[1] {
        let low = [cell % size[0], cell / size[0]];
        let first = below(SMALL.len());
        let sizes = [SMALL[first], SMALL[below(SMALL.len())], [2, 1], [1, 2], [1, 1]];
        sizes.into_iter().find(|cells| lay(low, *cells));
    }
    blocks
}

/// The corners of all cells, moved so that no block has a sharp corner and long sides are nearly straight.
fn corners(blocks: &[Block], size: [usize; 2], cell: Vec2, rng: &mut Rng) -> Vec<Vec2> {
    let mut lines = [0, 1].map(|axis| {
        let mut place = 0.0;
        let mut line = |_| {
            place += rng.range(0.78, 1.25);
            place
        };
        (0..=size[axis]).map(&mut line).collect::<Vec<f32>>()
    });
    for (axis, line) in lines.iter_mut().enumerate() {
        let (first, last) = (line[0], line[size[axis]]);
        let scale = size[axis] as f32 / (last - first);
        line.iter_mut().for_each(|place| *place = (*place - first) * scale);
    }
    let even = (0..(size[0] + 1) * (size[1] + 1)).map(|i| [i % (size[0] + 1), i / (size[0] + 1)]);
    let even: Vec<_> = even.map(|[x, y]| Vec2::new(lines[0][x], lines[1][y]) * cell).collect();
    let moved = even.iter().map(|point| *point + Vec2::new(rng.signed(), rng.signed()) * MOVE * cell);
    let mut corners: Vec<_> = moved.collect();
    for round in 0..ROUNDS {
        for block in blocks {
            let sides = block.sides(size);
            for [from, to, steps] in sides {
                let (start, end) = (corners[from], corners[to]);
                for step in 1..steps {
                    let corner = &mut corners[from + (to - from) / steps * step];
                    *corner = corner.lerp(start.lerp(end, step as f32 / steps as f32), 0.4);
                }
            }
            let [a, b, c, d] = [sides[0][0], sides[0][1], sides[2][1], sides[2][0]];
            for [last, here, next] in [[d, a, b], [a, b, c], [b, c, d], [c, d, a]] {
                let to = |other: usize| (corners[other] - corners[here]).normalize_or_zero();
                let is_short = corners[here].distance(corners[next]) < SHORTEST * cell.y;
                if is_short || to(last).dot(to(next)).abs() > SHARPEST {
                    let share = 0.3 + 0.1 * round as f32;
                    for i in [last, here, next] {
                        corners[i] = corners[i].lerp(even[i], share.min(0.9));
                    }
                }
            }
        }
    }
    corners
}

/// An outline drawn in by half of a gap whose width changes along it.
fn inset(outline: &[Vec2], rng: &mut Rng) -> Vec<Vec2> {
    let n = outline.len();
    let mut point = |i: usize| {
        let [last, here, next] = [outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]];
        let [one, other] = [here - last, next - here].map(|way| way.perp().normalize_or_zero());
        here + (one + other) * (GAP * rng.range(0.55, 1.5) / (1.0 + one.dot(other)).max(0.5))
    };
    (0..n).map(&mut point).collect()
}

/// A polygon some of whose corners have broken off.
fn blunt(corners: &[Vec2], rng: &mut Rng) -> Vec<Vec2> {
    let n = corners.len();
    let often = 0.15 + 0.75 * rng.unit() * rng.unit();
    let mut cut = |i: usize| {
        let [last, here, next] = [corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]];
        let share = if rng.unit() < often { rng.range(0.12, 0.42) } else { rng.range(0.06, 0.14) };
        let other = share * rng.range(0.5, 1.4);
        [here.lerp(last, share), here.lerp(next, other)]
    };
    (0..n).flat_map(&mut cut).collect()
}

/// A closed line through corners whose sides are worn back unevenly, by midpoint displacement. It hardly comes nearer to
/// those beside it, so no gap is closed in part.
fn rough(corners: &[Vec2], rng: &mut Rng) -> Vec<Vec2> {
    let mut points = corners.to_vec();
    for round in 0..3 {
        let share = 0.06 * [1.0, 0.85, 0.75][round];
        let next: Vec<_> = points.iter().copied().cycle().skip(1).take(points.len()).collect();
        let halves = points.iter().zip(next).flat_map(|(&from, to)| {
            let most = (share * from.distance(to)).min(ROUGH);
            let aside = (to - from).perp().normalize_or_zero() * (most * rng.range(-0.2, 1.0));
            [from, 0.5 * (from + to) + aside]
        });
        points = halves.collect();
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: &[Vec2]) -> f32 {
        let next = polygon.iter().cycle().skip(1);
        0.5 * polygon.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f32>().abs()
    }

    /// Blocks cover the surface but for the gaps.
    #[test]
    fn blocks_cover_the_surface() {
        for seed in 0..40 {
            let extent = [[1.0, 1.0], [1.5, 1.0], [0.2, 3.0]][seed as usize % 3].into();
            let blocks = wall(extent, &mut Rng::new(seed));
            let areas: Vec<_> = blocks.iter().map(|block| area(block)).collect();
            let whole = extent.element_product() * 1.3 * 1.3;
            let covered = areas.iter().sum::<f32>() / whole;
            assert!((0.7..1.0).contains(&covered), "{covered}");
            let largest = areas.iter().copied().fold(0.0, f32::max);
            assert!(largest < 0.12 && blocks.iter().all(|block| block.len() >= 24), "{seed}: {largest}");
        }
        assert!(wall(Vec2::splat(1e6), &mut Rng::new(1)).len() <= MOST as usize);
        assert!(wall(Vec2::new(1e9, 1e-3), &mut Rng::new(1)).len() <= MOST as usize);
        assert!(wall(Vec2::NAN, &mut Rng::new(1)).is_empty());
    }

    /// No block has a corner that is sharper than it may be, or is thin.
    #[test]
    fn blocks_are_stout() {
        for seed in 0..40 {
            let (mut rng, size) = (Rng::new(seed), [20, 24]);
            let blocks = laid(size, &mut rng);
            let corners = corners(&blocks, size, CELL, &mut rng);
            let cells: usize = blocks.iter().map(|b| (b.high[0] - b.low[0]) * (b.high[1] - b.low[1])).sum();
            assert_eq!(cells, 20 * 24);
            for block in &blocks {
                let [a, b, c, d] = {
                    let sides = block.sides(size);
                    [sides[0][0], sides[0][1], sides[2][1], sides[2][0]].map(|i| corners[i])
                };
                for [last, here, next] in [[d, a, b], [a, b, c], [b, c, d], [c, d, a]] {
                    let [one, other] = [last - here, next - here];
                    let cosine = one.normalize().dot(other.normalize());
                    assert!(cosine.abs() < 0.68 && one.length() > 0.45 * CELL.y, "{seed}: {cosine}");
                }
            }
        }
    }
}
