//! Stamps against the formula, texel by texel.

use super::super::chipped;
use super::*;
use crate::{math::Rng, pattern::Network};

fn below(rng: &mut Rng, n: u32) -> u32 {
    rng.next_u32() % n
}

fn field(size: [u32; 2]) -> DepthField {
    DepthField::new(SurfaceFrame::new(size.into()).unwrap())
}

/// A straight piece between two points in texels, with widths in texels.
fn piece(field: &DepthField, from: (Vec2, f32), to: (Vec2, f32)) -> SegmentPath {
    let unit = field.frame.texels_per_unit();
    let point = |(pos, width): (Vec2, f32)| PathPoint { pos: pos / unit, width: width / unit };
    SegmentPath::straight(point(from), point(to))
}

fn random_profile(rng: &mut Rng) -> Profile {
    Profile {
        depth: rng.unit(),
        full_width: 0.001 + 0.1 * rng.unit(),
        wall: rng.unit(),
        rim_width: if below(rng, 2) == 0 { 0.0 } else { 0.05 * rng.unit() },
        rim_depth: rng.unit(),
        faintest: if below(rng, 2) == 0 { 0.0 } else { rng.unit() },
        even_walls: below(rng, 4) == 0,
        ragged: if below(rng, 2) == 0 { 0.0 } else { 0.05 * rng.unit() },
        chipped: if below(rng, 2) == 0 { 0.0 } else { 0.05 * rng.unit() },
        rubble: if below(rng, 2) == 0 { 0.0 } else { rng.unit() },
        edge: if below(rng, 2) == 0 { 0.0 } else { rng.unit() },
    }
}

fn random_piece(rng: &mut Rng, field: &DepthField) -> SegmentPath {
    let size = field.depth.size().as_vec2();
    let mut point = || (Vec2::new(rng.unit(), rng.unit()) * (size + 16.0) - 8.0, 14.0 * rng.unit() * rng.unit());
    let (from, mut to) = (point(), point());
    if below(rng, 2) == 0 {
        to.1 = from.1;
    }
    piece(field, from, to)
}

/// The formula of the module's head, in f64, at one texel.
fn reference(field: &DepthField, profile: &Profile, path: &SegmentPath, x: u32, y: u32) -> f64 {
    let unit = f64::from(field.frame.texels_per_unit());
    let [from, to] = [path.points()[0], path.points()[1]];
    let texel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
    let (a, b) = (from.pos.as_dvec2() * unit, to.pos.as_dvec2() * unit);
    let t = ((texel - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    let width = f64::from(from.width) + t * (f64::from(to.width) - f64::from(from.width));
    let r = 0.5 * width * unit;
    let most = f64::from(profile.ragged) * unit;
    let uneven =
        if most > 0.0 { f64::from(ragged::at(ragged::tile(most as f32), x as usize, y as usize)[0]) } else { 0.0 };
    let slope = 0.5 * if profile.even_walls { 1.0 } else { f64::from(profile.wall) };
    let deviates = f64::min(0.6, (1.0 - slope) / (1.0 + slope));
    let d = texel.distance(a + (b - a) * t) + uneven / 127.0 * most.min(deviates * (r - 0.5).max(0.0));
    let full = f64::from(profile.full_width);
    let share =
        if profile.even_walls { (1.0 + r) * 2.0 / (full * unit) } else { (0.4 + 0.6 * width / full).clamp(0.4, 1.0) };
    let (peak, shown) = (f64::from(profile.depth) * share.min(1.0), r.max(0.5));
    let wall = if profile.even_walls { 1.0 } else { f64::from(profile.wall) };
    let mut chipped = if profile.even_walls { 0.0 } else { f64::from(profile.chipped) * unit };
    let rubble = if profile.even_walls { 0.0 } else { f64::from(profile.rubble) };
    let [piece, stone] = match chipped > 0.0 || rubble > 0.0 {
        true => {
            let tiles = chipped::tiles(chipped as f32);
            chipped = tiles.most.into();
            [tiles.pieces, tiles.stones].map(|tile| f64::from(ragged::at(tile, x as usize, y as usize)[0]) / 127.0)
        }
        false => [0.0; 2],
    };
    let gap = chipped.min(0.8 * (r - 1.5).max(0.0));
    let peak = peak.min(f64::from(profile.depth) * (1.0 - rubble * stone));
    let gone = gap * (-piece).max(0.0);
    let upright = 0.5 * gone.min(1.0) * (shown + 0.5 + gone - d).clamp(0.0, 1.0);
    let at_edge =
        if profile.even_walls { 0.0 } else { f64::from(profile.edge) * ((shown - 2.5) / 3.5).clamp(0.0, 1.0) };
    let sloping = (1.0 - at_edge) * ((shown + 0.5 - d) / (1.0 + wall * shown)).clamp(0.0, 1.0);
    let core = peak * (sloping + at_edge * (shown + 0.5 - d).clamp(0.0, 1.0)).max(upright);
    let left = gap * piece.max(0.0);
    let step = f64::from(profile.depth) * 0.14 * left.min(1.0) * (shown + 0.5 + left - d).clamp(0.0, 1.0);
    let core = core.max(step);
    let rim = f64::from(profile.rim_width) * unit;
    let edge = if rim > 0.0 { ((r + rim - d) / rim.max(1.0)).clamp(0.0, 1.0) } else { 0.0 };
    let strength = (2.0 * r / (1.0 - f64::from(profile.faintest)).max(1.0e-3)).min(1.0);
    65535.0 * core.max(f64::from(profile.rim_depth) * edge) * strength
}

#[test]
fn stamps_equal_the_formula_and_stay_inside_the_returned_rectangle() {
    let mut rng = Rng::new(1);
    for size in [[64, 64], [97, 53], [1, 1], [3, 5], [7, 40], [9, 9], [200, 1]] {
        for _ in 0..60 {
            let mut field = field(size);
            let profile = random_profile(&mut rng);
            let path = random_piece(&mut rng, &field);
            let rect = stamp_path(&mut field, &profile, &path);
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let got = field.depth.get(x, y).unwrap();
                    let want = reference(&field, &profile, &path, x, y);
                    // Positions of 100 texels are 1e-5 texels fine in f32, the steepest edge is 65535 a texel:
                    // 0.7 levels, twice for the two ends, and half a level of rounding.
                    assert!((f64::from(got) - want).abs() <= 2.0, "{x} {y}: {got} {want} {profile:?} {path:?}");
                    let inside = rect.min.x <= x && x < rect.max.x && rect.min.y <= y && y < rect.max.y;
                    assert!(got == 0 || inside, "{x} {y} changed outside {rect:?}");
                }
            }
        }
    }
}

