use super::{BlendError, NormalBlending, ReliefPatch, blend_relief, cover, slope_of, solve_correction, solve_poisson};
use crate::{
    Grid,
    math::{Rng, ops},
};
use glam::UVec2;

/// The solution of the five-point equation by elimination in f64, without pivots (the matrix is definite): the direct
/// sparse solve of a band matrix.
fn direct(source: &Grid<f64>) -> Grid<f64> {
    let (w, n) = (source.width(), source.as_slice().len());
    // Row `i` of the upper triangle: entries `i ..= i + w`.
    let mut upper = vec![vec![0.0; w + 1]; n];
    let mut u: Vec<f64> = source.as_slice().iter().map(|f| -f).collect();
    for (i, row) in upper.iter_mut().enumerate() {
        row[0] = 4.0;
        if i % w + 1 < w {
            row[1] = -1.0;
        }
        if i + w < n {
            row[w] += -1.0;
        }
    }
    if w == 1 {
        // The texels beside and below are one.
        upper.iter_mut().take(n - 1).for_each(|row| row[1] = -1.0);
    }
    for i in 0..n {
        let pivot = upper[i].clone();
        for k in 1..=w.min(n - 1 - i) {
            let factor = pivot[k] / pivot[0];
            if factor != 0.0 {
                for j in k..=w {
                    upper[i + k][j - k] -= factor * pivot[j];
                }
                u[i + k] -= factor * u[i];
            }
        }
    }
    for i in (0..n).rev() {
        let known: f64 = (1..=w.min(n - 1 - i)).map(|k| upper[i][k] * u[i + k]).sum();
        u[i] = (u[i] - known) / upper[i][0];
    }
    Grid::from_vec(source.size(), u).unwrap()
}

/// Odd, prime, one wide, powers of two and one less.
const SIZES: [[u32; 2]; 16] = [
    [1, 1],
    [1, 2],
    [2, 1],
    [1, 23],
    [29, 1],
    [2, 2],
    [3, 5],
    [7, 7],
    [13, 11],
    [15, 16],
    [17, 31],
    [37, 3],
    [41, 43],
    [58, 22],
    [63, 63],
    [66, 64],
];

fn random(rng: &mut Rng, size: UVec2, most: f32) -> Grid<f32> {
    let mut grid = Grid::new(size, 0.0);
    grid.as_mut_slice().iter_mut().for_each(|value| *value = rng.range(-most, most));
    grid
}

fn wide(grid: &Grid<f32>) -> Grid<f64> {
    Grid::from_vec(grid.size(), grid.as_slice().iter().map(|value| f64::from(*value)).collect()).unwrap()
}

#[test]
fn the_direct_solve_of_these_tests_solves() {
    let mut rng = Rng::new(1);
    for size in SIZES.map(UVec2::from) {
        let source = wide(&random(&mut rng, size, 1.0));
        let u = direct(&source);
        let at = |x: i32, y: i32| u.get(x as u32, y as u32).unwrap_or(0.0);
        for (y, x) in (0..size.y as i32).flat_map(|y| (0..size.x as i32).map(move |x| (y, x))) {
            let sum = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1) - 4.0 * at(x, y);
            assert!((sum - source.get(x as u32, y as u32).unwrap()).abs() < 1e-9, "{size} {x} {y}");
        }
    }
}

#[test]
fn solutions_are_those_of_a_direct_solve() {
    let mut rng = Rng::new(2);
    for size in SIZES.map(UVec2::from) {
        for _ in 0..4 {
            let source = random(&mut rng, size, 1.0);
            let expected = direct(&wide(&source));
            let mut solved = source.clone();
            solve_poisson(&mut solved).unwrap();
            let largest = expected.as_slice().iter().fold(0.0f64, |most, u| most.max(u.abs()));
            for (u, expected) in solved.as_slice().iter().zip(expected.as_slice()) {
                assert!((f64::from(*u) - expected).abs() < 2e-5 * largest, "{size}: {u} {expected}");
            }
        }
    }
}

#[test]
fn a_grid_that_cannot_be_solved_is_refused_and_stays() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2e20, f32::MAX] {
        let mut grid = Grid::new(UVec2::new(5, 4), 1.0);
        grid.row_mut(2)[3] = bad;
        assert_eq!(solve_poisson(&mut grid), Err(BlendError::NotFinite { x: 3, y: 2 }));
        assert_eq!((grid.get(0, 0), grid.get(4, 3)), (Some(1.0), Some(1.0)));
    }
    for size in [[0, 0], [0, 5], [5, 0]].map(UVec2::from) {
        assert_eq!(solve_poisson(&mut Grid::new(size, 0.0)), Ok(()));
    }
    let mut large = Grid::new(UVec2::splat(40), 1e20);
    solve_poisson(&mut large).unwrap();
    assert!(large.as_slice().iter().all(|u| u.is_finite()));
}

