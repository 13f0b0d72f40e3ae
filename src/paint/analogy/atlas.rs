//! [`Atlas`]: one level of all photographs and guides, below each other, with margins.

use super::{pair::AnalogyPair, params::AnalogyParams, ramp, widen};
use crate::raster::TexelRect;
use glam::{IVec2, UVec2};

/// Texels that are compared around a texel, on every side.
pub(super) const RADIUS: usize = 3;

/// Rows and columns that are compared.
pub(super) const SIDE: usize = 2 * RADIUS + 1;

/// Texels read of a row; the last one has no weight.
pub(super) const ROW: usize = SIDE + 1;

/// Texels around each photograph.
pub(super) const PAD: u32 = 6;

/// The most texels that a list of places of equal guide values holds.
const MOST_LISTED: usize = 1 << 17;

/// One in how many texels of cracks count as the deepest.
const DEEP_SHARE: usize = 12;

/// One in how many texels of the ground count as the farthest from cracks.
const FAR_SHARE: usize = 4;

/// A texel of the atlas: its row in the upper 16 bits, its column in the lower ones.
pub(super) type Place = u32;

/// No place.
pub(super) const NOWHERE: Place = u32::MAX;

/// Where a photograph lies in the atlas.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheet {
    pub(super) min: UVec2,
    pub(super) size: UVec2,
    wraps: bool,
}

impl Sheet {
    /// The place of a texel of the photograph, clamped to it.
    pub(super) fn place(&self, texel: UVec2) -> Place {
        let at = self.min + texel.min(self.size - 1);
        at.y << 16 | at.x
    }
}

/// One level of the photographs.
#[derive(Debug)]
pub(super) struct Atlas {
    pub(super) stride: usize,
    /// Red, green, blue, and the ramp.
    pub(super) texels: Vec<[u8; 4]>,
    /// Further channels, one after the other for each texel.
    pub(super) extras: Vec<u8>,
    pub(super) channels: usize,
    pub(super) sheets: Vec<Sheet>,
    /// The photograph of each row.
    sheet_of_row: Vec<u8>,
    /// Places in the order of their ramp values; those of value `v` are `listed[starts[v]..starts[v + 1]]`.
    listed: Vec<Place>,
    starts: Vec<u32>,
    /// For each value the nearest one that occurs.
    occurring: Vec<u8>,
    /// The smallest value of the ramp: all that is deeper inside of cracks is alike.
    pub(super) deepest: u8,
    /// The largest one: all that is farther from cracks is alike.
    pub(super) farthest: u8,
    /// Cracks that are thinner are widened.
    pub(super) thin: u32,
}

/// The ramp of a photograph.
fn pair_ramp(pair: &AnalogyPair, params: &AnalogyParams, thin: u32) -> Vec<u8> {
    let size = pair.size();
    let is_crack = |x, y| pair.is_crack(x, y, params.depth);
    ramp::ramp(size, TexelRect::whole(size), params.reach, thin, pair.is_tileable(), is_crack)
}

/// The width of thin cracks of the photographs.
fn thin(pairs: &[AnalogyPair], params: &AnalogyParams) -> u32 {
    let widths =
        |pair: &AnalogyPair| widen::widths(pair.size(), pair.is_tileable(), |x, y| pair.is_crack(x, y, params.depth));
    widen::thin(pairs.iter().flat_map(widths).collect())
}

/// The value of the ramp below which a few of the texels of cracks lie. Wider cracks than those of the photographs
/// would be made of these few texels over and over if they were not alike to others.
fn deepest(ramps: &[Vec<u8>]) -> u8 {
    let mut counts = [0_usize; 256];
    ramps.iter().flatten().for_each(|&value| counts[usize::from(value)] += 1);
    let cracks: usize = counts[..128].iter().sum();
    let mut left = cracks / DEEP_SHARE;
    (0_u8..127)
        .find(|&value| left.checked_sub(counts[usize::from(value)]).map(|rest| left = rest).is_none())
        .unwrap_or(127)
}

/// The value of the ramp above which a few of the texels of the ground lie. Where cracks are farther apart than in the
/// photographs, it would be made of these few over and over.
fn farthest(ramps: &[Vec<u8>]) -> u8 {
    let mut counts = [0_usize; 256];
    ramps.iter().flatten().for_each(|&value| counts[usize::from(value)] += 1);
    let ground: usize = counts[128..].iter().sum();
    let mut left = ground / FAR_SHARE;
    (128_u8..=255)
        .rev()
        .find(|&value| left.checked_sub(counts[usize::from(value)]).map(|rest| left = rest).is_none())
        .unwrap_or(255)
}

