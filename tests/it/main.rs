//! What the crate promises, from the outside. One binary, one module a subject; a new test goes to the module it fits or to a
//! new one beside them, never to a further file directly in `tests/` (each of those would link the engine again).

#![cfg(test)]

use cap::Cap;
use std::alloc::System;

/// Counts the bytes that this process has in use.
#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

#[cfg(all(feature = "2d", feature = "3d"))]
mod analogies;
mod analogy;
#[cfg(all(feature = "2d", feature = "3d"))]
mod apps;
mod blend;
#[cfg(all(feature = "2d", feature = "3d"))]
mod blink;
#[cfg(all(feature = "2d", feature = "3d"))]
mod budgets;
#[cfg(all(feature = "2d", feature = "3d"))]
mod cells;
#[cfg(all(feature = "2d", feature = "3d"))]
mod chips;
#[cfg(all(feature = "2d", feature = "3d"))]
mod clock;
#[cfg(all(feature = "2d", feature = "3d"))]
mod crumbs;
mod docs;
#[cfg(all(feature = "2d", feature = "3d"))]
mod films;
#[cfg(all(feature = "2d", feature = "3d"))]
mod freeze;
#[cfg(all(feature = "2d", feature = "3d"))]
mod gpu;
#[cfg(all(feature = "2d", feature = "3d"))]
mod groups;
#[cfg(all(feature = "2d", feature = "3d"))]
mod guided;
#[cfg(all(feature = "2d", feature = "3d"))]
mod hits;
#[cfg(all(feature = "2d", feature = "3d"))]
mod images;
mod imports;
#[cfg(all(feature = "2d", feature = "3d"))]
mod lifecycle;
#[cfg(all(feature = "2d", feature = "3d"))]
mod looks;
mod masks;
#[cfg(all(feature = "2d", feature = "3d"))]
mod normals;
mod pictures;
#[cfg(all(feature = "2d", feature = "3d"))]
mod plugin;
#[cfg(all(feature = "2d", feature = "3d"))]
mod prepare;
#[cfg(feature = "serde")]
mod presets;
#[cfg(all(feature = "2d", feature = "3d"))]
mod random;
#[cfg(all(feature = "2d", feature = "3d"))]
mod records;
#[cfg(all(feature = "2d", feature = "3d"))]
mod reliefs;
mod replay;
#[cfg(all(feature = "2d", feature = "3d"))]
mod rooms;
#[cfg(all(feature = "2d", feature = "3d"))]
mod saved;
#[cfg(all(feature = "2d", feature = "3d"))]
mod shards;
#[cfg(all(feature = "2d", feature = "3d"))]
mod shards_bounds;
#[cfg(all(feature = "2d", feature = "3d"))]
mod shards_life;
#[cfg(all(feature = "2d", feature = "3d"))]
mod shards_order;
#[cfg(all(feature = "2d", feature = "3d"))]
mod shells;
#[cfg(all(feature = "2d", feature = "3d"))]
mod solids;
#[cfg(all(feature = "2d", feature = "3d"))]
mod strands;
#[cfg(all(feature = "2d", feature = "3d"))]
mod support;
#[cfg(all(feature = "2d", feature = "3d"))]
mod unfolded;
#[cfg(all(feature = "2d", feature = "3d"))]
mod values;
mod voronoi;
