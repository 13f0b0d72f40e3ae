//! [`GuidanceField`]: the direction in which a crack would like to run at each place.

use super::error::StrandError;
use crate::{
    Grid,
    math::{Rng, ops},
};
use glam::{UVec2, Vec2};
use noise::{NoiseFn, Perlin};
use std::sync::Arc;

/// The largest number of points of a line that strands follow.
pub const MAX_LINE_POINTS: usize = 4096;

/// The directions of a field before noise turns them. Positions are in pattern units; y points down.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect))]
#[non_exhaustive]
pub enum Directions {
    /// The same direction everywhere. Its length does not matter; zero gives a field without directions.
    Linear(Vec2),
    /// Away from a point.
    Radial {
        /// The point.
        center: Vec2,
    },
    /// Around a point.
    Swirl {
        /// The point.
        center: Vec2,
        /// Angle between the direction and the way from the point, radians, -π..=π: π/2 runs in circles, clockwise as seen on the
        /// surface; less winds outward.
        turn: f32,
    },
    /// An image of directions, stretched over the surface and linear between its texels. Where it is zero a strand stops.
    Painted(Grid<[f32; 2]>),
    /// Along a line that somebody has drawn, from its first point to its last, where strands stop.
    Along {
        /// The points, 2..=[`MAX_LINE_POINTS`].
        line: Vec<Vec2>,
        /// Distance from the line at which the direction points back to it by 45 degrees. 0.001..=64.
        hold: f32,
    },
}

impl Directions {
    /// Directions from a picture: red is x and green is y, 128 is zero. `rgba` has four bytes for each texel.
    ///
    /// ```
    /// use bevy_crack::strands::{Directions, GuidanceField};
    ///
    /// // Two texels: to the right, and down.
    /// let painted = Directions::from_picture([2, 1].into(), &[255, 128, 0, 255, 128, 255, 0, 255])?;
    /// let field = GuidanceField::new(painted, 0.0, 0.0, [2.0, 1.0].into(), 7)?;
    /// assert_eq!(field.at([0.5, 0.5].into()), [1.0, 0.0].into());
    /// assert_eq!(field.at([1.5, 0.5].into()), [0.0, 1.0].into());
    /// # Ok::<(), bevy_crack::strands::StrandError>(())
    /// ```
    ///
    /// # Errors
    /// [`StrandError::EmptyField`] if there are no texels, [`StrandError::PictureSize`] if the bytes do not fit `size`.
    pub fn from_picture(size: UVec2, rgba: &[u8]) -> Result<Self, StrandError> {
        if size.min_element() == 0 {
            return Err(StrandError::EmptyField);
        }
        let (texels, rest) = rgba.as_chunks::<4>();
        let signed = |level: u8| (f32::from(level) - 128.0) / 127.0;
        let directions = texels.iter().map(|texel| [signed(texel[0]), signed(texel[1])]).collect();
        let wrong = StrandError::PictureSize { width: size.x, height: size.y, bytes: rgba.len() };
        match Grid::from_vec(size, directions) {
            Some(painted) if rest.is_empty() => Ok(Self::Painted(painted)),
            _ => Err(wrong),
        }
    }

    fn validate(&self) -> Result<(), StrandError> {
        let within = |name, value: f32, min, max| match (min..=max).contains(&value) {
            true => Ok(()),
            false => Err(StrandError::OutOfRange { name, value, min, max }),
        };
        let place = |x: &'static str, y: &'static str, at: Vec2| {
            within(x, at.x, -1.0e6, 1.0e6).and_then(|()| within(y, at.y, -1.0e6, 1.0e6))
        };
        match self {
            Self::Linear(direction) => place("directions.linear.x", "directions.linear.y", *direction),
            Self::Radial { center } => place("directions.center.x", "directions.center.y", *center),
            Self::Swirl { center, turn } => {
                let pi = std::f32::consts::PI;
                place("directions.center.x", "directions.center.y", *center)?;
                within("directions.turn", *turn, -pi, pi)
            }
            Self::Painted(painted) => painted_is_sound(painted),
            Self::Along { line, hold } => {
                within("directions.hold", *hold, 0.001, 64.0)?;
                let is_line = (2..=MAX_LINE_POINTS).contains(&line.len())
                    && line.iter().all(|point| point.abs().max_element() <= 1.0e6)
                    && line.iter().any(|point| *point != line[0]);
                if is_line { Ok(()) } else { Err(StrandError::Line { points: line.len(), most: MAX_LINE_POINTS }) }
            }
        }
    }

    /// The direction at `pos`, of length 1, or zero where there is none.
    pub(super) fn at(&self, pos: Vec2, extent: Vec2) -> Vec2 {
        match self {
            Self::Linear(direction) => direction.normalize_or_zero(),
            Self::Radial { center } => (pos - *center).normalize_or_zero(),
            Self::Swirl { center, turn } => ops::unit(*turn).rotate((pos - *center).normalize_or_zero()),
            Self::Painted(painted) => sample(painted, pos / extent).normalize_or_zero(),
            Self::Along { line, hold } => along(line, *hold, pos),
        }
    }
}

fn painted_is_sound(painted: &Grid<[f32; 2]>) -> Result<(), StrandError> {
    if painted.size().min_element() == 0 {
        return Err(StrandError::EmptyField);
    }
    let wrong = painted.as_slice().iter().position(|[x, y]| !(x.is_finite() && y.is_finite()));
    wrong.map_or(Ok(()), |i| {
        let width = painted.width();
        Err(StrandError::FieldNotFinite { x: (i % width) as u32, y: (i / width) as u32 })
    })
}

