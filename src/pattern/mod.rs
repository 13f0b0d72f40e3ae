//! The types that generators and painters share.
//!
//! *Pattern space*: positions and lengths are in units of the surface's shorter side; (0, 0) is the top left, x
//! points right, y points down. Texels exist only in [`raster`](crate::raster) and [`paint`](crate::paint);
//! [`SurfaceFrame`] converts.
//!
//! ```
//! use bevy_crack::pattern::SurfaceFrame;
//!
//! // A surface twice as wide as high: the shorter side is 1.
//! let frame = SurfaceFrame::new([512, 256].into())?;
//! assert_eq!(frame.extent(), [2.0, 1.0].into());
//! # Ok::<(), bevy_crack::pattern::FrameError>(())
//! ```

mod cells;
mod frame;
mod lines;
mod mask;
mod network;
mod path;
#[cfg(test)]
pub(crate) mod random;
mod timeline;

pub(crate) use cells::Closing;
pub use cells::{CORNERS, Cell, CellTracker};
pub use frame::{FrameError, MAX_ASPECT, MAX_SIDE, SurfaceFrame};
pub(crate) use lines::lightness;
pub use mask::{CrackMask, MaskError};
pub use network::{Link, LinkKind, NO_IMPACT, NO_PARENT, Network, Node, SegmentId};
pub use path::{MAX_PATH_POINTS, PathPoint, SegmentPath};
pub(crate) use timeline::{Bricks, Entries, NO_BRICKS, Strike};
pub use timeline::{Dot, Moment, Timeline};
