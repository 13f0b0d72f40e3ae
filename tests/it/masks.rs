//! Masks: what is read out of pictures, and how it is asked.

use bevy_crack::{
    CrackPreset, Grid,
    growth::{CrackGrowth, GrowthParams},
    math::Rng,
    pattern::{CrackMask, MaskError, SurfaceFrame},
};
use glam::{UVec2, Vec2};
use image::RgbaImage;
use std::{path::Path, sync::Arc};

fn texture(name: &str) -> RgbaImage {
    image::open(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/textures").join(name)).unwrap().to_rgba8()
}

fn weak(picture: &RgbaImage) -> Option<Grid<f32>> {
    CrackMask::weak_from_picture(picture.dimensions().into(), picture.as_raw()).unwrap()
}

/// Distance of a point of `brick_red.png` (512 x 512) to the middle of the nearest mortar joint, texels. The wall has courses
/// of 32 texels and stones of 64, every other course half a stone along; each stone deviates by up to a texel.
fn to_joint(at: Vec2) -> f32 {
    let to_multiple = |x: f32, of: f32| (x - (x / of).round() * of).abs();
    let shift = if (at.y / 32.0).floor() as i32 % 2 == 0 { 0.0 } else { 32.0 };
    to_multiple(at.y, 32.0).min(to_multiple(at.x + shift, 64.0))
}

#[test]
fn the_mortar_of_a_brick_wall_is_one_clean_net() {
    let layer = weak(&texture("brick_red.png")).expect("a brick wall has joints");
    if let Some(folder) = std::env::var_os("SHOW_MASKS") {
        save(&layer, &Path::new(&folder).join("brick_red_weak.png"));
    }
    let mask = CrackMask { weak: Some(layer.clone()), ..CrackMask::default() };
    let (mut in_joints, mut found, mut marked, mut astray) = (0, 0, 0, 0);
    for y in 0..512 {
        for x in 0..512 {
            let at = Vec2::new(x as f32, y as f32) + 0.5;
            let is_marked = mask.weak_at(at / 512.0) > 0.5;
            in_joints += u32::from(to_joint(at) < 1.0);
            found += u32::from(to_joint(at) < 1.0 && is_marked);
            marked += u32::from(is_marked);
            astray += u32::from(to_joint(at) > 5.0 && is_marked);
        }
    }
    let (recall, error) = (found as f32 / in_joints as f32, astray as f32 / marked as f32);
    let cover = marked as f32 / (512.0 * 512.0);
    println!(
        "mortar: {:.1} % of the joints found, {:.2} % of the mask off them, {:.1} % covered",
        100.0 * recall,
        100.0 * error,
        100.0 * cover
    );
    assert!(recall > 0.95, "{recall}");
    assert!(error < 0.01, "{error}");
    assert!(cover < 0.25, "{cover}");
    let parts = parts(&layer);
    let most = *parts.iter().max().unwrap_or(&0) as f32 / parts.iter().sum::<usize>() as f32;
    assert!(most > 0.99, "the joints hang together: {parts:?}");
}

/// Share of the length of all drawn lines, over 24 seeds, that runs in the mortar of the brick wall, and how much of that runs up or
/// down rather than along a course.
fn length_in_mortar(preset: &CrackPreset, mask: &Arc<CrackMask>) -> [f32; 2] {
    let frame = SurfaceFrame::new(UVec2::splat(512)).unwrap();
    let (mut upright, mut inside, mut all) = (0.0, 0.0, 0.0);
    for seed in 0..24 {
        let mut rng = Rng::new(seed).stream("hits on a wall");
        let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), seed).unwrap();
        growth.set_mask(mask.clone());
        for _ in 0..2 {
            growth.hit(Vec2::new(rng.range(0.1, 0.9), rng.range(0.1, 0.9)), 1.0);
            while growth.step().grew() {}
        }
        for path in growth.network().segments().filter_map(|segment| growth.network().path(segment)) {
            for pair in path.points().windows(2) {
                let (from, to) = (frame.to_texel(pair[0].pos), frame.to_texel(pair[1].pos));
                let length = from.distance(to) / 8.0;
                all += 8.0 * length;
                let in_joint = (0..8).filter(|i| to_joint(from.lerp(to, (*i as f32 + 0.5) / 8.0)) < 4.0).count();
                inside += in_joint as f32 * length;
                upright += in_joint as f32 * (to.y - from.y).abs() / 8.0;
            }
        }
    }
    [inside / all, upright / inside]
}

