use super::*;
use crate::math::Rng;
use glam::{UVec2, Vec2, Vec3};

/// A box around the origin, two triangles a side, four vertices each.
fn cuboid(half: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let n = positions.len() as u32;
            let mut out = Vec3::ZERO;
            out[axis] = side;
            let mut right = Vec3::ZERO;
            right[(axis + 1) % 3] = 1.0;
            let up = out.cross(right);
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                positions.push((out + right * x + up * y) * half);
            }
            triangles.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
        }
    }
    (positions, triangles)
}

/// A ball of radius 1: an octahedron whose triangles were divided a number of times.
fn ball(times: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z];
    let mut faces =
        vec![[x, y, z], [y, -x, z], [-x, -y, z], [-y, x, z], [y, x, -z], [-x, y, -z], [-y, -x, -z], [x, -y, -z]];
    for _ in 0..times {
        faces = faces
            .into_iter()
            .flat_map(|[a, b, c]| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let positions = faces.concat();
    let triangles = (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    (positions, triangles)
}

/// The side of a cylinder of radius 1 and height 2.
fn tube(sides: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let at =
        |i: u32, z: f32| crate::math::ops::unit((i % sides) as f32 / sides as f32 * core::f32::consts::TAU).extend(z);
    let positions: Vec<Vec3> = (0..sides).flat_map(|i| [at(i, -1.0), at(i, 1.0)]).collect();
    let triangles = (0..sides).flat_map(|i| {
        let (a, b) = (2 * i, 2 * ((i + 1) % sides));
        [[a, b, b + 1], [a, b + 1, a + 1]]
    });
    (positions, triangles.collect())
}

fn lay_out(mesh: &(Vec<Vec3>, Vec<[u32; 3]>), around: Vec3, texels: f32) -> (MeshShape, LaidOut) {
    let shape = MeshShape::new(&mesh.0, &mesh.1).unwrap();
    let distance = |triangle: &usize| shape.centroid(*triangle).distance_squared(around);
    let triangle = (0..shape.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
    let right = Vec3::X;
    let laid_out =
        Unwrap { around, triangle, right, texels, most_side: 8192, most_texels: 1 << 26 }.apply(&shape).unwrap();
    (shape, laid_out)
}

/// In place of how much a mesh of triangles at random may be stretched.
const AT_RANDOM: f32 = f32::INFINITY;

/// Each triangle is there once, seen from outside, and no texel lies in two of them.
fn check(shape: &MeshShape, laid_out: &LaidOut, stretch: f32) {
    let mut covered = vec![0u8; laid_out.owner.len()];
    for (triangle, corners) in laid_out.corners.iter().enumerate() {
        assert_eq!(corners.is_some(), shape.has_area(triangle));
        let Some([a, b, c]) = *corners else { continue };
        let turn = (b - a).perp_dot(c - a);
        // A sliver may be by rounding, by less than a hundredth of a texel.
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        assert!(
            turn < 0.01 * longest,
            "triangle {triangle} is turned over: {turn} {longest} {:?} {:?}",
            laid_out.corners[triangle],
            shape.corners(triangle)
        );
        let turn = turn.min(-1e-6);
        let inside = |corner: Vec2| corner.min_element() >= 0.0 && corner.cmple(laid_out.size.as_vec2()).all();
        assert!([a, b, c].into_iter().all(inside));
        let own = shape.corners(triangle);
        for (p, q, u, v) in [(0, 1, a, b), (1, 2, b, c), (2, 0, c, a)] {
            let ratio = u.distance(v) / own[p].distance(own[q]);
            assert!(
                ratio > 0.0
                    && (stretch == 0.0 || (stretch.recip()..=stretch).contains(&(ratio / texels(shape, laid_out))))
            );
        }
        let (min, max) = (a.min(b).min(c).as_uvec2(), a.max(b).max(c).ceil().as_uvec2().min(laid_out.size));
        for y in min.y..max.y {
            for x in min.x..max.x {
                let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let is_inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).perp_dot(at - *p) * turn > 0.1);
                if is_inside {
                    covered[(y * laid_out.size.x + x) as usize] += 1;
                    assert!(laid_out.owner(UVec2::new(x, y)).is_some());
                }
            }
        }
    }
    let twice = covered.iter().filter(|covered| **covered > 1).count();
    // Triangles at random may lie over one another in one plane of the mesh itself.
    let most = if stretch == AT_RANDOM { covered.len() / 100 } else { 0 };
    assert!(twice <= most, "{twice} texels lie in several triangles");
}

fn in_first(laid_out: &LaidOut) -> usize {
    laid_out.chart.iter().filter(|chart| **chart == 0).count()
}

/// Texels for a unit of length: by the first triangle, which is never stretched much.
fn texels(shape: &MeshShape, laid_out: &LaidOut) -> f32 {
    let area: f32 = laid_out.corners.iter().flatten().map(|[a, b, c]| -0.5 * (b - a).perp_dot(c - a)).sum();
    (area / shape.area()).sqrt()
}

#[test]
fn a_box_becomes_a_cross_whose_edges_stay_together() {
    for half in [Vec3::ONE, Vec3::new(0.5, 2.0, 0.7), Vec3::new(3.0, 0.4, 1.0)] {
        let mesh = cuboid(half);
        for face in 0..6 {
            let mut around = Vec3::ZERO;
            around[face / 2] = half[face / 2] * if face % 2 == 0 { -1.0 } else { 1.0 };
            let (shape, laid_out) = lay_out(&mesh, around, 64.0);
            assert_eq!((shape.faces(), laid_out.charts, laid_out.chart.clone()), (6, 1, vec![0; 12]));
            check(&shape, &laid_out, 1.0001);
            // Edges of the box that are edges of the plane too: five, and four of them around the face that was hit.
            let (mut joined, mut around_first) = (0, 0);
            let hit = (0..12).min_by_key(|i| (1e6 * shape.centroid(*i).distance(around)) as u32).unwrap();
            for (triangle, corner, other, begin) in (0..12).flat_map(|triangle| {
                let across = shape.across(triangle).into_iter().enumerate();
                across
                    .filter_map(move |(corner, to)| to.map(|(other, begin)| (triangle, corner, other as usize, begin)))
            }) {
                let (here, there) = (laid_out.corners[triangle].unwrap(), laid_out.corners[other].unwrap());
                let [a, b] = [here[corner], here[(corner + 1) % 3]];
                let [p, q] = [there[(usize::from(begin) + 1) % 3], there[usize::from(begin)]];
                if shape.face(triangle) != shape.face(other) && a.distance(p) < 1e-2 && b.distance(q) < 1e-2 {
                    joined += 1;
                    around_first += usize::from(shape.face(triangle) == shape.face(hit));
                }
            }
            assert_eq!((joined, around_first), (10, 4), "{half} {face}: each is seen from both sides");
            // The other seven are cut. Of each, both places are as long as the edge.
            assert_eq!(laid_out.cuts.len(), 7);
            assert!(laid_out.borders.is_empty());
            for Cut { places: [[a, b], [p, q]], .. } in &laid_out.cuts {
                let length = a.distance(*b);
                assert!((length - p.distance(*q)).abs() < 0.01, "{half} {face}");
                let is_edge = |axis: usize| (length - 2.0 * 64.0 * half[axis]).abs() < 0.05;
                assert!((0..3).any(is_edge), "{half} {face}: {length}");
            }
        }
    }
}

/// A corner of two walls on a floor that is wider than either: of the three edges one is cut, be it only a part of that of the floor.
#[test]
fn edges_that_are_one_in_part_are_cut() {
    let quad = |a: Vec3, right: Vec3, up: Vec3| [a, a + right, a + right + up, a + up];
    let floor = quad(Vec3::Z * 4.0, Vec3::X * 5.0, Vec3::NEG_Z * 4.0);
    let back = quad(Vec3::ZERO, Vec3::X * 3.0, Vec3::Y * 3.0);
    let side = quad(Vec3::Z * 2.0, Vec3::NEG_Z * 2.0, Vec3::Y * 3.0);
    let mesh = (
        [floor, back, side].concat(),
        (0..3).flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]).collect(),
    );
    let mut lengths = Vec::new();
    for around in [Vec3::new(2.0, 0.0, 2.0), Vec3::new(1.5, 1.5, 0.0), Vec3::new(0.0, 1.5, 1.0)] {
        let (shape, laid_out) = lay_out(&mesh, around, 20.0);
        check(&shape, &laid_out, 1.001);
        let [Cut { triangles, places: [[a, b], [p, q]] }] = laid_out.cuts[..] else {
            panic!("{around}: {:?}", laid_out.cuts)
        };
        assert!(shape.face(triangles[0]) != shape.face(triangles[1]));
        assert!(
            (a.distance(b) - p.distance(q)).abs() < 0.01 && (a.distance(p) > 1.0 || b.distance(q) > 1.0),
            "{around}"
        );
        lengths.push((a.distance(b) / 20.0).round());
    }
    // Around the floor the walls part; around a wall the other one parts from the floor, or from it.
    assert_eq!(lengths[0], 3.0);
    assert!(lengths.iter().all(|length| [2.0, 3.0].contains(length)), "{lengths:?}");
}

