//! The guide: a ramp of the signed distance to the edge of the nearest crack.
//!
//! A mask of crack or not says nothing about most texels, and a search that sees only a few texels around has nothing
//! to go by. The ramp tells every texel within reach how far it is from a crack, and its slope tells in which
//! direction. It rises with the root of the distance: steepest at the edge, where one texel more or less is seen.

use super::widen::widened;
use crate::{
    Grid,
    math::ops,
    pattern::SurfaceFrame,
    raster::{DepthField, TexelRect, crack_distance},
};
use glam::{IVec2, UVec2};

/// Value of the ramp at the edge of a crack; below it is crack.
const EDGE: f32 = 127.5;

/// The ramp of the texels in `rect` of a surface of `size`: 0 = `reach` inside a crack, 255 = `reach` away from all.
///
/// Cracks thinner than `thin` are widened. `is_crack` is asked for texels of the surface only. Beyond its borders there
/// is no crack, or what lies at the opposite border if it `wraps`.
pub(super) fn ramp(
    size: UVec2,
    rect: TexelRect,
    reach: u32,
    thin: u32,
    wraps: bool,
    is_crack: impl Fn(u32, u32) -> bool,
) -> Vec<u8> {
    let inner = rect.size();
    let outer = inner + 2 * reach;
    let Ok(frame) = SurfaceFrame::new(outer) else { return vec![255; inner.element_product() as usize] };
    let (mut cracks, mut rest) = (DepthField::new(frame), DepthField::new(frame));
    let is_crack = widened(size, rect, reach, thin, wraps, is_crack);
    let has_crack = is_crack.contains(&true);
    for (at, &is_crack) in is_crack.iter().enumerate() {
        let to = if is_crack { &mut cracks } else { &mut rest };
        to.depth.as_mut_slice()[at] = u16::MAX;
    }
    if !has_crack {
        return vec![255; inner.element_product() as usize];
    }
    let (away, inside) = (crack_distance(&cracks, 1, reach as u8), crack_distance(&rest, 1, reach as u8));
    let mut out = Vec::with_capacity(inner.element_product() as usize);
    let columns = reach as usize..(reach + inner.x) as usize;
    for y in reach..reach + inner.y {
        let (away, inside) = (&away.row(y as usize)[columns.clone()], &inside.row(y as usize)[columns.clone()]);
        // Half a texel less: from the edge, not from the nearest centre on the other side of it.
        out.extend(away.iter().zip(inside).map(|(&away, &inside)| {
            let distance = if away > 0.0 { away - 0.5 } else { 0.5 - inside };
            let share = (distance.abs() / reach as f32).min(1.0).sqrt();
            (EDGE + EDGE * share.copysign(distance)) as u8
        }));
    }
    out
}

/// The distance from the edge that a value of the ramp stands for, in reaches; below zero inside of a crack.
pub(super) fn distance(value: u8) -> f32 {
    let share = (f32::from(value) - EDGE) / EDGE;
    share * share.abs()
}

/// The direction in which the ramp rises, as two bytes around 128: its slope over three texels, of unit length; 128,
/// 128 where it is level.
pub(super) fn orientation(ramp: impl Fn(IVec2) -> u8, at: IVec2) -> [u8; 2] {
    let value = |dx, dy| f32::from(ramp(at + IVec2::new(dx, dy)));
    let across = value(1, -1) - value(-1, -1) + 2.0 * (value(1, 0) - value(-1, 0)) + value(1, 1) - value(-1, 1);
    let down = value(-1, 1) - value(-1, -1) + 2.0 * (value(0, 1) - value(0, -1)) + value(1, 1) - value(1, -1);
    if across == 0.0 && down == 0.0 {
        return [128; 2];
    }
    let unit = ops::unit(ops::atan2(down, across));
    unit.to_array().map(|part| (127.5 + 127.5 * part) as u8)
}

/// A channel with values of 0..=1 as bytes.
pub(super) fn bytes(channel: &Grid<f32>) -> Vec<u8> {
    channel.as_slice().iter().map(|&value| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect()
}
