//! Bursts as they are in the world.

use crate::plugin::api::GravitySpace;
use crate::plugin::carrier::plane::Plane;
use crate::plugin::carrier::space;
use crate::shatter::{Burst, BurstParams, Floor, ShatterError};
use bevy::prelude::*;

/// How what leaves a surface is thrown, and falls.
#[derive(Clone, Copy)]
pub(super) struct Throw {
    pub(super) params: BurstParams,
    pub(super) gravity: GravitySpace,
    /// Height of the floor in the world.
    pub(super) floor: Option<f32>,
    /// How thick pieces are that lie flat on it, in the entity's units; `None` in 2D.
    pub(super) thickness: Option<f32>,
    /// How far the piece reaches behind its middle, pattern units.
    pub(super) depth: f32,
    pub(super) seed: u64,
}

/// A direction in the world, of any length, in the entity's own space; zero if there is none.
pub(super) fn in_own_space(world: &World, entity: Entity, direction: Vec3) -> Vec3 {
    let back = world.get::<GlobalTransform>(entity).and_then(space::to_local).unwrap_or_default();
    space::direction(back.transform_vector3(space::direction(direction)))
}

/// The same in the axes of flights.
pub(super) fn in_plane(world: &World, entity: Entity, plane: &Plane, direction: Vec3) -> Vec3 {
    plane.rotation.inverse() * in_own_space(world, entity, direction)
}

impl Throw {
    /// The burst from a place (pattern units) on a surface of `extent`, in a direction in the axes of flights.
    pub(super) fn burst(
        &self,
        place: Option<&GlobalTransform>,
        (plane, extent): (&Plane, Vec2),
        (from, direction, energy): (Vec2, Vec3, f32),
    ) -> Result<Burst, ShatterError> {
        let mut burst = Burst::new(self.params, from, direction, energy, self.seed)?;
        let Some(place) = place else { return Ok(burst) };
        if self.gravity == GravitySpace::World
            && let Some(gravity) = plane.down(extent, place, self.params.gravity)
        {
            burst = burst.with_gravity(gravity);
        }
        if let Some(height) = self.floor.filter(|height| height.is_finite())
            && let Some(floor) = plane.floor(extent, place, height, self.thickness)
        {
            burst = burst.with_floor(Floor { depth: self.depth, ..floor })?;
        }
        Ok(burst)
    }
}
