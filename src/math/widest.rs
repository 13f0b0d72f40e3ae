//! Loops for the widest vectors of the processor at hand.

#[cfg(target_arch = "x86_64")]
use fearless_simd::{Level, Simd};

/// Runs `work` as it is compiled for the widest vectors that the processor at hand has: AVX2 on x86-64, if it is there; elsewhere
/// a build assumes no less than there is.
///
/// The bits are the same either way: the same operations in the same order, each rounded as it stands, none fused with another.
/// Only what is inlined into `work` gains, so its loops are `#[inline(always)]`, and so is the closure.
#[inline(always)]
pub(crate) fn widest<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = Level::new().as_avx2() {
        return avx2.vectorize(work);
    }
    work()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// Products that are added, a root, a quotient, a choice and whole numbers, of which a fused or reordered one would differ.
    #[inline(always)]
    fn kernel(a: &[f32], b: &[f32], out: &mut [u32]) {
        for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
            let sum = a * b + a * a + b * 0.3;
            let value = sum / (sum.abs().sqrt() + 0.1) - if sum > 1.0 { a } else { b };
            *out = (value.to_bits() ^ (value as i32 as u32)).wrapping_mul(0x9E37_79B1);
        }
    }

    #[test]
    fn the_widest_vectors_give_the_same_bits() {
        let mut rng = Rng::new(12);
        for n in [0, 1, 7, 8, 31, 1000] {
            let mut values = || (0..n).map(|_| rng.range(-100.0, 100.0)).collect::<Vec<_>>();
            let (a, b) = (values(), values());
            let (mut plain, mut wide) = (vec![0; n], vec![0; n]);
            kernel(&a, &b, &mut plain);
            widest(
                #[inline(always)]
                || kernel(&a, &b, &mut wide),
            );
            assert_eq!(plain, wide);
        }
    }
}
