//! Crushed zones: what a hit leaves around itself.

use super::{hash, noise};
use crate::{
    Grid,
    math::{mix, ops},
    pattern::{Strike, SurfaceFrame},
    raster::TexelRect,
};
use glam::{UVec2, Vec2};

/// What a hit crushes: a spot around it, by its energy. All of it is made from the seed and the place, at any resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct Crushed {
    /// Radius at energy 1; it grows with the square root of the energy. Pattern units, 0..=0.5; default 0.03.
    pub radius: f32,
    /// How far the outline strays from a circle, as a share of the radius. 0..=1; default 0.4.
    pub ragged: f32,
    /// How softly it ends: 0 = with a broken edge, 1 = it fades from the middle on. Default 0.
    pub soft: f32,
    /// Radius of the dark hole in the middle, as a share of the radius. 0..=1; default 0.
    pub hole: f32,
    /// Depth of the crater, pattern units, 0..=0.2; default 0.008.
    pub depth: f32,
    /// Height of the bumps on its floor, pattern units, 0..=0.05; default 0.002.
    pub rough: f32,
    /// Size of grains and crumbs, pattern units, 0.0005..=0.1; default 0.006.
    pub grain: f32,
    /// Colour of what is crushed, of dust and of crumbs, sRGB 0..=1; default a light grey.
    pub color: [f32; 3],
    /// How much that colour covers the picture. 0..=1; default 0.5.
    pub pale: f32,
    /// How uneven that is from grain to grain. 0..=1; default 0.4.
    pub speckle: f32,
    /// How far a flat flake with arcs reaches to one side (conchoidal fracture), radii. 0..=8; default 0 = none.
    pub flake: f32,
    /// How much dust covers the surface around it, falling to nothing at [`reach`](Self::reach). 0..=1; default 0.2.
    pub dust: f32,
    /// How many crumbs lie around it, up to [`reach`](Self::reach); 0..=1; default 0.3.
    pub chips: f32,
    /// How far dust and crumbs reach, radii. 1..=8; default 2.5.
    pub reach: f32,
    /// Whether it is broken along straight chords into plates, with angular chips that throw shadows; else its outline and floor are as of
    /// something crushed to powder. [`soft`](Self::soft), [`hole`](Self::hole) and [`flake`](Self::flake) do not count then. Default false.
    pub broken: bool,
    /// Radius of the deeper hollow in the middle of what is broken, as a share of the radius; it has more than half of the depth. 0..=1; default
    /// 0 = a flat floor.
    pub basin: f32,
    /// How many smaller flakes have come off further out, where it is [`broken`](Self::broken): at energy 1, more with its root. 0..=16; default 0.
    pub flakes: u32,
    /// Share that the picture's own colour has in [`color`](Self::color), so that what is crushed has the tone of what it was. 0..=1; default 0.
    pub tint: f32,
    /// How far chips and dust of what is [`broken`](Self::broken) lie below it (a wall): 0 = all around, 1 = nearly all below. 0..=1; default 0.
    pub fall: f32,
    /// Width of a dark line around chips of what is [`broken`](Self::broken) (a drawing), pattern units, 0..=0.05; default 0 = none.
    pub outline: f32,
}

impl Crushed {
    /// The default: a crater in stone.
    pub const DEFAULT: Self = Self {
        radius: 0.03,
        ragged: 0.4,
        soft: 0.0,
        hole: 0.0,
        depth: 0.008,
        rough: 0.002,
        grain: 0.006,
        color: [0.72, 0.70, 0.66],
        pale: 0.5,
        speckle: 0.4,
        flake: 0.0,
        dust: 0.2,
        chips: 0.3,
        reach: 2.5,
        broken: false,
        basin: 0.0,
        flakes: 0,
        tint: 0.0,
        fall: 0.0,
        outline: 0.0,
    };