/// With the wall's own mask at least 70 % of the length of cracks runs in the mortar, and they step from course to course, as cracks in
/// masonry do, whatever the inertia of the preset.
#[test]
fn cracks_of_a_brick_wall_run_in_the_mortar() {
    let picture = texture("brick_red.png");
    let own = Arc::new(CrackMask::from_picture(UVec2::splat(512), picture.as_raw()).unwrap());
    let inert = GrowthParams { inertia: 3.0, ..CrackPreset::CONCRETE.growth };
    let inert = CrackPreset { growth: inert, ..CrackPreset::CONCRETE };
    for (name, preset) in [("brick", CrackPreset::BRICK), ("concrete", CrackPreset::CONCRETE), ("inert", inert)] {
        let [[with, upright], [without, _]] = [&own, &Arc::default()].map(|mask| length_in_mortar(&preset, mask));
        println!(
            "{name}: {:.0} % of the length in the mortar with the mask, {:.0} % of it from course to course; {:.0} % without",
            100.0 * with,
            100.0 * upright,
            100.0 * without
        );
        assert!(with >= 0.7 && without < 0.5, "{name}: {with} against {without}");
        assert!(upright >= 0.2, "{name}: {upright}");
    }
}

/// Texels of each connected part above one half.
fn parts(layer: &Grid<f32>) -> Vec<usize> {
    let (w, h) = (layer.width() as i32, layer.height() as i32);
    let mut open: Vec<bool> = layer.as_slice().iter().map(|v| *v > 0.5).collect();
    let mut parts = Vec::new();
    for first in 0..open.len() {
        let (mut todo, mut count) = (vec![first as i32], 0);
        while let Some(i) = todo.pop() {
            if !core::mem::take(&mut open[i as usize]) {
                continue;
            }
            count += 1;
            for (dx, dy) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
                let (x, y) = (i % w + dx, i / w + dy);
                if (0..w).contains(&x) && (0..h).contains(&y) {
                    todo.push(y * w + x);
                }
            }
        }
        parts.extend((count > 0).then_some(count));
    }
    parts
}

fn save(layer: &Grid<f32>, path: &Path) {
    let texels = layer.as_slice().iter().map(|v| (255.0 * v) as u8).collect();
    image::GrayImage::from_raw(layer.size().x, layer.size().y, texels).unwrap().save(path).unwrap();
}

#[test]
fn joints_of_either_kind_are_found_and_edges_are_none() {
    let drawn = |size: u32, paint: &dyn Fn(u32, u32) -> u8| {
        let mut rng = Rng::new(3);
        RgbaImage::from_fn(size, size, |x, y| {
            let shade = paint(x, y).saturating_add((rng.unit() * 12.0) as u8);
            image::Rgba([shade, shade, shade, 255])
        })
    };
    for (size, pitch, thick) in [(256, 64, 3), (512, 64, 4), (700, 100, 8), (120, 30, 2)] {
        let is_joint = |x: u32, y: u32| x % pitch < thick || y % pitch < thick;
        for (ground, joint) in [(120, 190), (120, 60)] {
            let layer = weak(&drawn(size, &|x, y| if is_joint(x, y) { joint } else { ground })).expect("joints");
            let mask = CrackMask { weak: Some(layer), ..CrackMask::default() };
            let value = |x: f32, y: f32| mask.weak_at(Vec2::new(x, y) / size as f32);
            // Along each joint and along the middle of the stones, away from the crossings.
            let (middle, half) = (thick as f32 / 2.0, pitch as f32 / 2.0);
            for joint in (1..size / pitch).map(|i| (i * pitch) as f32) {
                for across in (0..size / pitch).map(|i| (i * pitch) as f32 + half) {
                    assert!(value(joint + middle, across) > 0.5, "{size}, {ground}: joint at x {joint}, y {across}");
                    assert!(value(across, joint + middle) > 0.5, "{size}, {ground}: joint at y {joint}, x {across}");
                    assert!(value(joint + half, across) < 0.1, "{size}, {ground}: stone at {joint}, {across}");
                }
            }
        }
        // The same distances as mere edges: a chessboard.
        let chess = drawn(size, &|x, y| if (x / pitch + y / pitch) % 2 == 0 { 190 } else { 120 });
        assert!(weak(&chess).is_none(), "a chessboard of {size} has no joints");
    }
}

