//! Distance to the nearest crack, exact within reach.
//!
//! Columns first: the distance up or down to the nearest crack, in two sweeps over whole rows. Then along each row
//! the smallest `dx² + dy²` over the texels within reach, in 16 bits: this loop has no branches, and blocks without a
//! crack in reach are skipped.

use super::DepthField;
use crate::Grid;

/// The largest reach of [`crack_distance`], texels: squares stay below 2¹⁵.
pub const MAX_DISTANCE: u8 = 127;

/// Texels whose distances are computed at once.
const BLOCK: usize = 32;

/// Distance from each texel's centre to that of the nearest texel at least `depth` deep, texels.
///
/// Exact up to `reach` (clamped to [`MAX_DISTANCE`]); `f32::INFINITY` beyond.
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
    let (size, w, h) = (field.depth.size(), field.depth.width(), field.depth.height());
    // How far the nearest crack is in each column, 0..=reach + 1: first from below, then from above too.
    let mut vertical = Grid::new(size, 0u8);
    let mut columns = vec![reach + 1; w];
    for y in (0..h).rev() {
        let out = vertical.row_mut(y);
        begin(out, field.depth.row(y), depth, reach + 1);
        extend_cracks(&mut columns, out);
        out.copy_from_slice(&columns);
    }
    columns.fill(reach + 1);
    let margin = usize::from(reach);
    // Squares of a row with a margin on either side, and to whole blocks.
    let mut squares = vec![far_square(reach); w.next_multiple_of(BLOCK) + 2 * margin];
    let mut distance = Vec::with_capacity(w * h);
    for y in 0..h {
        extend_cracks(&mut columns, vertical.row(y));
        for (square, &column) in squares[margin..].iter_mut().zip(&columns) {
            *square = i16::from(column) * i16::from(column);
        }
        for x in (0..w).step_by(BLOCK) {
            let block = across(&squares[x..x + BLOCK + 2 * margin], reach);
            distance.extend_from_slice(&block[..BLOCK.min(w - x)]);
        }
    }
    Grid::from_vec(size, distance).unwrap_or_else(|| Grid::new(size, f32::INFINITY))
}

/// 0 where a texel is at least `depth` deep, `far` elsewhere.
// If it is inlined the compiler no longer knows that the slices do not overlap, and does not vectorize.
#[inline(never)]
fn begin(out: &mut [u8], row: &[u16], depth: u16, far: u8) {
    for (out, &texel) in out.iter_mut().zip(row) {
        *out = if texel < depth { far } else { 0 };
    }
}

/// The next row: one step further, or a nearer crack in this row.
#[inline(never)]
fn extend_cracks(columns: &mut [u8], row: &[u8]) {
    for (column, &here) in columns.iter_mut().zip(row) {
        *column = (*column + 1).min(here);
    }
}

/// Square of a distance out of reach.
fn far_square(reach: u8) -> i16 {
    (i16::from(reach) + 1) * (i16::from(reach) + 1)
}

/// Steps to the side between two checks of how far the search must go.
const STRIDE: usize = 4;

/// The least of `squares + dx²` over all `dx` within reach, as distances, for the texels between two margins of `reach`.
fn across(squares: &[i16], reach: u8) -> [f32; BLOCK] {
    let margin = usize::from(reach);
    let limit = i16::from(reach) * i16::from(reach);
    let lowest = squares.iter().fold(i16::MAX, |least, &square| least.min(square));
    let middle = squares[margin..].first_chunk::<BLOCK>().filter(|_| lowest <= limit);
    let Some(mut best) = middle.copied() else { return [f32::INFINITY; BLOCK] };
    let mut dx = 1;
    while dx <= margin {
        // Further away nothing can be less than what every texel has, or within reach.
        let highest = best.iter().fold(0, |most, &square| most.max(square)).min(limit);
        if lowest + (dx * dx) as i16 > highest {
            break;
        }
        let end = (dx + STRIDE).min(margin + 1);
        for dx in dx..end {
            // Left and right at once; the sum cannot overflow, as squares are at most 2¹⁴.
            let off = (dx * dx) as i16;
            let shifted = |k: usize| squares[k..].first_chunk::<BLOCK>();
            if let (Some(left), Some(right)) = (shifted(margin - dx), shifted(margin + dx)) {
                for ((best, &left), &right) in best.iter_mut().zip(left).zip(right) {
                    *best = (left.min(right) + off).min(*best);
                }
            }
        }
        dx = end;
    }
    let mut distances = [0.0; BLOCK];
    for (distance, &best) in distances.iter_mut().zip(&best) {
        *distance = if best <= limit { f32::from(best).sqrt() } else { f32::INFINITY };
    }
    distances
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
