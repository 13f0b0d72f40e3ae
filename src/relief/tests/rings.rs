//! Rings of all methods and joins: simple, nested, far enough apart; the same in steps.

use super::{
    super::{ContourJob, Contours, Join, Method, ReliefError, ReliefParams},
    oracle::{assert_contours, distances, is_inside},
    shapes::{KINDS, count, shape},
};
use crate::math::Rng;
use glam::Vec2;

fn join(rng: &mut Rng) -> Join {
    match rng.next_u32() % 5 {
        0 => Join::Miter,
        1 => Join::Bevel,
        2 => Join::Round,
        3 => Join::Arc { factor: rng.range(1.0, 16.0) },
        _ => Join::Arc { factor: [1.2, 1.4, 3.0][rng.next_u32() as usize % 3] },
    }
}

fn params(rng: &mut Rng) -> ReliefParams {
    let samples = 1 << (4 + rng.next_u32() % 7);
    let angles = [rng.range(0.0, 1.2), rng.range(0.0, 1.2)];
    ReliefParams {
        method: Method::ALL[rng.next_u32() as usize % 4],
        join: join(rng),
        distance: 0.004 * crate::math::ops::powf(50.0, rng.unit()),
        displacement: rng.unit(),
        min_angle: angles[0].min(angles[1]),
        max_angle: angles[0].max(angles[1]),
        samples,
        first_harmonic: 1 + rng.next_u32() % (samples / 2),
        long_edges: rng.unit(),
        inward: 1 + rng.next_u32() % 12,
        outward: rng.next_u32() % 4,
        steepness: if rng.next_u32().is_multiple_of(4) { rng.range(0.0, 0.8) } else { 0.0 },
        steep_angle: rng.range(-7.0, 7.0),
    }
}

/// How near a level may come to the one before, in units of the distance.
///
/// Lines of many points may be so rough that they are simplified more than usual.
pub(crate) fn least(params: &ReliefParams, points: u32) -> f64 {
    let slack = if points > 1000 { 0.04 } else { 0.0 };
    let join = match params.join {
        Join::Miter | Join::Round => 0.99,
        Join::Arc { .. } => 0.7,
        Join::Bevel => 0.49,
    };
    // Where the distance varies, moved edges are not quite parallel.
    let slack = if params.steepness > 0.0 { slack + 0.1 } else { slack };
    let least = if params.method == Method::Simple { join - slack } else { 0.03 };
    least * f64::from(1.0 - params.steepness)
}

