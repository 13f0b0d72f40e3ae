//! From points on a mesh to texture coordinates.

use bevy::{
    math::{Affine2, Mat3A},
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    platform::collections::HashMap,
    prelude::*,
};

/// A hit further from the mesh than this share of its diagonal is off the surface: room for imprecise contacts, none
/// for stray shots.
const MAX_DISTANCE: f32 = 0.25;

/// The triangles of a mesh.
pub(crate) struct Triangles<'a> {
    positions: &'a [[f32; 3]],
    uvs: &'a [[f32; 2]],
    indices: Option<&'a Indices>,
}

impl<'a> Triangles<'a> {
    pub(crate) fn of(mesh: &'a Mesh) -> Result<Self, &'static str> {
        const NO_DATA: &str = "the mesh has no data on the CPU: load it with `RenderAssetUsages::MAIN_WORLD`";
        let positions = match mesh.try_attribute_option(Mesh::ATTRIBUTE_POSITION) {
            Ok(Some(VertexAttributeValues::Float32x3(positions))) => positions,
            Ok(_) => return Err("the mesh has no positions"),
            Err(_) => return Err(NO_DATA),
        };
        let uvs = match mesh.try_attribute_option(Mesh::ATTRIBUTE_UV_0) {
            Ok(Some(VertexAttributeValues::Float32x2(uvs))) => uvs,
            Ok(_) => return Err("the mesh has no texture coordinates (`UV_0`)"),
            Err(_) => return Err(NO_DATA),
        };
        if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
            return Err("the mesh is not a list of triangles");
        }
        Ok(Self { positions, uvs, indices: mesh.try_indices_option().map_err(|_| NO_DATA)? })
    }

    pub(crate) fn len(&self) -> usize {
        self.indices.map_or(self.positions.len(), Indices::len) / 3
    }

    /// Where the vertices are.
    #[cfg(feature = "3d")]
    pub(crate) fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.positions.iter().map(|at| Vec3::from_array(*at))
    }

    /// Number of vertices.
    #[cfg(feature = "3d")]
    pub(crate) fn vertices(&self) -> usize {
        self.positions.len()
    }

    /// The vertices of a triangle.
    pub(crate) fn corners(&self, i: usize) -> Option<[usize; 3]> {
        let vertex = |i: usize| match self.indices {
            None => Some(i),
            Some(Indices::U16(indices)) => indices.get(i).map(|index| usize::from(*index)),
            Some(Indices::U32(indices)) => indices.get(i).map(|index| *index as usize),
        };
        Some([vertex(3 * i)?, vertex(3 * i + 1)?, vertex(3 * i + 2)?])
    }

    /// Corners and their texture coordinates; `None` for a triangle with a vertex that is not there.
    pub(crate) fn get(&self, i: usize) -> Option<([Vec3; 3], [Vec2; 3])> {
        let corners = self.corners(i)?;
        Some((read(self.positions, corners)?.map(Vec3::from_array), read(self.uvs, corners)?.map(Vec2::from_array)))
    }
}

/// The triangle of `mesh` that is closest to `point`, and the texture coordinates at the point of it that is, all in the mesh's space.
pub(crate) fn closest(mesh: &Mesh, point: Vec3) -> Result<(usize, Vec2), &'static str> {
    let triangles = Triangles::of(mesh)?;
    let mut best: Option<(f32, (usize, Vec2))> = None;
    let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for i in 0..triangles.len() {
        let Some(([a, b, c], [uv_a, uv_b, uv_c])) = triangles.get(i) else { continue };
        min = min.min(a).min(b).min(c);
        max = max.max(a).max(b).max(c);
        let weights = closest_weights(point, a, b, c);
        let closest = a * weights.x + b * weights.y + c * weights.z;
        let distance = closest.distance_squared(point);
        // The first of equals wins; NaN never does.
        if distance.is_finite() && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, (i, uv_a * weights.x + uv_b * weights.y + uv_c * weights.z)));
        }
    }
    let (distance, found) = best.ok_or("the mesh has no triangles")?;
    if distance.sqrt() > MAX_DISTANCE * min.distance(max) {
        return Err("the point lies off the mesh");
    }
    Ok(found)
}

