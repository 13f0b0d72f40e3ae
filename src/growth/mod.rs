//! Cracks that grow by space colonization, step by step.
//!
//! The method is that of Runions et al. 2005 (leaf venation), as adapted to cracks by Couto et al.: *markers* are
//! laid out around a hit. At each step every marker attracts its nearest crack node within the *crack radius*. Every
//! attracted node grows a segment of length `D` in the mean direction of its markers (Couto et al., eq. 2). Markers
//! within the *kill distance* of a node are removed. Growth ends when no marker attracts a node.
//!
//! [`GrowthParams`] holds the settings, [`CrackGrowth`] the running growth. The documentation of
//! [`CrackGrowth::step`] lists the differences from the paper. All lengths are in pattern units: the surface's
//! shorter side is 1.
//!
//! ```
//! use bevy_crack::growth::{CrackGrowth, GrowthParams, MarkerLayout, Venation};
//!
//! // A marker in each square of a row of six, and a hit in the first: the crack runs to the right.
//! let params = GrowthParams {
//!     num_lines_grid: 1,
//!     num_columns_grid: 1,
//!     markers: MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 0.0 },
//!     reach: 8.0,
//!     crack_radius: 1.5,
//!     step_length: 0.5,
//!     wander: 0.0,
//!     venation: Venation::Open,
//!     ..GrowthParams::DEFAULT
//! };
//! let mut growth = CrackGrowth::new(params, [6.0, 1.0].into(), 1)?;
//! growth.hit([0.5, 0.5].into(), 1.0);
//! while growth.step().grew() {}
//! let places: Vec<f32> = growth.network().nodes().iter().map(|node| node.pos.x).collect();
//! assert_eq!(places, [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5]);
//! assert!(growth.network().nodes().iter().all(|node| node.pos.y == 0.5));
//! # Ok::<(), bevy_crack::growth::ParamError>(())
//! ```

mod advance;
mod aim;
mod arrest;
mod beyond;
mod birth;
mod bound;
mod changes;
mod closed;
mod cursor;
mod divide;
mod division;
mod domain;
mod draws;
mod field;
mod foreign;
mod forget;
mod grow_rays;
mod hit;
mod impact;
mod join;
mod lay_out;
mod layout;
mod links;
mod markers;
mod masonry;
mod nodes;
mod others;
mod params;
mod past;
mod plan;
mod pull;
mod ray_lines;
mod rays;
mod region;
mod settings;
mod starts;
mod state;
mod steer;
mod step;
mod strand_paths;
mod strands;
#[cfg(test)]
mod tests;
mod walls;
mod width;

pub use impact::{HitOutcome, Impact, MAX_ENERGY, Rejected};
pub use params::{GrowthParams, MAX_MARKERS, MarkerLayout, ParamError, StartLayout, Venation};
pub use past::{Past, PastError, PastEvent};
pub use state::{CrackGrowth, MarkerCounts};
pub use step::StepReport;