/// Slopes in f64 in a rectangle, zero outside.
struct Wide {
    size: UVec2,
    right: Vec<f64>,
    down: Vec<f64>,
}

impl Wide {
    fn new(size: UVec2, slope: impl Fn(u32, u32) -> [f64; 2]) -> Self {
        let all: Vec<_> =
            (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))).map(|(x, y)| slope(x, y)).collect();
        Self { size, right: all.iter().map(|s| s[0]).collect(), down: all.iter().map(|s| s[1]).collect() }
    }

    fn at(&self, x: i64, y: i64) -> [f64; 2] {
        let is_in = x >= 0 && y >= 0 && x < i64::from(self.size.x) && y < i64::from(self.size.y);
        let i = (y * i64::from(self.size.x) + x) as usize;
        if is_in { [self.right[i], self.down[i]] } else { [0.0; 2] }
    }

    /// The nearest slopes of a height that is zero outside, by the definition in the documentation, solved directly.
    fn nearest(&self) -> Self {
        let (size, mut source) = (self.size, Grid::new(self.size, 0.0));
        for y in 0..i64::from(size.y) {
            for x in 0..i64::from(size.x) {
                // Through the four sides of the texel.
                let side = |dx: i64, dy: i64, axis: usize| 0.5 * (self.at(x, y)[axis] + self.at(x + dx, y + dy)[axis]);
                source.row_mut(y as usize)[x as usize] =
                    side(1, 0, 0) - side(-1, 0, 0) + side(0, 1, 1) - side(0, -1, 1);
            }
        }
        let u = direct(&source);
        let height = |x: i64, y: i64| {
            if x < 0 || y < 0 { 0.0 } else { u.get(x as u32, y as u32).unwrap_or(0.0) }
        };
        Self::new(size, |x, y| {
            let (x, y) = (i64::from(x), i64::from(y));
            let own = self.at(x, y);
            let blurred = |dx, dy, axis: usize| {
                0.25 * (self.at(x - dx, y - dy)[axis] + 2.0 * own[axis] + self.at(x + dx, y + dy)[axis])
            };
            [
                own[0] - blurred(1, 0, 0) + 0.5 * (height(x + 1, y) - height(x - 1, y)),
                own[1] - blurred(0, 1, 1) + 0.5 * (height(x, y + 1) - height(x, y - 1)),
            ]
        })
    }
}

fn bytes_of([right, down]: [f64; 2]) -> [f64; 3] {
    let length = (right * right + down * down + 1.0).sqrt();
    [right / length, -down / length, 1.0 / length].map(|part| 127.5 + 127.5 * part)
}

fn random_normals(rng: &mut Rng, size: UVec2) -> Vec<u8> {
    let mut texel = || {
        let (x, y) = (rng.range(-0.6, 0.6), rng.range(-0.6, 0.6));
        let z = (1.0 - x * x - y * y).sqrt();
        [x, y, z, 0.3].map(|part: f32| (127.5 + 127.5 * part).round() as u8)
    };
    (0..size.element_product()).flat_map(|_| texel()).collect()
}

