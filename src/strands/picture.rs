//! The whole field as an image, row by row.
//!
//! Within a cell of Perlin noise the four corners' terms are linear along a row, so a texel costs a few
//! multiplications instead of four look-ups. The rotation is a polynomial. Both run in wide vectors.

use super::field::{Directions, GuidanceField, Turbulence};
use crate::{Grid, math::vectorized, pattern::SurfaceFrame};
use glam::Vec2;
use noise::permutationtable::{NoiseHasher, PermutationTable};

/// The noise of the `noise` crate is scaled by this, so that it fills -1..=1.
const SCALE: f32 = std::f32::consts::SQRT_2;

/// Added to a value of 0..=255, this rounds it and leaves the integer in the low bits of the float.
const WHOLE: f32 = 8_388_608.0;

impl GuidanceField {
    /// The field as an image of `frame`, RGBA: red is x and green is y, from 0 for -1 to 255 for 1; blue is 128.
    ///
    /// ```
    /// use bevy_crack::{pattern::SurfaceFrame, strands::{Directions, GuidanceField}};
    ///
    /// let field = GuidanceField::new(Directions::Linear([1.0, 0.0].into()), 4.0, 0.0, [1.0, 1.0].into(), 7)?;
    /// let picture = field.picture(SurfaceFrame::new([32, 32].into())?);
    /// assert_eq!(picture.get(5, 5), Some([255, 128, 128, 255]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn picture(&self, frame: SurfaceFrame) -> Grid<[u8; 4]> {
        let mut picture = Grid::new(frame.size(), [0; 4]);
        // The surface may be shown at other proportions: its corners are the picture's corners.
        let texel = self.extent / frame.size().as_vec2();
        let mut rows = Rows::new(self, frame.size().x as usize, texel);
        for y in 0..frame.size().y as usize {
            rows.fill(y, picture.row_mut(y));
        }
        picture
    }
}

/// What is the same in every row, and the row itself.
struct Rows<'a> {
    field: &'a GuidanceField,
    hasher: PermutationTable,
    texel: Vec2,
    columns: Columns,
    noise: Vec<f32>,
    x: Vec<f32>,
    y: Vec<f32>,
}

/// The cells of noise along a row.
struct Columns {
    first: isize,
    /// Column of texels at which each cell begins, and the end of the last one.
    begins: Vec<usize>,
    /// Position of each texel in its cell, and the same smoothed.
    places: Vec<f32>,
    fades: Vec<f32>,
}

