//! From a network to a surface that shows it: growth, depth field and textures are made by background tasks, and a frame applies them
//! by handing them over.

use super::map_job::{Lines, SLICE};
use crate::CrackPreset;
use crate::growth::{CrackGrowth, Past};
use crate::paint::LookTable;
use crate::pattern::{CellTracker, CrackMask, Moment};
use crate::plugin::api::textures::{MAPS, Maps};
use crate::plugin::api::{CrackError, CrackRecord, CrackSurface};
use crate::plugin::draw::async_playback::AsyncPlayback;
use crate::plugin::gpu::buffer::Stager;
use crate::plugin::gpu::textures::{self, Picture};
use crate::plugin::source::picture::BasePicture;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracks::Added;
use crate::plugin::surface::drawing::Frozen;
use crate::plugin::surface::frame::{frame, look, profile};
use crate::plugin::surface::regrow::{Regrown, Regrowth, past};
use crate::plugin::surface::stamp_network::stamp_all;
use crate::plugin::surface::tile_set::Touched;
use crate::plugin::surface::time::First;
use crate::raster::{DepthField, Replay, ReplayChanges, TexelRect};
use bevy::prelude::*;
use std::sync::Arc;

/// All that the outcome depends on, beside the cracks.
pub(super) struct FinishInputs {
    pub(super) surface: CrackSurface,
    pub(super) preset: CrackPreset,
    pub(super) base: Arc<BasePicture>,
    pub(super) mask: Arc<CrackMask>,
    pub(super) rect: TexelRect,
    pub(super) maps: Maps,
    /// What grows around what is added.
    pub(super) past: Past,
    /// What had happened to the surface when this was ordered.
    pub(super) seen: Seen,
    pub(super) first: First,
    pub(super) has_clock: bool,
    /// Whether the surface has not cracked yet.
    pub(super) is_new: bool,
    pub(super) stager: Option<Stager>,
}

impl FinishInputs {
    /// For a surface that has cracked.
    pub(super) fn of(
        active: &Active,
        seconds: Option<f32>,
        stager: Option<Stager>,
        record: Option<&CrackRecord>,
    ) -> Option<Self> {
        let own = past(active);
        let past = record.map_or(own.clone(), |record| record.past.followed_by(&own));
        let seconds = seconds.filter(|_| past.is_empty());
        let first = match record {
            Some(record) => First::of(active.playhead.clock, record.time, None),
            None => active.first(seconds),
        };
        let [diffuse, normal, depth, emissive] = active.canvas.textures.all().map(|texture| texture.is_some());
        Some(Self {
            surface: active.surface.clone(),
            preset: active.preset.clone(),
            base: active.canvas.base.clone(),
            mask: active.cracks.growth.mask().clone(),
            rect: active.canvas.views.get(active.canvas.view)?.rect,
            maps: Maps { diffuse, normal, depth, emissive, mips: active.canvas.has_mips },
            past,
            seen: Seen::of(active),
            first,
            has_clock: active.playhead.clock.is_some(),
            is_new: false,
            stager,
        })
    }

    /// Whether the outcome is good for a surface as it is now; steps that it has grown since can be made up for.
    pub(super) fn fits(&self, active: &Active) -> bool {
        let view = active.canvas.views.get(active.canvas.view);
        !self.is_new
            && self.seen == (Seen { steps: self.seen.steps, ..Seen::of(active) })
            && Arc::ptr_eq(&self.base, &active.canvas.base)
            && Arc::ptr_eq(&self.mask, active.cracks.growth.mask())
            && view.is_some_and(|view| view.rect == self.rect)
            && self.has_clock == active.playhead.clock.is_some()
            && self.surface == active.surface
            && self.preset == active.preset
    }
}

/// What had happened to a surface.
#[derive(Default, PartialEq)]
pub(super) struct Seen {
    hits: u32,
    impacts: usize,
    /// Steps of growth.
    pub(super) steps: u32,
}

impl Seen {
    fn of(active: &Active) -> Self {
        let growth = &active.cracks.growth;
        Self { hits: active.cracks.hits, impacts: growth.impacts().len(), steps: growth.steps_made() }
    }
}

/// The way there, as a machine that is stepped.
pub(super) struct Finish {
    order: FinishInputs,
    added: Option<Added>,
    record: Option<Box<CrackRecord>>,
    covered: Option<f32>,
    stage: Stage,
}

enum Stage {
    Grow,
    Draw(Regrown, CellTracker),
    Paint {
        grown: Regrown,
        cells: CellTracker,
        drawn: Box<Drawn>,
        texels: [Option<Vec<u8>>; MAPS],
        /// The first row that is not painted yet.
        row: u32,
    },
}

struct Drawn {
    field: DepthField,
    touched: Touched,
    look: LookTable,
    replay: Option<(Replay, Moment)>,
}

