//! [`Past`]: what has happened to a growth, from which the same cracks grow again.

use super::{impact::HitOutcome, state::CrackGrowth};
use glam::Vec2;

/// What has happened to a [`CrackGrowth`]: enough to grow the same cracks again, bit for bit.
///
/// It is small, for the cracks themselves are not in it: twelve bytes for each hit, however much has grown from it. That is what
/// a saved game keeps of a surface, and what a replay is made of. Parameters, seed, mask, density and
/// [added cracks](CrackGrowth::add_cracks) are not in it either; those of the new growth count.
///
/// ```
/// use bevy_crack::{CrackPreset, growth::{CrackGrowth, Past, PastError, PastEvent}};
/// use glam::Vec2;
///
/// let grow = || CrackGrowth::new(CrackPreset::GLASS.growth, Vec2::ONE, 7);
/// let mut growth = grow()?;
/// growth.hit(Vec2::new(0.3, 0.4), 1.0);
/// for _ in 0..20 {
///     growth.step();
/// }
/// growth.hit(Vec2::new(0.7, 0.6), 2.0);
/// for _ in 0..20 {
///     growth.step();
/// }
/// let past = growth.past().ok_or("it was hit too often")?;
///
/// let mut again = grow()?;
/// again.replay(&past);
/// assert_eq!(again.network().nodes(), growth.network().nodes());
///
/// // Two hits, the second after twenty steps. If the same happens twice, there are four.
/// assert_eq!(past.events.iter().map(PastEvent::after).collect::<Vec<u32>>(), [0, 20]);
/// let both = past.followed_by(&past);
/// assert_eq!((both.events.len(), both.steps, both.is_empty()), (4, 2 * past.steps, false));
/// // One that was read from a file should be checked.
/// let cut = Past { steps: 10, ..past };
/// assert_eq!(cut.validate(), Err(PastError::Order(1)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Past {
    /// Width and height of the surface, pattern units. The events are stretched over a surface of another extent.
    pub extent: Vec2,
    /// What has happened, in order.
    pub events: Vec<PastEvent>,
    /// How many steps were made in all: calls of [`CrackGrowth::step`] while it was growing.
    pub steps: u32,
}

/// Something that has happened to a growth, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PastEvent {
    /// A [`hit`](CrackGrowth::hit) that started or fed a crack.
    Hit {
        /// How many steps were made before it.
        after: u32,
        /// Where, pattern units.
        pos: Vec2,
        /// How hard, above 0; 1 = an ordinary hit.
        energy: f32,
    },
    /// The oldest nodes were [removed](CrackGrowth::remove_oldest).
    Removal {
        /// How many steps were made before it.
        after: u32,
        /// How many of the newest nodes were left at most.
        keep: u32,
    },
}

/// Why a [`Past`] cannot be that of a growth.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PastError {
    /// There are more events than [`Past::MAX_EVENTS`].
    #[error("there are {0} events, more than {max}", max = Past::MAX_EVENTS)]
    TooMany(usize),
    /// The extent is not within 0.0001..=64.
    #[error("the extent is {0}, not within 0.0001..=64")]
    Extent(Vec2),
    /// A hit is off the surface, or its energy is not a finite number above 0.
    #[error("event {0} is a hit off the surface, or its energy is not a finite number above 0")]
    Hit(usize),
    /// An event comes before the one before it, or after the end.
    #[error("event {0} comes before the one before it, or after the end")]
    Order(usize),
}

impl PastEvent {
    /// How many steps were made before it.
    #[must_use]
    pub const fn after(&self) -> u32 {
        match self {
            Self::Hit { after, .. } | Self::Removal { after, .. } => *after,
        }
    }
}

impl Past {
    /// The most events that a growth remembers, and that can be replayed.
    pub const MAX_EVENTS: usize = 1 << 14;

