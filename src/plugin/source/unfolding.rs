//! [`Unfolding`]: a mesh that is laid out flat, with its picture.

use crate::unwrap::{Cut, GUTTER, LaidOut};
use crate::voronoi::{MapCharts, VoronoiError};
use crate::{Grid, OutOfMemory};
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
        self.uv(texel.as_vec2() + 0.5).unwrap_or(Vec2::ZERO) * size.as_vec2()
    }

    /// The texture coordinates in its picture of what lies in a place, texels; `None` in a gap.
    fn uv(&self, place: Vec2) -> Option<Vec2> {
        let owner = self.layout.owner(place.max(Vec2::ZERO).as_uvec2())?;
        Some(self.to_picture.get(owner)?.transform_point2(place))
    }

    /// Where it shows what its picture has at these texture coordinates, texels; `None` if nowhere, the first place if in several.
    pub(crate) fn texels(&self, uvs: &[Vec2]) -> Vec<Option<Vec2>> {
        let mut order: Vec<usize> = (0..uvs.len()).collect();
        order.sort_by(|a, b| uvs[*a].x.total_cmp(&uvs[*b].x));
        let mut places = vec![None; uvs.len()];
        for ([a, b, c], map) in self.laid() {
            let back = map.inverse();
            let [p, q, r] = [a, b, c].map(|corner| map.transform_point2(corner));
            let (min, max) = (p.min(q).min(r), p.max(q).max(r));
            let first = order.partition_point(|i| uvs[*i].x < min.x);
            let last = order.partition_point(|i| uvs[*i].x <= max.x);
            for i in order[first..last.max(first)].iter().filter(|i| (min.y..=max.y).contains(&uvs[**i].y)) {
                let place = back.transform_point2(uvs[*i]);
                if places[*i].is_none() && is_in([a, b, c], place) {
                    places[*i] = Some(place);
                }
            }
        }
        places
    }

    /// The same of one place, or else the middle of the triangle that is nearest to it in its picture.
    pub(crate) fn nearest_texel(&self, uv: Vec2) -> Vec2 {
        let middles = self.laid().map(|([a, b, c], map)| ((a + b + c) / 3.0, map));
        let far = |(middle, map): &(Vec2, &Affine2)| map.transform_point2(*middle).distance_squared(uv);
        let nearest = || middles.min_by(|a, b| far(a).total_cmp(&far(b))).map_or(Vec2::ZERO, |(middle, _)| middle);
        self.texels(&[uv])[0].unwrap_or_else(nearest)
    }

    /// The triangles that lie somewhere, and from there to its picture.
    fn laid(&self) -> impl Iterator<Item = ([Vec2; 3], &Affine2)> {
        let all =
            self.layout.corners.iter().zip(&self.to_picture).filter_map(|(corners, map)| Some(((*corners)?, map)));
        all.filter(|(_, map)| map.matrix2.determinant() != 0.0)
    }

    /// A map's charts at `size` texels, joined where the mesh is cut and parted where it is not one.
    pub(crate) fn charts(&self, size: UVec2) -> Result<MapCharts, VoronoiError> {
        let view = View::new(self, size)?;
        let chart = view.charts()?;
        let links = view.links(&chart);
        Ok(MapCharts::new(chart, self.unit * view.scale.x, view.margin(), links)?.with_walls(view.walls()))
    }

    /// Values that lie over its picture, laid out with the mesh at `size` texels. What is no number counts as 0.
    pub(crate) fn lay_out(&self, values: &Grid<f32>, size: UVec2) -> Result<Grid<f32>, OutOfMemory> {
        let mut out = Grid::try_new(size, 0.0)?;
        if values.size().min_element() == 0 {
            return Ok(out);
        }
        let scale = size.as_vec2() / self.layout.size.as_vec2();
        let shrunk = shrunk(values, self.share(values.size(), scale))?;
        let values = shrunk.as_ref().unwrap_or(values);
        for y in 0..size.y {
            for (x, out) in (0..size.x).zip(out.row_mut(y as usize)) {
                let uv = self.uv((Vec2::new(x as f32, y as f32) + 0.5) / scale);
                *out = uv.map_or(0.0, |uv| between(values, uv));
            }
        }
        Ok(out)
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

/// Whether a place lies in a triangle, its border included.
fn is_in([a, b, c]: [Vec2; 3], place: Vec2) -> bool {
    let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(place - from));
    sides.iter().all(|side| *side <= 0.0) || sides.iter().all(|side| *side >= 0.0)
}

/// How far it is from a place to the border of a triangle.
fn distance([a, b, c]: [Vec2; 3], place: Vec2) -> f32 {
    let to_side = |(from, to): (Vec2, Vec2)| {
        let along = to - from;
        let share = (place - from).dot(along) / along.length_squared().max(f32::MIN_POSITIVE);
        place.distance(from + share.clamp(0.0, 1.0) * along)
    };
    [(a, b), (b, c), (c, a)].map(to_side).into_iter().fold(f32::INFINITY, f32::min)
}

