//! A layout of markers under way: a hit may lay its markers out in slices, and they are the same however large those are.

use super::{
    CrackGrowth, GrowthParams, MarkerLayout,
    divide::rim_towards,
    field::MarkerField,
    markers::{self, Cells, Region},
    params::MAX_MARKERS,
};
use crate::pattern::{Dot, Timeline};
use glam::{UVec2, Vec2};
use std::ops::Range;

/// What one hit has still to lay out.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    region: Region,
    seed: u64,
    /// The impact whose nodes alone may win the markers, or any.
    loyal: u32,
    cursor: Cursor,
    darts: Option<Box<Darts>>,
    stress: Option<Stress>,
    /// The next of what gets room for what will grow, once all markers are there.
    room: Option<u32>,
}

/// How far from all that relieves it the surface is, around a hit whose cracks divide domains.
#[derive(Clone, Copy, Debug)]
struct Stress {
    region: Region,
    seed: u64,
    /// Where the markers of an earlier hit are so near, they serve this one as well.
    apart: f32,
}

impl Stress {
    /// The distance of `pos` from the border, which is a crack too, and from the rim, beyond which there is no stress.
    fn relieved(&self, pos: Vec2) -> f32 {
        let Region { center, outer, extent, .. } = self.region;
        let to_rim = rim_towards(pos - center, outer, self.seed) - pos.distance(center);
        pos.min(extent - pos).min_element().min(to_rim)
    }
}

/// How far a layout has come.
#[derive(Clone, Debug, Default)]
pub(super) struct Cursor {
    next: u64,
    /// Places that this slice may still look at.
    left: u32,
    /// Markers that were kept.
    pub(super) kept: u32,
}

impl Cursor {
    /// A slice of so many places.
    pub(super) fn of(places: u32) -> Self {
        Self { left: places, ..Self::default() }
    }

    /// Goes on from where another slice has ended.
    pub(super) const fn go_on(&mut self, from: &Self) {
        self.next = from.next;
    }

    /// Back to the first.
    pub(super) const fn rewind(&mut self) {
        self.next = 0;
    }

    /// Whether the slice has no room for more.
    pub(super) const fn is_spent(&self) -> bool {
        self.left == 0
    }

    /// The next of `all`, as many as the slice has room for at `cost` places each, one at least.
    pub(super) fn slice(&mut self, all: u64, cost: u32) -> Range<u64> {
        let first = self.next.min(all);
        let count = u64::from((self.left / cost.max(1)).max(1)).min(all - first);
        self.next = first + count;
        self.left = self.left.saturating_sub((count as u32).saturating_mul(cost));
        first..self.next
    }

    /// Whether all are done.
    pub(super) const fn is_at(&self, all: u64) -> bool {
        self.next >= all
    }
}

/// What darts must keep their distance from.
#[derive(Clone, Debug)]
struct Darts {
    index: Index,
    side: f32,
    cells: Cells,
    /// Of each cell a bit: whether every place in it is too near to one marker. Darts thrown there need not be looked at.
    covered: Vec<u64>,
    spacing: f32,
    /// Whether darts stay where they are thrown.
    are_still: bool,
    /// Markers of earlier hits, then nodes, that are not in the index yet.
    others: Range<usize>,
}

impl Darts {
    fn new(region: &Region, spacing: f32, are_still: bool, (markers, nodes): (usize, usize)) -> Self {
        let (side, cells) = markers::dart_cells(region, spacing);
        let covered = vec![0; (cells.rows() * u64::from(cells.columns())).div_ceil(64) as usize];
        let index = Index::new(region.extent, spacing, markers);
        Self { index, side, cells, covered, spacing, are_still, others: 0..markers + nodes }
    }

    fn push(&mut self, pos: Vec2) {
        self.index.push(pos);
        if self.are_still {
            self.cover(pos);
        }
    }

    /// Notes the cells that lie within the spacing of a marker altogether.
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

/// The most cells of an index of places.
const MOST_CELLS: f32 = 1_048_576.0;

/// What lies where: small cells, a million at most, each with a list.
#[derive(Clone, Debug)]
struct Index {
    cells: UVec2,
    /// Cells per pattern unit.
    per_unit: Vec2,
    head: Vec<u32>,
    /// Each place, and the one before it in its cell.
    places: Vec<(Vec2, u32)>,
    /// So many of the places are markers, the first ones.
    markers: u32,
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

/// Takes up markers that were laid out.
pub(super) struct Keeper<'a> {
    field: &'a mut MarkerField,
    /// Places to tell, and when they were made, if markers are drawn.
    shown: Option<(&'a mut Vec<Vec2>, &'a mut Timeline, f32)>,
    loyal: u32,
    darts: Option<&'a mut Darts>,
    stress: Option<Stress>,
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
        self.field.add(pos, self.loyal, self.stress.map_or(f32::INFINITY, |stress| stress.relieved(pos)));
        if let Some((shown, timeline, radius)) = &mut self.shown {
            shown.push(pos);
            timeline.add_dot(Dot { pos, radius: *radius });
        }
    }

