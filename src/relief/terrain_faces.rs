//! Flat faces of stones: [`Faces`].

use super::{
    stones::{Stone, Stones},
    terrain_check::smoothstep,
    terrain_noise::RowNoise,
};
use crate::{
    math::{Rng, ops},
    pattern::SurfaceFrame,
};
use glam::Vec2;
use std::{f32::consts::TAU, ops::Range};

/// Share of its height that a place keeps at least.
const KEPT: f32 = 0.34;

/// A plane: its height at the middle of its stone, and its slope.
#[derive(Clone, Copy, Debug)]
struct Plane {
    level: f32,
    slope: Vec2,
    /// How much of either of two noises makes it uneven.
    uneven: Vec2,
}

/// A straight break across a stone: what lies beyond it is lower.
#[derive(Clone, Copy, Debug)]
struct Break {
    way: Vec2,
    reach: f32,
    depth: f32,
    /// Width of its slope.
    width: f32,
}

/// Area of the smallest stone with breaks, square pattern units.
const BROKEN: f32 = 0.004;

/// How far breaks are bent, as a share of the size of their stone.
const BENT: f32 = 0.07;

/// How uneven faces are, pattern units.
const UNEVEN: f32 = 0.0022;

/// Planes that cut the round top of each stone to a body with flat faces and sharp edges.
#[derive(Clone, Debug)]
pub(super) struct Faces {
    stones: Stones,
    planes: Vec<Plane>,
    breaks: Vec<[Break; 2]>,
    /// The planes of each stone.
    ranges: Vec<Range<usize>>,
    /// Share of what stands above the planes that is cut off.
    amount: f32,
    unit: f32,
    noises: [RowNoise; 2],
    noise: [Vec<f32>; 2],
}

/// A front, sometimes two, and slopes around it.
fn planes(stone: &Stone, out: &mut Vec<Plane>) {
    let mut rng = Rng::new(stone.seed).stream("faces");
    let mut unevenness = rng.stream("uneven");
    let mut uneven = || UNEVEN * ops::unit(TAU * unevenness.unit());
    let front = Plane {
        level: stone.highest * rng.range(0.28, 0.85),
        slope: Vec2::new(rng.signed(), rng.signed()) * 0.27,
        uneven: uneven(),
    };
    out.push(front);
    let radius = 0.5 * stone.area.sqrt();
    let mut beyond = |way: Vec2, reach: f32, steep: f32| {
        out.push(Plane { level: front.level + steep * reach, slope: front.slope - way * steep, uneven: uneven() });
    };
    for _ in 0..2 {
        let way = ops::unit(TAU * rng.unit());
        beyond(way, radius * rng.range(-0.1, 0.7), rng.range(0.15, 0.5));
    }
    let sides = 4 + rng.next_u32() % 4;
    let first = rng.unit();
    for side in 0..sides {
        let way = ops::unit(TAU * (first + (side as f32 + 0.6 * rng.signed()) / sides as f32));
        let reach = (way * stone.half).length();
        beyond(way, reach * rng.range(0.45, 1.0), rng.range(0.25, 1.6));
    }
}

/// Two breaks, often without any depth.
fn breaks(stone: &Stone) -> [Break; 2] {
    let mut rng = Rng::new(stone.seed).stream("breaks");
    [0.6, 0.3].map(|often| {
        let way = ops::unit(TAU * rng.unit());
        let reach = (way * stone.half).length() * rng.range(-0.35, 0.6);
        let is_broken = rng.unit() < often && stone.area > BROKEN;
        let depth = if is_broken { stone.highest * rng.range(0.04, 0.13) } else { 0.0 };
        Break { way, reach, depth, width: rng.range(0.005, 0.018) }
    })
}

impl Faces {
    /// `amount` of what stands above the planes of `stones` is cut off.
    pub(super) fn new(stones: Stones, frame: &SurfaceFrame, amount: f32, seed: u64) -> Self {
        let mut all = Vec::new();
        let range = |stone: &Stone| {
            let first = all.len();
            planes(stone, &mut all);
            first..all.len()
        };
        let ranges = stones.list.iter().map(range).collect();
        let breaks = stones.list.iter().map(breaks).collect();
        let (width, unit) = (stones.labels.width(), frame.texels_per_unit());
        let mut rng = Rng::new(seed).stream("uneven faces");
        let mut noise = || RowNoise::new(width, [0.06 * unit; 2], 5, 0.62, &mut rng);
        let noises = [noise(), noise()];
        Self { stones, planes: all, breaks, ranges, amount, unit, noises, noise: [vec![0.0; width], vec![0.0; width]] }
    }

    /// Cuts row `y`.
    pub(super) fn cut_row(&mut self, y: usize, row: &mut [f32]) {
        for (noise, row) in self.noises.iter_mut().zip(&mut self.noise) {
            noise.fill_row(y, row);
        }
        for (x, (height, &label)) in row.iter_mut().zip(self.stones.labels.row(y)).enumerate() {
            let Some(stone) = (label as usize).checked_sub(1) else { continue };
            let middle = self.stones.list[stone].middle;
            let off = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / self.unit - middle;
            let planes = &self.planes[self.ranges[stone].clone()];
            let noise = Vec2::new(self.noise[0][x], self.noise[1][x]);
            let at = |plane: &Plane| plane.level + plane.slope.dot(off) + plane.uneven.dot(noise);
            let lowest = planes.iter().fold(*height, |lowest, plane| lowest.min(at(plane)));
            let size = self.stones.list[stone].area.sqrt();
            let broken = self.breaks[stone].iter().map(|b| {
                let beyond = off.dot(b.way) - b.reach + BENT * size * noise.x;
                b.depth * smoothstep(0.0, b.width, beyond)
            });
            let lowest = lowest - broken.sum::<f32>();
            *height += self.amount * (lowest.max(KEPT * *height) - *height);
        }
    }
}
