//! The texel loops.
//!
//! A row is painted in pieces of [`PIECE`] texels. A piece looks at its [`Window`] of the depth field; if that is
//! untouched, the base is copied, else the slopes are computed for the whole piece at once and used by diffuse and
//! normal. Pieces are a matter of speed alone: every texel depends on its own 3 x 3 depths and on the base.

use super::LookTable;
use crate::{
    Grid,
    raster::{DepthField, TexelRect},
};
use glam::UVec2;
use std::ops::Range;

/// The untouched picture. All slices are row-major over the whole image of `size` texels.
#[derive(Clone, Copy, Debug)]
pub struct BaseTexels<'a> {
    /// Size of the image.
    pub size: UVec2,
    /// RGBA8, sRGB.
    pub diffuse: &'a [u8],
    /// RGBA8 tangent-space normals, linear, +Y up; `None` = flat.
    pub normal: Option<&'a [u8]>,
    /// R8 depth, 255 = bottom; `None` = 0 everywhere.
    pub depth: Option<&'a [u8]>,
}

/// Where to paint. Slices as in [`BaseTexels`], same size; `None` = not wanted.
#[derive(Debug)]
pub struct PaintTargets<'a> {
    /// RGBA8, sRGB.
    pub diffuse: Option<&'a mut [u8]>,
    /// RGBA8 tangent-space normals, linear, +Y up.
    pub normal: Option<&'a mut [u8]>,
    /// R8 depth, 255 = bottom.
    pub depth: Option<&'a mut [u8]>,
}

/// A texel of four bytes.
type Rgba = [u8; 4];

/// The normal of an even surface.
const FLAT: Rgba = [128, 128, 255, 255];

/// Texels painted at once. Longer pieces are copied untouched less often, shorter ones overlap their neighbours more.
const PIECE: usize = 64;

/// How much brighter a wall gets that faces the light squarely, for a glint of 1: a highlight of the crack's own, sRGB
/// levels, and a share of what is there. Found by eye on glass (the first) and concrete (the second).
const HIGHLIGHT: f32 = 40.0;
const SHADING: f32 = 0.5;

/// Paints the texels `rect` of `field`, whose top left lies at `origin` in the image (an atlas frame; else zero).
///
/// `rect` is in texels of the field and is clipped to it; texels of the field outside the image are left out.
/// Slices shorter than `size` says are left alone, and so is a target whose base slice is too short.
pub fn paint_into(
    base: BaseTexels<'_>,
    field: &DepthField,
    look: &LookTable,
    rect: TexelRect,
    origin: UVec2,
    targets: &mut PaintTargets<'_>,
) {
    // The part of the field that lies in the image.
    let visible = field.depth.size().min(base.size.saturating_sub(origin));
    let rect = rect.intersect(TexelRect::whole(visible));
    let Some(texels) = (base.size.x as usize).checked_mul(base.size.y as usize) else { return };
    if rect.is_empty() {
        return;
    }
    let stride = base.size.x as usize;
    let diffuse = base.diffuse.as_chunks().0;
    let frame = Frame { base: diffuse, stride, origin, size: visible };
    let mut diffuse_out = targets.diffuse.as_deref_mut().map(|out| out.as_chunks_mut().0);
    diffuse_out.take_if(|out| out.len() < texels || diffuse.len() < texels);

    let normal = base.normal.map(|base| base.as_chunks().0);
    let mut normal_out = targets.normal.as_deref_mut().map(|out| out.as_chunks_mut().0);
    normal_out.take_if(|out| out.len() < texels || normal.is_some_and(|base| base.len() < texels));

    let mut depth_out = targets.depth.as_deref_mut();
    depth_out.take_if(|out| out.len() < texels || base.depth.is_some_and(|base| base.len() < texels));

    let mut slopes = Slopes::default();
    for y in rect.min.y..rect.max.y {
        let mut x = rect.min.x as usize;
        while x < rect.max.x as usize {
            let n = PIECE.min(rect.max.x as usize - x);
            let first = (origin.y + y) as usize * stride + origin.x as usize + x;
            let at = first..first + n;
            let window = Window::new(&field.depth, x, y as usize, n);
            let touched = window.is_touched();
            if touched && (diffuse_out.is_some() || normal_out.is_some()) {
                slopes.measure(&window, look.slope);
            }
            if let Some(out) = &mut diffuse_out {
                let out = &mut out[at.clone()];
                if touched {
                    diffuse_piece(out, &frame, &window, &slopes, look, UVec2::new(x as u32, y));
                } else {
                    out.copy_from_slice(&diffuse[at.clone()]);
                }
            }
            if let Some(out) = &mut normal_out {
                let out = &mut out[at.clone()];
                match (normal, touched) {
                    (Some(base), true) => tilted_piece(out, &base[at.clone()], &slopes),
                    (Some(base), false) => out.copy_from_slice(&base[at.clone()]),
                    (None, true) => flat_piece(out, &slopes),
                    (None, false) => out.fill(FLAT),
                }
            }
            if let Some(out) = &mut depth_out {
                depth_piece(&mut out[at.clone()], base.depth, at, window.middle());
            }
            x += n;
        }
    }
}

