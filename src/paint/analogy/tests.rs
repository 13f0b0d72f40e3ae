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

fn any_channel(rng: &mut Rng, size: UVec2) -> Grid<f32> {
    let values = (0..size.element_product()).map(|_| rng.unit()).collect();
    Grid::from_vec(size, values).unwrap()
}

/// For random pairs, surfaces and parameters: every texel is a copy of a texel, updates change nothing outside of their window, and the
/// size of the steps does not matter.
#[test]
fn all_parameters_give_copies_and_local_updates() {
    for case in 0..cases(150) {
        let mut rng = Rng::new(case).stream("analogies");
        let params = any_params(&mut rng);
        let channels = (rng.next_u32() % 3) as usize;
        let pairs: Vec<_> = (0..1 + rng.next_u32() % 2)
            .map(|_| {
                let size = UVec2::new(16 + rng.next_u32() % 30, 16 + rng.next_u32() % 30);
                let mut pair = pair(&mut rng, size);
                for _ in 0..channels {
                    pair = pair.with_channel(any_channel(&mut rng, size)).unwrap();
                }
                if rng.unit() < 0.5 { pair.tileable() } else { pair }
            })
            .collect();
        let size = UVec2::new(1 + rng.next_u32() % 60, 1 + rng.next_u32() % 60);
        let channels: Vec<_> = (0..channels).map(|_| any_channel(&mut rng, size)).collect();
        let examples = Arc::new(Examples::new(&pairs, &params).unwrap());
        let mut depth = Grid::new(size, 0);
        let mut wall = Analogy::new(examples, &depth, &channels, case).unwrap();
        assert_eq!(wall.color(0, 0), [0; 4], "nothing is made yet");
        let mut other = wall.clone();
        wall.finish();
        for _ in 0..2 {
            let before = wall.sources();
            let rect = any_change(&mut rng, &mut depth);
            wall.update(&depth, rect).unwrap();
            other.update(&depth, rect).unwrap();
            wall.finish();
            let far = |(x, y): (u32, u32)| {
                let off = |at: u32, low: u32, high: u32, side: u32| {
                    let plain = low.saturating_sub(at).max((at + 1).saturating_sub(high));
                    let around = (at + side + 1).saturating_sub(high + if at < low { 0 } else { side });
                    let before = (low + side).saturating_sub(at);
                    if params.is_tileable { plain.min(around).min(before) } else { plain }
                };
                off(x, rect.min.x, rect.max.x, size.x).max(off(y, rect.min.y, rect.max.y, size.y)) > wall.window()
            };
            for (x, y) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))).filter(|&at| far(at)) {
                assert_eq!(Some(wall.source(x, y).unwrap()), before.get(x, y), "case {case}: {x}, {y} of {rect:?}");
            }
        }
        while other.step(1 + u64::from(rng.next_u32() % 300)) {}
        assert!(wall.sources() == other.sources(), "case {case}: the size of steps matters");
        for (x, y) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))) {
            let source = wall.source(x, y).unwrap();
            let [u, v] = source.texel.map(u32::from);
            assert_eq!(Some(wall.color(x, y)), pairs[usize::from(source.pair)].picture().get(u, v), "case {case}");
        }
    }
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
        let got = ramp::ramp(size, rect, reach, wraps, is_crack);
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
            let want = 127.5 + 127.5 * (if own { -distance } else { distance } / reach as f32).clamp(-1.0, 1.0);
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
            for channel in 0..4 {
                let weight = match channel {
                    3 => (3.0 * f64::from(params.guide) * near).round(),
                    _ if by == IVec2::ZERO => 0.0,
                    _ => near.round().max(1.0),
                };
                let off = f64::from(atlas.texels[at][channel]) - f64::from(wanted[channel]);
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
        wall.update(&depth, TexelRect { min: UVec2::splat(60), max: UVec2::new(80, 61) }).unwrap();
        let mut calls = 0_u64;
        // A call does at least one row of a pass.
        while wall.step(1) {
            calls += 1;
        }
        let area: u64 = wall.take_changed().iter().map(TexelRect::area).sum();
        (calls, area)
    };
    let small = visits(128);
    assert_eq!(small, visits(512));
    let reach = u64::from(AnalogyParams::DEFAULT.reach + AnalogyParams::DEFAULT.margin);
    assert!(small.1 <= (20 + 2 * reach) * (1 + 2 * reach), "{small:?}");
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

