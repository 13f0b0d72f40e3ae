//! [`Blending`]: the normals of a surface at rest, made one with the cracks by a task.

use crate::Grid;
use crate::blend::solve_correction;
use crate::plugin::jobs::background::{BackgroundJob, guarded};
use crate::plugin::source::picture::BasePicture;
use crate::raster::{SlopeCorrection, TexelRect};
use bevy::{platform::time::Instant, prelude::*};
use std::sync::Arc;

/// How far the normals of a surface are made one with its cracks.
#[derive(Default)]
pub(crate) struct Blending {
    /// For which revision of the canvas they were solved.
    pub(super) solved: Option<u64>,
    pub(super) stage: Stage,
}

#[derive(Default)]
pub(super) enum Stage {
    #[default]
    Rest,
    /// The depths of this revision are being copied.
    Copy(u64, Vec<u16>),
    /// A task is at it, since then.
    Solve(u64, BackgroundJob<Work, Solved>, Instant),
    /// What is to be painted again.
    Show(Vec<TexelRect>),
}

/// What a task solves.
pub(super) struct Work {
    pub(super) base: Arc<BasePicture>,
    pub(super) origin: UVec2,
    pub(super) depth: Grid<u16>,
    pub(super) before: Option<Arc<SlopeCorrection>>,
}

#[derive(Default)]
pub(super) struct Solved {
    pub(super) correction: Option<Arc<SlopeCorrection>>,
    pub(super) changes: Vec<TexelRect>,
}

impl Work {
    pub(super) fn solve(self) -> Solved {
        let Self { base, origin, depth, before } = self;
        let Some(normals) = &base.normal else { return Solved::default() };
        let solved = guarded(|| Ok(solve_correction(normals, base.size, origin, &depth)));
        let correction = match solved.map(|solved| solved.map_err(|error| error.to_string())) {
            Ok(Ok(correction)) => correction.map(Arc::new),
            Ok(Err(error)) => refused(error),
            Err(error) => refused(error.to_string()),
        };
        let changes = SlopeCorrection::changes(before.as_deref(), correction.as_deref(), depth.size());
        Solved { correction, changes }
    }
}

/// Without a solution the cracks keep the normals that they have while they grow.
fn refused(error: String) -> Option<Arc<SlopeCorrection>> {
    warn!("the normals of a surface are not blended with its cracks: {error}");
    None
}
