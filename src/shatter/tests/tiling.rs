//! Shards tile the surface, whatever it was cut along.

use super::*;

#[test]
fn random_lines_tile() {
    let mut rng = Rng::new(21);
    let (mut shards_in_all, mut holes, mut carried) = (0, 0, 0);
    for i in 0..10_000 {
        let (cuts, params) = (random_cuts(&mut rng), random_params(&mut rng));
        let shards = shatter(cuts.clone(), &params).unwrap();
        check_tiling(&shards);
        assert!(shards.len() <= params.max_shards as usize);
        if shards.len() > 1 {
            assert!(shards.iter().all(|shard| shard.area > 0.999 * params.min_area));
        }
        if i % 20 == 0 {
            check_meshes(&shards, &mut rng);
        }
        shards_in_all += shards.len();
        holes += (0..shards.len() as u32).map(|shard| shards.holes(shard).count()).sum::<usize>();
        carried += shards.extended_lines().len();
    }
    assert!(shards_in_all > 50_000 && holes > 100 && carried > 1000, "{shards_in_all} {holes} {carried}");
}

#[test]
fn presets_tile() {
    for name in CrackPreset::NAMES {
        for seed in 0..4 {
            let network = grown(&CrackPreset::named(name).unwrap(), 1 + seed as u32 % 3, seed);
            let cuts = Cuts::from_network(&network).unwrap();
            for extend_cracks in [false, true] {
                let shards =
                    shatter(cuts.clone(), &ShatterParams { extend_cracks, seed, ..ShatterParams::DEFAULT }).unwrap();
                check_tiling(&shards);
                if seed == 0 {
                    check_meshes(&shards, &mut Rng::new(1));
                }
            }
        }
    }
}

#[test]
fn degenerate_lines_are_survived() {
    let corner = Vec2::new(1.0, 1.0);
    let cases: [(&str, &[&[Vec2]], usize); 9] = [
        ("nothing", &[], 1),
        ("a point", &[&[Vec2::splat(0.5)], &[Vec2::splat(0.25), Vec2::splat(0.25)]], 1),
        ("along the border", &[&[Vec2::ZERO, Vec2::X, corner]], 1),
        ("off the surface", &[&[Vec2::new(-5.0, -5.0), Vec2::new(9.0, -1.0)]], 1),
        ("a diagonal twice", &[&[Vec2::ZERO, corner], &[corner, Vec2::ZERO]], 2),
        ("a way and back", &[&[Vec2::new(0.5, 0.0), Vec2::new(0.5, 0.9), Vec2::new(0.5, 0.0)]], 1),
        ("zero area", &[&[Vec2::splat(0.2), Vec2::splat(0.4), Vec2::splat(0.3), Vec2::splat(0.2)]], 1),
        (
            "a bow tie",
            &[&[Vec2::splat(0.2), Vec2::splat(0.8), Vec2::new(0.8, 0.2), Vec2::new(0.2, 0.8), Vec2::splat(0.2)]],
            3,
        ),
        (
            "a speck",
            &[&[Vec2::splat(0.5), Vec2::new(0.5 + 1e-7, 0.5), Vec2::new(0.5, 0.5 + 1e-7), Vec2::splat(0.5)]],
            2,
        ),
    ];
    for (name, lines, pieces) in cases {
        let mut cuts = Cuts::new(Vec2::ONE).unwrap();
        for line in lines {
            cuts.add_line(line).unwrap();
        }
        let shards = shatter(cuts.clone(), &EVERYTHING).unwrap();
        check_tiling(&shards);
        assert_eq!(shards.len(), pieces, "{name}");
        let whole =
            shatter(cuts.clone(), &ShatterParams { extend_cracks: true, max_shards: 1, ..ShatterParams::DEFAULT })
                .unwrap();
        assert_eq!(whole.len(), 1);
        check_tiling(&whole);
    }
    // One texel, a ribbon, a giant and a dwarf.
    for extent in [Vec2::splat(1e-3), Vec2::new(64.0, 1.0), Vec2::splat(1e30), Vec2::splat(1e-30)] {
        let mut cuts = Cuts::new(extent).unwrap();
        cuts.add_line(&[Vec2::ZERO, extent]).unwrap();
        let shards = shatter(cuts.clone(), &EVERYTHING).unwrap();
        assert_eq!(shards.len(), 2);
        check_pieces_count(&shards);
    }
}

fn check_pieces_count(shards: &Shards) {
    let [w, h] = shards.lattice.corner.map(i64::from);
    let sum: i64 = (0..shards.len() as u32).map(|shard| twice_area(shards, shards.outline(shard))).sum();
    assert_eq!(sum, 2 * w * h);
}