/// Whether all of a mesh lies in the plane through `point` across `normal`.
pub(crate) fn is_flat(mesh: &Mesh, point: Vec3, normal: Vec3) -> bool {
    const SLACK: f32 = 1e-3;
    let Ok(triangles) = Triangles::of(mesh) else { return false };
    let (mut min, mut max, mut off) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0f32);
    for (corners, _) in (0..triangles.len()).filter_map(|i| triangles.get(i)) {
        for corner in corners {
            (min, max) = (min.min(corner), max.max(corner));
            off = off.max((corner - point).dot(normal).abs());
        }
    }
    off <= SLACK * min.distance(max)
}

/// The point that has these texture coordinates, and the way the mesh faces there, in the mesh's space. Of the triangles that hold
/// them the one that has least of the picture: those at the seam of a ball may have all of it from one side to the other.
pub(crate) fn place_of(mesh: &Mesh, uv: Vec2) -> Option<(Vec3, Vec3)> {
    const SLACK: f32 = -1e-4;
    let triangles = Triangles::of(mesh).ok()?;
    let mut best: Option<(f32, (Vec3, Vec3))> = None;
    for ([a, b, c], [uv_a, uv_b, uv_c]) in (0..triangles.len()).filter_map(|i| triangles.get(i)) {
        let (ab, ac, to) = (uv_b - uv_a, uv_c - uv_a, uv - uv_a);
        let area = ab.perp_dot(ac);
        let (v, w) = (to.perp_dot(ac) / area, ab.perp_dot(to) / area);
        // Not a number where the triangle has no area. The first of equals wins, as far as rounding lets them be equal.
        if v >= SLACK && w >= SLACK && 1.0 - v - w >= SLACK && best.is_none_or(|(least, _)| area.abs() < 0.999 * least)
        {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            best = Some((area.abs(), (a + (b - a) * v + (c - a) * w, normal)));
        }
    }
    best.map(|(_, place)| place)
}

/// Whether normal maps show nothing on a mesh.
pub(crate) fn lacks_tangents(mesh: &Mesh) -> bool {
    matches!(mesh.try_attribute_option(Mesh::ATTRIBUTE_TANGENT), Ok(None))
}

/// The most triangles that may meet in one vertex of a mesh that tangents are made for: making them takes as long as their square.
const MOST_AT_VERTEX: u32 = 4096;

/// The most pairs of a triangle with two corners in one place and one without.
const MOST_PAIRS: usize = 1 << 27;

/// Looks whether the engine can make tangents for a mesh: over what is refused here it would end the app, or take minutes.
pub(crate) fn check_for_tangents(mesh: &Mesh) -> Result<(), String> {
    let (Ok(triangles), Ok(Some(VertexAttributeValues::Float32x3(normals)))) =
        (Triangles::of(mesh), mesh.try_attribute_option(Mesh::ATTRIBUTE_NORMAL))
    else {
        // The engine says so itself.
        return Ok(());
    };
    let Triangles { positions, uvs, indices } = triangles;
    let n = positions.len();
    if normals.len() != n || uvs.len() != n {
        let (normals, uvs) = (normals.len(), uvs.len());
        return Err(format!("it has {n} positions, {normals} normals and {uvs} texture coordinates"));
    }
    let beyond = match indices {
        Some(Indices::U16(indices)) => indices.iter().copied().map(usize::from).find(|index| *index >= n),
        Some(Indices::U32(indices)) => indices.iter().map(|index| *index as usize).find(|index| *index >= n),
        None => None,
    };
    if let Some(index) = beyond {
        return Err(format!("an index names vertex {index} of {n}"));
    }
    let is_finite = |i: &usize| {
        let numbers = positions[*i].iter().chain(&normals[*i]).chain(&uvs[*i]);
        numbers.copied().all(f32::is_finite)
    };
    if let Some(vertex) = (0..n).find(|i| !is_finite(i)) {
        return Err(format!("position, normal or texture coordinates of vertex {vertex} are not finite"));
    }
    let corners = || (0..triangles.len()).filter_map(|i| triangles.corners(i));
    let is_flat = |[a, b, c]: [usize; 3]| {
        positions[a] == positions[b] || positions[b] == positions[c] || positions[c] == positions[a]
    };
    let flat = corners().filter(|corners| is_flat(*corners)).count();
    if flat.saturating_mul(triangles.len() - flat) > MOST_PAIRS {
        return Err(format!("{flat} of its {} triangles have no area", triangles.len()));
    }
    if triangles.len() > MOST_AT_VERTEX as usize {
        // Vertices that are the same in all that counts are one.
        let mut met = HashMap::<[u32; 8], u32>::default();
        for i in corners().flatten() {
            let ([x, y, z], [a, b, c], [u, v]) = (positions[i], normals[i], uvs[i]);
            *met.entry([x, y, z, a, b, c, u, v].map(f32::to_bits)).or_default() += 1;
        }
        let most = met.into_values().max().unwrap_or(0);
        if most > MOST_AT_VERTEX {
            return Err(format!("{most} of its triangles meet in one vertex, more than {MOST_AT_VERTEX}"));
        }
    }
    Ok(())
}

