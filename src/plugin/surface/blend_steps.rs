//! The steps in which a surface at rest blends its normals.

use super::active::Active;
use super::blending::{Blending, Solved, Stage, Work};
use crate::Grid;
use crate::blend::NormalBlending;
use crate::plugin::jobs::background::{BackgroundJob, PATIENCE};
use crate::raster::TexelRect;
use bevy::{platform::time::Instant, prelude::*};

/// Depths that a frame copies for a task, and texels that it has painted again of what a task has made.
const COPIED: usize = 1 << 18;
const SHOWN: u64 = 1 << 15;

impl Active {
    /// Whether its look asks for normals that are made one with the cracks. They are for one view: what is solved depends on the normals
    /// that are shown.
    fn is_to_blend(&self) -> bool {
        self.preset.look.normals == NormalBlending::Poisson
            && self.canvas.textures.normal.is_some()
            && self.canvas.base.normal.is_some()
            && self.canvas.views.len() == 1
    }

    /// Whether its normals are not what the cracks that are shown make them.
    pub(crate) fn has_normals_to_blend(&self) -> bool {
        match self.is_to_blend() {
            true => self.blending.solved != Some(self.canvas.revision) || !matches!(self.blending.stage, Stage::Rest),
            false => self.drawing.field.correction().is_some(),
        }
    }

    /// Goes on with it, at rest; with all of it if there is no limit. Marks what is to be painted.
    pub(crate) fn blend_normals(&mut self, is_unlimited: bool) {
        if !self.is_to_blend() {
            self.blending = Blending::default();
            self.drawing.field.correct(None);
            if self.preset.look.normals == NormalBlending::Poisson {
                self.mark_all();
            }
            return;
        }
        while self.has_normals_to_blend() && self.step(is_unlimited) {}
    }

    /// A step; whether the next one can follow at once.
    fn step(&mut self, is_unlimited: bool) -> bool {
        let revision = self.canvas.revision;
        match core::mem::take(&mut self.blending.stage) {
            Stage::Rest => {
                self.blending.stage = Stage::Copy(revision, Vec::new());
                true
            }
            Stage::Copy(of, _) | Stage::Solve(of, ..) if of != revision => true,
            Stage::Copy(of, mut texels) => {
                let depth = self.drawing.field.depth.as_slice();
                let end = if is_unlimited { depth.len() } else { depth.len().min(texels.len() + COPIED) };
                texels.reserve_exact(depth.len() - texels.len());
                texels.extend_from_slice(&depth[texels.len()..end]);
                let is_whole = end == depth.len();
                self.blending.stage = if is_whole { self.start(of, texels) } else { Stage::Copy(of, texels) };
                is_unlimited
            }
            Stage::Solve(of, job, _) if is_unlimited => self.take_up(of, job.finish().unwrap_or_default()),
            Stage::Solve(of, mut job, since) => match job.take_if_done(since.elapsed() >= PATIENCE) {
                Some(solved) => self.take_up(of, solved),
                None => {
                    self.blending.stage = Stage::Solve(of, job, since);
                    false
                }
            },
            Stage::Show(mut rects) => {
                let mut area = 0;
                let most = if is_unlimited { u64::MAX } else { SHOWN };
                while area < most
                    && let Some(rect) = rects.pop()
                {
                    let (now, later) = split(rect, most - area);
                    area += now.area();
                    self.canvas.mark_normals(now);
                    rects.extend(later);
                }
                if !rects.is_empty() {
                    self.blending.stage = Stage::Show(rects);
                }
                false
            }
        }
    }

    /// Paints with what was solved from now on.
    fn take_up(&mut self, revision: u64, solved: Solved) -> bool {
        self.drawing.field.correct(solved.correction);
        self.blending.solved = Some(revision);
        self.blending.stage = Stage::Show(solved.changes);
        true
    }

    fn start(&self, revision: u64, texels: Vec<u16>) -> Stage {
        let field = &self.drawing.field;
        let work = Work {
            base: self.canvas.base.clone(),
            origin: self.canvas.seen().map_or(UVec2::ZERO, |rect| rect.min),
            depth: Grid::from_vec(field.depth.size(), texels).unwrap_or_else(|| field.depth.clone()),
            before: field.correction().cloned(),
        };
        Stage::Solve(revision, BackgroundJob::start(work, Work::solve), Instant::now())
    }
}

/// The first rows of a rectangle, as many as have no more than `most` texels but one at least, and the others.
pub(super) fn split(rect: TexelRect, most: u64) -> (TexelRect, Option<TexelRect>) {
    let rows = (most / u64::from(rect.size().x.max(1))).max(1);
    let y = u32::try_from(rows).map_or(rect.max.y, |rows| rect.min.y.saturating_add(rows).min(rect.max.y));
    let [mut first, mut rest] = [rect; 2];
    (first.max.y, rest.min.y) = (y, y);
    (first, (!rest.is_empty()).then_some(rest))
}
