//! The strokes of the guides, and sites on both sides of them.

use super::{
    MapCharts,
    charts::MapGround,
    lattice::{Lattice, Layer},
    level::Level,
    sites::even,
};
use crate::{Grid, math::Rng, raster::noise};
use glam::{IVec2, UVec2, Vec2};

/// Strokes are analysed on a lattice of at most this many texels, with a shorter side of at most [`SHORT_SIDE`].
const MOST_TEXELS: f32 = 640_000.0;
const SHORT_SIDE: f32 = 400.0;

/// From this value on a guide counts as stroke.
pub(super) const INK: u16 = 1 << 15;

/// Guides whose strokes cover more than this share of the surface do not count as drawings.
const MOST_INK: f32 = 0.7;

/// Share of the sites that is laid on both sides of strokes at first, and largest share after all gaps have been closed.
const AT_ONCE: f32 = 0.2;
const IN_ALL: f32 = 0.85;

/// Distance of a site from its stroke, texels.
const GAP: f32 = 2.5;

/// How much the distance of sites beside the strokes varies, as a share, and over which distance, pattern units.
const UNEVEN: f32 = 0.35;
const PATCH: f32 = 0.3;

/// Rounds of closing gaps.
const ROUNDS: usize = 10;

/// How well cracks cover the strokes of the guides.
///
/// ```
/// use bevy_crack::{Grid, voronoi::{Guide, SiteLayout, StrokeReport, VoronoiBake, VoronoiParams}};
///
/// // A stroke from top to bottom, with sites on both of its sides.
/// let mut line = Grid::new([64, 64].into(), 0.0);
/// (0..64).for_each(|y| line.row_mut(y)[30..34].fill(1.0));
/// let params = VoronoiParams { layout: SiteLayout::StrokePairs, ..VoronoiParams::DEFAULT };
/// let map = VoronoiBake::new(params, vec![Guide::new(line)], [128, 128].into(), 1)?.finish().0;
/// let StrokeReport { length, covered } = map.strokes().expect("there is a stroke");
/// assert!((length - 1.0).abs() < 0.1 && covered > 0.95);
/// # Ok::<(), bevy_crack::voronoi::VoronoiError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeReport {
    /// Length of the middle lines of all strokes, pattern units.
    pub length: f32,
    /// The share of it that has a crack within the stroke, 0..=1.
    pub covered: f32,
}

/// Lays sites on both sides of the strokes, round by round.
pub(super) struct StrokePairs {
    size: UVec2,
    scale: f32,
    /// The surface with as few texels.
    charts: Option<MapCharts>,
    ink: Vec<bool>,
    /// Distance to the nearest texel without ink; for texels without ink to the nearest one with ink; texels.
    inside: Vec<f32>,
    outside: Vec<f32>,
    middle: Vec<u32>,
    lattice: Lattice,
    level: Level,
    sites: Vec<UVec2>,
    most: usize,
    budget: usize,
    round: usize,
    covered: f32,
}

const AROUND: [IVec2; 8] = [
    IVec2::new(0, -1),
    IVec2::new(1, -1),
    IVec2::new(1, 0),
    IVec2::new(1, 1),
    IVec2::new(0, 1),
    IVec2::new(-1, 1),
    IVec2::new(-1, 0),
    IVec2::new(-1, -1),
];

impl StrokePairs {
    /// Prepares `n` sites; `None` where the guides have no strokes.
    ///
    /// `layers` are noise and guides of the surface, of its own size.
    pub(super) fn new(MapGround { frame, charts }: MapGround<'_>, layers: &[Layer], n: usize) -> Option<Self> {
        let full = frame.size().as_vec2();
        let shrink = (full.min_element() / SHORT_SIDE).max((full.x * full.y / MOST_TEXELS).sqrt()).max(1.0);
        let size = (full / shrink).ceil().max(Vec2::ONE).as_uvec2();
        let pooled: Vec<Layer> = (layers.iter().enumerate())
            .map(|(i, layer)| shrunk(layer, size, if i == 0 { |_, next| next } else { u16::max }))
            .collect();
        let charts = charts.map(|charts| charts.shrunk(size));
        let is_surface: Vec<bool> = (0..size.x * size.y)
            .map(|i| charts.as_ref().is_none_or(|charts| charts.is_inside(UVec2::new(i % size.x, i / size.x))))
            .collect();
        let ink: Vec<bool> = (is_surface.iter().enumerate())
            .map(|(i, is_surface)| *is_surface && pooled[1..].iter().any(|layer| layer.values.as_slice()[i] >= INK))
            .collect();
        let surface = is_surface.iter().filter(|is_surface| **is_surface).count();
        let amount = ink.iter().filter(|&&ink| ink).count() as f32 / surface.max(1) as f32;
        if amount == 0.0 || amount > MOST_INK || n < 4 {
            return None;
        }
        let mut lattice = Lattice::new(size);
        for y in 0..size.y as usize {
            lattice.set_row(y, &pooled);
            if let Some(charts) = &charts {
                charts.wall_row(&mut lattice, y);
            }
        }
        let level = Level::new(size, &[], n, charts.is_some());
        if let Some(charts) = &charts {
            lattice.set_links(charts.links(), &pooled);
        }
        let not_ink: Vec<bool> = ink.iter().map(|ink| !ink).collect();
        Some(Self {
            size,
            scale: size.x as f32 / frame.extent().x,
            inside: distance(&not_ink, size),
            outside: distance(&ink, size),
            middle: thin(&ink, size),
            ink,
            lattice,
            level,
            charts,
            sites: Vec::new(),
            most: n,
            budget: (n as f32 * AT_ONCE) as usize,
            round: 0,
            covered: 0.0,
        })
    }

