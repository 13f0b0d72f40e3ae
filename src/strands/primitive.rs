//! [`Primitive`]: a small height image of a crack, and the lines that are traced in it.

use super::{error::PrimitiveError, line::PrimitiveLine, trace::trace};
use crate::Grid;
use glam::Vec2;

/// The shortest and the longest side of an image that can be a primitive, texels.
pub const PRIMITIVE_SIDES: (u32, u32) = (8, 1024);

/// A small image of a crack that is joined to others, head (top centre) to tail (bottom centre).
///
/// The shipped ones are in [`Material`](super::Material). Own ones come from height images:
///
/// ```
/// use bevy_crack::{Grid, strands::{Primitive, PrimitiveLine, PrimitivePoint}};
///
/// // A straight crack, three texels wide.
/// let mut image = Grid::new([16, 32].into(), 0);
/// (0..32).for_each(|y| image.row_mut(y)[7..10].fill(65535));
/// let primitive = Primitive::from_image(image)?;
/// assert_eq!(primitive.image().size(), [16, 32].into());
/// assert!(!primitive.has_sides());
/// // One line, the main one. It runs from the head down to the tail.
/// let [PrimitiveLine { from: None, points }] = primitive.lines() else { panic!("a single line") };
/// let PrimitivePoint { at, width } = points[points.len() / 2];
/// assert_eq!((points[0].at.y, points[points.len() - 1].at.y), (0.0, 1.0));
/// assert!(at.x.abs() < 0.05 && (width - 3.0 / 32.0).abs() < 0.05);
/// # Ok::<(), bevy_crack::strands::PrimitiveError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Primitive {
    image: Grid<u16>,
    lines: Vec<PrimitiveLine>,
    /// The lines that end at the left and at the right connector.
    sides: Option<[u32; 2]>,
}

impl Primitive {
    /// A primitive from a height image: 0 is untouched, 65535 the deepest.
    ///
    /// The crack is where the image is deeper than a quarter of that. It must reach the middle third of the top and
    /// of the bottom side, and join them. If it also reaches the middle third of the left and of the right side, the
    /// primitive has four connectors and can make nets. Lines are traced along the middle of the crack; where the
    /// crack encloses an island, only one way around it becomes a line.
    ///
    /// # Errors
    /// [`PrimitiveError`] if a side is out of its range, the image is empty, or a connector is missing.
    pub fn from_image(image: Grid<u16>) -> Result<Self, PrimitiveError> {
        let (least, most) = PRIMITIVE_SIDES;
        let size = image.size();
        if size.min_element() < least || size.max_element() > most {
            return Err(PrimitiveError::Size { width: size.x, height: size.y, least, most });
        }
        let (lines, sides) = trace(&image)?;
        Ok(Self::new(image, lines, sides))
    }

    /// A primitive from its lines and an image of them.
    pub(super) fn new(image: Grid<u16>, mut lines: Vec<PrimitiveLine>, sides: Option<[u32; 2]>) -> Self {
        pin(&mut lines);
        let half = 0.5 * image.width() as f32 / image.height().max(1) as f32;
        for (line, x) in sides.into_iter().flatten().zip([-half, half]) {
            if let Some(end) = lines.get_mut(line as usize).and_then(|line| line.points.last_mut()) {
                end.at = Vec2::new(x, 0.5);
            }
        }
        Self { image, lines, sides }
    }

    /// The height image.
    #[must_use]
    pub const fn image(&self) -> &Grid<u16> {
        &self.image
    }

    /// The lines: first the main line from head to tail, then those that begin at it or at each other. Lines begin at
    /// earlier lines.
    #[must_use]
    pub fn lines(&self) -> &[PrimitiveLine] {
        &self.lines
    }

    /// Whether it has connectors on all four sides.
    #[must_use]
    pub const fn has_sides(&self) -> bool {
        self.sides.is_some()
    }

    /// The lines that end at the left and at the right connector.
    pub(super) const fn sides(&self) -> Option<[u32; 2]> {
        self.sides
    }

    /// Mean width of the main line, in heights.
    pub(super) fn mean_width(&self) -> f32 {
        let points = &self.lines[0].points;
        (points.iter().map(|point| point.width).sum::<f32>() / points.len() as f32).max(1.0e-4)
    }
}

/// Moves all lines so that the main line begins exactly at the head and ends exactly at the tail.
fn pin(lines: &mut [PrimitiveLine]) {
    let Some(main) = lines.first() else { return };
    let (Some(head), Some(tail)) = (main.points.first().copied(), main.points.last().copied()) else { return };
    let length = (tail.at.y - head.at.y).max(1.0e-3);
    for line in lines {
        for point in &mut line.points {
            let share = (point.at.y - head.at.y) / length;
            point.at = Vec2::new(point.at.x - head.at.x - (tail.at.x - head.at.x) * share, share);
        }
    }
}
