//! Hostile input: errors that say what is wrong, and repairs.

use super::{
    super::{ContourJob, Contours, Join, MAX_LEVEL_POINTS, Method, ReliefError, ReliefParams, Ring, outlines},
    oracle::{assert_contours, is_inside},
    shapes::{KINDS, count, shape},
};
use crate::{Grid, math::Rng};
use glam::{UVec2, Vec2};

fn square(low: f32, high: f32) -> Vec<Vec2> {
    [[low, low], [high, low], [high, high], [low, high]].map(Vec2::from_array).into()
}

const SIMPLE: ReliefParams = ReliefParams { distance: 0.1, ..ReliefParams::SIMPLE };

fn error(params: &ReliefParams, seeds: &[Vec<Vec2>]) -> ReliefError {
    Contours::generate(params, seeds, 1).unwrap_err()
}

fn area(contours: &Contours, level: i32) -> f64 {
    contours.level(level).map(|ring| ring.signed_area()).sum()
}

#[test]
fn too_little_is_an_error() {
    assert!(matches!(error(&SIMPLE, &[]), ReliefError::Contours { contours: 0, .. }));
    assert_eq!(error(&SIMPLE, &[square(0.0, 1.0), vec![]]), ReliefError::TooFewPoints { contour: 1, points: 0 });
    assert_eq!(error(&SIMPLE, &[square(0.0, 1.0)[..2].to_vec()]), ReliefError::TooFewPoints { contour: 0, points: 2 });
    assert_eq!(error(&SIMPLE, &[vec![Vec2::ONE; 9]]), ReliefError::NoArea);
    assert_eq!(error(&SIMPLE, &[vec![Vec2::ZERO, Vec2::ONE, Vec2::new(0.5, 0.5)]]), ReliefError::NoArea);
    assert_eq!(error(&SIMPLE, &[square(0.0, 1e-9)]), ReliefError::NoArea);
}

#[test]
fn too_much_is_an_error() {
    for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.1e6, f32::MAX] {
        let mut seed = square(0.0, 1.0);
        seed[2].y = odd;
        assert!(matches!(error(&SIMPLE, &[seed]), ReliefError::Point { contour: 0, point: 2, .. }), "{odd}");
    }
    let long = vec![Vec2::ONE; MAX_LEVEL_POINTS + 1];
    assert_eq!(error(&SIMPLE, &[long]), ReliefError::TooManyPoints { most: MAX_LEVEL_POINTS });
    // All crossing all others.
    let mut rng = Rng::new(3);
    let tangle = (0..2500).map(|_| Vec2::new(rng.unit(), rng.unit())).collect();
    assert_eq!(error(&SIMPLE, &[tangle]), ReliefError::Tangled { level: 0 });
}

#[test]
fn parameters_out_of_range_are_errors() {
    let seeds = [square(0.0, 1.0)];
    let bad = |params: ReliefParams| error(&params, &seeds).to_string();
    for distance in [0.0, -0.1, f32::NAN, f32::INFINITY] {
        assert!(bad(ReliefParams { distance, ..SIMPLE }).starts_with("`distance` is"));
    }
    assert_eq!(
        bad(ReliefParams { distance: 2e-6, ..SIMPLE }),
        "the distance is 0.000002, must not be below 0.0000076293945 for contours of this size at this place"
    );
    assert_eq!(
        bad(ReliefParams { first_harmonic: 600, ..SIMPLE }),
        "`first_harmonic` is 600, must not be above 512, half the number of samples"
    );
    assert_eq!(bad(ReliefParams { first_harmonic: 0, ..SIMPLE }), "`first_harmonic` is 0, must lie in 1..=8192");
    assert_eq!(bad(ReliefParams { samples: 1000, ..SIMPLE }), "`samples` is 1000, must be a power of two");
    assert_eq!(bad(ReliefParams { samples: 8, ..SIMPLE }), "`samples` is 8, must lie in 16..=16384");
    assert_eq!(
        bad(ReliefParams { min_angle: 1.0, max_angle: 0.5, ..SIMPLE }),
        "`min_angle` is 1, must not be above `max_angle`, which is 0.5"
    );
    let join = Join::Arc { factor: f32::NAN };
    assert_eq!(bad(ReliefParams { join, ..SIMPLE }), "`factor` is NaN, must lie in 1..=16");
    assert_eq!(bad(ReliefParams { steepness: 0.9, ..SIMPLE }), "`steepness` is 0.9, must lie in 0..=0.8");
}

