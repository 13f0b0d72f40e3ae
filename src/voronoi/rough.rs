//! Bends the lines of a map in small kinks: [`Roughness`].

use super::MapCharts;
use crate::{Grid, OutOfMemory, math::hash_unit, pattern::SurfaceFrame};
use glam::{IVec2, Vec2};

/// Distances between kinks, in units of the largest deviation, and their shares of it. With [`FADE`] two places deviate differently by less than
/// 0.93 of their distance, so that no line crosses another or itself.
const KINKS: [(f32, f32); 2] = [(10.0, 0.7), (3.0, 0.3)];

/// Smallest distance between kinks, texels: finer ones would not show, and take memory.
const FINEST: f32 = 3.0;

/// Over this distance from the border of the surface or of a chart lines deviate less and less, in units of the largest deviation: at the border
/// they stay where they are.
const FADE: f32 = 8.0;

/// Over this distance from the border of a chart what varies with the place in the picture fades, texels: beyond the cut it is another place.
const PICTURE_FADE: f32 = 12.0;

/// How far each place of a map deviates from where it is.
#[derive(Clone, Debug)]
pub(super) struct Roughness {
    /// Texels; 0 = nothing deviates.
    most: f32,
    kinks: Vec<Kinks>,
    size: Vec2,
    /// On charts: how many texels away their border is, 0 at texels beside it, up to where it does not matter.
    border: Option<Grid<u16>>,
}

/// Random vectors at the corners of cells, linear between. Each of their components is at most a share.
#[derive(Clone, Debug)]
struct Kinks {
    /// Cells for each texel.
    frequency: f32,
    columns: usize,
    corners: Vec<Vec2>,
}

impl Kinks {
    fn new(size: Vec2, cell: f32, share: f32, seed: u64) -> Self {
        let frequency = 1.0 / cell;
        let [columns, rows] = (size * frequency).to_array().map(|cells| cells as usize + 2);
        let signed = |axis: u64, at: u64| 2.0 * hash_unit(seed.wrapping_add(axis), at) - 1.0;
        // The same at each place whatever the size of the surface.
        let corner = |row: usize, column: usize| {
            let at = (row as u64) << 32 | column as u64;
            share * Vec2::new(signed(0, at), signed(1, at))
        };
        let corners = (0..rows).flat_map(|row| (0..columns).map(move |column| corner(row, column))).collect();
        Self { frequency, columns, corners }
    }

    fn at(&self, place: Vec2) -> Vec2 {
        let cell = (place * self.frequency).max(Vec2::ZERO);
        let (column, row) = (cell.x as usize, cell.y as usize);
        let part = cell - Vec2::new(column as f32, row as f32);
        let corner = |right: usize, down: usize| {
            self.corners.get((row + down) * self.columns + column + right).copied().unwrap_or_default()
        };
        let top = corner(0, 0).lerp(corner(1, 0), part.x);
        top.lerp(corner(0, 1).lerp(corner(1, 1), part.x), part.y)
    }
}

impl Roughness {
    /// For places that deviate by up to `roughness` pattern units in each direction.
    pub(super) fn new(
        roughness: f32,
        frame: &SurfaceFrame,
        charts: Option<&MapCharts>,
        seed: u64,
    ) -> Result<Self, OutOfMemory> {
        let (most, size) = (roughness * frame.texels_per_unit(), frame.size().as_vec2());
        let reach = ((FADE * most).max(PICTURE_FADE) as u16).saturating_add(2);
        let border = charts.map(|charts| charts.far_from_border(reach)).transpose()?;
        if most <= 0.0 {
            return Ok(Self { most: 0.0, kinks: Vec::new(), size, border });
        }
        let kinks = (0..).zip(KINKS).filter(|(_, (cell, _))| cell * most >= FINEST);
        let kinks =
            kinks.map(|(i, (cell, share))| Kinks::new(size, cell * most, share, seed.wrapping_add(2 * i))).collect();
        Ok(Self { most, kinks, size, border })
    }

