//! Relief from one contour: all other contour lines, then a height field.
//!
//! The method is that of Misawa, Chiba and Saito ("Simulation of Natural Scenes: Procedure Modeling for Mountains",
//! 1986, in Japanese).

mod contours;
mod crater;
mod error;
mod export;
mod fourier;
mod generate;
mod heights;
mod heights_bands;
mod heights_error;
mod heights_near;
mod heights_params;
mod heights_slope;
#[cfg(test)]
mod heights_tests;
mod lattice;
mod mesh;
mod midpoint;
mod offset;
mod pace;
mod params;
mod scramble;
mod seeds;
mod simplify;
mod terrain;
mod terrain_blur;
mod terrain_noise;
mod terrain_normals;
#[cfg(test)]
mod tests;
mod untangle;

pub use contours::{Contours, Ring};
pub use crater::{Crater, CraterParams};
pub use error::ReliefError;
pub use fourier::Descriptors;
pub use generate::{ContourJob, MAX_LEVEL_POINTS, MAX_RING_POINTS};
pub use heights::{HeightMap, MAX_HEIGHT_POINTS, MAX_LEVEL, heights};
pub use heights_error::HeightError;
pub use heights_params::HeightParams;
pub use mesh::{MAX_DETAIL, ReliefFrame, ReliefMesh};
pub use params::{Join, MITER_LIMIT, Method, ReliefParams};
pub use seeds::{MAX_COORDINATE, MAX_SEEDS};
pub use terrain::{Ground, Sea, TerrainColors, colors};
pub use terrain_normals::normals;
