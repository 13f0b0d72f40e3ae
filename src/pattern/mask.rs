//! [`CrackMask`]: where cracks prefer to run, avoid to run, and never run.

use super::lines::{self, lightness};
use crate::Grid;
use glam::{UVec2, Vec2};

/// Where cracks prefer to run, avoid to run, and never run; each as values of 0..=1 over the whole surface.
///
/// The layers may have any size, each its own: they are sampled by texture coordinates (0..1, v down). A missing
/// layer counts as 0 everywhere; NaN counts as 0 too. By default there is no layer.
///
/// ```
/// use bevy_crack::pattern::CrackMask;
///
/// // Two rows of texels: the upper one weak, the lower one forbidden.
/// let mask = CrackMask {
///     weak: Some(CrackMask::layer([1, 2].into(), &[255, 0])?),
///     forbidden: Some(CrackMask::layer([1, 2].into(), &[0, 255])?),
///     ..CrackMask::default()
/// };
/// assert_eq!(mask.weak_at([0.5, 0.25].into()), 1.0);
/// assert_eq!(mask.weak_at([0.5, 0.5].into()), 0.5);
/// assert!(!mask.is_forbidden([0.5, 0.49].into()));
/// assert!(mask.is_forbidden([0.5, 0.51].into()));
/// assert!(mask.blocks([0.2, 0.1].into(), [0.3, 0.9].into()));
/// // Layers that are not there: nothing is strong, and markers are everywhere.
/// assert_eq!((mask.strong_at([0.5, 0.5].into()), mask.density_at([0.5, 0.5].into())), (0.0, 1.0));
/// assert!(!mask.is_empty() && CrackMask::default().is_empty());
/// # Ok::<(), bevy_crack::pattern::MaskError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CrackMask {
    /// Where cracks prefer to run: mortar, painted lines. Sampled between texels (bilinear).
    pub weak: Option<Grid<f32>>,
    /// What cracks avoid. Sampled between texels (bilinear).
    pub strong: Option<Grid<f32>>,
    /// Where no crack ever runs: frames, transparent texels. Sampled texel by texel (nearest); above 0.5 is
    /// forbidden.
    pub forbidden: Option<Grid<f32>>,
    /// How densely cracks grow: the share of the markers that are kept, 0..=1, a layer that is not there counting as 1. Read texel by texel
    /// (nearest). Cracks that have begun may run on into places without markers.
    pub density: Option<Grid<f32>>,
}

/// Texels that make no layer of a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "mask of {width} x {height} texels, {length} bytes: sides must lie in 1..=16384, with one or four bytes a texel"
)]
/// Texels that do not form a layer of a mask.
pub struct MaskError {
    /// Width given, in texels.
    pub width: u32,
    /// Height given, in texels.
    pub height: u32,
    /// Bytes given.
    pub length: usize,
}

impl CrackMask {
    /// A layer from 8-bit texels, row after row: one byte each (0 = 0, 255 = 1), or four (sRGB and alpha: lightness
    /// as stored, times alpha).
    ///
    /// # Errors
    /// [`MaskError`] if the number of bytes does not match the size, or a side is 0 or above
    /// [`MAX_SIDE`](super::MAX_SIDE).
    pub fn layer(size: UVec2, texels: &[u8]) -> Result<Grid<f32>, MaskError> {
        let values = match bytes_per_texel(size, texels)? {
            1 => texels.iter().map(|&texel| f32::from(texel) / 255.0).collect(),
            _ => {
                texels.as_chunks::<4>().0.iter().map(|&texel| lightness(texel) * f32::from(texel[3]) / 255.0).collect()
            }
        };
        grid(size, values, texels)
    }

