//! [`Unfolding`]: a mesh that is laid out flat, with its picture.

use crate::Grid;
use crate::unwrap::{GUTTER, LaidOut};
use crate::voronoi::{MapCharts, VoronoiError};
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
    /// Size of its picture, the shorter side being 1.
    pub(crate) picture: Vec2,
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
        picture: Option<UVec2>,
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
        let picture = picture.filter(|size| size.min_element() > 0).unwrap_or(UVec2::ONE).as_vec2();
        let picture = picture / picture.min_element();
        Self { id, layout, unit, around, is_own: false, picture, to_picture }
    }

    /// Whether a texel shows nothing of the mesh.
    pub(crate) fn is_gap(&self, texel: UVec2) -> bool {
        self.layout.owner(texel).is_none()
    }

    /// What of a picture of `size` texels a texel shows: the place there, texels.
    pub(crate) fn place(&self, texel: UVec2, size: UVec2) -> Vec2 {
        self.uv(texel.as_vec2() + 0.5).unwrap_or(Vec2::ZERO) * size.as_vec2()
    }

    /// The texture coordinates in its picture of what lies in a place, texels; `None` in a gap.
    fn uv(&self, place: Vec2) -> Option<Vec2> {
        let owner = self.layout.owner(place.max(Vec2::ZERO).as_uvec2())?;
        Some(self.to_picture.get(owner)?.transform_point2(place))
    }

    /// Where it shows what its picture has at these texture coordinates, texels; `None` if nowhere, the first place if in several.
    pub(crate) fn texel(&self, uv: Vec2) -> Option<Vec2> {
        self.laid().find_map(|([a, b, c], map)| {
            let place = map.inverse().transform_point2(uv);
            let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(place - from));
            let is_inside = sides.iter().all(|side| *side <= 0.0) || sides.iter().all(|side| *side >= 0.0);
            is_inside.then_some(place)
        })
    }

    /// The same, or else the middle of the triangle that is nearest to it in its picture.
    pub(crate) fn nearest_texel(&self, uv: Vec2) -> Vec2 {
        let middles = self.laid().map(|([a, b, c], map)| ((a + b + c) / 3.0, map));
        let far = |(middle, map): &(Vec2, &Affine2)| map.transform_point2(*middle).distance_squared(uv);
        let nearest = || middles.min_by(|a, b| far(a).total_cmp(&far(b))).map_or(Vec2::ZERO, |(middle, _)| middle);
        self.texel(uv).unwrap_or_else(nearest)
    }

    /// The triangles that lie somewhere, and from there to its picture.
    fn laid(&self) -> impl Iterator<Item = ([Vec2; 3], &Affine2)> {
        let all =
            self.layout.corners.iter().zip(&self.to_picture).filter_map(|(corners, map)| Some(((*corners)?, map)));
        all.filter(|(_, map)| map.matrix2.determinant() != 0.0)
    }

    /// The chart of a texel.
    fn chart(&self, texel: UVec2) -> Option<u32> {
        self.layout.chart.get(self.layout.owner(texel)?).copied()
    }

    /// Its charts for a map of `size` texels, and which of its texels are joined where the mesh is cut.
    pub(crate) fn charts(&self, size: UVec2) -> Result<MapCharts, VoronoiError> {
        let scale = size.as_vec2() / self.layout.size.as_vec2();
        let place = |texel: UVec2| ((texel.as_vec2() + 0.5) / scale).as_uvec2();
        let mut chart = Grid::new(size, MapCharts::NOTHING);
        for y in 0..size.y {
            for (x, chart) in (0..size.x).zip(chart.row_mut(y as usize)) {
                *chart = self.chart(place(UVec2::new(x, y))).unwrap_or(MapCharts::NOTHING);
            }
        }
        let texel = |place: Vec2| (place * scale).max(Vec2::ZERO).as_uvec2().min(size - 1);
        let joined = self.layout.cuts.iter().flat_map(|[[a, b], [p, q]]| {
            let length = ((*b - *a) * scale).length().max(((*q - *p) * scale).length());
            // Two for a texel, so that none is left out.
            let steps = (2.0 * length).ceil().clamp(1.0, MOST_STEPS);
            (0..steps as u32).map(move |step| {
                let share = (step as f32 + 0.5) / steps;
                [a.lerp(*b, share), p.lerp(*q, share)]
            })
        });
        let mut links: Vec<[u32; 4]> = joined
            .map(|places| places.map(texel))
            .filter(|[a, b]| a != b && [a, b].iter().all(|at| chart.get(at.x, at.y) != Some(MapCharts::NOTHING)))
            .map(|[a, b]| [a.y, a.x, b.y, b.x])
            .collect();
        links.sort_unstable();
        links.dedup();
        let links = links.into_iter().map(|[ay, ax, by, bx]| [UVec2::new(ax, ay), UVec2::new(bx, by)]).collect();
        let margin = (GUTTER as f32 * scale.x).round().max(1.0) as u32;
        MapCharts::new(chart, self.unit * scale.x, margin, links)
    }

    /// Values that lie over its picture, laid out with the mesh at `size` texels.
    pub(crate) fn lay_out(&self, values: &Grid<f32>, size: UVec2) -> Grid<f32> {
        let mut out = Grid::new(size, 0.0);
        if values.size().min_element() == 0 {
            return out;
        }
        let scale = size.as_vec2() / self.layout.size.as_vec2();
        let shrunk = shrunk(values, self.share(values.size(), scale));
        let values = shrunk.as_ref().unwrap_or(values);
        for y in 0..size.y {
            for (x, out) in (0..size.x).zip(out.row_mut(y as usize)) {
                let uv = self.uv((Vec2::new(x as f32, y as f32) + 0.5) / scale);
                *out = uv.map_or(0.0, |uv| between(values, uv));
            }
        }
        out
    }

    /// How many values lie along a texel, in the mean, where the mesh is laid out at this scale.
    fn share(&self, values: UVec2, scale: Vec2) -> f32 {
        let areas = self.laid().map(|([a, b, c], map)| {
            let area = f64::from((b - a).perp_dot(c - a).abs());
            (area * f64::from(scale.element_product()), area * f64::from(map.matrix2.determinant().abs()))
        });
        let (texels, picture) = areas.fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
        (picture * values.as_dvec2().element_product() / f64::max(texels, f64::MIN_POSITIVE)).sqrt() as f32
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

/// The most texels that are joined along an edge.
const MOST_STEPS: f32 = 1e5;

/// Means of as many values as lie along a texel, if that is more than one.
fn shrunk(values: &Grid<f32>, along: f32) -> Option<Grid<f32>> {
    let from = values.size();
    let step = along.clamp(1.0, from.max_element() as f32) as usize;
    if step < 2 {
        return None;
    }
    let size = UVec2::new((from.x as usize).div_ceil(step) as u32, (from.y as usize).div_ceil(step) as u32);
    let mut out = Grid::new(size, 0.0);
    for y in 0..size.y as usize {
        let rows = y * step..((y + 1) * step).min(values.height());
        for (x, out) in out.row_mut(y).iter_mut().enumerate() {
            let columns = x * step..((x + 1) * step).min(values.width());
            let count = (rows.len() * columns.len()) as f32;
            *out = rows.clone().flat_map(|y| &values.row(y)[columns.clone()]).sum::<f32>() / count;
        }
    }
    Some(out)
}

/// The value at texture coordinates, linear between the middles of values. Beyond the picture it is repeated.
fn between(values: &Grid<f32>, uv: Vec2) -> f32 {
    let is_within = uv.min_element() >= 0.0 && uv.max_element() <= 1.0;
    let uv = if is_within { uv } else { uv - uv.floor() };
    let last = (values.size() - 1).as_vec2();
    let at = (uv * values.size().as_vec2() - 0.5).clamp(Vec2::ZERO, last);
    let (low, share) = (at.floor(), at.fract());
    let [x, y] = low.as_uvec2().to_array();
    let row = |y: u32| {
        let value = |x: u32| values.get(x, y).unwrap_or(0.0);
        value(x) + (value((x + 1).min(values.size().x - 1)) - value(x)) * share.x
    };
    row(y) + (row((y + 1).min(values.size().y - 1)) - row(y)) * share.y
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

    /// A box whose faces share their picture, turned and mirrored: what lies over it is found where it is laid out.
    #[test]
    fn places_of_the_picture_are_found_where_they_are_laid_out() {
        use crate::unwrap::{MeshShape, Unwrap};
        let at = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32 * 2.0, (i >> 2) as f32 * 1.5);
        let positions: Vec<Vec3> = (0..8).map(at).collect();
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        let uvs = |i: usize| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| corners[(corner + i / 2) % 4]);
            Some(if i.is_multiple_of(2) { [a, b, c] } else { [a, c, d] })
        };
        let shape = MeshShape::new(&positions, &triangles).expect("a box");
        let (around, right) = (Vec3::new(0.4, 0.3, 0.0), Vec3::X);
        let unwrap = Unwrap { around, triangle: 0, right, texels: 40.0, most_side: 4096, most_texels: 1 << 22 };
        let layout = unwrap.apply(&shape).expect("it fits");
        let size = layout.size;
        let unfolding = Unfolding::new(0, layout, 50.0, around, Some(UVec2::new(300, 200)), uvs);
        assert_eq!(unfolding.picture, Vec2::new(1.5, 1.0));
        let mut rows = Grid::new(UVec2::new(1, 64), 0.0);
        (0..64).for_each(|y| rows.row_mut(y)[0] = (y as f32 + 0.5) / 64.0);
        // Fewer texels than there are values, as many, and half of them.
        for (size, within) in [(size, 0.03), (size / 2, 0.06), (size / 5, 0.15)] {
            let laid = unfolding.lay_out(&rows, size);
            let mut seen = 0;
            for texel in (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y))) {
                let place = (texel.as_vec2() + 0.5) / (size.as_vec2() / unfolding.layout.size.as_vec2());
                let value = laid.get(texel.x, texel.y).unwrap_or(f32::NAN);
                match unfolding.uv(place) {
                    None => assert_eq!(value, 0.0),
                    Some(uv) if uv.min_element() >= 0.0 && uv.max_element() <= 1.0 => {
                        assert!((value - uv.y).abs() < within, "{texel}: {value}, not {}", uv.y);
                        seen += 1;
                    }
                    // Beyond the border the picture is repeated.
                    Some(_) => {}
                }
            }
            assert!(seen * 3 > size.element_product(), "{seen} of {size}");
        }
        for uv in [Vec2::new(0.2, 0.7), Vec2::ZERO, Vec2::new(0.5, 0.5), Vec2::new(0.93, 0.11)] {
            let texel = unfolding.texel(uv).expect("it is there");
            assert!(unfolding.uv(texel).is_some_and(|found| found.distance(uv) < 1e-3), "{uv}");
            assert_eq!(unfolding.nearest_texel(uv), texel);
        }
        assert_eq!(unfolding.texel(Vec2::new(1.2, 0.5)), None);
        let beside = unfolding.uv(unfolding.nearest_texel(Vec2::new(9.0, 0.4))).expect("it is on the mesh");
        assert!(beside.x > 0.6, "{beside}");
    }

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