/// The value of an image at `uv`, linear between texel centres.
fn sample(painted: &Grid<[f32; 2]>, uv: Vec2) -> Vec2 {
    let size = painted.size().as_vec2();
    let at = (uv * size - 0.5).clamp(Vec2::ZERO, size - 1.0);
    let (corner, part) = (at.floor(), at - at.floor());
    let texel = |dx: f32, dy: f32| {
        let at = (corner + Vec2::new(dx, dy)).min(size - 1.0).as_uvec2();
        painted.get(at.x, at.y).map_or(Vec2::ZERO, Vec2::from)
    };
    let row = |dy: f32| texel(0.0, dy).lerp(texel(1.0, dy), part.x);
    row(0.0).lerp(row(1.0), part.y)
}

/// The direction of the nearest piece of a line, turned towards it by the distance; zero beyond its end.
fn along(line: &[Vec2], hold: f32, pos: Vec2) -> Vec2 {
    let mut best = (f32::INFINITY, Vec2::ZERO, Vec2::ZERO, false);
    for (i, ends) in line.windows(2).enumerate() {
        let piece = ends[1] - ends[0];
        let length_sq = piece.length_squared();
        if length_sq == 0.0 {
            continue;
        }
        let share = (pos - ends[0]).dot(piece) / length_sq;
        let nearest = ends[0] + piece * share.clamp(0.0, 1.0);
        let distance = nearest.distance_squared(pos);
        // The later piece at a corner, so that paths go on.
        if distance <= best.0 {
            let is_over = share >= 1.0 && line[i + 1..].iter().all(|point| *point == ends[1]);
            best = (distance, piece.normalize_or_zero(), nearest, is_over);
        }
    }
    if best.3 {
        return Vec2::ZERO;
    }
    (best.1 + (best.2 - pos) / hold).normalize_or_zero()
}

/// The direction in which a crack would like to run, at every place of a surface (section 3.1 of the paper).
///
/// Perlin noise `P` of frequency `f` turns the direction `v0` of [`Directions`]:
///
/// ```text
/// v(x) = R(π c P(f x)) v0(x)
/// ```
///
/// Nothing is stored for a texel: a path evaluates the field only where it runs. [`picture`](Self::picture) makes an
/// image of all of it.
///
/// ```
/// use bevy_crack::strands::{Directions, GuidanceField};
///
/// let down = Directions::Linear([0.0, 2.0].into());
/// let field = GuidanceField::new(down, 8.0, 0.0, [1.0, 1.0].into(), 7)?;
/// assert_eq!(field.at([0.3, 0.4].into()), [0.0, 1.0].into());
/// assert_eq!(field.extent(), [1.0, 1.0].into());
/// # Ok::<(), bevy_crack::strands::StrandError>(())
/// ```
#[derive(Clone, Debug)]
pub struct GuidanceField {
    pub(super) directions: Arc<Directions>,
    pub(super) frequency: f32,
    pub(super) rotation: f32,
    pub(super) extent: Vec2,
    pub(super) noise: Turbulence,
}

/// Perlin noise with a random offset, so that its zeros lie elsewhere for every seed.
#[derive(Clone, Debug)]
pub(super) struct Turbulence {
    perlin: Perlin,
    pub(super) seed: u32,
    pub(super) offset: Vec2,
}

impl Turbulence {
    pub(super) fn new(seed: u64, name: &str) -> Self {
        let mut rng = Rng::new(seed).stream(name);
        let seed = rng.next_u32();
        let offset = Vec2::new(rng.range(0.0, 256.0), rng.range(0.0, 256.0));
        Self { perlin: Perlin::new(seed), seed, offset }
    }

    /// The value at `pos` times `frequency`, -1..=1.
    pub(super) fn at(&self, pos: Vec2, frequency: f32) -> f32 {
        let at = pos.as_dvec2() * f64::from(frequency) + self.offset.as_dvec2();
        self.perlin.get(at.to_array()) as f32
    }
}

impl GuidanceField {
    /// A field over a surface of `extent` pattern units. `frequency` is in cells of noise per pattern unit, 0..=256;
    /// `rotation` is the coefficient `c`, 0..=1.
    ///
    /// # Errors
    /// [`StrandError`] if a number is out of its range, an image is empty or not finite, or a line is no line.
    pub fn new(
        directions: Directions,
        frequency: f32,
        rotation: f32,
        extent: Vec2,
        seed: u64,
    ) -> Result<Self, StrandError> {
        for (name, value, min, max) in [
            ("frequency", frequency, 0.0, 256.0),
            ("rotation", rotation, 0.0, 1.0),
            ("extent", extent.x, 1.0e-4, 64.0),
            ("extent", extent.y, 1.0e-4, 64.0),
        ] {
            if !(min..=max).contains(&value) {
                return Err(StrandError::OutOfRange { name, value, min, max });
            }
        }
        directions.validate()?;
        Ok(Self {
            directions: Arc::new(directions),
            frequency,
            rotation,
            extent,
            noise: Turbulence::new(seed, "guidance"),
        })
    }

    /// The same directions turned by other noise.
    pub(super) fn with_noise(&self, frequency: f32, seed: u64) -> Self {
        Self { frequency, noise: Turbulence::new(seed, "guidance"), ..self.clone() }
    }

    /// The direction at `pos` (pattern units), of length 1; zero where the field has none.
    #[must_use]
    pub fn at(&self, pos: Vec2) -> Vec2 {
        let direction = self.directions.at(pos, self.extent);
        if self.rotation == 0.0 || direction == Vec2::ZERO {
            return direction;
        }
        let turn = std::f32::consts::PI * self.rotation * self.noise.at(pos, self.frequency);
        ops::unit(turn).rotate(direction)
    }

    /// Size of the surface, pattern units.
    #[must_use]
    pub const fn extent(&self) -> Vec2 {
        self.extent
    }
}
