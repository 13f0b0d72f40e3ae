//! The layers of a field other than depth, in a patch.

use super::{Facets, LookTable, patch::Patch, rows::round};
use crate::{
    Grid,
    raster::{CrushedField, DepthField, Plate, SLOPE_UNIT, Spot, TexelRect},
};
use glam::Vec2;
use std::cell::Cell;

/// The depth, in levels of 255, from which on no crack is seen on a floor, and the same where there are ledges.
const HIDDEN: f32 = 64.0;
const HIDDEN_BELOW_LEDGES: f32 = 120.0;

/// Plates and crushed zones of a patch; indices as in [`Patch`].
pub(super) struct Extras<'a, const ROOM: usize> {
    facets: Option<&'a Facets>,
    ids: Option<&'a Grid<u16>>,
    plates: &'a [Plate],
    crushed: Option<&'a CrushedField>,
    /// Whether plates are missing in holes.
    pub(super) are_gone: bool,
    /// Colour of crushed material, 0..=255, weighted by its share.
    pub(super) color: [f32; 3],
    /// Share of the picture's colour in it.
    pub(super) tint: f32,
    /// Whether dark texels are shadows instead of holes.
    pub(super) shades: bool,
    /// How much of the cracks is hidden where material has broken off, and the inverse of the depth where all of it is.
    bare: f32,
    hides: f32,
    /// Whether the zone is drawn, with chips over the cracks.
    pub(super) is_drawn: bool,
    /// Whether pale texels in a hole are its wall.
    pub(super) has_walls: bool,
    /// One step of the zone's depth, in units of the depth map.
    deep: f32,
    veils: Option<&'a Grid<u8>>,
    room: Box<Room<ROOM>>,
    /// The plate that was looked up last: most neighbouring texels belong to the same plate.
    last: Cell<(u16, Facet)>,
    /// Width of a row of the patch, with one texel more on either side.
    stride: usize,
    height: usize,
    min: Vec2,
}

struct Room<const ROOM: usize> {
    plate: [u16; ROOM],
    spot: [Spot; ROOM],
    veil: [u8; ROOM],
}

impl<'a, const ROOM: usize> Extras<'a, ROOM> {
    /// The layers that the look shows; `None` if there are none.
    pub(super) fn of(field: &'a DepthField, look: &'a LookTable) -> Option<Self> {
        let layer = field.layer();
        let plates = layer.plates().filter(|_| look.facets.is_some());
        let has_floor = look.cel.is_some_and(|cel| cel.has_floor);
        let (crushed, veils) = (layer.crushed(), layer.veil().filter(|_| look.veil_cover > 0.0 || has_floor));
        let settings = crushed.map(CrushedField::settings);
        (plates.is_some() || crushed.is_some() || veils.is_some()).then(|| Self {
            facets: look.facets.as_ref().filter(|_| plates.is_some()),
            ids: plates.map(|plates| plates.ids()),
            plates: plates.map_or(&[], |plates| plates.plates()),
            crushed,
            are_gone: plates.is_some() && look.facets.is_some_and(|facets| facets.missing_whole),
            color: settings.map_or([0.0; 3], |all| all.color.map(|channel| 255.0 * channel * (1.0 - all.tint))),
            tint: settings.map_or(0.0, |all| all.tint),
            shades: settings.is_some_and(|all| all.broken),
            bare: settings.map_or(0.0, |all| if all.broken || all.rim > 0.0 { all.bare } else { 0.0 }),
            // With ledges, the cracks go on over the upper ones.
            hides: settings.map_or(0.0, |all| if all.terraces > 2 { HIDDEN_BELOW_LEDGES } else { HIDDEN }.recip()),
            has_walls: settings.is_some_and(|all| !all.broken && all.hole > 0.0 && all.edge > 0.0),
            is_drawn: settings.is_some_and(|all| all.broken && all.outline > 0.0),
            deep: settings.map_or(0.0, |all| all.depth * look.deep),
            veils,
            room: Box::new(Room { plate: [0; ROOM], spot: [Spot::default(); ROOM], veil: [0; ROOM] }),
            last: Cell::new((0, Facet::NONE)),
            stride: 0,
            height: 0,
            min: Vec2::ZERO,
        })
    }

    /// Whether there is anything to paint in a rectangle.
    pub(super) fn touches(&self, rect: TexelRect) -> bool {
        let columns = rect.min.x as usize..rect.max.x as usize;
        let rows = || rect.min.y as usize..rect.max.y as usize;
        self.crushed.is_some_and(|crushed| crushed.touches(rect))
            || self.ids.is_some_and(|ids| rows().any(|y| ids.row(y)[columns.clone()].iter().any(|&id| id != 0)))
            || self.veils.is_some_and(|veils| rows().any(|y| veils.row(y)[columns.clone()].iter().any(|&v| v != 0)))
    }