/// What a frame applies.
pub(super) struct Finished {
    pub(super) order: FinishInputs,
    pub(super) added: Option<Added>,
    pub(super) record: Option<Box<CrackRecord>>,
    pub(super) covered: Option<f32>,
    pub(super) growth: CrackGrowth,
    pub(super) frozen: Option<Frozen>,
    pub(super) cells: CellTracker,
    pub(super) field: DepthField,
    pub(super) touched: Touched,
    pub(super) look: LookTable,
    pub(super) replay: Option<(Replay, Moment)>,
    /// If it is to show other times.
    pub(super) playback: Option<AsyncPlayback>,
    /// The texels of each texture, and the same where the renderer can read them.
    pub(super) pictures: [Option<Picture>; MAPS],
}

/// A slice further.
pub(super) enum FinishStep {
    More(Box<Finish>),
    Done(Box<Finished>),
}

impl Finish {
    pub(super) fn new(order: FinishInputs, lines: Lines) -> Self {
        let Lines { added, record, covered, .. } = lines;
        Self { order, added, record, covered, stage: Stage::Grow }
    }

    /// A slice of the work.
    pub(super) fn step(self: Box<Self>) -> Result<FinishStep, CrackError> {
        let Self { order, mut added, record, covered, stage } = *self;
        let stage = match stage {
            Stage::Grow => order.grow(added.as_mut())?,
            Stage::Draw(grown, cells) => order.draw(grown, cells, added.as_ref())?,
            Stage::Paint { grown, cells, drawn, mut texels, row } if row < order.rect.size().y => {
                let row = order.paint(&drawn, &mut texels, row);
                Stage::Paint { grown, cells, drawn, texels, row }
            }
            Stage::Paint { grown: Regrown { growth, frozen }, cells, drawn, texels, .. } => {
                let Drawn { field, touched, look, replay } = *drawn;
                let playback = replay.is_some().then(|| AsyncPlayback::new(&growth, &texels));
                let pictures = textures::stage(texels, order.base.size, order.stager.as_ref());
                return Ok(FinishStep::Done(Box::new(Finished {
                    order,
                    added,
                    record,
                    covered,
                    growth,
                    frozen,
                    cells,
                    field,
                    touched,
                    look,
                    replay,
                    playback,
                    pictures,
                })));
            }
        };
        Ok(FinishStep::More(Box::new(Self { order, added, record, covered, stage })))
    }
}

impl FinishInputs {
    fn grow(&self, added: Option<&mut Added>) -> Result<Stage, CrackError> {
        let frame = frame(self.rect, &self.base)?;
        let regrowth = Regrowth {
            preset: self.preset.clone(),
            base: self.base.clone(),
            rect: self.rect,
            frame,
            seed: self.surface.seed,
            alpha_mask: self.surface.alpha_mask,
            mask: self.mask.clone(),
        };
        let mut grown = regrowth.grow(added, &self.past)?;
        // All of it is drawn.
        grown.growth.take_changed(&mut Vec::new());
        grown.growth.take_markers(&mut Vec::new());
        let mut cells = CellTracker::new(frame.extent());
        cells.update(grown.growth.network());
        Ok(Stage::Draw(grown, cells))
    }

    fn draw(&self, grown: Regrown, cells: CellTracker, added: Option<&Added>) -> Result<Stage, CrackError> {
        let (frame, growth) = (frame(self.rect, &self.base)?, &grown.growth);
        let (mut field, mut touched) = (DepthField::new(frame), Touched::new(frame.size()));
        field.set_forbidden(&self.mask);
        field.set_layers(self.preset.look.layer(self.surface.seed));
        let profile = profile(&self.preset, self.base.is_nearest);
        let replay = match self.first.moment(growth.timeline().end()) {
            None => {
                if let Some(frozen) = &grown.frozen {
                    frozen.draw(&mut field);
                }
                stamp_all(growth, &profile, &mut field, &mut touched);
                None
            }
            Some(moment)
                if let Some(on_the_way) = added.and_then(|added| added.motion_at(moment, growth.params()))
                    && on_the_way.draw(&profile, &mut field, &mut touched) =>
            {
                Some((Replay::stale(frame.size(), profile), moment))
            }
            Some(moment) => {
                let (mut replay, mut redrawn) = (Replay::new(frame.size(), profile), ReplayChanges::default());
                replay.show(&mut field, growth.network(), growth.timeline(), moment, &mut redrawn);
                touched.follow(&redrawn);
                Some((replay, moment))
            }
        };
        let drawn = Box::new(Drawn { field, touched, look: look(&self.preset, frame, self.base.is_nearest)?, replay });
        Ok(Stage::Paint { grown, cells, drawn, texels: textures::texels(self.maps, &self.base), row: 0 })
    }

    /// Paints some rows from `row` on; returns the next one.
    fn paint(&self, drawn: &Drawn, texels: &mut [Option<Vec<u8>>; MAPS], row: u32) -> u32 {
        let size = self.rect.size();
        let end = size.y.min(row + (SLICE / size.x).max(1));
        let band = TexelRect { min: UVec2::new(0, row), max: UVec2::new(size.x, end) };
        let slices = texels.each_mut().map(Option::as_deref_mut);
        textures::paint(&self.base, None, &drawn.field, &drawn.look, &[band], self.rect.min, slices);
        textures::update_mips(texels, self.base.size, &[band], self.rect.min);
        end
    }
}
