//! The depths of a patch of texels, and their slopes.

use crate::{Grid, raster::TexelRect};
use glam::UVec2;
use std::ops::Range;

/// Texels whose colours are computed at once, or copied if all are untouched.
pub(super) const BLOCK: usize = 8;

/// The cracks that a base shows already, as one made by an [`Analogy`](super::analogy::Analogy) does.
#[derive(Clone, Copy, Debug)]
pub struct ShownCracks<'a> {
    /// Their depths, of the size of the field: 0 = untouched, 65535 = the deepest, as of
    /// [`DepthField::depth`](crate::raster::DepthField::depth).
    pub depth: &'a Grid<u16>,
    /// Depth from which the base shows a crack, 0..=65535.
    pub least: u16,
}

/// The height of the surface where rims curl up: how far down it is at depths 0, 256, .. 65536, linear between.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve(pub(super) [i32; 257]);

impl Curve {
    #[inline(always)]
    fn at(&self, depth: u16) -> i32 {
        let (step, rest) = (usize::from(depth >> 8), i32::from(depth & 255));
        let (low, high) = (self.0[step], self.0[step + 1]);
        low.wrapping_add(high.wrapping_sub(low).wrapping_mul(rest) >> 8)
    }
}

/// Slopes by Sobel's operator from the nine values around each place.
#[inline(always)]
fn slopes<T: Copy>(
    [[a, b, c], [d, _, f], [g, h, i]]: [[&[T]; 3]; 3],
    value: impl Fn(T) -> i32,
    scale: f32,
    x: &mut [f32],
    y: &mut [f32],
    inv_len: &mut [f32],
) {
    let n = x.len();
    let [a, b, c, d, f, g, h, i] = [a, b, c, d, f, g, h, i].map(|values| &values[..n]);
    let (y, inv_len) = (&mut y[..n], &mut inv_len[..n]);
    let gain = |low: T, high: T| value(high).wrapping_sub(value(low));
    for k in 0..n {
        let right = gain(a[k], c[k]).wrapping_add(gain(d[k], f[k]) << 1).wrapping_add(gain(g[k], i[k]));
        let down = gain(a[k], g[k]).wrapping_add(gain(b[k], h[k]) << 1).wrapping_add(gain(c[k], i[k]));
        let (right, down) = (right as f32 * scale, down as f32 * scale);
        x[k] = right;
        y[k] = down;
        inv_len[k] = 1.0 / (right * right + down * down + 1.0).sqrt();
    }
}

/// The depths of a patch and of the texels around it, and values derived from them.
///
/// All texels are in one line, row after row, so that the loops over them are long for every shape. The texel in
/// column `x` of row `y` is at `y * stride + x`. The values computed for the last two entries of a row are not used.
pub(super) struct Patch<const ROOM: usize> {
    /// Width of the patch.
    width: usize,
    /// Width with one texel more on either side.
    pub(super) stride: usize,
    /// Entries in all rows of the patch.
    len: usize,
    /// The depth of the texel above and to the left, repeated at the border of the field.
    pub(super) depth: [u16; ROOM],
    /// Zero where the texel and those around it are untouched.
    pub(super) touch: [u16; ROOM],
    /// Slope of the surface, to the right.
    pub(super) x: [f32; ROOM],
    /// Slope of the surface, **down** the picture.
    pub(super) y: [f32; ROOM],
    /// One over the length of `(x, y, 1)`.
    pub(super) inv_len: [f32; ROOM],
    /// Touched blocks, each with its index here and its texel in the field.
    pub(super) blocks: [(u16, UVec2); ROOM],
}

impl<const ROOM: usize> Patch<ROOM> {
    pub(super) const EMPTY: Self = Self {
        width: 0,
        stride: 0,
        len: 0,
        depth: [0; ROOM],
        touch: [0; ROOM],
        x: [0.0; ROOM],
        y: [0.0; ROOM],
        inv_len: [0.0; ROOM],
        blocks: [(0, UVec2::ZERO); ROOM],
    };