    /// Does one round; returns whether there is another.
    pub(super) fn advance(&mut self) -> bool {
        let before = self.sites.len();
        if self.round == 0 {
            self.lay_evenly();
        } else {
            self.budget = (self.most as f32 * IN_ALL) as usize;
            self.close_gaps();
        }
        self.round += 1;
        let added = self.sites[before..].to_vec();
        self.level.add_sites(&added);
        while self.level.advance(&self.lattice, &self.sites, usize::MAX) {}
        let gaps = self.gaps();
        self.covered = 1.0 - gaps.len() as f32 / self.middle.len().max(1) as f32;
        !gaps.is_empty() && !added.is_empty() && self.round < ROUNDS && self.sites.len() < self.budget.max(2)
            || self.round == 1 && !gaps.is_empty()
    }

    /// All sites, pattern units: first those beside strokes in pairs, then the remaining ones evenly beside the strokes.
    pub(super) fn finish(self, ground: MapGround<'_>, rng: &mut Rng) -> Vec<Vec2> {
        let points = self.sites.iter().map(|site| (site.as_vec2() + 0.5) / self.scale).collect();
        let beside = |point: Vec2| {
            let at = (point * self.scale).max(Vec2::ZERO).as_uvec2().min(self.size - 1);
            self.outside[self.index(at)] > GAP + 2.0 && ground.has_room(point)
        };
        let seed = rng.next_u32();
        let spread = |point: Vec2| 1.0 + UNEVEN * noise(seed, point.x / PATCH, point.y / PATCH);
        even(self.most, points, ground.frame.extent(), rng, beside, spread)
    }

    const fn index(&self, at: UVec2) -> usize {
        at.y as usize * self.size.x as usize + at.x as usize
    }

    const fn texel(&self, i: u32) -> UVec2 {
        UVec2::new(i % self.size.x, i / self.size.x)
    }

    /// Whether there is ink; `None` beside the surface.
    fn has_ink(&self, at: IVec2) -> Option<bool> {
        let inside = at.min_element() >= 0 && at.cmplt(self.size.as_ivec2()).all();
        let inside = inside && self.charts.as_ref().is_none_or(|charts| charts.is_inside(at.as_uvec2()));
        inside.then(|| self.ink[self.index(at.as_uvec2())])
    }

    /// Texels of the middle lines beside `i`.
    fn links(&self, is_middle: &[bool], i: u32) -> impl Iterator<Item = u32> {
        let at = self.texel(i).as_ivec2();
        AROUND.into_iter().filter_map(move |step| {
            let next = at + step;
            (self.has_ink(next)? && is_middle[self.index(next.as_uvec2())]).then(|| self.index(next.as_uvec2()) as u32)
        })
    }

    /// Pairs at the ends of the middle lines and then at even distances along them.
    fn lay_evenly(&mut self) {
        let mut is_middle = vec![false; self.ink.len()];
        self.middle.iter().for_each(|&i| is_middle[i as usize] = true);
        let ends: Vec<u32> = self.middle.iter().copied().filter(|&i| self.links(&is_middle, i).count() == 1).collect();
        let spacing = (2.0 * self.middle.len() as f32 / self.budget.max(2) as f32).max(4.0);
        let mut taken: Vec<Vec2> = Vec::new();
        let order = ends.into_iter().chain(self.middle.clone());
        for i in order {
            let at = self.texel(i).as_vec2();
            // Where three lines meet no direction is across.
            let crowded = self.links(&is_middle, i).count() > 2;
            if crowded || taken.iter().any(|other| other.distance_squared(at) < spacing * spacing) {
                continue;
            }
            if self.sites.len() + 2 > self.budget {
                break;
            }
            taken.push(at);
            self.lay_pair(&is_middle, i, 0.5 * spacing);
        }
    }

