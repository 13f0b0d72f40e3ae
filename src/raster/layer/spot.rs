//! What is crushed at a texel, and tiles of it.

/// Steps of a slope of 1.
pub(crate) const SLOPE_UNIT: f32 = 2048.0;

/// What is crushed at a texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Spot {
    /// Slope of the surface to the right and down, as of a height that goes down into it.
    pub(crate) slope: [i16; 2],
    /// How much the crushed colour covers, 0..=255, and how much darker or brighter it is, 1/128.
    pub(crate) pale: u8,
    pub(crate) shade: i8,
    /// How much of the hole there is.
    pub(crate) dark: u8,
    /// How deep it is, 255 = as deep as the crater gets.
    pub(crate) deep: u8,
    /// A drawn pit: how far inside its edge it is in shares of [`PIT_STEPS`] of a texel, how much its floor covers, and how its side faces the light,
    /// 0 = away from it, 255 = squarely.
    pub(crate) pit: [u8; 3],
}

/// Steps of a texel in which the edge of a pit is known.
pub(crate) const PIT_STEPS: f32 = 8.0;

impl Spot {
    pub(super) const NONE: Self = Self { slope: [0; 2], pale: 0, shade: 0, dark: 0, deep: 0, pit: [0; 3] };

    /// Both, in any order: what is deeper in the hole or paler shows, and the steeper slope.
    pub(super) fn with(self, other: Self) -> Self {
        let strength = |spot: Self| (spot.dark, spot.pale, spot.shade);
        let steep = |[x, y]: [i16; 2]| (i32::from(x).pow(2) + i32::from(y).pow(2), x, y);
        let slope = if steep(self.slope) >= steep(other.slope) { self.slope } else { other.slope };
        let (deep, pit) = (self.deep.max(other.deep), self.pit.max(other.pit));
        Self { slope, deep, pit, ..if strength(self) >= strength(other) { self } else { other } }
    }
}

/// Side of a tile, texels.
pub(super) const TILE: u32 = 32;

pub(super) type Tile = [Spot; (TILE * TILE) as usize];
