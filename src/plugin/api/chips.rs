//! [`CrackChips`]: what hits knock out of a surface flies off.

use super::shatter::GravitySpace;
use crate::shatter::BurstParams;
use bevy::prelude::*;

/// Has the pieces of craters fly off a surface, beside a [`CrackSurface`](crate::plugin::CrackSurface).
///
/// Each hit that cracks the surface breaks the crater that it leaves into chips: the same
/// [`Crater`](crate::relief::Crater) that is painted, cut along its terraces and a few rays. Where a hit falls into an older crater, only
/// what is new comes off. Chips show the surface's picture without cracks; in 3D they have thickness. Each is an entity with
/// [`CrackChip`], a child of its surface. They fly by formula, as shards do, in the time of the app's [`Time`], shrink at the end of their
/// flight and are despawned then.
///
/// Looks need a [crushed zone](crate::paint::Look::crushed) with
/// [terraces](crate::raster::CrushedZone::terraces): those of concrete, asphalt, plaster and brick have one. Of a box or a curved mesh, chips come
/// off where it is hit, not over an edge; they show its texture as it is then. None come off a body that is not laid out.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn wall(mut commands: Commands, assets: Res<AssetServer>) {
///     commands.spawn((
///         Sprite::from_image(assets.load("wall.png")),
///         CrackSurface::new(CrackPreset::CONCRETE),
///         CrackChips::default(),
///     ));
/// }
///
/// /// A light clatter where chips come off.
/// fn clatter(chips: Query<&CrackChip, Added<CrackChip>>) {
///     for chip in &chips {
///         info!("a chip of {}", chip.surface);
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default)]
pub struct CrackChips {
    /// About how many come off at a hit of energy 1; more by the root of the energy, 64 at the most. 0..=64; default 12.
    pub count: u32,
    /// How they fly. A hit that goes into the surface throws them back. Default: at once, slower and shorter than
    /// [`BurstParams::DEFAULT`].
    pub burst: BurstParams,
    /// Whose down they fall. Default: the world's.
    pub gravity: GravitySpace,
    /// Where they come to rest: the height of a level floor in the world; see
    /// [`ShatterCracks::floor`](super::ShatterCracks::floor). `None` (default) or not finite = there is no floor.
    pub floor: Option<f32>,
}

impl CrackChips {
    /// The most chips of one hit.
    pub(crate) const MOST: u32 = 64;
}

impl Default for CrackChips {
    fn default() -> Self {
        let burst = BurstParams {
            hold: 0.0,
            front: 100.0,
            speed: 0.45,
            falloff: 0.2,
            along: 0.4,
            scatter: 0.6,
            spin: 6.0,
            fade_after: 0.9,
            fade: 0.4,
            ..BurstParams::DEFAULT
        };
        Self { count: 12, burst, gravity: GravitySpace::World, floor: None }
    }
}

/// A chip in the air, see [`CrackChips`].
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default)]
pub struct CrackChip {
    /// Where it comes from.
    pub surface: Entity,
}