    /// The texels of the middle lines that have no crack within their stroke.
    fn gaps(&self) -> Vec<u32> {
        let w = self.size.x as usize;
        let (size, boundary) =
            (self.size.as_ivec2(), |i: usize, j: usize| self.level.region(i) != self.level.region(j));
        let covered = |i: u32| {
            let at = self.texel(i).as_ivec2();
            let reach = self.inside[i as usize].max(1.5);
            let span = reach as i32;
            (-span..=span).any(|dy| {
                (-span..=span).any(|dx| {
                    let next = at + IVec2::new(dx, dy);
                    let near = (dx * dx + dy * dy) as f32 <= reach * reach;
                    if !near || next.min_element() < 0 || next.x + 1 >= size.x || next.y + 1 >= size.y {
                        return false;
                    }
                    let j = next.y as usize * w + next.x as usize;
                    self.ink[j] && (boundary(j, j + 1) || boundary(j, j + w))
                })
            })
        };
        self.middle.iter().copied().filter(|&i| !covered(i)).collect()
    }

    /// Lays a pair in the middle of every run without a crack.
    fn close_gaps(&mut self) {
        let gaps = self.gaps();
        let mut is_gap = vec![false; self.ink.len()];
        gaps.iter().for_each(|&i| is_gap[i as usize] = true);
        let mut is_middle = vec![false; self.ink.len()];
        self.middle.iter().for_each(|&i| is_middle[i as usize] = true);
        for start in gaps {
            if !is_gap[start as usize] {
                continue;
            }
            // The run, and the texel in the middle of the list: a flood fill from one end lists it from end to end.
            let (mut run, mut next) = (vec![start], 0);
            is_gap[start as usize] = false;
            while next < run.len() {
                let here = run[next];
                next += 1;
                let links: Vec<u32> = self.links(&is_gap, here).collect();
                for link in links {
                    is_gap[link as usize] = false;
                    run.push(link);
                }
            }
            if self.sites.len() + 2 <= self.budget {
                self.lay_pair(&is_middle, run[run.len() / 2], 2.0);
            }
        }
    }

    /// Lays sites on both sides of a stroke, except where another site is visible and within `merge`.
    fn lay_pair(&mut self, is_middle: &[bool], i: u32, merge: f32) {
        let at = self.texel(i);
        let along = self.direction(is_middle, i);
        for across in [along.perp(), -along.perp()] {
            let Some(site) = self.beside(at.as_vec2() + 0.5, across) else { continue };
            let near = |other: &UVec2| {
                let (a, b) = (other.as_vec2(), site.as_vec2());
                a.distance_squared(b) <= merge * merge && self.in_sight(a, b)
            };
            if !self.sites.iter().any(near) {
                self.sites.push(site);
            }
        }
    }

    /// Direction of the middle line at one of its texels: the longest axis of its texels nearby.
    fn direction(&self, is_middle: &[bool], i: u32) -> Vec2 {
        let reach = self.inside[i as usize].clamp(4.0, 12.0);
        let centre = self.texel(i).as_vec2();
        let (mut run, mut next) = (vec![i], 0);
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        while next < run.len() {
            let off = self.texel(run[next]).as_vec2() - centre;
            xx += off.x * off.x;
            xy += off.x * off.y;
            yy += off.y * off.y;
            let links = self.links(is_middle, run[next]);
            let near = links.filter(|&link| self.texel(link).as_vec2().distance_squared(centre) <= reach * reach);
            let new: Vec<u32> = near.filter(|link| !run.contains(link)).collect();
            run.extend(new);
            next += 1;
        }
        // Eigenvector of the larger eigenvalue of a symmetric 2 x 2 matrix.
        let half = 0.5 * (xx - yy);
        let root = (half * half + xy * xy).sqrt();
        let axis = if half >= 0.0 { Vec2::new(half + root, xy) } else { Vec2::new(xy, root - half) };
        axis.normalize_or(Vec2::X)
    }

    /// The place of a site beside the stroke at `from`, in direction `across`.
    fn beside(&self, from: Vec2, across: Vec2) -> Option<UVec2> {
        let at = |steps: f32| (from + across * steps).floor().as_ivec2();
        let step = 0.5;
        let mut out = 0.0;
        while self.has_ink(at(out))? {
            out += step;
        }
        let mut free = 0.0;
        while free < 2.0 * GAP && self.has_ink(at(out + free)) == Some(false) {
            free += step;
        }
        let place = at(out + (0.5 * free).min(GAP));
        (!self.has_ink(place)?).then(|| place.as_uvec2())
    }

