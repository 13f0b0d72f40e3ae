//! The crushed state of a texel, and tiles of such texels.

/// Steps of a slope of 1.
pub(crate) const SLOPE_UNIT: f32 = 2048.0;

/// The crushed state of a texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Spot {
    /// Slope of the surface to the right and down, of a height that points down into the surface.
    pub(crate) slope: [i16; 2],
    /// Cover of the crushed colour, 0..=255, and its change in brightness, in 1/128.
    pub(crate) pale: u8,
    pub(crate) shade: i8,
    /// Cover of the hole.
    pub(crate) dark: u8,
    /// Depth, 255 = the depth of the crater.
    pub(crate) deep: u8,
    /// A drawn pit: the distance from its edge in steps of 1/[`PIT_STEPS`] texel, the cover of its floor, and how its
    /// side faces the light, 0 = away from it, 255 = directly.
    pub(crate) pit: [u8; 3],
}

/// Steps per texel of the distance from the edge of a pit.
pub(crate) const PIT_STEPS: f32 = 8.0;

impl Spot {
    pub(super) const NONE: Self = Self { slope: [0; 2], pale: 0, shade: 0, dark: 0, deep: 0, pit: [0; 3] };

    /// Both combined, in any order: the deeper hole, the paler colour and the steeper slope win.
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