    /// Where a place of the map goes if places deviate by this share; texels.
    pub(super) fn moved(&self, place: Vec2, share: f32) -> Vec2 {
        if self.most <= 0.0 {
            return place;
        }
        let share = share * (self.far(place) / (FADE * self.most)).min(1.0);
        place + share * self.most * self.kinks.iter().map(|kinks| kinks.at(place)).sum::<Vec2>()
    }

    /// How much of what varies with the place in the picture there is, 0..=1: less beside the borders of charts.
    pub(super) fn of_picture(&self, place: Vec2) -> f32 {
        self.far_from_cut(place).map_or(1.0, |far| (far / PICTURE_FADE).min(1.0))
    }

    /// Whether places deviate at all.
    pub(super) fn has_kinks(&self) -> bool {
        !self.kinks.is_empty()
    }

    /// The distance to the border.
    fn far(&self, place: Vec2) -> f32 {
        let outer = place.min(self.size - place).min_element().max(0.0);
        self.far_from_cut(place).map_or(outer, |far| outer.min(far))
    }

    /// The distance to the border of the chart, if there are charts.
    fn far_from_cut(&self, place: Vec2) -> Option<f32> {
        let border = self.border.as_ref()?;
        // Linear between the middles of texels.
        let at = (place - 0.5).max(Vec2::ZERO);
        let (first, part) = (at.as_uvec2(), at.fract());
        let far = |right: u32, down: u32| {
            let [x, y] = [(first.x + right, border.size().x), (first.y + down, border.size().y)]
                .map(|(at, size)| at.min(size - 1));
            f32::from(border.get(x, y).unwrap_or(0))
        };
        let top = far(0, 0) + (far(1, 0) - far(0, 0)) * part.x;
        let low = far(0, 1) + (far(1, 1) - far(0, 1)) * part.x;
        Some(top + (low - top) * part.y)
    }
}

