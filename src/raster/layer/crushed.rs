//! Crushed zones: what a hit leaves around itself.

use super::{
    broken::{Broken, Outline, TO_LIGHT},
    bruise::{self, Bruise},
    hash, noise,
};
use crate::{
    Grid,
    math::mix,
    pattern::{Strike, SurfaceFrame},
    raster::TexelRect,
};
use glam::{UVec2, Vec2};
use std::collections::VecDeque;

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
    /// Radius of a drawn pit with straight sides in the middle of what is [`broken`](Self::broken), as a share of the radius: it is shown as part of
    /// [drawn](crate::paint::Cel) cracks with a [`slant`](crate::paint::Cel::slant). 0..=2; default 0 = none.
    pub pit: f32,
    /// How many strokes of ink follow the chips of what is [`broken`](Self::broken), two each (a drawing). 0..=16; default 0.
    pub ticks: u32,
    /// How much of it is short radial and ring cracks with flakes between them, fewer and fewer up to [`reach`](Self::reach), in place of powder
    /// with an outline (laminated glass, ice). 0..=1; default 0.
    pub needles: f32,
    /// How much of that is a cloud of short cracks that cross each other, each with a small sheet to one side (ice), in place of radial ones. 0..=1;
    /// default 0.
    pub crazing: f32,
    /// How many bubbles lie around it, in strings and clusters. 0..=64; default 0.
    pub bubbles: u32,
    /// Width of the broken edge around the hole, which then has straight sides and is less dark towards it, as a share of the hole. 0..=4; default
    /// 0 = none.
    pub edge: f32,
    /// How much less is seen of cracks on the floor of what is [`broken`](Self::broken) off: what they ran through is gone. 0..=1; default 0.
    pub bare: f32,
    /// How far the edge of what is [`broken`](Self::broken) off strays from its chords, as material that crumbles: its wall is of uneven slope
    /// then, and pieces are longer one way. Pattern units, 0..=0.05; default 0 = clean chords.
    pub jag: f32,
    /// Share of the floor of what is [`broken`](Self::broken) off that is rounded stones of several sizes in something finer (the aggregate of
    /// concrete); else it is of one grain. 0..=1; default 0.
    pub stones: f32,
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
        pit: 0.0,
        ticks: 0,
        needles: 0.0,
        crazing: 0.0,
        bubbles: 0,
        edge: 0.0,
        bare: 0.0,
        jag: 0.0,
        stones: 0.0,
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
            ("crushed.pit", self.pit, 0.0..=2.0, "0..=2"),
            ("crushed.ticks", self.ticks as f32, 0.0..=16.0, "0..=16"),
            ("crushed.needles", self.needles, 0.0..=1.0, "0..=1"),
            ("crushed.crazing", self.crazing, 0.0..=1.0, "0..=1"),
            ("crushed.bubbles", self.bubbles as f32, 0.0..=64.0, "0..=64"),
            ("crushed.edge", self.edge, 0.0..=4.0, "0..=4"),
            ("crushed.bare", self.bare, 0.0..=1.0, "0..=1"),
            ("crushed.jag", self.jag, 0.0..=0.05, "0..=0.05"),
            ("crushed.stones", self.stones, 0.0..=1.0, "0..=1"),
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
            jag: scaled(self.jag, 0.0, 0.05),
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
    /// A drawn pit: how far inside its edge it is in shares of [`PIT_STEPS`] of a texel, how much its floor covers, and how its side faces the light,
    /// 0 = away from it, 255 = squarely.
    pub(crate) pit: [u8; 3],
}

/// Steps of a texel in which the edge of a pit is known.
pub(crate) const PIT_STEPS: f32 = 8.0;

impl Spot {
    const NONE: Self = Self { slope: [0; 2], pale: 0, shade: 0, dark: 0, deep: 0, pit: [0; 3] };