/// Over an edge lengths and angles stay as they are: the straight way in the plane is as long as the shortest one on the box.
/// Two panels stand on a floor that is as wide as both and a part of the third; the ways over the edge keep their length.
#[test]
fn edges_that_are_one_in_part_are_hinges() {
    let quad = |a: Vec3, right: Vec3, up: Vec3| [a, a + right, a + right + up, a + up];
    let (right, up) = (Vec3::X * 2.0, Vec3::Y * 3.0);
    let panels = [0.0, 2.0, 4.0].map(|x| quad(Vec3::X * x, right, up));
    let floor = quad(Vec3::Z * 4.0, Vec3::X * 5.0, Vec3::NEG_Z * 4.0);
    let apart = quad(Vec3::new(0.0, 8.0, 0.0), right, up);
    let positions: Vec<Vec3> = [panels[0], floor, panels[1], panels[2], apart].concat();
    let triangles: Vec<[u32; 3]> =
        (0..5).flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]).collect();
    for around in [Vec3::new(2.5, 0.0, 2.0), Vec3::new(1.0, 1.0, 0.0)] {
        let (shape, laid_out) = lay_out(&(positions.clone(), triangles.clone()), around, 20.0);
        check(&shape, &laid_out, 1.001);
        assert_eq!(laid_out.charts, 2, "what meets nothing is by itself");
        // Three sides of the floor, the tops of the panels and both ends, and all of what meets nothing.
        assert_eq!((laid_out.cuts.len(), laid_out.borders.len()), (0, 12), "{around}");
        // A floor of 4 before walls of 3.
        let place = |triangle: usize, corner: usize| laid_out.corners[triangle].unwrap()[corner];
        let (before, above) = (place(2, 0), place(7, 2));
        let expected = 20.0 * Vec2::new(4.0, 7.0).length();
        assert!((before.distance(above) - expected).abs() < 0.01, "{} {expected}", before.distance(above));
    }
}

