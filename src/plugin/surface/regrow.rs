//! Cracks grown again on another picture.

use super::active::Active;
use super::cracks::Added;
use crate::growth::CrackGrowth;
use crate::pattern::{CrackMask, SurfaceFrame};
use crate::plugin::api::CrackError;
use crate::{CrackPreset, Grid};
use bevy::prelude::*;
use std::sync::Arc;

/// On a picture of other proportions the same hits, in the same places, make other cracks: grown as far as they were.
/// `None` if they may stay.
pub(crate) fn regrow(
    active: &mut Active,
    frame: SurfaceFrame,
    mask: Arc<CrackMask>,
) -> Result<Option<CrackGrowth>, CrackError> {
    if active.cracks.growth.network().extent() == frame.extent() {
        return Ok(None);
    }
    let past = Past::of(active);
    let Active { preset, surface, cracks, .. } = active;
    grown_anew(preset, frame.extent(), surface.seed, mask, None, cracks.added.as_mut(), &past).map(Some)
}

/// What has happened to a surface.
pub(crate) struct Past {
    /// Places (texture coordinates) and energies of its hits.
    pub(crate) hits: Vec<(Vec2, f32)>,
    /// Steps of growth after those of what was added.
    pub(crate) steps: u32,
}

impl Past {
    pub(crate) fn of(active: &Active) -> Self {
        let extent = active.cracks.growth.network().extent();
        Self {
            hits: active.cracks.growth.impacts().iter().map(|impact| (impact.pos / extent, impact.energy)).collect(),
            steps: active.cracks.growth.steps() - active.cracks.added.as_ref().map_or(0, |added| added.steps),
        }
    }
}

/// The same hits in the same places, around what is added, grown as far as they were.
pub(crate) fn grown_anew(
    preset: &CrackPreset,
    extent: Vec2,
    seed: u64,
    mask: Arc<CrackMask>,
    density: Option<Grid<f32>>,
    added: Option<&mut Added>,
    past: &Past,
) -> Result<CrackGrowth, CrackError> {
    let mut growth = CrackGrowth::new(preset.growth.clone(), extent, seed)
        .map_err(|error| CrackError::Preset { reason: error.to_string() })?;
    growth.set_mask(mask);
    growth.set_density(density);
    if let Some(added) = added {
        added.steps = growth.add_cracks(&added.network, added.opening);
    }
    for (uv, energy) in &past.hits {
        growth.hit((*uv * extent).min(extent), *energy);
    }
    for _ in 0..past.steps {
        growth.step();
    }
    Ok(growth)
}
