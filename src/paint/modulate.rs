//! Rendering by modulation (Mould 2005, section 5.2): [`modulate`].

use super::LookError;
use crate::{
    math::ops,
    raster::{DepthField, MAX_DISTANCE, crack_distance},
};

/// How a picture darkens or brightens towards a crack (Mould 2005, section 5.2, eq. 3).
///
/// ```text
/// I_out = tone + (I_in - tone) * (1 - exp(-d / τ))
/// ```
///
/// `d` is the distance to the nearest crack. A black tone gives the paper's equation. Another tone gives bright
/// cracks, as in ice or mirrors, which the paper's equation cannot. Differs from the paper: it prints `exp(τ d)`,
/// which falls with the distance only for a negative `τ`.
///
/// ```
/// use bevy_crack::{paint::{Modulation, modulate}, pattern::SurfaceFrame, raster::DepthField};
///
/// let mut field = DepthField::new(SurfaceFrame::new([5, 5].into())?);
/// field.depth.row_mut(2)[2] = 65535;
/// let mut picture = vec![200; 5 * 5 * 4];
/// modulate(&mut picture, &field, &Modulation { fade: 0.2, ..Modulation::DARK })?;
/// let crack = 4 * (2 * 5 + 2);
/// assert_eq!(picture[crack..crack + 4], [0, 0, 0, 200]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Modulation {
    /// `τ`, pattern units, 0.0001..=0.2: the distance at which the influence of a crack has fallen to about a third.
    /// Default 0.005.
    pub fade: f32,
    /// Colour of the crack itself, sRGB 0..=1; default black.
    pub tone: [f32; 3],
    /// Depth from which a texel counts as crack, 0..=1; default 0.08, so that thin cracks have no gaps.
    pub depth: f32,
}

impl Modulation {
    /// Dark cracks.
    pub const DARK: Self = Self { fade: 0.005, tone: [0.0; 3], depth: 0.08 };

    /// Bright cracks, as in ice.
    pub const BRIGHT: Self = Self { tone: [0.93, 0.97, 1.0], ..Self::DARK };
}

impl Default for Modulation {
    fn default() -> Self {
        Self::DARK
    }
}

/// Influence that is too small to change a byte.
const NOTHING: f32 = 1.0 / 512.0;

/// Modulates `picture` (RGBA8 of the size of the field, row-major) by the distance to the cracks of `field`.
///
/// Texels out of reach of a crack do not change, nor does alpha. A slice that is shorter than the field is left
/// unchanged.
///
/// # Errors
/// [`LookError::OutOfRange`] if a number is out of its range or not finite.
pub fn modulate(picture: &mut [u8], field: &DepthField, modulation: &Modulation) -> Result<(), LookError> {
    let Modulation { fade, tone, depth } = *modulation;
    super::range::within("fade", fade, 0.0001..=0.2, "0.0001..=0.2")?;
    super::range::within("depth", depth, 0.0..=1.0, "0..=1")?;
    for channel in tone {
        super::range::within("tone", channel, 0.0..=1.0, "0..=1")?;
    }
    let texels = picture.as_chunks_mut::<4>().0;
    if texels.len() < field.depth.as_slice().len() {
        return Ok(());
    }
    let fade = fade * field.frame.texels_per_unit();
    // Squared distances are whole numbers: a table of influence by squared distance, up to where it ends.
    let influence = |square: usize| ops::exp(-(square as f32).sqrt() / fade);
    let farthest = usize::from(MAX_DISTANCE);
    let reach = (0..farthest).find(|&d| influence((d + 1) * (d + 1)) < NOTHING).unwrap_or(farthest);
    let table: Vec<f32> = (0..=reach * reach).map(influence).collect();
    let tone = tone.map(|channel| channel * 255.0);
    let distance = crack_distance(field, ((depth * 65535.0) as u16).max(1), reach as u8);
    for (texel, &distance) in texels.iter_mut().zip(distance.as_slice()) {
        if distance.is_finite() {
            let share = table[(distance * distance + 0.5) as usize];
            for (channel, tone) in texel.iter_mut().zip(tone) {
                let value = f32::from(*channel);
                *channel = (value + (tone - value) * share + 0.5) as u8;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pattern::SurfaceFrame;

    #[test]
    fn values_are_those_of_the_equation() {
        let mut field = DepthField::new(SurfaceFrame::new([100, 100].into()).unwrap());
        field.depth.row_mut(50)[50] = 65535;
        let mut picture = [200, 100, 50, 77].repeat(100 * 100);
        modulate(&mut picture, &field, &Modulation { fade: 0.05, ..Modulation::DARK }).unwrap();
        for (i, texel) in picture.as_chunks::<4>().0.iter().enumerate() {
            let (dx, dy) = ((i % 100) as f64 - 50.0, (i / 100) as f64 - 50.0);
            let keep = 1.0 - (-(dx * dx + dy * dy).sqrt() / 5.0).exp();
            for (got, whole) in texel.iter().zip([200.0, 100.0, 50.0]) {
                assert!((f64::from(*got) - whole * keep).abs() <= 1.0, "{got} at {dx}, {dy}");
            }
            assert_eq!(texel[3], 77);
        }
        let mut bright = [10, 20, 30, 255].repeat(100 * 100);
        modulate(&mut bright, &field, &Modulation::BRIGHT).unwrap();
        assert_eq!(bright[4 * 5050..4 * 5050 + 3], [237, 247, 255]);
        assert_eq!(bright[..4], [10, 20, 30, 255]);
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        let field = DepthField::new(SurfaceFrame::new([4, 4].into()).unwrap());
        let refused = |modulation: Modulation| match modulate(&mut [0; 64], &field, &modulation) {
            Err(LookError::OutOfRange { field, .. }) => Some(field),
            _ => None,
        };
        for bad in [-1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(refused(Modulation { fade: bad, ..Modulation::DARK }), Some("fade"));
            assert_eq!(refused(Modulation { depth: bad, ..Modulation::DARK }), Some("depth"));
            assert_eq!(refused(Modulation { tone: [0.0, bad, 0.0], ..Modulation::DARK }), Some("tone"));
        }
        assert_eq!(refused(Modulation::DARK), None);
        assert!(modulate(&mut [0; 8], &field, &Modulation::DARK).is_ok(), "too short a slice is left alone");
    }
}
