//! Finds the lines of a picture: areas that are lighter (or darker, or more or less colourful) than both their sides, over
//! a length.

use crate::{
    Grid,
    math::{ops, vectorized},
};
use glam::{IVec2, UVec2, Vec2};

/// The shorter side of the picture in which lines are searched for, texels.
const SIDE: u32 = 256;

/// Widths of the filters, texels: lines between two of these widths respond to both.
const WIDTHS: [f32; 3] = [1.0, 2.0, 4.0];

/// Directions of the filters, over half a turn.
const DIRECTIONS: u32 = 12;

/// Texels around the picture, mirrored: the extent of the widest filter and a little more.
const MARGIN: usize = 24;

/// Range to which the contrast of a texel is clamped: a gap counts against a line only a little, and a highlight
/// counts for it only to a limit.
const CONTRAST: (f32, f32) = (-0.05, 0.25);

/// Share of texels that respond in a picture without lines.
const NOISE: f32 = 0.02;

/// The smallest response of a line: fainter lines are not visible.
const FAINTEST: f32 = 0.02;

/// A line must reach this many times the response of noise somewhere.
const CLEAR: f32 = 1.7;

/// Length of the shortest line that counts, as a share of the shorter side.
const LENGTH: f32 = 0.25;

/// Lines of another colour must cover this many times as much as those of another lightness.
const COLOR: f32 = 1.5;

/// Added to the divisor of [`colorfulness`], so that noise in dark texels does not count as colour, 0..=1.
const DARK: f32 = 0.1;

/// The lines of a picture of `size` texels as values of 0..=1, at a lower resolution if the picture is large; `None`
/// if it has none.
///
/// Bricks cast shadows on their mortar, so that its joints have dark lines beside the light ones, and neither stands out: there
/// the colour tells more than the lightness.
pub(super) fn find(size: UVec2, rgba: &[u8]) -> Option<Grid<f32>> {
    let texels = rgba.as_chunks::<4>().0;
    let light = lines_of(&Padded::new(size, |index| [lightness(texels[index])], |[mean]| mean));
    if texels.iter().all(|texel| texel[0] == texel[1] && texel[1] == texel[2]) {
        return light;
    }
    // From the mean colour, as photographs that were saved with losses have specks of other colours.
    let colored = lines_of(&Padded::new(size, |index| texels[index].map(f32::from), colorfulness));
    let covered = |lines: &Option<Grid<f32>>| lines.as_ref().map_or(0.0, |lines| lines.as_slice().iter().sum::<f32>());
    if covered(&colored) > COLOR * covered(&light) { colored } else { light }
}

/// Lightness of a texel as stored, 0..=1.
pub(crate) fn lightness([r, g, b, _]: [u8; 4]) -> f32 {
    f32::from(u16::from(r) + 2 * u16::from(g) + u16::from(b)) / (4.0 * 255.0)
}

/// How much colour a texel has, for its lightness: 0 for grey, and little less in shadow than in light.
fn colorfulness([r, g, b, _]: [f32; 4]) -> f32 {
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    (most - least) / (most + 255.0 * DARK)
}

/// The long lines of a picture.
fn lines_of(picture: &Padded) -> Option<Grid<f32>> {
    let mut responses = [vec![0.0_f32; picture.texels()], vec![0.0; picture.texels()]];
    for width in WIDTHS {
        let blurred = picture.blurred(0.4 * width);
        vectorized(
            #[inline(always)]
            || respond(&blurred, width, &mut responses),
        );
    }
    // A texture without lines has as many light responses as dark ones. So the weaker kind gives the level of noise.
    let [light, dark] = &responses;
    let (lines, noise) = if top(light, 0.01) >= top(dark, 0.01) { (light, dark) } else { (dark, light) };
    let low = top(noise, NOISE).max(FAINTEST);
    let kept = long_ones(picture.size, lines, low, CLEAR * low);
    // As wide as the lines themselves: the filter responds beside them too, but less.
    let mut inside: Vec<f32> = kept.iter().zip(lines).filter_map(|(&kept, &line)| kept.then_some(line)).collect();
    if inside.is_empty() {
        return None;
    }
    let strong = nth(&mut inside, 0.1);
    let (zero, one) = (low.max(0.25 * strong), (CLEAR * low).max(0.6 * strong));
    let value = |(&kept, &line): (&bool, &f32)| if kept { ((line - zero) / (one - zero)).clamp(0.0, 1.0) } else { 0.0 };
    Grid::from_vec(picture.size, kept.iter().zip(lines).map(value).collect())
}

