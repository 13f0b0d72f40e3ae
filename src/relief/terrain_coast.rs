//! What the sea makes of a coast: [`Coast`], on the coarse lattice.

use super::{
    terrain_blur::Blur,
    terrain_check::smoothstep,
    terrain_valleys::{block, noise},
};
use crate::{Grid, math::Rng, pattern::SurfaceFrame};
use glam::UVec2;

/// Radius of the surroundings that make a bay or a headland, pattern units.
const AROUND: f32 = 0.045;

/// Radius of the surroundings that make a wide shelf, pattern units.
const WIDE: f32 = 0.08;

/// Depth of the ground off lowland and off headlands, as shares of that of the contours.
const DEPTHS: [f32; 2] = [0.26, 1.6];

/// The search for headlands and the shape of the seabed in steps.
#[derive(Clone, Debug)]
pub(super) struct Coast {
    land: Grid<f32>,
    near: Blur,
    wide: Blur,
    /// Cells per pattern unit.
    unit: f32,
    seed: u64,
}

/// A lattice with 1 for land and 0 for the sea.
fn land(ground: &Grid<f32>) -> Grid<f32> {
    let mut land = ground.clone();
    for height in land.as_mut_slice() {
        *height = if *height > 0.0 { 1.0 } else { 0.0 };
    }
    land
}

impl Coast {
    /// Of the coarse lattice `ground` of heights of `size`.
    pub(super) fn new(ground: &Grid<f32>, size: UVec2, frame: &SurfaceFrame, seed: u64) -> Self {
        let unit = frame.texels_per_unit() / block(size) as f32;
        let [near, wide] = [AROUND, WIDE].map(|radius| Blur::new(ground.size(), (radius * unit).round() as usize));
        Self { land: land(ground), near, wide, unit, seed }
    }

    /// A part of the search; `false` when all is done.
    pub(super) fn step(&mut self) -> bool {
        if self.near.is_done() {
            return self.wide.step(&self.land);
        }
        self.near.step(&self.land);
        true
    }

    /// How far each cell juts out into the sea, 0 in bays, 1 on headlands; and how deep the seabed is there, as a share of
    /// the depth that the contours give it: wide shelves in bays and off some stretches of the coast, deep water off headlands,
    /// reefs.
    pub(super) fn finish(self) -> [Grid<f32>; 2] {
        let (mut near, wide) = (self.near.finish(), self.wide.finish());
        let mut headlands = near.clone();
        for share in headlands.as_mut_slice() {
            *share = smoothstep(0.56, 0.38, *share);
        }
        let mut rng = Rng::new(self.seed).stream("seabed");
        let broad = noise(near.size(), 0.26 * self.unit, 3, 0.5, &mut rng);
        let patchy = noise(near.size(), 0.055 * self.unit, 3, 0.6, &mut rng);
        for (i, share) in near.as_mut_slice().iter_mut().enumerate() {
            let [wide, broad, patchy] = [&wide, &broad, &patchy].map(|grid| grid.as_slice()[i]);
            let shelf = 0.45 * *share + 0.75 * wide + 0.34 * broad + 0.06 * patchy;
            let depth = DEPTHS[1] + (DEPTHS[0] - DEPTHS[1]) * smoothstep(0.1, 0.66, shelf);
            let reef = smoothstep(0.2, 0.6, patchy + 0.4 * broad) * smoothstep(0.12, 0.35, shelf);
            *share = depth * (1.0 - 0.7 * reef);
        }
        [headlands, near]
    }
}
