//! Veils: translucent sheets that hang from cracks to one side, as in clear ice.

use super::noise;
use crate::{
    Grid,
    math::{mix, ops},
    pattern::{SegmentPath, SurfaceFrame},
    raster::TexelRect,
};
use glam::{UVec2, Vec2};

/// A translucent sheet along each crack, to one side of it: the wall of a crack that is seen through the surface (ice).
///
/// All sheets of a surface hang to the same side, as they are seen from one place. Wider cracks have denser ones.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Veil {
    /// How far it reaches from the crack, pattern units. 0..=0.5; default 0.06.
    pub reach: f32,
    /// Width of a crack from which on it is as dense as it gets, pattern units. 0.0001..=1; default 0.005.
    pub full_width: f32,
    /// How much it covers at the crack; it falls off from there. 0..=1; default 0.5.
    pub cover: f32,
    /// Colour, sRGB 0..=1; default a bluish white.
    pub color: [f32; 3],
}

impl Veil {
    /// The default: a sheet in ice.
    pub const DEFAULT: Self = Self { reach: 0.06, full_width: 0.005, cover: 0.5, color: [0.90, 0.96, 1.0] };

    /// The first field that is out of its range or not finite: its name, value and range.
    pub(crate) fn fault(&self) -> Option<(&'static str, f32, &'static str)> {
        let mut fields = vec![
            ("veil.reach", self.reach, 0.0..=0.5, "0..=0.5"),
            ("veil.full_width", self.full_width, 0.0001..=1.0, "0.0001..=1"),
            ("veil.cover", self.cover, 0.0..=1.0, "0..=1"),
        ];
        fields.extend(self.color.map(|channel| ("veil.color", channel, 0.0..=1.0, "0..=1")));
        let found = fields.into_iter().find(|(_, value, range, _)| !range.contains(value));
        found.map(|(name, value, _, range)| (name, value, range))
    }

    /// The same seen from nearer or further away.
    pub(crate) fn scaled(&self, by: f32) -> Self {
        Self {
            reach: (self.reach * by).clamp(0.0, 0.5),
            full_width: (self.full_width * by).clamp(0.0001, 1.0),
            ..*self
        }
    }
}

impl Default for Veil {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Streaks a pattern unit.
const STREAKS: f32 = 46.0;

/// How dense the sheets are at each texel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VeilField {
    veil: Veil,
    frame: SurfaceFrame,
    seed: u32,
    /// From a crack to the far end of its sheet, texels.
    hang: Vec2,
    /// 0 = none, 255 = as dense as it gets; combined by max.
    density: Grid<u8>,
}

impl VeilField {
    pub(super) fn new(veil: &Veil, frame: SurfaceFrame, seed: u64) -> Self {
        // Away from the light, about.
        let turn = (mix(seed ^ 0x7E11) >> 40) as f32 * (1.0 / 16_777_216.0);
        let way = ops::unit(std::f32::consts::FRAC_PI_4 + 1.2 * (turn - 0.5));
        let hang = way * (veil.reach * frame.texels_per_unit());
        Self { veil: *veil, frame, seed: mix(seed ^ 0x5EA1) as u32, hang, density: Grid::new(frame.size(), 0) }
    }

    pub(crate) const fn density(&self) -> &Grid<u8> {
        &self.density
    }

    pub(in crate::raster) fn density_mut(&mut self) -> &mut Grid<u8> {
        &mut self.density
    }

    /// From a crack to the far end of its sheet, texels.
    pub(in crate::raster) const fn hang(&self) -> Vec2 {
        self.hang
    }

    /// Hangs a sheet from a line; returns the texels that it may have changed.
    pub(in crate::raster) fn stamp(&mut self, path: &SegmentPath) -> TexelRect {
        let mut bounds = TexelRect::default();
        // Sheets of some directions catch more light than others.
        let ends = path.points().first().zip(path.points().last());
        let way = ends.map_or(Vec2::ZERO, |(from, to)| (to.pos - from.pos).normalize_or_zero());
        // Twice the angle: the same both ways.
        let twice = 1.4 * way.rotate(way);
        let lit = (0.74 + 0.5 * noise(self.seed ^ 3, twice.x, twice.y)).clamp(0.35, 1.0);
        for pair in path.points().windows(2) {
            let ends = [pair[0], pair[1]].map(|point| self.frame.to_texel(point.pos));
            let dense = [pair[0], pair[1]].map(|point| lit * (point.width / self.veil.full_width).clamp(0.0, 1.0));
            bounds = bounds.union(self.stamp_piece(ends, dense));
        }
        bounds
    }

    fn stamp_piece(&mut self, [a, b]: [Vec2; 2], dense: [f32; 2]) -> TexelRect {
        let (along, hang) = (b - a, self.hang);
        let det = along.perp_dot(hang);
        if !det.is_finite() || det.abs() < 1.0e-3 || dense == [0.0; 2] {
            return TexelRect::default();
        }
        let limit = self.density.size().as_vec2();
        let low = (a.min(b) + hang.min(Vec2::ZERO) - 1.0).floor().clamp(Vec2::ZERO, limit).as_uvec2();
        let high = (a.max(b) + hang.max(Vec2::ZERO) + 1.0).ceil().clamp(Vec2::ZERO, limit).as_uvec2();
        let rect = TexelRect { min: low, max: high };
        if rect.is_empty() {
            return TexelRect::default();
        }
        let inv = 1.0 / det;
        // Half a texel more at the ends, so that there is no gap between two pieces.
        let slack = 0.5 / along.length().max(0.5);
        let streak = hang.perp() / hang.length() * (STREAKS / self.frame.texels_per_unit());
        for y in rect.min.y..rect.max.y {
            let row = self.density.row_mut(y as usize);
            for x in rect.min.x..rect.max.x {
                let at = UVec2::new(x, y).as_vec2() + 0.5;
                let off = at - a;
                let (u, s) = (off.perp_dot(hang) * inv, along.perp_dot(off) * inv);
                if u < -slack || u > 1.0 + slack || !(0.0..1.0).contains(&s) {
                    continue;
                }
                let u = u.clamp(0.0, 1.0);
                let place = at.dot(streak);
                let curtain =
                    0.80 + 0.13 * noise(self.seed, place, 0.6 * s) + 0.07 * noise(self.seed ^ 2, 4.3 * place, s);
                // It ends at different distances.
                let thick = dense[0] + (dense[1] - dense[0]) * u;
                let end = (0.3 + 0.7 * thick) * (0.72 + 0.28 * noise(self.seed ^ 1, 0.31 * place, 3.0));
                // Most of it next to the crack, a little far away.
                let fall = (1.0 - s / end).max(0.0);
                let value = thick * fall * (0.3 + 0.7 * fall * fall) * curtain;
                let value = (255.0 * value.clamp(0.0, 1.0) + 0.5) as u8;
                let texel = &mut row[x as usize];
                *texel = value.max(*texel);
            }
        }
        rect
    }
}
