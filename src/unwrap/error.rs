//! [`UnwrapError`]: why a mesh cannot be laid out.

/// The most triangles of a mesh that is laid out.
pub const MAX_TRIANGLES: usize = 1 << 16;

/// The most charts that a mesh may fall into.
pub const MAX_CHARTS: usize = 1024;

/// A mesh that cannot be laid out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnwrapError {
    /// No triangle has an area.
    #[error("none of its {0} triangles has an area")]
    NoTriangles(usize),
    /// More than [`MAX_TRIANGLES`].
    #[error("it has {0} triangles, more than {MAX_TRIANGLES}")]
    TooManyTriangles(usize),
    /// A triangle names a vertex that is not there.
    #[error("a triangle names vertex {vertex} of {vertices}")]
    NoVertex {
        /// The vertex.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A position is not finite, or beyond ±1e9.
    #[error("position {0} is not within ±1e9")]
    Position(usize),
    /// It falls into more than [`MAX_CHARTS`] charts.
    #[error("it falls into more than {MAX_CHARTS} flat parts")]
    TooManyCharts,
    /// It would need more texels, a side or in all, than are allowed.
    #[error("it needs {width} x {height} texels, more than are allowed")]
    TooLarge {
        /// Texels across.
        width: u64,
        /// Texels down.
        height: u64,
    },
    /// A parameter is out of its range.
    #[error("`{0}` is out of its range")]
    Parameter(&'static str),
}
