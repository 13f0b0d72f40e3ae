//! The crushed zones of all hits.

use super::{
    broken::crater,
    crushed::CrushedZone,
    outline::WIDEST,
    shape::{Pieces, Shape},
    spot::{Spot, TILE, Tile},
};
use crate::{
    Grid,
    math::mix,
    pattern::{Bricks, Strike, SurfaceFrame},
    raster::TexelRect,
    relief::Crater,
};
use glam::{UVec2, Vec2};
use std::{collections::VecDeque, sync::Arc};

/// Salt of the random draws of crushed zones. Frozen: a seed must give the same result in every version.
const OF_ZONES: u64 = 0xC4;

/// The crushed zone of one impact.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Zone {
    /// Texels.
    pos: Vec2,
    energy: f32,
    bounds: TexelRect,
    /// Relative to `pos`, texels.
    bricks: Bricks,
}

/// At most this many zones are drawn on one tile, the first ones: more make no visible difference.
const MOST: usize = 8;

/// Energies at which a zone is enlarged, from 1 to 2 and repeated for each doubling, so that a thousand small hits on
/// one place do not redraw it a thousand times.
const LEVELS: [f32; 4] = [1.0, 1.189_207_1, std::f32::consts::SQRT_2, 1.681_792_8];

/// Seed of all zones of a layer.
fn own_seed(seed: u64) -> u32 {
    mix(seed ^ OF_ZONES) as u32
}

/// Seed of the zone of an impact.
const fn seed_of(own: u32, impact: u32) -> u32 {
    own ^ impact.wrapping_mul(0x9E37_79B1)
}

/// The crater that an impact at `pos` (pattern units) has at an energy, in a layer with this seed; `None` if zones have no terraces.
pub(super) fn crater_of(crushed: &CrushedZone, seed: u64, impact: u32, pos: Vec2, energy: f32) -> Option<Crater> {
    let radius = crushed.radius * level(energy).sqrt();
    crater(crushed, pos, radius, seed_of(own_seed(seed), impact))
}

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

/// The crushed zones of all impacts, in tiles that exist only where there are zones.
#[derive(Clone, Debug)]
pub(crate) struct CrushedField {
    crushed: CrushedZone,
    frame: SurfaceFrame,
    seed: u32,
    /// By impact.
    zones: Vec<Option<Zone>>,
    /// Number of registered hits.
    shown: usize,
    columns: u32,
    tiles: Vec<Option<Box<Tile>>>,
    used: usize,
    /// Tiles that are still to be drawn, in this order.
    waiting: VecDeque<Waiting>,
    /// Which tiles are to be redrawn completely.
    is_anew: Vec<bool>,
    /// The one that is being redrawn.
    redrawn: Option<Redrawn>,
    /// Distance beside a plate at which its side is visible, texels.
    beyond: u32,
    /// What was drawn last, until nothing waits.
    known: Vec<KnownPieces>,
}

/// The pieces of the zone of an impact.
#[derive(Clone, Debug)]
struct KnownPieces {
    index: u32,
    zone: Zone,
    pieces: Arc<Pieces>,
}

/// A tile that is not drawn yet.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    tile: UVec2,
    /// The impact that is to be added to it; `None` = the whole tile is to be redrawn.
    impact: Option<u32>,
}

/// A tile that is being redrawn: what it showed before stays until it is complete.
#[derive(Clone, Debug)]
struct Redrawn {
    tile: UVec2,
    /// Impacts that are still to be drawn, the last one first.
    left: Vec<u32>,
    texels: Option<Box<Tile>>,
}

/// Compares what is shown, not the state of the work.
impl PartialEq for CrushedField {
    fn eq(&self, other: &Self) -> bool {
        self.crushed == other.crushed && self.frame == other.frame && self.tiles == other.tiles
    }
}

impl CrushedField {
    pub(super) fn new(crushed: &CrushedZone, frame: SurfaceFrame, seed: u64) -> Self {
        let count = frame.size().map(|side| side.div_ceil(TILE));
        Self {
            crushed: *crushed,
            frame,
            seed: own_seed(seed),
            zones: Vec::new(),
            shown: 0,
            columns: count.x,
            tiles: vec![None; count.element_product() as usize],
            used: 0,
            waiting: VecDeque::new(),
            is_anew: vec![false; count.element_product() as usize],
            redrawn: None,
            beyond: 0,
            known: Vec::new(),
        }
    }

    /// The same, beside plates of this thickness.
    pub(super) fn with_sides(self, thick: f32) -> Self {
        Self { beyond: super::plates::beyond(thick, self.frame), ..self }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.used == 0
    }

