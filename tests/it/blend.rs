//! Normals of cracks and of surfaces, blended: seams, and pictures that do not depend on how they came about.

use bevy_crack::{
    CrackPreset, Grid,
    blend::{NormalBlending, ReliefPatch, blend_relief},
    growth::CrackGrowth,
    math::Rng,
    paint::{BaseTexels, Look, LookTable, PaintTargets, correct_normals, paint_rects},
    pattern::{PathPoint, SegmentPath, SurfaceFrame},
    raster::{DepthField, DirtyTiles, Profile, TexelRect, stamp_path},
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

const SIZE: UVec2 = UVec2::new(190, 141);

/// The normals of a corner of bricks, and a crack through them.
fn bricks() -> (Vec<u8>, CrackPreset, CrackGrowth) {
    let normals = image::imageops::crop_imm(&asset("brick_red_normal.png"), 20, 30, SIZE.x, SIZE.y).to_image();
    let look = Look { normals: NormalBlending::Poisson, ..Look::GROOVE };
    let preset = CrackPreset { look, ..CrackPreset::CLAY };
    let growth = grown(&preset, SIZE, &[Vec2::new(0.6, 0.5), Vec2::new(0.3, 0.8)], 5);
    (normals.into_raw(), preset, growth)
}

fn table(look: &Look, field: &DepthField) -> LookTable {
    LookTable::new(look, field.frame.texels_per_unit()).unwrap()
}

fn paint(base: BaseTexels, field: &DepthField, look: &Look, rects: &[TexelRect], out: &mut [u8]) {
    let mut targets = PaintTargets { diffuse: None, normal: Some(out), depth: None };
    paint_rects(base, field, &table(look, field), rects, UVec2::ZERO, &mut targets);
}

#[test]
fn normals_at_rest_do_not_depend_on_the_frames_before() {
    let (normals, preset, growth) = bricks();
    let base = BaseTexels { size: SIZE, diffuse: &[], normal: Some(&normals), depth: None };
    let mut field = stamped(&growth, &preset, SIZE);
    let whole = [TexelRect::whole(SIZE)];
    let mut unsolved = normals.clone();
    paint(base, &field, &preset.look, &whole, &mut unsolved);
    assert!(!correct_normals(base, &mut field, UVec2::ZERO).unwrap().is_empty());
    let mut expected = normals.clone();
    paint(base, &field, &preset.look, &whole, &mut expected);
    assert_ne!(unsolved, expected, "something is solved");
    for seed in 0..6 {
        let mut rng = Rng::new(seed);
        let mut segments: Vec<_> = growth.network().segments().collect();
        for i in (1..segments.len()).rev() {
            segments.swap(i, rng.next_u32() as usize % (i + 1));
        }
        let mut field = DepthField::new(SurfaceFrame::new(SIZE).unwrap());
        let mut painted = normals.clone();
        for some in segments.chunks(40) {
            let stamp = |segment| {
                let path = growth.network().path(segment).unwrap();
                stamp_path(&mut field, &preset.profile, &path).grow(1, SIZE)
            };
            let dirty: Vec<_> = some.iter().copied().map(stamp).collect();
            paint(base, &field, &preset.look, &dirty, &mut painted);
            // Now and then it rests.
            if rng.unit() < 0.3 {
                let changed = correct_normals(base, &mut field, UVec2::ZERO).unwrap();
                paint(base, &field, &preset.look, &changed, &mut painted);
            }
        }
        let changed = correct_normals(base, &mut field, UVec2::ZERO).unwrap();
        paint(base, &field, &preset.look, &changed, &mut painted);
        assert!(painted == expected, "seed {seed}");
        assert_eq!(correct_normals(base, &mut field, UVec2::ZERO), Ok(Vec::new()), "it is at rest");
    }
}

/// The formulas of the documentation, in f64, and what is guaranteed: base texels where nothing is touched or corrected, and slopes
/// that fade out towards the border of the solved rectangle.
#[test]
fn painted_normals_are_those_of_the_formulas() {
    let (normals, preset, growth) = bricks();
    let base = BaseTexels { size: SIZE, diffuse: &[], normal: Some(&normals), depth: None };
    let mut field = stamped(&growth, &preset, SIZE);
    correct_normals(base, &mut field, UVec2::ZERO).unwrap();
    let correction = field.correction().unwrap().clone();
    let unit = |texel: &[u8]| [0, 1, 2].map(|i| (f64::from(texel[i]) - 127.5) / 127.5);
    let depth = |x: i64, y: i64| {
        let (x, y) = (x.clamp(0, i64::from(SIZE.x) - 1), y.clamp(0, i64::from(SIZE.y) - 1));
        f64::from(field.depth.get(x as u32, y as u32).unwrap()) / 65535.0
    };
    let scale = f64::from(preset.look.relief * field.frame.texels_per_unit()) / 8.0;
    let mut counts = [0; 3];
    for blending in [NormalBlending::Whiteout, NormalBlending::Poisson] {
        let look = Look { normals: blending, ..preset.look.clone() };
        let mut painted = normals.clone();
        paint(base, &field, &look, &[TexelRect::whole(SIZE)], &mut painted);
        for (i, (own, painted)) in normals.chunks(4).zip(painted.chunks(4)).enumerate() {
            let (x, y) = ((i as u32 % SIZE.x) as i64, (i as u32 / SIZE.x) as i64);
            let (mut right, mut down) = (0.0, 0.0);
            for (k, weight) in [(-1, 1.0), (0, 2.0), (1, 1.0)] {
                right += weight * scale * (depth(x + 1, y + k) - depth(x - 1, y + k));
                down += weight * scale * (depth(x + k, y + 1) - depth(x + k, y - 1));
            }
            let [nx, ny, nz] = unit(own);
            let more = correction.at(x as u32, y as u32).map(f64::from);
            let is_level = right == 0.0 && down == 0.0;
            let left = 1.0 - (depth(x, y) / 0.3).min(1.0);
            let sum = if blending == NormalBlending::Whiteout {
                let length = (right * right + down * down + 1.0).sqrt();
                [nx + right / length, ny - down / length, nz / length]
            } else {
                [left * nx / nz + more[0] + right, left * ny / nz - more[1] - down, 1.0]
            };
            let is_base = is_level && (blending == NormalBlending::Whiteout || (left == 1.0 && more == [0.0; 2]));
            if is_base {
                counts[0] += 1;
                assert_eq!(own, painted, "{x} {y}");
                continue;
            }
            counts[1] += 1;
            counts[2] += usize::from(is_level);
            let length = sum.map(|v| v * v).iter().sum::<f64>().sqrt();
            for (got, expected) in unit(painted).into_iter().zip(sum) {
                assert!((got - expected / length).abs() < 0.505 / 127.5, "{blending:?} {x} {y}: {got} {expected}");
            }
            assert_eq!(own[3], painted[3]);
        }
    }
    assert!(counts.iter().all(|count| *count > 300), "{counts:?}");
}

#[test]
fn corrections_fade_out_before_the_border_of_what_is_solved() {
    let size = UVec2::splat(200);
    let frame = SurfaceFrame::new(size).unwrap();
    for name in ["brick_red_normal.png", "concrete_fine_normal.png"] {
        let normals = image::imageops::crop_imm(&asset(name), 10, 10, size.x, size.y).to_image();
        // Short cracks in the middle: the solved rectangle lies in the picture.
        let mut field = DepthField::new(frame);
        for ends in [[[0.35, 0.4], [0.65, 0.55]], [[0.5, 0.47], [0.42, 0.66]]] {
            let [from, to] = ends.map(|pos| PathPoint { pos: Vec2::from(pos), width: 0.06 });
            stamp_path(&mut field, &Profile::DEFAULT, &SegmentPath::straight(from, to));
        }
        let base = BaseTexels { size, diffuse: &[], normal: Some(normals.as_raw()), depth: None };
        let changed = correct_normals(base, &mut field, UVec2::ZERO).unwrap();
        let correction = field.correction().unwrap();
        let TexelRect { min, max } = correction.rect();
        assert!(min.min_element() > 0 && max.max_element() < 200, "{min} {max}");
        let ring = (min.x..max.x).flat_map(|x| [(x, min.y), (x, max.y - 1)]);
        let ring = ring.chain((min.y..max.y).flat_map(|y| [(min.x, y), (max.x - 1, y)]));
        let largest = |texels: &mut dyn Iterator<Item = (u32, u32)>| {
            texels.flat_map(|(x, y)| correction.at(x, y)).fold(0.0f32, |most, slope| most.max(slope.abs()))
        };
        let (edge, all) =
            (largest(&mut ring.into_iter()), largest(&mut (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y)))));
        println!("{name}: {edge} at the border, {all} in all");
        // One step of a byte is a slope of 2/255.
        assert!(edge <= 1.0 / 255.0 && all > 5.0 * edge.max(1e-3), "{name}: {edge} {all}");
        // What changes is told in whole tiles.
        let tile = DirtyTiles::TILE;
        let tiles = TexelRect { min: min / tile * tile, max: max.map(|side| side.next_multiple_of(tile)) };
        let is_in_tiles = |rect: &TexelRect| rect.intersect(tiles) == *rect;
        assert!(!changed.is_empty() && changed.iter().all(is_in_tiles), "{changed:?} {tiles:?}");
    }
}

/// The same bits on every thread, whatever the others do.
#[test]
fn threads_blend_the_same() {
    let base = asset("brick_red_normal.png");
    let size = UVec2::from(base.dimensions());
    let (_, height) = patches().remove(0);
    let blend = || {
        let mut normals = base.clone();
        let patch = ReliefPatch { height: &height, cover: None, origin: UVec2::splat(9) };
        blend_relief(&mut normals, size, &patch, NormalBlending::Poisson).unwrap();
        normals
    };
    let expected = blend();
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(blend)).collect();
        assert!(threads.into_iter().all(|thread| thread.join().unwrap() == expected));
    });
}