    /// Whether nothing has happened.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.events.is_empty()
    }

    /// Checks it, for one that was read from a file.
    ///
    /// # Errors
    /// The first thing that is wrong with it, see [`PastError`].
    pub fn validate(&self) -> Result<(), PastError> {
        if self.events.len() > Self::MAX_EVENTS {
            return Err(PastError::TooMany(self.events.len()));
        }
        if !self.extent.to_array().iter().all(|side| (1e-4..=64.0).contains(side)) {
            return Err(PastError::Extent(self.extent));
        }
        let mut last = 0;
        for (index, event) in self.events.iter().enumerate() {
            if let PastEvent::Hit { pos, energy, .. } = event {
                let is_within = pos.cmpge(Vec2::ZERO).all() && pos.cmple(self.extent).all();
                if !is_within || !energy.is_finite() || *energy <= 0.0 {
                    return Err(PastError::Hit(index));
                }
            }
            if event.after() < last || event.after() > self.steps {
                return Err(PastError::Order(index));
            }
            last = event.after();
        }
        Ok(())
    }

    /// The past of a surface on which `later` has happened after this.
    #[must_use]
    pub fn followed_by(&self, later: &Self) -> Self {
        let stretch = later.stretch(self.extent);
        let shifted = later.events.iter().map(|event| {
            let after = event.after().saturating_add(self.steps);
            match *event {
                PastEvent::Hit { pos, energy, .. } => PastEvent::Hit { after, pos: stretch(pos), energy },
                PastEvent::Removal { keep, .. } => PastEvent::Removal { after, keep },
            }
        });
        Self {
            extent: self.extent,
            events: self.events.iter().copied().chain(shifted).collect(),
            steps: self.steps.saturating_add(later.steps),
        }
    }

    /// Puts positions on a surface of another extent; on the same extent they keep their bits.
    fn stretch(&self, extent: Vec2) -> impl Fn(Vec2) -> Vec2 + use<> {
        let own = self.extent;
        move |pos| if own == extent { pos } else { (pos / own * extent).min(extent) }
    }
}

/// The events of a growth as it goes on.
#[derive(Clone, Debug, Default)]
pub(super) struct Record {
    events: Vec<PastEvent>,
    /// Calls of `step` that may have changed something.
    pub(super) steps: u32,
    /// Whether there were more events than are kept.
    is_cut: bool,
}

impl Record {
    fn push(&mut self, event: PastEvent) {
        if self.events.len() < Past::MAX_EVENTS {
            self.events.push(event);
        } else {
            // A part of the past is of no use, and takes memory.
            self.is_cut = true;
            self.events = Vec::new();
        }
    }

    pub(super) fn hit(&mut self, pos: Vec2, energy: f32, outcome: &HitOutcome) {
        if matches!(outcome, HitOutcome::Started(_) | HitOutcome::Merged(_)) {
            self.push(PastEvent::Hit { after: self.steps, pos, energy });
        }
    }

    pub(super) fn removal(&mut self, keep: u32) {
        self.push(PastEvent::Removal { after: self.steps, keep });
    }

    pub(super) const fn step(&mut self) {
        self.steps = self.steps.saturating_add(1);
    }
}

impl CrackGrowth {
    /// What has happened so far; `None` if that is more than [`Past::MAX_EVENTS`].
    #[must_use]
    pub fn past(&self) -> Option<Past> {
        let Record { events, steps, is_cut } = &self.record;
        (!is_cut).then(|| Past { extent: self.network.extent(), events: events.clone(), steps: *steps })
    }

    /// How many steps were made: calls of [`step`](Self::step) while it was growing. Unlike [`steps`](Self::steps) it counts
    /// no steps of [added cracks](Self::add_cracks).
    #[must_use]
    pub const fn steps_made(&self) -> u32 {
        self.record.steps
    }

    /// Lets the same happen again: hits, removals and steps. With the same parameters, extent, seed, mask, density and
    /// [added cracks](Self::add_cracks) the outcome has the same bits.
    pub fn replay(&mut self, past: &Past) {
        self.replay_with(past, |growth, keep| _ = growth.remove_oldest(keep));
    }