/// Triangles that are looked at for the proportions of a mesh.
const SAMPLES: usize = 1024;

/// Width of a picture over its height, as a mesh in a `place` shows it whose texture coordinates `to_picture` makes those of the picture.
///
/// The median over the area: what most of the mesh shows counts, on a box its broad sides. `None` where nothing has an area.
pub(crate) fn aspect_of(mesh: &Mesh, place: Mat3A, to_picture: Affine2) -> Option<f32> {
    let triangles = Triangles::of(mesh).ok()?;
    let mut aspects = Vec::new();
    let mut all = 0.0;
    for i in (0..triangles.len()).step_by(triangles.len().div_ceil(SAMPLES).max(1)) {
        let Some(([a, b, c], [uv_a, uv_b, uv_c])) = triangles.get(i) else { continue };
        let (ab, ac) = (place * (b - a), place * (c - a));
        let (uv_ab, uv_ac) = (to_picture.transform_vector2(uv_b - uv_a), to_picture.transform_vector2(uv_c - uv_a));
        // How far the surface goes on, times the same, for each unit along the picture and down it.
        let (right, down) = (ab * uv_ac.y - ac * uv_ab.y, ac * uv_ab.x - ab * uv_ac.x);
        let (aspect, area) = (right.length() / down.length(), ab.cross(ac).length());
        if aspect.is_normal() && area.is_normal() {
            aspects.push((aspect, area));
            all += area;
        }
    }
    aspects.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut sum = 0.0;
    let is_half = |&(_, area): &(f32, f32)| {
        sum += area;
        2.0 * sum >= all
    };
    aspects.into_iter().find(is_half).map(|(aspect, _)| aspect)
}

/// Texture coordinates within 0..=1: those beyond are of a texture that repeats.
pub(crate) fn wrap(uv: Vec2) -> Vec2 {
    const SLACK: f32 = 1e-4;
    let wrap = |x: f32| if (-SLACK..=1.0 + SLACK).contains(&x) { x.clamp(0.0, 1.0) } else { x.rem_euclid(1.0) };
    Vec2::new(wrap(uv.x), wrap(uv.y))
}

fn read<const N: usize>(values: &[[f32; N]], at: [usize; 3]) -> Option<[[f32; N]; 3]> {
    Some([*values.get(at[0])?, *values.get(at[1])?, *values.get(at[2])?])
}

/// The point of a triangle that is closest to `p`.
#[cfg(feature = "3d")]
pub(crate) fn nearest_on(p: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let weights = closest_weights(p, a, b, c);
    a * weights.x + b * weights.y + c * weights.z
}

