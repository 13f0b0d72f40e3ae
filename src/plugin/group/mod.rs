//! Surfaces that are put together from members: what these show (`members.rs`), the picture of all of it (`wall.rs`), and when it is
//! made and shown (`system.rs`, `hide.rs`).

pub(crate) mod hide;
mod members;
pub(crate) mod system;
mod wall;
