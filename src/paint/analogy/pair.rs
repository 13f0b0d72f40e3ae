//! [`AnalogyPair`]: a photograph of a cracked material and the guide that tells where its cracks are.

use super::{error::AnalogyError, flatten::flatten};
use crate::{
    Grid,
    pattern::{self, CrackMask},
};
use glam::UVec2;

/// Shortest side of a photograph, texels.
pub const MIN_EXAMPLE_SIDE: u32 = 16;

/// Longest side of a photograph, texels.
pub const MAX_EXAMPLE_SIDE: u32 = 8192;

/// The largest number of further channels of a guide.
pub const MAX_CHANNELS: usize = 6;

/// A guide `A` and a photograph `A'` (Hertzmann et al. 2001; Mould 2005, section 5.1).
///
/// ```
/// use bevy_crack::{Grid, paint::analogy::{AnalogyError, AnalogyPair}};
///
/// // A grey wall of 32 x 32 texels with a dark crack in column 12.
/// let shade = |i: usize| if i % 32 == 12 { 20 } else { 128 };
/// let photo: Vec<u8> = (0..32 * 32).flat_map(|i| [shade(i), shade(i), shade(i), 255]).collect();
/// let pair = AnalogyPair::from_darkness([32, 32].into(), &photo, 0.2)?;
/// assert_eq!(pair.cracks().get(12, 7), Some(1.0));
/// assert_eq!(pair.cracks().get(13, 7), Some(0.0));
/// # Ok::<(), AnalogyError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct AnalogyPair {
    picture: Grid<[u8; 4]>,
    cracks: Grid<f32>,
    channels: Vec<Grid<f32>>,
    is_tileable: bool,
}

impl AnalogyPair {
    /// A pair from RGBA texels (sRGB, row after row) and a guide of the same size: how much each texel is crack, 0..=1.
    ///
    /// # Errors
    /// [`AnalogyError`] if a side is out of range, the bytes do not match the size, or the guide has another size or a
    /// value that is not finite.
    pub fn new(size: UVec2, rgba: &[u8], cracks: Grid<f32>) -> Result<Self, AnalogyError> {
        Self::check(size, rgba.len())?;
        check_channel("cracks", &cracks, size)?;
        let misfit = AnalogyError::PictureSize { width: size.x, height: size.y, bytes: rgba.len() };
        let picture = Grid::from_vec(size, rgba.as_chunks::<4>().0.to_vec()).ok_or(misfit)?;
        Ok(Self { picture, cracks, channels: Vec::new(), is_tileable: false })
    }