    /// Keeps a marker that must keep its distance from others, from the markers of earlier hits and from nodes.
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

/// The fewest nodes that a layout makes room for.
const FEW_NODES: usize = 64;

/// For more than so many markers are given room in good time.
const MANY_NODES: usize = 4096;

/// Room for so many nodes costs as much as a place.
const ROOM: u32 = 16;

impl CrackGrowth {
    /// Prepares the layout of an impact for `region`.
    pub(super) fn begin_layout(&mut self, region: Region, (impact, loyal): (u32, u32), seed: u64) {
        let mut darts = None;
        let stress = self.division.is_some().then(|| {
            self.field.settle(&self.network.nodes, &self.nodes);
            let apart = 0.5 * markers::spacing(&self.params, region.extent);
            Stress { region, seed: self.seed ^ u64::from(impact), apart }
        });
        if let MarkerLayout::DartThrowing { spacing } = self.params.markers {
            // Darts keep their distance from the markers of hits that no step has taken up yet, too.
            self.field.settle(&self.network.nodes, &self.nodes);
            let others = (self.field.made_settled(), self.network.nodes.len());
            darts = Some(Box::new(Darts::new(&region, spacing, self.mask.is_empty(), others)));
        }
        self.layout =
            Some(Box::new(Layout { region, seed, loyal, cursor: Cursor::default(), darts, stress, room: None }));
    }

    /// Goes on laying out the markers of a hit that was [begun](Self::begin_hit), at up to about `places` places. Returns whether some are left.
    ///
    /// Where markers come to lie does not depend on the slices. Whatever else is asked of the growth does what is left first.
    pub fn lay_out(&mut self, places: u32) -> bool {
        let Some(mut layout) = self.layout.take() else { return false };
        layout.cursor.left = places;
        if layout.room.is_none() && self.lay_out_markers(&mut layout) {
            layout.room = Some(0);
        }
        let is_left = !layout.room.as_mut().is_some_and(|room| self.make_room(room, &mut layout.cursor));
        self.layout = is_left.then_some(layout);
        is_left
    }

    /// Lays out markers as far as the slice goes. Returns whether those were the last ones.
    fn lay_out_markers(&mut self, layout: &mut Layout) -> bool {
        let Layout { region, seed, loyal, cursor, darts, stress, .. } = layout;
        if let Some(darts) = darts {
            let (count, markers) = (darts.others.len().min(cursor.left as usize), darts.index.markers);
            for _ in 0..count {
                let other = darts.others.start;
                let is_marker = other < markers as usize;
                let node = || self.network.nodes[other - markers as usize].pos;
                darts.push(if is_marker { self.field.marker(other as u32).pos } else { node() });
                darts.others.start += 1;
            }
            cursor.left -= count as u32;
            if !darts.others.is_empty() {
                return false;
            }
        }
        let GrowthParams { draw_markers, line_width, .. } = self.params;
        let mut keeper = Keeper {
            field: &mut self.field,
            shown: draw_markers.then_some((&mut self.shown_markers, &mut self.timeline, line_width)),
            loyal: *loyal,
            darts: darts.as_deref_mut(),
            stress: *stress,
        };
        let wishes = (self.density.as_ref(), &*self.mask);
        // A full field takes none of those that are left.
        let is_full = keeper.field.living_at_most() >= MAX_MARKERS;
        is_full || markers::lay_out(&self.params, *region, wishes, *seed, cursor, &mut keeper)
    }

    /// A large growth makes about two nodes a marker: room for them now, one kind after the other, so that no step pauses to move them
    /// all. Returns whether there is room for all.
    fn make_room(&mut self, next: &mut u32, cursor: &mut Cursor) -> bool {
        let more = (2 * self.field.living_at_most()).max(FEW_NODES).min(self.room());
        while cursor.left > 0 {
            match *next {
                0 if more > MANY_NODES => self.field.reserve(),
                1 => self.network.nodes.reserve(more),
                2 => self.nodes.reserve(more),
                3 => self.widths.reserve(more),
                4 => self.pull_of.reserve(more),
                5 => self.courses.reserve(more),
                6 => self.changes.reserve(more),
                7 => self.timeline.reserve(more),
                8 => self.arrest.iter_mut().for_each(|arrest| arrest.reserve(more)),
                0 => {}
                _ => return true,
            }
            *next += 1;
            cursor.left = cursor.left.saturating_sub(more as u32 / ROOM);
        }
        false
    }

    /// Takes up the markers of hits, up to about so many of them, before the next [`step`](Self::step), which takes up all that are left. Returns
    /// whether it has only to grow.
    ///
    /// What grows does not depend on the slices.
    pub fn prepare_step(&mut self, markers: u32) -> bool {
        !self.lay_out(markers) && self.field.settle_some(&self.network.nodes, &self.nodes, markers)
    }

    /// Whether [`prepare_step`](Self::prepare_step) has begun and is not done. A hit would do the rest of it at once.
    #[cfg_attr(not(feature = "bevy"), expect(dead_code, reason = "surfaces of the plugin are hit"))]
    pub(crate) const fn is_preparing(&self) -> bool {
        self.layout.is_some() || self.field.is_settling()
    }

    /// Whether markers of a hit are still to be laid out.
    #[must_use]
    pub const fn is_laying_out(&self) -> bool {
        self.layout.is_some()
    }

    /// Lays out what is left, and has it settle if it has begun to.
    pub(super) fn finish_layout(&mut self) {
        while self.lay_out(1 << 16) {}
        if self.field.is_settling() {
            self.field.settle(&self.network.nodes, &self.nodes);
        }
    }
}
