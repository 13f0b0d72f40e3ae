//! Slopes from normals and back, and the part of them that is no slope of any height.
//!
//! A slope is how far the normal leans to the right and **down** the picture, as a share of its height above the
//! surface.

use super::solve::solve;
use crate::Grid;
use glam::UVec2;
use std::ops::Range;

/// The least height of a normal that counts, as a share of its length: others point into the surface or along it.
const LOWEST: f32 = 0.05;

/// The steepest slope that is taken along an axis.
const STEEPEST: f32 = 8.0;

/// A slope whose square can be taken, and that looks upright.
const UPRIGHT: f32 = 1e6;

/// Depth from which nothing is left of the surface's own relief, as a share of the deepest.
const GONE: f32 = 0.3;

/// The slope that the bytes of a normal stand for: flat if the normal has no height.
#[inline(always)]
pub(crate) fn slope_of(texel: [u8; 4]) -> [f32; 2] {
    let part = |byte: u8| f32::from(byte) - 127.5;
    let z = part(texel[2]);
    let scale = if z > LOWEST * 127.5 { 1.0 / z } else { 0.0 };
    let bound = |slope: f32| slope.clamp(-STEEPEST, STEEPEST);
    [bound(part(texel[0]) * scale), bound(-part(texel[1]) * scale)]
}

/// The slope, or an upright one if it is steeper.
#[inline(always)]
pub(super) fn bounded(slope: f32) -> f32 {
    slope.clamp(-UPRIGHT, UPRIGHT)
}

/// The normal of a slope as bytes, with this alpha.
#[inline(always)]
pub(super) fn normal_of(slope: [f32; 2], alpha: u8) -> [u8; 4] {
    let [right, down] = slope.map(bounded);
    let scale = 127.5 / (right * right + down * down + 1.0).sqrt();
    let byte = |part: f32| (part * scale + 128.0) as u8;
    [byte(right), byte(-down), byte(1.0), alpha]
}

/// How far a crack of this depth replaces the surface's own relief, 0..=1.
#[inline(always)]
pub(crate) fn cover(depth: u16) -> f32 {
    let share = f32::from(depth) * (1.0 / (GONE * 65535.0));
    if share < 1.0 { share } else { 1.0 }
}

/// Slopes in a rectangle, zero around it.
pub(super) struct Slopes {
    size: UVec2,
    /// To the right and down, row after row, with a column and a row of zeros more on every side.
    pub(super) right: Vec<f32>,
    pub(super) down: Vec<f32>,
}

impl Slopes {
    pub(super) fn new(size: UVec2) -> Self {
        let n = (size.x as usize + 2) * (size.y as usize + 2);
        Self { size, right: vec![0.0; n], down: vec![0.0; n] }
    }

    const fn stride(&self) -> usize {
        self.size.x as usize + 2
    }

    /// The place of a row.
    pub(super) const fn row(&self, y: usize) -> Range<usize> {
        let first = (y + 1) * self.stride() + 1;
        first..first + self.size.x as usize
    }

    /// Replaces the slopes by what is to be added to them so that they are those of a height that is zero around the
    /// rectangle.
    ///
    /// The height solves Poisson's equation with the divergence of the slopes, for which they are averaged to the
    /// middle between two texels. Its own slopes are compared with slopes that were averaged alike, so what is finer
    /// than that stays sharp: slopes that are already those of a height are changed near the border only.
    pub(super) fn correct(&mut self) {
        let mut height = self.divergence();
        solve(&mut height);
        let stride = self.stride();
        let mut around = vec![0.0; self.right.len()];
        for y in 0..height.height() {
            around[self.row(y)].copy_from_slice(height.row(y));
        }
        let averaged =
            |slopes: &[f32], i: usize, step: usize| 0.25 * (slopes[i - step] + 2.0 * slopes[i] + slopes[i + step]);
        let mut corrected = Self::new(self.size);
        for y in 0..height.height() {
            for i in self.row(y) {
                corrected.right[i] = 0.5 * (around[i + 1] - around[i - 1]) - averaged(&self.right, i, 1);
                corrected.down[i] = 0.5 * (around[i + stride] - around[i - stride]) - averaged(&self.down, i, stride);
            }
        }
        *self = corrected;
    }

    fn divergence(&self) -> Grid<f32> {
        let (stride, mut out) = (self.stride(), Grid::new(self.size, 0.0));
        for y in 0..out.height() {
            for (value, i) in out.row_mut(y).iter_mut().zip(self.row(y)) {
                let right = self.right[i + 1] - self.right[i - 1];
                let down = self.down[i + stride] - self.down[i - stride];
                *value = 0.5 * (right + down);
            }
        }
        out
    }
}
