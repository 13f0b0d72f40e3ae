//! The pending markers of a hit, and which markers are kept.

use super::{
    cursor::Cursor,
    division::rim_towards,
    field::MarkerField,
    params::MAX_MARKERS,
    region::{Cells, Region, dart_cells},
};
use crate::pattern::{Dot, Timeline};
use glam::{UVec2, Vec2};
use std::ops::Range;

/// The markers that one hit has still to lay out.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) region: Region,
    pub(super) seed: u64,
    /// The impact whose nodes may win the markers, or any.
    pub(super) owner: u32,
    pub(super) cursor: Cursor,
    pub(super) darts: Option<Box<Darts>>,
    pub(super) stress: Option<Stress>,
    /// The next array to reserve memory for, once all markers are there.
    pub(super) room: Option<u32>,
}

/// Distance of the surface from everything that relieves stress, around a hit whose cracks divide domains.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stress {
    pub(super) region: Region,
    pub(super) seed: u64,
    /// If markers of an earlier hit are this near, they serve this hit as well.
    pub(super) apart: f32,
}

impl Stress {
    /// The distance of `pos` from the border, which counts as a crack, and from the rim, beyond which there is no
    /// stress.
    fn relieved(&self, pos: Vec2) -> f32 {
        let Region { center, outer, extent, .. } = self.region;
        let to_rim = rim_towards(pos - center, outer, self.seed) - pos.distance(center);
        pos.min(extent - pos).min_element().min(to_rim)
    }
}

/// The places from which darts must keep their distance.
#[derive(Clone, Debug)]
pub(super) struct Darts {
    pub(super) index: Index,
    side: f32,
    cells: Cells,
    /// One bit per cell: whether every place in it is too near to one marker. Darts thrown there are skipped.
    covered: Vec<u64>,
    spacing: f32,
    /// Whether darts stay where they are thrown (there is no mask that moves them).
    are_still: bool,
    /// Markers of earlier hits, then nodes, that are not in the index yet.
    pub(super) others: Range<usize>,
}

impl Darts {
    pub(super) fn new(region: &Region, spacing: f32, are_still: bool, (markers, nodes): (usize, usize)) -> Self {
        let (side, cells) = dart_cells(region, spacing);
        let covered = vec![0; (cells.rows() * u64::from(cells.columns())).div_ceil(64) as usize];
        let index = Index::new(region.extent, spacing, markers);
        Self { index, side, cells, covered, spacing, are_still, others: 0..markers + nodes }
    }

    pub(super) fn push(&mut self, pos: Vec2) {
        self.index.push(pos);
        if self.are_still {
            self.cover(pos);
        }
    }

    /// Marks the cells that lie completely within the spacing of a marker.
    fn cover(&mut self, pos: Vec2) {
        // Less for rounding.
        let limit = 0.999 * self.spacing;
        let near = |at: f32, (low, high): (u32, u32)| {
            let cell = (at / self.side) as u32;
            cell.saturating_sub(1).max(low)..(cell + 2).min(high)
        };
        for y in near(pos.y, self.cells.y) {
            for x in near(pos.x, self.cells.x) {
                let middle = (Vec2::new(x as f32, y as f32) + 0.5) * self.side;
                let furthest = (pos - middle).abs() + 0.5 * self.side;
                if furthest.length_squared() < limit * limit {
                    let cell =
                        u64::from(y - self.cells.y.0) * u64::from(self.cells.columns()) + u64::from(x - self.cells.x.0);
                    self.covered[(cell / 64) as usize] |= 1 << (cell % 64);
                }
            }
        }
    }
}

/// No place.
const NONE: u32 = u32::MAX;

/// The largest number of cells of an index of places.
const MOST_CELLS: f32 = 1_048_576.0;

