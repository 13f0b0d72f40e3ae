//! A surface that cracks: what it is made of, how it is made, how its time passes.

pub(crate) mod active;
mod blend_steps;
pub(crate) mod blending;
pub(crate) mod canvas;
pub(crate) mod cracked;
pub(crate) mod cracks;
pub(crate) mod create;
pub(crate) mod cutouts;
pub(crate) mod drawing;
pub(crate) mod frame;
pub(crate) mod inputs;
pub(crate) mod motion;
pub(crate) mod owners;
pub(crate) mod picture_plan;
pub(crate) mod plan;
pub(crate) mod playhead;
pub(crate) mod prepare;
pub(crate) mod queue;
pub(crate) mod queues;
pub(crate) mod regrow;
pub(crate) mod reread;
pub(crate) mod stamp;
pub(crate) mod stamp_network;
pub(crate) mod tile_set;
pub(crate) mod time;
pub(crate) mod warm;