/// Bricks cast shadows on their mortar: its joints have a light line and a dark one, side by side, so that neither stands out. What
/// tells them from bricks is that they have less colour, or more. In grey there is nothing to tell.
#[test]
fn joints_in_the_shadow_of_bricks_are_found_by_their_colour() {
    let wall = |[brick, joint]: [[f32; 3]; 2], is_grey: bool| {
        let mut rng = Rng::new(5);
        RgbaImage::from_fn(256, 256, |x, y| {
            let (x, y) = (x + 2, y + 2);
            let shift = if y % 64 < 32 { 0 } else { 32 };
            let (across, down) = ((x + shift) % 64, y % 32);
            let is_joint = across < 4 || down < 4;
            // One side is in the sun, the other in shadow; bricks are all alike but for their grain.
            let is_lit = if down < 4 { down < 2 } else { across < 2 };
            let light = if !is_joint {
                1.0
            } else if is_lit {
                1.3
            } else {
                0.7
            };
            let light = light * rng.range(0.94, 1.06) * 255.0;
            let [r, g, b] = if is_joint { joint } else { brick }.map(|v| (v * light) as u8);
            let grey = ((u16::from(r) + 2 * u16::from(g) + u16::from(b)) / 4) as u8;
            image::Rgba(if is_grey { [grey, grey, grey, 255] } else { [r, g, b, 255] })
        })
    };
    // As light as one another.
    let (red, grey) = ([0.6, 0.35, 0.3], [0.4; 3]);
    for colors in [[red, grey], [grey, red]] {
        let layer = weak(&wall(colors, false)).expect("joints");
        let mask = CrackMask { weak: Some(layer), ..CrackMask::default() };
        let share = |is: &dyn Fn(u32, u32) -> bool| {
            let places = (0..256 * 256).map(|i| (i % 256, i / 256)).filter(|&(x, y)| is(x, y));
            let at = |(x, y): (u32, u32)| Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / 256.0;
            let values: Vec<f32> = places.map(|place| mask.weak_at(at(place))).collect();
            values.iter().filter(|value| **value > 0.5).count() as f32 / values.len() as f32
        };
        let from_head = |x: u32, y: u32| {
            let across = (x + 2 + if (y + 2) % 64 < 32 { 0 } else { 32 }) % 64;
            across.abs_diff(2).min(66 - across)
        };
        let from_bed = |y: u32| ((y + 2) % 32).abs_diff(2).min(34 - (y + 2) % 32);
        let found = share(&|x, y| from_bed(y) < 2 || from_head(x, y) < 2);
        let astray = share(&|x, y| from_bed(y) > 5 && from_head(x, y) > 5);
        assert!(found > 0.9 && astray < 0.01, "{colors:?}: {found} of the joints, {astray} of the bricks");
        assert!(weak(&wall(colors, true)).is_none(), "{colors:?}: there is nothing to tell in grey");
    }
}

