//! [`ShatterCracks`]: how a surface shatters, and what becomes of it.

use crate::paint::Look;
use crate::shatter::{Anchor, BreakAgain, BurstParams, ConvexPiece, RimLook, Shards, ShatterError, ShatterParams};
use bevy::{prelude::*, reflect::serde::ReflectSerializeWithRegistry};
use std::sync::Arc;

/// How a surface shatters, and when by itself. Without it, [`shatter_cracks`](crate::plugin::CrackCommandsExt::shatter_cracks) goes by the
/// defaults.
///
/// ```
/// use bevy::{prelude::*, reflect::serde::ReflectSerializeWithRegistry};
/// use bevy_crack::{prelude::*, shatter::Anchor};
///
/// fn pane(mut commands: Commands, assets: Res<AssetServer>) {
///     commands.spawn((
///         Sprite::from_image(assets.load("pane.png")),
///         CrackSurface::new(CrackPreset::GLASS),
///         // What the lower edge does not hold falls when the cracks of a hit have come to their end.
///         ShatterCracks {
///             when: ShatterWhen::AtDamage(0.1),
///             anchor: Anchor::Sides([false, false, false, true]),
///             ..default()
///         },
///     ));
/// }
///
/// /// Time runs backwards: every shard returns to its place, and the pane is whole.
/// fn mend(mut panes: Query<&mut ShatterCracks>) {
///     for mut pane in &mut panes {
///         pane.speed = -1.0;
///     }
/// }
/// ```
///
/// # Bodies
///
/// A 3D mesh that is [laid out flat](super::CrackUnwrap), a box, a jar or a room, shatters as a hollow shell: its pieces are curved as it is, reach
/// around its edges, and are `thickness` thick. Through the holes its inside is seen. Blows reach through space, and pieces fly away from where it
/// was hit. Where its layout is cut, pieces are; those along the cut are held with [`Anchor::Border`] and [`Anchor::Sides`], so
/// [`ShatterRequest::EVERYTHING`] is what takes it apart.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, SerializeWithRegistry)]
pub struct ShatterCracks {
    /// When shards fall by themselves. Default: never.
    pub when: ShatterWhen,
    /// How far around the hit shards are knocked out when they fall by themselves, pattern units, 0..=64 (the surface's shorter side is
    /// 1); infinite as in [`ShatterRequest::EVERYTHING`]. Default: 64, everywhere.
    pub reach: f32,
    /// How lines become shards. Default: [`ShatterParams::DEFAULT`].
    pub cut: ShatterParams,
    /// What holds the surface: shards along it stay unless they are hit themselves. Default: the border, as a pane in its frame.
    pub anchor: Anchor,
    /// What holds the surface besides: where this image is lighter than half, stretched over the shown part of the surface's picture, lightness
    /// as it is stored, times alpha. `None` (default) = nothing. It must be loaded, and readable on the CPU, when the surface shatters. Not for
    /// bodies.
    pub anchor_mask: Option<Handle<Image>>,
    /// How shards fly. Default: [`BurstParams::DEFAULT`].
    pub burst: BurstParams,
    /// Whose down they fall. Default: the world's.
    pub gravity: GravitySpace,
    /// Where shards come to rest, without a physics engine: the height of a level floor in the world. They bounce a little, skid, and lie flat in
    /// 3D; in 2D they stand on it. Make [`BurstParams::fade_after`] long enough. `None` (default) or not finite = there is no floor.
    pub floor: Option<f32>,
    /// Whether the crate moves the shards, lets them fade and takes them away; default true. Else they stay where they are, for a
    /// physics engine: see [`Shard`]. Counts when a surface shatters.
    pub fly: bool,
    /// Seconds of the shards for each second of the app's [`Time`]; default 1. 0 = they stand still; below zero time runs backwards,
    /// each shard returns to its place and is part of the surface again. Not finite = 0.
    pub speed: f32,
    /// Where the shards' time is to jump to, seconds since the surface broke; `None` (default) again when it has. Below zero and not a number
    /// = 0.
    pub seek: Option<f32>,
    /// How pieces break again on their way, where the crate moves them; `None` (default) = they stay whole. Fragments are shards as all
    /// others; time that runs backwards puts them together again. No more than [`CrackBudget::max_shards`](super::CrackBudget::max_shards)
    /// lets there be: a piece without room for its fragments stays whole.
    pub again: Option<BreakAgain>,
    /// How thick shards of 3D surfaces are, pattern units, 0..=10; default 0.03. Those of a slab, a box at least four times as wide and
    /// high as thick, are as thick as it is.
    pub thickness: f32,
    /// How their rims look; `None` (default) = by the preset: [`RimLook::GLASS`] where cracks are frosted,
    /// [`RimLook::PLAIN`] where they are drawn as in a cartoon, else [`RimLook::STONE`].
    pub rim: Option<RimLook>,
    /// What the sides of 3D shards look like; `None` (default) = the mean colour of the picture, darker and with the grain of broken stone; plain where the
    /// rim is not darker than the picture, and like the edge of a pane where it is bright. Texture coordinates of the sides run along the edge and
    /// from the outside to the inside: in pattern units on bodies, in the entity's units on what is flat.
    #[cfg(feature = "3d")]
    pub inside: Option<Handle<StandardMaterial>>,
}