#[test]
fn parameters_are_set_from_text() {
    let mut params = ReliefParams::DEFAULT;
    for (name, text) in [("method", "fourier"), ("join", "bevel"), ("distance", "0.5"), ("inward", "7")] {
        params.set(name, text).unwrap();
    }
    let expected = ReliefParams { join: Join::Bevel, distance: 0.5, inward: 7, ..ReliefParams::DEFAULT };
    assert_eq!(params, ReliefParams { method: Method::Fourier, ..expected });
    let unreadable = |name: &str, text: &str| ReliefError::Unreadable { name: name.into(), text: text.into() };
    assert_eq!(params.set("method", "best"), Err(unreadable("method", "best")));
    assert_eq!(params.set("samples", "-1"), Err(unreadable("samples", "-1")));
    assert_eq!(params.set("speed", "1"), Err(ReliefError::Unknown { name: "speed".into() }));
    assert!(matches!(params.set("factor", "0.5"), Err(ReliefError::OutOfRange { name: "factor", .. })));
    assert_eq!(params.join, Join::Bevel);
}

#[test]
fn directions_starts_and_repeated_points_do_not_matter() {
    let line = shape(0, 200, &mut Rng::new(5));
    let usual = Contours::generate(&SIMPLE, std::slice::from_ref(&line), 1).unwrap();
    let doubled: Vec<Vec2> = line.iter().flat_map(|&point| [point; 3]).collect();
    assert_eq!(Contours::generate(&SIMPLE, &[doubled], 1).unwrap(), usual);
    let mut variants = [line.clone(), line.clone()];
    variants[0].reverse();
    variants[1].rotate_left(77);
    for variant in variants {
        let same = Contours::generate(&SIMPLE, &[variant], 1).unwrap();
        assert_eq!(same.levels(), usual.levels());
        for level in 0..=2 {
            assert!((area(&same, level) - area(&usual, level)).abs() < 1e-6, "level {level}");
        }
    }
}

#[test]
fn crossing_lines_enclose_one_region() {
    // A five-pointed star drawn in one go, with its middle.
    let tip = |i: u32| Vec2::from_angle(std::f32::consts::TAU * (0.4 * i as f32 + 0.05));
    let star = Contours::generate(&SIMPLE, &[(0..5).map(tip).collect()], 1).unwrap();
    assert_eq!(star.level(0).count(), 1);
    assert_eq!(star.level(0).next().unwrap().points.len(), 10);
    // Two halves of a figure eight, both inside.
    let eight = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]].map(Vec2::from_array).to_vec();
    let eight = Contours::generate(&SIMPLE, &[eight], 1).unwrap();
    assert_eq!(eight.level(0).count(), 2);
    assert!((area(&eight, 0) - 0.5).abs() < 1e-6);
}

#[test]
fn overlapping_seeds_are_one_region_and_opposite_ones_leave_holes() {
    let mut hole = square(0.4, 0.6);
    let both = Contours::generate(&SIMPLE, &[square(0.0, 1.0), hole.clone()], 1).unwrap();
    assert!((area(&both, 0) - 1.0).abs() < 1e-6);
    hole.reverse();
    let ring = Contours::generate(&SIMPLE, &[square(0.0, 1.0), hole], 1).unwrap();
    assert!((area(&ring, 0) - 0.96).abs() < 1e-6);
    assert_eq!(ring.level(1).filter(|ring| ring.is_hole()).count(), 1);
    assert_contours(&ring, 0.07, "a square with a hole");
}

