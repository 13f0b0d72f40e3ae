//! [`MipLevels`]: smaller versions of a texture, for when it is seen from afar.

use crate::math::ops::powf;
use crate::raster::TexelRect;
use core::ops::Range;
use glam::UVec2;
use std::sync::LazyLock;

/// What the bytes of a texture mean, by which its texels are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TexelKind {
    /// RGBA, 8 bits each, sRGB with straight alpha: averaged as light, each colour by its alpha. Where all is transparent, as if it were opaque.
    Color,
    /// RGBA, 8 bits each, averaged as numbers: normals.
    Linear,
    /// One number of 8 bits: depths.
    Single,
}

impl TexelKind {
    /// Bytes of a texel.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self {
            Self::Color | Self::Linear => 4,
            Self::Single => 1,
        }
    }
}

/// The mip levels of a texture, one after the other: level 0 is the texture itself, each further one half as wide and high, rounded down, and the last
/// one is a single texel.
///
/// Each texel is the mean of those below it, by the area that they share, rounded to the nearest byte: two by two of them where the sides are even, up
/// to three by three else. So a level that is brought up to date in a rectangle equals one that is made anew, bit for bit.
///
/// ```
/// use bevy_crack::paint::{MipLevels, TexelKind};
/// use bevy_crack::raster::TexelRect;
/// use glam::UVec2;
///
/// let levels = MipLevels::new(UVec2::new(4, 2), TexelKind::Single);
/// assert_eq!((levels.count(), levels.size(1), levels.bytes()), (3, UVec2::new(2, 1), 8 + 2 + 1));
/// let mut texels = vec![10, 10, 30, 30, 10, 10, 30, 30, 0, 0, 0];
/// levels.update(&mut texels, &[TexelRect::whole(UVec2::new(4, 2))]);
/// assert_eq!(texels[8..], [10, 30, 20]);
/// // Only what lies above a texel changes with it.
/// texels[0] = 50;
/// let changed = levels.update(&mut texels, &[TexelRect { min: UVec2::ZERO, max: UVec2::ONE }]);
/// assert_eq!(texels[8..], [20, 30, 25]);
/// assert_eq!(changed.len(), 2, "a rectangle in each of the two levels");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MipLevels {
    size: UVec2,
    kind: TexelKind,
}

impl MipLevels {
    /// Of a texture of `size` texels.
    #[must_use]
    pub const fn new(size: UVec2, kind: TexelKind) -> Self {
        Self { size, kind }
    }

    /// What its bytes mean.
    #[must_use]
    pub const fn kind(self) -> TexelKind {
        self.kind
    }

    /// How many levels there are, the texture itself included; at least 1.
    #[must_use]
    pub fn count(self) -> u32 {
        self.size.max_element().max(1).ilog2() + 1
    }

    /// Width and height of a level, texels.
    #[must_use]
    pub fn size(self, level: u32) -> UVec2 {
        let half = |side: u32| side.checked_shr(level).unwrap_or(0).max(side.min(1));
        UVec2::new(half(self.size.x), half(self.size.y))
    }

    /// Where the bytes of a level lie.
    #[must_use]
    pub fn range(self, level: u32) -> Range<usize> {
        let start = (0..level.min(self.count())).map(|level| self.level_bytes(level)).sum();
        start..start + self.level_bytes(level)
    }

    /// Bytes of all levels.
    #[must_use]
    pub fn bytes(self) -> usize {
        self.range(self.count() - 1).end
    }

    fn level_bytes(self, level: u32) -> usize {
        self.size(level).as_usizevec2().element_product() * self.kind.bytes()
    }

    /// What depends on `rects` of level 0 in all further levels: rectangles, each with its level, level by level.
    #[must_use]
    pub fn above(self, rects: &[TexelRect]) -> Vec<(u32, TexelRect)> {
        let whole = TexelRect::whole(self.size);
        let rects = rects.iter().map(|rect| rect.intersect(whole));
        let mut rects: Vec<_> = rects.filter(|rect| !rect.is_empty()).collect();
        let mut all = Vec::new();
        for level in 1..self.count() {
            let (from, to) = (self.size(level - 1), self.size(level));
            rects.iter_mut().for_each(|rect| *rect = above(*rect, from, to));
            gather(&mut rects);
            all.extend(rects.iter().map(|rect| (level, *rect)));
        }
        all
    }

