//! What a frame pays to stamp and to paint, on one thread, beside a rasteriser of paths in the same run.
//!
//! `cargo bench --no-default-features --bench raster`. The scenes of the capsules: so many of that length and width
//! (texels), anywhere and in any direction on a surface of 1024 x 1024.

use bevy_crack::{
    CrackPreset,
    growth::CrackGrowth,
    math::{Rng, ops},
    paint::{BaseTexels, Look, LookTable, MipLevels, PaintTargets, TexelKind, paint_into, paint_rects},
    pattern::{Moment, PathPoint, SegmentPath, SurfaceFrame},
    raster::{DepthField, DirtyTiles, Profile, TexelRect, stamp_path},
};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{UVec2, Vec2};
use std::hint::black_box;

/// Side of the surface of the capsules, texels.
const SIDE: u32 = 1024;

/// Number, length and widths of the capsules.
const SCENES: [(usize, f32, (f32, f32)); 3] =
    [(1_000, 5.0, (2.0, 4.0)), (20_000, 5.0, (2.0, 4.0)), (1_000, 100.0, (4.0, 12.0))];

fn field(size: UVec2) -> Option<DepthField> {
    SurfaceFrame::new(size).ok().map(DepthField::new)
}

/// Ends and width of each capsule, texels.
fn capsules((n, length, width): (usize, f32, (f32, f32))) -> Vec<(Vec2, Vec2, f32)> {
    let mut rng = Rng::new(99);
    let mut capsule = || {
        let from = Vec2::new(rng.unit(), rng.unit()) * SIDE as f32;
        let to = from + ops::unit(rng.unit() * std::f32::consts::TAU) * length;
        (from, to, width.0 + (width.1 - width.0) * rng.unit())
    };
    (0..n).map(|_| capsule()).collect()
}

fn stamps(c: &mut Criterion) {
    let mut group = c.benchmark_group("stamp");
    for scene in SCENES {
        let capsules = capsules(scene);
        let name = format!("{} x {} px", scene.0, scene.1);
        let paths = |taper: f32| -> Vec<SegmentPath> {
            let point = |pos: Vec2, width: f32| PathPoint { pos: pos / SIDE as f32, width: width / SIDE as f32 };
            capsules.iter().map(|&(a, b, w)| SegmentPath::straight(point(a, w), point(b, w * taper))).collect()
        };
        let slot = Profile { wall: 0.0, ..Profile::DEFAULT };
        let groove = Profile { rim_width: 0.005, rim_depth: 0.2, ..Profile::DEFAULT };
        let kinds = [("slot", slot, 1.0), ("tapered", slot, 0.8), ("tapered, with wall and rim", groove, 0.8)];
        for (kind, profile, taper) in kinds {
            let Some(mut field) = field(UVec2::splat(SIDE)) else { continue };
            let paths = paths(taper);
            group.bench_function(BenchmarkId::new(kind, &name), |b| {
                b.iter(|| {
                    field.depth.as_mut_slice().fill(0);
                    for path in &paths {
                        black_box(stamp_path(&mut field, &profile, path));
                    }
                });
            });
        }
        group.bench_function(BenchmarkId::new("tiny-skia", &name), |b| {
            b.iter(|| tiny_skia_strokes(&capsules));
        });
    }
}

/// The same capsules as anti-aliased strokes with round caps.
fn tiny_skia_strokes(capsules: &[(Vec2, Vec2, f32)]) -> Option<usize> {
    use tiny_skia::{LineCap, Paint, PathBuilder, Pixmap, Stroke, Transform};
    let mut pixels = Pixmap::new(SIDE, SIDE)?;
    let mut paint = Paint::default();
    paint.set_color_rgba8(255, 255, 255, 255);
    for &(from, to, width) in capsules {
        let mut path = PathBuilder::new();
        path.move_to(from.x, from.y);
        path.line_to(to.x, to.y);
        let stroke = Stroke { width, line_cap: LineCap::Round, ..Stroke::default() };
        pixels.stroke_path(&path.finish()?, &paint, &stroke, Transform::identity(), None);
    }
    Some(pixels.data().len())
}

