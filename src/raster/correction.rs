//! [`SlopeCorrection`]: small slopes that make the normals around cracks those of one surface.

use super::{DirtyTiles, TexelRect};
use crate::Grid;
use glam::UVec2;

/// Slopes that are added to a surface's own normals in a rectangle of a [`DepthField`](super::DepthField), and none
/// outside of it. They are made by [`solve_correction`](crate::blend::solve_correction).
///
/// ```
/// use bevy_crack::{Grid, blend::solve_correction, pattern::SurfaceFrame, raster::{DepthField, SlopeCorrection}};
/// use std::sync::Arc;
///
/// // A slope with a crack across it.
/// let normals = [170, 128, 240, 255].repeat(64 * 64);
/// let mut depth = Grid::new([64, 64].into(), 0);
/// depth.row_mut(32).fill(u16::MAX);
/// let correction = solve_correction(&normals, [64, 64].into(), [0, 0].into(), &depth)?.expect("there is a slope");
/// let rect = correction.rect();
/// assert!(!rect.is_empty());
/// assert_eq!(correction.at(rect.max.x, rect.max.y), [0.0, 0.0]);
/// // Its texels are to be painted again when a field gets it.
/// let changes = SlopeCorrection::changes(None, Some(&correction), [64, 64].into());
/// assert!(changes.iter().all(|change| !change.intersect(rect).is_empty()));
/// let mut field = DepthField::new(SurfaceFrame::new([64, 64].into())?);
/// field.depth = depth;
/// field.correct(Some(Arc::new(correction)));
/// assert_eq!(field.correction().map(|correction| correction.rect()), Some(rect));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SlopeCorrection {
    min: UVec2,
    /// To the right and down, in units of [`UNIT`](Self::UNIT).
    slopes: Grid<[i16; 2]>,
}

impl SlopeCorrection {
    /// One step of a stored slope: an eighth of a step of a normal map's bytes.
    pub(crate) const UNIT: f32 = 1.0 / 1024.0;

    pub(crate) const fn new(min: UVec2, slopes: Grid<[i16; 2]>) -> Self {
        Self { min, slopes }
    }

    /// The texels that it corrects.
    #[must_use]
    pub fn rect(&self) -> TexelRect {
        TexelRect { min: self.min, max: self.min + self.slopes.size() }
    }

    /// The slope that is added at a texel: how far the normal leans to the right and down the picture, as a share of
    /// its height; zero outside of [`rect`](Self::rect).
    #[must_use]
    pub fn at(&self, x: u32, y: u32) -> [f32; 2] {
        let found = x.checked_sub(self.min.x).zip(y.checked_sub(self.min.y)).and_then(|(x, y)| self.slopes.get(x, y));
        found.unwrap_or_default().map(|steps| f32::from(steps) * Self::UNIT)
    }

    /// Copies the steps of a row from texel `(x, y)` on; they are zero outside.
    pub(crate) fn read_row(&self, x: u32, y: u32, out: &mut [[i16; 2]]) {
        out.fill([0; 2]);
        let wanted = TexelRect { min: UVec2::new(x, y), max: UVec2::new(x + out.len() as u32, y + 1) };
        let both = wanted.intersect(self.rect());
        if !both.is_empty() {
            let row = self.slopes.row((y - self.min.y) as usize);
            let (from, to) = ((both.min.x - self.min.x) as usize, (both.min.x - x) as usize);
            let n = both.size().x as usize;
            out[to..to + n].copy_from_slice(&row[from..from + n]);
        }
    }

    /// Rectangles around all texels of a field of `size` at which two corrections differ.
    #[must_use]
    pub fn changes(before: Option<&Self>, after: Option<&Self>, size: UVec2) -> Vec<TexelRect> {
        let rect_of = |of: Option<&Self>| of.map(Self::rect).unwrap_or_default();
        let rect = rect_of(before).union(rect_of(after)).intersect(TexelRect::whole(size));
        let mut dirty = DirtyTiles::new(size);
        let tile = DirtyTiles::TILE;
        for y in rect.min.y..rect.max.y {
            for x in (rect.min.x / tile * tile..rect.max.x).step_by(tile as usize) {
                let [a, b] = [before, after].map(|of| {
                    let mut steps = [[0; 2]; DirtyTiles::TILE as usize];
                    of.inspect(|of| of.read_row(x, y, &mut steps));
                    steps
                });
                if a != b {
                    dirty.mark(TexelRect { min: UVec2::new(x, y), max: UVec2::new(x + tile, y + 1) });
                }
            }
        }
        let mut rects = Vec::new();
        dirty.take_rects(&mut rects);
        rects
    }
}
