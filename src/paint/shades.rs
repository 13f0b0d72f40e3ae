//! [`Shades`]: cracks in few shades of the picture's own colours, for pixel art.

use super::rows::Rgba;

/// In how many shades cracks show.
///
/// ```
/// use bevy_crack::paint::{Look, Shades};
///
/// let pixel_art = Look { shades: Shades::Steps(4), ..Look::GROOVE };
/// assert_eq!(pixel_art.validate(), Ok(()));
/// assert!(Look { shades: Shades::Steps(0), ..pixel_art }.validate().is_err());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Shades {
    /// In a game, three steps where the surface's picture is shown with its texels as squares (a nearest sampler), else smooth. Without an
    /// engine smooth. The default.
    #[default]
    Auto,
    /// Smooth edges and any colour.
    Smooth,
    /// Whole texels: each is the colour of the picture there, as dark or as light as one of so many steps. 1..=16.
    ///
    /// Draw such cracks with a [`Profile::faintest`](crate::raster::Profile::faintest) of 1, as the plugin does, or those thinner than a texel
    /// are too faint for a step.
    Steps(u8),
}

impl Shades {
    /// The steps of `Auto` where texels are squares.
    #[cfg(feature = "bevy")]
    pub(crate) const PIXELS: u8 = 3;

    /// The most steps.
    pub(super) const MOST: u8 = 16;
}

/// A change of less than this share of a step is not seen.
const LEAST: f32 = 0.3;

/// Lightness of a texel, 0..=2040, by about the weights of the eye.
fn lightness([r, g, b, _]: Rgba) -> f32 {
    f32::from(2 * u16::from(r) + 5 * u16::from(g) + u16::from(b))
}

/// Whole steps: a fine crack that is seen at all is a step.
fn whole(steps: f32) -> f32 {
    if steps.abs() < LEAST { 0.0 } else { steps.abs().round().max(1.0).copysign(steps) }
}

/// Makes painted texels ones of few shades of the base's colours.
pub(super) fn reduce_shades(out: &mut [Rgba], base: &[Rgba], steps: u8) {
    let steps = f32::from(steps);
    for (out, &base) in out.iter_mut().zip(base) {
        if *out == base {
            continue;
        }
        let was = lightness(base);
        let change = if was > 0.0 { whole((lightness(*out) / was - 1.0) * steps) } else { 0.0 };
        // The darkest step is not black.
        let share = (steps + change).max(0.5) / steps;
        let covered = f32::from(out[3].saturating_sub(base[3])) / f32::from(255 - base[3].min(254));
        let alpha = f32::from(base[3]) + whole(covered * steps) / steps * f32::from(255 - base[3]);
        let [r, g, b] = [base[0], base[1], base[2]].map(|channel| (f32::from(channel) * share).round() as u8);
        *out = [r, g, b, if out[3] < base[3] { out[3] } else { alpha.round() as u8 }];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        CrackPreset,
        growth::CrackGrowth,
        math::Rng,
        paint::{BaseTexels, LookTable, PaintTargets, paint_into},
        pattern::{Moment, SurfaceFrame},
        raster::{DepthField, Profile, TexelRect, stamp_path},
    };
    use glam::UVec2;

    /// The diffuse texels of a picture of this preset after a hit, with all that it crushes, in rectangles of some size, and the picture.
    fn cracked(preset: &CrackPreset, shades: Shades, part: u32) -> (Vec<Rgba>, Vec<Rgba>) {
        let size = UVec2::splat(96);
        let mut field = DepthField::new(SurfaceFrame::new(size).unwrap());
        let mut growth = CrackGrowth::new(preset.growth.clone(), field.frame.extent(), 5).unwrap();
        growth.hit([0.5, 0.5].into(), 1.0);
        while growth.step().grew() {}
        let profile = match shades {
            Shades::Steps(_) => Profile { faintest: 1.0, ..preset.profile },
            _ => preset.profile,
        };
        for segment in growth.network().segments() {
            stamp_path(&mut field, &profile, &growth.network().path(segment).unwrap());
        }
        field.set_layers(preset.look.layer(5));
        let moment = Moment::after(growth.timeline().end());
        field.show_layers(growth.network(), growth.timeline(), moment, &mut Vec::new());
        let mut rng = Rng::new(3);
        let picture = (0..size.element_product()).flat_map(|_| {
            let tone = 90 + (rng.next_u32() % 60) as u8;
            [tone, tone - 20, tone - 40, 255]
        });
        let picture: Vec<u8> = picture.collect();
        let mut look = preset.look.clone();
        look.shades = shades;
        let table = LookTable::new(&look, field.frame.texels_per_unit()).unwrap();
        let mut painted = picture.clone();
        for y in (0..size.y).step_by(part as usize) {
            for x in (0..size.x).step_by(part as usize) {
                let min = UVec2::new(x, y);
                let rect = TexelRect { min, max: (min + part).min(size) };
                let base = BaseTexels { size, diffuse: &picture, normal: None, depth: None };
                let mut targets = PaintTargets { diffuse: Some(&mut painted), normal: None, depth: None };
                paint_into(base, &field, &table, rect, UVec2::ZERO, &mut targets);
            }
        }
        let texels = |bytes: Vec<u8>| bytes.as_chunks().0.to_vec();
        (texels(painted), texels(picture))
    }

    #[test]
    fn every_texel_is_a_shade_of_its_own_colour() {
        for name in CrackPreset::NAMES {
            let preset = CrackPreset::named(name).unwrap();
            for steps in [1, 3, 16] {
                let (painted, picture) = cracked(&preset, Shades::Steps(steps), 96);
                let mut n_changed = 0;
                for (painted, base) in painted.iter().zip(&picture) {
                    let is_shade = |k: f32| {
                        let share = k.max(0.5) / f32::from(steps);
                        (0..3).all(|c| (f32::from(base[c]) * share).round().min(255.0) as u8 == painted[c])
                    };
                    assert!((0..=6 * u32::from(steps)).any(|k| is_shade(k as f32)), "{name}: {base:?} {painted:?}");
                    n_changed += u32::from(painted != base);
                }
                assert!(n_changed > 20 || steps == 1, "{name}: {n_changed} texels of {steps} steps");
            }
        }
    }

    #[test]
    fn parts_are_as_the_whole_and_smooth_is_as_before() {
        let (whole, _) = cracked(&CrackPreset::CONCRETE, Shades::Steps(3), 96);
        assert!(whole == cracked(&CrackPreset::CONCRETE, Shades::Steps(3), 7).0);
        let (smooth, _) = cracked(&CrackPreset::CONCRETE, Shades::Smooth, 96);
        assert!(smooth == cracked(&CrackPreset::CONCRETE, Shades::Auto, 96).0 && smooth != whole);
    }

    #[test]
    fn light_cracks_on_a_pane_cover_it_in_steps() {
        let base = [200, 220, 240, 60];
        for cover in [60, 61, 100, 160, 254, 255] {
            let mut out = [[255, 255, 255, cover]];
            reduce_shades(&mut out, &[base], 3);
            assert!([60, 125, 190, 255].contains(&out[0][3]), "{out:?}");
        }
        let mut black = [[9, 9, 9, 255]];
        reduce_shades(&mut black, &[[0, 0, 0, 255]], 3);
        assert_eq!(black, [[0, 0, 0, 255]], "black has no shades");
    }
}