    /// Reads the depths; returns `false` if all are zero.
    pub(super) fn load(&mut self, depth: &Grid<u16>, rect: TexelRect) -> bool {
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

    /// Takes out the cracks that the base shows already; returns `false` if none are left. `rect` as in [`load`](Self::load).
    pub(super) fn leave_out(&mut self, shown: &ShownCracks<'_>, rect: TexelRect) -> bool {
        let (min, max) = (rect.min.as_usizevec2(), rect.max.as_usizevec2());
        let mut any = 0;
        for (depths, y) in self.depth.chunks_exact_mut(self.stride).zip(min.y..max.y + 2) {
            let row = shown.depth.row(y.saturating_sub(1).min(shown.depth.height() - 1));
            for (depth, x) in depths.iter_mut().zip(min.x..) {
                let before = row[x.saturating_sub(1).min(row.len() - 1)];
                if before >= shown.least || *depth <= before {
                    *depth = 0;
                }
                any |= *depth;
            }
        }
        any != 0
    }

    /// Finds touched texels and the slopes by Sobel's operator. A wall that descends to the right leans to the right.
    #[inline(always)]
    pub(super) fn measure(&mut self, scale: f32, curve: Option<&Curve>) {
        let n = self.len;
        let place = |row: usize, column: usize| &self.depth[row * self.stride + column..][..n];
        let [[a, b, c], [d, e, f], [g, h, i]] = [0, 1, 2].map(|row| [0, 1, 2].map(|column| place(row, column)));
        let touch = &mut self.touch[..n];
        for k in 0..n {
            touch[k] = a[k] | b[k] | c[k] | d[k] | e[k] | f[k] | g[k] | h[k] | i[k];
        }
        if let Some(curve) = curve {
            let mut heights = [0; ROOM];
            for (height, &depth) in heights.iter_mut().zip(&self.depth).take(n + 2 * self.stride + 2) {
                *height = curve.at(depth);
            }
            let place = |row: usize, column: usize| &heights[row * self.stride + column..][..n];
            let around = [0, 1, 2].map(|row| [0, 1, 2].map(|column| place(row, column)));
            let (x, y, inv_len) = (&mut self.x[..n], &mut self.y[..n], &mut self.inv_len[..n]);
            slopes(around, |height| height, scale, x, y, inv_len);
        } else {
            let (x, y, inv_len) = (&mut self.x[..n], &mut self.y[..n], &mut self.inv_len[..n]);
            slopes([[a, b, c], [d, e, f], [g, h, i]], i32::from, scale, x, y, inv_len);
        }
    }

    /// Adds other slopes to the slopes of the cracks.
    #[inline(always)]
    pub(super) fn tilt(&mut self, mut slope: impl FnMut(usize) -> [f32; 2]) {
        let n = self.len;
        let (x, y, inv_len) = (&mut self.x[..n], &mut self.y[..n], &mut self.inv_len[..n]);
        for k in 0..n {
            let [right, down] = slope(k);
            x[k] += right;
            y[k] += down;
            inv_len[k] = 1.0 / (x[k] * x[k] + y[k] * y[k] + 1.0).sqrt();
        }
    }

    /// Scales the slopes of the cracks by a share; slopes that are added later are not scaled.
    #[inline(always)]
    pub(super) fn level(&mut self, mut share: impl FnMut(usize) -> f32) {
        let n = self.len;
        let (x, y) = (&mut self.x[..n], &mut self.y[..n]);
        for k in 0..n {
            let share = share(k);
            x[k] *= share;
            y[k] *= share;
        }
    }

    /// Number of entries in all rows.
    pub(super) const fn len(&self) -> usize {
        self.len
    }

    /// Whether a texel of the block at an index, or one beside it, is touched.
    #[inline(always)]
    pub(super) fn is_touched(&self, place: usize) -> bool {
        self.touch[place..].first_chunk::<BLOCK>().is_some_and(|touch| *touch != [0; BLOCK])
    }

    /// The entries of a row.
    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> Range<usize> {
        let first = row * self.stride;
        first..first + self.width
    }

    /// The depths of a row.
    #[inline(always)]
    pub(super) fn depths(&self, row: usize) -> &[u16] {
        &self.depth[self.stride + 1..][self.row(row)]
    }
}
