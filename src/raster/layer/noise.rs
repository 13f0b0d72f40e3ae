//! Random numbers on a lattice, and smooth noise between them.

/// A number in `-1..=1` at a lattice point.
#[inline(always)]
pub(super) fn lattice(seed: u32, x: i32, y: i32) -> f32 {
    let hash = hash(seed, x, y);
    (hash >> 8) as i32 as f32 * (2.0 / 16_777_215.0) - 1.0
}

#[inline(always)]
pub(super) fn hash(seed: u32, x: i32, y: i32) -> u32 {
    let mut h = seed ^ (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    h ^ (h >> 15)
}

/// Smooth noise in `-1..=1` with bumps about one unit wide.
#[inline(always)]
pub(crate) fn noise(seed: u32, x: f32, y: f32) -> f32 {
    let ((fx, ix), (fy, iy)) = (floor(x), floor(y));
    let ease = |t: f32| t * t * (3.0 - 2.0 * t);
    let (tx, ty) = (ease(x - fx), ease(y - fy));
    let at = |dx: i32, dy: i32| lattice(seed, ix.wrapping_add(dx), iy.wrapping_add(dy));
    let top = at(0, 0) + (at(1, 0) - at(0, 0)) * tx;
    let low = at(0, 1) + (at(1, 1) - at(0, 1)) * tx;
    top + (low - top) * ty
}

/// The whole number below, as both. Without a call, which [`f32::floor`] is on machines that may be old.
#[inline(always)]
pub(super) fn floor(x: f32) -> (f32, i32) {
    let whole = x as i32;
    let below = whole.wrapping_sub(i32::from(whole as f32 > x));
    (below as f32, below)
}

/// A random number in 0..1 for a pair of integers.
#[inline(always)]
pub(super) fn draw(seed: u32, x: i32, y: i32) -> f32 {
    (hash(seed, x, y) >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
}
