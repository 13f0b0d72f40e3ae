//! Pieces that break again while they fly.

use super::{Shards, ShatterError, cuts::in_range, drawing::Drawing, faces::Faces};
use crate::math::{Rng, ops};

/// Size classes of pieces: at an impact a piece breaks into pieces of the next smaller class.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SizeClasses {
    /// The largest area of each class, the smallest class first; pattern units squared. A piece above the last value
    /// belongs to one more class. 1e-6..=4096; default 0.001, 0.006 and 0.036.
    pub largest: [f32; 3],
}

impl SizeClasses {
    /// Splinters up to 0.001 of the shorter side squared, pieces up to 0.006, plates up to 0.036.
    pub const DEFAULT: Self = Self { largest: [0.001, 0.006, 0.036] };

    /// The class of a piece of this area; class 0 does not break again.
    #[must_use]
    pub fn class(&self, area: f32) -> u8 {
        self.largest.iter().filter(|&&largest| area > largest).count() as u8
    }

    /// The largest area of the pieces into which a piece of this area breaks; `None` if it does not break.
    #[must_use]
    pub fn next(&self, area: f32) -> Option<f32> {
        self.class(area).checked_sub(1).map(|class| self.largest[class as usize])
    }
}

impl Default for SizeClasses {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// How pieces break again in the air.
///
/// ```
/// use bevy_crack::shatter::BreakAgain;
///
/// let again = BreakAgain::DEFAULT;
/// assert_eq!(again.classes.next(0.1), Some(0.036));
/// assert_eq!(again.due(0.0005, 7), None, "splinters do not break");
/// assert!(BreakAgain { after: 0.0, ..again }.validate().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct BreakAgain {
    /// Which pieces break, and how small. Default: [`SizeClasses::DEFAULT`].
    pub classes: SizeClasses,
    /// Time after its release, or after it broke off itself, at which a piece breaks, seconds, plus or minus a third.
    /// 0.01..=600; default: 0.35.
    pub after: f32,
    /// Speed at which the fragments separate, pattern units a second, 0..=100. Default: 0.15.
    pub apart: f32,
}

impl BreakAgain {
    /// The default.
    pub const DEFAULT: Self = Self { classes: SizeClasses::DEFAULT, after: 0.35, apart: 0.15 };

    /// Checks every field against its range.
    ///
    /// # Errors
    /// [`ShatterError::OutOfRange`] for the first field that is out of its range.
    pub fn validate(&self) -> Result<(), ShatterError> {
        for largest in self.classes.largest {
            in_range("classes", largest, 1e-6, 4096.0)?;
        }
        in_range("after", self.after, 0.01, 600.0)?;
        in_range("apart", self.apart, 0.0, 100.0)
    }

    /// Seconds from a piece's release until it breaks; `None` if a piece of this area does not break.
    #[must_use]
    pub fn due(&self, area: f32, seed: u64) -> Option<f32> {
        let uneven = || 1.0 + Rng::new(seed).stream("due").signed() / 3.0;
        self.classes.next(area).map(|_| self.after * uneven())
    }
}

impl Default for BreakAgain {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A piece is halved at most this many times.
const ROUNDS: u32 = 12;

impl Shards {
    /// Breaks a shard into pieces of at most `largest_area` (pattern units squared), which fill it.
    ///
    /// A piece is cut across its length, at a slightly random angle, until it is small enough or was cut 12 times.
    /// Positions remain those of the surface, and so do texture coordinates.
    ///
    /// ```
    /// use bevy_crack::shatter::{Cuts, ShatterParams, SizeClasses, shatter};
    ///
    /// // A whole pane is of the largest class; its pieces are of the next one.
    /// let classes = SizeClasses::DEFAULT;
    /// let pane = shatter(Cuts::new([1.0, 1.0].into())?, &ShatterParams::DEFAULT)?;
    /// assert_eq!((classes.class(1.0), classes.next(1.0)), (3, Some(0.036)));
    /// let pieces = pane.break_again(0, 0.036, 7)?;
    /// assert!(pieces.len() >= 28 && pieces.iter().all(|piece| classes.class(piece.area) < 3));
    /// let area: f32 = pieces.iter().map(|piece| piece.area).sum();
    /// assert!((area - 1.0).abs() < 1e-4);
    /// # Ok::<(), bevy_crack::shatter::ShatterError>(())
    /// ```
    ///
    /// # Errors
    /// [`ShatterError::NoShard`] if there is no such shard, [`ShatterError::OutOfRange`] if the area is not within
    /// 1e-6..=4096.
    pub fn break_again(&self, shard: u32, largest_area: f32, seed: u64) -> Result<Self, ShatterError> {
        in_range("largest_area", largest_area, 1e-6, 4096.0)?;
        if self.get(shard).is_none() {
            return Err(ShatterError::NoShard { shard });
        }
        let mut drawing = Drawing::new(self.lattice);
        for ring in self.rings_of(shard) {
            let closed = ring.iter().chain(&ring[..1]);
            drawing.line(closed.map(|&corner| self.positions()[corner as usize]));
        }
        drawing.make_planar();
        let mut rng = Rng::new(seed).stream("break again").substream(u64::from(shard));
        let mut round = 0;
        loop {
            let mut faces = Faces::trace(&mut drawing);
            let mut pieces = Self::new(&drawing, &faces, Vec::new());
            let mut inside = self.inside(shard, &pieces);
            let splinter = 0.02 * f64::from(largest_area) * 2.0 * self.lattice.scale * self.lattice.scale;
            if faces.join_small(&mut drawing, splinter as i64, usize::MAX, |face| inside[face as usize]) {
                faces = Faces::trace(&mut drawing);
                pieces = Self::new(&drawing, &faces, Vec::new());
                inside = self.inside(shard, &pieces);
            }
            let large: Vec<u32> = (0..pieces.len() as u32)
                .filter(|&piece| inside[piece as usize] && pieces.shards[piece as usize].area > largest_area)
                .collect();
            if large.is_empty() || round == ROUNDS {
                pieces.retain(&inside);
                return Ok(pieces);
            }
            drawing.cut_across(large.into_iter().filter_map(|piece| {
                let from = pieces.inner_point(piece)?;
                let askew = 0.4 * rng.signed();
                let across = pieces.axis(piece) + std::f32::consts::FRAC_PI_2 + askew;
                let own = u64::from(rng.next_u32());
                Some((from, ops::unit(across), rng.substream(own)))
            }));
            drawing.make_planar();
            round += 1;
        }
    }

    fn inside(&self, shard: u32, pieces: &Self) -> Vec<bool> {
        let inner = (0..pieces.len() as u32).map(|piece| pieces.inner_place(piece));
        inner.map(|place| place.is_some_and(|place| self.contains_place(shard, place))).collect()
    }

    /// The direction of a shard's length, radians: the main axis of its corners.
    fn axis(&self, shard: u32) -> f32 {
        let Some(centroid) = self.get(shard).map(|shard| shard.centroid) else { return 0.0 };
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for &corner in self.outline(shard) {
            let arm = self.positions()[corner as usize] - centroid;
            xx += arm.x * arm.x;
            xy += arm.x * arm.y;
            yy += arm.y * arm.y;
        }
        0.5 * ops::atan2(2.0 * xy, xx - yy)
    }
}
