//! [`HitQueue`]: hits that wait for their turn.

use crate::plugin::api::{
    budget::CrackStats,
    error::EntityLabel,
    hit::{CrackHit, HitPoint},
};
use bevy::{
    ecs::entity::{EntityHashMap, EntityHashSet},
    prelude::*,
};
use std::collections::VecDeque;

/// A full queue looks at this many waiting hits, spread over all of it, for the one to merge with.
const MERGE_CANDIDATES: usize = 64;

/// No more than this many surfaces are warned about.
const MAX_WARNED: usize = 1024;

/// A hit that waits. The point is never [`HitPoint::World`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct QueuedHit {
    pub(crate) at: HitPoint,
    /// The point in the entity's own space, where `at` has been found from one.
    pub(crate) point: Option<Vec3>,
    pub(crate) energy: f32,
    /// In the world.
    pub(crate) direction: Vec3,
}

/// Hits that wait, first come first served within a surface, in turns between surfaces.
#[derive(Resource, Default)]
pub(crate) struct HitQueue {
    /// Hits sent as events since the last frame.
    pub(crate) inbox: Vec<CrackHit>,
    hits: EntityHashMap<VecDeque<QueuedHit>>,
    /// Surfaces with hits that can be worked on, each once.
    turns: VecDeque<Entity>,
    /// Surfaces with hits whose pictures are loading or whose textures are being made, each once.
    parked: Vec<Entity>,
    warned: EntityHashSet,
    has_missed: bool,
}

impl HitQueue {
    pub(crate) fn push(&mut self, entity: Entity, hit: QueuedHit, cap: usize, stats: &mut CrackStats) {
        let hits = self.hits.entry(entity).or_insert_with(|| {
            self.turns.push_back(entity);
            VecDeque::new()
        });
        if hits.len() < cap.max(1) {
            hits.push_back(hit);
            stats.queued += 1;
            return;
        }
        let stride = hits.len().div_ceil(MERGE_CANDIDATES);
        let candidates = (0..hits.len()).step_by(stride).filter_map(|i| Some((distance(hits.get(i)?.at, hit.at), i)));
        if let Some((_, nearest)) = candidates.min_by(|a, b| a.0.total_cmp(&b.0))
            && let Some(nearest) = hits.get_mut(nearest)
        {
            nearest.energy = (nearest.energy + hit.energy).min(f32::MAX);
            stats.merged += 1;
        }
    }

    /// Counts a hit on what is gone. Games hit what goes in the same frame all the time: it is said once, whatever is hit.
    pub(crate) fn miss(&mut self, entity: Entity, stats: &mut CrackStats) {
        stats.rejected += 1;
        if !core::mem::replace(&mut self.has_missed, true) {
            warn!("a hit on {entity} is refused: the entity is gone (other hits on what is gone will only be counted)");
        }
    }

    /// Counts a hit as refused and says why, once for each surface.
    pub(crate) fn reject(&mut self, surface: &EntityLabel<'_>, reason: &str, stats: &mut CrackStats) {
        stats.rejected += 1;
        if self.warned.len() < MAX_WARNED && self.warned.insert(surface.entity) {
            warn!("a hit on {surface} is refused: {reason} (further ones will only be counted)");
        }
    }

    /// Drops all hits that wait on a surface, those of this frame's events too; they count as refused.
    pub(crate) fn purge(&mut self, entity: Entity, stats: &mut CrackStats) {
        self.purge_inbox(|hit| hit == entity, stats);
        if let Some(hits) = self.hits.remove(&entity) {
            stats.queued -= hits.len() as u64;
            stats.rejected += hits.len() as u64;
            self.turns.retain(|e| *e != entity);
            self.parked.retain(|e| *e != entity);
        }
    }