/// Columns and rows of an atlas of photographs of these sizes.
pub(super) fn atlas_size(sizes: impl Iterator<Item = UVec2>) -> [u64; 2] {
    sizes.fold([0, 0], |[w, h], size| {
        let padded = (size + 2 * PAD).as_u64vec2();
        [w.max(padded.x), h + padded.y]
    })
}

/// Number of further channels: those of the user, and two for the orientation if it counts.
pub(super) const fn channels(params: &AnalogyParams, given: usize) -> usize {
    given + if params.orientation > 0.0 { 2 } else { 0 }
}

impl Atlas {
    fn empty(sizes: &[UVec2], wraps: &[bool], channels: usize) -> Self {
        let [w, h] = atlas_size(sizes.iter().copied());
        let (stride, rows) = (w as usize, h as usize);
        let (mut sheets, mut sheet_of_row) = (Vec::new(), Vec::with_capacity(rows));
        for (index, (&size, &wraps)) in sizes.iter().zip(wraps).enumerate() {
            sheets.push(Sheet { min: UVec2::new(PAD, sheet_of_row.len() as u32 + PAD), size, wraps });
            sheet_of_row.extend(std::iter::repeat_n(index as u8, (size.y + 2 * PAD) as usize));
        }
        let texels = vec![[0; 4]; stride * rows];
        let extras = vec![0; stride * rows * channels];
        let (listed, starts, occurring) = (Vec::new(), vec![0; 257], vec![0; 256]);
        let (deepest, farthest, thin) = (0, 255, 1);
        Self {
            stride,
            texels,
            extras,
            channels,
            sheets,
            sheet_of_row,
            listed,
            starts,
            occurring,
            deepest,
            farthest,
            thin,
        }
    }

    /// The level of full size.
    pub(super) fn new(pairs: &[AnalogyPair], params: &AnalogyParams) -> Self {
        let sizes: Vec<_> = pairs.iter().map(AnalogyPair::size).collect();
        let wraps: Vec<_> = pairs.iter().map(AnalogyPair::is_tileable).collect();
        let given = pairs.first().map_or(0, |pair| pair.channels().len());
        let mut atlas = Self::empty(&sizes, &wraps, channels(params, given));
        atlas.thin = thin(pairs, params);
        let ramps: Vec<_> = pairs.iter().map(|pair| pair_ramp(pair, params, atlas.thin)).collect();
        (atlas.deepest, atlas.farthest) = (deepest(&ramps), farthest(&ramps));
        for ((pair, sheet), mut ramp) in pairs.iter().zip(atlas.sheets.clone()).zip(ramps) {
            let size = pair.size();
            ramp.iter_mut().for_each(|value| *value = (*value).clamp(atlas.deepest, atlas.farthest));
            let given: Vec<_> = pair.channels().iter().map(ramp::bytes).collect();
            let at = |texel: IVec2| texel.clamp(IVec2::ZERO, size.as_ivec2() - 1).as_uvec2();
            let index = |texel: UVec2| (texel.y * size.x + texel.x) as usize;
            for y in 0..size.y {
                for x in 0..size.x {
                    let (texel, to) = (UVec2::new(x, y), atlas.index(sheet.place(UVec2::new(x, y))));
                    let [r, g, b, _] = pair.picture().get(x, y).unwrap_or_default();
                    atlas.texels[to] = [r, g, b, ramp[index(texel)]];
                    let extras = &mut atlas.extras[to * atlas.channels..][..atlas.channels];
                    for (out, channel) in extras.iter_mut().zip(&given) {
                        *out = channel[index(texel)];
                    }
                    if params.orientation > 0.0 {
                        let way = ramp::orientation(|texel| ramp[index(at(texel))], texel.as_ivec2());
                        extras[given.len()..].copy_from_slice(&way);
                    }
                }
            }
        }
        atlas.finish();
        atlas
    }

    /// The level of half the size: averages of two by two texels.
    pub(super) fn halved(&self) -> Self {
        let sizes: Vec<_> = self.sheets.iter().map(|sheet| (sheet.size + 1) / 2).collect();
        let wraps: Vec<_> = self.sheets.iter().map(|sheet| sheet.wraps).collect();
        let mut half = Self::empty(&sizes, &wraps, self.channels);
        for (from, to) in self.sheets.iter().zip(half.sheets.clone()) {
            for y in 0..to.size.y {
                for x in 0..to.size.x {
                    let texel = UVec2::new(x, y);
                    let corners = [[0, 0], [1, 0], [0, 1], [1, 1]]
                        .map(|corner| self.index(from.place(2 * texel + UVec2::from(corner))));
                    let at = half.index(to.place(texel));
                    half.texels[at] = mean(corners.map(|corner| self.texels[corner]));
                    for channel in 0..self.channels {
                        let [value] = mean(corners.map(|corner| [self.extras[corner * self.channels + channel]]));
                        half.extras[at * self.channels + channel] = value;
                    }
                }
            }
        }
        half.finish();
        half
    }

