//! [`CrackRelief`]: rock walls, islands and mountains, made by a background task.

use super::CrackError;
use crate::relief::{ReliefError, ReliefSettings};
use bevy::prelude::*;

/// Makes the picture of a surface: a rock wall, an island, a mountain, from contour lines ([`relief`](crate::relief)).
///
/// Put it on a sprite, a `Mesh2d` or a 3D mesh with a `StandardMaterial`, with or without a
/// [`CrackSurface`](super::CrackSurface). Adding it, or changing it, makes the relief on the
/// [`AsyncComputeTaskPool`](bevy::tasks::AsyncComputeTaskPool), or in slices inside the [`CrackBudget`](super::CrackBudget) where
/// there are no threads. [`ReliefProgress`] tells how far it is. It ends with exactly one of [`ReliefMade`] and [`ReliefFailed`],
/// unless it is cancelled: by another change (the last one wins), or by removing the component or the entity.
///
/// What was shown before stays until then. A sprite gets a new image; a mesh gets a material of its own, like the one that it
/// has, with the picture and, where the material knows them, the normals. Removing the component keeps what was made. Cracks
/// that are there stay, on the new picture.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn setup(mut commands: Commands) {
///     let wall = Sprite::from_color(Color::WHITE, Vec2::new(600.0, 400.0));
///     let relief = CrackRelief::rock_wall().with_size(UVec2::new(768, 512)).with_seed(3);
///     commands.spawn((wall, relief, CrackSurface::new(CrackPreset::CONCRETE)));
/// }
///
/// fn bar(reliefs: Query<&ReliefProgress, Changed<ReliefProgress>>) {
///     for ReliefProgress(share) in &reliefs {
///         info!("{:.0} % done", 100.0 * share);
///     }
/// }
///
/// fn made(made: On<ReliefMade>, mut commands: Commands) {
///     commands.entity(made.entity).insert(Visibility::Visible);
/// }
///
/// fn failed(failed: On<ReliefFailed>) {
///     warn!("{} stays flat: {}", failed.entity, failed.error);
/// }
///
/// // Landscapes for meshes in 3D. The cracks of the second one keep to its cliffs.
/// let island = CrackRelief::island().with_displacement(1.0);
/// let mountain = CrackRelief::mountain().with_displacement(1.5).with_steep_cracks(1.0);
/// assert!(island.validate().is_ok() && mountain.validate().is_ok());
/// assert!(island.with_size(UVec2::ZERO).validate().is_err());
/// # bevy::ecs::system::assert_is_system(bar);
/// # let mut world = World::new();
/// # world.add_observer(made);
/// # world.add_observer(failed);
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
#[require(ReliefProgress)]
pub struct CrackRelief {
    /// Shape, contours, heights, weather and colors; default [`ReliefSettings::rock_wall`].
    pub settings: ReliefSettings,
    /// Size of the textures, texels, 16..=4096 a side; default 1024 x 1024. It should have the proportions of the surface.
    pub size: UVec2,
    /// Seed of everything that is random. Default 0.
    pub seed: u64,
    /// For 3D meshes: how high the relief stands out of the surface, in units of its real height. Above 0 the mesh, which should be a
    /// rectangle that faces along z or y, is replaced by one of the relief. 0 = the mesh stays. 0..=16; default 0.
    pub displacement: f32,
    /// For 3D meshes: level of detail of the mesh, one vertex for `2^detail` texels across and down. 0..=10; default 2.
    pub detail: u32,
    /// How much cracks prefer steep ground: the relief becomes the [weak mask](super::CrackMaskSource::Images) of a
    /// [`CrackSurface`](super::CrackSurface) that has no mask of its own. 0 = not at all. 0..=1; default 0.
    pub prefers_steep: f32,
}

impl CrackRelief {
    /// A wall of rock, seen from the front.
    #[must_use]
    pub fn rock_wall() -> Self {
        Self::default()
    }

    /// An island in the sea, seen from above.
    #[must_use]
    pub fn island() -> Self {
        Self { settings: ReliefSettings::island(), ..Self::default() }
    }

    /// A mountain, seen from above.
    #[must_use]
    pub fn mountain() -> Self {
        Self { settings: ReliefSettings::mountain(), ..Self::default() }
    }

    /// The same with textures of another size, texels.
    #[must_use]
    pub const fn with_size(mut self, size: UVec2) -> Self {
        self.size = size;
        self
    }

    /// The same with another seed.
    #[must_use]
    pub const fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The same, standing out of a 3D mesh.
    #[must_use]
    pub const fn with_displacement(mut self, displacement: f32) -> Self {
        self.displacement = displacement;
        self
    }

    /// The same, with cracks that prefer steep ground.
    #[must_use]
    pub const fn with_steep_cracks(mut self, share: f32) -> Self {
        self.prefers_steep = share;
        self
    }

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`CrackError::OutOfRange`] for the first of its own numbers that is out of its range or not finite,
    /// [`CrackError::Relief`] for one of its settings.
    pub fn validate(&self) -> Result<(), CrackError> {
        for (field, value, min, max) in [
            ("size.x", self.size.x as f32, 16.0, 4096.0),
            ("size.y", self.size.y as f32, 16.0, 4096.0),
            ("displacement", self.displacement, 0.0, 16.0),
            ("detail", self.detail as f32, 0.0, 10.0),
            ("prefers_steep", self.prefers_steep, 0.0, 1.0),
        ] {
            if !(min..=max).contains(&value) {
                return Err(CrackError::OutOfRange { field: field.to_owned(), value, min, max });
            }
        }
        Ok(self.settings.validate()?)
    }
}

impl Default for CrackRelief {
    fn default() -> Self {
        Self {
            settings: ReliefSettings::rock_wall(),
            size: UVec2::splat(1024),
            seed: 0,
            displacement: 0.0,
            detail: 2,
            prefers_steep: 0.0,
        }
    }
}

impl From<ReliefError> for CrackError {
    fn from(error: ReliefError) -> Self {
        Self::Relief { reason: error.to_string() }
    }
}

/// How far the making of a [`CrackRelief`] is: 1 when it is shown. Falls only when it is made anew, or to 0 when it is cancelled.
/// Written by the crate.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default)]
#[component(clone_behavior = Ignore)]
pub struct ReliefProgress(pub f32);

/// A [`CrackRelief`] is made, and its entity shows it.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct ReliefMade {
    /// The entity.
    pub entity: Entity,
}

/// A [`CrackRelief`] could not be made; what was shown before stays.
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct ReliefFailed {
    /// The entity.
    pub entity: Entity,
    /// Why.
    pub error: CrackError,
}
