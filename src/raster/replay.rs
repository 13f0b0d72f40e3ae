//! [`Replay`]: a depth field that shows a network at any time.

use super::{DepthField, Profile, TexelRect, stamp_dot, stamp_path};
use crate::{
    Grid,
    pattern::{Entries, Moment, NO_PARENT, Network, SegmentId, Timeline},
};
use glam::{UVec2, Vec2};

/// Depth of the discs that represent markers.
pub const DOT_DEPTH: f32 = 0.5;

/// Side of a tile, texels: changes are cleared and drawn again in whole tiles.
const TILE: u32 = 8;

/// Side of a cell of the index, tiles.
const CELL: u32 = 4;

const NONE: u32 = u32::MAX;

/// Shows a network in a [`DepthField`] as it was at any [`Moment`].
///
/// The field depends only on the moment, bit for bit, and not on the moments shown before: tiles under a change are
/// cleared, and everything that touches them is stamped again. At the end of the timeline the field equals the result
/// of stamping every segment once. A move costs in proportion to the changes between the two moments, not to the
/// network.
///
/// ```
/// use bevy_crack::{
///     growth::{CrackGrowth, GrowthParams},
///     pattern::{Moment, SurfaceFrame},
///     raster::{DepthField, Profile, ReplayChanges, Replay},
/// };
///
/// let frame = SurfaceFrame::new([256, 256].into())?;
/// let mut growth = CrackGrowth::new(GrowthParams::default(), frame.extent(), 7)?;
/// growth.hit([0.5, 0.5].into(), 1.0);
/// while growth.step().grew() {}
///
/// let (mut field, mut redrawn) = (DepthField::new(frame), ReplayChanges::default());
/// let mut replay = Replay::new(frame.size(), Profile::default());
/// let mut show = |field: &mut _, steps| {
///     replay.show(field, growth.network(), growth.timeline(), Moment::nearest(steps), &mut redrawn);
/// };
/// show(&mut field, 10.5);
/// let halfway = field.clone();
/// show(&mut field, 14.0);
/// assert_ne!(field, halfway);
/// show(&mut field, 10.5);
/// assert_eq!(field, halfway);
/// show(&mut field, 0.0);
/// assert_eq!(field, DepthField::new(frame));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Replay {
    size: UVec2,
    profile: Profile,
    at: Moment,
    /// Whether the field may have any content and must be redrawn.
    is_stale: bool,
    /// The entries of the timeline that are in the index.
    seen: Entries,
    parts: Vec<Part>,
    /// Part, first child and next sibling of each node.
    nodes: Vec<TreeLinks>,
    /// The part of each link and dot.
    links: Vec<u32>,
    dots: Vec<u32>,
    cells: Vec<Vec<u32>>,
    tiles: UVec2,
    /// Per tile and cell: the last move that marked it.
    tile_marks: Vec<u32>,
    cell_marks: Vec<u32>,
    /// Number of the move.
    turn: u32,
    /// Marked tiles, how many of them are done, and their texels before the move.
    marked: Vec<u32>,
    drawn: usize,
    before: Vec<[u16; (TILE * TILE) as usize]>,
    /// The veil texels of those tiles before the move, if there are veils.
    veils_before: Vec<[u8; (TILE * TILE) as usize]>,
}

#[derive(Clone, Copy, Debug)]
struct TreeLinks {
    part: u32,
    child: u32,
    sibling: u32,
}

/// A segment or a dot.
#[derive(Clone, Copy, Debug)]
struct Part {
    what: What,
    /// Contains all texels that it has ever stamped.
    rect: TexelRect,
    /// The last move that changed it, and the last that visited it.
    changed: u32,
    visited: u32,
}

#[derive(Clone, Copy, Debug)]
enum What {
    Segment(SegmentId),
    Dot(u32),
}

/// The result of a move of a [`Replay`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReplayChanges {
    /// Tiles that were cleared and drawn again; disjoint.
    pub cleared: Vec<TexelRect>,
    /// The rectangle of each segment that was stamped.
    pub stamped: Vec<TexelRect>,
    /// The texels that differ from before: first those of depths, as disjoint rectangles that each lie within a tile,
    /// then those of cells that have closed or opened, and of hits.
    pub changed: Vec<TexelRect>,
}

impl ReplayChanges {
    fn clear(&mut self) {
        self.cleared.clear();
        self.stamped.clear();
        self.changed.clear();
    }
}

