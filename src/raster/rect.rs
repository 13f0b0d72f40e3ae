//! [`TexelRect`].

use glam::UVec2;

/// Texels from `min` (included) to `max` (excluded).
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

    /// The texels in both.
    #[must_use]
    pub fn intersect(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Grown by `by` texels on every side, within a surface of `size`.
    #[must_use]
    pub fn grow(self, by: u32, size: UVec2) -> Self {
        if self.is_empty() {
            return self;
        }
        Self { min: self.min.saturating_sub(UVec2::splat(by)), max: (self.max + UVec2::splat(by)).min(size) }
    }
}
