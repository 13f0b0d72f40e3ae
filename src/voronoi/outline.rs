//! How broad the strokes of a guide are: [`Outline`].

use super::strokes::INK;
use crate::Grid;

/// Mean widths of strokes that are narrow and of those that are broad, texels. Small letters with narrow strokes cannot be read if cracks wander.
const WIDTHS: [f32; 2] = [18.0, 32.0];

/// Mean steps along the axes for each texel of an outline, over all directions: 4 / π.
const STEPS: f32 = 4.0 / std::f32::consts::PI;

/// Area and outline of the strokes of a guide, counted row by row.
#[derive(Clone, Debug, Default)]
pub(super) struct Outline {
    area: u64,
    steps: u64,
}

impl Outline {
    /// Counts row `y`, after the one above it.
    pub(super) fn add_row(&mut self, values: &Grid<u16>, y: usize) {
        let row = values.row(y);
        let above = if y == 0 { row } else { values.row(y - 1) };
        let is_ink = |value: &u16| *value >= INK;
        self.area += row.iter().filter(|value| is_ink(value)).count() as u64;
        self.steps += row.iter().zip(above).filter(|(a, b)| is_ink(a) != is_ink(b)).count() as u64;
        self.steps += row.iter().zip(row.iter().skip(1)).filter(|(a, b)| is_ink(a) != is_ink(b)).count() as u64;
    }

    /// Mean width of the strokes, texels: twice their area by the length of their outline.
    fn width(&self) -> f32 {
        2.0 * self.area as f32 * STEPS / self.steps.max(1) as f32
    }

    /// How broad the strokes are: 0 if cracks must not wander in them, 1 if they may.
    pub(super) fn breadth(&self) -> f32 {
        let [narrow, broad] = WIDTHS;
        ((self.width() - narrow) / (broad - narrow)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;

    #[test]
    fn widths_of_bars_and_discs() {
        let of = |size: UVec2, is_ink: &dyn Fn(f32, f32) -> bool| {
            let mut values = Grid::new(size, 0);
            let mut outline = Outline::default();
            for y in 0..size.y {
                for (x, value) in (0u32..).zip(values.row_mut(y as usize)) {
                    *value = if is_ink(x as f32 + 0.5, y as f32 + 0.5) { INK } else { INK - 1 };
                }
                outline.add_row(&values, y as usize);
            }
            outline
        };
        // A bar from top to bottom has two sides, whose steps are along an axis.
        let bar = of(UVec2::new(90, 400), &|x, _| (40.0..50.0).contains(&x));
        assert!((bar.width() - 10.0 * STEPS).abs() < 1.0e-3, "{}", bar.width());
        // A disc of radius r: 2 pi r^2 / 2 pi r.
        let disc = of(UVec2::splat(200), &|x, y| (x - 100.0).hypot(y - 100.0) < 60.0);
        assert!((disc.width() / 60.0 - 1.0).abs() < 0.02, "{}", disc.width());
        assert_eq!((Outline::default().width(), Outline::default().breadth()), (0.0, 0.0));
        assert_eq!(disc.breadth(), 1.0);
    }
}
