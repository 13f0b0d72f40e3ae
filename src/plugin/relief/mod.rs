//! Reliefs: from a component to a picture and a mesh, by a background task or in slices of frames.

mod show;
pub(crate) mod system;
mod work;
