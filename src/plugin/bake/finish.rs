//! From a network to a surface that shows it: growth, depth field and textures are made by background tasks, and a frame applies them
//! by handing them over.

use super::map_job::{Lines, SLICE};
use crate::CrackPreset;
use crate::growth::CrackGrowth;
use crate::paint::LookTable;
use crate::pattern::{CellTracker, CrackMask, Moment};
use crate::plugin::api::textures::{MAPS, Maps};
use crate::plugin::api::{CrackError, CrackSurface};
use crate::plugin::draw::async_playback::AsyncPlayback;
use crate::plugin::gpu::buffer::Stager;
use crate::plugin::gpu::textures::{self, Picture};
use crate::plugin::source::picture::BasePicture;
use crate::plugin::surface::active::Active;
use crate::plugin::surface::cracks::Added;
use crate::plugin::surface::frame::{frame, look, profile};
use crate::plugin::surface::regrow::{Past, grown_anew};
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
    pub(super) past: Past,
    pub(super) hits: u32,
    pub(super) first: First,
    pub(super) has_clock: bool,
    /// Whether the surface has not cracked yet.
    pub(super) is_new: bool,
    pub(super) stager: Option<Stager>,
}

impl FinishInputs {
    /// For a surface that has cracked.
    pub(super) fn of(active: &Active, seconds: Option<f32>, stager: Option<Stager>) -> Option<Self> {
        let past = Past::of(active);
        let seconds = seconds.filter(|_| past.hits.is_empty());
        let [diffuse, normal, depth, emissive] = active.canvas.textures.all().map(|texture| texture.is_some());
        Some(Self {
            surface: active.surface.clone(),
            preset: active.preset.clone(),
            base: active.canvas.base.clone(),
            mask: active.cracks.growth.mask().clone(),
            rect: active.canvas.views.get(active.canvas.view)?.rect,
            maps: Maps { diffuse, normal, depth, emissive },
            past,
            hits: active.cracks.hits,
            first: active.first(seconds),
            has_clock: active.playhead.clock.is_some(),
            is_new: false,
            stager,
        })
    }

    /// Whether the outcome is good for a surface as it is now; steps that it has grown since can be made up for.
    pub(super) fn fits(&self, active: &Active) -> bool {
        let view = active.canvas.views.get(active.canvas.view);
        !self.is_new
            && self.hits == active.cracks.hits
            && self.past.hits.len() == active.cracks.growth.impacts().len()
            && Arc::ptr_eq(&self.base, &active.canvas.base)
            && Arc::ptr_eq(&self.mask, active.cracks.growth.mask())
            && view.is_some_and(|view| view.rect == self.rect)
            && self.has_clock == active.playhead.clock.is_some()
            && self.surface == active.surface
            && self.preset == active.preset
    }
}

/// The way there, as a machine that is stepped.
pub(super) struct Finish {
    order: FinishInputs,
    added: Added,
    covered: Option<f32>,
    stage: Stage,
}

enum Stage {
    Grow,
    Draw(CrackGrowth, CellTracker),
    Paint {
        growth: CrackGrowth,
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
    pub(super) added: Added,
    pub(super) covered: Option<f32>,
    pub(super) growth: CrackGrowth,
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
        let Lines { network, opening, motion, covered, .. } = lines;
        Self { order, added: Added { network, opening, motion, steps: 0 }, covered, stage: Stage::Grow }
    }

    /// A slice of the work.
    pub(super) fn step(self: Box<Self>) -> Result<FinishStep, CrackError> {
        let Self { order, mut added, covered, stage } = *self;
        let stage = match stage {
            Stage::Grow => order.grow(&mut added)?,
            Stage::Draw(growth, cells) => order.draw(growth, cells, &added)?,
            Stage::Paint { growth, cells, drawn, mut texels, row } if row < order.rect.size().y => {
                let row = order.paint(&drawn, &mut texels, row);
                Stage::Paint { growth, cells, drawn, texels, row }
            }
            Stage::Paint { growth, cells, drawn, texels, .. } => {
                let Drawn { field, touched, look, replay } = *drawn;
                let playback = replay.is_some().then(|| AsyncPlayback::new(&growth, &texels));
                let pictures = textures::stage(texels, order.base.size, order.stager.as_ref());
                return Ok(FinishStep::Done(Box::new(Finished {
                    order,
                    added,
                    covered,
                    growth,
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
        Ok(FinishStep::More(Box::new(Self { order, added, covered, stage })))
    }
}

impl FinishInputs {
    fn grow(&self, added: &mut Added) -> Result<Stage, CrackError> {
        let extent = frame(self.rect)?.extent();
        let density = if self.surface.alpha_mask { self.base.density(self.rect) } else { None };
        let (mask, seed) = (self.mask.clone(), self.surface.seed);
        let mut growth = grown_anew(&self.preset, extent, seed, mask, density, Some(added), &self.past)?;
        // All of it is drawn.
        growth.take_changed(&mut Vec::new());
        growth.take_markers(&mut Vec::new());
        let mut cells = CellTracker::new(extent);
        cells.update(growth.network());
        Ok(Stage::Draw(growth, cells))
    }

    fn draw(&self, growth: CrackGrowth, cells: CellTracker, added: &Added) -> Result<Stage, CrackError> {
        let frame = frame(self.rect)?;
        let (mut field, mut touched) = (DepthField::new(frame), Touched::new(frame.size()));
        field.set_forbidden(&self.mask);
        field.set_layers(self.preset.look.layer(self.surface.seed));
        let profile = profile(&self.preset, self.base.is_nearest);
        let replay = match self.first.moment(growth.timeline().end()) {
            None => {
                stamp_all(&growth, &profile, &mut field, &mut touched);
                None
            }
            Some(moment)
                if let Some(on_the_way) = added.motion_at(moment, growth.params())
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
        Ok(Stage::Paint { growth, cells, drawn, texels: textures::texels(self.maps, &self.base), row: 0 })
    }

    /// Paints some rows from `row` on; returns the next one.
    fn paint(&self, drawn: &Drawn, texels: &mut [Option<Vec<u8>>; MAPS], row: u32) -> u32 {
        let size = self.rect.size();
        let end = size.y.min(row + (SLICE / size.x).max(1));
        let band = TexelRect { min: UVec2::new(0, row), max: UVec2::new(size.x, end) };
        let texels = texels.each_mut().map(Option::as_deref_mut);
        textures::paint(&self.base, &drawn.field, &drawn.look, &[band], self.rect.min, texels);
        end
    }
}