    /// Like [`replay`](Self::replay), but leaves it to `remove` to call [`remove_oldest`](Self::remove_oldest) with the number of
    /// nodes to keep: what goes can be drawn before.
    ///
    /// ```
    /// use bevy_crack::growth::{CrackGrowth, GrowthParams};
    ///
    /// let begin = || CrackGrowth::new(GrowthParams::DEFAULT, [1.0, 1.0].into(), 7);
    /// let mut growth = begin()?;
    /// growth.hit([0.3, 0.4].into(), 1.0);
    /// while growth.step().grew() {}
    /// growth.remove_oldest(20);
    /// let mut again = begin()?;
    /// again.replay_with(&growth.past().expect("few hits"), |growth, keep| {
    ///     assert!(growth.network().nodes().len() > 20, "a game draws these now");
    ///     growth.remove_oldest(keep);
    /// });
    /// assert_eq!(again.network(), growth.network());
    /// # Ok::<(), bevy_crack::growth::ParamError>(())
    /// ```
    pub fn replay_with(&mut self, past: &Past, mut remove: impl FnMut(&mut Self, u32)) {
        let (stretch, before) = (past.stretch(self.network.extent()), self.steps_made());
        for event in &past.events {
            self.step_until(before.saturating_add(event.after()));
            match *event {
                PastEvent::Hit { pos, energy, .. } => _ = self.hit(stretch(pos), energy),
                PastEvent::Removal { keep, .. } => remove(self, keep),
            }
        }
        self.step_until(before.saturating_add(past.steps));
    }