impl Default for ShatterCracks {
    fn default() -> Self {
        Self {
            when: ShatterWhen::Never,
            reach: 64.0,
            cut: ShatterParams::DEFAULT,
            anchor: Anchor::Border,
            anchor_mask: None,
            burst: BurstParams::DEFAULT,
            gravity: GravitySpace::World,
            floor: None,
            fly: true,
            speed: 1.0,
            seek: None,
            again: None,
            thickness: 0.03,
            rim: None,
            #[cfg(feature = "3d")]
            inside: None,
        }
    }
}

/// In which axes [`BurstParams::gravity`] is meant.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::{prelude::*, shatter::BurstParams};
///
/// // A floor that is seen from above: pieces slide apart, and nothing pulls them down the picture.
/// let burst = BurstParams { gravity: Vec2::ZERO, drag: 3.0, ..default() };
/// let floor = ShatterCracks { gravity: GravitySpace::Surface, burst, ..default() };
/// # let _ = floor;
/// ```
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[type_path = "bevy_crack"]
#[reflect(Default)]
pub enum GravitySpace {
    /// Those of the world: y is up, whichever way the surface is turned, mirrored or scaled, in 2D and in 3D. Pieces of a floor fall
    /// through it, those of a turned sprite straight down.
    ///
    /// How the surface lies is taken when it is shattered. Shards are children of their surface: what moves or turns it afterwards moves
    /// and turns them, and the way they fall, as one. One pattern unit of the acceleration is as long as the surface shows it then.
    #[default]
    World,
    /// Those of the surface: x along its picture, y up it. For scenes that are seen from above, say, and pieces that are to slide.
    Surface,
}

/// When shards fall by themselves.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Default)]
pub enum ShatterWhen {
    /// Only on [`shatter_cracks`](crate::plugin::CrackCommandsExt::shatter_cracks).
    #[default]
    Never,
    /// When the cracks of a hit have come to their end and [`CrackState::damage`](super::CrackState::damage) is at least this. Not a
    /// number = never.
    AtDamage(f32),
    /// Each cell when cracks have closed it, unless it touches what is anchored.
    CellsAsTheyClose,
}

/// What [`shatter_cracks`](crate::plugin::CrackCommandsExt::shatter_cracks) is to knock out of a surface; by default
/// [`ALL`](Self::ALL).
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::plugin::ShatterRequest;
///
/// // A kick at the lower edge.
/// let kick = ShatterRequest::around(Vec2::new(0.5, 0.9), 0.2).with_energy(4.0);
/// assert!(kick.validate().is_ok() && ShatterRequest::EVERYTHING.validate().is_ok());
/// assert!(ShatterRequest { reach: -1.0, ..kick }.validate().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShatterRequest {
    /// Where the blow lands, texture coordinates of the surface's picture or sprite frame, 0..=1, v down; from beside it no further than
    /// -64..=64. `None` = where it was hit last.
    pub uv: Option<Vec2>,
    /// How far around it shards are knocked out, pattern units, 0..=64; infinite as in [`EVERYTHING`](Self::EVERYTHING).
    pub reach: f32,
    /// How hard, 0..=1000; `None` = as the last hit.
    pub energy: Option<f32>,
    /// Direction of the blow in the world, of any length; zero = straight on; `None` = as the last hit.
    pub direction: Option<Vec3>,
}

impl ShatterRequest {
    /// All pieces that the cracks have cut out and nothing holds, as a burst from the last hit.
    pub const ALL: Self = Self { uv: None, reach: 64.0, energy: None, direction: None };

    /// The whole surface, as a burst from the last hit: nothing of it stays, whatever [`ShatterCracks::anchor`] says, and cracks that
    /// end inside a piece are carried on to the next crack or the border, so that the parts without cracks go in pieces.
    pub const EVERYTHING: Self = Self { reach: f32::INFINITY, ..Self::ALL };

