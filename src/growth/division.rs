//! The state of a growth that divides domains: its tips, the generations of its cracks, and the areas that its hits
//! have loaded.

use super::{
    draws,
    params::{GrowthParams, Venation},
};
use crate::{
    math::{hash_unit, ops, smooth},
    pattern::NO_PARENT,
};
use glam::Vec2;
use std::{f32::consts::PI, ops::Range};

/// Ratio of the distances between cracks of successive generations.
const COARSER: f32 = 1.6;

/// Ratio of the widths of cracks of successive generations.
const NARROWER: f32 = 0.5;

/// Radians per kill distance of the shortest wave in which the size of domains varies.
const PATCHES: f32 = 0.95;

/// Largest reduction of the loaded radius by direction, as a share.
const UNEVEN: f32 = 0.3;

/// A straight crack narrows where it meets one that is narrower by this factor.
pub(super) const MUCH_WIDER: f32 = 1.7;

/// Share of the distance to the rim from which cracks become thinner.
const THINS: f32 = 0.4;

/// Increase of the size of domains at the rim relative to the size near the hit.
const SPARSER: f32 = 0.8;

/// Distance from a hit, in kill distances, within which domains are finer and elongated away from it.
const AROUND: f32 = 14.0;

/// The state of a growth that divides domains, in addition to its network.
#[derive(Clone, Debug, Default)]
pub(super) struct Division {
    /// Growing ends of cracks.
    pub(super) tips: Vec<Tip>,
    /// Nodes that hits have added since the last step.
    pub(super) fresh: Range<u32>,
    /// The current generation.
    pub(super) generation: u8,
    /// Per node, of its crack; empty = the first generation, at full width.
    pub(super) kinds: Vec<Kind>,
    /// Per impact: its step, and the radius of the area that it has loaded; nothing for those before cracks divided.
    begun: Vec<Option<(u32, f32)>>,
    /// Tips that have left the area that their hit has loaded, and wait for a crack that meets them.
    pub(super) resting: Vec<Tip>,
    /// Number of nodes that were shown to the markers.
    pub(super) seen: u32,
}

/// Properties of the crack of a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub(super) generation: u8,
    /// Whether another crack has met this one here.
    pub(super) is_met: bool,
    /// Whether it ends here because it has met another crack, or another has met it head on.
    pub(super) is_over: bool,
    /// Its width relative to others of its generation.
    pub(super) narrower: f32,
}

impl Kind {
    const FIRST: Self = Self { generation: 0, is_met: false, is_over: false, narrower: 1.0 };
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Tip {
    pub(super) node: u32,
    /// The direction in which its crack started.
    pub(super) course: Vec2,
    /// Steps for which it has run straight.
    pub(super) straight: u16,
    /// Whether it has waited at the rim for long enough and continues.
    pub(super) runs_out: bool,
}

impl Division {
    pub(super) fn new(params: &GrowthParams) -> Option<Self> {
        (params.venation == Venation::Subdivision).then(Self::default)
    }

    pub(super) fn kind(&self, node: u32) -> Kind {
        self.kinds.get(node as usize).copied().unwrap_or(Kind::FIRST)
    }

    /// The relative width of the crack of a node.
    pub(super) fn share(&self, node: u32) -> f32 {
        let Kind { generation, narrower, .. } = self.kind(node);
        (0..generation).fold(narrower, |share, _| share * NARROWER)
    }