    /// Reads the layers of a rectangle.
    #[inline(always)]
    pub(super) fn load(&mut self, rect: TexelRect) {
        let size = rect.size().as_usizevec2();
        (self.stride, self.height, self.min) = (size.x + 2, size.y, rect.min.as_vec2());
        let Room { plate, spot, veil } = &mut *self.room;
        let rows = plate.chunks_exact_mut(self.stride).zip(spot.chunks_exact_mut(self.stride));
        for (((plate, spot), veil), y) in rows.zip(veil.chunks_exact_mut(self.stride)).zip(rect.min.y..rect.max.y) {
            if let Some(veils) = self.veils {
                veil[..size.x].copy_from_slice(&veils.row(y as usize)[rect.min.x as usize..rect.max.x as usize]);
            }
            veil[size.x..].fill(0);
            if let Some(ids) = self.ids {
                plate[..size.x].copy_from_slice(&ids.row(y as usize)[rect.min.x as usize..rect.max.x as usize]);
            }
            if let Some(crushed) = self.crushed {
                crushed.read(rect.min.x, y, &mut spot[..size.x]);
            }
            plate[size.x..].fill(0);
            spot[size.x..].fill(Spot::default());
        }
    }

    /// Marks touched texels in the patch, and adds the slopes of crushed material.
    #[inline(always)]
    pub(super) fn mark(&self, patch: &mut Patch<ROOM>) {
        let n = patch.len();
        if self.ids.is_some() {
            for (touch, id) in patch.touch[..n].iter_mut().zip(&self.room.plate) {
                *touch |= id;
            }
        }
        if self.veils.is_some() {
            for (touch, &veil) in patch.touch[..n].iter_mut().zip(&self.room.veil) {
                *touch |= u16::from(veil);
            }
        }
        if self.crushed.is_some() {
            for (touch, spot) in patch.touch[..n].iter_mut().zip(&self.room.spot) {
                *touch |= u16::from(*spot != Spot::default());
            }
            if self.bare > 0.0 {
                patch.level(|k| self.left(k));
            }
            patch.tilt(|k| self.room.spot[k].slope.map(|slope| f32::from(slope) * (1.0 / SLOPE_UNIT)));
        }
    }

    /// Adds the slopes of plates.
    #[inline(always)]
    pub(super) fn tilt(&self, patch: &mut Patch<ROOM>) {
        if self.facets.is_some_and(|facets| facets.concavity > 0.0) {
            patch.tilt(|k| {
                let at = self.min + Vec2::new((k % self.stride) as f32, (k / self.stride) as f32);
                let facet = self.facet(self.room.plate[k]);
                (Vec2::from(facet.tilt) - facet.dish * facet.off_middle(at)).to_array()
            });
        } else if self.facets.is_some_and(|facets| facets.tilt > 0.0) {
            patch.tilt(|k| self.facet(self.room.plate[k]).tilt);
        }
    }

    /// The appearance of a plate.
    #[inline(always)]
    pub(super) fn facet(&self, id: u16) -> Facet {
        let (last, facet) = self.last.get();
        if id == last {
            return facet;
        }
        let facet = match (self.facets, self.plates.get(usize::from(id))) {
            (Some(facets), Some(plate)) if id != 0 => {
                let mut facet = facets.of(plate);
                if facets.missing_whole {
                    facet.is_gone = self.crushed.and_then(|crushed| crushed.is_gone(plate.centre, plate.extent));
                }
                facet
            }
            _ => Facet::NONE,
        };
        self.last.set((id, facet));
        facet
    }

