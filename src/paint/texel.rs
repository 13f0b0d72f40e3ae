//! The texel loops.
//!
//! A row is painted in pieces of up to `N` texels. A piece looks at its [`Window`] of the depth field; if that is
//! untouched, the base is copied, else the slopes are computed for the whole piece at once and used by diffuse and
//! normal. Pieces are a matter of speed alone: every texel depends on its own 3 x 3 depths and on the base.

use super::LookTable;
use crate::{
    Grid,
    raster::{DepthField, TexelRect},
};
use glam::UVec2;

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

/// Texels of a piece: in wide rectangles many, in narrow ones (dirty tiles) few, as a piece is computed as a whole.
const WIDE: usize = 64;
const NARROW: usize = 16;

/// Texels whose colours are computed at once, or copied if all are untouched. Divides the pieces.
const BLOCK: usize = 8;

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
    let diffuse = base.diffuse.as_chunks().0;
    let mut diffuse_out = targets.diffuse.as_deref_mut().map(|out| out.as_chunks_mut().0);
    diffuse_out.take_if(|out| out.len() < texels || diffuse.len() < texels);

    let normal = base.normal.map(|base| base.as_chunks().0);
    let mut normal_out = targets.normal.as_deref_mut().map(|out| out.as_chunks_mut().0);
    normal_out.take_if(|out| out.len() < texels || normal.is_some_and(|base| base.len() < texels));

    let mut depth_out = targets.depth.as_deref_mut();
    depth_out.take_if(|out| out.len() < texels || base.depth.is_some_and(|base| base.len() < texels));

    let mut job = Job {
        frame: Frame { base: diffuse, stride: base.size.x as usize, origin, size: visible },
        field,
        look,
        normal,
        depth: base.depth,
        diffuse_out,
        normal_out,
        depth_out,
    };
    if rect.size().x as usize > WIDE {
        job.paint::<WIDE>(rect);
    } else {
        job.paint::<NARROW>(rect);
    }
}

/// The checked arguments of [`paint_into`].
struct Job<'a> {
    frame: Frame<'a>,
    field: &'a DepthField,
    look: &'a LookTable,
    normal: Option<&'a [Rgba]>,
    depth: Option<&'a [u8]>,
    diffuse_out: Option<&'a mut [Rgba]>,
    normal_out: Option<&'a mut [Rgba]>,
    depth_out: Option<&'a mut [u8]>,
}

impl Job<'_> {
    fn paint<const N: usize>(&mut self, rect: TexelRect) {
        let (mut window, mut slopes) = (Window::EMPTY, Slopes::LEVEL);
        for y in rect.min.y..rect.max.y {
            for x in (rect.min.x..rect.max.x).step_by(N) {
                let n = N.min((rect.max.x - x) as usize);
                window.load::<N>(&self.field.depth, x as usize, y as usize, n);
                self.paint_piece::<N>(&window, &mut slopes, UVec2::new(x, y));
            }
        }
    }

    /// Paints the piece of the window, whose first texel is `at` of the field.
    #[inline]
    fn paint_piece<const N: usize>(&mut self, window: &Window, slopes: &mut Slopes, at: UVec2) {
        let first = self.frame.index(at.x, at.y);
        let range = first..first + window.n;
        let touched = window.is_touched::<N>();
        if touched && (self.diffuse_out.is_some() || self.normal_out.is_some()) {
            slopes.measure::<N>(window, self.look.slope);
        }
        if let Some(out) = &mut self.diffuse_out {
            let (out, base) = (&mut out[range.clone()], &self.frame.base[range.clone()]);
            if touched {
                diffuse_piece(out, base, &self.frame, window, slopes, self.look, at);
            } else {
                out.copy_from_slice(base);
            }
        }
        if let Some(out) = &mut self.normal_out {
            let out = &mut out[range.clone()];
            match (self.normal, touched) {
                (Some(base), true) => tilted_piece(out, &base[range.clone()], slopes),
                (Some(base), false) => out.copy_from_slice(&base[range.clone()]),
                (None, true) => flat_piece(out, slopes),
                (None, false) => out.fill(FLAT),
            }
        }
        if let Some(out) = &mut self.depth_out {
            depth_piece(&mut out[range.clone()], self.depth.map(|base| &base[range]), window.middle());
        }
    }
}

