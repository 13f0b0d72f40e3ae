//! Parts against slow and plain ways, and what holds for all parameters.

use super::{
    Analogy, AnalogyError, AnalogyPair, AnalogyParams, Examples,
    atlas::{NOWHERE, RADIUS, SIDE},
    ramp,
};
use crate::{Grid, math::Rng, raster::TexelRect};
use glam::{IVec2, UVec2};
use std::sync::Arc;

/// A noisy picture with dark lines, and its guide.
pub(super) fn pair(rng: &mut Rng, size: UVec2) -> AnalogyPair {
    let cracks = cracks(rng, size, 3);
    let rgba: Vec<u8> = cracks
        .as_slice()
        .iter()
        .flat_map(|&crack| {
            let light = if crack > 0.0 { 20 } else { 150 } + (rng.next_u32() % 60) as u8;
            [light, light - 10, light / 2, 255]
        })
        .collect();
    AnalogyPair::new(size, &rgba, cracks).unwrap()
}

/// Straight lines across a surface, of values that are all crack.
fn cracks(rng: &mut Rng, size: UVec2, count: u32) -> Grid<f32> {
    let mut out = Grid::new(size, 0.0);
    for _ in 0..count {
        let mut end = || [rng.range(0.0, size.x as f32), rng.range(0.0, size.y as f32)];
        let (from, to) = (end(), end());
        for i in 0..400 {
            let at = [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * i as f32 / 400.0);
            out.row_mut(at[1] as usize)[at[0] as usize] = rng.range(0.6, 1.0);
        }
    }
    out
}

fn depths(cracks: &Grid<f32>) -> Grid<u16> {
    Grid::from_vec(cracks.size(), cracks.as_slice().iter().map(|&value| (value * 65535.0) as u16).collect()).unwrap()
}

