//! Image analogies with the pairs that ship, as a game uses them.

use bevy_crack::{
    CrackPreset, Grid,
    growth::CrackGrowth,
    paint::analogy::{Analogy, AnalogyPair, AnalogyParams, Examples},
    pattern::SurfaceFrame,
    raster::{DepthField, TexelRect, stamp_path},
    voronoi::{VoronoiBake, VoronoiParams},
};
use glam::{UVec2, Vec2};
use image::RgbaImage;
use std::{fs, path::PathBuf, sync::Arc, thread};

const NAMES: [&str; 3] = ["clay", "concrete", "paving"];

fn picture(name: &str) -> RgbaImage {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets/analogies").join(name).with_extension("png");
    image::open(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).to_rgba8()
}

fn pair(name: &str) -> AnalogyPair {
    let (photo, mask) = (picture(name), picture(&format!("{name}_mask")));
    let guide = mask.pixels().map(|texel| f32::from(texel[0]) / 255.0).collect();
    let size = UVec2::from(photo.dimensions());
    let pair = AnalogyPair::new(size, photo.as_raw(), Grid::from_vec(size, guide).unwrap()).unwrap();
    if name == "clay" { pair } else { pair.tileable() }
}

fn examples(name: &str) -> Arc<Examples> {
    Arc::new(Examples::new(&[pair(name)], &AnalogyParams::DEFAULT).unwrap())
}

/// The parameters in the file of a pair.
fn shipped(name: &str) -> AnalogyParams {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("assets/analogies/{name}.analogy.ron"));
    let (text, mut params) = (fs::read_to_string(path).unwrap(), AnalogyParams::DEFAULT);
    let (_, fields) = text.split_once("params: (").unwrap();
    for (field, value) in fields.split_once(')').unwrap().0.split(',').filter_map(|field| field.split_once(':')) {
        params.set(field.trim(), value).unwrap();
    }
    params
}

/// The presets beside the photographs can be read, and a hit in the middle cracks most of a surface without a crater.
#[cfg(feature = "serde")]
#[test]
fn each_photograph_has_a_preset_that_cracks_as_it_does() {
    for name in NAMES {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("assets/analogies/{name}.crack.ron"));
        let preset = CrackPreset::from_ron(&fs::read_to_string(path).unwrap()).unwrap();
        preset.validate().unwrap();
        assert!(preset.look.crushed.is_none() && preset.look.facets.is_none(), "{name}");
        let mut growth = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, 1).unwrap();
        growth.hit(Vec2::splat(0.5), 4.0);
        while growth.step().grew() {}
        let nodes: Vec<Vec2> = growth.network().nodes().iter().map(|node| node.pos).collect();
        let parts = (0..16).filter(|part| {
            let min = Vec2::new((part % 4) as f32, (part / 4) as f32) / 4.0;
            nodes.iter().any(|at| at.cmpge(min).all() && at.cmplt(min + 0.25).all())
        });
        assert!(parts.count() >= 14, "{name}");
    }
}

/// Seams of a map as depths.
fn seams(size: UVec2, sites: u32) -> Grid<u16> {
    let params = VoronoiParams { sites, ..VoronoiParams::DEFAULT };
    let (_, seams) = VoronoiBake::new(params, Vec::new(), size, 1).unwrap().finish();
    let mut field = DepthField::new(SurfaceFrame::new(size).unwrap());
    seams.stamp(&mut field, &CrackPreset::CONCRETE.profile);
    field.depth
}

#[test]
fn the_own_guide_gives_the_photograph() {
    for (name, params) in NAMES.into_iter().flat_map(|name| [(name, AnalogyParams::DEFAULT), (name, shipped(name))]) {
        let pair = pair(name);
        // Beyond the borders of both lies the same.
        let params = AnalogyParams { is_tileable: pair.is_tileable(), ..params };
        let examples = Arc::new(Examples::new(std::slice::from_ref(&pair), &params).unwrap());
        let depth = pair.cracks().as_slice().iter().map(|&value| (value * 65535.0) as u16).collect();
        let mut wall = Analogy::new(examples, &Grid::from_vec(pair.size(), depth).unwrap(), &[], 3).unwrap();
        wall.finish();
        let colors = wall.colors();
        let texels = colors.as_slice().iter().zip(pair.picture().as_slice());
        let off =
            |(a, b): (&[u8; 4], &[u8; 4])| a.iter().zip(b).take(3).map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>();
        let (count, same) = (colors.as_slice().len(), texels.filter(|&pair| off(pair) < 3).count());
        println!("{name}: {same} of {count} texels are those of the photograph");
        assert!(same * 100 >= count * 99, "{name}: {same} of {count}");
    }
}