    /// The first field that is out of its range or not finite: its name, value and range.
    pub(crate) fn fault(&self) -> Option<(&'static str, f32, &'static str)> {
        let fields = [
            ("crushed.radius", self.radius, 0.0..=0.5, "0..=0.5"),
            ("crushed.ragged", self.ragged, 0.0..=1.0, "0..=1"),
            ("crushed.soft", self.soft, 0.0..=1.0, "0..=1"),
            ("crushed.hole", self.hole, 0.0..=1.0, "0..=1"),
            ("crushed.depth", self.depth, 0.0..=0.2, "0..=0.2"),
            ("crushed.rough", self.rough, 0.0..=0.05, "0..=0.05"),
            ("crushed.grain", self.grain, 0.0005..=0.1, "0.0005..=0.1"),
            ("crushed.color", self.color[0], 0.0..=1.0, "0..=1"),
            ("crushed.color", self.color[1], 0.0..=1.0, "0..=1"),
            ("crushed.color", self.color[2], 0.0..=1.0, "0..=1"),
            ("crushed.pale", self.pale, 0.0..=1.0, "0..=1"),
            ("crushed.speckle", self.speckle, 0.0..=1.0, "0..=1"),
            ("crushed.flake", self.flake, 0.0..=8.0, "0..=8"),
            ("crushed.dust", self.dust, 0.0..=1.0, "0..=1"),
            ("crushed.chips", self.chips, 0.0..=1.0, "0..=1"),
            ("crushed.reach", self.reach, 1.0..=8.0, "1..=8"),
            ("crushed.basin", self.basin, 0.0..=1.0, "0..=1"),
            ("crushed.flakes", self.flakes as f32, 0.0..=16.0, "0..=16"),
            ("crushed.tint", self.tint, 0.0..=1.0, "0..=1"),
            ("crushed.fall", self.fall, 0.0..=1.0, "0..=1"),
            ("crushed.outline", self.outline, 0.0..=0.05, "0..=0.05"),
        ];
        let is_bad = |(_, value, range, _): &(_, f32, std::ops::RangeInclusive<f32>, _)| !range.contains(value);
        fields.into_iter().find(is_bad).map(|(name, value, _, range)| (name, value, range))
    }

    /// The same seen from nearer or further away.
    pub(crate) fn scaled(&self, by: f32) -> Self {
        let scaled = |length: f32, low: f32, high: f32| (length * by).clamp(low, high);
        Self {
            radius: scaled(self.radius, 0.0, 0.5),
            depth: scaled(self.depth, 0.0, 0.2),
            rough: scaled(self.rough, 0.0, 0.05),
            grain: scaled(self.grain, 0.0005, 0.1),
            outline: scaled(self.outline, 0.0, 0.05),
            ..*self
        }
    }
}

impl Default for Crushed {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Steps of a slope of 1.
pub(crate) const SLOPE_UNIT: f32 = 2048.0;

/// What is crushed at a texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Spot {
    /// Slope of the surface to the right and down, as of a height that goes down into it.
    pub(crate) slope: [i16; 2],
    /// How much the crushed colour covers, 0..=255, and how much darker or brighter it is, 1/128.
    pub(crate) pale: u8,
    pub(crate) shade: i8,
    /// How much of the hole there is.
    pub(crate) dark: u8,
    /// How deep it is, 255 = as deep as the crater gets.
    pub(crate) deep: u8,
}

impl Spot {
    const NONE: Self = Self { slope: [0; 2], pale: 0, shade: 0, dark: 0, deep: 0 };

    /// Both, in any order: what is deeper in the hole or paler shows, and the steeper slope.
    fn with(self, other: Self) -> Self {
        let strength = |spot: Self| (spot.dark, spot.pale, spot.shade);
        let steep = |[x, y]: [i16; 2]| (i32::from(x).pow(2) + i32::from(y).pow(2), x, y);
        let slope = if steep(self.slope) >= steep(other.slope) { self.slope } else { other.slope };
        let deep = self.deep.max(other.deep);
        Self { slope, deep, ..if strength(self) >= strength(other) { self } else { other } }
    }
}

/// Side of a tile, texels.
const TILE: u32 = 32;

type Tile = [Spot; (TILE * TILE) as usize];

/// One impact that has crushed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Zone {
    /// Texels.
    pos: Vec2,
    energy: f32,
    bounds: TexelRect,
}

