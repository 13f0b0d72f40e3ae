//! [`Batch`]: pieces that leave a surface.

use super::crumbs::Crumb;
use super::form::Form;
use crate::plugin::carrier::plane::Plane;
use crate::plugin::surface::cutouts::Span;
use crate::raster::TexelRect;
use crate::shatter::{BreakAgain, Flight};
use bevy::prelude::*;

/// Pieces that leave in one frame.
pub(super) struct Batch {
    pub(super) leaving: Vec<Leaving>,
    /// What comes off their edges.
    pub(super) crumbs: Vec<Crumb>,
    /// Their texels, row by row.
    pub(super) spans: Vec<Span>,
    /// Rectangles that cover them, texels of the field.
    pub(super) rects: Vec<TexelRect>,
    /// The part of the texture that the surface showed.
    pub(super) uv: [Vec2; 2],
}

/// A piece that leaves its place.
pub(super) struct Leaving {
    pub(super) number: u32,
    /// Where it lies in the surface.
    pub(super) plane: Plane,
    pub(super) flight: Flight,
    pub(super) seed: u64,
    /// How it breaks again, and how many seconds after the blow.
    pub(super) again: Option<(BreakAgain, f32)>,
    /// Its meshes, unless nothing of it can be seen.
    pub(super) form: Option<Box<Form>>,
    pub(super) spans: Vec<Span>,
}
