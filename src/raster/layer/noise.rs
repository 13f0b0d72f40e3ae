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
    between(corners(seed, ix, iy), ease(x - fx), ease(y - fy))
}

/// [`noise`] at places of a row. Corners are drawn once for places that follow one another in a cell.
#[inline(always)]
pub(crate) fn noise_row<const N: usize>(seed: u32, x: [f32; N], y: f32) -> [f32; N] {
    let (fy, iy) = floor(y);
    let ty = ease(y - fy);
    let mut cell = x.first().map_or(0, |x| floor(*x).1);
    let mut known = corners(seed, cell, iy);
    let (mut tx, mut all) = ([0.0; N], [[0.0; N]; 4]);
    for i in 0..N {
        let (fx, ix) = floor(x[i]);
        if ix != cell {
            (cell, known) = (ix, corners(seed, ix, iy));
        }
        tx[i] = x[i] - fx;
        all.iter_mut().zip(known).for_each(|(all, corner)| all[i] = corner);
    }
    let mut out = [0.0; N];
    for i in 0..N {
        out[i] = between(all.map(|corner| corner[i]), ease(tx[i]), ty);
    }
    out
}

#[inline(always)]
fn ease(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

/// The numbers at the corners of a cell: left and right, above and below.
#[inline(always)]
fn corners(seed: u32, x: i32, y: i32) -> [f32; 4] {
    let at = |dx: i32, dy: i32| lattice(seed, x.wrapping_add(dx), y.wrapping_add(dy));
    [at(0, 0), at(1, 0), at(0, 1), at(1, 1)]
}

#[inline(always)]
fn between([a, b, c, d]: [f32; 4], tx: f32, ty: f32) -> f32 {
    let (top, low) = (a + (b - a) * tx, c + (d - c) * tx);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    #[test]
    fn a_row_of_noise_is_that_of_its_places() {
        let mut rng = Rng::new(5);
        for _ in 0..2000 {
            let (step, start, y) = (rng.unit() * rng.unit(), 300.0 * rng.signed(), 300.0 * rng.signed());
            let x: [f32; 16] = std::array::from_fn(|i| start + step * i as f32);
            assert_eq!(noise_row(9, x, y), x.map(|x| noise(9, x, y)));
        }
    }
}
