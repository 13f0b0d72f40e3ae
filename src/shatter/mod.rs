//! Shards: the pieces into which cracks and border cut a surface.
//!
//! [`Cuts`] takes lines: the rough lines of a network, seams of a Voronoi diagram, or your own. [`shatter`] puts them
//! on an integer lattice (at least 2²³ units along the longer side) and makes them planar: crossings become shared
//! vertices, duplicates are removed, and so are edges that enclose nothing. The faces are the [`Shards`]: they tile
//! the surface exactly, and neighbours share every vertex of their common edge.
//!
//! Shards have triangles, [meshes](Shards::flat_mesh), [convex pieces](Shards::convex_pieces) for colliders, and
//! neighbours. A surface that is not flat is cut where it is laid out, and its pieces are curved: [`Shell`]. [`Support`] computes what falls, [`Shards::break_again`] cuts a piece further, and [`Burst`] moves the
//! pieces as a function of time, so that they can be shown at any speed, and backwards.
//!
//! ```
//! use bevy_crack::shatter::{Cuts, ShatterParams, shatter};
//!
//! // Two lines that cross: four pieces.
//! let mut cuts = Cuts::new([2.0, 1.0].into())?;
//! cuts.add_line(&[[0.5, 0.0].into(), [0.5, 1.0].into()])?;
//! cuts.add_line(&[[0.0, 0.25].into(), [2.0, 0.25].into()])?;
//! let shards = shatter(cuts, &ShatterParams::DEFAULT)?;
//! let mut areas: Vec<f32> = shards.iter().map(|shard| shard.area).collect();
//! areas.sort_by(f32::total_cmp);
//! assert_eq!(areas, [0.125, 0.375, 0.375, 1.125]);
//! # Ok::<(), bevy_crack::shatter::ShatterError>(())
//! ```

mod again;
mod burst;
mod cuts;
mod drawing;
mod faces;
mod floor;
mod lattice;
mod mesh;
mod rim;
mod shards;
mod shell;
mod sides;
mod support;
#[cfg(test)]
pub(crate) mod tests;
mod triangulate;

pub use again::{BreakAgain, SizeClasses};
pub use burst::{Burst, BurstParams, Flight, Pose};
pub use cuts::{Cuts, ShatterError, ShatterParams, shatter};
pub use floor::Floor;
pub use mesh::{MeshFrame, ShardMesh};
pub use rim::RimLook;
pub use shards::{ConvexPiece, Neighbour, ShardShape, Shards};
pub use shell::{Shell, ShellFrame, ShellMesh, ShellPart, ShellPlace, ShellTriangle};
pub use support::{Anchor, Fallen, Support};