/// A layout at another number of texels.
struct View<'a> {
    layout: &'a LaidOut,
    size: UVec2,
    /// Its texels for one of the layout.
    scale: Vec2,
    /// Where each texel lies.
    side: Grid<Side>,
}

/// Where a texel lies beside the triangle that it belongs to.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Within,
    /// A texel beside it at the most, where triangles are small.
    Near,
    Beyond,
}

impl<'a> View<'a> {
    fn new(unfolding: &'a Unfolding, size: UVec2) -> Result<Self, OutOfMemory> {
        let layout = &unfolding.layout;
        let scale = size.as_vec2() / layout.size.as_vec2();
        let mut view = Self { layout, size, scale, side: Grid::try_new(size, Side::Beyond)? };
        let near = scale.recip().max_element();
        for y in 0..size.y {
            for x in 0..size.x {
                let texel = UVec2::new(x, y);
                let Some(corners) = view.owner(texel).and_then(|owner| layout.corners[owner]) else { continue };
                let place = view.middle(texel);
                view.side.row_mut(y as usize)[x as usize] = match is_in(corners, place) {
                    true => Side::Within,
                    false if distance(corners, place) <= near => Side::Near,
                    false => Side::Beyond,
                };
            }
        }
        Ok(view)
    }

    fn side(&self, texel: UVec2) -> Side {
        self.side.get(texel.x, texel.y).unwrap_or(Side::Beyond)
    }

    /// The middle of a texel, in texels of the layout.
    fn middle(&self, texel: UVec2) -> Vec2 {
        (texel.as_vec2() + 0.5) / self.scale
    }

    fn owner(&self, texel: UVec2) -> Option<usize> {
        self.layout.owner(self.middle(texel).as_uvec2())
    }

    /// The chart of each texel.
    fn charts(&self) -> Result<Grid<u32>, OutOfMemory> {
        let mut chart = Grid::try_new(self.size, MapCharts::NOTHING)?;
        for y in 0..self.size.y {
            for (x, chart) in (0..self.size.x).zip(chart.row_mut(y as usize)) {
                let of = self.owner(UVec2::new(x, y)).and_then(|owner| self.layout.chart.get(owner));
                *chart = of.copied().unwrap_or(MapCharts::NOTHING);
            }
        }
        Ok(chart)
    }

    /// How far charts go on beyond their borders, texels.
    fn margin(&self) -> u32 {
        (GUTTER as f32 * self.scale.x).round().max(1.0) as u32
    }

    /// The pairs of texels that meet where the mesh is cut.
    fn links(&self, chart: &Grid<u32>) -> Vec<[UVec2; 2]> {
        let texel = |place: Vec2| (place * self.scale).max(Vec2::ZERO).as_uvec2().min(self.size - 1);
        let mut links = Vec::new();
        for Cut { triangles, places: [[a, b], [p, q]] } in &self.layout.cuts {
            let own = triangles.map(|triangle| self.layout.chart.get(triangle).copied());
            let length = ((*b - *a) * self.scale).length().max(((*q - *p) * self.scale).length());
            // Two for a texel, so that none is left out.
            let steps = (2.0 * length).ceil().clamp(1.0, MOST_STEPS);
            for step in 0..steps as u32 {
                let share = (step as f32 + 0.5) / steps;
                let [a, b] = [a.lerp(*b, share), p.lerp(*q, share)].map(texel);
                if a != b && [a, b].map(|at| chart.get(at.x, at.y)) == own {
                    links.push([a.y, a.x, b.y, b.x]);
                }
            }
        }
        links.sort_unstable();
        links.dedup();
        links.into_iter().map(|[ay, ax, by, bx]| [UVec2::new(ax, ay), UVec2::new(bx, by)]).collect()
    }

    /// The pairs of texels that are beside one another in the plane alone: on both sides of an edge that is cut or that ends the surface, or
    /// beyond the border of parts that do not meet there.
    fn walls(&self) -> Vec<[UVec2; 2]> {
        let cuts = self.layout.cuts.iter().flat_map(|cut| cut.places);
        let mut walls = Vec::new();
        for edge in cuts.chain(self.layout.borders.iter().copied()) {
            self.wall_along(edge.map(|end| end * self.scale), &mut walls);
        }
        for (y, x) in (0..self.size.y).flat_map(|y| (0..self.size.x).map(move |x| (y, x))) {
            let at = UVec2::new(x, y);
            for next in [at + UVec2::X, at + UVec2::Y].into_iter().filter(|next| next.cmplt(self.size).all()) {
                let is_beyond = [at, next].into_iter().any(|texel| self.side(texel) == Side::Beyond);
                if is_beyond && !self.are_owners_together(at, next) {
                    walls.push([at, next]);
                }
            }
        }
        walls
    }

