//! What shows a surface: sprites, 2D meshes, 3D meshes.

#[cfg(feature = "2d")]
mod color;
#[cfg(feature = "3d")]
pub(crate) mod faces;
pub(crate) mod kind;
pub(crate) mod kinds;
#[cfg(feature = "2d")]
pub(crate) mod lit;
#[cfg(any(feature = "2d", feature = "3d"))]
mod material;
#[cfg(any(feature = "2d", feature = "3d"))]
pub(crate) mod mesh;
pub(crate) mod pipelines;
#[cfg(any(feature = "2d", feature = "3d"))]
pub(crate) mod place;
pub(crate) mod plane;
#[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no kinds then"))]
pub(crate) mod shard_visual;
#[cfg_attr(not(any(feature = "2d", feature = "3d")), expect(dead_code, reason = "there are no kinds then"))]
pub(crate) mod slot;
pub(crate) mod space;
#[cfg(feature = "3d")]
mod split;
#[cfg(feature = "2d")]
pub(crate) mod sprite;
#[cfg(feature = "3d")]
mod standard;
#[cfg(feature = "3d")]
pub(crate) mod unfold;