/// A surface whose every texel is touched, and one with as many cracks as a finished pattern has.
fn paints(c: &mut Criterion) {
    let mut group = c.benchmark_group("paint");
    let size = UVec2::splat(2048);
    let texels = (size.x * size.y) as usize;
    let diffuse = vec![120; texels * 4];
    let mut out = vec![0; texels * 4];
    let (Some(mut relief), Some(mut cracks)) = (field(size), field(size)) else { return };
    let mut rng = Rng::new(7);
    relief.depth.as_mut_slice().fill_with(|| rng.next_u32() as u16);
    for (from, to, width) in capsules((2_000, 60.0, (1.0, 6.0))) {
        let point = |pos: Vec2| PathPoint { pos: pos / SIDE as f32, width: width / SIDE as f32 };
        stamp_path(&mut cracks, &Profile::DEFAULT, &SegmentPath::straight(point(from), point(to)));
    }
    let base = BaseTexels { size, diffuse: &diffuse, normal: None, depth: None };
    let tilted = BaseTexels { normal: Some(&diffuse), ..base };
    let whole = TexelRect::whole(size);
    let square = |side: u32| TexelRect { min: UVec2::splat(1000), max: UVec2::splat(1000 + side) };
    let Ok(look) = LookTable::new(&Look::GROOVE, 2048.0) else { return };
    let uneven = Look { uneven_glint: Look::CONCRETE.uneven_glint, ..Look::GROOVE };
    let lit = Look::CONCRETE;
    let cast = Look { cast: lit.cast, shadow: lit.shadow, relief: lit.relief, ..uneven.clone() };
    let Ok(uneven) = LookTable::new(&uneven, 2048.0) else { return };
    let Ok(cast) = LookTable::new(&cast, 2048.0) else { return };
    let Ok(glass) = LookTable::new(&Look::FROSTED, 2048.0) else { return };
    for (area, rect) in [("2048^2", whole), ("64^2", square(64)), ("16^2", square(16))] {
        group.throughput(Throughput::Elements(rect.area()));
        for (kind, field, base) in [
            ("normal, all touched", &relief, base),
            ("normal over normals, all touched", &relief, tilted),
            ("normal, cracks", &cracks, base),
        ] {
            group.bench_function(BenchmarkId::new(kind, area), |b| {
                b.iter(|| {
                    let mut targets = PaintTargets { diffuse: None, normal: Some(&mut out), depth: None };
                    paint_into(base, field, &look, rect, UVec2::ZERO, &mut targets);
                });
            });
        }
        for (kind, field, look) in [
            ("diffuse groove, all touched", &relief, &look),
            ("diffuse groove, cracks", &cracks, &look),
            ("diffuse unevenly lit groove, all touched", &relief, &uneven),
            ("diffuse groove with cast shadows, all touched", &relief, &cast),
            ("diffuse groove with cast shadows, cracks", &cracks, &cast),
            ("diffuse unevenly lit groove, cracks", &cracks, &uneven),
            ("diffuse frosted, cracks", &cracks, &glass),
        ] {
            group.bench_function(BenchmarkId::new(kind, area), |b| {
                b.iter(|| {
                    let mut targets = PaintTargets { diffuse: Some(&mut out), normal: None, depth: None };
                    paint_into(base, field, look, rect, UVec2::ZERO, &mut targets);
                });
            });
        }
    }
}

/// The tips of a growing pattern: scattered little rectangles.
fn dirty(c: &mut Criterion) {
    let mut group = c.benchmark_group("dirty");
    let size = UVec2::splat(SIDE);
    let mut rects = Vec::new();
    for n in [0, 10, 100, 1_000] {
        let marks: Vec<TexelRect> = capsules((n, 10.0, (1.0, 1.0)))
            .iter()
            .map(|&(a, b, _)| TexelRect { min: a.min(b).as_uvec2(), max: a.max(b).as_uvec2() + 1 })
            .collect();
        let mut tiles = DirtyTiles::new(size);
        group.bench_function(BenchmarkId::new("mark and take", n), |b| {
            b.iter(|| {
                rects.clear();
                for &mark in &marks {
                    tiles.mark(mark);
                }
                tiles.take_rects(&mut rects);
                rects.len()
            });
        });
    }
}

/// What the crater of one hit takes before any crack has grown, on a surface of 512 x 512: drawn into the field, and painted.
fn craters(c: &mut Criterion) {
    let mut group = c.benchmark_group("crater");
    let size = UVec2::splat(512);
    let texels = (size.x * size.y) as usize;
    let picture = vec![150; 4 * texels];
    let base = BaseTexels { size, diffuse: &picture, normal: None, depth: None };
    let [mut diffuse, mut normal] = [picture.clone(), picture.clone()];
    for name in ["concrete", "plaster", "ice", "glass"] {
        let (Some(preset), Some(mut blank)) = (CrackPreset::named(name), field(size)) else { continue };
        let unit = blank.frame.texels_per_unit();
        blank.set_layers(preset.look.layer(7));
        let Ok(look) = LookTable::new(&preset.look, unit) else { continue };
        for energy in [1.0, 4.0] {
            let Ok(mut growth) = CrackGrowth::new(preset.growth.clone(), Vec2::ONE, 7) else { continue };
            growth.hit(Vec2::splat(0.5), energy);
            let draw = |field: &mut DepthField| {
                let mut changed = Vec::new();
                field.show_layers(growth.network(), growth.timeline(), Moment::after(1), &mut changed);
                changed
            };
            let mut drawn = blank.clone();
            let changed = draw(&mut drawn);
            assert!(!changed.is_empty(), "{name} has a crater");
            let id = |what: &str| BenchmarkId::new(format!("{name}, energy {energy}"), what);
            group.bench_function(id("drawn"), |b| {
                b.iter_batched_ref(|| blank.clone(), |field| draw(field), BatchSize::LargeInput);
            });
            group.bench_function(id("painted"), |b| {
                let mut targets = PaintTargets { diffuse: Some(&mut diffuse), normal: Some(&mut normal), depth: None };
                b.iter(|| paint_rects(base, &drawn, &look, black_box(&changed), UVec2::ZERO, &mut targets));
            });
        }
    }
}

/// Mip levels that follow a rectangle, and the naive way: all of them made anew.
fn mips(c: &mut Criterion) {
    let mut group = c.benchmark_group("mips");
    let size = UVec2::splat(1024);
    for (name, kind) in [("color", TexelKind::Color), ("normal", TexelKind::Linear), ("depth", TexelKind::Single)] {
        let levels = MipLevels::new(size, kind);
        let mut rng = Rng::new(5);
        let mut texels: Vec<u8> =
            (0..levels.bytes()).map(|i| if i % 4 == 3 { 255 } else { rng.next_u32() as u8 }).collect();
        for side in [16, 128, 1024] {
            let min = UVec2::splat((size.x - side) / 2);
            let rect = TexelRect { min, max: min + side };
            group.throughput(Throughput::Elements(rect.area()));
            group.bench_function(BenchmarkId::new(name, format!("{side}^2")), |b| {
                b.iter(|| black_box(levels.update(&mut texels, &[rect])));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, stamps, paints, dirty, craters, mips);
criterion_main!(benches);
