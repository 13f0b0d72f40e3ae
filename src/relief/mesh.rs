//! Meshes of height fields, as plain arrays: [`ReliefMesh`].

use super::{error::ReliefError, terrain_check::check_heights};
use crate::Grid;
use glam::Vec2;

/// Largest level of detail: one vertex for 2^10 texels across and down.
pub const MAX_DETAIL: u32 = 10;

/// How a height field becomes a mesh.
///
/// ```
/// use bevy_crack::{Grid, relief::{ReliefFrame, ReliefMesh}};
///
/// let heights = Grid::from_vec([3, 3].into(), vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
/// let mesh = ReliefMesh::new(&heights, &ReliefFrame::new([2.0, 2.0].into()), 0)?;
/// assert_eq!((mesh.positions.len(), mesh.indices.len()), (9, 24));
/// assert_eq!(mesh.positions[4], [0.0, 0.0, 2.0]);
/// # Ok::<(), bevy_crack::relief::ReliefError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliefFrame {
    /// Size of the whole surface in the mesh's units.
    pub size: Vec2,
    /// Texture coordinates of the surface's top left and bottom right corner; default 0 and 1.
    pub uv: [Vec2; 2],
    /// Depth of the wall that hangs down from the border, pattern units: it hides gaps between meshes of different
    /// detail. 0 or more; default 0 = none.
    pub skirt: f32,
}

impl ReliefFrame {
    /// A surface of `size` that shows a whole texture, without a skirt.
    #[must_use]
    pub const fn new(size: Vec2) -> Self {
        Self { size, uv: [Vec2::ZERO, Vec2::ONE], skirt: 0.0 }
    }
}

/// A triangle list. x points right, y up (towards the top row of the field), z out of the surface: heights; triangles are
/// counter-clockwise as seen from +z.
///
/// For ground, turn it by -90 degrees around x: z becomes up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReliefMesh {
    /// Positions of the vertices; (0, 0) is the middle of the surface.
    pub positions: Vec<[f32; 3]>,
    /// Unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, v down.
    pub uvs: Vec<[f32; 2]>,
    /// Indices of vertices, three per triangle.
    pub indices: Vec<u32>,
}

/// The texels of a line on which there are vertices: every `step`th, and the last.
fn picks(n: u32, step: u32) -> Vec<u32> {
    let mut picks: Vec<_> = (0..n - 1).step_by(step as usize).collect();
    picks.push(n - 1);
    picks
}

impl ReliefMesh {
    /// The mesh of a height field, with one vertex for every `2^detail` texels across and down.
    ///
    /// The outermost vertices lie on the border of the surface. Heights are in pattern units. Normals are those of the whole field, so
    /// that all levels of detail are lit alike.
    ///
    /// # Errors
    /// [`ReliefError`] if the field has less than two texels on a side, a height is not finite, or a number of `frame` or `detail` is out of range.
    pub fn new(heights: &Grid<f32>, frame: &ReliefFrame, detail: u32) -> Result<Self, ReliefError> {
        check_heights(heights, 2)?;
        let most = 1e6;
        let ranges = [
            ("size", frame.size.x, 1e-6, most),
            ("size", frame.size.y, 1e-6, most),
            ("skirt", frame.skirt, 0.0, most),
            ("detail", detail as f32, 0.0, MAX_DETAIL as f32),
        ];
        if let Some((name, value, min, max)) =
            ranges.into_iter().find(|(_, value, min, max)| !(*min..=*max).contains(value))
        {
            return Err(ReliefError::OutOfRange { name, value, min, max });
        }
        let size = heights.size();
        let (columns, rows) = (picks(size.x, 1 << detail), picks(size.y, 1 << detail));
        let mut mesh = Self::default();
        mesh.vertices(heights, frame, &columns, &rows);
        mesh.faces(columns.len() as u32, rows.len() as u32);
        if frame.skirt > 0.0 {
            mesh.hang_skirt(frame, columns.len() as u32, rows.len() as u32);
        }
        Ok(mesh)
    }

    fn vertices(&mut self, heights: &Grid<f32>, frame: &ReliefFrame, columns: &[u32], rows: &[u32]) {
        let last = heights.size() - 1;
        // Of pattern units; the shorter side is 1.
        let scale = frame.size.min_element();
        let texel = frame.size / last.as_vec2();
        let at = |x: u32, y: u32| heights.row(y as usize)[x as usize] * scale;
        for &y in rows {
            for &x in columns {
                let share = Vec2::new(x as f32, y as f32) / last.as_vec2();
                let place = (share - 0.5) * frame.size;
                self.positions.push([place.x, -place.y, at(x, y)]);
                self.uvs.push((frame.uv[0] + (frame.uv[1] - frame.uv[0]) * share).to_array());
                let [left, right] = [x.saturating_sub(1), (x + 1).min(last.x)];
                let [above, below] = [y.saturating_sub(1), (y + 1).min(last.y)];
                let across = (at(right, y) - at(left, y)) / ((right - left) as f32 * texel.x);
                let up = (at(x, above) - at(x, below)) / ((below - above) as f32 * texel.y);
                self.normals.push(glam::Vec3::new(-across, -up, 1.0).normalize().to_array());
            }
        }
    }

