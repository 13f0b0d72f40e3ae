//! Pieces of surfaces that are not flat.

use super::*;
use crate::math::ops;
use crate::unwrap::{MeshShape, Unwrap};
use glam::Affine3A;

/// A mesh: corners, and triangles counter-clockwise as seen from outside.
type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

/// A ball of radius 1, `n` rows of triangles.
fn ball(n: u32) -> Mesh {
    let round = 2 * n;
    let point = |row: u32, i: u32| {
        let (polar, around) =
            (row as f32 / n as f32 * core::f32::consts::PI, i as f32 / round as f32 * core::f32::consts::TAU);
        let (sin, cos) = (ops::sin(polar), ops::cos(polar));
        Vec3::new(sin * ops::cos(around), cos, -sin * ops::sin(around))
    };
    let mut positions = vec![Vec3::Y];
    (1..n).for_each(|row| positions.extend((0..round).map(|i| point(row, i))));
    positions.push(Vec3::NEG_Y);
    let (last, at) = (positions.len() as u32 - 1, |row: u32, i: u32| 1 + (row - 1) * round + i % round);
    let mut triangles = Vec::new();
    for i in 0..round {
        triangles.push([0, at(1, i), at(1, i + 1)]);
        for row in 1..n - 1 {
            let [a, b, c, d] = [at(row, i), at(row, i + 1), at(row + 1, i), at(row + 1, i + 1)];
            triangles.extend([[a, c, d], [a, d, b]]);
        }
        triangles.push([at(n - 1, i), last, at(n - 1, i + 1)]);
    }
    (positions, triangles)
}

fn cube() -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for normal in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
        let right = normal.any_orthonormal_vector();
        let (up, start) = (normal.cross(right), positions.len() as u32);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        positions.extend(corners.map(|(u, v)| normal + right * u + up * v));
        triangles.extend([[start, start + 1, start + 2], [start, start + 2, start + 3]]);
    }
    (positions, triangles)
}

/// A mesh laid out around one of its triangles; normals as `normal` says.
fn shell(mesh: &Mesh, triangle: usize, normal: impl Fn(Vec3, Vec3) -> Vec3) -> (Shell, Vec2) {
    let (positions, triangles) = mesh;
    let shape = MeshShape::new(positions, triangles).unwrap();
    let around = triangles[triangle].iter().map(|i| positions[*i as usize]).sum::<Vec3>() / 3.0;
    let unwrap = Unwrap { around, triangle, right: Vec3::X, texels: 64.0, most_side: 4096, most_texels: 1 << 22 };
    let laid = unwrap.apply(&shape).unwrap();
    let unit = laid.size.min_element() as f32;
    let extent = laid.size.as_vec2() / unit;
    let triangles = triangles.iter().zip(&laid.corners).filter_map(|(triangle, flat)| {
        let corners = triangle.map(|i| positions[i as usize]);
        let own = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let flat = (*flat)?.map(|at| at / unit);
        Some(ShellTriangle { flat, corners, normals: corners.map(|at| normal(at, own)) })
    });
    (Shell::new(extent, triangles), extent)
}

/// Cut along random lines, and where the layout ends.
fn cut(shell: &Shell, extent: Vec2, lines: usize, rng: &mut Rng) -> Shards {
    let mut cuts = Cuts::new(extent).unwrap();
    for edge in shell.border() {
        cuts.add_line(&edge).unwrap();
    }
    for _ in 0..lines {
        let mut place = || Vec2::new(rng.unit(), rng.unit()) * extent;
        let line = [place(), place()];
        cuts.add_line(&line).unwrap();
    }
    shatter(cuts, &ShatterParams { extend_cracks: true, min_area: 0.0, ..ShatterParams::DEFAULT }).unwrap()
}

fn corners(part: &ShellPart) -> impl Iterator<Item = [Vec3; 3]> + '_ {
    part.indices.as_chunks::<3>().0.iter().map(|triangle| triangle.map(|i| Vec3::from(part.positions[i as usize])))
}

fn area(part: &ShellPart) -> f64 {
    corners(part).map(|[a, b, c]| 0.5 * f64::from((b - a).cross(c - a).length())).sum()
}

