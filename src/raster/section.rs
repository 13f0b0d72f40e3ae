//! The cross-section of a crack in texels, for the stamps; `raster/stamp.rs` has the formula.

use super::{Profile, chipped, ragged};

/// Half widths are clamped to this many texels, far above the diagonal of the largest surface.
pub(super) const MAX_RADIUS: f32 = 1.0e6;

/// The larger one. It ignores NaN handling, unlike `f32::max`, so that it is one instruction on every machine.
#[inline(always)]
pub(super) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller one; see [`max`].
#[inline(always)]
pub(super) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(super) fn clamp01(x: f32) -> f32 {
    min(max(x, 0.0), 1.0)
}

/// `x` clamped to `0..=top`; zero if it is NaN.
#[inline]
pub(super) fn clamped(x: f32, top: f32) -> f32 {
    clamp01(x / top) * top
}

/// A [`Profile`] in texels.
#[derive(Clone, Copy)]
pub(super) struct Section {
    depth: f32,
    /// Share of the depth of the thinnest cracks.
    least: f32,
    /// Increase of that share per texel of half width.
    gain: f32,
    wall: f32,
    /// Share of the depth of wide cracks that lies at their edge.
    edge: f32,
    rim: f32,
    pub(super) rim_depth: f32,
    pub(super) inv_rim: f32,
    /// Increase of the rim's share per texel of half width, and the share at width 0.
    rim_gain: f32,
    rim_least: f32,
    /// Increase of a thin line's share of depth per texel of half width.
    strength: f32,
    /// Largest deviation of an edge, texels.
    ragged: f32,
    /// The same as a share of the half width above half a texel.
    deviation: f32,
    /// Shares of that deviation by texel, see [`ragged::at`]; empty if edges are smooth.
    pub(super) tile: &'static [i8],
    /// How far pieces have come off the edges at most, texels, and the shares of it by texel; empty if none have.
    chipped: f32,
    pub(super) pieces: &'static [i8],
    /// How high stones lie, for one step of their tile.
    rubble: f32,
    pub(super) stones: &'static [i8],
}

/// Largest deviation of an edge, as a share of the half width above half a texel.
const DEVIATION: f32 = 0.6;

/// Half widths at which edges begin to be upright, and from which on they are wholly so, texels.
const UPRIGHT: [f32; 2] = [2.5, 6.0];

/// Half width from which on pieces come off, texels, and by how much further for each texel above it.
const UNCHIPPED: f32 = 1.5;
const CHIPPED: f32 = 0.8;

/// Depth where pieces have come off whole, as a share of that of the crack, and depth of the steps that others leave.
const GONE: f32 = 0.5;
const STEP: f32 = 0.14;

/// Largest such share at which a wider line is nowhere less deep. `wall` is the share of the half width that slopes. A wider line has a longer
/// slope, and an edge that deviates further: both make it less deep at a place that stays as far from its middle.
fn deviation(wall: f32) -> f32 {
    min(DEVIATION, (1.0 - 0.5 * wall) / (1.0 + 0.5 * wall))
}

/// The cross-section at a known half width.
#[derive(Clone, Copy)]
pub(super) struct Cut {
    pub(super) peak: f32,
    /// Distance at which the core ends.
    pub(super) reach: f32,
    pub(super) inv_wall: f32,
    /// Share of the depth at the edge, and what the walls have of it.
    pub(super) edge: f32,
    pub(super) slope: f32,
    /// Distance at which the rim ends.
    pub(super) rim_reach: f32,
    /// 65535, less for lines thinner than a texel.
    pub(super) scale: f32,
    pub(super) rim_depth: f32,
    /// Deviation of the edge for one step of the tile.
    pub(super) swing: f32,
    /// How far pieces have come off for one step of their tile.
    pub(super) gap: f32,
}

impl Cut {
    /// The share of the peak at this distance from the centre line.
    #[inline(always)]
    pub(super) fn share(&self, distance: f32) -> f32 {
        let within = self.reach - distance;
        self.edge * clamp01(within) + self.slope * clamp01(within * self.inv_wall)
    }
}

impl Section {
    pub(super) fn new(profile: &Profile, texels_per_unit: f32) -> Self {
        let full_width = max(clamped(profile.full_width * texels_per_unit, MAX_RADIUS), 1.0e-6);
        let rim = clamped(profile.rim_width * texels_per_unit, MAX_RADIUS);
        let ragged = clamped(profile.ragged * texels_per_unit, MAX_RADIUS);
        let wall = if profile.even_walls { 1.0 } else { clamped(profile.wall, 1.0) };
        let chipped = if profile.even_walls { 0.0 } else { clamped(profile.chipped * texels_per_unit, MAX_RADIUS) };
        let rubble = if profile.even_walls { 0.0 } else { clamped(profile.rubble, 1.0) };
        let tiles = (chipped > 0.0 || rubble > 0.0).then(|| chipped::tiles(chipped));
        Self {
            depth: clamped(profile.depth, 1.0),
            least: if profile.even_walls { 2.0 / full_width } else { 0.4 },
            gain: if profile.even_walls { 2.0 } else { 1.2 } / full_width,
            wall,
            edge: if profile.even_walls { 0.0 } else { clamped(profile.edge, 1.0) },
            rim,
            rim_depth: if rim > 0.0 { clamped(profile.rim_depth, 1.0) } else { 0.0 },
            inv_rim: 1.0 / max(rim, 1.0),
            strength: 2.0 / max(1.0 - clamped(profile.faintest, 1.0), 1.0e-3),
            rim_gain: 0.0,
            rim_least: 1.0,
            ragged,
            deviation: deviation(wall),
            tile: if ragged > 0.0 || tiles.is_some() { ragged::tile(ragged) } else { &[] },
            chipped: tiles.map_or(0.0, |tiles| tiles.most),
            pieces: tiles.map_or(&[], |tiles| tiles.pieces),
            rubble: rubble * (1.0 / 127.0),
            stones: tiles.map_or(&[], |tiles| tiles.stones),
        }
    }