fn cases(few: u64) -> u64 {
    std::env::var("CRACK_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(few)
}

/// Parameters that validate, of every kind.
fn any_params(rng: &mut Rng) -> AnalogyParams {
    AnalogyParams {
        reach: 2 + rng.next_u32() % 14,
        depth: 0.5 * rng.unit(),
        guide: 5.0 * rng.unit(),
        orientation: if rng.unit() < 0.5 { 0.0 } else { 4.0 * rng.unit() },
        extra: 4.0 * rng.unit(),
        coherence: 4.0 * rng.unit(),
        variety: 8.0 * rng.unit(),
        levels: 1 + rng.next_u32() % 8,
        passes: 1 + rng.next_u32() % 2,
        tries: rng.next_u32() % 8,
        margin: 1 + rng.next_u32() % 6,
        is_tileable: rng.unit() < 0.5,
    }
}

fn any_pair(rng: &mut Rng, channels: u32) -> AnalogyPair {
    let size = UVec2::new(16 + rng.next_u32() % 30, 16 + rng.next_u32() % 30);
    let plain = pair(rng, size);
    let pair = (0..channels).fold(plain, |pair, _| pair.with_channel(any_channel(rng, size)).unwrap());
    if rng.unit() < 0.5 { pair.tileable() } else { pair }
}

fn any_channel(rng: &mut Rng, size: UVec2) -> Grid<f32> {
    let values = (0..size.element_product()).map(|_| rng.unit()).collect();
    Grid::from_vec(size, values).unwrap()
}

/// For random pairs, surfaces and parameters: every texel is a copy of a texel, updates change nothing outside of their
/// window, and the size of the steps does not matter.
#[test]
fn all_parameters_give_copies_and_local_updates() {
    for case in 0..cases(150) {
        let mut rng = Rng::new(case).stream("analogies");
        let params = any_params(&mut rng);
        let channel_count = rng.next_u32() % 3;
        let pairs: Vec<_> = (0..1 + rng.next_u32() % 2).map(|_| any_pair(&mut rng, channel_count)).collect();
        let size = UVec2::new(1 + rng.next_u32() % 60, 1 + rng.next_u32() % 60);
        let channels: Vec<_> = (0..channel_count).map(|_| any_channel(&mut rng, size)).collect();
        let examples = Arc::new(Examples::new(&pairs, &params).unwrap());
        let mut depth = Grid::new(size, 0);
        let mut wall = Analogy::new(examples, &depth, &channels, case).unwrap();
        assert_eq!(wall.color(0, 0), [0; 4], "nothing is made yet");
        let mut other = wall.clone();
        wall.finish();
        for _ in 0..2 {
            let before = wall.sources();
            let rect = any_change(&mut rng, &mut depth);
            wall.update(&depth, &[rect]).unwrap();
            other.update(&depth, &[rect]).unwrap();
            wall.finish();
            let is_far = |at: &UVec2| distance(*at, rect, size, params.is_tileable) > wall.window();
            for at in texels(size).filter(is_far) {
                assert_eq!(wall.source(at.x, at.y), before.get(at.x, at.y), "case {case}: {at} of {rect:?}");
            }
        }
        while other.step(1 + u64::from(rng.next_u32() % 300)) {}
        assert!(wall.sources() == other.sources(), "case {case}: the size of steps matters");
        for at in texels(size) {
            let source = wall.source(at.x, at.y).unwrap();
            let [u, v] = source.texel.map(u32::from);
            assert_eq!(
                Some(wall.color(at.x, at.y)),
                pairs[usize::from(source.pair)].picture().get(u, v),
                "case {case}"
            );
        }
    }
}

fn texels(size: UVec2) -> impl Iterator<Item = UVec2> {
    (0..size.y).flat_map(move |y| (0..size.x).map(move |x| UVec2::new(x, y)))
}

/// Columns or rows from a texel to a rectangle, whichever are more.
fn distance(texel: UVec2, rect: TexelRect, size: UVec2, wraps: bool) -> u32 {
    let axis = |at: u32, low: u32, high: u32, side: u32| {
        let apart = |at: i64| (i64::from(low) - at).max(at + 1 - i64::from(high)).max(0) as u32;
        let (at, side) = (i64::from(at), i64::from(side));
        if wraps { apart(at).min(apart(at - side)).min(apart(at + side)) } else { apart(at) }
    };
    axis(texel.x, rect.min.x, rect.max.x, size.x).max(axis(texel.y, rect.min.y, rect.max.y, size.y))
}

/// Draws a short crack; returns where.
fn any_change(rng: &mut Rng, depth: &mut Grid<u16>) -> TexelRect {
    let size = depth.size();
    let min = UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
    let max = (min + UVec2::new(1 + rng.next_u32() % 6, 1 + rng.next_u32() % 6)).min(size);
    for y in min.y..max.y {
        depth.row_mut(y as usize)[min.x as usize..max.x as usize].fill(if rng.unit() < 0.8 { 65535 } else { 0 });
    }
    TexelRect { min, max }
}

/// Each distance against those to all texels of the other kind.
#[test]
fn ramps_are_distances() {
    let mut rng = Rng::new(5);
    for _ in 0..40 {
        let size = UVec2::new(1 + rng.next_u32() % 40, 1 + rng.next_u32() % 40);
        let cracks: Vec<bool> = cracks(&mut rng, size, 2).as_slice().iter().map(|&value| value > 0.0).collect();
        let (reach, wraps) = (2 + rng.next_u32() % 8, rng.unit() < 0.5);
        let is_crack = |x: u32, y: u32| cracks[(y * size.x + x) as usize];
        let min = UVec2::new(rng.next_u32() % size.x, rng.next_u32() % size.y);
        let rect = TexelRect { min, max: size };
        let got = ramp::ramp(size, rect, reach, 1, wraps, is_crack);
        let at = |texel: IVec2| {
            let inside = if wraps { texel.rem_euclid(size.as_ivec2()) } else { texel };
            inside.cmpge(IVec2::ZERO).all()
                && inside.cmplt(size.as_ivec2()).all()
                && is_crack(inside.x as u32, inside.y as u32)
        };
        let all = (min.y..size.y).flat_map(|y| (min.x..size.x).map(move |x| IVec2::new(x as i32, y as i32)));
        for (texel, got) in all.zip(got) {
            let (own, far) = (at(texel), reach as i32 + 1);
            let offsets = (-far..=far).flat_map(|y| (-far..=far).map(move |x| IVec2::new(x, y)));
            let least = offsets.filter(|&by| at(texel + by) != own).map(|by| by.length_squared()).min();
            let distance = least.map_or(f32::INFINITY, |square| (square as f32).sqrt() - 0.5);
            let share = (distance / reach as f32).min(1.0).sqrt();
            let want = 127.5 + 127.5 * if own { -share } else { share };
            // What is out of reach counts as `reach` away, and what is exactly at it may count as either.
            let slack = if distance + 0.5 >= reach as f32 { 127.5 * 0.5 / reach as f32 + 1.0 } else { 1.0 };
            assert!((f32::from(got) - want).abs() <= slack, "{got}, not {want}: {texel} of {size}, reach {reach}");
        }
    }
}

/// The margins of the pyramids hold what lies at the border, and each level is the mean of the one before.
#[test]
fn levels_are_means() {
    let mut rng = Rng::new(8);
    let size = UVec2::new(41, 32);
    let pairs = [pair(&mut rng, size), pair(&mut rng, size + 7).tileable()];
    let examples = Examples::new(&pairs, &AnalogyParams::DEFAULT).unwrap();
    assert_eq!(examples.atlases.len(), 2, "a level of less than 12 texels is too small");
    let [fine, coarse] = &examples.atlases[..] else { panic!() };
    for (index, sheet) in coarse.sheets.iter().enumerate() {
        for (x, y) in (0..sheet.size.y).flat_map(|y| (0..sheet.size.x).map(move |x| (x, y))) {
            let finer = fine.sheets[index];
            let texel = |dx, dy| {
                fine.texels[fine.index(finer.place((2 * UVec2::new(x, y) + UVec2::new(dx, dy)).min(finer.size - 1)))]
            };
            let four = [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)];
            let got = coarse.texels[coarse.index(sheet.place(UVec2::new(x, y)))];
            for channel in 0..4 {
                let sum: u32 = four.iter().map(|texel| u32::from(texel[channel])).sum();
                assert_eq!(u32::from(got[channel]), (sum + 2) / 4);
            }
        }
        let corner = sheet.min - 2;
        let outside = coarse.texels[corner.y as usize * coarse.stride + corner.x as usize];
        let inside = if index == 1 { sheet.size - 2 } else { UVec2::ZERO };
        assert_eq!(outside, coarse.texels[coarse.index(sheet.place(inside))]);
    }
}

