//! From distances to heights: a monotone cubic across the rings.

use super::heights_near::TILE;

/// One value for each texel of a row of a tile.
pub(super) type Lane = [f32; TILE];

/// What the heights of a row of texels depend on. Lengths are in texels.
#[derive(Clone, Copy)]
pub(super) struct Across {
    /// Distances to the rings of the level below and of the one above.
    pub(super) low: Lane,
    pub(super) high: Lane,
    /// Distances to the rings of the levels beyond these.
    pub(super) lower: Lane,
    pub(super) higher: Lane,
    /// Height of the level below.
    pub(super) base: Lane,
    /// Height from the level below to the one above, and the same for the bands under and over this one.
    pub(super) rise: Lane,
    pub(super) rise_under: Lane,
    pub(super) rise_over: Lane,
}

/// A distance that is never zero, texels.
const LEAST: f32 = 1e-4;

/// Width of a band as a multiple of the nominal one, above which it does not make its neighbors flatter.
const WIDEST: f32 = 1.5;

/// The slope at a ring between two bands of given widths and heights: the weighted harmonic mean of Fritsch and Butland
/// ("A method for constructing local monotone piecewise cubic interpolants", 1984).
#[inline(always)]
fn slope_between([under, over]: [f32; 2], [rise_under, rise_over]: [f32; 2]) -> f32 {
    let [by_under, by_over] = [(2.0 * over + under) * under, (over + 2.0 * under) * over];
    3.0 * (under + over) * rise_under * rise_over / (by_under * rise_over + by_over * rise_under)
}

impl Across {
    /// Slopes at the ring below and at the one above, height per texel. `nominal` is the usual width of a band.
    ///
    /// Both sides of a ring see the same widths there, so the slope is continuous across it.
    #[inline(always)]
    fn slopes(&self, i: usize, nominal: f32) -> [f32; 2] {
        let limit = |width: f32| width.max(LEAST).min(WIDEST * nominal);
        let here = limit(self.low[i] + self.high[i]);
        let under = limit(self.lower[i] - self.low[i]);
        let over = limit(self.higher[i] - self.high[i]);
        [
            slope_between([under, here], [self.rise_under[i], self.rise[i]]),
            slope_between([here, over], [self.rise[i], self.rise_over[i]]),
        ]
    }

    /// Heights between two rings.
    ///
    /// A cubic over the share of the way from ring to ring, with the slopes of both. It is monotone, as the slopes are
    /// at most three times the mean one (Fritsch and Carlson 1980).
    #[inline(always)]
    pub(super) fn between(&self, nominal: f32) -> Lane {
        let mut out = [0.0; TILE];
        for (i, out) in out.iter_mut().enumerate() {
            let width = (self.low[i] + self.high[i]).max(LEAST);
            let share = self.low[i] / width;
            let scale = width / self.rise[i];
            let [begin, end] = self.slopes(i, nominal).map(|slope| (slope * scale).min(3.0));
            let cubic = share * (begin + share * (3.0 - 2.0 * begin - end + share * (begin + end - 2.0)));
            *out = self.base[i] + self.rise[i] * cubic;
        }
        out
    }

    /// Heights inside a ring that has no ring above it: they rise by less than a step.
    #[inline(always)]
    pub(super) fn summit(&self, nominal: f32, roundness: f32) -> Lane {
        let mut out = [0.0; TILE];
        for (i, out) in out.iter_mut().enumerate() {
            let [slope, _] = self.slopes(i, nominal);
            let share = (self.low[i] / nominal).min(1.0);
            let rise = slope * share * nominal * (1.0 - 0.5 * roundness * share) / self.rise[i];
            *out = self.base[i] + self.rise[i] * rise / (1.0 + rise * rise).sqrt();
        }
        out
    }

    /// Heights below a ring that has no ring below it: they fall by less than `depth`.
    #[inline(always)]
    pub(super) fn floor(&self, nominal: f32, depth: &Lane) -> Lane {
        let mut out = [0.0; TILE];
        for (i, out) in out.iter_mut().enumerate() {
            let [_, slope] = self.slopes(i, nominal);
            let fall = slope * self.high[i];
            *out = self.base[i] + self.rise[i] - depth[i] * fall / (depth[i] + fall).max(1e-12);
        }
        out
    }
}