/// Many steps are unfolded as few are: no way up over them is shortened.
#[test]
fn stairs_are_unfolded_step_by_step() {
    let (mut positions, mut triangles) = (Vec::new(), Vec::<[u32; 3]>::new());
    for step in 0..60 {
        let at = Vec3::new(0.0, step as f32, -(step as f32));
        for (from, way) in [(at, Vec3::Y), (at + Vec3::Y, Vec3::NEG_Z)] {
            let n = positions.len() as u32;
            positions.extend([from, from + 4.0 * Vec3::X, from + 4.0 * Vec3::X + way, from + way]);
            triangles.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
        }
    }
    let (shape, laid_out) = lay_out(&(positions, triangles), Vec3::new(2.0, 30.5, -30.0), 8.0);
    check(&shape, &laid_out, 1.001);
    assert_eq!(laid_out.charts, 1);
    assert!((texels(&shape, &laid_out) / 8.0 - 1.0).abs() < 1e-3);
    // A ball of as many faces is a curve.
    assert!(!hinge::has_hinges(&MeshShape::new(&ball(3).0, &ball(3).1).unwrap()));
}

#[test]
fn ways_over_edges_keep_their_length() {
    let half = Vec3::new(1.0, 0.8, 0.6);
    let (shape, laid_out) = lay_out(&cuboid(half), Vec3::new(0.0, 0.0, half.z), 100.0);
    let place = |point: Vec3| {
        let found = (0..shape.len()).find_map(|triangle| {
            let [a, b, c] = shape.corners(triangle);
            let normal = shape.normal(triangle);
            let area = (b - a).cross(c - a).dot(normal);
            let weights = [(b, c), (c, a), (a, b)].map(|(p, q)| (q - p).cross(point - p).dot(normal) / area);
            let is_on = (point - a).dot(normal).abs() < 1e-5 && weights.iter().all(|weight| *weight > -1e-5);
            let [p, q, r] = laid_out.corners[triangle]?;
            is_on.then(|| p * weights[0] + q * weights[1] + r * weights[2])
        });
        found.unwrap()
    };
    let mut rng = Rng::new(5);
    for _ in 0..500 {
        let mut random = |low: f32, high: f32| low + (high - low) * rng.unit();
        // On the front, and on the right side near their common edge.
        let front = Vec3::new(random(0.0, half.x), random(-0.5, 0.5), half.z);
        let side = Vec3::new(half.x, random(-0.5, 0.5), random(0.0, half.z));
        let exact = Vec2::new(half.x - front.x + half.z - side.z, side.y - front.y).length();
        let laid = place(front).distance(place(side)) / 100.0;
        assert!((laid - exact).abs() < 1e-4, "{front} {side}: {laid} {exact}");
    }
}