fn quintic(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Cell and position in it of a coordinate.
fn cell(noise: &Turbulence, axis: usize, frequency: f32, at: f32) -> (isize, f32) {
    let place = f64::from(at) * f64::from(frequency) + f64::from(noise.offset[axis]);
    (place.floor() as isize, (place - place.floor()) as f32)
}

impl Columns {
    fn new(field: &GuidanceField, width: usize, texel: f32) -> Self {
        let places = (0..width).map(|x| cell(&field.noise, 0, field.frequency, (x as f32 + 0.5) * texel));
        let first = places.clone().next().map_or(0, |(cell, _)| cell);
        let mut begins = Vec::new();
        for (x, (cell, _)) in places.clone().enumerate() {
            // Cells narrower than a texel contain no texels.
            while (begins.len() as isize) <= cell - first {
                begins.push(x);
            }
        }
        begins.push(width);
        let places: Vec<f32> = places.map(|(_, place)| place).collect();
        let fades = places.iter().map(|&place| quintic(place)).collect();
        Self { first, begins, places, fades }
    }
}

impl<'a> Rows<'a> {
    fn new(field: &'a GuidanceField, width: usize, texel: Vec2) -> Self {
        Self {
            field,
            hasher: PermutationTable::new(field.noise.seed),
            texel,
            columns: Columns::new(field, width, texel.x),
            noise: vec![0.0; width],
            x: vec![0.0; width],
            y: vec![0.0; width],
        }
    }

    fn fill(&mut self, y: usize, out: &mut [[u8; 4]]) {
        let below = (y as f32 + 0.5) * self.texel.y;
        vectorized(
            #[inline(always)]
            || {
                self.fill_noise(below);
                self.fill_directions(below);
                let turn = self.field.rotation;
                for (((out, &noise), &x), &y) in out.iter_mut().zip(&self.noise).zip(&self.x).zip(&self.y) {
                    let (sin, cos) = sin_cos_pi(turn * noise);
                    let level = |value: f32| ((value * 127.5 + 127.5) + WHOLE).to_bits() & 255;
                    let (red, green) = (level(cos * x - sin * y), level(sin * x + cos * y));
                    *out = (red | green << 8 | 128 << 16 | 255 << 24).to_le_bytes();
                }
            },
        );
    }

    #[inline(always)]
    fn fill_noise(&mut self, below: f32) {
        let (row, down) = cell(&self.field.noise, 1, self.field.frequency, below);
        let fade = quintic(down);
        let columns = &self.columns;
        // The terms of both corners of a column, above and below: constant and slope along the row.
        let edge = |column: isize, from: f32| {
            let corner = |row: isize, down: f32| {
                let hash = self.hasher.hash(&[column, row]);
                let (gx, gy) = (1.0 - 2.0 * (hash & 1) as f32, 1.0 - (hash & 2) as f32);
                (gy * down - gx * from, gx)
            };
            let (above, below) = (corner(row, down), corner(row + 1, down - 1.0));
            ((above.0 + (below.0 - above.0) * fade) * SCALE, (above.1 + (below.1 - above.1) * fade) * SCALE)
        };
        for (i, ends) in columns.begins.windows(2).enumerate() {
            let span = ends[0]..ends[1];
            if span.is_empty() {
                continue;
            }
            let column = columns.first + i as isize;
            let (left, right) = (edge(column, 0.0), edge(column + 1, 1.0));
            let texels = columns.places[span.clone()].iter().zip(&columns.fades[span.clone()]);
            for (out, (&place, &fade)) in self.noise[span].iter_mut().zip(texels) {
                let (l, r) = (left.0 + left.1 * place, right.0 + right.1 * place);
                *out = (l + (r - l) * fade).clamp(-1.0, 1.0);
            }
        }
    }

    #[inline(always)]
    fn fill_directions(&mut self, below: f32) {
        match &*self.field.directions {
            Directions::Linear(direction) => {
                let direction = direction.normalize_or_zero();
                self.x.fill(direction.x);
                self.y.fill(direction.y);
            }
            Directions::Radial { center } => self.fill_around(*center, Vec2::X, below),
            Directions::Swirl { center, turn } => {
                self.fill_around(*center, crate::math::ops::unit(*turn), below);
            }
            directions => {
                for (i, (x, y)) in self.x.iter_mut().zip(&mut self.y).enumerate() {
                    let at = Vec2::new((i as f32 + 0.5) * self.texel.x, below);
                    [*x, *y] = directions.at(at, self.field.extent).to_array();
                }
            }
        }
    }

    #[inline(always)]
    fn fill_around(&mut self, center: Vec2, turn: Vec2, below: f32) {
        let dy = below - center.y;
        let texel = self.texel.x;
        for (i, (x, y)) in self.x.iter_mut().zip(&mut self.y).enumerate() {
            let dx = (i as f32 + 0.5) * texel - center.x;
            let inverse = 1.0 / (dx * dx + dy * dy).sqrt().max(1.0e-20);
            (*x, *y) = ((dx * turn.x - dy * turn.y) * inverse, (dx * turn.y + dy * turn.x) * inverse);
        }
    }
}

/// Sine and cosine of `π x` for `x` in -1..=1, to 1e-5: those of half the angle as Taylor polynomials, then doubled.
#[inline(always)]
fn sin_cos_pi(x: f32) -> (f32, f32) {
    let half = x * std::f32::consts::FRAC_PI_2;
    let sq = half * half;
    let sin = half
        * (1.0
            + sq * (-1.0 / 6.0
                + sq * (1.0 / 120.0 + sq * (-1.0 / 5040.0 + sq * (1.0 / 362_880.0 - sq / 39_916_800.0)))));
    let cos = 1.0
        + sq * (-0.5
            + sq * (1.0 / 24.0
                + sq * (-1.0 / 720.0 + sq * (1.0 / 40_320.0 + sq * (-1.0 / 3_628_800.0 + sq / 479_001_600.0)))));
    (2.0 * sin * cos, cos * cos - sin * sin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// The rows equal the field at single places, which the `noise` crate and the portable sine make.
    #[test]
    fn the_picture_shows_the_field() {
        let mut rng = Rng::new(3);
        for round in 0..60u64 {
            let frame = SurfaceFrame::new([40 + rng.next_u32() % 90, 30 + rng.next_u32() % 60].into()).unwrap();
            let center = Vec2::new(rng.range(-0.5, 1.5), rng.range(-0.5, 1.5));
            let line = (0..5).map(|_| Vec2::new(rng.unit(), rng.unit())).collect();
            let painted =
                Grid::from_vec([3, 2].into(), (0..6).map(|_| [rng.signed(), rng.signed()]).collect()).unwrap();
            let directions = [
                Directions::Linear(center),
                Directions::Radial { center },
                Directions::Swirl { center, turn: 3.0 * rng.signed() },
                Directions::Painted(painted),
                Directions::Along { line, hold: 0.2 },
            ][round as usize % 5]
                .clone();
            let frequency = 90.0 * rng.unit() * rng.unit();
            let field = GuidanceField::new(directions, frequency, rng.unit(), frame.extent(), round).unwrap();
            let picture = field.picture(frame);
            let mut far = 0;
            for y in 0..frame.size().y {
                for x in 0..frame.size().x {
                    let texel = picture.get(x, y).unwrap();
                    let v = field.at(frame.to_pos(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)));
                    for (level, value) in [(texel[0], v.x), (texel[1], v.y)] {
                        far += u32::from((f32::from(level) - (value * 127.5 + 127.5)).abs() > 0.52);
                    }
                }
            }
            // Where the direction jumps, the last bit of a position decides.
            assert!(far <= frame.size().x * frame.size().y / 500, "round {round}: {far} of {}", frame.size());
        }
    }

    #[test]
    fn sines_are_close() {
        for i in -1000..=1000 {
            let x = i as f32 / 1000.0;
            let (sin, cos) = sin_cos_pi(x);
            let angle = f64::from(x) * std::f64::consts::PI;
            assert!((f64::from(sin) - angle.sin()).abs() < 1.0e-5, "sin {x}");
            assert!((f64::from(cos) - angle.cos()).abs() < 1.0e-5, "cos {x}");
        }
    }
}
