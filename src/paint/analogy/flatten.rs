//! Takes slow shading out of a photograph.

use crate::Grid;
use glam::{UVec2, Vec2Swizzles};

/// Box filters one after the other: three come close to a Gaussian.
const ROUNDS: usize = 3;

/// The photograph less what changes slowly, plus its mean: the colour of each texel less the mean of those up to about
/// `radius` around it. Alpha stays as it is.
pub(super) fn flatten(picture: &Grid<[u8; 4]>, radius: u32, wraps: bool) -> Grid<[u8; 4]> {
    let (size, mut out) = (picture.size(), picture.clone());
    for channel in 0..3 {
        let values: Vec<u8> = picture.as_slice().iter().map(|texel| texel[channel]).collect();
        let mean = values.iter().map(|&value| u64::from(value)).sum::<u64>() as f64 / values.len().max(1) as f64;
        let mut slow: Vec<f32> = values.iter().map(|&value| f32::from(value)).collect();
        for _ in 0..ROUNDS {
            slow = box_filter(&transposed(&slow, size), size.yx(), radius, wraps);
            slow = box_filter(&transposed(&slow, size.yx()), size, radius, wraps);
        }
        for ((texel, value), slow) in out.as_mut_slice().iter_mut().zip(values).zip(slow) {
            texel[channel] = (f32::from(value) - slow + mean as f32 + 0.5).clamp(0.0, 255.0) as u8;
        }
    }
    out
}

fn transposed(values: &[f32], size: UVec2) -> Vec<f32> {
    let (w, h) = (size.x as usize, size.y as usize);
    (0..w).flat_map(|x| (0..h).map(move |y| values[y * w + x])).collect()
}

/// Means along rows; beyond the borders the nearest value counts, or that of the opposite border.
fn box_filter(values: &[f32], size: UVec2, radius: u32, wraps: bool) -> Vec<f32> {
    let (w, radius) = (size.x as usize, i64::from(radius));
    let mut out = Vec::with_capacity(values.len());
    for row in values.chunks_exact(w.max(1)) {
        let at = |x: i64| {
            let x = if wraps { x.rem_euclid(w as i64) } else { x.clamp(0, w as i64 - 1) };
            f64::from(row[x as usize])
        };
        let mut sum: f64 = (-radius..=radius).map(at).sum();
        for x in 0..w as i64 {
            out.push((sum / (2 * radius + 1) as f64) as f32);
            sum += at(x + radius + 1) - at(x - radius);
        }
    }
    out
}
