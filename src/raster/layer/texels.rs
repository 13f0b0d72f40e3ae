//! Crushed zones, texel by texel.

use super::{
    bruise::{Bruise, craze},
    crushed::CrushedZone,
    noise::noise,
    outline::WIDEST,
    row::{Row, TexelRow, WIDE, ZEROS, span},
    shape::{BruiseSpread, Place, Shape},
    spot::{SLOPE_UNIT, Spot, TILE, Tile},
};
use crate::{math::vectorized, raster::TexelRect};
use core::ops::Range;
use glam::{UVec2, Vec2};

/// Bumps around an outline: what they are drawn from, and how many there are.
const WIDE_BUMPS: (u32, f32) = (2, 1.3);
const FINE_BUMPS: (u32, f32) = (3, 3.7);

/// Least distance at which a place has a direction, texels.
const NEAREST: f32 = 1.0e-3;

/// Noise around an outline.
#[inline(always)]
fn round(seed: u32, way: Vec2, (k, times): (u32, f32)) -> f32 {
    noise(seed ^ k, way.x * times + 17.0, way.y * times + 31.0)
}

/// Noise along a row of a zone that does not break off: its floor, its edge, and the dust around it.
struct Grains {
    fine: Row,
    coarse: Row,
    specks: Row,
    edge: [Row; 2],
    dust: Row,
}

impl Grains {
    const NONE: Self = Self { fine: ZEROS, coarse: ZEROS, specks: ZEROS, edge: [ZEROS; 2], dust: ZEROS };
}

