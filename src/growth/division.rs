//! What a growth that divides domains knows: its tips, the generations of its cracks, and what its hits have loaded.

use super::{
    draws,
    params::{GrowthParams, Venation},
};
use crate::{
    math::{hash_unit, ops},
    pattern::NO_PARENT,
};
use glam::Vec2;
use std::{f32::consts::PI, ops::Range};

/// How many times further apart the cracks of a generation are than those of the next.
const COARSER: f32 = 1.6;

/// How many times narrower the cracks of a generation are than those of the one before.
const NARROWER: f32 = 0.5;

/// Radians of the shortest wave in which the size of domains changes from place to place, a kill distance.
const PATCHES: f32 = 0.95;

/// How much less far than its reach a hit loads the surface in some directions, as a share.
const UNEVEN: f32 = 0.3;

/// A steady crack narrows where it meets one that is so many times narrower.
pub(super) const MUCH_WIDER: f32 = 1.7;

/// From which share of the way to the rim on cracks thin out.
const THINS: f32 = 0.4;

/// How many times larger domains are at the rim than nearer to the hit, less one.
const SPARSER: f32 = 0.8;

/// Kill distances around a hit within which domains are finer and drawn out away from it.
const AROUND: f32 = 14.0;

/// What a growth that divides domains knows besides its network.
#[derive(Clone, Debug, Default)]
pub(super) struct Division {
    /// Ends of cracks that grow.
    pub(super) tips: Vec<Tip>,
    /// Nodes that hits have made since the last step.
    pub(super) fresh: Range<u32>,
    /// The generation that begins now.
    pub(super) generation: u8,
    /// Of each node's crack; none = the first generation, as wide as it may be.
    pub(super) kinds: Vec<Kind>,
    /// Steps at which the impacts came, and radii of what they have loaded.
    pub(super) begun: Vec<(u32, f32)>,
    /// Tips that have left what their hit has loaded, and wait for a crack that meets them.
    pub(super) resting: Vec<Tip>,
    /// Nodes that the markers have seen.
    pub(super) seen: u32,
}

/// What the nodes of a crack have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub(super) generation: u8,
    /// Whether another crack has met this one here.
    pub(super) is_met: bool,
    /// Whether it ends here, as it has met another, or that one has met it head on.
    pub(super) is_over: bool,
    /// How much narrower it is than others of its generation.
    pub(super) narrower: f32,
}

impl Kind {
    const FIRST: Self = Self { generation: 0, is_met: false, is_over: false, narrower: 1.0 };
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Tip {
    pub(super) node: u32,
    /// The way in which its crack began.
    pub(super) course: Vec2,
    /// Steps that it has run straight on.
    pub(super) straight: u16,
    /// Whether it has waited at the rim for long enough.
    pub(super) runs_out: bool,
}

impl Division {
    pub(super) fn new(params: &GrowthParams) -> Option<Self> {
        (params.venation == Venation::Dividing).then(Self::default)
    }

    pub(super) fn kind(&self, node: u32) -> Kind {
        self.kinds.get(node as usize).copied().unwrap_or(Kind::FIRST)
    }

    /// How much narrower than others the crack of a node is.
    pub(super) fn share(&self, node: u32) -> f32 {
        let Kind { generation, narrower, .. } = self.kind(node);
        (0..generation).fold(narrower, |share, _| share * NARROWER)
    }

    /// Notes the crack of a newborn node, which is so much narrower than others if it begins here; returns how many times as wide as others it is.
    pub(super) fn bear(&mut self, node: u32, parent: u32, narrower: f32) -> f32 {
        let kind = match self.kinds.get(parent as usize) {
            Some(&kind) => Kind { is_met: false, is_over: false, ..kind },
            None if parent == NO_PARENT => Kind { generation: self.generation, narrower, ..Kind::FIRST },
            None => Kind::FIRST,
        };
        self.kinds.resize(node as usize, Kind::FIRST);
        self.kinds.push(kind);
        self.share(node)
    }

    /// The generation of a node's crack.
    #[cfg(test)]
    pub(super) fn generation_of(&self, node: u32) -> u8 {
        self.kind(node).generation
    }