/// Columns and rows of the tiles that a rectangle touches.
fn tiles_of(rect: &TexelRect) -> impl Iterator<Item = UVec2> + use<> {
    let (min, max) = (rect.min / TILE, rect.max.map(|end| end.div_ceil(TILE)));
    let columns = if rect.is_empty() { 0..0 } else { min.x..max.x };
    (min.y..max.y).flat_map(move |y| columns.clone().map(move |x| UVec2::new(x, y)))
}

/// Crushed zones of all impacts, in tiles that are only there where they are.
#[derive(Clone, Debug)]
pub(crate) struct CrushedField {
    crushed: Crushed,
    frame: SurfaceFrame,
    seed: u32,
    /// By impact.
    zones: Vec<Option<Zone>>,
    /// Hits that are taken up.
    shown: usize,
    columns: u32,
    tiles: Vec<Option<Box<Tile>>>,
    used: usize,
}

/// What is shown, not the way there.
impl PartialEq for CrushedField {
    fn eq(&self, other: &Self) -> bool {
        self.crushed == other.crushed && self.frame == other.frame && self.tiles == other.tiles
    }
}

impl CrushedField {
    pub(super) fn new(crushed: &Crushed, frame: SurfaceFrame, seed: u64) -> Self {
        let count = frame.size().map(|side| side.div_ceil(TILE));
        Self {
            crushed: *crushed,
            frame,
            seed: mix(seed ^ 0xC4) as u32,
            zones: Vec::new(),
            shown: 0,
            columns: count.x,
            tiles: vec![None; count.element_product() as usize],
            used: 0,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.used == 0
    }

    pub(crate) const fn settings(&self) -> &Crushed {
        &self.crushed
    }

    /// Shows the first hits of `all`, those in `strikes`.
    pub(super) fn show(
        &mut self,
        strikes: &[Strike],
        all: &[Strike],
        forbidden: Option<&Grid<bool>>,
        changed: &mut Vec<TexelRect>,
    ) {
        if self.shown == strikes.len() || self.crushed.radius <= 0.0 {
            return;
        }
        // Tiles of impacts that are others now are made anew; what is new is laid over them.
        let (mut anew, mut new) = (Vec::new(), Vec::new());
        while self.shown > strikes.len() {
            self.shown -= 1;
            let Some(strike) = all.get(self.shown) else { continue };
            anew.push(self.set(strike, strike.before));
        }
        for strike in &strikes[self.shown..] {
            self.shown += 1;
            let bounds = self.set(strike, strike.energy);
            if strike.before > 0.0 {
                anew.push(bounds);
            } else {
                new.push(strike.impact);
            }
        }
        let mut tiles: Vec<UVec2> = anew.iter().flat_map(tiles_of).collect();
        tiles.sort_unstable_by_key(|tile| (tile.y, tile.x));
        tiles.dedup();
        for &tile in &tiles {
            let slot = (tile.y * self.columns + tile.x) as usize;
            self.used -= usize::from(self.tiles[slot].take().is_some());
            for index in 0..self.zones.len() as u32 {
                self.draw(index, tile, forbidden);
            }
        }
        for index in new {
            let Some(Some(zone)) = self.zones.get(index as usize).copied() else { continue };
            for tile in tiles_of(&zone.bounds) {
                if tiles.binary_search_by_key(&(tile.y, tile.x), |tile| (tile.y, tile.x)).is_err() {
                    self.draw(index, tile, forbidden);
                }
            }
            changed.push(zone.bounds);
        }
        changed.extend(anew);
    }

    /// Gives the impact of a hit this energy; returns the texels that may be others now.
    fn set(&mut self, strike: &Strike, energy: f32) -> TexelRect {
        let index = strike.impact as usize;
        if self.zones.len() <= index {
            self.zones.resize(index + 1, None);
        }
        let zone = (energy > 0.0).then(|| {
            let pos = self.frame.to_texel(strike.pos);
            let Crushed { reach, flake, ragged, .. } = self.crushed;
            let radius = self.radius(energy) * reach.max(flake).max(1.0 + WIDEST * ragged);
            let limit = self.frame.size().as_vec2();
            let min = (pos - radius - 2.0).floor().clamp(Vec2::ZERO, limit).as_uvec2();
            let max = (pos + radius + 2.0).ceil().clamp(Vec2::ZERO, limit).as_uvec2();
            Zone { pos, energy, bounds: TexelRect { min, max } }
        });
        let before = std::mem::replace(&mut self.zones[index], zone);
        let bounds = |zone: Option<Zone>| zone.map_or(TexelRect::default(), |zone| zone.bounds);
        bounds(before).union(bounds(zone))
    }

    fn radius(&self, energy: f32) -> f32 {
        self.crushed.radius * self.frame.texels_per_unit() * energy.sqrt()
    }

    /// Lays what an impact has crushed over a tile, if it touches it.
    fn draw(&mut self, index: u32, tile: UVec2, forbidden: Option<&Grid<bool>>) {
        let Some(Some(zone)) = self.zones.get(index as usize).copied() else { return };
        let corner = tile * TILE;
        let rect = TexelRect { min: corner, max: (corner + TILE).min(self.frame.size()) }.intersect(zone.bounds);
        if rect.is_empty() {
            return;
        }
        let radius = self.radius(zone.energy);
        let slot = &mut self.tiles[(tile.y * self.columns + tile.x) as usize];
        self.used += usize::from(slot.is_none());
        let texels = slot.get_or_insert_with(|| Box::new([Spot::NONE; (TILE * TILE) as usize]));
        let seed = self.seed ^ index.wrapping_mul(0x9E37_79B1);
        let shape = Shape::new(&self.crushed, self.frame.texels_per_unit(), radius, seed);
        shape.draw(texels, zone.pos, seed, rect, corner);
        let Some(forbidden) = forbidden else { return };
        for y in rect.min.y..rect.max.y {
            for x in rect.min.x..rect.max.x {
                if forbidden.get(x, y) == Some(true) {
                    texels[((y - corner.y) * TILE + x - corner.x) as usize] = Spot::NONE;
                }
            }
        }
    }

    /// Whether anything may be crushed in a rectangle.
    pub(crate) fn touches(&self, rect: TexelRect) -> bool {
        let (min, max) = (rect.min / TILE, rect.max.map(|end| end.div_ceil(TILE)));
        (min.y..max.y).any(|y| (min.x..max.x).any(|x| self.tiles[(y * self.columns + x) as usize].is_some()))
    }

    /// The texels of row `y` from column `x` on.
    pub(crate) fn read(&self, x: u32, y: u32, to: &mut [Spot]) {
        let mut rest = to;
        let mut x = x;
        while !rest.is_empty() {
            let within = x % TILE;
            let (now, later) = rest.split_at_mut(rest.len().min((TILE - within) as usize));
            match self.tiles.get((y / TILE * self.columns + x / TILE) as usize) {
                Some(Some(tile)) => {
                    let first = (y % TILE * TILE + within) as usize;
                    now.copy_from_slice(&tile[first..first + now.len()]);
                }
                _ => now.fill(Spot::NONE),
            }
            x += now.len() as u32;
            rest = later;
        }
    }
}

/// How far an outline strays at the most, for a raggedness of 1.
const WIDEST: f32 = 1.1;

/// A crushed zone in texels.
struct Shape<'a> {
    crushed: &'a Crushed,
    radius: f32,
    depth: f32,
    rough: f32,
    grain: f32,
    broken: Option<Broken>,
}

