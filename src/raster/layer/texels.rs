//! Crushed zones, texel by texel.

use super::{
    bruise::{Bruise, craze},
    crushed::CrushedZone,
    noise::noise,
    outline::WIDEST,
    row::{Row, TexelRow, WIDE, ZEROS, span},
    shape::{BruiseSpread, Place, Shape, TO_LIGHT},
    spot::{SLOPE_UNIT, Spot, TILE, Tile},
};
use crate::{
    math::{smooth, vectorized},
    raster::TexelRect,
};
use core::ops::Range;
use glam::{UVec2, Vec2};

/// Bumps around an outline: what they are drawn from, and how many there are.
const WIDE_BUMPS: (u32, f32) = (2, 1.3);
const FINE_BUMPS: (u32, f32) = (3, 3.7);
const FINE_RAYS: (u32, f32) = (12, 5.5);

/// How far loose material is thrown up beyond the edge of a zone, in its radii.
const THROWN: f32 = 0.7;

/// How round the edge of a bowl of loose material is, as a share of its depth, and where the crest of its rim is, in shares of the distance of the edge:
/// beyond that it does not go up any more.
const ROUND: f32 = 0.05;
const CREST: f32 = 1.08;

/// How far the edge of such a bowl deviates at most, at a raggedness of 1.
const BUMPS: f32 = 0.9;

/// How much darker and how much brighter loose material is for each unit of its slope away from the light and towards it.
const IN_SHADE: f32 = 0.5;
const IN_LIGHT: f32 = 0.14;

/// How much the height of a rim varies around it.
const RAYS: f32 = 0.8;

/// Distance on either side over which its slope is measured, in the same shares.
const NEAR: f32 = 0.03;

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
    rays: Row,
}

