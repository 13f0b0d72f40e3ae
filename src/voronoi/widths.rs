//! Widths of cracks along the boundaries: from path costs and from the strokes that they follow.

use super::{
    chains::{LineCosts, Member, chains},
    lattice::Layer,
};
use crate::{math::ops, raster::noise};
use glam::Vec2;
use std::collections::VecDeque;

/// The inputs of the width of a crack at one of its crossings.
#[derive(Clone, Copy)]
pub(super) struct Cost {
    /// Path cost, in β; reduced away from the guides.
    pub(super) cost: f32,
    /// Width of the stroke whose middle line this is, texels.
    pub(super) stroke: f32,
    /// Random factor of the width in a stroke.
    pub(super) uneven: f32,
    /// Random factor of the width that it has by its cost alone, in a stroke.
    pub(super) narrowed: f32,
    /// Factor of the width beside strokes.
    pub(super) beside: f32,
    /// How far it lies in a stroke, 0..=1.
    pub(super) inside: f32,
}

/// The properties of the guides that widths depend on.
pub(super) struct Guidance<'a> {
    /// Largest cost of an edge without guides, in β.
    pub ground: f32,
    /// The weight of the heaviest guide, in β.
    pub weight: f32,
    /// What the noise leaves of the weights, 0..=1: the mean of all guides, by their weights.
    pub left: f32,
    /// [`Layer::breadth`] of the strokes: the mean of all guides, by their weights.
    pub breadth: f32,
    /// Seed of what varies the widths away from the guides.
    pub seed: u32,
    /// The guides.
    pub layers: &'a [Layer],
}

impl Guidance<'_> {
    /// The guides' share of the cost of an edge in a stroke where the noise is middling, 0..1.
    pub(super) fn share(&self) -> f32 {
        self.left * self.weight / (self.ground + self.left * self.weight)
    }

    /// The number of texels of stroke that a path of this cost crosses. The cost on the way to the stroke counts as
    /// well, but is small if there is a site beside the stroke.
    pub(super) fn texels(&self, cost: f32) -> f32 {
        cost * self.share() / (self.ground + self.left * self.weight)
    }

    /// A value between one for narrow and one for broad strokes.
    pub(super) fn by_breadth(&self, [narrow, broad]: [f32; 2]) -> f32 {
        narrow + (broad - narrow) * self.breadth
    }

    /// How much of [`VoronoiParams::roughness`](super::VoronoiParams::roughness) lines have.
    pub(super) fn deviation(&self) -> f32 {
        1.0 + (self.by_breadth(DEVIATION) - 1.0) * self.guided()
    }

    /// How far the guides count, 0..=1.
    pub(super) fn guided(&self) -> f32 {
        (self.share() / GUIDED).min(1.0)
    }

    /// The factor of widths away from the guides at `place`, pattern units; 1 in strokes, and where there are no guides.
    pub(super) fn beside(&self, place: Vec2, inside: f32) -> f32 {
        if self.layers.is_empty() {
            return 1.0;
        }
        let [wide, small] = BESIDE_OVER.map(|over| noise(self.seed, place.x / over, place.y / over));
        let drawn = (0.8 - wide - 0.4 * small).clamp(BESIDE, 1.0);
        1.0 + (drawn - 1.0) * self.share() * (1.0 - inside.min(1.0))
    }

    /// How thin cracks in strokes are at `place`, pattern units: 0 = as wide as they can be, 1 = as thin.
    pub(super) fn thin(&self, place: Vec2) -> f32 {
        let [wide, small] = THIN_OVER.map(|over| noise(self.seed ^ THIN_SEED, place.x / over, place.y / over));
        (0.5 + 0.9 * wide + 0.4 * small).clamp(0.0, 1.0)
    }

    /// The largest value of a guide at a texel, 0..=1, weighted by the guides' weights.
    pub(super) fn at(&self, texel: usize) -> f32 {
        let value = |layer: &Layer| f32::from(layer.values.as_slice()[texel]) / 65535.0 * layer.weight_in_beta();
        self.layers.iter().map(value).fold(0.0, f32::max) / self.weight.max(1.0e-6)
    }
}

/// Largest reduction of the cost of cracks away from the guides. With 0 a crack far from all sites is as wide as
/// those that draw the picture; with 1 only the picture is visible.
pub(super) const ASIDE: f32 = 0.55;

/// Cracks along a stroke that are shorter than twice this part of half its width stay thin, in narrow strokes and in broad
/// ones. With less, cracks that enter from the side look like thorns on the letters; with more, the cross-bars of small
/// letters disappear.
const THORN: [f32; 2] = [1.15, 2.4];