    /// Brings all further levels up to date where `rects` of level 0 have changed, and returns [what that is](Self::above). Does nothing if
    /// `texels` is shorter than [`bytes`](Self::bytes).
    pub fn update(self, texels: &mut [u8], rects: &[TexelRect]) -> Vec<(u32, TexelRect)> {
        if texels.len() < self.bytes() {
            return Vec::new();
        }
        let changed = self.above(rects);
        for (level, rect) in &changed {
            let (range, start) = (self.range(*level), self.range(level - 1).start);
            let (below, texels) = texels[start..range.end].split_at_mut(range.start - start);
            self.average((below, self.size(level - 1)), (texels, self.size(*level)), *rect);
        }
        changed
    }

    /// Makes the texels `rect` of a level from those below.
    fn average(self, (below, from): (&[u8], UVec2), (texels, to): (&mut [u8], UVec2), rect: TexelRect) {
        let columns: Vec<Taps> = (rect.min.x..rect.max.x).map(|x| Taps::new(x, from.x, to.x)).collect();
        for y in rect.min.y..rect.max.y {
            let rows = Taps::new(y, from.y, to.y);
            let at = (y as usize * to.x as usize + rect.min.x as usize) * self.kind.bytes();
            let out = &mut texels[at..];
            let source = Source { texels: below, width: from.x as usize, rows };
            match (self.kind, from.x.is_multiple_of(2) && rows.count == 2) {
                (TexelKind::Color, true) => source.even_row(&columns, out, color_of_four),
                (TexelKind::Linear, true) => source.even_row(&columns, out, mean_of_four::<4>),
                (TexelKind::Single, true) => source.even_row(&columns, out, mean_of_four::<1>),
                (TexelKind::Color, false) => source.row(&columns, out, color),
                (TexelKind::Linear, false) => source.row(&columns, out, mean::<4>),
                (TexelKind::Single, false) => source.row(&columns, out, mean::<1>),
            }
        }
    }
}

/// The texels of a level that depend on those of a rectangle of the one below.
fn above(rect: TexelRect, from: UVec2, to: UVec2) -> TexelRect {
    // Beside those of its own, the last column of an odd side counts for the texel before.
    let first = |at: u32, from: u32| if !from.is_multiple_of(2) { at.saturating_sub(1) / 2 } else { at / 2 };
    let last = UVec2::new((rect.max.x - 1) / 2, (rect.max.y - 1) / 2).min(to - 1);
    TexelRect { min: UVec2::new(first(rect.min.x, from.x), first(rect.min.y, from.y)).min(last), max: last + 1 }
}

/// One rectangle around all, if that is hardly more.
fn gather(rects: &mut Vec<TexelRect>) {
    let around = rects.iter().fold(TexelRect::default(), |around, rect| around.union(*rect));
    let area: u64 = rects.iter().map(TexelRect::area).sum();
    if rects.len() > 1 && 4 * around.area() <= 5 * area {
        *rects = vec![around];
    }
}

/// The texels of a side that one of the next level is the mean of, and their weights.
#[derive(Clone, Copy)]
struct Taps {
    first: usize,
    count: usize,
    weights: [u32; 3],
}

impl Taps {
    /// Texel `at` of a side of `to` texels, made from one of `from`.
    const fn new(at: u32, from: u32, to: u32) -> Self {
        let (count, weights) = match from {
            1 => (1, [1, 0, 0]),
            _ if from.is_multiple_of(2) => (2, [1, 1, 0]),
            // Each is (2 to + 1) / to texels wide.
            _ => (3, [to - at, to, at + 1]),
        };
        Self { first: 2 * at as usize, count, weights }
    }
}

/// Rows of a level.
struct Source<'a> {
    texels: &'a [u8],
    width: usize,
    rows: Taps,
}

