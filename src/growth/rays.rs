//! The state of a growth by rays: the rays, where they fork, and the rings between them.

use super::plan::Plan;
use glam::Vec2;

/// A bit in the number of a ray that distinguishes it from an impact.
pub(super) const RAY: u32 = 1 << 31;

/// The ray of a node that is on no ray.
pub(super) const NO_RAY: u32 = u32::MAX;

pub(super) const NO_NODE: u32 = u32::MAX;

/// Every ray of every hit.
#[derive(Clone, Debug, Default)]
pub(super) struct Rays {
    /// By number of the ray: its impact, and the generation of its last node.
    rays: Vec<(u32, u32)>,
    /// In order of ray and generation.
    pub(super) forks: Vec<Fork>,
    pub(super) corners: Vec<Corner>,
    /// Both ends of the lines of rings, as far as they exist.
    pub(super) chords: Vec<[u32; 2]>,
    pub(super) walkers: Vec<Walker>,
}

/// A place at which a ray is to fork.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fork {
    pub(super) at: (u32, u32),
    pub(super) ray: u32,
    pub(super) way: Vec2,
}

/// An end of a line of a ring: the ray, and the generation on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) at: (u32, u32),
    pub(super) chord: u32,
    pub(super) end: usize,
}

/// The growing tip of a line of a ring.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walker {
    pub(super) tip: u32,
    pub(super) to: u32,
    /// Steps until it starts: the rays at both ends are further on by then, so that it cannot be in their way.
    pub(super) wait: u32,
    pub(super) steps_left: u32,
}

impl Rays {
    pub(super) const fn is_running(&self) -> bool {
        !self.walkers.is_empty()
    }

    /// The impact of a ray; `None` if that is the name of none.
    pub(super) fn impact_of(&self, ray: u32) -> Option<u32> {
        let named = (ray & RAY != 0).then_some((ray & !RAY) as usize);
        named.and_then(|ray| self.rays.get(ray)).map(|&(impact, _)| impact)
    }

    pub(super) fn last_of(&self, ray: u32) -> u32 {
        self.rays.get((ray & !RAY) as usize).map_or(u32::MAX, |&(_, last)| last)
    }

    /// Adds the plan of an impact; returns the number of its first ray.
    pub(super) fn add_plan(&mut self, plan: &Plan, impact: u32, is_over: bool) -> u32 {
        if is_over {
            // The remaining plans of older hits are dropped.
            self.forks.clear();
            self.corners.clear();
            self.chords.clear();
        }
        let first = self.rays.len() as u32 | RAY;
        self.rays.extend(plan.rays.iter().map(|ray| (impact, ray.last)));
        let name = |ray: usize| first + ray as u32;
        let (forks, corners) = (self.forks.len(), self.corners.len());
        for (i, ray) in plan.rays.iter().enumerate() {
            if let (Some((from, generation)), [start, next, ..]) = (ray.from, &ray.line[..]) {
                let way = (*next - *start).normalize_or_zero();
                self.forks.push(Fork { at: (name(from), generation), ray: name(i), way });
            }
        }
        for chord in &plan.chords {
            let index = self.chords.len() as u32;
            self.chords.push([NO_NODE; 2]);
            for (end, (ray, generation)) in [chord.from, chord.to].into_iter().enumerate() {
                self.corners.push(Corner { at: (name(ray), generation), chord: index, end });
            }
        }
        self.forks[forks..].sort_by_key(|fork| fork.at);
        self.corners[corners..].sort_by_key(|corner| corner.at);
        first
    }

    /// Forgets the first nodes.
    pub(super) fn forget(&mut self, first: u32) {
        for end in self.chords.iter_mut().flatten() {
            *end = end.checked_sub(first).filter(|_| *end != NO_NODE).unwrap_or(NO_NODE);
        }
        self.walkers = std::mem::take(&mut self.walkers)
            .into_iter()
            .filter_map(|walker| {
                let (tip, to) = (walker.tip.checked_sub(first)?, walker.to.checked_sub(first)?);
                Some(Walker { tip, to, ..walker })
            })
            .collect();
    }
}

/// Largest number of segments of a line of a ring.
pub(super) fn chord_steps(apart: f32, length: f32) -> u32 {
    (1.5 * apart / length) as u32 + 2
}
