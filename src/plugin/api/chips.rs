//! [`CrackChips`]: what hits knock out of a surface flies off, and crumbs off its shards.

use super::shatter::GravitySpace;
use crate::shatter::BurstParams;
use bevy::prelude::*;

/// Has the pieces of craters fly off a surface, and crumbs off the edges of its shards, beside a
/// [`CrackSurface`](crate::plugin::CrackSurface).
///
/// # Chips
///
/// Each hit that cracks the surface breaks the crater that it leaves into chips: the same
/// [`Crater`](crate::relief::Crater) that is painted, cut along its terraces and a few rays. Where a hit falls into an older crater, only
/// what is new comes off. Chips show the surface's picture without cracks; in 3D they have thickness. Each is an entity with
/// [`CrackChip`], a child of its surface. They fly by formula, as shards do, in the time of the app's [`Time`], shrink at the end of their
/// flight and are despawned then.
///
/// Looks need a [crushed zone](crate::paint::Look::crushed) with
/// [terraces](crate::raster::CrushedZone::terraces): those of concrete, asphalt, marble, plaster, brick, clay and mud have one.
/// Of a box or a curved mesh, chips come off where it is hit, not over an edge; they show its texture as it is then. None
/// come off a body that is not laid out.
///
/// # Crumbs
///
/// Where shards leave the surface, and where they break again in the air, crumbs come off along their outlines: few large ones and many small ones,
/// some of them on the way. They are as the inside of the shards is, in 2D as the picture; where rims are bright, as those of glass, they are
/// splinters. Every look has them. They are entities as chips are, but go with the shards: they fall and fade as
/// [`ShatterCracks::burst`](super::ShatterCracks::burst) and [`gravity`](super::ShatterCracks::gravity) say, rest on its
/// [`floor`](super::ShatterCracks::floor), and in time that runs backwards they return to the edges and are gone.
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
    /// About how many crumbs come off for each pattern unit of the outline of a shard, 64 of a shard and 512 in a frame at the most; 0 = none.
    /// 0..=1000; default 40.
    pub crumbs: u32,
    /// How large the largest crumbs are, pattern units; most are much smaller. 0..=0.1; default 0.05.
    pub crumb_size: f32,
}

impl CrackChips {
    /// The most chips of one hit.
    pub(crate) const MOST: u32 = 64;

    /// The most crumbs of a pattern unit, and the size of the largest, pattern units.
    pub(crate) const MOST_CRUMBS: u32 = 1000;
    pub(crate) const LARGEST_CRUMB: f32 = 0.1;
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
        Self { count: 12, burst, gravity: GravitySpace::World, floor: None, crumbs: 40, crumb_size: 0.05 }
    }
}

/// A chip or a crumb in the air, see [`CrackChips`].
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default)]
pub struct CrackChip {
    /// Where it comes from.
    pub surface: Entity,
}