#[test]
fn a_ball_falls_into_few_charts_and_keeps_distances_from_the_hit() {
    let mesh = ball(4);
    let around = Vec3::new(0.3, -0.5, 0.81).normalize();
    let (shape, laid_out) = lay_out(&mesh, around, 80.0);
    check(&shape, &laid_out, 0.0);
    assert!(
        laid_out.charts <= 12 && in_first(&laid_out) * 2 > shape.len(),
        "{} {}",
        laid_out.charts,
        in_first(&laid_out)
    );
    // From the middle of the first chart: the triangle that was hit.
    let hit = (0..shape.len()).min_by_key(|i| (1e6 * shape.centroid(*i).distance(around)) as u32).unwrap();
    let middle = |triangle: usize| laid_out.corners[triangle].map(|[a, b, c]| (a + b + c) / 3.0).unwrap();
    let (mut worst, mut seen) = (0.0f32, 0);
    for triangle in 0..shape.len() {
        let exact = shape.centroid(triangle).normalize().angle_between(shape.centroid(hit).normalize());
        if (0.2..1.0).contains(&exact) {
            assert_eq!(laid_out.chart[triangle], 0, "{exact} away");
            let laid = middle(triangle).distance(middle(hit)) / 80.0;
            worst = worst.max((laid / exact - 1.0).abs());
            seen += 1;
        }
    }
    assert!(seen > 300 && worst < 0.02, "{seen}: {worst}");
}

/// As where a ball is closed: its ends differ by rounding.
#[test]
fn vertices_that_are_about_in_one_place_are_one() {
    let exact = ball(3);
    let mut rng = Rng::new(2);
    let mut moved = exact.clone();
    moved.0.iter_mut().for_each(|at| *at += 1e-6 * Vec3::new(rng.signed(), rng.signed(), rng.signed()));
    let [exact, moved] = [exact, moved].map(|mesh| lay_out(&mesh, Vec3::Z, 50.0));
    assert_eq!(exact.0.points(), 258, "corners of a divided octahedron");
    assert_eq!((moved.0.points(), moved.1.charts, moved.1.chart), (258, exact.1.charts, exact.1.chart));
}

#[test]
fn a_tube_unrolls() {
    let mesh = tube(96);
    let (shape, laid_out) = lay_out(&mesh, Vec3::X, 60.0);
    check(&shape, &laid_out, 0.0);
    assert!(
        shape.faces() > hinge::MAX_FACES && in_first(&laid_out) > 180,
        "{} of {}",
        in_first(&laid_out),
        shape.len()
    );
    // As wide as it goes around.
    let corners = laid_out.corners.iter().flatten().flatten();
    let (min, max) =
        corners.fold((f32::MAX, f32::MIN), |(min, max), at| (min.min(at.x.min(at.y)), max.max(at.x.max(at.y))));
    let around = (max - min) / 60.0;
    assert!((5.8..6.6).contains(&around), "{around}");
}

