//! Surfaces that are put together from members.
//!
//! - Sprites and tile maps: what they show (`members.rs`), the picture of all of it (`wall.rs`), and when it is made and shown (`system.rs`).
//! - Meshes: what they show (`solids.rs`), the mesh of all of it, laid out flat (`body.rs`), and when it is made and shown (`bodies.rs`).

#[cfg(feature = "3d")]
pub(crate) mod bodies;
#[cfg(feature = "3d")]
mod body;
mod common;
pub(crate) mod hide;
#[cfg(feature = "2d")]
mod members;
#[cfg(feature = "3d")]
mod solids;
#[cfg(feature = "2d")]
pub(crate) mod system;
mod tint;
#[cfg(feature = "2d")]
mod wall;
