//! Hits of a frame are queued.

#[cfg(any(feature = "2d", feature = "3d"))]
use crate::plugin::api::CrackMemberOf;
use crate::plugin::api::error::EntityLabel;
use crate::plugin::api::{CrackBudget, CrackHit, CrackStats, CrackSurface, HitPoint};
#[cfg(any(feature = "2d", feature = "3d"))]
use crate::plugin::carrier::place::CrackPlaces;
use crate::plugin::carrier::space;
use crate::plugin::jobs::frame_time::FrameClock;
use crate::plugin::surface::queue::{HitQueue, QueuedHit};
#[cfg(any(feature = "2d", feature = "3d"))]
use bevy::ecs::system::SystemParam;
use bevy::{ecs::query::QueryEntityError, prelude::*};

/// Keeps a hit sent as an event for [`collect_hits`].
pub(crate) fn receive_hit(hit: On<CrackHit>, mut queue: ResMut<HitQueue>) {
    queue.inbox.push(*hit);
}

/// Takes all hits of the frame, events first, and queues them with their surfaces.
pub(crate) fn collect_hits(
    mut messages: MessageReader<CrackHit>,
    mut queue: ResMut<HitQueue>,
    mut stats: ResMut<CrackStats>,
    budget: Res<CrackBudget>,
    mut clock: ResMut<FrameClock>,
    surfaces: Query<Option<&GlobalTransform>, With<CrackSurface>>,
    names: Query<&Name>,
    #[cfg(any(feature = "2d", feature = "3d"))] members: Members,
) {
    if queue.inbox.is_empty() && messages.is_empty() {
        return;
    }
    // All of them, whatever it takes; what it takes is not there for the others.
    let timer = clock.start(&budget, 1.0);
    let mut inbox = core::mem::take(&mut queue.inbox);
    for hit in inbox.iter().chain(messages.read()) {
        stats.sent += 1;
        #[cfg(any(feature = "2d", feature = "3d"))]
        let hit = &members.of_group(hit);
        let at = match surfaces.get(hit.entity) {
            Ok(transform) => localize(hit, transform),
            Err(QueryEntityError::NotSpawned(_)) => {
                queue.miss(hit.entity, &mut stats);
                continue;
            }
            Err(_) => Err("the entity has no `CrackSurface`"),
        };
        match at {
            Err(reason) => {
                let surface = EntityLabel { entity: hit.entity, name: names.get(hit.entity).ok() };
                queue.reject(&surface, reason, &mut stats);
            }
            Ok(_) if hit.energy == 0.0 => stats.ignored += 1,
            Ok(at) => {
                let waiting = QueuedHit { at, point: None, energy: hit.energy, direction: hit.direction };
                queue.push(hit.entity, waiting, budget.max_queued_per_surface, &mut stats);
            }
        }
    }
    inbox.clear();
    queue.inbox = inbox;
    clock.stop(&timer);
}

/// Members of groups.
#[cfg(any(feature = "2d", feature = "3d"))]
#[derive(SystemParam)]
pub(crate) struct Members<'w, 's> {
    members: Query<'w, 's, (&'static CrackMemberOf, Option<&'static GlobalTransform>), Without<CrackSurface>>,
    places: CrackPlaces<'w, 's>,
}

#[cfg(any(feature = "2d", feature = "3d"))]
impl Members<'_, '_> {
    /// A hit on a member is one on its group, in the same place of the world.
    fn of_group(&self, hit: &CrackHit) -> CrackHit {
        let Ok((CrackMemberOf(group), transform)) = self.members.get(hit.entity) else { return *hit };
        let world = match hit.at {
            HitPoint::World(point) => Some(point),
            HitPoint::Local(point) => transform.map(|transform| transform.transform_point(point)),
            HitPoint::Uv(uv) => self.places.at(hit.entity, uv).map(|place| place.position),
        };
        // What has no place is refused as a point that is no number.
        CrackHit { entity: *group, at: HitPoint::World(world.unwrap_or(Vec3::NAN)), ..*hit }
    }
}

/// World points become local ones at once: the surface may move before the hit's turn comes.
fn localize(hit: &CrackHit, transform: Option<&GlobalTransform>) -> Result<HitPoint, &'static str> {
    if !hit.is_finite() {
        return Err("a coordinate, the energy or the direction is not finite");
    }
    if hit.energy < 0.0 {
        return Err("the energy is negative");
    }
    let HitPoint::World(point) = hit.at else { return Ok(hit.at) };
    let transform = transform.ok_or("the surface has no `GlobalTransform`")?;
    let back =
        space::to_local(transform).ok_or("the surface's transform has a scale of zero, or cannot be inverted")?;
    let local = back.transform_point3(point);
    if local.is_finite() { Ok(HitPoint::Local(local)) } else { Err("the point is too far away") }
}
