//! [`Unfolding`]: a mesh that is laid out flat, with its picture.

use crate::unwrap::LaidOut;
use bevy::{
    math::{Affine2, Mat2},
    prelude::*,
};

/// A mesh that is laid out flat, and what of its picture lies where.
#[derive(Debug, PartialEq)]
pub(crate) struct Unfolding {
    /// No other one has the same.
    pub(crate) id: u64,
    pub(crate) layout: LaidOut,
    /// Texels for a unit of pattern space.
    pub(crate) unit: f32,
    /// The point around which it is laid out, in the mesh's space.
    pub(crate) around: Vec3,
    /// Whether the picture is laid out so itself.
    pub(crate) is_own: bool,
    /// From texels to the coordinates of the picture, for each triangle.
    to_picture: Vec<Affine2>,
}

impl Unfolding {
    /// `uvs` are those of each triangle's corners in the picture.
    #[cfg_attr(not(feature = "3d"), expect(dead_code, reason = "only 3D meshes are laid out"))]
    pub(crate) fn new(
        id: u64,
        layout: LaidOut,
        unit: f32,
        around: Vec3,
        uvs: impl Fn(usize) -> Option<[Vec2; 3]>,
    ) -> Self {
        let to_picture = layout.corners.iter().enumerate().map(|(triangle, corners)| {
            let ([a, b, c], [p, q, r]) = (*corners).zip(uvs(triangle)).unwrap_or_default();
            let (plane, picture) = (Mat2::from_cols(b - a, c - a), Mat2::from_cols(q - p, r - p));
            let matrix = picture * plane.inverse();
            let map = Affine2::from_mat2_translation(matrix, p - matrix * a);
            if map.is_finite() { map } else { Affine2::from_mat2_translation(Mat2::ZERO, p) }
        });
        let to_picture = to_picture.collect();
        Self { id, layout, unit, around, is_own: false, to_picture }
    }

    /// Whether a texel shows nothing of the mesh.
    pub(crate) fn is_gap(&self, texel: UVec2) -> bool {
        self.layout.owner(texel).is_none()
    }

    /// What of a picture of `size` texels a texel shows: the place there, texels.
    pub(crate) fn place(&self, texel: UVec2, size: UVec2) -> Vec2 {
        let at = texel.as_vec2() + 0.5;
        let owner = self.layout.owner(texel).and_then(|triangle| self.to_picture.get(triangle));
        owner.map_or(Vec2::ZERO, |map| map.transform_point2(at)) * size.as_vec2()
    }

    /// Turns the normals of a picture with it: RGBA8, as large as the layout.
    pub(crate) fn turn_normals(&self, texels: &mut [u8]) {
        let turns: Vec<Mat2> = self.to_picture.iter().map(|map| turn(map.matrix2)).collect();
        for (texel, owner) in texels.as_chunks_mut::<4>().0.iter_mut().zip(&self.layout.owner) {
            let Some(turn) = turns.get(*owner as usize) else { continue };
            let flat = Vec2::new(f32::from(texel[0]), f32::from(texel[1])) - FLAT;
            let [x, y] = (*turn * flat + FLAT).clamp(Vec2::ZERO, Vec2::splat(255.0)).round().to_array();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            {
                (texel[0], texel[1]) = (x as u8, y as u8);
            }
        }
    }
}

/// The level of a normal that is not tilted.
const FLAT: f32 = 128.0;

/// From normals of a picture, y up, to those of the plane it is laid into by the inverse of this matrix.
fn turn(to_picture: Mat2) -> Mat2 {
    let to_plane = to_picture.inverse();
    let (right, down) = (to_plane.x_axis.normalize_or_zero(), to_plane.y_axis.normalize_or_zero());
    if right == Vec2::ZERO || down == Vec2::ZERO {
        return Mat2::IDENTITY;
    }
    Mat2::from_cols(Vec2::new(right.x, -right.y), Vec2::new(-down.x, down.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_turn_with_the_picture() {
        let near = |a: Vec2, b: Vec2| a.distance(b) < 1e-5;
        assert_eq!(turn(Mat2::IDENTITY), Mat2::IDENTITY);
        // Turned by a quarter, clockwise as it is seen, y down: what leant to the right leans down.
        let quarter = Mat2::from_cols(Vec2::Y, Vec2::NEG_X);
        assert!(near(turn(quarter.inverse()) * Vec2::X, Vec2::NEG_Y));
        assert!(near(turn(quarter.inverse()) * Vec2::Y, Vec2::X));
        // Mirrored.
        let mirrored = Mat2::from_cols(Vec2::NEG_X, Vec2::Y);
        assert!(near(turn(mirrored) * Vec2::new(0.5, 0.2), Vec2::new(-0.5, 0.2)));
        assert_eq!(turn(Mat2::ZERO), Mat2::IDENTITY);
    }
}