/// The depths of a piece and of the texels around it, repeated at the border of the field.
struct Window {
    rows: [[u16; PIECE + 2]; 3],
    n: usize,
}

impl Window {
    /// The window of the `n` texels from column `x` of row `y`.
    #[inline]
    fn new(depth: &Grid<u16>, x: usize, y: usize, n: usize) -> Self {
        let mut rows = [[0; PIECE + 2]; 3];
        for (row, y) in rows.iter_mut().zip([y.saturating_sub(1), y, (y + 1).min(depth.height() - 1)]) {
            let from = depth.row(y);
            row[1..=n].copy_from_slice(&from[x..x + n]);
            row[0] = from[x.saturating_sub(1)];
            row[n + 1] = from[(x + n).min(from.len() - 1)];
        }
        Self { rows, n }
    }

    fn is_touched(&self) -> bool {
        self.rows.as_flattened().iter().fold(0, |any, &depth| any | depth) != 0
    }

    fn middle(&self) -> &[u16] {
        &self.rows[1][1..=self.n]
    }
}

/// Slopes of a piece of the surface, as the normal before normalizing: `(x, y, 1)`, x right, y **down** the picture.
struct Slopes {
    x: [f32; PIECE],
    y: [f32; PIECE],
    /// One over the length of `(x, y, 1)`.
    inv_len: [f32; PIECE],
}

impl Default for Slopes {
    fn default() -> Self {
        Self { x: [0.0; PIECE], y: [0.0; PIECE], inv_len: [1.0; PIECE] }
    }
}

impl Slopes {
    /// Sobel's operator on the depths; a wall that goes down to the right leans to the right.
    #[inline]
    fn measure(&mut self, window: &Window, scale: f32) {
        let [up, middle, down] = &window.rows;
        let mut sum = [0i32; PIECE + 2];
        let mut gain = [0i32; PIECE + 2];
        for i in 0..PIECE + 2 {
            let [u, m, d] = [up[i], middle[i], down[i]].map(i32::from);
            sum[i] = u + 2 * m + d;
            gain[i] = d - u;
        }
        for i in 0..PIECE {
            let x = (sum[i + 2] - sum[i]) as f32 * scale;
            let y = (gain[i] + 2 * gain[i + 1] + gain[i + 2]) as f32 * scale;
            self.x[i] = x;
            self.y[i] = y;
            self.inv_len[i] = 1.0 / (x * x + y * y + 1.0).sqrt();
        }
    }
}

/// Rounds a value of 0..=255 (plus less than a half on either side); see the stamps for why not by a cast.
#[inline(always)]
fn round(value: f32) -> u32 {
    (value + 8_388_608.0).to_bits() & 255
}

#[inline(always)]
fn normal_bytes(x: f32, y: f32, z: f32, alpha: u32) -> u32 {
    let byte = |v: f32| round(v * 127.5 + 127.5);
    byte(x) | byte(y) << 8 | byte(z) << 16 | alpha << 24
}

/// Normals over an even base.
fn flat_piece(out: &mut [Rgba], slopes: &Slopes) {
    for (((out, &x), &y), &inv_len) in out.iter_mut().zip(&slopes.x).zip(&slopes.y).zip(&slopes.inv_len) {
        *out = normal_bytes(x * inv_len, -y * inv_len, inv_len, 255).to_le_bytes();
    }
}