impl Source<'_> {
    /// Makes a row of the next level.
    fn row<const N: usize>(&self, columns: &[Taps], out: &mut [u8], mean: impl Fn(&[([u8; N], u64)]) -> [u8; N]) {
        let below = self.texels.as_chunks::<N>().0;
        for (out, columns) in out.as_chunks_mut::<N>().0.iter_mut().zip(columns) {
            let mut taps = [([0; N], 0); 9];
            let mut n = 0;
            for (y, row_weight) in (self.rows.first..).zip(self.rows.weights).take(self.rows.count) {
                let start = y * self.width + columns.first;
                for (texel, weight) in below[start..start + columns.count].iter().zip(columns.weights) {
                    taps[n] = (*texel, u64::from(row_weight) * u64::from(weight));
                    n += 1;
                }
            }
            *out = mean(&taps[..n]);
        }
    }

    /// The same where each texel is the mean of two by two.
    fn even_row<const N: usize>(&self, columns: &[Taps], out: &mut [u8], mean: impl Fn([[u8; N]; 4]) -> [u8; N]) {
        let Some(first) = columns.first().map(|taps| taps.first) else { return };
        let row = |y: usize| {
            let start = (y * self.width + first) * N;
            self.texels[start..start + 2 * N * columns.len()].as_chunks::<N>().0.as_chunks::<2>().0
        };
        let pairs = row(self.rows.first).iter().zip(row(self.rows.first + 1));
        for (out, ([a, b], [c, d])) in out.as_chunks_mut::<N>().0.iter_mut().zip(pairs) {
            *out = mean([*a, *b, *c, *d]);
        }
    }
}

/// The mean of numbers, to the nearest.
fn mean<const N: usize>(taps: &[([u8; N], u64)]) -> [u8; N] {
    let all: u64 = taps.iter().map(|(_, weight)| weight).sum();
    core::array::from_fn(|i| {
        let sum: u64 = taps.iter().map(|(texel, weight)| u64::from(texel[i]) * weight).sum();
        ((sum + all / 2) / all) as u8
    })
}

/// [`mean`] of four that weigh the same.
fn mean_of_four<const N: usize>(taps: [[u8; N]; 4]) -> [u8; N] {
    core::array::from_fn(|i| ((taps.iter().map(|texel| u16::from(texel[i])).sum::<u16>() + 2) / 4) as u8)
}

/// [`color`] of four that weigh the same.
fn color_of_four(taps: [[u8; 4]; 4]) -> [u8; 4] {
    if taps.iter().any(|texel| texel[3] != 255) {
        return color(&taps.map(|texel| (texel, 1)));
    }
    let Srgb { light, bytes } = &*SRGB;
    let channel = |i: usize| {
        let sum: u32 = taps.iter().map(|texel| u32::from(light[usize::from(texel[i])])).sum();
        bytes[((sum + 2) / 4) as usize]
    };
    [channel(0), channel(1), channel(2), 255]
}

/// The mean of colours.
fn color(taps: &[([u8; 4], u64)]) -> [u8; 4] {
    let Srgb { light, bytes } = &*SRGB;
    let all: u64 = taps.iter().map(|(_, weight)| weight).sum();
    let alpha: u64 = taps.iter().map(|(texel, weight)| u64::from(texel[3]) * weight).sum();
    let weight = |texel: &[u8; 4], weight: u64| if alpha == 0 { weight } else { weight * u64::from(texel[3]) };
    let weights = if alpha == 0 { all } else { alpha };
    let channel = |i: usize| {
        let sum = taps.iter().map(|(texel, tap)| u64::from(light[usize::from(texel[i])]) * weight(texel, *tap));
        bytes[((sum.sum::<u64>() + weights / 2) / weights) as usize]
    };
    [channel(0), channel(1), channel(2), ((alpha + all / 2) / all) as u8]
}

/// sRGB to light and back. Light has 16 bits, so that each byte comes back as it was.
struct Srgb {
    light: [u16; 256],
    bytes: Box<[u8]>,
}

