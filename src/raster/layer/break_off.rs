//! Material that breaks off along chords: outlines, facets, chips and their shadows.

use super::{
    broken::{Broken, Chip, LONG_SHADOW, NearBroken, SHADOW},
    crushed::CrushedZone,
    draws,
    ledges::{BRIGHTEST, LEDGE_LIT, LEDGE_SHADE, SAG, ledge_light},
    noise::{draw, lattice, noise},
    outline::FAR_OUT,
    row::{Row, TexelRow, WIDE, ZEROS, span},
    shape::{Place, Shape, TO_LIGHT},
    spot::PIT_STEPS,
    stone::{Cell, Stone, facets},
};
use crate::math::vectorized;
use core::ops::Range;
use glam::Vec2;

/// Share of the depth that lies outside the basin.
const SHELF: f32 = 0.5;

/// The same where there are several steps down.
const EDGE: f32 = 0.42;

/// Share of that depth which is gained on the way to the middle.
const BOWL: f32 = 0.4;

/// Horizontal extent of a wall, in units of its height.
const WALL: f32 = 0.45;

const SHADE: f32 = 0.5;

const DEEP_SHADE: f32 = 0.72;

/// How much brighter a wall is that faces the light.
const LIT: f32 = 0.45;

/// Horizontal extent of the slopes inside it, in units of their height: so long that those of several ledges are one.
const LEDGE_FALL: f32 = 7.0 * WALL;
const STEP_FALL: f32 = 4.0 * WALL;

/// Strength of the shadow of the step down to the basin, as a share of that of the edge.
const STEP_SHADE: f32 = 0.3;

/// Strength of the shadow at this distance from the edge that casts it.
fn sink(within: f32, soft: f32) -> f32 {
    (0.5 - within / soft).clamp(0.0, 1.0)
}

/// How chips are lit.
struct ChipLight {
    /// Length of the shadow, in sizes of the chip, and how dark it is.
    length: f32,
    shade: f32,
    /// How much brighter the chip is than the surface, and its side towards the light than the one away from it.
    tone: f32,
    sides: f32,
    /// Share of the crushed colour in it.
    pale: f32,
}

impl ChipLight {
    /// Flat chips of the surface itself.
    const PLAIN: Self = Self { length: 0.35, shade: SHADE, tone: 0.0, sides: 0.0, pale: 0.3 };

    /// Lumps that show where they broke.
    const FRESH: Self = Self { length: 0.42, shade: 1.7 * SHADE, tone: 0.2, sides: 0.6, pale: 0.6 };
}

/// Texels over which a hard shadow ends.
const HARD: f32 = 1.0 / 0.6;

/// Noise along a row of what has broken off.
struct Crumbling {
    /// Bumps of the edge, wide and fine: where a place is, where its shadow falls from, and where its light comes from.
    edge: [[Row; 2]; 3],
    /// Deviation of the edges of steps.
    basin: Row,
    /// How much of a slope walls are.
    slope: Row,
    plates: Row,
    small: Row,
    coarse: Row,
    broad: Row,
    pits: Row,
    lumps: [Row; 2],
    powder: Row,
    patches: Row,
    /// Dust around it: fine, in streaks, and in heaps of three sizes.
    dust: Row,
    streaks: Row,
    heaps: [Row; 3],
}

impl Crumbling {
    const NONE: Self = Self {
        edge: [[ZEROS; 2]; 3],
        basin: ZEROS,
        slope: ZEROS,
        plates: ZEROS,
        small: ZEROS,
        coarse: ZEROS,
        broad: ZEROS,
        pits: ZEROS,
        lumps: [ZEROS; 2],
        powder: ZEROS,
        patches: ZEROS,
        dust: ZEROS,
        streaks: ZEROS,
        heaps: [ZEROS; 3],
    };
}

/// How light falls on a floor: the share of the depth that lies at the edge, the length of shadows in units of the height of the caster and how
/// dark they are, and the distances of what casts them and of what lights a wall, texels.
struct Light {
    share: f32,
    long: f32,
    shade: f32,
    length: f32,
    facing: f32,
}

