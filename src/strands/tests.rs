//! Paths against a transcription of the paper's rule, strands against brute force, hostile input.

use super::*;
use crate::{
    Grid,
    math::{Rng, pools::check_in_pools},
    pattern::{NO_PARENT, Network},
};
use glam::{UVec2, Vec2};

const UNIT: Vec2 = Vec2::ONE;

fn place(rng: &mut Rng, extent: Vec2) -> Vec2 {
    Vec2::new(rng.unit(), rng.unit()) * extent
}

/// Directions of every kind.
fn directions(rng: &mut Rng, extent: Vec2) -> Directions {
    let center = place(rng, extent);
    match rng.next_u32() % 5 {
        0 => Directions::Linear(Vec2::new(rng.signed(), rng.signed())),
        1 => Directions::Radial { center },
        2 => Directions::Swirl { center, turn: 3.0 * rng.signed() },
        3 => {
            let size = UVec2::new(1 + rng.next_u32() % 7, 1 + rng.next_u32() % 7);
            let mut painted = Grid::new(size, [0.0; 2]);
            painted.as_mut_slice().fill_with(|| [rng.signed(), rng.signed()]);
            Directions::Painted(painted)
        }
        _ => Directions::Along { line: (0..4).map(|_| place(rng, extent)).collect(), hold: rng.range(0.02, 0.5) },
    }
}

fn params(rng: &mut Rng) -> StrandParams {
    StrandParams {
        frequency: 20.0 * rng.unit(),
        rotation: rng.unit(),
        inertia: rng.unit(),
        propagation: if rng.unit() < 0.5 { Propagation::Costs } else { Propagation::Continuous },
        length: rng.range(0.2, 1.5),
        step: 1.0 / 200.0,
        depth: rng.next_u32() % 3,
        children: 1 + rng.next_u32() % 2,
        branch_cost: rng.range(0.1, 0.5),
        child_frequency: 25.0 * rng.unit(),
        spread: 0.15 * rng.unit(),
        repulsion: rng.range(0.03, 0.08),
        ..StrandParams::DEFAULT
    }
}

fn starts(rng: &mut Rng, count: usize, extent: Vec2) -> Vec<StrandStart> {
    (0..count)
        .map(|_| {
            let direction = (rng.unit() < 0.5).then(|| Vec2::new(rng.signed(), rng.signed()));
            StrandStart { pos: place(rng, extent), direction }
        })
        .collect()
}

/// Section 3.2 of the paper, one line of code for each of its sentences.
fn by_the_paper(field: &GuidanceField, start: Vec2, params: &StrandParams) -> Vec<(i32, i32)> {
    let basic = [("north", 0, -1), ("east", 1, 0), ("south", 0, 1), ("west", -1, 0)];
    let mut cost = [1.0f32; 4];
    let (mut x, mut y) = (0, 0);
    let mut path = vec![(x, y)];
    for _ in 0..(params.length / params.step).round() as u32 {
        let at = start + Vec2::new(x as f32, y as f32) * params.step;
        let v = field.at(at);
        if v == Vec2::ZERO {
            break;
        }
        for d in 0..4 {
            let inner_product = v.x * basic[d].1 as f32 + v.y * basic[d].2 as f32;
            cost[d] -= (1.0 - params.inertia) * inner_product;
        }
        let chosen = (0..4).rev().min_by(|&a, &b| cost[a].total_cmp(&cost[b]).then(a.cmp(&b))).unwrap();
        (x, y) = (x + basic[chosen].1, y + basic[chosen].2);
        cost[chosen] += 1.0;
        path.push((x, y));
        let next = start + Vec2::new(x as f32, y as f32) * params.step;
        if next.min_element() < 0.0 || next.x > field.extent().x || next.y > field.extent().y {
            break;
        }
    }
    path
}

#[test]
fn paths_by_costs_are_those_of_the_paper() {
    let mut rng = Rng::new(1);
    let mut steps = 0;
    for seed in 0..300 {
        let extent = Vec2::new(rng.range(1.0, 2.0), 1.0);
        let params = StrandParams { propagation: Propagation::Costs, repulsion: 0.0, depth: 0, ..params(&mut rng) };
        let directions = directions(&mut rng, extent);
        let start = StrandStart::new(place(&mut rng, extent));
        let field = GuidanceField::new(directions.clone(), params.frequency, params.rotation, extent, seed).unwrap();
        let strands = Strands::new(&params, directions, &[start], extent, seed).unwrap();
        let (strand, expected) = (&strands.strands()[0], by_the_paper(&field, start.pos, &params));
        assert_eq!(strand.points.len(), expected.len(), "seed {seed}");
        for (i, (point, (x, y))) in strand.points.iter().zip(&expected).enumerate() {
            let on_lattice = start.pos + Vec2::new(*x as f32, *y as f32) * params.step;
            // The last step ends at the border.
            let exact = on_lattice.clamp(Vec2::ZERO, extent);
            assert!(point.distance(exact) < 1.0e-6, "seed {seed}, point {i}: {point} is not {exact}");
        }
        steps += strand.points.len();
    }
    assert!(steps > 10_000, "{steps}");
}

