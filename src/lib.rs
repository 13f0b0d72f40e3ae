// Whether a surface may go from thread to thread depends on what a buffer of the renderer is made of, which goes deep.
#![recursion_limit = "256"]
#![cfg_attr(docsrs, feature(doc_cfg))]
//! Cracks that grow over sprites and walls, frame by frame, from the points where they are hit.
//!
//! The rooms, in reading order:
//!
//! - [`math`], [`grid`](Grid): portable arithmetic, seeded random streams, the one 2D buffer.
//! - [`pattern`]: networks and frames, the words everything else speaks.
//! - [`growth`]: cracks by space colonization, step by step.
//! - [`raster`]: networks to a depth field.
//! - [`voronoi`]: cracks that draw a picture, all at once.
//! - [`paint`]: a base picture and a depth field to diffuse, normal and depth textures.
//! - [`shatter`]: the pieces into which cracks cut a surface, and how they fall.
//! - `plugin` (feature `bevy`): components, hits, systems, upload.

mod grid;
pub mod growth;
pub mod math;
pub mod paint;
pub mod pattern;
pub mod preset;
pub mod raster;
pub mod shatter;
pub mod voronoi;

#[cfg(feature = "bevy")]
pub mod plugin;

pub use grid::Grid;
pub use preset::CrackPreset;

/// What a game needs.
pub mod prelude {
    #[cfg(feature = "bevy")]
    pub use crate::plugin::prelude::*;
}

/// The examples of the README, compiled.
#[cfg(all(doctest, feature = "2d"))]
#[doc = include_str!("../README.md")]
pub struct ReadmeExamples;

/// The examples of the pages in `docs`, compiled.
#[cfg(all(doctest, feature = "2d", feature = "3d"))]
#[doc = include_str!("../docs/determinism_and_networking.md")]
#[doc = include_str!("../docs/guided_cracks.md")]
#[doc = include_str!("../docs/performance_and_memory.md")]
#[doc = include_str!("../docs/pitfalls.md")]
#[doc = include_str!("../docs/presets.md")]
#[doc = include_str!("../docs/shattering.md")]
#[doc = include_str!("../docs/sprites.md")]
#[doc = include_str!("../docs/walls_3d.md")]
pub struct PageExamples;