/// The depths of a piece and of the texels around it, repeated at the border of the field.
///
/// Used again for every piece: what lies beyond `n` is of an earlier one.
struct Window {
    rows: [[u16; WIDE + 2]; 3],
    n: usize,
}

impl Window {
    const EMPTY: Self = Self { rows: [[0; WIDE + 2]; 3], n: 0 };

    /// The window of the `n <= N` texels from column `x` of row `y`.
    #[inline(always)]
    fn load<const N: usize>(&mut self, depth: &Grid<u16>, x: usize, y: usize, n: usize) {
        self.n = n;
        for (row, y) in self.rows.iter_mut().zip([y.saturating_sub(1), y, (y + 1).min(depth.height() - 1)]) {
            let from = depth.row(y);
            if n == N {
                // A copy of fixed length is a few moves in place of a call.
                row[1..=N].copy_from_slice(&from[x..x + N]);
            } else {
                row[1..=n].copy_from_slice(&from[x..x + n]);
            }
            row[0] = from[x.saturating_sub(1)];
            row[n + 1] = from[(x + n).min(from.len() - 1)];
        }
    }

    #[inline(always)]
    fn is_touched<const N: usize>(&self) -> bool {
        // All N, as that is faster: an earlier piece can only make this one be computed without need.
        self.rows.iter().flat_map(|row| &row[..N + 2]).fold(0, |any, &depth| any | depth) != 0
    }

    fn middle(&self) -> &[u16] {
        &self.rows[1][1..=self.n]
    }
}

/// Slopes of a piece of the surface, as the normal before normalizing: `(x, y, 1)`, x right, y **down** the picture.
struct Slopes {
    x: [f32; WIDE],
    y: [f32; WIDE],
    /// One over the length of `(x, y, 1)`.
    inv_len: [f32; WIDE],
}

impl Slopes {
    const LEVEL: Self = Self { x: [0.0; WIDE], y: [0.0; WIDE], inv_len: [1.0; WIDE] };

