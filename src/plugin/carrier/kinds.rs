//! All kinds of carriers.

use super::kind::{CarrierKind, Found};
#[cfg(feature = "2d")]
use super::lit::CrackLitMaterial;
#[cfg(any(feature = "2d", feature = "3d"))]
use super::material::MaterialKind;
#[cfg(feature = "2d")]
use super::sprite::SpriteKind;
#[cfg(any(feature = "2d", feature = "3d"))]
use crate::plugin::api::CrackGroup;
use crate::plugin::api::error::CrackError;
use bevy::prelude::*;
#[cfg(feature = "2d")]
use bevy::sprite_render::TilemapChunk;

/// All kinds. The first that fits is taken.
const KINDS: &[&dyn CarrierKind] = &[
    #[cfg(feature = "2d")]
    &SpriteKind,
    #[cfg(feature = "2d")]
    &MaterialKind::<MeshMaterial2d<ColorMaterial>>::NEW,
    #[cfg(feature = "2d")]
    &MaterialKind::<MeshMaterial2d<CrackLitMaterial>>::NEW,
    #[cfg(feature = "3d")]
    &MaterialKind::<MeshMaterial3d<StandardMaterial>>::NEW,
];

/// What the entity shows, and how to deal with it.
pub(crate) fn inspect(world: &World, entity: Entity) -> (Option<&'static dyn CarrierKind>, Found) {
    for &kind in KINDS {
        match kind.inspect(world, entity) {
            Found::Other => {}
            found => return (Some(kind), found),
        }
    }
    // Its picture is yet to be made.
    #[cfg(any(feature = "2d", feature = "3d"))]
    if world.get::<CrackGroup>(entity).is_some() {
        return (None, Found::Waiting);
    }
    #[cfg(feature = "2d")]
    if world.get::<TilemapChunk>(entity).is_some() {
        return (None, Found::Unusable(CrackError::Tilemap));
    }
    (None, Found::Unusable(CrackError::NothingToCrack))
}
