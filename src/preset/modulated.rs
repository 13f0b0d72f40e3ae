//! A preset painted by modulation: [`CrackPreset::modulated`].

use super::CrackPreset;
use crate::{
    math::ops,
    paint::{ColorStop, Look, LookError, Modulation},
    raster::Profile,
};
use std::borrow::Cow;

/// Multiple of the fade at which nothing is left: exp(-6.24) is half a byte.
const END: f32 = 6.24;

/// Most stops of a ramp.
const STOPS: u32 = 16;

impl CrackPreset {
    /// The same cracks, painted by nothing but their distance (Mould 2005, section 5.2, eq. 3): the picture darkens, or turns to another
    /// tone, towards them. No relief, no light.
    ///
    /// The rim of the [profile](Profile::rim_width) measures the distance, and the [ramp](Look::ramp) is the exponential by 16 stops; so
    /// cracks grow, close and heal as with any other look. It differs from [`modulate`](crate::paint::modulate), which measures
    /// distances in whole texels, by a few bytes. [`Modulation::depth`] is not used.
    ///
    /// ```
    /// use bevy_crack::{CrackPreset, paint::Modulation};
    ///
    /// let drawn = CrackPreset::MUD.modulated(&Modulation::DARK)?;
    /// assert_eq!(drawn.validate(), Ok(()));
    /// assert_eq!(drawn.growth, CrackPreset::MUD.growth);
    /// # Ok::<(), bevy_crack::paint::LookError>(())
    /// ```
    ///
    /// # Errors
    /// [`LookError::OutOfRange`] if [`Modulation::fade`] is not within 0.0001..=0.03 (the rim is at most 0.2 wide) or a tone is not within
    /// 0..=1.
    pub fn modulated(&self, modulation: &Modulation) -> Result<Self, LookError> {
        let Modulation { fade, tone, .. } = *modulation;
        let range = "0.0001..=0.03";
        if !(0.0001..=0.03).contains(&fade) {
            return Err(LookError::OutOfRange { field: "fade", value: fade, range });
        }
        if let Some(value) = tone.into_iter().find(|channel| !(0.0..=1.0).contains(channel)) {
            return Err(LookError::OutOfRange { field: "tone", value, range: "0..=1" });
        }
        let rim_width = (END * fade).min(0.2);
        // The rim falls from depth 1 at the crack to 0 at its end. Stops are denser where the exponential bends more.
        let stop = |i: u32| {
            let t = 1.0 - i as f32 / (STOPS - 1) as f32;
            let away = 0.35 * t + 0.65 * t * t;
            ColorStop { depth: 1.0 - away, color: tone, cover: ops::exp(-away * rim_width / fade) }
        };
        let Profile { depth, full_width, faintest, .. } = self.profile;
        let profile = Profile { depth, full_width, faintest, rim_width, rim_depth: 1.0, wall: 0.0, ..Profile::DEFAULT };
        let look = Look {
            ramp: Cow::Owned((0..STOPS).map(stop).collect()),
            tint: 0.0,
            glint: 0.0,
            grain: 0.0,
            relief: 0.0,
            ..Look::GROOVE
        };
        Ok(Self { profile, look, ..self.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        paint::{BaseTexels, LookTable, PaintTargets, paint_into},
        pattern::{PathPoint, SegmentPath, SurfaceFrame},
        raster::{DepthField, TexelRect, stamp_path},
    };
    use glam::{UVec2, Vec2};

    /// Against the equation with the exact distance from the edge of a straight crack.
    #[test]
    fn bytes_are_those_of_the_equation() {
        let size = UVec2::splat(256);
        let frame = SurfaceFrame::new(size).unwrap();
        let [from, to] = [Vec2::new(0.31, 0.22), Vec2::new(0.74, 0.57)];
        let width = 0.02;
        for (modulation, base) in [(Modulation::DARK, 200.0), (Modulation { fade: 0.02, ..Modulation::BRIGHT }, 90.0)] {
            let preset = CrackPreset::CONCRETE.modulated(&modulation).unwrap();
            let mut field = DepthField::new(frame);
            let ends = [from, to].map(|pos| PathPoint { pos, width });
            stamp_path(&mut field, &preset.profile, &SegmentPath::straight(ends[0], ends[1]));
            let plain = [base as u8, base as u8, base as u8, 255].repeat((size.x * size.y) as usize);
            let mut got = plain.clone();
            let table = LookTable::new(&preset.look, frame.texels_per_unit()).unwrap();
            let untouched = BaseTexels { size, diffuse: &plain, normal: None, depth: None };
            let mut targets = PaintTargets { diffuse: Some(&mut got), normal: None, depth: None };
            paint_into(untouched, &field, &table, TexelRect::whole(size), UVec2::ZERO, &mut targets);
            for (i, texel) in got.as_chunks::<4>().0.iter().enumerate() {
                let pos = Vec2::new((i % 256) as f32 + 0.5, (i / 256) as f32 + 0.5) / 256.0;
                let along = ((pos - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
                let distance = (pos.distance(from.lerp(to, along)) - 0.5 * width).max(0.0);
                let share = f64::from(-distance / modulation.fade).exp() as f32;
                for (channel, tone) in texel.iter().zip(modulation.tone) {
                    let wanted = base + (255.0 * tone - base) * share;
                    assert!((f32::from(*channel) - wanted).abs() < 3.0, "{channel}, not {wanted}, {distance} away");
                }
            }
        }
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        for (fade, tone, field) in [
            (f32::NAN, 0.0, "fade"),
            (0.031, 0.0, "fade"),
            (0.0, 0.0, "fade"),
            (0.01, 1.5, "tone"),
            (0.01, f32::NAN, "tone"),
        ] {
            let modulation = Modulation { fade, tone: [0.0, 0.0, tone], ..Modulation::DARK };
            let Err(LookError::OutOfRange { field: named, .. }) = CrackPreset::MUD.modulated(&modulation) else {
                panic!("{modulation:?} passes");
            };
            assert_eq!(named, field);
        }
    }
}