    /// Both, in any order: what is deeper in the hole or paler shows, and the steeper slope.
    fn with(self, other: Self) -> Self {
        let strength = |spot: Self| (spot.dark, spot.pale, spot.shade);
        let steep = |[x, y]: [i16; 2]| (i32::from(x).pow(2) + i32::from(y).pow(2), x, y);
        let slope = if steep(self.slope) >= steep(other.slope) { self.slope } else { other.slope };
        let (deep, pit) = (self.deep.max(other.deep), self.pit.max(other.pit));
        Self { slope, deep, pit, ..if strength(self) >= strength(other) { self } else { other } }
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

/// What more impacts than so many crush on one tile does not show: there is nothing left to crush. The first ones count.
const MOST: usize = 8;

/// Energies at which a zone gets larger, from 1 to 2, and so on: a thousand little hits on one place do not draw it a thousand times.
const LEVELS: [f32; 4] = [1.0, 1.189_207_1, std::f32::consts::SQRT_2, 1.681_792_8];

/// The highest level that is not above an energy.
fn level(energy: f32) -> f32 {
    let mut octave = 1.0;
    while octave > energy && octave > 1e-6 {
        octave *= 0.5;
    }
    while 2.0 * octave <= energy && octave < 1e6 {
        octave *= 2.0;
    }
    LEVELS.iter().rev().map(|level| octave * level).find(|level| *level <= energy).unwrap_or(energy)
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
    /// What is still to be drawn, in this order.
    waiting: VecDeque<Waiting>,
    /// Which tiles are to be drawn anew.
    is_anew: Vec<bool>,
    /// How far beside a plate its side is seen, texels.
    beyond: u32,
}

/// A tile that is not drawn yet.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    tile: UVec2,
    /// The impact that has crushed it since; `None` = all of the tile is to be drawn anew.
    impact: Option<u32>,
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
            waiting: VecDeque::new(),
            is_anew: vec![false; count.element_product() as usize],
            beyond: 0,
        }
    }

    /// The same beside plates of this thickness.
    pub(super) fn with_sides(self, thick: f32) -> Self {
        Self { beyond: super::plates::beyond(thick, self.frame), ..self }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.used == 0
    }

    pub(crate) const fn settings(&self) -> &Crushed {
        &self.crushed
    }

    /// Takes up the first hits of `all`, those in `strikes`: from then on it [has to be drawn](Self::draw_some) as they have left it.
    pub(super) fn follow(&mut self, strikes: &[Strike], all: &[Strike]) {
        if self.shown == strikes.len() || self.crushed.radius <= 0.0 {
            return;
        }
        // Tiles of impacts that have changed are drawn anew; what is new is laid over them.
        let (mut anew, mut new) = (Vec::new(), Vec::new());
        while self.shown > strikes.len() {
            self.shown -= 1;
            let Some(strike) = all.get(self.shown) else { continue };
            self.set(strike, strike.before, &mut anew);
        }
        for strike in &strikes[self.shown..] {
            self.shown += 1;
            if strike.before > 0.0 {
                self.set(strike, strike.energy, &mut anew);
            } else {
                self.set(strike, strike.energy, &mut Vec::new());
                new.push(strike.impact);
            }
        }
        anew.sort_unstable_by_key(|tile| (tile.y, tile.x));
        let columns = self.columns;
        let slot = |tile: UVec2| (tile.y * columns + tile.x) as usize;
        anew.retain(|tile| !std::mem::replace(&mut self.is_anew[slot(*tile)], true));
        if !anew.is_empty() {
            let Self { waiting, is_anew, .. } = self;
            waiting.retain(|Waiting { tile, impact }| impact.is_none() || !is_anew[slot(*tile)]);
            self.waiting.extend(anew.into_iter().map(|tile| Waiting { tile, impact: None }));
        }
        for index in new {
            let Some(Some(zone)) = self.zones.get(index as usize).copied() else { continue };
            let is_wanted = |tile: &UVec2| !self.is_anew[slot(*tile)] && self.counts(index, *tile);
            let mut tiles: Vec<UVec2> = tiles_of(&zone.bounds).filter(is_wanted).collect();
            // From the hit outward.
            let middle = |tile: UVec2| (tile * TILE + TILE / 2).as_vec2();
            tiles.sort_by(|a, b| {
                let far = |tile: UVec2| middle(tile).distance_squared(zone.pos);
                far(*a).total_cmp(&far(*b))
            });
            self.waiting.extend(tiles.into_iter().map(|tile| Waiting { tile, impact: Some(index) }));
        }
    }

    /// Whether tiles are still to be drawn.
    pub(super) fn is_behind(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Draws at most so many tiles; appends the rectangles of the texels that may be others now. Returns whether any are left.
    ///
    /// What it shows when none is left depends on the hits alone, not on the slices.
    pub(super) fn draw_some(
        &mut self,
        most: usize,
        forbidden: Option<&Grid<bool>>,
        changed: &mut Vec<TexelRect>,
    ) -> bool {
        for _ in 0..most {
            let Some(Waiting { tile, impact }) = self.waiting.pop_front() else { break };
            let texels = self.texels_of(tile);
            let Some(impact) = impact else {
                let slot = (tile.y * self.columns + tile.x) as usize;
                self.is_anew[slot] = false;
                self.used -= usize::from(self.tiles[slot].take().is_some());
                let zones: Vec<u32> = self.on(tile).take(MOST).collect();
                zones.into_iter().for_each(|index| self.draw(index, tile, forbidden));
                changed.push(texels);
                continue;
            };
            if let Some(Some(zone)) = self.zones.get(impact as usize) {
                changed.push(texels.intersect(zone.bounds));
                self.draw(impact, tile, forbidden);
            }
        }
        self.is_behind()
    }

    fn texels_of(&self, tile: UVec2) -> TexelRect {
        let min = tile * TILE;
        TexelRect { min, max: (min + TILE).min(self.frame.size()) }
    }

    /// The impacts whose zones touch a tile, in order.
    fn on(&self, tile: UVec2) -> impl Iterator<Item = u32> + '_ {
        let rect = self.texels_of(tile);
        let touches = move |zone: &Option<Zone>| zone.is_some_and(|zone| !zone.bounds.intersect(rect).is_empty());
        (0..).zip(&self.zones).filter(move |(_, zone)| touches(zone)).map(|(index, _)| index)
    }

    /// Whether an impact is among the first on a tile, if its zone touches it.
    fn counts(&self, index: u32, tile: UVec2) -> bool {
        self.on(tile).take(MOST).take_while(|other| *other < index).count() < MOST
    }

    /// Gives the impact of a hit this energy; adds the tiles that may be others now.
    fn set(&mut self, strike: &Strike, energy: f32, others: &mut Vec<UVec2>) {
        let (index, energy) = (strike.impact as usize, level(energy));
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
        if before != zone {
            let bounds = |zone: Option<Zone>| zone.map_or(TexelRect::default(), |zone| zone.bounds);
            let tiles = tiles_of(&bounds(before).union(bounds(zone)));
            others.extend(tiles.filter(|tile| self.counts(strike.impact, *tile)));
        }
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
        let mut shape = Shape::new(&self.crushed, self.frame.texels_per_unit(), radius, seed);
        if let Some(broken) = &mut shape.broken {
            broken.keep_near(rect.min.as_vec2() - zone.pos, rect.max.as_vec2() - zone.pos, shape.depth);
        }
        let (min, max) = (rect.min.as_vec2() - zone.pos - 2.0, rect.max.as_vec2() - zone.pos + 2.0);
        shape.bubbles.retain(|&(middle, radius)| {
            let far = middle.clamp(min, max).distance_squared(middle);
            far <= (radius + 1.0) * (radius + 1.0)
        });
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

    /// Whether a plate whose middle is at a place, and all of it within `extent` of it, is gone in a hole, or whole beside one; `None` if no hole
    /// is there, or the plate is as large as that. Only holes of impacts that show all of the plate anew when they are shown. Texels.
    pub(crate) fn is_gone(&self, at: Vec2, extent: f32) -> Option<bool> {
        let around = extent + 2.0 + self.beyond as f32;
        let (min, max) = ((at - around).max(Vec2::ZERO), (at + around).min(self.frame.size().as_vec2()));
        let plate = TexelRect { min: min.as_uvec2(), max: max.ceil().as_uvec2() };
        let near = (0..).zip(&self.zones).filter_map(|(index, zone)| {
            let zone = zone.as_ref()?;
            let hole = self.radius(zone.energy) * self.crushed.hole;
            let holds = zone.bounds.min.as_vec2().cmple(min).all() && zone.bounds.max.as_vec2().cmpge(max).all();
            let shows = || tiles_of(&plate).all(|tile| self.counts(index, tile));
            (holds && extent < hole && shows()).then(|| at.distance_squared(zone.pos) < hole * hole)
        });
        near.max()
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
pub(super) const WIDEST: f32 = 1.1;

/// A crushed zone in texels.
pub(super) struct Shape<'a> {
    pub(super) crushed: &'a Crushed,
    pub(super) radius: f32,
    pub(super) depth: f32,
    pub(super) rough: f32,
    pub(super) grain: f32,
    pub(super) jag: f32,
    broken: Option<Broken>,
    /// A hole with a broken edge, and how far that reaches.
    hole: Option<[Outline; 2]>,
    /// From the hit, and their radii, texels.
    bubbles: Vec<(Vec2, f32)>,
}

/// What there is at a place.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) height: f32,
    pub(super) pale: f32,
    pub(super) shade: f32,
    pub(super) dark: f32,
    pub(super) pit: [u8; 3],
}

