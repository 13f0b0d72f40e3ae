//! Heights against brute force, on rings and between them; threads; hostile input.

use super::*;
use crate::{
    Grid,
    math::{Rng, ops},
    pattern::SurfaceFrame,
};
use glam::{UVec2, Vec2};

fn frame(side: u32) -> SurfaceFrame {
    SurfaceFrame::new(UVec2::splat(side)).unwrap()
}

fn circle(center: Vec2, radius: f32, level: i32) -> Ring {
    let corner = |i: u16| center + radius * ops::unit(std::f32::consts::TAU * f32::from(i) / 720.0);
    Ring { points: (0..720).map(corner).collect(), level }
}

/// Nested stars with a summit that splits in two, and a pit.
fn random_contours(rng: &mut Rng, size: Vec2) -> Contours {
    let waves: Vec<_> = (2u8..14).map(|k| (f32::from(k), 0.35 * rng.signed() / f32::from(k), rng.unit())).collect();
    let star = |center: Vec2, radius: f32, level: i32| {
        let corner = |i: u16| {
            let angle = std::f32::consts::TAU * f32::from(i) / 150.0;
            let wave = |&(k, size, phase): &(f32, f32, f32)| size * ops::cos(k * angle + std::f32::consts::TAU * phase);
            center + radius * (1.0 + waves.iter().map(wave).sum::<f32>()) * ops::unit(angle)
        };
        Ring { points: (0..150).map(corner).collect(), level }
    };
    let middle = size * Vec2::new(rng.range(0.45, 0.55), rng.range(0.45, 0.55));
    let n = 2 + (rng.next_u32() % 4) as i32;
    let mut rings: Vec<_> = (0..n).map(|k| star(middle, 0.4 - 0.05 * k as f32, k - 1)).collect();
    rings.push(star(middle - Vec2::new(0.07, 0.0), 0.045, n - 1));
    let mut pit = star(middle + Vec2::new(0.07, 0.0), 0.045, n - 2);
    pit.points.reverse();
    rings.push(pit);
    Contours { rings, distance: 0.05 }
}

fn is_inside(points: &[Vec2], at: Vec2) -> bool {
    let mut is_inside = false;
    for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
        if (a.y > at.y) != (b.y > at.y) && at.x < a.x + (at.y - a.y) * (b.x - a.x) / (b.y - a.y) {
            is_inside = !is_inside;
        }
    }
    is_inside
}

fn distance(ring: &Ring, at: Vec2) -> f32 {
    let sides = ring.points.iter().zip(ring.points.iter().cycle().skip(1));
    let to_side = |(a, b): (&Vec2, &Vec2)| {
        let share = ((at - *a).dot(*b - *a) / a.distance_squared(*b)).clamp(0.0, 1.0);
        at.distance(a.lerp(*b, share))
    };
    sides.map(to_side).fold(f32::MAX, f32::min)
}

fn texels(grid: &Grid<f32>) -> impl Iterator<Item = (UVec2, f32)> {
    let width = grid.size().x;
    (0..).zip(grid.as_slice()).map(move |(i, &height)| (UVec2::new(i % width, i / width), height))
}

#[test]
fn steps_that_taper_to_nothing_still_rise() {
    let rings = (0..60).map(|level| circle(Vec2::splat(0.5), 0.45 - 0.007 * level as f32, level)).collect();
    let contours = Contours { rings, distance: 0.007 };
    for (taper, roughness) in [(0.5, 0.3), (0.95, 0.0), (0.95, 1.0)] {
        let params = HeightParams { taper, roughness, variation: 0.9, ..HeightParams::DEFAULT };
        let map = HeightMap::new(&contours, &params, frame(90), 1).unwrap();
        assert!((0..59).all(|level| map.level_height(level + 1) > map.level_height(level)));
        assert!(texels(&map.heights(1)).all(|(_, height)| height.is_finite()));
    }
}

