//! [`BlendError`]: what cannot be blended.

use glam::UVec2;

/// Values that cannot be blended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BlendError {
    /// A value is not finite, or too large to be added to others.
    #[error("the value at column {x}, row {y} must be finite and lie in -1e20..=1e20")]
    NotFinite {
        /// Its column.
        x: u32,
        /// Its row.
        y: u32,
    },
    /// A normal map does not have four bytes for each texel.
    #[error("a normal map of {size} texels has {length} bytes, must have four for each texel")]
    Length {
        /// Its size, texels.
        size: UVec2,
        /// Its length, bytes.
        length: usize,
    },
    /// The cover of a patch does not have the size of its heights.
    #[error("the cover has {cover} texels, must have {height} as the heights")]
    Cover {
        /// Size of the cover, texels.
        cover: UVec2,
        /// Size of the heights, texels.
        height: UVec2,
    },
    /// A patch or a field does not lie in the normal map.
    #[error("{part} texels from {origin} on do not lie in a normal map of {size}")]
    Outside {
        /// Size of the patch or field, texels.
        part: UVec2,
        /// Its top left in the normal map.
        origin: UVec2,
        /// Size of the normal map, texels.
        size: UVec2,
    },
}

/// Checks whether a part of a normal map lies in it, and whether there are enough bytes; returns the map's texels.
pub(super) fn texels(normals: &[u8], size: UVec2, part: UVec2, origin: UVec2) -> Result<&[[u8; 4]], BlendError> {
    let n = (size.x as usize).checked_mul(size.y as usize).and_then(|n| n.checked_mul(4));
    if n != Some(normals.len()) {
        return Err(BlendError::Length { size, length: normals.len() });
    }
    let fits = |axis: usize| origin[axis].checked_add(part[axis]).is_some_and(|end| end <= size[axis]);
    if fits(0) && fits(1) { Ok(normals.as_chunks().0) } else { Err(BlendError::Outside { part, origin, size }) }
}
