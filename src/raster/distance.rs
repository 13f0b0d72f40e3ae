//! Distance to the nearest crack, exact within reach.
//!
//! Columns first: how far up or down the nearest crack is, in two sweeps of whole rows. Then along each row the least of
//! `dx² + dy²` over the texels within reach, 16 bits each: that has no branches, and blocks without a crack in reach are left out.

use super::DepthField;
use crate::Grid;

/// The farthest reach of [`crack_distance`], texels: squares stay below 2¹⁵.
pub const MAX_DISTANCE: u8 = 127;

/// Texels whose distances are computed at once.
const BLOCK: usize = 32;

/// Distance from each texel's centre to that of the nearest texel at least `depth` deep, texels.
///
/// Exact up to `reach` (cut to [`MAX_DISTANCE`]); `f32::INFINITY` beyond.
///
/// ```
/// use bevy_crack::{pattern::SurfaceFrame, raster::{DepthField, crack_distance}};
///
/// let mut field = DepthField::new(SurfaceFrame::new([4, 3].into())?);
/// field.depth.row_mut(0)[0] = 40_000;
/// let distance = crack_distance(&field, 30_000, 2);
/// assert_eq!(distance.row(0), [0.0, 1.0, 2.0, f32::INFINITY]);
/// assert_eq!(distance.get(1, 1), Some(2.0f32.sqrt()));
/// # Ok::<(), bevy_crack::pattern::FrameError>(())
/// ```
#[must_use]
pub fn crack_distance(field: &DepthField, depth: u16, reach: u8) -> Grid<f32> {
    let reach = reach.min(MAX_DISTANCE);
    let (w, h) = (field.depth.width(), field.depth.height());
    let (mut columns, mut near) = (vec![reach + 1; w], vec![false; h]);
    // How far the nearest crack is in each column, 0..=reach + 1: first from above, then from below too.
    let mut vertical = Grid::new(field.depth.size(), 0u8);
    for (y, near) in near.iter_mut().enumerate() {
        // Three loops, each of one width of numbers.
        let out = vertical.row_mut(y);
        for (out, &texel) in out.iter_mut().zip(field.depth.row(y)) {
            *out = if texel >= depth { 0 } else { reach + 1 };
        }
        for (column, out) in columns.iter_mut().zip(out.iter_mut()) {
            *out = (*column + 1).min(*out);
            *column = *out;
        }
        *near = out.iter().fold(u8::MAX, |least, &value| least.min(value)) <= reach;
    }
    columns.fill(reach + 1);
    let mut distance = Grid::new(field.depth.size(), f32::INFINITY);
    let margin = usize::from(reach);
    // Squares of a row with a margin on either side, and to whole blocks.
    let mut squares = vec![far_square(reach); w.next_multiple_of(BLOCK) + 2 * margin];
    for y in (0..h).rev() {
        for (column, &above) in columns.iter_mut().zip(vertical.row(y)) {
            *column = (*column + 1).min(above);
        }
        for (square, &column) in squares[margin..].iter_mut().zip(&columns) {
            *square = i16::from(column) * i16::from(column);
        }
        let least = columns.iter().fold(u8::MAX, |least, &value| least.min(value));
        if near[y] || least <= reach {
            across(&squares, reach, distance.row_mut(y));
        }
    }
    distance
}

/// Square of a distance out of reach.
fn far_square(reach: u8) -> i16 {
    (i16::from(reach) + 1) * (i16::from(reach) + 1)
}

/// The least of `squares + dx²` over all `dx` within reach, as distances. `squares` has a margin of `reach`.
fn across(squares: &[i16], reach: u8, out: &mut [f32]) {
    let (margin, limit) = (usize::from(reach), i16::from(reach) * i16::from(reach));
    for (i, out) in out.chunks_mut(BLOCK).enumerate() {
        let window = &squares[i * BLOCK..(i + 1) * BLOCK + 2 * margin];
        let lowest = window.iter().fold(i16::MAX, |least, &square| if square < least { square } else { least });
        if lowest > limit {
            continue;
        }
        // Left and right at once; `off` cannot overflow, as squares are at most 2¹⁴.
        let mut best = [i16::MAX; BLOCK];
        let shifted = |k: usize| window[k..].first_chunk::<BLOCK>();
        for dx in 0..=margin {
            let off = (dx * dx) as i16;
            if let (Some(left), Some(right)) = (shifted(margin - dx), shifted(margin + dx)) {
                for ((best, &left), &right) in best.iter_mut().zip(left).zip(right) {
                    let square = if left < right { left } else { right } + off;
                    *best = if square < *best { square } else { *best };
                }
            }
        }
        for (out, &best) in out.iter_mut().zip(&best) {
            *out = if best <= limit { f32::from(best).sqrt() } else { f32::INFINITY };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::Rng, pattern::SurfaceFrame};

    /// Every texel against every other.
    fn slow(field: &DepthField, depth: u16, reach: u8) -> Vec<f32> {
        let size = field.depth.size();
        let all = || (0..size.y as i64).flat_map(|y| (0..size.x as i64).map(move |x| (x, y)));
        let cracks: Vec<_> =
            all().filter(|&(x, y)| field.depth.get(x as u32, y as u32).is_some_and(|d| d >= depth)).collect();
        let nearest = |(x, y): (i64, i64)| {
            let least = cracks.iter().map(|&(cx, cy)| (cx - x).pow(2) + (cy - y).pow(2)).min();
            least.filter(|&d| d <= i64::from(reach).pow(2)).map_or(f32::INFINITY, |d| (d as f32).sqrt())
        };
        all().map(nearest).collect()
    }

    #[test]
    fn distances_equal_those_to_every_crack() {
        let mut rng = Rng::new(9);
        for size in [[1, 1], [1, 90], [200, 1], [63, 40], [64, 64], [65, 17], [150, 90]] {
            for share in [0.0, 0.002, 0.05, 1.0] {
                let mut field = DepthField::new(SurfaceFrame::new(size.into()).unwrap());
                for depth in field.depth.as_mut_slice() {
                    *depth = if rng.unit() < share { 40_000 } else { (rng.next_u32() % 30_000) as u16 };
                }
                for reach in [0, 1, 5, 16, 127, 255] {
                    let want = slow(&field, 30_000, reach.min(127));
                    assert!(crack_distance(&field, 30_000, reach).as_slice() == want, "{size:?} {share} {reach}");
                }
            }
        }
    }
}
