//! Cracks that draw a picture, all at once: Voronoi diagrams of a weighted graph.
//!
//! The method is that of Mould 2005 ("Image-Guided Fracture"). Every texel is joined to its four neighbours by edges
//! with the cost
//!
//! ```text
//! e_ij = α max(N_i, N_j) + β + Σ_k γ_k max(I^k_i, I^k_j)        (eq. 1, 2 and 4)
//! ```
//!
//! `N` is noise and the `I^k` are guides. A texel belongs to the *site* with the cheapest path to it. There is a
//! crack where two regions meet. Strokes of a guide are expensive to cross, so regions from both sides meet in their
//! middle.
//!
//! [`VoronoiParams`] and [`Guide`] hold the settings, [`VoronoiBake`] computes the map row by row. [`VoronoiMap`]
//! holds regions and costs of every texel, [`Seams`] the cracks as lines. [`SeamMotion`] moves them as weights change. [`MapCharts`] is a
//! surface that is laid out in several charts. Costs are integers (β is 256 units), so the
//! map is the same on every machine; ties go to the lower site.
//!
//! Differs from the paper: a level of cracks divides the regions of the level before exactly, as if crossing an older
//! crack were impossible; the paper only makes it more expensive.
//!
//! ```
//! use bevy_crack::voronoi::{SiteLayout, VoronoiParams, voronoi_map};
//! use std::ops::ControlFlow;
//!
//! // Two sites and no noise: the crack runs half way between them.
//! let sites = SiteLayout::Given(vec![[0.1, 0.3].into(), [0.5, 0.3].into()]);
//! let params = VoronoiParams { alpha: 0.0, layout: sites, ..VoronoiParams::DEFAULT };
//! let map = voronoi_map(&params, &[], [7, 5].into(), 1, |_| ControlFlow::Continue(()))?;
//! for y in 0..5 {
//!     let row: Vec<_> = (0..7).filter_map(|x| map.region(x, y)).collect();
//!     assert_eq!(row, [0, 0, 1, 1, 1, 1, 1]);
//! }
//! # Ok::<(), bevy_crack::voronoi::VoronoiError>(())
//! ```

mod bake;
mod branches;
mod chains;
mod charts;
mod edges;
mod front;
mod ink;
mod lattice;
mod level;
mod map;
mod motion;
mod noise;
mod outline;
mod params;
mod resample;
mod rough;
mod seams;
mod search;
mod sites;
mod strokes;
#[cfg(test)]
mod tests;
mod text;
mod trace;
mod widths;

pub use bake::{BakeStatus, VoronoiBake};
pub use charts::MapCharts;
pub use edges::edges;
pub use front::{FRONT_STEP, Front};
pub use ink::{ink, lightness};
pub use map::VoronoiMap;
pub use motion::SeamMotion;
pub use params::{Guide, MAX_LEVELS, MAX_SITES, SiteLayout, VoronoiError, VoronoiParams};
pub use seams::{Seam, SeamVertex, Seams};
pub use strokes::StrokeReport;
pub use text::{FONT, draw_text};

use glam::UVec2;
use std::ops::ControlFlow;

/// Rows between two calls of the progress callback.
const SLICE: usize = 64;

/// Nearest site and path cost of every texel over the weighted lattice, in one call.
///
/// `progress` is called with the share that is done, 0..1, and stops the work if it returns `Break`.
///
/// # Errors
/// [`VoronoiError::OutOfRange`] or [`VoronoiError::Size`] if a parameter or the size is out of its range,
/// [`VoronoiError::Cancelled`] if `progress` returned `Break`.
pub fn voronoi_map(
    params: &VoronoiParams,
    guides: &[Guide],
    size: UVec2,
    seed: u64,
    mut progress: impl FnMut(f32) -> ControlFlow<()>,
) -> Result<VoronoiMap, VoronoiError> {
    let mut bake = VoronoiBake::new(params.clone(), guides.to_vec(), size, seed)?.regions_alone();
    while let BakeStatus::Working(share) = bake.step(SLICE) {
        if progress(share).is_break() {
            return Err(VoronoiError::Cancelled);
        }
    }
    Ok(bake.finish().0)
}