    /// A mask from a picture's RGBA texels: [`weak_from_picture`](Self::weak_from_picture) and
    /// [`forbidden_from_alpha`](Self::forbidden_from_alpha).
    ///
    /// ```
    /// use bevy_crack::pattern::CrackMask;
    ///
    /// // Dark tiles with light joints; the right half is transparent.
    /// let size = 256u32;
    /// let texel = |x: u32, y: u32| match (x % 64 < 4 || y % 64 < 4, x < 128) {
    ///     (true, true) => [220, 220, 220, 255],
    ///     (false, true) => [60, 60, 60, 255],
    ///     (_, false) => [0; 4],
    /// };
    /// let rgba: Vec<u8> = (0..size * size).flat_map(|i| texel(i % size, i / size)).collect();
    /// let mask = CrackMask::from_picture([size, size].into(), &rgba)?;
    /// let at = |x: f32, y: f32| [x / 256.0, y / 256.0].into();
    /// assert!(mask.weak_at(at(66.0, 32.0)) > mask.weak_at(at(96.0, 32.0)));
    /// assert!(mask.is_forbidden(at(200.0, 32.0)) && !mask.is_forbidden(at(96.0, 32.0)));
    /// // The same, layer by layer.
    /// assert_eq!(mask.weak, CrackMask::weak_from_picture([size, size].into(), &rgba)?);
    /// assert_eq!(mask.forbidden, CrackMask::forbidden_from_alpha([size, size].into(), &rgba)?);
    /// # Ok::<(), bevy_crack::pattern::MaskError>(())
    /// ```
    ///
    /// # Errors
    /// [`MaskError`] if there are not four bytes per texel, or a side is 0 or above [`MAX_SIDE`](super::MAX_SIDE).
    pub fn from_picture(size: UVec2, rgba: &[u8]) -> Result<Self, MaskError> {
        Ok(Self {
            weak: Self::weak_from_picture(size, rgba)?,
            strong: None,
            forbidden: Self::forbidden_from_alpha(size, rgba)?,
            density: None,
        })
    }

    /// The lines of a picture: mortar, joints of tiles and planks, painted lines, old cracks.
    ///
    /// A line is lighter (or darker) than the picture on *both* its sides, over a length; an edge alone is not a
    /// line. Or it has less colour (or more) than both its sides, as mortar in the shadow of red bricks. Each picture has
    /// lines of one kind: by colour only if these cover half as much again as those by lightness. A texture without
    /// joints has as many light lines as dark ones. So only responses of the stronger kind count that exceed the
    /// strongest few of the weaker kind. The result is `None` if no long line is left. Lines are searched for at a
    /// shorter side of 256 texels, at widths of 1 to 8 of them; this takes about 30 ms, and twice that if the picture
    /// has colours.
    ///
    /// # Errors
    /// [`MaskError`] if there are not four bytes per texel, or a side is 0 or above [`MAX_SIDE`](super::MAX_SIDE).
    pub fn weak_from_picture(size: UVec2, rgba: &[u8]) -> Result<Option<Grid<f32>>, MaskError> {
        four_bytes_per_texel(size, rgba)?;
        Ok(lines::find(size, rgba))
    }

    /// A layer that forbids the texels that are less than half opaque; `None` if there are none.
    ///
    /// # Errors
    /// [`MaskError`] if there are not four bytes per texel, or a side is 0 or above [`MAX_SIDE`](super::MAX_SIDE).
    pub fn forbidden_from_alpha(size: UVec2, rgba: &[u8]) -> Result<Option<Grid<f32>>, MaskError> {
        four_bytes_per_texel(size, rgba)?;
        let values: Vec<f32> = rgba.as_chunks::<4>().0.iter().map(|texel| 1.0 - f32::from(texel[3]) / 255.0).collect();
        if values.iter().all(|&value| value <= 0.5) {
            return Ok(None);
        }
        grid(size, values, rgba).map(Some)
    }