/// However little steps taper and however many there are, levels are as high as their steps together, and each is above the one below
/// it.
#[test]
fn levels_are_as_high_as_their_steps() {
    let contours =
        Contours { rings: vec![circle(Vec2::splat(0.5), 0.4, -2), circle(Vec2::splat(0.5), 0.2, 1000)], distance: 0.1 };
    for taper in [0.0, f32::from_bits(1), 3e-43, 1e-20, 1e-9, 3e-8, 1e-7, 1e-5, 0.00175, 0.1, 0.95] {
        for variation in [0.0, 0.9] {
            let params = HeightParams { step: 0.01, taper, variation, ..HeightParams::DEFAULT };
            let map = HeightMap::new(&contours, &params, frame(9), 1).unwrap();
            let (mut steps, mut step) = (0.0, 1.0);
            for level in 0..1000 {
                let height = f64::from(map.level_height(level)) / 0.01;
                let least = 1e-4 * f64::from(level);
                let off = 0.5 * f64::from(variation) * step + 1e-6 * steps;
                assert!((height - steps - least).abs() <= least + off, "{taper}, {level}: {height} of {steps}");
                assert!(map.level_height(level + 1) > map.level_height(level), "{taper}, {level}");
                steps += step;
                step *= 1.0 - f64::from(taper);
            }
            let summits = map.heights(1);
            let most = map.level_height(1000) + 2.0 * params.step;
            assert!(summits.as_slice().iter().all(|height| (-0.05..=most).contains(height)), "{taper}");
        }
    }
}

#[test]
fn every_texel_lies_between_the_levels_around_it() {
    for seed in 0..12 {
        let mut rng = Rng::new(seed);
        let frame = SurfaceFrame::new(UVec2::new(70 + rng.next_u32() % 190, 60 + rng.next_u32() % 190)).unwrap();
        let contours = random_contours(&mut rng, frame.extent());
        let params = HeightParams {
            variation: if seed % 2 == 0 { 0.0 } else { 0.9 },
            roughness: if seed % 3 == 0 { 1.0 } else { 0.0 },
            cliffs: if seed % 4 == 0 { 0.5 } else { 0.0 },
            floor: 2.0,
            ..HeightParams::DEFAULT
        };
        let map = HeightMap::new(&contours, &params, frame, seed).unwrap();
        let (lowest, highest) = contours.levels().unwrap();
        for (texel, height) in texels(&map.heights(1)) {
            let pos = frame.to_pos(texel.as_vec2() + 0.5);
            if contours.rings.iter().any(|ring| distance(ring, pos) < 1e-5) {
                continue;
            }
            let inside = |ring: &&Ring| is_inside(&ring.points, pos);
            let count: i32 = contours.rings.iter().filter(inside).map(|ring| if ring.is_hole() { -1 } else { 1 }).sum();
            let band = lowest - 1 + count;
            let low = if band < lowest { map.level_height(lowest) - 2.0 * params.step } else { map.level_height(band) };
            let high = if band == highest { low + 2.0 * params.step } else { map.level_height(band + 1) };
            assert!(
                (low - 1e-6..=high + 1e-6).contains(&height),
                "seed {seed}, {texel}: {height} not in {low}..{high}"
            );
        }
    }
}

/// Texel centers that are corners of rings have exactly the heights of their rings.
#[test]
fn rings_have_their_heights() {
    let frame = frame(160);
    for variation in [0.0, 0.8] {
        let params = HeightParams { variation, ..HeightParams::DEFAULT };
        let square = |half: f32, level| {
            let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
            Ring { points: corners.map(|corner| (Vec2::from(corner) + 80.5) / 160.0).to_vec(), level }
        };
        let contours =
            Contours { rings: (0..5).map(|k| square(70.0 - 13.0 * k as f32, k - 2)).collect(), distance: 13.0 / 160.0 };
        let map = HeightMap::new(&contours, &params, frame, 3).unwrap();
        let heights = map.heights(1);
        for k in 0..5u32 {
            let level = map.level_height(k as i32 - 2);
            for along in 0..=2 * (70 - 13 * k) {
                let (near, at) = (10 + 13 * k, 10 + 13 * k + along);
                for height in [heights.get(near, at), heights.get(at, near), heights.get(150 - 13 * k, at)] {
                    assert!((height.unwrap() - level).abs() < 1e-5, "level {level}: {height:?}");
                }
            }
        }
    }
}

