//! [`Active`]: a surface that has been hit.

use super::analogy::AnalogyState;
use super::blending::Blending;
use super::canvas::Canvas;
use super::cracks::Cracks;
use super::drawing::Drawing;
use super::frame::profile;
use super::freezing::Freezing;
use super::playhead::Playhead;
use super::regrow::Regrowing;
use crate::growth::CrackGrowth;
use crate::paint::LookTable;
use crate::plugin::api::surface::CrackSurface;
use crate::plugin::api::textures::CrackTextures;
use crate::plugin::carrier::kind::Carrier;
use crate::plugin::gpu::memory::TextureBytes;
use crate::plugin::source::picture::BasePicture;
use crate::raster::{DepthField, DirtyTiles, TexelRect};
use crate::{CrackPreset, Grid};
use bevy::{asset::UntypedAssetId, prelude::*};
use std::sync::Arc;

/// A surface that has been hit.
pub(crate) struct Active {
    /// The component as it was when it was last looked at.
    pub(crate) surface: CrackSurface,
    /// The preset in use; that of the component unless it was refused.
    pub(crate) preset: CrackPreset,
    /// Whether the component or the preset has changed and was not applied yet.
    pub(crate) has_new_settings: bool,
    pub(crate) cracks: Cracks,
    pub(crate) drawing: Drawing,
    pub(crate) canvas: Canvas,
    pub(crate) playhead: Playhead,
    pub(crate) blending: Blending,
    pub(crate) analogy: AnalogyState,
    pub(crate) carrier: Carrier,
    pub(crate) turn: Turn,
    /// Its cracks on another picture, until they are there.
    pub(crate) regrowing: Option<Box<Regrowing>>,
    /// What is left of its cracks when it forgets the oldest, until that is there. It does not grow meanwhile.
    pub(crate) freezing: Option<Box<Freezing>>,
    /// Bytes of its textures.
    pub(crate) bytes: TextureBytes,
    /// Nodes of the network and closed cells when shards last fell by themselves.
    pub(crate) fell_at: (usize, usize),
    /// What its shards are made from: changes whenever shards leave or return, or the surface becomes another.
    pub(crate) revision: Arc<()>,
}

/// In which queues a surface is.
#[derive(Default)]
pub(crate) struct Turn {
    /// Whether it is in a growing queue: it grows, or its time passes.
    pub(crate) is_growing: bool,
    /// Whether it is in the queue of those whose last hit is laid out: its growth waits for that.
    pub(crate) is_laying_out: bool,
    /// Whether it is in the dirty queue.
    pub(crate) is_dirty: bool,
    /// Whether its growth waits for what it is to show next.
    pub(crate) is_held: bool,
    /// Whether a frame had no time to paint it: its growth waits for that.
    pub(crate) is_late: bool,
    /// Whether anything has changed since its cracks were last stamped.
    pub(crate) has_news: bool,
    /// Whether a frame had no time to stamp all that has grown.
    pub(crate) is_stamping: bool,
    /// Whether its end has not been reported yet.
    pub(crate) is_open: bool,
    /// Whether it is in the queue of those whose normals are to be blended.
    pub(crate) is_blending: bool,
    /// Whether it is to shatter: nothing else makes its pictures then.
    pub(crate) is_to_shatter: bool,
}

/// What a surface is made of before it cracks.
pub(crate) struct SurfaceParts {
    pub(crate) surface: CrackSurface,
    pub(crate) preset: CrackPreset,
    pub(crate) look: LookTable,
    pub(crate) base: Arc<BasePicture>,
    pub(crate) textures: CrackTextures,
    /// Whether they have mip levels.
    pub(crate) has_mips: bool,
    pub(crate) carrier: Carrier,
    pub(crate) bytes: TextureBytes,
    pub(crate) rect: TexelRect,
    pub(crate) unstretched: Option<UVec2>,
    pub(crate) read_at: u64,
}

