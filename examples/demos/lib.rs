//! What the demos share: finding out what this machine can show, playing by hand or by a script, and writing pictures where there
//! is no window.
#![cfg(feature = "engine")]

mod film;
mod label;
mod machine;
mod moving;
mod play;

pub use film::OnCanvas;
pub use label::Label;
pub use machine::{DemoArguments, Output, demo_app};
pub use play::{Cursor, Script, caption, heal_on_h, hit_on_press, play, repeated, with_normals};
