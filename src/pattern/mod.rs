//! The words that generators and painters share.
//!
//! *Pattern space*: positions and lengths are in units of the surface's shorter side; (0, 0) is the top left, x runs
//! right, y runs down. Texels exist only in [`raster`](crate::raster) and [`paint`](crate::paint); [`SurfaceFrame`]
//! converts.

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
pub use mask::{CrackMask, MaskError};
pub use network::{Link, LinkKind, NO_IMPACT, NO_PARENT, Network, Node, SegmentId};
pub use path::{MAX_PATH_POINTS, PathPoint, SegmentPath};
pub use timeline::{Dot, Moment, Timeline};
pub(crate) use timeline::{Entries, Strike};
