//! Settings of the colors of height fields: [`TerrainColors`].

use super::error::ReliefError;

/// Ground that is not steep, from a height on up to that of the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ground {
    /// Where it begins, as a share of the way from the lowest height (the sea, if there is one) to the highest. 0..=1.
    pub from: f32,
    /// sRGB.
    pub color: [u8; 3],
}

/// The sea: all that lies below height 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sea {
    /// sRGB at the shore.
    pub shallow: [u8; 3],
    /// sRGB where it is deep.
    pub deep: [u8; 3],
    /// Depth at which the color is half way to `deep`, pattern units. 0.0001..=16.
    pub half: f32,
}

/// Stones with gaps between them: parts above height 0 that hang together.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StoneColors {
    /// sRGB of what lies in the gaps.
    pub gap: [u8; 3],
    /// How much colors change from stone to stone. 0..=1.
    pub tone: f32,
}

/// A color that covers part of rock.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Patches {
    /// sRGB.
    pub color: [u8; 3],
    /// Share of the rock that it covers, about. 0..=1.
    pub share: f32,
}

/// Woods: dark crowns, in moist hollows first.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Woods {
    /// sRGB.
    pub color: [u8; 3],
    /// How far they spread: 0 = nowhere, 1 = over all ground that is neither too high nor too steep. 0..=1.
    pub spread: f32,
    /// Where they end, as a share of the way from the sea or the lowest height to the highest. 0..=1.
    pub top: f32,
    /// Size of a crown, pattern units. 0.0005..=1.
    pub crown: f32,
}

/// Rivers, from the drainage of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Rivers {
    /// sRGB.
    pub color: [u8; 3],
    /// Ground whose water makes a river at its mouth, square pattern units. 0.0001..=256.
    pub gather: f32,
    /// Width of the widest, pattern units. 0.0001..=1.
    pub width: f32,
}

/// What the ground looks like, by its height, slope and shape.
///
/// Rock shows where the ground is steep. It has layers, strata, along its heights. Hollows are darker than edges. By default
/// all is as in [`ROCK`](Self::ROCK).
///
/// ```
/// use bevy_crack::relief::{Ground, Patches, Rivers, Sea, StoneColors, TerrainColors, Woods};
///
/// let dark = TerrainColors { light: 0.0, ..TerrainColors::ROCK };
/// assert_eq!(dark.validate(), Ok(()));
///
/// // A red wall: one kind of ground, stones with dark gaps, much moss, no stains.
/// let wall = TerrainColors {
///     ground: [Ground { from: 0.0, color: [120, 70, 60] }; 5],
///     stones: Some(StoneColors { gap: [30, 25, 20], tone: 0.4 }),
///     lichen: Some(Patches { color: [90, 110, 60], share: 0.5 }),
///     stains: None,
///     ..TerrainColors::ROCK
/// };
/// assert_eq!(wall.validate(), Ok(()));
/// // An island in a dark sea, with wide rivers and woods up to its top.
/// let island = TerrainColors {
///     sea: Some(Sea { shallow: [30, 60, 70], deep: [5, 15, 30], half: 0.01 }),
///     woods: Some(Woods { color: [40, 60, 40], spread: 1.0, top: 1.0, crown: 0.005 }),
///     rivers: Some(Rivers { color: [40, 70, 90], gather: 0.02, width: 0.01 }),
///     ..TerrainColors::ISLAND
/// };
/// assert_eq!(island.validate(), Ok(()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TerrainColors {
    /// The sea, if there is one.
    pub sea: Option<Sea>,
    /// Ground that is not steep, from the lowest to the highest.
    pub ground: [Ground; 5],
    /// Width of the transition from one ground to the next, as a share of all heights. 0..=1.
    pub transition: f32,
    /// sRGB of rock: two kinds of strata.
    pub rock: [[u8; 3]; 2],
    /// Slopes, height per length, at which rock begins to show and at which it covers everything. 0..=100, the second
    /// above the first.
    pub steep: [f32; 2],
    /// Thickness of a stratum, pattern units. 0.0005..=16.
    pub stratum: f32,
    /// How much the color of rock changes from stratum to stratum. 0..=1.
    pub strata: f32,
    /// How much hollows are darker and edges lighter. 0..=1.
    pub cavity: f32,
    /// How much colors vary from place to place. 0..=1.
    pub variety: f32,
    /// Stones with gaps between them, if there are any; default none.
    #[cfg_attr(feature = "serde", serde(default))]
    pub stones: Option<StoneColors>,
    /// Stains that run down, as of iron; default none.
    #[cfg_attr(feature = "serde", serde(default))]
    pub stains: Option<Patches>,
    /// Lichen; default none.
    #[cfg_attr(feature = "serde", serde(default))]
    pub lichen: Option<Patches>,
    /// Woods; default none.
    #[cfg_attr(feature = "serde", serde(default))]
    pub woods: Option<Woods>,
    /// Rivers; default none.
    #[cfg_attr(feature = "serde", serde(default))]
    pub rivers: Option<Rivers>,
    /// How much light from the top left and shade are part of the colors: 0 for surfaces that the game lights. 0..=1.
    pub light: f32,
}

const fn ground(from: f32, color: [u8; 3]) -> Ground {
    Ground { from, color }
}

