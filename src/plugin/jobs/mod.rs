//! Background tasks and the frame's time.

pub(crate) mod background;
pub(crate) mod copy;
pub(crate) mod deferred;
pub(crate) mod frame_time;
pub(crate) mod stepped;
pub(crate) mod threads;
