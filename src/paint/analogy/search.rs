//! The search for the place that fits a texel best.
//!
//! Candidates are the places that continue those of the neighbours (Ashikhmin 2001; "coherence match" in Hertzmann et
//! al. 2001, section 3.2), and a few random places of the same guide value. Barnes et al. 2009 show that so few are
//! enough: a good place that one texel has found spreads to its neighbours in the same pass.

use super::{
    atlas::{Atlas, NOWHERE, Place, RADIUS, ROW, SIDE},
    level::{Around, Level},
    params::AnalogyParams,
};
use crate::math::mix;
use glam::{IVec2, UVec2};

/// Weight of a colour at the middle of the texels that are compared. With the largest guide the weights of ramps reach
/// 127, so that products with a difference fit 16 bits.
const MIDDLE: f32 = 8.0;

/// Mean squared difference of bytes that cannot be seen, below which nothing else is searched for.
const ALIKE: u32 = 6;

/// Largest weight of a further channel.
const MOST_EXTRA: u32 = 8000;

/// Mean squared difference of bytes that one more copy of the same place counts as.
const AGAIN: u32 = 24;

/// Copies of one place beyond which more do not count.
const MOST_AGAIN: u32 = 16;

/// Difference of guides, of 255, below which the inside of a piece stays as it is.
const GUIDE_FITS: u8 = 8;

/// Room for candidates of one texel: itself, eight neighbours, random ones.
const MOST: usize = 24;

const NEIGHBOURS: [[i32; 2]; 8] = [[-1, 0], [0, -1], [1, 0], [0, 1], [-1, -1], [1, -1], [-1, 1], [1, 1]];

/// How much each byte of the texels that are compared counts.
#[derive(Clone, Debug)]
pub(super) struct Weights {
    rows: Around,
    /// Those of the guide alone.
    guide: Around,
    /// Of each further channel of the texel itself.
    extras: Vec<u32>,
    /// Cost of a difference that cannot be seen.
    alike: u32,
    /// Cost of a place that continues no neighbour, in 256ths of its difference more.
    alone: u32,
    /// Cost of each other texel that has been copied from the same place.
    again: u32,
}

impl Weights {
    pub(super) fn new(params: &AnalogyParams, given: usize) -> Self {
        let mut rows = [[0; 4 * ROW]; SIDE];
        let (mut total, mut guides) = (0, 0);
        for (y, row) in rows.iter_mut().enumerate() {
            for (x, out) in row.as_chunks_mut::<4>().0.iter_mut().enumerate().take(SIDE) {
                let (dx, dy) = (x as f32 - RADIUS as f32, y as f32 - RADIUS as f32);
                // Falls to about a third at the border, a quarter in the corners.
                let near = 1.0 / (1.0 + (dx * dx + dy * dy) / 6.0);
                let color = (MIDDLE * near).round().max(1.0);
                let guide = (3.0 * params.guide * MIDDLE * near).round();
                // The colour of the texel itself is what is searched for.
                let is_middle = x == RADIUS && y == RADIUS;
                let color = if is_middle { 0.0 } else { color };
                *out = [color as i16, color as i16, color as i16, guide as i16];
                total += 3 * color as u32;
                guides += guide as u32;
            }
        }
        // Sums over all channels rarely reach what 32 bits hold, and then all places are equally bad.
        let extra = |weight: f32| ((weight * guides as f32) as u32).min(MOST_EXTRA);
        let mut extras = vec![extra(params.extra); given];
        if params.orientation > 0.0 {
            extras.extend([extra(params.orientation); 2]);
        }
        let mut guide = rows;
        guide.iter_mut().flat_map(|row| row.as_chunks_mut::<4>().0).for_each(|weight| weight[..3].fill(0));
        Self {
            rows,
            guide,
            extras,
            alike: ALIKE * total,
            alone: (256.0 * params.coherence) as u32,
            again: (params.variety * (AGAIN * total) as f32) as u32,
        }
    }
}

