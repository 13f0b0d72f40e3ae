//! Widths of cracks along the boundaries: from path costs and from the strokes that they follow.

use super::lattice::Layer;
use crate::math::ops;
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
}

/// The properties of the guides that widths depend on.
pub(super) struct Guidance<'a> {
    /// Largest cost of an edge without guides, in β.
    pub ground: f32,
    /// The weight of the heaviest guide, in β.
    pub weight: f32,
    /// The guides.
    pub layers: &'a [Layer],
    /// The noise.
    pub noise: &'a Layer,
}

impl Guidance<'_> {
    /// The guides' share of the cost of the most expensive edge, 0..1.
    pub(super) fn share(&self) -> f32 {
        self.weight / (self.ground + self.weight)
    }

    /// The number of texels of stroke that a path of this cost crosses. The cost on the way to the stroke counts as
    /// well, but is small if there is a site beside the stroke.
    pub(super) fn texels(&self, cost: f32) -> f32 {
        cost * self.share() / (self.ground + self.weight)
    }

    /// The noise at a texel, 0..=1.
    pub(super) fn noise_at(&self, texel: usize) -> f32 {
        f32::from(self.noise.values.as_slice()[texel]) / 65535.0
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

/// Cracks along a stroke that are shorter than twice this part of half its width stay thin. With 1 cracks that enter
/// from the side look like thorns on the letters; with 2 the cross-bars of small letters disappear.
const THORN: f32 = 1.6;

/// Removes the rise of the costs where a crack enters a stroke from the side, and where it runs into the corners at
/// the end of a stroke. Cracks along the middle of a stroke keep their costs.
///
/// This is the opening of mathematical morphology: peaks shorter than the width of the stroke are removed.
pub(super) fn without_thorns(costs: &[f32], guides: &Guidance<'_>) -> Vec<f32> {
    let most = costs.iter().copied().fold(0.0, f32::max);
    let reach = (THORN * guides.texels(most)) as usize;
    let negative = |costs: Vec<f32>| costs.into_iter().map(|cost| -cost).collect::<Vec<f32>>();
    negative(least_within(&negative(least_within(costs, reach)), reach))
}

/// The minimum within `reach` of each value.
fn least_within(values: &[f32], reach: usize) -> Vec<f32> {
    // Values that no later one is below, in order.
    let mut ahead = VecDeque::new();
    let mut next = 0;
    let least = |i: usize| {
        while next < values.len().min(i + reach + 1) {
            while ahead.back().is_some_and(|&last: &usize| values[last] >= values[next]) {
                ahead.pop_back();
            }
            ahead.push_back(next);
            next += 1;
        }
        while ahead.front().is_some_and(|&first| first + reach < i) {
            ahead.pop_front();
        }
        ahead.front().map_or(0.0, |&first| values[first])
    };
    (0..values.len()).map(least).collect()
}

/// How much the noise varies the width of cracks in strokes, as a share of their width. With 0 they look cut, with
/// 0.7 small letters are unreadable.
pub(super) const UNEVEN: f32 = 0.3;

/// Largest width of a crack in a stroke, relative to full width. With 1 short words with large letters are less
/// readable; without a limit the middles of broad areas are too wide.
const MOST: f32 = 2.0;

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
    pub(super) fn of(&self, Cost { cost, stroke, uneven }: Cost) -> f32 {
        let width = self.least + self.gain * ops::powf((cost / self.full).min(1.0), self.taper);
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
}

impl Way {
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
pub(super) const RUN_OUT: f32 = 0.22;

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
