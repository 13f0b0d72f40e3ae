//! Cracks by space colonization (Couto et al.; Runions et al. 2005): SPEC.

mod params;
mod step;

pub use params::{GrowthParams, MarkerLayout, ParamError, StartLayout};
pub use step::{Census, CrackGrowth, HitOutcome, Impact, Rejected, StepReport};