/// Guides agree at least as well as those of other software: 89 % for paving, measured with `texture-synthesis` 0.8.2.
#[test]
fn cracks_are_where_the_pattern_has_them() {
    for name in NAMES {
        for (sites, params) in [12, 60].into_iter().flat_map(|n| [(n, AnalogyParams::DEFAULT), (n, shipped(name))]) {
            let examples = Arc::new(Examples::new(&[pair(name)], &params).unwrap());
            let mut wall = Analogy::new(examples, &seams(UVec2::new(260, 200), sites), &[], 1).unwrap();
            wall.finish();
            let agreement = wall.agreement(0.1);
            assert!(agreement > 0.985, "{name}, {sites} sites: {agreement}");
        }
    }
}

#[test]
fn maps_are_carried_with_the_colours() {
    let height = picture("concrete_height");
    let heights: Vec<u8> = height.pixels().map(|texel| texel[0]).collect();
    let heights = Grid::from_vec(height.dimensions().into(), heights).unwrap();
    let mut wall = Analogy::new(examples("concrete"), &seams(UVec2::new(150, 120), 8), &[], 1).unwrap();
    let half = wall.carry(&[&heights], 1).unwrap();
    assert!(half.as_slice().iter().all(|&value| value == 1), "nothing is made yet");
    wall.finish();
    let carried = wall.carry(&[&heights], 0).unwrap();
    let (sources, photo) = (wall.sources(), picture("concrete"));
    let mut painted = vec![7; 150 * 120 * 4];
    let rect = TexelRect { min: UVec2::new(10, 20), max: UVec2::new(150, 60) };
    wall.paint_into(rect, &mut painted);
    for (x, y) in (0..120).flat_map(|y| (0..150).map(move |x| (x, y))) {
        let source = sources.get(x, y).unwrap();
        let [u, v] = source.texel.map(u32::from);
        assert_eq!((source.pair, carried.get(x, y)), (0, heights.get(u, v)));
        let at = 4 * (y as usize * 150 + x as usize);
        let is_in = x >= 10 && (20..60).contains(&y);
        assert_eq!(painted[at..at + 4], if is_in { photo.get_pixel(u, v).0 } else { [7; 4] });
    }
    // Cracks are low.
    let ramp = wall.ramp();
    let mean = |is_crack: bool| {
        let values = ramp.as_slice().iter().zip(carried.as_slice()).filter(|(ramp, _)| (**ramp < 128) == is_crack);
        let values: Vec<f32> = values.map(|(_, &height)| f32::from(height)).collect();
        values.iter().sum::<f32>() / values.len() as f32
    };
    assert!(mean(true) + 20.0 < mean(false), "{} and {}", mean(true), mean(false));
}

