//! Undo and redo: the settings of a surface before each change.

use super::subject::AnalogyChoice;
use crate::plugin::{CrackChips, CrackClock, CrackRelief, CrackStrands, CrackSurface, GuidedCracks, ShatterCracks};
use bevy::prelude::Entity;

/// The most changes that can be taken back.
const MOST: usize = 200;

/// The components of a surface that the panel changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Settings {
    pub(super) surface: CrackSurface,
    pub(super) guided: Option<GuidedCracks>,
    pub(super) strands: Option<CrackStrands>,
    pub(super) relief: Option<CrackRelief>,
    pub(super) analogy: Option<AnalogyChoice>,
    pub(super) shatter: Option<ShatterCracks>,
    pub(super) chips: Option<CrackChips>,
    pub(super) clock: Option<CrackClock>,
}

impl Settings {
    /// Whether only time is another one: that is not a change to take back.
    fn differs_in_time_only(&self, other: &Self) -> bool {
        Self { clock: other.clock, ..self.clone() } == *other
    }
}

/// Settings before changes, and those that were taken back.
#[derive(Default)]
pub(super) struct History {
    done: Vec<(Entity, Settings)>,
    undone: Vec<(Entity, Settings)>,
    /// Whether a slider is being dragged whose change is noted already.
    is_dragging: bool,
}

impl History {
    /// Notes that settings have changed from `before` to `after`. While the pointer is down all changes are one.
    pub(super) fn note(&mut self, entity: Entity, before: Settings, after: &Settings, is_down: bool) {
        if before.differs_in_time_only(after) {
            return;
        }
        self.undone.clear();
        if !self.is_dragging {
            self.done.push((entity, before));
            let too_many = self.done.len().saturating_sub(MOST);
            self.done.drain(..too_many);
        }
        self.is_dragging = is_down;
    }

    /// Notes that the pointer is up.
    pub(super) fn release(&mut self) {
        self.is_dragging = false;
    }

    /// The surface whose settings come next, backwards or forwards.
    pub(super) fn next(&self, is_undo: bool) -> Option<Entity> {
        let from = if is_undo { &self.done } else { &self.undone };
        from.last().map(|(entity, _)| *entity)
    }

    /// Goes back or forth: gives the settings to put in place of `now`, which are those of [`next`](Self::next).
    pub(super) fn step(&mut self, is_undo: bool, now: Settings) -> Option<Settings> {
        let (from, to) = if is_undo { (&mut self.done, &mut self.undone) } else { (&mut self.undone, &mut self.done) };
        let (entity, settings) = from.pop()?;
        to.push((entity, now));
        Some(settings)
    }

    /// Drops what is noted of a surface that is gone.
    pub(super) fn drop_next(&mut self, is_undo: bool) {
        if is_undo {
            self.done.pop()
        } else {
            self.undone.pop()
        };
    }

    pub(super) fn can_step(&self) -> (bool, bool) {
        (!self.done.is_empty(), !self.undone.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_seed(seed: u64) -> Settings {
        Settings { surface: CrackSurface::default().with_seed(seed), ..Settings::default() }
    }

    #[test]
    fn changes_are_taken_back_and_made_again() {
        let (mut history, entity) = (History::default(), Entity::PLACEHOLDER);
        for seed in 0..3 {
            history.note(entity, with_seed(seed), &with_seed(seed + 1), false);
        }
        assert_eq!(history.step(true, with_seed(3)), Some(with_seed(2)));
        assert_eq!(history.step(true, with_seed(2)), Some(with_seed(1)));
        assert_eq!(history.step(false, with_seed(1)), Some(with_seed(2)));
        assert_eq!(history.can_step(), (true, true));
        // Another change: what was taken back is gone.
        history.note(entity, with_seed(2), &with_seed(9), false);
        assert_eq!(history.can_step(), (true, false));
        assert_eq!(history.step(false, with_seed(9)), None);
    }

    #[test]
    fn a_drag_is_one_change_and_time_is_none() {
        let (mut history, entity) = (History::default(), Entity::PLACEHOLDER);
        for seed in 0..50 {
            history.note(entity, with_seed(seed), &with_seed(seed + 1), true);
        }
        history.release();
        let later = Settings { clock: Some(CrackClock::speed(-1.0)), ..with_seed(50) };
        history.note(entity, with_seed(50), &later, false);
        assert_eq!(history.step(true, later), Some(with_seed(0)));
        assert_eq!(history.can_step(), (false, true));
    }

    #[test]
    fn it_does_not_grow_for_ever() {
        let mut history = History::default();
        for seed in 0..1000 {
            history.note(Entity::PLACEHOLDER, with_seed(seed), &with_seed(seed + 1), false);
        }
        assert_eq!(history.done.len(), MOST);
        assert_eq!(history.step(true, with_seed(1000)), Some(with_seed(999)));
    }
}
