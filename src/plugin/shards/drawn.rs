//! Cracks that were carried on when a surface was cut are drawn on it.

use super::ShatterCracks;
use crate::{
    paint::Look,
    pattern::{PathPoint, SegmentPath},
    plugin::surfaces::Active,
    raster::stamp_path,
    shatter::RimLook,
};
use bevy::prelude::*;

/// How wide a crack is that was carried on, as a share of the narrowest that grow.
const HAIR: f32 = 0.5;

impl Active {
    /// Draws lines as cracks into the field.
    pub(super) fn stamp_lines(&mut self, lines: &[Vec<Vec2>]) {
        let width = HAIR * self.growth.params().line_width;
        for pair in lines.iter().flat_map(|line| line.windows(2)) {
            let [from, to] = [pair[0], pair[1]].map(|pos| PathPoint { pos, width });
            let rect = stamp_path(&mut self.field, &self.profile, &SegmentPath::straight(from, to));
            self.mark(rect);
        }
    }

    /// Draws the cracks that were carried on once more: the field has been drawn anew.
    pub(in crate::plugin) fn stamp_carried(&mut self) {
        if let Some(broken) = self.broken.take() {
            self.stamp_lines(&broken.carried);
            self.broken = Some(broken);
        }
    }

    /// How the rims of its shards look.
    pub(super) fn rim(&self, settings: &ShatterCracks) -> RimLook {
        settings.rim.unwrap_or_else(|| rim_of(&self.preset.look))
    }
}

fn rim_of(look: &Look) -> RimLook {
    match look {
        // The picture behind is seen through the walls of the cracks.
        Look { shift, opaque: true, .. } if *shift > 0.0 => RimLook::GLASS,
        // Neither light nor shade.
        Look { glint: 0.0, .. } => RimLook::PLAIN,
        _ => RimLook::STONE,
    }
}