    /// The visible sides of neighbouring plates at a texel whose own plate is missing.
    pub(super) fn side(&self, x: u32, y: u32, thick: f32) -> Side {
        let mut side = Side { line: 0.0, face: 0.0, tone: 1.0 };
        let Some(ids) = self.ids else { return side };
        let own = ids.get(x, y).unwrap_or(0);
        let stands = |by: Vec2| {
            let (x, y) = (x.checked_add_signed(by.x.round() as i32)?, y.checked_add_signed(by.y.round() as i32)?);
            let id = ids.get(x, y)?;
            if id == own {
                return None;
            }
            let facet = self.facet(id);
            (facet.is_gone != Some(true)).then_some(facet.tone)
        };
        // Lines at the edge of the hole, not those inside it.
        let near = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (2.0, 0.0), (-2.0, 0.0), (0.0, 2.0), (0.0, -2.0)];
        side.line = if near.iter().any(|&(x, y)| stands(Vec2::new(x, y)).is_some()) { 1.0 } else { 0.0 };
        // The side that faces the light is visible at the lower right; less of the others is visible.
        for (way, reach, bright) in [
            (Vec2::new(0.6, 0.8), 1.0, 1.0),
            (Vec2::new(0.9, 0.45), 0.85, 0.85),
            (Vec2::new(-0.45, 0.9), 0.75, 0.62),
            (Vec2::new(0.9, -0.45), 0.6, 0.5),
            (Vec2::new(-0.8, -0.6), 0.4, 0.30),
        ] {
            let mut far = 1.0;
            while far <= reach * thick {
                if let Some(tone) = stands(way * far) {
                    let face = bright * (1.0 - 0.7 * far / (reach * thick));
                    if face > side.face {
                        (side.face, side.tone) = (face, tone);
                    }
                    break;
                }
                far += 1.0;
            }
        }
        side
    }

    #[inline(always)]
    pub(super) fn plate(&self, place: usize) -> u16 {
        self.room.plate[place]
    }

    #[inline(always)]
    pub(super) fn is_untouched(&self, place: usize) -> bool {
        self.room.plate[place] == 0 && self.room.veil[place] == 0 && self.room.spot[place] == Spot::default()
    }

    #[inline(always)]
    pub(super) fn veil(&self, place: usize) -> u8 {
        self.room.veil[place]
    }

    /// Adds the depth of crushed material to a row of the depth map: the deeper value of both.
    #[inline(always)]
    pub(super) fn deepen(&self, out: &mut [u8], row: usize) {
        if self.crushed.is_none() || self.deep == 0.0 {
            return;
        }
        for (out, spot) in out.iter_mut().zip(&self.room.spot[row * self.stride..]) {
            let deep = f32::from(spot.deep) * self.deep;
            *out = (*out).max(if deep < 255.0 { round(deep) as u8 } else { 255 });
        }
    }

    /// Whether cracks are fainter where material has broken off.
    #[inline(always)]
    pub(super) const fn is_bare(&self) -> bool {
        self.bare > 0.0
    }

    /// Share of a crack that is visible on the floor where material has broken off.
    #[inline(always)]
    pub(super) fn left(&self, place: usize) -> f32 {
        let deep = (f32::from(self.room.spot[place].deep) * self.hides).min(1.0);
        1.0 - self.bare * deep
    }

    #[inline(always)]
    pub(super) fn spot(&self, place: usize) -> Spot {
        self.room.spot[place]
    }
}

/// The visible sides of plates in a hole.
pub(super) struct Side {
    /// How visible cracks are: those at the edge of the hole.
    pub(super) line: f32,
    /// Brightness of the side, and the tone of its plate.
    pub(super) face: f32,
    pub(super) tone: f32,
}

/// The appearance of a plate.
#[derive(Clone, Copy)]
pub(super) struct Facet {
    /// Factor for the picture in the middle of the plate.
    tone: f32,
    /// Strength of the dish, its centre, and the inverse of the side of a square of the same area.
    dish: f32,
    centre: Vec2,
    inv_side: f32,
    /// Whether it is missing in a hole (`true`) or whole beside one (`false`).
    pub(super) is_gone: Option<bool>,
    /// Offset of the picture that it shows, texels.
    pub(super) shift: [i32; 2],
    pub(super) tilt: [f32; 2],
    /// Cover of the reflection at the centre of the field, and its increase per texel to the right and down, before
    /// it is clamped to `low..=high`.
    sheen: f32,
    gain: Vec2,
    low: f32,
    high: f32,
}

impl Facet {
    pub(super) const NONE: Self = Self {
        tone: 1.0,
        dish: 0.0,
        centre: Vec2::ZERO,
        inv_side: 0.0,
        is_gone: None,
        shift: [0; 2],
        tilt: [0.0; 2],
        sheen: 0.0,
        gain: Vec2::ZERO,
        low: 0.0,
        high: 0.0,
    };

    /// Offset of a texel from the middle of the plate, about 1 at its rim.
    #[inline(always)]
    fn off_middle(&self, at: Vec2) -> Vec2 {
        ((at - self.centre) * (2.0 * self.inv_side)).clamp(Vec2::NEG_ONE, Vec2::ONE)
    }

    /// Factor for the picture at a texel: a dish is brighter where it faces the light from the upper left, and at its
    /// rim.
    #[inline(always)]
    pub(super) fn tone(&self, x: u32, y: u32) -> f32 {
        if self.dish <= 0.0 {
            return self.tone;
        }
        let way = self.off_middle(Vec2::new(x as f32, y as f32));
        self.tone + self.dish * (0.5 * (way.x + way.y) + 0.5 * way.length_squared() - 0.25)
    }

