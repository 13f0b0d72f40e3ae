//! What a hit breaks off along chords: outlines, facets, chips and their shadows.

use super::{
    crushed::{Crushed, PIT_STEPS, Place, Shape, WIDEST},
    hash, lattice, noise,
};
use crate::math::{mix, ops};
use glam::Vec2;

/// Way to the light: from the upper left.
pub(super) const TO_LIGHT: Vec2 = Vec2::new(-std::f32::consts::FRAC_1_SQRT_2, -std::f32::consts::FRAC_1_SQRT_2);

/// Share of the depth that is outside the basin.
const SHELF: f32 = 0.5;

/// Share of that which is gained on the way to the middle.
const BOWL: f32 = 0.4;

/// Run of a wall, in its height.
const WALL: f32 = 0.45;

/// Length of shadows, in the height of what throws them, and how dark they are.
const SHADOW: f32 = 0.75;
const SHADE: f32 = 0.5;

/// The same within what crumbles.
const LONG_SHADOW: f32 = 1.1;
const DEEP_SHADE: f32 = 0.62;

/// How much shadow there is where the edge that throws it is so far away.
fn sink(within: f32, soft: f32) -> f32 {
    (0.5 - within / soft).clamp(0.0, 1.0)
}

/// Texels over which a hard shadow ends.
const HARD: f32 = 1.0 / 0.6;