impl Replay {
    /// A replay for an untouched field of `size` texels; cracks have the cross-section `profile`.
    #[must_use]
    pub fn new(size: UVec2, profile: Profile) -> Self {
        let tiles = UVec2::new(size.x.div_ceil(TILE), size.y.div_ceil(TILE));
        let cells = UVec2::new(tiles.x.div_ceil(CELL), tiles.y.div_ceil(CELL));
        let count = |grid: UVec2| grid.x as usize * grid.y as usize;
        Self {
            size,
            profile,
            at: Moment::START,
            is_stale: false,
            seen: Entries::default(),
            parts: Vec::new(),
            nodes: Vec::new(),
            links: Vec::new(),
            dots: Vec::new(),
            cells: vec![Vec::new(); count(cells)],
            tiles,
            tile_marks: vec![0; count(tiles)],
            cell_marks: vec![0; count(cells)],
            turn: 0,
            marked: Vec::new(),
            drawn: 0,
            before: Vec::new(),
            veils_before: Vec::new(),
        }
    }

    /// A replay for a field with any content: the first move redraws all of it.
    ///
    /// ```
    /// use bevy_crack::{growth::{CrackGrowth, GrowthParams}, pattern::{Moment, SurfaceFrame}, raster::{DepthField, Profile, Replay, ReplayChanges}};
    ///
    /// let frame = SurfaceFrame::new([64, 64].into())?;
    /// let mut growth = CrackGrowth::new(GrowthParams::default(), frame.extent(), 7)?;
    /// growth.hit([0.5, 0.5].into(), 1.0);
    /// while growth.step().grew() {}
    /// // The field was drawn on by others.
    /// let (mut field, mut redrawn) = (DepthField::new(frame), ReplayChanges::default());
    /// field.depth.as_mut_slice().fill(9);
    /// let mut replay = Replay::stale(frame.size(), Profile::default());
    /// replay.show(&mut field, growth.network(), growth.timeline(), Moment::START, &mut redrawn);
    /// assert_eq!(replay.at(), Moment::START);
    /// assert_eq!(field, DepthField::new(frame));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn stale(size: UVec2, profile: Profile) -> Self {
        Self { is_stale: true, ..Self::new(size, profile) }
    }

    /// The moment that the field shows.
    #[must_use]
    pub const fn at(&self) -> Moment {
        self.at
    }

    /// Whether the next move redraws the whole field.
    #[cfg(feature = "bevy")]
    pub(crate) const fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// Makes `field` show `network` at the moment `to`, and writes the changes to `redrawn`.
    ///
    /// `field` must be the field of the moves before, unchanged (a field of another size is redrawn completely).
    /// `network` and `timeline` must belong to one growth, which may have grown since.
    pub fn show(
        &mut self,
        field: &mut DepthField,
        network: &Network,
        timeline: &Timeline,
        to: Moment,
        redrawn: &mut ReplayChanges,
    ) {
        self.show_lines(field, network, timeline, to, redrawn);
        field.crush(usize::MAX, &mut redrawn.changed);
    }

    /// Like [`show`](Self::show) without the [crushed](DepthField::crush) zones.
    pub(crate) fn show_lines(
        &mut self,
        field: &mut DepthField,
        network: &Network,
        timeline: &Timeline,
        to: Moment,
        redrawn: &mut ReplayChanges,
    ) {
        self.begin(field, network, timeline, to, redrawn);
        while !self.draw(field, network, timeline, usize::MAX, redrawn) {}
        self.end(field, network, timeline, redrawn);
    }

    /// The first part of [`show`](Self::show): clears the tiles that will be redrawn.
    pub(crate) fn begin(
        &mut self,
        field: &mut DepthField,
        network: &Network,
        timeline: &Timeline,
        to: Moment,
        redrawn: &mut ReplayChanges,
    ) {
        if field.depth.size() != self.size {
            *self = Self::stale(field.depth.size(), self.profile);
        }
        redrawn.clear();
        self.turn += 1;
        let seen = self.index_new(field, network, timeline);
        if std::mem::take(&mut self.is_stale) {
            for tile in 0..self.tiles.x * self.tiles.y {
                self.mark_tile(tile);
            }
        } else {
            self.mark_changes(timeline, seen, to);
        }
        self.at = to;
        self.drawn = 0;
        self.clear_marked(field, redrawn);
    }

    /// Marks the tiles under everything that differs between the shown moment and `to`. The entries `seen` of the
    /// timeline are shown.
    fn mark_changes(&mut self, timeline: &Timeline, seen: Entries, to: Moment) {
        let (early, late) = (self.at.min(to), self.at.max(to));
        // Steps that have begun at one moment and are not over at the other, and steps added since, if they have
        // begun.
        let (over, begun, new) =
            (timeline.entries(early.whole()), timeline.entries(late.begun()), timeline.entries(to.begun()));
        let range = |count: fn(&Entries) -> usize| {
            let seen = count(&seen);
            (count(&over).min(seen)..count(&begun).min(seen)).chain(seen..count(&new).max(seen))
        };
        for node in range(|entries| entries.nodes) {
            self.mark_part(self.nodes[node].part);
        }
        for widening in range(|entries| entries.widenings) {
            let Some(node) = timeline.widened(widening) else { continue };
            self.mark_width(timeline, node as usize, late);
        }
        for link in range(|entries| entries.links) {
            self.mark_part(self.links[link]);
        }
        let (nodes, links) = timeline.opening(early.whole());
        for node in nodes.take_while(|&node| node < seen.nodes) {
            self.mark_width(timeline, node, late);
        }
        for link in links.take_while(|&link| link < seen.links) {
            self.mark_part(self.links[link]);
        }
        for dot in range(|entries| entries.dots) {
            self.mark_part(self.dots[dot]);
        }
    }

    /// Marks the segments that change with the width of a node: a branch tapers between two widths.
    fn mark_width(&mut self, timeline: &Timeline, node: usize, late: Moment) {
        let TreeLinks { part, mut child, .. } = self.nodes[node];
        self.mark_part(part);
        while child != NONE {
            let node_links = self.nodes[child as usize];
            if timeline.step_of(SegmentId::Branch(child)).is_some_and(|step| step <= late.begun()) {
                self.mark_part(node_links.part);
            }
            child = node_links.sibling;
        }
    }

    fn mark_part(&mut self, part: u32) {
        let Some(part) = self.parts.get_mut(part as usize) else { return };
        if std::mem::replace(&mut part.changed, self.turn) == self.turn {
            return;
        }
        let rect = tiles_of(part.rect, TILE);
        for y in rect.min.y..rect.max.y {
            for x in rect.min.x..rect.max.x {
                self.mark_tile(y * self.tiles.x + x);
            }
        }
    }

    fn mark_tile(&mut self, tile: u32) {
        if std::mem::replace(&mut self.tile_marks[tile as usize], self.turn) != self.turn {
            self.marked.push(tile);
        }
    }

    fn tile(&self, tile: u32) -> TexelRect {
        let min = UVec2::new(tile % self.tiles.x, tile / self.tiles.x) * TILE;
        TexelRect { min, max: (min + TILE).min(self.size) }
    }

    /// Clears the marked tiles and keeps a copy of their texels.
    fn clear_marked(&mut self, field: &mut DepthField, redrawn: &mut ReplayChanges) {
        self.before.clear();
        for &tile in &self.marked {
            let rect = self.tile(tile);
            let mut before = [0; (TILE * TILE) as usize];
            for (y, kept) in (rect.min.y..rect.max.y).zip(before.chunks_exact_mut(TILE as usize)) {
                let row = &mut field.depth.row_mut(y as usize)[rect.min.x as usize..rect.max.x as usize];
                kept[..row.len()].copy_from_slice(row);
                row.fill(0);
            }
            self.before.push(before);
            redrawn.cleared.push(rect);
        }
        self.veils_before.clear();
        let Some(veil) = &mut field.layer.veil else { return };
        for &tile in &self.marked {
            let rect = self.tile(tile);
            let mut before = [0; (TILE * TILE) as usize];
            for (y, kept) in (rect.min.y..rect.max.y).zip(before.chunks_exact_mut(TILE as usize)) {
                let row = &mut veil.density_mut().row_mut(y as usize)[rect.min.x as usize..rect.max.x as usize];
                kept[..row.len()].copy_from_slice(row);
                row.fill(0);
            }
            self.veils_before.push(before);
        }
    }

    /// The second part: stamps every segment that touches a marked tile. Outside the marked tiles this changes
    /// nothing, because the segment is already there. Visits no more than about `most` segments; returns whether it
    /// is done.
    pub(crate) fn draw(
        &mut self,
        field: &mut DepthField,
        network: &Network,
        timeline: &Timeline,
        most: usize,
        redrawn: &mut ReplayChanges,
    ) -> bool {
        let columns = self.tiles.x.div_ceil(CELL);
        let mut looked_at = 0;
        while let Some(&tile) = self.marked.get(self.drawn).filter(|_| looked_at < most) {
            self.drawn += 1;
            let cell = tile / self.tiles.x / CELL * columns + tile % self.tiles.x / CELL;
            if std::mem::replace(&mut self.cell_marks[cell as usize], self.turn) == self.turn {
                continue;
            }
            looked_at += self.cells[cell as usize].len();
            for &part in &self.cells[cell as usize] {
                let part = &mut self.parts[part as usize];
                if std::mem::replace(&mut part.visited, self.turn) == self.turn {
                    continue;
                }
                let rect = tiles_of(part.rect, TILE);
                let is_marked = |x, y| self.tile_marks[(y * self.tiles.x + x) as usize] == self.turn;
                if !(rect.min.y..rect.max.y).any(|y| (rect.min.x..rect.max.x).any(|x| is_marked(x, y))) {
                    continue;
                }
                match part.what {
                    What::Segment(segment) => {
                        if let Some(path) = timeline.path_at(network, segment, self.at) {
                            redrawn.stamped.push(stamp_path(field, &self.profile, &path));
                        }
                    }
                    What::Dot(dot) => {
                        if let Some(dot) = timeline.dot_at(dot, self.at) {
                            stamp_dot(field, dot.pos, dot.radius, DOT_DEPTH);
                        }
                    }
                }
            }
        }
        self.drawn == self.marked.len()
    }

    /// The third part: records the texels of the marked tiles that differ from before, and updates all other layers
    /// of the field except the [crushed](DepthField::crush) zones.
    pub(crate) fn end(
        &mut self,
        field: &mut DepthField,
        network: &Network,
        timeline: &Timeline,
        redrawn: &mut ReplayChanges,
    ) {
        for (&tile, before) in self.marked.iter().zip(&self.before) {
            let rect = self.tile(tile);
            let changed = differing(&field.depth, before, rect);
            if !changed.is_empty() {
                redrawn.changed.push(changed);
            }
        }
        if let Some(veils) = field.layer.veil() {
            for (&tile, before) in self.marked.iter().zip(&self.veils_before) {
                let changed = differing(veils, before, self.tile(tile));
                if !changed.is_empty() {
                    redrawn.changed.push(changed);
                }
            }
        }
        self.marked.clear();
        field.begin_layer(network, timeline, self.at, &mut redrawn.changed);
    }

    /// Adds new entries of the timeline to the index; returns the entries that were in it before.
    fn index_new(&mut self, field: &DepthField, network: &Network, timeline: &Timeline) -> Entries {
        let (seen, all) = (self.seen, timeline.entries(u32::MAX));
        if seen == all {
            return seen;
        }
        self.seen = all;
        for node in seen.nodes..all.nodes {
            let parent = network.nodes().get(node).map_or(NO_PARENT, |node| node.parent);
            let id = node as u32;
            let mut node_links = TreeLinks { part: NONE, child: NONE, sibling: NONE };
            if let Some(parent) = self.nodes.get_mut(parent as usize) {
                node_links.sibling = std::mem::replace(&mut parent.child, id);
                node_links.part = self.add(What::Segment(SegmentId::Branch(id)));
            }
            self.nodes.push(node_links);
            self.measure(node_links.part, field, network, timeline);
        }
        for link in seen.links..all.links {
            let part = self.add(What::Segment(SegmentId::Link(link as u32)));
            self.links.push(part);
            self.measure(part, field, network, timeline);
        }
        for dot in seen.dots..all.dots {
            let part = self.add(What::Dot(dot as u32));
            self.dots.push(part);
            self.measure(part, field, network, timeline);
        }
        for widening in seen.widenings..all.widenings {
            let Some(node) = timeline.widened(widening) else { continue };
            self.measure(self.nodes[node as usize].part, field, network, timeline);
            let mut child = self.nodes[node as usize].child;
            while child != NONE {
                self.measure(self.nodes[child as usize].part, field, network, timeline);
                child = self.nodes[child as usize].sibling;
            }
        }
        seen
    }

    fn add(&mut self, what: What) -> u32 {
        self.parts.push(Part { what, rect: TexelRect::default(), changed: 0, visited: 0 });
        self.parts.len() as u32 - 1
    }

    /// Computes the rectangle of a part, and adds the part to the cells that it newly touches.
    fn measure(&mut self, index: u32, field: &DepthField, network: &Network, timeline: &Timeline) {
        let Some(part) = self.parts.get_mut(index as usize) else { return };
        let (low, high, radius) = match part.what {
            What::Segment(segment) => {
                let Some(path) = network.path(segment) else { return };
                let none = (Vec2::INFINITY, Vec2::NEG_INFINITY, 0.0f32);
                path.points().iter().fold(none, |(low, high, radius), point| {
                    (low.min(point.pos), high.max(point.pos), radius.max(0.5 * point.width))
                })
            }
            What::Dot(dot) => {
                let Some(dot) = timeline.dot(dot as usize) else { return };
                (dot.pos, dot.pos, dot.radius)
            }
        };
        // An uneven edge deviates by less than the half width. The edge of a stamp is one texel wide; one more for rounding.
        let [ragged, chipped] = [self.profile.ragged, self.profile.chipped].map(|most| most.max(0.0).min(radius));
        let reach = (radius + self.profile.rim_width.max(0.0) + ragged + chipped) * field.frame.texels_per_unit() + 2.5;
        let hang = match (part.what, &field.layer.veil) {
            (What::Segment(_), Some(veil)) => veil.hang(),
            _ => (Vec2::ZERO, Vec2::ZERO),
        };
        let (low, high) = (field.frame.to_texel(low), field.frame.to_texel(high));
        let rect = TexelRect {
            min: (low + hang.0 - reach).max(Vec2::ZERO).as_uvec2(),
            max: (high + hang.1 + reach).ceil().max(Vec2::ZERO).as_uvec2().min(self.size),
        };
        let before = part.rect;
        part.rect = before.union(rect);
        let (old, new) = (tiles_of(before, TILE * CELL), tiles_of(part.rect, TILE * CELL));
        if old == new {
            return;
        }
        let columns = self.tiles.x.div_ceil(CELL);
        for y in new.min.y..new.max.y {
            for x in new.min.x..new.max.x {
                let cell = UVec2::new(x, y);
                if cell.cmplt(old.min).any() || cell.cmpge(old.max).any() {
                    self.cells[(y * columns + x) as usize].push(index);
                }
            }
        }
    }
}