impl MapCharts {
    /// How many texels away from the border of its chart each texel is, at most `most`; 0 beside the border.
    fn far_from_border(&self, most: u16) -> Result<Grid<u16>, OutOfMemory> {
        let size = self.frame().size();
        let mut far = Grid::try_new(size, most)?;
        for y in 0..size.y as i32 {
            for (x, far) in (0..size.x as i32).zip(far.row_mut(y as usize)) {
                let corners = [IVec2::ZERO, IVec2::X, IVec2::Y, IVec2::ONE];
                if !corners.into_iter().all(|corner| self.is_whole(IVec2::new(x, y) + corner)) {
                    *far = 0;
                }
            }
        }
        // Steps to all eight texels around: first from above, then from below.
        for back in [false, true] {
            for i in 0..size.y as usize {
                let y = if back { size.y as usize - 1 - i } else { i };
                let before = if back { (y + 1 < size.y as usize).then(|| y + 1) } else { y.checked_sub(1) };
                let beside: Vec<u16> = before.map_or(vec![most; size.x as usize], |row| far.row(row).to_vec());
                let row = far.row_mut(y);
                let mut last = most;
                for j in 0..row.len() {
                    let x = if back { row.len() - 1 - j } else { j };
                    let near = beside[x.saturating_sub(1)..(x + 2).min(row.len())].iter().copied().fold(last, u16::min);
                    row[x] = row[x].min(near.saturating_add(1));
                    last = row[x];
                }
            }
        }
        Ok(far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rng, ops};
    use glam::UVec2;

    /// Two charts side by side, with a wall within the second.
    fn charts(size: UVec2, unit: f32) -> MapCharts {
        let mut chart = Grid::new(size, 0);
        for y in 0..size.y as usize {
            chart.row_mut(y)[size.x as usize / 3..].fill(1);
        }
        let (x, half) = (2 * size.x / 3, size.y / 2);
        let wall = (half..size.y).map(|y| [UVec2::new(x, y), UVec2::new(x + 1, y)]);
        MapCharts::new(chart, unit, 0, Vec::new()).unwrap().with_walls(wall)
    }

    /// Places keep their order: what two places deviate differently is less than what they are apart. None goes further than it may, those at
    /// borders stay, and all stay on their side of them.
    #[test]
    fn places_keep_their_order() {
        let mut rng = Rng::new(3);
        for case in 0..60 {
            let size = UVec2::new(20 + rng.next_u32() % 300, 20 + rng.next_u32() % 200);
            let frame = SurfaceFrame::new(size).unwrap();
            let charts = (case % 2 == 1).then(|| charts(size, frame.texels_per_unit()));
            let roughness = rng.range(0.001, 0.02);
            let rough = Roughness::new(roughness, &frame, charts.as_ref(), case).unwrap();
            let most = roughness * frame.texels_per_unit();
            let (mut farthest, mut most_different) = (0.0f32, 0.0f32);
            for _ in 0..3000 {
                let place = Vec2::new(rng.unit(), rng.unit()) * size.as_vec2();
                let other = place + ops::unit(rng.range(-4.0, 4.0)) * most * rng.range(0.05, 8.0);
                let other = other.clamp(Vec2::ZERO, size.as_vec2());
                let [away, other_away] = [place, other].map(|place| rough.moved(place, 1.0) - place);
                let different = (away - other_away).length() / (place - other).length().max(1.0e-3);
                most_different = most_different.max(different);
                farthest = farthest.max(away.abs().max_element());
                assert!((rough.moved(place, 0.5) - place - 0.5 * away).length() < 1.0e-3);
                let to = place + away;
                assert!(to.cmpge(Vec2::ZERO).all() && to.cmple(size.as_vec2()).all(), "{place} goes to {to}");
                if let Some(charts) = &charts {
                    let [before, after] = [place, to].map(|place| charts.at(place.as_ivec2().min(size.as_ivec2() - 1)));
                    assert_eq!(before, after, "{place} goes to {to}");
                    let wall = (2 * size.x / 3 + 1) as f32;
                    let is_beside = place.y > (size.y / 2) as f32;
                    assert!(!is_beside || (place.x < wall) == (to.x < wall), "{place} goes to {to}, over the wall");
                }
            }
            assert!(most_different < 0.93, "case {case}: {most_different}");
            assert!(
                farthest <= most && (most < 2.0 || charts.is_some() || farthest > 0.4 * most),
                "{farthest} of {most}"
            );
            for at in [0.0, 0.3, 1.0] {
                let end = size.as_vec2();
                for place in [Vec2::new(at * end.x, 0.0), Vec2::new(end.x, at * end.y), Vec2::new(0.0, at * end.y)] {
                    assert_eq!(rough.moved(place, 1.0), place);
                }
            }
        }
    }

    /// The same surface with more texels is bent in the same way.
    #[test]
    fn the_number_of_texels_does_not_matter() {
        let mut rng = Rng::new(4);
        let rough = |scale: u32| {
            let frame = SurfaceFrame::new(UVec2::new(300, 200) * scale).unwrap();
            Roughness::new(0.01, &frame, None, 5).unwrap()
        };
        let (small, large) = (rough(1), rough(3));
        for _ in 0..1000 {
            let place = Vec2::new(300.0 * rng.unit(), 200.0 * rng.unit());
            let [a, b] = [small.moved(place, 1.0), large.moved(3.0 * place, 1.0) / 3.0];
            assert!(a.distance(b) < 1.0e-3, "{place}: {a} and {b}");
        }
        let frame = SurfaceFrame::new(UVec2::new(300, 200)).unwrap();
        let none = Roughness::new(0.0, &frame, None, 5).unwrap();
        assert_eq!(none.moved(Vec2::new(17.3, 9.1), 1.0), Vec2::new(17.3, 9.1));
    }
}