/// Whatever the triangles are, each that has an area is laid out once, or there is an error.
#[test]
fn any_triangles_are_laid_out_or_refused() {
    let mut rng = Rng::new(8);
    for round in 0..300 {
        let n = 3 + (rng.next_u32() % 40) as usize;
        let is_flat = rng.next_u32().is_multiple_of(3);
        let snap = rng.next_u32().is_multiple_of(2);
        let mut positions: Vec<Vec3> = (0..n)
            .map(|_| {
                let mut at = Vec3::new(rng.unit(), rng.unit(), if is_flat { 0.0 } else { rng.unit() });
                if snap {
                    at = (3.0 * at).round() / 3.0;
                }
                at
            })
            .collect();
        let count = 1 + (rng.next_u32() % 200);
        let mut triangles: Vec<[u32; 3]> = (0..count).map(|_| [0; 3].map(|_: u32| rng.next_u32() % n as u32)).collect();
        match round % 10 {
            0 => positions[0].x = f32::NAN,
            1 => triangles[0][1] = n as u32,
            2 => positions.iter_mut().for_each(|at| *at *= 1e8),
            3 => positions.iter_mut().for_each(|at| *at *= 1e-6),
            _ => {}
        }
        let shape = match MeshShape::new(&positions, &triangles) {
            Ok(shape) => shape,
            Err(UnwrapError::NoTriangles(_)) => continue,
            Err(error) => {
                assert!(round % 10 < 2, "{error}");
                continue;
            }
        };
        let triangle = (0..shape.len()).find(|triangle| shape.has_area(*triangle)).unwrap();
        let around = shape.centroid(triangle);
        let texels = 40.0 / shape.area().sqrt();
        let unwrap = Unwrap { around, triangle, right: Vec3::Y, texels, most_side: 4096, most_texels: 1 << 24 };
        match unwrap.apply(&shape) {
            Ok(laid_out) => {
                check(&shape, &laid_out, AT_RANDOM);
                assert_eq!(laid_out, unwrap.apply(&shape).unwrap(), "the same again");
            }
            Err(error) => assert!(matches!(error, UnwrapError::TooLarge { .. }), "{round}: {error}"),
        }
    }
}

#[test]
fn what_is_out_of_range_is_named() {
    let (positions, triangles) = cuboid(Vec3::ONE);
    let shape = MeshShape::new(&positions, &triangles).unwrap();
    let good =
        Unwrap { around: Vec3::X, triangle: 0, right: Vec3::X, texels: 10.0, most_side: 512, most_texels: 1 << 18 };
    assert!(good.apply(&shape).is_ok());
    let bad = [
        Unwrap { around: Vec3::NAN, ..good },
        Unwrap { triangle: 12, ..good },
        Unwrap { texels: 0.0, ..good },
        Unwrap { texels: f32::INFINITY, ..good },
        Unwrap { most_side: 0, ..good },
        Unwrap { most_side: u32::MAX, ..good },
    ];
    for bad in bad {
        assert!(matches!(bad.apply(&shape), Err(UnwrapError::Parameter(_))), "{bad:?}");
    }
    for small in
        [Unwrap { most_side: 40, ..good }, Unwrap { most_texels: 3000, ..good }, Unwrap { texels: 1e30, ..good }]
    {
        assert!(matches!(small.apply(&shape), Err(UnwrapError::TooLarge { .. })));
    }
    // Of no use, but not wrong.
    for right in [Vec3::ZERO, Vec3::NAN, shape.normal(0)] {
        assert!(Unwrap { right, ..good }.apply(&shape).is_ok());
    }
    assert_eq!(MeshShape::new(&[Vec3::ZERO; 3], &[[0, 1, 2]]).err(), Some(UnwrapError::NoTriangles(1)));
    assert_eq!(MeshShape::new(&[], &[]).err(), Some(UnwrapError::NoTriangles(0)));
    let many = vec![[0, 1, 2]; MAX_TRIANGLES + 1];
    assert_eq!(MeshShape::new(&positions, &many).err(), Some(UnwrapError::TooManyTriangles(MAX_TRIANGLES + 1)));
}