#[test]
fn bad_input_is_refused() {
    let mut rng = Rng::new(1);
    let size = UVec2::splat(20);
    let good = pair(&mut rng, size);
    let (rgba, guide) = (vec![90; 1600], cracks(&mut rng, size, 2));
    let refused =
        |size: [u32; 2], rgba: &[u8], guide: Grid<f32>| AnalogyPair::new(size.into(), rgba, guide).unwrap_err();
    let (width, height) = (20, 20);
    assert_eq!(refused([20, 20], &rgba[4..], guide.clone()), AnalogyError::PictureSize { width, height, bytes: 1596 });
    let other = Grid::new(UVec2::new(20, 21), 0.0);
    assert!(matches!(refused([20, 20], &rgba, other), AnalogyError::SizesDiffer { name: "cracks", height: 21, .. }));
    // Before memory is taken, and before the guide is looked at.
    let small = Grid::new(UVec2::ONE, 0.0);
    for side in [0, 1, 15, 8193, 20_000, u32::MAX] {
        let error = refused([side, side], &[], small.clone());
        assert!(matches!(error, AnalogyError::ExampleSize { least: 16, most: 8192, .. }), "{side}: {error}");
    }
    let mut guide = guide;
    guide.row_mut(7)[3] = f32::NAN;
    assert_eq!(refused([20, 20], &rgba, guide), AnalogyError::NotFinite { name: "cracks", x: 3, y: 7 });
    assert!(matches!(good.clone().with_channel(small), Err(AnalogyError::SizesDiffer { name: "channel", .. })));
    assert_eq!(AnalogyPair::from_lines(size, &rgba), Err(AnalogyError::NoLines));
    assert!(AnalogyPair::from_darkness(size, &rgba, f32::NAN).is_err());
    let mut full = good.clone();
    for _ in 0..6 {
        full = full.with_channel(Grid::new(size, 0.5)).unwrap();
    }
    assert!(matches!(
        full.with_channel(Grid::new(size, 0.5)),
        Err(AnalogyError::ChannelCount { count: 7, most: 6, .. })
    ));

    let params = AnalogyParams::DEFAULT;
    let examples = |pairs: &[AnalogyPair]| Examples::new(pairs, &params).unwrap_err();
    let with = |value| AnalogyPair::new(size, &rgba, Grid::new(size, value)).unwrap();
    assert_eq!(examples(&[with(0.0)]), AnalogyError::NoCrack { depth: 0.25 });
    assert_eq!(examples(&[with(1.0)]), AnalogyError::AllCrack { depth: 0.25 });
    assert_eq!(examples(&[]), AnalogyError::PairCount { count: 0, most: 16 });
    assert_eq!(examples(&vec![good.clone(); 17]), AnalogyError::PairCount { count: 17, most: 16 });
    let channel = good.clone().with_channel(Grid::new(size, 0.5)).unwrap();
    assert!(matches!(
        examples(&[good.clone(), channel.clone()]),
        AnalogyError::ChannelCount { count: 1, expected: 0, .. }
    ));
    for name in
        ["reach", "depth", "guide", "orientation", "coherence", "variety", "levels", "passes", "tries", "margin"]
    {
        let mut params = params;
        assert!(matches!(
            params.set(name, "1e9"),
            Err(AnalogyError::OutOfRange { .. } | AnalogyError::Unreadable { .. })
        ));
        assert!(params.set(name, "x").is_err() && params.set(name, "NaN").is_err());
        assert_eq!(params, AnalogyParams::DEFAULT);
    }
    // An uncracked picture beside a cracked one is allowed.
    let examples = Arc::new(Examples::new(&[with(0.0), good], &params).unwrap());
    let wall = |size: [u32; 2], channels: &[Grid<f32>]| {
        Analogy::new(examples.clone(), &Grid::new(size.into(), 0), channels, 1).map(|_| ())
    };
    assert!(matches!(wall([0, 5], &[]), Err(AnalogyError::SurfaceSize { .. })));
    assert!(matches!(wall([8193, 1], &[]), Err(AnalogyError::SurfaceSize { width: 8193, most: 8192, .. })));
    assert!(matches!(wall([9, 9], &[Grid::new(UVec2::splat(9), 0.0)]), Err(AnalogyError::ChannelCount { .. })));
    let with_channel = Arc::new(Examples::new(&[channel], &params).unwrap());
    let depth = Grid::new(UVec2::splat(9), 0);
    let wrong = Analogy::new(with_channel, &depth, &[Grid::new(UVec2::splat(9), f32::INFINITY)], 1);
    assert!(matches!(wrong, Err(AnalogyError::NotFinite { name: "channel", x: 0, y: 0 })));
    let mut wall = Analogy::new(examples, &depth, &[], 1).unwrap();
    let refused = wall.update(&Grid::new(UVec2::splat(8), 0), TexelRect::whole(UVec2::splat(8)));
    assert!(matches!(refused, Err(AnalogyError::SizesDiffer { name: "depth", .. })));
    assert!(wall.carry(&[&depth], 0).is_err(), "one map for two pairs");
    assert!(wall.carry(&[&depth, &depth], 0).is_err(), "maps of another size");
    // All crack, and rectangles beyond the border.
    let all = Grid::new(UVec2::splat(9), u16::MAX);
    wall.update(&all, TexelRect { min: UVec2::ZERO, max: UVec2::MAX }).unwrap();
    wall.update(&all, TexelRect { min: UVec2::splat(40), max: UVec2::MAX }).unwrap();
    wall.finish();
    assert!(!wall.is_busy() && wall.progress() == 1.0);
}
