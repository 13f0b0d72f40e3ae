//! What an analogy gives: colours, other maps of the photographs, and where each texel comes from.

use super::{error::AnalogyError, pair::check_size, ramp::distance, state::Analogy};
use crate::{Grid, raster::TexelRect};
use glam::UVec2;

/// Where a texel comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TexelSource {
    /// Index of the pair; [`TexelSource::NONE`] where nothing has been made yet.
    pub pair: u16,
    /// Column and row in its photograph.
    pub texel: [u16; 2],
}

impl TexelSource {
    /// [`pair`](Self::pair) of a texel that has not been made.
    pub const NONE: u16 = u16::MAX;
}

impl Analogy {
    /// Where a texel comes from; `None` outside of the surface.
    #[must_use]
    pub fn source(&self, x: u32, y: u32) -> Option<TexelSource> {
        let level = self.full();
        let texel = UVec2::new(x, y);
        texel.cmplt(level.size).all().then(|| self.source_of(level.index(texel)))
    }

    /// Where each texel comes from.
    #[must_use]
    pub fn sources(&self) -> Grid<TexelSource> {
        let all = (0..self.full().places.len()).map(|index| self.source_of(index)).collect();
        let nothing = TexelSource { pair: TexelSource::NONE, texel: [0; 2] };
        Grid::from_vec(self.size(), all).unwrap_or_else(|| Grid::new(self.size(), nothing))
    }

    fn source_of(&self, index: usize) -> TexelSource {
        let (pair, texel) = self.examples().texel(self.full().places[index]);
        TexelSource {
            pair: u16::try_from(pair).unwrap_or(TexelSource::NONE),
            texel: texel.to_array().map(|at| at as u16),
        }
    }

    /// The guide `B`: 255 at [`AnalogyParams::reach`](super::AnalogyParams::reach) or more from all cracks, 128 at
    /// their edges, 0 that deep inside; limited to values that enough texels of the photographs have. As of the last work
    /// that was begun.
    #[must_use]
    pub fn ramp(&self) -> Grid<u8> {
        let ramp = self.full().texels.iter().map(|texel| texel[3]).collect();
        Grid::from_vec(self.size(), ramp).unwrap_or_else(|| Grid::new(self.size(), 255))
    }

    /// Whether a texel is in a crack or beside one: nearer than [`AnalogyParams::reach`](super::AnalogyParams::reach), and
    /// than the ground of the photographs that is farthest from cracks. As of the last work that was begun; false outside of the surface.
    #[must_use]
    pub fn is_near_crack(&self, x: u32, y: u32) -> bool {
        let (level, texel) = (self.full(), UVec2::new(x, y));
        texel.cmplt(level.size).all() && level.texels[level.index(texel)][3] < self.examples().atlases[0].farthest
    }

    /// The share of texels whose distance from the edge of a crack differs by less than `tolerance` from that of their
    /// source, 0..=1. Distances are as in the guide: within the reach, and of `tolerance` 1 from one end to the other.
    #[must_use]
    pub fn agreement(&self, tolerance: f32) -> f32 {
        let level = self.full();
        let agrees = |(texel, &place): (&[u8; 4], &u32)| {
            let found = self.examples().ramp_at(place).map(distance);
            found.is_some_and(|found| (found - distance(texel[3])).abs() < 2.0 * tolerance)
        };
        let count = level.texels.iter().zip(&level.places).filter(|&pair| agrees(pair)).count();
        count as f32 / level.texels.len() as f32
    }

    /// The colour of a texel, RGBA8, sRGB; zero where nothing has been made yet, and outside of the surface.
    #[must_use]
    pub fn color(&self, x: u32, y: u32) -> [u8; 4] {
        let texel = UVec2::new(x, y);
        if texel.cmpge(self.size()).any() {
            return [0; 4];
        }
        self.examples().color(self.full().places[self.full().index(texel)])
    }

    /// The colours: `B'`.
    #[must_use]
    pub fn colors(&self) -> Grid<[u8; 4]> {
        let mut colors = Grid::new(self.size(), [0; 4]);
        self.paint_into(TexelRect::whole(self.size()), colors.as_mut_slice().as_flattened_mut());
        colors
    }

    /// Writes the colours in a rectangle into the RGBA8 texels of an image of the surface's size. A slice that is
    /// shorter is left unchanged.
    pub fn paint_into(&self, rect: TexelRect, rgba: &mut [u8]) {
        let rect = rect.intersect(TexelRect::whole(self.size()));
        let texels = rgba.as_chunks_mut::<4>().0;
        if texels.len() < self.full().places.len() {
            return;
        }
        for y in rect.min.y..rect.max.y {
            let start = self.full().index(UVec2::new(rect.min.x, y));
            let row = start..start + rect.size().x as usize;
            for (out, &place) in texels[row.clone()].iter_mut().zip(&self.full().places[row]) {
                *out = self.examples().color(place);
            }
        }
    }

    /// Another map that belongs to the photographs, such as heights or normals, copied from the same texels. `maps` has
    /// one for each pair; texels that have not been made get `nothing`.
    ///
    /// # Errors
    /// [`AnalogyError`] if there is not one map for each pair, or one has another size than its photograph.
    pub fn carry<T: Copy>(&self, maps: &[&Grid<T>], nothing: T) -> Result<Grid<T>, AnalogyError> {
        let mut out = Grid::new(self.size(), nothing);
        self.carry_into(maps, TexelRect::whole(self.size()), &mut out)?;
        Ok(out)
    }

    /// Like [`carry`](Self::carry), inside a rectangle; texels that have not been made are left unchanged.
    ///
    /// # Errors
    /// As [`carry`](Self::carry), and if `out` does not have the size of the surface.
    pub fn carry_into<T: Copy>(
        &self,
        maps: &[&Grid<T>],
        rect: TexelRect,
        out: &mut Grid<T>,
    ) -> Result<(), AnalogyError> {
        check_size("out", out.size(), self.size())?;
        let sizes: Vec<UVec2> = self.examples().sizes().collect();
        if maps.len() != sizes.len() {
            return Err(AnalogyError::MapCount { count: maps.len(), expected: sizes.len() });
        }
        for (map, size) in maps.iter().zip(sizes) {
            check_size("map", map.size(), size)?;
        }
        let rect = rect.intersect(TexelRect::whole(self.size()));
        for y in rect.min.y..rect.max.y {
            let start = self.full().index(UVec2::new(0, y));
            let columns = rect.min.x as usize..rect.max.x as usize;
            for (x, out) in columns.clone().zip(&mut out.row_mut(y as usize)[columns]) {
                let (pair, texel) = self.examples().texel(self.full().places[start + x]);
                if let Some(value) = maps.get(pair).and_then(|map| map.get(texel.x, texel.y)) {
                    *out = value;
                }
            }
        }
        Ok(())
    }
}
