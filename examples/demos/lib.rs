//! What the demos share: finding out what this machine can show, and writing pictures where there is no window.
#![cfg(feature = "engine")]

mod film;
mod machine;

pub use film::{Film, FilmPlugin, OnCanvas, composite};
pub use machine::{DemoArguments, Output, demo_app};
