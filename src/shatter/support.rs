//! [`Support`]: which shards are held, and which fall.

use super::{Shards, ShatterError, cuts::in_range};
use glam::Vec2;

/// What holds a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Anchor {
    /// Nothing: pieces stay in their places until they are hit.
    Nothing,
    /// The whole border, as a pane in its frame.
    #[default]
    Border,
    /// These sides: left, right, top, bottom.
    Sides([bool; 4]),
}

/// Which shards are still in their places, and which of them are held.
///
/// A held shard holds its neighbours, and so on; shards that are no longer held fall.
///
/// ```
/// use bevy_crack::shatter::{Anchor, Cuts, Fallen, ShatterParams, Support, shatter};
///
/// // Three shelves; only the top is fixed.
/// let mut cuts = Cuts::new([1.0, 1.0].into())?;
/// cuts.add_line(&[[0.0, 0.3].into(), [1.0, 0.3].into()])?;
/// cuts.add_line(&[[0.0, 0.6].into(), [1.0, 0.6].into()])?;
/// let shards = shatter(cuts, &ShatterParams::DEFAULT)?;
/// let mut support = Support::new(&shards, Anchor::Sides([false, false, true, false]));
/// let Fallen { hit, loose } = support.hit(&shards, [0.5, 0.45].into(), 0.1)?;
/// let number = |y: f32| shards.at([0.5, y].into()).into_iter().collect::<Vec<u32>>();
/// assert_eq!((hit, loose), (number(0.45), number(0.8)));
/// # Ok::<(), bevy_crack::shatter::ShatterError>(())
/// ```
///
/// Shards can be held, removed and put back one by one, and hit by distances of your own:
///
/// ```
/// # use bevy_crack::shatter::{Anchor, Cuts, ShatterParams, Support, shatter};
/// // Four squares in a row, held at the left: a shelf.
/// let mut cuts = Cuts::new([4.0, 1.0].into())?;
/// for x in [1.0, 2.0, 3.0] {
///     cuts.add_line(&[[x, 0.0].into(), [x, 1.0].into()])?;
/// }
/// let shards = shatter(cuts, &ShatterParams::DEFAULT)?;
/// let mut shelf = Support::new(&shards, Anchor::Sides([true, false, false, false]));
/// // Without the second square the two beyond it fall.
/// assert_eq!(shelf.take(&shards, 1), [2, 3]);
/// assert_eq!(shelf.missing().collect::<Vec<_>>(), [1, 2, 3]);
/// shelf.put_back(1);
/// assert!(shelf.is_in_place(1));
///
/// // A post under the last square: it no longer falls.
/// shelf.restore();
/// shelf.hold_shards([3]);
/// assert_eq!(shelf.take(&shards, 1), [0; 0]);
/// // A blow from below that reaches the third square only.
/// let fallen = shelf.hit_by(&shards, 0.5, |shard| if shard == 2 { 0.2 } else { 0.9 })?;
/// assert_eq!((fallen.hit, fallen.loose), (vec![2], vec![]));
///
/// // A square that the game removes itself: nothing falls before it is asked for.
/// let mut shelf = Support::from_mask(&shards, |pos| pos.x < 0.1);
/// shelf.remove([2]);
/// assert!(shelf.is_in_place(3));
/// assert_eq!(shelf.drop_loose(&shards), [3]);
/// // The same squares in their places, held by nothing, then at the left again.
/// let mut loose = shelf.held_by(&shards, Anchor::Nothing);
/// assert_eq!(loose.missing().collect::<Vec<_>>(), [2, 3]);
/// loose.hold(&shards, |pos| pos.x < 0.1);
/// assert_eq!(loose, shelf);
/// # Ok::<(), bevy_crack::shatter::ShatterError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Support {
    anchored: Vec<bool>,
    gone: Vec<bool>,
}

/// The shards that a hit has released.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Fallen {
    /// Shards that the hit knocked out, by number.
    pub hit: Vec<u32>,
    /// Shards that are no longer held, by number.
    pub loose: Vec<u32>,
}