    /// What lies within `reach` (pattern units) of `uv` (0..=1, v down), and what nothing holds then.
    #[must_use]
    pub const fn around(uv: Vec2, reach: f32) -> Self {
        Self { uv: Some(uv), reach, ..Self::ALL }
    }

    /// The same with another energy.
    #[must_use]
    pub const fn with_energy(mut self, energy: f32) -> Self {
        self.energy = Some(energy);
        self
    }

    /// `Ok` if every field lies in its range.
    ///
    /// # Errors
    /// [`ShatterError::OutOfRange`] for the first that does not.
    pub fn validate(&self) -> Result<(), ShatterError> {
        let uv = self.uv.unwrap_or_default();
        // Infinitely far means everything.
        let reach = if self.reach == f32::INFINITY { 64.0 } else { self.reach };
        let most = f64::from(f32::MAX);
        let direction = self.direction.unwrap_or_default().to_array().map(|value| ("direction", value, -most, most));
        let others = [
            ("uv", uv.x, -64.0, 64.0),
            ("uv", uv.y, -64.0, 64.0),
            ("reach", reach, 0.0, 64.0),
            ("energy", self.energy.unwrap_or_default(), 0.0, 1000.0),
        ];
        for (name, value, min, max) in others.into_iter().chain(direction) {
            let value = f64::from(value);
            if !(min..=max).contains(&value) {
                return Err(ShatterError::OutOfRange { name, value, min, max });
            }
        }
        Ok(())
    }
}

impl Default for ShatterRequest {
    fn default() -> Self {
        Self::ALL
    }
}

/// A piece of a surface that has left it. Its entity is a child of the surface, its origin the shard's centre.
///
/// Shards go when their surface is despawned, as all children do, and when it is healed. To keep one, take `ChildOf` and this component off it.
///
/// Where the crate moves shards, their entities serve for others when they are gone, without this component meanwhile: take off again
/// what you put on (observe `Remove` of `Shard`). One that has a [`CrackSurface`](super::CrackSurface) then is despawned instead, with all that
/// was made for it.
///
/// With [`ShatterCracks::fly`] off, this is what a physics engine needs: colliders, mass and the velocity of the blow.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::{plugin::ShardsError, prelude::*};
///
/// /// Hands shards over to a physics engine.
/// fn embody(shattered: On<Shattered>, shards: Query<&Shard>) {
///     for shard in shards.iter_many(&shattered.shards) {
///         let (colliders, mass) = (shard.convex_pieces(0.004), 2.5 * shard.area());
///         info!("{} colliders, mass {mass}, {} units a second", colliders.len(), shard.velocity);
///     }
/// }
///
/// fn refused(failed: On<ShatterFailed>) {
///     match &failed.error {
///         ShardsError::NoDiffuse => warn!("{} has no texture for holes", failed.entity),
///         error => warn!("{} stays whole: {error}", failed.entity),
///     }
/// }
///
/// fn count(walls: Query<&CrackShards, Changed<CrackShards>>) {
///     for shards in &walls {
///         info!("{} of {} pieces are out of their places", shards.gone, shards.pieces.len());
///     }
/// }
///
/// fn mended(mended: On<Reassembled>, mut commands: Commands) {
///     commands.entity(mended.entity).heal_cracks();
/// }
/// # bevy::ecs::system::assert_is_system(count);
/// # let mut world = World::new();
/// # world.add_observer(embody);
/// # world.add_observer(refused);
/// # world.add_observer(mended);
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[type_path = "bevy_crack"]
#[reflect(Component, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
pub struct Shard {
    /// The surface that it is a piece of.
    pub surface: Entity,
    /// The pieces that it was cut with.
    #[reflect(ignore)]
    pub pieces: Arc<Shards>,
    /// Its number among them.
    pub number: u32,
    /// Velocity from the blow, in the surface's own space and units a second.
    pub velocity: Vec3,
    /// Angular velocity from the blow, in the surface's own space, radians a second.
    pub spin: Vec3,
    /// Units of the surface's own space to a pattern unit, along x and y of the shard; below zero where the picture is mirrored.
    pub scale: Vec2,
    /// Which of the released pieces of its surface it is, and for how many times that is shown.
    #[reflect(ignore)]
    pub(crate) piece: [u32; 2],
}

impl Shard {
    /// Its area in the units of the surface's own space, squared.
    #[must_use]
    pub fn area(&self) -> f32 {
        self.pieces.get(self.number).map_or(0.0, |shard| shard.area * (self.scale.x * self.scale.y).abs())
    }

