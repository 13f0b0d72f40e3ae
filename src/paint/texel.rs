//! The texel loops.
//!
//! A rectangle is painted in patches. A patch looks at the depth field; if that is untouched, the base is copied. Else the
//! slopes of the whole patch are computed at once and used by diffuse and normal, the former in blocks, of which the
//! untouched ones are copied. Patches and blocks are a matter of speed alone: every texel depends on its own 3 x 3 depths
//! and on the base. Sums of whole numbers that cannot overflow are written as wrapping ones, as a check for each texel
//! would cost more than the sum.

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

/// Texels whose colours are computed at once, or copied if all are untouched.
const BLOCK: usize = 8;

/// The widest patch.
const WIDE: usize = 64;

/// Room for the depths of a patch and of the texels around it, and for what a last block may read beyond: for most dirty
/// rectangles, and for larger ones.
const LITTLE: usize = 360;
const MUCH: usize = 800;

/// Texels that come from memory at once, or fewer.
const CACHE_LINE: usize = 64 / size_of::<Rgba>();

/// Up to so many texels are fetched before they are painted: they stay in the cache until then.
const MAX_FETCHED: u64 = 1 << 13;

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
    paint_rects(base, field, look, &[rect], origin, targets);
}

/// As [`paint_into`] for each of some rectangles, in less time where they are small and the memory is cold.
pub fn paint_rects(
    base: BaseTexels<'_>,
    field: &DepthField,
    look: &LookTable,
    rects: &[TexelRect],
    origin: UVec2,
    targets: &mut PaintTargets<'_>,
) {
    // The part of the field that lies in the image.
    let visible = field.depth.size().min(base.size.saturating_sub(origin));
    let rects = rects.iter().map(|rect| rect.intersect(TexelRect::whole(visible))).filter(|rect| !rect.is_empty());
    let Some(texels) = (base.size.x as usize).checked_mul(base.size.y as usize) else { return };
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
    let (mut most, mut all) = (0, 0);
    for rect in rects.clone() {
        let around = rect.size() + 2;
        most = most.max(around.x as usize * around.y as usize + BLOCK);
        all += rect.area();
    }
    if all <= MAX_FETCHED {
        job.fetch(rects.clone());
    }
    if most <= LITTLE {
        job.paint::<LITTLE>(rects);
    } else {
        job.paint::<MUCH>(rects);
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
    fn paint<const ROOM: usize>(&mut self, rects: impl Iterator<Item = TexelRect>) {
        let mut patch = Patch::EMPTY;
        rects.for_each(|rect| self.paint_rect::<ROOM>(rect, &mut patch));
    }

    fn paint_rect<const ROOM: usize>(&mut self, rect: TexelRect, patch: &mut Patch<ROOM>) {
        let size = rect.size();
        let width = size.x.min(WIDE as u32);
        // A patch has two rows and columns more than are painted; the room suffices for one row at least.
        let height = ((ROOM - BLOCK) as u32 / (width + 2) - 2).min(size.y);
        for y in (rect.min.y..rect.max.y).step_by(height as usize) {
            for x in (rect.min.x..rect.max.x).step_by(WIDE) {
                let min = UVec2::new(x, y);
                let part = TexelRect { min, max: (min + UVec2::new(width, height)).min(rect.max) };
                if patch.load(&self.field.depth, part) {
                    self.paint_patch(patch, part);
                } else {
                    self.restore(part);
                }
            }
        }
    }

    /// The texels of row `y` of a rectangle, in the slices.
    fn range(&self, rect: TexelRect, y: u32) -> Range<usize> {
        let first = self.frame.index(rect.min.x, y);
        first..first + rect.size().x as usize
    }

    /// Gives the base back to texels that are untouched.
    fn restore(&mut self, rect: TexelRect) {
        for y in rect.min.y..rect.max.y {
            let range = self.range(rect, y);
            if let Some(out) = &mut self.diffuse_out {
                out[range.clone()].copy_from_slice(&self.frame.base[range.clone()]);
            }
            if let Some(out) = &mut self.normal_out {
                match self.normal {
                    Some(base) => out[range.clone()].copy_from_slice(&base[range.clone()]),
                    None => out[range.clone()].fill(FLAT),
                }
            }
            if let Some(out) = &mut self.depth_out {
                match self.depth {
                    Some(base) => out[range.clone()].copy_from_slice(&base[range]),
                    None => out[range].fill(0),
                }
            }
        }
    }

    /// Reads what is read and painted over, a texel of each line of the cache: independent reads, so that cold memory is
    /// waited for once and not texel by texel. The tighter the loop, the more of them are under way.
    fn fetch(&self, rects: impl Iterator<Item = TexelRect>) {
        let (diffuse, normal) = (self.diffuse_out.as_deref(), self.normal_out.as_deref());
        let picture = diffuse.map(|_| self.frame.base);
        let Some(any) = picture.or(normal) else { return };
        let all = [picture, diffuse, normal.and(self.normal), normal].map(|texels| texels.unwrap_or(any));
        let mut sum = 0;
        for rect in rects {
            for y in rect.min.y..rect.max.y {
                let range = self.range(rect, y);
                let [a, b, c, d] = all.map(|texels| &texels[range.clone()]);
                let last = a.len() - 1;
                let mut at = 0;
                while at < last {
                    sum ^= a[at][0] ^ b[at][0] ^ c[at][0] ^ d[at][0];
                    at += CACHE_LINE;
                }
                sum ^= a[last][0] ^ b[last][0] ^ c[last][0] ^ d[last][0];
            }
        }
        std::hint::black_box(sum);
    }

    fn paint_patch<const ROOM: usize>(&mut self, patch: &mut Patch<ROOM>, rect: TexelRect) {
        if self.diffuse_out.is_some() || self.normal_out.is_some() {
            patch.measure(self.look.slope);
        }
        for (row, y) in (rect.min.y..rect.max.y).enumerate() {
            let range = self.range(rect, y);
            if let Some(out) = &mut self.diffuse_out {
                let (out, base) = (&mut out[range.clone()], &self.frame.base[range.clone()]);
                diffuse_row(out, base, &self.frame, patch, row, self.look, UVec2::new(rect.min.x, y));
            }
            if let Some(out) = &mut self.normal_out {
                let out = &mut out[range.clone()];
                match self.normal {
                    Some(base) => tilted_row(out, &base[range.clone()], patch, row),
                    None => flat_row(out, patch, row),
                }
            }
            if let Some(out) = &mut self.depth_out {
                depth_row(&mut out[range.clone()], self.depth.map(|base| &base[range]), patch.depths(row));
            }
        }
    }
}

/// The depths of a patch and of the texels around it, and what is made of them.
///
/// All texels lie in one line, row after row, so that the loops over them are long whatever the shape: the texel in column
/// `x` of row `y` is at `y * stride + x`, and what is computed for the two last places of a row is of no use.
struct Patch<const ROOM: usize> {
    /// Width of the patch.
    width: usize,
    /// Width with the texels around.
    stride: usize,
    /// Places in all rows of the patch.
    len: usize,
    /// The depth of the texel above and to the left, repeated at the border of the field.
    depth: [u16; ROOM],
    /// Zero where the texel and those around it are untouched.
    touch: [u16; ROOM],
    /// Slope of the surface, to the right.
    x: [f32; ROOM],
    /// Slope of the surface, **down** the picture.
    y: [f32; ROOM],
    /// One over the length of `(x, y, 1)`.
    inv_len: [f32; ROOM],
}

impl<const ROOM: usize> Patch<ROOM> {
    const EMPTY: Self = Self {
        width: 0,
        stride: 0,
        len: 0,
        depth: [0; ROOM],
        touch: [0; ROOM],
        x: [0.0; ROOM],
        y: [0.0; ROOM],
        inv_len: [0.0; ROOM],
    };

    /// Reads the depths; false if they are all zero.
    fn load(&mut self, depth: &Grid<u16>, rect: TexelRect) -> bool {
        let (min, max) = (rect.min.as_usizevec2(), rect.max.as_usizevec2());
        self.width = max.x - min.x;
        self.stride = self.width + 2;
        self.len = self.stride * (max.y - min.y);
        let (left, right) = (min.x.saturating_sub(1), (max.x + 1).min(depth.width()));
        let mut touched = false;
        for (to, y) in self.depth.chunks_exact_mut(self.stride).zip(min.y..max.y + 2) {
            let row = depth.row(y.saturating_sub(1).min(depth.height() - 1));
            let (inner, outer) = (&mut to[1..=self.width], &row[min.x..max.x]);
            inner.copy_from_slice(outer);
            to[0] = row[left];
            to[self.width + 1] = row[right - 1];
            touched = touched || to.iter().fold(0, |any, &depth| any | depth) != 0;
        }
        touched
    }

    /// Finds what is touched, and the slopes by Sobel's operator; a wall that goes down to the right leans to the right.
    fn measure(&mut self, scale: f32) {
        let n = self.len;
        let place = |row: usize, column: usize| &self.depth[row * self.stride + column..][..n];
        let [[a, b, c], [d, e, f], [g, h, i]] = [0, 1, 2].map(|row| [0, 1, 2].map(|column| place(row, column)));
        let (touch, x, y, inv_len) = (&mut self.touch[..n], &mut self.x[..n], &mut self.y[..n], &mut self.inv_len[..n]);
        for k in 0..n {
            touch[k] = a[k] | b[k] | c[k] | d[k] | e[k] | f[k] | g[k] | h[k] | i[k];
        }
        let gain = |low: u16, high: u16| i32::from(high).wrapping_sub(i32::from(low));
        for k in 0..n {
            let right = gain(a[k], c[k]).wrapping_add(gain(d[k], f[k]) << 1).wrapping_add(gain(g[k], i[k]));
            let down = gain(a[k], g[k]).wrapping_add(gain(b[k], h[k]) << 1).wrapping_add(gain(c[k], i[k]));
            let (right, down) = (right as f32 * scale, down as f32 * scale);
            x[k] = right;
            y[k] = down;
            inv_len[k] = 1.0 / (right * right + down * down + 1.0).sqrt();
        }
    }

    /// The places of a row.
    fn row(&self, row: usize) -> Range<usize> {
        let first = row * self.stride;
        first..first + self.width
    }

    /// The depths of a row.
    fn depths(&self, row: usize) -> &[u16] {
        &self.depth[self.stride + 1..][self.row(row)]
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
fn flat_row<const ROOM: usize>(out: &mut [Rgba], patch: &Patch<ROOM>, row: usize) {
    let (x, y, inv_len) = (&patch.x[patch.row(row)], &patch.y[patch.row(row)], &patch.inv_len[patch.row(row)]);
    for (((out, &x), &y), &inv_len) in out.iter_mut().zip(x).zip(y).zip(inv_len) {
        *out = normal_bytes(x * inv_len, -y * inv_len, inv_len, 255).to_le_bytes();
    }
}

/// Normals over base normals: the slopes of base and crack add up, which is exact for heights that add up.
fn tilted_row<const ROOM: usize>(out: &mut [Rgba], base: &[Rgba], patch: &Patch<ROOM>, row: usize) {
    let (x, y) = (&patch.x[patch.row(row)], &patch.y[patch.row(row)]);
    for (((out, &base), &x), &y) in out.iter_mut().zip(base).zip(x).zip(y) {
        let bytes = u32::from_le_bytes(base);
        let part = |c: u32| (channel(bytes, c) - 127.5) * (1.0 / 127.5);
        let (base_x, base_y, base_z) = (part(0), part(1), part(2));
        // A normal that points into the surface is no normal; it counts as nearly level.
        let z = if base_z > 0.05 { base_z } else { 0.05 };
        let (sum_x, sum_y) = (base_x + x * z, base_y - y * z);
        let inv_len = 1.0 / (sum_x * sum_x + sum_y * sum_y + z * z).sqrt();
        let painted = normal_bytes(sum_x * inv_len, sum_y * inv_len, z * inv_len, bytes >> 24);
        let level = (x == 0.0) & (y == 0.0);
        *out = if level { bytes } else { painted }.to_le_bytes();
    }
}

fn depth_row(out: &mut [u8], base: Option<&[u8]>, depths: &[u16]) {
    let byte = |depth: u16| (u32::from(depth).wrapping_mul(255).wrapping_add(32_895) >> 16) as u8;
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
    #[inline(always)]
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
    (texel.wrapping_shr(8 * i) & 255) as i32 as f32
}

/// Colours of a row whose first texel is `at` of the field.
fn diffuse_row<const ROOM: usize>(
    out: &mut [Rgba],
    base: &[Rgba],
    frame: &Frame<'_>,
    patch: &Patch<ROOM>,
    row: usize,
    look: &LookTable,
    mut at: UVec2,
) {
    let mut place = patch.row(row).start;
    for (out, base) in out.chunks_mut(BLOCK).zip(base.chunks(BLOCK)) {
        if let Some(block) = Block::load(base, patch, place) {
            let painted =
                if look.opaque { block.paint::<true>(frame, look, at) } else { block.paint::<false>(frame, look, at) };
            let painted = painted.map(u32::to_le_bytes);
            match out.first_chunk_mut() {
                Some(out) => *out = painted,
                None => out.copy_from_slice(&painted[..out.len()]),
            }
        } else if let (Some(out), Some(base)) = (out.first_chunk_mut::<BLOCK>(), base.first_chunk()) {
            // A copy of fixed length is a few moves in place of a call.
            *out = *base;
        } else {
            out.copy_from_slice(base);
        }
        place += BLOCK;
        at.x += BLOCK as u32;
    }
}

/// What the colours of a block are made of. What lies beyond the end of a row is of no use.
struct Block<'a> {
    base: [u32; BLOCK],
    depth: &'a [u16; BLOCK],
    x: &'a [f32; BLOCK],
    y: &'a [f32; BLOCK],
    inv_len: &'a [f32; BLOCK],
}

impl<'a> Block<'a> {
    /// The block at `place` of a patch, `None` if it is untouched.
    #[inline(always)]
    fn load<const ROOM: usize>(base: &[Rgba], patch: &'a Patch<ROOM>, place: usize) -> Option<Self> {
        if *patch.touch[place..].first_chunk()? == [0; BLOCK] {
            return None;
        }
        let mut bytes = [[0; 4]; BLOCK];
        match base.first_chunk() {
            Some(base) => bytes = *base,
            None => bytes[..base.len()].copy_from_slice(base),
        }
        Some(Self {
            base: bytes.map(u32::from_le_bytes),
            depth: patch.depth[place + patch.stride + 1..].first_chunk()?,
            x: patch.x[place..].first_chunk()?,
            y: patch.y[place..].first_chunk()?,
            inv_len: patch.inv_len[place..].first_chunk()?,
        })
    }
}

impl Block<'_> {
    #[inline(always)]
    fn paint<const OPAQUE: bool>(&self, frame: &Frame<'_>, look: &LookTable, at: UVec2) -> [u32; BLOCK] {
        // Channel by channel, so that each loop works on many texels at once.
        let mut over = [[0.0; BLOCK]; 4];
        for (i, &depth) in self.depth.iter().enumerate() {
            let [r, g, b, cover] = look.layer(depth);
            (over[0][i], over[1][i], over[2][i], over[3][i]) = (r, g, b, cover);
        }
        if look.grain > 0.0 {
            let mut share = [0.0; BLOCK];
            for (i, share) in share.iter_mut().enumerate() {
                *share = 1.0 - look.grain * noise(at.x.wrapping_add(i as u32), at.y);
            }
            for over in &mut over {
                over.iter_mut().zip(&share).for_each(|(over, share)| *over *= share);
            }
        }
        let under = self.picture(frame, look, at);
        let mut painted = [0; BLOCK];
        let (mut under_share, mut over_share, mut facing) = ([0.0; BLOCK], [1.0; BLOCK], [0.0; BLOCK]);
        for i in 0..BLOCK {
            let cover = over[3][i];
            if OPAQUE {
                // An opaque crack lies over the picture as another pane would; else it is as translucent as the picture.
                let alpha = channel(self.base[i], 3) * (1.0 / 255.0);
                let pane = 1.0 - (1.0 - alpha);
                let pane_out = pane * (1.0 - cover) + cover;
                over_share[i] = 1.0 / pane_out;
                under_share[i] = pane * (1.0 - cover) * over_share[i];
                painted[i] = round(255.0 * (alpha + (pane_out - alpha))) << 24;
            } else {
                under_share[i] = 1.0 - cover;
                painted[i] = self.base[i] & 0xFF00_0000;
            }
            // Light from the upper left, on a normal whose y runs down.
            facing[i] = (self.x[i] + self.y[i]) * self.inv_len[i] * (-std::f32::consts::FRAC_1_SQRT_2 * look.glint);
        }
        for c in 0..3 {
            let (under, over) = (&under[c], &over[c]);
            for i in 0..BLOCK {
                let mixed = under[i] * under_share[i] + over[i] * over_share[i];
                let lit = mixed + facing[i] * (HIGHLIGHT + SHADING * mixed);
                let lit = if lit > 0.0 { lit } else { 0.0 };
                painted[i] |= round(if lit < 255.0 { lit } else { 255.0 }).wrapping_shl(8 * c as u32);
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
        raster::{DirtyTiles, Profile, stamp_dot, stamp_path_with},
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
            self.paint_all(field, look, &[rect], origin, out);
        }

        fn paint_all(
            &self,
            field: &DepthField,
            look: &LookTable,
            rects: &[TexelRect],
            origin: UVec2,
            out: &mut [Vec<u8>; 3],
        ) {
            let [diffuse, normal, depth] = out;
            let mut targets = PaintTargets { diffuse: Some(diffuse), normal: Some(normal), depth: Some(depth) };
            paint_rects(self.base(), field, look, rects, origin, &mut targets);
        }
    }

    /// Returns what has changed.
    fn random_stamp(rng: &mut Rng, field: &mut DepthField) -> Vec<TexelRect> {
        let extent = field.frame.extent();
        let mut place = || Vec2::new(rng.unit(), rng.unit()) * extent;
        let (from, to) = (place(), place());
        let to = from + (to - from).clamp_length_max(0.3);
        let width = 0.06 * rng.unit();
        if below(rng, 5) == 0 {
            return vec![stamp_dot(field, from, width, rng.unit())];
        }
        let profile = Profile { rim_width: 0.02, rim_depth: 0.2, ..Profile::DEFAULT };
        let point = |pos, width| PathPoint { pos, width };
        let path = SegmentPath::straight(point(from, width), point(to, 0.5 * width));
        let mut changed = Vec::new();
        stamp_path_with(field, &profile, &path, &mut |rect| changed.push(rect));
        changed
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
                    changed.iter().for_each(|rect| dirty.mark(rect.grow(1, size)));
                }
                rects.clear();
                dirty.take_rects(&mut rects);
                canvas.paint_all(&field, &look, &rects, origin, &mut painted);
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