impl TerrainColors {
    /// Gray and ochre rock: a wall seen from the front.
    pub const ROCK: Self = Self {
        sea: None,
        ground: [
            ground(0.0, [96, 88, 79]),
            ground(0.3, [120, 111, 99]),
            ground(0.55, [134, 125, 112]),
            ground(0.8, [146, 137, 123]),
            ground(1.0, [154, 146, 133]),
        ],
        transition: 0.2,
        rock: [[136, 121, 103], [110, 105, 99]],
        steep: [0.5, 1.6],
        stratum: 0.022,
        strata: 0.6,
        cavity: 0.42,
        variety: 0.6,
        stones: Some(StoneColors { gap: [92, 81, 66], tone: 0.6 }),
        stains: Some(Patches { color: [128, 90, 60], share: 0.12 }),
        lichen: Some(Patches { color: [154, 156, 132], share: 0.15 }),
        woods: None,
        rivers: None,
        light: 0.35,
    };

    /// An island: sea, beach, meadows, woods, rivers, rock and snow.
    pub const ISLAND: Self = Self {
        sea: Some(Sea { shallow: [84, 166, 164], deep: [12, 50, 92], half: 0.016 }),
        ground: [
            ground(0.0, [216, 199, 156]),
            ground(0.012, [118, 132, 70]),
            ground(0.36, [122, 124, 76]),
            ground(0.6, [121, 114, 97]),
            ground(0.73, [218, 224, 232]),
        ],
        transition: 0.1,
        rock: [[128, 116, 102], [96, 90, 85]],
        steep: [1.2, 2.0],
        stratum: 0.02,
        strata: 0.4,
        cavity: 0.4,
        variety: 0.7,
        stones: None,
        stains: None,
        lichen: None,
        woods: Some(Woods { color: [50, 76, 40], spread: 0.76, top: 0.62, crown: 0.0055 }),
        rivers: Some(Rivers { color: [60, 106, 128], gather: 0.02, width: 0.006 }),
        light: 0.35,
    };

    /// High mountains: meadows, scree, rock and snow.
    pub const MOUNTAIN: Self = Self {
        sea: None,
        ground: [
            ground(0.0, [92, 104, 60]),
            ground(0.22, [108, 108, 72]),
            ground(0.42, [128, 118, 100]),
            ground(0.6, [148, 142, 134]),
            ground(0.7, [242, 245, 250]),
        ],
        transition: 0.08,
        rock: [[112, 104, 97], [82, 79, 79]],
        steep: [1.0, 1.8],
        stratum: 0.018,
        strata: 0.45,
        cavity: 0.6,
        variety: 0.65,
        stones: None,
        stains: None,
        lichen: None,
        woods: Some(Woods { color: [48, 68, 40], spread: 0.45, top: 0.45, crown: 0.007 }),
        rivers: None,
        light: 0.35,
    };

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ReliefError::OutOfRange`] for the first number that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), ReliefError> {
        let mut ranges = vec![
            ("transition", self.transition, 0.0, 1.0),
            ("steep", self.steep[0], 0.0, 100.0),
            ("steep", self.steep[1], self.steep[0], 100.0),
            ("stratum", self.stratum, 0.0005, 16.0),
            ("strata", self.strata, 0.0, 1.0),
            ("cavity", self.cavity, 0.0, 1.0),
            ("variety", self.variety, 0.0, 1.0),
            ("light", self.light, 0.0, 1.0),
        ];
        ranges.extend(self.ground.map(|ground| ("ground", ground.from, 0.0, 1.0)));
        ranges.extend(self.sea.map(|sea| ("sea", sea.half, 0.0001, 16.0)));
        ranges.extend(self.stones.map(|stones| ("stones.tone", stones.tone, 0.0, 1.0)));
        ranges.extend(self.stains.map(|stains| ("stains.share", stains.share, 0.0, 1.0)));
        ranges.extend(self.lichen.map(|lichen| ("lichen.share", lichen.share, 0.0, 1.0)));
        if let Some(woods) = self.woods {
            ranges.push(("woods.spread", woods.spread, 0.0, 1.0));
            ranges.push(("woods.top", woods.top, 0.0, 1.0));
            ranges.push(("woods.crown", woods.crown, 0.0005, 1.0));
        }
        if let Some(rivers) = self.rivers {
            ranges.push(("rivers.gather", rivers.gather, 0.0001, 256.0));
            ranges.push(("rivers.width", rivers.width, 0.0001, 1.0));
        }
        match ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value)) {
            Some((name, value, min, max)) => Err(ReliefError::OutOfRange { name, value, min, max }),
            None => Ok(()),
        }
    }
}

impl Default for TerrainColors {
    fn default() -> Self {
        Self::ROCK
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_range_are_named() {
        let with = |change: fn(&mut TerrainColors)| {
            let patches = Some(Patches { color: [9; 3], share: 0.5 });
            let mut colors = TerrainColors { stains: patches, lichen: patches, ..TerrainColors::ISLAND };
            colors.stones = TerrainColors::ROCK.stones;
            assert_eq!(colors.validate(), Ok(()));
            change(&mut colors);
            colors.validate().unwrap_err().to_string()
        };
        assert!(with(|colors| colors.stones.as_mut().unwrap().tone = f32::NAN).contains("`stones.tone`"));
        assert!(with(|colors| colors.stains.as_mut().unwrap().share = 1.5).contains("`stains.share`"));
        assert!(with(|colors| colors.lichen.as_mut().unwrap().share = -0.1).contains("`lichen.share`"));
        assert!(with(|colors| colors.woods.as_mut().unwrap().spread = f32::INFINITY).contains("`woods.spread`"));
        assert!(with(|colors| colors.woods.as_mut().unwrap().top = f32::NAN).contains("`woods.top`"));
        assert!(with(|colors| colors.woods.as_mut().unwrap().crown = 0.0).contains("`woods.crown`"));
        assert!(with(|colors| colors.rivers.as_mut().unwrap().gather = 0.0).contains("`rivers.gather`"));
        assert!(with(|colors| colors.rivers.as_mut().unwrap().width = f32::NAN).contains("`rivers.width`"));
    }
}
