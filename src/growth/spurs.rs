//! Spurs: short side cracks that end by themselves.

use super::CrackGrowth;
use crate::{
    math::{Rng, mix},
    pattern::NO_PARENT,
};
use glam::Vec2;
use std::ops::Range;

/// Length of a spur in segment lengths: least and most.
const LENGTH: (f32, f32) = (0.55, 1.1);

/// Cosine of the angle to the crack that it starts from: least and most.
const ALONG: (f32, f32) = (0.0, 0.6);

impl CrackGrowth {
    /// Lets short cracks start beside what the newborn nodes have grown from.
    pub(super) fn spur(&mut self, newborn: Range<u32>) {
        if self.params.spurs <= 0.0 {
            return;
        }
        let length = self.params.step_length;
        for node in newborn {
            let from = self.network.nodes[node as usize].parent;
            // Once at each node, when the crack runs on from it.
            if from == NO_PARENT || self.changes.kin[node as usize].sibling != NO_PARENT {
                continue;
            }
            let mut rng = Rng::new(mix(self.seed ^ 0x5B ^ u64::from(from) << 16));
            if rng.unit() >= self.params.spurs {
                continue;
            }
            let begin = self.network.nodes[from as usize];
            let along = (self.network.nodes[node as usize].pos - begin.pos).normalize_or(Vec2::X);
            let side = if rng.unit() < 0.5 { along.perp() } else { -along.perp() };
            let cos = rng.range(ALONG.0, ALONG.1);
            let way = along * cos + side * (1.0 - cos * cos).sqrt();
            // It starts at the rim of the crack, so a wide one has not swallowed it.
            let to = begin.pos + way * (length * rng.range(LENGTH.0, LENGTH.1) + 0.5 * begin.width);
            let is_inside = to.cmpgt(Vec2::ZERO).all() && to.cmplt(self.network.extent()).all();
            if is_inside && !self.is_near_crack(from, way, 1.8 * length) {
                if self.arrest.is_some() {
                    self.extend(from, to, true);
                } else if self.room() > 0 {
                    self.bear(to, from, begin.generation.saturating_add(1), begin.impact, 1.0);
                }
            }
        }
    }
}