    /// Records the crack of a new node; `narrower` is its relative width if it starts here. Returns the relative
    /// width.
    pub(super) fn add_node(&mut self, node: u32, parent: u32, narrower: f32) -> f32 {
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

    /// The step at which an impact has loaded the surface, if cracks divided then.
    pub(super) fn step_of(&self, impact: u32) -> Option<u32> {
        self.loaded_by(impact).map(|begun| begun.0)
    }

    /// How far an impact has loaded the surface; all of it if cracks did not divide then.
    pub(super) fn reach_of(&self, impact: u32) -> f32 {
        self.loaded_by(impact).map_or(f32::INFINITY, |begun| begun.1)
    }

    fn loaded_by(&self, impact: u32) -> Option<(u32, f32)> {
        self.begun.get(impact as usize).copied().flatten()
    }

    /// Registers the nodes of a hit.
    pub(super) fn begin(&mut self, impact: u32, born: Range<u32>, step: u32, reach: f32) {
        self.begun.resize(impact as usize, None);
        self.begun.push(Some((step, reach)));
        let first = if self.fresh.is_empty() { born.start } else { self.fresh.start };
        self.fresh = first..born.end;
        self.generation = 0;
    }

    /// Sets the reach of an impact that has gained energy.
    pub(super) fn extend_reach(&mut self, impact: u32, reach: f32) {
        if let Some(Some((_, rim))) = self.begun.get_mut(impact as usize) {
            *rim = reach;
        }
        self.tips.append(&mut self.resting);
        self.generation = 0;
    }

    /// Removes the first nodes.
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

/// Waves with lengths of a few kill distances, in all directions.
pub(super) struct Patches {
    /// Direction, in waves per kill distance, and phase.
    waves: [(Vec2, f32); 5],
    kill_distance: f32,
    patchiness: f32,
}

impl Patches {
    /// The largest factor of all.
    pub(super) const fn most(&self) -> f32 {
        1.0 + self.patchiness
    }

    /// Factor of a distance at a place, at least 1.
    pub(super) fn at(&self, pos: Vec2) -> f32 {
        if self.patchiness <= 0.0 {
            return 1.0;
        }
        let wave = |(way, phase): &(Vec2, f32)| ops::cos(way.dot(pos) / self.kill_distance + phase);
        let sum: f32 = self.waves.iter().map(wave).sum();
        let share = (0.5 + 0.33 * sum).clamp(0.0, 1.0);
        1.0 + self.patchiness * share * share
    }
}

impl GrowthParams {
    /// Distance from all cracks that a marker must have so that a crack of this generation can start at it.
    pub(super) fn loaded(&self, generation: u8, from_hit: f32, reach: f32) -> f32 {
        let coarser = (u32::from(generation) + 1..self.generations).fold(1.0, |by, _| by * COARSER);
        let further = 1.0 + SPARSER * self.thinning * towards_rim(from_hit, reach);
        self.kill_distance * coarser * further / (1.0 + self.focus * self.near_hit(from_hit))
    }

    /// How that distance varies from place to place.
    pub(super) fn patches(&self, seed: u64) -> Patches {
        let wave = |k: u64| {
            let way = ops::unit(2.0 * PI * hash_unit(seed ^ draws::PATCH_WAY, k)) * (PATCHES / (1.0 + 0.35 * k as f32));
            (way, 2.0 * PI * hash_unit(seed ^ draws::PATCH_PHASE, k))
        };
        let waves =
            if self.patchiness > 0.0 { std::array::from_fn(|k| wave(k as u64)) } else { [(Vec2::ZERO, 0.0); 5] };
        Patches { waves, kill_distance: self.kill_distance, patchiness: self.patchiness }
    }

    /// 1 at the hit, 0 where it no longer affects domains.
    pub(super) fn near_hit(&self, from_hit: f32) -> f32 {
        if self.focus <= 0.0 {
            return 0.0;
        }
        let away = (from_hit / (AROUND * self.kill_distance)).min(1.0);
        (1.0 - away) * (1.0 - away)
    }
}

/// 0 where everything is loaded equally, rising to 1 a little beyond the rim.
pub(super) fn towards_rim(from_hit: f32, rim: f32) -> f32 {
    let share = ((from_hit / rim.max(1e-6) - THINS) / (1.1 - THINS)).clamp(0.0, 1.0);
    smooth(share)
}

/// The loaded radius of a hit in a direction, at most `reach`: an irregular shape that differs for every hit.
pub(super) fn rim_towards(way: Vec2, reach: f32, seed: u64) -> f32 {
    let way = way.normalize_or(Vec2::X);
    // Cosines of multiples of the angle, each with a random phase.
    let (mut power, mut sum) = (way, 0.0);
    for wave in 2..=5u64 {
        power = power.rotate(way);
        sum += power.dot(ops::unit(2.0 * PI * hash_unit(seed ^ draws::UNEVEN_LOAD, wave)));
    }
    reach * (1.0 - UNEVEN * (0.5 + 0.25 * sum).clamp(0.0, 1.0))
}

/// The smallest and the largest radius that [`rim_towards`] gives.
pub(super) fn rims(reach: f32) -> [f32; 2] {
    [reach * (1.0 - UNEVEN), reach]
}