/// What a pass needs to know.
pub(super) struct Search<'a> {
    pub(super) atlas: &'a Atlas,
    pub(super) weights: &'a Weights,
    /// Random places for each texel.
    pub(super) tries: u32,
    /// Different for each level and pass.
    pub(super) seed: u64,
}

/// Candidates that were compared, and the best of them.
struct Best {
    tried: [Place; MOST],
    count: usize,
    place: Place,
    cost: u32,
}

impl Best {
    /// Notes a candidate; `false` if it was there already.
    #[inline(always)]
    fn is_first(&mut self, place: Place) -> bool {
        if self.tried[..self.count].contains(&place) {
            return false;
        }
        if self.count < MOST {
            self.tried[self.count] = place;
            self.count += 1;
        }
        true
    }
}

impl Search<'_> {
    /// Finds a place for a texel that has one; all its neighbours count.
    #[inline(always)]
    pub(super) fn improve(&self, level: &mut Level, texel: UVec2) {
        let index = level.index(texel);
        let current = level.places[index];
        let (offers, count) = self.offers(level, texel, current);
        if count == 0 && level.uses.is_empty() && self.guide_fits(level, index) {
            // Inside of a piece that is copied as a whole.
            return;
        }
        let around = level.around(texel);
        let mut best = Best { tried: [NOWHERE; MOST], count: 0, place: current, cost: u32::MAX };
        self.consider(&mut best, &around, &self.weights.rows, level, index, current, 0);
        if best.cost > 0 {
            for &place in &offers[..count] {
                self.consider(&mut best, &around, &self.weights.rows, level, index, place, 0);
            }
        }
        if best.cost > self.weights.alike {
            self.guess(&mut best, &around, &self.weights.rows, level, index);
        }
        if best.place != current {
            level.put(index, best.place, self.atlas);
            level.is_new[index] = true;
        }
    }

    /// Finds a place for a texel whose neighbours may have none yet: these count by their guides alone. `first` is
    /// tried first.
    pub(super) fn begin(&self, level: &mut Level, texel: UVec2, first: Option<Place>) {
        let index = level.index(texel);
        let around = level.around(texel);
        let mut weights = self.weights.rows;
        for (y, row) in (0..).zip(&mut weights) {
            for (x, weight) in (0..).zip(row.as_chunks_mut::<4>().0) {
                let at = level.inside(texel.as_ivec2() + IVec2::new(x, y) - RADIUS as i32);
                if level.places[level.index(at)] == NOWHERE {
                    weight[..3].fill(0);
                }
            }
        }
        let first = first.or_else(|| self.atlas.alike(level.texels[index][3], mix(self.seed ^ !(index as u64)) as u32));
        let Some(first) = first else { return };
        let mut best = Best { tried: [NOWHERE; MOST], count: 0, place: first, cost: u32::MAX };
        self.consider(&mut best, &around, &weights, level, index, first, 0);
        let (offers, count) = self.offers(level, texel, first);
        for &place in &offers[..count] {
            self.consider(&mut best, &around, &weights, level, index, place, 0);
        }
        if best.cost > 0 {
            self.guess(&mut best, &around, &weights, level, index);
        }
        level.put(index, best.place, self.atlas);
        level.is_new[index] = true;
    }

    /// By how much a place should be moved so that its guide fits that of a texel best, by up to one texel each way.
    ///
    /// A place of a smaller level is known to two texels only. Colours would hold a crack that is one texel off where
    /// it is, because it agrees with itself.
    pub(super) fn alignment(&self, level: &Level, texel: UVec2, place: Place) -> IVec2 {
        let around = level.around(texel);
        let mut best = (self.difference(&around, &self.weights.guide, place, 0, u32::MAX), IVec2::ZERO);
        if best.0 == 0 {
            return IVec2::ZERO;
        }
        for by in NEIGHBOURS.map(IVec2::from) {
            if let Some(place) = self.atlas.moved(place, by) {
                let cost = self.difference(&around, &self.weights.guide, place, 0, best.0);
                if cost < best.0 {
                    best = (cost, by);
                }
            }
        }
        best.1
    }

    /// The places that continue those of the neighbours, each once, but for `current`.
    #[inline(always)]
    fn offers(&self, level: &Level, texel: UVec2, current: Place) -> ([Place; NEIGHBOURS.len()], usize) {
        let (mut offers, mut count) = ([NOWHERE; NEIGHBOURS.len()], 0);
        for by in NEIGHBOURS.map(IVec2::from) {
            let Some(neighbour) = level.neighbour(texel, by) else { continue };
            let place = level.places[level.index(neighbour)];
            if place == NOWHERE {
                continue;
            }
            let Some(place) = self.atlas.moved(place, -by) else { continue };
            if place != current && !offers[..count].contains(&place) {
                offers[count] = place;
                count += 1;
            }
        }
        (offers, count)
    }

    /// Whether the guide of a texel is nearly that of its place.
    #[inline(always)]
    fn guide_fits(&self, level: &Level, index: usize) -> bool {
        let found = self.atlas.texels[self.atlas.index(level.places[index])][3];
        level.channels == 0 && found.abs_diff(level.texels[index][3]) < GUIDE_FITS
    }

    /// Random places of the same guide value.
    #[inline(always)]
    fn guess(&self, best: &mut Best, around: &Around, weights: &Around, level: &Level, index: usize) {
        let ramp = level.texels[index][3];
        let mut bits = mix(self.seed ^ index as u64);
        for _ in 0..self.tries {
            bits = mix(bits);
            if let Some(place) = self.atlas.alike(ramp, bits as u32) {
                self.consider(best, around, weights, level, index, place, self.weights.alone);
            }
        }
    }

    #[inline(always)]
    fn consider(
        &self,
        best: &mut Best,
        around: &Around,
        weights: &Around,
        level: &Level,
        index: usize,
        place: Place,
        alone: u32,
    ) {
        if !best.is_first(place) {
            return;
        }
        let uses = level.uses(self.atlas.index(place), level.places[index] == place).min(MOST_AGAIN);
        let extras = self.extra_cost(level, index, place).saturating_add(uses * self.weights.again);
        let cost = self.difference(around, weights, place, extras, best.cost);
        let cost = cost.saturating_add((cost >> 8).saturating_mul(alone));
        if cost < best.cost {
            (best.place, best.cost) = (place, cost);
        }
    }

    #[inline(always)]
    fn extra_cost(&self, level: &Level, index: usize, place: Place) -> u32 {
        if level.channels == 0 {
            return 0;
        }
        let wanted = &level.extras[index * level.channels..][..level.channels];
        let found = &self.atlas.extras[self.atlas.index(place) * level.channels..][..level.channels];
        let terms = wanted.iter().zip(found).zip(&self.weights.extras);
        terms.fold(0, |sum, ((&a, &b), &weight)| {
            let difference = u32::from(a.abs_diff(b));
            sum.saturating_add((difference * difference).saturating_mul(weight))
        })
    }

    /// The weighted squared difference of the texels around a place to those wanted; any value from `limit` on if it is
    /// not below.
    #[inline(always)]
    fn difference(&self, around: &Around, weights: &Around, place: Place, mut sum: u32, limit: u32) -> u32 {
        let mut at = self.atlas.index(place) - RADIUS * (self.atlas.stride + 1);
        // Few checks of the limit: each needs the sum of all lanes.
        for rows in [0..3, 3..SIDE] {
            let mut part = 0_i32;
            for (row, weights) in around[rows.clone()].iter().zip(&weights[rows]) {
                let texels = self.atlas.texels[at..at + ROW].as_flattened();
                for ((&found, &wanted), &weight) in texels.iter().zip(row).zip(weights) {
                    let off = i16::from(found).wrapping_sub(wanted);
                    // 112 products of 15 and 8 bits cannot overflow.
                    let term = i32::from(off.wrapping_mul(weight)).wrapping_mul(i32::from(off));
                    part = part.wrapping_add(term);
                }
                at += self.atlas.stride;
            }
            sum = sum.saturating_add(part as u32);
            if sum >= limit {
                return sum;
            }
        }
        sum
    }
}
