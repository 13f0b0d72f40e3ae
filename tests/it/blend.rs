//! Normals of cracks and of surfaces, blended: seams, and pictures that do not depend on how they came about.

use bevy_crack::{
    CrackPreset, Grid,
    blend::{NormalBlending, ReliefPatch, blend_relief},
    growth::CrackGrowth,
    math::Rng,
    paint::{BaseTexels, Look, LookTable, PaintTargets, correct_normals, paint_into, paint_rects},
    pattern::{Moment, SurfaceFrame},
    raster::{DepthField, Replay, TexelRect, stamp_path},
};
use glam::{UVec2, Vec2};
use image::RgbaImage;
use std::path::Path;

const ALL: [NormalBlending; 3] = [NormalBlending::Plain, NormalBlending::Whiteout, NormalBlending::Poisson];

fn asset(name: &str) -> RgbaImage {
    image::open(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/textures").join(name)).unwrap().to_rgba8()
}

fn grown(preset: &CrackPreset, size: UVec2, hits: &[Vec2], seed: u64) -> CrackGrowth {
    let frame = SurfaceFrame::new(size).unwrap();
    let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), seed).unwrap();
    for hit in hits {
        growth.hit(frame.uv_to_pos(*hit), 1.0);
        while growth.step().grew() {}
    }
    growth
}

fn stamped(growth: &CrackGrowth, preset: &CrackPreset, size: UVec2) -> DepthField {
    let mut field = DepthField::new(SurfaceFrame::new(size).unwrap());
    for segment in growth.network().segments() {
        stamp_path(&mut field, &preset.profile, &growth.network().path(segment).unwrap());
    }
    field
}

/// How much the normals differ on either side of the border of a rectangle, in squares of unit vectors.
fn seam_energy(normals: &RgbaImage, rect: TexelRect) -> f64 {
    let normal = |x: u32, y: u32| normals.get_pixel(x, y).0.map(|byte| (f64::from(byte) - 127.5) / 127.5);
    let jump = |a: [f64; 4], b: [f64; 4]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>();
    let (min, max) = (rect.min, rect.max);
    let across = |y: u32| jump(normal(min.x - 1, y), normal(min.x, y)) + jump(normal(max.x - 1, y), normal(max.x, y));
    let along = |x: u32| jump(normal(x, min.y - 1), normal(x, min.y)) + jump(normal(x, max.y - 1), normal(x, max.y));
    (min.y..max.y).map(across).sum::<f64>() + (min.x..max.x).map(along).sum::<f64>()
}

/// Heights of patches that are not level at their border: cracks that are cut off, pictures of cracked ground, a slope,
/// a dome.
fn patches() -> Vec<(&'static str, Grid<f32>)> {
    let mut patches = Vec::new();
    let mut add = |name, size: UVec2, height: &dyn Fn(u32, u32) -> f32| {
        let mut grid = Grid::new(size, 0.0);
        for y in 0..size.y {
            (0..size.x).for_each(|x| grid.row_mut(y as usize)[x as usize] = height(x, y));
        }
        patches.push((name, grid));
    };
    for (name, preset) in [("clay", CrackPreset::CLAY), ("glaze", CrackPreset::GLAZE)] {
        let field = stamped(&grown(&preset, UVec2::splat(256), &[Vec2::splat(0.5)], 3), &preset, UVec2::splat(256));
        let depth = |x: u32, y: u32| -6.0 * f32::from(field.depth.get(x + 70, y + 60).unwrap()) / 65535.0;
        add(name, UVec2::new(120, 97), &depth);
    }
    for name in ["clay.png", "mud.png"] {
        let picture = asset(name);
        let shade = |x: u32, y: u32| f32::from(picture.get_pixel(x + 40, y + 30).0[1]) * 0.03;
        add(name, UVec2::new(101, 128), &shade);
    }
    add("slope", UVec2::new(90, 64), &|x, _| 0.3 * x as f32);
    add("dome", UVec2::splat(111), &|x, y| -0.004 * ((x as f32 - 40.0).powi(2) + (y as f32 - 55.0).powi(2)));
    patches
}

#[test]
fn seams_of_poisson_are_weaker_than_those_of_adding_and_of_whiteout() {
    for base in ["brick_red_normal.png", "concrete_fine_normal.png"] {
        let base_picture = asset(base);
        let size = UVec2::from(base_picture.dimensions());
        for (name, height) in patches() {
            let origin = UVec2::new(61, 47);
            let [plain, whiteout, poisson] = ALL.map(|blending| {
                let mut normals = base_picture.clone();
                let patch = ReliefPatch { height: &height, cover: None, origin };
                let rect = blend_relief(&mut normals, size, &patch, blending).unwrap();
                seam_energy(&normals, rect)
            });
            let own = seam_energy(&base_picture, TexelRect { min: origin, max: origin + height.size() });
            println!("{name} on {base}: {plain:.2} plain, {whiteout:.2} whiteout, {poisson:.2} Poisson, {own:.2} base");
            assert!(poisson < plain && poisson < whiteout, "{name} on {base}");
        }
    }
}