#[test]
fn every_change_is_told_and_little_else() {
    let mut rng = Rng::new(6);
    let (mut told, mut bounds) = (0, 0);
    for size in [[64, 64], [97, 53], [1, 1], [3, 5], [7, 40], [200, 90]] {
        let mut field = field(size);
        for _ in 0..60 {
            let (before, profile, path) = (field.clone(), random_profile(&mut rng), random_piece(&mut rng, &field));
            let mut rects = Vec::new();
            let rect = stamp_path_with(&mut field, &profile, &path, &mut |rect| rects.push(rect));
            let holds =
                |rect: &TexelRect, x, y| (rect.min.x..rect.max.x).contains(&x) && (rect.min.y..rect.max.y).contains(&y);
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let same = field.depth.get(x, y) == before.depth.get(x, y);
                    assert!(same || rects.iter().any(|rect| holds(rect, x, y)), "{x} {y} is not in {rects:?}");
                }
            }
            assert!(rects.iter().all(|part| part.union(rect) == rect), "{rects:?} stick out of {rect:?}");
            told += rects.iter().map(TexelRect::area).sum::<u64>();
            bounds += rect.area();
        }
    }
    assert!(3 * told < bounds, "{told} texels of {bounds} told");
}

#[test]
fn areas_are_those_of_capsules() {
    for (width, length, angle) in [(4.0f32, 40.0f32, 0.3f32), (7.3, 60.0, 1.1), (12.0, 100.0, 2.0), (1.0, 90.0, 0.77)] {
        let mut field = field([256, 256]);
        let from = Vec2::new(127.3, 128.6);
        let along = crate::math::ops::unit(angle) * length;
        let path = piece(&field, (from, width), (from + along, width));
        stamp_path(&mut field, &Profile { wall: 0.0, full_width: 1.0e-4, ..Profile::DEFAULT }, &path);
        let area: f64 = field.depth.as_slice().iter().map(|&depth| f64::from(depth) / 65535.0).sum();
        let (w, l) = (f64::from(width), f64::from(length));
        let want = l * w + std::f64::consts::PI * w * w / 4.0;
        assert!((area / want - 1.0).abs() < 0.01, "width {width}: {area} instead of {want}");
    }
}

#[test]
fn hairlines_are_as_strong_as_they_are_wide_and_never_dotted() {
    for width in [0.05f32, 0.3, 0.8] {
        for offset in [0.0f32, 0.25, 0.5, 0.9] {
            let mut field = field([64, 64]);
            let path = piece(&field, (Vec2::new(-9.0, 20.0 + offset), width), (Vec2::new(80.0, 20.0 + offset), width));
            stamp_path(&mut field, &Profile { wall: 0.0, full_width: 1.0e-4, ..Profile::DEFAULT }, &path);
            for x in 0..64 {
                let sum: u32 = (0..64).map(|y| u32::from(field.depth.get(x, y).unwrap())).sum();
                let strength = sum as f32 / 65535.0;
                assert!((strength / width - 1.0).abs() < 0.01, "column {x}: {strength} instead of {width}");
            }
        }
    }
}

