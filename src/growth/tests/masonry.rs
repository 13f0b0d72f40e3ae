//! Cracks in masonry: as brick ships, on walls with a picture and without.

use crate::{
    CrackPreset, Grid,
    growth::{CrackGrowth, masonry::Masonry},
    math::Rng,
    pattern::{CrackMask, NO_PARENT},
};
use glam::{UVec2, Vec2};

/// A wall of `rows` courses as a picture: light joints between dark bricks. Also how wide a joint is.
fn wall(rows: u32) -> (UVec2, Vec<u8>, f32) {
    let size = UVec2::splat(512);
    let (course, brick, joint) = (512 / rows, 3 * 512 / rows, 512 / rows / 7);
    let mut rng = Rng::new(u64::from(rows));
    let texels = (0..size.x * size.y).flat_map(|i| {
        let (x, y) = (i % 512, i / 512);
        let shift = if (y / course) % 2 == 0 { 0 } else { brick / 2 };
        let is_joint = y % course < joint || (x + shift) % brick < joint;
        let value = (if is_joint { 190.0 } else { 90.0 } + 14.0 * rng.signed()) as u8;
        [value, value, value, 255]
    });
    (size, texels.collect(), joint as f32 / 512.0)
}

/// At least 95 of 100 parts of the length lie in joints but for hairlines through bricks, no crack is wider than a joint, and no run is
/// longer than two bricks.
#[test]
fn cracks_keep_to_the_joints_of_a_picture() {
    for rows in [12, 16] {
        let (size, texels, joint) = wall(rows);
        let mask = std::sync::Arc::new(CrackMask::from_picture(size, &texels).unwrap());
        let (course, brick) = (1.0 / rows as f32, 3.0 / rows as f32);
        let (mut within, mut all, mut split, mut courses) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..24 {
            for energy in [1.0, 4.0] {
                let mut growth = CrackGrowth::new(CrackPreset::BRICK.growth, Vec2::ONE, seed).unwrap();
                growth.set_mask(mask.clone());
                let mut rng = Rng::new(seed);
                growth.hit(Vec2::new(rng.range(0.2, 0.8), rng.range(0.2, 0.8)), energy);
                while growth.step().grew() {}
                let nodes = growth.network().nodes();
                let light = |pos: Vec2| {
                    let at = (pos * 512.0).as_uvec2().min(UVec2::splat(511));
                    texels[4 * (at.y * 512 + at.x) as usize] > 140
                };
                for segment in growth.network().segments() {
                    let path = growth.network().path(segment).unwrap();
                    let (a, b) = growth.network().ends(segment).unwrap();
                    let straight = nodes[b as usize].pos - nodes[a as usize].pos;
                    let is_split = straight.y.abs() > 0.7 * course && !light(nodes[a as usize].pos + 0.5 * straight);
                    for pair in path.points().windows(2) {
                        let long = pair[0].pos.distance(pair[1].pos);
                        if is_split {
                            split += long;
                            continue;
                        }
                        all += long;
                        within += if light(0.5 * (pair[0].pos + pair[1].pos)) { long } else { 0.0 };
                        assert!(pair[0].width <= 1.001 * joint, "{} in a joint of {joint}", pair[0].width);
                    }
                }
                // From each node back along its joint.
                for node in nodes {
                    let (mut run, mut at) = (0.0f32, *node);
                    while at.parent != NO_PARENT {
                        let before = nodes[at.parent as usize];
                        let way = at.pos - before.pos;
                        if way.y.abs() > way.x.abs() {
                            break;
                        }
                        run += way.x.abs();
                        at = before;
                    }
                    courses += 1.0;
                    assert!(run <= 2.05 * brick, "seed {seed}: a run of {} bricks", run / brick);
                }
            }
        }
        println!(
            "{rows} rows: {:.1} % in joints, {:.1} % through bricks",
            100.0 * within / all,
            100.0 * split / (all + split)
        );
        assert!(within >= 0.95 * all && split > 0.0 && split < 0.12 * all, "{within} of {all}, {split}");
        assert!(courses > 1000.0);
    }
}

/// The bricks around a place where joints meet: no joint runs through them, and there is one along each side.
#[test]
fn bricks_lie_between_joints() {
    let mut counts = [0; 5];
    for seed in 0..60 {
        let mut rng = Rng::new(seed).stream("bricks");
        let extent = Vec2::new(1.0, rng.range(0.6, 1.5));
        let growth = CrackGrowth::new(CrackPreset::BRICK.growth, extent, seed).unwrap();
        let masonry = growth.masonry.as_ref().unwrap();
        let joint = masonry.joint();
        let pos = masonry.nearest(Vec2::new(rng.unit(), rng.unit()) * extent).unwrap();
        let bricks: Vec<[Vec2; 2]> = masonry.bricks(pos).into_iter().filter(|[min, max]| min != max).collect();
        counts[bricks.len()] += 1;
        for [min, max] in bricks {
            assert!(min.cmplt(max).all() && pos.clamp(min, max).distance(pos) < 0.75 * joint, "{min} {max} at {pos}");
            let middle = 0.5 * (min + max);
            let (low, high) = (min - 0.5 * joint, max + 0.5 * joint);
            let steps = |from: f32, to: f32| {
                let count = ((to - from) / 1e-4) as u32;
                (0..=count).map(move |k| from + (to - from) * k as f32 / count as f32)
            };
            assert!(steps(min.x, max.x).all(|x| !masonry.is_in_joint(Vec2::new(x, middle.y))), "seed {seed}");
            assert!(steps(min.y, max.y).all(|y| !masonry.is_in_joint(Vec2::new(middle.x, y))), "seed {seed}");
            let sides = [low.with_y(middle.y), high.with_y(middle.y), low.with_x(middle.x), high.with_x(middle.x)];
            for side in sides {
                let is_border = side.min(extent - side).min_element() < 1e-4;
                assert!(is_border || masonry.is_in_joint(side), "seed {seed}: {side}");
            }
        }
    }
    assert!(counts[0] == 0 && counts[3] > 20, "{counts:?}");
}

/// What is no number in a mask counts as not weak: courses are found all the same.
#[test]
fn courses_are_found_beside_what_is_no_number() {
    let size = UVec2::new(96, 96);
    let is_joint = |x: u32, y: u32| y % 16 < 2 || (x + 12 * (y / 16 % 2)) % 24 < 2;
    let wall = |hole: f32| {
        let values = (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y)));
        let value =
            |(x, y)| if (x, y) == (40, 40) || x == 7 && y < 20 { hole } else { f32::from(u8::from(is_joint(x, y))) };
        Grid::from_vec(size, values.map(value).collect()).unwrap()
    };
    let with = |hole| Masonry::find(&wall(hole), Vec2::ONE);
    assert!(with(0.0).is_some());
    assert_eq!(with(f32::NAN), with(0.0));
}
