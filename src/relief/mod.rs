//! Relief from one contour: all other contour lines, then a height field.
//!
//! The method is that of Misawa, Chiba and Saito ("Simulation of Natural Scenes: Procedure Modeling for Mountains",
//! 1986, in Japanese). A seed contour is shrunk by a distance, again and again, until nothing is left ([`Method::Simple`],
//! section 3), and grown towards the foot of the mountain. Midpoints of long edges are displaced at random
//! ([`Method::Midpoint`], section 4.1), or the high frequencies of a contour get random phases ([`Method::Fourier`],
//! section 4.2, [`Descriptors`]), or both ([`Method::Improved`], section 4.3). [`Join`] says what becomes of corners
//! (section 2).
//!
//! [`ReliefParams`] holds the settings, [`ContourJob`] makes the contours level by level, [`Contours`] holds them.
//! All is computed on a lattice of whole numbers with exact predicates: every ring is simple, whatever the seeds and the parameters
//! are, and every level lies within the one before. The paper removes twists and crossings by two methods that help
//! in most cases (section 4.4); here winding numbers decide, which helps in all.
//!
//! [`heights`] makes a height field of contours ([`HeightMap`]), [`normals`] and [`colors`] its pictures, [`ReliefMesh`]
//! its mesh. A [`Crater`] is what a hit knocks out, in terraces.
//!
//! This goes beyond the paper: [`weathered`] ground, several seeds, holes, seeds from [`outlines`] in a picture, distances that vary along a contour
//! ([`ReliefParams::steepness`], [`ContourJob::with_factors`]), parameters that suit a seed ([`ReliefParams::estimate`]).
//!
//! ```
//! use bevy_crack::relief::{Contours, ReliefParams};
//! use glam::Vec2;
//!
//! // Two hills that have grown together.
//! let hill = |x: f32| (0..60).map(move |i| Vec2::new(x, 0.5) + 0.2 * Vec2::from_angle(0.104_72 * i as f32)).collect();
//! let params = ReliefParams { distance: 0.03, outward: 4, ..ReliefParams::SIMPLE };
//! let contours = Contours::generate(&params, &[hill(0.25), hill(0.75)], 1)?;
//! assert_eq!(contours.level(0).count(), 2);
//! assert_eq!(contours.level(3).count(), 2);
//! assert_eq!(contours.level(-4).count(), 1);
//! # Ok::<(), bevy_crack::relief::ReliefError>(())
//! ```

mod contours;
mod crater;
mod drainage;
mod error;
mod estimate;
mod export;
mod fourier;
mod generate;
mod heights;
mod heights_bands;
mod heights_near;
mod heights_params;
mod heights_slope;
#[cfg(test)]
mod heights_tests;
mod lattice;
mod made;
mod mesh;
mod midpoint;
mod offset;
mod pace;
mod params;
mod rows;
mod scramble;
mod seeds;
mod shapes;
mod shapes_island;
mod shapes_wall;
mod simplify;
mod stones;
mod terrain;
mod terrain_blur;
mod terrain_check;
mod terrain_coast;
mod terrain_colors;
mod terrain_faces;
mod terrain_noise;
mod terrain_normals;
mod terrain_paint;
mod terrain_valleys;
mod terrain_water;
mod terrain_wear;
#[cfg(test)]
pub(crate) mod tests;
mod trace;
mod untangle;
mod weather;

pub use contours::{Contours, Ring};
pub use crater::{Crater, CraterParams};
pub use error::ReliefError;
pub use fourier::Descriptors;
pub use generate::{ContourJob, MAX_LEVEL_POINTS, MAX_RING_POINTS};
pub use heights::{HeightMap, MAX_HEIGHT_POINTS, MAX_LEVEL, heights};
pub use heights_params::HeightParams;
pub use made::{Relief, ReliefJob, ReliefSettings};
pub use mesh::{MAX_DETAIL, ReliefFrame, ReliefMesh};
pub use params::{Join, MITER_LIMIT, Method, ReliefParams};
pub use seeds::{MAX_COORDINATE, MAX_SEEDS};
pub use shapes::ReliefShape;
pub use terrain::{Ground, Patches, Rivers, Sea, StoneColors, TerrainColors, Woods};
pub use terrain_colors::colors;
pub use terrain_normals::normals;
pub use trace::outlines;
pub use weather::{Weathering, weathered};