/// At the end no neighbour offers a place that fits better, but for what later changes around a texel have left.
#[test]
fn most_texels_have_the_best_place_that_continues_a_neighbour() {
    let mut rng = Rng::new(2);
    let size = UVec2::splat(64);
    let params = AnalogyParams { variety: 0.0, passes: 4, ..AnalogyParams::DEFAULT };
    let pair = pair(&mut rng, size);
    let examples = Arc::new(Examples::new(&[pair], &params).unwrap());
    let mut wall = Analogy::new(examples.clone(), &depths(&cracks(&mut rng, size, 3)), &[], 1).unwrap();
    wall.finish();
    let (level, atlas) = (wall.full(), &examples.atlases[0]);
    // Plain floating point, from the definition.
    let cost = |texel: IVec2, place: u32| {
        let mut sum = 0.0_f64;
        for (dy, dx) in (0..SIDE as i32).flat_map(|y| (0..SIDE as i32).map(move |x| (y, x))) {
            let by = IVec2::new(dx, dy) - RADIUS as i32;
            let near = 8.0 / (1.0 + f64::from(by.length_squared()) / 6.0);
            let wanted = level.texels[level.index(level.inside(texel + by))];
            let at = (atlas.index(place) as i64 + i64::from(by.y) * atlas.stride as i64 + i64::from(by.x)) as usize;
            for (channel, &wanted) in wanted.iter().enumerate() {
                let weight = match channel {
                    3 => (3.0 * f64::from(params.guide) * near).round(),
                    _ if by == IVec2::ZERO => 0.0,
                    _ => near.round().max(1.0),
                };
                let off = f64::from(atlas.texels[at][channel]) - f64::from(wanted);
                sum += weight * off * off;
            }
        }
        sum
    };
    let (mut worse, mut count) = (0, 0);
    for (x, y) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))) {
        let texel = UVec2::new(x, y);
        let own = cost(texel.as_ivec2(), level.places[level.index(texel)]);
        let offers = [[-1, 0], [1, 0], [0, -1], [0, 1]].map(IVec2::from).into_iter().filter_map(|by| {
            let place = level.places[level.index(level.neighbour(texel, by)?)];
            assert_ne!(place, NOWHERE);
            atlas.moved(place, -by)
        });
        count += 1;
        worse += u32::from(offers.map(|place| cost(texel.as_ivec2(), place)).any(|other| other < own));
    }
    assert!(worse * 20 < count, "{worse} of {count} texels have a neighbour with a better place");
}

