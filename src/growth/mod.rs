//! Cracks by space colonization (Couto et al.; Runions et al. 2005): SPEC.

mod field;
mod links;
mod markers;
mod nodes;
mod params;
mod step;
#[cfg(test)]
mod tests;
mod width;

pub use params::{GrowthParams, MAX_MARKERS, MarkerLayout, ParamError, StartLayout};
pub use step::{Census, CrackGrowth, HitOutcome, Impact, MAX_ENERGY, Rejected, StepReport};
