//! From hits to growth.

pub(crate) mod apply;
pub(crate) mod collect;
