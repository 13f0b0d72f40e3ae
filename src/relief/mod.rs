//! Relief from one contour: all other contour lines, then a height field.
//!
//! The method is that of Misawa, Chiba and Saito ("Simulation of Natural Scenes: Procedure Modeling for Mountains",
//! 1986, in Japanese).

mod contours;
mod crater;
mod export;
mod heights;
mod heights_bands;
mod heights_error;
mod heights_near;
mod heights_params;
mod heights_slope;
#[cfg(test)]
mod heights_tests;
mod mesh;
mod terrain;
mod terrain_blur;
mod terrain_noise;
mod terrain_normals;

pub use contours::{Contours, Ring};
pub use crater::{Crater, CraterParams};
pub use heights::{HeightMap, MAX_LEVEL, MAX_HEIGHT_POINTS, heights};
pub use heights_error::HeightError;
pub use heights_params::HeightParams;
pub use mesh::{MAX_DETAIL, ReliefFrame, ReliefMesh};
pub use terrain::{Ground, Sea, TerrainColors, colors};
pub use terrain_normals::normals;
