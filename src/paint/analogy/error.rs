//! [`AnalogyError`].

/// Why an image analogy cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AnalogyError {
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
    /// A photograph is too small or too large.
    #[error("a photograph of {width} x {height} texels: both sides must lie in {least}..={most}")]
    ExampleSize {
        /// Width, texels.
        width: u32,
        /// Height, texels.
        height: u32,
        /// Shortest side allowed.
        least: u32,
        /// Longest side allowed.
        most: u32,
    },
    /// The surface has a side that is zero or too long.
    #[error("a surface of {width} x {height} texels: both sides must lie in 1..={most}")]
    SurfaceSize {
        /// Width, texels.
        width: u32,
        /// Height, texels.
        height: u32,
        /// Longest side allowed.
        most: u32,
    },
    /// A guide or a map has another size than what it belongs to.
    #[error("`{name}` is {width} x {height} texels, must be {expected_width} x {expected_height}")]
    SizesDiffer {
        /// What has the wrong size.
        name: &'static str,
        /// Its width, texels.
        width: u32,
        /// Its height, texels.
        height: u32,
        /// The width that it must have, texels.
        expected_width: u32,
        /// The height that it must have, texels.
        expected_height: u32,
    },
    /// A guide has a value that is not finite.
    #[error("`{name}` is not finite at texel {x}, {y}")]
    NotFinite {
        /// Name of the guide.
        name: &'static str,
        /// Column of the texel.
        x: u32,
        /// Row of the texel.
        y: u32,
    },
    /// The guide of the photographs marks no texel as crack.
    #[error("the photographs have no crack: no texel of their guides reaches `depth` {depth}")]
    NoCrack {
        /// The value from which a texel counts as crack.
        depth: f32,
    },
    /// The guide of the photographs marks every texel as crack.
    #[error("the photographs are all crack: every texel of their guides reaches `depth` {depth}")]
    AllCrack {
        /// The value from which a texel counts as crack.
        depth: f32,
    },
    /// No lines stand out from the picture.
    #[error("the picture has no lines that could be its cracks")]
    NoLines,
    /// There are no pairs, or too many.
    #[error("{count} pairs of guide and photograph: the number must lie in 1..={most}")]
    PairCount {
        /// Number of pairs.
        count: usize,
        /// Largest number allowed.
        most: usize,
    },
    /// There is not one map for each photograph.
    #[error("{count} maps for {expected} photographs, must be one for each")]
    MapCount {
        /// Number of maps.
        count: usize,
        /// Number of photographs.
        expected: usize,
    },
    /// All photographs together have too many texels.
    #[error("the photographs have {texels} texels, at most {most} are allowed")]
    TooManyTexels {
        /// Number of texels, with what is between the photographs.
        texels: u64,
        /// Largest number allowed.
        most: u64,
    },
    /// The pairs and the surface have different numbers of further channels.
    #[error("{count} further channels where {expected} are expected, at most {most} are allowed")]
    ChannelCount {
        /// Number of channels given.
        count: usize,
        /// Number of channels of the first pair.
        expected: usize,
        /// Largest number allowed.
        most: usize,
    },
}