impl Shape<'_> {
    /// Draws it over the texels `rect` of a tile whose first texel is at `corner`.
    pub(super) fn draw(&self, texels: &mut Tile, centre: Vec2, seed: u32, rect: TexelRect, corner: UVec2) {
        // Heights around each texel are needed for its slope.
        let mut places = [Place::NONE; WIDE * WIDE];
        let (size, first) = (rect.size().as_usizevec2(), rect.min.as_vec2() - 0.5);
        let row = |y: usize| TexelRow { first: first + Vec2::new(0.0, y as f32), centre };
        match &self.broken {
            Some(broken) => {
                for (y, places) in places.chunks_exact_mut(WIDE).enumerate().take(size.y + 2) {
                    self.break_off(&mut places[..size.x + 2], broken, row(y), seed);
                }
            }
            None => {
                let bruised = self.bruised(size.y + 2, row, seed);
                for (y, places) in places.chunks_exact_mut(WIDE).enumerate().take(size.y + 2) {
                    let row = row(y);
                    let texels = span(0..size.x + 2, |k| !self.is_beyond(row.off(k).length()));
                    let grains = self.grains(row, &texels, seed);
                    for k in texels {
                        let bruised = bruised.as_ref().map(|all| all[y * WIDE + k]);
                        places[k] = self.place(row.off(k), row.at(k), (&grains, k), bruised, seed);
                    }
                }
            }
        }
        let corner = (rect.min - corner).as_usizevec2();
        for y in 0..size.y {
            for x in 0..size.x {
                let at = (y + 1) * WIDE + x + 1;
                let slope = |step: usize| {
                    let slope = 0.5 * (places[at - step].height - places[at + step].height);
                    (slope * SLOPE_UNIT).clamp(-32_000.0, 32_000.0) as i16
                };
                let Place { height, pale, shade, dark, pit } = places[at];
                let deep = if self.depth > 0.0 { -height / self.depth } else { 0.0 };
                let spot = Spot {
                    // Nothing is lit in a hole.
                    slope: if dark > 0.5 { [0; 2] } else { [slope(1), slope(WIDE)] },
                    pale: (pale.clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
                    shade: (shade * 128.0).clamp(-127.0, 127.0) as i8,
                    dark: (dark.clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
                    deep: (deep.clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
                    pit,
                };
                let texel = &mut texels[(y + corner.y) * TILE as usize + x + corner.x];
                *texel = texel.with(spot);
            }
        }
    }

    /// Whether a zone ends nearer to the hit than this; no outline extends further.
    pub(super) fn is_beyond(&self, distance: f32) -> bool {
        let CrushedZone { ragged, flake, reach, .. } = *self.crushed;
        distance / self.radius.max(0.5) > reach.max(flake).max(1.0 + WIDEST * ragged) + 0.1
    }

    /// How a bruise spreads over some rows, and its crossing cracks. `None` if there is none.
    fn bruised(
        &self,
        rows: usize,
        row: impl Fn(usize) -> TexelRow,
        seed: u32,
    ) -> Option<Box<[(BruiseSpread, Bruise); WIDE * WIDE]>> {
        if self.crushed.needles <= 0.0 {
            return None;
        }
        let mut all = Box::new([(BruiseSpread::default(), Bruise::default()); WIDE * WIDE]);
        let mut left = [0.0; WIDE * WIDE];
        for y in 0..rows {
            let row = row(y);
            let texels = span(0..WIDE, |k| !self.is_beyond(row.off(k).length()));
            let (mut clouds, [mut wide, mut fine]) = (ZEROS, [ZEROS; 2]);
            vectorized(
                #[inline(always)]
                || {
                    let way = |at: Vec2| (at - row.centre).normalize_or_zero();
                    row.fill(&mut clouds, &texels, |at| self.cloud(at, seed));
                    row.fill(&mut wide, &texels, |at| round(seed, way(at), WIDE_BUMPS));
                    row.fill(&mut fine, &texels, |at| round(seed, way(at), FINE_BUMPS));
                },
            );
            for k in texels {
                let distance = row.off(k).length();
                if !self.is_beyond(distance) {
                    let spread = self.spread_of_bruise(distance, clouds[k], [wide[k], fine[k]]);
                    (all[y * WIDE + k].0, left[y * WIDE + k]) = (spread, spread.left);
                }
            }
        }
        if self.crushed.crazing > 0.0 {
            let (mut cracks, mut flakes) = ([0.0; WIDE * WIDE], [0.0; WIDE * WIDE]);
            let TexelRow { first, centre } = row(0);
            craze([&mut cracks, &mut flakes], &left[..rows * WIDE], (first, centre), self.radius, seed);
            for ((all, crack), flake) in all.iter_mut().zip(cracks).zip(flakes) {
                all.1 = Bruise { crack, flake };
            }
        }
        Some(all)
    }

    /// Noise along some texels of a row.
    fn grains(&self, row: TexelRow, texels: &Range<usize>, seed: u32) -> Grains {
        let CrushedZone { ragged, dust, .. } = *self.crushed;
        let inside = span(texels.clone(), |k| row.off(k).length() / self.radius.max(0.5) <= 1.0 + WIDEST * ragged);
        let mut found = Grains::NONE;
        vectorized(
            #[inline(always)]
            || {
                let grain = |at: Vec2, k: u32, size: f32| noise(seed ^ k, at.x / size, at.y / size);
                let way = |at: Vec2| {
                    let off = at - row.centre;
                    off / off.length().max(NEAREST)
                };
                row.fill(&mut found.fine, &inside, |at| grain(at, 1, self.grain));
                row.fill(&mut found.coarse, &inside, |at| grain(at, 4, 2.3 * self.grain));
                row.fill(&mut found.specks, &inside, |at| grain(at, 5, 0.6 * self.grain));
                let [wide, fine] = &mut found.edge;
                row.fill(wide, &inside, |at| round(seed, way(at), WIDE_BUMPS));
                row.fill(fine, &inside, |at| round(seed, way(at), FINE_BUMPS));
                if dust > 0.0 {
                    row.fill(&mut found.dust, texels, |at| grain(at, 6, 5.0 * self.grain));
                }
            },
        );
        found
    }

    /// The content of a place that does not break off; `off` is the offset from the centre, `at` the position in the field, `k` its texel in
    /// the row.
    fn place(
        &self,
        off: Vec2,
        at: Vec2,
        (grains, k): (&Grains, usize),
        bruised: Option<(BruiseSpread, Bruise)>,
        seed: u32,
    ) -> Place {
        let CrushedZone { ragged, soft, hole, pale, speckle, flake, dust, chips, reach, .. } = *self.crushed;
        let mut place = Place::NONE;
        let distance = off.length();
        let radii = distance / self.radius.max(0.5);
        let widest = 1.0 + WIDEST * ragged;
        if self.is_beyond(distance) {
            return place;
        }
        let way = off / distance.max(NEAREST);
        let mut inside = 0.0;
        if let Some((spread, crazed)) = bruised {
            self.add_bruise(&mut place, off, spread, crazed, seed);
        }
        if radii <= widest {
            let fine = grains.fine[k];
            let edge = 1.0 + ragged * (0.55 * grains.edge[0][k] + 0.35 * grains.edge[1][k] + 0.2 * fine);
            let outline = (self.radius * edge).max(0.5);
            // An edge one texel wide.
            inside = (outline - distance + 0.5).clamp(0.0, 1.0);
            if inside > 0.0 {
                let coarse = grains.coarse[k];
                let rest = (1.0 - distance / outline).clamp(0.0, 1.0);
                let fade = inside + soft * ((1.5 * rest).min(1.0) - inside);
                // A broken edge is steep; a soft one has no wall.
                let bowl = rest.sqrt() + soft * (rest * rest - rest.sqrt());
                place.height += -self.depth * bowl + fade * self.rough * (0.6 * coarse + 0.4 * fine);
                let specks = 1.0 - speckle * (0.5 + 0.5 * grains.specks[k]).clamp(0.0, 1.0);
                place.pale = place.pale.max(pale * fade * specks * (1.0 - self.crushed.needles));
                place.shade += speckle * (0.6 * coarse + 0.3 * fine) * inside * (1.0 - self.crushed.needles);
            }
        }
        if flake > 1.0 {
            self.add_flake(&mut place, way, radii, seed);
        }
        if (inside < 1.0 || self.crushed.needles > 0.0) && radii < reach {
            let left = 1.0 - ((radii - 0.8) / (reach - 0.8)).clamp(0.0, 1.0);
            if dust > 0.0 {
                let cloud = 0.65 + 0.35 * grains.dust[k];
                let powder = inside * (1.0 - self.crushed.needles);
                place.pale = place.pale.max(dust * left * left * cloud * (1.0 - powder));
            }
            self.add_crumb(&mut place, at, chips * left * left, seed);
        }
        for &(middle, radius) in &self.bubbles {
            let (off, out) = (off - middle, off.distance(middle));
            let inside = (radius + 0.5 - out).clamp(0.0, 1.0);
            if inside > 0.0 {
                // A bright ring, brighter where the light leaves it, and a highlight.
                let ring = (1.0 - (radius - 0.7 - out).abs() / 1.2).clamp(0.0, 1.0);
                let leaves = 0.5 + 0.35 * (off.x + off.y) / out.max(0.5);
                let light = (0.34 * radius + 0.5 - (off + 0.38 * radius).length()).clamp(0.0, 1.0);
                let white = (ring * leaves).max(light);
                place.pale += (white.max(0.10) - place.pale) * (0.8 * inside);
                place.shade += (0.3 * white - 0.25 * (1.0 - white) - place.shade) * inside;
            }
        }
        if let Some(hole) = self.hole {
            self.add_hole(&mut place, hole, off);
        } else if hole > 0.0 && radii <= hole * (1.0 + WIDEST * ragged) + 1.0 {
            let bumps = round(seed, way, (7, 1.9)) + 0.5 * round(seed, way, (8, 4.3));
            let radius = self.radius * hole * (1.0 + 0.6 * ragged * bumps);
            place.dark = (radius - distance + 0.5).clamp(0.0, 1.0);
        }
        place
    }
}
