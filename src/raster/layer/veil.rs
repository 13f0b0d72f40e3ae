//! Veils: translucent sheets to one side of cracks, as in clear ice.

use super::noise::noise;
use crate::{
    Grid,
    math::{mix, ops},
    pattern::{SegmentPath, SurfaceFrame},
    raster::TexelRect,
};
use glam::{UVec2, Vec2};

/// A translucent sheet to one side of each crack: the wall of a crack that is visible through the surface (ice).
///
/// All sheets of a surface are on the same side, because they are seen from one place. Wider cracks have denser
/// sheets.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Veil {
    /// Distance to which a sheet extends from the crack, pattern units. 0..=0.5; default 0.06.
    pub reach: f32,
    /// Width from which a crack has the densest sheet, pattern units. 0.0001..=1; default 0.005.
    pub full_width: f32,
    /// Cover of the sheet at the crack; it decreases with the distance. 0..=1; default 0.5.
    pub cover: f32,
    /// Colour, sRGB 0..=1; default a bluish white.
    pub color: [f32; 3],
    /// How much sheets differ from each other and along each crack: in width, strength and fall-off, with ragged far
    /// edges and fine arcs; some are on the other side. 0..=1; default 0 = all are alike.
    pub variation: f32,
    /// How many bubbles lie along cracks, in strings. 0..=1; default 0 = none.
    pub bubbles: f32,
}

impl Veil {
    /// The default: a sheet in ice.
    pub const DEFAULT: Self =
        Self { reach: 0.06, full_width: 0.005, cover: 0.5, color: [0.90, 0.96, 1.0], variation: 0.0, bubbles: 0.0 };

    /// The first field that is out of its range or not finite: its name, value and range.
    pub(crate) fn fault(&self) -> Option<(&'static str, f32, &'static str)> {
        let mut fields = vec![
            ("veil.reach", self.reach, 0.0..=0.5, "0..=0.5"),
            ("veil.full_width", self.full_width, 0.0001..=1.0, "0.0001..=1"),
            ("veil.cover", self.cover, 0.0..=1.0, "0..=1"),
            ("veil.variation", self.variation, 0.0..=1.0, "0..=1"),
            ("veil.bubbles", self.bubbles, 0.0..=1.0, "0..=1"),
        ];
        fields.extend(self.color.map(|channel| ("veil.color", channel, 0.0..=1.0, "0..=1")));
        let found = fields.into_iter().find(|(_, value, range, _)| !range.contains(value));
        found.map(|(name, value, _, range)| (name, value, range))
    }

    /// The same sheets at another scale: every length times `by`.
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

/// No floor is this many texels wide.
const MOST_HALF: f32 = 16_384.0;

/// Streaks a pattern unit.
const STREAKS: f32 = 46.0;

/// The density of the sheets at each texel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VeilField {
    veil: Veil,
    frame: SurfaceFrame,
    seed: u32,
    /// Extent of a sheet from its crack, texels.
    hang: Vec2,
    /// 0 = none, 255 = full density; combined by max.
    density: Grid<u8>,
    /// If set, the field holds the floors of cracks instead of sheets: how far they are moved, as a share of the half
    /// width.
    floor: Option<f32>,
}

/// Salts of the random draws of veils: for their direction, and for their noise. Frozen: a seed must give the same
/// result in every version.
const VEIL_WAY: u64 = 0x7E11;
const VEIL_NOISE: u64 = 0x5EA1;

impl VeilField {
    pub(super) fn new(veil: &Veil, frame: SurfaceFrame, seed: u64) -> Self {
        // Away from the light, about.
        let turn = (mix(seed ^ VEIL_WAY) >> 40) as f32 * (1.0 / 16_777_216.0);
        let way = ops::unit(std::f32::consts::FRAC_PI_4 + 1.2 * (turn - 0.5));
        let hang = way * (veil.reach * frame.texels_per_unit());
        Self {
            veil: *veil,
            frame,
            seed: mix(seed ^ VEIL_NOISE) as u32,
            hang,
            density: Grid::new(frame.size(), 0),
            floor: None,
        }
    }

