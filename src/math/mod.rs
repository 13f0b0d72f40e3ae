//! Portable arithmetic: the same values give the same bits on every machine.
//!
//! `sqrt` and the four operations are exact everywhere; all other functions that a pattern needs are in [`ops`].
//! Random numbers come from [`Rng`], whose stream never changes between versions.

pub mod ops;
#[cfg(test)]
pub(crate) mod pools;
mod rng;
mod simd;
pub(crate) mod turns;
pub(crate) mod whole;

pub use rng::Rng;
pub(crate) use rng::{hash_unit, mix};
pub(crate) use simd::vectorized;

/// 0 at 0 and 1 at 1, level at both ends; `share` is in 0..=1.
#[inline(always)]
pub(crate) fn smooth(share: f32) -> f32 {
    share * share * (3.0 - 2.0 * share)
}
