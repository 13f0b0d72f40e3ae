//! Rows of normals and depths, and arithmetic of bytes.

use super::patch::Patch;
use crate::{
    blend::{cover, slope_of},
    raster::SlopeCorrection,
};

/// A texel of four bytes.
pub(super) type Rgba = [u8; 4];

/// Rounds a value of 0..=255 (plus less than a half on either side); `raster/stamp.rs` says why this is not a cast.
#[inline(always)]
pub(super) fn round(value: f32) -> u32 {
    (value + 8_388_608.0).to_bits() & 255
}

#[inline(always)]
fn normal_bytes(x: f32, y: f32, z: f32, alpha: u32) -> u32 {
    let byte = |v: f32| round(v * 127.5 + 127.5);
    byte(x) | byte(y) << 8 | byte(z) << 16 | alpha << 24
}

/// Normals over a flat base.
#[inline(always)]
pub(super) fn flat_row<const ROOM: usize>(out: &mut [Rgba], patch: &Patch<ROOM>, row: usize) {
    let (x, y, inv_len) = (&patch.x[patch.row(row)], &patch.y[patch.row(row)], &patch.inv_len[patch.row(row)]);
    for (((out, &x), &y), &inv_len) in out.iter_mut().zip(x).zip(y).zip(inv_len) {
        *out = normal_bytes(x * inv_len, -y * inv_len, inv_len, 255).to_le_bytes();
    }
}

/// Normals over base normals: the slopes of base and crack add up, which is exact for heights that add up.
#[inline(always)]
pub(super) fn tilted_row<const ROOM: usize>(out: &mut [Rgba], base: &[Rgba], patch: &Patch<ROOM>, row: usize) {
    let (x, y) = (&patch.x[patch.row(row)], &patch.y[patch.row(row)]);
    for (((out, &base), &x), &y) in out.iter_mut().zip(base).zip(x).zip(y) {
        let bytes = u32::from_le_bytes(base);
        let part = |c: u32| (channel(bytes, c) - 127.5) * (1.0 / 127.5);
        let (base_x, base_y, base_z) = (part(0), part(1), part(2));
        // A normal that points into the surface is invalid; it counts as nearly flat.
        let z = if base_z > 0.05 { base_z } else { 0.05 };
        let (sum_x, sum_y) = (base_x + x * z, base_y - y * z);
        let inv_len = 1.0 / (sum_x * sum_x + sum_y * sum_y + z * z).sqrt();
        let painted = normal_bytes(sum_x * inv_len, sum_y * inv_len, z * inv_len, bytes >> 24);
        let level = (x == 0.0) & (y == 0.0);
        *out = if level { bytes } else { painted }.to_le_bytes();
    }
}

/// Normals over base normals: the horizontal parts add up, the vertical ones are multiplied.
#[inline(always)]
pub(super) fn whiteout_row<const ROOM: usize>(out: &mut [Rgba], base: &[Rgba], patch: &Patch<ROOM>, row: usize) {
    let (x, y, inv_len) = (&patch.x[patch.row(row)], &patch.y[patch.row(row)], &patch.inv_len[patch.row(row)]);
    for ((((out, &base), &x), &y), &inv_len) in out.iter_mut().zip(base).zip(x).zip(y).zip(inv_len) {
        let bytes = u32::from_le_bytes(base);
        let part = |c: u32| (channel(bytes, c) - 127.5) * (1.0 / 127.5);
        let (base_x, base_y, base_z) = (part(0), part(1), part(2));
        let base_z = if base_z > 0.05 { base_z } else { 0.05 };
        let (sum_x, sum_y, z) = (base_x + x * inv_len, base_y - y * inv_len, base_z * inv_len);
        let scale = 1.0 / (sum_x * sum_x + sum_y * sum_y + z * z).sqrt();
        let painted = normal_bytes(sum_x * scale, sum_y * scale, z * scale, bytes >> 24);
        let level = (x == 0.0) & (y == 0.0);
        *out = if level { bytes } else { painted }.to_le_bytes();
    }
}

/// Normals over base normals that give way to cracks, with the slopes that make them those of one surface.
#[inline(always)]
pub(super) fn corrected_row<const ROOM: usize>(
    out: &mut [Rgba],
    base: &[Rgba],
    correction: &[[i16; 2]],
    patch: &Patch<ROOM>,
    row: usize,
) {
    let (x, y, depths) = (&patch.x[patch.row(row)], &patch.y[patch.row(row)], patch.depths(row));
    let slopes = x.iter().zip(y).zip(depths);
    for (((out, &base), &correction), ((&x, &y), &depth)) in out.iter_mut().zip(base).zip(correction).zip(slopes) {
        *out = corrected(base, correction, [x, y], depth);
    }
}

/// [`corrected_row`] away from cracks.
#[inline(always)]
pub(super) fn level_row(out: &mut [Rgba], base: &[Rgba], correction: &[[i16; 2]]) {
    for ((out, &base), &correction) in out.iter_mut().zip(base).zip(correction) {
        *out = corrected(base, correction, [0.0; 2], 0);
    }
}

#[inline(always)]
fn corrected(base: Rgba, correction: [i16; 2], [x, y]: [f32; 2], depth: u16) -> Rgba {
    let ([base_x, base_y], left) = (slope_of(base), 1.0 - cover(depth));
    let [more_x, more_y] = correction.map(|steps| f32::from(steps) * SlopeCorrection::UNIT);
    let (sum_x, sum_y) = (base_x * left + more_x + x, base_y * left + more_y + y);
    let scale = 1.0 / (sum_x * sum_x + sum_y * sum_y + 1.0).sqrt();
    let painted = normal_bytes(sum_x * scale, -sum_y * scale, scale, u32::from(base[3]));
    let level = (x == 0.0) & (y == 0.0) & (depth == 0) & (correction == [0; 2]);
    if level { base } else { painted.to_le_bytes() }
}

#[inline(always)]
pub(super) fn depth_row(out: &mut [u8], base: Option<&[u8]>, depths: &[u16]) {
    let byte = |depth: u16| (u32::from(depth).wrapping_mul(255).wrapping_add(32_895) >> 16) as u8;
    match base {
        Some(base) => {
            for ((out, &base), &depth) in out.iter_mut().zip(base).zip(depths) {
                *out = base.max(byte(depth));
            }
        }
        None => {
            for (out, &depth) in out.iter_mut().zip(depths) {
                *out = byte(depth);
            }
        }
    }
}

/// Byte `i` of a texel.
#[inline(always)]
pub(super) fn channel(texel: u32, i: u32) -> f32 {
    (texel.wrapping_shr(8 * i) & 255) as i32 as f32
}
