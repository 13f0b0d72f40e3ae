//! A small random generator with a frozen stream.

/// PCG-XSH-RR 64/32 (O'Neill 2014), seeded through `SplitMix64`.
///
/// The stream is part of the crate's contract: a seed gives the same numbers in every version and on every machine.
/// Each consumer draws from a stream of its own, so that a new consumer does not shift the others.
///
/// ```
/// use bevy_crack::math::Rng;
///
/// let mut markers = Rng::new(7).stream("markers");
/// let mut again = Rng::new(7).stream("markers");
/// assert_eq!(markers.next_u32(), again.next_u32());
/// assert!((0.0..1.0).contains(&markers.unit()));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rng {
    seed: u64,
    state: u64,
    increment: u64,
}

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
    /// A generator for `seed`. Every seed is good, zero included.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        let increment = mix(seed ^ 0xDA3E_39CB_94B9_5BDB) | 1;
        Self { seed, state: mix(seed).wrapping_add(increment), increment }
    }

    /// An independent generator for the consumer called `name`; does not advance `self`.
    #[must_use]
    pub fn stream(&self, name: &str) -> Self {
        // FNV-1a of the name, mixed into the seed.
        let hash = name.bytes().fold(0xCBF2_9CE4_8422_2325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01B3));
        Self::new(mix(self.seed) ^ hash)
    }

    /// An independent generator for the `index`-th thing of its kind; does not advance `self`.
    #[must_use]
    pub const fn nth(&self, index: u64) -> Self {
        Self::new(mix(self.seed.wrapping_add(mix(index))))
    }

    /// The next 32 random bits.
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        #[expect(clippy::cast_possible_truncation, reason = "the generator is defined on the low 32 bits")]
        let xorshifted = (((old >> 18) ^ old) >> 27) as u32;
        xorshifted.rotate_right((old >> 59) as u32)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stream_is_frozen() {
        let mut rng = Rng::new(42).stream("markers");
        let drawn: Vec<u32> = (0..4).map(|_| rng.next_u32()).collect();
        // A change here changes every pattern of every user.
        assert_eq!(drawn, Rng::new(42).stream("markers").take4());
        assert_ne!(drawn, Rng::new(43).stream("markers").take4());
        assert_ne!(drawn, Rng::new(42).stream("starts").take4());
    }

    impl Rng {
        fn take4(mut self) -> Vec<u32> {
            (0..4).map(|_| self.next_u32()).collect()
        }
    }

    #[test]
    fn units_are_even() {
        let mut rng = Rng::new(1);
        let n = 100_000;
        let mean = (0..n).map(|_| f64::from(rng.unit())).sum::<f64>() / f64::from(n);
        assert!((mean - 0.5).abs() < 0.005, "mean {mean}");
    }
}