#[test]
fn what_is_not_a_number_is_refused() {
    for extent in [Vec2::ZERO, Vec2::NAN, Vec2::INFINITY, Vec2::new(1.0, -1.0), Vec2::new(1e-9, 1.0)] {
        assert!(matches!(Cuts::new(extent), Err(ShatterError::Extent { .. })));
    }
    let mut cuts = Cuts::new(Vec2::ONE).unwrap();
    assert_eq!(cuts.add_line(&[Vec2::ZERO, Vec2::NAN]), Err(ShatterError::NotFinite { index: 1 }));
    assert_eq!(cuts.add_line(&[Vec2::INFINITY, Vec2::ZERO]), Err(ShatterError::NotFinite { index: 0 }));
    cuts.add_line(&[Vec2::MAX, Vec2::MIN]).unwrap();
    let shards = shatter(cuts.clone(), &EVERYTHING).unwrap();
    check_tiling(&shards);
    for min_area in [f32::NAN, -1.0, f32::INFINITY] {
        assert!(shatter(cuts.clone(), &ShatterParams { min_area, ..EVERYTHING }).is_err());
    }
    assert!(shatter(cuts.clone(), &ShatterParams { max_shards: 0, ..EVERYTHING }).is_err());
    let mut support = Support::new(&shards, Anchor::Border);
    assert!(support.hit(&shards, Vec2::NAN, 0.1).is_err() && support.hit(&shards, Vec2::ONE, f32::NAN).is_err());
    assert!(shards.break_again(0, f32::NAN, 0).is_err() && shards.break_again(77, 0.1, 0).is_err());
    assert!(
        Burst::new(BurstParams { drag: f32::NAN, ..BurstParams::DEFAULT }, Vec2::ZERO, Vec3::ZERO, 1.0, 0).is_err()
    );
    assert!(Burst::new(BurstParams::DEFAULT, Vec2::NAN, Vec3::ZERO, 1.0, 0).is_err());
}

/// The documented limits themselves are allowed, though 1e-6 is not what it seems in single precision.
#[test]
fn limits_of_ranges_are_allowed() {
    let whole = shatter(Cuts::new(Vec2::ONE).unwrap(), &EVERYTHING).unwrap();
    assert!(whole.break_again(0, 4096.0, 0).is_ok());
    assert!(whole.break_again(0, 9e-7, 0).is_err());
    let finest = SizeClasses { largest: [1e-6, 1e-6, 4096.0] };
    let (most, least) = (BreakAgain { after: 600.0, apart: 100.0, ..BreakAgain::DEFAULT }, 0.01);
    assert_eq!(most.validate(), Ok(()));
    assert_eq!(BreakAgain { after: least, apart: 0.0, classes: finest }.validate(), Ok(()));
}

/// Every open end is carried on: nothing that was drawn is left out of the outlines, but for what was too small.
#[test]
fn open_cracks_are_carried_on() {
    let mut cuts = Cuts::new(Vec2::ONE).unwrap();
    cuts.add_line(&[Vec2::new(0.2, 0.5), Vec2::new(0.6, 0.5)]).unwrap();
    assert_eq!(shatter(cuts.clone(), &EVERYTHING).unwrap().len(), 1);
    let shards = shatter(cuts.clone(), &ShatterParams { extend_cracks: true, ..EVERYTHING }).unwrap();
    assert_eq!((shards.len(), shards.extended_lines().len()), (2, 2));
    check_tiling(&shards);

    let mut rng = Rng::new(22);
    for _ in 0..200 {
        let network = planar_network(30, Vec2::ONE, &mut rng);
        let cuts = Cuts::from_network(&network).unwrap();
        let mut drawing = cuts.drawing.clone();
        drawing.make_planar();
        drawing.extend_cracks(1);
        let mut degree = vec![0; drawing.places.len()];
        drawing.edges.iter().flatten().for_each(|&end| degree[end as usize] += 1);
        let on_border = |place| drawing.lattice.sides(place).contains(&true);
        for (&place, degree) in drawing.places.iter().zip(degree) {
            assert!(degree != 1 || on_border(place), "the crack at {place:?} ends nowhere");
        }
    }
}

#[test]
fn the_shard_at_a_place_is_the_only_one() {
    let mut rng = Rng::new(23);
    for _ in 0..100 {
        let shards = shatter(random_cuts(&mut rng), &EVERYTHING).unwrap();
        for _ in 0..20 {
            let place = Vec2::new(rng.unit(), rng.unit()) * shards.extent();
            let around: Vec<u32> = (0..shards.len() as u32).filter(|&shard| shards.contains(shard, place)).collect();
            assert_eq!(around.len(), 1);
            assert_eq!(shards.at(place), Some(around[0]));
            assert_eq!(shards.distance(around[0], place), 0.0);
        }
        for shard in 0..shards.len() as u32 {
            // A splinter may be thinner than single precision can tell.
            assert!(shards.contains_place(shard, shards.inner_place(shard).unwrap()));
        }
        assert_eq!(shards.at(Vec2::splat(-0.1)), None);
        assert!(shards.at(shards.extent()).is_some() && shards.at(Vec2::NAN).is_none());
    }
}

