//! Pictures as guides, masks and outlines: PNG files, and texels of any kind.

use super::{Input, run};
use crate::{
    CrackPreset, Grid,
    growth::CrackGrowth,
    pattern::{CrackMask, SurfaceFrame},
    relief::outlines,
    shatter::{Cuts, ShatterParams, shatter, tests::check_tiling},
    voronoi::{BakeStatus, Guide, MAX_SITES, SiteLayout, VoronoiBake, VoronoiParams, edges, ink, lightness},
};
use glam::{UVec2, Vec2};
use image::{ImageReader, Limits};
use std::io::Cursor;

/// The largest side of a picture that is used: larger ones take long.
const MOST_SIDE: u32 = 64;

/// A PNG file, with the limits of the command line tool; or texels.
fn picture(bytes: &[u8]) -> Option<(UVec2, Vec<u8>)> {
    if bytes.starts_with(b"\x89PNG") {
        let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?;
        let mut limits = Limits::default();
        limits.max_image_width = Some(MOST_SIDE);
        limits.max_image_height = Some(MOST_SIDE);
        limits.max_alloc = Some(1 << 20);
        reader.limits(limits);
        let picture = reader.decode().ok()?.into_rgba8();
        return Some((picture.dimensions().into(), picture.into_raw()));
    }
    let mut input = Input::new(bytes);
    let size = UVec2::new(input.below(MOST_SIDE), input.below(MOST_SIDE));
    let kind = input.byte() % 4;
    let [paper, pen] = [[input.byte(), input.byte(), input.byte(), 255], [input.byte(), input.byte(), 0, input.byte()]];
    let (period, slope) = (1 + input.below(16), input.below(4));
    let seed = input.word();
    let is_cut = input.once_in(48);
    let noise = input.rest();
    let at = |x: u32, y: u32| match kind {
        // Flat, lines, blocks of bricks, noise.
        0 => paper,
        1 if (x + slope * y).is_multiple_of(period) => pen,
        2 if x.is_multiple_of(period) || y.is_multiple_of(1 + period / 2) => pen,
        3 => {
            let i = (y * size.x + x) as usize;
            if noise.is_empty() { paper } else { [0, 1, 2, 3].map(|k| noise[(4 * i + k) % noise.len()] ^ seed as u8) }
        }
        _ => paper,
    };
    let mut texels: Vec<u8> = (0..size.y).flat_map(|y| (0..size.x).flat_map(move |x| at(x, y))).collect();
    if is_cut {
        texels.pop();
    }
    Some((size, texels))
}

/// All layers that can be made of it, and a growth on them.
fn check_masks(size: UVec2, rgba: &[u8], input: &mut Input) {
    let is_whole = size.min_element() > 0 && rgba.len() == (4 * size.x * size.y) as usize;
    assert_eq!(CrackMask::layer(size, rgba).is_ok(), is_whole);
    let Ok(mut mask) = CrackMask::from_picture(size, rgba) else {
        assert!(!is_whole);
        return;
    };
    assert!(is_whole);
    mask.density = Some(CrackMask::layer(size, rgba).unwrap());
    for layer in [&mask.weak, &mask.forbidden, &mask.density].into_iter().flatten() {
        assert!(layer.as_slice().iter().all(|value| (0.0..=1.0).contains(value)));
    }
    let frame = SurfaceFrame::new(size).unwrap();
    let name = input.choose(&CrackPreset::NAMES);
    let preset = CrackPreset::named(name).unwrap();
    let mut growth = CrackGrowth::new(preset.growth, frame.extent(), 3).unwrap();
    growth.set_mask(mask.clone());
    growth.hit(Vec2::new(input.unit(), input.unit()) * frame.extent(), 1.0);
    for _ in 0..input.below(40) {
        growth.step();
    }
    // Lines as they are drawn: those of masonry stray a little from their nodes.
    let network = growth.network();
    for path in network.segments().filter_map(|segment| network.path(segment)) {
        for pair in path.points().windows(2) {
            let [from, to] = [pair[0].pos, pair[1].pos].map(|pos| pos / frame.extent());
            assert!(!mask.blocks(from, to), "{name} on {size}: a crack where none may be: {from} to {to}");
        }
    }
}

