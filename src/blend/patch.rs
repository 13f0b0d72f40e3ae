//! [`blend_relief`]: a rectangle of heights into a normal map.

use super::{
    NormalBlending,
    error::{BlendError, texels},
    slopes::{Slopes, bounded, normal_of, slope_of},
    solve::check,
};
use crate::{Grid, math::smooth, raster::TexelRect};
use glam::UVec2;

/// A rectangle of heights that is to be blended into a normal map.
#[derive(Clone, Copy, Debug)]
pub struct ReliefPatch<'a> {
    /// Heights, up, texels; of any mean.
    pub height: &'a Grid<f32>,
    /// How far the map's own relief ends in the patch at each texel, 0..=1 (values outside count as the nearest), of the
    /// size of the heights; `None` = 1 everywhere. Only [`NormalBlending::Poisson`] uses it.
    pub cover: Option<&'a Grid<f32>>,
    /// Its top left in the normal map, texels.
    pub origin: UVec2,
}

/// Blends a patch into a normal map in place, and returns the rectangle that has changed.
///
/// `normals` is RGBA8 with +Y up, row-major, of `size` texels. Normals that point into the surface count as flat. Alpha
/// is kept. The slopes of the patch are those of Sobel's operator, its border repeated.
///
/// With [`NormalBlending::Poisson`] the slopes of the map, less their covered share, and those of the patch are together
/// the guidance. In the outer 8 texels of the patch (or half of its shorter side, if that is less) it passes smoothly
/// from the map's slopes to that. The height with the nearest slopes is solved in the rectangle of the patch, while around
/// it the height of the map is kept. Nothing outside of the patch changes. Every normal in the patch has length one.
///
/// Differs from the paper: the passage, without which the height has no step at the border but its slopes do.
///
/// Paper: Pérez, Gangnet and Blake 2003, "Poisson Image Editing", eq. 3, 9 and 11, with heights for the image.
///
/// # Errors
/// [`BlendError::Length`] if `normals` does not have four bytes for each texel; [`BlendError::Outside`] if the patch
/// does not lie in it; [`BlendError::Cover`] if the cover has another size than the heights; [`BlendError::NotFinite`]
/// for a height or a cover that is not finite or beyond ±1e20. The map is unchanged then. A patch without texels is no
/// error.
pub fn blend_relief(
    normals: &mut [u8],
    size: UVec2,
    patch: &ReliefPatch<'_>,
    blending: NormalBlending,
) -> Result<TexelRect, BlendError> {
    let ReliefPatch { height, cover, origin } = *patch;
    let part = height.size();
    texels(normals, size, part, origin)?;
    if let Some(cover) = cover {
        if cover.size() != part {
            return Err(BlendError::Cover { cover: cover.size(), height: part });
        }
        check(cover)?;
    }
    check(height)?;
    let rect = TexelRect { min: origin, max: origin + part };
    if rect.is_empty() {
        return Ok(TexelRect::default());
    }
    let own = slopes_of(height);
    let mut added = Slopes::new(part);
    let texels = normals.as_chunks_mut().0;
    let place = |y: usize| (origin.y as usize + y) * size.x as usize + origin.x as usize;
    if blending == NormalBlending::Poisson {
        for y in 0..height.height() {
            let base = texels[place(y)..].iter();
            for ((x, i), base) in own.row(y).enumerate().zip(base) {
                let cover = cover.map_or(1.0, |cover| cover.row(y)[x].clamp(0.0, 1.0));
                let ([right, down], inside) = (slope_of(*base), inside(part, x, y));
                added.right[i] = inside * (own.right[i] - cover * right);
                added.down[i] = inside * (own.down[i] - cover * down);
            }
        }
        let guidance = [added.right.clone(), added.down.clone()];
        added.correct();
        for (added, guidance) in [&mut added.right, &mut added.down].into_iter().zip(guidance) {
            added.iter_mut().zip(guidance).for_each(|(added, guidance)| *added += guidance);
        }
    }
    for y in 0..height.height() {
        for (texel, i) in texels[place(y)..].iter_mut().zip(own.row(y)) {
            let [right, down] = slope_of(*texel);
            let slope = match blending {
                NormalBlending::Plain => [right + own.right[i], down + own.down[i]],
                NormalBlending::Whiteout => whiteout([right, down], [own.right[i], own.down[i]]),
                NormalBlending::Poisson => [right + added.right[i], down + added.down[i]],
            };
            *texel = normal_of(slope, texel[3]);
        }
    }
    Ok(rect)
}

/// Width of the border in which the guidance passes from the map to the patch, texels: narrower ones show as a crease,
/// wider ones take more of the patch.
const PASSAGE: f32 = 8.0;

/// How far a texel is inside of a patch of this size, 0..=1, across the passage.
fn inside(size: UVec2, x: usize, y: usize) -> f32 {
    let from_border = |at: usize, side: u32| (at as f32 + 0.5).min(side as f32 - at as f32 - 0.5);
    let nearest = from_border(x, size.x).min(from_border(y, size.y));
    let share = (nearest / PASSAGE.min(0.5 * size.min_element() as f32)).min(1.0);
    smooth(share)
}

/// The slope of the sum of the horizontal parts of two unit normals, over the product of the vertical ones.
fn whiteout(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    let [length_a, length_b] = [a, b].map(|[right, down]| (right * right + down * down + 1.0).sqrt());
    std::array::from_fn(|axis| a[axis] * length_b + b[axis] * length_a)
}

/// The slopes of heights by Sobel's operator.
fn slopes_of(height: &Grid<f32>) -> Slopes {
    let (width, rows) = (height.width(), height.height());
    let mut out = Slopes::new(height.size());
    for y in 0..rows {
        let [above, here, below] = [y.saturating_sub(1), y, (y + 1).min(rows - 1)].map(|y| height.row(y));
        for (x, i) in out.row(y).enumerate() {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            // Down the slope: a wall that descends to the right leans to the right.
            let fall = |row: &[f32]| row[left] - row[right];
            out.right[i] = bounded((fall(above) + 2.0 * fall(here) + fall(below)) * 0.125);
            let fall = |x: usize| above[x] - below[x];
            out.down[i] = bounded((fall(left) + 2.0 * fall(x) + fall(right)) * 0.125);
        }
    }
    out
}
