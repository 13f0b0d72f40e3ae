//! [`Grid`]: the one two-dimensional buffer of the crate.

use glam::UVec2;

/// A row-major buffer of `size.x * size.y` values: (0, 0) is the top left, x runs right, y runs down.
///
/// ```
/// use bevy_crack::Grid;
///
/// let mut grid = Grid::new([3, 2].into(), 0u8);
/// grid.row_mut(1)[2] = 9;
/// assert_eq!(grid.as_slice(), [0, 0, 0, 0, 0, 9]);
/// assert_eq!(grid.get(2, 1), Some(9));
/// assert_eq!(grid.get(3, 1), None);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grid<T> {
    size: UVec2,
    data: Vec<T>,
}

impl<T: Copy> Grid<T> {
    /// A grid with `fill` everywhere.
    #[must_use]
    pub fn new(size: UVec2, fill: T) -> Self {
        Self { size, data: vec![fill; size.x as usize * size.y as usize] }
    }

    /// A grid over existing rows; `None` if `data` has not exactly `size.x * size.y` values.
    #[must_use]
    pub fn from_vec(size: UVec2, data: Vec<T>) -> Option<Self> {
        (data.len() == size.x as usize * size.y as usize).then_some(Self { size, data })
    }

    /// Width and height.
    #[must_use]
    pub const fn size(&self) -> UVec2 {
        self.size
    }

    /// Values per row.
    #[must_use]
    pub const fn width(&self) -> usize {
        self.size.x as usize
    }

    /// Number of rows.
    #[must_use]
    pub const fn height(&self) -> usize {
        self.size.y as usize
    }

    /// The value at column `x`, row `y`; `None` outside.
    #[must_use]
    pub fn get(&self, x: u32, y: u32) -> Option<T> {
        (x < self.size.x && y < self.size.y).then(|| self.data[y as usize * self.width() + x as usize])
    }

    /// Row `y`.
    ///
    /// # Panics
    /// If `y` is not below the height.
    #[must_use]
    pub fn row(&self, y: usize) -> &[T] {
        let w = self.width();
        &self.data[y * w..(y + 1) * w]
    }

    /// Row `y`, to write.
    ///
    /// # Panics
    /// If `y` is not below the height.
    #[must_use]
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        let w = self.width();
        &mut self.data[y * w..(y + 1) * w]
    }

    /// All values, row after row.
    #[must_use]
    pub fn as_slice(&self) -> &[T] {
        &self.data
    }

    /// All values, row after row, to write.
    #[must_use]
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.data
    }
}
