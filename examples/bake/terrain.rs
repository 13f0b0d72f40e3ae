//! Digital elevation models: a 16-bit picture and a JSON text beside it.

use bevy_crack::{
    Grid,
    pattern::SurfaceFrame,
    relief::{Contours, ReliefError, Ring, outlines},
};
use glam::{UVec2, Vec2};
use std::{error::Error, fs, path::Path};

/// Real ground.
pub(crate) struct Terrain {
    /// Height of each texel, pattern units.
    pub(crate) heights: Grid<f32>,
    pub(crate) frame: SurfaceFrame,
    pub(crate) metres_per_unit: f32,
}

impl Terrain {
    /// Reads a model and makes its texels square. Heights are above the lowest place.
    pub(crate) fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        let picture = image::open(path)?.into_luma16();
        let about: serde_json::Value = serde_json::from_str(&fs::read_to_string(path.with_extension("json"))?)?;
        let number = |name: &str| about[name].as_f64().ok_or(format!("`{name}` is missing"));
        let (scale, across, down) = (number("scale_m")? as f32, number("pixel_x_m")?, number("pixel_y_m")?);
        let size = UVec2::from(picture.dimensions());
        let texel = across.min(down);
        let length = |n: u32, metres: f64| (f64::from(n) * metres / texel).round() as u32;
        let square = UVec2::new(length(size.x, across), length(size.y, down));
        let metres = Grid::from_vec(size, picture.into_raw()).ok_or("a picture of another size")?;
        let frame = SurfaceFrame::new(square)?;
        let metres_per_unit = frame.texels_per_unit() * texel as f32;
        let heights = resampled(&metres, square, |value| f32::from(value) * scale / metres_per_unit);
        Ok(Self { heights, frame, metres_per_unit })
    }

    /// Contour lines at `count` even steps between the lowest and the highest place, and the step. Level 0 lies one
    /// step above the lowest place.
    pub(crate) fn contours(&self, count: u16) -> Result<(Contours, f32), ReliefError> {
        let highest = self.heights.as_slice().iter().copied().fold(0.0, f32::max);
        let step = highest / f32::from(count + 1);
        let mut rings = Vec::new();
        for level in 0..i32::from(count) {
            let lines = outlines(&self.heights, step * (level + 1) as f32)?;
            rings.extend(lines.into_iter().map(|points| Ring { points, level }));
        }
        let length: f32 = rings.iter().map(|ring| length(&ring.points)).sum();
        let extent = self.frame.extent();
        Ok((Contours { rings, distance: extent.x * extent.y / length.max(1.0) }, step))
    }
}

/// Length of a closed line.
pub(crate) fn length(points: &[Vec2]) -> f32 {
    points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| a.distance(*b)).sum()
}

/// A grid of another size, by bilinear interpolation.
pub(crate) fn resampled<T: Copy>(grid: &Grid<T>, size: UVec2, value: impl Fn(T) -> f32) -> Grid<f32> {
    let ratio = grid.size().as_vec2() / size.as_vec2();
    let last = (grid.size() - 1).as_vec2();
    let mut out = Grid::new(size, 0.0);
    for y in 0..size.y {
        for (x, out) in (0..).zip(out.row_mut(y as usize)) {
            let at = ((Vec2::new(x as f32, y as f32) + 0.5) * ratio - 0.5).clamp(Vec2::ZERO, last);
            let (low, share) = (at.floor(), at - at.floor());
            let (left, above) = (low.x as usize, low.y as usize);
            let right = (left + 1).min(last.x as usize);
            let rows = [grid.row(above), grid.row((above + 1).min(last.y as usize))];
            let [above, below] = rows.map(|row| {
                let [left, right] = [value(row[left]), value(row[right])];
                left + (right - left) * share.x
            });
            *out = above + (below - above) * share.y;
        }
    }
    out
}
