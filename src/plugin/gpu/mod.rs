//! Textures, and their way to the GPU.

pub(crate) mod buffer;
pub(crate) mod fetch;
#[cfg(any(feature = "2d", feature = "3d"))]
pub(crate) mod grain;
pub(crate) mod memory;
pub(crate) mod mips;
pub(crate) mod pack;
pub(crate) mod textures;
pub(crate) mod uploads;