    /// The floors of cracks, each moved to the upper left by a share of its half width, limited in pattern units.
    pub(super) fn floor([share, most]: [f32; 2], frame: SurfaceFrame) -> Self {
        let way = Vec2::splat(-std::f32::consts::FRAC_1_SQRT_2);
        let hang = way * (most.clamp(0.0, 0.5) * frame.texels_per_unit());
        Self { veil: Veil::DEFAULT, frame, seed: 0, hang, density: Grid::new(frame.size(), 0), floor: Some(share) }
    }

    pub(crate) const fn density(&self) -> &Grid<u8> {
        &self.density
    }

    pub(in crate::raster) fn density_mut(&mut self) -> &mut Grid<u8> {
        &mut self.density
    }

    /// The bounding box of the sheets of a crack at the origin, texels.
    pub(in crate::raster) fn hang(&self) -> (Vec2, Vec2) {
        let other = if self.veil.variation > 0.0 && self.floor.is_none() { -self.hang } else { Vec2::ZERO };
        // And a bubble at its end.
        let more = if self.veil.bubbles > 0.0 { self.bubble(1.0) + 0.1 * self.hang.length() + 1.0 } else { 0.0 };
        (self.hang.min(other).min(Vec2::ZERO) - more, self.hang.max(other).max(Vec2::ZERO) + more)
    }

    /// Radius of a bubble of this size, texels.
    fn bubble(&self, size: f32) -> f32 {
        (0.0011 + 0.0044 * size) * self.frame.texels_per_unit()
    }

    /// Adds the sheet of a line; returns the texels that it may have changed.
    pub(in crate::raster) fn stamp(&mut self, path: &SegmentPath) -> TexelRect {
        let mut bounds = TexelRect::default();
        if let Some(share) = self.floor {
            for pair in path.points().windows(2) {
                let ends = [pair[0], pair[1]].map(|point| {
                    let half = (0.5 * point.width * self.frame.texels_per_unit()).clamp(0.0, MOST_HALF);
                    (self.frame.to_texel(point.pos), self.hang.clamp_length_max(share * half), half)
                });
                bounds = bounds.union(self.stamp_floor(ends));
            }
            return bounds;
        }
        // The brightness of a sheet depends on its direction.
        let ends = path.points().first().zip(path.points().last());
        let way = ends.map_or(Vec2::ZERO, |(from, to)| (to.pos - from.pos).normalize_or_zero());
        // Twice the angle: the same both ways.
        let twice = 1.4 * way.rotate(way);
        let lit = (0.74 + 0.5 * noise(self.seed ^ 3, twice.x, twice.y)).clamp(0.35, 1.0);
        for pair in path.points().windows(2) {
            let ends = [pair[0], pair[1]].map(|point| self.frame.to_texel(point.pos));
            let dense = [pair[0], pair[1]].map(|point| lit * (point.width / self.veil.full_width).clamp(0.0, 1.0));
            if self.veil.variation > 0.0 {
                bounds = bounds.union(self.stamp_uneven(ends, dense, twice));
            } else {
                bounds = bounds.union(self.stamp_piece(ends, dense));
            }
        }
        if self.veil.bubbles > 0.0
            && let Some(point) = path.points().first()
        {
            bounds = bounds.union(self.stamp_bubble(point.pos));
        }
        bounds
    }