/// What there is at a place.
#[derive(Clone, Copy)]
struct Place {
    height: f32,
    pale: f32,
    shade: f32,
    dark: f32,
}

impl<'a> Shape<'a> {
    fn new(crushed: &'a Crushed, unit: f32, radius: f32, seed: u32) -> Self {
        let grain = (crushed.grain * unit).max(1.0);
        Self {
            crushed,
            radius,
            depth: crushed.depth * unit,
            rough: crushed.rough * unit,
            grain,
            broken: crushed.broken.then(|| Broken::new(crushed, unit, radius, grain, seed)),
        }
    }

    /// Lays it over the texels `rect` of a tile whose first texel is at `corner`.
    fn draw(&self, texels: &mut Tile, centre: Vec2, seed: u32, rect: TexelRect, corner: UVec2) {
        const WIDE: usize = TILE as usize + 2;
        // Heights around each texel are needed for its slope.
        let mut places = [Place { height: 0.0, pale: 0.0, shade: 0.0, dark: 0.0 }; WIDE * WIDE];
        let (size, first) = (rect.size().as_usizevec2(), rect.min.as_vec2() - 0.5);
        for y in 0..size.y + 2 {
            for x in 0..size.x + 2 {
                let at = first + Vec2::new(x as f32, y as f32);
                places[y * WIDE + x] = self.place(at - centre, at, seed);
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
                let Place { height, pale, shade, dark } = places[at];
                let deep = if self.depth > 0.0 { -height / self.depth } else { 0.0 };
                let spot = Spot {
                    // Nothing is lit in a hole.
                    slope: if dark > 0.5 { [0; 2] } else { [slope(1), slope(WIDE)] },
                    pale: (pale.clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
                    shade: (shade * 128.0).clamp(-127.0, 127.0) as i8,
                    dark: (dark.clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
                    deep: (deep.clamp(0.0, 1.0) * 255.0 + 0.5) as u8,
                };
                let texel = &mut texels[(y + corner.y) * TILE as usize + x + corner.x];
                *texel = texel.with(spot);
            }
        }
    }

    /// `off` is the way from the centre, `at` the place in the field.
    fn place(&self, off: Vec2, at: Vec2, seed: u32) -> Place {
        let Crushed { ragged, soft, hole, pale, speckle, flake, dust, chips, reach, .. } = *self.crushed;
        let mut place = Place { height: 0.0, pale: 0.0, shade: 0.0, dark: 0.0 };
        let distance = off.length();
        let radii = distance / self.radius.max(0.5);
        // No outline strays further than that.
        let widest = 1.0 + WIDEST * ragged;
        if radii > reach.max(flake).max(widest) + 0.1 {
            return place;
        }
        if let Some(broken) = &self.broken {
            self.break_off(&mut place, broken, off, at, seed);
            return place;
        }
        let way = off / distance.max(1.0e-3);
        let grain = |k: u32, size: f32| noise(seed ^ k, at.x / size, at.y / size);
        let round = |k: u32, times: f32| noise(seed ^ k, way.x * times + 17.0, way.y * times + 31.0);
        let mut inside = 0.0;
        if radii <= widest {
            let fine = grain(1, self.grain);
            let edge = 1.0 + ragged * (0.55 * round(2, 1.3) + 0.35 * round(3, 3.7) + 0.2 * fine);
            let outline = (self.radius * edge).max(0.5);
            // One texel of soft edge.
            inside = (outline - distance + 0.5).clamp(0.0, 1.0);
            if inside > 0.0 {
                let coarse = grain(4, 2.3 * self.grain);
                let rest = (1.0 - distance / outline).clamp(0.0, 1.0);
                let fade = inside + soft * ((1.5 * rest).min(1.0) - inside);
                // A broken edge is steep, a soft one has none.
                let bowl = rest.sqrt() + soft * (rest * rest - rest.sqrt());
                place.height = -self.depth * bowl + fade * self.rough * (0.6 * coarse + 0.4 * fine);
                let grains = 1.0 - speckle * (0.5 + 0.5 * grain(5, 0.6 * self.grain)).clamp(0.0, 1.0);
                place.pale = pale * fade * grains;
                place.shade = speckle * (0.6 * coarse + 0.3 * fine) * inside;
            }
        }
        if flake > 1.0 {
            self.add_flake(&mut place, way, radii, seed);
        }
        if inside < 1.0 && radii < reach {
            let left = 1.0 - ((radii - 0.8) / (reach - 0.8)).clamp(0.0, 1.0);
            if dust > 0.0 {
                let cloud = 0.65 + 0.35 * grain(6, 5.0 * self.grain);
                place.pale = place.pale.max(dust * left * left * cloud * (1.0 - inside));
            }
            self.add_crumb(&mut place, at, chips * left * left, seed);
        }
        if hole > 0.0 && radii <= hole * (1.0 + WIDEST * ragged) + 1.0 {
            let radius = self.radius * hole * (1.0 + 0.6 * ragged * (round(7, 1.9) + 0.5 * round(8, 4.3)));
            place.dark = (radius - distance + 0.5).clamp(0.0, 1.0);
        }
        place
    }

    /// A flat flake to one side of the hit, with arcs around it.
    fn add_flake(&self, place: &mut Place, way: Vec2, q: f32, seed: u32) {
        let side = Vec2::new(super::lattice(seed, 1, 7), super::lattice(seed, 5, 3)).normalize_or(Vec2::Y);
        let facing = way.dot(side);
        let reach = 1.0 + (self.crushed.flake - 1.0) * (0.45 + 0.55 * facing).max(0.0);
        let inside = ((reach - q) * self.radius + 0.5).clamp(0.0, 1.0);
        if inside <= 0.0 || q <= 0.9 {
            return;
        }
        let share = ((q - 1.0) / (reach - 1.0).max(0.05)).clamp(0.0, 1.0);
        // Arcs, wider apart outward; each a steep step and a gentle way back.
        let arcs = 5.0 * share.sqrt() + 0.4 * noise(seed ^ 9, way.x * 2.0, way.y * 2.0);
        let saw = arcs - arcs.floor();
        let strength = inside * (1.0 - 0.6 * share);
        place.height -= 0.35 * self.depth * (1.0 - share) * inside + 0.25 * self.depth * saw * strength;
        place.pale = place.pale.max(self.crushed.pale * strength * (0.04 + 0.30 * saw * saw * saw));
        // Its rim catches the light.
        let rim = (1.0 - ((reach - q) * self.radius - 1.0).abs() / 1.2).clamp(0.0, 1.0);
        place.pale = place.pale.max(0.5 * self.crushed.pale * rim);
    }

    /// A crumb in some of the squares of a lattice.
    fn add_crumb(&self, place: &mut Place, at: Vec2, chance: f32, seed: u32) {
        let side = 2.6 * self.grain;
        let cell = (at / side).floor();
        let (x, y) = (cell.x as i32, cell.y as i32);
        let draw = |k: u32| (hash(seed ^ k, x, y) >> 8) as i32 as f32 * (1.0 / 16_777_216.0);
        if draw(20) >= chance {
            return;
        }
        let radius = self.grain * (0.35 + 0.85 * draw(21) * draw(22));
        let middle = (cell + 0.5) * side + (Vec2::new(draw(23), draw(24)) - 0.5) * (side - 2.0 * radius).max(0.0);
        let off = at - middle;
        // An angular one: a square on its corner, turned.
        let turn = Vec2::new(draw(25) - 0.5, draw(26) - 0.5).normalize_or(Vec2::X);
        let (u, v) = (off.dot(turn).abs(), off.perp_dot(turn).abs());
        let far = (0.75 * u + 0.75 * v).max(u.max(v)) / radius;
        let inside = ((1.0 - far) * radius + 0.5).clamp(0.0, 1.0);
        if inside > 0.0 {
            place.height += 0.9 * radius * (1.0 - far).clamp(0.0, 0.6);
            place.pale = place.pale.max(self.crushed.pale.max(0.4) * inside);
            place.shade += (0.5 * draw(27) - 0.25) * inside;
        }
    }
    /// What is there of something that breaks along chords.
    fn break_off(&self, place: &mut Place, broken: &Broken, off: Vec2, at: Vec2, seed: u32) {
        let Crushed { pale, speckle, dust, chips, reach, fall, .. } = *self.crushed;
        let within = broken.within(off);
        let inside = (within + 0.5).clamp(0.0, 1.0);
        if inside > 0.0 {
            // A steep wall, and a floor of plates, each tilted in its own way.
            let share = if broken.basin.is_some() { SHELF } else { 1.0 };
            let wall = (within / (WALL * share * self.depth).max(1.0)).clamp(0.0, 1.0);
            let bowl = (within / (0.8 * self.radius).max(1.0)).clamp(0.0, 1.0);
            let mut down = share * (wall + BOWL * (bowl - wall));
            let mut shadow = sink(broken.within(off + TO_LIGHT * (SHADOW * share * self.depth)));
            if let Some(basin) = &broken.basin {
                let within = basin.within(off);
                down += (1.0 - SHELF) * (within / (1.5 * WALL * self.depth).max(1.0)).clamp(0.0, 1.0);
                if within > 0.0 {
                    let length = SHADOW * (1.0 - SHELF) * self.depth;
                    shadow = shadow.max(sink(basin.within(off + TO_LIGHT * length)));
                }
            }
            let fold = |k: u32, size: f32| {
                let warp =
                    Vec2::new(noise(seed ^ k, at.x / size, at.y / size), noise(seed ^ k ^ 9, at.y / size, at.x / size));
                facets(seed ^ k, at / size + 0.45 * warp)
            };
            let plate = fold(0x51, (0.42 * self.radius).max(2.0 * self.grain));
            let small = fold(0x54, 1.7 * self.grain);
            let stone = Cell::find(seed ^ 0x52, at / self.grain);
            let fade = (0.5 * within).clamp(0.0, 1.0);
            let bumps = plate + 0.4 * small;
            place.height = -self.depth * down + self.rough * bumps * fade;
            place.pale = pale * inside;
            // Few stones are paler or darker than what they lie in.
            let is_stone = stone.draw.abs() > 0.7;
            let tone = if is_stone { 0.45 * stone.draw * (5.0 * stone.gap).min(1.0) } else { 0.10 * stone.draw };
            let dirt = noise(seed ^ 0x53, 0.9 * at.x, 0.9 * at.y);
            place.shade = speckle * (tone + 0.1 * plate + 0.16 * dirt) * inside;
            place.dark = SHADE * shadow * inside * (SHADOW * self.depth).min(1.0);
        }
        if inside < 1.0 {
            let sunk = 0.8 * fall;
            let radii = (off - Vec2::new(0.0, sunk * self.radius)).length() / self.radius.max(0.5);
            let left = 1.0 - ((radii - 0.7) / (reach - 0.7 - sunk).max(0.2)).clamp(0.0, 1.0);
            if dust > 0.0 {
                let cloud = 0.6 + 0.4 * noise(seed ^ 6, 0.7 * at.x, 0.7 * at.y);
                place.pale = place.pale.max(dust * left * left * cloud * (1.0 - inside));
            }
            if self.crushed.outline <= 0.0 {
                self.add_grit(place, at, (chips * left).min(0.5) * left, seed);
            }
        }
        for chip in &broken.chips {
            self.add_chip(place, chip, off);
        }
    }

    /// A chip that lies there, or its shadow.
    fn add_chip(&self, place: &mut Place, chip: &Chip, off: Vec2) {
        let Chip { outline, tone, ink, .. } = chip;
        let size = outline.reach;
        if off.distance_squared(outline.centre) > (2.0 * size + 2.0) * (2.0 * size + 2.0) {
            return;
        }
        let within = outline.within(off);
        let inside = (within + 0.5).clamp(0.0, 1.0);
        if inside < 1.0 && *ink <= 0.0 {
            let shadow = (outline.within(off + TO_LIGHT * (0.45 * size)) + 0.5).clamp(0.0, 1.0);
            place.dark = place.dark.max(SHADE * shadow * (1.0 - inside));
        }
        if inside > 0.0 {
            place.dark *= 1.0 - inside;
            place.shade += (tone - place.shade) * inside;
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
                place.height += (0.9 * within).clamp(0.0, 0.35 * size);
            }
        }
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

/// Way to the light: from the upper left.
const TO_LIGHT: Vec2 = Vec2::new(-std::f32::consts::FRAC_1_SQRT_2, -std::f32::consts::FRAC_1_SQRT_2);

/// Share of the depth that is outside the basin.
const SHELF: f32 = 0.5;

/// Share of that which is gained on the way to the middle.
const BOWL: f32 = 0.4;

/// Run of a wall, in its height.
const WALL: f32 = 0.45;

/// Length of shadows, in the height of what throws them, and how dark they are.
const SHADOW: f32 = 0.75;
const SHADE: f32 = 0.5;

/// How much shadow there is where the edge that throws it is so far away.
fn sink(within: f32) -> f32 {
    (0.5 - 0.6 * within).clamp(0.0, 1.0)
}

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
    let height = |dx: i32, dy: i32| super::lattice(seed, x.wrapping_add(dx), y.wrapping_add(dy));
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
                let site = Vec2::new(super::lattice(seed, x, y), super::lattice(seed ^ 0x77, x, y)) * 0.45;
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
        Self { draw: super::lattice(seed ^ 0x7A, x, y), gap: next - distance }
    }
}

/// A polygon around a place, texels.
struct Outline {
    centre: Vec2,
    /// How far its corners are away at the most.
    reach: f32,
    /// From the centre, in order of their [`turn`].
    corners: Vec<(f32, Vec2)>,
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
    fn new(centre: Vec2, radius: f32, count: u32, levels: u32, ragged: f32, seed: u32) -> Self {
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
        Self { centre, reach, corners }
    }