impl Shape<'_> {
    /// Distance of a place from the edge of the broken-off area, crumbling included; positive inside. `bumps` are those at that place.
    fn crumbled(&self, within: f32, bumps: [f32; 2]) -> f32 {
        if self.jag <= 0.0 || within < -1.0 {
            return within;
        }
        let [wide, fine] = bumps.map(|bump| 0.5 + 0.5 * bump);
        within - self.jag * (1.3 * wide + 0.7 * fine)
    }

    /// Adds what is along a row in material that breaks along chords.
    pub(super) fn break_off(&self, places: &mut [Place], broken: &NearBroken, row: TexelRow, seed: u32) {
        let mut is_within = [false; WIDE];
        for (k, is_within) in is_within.iter_mut().enumerate().take(places.len()) {
            *is_within = !self.is_beyond(row.off(k).length());
        }
        let texels = span(0..places.len(), |k| is_within[k]);
        if texels.is_empty() {
            return;
        }
        let mut noise = Crumbling::NONE;
        vectorized(
            #[inline(always)]
            || self.fill_edge(&mut noise.edge[0], row, &texels, Vec2::ZERO, seed),
        );
        let mut within = ZEROS;
        for k in texels.clone() {
            within[k] =
                self.crumbled(broken.within_at_most(row.off(k), f32::INFINITY), noise.edge[0].map(|bumps| bumps[k]));
        }
        let inside = within.map(|within| (within + 0.5).clamp(0.0, 1.0));
        let floor = span(texels.clone(), |k| inside[k] > 0.0 && is_within[k]);
        let mut left = ZEROS;
        for k in texels.clone().filter(|&k| inside[k] < 1.0 && is_within[k]) {
            left[k] = self.left_around(row.off(k));
        }
        // Where nothing is left there is neither dust nor a crumb.
        let around = span(texels.clone(), |k| left[k] > 0.0);
        vectorized(
            #[inline(always)]
            || {
                self.fill_floor(&mut noise, broken.whole, row, &floor, seed);
                self.fill_around(&mut noise, broken.whole, row, &around, seed);
            },
        );
        let is_beside = |chip: &&&Chip| {
            let outline = &chip.outline;
            (row.off(0).y - outline.centre.y).abs() <= 2.0 * outline.reach + 3.0
        };
        let chips: Vec<&Chip> = broken.chips.iter().filter(is_beside).copied().collect();
        for k in texels.filter(|&k| is_within[k]) {
            let (at, off) = (row.at(k), row.off(k));
            let place = &mut places[k];
            if inside[k] > 0.0 {
                self.add_floor(place, broken, &noise, (k, within[k], inside[k]), (off, at), seed);
            }
            if left[k] > 0.0 {
                self.add_around(place, broken.whole, &noise, (k, inside[k], left[k]), at, seed);
            }
            self.add_pieces(place, broken.whole, &chips, off, at, seed);
        }
    }

    /// The bumps of an edge beside each texel.
    #[inline(always)]
    fn fill_edge(&self, [wide, fine]: &mut [Row; 2], row: TexelRow, texels: &Range<usize>, by: Vec2, seed: u32) {
        if self.jag > 0.0 {
            let sides = [(3.5 * self.jag).max(3.0), (1.2 * self.jag).max(1.3)];
            let bump = |k: u32, at: Vec2, size: f32| noise(seed ^ k, at.x / size, at.y / size);
            row.fill(wide, texels, |at| bump(draws::JAG_WIDE, at + by, sides[0]));
            row.fill(fine, texels, |at| bump(draws::JAG_FINE, at + by, sides[1]));
        }
    }

    /// Noise around what has broken off.
    #[inline(always)]
    fn fill_around(&self, found: &mut Crumbling, broken: &Broken, row: TexelRow, texels: &Range<usize>, seed: u32) {
        let CrushedZone { dust, fall, .. } = *self.crushed;
        if dust > 0.0 {
            row.fill(&mut found.dust, texels, |at| noise(seed ^ 6, 0.7 * at.x, 0.7 * at.y));
            if self.jag > 0.0 && fall > 0.0 {
                let wide = 1.5 * self.grain;
                row.fill(&mut found.streaks, texels, |at| noise(seed ^ 8, at.x / wide, at.y / (7.0 * wide)));
            }
            if broken.has_ledges() {
                self.fill_heaps(&mut found.heaps, row, texels, seed);
            }
        }
    }

    /// Noise on a floor.
    #[inline(always)]
    fn fill_floor(&self, found: &mut Crumbling, broken: &Broken, row: TexelRow, texels: &Range<usize>, seed: u32) {
        let bump = |at: Vec2, k: u32, size: f32| noise(seed ^ k, at.x / size, at.y / size);
        let Light { length, facing, .. } = self.light(broken);
        let crumbles = self.jag > 0.0;
        let [_, dark, lit] = &mut found.edge;
        self.fill_edge(dark, row, texels, TO_LIGHT * length, seed);
        self.fill_edge(lit, row, texels, -(TO_LIGHT * facing), seed);
        if crumbles {
            let wide = (0.35 * self.radius).max(4.0);
            row.fill(&mut found.slope, texels, |at| bump(at, draws::WALL_SLOPE, wide));
        }
        if !broken.steps.is_empty() {
            let side = (3.0 * self.jag).max(2.0);
            row.fill(&mut found.basin, texels, |at| bump(at, draws::BASIN_EDGE, side));
        }
        let fold = |at: Vec2, k: u32, size: f32| {
            let warp =
                Vec2::new(noise(seed ^ k, at.x / size, at.y / size), noise(seed ^ k ^ 9, at.y / size, at.x / size));
            facets(seed ^ k, at / size + 0.45 * warp)
        };
        let (large, small) = ((0.42 * self.radius).max(2.0 * self.grain), 1.7 * self.grain);
        row.fill(&mut found.plates, texels, |at| fold(at, draws::PLATES, large));
        row.fill(&mut found.small, texels, |at| fold(at, draws::SMALL_PLATES, small));
        if broken.has_ledges() {
            row.fill(&mut found.patches, texels, |at| self.edge_patches(at, seed));
        }
        if !crumbles {
            return;
        }
        let (coarse, broad) = (2.2 * self.grain, 0.3 * self.radius + 6.0 * self.grain);
        row.fill(&mut found.coarse, texels, |at| bump(at, draws::COARSE_TONE, coarse));
        row.fill(&mut found.broad, texels, |at| bump(at, draws::BROAD_TONE, broad));
        row.fill(&mut found.pits, texels, |at| {
            // Rotated, so that the lattice of the noise does not show.
            let turned = Vec2::new(0.8 * at.x - 0.6 * at.y, 0.6 * at.x + 0.8 * at.y);
            noise(seed ^ draws::SAND_PITS, 0.42 * turned.x, 0.42 * turned.y)
        });
        // Lumps of several sizes, each turned against the others.
        let lump = |at: Vec2, k: u32, size: f32, [x, y]: [f32; 2]| {
            noise(seed ^ k, (x * at.x - y * at.y) / size, (y * at.x + x * at.y) / size)
        };
        let [wide, fine] = &mut found.lumps;
        row.fill(wide, texels, |at| lump(at, draws::LUMPS, 3.1 * self.grain, [0.92, 0.39]));
        row.fill(fine, texels, |at| lump(at, draws::LUMPS + 1, 1.3 * self.grain, [0.6, 0.8]));
        if broken.has_ledges() {
            row.fill(&mut found.powder, texels, |at| self.powder(at, seed));
        }
    }

    /// How light falls on a floor.
    fn light(&self, broken: &Broken) -> Light {
        let share = match broken.steps.len() {
            0 => 1.0,
            1 => SHELF,
            // A shallow edge, and deeper and deeper steps.
            _ => EDGE,
        };
        let (long, shade) = if self.jag > 0.0 { (LONG_SHADOW, DEEP_SHADE) } else { (SHADOW, SHADE) };
        let (length, facing) = (long * share * self.depth, (1.5 * WALL * share * self.depth).max(1.0));
        Light { share, long, shade, length, facing }
    }

    /// How much of the dust and the crumbs around a hit is left at a place, 0..=1.
    fn left_around(&self, off: Vec2) -> f32 {
        let CrushedZone { reach, fall, .. } = *self.crushed;
        let sunk = 0.8 * fall;
        let radii = (off - Vec2::new(0.0, sunk * self.radius)).length() / self.radius.max(0.5);
        1.0 - ((radii - 0.7) / (reach - 0.7 - sunk).max(0.2)).clamp(0.0, 1.0)
    }

    /// Adds dust and crumbs where nothing has broken off; so much of them is `left` there.
    fn add_around(
        &self,
        place: &mut Place,
        broken: &Broken,
        found: &Crumbling,
        (k, inside, left): (usize, f32, f32),
        at: Vec2,
        seed: u32,
    ) {
        let CrushedZone { dust, chips, fall, .. } = *self.crushed;
        if dust > 0.0 {
            let mut cloud = 0.6 + 0.4 * found.dust[k];
            if self.jag > 0.0 && fall > 0.0 {
                // Dust runs down in streaks.
                cloud *= 1.0 - fall * (0.4 - 0.4 * found.streaks[k]);
            }
            place.pale = place.pale.max(dust * left * left * cloud * (1.0 - inside));
            if broken.has_ledges() {
                self.add_dust(place, found.heaps.each_ref().map(|heaps| heaps[k]), left, 1.0 - inside);
            }
        }
        if self.jag > 0.0 {
            let many = if broken.has_ledges() { 2.0 } else { 1.0 };
            self.add_crumbs(place, at, (many * (1.2 * chips * left).min(0.6) * left).min(0.9), inside, seed);
        } else if self.crushed.outline <= 0.0 {
            self.add_grit(place, at, (chips * left).min(0.5) * left, seed);
        }
    }

    /// Adds strokes, chips and a pit.
    fn add_pieces(&self, place: &mut Place, broken: &Broken, chips: &[&Chip], off: Vec2, at: Vec2, seed: u32) {
        for [from, to] in &broken.ticks {
            // The stroke begins blunt and ends in a point.
            let (along, off) = (*to - *from, off - *from);
            let t = (off.dot(along) / along.length_squared().max(1.0e-6)).clamp(0.0, 1.0);
            let inside = broken.thick * (1.0 - t * t) + 0.5 - (off - along * t).length();
            place.dark = place.dark.max(inside.clamp(0.0, 1.0));
        }
        for chip in chips {
            self.add_chip(place, chip, off, at, seed);
        }
        if let Some(pit) = &broken.pit {
            let (within, inward) = pit.side(off);
            if within > -0.5 {
                // The floor is smaller, and moved towards the light.
                let floor = pit.within((off - TO_LIGHT * (0.2 * pit.reach)) * 1.35);
                let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
                place.pit = [
                    byte((within + 0.5) * PIT_STEPS / 255.0),
                    byte(floor + 0.5),
                    byte(0.5 + 0.5 * inward.dot(TO_LIGHT)),
                ];
            }
        }
    }

    /// The area that has broken off: a steep wall, and a floor in the shadow of the edge.
    fn add_floor(
        &self,
        place: &mut Place,
        near: &NearBroken,
        found: &Crumbling,
        (k, within, inside): (usize, f32, f32),
        (off, at): (Vec2, Vec2),
        seed: u32,
    ) {
        let CrushedZone { pale, speckle, stones, .. } = *self.crushed;
        let (broken, crumbles) = (near.whole, self.jag > 0.0);
        let Light { share, long, shade, length, facing } = self.light(broken);
        let has_ledges = broken.has_ledges();
        // In some places a wall is a slope.
        let run = if crumbles { 0.8 + 1.4 * found.slope[k].max(0.0) } else { 1.0 };
        let wall = (within / (run * WALL * share * self.depth).max(1.0)).clamp(0.0, 1.0);
        let bowl = (within / (0.8 * self.radius).max(1.0)).clamp(0.0, 1.0);
        let hollow = if has_ledges { self.hollow(off) * wall } else { 0.0 };
        let sag = if has_ledges { SAG } else { 0.0 };
        let mut down = share * (wall + BOWL * (bowl - wall)) + (1.0 - share) * sag * hollow;
        // A shadow is soft where the edge that casts it is far away.
        let soft = if crumbles { (0.7 * length).max(HARD) } else { HARD };
        let [_, dark, lit] = found.edge.each_ref().map(|bumps| bumps.each_ref().map(|bumps| bumps[k]));
        // Farther inside there is neither shadow nor light of the edge, however far it crumbles.
        let most = |soft: f32| 0.6 * soft + 2.1 * self.jag;
        let mut shadow = sink(self.crumbled(near.within_at_most(off + TO_LIGHT * length, most(soft)), dark), soft);
        // The wall on the far side faces the light.
        let mut lit = sink(self.crumbled(near.within_at_most(off - TO_LIGHT * facing, most(HARD)), lit), HARD);
        if crumbles {
            // Its faces are turned this way and that.
            lit *= (0.6 + 0.7 * found.small[k]).max(0.0);
        }
        let (mut sunk, mut bright) = (0.0, 0.0f32);
        let one = 1.0 / broken.steps.len().max(1) as f32;
        for step in &broken.steps {
            let long_fall = (if has_ledges { LEDGE_FALL } else { STEP_FALL } * one * self.depth).max(2.0);
            let within = step.within_at_most(off, 1.1 * long_fall + 2.1 * self.jag)
                - 2.0 * self.jag * (0.5 + 0.5 * found.basin[k]);
            let fall = (within / long_fall).clamp(0.0, 1.0);
            let gone = one * fall * fall * (3.0 - 2.0 * fall);
            sunk += gone;
            down += (1.0 - share) * (1.0 - sag) * gone;
            if within > 0.0 {
                let length = long * (1.0 - share) * one * self.depth;
                // The step is lower and rounder than the edge.
                let strength = if has_ledges { LEDGE_SHADE } else { STEP_SHADE };
                shadow = shadow.max(strength * sink(step.within_at_most(off + TO_LIGHT * length, soft), 1.5 * soft));
                if has_ledges {
                    let facing = (2.0 * WALL * one * self.depth).max(1.5);
                    bright = bright
                        .max(LEDGE_LIT * sink(step.within_at_most(off - TO_LIGHT * facing, 1.5 * HARD), 2.0 * HARD));
                }
            }
        }
        let (plate, small) = (found.plates[k], found.small[k]);
        let fade = (0.5 * within).clamp(0.0, 1.0);
        let mut bumps = self.rough * (plate + if crumbles { 0.2 } else { 0.4 } * small) * fade;
        let tone = if crumbles {
            let coarse = found.coarse[k] + 0.7 * found.broad[k];
            let sand = lattice(seed ^ draws::SAND, at.x.floor() as i32, at.y.floor() as i32);
            let pit = found.pits[k];
            let sand = 0.3 * sand + 0.5 * pit - 0.9 * (-pit - 0.55).max(0.0);
            let lumps = 0.9 * found.lumps[0][k] + 0.45 * found.lumps[1][k];
            bumps += self.rough * (lumps + 0.16 * pit) * fade;
            // Less of the sky lights the floor next to the wall.
            let corner = (1.0 - within / (1.3 * self.depth).max(1.0)).clamp(0.0, 1.0);
            let mut tone = 0.30 * coarse + 0.16 * plate + (0.5 - 0.2 * stones) * sand
                - 0.14 * stones
                - 0.6 * corner * wall
                - if has_ledges { 0.0 } else { 0.4 * sunk };
            if has_ledges {
                let powder = found.powder[k] * fade;
                tone += (0.3 + 0.12 * sand - tone) * 0.8 * powder;
                bumps *= 1.0 - 0.5 * powder;
            }
            if stones > 0.0
                && let Some(stone) = Stone::find(seed ^ draws::STONES, at, self.grain, stones)
            {
                let shown = fade * wall;
                tone += (1.8 * stone.tone - 0.7 * tone) * shown;
                bumps += stone.height * shown;
            }
            tone
        } else {
            let stone = Cell::find(seed ^ draws::GRAINS, at / self.grain);
            // Only few stones are paler or darker than the material around them.
            let is_stone = stone.draw.abs() > 0.7;
            let tone = if is_stone { 0.45 * stone.draw * (5.0 * stone.gap).min(1.0) } else { 0.10 * stone.draw };
            tone + 0.1 * plate + 0.16 * noise(seed ^ draws::GRAIN_TONE, 0.9 * at.x, 0.9 * at.y)
        };
        let [level, darker] = near.masonry(off).unwrap_or([1.0, 0.0]);
        down *= level;
        let tone = tone - darker * wall;
        place.height = -self.depth * down + bumps;
        // The wall has the colour of the material that came off, not of what lay under it.
        place.pale = pale * inside * if crumbles { 0.15 + 0.85 * wall } else { 1.0 };
        let mut light = speckle * tone;
        if has_ledges {
            light -= (1.0 + light) * self.darkness(off, sunk, hollow, wall);
            lit = ledge_light(lit, bright, found.patches[k]);
        }
        let light = light + LIT * lit * (1.0 - shadow);
        place.shade = if has_ledges { light.min(BRIGHTEST) } else { light } * inside;
        place.dark = shade * shadow * inside * (SHADOW * self.depth).min(1.0);
    }

    /// A chip that lies on the surface, or its shadow.
    fn add_chip(&self, place: &mut Place, chip: &Chip, off: Vec2, at: Vec2, seed: u32) {
        let Chip { outline, tone, ink, .. } = chip;
        let size = outline.reach;
        if off.distance_squared(outline.centre) > (2.0 * size + 2.0) * (2.0 * size + 2.0) {
            return;
        }
        let crumbles = self.jag > 0.0;
        let light = if self.crushed.terraces > 0 { ChipLight::FRESH } else { ChipLight::PLAIN };
        let mut within = outline.within(off);
        if crumbles {
            within -= 0.14 * size * (1.0 + noise(seed ^ draws::CHIP_EDGE, 2.2 * at.x / size, 2.2 * at.y / size));
        }
        let inside = (within + 0.5).clamp(0.0, 1.0);
        if inside < 1.0 && *ink <= 0.0 {
            // Darkest beside the chip, and soft further out.
            let shadow = outline.within(off + TO_LIGHT * (light.length * size)) + 0.5;
            let shadow = (shadow / (0.7 * light.length * size).max(1.0)).clamp(0.0, 1.0);
            place.dark = place.dark.max(light.shade * shadow * (1.0 - inside));
        }
        if inside > 0.0 {
            place.dark *= 1.0 - inside;
            let face = if crumbles { 0.16 * noise(seed ^ draws::CHIP_FACE, 0.5 * at.x, 0.5 * at.y) } else { 0.0 };
            let turned = ((off - outline.centre).dot(-TO_LIGHT) / size.max(0.1) - 0.1).clamp(-0.5, 0.5);
            place.shade += (tone + face + light.tone - light.sides * turned - place.shade) * inside;
            let pale = if *ink > 0.0 { 1.0 } else { light.pale * self.crushed.pale };
            place.pale += (pale - place.pale) * inside;
            if *ink > 0.0 {
                // The line is wider on the side away from the light.
                let turned = 0.5 - 0.5 * (off - outline.centre).normalize_or_zero().dot(TO_LIGHT);
                let edge = (ink * (0.8 + 0.7 * turned) - within + 0.5).clamp(0.0, 1.0);
                place.dark = place.dark.max(edge * inside);
                // Two flat faces.
                let face = (off - outline.centre).dot(-TO_LIGHT) - 0.12 * size;
                place.shade -= 0.3 * (face + 0.5).clamp(0.0, 1.0);
            } else {
                place.height += (0.9 * within).clamp(0.0, if crumbles { 0.2 * size } else { 0.35 * size });
            }
        }
    }

    /// Angular grit in some of the squares of a lattice: many small pieces, few large ones.
    fn add_crumbs(&self, place: &mut Place, at: Vec2, chance: f32, inside: f32, seed: u32) {
        let side = (1.7 * self.grain).max(4.0);
        let cell = (at / side).floor();
        let (x, y) = (cell.x as i32, cell.y as i32);
        let pick = |what: u32| draw(seed ^ (draws::CRUMBS + what), x, y);
        if chance <= 0.0 || pick(0) >= chance {
            return;
        }
        let radius = (0.065 * side / (pick(1) + 0.03).sqrt()).max(0.6);
        let middle = Vec2::new(pick(2) - 0.5, pick(3) - 0.5) * (side - 3.2 * radius).max(0.0);
        let off = at - ((cell + 0.5) * side + middle);
        let way = Vec2::new(pick(4) - 0.5, pick(5) - 0.5).normalize_or(Vec2::X);
        let sides = [
            (way, 0.55 + 0.5 * pick(6)),
            (-way, 0.55 + 0.5 * pick(7)),
            (way.perp(), 0.5 + 0.4 * pick(8)),
            (-way.perp(), 0.5 + 0.4 * pick(9)),
            ((way + way.perp()) * 0.707, 0.45 + 0.4 * pick(10)),
        ];
        let within = |off: Vec2| sides.iter().map(|(way, far)| far * radius - off.dot(*way)).fold(FAR_OUT, f32::min);
        let (here, open) = (within(off), 1.0 - inside);
        let grit = (here + 0.5).clamp(0.0, 1.0) * open;
        let shadow = (within(off + TO_LIGHT * (0.7 * radius + 0.4)) + 0.5).clamp(0.0, 1.0) * open;
        place.dark = place.dark.max(0.8 * SHADE * shadow) * (1.0 - grit);
        place.pale += (0.45 * self.crushed.pale - place.pale) * grit;
        place.shade += (0.5 * pick(11) - 0.2 - place.shade) * grit;
        place.height += here.clamp(0.0, 0.5 * radius) * 0.9 * open;
    }

    /// Grit in some of the squares of a lattice.
    fn add_grit(&self, place: &mut Place, at: Vec2, chance: f32, seed: u32) {
        let side = (1.3 * self.grain).max(3.0);
        let cell = (at / side).floor();
        let (x, y) = (cell.x as i32, cell.y as i32);
        if chance <= 0.0 || draw(seed ^ 30, x, y) >= chance {
            return;
        }
        let radius = 0.09 * side * (1.0 + 1.4 * draw(seed ^ 31, x, y));
        let middle = Vec2::new(draw(seed ^ 32, x, y), draw(seed ^ 33, x, y)) - 0.5;
        let off = at - ((cell + 0.5) * side + middle * (0.5 * side));
        let inside = |off: Vec2| (radius.max(0.6) - off.length() + 0.5).clamp(0.0, 1.0) * (radius / 0.6).min(1.0);
        let shadow = inside(off + TO_LIGHT * (0.8 * radius + 0.5));
        let grit = inside(off);
        place.dark = place.dark.max(0.8 * SHADE * shadow * (1.0 - grit));
        place.pale += (0.4 * self.crushed.pale - place.pale) * grit;
        place.height += 0.6 * radius * grit;
    }
}
