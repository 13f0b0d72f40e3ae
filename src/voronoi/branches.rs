//! Branches of broad strokes: some of the thin cracks that leave them are wider there, the others fade.

use super::widths::{Guidance, Way};
use crate::math::hash_unit;
use glam::Vec2;
use std::collections::BTreeMap;

/// Share of the cracks that leave broad strokes as branches; below 0 there are none, because small letters would be unreadable.
const BRANCHES: [f32; 2] = [-0.25, 0.45];

/// Range of their widths where they leave it, relative to that of the stroke.
const BRANCH_WIDTH: [f32; 2] = [0.22, 0.5];

/// Cracks that are wider than this where they leave a stroke, and at this distance from its middle, are parts of it. Both in shares of its width.
const THIN: f32 = 0.3;
const BEYOND: f32 = 2.0;

/// Range of the distances over which they become as thin as other cracks, pattern units. If they are short, they look like thorns.
const BRANCH_LENGTH: [f32; 2] = [0.1, 0.36];

/// Over this distance from a stroke the other cracks that leave it are thinner, and by which factor where they leave it: they would look like the legs
/// of an insect. Pattern units.
const APART: f32 = 0.07;
const APART_WIDTH: f32 = 0.1;

/// How far this holds where strokes are narrow and where they are broad; below 0 as at 0.
const BROAD: [f32; 2] = [-0.25, 1.0];

/// How straight a branch must go on at a vertex, as the cosine of the turn, and over how many vertices it goes at most.
const STRAIGHT: f32 = 0.3;
const MOST_VERTICES: usize = 8;

/// Ways and their ends, as those who run along them meet them.
struct Branching<'a> {
    ways: &'a [Way],
    texels_per_unit: f32,
    /// The ends at each vertex: number of the way and which end.
    ends: Vec<Vec<(usize, usize)>>,
    /// The two widest ways in strokes at each vertex: their widths there, and their means. Where a stroke runs out, the second mean is small.
    widest: [Vec<[f32; 2]>; 2],
}

impl<'a> Branching<'a> {
    fn new(ways: &'a [Way], vertices: usize, texels_per_unit: f32) -> Self {
        let mut ends = vec![Vec::new(); vertices];
        let mut widest = [vec![[0.0f32; 2]; vertices], vec![[0.0f32; 2]; vertices]];
        for (i, way) in ways.iter().enumerate() {
            let mean = way.widths.iter().sum::<f32>() / way.widths.len().max(1) as f32;
            for (side, &end) in way.ends.iter().enumerate() {
                ends[end].push((i, side));
                let at = |of: &[f32]| if side == 0 { of.first() } else { of.last() }.copied().unwrap_or(0.0);
                let inside = at(&way.inside);
                for (widest, width) in widest.iter_mut().zip([inside * at(&way.widths), inside * mean]) {
                    let [first, second] = widest[end];
                    widest[end] = [first.max(width), second.max(width.min(first))];
                }
            }
        }
        Self { ways, texels_per_unit, ends, widest }
    }

    /// Width of the stroke that goes on through a vertex.
    fn wide(&self, vertex: usize) -> f32 {
        let [there, mean] = &self.widest;
        there[vertex][1].min(mean[vertex][1])
    }

    /// The direction in which a way leaves an end.
    fn heading(&self, (way, side): (usize, usize)) -> Vec2 {
        let places = &self.ways[way].places;
        let far = (places.len() / 2).min(8);
        let [from, to] = if side == 0 { [0, far] } else { [places.len() - 1, places.len() - 1 - far] };
        (places[to] - places[from]).normalize_or_zero()
    }

    /// How thin a way is at an end, in shares of the width `wide` of the stroke there: what leaves a stroke sideways is wide only within it.
    fn thin(&self, (way, side): (usize, usize), wide: f32) -> f32 {
        let way = &self.ways[way];
        let beyond = BEYOND * wide * self.texels_per_unit;
        let along = way.along(side);
        let out = along.iter().find(|(_, far)| *far >= beyond).or(along.last());
        let own = along.first().into_iter().chain(out).map(|&(k, _)| way.widths[k]).fold(f32::INFINITY, f32::min);
        if own.is_finite() { own / wide } else { 1.0 }
    }

