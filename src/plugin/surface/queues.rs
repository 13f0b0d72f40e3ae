//! [`Queues`]: surfaces that wait for their turn.

use super::active::Turn;
use bevy::{ecs::entity::EntityHashSet, prelude::*};
use std::collections::VecDeque;

/// The surfaces that wait for something. Systems visit the queues, never all surfaces.
#[derive(Resource, Default)]
pub(crate) struct Queues {
    /// Surfaces that grow, each once, in turns.
    pub(crate) growing: VecDeque<Entity>,
    /// Surfaces that will grow when others have ended.
    pub(crate) held: VecDeque<Entity>,
    /// Surfaces whose last hit has markers or strands to lay out, each once, in order.
    pub(crate) laying_out: VecDeque<Entity>,
    /// Surfaces to paint, each once, in turns.
    pub(crate) dirty: VecDeque<Entity>,
    /// Surfaces whose normals are to be blended once they are at rest, each once, in turns.
    pub(crate) blending: VecDeque<Entity>,
    /// Surfaces that forget their oldest cracks when a task has worked out what is left: to make room for hits that wait.
    pub(crate) freezing: EntityHashSet,
    /// Surfaces whose components or pictures have changed.
    pub(crate) changed: Vec<Entity>,
    /// Those among them that there was no time for in the last frame. Hits on them come after the change.
    pub(crate) late: EntityHashSet,
}

impl Queues {
    /// Lets a surface that was hit grow.
    pub(crate) fn start_growing(&mut self, entity: Entity, turn: &mut Turn) {
        turn.is_open = true;
        self.wake(entity, turn);
    }

    /// Lets the time of a surface pass.
    pub(crate) fn wake(&mut self, entity: Entity, turn: &mut Turn) {
        if !core::mem::replace(&mut turn.is_growing, true) {
            self.held.push_back(entity);
        }
    }

    /// Has the last hit of a surface laid out.
    pub(crate) fn lay_out(&mut self, entity: Entity, turn: &mut Turn) {
        if !core::mem::replace(&mut turn.is_laying_out, true) {
            self.laying_out.push_back(entity);
        }
    }

    /// Has a surface painted.
    pub(crate) fn mark_dirty(&mut self, entity: Entity, turn: &mut Turn) {
        turn.has_news = true;
        if !core::mem::replace(&mut turn.is_dirty, true) {
            self.dirty.push_back(entity);
        }
    }

    /// Has the normals of a surface blended.
    pub(crate) fn mark_blending(&mut self, entity: Entity, turn: &mut Turn) {
        if !core::mem::replace(&mut turn.is_blending, true) {
            self.blending.push_back(entity);
        }
    }

    /// Takes a surface out of the queues at once: if it comes back before its turn, it must not be in them twice.
    pub(super) fn remove(&mut self, entity: Entity, turn: &Turn) {
        self.freezing.remove(&entity);
        if turn.is_growing {
            self.growing.retain(|other| *other != entity);
            self.held.retain(|other| *other != entity);
        }
        if turn.is_laying_out {
            self.laying_out.retain(|other| *other != entity);
        }
        if turn.is_dirty {
            self.dirty.retain(|other| *other != entity);
        }
        if turn.is_blending {
            self.blending.retain(|other| *other != entity);
        }
    }
}