/// In a field without noise every path is the line that the field gives.
#[test]
fn continuous_paths_follow_known_curves() {
    let params = StrandParams {
        rotation: 0.0,
        inertia: 0.0,
        repulsion: 0.0,
        length: 0.5,
        step: 0.0005,
        propagation: Propagation::Continuous,
        ..StrandParams::DEFAULT
    };
    let center = Vec2::splat(0.5);
    let start = StrandStart::new(Vec2::new(0.7, 0.5));
    let end =
        |directions| *Strands::new(&params, directions, &[start], UNIT, 1).unwrap().strands()[0].points.last().unwrap();
    // Half a pattern unit along a circle of radius 0.2, clockwise on the surface.
    let circle = end(Directions::Swirl { center, turn: std::f32::consts::FRAC_PI_2 });
    assert!(circle.distance(center + 0.2 * Vec2::from_angle(2.5)) < 0.004, "{circle}");
    let ray = end(Directions::Radial { center });
    assert_eq!(ray, Vec2::new(1.0, 0.5));
    let line = vec![Vec2::new(0.7, 0.5), Vec2::new(0.7, 0.8), Vec2::new(0.4, 0.8)];
    let drawn = end(Directions::Along { line: line.clone(), hold: 0.02 });
    assert!(drawn.distance(Vec2::new(0.5, 0.8)) < 0.03, "{drawn}");
    let params = StrandParams { length: 4.0, ..params };
    let strands = Strands::new(&params, Directions::Along { line, hold: 0.02 }, &[start], UNIT, 1).unwrap();
    let strand = &strands.strands()[0];
    assert_eq!(strand.end, StrandEnd::Field);
    assert!(strand.points.last().unwrap().distance(Vec2::new(0.4, 0.8)) < 0.005);
}

/// Places where two strands touch.
fn joints(strands: &[Strand], a: usize, b: usize) -> Vec<Vec2> {
    let mut joints = Vec::new();
    for (one, other) in [(a, b), (b, a)] {
        let strand = &strands[one];
        if strand.parent.is_some_and(|(parent, _)| parent as usize == other)
            || strand.points[0] == strands[other].points[0]
        {
            joints.push(strand.points[0]);
        }
        if matches!(strand.end, StrandEnd::Joined { strand, .. } if strand as usize == other) {
            joints.push(*strand.points.last().unwrap());
        }
    }
    joints
}

/// The longest stretch of a strand, as it is drawn, that is closer to another one than `least`, joints aside.
fn longest_side_by_side(grown: &Strands, a: usize, b: usize, least: f32) -> f32 {
    let joints = joints(grown.strands(), a, b);
    let [curve, other] = [a, b].map(|strand| &grown.courses[strand].points);
    let (mut longest, mut run) = (0.0f32, 0.0f32);
    for ends in curve.windows(2) {
        let at = ends[1];
        let is_joint = joints.iter().any(|joint| joint.distance(at) < 2.2 * least);
        let is_close = !is_joint && other.iter().any(|point| point.distance_squared(at) < least * least);
        run = if is_close { run + ends[0].distance(at) } else { 0.0 };
        longest = longest.max(run);
    }
    longest
}