/// A number in 0..1 for a pair of numbers.
fn draw(seed: u32, x: i32, y: i32) -> f32 {
    (hash(seed, x, y) >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
}

/// Flat facets in -1..=1, about one unit wide: heights at the corners of a lattice of triangles, linear between.
fn facets(seed: u32, at: Vec2) -> f32 {
    const SKEW: f32 = 0.366_025_4;
    let skewed = at + SKEW * (at.x + at.y);
    let corner = skewed.floor();
    let (x, y) = (corner.x as i32, corner.y as i32);
    let Vec2 { x: u, y: v } = skewed - corner;
    let height = |dx: i32, dy: i32| lattice(seed, x.wrapping_add(dx), y.wrapping_add(dy));
    let (first, last) = (height(0, 0), height(1, 1));
    if u > v {
        first * (1.0 - u) + height(1, 0) * (u - v) + last * v
    } else {
        first * (1.0 - v) + height(0, 1) * (v - u) + last * u
    }
}

/// The nearest of some scattered places, as of a stone.
struct Cell {
    /// A number of its own, -1..=1.
    draw: f32,
    /// How much further it is to the next one.
    gap: f32,
}

impl Cell {
    fn find(seed: u32, at: Vec2) -> Self {
        let corner = at.floor();
        let (mut nearest, mut next) = ((f32::MAX, 0, 0), f32::MAX);
        for dy in -1..=1 {
            for dx in -1..=1 {
                let (x, y) = ((corner.x as i32).wrapping_add(dx), (corner.y as i32).wrapping_add(dy));
                let site = Vec2::new(lattice(seed, x, y), lattice(seed ^ 0x77, x, y)) * 0.45;
                let off = at - corner - Vec2::new(dx as f32 + 0.5, dy as f32 + 0.5) - site;
                let distance = off.length();
                if distance < nearest.0 {
                    next = nearest.0;
                    nearest = (distance, x, y);
                } else if distance < next {
                    next = distance;
                }
            }
        }
        let (distance, x, y) = nearest;
        Self { draw: lattice(seed ^ 0x7A, x, y), gap: next - distance }
    }
}

/// A polygon around a place, texels.
pub(super) struct Outline {
    centre: Vec2,
    /// How far its corners are away at the most.
    pub(super) reach: f32,
    /// From the centre, in order of their [`turn`].
    corners: Vec<(f32, Vec2)>,
    /// Whether narrow tips are as near to their edge as they are wide.
    is_worn: bool,
}

/// A direction as a number in 0..4 that grows with its angle.
fn turn(way: Vec2) -> f32 {
    let share = way.y / (way.x.abs() + way.y.abs()).max(1.0e-6);
    if way.x < 0.0 {
        2.0 - share
    } else if way.y < 0.0 {
        4.0 + share
    } else {
        share
    }
}

impl Outline {
    /// About so many corners, between which sides are broken `levels` times.
    pub(super) fn new(centre: Vec2, radius: f32, count: u32, levels: u32, ragged: f32, seed: u32) -> Self {
        let most = radius * (1.0 + WIDEST * ragged);
        let phase = draw(seed, -1, 0);
        let mut corners: Vec<Vec2> = (0..count as i32)
            .map(|k| {
                let turn = (k as f32 + phase + 0.7 * (draw(seed, k, 1) - 0.5)) / count as f32;
                let far = radius * (1.0 + ragged * (1.4 * draw(seed, k, 2) - 0.7));
                ops::unit(std::f32::consts::TAU * turn) * far
            })
            .collect();
        for level in 0..levels as i32 {
            let n = corners.len();
            corners = (0..n)
                .flat_map(|k| {
                    let (a, b) = (corners[k], corners[(k + 1) % n]);
                    let along = 0.3 + 0.4 * draw(seed, k as i32, 5 + 2 * level);
                    let aside = 0.45 * ragged * (draw(seed, k as i32, 6 + 2 * level) - 0.5);
                    [a, a + (b - a) * along + (b - a).perp() * aside]
                })
                .collect();
        }
        let mut corners: Vec<(f32, Vec2)> = corners
            .into_iter()
            .map(|corner| corner.clamp_length_max(most))
            .map(|corner| (turn(corner), corner))
            .collect();
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let reach = corners.iter().map(|(_, corner)| corner.length()).fold(0.0, f32::max);
        Self { centre, reach, corners, is_worn: false }
    }

    /// The same, longer one way and shorter across it.
    fn stretched(mut self, seed: u32) -> Self {
        self.is_worn = true;
        let way = ops::unit(std::f32::consts::PI * draw(seed, -2, 0));
        let (by, most) = (1.0 + 0.5 * draw(seed, -2, 1), self.reach);
        for (at, corner) in &mut self.corners {
            let along = way * corner.dot(way);
            *corner = (along * by + (*corner - along) / by).clamp_length_max(most);
            *at = turn(*corner);
        }
        self.corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        self
    }

    /// How far inside its edge a place is, texels; below zero outside.
    pub(super) fn within(&self, at: Vec2) -> f32 {
        self.side(at).0
    }

    /// The same, and the way inward from the side that is there.
    pub(super) fn side(&self, at: Vec2) -> (f32, Vec2) {
        let off = at - self.centre;
        if off.length_squared() > (self.reach + 1.0) * (self.reach + 1.0) {
            return (-FAR_OUT, Vec2::ZERO);
        }
        let turn = turn(off);
        let n = self.corners.len();
        let next = self.corners.partition_point(|corner| corner.0 <= turn) + n;
        let corner = |k: usize| self.corners.get(k % n.max(1)).map(|corner| corner.1);
        let (Some(a), Some(b)) = (corner(next - 1), corner(next)) else {
            return (-FAR_OUT, Vec2::ZERO);
        };
        let side = b - a;
        let within = side.perp_dot(off - a) / side.length().max(0.1);
        let inward = side.perp().normalize_or_zero();
        if !self.is_worn {
            return (within, inward);
        }
        // The sides of its sector and of those beside it.
        let mut nearest = f32::MAX;
        for k in 0..=2 * BESIDE {
            let (Some(from), Some(to)) = (corner(next + n + k - BESIDE - 1), corner(next + n + k - BESIDE)) else {
                continue;
            };
            let side = to - from;
            let share = ((off - from).dot(side) / side.length_squared().max(0.01)).clamp(0.0, 1.0);
            nearest = nearest.min(off.distance_squared(from + side * share));
        }
        (if within > 0.0 { nearest.sqrt() } else { -nearest.sqrt() }, inward)
    }
}

/// So many sides on either side of a sector count for how near an edge is.
const BESIDE: usize = 3;

/// What is so many texels outside counts as far away.
const FAR_OUT: f32 = 1.0e3;

/// A chip that lies beside.
struct Chip {
    outline: Outline,
    /// How much darker or brighter it is.
    tone: f32,
    /// Width of the line around it, texels.
    ink: f32,
}

/// What has broken off, and where it lies; places from the hit, texels.
pub(super) struct Broken {
    /// The crater and the flakes around it.
    off: Vec<Outline>,
    basin: Option<Outline>,
    chips: Vec<Chip>,
    /// Strokes from one place to another, as wide at the first.
    ticks: Vec<[Vec2; 2]>,
    thick: f32,
    pit: Option<Outline>,
}

impl Broken {
    pub(super) fn new(crushed: &Crushed, unit: f32, radius: f32, grain: f32, seed: u32) -> Self {
        let Crushed { ragged, reach, fall, .. } = *crushed;
        // The root of the energy.
        let more = radius / (crushed.radius * unit).max(1.0e-3);
        let pick = |k: u32, what: i32| draw(seed ^ 0x0B0E, k as i32, what);
        let crumbles = crushed.jag > 0.0;
        // What is less ragged has longer chords.
        let levels = if crumbles && ragged < 0.65 { 1 } else { 2 };
        let shape = |outline: Outline, k: u32| if crumbles { outline.stretched(mix_in(seed, k)) } else { outline };
        let count = 6 + (3.0 * pick(0, 0)) as u32;
        let mut off = vec![shape(Outline::new(Vec2::ZERO, radius, count, levels, ragged, seed ^ 0x60), 0x300)];
        let flakes = (crushed.flakes as f32 * more).round().min(64.0) as u32;
        let one = radius / more.max(1.0) * more.max(1.0).sqrt();
        for k in 0..flakes {
            // A few large ones beside the hit, small ones further out.
            let is_beside = k % 3 == 0;
            let size = one * if is_beside { 0.5 + 0.3 * pick(k, 1) } else { 0.22 + 0.4 * pick(k, 1) * pick(k, 14) };
            let far = if is_beside {
                0.75 * radius + 0.5 * size
            } else {
                radius * (0.9 + pick(k, 2) * pick(k, 15) * (reach - 1.0))
            };
            let far = far.min(radius * reach - 1.8 * size);
            let centre = ops::unit(std::f32::consts::TAU * pick(k, 3)) * far.max(0.0);
            let seed = mix_in(seed, 0x100 + k);
            off.push(shape(Outline::new(centre, size, 5, levels, 0.6, seed), 0x340 + k));
        }
        let basin = (crushed.basin > 0.0).then(|| {
            let centre = Vec2::new(pick(0, 4) - 0.5, pick(0, 5) - 0.3) * (0.3 * radius);
            shape(Outline::new(centre, radius * crushed.basin, 7, 2, 0.8 * ragged, seed ^ 0x61), 0x301)
        });
        let chips = (24.0 * crushed.chips * more).round().min(96.0) as u32;
        let is_drawn = crushed.outline > 0.0;
        let chips: Vec<Chip> = (0..chips)
            .map(|k| {
                let size = if crumbles {
                    // Many small ones, few large ones.
                    grain * (0.3 + 0.13 * (1.0 / (0.12 + pick(k, 6)) - 0.9))
                } else {
                    grain * (0.4 + pick(k, 6) * pick(k, 7))
                };
                let size = size.min(0.4 * radius);
                let mut way = ops::unit(std::f32::consts::TAU * pick(k, 8));
                if way.y < 0.3 && pick(k, 9) < fall {
                    way.y = 0.3 + way.y.abs();
                }
                let least = if is_drawn { 1.25 } else { 0.95 };
                let near = least + (0.85 * reach - least) * pick(k, 10) * pick(k, 11).sqrt();
                let far = near * radius;
                let far = if crumbles { far.min(radius * reach - 2.2 * size) } else { far };
                let centre = way.normalize_or(Vec2::Y) * far;
                let outline =
                    Outline::new(centre, size, 4 + (2.0 * pick(k, 12)) as u32, 0, 0.6, mix_in(seed, 0x200 + k));
                Chip { outline, tone: 0.3 * pick(k, 13) - 0.18, ink: crushed.outline * unit }
            })
            .collect();
        let pit = (crushed.pit > 0.0).then(|| {
            Outline::new(Vec2::ZERO, radius * crushed.pit, 5 + (2.6 * pick(0, 20)) as u32, 1, 0.55, seed ^ 0x62)
        });
        // Two behind each of the first chips.
        let ticks = (0..crushed.ticks)
            .zip(chips.iter().flat_map(|chip: &Chip| [chip, chip]))
            .map(|(k, Chip { outline, .. })| {
                let way = outline.centre.normalize_or(Vec2::Y);
                let side = way.perp() * (if k % 2 == 0 { 0.5 } else { -0.5 });
                let near = outline.centre - (way * (1.5 + 0.4 * pick(k, 22)) + side) * outline.reach;
                [near, near - way * (1.0 + 1.1 * pick(k, 24)) * outline.reach]
            })
            .collect();
        Self { off, basin, chips, ticks, thick: 0.8 * crushed.outline * unit, pit }
    }

    /// Forgets what does not reach into a rectangle, texels from the hit.
    pub(super) fn keep_near(&mut self, min: Vec2, max: Vec2, depth: f32) {
        let is_near = |outline: &Outline, beyond: f32| {
            let nearest = outline.centre.clamp(min - 1.0, max + 1.0);
            nearest.distance_squared(outline.centre) <= (outline.reach + beyond) * (outline.reach + beyond)
        };
        self.off.retain(|outline| is_near(outline, 3.0 + LONG_SHADOW.max(SHADOW) * depth));
        self.chips.retain(|chip| is_near(&chip.outline, 2.0 + chip.outline.reach));
    }

    /// How far inside the edge of what has come off a place is.
    fn within(&self, at: Vec2) -> f32 {
        self.off.iter().map(|outline| outline.within(at)).fold(-FAR_OUT, f32::max)
    }
}

/// Another seed for each.
fn mix_in(seed: u32, k: u32) -> u32 {
    mix(u64::from(seed) << 32 | u64::from(k)) as u32
}

/// A rounded stone at a place.
struct Stone {
    /// Its height there, texels; below zero where it has fallen out.
    height: f32,
    /// How much darker or brighter it is than what it lies in.
    tone: f32,
}

impl Stone {
    /// Sides of the squares in which there is one at the most, in grains, and with which chance.
    const SIZES: [(f32, f32); 4] = [(3.0, 0.5), (2.0, 0.65), (1.25, 0.7), (0.75, 0.6)];

    /// The largest one at a place, if there is any; `share` is how many there are.
    fn find(seed: u32, at: Vec2, grain: f32, share: f32) -> Option<Self> {
        let mut turned = at;
        for ((size, chance), k) in Self::SIZES.into_iter().zip(0u32..) {
            // Each size has squares of its own, turned against the others.
            turned = Vec2::new(0.8 * turned.x - 0.6 * turned.y, 0.6 * turned.x + 0.8 * turned.y);
            let side = (size * grain).max(2.0);
            let cell = (turned / side).floor();
            let (x, y) = (cell.x as i32, cell.y as i32);
            let pick = |what: u32| draw(seed ^ (what + 16 * k), x, y);
            if pick(1) >= chance * share {
                continue;
            }
            let radius = 0.24 + 0.22 * pick(2);
            let middle = Vec2::new(pick(3) - 0.5, pick(4) - 0.5) * (1.0 - 2.0 * radius);
            let off = turned / side - cell - 0.5 - middle;
            let way = Vec2::new(pick(5) - 0.5, pick(6) - 0.5).normalize_or(Vec2::X);
            let (u, v) = (off.dot(way).abs(), (1.0 + 0.4 * pick(7)) * off.perp_dot(way).abs());
            let far = (0.6 * (u * u + v * v).sqrt() + 0.33 * (u + v)) / radius;
            if far < 1.0 {
                let rise = radius * side * (1.0 - far * far);
                let own = pick(8) - 0.5;
                return Some(if pick(9) < 0.14 {
                    Self { height: -0.5 * rise, tone: -0.22 }
                } else {
                    Self { height: 0.55 * rise, tone: 0.16 + 1.7 * own * own.abs() - 0.3 * far * far * far }
                });
            }
        }
        None
    }
}

impl Shape<'_> {
    /// How far inside the edge of what has come off a place is, crumbs and all.
    fn within(&self, broken: &Broken, off: Vec2, at: Vec2, seed: u32) -> f32 {
        let within = broken.within(off);
        if self.jag <= 0.0 || within < -1.0 {
            return within;
        }
        let (wide, fine) = ((3.5 * self.jag).max(3.0), (1.2 * self.jag).max(1.3));
        let noise = |k: u32, size: f32| 0.5 + 0.5 * noise(seed ^ k, at.x / size, at.y / size);
        within - self.jag * (1.3 * noise(0x58, wide) + 0.7 * noise(0x59, fine))
    }

    /// What is there of something that breaks along chords.
    pub(super) fn break_off(&self, place: &mut Place, broken: &Broken, off: Vec2, at: Vec2, seed: u32) {
        let Crushed { dust, chips, reach, fall, .. } = *self.crushed;
        let within = self.within(broken, off, at, seed);
        let inside = (within + 0.5).clamp(0.0, 1.0);
        if inside > 0.0 {
            self.add_floor(place, broken, (within, inside), off, at, seed);
        }
        if inside < 1.0 {
            let sunk = 0.8 * fall;
            let radii = (off - Vec2::new(0.0, sunk * self.radius)).length() / self.radius.max(0.5);
            let left = 1.0 - ((radii - 0.7) / (reach - 0.7 - sunk).max(0.2)).clamp(0.0, 1.0);
            if dust > 0.0 {
                let mut cloud = 0.6 + 0.4 * noise(seed ^ 6, 0.7 * at.x, 0.7 * at.y);
                if self.jag > 0.0 && fall > 0.0 {
                    // It runs down in streaks.
                    let wide = 1.5 * self.grain;
                    cloud *= 1.0 - fall * (0.4 - 0.4 * noise(seed ^ 8, at.x / wide, at.y / (7.0 * wide)));
                }
                place.pale = place.pale.max(dust * left * left * cloud * (1.0 - inside));
            }
            if self.jag > 0.0 {
                self.add_crumbs(place, at, (1.2 * chips * left).min(0.6) * left, inside, seed);
            } else if self.crushed.outline <= 0.0 {
                self.add_grit(place, at, (chips * left).min(0.5) * left, seed);
            }
        }
        for [from, to] in &broken.ticks {
            // It begins blunt and ends in a point.
            let (along, off) = (*to - *from, off - *from);
            let t = (off.dot(along) / along.length_squared().max(1.0e-6)).clamp(0.0, 1.0);
            let inside = broken.thick * (1.0 - t * t) + 0.5 - (off - along * t).length();
            place.dark = place.dark.max(inside.clamp(0.0, 1.0));
        }
        for chip in &broken.chips {
            self.add_chip(place, chip, off, at, seed);
        }
        if let Some(pit) = &broken.pit {
            let (within, inward) = pit.side(off);
            if within > -0.5 {
                // Its floor is smaller, and lies to the side of the light.
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

    /// Where it has come off: a steep wall, and a floor in the shadow of the edge.
    fn add_floor(
        &self,
        place: &mut Place,
        broken: &Broken,
        (within, inside): (f32, f32),
        off: Vec2,
        at: Vec2,
        seed: u32,
    ) {
        let Crushed { pale, speckle, stones, .. } = *self.crushed;
        let crumbles = self.jag > 0.0;
        let bump = |k: u32, size: f32| noise(seed ^ k, at.x / size, at.y / size);
        let share = if broken.basin.is_some() { SHELF } else { 1.0 };
        // Here and there a wall is a slope.
        let slope = bump(0x5A, (0.35 * self.radius).max(4.0));
        let run = if crumbles { 0.8 + 2.6 * slope.max(0.0) } else { 1.0 };
        let wall = (within / (run * WALL * share * self.depth).max(1.0)).clamp(0.0, 1.0);
        let bowl = (within / (0.8 * self.radius).max(1.0)).clamp(0.0, 1.0);
        let mut down = share * (wall + BOWL * (bowl - wall));
        let (long, shade) = if crumbles { (LONG_SHADOW, DEEP_SHADE) } else { (SHADOW, SHADE) };
        let length = long * share * self.depth;
        // Where its edge is far away a shadow is soft.
        let soft = if crumbles { (0.7 * length).max(HARD) } else { HARD };
        let mut shadow = sink(self.within(broken, off + TO_LIGHT * length, at + TO_LIGHT * length, seed), soft);
        let mut sunk = 0.0;
        if let Some(basin) = &broken.basin {
            let within = basin.within(off) - 2.0 * self.jag * (0.5 + 0.5 * bump(0x5B, (3.0 * self.jag).max(2.0)));
            sunk = (within / (1.5 * WALL * self.depth).max(1.0)).clamp(0.0, 1.0);
            down += (1.0 - SHELF) * sunk;
            if within > 0.0 {
                let length = long * (1.0 - SHELF) * self.depth;
                shadow = shadow.max(sink(basin.within(off + TO_LIGHT * length), soft));
            }
        }
        let fold = |k: u32, size: f32| {
            let warp =
                Vec2::new(noise(seed ^ k, at.x / size, at.y / size), noise(seed ^ k ^ 9, at.y / size, at.x / size));
            facets(seed ^ k, at / size + 0.45 * warp)
        };
        let plate = fold(0x51, (0.42 * self.radius).max(2.0 * self.grain));
        let small = fold(0x54, 1.7 * self.grain);
        let fade = (0.5 * within).clamp(0.0, 1.0);
        let mut bumps = self.rough * (plate + if crumbles { 0.2 } else { 0.4 } * small) * fade;
        let tone = if crumbles {
            let coarse = bump(0x56, 2.2 * self.grain) + 0.7 * bump(0x5F, 0.3 * self.radius + 6.0 * self.grain);
            let sand = lattice(seed ^ 0x57, at.x.floor() as i32, at.y.floor() as i32);
            // The lattices of noise are not to be seen.
            let turned = Vec2::new(0.8 * at.x - 0.6 * at.y, 0.6 * at.x + 0.8 * at.y);
            let pit = noise(seed ^ 0x65, 0.42 * turned.x, 0.42 * turned.y);
            let sand = 0.3 * sand + 0.5 * pit - 0.9 * (-pit - 0.55).max(0.0);
            bumps += 0.6 * self.rough * pit * fade;
            // Next to the wall less of the sky is seen.
            let corner = (1.0 - within / (1.3 * self.depth).max(1.0)).clamp(0.0, 1.0);
            let mut tone = 0.30 * coarse + 0.16 * plate + (0.5 - 0.2 * stones) * sand
                - 0.14 * stones
                - 0.6 * corner * wall
                - 0.3 * sunk;
            if stones > 0.0
                && let Some(stone) = Stone::find(seed ^ 0x5C, at, self.grain, stones)
            {
                let shown = fade * wall;
                tone += (1.8 * stone.tone - 0.7 * tone) * shown;
                bumps += stone.height * shown;
            }
            tone
        } else {
            let stone = Cell::find(seed ^ 0x52, at / self.grain);
            // Few stones are paler or darker than what they lie in.
            let is_stone = stone.draw.abs() > 0.7;
            let tone = if is_stone { 0.45 * stone.draw * (5.0 * stone.gap).min(1.0) } else { 0.10 * stone.draw };
            tone + 0.1 * plate + 0.16 * noise(seed ^ 0x53, 0.9 * at.x, 0.9 * at.y)
        };
        place.height = -self.depth * down + bumps;
        // The wall is of what has come off, not of what lay under it.
        place.pale = pale * inside * if crumbles { 0.15 + 0.85 * wall } else { 1.0 };
        place.shade = speckle * tone * inside;
        place.dark = shade * shadow * inside * (SHADOW * self.depth).min(1.0);
    }

    /// A chip that lies there, or its shadow.
    fn add_chip(&self, place: &mut Place, chip: &Chip, off: Vec2, at: Vec2, seed: u32) {
        let Chip { outline, tone, ink, .. } = chip;
        let size = outline.reach;
        if off.distance_squared(outline.centre) > (2.0 * size + 2.0) * (2.0 * size + 2.0) {
            return;
        }
        let crumbles = self.jag > 0.0;
        let mut within = outline.within(off);
        if crumbles {
            within -= 0.14 * size * (1.0 + noise(seed ^ 0x66, 2.2 * at.x / size, 2.2 * at.y / size));
        }
        let inside = (within + 0.5).clamp(0.0, 1.0);
        if inside < 1.0 && *ink <= 0.0 {
            let shadow = (outline.within(off + TO_LIGHT * (0.45 * size)) + 0.5).clamp(0.0, 1.0);
            place.dark = place.dark.max(SHADE * shadow * (1.0 - inside));
        }
        if inside > 0.0 {
            place.dark *= 1.0 - inside;
            let face = if crumbles { 0.16 * noise(seed ^ 0x67, 0.5 * at.x, 0.5 * at.y) } else { 0.0 };
            place.shade += (tone + face - place.shade) * inside;
            // It shows the surface's own face.
            let pale = if *ink > 0.0 { 1.0 } else { 0.3 * self.crushed.pale };
            place.pale += (pale - place.pale) * inside;
            if *ink > 0.0 {
                // On the side that is turned away it is wider.
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

    /// Angular grit in some of the squares of a lattice: much that is small, little that is large.
    fn add_crumbs(&self, place: &mut Place, at: Vec2, chance: f32, inside: f32, seed: u32) {
        let side = (1.7 * self.grain).max(4.0);
        let cell = (at / side).floor();
        let (x, y) = (cell.x as i32, cell.y as i32);
        let pick = |what: u32| draw(seed ^ (0x80 + what), x, y);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::Rng,
        pattern::{SurfaceFrame, Timeline},
        raster::layer::{CrushedField, Spot},
    };
    use glam::UVec2;

    /// From the centre outward a place leaves once, where the outline's own corners say.
    #[test]
    fn outlines_are_closed_and_stay_within_reach() {
        let mut rng = Rng::new(8);
        for seed in 0..200 {
            let (centre, ragged) = (Vec2::new(100.0 * rng.unit(), 100.0 * rng.unit()), rng.unit());
            let radius = 2.0 + 60.0 * rng.unit();
            let outline = Outline::new(centre, radius, 4 + seed % 6, seed % 3, ragged, seed);
            assert!(outline.reach <= radius * (1.0 + WIDEST * ragged) + 1.0e-3);
            assert!(outline.within(centre) > 0.0, "seed {seed}");
            for k in 0..64 {
                let way = ops::unit(k as f32 * 0.1);
                let mut was_inside = true;
                for step in 0..400 {
                    let is_inside = outline.within(centre + way * (step as f32 * 0.005 * outline.reach)) > 0.0;
                    assert!(was_inside || !is_inside, "seed {seed}: back inside on way {k}");
                    was_inside = is_inside;
                }
                assert!(!was_inside, "seed {seed}: it has no end on way {k}");
            }
        }
    }

    /// What is worn has its edge where it was.
    #[test]
    fn worn_outlines_have_the_same_edge() {
        let mut rng = Rng::new(10);
        for seed in 0..60 {
            let worn = Outline::new(Vec2::ZERO, 30.0, 4 + seed % 6, seed % 3, 0.6, seed).stretched(seed);
            let clean = Outline { is_worn: false, corners: worn.corners.clone(), ..worn };
            for _ in 0..200 {
                let at = Vec2::new(rng.range(-40.0, 40.0), rng.range(-40.0, 40.0));
                assert_eq!(worn.within(at) > 0.0, clean.within(at) > 0.0, "seed {seed} at {at}");
            }
        }
    }

    /// About the share that is asked for is stones, large ones and small ones; without any there are none.
    #[test]
    fn stones_cover_what_they_are_told() {
        let count = |share: f32| {
            let at = |k: u32| Vec2::new((k % 200) as f32, (k / 200) as f32);
            (0..40_000).filter(|&k| Stone::find(3, at(k), 6.0, share).is_some()).count() as f32 / 40_000.0
        };
        let (none, some, all) = (count(0.0), count(0.5), count(1.0));
        assert!(none == 0.0 && (0.2..0.6).contains(&some) && (0.4..0.9).contains(&all), "{none} {some} {all}");
    }

    #[test]
    fn facets_are_flat_and_join() {
        let mut rng = Rng::new(9);
        let mut flat = 0;
        for _ in 0..2000 {
            let at = Vec2::new(rng.range(-20.0, 20.0), rng.range(-20.0, 20.0));
            let height = |by: f32| facets(7, at + Vec2::new(by, 0.6 * by));
            assert!(height(0.0).abs() <= 1.0);
            assert!((height(1.0e-3) - height(0.0)).abs() < 0.01, "a step at {at}");
            flat += usize::from((height(0.02) - 2.0 * height(0.01) + height(0.0)).abs() < 1.0e-4);
        }
        assert!(flat > 1800, "{flat} of 2000 places are on a flat facet");
    }

    #[test]
    fn what_breaks_is_deep_inside_and_level_far_away() {
        let frame = SurfaceFrame::new(UVec2::splat(256)).unwrap();
        for seed in 0..20 {
            let crushed = Crushed { broken: true, basin: 0.6, depth: 0.02, radius: 0.1, ..Crushed::DEFAULT };
            let mut field = CrushedField::new(&crushed, frame, seed);
            let mut timeline = Timeline::default();
            timeline.strike(0, Vec2::splat(0.5), 0.0, 1.0);
            field.follow(timeline.strikes(), timeline.strikes());
            field.draw_some(usize::MAX, None, &mut Vec::new());
            let mut row = [Spot::default(); 256];
            field.read(0, 128, &mut row);
            assert!(row[128].deep > 100 && row[128].pale > 0, "seed {seed}: {:?}", row[128]);
            assert_eq!((row[0], row[255]), (Spot::default(), Spot::default()));
        }
    }
}
