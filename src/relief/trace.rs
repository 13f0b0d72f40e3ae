//! Outlines of what a picture shows, as seed contours.

use super::error::ReliefError;
use crate::Grid;
use glam::Vec2;

/// The borders of what is at least as high as `threshold` in an image of heights, or any other values.
///
/// A closed line for each outer border, with a positive area, and one for each hole, with a negative area, as seeds of
/// [`Contours::generate`](super::Contours::generate). They pass between texel centres where the values between them reach the threshold
/// (marching squares with linear interpolation); where four texels leave it open, their mean decides. Outside of the image
/// everything is low. Positions are in pattern space: the shorter side of the image is 1.
///
/// ```
/// use bevy_crack::{Grid, relief::outlines};
///
/// // A plate with a hole.
/// let image = Grid::from_vec([5, 5].into(), vec![
///     0.0, 0.0, 0.0, 0.0, 0.0,
///     0.0, 1.0, 1.0, 1.0, 0.0,
///     0.0, 1.0, 0.0, 1.0, 0.0,
///     0.0, 1.0, 1.0, 1.0, 0.0,
///     0.0, 0.0, 0.0, 0.0, 0.0,
/// ]).ok_or("25 texels")?;
/// let lines = outlines(&image, 0.5)?;
/// assert_eq!(lines.len(), 2);
/// assert!(lines[0].iter().all(|point| (point.x - 0.5).abs().max((point.y - 0.5).abs()) <= 0.4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ReliefError::Image`] without texels; [`ReliefError::Texel`] if a value is not finite.
pub fn outlines(image: &Grid<f32>, threshold: f32) -> Result<Vec<Vec<Vec2>>, ReliefError> {
    let size = image.size();
    if size.min_element() == 0 {
        return Err(ReliefError::Image { width: size.x, height: size.y, across: 1.0, down: 1.0 });
    }
    let values = image.as_slice();
    if let Some(i) = values.iter().position(|value| !value.is_finite()) {
        let (x, y) = (i as u32 % size.x, i as u32 / size.x);
        return Err(ReliefError::Texel { x, y, value: values[i], min: f32::MIN, max: f32::MAX });
    }
    Ok(Squares { image, threshold }.lines())
}

/// Squares between texel centres. Square (0, 0) has texel (0, 0) at its lower right, and texels outside elsewhere.
struct Squares<'a> {
    image: &'a Grid<f32>,
    threshold: f32,
}

/// A side of a square: upper, right, lower, left.
type Side = usize;

impl Squares<'_> {
    fn value(&self, x: i64, y: i64) -> Option<f32> {
        let (x, y) = (u32::try_from(x).ok()?, u32::try_from(y).ok()?);
        self.image.get(x, y)
    }

    fn is_high(&self, x: i64, y: i64) -> bool {
        self.value(x, y).is_some_and(|value| value >= self.threshold)
    }

    /// Texels of the corners of a square: upper left, upper right, lower right, lower left.
    fn corners(x: i64, y: i64) -> [[i64; 2]; 4] {
        [[x - 1, y - 1], [x, y - 1], [x, y], [x - 1, y]]
    }

    /// Where a line that enters through `side` leaves. It has what is high on the side of positive turns.
    fn way_out(&self, x: i64, y: i64, side: Side) -> Side {
        let high = Self::corners(x, y).map(|[x, y]| self.is_high(x, y));
        let is_saddle = high[0] == high[2] && high[1] == high[3] && high[0] != high[1];
        if is_saddle {
            let sum: f32 = Self::corners(x, y).iter().map(|&[x, y]| self.value(x, y).unwrap_or(f32::MIN)).sum();
            let is_middle_high = 0.25 * sum >= self.threshold;
            // Round the low corner, or round the high one.
            return if is_middle_high { (side + 1) % 4 } else { (side + 3) % 4 };
        }
        let is_cut = |side: Side| high[side] != high[(side + 1) % 4];
        (1..4).map(|turn| (side + turn) % 4).find(|&side| is_cut(side)).unwrap_or(side)
    }

    /// Whether a line enters the square through this side.
    fn enters(&self, x: i64, y: i64, side: Side) -> bool {
        let corners = Self::corners(x, y);
        let [first, second] = [corners[side], corners[(side + 1) % 4]].map(|[x, y]| self.is_high(x, y));
        first && !second
    }

    /// Where a line passes a side of a square, in pattern space.
    fn place(&self, x: i64, y: i64, side: Side) -> Vec2 {
        let corners = Self::corners(x, y);
        let mut ends = [corners[side], corners[(side + 1) % 4]];
        // The same numbers from both squares of the side.
        ends.sort_unstable();
        let [a, b] = ends.map(|[x, y]| self.value(x, y));
        let share = match (a, b) {
            (Some(a), Some(b)) => ((self.threshold - a) / (b - a)).clamp(0.01, 0.99),
            _ => 0.5,
        };
        let [a, b] = ends.map(|[x, y]| Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
        a.lerp(b, share) / self.image.size().min_element() as f32
    }

    fn lines(&self) -> Vec<Vec<Vec2>> {
        const STEPS: [[i64; 2]; 4] = [[0, -1], [1, 0], [0, 1], [-1, 0]];
        let (width, height) = (self.image.width() as i64 + 1, self.image.height() as i64 + 1);
        // The sides of each square through which a line has entered.
        let mut is_done = vec![[false; 4]; (width * height) as usize];
        let mut out = Vec::new();
        for start in 0..width * height {
            for side in 0..4 {
                let (mut x, mut y, mut side) = (start % width, start / width, side);
                let mut line = Vec::new();
                while self.enters(x, y, side) && !is_done[(y * width + x) as usize][side] {
                    is_done[(y * width + x) as usize][side] = true;
                    line.push(self.place(x, y, side));
                    let end = self.way_out(x, y, side);
                    (x, y) = (x + STEPS[end][0], y + STEPS[end][1]);
                    side = (end + 2) % 4;
                }
                if line.len() >= 3 {
                    out.push(line);
                }
            }
        }
        out
    }
}
