//! One path: how its tip moves (section 3.2 of the paper).

use super::params::{Propagation, StrandParams};
use glam::{IVec2, Vec2};

/// The four directions of the lattice, in the order in which ties are broken: north, east, south, west.
const WAYS: [IVec2; 4] = [IVec2::new(0, -1), IVec2::new(1, 0), IVec2::new(0, 1), IVec2::new(-1, 0)];

/// The tip of a path.
#[derive(Clone, Debug)]
pub(super) struct Walk {
    step: f32,
    inertia: f32,
    way: Way,
}

#[derive(Clone, Debug)]
enum Way {
    Costs { origin: Vec2, cell: IVec2, costs: [f32; 4] },
    Continuous { pos: Vec2, heading: Vec2, push: Vec2, fade: f32 },
}

impl Walk {
    /// A path from `pos`. `across` is the direction in which it is driven at first, or zero.
    pub(super) fn new(params: &StrandParams, pos: Vec2, across: Vec2) -> Self {
        let way = match params.propagation {
            Propagation::Costs => {
                let lower = params.spread / params.step;
                let costs = WAYS.map(|way| 1.0 - lower * across.dot(way.as_vec2()).max(0.0));
                Way::Costs { origin: pos, cell: IVec2::ZERO, costs }
            }
            Propagation::Continuous => {
                let fade = params.step / params.spread.max(params.step);
                Way::Continuous { pos, heading: across, push: 2.0 * across, fade }
            }
        };
        Self { step: params.step, inertia: params.inertia, way }
    }

    pub(super) fn pos(&self) -> Vec2 {
        match self.way {
            Way::Costs { origin, cell, .. } => origin + cell.as_vec2() * self.step,
            Way::Continuous { pos, .. } => pos,
        }
    }

    /// Moves by one step where the field has the direction `v`.
    pub(super) fn advance(&mut self, v: Vec2) {
        match &mut self.way {
            Way::Costs { cell, costs, .. } => {
                for (cost, way) in costs.iter_mut().zip(WAYS) {
                    *cost -= (1.0 - self.inertia) * v.dot(way.as_vec2());
                }
                let mut least = 0;
                for i in 1..4 {
                    if costs[i] < costs[least] {
                        least = i;
                    }
                }
                *cell += WAYS[least];
                costs[least] += 1.0;
            }
            Way::Continuous { pos, heading, push, fade } => {
                let wish = (v + *push).normalize_or(v);
                // At the start there is no heading to keep.
                *heading = match *heading == Vec2::ZERO {
                    true => wish,
                    false => (*heading * self.inertia + wish * (1.0 - self.inertia)).normalize_or(*heading),
                };
                *push *= 1.0 - *fade;
                *pos += *heading * self.step;
            }
        }
    }
}