/// A red stripe on grey tiles, and the specks of other colours that a photograph has where it was saved with losses, do not take the
/// place of light joints.
#[test]
fn colours_do_not_hide_joints() {
    let tiles = |is_colored: bool| {
        let mut rng = Rng::new(6);
        // One colour for each block of eight texels, as photographs are saved.
        let blocks: Vec<[f32; 2]> = (0..32 * 32).map(|_| [0; 2].map(|_| rng.range(-14.0, 14.0))).collect();
        RgbaImage::from_fn(256, 256, |x, y| {
            let joint = x % 64 < 3 || y % 64 < 3;
            let light = if joint { 180.0 } else { 120.0 } + rng.range(-8.0, 8.0);
            if is_colored && (100..104).contains(&y) && !joint {
                return image::Rgba([190, 60, 50, 255]);
            }
            let [red, blue] = if is_colored { blocks[(y / 8 * 32 + x / 8) as usize] } else { [0.0; 2] };
            image::Rgba([(light + red) as u8, light as u8, (light + blue) as u8, 255])
        })
    };
    let [grey, colored] = [false, true].map(|is_colored| weak(&tiles(is_colored)).expect("joints"));
    let is_joint = |i: usize| i % 256 % 64 < 3 || i / 256 % 64 < 3;
    let share = |layer: &Grid<f32>, of: bool| {
        let values: Vec<f32> = (0..256 * 256).filter(|&i| is_joint(i) == of).map(|i| layer.as_slice()[i]).collect();
        values.iter().filter(|value| **value > 0.5).count() as f32 / values.len() as f32
    };
    for layer in [&grey, &colored] {
        assert!(
            share(layer, true) > 0.9 && share(layer, false) < 0.05,
            "{} {}",
            share(layer, true),
            share(layer, false)
        );
    }
}

#[test]
fn pictures_without_joints_have_no_lines() {
    for name in ["concrete_fine.png", "clay.png", "mud.png", "plaster.png", "asphalt.png"] {
        assert!(weak(&texture(name)).is_none(), "{name}");
    }
    for size in [1, 2, 3, 40] {
        assert!(weak(&RgbaImage::from_pixel(size, 1, image::Rgba([9, 9, 9, 255]))).is_none());
    }
    assert!(weak(&RgbaImage::new(3000, 2)).is_none());
}

#[test]
fn forbidden_is_what_is_less_than_half_opaque() {
    let size = UVec2::new(4, 1);
    let rgba: Vec<u8> = [0, 127, 128, 255].iter().flat_map(|alpha| [200, 10, 10, *alpha]).collect();
    let mask = CrackMask::from_picture(size, &rgba).unwrap();
    let forbidden = [0.1, 0.3, 0.6, 0.9].map(|u| mask.is_forbidden(Vec2::new(u, 0.5)));
    assert_eq!(forbidden, [true, true, false, false]);
    assert!(mask.is_forbidden(Vec2::new(-5.0, 9.0)), "beyond the border as at the border");
    assert!(!mask.is_forbidden(Vec2::NAN));
    let opaque = [7, 7, 7, 255].repeat(4);
    assert!(CrackMask::from_picture(size, &opaque).unwrap().is_empty());
}

/// A layer of random zeros and ones.
fn random_layer(rng: &mut Rng, share: f32) -> Grid<f32> {
    let size = UVec2::new(1 + (rng.unit() * 9.0) as u32, 1 + (rng.unit() * 9.0) as u32);
    let texels: Vec<u8> = (0..size.x * size.y).map(|_| if rng.unit() < share { 255 } else { 0 }).collect();
    CrackMask::layer(size, &texels).unwrap()
}

#[test]
fn lines_that_meet_a_forbidden_texel_are_blocked() {
    let mut rng = Rng::new(5);
    let (mut free, mut blocked) = (0, 0);
    for _ in 0..5_000 {
        let layer = random_layer(&mut rng, 0.15);
        let size = layer.size().as_dvec2();
        let mask = CrackMask { forbidden: Some(layer), ..CrackMask::default() };
        let mut point = || Vec2::new(rng.unit(), rng.unit());
        let (from, to) = (point(), point());
        // The length of the line within each texel, in double precision (slabs).
        let (a, b) = (from.as_dvec2() * size, to.as_dvec2() * size);
        let inside = |x: u32, y: u32| {
            let clip = |low: f64, a: f64, b: f64| {
                let (t0, t1) = ((low - a) / (b - a), (low + 1.0 - a) / (b - a));
                (t0.min(t1), t0.max(t1))
            };
            let ((x0, x1), (y0, y1)) = (clip(f64::from(x), a.x, b.x), clip(f64::from(y), a.y, b.y));
            x1.min(y1).min(1.0) - x0.max(y0).max(0.0)
        };
        let (mut most, mut least) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for y in 0..size.y as u32 {
            for x in 0..size.x as u32 {
                let center = (Vec2::new(x as f32, y as f32) + 0.5) / size.as_vec2();
                if mask.is_forbidden(center) {
                    most = most.max(inside(x, y));
                    least = least.max(inside(x, y) + 1.0e-5);
                }
            }
        }
        let is_blocked = mask.blocks(from, to);
        if most > 1.0e-5 {
            assert!(is_blocked, "{from} to {to} runs through a forbidden texel");
            blocked += 1;
        } else if least < 0.0 {
            assert!(!is_blocked, "{from} to {to} is free");
            free += 1;
        }
    }
    assert!(free > 1_000 && blocked > 1_000, "{free} free, {blocked} blocked");
}

