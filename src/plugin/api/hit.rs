//! [`CrackHit`]: something strikes a surface.

use bevy::prelude::*;

/// One hit on a [`CrackSurface`](super::CrackSurface): trigger it as an entity event, or write it as a message when there are many.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn hammer(walls: Query<Entity, With<CrackSurface>>, mut hits: MessageWriter<CrackHit>) {
///     for wall in &walls {
///         hits.write(CrackHit::uv(wall, Vec2::splat(0.5)).with_energy(1.5));
///     }
/// }
///
/// /// A bullet that comes from the right.
/// fn shoot(In((wall, point)): In<(Entity, Vec3)>, mut commands: Commands) {
///     commands.trigger(CrackHit::world(wall, point).with_direction(Vec3::NEG_X));
/// }
///
/// let hit = CrackHit::local(Entity::PLACEHOLDER, Vec3::ZERO);
/// assert_eq!((hit.at, hit.energy, hit.direction), (HitPoint::Local(Vec3::ZERO), 1.0, Vec3::ZERO));
/// ```
#[derive(EntityEvent, Message, Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Message, Default)]
pub struct CrackHit {
    /// The surface.
    pub entity: Entity,
    /// Where.
    pub at: HitPoint,
    /// How hard: 0 = nothing happens, 1 = as the preset says, 4 = twice as far; capped at 16.
    pub energy: f32,
    /// Direction of the blow in the world; zero = straight. Shards fly that way; cracks do not depend on it.
    pub direction: Vec3,
}

/// Where a hit lands.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Default)]
pub enum HitPoint {
    /// A point of the world, as it is when the frame's transforms are propagated. Sprites ignore the depth along their
    /// own z; meshes take the closest point of their triangles.
    World(Vec3),
    /// Texture coordinates in the surface's picture or sprite frame, 0..=1, v down; on a sprite that repeats or slices its picture in the whole of it,
    /// here and wherever texture coordinates are spoken of.
    Uv(Vec2),
    /// A point in the entity's own space.
    Local(Vec3),
}

impl CrackHit {
    /// A hit of energy 1 at a point of the world.
    #[must_use]
    pub const fn world(entity: Entity, point: Vec3) -> Self {
        Self::new(entity, HitPoint::World(point))
    }

    /// A hit of energy 1 at texture coordinates, 0..=1, v down.
    #[must_use]
    pub const fn uv(entity: Entity, uv: Vec2) -> Self {
        Self::new(entity, HitPoint::Uv(uv))
    }

    /// A hit of energy 1 at a point of the entity's own space.
    #[must_use]
    pub const fn local(entity: Entity, point: Vec3) -> Self {
        Self::new(entity, HitPoint::Local(point))
    }

    const fn new(entity: Entity, at: HitPoint) -> Self {
        Self { entity, at, energy: 1.0, direction: Vec3::ZERO }
    }

    /// The same with another energy.
    #[must_use]
    pub const fn with_energy(mut self, energy: f32) -> Self {
        self.energy = energy;
        self
    }

    /// The same with a direction.
    #[must_use]
    pub const fn with_direction(mut self, direction: Vec3) -> Self {
        self.direction = direction;
        self
    }

    /// Whether all of its numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let at = match self.at {
            HitPoint::World(point) | HitPoint::Local(point) => point.is_finite(),
            HitPoint::Uv(uv) => uv.is_finite(),
        };
        at && self.energy.is_finite() && self.direction.is_finite()
    }
}
