//! [`Grid`]: the one two-dimensional buffer of the crate. [`OutOfMemory`]: what is said where there is no memory for large ones.

#[cfg(feature = "bevy")]
use bevy::reflect::{ReflectDeserialize, ReflectSerialize};
use glam::UVec2;
#[cfg(feature = "bevy")]
use serde::{Serialize, de::DeserializeOwned};

/// There is not as much memory as a surface of this size needs. Nothing was made; with a smaller one it may work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no memory for {bytes} bytes")]
pub struct OutOfMemory {
    /// How many bytes were asked for.
    pub bytes: u64,
}

/// Asks for memory and gives it back: what is to be allocated in many places should be there when the work begins.
pub(crate) fn ask_for(bytes: u64) -> Result<(), OutOfMemory> {
    let mut asked = Vec::<u8>::new();
    let outcome = usize::try_from(bytes).map(|bytes| asked.try_reserve_exact(bytes));
    // Otherwise the compiler may leave both out.
    std::hint::black_box(&mut asked);
    if matches!(outcome, Ok(Ok(()))) { Ok(()) } else { Err(OutOfMemory { bytes }) }
}

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
/// grid.as_mut_slice()[..3].copy_from_slice(&[1, 2, 3]);
/// assert_eq!(grid.row(0), [1, 2, 3]);
/// assert_eq!((grid.width(), grid.height()), (3, 2));
///
/// // Over values that are there already, if there are as many as the size asks for.
/// assert_eq!(Grid::from_vec(grid.size(), vec![1, 2, 3, 0, 0, 9]), Some(grid));
/// assert_eq!(Grid::from_vec([3, 2].into(), vec![0; 5]), None);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "bevy", derive(bevy::reflect::Reflect), reflect(opaque))]
#[cfg_attr(feature = "bevy", reflect(Clone, Debug, PartialEq, Serialize, Deserialize))]
#[cfg_attr(feature = "bevy", reflect(where T: Copy + core::fmt::Debug + PartialEq + Serialize + DeserializeOwned))]
pub struct Grid<T> {
    size: UVec2,
    data: Vec<T>,
}

/// Fails if the number of values does not match the size.
#[cfg(feature = "serde")]
impl<'de, T: Copy + serde::Deserialize<'de>> serde::Deserialize<'de> for Grid<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(serde::Deserialize)]
        #[serde(rename = "Grid")]
        struct Parts<T> {
            size: UVec2,
            data: Vec<T>,
        }
        let Parts { size, data } = Parts::deserialize(deserializer)?;
        let length = data.len();
        let misfit = || serde::de::Error::custom(format_args!("{length} values for a grid of {size}"));
        Self::from_vec(size, data).ok_or_else(misfit)
    }
}

impl<T: Copy> Grid<T> {
    /// A grid with the value `fill` everywhere.
    #[must_use]
    pub fn new(size: UVec2, fill: T) -> Self {
        Self { size, data: vec![fill; size.x as usize * size.y as usize] }
    }

    /// Like [`new`](Self::new), which ends the program where there is no memory.
    ///
    /// ```
    /// use bevy_crack::{Grid, OutOfMemory};
    ///
    /// assert_eq!(Grid::try_new([3, 2].into(), 0u8), Ok(Grid::new([3, 2].into(), 0)));
    /// let huge = Grid::try_new([u32::MAX, u32::MAX].into(), 0u8);
    /// assert_eq!(huge, Err(OutOfMemory { bytes: 18_446_744_065_119_617_025 }));
    /// ```
    ///
    /// # Errors
    /// [`OutOfMemory`] if there is no memory for all values.
    pub fn try_new(size: UVec2, fill: T) -> Result<Self, OutOfMemory> {
        let count = u64::from(size.x) * u64::from(size.y);
        let error = OutOfMemory { bytes: count.saturating_mul(size_of::<T>() as u64) };
        let (mut data, count) = (Vec::new(), usize::try_from(count).map_err(|_| error)?);
        data.try_reserve_exact(count).map_err(|_| error)?;
        data.resize(count, fill);
        Ok(Self { size, data })
    }

    /// A grid over existing rows; `None` if `data` does not have exactly `size.x * size.y` values.
    #[must_use]
    pub fn from_vec(size: UVec2, data: Vec<T>) -> Option<Self> {
        (data.len() as u64 == u64::from(size.x) * u64::from(size.y)).then_some(Self { size, data })
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

    /// Row `y`, mutable.
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

    /// All values, row after row, mutable.
    #[must_use]
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.data
    }
}