/// Normals over base normals: the slopes of base and crack add up, which is exact for heights that add up.
fn tilted_piece(out: &mut [Rgba], base: &[Rgba], slopes: &Slopes) {
    for (((out, &base), &x), &y) in out.iter_mut().zip(base).zip(&slopes.x).zip(&slopes.y) {
        let bytes = u32::from_le_bytes(base);
        let part = |shift: u32| ((bytes >> shift & 255) as i32 as f32 - 127.5) * (1.0 / 127.5);
        let (base_x, base_y, base_z) = (part(0), part(8), part(16));
        // A normal that points into the surface is no normal; it counts as nearly level.
        let z = if base_z > 0.05 { base_z } else { 0.05 };
        let (sum_x, sum_y) = (base_x + x * z, base_y - y * z);
        let inv_len = 1.0 / (sum_x * sum_x + sum_y * sum_y + z * z).sqrt();
        let painted = normal_bytes(sum_x * inv_len, sum_y * inv_len, z * inv_len, bytes >> 24);
        let level = x == 0.0 && y == 0.0;
        *out = if level { bytes } else { painted }.to_le_bytes();
    }
}

fn depth_piece(out: &mut [u8], base: Option<&[u8]>, at: Range<usize>, depths: &[u16]) {
    let byte = |depth: u16| ((u32::from(depth) * 255 + 32_895) >> 16) as u8;
    match base {
        Some(base) => {
            for ((out, &base), &depth) in out.iter_mut().zip(&base[at]).zip(depths) {
                *out = base.max(byte(depth));
            }
        }
        None => {
            for (out, &depth) in out.iter_mut().zip(depths) {
                *out = byte(depth);
            }
        }
    }
}

/// The part of the base picture that belongs to the field.
struct Frame<'a> {
    base: &'a [Rgba],
    stride: usize,
    origin: UVec2,
    size: UVec2,
}

impl Frame<'_> {
    #[inline(always)]
    fn texel(&self, x: u32, y: u32) -> Rgba {
        self.base[(self.origin.y + y) as usize * self.stride + (self.origin.x + x) as usize]
    }

    /// The colour at texel `at` + `offset`, bilinear, weighted by alpha so that the hidden colour of transparent
    /// texels does not show; `None` where all is transparent.
    fn shifted(&self, at: UVec2, offset: [f32; 2]) -> Option<[f32; 3]> {
        let place = |at: u32, offset: f32, size: u32| {
            let pos = (at as f32 + offset).clamp(0.0, (size - 1) as f32);
            let low = pos as u32;
            (low, (low + 1).min(size - 1), pos - low as f32)
        };
        let (x0, x1, tx) = place(at.x, offset[0], self.size.x);
        let (y0, y1, ty) = place(at.y, offset[1], self.size.y);
        let corners = [
            (self.texel(x0, y0), (1.0 - tx) * (1.0 - ty)),
            (self.texel(x1, y0), tx * (1.0 - ty)),
            (self.texel(x0, y1), (1.0 - tx) * ty),
            (self.texel(x1, y1), tx * ty),
        ];
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for ([r, g, b, a], share) in corners {
            let share = share * f32::from(a);
            weight += share;
            for (sum, channel) in sum.iter_mut().zip([r, g, b]) {
                *sum += f32::from(channel) * share;
            }
        }
        (weight > 0.0).then(|| sum.map(|channel| channel / weight))
    }
}