    /// The floor between two places of a crack, each with how far it is moved there and its half width: the cover of each
    /// texel.
    fn stamp_floor(&mut self, [(a, moved, from), (b, moved_to, to)]: [(Vec2, Vec2, f32); 2]) -> TexelRect {
        if !a.is_finite() || !b.is_finite() || from.max(to) <= 0.0 {
            return TexelRect::default();
        }
        let (along, reach, limit) = (b - a, from.max(to) + 1.0, self.density.size().as_vec2());
        // A texel belongs to a place of the line that is not moved, however wide it is: so a wider floor covers all of a
        // narrower one.
        let (low, high) = ((a + moved).min(b + moved_to), (a + moved).max(b + moved_to));
        let low = (low - reach).floor().clamp(Vec2::ZERO, limit).as_uvec2();
        let high = (high + reach).ceil().clamp(Vec2::ZERO, limit).as_uvec2();
        let inv = 1.0 / along.length_squared().max(1.0e-12);
        for y in low.y..high.y {
            let row = self.density.row_mut(y as usize);
            for x in low.x..high.x {
                let off = UVec2::new(x, y).as_vec2() + 0.5 - a;
                let t = (off.dot(along) * inv).clamp(0.0, 1.0);
                let middle = along * t + moved + (moved_to - moved) * t;
                let inside = from + (to - from) * t + 0.5 - (off - middle).length();
                let value = (255.0 * inside.clamp(0.0, 1.0) + 0.5) as u8;
                let texel = &mut row[x as usize];
                *texel = value.max(*texel);
            }
        }
        TexelRect { min: low, max: high }.intersect(TexelRect::whole(self.density.size()))
    }

    /// Texels that a sheet along a piece of a crack may touch.
    fn bounds_of(&self, [a, b]: [Vec2; 2], hang: Vec2) -> TexelRect {
        let limit = self.density.size().as_vec2();
        let min = (a.min(b) + hang.min(Vec2::ZERO) - 1.0).floor().clamp(Vec2::ZERO, limit).as_uvec2();
        let max = (a.max(b) + hang.max(Vec2::ZERO) + 1.0).ceil().clamp(Vec2::ZERO, limit).as_uvec2();
        TexelRect { min, max }
    }