/// The texels of a tile at `rect` that differ from before.
fn differing<T: Copy + PartialEq>(now: &Grid<T>, before: &[T; (TILE * TILE) as usize], rect: TexelRect) -> TexelRect {
    let mut changed = TexelRect::default();
    for (y, kept) in (rect.min.y..rect.max.y).zip(before.chunks_exact(TILE as usize)) {
        let row = &now.row(y as usize)[rect.min.x as usize..rect.max.x as usize];
        let mut differing = (rect.min.x..).zip(row.iter().zip(kept)).filter(|(_, (a, b))| a != b);
        if let Some((first, _)) = differing.next() {
            let last = differing.last().map_or(first, |(x, _)| x);
            changed = changed.union(TexelRect { min: UVec2::new(first, y), max: UVec2::new(last + 1, y + 1) });
        }
    }
    changed
}

/// Columns and rows of the tiles of `side` that `rect` touches.
fn tiles_of(rect: TexelRect, side: u32) -> TexelRect {
    if rect.is_empty() {
        return TexelRect::default();
    }
    TexelRect { min: rect.min / side, max: (rect.max - 1) / side + 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        growth::{CrackGrowth, GrowthParams},
        pattern::SurfaceFrame,
    };

    /// Edges that deviate by many texels are taken back with their cracks.
    #[test]
    fn ragged_and_chipped_edges_are_taken_back() {
        for (seed, unit, chipped) in
            [(1, 1500.0, 0.0), (2, 2048.0, 0.0), (3, 2048.0, 0.0), (1, 1500.0, 0.02), (2, 2048.0, 0.012)]
        {
            let frame = SurfaceFrame::with_unit(UVec2::new(420, 300), unit).unwrap();
            let params = GrowthParams { line_width: 0.03, max_width: 0.04, reach: 0.15, ..GrowthParams::DEFAULT };
            let profile = Profile { ragged: 0.012, chipped, rubble: 0.5, edge: 0.5, ..Profile::DEFAULT };
            let mut growth = CrackGrowth::new(params, frame.extent(), seed).unwrap();
            growth.hit(0.5 * frame.extent(), 1.0);
            while growth.step().grew() {}
            let (network, timeline) = (growth.network(), growth.timeline());
            let (mut field, mut changes) = (DepthField::new(frame), ReplayChanges::default());
            let mut replay = Replay::new(frame.size(), profile);
            for step in (0..=timeline.end()).rev() {
                let at = Moment::after(step);
                replay.show(&mut field, network, timeline, at, &mut changes);
                let mut fresh = DepthField::new(frame);
                for path in network.segments().filter_map(|segment| timeline.path_at(network, segment, at)) {
                    stamp_path(&mut fresh, &profile, &path);
                }
                assert!(field.depth == fresh.depth, "seed {seed}, after {step} steps");
            }
            assert!(timeline.end() > 2 && field.depth.as_slice().iter().all(|&depth| depth == 0));
        }
    }
}