/// A wall whose picture is the first pair, hit and cracked step by step.
#[test]
fn a_growing_crack_leaves_the_rest_as_it_is() {
    let size = UVec2::splat(320);
    let clay = picture("../textures/clay");
    let crop = image::imageops::crop_imm(&clay, 90, 120, 320, 320).to_image();
    // The wall's own picture, without cracks; the cracks come from the second pair.
    let base = AnalogyPair::new(size, crop.as_raw(), Grid::new(size, 0.0)).unwrap();
    let examples = Arc::new(Examples::new(&[base, pair("clay")], &AnalogyParams::DEFAULT).unwrap());
    let frame = SurfaceFrame::new(size).unwrap();
    let mut growth = CrackGrowth::new(CrackPreset::MUD.growth.clone(), frame.extent(), 5).unwrap();
    growth.hit(Vec2::new(0.3, 0.4), 2.0);
    let mut field = DepthField::new(frame);
    let mut wall = Analogy::new(examples, &field.depth, &[], 9).unwrap();
    wall.finish();
    assert!(wall.colors().as_slice().as_flattened() == crop.as_raw(), "without cracks it is the picture");
    let (mut steps, mut changed_texels, mut visited) = (0_u64, 0, 0);
    while steps < 100 {
        if !growth.step().grew() {
            growth.hit(Vec2::new(0.7, 0.6), 3.0);
            continue;
        }
        steps += 1;
        let before = (field.depth.clone(), wall.sources());
        for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
            stamp_path(&mut field, &CrackPreset::MUD.profile, &path);
        }
        let rects: Vec<TexelRect> = (0..size.y)
            .flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)))
            .filter(|at| field.depth.get(at.x, at.y) != before.0.get(at.x, at.y))
            .map(|min| TexelRect { min, max: min + 1 })
            .collect();
        wall.update(&field.depth, &rects).unwrap();
        wall.take_changed();
        wall.finish();
        visited += wall.take_changed().iter().map(TexelRect::area).sum::<u64>();
        changed_texels += rects.len();
        let mut near = Grid::new(size, false);
        for rect in &rects {
            let rect = rect.grow(wall.window(), size);
            for y in rect.min.y..rect.max.y {
                near.row_mut(y as usize)[rect.min.x as usize..rect.max.x as usize].fill(true);
            }
        }
        let after = wall.sources();
        let all = near.as_slice().iter().zip(before.1.as_slice()).zip(after.as_slice());
        assert!(
            all.clone().all(|((near, a), b)| *near || a == b),
            "step {steps}: a texel far from the change has changed"
        );
    }
    println!("{steps} steps: {changed_texels} texels of the cracks, {visited} texels made");
    assert!(changed_texels > 5000);
    // Less than the whole surface each time.
    assert!(visited < steps * u64::from(size.element_product()) / 3, "{visited}");
    // A run at once from the same end draws the same cracks.
    assert!(wall.agreement(0.1) > 0.985, "{}", wall.agreement(0.1));
    if let Some(folder) = std::env::var_os("CRACK_PICTURES") {
        let colors = wall.colors().as_slice().as_flattened().to_vec();
        RgbaImage::from_raw(size.x, size.y, colors)
            .unwrap()
            .save(PathBuf::from(folder).join("analogy_grown.png"))
            .unwrap();
    }
}

#[test]
fn threads_do_not_matter() {
    let (examples, depth) = (examples("paving"), seams(UVec2::new(130, 90), 9));
    let made = |step: u64| {
        let mut wall = Analogy::new(examples.clone(), &depth, &[], 4).unwrap();
        while wall.step(step) {}
        wall.sources()
    };
    let alone = made(u64::MAX);
    thread::scope(|scope| {
        let threads: Vec<_> = [1, 50, 1000, u64::MAX].map(|step| scope.spawn(move || made(step))).into_iter().collect();
        for thread in threads {
            assert!(thread.join().unwrap() == alone);
        }
    });
}

/// Steps of colour across the border against those inside. Only inside steps where texels of the smallest level meet
/// count, as they do at the border; what is copied together has smaller ones.
#[test]
fn tileable_results_have_no_seam_at_their_border() {
    let size = UVec2::new(160, 128);
    let params = AnalogyParams { is_tileable: true, ..AnalogyParams::DEFAULT };
    let jumps = |params: AnalogyParams| {
        let examples = Arc::new(Examples::new(&[pair("concrete")], &params).unwrap());
        let (mut border, mut inside) = (0.0, 0.0);
        for seed in 1..=8 {
            let mut wall = Analogy::new(examples.clone(), &Grid::new(size, 0), &[], seed).unwrap();
            wall.finish();
            let colors = wall.colors();
            let off = |a: UVec2, b: UVec2| {
                let [a, b] = [a, b].map(|at| colors.get(at.x, at.y).unwrap());
                (0..3).map(|channel| f64::from(a[channel].abs_diff(b[channel]))).sum::<f64>()
            };
            let column =
                |x: u32| (0..size.y).map(|y| off(UVec2::new(x, y), UVec2::new((x + 1) % size.x, y))).sum::<f64>();
            let meets = (1..size.x / 16).map(|at| 16 * at - 1);
            inside += meets.clone().map(column).sum::<f64>() / meets.count() as f64;
            border += column(size.x - 1);
        }
        border / inside
    };
    let (tileable, plain) = (jumps(params), jumps(AnalogyParams::DEFAULT));
    println!("step across the border against steps inside: {tileable:.3}, else {plain:.3}");
    assert!(tileable < 1.1 && tileable < plain, "{tileable} {plain}");
}