impl Grains {
    const NONE: Self = Self { fine: ZEROS, coarse: ZEROS, specks: ZEROS, edge: [ZEROS; 2], dust: ZEROS, rays: ZEROS };
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
        let deepest = if self.crushed.rim > 0.0 { self.depth * self.enlarged } else { self.depth };
        for y in 0..size.y {
            for x in 0..size.x {
                let at = (y + 1) * WIDE + x + 1;
                let slope = |step: usize| {
                    let slope = 0.5 * (places[at - step].height - places[at + step].height);
                    (slope * SLOPE_UNIT).clamp(-32_000.0, 32_000.0) as i16
                };
                let Place { height, pale, shade, dark, pit } = places[at];
                let deep = if deepest > 0.0 { -height / deepest } else { 0.0 };
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
        let CrushedZone { dust, .. } = *self.crushed;
        let inside = span(texels.clone(), |k| row.off(k).length() / self.radius.max(0.5) <= self.outside_rim());
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
                if self.crushed.rim > 0.0 {
                    row.fill(&mut found.rays, &inside, |at| round(seed, way(at), FINE_RAYS));
                }
                if dust > 0.0 {
                    row.fill(&mut found.dust, texels, |at| grain(at, 6, 5.0 * self.grain));
                }
            },
        );
        found
    }

    /// Distance beyond which there is no zone and no rim around it, only dust and crumbs; radii.
    fn outside_rim(&self) -> f32 {
        let CrushedZone { ragged, rim, .. } = *self.crushed;
        let widest = 1.0 + WIDEST * ragged;
        if rim > 0.0 { widest.max(CREST * (1.0 + BUMPS * ragged) + THROWN) } else { widest }
    }

    /// How far a rim goes beyond its crest, where the edge is so many radii away; radii. It ends within reach.
    fn rim_width(&self, edge: f32) -> f32 {
        THROWN.min(self.crushed.reach - CREST * edge).max(0.0)
    }

    /// How much of what was thrown up lies at a distance beyond the crest, in shares of the distance of the edge: 1 = all, up to the crest.
    fn thrown_there(&self, share: f32, edge: f32) -> f32 {
        1.0 - smooth(((share - CREST) * edge / self.rim_width(edge).max(NEAREST)).clamp(0.0, 1.0))
    }

    /// Height of a bowl of loose material with a rim around it at a distance from the hit, in shares of the distance of the edge in that direction, which is `edge`
    /// radii away. The slopes are the same at all energies: loose material is never steeper.
    fn bowl_with_rim(&self, share: f32, edge: f32) -> f32 {
        let square = 1.0 - share * share;
        let sunk = if square > ROUND {
            square
        } else {
            let rest = (square + ROUND).max(0.0);
            rest * rest / (4.0 * ROUND)
        };
        // Where the zone ends early there is less of the rim.
        let high = self.crushed.rim * self.rim_width(edge) / THROWN;
        let thrown = if share < CREST { smooth((share / CREST).max(0.0)) } else { self.thrown_there(share, edge) };
        self.depth * self.enlarged * (high * thrown - sunk)
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
        if self.is_beyond(distance) {
            return place;
        }
        let way = off / distance.max(NEAREST);
        let mut inside = 0.0;
        if let Some((spread, crazed)) = bruised {
            self.add_bruise(&mut place, off, spread, crazed, seed);
        }
        if radii <= self.outside_rim() {
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
                let sunk = if self.crushed.rim > 0.0 { 0.0 } else { self.depth * bowl };
                place.height += -sunk + fade * self.rough * (0.6 * coarse + 0.4 * fine);
                let specks = 1.0 - speckle * (0.5 + 0.5 * grains.specks[k]).clamp(0.0, 1.0);
                place.pale = place.pale.max(pale * fade * specks * (1.0 - self.crushed.needles));
                place.shade += speckle * (0.6 * coarse + 0.3 * fine) * inside * (1.0 - self.crushed.needles);
            }
        }
        if self.crushed.rim > 0.0 && radii <= self.outside_rim() {
            let bumps = (0.55 * grains.edge[0][k] + 0.35 * grains.edge[1][k]).clamp(-BUMPS, BUMPS);
            let edge = (1.0 + ragged * bumps).max(0.5);
            let share = radii / edge;
            // More of it lies where more was thrown, in rays.
            let rays = 1.0 + RAYS * grains.rays[k] * smooth((2.0 * share - 1.0).clamp(0.0, 1.0));
            place.height += rays * self.bowl_with_rim(share, edge);
            // It shows the light, and covers what it lies on.
            let [low, high] = [-NEAR, NEAR].map(|by| self.bowl_with_rim(share + by, edge));
            let rise = (high - low) / (2.0 * NEAR * edge * self.radius.max(0.5));
            let cover = self.thrown_there(share, edge) * (1.0 - self.crushed.needles);
            place.pale = place.pale.max(pale * cover * rays.min(1.0));
            let light = -rise * way.dot(TO_LIGHT) * cover;
            place.shade += if light < 0.0 { IN_SHADE * light } else { IN_LIGHT * light };
        }
        if flake > 1.0 {
            self.add_flake(&mut place, way, radii, seed);
        }
        if self.crushed.rim > 0.0 {
            self.add_clod(&mut place, off, at, seed);
        }
        if (inside < 1.0 || self.crushed.needles > 0.0) && radii < reach {
            let left = self.left_at(radii);
            if dust > 0.0 {
                let cloud = 0.65 + 0.35 * grains.dust[k];
                let powder = inside * (1.0 - self.crushed.needles);
                place.pale = place.pale.max(dust * left * left * cloud * (1.0 - powder));
            }
            if self.crushed.rim <= 0.0 {
                self.add_crumb(&mut place, at, chips * left * left, seed);
            }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::Rng, pattern::NO_BRICKS, raster::layer::shape::Pieces};

    /// Loose material is deepest at the hit, rises to a rim, falls to nothing within reach, without a step, and is as steep at all energies.
    #[test]
    fn loose_material_forms_a_bowl_with_a_rim() {
        let mut rng = Rng::new(6);
        for seed in 0..200 {
            let crushed = CrushedZone {
                rim: rng.range(0.05, 1.0),
                reach: rng.range(1.0, 4.0),
                ragged: rng.unit(),
                ..CrushedZone::DEFAULT
            };
            let (unit, enlarged) = (512.0, rng.range(0.5, 4.0));
            let radius = crushed.radius * unit * enlarged;
            let pieces = Pieces::new(&crushed, unit, radius, seed, &NO_BRICKS);
            let shape = Shape::near(&crushed, unit, radius, &pieces, [Vec2::splat(-9.0), Vec2::splat(9.0)]);
            let (edge, deep) = (rng.range(0.5, 1.9), crushed.depth * unit * enlarged);
            let heights: Vec<f32> = (0..=2000).map(|k| shape.bowl_with_rim(k as f32 * 1.0e-3 * 4.0, edge)).collect();
            assert!((heights[0] + deep).abs() < 1.0e-3 * deep, "seed {seed}: {} of {deep}", heights[0]);
            let highest = (0..=2000).max_by(|a, b| heights[*a].total_cmp(&heights[*b])).unwrap();
            assert!(heights[..=highest].is_sorted(), "seed {seed}: it goes down before the rim");
            assert!(heights[highest..].iter().rev().is_sorted(), "seed {seed}: it goes up beyond the rim");
            assert!(heights[highest] <= crushed.rim * deep * 1.001, "seed {seed}: the rim is too high");
            // The bowl alone goes a little beyond its edge.
            let end = crushed.reach.max(CREST * edge);
            let at = |radii: f32| (radii / edge * 250.0).ceil() as usize;
            assert!(
                heights[at(end)..].iter().all(|height| height.abs() < 1.0e-3 * deep),
                "seed {seed}: it does not end"
            );
            let outside = shape.outside_rim().max(CREST * edge);
            let is_drawn =
                edge > 1.0 + BUMPS * crushed.ragged || heights[at(outside)..].iter().all(|height| *height == 0.0);
            assert!(is_drawn, "seed {seed}: it is cut off");
            let steepest = heights.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
            // A parabola falls by 2 at its edge, a smooth step by 1.5 in its middle.
            let most = 2.2 * deep + crushed.rim * deep * 1.5 * (edge / THROWN).max(1.0 / CREST);
            assert!(steepest <= most * 0.004 * 1.01, "seed {seed}: a step of {steepest}");
        }
    }

    /// Clods and their shadows lie within the squares of their lattice, so that none is cut off.
    #[test]
    fn clods_are_whole() {
        let mut rng = Rng::new(7);
        let mut many = 0;
        for seed in 0..200 {
            let crushed =
                CrushedZone { rim: 0.5, chips: 1.0, reach: 8.0, grain: rng.range(0.001, 0.02), ..CrushedZone::DEFAULT };
            let (unit, radius) = (512.0, 60.0);
            let pieces = Pieces::new(&crushed, unit, radius, seed, &NO_BRICKS);
            let shape = Shape::near(&crushed, unit, radius, &pieces, [Vec2::splat(-9.0), Vec2::splat(9.0)]);
            let centre = Vec2::new(rng.range(0.0, 90.0), rng.range(0.0, 90.0));
            let clod_at = |at: Vec2| {
                let mut place = Place::NONE;
                shape.add_clod(&mut place, at - centre, at, seed);
                place.height.abs() + place.shade.abs() + place.pale
            };
            let side = 10.0 * shape.grain;
            for _ in 0..200 {
                let along = rng.range(-80.0, 80.0);
                let across = side * (rng.range(-80.0, 80.0) / side).round() + rng.range(-1.0e-3, 1.0e-3);
                for at in [Vec2::new(along, across), Vec2::new(across, along)] {
                    assert_eq!(clod_at(at), 0.0, "seed {seed} at {at}");
                }
                many += usize::from(clod_at(Vec2::new(along, rng.range(-80.0, 80.0))) > 0.0);
            }
        }
        assert!(many > 200, "{many} places have a clod");
    }
}