fn cases(usual: u64) -> u64 {
    std::env::var("CRACK_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

#[test]
fn rings_are_simple_and_nested_whatever_the_seed_contour() {
    let first = std::env::var("CRACK_FIRST").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    for case in first..first + cases(200) {
        let mut rng = Rng::new(case).stream("contours");
        let kind = case as usize % KINDS.len();
        let points = count(&mut rng, 5000.0);
        let seed = shape(kind, points, &mut rng);
        let params = params(&mut rng);
        let what = format!("case {case}, {} of {points} points, {params:?}", KINDS[kind]);
        match Contours::generate(&params, std::slice::from_ref(&seed), case) {
            Ok(contours) => assert_contours(&contours, least(&params, points) * f64::from(params.distance), &what),
            Err(ReliefError::NoArea) => assert!(kind > 3, "{what}: no area"),
            Err(error) => panic!("{what}: {error}"),
        }
    }
}

#[test]
fn steps_make_the_same_contours_and_progress() {
    for case in 0..12 {
        let mut rng = Rng::new(case).stream("steps");
        let seeds = [shape(case as usize % KINDS.len(), 300, &mut rng)];
        let params = ReliefParams { outward: 3, ..params(&mut rng) };
        let whole = Contours::generate(&params, &seeds, case).unwrap();
        let mut job = ContourJob::new(&params, &seeds, case).unwrap();
        let mut before = 0.0;
        loop {
            let has_more = job.step().unwrap();
            // What another thread would get goes on in the same way.
            job = job.clone();
            let progress = job.progress();
            assert!((before..=1.0).contains(&progress), "{before}, then {progress}");
            before = progress;
            if !has_more {
                break;
            }
        }
        assert_eq!(before, 1.0);
        assert_eq!(job.step(), Ok(false));
        assert_eq!(job.finish(), whole);
        let other = Contours::generate(&params, &seeds, case + 1000).unwrap();
        // Midpoints need long edges.
        if params.method != Method::Midpoint {
            assert_eq!(other == whole, params.method == Method::Simple, "{params:?}");
        }
    }
}

/// A square with a notch: one valley corner.
fn notched(turn: f32) -> Vec<Vec2> {
    let tip = 0.5 - 0.4 / crate::math::ops::sin(0.5 * turn) * crate::math::ops::cos(0.5 * turn);
    [[0.1, 0.5], [0.5, tip.max(-60.0)], [0.9, 0.5], [0.9, -99.0], [0.1, -99.0]].map(Vec2::from_array).into()
}

/// Figures 5 and 7: the points between the moved edges of a valley.
#[test]
fn joins_are_those_of_the_figures() {
    const TURN: f32 = std::f32::consts::FRAC_PI_2;
    let corner = Vec2::new(0.5, 0.1);
    assert!(notched(TURN)[1].distance(corner) < 1e-6);
    let moved = |join| {
        let params = ReliefParams { join, distance: 0.05, inward: 1, ..ReliefParams::SIMPLE };
        let contours = Contours::generate(&params, &[notched(TURN)], 1).unwrap();
        let mut near: Vec<Vec2> = contours.level(1).flat_map(|ring| ring.points.clone()).collect();
        near.retain(|point| point.distance(corner) < 0.12);
        near.sort_by(|a, b| a.x.total_cmp(&b.x));
        near
    };
    let is_at = |point: Vec2, x: f32, y: f32| point.distance(corner + Vec2::new(x, y) * 0.05) < 1e-4;
    let half = 0.5f32.sqrt();
    let miter = moved(Join::Miter);
    assert!(miter.len() == 1 && is_at(miter[0], 0.0, -2.0 * half), "{miter:?}");
    let bevel = moved(Join::Bevel);
    assert!(bevel.len() == 2 && is_at(bevel[0], -half, -half) && is_at(bevel[1], half, -half), "{bevel:?}");
    let arc = moved(Join::Arc { factor: 1.2 });
    assert!(arc.len() == 3 && is_at(arc[0], -half, -half) && is_at(arc[1], 0.0, -1.2), "{arc:?}");
    // Where extended edges meet before, they meet.
    assert_eq!(moved(Join::Arc { factor: 1.6 }), miter);
    let round = moved(Join::Round);
    assert!(round.len() >= 8);
    for pair in round.windows(2) {
        let middle = (pair[0] + pair[1]) * 0.5;
        assert!((middle.distance(corner) / 0.05 - 1.0).abs() < 0.001, "chords touch the circle");
    }
}

#[test]
fn a_square_shrinks_to_squares_and_a_dumbbell_to_islands() {
    let params = ReliefParams { distance: 0.0625, ..ReliefParams::SIMPLE };
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from_array).to_vec();
    let contours = Contours::generate(&params, &[square], 1).unwrap();
    assert_eq!(contours.levels(), Some((0, 7)));
    for ring in &contours.rings {
        let side = f64::from(1.0 - 0.125 * ring.level as f32);
        assert_eq!(ring.points.len(), 4);
        assert_eq!(ring.signed_area(), side * side);
    }
    let bell = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.4], [2.0, 0.4], [2.0, 0.0], [3.0, 0.0], [3.0, 1.0], [2.0, 1.0]];
    let bell = bell.into_iter().chain([[2.0, 0.6], [1.0, 0.6], [1.0, 1.0], [0.0, 1.0]]).map(Vec2::from_array).collect();
    let contours = Contours::generate(&params, &[bell], 1).unwrap();
    let islands: Vec<usize> = (0..=7).map(|level| contours.level(level).count()).collect();
    assert_eq!(islands, [1, 1, 2, 2, 2, 2, 2, 2]);
}