#[test]
fn strands_are_never_tangled() {
    let mut rng = Rng::new(7);
    let (mut tangled, mut pairs, mut joined, mut branches, mut tangled_without) = (0, 0, 0, 0, 0);
    for set in 0..1000 {
        let extent = Vec2::new(1.0, rng.range(1.0, 1.5));
        let params = params(&mut rng);
        let (directions, starts) = (directions(&mut rng, extent), starts(&mut rng, 12, extent));
        let grown = Strands::new(&params, directions.clone(), &starts, extent, set).unwrap();
        let strands = grown.strands();
        branches += strands.len() - 12;
        joined += strands.iter().filter(|strand| matches!(strand.end, StrandEnd::Joined { .. })).count();
        // A strand of one point is not drawn.
        let drawn: Vec<usize> = (0..strands.len()).filter(|&i| strands[i].points.len() > 1).collect();
        for &a in &drawn {
            for &b in drawn.iter().filter(|&&b| b != a) {
                let longest = longest_side_by_side(&grown, a, b, params.repulsion);
                let share = longest / params.repulsion;
                if share > 2.0 {
                    println!("set {set}: strands {a} and {b} run too close for {share} times the distance: {params:?}");
                    tangled += 1;
                }
                pairs += 1;
            }
        }
        if set % 50 == 0 {
            let alone = StrandParams { repulsion: 0.0, depth: 0, ..params };
            let grown = Strands::new(&alone, directions, &starts, extent, set).unwrap();
            let is_tangled = |a, b| longest_side_by_side(&grown, a, b, params.repulsion) > 2.0 * params.repulsion;
            tangled_without += u32::from((1..12).any(|b| is_tangled(0, b)));
        }
    }
    assert_eq!(tangled, 0, "pairs of strands");
    // The check sees what it looks for.
    assert!(pairs > 80_000 && joined > 1000 && branches > 1000, "{pairs} pairs, {joined} joined, {branches} branches");
    assert!(tangled_without > 2, "{tangled_without}");
}

/// What holds for every network, and how strands hang together.
fn check_network(strands: &Strands, network: &Network) {
    let extent = strands.extent();
    for (i, node) in (0u32..).zip(network.nodes()) {
        assert!(node.pos.cmpge(Vec2::ZERO).all() && node.pos.cmple(extent).all(), "{}", node.pos);
        assert!(node.width.is_finite() && node.width > 0.0);
        assert!(node.parent == NO_PARENT || node.parent < i);
        if let Some(parent) = network.nodes().get(node.parent as usize) {
            assert!(parent.birth <= node.birth);
            assert_eq!(parent.generation + 1, node.generation);
        }
    }
    assert!(network.nodes().is_sorted_by_key(|node| node.birth));
    assert!(network.links().is_sorted_by_key(|link| link.birth));
    for link in network.links() {
        let [a, b] = [link.a, link.b].map(|i| network.nodes()[i as usize]);
        assert_eq!(link.birth, a.birth.max(b.birth));
        assert_ne!(link.a, link.b);
    }
}

#[test]
fn networks_are_sound_and_the_same_on_every_thread() {
    let make = |seed: u64| {
        let mut rng = Rng::new(seed);
        let extent = Vec2::new(rng.range(1.0, 3.0), 1.0);
        let lanes = if rng.unit() < 0.3 { 2 + rng.next_u32() % 4 } else { 1 };
        let params = StrandParams { lanes, tile: rng.range(0.03, 0.2), ..params(&mut rng) };
        let (directions, starts) = (directions(&mut rng, extent), starts(&mut rng, 5, extent));
        let strands = Strands::new(&params, directions, &starts, extent, seed).unwrap();
        let material = Material::ALL[seed as usize % 5];
        let primitives = if lanes > 1 { material.nets() } else { material.primitives() };
        let network = strands.network(&primitives).unwrap();
        (strands, network)
    };
    let expected: Vec<_> = (0..40).map(make).collect();
    let mut segments = 0;
    for (strands, network) in &expected {
        check_network(strands, network);
        segments += network.segments().count();
    }
    assert!(segments > 10_000, "{segments}");
    check_in_pools(40, |seed| make(seed as u64));
}

/// Each child hangs on its parent, and each strand that has met another one is linked to it.
#[test]
fn strands_hang_together() {
    let mut rng = Rng::new(2);
    let (mut children, mut met) = (0, 0);
    for seed in 0..60 {
        let params = StrandParams { sideways: 0.0, depth: 2, ..params(&mut rng) };
        let (directions, starts) = (directions(&mut rng, UNIT), starts(&mut rng, 6, UNIT));
        let strands = Strands::new(&params, directions, &starts, UNIT, seed).unwrap();
        let network = strands.network(&Material::Glass.primitives()).unwrap();
        let long = |strand: &&Strand| strand.points.len() > 1;
        let roots = strands.strands().iter().filter(long).filter(|strand| strand.parent.is_none()).count();
        assert_eq!(network.nodes().iter().filter(|node| node.parent == NO_PARENT).count(), roots, "seed {seed}");
        children += strands.strands().iter().filter(long).filter(|strand| strand.parent.is_some()).count();
        let ends = strands.strands().iter().filter(|strand| matches!(strand.end, StrandEnd::Joined { .. }));
        let ends = ends.count();
        assert_eq!(network.links().len(), ends, "seed {seed}");
        for link in network.links() {
            let [a, b] = [link.a, link.b].map(|i| network.nodes()[i as usize].pos);
            assert!(a.distance(b) < 0.04, "seed {seed}: a junction of {}", a.distance(b));
        }
        met += ends;
    }
    assert!(children > 100 && met > 100, "{children} {met}");
}