impl Place {
    const NONE: Self = Self { height: 0.0, pale: 0.0, shade: 0.0, dark: 0.0, pit: [0; 3] };
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
            jag: crushed.jag * unit,
            broken: crushed.broken.then(|| Broken::new(crushed, unit, radius, grain, seed)),
            hole: (crushed.hole > 0.0 && crushed.edge > 0.0).then(|| {
                let hole = crushed.hole * radius;
                // Within what other outlines reach.
                let most = radius * crushed.reach.max(1.0 + WIDEST * crushed.ragged) / (1.0 + 0.75 * WIDEST);
                let around = (hole + (0.75 * crushed.edge * hole).max(1.5)).min(most);
                let centre = Vec2::ZERO;
                [
                    Outline::new(centre, hole, 6 + (seed >> 3) % 3, 2, 0.62, seed ^ 0x71),
                    Outline::new(centre, around, 8 + (seed >> 5) % 4, 1, 0.75, seed ^ 0x72),
                ]
            }),
            bubbles: bruise::bubbles(crushed.bubbles, radius, crushed.reach, grain, seed),
        }
    }

    /// Lays it over the texels `rect` of a tile whose first texel is at `corner`.
    fn draw(&self, texels: &mut Tile, centre: Vec2, seed: u32, rect: TexelRect, corner: UVec2) {
        const WIDE: usize = TILE as usize + 2;
        // Heights around each texel are needed for its slope.
        let mut places = [Place::NONE; WIDE * WIDE];
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

    /// `off` is the way from the centre, `at` the place in the field.
    fn place(&self, off: Vec2, at: Vec2, seed: u32) -> Place {
        let Crushed { ragged, soft, hole, pale, speckle, flake, dust, chips, reach, .. } = *self.crushed;
        let mut place = Place::NONE;
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
        if self.crushed.needles > 0.0 {
            self.add_bruise(&mut place, off, radii, at, seed);
        }
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
                place.height += -self.depth * bowl + fade * self.rough * (0.6 * coarse + 0.4 * fine);
                let grains = 1.0 - speckle * (0.5 + 0.5 * grain(5, 0.6 * self.grain)).clamp(0.0, 1.0);
                place.pale = place.pale.max(pale * fade * grains * (1.0 - self.crushed.needles));
                place.shade += speckle * (0.6 * coarse + 0.3 * fine) * inside * (1.0 - self.crushed.needles);
            }
        }
        if flake > 1.0 {
            self.add_flake(&mut place, way, radii, seed);
        }
        if (inside < 1.0 || self.crushed.needles > 0.0) && radii < reach {
            let left = 1.0 - ((radii - 0.8) / (reach - 0.8)).clamp(0.0, 1.0);
            if dust > 0.0 {
                let cloud = 0.65 + 0.35 * grain(6, 5.0 * self.grain);
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
        if let Some(hole) = &self.hole {
            self.add_hole(&mut place, hole, off);
        } else if hole > 0.0 && radii <= hole * (1.0 + WIDEST * ragged) + 1.0 {
            let radius = self.radius * hole * (1.0 + 0.6 * ragged * (round(7, 1.9) + 0.5 * round(8, 4.3)));
            place.dark = (radius - distance + 0.5).clamp(0.0, 1.0);
        }
        place
    }

    /// Short cracks and flakes, fewer and fewer outward.
    fn add_bruise(&self, place: &mut Place, off: Vec2, radii: f32, at: Vec2, seed: u32) {
        let Crushed { ragged, pale, speckle, reach, needles, .. } = self.crushed;
        let way = off.normalize_or_zero();
        let round = |k: u32, times: f32| noise(seed ^ k, way.x * times + 17.0, way.y * times + 31.0);
        let cloud = noise(seed ^ 10, at.x / (3.0 * self.grain), at.y / (3.0 * self.grain));
        // No outline: what is near is dense, and what is far is not there in more and more places.
        let stray = 1.0 + ragged * (0.45 * round(2, 1.3) + 0.4 * round(3, 3.7)) + 0.25 * ragged * cloud;
        let q = radii / stray.max(0.3);
        let left = (1.0 - q / reach).min(2.0 * (1.0 - radii / reach)).clamp(0.0, 1.0);
        if left <= 0.0 {
            return;
        }
        let dense = (1.5 * left * left).min(1.0);
        let fine = (self.radius / (8.0 * self.grain)).sqrt().clamp(0.6, 3.0);
        let crazing = self.crushed.crazing;
        let mut bruise = if crazing < 1.0 { bruise::bruise(off, q, dense, fine, seed) } else { Bruise::default() };
        let mut haze = (1.08 - 0.8 * q).clamp(0.0, 1.0);
        if crazing > 0.0 {
            let crazed = bruise::crazed(off, self.radius, left, seed);
            bruise.crack = bruise.crack * (1.0 - crazing) + crazed.crack * crazing;
            bruise.flake = bruise.flake * (1.0 - crazing) + crazed.flake * crazing;
            // No even milk.
            haze *= 1.0 - crazing * (0.12 - 0.35 * cloud - 0.3 * crazed.flake);
            place.shade += crazing * needles * (0.5 * crazed.flake - 0.22) * left;
        }
        let uneven = 1.0 - speckle * (0.5 + 0.5 * cloud) * (1.0 - 0.5 * haze);
        let milk = ((1.5 * haze * haze).min(1.0) + (0.55 + 0.75 * crazing) * bruise.flake * left * left) * uneven;
        place.pale = place.pale.max(needles * pale * milk.max(bruise.crack * (0.35 + 0.65 * left)));
        place.shade += needles * 0.35 * speckle * (bruise.flake - 0.3) * left;
        place.height += self.rough * bruise.flake * left * left - self.rough * bruise.crack * left;
    }

    /// A hole with straight sides: its broken wall is seen within, chips with sharp sides have come off around it.
    fn add_hole(&self, place: &mut Place, [hole, shell]: &[Outline; 2], off: Vec2) {
        let pale = self.crushed.pale;
        let (within, inward) = hole.side(off);
        let inside = (within + 0.5).clamp(0.0, 1.0);
        let line = |far: f32, thick: f32| (thick + 0.5 - far.abs()).clamp(0.0, 1.0);
        if inside < 1.0 {
            let (chip, slope) = shell.side(off);
            let chipped = (chip + 0.5).clamp(0.0, 1.0) * (1.0 - inside);
            if chipped > 0.0 {
                // Each chip leaves a flat face that slopes down to the hole, with a sharp side.
                let facing = slope.dot(TO_LIGHT);
                let fall = (-within / (chip - within).max(1.0)).clamp(0.0, 1.0);
                let face = 0.14 + 0.40 * facing.max(0.0) + 0.30 * (1.0 - fall);
                let side = 0.75 * line(chip - 0.6, 0.4) * (0.35 + 0.65 * facing.abs());
                let edge = 0.9 * line(within + 0.8, 0.5);
                let keep = 1.0 - 0.75 * chipped;
                place.pale = (place.pale * keep).max(pale * chipped * face.max(side).max(edge));
                place.shade -= 0.28 * chipped * (-facing).max(0.0);
            }
        }
        if inside > 0.0 {
            // Glass is thick: more is seen of its far wall, which is lit.
            let void = (hole.within((off - TO_LIGHT * (0.16 * hole.reach)) * 1.2) + 0.5).clamp(0.0, 1.0);
            let facing = inward.dot(TO_LIGHT);
            let bright =
                (0.10 + 0.50 * facing.max(0.0)).max(0.85 * line(within - 0.7, 0.5) * (0.4 + 0.6 * facing.max(0.0)));
            let wall = bright.max(0.45 * (1.0 - 2.0 * (void - 0.5).abs())) * (1.0 - void);
            place.dark = inside;
            place.pale += (pale * wall - place.pale) * inside;
            place.shade *= 1.0 - inside;
        }
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::Rng, pattern::Timeline};

    /// Hits here and there, some of which merge with earlier ones and come long after them.
    fn timeline(rng: &mut Rng) -> Timeline {
        let mut timeline = Timeline::default();
        let mut energies = Vec::<f32>::new();
        for _ in 0..30 {
            let energy = rng.range(0.1, 3.0);
            let pos = |impact: usize| 0.2 + 0.6 * Vec2::new((impact % 4) as f32, (impact / 4) as f32) / 4.0;
            if rng.range(0.0, 1.0) < 0.4 && !energies.is_empty() {
                let impact = rng.range(0.0, energies.len() as f32) as usize % energies.len();
                timeline.strike(impact as u32, pos(impact), energies[impact], energies[impact] + energy);
                energies[impact] += energy;
            } else {
                timeline.strike(energies.len() as u32, pos(energies.len()), 0.0, energy);
                energies.push(energy);
            }
        }
        timeline
    }

    #[test]
    fn slices_and_the_way_there_do_not_matter() {
        let frame = SurfaceFrame::new(UVec2::new(200, 140)).unwrap();
        for seed in 0..12 {
            let mut rng = Rng::new(seed);
            let timeline = timeline(&mut rng);
            let all = timeline.strikes();
            let crushed = Crushed { broken: seed % 2 == 0, radius: 0.06, ..Crushed::DEFAULT };
            let mut field = CrushedField::new(&crushed, frame, seed);
            let mut shown = Grid::new(frame.size(), Spot::NONE);
            for _ in 0..80 {
                let count = rng.range(0.0, all.len() as f32 + 1.0) as usize;
                field.follow(&all[..count.min(all.len())], all);
                let mut changed = Vec::new();
                field.draw_some(rng.range(0.0, 12.0) as usize, None, &mut changed);
                copy(&field, &changed, &mut shown);
            }
            let count = rng.range(0.0, all.len() as f32 + 1.0) as usize;
            field.follow(&all[..count.min(all.len())], all);
            let mut changed = Vec::new();
            while field.draw_some(3, None, &mut changed) {}
            copy(&field, &changed, &mut shown);
            let mut at_once = CrushedField::new(&crushed, frame, seed);
            at_once.follow(&all[..count.min(all.len())], all);
            assert!(at_once.is_behind() == (count > 0) && !field.is_behind());
            at_once.draw_some(usize::MAX, None, &mut Vec::new());
            let whole = TexelRect::whole(frame.size());
            let mut expected = Grid::new(frame.size(), Spot::NONE);
            copy(&at_once, &[whole], &mut expected);
            let mut now = Grid::new(frame.size(), Spot::NONE);
            copy(&field, &[whole], &mut now);
            assert!(now == expected, "seed {seed}");
            assert!(shown == expected, "seed {seed}: some texels changed without notice");
        }
    }

    fn copy(field: &CrushedField, rects: &[TexelRect], to: &mut Grid<Spot>) {
        for rect in rects {
            for y in rect.min.y..rect.max.y {
                field.read(rect.min.x, y, &mut to.row_mut(y as usize)[rect.min.x as usize..rect.max.x as usize]);
            }
        }
    }

    #[test]
    fn it_is_drawn_from_the_hit_outward() {
        let frame = SurfaceFrame::new(UVec2::splat(512)).unwrap();
        let mut field = CrushedField::new(&Crushed { radius: 0.2, ..Crushed::DEFAULT }, frame, 1);
        let mut timeline = Timeline::default();
        timeline.strike(0, Vec2::new(0.3, 0.6), 0.0, 1.0);
        field.follow(timeline.strikes(), timeline.strikes());
        let mut last = 0.0;
        loop {
            let mut changed = Vec::new();
            let is_left = field.draw_some(1, None, &mut changed);
            let [rect] = changed[..] else { panic!("one tile, not {}", changed.len()) };
            let middle = (rect.min / TILE * TILE + TILE / 2).as_vec2();
            let far = middle.distance(frame.to_texel(Vec2::new(0.3, 0.6)));
            assert!(far >= last, "{far} after {last}");
            last = far;
            if !is_left {
                break;
            }
        }
        assert!(last > 200.0);
    }
}