/// Removes the rise of the costs where a crack enters a stroke from the side, and where one of the two cracks at the
/// end of a stroke runs into a corner of it; the other one goes on from the stroke. Cracks along the middle of a stroke
/// keep their costs.
///
/// This is the opening of mathematical morphology along chains of lines: peaks shorter than the width of the stroke are
/// removed.
pub(super) fn without_thorns(lines: &mut [LineCosts], vertices: &[Vec2], guides: &Guidance<'_>) {
    // At each vertex the reach that befits the most expensive line.
    let mut reach = vec![0.0f32; vertices.len()];
    for line in &*lines {
        let most = line.costs.iter().copied().fold(0.0, f32::max);
        let own = guides.by_breadth(THORN) * guides.texels(most);
        line.ends.iter().for_each(|&end| reach[end] = reach[end].max(own));
    }
    if reach.iter().all(|reach| *reach < 1.0) {
        return;
    }
    let of = |line: &LineCosts| line.ends.iter().map(|&end| reach[end]).fold(0.0, f32::max);
    for chain in chains(lines, vertices, &reach) {
        // Where strokes of other widths begin, another part of the chain begins.
        let alike = |a: &Member, b: &Member| {
            let (a, b) = (of(&lines[a.0]), of(&lines[b.0]));
            a.max(b) <= 2.0 * a.min(b)
        };
        let parts: Vec<&[Member]> = chain.chunk_by(alike).collect();
        for part in parts {
            let reach = part.iter().map(|&(i, _)| of(&lines[i])).fold(0.0, f32::max);
            open(lines, part, reach);
        }
    }
}

/// Opens the costs along lines that follow one another.
fn open(lines: &mut [LineCosts], part: &[Member], reach: f32) {
    let (mut places, mut costs) = (Vec::new(), Vec::new());
    for &(i, reversed) in part {
        let line = &lines[i];
        if reversed {
            places.extend(line.places.iter().rev());
            costs.extend(line.costs.iter().rev());
        } else {
            places.extend(&line.places);
            costs.extend(&line.costs);
        }
    }
    let far = distances(&places);
    let negative = |costs: Vec<f32>| costs.into_iter().map(|cost| -cost).collect::<Vec<f32>>();
    let opened = negative(least_within(&far, &negative(least_within(&far, &costs, reach)), reach));
    let mut rest = &opened[..];
    for &(i, reversed) in part {
        let costs = &mut lines[i].costs;
        let (own, others) = rest.split_at(costs.len());
        costs.copy_from_slice(own);
        if reversed {
            costs.reverse();
        }
        rest = others;
    }
}

/// The distance of each place along their line.
fn distances(places: &[Vec2]) -> Vec<f32> {
    let mut far = 0.0;
    let mut before = places.first().copied().unwrap_or_default();
    let next = |place: &Vec2| {
        far += before.distance(*place);
        before = *place;
        far
    };
    places.iter().map(next).collect()
}

/// The minimum of all values within `reach` of each; `far` is where they are, ascending.
fn least_within(far: &[f32], values: &[f32], reach: f32) -> Vec<f32> {
    // Values that no later one is below, in order.
    let mut ahead = VecDeque::new();
    let mut next = 0;
    let least = |i: usize| {
        while next < values.len() && far[next] <= far[i] + reach {
            while ahead.back().is_some_and(|&last: &usize| values[last] >= values[next]) {
                ahead.pop_back();
            }
            ahead.push_back(next);
            next += 1;
        }
        while ahead.front().is_some_and(|&first| far[first] < far[i] - reach) {
            ahead.pop_front();
        }
        ahead.front().map_or(values[i], |&first| values[first])
    };
    (0..values.len()).map(least).collect()
}

/// How much thinner cracks in strokes are in places, as a share of the width that they have by the stroke, in narrow strokes and in broad ones.
/// With 0 they look cut, in narrow strokes with 0.2 some small letters are unreadable.
pub(super) const UNEVEN: [f32; 2] = [0.0, 0.6];

/// The same for the width that they have by their cost; below 0 as at 0.
pub(super) const NARROWED: [f32; 2] = [-0.6, 0.5];

/// Over which distances cracks in strokes become thinner and wider, pattern units, and the seed of it.
const THIN_OVER: [f32; 2] = [0.14, 0.045];
const THIN_SEED: u32 = 0x51A7_0E4D;

/// Smallest factor of the widths of cracks beside strokes, and over which distances it varies, pattern units.
const BESIDE: f32 = 0.12;
const BESIDE_OVER: [f32; 2] = [0.33, 0.1];

/// Largest width of a crack in a stroke, relative to full width. With 1 short words with large letters are less
/// readable; without a limit the middles of broad areas are too wide.
const MOST: f32 = 2.6;

/// Path cost to width (Mould 2005, section 3.2: "the further the site, the wider").
pub(super) struct Widths {
    pub(super) least: f32,
    pub(super) gain: f32,
    pub(super) taper: f32,
    /// Full cost, in β.
    pub(super) full: f32,
    /// Pattern units for each texel of a stroke's width.
    pub(super) of_stroke: f32,
}

