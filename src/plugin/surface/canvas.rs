//! [`Canvas`]: what cracks are painted on.

use crate::Grid;
use crate::paint::LookTable;
use crate::plugin::api::textures::CrackTextures;
use crate::plugin::source::analogy::AnalogyPicture;
use crate::plugin::source::picture::BasePicture;
use crate::raster::{DirtyTiles, TexelRect};
use bevy::prelude::*;
use std::sync::Arc;

/// The most parts of an image that are remembered; one that is forgotten is painted again when it is shown again.
const MAX_VIEWS: usize = 256;

/// The textures of a surface, and what is painted into them.
pub(crate) struct Canvas {
    pub(crate) look: LookTable,
    pub(crate) base: Arc<BasePicture>,
    /// Its cracks as those of photographs.
    pub(crate) analogy: Option<Arc<AnalogyPicture>>,
    /// Texels of the field whose depths an analogy has not taken over; nothing without one.
    pub(crate) new_depths: DirtyTiles,
    pub(crate) textures: CrackTextures,
    /// Whether they have mip levels.
    pub(crate) has_mips: bool,
    pub(crate) views: Vec<View>,
    /// Index of the view that is shown.
    pub(crate) view: usize,
    /// The size that the textures would have if the picture were not shown stretched; `None` if another size was asked for.
    pub(crate) unstretched: Option<UVec2>,
    /// Changes whenever the depths do, or the part of the image that is shown.
    pub(crate) revision: u64,
    /// The frame in which the pictures were read, see `FrameCount`.
    pub(crate) read_at: u64,
    /// Whether the pictures have changed since.
    pub(crate) is_outdated: bool,
    /// Whether they have changed since this was last looked at.
    pub(crate) has_changed: bool,
    /// Pictures that somebody has given the entity, until they are accepted.
    pub(crate) offered: Vec<AssetId<Image>>,
}

/// A part of the image that shows the cracks: the whole image, or a frame of an atlas.
pub(crate) struct View {
    pub(crate) rect: TexelRect,
    /// What is stamped into the field but not painted here yet, in texels of the field.
    pub(crate) dirty: DirtyTiles,
    /// The same of what has grown: frames may have no time to paint all of it. Nothing else is stamped until they have.
    pub(crate) rest: DirtyTiles,
}

impl View {
    /// Paints what is left over together with what has changed since.
    pub(crate) fn join_rest(&mut self) {
        if self.dirty.is_empty() {
            core::mem::swap(&mut self.dirty, &mut self.rest);
        }
        let mut rects = Vec::new();
        self.rest.take_rects(&mut rects);
        rects.into_iter().for_each(|rect| self.dirty.mark(rect));
    }
}

impl Canvas {
    /// The part of the image that is shown.
    pub(crate) fn seen(&self) -> Option<TexelRect> {
        self.views.get(self.view).map(|view| view.rect)
    }

    /// Marks texels of a field with these depths as changed, in all views.
    pub(crate) fn mark(&mut self, rect: TexelRect, depths: &Grid<u16>) {
        self.mark_normals(self.look.affected(rect, depths));
        self.note_depths(&[rect]);
    }

    /// The same for what has grown: in the view that is shown it may wait.
    pub(crate) fn mark_grown(&mut self, rect: TexelRect, depths: &Grid<u16>) {
        let affected = self.look.affected(rect, depths);
        for (index, view) in self.views.iter_mut().enumerate() {
            if index == self.view { &mut view.rest } else { &mut view.dirty }.mark(affected);
        }
        self.note_depths(&[rect]);
    }

    /// Notes that depths have changed, of what is painted.
    pub(crate) fn note_depths(&mut self, rects: &[TexelRect]) {
        rects.iter().for_each(|rect| self.new_depths.mark(*rect));
        self.revision += 1;
    }

    /// Marks texels to be painted again whose depths are as they were.
    pub(crate) fn mark_normals(&mut self, rect: TexelRect) {
        for view in &mut self.views {
            view.dirty.mark(rect);
        }
    }

    /// Shows the cracks of a field of `size` in `rect` of the image from now on.
    pub(crate) fn show(&mut self, rect: TexelRect, size: UVec2) {
        let known = self.views.iter().position(|view| view.rect == rect);
        self.view = known.unwrap_or_else(|| {
            let mut dirty = DirtyTiles::new(size);
            dirty.mark(TexelRect::whole(size));
            if self.views.len() >= MAX_VIEWS {
                self.views.remove(0);
            }
            self.views.push(View { rect, dirty, rest: DirtyTiles::new(size) });
            self.revision += 1;
            self.views.len() - 1
        });
    }
}
