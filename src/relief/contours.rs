//! [`Ring`], [`Contours`]: closed contour lines and their levels.

use glam::Vec2;

/// One closed contour line: a simple polygon.
///
/// The last corner is joined to the first. Seen with x to the right and y *down*, as everywhere in pattern space, a ring
/// around higher ground has a positive [`Ring::signed_area`], and a hole in such a region a negative one.
///
/// ```
/// use bevy_crack::relief::Ring;
///
/// let square = Ring { points: [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]].map(Into::into).to_vec(), level: 0 };
/// assert_eq!((square.signed_area(), square.is_hole()), (0.25, false));
/// let hole = Ring { points: square.points.into_iter().rev().collect(), level: 0 };
/// assert_eq!((hole.signed_area(), hole.is_hole()), (-0.25, true));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ring {
    /// Corners in order, pattern units. Three at least, all of them different from their neighbors.
    pub points: Vec<Vec2>,
    /// 0 for the seed contour, 1, 2, ... for those that were made inward (higher), -1, -2, ... outward (lower).
    pub level: i32,
}

impl Ring {
    /// The area inside, in square pattern units; negative for holes.
    #[must_use]
    pub fn signed_area(&self) -> f64 {
        let next = self.points.iter().cycle().skip(1);
        let cross = |(a, b): (&Vec2, &Vec2)| f64::from(a.x) * f64::from(b.y) - f64::from(b.x) * f64::from(a.y);
        0.5 * self.points.iter().zip(next).map(cross).sum::<f64>()
    }

    /// Whether the region of its level lies outside of the ring.
    #[must_use]
    pub fn is_hole(&self) -> bool {
        self.signed_area() < 0.0
    }
}

/// All contour lines around one or more seeds.
///
/// The region of a level is what its rings enclose, holes left out. It lies inside the region of the level below it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contours {
    /// All rings, lowest level first.
    pub rings: Vec<Ring>,
    /// Distance between a level and the next, pattern units.
    pub distance: f32,
}

impl Contours {
    /// The rings of one level.
    pub fn level(&self, level: i32) -> impl Iterator<Item = &Ring> {
        self.rings.iter().filter(move |ring| ring.level == level)
    }

    /// The lowest and the highest level that has a ring; `None` without rings.
    #[must_use]
    pub fn levels(&self) -> Option<(i32, i32)> {
        let levels = self.rings.iter().map(|ring| ring.level);
        levels.clone().min().zip(levels.max())
    }
}