    /// The ends at which a crack of `most` texels from `start` on enters the ways that it runs along, and their whole length.
    fn run(&self, start: (usize, usize), wide: f32, most: f32) -> (Vec<(usize, usize)>, f32) {
        let (mut along, mut length) = (vec![start], 0.0);
        while let Some(&(way, side)) = along.last() {
            length += self.ways[way].along(side).last().map_or(0.0, |last| last.1);
            let out = (way, 1 - side);
            let heading = -self.heading(out);
            let vertex = self.ways[way].ends[1 - side];
            let straight = |end: &(usize, usize)| self.heading(*end).dot(heading);
            let others = self.ends[vertex].iter().filter(|end| **end != out && self.thin(**end, wide) < THIN);
            let next = others.copied().max_by(|a, b| straight(a).total_cmp(&straight(b)));
            // Not on beyond another stroke, nor in a circle.
            let goes_on = |next: &(usize, usize)| {
                straight(next) > STRAIGHT
                    && self.wide(vertex) < THIN * wide
                    && along.iter().all(|(way, _)| *way != next.0)
            };
            match next.filter(|next| length < most && along.len() < MOST_VERTICES && goes_on(next)) {
                Some(next) => along.push(next),
                None => break,
            }
        }
        (along, length)
    }
}

/// A crack that leaves a stroke and may be widened.
struct Branch {
    /// The earlier, the smaller.
    rank: f32,
    /// The regions beside its first way.
    regions: [u32; 2],
    along: Vec<(usize, usize)>,
    /// Its width where it leaves the stroke, pattern units, and its length, texels.
    start: f32,
    over: f32,
    /// How far it has grown, 0..=1.
    grown: f32,
}

/// Widens some of the thin cracks that leave strokes, towards these, and makes the others thinner there: at most one is wider beside each region. Which
/// they are, and how wide and long, depends on the regions that they part, so that they mostly stay the same while weights change; they widen with the
/// weights of the guides. `regions` are those on the left and on the right of each way.
pub(super) fn branch(
    ways: &mut [Way],
    regions: &[[u32; 2]],
    on_border: &[bool],
    texels_per_unit: f32,
    guides: &Guidance<'_>,
) {
    let share = guides.by_breadth(BRANCHES);
    let apart = guides.by_breadth(BROAD).max(0.0) * guides.guided();
    let least = BRANCH_LENGTH[0] * texels_per_unit;
    let degree = |value: f32, none: f32, all: f32| ((value - none) / (all - none)).clamp(0.0, 1.0);
    let branching = Branching::new(ways, on_border.len(), texels_per_unit);
    let (mut branches, mut leaving) = (Vec::new(), Vec::new());
    for (i, (way, &regions)) in ways.iter().zip(regions).enumerate() {
        for (side, end) in way.ends.into_iter().enumerate() {
            let [left, right] = regions;
            // The same whichever way round it was followed.
            let is_back = (left > right) != (side == 1);
            let pair = u64::from(left.min(right)) << 32 | u64::from(left.max(right));
            let seed = u64::from(guides.seed) << 8 | u64::from(is_back) << 4;
            let drawn = |of: u64| hash_unit(seed | of, pair);
            let between = |[least, most]: [f32; 2], of: u64| least + (most - least) * drawn(of);
            let wide = branching.wide(end);
            let rank = drawn(1);
            if on_border[end] || wide <= 0.0 {
                continue;
            }
            let is_thin = degree(branching.thin((i, side), wide), THIN, 0.7 * THIN);
            if is_thin == 0.0 {
                continue;
            }
            leaving.push((i, side, is_thin * apart));
            if rank >= share {
                continue;
            }
            let most = between(BRANCH_LENGTH, 0) * texels_per_unit;
            let (along, length) = branching.run((i, side), wide, most);
            let over = most.min(length);
            let grown = degree(share - rank, 0.0, 0.1) * degree(over, least, 1.2 * least) * is_thin * guides.guided();
            if grown > 0.0 {
                branches.push(Branch { rank, regions, along, start: wide * between(BRANCH_WIDTH, 2), over, grown });
            }
        }
    }
    for (way, side, share) in leaving {
        let along = ways[way].along(side);
        let over = along.last().map_or(0.0, |last| last.1).min(APART * texels_per_unit).max(1.0e-3);
        for (k, far) in along {
            let near = 1.0 - (far / over).min(1.0);
            ways[way].widths[k] *= 1.0 - (1.0 - APART_WIDTH) * share * near;
        }
    }
    branches.sort_by(|a, b| a.rank.total_cmp(&b.rank));
    // How far the branches beside each region have grown: what is left of it is for others.
    let mut taken = BTreeMap::new();
    for Branch { regions, along, start, over, grown, .. } in branches {
        let left = regions.iter().map(|region| 1.0 - taken.get(region).copied().unwrap_or(0.0)).fold(1.0, f32::min);
        let grown = grown * left;
        if grown <= 0.0 {
            continue;
        }
        regions.into_iter().for_each(|region| *taken.entry(region).or_insert(0.0f32) += grown);
        let start = start * grown;
        let mut before = 0.0;
        for (way, side) in along {
            let along = ways[way].along(side);
            for &(k, far) in &along {
                let width = start * (1.0 - (before + far) / over);
                ways[way].widths[k] = ways[way].widths[k].max(width);
            }
            before += along.last().map_or(0.0, |last| last.1);
        }
    }
}
