//! A small random generator with a frozen stream.

use rand_core::{Infallible, TryRng};
use rand_pcg::Pcg32;

/// PCG-XSH-RR 64/32 (O'Neill 2014), seeded through `SplitMix64`.
///
/// The stream is part of the crate's contract: a seed gives the same numbers in every version and on every machine.
/// Each consumer draws from its own named stream, so that a new consumer does not shift the others. The generator
/// implements the traits of [`rand_core`], so the distributions of `rand` can draw from it.
///
/// ```
/// use bevy_crack::math::Rng;
///
/// let mut markers = Rng::new(7).stream("markers");
/// let mut again = Rng::new(7).stream("markers");
/// assert_eq!(markers.next_u32(), again.next_u32());
/// assert!((0.0..1.0).contains(&markers.unit()));
/// assert!((-1.0..1.0).contains(&markers.signed()));
/// assert!((2.0..5.0).contains(&markers.range(2.0, 5.0)));
/// // One for each element: what others draw does not change it.
/// assert_eq!(markers.substream(3), again.substream(3));
/// assert_ne!(markers.substream(3), markers.substream(4));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rng {
    seed: u64,
    core: Pcg32,
}

/// The inverse of the multiplier of a [`Pcg32`], modulo 2⁶⁴.
const BACK: u64 = 0xC097_EF87_329E_28A5;

/// One round of `SplitMix64`: a good 64-bit hash of `x`.
#[must_use]
pub(crate) const fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// A number in `[0, 1)` that depends only on the two arguments.
#[must_use]
pub(crate) fn hash_unit(seed: u64, index: u64) -> f32 {
    (mix(mix(seed) ^ index) >> 40) as f32 / (1u64 << 24) as f32
}

impl Rng {
    /// A generator for `seed`. All seeds are equally good, zero included.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let increment = mix(seed ^ 0xDA3E_39CB_94B9_5BDB) | 1;
        // `Pcg32` advances its state once before the first number; here the first state is to be `mix(seed) +
        // increment`.
        let state = mix(seed).wrapping_mul(BACK).wrapping_sub(increment);
        Self { seed, core: Pcg32::new(state, increment >> 1) }
    }

    /// An independent generator for the consumer `name`; does not advance `self`.
    #[must_use]
    pub fn stream(&self, name: &str) -> Self {
        // FNV-1a of the name, mixed into the seed.
        let hash = name.bytes().fold(0xCBF2_9CE4_8422_2325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01B3));
        Self::new(mix(self.seed) ^ hash)
    }

    /// An independent generator for the element `index`; does not advance `self`.
    #[must_use]
    pub fn substream(&self, index: u64) -> Self {
        Self::new(mix(self.seed.wrapping_add(mix(index))))
    }

    /// The next 32 random bits.
    pub fn next_u32(&mut self) -> u32 {
        let Ok(bits) = self.core.try_next_u32();
        bits
    }

    /// A number in `[0, 1)`, a multiple of 2⁻²⁴.
    pub fn unit(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 / (1u32 << 24) as f32
    }

    /// A number in `[-1, 1)`.
    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }

    /// A number in `[low, high)`.
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

impl TryRng for Rng {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        self.core.try_next_u32()
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        self.core.try_next_u64()
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        self.core.try_fill_bytes(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw<const N: usize>(mut rng: Rng) -> [u32; N] {
        std::array::from_fn(|_| rng.next_u32())
    }

    /// The numbers of O'Neill's `pcg32-demo`.
    #[test]
    fn the_core_is_pcg32() {
        let rng = Rng { seed: 0, core: Pcg32::new(42, 54) };
        assert_eq!(draw(rng), [0xA15C_02B7, 0x7B47_F409, 0xBA1D_3330, 0x83D2_F293, 0xBFA4_784B, 0xCBED_606E]);
    }

    #[test]
    fn streams_are_frozen() {
        // A change here changes every pattern of every user.
        assert_eq!(draw(Rng::new(0)), [0x0AD8_3C82, 0xEE30_42B1, 0xDB3D_FD95, 0x0861_8827]);
        assert_eq!(draw(Rng::new(42).stream("markers")), [0x4972_FDDB, 0xC6E5_92D5, 0x42B6_3009, 0xB9AE_2B4E]);
        assert_eq!(draw(Rng::new(42).substream(7)), [0x7A04_C449, 0xAE25_B8E2, 0x7BF1_7BA1, 0xDFE4_8612]);
        assert_ne!(draw::<4>(Rng::new(42).stream("markers")), draw(Rng::new(43).stream("markers")));
        assert_ne!(draw::<4>(Rng::new(42).stream("markers")), draw(Rng::new(42).stream("starts")));
    }

    /// Generic code draws the same numbers.
    #[test]
    fn it_is_a_generator_of_rand() {
        fn long(rng: &mut impl rand_core::Rng) -> (u32, u64) {
            (rng.next_u32(), rng.next_u64())
        }
        let mut rng = Rng::new(7);
        let [first, low, high] = draw(rng.clone());
        assert_eq!(long(&mut rng), (first, u64::from(high) << 32 | u64::from(low)));
    }

    #[test]
    fn units_are_even() {
        let mut rng = Rng::new(1);
        let n = 100_000;
        let mean = (0..n).map(|_| f64::from(rng.unit())).sum::<f64>() / f64::from(n);
        assert!((mean - 0.5).abs() < 0.005, "mean {mean}");
    }
}