    /// The same with whole rims only from a width of `full` pattern units on, if that is not zero.
    pub(super) fn with_rims(mut self, full: f32, texels_per_unit: f32) -> Self {
        if full > 0.0 {
            (self.rim_gain, self.rim_least) = (2.0 / max(full * texels_per_unit, 1.0e-3), 0.0);
        }
        self
    }

    pub(super) fn upright(depth: f32) -> Self {
        Self {
            depth: clamped(depth, 1.0),
            least: 0.4,
            gain: MAX_RADIUS,
            wall: 0.0,
            edge: 0.0,
            rim: 0.0,
            rim_depth: 0.0,
            inv_rim: 1.0,
            strength: 2.0,
            rim_gain: 0.0,
            rim_least: 1.0,
            ragged: 0.0,
            deviation: DEVIATION,
            tile: &[],
            chipped: 0.0,
            pieces: &[],
            rubble: 0.0,
            stones: &[],
        }
    }

    /// The cross-section at half width `r`. All stamping loops call this, so that they give the same bits.
    #[inline(always)]
    pub(super) fn cut(&self, r: f32) -> Cut {
        let core = max(r, 0.5);
        let edge = self.edge * clamp01((core - UPRIGHT[0]) * (1.0 / (UPRIGHT[1] - UPRIGHT[0])));
        Cut {
            peak: self.depth * min(self.least + self.gain * r, 1.0),
            reach: core + 0.5,
            inv_wall: 1.0 / (1.0 + self.wall * core),
            edge,
            slope: 1.0 - edge,
            rim_reach: r + self.rim,
            scale: 65535.0 * min(self.strength * r, 1.0),
            rim_depth: self.rim_depth * min(self.rim_least + self.rim_gain * r, 1.0),
            swing: self.swing(r) * (1.0 / 127.0),
            gap: self.gap(r) * (1.0 / 127.0),
        }
    }

    /// Largest deviation of an edge at half width `r`.
    #[inline(always)]
    fn swing(&self, r: f32) -> f32 {
        min(self.ragged, self.deviation * max(r - 0.5, 0.0))
    }

    /// The depth without rim at this distance from the centre line. `piece` and `stone` are the steps of their tiles there: a piece below zero
    /// has come off whole, one above has left a shallow step.
    #[inline(always)]
    pub(super) fn deep(&self, cut: &Cut, distance: f32, piece: f32, stone: f32) -> f32 {
        let peak = min(cut.peak, self.depth * (1.0 - self.rubble * stone));
        let (gone, left) = (cut.gap * max(-piece, 0.0), cut.gap * max(piece, 0.0));
        let upright = GONE * min(gone, 1.0) * clamp01(cut.reach + gone - distance);
        let core = peak * max(cut.share(distance), upright);
        max(core, self.depth * STEP * min(left, 1.0) * clamp01(cut.reach + left - distance))
    }

    /// Whether a line of up to this half width can have pieces that have come off, or stones. Where it cannot, its cross-section is the plain one.
    pub(super) fn is_chipped(&self, r: f32) -> bool {
        !self.pieces.is_empty() && (r > UNCHIPPED || self.cut(r).peak > self.depth * (1.0 - 127.0 * self.rubble))
    }

    /// How far pieces have come off the edge at most, at half width `r`.
    #[inline(always)]
    fn gap(&self, r: f32) -> f32 {
        min(self.chipped, CHIPPED * max(r - UNCHIPPED, 0.0))
    }

    /// Distance from the centre line beyond which nothing is drawn.
    pub(super) fn reach(&self, r: f32) -> f32 {
        let rim = if self.rim_depth > 0.0 { r + self.rim } else { 0.0 };
        max(max(r, 0.5) + 0.5 + self.gap(r), rim) + self.swing(r)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// A wider line is nowhere less deep, whatever its walls and however ragged its edges: segments that become wider are drawn over what is there.
    #[test]
    fn wider_lines_are_nowhere_less_deep() {
        let mut rng = Rng::new(12);
        for case in 0..4000 {
            let full_width = rng.range(0.001, 0.2);
            let even_walls = case % 4 == 0;
            let [ragged, chipped] = [0.02, 0.02].map(|most| most * rng.unit());
            let [wall, rubble, edge] = [0; 3].map(|_| rng.unit());
            let profile = Profile { wall, ragged, chipped, rubble, edge, full_width, even_walls, ..Profile::DEFAULT };
            let section = Section::new(&profile, rng.range(1.0, 400.0));
            let (deviates, far) = (rng.range(-1.0, 1.0), rng.range(0.0, 8.0));
            let mut one_of = |values: [f32; 4]| values[rng.next_u32() as usize % 4];
            let (piece, stone) = (one_of([-127.0, -60.0, 0.0, 127.0]), one_of([0.0, 0.0, 50.0, 127.0]));
            let deep = |r: f32| {
                let cut = section.cut(r);
                section.deep(&cut, far + 127.0 * cut.swing * deviates, piece, stone) * cut.scale
            };
            let mut before = 0.0;
            for step in 0..200 {
                let now = deep(step as f32 * 0.06);
                assert!(now >= before - 0.02, "case {case}: {now} after {before} of 65,535");
                before = now;
            }
        }
    }
}
