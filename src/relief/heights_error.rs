//! [`HeightError`]: why there are no heights.

/// Why heights, colors, meshes or craters cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HeightError {
    /// A number is outside its range, or not finite.
    #[error("`{name}` is {value}, must lie in {min}..={max}")]
    OutOfRange {
        /// Name of the parameter.
        name: &'static str,
        /// Its value.
        value: f32,
        /// Smallest value allowed.
        min: f32,
        /// Largest value allowed.
        max: f32,
    },
    /// No number has this name.
    #[error("there is no parameter `{name}`")]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// The text is not a value of the number.
    #[error("parameter `{name}` cannot be `{text}`")]
    Unreadable {
        /// Name of the parameter.
        name: String,
        /// The text given.
        text: String,
    },
    /// A ring has less than three points.
    #[error("ring {ring} has {points} points, must have 3 at least")]
    FewPoints {
        /// Index of the ring.
        ring: usize,
        /// Number of its points.
        points: usize,
    },
    /// A point of a ring is not finite, or far outside of every surface.
    #[error("point {point} of ring {ring} must be finite and lie in -{most}..={most}")]
    Point {
        /// Index of the ring.
        ring: usize,
        /// Index of the point.
        point: usize,
        /// Largest coordinate allowed, pattern units.
        most: f32,
    },
    /// The level of a ring is too high or too low.
    #[error("ring {ring} has level {level}, must lie in -{most}..={most}")]
    Level {
        /// Index of the ring.
        ring: usize,
        /// Its level.
        level: i32,
        /// Largest level allowed.
        most: i32,
    },
    /// All rings together have too many points.
    #[error("{count} points: the most is {most}")]
    TooManyPoints {
        /// Number of points.
        count: usize,
        /// Largest number allowed.
        most: usize,
    },
    /// Heights are too large, or not finite.
    #[error("the height at column {x}, row {y} must be finite and lie in -1e6..=1e6")]
    Height {
        /// Column of the texel.
        x: u32,
        /// Row of the texel.
        y: u32,
    },
    /// A grid of heights is too small or too large.
    #[error("heights of {width} x {height} texels: both sides must lie in {least}..={most}")]
    Size {
        /// Width, texels.
        width: u32,
        /// Height, texels.
        height: u32,
        /// Shortest side allowed.
        least: u32,
        /// Longest side allowed.
        most: u32,
    },
}