/// What a change costs does not depend on the size of the surface.
#[test]
fn a_change_costs_what_changes() {
    let mut rng = Rng::new(4);
    let examples = Arc::new(Examples::new(&[pair(&mut rng, UVec2::splat(64))], &AnalogyParams::DEFAULT).unwrap());
    let visits = |side: u32| {
        let mut depth = Grid::new(UVec2::splat(side), 0);
        let mut wall = Analogy::new(examples.clone(), &depth, &[], 1).unwrap();
        wall.finish();
        wall.take_changed();
        depth.row_mut(60)[60..80].fill(65535);
        wall.update(&depth, &[TexelRect { min: UVec2::splat(60), max: UVec2::new(80, 61) }]).unwrap();
        let mut calls = 0_u64;
        // A call does at least one row of a pass.
        while wall.step(1) {
            calls += 1;
        }
        let area: u64 = wall.take_changed().iter().map(TexelRect::area).sum();
        // What is told is rounded to tiles of 16 texels.
        assert!(area <= (20 + 2 * 17 + 30) * (1 + 2 * 17 + 30), "{area}");
        (calls, area)
    };
    assert_eq!(visits(128), visits(512));
}

/// Red on the left of a crack, blue on its right: with the orientation texels come from the side on which they lie, and
/// with a channel from where it says.
#[test]
fn orientation_and_channels_choose_the_side() {
    let size = UVec2::new(64, 64);
    let photo: Vec<u8> = texels(size)
        .flat_map(|at| match at.x {
            30..33 => [9, 9, 9, 255],
            0..30 => [200, 60, 60, 255],
            _ => [60, 60, 200, 255],
        })
        .collect();
    let pair = AnalogyPair::from_darkness(size, &photo, 0.1).unwrap();
    let mut depth = Grid::new(UVec2::new(80, 40), 0);
    for y in 0..40 {
        depth.row_mut(y)[50..53].fill(u16::MAX);
    }
    // The share of texels near the crack, on either side, that are red.
    let red = |params: AnalogyParams, pair: AnalogyPair, channels: &[Grid<f32>]| {
        let mut wall = Analogy::new(Arc::new(Examples::new(&[pair], &params).unwrap()), &depth, channels, 1).unwrap();
        wall.finish();
        [41..49, 54..62].map(|columns: std::ops::Range<u32>| {
            let all = columns.flat_map(|x| (0..40).map(move |y| (x, y)));
            all.filter(|&(x, y)| wall.color(x, y)[0] > 100).count() as f32 / 320.0
        })
    };
    let params = AnalogyParams { orientation: 2.0, ..AnalogyParams::DEFAULT };
    let [left, right] = red(params, pair.clone(), &[]);
    assert!(left > 0.95 && right < 0.05, "{left} {right}");
    // The channel is 1 where the photograph is red; wanted on the upper half of both sides.
    let channel = |size: UVec2, is_one: fn(UVec2) -> bool| {
        Grid::from_vec(size, texels(size).map(|at| if is_one(at) { 1.0 } else { 0.0 }).collect()).unwrap()
    };
    let pair = pair.with_channel(channel(size, |at| at.x < 31)).unwrap();
    let wanted = channel(UVec2::new(80, 40), |at| at.y < 20);
    let shares = red(AnalogyParams { extra: 4.0, ..AnalogyParams::DEFAULT }, pair, &[wanted]);
    assert!(shares.iter().all(|share| (0.45..0.55).contains(share)), "{shares:?}");
}

