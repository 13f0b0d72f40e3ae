//! [`ReliefError`].

use crate::{OutOfMemory, pattern::FrameError};

/// Why contour lines, heights, colors, meshes or craters cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReliefError {
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
    /// No parameter has this name.
    #[error("there is no parameter `{name}`")]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// The text is not a value of the parameter.
    #[error("parameter `{name}` cannot be `{text}`")]
    Unreadable {
        /// Name of the parameter.
        name: String,
        /// The text given.
        text: String,
    },
    /// Two parameters are in the wrong order.
    #[error("`{low}` is {low_value}, must not be above `{high}`, which is {high_value}")]
    Order {
        /// Name of the parameter that must be lower.
        low: &'static str,
        /// Its value.
        low_value: f32,
        /// Name of the parameter that must be higher.
        high: &'static str,
        /// Its value.
        high_value: f32,
    },
    /// The number of samples is not a power of two.
    #[error("`samples` is {samples}, must be a power of two")]
    Samples {
        /// Number of samples.
        samples: u32,
    },
    /// The first harmonic whose phase changes is above the highest one.
    #[error("`first_harmonic` is {first}, must not be above {most}, half the number of samples")]
    FirstHarmonic {
        /// The first harmonic.
        first: u32,
        /// The highest harmonic.
        most: u32,
    },
    /// There are no contours, or too many of them.
    #[error("{contours} contours: there must be 1..={most}")]
    Contours {
        /// Number of contours.
        contours: usize,
        /// Largest number allowed.
        most: usize,
    },
    /// A contour has too few points.
    #[error("contour {contour} has {points} points: a closed line has three at least")]
    TooFewPoints {
        /// Index of the contour.
        contour: usize,
        /// Number of points.
        points: usize,
    },
    /// All contours together have too many points, at the start or later on.
    #[error("the contours have more than {most} points")]
    TooManyPoints {
        /// Largest number allowed.
        most: usize,
    },
    /// A coordinate is not finite, or too large.
    #[error("point {point} of contour {contour} is at {x}, {y}: coordinates must lie in -{most}..={most}")]
    Point {
        /// Index of the contour.
        contour: usize,
        /// Index of the point.
        point: usize,
        /// Its position.
        x: f32,
        /// Its position.
        y: f32,
        /// Largest coordinate allowed.
        most: f32,
    },
    /// The contours enclose nothing.
    #[error("the contours enclose no area")]
    NoArea,
    /// The distance is too small beside the size and the place of the contours to be computed.
    #[error("the distance is {distance}, must not be below {least} for contours of this size at this place")]
    Distance {
        /// The distance.
        distance: f32,
        /// The smallest one that can be computed.
        least: f32,
    },
    /// Lines cross too often to be untangled.
    #[error("the lines of level {level} have too many crossings to be untangled")]
    Tangled {
        /// The level that was being made.
        level: i32,
    },
    /// An image of factors or heights has a value that cannot be used.
    #[error("texel {x}, {y} of the image is {value}, must lie in {min}..={max}")]
    Texel {
        /// Column of the texel.
        x: u32,
        /// Row of the texel.
        y: u32,
        /// Its value.
        value: f32,
        /// Smallest value allowed.
        min: f32,
        /// Largest value allowed.
        max: f32,
    },
    /// An image has no texels, or the surface that it covers no size.
    #[error("the image has {width} x {height} texels on a surface of {across} x {down}: all must be above zero")]
    Image {
        /// Width, texels.
        width: u32,
        /// Height, texels.
        height: u32,
        /// Width of the surface.
        across: f32,
        /// Height of the surface.
        down: f32,
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
    /// The surface cannot have this size.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// There is no memory for a relief of this size.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
}