    /// How far an impact has loaded the surface.
    #[cfg(test)]
    pub(super) fn reach_of(&self, impact: u32) -> Option<f32> {
        self.begun.get(impact as usize).map(|begun| begun.1)
    }

    /// Takes up the nodes of a hit.
    pub(super) fn begin(&mut self, born: Range<u32>, step: u32, reach: f32) {
        self.begun.push((step, reach));
        let first = if self.fresh.is_empty() { born.start } else { self.fresh.start };
        self.fresh = first..born.end;
        self.generation = 0;
    }

    /// An impact has gathered more energy.
    pub(super) fn go_on(&mut self, impact: u32, reach: f32) {
        if let Some((_, rim)) = self.begun.get_mut(impact as usize) {
            *rim = reach;
        }
        self.tips.append(&mut self.resting);
        self.generation = 0;
    }

    /// Forgets the first nodes.
    pub(super) fn forget(&mut self, first: u32) {
        self.kinds.drain(..self.kinds.len().min(first as usize));
        self.fresh = self.fresh.start.saturating_sub(first)..self.fresh.end.saturating_sub(first);
        self.seen = self.seen.saturating_sub(first);
        for tips in [&mut self.tips, &mut self.resting] {
            tips.retain_mut(|tip| {
                let left = tip.node.checked_sub(first);
                tip.node = left.unwrap_or(0);
                left.is_some()
            });
        }
    }
}

impl GrowthParams {
    /// How far from all cracks a marker must be for one of this generation to begin at it.
    pub(super) fn loaded(&self, generation: u8, from_hit: f32, reach: f32) -> f32 {
        let coarser = (u32::from(generation) + 1..self.generations).fold(1.0, |by, _| by * COARSER);
        let further = 1.0 + SPARSER * self.thinning * towards_rim(from_hit, reach);
        self.kill_distance * coarser * further / (1.0 + self.focus * self.near_hit(from_hit))
    }

    /// How many times further it must be from them at a place, 1 at least.
    pub(super) fn patch(&self, pos: Vec2, seed: u64) -> f32 {
        if self.patches <= 0.0 {
            return 1.0;
        }
        // Waves of a few kill distances, in all directions.
        let wave = |k: u64| {
            let way = ops::unit(2.0 * PI * hash_unit(seed ^ draws::PATCH_WAY, k)) * (PATCHES / (1.0 + 0.35 * k as f32));
            ops::unit(way.dot(pos) / self.kill_distance + 2.0 * PI * hash_unit(seed ^ draws::PATCH_PHASE, k)).x
        };
        let sum: f32 = (0..5).map(wave).sum();
        let share = (0.5 + 0.33 * sum).clamp(0.0, 1.0);
        1.0 + self.patches * share * share
    }

    /// 1 at the hit, 0 where domains know nothing of it any more.
    pub(super) fn near_hit(&self, from_hit: f32) -> f32 {
        if self.focus <= 0.0 {
            return 0.0;
        }
        let away = (from_hit / (AROUND * self.kill_distance)).min(1.0);
        (1.0 - away) * (1.0 - away)
    }
}

/// 0 as far from a hit as all is loaded alike, 1 a little beyond the rim.
pub(super) fn towards_rim(from_hit: f32, rim: f32) -> f32 {
    let share = ((from_hit / rim.max(1e-6) - THINS) / (1.1 - THINS)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// How far a hit loads the surface in a direction, at most `reach`: no two alike, and none round.
pub(super) fn rim_towards(way: Vec2, reach: f32, seed: u64) -> f32 {
    let way = way.normalize_or(Vec2::X);
    // Cosines of multiples of the angle, each turned by a draw.
    let (mut power, mut sum) = (way, 0.0);
    for wave in 2..=5u64 {
        power = power.rotate(way);
        sum += power.dot(ops::unit(2.0 * PI * hash_unit(seed ^ draws::UNEVEN_LOAD, wave)));
    }
    reach * (1.0 - UNEVEN * (0.5 + 0.25 * sum).clamp(0.0, 1.0))
}