static SRGB: LazyLock<Srgb> = LazyLock::new(|| {
    let light = |byte: f32| if byte <= 0.04045 { byte / 12.92 } else { powf((byte + 0.055) / 1.055, 2.4) };
    let byte = |light: f32| if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * powf(light, 1.0 / 2.4) - 0.055 };
    let light = core::array::from_fn(|i| (65535.0 * light(i as f32 / 255.0) + 0.5) as u16);
    Srgb { light, bytes: (0..=u16::MAX).map(|i| (255.0 * byte(f32::from(i) / 65535.0) + 0.5) as u8).collect() }
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    const KINDS: [TexelKind; 3] = [TexelKind::Color, TexelKind::Linear, TexelKind::Single];

    fn below(rng: &mut Rng, n: u32) -> u32 {
        rng.next_u32() % n
    }

    fn random(rng: &mut Rng, levels: MipLevels) -> Vec<u8> {
        let mut texels: Vec<u8> = (0..levels.range(0).end).map(|_| rng.next_u32() as u8).collect();
        if levels.kind == TexelKind::Color {
            // All of it opaque, or all of it transparent, or neither.
            let all = [Some(255), Some(0), None][below(rng, 3) as usize];
            texels.as_chunks_mut::<4>().0.iter_mut().for_each(|texel| texel[3] = all.unwrap_or(texel[3]));
        }
        texels.resize(levels.bytes(), 77);
        texels
    }

    fn light(byte: u8) -> f64 {
        let byte = f64::from(byte) / 255.0;
        if byte <= 0.04045 { byte / 12.92 } else { ((byte + 0.055) / 1.055).powf(2.4) }
    }

    fn srgb(light: f64) -> f64 {
        255.0 * if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
    }

    /// The mean over the area of a texel, by what it shares with each of all texels below.
    fn oracle(kind: TexelKind, texels: &[u8], from: UVec2, to: UVec2, at: UVec2) -> Vec<f64> {
        let shared = |i: u32, from: u32, at: u32, to: u32| {
            let scale = f64::from(from) / f64::from(to);
            let (start, end) = (f64::from(at) * scale, f64::from(at + 1) * scale);
            (end.min(f64::from(i) + 1.0) - start.max(f64::from(i))).max(0.0)
        };
        let n = kind.bytes();
        let (mut sums, mut weights) = (vec![0.0; n], vec![0.0; n]);
        let is_clear = |by_alpha: bool| {
            let mut sum = 0.0;
            let mut add = |x: u32, y: u32, alpha: f64| {
                sum += shared(x, from.x, at.x, to.x) * shared(y, from.y, at.y, to.y) * alpha;
            };
            (0..from.y).for_each(|y| {
                (0..from.x).for_each(|x| add(x, y, f64::from(texels[(y * from.x + x) as usize * n + n - 1])));
            });
            by_alpha && sum == 0.0
        };
        let is_clear = is_clear(kind == TexelKind::Color);
        for y in 0..from.y {
            for x in 0..from.x {
                let share = shared(x, from.x, at.x, to.x) * shared(y, from.y, at.y, to.y);
                let texel = &texels[(y * from.x + x) as usize * n..][..n];
                for i in 0..n {
                    let is_color = kind == TexelKind::Color && i < 3;
                    let weight = if is_color && !is_clear { share * f64::from(texel[3]) } else { share };
                    sums[i] += weight * if is_color { light(texel[i]) } else { f64::from(texel[i]) };
                    weights[i] += weight;
                }
            }
        }
        let mean = |i: usize| sums[i] / weights[i];
        (0..n).map(|i| if kind == TexelKind::Color && i < 3 { srgb(mean(i)) } else { mean(i) }).collect()
    }

    #[test]
    fn each_texel_is_the_mean_of_its_area() {
        let mut rng = Rng::new(5);
        for size in [[1, 1], [2, 2], [1, 9], [8, 8], [7, 5], [13, 6], [30, 17]].map(UVec2::from) {
            for kind in KINDS {
                let levels = MipLevels::new(size, kind);
                let mut texels = random(&mut rng, levels);
                levels.update(&mut texels, &[TexelRect::whole(size)]);
                assert_eq!(levels.size(levels.count() - 1), UVec2::ONE);
                for level in 1..levels.count() {
                    let (from, to) = (levels.size(level - 1), levels.size(level));
                    for i in 0..to.element_product() {
                        let at = UVec2::new(i % to.x, i / to.x);
                        let wanted = oracle(kind, &texels[levels.range(level - 1)], from, to, at);
                        let got = &texels[levels.range(level)][i as usize * kind.bytes()..];
                        for (wanted, got) in wanted.iter().zip(got) {
                            // The nearest byte, but for the rounding of 16 bits.
                            assert!(
                                (wanted - f64::from(*got)).abs() < 0.53,
                                "{size} {kind:?} {level} {at}: {wanted} {got}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_brought_up_to_date_equals_what_is_made_anew() {
        let mut rng = Rng::new(9);
        for _ in 0..200 {
            let size = UVec2::new(1 + below(&mut rng, 70), 1 + below(&mut rng, 70));
            let kind = KINDS[below(&mut rng, 3) as usize];
            let levels = MipLevels::new(size, kind);
            let mut texels = random(&mut rng, levels);
            levels.update(&mut texels, &[TexelRect::whole(size)]);
            let before = texels.clone();
            let mut rects = Vec::new();
            for _ in 0..1 + below(&mut rng, 4) {
                let mut corner = || UVec2::new(below(&mut rng, size.x), below(&mut rng, size.y));
                let (a, b) = (corner(), corner());
                let rect = TexelRect { min: a.min(b), max: a.max(b) + 1 };
                for y in rect.min.y..rect.max.y {
                    let row = (y * size.x + rect.min.x) as usize * kind.bytes();
                    let row = row..row + rect.size().x as usize * kind.bytes();
                    texels[row].iter_mut().for_each(|byte| *byte = rng.next_u32() as u8);
                }
                rects.push(rect);
            }
            let mut anew = texels.clone();
            levels.update(&mut anew, &[TexelRect::whole(size)]);
            let changed = levels.update(&mut texels, &rects);
            assert!(texels == anew, "{size} {rects:?}");
            // And says so of all that has changed.
            for level in 1..levels.count() {
                let (range, width) = (levels.range(level), levels.size(level).x as usize);
                let texel = kind.bytes();
                for (i, (a, b)) in before[range.clone()].chunks(texel).zip(texels[range].chunks(texel)).enumerate() {
                    let at = UVec2::new((i % width) as u32, (i / width) as u32);
                    let is_in = |rect: &TexelRect| at.cmpge(rect.min).all() && at.cmplt(rect.max).all();
                    let is_told = changed.iter().any(|(of, rect)| *of == level && is_in(rect));
                    assert!(a == b || is_told, "{size} {level} {at}");
                }
            }
        }
    }

    #[test]
    fn even_surfaces_stay_as_they_are_at_all_levels() {
        let size = UVec2::new(21, 8);
        for byte in 0..=255 {
            for alpha in [255, 128, 0] {
                let levels = MipLevels::new(size, TexelKind::Color);
                let texel = [byte, 255 - byte, byte / 2, alpha];
                let mut texels = texel.repeat(21 * 8);
                texels.resize(levels.bytes(), 0);
                levels.update(&mut texels, &[TexelRect::whole(size)]);
                assert!(texels.as_chunks::<4>().0.iter().all(|other| *other == texel), "{texel:?}");
            }
        }
    }

    #[test]
    fn texels_that_are_too_few_and_empty_textures_are_left_alone() {
        let levels = MipLevels::new(UVec2::new(4, 4), TexelKind::Linear);
        let mut texels = vec![9; levels.bytes() - 1];
        assert!(levels.update(&mut texels, &[TexelRect::whole(UVec2::splat(4))]).is_empty());
        assert!(texels.iter().all(|byte| *byte == 9));
        let none = MipLevels::new(UVec2::ZERO, TexelKind::Color);
        assert_eq!((none.count(), none.bytes()), (1, 0));
        assert!(none.update(&mut [], &[TexelRect::whole(UVec2::ONE)]).is_empty());
        let levels = MipLevels::new(UVec2::new(4, 4), TexelKind::Single);
        let mut texels = vec![9; levels.bytes()];
        let beyond = TexelRect { min: UVec2::splat(9), max: UVec2::splat(12) };
        assert!(levels.update(&mut texels, &[beyond, TexelRect::default()]).is_empty());
    }
}