    fn faces(&mut self, columns: u32, rows: u32) {
        for y in 0..rows - 1 {
            for x in 0..columns - 1 {
                let [a, b] = [y * columns + x, y * columns + x + 1];
                let [c, d] = [a + columns, b + columns];
                let height = |i: u32| self.positions[i as usize][2];
                // Along the diagonal that bends less, so that ridges are not cut.
                let is_falling = (height(a) - height(d)).abs() <= (height(b) - height(c)).abs();
                self.indices.extend(if is_falling { [a, c, d, a, d, b] } else { [a, c, b, b, c, d] });
            }
        }
    }

    /// A wall down from the border, with the normals and texture coordinates of it.
    fn hang_skirt(&mut self, frame: &ReliefFrame, columns: u32, rows: u32) {
        let last = columns * rows - 1;
        let top = 0..columns;
        let right = (0..rows).map(|y| y * columns + columns - 1);
        let bottom = (0..columns).map(|x| last - x);
        let left = (0..rows).map(|y| (rows - 1 - y) * columns);
        let border: Vec<_> = top.chain(right).chain(bottom).chain(left).collect();
        let depth = frame.skirt * frame.size.min_element();
        let first = self.positions.len() as u32;
        for &i in &border {
            let [x, y, z] = self.positions[i as usize];
            self.positions.push([x, y, z - depth]);
            self.normals.push(self.normals[i as usize]);
            self.uvs.push(self.uvs[i as usize]);
        }
        let n = border.len() as u32;
        for i in 0..n {
            let next = (i + 1) % n;
            let [a, b] = [border[i as usize], border[next as usize]];
            if a != b {
                self.indices.extend([a, b, first + next, a, first + next, first + i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;
    use glam::{UVec2, Vec3};

    #[test]
    fn all_levels_of_detail_cover_the_surface_and_face_outwards() {
        let mut rng = Rng::new(1);
        for size in [[2, 2], [3, 17], [33, 20], [64, 65]].map(UVec2::from) {
            let mut heights = Grid::new(size, 0.0);
            heights.as_mut_slice().fill_with(|| 0.1 * rng.unit());
            for detail in 0..=MAX_DETAIL {
                let mesh = ReliefMesh::new(&heights, &ReliefFrame::new(Vec2::new(3.0, 2.0)), detail).unwrap();
                let place = |i: u32| Vec3::from(mesh.positions[i as usize]);
                let mut area = 0.0;
                for triangle in mesh.indices.chunks_exact(3) {
                    let [a, b, c] = [0, 1, 2].map(|i| place(triangle[i]));
                    let normal = (b - a).cross(c - a);
                    assert!(normal.z > 0.0, "{size}, detail {detail}");
                    area += 0.5 * normal.z;
                }
                assert!((area - 6.0).abs() < 1e-3, "{size}, detail {detail}: area {area}");
                assert!(mesh.normals.iter().all(|&normal| (Vec3::from(normal).length() - 1.0).abs() < 1e-4));
                assert_eq!(mesh.uvs.last(), Some(&[1.0, 1.0]));
            }
        }
    }

    /// With a skirt every edge between two triangles is used once in each direction, except at the lower end.
    #[test]
    fn skirts_are_joined_to_the_border_and_face_outwards() {
        let heights = Grid::new(UVec2::new(5, 4), 0.1);
        let frame = ReliefFrame { skirt: 0.2, ..ReliefFrame::new(Vec2::ONE) };
        let mesh = ReliefMesh::new(&heights, &frame, 0).unwrap();
        let n = 20;
        let mut edges = std::collections::BTreeMap::new();
        for triangle in mesh.indices.chunks_exact(3) {
            for i in 0..3 {
                *edges.entry((triangle[i], triangle[(i + 1) % 3])).or_insert(0) += 1;
            }
            let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(mesh.positions[triangle[i] as usize]));
            let normal = (b - a).cross(c - a);
            assert!(normal.z > 0.0 || normal.dot((a + b + c) * Vec3::new(1.0, 1.0, 0.0)) > 0.0, "{triangle:?}");
        }
        for (&(a, b), &count) in &edges {
            assert_eq!(count, 1);
            assert!(edges.contains_key(&(b, a)) || a >= n || b >= n, "{a} {b}");
        }
    }

    #[test]
    fn wrong_numbers_are_refused() {
        let frame = ReliefFrame::new(Vec2::ONE);
        let small = ReliefMesh::new(&Grid::new(UVec2::new(1, 9), 0.0), &frame, 0);
        assert!(matches!(small, Err(ReliefError::Size { width: 1, height: 9, .. })));
        let flat = Grid::new(UVec2::splat(9), 0.0);
        assert!(matches!(ReliefMesh::new(&flat, &frame, 11), Err(ReliefError::OutOfRange { name: "detail", .. })));
        let frame = ReliefFrame { size: Vec2::new(1.0, f32::NAN), ..frame };
        assert!(matches!(ReliefMesh::new(&flat, &frame, 0), Err(ReliefError::OutOfRange { name: "size", .. })));
    }
}