    /// Fills the margins and lists the places.
    fn finish(&mut self) {
        let mut count = 0;
        for sheet in self.sheets.clone() {
            count += sheet.size.element_product() as usize;
            let (size, pad) = (sheet.size.as_ivec2(), PAD as i32);
            for y in -pad..size.y + pad {
                let is_inner = (0..size.y).contains(&y);
                for x in -pad..size.x + pad {
                    if is_inner && (0..size.x).contains(&x) {
                        continue;
                    }
                    let texel = IVec2::new(x, y);
                    let from = if sheet.wraps { texel.rem_euclid(size) } else { texel.clamp(IVec2::ZERO, size - 1) };
                    let to = (sheet.min.as_ivec2() + texel).as_usizevec2();
                    let from = self.index(sheet.place(from.as_uvec2()));
                    self.texels[to.y * self.stride + to.x] = self.texels[from];
                }
            }
        }
        self.list(count);
    }

    /// Sorts places by their ramp values: all of them, or every so many of a large photograph.
    fn list(&mut self, count: usize) {
        let every = count.div_ceil(MOST_LISTED).max(1);
        let places: Vec<(u8, Place)> = self
            .sheets
            .iter()
            .flat_map(|sheet| {
                let all = (0..sheet.size.y).flat_map(|y| (0..sheet.size.x).map(move |x| UVec2::new(x, y)));
                // Rows are as long as they are: a step that shares no factor with most of them.
                all.step_by(if every == 1 { 1 } else { every | 1 }).map(|texel| sheet.place(texel))
            })
            .map(|place| (self.texels[self.index(place)][3], place))
            .collect();
        let mut starts = vec![0_u32; 257];
        places.iter().for_each(|(value, _)| starts[usize::from(*value) + 1] += 1);
        for value in 0..256 {
            starts[value + 1] += starts[value];
        }
        let (mut next, mut listed) = (starts.clone(), vec![0; places.len()]);
        for (value, place) in places {
            let slot = &mut next[usize::from(value)];
            listed[*slot as usize] = place;
            *slot += 1;
        }
        let occurs = |value: i32| (0..256).contains(&value) && starts[value as usize] < starts[value as usize + 1];
        let nearest = |value: i32| (0..256).find_map(|off| [value - off, value + off].into_iter().find(|&v| occurs(v)));
        self.occurring = (0..256).map(|value| nearest(value).unwrap_or(0) as u8).collect();
        (self.listed, self.starts) = (listed, starts);
    }

    /// Index of a place in the lists of texels.
    #[inline(always)]
    pub(super) const fn index(&self, place: Place) -> usize {
        (place >> 16) as usize * self.stride + (place & 0xFFFF) as usize
    }

    /// The photograph that a place belongs to.
    #[inline(always)]
    pub(super) fn pair(&self, place: Place) -> usize {
        usize::from(self.sheet_of_row[(place >> 16) as usize])
    }

    /// The place a few texels away, if it is in the same photograph.
    #[inline(always)]
    pub(super) fn moved(&self, place: Place, by: IVec2) -> Option<Place> {
        let sheet = self.sheets[self.pair(place)];
        let at = IVec2::new((place & 0xFFFF) as i32, (place >> 16) as i32) - sheet.min.as_ivec2() + by;
        let size = sheet.size.as_ivec2();
        if at.cmpge(IVec2::ZERO).all() && at.cmplt(size).all() {
            return Some(sheet.place(at.as_uvec2()));
        }
        sheet.wraps.then(|| sheet.place(at.rem_euclid(size).as_uvec2()))
    }

    /// A place whose ramp value is this or the nearest that occurs, by a random number.
    #[inline(always)]
    pub(super) fn alike(&self, value: u8, random: u32) -> Option<Place> {
        let value = usize::from(self.occurring[usize::from(value)]);
        let (start, end) = (self.starts[value], self.starts[value + 1]);
        let index = start + ((u64::from(random) * u64::from(end - start)) >> 32) as u32;
        self.listed.get(index as usize).copied()
    }

    /// The texel of the photograph at a place, and the photograph's index.
    pub(super) fn texel(&self, place: Place) -> (usize, UVec2) {
        let pair = self.pair(place);
        (pair, UVec2::new(place & 0xFFFF, place >> 16) - self.sheets[pair].min)
    }
}

/// The mean of four texels, rounded.
pub(super) fn mean<const N: usize>(texels: [[u8; N]; 4]) -> [u8; N] {
    std::array::from_fn(|channel| {
        let sum: u16 = texels.iter().map(|texel| u16::from(texel[channel])).sum();
        ((sum + 2) / 4) as u8
    })
}
