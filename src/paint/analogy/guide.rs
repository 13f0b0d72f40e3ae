//! The guide of the surface: its cracks, and the ramp that they give.

use super::{
    atlas::mean,
    examples::Examples,
    level::Level,
    ramp,
    region::{Region, Span},
    widen,
};
use crate::raster::TexelRect;
use glam::{IVec2, UVec2};
use std::collections::VecDeque;

/// The ramp is computed in runs of tiles of `2^LOG_TILE` texels a side.
const LOG_TILE: u32 = 5;

/// New cracks in a rectangle.
#[derive(Clone, Debug)]
pub(super) struct NewCracks {
    pub(super) rect: TexelRect,
    /// Of the rectangle, row after row.
    pub(super) is_crack: Vec<bool>,
}

/// What one call takes over.
pub(super) type Change = Vec<NewCracks>;

/// Work on the guide for one change.
#[derive(Clone, Debug)]
pub(super) struct GuideWork {
    bands: VecDeque<TexelRect>,
    changed: Vec<Span>,
}

impl GuideWork {
    /// Writes the new cracks. The ramp can change up to `reach` texels around them.
    pub(super) fn new(change: &Change, cracks: &mut [bool], size: UVec2, examples: &Examples) -> Self {
        let mut spans = Vec::new();
        for NewCracks { rect, is_crack } in change {
            let width = rect.size().x as usize;
            for (y, row) in (rect.min.y..rect.max.y).zip(is_crack.chunks_exact(width.max(1))) {
                let start = (y * size.x + rect.min.x) as usize;
                cracks[start..start + width].copy_from_slice(row);
                spans.push(Span { y, start: rect.min.x, end: rect.max.x });
            }
        }
        let params = &examples.params;
        let around = Region::new(spans).grown(params.reach + widen::reach(examples.thin()), size, params.is_tileable);
        Self { bands: around.tiles(LOG_TILE, size).into(), changed: Vec::new() }
    }

    /// Texels of the ramp that are left.
    pub(super) fn left(&self) -> u64 {
        self.bands.iter().map(TexelRect::area).sum()
    }

    /// Computes a band of the ramp; returns its texels, none if all is done.
    pub(super) fn step(&mut self, level: &mut Level, cracks: &[bool], examples: &Examples) -> Option<u64> {
        let band = self.bands.pop_front()?;
        let size = level.size;
        let is_crack = |x: u32, y: u32| cracks[(y * size.x + x) as usize];
        let ramp = ramp::ramp(size, band, examples.params.reach, examples.thin(), level.wraps, is_crack);
        let (deepest, farthest) = examples.atlases.first().map_or((0, 255), |atlas| (atlas.deepest, atlas.farthest));
        for (y, row) in (band.min.y..band.max.y).zip(ramp.chunks_exact(band.size().x as usize)) {
            for (x, value) in (band.min.x..).zip(row.iter().map(|&value| value.clamp(deepest, farthest))) {
                let texel = &mut level.texels[(y * size.x + x) as usize];
                if texel[3] != value {
                    texel[3] = value;
                    match self.changed.last_mut() {
                        Some(last) if last.y == y && last.end == x => last.end = x + 1,
                        _ => self.changed.push(Span { y, start: x, end: x + 1 }),
                    }
                }
            }
        }
        Some(band.area())
    }

    /// Takes the ramp to all levels; returns the texels at full size whose guide has changed.
    pub(super) fn finish(self, levels: &mut [Level], examples: &Examples) -> Region {
        let changed = Region::new(self.changed);
        let Some(first) = levels.first_mut() else { return changed };
        if examples.params.orientation > 0.0 {
            orient(first, &changed.grown(1, first.size, first.wraps), examples.given);
        }
        shrink(levels, &changed, if examples.params.orientation > 0.0 { 1 } else { 0 });
        changed
    }
}

/// Computes the orientation of texels.
fn orient(level: &mut Level, region: &Region, given: usize) {
    for span in region.spans() {
        for x in span.start..span.end {
            let value = |texel: IVec2| level.texels[level.index(level.inside(texel))][3];
            let way = ramp::orientation(value, UVec2::new(x, span.y).as_ivec2());
            let at = level.index(UVec2::new(x, span.y)) * level.channels + given;
            level.extras[at..at + 2].copy_from_slice(&way);
        }
    }
}

/// Takes the guide of texels, and of those up to `by` around them, from each level to the next smaller one.
pub(super) fn shrink(levels: &mut [Level], changed: &Region, by: u32) {
    let Some(first) = levels.first() else { return };
    let mut region = changed.grown(by, first.size, first.wraps);
    for at in 1..levels.len() {
        region = region.halved();
        let (finer, rest) = levels.split_at_mut(at);
        let (Some(finer), Some(level)) = (finer.last(), rest.first_mut()) else { return };
        for span in region.spans() {
            for x in span.start..span.end {
                let texel = UVec2::new(x, span.y);
                let corners = [[0, 0], [1, 0], [0, 1], [1, 1]]
                    .map(|corner| finer.index((2 * texel + UVec2::from(corner)).min(finer.size - 1)));
                let to = level.index(texel);
                let [ramp] = mean(corners.map(|corner| [finer.texels[corner][3]]));
                level.texels[to][3] = ramp;
                for channel in 0..level.channels {
                    let [value] = mean(corners.map(|corner| [finer.extras[corner * finer.channels + channel]]));
                    level.extras[to * level.channels + channel] = value;
                }
            }
        }
    }
}
