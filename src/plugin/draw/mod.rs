//! Each frame: growth, time, painting.

pub(crate) mod analogy;
pub(crate) mod async_playback;
pub(crate) mod blend;
pub(crate) mod clock;
pub(crate) mod frame_job;
pub(crate) mod freeze;
pub(crate) mod grow;
pub(crate) mod next_picture;
pub(crate) mod paint;
pub(crate) mod report;
mod running;