    /// How far inside its edge a place is, texels; below zero outside.
    fn within(&self, at: Vec2) -> f32 {
        let off = at - self.centre;
        if off.length_squared() > (self.reach + 1.0) * (self.reach + 1.0) {
            return -FAR_OUT;
        }
        let turn = turn(off);
        let next = self.corners.partition_point(|corner| corner.0 <= turn);
        let (Some(&(_, a)), Some(&(_, b))) = (
            self.corners.get(next.checked_sub(1).unwrap_or(self.corners.len().saturating_sub(1))),
            self.corners.get(if next < self.corners.len() { next } else { 0 }),
        ) else {
            return -FAR_OUT;
        };
        let side = b - a;
        side.perp_dot(off - a) / side.length().max(0.1)
    }
}

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
struct Broken {
    /// The crater and the flakes around it.
    off: Vec<Outline>,
    basin: Option<Outline>,
    chips: Vec<Chip>,
}

impl Broken {
    fn new(crushed: &Crushed, unit: f32, radius: f32, grain: f32, seed: u32) -> Self {
        let Crushed { ragged, reach, fall, .. } = *crushed;
        // The root of the energy.
        let more = radius / (crushed.radius * unit).max(1.0e-3);
        let pick = |k: u32, what: i32| draw(seed ^ 0x0B0E, k as i32, what);
        let mut off = vec![Outline::new(Vec2::ZERO, radius, 6 + (3.0 * pick(0, 0)) as u32, 2, ragged, seed ^ 0x60)];
        let flakes = (crushed.flakes as f32 * more).round().min(64.0) as u32;
        for k in 0..flakes {
            let size = radius / more.max(1.0) * (0.3 + 0.5 * pick(k, 1));
            let far = radius * (1.0 + pick(k, 2) * (reach - 1.0)) - 1.8 * size;
            let centre = ops::unit(std::f32::consts::TAU * pick(k, 3)) * far.max(0.0);
            off.push(Outline::new(centre, size, 5, 1, 0.6, mix_in(seed, 0x100 + k)));
        }
        let basin = (crushed.basin > 0.0).then(|| {
            let centre = Vec2::new(pick(0, 4) - 0.5, pick(0, 5) - 0.3) * (0.3 * radius);
            Outline::new(centre, radius * crushed.basin, 7, 2, 0.8 * ragged, seed ^ 0x61)
        });
        let chips = (24.0 * crushed.chips * more).round().min(96.0) as u32;
        let chips = (0..chips)
            .map(|k| {
                let size = (grain * (0.4 + pick(k, 6) * pick(k, 7))).min(0.4 * radius);
                let mut way = ops::unit(std::f32::consts::TAU * pick(k, 8));
                if way.y < 0.3 && pick(k, 9) < fall {
                    way.y = 0.3 + way.y.abs();
                }
                let near = 0.95 + (0.85 * reach - 0.95) * pick(k, 10) * pick(k, 11).sqrt();
                let centre = way.normalize_or(Vec2::Y) * (near * radius);
                let outline =
                    Outline::new(centre, size, 4 + (2.0 * pick(k, 12)) as u32, 0, 0.6, mix_in(seed, 0x200 + k));
                Chip { outline, tone: 0.3 * pick(k, 13) - 0.18, ink: crushed.outline * unit }
            })
            .collect();
        Self { off, basin, chips }
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