/// A straight strand is its primitives, one after the other, each where it belongs.
#[test]
fn primitives_are_joined_along_the_path() {
    let params = StrandParams {
        rotation: 0.0,
        depth: 0,
        length: 0.72,
        step: 0.002,
        tile: 0.12,
        taper: 0.0,
        width: 0.01,
        propagation: Propagation::Continuous,
        ..StrandParams::DEFAULT
    };
    let start = StrandStart::new(Vec2::new(0.1, 0.5));
    let strands = Strands::new(&params, Directions::Linear(Vec2::X), &[start], UNIT, 5).unwrap();
    for material in Material::ALL {
        let primitive = material.primitives().swap_remove(1);
        let main = &primitive.lines()[0].points;
        let mean = main.iter().map(|point| point.width).sum::<f32>() / main.len() as f32;
        let network = strands.network(std::slice::from_ref(&primitive)).unwrap();
        let on = |at: Vec2| network.nodes().iter().filter(|node| node.pos.distance(at) < 2.0e-4).count();
        for tile in 0..6 {
            let head = Vec2::new(0.1 + 0.12 * tile as f32, 0.5);
            assert_eq!(on(head), 1, "{}: the joint at {head}", material.name());
            // Mirrored or not.
            let [left, right] = [1.0, -1.0]
                .map(|side| main.iter().all(|point| on(head + 0.12 * Vec2::new(point.at.y, side * point.at.x)) >= 1));
            assert!(left || right, "{}: primitive {tile}", material.name());
        }
        // No step of the width at a joint.
        for node in network.nodes().iter().filter(|node| node.parent != NO_PARENT) {
            let parent = network.nodes()[node.parent as usize];
            let share = (node.pos.x - 0.1) / 0.12;
            if (share - share.round()).abs() < 1.0e-3 && node.pos.y == 0.5 {
                let noise = 1.6;
                let widest = main.iter().map(|point| point.width).fold(0.0, f32::max) / mean;
                assert!(node.width / parent.width < noise * widest && parent.width / node.width < noise * widest);
            }
        }
    }
}

/// What the generator draws, the tracer finds again.
#[test]
fn traced_lines_are_the_drawn_ones() {
    for material in Material::ALL {
        let mut all = material.primitives();
        all.extend(material.nets());
        for (i, primitive) in all.iter().enumerate() {
            let name = format!("{} {i}", material.name());
            let traced =
                Primitive::from_image(primitive.image().clone()).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(traced.has_sides(), primitive.has_sides(), "{name}");
            let [drawn, found] = [primitive, &traced].map(|primitive| &primitive.lines()[0].points);
            let far = |points: &[PrimitivePoint], at: Vec2| {
                points.windows(2).fold(f32::INFINITY, |least, ends| {
                    let way = ends[1].at - ends[0].at;
                    let share = ((at - ends[0].at).dot(way) / way.length_squared().max(1.0e-12)).clamp(0.0, 1.0);
                    least.min((ends[0].at + way * share).distance(at))
                })
            };
            let widest = drawn.iter().map(|point| point.width).fold(0.0, f32::max);
            // Corners are cut within the width of the crack.
            let most = widest + 2.5 / primitive.image().height() as f32;
            for point in found {
                let off = far(drawn, point.at);
                assert!(off < most, "{name}: {} is {off} off, more than {most}", point.at);
            }
        }
    }
}

#[test]
fn nets_have_closed_cells() {
    let params = StrandParams { lanes: 4, tile: 0.08, depth: 0, rotation: 0.1, length: 0.8, ..StrandParams::DEFAULT };
    let start = StrandStart::new(Vec2::new(0.1, 0.5));
    let strands = Strands::new(&params, Directions::Linear(Vec2::X), &[start], UNIT, 3).unwrap();
    for material in Material::ALL {
        let network = strands.network(&material.nets()).unwrap();
        check_network(&strands, &network);
        // Three inner seams of ten rows.
        assert_eq!(network.links().len(), 30, "{}", material.name());
        let longest = network.links().iter().map(|link| {
            let [a, b] = [link.a, link.b].map(|i| network.nodes()[i as usize].pos);
            a.distance(b)
        });
        assert!(longest.fold(0.0, f32::max) < 0.08, "{}", material.name());
        let error = strands.network(&material.primitives()).unwrap_err();
        assert_eq!(error, StrandError::NoSides { lanes: 4, index: 0 });
    }
}