#[test]
fn sizes_and_places_scale() {
    let seed = shape(1, 100, &mut Rng::new(9));
    let usual = Contours::generate(
        &ReliefParams { distance: 0.03125, ..ReliefParams::DEFAULT },
        std::slice::from_ref(&seed),
        4,
    );
    let usual = usual.unwrap();
    for scale in [1.0 / 1024.0, 1024.0, 262_144.0] {
        let params = ReliefParams { distance: 0.03125 * scale, ..ReliefParams::DEFAULT };
        let large = Contours::generate(&params, &[seed.iter().map(|point| *point * scale).collect()], 4).unwrap();
        let back = large.rings.iter().flat_map(|ring| &ring.points).map(|point| *point / scale);
        assert!(back.eq(usual.rings.iter().flat_map(|ring| ring.points.iter().copied())), "scale {scale}");
    }
    // Far away the lattice is coarse, and says so.
    let far = square(999_999.0, 1_000_000.0);
    assert!(matches!(error(&SIMPLE, std::slice::from_ref(&far)), ReliefError::Distance { least: 4.0.., .. }));
    let large = Contours::generate(&ReliefParams { distance: 20_000.0, ..SIMPLE }, &[square(-1e6, 1e6)], 1).unwrap();
    assert_eq!(large.levels(), Some((0, 49)));
}

#[test]
fn images_of_factors_and_heights_are_checked() {
    let seeds = [square(0.0, 1.0)];
    let job =
        |factors: Grid<f32>, extent: Vec2| ContourJob::with_factors(&SIMPLE, &seeds, 1, factors, extent).map(drop);
    let mut factors = Grid::new(UVec2::new(3, 2), 1.0);
    assert_eq!(job(factors.clone(), Vec2::new(1.5, 1.0)), Ok(()));
    assert!(matches!(job(factors.clone(), Vec2::ZERO), Err(ReliefError::Image { .. })));
    assert!(matches!(job(factors.clone(), Vec2::NAN), Err(ReliefError::Image { .. })));
    assert!(matches!(job(Grid::new(UVec2::ZERO, 1.0), Vec2::ONE), Err(ReliefError::Image { .. })));
    for odd in [0.0, -1.0, 9.0, f32::NAN] {
        factors.row_mut(1)[2] = odd;
        assert!(matches!(job(factors.clone(), Vec2::ONE), Err(ReliefError::Texel { x: 2, y: 1, .. })), "{odd}");
        if !odd.is_finite() {
            assert!(matches!(outlines(&factors, 0.5), Err(ReliefError::Texel { x: 2, y: 1, .. })));
        }
    }
    assert!(matches!(outlines(&Grid::new(UVec2::ZERO, 1.0), 0.5), Err(ReliefError::Image { .. })));
}

#[test]
fn outlines_enclose_what_is_high() {
    for case in 0..60 {
        let mut rng = Rng::new(case).stream("outlines");
        let size = UVec2::new(1 + rng.next_u32() % 24, 1 + rng.next_u32() % 24);
        let mut image = Grid::new(size, 0.0);
        let is_drawn = case % 2 == 0;
        image.as_mut_slice().fill_with(|| if is_drawn { (rng.next_u32() % 2) as f32 } else { rng.unit() });
        let lines = outlines(&image, 0.5).unwrap();
        let unit = size.min_element() as f32;
        for y in 0..size.y {
            for x in 0..size.x {
                let value = image.get(x, y).unwrap();
                let p = (Vec2::new(x as f32, y as f32) + 0.5) / unit;
                assert_eq!(is_inside(&lines, p), value >= 0.5, "case {case}, texel {x}, {y}: {value}");
            }
        }
        let areas = lines.iter().map(|line| Ring { points: line.clone(), level: 0 }.signed_area()).sum::<f64>();
        assert!(areas > 0.0 || lines.is_empty(), "case {case}");
        match Contours::generate(&ReliefParams { distance: 0.02, ..ReliefParams::SIMPLE }, &lines, case) {
            Ok(contours) => assert_contours(&contours, 0.7 * 0.02, &format!("outlines {case}")),
            Err(error) => assert!(lines.is_empty(), "{error}"),
        }
    }
}

#[test]
fn estimates_fit_every_seed() {
    for case in 0..60 {
        let mut rng = Rng::new(case).stream("estimates");
        let points = count(&mut rng, 800.0);
        let seed = shape(case as usize % KINDS.len(), points, &mut rng);
        match ReliefParams::estimate(&seed) {
            Ok(params) => {
                assert_eq!(params.validate(), Ok(()));
                let contours = Contours::generate(&params, &[seed], case).unwrap();
                assert_contours(&contours, 0.03 * f64::from(params.distance), &format!("estimate {case}"));
                assert!(contours.levels().unwrap().1 >= 2, "case {case}: {params:?}");
            }
            Err(error) => assert_eq!(error, ReliefError::NoArea),
        }
    }
}