    fn step_until(&mut self, steps: u32) {
        while self.steps_made() < steps && self.is_growing() {
            self.step();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CrackPreset, growth::GrowthParams, math::Rng};

    fn unit(rng: &mut Rng) -> Vec2 {
        Vec2::new(rng.unit(), rng.unit())
    }

    /// Random hits, steps and removals on every preset, with few nodes so that there is something to remove.
    #[test]
    fn what_is_replayed_has_the_same_bits_and_goes_on_alike() {
        let mut rng = Rng::new(91);
        for name in CrackPreset::NAMES {
            for seed in 0..3 {
                let params = GrowthParams { max_nodes: 900, ..CrackPreset::named(name).unwrap().growth };
                let extent = Vec2::new(1.0, 1.0 + rng.unit());
                let mut growth = CrackGrowth::new(params.clone(), extent, seed).unwrap();
                for _ in 0..8 {
                    if growth.nodes_left() < 225 {
                        growth.remove_oldest(450);
                    }
                    growth.hit(unit(&mut rng) * extent, 0.1 + rng.unit());
                    // Hits off the surface and without energy leave no trace.
                    growth.hit(Vec2::splat(9.0), 1.0);
                    growth.hit(unit(&mut rng), 0.0);
                    for _ in 0..rng.next_u32() % 40 {
                        growth.step();
                    }
                }
                let past = growth.past().unwrap();
                assert_eq!(past.validate(), Ok(()), "{name} {seed}");
                let mut again = CrackGrowth::new(params, extent, seed).unwrap();
                again.replay(&past);
                for at in [None, Some(unit(&mut rng) * extent)] {
                    if let Some(at) = at {
                        assert_eq!(growth.hit(at, 0.7), again.hit(at, 0.7));
                        (0..30).for_each(|_| assert_eq!(growth.step(), again.step()));
                    }
                    assert_eq!(again.network().nodes(), growth.network().nodes(), "{name} {seed}");
                    assert_eq!(again.network().links(), growth.network().links(), "{name} {seed}");
                    assert_eq!(again.marker_counts(), growth.marker_counts(), "{name} {seed}");
                    assert_eq!(again.steps(), growth.steps(), "{name} {seed}");
                    assert_eq!(again.past(), growth.past(), "{name} {seed}");
                }
            }
        }
    }

    #[test]
    fn a_past_is_replayed_around_cracks_that_were_added_and_after_another() {
        let params = GrowthParams { arrest: 0.05, reach: 0.3, ..GrowthParams::DEFAULT };
        let mut foreign = CrackGrowth::new(params.clone(), Vec2::ONE, 3).unwrap();
        foreign.hit(Vec2::splat(0.5), 1.0);
        while foreign.step().grew() {}
        let begin = || {
            let mut growth = CrackGrowth::new(params.clone(), Vec2::ONE, 5).unwrap();
            growth.add_cracks(foreign.network(), 4);
            growth
        };
        let hit = |growth: &mut CrackGrowth, x: f32, steps: usize| {
            growth.hit(Vec2::new(x, 0.2), 1.0);
            (0..steps).for_each(|_| _ = growth.step());
        };
        let mut growth = begin();
        hit(&mut growth, 0.1, 7);
        let first = growth.past().unwrap();
        hit(&mut growth, 0.6, 300);
        let mut other = begin();
        other.replay(&first);
        hit(&mut other, 0.6, 300);
        assert_eq!(other.network(), growth.network());
        let mut later = begin();
        hit(&mut later, 0.6, 300);
        // The second part alone has other cracks, but the same hits.
        let whole = first.followed_by(&later.past().unwrap());
        let hits = |past: &Past| past.events.clone();
        assert_eq!(hits(&whole), hits(&growth.past().unwrap()));
    }

    #[test]
    fn a_surface_of_another_extent_is_hit_in_the_same_places() {
        let past = Past {
            extent: Vec2::new(2.0, 1.0),
            events: vec![PastEvent::Hit { after: 0, pos: Vec2::new(2.0, 0.5), energy: 1.0 }],
            steps: 0,
        };
        let mut growth = CrackGrowth::new(CrackPreset::GLASS.growth, Vec2::new(1.0, 3.0), 1).unwrap();
        growth.replay(&past);
        assert_eq!(growth.impacts()[0].pos, Vec2::new(1.0, 1.5));
    }

    #[test]
    fn a_past_that_cannot_be_is_refused_and_more_than_is_kept_is_none() {
        let hit = |after, x, energy| PastEvent::Hit { after, pos: Vec2::new(x, 0.5), energy };
        let past = |events| Past { extent: Vec2::ONE, events, steps: 10 };
        assert_eq!(past(vec![hit(0, 0.5, 1.0), PastEvent::Removal { after: 10, keep: 0 }]).validate(), Ok(()));
        for (events, error) in [
            (vec![hit(0, 0.5, 1.0); Past::MAX_EVENTS + 1], PastError::TooMany(Past::MAX_EVENTS + 1)),
            (vec![hit(0, 0.5, 1.0), hit(0, f32::NAN, 1.0)], PastError::Hit(1)),
            (vec![hit(0, 1.5, 1.0)], PastError::Hit(0)),
            (vec![hit(0, 0.5, 0.0)], PastError::Hit(0)),
            (vec![hit(0, 0.5, f32::INFINITY)], PastError::Hit(0)),
            (vec![hit(3, 0.5, 1.0), hit(2, 0.5, 1.0)], PastError::Order(1)),
            (vec![hit(11, 0.5, 1.0)], PastError::Order(0)),
        ] {
            assert_eq!(past(events).validate(), Err(error));
        }
        let flat = Past { extent: Vec2::new(1.0, 0.0), ..Past::default() };
        assert_eq!(flat.validate(), Err(PastError::Extent(flat.extent)));
        let mut growth = CrackGrowth::new(CrackPreset::TOON.growth, Vec2::ONE, 1).unwrap();
        for i in 0..Past::MAX_EVENTS + 2 {
            assert_eq!(growth.past().is_some(), i <= Past::MAX_EVENTS);
            growth.hit(Vec2::splat(0.5), 0.01);
        }
    }

    /// A file may say that there were any number of steps.
    #[test]
    fn steps_that_lead_nowhere_are_not_made() {
        let past = Past {
            extent: Vec2::ONE,
            events: vec![PastEvent::Hit { after: u32::MAX, pos: Vec2::splat(0.5), energy: 1.0 }],
            steps: u32::MAX,
        };
        let mut growth = CrackGrowth::new(CrackPreset::GLASS.growth, Vec2::ONE, 1).unwrap();
        growth.replay(&past);
        assert!(!growth.is_growing() && growth.network().nodes().len() > 100);
    }
}