/// Barycentric weights of the point of a triangle that is closest to `p` (Ericson 2004, section 5.1.5).
fn closest_weights(p: Vec3, a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return Vec3::X;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return Vec3::Y;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return Vec3::new(1.0 - v, v, 0.0);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return Vec3::Z;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return Vec3::new(1.0 - w, 0.0, w);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return Vec3::new(0.0, 1.0 - w, w);
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    Vec3::new(1.0 - v - w, v, w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quad_and_its_surroundings() {
        let mesh = Mesh::from(Rectangle::new(2.0, 1.0));
        let uv = |x, y, z| closest(&mesh, Vec3::new(x, y, z)).map(|(_, uv)| uv);
        assert_eq!(uv(-1.0, 0.5, 0.0), Ok(Vec2::ZERO), "top left");
        assert_eq!(uv(0.5, 0.0, 0.1), Ok(Vec2::new(0.75, 0.5)), "above the face");
        assert_eq!(uv(1.2, -0.6, 0.0), Ok(Vec2::ONE), "just off a corner");
        assert!(uv(5.0, 0.0, 0.0).is_err(), "far off");
    }

    /// Some triangles at the seam of a ball run over the picture from one side to the other; its vertices are where they should be.
    #[test]
    fn places_on_a_ball_are_near_the_vertices_of_the_picture() {
        let mesh = Sphere::new(0.5).mesh().ico(8).unwrap();
        let all = Triangles::of(&mesh).unwrap();
        let mut found = 0;
        for uv in (0..40).flat_map(|i| (4..16).map(move |k| Vec2::new((i as f32 + 0.5) / 40.0, k as f32 / 20.0))) {
            let Some((at, normal)) = place_of(&mesh, uv) else { continue };
            let vertices = all.positions.iter().zip(all.uvs);
            let nearest = vertices.min_by_key(|(_, of)| (1e6 * Vec2::from(**of).distance(uv)) as u32).unwrap();
            let away = at.distance(Vec3::from(*nearest.0));
            assert!(away < 0.12 && normal.dot(2.0 * at) > 0.9, "{uv}: {at}, {away} from its vertex, {normal}");
            found += 1;
        }
        assert!(found > 400, "{found} of 480 places");
    }

    #[test]
    fn proportions_are_those_of_what_is_shown() {
        let aspect = |mesh: Mesh, scale, to_picture| aspect_of(&mesh, Mat3A::from_diagonal(scale), to_picture);
        let as_it_is = |mesh: Mesh| aspect(mesh, Vec3::ONE, Affine2::IDENTITY);
        let near = |a: Option<f32>, b: f32| a.is_some_and(|a| (a / b - 1.0).abs() < 1e-5);
        assert!(near(as_it_is(Rectangle::new(6.0, 2.0).into()), 3.0));
        assert!(near(as_it_is(Cuboid::new(4.0, 1.0, 0.2).into()), 4.0), "its broad sides count");
        assert!(near(as_it_is(Plane3d::new(Vec3::Y, Vec2::new(1.0, 2.0)).into()), 0.5));
        let quad = || Mesh::from(Rectangle::new(1.0, 1.0));
        assert!(near(aspect(quad(), Vec3::new(-5.0, 2.0, 0.0), Affine2::IDENTITY), 2.5), "scaled and mirrored");
        // Twice as many tiles along as down.
        let tiles = Affine2::from_scale(Vec2::new(8.0, 4.0));
        assert!(near(aspect(quad(), Vec3::new(2.0, 1.0, 1.0), tiles), 1.0));
        let turned = Affine2::from_angle(core::f32::consts::FRAC_PI_2);
        assert!(near(aspect(Rectangle::new(3.0, 1.0).into(), Vec3::ONE, turned), 1.0 / 3.0));
        let ball = as_it_is(Sphere::new(0.5).mesh().uv(64, 32)).unwrap();
        assert!((1.5..2.0).contains(&ball), "{ball}: twice as wide as high at the equator, less elsewhere");
        assert_eq!(aspect(quad(), Vec3::new(0.0, 1.0, 1.0), Affine2::IDENTITY), None, "no width");
        assert_eq!(aspect(quad(), Vec3::splat(f32::NAN), Affine2::IDENTITY), None);
        assert_eq!(aspect(quad(), Vec3::ONE, Affine2::from_scale(Vec2::ZERO)), None);
        assert_eq!(as_it_is(quad().with_removed_attribute(Mesh::ATTRIBUTE_UV_0)), None);
    }

    #[test]
    fn broken_meshes_are_refused() {
        let mut mesh = Mesh::from(Rectangle::new(1.0, 1.0));
        mesh.insert_indices(Indices::U32(vec![0, 1, 99, 0]));
        assert!(closest(&mesh, Vec3::ZERO).is_err(), "no whole triangle is left");
        mesh.remove_attribute(Mesh::ATTRIBUTE_UV_0);
        assert!(closest(&mesh, Vec3::ZERO).is_err(), "no texture coordinates");
    }

    #[test]
    fn coordinates_beyond_the_picture_repeat() {
        assert_eq!(wrap(Vec2::new(1.25, -0.25)), Vec2::new(0.25, 0.75));
        assert_eq!(wrap(Vec2::new(1.0, -1e-5)), Vec2::new(1.0, 0.0));
    }
}