impl Support {
    /// All shards in their places; those along the anchor are held.
    #[must_use]
    pub fn new(shards: &Shards, anchor: Anchor) -> Self {
        let sides = match anchor {
            Anchor::Nothing => [false; 4],
            Anchor::Border => [true; 4],
            Anchor::Sides(sides) => sides,
        };
        let anchored = shards.iter().map(|shard| (0..4).any(|side| sides[side] && shard.border[side] > 0.0)).collect();
        Self { anchored, gone: vec![false; shards.len()] }
    }

    /// All shards in their places; a shard is held if `held` is `true` for one of its corners or its centre (pattern
    /// units).
    #[must_use]
    pub fn from_mask(shards: &Shards, mut held: impl FnMut(Vec2) -> bool) -> Self {
        let anchored = (0u32..).zip(shards.iter()).map(|(i, shard)| {
            held(shard.centroid) || shards.corners(i).iter().any(|&corner| held(shards.positions()[corner as usize]))
        });
        Self { anchored: anchored.collect(), gone: vec![false; shards.len()] }
    }

    /// Holds those shards as well of which a corner or the centre lies where `held` says so (pattern units).
    pub fn hold(&mut self, shards: &Shards, held: impl FnMut(Vec2) -> bool) {
        let more = Self::from_mask(shards, held);
        self.anchored.iter_mut().zip(more.anchored).for_each(|(anchored, more)| *anchored |= more);
    }

    /// The same shards in their places, with another anchor.
    #[must_use]
    pub fn held_by(&self, shards: &Shards, anchor: Anchor) -> Self {
        Self { gone: self.gone.clone(), ..Self::new(shards, anchor) }
    }

    /// The support of a surface that has been cracked further: shards that lie where an old shard was missing are
    /// missing too.
    ///
    /// ```
    /// use bevy_crack::shatter::{Anchor, Cuts, ShatterParams, Support, shatter};
    ///
    /// let halves = |lines: &[f32]| {
    ///     let mut cuts = Cuts::new([2.0, 1.0].into())?;
    ///     for &x in lines {
    ///         cuts.add_line(&[[x, 0.0].into(), [x, 1.0].into()])?;
    ///     }
    ///     shatter(cuts, &ShatterParams::DEFAULT)
    /// };
    /// let (old, new) = (halves(&[1.0])?, halves(&[0.5, 1.0])?);
    /// let mut support = Support::new(&old, Anchor::Border);
    /// support.remove([0]);
    /// // The left half is missing, so both of its parts are.
    /// let support = support.after_new_cracks(&old, &new, Anchor::Border);
    /// assert_eq!(support.missing().collect::<Vec<_>>(), [0, 1]);
    /// # Ok::<(), bevy_crack::shatter::ShatterError>(())
    /// ```
    #[must_use]
    pub fn after_new_cracks(&self, old: &Shards, new: &Shards, anchor: Anchor) -> Self {
        let mut support = Self::new(new, anchor);
        let mut holes: Vec<(f64, f64, u32)> = self.missing().map(|shard| span(old, shard)).collect();
        holes.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        for shard in 0..new.len() as u32 {
            let Some(at) = new.inner_place(shard) else { continue };
            let up_to = holes.partition_point(|hole| hole.0 <= at.x);
            support.gone[shard as usize] =
                holes[..up_to].iter().any(|&(_, right, hole)| at.x <= right && old.contains_place(hole, at));
        }
        support
    }

    /// Whether a shard is in its place.
    #[must_use]
    pub fn is_in_place(&self, shard: u32) -> bool {
        self.gone.get(shard as usize).is_some_and(|gone| !gone)
    }

