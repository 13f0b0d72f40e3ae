//! Requests for shards, and the order in which they are dealt with.

use super::broken::Pieces;
use super::order::{CutSurface, ShatterJob};
use crate::plugin::api::{
    CrackBudget, CrackState, CrackStatus, ShardsError, ShatterCracks, ShatterRequest, ShatterWhen,
};
use crate::plugin::jobs::background::BackgroundJob;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracked::{CrackedSurfaces, active_mut};
use bevy::{
    ecs::{entity_disabling::Disabled, query::Allow},
    platform::time::Instant,
    prelude::*,
};
use std::collections::VecDeque;

/// What is to become shards, and what has.
#[derive(Resource, Default)]
pub(crate) struct ShardQueue {
    /// Surfaces that are to shatter, in order.
    pub(super) requests: Vec<Request>,
    /// Surfaces that have shattered, in order.
    pub(super) broken: Vec<Entity>,
    /// All shards that are shown, the oldest first: entity, surface, and which of its pieces for which time; and some that are not shown
    /// any more.
    pub(super) shown: VecDeque<(Entity, Entity, [u32; 2])>,
    /// How many more may become entities in this frame.
    pub(super) new: usize,
}

/// Frames from a request to its shards, at the least, where the renderer is ready to draw them: the same on every machine, however long
/// they take to make.
pub(super) const FRAMES: u32 = 2;

/// One more for so many nodes of cracks, unless frames may take any time; where these are more, no frame waits for them.
const NODES: usize = 500;

/// And the most.
const MOST_FRAMES: u32 = 20;

/// Frames from a request to its shards.
pub(super) fn frames(world: &World, active: &Active) -> u32 {
    if world.resource::<CrackBudget>().is_unlimited() {
        return FRAMES;
    }
    let more = active.cracks.growth.network().nodes().len() / NODES;
    (FRAMES + u32::try_from(more).unwrap_or(MOST_FRAMES)).min(MOST_FRAMES)
}

/// A surface that is to shatter.
pub(crate) struct Request {
    pub(super) entity: Entity,
    pub(super) request: ShatterRequest,
    /// Once its shards are being made, and how many frames ago that was begun.
    pub(super) work: Option<(BackgroundJob<ShatterJob, Result<CutSurface, ShardsError>>, u32)>,
    /// How many of them it takes.
    pub(super) frames: u32,
    /// When it was begun.
    pub(super) since: Instant,
}

impl Request {
    pub(crate) fn new(entity: Entity, request: ShatterRequest) -> Self {
        Self { entity, request, work: None, frames: FRAMES, since: Instant::now() }
    }
}

/// Asks for shards where they are to fall by themselves.
pub(crate) fn shatter_when_due(
    changed: Query<(Entity, &ShatterCracks, &CrackState), Changed<CrackState>>,
    mut surfaces: CrackedSurfaces,
    mut queue: ResMut<ShardQueue>,
) {
    for (entity, settings, state) in &changed {
        let Ok((_, mut cracked)) = surfaces.get_mut(entity) else { continue };
        let Some(active) = cracked.get_mut() else { continue };
        let (nodes, cells) = (active.cracks.growth.network().nodes().len(), active.cracks.cells_reported);
        let is_due = match settings.when {
            ShatterWhen::Never => false,
            ShatterWhen::AtDamage(damage) => {
                state.status == CrackStatus::Done && state.damage >= damage && nodes > active.fell_at.0
            }
            ShatterWhen::CellsAsTheyClose => cells > active.fell_at.1,
        };
        if is_due {
            active.fell_at = (nodes, cells);
            let request = ShatterRequest { reach: settings.reach, ..ShatterRequest::ALL };
            // One that has not begun will do for both.
            let is_same = |other: &Request| (other.entity, other.request) == (entity, request) && other.work.is_none();
            if !queue.requests.iter().any(is_same) {
                queue.requests.push(Request::new(entity, request));
                active.turn.is_to_shatter = true;
            }
        }
    }
}

/// Whether any surface is to shatter, or has begun to.
pub(crate) fn any_requests(queue: Res<ShardQueue>, broken: Query<&Pieces, Allow<Disabled>>) -> bool {
    let is_waiting = |entity: &Entity| broken.get(*entity).is_ok_and(Pieces::is_waiting);
    !queue.requests.is_empty() || queue.broken.iter().any(is_waiting)
}

/// Asks for shards of a surface.
pub(crate) fn request_shards(world: &mut World, entity: Entity, request: ShatterRequest) {
    if let Some(mut queue) = world.get_resource_mut::<ShardQueue>() {
        queue.requests.push(Request::new(entity, request));
        if let Some(active) = active_mut(world, entity) {
            active.turn.is_to_shatter = true;
        }
    }
}

/// Takes back what was asked for of a surface.
pub(crate) fn cancel_requests(world: &mut World, entity: Entity) {
    if let Some(mut queue) = world.get_resource_mut::<ShardQueue>() {
        queue.requests.retain(|request| request.entity != entity);
    }
}