/// Round rings are the level sets of the distance from the seed.
#[test]
fn round_rings_are_level_sets_of_the_distance() {
    const SIDE: u32 = 96;
    for (case, inward, outward) in [(0, 20, 0), (1, 8, 0), (3, 6, 3), (9, 12, 4), (10, 0, 8), (11, 10, 6)] {
        let mut rng = Rng::new(case).stream("levels");
        let seed: Vec<Vec2> = shape(case as usize % KINDS.len(), 60, &mut rng);
        let seed: Vec<Vec2> = seed.iter().map(|point| 16.0 + *point * 64.0).collect();
        let params = ReliefParams { join: Join::Round, distance: 2.0, inward, outward, ..ReliefParams::SIMPLE };
        let contours = Contours::generate(&params, &[seed], case).unwrap();
        let rings = |level: i32| contours.level(level).map(|ring| ring.points.clone()).collect::<Vec<_>>();
        let field = distances(&rings(0), SIDE);
        for level in -(outward as i32)..=inward as i32 {
            let rings = rings(level);
            for point in rings.iter().flatten() {
                let [x, y] = [point.x - 0.5, point.y - 0.5];
                if x < 0.0 || y < 0.0 || x + 1.0 >= SIDE as f32 || y + 1.0 >= SIDE as f32 {
                    continue;
                }
                let at = field[y as usize * SIDE as usize + x as usize];
                let expected = 2.0 * f64::from(level.unsigned_abs());
                // The texel centre is up to a diagonal away.
                assert!((at - expected).abs() < 1.5 + 0.1, "case {case}, level {level}: {at} at {point}");
            }
        }
        // None is lost: what is farther inside than a level is inside its rings.
        let deepest = contours.levels().unwrap().1;
        let is_lost = |(i, at): &(usize, &f64)| {
            let p = Vec2::new((*i % SIDE as usize) as f32 + 0.5, (*i / SIDE as usize) as f32 + 0.5);
            **at > 2.0 * f64::from(deepest) + 3.5 && is_inside(&rings(0), p)
        };
        let lost = field.iter().enumerate().filter(is_lost).count();
        assert!(lost == 0 || deepest == inward as i32, "case {case}: {lost} texels lost");
    }
}

/// Distances along one contour differ as asked.
#[test]
fn steep_sides_have_narrow_distances() {
    let disc: Vec<Vec2> = (0..240).map(|i| Vec2::from_angle(std::f32::consts::TAU * i as f32 / 240.0)).collect();
    let params = ReliefParams { distance: 0.1, steepness: 0.5, inward: 3, ..ReliefParams::SIMPLE };
    let contours = Contours::generate(&params, std::slice::from_ref(&disc), 1).unwrap();
    assert_contours(&contours, 0.049, "steep");
    let reach = |level: i32, way: Vec2| {
        contours.level(level).flat_map(|ring| &ring.points).map(|point| point.dot(way)).fold(f32::MIN, f32::max)
    };
    for level in 0..3 {
        let gap = |way: Vec2| reach(level, way) - reach(level + 1, way);
        assert!((gap(Vec2::X) - 0.05).abs() < 0.01, "{}", gap(Vec2::X));
        assert!((gap(Vec2::NEG_X) - 0.15).abs() < 0.01, "{}", gap(Vec2::NEG_X));
        assert!((gap(Vec2::Y) - 0.1).abs() < 0.02, "{}", gap(Vec2::Y));
    }
    // An image that is twice as far in its lower half.
    let mut factors = crate::Grid::new([64, 64].into(), 0.5);
    factors.as_mut_slice()[64 * 32..].fill(2.0);
    let disc: Vec<Vec2> = disc.iter().map(|point| (*point + 1.0) * 0.5).collect();
    let params = ReliefParams { distance: 0.05, inward: 2, ..ReliefParams::SIMPLE };
    let mut job = ContourJob::with_factors(&params, &[disc], 1, factors, Vec2::ONE).unwrap();
    while job.step().unwrap() {}
    let contours = job.finish();
    let top = contours.level(1).flat_map(|ring| &ring.points).map(|point| point.y).fold(1.0, f32::min);
    let bottom = contours.level(1).flat_map(|ring| &ring.points).map(|point| point.y).fold(0.0, f32::max);
    assert!((top - 0.025).abs() < 0.005 && (bottom - 0.9).abs() < 0.01, "{top} {bottom}");
}