#[test]
fn blended_patches_are_those_of_a_direct_solve() {
    let mut rng = Rng::new(4);
    for part in SIZES.map(UVec2::from) {
        for round in 0..3 {
            let (size, origin) = (part + UVec2::new(5, 3 * round), UVec2::new(2, round));
            let base = random_normals(&mut rng, size);
            let height = random(&mut rng, part, 2.0);
            let covers = random(&mut rng, part, 1.5);
            let cover = (round > 0).then_some(&covers);
            let mut blended = base.clone();
            let patch = ReliefPatch { height: &height, cover, origin };
            let rect = blend_relief(&mut blended, size, &patch, NormalBlending::Poisson).unwrap();
            assert_eq!((rect.min, rect.max), (origin, origin + part));
            let texel = |of: &[u8], x: u32, y: u32| -> [u8; 4] {
                let i = 4 * ((origin.y + y) * size.x + origin.x + x) as usize;
                of[i..i + 4].try_into().unwrap()
            };
            let base_slope = |x, y| slope_of(texel(&base, x, y)).map(f64::from);
            let near = |x: i64, y: i64| {
                let (x, y) = (x.clamp(0, i64::from(part.x) - 1), y.clamp(0, i64::from(part.y) - 1));
                f64::from(height.get(x as u32, y as u32).unwrap())
            };
            let added = Wide::new(part, |x, y| {
                let share = cover.map_or(1.0, |cover| f64::from(cover.get(x, y).unwrap()).clamp(0.0, 1.0));
                let own = base_slope(x, y);
                let (x, y) = (i64::from(x), i64::from(y));
                let (mut right, mut down) = (0.0, 0.0);
                for (k, weight) in [(-1, 1.0), (0, 2.0), (1, 1.0)] {
                    right -= weight / 8.0 * (near(x + 1, y + k) - near(x - 1, y + k));
                    down -= weight / 8.0 * (near(x + k, y + 1) - near(x + k, y - 1));
                }
                let from_border = |at: i64, side: u32| (at as f64 + 0.5).min(f64::from(side) - at as f64 - 0.5);
                let width = (0.5 * f64::from(part.min_element())).min(8.0);
                let t = (from_border(x, part.x).min(from_border(y, part.y)) / width).min(1.0);
                let inside = t * t * (3.0 - 2.0 * t);
                [inside * (right - share * own[0]), inside * (down - share * own[1])]
            });
            let added = added.nearest();
            for (y, x) in (0..part.y).flat_map(|y| (0..part.x).map(move |x| (y, x))) {
                let (own, more) = (base_slope(x, y), added.at(x.into(), y.into()));
                let expected = bytes_of([own[0] + more[0], own[1] + more[1]]);
                let [r, g, b, alpha] = texel(&blended, x, y);
                for (byte, expected) in [r, g, b].into_iter().zip(expected) {
                    assert!((f64::from(byte) - expected).abs() < 0.51, "{part} {x} {y}: {byte} {expected}");
                }
                assert_eq!(alpha, texel(&base, x, y)[3]);
                let length: f64 = [r, g, b].map(|byte| (f64::from(byte) - 127.5) / 127.5).map(|v| v * v).iter().sum();
                assert!((length.sqrt() - 1.0).abs() < 0.01, "{length}");
            }
            for i in 0..size.element_product() {
                let at = UVec2::new(i % size.x, i / size.x);
                let is_in = at.cmpge(rect.min).all() && at.cmplt(rect.max).all();
                let bytes = 4 * i as usize..4 * i as usize + 4;
                assert!(is_in || blended[bytes.clone()] == base[bytes], "{at} is outside");
            }
        }
    }
}

/// Along the border of a patch normals jump less than where slopes are added or normals blended by whiteout.
#[test]
fn the_seam_of_a_blended_patch_is_the_smallest() {
    let mut rng = Rng::new(9);
    for case in 0..40 {
        let part = UVec2::new(20 + rng.next_u32() % 60, 20 + rng.next_u32() % 60);
        let (size, origin) = (part + 9, UVec2::new(4, 5));
        // A wavy surface, and a relief that leans, with bumps, up to its borders.
        let [a, b, lean] = [rng.range(0.05, 0.2), rng.range(0.05, 0.2), rng.range(0.1, 0.6)];
        let wave = |x: u32, y: u32| [0.3 * ops::sin(a * x as f32), 0.3 * ops::cos(b * y as f32)];
        let texel = |i: u32| {
            let bytes = bytes_of(wave(i % size.x, i / size.x).map(f64::from));
            [bytes[0], bytes[1], bytes[2], 255.0].map(|value| value.round() as u8)
        };
        let base: Vec<u8> = (0..size.element_product()).flat_map(texel).collect();
        let mut height = Grid::new(part, 0.0);
        for y in 0..part.y {
            for (x, height) in (0..part.x).zip(height.row_mut(y as usize)) {
                *height = lean * x as f32 + 2.0 * ops::sin(0.5 * y as f32 + a * x as f32);
            }
        }
        let energies = [NormalBlending::Plain, NormalBlending::Whiteout, NormalBlending::Poisson].map(|blending| {
            let mut blended = base.clone();
            let patch = ReliefPatch { height: &height, cover: None, origin };
            let rect = blend_relief(&mut blended, size, &patch, blending).unwrap();
            let jump = |a: UVec2, b: UVec2| {
                let at = |of: &[u8], texel: UVec2, k: usize| {
                    (f64::from(of[4 * (texel.y * size.x + texel.x) as usize + k]) - 127.5) / 127.5
                };
                let change = |k| at(&blended, a, k) - at(&blended, b, k) - (at(&base, a, k) - at(&base, b, k));
                (0..3).map(change).map(|v: f64| v * v).sum::<f64>()
            };
            let (low, high) = (rect.min, rect.max - 1);
            let rows = (low.y..=high.y).flat_map(|y| {
                [(UVec2::new(low.x, y), UVec2::new(low.x - 1, y)), (UVec2::new(high.x, y), UVec2::new(high.x + 1, y))]
            });
            let columns = (low.x..=high.x).flat_map(|x| {
                [(UVec2::new(x, low.y), UVec2::new(x, low.y - 1)), (UVec2::new(x, high.y), UVec2::new(x, high.y + 1))]
            });
            rows.chain(columns).map(|(a, b)| jump(a, b)).sum::<f64>()
        });
        let [plain, whiteout, poisson] = energies;
        assert!(poisson < 0.5 * plain.min(whiteout), "case {case}: {energies:?}");
    }
}

