//! [`TexelRect`]: a rectangle of texels.

use glam::UVec2;

/// Texels from `min` (included) to `max` (excluded).
///
/// ```
/// use bevy_crack::raster::TexelRect;
///
/// let rect = |x: u32, y: u32, w: u32, h: u32| TexelRect { min: [x, y].into(), max: [x + w, y + h].into() };
/// let (a, b) = (rect(2, 2, 6, 4), rect(6, 4, 8, 8));
/// assert_eq!((a.size(), a.area()), ([6, 4].into(), 24));
/// assert_eq!(a.union(b), rect(2, 2, 12, 10));
/// assert_eq!(a.intersect(b), rect(6, 4, 2, 2));
/// assert!(a.intersect(rect(20, 2, 4, 4)).is_empty());
/// // Within the picture.
/// assert_eq!(b.grow(3, [16, 16].into()), rect(3, 1, 13, 14));
/// assert_eq!(TexelRect::whole([16, 16].into()), rect(0, 0, 16, 16));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct TexelRect {
    /// First column and row.
    pub min: UVec2,
    /// One past the last column and row.
    pub max: UVec2,
}

impl TexelRect {
    /// The rectangle of all texels of a surface of `size`.
    #[must_use]
    pub const fn whole(size: UVec2) -> Self {
        Self { min: UVec2::ZERO, max: size }
    }

    /// Whether it holds no texel.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.min.x >= self.max.x || self.min.y >= self.max.y
    }

    /// Width and height; zero if empty.
    #[must_use]
    pub const fn size(&self) -> UVec2 {
        UVec2::new(self.max.x.saturating_sub(self.min.x), self.max.y.saturating_sub(self.min.y))
    }

    /// Number of texels.
    #[must_use]
    pub const fn area(&self) -> u64 {
        let size = self.size();
        size.x as u64 * size.y as u64
    }

    /// The smallest rectangle that holds both; an empty one adds nothing.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => other,
            (_, true) => self,
            _ => Self { min: self.min.min(other.min), max: self.max.max(other.max) },
        }
    }

    /// The texels in both; the default (empty) if there are none, so that `min` never exceeds `max`.
    #[must_use]
    pub fn intersect(self, other: Self) -> Self {
        let both = Self { min: self.min.max(other.min), max: self.max.min(other.max) };
        if both.is_empty() { Self::default() } else { both }
    }

    /// Grown by `by` texels on every side, clipped to a surface of `size`.
    #[must_use]
    pub fn grow(self, by: u32, size: UVec2) -> Self {
        if self.is_empty() {
            return self;
        }
        let by = UVec2::splat(by);
        Self { min: self.min.saturating_sub(by), max: self.max.saturating_add(by) }.intersect(Self::whole(size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the texels themselves, for rectangles of every kind: empty, and such as end before they begin.
    #[test]
    fn what_is_in_both_is_in_both() {
        let rect = |bits: u32| {
            let number = |shift: u32| bits >> shift & 3;
            TexelRect { min: UVec2::new(number(0), number(2)), max: UVec2::new(number(4), number(6)) }
        };
        let holds = |rect: TexelRect, texel: UVec2| texel.cmpge(rect.min).all() && texel.cmplt(rect.max).all();
        for (a, b) in (0..256).flat_map(|a| (0..256).map(move |b| (rect(a), rect(b)))) {
            let both = a.intersect(b);
            assert!(both.min.cmple(both.max).all(), "{a:?} {b:?}: {both:?}");
            for texel in (0..4).flat_map(|y| (0..4).map(move |x| UVec2::new(x, y))) {
                assert_eq!(holds(both, texel), holds(a, texel) && holds(b, texel), "{texel} of {a:?} {b:?}");
            }
            let size = UVec2::splat(3);
            let grown = a.grow(1, size);
            assert!(a.is_empty() || grown == grown.intersect(TexelRect::whole(size)), "{a:?}: {grown:?}");
        }
        let huge = TexelRect { min: UVec2::ONE, max: UVec2::MAX };
        assert_eq!(huge.grow(7, UVec2::MAX), TexelRect::whole(UVec2::MAX));
    }
}