fn params(input: &mut Input) -> VoronoiParams {
    let layout = match input.byte() % 6 {
        0 => SiteLayout::Uniform,
        1 => SiteLayout::Even,
        2 => SiteLayout::Impact { at: input.place(Vec2::ONE, 32), focus: input.mostly(1.0, 8.0, 64) },
        3 => {
            let size = UVec2::new(input.below(4), input.below(4));
            let values = (0..size.x * size.y).map(|_| input.mostly(0.0, 1.0, 8)).collect();
            SiteLayout::Density(Grid::from_vec(size, values).unwrap())
        }
        4 => SiteLayout::Given((0..input.below(12)).map(|_| input.place(Vec2::ONE, 16)).collect()),
        _ => SiteLayout::StrokePairs,
    };
    VoronoiParams {
        alpha: input.mostly(0.0, 30.0, 64),
        beta: input.mostly(0.1, 10.0, 64),
        sites: if input.once_in(64) { input.word() } else { input.below(60) },
        layout,
        levels: 1 + input.below(3),
        noise_scale: input.mostly(0.01, 1.0, 64),
        width: input.mostly(0.01, 0.2, 64),
        least_width: input.mostly(0.0, 0.01, 64),
        taper: input.mostly(0.0, 8.0, 64),
        stroke_width: input.mostly(0.0, 1.0, 64),
        guide_noise: input.mostly(0.0, 1.0, 64),
        roughness: input.mostly(0.0, 0.02, 64),
    }
}

/// The map and its seams, and the shards between them.
fn check_map(params: VoronoiParams, guides: Vec<Guide>, size: UVec2, seed: u64) {
    let is_allowed = params.validate(&guides).is_ok() && size.min_element() > 0;
    let begun = VoronoiBake::new(params.clone(), guides, size, seed);
    assert_eq!(begun.is_ok(), is_allowed, "{params:?}");
    let Ok(mut bake) = begun else { return };
    let mut done = 0.0;
    while let BakeStatus::Working(share) = bake.step(16) {
        assert!((done..=1.0).contains(&share), "progress falls from {done} to {share}");
        done = share;
    }
    let (map, seams) = bake.finish();
    // In strokes they are about twice as wide, more or less by the noise: 2 (1 + 0.6).
    let widest = 3.21 * params.width;
    let sites = map.sites();
    assert!(sites.len() <= MAX_SITES as usize && sites.iter().all(|site| site.cmplt(size).all()));
    for y in 0..size.y {
        for x in 0..size.x {
            let region = map.region(x, y);
            assert_eq!((region.is_some(), map.cost(x, y).is_some()), (!sites.is_empty(), !sites.is_empty()), "{x} {y}");
            assert!(region.is_none_or(|region| (region as usize) < sites.len()), "{x} {y}: {region:?}");
        }
    }
    for seam in &seams.seams {
        assert!(seam.from.max(seam.to) < seams.vertices.len() as u32);
        for point in &seam.points {
            let is_within = point.pos.cmpge(Vec2::ZERO).all() && point.pos.cmple(seams.extent).all();
            assert!(is_within && (0.0..=widest).contains(&point.width), "{point:?}");
        }
    }
    let mut cuts = Cuts::new(map.frame().extent()).unwrap();
    for seam in &seams.seams {
        cuts.add_line(&seam.points.iter().map(|point| point.pos).collect::<Vec<_>>()).unwrap();
    }
    check_tiling(
        &shatter(cuts, &ShatterParams { min_area: 0.0, max_shards: 100_000, ..ShatterParams::DEFAULT }).unwrap(),
    );
}

fn target(bytes: &[u8]) {
    let Some((size, rgba)) = picture(bytes) else { return };
    // What is made of it is decided by the end, for the beginning of a file is always the same.
    let reversed: Vec<u8> = bytes.iter().rev().copied().collect();
    let input = &mut Input::new(&reversed);
    check_masks(size, &rgba, input);
    let grids = [lightness(size, &rgba), ink(size, &rgba)];
    let is_whole = rgba.len() == (4 * size.x * size.y) as usize;
    assert!(grids.iter().all(|grid| grid.is_some() == is_whole));
    let Some(grid) = grids[usize::from(input.once_in(2))].clone() else { return };
    let grid = if input.once_in(3) { edges(&grid) } else { grid };
    assert!(grid.as_slice().iter().all(|value| (0.0..=1.0).contains(value)));
    let threshold = input.mostly(0.0, 1.0, 16);
    let lines = outlines(&grid, threshold);
    assert!(lines.is_ok() || size.min_element() == 0 || !threshold.is_finite(), "{threshold}");
    assert!(lines.into_iter().flatten().flatten().all(|point| point.is_finite()));
    let map_size = UVec2::new(1 + input.below(48), 1 + input.below(48));
    let gamma = input.mostly(0.0, 60.0, 32);
    let seed = u64::from(input.word());
    check_map(params(input), vec![Guide { image: grid, gamma }], map_size, seed);
}

#[test]
fn pictures() {
    run("pictures", 250, target);
}
