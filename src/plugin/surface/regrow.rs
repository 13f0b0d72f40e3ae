//! Cracks grown again: on another picture, around what a bake has made, or from a record.

use super::active::Active;
use super::cracks::Added;
use super::drawing::Frozen;
use super::frame::profile;
use super::stamp_network::stamp_all;
use super::tile_set::Touched;
use crate::growth::{CrackGrowth, Past, PastEvent};
use crate::pattern::{CellTracker, CrackMask, SurfaceFrame};
use crate::plugin::api::CrackError;
use crate::raster::DepthField;
use crate::{CrackPreset, Grid};
use std::sync::Arc;

/// On a picture of other proportions the same hits, in the same places, make other cracks: grown as far as they were.
/// `None` if they may stay.
pub(crate) fn regrow(
    active: &mut Active,
    frame: SurfaceFrame,
    mask: Arc<CrackMask>,
    is_nearest: bool,
) -> Result<Option<Regrown>, CrackError> {
    if active.cracks.growth.network().extent() == frame.extent() {
        return Ok(None);
    }
    let past = past(active);
    let Active { preset, surface, cracks, .. } = active;
    let seed = surface.seed;
    Regrowth { preset, frame, seed, is_nearest, mask, density: None }.grow(cracks.added.as_mut(), &past).map(Some)
}

/// What has happened to a surface.
pub(crate) fn past(active: &Active) -> Past {
    let growth = &active.cracks.growth;
    growth.past().unwrap_or_else(|| {
        // Of more hits than are remembered there is what became of them.
        let hit = |impact: &crate::growth::Impact| PastEvent::Hit { after: 0, pos: impact.pos, energy: impact.energy };
        let events = growth.impacts().iter().take(Past::MAX_EVENTS).map(hit).collect();
        Past { extent: growth.network().extent(), events, steps: growth.steps_made() }
    })
}

/// All that cracks which are grown again depend on, beside their past.
pub(crate) struct Regrowth<'a> {
    pub(crate) preset: &'a CrackPreset,
    pub(crate) frame: SurfaceFrame,
    pub(crate) seed: u64,
    /// Whether the picture is shown in whole texels.
    pub(crate) is_nearest: bool,
    pub(crate) mask: Arc<CrackMask>,
    pub(crate) density: Option<Grid<f32>>,
}

/// Cracks that were grown again.
pub(crate) struct Regrown {
    pub(crate) growth: CrackGrowth,
    /// The picture of those that were removed to make room.
    pub(crate) frozen: Option<Frozen>,
}

impl Regrowth<'_> {
    /// The same happens again around what is added.
    pub(crate) fn grow(self, added: Option<&mut Added>, past: &Past) -> Result<Regrown, CrackError> {
        let Self { preset, frame, seed, is_nearest, mask, density } = self;
        let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), seed)
            .map_err(|error| CrackError::Preset { reason: error.to_string() })?;
        growth.set_mask(mask.clone());
        growth.set_density(density);
        if let Some(added) = added {
            added.steps = growth.add_cracks(&added.network, added.opening);
        }
        // Drawn only if cracks are removed.
        let mut picture: Option<(DepthField, Frozen)> = None;
        growth.replay_with(past, |growth, keep| {
            let (mut field, before) = picture.take().map_or_else(
                || {
                    let mut field = DepthField::new(frame);
                    field.set_forbidden(&mask);
                    field.set_layers(preset.look.layer(seed));
                    (field, None)
                },
                |(field, frozen)| (field, Some(frozen)),
            );
            stamp_all(growth, &profile(preset, is_nearest), &mut field, &mut Touched::new(frame.size()));
            let mut cells = CellTracker::new(frame.extent());
            let (frozen, _) = Frozen::after(before, growth, keep, &mut field, &mut cells);
            picture = Some((field, frozen));
        });
        Ok(Regrown { growth, frozen: picture.map(|(_, frozen)| frozen) })
    }
}
