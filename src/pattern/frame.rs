//! [`SurfaceFrame`]: conversion between pattern space and texels.

use glam::{UVec2, Vec2};

/// The largest side of a surface in texels.
pub const MAX_SIDE: u32 = 16_384;

/// The largest ratio of the sides at which the shorter side is the unit; beyond it the unit is the longer side / 64.
pub const MAX_ASPECT: f32 = 64.0;

/// The position of a surface of `size` texels in pattern space.
///
/// ```
/// use bevy_crack::pattern::SurfaceFrame;
///
/// let frame = SurfaceFrame::new([512, 256].into())?;
/// assert_eq!(frame.extent(), [2.0, 1.0].into());
/// assert_eq!(frame.to_texel([1.0, 0.5].into()), [256.0, 128.0].into());
/// assert_eq!(frame.to_pos([256.0, 128.0].into()), [1.0, 0.5].into());
/// assert_eq!(frame.uv_to_pos([0.5, 0.5].into()), [1.0, 0.5].into());
/// assert_eq!(frame.pos_to_uv([1.0, 0.5].into()), [0.5, 0.5].into());
///
/// // A poster of the same texels on a wall where 1024 of them are a unit: cracks are as large as on the wall.
/// let poster = SurfaceFrame::with_unit(frame.size(), 1024.0)?;
/// assert_eq!((frame.texels_per_unit(), poster.texels_per_unit()), (256.0, 1024.0));
/// assert_eq!(poster.extent(), [0.5, 0.25].into());
/// # Ok::<(), bevy_crack::pattern::FrameError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceFrame {
    size: UVec2,
    texels_per_unit: f32,
}

/// A size that a surface cannot have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a surface of {width} x {height} texels: both sides must lie in 1..={MAX_SIDE}")]
pub struct FrameError {
    /// Width asked for, in texels.
    pub width: u32,
    /// Height asked for, in texels.
    pub height: u32,
}

impl SurfaceFrame {
    /// The frame of a surface of `size` texels.
    ///
    /// # Errors
    /// [`FrameError`] if a side is zero or above [`MAX_SIDE`].
    pub fn new(size: UVec2) -> Result<Self, FrameError> {
        if size.min_element() == 0 || size.max_element() > MAX_SIDE {
            return Err(FrameError { width: size.x, height: size.y });
        }
        let unit = (size.min_element() as f32).max(size.max_element() as f32 / MAX_ASPECT);
        Ok(Self { size, texels_per_unit: unit })
    }

    /// The frame of a surface of `size` texels with so many texels for a unit of pattern space; those that would make a side longer than 64
    /// units, or are no number above 0, become the nearest that do not.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_unit(size: UVec2, texels_per_unit: f32) -> Result<Self, FrameError> {
        let frame = Self::new(size)?;
        let least = size.max_element() as f32 / MAX_ASPECT;
        let most = size.min_element() as f32 * 64.0;
        let unit = if texels_per_unit > 0.0 { texels_per_unit.min(most).max(least) } else { frame.texels_per_unit };
        Ok(Self { size, texels_per_unit: unit })
    }

    /// Size in texels.
    #[must_use]
    pub const fn size(&self) -> UVec2 {
        self.size
    }

    /// Texels per pattern unit: the shorter side, in texels, unless it was given.
    #[must_use]
    pub const fn texels_per_unit(&self) -> f32 {
        self.texels_per_unit
    }

    /// Size in pattern units; the shorter side is 1 (below 1 only when one side is over 64 times the other), unless the unit was given.
    #[must_use]
    pub fn extent(&self) -> Vec2 {
        self.size.as_vec2() / self.texels_per_unit
    }

    /// Converts pattern space to continuous texel coordinates (texel centres are at half-integers).
    #[must_use]
    pub fn to_texel(&self, pos: Vec2) -> Vec2 {
        pos * self.texels_per_unit
    }

    /// Converts continuous texel coordinates to pattern space.
    #[must_use]
    pub fn to_pos(&self, texel: Vec2) -> Vec2 {
        texel / self.texels_per_unit
    }

    /// Converts texture coordinates (0..1, v down) to pattern space.
    #[must_use]
    pub fn uv_to_pos(&self, uv: Vec2) -> Vec2 {
        uv * self.extent()
    }

    /// Converts pattern space to texture coordinates (0..1, v down).
    #[must_use]
    pub fn pos_to_uv(&self, pos: Vec2) -> Vec2 {
        pos / self.extent()
    }
}
