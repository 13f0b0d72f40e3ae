//! Relief from one contour: all other contour lines, then a height field.
//!
//! The method is that of Misawa, Chiba and Saito ("Simulation of Natural Scenes: Procedure Modeling for Mountains",
//! 1986, in Japanese).

mod contours;

pub use contours::{Contours, Ring};