/// A slope is taken out, texture and alpha stay.
#[test]
fn slow_shading_is_taken_out() {
    let size = UVec2::new(120, 90);
    let texel = |i: u32| {
        let (x, y) = (i % 120, i / 120);
        let fine = if (x / 2 + y / 2) % 2 == 0 { 8 } else { 0 };
        [(40 + x + fine) as u8, (60 + y + fine) as u8, 90, x as u8]
    };
    let rgba: Vec<u8> = (0..120 * 90).flat_map(texel).collect();
    let mut guide = Grid::new(size, 0.0);
    guide.row_mut(3)[3] = 1.0;
    let pair = AnalogyPair::new(size, &rgba, guide).unwrap();
    let flat = pair.clone().flattened(6).unwrap();
    // Away from the borders, where a box is not cut.
    for (x, y) in (24..96).flat_map(|x| (24..66).map(move |y| (x, y))) {
        let [r, g, b, a] = flat.picture().get(x, y).unwrap();
        let fine = if (x / 2 + y / 2) % 2 == 0 { 4 } else { -4 };
        let mean = [40.0 + 59.5 + 4.0, 60.0 + 44.5 + 4.0];
        for (got, mean) in [r, g].into_iter().zip(mean) {
            assert!((f64::from(got) - mean - f64::from(fine)).abs() < 2.5, "{x}, {y}: {got}");
        }
        assert_eq!((b, a), (90, x as u8));
    }
    for radius in [0, 3, 513] {
        assert!(matches!(pair.clone().flattened(radius), Err(AnalogyError::OutOfRange { name: "radius", .. })));
    }
}

/// A good pair of 20 x 20 texels, and a picture of that size.
fn good() -> (UVec2, AnalogyPair, Vec<u8>) {
    let size = UVec2::splat(20);
    (size, pair(&mut Rng::new(1), size), vec![90; 1600])
}

#[test]
fn pictures_and_guides_that_do_not_fit_are_refused() {
    let (size, good, rgba) = good();
    let guide = good.cracks().clone();
    let refused = |size: [u32; 2], rgba: &[u8], guide| AnalogyPair::new(size.into(), rgba, guide).unwrap_err();
    let (width, height) = (20, 20);
    assert_eq!(refused([20, 20], &rgba[4..], guide.clone()), AnalogyError::PictureSize { width, height, bytes: 1596 });
    let other = Grid::new(UVec2::new(20, 21), 0.0);
    assert!(matches!(refused([20, 20], &rgba, other), AnalogyError::SizesDiffer { name: "cracks", height: 21, .. }));
    let mut guide = guide;
    guide.row_mut(7)[3] = f32::NAN;
    assert_eq!(refused([20, 20], &rgba, guide), AnalogyError::NotFinite { name: "cracks", x: 3, y: 7 });
    assert_eq!(AnalogyPair::from_lines(size, &rgba), Err(AnalogyError::NoLines));
    for lightness in [-0.1, 1.1, f32::NAN] {
        let error = AnalogyPair::from_darkness(size, &rgba, lightness);
        assert!(matches!(error, Err(AnalogyError::OutOfRange { name: "lightness", .. })));
    }
}

/// Before memory is taken, and before the guide is looked at.
#[test]
fn photographs_of_a_wrong_size_are_refused() {
    for side in [0, 1, 15, 8193, 20_000, u32::MAX] {
        let size = UVec2::splat(side);
        let errors = [
            AnalogyPair::new(size, &[], Grid::new(UVec2::ONE, 0.0)),
            AnalogyPair::from_lines(size, &[]),
            AnalogyPair::from_darkness(size, &[], 0.2),
        ];
        let (width, height) = (side, side);
        for error in errors {
            assert_eq!(error, Err(AnalogyError::ExampleSize { width, height, least: 16, most: 8192 }));
        }
    }
}