/// Values of a picture with a mirrored margin.
struct Padded {
    /// Without the margin.
    size: UVec2,
    /// Values in a row, with the margins.
    stride: usize,
    values: Vec<f32>,
}

impl Padded {
    /// The picture, averaged to a shorter side of [`SIDE`] where it is larger: what `value` makes of the mean of what `texel` reads.
    fn new<const N: usize>(size: UVec2, texel: impl Fn(usize) -> [f32; N], value: impl Fn([f32; N]) -> f32) -> Self {
        let side = size.min_element();
        let small = if side <= SIDE {
            size
        } else {
            let scaled = |side: u32, shorter: u32| {
                ((u64::from(side) * u64::from(SIDE) + u64::from(shorter) / 2) / u64::from(shorter)) as u32
            };
            UVec2::new(scaled(size.x, side), scaled(size.y, side)).max(UVec2::ONE)
        };
        // The texels from `start` on, before `end`, make texel `i` of the small picture.
        let span = |i: u32, small: u32, large: u32| {
            let start = u64::from(i) * u64::from(large) / u64::from(small);
            let end = u64::from(i + 1) * u64::from(large) / u64::from(small);
            start as usize..end as usize
        };
        let width = size.x as usize;
        let mut texels = Vec::with_capacity(small.x as usize * small.y as usize);
        for y in 0..small.y {
            for x in 0..small.x {
                let (columns, rows) = (span(x, small.x, size.x), span(y, small.y, size.y));
                let count = columns.len() * rows.len();
                let mut sum = [0.0; N];
                for read in rows.flat_map(|y| columns.clone().map(move |x| y * width + x)).map(&texel) {
                    sum.iter_mut().zip(read).for_each(|(sum, read)| *sum += read);
                }
                texels.push(value(sum.map(|sum| sum / count as f32)));
            }
        }
        let (columns, rows) = (small.x as usize, small.y as usize);
        let stride = columns + 2 * MARGIN;
        let values = (0..(rows + 2 * MARGIN) * stride)
            .map(|i| texels[mirrored(i / stride, rows) * columns + mirrored(i % stride, columns)])
            .collect();
        Self { size: small, stride, values }
    }

    fn texels(&self) -> usize {
        self.size.x as usize * self.size.y as usize
    }

    /// Blurred with a Gaussian of `sigma` texels. The outermost texels of the margin lose a little of their weight.
    fn blurred(&self, sigma: f32) -> Self {
        let reach = (3.0 * sigma).ceil() as i32;
        let weights: Vec<f32> = (-reach..=reach).map(|i| ops::exp(-0.5 * (i as f32 / sigma).powi(2))).collect();
        let total: f32 = weights.iter().sum();
        let mut values = self.values.clone();
        for step in [1, self.stride as i32] {
            let from = core::mem::replace(&mut values, vec![0.0; self.values.len()]);
            for (i, weight) in (-reach..=reach).zip(&weights) {
                let (source, target) = shifted(&from, &mut values, i * step);
                for (target, source) in target.iter_mut().zip(source) {
                    *target += source * (weight / total);
                }
            }
        }
        Self { size: self.size, stride: self.stride, values }
    }
}

/// Index of the texel at position `i` of a row with margins.
fn mirrored(i: usize, side: usize) -> usize {
    let i = (i + 2 * MARGIN * side - MARGIN) % (2 * side);
    i.min(2 * side - 1 - i)
}

/// The parts of two buffers in which `from[i + by]` and `to[i]` both exist.
fn shifted<'a>(from: &'a [f32], to: &'a mut [f32], by: i32) -> (&'a [f32], &'a mut [f32]) {
    let (n, by_abs) = (from.len(), by.unsigned_abs() as usize);
    if by >= 0 { (&from[by_abs..], &mut to[..n - by_abs]) } else { (&from[..n - by_abs], &mut to[by_abs..]) }
}