    pub(crate) const fn settings(&self) -> &CrushedZone {
        &self.crushed
    }

    /// Registers the first hits of `all`, those in `strikes`. Their zones are then [drawn in
    /// slices](Self::draw_some).
    pub(super) fn follow(&mut self, strikes: &[Strike], all: &[Strike]) {
        if self.shown == strikes.len() || self.crushed.radius <= 0.0 {
            return;
        }
        // Tiles of impacts that have changed are redrawn; new impacts are added to what is there.
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
        let mut redrawn = self.redrawn.take();
        // A tile that is being redrawn begins again if any of its zones is another, or one comes to it.
        let has_changed = |redrawn: &mut Redrawn| {
            let comes = |index: &u32| self.on(redrawn.tile).any(|on| on == *index) && self.counts(*index, redrawn.tile);
            anew.contains(&redrawn.tile) || new.iter().any(comes)
        };
        if let Some(Redrawn { tile, .. }) = redrawn.take_if(has_changed) {
            self.waiting.push_front(Waiting { tile, impact: None });
        }
        self.redrawn = redrawn;
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

    /// Whether tiles are left to draw.
    pub(super) fn is_behind(&self) -> bool {
        !self.waiting.is_empty() || self.redrawn.is_some()
    }

    /// Draws at most the parts of `most` zones that lie on one tile each; appends the rectangles of the texels that may have changed. Returns
    /// whether any are left.
    ///
    /// When none is left the result depends only on the hits, not on the slices.
    pub(super) fn draw_some(
        &mut self,
        most: usize,
        forbidden: Option<&Grid<bool>>,
        changed: &mut Vec<TexelRect>,
    ) -> bool {
        for _ in 0..most {
            if self.redraw_some(forbidden, changed) {
                continue;
            }
            let Some(Waiting { tile, impact }) = self.waiting.pop_front() else { break };
            let Some(impact) = impact else {
                let mut left: Vec<u32> = self.on(tile).take(MOST).collect();
                left.reverse();
                self.redrawn = Some(Redrawn { tile, left, texels: None });
                self.redraw_some(forbidden, changed);
                continue;
            };
            if let Some(Some(zone)) = self.zones.get(impact as usize) {
                changed.push(self.texels_of(tile).intersect(zone.bounds));
                let slot = self.slot(tile);
                let before = self.tiles[slot].take();
                self.used -= usize::from(before.is_some());
                let now = self.draw(impact, tile, before, forbidden);
                self.used += usize::from(now.is_some());
                self.tiles[slot] = now;
            }
        }
        if !self.is_behind() {
            self.known = Vec::new();
        }
        self.is_behind()
    }

    /// Draws the next zone of the tile that is being redrawn, if there is one. It is shown with its last zone.
    fn redraw_some(&mut self, forbidden: Option<&Grid<bool>>, changed: &mut Vec<TexelRect>) -> bool {
        let Some(Redrawn { tile, mut left, mut texels }) = self.redrawn.take() else { return false };
        if let Some(index) = left.pop() {
            texels = self.draw(index, tile, texels, forbidden);
        }
        if !left.is_empty() {
            self.redrawn = Some(Redrawn { tile, left, texels });
            return true;
        }
        let slot = self.slot(tile);
        self.is_anew[slot] = false;
        self.used += usize::from(texels.is_some());
        self.used -= usize::from(std::mem::replace(&mut self.tiles[slot], texels).is_some());
        changed.push(self.texels_of(tile));
        true
    }

    const fn slot(&self, tile: UVec2) -> usize {
        (tile.y * self.columns + tile.x) as usize
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

    /// Whether an impact whose zone touches a tile is among the first ones on it.
    fn counts(&self, index: u32, tile: UVec2) -> bool {
        self.on(tile).take(MOST).take_while(|other| *other < index).count() < MOST
    }

    /// Sets the energy of the impact of a hit; adds the tiles that may have changed.
    fn set(&mut self, strike: &Strike, energy: f32, others: &mut Vec<UVec2>) {
        let (index, energy) = (strike.impact as usize, level(energy));
        if self.zones.len() <= index {
            self.zones.resize(index + 1, None);
        }
        let zone = (energy > 0.0).then(|| {
            let pos = self.frame.to_texel(strike.pos);
            let CrushedZone { reach, flake, ragged, .. } = self.crushed;
            let radius = self.radius(energy) * reach.max(flake).max(1.0 + WIDEST * ragged);
            let bricks = strike.bricks.map(|corners| corners.map(|corner| self.frame.to_texel(corner) - pos));
            let limit = self.frame.size().as_vec2();
            let min = (pos - radius - 2.0).floor().clamp(Vec2::ZERO, limit).as_uvec2();
            let max = (pos + radius + 2.0).ceil().clamp(Vec2::ZERO, limit).as_uvec2();
            Zone { pos, energy, bounds: TexelRect { min, max }, bricks }
        });
        let before = std::mem::replace(&mut self.zones[index], zone);
        if before != zone {
            let bounds = |zone: Option<Zone>| zone.map_or(TexelRect::default(), |zone| zone.bounds);
            let tiles = tiles_of(&bounds(before).union(bounds(zone)));
            others.extend(tiles.filter(|tile| self.counts(strike.impact, *tile)));
        }
    }

    /// Seed of what is random about the zone of an impact.
    const fn seed_of(&self, impact: u32) -> u32 {
        seed_of(self.seed, impact)
    }

    fn radius(&self, energy: f32) -> f32 {
        self.crushed.radius * self.frame.texels_per_unit() * energy.sqrt()
    }

    /// Draws the zone of an impact over what a tile shows, if it touches it.
    fn draw(
        &mut self,
        index: u32,
        tile: UVec2,
        before: Option<Box<Tile>>,
        forbidden: Option<&Grid<bool>>,
    ) -> Option<Box<Tile>> {
        let Some(Some(zone)) = self.zones.get(index as usize).copied() else { return before };
        let corner = tile * TILE;
        let rect = TexelRect { min: corner, max: (corner + TILE).min(self.frame.size()) }.intersect(zone.bounds);
        if rect.is_empty() {
            return before;
        }
        let (radius, seed, unit) = (self.radius(zone.energy), self.seed_of(index), self.frame.texels_per_unit());
        let pieces = self.pieces_of(index, &zone);
        let mut texels = before.unwrap_or_else(|| Box::new([Spot::NONE; (TILE * TILE) as usize]));
        let near = [rect.min, rect.max].map(|corner| corner.as_vec2() - zone.pos);
        let shape = Shape::near(&self.crushed, unit, radius, &pieces, near);
        shape.draw(&mut texels, zone.pos, seed, rect, corner);
        let Some(forbidden) = forbidden else { return Some(texels) };
        for y in rect.min.y..rect.max.y {
            for x in rect.min.x..rect.max.x {
                if forbidden.get(x, y) == Some(true) {
                    texels[((y - corner.y) * TILE + x - corner.x) as usize] = Spot::NONE;
                }
            }
        }
        Some(texels)
    }

    /// The pieces of the zone of an impact, which are kept until all of it is drawn.
    fn pieces_of(&mut self, index: u32, zone: &Zone) -> Arc<Pieces> {
        let is_it = |known: &&KnownPieces| known.index == index && known.zone == *zone;
        if let Some(known) = self.known.iter().find(is_it) {
            return known.pieces.clone();
        }
        let (radius, unit) = (self.radius(zone.energy), self.frame.texels_per_unit());
        let pieces = Arc::new(Pieces::new(&self.crushed, unit, radius, self.seed_of(index), &zone.bricks));
        self.known.truncate(MOST - 1);
        self.known.insert(0, KnownPieces { index, zone: *zone, pieces: pieces.clone() });
        pieces
    }

    /// Whether a plate with its middle at `at` and its outline within `extent` of it is missing in a hole (`true`) or
    /// whole beside one (`false`). `None` if there is no hole, or the plate is as large as the hole. Only holes of
    /// impacts that redraw the whole plate when they are shown count. Texels.
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

    /// Whether there may be crushed texels in a rectangle.
    pub(crate) fn touches(&self, rect: TexelRect) -> bool {
        let (min, max) = (rect.min / TILE, rect.max.map(|end| end.div_ceil(TILE)));
        (min.y..max.y).any(|y| (min.x..max.x).any(|x| self.tiles[(y * self.columns + x) as usize].is_some()))
    }

    /// Reads the texels of row `y` from column `x` on.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::Rng,
        pattern::{NO_BRICKS, Timeline},
    };

    /// Hits here and there, some of which merge with earlier ones and come long after them.
    fn timeline(rng: &mut Rng) -> Timeline {
        let mut timeline = Timeline::default();
        let mut energies = Vec::<f32>::new();
        for _ in 0..30 {
            let energy = rng.range(0.1, 3.0);
            let pos = |impact: usize| 0.2 + 0.6 * Vec2::new((impact % 4) as f32, (impact / 4) as f32) / 4.0;
            if rng.range(0.0, 1.0) < 0.4 && !energies.is_empty() {
                let impact = rng.range(0.0, energies.len() as f32) as usize % energies.len();
                timeline.strike(impact as u32, (pos(impact), NO_BRICKS), energies[impact], energies[impact] + energy);
                energies[impact] += energy;
            } else {
                timeline.strike(energies.len() as u32, (pos(energies.len()), NO_BRICKS), 0.0, energy);
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
            let rim = if seed % 4 == 1 { 0.5 } else { 0.0 };
            let crushed = CrushedZone { broken: seed % 2 == 0, radius: 0.06, rim, ..CrushedZone::DEFAULT };
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

    /// A tile with many zones, one of which changes, shows them as they were until all of them are drawn, a few in each slice.
    #[test]
    fn tiles_are_redrawn_at_once_however_small_the_slices() {
        let frame = SurfaceFrame::new(UVec2::splat(96)).unwrap();
        let crushed = CrushedZone { broken: true, radius: 0.2, ..CrushedZone::DEFAULT };
        let mut timeline = Timeline::default();
        for impact in 0..6 {
            timeline.strike(impact, (Vec2::splat(0.3 + 0.08 * impact as f32), NO_BRICKS), 0.0, 1.0);
        }
        let shown = |field: &CrushedField| {
            let mut texels = Grid::new(frame.size(), Spot::NONE);
            copy(field, &[TexelRect::whole(frame.size())], &mut texels);
            texels
        };
        let mut field = CrushedField::new(&crushed, frame, 3);
        let mut follow = |timeline: &Timeline, most: usize| {
            field.follow(timeline.strikes(), timeline.strikes());
            field.draw_some(most, None, &mut Vec::new());
            (shown(&field), field.is_behind())
        };
        let (before, _) = follow(&timeline, usize::MAX);
        let mut elsewhere = 6;
        timeline.strike(2, (Vec2::splat(0.46), NO_BRICKS), 1.0, 3.0);
        let mut at_once = CrushedField::new(&crushed, frame, 3);
        at_once.follow(timeline.strikes(), timeline.strikes());
        at_once.draw_some(usize::MAX, None, &mut Vec::new());
        let after = shown(&at_once);
        let (mut slices, mut mixed) = (0, 0);
        loop {
            // Hits that crush nothing more there do not hold it up.
            timeline.strike(elsewhere, (Vec2::splat(9.0), NO_BRICKS), 0.0, 1.0);
            elsewhere += 1;
            let (now, is_behind) = follow(&timeline, 1);
            slices += 1;
            for corner in tiles_of(&TexelRect::whole(frame.size())).map(|tile| tile * TILE) {
                let is_like = |other: &Grid<Spot>| {
                    (corner.y..corner.y + TILE).all(|y| {
                        let row = |grid: &Grid<Spot>| {
                            grid.row(y as usize)[corner.x as usize..(corner.x + TILE) as usize].to_vec()
                        };
                        row(&now) == row(other)
                    })
                };
                assert!(is_like(&before) || is_like(&after), "slice {slices}: {corner} is half drawn");
                mixed += u32::from(!is_like(&after));
            }
            if !is_behind {
                assert!(now == after);
                break;
            }
        }
        assert!(slices > 30 && mixed > slices, "{slices} {mixed}");
    }

    #[test]
    fn it_is_drawn_from_the_hit_outward() {
        let frame = SurfaceFrame::new(UVec2::splat(512)).unwrap();
        let mut field = CrushedField::new(&CrushedZone { radius: 0.2, ..CrushedZone::DEFAULT }, frame, 1);
        let mut timeline = Timeline::default();
        timeline.strike(0, (Vec2::new(0.3, 0.6), NO_BRICKS), 0.0, 1.0);
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

    #[test]
    fn what_breaks_is_deep_inside_and_level_far_away() {
        let frame = SurfaceFrame::new(UVec2::splat(256)).unwrap();
        for seed in 0..20 {
            let crushed = CrushedZone { broken: true, basin: 0.6, depth: 0.02, radius: 0.1, ..CrushedZone::DEFAULT };
            let mut field = CrushedField::new(&crushed, frame, seed);
            let mut timeline = Timeline::default();
            timeline.strike(0, (Vec2::splat(0.5), NO_BRICKS), 0.0, 1.0);
            field.follow(timeline.strikes(), timeline.strikes());
            field.draw_some(usize::MAX, None, &mut Vec::new());
            let mut row = [Spot::default(); 256];
            field.read(0, 128, &mut row);
            assert!(row[128].deep > 100 && row[128].pale > 0, "seed {seed}: {:?}", row[128]);
            assert_eq!((row[0], row[255]), (Spot::default(), Spot::default()));
        }
    }
}
