//! [`solve_correction`]: one surface of a base and the cracks in it.

use super::{
    error::{BlendError, texels},
    slopes::{Slopes, cover, slope_of},
    transform::fast_period,
};
use crate::{
    Grid,
    raster::{SlopeCorrection, TexelRect},
};
use glam::{IVec2, UVec2};

/// How far around the cracks the surface gives way to them, texels.
const MARGIN: u32 = 31;

/// Slopes below this many steps are left out: what is to be painted again would grow for less than an eighth of a step
/// of a byte.
const FAINT: f32 = 1.0;

/// Solves for the slopes that are to be added to the normals of a base once its own relief ends at the cracks, so that
/// they are those of one surface; `None` where there is no crack.
///
/// At a texel of depth `d` the base keeps the share `1 - c` of its slope, where `c` rises from 0 at depth 0 to 1 at 0.3
/// of the deepest. What is taken away is in general the slope of no height. Its nearest one is, by Poisson's equation,
/// in the least rectangle around all texels with a depth above zero, 31 texels more on every side, and what is missing
/// to the next size with a fast transform. Around that rectangle the height of the base is kept; it may reach beyond
/// the field. Slopes of the cracks themselves are those of a height already and are not changed.
///
/// The result depends on the arguments only, whatever was drawn before. `normals` is RGBA8 with +Y up, row-major, of
/// `size` texels; normals that point into the surface count as flat. The field's top left is at `origin` in it.
///
/// See [`SlopeCorrection`] for an example.
///
/// # Errors
/// [`BlendError::Length`] if `normals` does not have four bytes for each texel; [`BlendError::Outside`] if the field
/// does not lie in it.
pub fn solve_correction(
    normals: &[u8],
    size: UVec2,
    origin: UVec2,
    depth: &Grid<u16>,
) -> Result<Option<SlopeCorrection>, BlendError> {
    let normals = texels(normals, size, depth.size(), origin)?;
    let touched = touched(depth);
    if touched.is_empty() {
        return Ok(None);
    }
    let side = |side: u32| fast_period(side as usize + 2 * MARGIN as usize + 1) as u32 - 1;
    let solved = UVec2::new(side(touched.size().x), side(touched.size().y));
    // Where the rectangle begins in the field, or before it.
    let min = touched.min.as_ivec2() - ((solved - touched.size()) / 2).as_ivec2();
    let mut slopes = Slopes::new(solved);
    let first = (touched.min.as_ivec2() - min).as_usizevec2();
    for (y, row) in (touched.min.y as usize..touched.max.y as usize).zip(first.y..) {
        let columns = touched.min.x as usize..touched.max.x as usize;
        let start = (origin.y as usize + y) * size.x as usize + origin.x as usize;
        let base = &normals[start..][columns.clone()];
        let places = slopes.row(row).skip(first.x);
        for ((&depth, &base), i) in depth.row(y)[columns].iter().zip(base).zip(places) {
            if depth > 0 {
                let [right, down] = slope_of(base);
                (slopes.right[i], slopes.down[i]) = (-cover(depth) * right, -cover(depth) * down);
            }
        }
    }
    slopes.correct();
    Ok(Some(clipped(&slopes, solved, min, depth.size())))
}

/// The least rectangle around what is not zero.
fn touched(depth: &Grid<u16>) -> TexelRect {
    let mut rect = TexelRect::default();
    for y in 0..depth.size().y {
        let row = depth.row(y as usize);
        let is_touched = |depth: &u16| *depth > 0;
        if let (Some(first), Some(last)) = (row.iter().position(is_touched), row.iter().rposition(is_touched)) {
            rect = rect.union(TexelRect { min: UVec2::new(first as u32, y), max: UVec2::new(last as u32 + 1, y + 1) });
        }
    }
    rect
}

/// The part of solved slopes that is in a field of `size`, in steps.
fn clipped(slopes: &Slopes, solved: UVec2, min: IVec2, size: UVec2) -> SlopeCorrection {
    let first = min.max(IVec2::ZERO).as_uvec2();
    let last = (min + solved.as_ivec2()).as_uvec2().min(size);
    let mut steps = Grid::new(last - first, [0; 2]);
    let skipped = (first.as_ivec2() - min).as_usizevec2();
    for y in 0..steps.height() {
        let places = slopes.row(y + skipped.y).skip(skipped.x);
        for (steps, i) in steps.row_mut(y).iter_mut().zip(places) {
            let slope = [slopes.right[i], slopes.down[i]].map(|slope| slope / SlopeCorrection::UNIT);
            if slope.iter().any(|slope| slope.abs() >= FAINT) {
                *steps = slope.map(|slope| (slope + 0.5f32.copysign(slope)) as i16);
            }
        }
    }
    SlopeCorrection::new(first, steps)
}