/// Two ways to the same cells: found one by one as they close, and all at once.
#[test]
fn shards_are_the_closed_cells() {
    let mut rng = Rng::new(27);
    for _ in 0..300 {
        let network = planar_network(60, Vec2::new(2.0, 1.0), &mut rng);
        let mut tracker = CellTracker::new(network.extent());
        tracker.update(&network);
        let mut cuts = Cuts::new(network.extent()).unwrap();
        for segment in network.segments() {
            let (a, b) = network.ends(segment).unwrap();
            cuts.add_line(&[a, b].map(|node| network.nodes()[node as usize].pos)).unwrap();
        }
        let shards = shatter(cuts, &EVERYTHING).unwrap();
        assert_eq!(shards.len(), tracker.cells().len());
        let mut areas = [
            tracker.cells().iter().map(|cell| cell.area).collect::<Vec<f32>>(),
            shards.iter().map(|shard| shard.area).collect(),
        ];
        areas.iter_mut().for_each(|areas| areas.sort_by(f32::total_cmp));
        assert!(areas[0].iter().zip(&areas[1]).all(|(a, b)| (a - b).abs() < 1e-6));
        for number in 0..shards.len() as u32 {
            let cell = tracker.cell_at(shards.inner_point(number).unwrap()).unwrap();
            let centre = tracker.cells()[cell as usize].centroid;
            assert!(centre.distance(shards.get(number).unwrap().centroid) < 1e-4);
        }
    }
}

/// FNV-1a over the corners of all shards and the lines that were extended.
fn fingerprint(shards: &Shards) -> u64 {
    let rings = (0..shards.len() as u32).flat_map(|shard| shards.rings_of(shard));
    let corners = rings.flatten().flat_map(|&corner| shards.places[corner as usize]).map(|x| x as u32);
    let carried = shards.extended_lines().iter().flatten().flat_map(|pos| [pos.x.to_bits(), pos.y.to_bits()]);
    corners
        .chain(carried)
        .fold(0xCBF2_9CE4_8422_2325, |hash, word| (hash ^ u64::from(word)).wrapping_mul(0x100_0000_01B3))
}

/// Frozen: what a player has seen break must break the same way after an update. A change of them is a breaking one.
#[test]
fn shards_are_the_same_every_time() {
    const FROZEN: [u64; 14] = [
        0x1D63_0D63_BC15_674C,
        0x0FC6_987B_236B_A933,
        0xB78B_4079_D2C2_7B26,
        0xEDAB_2E4A_9EBA_CB86,
        0x17C5_6D93_EF82_AAFD,
        0xFC9C_2FF1_611E_C5E7,
        0xD312_A531_655E_4DC8,
        0x8055_239D_6BCB_0382,
        0x1B14_EAE0_E7E9_8DF2,
        0x67FD_1B6B_C7CF_4D04,
        0xEA29_A01D_47E0_95C9,
        0x7E50_9E9C_4181_A747,
        0xFABC_5402_D54B_2D31,
        0xCCDF_89E5_3EE6_6C96,
    ];
    let made = CrackPreset::NAMES.map(|name| {
        let network = grown(&CrackPreset::named(name).unwrap(), 2, 1);
        let params = ShatterParams { extend_cracks: true, ..ShatterParams::DEFAULT };
        let shards = shatter(Cuts::from_network(&network).unwrap(), &params).unwrap();
        assert!(shards.len() > 4, "{name}: {}", shards.len());
        fingerprint(&shards)
    });
    assert_eq!(made, FROZEN, "{made:#018X?}");
}

#[test]
fn crossings_are_cut_where_they_are() {
    let mut rng = Rng::new(26);
    for _ in 0..1000 {
        let mut cuts = random_cuts(&mut rng);
        cuts.drawing.make_planar();
        let edges: Vec<_> =
            cuts.drawing.edges.iter().map(|edge| edge.map(|v| cuts.drawing.places[v as usize])).collect();
        for (i, &[a, b]) in edges.iter().enumerate() {
            for &[c, d] in &edges[i + 1..] {
                let sides = [orient(a, b, c), orient(a, b, d), orient(c, d, a), orient(c, d, b)].map(i64::signum);
                assert!(sides[0] * sides[1] >= 0 || sides[2] * sides[3] >= 0, "{a:?} {b:?} cross {c:?} {d:?}");
                assert!(a != b && [a, b] != [c, d] && [a, b] != [d, c]);
            }
        }
    }
}