    /// Convex polygons that make it up, in its own space, y up, for colliders; `tolerance` as in [`Shards::convex_pieces`].
    #[must_use]
    pub fn convex_pieces(&self, tolerance: f32) -> Vec<ConvexPiece> {
        let mut pieces = self.pieces.convex_pieces(self.number, tolerance);
        for corner in pieces.iter_mut().flatten() {
            *corner *= Vec2::new(self.scale.x, -self.scale.y);
        }
        pieces
    }
}

/// What has become of a surface that has shattered. Written by the crate, gone when it is whole again.
#[derive(Component, Reflect, Clone, Debug)]
#[type_path = "bevy_crack"]
#[reflect(Component, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
pub struct CrackShards {
    /// The pieces into which the surface was cut last.
    #[reflect(ignore)]
    pub pieces: Arc<Shards>,
    /// Number of pieces that are out of their places, shown or not.
    pub gone: u32,
    /// Number of those that are entities now.
    pub shown: u32,
    /// Seconds since the surface broke, as [`ShatterCracks::speed`] has let them pass.
    pub time: f32,
}

/// Shards have left a surface.
///
/// No more than 256 leave in one frame, those first that move first, unless [`CrackBudget::milliseconds`](super::CrackBudget::milliseconds)
/// is a second or more: of a larger burst the event comes for each of its frames.
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct Shattered {
    /// The surface.
    pub entity: Entity,
    /// The shards that have just left.
    pub shards: Vec<Entity>,
    /// How many more leave it in the next frames; 0 = these were all, or the last.
    pub rest: u32,
}

/// All shards of a surface have returned to their places, time having run backwards.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[type_path = "bevy_crack"]
#[reflect(Event, Default)]
pub struct Reassembled {
    /// The surface.
    pub entity: Entity,
}

/// A surface was to shatter and could not; it stays as it is.
#[derive(EntityEvent, Clone, Debug, PartialEq)]
pub struct ShatterFailed {
    /// The surface.
    pub entity: Entity,
    /// Why.
    pub error: ShardsError,
}

/// Why a surface cannot shatter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShardsError {
    /// A parameter of [`ShatterCracks`] or [`ShatterRequest`] is out of its range.
    #[error(transparent)]
    Parameter(#[from] ShatterError),
    /// Only sprites, flat meshes that show their picture once, slabs, and bodies that are [laid out flat](super::CrackUnwrap) can shatter. Slabs are
    /// boxes at least four times as wide and high as thick, each of whose broad faces shows all of the picture, as those of a `Cuboid` do.
    #[error(
        "only sprites, flat meshes and slabs that show the whole picture, and meshes that are laid out flat can shatter: {reason}"
    )]
    NotFlat {
        /// What is wrong with it.
        reason: &'static str,
    },
    /// [`ShatterCracks::anchor_mask`] cannot be used.
    #[error("its anchor mask cannot be used: {reason}")]
    AnchorMask {
        /// Why.
        reason: String,
    },
    /// Something that shards are made of is missing.
    #[error("there are no assets of {name}: add the plugin that brings them")]
    NoAssets {
        /// Of what.
        name: &'static str,
    },
    /// [`CrackMaps::diffuse`](super::CrackMaps::diffuse) is off, so that holes could not be seen.
    #[error("the surface has no diffuse texture of its own: `write.diffuse` is off")]
    NoDiffuse,
    /// The shards could not be made.
    #[error("its shards could not be made: {reason}")]
    Failed {
        /// Why.
        reason: String,
    },
    /// Not enough of [`CrackBudget::max_texture_bytes`](super::CrackBudget::max_texture_bytes) is left.
    #[error("the picture on its shards needs {needed} bytes, the budget has {left} left")]
    TextureBudget {
        /// Bytes needed.
        needed: u64,
        /// Bytes left.
        left: u64,
    },
}

/// How the rims of shards look.
pub(crate) fn rim_for(settings: &ShatterCracks, look: &Look) -> RimLook {
    settings.rim.unwrap_or_else(|| rim_of(look))
}

fn rim_of(look: &Look) -> RimLook {
    match look {
        // The picture behind is seen through the walls of the cracks.
        Look { shift, opaque: true, .. } if *shift > 0.0 => RimLook::GLASS,
        // Drawn, or as thin as ink.
        Look { opaque: true, .. } | Look { relief: 0.0, .. } => RimLook::PLAIN,
        _ => RimLook::STONE,
    }
}
