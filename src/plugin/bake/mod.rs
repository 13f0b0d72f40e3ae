//! Guided cracks and strands: from a component to cracks on a surface, in background tasks or in slices of frames.

mod begin;
mod commit;
mod finish;
mod map_job;
mod strands_job;
pub(crate) mod system;
pub(crate) mod work;