fn image(size: [u32; 2], is_crack: impl Fn(u32, u32) -> bool) -> Grid<u16> {
    let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    Grid::from_vec(size.into(), texels.map(|(x, y)| if is_crack(x, y) { 60_000 } else { 100 }).collect()).unwrap()
}

#[test]
fn bad_primitives_are_refused() {
    let line = |x: u32, _: u32| (7..9).contains(&x);
    for (image, error) in [
        (image([0, 0], line), PrimitiveError::Size { width: 0, height: 0, least: 8, most: 1024 }),
        (image([16, 7], line), PrimitiveError::Size { width: 16, height: 7, least: 8, most: 1024 }),
        (image([16, 1025], line), PrimitiveError::Size { width: 16, height: 1025, least: 8, most: 1024 }),
        (image([16, 32], |_, _| false), PrimitiveError::Empty),
        (image([16, 32], |x, y| line(x, y) && y > 3), PrimitiveError::NoConnector { side: "head" }),
        (image([16, 32], |x, y| line(x, y) && y < 30), PrimitiveError::NoConnector { side: "tail" }),
        (image([16, 32], |x, _| x < 3), PrimitiveError::NoConnector { side: "head" }),
        (image([16, 32], |x, y| line(x, y) && y != 9), PrimitiveError::NotJoined { side: "tail" }),
        (
            image([17, 31], |x, y| line(x, y) || (14..16).contains(&y) && !(4..=10).contains(&x)),
            PrimitiveError::NotJoined { side: "left" },
        ),
    ] {
        assert_eq!(Primitive::from_image(image), Err(error));
    }
    // Sides that are odd numbers, and an image that is all crack.
    for good in [image([9, 31], |x, _| x == 4), image([33, 9], |_, _| true)] {
        let primitive = Primitive::from_image(good).unwrap();
        let main = &primitive.lines()[0].points;
        assert_eq!((main[0].at, main[main.len() - 1].at), (Vec2::ZERO, Vec2::Y));
    }
}

/// Images of random texels are refused or make strands.
#[test]
fn random_images_are_harmless() {
    let mut rng = Rng::new(11);
    let (mut good, mut bad) = (0, 0);
    for round in 0..300u64 {
        let size = UVec2::new(4 + rng.next_u32() % 40, 4 + rng.next_u32() % 40);
        let dense = rng.unit();
        let mut noise = Grid::new(size, 0);
        noise.as_mut_slice().fill_with(|| if rng.unit() < dense { rng.next_u32() as u16 } else { 0 });
        let Ok(primitive) = Primitive::from_image(noise) else {
            bad += 1;
            continue;
        };
        good += 1;
        let params = StrandParams { lanes: 1 + u32::from(primitive.has_sides()), ..params(&mut rng) };
        let strands =
            Strands::new(&params, directions(&mut rng, UNIT), &starts(&mut rng, 2, UNIT), UNIT, round).unwrap();
        check_network(&strands, &strands.network(&[primitive]).unwrap());
    }
    assert!(good > 50 && bad > 50, "{good} good, {bad} bad");
}

