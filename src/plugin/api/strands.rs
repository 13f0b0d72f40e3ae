//! [`CrackStrands`]: single cracks that follow a direction, made by a background task.

use super::{BakeProgress, CrackError, HitPoint};
use crate::strands::StrandParams;
use bevy::{prelude::*, reflect::serde::ReflectSerializeWithRegistry};

/// Single cracks that run from starts in a direction that you give: over a road, along a line that a player draws.
///
/// Put it beside a [`CrackSurface`](super::CrackSurface). Adding it, or changing it, makes the [`strands`](crate::strands) anew, on the
/// [`AsyncComputeTaskPool`](bevy::tasks::AsyncComputeTaskPool) or in slices, as [`GuidedCracks`](super::GuidedCracks) are made:
/// [`BakeProgress`] tells how far they are, and it ends with exactly one of [`CrackBaked`](super::CrackBaked) and
/// [`CrackFailed`](super::CrackFailed), unless it is cancelled by another change, by removing the component or the entity, or by healing.
///
/// The cracks are of one network with all others: hits start from them and, where the preset has
/// [`arrest`](crate::growth::GrowthParams::arrest), stop at them; shards are cut along them; a [`CrackClock`](super::CrackClock) moves
/// them; healing takes them away. A surface has baked cracks of one kind: strands take the place of guided cracks, and the other way
/// round. Removing the component keeps them.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::{prelude::*, strands::StrandParams};
///
/// /// A crack along a line in the world.
/// fn split(road: Single<Entity, With<CrackSurface>>, mut commands: Commands) {
///     let line = [[-3.0, 0.0], [-1.0, 0.4], [3.0, 0.1]].map(|[x, y]| HitPoint::World(Vec3::new(x, y, 0.0)));
///     commands.entity(*road).insert(CrackStrands::along(line).with_params(StrandParams::ASPHALT).with_seconds(2.0));
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, Clone, Debug, PartialEq, SerializeWithRegistry)]
#[require(BakeProgress)]
pub struct CrackStrands {
    /// Where strands start, on the surface; at most [`MAX_STARTS`](crate::strands::MAX_STARTS). None (default) = at the first point of the
    /// line, or at the center of the field.
    pub starts: Vec<HitPoint>,
    /// The directions in which they run. Default: away from the middle.
    pub field: StrandField,
    /// Noise, inertia, branches, distances and widths; default [`StrandParams::ASPHALT`].
    pub params: StrandParams,
    /// Images of cracks to be joined along the strands, dark on light: at most 64, at most 1024 texels a side, readable on the CPU.
    /// See [`Primitive::from_image`](crate::strands::Primitive::from_image). None (default) = those of [`StrandParams::material`].
    pub primitives: Vec<Handle<Image>>,
    /// Seed of the noise and of the choice of primitives. Default 0.
    pub seed: u64,
    /// Seconds until all of them are there, up to 1e6; default 0. Not a number, zero or below: at once. On a surface that has been hit before they
    /// come at once.
    pub seconds: f32,
}

/// The directions of [`CrackStrands`], before noise turns them.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// // Three cracks that run down from the upper edge, and one that winds out from the middle.
/// let starts = [0.2, 0.5, 0.8].map(|u| HitPoint::Uv(Vec2::new(u, 0.0)));
/// let down = CrackStrands::new(starts, StrandField::Linear(Vec2::Y)).with_seed(3);
/// let middle = HitPoint::Uv(Vec2::splat(0.5));
/// let whirl = CrackStrands::new([], StrandField::Swirl { center: middle, turn: 1.2 });
/// assert!(down.validate().is_ok() && whirl.validate().is_ok());
/// ```
#[derive(Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Clone, Debug, PartialEq, SerializeWithRegistry)]
pub enum StrandField {
    /// The same everywhere: x to the right of the picture, y down.
    Linear(Vec2),
    /// Away from a point.
    Radial(HitPoint),
    /// Around a point.
    Swirl {
        /// The point.
        center: HitPoint,
        /// Angle between the direction and the way from the point, radians, see
        /// [`Directions::Swirl`](crate::strands::Directions::Swirl).
        turn: f32,
    },
    /// The red and green of an image, stretched over the shown part of the surface's picture: 128 is zero.
    Painted(Handle<Image>),
    /// Along a line.
    Along {
        /// Its points.
        line: Vec<HitPoint>,
        /// Distance at which strands turn back to it by 45 degrees, pattern units (the surface's shorter side is 1). 0.001..=64.
        hold: f32,
    },
}

impl CrackStrands {
    /// Strands from these starts.
    #[must_use]
    pub fn new(starts: impl IntoIterator<Item = HitPoint>, field: StrandField) -> Self {
        Self { starts: starts.into_iter().collect(), field, ..Self::default() }
    }

    /// One strand along a line.
    #[must_use]
    pub fn along(line: impl IntoIterator<Item = HitPoint>) -> Self {
        Self::new([], StrandField::Along { line: line.into_iter().collect(), hold: 0.1 })
    }

    /// The same with other parameters.
    #[must_use]
    pub const fn with_params(mut self, params: StrandParams) -> Self {
        self.params = params;
        self
    }

    /// The same with another seed.
    #[must_use]
    pub const fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The same, coming within these seconds.
    #[must_use]
    pub const fn with_seconds(mut self, seconds: f32) -> Self {
        self.seconds = seconds;
        self
    }
}

/// The most images of primitives.
const MAX_PRIMITIVES: usize = 64;

/// Cracks take no longer to appear, seconds.
const LONGEST: f32 = 1e6;

impl CrackStrands {
    /// Checks every number that does not depend on the surface.
    ///
    /// # Errors
    /// [`CrackError::OutOfRange`] for the first that is out of its range or not finite.
    pub fn validate(&self) -> Result<(), CrackError> {
        for (field, value, max) in [
            ("primitives", self.primitives.len() as f32, MAX_PRIMITIVES as f32),
            // Not a number and what is below zero mean at once.
            ("seconds", self.seconds.max(0.0), LONGEST),
        ] {
            if value > max {
                return Err(CrackError::OutOfRange { field: field.to_owned(), value, min: 0.0, max });
            }
        }
        self.params.validate().map_err(strand_error)
    }
}

/// An error of strands as one of a surface.
pub(crate) fn strand_error(error: crate::strands::StrandError) -> CrackError {
    match error {
        crate::strands::StrandError::OutOfRange { name, value, min, max } => {
            let field = if name.contains('.') { name.replace("directions", "field") } else { format!("params.{name}") };
            CrackError::OutOfRange { field, value, min, max }
        }
        error => CrackError::Bake { reason: error.to_string() },
    }
}

impl Default for CrackStrands {
    fn default() -> Self {
        Self {
            starts: Vec::new(),
            field: StrandField::Radial(HitPoint::Uv(Vec2::splat(0.5))),
            params: StrandParams::ASPHALT,
            primitives: Vec::new(),
            seed: 0,
            seconds: 0.0,
        }
    }
}