    /// Like [`stamp_piece`](Self::stamp_piece), for uneven sheets. `twice` is the direction of the crack with its
    /// angle doubled.
    fn stamp_uneven(&mut self, [a, b]: [Vec2; 2], dense: [f32; 2], twice: Vec2) -> TexelRect {
        // Few sheets are on the other side, and at the directions in between there is none.
        let side = 0.3 + noise(self.seed ^ 8, 1.1 * twice.x + 5.0, 1.1 * twice.y);
        let hang = if side < 0.0 { -self.hang } else { self.hang };
        let along = b - a;
        let det = along.perp_dot(hang);
        let rect = self.bounds_of([a, b], hang);
        if !det.is_finite() || det.abs() < 1.0e-3 || dense == [0.0; 2] || rect.is_empty() {
            return TexelRect::default();
        }
        let (uneven, unit) = (self.veil.variation, 1.0 / self.frame.texels_per_unit());
        let faint = (7.0 * side.abs()).min(1.0);
        // Slow variations, at both ends of the piece, so that they are continuous from piece to piece.
        let slow = |k: u32, bumps: f32| {
            [a, b].map(|end| {
                let end = end * (unit * bumps);
                noise(self.seed ^ k, end.x, end.y)
            })
        };
        let (wide, strong, kind, rough) = (slow(11, 3.4), slow(12, 4.6), slow(13, 3.1), slow(14, 6.0));
        let inv = 1.0 / det;
        let slack = 0.5 / along.length().max(0.5);
        let streak = hang.perp() / hang.length() * (STREAKS * unit);
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
                let mix = |ends: [f32; 2]| ends[0] + (ends[1] - ends[0]) * u;
                let thick = mix(dense) * (1.0 + uneven * (1.5 * mix(strong) - 0.25)).clamp(0.0, 1.6) * faint;
                let place = at.dot(streak);
                let ragged = uneven * (0.5 + 0.5 * mix(rough)).clamp(0.0, 1.0);
                let edge = 0.5 * noise(self.seed ^ 1, 0.31 * place, 3.0)
                    + ragged
                        * (0.34 * noise(self.seed ^ 15, 1.1 * place, 4.0)
                            + 0.2 * noise(self.seed ^ 16, 3.1 * place, 5.0));
                let wide = (0.42 + uneven * 0.75 * mix(wide)).clamp(0.07, 0.95);
                let end = wide * (0.8 + 0.36 * edge);
                if s >= end || thick <= 0.0 {
                    continue;
                }
                let (way, rest) = (s / end, 1.0 - s / end);
                // Most sheets fade out, some have a visible far edge.
                let pane = (0.15 + 1.3 * mix(kind)).clamp(0.0, 0.8);
                let fade = rest * (0.18 + 0.82 * rest * rest);
                let border = ((end - s) * hang.length() * (1.0 / 1.5)).min(1.0);
                let rim = (1.0 - ((end - s) * hang.length() - 1.5).abs() * 0.5).clamp(0.0, 1.0);
                let flat = border * (0.20 + 0.42 * rest * rest + 0.30 * ragged * rim);
                let body = fade + (flat - fade) * pane;
                // Arcs across, and hackle from the crack outward.
                let bent = 17.0 * way.sqrt() * (0.4 + wide) + 1.3 * noise(self.seed ^ 17, 0.22 * place, 1.0);
                let arc = 1.0 - noise(self.seed ^ 18, bent, 0.12 * place).abs();
                let comb = 1.0 - noise(self.seed ^ 19, 2.3 * place + 2.0 * way * way, 0.9 * s).abs();
                let (arc, comb) = (arc * arc * arc * arc, comb * comb * comb);
                let curtain = 0.72 + 0.30 * arc * pane + 0.26 * comb * (1.0 - way);
                let value = (255.0 * (thick * body * curtain).clamp(0.0, 1.0) + 0.5) as u8;
                let texel = &mut row[x as usize];
                *texel = value.max(*texel);
            }
        }
        rect
    }

    /// A bubble beside the crack at the start of a segment, if there is one: a bright ring with a highlight.
    fn stamp_bubble(&mut self, pos: Vec2) -> TexelRect {
        let key = mix(u64::from(self.seed) ^ u64::from(pos.x.to_bits()) << 32 ^ u64::from(pos.y.to_bits()));
        let draw = |k: u64| (mix(key ^ k << 8) >> 40) as f32 * (1.0 / 16_777_216.0);
        // Where there are some there are many.
        let many = 2.2 * noise(self.seed ^ 20, 6.0 * pos.x, 6.0 * pos.y) - 0.75;
        let mut bounds = TexelRect::default();
        if !pos.is_finite() {
            return bounds;
        }
        for k in 0..4 {
            if draw(4 * k) >= self.veil.bubbles * many {
                continue;
            }
            let size = draw(4 * k + 1);
            let radius = self.bubble(size * size * size);
            let aside = draw(4 * k + 2) * draw(4 * k + 2) * 0.30;
            let middle = self.frame.to_texel(pos) + self.hang * aside + self.hang.perp() * (0.10 * draw(4 * k + 3));
            let limit = self.density.size().as_vec2();
            let low = (middle - radius - 1.0).floor().clamp(Vec2::ZERO, limit).as_uvec2();
            let high = (middle + radius + 1.0).ceil().clamp(Vec2::ZERO, limit).as_uvec2();
            for y in low.y..high.y {
                let row = self.density.row_mut(y as usize);
                for x in low.x..high.x {
                    let off = UVec2::new(x, y).as_vec2() + 0.5 - middle;
                    let out = off.length();
                    let inside = (radius + 0.5 - out).clamp(0.0, 1.0);
                    let ring = (1.0 - (radius - 0.6 - out).abs() * (1.0 / 1.1)).clamp(0.0, 1.0);
                    let light = (off + 0.4 * radius).length() < 0.36 * radius;
                    let value = inside * (0.16 + 0.62 * ring + if light { 0.7 } else { 0.0 });
                    let texel = &mut row[x as usize];
                    *texel = ((255.0 * value.clamp(0.0, 1.0) + 0.5) as u8).max(*texel);
                }
            }
            bounds = bounds.union(TexelRect { min: low, max: high });
        }
        bounds
    }

    fn stamp_piece(&mut self, [a, b]: [Vec2; 2], dense: [f32; 2]) -> TexelRect {
        let (along, hang) = (b - a, self.hang);
        let det = along.perp_dot(hang);
        let rect = self.bounds_of([a, b], hang);
        if !det.is_finite() || det.abs() < 1.0e-3 || dense == [0.0; 2] || rect.is_empty() {
            return TexelRect::default();
        }
        let inv = 1.0 / det;
        // Half a texel longer at the ends, so that there is no gap between two pieces.
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
                // Densest next to the crack.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::Rng, pattern::PathPoint};

    /// What is drawn while a crack widens is covered by what is drawn of it in the end.
    #[test]
    fn a_wider_floor_covers_a_narrower_one() {
        let (frame, mut rng) = (SurfaceFrame::new(UVec2::splat(96)).unwrap(), Rng::new(9));
        for case in 0..400 {
            let mut place = || (Vec2::new(rng.unit(), rng.unit()), 0.1 * rng.unit(), 0.1 * rng.unit());
            let ends = [place(), place()];
            let stamp = |field: &mut VeilField, share: f32| {
                let [from, to] = ends.map(|(pos, width, more)| PathPoint { pos, width: width + share * more });
                field.stamp(&SegmentPath::straight(from, to));
            };
            let mut at_once = VeilField::floor([0.6, 0.03], frame);
            stamp(&mut at_once, 1.0);
            let mut by_and_by = VeilField::floor([0.6, 0.03], frame);
            for share in [0.0, 0.2, 0.55, 1.0] {
                stamp(&mut by_and_by, share);
            }
            assert!(at_once == by_and_by, "case {case}");
        }
    }

    /// All changes lie in the reported box, and the result is the same in one call and piece by piece.
    #[test]
    fn sheets_bubbles_and_floors_stay_in_their_box() {
        let (frame, mut rng) = (SurfaceFrame::new(UVec2::splat(256)).unwrap(), Rng::new(4));
        let veil = Veil { variation: 1.0, bubbles: 1.0, ..Veil::DEFAULT };
        let mut covered = [0; 2];
        for case in 0..60 {
            let mut field = match case % 2 {
                0 => VeilField::new(&veil, frame, case),
                _ => VeilField::floor([0.8, 0.02], frame),
            };
            let mut place = || PathPoint { pos: Vec2::new(rng.unit(), rng.unit()), width: 0.02 };
            let (from, to) = (place(), place());
            let changed = field.stamp(&SegmentPath::straight(from, to));
            let (low, high) = field.hang();
            let ends = [from, to].map(|point| frame.to_texel(point.pos));
            let reach = 0.01 * 256.0 + 2.5;
            let (low, high) = (ends[0].min(ends[1]) + low - reach, ends[0].max(ends[1]) + high + reach);
            for y in 0..256 {
                for x in 0..256 {
                    if field.density().get(x, y) != Some(0) {
                        let at = UVec2::new(x, y);
                        assert!(
                            at.cmpge(changed.min).all() && at.cmplt(changed.max).all(),
                            "case {case}: {at} was not told"
                        );
                        let middle = at.as_vec2() + 0.5;
                        assert!(
                            middle.cmpge(low).all() && middle.cmple(high).all(),
                            "case {case}: {at} is out of the box"
                        );
                        covered[case as usize % 2] += 1;
                    }
                }
            }
        }
        assert!(covered.iter().all(|&count| count > 2000), "{covered:?}");
    }
}