/// Depths of some strokes, and the normals of a base.
fn cracked(rng: &mut Rng, size: UVec2, map: UVec2) -> (Grid<u16>, Vec<u8>) {
    let mut depth = Grid::new(size, 0u16);
    for _ in 0..3 {
        let (mut x, mut y) = (rng.range(0.0, size.x as f32), rng.range(0.0, size.y as f32));
        let (dx, dy) = (rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
        for _ in 0..8 {
            if let Some(texel) = depth.as_mut_slice().get_mut(y as usize * size.x as usize + x as usize) {
                *texel = (*texel).max(rng.next_u32() as u16);
            }
            (x, y) = ((x + dx).clamp(0.0, size.x as f32 - 1.0), (y + dy).clamp(0.0, size.y as f32 - 1.0));
        }
    }
    (depth, random_normals(rng, map))
}

#[test]
fn corrections_are_those_of_a_direct_solve() {
    let mut rng = Rng::new(5);
    for size in [[1, 1], [1, 19], [23, 1], [12, 9], [31, 30], [70, 50]].map(UVec2::from) {
        let (origin, map) = (UVec2::new(3, 1), size + UVec2::new(4, 2));
        let (depth, normals) = cracked(&mut rng, size, map);
        let Some(correction) = solve_correction(&normals, map, origin, &depth).unwrap() else {
            panic!("{size} has a crack");
        };
        let touched: Vec<_> = (0..size.element_product())
            .map(|i| UVec2::new(i % size.x, i / size.x))
            .filter(|at| depth.get(at.x, at.y).unwrap() > 0)
            .collect();
        let (low, high) = touched.iter().fold((UVec2::MAX, UVec2::ZERO), |(a, b), at| (a.min(*at), b.max(*at + 1)));
        // The least rectangle, 31 texels more, up to a size with a fast transform.
        let solved = (high - low).map(|side| {
            let is_fast = |period: u32| {
                [1, 3, 5, 9, 15].iter().any(|f| period.is_multiple_of(*f) && (period / f).is_power_of_two())
            };
            (side + 63..).find(|period| is_fast(*period)).unwrap() - 1
        });
        let min = low.as_ivec2() - ((solved - (high - low)) / 2).as_ivec2();
        let taken = Wide::new(solved, |x, y| {
            let at = min + UVec2::new(x, y).as_ivec2();
            let depth = if at.min_element() < 0 { None } else { depth.get(at.x as u32, at.y as u32) };
            let depth = depth.unwrap_or(0);
            if depth == 0 {
                return [0.0; 2];
            }
            let i = 4 * ((origin.y + at.y as u32) * map.x + origin.x + at.x as u32) as usize;
            slope_of(normals[i..i + 4].try_into().unwrap()).map(|slope| -f64::from(cover(depth)) * f64::from(slope))
        });
        let nearest = taken.nearest();
        let mut largest = 0.0f64;
        for (y, x) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (y, x))) {
            let at = UVec2::new(x, y).as_ivec2() - min;
            let is_in = at.min_element() >= 0 && at.as_uvec2().cmplt(solved).all();
            for axis in 0..2 {
                let of = |slopes: &Wide| slopes.at(at.x.into(), at.y.into())[axis];
                let expected = if is_in { of(&nearest) - of(&taken) } else { 0.0 };
                let got = f64::from(correction.at(x, y)[axis]);
                largest = largest.max(expected.abs());
                // A slope of 2/255 is one step of a byte.
                assert!((got - expected).abs() < 0.2 * 2.0 / 255.0, "{size} {x} {y}: {got} {expected}");
            }
        }
        assert!(size == UVec2::ONE || largest > 0.02, "{size}: there is something to correct: {largest}");
    }
}