    /// Whether the triangles of two texels are one, or touch in the plane.
    fn are_owners_together(&self, a: UVec2, b: UVec2) -> bool {
        let (Some(a), Some(b)) = (self.owner(a), self.owner(b)) else { return true };
        let corners = |triangle: usize| self.layout.corners[triangle].unwrap_or([Vec2::NAN; 3]);
        let touch = |a: Vec2| corners(b).iter().any(|b| a.distance_squared(*b) < TOUCHING * TOUCHING);
        a == b || corners(a).into_iter().any(touch)
    }

    /// Parts the texels on both sides of a line where both show the mesh itself.
    fn wall_along(&self, [a, b]: [Vec2; 2], walls: &mut Vec<[UVec2; 2]>) {
        let is_left = |texel: UVec2| (b - a).perp_dot(texel.as_vec2() + 0.5 - a) < 0.0;
        let length = a.distance(b);
        let steps = (4.0 * length).ceil().clamp(1.0, MOST_STEPS);
        let mut last = None;
        for step in 0..=steps as u32 {
            let corner = (a.lerp(b, step as f32 / steps) - 0.5).max(Vec2::ZERO).as_uvec2();
            if last.replace(corner) == Some(corner) || !(corner + 1).cmplt(self.size).all() {
                continue;
            }
            let [right, below, across] = [UVec2::X, UVec2::Y, UVec2::ONE].map(|step| corner + step);
            for pair in [[corner, right], [corner, below], [right, across], [below, across]] {
                let [first, second] = pair.map(is_left);
                if first != second && pair.iter().all(|texel| self.side(*texel) == Side::Within) {
                    walls.push(pair);
                }
            }
        }
    }
}

/// The most steps along an edge.
const MOST_STEPS: f32 = 1e5;

/// Corners that are nearer to one another are one, texels.
const TOUCHING: f32 = 0.1;

/// A value, 0 if it is none.
fn counted(value: f32) -> f32 {
    if value.is_finite() { value.clamp(0.0, MOST_VALUE) } else { 0.0 }
}

/// Larger values count as this.
const MOST_VALUE: f32 = 1e9;

