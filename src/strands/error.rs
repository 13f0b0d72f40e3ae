//! [`StrandError`] and [`PrimitiveError`].

/// Why strands cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StrandError {
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
    /// A start is not on the surface.
    #[error("start {index} at {x}, {y} is not on the surface of {width} x {height}")]
    StartOutside {
        /// Index of the start.
        index: usize,
        /// Its position, pattern units.
        x: f32,
        /// Its position, pattern units.
        y: f32,
        /// Size of the surface, pattern units.
        width: f32,
        /// Size of the surface, pattern units.
        height: f32,
    },
    /// There are too many starts.
    #[error("{count} starts: the most is {most}")]
    TooManyStarts {
        /// Number of starts.
        count: usize,
        /// Largest number allowed.
        most: usize,
    },
    /// A painted field has no texels.
    #[error("`directions.painted` has no texels")]
    EmptyField,
    /// A painted field has a value that is not finite.
    #[error("`directions.painted` is not finite at texel {x}, {y}")]
    FieldNotFinite {
        /// Column of the texel.
        x: u32,
        /// Row of the texel.
        y: u32,
    },
    /// The bytes of a picture are not four for each texel.
    #[error("a picture of {width} x {height} texels has {bytes} bytes, must have 4 for each texel")]
    PictureSize {
        /// Width, texels.
        width: u32,
        /// Height, texels.
        height: u32,
        /// Number of bytes.
        bytes: usize,
    },
    /// A line does not have two different points, has too many, or one that is not finite.
    #[error("`directions.line` has {points} points: it must have 2..={most} finite ones that are not all the same")]
    Line {
        /// Number of points.
        points: usize,
        /// Largest number allowed.
        most: usize,
    },
    /// There are no primitives.
    #[error("there are no primitives")]
    NoPrimitives,
    /// Several lanes need primitives with connectors on all four sides.
    #[error("`lanes` is {lanes}, but primitive {index} has no connectors at its sides")]
    NoSides {
        /// Number of lanes.
        lanes: u32,
        /// Index of the primitive.
        index: usize,
    },
}

/// Why an image cannot be a primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PrimitiveError {
    /// A side is too short or too long.
    #[error("a primitive of {width} x {height} texels: both sides must lie in {least}..={most}")]
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
    /// No texel is deep enough to belong to a crack.
    #[error("the primitive is empty: no texel is deeper than a quarter of the range")]
    Empty,
    /// The crack does not reach the middle of a side where it must.
    #[error("the primitive has no connector at its {side}: the crack must reach the middle of that side")]
    NoConnector {
        /// The side: `head` (top) or `tail` (bottom).
        side: &'static str,
    },
    /// Two connectors are not joined by the crack.
    #[error("the crack of the primitive does not join its head to its {side}")]
    NotJoined {
        /// The side that cannot be reached from the head.
        side: &'static str,
    },
}