    /// Shards that are no longer in their places, by number.
    pub fn missing(&self) -> impl Iterator<Item = u32> + '_ {
        (0u32..).zip(&self.gone).filter(|(_, gone)| **gone).map(|(shard, _)| shard)
    }

    /// Puts every shard back.
    pub fn restore(&mut self) {
        self.gone.fill(false);
    }

    /// Puts one shard back.
    pub fn put_back(&mut self, shard: u32) {
        if let Some(gone) = self.gone.get_mut(shard as usize) {
            *gone = false;
        }
    }

    /// Removes one shard, and returns the shards that are no longer held.
    pub fn take(&mut self, shards: &Shards, shard: u32) -> Vec<u32> {
        if let Some(gone) = self.gone.get_mut(shard as usize) {
            *gone = true;
        }
        self.drop_loose(shards)
    }

    /// Knocks out the shards within `reach` of a position (pattern units), and drops the shards that are no longer
    /// held.
    ///
    /// A shard along the anchor stays in its frame unless it is hit itself.
    ///
    /// # Errors
    /// [`ShatterError::NotFinite`] if the position is not finite, [`ShatterError::OutOfRange`] if `reach` is not
    /// within 0..=64.
    pub fn hit(&mut self, shards: &Shards, at: Vec2, reach: f32) -> Result<Fallen, ShatterError> {
        in_range("reach", reach, 0.0, 64.0)?;
        if !at.is_finite() {
            return Err(ShatterError::NotFinite { index: 0 });
        }
        self.hit_by(shards, reach, |shard| shards.distance(shard, at))
    }

    /// The same as [`hit`](Self::hit) with distances that are measured in another way, as through space. `distance` gives that of a shard, by
    /// number, in the unit of `reach`; it is asked of those in their places only. What is not a number is out of reach.
    ///
    /// # Errors
    /// [`ShatterError::OutOfRange`] if `reach` is not within 0..=64.
    pub fn hit_by(
        &mut self,
        shards: &Shards,
        reach: f32,
        mut distance: impl FnMut(u32) -> f32,
    ) -> Result<Fallen, ShatterError> {
        in_range("reach", reach, 0.0, 64.0)?;
        let mut hit = Vec::new();
        for shard in 0..self.gone.len().min(shards.len()) as u32 {
            let distance = if self.is_in_place(shard) { distance(shard) } else { f32::INFINITY };
            if distance <= if self.anchored[shard as usize] { 0.0 } else { reach } {
                hit.push(shard);
                self.gone[shard as usize] = true;
            }
        }
        Ok(Fallen { hit, loose: self.drop_loose(shards) })
    }

    /// Holds these shards as well, by number; those that there are not do not count.
    pub fn hold_shards(&mut self, shards: impl IntoIterator<Item = u32>) {
        for shard in shards {
            if let Some(anchored) = self.anchored.get_mut(shard as usize) {
                *anchored = true;
            }
        }
    }

    /// Removes shards, by number; nothing falls for that, and those that there are not do not count.
    pub fn remove(&mut self, shards: impl IntoIterator<Item = u32>) {
        for shard in shards {
            if let Some(gone) = self.gone.get_mut(shard as usize) {
                *gone = true;
            }
        }
    }

    /// Removes the shards that no anchored shard holds, and returns them by number. Without anchored shards nothing
    /// falls by itself.
    pub fn drop_loose(&mut self, shards: &Shards) -> Vec<u32> {
        if !self.anchored.contains(&true) {
            return Vec::new();
        }
        let mut held: Vec<bool> =
            self.anchored.iter().zip(&self.gone).map(|(anchored, gone)| *anchored && !gone).collect();
        let mut open: Vec<u32> = (0u32..).zip(&held).filter(|(_, held)| **held).map(|(shard, _)| shard).collect();
        while let Some(shard) = open.pop() {
            for neighbour in shards.neighbours(shard) {
                if self.is_in_place(neighbour.shard) && !std::mem::replace(&mut held[neighbour.shard as usize], true) {
                    open.push(neighbour.shard);
                }
            }
        }
        let loose: Vec<u32> =
            (0..held.len() as u32).filter(|&shard| self.is_in_place(shard) && !held[shard as usize]).collect();
        for &shard in &loose {
            self.gone[shard as usize] = true;
        }
        loose
    }
}

/// Left and right end of a shard on the lattice, and its number.
fn span(shards: &Shards, shard: u32) -> (f64, f64, u32) {
    let ends = shards.outline(shard).iter().map(|&corner| f64::from(shards.places[corner as usize][0]));
    let (left, right) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    (left, right, shard)
}
