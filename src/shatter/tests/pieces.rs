//! What is to be known of each shard, what holds it, and how it breaks again and flies.

use super::*;

#[test]
fn moments_equal_those_of_the_triangles() {
    let shards = shatter(Cuts::from_network(&grown(&CrackPreset::GLASS, 2, 9)).unwrap(), &EVERYTHING).unwrap();
    for (number, shard) in (0u32..).zip(shards.iter()) {
        let corners = shards.corners(number);
        let (mut area, mut first, mut second) = (0.0, glam::DVec2::ZERO, 0.0);
        for triangle in shards.triangles(number) {
            let [a, b, c] = triangle.map(|i| shards.positions()[corners[i as usize] as usize].as_dvec2());
            let part = 0.5 * (b - a).perp_dot(c - a);
            area += part;
            first += part * (a + b + c) / 3.0;
            // Exact for squares: the mean over the middles of the sides.
            second += part * [a + b, b + c, c + a].map(|sum| (0.5 * sum).length_squared()).iter().sum::<f64>() / 3.0;
        }
        let centroid = first / area;
        second -= area * centroid.length_squared();
        assert!((shard.centroid.as_dvec2() - centroid).length() < 1e-6, "{} {centroid}", shard.centroid);
        assert!(
            (f64::from(shard.second_moment) - second).abs() < 1e-5 * second + 1e-12,
            "{} {second}",
            shard.second_moment
        );
    }
}

#[test]
fn convex_pieces_fill_their_shard() {
    let shards =
        shatter(Cuts::from_network(&grown(&CrackPreset::CLAY, 1, 3)).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let area = |piece: &[Vec2]| -> f64 {
        (0..piece.len()).map(|i| 0.5 * piece[i].as_dvec2().perp_dot(piece[(i + 1) % piece.len()].as_dvec2())).sum()
    };
    let (mut exact_pieces, mut rough_pieces) = (0, 0);
    for (number, shard) in (0u32..).zip(shards.iter()) {
        let exact = shards.convex_pieces(number, 0.0);
        let rough = shards.convex_pieces(number, 0.004);
        for pieces in [&exact, &rough] {
            for piece in pieces {
                let n = piece.len();
                for i in 0..n {
                    let (a, b, c) = (piece[i], piece[(i + 1) % n], piece[(i + 2) % n]);
                    assert!((b - a).as_dvec2().perp_dot((c - b).as_dvec2()) > -1e-9, "a hollow corner");
                }
            }
        }
        let whole: f64 = exact.iter().map(|piece| area(piece)).sum();
        assert!((whole - f64::from(shard.area)).abs() < 1e-6, "{whole} {}", shard.area);
        let around: f32 = shards.neighbours(number).iter().map(|neighbour| neighbour.length).sum::<f32>()
            + shard.border.iter().sum::<f32>();
        let strayed: f64 = rough.iter().map(|piece| area(piece)).sum();
        assert!((strayed - f64::from(shard.area)).abs() < 0.004 * f64::from(around), "{strayed} {}", shard.area);
        exact_pieces += exact.len();
        rough_pieces += rough.len();
    }
    assert!(2 * rough_pieces < exact_pieces, "{rough_pieces} of {exact_pieces}");
    assert!(shards.convex_pieces(u32::MAX, 0.1).is_empty());
}

#[test]
fn what_no_anchor_holds_falls() {
    let mut rng = Rng::new(24);
    let mut fell = 0;
    for _ in 0..300 {
        let network = planar_network(60, Vec2::ONE, &mut rng);
        let params = ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT };
        let shards = shatter(Cuts::from_network(&network).unwrap(), &params).unwrap();
        let sides = [0; 4].map(|_| rng.unit() < 0.4);
        let mut support = Support::new(&shards, Anchor::Sides(sides));
        let held = |shard: u32| (0..4).any(|side| sides[side] && shards.get(shard).unwrap().border[side] > 0.0);
        for _ in 0..5 {
            let before = support.clone();
            let (at, reach) = (Vec2::new(rng.unit(), rng.unit()), 0.2 * rng.unit());
            let Fallen { hit, loose } = support.hit(&shards, at, reach).unwrap();
            for shard in 0..shards.len() as u32 {
                let distance = shards.distance(shard, at);
                let in_reach = distance <= if held(shard) { 0.0 } else { reach };
                assert_eq!(hit.contains(&shard), before.is_in_place(shard) && in_reach);
            }
            // By spreading until nothing changes.
            let there = |shard: u32| before.is_in_place(shard) && !hit.contains(&shard);
            let mut stays: Vec<bool> = (0..shards.len() as u32).map(|shard| there(shard) && held(shard)).collect();
            for _ in 0..shards.len() {
                for shard in 0..shards.len() as u32 {
                    let touches = shards.neighbours(shard).iter().any(|neighbour| stays[neighbour.shard as usize]);
                    stays[shard as usize] |= there(shard) && touches;
                }
            }
            for shard in 0..shards.len() as u32 {
                let falls = sides.contains(&true) && there(shard) && !stays[shard as usize];
                assert_eq!(loose.contains(&shard), falls);
                assert_eq!(support.is_in_place(shard), there(shard) && !falls);
            }
            fell += loose.len();
        }
        support.restore();
        assert_eq!(support, Support::new(&shards, Anchor::Sides(sides)));
    }
    assert!(fell > 100, "{fell}");
}

