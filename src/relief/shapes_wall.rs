//! Blocks of a rock wall: [`wall`].

use crate::math::{Rng, ops};
use glam::Vec2;

/// How much wider than high blocks are.
const FLAT: f32 = 1.5;

/// Height up to which beds are cut across, pattern units.
const TALL: f32 = 0.34;

/// Area of a middling block, square pattern units.
const AREA: f32 = 0.034;

/// Half of the gap between middling blocks, pattern units.
const GAP: f32 = 0.0042;

/// How far sides are uneven, pattern units.
const ROUGH: f32 = 0.0045;

/// Most blocks.
const MOST: usize = 8192;

/// Most cuts on the way to a block.
const CUTS: u32 = 24;

/// How stout blocks are at least, if what they are cut from is.
const STOUT: f32 = 0.17;

/// How often a cut is tried that would leave a splinter.
const TRIES: u32 = 8;

/// Blocks of many sizes, with gaps between them: rock that is cut again and again, along its beds and across.
///
/// A cut ends at those before it, as joints in rock do.
pub(super) fn wall(extent: Vec2, rng: &mut Rng) -> Vec<Vec<Vec2>> {
    let dip = 0.16 * rng.signed();
    let (low, high) = (-0.15 * extent, 1.15 * extent);
    let whole = vec![low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)];
    let mut open = vec![(whole, CUTS)];
    let mut blocks = Vec::new();
    while let Some((cell, cuts)) = open.pop() {
        let least = AREA * (0.35 + 1.9 * rng.unit() * rng.unit());
        if cuts == 0 || area(&cell) < least || blocks.len() + open.len() >= MOST {
            blocks.push(cell);
            continue;
        }
        // The first cuts are the widest.
        let gap = GAP * rng.range(0.35, 1.0) * if cuts + 5 > CUTS { 1.6 } else { 1.0 };
        let halves = (0..TRIES).find_map(|k| {
            let (from, along) = line(&cell, dip, k >= TRIES / 2, rng);
            let halves = [side(&cell, from, along.perp(), gap), side(&cell, from, -along.perp(), gap)];
            let least = STOUT.min(stoutness(&cell));
            halves.iter().all(|half| stoutness(half) > least).then_some(halves)
        });
        match halves {
            Some(halves) => open.extend(halves.map(|half| (half, cuts - 1))),
            None => blocks.push(cell),
        }
    }
    blocks.iter().map(|cell| rough(&blunt(cell, rng), rng)).collect()
}

/// Where a cell is cut: across if it is wide, else along the beds. Blocks are to be wide, or as wide as high.
fn line(cell: &[Vec2], dip: f32, is_square: bool, rng: &mut Rng) -> (Vec2, Vec2) {
    let low = cell.iter().fold(Vec2::MAX, |low, point| low.min(*point));
    let high = cell.iter().fold(Vec2::MIN, |high, point| high.max(*point));
    let size = high - low;
    // Beds run through, joints end at them.
    let flat = if size.y > TALL { 3.0 * FLAT } else { FLAT };
    let is_across = if is_square { size.x > size.y } else { size.x > size.y * flat * rng.range(0.7, 1.3) };
    let from = low + size * Vec2::new(rng.range(0.3, 0.7), rng.range(0.3, 0.7));
    let is_aslant = rng.unit() < 0.22;
    let turn = rng.signed()
        * if is_aslant {
            0.65
        } else if is_across {
            0.22
        } else {
            0.09
        };
    let quarter = if is_across { 0.5 * std::f32::consts::PI } else { 0.0 };
    (from, ops::unit(dip + quarter + turn))
}

/// The part of a polygon on the far side of a line, less a gap.
fn side(polygon: &[Vec2], from: Vec2, away: Vec2, gap: f32) -> Vec<Vec2> {
    let out = |point: Vec2| gap - (point - from).dot(away);
    let next = polygon.iter().cycle().skip(1);
    let sides = polygon.iter().zip(next).flat_map(|(&from, &to)| {
        let (a, b) = (out(from), out(to));
        let kept = (a <= 0.0).then_some(from);
        let crossing = ((a <= 0.0) != (b <= 0.0)).then(|| from + (to - from) * (a / (a - b)));
        [kept, crossing]
    });
    sides.flatten().collect()
}

fn area(polygon: &[Vec2]) -> f32 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f32>().abs()
}

/// The area of a polygon as a share of the square of its longest way: 0.5 for a square, near 0 for a splinter.
fn stoutness(polygon: &[Vec2]) -> f32 {
    let low = polygon.iter().fold(Vec2::MAX, |low, point| low.min(*point));
    let high = polygon.iter().fold(Vec2::MIN, |high, point| high.max(*point));
    if polygon.len() > 2 { area(polygon) / (high - low).length_squared() } else { 0.0 }
}

/// A polygon some of whose corners have broken off.
fn blunt(corners: &[Vec2], rng: &mut Rng) -> Vec<Vec2> {
    let n = corners.len();
    let cut = |i: usize| {
        let [last, here, next] = [corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]];
        let share = if rng.unit() < 0.4 { rng.range(0.12, 0.32) } else { 0.05 };
        let other = share * rng.range(0.5, 1.4);
        [here.lerp(last, share), here.lerp(next, other)]
    };
    (0..n).flat_map(cut).collect()
}

/// A closed line through corners whose sides are uneven, by midpoint displacement.
fn rough(corners: &[Vec2], rng: &mut Rng) -> Vec<Vec2> {
    let mut points = corners.to_vec();
    for round in 0..3 {
        let share = 0.06 * [1.0, 0.85, 0.75][round];
        let next: Vec<_> = points.iter().copied().cycle().skip(1).take(points.len()).collect();
        let halves = points.iter().zip(next).flat_map(|(&from, to)| {
            let most = (share * from.distance(to)).min(ROUGH);
            let aside = (to - from).perp().normalize_or_zero() * (most * rng.signed());
            [from, 0.5 * (from + to) + aside]
        });
        points = halves.collect();
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks cover the surface but for the gaps, and none is a splinter or much larger than the others.
    #[test]
    fn blocks_cover_the_surface() {
        for seed in 0..40 {
            let extent = [[1.0, 1.0], [1.5, 1.0], [0.2, 3.0]][seed as usize % 3].into();
            let blocks = wall(extent, &mut Rng::new(seed));
            let areas: Vec<_> = blocks.iter().map(|block| area(block)).collect();
            let whole = extent.element_product() * 1.3 * 1.3;
            let covered = areas.iter().sum::<f32>() / whole;
            assert!((0.75..1.0).contains(&covered), "{covered}");
            let largest = areas.iter().copied().fold(0.0, f32::max);
            assert!(largest < 5.0 * AREA && blocks.iter().all(|block| block.len() >= 24), "{seed}: {largest}");
        }
        assert!(wall(Vec2::splat(1e6), &mut Rng::new(1)).len() <= MOST + 1);
        wall(Vec2::NAN, &mut Rng::new(1));
    }
}
