//! [`Input`]: values from the bytes of a case.

use crate::math::ops;
use arbitrary::Unstructured;
use glam::Vec2;

/// Values that are read from the bytes of a case. When these are used up, all are as if the bytes were zero.
pub(super) struct Input<'a>(Unstructured<'a>);

impl<'a> Input<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self(Unstructured::new(bytes))
    }

    fn bits<const N: usize>(&mut self) -> [u8; N] {
        let mut bits = [0; N];
        let _ = self.0.fill_buffer(&mut bits);
        bits
    }

    pub(super) fn byte(&mut self) -> u8 {
        u8::from_le_bytes(self.bits())
    }

    pub(super) fn word(&mut self) -> u32 {
        u32::from_le_bytes(self.bits())
    }

    /// 0..`end`; 0 if `end` is 0.
    pub(super) fn below(&mut self, end: u32) -> u32 {
        self.0.int_in_range(0..=end.saturating_sub(1)).unwrap_or(0)
    }

    /// One time in `of`.
    pub(super) fn once_in(&mut self, of: u8) -> bool {
        self.byte() % of == of - 1
    }

    pub(super) fn choose<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len() as u32) as usize]
    }

    /// 0..=1, both ends included.
    pub(super) fn unit(&mut self) -> f32 {
        f32::from(u16::from_le_bytes(self.bits())) / f32::from(u16::MAX)
    }

    /// `low..=high`; over as many sizes as there are if both are above zero.
    pub(super) fn between(&mut self, low: f32, high: f32) -> f32 {
        let share = self.unit();
        let value = if low > 0.0 && high / low > 20.0 {
            low * ops::powf(high / low, share)
        } else {
            low + (high - low) * share
        };
        value.max(low).min(high)
    }

    /// Any number or none at all, those that break things often among them.
    pub(super) fn odd(&mut self) -> f32 {
        const ODD: [f32; 16] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            f32::MIN,
            f32::MIN_POSITIVE,
            1e-45,
            f32::EPSILON,
            1e30,
            -1e30,
            16_777_217.0,
            0.999_999_94,
        ];
        if self.once_in(2) { f32::from_bits(self.word()) } else { self.choose(&ODD) }
    }

    /// `low..=high` mostly, one of both ends sometimes, anything one time in `of`.
    pub(super) fn mostly(&mut self, low: f32, high: f32, of: u8) -> f32 {
        if self.once_in(of) {
            return self.odd();
        }
        match self.byte() % 16 {
            0 => low,
            1 => high,
            _ => self.between(low, high),
        }
    }

    pub(super) fn place(&mut self, extent: Vec2, of: u8) -> Vec2 {
        Vec2::new(self.mostly(0.0, extent.x, of), self.mostly(0.0, extent.y, of))
    }

    pub(super) fn rest(self) -> &'a [u8] {
        self.0.take_rest()
    }
}
