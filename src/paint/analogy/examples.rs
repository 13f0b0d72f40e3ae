//! [`Examples`]: pairs made ready for the search.

use super::{
    atlas::{Atlas, NOWHERE, Place, atlas_size},
    error::AnalogyError,
    pair::{AnalogyPair, MAX_CHANNELS},
    params::AnalogyParams,
    search::Weights,
};
use crate::Grid;
use glam::UVec2;

/// The largest number of pairs.
pub const MAX_PAIRS: usize = 16;

/// The largest number of texels of all photographs together.
pub const MAX_EXAMPLE_TEXELS: u64 = 1 << 26;

/// Shortest side of the smallest level, texels.
const LEAST_SIDE: u32 = 12;

/// Pairs of guide and photograph made ready for the search: pyramids, and lists of places of equal guide values.
///
/// Takes about 40 ns for each texel. It can be shared by all surfaces that are made from the same pairs.
#[derive(Debug)]
pub struct Examples {
    pub(super) params: AnalogyParams,
    /// From the full size down.
    pub(super) atlases: Vec<Atlas>,
    pub(super) weights: Weights,
    /// Number of further channels that the user gives.
    pub(super) given: usize,
    pictures: Vec<Grid<[u8; 4]>>,
}

impl Examples {
    /// Checks the pairs and the parameters, and makes the pyramids.
    ///
    /// # Errors
    /// [`AnalogyError`] if a parameter is out of range, there are no pairs or too many, they have too many texels or
    /// different channels, or their guides mark nothing or everything as crack.
    pub fn new(pairs: &[AnalogyPair], params: &AnalogyParams) -> Result<Self, AnalogyError> {
        params.validate()?;
        let given = check(pairs, params)?;
        let least = pairs.iter().map(|pair| pair.size().min_element()).min().unwrap_or(1);
        let mut atlases = vec![Atlas::new(pairs, params)];
        while atlases.len() < params.levels as usize && least >> atlases.len() >= LEAST_SIDE {
            let next = atlases.last().map(Atlas::halved);
            atlases.extend(next);
        }
        let pictures = pairs.iter().map(|pair| pair.picture().clone()).collect();
        Ok(Self { params: *params, atlases, weights: Weights::new(params, given), given, pictures })
    }

    /// The parameters.
    #[must_use]
    pub const fn params(&self) -> &AnalogyParams {
        &self.params
    }

    /// Sizes of the photographs, texels.
    pub fn sizes(&self) -> impl Iterator<Item = UVec2> {
        self.pictures.iter().map(Grid::size)
    }

    /// The guide `A` of a pair, as [`Analogy::ramp`](super::Analogy::ramp); `None` if there is no such pair.
    #[must_use]
    pub fn ramp(&self, pair: usize) -> Option<Grid<u8>> {
        let (atlas, sheet) = (&self.atlases[0], self.atlases[0].sheets.get(pair)?);
        let all = (0..sheet.size.y).flat_map(|y| (0..sheet.size.x).map(move |x| UVec2::new(x, y)));
        Grid::from_vec(sheet.size, all.map(|texel| atlas.texels[atlas.index(sheet.place(texel))][3]).collect())
    }

    /// Cracks that are thinner are widened.
    pub(super) fn thin(&self) -> u32 {
        self.atlases.first().map_or(1, |atlas| atlas.thin)
    }

    /// The guide at a place.
    pub(super) fn ramp_at(&self, place: Place) -> Option<u8> {
        (place != NOWHERE).then(|| self.atlases[0].texels[self.atlases[0].index(place)][3])
    }

    /// The texel of a photograph, RGBA8.
    pub(super) fn color(&self, place: Place) -> [u8; 4] {
        let (pair, texel) = self.texel(place);
        self.pictures.get(pair).and_then(|picture| picture.get(texel.x, texel.y)).unwrap_or_default()
    }

    /// The pair of a place at full size, and its texel.
    pub(super) fn texel(&self, place: Place) -> (usize, UVec2) {
        if place == NOWHERE { (usize::MAX, UVec2::ZERO) } else { self.atlases[0].texel(place) }
    }
}

/// Checks pairs before memory is taken; returns the number of further channels.
fn check(pairs: &[AnalogyPair], params: &AnalogyParams) -> Result<usize, AnalogyError> {
    let Some(first) = pairs.first().filter(|_| pairs.len() <= MAX_PAIRS) else {
        return Err(AnalogyError::PairCount { count: pairs.len(), most: MAX_PAIRS });
    };
    let [width, height] = atlas_size(pairs.iter().map(AnalogyPair::size));
    // Rows and columns of the atlas fit 16 bits.
    if width * height > MAX_EXAMPLE_TEXELS || height >= 1 << 16 {
        return Err(AnalogyError::TooManyTexels { texels: width * height, most: MAX_EXAMPLE_TEXELS });
    }
    let expected = first.channels().len();
    for pair in pairs {
        let count = pair.channels().len();
        if count != expected {
            return Err(AnalogyError::ChannelCount { count, expected, most: MAX_CHANNELS });
        }
    }
    let depth = params.depth;
    let values = pairs.iter().flat_map(|pair| pair.cracks().as_slice());
    let mut is_crack = values.map(|&value| value > 0.0 && value >= depth);
    let one = is_crack.next().unwrap_or(false);
    match (is_crack.any(|other| other != one), one) {
        (true, _) => Ok(expected),
        (false, true) => Err(AnalogyError::AllCrack { depth }),
        (false, false) => Err(AnalogyError::NoCrack { depth }),
    }
}
