//! Anti-aliased stamps.

use super::{DepthField, Profile, TexelRect};
use crate::pattern::SegmentPath;
use glam::Vec2;

/// Stamps the rough line of one segment into `field`; returns the texels that it may have changed.
pub fn stamp_path(_field: &mut DepthField, _profile: &Profile, _path: &SegmentPath) -> TexelRect {
    todo!()
}

/// Stamps a disc of `radius` pattern units at `pos` (pattern units), `depth` (0..=1) deep; returns the texels that it may have changed.
pub fn stamp_dot(_field: &mut DepthField, _pos: Vec2, _radius: f32, _depth: f32) -> TexelRect {
    todo!()
}