/// The improved method keeps a contour rough, where the simple one makes it simpler (section 4.3).
#[test]
fn improved_contours_stay_rough() {
    let seed = shape(0, 200, &mut Rng::new(2));
    let turns = |params: &ReliefParams| {
        let params = ReliefParams { distance: 0.012, ..*params };
        let contours = Contours::generate(&params, std::slice::from_ref(&seed), 3).unwrap();
        let ring = contours.level(10).max_by(|a, b| a.signed_area().total_cmp(&b.signed_area())).unwrap();
        let at = |i: usize| ring.points[i % ring.points.len()];
        let turn = |i: usize| (at(i + 1) - at(i)).angle_to(at(i + 2) - at(i + 1)).abs();
        (0..ring.points.len()).map(turn).sum::<f32>()
    };
    let [simple, improved] = [ReliefParams::SIMPLE, ReliefParams::IMPROVED].map(|params| turns(&params));
    assert!(improved > 1.5 * simple, "simple {simple}, improved {improved}");
}

/// What lines wind round is inside, whatever they do; what they do not is outside.
#[test]
fn seeds_enclose_what_they_wind_round() {
    for case in 0..200 {
        let mut rng = Rng::new(case).stream("winding");
        let points = count(&mut rng, 300.0);
        let lines: Vec<Vec<Vec2>> = (0..1 + rng.next_u32() % 3)
            .map(|i| shape((case as usize + i as usize) % KINDS.len(), points, &mut rng))
            .collect();
        let params = ReliefParams { inward: 0, ..ReliefParams::SIMPLE };
        let Ok(contours) = Contours::generate(&params, &lines, case) else { continue };
        assert_contours(&contours, 0.0, "seeds");
        let rings: Vec<Vec<Vec2>> = contours.rings.iter().map(|ring| ring.points.clone()).collect();
        for _ in 0..60 {
            let p = Vec2::new(rng.range(-1.0, 2.0), rng.range(-1.0, 2.0));
            let near = |line: &Vec<Vec2>| {
                line.iter().zip(line.iter().cycle().skip(1)).any(|(a, b)| {
                    let way = *b - *a;
                    let share = ((p - *a).dot(way) / way.length_squared().max(1e-12)).clamp(0.0, 1.0);
                    p.distance(*a + way * share) < 1e-5
                })
            };
            if !lines.iter().any(near) {
                assert_eq!(is_inside(&lines, p), is_inside(&rings, p), "case {case} at {p}");
            }
        }
    }
}

/// A simplified contour can have an edge that goes there and back; a round join once went to the wrong side there.
#[test]
fn round_joins_go_round_the_ends_of_lines() {
    let mut rng = Rng::new(1396).stream("contours");
    let points = count(&mut rng, 5000.0);
    let seed = shape(6, points, &mut rng);
    for steepness in [0.0, 0.3, 0.565_952_96] {
        let params = ReliefParams {
            join: Join::Round,
            distance: 0.019_949_593,
            steepness,
            steep_angle: 0.199_151_04,
            inward: 0,
            outward: 1,
            ..ReliefParams::SIMPLE
        };
        let contours = Contours::generate(&params, std::slice::from_ref(&seed), 1).unwrap();
        assert_contours(&contours, 0.85 * f64::from(params.distance * (1.0 - steepness)), "there and back");
    }
}