    /// Sobel's operator on the depths; a wall that goes down to the right leans to the right.
    #[inline(always)]
    fn measure<const N: usize>(&mut self, window: &Window, scale: f32) {
        let [up, middle, down] = &window.rows;
        let mut sum = [0i32; WIDE + 2];
        let mut gain = [0i32; WIDE + 2];
        for i in 0..N + 2 {
            let [u, m, d] = [up[i], middle[i], down[i]].map(i32::from);
            sum[i] = u + 2 * m + d;
            gain[i] = d - u;
        }
        for i in 0..N {
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

fn depth_piece(out: &mut [u8], base: Option<&[u8]>, depths: &[u16]) {
    let byte = |depth: u16| ((u32::from(depth) * 255 + 32_895) >> 16) as u8;
    match base {
        Some(base) => {
            for ((out, &base), &depth) in out.iter_mut().zip(base).zip(depths) {
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
    /// Where texel `(x, y)` of the field lies in the slices.
    #[inline(always)]
    fn index(&self, x: u32, y: u32) -> usize {
        (self.origin.y + y) as usize * self.stride + (self.origin.x + x) as usize
    }

    #[inline(always)]
    fn texel(&self, x: u32, y: u32) -> Rgba {
        self.base[self.index(x, y)]
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
#[inline(always)]
fn noise(x: u32, y: u32) -> f32 {
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    // Through i32, for which the conversion is one instruction on every machine.
    ((h ^ (h >> 15)) >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
}

/// Byte `i` of a texel.
#[inline(always)]
fn channel(texel: u32, i: u32) -> f32 {
    (texel >> (8 * i) & 255) as i32 as f32
}

/// Colours of a piece whose first texel is `at` of the field.
#[inline]
fn diffuse_piece(
    out: &mut [Rgba],
    base: &[Rgba],
    frame: &Frame<'_>,
    window: &Window,
    slopes: &Slopes,
    look: &LookTable,
    mut at: UVec2,
) {
    let (slopes_x, slopes_y) = (slopes.x.as_chunks::<BLOCK>().0, slopes.y.as_chunks::<BLOCK>().0);
    let lengths = slopes.inv_len.as_chunks::<BLOCK>().0;
    let inputs = base.chunks(BLOCK).zip(window.middle().chunks(BLOCK)).zip(slopes_x).zip(slopes_y).zip(lengths);
    for (out, ((((base, depths), x), y), inv_len)) in out.chunks_mut(BLOCK).zip(inputs) {
        let level = |slopes: &[f32; BLOCK]| slopes.iter().all(|&slope| slope == 0.0);
        if depths.iter().all(|&depth| depth == 0) && level(x) && level(y) {
            out.copy_from_slice(base);
        } else {
            let mut block = Block { base: [0; BLOCK], depth: [0; BLOCK], x, y, inv_len };
            block.depth[..depths.len()].copy_from_slice(depths);
            for (to, from) in block.base.iter_mut().zip(base) {
                *to = u32::from_le_bytes(*from);
            }
            for (out, painted) in out.iter_mut().zip(block.paint(frame, look, at)) {
                *out = painted.to_le_bytes();
            }
        }
        at.x += BLOCK as u32;
    }
}

/// What the colours of a block are made of.
struct Block<'a> {
    base: [u32; BLOCK],
    depth: [u16; BLOCK],
    x: &'a [f32; BLOCK],
    y: &'a [f32; BLOCK],
    inv_len: &'a [f32; BLOCK],
}

impl Block<'_> {
    #[inline(always)]
    fn paint(&self, frame: &Frame<'_>, look: &LookTable, at: UVec2) -> [u32; BLOCK] {
        // Channel by channel, so that each loop works on many texels at once.
        let mut over = [[0.0; BLOCK]; 4];
        for (i, &depth) in self.depth.iter().enumerate() {
            for (over, value) in over.iter_mut().zip(look.layer(depth)) {
                over[i] = value;
            }
        }
        if look.grain > 0.0 {
            for i in 0..BLOCK {
                let share = 1.0 - look.grain * noise(at.x + i as u32, at.y);
                over.iter_mut().for_each(|over| over[i] *= share);
            }
        }
        let under = self.picture(frame, look, at);
        let opaque = if look.opaque { 1.0 } else { 0.0 };
        let mut painted = [0; BLOCK];
        let (mut under_share, mut over_share, mut facing) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
        for i in 0..BLOCK {
            let (alpha, cover) = (channel(self.base[i], 3) * (1.0 / 255.0), over[3][i]);
            // An opaque crack lies over the picture as another pane would; else it is as translucent as the picture,
            // which is the same with an alpha of one.
            let pane = 1.0 - opaque * (1.0 - alpha);
            let pane_out = pane * (1.0 - cover) + cover;
            over_share[i] = 1.0 / pane_out;
            under_share[i] = pane * (1.0 - cover) * over_share[i];
            painted[i] = round(255.0 * (alpha + opaque * (pane_out - alpha))) << 24;
            // Light from the upper left, on a normal whose y runs down.
            facing[i] = (self.x[i] + self.y[i]) * self.inv_len[i] * (-std::f32::consts::FRAC_1_SQRT_2 * look.glint);
        }
        for (c, (under, over)) in under.iter().zip(&over).enumerate() {
            for i in 0..BLOCK {
                let mixed = under[i] * under_share[i] + over[i] * over_share[i];
                let lit = mixed + facing[i] * (HIGHLIGHT + SHADING * mixed);
                let lit = if lit > 0.0 { lit } else { 0.0 };
                painted[i] |= round(if lit < 255.0 { lit } else { 255.0 }) << (8 * c);
            }
        }
        for (i, painted) in painted.iter_mut().enumerate() {
            let untouched = (self.depth[i] == 0) & (self.x[i] == 0.0) & (self.y[i] == 0.0);
            if untouched | (self.base[i] >> 24 == 0) {
                *painted = self.base[i];
            }
        }
        painted
    }

    /// The colours of the picture, shifted where the surface is tilted.
    #[inline(always)]
    fn picture(&self, frame: &Frame<'_>, look: &LookTable, at: UVec2) -> [[f32; BLOCK]; 3] {
        let mut under = [[0.0; BLOCK]; 3];
        for (c, under) in (0..).zip(&mut under) {
            for (under, &base) in under.iter_mut().zip(&self.base) {
                *under = channel(base, c);
            }
        }
        if look.shift > 0.0 {
            for i in 0..BLOCK {
                let scale = self.inv_len[i] * look.shift;
                let offset = [self.x[i] * scale, self.y[i] * scale];
                let hidden = self.base[i] >> 24 == 0;
                if hidden || offset == [0.0; 2] {
                    continue;
                }
                if let Some(color) = frame.shifted(at + UVec2::new(i as u32, 0), offset) {
                    under.iter_mut().zip(color).for_each(|(under, value)| under[i] = value);
                }
            }
        }
        under
    }
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