/// Along a radius of uneven circles heights rise all the way, without a step, and without a bend at the rings.
#[test]
fn slopes_are_continuous_across_rings() {
    let radii = [0.45, 0.40, 0.33, 0.29, 0.21, 0.15, 0.11, 0.05];
    let center = Vec2::splat(0.5);
    let rings = radii.iter().zip(0..).map(|(&radius, level)| circle(center, radius, level)).collect();
    let contours = Contours { rings, distance: 0.06 };
    let params = HeightParams { step: 0.05, ..HeightParams::DEFAULT };
    let side = 2048;
    let heights = heights(&contours, &params, frame(side), 1).unwrap();
    let row = heights.row(side as usize / 2);
    let slopes: Vec<_> = row.windows(2).map(|pair| (pair[1] - pair[0]) * side as f32).collect();
    assert!(slopes[..1000].iter().all(|&slope| slope > 0.0), "heights rise");
    for radius in radii {
        let at = ((0.5 - radius) * side as f32) as usize;
        let [before, after] = [slopes[at - 3], slopes[at + 3]];
        assert!((before / after - 1.0).abs() < 0.12, "radius {radius}: {before} {after}");
        let level = radii.iter().position(|&other| other == radius).unwrap() as f32 * params.step;
        assert!((row[at] - level).abs() < 0.01 * 0.06, "no step: {} {level}", row[at]);
    }
    // Linear interpolation would bend: the ground between two rings is up to twice as wide as that beside it.
    let mean = |k: usize| params.step / (radii[k] - radii[k + 1]);
    assert!(mean(3) / mean(2) < 0.6 || mean(2) / mean(3) < 0.6);
}

#[test]
fn terraces_are_flat_above_rings_and_steep_below() {
    let rings = (0..4).map(|k| circle(Vec2::splat(0.5), 0.45 - 0.1 * k as f32, k)).collect();
    let contours = Contours { rings, distance: 0.1 };
    let params = HeightParams { terraces: 1.0, tread: 0.7, step: 0.1, ..HeightParams::DEFAULT };
    let heights = heights(&contours, &params, frame(400), 1).unwrap();
    let row = heights.row(200);
    for k in 0..3 {
        let ring = 20 + 40 * k;
        let level = 0.1 * k as f32;
        assert!((row[ring + 15] - level).abs() < 0.001, "flat: {}", row[ring + 15]);
        assert!((row[ring + 39] - level) > 0.08, "steep: {}", row[ring + 39]);
    }
}

#[test]
fn threads_and_stripes_give_the_same_bits() {
    let mut rng = Rng::new(5);
    let frame = SurfaceFrame::new(UVec2::new(333, 401)).unwrap();
    let contours = random_contours(&mut rng, frame.extent());
    let params = HeightParams { roughness: 0.5, cliffs: 0.3, variation: 0.3, ..HeightParams::DEFAULT };
    let map = HeightMap::new(&contours, &params, frame, 9).unwrap();
    let one = map.heights(1);
    for threads in [1, 2, 3, 8, 64] {
        assert!(one == map.heights(threads), "{threads} threads");
    }
    let mut rows = vec![7.0; 333 * 401];
    for (stripe, rows) in rows.chunks_mut(HeightMap::STRIPE * 333).enumerate().rev() {
        map.fill_stripe(stripe, rows);
    }
    assert!(one.as_slice() == rows);
    map.fill_stripe(usize::MAX, &mut rows);
    map.fill_stripe(0, &mut []);
    assert!(one.as_slice() == rows, "stripes that are not there change nothing");
}

