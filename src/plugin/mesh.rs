//! From points on a mesh to texture coordinates.

use bevy::{
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};

/// A hit further from the mesh than this share of its diagonal is off the surface: room for imprecise contacts, none
/// for stray shots.
const MAX_DISTANCE: f32 = 0.25;

/// Texture coordinates at the point of `mesh` that is closest to `point`, both in the mesh's space.
pub(super) fn closest_uv(mesh: &Mesh, point: Vec3) -> Result<Vec2, &'static str> {
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
    let indices = mesh.try_indices_option().map_err(|_| NO_DATA)?;
    let n = indices.map_or(positions.len(), Indices::len);
    let vertex = |i: usize| match indices {
        None => i,
        Some(Indices::U16(indices)) => usize::from(indices[i]),
        Some(Indices::U32(indices)) => indices[i] as usize,
    };
    let mut best: Option<(f32, Vec2)> = None;
    let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for first in (0..n.saturating_sub(2)).step_by(3) {
        let corners = [vertex(first), vertex(first + 1), vertex(first + 2)];
        let Some([a, b, c]) = read(positions, corners) else { continue };
        let Some([uv_a, uv_b, uv_c]) = read(uvs, corners) else { continue };
        let [a, b, c] = [a, b, c].map(Vec3::from_array);
        let [uv_a, uv_b, uv_c] = [uv_a, uv_b, uv_c].map(Vec2::from_array);
        min = min.min(a).min(b).min(c);
        max = max.max(a).max(b).max(c);
        let weights = closest_weights(point, a, b, c);
        let closest = a * weights.x + b * weights.y + c * weights.z;
        let distance = closest.distance_squared(point);
        // The first of equals wins; NaN never does.
        if distance.is_finite() && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, uv_a * weights.x + uv_b * weights.y + uv_c * weights.z));
        }
    }
    let (distance, uv) = best.ok_or("the mesh has no triangles")?;
    if distance.sqrt() > MAX_DISTANCE * min.distance(max) {
        return Err("the point lies off the mesh");
    }
    Ok(uv)
}

/// Texture coordinates within 0..=1: those beyond are of a texture that repeats.
pub(super) fn wrap(uv: Vec2) -> Vec2 {
    const SLACK: f32 = 1e-4;
    let wrap = |x: f32| if (-SLACK..=1.0 + SLACK).contains(&x) { x.clamp(0.0, 1.0) } else { x.rem_euclid(1.0) };
    Vec2::new(wrap(uv.x), wrap(uv.y))
}

fn read<const N: usize>(values: &[[f32; N]], at: [usize; 3]) -> Option<[[f32; N]; 3]> {
    Some([*values.get(at[0])?, *values.get(at[1])?, *values.get(at[2])?])
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
        let uv = |x, y, z| closest_uv(&mesh, Vec3::new(x, y, z));
        assert_eq!(uv(-1.0, 0.5, 0.0), Ok(Vec2::ZERO), "top left");
        assert_eq!(uv(0.5, 0.0, 0.1), Ok(Vec2::new(0.75, 0.5)), "above the face");
        assert_eq!(uv(1.2, -0.6, 0.0), Ok(Vec2::ONE), "just off a corner");
        assert!(uv(5.0, 0.0, 0.0).is_err(), "far off");
    }

    #[test]
    fn broken_meshes_are_refused() {
        let mut mesh = Mesh::from(Rectangle::new(1.0, 1.0));
        mesh.insert_indices(Indices::U32(vec![0, 1, 99, 0]));
        assert!(closest_uv(&mesh, Vec3::ZERO).is_err(), "no whole triangle is left");
        mesh.remove_attribute(Mesh::ATTRIBUTE_UV_0);
        assert!(closest_uv(&mesh, Vec3::ZERO).is_err(), "no texture coordinates");
    }

    #[test]
    fn coordinates_beyond_the_picture_repeat() {
        assert_eq!(wrap(Vec2::new(1.25, -0.25)), Vec2::new(0.25, 0.75));
        assert_eq!(wrap(Vec2::new(1.0, -1e-5)), Vec2::new(1.0, 0.0));
    }
}