#[test]
fn bad_fields_and_starts_are_refused() {
    let start = StrandStart::new(Vec2::splat(0.5));
    let refused = |directions, start| {
        Strands::new(&StrandParams::DEFAULT, directions, &[start], UNIT, 1).unwrap_err().to_string()
    };
    let painted = |values: &[[f32; 2]], size: [u32; 2]| {
        Directions::Painted(Grid::from_vec(size.into(), values.to_vec()).unwrap())
    };
    assert_eq!(refused(painted(&[], [0, 0]), start), "`directions.painted` has no texels");
    assert_eq!(
        refused(painted(&[[0.0, 1.0], [1.0, f32::NAN]], [1, 2]), start),
        "`directions.painted` is not finite at texel 0, 1"
    );
    assert_eq!(
        refused(Directions::Linear(Vec2::new(f32::INFINITY, 0.0)), start),
        "`directions.linear.x` is inf, must lie in -1000000..=1000000"
    );
    let no_line = |line: Vec<Vec2>, hold| refused(Directions::Along { line, hold }, start);
    assert!(no_line(vec![], 0.1).starts_with("`directions.line` has 0 points"));
    assert!(no_line(vec![UNIT; 5], 0.1).starts_with("`directions.line` has 5 points"));
    assert!(no_line(vec![UNIT, Vec2::NAN], 0.1).starts_with("`directions.line` has 2 points"));
    assert!(no_line(vec![UNIT; MAX_LINE_POINTS + 1], 0.1).starts_with("`directions.line` has 4097 points"));
    assert_eq!(no_line(vec![UNIT, Vec2::ZERO], 0.0), "`directions.hold` is 0, must lie in 0.001..=64");
    for outside in [Vec2::new(-0.1, 0.5), Vec2::new(0.5, 1.5), Vec2::new(f32::NAN, 0.5)] {
        let text = refused(Directions::Linear(Vec2::X), StrandStart::new(outside));
        assert!(text.starts_with("start 0 at ") && text.ends_with(" is not on the surface of 1 x 1"), "{text}");
    }
    let many = vec![start; MAX_STARTS + 1];
    let error = Strands::new(&StrandParams::DEFAULT, Directions::Linear(Vec2::X), &many, UNIT, 1).unwrap_err();
    assert_eq!(error, StrandError::TooManyStarts { count: 4097, most: 4096 });
    assert_eq!(
        Directions::from_picture(UVec2::new(2, 2), &[0; 15]),
        Err(StrandError::PictureSize { width: 2, height: 2, bytes: 15 })
    );
    assert_eq!(Directions::from_picture(UVec2::ZERO, &[]), Err(StrandError::EmptyField));

    // Where the field is zero a strand stops; with no direction at all it is one point, which is no crack.
    let mut values = vec![[1.0, 0.0]; 64];
    values[32..].fill([0.0, 0.0]);
    let half = Grid::from_vec([1, 64].into(), values).unwrap();
    let params = StrandParams { rotation: 0.0, inertia: 0.0, ..StrandParams::DEFAULT };
    for (y, points) in [(0.2, 257), (0.8, 1)] {
        let start = StrandStart::new(Vec2::new(0.5, y));
        let strands = Strands::new(&params, Directions::Painted(half.clone()), &[start], UNIT, 1).unwrap();
        let strand = &strands.strands()[0];
        assert_eq!(
            (strand.points.len(), strand.end),
            (points, if points > 1 { StrandEnd::Border } else { StrandEnd::Field })
        );
        let network = strands.network(&Material::Clay.primitives()).unwrap();
        assert_eq!(network.nodes().is_empty(), points == 1);
    }
    assert_eq!(
        Strands::new(&params, Directions::Linear(Vec2::X), &[], UNIT, 1).unwrap().network(&[]),
        Err(StrandError::NoPrimitives)
    );
}

/// Every number is checked by its own name, and can be set from text.
#[test]
fn numbers_are_checked_by_name() {
    let names = [
        "frequency",
        "rotation",
        "inertia",
        "length",
        "step",
        "branch_cost",
        "branch_noise",
        "child_frequency",
        "child_length",
        "child_width",
        "spread",
        "repulsion",
        "width",
        "taper",
        "tile",
        "sideways",
        "pace",
    ];
    for name in names {
        for value in ["-1", "NaN", "inf", "1e9"] {
            let mut params = StrandParams::MARBLE;
            let error = params.set(name, value).unwrap_err().to_string();
            assert!(error.starts_with(&format!("`{name}` is ")), "{error}");
            assert_eq!(params, StrandParams::MARBLE);
        }
    }
    for (name, value) in [("depth", "4"), ("children", "3"), ("children", "0"), ("lanes", "0"), ("lanes", "17")] {
        assert!(
            matches!(StrandParams::DEFAULT.clone().set(name, value), Err(StrandError::OutOfRange { .. })),
            "{name}"
        );
    }
    let mut params = StrandParams::DEFAULT;
    assert_eq!(params.set("depth", "x"), Err(StrandError::Unreadable { name: "depth".into(), text: "x".into() }));
    assert_eq!(params.set("depht", "1"), Err(StrandError::Unknown { name: "depht".into() }));
    params.set("inertia", " 0.75 ").unwrap();
    assert_eq!(params.inertia, 0.75);
    for preset in [StrandParams::ASPHALT, StrandParams::MARBLE, StrandParams::SAND, StrandParams::DEFAULT] {
        assert_eq!(preset.validate(), Ok(()));
    }
}