    /// Cover of the reflection at a texel.
    #[inline(always)]
    pub(super) fn sheen(&self, x: u32, y: u32) -> f32 {
        let sheen = self.sheen + x as f32 * self.gain.x + y as f32 * self.gain.y;
        if sheen < self.low {
            self.low
        } else if sheen > self.high {
            self.high
        } else {
            sheen
        }
    }
}

impl Facets {
    /// The appearance of a plate.
    pub(super) fn of(&self, plate: &Plate) -> Facet {
        let [a, b, c, d, e, f] = plate.draws;
        let [together, right, down] = plate.common.map(|common| self.similarity * common);
        let (own, a) = (1.0 - 0.5 * self.similarity, a * (1.0 - 0.5 * self.similarity) + together);
        let (b, c, d) = (own * b + right, own * c + down, d + 0.7 * right);
        let share = if self.fade > 0.0 { (2.0 - 2.0 * plate.away / self.fade).clamp(0.0, 1.0) } else { 1.0 };
        let weight = (1.0 - self.falloff + self.falloff * plate.near) * (share * share * (3.0 - 2.0 * share));
        let lean = Vec2::new(b, c);
        let shift = (self.shift * weight * lean).round().as_ivec2().to_array();
        // A few plates flash. Of the others, those that lean towards the light shine a little.
        let strength = if d > 1.0 - 2.0 * self.bright_share { 0.45 + 0.55 * e.abs() } else { 0.25 * f.max(0.0) };
        // In patches: brighter towards the middle of a patch, with small random differences.
        let glow = (1.15 * plate.common[0] + 0.34 * d + 0.35 * plate.common[2]).clamp(0.0, 1.0);
        let strength = strength + self.patch_share * (glow * (0.55 + 0.45 * e.abs()) - strength);
        let high = self.reflection * strength * weight.sqrt();
        let low = 0.25 * high;
        let gain = lean.normalize_or(Vec2::Y) * (high - low) * plate.inv_side;
        let sheen = 0.5 * (low + high) - gain.dot(plate.centre);
        Facet {
            tone: 1.0 + self.tone * weight * a,
            dish: self.concavity * weight * (0.7 + 0.3 * e),
            centre: plate.centre,
            inv_side: plate.inv_side,
            is_gone: None,
            shift,
            tilt: (self.tilt * weight * lean).to_array(),
            sheen,
            gain,
            low,
            high,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLATE: Plate = Plate {
        centre: Vec2::new(50.0, 60.0),
        inv_side: 0.05,
        near: 0.5,
        away: 0.1,
        extent: 14.0,
        draws: [0.5, -0.3, 0.8, 0.1, 0.4, -0.6],
        common: [0.9, -0.4, 0.2],
    };

    /// Plates fade out at the given distance, and are unchanged near the hit.
    #[test]
    fn plates_fade_out() {
        let facets = Facets { fade: 0.4, concavity: 0.2, ..Facets::DEFAULT };
        let tone = |away: f32| facets.of(&Plate { away, ..PLATE }).tone(58, 66) - 1.0;
        assert_eq!(tone(0.1), Facets { fade: 0.0, ..facets }.of(&PLATE).tone(58, 66) - 1.0);
        assert!(tone(0.3).abs() < tone(0.1).abs() && tone(0.4) == 0.0 && tone(2.0) == 0.0);
    }

    /// A dish is brighter on the side that faces the light, by at most its parameter.
    #[test]
    fn dishes_are_lit_from_the_upper_left() {
        let facets = Facets { tone: 0.0, concavity: 0.2, ..Facets::DEFAULT };
        let facet = facets.of(&PLATE);
        assert!(facet.tone(57, 67) > 1.02 && facet.tone(43, 53) < 1.0);
        let all = (0..200).flat_map(|y| (0..200).map(move |x| (x, y))).map(|(x, y)| facet.tone(x, y));
        assert!(all.into_iter().all(|tone| (0.7..=1.4).contains(&tone)));
    }

    /// Neighbours are as similar as the parameter says.
    #[test]
    fn bundles_share_their_tone() {
        let spread = |bundle: f32| {
            let facets = Facets { tone: 0.4, similarity: bundle, ..Facets::DEFAULT };
            let tone = |a: f32| facets.of(&Plate { draws: [a; 6], ..PLATE }).tone(50, 60);
            tone(1.0) - tone(-1.0)
        };
        assert!(spread(1.0) < 0.6 * spread(0.0));
    }
}