/// Raises `responses` (light, dark) to those of lines `width` texels wide, in the best direction at each texel.
#[inline(always)]
fn respond(picture: &Padded, width: f32, responses: &mut [Vec<f32>; 2]) {
    let (columns, stride) = (picture.size.x as usize, picture.stride);
    let reach = (3.0 + 2.0 * width) as i32;
    let mut contrast = [vec![0.0; picture.values.len()], vec![0.0; picture.values.len()]];
    let mut sum = vec![0.0; columns];
    for direction in 0..DIRECTIONS {
        let along = ops::unit(core::f32::consts::PI * direction as f32 / DIRECTIONS as f32);
        let side = along.perp() * (1.25 * width + 0.5);
        let (left, right) = (Tap::new(side, stride), Tap::new(-side, stride));
        // Within these bounds the taps stay inside the buffer.
        let edge = (MARGIN - reach as usize - 1) * (stride + 1);
        let [light, dark] = &mut contrast;
        for i in edge..picture.values.len() - edge {
            let (here, a, b) = (picture.values[i], left.read(&picture.values, i), right.read(&picture.values, i));
            light[i] = (here - if a > b { a } else { b }).clamp(CONTRAST.0, CONTRAST.1);
            dark[i] = (if a < b { a } else { b } - here).clamp(CONTRAST.0, CONTRAST.1);
        }
        let offsets: Vec<isize> = (-reach..=reach).map(|k| offset((along * k as f32).round(), stride)).collect();
        for (contrast, response) in contrast.iter().zip(&mut *responses) {
            for (y, response) in response.chunks_exact_mut(columns).enumerate() {
                let start = (y + MARGIN) * stride + MARGIN;
                sum.fill(0.0);
                for offset in &offsets {
                    let from = start.saturating_add_signed(*offset);
                    for (sum, contrast) in sum.iter_mut().zip(&contrast[from..from + columns]) {
                        *sum += contrast;
                    }
                }
                for (response, sum) in response.iter_mut().zip(&sum) {
                    let mean = sum / offsets.len() as f32;
                    *response = if mean > *response { mean } else { *response };
                }
            }
        }
    }
}

fn offset(by: Vec2, stride: usize) -> isize {
    by.y as isize * stride as isize + by.x as isize
}

/// The value at a fixed offset from a texel, interpolated between four others.
struct Tap {
    offset: isize,
    below: usize,
    weights: [f32; 4],
}

impl Tap {
    fn new(by: Vec2, stride: usize) -> Self {
        let t = by - by.floor();
        let weights = [(1.0 - t.x) * (1.0 - t.y), t.x * (1.0 - t.y), (1.0 - t.x) * t.y, t.x * t.y];
        Self { offset: offset(by.floor(), stride), below: stride, weights }
    }

    #[inline(always)]
    fn read(&self, values: &[f32], i: usize) -> f32 {
        let i = i.wrapping_add_signed(self.offset);
        let [a, b, c, d] = self.weights;
        values[i] * a + values[i + 1] * b + values[i + self.below] * c + values[i + self.below + 1] * d
    }
}

/// The value that the given share of values exceeds.
fn top(values: &[f32], share: f32) -> f32 {
    nth(&mut values.to_vec(), share)
}

fn nth(values: &mut [f32], share: f32) -> f32 {
    let index = ((1.0 - share) * values.len() as f32) as usize;
    *values.select_nth_unstable_by(index.min(values.len() - 1), f32::total_cmp).1
}

/// The connected parts (8 neighbours) above `low` that exceed `high` somewhere and are long.
fn long_ones(size: UVec2, values: &[f32], low: f32, high: f32) -> Vec<bool> {
    let length = LENGTH * size.min_element() as f32;
    let (mut kept, mut seen) = (vec![false; values.len()], vec![false; values.len()]);
    let mut part = Vec::new();
    for first in 0..values.len() {
        if seen[first] || values[first] <= low {
            continue;
        }
        seen[first] = true;
        part.clear();
        part.push(first);
        let (mut least, mut most, mut is_clear) = (size.as_ivec2(), IVec2::ZERO, false);
        let mut next = 0;
        while let Some(&i) = part.get(next) {
            next += 1;
            is_clear |= values[i] > high;
            let at = UVec2::new(i as u32 % size.x, i as u32 / size.x).as_ivec2();
            (least, most) = (least.min(at), most.max(at));
            for (dx, dy) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
                let near = (at + IVec2::new(dx, dy)).as_uvec2();
                // Negative coordinates have wrapped around to large values.
                if near.x >= size.x || near.y >= size.y {
                    continue;
                }
                let j = (near.y * size.x + near.x) as usize;
                if !seen[j] && values[j] > low {
                    seen[j] = true;
                    part.push(j);
                }
            }
        }
        if is_clear && (most - least).as_vec2().length() >= length {
            for &i in &part {
                kept[i] = true;
            }
        }
    }
    kept
}