#[test]
fn nothing_is_corrected_where_nothing_is_missing() {
    let mut rng = Rng::new(6);
    let size = UVec2::new(90, 70);
    let (depth, normals) = cracked(&mut rng, size, size);
    assert_eq!(solve_correction(&normals, size, UVec2::ZERO, &Grid::new(size, 0)), Ok(None));
    // A flat base, and one whose normals point into the surface.
    for texel in [[128, 128, 255, 255], [0, 0, 0, 0], [200, 50, 128, 255], [255, 0, 10, 9]] {
        let normals = texel.repeat(size.element_product() as usize);
        let correction = solve_correction(&normals, size, UVec2::ZERO, &depth).unwrap().unwrap();
        let all = (0..size.element_product()).map(|i| correction.at(i % size.x, i / size.x));
        assert!(all.flatten().all(|slope| slope.abs() < 0.004), "{texel:?}");
    }
    assert_eq!(solve_correction(&normals, size, UVec2::ZERO, &Grid::new(UVec2::ZERO, 0)), Ok(None));
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let size = UVec2::new(6, 4);
    let (normals, depth) = (vec![128; 4 * 24], Grid::new(UVec2::splat(3), 9));
    let outside = |origin| Err(BlendError::Outside { part: UVec2::splat(3), origin, size });
    for origin in [[4, 0], [0, 2], [u32::MAX, 0], [7, 9]].map(UVec2::from) {
        assert_eq!(solve_correction(&normals, size, origin, &depth), outside(origin));
        let height = Grid::new(UVec2::splat(3), 0.0);
        let patch = ReliefPatch { height: &height, cover: None, origin };
        let mut blended = normals.clone();
        assert_eq!(blend_relief(&mut blended, size, &patch, NormalBlending::Plain).map(|_| None), outside(origin));
    }
    for length in [0, 4 * 23, 4 * 25, 4 * 24 + 1] {
        let refused = Err(BlendError::Length { size, length });
        assert_eq!(solve_correction(&vec![0; length], size, UVec2::ZERO, &depth), refused);
    }
    let huge = Err(BlendError::Length { size: UVec2::MAX, length: 4 });
    assert_eq!(solve_correction(&[0; 4], UVec2::MAX, UVec2::ZERO, &depth), huge);
}

#[test]
fn patches_with_bad_values_are_refused_and_extreme_ones_give_unit_normals() {
    let (size, part) = (UVec2::new(12, 10), UVec2::new(7, 5));
    let base = random_normals(&mut Rng::new(8), size);
    let good = Grid::new(part, 0.5);
    let mut bad = good.clone();
    bad.row_mut(4)[6] = f32::NAN;
    let narrow = Grid::new(UVec2::new(6, 5), 0.0);
    let origin = UVec2::ONE;
    let nan = BlendError::NotFinite { x: 6, y: 4 };
    for blending in [NormalBlending::Plain, NormalBlending::Whiteout, NormalBlending::Poisson] {
        for (height, cover, error) in [
            (&bad, None, nan),
            (&good, Some(&bad), nan),
            (&good, Some(&narrow), BlendError::Cover { cover: narrow.size(), height: part }),
        ] {
            let mut blended = base.clone();
            let patch = ReliefPatch { height, cover, origin };
            assert_eq!(blend_relief(&mut blended, size, &patch, blending), Err(error));
            assert_eq!(blended, base);
        }
        let empty = Grid::new(UVec2::new(0, 5), 0.0);
        let patch = ReliefPatch { height: &empty, cover: None, origin };
        let mut blended = base.clone();
        assert!(blend_relief(&mut blended, size, &patch, blending).unwrap().is_empty());
        assert_eq!(blended, base);

        let mut cliff = Grid::new(part, -1e20);
        cliff.row_mut(2).fill(1e20);
        let patch = ReliefPatch { height: &cliff, cover: Some(&good), origin };
        // Normals without length, and such as point into the surface.
        let mut blended = [[0, 0, 0, 1], [128, 128, 128, 2], [127, 0, 3, 3]].concat().repeat(40);
        blend_relief(&mut blended, size, &patch, blending).unwrap();
        for y in 1..6 {
            for texel in blended[4 * (y * 12 + 1)..][..28].chunks(4) {
                let length: f32 = texel[..3].iter().map(|byte| (f32::from(*byte) - 127.5) / 127.5).map(|v| v * v).sum();
                assert!((length.sqrt() - 1.0).abs() < 0.02, "{blending:?} {texel:?}");
            }
        }
    }
}