    /// A pair whose guide is the lines that stand out from the photograph:
    /// [`CrackMask::weak_from_picture`], with half its range or more as crack.
    ///
    /// ```
    /// use bevy_crack::paint::analogy::{AnalogyError, AnalogyPair};
    ///
    /// // Dark tiles of 64 texels with light joints.
    /// let size = 256;
    /// let shade = |i: u32| if (i % size) % 64 < 4 || (i / size) % 64 < 4 { 220 } else { 60 };
    /// let photo: Vec<u8> = (0..size * size).flat_map(|i| [shade(i), shade(i), shade(i), 255]).collect();
    /// let pair = AnalogyPair::from_lines([size, size].into(), &photo)?;
    /// assert_eq!((pair.cracks().get(66, 32), pair.cracks().get(96, 32)), (Some(1.0), Some(0.0)));
    /// let even = [128; 64 * 64 * 4];
    /// assert_eq!(AnalogyPair::from_lines([64, 64].into(), &even), Err(AnalogyError::NoLines));
    /// # Ok::<(), AnalogyError>(())
    /// ```
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`AnalogyError::NoLines`] if none stand out.
    pub fn from_lines(size: UVec2, rgba: &[u8]) -> Result<Self, AnalogyError> {
        Self::check(size, rgba.len())?;
        let misfit = |_| AnalogyError::PictureSize { width: size.x, height: size.y, bytes: rgba.len() };
        let lines = CrackMask::weak_from_picture(size, rgba).map_err(misfit)?.ok_or(AnalogyError::NoLines)?;
        let mask = CrackMask { weak: Some(lines), ..CrackMask::default() };
        let is_crack = |x, y| {
            let value = mask.weak_at((UVec2::new(x, y).as_vec2() + 0.5) / size.as_vec2());
            if value >= 0.5 { 1.0 } else { 0.0 }
        };
        let cracks = (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))).map(|(x, y)| is_crack(x, y)).collect();
        Self::new(size, rgba, Grid::from_vec(size, cracks).ok_or(AnalogyError::NoLines)?)
    }

    /// A pair whose guide is what is darker than `lightness`, 0..=1 as stored.
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`AnalogyError::OutOfRange`] if `lightness` is not in 0..=1.
    pub fn from_darkness(size: UVec2, rgba: &[u8], lightness: f32) -> Result<Self, AnalogyError> {
        Self::check(size, rgba.len())?;
        if !(0.0..=1.0).contains(&lightness) {
            return Err(AnalogyError::OutOfRange { name: "lightness", value: lightness, min: 0.0, max: 1.0 });
        }
        let is_crack = |&texel: &[u8; 4]| if pattern::lightness(texel) < lightness { 1.0 } else { 0.0 };
        let cracks = rgba.as_chunks::<4>().0.iter().map(is_crack).collect();
        let misfit = AnalogyError::PictureSize { width: size.x, height: size.y, bytes: rgba.len() };
        Self::new(size, rgba, Grid::from_vec(size, cracks).ok_or(misfit)?)
    }

    /// Adds a channel to the guide: 0..=1 for each texel of the photograph, for what cracks do not tell, such as wet or
    /// dry. All pairs of an analogy and its surface must have the same channels.
    ///
    /// # Errors
    /// [`AnalogyError`] if the channel has another size than the photograph, a value that is not finite, or if there
    /// are [`MAX_CHANNELS`] already.
    pub fn with_channel(mut self, channel: Grid<f32>) -> Result<Self, AnalogyError> {
        check_channel("channel", &channel, self.size())?;
        let count = self.channels.len() + 1;
        if count > MAX_CHANNELS {
            return Err(AnalogyError::ChannelCount { count, expected: self.channels.len(), most: MAX_CHANNELS });
        }
        self.channels.push(channel);
        Ok(self)
    }

    /// The photograph can be repeated without seams: what is copied may run across its borders.
    ///
    /// ```
    /// use bevy_crack::{Grid, paint::analogy::AnalogyPair};
    ///
    /// // A photograph without seams, with a light joint in column 8 and uneven light from left to right.
    /// let size = [64, 64].into();
    /// let shade = |i: u32| if i % 64 == 8 { 220 } else { 60 + (i % 64) as u8 };
    /// let photo: Vec<u8> = (0..64 * 64).flat_map(|i| [shade(i), shade(i), shade(i), 255]).collect();
    /// let wet = Grid::new(size, 0.5);
    /// let cracks = Grid::from_vec(size, (0..64 * 64).map(|i| f32::from(i % 64 == 8)).collect()).unwrap();
    /// let pair = AnalogyPair::new(size, &photo, cracks)?.with_channel(wet)?.tileable().flattened(8)?;
    /// assert!(pair.is_tileable());
    /// assert_eq!((pair.size(), pair.channels().len()), (size, 1));
    /// // The slope of the light is gone.
    /// let [dark, light] = [24, 40].map(|x| pair.picture().get(x, 30).unwrap()[0]);
    /// assert!(light.abs_diff(dark) < 4);
    /// # Ok::<(), bevy_crack::paint::analogy::AnalogyError>(())
    /// ```
    #[must_use]
    pub const fn tileable(mut self) -> Self {
        self.is_tileable = true;
        self
    }

    /// Takes slow shading out of the photograph, such as that of uneven light, which would turn into patches: from each
    /// texel the mean of those within about `radius` texels around it, plus the mean of all. Call it after
    /// [`tileable`](Self::tileable).
    ///
    /// What is copied then is the photograph without its shading, [`picture`](Self::picture).
    ///
    /// # Errors
    /// [`AnalogyError::OutOfRange`] if `radius` is not in 4..=512.
    pub fn flattened(mut self, radius: u32) -> Result<Self, AnalogyError> {
        if !(4..=512).contains(&radius) {
            return Err(AnalogyError::OutOfRange { name: "radius", value: radius as f32, min: 4.0, max: 512.0 });
        }
        self.picture = flatten(&self.picture, radius, self.is_tileable);
        Ok(self)
    }

    /// Size of the photograph, texels.
    #[must_use]
    pub const fn size(&self) -> UVec2 {
        self.picture.size()
    }

    /// The photograph, RGBA8, sRGB.
    #[must_use]
    pub const fn picture(&self) -> &Grid<[u8; 4]> {
        &self.picture
    }

    /// How much each texel is crack, 0..=1.
    #[must_use]
    pub const fn cracks(&self) -> &Grid<f32> {
        &self.cracks
    }

    /// The further channels of the guide, 0..=1.
    #[must_use]
    pub fn channels(&self) -> &[Grid<f32>] {
        &self.channels
    }

    /// Whether what is copied may run across the borders.
    #[must_use]
    pub const fn is_tileable(&self) -> bool {
        self.is_tileable
    }

    /// Whether a texel is crack at all, and at least `depth`.
    pub(super) fn is_crack(&self, x: u32, y: u32, depth: f32) -> bool {
        self.cracks.get(x, y).is_some_and(|value| value > 0.0 && value >= depth)
    }

    fn check(size: UVec2, bytes: usize) -> Result<(), AnalogyError> {
        let (width, height) = (size.x, size.y);
        if size.min_element() < MIN_EXAMPLE_SIDE || size.max_element() > MAX_EXAMPLE_SIDE {
            return Err(AnalogyError::ExampleSize { width, height, least: MIN_EXAMPLE_SIDE, most: MAX_EXAMPLE_SIDE });
        }
        if bytes != size.x as usize * size.y as usize * 4 {
            return Err(AnalogyError::PictureSize { width, height, bytes });
        }
        Ok(())
    }
}

/// Checks that a channel has this size and only finite values.
pub(super) fn check_channel(name: &'static str, channel: &Grid<f32>, size: UVec2) -> Result<(), AnalogyError> {
    check_size(name, channel.size(), size)?;
    match channel.as_slice().iter().position(|value| !value.is_finite()) {
        Some(at) => {
            let at = at as u32;
            Err(AnalogyError::NotFinite { name, x: at % size.x, y: at / size.x })
        }
        None => Ok(()),
    }
}

pub(super) fn check_size(name: &'static str, size: UVec2, expected: UVec2) -> Result<(), AnalogyError> {
    if size == expected {
        return Ok(());
    }
    let (expected_width, expected_height) = (expected.x, expected.y);
    Err(AnalogyError::SizesDiffer { name, width: size.x, height: size.y, expected_width, expected_height })
}