    /// How densely cracks grow at texture coordinates, 0..=1.
    #[must_use]
    pub fn density_at(&self, uv: Vec2) -> f32 {
        let Some(density) = &self.density else { return 1.0 };
        let size = density.size();
        let texel = (uv * size.as_vec2()).max(Vec2::ZERO).as_uvec2().min(size.saturating_sub(UVec2::ONE));
        density.get(texel.x, texel.y).map_or(1.0, |value| if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) })
    }

    /// Whether the mask has no layer that says where cracks run. [`density`](Self::density) does not count.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.weak.is_none() && self.strong.is_none() && self.forbidden.is_none()
    }

    /// How strongly cracks prefer `uv`, 0..=1.
    #[must_use]
    pub fn weak_at(&self, uv: Vec2) -> f32 {
        self.weak.as_ref().map_or(0.0, |layer| bilinear(layer, uv))
    }

    /// How strongly cracks avoid `uv`, 0..=1.
    #[must_use]
    pub fn strong_at(&self, uv: Vec2) -> f32 {
        self.strong.as_ref().map_or(0.0, |layer| bilinear(layer, uv))
    }

    /// Whether no crack may be at `uv`. Beyond the border the nearest texel counts; `false` if `uv` is not finite.
    #[must_use]
    pub fn is_forbidden(&self, uv: Vec2) -> bool {
        self.forbidden.as_ref().is_some_and(|layer| {
            let texel = (uv * layer.size().as_vec2()).floor();
            forbids(layer, texel.x, texel.y)
        })
    }

    /// Whether the straight line from `from` to `to` (both uv) meets a forbidden texel, however short the part inside
    /// it is. Every texel on the line is checked. `false` if a coordinate is not finite.
    #[must_use]
    pub fn blocks(&self, from: Vec2, to: Vec2) -> bool {
        let Some(layer) = &self.forbidden else { return false };
        if !(from.is_finite() && to.is_finite()) {
            return false;
        }
        // Points beyond the border are clamped to it, so that the walk is no longer than the layer's sides.
        let size = layer.size().as_vec2();
        let (from, to) = (from.clamp(Vec2::ZERO, Vec2::ONE) * size, to.clamp(Vec2::ZERO, Vec2::ONE) * size);
        let way = to - from;
        let (mut texel, last) = (from.floor(), to.floor());
        // Fractions of the line at which the next column and the next row begin, and the increments from one to the
        // next.
        let forward = Vec2::new(if way.x < 0.0 { 0.0 } else { 1.0 }, if way.y < 0.0 { 0.0 } else { 1.0 });
        let step = forward * 2.0 - 1.0;
        let pace = way.abs().recip();
        let mut next = (texel + forward - from).abs() * pace;
        let crossings = (last - texel).abs();
        for _ in 0..(crossings.x + crossings.y) as u32 {
            if forbids(layer, texel.x, texel.y) {
                return true;
            }
            // Once the last column is reached the column no longer changes, even if rounding errors say so.
            let is_column = if texel.x == last.x {
                false
            } else if texel.y == last.y {
                true
            } else {
                next.x <= next.y
            };
            if is_column {
                texel.x += step.x;
                next.x += pace.x;
            } else {
                texel.y += step.y;
                next.y += pace.y;
            }
        }
        forbids(layer, last.x, last.y)
    }
}

/// Whether the texel, or the one nearest to it on the surface, is forbidden.
fn forbids(layer: &Grid<f32>, x: f32, y: f32) -> bool {
    let last = layer.size().saturating_sub(UVec2::ONE);
    // The cast maps negative values to zero.
    x.is_finite() && y.is_finite() && layer.get((x as u32).min(last.x), (y as u32).min(last.y)).is_some_and(|v| v > 0.5)
}