/// A second set of cracks runs through what is left; the hole stays.
#[test]
fn a_hole_stays_when_the_rest_cracks_further() {
    let mut rng = Rng::new(25);
    for _ in 0..100 {
        let mut cuts = random_cuts(&mut rng);
        let old = shatter(cuts.clone(), &EVERYTHING).unwrap();
        let mut support = Support::new(&old, Anchor::Nothing);
        let extent = old.extent();
        support.hit(&old, extent * 0.5, 0.2).unwrap();
        let hole: f32 = support.missing().map(|shard| old.get(shard).unwrap().area).sum();
        for _ in 0..5 {
            cuts.add_line(&[0, 1].map(|_| Vec2::new(rng.unit(), rng.unit()) * extent)).unwrap();
        }
        let new = shatter(cuts.clone(), &EVERYTHING).unwrap();
        let renewed = support.after_new_cracks(&old, &new, Anchor::Nothing);
        let after: f32 = renewed.missing().map(|shard| new.get(shard).unwrap().area).sum();
        assert!((after - hole).abs() < 1e-5 * extent.element_product(), "{hole} {after}");
    }
}

#[test]
fn pieces_break_again_by_size() {
    let shards =
        shatter(Cuts::from_network(&grown(&CrackPreset::CLAY, 2, 1)).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let classes = SizeClasses::DEFAULT;
    assert_eq!([1e-4, 0.002, 0.01, 0.5].map(|area| classes.class(area)), [0, 1, 2, 3]);
    let mut broken = 0;
    for (number, shard) in (0u32..).zip(shards.iter()) {
        let Some(largest) = classes.next(shard.area) else { continue };
        let pieces = shards.break_again(number, largest, 4).unwrap();
        assert_eq!(pieces, shards.break_again(number, largest, 4).unwrap());
        assert!(pieces.len() > 1);
        check_pieces(&pieces);
        let sum: f32 = pieces.iter().map(|piece| piece.area).sum();
        assert!((sum - shard.area).abs() < 1e-5 * shard.area + 1e-7, "{sum} {}", shard.area);
        for (i, piece) in (0u32..).zip(pieces.iter()) {
            assert!(piece.area <= largest && classes.class(piece.area) < classes.class(shard.area));
            assert!(shards.contains(number, pieces.inner_point(i).unwrap()));
        }
        broken += pieces.len();
    }
    assert!(broken > 20, "{broken}");
}

/// The flight solves `v' = g - drag v`, whatever the drag, and does not depend on how its time came about.
#[test]
fn flights_obey_their_forces() {
    let shards =
        shatter(Cuts::from_network(&grown(&CrackPreset::GLASS, 1, 2)).unwrap(), &ShatterParams::DEFAULT).unwrap();
    for drag in [0.0, 0.0009, 0.0011, 0.5, 20.0] {
        let params = BurstParams { drag, ..BurstParams::DEFAULT };
        let burst = Burst::new(params, Vec2::new(0.7, 0.5), Vec3::new(0.3, 0.0, -1.0), 2.0, 8).unwrap();
        for (number, shard) in (0u32..).zip(shards.iter()).take(40) {
            for flight in [burst.flight(number, shard), burst.fall(number, shard)] {
                assert_eq!(flight.pose(flight.delay), Pose::AT_REST);
                assert_eq!(flight.pose(flight.end() + 1.0).opacity, 0.0);
                // Fourth-order steps of the equation of motion.
                let force = |velocity: glam::DVec3| params.gravity.extend(0.0).as_dvec3() - f64::from(drag) * velocity;
                let (mut offset, mut velocity, step) = (glam::DVec3::ZERO, flight.velocity.as_dvec3(), 0.002);
                for k in 1..=500 {
                    let k1 = force(velocity);
                    let k2 = force(velocity + 0.5 * step * k1);
                    let k3 = force(velocity + 0.5 * step * k2);
                    let k4 = force(velocity + step * k3);
                    offset += step * (velocity + step / 6.0 * (k1 + k2 + k3));
                    velocity += step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                    if k % 100 == 0 {
                        let pose = flight.pose(flight.delay + (f64::from(k) * step) as f32);
                        let error = (pose.offset.as_dvec3() - offset).length();
                        assert!(error < 1e-3 * (1.0 + offset.length()), "{error} at {k} with drag {drag}");
                        assert!(pose.rotation.is_normalized() && (0.0..=1.0).contains(&pose.opacity));
                    }
                }
            }
        }
    }
}

#[test]
fn pieces_near_the_hit_leave_first_and_fastest() {
    let mut cuts = Cuts::new(Vec2::ONE).unwrap();
    for i in 1..8 {
        let x = i as f32 / 8.0;
        cuts.add_line(&[Vec2::new(x, 0.0), Vec2::new(x, 1.0)]).unwrap();
    }
    let shards = shatter(cuts.clone(), &EVERYTHING).unwrap();
    let params = BurstParams { scatter: 0.0, ..BurstParams::DEFAULT };
    let burst = Burst::new(params, Vec2::new(0.0, 0.5), Vec3::ZERO, 1.0, 0).unwrap();
    let mut flights: Vec<(f32, Flight)> =
        (0u32..).zip(shards.iter()).map(|(i, shard)| (shard.centroid.x, burst.flight(i, shard))).collect();
    flights.sort_by(|a, b| a.0.total_cmp(&b.0));
    for pair in flights.windows(2) {
        assert!(pair[0].1.delay < pair[1].1.delay);
    }
    assert!(flights[0].1.velocity.length() > 2.0 * flights[7].1.velocity.length());
}

/// A fragment begins as the part of its piece that it was: same place, same velocity, whatever the piece did until then.
#[test]
fn fragments_go_on_from_where_they_were() {
    let shards =
        shatter(Cuts::from_network(&grown(&CrackPreset::CLAY, 2, 1)).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let burst = Burst::new(BurstParams::DEFAULT, Vec2::new(0.7, 0.5), Vec3::new(0.3, 0.0, -1.0), 2.0, 8).unwrap();
    let mut checked = 0;
    for (number, shard) in (0u32..).zip(shards.iter()) {
        let Some(largest) = SizeClasses::DEFAULT.next(shard.area) else { continue };
        let flight = burst.flight(number, shard);
        let at = flight.delay + 0.6;
        // Where the part of the piece is whose place in the surface is `way` from the piece's.
        let part = |way: Vec2, seconds: f32| {
            let pose = flight.pose(seconds);
            pose.offset + pose.rotation * Vec3::new(way.x, -way.y, 0.0) - Vec3::new(way.x, -way.y, 0.0)
        };
        for (i, piece) in (0u64..).zip(shards.break_again(number, largest, 1).unwrap().iter()) {
            let way = piece.centroid - shard.centroid;
            let fragment = flight.fragment(at, shard, piece, 0.0, i);
            let begin = fragment.pose(at);
            assert!((begin.offset - part(way, at)).length() < 1e-5, "{begin:?}");
            assert_eq!((begin.rotation, fragment.pose(at - 9.0)), (flight.pose(at).rotation, begin));
            let step = 1e-3;
            let expected = (part(way, at + step) - part(way, at - step)) / (2.0 * step);
            assert!((fragment.velocity - expected).length() < 2e-2 * (1.0 + expected.length()), "{expected}");
            assert!((fragment.end() - flight.end()).abs() < 1e-4, "it fades with the rest");
            let apart = flight.fragment(at, shard, piece, 0.5, i).velocity - fragment.velocity;
            assert!(apart.dot(flight.pose(at).rotation * Vec3::new(way.x, -way.y, 0.0)) > 0.0, "away from the middle");
            checked += 1;
        }
    }
    assert!(checked > 20, "{checked}");
}

#[test]
fn large_pieces_are_due_to_break_and_splinters_are_not() {
    let again = BreakAgain { after: 3.0, ..BreakAgain::DEFAULT };
    let due: Vec<f32> = (0..50).filter_map(|seed| again.due(0.02, seed)).collect();
    assert!(due.len() == 50 && due.iter().all(|due| (2.0..=4.0).contains(due)));
    assert!(due.iter().any(|one| (one - due[0]).abs() > 0.5), "not all at once");
    assert_eq!(again.due(0.0009, 1), None);
    assert_eq!(again.validate(), Ok(()));
    for broken in [
        BreakAgain { after: 0.0, ..again },
        BreakAgain { apart: f32::NAN, ..again },
        BreakAgain { classes: SizeClasses { largest: [0.0, 1.0, 2.0] }, ..again },
    ] {
        assert!(broken.validate().is_err());
    }
}

/// A bevel moves nothing that can be seen but its own colours: the same outline, filled once, with the same picture.
#[test]
fn rims_fill_their_shard_and_show_the_same_picture() {
    let mut rng = Rng::new(28);
    let (mut inner_area, mut whole_area) = (0.0, 0.0);
    for i in 0..400 {
        let shards = if i < 390 {
            shatter(random_cuts(&mut rng), &random_params(&mut rng)).unwrap()
        } else {
            let network =
                grown(&CrackPreset::named(CrackPreset::NAMES[i % CrackPreset::NAMES.len()]).unwrap(), 1, i as u64);
            shatter(Cuts::from_network(&network).unwrap(), &ShatterParams::DEFAULT).unwrap()
        };
        let width = [0.001, 0.01, 0.1][i % 3];
        let rim = RimLook { width, bright: 0.5, relief: 0.5, shift: 0.0 };
        let frame = MeshFrame { centred: false, rim, ..MeshFrame::new(shards.extent()) };
        for (number, shard) in (0u32..).zip(shards.iter()) {
            let (mesh, corners) = (shards.flat_mesh(number, &frame), shards.corners(number));
            assert_eq!([mesh.positions.len(), mesh.colors.len(), mesh.normals.len()], [2 * corners.len(); 3]);
            let plain = shards.flat_mesh(number, &MeshFrame { rim: RimLook::PLAIN, ..frame });
            assert_eq!(mesh.positions[..corners.len()], plain.positions, "the outline stays");
            let mut free = BTreeMap::<_, i32>::new();
            let (mut area, bits) = (0.0, |i: u32| mesh.positions[i as usize].map(f32::to_bits));
            for (k, triangle) in mesh.indices.as_chunks::<3>().0.iter().enumerate() {
                let [a, b, c] = triangle.map(|i| Vec3::from(mesh.positions[i as usize]).as_dvec3().truncate());
                let part = 0.5 * (b - a).perp_dot(c - a);
                // To the rounding of the places.
                assert!(part > -1e-7 * f64::from(shards.extent().max_element()), "folded: {part}");
                area += part;
                inner_area += if k < shards.triangles(number).len() { part } else { 0.0 };
                for [a, b] in [[0, 1], [1, 2], [2, 0]].map(|edge| edge.map(|k| bits(triangle[k]))) {
                    *free.entry((a, b)).or_default() += 1;
                    *free.entry((b, a)).or_default() -= 1;
                }
            }
            whole_area += f64::from(shard.area);
            assert!(
                (area - f64::from(shard.area)).abs() < 1e-4 * f64::from(shard.area) + 1e-6,
                "{area} {}",
                shard.area
            );
            let open = free.values().filter(|&&count| count > 0).count();
            assert!(open <= corners.len(), "torn: {open} of {}", corners.len());
            for (pos, uv) in mesh.positions.iter().zip(&mesh.uvs) {
                let shown = (Vec2::from(*uv) - 0.5) * shards.extent();
                assert!((shown - Vec2::new(pos[0], -pos[1])).length() < 1e-5 * shards.extent().max_element());
            }
            let lit = mesh.colors.iter().take(corners.len()).all(|color| color[0] > 0.9 && color[3] == 1.5);
            assert!(lit && mesh.colors[corners.len()..].iter().all(|color| *color == [1.0; 4]));
        }
    }
    assert!((0.3..0.95).contains(&(inner_area / whole_area)), "{inner_area} of {whole_area}");
}

#[test]
fn pictures_are_shifted_within_the_surface() {
    let shards =
        shatter(Cuts::from_network(&grown(&CrackPreset::GLASS, 2, 3)).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let rim = RimLook { shift: 0.01, ..RimLook::PLAIN };
    let (plain, uv) = (MeshFrame::new(Vec2::ONE), [Vec2::new(0.25, 0.5), Vec2::new(0.5, 1.0)]);
    let mut ways = BTreeSet::new();
    for number in 0..shards.len() as u32 {
        let [before, after] = [RimLook::PLAIN, rim]
            .map(|rim| shards.flat_mesh(number, &MeshFrame { uv, rim, ..plain }).uvs.into_iter().map(Vec2::from));
        let shifts: Vec<Vec2> =
            after.clone().zip(before).map(|(after, before)| (after - before) * Vec2::new(6.0, 2.0)).collect();
        assert!(after.into_iter().all(|at| at.cmpge(uv[0] - 1e-6).all() && at.cmple(uv[1] + 1e-6).all()));
        assert!(shifts.iter().all(|shift| shift.distance(shifts[0]) < 1e-5), "the whole picture");
        assert!(shifts[0].length() < 0.01001);
        ways.insert((shifts[0] * 1e4).round().as_ivec2().to_array());
    }
    assert!(2 * ways.len() > shards.len(), "{} ways in {}", ways.len(), shards.len());
}

/// The closed form against a piece that is moved in ten thousand small steps; then it rests, for good, and its fragments do.
#[test]
fn pieces_come_to_rest_on_the_floor() {
    let shards = shatter(Cuts::from_network(&grown(&CrackPreset::GLASS, 2, 4)).unwrap(), &EVERYTHING).unwrap();
    let (mut landed, mut never) = (0, 0);
    for case in 0..40u64 {
        let mut rng = Rng::new(case).stream("floor");
        let up = Vec3::new(0.4 * rng.signed(), 1.0, 0.4 * rng.signed()) * rng.range(0.5, 2.0);
        let lies_flat = rng.unit() < 0.5;
        let floor = Floor { up, height: rng.range(-3.0, 0.3) * up.length(), clearance: 0.01, depth: 0.0, lies_flat };
        let params = BurstParams { fade_after: 100.0, drag: rng.range(0.0, 2.0), ..BurstParams::DEFAULT };
        let burst = Burst::new(params, Vec2::splat(0.5), Vec3::ZERO, 1.0, case).unwrap().with_floor(floor).unwrap();
        let gravity = params.gravity.extend(0.0);
        for (number, shard) in (0u32..).zip(shards.iter()).step_by(5) {
            let flight = burst.flight(number, shard);
            let start = Vec3::new(shard.centroid.x, -shard.centroid.y, 0.0);
            let size = if lies_flat { floor.clearance } else { 0.5 * shard.area.sqrt() };
            let above = |offset: Vec3| (up.dot(start + offset) - floor.height) / up.length() - size;
            // A step after the other.
            let (step, mut offset, mut velocity) = (1e-3, Vec3::ZERO, flight.velocity);
            let mut time = 0.0;
            while above(offset) > 0.0 && time < 10.0 {
                velocity += step * 0.5 * (gravity - params.drag * velocity);
                offset += step * velocity;
                velocity += step * 0.5 * (gravity - params.drag * velocity);
                time += step;
            }
            if above(Vec3::ZERO) < -size {
                assert!(above(flight.pose(5.0).offset) < above(Vec3::ZERO), "what begins below the floor falls");
                never += 1;
                continue;
            }
            let at = flight.pose(flight.delay + time);
            assert!(at.offset.distance(offset) < 0.02 * (1.0 + velocity.length()), "{case} {number}: {time}");
            let poses = [20.0, 21.0].map(|seconds| flight.pose(seconds));
            assert!(above(poses[0].offset).abs() < 1e-4, "{case} {number}: {}", above(poses[0].offset));
            assert!(poses[0].offset.distance(poses[1].offset) < 1e-4);
            for seconds in 0..200 {
                let pose = flight.pose(0.05 * seconds as f32);
                assert!(above(pose.offset) > (above(Vec3::ZERO)).min(0.0) - 1e-3, "never below it");
            }
            let face = poses[1].rotation * Vec3::Z;
            let lie = if lies_flat { up.normalize() } else { Vec3::Z };
            assert!(face.dot(lie).abs() > 0.9999, "{face}");
            let fragment = flight.fragment(0.8, shard, shard, 0.3, 3).pose(30.0).offset;
            assert!(above(fragment).abs() < 1e-3 || above(fragment) < -size, "{}", above(fragment));
            landed += 1;
        }
    }
    assert!(landed > 200 && never > 5, "{landed} landed, {never} began below");
}

#[test]
fn floors_that_are_none_are_refused() {
    let burst = Burst::new(BurstParams::DEFAULT, Vec2::ZERO, Vec3::ZERO, 1.0, 1).unwrap();
    let good = Floor { up: Vec3::Y, height: -2.0, clearance: 0.0, depth: 0.0, lies_flat: true };
    assert!(burst.clone().with_floor(good).is_ok());
    for bad in [
        Floor { up: Vec3::ZERO, ..good },
        Floor { up: Vec3::NAN, ..good },
        Floor { height: f32::INFINITY, ..good },
        Floor { clearance: -1.0, ..good },
        Floor { depth: f32::NAN, ..good },
    ] {
        assert!(burst.clone().with_floor(bad).is_err(), "{bad:?}");
    }
    // Nothing pulls pieces down: they fly for ever.
    let shards = shatter(Cuts::new(Vec2::ONE).unwrap(), &EVERYTHING).unwrap();
    let floats = burst.with_gravity(Vec3::ZERO).with_floor(good).unwrap();
    let flight = floats.flight(0, shards.get(0).unwrap());
    assert!(flight.pose(100.0).offset.y > -2.0);
}

#[test]
fn pictures_on_sides_are_as_long_as_the_sides() {
    let shards =
        shatter(Cuts::from_network(&grown(&CrackPreset::CLAY, 2, 5)).unwrap(), &ShatterParams::DEFAULT).unwrap();
    let thickness = 9.0;
    for rim in [RimLook::PLAIN, RimLook::GLASS] {
        let frame = MeshFrame { rim, ..MeshFrame::new(200.0 * shards.extent()) };
        let mut depth = 0.0f32;
        for number in 0..shards.len() as u32 {
            let mesh = shards.solid_mesh(number, &frame, thickness);
            let place = |vertex: u32| Vec3::from_array(mesh.positions[vertex as usize]);
            let uv = |vertex: u32| Vec2::from_array(mesh.uvs[vertex as usize]);
            for triangle in mesh.indices[mesh.sides..].as_chunks::<3>().0 {
                for (&a, &b) in triangle.iter().zip(triangle.iter().cycle().skip(1)) {
                    let (length, far) = (uv(a).distance(uv(b)), place(a).distance(place(b)));
                    assert!((length - far).abs() < 1e-2, "shard {number}: {length} for {far}");
                    depth = depth.max(uv(a).y);
                    assert!((uv(a).y == 0.0) == (place(a).z > 0.0), "shard {number}: v runs from the front");
                }
            }
        }
        assert!(depth <= thickness && (depth == thickness) == (rim == RimLook::PLAIN), "{depth}");
    }
}