#[test]
fn pieces_cover_the_surface_and_show_what_is_laid_out_there() {
    let mut rng = Rng::new(4);
    for (mesh, whole) in [(cube(), 24.0), (ball(12), 0.0)] {
        let whole = if whole > 0.0 {
            whole
        } else {
            let (at, triangles) = &mesh;
            let area = |[a, b, c]: [Vec3; 3]| 0.5 * f64::from((b - a).cross(c - a).length());
            triangles.iter().map(|triangle| area(triangle.map(|i| at[i as usize]))).sum::<f64>()
        };
        for triangle in [0, 3, 7] {
            let (shell, extent) = shell(&mesh, triangle, |_, own| own);
            let shards = cut(&shell, extent, 14, &mut rng);
            let mut covered = 0.0;
            let mut pieces = 0;
            for number in 0..shards.len() as u32 {
                let made = shards.shell_mesh(number, &shell, &ShellFrame { thickness: 0.05, ..ShellFrame::default() });
                let inner = shards.inner_point(number).and_then(|at| shell.place(at));
                if shards.get(number).is_none_or(|shard| shard.area < 1e-6) {
                    // A splinter beside the border.
                    covered += area(&made.picture);
                    continue;
                }
                let part = area(&made.picture);
                assert_eq!(part < 1e-5, inner.is_none(), "shard {number}: {part}");
                let Some(inner) = inner else {
                    assert!(shell.distance(&shards, number, Vec3::ZERO).is_none());
                    covered += part;
                    continue;
                };
                pieces += 1;
                covered += part;
                assert!(shell.distance(&shards, number, inner.position) == Some(0.0));
                let all = made.picture.positions.iter().zip(&made.picture.uvs).zip(&made.picture.normals);
                for ((at, uv), normal) in all {
                    // What it shows is what lies there. At the border of the layout it may be found no more.
                    if let Some(place) = shell.place(Vec2::from(*uv) * extent) {
                        assert!(place.position.distance(Vec3::from(*at)) < 1e-3, "{at:?} {place:?}");
                        assert!((Vec3::from(*normal).length() - 1.0).abs() < 1e-5);
                    }
                }
                for [a, b, c] in corners(&made.picture) {
                    assert!((b - a).cross(c - a).dot(a + b + c) > -1e-5, "it faces outward");
                }
            }
            assert!(pieces > 10 && (covered / whole - 1.0).abs() < 1e-4, "{pieces} pieces: {covered} of {whole}");
        }
    }
}

/// What is closed has as much surface facing one way as the other, and a volume.
fn closed_pieces(rim: RimLook, roughness: f32, (thin, least): (f32, f32)) {
    let mut rng = Rng::new(8);
    let (shell, extent) = shell(&ball(16), 40, |at, _| at);
    let shards = cut(&shell, extent, 16, &mut rng);
    let thickness = 0.1;
    let turn = Affine3A::from_rotation_y(1.0) * Affine3A::from_translation(Vec3::new(3.0, 1.0, 2.0));
    let mut volume = 0.0;
    for number in 0..shards.len() as u32 {
        let frame = ShellFrame { thickness, to_mesh: turn, rim, roughness, ..ShellFrame::default() };
        let ShellMesh { picture, inside } = shards.shell_mesh(number, &shell, &frame);
        let middle = Vec3::from(picture.positions.first().copied().unwrap_or_default());
        let (mut facing, mut own) = (glam::DVec3::ZERO, 0.0);
        for [a, b, c] in corners(&picture).chain(corners(&inside)).map(|of| of.map(|at| (at - middle).as_dvec3())) {
            facing += 0.5 * (b - a).cross(c - a);
            own += a.dot(b.cross(c)) / 6.0;
        }
        let surface = area(&picture) + area(&inside);
        assert!(facing.length() <= 2e-3 * surface, "shard {number}: {facing} of {surface}");
        // A splinter may be turned inside out, it is so uneven.
        assert!(own > -1e-3, "shard {number}: {own}");
        volume += own;
        for part in [&picture, &inside] {
            let n = part.positions.len();
            assert!(part.normals.len() == n && part.tangents.len() == n && part.uvs.len() == n);
            assert!(
                part.tangents.iter().all(|[x, y, z, w]| (x * x + y * y + z * z - 1.0).abs() < 1e-4 && w.abs() == 1.0)
            );
            // Triangles face where their normals do.
            for triangle in part.indices.as_chunks::<3>().0 {
                let [a, b, c] = triangle.map(|i| Vec3::from(part.positions[i as usize]));
                let normal = Vec3::from(part.normals[triangle[0] as usize]);
                let own = (b - a).cross(c - a);
                // Splinters bend with what they lie on.
                let is_thin = own.length() <= thin * (b - a).length_squared().max((c - a).length_squared());
                assert!(is_thin || own.length() < 1e-5 || own.normalize().dot(normal) > least, "{own} {normal}");
            }
        }
    }
    // Between two balls, about.
    let expected = 4.0 / 3.0 * std::f64::consts::PI * (1.0 - 0.9f64.powi(3));
    assert!((volume / expected - 1.0).abs() < 0.03, "{volume} {expected}");
}

#[test]
fn pieces_of_what_is_smooth_are_closed() {
    for rim in [RimLook::PLAIN, RimLook::STONE, RimLook::GLASS] {
        closed_pieces(rim, 0.0, (0.01, 0.8));
    }
    // Uneven faces are not flat, but do not fold.
    closed_pieces(RimLook::STONE, 1.0, (0.1, 0.0));
}