    /// Drops hits of this frame's events; they count as refused.
    pub(crate) fn purge_inbox(&mut self, is_on: impl Fn(Entity) -> bool, stats: &mut CrackStats) {
        let before = self.inbox.len();
        self.inbox.retain(|hit| !is_on(hit.entity));
        let dropped = (before - self.inbox.len()) as u64;
        stats.sent += dropped;
        stats.rejected += dropped;
    }

    /// Whether any hit waits.
    pub(crate) fn has_any(&self) -> bool {
        !self.hits.is_empty()
    }

    /// The hit of a surface that waits the longest.
    pub(crate) fn first(&self, entity: Entity) -> Option<&QueuedHit> {
        self.hits.get(&entity)?.front()
    }

    /// Says where that hit is.
    pub(crate) fn place_first(&mut self, entity: Entity, uv: Vec2) {
        if let Some(hit) = self.hits.get_mut(&entity).and_then(VecDeque::front_mut) {
            if let HitPoint::Local(point) = hit.at {
                hit.point = Some(point);
            }
            hit.at = HitPoint::Uv(uv);
        }
    }

    /// The next surface in turn.
    pub(crate) fn next(&self) -> Option<Entity> {
        self.turns.front().copied()
    }

    /// The surfaces in line.
    pub(crate) fn turns(&self) -> impl Iterator<Item = Entity> + '_ {
        self.turns.iter().copied()
    }

    /// Takes the first hit of the surface in turn, which goes to the end of the line.
    pub(crate) fn take(&mut self, stats: &mut CrackStats) -> Option<QueuedHit> {
        let entity = self.turns.pop_front()?;
        let hits = self.hits.get_mut(&entity)?;
        let hit = hits.pop_front();
        if hits.is_empty() {
            self.hits.remove(&entity);
        } else {
            self.turns.push_back(entity);
        }
        stats.queued -= u64::from(hit.is_some());
        hit
    }

    /// Takes the surface in turn out of the line until [`unpark`](Self::unpark).
    pub(crate) fn park(&mut self) {
        self.parked.extend(self.turns.pop_front());
    }

    /// Puts all parked surfaces back in the line.
    pub(crate) fn unpark(&mut self) {
        self.turns.extend(self.parked.drain(..));
    }
}

/// Works on the queue and its counts. Nothing of a game runs meanwhile: whatever it does finds the queue in the world.
pub(crate) fn with_queue<T>(world: &mut World, work: impl FnOnce(&World, &mut HitQueue, &mut CrackStats) -> T) -> T {
    world.resource_scope(|world, mut queue: Mut<HitQueue>| {
        let mut stats = *world.resource::<CrackStats>();
        let result = work(world, &mut queue, &mut stats);
        *world.resource_mut::<CrackStats>() = stats;
        result
    })
}

/// Distance in whatever space both points are; infinite between different ones.
fn distance(a: HitPoint, b: HitPoint) -> f32 {
    match (a, b) {
        (HitPoint::Uv(a), HitPoint::Uv(b)) => a.distance_squared(b),
        (HitPoint::Local(a), HitPoint::Local(b)) => a.distance_squared(b),
        _ => f32::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_fair_and_counts_add_up() {
        let (mut queue, mut stats) = (HitQueue::default(), CrackStats::default());
        let surfaces = [Entity::from_bits(1), Entity::from_bits(2)];
        for i in 0..10 {
            let hit =
                QueuedHit { at: HitPoint::Uv(Vec2::splat(i as f32)), point: None, energy: 1.0, direction: Vec3::ZERO };
            queue.push(surfaces[usize::from(i > 6)], hit, 5, &mut stats);
        }
        assert_eq!((stats.queued, stats.merged), (8, 2), "two of seven hits do not fit");
        let mut turns = Vec::new();
        while let Some(entity) = queue.next() {
            assert!(queue.take(&mut stats).is_some(), "a surface in line has a hit");
            turns.push(entity == surfaces[0]);
        }
        assert_eq!(turns, [true, false, true, false, true, false, true, true]);
        assert_eq!(stats.queued, 0);
    }
}
