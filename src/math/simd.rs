//! Loops compiled for the widest vectors of the processor.

#[cfg(target_arch = "x86_64")]
use fearless_simd::{Level, Simd};

/// Runs `work`, compiled for the widest vectors that the processor has: AVX2 on x86-64 if available; elsewhere what
/// the build assumes.
///
/// The bits are the same either way: the same operations in the same order, each rounded on its own, none fused. Only
/// code that is inlined into `work` gains, so its loops are `#[inline(always)]`, and so is the closure.
#[inline(always)]
pub(crate) fn vectorized<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(test)]
    if tests::IS_PLAIN.get() {
        return work();
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = Level::new().as_avx2() {
        return avx2.vectorize(work);
    }
    work()
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "x86_64")]
    use super::Level;
    use crate::{
        CrackPreset, Grid,
        blend::{NormalBlending, solve_poisson},
        growth::CrackGrowth,
        math::{Rng, ops},
        paint::{
            BaseTexels, Look, LookTable, PaintTargets,
            analogy::{Analogy, AnalogyPair, AnalogyParams, Examples},
            paint_into,
        },
        pattern::{CrackMask, Moment, PathPoint, SegmentPath, SurfaceFrame},
        raster::{DepthField, Profile, TexelRect, stamp_path},
        relief::{Contours, HeightParams, Ring, TerrainColors, Weathering, colors, heights, normals, weathered},
        voronoi::{VoronoiParams, voronoi_map},
    };
    use glam::{UVec2, Vec2};
    use std::{cell::Cell, ops::ControlFlow, sync::Arc};

    std::thread_local! {
        /// Whether work is done as on a processor without wide vectors.
        pub(super) static IS_PLAIN: Cell<bool> = const { Cell::new(false) };
    }

    /// What is made of random numbers with wide vectors and without.
    fn both<T>(seed: u64, make: impl Fn(&mut Rng) -> T) -> [T; 2] {
        #[cfg(target_arch = "x86_64")]
        let has_wide = Level::new().as_avx2().is_some();
        #[cfg(not(target_arch = "x86_64"))]
        let has_wide = false;
        if !has_wide {
            eprintln!("PASSED OVER: this processor has no wider vectors than the build assumes");
        }
        [false, true].map(|is_plain| {
            IS_PLAIN.set(is_plain);
            let made = make(&mut Rng::new(seed));
            IS_PLAIN.set(false);
            made
        })
    }

    fn field(rng: &mut Rng) -> DepthField {
        let mut field = DepthField::new(SurfaceFrame::new(UVec2::new(150, 97)).unwrap());
        for _ in 0..12 {
            let mut point = || PathPoint {
                pos: Vec2::new(rng.range(-0.1, 1.6), rng.range(-0.1, 1.1)),
                width: 0.1 * rng.unit() * rng.unit(),
            };
            let path = SegmentPath::straight(point(), point());
            let rim_width = if rng.unit() < 0.5 { 0.0 } else { 0.03 };
            let ragged = if rng.unit() < 0.5 { 0.0 } else { 0.02 };
            let [wall, rim_depth, edge] = [0; 3].map(|_| rng.unit());
            let (chipped, rubble) = if rng.unit() < 0.5 { (0.0, 0.0) } else { (0.02, 0.5) };
            let profile = Profile { wall, rim_width, rim_depth, ragged, chipped, rubble, edge, ..Profile::DEFAULT };
            stamp_path(&mut field, &profile, &path);
        }
        field
    }

    #[test]
    fn stamps_and_painted_texels_are_the_same_without_wide_vectors() {
        for seed in 0..40 {
            let [wide, plain] = both(seed, |rng| {
                let field = field(rng);
                let n = 150 * 97;
                let mut bytes = |n: usize| (0..n).map(|_| rng.next_u32() as u8).collect::<Vec<_>>();
                let (diffuse, normal, depth) = (bytes(4 * n), bytes(4 * n), bytes(n));
                let normal = (seed % 2 == 0).then_some(&*normal);
                let base = BaseTexels { size: UVec2::new(150, 97), diffuse: &diffuse, normal, depth: Some(&depth) };
                let look = &[Look::GROOVE, Look::FROSTED, Look::TOON, Look::CONCRETE][seed as usize % 4];
                let normals =
                    [NormalBlending::Plain, NormalBlending::Whiteout, NormalBlending::Poisson][seed as usize / 3 % 3];
                let look = LookTable::new(&Look { normals, ..look.clone() }, 97.0).unwrap();
                let [mut diffuse, mut normal, mut depth] = [vec![0; 4 * n], vec![0; 4 * n], vec![0; n]];
                let mut targets =
                    PaintTargets { diffuse: Some(&mut diffuse), normal: Some(&mut normal), depth: Some(&mut depth) };
                paint_into(base, &field, &look, TexelRect::whole(UVec2::new(150, 97)), UVec2::ZERO, &mut targets);
                (field, diffuse, normal, depth)
            });
            assert!(wide.0.depth.as_slice().iter().any(|&depth| depth > 0), "something is stamped");
            assert!(wide == plain, "seed {seed}");
        }
    }

    #[test]
    fn crushed_zones_are_the_same_without_wide_vectors() {
        for (seed, name) in (0..).zip(["concrete", "plaster", "brick", "ice", "glass", "toon"]) {
            let [wide, plain] = both(seed, |rng| {
                let preset = CrackPreset::named(name).unwrap();
                let frame = SurfaceFrame::new(UVec2::new(150, 97)).unwrap();
                let mut growth = CrackGrowth::new(preset.growth, frame.extent(), seed).unwrap();
                for _ in 0..3 {
                    growth.hit(Vec2::new(1.5 * rng.unit(), rng.unit()), 3.0 * rng.unit());
                }
                let mut field = DepthField::new(frame);
                field.set_layers(preset.look.layer(seed));
                let mut changed = Vec::new();
                field.show_layers(growth.network(), growth.timeline(), Moment::after(1), &mut changed);
                assert!(!changed.is_empty(), "{name} is crushed");
                field
            });
            assert!(wide == plain, "{name}");
        }
    }

    #[test]
    fn solved_heights_are_the_same_without_wide_vectors() {
        for size in [[1, 1], [61, 53], [64, 30], [72, 18], [143, 95]].map(UVec2::from) {
            let [wide, plain] = both(9, |rng| {
                let mut grid = Grid::new(size, 0.0);
                grid.as_mut_slice().iter_mut().for_each(|value| *value = rng.range(-1.0, 1.0));
                solve_poisson(&mut grid).unwrap();
                grid
            });
            assert!(wide == plain, "{size}");
        }
    }

    #[test]
    fn analogies_are_the_same_without_wide_vectors() {
        let size = UVec2::new(40, 33);
        for seed in 0..4 {
            let [wide, plain] = both(seed, |rng| {
                let rgba: Vec<u8> = (0..4 * 40 * 33).map(|_| rng.next_u32() as u8).collect();
                let pair = AnalogyPair::from_darkness(size, &rgba, 0.3).unwrap();
                let examples = Arc::new(Examples::new(&[pair], &AnalogyParams::DEFAULT).unwrap());
                let mut depth = Grid::new(size, 0);
                depth.as_mut_slice().iter_mut().for_each(|depth| *depth = (rng.next_u32() % 9000) as u16 * 2);
                let mut analogy = Analogy::new(examples, &depth, &[], seed).unwrap();
                analogy.finish();
                analogy.sources()
            });
            assert!(wide == plain, "seed {seed}");
        }
    }

    #[test]
    fn lines_of_pictures_and_maps_are_the_same_without_wide_vectors() {
        for seed in 0..4 {
            let [wide, plain] = both(seed, |rng| {
                let size = UVec2::new(140, 90);
                let texel = |i: u32, noise: u32| match (i % 140) % 30 < 3 || (i / 140) % 24 < 3 {
                    true => 180 + noise % 40,
                    false => 60 + noise % 40,
                };
                let texels = (0..140 * 90).map(|i| texel(i, rng.next_u32()) as u8);
                let rgba: Vec<u8> = texels.flat_map(|level| [level, level, level, 255]).collect();
                let lines = CrackMask::weak_from_picture(size, &rgba).unwrap().expect("lines");
                let map =
                    voronoi_map(&VoronoiParams::default(), &[], size, seed, |_| ControlFlow::Continue(())).unwrap();
                let costs: Vec<_> =
                    (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))).map(|(x, y)| map.edges(x, y)).collect();
                (lines, map.regions(), costs)
            });
            assert!(wide == plain, "seed {seed}");
        }
    }

    #[test]
    fn heights_are_the_same_without_wide_vectors() {
        for seed in 0..4 {
            let [wide, plain] = both(seed, |rng| {
                let corners: Vec<_> = (0..40).map(|i| (i as f32 / 40.0, 0.8 + 0.4 * rng.unit())).collect();
                let ring = |level: i32| {
                    let radius = 0.4 - 0.09 * level as f32;
                    let corner = |&(share, out): &(f32, f32)| {
                        Vec2::splat(0.5) + radius * out * ops::unit(std::f32::consts::TAU * share)
                    };
                    Ring { points: corners.iter().map(corner).collect(), level }
                };
                let contours = Contours { rings: (0..4).map(ring).collect(), distance: 0.09 };
                let frame = SurfaceFrame::new(UVec2::new(141, 93)).unwrap();
                let heights = heights(&contours, &HeightParams::DEFAULT, frame, 1).unwrap();
                let (weather, look) = match seed % 2 {
                    0 => (Weathering::ROCK, TerrainColors::ROCK),
                    _ => (Weathering::LAND, TerrainColors::ISLAND),
                };
                let worn = weathered(&heights, &frame, &weather, 1).unwrap();
                let pictures = (normals(&worn, &frame), colors(&worn, &frame, &look, 1).unwrap());
                (heights, worn, pictures)
            });
            assert!(wide == plain, "seed {seed}");
        }
    }
}