/// 0..1, different for every texel.
fn noise(at: UVec2) -> f32 {
    let mut h = at.x.wrapping_mul(0x9E37_79B1) ^ at.y.wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    ((h ^ (h >> 15)) >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Colours of a piece whose first texel is `at` of the field.
fn diffuse_piece(
    out: &mut [Rgba],
    frame: &Frame<'_>,
    window: &Window,
    slopes: &Slopes,
    look: &LookTable,
    mut at: UVec2,
) {
    for (i, (out, &depth)) in out.iter_mut().zip(window.middle()).enumerate() {
        let base = frame.texel(at.x, at.y);
        let (x, y) = (slopes.x[i] * slopes.inv_len[i], slopes.y[i] * slopes.inv_len[i]);
        let untouched = depth == 0 && x == 0.0 && y == 0.0;
        *out = if untouched || base[3] == 0 { base } else { diffuse_texel(base, depth, [x, y], frame, look, at) };
        at.x += 1;
    }
}

#[inline(always)]
fn diffuse_texel(base: Rgba, depth: u16, tilt: [f32; 2], frame: &Frame<'_>, look: &LookTable, at: UVec2) -> Rgba {
    let mut layer = look.layer(depth);
    if look.grain > 0.0 {
        let share = 1.0 - look.grain * noise(at);
        layer = layer.map(|channel| channel * share);
    }
    let cover = layer[3];
    let mut under = [base[0], base[1], base[2]].map(f32::from);
    if look.shift > 0.0 {
        under = frame.shifted(at, tilt.map(|t| t * look.shift)).unwrap_or(under);
    }
    let alpha = f32::from(base[3]) * (1.0 / 255.0);
    // What the picture and the crack contribute; an opaque crack lies over the picture as another pane would.
    let (under_share, over_share, alpha_out) = if look.opaque && base[3] < 255 {
        let alpha_out = alpha * (1.0 - cover) + cover;
        (alpha * (1.0 - cover) / alpha_out, 1.0 / alpha_out, round(alpha_out * 255.0) as u8)
    } else {
        (1.0 - cover, 1.0, base[3])
    };
    // Light from the upper left, on a normal whose y runs down.
    let facing = -std::f32::consts::FRAC_1_SQRT_2 * (tilt[0] + tilt[1]) * look.glint;
    let [r, g, b] = std::array::from_fn(|i| {
        let mixed = under[i] * under_share + layer[i] * over_share;
        let lit = mixed + facing * (HIGHLIGHT + SHADING * mixed);
        round(lit.clamp(0.0, 255.0)) as u8
    });
    [r, g, b, alpha_out]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::Rng,
        paint::{ColorStop, Look},
        pattern::{PathPoint, SegmentPath, SurfaceFrame},
        raster::{DirtyTiles, Profile, stamp_dot, stamp_path},
    };
    use glam::Vec2;

    fn below(rng: &mut Rng, n: u32) -> u32 {
        rng.next_u32() % n
    }

    fn field(size: UVec2) -> DepthField {
        DepthField::new(SurfaceFrame::new(size).unwrap())
    }

    fn noise_bytes(rng: &mut Rng, n: usize) -> Vec<u8> {
        (0..n).map(|_| rng.next_u32() as u8).collect()
    }

    fn looks() -> [Look; 4] {
        let wild = Look { glint: 4.0, grain: 1.0, shift: 16.0, relief: 1.0, opaque: true, ..Look::GROOVE };
        [Look::GROOVE, Look::FROSTED, Look::TOON, wild]
    }

    fn table(look: &Look, field: &DepthField) -> LookTable {
        LookTable::new(look, field.frame.texels_per_unit()).unwrap()
    }

    /// A picture with room for targets of its own.
    struct Canvas {
        size: UVec2,
        base: [Vec<u8>; 3],
        tilted: bool,
        deep: bool,
    }

    impl Canvas {
        fn new(rng: &mut Rng, size: UVec2) -> Self {
            let n = (size.x * size.y) as usize;
            let base = [noise_bytes(rng, 4 * n), noise_bytes(rng, 4 * n), noise_bytes(rng, n)];
            Self { size, base, tilted: below(rng, 2) == 0, deep: below(rng, 2) == 0 }
        }

        fn base(&self) -> BaseTexels<'_> {
            let [diffuse, normal, depth] = &self.base;
            BaseTexels {
                size: self.size,
                diffuse,
                normal: self.tilted.then_some(normal),
                depth: self.deep.then_some(depth),
            }
        }

        /// What an untouched picture looks like.
        fn untouched(&self) -> [Vec<u8>; 3] {
            let [diffuse, normal, depth] = self.base.clone();
            let normal = if self.tilted { normal } else { FLAT.repeat(depth.len()) };
            let depth = if self.deep { depth } else { vec![0; depth.len()] };
            [diffuse, normal, depth]
        }

        fn paint(&self, field: &DepthField, look: &LookTable, rect: TexelRect, origin: UVec2, out: &mut [Vec<u8>; 3]) {
            let [diffuse, normal, depth] = out;
            let mut targets = PaintTargets { diffuse: Some(diffuse), normal: Some(normal), depth: Some(depth) };
            paint_into(self.base(), field, look, rect, origin, &mut targets);
        }
    }

    fn random_stamp(rng: &mut Rng, field: &mut DepthField) -> TexelRect {
        let extent = field.frame.extent();
        let mut place = || Vec2::new(rng.unit(), rng.unit()) * extent;
        let (from, to) = (place(), place());
        let to = from + (to - from).clamp_length_max(0.3);
        let width = 0.06 * rng.unit();
        if below(rng, 5) == 0 {
            return stamp_dot(field, from, width, rng.unit());
        }
        let profile = Profile { rim_width: 0.02, rim_depth: 0.2, ..Profile::DEFAULT };
        let point = |pos, width| PathPoint { pos, width };
        stamp_path(field, &profile, &SegmentPath::straight(point(from, width), point(to, 0.5 * width)))
    }

    #[test]
    fn dirty_painting_equals_full_painting() {
        let mut rng = Rng::new(11);
        let sizes =
            [[1, 1], [1, 4096], [4096, 1], [3, 5], [31, 37], [64, 64], [65, 127], [130, 66], [211, 17], [2, 300]];
        for (i, size) in sizes.into_iter().enumerate() {
            let mut field = field(size.into());
            let size = UVec2::from(size);
            let look = table(&looks()[i % 4], &field);
            // The image is the field, or an atlas around it, or cuts the field off.
            let origin = if i % 3 == 0 { UVec2::ZERO } else { UVec2::new(below(&mut rng, 9), below(&mut rng, 9)) };
            let room = if i % 3 == 2 { origin + size - size.min(UVec2::splat(7)) + 1 } else { origin + size + 5 };
            let canvas = Canvas::new(&mut rng, room);
            let mut dirty = DirtyTiles::new(size);
            let mut painted = canvas.untouched();
            let mut rects = Vec::new();
            for step in 0..100 {
                if below(&mut rng, 20) == 0 {
                    field.depth.as_mut_slice().fill(0);
                    dirty.mark(TexelRect::whole(size));
                }
                for _ in 0..=below(&mut rng, 3) {
                    let changed = random_stamp(&mut rng, &mut field);
                    dirty.mark(changed.grow(1, size));
                }
                rects.clear();
                dirty.take_rects(&mut rects);
                for &rect in &rects {
                    canvas.paint(&field, &look, rect, origin, &mut painted);
                }
                let mut whole = canvas.untouched();
                canvas.paint(&field, &look, TexelRect::whole(size), origin, &mut whole);
                assert!(painted == whole, "size {size}, step {step}");
            }
        }
    }

    #[test]
    fn every_texel_alone_equals_the_whole() {
        let mut rng = Rng::new(12);
        let size = UVec2::new(83, 29);
        let mut field = field(size);
        for _ in 0..12 {
            random_stamp(&mut rng, &mut field);
        }
        for look in looks() {
            let (look, canvas) = (table(&look, &field), Canvas::new(&mut rng, size));
            let (mut whole, mut single) = (canvas.untouched(), canvas.untouched());
            canvas.paint(&field, &look, TexelRect::whole(size), UVec2::ZERO, &mut whole);
            for y in 0..size.y {
                for x in 0..size.x {
                    let min = UVec2::new(x, y);
                    canvas.paint(&field, &look, TexelRect { min, max: min + 1 }, UVec2::ZERO, &mut single);
                }
            }
            assert!(whole == single, "{look:?}");
        }
    }

    #[test]
    fn untouched_texels_are_the_base_and_the_silhouette_stays() {
        let mut rng = Rng::new(13);
        for look in looks() {
            let size = UVec2::new(150, 90);
            let mut field = field(size);
            for _ in 0..4 {
                random_stamp(&mut rng, &mut field);
            }
            let mut canvas = Canvas::new(&mut rng, size);
            canvas.base[0].as_chunks_mut::<4>().0.iter_mut().step_by(3).for_each(|texel| texel[3] = 0);
            let untouched = canvas.untouched();
            let mut out = untouched.clone();
            canvas.paint(&field, &table(&look, &field), TexelRect::whole(size), UVec2::ZERO, &mut out);
            for y in 0..size.y {
                for x in 0..size.x {
                    let at = (y * size.x + x) as usize;
                    let rgba = |bytes: &Vec<u8>| bytes.as_chunks::<4>().0[at];
                    let (before, after) = (rgba(&untouched[0]), rgba(&out[0]));
                    let near = TexelRect { min: UVec2::new(x, y), max: UVec2::new(x + 1, y + 1) }.grow(1, size);
                    let touched = (near.min.y..near.max.y)
                        .any(|y| (near.min.x..near.max.x).any(|x| field.depth.get(x, y) != Some(0)));
                    if !touched {
                        assert_eq!((before, rgba(&untouched[1])), (after, rgba(&out[1])));
                    }
                    if field.depth.get(x, y) == Some(0) {
                        assert_eq!(out[2][at], untouched[2][at]);
                    }
                    assert!(out[2][at] >= untouched[2][at], "depth only sinks");
                    assert_eq!(before[3] == 0, after[3] == 0, "silhouette at {x} {y}");
                    assert!(after[3] == before[3] || look.opaque && after[3] > before[3], "alpha at {x} {y}");
                    if canvas.tilted {
                        assert_eq!(rgba(&untouched[1])[3], rgba(&out[1])[3], "alpha of the normal");
                    }
                }
            }
        }
    }

    #[test]
    fn an_opaque_crack_covers_glass() {
        let mut field = field(UVec2::splat(8));
        field.depth.as_mut_slice().fill(65535);
        let black = [ColorStop { depth: 1.0, color: [0.0; 3], cover: 1.0 }];
        let look = Look { ramp: black.to_vec().into(), grain: 0.0, ..Look::FROSTED };
        let canvas = Canvas {
            size: UVec2::splat(8),
            base: [[200, 100, 50, 60].repeat(64), vec![], vec![]],
            tilted: false,
            deep: false,
        };
        let mut out = vec![0; 256];
        let mut targets = PaintTargets { diffuse: Some(&mut out), normal: None, depth: None };
        paint_into(
            canvas.base(),
            &field,
            &table(&look, &field),
            TexelRect::whole(canvas.size),
            UVec2::ZERO,
            &mut targets,
        );
        assert_eq!(out, [0, 0, 0, 255].repeat(64));
    }

    #[test]
    fn normals_equal_a_sobel_in_f64() {
        let mut rng = Rng::new(14);
        for (round, relief) in [0.0, 0.001, 0.02, 0.3, 1.0].into_iter().enumerate() {
            let size = UVec2::new(70, 41);
            let mut field = field(size);
            if round % 2 == 0 {
                field.depth.as_mut_slice().fill_with(|| rng.next_u32() as u16);
            } else {
                (0..10).for_each(|_| _ = random_stamp(&mut rng, &mut field));
            }
            let canvas = Canvas { tilted: false, ..Canvas::new(&mut rng, size) };
            let mut out = canvas.untouched();
            let look = table(&Look { relief, ..Look::GROOVE }, &field);
            canvas.paint(&field, &look, TexelRect::whole(size), UVec2::ZERO, &mut out);
            let height = |x: i32, y: i32| {
                let inside = |v: i32, n: u32| v.clamp(0, n as i32 - 1) as u32;
                let depth = field.depth.get(inside(x, size.x), inside(y, size.y)).unwrap();
                -f64::from(depth) / 65535.0 * f64::from(relief) * f64::from(field.frame.texels_per_unit())
            };
            for (i, got) in out[1].as_chunks::<4>().0.iter().enumerate() {
                let (x, y) = ((i as u32 % size.x) as i32, (i as u32 / size.x) as i32);
                let across = |k: i32| height(x + 1, y + k) - height(x - 1, y + k);
                let down = |k: i32| height(x + k, y + 1) - height(x + k, y - 1);
                let u = (across(-1) + 2.0 * across(0) + across(1)) / 8.0;
                let v = (down(-1) + 2.0 * down(0) + down(1)) / 8.0;
                let len = (u * u + v * v + 1.0).sqrt();
                for (byte, want) in got.iter().zip([-u / len, v / len, 1.0 / len]) {
                    let got = f64::from(*byte) / 255.0 * 2.0 - 1.0;
                    assert!((got - want).abs() <= 1.0 / 127.0, "{x} {y}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn green_is_up_and_light_comes_from_the_upper_left() {
        // A ditch from left to right: its upper wall goes down the picture, so it leans down; the lower one leans up.
        let mut field = field(UVec2::splat(9));
        field.depth.row_mut(4).fill(65535);
        let grey = [128, 128, 128, 255].repeat(81);
        let (mut diffuse, mut normal) = (grey.clone(), grey.clone());
        let look = Look { ramp: vec![].into(), ..Look::GROOVE };
        let mut targets = PaintTargets { diffuse: Some(&mut diffuse), normal: Some(&mut normal), depth: None };
        let base = BaseTexels { size: UVec2::splat(9), diffuse: &grey, normal: None, depth: None };
        paint_into(base, &field, &table(&look, &field), TexelRect::whole(base.size), UVec2::ZERO, &mut targets);
        let texel = |bytes: &[u8], y: usize| bytes.as_chunks::<4>().0[y * 9 + 4];
        assert!(texel(&normal, 3)[1] < 120 && texel(&normal, 5)[1] > 136, "{normal:?}");
        assert!(texel(&diffuse, 3)[0] < 128 && texel(&diffuse, 5)[0] > 128, "{diffuse:?}");
        assert_eq!(texel(&normal, 4), FLAT);
    }

    #[test]
    fn a_slow_ramp_has_no_steps() {
        let size = UVec2::new(4096, 1);
        let mut field = field(size);
        for (x, depth) in field.depth.as_mut_slice().iter_mut().enumerate() {
            *depth = 30_000 + x as u16;
        }
        let ramp = [
            ColorStop { depth: 0.0, color: [0.0; 3], cover: 1.0 },
            ColorStop { depth: 1.0, color: [1.0; 3], cover: 1.0 },
        ];
        let look = Look { ramp: ramp.to_vec().into(), glint: 0.0, grain: 0.0, ..Look::GROOVE };
        let base = [7, 7, 7, 255].repeat(4096);
        let mut out = base.clone();
        let mut targets = PaintTargets { diffuse: Some(&mut out), normal: None, depth: None };
        let texels = BaseTexels { size, diffuse: &base, normal: None, depth: None };
        paint_into(texels, &field, &table(&look, &field), TexelRect::whole(size), UVec2::ZERO, &mut targets);
        for (x, texel) in out.as_chunks::<4>().0.iter().enumerate() {
            let want = f64::from(30_000 + x as u32) / 65536.0 * 255.0;
            assert!((f64::from(texel[0]) - want).abs() <= 0.51, "{x}: {texel:?} {want}");
        }
    }

    #[test]
    fn wrong_slices_and_places_are_left_alone() {
        let mut field = field(UVec2::splat(20));
        field.depth.as_mut_slice().fill(40_000);
        let look = table(&Look::FROSTED, &field);
        let size = UVec2::splat(20);
        let (full, short) = (vec![9; 1600], vec![9; 1599]);
        let whole = TexelRect::whole(size);
        let try_it = |size: UVec2, diffuse: &[u8], normal: &[u8], rect: TexelRect, origin: UVec2, n: usize| {
            let mut out = [vec![9; n], vec![9; n], vec![9; n.div_ceil(4)]];
            let [d, m, e] = &mut out;
            let mut targets = PaintTargets { diffuse: Some(d), normal: Some(m), depth: Some(e) };
            let base = BaseTexels { size, diffuse, normal: Some(normal), depth: None };
            paint_into(base, &field, &look, rect, origin, &mut targets);
            out.map(|out| out.iter().any(|&byte| byte != 9))
        };
        assert_eq!(
            try_it(size, &full, &full, whole, UVec2::ZERO, 1600),
            [true, false, true],
            "an even field has no slopes"
        );
        assert_eq!(try_it(size, &short, &full, whole, UVec2::ZERO, 1600), [false, false, true]);
        assert_eq!(try_it(size, &full, &short, whole, UVec2::ZERO, 1596), [false; 3]);
        assert_eq!(try_it(size, &[], &[], whole, UVec2::ZERO, 0), [false; 3]);
        assert_eq!(try_it(UVec2::MAX, &full, &full, whole, UVec2::ZERO, 1600), [false; 3]);
        assert_eq!(try_it(size, &full, &full, whole, UVec2::splat(20), 1600), [false; 3]);
        assert_eq!(try_it(size, &full, &full, whole, UVec2::MAX, 1600), [false; 3]);
        assert_eq!(
            try_it(size, &full, &full, TexelRect { min: UVec2::MAX, max: UVec2::MAX }, UVec2::ZERO, 1600),
            [false; 3]
        );
        let from_corner = TexelRect { min: UVec2::ZERO, max: UVec2::MAX };
        assert!(try_it(size, &full, &full, from_corner, UVec2::splat(19), 1600)[0], "one texel lies inside");
    }
}
