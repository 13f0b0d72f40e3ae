//! Cracks grown again: on another picture, around what a bake has made, or from a record.

use super::active::Active;
use super::cracks::Added;
use super::drawing::Frozen;
use super::frame::profile;
use super::stamp_network::stamp_all;
use super::tile_set::Touched;
use crate::CrackPreset;
use crate::growth::{CrackGrowth, Past, PastEvent};
use crate::pattern::{CellTracker, CrackMask, SurfaceFrame};
use crate::plugin::api::CrackError;
use crate::plugin::jobs::background::{BackgroundJob, PATIENCE, guarded};
use crate::plugin::source::picture::BasePicture;
use crate::raster::{DepthField, TexelRect};
use bevy::platform::time::Instant;
use std::sync::Arc;

/// Nodes up to which cracks are grown again in the frame.
const MAX_NODES: usize = 1024;

/// Markers up to which they are, which are laid out again.
const MAX_MARKERS: u32 = 4096;

/// Hits and changes up to which they are. Of old cracks there may be many more than nodes are left.
const MAX_EVENTS: usize = 16;

/// What has changed so often before it was grown, as films of other proportions do, is grown in the frame.
const MAX_RESTARTS: u32 = 3;

/// Cracks that a task grows again. What was shown before is shown until then.
pub(crate) struct Regrowing {
    inputs: Regrowth,
    past: Past,
    job: BackgroundJob<Work, Result<(Regrown, Option<Added>), CrackError>>,
    since: Instant,
    restarts: u32,
}

/// What has become of cracks on another picture.
pub(crate) enum OnAnother {
    /// They may stay: the picture has the same proportions.
    Same,
    /// They are being grown.
    Wait,
    Grown(Box<Regrown>),
}

struct Work {
    inputs: Regrowth,
    past: Past,
    added: Option<Added>,
}

impl Work {
    fn grow(mut self) -> Result<(Regrown, Option<Added>), CrackError> {
        guarded(|| {
            let grown = self.inputs.grow(self.added.as_mut(), &self.past)?;
            Ok((grown, self.added))
        })
    }
}

/// On a picture of other proportions the same hits, in the same places, make other cracks: grown as far as they are. By a task, if that
/// takes longer than a frame has, unless it is to be `at_once`.
pub(crate) fn regrow(active: &mut Active, inputs: Regrowth, at_once: bool) -> Result<OnAnother, CrackError> {
    active.cracks.growth.finish_step();
    let before = active.regrowing.take();
    if active.cracks.growth.network().extent() == inputs.frame.extent() {
        return Ok(OnAnother::Same);
    }
    let past = past(active);
    let restarts = match before {
        Some(mut known) if known.inputs.is_like(&inputs) && known.past.events == past.events => {
            let Some(made) = known.job.take_if_done(known.since.elapsed() >= PATIENCE) else {
                active.regrowing = Some(known);
                return Ok(OnAnother::Wait);
            };
            let (mut grown, added) = made?;
            // The cracks that are shown have gone on.
            (known.past.steps..past.steps).for_each(|_| _ = grown.growth.step());
            active.cracks.added = added;
            return Ok(OnAnother::Grown(Box::new(grown)));
        }
        known => known.map_or(0, |known| known.restarts + 1),
    };
    let growth = &active.cracks.growth;
    let is_little = growth.network().nodes().len() <= MAX_NODES
        && growth.marker_counts().total <= MAX_MARKERS
        && past.events.len() <= MAX_EVENTS;
    if at_once || restarts > MAX_RESTARTS || is_little {
        return Ok(OnAnother::Grown(Box::new(inputs.grow(active.cracks.added.as_mut(), &past)?)));
    }
    let work = Work { inputs: inputs.clone(), past: past.clone(), added: active.cracks.added.clone() };
    let job = BackgroundJob::start(work, Work::grow);
    active.regrowing = Some(Box::new(Regrowing { inputs, past, job, since: Instant::now(), restarts }));
    Ok(OnAnother::Wait)
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
#[derive(Clone)]
pub(crate) struct Regrowth {
    pub(crate) preset: CrackPreset,
    pub(crate) base: Arc<BasePicture>,
    /// What is shown of the picture.
    pub(crate) rect: TexelRect,
    pub(crate) frame: SurfaceFrame,
    pub(crate) seed: u64,
    /// Whether there are no cracks on what is transparent.
    pub(crate) alpha_mask: bool,
    pub(crate) mask: Arc<CrackMask>,
}

/// Cracks that were grown again.
pub(crate) struct Regrown {
    pub(crate) growth: CrackGrowth,
    /// The picture of those that were removed to make room.
    pub(crate) frozen: Option<Frozen>,
}

impl Regrowth {
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let Self { preset, base, rect, frame, seed, alpha_mask, mask } = self;
        let is_same_mask = Arc::ptr_eq(mask, &other.mask) || *mask == other.mask;
        is_same_mask
            && Arc::ptr_eq(base, &other.base)
            && (rect, frame, seed) == (&other.rect, &other.frame, &other.seed)
            && (preset, alpha_mask) == (&other.preset, &other.alpha_mask)
    }

    /// The same happens again around what is added.
    pub(crate) fn grow(self, added: Option<&mut Added>, past: &Past) -> Result<Regrown, CrackError> {
        let Self { preset, base, rect, frame, seed, alpha_mask, mask } = self;
        let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), seed)
            .map_err(|error| CrackError::Preset { reason: error.to_string() })?;
        growth.set_mask(mask.clone());
        growth.set_density(base.density(rect, alpha_mask));
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
            stamp_all(growth, &profile(&preset, base.is_nearest), &mut field, &mut Touched::new(frame.size()));
            let mut cells = CellTracker::new(frame.extent());
            let (frozen, _) = Frozen::after(before, growth, keep, &mut field, &mut cells);
            picture = Some((field, frozen));
        });
        Ok(Regrown { growth, frozen: picture.map(|(_, frozen)| frozen) })
    }
}
