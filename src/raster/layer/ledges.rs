//! Craters with several ledges: how they go down towards the hit, their light, and the dust on and around them.

use super::{
    draws,
    noise::noise,
    row::{Row, TexelRow},
    shape::{Place, Shape, TO_LIGHT},
};
use core::ops::Range;
use glam::Vec2;

/// Share of the depth inside of the edge that is an even hollow; the ledges have the rest.
pub(super) const SAG: f32 = 0.4;

/// Strength of the shadows of ledges, as a share of that of the edge.
pub(super) const LEDGE_SHADE: f32 = 0.35;

/// How much brighter the wall of a ledge is that faces the light, as a share of that of the edge.
pub(super) const LEDGE_LIT: f32 = 0.25;

/// How much of the light on the edge is in patches, and its strength.
const PATCHES: f32 = 0.5;
const EDGE_LIT: f32 = 2.0;

/// How much darker it is at the bottom: for the ledges above a place, and for its distance from the edge.
const BELOW_LEDGES: f32 = 0.36;
const IN_HOLLOW: f32 = 0.28;

/// How much darker the side of the hollow is that is turned away from the light.
const AWAY: f32 = 0.45;

/// Limits of what these darken, as a share of the brightness.
const DARKENS: [f32; 2] = [-0.25, 0.7];

/// How much brighter than the surface a place is at most.
pub(super) const BRIGHTEST: f32 = 0.6;

/// Most cover of the dust around a crater, and how much brighter than the surface it is.
const MOST_DUST: f32 = 0.6;
const DUST_TONE: f32 = 0.28;

impl Shape<'_> {
    /// How far a place lies from the edge of a hollow around the hit: 0 at the edge and outside, 1 in the middle.
    pub(super) fn hollow(&self, off: Vec2) -> f32 {
        (1.0 - off.length_squared() / (1.44 * self.radius * self.radius).max(1.0)).max(0.0)
    }

    /// How much darker a place is than the edge; `sunk` is the share of the ledges that lie above it, `hollow` how far it
    /// lies in the hollow, and `wall` is 0 at the edge and 1 below its wall.
    pub(super) fn darkness(&self, off: Vec2, sunk: f32, hollow: f32, wall: f32) -> f32 {
        let lean = off / self.radius.max(1.0);
        // Flakes further out have their own light.
        let own = 1.0 - (2.0 * (lean.length() - 0.8)).clamp(0.0, 1.0);
        let away = wall * own * lean.dot(TO_LIGHT);
        (BELOW_LEDGES * sunk + IN_HOLLOW * hollow + AWAY * away).clamp(DARKENS[0], DARKENS[1])
    }

    /// Patches of light on the edge.
    #[inline(always)]
    pub(super) fn edge_patches(&self, at: Vec2, seed: u32) -> f32 {
        let wide = (0.3 * self.radius).max(4.0);
        0.5 + 0.9 * noise(seed ^ draws::EDGE_PATCHES, at.x / wide, at.y / wide)
    }

    /// How much powder lies at a place of the floor, 0..=1.
    #[inline(always)]
    pub(super) fn powder(&self, at: Vec2, seed: u32) -> f32 {
        let cloud = |k: u32, size: f32| noise(seed ^ (draws::POWDER + k), at.x / size, at.y / size);
        (1.3 * (cloud(0, 3.0 * self.grain) + 0.4 * cloud(1, 1.1 * self.grain) - 0.1)).clamp(0.0, 1.0)
    }

    /// Noise of the heaps of dust around a crater, from the largest on.
    #[inline(always)]
    pub(super) fn fill_heaps(&self, heaps: &mut [Row; 3], row: TexelRow, texels: &Range<usize>, seed: u32) {
        for ((k, heap), size) in (0u32..).zip(heaps).zip([4.0 * self.grain, 2.1, 1.0]) {
            row.fill(heap, texels, |at| noise(seed ^ (draws::HEAPS + k), at.x / size, at.y / size));
        }
    }

    /// Adds the dust that lies around a crater, in heaps; `left` is 1 at its edge and falls to 0 outward.
    pub(super) fn add_dust(&self, place: &mut Place, [large, small, fine]: [f32; 3], left: f32, open: f32) {
        let heaps = 0.55 + 0.8 * large + 0.3 * small;
        let dust = (3.0 * self.crushed.dust * left * left * heaps).clamp(0.0, MOST_DUST) * open;
        place.pale = place.pale.max(dust);
        place.shade += (DUST_TONE + 0.1 * fine) * open * dust;
    }
}

/// The light on walls: on that of the edge in patches, and on those of ledges.
pub(super) fn ledge_light(edge: f32, ledges: f32, patch: f32) -> f32 {
    (edge * (1.0 - PATCHES + PATCHES * patch)).clamp(0.0, 1.0) * EDGE_LIT + ledges * (1.0 - edge)
}