#[test]
fn channels_that_do_not_fit_are_refused() {
    let (size, good, _) = good();
    let small = Grid::new(UVec2::ONE, 0.0);
    assert!(matches!(good.clone().with_channel(small), Err(AnalogyError::SizesDiffer { name: "channel", .. })));
    let channel = || Grid::new(size, 0.5);
    let with_one = good.clone().with_channel(channel()).unwrap();
    let full = (0..6).try_fold(good.clone(), |pair, _| pair.with_channel(channel())).unwrap();
    let error = full.with_channel(channel()).unwrap_err();
    assert!(matches!(error, AnalogyError::ChannelCount { count: 7, most: 6, .. }));
    let error = Examples::new(&[good.clone(), with_one.clone()], &AnalogyParams::DEFAULT).unwrap_err();
    assert!(matches!(error, AnalogyError::ChannelCount { count: 1, expected: 0, .. }));
    let examples = |pair| Arc::new(Examples::new(&[pair], &AnalogyParams::DEFAULT).unwrap());
    let depth = Grid::new(UVec2::splat(9), 0);
    let wall = |examples, value| Analogy::new(examples, &depth, &[Grid::new(UVec2::splat(9), value)], 1).unwrap_err();
    assert!(matches!(wall(examples(good), 0.0), AnalogyError::ChannelCount { count: 1, expected: 0, .. }));
    let error = wall(examples(with_one), f32::INFINITY);
    assert_eq!(error, AnalogyError::NotFinite { name: "channel", x: 0, y: 0 });
}

#[test]
fn pairs_without_cracks_or_without_ground_are_refused() {
    let (size, good, rgba) = good();
    let params = AnalogyParams::DEFAULT;
    let refused = |pairs: &[AnalogyPair]| Examples::new(pairs, &params).unwrap_err();
    let with = |value| AnalogyPair::new(size, &rgba, Grid::new(size, value)).unwrap();
    assert_eq!(refused(&[with(0.0)]), AnalogyError::NoCrack { depth: 0.15 });
    assert_eq!(refused(&[with(1.0)]), AnalogyError::AllCrack { depth: 0.15 });
    assert_eq!(refused(&[]), AnalogyError::PairCount { count: 0, most: 16 });
    assert_eq!(refused(&vec![good.clone(); 17]), AnalogyError::PairCount { count: 17, most: 16 });
    assert!(Examples::new(&[with(0.0), good], &params).is_ok(), "an uncracked picture beside a cracked one is allowed");
}

#[test]
fn parameters_out_of_range_are_named() {
    for name in
        ["reach", "depth", "guide", "orientation", "coherence", "variety", "levels", "passes", "tries", "margin"]
    {
        let mut params = AnalogyParams::DEFAULT;
        for text in ["1000", "-1", "x", "NaN"] {
            let error = params.set(name, text).unwrap_err();
            assert!(error.to_string().contains(&format!("`{name}`")), "{error}");
        }
        assert_eq!(params, AnalogyParams::DEFAULT);
    }
    let unknown = AnalogyParams::DEFAULT.clone().set("speed", "1");
    assert_eq!(unknown, Err(AnalogyError::Unknown { name: "speed".into() }));
    let bad = AnalogyParams { coherence: f32::NAN, ..AnalogyParams::DEFAULT };
    assert!(matches!(Examples::new(&[good().1], &bad), Err(AnalogyError::OutOfRange { name: "coherence", .. })));
}