#[test]
fn order_does_not_matter_and_wider_never_lowers() {
    let mut rng = Rng::new(2);
    let empty = field([120, 90]);
    let profile = Profile { rim_width: 0.03, rim_depth: 0.3, ragged: 0.02, ..Profile::DEFAULT };
    let paths: Vec<_> = (0..40).map(|_| random_piece(&mut rng, &empty)).collect();
    let (mut forward, mut backward) = (empty.clone(), empty.clone());
    paths.iter().for_each(|path| _ = stamp_path(&mut forward, &profile, path));
    paths.iter().rev().for_each(|path| _ = stamp_path(&mut backward, &profile, path));
    assert_eq!(forward, backward);
    for path in &paths {
        let wider = |point: PathPoint| PathPoint { width: point.width * 1.3, ..point };
        let wide = SegmentPath::straight(wider(path.points()[0]), wider(path.points()[1]));
        let (mut once, mut twice) = (empty.clone(), empty.clone());
        stamp_path(&mut once, &profile, &wide);
        stamp_path(&mut twice, &profile, path);
        stamp_path(&mut twice, &profile, &wide);
        // Equal but for the last bit of the f32 arithmetic.
        let mut pairs = once.depth.as_slice().iter().zip(twice.depth.as_slice());
        assert!(pairs.all(|(&once, &twice)| twice >= once && twice - once <= 2), "{path:?}");
    }
}

#[test]
fn the_loop_for_even_widths_gives_the_bits_of_the_tapered_one() {
    let mut rng = Rng::new(3);
    for _ in 0..200 {
        let mut general = field([80, 61]);
        let mut special = general.clone();
        let section = Section::new(
            &Profile { ragged: 0.0, chipped: 0.0, rubble: 0.0, ..random_profile(&mut rng) },
            general.frame.texels_per_unit(),
        );
        let points = random_piece(&mut rng, &general).points().to_vec();
        let to = PathPoint { width: points[0].width, ..points[1] };
        let Some(capsule) = Capsule::clipped(&general.frame, general.depth.size(), &section, points[0], to) else {
            continue;
        };
        let rect = capsule.stamp::<false>(&mut special, &section, &mut |_| {});
        capsule.stamp_rows::<false, true, true, false, false>(&mut general, &section, rect, &mut |_| {});
        assert_eq!(general, special);
    }
}

#[test]
fn wild_numbers_neither_hang_nor_panic() {
    let wild = [f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX, -f32::MAX, 1.0e20, -1.0e9, 0.0, -0.0, 0.5, 1.0e-40];
    let mut rng = Rng::new(4);
    let mut pick = || wild[below(&mut rng, wild.len() as u32) as usize];
    for _ in 0..20_000 {
        let mut field = field([33, 17]);
        let mut point = || PathPoint { pos: Vec2::new(pick(), pick()), width: pick() };
        let path = SegmentPath::straight(point(), point());
        let [depth, full_width, wall, rim_width, rim_depth, faintest, ragged, chipped, rubble, edge] =
            std::array::from_fn(|_| pick());
        let even_walls = depth > 0.0;
        let profile = Profile {
            depth,
            full_width,
            wall,
            rim_width,
            rim_depth,
            faintest,
            even_walls,
            ragged,
            chipped,
            rubble,
            edge,
        };
        stamp_path(&mut field, &profile, &path);
        stamp_dot(&mut field, Vec2::new(pick(), pick()), pick(), pick());
    }
}

#[test]
fn a_far_end_does_not_bend_the_line() {
    let mut field = field([64, 64]);
    let path = piece(&field, (Vec2::new(-1.0e9, 32.5), 3.0), (Vec2::new(1.0e9, 32.5), 3.0));
    let rect = stamp_path(&mut field, &Profile { wall: 0.0, ..Profile::DEFAULT }, &path);
    assert_eq!((rect.min.x, rect.max.x), (0, 64));
    assert!(field.depth.row(32).iter().all(|&depth| depth == 65535), "{:?}", field.depth.row(32));
    assert!(field.depth.row(35).iter().all(|&depth| depth == 0), "{:?}", field.depth.row(35));
}

#[test]
fn dots_are_discs() {
    let mut field = field([100, 100]);
    let rect = stamp_dot(&mut field, Vec2::new(0.5, 0.5), 0.2, 0.5);
    let area: f64 = field.depth.as_slice().iter().map(|&depth| f64::from(depth) / 65535.0).sum();
    assert!((area / (0.5 * std::f64::consts::PI * 400.0) - 1.0).abs() < 0.01, "area {area}");
    assert!(rect.min == UVec2::splat(29) && rect.max == UVec2::splat(71), "{rect:?}");
    assert_eq!(stamp_dot(&mut field, Vec2::new(5.0, 5.0), 0.2, 1.0), TexelRect::default());
}

#[test]
fn rough_paths_have_no_gaps() {
    let mut field = field([256, 256]);
    let mut network = Network::new(Vec2::ONE, 0.2, 9);
    let node =
        |pos, parent| crate::pattern::Node { pos, width: 0.01, parent, generation: 0, birth: 0, impact: 0, bend: 1.0 };
    network.nodes.push(node(Vec2::new(0.1, 0.1), crate::pattern::NO_PARENT));
    network.nodes.push(node(Vec2::new(0.9, 0.7), 0));
    let path = network.path(crate::pattern::SegmentId::Branch(1)).unwrap();
    stamp_path(&mut field, &Profile::DEFAULT, &path);
    for column in 30..225 {
        assert!((0..256).any(|y| field.depth.get(column, y).unwrap() > 20_000), "gap at column {column}");
    }
}
