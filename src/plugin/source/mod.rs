//! From assets to values: pictures, masks, presets.

pub(crate) mod analogy;
pub(crate) mod layout;
pub(crate) mod mask;
pub(crate) mod picture;
pub(crate) mod png;
pub(crate) mod preset;
pub(crate) mod unfolding;