#[test]
fn surfaces_and_maps_of_a_wrong_size_are_refused() {
    let examples = Arc::new(Examples::new(&[good().1], &AnalogyParams::DEFAULT).unwrap());
    for [width, height] in [[0, 5], [5, 0], [8193, 1]] {
        let error = Analogy::new(examples.clone(), &Grid::new(UVec2::new(width, height), 0), &[], 1).unwrap_err();
        assert_eq!(error, AnalogyError::SurfaceSize { width, height, most: 8192 });
    }
    let depth = Grid::new(UVec2::splat(9), 0);
    let mut wall = Analogy::new(examples, &depth, &[], 1).unwrap();
    let small = Grid::new(UVec2::splat(8), 0);
    let refused = wall.update(&small, &[TexelRect::whole(UVec2::splat(8))]);
    assert!(matches!(refused, Err(AnalogyError::SizesDiffer { name: "depth", .. })));
    assert!(wall.carry(&[&depth, &depth], 0).is_err(), "two maps for one pair");
    assert!(wall.carry(&[&depth], 0).is_err(), "a map of another size");
    // All crack, and rectangles beyond the border.
    let all = Grid::new(UVec2::splat(9), u16::MAX);
    wall.update(&all, &[TexelRect { min: UVec2::ZERO, max: UVec2::MAX }, TexelRect::default()]).unwrap();
    wall.update(&all, &[TexelRect { min: UVec2::splat(40), max: UVec2::MAX }]).unwrap();
    wall.finish();
    assert!(!wall.is_busy() && wall.progress() == 1.0);
}

/// A photograph with wide cracks that are dark in the middle: a crack of one texel gets that middle too.
#[test]
fn a_thin_crack_is_as_dark_as_the_wide_ones_of_the_photograph() {
    let size = UVec2::new(64, 64);
    let light = |x: u32| [200, 120, 40, 120, 200][(x.clamp(29, 33) - 29) as usize];
    let photo: Vec<u8> = texels(size).flat_map(|at| [light(at.x), light(at.x), light(at.x), 255]).collect();
    let is_crack = |at: UVec2| if (29..34).contains(&at.x) { 1.0 } else { 0.0 };
    let guide = Grid::from_vec(size, texels(size).map(is_crack).collect()).unwrap();
    let pair = AnalogyPair::new(size, &photo, guide).unwrap();
    let examples = Arc::new(Examples::new(&[pair], &AnalogyParams::DEFAULT).unwrap());
    let mut depth = Grid::new(size, 0);
    (0..64).for_each(|y| depth.row_mut(y)[20] = u16::MAX);
    let mut wall = Analogy::new(examples, &depth, &[], 1).unwrap();
    wall.finish();
    let dark = (0..64).filter(|&y| wall.color(20, y)[0] == 40).count();
    assert!(dark > 60, "{dark} of 64 rows");
}

/// A photograph with a crack every 12 texels, a surface with none: all rows between the cracks are used, not only the
/// one in their middle.
#[test]
fn ground_far_from_cracks_is_made_of_many_texels() {
    let size = UVec2::new(96, 96);
    let mut rng = Rng::new(6);
    let light = |y: u32, rng: &mut Rng| if y.is_multiple_of(12) { 10 } else { 120 + (rng.next_u32() % 80) as u8 };
    let photo: Vec<u8> = texels(size).flat_map(|at| [light(at.y, &mut rng), 90, 80, 255]).collect();
    let pair = AnalogyPair::from_darkness(size, &photo, 0.28).unwrap();
    let examples = Arc::new(Examples::new(&[pair], &AnalogyParams::DEFAULT).unwrap());
    let mut wall = Analogy::new(examples, &Grid::new(UVec2::splat(200), 0), &[], 1).unwrap();
    wall.finish();
    let rows: std::collections::BTreeSet<u16> =
        wall.sources().as_slice().iter().map(|from| from.texel[1] % 12).collect();
    assert!(rows.len() >= 3, "{rows:?}");
}

/// A step of nothing does a little: who waits for the end does not wait for ever.
#[test]
fn steps_of_nothing_end() {
    let (size, mut rng) = (UVec2::splat(24), Rng::new(3));
    let examples = Arc::new(Examples::new(&[pair(&mut rng, size)], &AnalogyParams::DEFAULT).unwrap());
    let mut wall = Analogy::new(examples, &depths(&cracks(&mut rng, size, 2)), &[], 1).unwrap();
    assert!((0..1_000_000).any(|_| !wall.step(0)));
    assert!(!wall.is_busy() && !wall.take_changed().is_empty());
}
