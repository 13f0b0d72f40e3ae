//! [`Pace`]: how far a contour moves at each of its points.

use super::{
    error::ReliefError,
    lattice::{Lattice, Point},
};
use crate::Grid;
use glam::Vec2;

/// Smallest and largest factor of an image of factors.
pub(super) const FACTORS: [f32; 2] = [0.1, 8.0];

/// Factors over a surface.
#[derive(Clone, Debug)]
struct Image {
    factors: Grid<f32>,
    /// Texels per lattice step along each axis.
    scale: [f64; 2],
    least: f64,
}

/// The distance of a contour from the next one, which may vary along it.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    /// Lattice steps.
    distance: f64,
    steepness: f64,
    /// Unit vector to the steep side.
    steep: [f64; 2],
    image: Option<Image>,
}

impl Pace {
    /// A pace of `distance` lattice steps, less on the side of the angle `steep_angle`.
    pub(super) fn new(distance: f64, steepness: f32, steep_angle: f32) -> Self {
        let angle = f64::from(steep_angle);
        Self { distance, steepness: f64::from(steepness), steep: [libm::cos(angle), libm::sin(angle)], image: None }
    }

    /// A pace of the same number of lattice steps everywhere.
    pub(super) const fn even(distance: f64) -> Self {
        Self { distance, steepness: 0.0, steep: [1.0, 0.0], image: None }
    }

    /// Multiplies distances by an image that covers a surface of the size `extent`, from the origin.
    pub(super) fn set_image(&mut self, factors: Grid<f32>, extent: Vec2, lattice: Lattice) -> Result<(), ReliefError> {
        let size = factors.size();
        if size.min_element() == 0 || !(extent.is_finite() && extent.min_element() > 0.0) {
            return Err(ReliefError::Image { width: size.x, height: size.y, across: extent.x, down: extent.y });
        }
        let [min, max] = FACTORS;
        let values = factors.as_slice();
        if let Some(i) = values.iter().position(|value| !(min..=max).contains(value)) {
            let (x, y) = (i as u32 % size.x, i as u32 / size.x);
            return Err(ReliefError::Texel { x, y, value: values[i], min, max });
        }
        let least = values.iter().copied().fold(max, f32::min);
        let scale = [size.x as f32 / extent.x, size.y as f32 / extent.y].map(|s| f64::from(s) / lattice.steps());
        self.image = Some(Image { factors, scale, least: f64::from(least) });
        Ok(())
    }

    /// A share of every distance.
    pub(super) fn share(&self, share: f64) -> Self {
        Self { distance: self.distance * share, ..self.clone() }
    }

    /// Whether the distance is the same everywhere.
    pub(super) fn is_even(&self) -> bool {
        self.image.is_none() && self.steepness == 0.0
    }

    /// The smallest distance.
    pub(super) fn least(&self) -> f64 {
        self.distance * (1.0 - self.steepness) * self.image.as_ref().map_or(1.0, |image| image.least)
    }

    /// How far a point lies on the steep side.
    fn side(&self, point: Point) -> f64 {
        let [x, y] = point.place();
        x * self.steep[0] + y * self.steep[1]
    }

    /// The distances at the points of a ring.
    pub(super) fn on<'a>(&'a self, ring: &[Point]) -> impl Fn(Point) -> f64 + 'a {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        if self.steepness > 0.0 {
            ring.iter().for_each(|point| (low, high) = (low.min(self.side(*point)), high.max(self.side(*point))));
        }
        move |point| {
            if self.is_even() {
                return self.distance;
            }
            // From -1 at one end of the ring to 1 at the other.
            let side = if high > low { (2.0 * self.side(point) - low - high) / (high - low) } else { 0.0 };
            let factor = 1.0 - self.steepness * side.clamp(-1.0, 1.0);
            self.distance * factor * self.image.as_ref().map_or(1.0, |image| image.at(point))
        }
    }
}

impl Image {
    /// Between the centres of four texels; beyond the border as at the border.
    fn at(&self, point: Point) -> f64 {
        let [x, y] = point.place();
        let axis = |v: f64, scale: f64, count: usize| {
            let v = (v * scale - 0.5).clamp(0.0, (count - 1) as f64);
            (v as usize, (v as usize + 1).min(count - 1), v - v.floor())
        };
        let (x0, x1, s) = axis(x, self.scale[0], self.factors.width());
        let (y0, y1, t) = axis(y, self.scale[1], self.factors.height());
        let row = |y: usize| {
            let row = self.factors.row(y);
            f64::from(row[x0]) * (1.0 - s) + f64::from(row[x1]) * s
        };
        row(y0) * (1.0 - t) + row(y1) * t
    }
}