    /// Whether no stroke lies between two texels.
    fn in_sight(&self, a: Vec2, b: Vec2) -> bool {
        let n = (2.0 * a.distance(b)).ceil().max(1.0);
        (0..=n as u32).all(|k| {
            let at = a.lerp(b, k as f32 / n) + 0.5;
            self.has_ink(at.as_ivec2()) == Some(false)
        })
    }

    /// How far it is, 0..=1.
    pub(super) fn progress(&self) -> f32 {
        self.round as f32 / ROUNDS as f32
    }

    pub(super) fn report(&self) -> StrokeReport {
        StrokeReport { length: self.middle.len() as f32 / self.scale, covered: self.covered }
    }
}

/// A layer at a lower resolution. `pool` has the value so far and the next one of a block: the noise is sampled, as its largest values would not
/// be like it, and strokes keep their largest values.
fn shrunk(layer: &Layer, size: UVec2, pool: fn(u16, u16) -> u16) -> Layer {
    let from = layer.values.size();
    let mut values = Grid::new(size, 0u16);
    for y in 0..from.y as usize {
        let to = (y as u64 * u64::from(size.y) / u64::from(from.y)) as usize;
        let row = values.row_mut(to);
        for (x, &value) in (0u64..).zip(layer.values.row(y)) {
            let to = &mut row[(x * u64::from(size.x) / u64::from(from.x)) as usize];
            *to = pool(*to, value);
        }
    }
    Layer { values, ..*layer }
}

/// Distance of each texel to the nearest one that `is_goal`, within 8 % (two passes over a mask of 5 and 7 fifths).
fn distance(is_goal: &[bool], size: UVec2) -> Vec<f32> {
    let (w, h) = (size.x as usize, size.y as usize);
    let mut far: Vec<u32> = is_goal.iter().map(|&goal| if goal { 0 } else { 1 << 20 }).collect();
    let relax = |far: &mut [u32], i: usize, from: usize, by: u32| far[i] = far[i].min(far[from] + by);
    for y in 0..h {
        for x in 0..w {
            let i = y * w + x;
            if x > 0 {
                relax(&mut far, i, i - 1, 5);
            }
            if y > 0 {
                relax(&mut far, i, i - w, 5);
                if x > 0 {
                    relax(&mut far, i, i - w - 1, 7);
                }
                if x + 1 < w {
                    relax(&mut far, i, i - w + 1, 7);
                }
            }
        }
    }
    for y in (0..h).rev() {
        for x in (0..w).rev() {
            let i = y * w + x;
            if x + 1 < w {
                relax(&mut far, i, i + 1, 5);
            }
            if y + 1 < h {
                relax(&mut far, i, i + w, 5);
                if x + 1 < w {
                    relax(&mut far, i, i + w + 1, 7);
                }
                if x > 0 {
                    relax(&mut far, i, i + w - 1, 7);
                }
            }
        }
    }
    far.into_iter().map(|far| far as f32 / 5.0).collect()
}

/// The middle lines of strokes, one texel wide (Zhang and Suen 1984), in scan order of the rows.
fn thin(ink: &[bool], size: UVec2) -> Vec<u32> {
    // With a border, so that every texel has eight neighbours.
    let w = size.x as usize + 2;
    let mut ink_left = vec![false; w * (size.y as usize + 2)];
    for (i, _) in ink.iter().enumerate().filter(|(_, ink)| **ink) {
        ink_left[(i / size.x as usize + 1) * w + i % size.x as usize + 1] = true;
    }
    let mut texels: Vec<usize> = (0..ink_left.len()).filter(|&i| ink_left[i]).collect();
    let around = [w.wrapping_neg(), 1usize.wrapping_sub(w), 1, w + 1, w, w - 1, usize::MAX, w.wrapping_neg() - 1];
    loop {
        let before = texels.len();
        for first in [true, false] {
            let goes = |&i: &usize| {
                let near = around.map(|step| ink_left[i.wrapping_add(step)]);
                let n = near.iter().filter(|&&near| near).count();
                let turns = (0..8).filter(|&k| !near[k] && near[(k + 1) % 8]).count();
                let [north, _, east, _, south, _, west, _] = near;
                let open =
                    if first { !(east && south && (north || west)) } else { !(north && west && (east || south)) };
                (2..=6).contains(&n) && turns == 1 && open
            };
            let gone: Vec<usize> = texels.iter().copied().filter(goes).collect();
            gone.iter().for_each(|&i| ink_left[i] = false);
            texels.retain(|&i| ink_left[i]);
        }
        if texels.len() == before {
            break;
        }
    }
    texels.into_iter().map(|i| ((i / w - 1) * size.x as usize + i % w - 1) as u32).collect()
}