#[test]
fn values_between_texels_are_bilinear() {
    let mut rng = Rng::new(6);
    for _ in 0..2_000 {
        let layer = random_layer(&mut rng, 0.5);
        let size = layer.size();
        let uv = Vec2::new(rng.unit() * 1.4 - 0.2, rng.unit() * 1.4 - 0.2);
        // The sum over all texels of tents around their centres.
        let at = (uv.as_dvec2() * size.as_dvec2()).clamp(glam::DVec2::splat(0.5), size.as_dvec2() - 0.5);
        let mut sum = 0.0;
        for y in 0..size.y {
            for x in 0..size.x {
                let tent = |center: f64, at: f64| (1.0 - (at - center).abs()).max(0.0);
                let weight = tent(f64::from(x) + 0.5, at.x) * tent(f64::from(y) + 0.5, at.y);
                sum += weight * f64::from(layer.get(x, y).unwrap());
            }
        }
        let mask = CrackMask { weak: Some(layer.clone()), strong: Some(layer), ..CrackMask::default() };
        assert!((f64::from(mask.weak_at(uv)) - sum).abs() < 1.0e-5, "{uv}");
        assert_eq!(mask.weak_at(uv), mask.strong_at(uv));
    }
}

#[test]
fn odd_layers_are_refused_or_harmless() {
    for (size, length) in [([0, 4], 0), ([2, 2], 3), ([2, 2], 5), ([2, 2], 8), ([20_000, 1], 20_000), ([1, 1], 0)] {
        let error = MaskError { width: size[0], height: size[1], length };
        assert_eq!(CrackMask::layer(size.into(), &vec![0; length]), Err(error));
        assert_eq!(CrackMask::from_picture(size.into(), &vec![0; length]), Err(error));
    }
    let strange = Grid::from_vec(UVec2::new(4, 1), vec![f32::NAN, f32::INFINITY, -3.0, 7.0]).unwrap();
    let none = Grid::new(UVec2::ZERO, 1.0);
    for layer in [strange, none] {
        let mask = CrackMask {
            weak: Some(layer.clone()),
            strong: Some(layer.clone()),
            forbidden: Some(layer),
            ..CrackMask::default()
        };
        for u in [-1.0e30, -1.0, 0.0, 0.1, 0.4, 0.6, 0.9, 1.0, 1.0e30, f32::NAN, f32::INFINITY] {
            let uv = Vec2::new(u, 0.5);
            assert!((0.0..=1.0).contains(&mask.weak_at(uv)) && (0.0..=1.0).contains(&mask.strong_at(uv)), "{u}");
            assert_eq!(mask.blocks(uv, uv), mask.is_forbidden(uv), "{u}");
        }
    }
}

#[cfg(all(feature = "2d", feature = "3d"))]
mod in_apps {
    use super::texture;
    use crate::support::{add, app, center, counts, hit, settle, shown, solid, state, step, steps, wait_for};
    use bevy::{
        asset::RenderAssetUsages,
        prelude::*,
        render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    };
    use bevy_crack::{
        growth::CrackGrowth,
        paint::{BaseTexels, LookTable, PaintTargets, paint_into},
        pattern::{CrackMask, Moment, SurfaceFrame},
        prelude::*,
        raster::{DepthField, TexelRect, stamp_path},
    };
    use std::sync::Arc;