/// Pieces without thickness are smooth, whatever their roughness: they are those without it.
#[test]
fn pieces_without_thickness_are_smooth() {
    let (shell, extent) = shell(&ball(8), 0, |at, _| at);
    let shards = cut(&shell, extent, 6, &mut Rng::new(5));
    for thickness in [0.0, 1e-40, 1e-8] {
        let mut pieces = 0;
        for number in 0..shards.len() as u32 {
            let [smooth, rough] = [0.0, 1.0].map(|roughness| {
                shards.shell_mesh(number, &shell, &ShellFrame { thickness, roughness, ..ShellFrame::default() })
            });
            for part in [&rough.picture, &rough.inside] {
                let numbers = part.positions.iter().chain(&part.normals).flatten().chain(part.uvs.iter().flatten());
                assert!(numbers.chain(part.tangents.iter().flatten()).all(|number| number.is_finite()));
            }
            assert!(smooth == rough, "shard {number}, {thickness} thick");
            pieces += usize::from(!rough.inside.positions.is_empty());
        }
        assert!(pieces > 5, "{pieces}");
    }
}

#[test]
fn what_is_no_shell_has_no_pieces() {
    let flat = [Vec2::ZERO, Vec2::X, Vec2::Y];
    let corners = [Vec3::ZERO, Vec3::X, Vec3::NEG_Y];
    let whole = ShellTriangle { flat, corners, normals: [Vec3::NAN; 3] };
    let bad = [
        ShellTriangle { corners: [Vec3::ZERO; 3], ..whole },
        ShellTriangle { corners: [Vec3::NAN; 3], ..whole },
        ShellTriangle { flat: [Vec2::ONE; 3], ..whole },
        ShellTriangle { flat: [Vec2::INFINITY, Vec2::X, Vec2::Y], ..whole },
    ];
    let shards = shatter(Cuts::new(Vec2::ONE).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let none = Shell::new(Vec2::ONE, bad);
    assert!(none.is_empty() && none.border().next().is_none() && none.place(Vec2::splat(0.2)).is_none());
    assert_eq!(shards.shell_mesh(0, &none, &ShellFrame::default()), ShellMesh::default());
    assert_eq!(shards.shell_mesh(9, &none, &ShellFrame::default()), ShellMesh::default());
    let one = Shell::new(Vec2::ONE, bad.into_iter().chain([whole]));
    assert_eq!(one.border().count(), 3);
    assert_eq!(one.place(Vec2::new(0.25, 0.5)).unwrap().position, Vec3::new(0.25, -0.5, 0.0));
    assert!(one.place(Vec2::splat(0.9)).is_none() && one.place(Vec2::NAN).is_none());
    let mesh = shards.shell_mesh(0, &one, &ShellFrame { rim: RimLook::STONE, ..ShellFrame::default() });
    assert_eq!(mesh.picture.colors.len(), mesh.picture.positions.len());
    assert!(mesh.picture.normals.iter().all(|normal| *normal == [0.0, 0.0, -1.0] || *normal == [0.0, 0.0, 1.0]));
    assert!((area(&mesh.picture) - 0.5).abs() < 1e-6);
}

/// A piece that is told of its own plane flies as one of a flat surface does.
#[test]
fn a_burst_has_its_origin_anywhere() {
    let shards = shatter(Cuts::new(Vec2::ONE).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let shard = shards.get(0).unwrap();
    let burst = Burst::new(BurstParams::DEFAULT, Vec2::new(0.2, 0.3), Vec3::NEG_Z, 1.0, 7).unwrap();
    let same = burst.clone().with_origin(Vec3::new(0.2, -0.3, 0.0));
    assert_eq!(burst, same);
    assert_eq!(burst.clone().with_origin(Vec3::NAN), burst);
    let calm = BurstParams { scatter: 0.0, along: 0.0, ..BurstParams::DEFAULT };
    let behind = Burst::new(calm, Vec2::ZERO, Vec3::NEG_Z, 1.0, 7).unwrap().with_origin(Vec3::new(0.5, -0.5, -2.0));
    let velocity = behind.flight(0, shard).velocity;
    assert!(velocity.z > 0.0 && velocity.truncate().length() < 1e-6, "{velocity}");
}

/// What is curved lies on its middle, or on what reaches furthest behind that.
#[test]
fn curved_pieces_do_not_sink_into_the_floor() {
    let shards = shatter(Cuts::new(Vec2::ONE).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let shard = shards.get(0).unwrap();
    let floor = Floor { up: Vec3::Y, height: -2.0, clearance: 0.05, depth: 0.3, lies_flat: true };
    let mut count = [0; 2];
    for seed in 0..40 {
        let burst = Burst::new(BurstParams::DEFAULT, Vec2::splat(0.3), Vec3::ZERO, 1.0, seed).unwrap();
        let pose = burst.with_floor(floor).unwrap().flight(0, shard).pose(60.0);
        let is_up = (pose.rotation * Vec3::Z).y > 0.0;
        count[usize::from(is_up)] += 1;
        let height = pose.offset.y - shard.centroid.y - floor.height;
        let expected = floor.clearance + if is_up { floor.depth } else { 0.0 };
        assert!((height - expected).abs() < 1e-3, "{seed}: {height} {expected}");
        assert!((pose.rotation * Vec3::Z).y.abs() > 0.999, "it lies flat");
    }
    assert!(count.iter().all(|n| *n > 5), "{count:?}");
}
