// The check that a surface is `Send` goes through the nested types of a renderer buffer, which exceed the default
// limit.
#![recursion_limit = "256"]
#![cfg_attr(docsrs, feature(doc_cfg))]
//! Cracks that grow over sprites and walls, frame by frame, from the points where they are hit.
//!
//! The modules, in reading order (each imports only those above it):
//!
//! - [`math`] and [`Grid`]: portable arithmetic, seeded random streams, the one 2D buffer.
//! - [`pattern`]: networks of cracks, surface frames, masks and timelines: the types that the other modules share.
//! - [`raster`]: draws networks into a depth field.
//! - [`strands`]: cracks that follow a guidance field, made of small images.
//! - [`growth`]: cracks by space colonization, step by step.
//! - [`voronoi`]: cracks that draw a picture, all at once.
//! - [`blend`]: blends the relief of cracks into normal maps.
//! - [`relief`]: rock walls, islands and mountains from one contour line.
//! - [`paint`]: turns a base picture and a depth field into diffuse, normal and depth textures.
//! - [`preset`]: materials: how cracks grow, their cross-section and their look.
//! - [`shatter`]: the pieces into which cracks cut a surface, and how they fall.
//! - `plugin` (feature `bevy`): components, hits, systems, upload to the GPU.
//! - `editor` (feature `editor`): the workbench, a panel over any running game or scene.
//!
//! Without the feature `bevy` everything but `plugin` builds, with no engine.
//!
//! ```
//! use bevy_crack::{CrackPreset, growth::CrackGrowth};
//!
//! // A square pane, hit in the middle, grown to the end.
//! let mut growth = CrackGrowth::new(CrackPreset::GLASS.growth, [1.0, 1.0].into(), 7)?;
//! growth.hit([0.5, 0.5].into(), 1.0);
//! while growth.step().grew() {}
//! assert!(growth.network().nodes().len() > 100);
//! # Ok::<(), bevy_crack::growth::ParamError>(())
//! ```

pub mod blend;
#[cfg(test)]
mod fuzz;
mod grid;
pub mod growth;
pub mod math;
pub mod paint;
pub mod pattern;
pub mod preset;
pub mod raster;
pub mod relief;
pub mod shatter;
pub mod strands;
pub mod unwrap;
pub mod voronoi;

#[cfg(feature = "editor")]
pub mod editor;
#[cfg(feature = "bevy")]
pub mod plugin;

pub use grid::{Grid, OutOfMemory};
pub use preset::CrackPreset;

/// The items that most games need.
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
#[doc = include_str!("../docs/analogies.md")]
#[doc = include_str!("../docs/determinism_and_networking.md")]
#[doc = include_str!("../docs/guided_cracks.md")]
#[doc = include_str!("../docs/performance_and_memory.md")]
#[doc = include_str!("../docs/pitfalls.md")]
#[doc = include_str!("../docs/presets.md")]
#[doc = include_str!("../docs/relief.md")]
#[doc = include_str!("../docs/shattering.md")]
#[doc = include_str!("../docs/sprites.md")]
#[doc = include_str!("../docs/strands.md")]
#[doc = include_str!("../docs/walls_3d.md")]
#[doc = include_str!("../docs/workbench.md")]
pub struct PageExamples;