    fn image(size: UVec2, rgba: Vec<u8>) -> Image {
        let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
        let (dimension, format) = (TextureDimension::D2, TextureFormat::Rgba8UnormSrgb);
        Image::new(extent, dimension, rgba, format, RenderAssetUsages::default())
    }

    /// A checkerboard of `n` x `n` squares: white where the sum of column and row is even.
    fn squares(n: u32) -> Image {
        let texels = (0..n * n)
            .flat_map(|i| [if (i % n + i / n).is_multiple_of(2) { 255 } else { 0 }; 3].into_iter().chain([255]));
        image(UVec2::splat(n), texels.collect())
    }

    fn spawn(app: &mut App, picture: Image, preset: CrackPreset, mask: CrackMaskSource) -> Entity {
        let image = add(app, picture);
        app.world_mut().spawn((Sprite::from_image(image), CrackSurface::new(preset).with_mask(mask))).id()
    }

    /// Indices of the texels that differ from the picture.
    fn cracked(app: &App, entity: Entity, clean: &[u8]) -> Vec<u32> {
        let now = shown(app, entity);
        (0..).zip(now.chunks(4).zip(clean.chunks(4))).filter(|(_, (a, b))| a != b).map(|(i, _)| i).collect()
    }

    #[test]
    fn cracks_never_enter_what_an_image_forbids() {
        let mut app = app();
        let (size, clean) = (UVec2::splat(96), solid(UVec2::splat(96), [150, 150, 150, 255]).data.unwrap());
        let white = add(&mut app, squares(3));
        let mask = CrackMaskSource::Images { weak: None, strong: None, forbidden: Some(white) };
        let mut touched = 0;
        for preset in CrackPreset::NAMES.into_iter().filter_map(CrackPreset::named) {
            let entity = spawn(&mut app, image(size, clean.clone()), preset.clone(), mask.clone());
            let free = spawn(&mut app, image(size, clean.clone()), preset, CrackMaskSource::None);
            // The squares in the middle of the sides are free, those in the corners and the centre are not.
            for uv in [Vec2::new(0.5, 0.2), Vec2::new(0.2, 0.55), Vec2::new(0.85, 0.5), Vec2::new(0.5, 0.9)] {
                hit(&mut app, CrackHit::uv(entity, uv));
                hit(&mut app, CrackHit::uv(free, uv));
            }
            settle(&mut app, entity);
            settle(&mut app, free);
            // The outermost texels of a square are lit by the slope of the crack beside them.
            let is_inside = |x: u32| (1..31).contains(&(x % 32));
            let is_forbidden = |i: &u32| {
                let (x, y) = (i % 96, i / 96);
                (x / 32 + y / 32).is_multiple_of(2) && is_inside(x) && is_inside(y)
            };
            let inside = cracked(&app, entity, &clean);
            assert!(!inside.iter().any(is_forbidden), "a crack on a forbidden texel");
            assert!(!inside.is_empty());
            touched += cracked(&app, free, &clean).iter().filter(|i| is_forbidden(i)).count();
        }
        assert!(touched > 100, "without the mask they would have been there: {touched}");
        // On a forbidden texel itself nothing begins.
        let entity = spawn(&mut app, image(size, clean.clone()), CrackPreset::GLASS, mask);
        let refused = counts(&app).rejected;
        hit(&mut app, center(entity));
        steps(&mut app, 3);
        assert_eq!(counts(&app).rejected, refused + 1);
    }