impl Active {
    /// A surface whose textures show what is in the field.
    pub(crate) fn new(ground: SurfaceParts, growth: CrackGrowth, field: DepthField) -> Self {
        let SurfaceParts {
            surface,
            preset,
            look,
            base,
            textures,
            has_mips,
            carrier,
            bytes,
            rect,
            unstretched,
            read_at,
        } = ground;
        let profile = profile(&preset, base.is_nearest);
        let mut canvas = Canvas {
            look,
            base,
            analogy: None,
            new_depths: DirtyTiles::default(),
            textures,
            has_mips,
            views: Vec::new(),
            view: 0,
            unstretched,
            revision: 0,
            read_at,
            is_outdated: false,
            has_changed: false,
            offered: Vec::new(),
        };
        canvas.show(rect, field.frame.size());
        canvas.views.iter_mut().for_each(|view| view.dirty.clear());
        Self {
            cracks: Cracks::new(growth),
            drawing: Drawing::new(field, profile),
            canvas,
            playhead: Playhead::new(preset.steps_per_second),
            blending: Blending::default(),
            analogy: AnalogyState::default(),
            carrier,
            turn: Turn::default(),
            bytes,
            regrowing: None,
            freezing: None,
            fell_at: (0, 1),
            revision: Arc::default(),
            surface,
            preset,
            has_new_settings: false,
        }
    }

    /// Marks texels of the field as changed, in all views.
    pub(crate) fn mark(&mut self, rect: TexelRect) {
        self.canvas.mark(rect, &self.drawing.field.depth);
    }

    /// Marks texels that have changed because cracks have grown, which may be painted over several frames.
    pub(crate) fn mark_grown(&mut self, rect: TexelRect) {
        self.canvas.mark_grown(rect, &self.drawing.field.depth);
    }

    /// Whether there are texels to paint where it is seen.
    pub(crate) fn is_to_paint(&self) -> bool {
        let view = self.canvas.views.get(self.canvas.view);
        view.is_some_and(|view| !(view.dirty.is_empty() && view.rest.is_empty()))
    }

    /// Whether frames had no time to stamp and paint all of what has grown: it does not grow until they have.
    pub(crate) fn is_partly_painted(&self) -> bool {
        self.turn.is_stamping || self.canvas.views.get(self.canvas.view).is_some_and(|view| !view.rest.is_empty())
    }

    /// Whether the next frames may paint what this one has no time for: cracks that grow. The first of them are shown at once, and whatever else changes.
    pub(crate) fn may_be_partly_painted(&self) -> bool {
        let Turn { is_held, is_to_shatter, .. } = self.turn;
        let has_other_changes = self.canvas.views.get(self.canvas.view).is_none_or(|view| !view.dirty.is_empty());
        let is_plain = self.playhead.playback.is_none() && self.canvas.analogy.is_none() && !self.drawing.is_stale;
        let has_shown_any = self.cracks.tips_from > 0;
        is_plain && has_shown_any && self.turn.is_open && !is_held && !is_to_shatter && !has_other_changes
    }

    /// Marks the whole field as changed, in all views.
    pub(crate) fn mark_all(&mut self) {
        self.mark(TexelRect::whole(self.drawing.field.frame.size()));
    }

    /// Shows the cracks in `rect` of the image from now on.
    pub(crate) fn show(&mut self, rect: TexelRect) {
        self.canvas.show(rect, self.drawing.field.frame.size());
    }

    /// Its shards are made from something else from now on.
    pub(crate) fn bump_revision(&mut self) {
        self.revision = Arc::default();
    }

    /// Keeps what grows from now on out of the holes of the picture and of shards.
    pub(crate) fn avoid_holes(&mut self) {
        let density = self.density();
        self.cracks.growth.set_density(density);
    }

    /// Where cracks may go: not over holes.
    fn density(&self) -> Option<Grid<f32>> {
        let rect = self.canvas.seen()?;
        let (base, alpha_mask) = (&self.canvas.base, self.surface.alpha_mask);
        match &self.drawing.cutouts {
            Some(holes) => holes.density(rect, base, alpha_mask),
            None => base.density(rect, alpha_mask),
        }
    }

    /// Ids of the pictures it was made from, and of those that it is to be made from.
    pub(crate) fn sources(&self) -> impl Iterator<Item = AssetId<Image>> + '_ {
        self.carrier.sources().chain(self.canvas.offered.iter().copied())
    }

    /// Ids of the assets that were made for it.
    pub(crate) fn owned(&self) -> impl Iterator<Item = UntypedAssetId> + '_ {
        self.canvas.textures.handles().map(|handle| handle.id().untyped()).chain(self.carrier.owned())
    }
}
