//! [`Cracks`]: the cracks of a surface.

use super::motion::{Motion, MotionFrame};
use super::shared::Shared;
use crate::growth::{CrackGrowth, GrowthParams};
use crate::pattern::{CellTracker, Moment, Network};
use bevy::prelude::*;

/// The cracks of a surface, and what was reported of them.
pub(crate) struct Cracks {
    pub(crate) growth: Shared<CrackGrowth>,
    pub(crate) cells: CellTracker,
    /// Cells whose closing has been reported, with the one that is there from the start.
    pub(crate) cells_reported: usize,
    /// The cracks of a bake.
    pub(crate) added: Option<Added>,
    /// Hits that started or fed a crack.
    pub(crate) hits: u32,
    pub(crate) last_hit: Option<LastHit>,
    /// Hits whose chips are still to fly off.
    pub(crate) unchipped: u32,
    /// Nodes that were there when tips were last listed.
    pub(crate) tips_from: usize,
}

/// Cracks that have not grown: the result of a bake.
#[derive(Clone)]
pub(crate) struct Added {
    pub(crate) network: Network,
    /// See [`CrackGrowth::add_cracks`].
    pub(crate) opening: u32,
    /// How many steps of growth they take.
    pub(crate) steps: u32,
    /// If they move in these steps instead of growing.
    pub(crate) motion: Option<Motion>,
}

impl Cracks {
    /// The place of moving cracks at a moment; `None` if they do not move then.
    pub(crate) fn motion_at(&self, moment: Moment) -> Option<MotionFrame> {
        self.added.as_ref()?.motion_at(moment, self.growth.params())
    }
}

impl Added {
    /// The same for cracks that are yet to be put on a surface.
    pub(crate) fn motion_at(&self, moment: Moment, params: &GrowthParams) -> Option<MotionFrame> {
        let is_on_the_way = moment > Moment::START && moment < Moment::after(self.steps);
        let motion = self.motion.clone().filter(|_| is_on_the_way)?;
        let share = (moment.steps() / f64::from(self.steps)) as f32;
        Some(MotionFrame { motion, share, params: params.clone() })
    }
}

/// The last hit of a surface.
#[derive(Clone, Copy)]
pub(crate) struct LastHit {
    /// Pattern units.
    pub(crate) pos: Vec2,
    pub(crate) energy: f32,
    /// In the world.
    pub(crate) direction: Vec3,
}

impl Cracks {
    pub(crate) fn new(growth: CrackGrowth) -> Self {
        let cells = CellTracker::new(growth.network().extent());
        let growth = Shared::new(growth);
        Self { growth, cells, cells_reported: 1, added: None, hits: 0, last_hit: None, unchipped: 0, tips_from: 0 }
    }

    /// Completes a step that is under way. If none is, the growth is not even touched: a task may be reading it.
    pub(crate) fn finish_step(&mut self) {
        if self.growth.is_in_step() {
            self.growth.finish_step();
        }
    }
}