/// Interpolates between the centres of the four texels around `uv`; constant beyond the outermost centres.
fn bilinear(layer: &Grid<f32>, uv: Vec2) -> f32 {
    let last = layer.size().saturating_sub(UVec2::ONE);
    let at = (uv * layer.size().as_vec2() - 0.5).clamp(Vec2::ZERO, last.as_vec2());
    if !at.is_finite() {
        return 0.0;
    }
    let low = at.as_uvec2();
    let high = (low + UVec2::ONE).min(last);
    let share = at - low.as_vec2();
    let value = |x: u32, y: u32| layer.get(x, y).filter(|value| *value > 0.0).map_or(0.0, |value| value.min(1.0));
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let (top, bottom) = (
        mix(value(low.x, low.y), value(high.x, low.y), share.x),
        mix(value(low.x, high.y), value(high.x, high.y), share.x),
    );
    mix(top, bottom, share.y)
}

fn bytes_per_texel(size: UVec2, texels: &[u8]) -> Result<usize, MaskError> {
    let count = u64::from(size.x) * u64::from(size.y);
    let fits = size.min_element() > 0 && size.max_element() <= super::MAX_SIDE;
    match texels.len() as u64 {
        length if fits && length == count => Ok(1),
        length if fits && length == 4 * count => Ok(4),
        _ => Err(MaskError { width: size.x, height: size.y, length: texels.len() }),
    }
}

fn four_bytes_per_texel(size: UVec2, rgba: &[u8]) -> Result<(), MaskError> {
    let error = MaskError { width: size.x, height: size.y, length: rgba.len() };
    if bytes_per_texel(size, rgba)? == 4 { Ok(()) } else { Err(error) }
}

fn grid(size: UVec2, values: Vec<f32>, texels: &[u8]) -> Result<Grid<f32>, MaskError> {
    Grid::from_vec(size, values).ok_or(MaskError { width: size.x, height: size.y, length: texels.len() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// Whether a line has a part within a rectangle, by cutting it at the sides.
    fn meets(from: Vec2, to: Vec2, min: Vec2, max: Vec2) -> bool {
        let (mut first, mut last) = (0.0f32, 1.0f32);
        for k in 0..2 {
            let way = to[k] - from[k];
            if way == 0.0 {
                if from[k] < min[k] || from[k] > max[k] {
                    return false;
                }
                continue;
            }
            let [a, b] = [(min[k] - from[k]) / way, (max[k] - from[k]) / way];
            (first, last) = (first.max(a.min(b)), last.min(a.max(b)));
        }
        first <= last
    }

    #[test]
    fn lines_are_blocked_by_the_texels_that_they_cross() {
        let mut rng = Rng::new(5);
        let mut found = [0; 2];
        for _ in 0..4000 {
            let size = UVec2::new(1 + rng.next_u32() % 9, 1 + rng.next_u32() % 9);
            let values: Vec<f32> = (0..size.x * size.y).map(|_| f32::from(u8::from(rng.unit() < 0.15))).collect();
            let layer = Grid::from_vec(size, values).unwrap();
            // Some lines run along the axes, some end beyond the border, where they do not count.
            let mut place = || Vec2::new(rng.range(-0.1, 1.1), rng.range(-0.1, 1.1)).clamp(Vec2::ZERO, Vec2::ONE);
            let (from, mut to) = (place(), place());
            if to.x > 0.8 {
                to.x = from.x;
            } else if to.y > 0.8 {
                to.y = from.y;
            }
            // What a line is blocked by if texels are larger or smaller by this much.
            let blocks = |by: f32| {
                let texels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
                texels.filter(|texel| layer.get(texel.x, texel.y).is_some_and(|value| value > 0.5)).any(|texel| {
                    let min = texel.as_vec2();
                    meets(from * size.as_vec2(), to * size.as_vec2(), min - by, min + 1.0 + by)
                })
            };
            let mask = CrackMask { forbidden: Some(layer.clone()), ..CrackMask::default() };
            let is_blocked = mask.blocks(from, to);
            assert!(is_blocked || !blocks(-1e-3), "{from} {to} crosses {layer:?}");
            assert!(!is_blocked || blocks(1e-3), "{from} {to} crosses nothing of {layer:?}");
            found[usize::from(is_blocked)] += 1;
        }
        assert!(found.iter().all(|&times| times > 800), "{found:?}");
    }
}
