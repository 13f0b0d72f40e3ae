//! What heights are accepted: [`check_heights`].

use super::error::ReliefError;
use crate::{Grid, math::smooth, pattern::MAX_SIDE};

/// Largest height, pattern units.
const MOST_HEIGHT: f32 = 1e6;

/// Checks that heights are finite and neither too many nor too few.
pub(super) fn check_heights(heights: &Grid<f32>, least: u32) -> Result<(), ReliefError> {
    let size = heights.size();
    if size.min_element() < least || size.max_element() > MAX_SIDE {
        return Err(ReliefError::Size { width: size.x, height: size.y, least, most: MAX_SIDE });
    }
    (0..heights.height()).try_for_each(|y| check_row(heights.row(y), y))
}

/// Checks that the heights of row `y` are finite.
pub(super) fn check_row(row: &[f32], y: usize) -> Result<(), ReliefError> {
    let is_wrong = |height: &f32| !(-MOST_HEIGHT..=MOST_HEIGHT).contains(height);
    match row.iter().position(is_wrong) {
        Some(x) => Err(ReliefError::Height { x: x as u32, y: y as u32 }),
        None => Ok(()),
    }
}

/// 0 up to `from`, 1 from `to` on, smooth between.
#[inline(always)]
pub(super) fn smoothstep(from: f32, to: f32, value: f32) -> f32 {
    let width = to - from;
    let share = ((value - from) / if width.abs() < 1e-6 { 1e-6 } else { width }).clamp(0.0, 1.0);
    smooth(share)
}