#[test]
fn hostile_input_is_refused_or_gives_finite_heights() {
    let ring = |points: &[[f32; 2]], level| Ring { points: points.iter().map(|&point| point.into()).collect(), level };
    let triangle = [[0.1, 0.1], [0.9, 0.2], [0.4, 0.9]];
    let of = |ring: Ring| heights(&Contours { rings: vec![ring], distance: 0.1 }, &HeightParams::DEFAULT, frame(9), 1);
    assert_eq!(of(ring(&triangle[..2], 0)), Err(ReliefError::TooFewPoints { contour: 0, points: 2 }));
    assert_eq!(of(ring(&triangle, 5000)), Err(ReliefError::Level { ring: 0, level: 5000, most: MAX_LEVEL }));
    for wrong in [f32::NAN, f32::INFINITY, -1e9] {
        let found = of(ring(&[[0.0, 0.0], [1.0, wrong], [0.0, 1.0]], 0));
        assert!(matches!(found, Err(ReliefError::Point { contour: 0, point: 1, most: 1e4, .. })));
    }
    for distance in [0.0, -1.0, f32::NAN, 1e9] {
        let found = heights(&Contours { rings: Vec::new(), distance }, &HeightParams::DEFAULT, frame(9), 1);
        assert!(matches!(found, Err(ReliefError::OutOfRange { name: "distance", .. })), "{found:?}");
    }
    let empty = Contours { rings: Vec::new(), distance: 0.1 };
    assert_eq!(heights(&empty, &HeightParams::DEFAULT, frame(9), 1).unwrap(), Grid::new(UVec2::splat(9), 0.0));
    for seed in 0..200 {
        let mut rng = Rng::new(seed);
        let size = UVec2::new(1 + rng.next_u32() % 60, 1 + rng.next_u32() % 60);
        let mut point = || match rng.next_u32() % 4 {
            0 => Vec2::new(0.5, 0.5),
            1 => Vec2::new((rng.next_u32() % 4) as f32, (rng.next_u32() % 4) as f32) / 3.0,
            _ => Vec2::new(rng.range(-3.0, 3.0), rng.range(-3.0, 3.0)),
        };
        let mut ring =
            |i: u32| Ring { points: (0..3 + i % 9).map(|_| point()).collect(), level: (i * i % 5) as i32 - 2 };
        let contours = Contours { rings: (0..seed as u32 % 9).map(&mut ring).collect(), distance: 0.05 };
        let params = HeightParams { cliffs: 0.5, roughness: 1.0, ..HeightParams::DEFAULT };
        let heights = heights(&contours, &params, SurfaceFrame::new(size).unwrap(), seed).unwrap();
        let most = 70.0 * params.step;
        assert!(heights.as_slice().iter().all(|height| height.abs() <= most), "seed {seed}");
    }
}

#[test]
fn numbers_out_of_range_are_named() {
    let names = ["step", "variation", "summit", "floor", "terraces", "tread", "roundness", "cliffs", "roughness"];
    for name in names.into_iter().chain(["noise_scale"]) {
        for value in ["-1", "NaN", "inf", "1e9"] {
            let mut params = HeightParams::DEFAULT;
            let error = params.set(name, value).unwrap_err().to_string();
            assert!(error.starts_with(&format!("`{name}` is ")), "{error}");
            assert_eq!(params, HeightParams::DEFAULT);
        }
    }
    let mut params = HeightParams::DEFAULT;
    assert_eq!(params.set("stepp", "1"), Err(ReliefError::Unknown { name: "stepp".into() }));
    assert_eq!(params.set("step", "x"), Err(ReliefError::Unreadable { name: "step".into(), text: "x".into() }));
    params.set("step", " 0.5 ").unwrap();
    assert_eq!(params.step, 0.5);
}

#[test]
fn normals_and_colors_tell_slopes_and_heights() {
    let frame = frame(128);
    let contours = Contours { rings: vec![circle(Vec2::splat(0.5), 0.3, 0)], distance: 0.3 };
    let grid = heights(&contours, &HeightParams { step: 0.3, ..HeightParams::DEFAULT }, frame, 1).unwrap();
    let normals = normals(&grid, &frame);
    let at = |x, y| normals.get(x, y).unwrap();
    assert!(at(40, 64)[0] < 120 && at(88, 64)[0] > 136, "slopes lean left and right");
    assert!(at(64, 40)[1] > 136 && at(64, 88)[1] < 120, "+Y is up");
    for [x, y, z, _] in normals.as_slice() {
        let normal = glam::Vec3::new(f32::from(*x), f32::from(*y), f32::from(*z)) / 127.5 - 1.0;
        assert!((normal.length() - 1.0).abs() < 0.02, "unit vectors");
    }
    for look in [TerrainColors::ROCK, TerrainColors::ISLAND, TerrainColors::MOUNTAIN] {
        let picture = colors(&grid, &frame, &look, 1).unwrap();
        assert!(picture == colors(&grid, &frame, &look, 1).unwrap());
        assert!(picture.as_slice().iter().all(|texel| texel[3] == 255));
        let wrong = TerrainColors { stratum: f32::NAN, ..look };
        assert!(matches!(colors(&grid, &frame, &wrong, 1), Err(ReliefError::OutOfRange { name: "stratum", .. })));
    }
    let mut broken = grid;
    broken.row_mut(7)[5] = f32::NAN;
    assert_eq!(colors(&broken, &frame, &TerrainColors::ROCK, 1), Err(ReliefError::Height { x: 5, y: 7 }));
}
