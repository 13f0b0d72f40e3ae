//! The steps in which a surface makes its cracks those of photographs.

use super::active::Active;
use super::analogy::{AnalogyNews, AnalogyState, AnalogyTools, Attempt, Stage};
use super::analogy_work::{AnalogyWish, AnalogyWork, Made, MadePatch};
use super::blend_steps::split;
use crate::Grid;
use crate::plugin::api::{AnalogyExamples, CrackAnalogy, CrackError};
use crate::plugin::jobs::stepped::{News, Running};
use crate::raster::{DirtyTiles, TexelRect};
use bevy::prelude::*;
use std::sync::Arc;

/// Depths that a frame copies for a task, and texels that it takes over of what a task has made.
const COPIED: u64 = 1 << 17;
const SHOWN: u64 = 1 << 15;

impl Active {
    /// What its analogy is to be made from.
    pub(crate) fn analogy_wish(
        &self,
        analogy: &CrackAnalogy,
        examples: AnalogyExamples,
    ) -> Result<AnalogyWish, CrackError> {
        let refused = |reason: &str| CrackError::Analogy { reason: reason.into() };
        let [view] = &*self.canvas.views else {
            return Err(refused("it shows more than one part of its picture"));
        };
        let (base, rect) = (self.canvas.base.clone(), view.rect);
        if rect.size() != self.drawing.field.frame.size() || rect.intersect(TexelRect::whole(base.size)) != rect {
            return Err(refused("it shows a part of its picture that is cut off"));
        }
        Ok(AnalogyWish { examples, keeps_picture: analogy.keeps_picture, seed: analogy.seed, base, rect })
    }

    /// Whether its analogy has failed and cannot be made now either.
    pub(crate) fn has_failed_analogy(&mut self, attempt: Attempt) -> bool {
        let Stage::Failed(before) = self.analogy.stage else { return false };
        if before != attempt {
            self.analogy.stage = Stage::Rest;
        }
        before == attempt
    }

    /// Gives it up until something else is asked for.
    pub(crate) fn fail_analogy(&mut self, attempt: Attempt) {
        self.drop_analogy();
        self.analogy.stage = Stage::Failed(attempt);
    }

    /// Shows the look of the preset again. Returns whether that changes what is shown.
    pub(crate) fn drop_analogy(&mut self) -> bool {
        self.analogy = AnalogyState::default();
        self.canvas.new_depths = DirtyTiles::default();
        let had = self.canvas.analogy.take().is_some();
        if had {
            self.mark_all();
        }
        had
    }

    /// Goes on with its analogy. Marks what is to be painted.
    pub(crate) fn make_analogy(&mut self, wish: &AnalogyWish, tools: &mut AnalogyTools) -> AnalogyNews {
        if self.analogy.wish.as_ref() != Some(wish) {
            self.begin_analogy(wish);
        }
        match core::mem::take(&mut self.analogy.stage) {
            stage @ Stage::Failed(_) => self.analogy.stage = stage,
            Stage::Rest if self.canvas.new_depths.is_empty() => {}
            Stage::Rest => {
                let mut rects = Vec::new();
                self.canvas.new_depths.take_rects(&mut rects);
                self.copy_depths(wish, rects, Vec::new(), tools);
            }
            Stage::Copy(left, done) => self.copy_depths(wish, left, done, tools),
            Stage::Work(running) => match running.look(tools.threads, tools.timer) {
                News::Going(running, progress) => {
                    self.analogy.stage = Stage::Work(running);
                    if !self.analogy.is_shown {
                        return AnalogyNews::Progress(0.95 * progress);
                    }
                }
                News::Ended(Ok(made)) => {
                    let Made { analogy, depth, mut patches, picture } = *made;
                    if let Some(picture) = picture {
                        self.canvas.analogy = Some(Arc::new(picture));
                    }
                    self.analogy.made = Some((Some(analogy), depth));
                    patches.reverse();
                    self.analogy.stage = Stage::Show(patches);
                }
                News::Ended(Err(error)) => return AnalogyNews::Failed(error),
            },
            Stage::Show(patches) => return self.take_patches(wish, patches),
        }
        AnalogyNews::Nothing
    }

    /// Begins anew. What is shown stays until then, unless it is of another picture.
    fn begin_analogy(&mut self, wish: &AnalogyWish) {
        let before = self.analogy.wish.as_ref();
        if before.is_none_or(|before| !Arc::ptr_eq(&before.base, &wish.base) || before.rect != wish.rect) {
            self.drop_analogy();
        }
        let size = wish.rect.size();
        self.canvas.new_depths = DirtyTiles::new(size);
        self.canvas.new_depths.mark(TexelRect::whole(size));
        let made = Some((None, Grid::new(size, 0)));
        self.analogy = AnalogyState { wish: Some(wish.clone()), made, ..AnalogyState::default() };
    }

    /// Copies some depths, and has the rest done by a task once all are copied.
    fn copy_depths(
        &mut self,
        wish: &AnalogyWish,
        mut left: Vec<TexelRect>,
        mut done: Vec<TexelRect>,
        tools: &AnalogyTools,
    ) {
        let Some((analogy, mut seen)) = self.analogy.made.take() else { return };
        let depth = &self.drawing.field.depth;
        let mut area = 0;
        while area < COPIED
            && let Some(rect) = left.pop()
        {
            let (now, later) = split(rect, COPIED - area);
            left.extend(later);
            area += now.area();
            let columns = now.min.x as usize..now.max.x as usize;
            for y in now.min.y as usize..now.max.y as usize {
                seen.row_mut(y)[columns.clone()].copy_from_slice(&depth.row(y)[columns.clone()]);
            }
            done.push(now);
        }
        if !left.is_empty() {
            self.analogy.made = Some((analogy, seen));
            self.analogy.stage = Stage::Copy(left, done);
            return;
        }
        let work = AnalogyWork::new(wish.clone(), analogy, seen, done, self.canvas.analogy.is_some());
        self.analogy.stage = Stage::Work(Running::start(tools.threads, work));
    }

    /// Takes some of what was made over into the picture.
    fn take_patches(&mut self, wish: &AnalogyWish, mut patches: Vec<MadePatch>) -> AnalogyNews {
        // Unless a task that paints has it.
        let Some(picture) = self.canvas.analogy.as_mut().and_then(Arc::get_mut) else {
            self.analogy.stage = Stage::Show(patches);
            return AnalogyNews::Nothing;
        };
        let (mut area, mut shown) = (0, Vec::new());
        while area < SHOWN
            && let Some(patch) = patches.pop()
        {
            area += patch.rect.area();
            picture.put(&patch, wish);
            // A normal depends on the texels around it.
            shown.push(patch.rect.grow(1, wish.rect.size()));
        }
        shown.into_iter().for_each(|rect| self.canvas.mark_normals(rect));
        if !patches.is_empty() {
            self.analogy.stage = Stage::Show(patches);
            return AnalogyNews::Nothing;
        }
        match core::mem::replace(&mut self.analogy.is_shown, true) {
            true => AnalogyNews::Nothing,
            false => AnalogyNews::Made,
        }
    }
}
