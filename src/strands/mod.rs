//! Single cracks that follow a direction: primitives along a guidance field.
//!
//! The method is that of Jeong ("Primitive-based Crack Synthesis with Guidance Vector Field", Sungkyunkwan
//! University). The artist gives starts and [`Directions`]; Perlin noise turns the directions ([`GuidanceField`], section 3.1).
//! A path follows the field from each start by propagation costs ([`Propagation`], section 3.2). Branches leave it
//! (section 3.4). Small images of cracks, [`Primitive`]s, are joined along the path and bent with it (section 3.3).
//!
//! This goes beyond the paper: strands keep [a distance](StrandParams::repulsion) or join in a T, primitives
//! with connectors on four sides make [nets](StrandParams::lanes), paths can turn in any direction, and the result is a
//! [`Network`](crate::pattern::Network), which grows, is painted and shatters like all other cracks.
//!
//! ```
//! use bevy_crack::{growth::{CrackGrowth, GrowthParams}, strands::{Directions, StrandParams, StrandStart, Strands}};
//!
//! // A crack across a road, from the left to the right.
//! let starts = [StrandStart::new([0.0, 0.5].into())];
//! let along = Directions::Linear([1.0, 0.0].into());
//! let strands = Strands::new(&StrandParams::ASPHALT, along, &starts, [1.0, 1.0].into(), 7)?;
//! let network = strands.network(&StrandParams::ASPHALT.material.primitives())?;
//!
//! let mut growth = CrackGrowth::new(GrowthParams::DEFAULT, [1.0, 1.0].into(), 7)?;
//! growth.add_cracks(&network, 4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bend;
mod course;
mod error;
mod field;
mod grow;
mod line;
mod material;
mod near;
mod params;
mod picture;
mod presets;
mod primitive;
mod set;
#[cfg(test)]
mod tests;
mod trace;
mod walk;

pub use error::{PrimitiveError, StrandError};
pub use field::{Directions, GuidanceField, MAX_LINE_POINTS};
pub use grow::{MAX_STARTS, MAX_STRAND_POINTS, Strand, StrandEnd, StrandStart};
pub use line::{PrimitiveLine, PrimitivePoint};
pub use material::Material;
pub use params::{Propagation, StrandParams};
pub use primitive::{PRIMITIVE_SIDES, Primitive};
pub(crate) use set::GrowingStrands;
pub use set::Strands;
