//! The depths of some texels, and their slopes.

use crate::{Grid, raster::TexelRect};
use glam::UVec2;
use std::ops::Range;

/// Texels whose colours are computed at once, or copied if all are untouched.
pub(super) const BLOCK: usize = 8;

/// What depths stand for where rims curl up: how far down the surface is, at depths 0, 256, .. 65536, linear between.
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

/// The depths of a patch and of the texels around it, and what is made of them.
///
/// All texels lie in one line, row after row, so that the loops over them are long whatever the shape: the texel in column
/// `x` of row `y` is at `y * stride + x`, and what is computed for the two last places of a row is of no use.
pub(super) struct Patch<const ROOM: usize> {
    /// Width of the patch.
    width: usize,
    /// Width with the texels around.
    pub(super) stride: usize,
    /// Places in all rows of the patch.
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
    /// Blocks that are touched, each with its place here and in the field.
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

    /// Reads the depths; false if they are all zero.
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

    /// Finds what is touched, and the slopes by Sobel's operator; a wall that goes down to the right leans to the right.
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

    /// Adds other slopes to those of the cracks.
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

    /// Leaves only a share of the slopes of the cracks; what is added later is whole.
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

    /// Places in all rows.
    pub(super) const fn len(&self) -> usize {
        self.len
    }

    /// Whether a texel of the block at a place is touched, or one beside it.
    #[inline(always)]
    pub(super) fn is_touched(&self, place: usize) -> bool {
        self.touch[place..].first_chunk::<BLOCK>().is_some_and(|touch| *touch != [0; BLOCK])
    }

    /// The places of a row.
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
