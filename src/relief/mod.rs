//! Relief from one contour: all other contour lines, then a height field.
//!
//! The method is that of Misawa, Chiba and Saito ("Simulation of Natural Scenes: Procedure Modeling for Mountains",
//! 1986, in Japanese).

mod contours;
mod error;
mod fourier;
mod generate;
mod lattice;
mod midpoint;
mod offset;
mod pace;
mod params;
mod scramble;
mod seeds;
mod simplify;
#[cfg(test)]
mod tests;
mod untangle;

pub use contours::{Contours, Ring};
pub use error::ReliefError;
pub use fourier::Descriptors;
pub use generate::{ContourJob, MAX_LEVEL_POINTS, MAX_RING_POINTS};
pub use params::{Join, MITER_LIMIT, Method, ReliefParams};
pub use seeds::{MAX_COORDINATE, MAX_SEEDS};