impl Widths {
    pub(super) fn of(&self, Cost { cost, stroke, uneven, narrowed, beside, .. }: Cost) -> f32 {
        let width = beside * self.least + self.gain * ops::powf((cost * beside / self.full).min(1.0), self.taper);
        let width = width * narrowed;
        width.max((self.of_stroke * stroke).min(MOST * (self.least + self.gain)) * uneven)
    }
}

/// A line with its widths.
pub(super) struct Way {
    pub(super) ends: [usize; 2],
    /// Positions, texels.
    pub(super) places: Vec<Vec2>,
    /// Widths, pattern units.
    pub(super) widths: Vec<f32>,
    /// How far the places lie in strokes, 0..=1.
    pub(super) inside: Vec<f32>,
}

impl Way {
    /// The places from one end (0 or 1) on: their indices, and how far they are along it, texels.
    pub(super) fn along(&self, end: usize) -> Vec<(usize, f32)> {
        let n = self.places.len();
        let at = |k: usize| if end == 0 { k } else { n - 1 - k };
        let mut far = 0.0;
        let step = |k: usize| {
            if k > 0 {
                far += self.places[at(k)].distance(self.places[at(k - 1)]);
            }
            (at(k), far)
        };
        (0..n).map(step).collect()
    }

    /// Limits the widening to `slope` per texel. Returns whether it has become thinner anywhere.
    fn run_out(&mut self, slope: f32) -> bool {
        let n = self.widths.len();
        let mut is_thinner = false;
        let mut pass = |from: usize, to: usize, places: &[Vec2]| {
            let most = self.widths[from] + slope * places[from].distance(places[to]);
            if self.widths[to] > most {
                self.widths[to] = most;
                is_thinner = true;
            }
        };
        (1..n).for_each(|i| pass(i - 1, i, &self.places));
        (1..n).rev().for_each(|i| pass(i, i - 1, &self.places));
        is_thinner
    }
}

/// Largest widening of a crack per texel, where there are guides: strokes end in points that continue as thin cracks.
/// With more they look cut, with less short strokes disappear.
pub(super) const RUN_OUT: f32 = 0.26;

/// The share of the guides from which on they count wholly.
const GUIDED: f32 = 0.6;

/// How much of the roughness lines have where strokes are narrow and where they are broad.
const DEVIATION: [f32; 2] = [0.1, 1.0];

/// How much of [`VoronoiParams::stroke_width`](super::VoronoiParams::stroke_width) cracks have in narrow strokes and in broad ones, where they are
/// widest.
pub(super) const FILLED: [f32; 2] = [1.0, 0.95];

/// Tapers wide cracks where they do not continue: none is wider at a vertex than the second widest there, and none
/// widens by more than `slope` per texel.
pub(super) fn run_out(ways: &mut [Way], on_border: &[bool], slope: f32) {
    let mut widest = vec![[0.0f32; 2]; on_border.len()];
    // The taper propagates along a stroke from vertex to vertex; there are few in each.
    for _ in 0..16 {
        widest.fill([0.0; 2]);
        for way in &*ways {
            for (end, width) in way.ends.iter().zip([way.widths.first(), way.widths.last()]) {
                let widest = &mut widest[*end];
                let width = width.copied().unwrap_or(0.0);
                let at = widest.iter().position(|other| width > *other);
                if let Some(at) = at {
                    widest[at..].rotate_right(1);
                    widest[at] = width;
                }
            }
        }
        let mut is_thinner = false;
        for way in &mut *ways {
            for (end, at) in way.ends.into_iter().zip([0, way.widths.len().saturating_sub(1)]) {
                let [_, second] = widest[end];
                if let Some(width) = way.widths.get_mut(at)
                    && !on_border[end]
                    && *width > second
                {
                    (*width, is_thinner) = (second, true);
                }
            }
            is_thinner |= way.run_out(slope);
        }
        if !is_thinner {
            break;
        }
    }
}

/// The share of crossings that cost less than full width.
const USUAL: f32 = 0.97;

/// Cost of the most expensive crossings.
pub(super) fn dearest(costs: &[Vec<Cost>]) -> f32 {
    let mut all: Vec<f32> = costs.iter().flatten().map(|cost| cost.cost).collect();
    let n = ((all.len() as f32 * USUAL) as usize).min(all.len().saturating_sub(1));
    if all.is_empty() { 1.0 } else { all.select_nth_unstable_by(n, f32::total_cmp).1.max(1.0e-3) }
}

/// Smooths the differences of costs between neighbouring texels.
pub(super) fn smooth(costs: &mut [f32]) {
    for _ in 0..4 {
        let mut before = costs.first().copied().unwrap_or_default();
        for i in 1..costs.len().saturating_sub(1) {
            let here = costs[i];
            costs[i] = 0.25 * before + 0.5 * here + 0.25 * costs[i + 1];
            before = here;
        }
    }
}