/// Means of as many values as lie along a texel, if that is more than one.
fn shrunk(values: &Grid<f32>, along: f32) -> Result<Option<Grid<f32>>, OutOfMemory> {
    let from = values.size();
    let step = along.clamp(1.0, from.max_element() as f32) as usize;
    if step < 2 {
        return Ok(None);
    }
    let size = UVec2::new((from.x as usize).div_ceil(step) as u32, (from.y as usize).div_ceil(step) as u32);
    let mut out = Grid::try_new(size, 0.0)?;
    for y in 0..size.y as usize {
        let rows = y * step..((y + 1) * step).min(values.height());
        for (x, out) in out.row_mut(y).iter_mut().enumerate() {
            let columns = x * step..((x + 1) * step).min(values.width());
            let count = (rows.len() * columns.len()) as f32;
            let all = rows.clone().flat_map(|y| &values.row(y)[columns.clone()]);
            *out = all.map(|value| counted(*value)).sum::<f32>() / count;
        }
    }
    Ok(Some(out))
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
        let value = |x: u32| counted(values.get(x, y).unwrap_or(0.0));
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
        let unfolding = Unfolding::new(0, layout, 50.0, around, uvs);
        let mut rows = Grid::new(UVec2::new(1, 64), 0.0);
        (0..64).for_each(|y| rows.row_mut(y)[0] = (y as f32 + 0.5) / 64.0);
        // Fewer texels than there are values, as many, and half of them.
        for (size, within) in [(size, 0.03), (size / 2, 0.06), (size / 5, 0.15)] {
            let laid = unfolding.lay_out(&rows, size).expect("memory");
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
        let uvs = [Vec2::new(0.2, 0.7), Vec2::ZERO, Vec2::new(1.2, 0.5), Vec2::new(0.5, 0.5), Vec2::new(0.93, 0.11)];
        let texels = unfolding.texels(&uvs);
        assert_eq!(texels[2], None);
        for (uv, texel) in uvs.into_iter().zip(texels).filter(|(uv, _)| uv.x <= 1.0) {
            let texel = texel.expect("it is there");
            assert!(unfolding.uv(texel).is_some_and(|found| found.distance(uv) < 1e-3), "{uv}");
            assert_eq!(unfolding.nearest_texel(uv), texel);
        }
        // Values that are none do not spread.
        let broken = Grid::from_vec(UVec2::new(3, 1), vec![f32::NAN, 0.5, f32::INFINITY]).expect("three");
        let laid = unfolding.lay_out(&broken, size).expect("memory");
        assert!(laid.as_slice().iter().all(|value| (0.0..=0.5).contains(value)));
        let beside = unfolding.uv(unfolding.nearest_texel(Vec2::new(9.0, 0.4))).expect("it is on the mesh");
        assert!(beside.x > 0.6, "{beside}");
    }

    /// A step of an L, whose concave faces come to lie beside others where they do not meet, and one that is so fine that its triangles
    /// are smaller than texels: what is joined in the map is near on the mesh.
    #[test]
    fn what_is_joined_in_the_map_is_near_on_the_mesh() {
        use crate::unwrap::{MeshShape, Unwrap};
        use crate::voronoi::{VoronoiBake, VoronoiParams};
        // The outline of an L, and the same 0.6 higher.
        let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]].map(Vec2::from);
        let mut positions: Vec<Vec3> = outline.iter().map(|at| at.extend(0.0)).collect();
        positions.extend(outline.iter().map(|at| at.extend(0.6)));
        let cap = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
        let mut triangles: Vec<[u32; 3]> = cap.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        triangles.extend(cap.iter().map(|corners| corners.map(|corner| corner + 6)));
        for i in 0..6 {
            let j = (i + 1) % 6;
            triangles.extend([[i, j, j + 6], [i, j + 6, i + 6]]);
        }
        let rock =
            |i: u32| Vec3::new((i % 41) as f32 * 0.05, (i / 41) as f32 * 0.05, 0.2 * ((i * 7 % 41) as f32 / 41.0));
        let fine: Vec<Vec3> = (0..41 * 41).map(rock).collect();
        let quads = (0..40 * 40).map(|i| i % 40 + i / 40 * 41);
        let of_fine: Vec<[u32; 3]> = quads.flat_map(|i| [[i, i + 1, i + 42], [i, i + 42, i + 41]]).collect();
        for (positions, triangles, texels, around) in [
            (positions.clone(), triangles.clone(), 40.0, Vec3::new(0.5, 0.5, 0.6)),
            (positions, triangles, 40.0, Vec3::new(1.0, 1.5, 0.3)),
            (fine, of_fine, 9.0, Vec3::new(1.0, 1.0, 0.1)),
        ] {
            let shape = MeshShape::new(&positions, &triangles).expect("a mesh");
            let middle = |i: &usize| triangles[*i].iter().map(|vertex| positions[*vertex as usize]).sum::<Vec3>() / 3.0;
            let far = |i: &usize| middle(i).distance(around);
            let triangle = (0..triangles.len()).min_by(|a, b| far(a).total_cmp(&far(b))).expect("one");
            let unwrap = Unwrap { around, triangle, right: Vec3::X, texels, most_side: 4096, most_texels: 1 << 22 };
            let layout = unwrap.apply(&shape).expect("it fits");
            let unfolding = Unfolding::new(0, layout, texels, around, |_| Some([Vec2::ZERO, Vec2::X, Vec2::Y]));
            for size in [unfolding.layout.size, unfolding.layout.size * 2 / 3] {
                let view = View::new(&unfolding, size).expect("memory");
                let on_mesh = |texel: UVec2| {
                    let owner = view.owner(texel)?;
                    let [a, b, c] = unfolding.layout.corners[owner]?;
                    let [p, q, r] = triangles[owner].map(|vertex| positions[vertex as usize]);
                    let shares = Mat2::from_cols(b - a, c - a).inverse() * (view.middle(texel) - a);
                    (view.side(texel) == Side::Within).then_some(p + (q - p) * shares.x + (r - p) * shares.y)
                };
                let params = VoronoiParams { alpha: 0.0, ..VoronoiParams::DEFAULT };
                let charts = unfolding.charts(size).expect("charts");
                let map = VoronoiBake::on_charts(params, Vec::new(), charts, 1).expect("a map").finish().0;
                let (mut joined, mut within) = (0, 0);
                for texel in (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y))) {
                    let Some(here) = on_mesh(texel) else { continue };
                    within += 1;
                    let (right, down) = map.edges(texel.x, texel.y);
                    for (edge, next) in [(right, texel + UVec2::X), (down, texel + UVec2::Y)] {
                        if let (Some(_), Some(there)) = (edge, on_mesh(next)) {
                            joined += 1;
                            let apart = here.distance(there) * texels * view.scale.x;
                            assert!(apart < 2.5, "{texel} and {next} are {apart} texels from one another");
                        }
                    }
                }
                let is_fine = texels < 20.0;
                assert!(is_fine || (within > 1000 && joined * 10 > within * 15), "{joined} edges of {within} texels");
                let all = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
                let shown = all.filter(|texel| view.side(*texel) != Side::Beyond);
                let lost = shown.filter(|texel| map.region(texel.x, texel.y).is_none()).count();
                assert_eq!(lost, 0, "all of it is one surface");
            }
        }
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