/// An index of places: small cells, a million at most, each with a list.
#[derive(Clone, Debug)]
pub(super) struct Index {
    cells: UVec2,
    /// Cells per pattern unit.
    per_unit: Vec2,
    head: Vec<u32>,
    /// Each place, and the previous one in its cell.
    places: Vec<(Vec2, u32)>,
    /// Number of places that are markers; these come first.
    pub(super) markers: u32,
}

impl Index {
    fn new(extent: Vec2, side: f32, markers: usize) -> Self {
        let side = side.max((extent.x * extent.y / MOST_CELLS).sqrt()).max(extent.max_element() / MOST_CELLS);
        let cells = (extent / side).ceil().as_uvec2().max(UVec2::ONE);
        let head = vec![NONE; cells.x as usize * cells.y as usize];
        Self { cells, per_unit: cells.as_vec2() / extent, head, places: Vec::new(), markers: markers as u32 }
    }

    fn cell_at(&self, pos: Vec2) -> UVec2 {
        (pos * self.per_unit).max(Vec2::ZERO).as_uvec2().min(self.cells - UVec2::ONE)
    }

    fn push(&mut self, pos: Vec2) {
        let cell = self.cell_at(pos);
        let slot = cell.y as usize * self.cells.x as usize + cell.x as usize;
        let place = self.places.len() as u32;
        self.places.push((pos, std::mem::replace(&mut self.head[slot], place)));
    }

    /// Whether a marker lies nearer than `distance` to `pos`, or a node or dart no further.
    fn any_within(&self, pos: Vec2, distance: f32) -> bool {
        let (low, high) = (self.cell_at(pos - distance), self.cell_at(pos + distance));
        let limit = distance * distance;
        for y in low.y..=high.y {
            let row = y as usize * self.cells.x as usize;
            for &head in &self.head[row + low.x as usize..=row + high.x as usize] {
                let mut place = head;
                while place != NONE {
                    let (other, before) = self.places[place as usize];
                    let distance_sq = other.distance_squared(pos);
                    if distance_sq < limit || (distance_sq == limit && place >= self.markers) {
                        return true;
                    }
                    place = before;
                }
            }
        }
        false
    }
}

/// Collects the markers that were laid out.
pub(super) struct Keeper<'a> {
    pub(super) field: &'a mut MarkerField,
    /// The list of shown markers, the timeline and the line width, if markers are drawn.
    pub(super) shown: Option<(&'a mut Vec<Vec2>, &'a mut Timeline, f32)>,
    pub(super) owner: u32,
    pub(super) darts: Option<&'a mut Darts>,
    pub(super) stress: Option<Stress>,
}

impl Keeper<'_> {
    /// Keeps a marker.
    pub(super) fn keep(&mut self, pos: Vec2) {
        if self.field.living_at_most() >= MAX_MARKERS {
            return;
        }
        if self.stress.is_some_and(|stress| self.field.any_within(pos, stress.apart)) {
            return;
        }
        self.field.add(pos, self.owner, self.stress.map_or(f32::INFINITY, |stress| stress.relieved(pos)));
        if let Some((shown, timeline, radius)) = &mut self.shown {
            shown.push(pos);
            timeline.add_dot(Dot { pos, radius: *radius });
        }
    }

    /// Keeps a marker if it is far enough from others, from the markers of earlier hits and from nodes.
    pub(super) fn throw(&mut self, pos: Vec2, spacing: f32) {
        let is_full = self.field.living_at_most() >= MAX_MARKERS;
        let Some(darts) = self.darts.as_mut().filter(|_| !is_full) else { return };
        if !darts.index.any_within(pos, spacing) {
            darts.push(pos);
            self.keep(pos);
        }
    }

    /// Whether a dart thrown into this cell is too near to a marker wherever it falls.
    #[inline]
    pub(super) fn is_covered(&self, cell: u64) -> bool {
        let Some(darts) = &self.darts else { return false };
        darts.covered.get((cell / 64) as usize).is_some_and(|word| word >> (cell % 64) & 1 == 1)
    }
}