    /// The picture of a wall with cracks in its own joints, texel for texel as without the engine.
    #[test]
    fn the_walls_own_joints_draw_the_cracks() {
        let mut app = app();
        let (size, at) = (UVec2::splat(512), Vec2::new(0.5, 0.47));
        let (picture, preset) = (texture("brick_red.png"), CrackPreset::BRICK);
        let own = Arc::new(CrackMask::from_picture(size, picture.as_raw()).unwrap());
        let expected = |mask: &Arc<CrackMask>| {
            let frame = SurfaceFrame::new(size).unwrap();
            let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), 0).unwrap();
            growth.set_mask(mask.clone());
            growth.hit(frame.uv_to_pos(at), 1.0);
            while growth.step().grew() {}
            let mut field = DepthField::new(frame);
            field.set_layers(preset.look.layer(0));
            for segment in growth.network().segments() {
                stamp_path(&mut field, &preset.profile, &growth.network().path(segment).unwrap());
            }
            let timeline = growth.timeline();
            field.show_layers(growth.network(), timeline, Moment::after(timeline.end()), &mut Vec::new());
            let mut diffuse = picture.as_raw().clone();
            paint_into(
                BaseTexels { size, diffuse: picture.as_raw(), normal: None, depth: None },
                &field,
                &LookTable::new(&preset.look, frame.texels_per_unit()).unwrap(),
                TexelRect::whole(size),
                UVec2::ZERO,
                &mut PaintTargets { diffuse: Some(&mut diffuse), normal: None, depth: None },
            );
            diffuse
        };
        let mut painted = Vec::new();
        let stubborn = CrackPreset { follows_lines: false, ..preset.clone() };
        for (preset, source, mask) in [
            (&preset, CrackMaskSource::Auto, &own),
            (&preset, CrackMaskSource::None, &Arc::default()),
            (&stubborn, CrackMaskSource::Auto, &Arc::default()),
            (&stubborn, CrackMaskSource::FromPicture, &own),
        ] {
            let entity = spawn(&mut app, image(size, picture.as_raw().clone()), preset.clone(), source);
            hit(&mut app, CrackHit::uv(entity, at));
            settle(&mut app, entity);
            let shown = shown(&app, entity);
            assert!(shown == expected(mask), "other texels than without the engine");
            painted.push(shown);
        }
        assert!(painted[0] != painted[1], "the mask makes a difference");
    }

    /// Where frames may take any time the first hit waits for nothing; where the picture changes in every frame, not for ever.
    #[test]
    fn brick_cracks_at_once_or_soon() {
        let (size, picture) = (UVec2::splat(512), texture("brick_red.png"));
        let mut app = app();
        let entity = spawn(&mut app, image(size, picture.as_raw().clone()), CrackPreset::BRICK, CrackMaskSource::Auto);
        step(&mut app);
        hit(&mut app, center(entity));
        step(&mut app);
        assert!(state(&app, entity).nodes > 0, "{:?}", state(&app, entity));

        app.insert_resource(CrackBudget::default());
        let film = add(&mut app, image(size, picture.as_raw().clone()));
        let entity =
            app.world_mut().spawn((Sprite::from_image(film.clone()), CrackSurface::new(CrackPreset::BRICK))).id();
        step(&mut app);
        hit(&mut app, center(entity));
        let mut frames = 0;
        while state(&app, entity).nodes == 0 {
            let mut images = app.world_mut().resource_mut::<Assets<Image>>();
            images.get_mut(&film).unwrap().into_inner().data.as_mut().unwrap()[0] ^= 1;
            step(&mut app);
            std::thread::sleep(std::time::Duration::from_millis(10));
            frames += 1;
            assert!(frames < 500, "{:?}", state(&app, entity));
        }
    }

    #[test]
    fn masks_that_fail_to_load_fail_the_surface_and_those_in_loading_hold_it() {
        let mut app = app();
        let clean = solid(UVec2::splat(32), [150, 150, 150, 255]);
        let server = app.world().resource::<AssetServer>().clone();
        let missing = CrackMaskSource::Images { weak: Some(server.load("nowhere.png")), strong: None, forbidden: None };
        let late = app.world().resource::<Assets<Image>>().reserve_handle();
        let waiting = CrackMaskSource::Images { weak: None, strong: Some(late.clone()), forbidden: None };
        let failing = spawn(&mut app, clean.clone(), CrackPreset::CONCRETE, missing);
        let entity = spawn(&mut app, clean, CrackPreset::CONCRETE, waiting);
        for entity in [failing, entity] {
            hit(&mut app, center(entity));
        }
        wait_for(&mut app, "the failure", |app| matches!(state(app, failing).status, CrackStatus::Failed(_)));
        steps(&mut app, 5);
        assert_eq!(state(&app, entity).status, CrackStatus::Waiting);
        app.world_mut().resource_mut::<Assets<Image>>().insert(&late, squares(2)).unwrap();
        settle(&mut app, entity);
    }
}
