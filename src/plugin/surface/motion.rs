//! [`Motion`]: baked cracks that move to where they stay.

use super::stamp_network::stamp_all;
use super::tile_set::Touched;
use crate::growth::{CrackGrowth, GrowthParams};
use crate::raster::{DepthField, Profile};
use crate::voronoi::SeamMotion;
use bevy::prelude::*;
use std::sync::{Arc, Mutex};

/// Share of the way within which the cracks open.
const OPENING: f32 = 0.125;

/// Baked cracks that move to where they stay. Copies share the map.
#[derive(Clone)]
pub(crate) struct Motion(Arc<Mutex<SeamMotion>>);

impl Motion {
    pub(crate) fn new(motion: SeamMotion) -> Self {
        Self(Arc::new(Mutex::new(motion)))
    }
}

/// A place on the way.
pub(crate) struct MotionFrame {
    pub(super) motion: Motion,
    /// The share of the way, 0..=1.
    pub(super) share: f32,
    pub(super) params: GrowthParams,
}

impl MotionFrame {
    /// Draws the cracks in place of what is in the field. `false` if that is not possible; nothing has changed then.
    pub(crate) fn draw(&self, profile: &Profile, field: &mut DepthField, touched: &mut Touched) -> bool {
        let Ok(mut motion) = self.motion.0.lock() else { return false };
        let Ok(seams) = motion.at(self.share) else { return false };
        drop(motion);
        let mut network = seams.network(Vec2::ZERO);
        let open = (self.share / OPENING).min(1.0);
        for node in &mut network.nodes {
            (node.birth, node.width) = (0, open * node.width);
        }
        network.links.iter_mut().for_each(|link| link.birth = 0);
        let Ok(mut growth) = CrackGrowth::new(self.params.clone(), field.frame.extent(), 0) else { return false };
        growth.add_cracks(&network, 0);
        field.clear();
        *touched = Touched::new(field.frame.size());
        stamp_all(&growth, profile, field, touched);
        true
    }
}
